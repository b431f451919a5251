//! Bodies pressed onto rigid ground: from input variables to points, and what the ground does to them over a step.

use super::config::Penalty;
use super::contact::touch;
use super::ground::GroundPoint;
use super::points::{self, PointBody};
use crate::dem_p::bodies::{self, Kind, Slot};
use crate::mesh::mesh_from_arrays;
use crate::variables::BodyVars;
use terramech_fmi2::{UnitError, Values};
use terramech_mechanics::Vec3;

/// Points around and across the tread of a body of shape `cylinder`.
const CYLINDER: [usize; 2] = [360, 5];

/// The points of body `k` at the communication point; `None`: no body, or one that has not shown its mesh.
///
/// # Errors
/// Inputs that do not make a body.
pub fn of_body(v: &mut Values, vars: &BodyVars, slot: &mut Slot, k: usize) -> Result<Option<PointBody>, UnitError> {
    let fault = |text: String| UnitError::input(format!("body[{}]: {text}", k + 1));
    let set = vars.state.position.iter().any(|&p| v.take_changed(p));
    slot.centre_given |= slot.kind == Kind::Mesh && set;
    match slot.kind {
        Kind::None => Ok(None),
        Kind::Cylinder => {
            let (radius, width) = (v[vars.radius], v[vars.width]);
            if !(radius > 0.0 && width > 0.0) {
                return Err(fault(format!(
                    "radius {radius} m, width {width} m; allowed for a cylinder: both greater than 0"
                )));
            }
            let (position, area) = points::cylinder(radius, width, CYLINDER[0], CYLINDER[1]);
            Ok(Some(PointBody::Rigid { position, area, state: bodies::state(v, &vars.state, k)? }))
        }
        Kind::RigidMesh => {
            let mesh = slot.mesh.as_ref().ok_or_else(|| fault("its rigid mesh was never given".into()))?;
            let position: Vec<Vec3> = mesh.vertices.iter().map(|p| Vec3::from(*p)).collect();
            let area = points::vertex_areas(&position, mesh.triangles.iter().map(|t| t.map(|k| k as usize)));
            Ok(Some(PointBody::Rigid { position, area, state: bodies::state(v, &vars.state, k)? }))
        }
        Kind::Mesh => {
            let Some((position, velocity, area)) = free(v, vars).map_err(fault)? else { return Ok(None) };
            let mean = |x: &[Vec3]| x.iter().sum::<Vec3>() / x.len() as f64;
            let centre = if slot.centre_given {
                let s = bodies::state(v, &vars.state, k)?;
                [s.position, s.velocity]
            } else {
                [mean(&position), mean(&velocity)]
            };
            Ok(Some(PointBody::Free { position, velocity, area, centre }))
        }
    }
}

/// Positions (m), velocities (m/s) and areas (m2, outward) of the vertices of a deforming mesh.
type Vertices = (Vec<Vec3>, Vec<Vec3>, Vec<Vec3>);

/// The vertices of a deforming mesh; `None` where there is none yet.
fn free(v: &Values, vars: &BodyVars) -> Result<Option<Vertices>, String> {
    let (position, velocity, triangle) = (v.reals(vars.position), v.reals(vars.velocity), v.integers(vars.triangle));
    if position.is_empty() && triangle.is_empty() {
        return Ok(None);
    }
    if velocity.len() != position.len() {
        return Err(format!("velocity has {} values, allowed: {}, as position has", velocity.len(), position.len()));
    }
    if let Some(k) = position.iter().chain(velocity).position(|x| !x.is_finite()) {
        return Err(format!("value {k} of position and velocity is not finite"));
    }
    let vectors = |x: &[f64]| -> Vec<Vec3> { x.chunks_exact(3).map(|p| Vec3::new(p[0], p[1], p[2])).collect() };
    let mesh = mesh_from_arrays(position, triangle).map_err(|e| e.to_string())?;
    let x = vectors(position);
    let count = x.len();
    if let Some(t) = mesh.triangles.iter().find(|t| t.iter().any(|k| *k as usize >= count)) {
        return Err(format!(
            "triangle {t:?} names a vertex that is not there; allowed: 0 to {}",
            count.saturating_sub(1)
        ));
    }
    let area = points::vertex_areas(&x, mesh.triangles.iter().map(|t| t.map(|k| k as usize)));
    Ok(Some((x, vectors(velocity), area)))
}

/// What the ground does to a body over a step: means over its inner steps.
#[derive(Clone, Debug, Default)]
pub struct Sum {
    /// Force on each vertex (N).
    pub vertex: Vec<Vec3>,
    /// Total force (N).
    pub force: Vec3,
    /// Moment about the body's centre (N m).
    pub moment: Vec3,
    /// Work of the body on the ground (J).
    pub work: f64,
    /// Energy (J) that the springs held when the body first appeared in the ground: pressed in by somebody, it is no dissipation.
    pub pressed_in: f64,
    /// At the last inner step: energy in the springs (J).
    pub elastic: f64,
    /// At the last inner step: points that touch.
    pub touching: i32,
}

/// Presses a body onto the ground for `count` inner steps of `h` s, evaluated in the middle of each. `ground` gives height, normal and friction at x, y;
/// none where there is no ground. `slip` is the tangential displacement of each point since its touch (m).
pub fn press(
    points: &PointBody,
    ground: &dyn Fn(f64, f64) -> Option<GroundPoint>,
    penalty: &Penalty,
    friction: f64,
    slip: &mut Vec<[f64; 3]>,
    [h, count]: [f64; 2],
) -> Sum {
    let mut sum = Sum { vertex: vec![Vec3::zeros(); points.len()], ..Sum::default() };
    if slip.len() != points.len() {
        *slip = vec![[0.0; 3]; points.len()];
        points.each(0.0, |_, p| {
            if let Some(under) = ground(p.position.x, p.position.y) {
                let t = touch(penalty, &p, &under, 0.0, &mut Vec3::zeros(), 0.0);
                sum.pressed_in += t.map_or(0.0, |t| t.elastic);
            }
        });
    }
    for n in 0..count as u32 {
        let (mut force, mut about, mut work) = (Vec3::zeros(), Vec3::zeros(), 0.0);
        (sum.touching, sum.elastic) = (0, 0.0);
        let centre = points.each((f64::from(n) + 0.5) * h, |k, p| {
            let Some(under) = ground(p.position.x, p.position.y) else {
                slip[k] = [0.0; 3];
                return;
            };
            let mut moved = Vec3::from(slip[k]);
            if let Some(t) = touch(penalty, &p, &under, friction.min(under.friction), &mut moved, h) {
                sum.vertex[k] += t.force;
                force += t.force;
                about += p.position.cross(&t.force);
                work -= t.force.dot(&p.velocity);
                sum.elastic += t.elastic;
                sum.touching += 1;
            }
            slip[k] = moved.into();
        });
        sum.force += force;
        sum.moment += about - centre.cross(&force);
        sum.work += work * h;
    }
    sum.vertex.iter_mut().for_each(|f| *f /= count);
    sum.force /= count;
    sum.moment /= count;
    sum
}

impl Sum {
    /// Writes forces and wrench.
    pub fn publish(&self, v: &mut Values, vars: &BodyVars) {
        let (mut index, mut force) = (Vec::new(), Vec::new());
        // A cylinder has no vertices that anybody knows.
        let has_vertices = !v.integers(vars.triangle).is_empty();
        for (k, f) in self.vertex.iter().enumerate().filter(|(_, f)| has_vertices && **f != Vec3::zeros()) {
            index.push(k as i32);
            force.extend([f.x, f.y, f.z]);
        }
        *v.integers_mut(vars.contact_index) = index;
        *v.reals_mut(vars.contact_force) = force;
        v.put(vars.wrench.force, self.force.into());
        v.put(vars.wrench.moment, self.moment.into());
    }
}
