//! A vehicle drawn by bars from the centres of its wheels: axles, rails, outlines of hull and cabin. A schematic: it shows where the vehicle
//! is and how it leans, and hides no tire.

use super::scene::SceneMesh;

/// Shares of the wheelbase: overhang, height of the hull's floor, of its top and of the cabin's above the wheel centres, thickness of a bar.
const OVERHANG: f64 = 0.22;
const FLOOR: f64 = 0.06;
const HULL: f64 = 0.22;
const ROOF: f64 = 0.42;
const BAR: f64 = 0.012;
/// Width of hull over track.
const WIDTH: f64 = 0.62;
/// Ends of the cabin along the hull, from behind (shares of the wheelbase from the rear axle).
const CABIN: [f64; 2] = [0.12, 0.72];

type Point = [f64; 3];

fn mix(a: Point, b: Point, t: f64) -> Point {
    std::array::from_fn(|k| a[k] + t * (b[k] - a[k]))
}

fn less(a: Point, b: Point) -> Point {
    std::array::from_fn(|k| a[k] - b[k])
}

fn length(a: Point) -> f64 {
    a.iter().map(|x| x * x).sum::<f64>().sqrt()
}

fn cross(a: Point, b: Point) -> Point {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn unit(a: Point) -> Option<Point> {
    let l = length(a);
    (l.is_finite() && l > 1e-9).then(|| a.map(|x| x / l))
}

/// The bars for wheels left and right of axle 1, left and right of axle 2, ...; none for fewer than two axles, or wheels in no such order.
pub fn vehicle_frame(wheels: &[Point]) -> Option<SceneMesh> {
    let axles: Vec<[Point; 2]> = wheels.chunks_exact(2).map(|w| [w[0], w[1]]).collect();
    let (front, rear) = (axles.first()?, axles.last()?);
    if axles.len() < 2 || !wheels.len().is_multiple_of(2) {
        return None;
    }
    let middle = |axle: &[Point; 2]| mix(axle[0], axle[1], 0.5);
    let (ahead, behind) = (middle(front), middle(rear));
    let base = length(less(ahead, behind));
    let forward = unit(less(ahead, behind))?;
    let up = unit(cross(forward, less(front[0], front[1])))?;
    if up[2] <= 0.0 {
        return None;
    }
    let left = cross(up, forward);
    let half = 0.5 * WIDTH * length(less(front[0], front[1]));
    // Along, to the left and up from the middle of the rear axle.
    let at = |x: f64, y: f64, z: f64| -> Point {
        std::array::from_fn(|k| behind[k] + x * base * forward[k] + y * half * left[k] + z * base * up[k])
    };
    let mut bars: Vec<(Point, Point)> = axles.iter().map(|a| (a[0], a[1])).collect();
    let mut outline = |[from, to]: [f64; 2], [low, high]: [f64; 2]| {
        for y in [-1.0, 1.0] {
            bars.extend([low, high].map(|z| (at(from, y, z), at(to, y, z))));
            bars.extend([from, to].map(|x| (at(x, y, low), at(x, y, high))));
        }
        for (x, z) in [(from, low), (from, high), (to, low), (to, high)] {
            bars.push((at(x, -1.0, z), at(x, 1.0, z)));
        }
    };
    outline([-OVERHANG, 1.0 + OVERHANG], [FLOOR, HULL]);
    outline(CABIN, [HULL, ROOF]);
    let mut mesh = SceneMesh::default();
    bars.iter().for_each(|&(a, b)| bar(&mut mesh, a, b, BAR * base));
    Some(mesh)
}

/// Adds a bar of square section.
fn bar(mesh: &mut SceneMesh, a: Point, b: Point, thickness: f64) {
    let Some(along) = unit(less(b, a)) else { return };
    let other = if along[2].abs() < 0.9 { [0.0, 0.0, 1.0] } else { [1.0, 0.0, 0.0] };
    let Some(side) = unit(cross(along, other)) else { return };
    let top = cross(side, along);
    let first = (mesh.points.len() / 3) as i32;
    for end in [a, b] {
        for (s, t) in [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)] {
            mesh.points.extend((0..3).map(|k| end[k] + thickness * (s * side[k] + t * top[k])));
        }
    }
    for k in 0..4 {
        let next = (k + 1) % 4;
        mesh.triangles.extend([k, next, next + 4, k, next + 4, k + 4].map(|n| first + n));
    }
    mesh.triangles.extend([0, 1, 2, 0, 2, 3, 4, 5, 6, 4, 6, 7].map(|n| first + n));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bars_stand_between_and_above_the_wheels() {
        let wheels = [[3.0, 1.0, 0.5], [3.0, -1.0, 0.5], [0.0, 1.0, 0.5], [0.0, -1.0, 0.5]];
        let mesh = vehicle_frame(&wheels).unwrap();
        let range = |c: usize| {
            let of = mesh.points.iter().skip(c).step_by(3);
            of.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(*x), b.max(*x)))
        };
        let close = |a: f64, b: f64| (a - b).abs() < 0.05;
        assert!(close(range(0).0, -0.66) && close(range(0).1, 3.66), "{:?}", range(0));
        assert!(close(range(1).0, -1.0) && close(range(1).1, 1.0));
        assert!(range(2).0 > 0.45 && close(range(2).1, 0.5 + 3.0 * ROOF));
        assert!(mesh.triangles.iter().all(|k| (*k as usize) < mesh.points.len() / 3));
        assert!(vehicle_frame(&wheels[..2]).is_none() && vehicle_frame(&wheels[..3]).is_none());
        let swapped = [wheels[1], wheels[0], wheels[3], wheels[2]];
        assert!(vehicle_frame(&swapped).is_none(), "right before left is no such vehicle");
        assert!(vehicle_frame(&[[f64::NAN; 3]; 4]).is_none());
    }
}
