//! Two masses with a spring-damper between them, cut into two units: the first receives the coupling force and tells its motion, the
//! second receives that motion, holds the spring-damper and returns the force. Inputs are held over a step, the
//! inner solution is exact, so that what a test sees is the error of the coupling alone.

use terramech_fmi2::{Host, Model, RealVar, Stage, Step, Table, Unit, UnitError, Values, Var, state};

/// A mass on a spring and damper: m x'' = -k x - d v + f, with f constant over a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Oscillator {
    /// Mass (kg).
    pub m: f64,
    /// Stiffness (N/m).
    pub k: f64,
    /// Damping (N s/m).
    pub d: f64,
    /// Position (m).
    pub x: f64,
    /// Velocity (m/s).
    pub v: f64,
}

impl Oscillator {
    /// Exact motion over `h` (s) under the constant force `f` (N).
    pub fn step(&mut self, f: f64, h: f64) {
        // d/dt (x, v, 1) = A (x, v, 1): the exponential of A h by a Taylor series on h / 2^s, squared s times.
        let a = [[0.0, 1.0, 0.0], [-self.k / self.m, -self.d / self.m, f / self.m], [0.0; 3]];
        let norm = h * (1.0 + (self.k / self.m).abs() + (self.d / self.m).abs());
        // Of numbers without bounds (a state that was tampered with) nothing comes but more of them: no need to square for ever.
        let squarings = if norm > 0.5 { ((norm / 0.5).log2().ceil() as i32).min(1100) } else { 0 };
        let small = h / 2f64.powi(squarings);
        let mut e = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let mut term = e;
        for n in 1..=16 {
            term = product(term, a).map(|row| row.map(|x| x * small / f64::from(n)));
            for i in 0..3 {
                for j in 0..3 {
                    e[i][j] += term[i][j];
                }
            }
        }
        for _ in 0..squarings {
            e = product(e, e);
        }
        (self.x, self.v) =
            (e[0][0] * self.x + e[0][1] * self.v + e[0][2], e[1][0] * self.x + e[1][1] * self.v + e[1][2]);
    }
}

fn product(a: [[f64; 3]; 3], b: [[f64; 3]; 3]) -> [[f64; 3]; 3] {
    std::array::from_fn(|i| std::array::from_fn(|j| (0..3).map(|k| a[i][k] * b[k][j]).sum()))
}

/// The second mass with the coupling.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Partner {
    /// The mass on its own spring and damper.
    pub own: Oscillator,
    /// Coupling stiffness (N/m).
    pub cc: f64,
    /// Coupling damping (N s/m).
    pub dc: f64,
}

impl Partner {
    /// Exact motion over `h` (s) while the first mass is held at `x`, `v`.
    pub fn step(&mut self, x: f64, v: f64, h: f64) {
        let mut coupled = Oscillator { k: self.own.k + self.cc, d: self.own.d + self.dc, ..self.own };
        coupled.step(self.cc * x + self.dc * v, h);
        (self.own.x, self.own.v) = (coupled.x, coupled.v);
    }

    /// Force on the first mass (N).
    pub fn force(&self, x: f64, v: f64) -> f64 {
        self.cc * (self.own.x - x) + self.dc * (self.own.v - v)
    }
}

#[derive(Clone, Copy)]
struct Common {
    m: RealVar,
    k: RealVar,
    d: RealVar,
    x0: RealVar,
    v0: RealVar,
    x: RealVar,
    v: RealVar,
}

fn common(t: &mut Table) -> Common {
    let m = t.parameter_real("m", 1.0, "kg", "Mass");
    t.range(m, Some(1e-9), None);
    let k = t.parameter_real("k", 1.0, "N/m", "Stiffness of its own spring");
    let d = t.parameter_real("d", 1.0, "N.s/m", "Damping of its own spring");
    let x0 = t.parameter_real("x0", 0.0, "m", "Position at the start");
    let v0 = t.parameter_real("v0", 0.0, "m/s", "Velocity at the start");
    let x = t.output_real("position", "m", "Position");
    let v = t.output_real("velocity", "m/s", "Velocity");
    t.depends_initially(x, &[x0.vr()]);
    t.depends_initially(v, &[v0.vr()]);
    Common { m, k, d, x0, v0, x, v }
}

impl Common {
    fn oscillator(&self, v: &Values) -> Oscillator {
        Oscillator { m: v[self.m], k: v[self.k], d: v[self.d], x: v[self.x0], v: v[self.v0] }
    }
    fn publish(&self, o: &Oscillator, v: &mut Values) {
        v[self.x] = o.x;
        v[self.v] = o.v;
    }
}

struct First {
    vars: Common,
    force: RealVar,
    mass: Option<Oscillator>,
}

impl First {
    fn mass(&mut self, v: &mut Values) -> &mut Oscillator {
        let vars = self.vars;
        let mass = self.mass.get_or_insert_with(|| vars.oscillator(v));
        vars.publish(mass, v);
        mass
    }
}

impl Unit for First {
    fn refresh(&mut self, v: &mut Values, _: &Host, _: u32, _: Stage) -> Result<(), UnitError> {
        self.mass(v);
        Ok(())
    }
    fn exit_initialization(&mut self, v: &mut Values, _: &Host) -> Result<(), UnitError> {
        self.mass(v);
        Ok(())
    }
    fn step(&mut self, v: &mut Values, _: &Host, step: Step) -> Result<(), UnitError> {
        let force = v[self.force];
        self.mass(v).step(force, step.size);
        self.mass(v);
        Ok(())
    }
    fn save(&mut self) -> Result<Vec<u8>, UnitError> {
        state::to_bytes(&self.mass.map(|o| [o.m, o.k, o.d, o.x, o.v]))
    }
    fn restore(&mut self, _: &mut Values, bytes: &[u8]) -> Result<(), UnitError> {
        let saved: Option<[f64; 5]> = state::from_bytes(bytes)?;
        self.mass = saved.map(|[m, k, d, x, v]| Oscillator { m, k, d, x, v });
        Ok(())
    }
}

/// The force receiver.
pub fn first_model() -> Model {
    let mut t = Table::new();
    let vars = common(&mut t);
    let force = t.input_real("force", 0.0, "N", "Coupling force");
    Model::new("mass_first", "A mass that receives a force", t, move || Box::new(First { vars, force, mass: None }))
}

#[derive(Clone, Copy)]
struct SecondVars {
    own: Common,
    cc: RealVar,
    dc: RealVar,
    x1: RealVar,
    v1: RealVar,
    force: RealVar,
}

struct Second {
    vars: SecondVars,
    partner: Option<Partner>,
}

impl Second {
    fn partner(&mut self, v: &mut Values) -> &mut Partner {
        let vars = self.vars;
        let partner =
            self.partner.get_or_insert_with(|| Partner { own: vars.own.oscillator(v), cc: v[vars.cc], dc: v[vars.dc] });
        vars.own.publish(&partner.own, v);
        v[vars.force] = partner.force(v[vars.x1], v[vars.v1]);
        partner
    }
}

impl Unit for Second {
    fn refresh(&mut self, v: &mut Values, _: &Host, _: u32, _: Stage) -> Result<(), UnitError> {
        self.partner(v);
        Ok(())
    }
    fn exit_initialization(&mut self, v: &mut Values, _: &Host) -> Result<(), UnitError> {
        self.partner(v);
        Ok(())
    }
    fn step(&mut self, v: &mut Values, _: &Host, step: Step) -> Result<(), UnitError> {
        let (x, velocity) = (v[self.vars.x1], v[self.vars.v1]);
        self.partner(v).step(x, velocity, step.size);
        self.partner(v);
        Ok(())
    }
    fn save(&mut self) -> Result<Vec<u8>, UnitError> {
        state::to_bytes(&self.partner.map(|p| [p.own.m, p.own.k, p.own.d, p.own.x, p.own.v, p.cc, p.dc]))
    }
    fn restore(&mut self, _: &mut Values, bytes: &[u8]) -> Result<(), UnitError> {
        let saved: Option<[f64; 7]> = state::from_bytes(bytes)?;
        self.partner = saved.map(|[m, k, d, x, v, cc, dc]| Partner { own: Oscillator { m, k, d, x, v }, cc, dc });
        Ok(())
    }
}

/// The motion receiver, which returns the force.
pub fn second_model() -> Model {
    let mut t = Table::new();
    let own = common(&mut t);
    let cc = t.parameter_real("cc", 1.0, "N/m", "Coupling stiffness");
    let dc = t.parameter_real("dc", 1.0, "N.s/m", "Coupling damping");
    let x1 = t.input_real("other.position", 0.0, "m", "Position of the first mass");
    let v1 = t.input_real("other.velocity", 0.0, "m/s", "Velocity of the first mass");
    let force = t.output_real("force", "N", "Force on the first mass");
    // It depends directly on the inputs: read again after they were set it is another.
    t.on_demand(force);
    t.depends_initially(force, &[own.x0.vr(), own.v0.vr(), cc.vr(), dc.vr(), x1.vr(), v1.vr()]);
    let vars = SecondVars { own, cc, dc, x1, v1, force };
    Model::new("mass_second", "A mass that receives a motion and returns a force", t, move || {
        Box::new(Second { vars, partner: None })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_inner_solution_is_exact() {
        let mut o = Oscillator { m: 1.0, k: 4.0, d: 0.0, x: 1.0, v: 0.0 };
        o.step(8.0, 0.7);
        let (t, x) = (0.7f64, 2.0 - (1.4f64).cos());
        assert!((o.x - x).abs() < 1e-14 && (o.v - 2.0 * (2.0 * t).sin()).abs() < 1e-14, "{o:?}");
    }

    #[test]
    fn descriptions_can_be_written() {
        for model in crate::models() {
            assert!(model.xml().contains(model.name));
        }
    }
}
