//! Arrays that change their size: a source, and an echo that returns what it got, doubled.

use terramech_fmi2::{
    Host, IntegerArrayVar, IntegerVar, Model, RealArrayVar, RealVar, Step, Table, Unit, UnitError, Values, state,
};

/// What the source publishes after `n` steps: n mod 5 points on a line at height n, and their numbers.
pub fn published(n: i32) -> (Vec<f64>, Vec<i32>) {
    let count = n % 5;
    let points = (0..count).flat_map(|i| [f64::from(i), 0.1 * f64::from(i), f64::from(n)]).collect();
    (points, (0..count).map(|i| i * 2).collect())
}

struct Source {
    points: RealArrayVar,
    numbers: IntegerArrayVar,
    triangle: IntegerArrayVar,
    n: i32,
}

impl Source {
    fn publish(&self, v: &mut Values) {
        let (points, numbers) = published(self.n);
        *v.reals_mut(self.points) = points;
        *v.integers_mut(self.numbers) = numbers;
        *v.integers_mut(self.triangle) = vec![0, 1, 2];
    }
}

impl Unit for Source {
    fn exit_initialization(&mut self, v: &mut Values, _: &Host) -> Result<(), UnitError> {
        self.publish(v);
        Ok(())
    }
    fn step(&mut self, v: &mut Values, _: &Host, _: Step) -> Result<(), UnitError> {
        self.n += 1;
        self.publish(v);
        Ok(())
    }
    fn save(&mut self) -> Result<Vec<u8>, UnitError> {
        state::to_bytes(&self.n)
    }
    fn restore(&mut self, _: &mut Values, bytes: &[u8]) -> Result<(), UnitError> {
        self.n = state::from_bytes(bytes)?;
        Ok(())
    }
}

/// Publishes points whose number changes from step to step.
pub fn source_model() -> Model {
    let mut t = Table::new();
    let points = t.output_real_array("points.position", "m", "Points (3n)");
    let numbers = t.output_integer_array("points.id", "Their numbers (n)");
    let triangle = t.output_integer_array("points.triangle", "One triangle (3)");
    t.fixed(triangle);
    Model::new("array_source", "Publishes arrays of changing size", t, move || {
        Box::new(Source { points, numbers, triangle, n: 0 })
    })
}

struct Echo {
    reals: (RealArrayVar, RealArrayVar),
    integers: (IntegerArrayVar, IntegerArrayVar),
    count: IntegerVar,
    sum: RealVar,
}

impl Unit for Echo {
    fn step(&mut self, v: &mut Values, _: &Host, _: Step) -> Result<(), UnitError> {
        let doubled: Vec<f64> = v.reals(self.reals.0).iter().map(|x| 2.0 * x).collect();
        let same = v.integers(self.integers.0).to_vec();
        v[self.count] = same.len() as i32;
        v[self.sum] = doubled.iter().sum();
        *v.reals_mut(self.reals.1) = doubled;
        *v.integers_mut(self.integers.1) = same;
        Ok(())
    }
    fn save(&mut self) -> Result<Vec<u8>, UnitError> {
        Ok(Vec::new())
    }
    fn restore(&mut self, _: &mut Values, _: &[u8]) -> Result<(), UnitError> {
        Ok(())
    }
}

/// Returns what it gets, reals doubled.
pub fn echo_model() -> Model {
    let mut t = Table::new();
    let reals =
        (t.input_real_array("in.position", "m", "Reals"), t.output_real_array("out.position", "m", "Reals, doubled"));
    let integers = (t.input_integer_array("in.id", "Integers"), t.output_integer_array("out.id", "Integers"));
    let count = t.output_integer("count", "Number of integers");
    let sum = t.output_real("sum", "m", "Sum of the doubled reals");
    Model::new("array_echo", "Returns the arrays it gets", t, move || Box::new(Echo { reals, integers, count, sum }))
}
