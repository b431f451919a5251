//! The communication step up to which the coupling of these units is stable, found by trying.
//!
//! All units keep their state. For a step H the system is run twice from there, the second time with all Real inputs of the first step a
//! little off. What becomes of the difference tells: where it grows over the last part of the run, the coupling is unstable at H. The limit
//! between growth and decay is then enclosed by halving. No unit need be linear; the difference is small. Nothing is changed: at the end the units
//! are where they were.

use std::sync::Arc;

use super::{Advance, Algorithm, Failure, Jacobi, System, algorithm_of, assemble};
use crate::check::plan::Plan;
use crate::decimal::{Clock, Decimal};
use crate::description::algorithm::Scheme;
use crate::loading::{Environment, LogLine};

/// Steps of a trial; with a step below the base step as many as cover the same time, so that slow motions show their whole course.
const STEPS: u64 = 1000;
/// Largest and smallest step tried, times the base step.
const WIDEST: f64 = 4096.0;
const FINEST: f64 = 1.0 / 4096.0;
/// How much is added to each input at the first step, relative to its size.
const PUSH: f64 = 1e-6;
/// The limit is enclosed this well.
const WITHIN: f64 = 1.005;

/// What was found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Stability {
    /// Stable below this step (s).
    Below(f64),
    /// No limit up to this step (s).
    NoLimit(f64),
    /// Unstable even at this step (s).
    Never(f64),
}

impl std::fmt::Display for Stability {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Below(step) => write!(f, "stable below a step of about {step:.3e} s"),
            Self::NoLimit(step) => write!(f, "no limit found up to a step of {step:.3e} s"),
            Self::Never(step) => write!(f, "unstable even at a step of {step:.3e} s"),
        }
    }
}

struct Silent;

impl Environment for Silent {
    fn log(&self, _: LogLine<'_>) {}
    fn progress(&self, _: &str, _: &str, _: f64) -> bool {
        true
    }
}

/// Makes and initialises the units of a plan and estimates the limit at its start.
///
/// # Errors
/// Units that do not start, or cannot keep their state.
pub fn stability_of(plan: Plan, threads: usize) -> Result<Stability, Failure> {
    if let Some(c) = (0..plan.components.len()).find(|&c| !plan.model(c).co_simulation.can_get_and_set_fmu_state) {
        return Err(Failure::Input(format!(
            "the stable step cannot be estimated: unit {} cannot keep its state (canGetAndSetFMUstate is false)",
            plan.components[c].name
        )));
    }
    let environment: Arc<dyn Environment> = Arc::new(Silent);
    let mut system = assemble(Arc::new(plan), threads, false, &environment, None)?;
    system.initialise()?;
    stability(&mut system, 0)
}

/// Estimates the limit from where the system stands at base step `tick`.
///
/// # Errors
/// A unit that cannot keep its state, or fails before a step was tried.
pub fn stability(system: &mut System, tick: u64) -> Result<Stability, Failure> {
    let clock = system.clock();
    system.keep(tick)?;
    let result = search(system, clock, clock.exact_time(tick));
    system.rewind(tick)?;
    system.set_clock(clock);
    result
}

fn search(system: &mut System, clock: Clock, start: Decimal) -> Result<Stability, Failure> {
    let base = clock.length(1);
    let mut stable = |step: f64| is_stable(system, start, step, (STEPS as f64 * (base / step).max(1.0)) as u64);
    // From below, in small strides about the base step: above the limit there may be steps that happen to be stable again.
    let (mut low, mut high) = (base / 4.0, base / 4.0);
    if stable(low)? {
        loop {
            high *= if high < 16.0 * base { 1.25 } else { 2.0 };
            if high > WIDEST * base {
                return Ok(Stability::NoLimit(low));
            }
            if !stable(high)? {
                break;
            }
            low = high;
        }
    } else {
        loop {
            low /= 2.0;
            if low < FINEST * base {
                return Ok(Stability::Never(high));
            }
            if stable(low)? {
                break;
            }
            high = low;
        }
    }
    while high / low > WITHIN {
        let middle = (low * high).sqrt();
        if stable(middle)? { low = middle } else { high = middle }
    }
    Ok(Stability::Below(low))
}

/// Whether a small difference decays at this step (s). A unit that fails on the way has left the range where it can compute: unstable.
fn is_stable(system: &mut System, start: Decimal, step: f64, steps: u64) -> Result<bool, Failure> {
    let Ok(step) = Decimal::parse(&format!("{step:.4e}")) else { return Ok(false) };
    system.set_clock(Clock { start, step, steps: steps + 1 });
    let Some(base) = run(system, steps, None)? else { return Ok(false) };
    let Some(pushed) = run(system, steps, Some(PUSH))? else { return Ok(false) };
    let mut scale = vec![0.0_f64; base.first().map_or(0, Vec::len)];
    for row in &base {
        scale.iter_mut().zip(row).for_each(|(s, x)| *s = s.max(x.abs()));
    }
    let difference = |k: usize| {
        let parts = base[k].iter().zip(&pushed[k]).zip(&scale);
        parts.map(|((a, b), s)| if *s > 0.0 { ((a - b) / s).powi(2) } else { 0.0 }).sum::<f64>()
    };
    let size = |from: usize, to: usize| (from..to).map(difference).sum::<f64>();
    let n = base.len();
    let (before, after) = (size(n / 2, 3 * n / 4), size(3 * n / 4, n));
    // A difference that has decayed to rounding says nothing more than that.
    Ok(after <= before || after < n as f64 * 1e-26)
}

/// All Real inputs at each step from the kept state; `None` where a unit fails.
fn run(system: &mut System, steps: u64, push: Option<f64>) -> Result<Option<Vec<Vec<f64>>>, Failure> {
    system.rewind(0)?;
    let plan = Arc::clone(system.plan());
    // Steps of one length, also where the run would vary them.
    system.set_stride(1);
    let mut algorithm: Box<dyn Algorithm> = match plan.algorithm.scheme {
        Scheme::Ecco => Box::new(Jacobi),
        _ => algorithm_of(&plan),
    };
    let mut rows = Vec::with_capacity(steps as usize);
    let mut walk = |system: &mut System| -> Result<(), Failure> {
        // The push goes in with a plain first step: an algorithm that reads outputs again would take it back.
        system.read(0)?;
        system.push_outputs(push.unwrap_or(0.0));
        system.plain_step(0)?;
        let mut tick = 1;
        while tick < steps {
            system.read(tick)?;
            match algorithm.advance(system, tick)? {
                Advance::To(next) => tick = next,
                Advance::Ended(_) => break,
            }
            let inputs = system.input_values();
            if inputs.iter().any(|x| !x.is_finite() || x.abs() > 1e100) {
                return Err(Failure::Input(String::new()));
            }
            rows.push(inputs);
        }
        Ok(())
    };
    match walk(system) {
        Ok(()) if rows.len() >= 16 => Ok(Some(rows)),
        Ok(()) => Ok(None),
        Err(_) => Ok(None),
    }
}
