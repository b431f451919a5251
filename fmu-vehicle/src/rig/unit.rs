//! The unit: parameters in, wheel state and measurements out.

use super::average::RunningMean;
use super::config::RigSpecification;
use super::dynamics::{Motion, Phase, Rig, Taken};
use super::variables::{MEASURED, OVERRIDES, Variables, read_base, read_mode};
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;
use terramech_fmi2::specification::{self, Faults};
use terramech_fmi2::{Host, LogCategory, Stage, Step, Unit, UnitError, Values, Var, state};
use terramech_mechanics::Vec3;

/// The single-wheel rig.
///
/// Until initialization mode ends, placing the wheel is a pure function of specification, parameters and `ground_height`,
/// redone at each get: inputs may be set and outputs read in any order.
pub struct RigUnit {
    vars: Variables,
    own: Own,
}

/// Everything that is saved.
#[derive(Clone, Default, Serialize, Deserialize)]
struct Own {
    /// The specification as read, and where from.
    spec: Option<(RigSpecification, String)>,
    /// Parameters that the environment has set.
    given: BTreeSet<u32>,
    run: Option<Run>,
}

#[derive(Clone, Serialize, Deserialize)]
struct Run {
    rig: Rig,
    motion: Motion,
    mean: RunningMean,
    told_stop: bool,
}

impl RigUnit {
    /// A fresh instance.
    pub fn new(vars: Variables) -> Self {
        Self { vars, own: Own::default() }
    }

    /// Whether the environment has given a parameter: by setting it, or (in a state that was saved before) by a value
    /// other than its start.
    fn given(&mut self, v: &mut Values, vr: impl Var, differs: bool) -> bool {
        if v.take_changed(vr) || differs {
            self.own.given.insert(vr.vr());
        }
        self.own.given.contains(&vr.vr())
    }

    /// The rig as parameters, inputs and specification say now.
    fn resolve(&mut self, v: &mut Values) -> Result<Rig, UnitError> {
        let Some((mut spec, origin)) = self.own.spec.clone() else {
            return Err(UnitError::input("the rig has no specification: initialization mode comes first"));
        };
        let mut faults = Faults::new();
        let mut defaults = RigSpecification::default();
        let vars = self.vars.clone();
        for (var, (.., place)) in vars.overrides.iter().zip(&OVERRIDES) {
            if self.given(v, *var, v[*var] != *place(&mut defaults)) {
                *place(&mut spec) = v[*var];
            }
        }
        let mode = read_mode(v.string(vars.mode));
        let base = read_base(v.string(vars.base));
        for (path, given, allowed) in [
            ("drive.mode", v.string(vars.mode), mode.as_ref().err()),
            ("drive.base", v.string(vars.base), base.as_ref().err()),
        ] {
            if let Some(allowed) = allowed {
                faults.check(false, path, format!("'{given}'"), allowed);
            }
        }
        faults.into_result("parameters of the rig")?;
        let (mode, base) = (mode.unwrap_or(spec.drive.mode), base.unwrap_or(spec.drive.base));
        if self.given(v, vars.mode, mode != defaults.drive.mode) {
            spec.drive.mode = mode;
        }
        if self.given(v, vars.base, base != defaults.drive.base) {
            spec.drive.base = base;
        }
        spec.check(&format!("{origin}, overridden by parameters"))?;
        let radius = v[vars.tire_radius];
        let outer = v[vars.outer_radius];
        let mut faults = Faults::new();
        faults.positive("wheel[1].tire_radius", radius);
        let allowed = "0 (no grousers) or at least 'wheel[1].tire_radius'";
        faults.check(outer == 0.0 || outer >= radius, "wheel[1].outer_radius", outer, allowed);
        faults.into_result("parameters of the rig")?;
        Ok(Rig {
            spec,
            radius,
            outer_radius: outer.max(radius),
            hub_mass: v[vars.hub_mass],
            hub_spin_inertia: v[vars.hub_inertia[1]],
            ground: v[vars.ground_height],
        })
    }

    /// Writes the motion's outputs.
    fn publish(&self, v: &mut Values, rig: &Rig, m: &Motion) {
        let (vars, state) = (&self.vars, rig.wheel_state(m).to_array());
        let s = &vars.wheel_state;
        let all = [&s.position[..], &s.orientation, &s.velocity, &s.angular_velocity].concat();
        for (var, x) in all.into_iter().zip(state) {
            v[var] = x;
        }
        let load = &rig.spec.load;
        v[vars.load_mass] = if load.force > 0.0 { load.force / super::dynamics::GRAVITY } else { load.mass };
        v[vars.carrier_position] = m.x;
        v[vars.carrier_velocity] = m.v;
        v[vars.wheel_speed] = m.omega;
        v[vars.slip_angle] = m.heading;
        v[vars.resistance] = rig.resistance(m);
        v[vars.phase] = rig.phase_number(m);
    }

    /// Places the wheel and writes the outputs at the start: no force has been met yet.
    fn publish_placed(&mut self, v: &mut Values) -> Result<(Rig, Motion), UnitError> {
        let rig = self.resolve(v)?;
        let motion = rig.place();
        self.publish(v, &rig, &motion);
        let measured = [0.0, 0.0, 0.0, 0.0, 0.0, rig.slip(&motion), rig.sinkage(&motion)];
        v.put(self.vars.measured, measured);
        v.put(self.vars.filtered, measured);
        Ok((rig, motion))
    }
}

impl Run {
    fn log(&mut self, host: &Host, before: Phase, time: f64) {
        let (rig, m) = (&self.rig, &self.motion);
        if m.phase != before {
            let text = match m.phase {
                Phase::Lowering => return,
                Phase::Releasing if m.on_stop => return self.log_stop(host, time),
                Phase::Releasing => format!("the soil carries the load of {} N", rig.load()),
                Phase::Running => "touchdown done".to_string(),
            };
            host.log(LogCategory::Info, &format!("t = {time} s: {text}, sinkage {} m", rig.sinkage(m)));
        } else if m.on_stop && !self.told_stop {
            self.log_stop(host, time);
        }
    }

    fn log_stop(&mut self, host: &Host, time: f64) {
        self.told_stop = true;
        let text = format!(
            "t = {time} s: the slide is on its end stop at a sinkage of {} m ('slide.greatest_sinkage'): the soil carries {} N of {} N",
            self.rig.sinkage(&self.motion),
            self.motion.carried,
            self.rig.load()
        );
        host.log(LogCategory::Warning, &text);
    }
}

impl Unit for RigUnit {
    fn enter_initialization(&mut self, v: &mut Values, host: &Host) -> Result<(), UnitError> {
        let default = super::default_specification();
        let spec = specification::load::<RigSpecification>(v.string(self.vars.common.specification), &default, host)?;
        spec.value.check(&spec.origin)?;
        self.own.spec = Some((spec.value, spec.origin));
        v.lock([self.vars.common.specification.vr()], "it was read when initialization mode began");
        Ok(())
    }

    fn refresh(&mut self, v: &mut Values, _: &Host, _vr: u32, stage: Stage) -> Result<(), UnitError> {
        if stage == Stage::Initialization {
            self.publish_placed(v)?;
        }
        Ok(())
    }

    fn exit_initialization(&mut self, v: &mut Values, host: &Host) -> Result<(), UnitError> {
        let (rig, motion) = self.publish_placed(v)?;
        host.log(
            LogCategory::Info,
            &format!(
                "rig: wheel of radius {} m placed at z = {} m above the ground at {} m; load {} N, sliding mass {} kg",
                rig.radius,
                motion.z,
                rig.ground,
                rig.load(),
                rig.sliding_mass()
            ),
        );
        let mean = RunningMean::new(rig.spec.filter_window, MEASURED);
        self.own.run = Some(Run { rig, motion, mean, told_stop: false });
        Ok(())
    }

    fn step(&mut self, v: &mut Values, host: &Host, step: Step) -> Result<(), UnitError> {
        let Some(run) = self.own.run.as_mut() else {
            return Err(UnitError::input("the rig has not been initialised"));
        };
        if run.rig.has_ended(&run.motion) {
            return Err(UnitError::Ended {
                last_successful_time: step.time,
                reason: format!("the resistance of {} N has stopped the carriage", run.rig.resistance(&run.motion)),
            });
        }
        let force: Vec3 = v.get(self.vars.wheel_wrench.force).into();
        let moment: Vec3 = v.get(self.vars.wheel_wrench.moment).into();
        let before = run.motion.phase;
        let taken: Taken = run.rig.advance(&mut run.motion, &force, step.size);
        let (rig, m) = (&run.rig, &run.motion);
        let along = rig.in_heading_frame(m, &force);
        let pull = rig.drawbar_pull(&force, &taken);
        let torque = rig.wheel_torque(m, &moment, &taken);
        let measured = [pull, along.x, along.y, along.z, torque, rig.slip(m), rig.sinkage(m)];
        let time = step.time + step.size;
        if !measured.iter().chain(&rig.wheel_state(m).to_array()).all(|x| x.is_finite()) {
            return Err(UnitError::numerical(format!(
                "the rig's motion at t = {time} s is not finite: force {:?} N, moment {:?} N m on the wheel",
                force.as_slice(),
                moment.as_slice()
            )));
        }
        let filtered = run.mean.push(step.size, measured);
        run.log(host, before, time);
        v.put(self.vars.measured, measured);
        v.put(self.vars.filtered, filtered);
        let run = self.own.run.as_ref().expect("checked above");
        self.publish(v, &run.rig, &run.motion);
        Ok(())
    }

    fn save(&mut self) -> Result<Vec<u8>, UnitError> {
        state::to_bytes(&self.own)
    }

    fn restore(&mut self, _: &mut Values, bytes: &[u8]) -> Result<(), UnitError> {
        self.own = state::from_bytes(bytes)?;
        Ok(())
    }
}
