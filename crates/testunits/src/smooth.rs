//! A unit that interpolates its input: a free mass that takes derivatives of the force into account; and a force that is a parabola over time.

use terramech_fmi2::{Host, Model, RealVar, Stage, Step, Table, Unit, UnitError, Values, state};

/// The force at a time (s) in N.
pub fn force(t: f64) -> f64 {
    1.0 + 2.0 * t - 3.0 * t * t
}

/// Position (m) of a mass of 1 kg from rest under that force after a time (s).
pub fn position(t: f64) -> f64 {
    t * t / 2.0 + t.powi(3) / 3.0 - t.powi(4) / 4.0
}

struct Parabola(RealVar);

impl Unit for Parabola {
    fn refresh(&mut self, v: &mut Values, _: &Host, _: u32, stage: Stage) -> Result<(), UnitError> {
        if stage != Stage::Stepping {
            v[self.0] = force(0.0);
        }
        Ok(())
    }
    fn exit_initialization(&mut self, v: &mut Values, _: &Host) -> Result<(), UnitError> {
        v[self.0] = force(0.0);
        Ok(())
    }
    fn step(&mut self, v: &mut Values, _: &Host, step: Step) -> Result<(), UnitError> {
        v[self.0] = force(step.time + step.size);
        Ok(())
    }
    fn save(&mut self) -> Result<Vec<u8>, UnitError> {
        Ok(Vec::new())
    }
    fn restore(&mut self, _: &mut Values, _: &[u8]) -> Result<(), UnitError> {
        Ok(())
    }
}

/// Tells the force.
pub fn parabola_model() -> Model {
    let mut t = Table::new();
    let out = t.output_real("force", "N", "Force");
    t.depends_initially(out, &[]);
    Model::new("parabola", "A force that is a parabola over time", t, move || Box::new(Parabola(out)))
}

struct Smooth {
    force: RealVar,
    out: RealVar,
    x: f64,
    v: f64,
}

impl Unit for Smooth {
    fn step(&mut self, v: &mut Values, _: &Host, step: Step) -> Result<(), UnitError> {
        let h = step.size;
        let [f, f1, f2] = [v[self.force], v.derivative(self.force, 1), v.derivative(self.force, 2)];
        self.x += h * (self.v + h * (f / 2.0 + h * (f1 / 6.0 + h * f2 / 24.0)));
        self.v += h * (f + h * (f1 / 2.0 + h * f2 / 6.0));
        v[self.out] = self.x;
        Ok(())
    }
    fn save(&mut self) -> Result<Vec<u8>, UnitError> {
        state::to_bytes(&[self.x, self.v])
    }
    fn restore(&mut self, _: &mut Values, bytes: &[u8]) -> Result<(), UnitError> {
        [self.x, self.v] = state::from_bytes(bytes)?;
        Ok(())
    }
}

/// Moves a mass of 1 kg.
pub fn smooth_model() -> Model {
    let mut t = Table::new();
    let force = t.input_real("force", 0.0, "N", "Force");
    let out = t.output_real("position", "m", "Position");
    let mut model = Model::new("smooth", "A mass that interpolates its force", t, move || {
        Box::new(Smooth { force, out, x: 0.0, v: 0.0 })
    });
    model.interpolates_inputs = true;
    model
}
