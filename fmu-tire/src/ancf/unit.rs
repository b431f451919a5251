//! The unit: the tire follows the wheel, feels forces on its vertices, and answers with a wrench.

use super::AncfError;
use super::plane::Plane;
use super::spec::FlexibleTire;
use super::statics::StaticOptions;
use super::team::Team;
use super::tire::{SavedTire, Tire, Wrench};
use super::variables::Variables;
use serde::{Deserialize, Serialize};
use terramech_fmi2::variables::StateVars;
use terramech_fmi2::{Host, LogCategory, Stage, Step, Unit, UnitError, Values, Var, specification, state};
use terramech_mechanics::RigidState;
use terramech_mechanics::sparse::Precision;

/// The flexible tire.
///
/// In a step from t to t + H its rim runs to the wheel state at t moved on by its velocities, and the vertices feel the terrain's forces (means
/// over the step before). The published mesh is the tire's at t + H.
pub struct FlexibleTireUnit {
    vars: Variables,
    tire: Option<Tire>,
    touching: f64,
}

/// Everything that is saved: the specification's content, never its path.
#[derive(Serialize, Deserialize)]
struct Saved {
    /// With gravity (m/s2).
    tire: Option<(FlexibleTire, [f64; 3], SavedTire)>,
    touching: f64,
}

impl From<AncfError> for UnitError {
    fn from(error: AncfError) -> Self {
        match error {
            AncfError::Input(_) => Self::input(error.to_string()),
            _ => Self::numerical(error.to_string()),
        }
    }
}

impl FlexibleTireUnit {
    /// A fresh instance.
    pub fn new(vars: Variables) -> Self {
        Self { vars, tire: None, touching: 0.0 }
    }

    fn tire(&mut self) -> Result<&mut Tire, UnitError> {
        self.tire
            .as_mut()
            .ok_or_else(|| UnitError::input("the tire has not been made: initialization mode comes first"))
    }

    fn make(&mut self, spec: &FlexibleTire, gravity: [f64; 3], threads: i32) -> Result<(), UnitError> {
        let mut tire = Tire::new(spec, Precision::Single)?;
        tire.set_team(&Team::new(threads.max(1) as usize)?);
        tire.gravity = gravity;
        self.tire = Some(tire);
        Ok(())
    }

    fn publish(&mut self, v: &mut Values) -> Result<(), UnitError> {
        let (position, velocity) = (self.vars.mesh_position, self.vars.mesh_velocity);
        let tire = self.tire()?;
        for (var, from) in [(position, &tire.state.shell.q), (velocity, &tire.state.shell.v)] {
            let to = v.reals_mut(var);
            to.clear();
            to.extend(tire.mesh.surface.all(from));
        }
        Ok(())
    }

    fn place(&mut self, v: &mut Values) -> Result<(), UnitError> {
        let wheel = wheel_state(v, &self.vars.wheel_state)?;
        let plane = match v.string(self.vars.ground) {
            "none" => None,
            "plane" => Some(Plane::horizontal(v.get([self.vars.plane_height])[0])),
            other => return Err(UnitError::input(format!("parameter 'ground' is '{other}'; allowed: none, plane"))),
        };
        let tire = self.tire()?;
        tire.state.plane = plane;
        tire.place(&wheel);
        self.publish(v)
    }
}

fn wheel_state(v: &Values, vars: &StateVars) -> Result<RigidState, UnitError> {
    let mut reals = [0.0; 13];
    reals[..3].copy_from_slice(&v.get(vars.position));
    reals[3..7].copy_from_slice(&v.get(vars.orientation));
    reals[7..10].copy_from_slice(&v.get(vars.velocity));
    reals[10..].copy_from_slice(&v.get(vars.angular_velocity));
    RigidState::from_array(&reals).map_err(|e| UnitError::input(format!("input wheel state: {e}")))
}

/// Pairs of vertex and force, checked.
fn vertex_forces(index: &[i32], force: &[f64], vertices: usize) -> Result<Vec<(u32, [f64; 3])>, UnitError> {
    if force.len() != 3 * index.len() {
        return Err(UnitError::input(format!(
            "'contact.index' has {} elements and 'contact.force' {}; allowed: three reals for each index",
            index.len(),
            force.len()
        )));
    }
    if let Some(k) = force.iter().position(|f| !f.is_finite()) {
        return Err(UnitError::input(format!("'contact.force' element {k} is {}; allowed: finite reals", force[k])));
    }
    let mut previous = -1;
    for (k, &i) in index.iter().enumerate() {
        if i <= previous || i as usize >= vertices {
            return Err(UnitError::input(format!(
                "'contact.index' element {k} is {i} after {previous}; allowed: ascending and unique, 0 to {}",
                vertices - 1
            )));
        }
        previous = i;
    }
    Ok(index.iter().zip(force.chunks_exact(3)).map(|(&i, f)| (i as u32, [f[0], f[1], f[2]])).collect())
}

impl Unit for FlexibleTireUnit {
    fn enter_initialization(&mut self, v: &mut Values, host: &Host) -> Result<(), UnitError> {
        let spec = specification::load::<FlexibleTire>(
            v.string(self.vars.common.specification),
            super::spec::HMMWV_LAYERED,
            host,
        )?;
        let [gravity, slope] = v.get([self.vars.gravity, self.vars.slope]);
        let gravity = [gravity * slope.sin(), 0.0, gravity * slope.cos()];
        self.make(&spec.value, gravity, v[self.vars.common.threads]).map_err(|e| match e {
            UnitError::Input(text) => UnitError::input(format!("{}: {text}", spec.origin)),
            other => other,
        })?;
        let (vars, step) = (self.vars, spec.value.integrator.step);
        let tire = self.tire()?;
        host.log(
            LogCategory::Info,
            &format!(
                "flexible tire of {} x {} shells, {:.3} kg, {} Pa ({})",
                tire.mesh.around, tire.mesh.across, tire.hub.mass, spec.value.pressure, spec.origin
            ),
        );
        let surface = &tire.mesh.surface;
        let at = |k: usize| surface.at(k, &tire.state.shell.q);
        let outer = (0..surface.len()).map(|k| at(k).x.hypot(at(k).z)).fold(0.0, f64::max);
        v.put([vars.hub_mass], [tire.hub.mass]);
        v.put(vars.hub_inertia, tire.hub.inertia);
        v.put(vars.sizes, [tire.mesh.radius, outer, tire.mesh.width]);
        let c = spec.value.contact;
        v.put(vars.material, [c.friction, c.restitution, c.young_modulus, c.poisson_ratio]);
        let triangles = v.integers_mut(vars.mesh_triangle);
        triangles.clear();
        triangles.extend(surface.triangles.iter().flatten().map(|&n| n as i32));
        *v.reals_mut(vars.mesh_compliance) = tire.compliance(step);
        v.lock(
            [vars.common.specification.vr(), vars.common.threads.vr(), vars.gravity.vr(), vars.slope.vr()],
            "the tire has been made from it when initialization mode began",
        );
        Ok(())
    }

    fn refresh(&mut self, v: &mut Values, _: &Host, vr: u32, stage: Stage) -> Result<(), UnitError> {
        let vars = self.vars;
        if stage == Stage::Initialization {
            if vr == vars.mesh_position.vr() || vr == vars.mesh_velocity.vr() {
                self.place(v)?;
            }
            return Ok(());
        }
        if self.tire.is_none() {
            return Ok(());
        }
        let touching = self.touching;
        let tire = self.tire()?;
        if vr == vars.mesh_strain.vr() {
            *v.reals_mut(vars.mesh_strain) = tire.strains().concat();
        } else if vr == vars.mesh_vertex_strain.vr() {
            *v.reals_mut(vars.mesh_vertex_strain) = tire.vertex_strains().concat();
        } else if vars.contact.iter().any(|x| x.vr() == vr) {
            let plane = tire.plane_forces();
            let area = touching + plane.iter().map(|f| tire.mesh.surface.areas[f.0 as usize]).sum::<f64>();
            v.put(vars.contact, [tire.deflection(), area, plane.iter().map(|f| f.1[2]).sum()]);
        } else if vars.energies.iter().any(|x| x.vr() == vr) {
            let e = tire.energies();
            v.put(vars.energies, [e.strain, e.kinetic, e.pressure_work, e.dissipated, e.ground_work]);
        }
        Ok(())
    }

    fn exit_initialization(&mut self, v: &mut Values, host: &Host) -> Result<(), UnitError> {
        self.place(v)?;
        v.lock([self.vars.ground.vr(), self.vars.plane_height.vr()], "the tire has been placed with it");
        let tire = self.tire()?;
        let surface = &tire.mesh.surface;
        let reach = (0..surface.len()).map(|k| surface.at(k, &tire.state.shell.q).z).fold(f64::MAX, f64::min);
        if let Some(height) = tire.state.plane.as_ref().map(|p| p.height).filter(|h| *h > reach) {
            host.progress("pressing the tire on its plane", -1.0)?;
            let options =
                StaticOptions { first: 0.25, largest: 0.5, tolerance: 1e-7, descent: 400, ..StaticOptions::default() };
            let wheel = tire.state.rim;
            // Equilibrium is found at rest; the rim's velocity comes with the first step.
            tire.press(height, &options)?;
            tire.state.rim = wheel;
        }
        self.publish(v)
    }

    fn step(&mut self, v: &mut Values, _: &Host, step: Step) -> Result<(), UnitError> {
        // Strain rates fade into denormal numbers once a tire is at rest.
        let _mode = terramech_simd::FlushDenormals::new();
        let told = wheel_state(v, &self.vars.wheel_state)?;
        let vars = self.vars;
        let vertices = self.tire()?.mesh.surface.len();
        let forces = vertex_forces(v.integers(vars.contact_index), v.reals(vars.contact_force), vertices)?;
        let areas = &self.tire()?.mesh.surface.areas;
        self.touching = forces.iter().map(|f| areas[f.0 as usize]).sum();
        let tire = self.tire()?;
        let before = tire.state.rim;
        tire.state.shell.time = step.time;
        let Wrench { mut force, mut moment } = tire.step(&told, step.size, &forces)?;
        let share = tire.hub_share(
            &((tire.state.rim.velocity - before.velocity) / step.size),
            &((tire.state.rim.angular_velocity - before.angular_velocity) / step.size),
        );
        force += share.force;
        moment += share.moment;
        if !force.iter().chain(moment.iter()).all(|x| x.is_finite()) {
            let what = "the wrench on the wheel".to_string();
            return Err(AncfError::NotFinite { what, time: step.time + step.size }.into());
        }
        v.put(vars.wheel_wrench.force, force.into());
        v.put(vars.wheel_wrench.moment, moment.into());
        self.publish(v)
    }

    fn save(&mut self) -> Result<Vec<u8>, UnitError> {
        let tire = self.tire.as_ref().map(|t| (t.spec.clone(), t.gravity, t.save()));
        state::to_bytes(&Saved { tire, touching: self.touching })
    }

    fn restore(&mut self, v: &mut Values, bytes: &[u8]) -> Result<(), UnitError> {
        let saved: Saved = state::from_bytes(bytes)?;
        self.tire = None;
        if let Some((spec, gravity, inner)) = saved.tire {
            self.make(&spec, gravity, v[self.vars.common.threads])?;
            self.tire()?.restore(inner)?;
        }
        self.touching = saved.touching;
        Ok(())
    }
}
