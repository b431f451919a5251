//! Variables of the rig: the one source of its `modelDescription.xml`.

use super::config::{Base, Mode, RigSpecification};
use terramech_fmi2::variables::{CommonVars, StateVars, WrenchVars};
use terramech_fmi2::{IntegerVar, RealVar, StringVar, Table, Var};

/// A real of the specification that is an FMI parameter too: path, unit, description, least and greatest value, place.
type Override =
    (&'static str, &'static str, &'static str, Option<f64>, Option<f64>, fn(&mut RigSpecification) -> &mut f64);

/// All of them. A parameter that the environment sets (or that differs from its start value) overrides the JSON element of
/// the same path.
#[rustfmt::skip]
pub const OVERRIDES: [Override; 20] = [
    ("drive.slip", "1", "Slip to impose, (omega R - v)/max(|omega R|, |v|)", Some(-1.0), Some(1.0), |s| &mut s.drive.slip),
    ("drive.speed", "m/s", "Carriage speed after the ramp (imposed_slip from linear_speed)", Some(0.0), None, |s| &mut s.drive.speed),
    ("drive.angular_speed", "rad/s", "Angular speed of the wheel after the ramp (imposed_slip from angular_speed, imposed_angular_speed)", Some(0.0), None, |s| &mut s.drive.angular_speed),
    ("drive.delay", "s", "Time at rest between touchdown and ramp", Some(0.0), None, |s| &mut s.drive.delay),
    ("drive.ramp", "s", "Duration of the ramp of the speeds", Some(0.0), None, |s| &mut s.drive.ramp),
    ("drive.resistance.delay", "s", "Time from the end of the ramp until the resistance grows", Some(0.0), None, |s| &mut s.drive.resistance.delay),
    ("drive.resistance.rate", "N/s", "Growth of the resistance (imposed_angular_speed)", Some(0.0), None, |s| &mut s.drive.resistance.rate),
    ("toe.angle", "rad", "Slip angle: heading of the wheel about Z against the direction of travel, positive to the left", None, None, |s| &mut s.toe.angle),
    ("toe.delay", "s", "Time from the end of the touchdown until the heading turns", Some(0.0), None, |s| &mut s.toe.delay),
    ("toe.ramp", "s", "Duration of the turn of the heading", Some(0.0), None, |s| &mut s.toe.ramp),
    ("load.mass", "kg", "Mass that slides vertically with the wheel, without hub mass", Some(0.0), None, |s| &mut s.load.mass),
    ("load.force", "N", "Static vertical load on the soil, all weights included; 0: the weight of load.mass and hub mass", Some(0.0), None, |s| &mut s.load.force),
    ("slide.gap", "m", "Gap between settled soil and wheel at the start", Some(0.0), None, |s| &mut s.slide.gap),
    ("slide.lowering_speed", "m/s", "Greatest vertical speed during touchdown", Some(0.0), None, |s| &mut s.slide.lowering_speed),
    ("slide.damping_rate", "1/s", "Damping of the slide after touchdown, per mass that slides", Some(0.0), None, |s| &mut s.slide.damping_rate),
    ("carriage.x", "m", "Where the wheel centre starts along the rails", None, None, |s| &mut s.carriage.x),
    ("carriage.y", "m", "Where the rails are", None, None, |s| &mut s.carriage.y),
    ("carriage.mass", "kg", "Mass of the carriage (imposed_angular_speed)", Some(0.0), None, |s| &mut s.carriage.mass),
    ("spin_inertia", "kg.m2", "Moment of inertia about the axle besides the tire's hub inertia", Some(0.0), None, |s| &mut s.spin_inertia),
    ("filter_window", "s", "Window of the running averages of filtered outputs", Some(0.0), None, |s| &mut s.filter_window),
];

/// Number of outputs that come raw and filtered.
pub const MEASURED: usize = 7;

/// Handles of all variables.
#[derive(Clone, Debug)]
pub struct Variables {
    /// `specification`, `threads`.
    pub common: CommonVars,
    /// In: what acts on the wheel, about its centre.
    pub wheel_wrench: WrenchVars,
    /// In: height of the settled ground (m).
    pub ground_height: RealVar,
    /// Undeformed radius (m).
    pub tire_radius: RealVar,
    /// Outer radius; 0 for the undeformed one (m).
    pub outer_radius: RealVar,
    /// Mass handed over by the tire (kg).
    pub hub_mass: RealVar,
    /// Its moments xx, yy, zz (kg m2).
    pub hub_inertia: [RealVar; 3],
    /// `drive.mode`.
    pub mode: StringVar,
    /// `drive.base`.
    pub base: StringVar,
    /// Parameters of [`OVERRIDES`], in its order.
    pub overrides: Vec<RealVar>,
    /// Out: state of the wheel.
    pub wheel_state: StateVars,
    /// Out: mass carried at rest (kg).
    pub load_mass: RealVar,
    /// Out, raw: drawbar pull, wheel force x, y, z, wheel torque, slip, sinkage.
    pub measured: [RealVar; MEASURED],
    /// Out: their running averages.
    pub filtered: [RealVar; MEASURED],
    /// Out: carriage along X (m).
    pub carrier_position: RealVar,
    /// Out: its speed (m/s).
    pub carrier_velocity: RealVar,
    /// Out: angular speed about the axle (rad/s).
    pub wheel_speed: RealVar,
    /// Out: heading now (rad).
    pub slip_angle: RealVar,
    /// Out: resistance at the carriage (N).
    pub resistance: RealVar,
    /// Out: phase of the run.
    pub phase: IntegerVar,
}

/// Declares the table.
pub fn declare() -> (Table, Variables) {
    let mut t = Table::new();
    let mut start = RigSpecification::default();
    let common = t.common_parameters();
    let wheel_wrench = t.wrench("wheel[1]", false, "the wheel from the tire, about the wheel centre");
    let ground_height = t.input_real(
        "ground_height",
        0.0,
        "m",
        "Height of the settled ground: places the wheel, and is what sinkage refers to; taken at initialisation only",
    );
    let tire_radius = t.parameter_real("wheel[1].tire_radius", 0.058, "m", "Undeformed radius: of slip and sinkage");
    let outer_radius = t.parameter_real(
        "wheel[1].outer_radius",
        0.0,
        "m",
        "Greatest radius with grousers, by which the wheel is placed above the ground; 0: the undeformed radius",
    );
    let hub_mass = t.parameter_real("wheel[1].hub_mass", 0.0, "kg", "Mass of the tire that moves with the wheel");
    let hub_inertia = ["xx", "yy", "zz"].map(|axis| {
        let text = match axis {
            "yy" => "Moment of inertia about the axle of what of the tire moves with the wheel",
            _ => "Moment of inertia of what of the tire moves with the wheel (taken for the connection; the heading is imposed)",
        };
        t.parameter_real(&format!("wheel[1].hub_inertia.{axis}"), 0.0, "kg.m2", text)
    });
    for v in [tire_radius, outer_radius, hub_mass].into_iter().chain(hub_inertia) {
        t.range(v, Some(0.0), None);
    }
    let (mode, base) = (word(&start.drive.mode), word(&start.drive.base));
    let mode = t.parameter_string("drive.mode", &mode, "What is imposed: imposed_slip or imposed_angular_speed");
    let base = t.parameter_string("drive.base", &base, "Given speed of imposed_slip: linear_speed or angular_speed");
    let overrides: Vec<RealVar> = OVERRIDES
        .iter()
        .map(|(path, unit, text, min, max, place)| {
            let v = t.parameter_real(path, *place(&mut start), unit, text);
            t.range(v, *min, *max);
            v
        })
        .collect();
    let wheel_state = t.state("wheel[1]", true, "the wheel centre");
    let load_mass = t.output_real(
        "wheel[1].load_mass",
        "kg",
        "Mass carried by the wheel at rest: load.force over gravity, or else load.mass",
    );
    let quantities: [(&str, &'static str, &str); MEASURED] = [
        (
            "drawbar_pull",
            "N",
            "Force of wheel and slide on the carriage along X: the soil's less their inertia; positive pulls forward",
        ),
        ("wheel_force.x", "N", "Force on the wheel along its heading"),
        ("wheel_force.y", "N", "Force on the wheel to the left of its heading"),
        ("wheel_force.z", "N", "Force on the wheel upward"),
        ("wheel_torque", "N.m", "Torque of the drive on the wheel about its axle; positive drives forward"),
        ("slip", "1", "Slip (omega R - v)/max(|omega R|, |v|), v the carriage's speed"),
        ("sinkage", "m", "Settled height less the lowest point of the undeformed wheel; negative in the air"),
    ];
    let measured = quantities.map(|(name, unit, text)| t.output_real(name, unit, text));
    let filtered = quantities.map(|(name, unit, _)| {
        // A name is either a leaf or a node: `drawbar_pull.filtered` beside `drawbar_pull` would be both.
        let filtered = match name.split_once('.') {
            Some((stem, axis)) => format!("{stem}_filtered.{axis}"),
            None => format!("{name}_filtered"),
        };
        t.output_real(&filtered, unit, &format!("Running average of {name} over filter_window"))
    });
    let carrier_position = t.output_real("carrier.position", "m", "Wheel centre along X");
    let carrier_velocity = t.output_real("carrier.velocity", "m/s", "Carriage speed along X");
    let wheel_speed = t.output_real("wheel_speed", "rad/s", "Angular speed of the wheel about its axle");
    let slip_angle = t.output_real("slip_angle", "rad", "Heading of the wheel about Z now");
    let resistance = t.output_real("resistance", "N", "Resistance at the carriage (imposed_angular_speed)");
    let phase =
        t.output_integer("phase", "1 lowering, 2 releasing, 3 delay, 4 ramp, 5 drive, 6 stopped by the resistance");

    // The placed wheel depends on the ground, on its radii and on the specification with its overrides, on no wrench.
    let mut knowns: Vec<u32> = overrides.iter().map(|v| v.vr()).collect();
    knowns.extend([common.specification.vr(), mode.vr(), base.vr()]);
    let loads = overrides.iter().zip(&OVERRIDES).filter(|(_, o)| o.0.starts_with("load.")).map(|(v, _)| v.vr());
    t.depends_initially(load_mass, &loads.chain([common.specification.vr()]).collect::<Vec<_>>());
    knowns.extend([ground_height.vr(), tire_radius.vr(), outer_radius.vr()]);
    let placed = [measured[5], measured[6], filtered[5], filtered[6], carrier_position, carrier_velocity, wheel_speed];
    let state =
        [&wheel_state.position[..], &wheel_state.orientation, &wheel_state.velocity, &wheel_state.angular_velocity];
    for v in state.concat().into_iter().chain(placed).chain([slip_angle]) {
        t.depends_initially(v, &knowns);
    }
    let vars = Variables {
        common,
        wheel_wrench,
        ground_height,
        tire_radius,
        outer_radius,
        hub_mass,
        hub_inertia,
        mode,
        base,
        overrides,
        wheel_state,
        load_mass,
        measured,
        filtered,
        carrier_position,
        carrier_velocity,
        wheel_speed,
        slip_angle,
        resistance,
        phase,
    };
    (t, vars)
}

/// The word of a keyword of the specification.
fn word(value: &impl serde::Serialize) -> String {
    serde_json::to_value(value).ok().and_then(|v| v.as_str().map(str::to_string)).unwrap_or_default()
}

/// Reads the keyword of `drive.mode`.
///
/// # Errors
/// What is allowed.
pub fn read_mode(text: &str) -> Result<Mode, &'static str> {
    keyword(text).ok_or("imposed_slip or imposed_angular_speed")
}

/// Reads the keyword of `drive.base`.
///
/// # Errors
/// What is allowed.
pub fn read_base(text: &str) -> Result<Base, &'static str> {
    keyword(text).ok_or("linear_speed or angular_speed")
}

fn keyword<T: serde::de::DeserializeOwned>(text: &str) -> Option<T> {
    serde_json::from_value(serde_json::Value::String(text.into())).ok()
}
