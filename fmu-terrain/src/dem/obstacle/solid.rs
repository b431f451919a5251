//! What an obstacle looks like, in its own frame: origin at the centre of mass.

use super::contact::POINT_RADIUS;
use crate::dem::cylinder::nearest_on_cylinder;
use crate::dem::error::DemError;
use crate::dem::vec3::{Vec3, add_scaled, norm, scale, sub};
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;
use terramech_mechanics::TriangleMesh;
use terramech_mechanics::cylinder::Cylinder as CylinderMesh;

/// A solid.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Solid {
    /// Radius (m).
    Sphere(f64),
    /// Radius and length (m); axis along the obstacle's y.
    Cylinder(f64, f64),
    /// Edges along x, y, z (m).
    Box(Vec3),
    /// A closed mesh, about its centre of mass.
    Mesh(TriangleMesh),
}

/// How heavy.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum MassOf {
    /// Mass (kg).
    Mass(f64),
    /// Density (kg/m3).
    Density(f64),
}

impl Solid {
    /// A closed mesh as a solid of uniform density: moved so that its centre of mass is the origin.
    ///
    /// # Errors
    /// A mesh that is open or faulty.
    pub fn mesh(mut mesh: TriangleMesh) -> Result<Self, DemError> {
        let solid = mesh.mass_properties(1.0).map_err(|e| DemError::parameter("mesh", "faulty", e.to_string()))?;
        for p in &mut mesh.vertices {
            (0..3).for_each(|c| p[c] -= solid.center[c]);
        }
        Ok(Self::Mesh(mesh))
    }

    /// Mass (kg) and inertia about the centre of mass, axes of the obstacle (kg m2).
    pub fn mass(&self, of: MassOf) -> (f64, [Vec3; 3]) {
        let diagonal = |m: f64, x: f64, y: f64, z: f64| (m, [[m * x, 0.0, 0.0], [0.0, m * y, 0.0], [0.0, 0.0, m * z]]);
        let of_volume = |volume: f64| match of {
            MassOf::Mass(m) => m,
            MassOf::Density(d) => d * volume,
        };
        match self {
            Self::Sphere(r) => {
                let i = 0.4 * r * r;
                diagonal(of_volume(4.0 / 3.0 * PI * r.powi(3)), i, i, i)
            }
            Self::Cylinder(r, l) => {
                let across = (3.0 * r * r + l * l) / 12.0;
                diagonal(of_volume(PI * r * r * l), across, 0.5 * r * r, across)
            }
            Self::Box([a, b, c]) => {
                let third = 1.0 / 12.0;
                diagonal(
                    of_volume(a * b * c),
                    third * (b * b + c * c),
                    third * (a * a + c * c),
                    third * (a * a + b * b),
                )
            }
            Self::Mesh(mesh) => {
                // Faultless, or it would not be a solid.
                let Ok(unit) = mesh.mass_properties(1.0) else { return (f64::NAN, [[f64::NAN; 3]; 3]) };
                let m = of_volume(unit.mass);
                let i = unit.inertia * (m / unit.mass);
                (m, [0, 1, 2].map(|r| [0, 1, 2].map(|c| i[(r, c)])))
            }
        }
    }

    /// Signed distance (m) of a point of the obstacle's frame from the surface, and the direction away from it; none for a mesh, whose
    /// facets are searched instead.
    pub fn nearest(&self, p: Vec3) -> Option<(f64, Vec3)> {
        match self {
            Self::Sphere(r) => {
                let d = norm(p);
                Some((d - r, if d > 0.0 { scale(1.0 / d, p) } else { [0.0, 0.0, 1.0] }))
            }
            Self::Cylinder(r, l) => Some(nearest_on_cylinder(p, [0.0, 1.0, 0.0], *r, 0.5 * l)),
            Self::Box(edges) => {
                let q: Vec3 = std::array::from_fn(|c| p[c].abs() - 0.5 * edges[c]);
                let side = |c: usize| if p[c] < 0.0 { -1.0 } else { 1.0 };
                if q.iter().all(|x| *x <= 0.0) {
                    let c = (0..3).fold(0, |a, c| if q[c] > q[a] { c } else { a });
                    let mut n = [0.0; 3];
                    n[c] = side(c);
                    return Some((q[c], n));
                }
                let out: Vec3 = std::array::from_fn(|c| side(c) * q[c].max(0.0));
                let d = norm(out);
                Some((d, scale(1.0 / d, out)))
            }
            Self::Mesh(_) => None,
        }
    }

    /// Radius of the sphere about the centre that holds it (m).
    pub fn reach(&self) -> f64 {
        match self {
            Self::Sphere(r) => *r,
            Self::Cylinder(r, l) => (r * r + 0.25 * l * l).sqrt(),
            Self::Box(edges) => 0.5 * norm(*edges),
            Self::Mesh(mesh) => mesh.vertices.iter().map(|p| norm(*p)).fold(0.0, f64::max),
        }
    }

    /// Radius that its contact with a plane is reckoned with (m): its own where it is round, else a tenth of its reach.
    pub fn curvature(&self) -> f64 {
        match self {
            Self::Sphere(r) | Self::Cylinder(r, _) => *r,
            _ => 0.1 * self.reach(),
        }
    }

    /// Points of the obstacle's frame that touch a plane first, `down` being the direction into it: the deepest of a sphere, of each
    /// end of a cylinder, all corners of a box or mesh. Their order does not depend on the direction.
    pub fn points(&self, down: Vec3, out: &mut Vec<Vec3>) {
        match self {
            Self::Sphere(r) => out.push(scale(*r, down)),
            Self::Cylinder(r, l) => {
                let across = [down[0], 0.0, down[2]];
                let size = norm(across);
                let rim = if size > 1e-12 { scale(r / size, across) } else { [*r, 0.0, 0.0] };
                out.extend([-0.5, 0.5].map(|side| [rim[0], side * l, rim[2]]));
                if size <= 0.2 {
                    // Standing on an end: three more points carry it.
                    let turned = |a: f64| [r * a.cos(), 0.0, r * a.sin()];
                    out.extend([0.0, 1.0, 2.0, 3.0].map(|k| {
                        let p = turned(0.5 * PI * k);
                        [p[0], if down[1] < 0.0 { -0.5 * l } else { 0.5 * l }, p[2]]
                    }));
                }
            }
            Self::Box(edges) => out.extend(
                (0..8).map(|k| std::array::from_fn(|c| if k >> c & 1 == 0 { -0.5 * edges[c] } else { 0.5 * edges[c] })),
            ),
            Self::Mesh(mesh) => out.extend(&mesh.vertices),
        }
    }

    /// Small spheres on the surface: itself for a sphere; else points along the edges of its mesh, a quarter of its reach apart at most,
    /// drawn in towards the centre by their radius of [`POINT_RADIUS`], so that they end about where the surface does.
    pub fn skin(&self) -> Vec<(Vec3, f64)> {
        if let Self::Sphere(r) = self {
            return vec![([0.0; 3], *r)];
        }
        let (mesh, most) = (self.to_mesh(), 0.25 * self.reach());
        let mut points: Vec<Vec3> = mesh.vertices.clone();
        let mut edges: Vec<[u32; 2]> =
            mesh.triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]).filter(|[a, b]| a < b).collect();
        edges.sort_unstable();
        edges.dedup();
        for [a, b] in edges {
            let [p, q] = [a, b].map(|k| mesh.vertices[k as usize]);
            let parts = (norm(sub(q, p)) / most).ceil();
            for k in 1..parts as u32 {
                points.push(add_scaled(p, f64::from(k) / parts, sub(q, p)));
            }
        }
        let radius = POINT_RADIUS.min(0.1 * self.reach());
        points
            .into_iter()
            .map(|p| {
                let size = norm(p);
                (scale((1.0 - radius / size).max(0.0), p), radius)
            })
            .collect()
    }

    /// A mesh to look at, in the obstacle's frame: a sphere as an icosahedron divided twice, a cylinder of 48 sides.
    pub fn to_mesh(&self) -> TriangleMesh {
        match self {
            Self::Sphere(r) => sphere_mesh(*r),
            Self::Cylinder(r, l) => CylinderMesh::smooth(*r, *l, 48).mesh().unwrap_or_default(),
            Self::Box(_) => {
                let mut vertices = Vec::new();
                self.points([0.0; 3], &mut vertices);
                let sides = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
                let triangles = sides.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
                TriangleMesh { vertices, triangles }
            }
            Self::Mesh(mesh) => mesh.clone(),
        }
    }
}

fn sphere_mesh(r: f64) -> TriangleMesh {
    let g = 0.5 * (1.0 + 5.0_f64.sqrt());
    let mut vertices: Vec<Vec3> = Vec::new();
    for (a, b) in [(-1.0, g), (1.0, g), (-1.0, -g), (1.0, -g)] {
        vertices.extend([[a, b, 0.0], [0.0, a, b], [b, 0.0, a]]);
    }
    let side = vertices.iter().map(|v| crate::dem::vec3::sub(*v, vertices[0])).map(norm).filter(|d| *d > 1e-9);
    let side = side.fold(f64::INFINITY, f64::min) * 1.01;
    let near = |a: usize, b: usize| norm(crate::dem::vec3::sub(vertices[a], vertices[b])) < side;
    let mut triangles: Vec<[u32; 3]> = Vec::new();
    for (a, b, c) in (0..12).flat_map(|a| (a + 1..12).flat_map(move |b| (b + 1..12).map(move |c| (a, b, c)))) {
        if near(a, b) && near(b, c) && near(a, c) {
            triangles.push(outward(&vertices, [a as u32, b as u32, c as u32]));
        }
    }
    for _ in 0..2 {
        let mut middle = std::collections::BTreeMap::new();
        let mut finer = Vec::new();
        for [a, b, c] in triangles {
            let mut between = |p: u32, q: u32| {
                *middle.entry((p.min(q), p.max(q))).or_insert_with(|| {
                    vertices.push(crate::dem::vec3::add(vertices[p as usize], vertices[q as usize]));
                    vertices.len() as u32 - 1
                })
            };
            let (ab, bc, ca) = (between(a, b), between(b, c), between(c, a));
            finer.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        vertices.iter_mut().for_each(|v| *v = scale(1.0 / norm(*v), *v));
        triangles = finer;
    }
    vertices.iter_mut().for_each(|v| *v = scale(r / norm(*v), *v));
    TriangleMesh { vertices, triangles }
}

fn outward(v: &[Vec3], [a, b, c]: [u32; 3]) -> [u32; 3] {
    use crate::dem::vec3::{cross, dot, sub};
    let [p, q, r] = [a, b, c].map(|k| v[k as usize]);
    if dot(cross(sub(q, p), sub(r, p)), p) > 0.0 { [a, b, c] } else { [a, c, b] }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn meshes_are_closed_and_have_nearly_the_mass_and_inertia_of_the_solid() {
        for (solid, tolerance) in
            [(Solid::Sphere(0.3), 0.05), (Solid::Cylinder(0.3, 0.8), 0.02), (Solid::Box([0.3, 0.4, 0.5]), 1e-12)]
        {
            let mesh = Solid::mesh(solid.to_mesh()).unwrap();
            let ((m, i), (n, j)) = (solid.mass(MassOf::Density(2.0)), mesh.mass(MassOf::Density(2.0)));
            assert!((n / m - 1.0).abs() < tolerance, "{solid:?}: {m} {n}");
            for c in 0..3 {
                assert!((j[c][c] / i[c][c] - 1.0).abs() < 2.0 * tolerance, "{solid:?}: {i:?} {j:?}");
            }
            assert!(mesh.reach() <= solid.reach() * (1.0 + 1e-12));
        }
    }

    #[test]
    fn distances_of_a_box_outside_inside_and_off_a_corner() {
        let cube = Solid::Box([2.0; 3]);
        assert_eq!(cube.nearest([1.5, 0.0, 0.0]), Some((0.5, [1.0, 0.0, 0.0])));
        assert_eq!(cube.nearest([0.0, -0.75, 0.1]), Some((-0.25, [0.0, -1.0, 0.0])));
        let (d, n) = cube.nearest([2.0, 2.0, -2.0]).unwrap();
        assert!((d - 3.0_f64.sqrt()).abs() < 1e-12 && (n[2] + 1.0 / 3.0_f64.sqrt()).abs() < 1e-12);
    }
}
