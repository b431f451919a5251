//! A flexible tire on a wheel: inflation, pressing, stepping, wrench.

use super::AncfError;
use super::assembly::Assembly;
use super::external::{Block, External};
use super::geometry::TireMesh;
use super::hht::{Dynamics, Hht, HhtCost, HhtOptions, ShellState};
use super::inflate::inflate;
use super::kernel::Loads;
use super::mesh::NODE;
use super::plane::{Plane, PlaneLoad};
use super::rim::{RimMotion, RimNodes, RimPath};
use super::spec::{Contact, FlexibleTire};
use super::statics::{self, StaticCost, StaticOptions, StaticProblem};
use nalgebra::{Matrix3, Rotation3, Vector3};
use serde::{Deserialize, Serialize};
use terramech_mechanics::RigidState;
use terramech_mechanics::sparse::Precision;

/// Below this share of its reference volume an element counts as inverted.
const LEAST_VOLUME: f64 = 0.05;
/// The inner step is halved at most this often.
const HALVINGS: u32 = 6;

/// Everything that changes: plain data, saved whole.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TireState {
    /// The shells.
    pub shell: ShellState,
    /// The rim at `shell.time`.
    pub rim: RigidState,
    /// The tire's own ground, if it has one.
    pub plane: Option<Plane>,
}

/// A tire's state with what determines its kept tangent.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SavedTire {
    /// The state.
    pub state: TireState,
    kept: super::hht::KeptTangent,
    factor_orientation: Option<[f64; 9]>,
}

/// What moves with the rim and is handed to the hub.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hub {
    /// Mass, kg.
    pub mass: f64,
    /// Moments of inertia about the wheel's axes, kg m2.
    pub inertia: [f64; 3],
}

/// Force and moment about the wheel centre, inertial frame, N and N m.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Wrench {
    /// Force.
    pub force: Vector3<f64>,
    /// Moment.
    pub moment: Vector3<f64>,
}

/// A flexible tire.
#[derive(Debug)]
pub struct Tire {
    /// Its specification.
    pub spec: FlexibleTire,
    /// Its mesh.
    pub mesh: TireMesh,
    /// What the hub carries: all of the tire's mass and inertia. The rows of the rim's nodes alone leave an added-mass loop; with the
    /// whole tire the explicit coupling is stable for any wheel, since no part of the tire can answer with more than its mass.
    pub hub: Hub,
    /// Gravity, m/s2.
    pub gravity: [f64; 3],
    /// The state.
    pub state: TireState,
    inflated: Vec<f64>,
    rim_nodes: RimNodes,
    hht: Hht,
    /// Orientation of the rim when the kept tangent was factorised.
    factor_orientation: Option<Rotation3<f64>>,
}

/// Given vertex forces and the plane.
struct Ground<'a> {
    vertices: &'a [(u32, [f64; 3])],
    plane: Option<PlaneLoad<'a>>,
}

impl External for Ground<'_> {
    fn add_force(&self, scale: f64, time: f64, q: &[f64], v: &[f64], force: &mut [f64]) {
        for (node, f) in self.vertices {
            (0..3).for_each(|k| force[NODE * *node as usize + k] += f[k]);
        }
        if let Some(plane) = &self.plane {
            plane.add_force(scale, time, q, v, force);
        }
    }

    fn add_tangent(&self, scale: f64, stiffness: f64, velocity: f64, q: &[f64], v: &[f64], blocks: &mut Vec<Block>) {
        if let Some(plane) = &self.plane {
            plane.add_tangent(scale, stiffness, velocity, q, v, blocks);
        }
    }
}

/// A plane that rises with the load factor.
struct Rising<'a> {
    plane: &'a Plane,
    contact: &'a Contact,
    from: f64,
    to: f64,
}

impl Rising<'_> {
    fn at(&self, factor: f64) -> Plane {
        Plane { height: self.from + factor * (self.to - self.from), ..self.plane.clone() }
    }
}

impl External for Rising<'_> {
    fn add_force(&self, scale: f64, time: f64, q: &[f64], v: &[f64], force: &mut [f64]) {
        PlaneLoad { plane: &self.at(scale), contact: self.contact, since: 0.0 }.add_force(1.0, time, q, v, force);
    }

    fn add_tangent(&self, scale: f64, stiffness: f64, velocity: f64, q: &[f64], v: &[f64], blocks: &mut Vec<Block>) {
        let plane = self.at(scale);
        PlaneLoad { plane: &plane, contact: self.contact, since: 0.0 }
            .add_tangent(1.0, stiffness, velocity, q, v, blocks);
    }
}

impl Tire {
    /// Builds and inflates a tire on a wheel at the origin, at rest.
    ///
    /// # Errors
    /// [`AncfError::Input`] with all faults of the specification; [`AncfError::Newton`] if it does not inflate.
    pub fn new(spec: &FlexibleTire, precision: Precision) -> Result<Self, AncfError> {
        let mesh = TireMesh::new(spec)?;
        let inflated = inflate(&mesh, spec.pressure)?;
        let fixed: Vec<[bool; NODE]> = (0..mesh.mesh.node_count()).map(|n| [mesh.on_rim(n); NODE]).collect();
        let assembly = Assembly::new(&mesh.mesh, &fixed, precision)?;
        let options = HhtOptions {
            alpha: spec.integrator.alpha,
            tolerance: spec.integrator.tolerance,
            iterations: spec.integrator.iterations as usize,
            keep_tangent: true,
        };
        let rim_nodes = RimNodes {
            nodes: mesh
                .rim_nodes()
                .into_iter()
                .map(|n| (n, std::array::from_fn(|k| mesh.mesh.reference()[NODE * n as usize + k])))
                .collect(),
        };
        let hub = hub(&mesh, &inflated);
        let mut tire = Self {
            spec: spec.clone(),
            hub,
            gravity: [0.0, 0.0, -9.81],
            state: TireState { shell: ShellState::at_rest(inflated.clone()), rim: RigidState::default(), plane: None },
            hht: Hht::new(&mesh.mesh, assembly, options),
            inflated,
            rim_nodes,
            mesh,
            factor_orientation: None,
        };
        tire.place(&RigidState::default());
        Ok(tire)
    }

    /// Moves the inflated tire rigidly to a wheel state.
    pub fn place(&mut self, wheel: &RigidState) {
        let turn = wheel.orientation.to_rotation_matrix();
        let (w, n) = (wheel.angular_velocity, self.inflated.len());
        let time = self.state.shell.time;
        let mut shell = ShellState::at_rest(vec![0.0; n]);
        shell.time = time;
        for (k, local) in self.inflated.chunks_exact(3).enumerate() {
            let arm = turn * Vector3::from_column_slice(local);
            let speed = w.cross(&arm);
            let second = w.cross(&speed);
            for c in 0..3 {
                let is_position = k % 2 == 0;
                shell.q[3 * k + c] = arm[c] + if is_position { wheel.position[c] } else { 0.0 };
                shell.v[3 * k + c] = speed[c] + if is_position { wheel.velocity[c] } else { 0.0 };
                shell.a[3 * k + c] = second[c];
            }
        }
        self.state.shell = shell;
        self.state.rim = *wheel;
        self.forget_tangent();
        self.evaluate();
    }

    /// Equilibrium on a rising plane: the plane of the state goes up to `height` with the rim at rest where it is; weight included.
    ///
    /// # Errors
    /// [`AncfError::Newton`], [`AncfError::Input`] if the tire has no plane.
    pub fn press(&mut self, height: f64, options: &StaticOptions) -> Result<StaticCost, AncfError> {
        let Some(mut plane) = self.state.plane.clone() else {
            return Err(AncfError::Input(vec!["the tire has no plane to press on: 'ground' must be 'plane'".into()]));
        };
        // Without friction: the path of the tangential springs would depend on the increments.
        plane.anchors.clear();
        // Nothing is touched below the lowest node: start there.
        let normal = Vector3::from(plane.normal);
        let lowest = (0..self.mesh.mesh.node_count())
            .map(|n| normal.dot(&Vector3::from_column_slice(&self.state.shell.q[NODE * n..NODE * n + 3])))
            .fold(f64::MAX, f64::min);
        let from = plane.height.max(lowest.min(height));
        let rising = Rising { plane: &plane, contact: &self.spec.contact, from, to: height };
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
        let cost = result?;
        let mut plane = rising.at(1.0);
        let load = PlaneLoad { plane: &plane, contact: &self.spec.contact, since: 0.0 };
        plane.anchors = load.anchors(&self.state.shell.q, &self.state.shell.v);
        self.state.plane = Some(plane);
        self.state.shell.v.fill(0.0);
        self.state.shell.a.fill(0.0);
        self.evaluate();
        Ok(cost)
    }

    /// Forces of the plane on the nodes at the present state, N.
    pub fn plane_forces(&self) -> Vec<(u32, [f64; 3])> {
        self.state.plane.as_ref().map_or(Vec::new(), |plane| {
            PlaneLoad { plane, contact: &self.spec.contact, since: 0.0 }
                .forces(&self.state.shell.q, &self.state.shell.v)
        })
    }

    /// One communication step of `size` seconds: the rim follows `told`, the wheel state at its beginning; `vertices` are forces on nodes
    /// held over the step, N. Returns the wrench of the tire on the wheel, mean over the step, without the hub's share added back.
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
        let momentum = |tire: &Self| {
            let shell = &tire.state.shell;
            tire.mesh.mesh.momentum(&shell.q, &shell.v, &centre.into()).map(Vector3::from)
        };
        let alpha = self.spec.integrator.alpha;
        let before = momentum(self);
        let mut ground = self.ground_wrench(vertices, &centre);
        let mut impulse = Wrench::default();
        let mut done = 0.0;
        let mut h = size / inner;
        let mut halvings = 0;
        while done < size * (1.0 - 1e-12) {
            let at_end = f64::min(done + h, size);
            match self.inner_step(&path.at(at_end), at_end - done, vertices) {
                Ok(()) => {
                    let next = self.ground_wrench(vertices, &centre);
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
        let after = momentum(self);
        let gravity = Vector3::from(self.gravity);
        // What the rim exerted on the tire: change of momentum less ground and weight.
        let force = (after[0] - before[0] - impulse.force) / size - gravity * self.hub.mass;
        let moment = (after[1] - before[1] - impulse.moment) / size - (after[2] + before[2]).cross(&gravity) * 0.5;
        let middle = (self.state.rim.position - centre) * 0.5;
        Ok(Wrench { force: -force, moment: -(moment - middle.cross(&force)) })
    }

    /// Force of the ground on the tire and its moment about a point.
    fn ground_wrench(&self, vertices: &[(u32, [f64; 3])], about: &Vector3<f64>) -> Wrench {
        let mut wrench = Wrench::default();
        for (node, f) in vertices.iter().chain(&self.plane_forces()) {
            let first = NODE * *node as usize;
            let force = Vector3::from(*f);
            let arm = Vector3::from_column_slice(&self.state.shell.q[first..first + 3]) - about;
            wrench.force += force;
            wrench.moment += arm.cross(&force);
        }
        wrench
    }

    fn inner_step(&mut self, rim: &RimMotion, h: f64, vertices: &[(u32, [f64; 3])]) -> Result<(), AncfError> {
        self.set_places(rim);
        let factorisations = self.hht.cost.factorisations;
        let plane = self.state.plane.take();
        let load = plane.as_ref().map(|plane| PlaneLoad { plane, contact: &self.spec.contact, since: h });
        let ground = Ground { vertices, plane: load };
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

    /// The hub's share of a wrench over a step with these mean accelerations: what the vehicle integrates instead, added back.
    pub fn hub_share(&self, acceleration: &Vector3<f64>, angular: &Vector3<f64>) -> Wrench {
        let turn = self.state.rim.orientation.to_rotation_matrix();
        let inertia = turn * Matrix3::from_diagonal(&Vector3::from(self.hub.inertia)) * turn.inverse();
        let w = self.state.rim.angular_velocity;
        Wrench {
            force: (acceleration - Vector3::from(self.gravity)) * self.hub.mass,
            moment: inertia * angular + w.cross(&(inertia * w)),
        }
    }

    /// Everything that a run's future depends on.
    pub fn save(&self) -> SavedTire {
        SavedTire {
            state: self.state.clone(),
            kept: self.hht.kept(),
            factor_orientation: self.factor_orientation.map(|r| r.matrix().as_slice().try_into().unwrap_or([0.0; 9])),
        }
    }

    /// Takes a saved state back; the run goes on with the same bits.
    ///
    /// # Errors
    /// [`AncfError::Input`] if it belongs to another mesh, [`AncfError::Sparse`].
    pub fn restore(&mut self, saved: SavedTire) -> Result<(), AncfError> {
        if saved.state.shell.q.len() != self.inflated.len() {
            return Err(AncfError::Input(vec![format!(
                "the saved tire has {} coordinates, this one {}",
                saved.state.shell.q.len(),
                self.inflated.len()
            )]));
        }
        let loads = Loads { damping: self.spec.damping, pressure: self.spec.pressure };
        self.hht.restore_kept(&self.mesh.mesh, &loads, &saved.kept)?;
        self.state = saved.state;
        self.factor_orientation =
            saved.factor_orientation.map(|m| Rotation3::from_matrix_unchecked(Matrix3::from_column_slice(&m)));
        Ok(())
    }

    /// Estimated displacement of each node per newton held over a step of `h` seconds, m/N: the inverse of the diagonal of inertia, damping
    /// and stiffness; 0 on the rim.
    pub fn compliance(&mut self, h: f64) -> Vec<f64> {
        let weights = super::kernel::TangentWeights {
            stiffness: 1.0,
            velocity: 1.0 / h,
            mass: 1.0 / (h * h),
            pressure: false,
            geometric: false,
        };
        let loads = Loads { damping: self.spec.damping, pressure: self.spec.pressure };
        let mut out = vec![0.0; self.mesh.mesh.node_count()];
        let assembly = self.hht.assembly_mut();
        assembly.assemble(&self.mesh.mesh, &loads, &self.inflated, &weights, &[]);
        for (&node, d) in assembly.free_nodes().iter().zip(assembly.mean_diagonal()) {
            out[node as usize] = 1.0 / d;
        }
        self.factor_orientation = None;
        out
    }

    /// Volume that the surface encloses, m3.
    pub fn volume(&self) -> f64 {
        let q = &self.state.shell.q;
        let p =
            |n: u32| Vector3::from_column_slice(&q[NODE * n as usize..NODE * n as usize + 3]) - self.state.rim.position;
        self.mesh.triangles.iter().map(|t| p(t[0]).dot(&p(t[1]).cross(&p(t[2]))) / 6.0).sum()
    }

    /// Largest inward movement of the crown against the inflated shape, m.
    pub fn deflection(&self) -> f64 {
        let axle = self.state.rim.orientation * Vector3::y();
        let (row, crown) = (self.mesh.across + 1, self.mesh.across / 2);
        let free = (self.inflated[NODE * crown].powi(2) + self.inflated[NODE * crown + 2].powi(2)).sqrt();
        (0..self.mesh.around)
            .map(|i| {
                let n = NODE * (i * row + crown);
                let arm = Vector3::from_column_slice(&self.state.shell.q[n..n + 3]) - self.state.rim.position;
                free - (arm - axle * axle.dot(&arm)).norm()
            })
            .fold(f64::MIN, f64::max)
    }

    /// Reference area that belongs to each node, m2.
    pub fn node_areas(&self) -> Vec<f64> {
        let mut areas = vec![0.0; self.mesh.mesh.node_count()];
        for (e, shell) in self.mesh.mesh.shells().iter().enumerate() {
            shell.nodes.iter().for_each(|&n| areas[n as usize] += 0.25 * self.mesh.mesh.kind(e).area);
        }
        areas
    }

    /// Strains at the middle of each element: circumferential, radial (across), shear.
    pub fn strains(&self) -> Vec<[f64; 3]> {
        let mesh = &self.mesh.mesh;
        (0..mesh.shells().len())
            .map(|e| {
                let local = super::mesh::gather(&self.state.shell.q, &mesh.shells()[e].nodes);
                super::kernel::centre_strain(mesh.kind(e), &local)
            })
            .collect()
    }

    /// Work done so far.
    pub fn cost(&self) -> HhtCost {
        self.hht.cost
    }

    /// The integrator, for its options and figures.
    pub fn hht_mut(&mut self) -> &mut Hht {
        &mut self.hht
    }

    /// Makes what follows depend on the state alone.
    pub fn forget_tangent(&mut self) {
        self.hht.forget_tangent();
        self.factor_orientation = None;
    }

    /// Strain energy and kinetic energy, J.
    pub fn energies(&self) -> (f64, f64) {
        let shell = &self.state.shell;
        (self.mesh.mesh.energy(0.0, &shell.q, &shell.v).0, self.mesh.mesh.kinetic_energy(&shell.v))
    }

    fn evaluate(&mut self) {
        let plane = self.state.plane.take();
        let load = plane.as_ref().map(|plane| PlaneLoad { plane, contact: &self.spec.contact, since: 0.0 });
        let dynamics = Dynamics {
            mesh: &self.mesh.mesh,
            loads: Loads { damping: self.spec.damping, pressure: self.spec.pressure },
            gravity: self.gravity,
            external: &Ground { vertices: &[], plane: load },
        };
        self.hht.evaluate(&dynamics, &mut self.state.shell);
        self.state.plane = plane;
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

/// Mass and moments of inertia of the whole tire about the wheel's axes, in the inflated shape.
fn hub(tire: &TireMesh, q: &[f64]) -> Hub {
    let mut inertia = [0.0; 3];
    for axis in 0..3 {
        // Twice the kinetic energy of a unit turn.
        let omega = Vector3::ith(axis, 1.0);
        let v: Vec<f64> =
            q.chunks_exact(3).flat_map(|x| <[f64; 3]>::from(omega.cross(&Vector3::from_column_slice(x)))).collect();
        inertia[axis] = 2.0 * tire.mesh.kinetic_energy(&v);
    }
    Hub { mass: tire.mesh.total_mass(), inertia }
}
