//! Blocks of models that are not `terrain_dem_p`: read and checked by it all the same, so that one file serves all.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use terramech_fmi2::specification::Faults;

/// Complementarity granular model.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct DemC {
    /// Longest inner step (s).
    pub step: f64,
    /// Solver of the cone problem.
    pub solver: Solver,
    /// Elastic contacts have the stiffness of the soil's Young's modulus, taken implicitly; rigid ones none: friction and cohesion are all
    /// that counts, and a solve takes about ten times as many iterations.
    pub contacts: Contacts,
    /// Residual at which a solve ends (m/s).
    pub tolerance: f64,
    /// Iterations of the solver per step at most.
    pub iterations: u32,
    /// Time over which an overlap of rigid contacts is undone (s).
    pub recovery_time: f64,
    /// Fastest that an overlap of rigid contacts is undone (m/s).
    pub recovery_speed: f64,
}

/// Solver of the cone problem.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Solver {
    /// Projected over-relaxation, parallel by blocks: fastest where grains are compliant.
    #[default]
    Relaxation,
    /// Nesterov's accelerated projected gradient with adaptive restart: for rigid grains in deep beds.
    Nesterov,
    /// Spectral projected gradient.
    BarzilaiBorwein,
    /// Projected Gauss-Seidel: the reference, on one thread.
    GaussSeidel,
}

/// What contacts are made of.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Contacts {
    /// Hertz's spring, implicit in time.
    #[default]
    Elastic,
    /// No spring: an overlap is undone over `recovery_time`.
    Rigid,
}

impl Default for DemC {
    fn default() -> Self {
        Self {
            step: 1e-3,
            solver: Solver::default(),
            contacts: Contacts::default(),
            tolerance: 1e-3,
            iterations: 200,
            recovery_time: 0.05,
            recovery_speed: 0.1,
        }
    }
}

/// Soil contact model (Bekker, Janosi).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Scm {
    /// Grid spacing (m).
    pub spacing: f64,
    /// Bekker K_phi (N/m^(n+2)).
    pub k_phi: f64,
    /// Bekker K_c (N/m^(n+1)).
    pub k_c: f64,
    /// Bekker exponent n (1).
    pub n: f64,
    /// Cohesion (Pa).
    pub cohesion: f64,
    /// Friction angle (rad).
    pub friction_angle: f64,
    /// Janosi shear displacement (m).
    pub janosi: f64,
    /// Elastic stiffness of unloading (Pa/m).
    pub elastic: f64,
    /// Damping (Pa s/m).
    pub damping: f64,
}

impl Default for Scm {
    /// A soft soil: the co-simulation demos' values.
    fn default() -> Self {
        Self {
            spacing: 0.02,
            k_phi: 2e6,
            k_c: 0.0,
            n: 1.1,
            cohesion: 0.0,
            friction_angle: std::f64::consts::FRAC_PI_6,
            janosi: 0.01,
            elastic: 4e7,
            damping: 3e4,
        }
    }
}

impl DemC {
    pub(super) fn check(&self, f: &mut Faults) {
        f.positive("dem_c.step", self.step);
        for (path, x) in [
            ("dem_c.tolerance", self.tolerance),
            ("dem_c.recovery_time", self.recovery_time),
            ("dem_c.recovery_speed", self.recovery_speed),
        ] {
            f.positive(path, x);
        }
        f.check(self.iterations >= 1, "dem_c.iterations", self.iterations, "at least 1");
    }
}

impl Scm {
    pub(super) fn check(&self, f: &mut Faults) {
        for (path, x) in [
            ("scm.spacing", self.spacing),
            ("scm.k_phi", self.k_phi),
            ("scm.n", self.n),
            ("scm.janosi", self.janosi),
            ("scm.elastic", self.elastic),
        ] {
            f.positive(path, x);
        }
        for (path, x) in [("scm.k_c", self.k_c), ("scm.cohesion", self.cohesion), ("scm.damping", self.damping)] {
            f.not_negative(path, x);
        }
        f.within("scm.friction_angle", self.friction_angle, 0.0, 1.5);
    }
}
