//! Units whose work is next to nothing, for measuring what coupling costs: a first-order lag for rings, and a block that exchanges thousands
//! of values, as scalars or as an array.

use terramech_fmi2::{Host, Model, RealArrayVar, RealVar, Stage, Step, Table, Unit, UnitError, Values, Var, state};

/// Values that a block takes and gives.
pub const VALUES: usize = 3000;

struct Lag {
    start: RealVar,
    input: RealVar,
    output: RealVar,
}

impl Unit for Lag {
    fn refresh(&mut self, v: &mut Values, _: &Host, _: u32, stage: Stage) -> Result<(), UnitError> {
        if stage != Stage::Stepping {
            v[self.output] = v[self.start];
        }
        Ok(())
    }
    fn exit_initialization(&mut self, v: &mut Values, _: &Host) -> Result<(), UnitError> {
        v[self.output] = v[self.start];
        Ok(())
    }
    fn step(&mut self, v: &mut Values, _: &Host, _: Step) -> Result<(), UnitError> {
        v[self.output] += 0.5 * (v[self.input] - v[self.output]);
        Ok(())
    }
    fn save(&mut self) -> Result<Vec<u8>, UnitError> {
        Ok(Vec::new())
    }
    fn restore(&mut self, _: &mut Values, _: &[u8]) -> Result<(), UnitError> {
        Ok(())
    }
}

/// `out` moves half of the way to `in` at each step.
pub fn lag_model() -> Model {
    let mut t = Table::new();
    let start = t.parameter_real("start", 1.0, "1", "Output at the start");
    let input = t.input_real("in", 0.0, "1", "In");
    let output = t.output_real("out", "1", "Out");
    t.depends_initially(output, &[start.vr()]);
    Model::new("lag", "A first-order lag", t, move || Box::new(Lag { start, input, output }))
}

#[derive(Clone)]
struct BlockVars {
    inputs: Vec<RealVar>,
    outputs: Vec<RealVar>,
    all_in: RealArrayVar,
    all_out: RealArrayVar,
}

struct Block {
    vars: BlockVars,
    steps: u64,
}

impl Unit for Block {
    fn exit_initialization(&mut self, v: &mut Values, _: &Host) -> Result<(), UnitError> {
        *v.reals_mut(self.vars.all_out) = vec![1.0; VALUES];
        Ok(())
    }
    fn step(&mut self, v: &mut Values, _: &Host, _: Step) -> Result<(), UnitError> {
        // One value changes, so that what is measured is the exchange.
        self.steps += 1;
        let x = self.steps as f64;
        v[self.vars.outputs[0]] = x + 0.5 * v[self.vars.inputs[0]];
        let first = v.reals(self.vars.all_in).first().copied().unwrap_or(0.0);
        if let Some(to) = v.reals_mut(self.vars.all_out).first_mut() {
            *to = x + 0.5 * first;
        }
        Ok(())
    }
    fn save(&mut self) -> Result<Vec<u8>, UnitError> {
        state::to_bytes(&self.steps)
    }
    fn restore(&mut self, _: &mut Values, bytes: &[u8]) -> Result<(), UnitError> {
        self.steps = state::from_bytes(bytes)?;
        Ok(())
    }
}

/// Thousands of reals in and out.
pub fn block_model() -> Model {
    let mut t = Table::new();
    let inputs: Vec<RealVar> = (1..=VALUES).map(|i| t.input_real(&format!("in[{i}]"), 0.0, "1", "In")).collect();
    let outputs: Vec<RealVar> = (1..=VALUES).map(|i| t.output_real(&format!("out[{i}]"), "1", "Out")).collect();
    for output in &outputs {
        t.depends_initially(*output, &[]);
    }
    let all_in = t.input_real_array("in.all", "1", "In");
    let all_out = t.output_real_array("out.all", "1", "Out");
    let vars = BlockVars { inputs, outputs, all_in, all_out };
    Model::new("block", "Exchanges thousands of values", t, move || Box::new(Block { vars: vars.clone(), steps: 0 }))
}
