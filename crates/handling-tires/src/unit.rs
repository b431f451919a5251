//! The units `tire_fiala` and `tire_pac02`: wheel state and ground probe in, wheel wrench out.
//!
//! The whole mass of the tire is handed over as `hub.mass`; what is sent are contact forces alone. Between communication points the
//! wheel moves on by its velocities; the wrench is the mean over the step. The ground is asked at the point under the wheel centre
//! (`probe.position`), or at `probe_count` points along the heading ([`crate::envelope`]); without a connected probe it is the plane at
//! `ground_height` with the parameter `friction`. Under explicit coupling, where all outputs are read before any input is set, an answer is for the
//! point that was asked one communication step earlier; the unit remembers it and moves on from there along the tangent plane.

use crate::envelope::{self, Sample};
use crate::{Contact, Probe, Tire, Transient, fiala::Fiala, pac02::Pac02};
use serde::{Deserialize, Serialize};
use terramech_fmi2::specification::{self, Faults};
use terramech_fmi2::variables::{CommonVars, StateVars, WrenchVars};
use terramech_fmi2::{
    Host, IntegerVar, Model, RealArrayVar, RealVar, Stage, Step, Table, Unit, UnitError, Values, Var, state,
};
use terramech_mechanics::{RigidState, Vec3};

/// Longest inner step (s).
const INNER: f64 = 1e-3;

/// Specification of `tire_fiala`: the parameters themselves.
pub type FialaSpec = Fiala;

/// Specification of `tire_pac02`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Pac02Spec {
    /// Name of a `.tir` file, relative to the specification; neither this nor `tir`: the HMMWV's tire.
    #[serde(default)]
    pub file: Option<String>,
    /// Text of a `.tir` file.
    #[serde(default)]
    pub tir: Option<String>,
    /// Mass (kg), above 0.
    pub mass: f64,
    /// Moments of inertia (kg m2).
    pub inertia: [f64; 3],
    /// Width (m), above 0.
    pub width: f64,
}

impl Default for Pac02Spec {
    fn default() -> Self {
        Self { file: None, tir: None, mass: 37.6, inertia: [3.84, 6.69, 3.84], width: 0.3175 }
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    Fiala,
    Pac02,
}

#[derive(Clone, Debug)]
struct Vars {
    common: CommonVars,
    wheel: StateVars,
    wrench: WrenchVars,
    ground_height: RealVar,
    friction: RealVar,
    side: RealVar,
    count: IntegerVar,
    position: RealArrayVar,
    probe: [RealArrayVar; 3],
    hub: [RealVar; 4],
    size: [RealVar; 2],
    outputs: [RealVar; 5],
}

fn declare() -> (Table, Vars) {
    let mut t = Table::new();
    let common = t.common_parameters();
    let wheel = t.state("wheel", false, "the wheel centre");
    let ground_height = t.input_real("ground_height", 0.0, "m", "Height of the plane, where no probe is connected");
    let friction = t.parameter_real("friction", 0.8, "1", "Friction of the plane, where no probe is connected");
    t.range(friction, Some(0.0), Some(2.0));
    let side = t.parameter_real("side", 1.0, "1", "1 for a left wheel, -1 for a right one: conicity is mirrored");
    t.range(side, Some(-1.0), Some(1.0));
    let count = t.parameter_integer(
        "probe_count",
        1,
        "Points of the ground that are asked for: 1 under the wheel centre, which is exact on a plane; 3 to 401 along the heading \
         over the tire's diameter, from which an equivalent plane follows (obstacles: 41)",
    );
    t.range(count, Some(1.0), Some(401.0));
    let probe = [
        t.input_real_array("probe.height", "m", "Height of the ground at probe.position"),
        t.input_real_array("probe.normal", "1", "Unit normal of the ground there"),
        t.input_real_array("probe.friction", "1", "Coefficient of friction there"),
    ];
    let position =
        t.output_real_array("probe.position", "m", "Points at which the ground is asked, x0, y0, z0, x1, ...");
    let mut asked = wheel.all();
    asked.extend([common.specification.vr(), count.vr()]);
    t.depends_initially(position, &asked);
    let wrench = t.wrench("wheel", true, "the wheel from the ground, about the wheel centre");
    let hub = [
        t.calculated_real("hub.mass", "kg", "Mass of the tire, to be integrated with the wheel"),
        t.calculated_real("hub.inertia.xx", "kg.m2", "Its moment of inertia about x"),
        t.calculated_real("hub.inertia.yy", "kg.m2", "Its moment of inertia about the axle"),
        t.calculated_real("hub.inertia.zz", "kg.m2", "Its moment of inertia about z"),
    ];
    let size = [t.calculated_real("radius", "m", "Undeformed radius"), t.calculated_real("width", "m", "Width")];
    for v in hub.into_iter().chain(size) {
        t.depends_initially(v, &[common.specification.vr()]);
    }
    let outputs = [
        ("deflection", "m", "Deflection of the tire"),
        ("load", "N", "Force along the ground's normal"),
        ("slip.kappa", "1", "Transient longitudinal slip"),
        ("slip.tan_alpha", "1", "Tangent of the transient slip angle"),
        ("camber", "rad", "Inclination against the ground, top to the right positive"),
    ]
    .map(|(name, unit, text)| t.output_real(name, unit, text));
    (t, Vars { common, wheel, wrench, ground_height, friction, side, count, position, probe, hub, size, outputs })
}

struct HandlingTire {
    kind: Kind,
    vars: Vars,
    /// Resolved specification as text, and what follows from it.
    spec: Option<(String, Tire, [f64; 4], f64)>,
    transient: Transient,
    /// The points that the answers of the next step are for: those asked one communication step before the last (all outputs are
    /// read before any input is set).
    asked: Vec<f64>,
}

impl HandlingTire {
    fn read(&self, text: &str, origin: &str) -> Result<(Tire, [f64; 4], f64), UnitError> {
        let mut f = Faults::new();
        let hub = |mass: f64, i: [f64; 3]| [mass, i[0], i[1], i[2]];
        let out = match self.kind {
            Kind::Fiala => {
                let p: Fiala = specification::parse(text, origin)?;
                p.faults().into_iter().for_each(|(name, x, allowed)| f.check(false, name, x, allowed));
                (Tire::Fiala(p.clone()), hub(p.mass, p.inertia), p.width)
            }
            Kind::Pac02 => {
                let s: Pac02Spec = specification::parse(text, origin)?;
                f.positive("mass", s.mass);
                f.positive("width", s.width);
                let p = match &s.tir {
                    Some(text) => Pac02::parse(text).map_err(|e| UnitError::input(format!("{origin}: 'tir': {e}")))?,
                    None => Pac02::hmmwv(),
                };
                (Tire::Pac02(Box::new(p)), hub(s.mass, s.inertia), s.width)
            }
        };
        f.into_result(origin)?;
        Ok(out)
    }

    fn wheel(&self, v: &Values) -> Result<RigidState, UnitError> {
        let w = &self.vars.wheel;
        let [p, u, o] = [v.get(w.position), v.get(w.velocity), v.get(w.angular_velocity)];
        let q = v.get(w.orientation);
        RigidState::from_array(&[p[0], p[1], p[2], q[0], q[1], q[2], q[3], u[0], u[1], u[2], o[0], o[1], o[2]])
            .map_err(|e| UnitError::input(format!("wheel.{e}")))
    }

    /// What the probes answered; `None`: none is connected.
    fn samples(&self, v: &Values) -> Result<Option<Vec<Sample>>, UnitError> {
        let [h, n, m] = self.vars.probe.map(|a| v.reals(a));
        let asked = &self.asked;
        let count = asked.len() / 3;
        let sizes = (h.len(), n.len(), m.len());
        if sizes == (0, 0, 0) {
            return Ok(None);
        }
        if sizes != (count, 3 * count, count) {
            return Err(UnitError::input(format!(
                "'probe.height', 'probe.normal', 'probe.friction' have {sizes:?} elements; allowed: ({count}, {}, {count}) as \
                 probe.position asks, or none of them",
                3 * count
            )));
        }
        let mut out = Vec::with_capacity(count);
        for k in 0..count {
            let normal = Vec3::new(n[3 * k], n[3 * k + 1], n[3 * k + 2]);
            if !((normal.norm() - 1.0).abs() < 1e-3 && normal.z > 0.1) {
                return Err(UnitError::input(format!(
                    "'probe.normal' of point {k} is {:?}; allowed: a unit vector that points up",
                    normal.as_slice()
                )));
            }
            out.push(Sample { position: Vec3::new(asked[3 * k], asked[3 * k + 1], h[k]), normal, friction: m[k] });
        }
        Ok(Some(out))
    }

    /// The plane under the wheel now; `None`: it is in the air.
    fn plane(&self, v: &Values, samples: Option<&[Sample]>, wheel: &RigidState, radius: f64) -> Option<Probe> {
        match samples {
            None => Some(Probe::level(v[self.vars.ground_height], v[self.vars.friction])),
            Some([one]) => Some(envelope::tangent(wheel, one)),
            Some(many) => envelope::equivalent(wheel, radius, many),
        }
    }

    fn ask(&self, v: &mut Values, wheel: &RigidState, radius: f64) {
        let points = envelope::points(wheel, radius, v[self.vars.count].max(1) as usize);
        let to = v.reals_mut(self.vars.position);
        to.clear();
        to.extend(points.iter().flat_map(|p| [p.x, p.y, p.z]));
    }

    fn publish(&mut self, v: &mut Values) -> Result<(), UnitError> {
        if let Some((_, tire, hub, width)) = &self.spec {
            v.put(self.vars.hub, *hub);
            v.put(self.vars.size, [tire.radius(), *width]);
            let (wheel, radius) = (self.wheel(v)?, tire.radius());
            self.ask(v, &wheel, radius);
            self.asked = v.reals(self.vars.position).to_vec();
        }
        Ok(())
    }
}

impl Unit for HandlingTire {
    fn enter_initialization(&mut self, v: &mut Values, host: &Host) -> Result<(), UnitError> {
        let default = default_specification(self.kind);
        let read = specification::load::<serde_json::Value>(v.string(self.vars.common.specification), &default, host)?;
        let mut text = read.text;
        if self.kind == Kind::Pac02 {
            // The state holds the file's content, never its name.
            let mut s: Pac02Spec = specification::parse(&text, &read.origin)?;
            if let Some(name) = s.file.take() {
                let path = read.folder.unwrap_or_default().join(&name);
                let tir = std::fs::read_to_string(&path).map_err(|e| {
                    UnitError::input(format!("{}: 'file' {}: cannot be read: {e}", read.origin, path.display()))
                })?;
                s.tir = Some(tir);
                text = serde_json::to_string(&s).map_err(|e| UnitError::input(e.to_string()))?;
            }
        }
        let (tire, hub, width) = self.read(&text, &read.origin)?;
        self.spec = Some((text, tire, hub, width));
        v.lock([self.vars.common.specification.vr()], "it was read when initialization mode began");
        Ok(())
    }

    fn refresh(&mut self, v: &mut Values, _: &Host, _: u32, stage: Stage) -> Result<(), UnitError> {
        if stage == Stage::Initialization { self.publish(v) } else { Ok(()) }
    }

    fn exit_initialization(&mut self, v: &mut Values, _: &Host) -> Result<(), UnitError> {
        self.publish(v)
    }

    fn step(&mut self, v: &mut Values, _: &Host, step: Step) -> Result<(), UnitError> {
        let Some((_, tire, ..)) = &self.spec else {
            return Err(UnitError::input("the tire has not been initialised"));
        };
        let (mut wheel, samples) = (self.wheel(v)?, self.samples(v)?);
        let side = if v[self.vars.side] < 0.0 { -1.0 } else { 1.0 };
        let n = (step.size / INNER - 1e-9).ceil().max(1.0);
        let h = step.size / n;
        let (mut force, mut moment) = (Vec3::zeros(), Vec3::zeros());
        let mut shown = [0.0; 5];
        let mut transient = self.transient;
        for _ in 0..n as usize {
            wheel = wheel.advanced(h);
            let contact = self
                .plane(v, samples.as_deref(), &wheel, tire.radius())
                .and_then(|ground| Contact::new(&wheel, &ground, tire.radius()));
            transient = transient.advanced(tire, contact.as_ref(), h);
            shown = [0.0, 0.0, transient.kappa, transient.tan_alpha, 0.0];
            if let Some(c) = &contact {
                let f = tire.forces(c, &transient, side);
                let w = c.wrench(&f);
                force += w.force / n;
                moment += w.moment / n;
                (shown[0], shown[1], shown[4]) = (c.depth, f.force.z, c.camber);
            }
        }
        if !(force.iter().chain(&moment).all(|x| x.is_finite())) {
            return Err(UnitError::numerical(format!("the tire's force at t = {} s is not finite", step.time)));
        }
        self.transient = transient;
        v.put(self.vars.wrench.force, force.into());
        v.put(self.vars.wrench.moment, moment.into());
        v.put(self.vars.outputs, shown);
        let radius = tire.radius();
        self.asked = v.reals(self.vars.position).to_vec();
        self.ask(v, &wheel, radius);
        Ok(())
    }

    fn save(&mut self) -> Result<Vec<u8>, UnitError> {
        state::to_bytes(&(self.spec.as_ref().map(|s| s.0.clone()), self.transient, &self.asked))
    }

    fn restore(&mut self, _: &mut Values, bytes: &[u8]) -> Result<(), UnitError> {
        let (text, transient, asked): (Option<String>, Transient, Vec<f64>) = state::from_bytes(bytes)?;
        (self.transient, self.asked) = (transient, asked);
        self.spec = match text {
            Some(text) => {
                let (tire, hub, width) = self.read(&text, "saved specification")?;
                Some((text, tire, hub, width))
            }
            None => None,
        };
        Ok(())
    }
}

fn default_specification(kind: Kind) -> String {
    match kind {
        Kind::Fiala => include_str!("../data/hmmwv_fiala.json").into(),
        Kind::Pac02 => serde_json::to_string_pretty(&Pac02Spec::default()).expect("plain data serialises"),
    }
}

fn model(kind: Kind, name: &'static str, description: &'static str, schema: serde_json::Value) -> Model {
    let (table, vars) = declare();
    let mut m = Model::new(name, description, table, move || {
        Box::new(HandlingTire {
            kind,
            vars: vars.clone(),
            spec: None,
            transient: Transient::default(),
            asked: Vec::new(),
        })
    });
    m.weight = 0.1;
    m.default_specification = default_specification(kind);
    m.schema = schema;
    m.documentation = "A tire model for handling on firm ground. Wheel state in, wheel wrench out; the ground is asked at probe.position (probe_count points), or is a \
                       plane at ground_height where no probe is connected. Mass and inertia are handed over as hub.mass and hub.inertia."
        .into();
    m
}

/// The models `tire_fiala` and `tire_pac02`, for the library that carries the tires.
pub fn models() -> Vec<Model> {
    vec![
        model(
            Kind::Fiala,
            "tire_fiala",
            "Fiala tire on any ground with probes",
            schemars::schema_for!(Fiala).to_value(),
        ),
        model(
            Kind::Pac02,
            "tire_pac02",
            "Magic Formula tire (Pacejka 2002) on any ground with probes",
            schemars::schema_for!(Pac02Spec).to_value(),
        ),
    ]
}
