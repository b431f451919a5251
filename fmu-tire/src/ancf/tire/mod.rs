//! A flexible tire on a wheel: inflation and placing here, equilibrium in [`press`](Tire::press), motion in [`step`](Tire::step).

mod measures;
mod press;
mod stepping;

pub use measures::Energies;

use crate::ancf::AncfError;
use crate::ancf::assembly::Assembly;
use crate::ancf::external::{Block, External};
use crate::ancf::geometry::TireMesh;
use crate::ancf::hht::{Dynamics, Hht, HhtCost, HhtOptions, ShellState};
use crate::ancf::inflate::inflate;
use crate::ancf::kernel::Loads;
use crate::ancf::mesh::NODE;
use crate::ancf::plane::{Plane, PlaneLoad};
use crate::ancf::rim::RimNodes;
use crate::ancf::spec::FlexibleTire;
use crate::ancf::surface::Surface;
use crate::ancf::team::Team;
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
    /// Work of the ground on the tire so far, plane and given forces, J.
    pub ground_work: f64,
}

/// A tire's state with what determines its kept tangent.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SavedTire {
    /// The state.
    pub state: TireState,
    kept: crate::ancf::hht::KeptTangent,
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
    /// Strain energy (J) and volume (m3) of the inflated shape.
    inflated_energy: f64,
    inflated_volume: f64,
    rim_nodes: RimNodes,
    hht: Hht,
    /// Orientation of the rim when the kept tangent was factorised.
    factor_orientation: Option<Rotation3<f64>>,
    /// Momentum of `state` about the rim's centre, if the last step has left it: a function of the state alone.
    momentum: Option<[Vector3<f64>; 3]>,
}

/// Given vertex forces and the plane.
struct Ground<'a> {
    surface: &'a Surface,
    vertices: &'a [(u32, [f64; 3])],
    plane: Option<PlaneLoad<'a>>,
}

impl External for Ground<'_> {
    fn add_force(&self, scale: f64, time: f64, q: &[f64], v: &[f64], force: &mut [f64]) {
        for (vertex, f) in self.vertices {
            self.surface.add(*vertex as usize, f, force);
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

impl Tire {
    /// Builds and inflates a tire on a wheel at the origin, at rest.
    ///
    /// # Errors
    /// [`AncfError::Input`] with all faults of the specification, or a pressure that it does not stand; [`AncfError::Newton`] if it does not
    /// inflate.
    pub fn new(spec: &FlexibleTire, precision: Precision) -> Result<Self, AncfError> {
        let mesh = TireMesh::new(spec)?;
        let inflated = inflate(&mesh, spec.pressure)?;
        if let Some((element, ratio)) = mesh.mesh.first_inverted(&inflated, LEAST_VOLUME) {
            return Err(AncfError::Input(vec![format!(
                "'pressure' is {}: inflation turns element {element} inside out (volume ratio {ratio:.3}); allowed: what the layers carry, Pa",
                spec.pressure
            )]));
        }
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
        let hub = measures::hub(&mesh, &inflated);
        let mut tire = Self {
            spec: spec.clone(),
            hub,
            gravity: [0.0, 0.0, -9.81],
            state: TireState {
                shell: ShellState::at_rest(inflated.clone()),
                rim: RigidState::default(),
                plane: None,
                ground_work: 0.0,
            },
            hht: Hht::new(&mesh.mesh, assembly, options),
            inflated,
            inflated_energy: 0.0,
            inflated_volume: 0.0,
            rim_nodes,
            mesh,
            factor_orientation: None,
            momentum: None,
        };
        tire.place(&RigidState::default());
        tire.inflated_energy = tire.strain_energy();
        tire.inflated_volume = tire.volume();
        Ok(tire)
    }

    /// Lets a team do the element work; the bits stay the same.
    pub fn set_team(&mut self, team: &Team) {
        self.hht.set_team(team);
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
        self.state.ground_work = 0.0;
        self.state.rim = *wheel;
        self.forget_tangent();
        self.evaluate();
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
        self.momentum = None;
        self.factor_orientation =
            saved.factor_orientation.map(|m| Rotation3::from_matrix_unchecked(Matrix3::from_column_slice(&m)));
        Ok(())
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

    fn evaluate(&mut self) {
        self.momentum = None;
        let plane = self.state.plane.take();
        let surface = &self.mesh.surface;
        let load = plane.as_ref().map(|plane| PlaneLoad { plane, surface, contact: &self.spec.contact, since: 0.0 });
        let dynamics = Dynamics {
            mesh: &self.mesh.mesh,
            loads: Loads { damping: self.spec.damping, pressure: self.spec.pressure },
            gravity: self.gravity,
            external: &Ground { surface, vertices: &[], plane: load },
        };
        self.hht.evaluate(&dynamics, &mut self.state.shell);
        self.state.plane = plane;
    }
}
