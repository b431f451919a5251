//! The tire in motion: communication steps, inner steps, the wrench.

use super::{Ground, HALVINGS, LEAST_VOLUME, Tire, Wrench};
use crate::ancf::AncfError;
use crate::ancf::hht::Dynamics;
use crate::ancf::kernel::Loads;
use crate::ancf::mesh::NODE;
use crate::ancf::plane::PlaneLoad;
use crate::ancf::rim::{RimMotion, RimPath};
use nalgebra::Vector3;
use terramech_mechanics::RigidState;

impl Tire {
    /// One communication step of `size` seconds: the rim follows `told`, the wheel state at its beginning; `vertices` are forces on
    /// vertices of the surface held over the step, N. Returns the wrench of the tire on the wheel, mean over the step, without the hub's share added back.
    ///
    /// The wrench is what balances the tire's momentum, so that momentum is conserved to round-off whatever Newton left: the rim's own
    /// reaction would carry the stiffness of the damped shell, 1e12 N/m, times the tolerance.
    ///
    /// # Errors
    /// [`AncfError::Newton`], [`AncfError::Inverted`], [`AncfError::NotFinite`]; the state is then that of the last good inner step.
    pub fn step(&mut self, told: &RigidState, size: f64, vertices: &[(u32, [f64; 3])]) -> Result<Wrench, AncfError> {
        let start = self.state.shell.time;
        let path = RimPath::new(self.state.rim, told, size);
        let inner = (size / self.spec.integrator.step - 1e-9).ceil().max(1.0);
        let centre = self.state.rim.position;
        let alpha = self.spec.integrator.alpha;
        let before = self.momentum.take().unwrap_or_else(|| self.momentum_about_rim());
        let mut forces = self.ground_forces(vertices);
        let mut ground = self.wrench_of(&forces, &centre);
        let mut impulse = Wrench::default();
        let mut done = 0.0;
        let mut h = size / inner;
        let mut halvings = 0;
        while done < size * (1.0 - 1e-12) {
            let at_end = f64::min(done + h, size);
            match self.inner_step(&path.at(at_end), at_end - done, vertices) {
                Ok(()) => {
                    let next_forces = self.ground_forces(vertices);
                    let next = self.wrench_of(&next_forces, &centre);
                    self.state.ground_work += 0.5 * (self.work_of(&forces) + self.work_of(&next_forces));
                    forces = next_forces;
                    let step = at_end - done;
                    impulse.force += (next.force * (1.0 + alpha) - ground.force * alpha) * step;
                    impulse.moment += (next.moment * (1.0 + alpha) - ground.moment * alpha) * step;
                    ground = next;
                    done = at_end;
                    // No drift of the sum of inner steps against the communication points.
                    self.state.shell.time = start + done;
                }
                Err(AncfError::Newton { .. }) if halvings < HALVINGS => {
                    halvings += 1;
                    h *= 0.5;
                }
                Err(error) => return Err(self.name_inversion(error)),
            }
        }
        if let Some((element, ratio)) = self.mesh.mesh.first_inverted(&self.state.shell.q, LEAST_VOLUME) {
            return Err(self.inverted(element, ratio));
        }
        let after = self.momentum_about_rim();
        self.momentum = Some(after);
        // Carried back to where the step began.
        let way = self.state.rim.position - centre;
        let after = [after[0], after[1] + way.cross(&after[0]), after[2] + way * self.hub.mass];
        let gravity = Vector3::from(self.gravity);
        // What the rim exerted on the tire: change of momentum less ground and weight.
        let force = (after[0] - before[0] - impulse.force) / size - gravity * self.hub.mass;
        let moment = (after[1] - before[1] - impulse.moment) / size - (after[2] + before[2]).cross(&gravity) * 0.5;
        let middle = (self.state.rim.position - centre) * 0.5;
        Ok(Wrench { force: -force, moment: -(moment - middle.cross(&force)) })
    }

    /// Momentum, angular momentum about the rim's centre, first moment of mass about it.
    fn momentum_about_rim(&self) -> [Vector3<f64>; 3] {
        let shell = &self.state.shell;
        self.mesh.mesh.momentum(&shell.q, &shell.v, &self.state.rim.position.into()).map(Vector3::from)
    }

    /// Forces of the ground on vertices, N: given ones, then the plane's.
    fn ground_forces(&self, vertices: &[(u32, [f64; 3])]) -> Vec<(u32, [f64; 3])> {
        vertices.iter().copied().chain(self.plane_forces()).collect()
    }

    /// Work of forces on vertices over the last inner step, J.
    fn work_of(&self, forces: &[(u32, [f64; 3])]) -> f64 {
        let (now, before) = (&self.state.shell.q, &self.hht.previous().q);
        let at = |k: u32, q: &[f64]| self.mesh.surface.at(k as usize, q);
        forces.iter().map(|(k, f)| Vector3::from(*f).dot(&(at(*k, now) - at(*k, before)))).sum()
    }

    /// Sum of forces on vertices and its moment about a point.
    fn wrench_of(&self, forces: &[(u32, [f64; 3])], about: &Vector3<f64>) -> Wrench {
        let mut wrench = Wrench::default();
        for (vertex, f) in forces {
            let force = Vector3::from(*f);
            let arm = self.mesh.surface.at(*vertex as usize, &self.state.shell.q) - about;
            wrench.force += force;
            wrench.moment += arm.cross(&force);
        }
        wrench
    }

    fn inner_step(&mut self, rim: &RimMotion, h: f64, vertices: &[(u32, [f64; 3])]) -> Result<(), AncfError> {
        self.set_places(rim);
        let factorisations = self.hht.cost.factorisations;
        let plane = self.state.plane.take();
        let surface = &self.mesh.surface;
        let load = plane.as_ref().map(|plane| PlaneLoad { plane, surface, contact: &self.spec.contact, since: h });
        let ground = Ground { surface, vertices, plane: load };
        let dynamics = Dynamics {
            mesh: &self.mesh.mesh,
            loads: Loads { damping: self.spec.damping, pressure: self.spec.pressure },
            gravity: self.gravity,
            external: &ground,
        };
        let nodes = &self.rim_nodes;
        let result = self.hht.step(&dynamics, &mut self.state.shell, h, |q, v, a| nodes.prescribe(rim, q, v, a));
        let anchors = load.map(|load| load.anchors(&self.state.shell.q, &self.state.shell.v));
        self.state.plane = plane;
        if let (Some(plane), Some(anchors), true) = (&mut self.state.plane, anchors, result.is_ok()) {
            plane.anchors = anchors;
        }
        if self.hht.cost.factorisations != factorisations {
            self.factor_orientation = Some(rim.state.orientation.to_rotation_matrix());
        }
        result?;
        self.state.rim = rim.state;
        Ok(())
    }

    /// The mesh repeats after each division: a wheel that has rolled by k divisions is the factor's wheel with its nodes renamed, and what
    /// touches the ground stays what touches the ground.
    fn set_places(&mut self, rim: &RimMotion) {
        let Some(start) = self.factor_orientation else {
            self.hht.set_places(None);
            return;
        };
        let relative = start.inverse() * rim.state.orientation.to_rotation_matrix();
        let spin = (relative[(0, 2)] - relative[(2, 0)]).atan2(relative[(0, 0)] + relative[(2, 2)]);
        let shift = (spin / (2.0 * std::f64::consts::PI / self.mesh.around as f64)).round() as i64;
        let (around, free) = (self.mesh.around as i64, self.mesh.across - 1);
        let place = |i: usize| (i as i64 - shift).rem_euclid(around) as usize;
        let places = (0..self.mesh.around).flat_map(|i| (0..free).map(move |j| (place(i) * free + j) as u32)).collect();
        self.hht.set_places((shift != 0).then_some(places));
    }

    fn name_inversion(&self, error: AncfError) -> AncfError {
        match self.mesh.mesh.first_inverted(&self.state.shell.q, LEAST_VOLUME) {
            Some((element, ratio)) => self.inverted(element, ratio),
            None => error,
        }
    }

    fn inverted(&self, element: usize, ratio: f64) -> AncfError {
        let nodes = self.mesh.mesh.shells()[element].nodes;
        let centre = |k: usize| nodes.iter().map(|&n| 0.25 * self.state.shell.q[NODE * n as usize + k]).sum();
        AncfError::Inverted { element, time: self.state.shell.time, x: centre(0), y: centre(1), z: centre(2), ratio }
    }
}
