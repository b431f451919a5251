//! Times as whole numbers of base steps.

use super::system::System;
use crate::decimal::{Clock, Decimal};
use crate::fault::{FaultKind, Faults, Place};

/// The clock and each component's communication step in base steps.
pub struct Times {
    pub clock: Clock,
    pub multiples: Vec<u64>,
}

/// A time in base steps; a fault if it is none.
pub fn in_steps(
    what: &str,
    time: Decimal,
    base: Decimal,
    place: &Place,
    element: &str,
    faults: &mut Faults,
) -> Option<u64> {
    let count = time.count_of(base);
    if count.is_none() {
        let (below, above) = time.neighbours(base);
        let kind = FaultKind::NotAMultiple {
            what: what.to_owned(),
            given: time.to_string(),
            base: base.to_string(),
            nearest: format!("{below} and {above}"),
        };
        faults.add(place, element, kind);
    }
    count
}

/// Start, base step, number of steps, multiples. `None` with a fault where there is no clock to be had.
pub fn times(system: &System<'_>, stop_time: Option<&str>, faults: &mut Faults) -> Option<Times> {
    let d = system.description;
    if d.times_are_bad {
        return None;
    }
    let element = "DefaultExperiment";
    let start = d.start.unwrap_or(Decimal::ZERO);
    let step = base_step(system, faults);
    let (stop, stop_place) = match stop_time {
        Some(text) => {
            let place = Place::file("--stop-time");
            match Decimal::parse(text) {
                Ok(stop) => (Some(stop), place),
                Err(allowed) => {
                    let kind = FaultKind::BadValue { what: "--stop-time".into(), given: text.to_owned(), allowed };
                    faults.add(&place, "", kind);
                    (None, place)
                }
            }
        }
        None => {
            if d.stop.is_none() {
                faults.add(&d.place, element, FaultKind::MissingAttribute { name: "stopTime" });
            }
            (d.stop, d.place.clone())
        }
    };
    let (step, stop) = (step?, stop?);
    let length = stop.minus(start);
    if !length.is_positive() {
        let allowed = format!("a time after the start time {start}");
        let kind = FaultKind::BadValue { what: "stop time".into(), given: stop.to_string(), allowed };
        faults.add(&stop_place, if stop_time.is_some() { "" } else { element }, kind);
        return None;
    }
    let element_of_stop = if stop_time.is_some() { "" } else { element };
    let steps = in_steps("the time from start to stop", length, step, &stop_place, element_of_stop, faults)?;
    let mut multiples = Vec::with_capacity(d.components.len());
    for c in &d.components {
        let element = format!("Component \"{}\"", c.name);
        let multiple = match (c.extras.multiple, c.step_hint) {
            (Some(multiple), hint) => {
                if hint.is_some_and(|hint| hint.count_of(step) != Some(multiple)) {
                    faults.note(
                        &c.place,
                        &element,
                        "its multiple and its osp:StepSizeHint differ; the multiple counts",
                    );
                }
                multiple
            }
            (None, Some(hint)) => match in_steps("osp:StepSizeHint", hint, step, &c.place, &element, faults) {
                Some(0) | None => 1,
                Some(multiple) => multiple,
            },
            (None, None) => 1,
        };
        if steps % multiple != 0 {
            let text = format!(
                "it communicates every {multiple} base steps, of which the run has {steps}: its last step would end after the run and is left out"
            );
            faults.note(&c.place, &element, text);
        }
        multiples.push(multiple);
    }
    Some(Times { clock: Clock { start, step, steps }, multiples })
}

/// The base step: of the description, else the smallest hint of a component, else of an FMU.
fn base_step(system: &System<'_>, faults: &mut Faults) -> Option<Decimal> {
    let d = system.description;
    if let Some(step) = d.base_step {
        return Some(step);
    }
    let smallest = |steps: &mut dyn Iterator<Item = Decimal>| steps.min_by(|a, b| a.to_f64().total_cmp(&b.to_f64()));
    let hint = smallest(&mut d.components.iter().filter_map(|c| c.step_hint));
    let of_fmus = || {
        let texts = system.fmus.iter().filter_map(|fmu| fmu.model.default_experiment.step_size.as_deref());
        smallest(&mut texts.filter_map(|text| Decimal::parse(text).ok()))
    };
    match hint.or_else(of_fmus) {
        Some(step) => {
            let text = format!(
                "gives no base step (osp:FixedStepAlgorithm/@baseStepSize): {step} s is taken, the smallest that a component asks for"
            );
            faults.note(&d.place, "DefaultExperiment", text);
            Some(step)
        }
        // An FMU that cannot be opened may have one.
        None if system.fmu_of.contains(&None) => None,
        None => {
            let kind =
                FaultKind::MissingElement { name: "Annotations/Annotation/osp:Algorithm/osp:FixedStepAlgorithm" };
            faults.add(&d.place, "DefaultExperiment", kind);
            None
        }
    }
}
