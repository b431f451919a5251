//! Steps of an instance: done, in the background, broken off and gone on with.

use std::ffi::c_int;
use std::time::Duration;

use terramech_fmi2::types::*;

use super::Instance;
use crate::loading::pulse::Name;
use crate::loading::{CallError, Status};

/// How often a pending step is asked for.
const PENDING_PAUSE: Duration = Duration::from_micros(50);

/// How a step ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Stepped {
    /// The step was done.
    Done,
    /// The unit ended the run by itself, having reached this time (s).
    Ended(f64),
}

impl Instance {
    /// `fmi2DoStep` from `time` over `size` (s). A step in the background is awaited. A step that the unit breaks off is gone on with from where it came to,
    /// one that it does not begin is tried in halves, if the unit takes steps of any length; its inputs stay as they are.
    ///
    /// # Errors
    /// [`CallError`]; a discarded step tells in `said` how far it came.
    #[inline]
    pub fn step(&mut self, time: f64, size: f64) -> Result<Stepped, CallError> {
        match self.quick_step(time, size) {
            Ok(()) => Ok(Stepped::Done),
            Err(code) => self.after(code, time, size),
        }
    }

    /// After a step was discarded: asks how far it came and goes on from there.
    #[cold]
    fn go_on(&mut self, time: f64, size: f64, discarded: CallError) -> Result<Stepped, CallError> {
        /// Parts that one step may fall into, and the smallest of them.
        const MOST: usize = 1000;
        const LEAST: f64 = 1.0 / 1024.0;
        let end = time + size;
        let (nothing, hardly) = (1e-9 * size, 1e-12 * size);
        let (mut from, mut part, mut last) = (time, size, discarded);
        let mut reached = None;
        for _ in 0..MOST {
            reached = self.last_successful_time();
            if self.terminated() {
                self.running = false;
                return Ok(Stepped::Ended(reached.unwrap_or(from)));
            }
            match reached.filter(|_| self.variable_steps) {
                Some(t) if t > from + hardly && t <= end + nothing => (from, part) = (t, end - t),
                Some(t) if (t - from).abs() <= hardly && part > LEAST * size => part *= 0.5,
                _ => break,
            }
            self.early_returns += 1;
            last = loop {
                if end - from <= nothing {
                    return Ok(Stepped::Done);
                }
                part = part.min(end - from);
                let code = match self.quick_step(from, part) {
                    Ok(()) => {
                        from += part;
                        continue;
                    }
                    Err(FMI2_PENDING) => {
                        let code = self.wait();
                        self.pulse.end(self.calls);
                        code
                    }
                    Err(code) => code,
                };
                match if code == FMI2_OK { Ok(()) } else { self.judge(&"fmi2DoStep", code) } {
                    Ok(()) => from += part,
                    Err(e) if e.status == Status::Discard => break e,
                    Err(e) => return Err(e),
                }
            };
        }
        self.alive = false;
        last.said.push(match reached {
            Some(reached) => format!("the step from t = {time} s over {size} s was done up to t = {reached} s"),
            None => format!("the step from t = {time} s over {size} s was not done"),
        });
        if !self.variable_steps {
            last.said.push("it takes steps of one length only (canHandleVariableCommunicationStepSize is false), so nothing follows".into());
        }
        Err(last)
    }

    /// How often the unit broke a step off and went on.
    pub fn early_returns(&self) -> u64 {
        self.early_returns
    }

    /// [`Instance::step`] for a step that ends as wanted.
    ///
    /// # Errors
    /// The status, if it is another than fmi2OK: see [`Instance::after`].
    #[inline]
    pub fn quick_step(&mut self, time: f64, size: f64) -> Result<(), Fmi2Status> {
        if !self.is_alive() {
            return Err(FMI2_ERROR);
        }
        let no_way_back = c_int::from(self.kept.is_null());
        self.calls = self.calls.wrapping_add(1);
        self.pulse.begin(&"fmi2DoStep", self.calls);
        // SAFETY: no pointers but the component.
        let code = unsafe { (self.functions.do_step)(self.component.as_ptr(), time, size, no_way_back) };
        if code == FMI2_PENDING {
            return Err(code);
        }
        self.pulse.end(self.calls);
        if code == FMI2_OK { Ok(()) } else { Err(code) }
    }

    /// What becomes of a step after [`Instance::quick_step`] has given this status.
    ///
    /// # Errors
    /// As [`Instance::step`].
    #[cold]
    pub fn after(&mut self, mut code: Fmi2Status, time: f64, size: f64) -> Result<Stepped, CallError> {
        let name: Name = &"fmi2DoStep";
        if !self.is_alive() {
            return Err(self.refused(name, Status::NotCalled, String::new()));
        }
        if code == FMI2_PENDING {
            code = self.wait();
            self.pulse.end(self.calls);
        }
        match if code == FMI2_OK { Ok(()) } else { self.judge(name, code) } {
            Ok(()) => Ok(Stepped::Done),
            Err(e) if e.status == Status::Discard => self.go_on(time, size, e),
            Err(e) => Err(e),
        }
    }

    /// Waits for a step in the background; gives its status.
    fn wait(&mut self) -> Fmi2Status {
        let Some(get_status) = self.functions.get_status else { return FMI2_PENDING };
        let mut status = FMI2_PENDING;
        while status == FMI2_PENDING {
            std::thread::sleep(PENDING_PAUSE);
            // SAFETY: no pointers but the component and a status on our stack.
            if unsafe { get_status(self.component.as_ptr(), FMI2_DO_STEP_STATUS, &raw mut status) } != FMI2_OK {
                status = FMI2_ERROR;
            }
        }
        status
    }

    fn last_successful_time(&mut self) -> Option<f64> {
        let function = self.library.functions.get_real_status?;
        let mut time = f64::NAN;
        // SAFETY: the value goes to our stack.
        let result =
            self.call(&"fmi2GetRealStatus", |_, c| unsafe { function(c, FMI2_LAST_SUCCESSFUL_TIME, &raw mut time) });
        result.ok().and(time.is_finite().then_some(time))
    }

    fn terminated(&mut self) -> bool {
        let Some(function) = self.library.functions.get_boolean_status else { return false };
        let mut ended = FMI2_FALSE;
        // SAFETY: the value goes to our stack.
        let result = self.call(&"fmi2GetBooleanStatus", |_, c| unsafe { function(c, FMI2_TERMINATED, &raw mut ended) });
        result.is_ok() && ended != FMI2_FALSE
    }
}
