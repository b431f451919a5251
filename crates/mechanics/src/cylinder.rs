//! Wheels as closed meshes: a cylinder, smooth or with straight grousers.

use crate::TriangleMesh;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// Straight bars across the tread, radial, evenly spaced, the first at angle 0 (+X).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Grousers {
    /// How many, at least 1.
    pub count: u32,
    /// Height above the cylinder (m).
    pub height: f64,
    /// Thickness along the circumference (m).
    pub thickness: f64,
}

/// A wheel about the Y axis, centred at the origin.
///
/// **The undeformed wheel radius is `radius`, that of the cylinder without its grousers**: slip, sinkage and rolling
/// radius refer to it. Vertices of the cylinder lie on that radius, so facets lie inside it by at most
/// radius (1 - cos(pi / divisions)): 0.14 % at 60 divisions. Grouser tips reach `radius + height`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cylinder {
    /// Undeformed wheel radius (m).
    pub radius: f64,
    /// Width along Y (m).
    pub width: f64,
    /// Facets around the circumference, at least 8. Grousers take their share; each gap gets at least one.
    pub divisions: u32,
    /// Grousers, if any.
    pub grousers: Option<Grousers>,
}

/// Why there is no such wheel.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CylinderError {
    /// A length is not positive and finite.
    #[error("{name} {value} m: must be finite and above 0")]
    Length {
        /// Which length.
        name: &'static str,
        /// The value given.
        value: f64,
    },
    /// Too few or too many divisions.
    #[error("divisions {0}: allowed 8 to 10000")]
    Divisions(u32),
    /// Grousers overlap or there is none.
    #[error(
        "grouser count {count} of thickness {thickness} m on radius {radius} m: allowed 1 to {max}, so that each gap is at least as wide as 1 % of a grouser"
    )]
    Count {
        /// How many were asked for.
        count: u32,
        /// Their thickness (m).
        thickness: f64,
        /// The wheel's radius (m).
        radius: f64,
        /// How many fit.
        max: u32,
    },
}

impl Cylinder {
    /// A wheel without grousers.
    pub fn smooth(radius: f64, width: f64, divisions: u32) -> Self {
        Self { radius, width, divisions, grousers: None }
    }

    /// The closed mesh, wound outward. Tread quads are about as wide as long; the sides are rings of triangles of about
    /// the same size, since slivers from the hub to the tread would have large boxes in a contact search.
    ///
    /// # Errors
    /// [`CylinderError`] names the first input that is not allowed.
    pub fn mesh(&self) -> Result<TriangleMesh, CylinderError> {
        self.check()?;
        let (profile, base) = self.profile();
        let spacing = TAU * self.radius / f64::from(self.divisions);
        let rows = ((self.width / spacing).round() as usize).clamp(1, 1000);
        let n = profile.len();
        let mut mesh = TriangleMesh::default();
        for j in 0..=rows {
            let y = self.width * (j as f64 / rows as f64 - 0.5);
            mesh.vertices.extend(profile.iter().map(|&[x, z]| [x, y, z]));
        }
        let at = |j: usize, k: usize| (j * n + k % n) as u32;
        for j in 0..rows {
            for k in 0..n {
                let [a, b, c, d] = [at(j, k), at(j, k + 1), at(j + 1, k + 1), at(j + 1, k)];
                // Alternate diagonals: a tread without a handedness.
                if (j + k) % 2 == 0 {
                    mesh.triangles.extend([[a, b, c], [a, c, d]]);
                } else {
                    mesh.triangles.extend([[a, b, d], [b, c, d]]);
                }
            }
        }
        for (j, outward) in [(0, false), (rows, true)] {
            self.side(&mut mesh, j as u32 * n as u32, n as u32, &base, spacing, outward);
        }
        Ok(mesh)
    }

    fn check(&self) -> Result<(), CylinderError> {
        let mut lengths = vec![("radius", self.radius), ("width", self.width)];
        if let Some(g) = self.grousers {
            lengths.extend([("grouser height", g.height), ("grouser thickness", g.thickness)]);
        }
        for (name, value) in lengths {
            if !(value > 0.0 && value.is_finite()) {
                return Err(CylinderError::Length { name, value });
            }
        }
        if !(8..=10_000).contains(&self.divisions) {
            return Err(CylinderError::Divisions(self.divisions));
        }
        if let Some(g) = self.grousers {
            let half = (0.5 * g.thickness / self.radius).min(1.0).asin();
            let max = (TAU / (2.0 * half * 1.01)) as u32;
            // A bar as thick as a third of the wheel's girth is no grouser; asin has also ended by then.
            if g.count == 0 || g.count > max || g.thickness >= self.radius {
                let max = if g.thickness >= self.radius { 0 } else { max };
                return Err(CylinderError::Count { count: g.count, thickness: g.thickness, radius: self.radius, max });
            }
        }
        Ok(())
    }

    /// The outline (x, z), turning about +Y from +X towards -Z (the right-hand rule), and for each of its points
    /// whether it is a point of the cylinder (true) or a grouser's tip.
    fn profile(&self) -> (Vec<[f64; 2]>, Vec<bool>) {
        let r = self.radius;
        let on_circle = |angle: f64| [r * angle.cos(), -r * angle.sin()];
        let Some(g) = self.grousers else {
            let n = self.divisions;
            return ((0..n).map(|k| on_circle(TAU * f64::from(k) / f64::from(n))).collect(), vec![true; n as usize]);
        };
        let half = (0.5 * g.thickness / r).asin();
        let gap = TAU / f64::from(g.count) - 2.0 * half;
        let segments = ((gap / TAU * f64::from(self.divisions)).round() as u32).max(1);
        let (mut points, mut base) = (Vec::new(), Vec::new());
        for k in 0..g.count {
            let middle = TAU * f64::from(k) / f64::from(g.count);
            let (sin, cos) = middle.sin_cos();
            // Local radial and tangential coordinates to (x, z).
            let place =
                |radial: f64, tangential: f64| [radial * cos - tangential * sin, -(radial * sin + tangential * cos)];
            let foot = r * half.cos();
            for (radial, tangential, is_base) in [
                (foot, -0.5 * g.thickness, true),
                (r + g.height, -0.5 * g.thickness, false),
                (r + g.height, 0.5 * g.thickness, false),
                (foot, 0.5 * g.thickness, true),
            ] {
                points.push(place(radial, tangential));
                base.push(is_base);
            }
            for s in 1..segments {
                points.push(on_circle(middle + half + gap * f64::from(s) / f64::from(segments)));
                base.push(true);
            }
        }
        (points, base)
    }

    /// Fills one side: the profile's vertices are `start .. start + n` of the mesh.
    fn side(&self, mesh: &mut TriangleMesh, start: u32, n: u32, base: &[bool], spacing: f64, outward: bool) {
        let mut add = |mesh: &mut TriangleMesh, [a, b, c]: [u32; 3]| {
            mesh.triangles.push(if outward { [a, b, c] } else { [a, c, b] });
        };
        // Grousers: the quad foot, tip, tip, foot.
        for k in 0..n as usize {
            if !base[k] && base[(k + n as usize - 1) % n as usize] {
                let q = |i: usize| start + ((k + n as usize - 1 + i) % n as usize) as u32;
                // A vertex list that turns with the profile faces +Y; see `ring`.
                add(mesh, [q(0), q(1), q(2)]);
                add(mesh, [q(0), q(2), q(3)]);
            }
        }
        let mut outer: Vec<u32> = (0..n).filter(|&k| base[k as usize]).map(|k| start + k).collect();
        let y = mesh.vertices[start as usize][1];
        let rings = ((self.radius / spacing).round() as u32).max(1);
        for ring in (1..rings).rev() {
            let radius = self.radius * f64::from(ring) / f64::from(rings);
            let count = ((TAU * radius / spacing).round() as u32).max(6);
            let first = mesh.vertices.len() as u32;
            for k in 0..count {
                let angle = TAU * f64::from(k) / f64::from(count);
                mesh.vertices.push([radius * angle.cos(), y, -radius * angle.sin()]);
            }
            let inner: Vec<u32> = (first..first + count).collect();
            stitch(mesh, &outer, &inner, &mut add);
            outer = inner;
        }
        let hub = mesh.vertices.len() as u32;
        mesh.vertices.push([0.0, y, 0.0]);
        for k in 0..outer.len() {
            add(mesh, [hub, outer[k], outer[(k + 1) % outer.len()]]);
        }
    }
}

/// Angle about +Y of vertex `v`, in [0, 2 pi), from the first ring vertex on.
fn angle_of(mesh: &TriangleMesh, v: u32) -> f64 {
    let [x, _, z] = mesh.vertices[v as usize];
    (-z).atan2(x).rem_euclid(TAU)
}

/// Triangles between two closed rings that turn the same way about +Y, always advancing on the ring that lags behind.
fn stitch(mesh: &mut TriangleMesh, outer: &[u32], inner: &[u32], add: &mut impl FnMut(&mut TriangleMesh, [u32; 3])) {
    // Both rings start at their smallest angle; the outer one may start just below +X (the foot of a grouser).
    let unwrap = |mesh: &TriangleMesh, ring: &[u32]| {
        let mut angles: Vec<f64> = ring.iter().map(|&v| angle_of(mesh, v)).collect();
        for k in 0..angles.len() {
            if k == 0 && angles[0] > 0.75 * TAU {
                angles[0] -= TAU;
            } else if k > 0 && angles[k] < angles[k - 1] {
                angles[k] += TAU;
            }
        }
        angles.push(angles[0] + TAU);
        angles
    };
    let (a, b) = (unwrap(mesh, outer), unwrap(mesh, inner));
    let (mut i, mut j) = (0, 0);
    while i < outer.len() || j < inner.len() {
        let (o, p) = (outer[i % outer.len()], inner[j % inner.len()]);
        let outer_next = j == inner.len() || (i < outer.len() && a[i] + a[i + 1] <= b[j] + b[j + 1]);
        if outer_next {
            add(mesh, [p, o, outer[(i + 1) % outer.len()]]);
            i += 1;
        } else {
            add(mesh, [p, o, inner[(j + 1) % inner.len()]]);
            j += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn smallest_angle(mesh: &TriangleMesh) -> f64 {
        let mut smallest = f64::MAX;
        for t in 0..mesh.triangles.len() {
            let p = mesh.corners(t);
            for k in 0..3 {
                smallest = smallest.min((p[(k + 1) % 3] - p[k]).angle(&(p[(k + 2) % 3] - p[k])));
            }
        }
        smallest.to_degrees()
    }

    #[test]
    fn smooth_wheels_are_closed_outward_and_well_shaped() {
        for (r, b, n) in [(0.058, 0.05, 60), (0.47, 0.3, 90), (0.1, 0.01, 16), (0.05, 0.4, 8)] {
            let mesh = Cylinder::smooth(r, b, n).mesh().unwrap();
            let report = mesh.check();
            assert!(report.is_closed(), "{n}: {report}");
            assert!(smallest_angle(&mesh) > 14.0, "{n}: {}", smallest_angle(&mesh));
            let [lo, hi] = mesh.bounds().unwrap();
            assert!((hi.x - r).abs() < 1e-15 && (hi.y - b / 2.0).abs() < 1e-15 && (lo.y + b / 2.0).abs() < 1e-15);
            let rim = mesh.vertices.iter().filter(|p| (p[0].hypot(p[2]) - r).abs() < 1e-12).count();
            assert!(rim % n as usize == 0);
        }
    }

    #[test]
    fn grouser_wheels_are_closed_and_have_the_volume_of_their_parts() {
        for (count, height, thickness, n) in [(12, 0.006, 0.002, 60), (1, 0.01, 0.01, 24), (40, 0.003, 0.004, 30)] {
            let wheel =
                Cylinder { grousers: Some(Grousers { count, height, thickness }), ..Cylinder::smooth(0.058, 0.05, n) };
            let mesh = wheel.mesh().unwrap();
            let report = mesh.check();
            assert!(report.is_closed(), "{count}: {report}");
            // The outline is a polygon that is star-shaped about the axle: its area by the shoelace formula.
            let (p, _) = wheel.profile();
            let area: f64 = (0..p.len())
                .map(|k| (k, (k + 1) % p.len()))
                .map(|(k, l)| 0.5 * (p[l][0] * p[k][1] - p[k][0] * p[l][1]))
                .sum();
            assert!((mesh.signed_volume() / (area * 0.05) - 1.0).abs() < 1e-12);
            let reach = mesh.vertices.iter().map(|p| p[0].hypot(p[2])).fold(0.0, f64::max);
            assert!((reach - (0.058 + height).hypot(thickness / 2.0)).abs() < 1e-12);
        }
    }

    #[test]
    fn impossible_wheels_are_refused() {
        let grousers = |count, thickness| Cylinder {
            grousers: Some(Grousers { count, height: 0.01, thickness }),
            ..Cylinder::smooth(0.1, 0.1, 40)
        };
        assert!(Cylinder::smooth(-0.1, 0.1, 40).mesh().unwrap_err().to_string().contains("radius -0.1 m"));
        assert!(Cylinder::smooth(0.1, f64::NAN, 40).mesh().is_err());
        assert!(Cylinder::smooth(0.1, 0.1, 3).mesh().unwrap_err().to_string().contains("allowed 8"));
        assert!(grousers(0, 0.01).mesh().is_err());
        assert!(grousers(70, 0.01).mesh().unwrap_err().to_string().contains("allowed 1 to 62"));
        assert!(grousers(2, 0.3).mesh().is_err());
    }
}
