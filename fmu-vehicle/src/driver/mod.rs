//! Drivers: what steers, accelerates and brakes. External inputs, a table over time, or a follower of a path at a speed.

mod filter;
mod follower;
mod path;
mod table;

pub use filter::Limits;
pub use follower::{Follower, Pid};
pub use path::{Path, PathSpec};
pub use table::TablePoint;

use crate::vehicle::DriverInputs;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use terramech_fmi2::UnitError;
use terramech_fmi2::specification::Faults;
use terramech_mechanics::RigidState;

/// A driver, by the name of its template.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum DriverKind {
    /// The inputs `driver.{steering, throttle, braking}` of the unit.
    External {},
    /// Values over time, linear between points, the last held.
    Table {
        /// Points with rising time.
        points: Vec<TablePoint>,
    },
    /// Follows a path at a speed.
    Path(Follower),
}

/// Specification of a driver.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DriverSpec {
    /// What decides.
    pub kind: DriverKind,
    /// Limits of rates, and filter.
    #[serde(default)]
    pub limits: Limits,
}

impl Default for DriverSpec {
    fn default() -> Self {
        Self { kind: DriverKind::External {}, limits: Limits::default() }
    }
}

impl DriverSpec {
    /// Reads files that the driver names.
    pub fn resolve(&mut self, place: &crate::vehicle::Place, path: &str, f: &mut Faults) {
        if let DriverKind::Path(p) = &mut self.kind {
            p.path.resolve(place, &format!("{path}.kind.path.path"), f);
        }
    }
    /// Collects faults.
    pub fn check(&self, path: &str, f: &mut Faults) {
        match &self.kind {
            DriverKind::External {} => {}
            DriverKind::Table { points } => table::check(points, &format!("{path}.kind.table.points"), f),
            DriverKind::Path(p) => p.check(&format!("{path}.kind.path"), f),
        }
        self.limits.check(&format!("{path}.limits"), f);
    }
}

/// State of a driver.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct DriverState {
    follower: follower::FollowerState,
    out: [f64; 3],
    started: bool,
}

/// A driver at run time.
#[derive(Clone, Debug)]
pub struct Driver {
    spec: DriverSpec,
    path: Option<Path>,
    /// What is saved.
    pub state: DriverState,
}

impl Driver {
    /// A driver for a checked specification. `start` is the chassis at the start: paths begin there.
    ///
    /// # Errors
    /// A path that cannot be made.
    pub fn new(spec: &DriverSpec, start: &RigidState) -> Result<Self, UnitError> {
        let path = match &spec.kind {
            DriverKind::Path(p) => Some(p.path.build(start)?),
            _ => None,
        };
        Ok(Self { spec: spec.clone(), path, state: DriverState::default() })
    }

    /// Inputs for a step of `h` s that begins at `time` (s since the start).
    pub fn drive(&mut self, time: f64, h: f64, chassis: &RigidState, external: DriverInputs) -> DriverInputs {
        let wanted = match (&self.spec.kind, &self.path) {
            (DriverKind::Table { points }, _) => table::at(points, time),
            (DriverKind::Path(p), Some(path)) => p.drive(time, h, chassis, path, &mut self.state.follower),
            _ => external,
        };
        let wanted =
            [wanted.steering.clamp(-1.0, 1.0), wanted.throttle.clamp(0.0, 1.0), wanted.braking.clamp(0.0, 1.0)];
        self.spec.limits.apply(wanted, h, &mut self.state.out);
        let [steering, throttle, braking] = self.state.out;
        DriverInputs { steering, throttle, braking }
    }
}
