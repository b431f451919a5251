//! The point of a triangle nearest to a given point.

use crate::dem::vec3::{Vec3, add_scaled, cross, dot, sub};

/// Where on a facet a point lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Feature {
    /// Inside.
    Face,
    /// On the side from corner k to corner k + 1.
    Edge(u8),
    /// At corner k.
    Corner(u8),
}

/// The nearest point of a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Closest {
    /// Its barycentric weights on the three corners; they sum to 1.
    pub weights: [f64; 3],
    /// The point.
    pub point: Vec3,
    /// Where it lies.
    pub feature: Feature,
    /// (b - a) x (c - a): outward, of length twice the area.
    pub area_vector: Vec3,
    /// The triangle has no area to speak of: the point lies on one of its sides, and its normal means nothing.
    pub degenerate: bool,
}

/// Sine of the angle below which a triangle counts as degenerate: its height is then 1e-8 of its longest side, and a
/// couple carried by it would need forces 1e8 times the couple over that side.
const DEGENERATE: f64 = 1e-8;

/// The point of triangle `[a, b, c]` nearest to `p`, by the Voronoi regions of its corners, sides and face (the method of
/// Ericson, Real-Time Collision Detection, 2005, 5.1.5). Works for triangles without area too.
#[inline]
pub fn closest_on_triangle(p: Vec3, [a, b, c]: [Vec3; 3]) -> Closest {
    let (ab, ac, ap) = (sub(b, a), sub(c, a), sub(p, a));
    let area_vector = cross(ab, ac);
    let longest = dot(ab, ab).max(dot(ac, ac));
    let degenerate = dot(area_vector, area_vector) <= DEGENERATE * DEGENERATE * longest * longest;
    let done =
        |weights: [f64; 3], point: Vec3, feature: Feature| Closest { weights, point, feature, area_vector, degenerate };
    if degenerate {
        return on_sides(p, [a, b, c], area_vector);
    }
    let (d1, d2) = (dot(ab, ap), dot(ac, ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return done([1.0, 0.0, 0.0], a, Feature::Corner(0));
    }
    let bp = sub(p, b);
    let (d3, d4) = (dot(ab, bp), dot(ac, bp));
    if d3 >= 0.0 && d4 <= d3 {
        return done([0.0, 1.0, 0.0], b, Feature::Corner(1));
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        let t = d1 / (d1 - d3);
        return done([1.0 - t, t, 0.0], add_scaled(a, t, ab), Feature::Edge(0));
    }
    let cp = sub(p, c);
    let (d5, d6) = (dot(ab, cp), dot(ac, cp));
    if d6 >= 0.0 && d5 <= d6 {
        return done([0.0, 0.0, 1.0], c, Feature::Corner(2));
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        let t = d2 / (d2 - d6);
        return done([1.0 - t, 0.0, t], add_scaled(a, t, ac), Feature::Edge(2));
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 >= d3 && d5 >= d6 {
        let t = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return done([0.0, 1.0 - t, t], add_scaled(b, t, sub(c, b)), Feature::Edge(1));
    }
    let sum = va + vb + vc;
    let (v, w) = (vb / sum, vc / sum);
    done([1.0 - v - w, v, w], add_scaled(add_scaled(a, v, ab), w, ac), Feature::Face)
}

#[cold]
fn on_sides(p: Vec3, corners: [Vec3; 3], area_vector: Vec3) -> Closest {
    let mut best: Option<(f64, Closest)> = None;
    for k in 0..3 {
        let l = (k + 1) % 3;
        let (t, point) = closest_on_segment(p, corners[k], corners[l]);
        let d = sub(p, point);
        let d2 = dot(d, d);
        if best.as_ref().is_none_or(|(least, _)| d2 < *least) {
            let mut weights = [0.0; 3];
            weights[k] = 1.0 - t;
            weights[l] += t;
            let feature = match t {
                0.0 => Feature::Corner(k as u8),
                1.0 => Feature::Corner(l as u8),
                _ => Feature::Edge(k as u8),
            };
            best = Some((d2, Closest { weights, point, feature, area_vector, degenerate: true }));
        }
    }
    // Three sides were tried and none compares below NaN: then the first corner is as good as any.
    best.map_or(
        Closest {
            weights: [1.0, 0.0, 0.0],
            point: corners[0],
            feature: Feature::Corner(0),
            area_vector,
            degenerate: true,
        },
        |(_, c)| c,
    )
}

/// The point of segment `a b` nearest to `p`, and its place from 0 at `a` to 1 at `b`.
#[inline]
pub fn closest_on_segment(p: Vec3, a: Vec3, b: Vec3) -> (f64, Vec3) {
    let ab = sub(b, a);
    let length2 = dot(ab, ab);
    let t = if length2 > 0.0 { (dot(sub(p, a), ab) / length2).clamp(0.0, 1.0) } else { 0.0 };
    (t, if t == 1.0 { b } else { add_scaled(a, t, ab) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dem::vec3::norm;

    const T: [Vec3; 3] = [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 1.0, 0.0]];

    #[test]
    fn every_region() {
        for (p, feature, point) in [
            ([0.5, 0.2, 3.0], Feature::Face, [0.5, 0.2, 0.0]),
            ([1.0, -2.0, 1.0], Feature::Edge(0), [1.0, 0.0, 0.0]),
            ([-1.0, 0.5, 1.0], Feature::Edge(2), [0.0, 0.5, 0.0]),
            ([2.0, 2.0, 0.0], Feature::Edge(1), [1.2, 0.4, 0.0]),
            ([-1.0, -1.0, 0.0], Feature::Corner(0), T[0]),
            ([4.0, -1.0, 0.0], Feature::Corner(1), T[1]),
            ([-0.1, 4.0, 0.0], Feature::Corner(2), T[2]),
        ] {
            let c = closest_on_triangle(p, T);
            assert_eq!(c.feature, feature, "{p:?}");
            assert!(norm(sub(c.point, point)) < 1e-15, "{p:?}: {:?}", c.point);
            let by_weights: Vec3 = std::array::from_fn(|k| (0..3).map(|v| c.weights[v] * T[v][k]).sum());
            assert!(norm(sub(by_weights, point)) < 1e-15);
        }
    }

    #[test]
    fn triangles_without_area_are_segments_or_points() {
        let line = [[0.0; 3], [1.0, 0.0, 0.0], [3.0, 0.0, 0.0]];
        let c = closest_on_triangle([2.0, 1.0, 0.0], line);
        assert!(c.degenerate && norm(sub(c.point, [2.0, 0.0, 0.0])) < 1e-15);
        let c = closest_on_triangle([2.0, 1.0, 0.0], [[1.0; 3]; 3]);
        assert!(c.degenerate && c.point == [1.0; 3] && c.weights.iter().sum::<f64>() == 1.0);
    }
}
