//! The energy residual of power bonds, in one line each.

use terramech_results::Headline;

use super::display::short;
use crate::coupling::{Energy, System};
use crate::description::algorithm::Scheme;

/// A residual below this part of the energy that passed is called small.
const SMALL: f64 = 0.01;

/// What a power bond has carried over a run.
#[derive(Clone, Debug, PartialEq)]
pub struct BondEnergy {
    /// Name of the bond.
    pub name: String,
    /// Its sums.
    pub energy: Energy,
    /// The base step at which the residual would fall below 1 % of what passed (s); `None` where it is below already or nothing passed.
    pub step: Option<f64>,
}

/// The bonds of a system that has run.
///
/// The step is told by the order of the coupling: the residual falls with the first power of the step where values are held, with the
/// second where they are extrapolated or iterated.
pub fn bonds(system: &System) -> Vec<BondEnergy> {
    let plan = system.plan();
    let step = plan.clock.length(1);
    let of = |(index, (name, energy)): (usize, (&str, Energy))| {
        let extrapolated = |c: usize| plan.connections[c].extrapolation > 0;
        let all = plan.bonds[index].pairs.iter().all(|p| extrapolated(p.effort) && extrapolated(p.flow));
        let order = if all || plan.algorithm.scheme == Scheme::Iterated { 2.0 } else { 1.0 };
        let part = energy.residual.abs() / energy.passed;
        // Where the step varies there is none to tell.
        let fixed = plan.algorithm.scheme != Scheme::Ecco;
        let step = (part > SMALL && fixed).then(|| step * (SMALL / part).powf(1.0 / order));
        BondEnergy { name: name.to_owned(), energy, step }
    };
    system.energies().enumerate().map(of).collect()
}

impl BondEnergy {
    /// For `summary.json`.
    pub fn headline(&self) -> Headline {
        Headline::new(format!("energy residual of {}", self.name), self.energy.residual, "J")
    }

    /// One line.
    pub fn tell(&self) -> String {
        let Energy { residual, passed } = self.energy;
        let (name, sign) = (&self.name, if residual > 0.0 { "+" } else { "" });
        if passed == 0.0 {
            return format!("power bond {name}: nothing has passed");
        }
        let part = 100.0 * residual.abs() / passed;
        let mut text = format!(
            "power bond {name}: energy residual {sign}{} J, {} % of the {} J that passed",
            short(residual),
            short(part),
            short(passed)
        );
        if let Some(step) = self.step {
            text += &format!("; below 1 % from a step of about {} s", short(step));
        }
        text
    }
}
