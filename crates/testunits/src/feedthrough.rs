//! Hands every scalar type through, one step late.

use terramech_fmi2::{
    BooleanVar, Host, IntegerVar, Model, RealVar, Stage, Step, StringVar, Table, Unit, UnitError, Values, Var,
};

#[derive(Clone, Copy)]
struct Vars {
    real: (RealVar, RealVar),
    integer: (IntegerVar, IntegerVar),
    boolean: (BooleanVar, BooleanVar),
    string: (StringVar, StringVar),
    specification: StringVar,
    given: StringVar,
    length: IntegerVar,
    is_file: BooleanVar,
    threads: IntegerVar,
    got: IntegerVar,
}

struct Feedthrough(Vars);

impl Feedthrough {
    fn hand_on(&self, v: &mut Values) {
        v[self.0.real.1] = v[self.0.real.0];
        v[self.0.integer.1] = v[self.0.integer.0];
        v[self.0.boolean.1] = v[self.0.boolean.0];
        let text = v.string(self.0.string.0).to_owned();
        v.set_string(self.0.string.1, text);
        let text = v.string(self.0.specification).to_owned();
        v[self.0.is_file] = std::path::Path::new(&text).is_file();
        v.set_string(self.0.given, text);
        v[self.0.length] = v.string(self.0.string.1).len() as i32;
        v[self.0.got] = v[self.0.threads];
    }
}

impl Unit for Feedthrough {
    fn refresh(&mut self, v: &mut Values, _: &Host, _: u32, stage: Stage) -> Result<(), UnitError> {
        if stage != Stage::Stepping {
            self.hand_on(v);
        }
        Ok(())
    }
    fn exit_initialization(&mut self, v: &mut Values, _: &Host) -> Result<(), UnitError> {
        self.hand_on(v);
        Ok(())
    }
    fn step(&mut self, v: &mut Values, _: &Host, _: Step) -> Result<(), UnitError> {
        self.hand_on(v);
        Ok(())
    }
    fn save(&mut self) -> Result<Vec<u8>, UnitError> {
        Ok(Vec::new())
    }
    fn restore(&mut self, _: &mut Values, _: &[u8]) -> Result<(), UnitError> {
        Ok(())
    }
}

/// Inputs and outputs of every scalar type, and what it was given as `specification` and `threads`.
pub fn model() -> Model {
    let mut t = Table::new();
    let common = t.common_parameters();
    let real = (t.input_real("real.in", 1.5, "m", "Real"), t.output_real("real.out", "m", "Real"));
    let integer = (t.input_integer("integer.in", 3, "Integer"), t.output_integer("integer.out", "Integer"));
    let boolean = (t.input_boolean("boolean.in", true, "Boolean"), t.output_boolean("boolean.out", "Boolean"));
    let string = (t.input_string("string.in", "one", "String"), t.output_string("string.out", "String"));
    let given = t.output_string("given.specification", "The specification it was given");
    let length = t.output_integer("string.length", "Bytes of string.out");
    let is_file = t.output_boolean("given.is_file", "Whether the specification is the path of a file");
    let got = t.output_integer("given.threads", "The threads it was given");
    t.depends_initially(real.1, &[real.0.vr()]);
    t.depends_initially(integer.1, &[integer.0.vr()]);
    t.depends_initially(boolean.1, &[boolean.0.vr()]);
    t.depends_initially(string.1, &[string.0.vr()]);
    let vars = Vars {
        real,
        integer,
        boolean,
        string,
        specification: common.specification,
        given,
        length,
        is_file,
        threads: common.threads,
        got,
    };
    Model::new("feedthrough", "Hands every scalar type through", t, move || Box::new(Feedthrough(vars)))
}
