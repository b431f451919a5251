//! The coupling algorithm of a description, with names resolved and the units' abilities checked.

use super::plan::{Algorithm, Component, Connection, Fmu, InitialStage, PowerBond};
use super::steps::{Times, in_steps};
use super::system::System;
use crate::description::algorithm::Scheme;
use crate::fault::{FaultKind, Faults, Place};

/// Where nothing is given.
const TOLERANCE: f64 = 1e-6;
const TOLERANCE_OF_ENERGY: f64 = 1e-3;
const LONGEST: u64 = 100;
const ITERATIONS: u32 = 50;

/// The algorithm: of the command line, else of the description, else Jacobi.
pub fn algorithm(
    system: &System<'_>,
    given: Option<&str>,
    times: Option<&Times>,
    bonds: &[PowerBond],
    connections: &[Connection],
    stages: &[InitialStage],
    faults: &mut Faults,
) -> Algorithm {
    let multiples = times.map(|t| t.multiples.as_slice()).unwrap_or_default();
    let written = system.description.extras.algorithm.as_deref();
    let place = written.map_or_else(|| system.description.place.clone(), |a| a.place.clone());
    let scheme = match given {
        None => written.map_or(Scheme::Jacobi, |a| a.scheme),
        Some(word) => Scheme::of(word).unwrap_or_else(|| {
            let (what, given, allowed) = ("--algorithm".into(), word.to_owned(), Scheme::ALLOWED.into());
            faults.add(&Place::file("--algorithm"), "", FaultKind::BadValue { what, given, allowed });
            Scheme::Jacobi
        }),
    };
    let mut order = Vec::new();
    if scheme == Scheme::GaussSeidel {
        let names = written.map(|a| a.order.as_slice()).unwrap_or_default();
        order = match names {
            [] => by_sources(system.description.components.len(), connections, stages),
            names => names.iter().filter_map(|n| system.component(n, &place, "Algorithm", faults)).collect(),
        };
        let count = system.description.components.len();
        let missing = (0..count).find(|c| !order.contains(c));
        if order.len() != count || missing.is_some() {
            let given = names.join(" ");
            let allowed = match missing {
                Some(c) => format!("every component once; \"{}\" is not in it", system.name(c)),
                None => "every component once".into(),
            };
            faults.add(&place, "Algorithm", FaultKind::BadValue { what: "order".into(), given, allowed });
        }
    }
    if matches!(scheme, Scheme::Iterated | Scheme::Ecco) {
        for (c, multiple) in multiples.iter().enumerate() {
            let element = format!("Component \"{}\"", system.name(c));
            if *multiple != 1 {
                let what = format!("{} coupling of units with different communication steps", scheme.name());
                let instead = "give all of them the base step";
                faults.add(&place, &element, FaultKind::Unsupported { what, instead });
            }
            if scheme == Scheme::Ecco
                && system.model(c).is_some_and(|m| !m.co_simulation.can_handle_variable_communication_step_size)
            {
                let what =
                    "ecco with a unit that wants steps of one length (canHandleVariableCommunicationStepSize)".into();
                let instead = "choose jacobi or gauss-seidel";
                faults.add(&place, &element, FaultKind::Unsupported { what, instead });
            }
            if scheme == Scheme::Iterated && system.model(c).is_some_and(|m| !m.co_simulation.can_get_and_set_fmu_state)
            {
                let what = "iterated coupling with a unit that does not save its state (canGetAndSetFMUstate)".into();
                let instead = "choose jacobi or gauss-seidel";
                faults.add(&place, &element, FaultKind::Unsupported { what, instead });
            }
        }
    }
    let mut longest = LONGEST;
    if scheme == Scheme::Ecco {
        // Where a bond is at fault, or nothing is left to connect, that is told already.
        if bonds.is_empty() && faults.is_empty() {
            let what = "ecco without power bonds".into();
            let instead = "declare tm:PowerBond: their energy residual is what it goes by";
            faults.add(&place, "Algorithm", FaultKind::Unsupported { what, instead });
        }
        if let (Some(time), Some(times)) = (written.and_then(|a| a.longest), times) {
            let count = in_steps("longest", time, times.clock.step, &place, "Algorithm", faults);
            longest = count.unwrap_or(LONGEST).max(1);
        }
    }
    let usual = if scheme == Scheme::Ecco { TOLERANCE_OF_ENERGY } else { TOLERANCE };
    Algorithm {
        scheme,
        longest,
        order,
        resolve_feed_through: written.is_some_and(|a| a.resolve_feed_through),
        tolerance: written.and_then(|a| a.tolerance).unwrap_or(usual),
        iterations: written.and_then(|a| a.iterations).unwrap_or(ITERATIONS),
    }
}

/// Components in the order in which their values are first needed at initialisation; the rest in file order.
fn by_sources(count: usize, connections: &[Connection], stages: &[InitialStage]) -> Vec<usize> {
    let mut order = Vec::with_capacity(count);
    let sources = stages.iter().flat_map(|s| &s.connections).map(|&c| connections[c].from.component);
    for c in sources.chain(0..count) {
        if !order.contains(&c) {
            order.push(c);
        }
    }
    order
}

/// Whether a run of these units can be saved and resumed; the names of those that cannot.
pub fn cannot_be_saved<'p>(fmus: &[Fmu], components: &'p [Component]) -> Vec<&'p str> {
    let can = |c: &Component| fmus[c.fmu].model.co_simulation.can_serialize_fmu_state;
    components.iter().filter(|c| !can(c)).map(|c| c.name.as_str()).collect()
}
