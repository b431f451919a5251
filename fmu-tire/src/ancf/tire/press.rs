//! Equilibrium of the tire on a plane.

use super::Tire;
use crate::ancf::AncfError;
use crate::ancf::external::{Block, External};
use crate::ancf::plane::{Plane, PlaneLoad};
use crate::ancf::spec::Contact;
use crate::ancf::statics::{self, StaticCost, StaticOptions, StaticProblem};
use crate::ancf::surface::Surface;
use nalgebra::Vector3;

/// A plane that rises with the load factor.
struct Rising<'a> {
    plane: &'a Plane,
    surface: &'a Surface,
    contact: Contact,
    from: f64,
    to: f64,
}

impl Rising<'_> {
    fn at(&self, factor: f64) -> Plane {
        Plane { height: self.from + factor * (self.to - self.from), ..self.plane.clone() }
    }

    fn load<'b>(&'b self, plane: &'b Plane) -> PlaneLoad<'b> {
        PlaneLoad { plane, surface: self.surface, contact: &self.contact, since: 0.0 }
    }
}

impl External for Rising<'_> {
    fn add_force(&self, scale: f64, time: f64, q: &[f64], v: &[f64], force: &mut [f64]) {
        self.load(&self.at(scale)).add_force(1.0, time, q, v, force);
    }

    fn add_tangent(&self, scale: f64, stiffness: f64, velocity: f64, q: &[f64], v: &[f64], blocks: &mut Vec<Block>) {
        self.load(&self.at(scale)).add_tangent(1.0, stiffness, velocity, q, v, blocks);
    }
}

impl Tire {
    /// Equilibrium on a rising plane: the plane of the state goes up to `height` with the rim at rest where it is; weight included.
    ///
    /// # Errors
    /// [`AncfError::Unpressed`] if no equilibrium is found; [`AncfError::Input`] if the tire has no plane, or the plane reaches the rim.
    pub fn press(&mut self, height: f64, options: &StaticOptions) -> Result<StaticCost, AncfError> {
        let Some(mut plane) = self.state.plane.clone() else {
            return Err(AncfError::Input(vec!["the tire has no plane to press on: 'ground' must be 'plane'".into()]));
        };
        let normal = Vector3::from(plane.normal);
        let rim = self
            .mesh
            .rim_nodes()
            .into_iter()
            .map(|n| normal.dot(&self.mesh.surface.at(n as usize, &self.state.shell.q)));
        let rim = rim.fold(f64::MAX, f64::min);
        if height.is_nan() || height >= rim {
            return Err(AncfError::Input(vec![format!(
                "the plane is at {height} m, above the rim's lowest point; allowed: below {rim:.4} m where the wheel is now"
            )]));
        }
        // Without friction: the path of the tangential springs would depend on the increments.
        let contact = Contact { friction: 0.0, tangential_stiffness: 0.0, normal_damping: 0.0, ..self.spec.contact };
        plane.anchors.clear();
        // Nothing is touched below the lowest node: start there.
        let surface = &self.mesh.surface;
        let lowest =
            (0..surface.len()).map(|k| normal.dot(&surface.at(k, &self.state.shell.q))).fold(f64::MAX, f64::min);
        let from = plane.height.max(lowest.min(height));
        let rising = Rising { plane: &plane, surface, contact, from, to: height };
        let problem = StaticProblem {
            mesh: &self.mesh.mesh,
            pressure: self.spec.pressure,
            gravity: self.gravity,
            body_loads_in_full: true,
            external: &rising,
        };
        let mut q = std::mem::take(&mut self.state.shell.q);
        let result = statics::solve(&problem, self.hht.assembly_mut(), &mut q, 0.0, &[1.0], options, |_, _| ());
        self.state.shell.q = q;
        self.factor_orientation = None;
        let cost = result.map_err(|error| match error {
            AncfError::Newton { time, correction, .. } => AncfError::Unpressed {
                height,
                reached: from + time * (height - from),
                correction,
                tolerance: options.tolerance,
            },
            other => other,
        })?;
        let mut plane = rising.at(1.0);
        let load = PlaneLoad { plane: &plane, surface, contact: &self.spec.contact, since: 0.0 };
        plane.anchors = load.anchors(&self.state.shell.q, &self.state.shell.v);
        self.state.plane = Some(plane);
        self.state.shell.v.fill(0.0);
        self.state.shell.a.fill(0.0);
        self.evaluate();
        // A quasi-static way dissipates nothing.
        let (strain, pressure) = self.since_inflation();
        self.state.shell.work = self.state.ground_work - strain + pressure;
        Ok(cost)
    }
}
