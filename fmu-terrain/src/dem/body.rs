//! Bodies in the bed: what the engine asks of a shape, and the sums it keeps for the body's owner.
//!
//! A body is kinematic: its owner says where it is at a communication point and how it moves on from there; the engine
//! returns what the grains did to it. All sums run in canonical order (slab, then grain), so they are the same for any
//! number of threads. At every inner step the vertex forces have the same sum and the same moment as the contact
//! forces, to round-off: see [`to_vertices`].

use super::vec3::{Vec3, add, add_scaled, cross, dot, norm, scale, sub};
use crate::mesh::{spread_couple, to_vertices};
use serde::{Deserialize, Serialize};

/// A place where a grain touches a body, edges and neighbouring facets already merged.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct BodyTouch {
    /// Overlap (m), positive.
    pub overlap: f64,
    /// Factor on force and couple: where several touches are one surface, their weights sum to 1.
    pub weight: f64,
    /// Part of what acts once per grain and body (adhesion); the parts of all touches of a grain sum to 1.
    pub share: f64,
    /// Unit normal, out of the body, towards the grain.
    pub normal: Vec3,
    /// Point of the body's surface.
    pub point: Vec3,
    /// Velocity of the body there (m/s).
    pub velocity: Vec3,
    /// Angular velocity of the body there (rad/s).
    pub angular_velocity: Vec3,
    /// Vertices that carry the force; all `u32::MAX` for a shape without a mesh.
    pub vertices: [u32; 3],
    /// Their shares, sum 1.
    pub weights: [f64; 3],
}

/// What a body looks like and where it is.
pub trait Shape: Send + Sync {
    /// Moves it to `t` (s) after the last communication point.
    fn move_to(&mut self, t: f64);
    /// Box that holds it now.
    fn bounds(&self) -> [Vec3; 2];
    /// Adds the places where a grain touches it now.
    fn touches(&self, centre: Vec3, radius: f64, out: &mut Vec<BodyTouch>);
    /// Its centre now: the wrench is about this point.
    fn centre(&self) -> Vec3;
    /// Number of vertices.
    fn vertices(&self) -> usize {
        0
    }
    /// Position of a vertex now.
    fn vertex(&self, k: usize) -> Vec3 {
        self.positions()[k]
    }
    /// The mesh, if it is one: to give it new vertices or a new state.
    fn as_mesh(&mut self) -> Option<&mut crate::mesh::MeshShape> {
        None
    }
    /// Gives the point that the wrench is about, and its velocity, at a communication point; shapes that know their
    /// centre ignore it.
    fn set_centre(&mut self, _at: Vec3, _velocity: Vec3) {}
    /// Positions of all vertices now.
    fn positions(&self) -> &[Vec3] {
        &[]
    }
    /// Adds positions (m) and velocities (m/s) of the points in which it meets an obstacle: the vertices of a mesh, in their order.
    fn surface(&self, _out: &mut Vec<(Vec3, Vec3)>) {}
    /// Whether grains have come to where only its boxes are known, which must not be.
    fn is_missed(&self) -> bool {
        false
    }
    /// The obstacle, if it is one: moved by what acts on it, not by an owner.
    fn as_free(&mut self) -> Option<&mut super::obstacle::FreeBody> {
        None
    }
}

/// Force and couple of a grain on a body at a point.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct BodyLoad {
    /// Number of the body.
    pub body: u32,
    /// Where it acts.
    pub touch: BodyTouch,
    /// Force on the body (N).
    pub force: Vec3,
    /// Couple on the body (N m).
    pub couple: Vec3,
}

/// A body and what acted on it since the last communication point.
pub struct Body {
    /// Its shape.
    pub shape: Box<dyn Shape>,
    /// Material index.
    pub material: usize,
    /// Impulse on each vertex (N s).
    pub vertex_impulse: Vec<Vec3>,
    /// Total impulse (N s).
    pub impulse: Vec3,
    /// Angular impulse about its (moving) centre (N m s).
    pub angular_impulse: Vec3,
    /// Force at the last inner step (N).
    pub force: Vec3,
    /// Moment about its centre at the last inner step, from grains (N m).
    pub moment: Vec3,
}

impl Body {
    /// A body without impulses.
    pub fn new(shape: Box<dyn Shape>, material: usize) -> Self {
        let vertices = shape.vertices();
        let zero = [0.0; 3];
        Self {
            shape,
            material,
            vertex_impulse: vec![zero; vertices],
            impulse: zero,
            angular_impulse: zero,
            force: zero,
            moment: zero,
        }
    }

    /// Forgets the impulses; a communication step begins.
    pub fn clear(&mut self) {
        self.vertex_impulse.clear();
        self.vertex_impulse.resize(self.shape.vertices(), [0.0; 3]);
        self.impulse = [0.0; 3];
        self.angular_impulse = [0.0; 3];
    }

    /// Adds a load that acts for `h` (s); returns the work done by the body on the grains (J).
    pub fn apply(&mut self, load: &BodyLoad, h: f64) -> f64 {
        let t = &load.touch;
        self.force = add(self.force, load.force);
        self.impulse = add_scaled(self.impulse, h, load.force);
        let moment = add(cross(sub(t.point, self.shape.centre()), load.force), load.couple);
        self.moment = add(self.moment, moment);
        self.angular_impulse = add_scaled(self.angular_impulse, h, moment);
        if t.vertices[0] != u32::MAX {
            let at = t.vertices.map(|k| k as usize);
            let x = at.map(|k| self.shape.vertex(k));
            let forces =
                to_vertices(x, t.weights, load.force, t.point, load.couple).unwrap_or_else(|(forces, left)| {
                    // A facet without area cannot carry all of it: the whole body does.
                    let sums = &mut self.vertex_impulse;
                    spread_couple(self.shape.positions(), left, |k, f| sums[k] = add_scaled(sums[k], h, f));
                    forces
                });
            for (k, f) in at.into_iter().zip(forces) {
                self.vertex_impulse[k] = add_scaled(self.vertex_impulse[k], h, f);
            }
        }
        -h * (dot(load.force, t.velocity) + dot(load.couple, t.angular_velocity))
    }
}

/// Angular velocity of a facet: the rotation that its vertices have in common, in the sense that is conjugate to
/// [`to_vertices`] (the couple's power is the power of the vertex forces).
pub fn facet_spin(x: [Vec3; 3], v: [Vec3; 3]) -> Vec3 {
    let mean = scale(1.0 / 3.0, add(add(x[0], x[1]), x[2]));
    let rho = x.map(|p| sub(p, mean));
    let l = (0..3).fold([0.0; 3], |l, k| add(l, cross(rho[k], v[k])));
    solve3(&second_moment(&rho), l).unwrap_or_default()
}

fn second_moment(rho: &[Vec3; 3]) -> [Vec3; 3] {
    let mut j = [[0.0; 3]; 3];
    for r in rho {
        let r2 = dot(*r, *r);
        for a in 0..3 {
            for b in 0..3 {
                j[a][b] += if a == b { r2 } else { 0.0 } - r[a] * r[b];
            }
        }
    }
    j
}

/// Solves a 3 x 3 system by Cramer's rule; none if it is singular.
pub fn solve3(m: &[Vec3; 3], b: Vec3) -> Option<Vec3> {
    let det = dot(m[0], cross(m[1], m[2]));
    let size = norm(m[0]) * norm(m[1]) * norm(m[2]);
    if det.abs() <= 1e-14 * size {
        return None;
    }
    // Columns of the inverse are the cross products of the rows.
    let x = add(add(scale(b[0], cross(m[1], m[2])), scale(b[1], cross(m[2], m[0]))), scale(b[2], cross(m[0], m[1])));
    Some(scale(1.0 / det, x))
}

#[cfg(test)]
mod tests {
    use super::*;

    const X: [Vec3; 3] = [[0.1, 0.2, 0.3], [1.1, 0.1, 0.2], [0.3, 0.9, -0.1]];

    #[test]
    fn a_rigidly_turning_facet_has_that_spin() {
        let w = [0.5, -1.0, 2.0];
        let v = X.map(|x| add([1.0, 2.0, 3.0], cross(w, x)));
        assert!(norm(sub(facet_spin(X, v), w)) < 1e-13);
    }
}
