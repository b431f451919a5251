//! A unit that does at a set time what no unit should.

use std::time::Duration;

use terramech_fmi2::{Host, LogCategory, Model, RealVar, Step, StringVar, Table, Unit, UnitError, Values};

#[derive(Clone, Copy)]
struct Vars {
    mode: StringVar,
    at: RealVar,
    value: RealVar,
}

struct Trouble(Vars);

impl Unit for Trouble {
    fn enter_initialization(&mut self, v: &mut Values, _: &Host) -> Result<(), UnitError> {
        match v.string(self.0.mode) {
            "early" => Err(UnitError::input("'mode' is \"early\"; allowed: anything else")),
            _ => Ok(()),
        }
    }
    fn exit_initialization(&mut self, v: &mut Values, host: &Host) -> Result<(), UnitError> {
        match v.string(self.0.mode) {
            "late" => return Err(UnitError::input("'mode' is \"late\"; allowed: anything else")),
            "disk" => return Err(UnitError::environment("bed.bin: cannot be written: no space left")),
            // Ten minutes unless it is asked to stop.
            "settle" => {
                for i in 0..60_000 {
                    host.progress("settling", f64::from(i) / 60_000.0)?;
                    std::thread::sleep(Duration::from_millis(10));
                }
            }
            _ => {}
        }
        Ok(())
    }
    fn step(&mut self, v: &mut Values, host: &Host, step: Step) -> Result<(), UnitError> {
        let end = step.time + step.size;
        v[self.0.value] = end;
        if step.time < v[self.0.at] {
            return Ok(());
        }
        match v.string(self.0.mode) {
            "input" => Err(UnitError::input("the input makes no sense")),
            "numerical" => Err(UnitError::numerical("no convergence after 50 iterations")),
            "discard" => Err(UnitError::Discard {
                last_successful_time: step.time + 0.25 * step.size,
                reason: "too fast".into(),
            }),
            // Takes steps of up to 0.06 s and breaks longer ones off there, as a unit does that meets an event.
            "event" if step.size > 0.06 => {
                let reached = step.time + 0.06;
                v[self.0.value] = reached;
                Err(UnitError::Discard { last_successful_time: reached, reason: "an event".into() })
            }
            // Does not even begin a step that is longer than 0.04 s.
            "fussy" if step.size > 0.04 => {
                v[self.0.value] = step.time;
                Err(UnitError::Discard { last_successful_time: step.time, reason: "too long a step".into() })
            }
            // Gets nowhere, however small the step.
            "stuck" => Err(UnitError::Discard { last_successful_time: step.time, reason: "stuck".into() }),
            "panic" => panic!("the spring broke at 100 %"),
            "nan" => {
                v[self.0.value] = f64::NAN;
                Ok(())
            }
            "end" => Err(UnitError::Ended { last_successful_time: step.time, reason: "the track ends here".into() }),
            "talk" => {
                host.log(LogCategory::Warning, "100 % of the bed is used");
                Ok(())
            }
            "hang" => loop {
                std::thread::sleep(Duration::from_secs(1));
            },
            "slow" => {
                std::thread::sleep(Duration::from_millis(20));
                Ok(())
            }
            _ => Ok(()),
        }
    }
    fn save(&mut self) -> Result<Vec<u8>, UnitError> {
        Ok(Vec::new())
    }
    fn restore(&mut self, _: &mut Values, _: &[u8]) -> Result<(), UnitError> {
        Ok(())
    }
}

/// Misbehaves as `mode` says from the time `at` on.
pub fn model() -> Model {
    let mut t = Table::new();
    let mode = t.parameter_string(
        "mode",
        "",
        "early, late, disk, settle, input, numerical, discard, event, fussy, stuck, panic, nan, end, talk, slow, hang",
    );
    let at = t.parameter_real("at", 0.0, "s", "When");
    let value = t.output_real("value", "s", "Time reached");
    let vars = Vars { mode, at, value };
    Model::new("trouble", "Misbehaves", t, move || Box::new(Trouble(vars)))
}
