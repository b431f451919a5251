//! When a run writes checkpoints.

use std::sync::Arc;
use std::time::Instant;

use terramech_results::RunFolder;

use super::Options;
use crate::check::cannot_be_saved;
use crate::check::plan::Plan;
use crate::checkpoint::{Checkpoint, Header, How, fingerprint};
use crate::coupling::{Algorithm, Failure, System};
use crate::decimal::Decimal;
use crate::record::Recorder;

/// The checkpoints of a run.
pub struct Saving {
    how: Option<How>,
    from: Option<Arc<Checkpoint>>,
    /// Period in base steps.
    every: Option<u64>,
    next: u64,
    written: Option<u64>,
    fingerprint: Vec<(String, String)>,
    begin: Instant,
}

impl Saving {
    /// Checks that what is asked for can be done.
    ///
    /// # Errors
    /// [`Failure::Input`]: a period that is no multiple of the base step, units that cannot be saved.
    pub fn new(plan: &Plan, options: &Options, begin: Instant) -> Result<Self, Failure> {
        let cannot = cannot_be_saved(&plan.fmus, &plan.components);
        let mut how = options.checkpoints.how.clone();
        let mut every = None;
        if let Some(text) = how.as_ref().and_then(|h| h.every.as_deref()) {
            let period = Decimal::parse(text).map_err(|allowed| {
                Failure::Input(format!("--checkpoint-every {text}: allowed: {allowed}, in simulated seconds"))
            })?;
            every = period.count_of(plan.clock.step).filter(|n| *n > 0);
            if every.is_none() {
                let (below, above) = period.neighbours(plan.clock.step);
                return Err(Failure::Input(format!(
                    "--checkpoint-every {text}: it is no whole multiple of the base step {} s; the nearest are {below} and {above} s",
                    plan.clock.step
                )));
            }
            if !cannot.is_empty() {
                return Err(Failure::Input(format!(
                    "--checkpoint-every: these units cannot save their state (canSerializeFMUstate is false): {}",
                    cannot.join(", ")
                )));
            }
        }
        if !cannot.is_empty() {
            how = None;
        }
        let from = options.checkpoints.from.clone();
        let next = from.as_ref().map_or(0, |c| c.header.tick) + every.unwrap_or(0);
        let written = from.as_ref().map(|c| c.header.tick);
        Ok(Self { how, from, every, next, written, fingerprint: fingerprint(plan), begin })
    }

    /// The checkpoint that the run goes on from.
    pub fn from(&self) -> Option<&Checkpoint> {
        self.from.as_deref()
    }

    /// Wall time of all parts of the run (s).
    pub fn wall_seconds(&self) -> f64 {
        self.begin.elapsed().as_secs_f64() + self.from.as_ref().map_or(0.0, |c| c.header.wall_seconds)
    }

    /// Whether one should be written at this base step or as soon as it can be.
    pub fn is_due(&self, tick: u64, stopping: bool) -> bool {
        self.how.is_some() && (stopping || (self.every.is_some() && tick >= self.next))
    }

    /// Whether there is one of this base step.
    pub fn is_at(&self, tick: u64) -> bool {
        self.written == Some(tick)
    }

    /// Writes one, if there is none of this base step yet.
    ///
    /// # Errors
    /// A unit that cannot be saved, [`Failure::Results`].
    pub fn write(
        &mut self,
        folder: &RunFolder,
        system: &mut System,
        recorder: &mut Recorder,
        algorithm: &dyn Algorithm,
        tick: u64,
    ) -> Result<(), Failure> {
        let (Some(how), false) = (&self.how, self.is_at(tick)) else { return Ok(()) };
        let (units, coupling) = system.save(tick)?;
        let header = Header {
            program: env!("CARGO_PKG_VERSION").into(),
            isa: terramech_simd::Isa::chosen().map(|isa| isa.to_string()).unwrap_or_default(),
            how: how.clone(),
            fingerprint: self.fingerprint.clone(),
            tick,
            time: system.clock().time(tick),
            wall_seconds: self.wall_seconds(),
            coupling,
            algorithm: algorithm.save().into_iter().map(f64::to_bits).collect(),
            recording: recorder.save()?,
            ..Header::default()
        };
        Checkpoint { header, units }.write(folder, how.keep)?;
        self.written = Some(tick);
        if let Some(every) = self.every {
            self.next = (tick / every + 1) * every;
        }
        Ok(())
    }
}
