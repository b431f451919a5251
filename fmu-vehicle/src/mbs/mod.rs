//! Multibody core: rigid bodies in maximal coordinates, joints as constraint rows, one-dimensional shafts.
//!
//! **Coordinates.** Every body carries six velocities: `v_WC_W` of its centre of mass and `w_WB_B`, its angular velocity in its *own*
//! frame, so that its mass matrix is constant and inverted once. A joint adds rows `g(x, t) = 0` ([`Primitive`]).
//!
//! **Solver.** The velocity KKT system has the shape of an arrow: few *hub* bodies (the chassis, the steering link) touch many
//! joints, all others belong to one small cluster each (a suspension corner: 4 bodies, 23 rows). Each cluster's rows are eliminated
//! by a dense Cholesky factorisation, what remains is one small dense system of the hubs and the shafts ([`factor`]). The solve is direct. For the
//! HMMWV (19 bodies, 100 joint rows, 4 wheel couplings) a general sparse LU needs 140 us, this less than 10 us.
//!
//! **Time integration.** RATTLE: second order, positions satisfy `g = 0` and velocities `G v = -g_t` at the end of every step, so that
//! nothing drifts; one factorisation per step ([`integrator`]). One-step and without memory: a restored state continues to the same bits,
//! and inputs may jump at any step.
//!
//! **Shafts** are reduced to independent speeds once per gear ([`shafts`]); gears and differentials hold exactly, and their
//! reaction on the chassis follows from the same reduction.

pub mod assembly;
pub mod body;
pub mod energy;
pub mod equilibrium;
mod error;
pub mod factor;
pub mod forces;
pub mod friction;
pub mod integrator;
pub mod joints;
pub mod layout;
pub mod model;
pub mod primitive;
pub mod shafts;
pub mod system;
pub mod table;

pub use body::{Body, BodyId, GROUND, Motion, Pose};
pub use error::MbsError;
pub use forces::{DamperLaw, Loads, SpringDamper, SpringLaw, Stops, View};
pub use friction::FrictionId;
pub use integrator::StepReport;
pub use model::Model;
pub use primitive::{DriveId, Primitive};
pub use shafts::{ShaftId, ShaftNetwork};
pub use system::System;
pub use table::{Table, TableError};
