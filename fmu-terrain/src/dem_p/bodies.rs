//! From input variables to bodies of the engine, and back to their outputs.

use crate::config::dem_p::FIRST_BODY;
use crate::dem::cylinder::Cylinder;
use crate::dem::vec3::{Vec3, add_scaled, scale};
use crate::dem::{Body, BodyTouch, Shape};
use crate::mesh::{MeshBody, MeshShape, mesh_from_arrays};
use crate::variables::BodyVars;
use serde::{Deserialize, Serialize};
use std::sync::atomic::{AtomicBool, Ordering};
use terramech_fmi2::variables::StateVars;
use terramech_fmi2::{UnitError, Values};
use terramech_mechanics::{RigidState, TriangleMesh};

/// What kind of body a slot holds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Kind {
    /// Nothing.
    #[default]
    None,
    /// A mesh that is given anew at every step.
    Mesh,
    /// A mesh that is given once.
    RigidMesh,
    /// An analytic cylinder.
    Cylinder,
}

/// What is kept of a body between steps, apart from its variables.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Slot {
    /// Which kind.
    pub kind: Kind,
    /// A rigid mesh in the body's frame.
    pub mesh: Option<TriangleMesh>,
    /// The wrench is about the state's position, since it has been set.
    pub centre_given: bool,
}

fn fault(k: usize, text: impl std::fmt::Display) -> UnitError {
    UnitError::input(format!("body[{}]: {text}", k + 1))
}

/// Reads the shape of slot `k`.
///
/// # Errors
/// An unknown word.
pub fn kind(v: &Values, vars: &BodyVars, k: usize) -> Result<Kind, UnitError> {
    match v.string(vars.shape).trim() {
        "" | "none" => Ok(Kind::None),
        "mesh" => Ok(Kind::Mesh),
        "rigid_mesh" => Ok(Kind::RigidMesh),
        "cylinder" => Ok(Kind::Cylinder),
        other => Err(fault(k, format!("shape is '{other}'; allowed: none, mesh, rigid_mesh, cylinder"))),
    }
}

/// The state of a body.
///
/// # Errors
/// A quaternion that is not one.
pub fn state(v: &Values, vars: &StateVars, k: usize) -> Result<RigidState, UnitError> {
    let mut reals = [0.0; 13];
    reals[..3].copy_from_slice(&v.get(vars.position));
    reals[3..7].copy_from_slice(&v.get(vars.orientation));
    reals[7..10].copy_from_slice(&v.get(vars.velocity));
    reals[10..].copy_from_slice(&v.get(vars.angular_velocity));
    RigidState::from_array(&reals).map_err(|e| fault(k, e))
}

/// Takes a rigid mesh over, at the end of initialization: from the inertial frame to the body's.
///
/// # Errors
/// A mesh with faults, or none.
pub fn take_rigid_mesh(v: &Values, vars: &BodyVars, k: usize) -> Result<TriangleMesh, UnitError> {
    let at = state(v, &vars.state, k)?;
    let mut mesh = mesh_from_arrays(v.reals(vars.position), v.integers(vars.triangle)).map_err(|e| fault(k, e))?;
    for p in &mut mesh.vertices {
        *p = at.to_body(&(*p).into()).into();
    }
    // Faults of the mesh are told now, not at the first step.
    MeshBody::rigid(&mesh, at).map_err(|e| fault(k, e))?;
    Ok(mesh)
}

/// A body that is not there.
pub fn absent(k: usize) -> Body {
    Body::new(Box::new(Absent), FIRST_BODY + k)
}

/// Brings the body of slot `k` to its communication point. `triangle` are the triangles that a mesh was made from.
///
/// # Errors
/// Inputs that do not make a body: it is then as it was.
pub fn place(
    v: &Values,
    vars: &BodyVars,
    slot: &Slot,
    body: &mut Body,
    triangle: &mut Vec<i32>,
    k: usize,
) -> Result<(), UnitError> {
    match slot.kind {
        Kind::None => {}
        Kind::Cylinder => {
            let (radius, width) = (v[vars.radius], v[vars.width]);
            if !(radius > 0.0 && width > 0.0) {
                let text = format!("radius {radius} m, width {width} m; allowed for a cylinder: both greater than 0");
                return Err(fault(k, text));
            }
            let s = state(v, &vars.state, k)?;
            let axis = s.orientation * nalgebra::Vector3::y();
            let (p, u, w) = (s.position.into(), s.velocity.into(), s.angular_velocity.into());
            body.shape = Box::new(Cylinder::new(radius, width, p, axis.into(), u, w));
        }
        Kind::RigidMesh => {
            let s = state(v, &vars.state, k)?;
            match (body.shape.as_mesh(), &slot.mesh) {
                (Some(mesh), _) => mesh.update(|b| b.set_state(s)).map_err(|e| fault(k, e))?,
                (None, Some(mesh)) => {
                    body.shape = Box::new(MeshShape::new(MeshBody::rigid(mesh, s).map_err(|e| fault(k, e))?));
                }
                (None, None) => return Err(fault(k, "its rigid mesh was never given")),
            }
        }
        Kind::Mesh => place_mesh(v, vars, slot, body, triangle, k)?,
    }
    Ok(())
}

fn place_mesh(
    v: &Values,
    vars: &BodyVars,
    slot: &Slot,
    body: &mut Body,
    made_from: &mut Vec<i32>,
    k: usize,
) -> Result<(), UnitError> {
    let (position, velocity, triangle) = (v.reals(vars.position), v.reals(vars.velocity), v.integers(vars.triangle));
    if position.is_empty() && triangle.is_empty() {
        // Legal: the tire has not shown its mesh yet, or has none.
        body.shape = Box::new(Absent);
        made_from.clear();
        return Ok(());
    }
    let state = state(v, &vars.state, k)?;
    let count = body.shape.vertices();
    match body.shape.as_mesh() {
        Some(mesh) if *made_from == triangle && 3 * count == position.len() => {
            mesh.update(|b| b.set_vertices(position, velocity)).map_err(|e| fault(k, e))?;
        }
        _ => {
            let mesh = mesh_from_arrays(position, triangle).map_err(|e| fault(k, e))?;
            let mut shape = MeshShape::new(MeshBody::deforming(&mesh).map_err(|e| fault(k, e))?);
            shape.update(|b| b.set_vertices(position, velocity)).map_err(|e| fault(k, e))?;
            body.shape = Box::new(Centred { mesh: shape, given: None, now: [0.0; 3] });
            *made_from = triangle.to_vec();
        }
    }
    if slot.centre_given {
        body.shape.set_centre(state.position.into(), state.velocity.into());
    }
    Ok(())
}

/// Writes forces and wrench of a body: means over the communication step of length `size` (s).
pub fn publish(v: &mut Values, vars: &BodyVars, body: &Body, size: f64) {
    let (mut index, mut force) = (std::mem::take(v.integers_mut(vars.contact_index)), Vec::new());
    std::mem::swap(&mut force, v.reals_mut(vars.contact_force));
    index.clear();
    force.clear();
    for (k, impulse) in body.vertex_impulse.iter().enumerate() {
        if *impulse != [0.0; 3] {
            index.push(k as i32);
            force.extend(scale(1.0 / size, *impulse));
        }
    }
    *v.integers_mut(vars.contact_index) = index;
    *v.reals_mut(vars.contact_force) = force;
    v.put(vars.wrench.force, scale(1.0 / size, body.impulse));
    v.put(vars.wrench.moment, scale(1.0 / size, body.angular_impulse));
}

/// A body that is beyond the reach of every grain of this member: it is known by the boxes it is in at each inner step of length `step` (s).
pub fn away(k: usize, step: f64, boxes: Vec<[Vec3; 2]>) -> Body {
    Body::new(Box::new(Away { step, boxes, now: 0, missed: AtomicBool::new(false) }), FIRST_BODY + k)
}

struct Away {
    step: f64,
    boxes: Vec<[Vec3; 2]>,
    now: usize,
    missed: AtomicBool,
}

impl Shape for Away {
    fn move_to(&mut self, t: f64) {
        self.now = (t / self.step).round() as usize;
    }
    fn bounds(&self) -> [Vec3; 2] {
        self.boxes.get(self.now).copied().unwrap_or_else(|| Absent.bounds())
    }
    fn touches(&self, centre: Vec3, radius: f64, _: &mut Vec<BodyTouch>) {
        let [low, high] = self.bounds();
        if (0..3).all(|c| centre[c] + radius >= low[c] && centre[c] - radius <= high[c]) {
            self.missed.store(true, Ordering::Relaxed);
        }
    }
    fn centre(&self) -> Vec3 {
        [0.0; 3]
    }
    fn is_missed(&self) -> bool {
        self.missed.load(Ordering::Relaxed)
    }
}

struct Absent;

impl Shape for Absent {
    fn move_to(&mut self, _: f64) {}
    fn bounds(&self) -> [Vec3; 2] {
        [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]]
    }
    fn touches(&self, _: Vec3, _: f64, _: &mut Vec<BodyTouch>) {}
    fn centre(&self) -> Vec3 {
        [0.0; 3]
    }
}

/// A mesh whose wrench may be about a point that is given, not about the mean of its vertices.
struct Centred {
    mesh: MeshShape,
    /// The point at the communication point, and its velocity.
    given: Option<(Vec3, Vec3)>,
    now: Vec3,
}

impl Shape for Centred {
    fn move_to(&mut self, t: f64) {
        self.mesh.move_to(t);
        self.now = self.given.map_or(self.mesh.centre(), |(at, velocity)| add_scaled(at, t, velocity));
    }
    fn bounds(&self) -> [Vec3; 2] {
        self.mesh.bounds()
    }
    fn touches(&self, centre: Vec3, radius: f64, out: &mut Vec<BodyTouch>) {
        self.mesh.touches(centre, radius, out);
    }
    fn centre(&self) -> Vec3 {
        self.now
    }
    fn vertices(&self) -> usize {
        self.mesh.vertices()
    }
    fn vertex(&self, k: usize) -> Vec3 {
        self.mesh.vertex(k)
    }
    fn as_mesh(&mut self) -> Option<&mut MeshShape> {
        Some(&mut self.mesh)
    }
    fn positions(&self) -> &[Vec3] {
        self.mesh.positions()
    }
    fn surface(&self, out: &mut Vec<(Vec3, Vec3)>) {
        self.mesh.surface(out);
    }
    fn set_centre(&mut self, at: Vec3, velocity: Vec3) {
        (self.given, self.now) = (Some((at, velocity)), at);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_comes_into_the_box_of_a_body_that_is_away_is_missed() {
        let boxes = vec![[[0.0; 3], [1.0; 3]], [[2.0; 3], [3.0; 3]]];
        let mut body = away(0, 0.1, boxes);
        let mut touches = Vec::new();
        body.shape.move_to(0.1);
        assert_eq!(body.shape.bounds(), [[2.0; 3], [3.0; 3]]);
        body.shape.touches([0.5; 3], 0.1, &mut touches);
        assert!(touches.is_empty() && !body.shape.is_missed());
        body.shape.touches([1.95; 3], 0.1, &mut touches);
        assert!(touches.is_empty() && body.shape.is_missed());
        // Beyond the steps that are known it is nowhere.
        body.shape.move_to(0.2);
        let [low, high] = body.shape.bounds();
        assert!(low[0] > high[0]);
    }
}
