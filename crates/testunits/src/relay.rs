//! Two independent gains in one unit, so that a chain through two such units visits each of them twice at initialisation.

use terramech_fmi2::{Host, Model, RealVar, Stage, Step, Table, Unit, UnitError, Values, Var};

struct Relay {
    gain: RealVar,
    pairs: [(RealVar, RealVar); 2],
}

impl Relay {
    fn pass(&self, v: &mut Values) {
        for (from, to) in self.pairs {
            v[to] = v[self.gain] * v[from] + 1.0;
        }
    }
}

impl Unit for Relay {
    fn refresh(&mut self, v: &mut Values, _: &Host, _: u32, stage: Stage) -> Result<(), UnitError> {
        if stage != Stage::Stepping {
            self.pass(v);
        }
        Ok(())
    }
    fn exit_initialization(&mut self, v: &mut Values, _: &Host) -> Result<(), UnitError> {
        self.pass(v);
        Ok(())
    }
    fn step(&mut self, v: &mut Values, _: &Host, _: Step) -> Result<(), UnitError> {
        self.pass(v);
        Ok(())
    }
    fn save(&mut self) -> Result<Vec<u8>, UnitError> {
        Ok(Vec::new())
    }
    fn restore(&mut self, _: &mut Values, _: &[u8]) -> Result<(), UnitError> {
        Ok(())
    }
}

/// `out[i]` = gain x `in[i]` + 1.
pub fn model() -> Model {
    let mut t = Table::new();
    let gain = t.parameter_real("gain", 2.0, "1", "Gain");
    let pairs = [1, 2].map(|i| {
        let from = t.input_real(&format!("in[{i}]"), 0.0, "1", "In");
        let to = t.output_real(&format!("out[{i}]"), "1", "Out");
        t.depends_initially(to, &[gain.vr(), from.vr()]);
        (from, to)
    });
    Model::new("relay", "Two gains", t, move || Box::new(Relay { gain, pairs }))
}
