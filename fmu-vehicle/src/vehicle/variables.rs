//! Variables of the unit `vehicle`: the one source of its `modelDescription.xml`.

use terramech_fmi2::variables::{CommonVars, StateVars, WrenchVars};
use terramech_fmi2::{IntegerVar, RealVar, StringVar, Table, Var};

/// Handles of one wheel.
#[derive(Clone, Debug)]
pub struct WheelVars {
    /// In: wrench about the wheel centre.
    pub wrench: WrenchVars,
    /// In: mass of the tire that moves with the wheel (kg).
    pub hub_mass: RealVar,
    /// In: its moments (kg m2).
    pub hub_inertia: [RealVar; 3],
    /// In: radius to place the vehicle with; 0: the specification's (m).
    pub tire_radius: RealVar,
    /// Out: state of the wheel centre.
    pub state: StateVars,
    /// Out: mass carried at rest (kg).
    pub load_mass: RealVar,
    /// Out: angular speed about the axle (rad/s).
    pub speed: RealVar,
    /// Out: torque of the axle shaft (N m).
    pub axle_torque: RealVar,
    /// Out: torque of the brake (N m).
    pub brake_torque: RealVar,
    /// Out: length (m) and tension (N) of the spring, of the shock.
    pub suspension: [RealVar; 4],
}

/// Handles of all variables.
#[derive(Clone, Debug)]
pub struct Variables {
    /// `specification`, `threads`.
    pub common: CommonVars,
    /// In: height of the settled ground (m).
    pub ground_height: RealVar,
    /// In: driver's inputs when the driver is external.
    pub driver: [RealVar; 3],
    /// Parameters `start.{x, y, heading, speed}`.
    pub start: [RealVar; 4],
    /// Parameter `hold.duration`.
    pub hold: RealVar,
    /// Parameter `slope`.
    pub slope: RealVar,
    /// The wheels.
    pub wheels: Vec<WheelVars>,
    /// Out: chassis reference frame.
    pub chassis: StateVars,
    /// Out: acceleration and angular acceleration.
    pub acceleration: [[RealVar; 3]; 2],
    /// Out: inputs used.
    pub used: [RealVar; 3],
    /// Out: forward speed (m/s), lateral acceleration in the chassis (m/s2), yaw rate (rad/s), roll and pitch (rad).
    pub handling: [RealVar; 5],
    /// Out: engine speed, torque, converter input torque, gearbox output torque.
    pub engine: [RealVar; 4],
    /// Out: work of the engine and of the wheels' forces, kinetic, potential and dissipated energy.
    pub energies: [RealVar; 5],
    /// Out: gear.
    pub gear: IntegerVar,
    /// Out: mass of the vehicle with payload and hubs (kg).
    pub mass: RealVar,
    /// Of `vehicle_handling`: parameter `tires`, and per wheel the tire's force along, across and normal (N).
    pub handling_tires: Option<(StringVar, Vec<[RealVar; 3]>)>,
}

/// Steepest slope (rad), either way: 45 degrees.
const STEEPEST: f64 = std::f64::consts::FRAC_PI_4;

/// Declares the table of a vehicle of so many wheels; `with_tires` adds the variables of tires inside.
pub fn declare(wheel_count: usize, with_tires: bool) -> (Table, Variables) {
    let mut t = Table::new();
    let common = t.common_parameters();
    let ground_height = t.input_real(
        "ground_height",
        0.0,
        "m",
        "Height of the settled ground: places the vehicle; taken at initialisation only",
    );
    let driver = [
        ("steering", "Steering, -1 full right to 1 full left (driver external)", -1.0),
        ("throttle", "Throttle, 0 to 1 (driver external)", 0.0),
        ("braking", "Braking, 0 to 1 (driver external)", 0.0),
    ]
    .map(|(name, text, least)| {
        let v = t.input_real(&format!("driver.{name}"), 0.0, "1", text);
        t.range(v, Some(least), Some(1.0));
        v
    });
    let start = [
        ("x", "m", "X of the chassis's reference point at the start"),
        ("y", "m", "Y of the chassis's reference point at the start"),
        ("heading", "rad", "Heading about Z at the start"),
        ("speed", "m/s", "Forward speed at the start, wheels rolling"),
    ]
    .map(|(name, unit, text)| {
        t.parameter_real(&format!("start.{name}"), 0.0, unit, &format!("{text}; overrides the specification when set"))
    });
    let hold = t.parameter_real(
        "hold.duration",
        0.0,
        "s",
        "Longest time with brakes locked and chassis damped at the start; overrides the specification when set",
    );
    t.range(hold, Some(0.0), None);
    let slope = t.parameter_real(
        "slope",
        0.0,
        "rad",
        "Angle of the slope, uphill along X: gravity is turned about Y, X and Z stay along and normal to the slope",
    );
    t.range(slope, Some(-STEEPEST), Some(STEEPEST));
    let mut inputs = Vec::new();
    for i in 1..=wheel_count {
        let w = format!("wheel[{i}]");
        let wrench = t.wrench(&w, false, "the wheel from the tire, about the wheel centre");
        let hub_mass =
            t.parameter_real(&format!("{w}.hub_mass"), 0.0, "kg", "Mass of the tire that moves with the wheel");
        let hub_inertia = ["xx", "yy", "zz"].map(|axis| {
            let text = format!("Moment of inertia {axis} of what of the tire moves with the wheel");
            t.parameter_real(&format!("{w}.hub_inertia.{axis}"), 0.0, "kg.m2", &text)
        });
        let tire_radius = t.parameter_real(
            &format!("{w}.tire_radius"),
            0.0,
            "m",
            "Undeformed radius of the tire, by which the vehicle is placed; 0: the specification's",
        );
        for v in [hub_mass, tire_radius].into_iter().chain(hub_inertia) {
            t.range(v, Some(0.0), None);
        }
        inputs.push((wrench, hub_mass, hub_inertia, tire_radius));
    }
    let mut knowns: Vec<u32> = vec![common.specification.vr()];
    knowns.extend(inputs.iter().flat_map(|i| [i.1, i.3].into_iter().chain(i.2)).map(|v| v.vr()));
    let loads = knowns.clone();
    knowns.push(ground_height.vr());
    knowns.extend(start.iter().map(|v| v.vr()));
    let wheels: Vec<WheelVars> = inputs
        .into_iter()
        .enumerate()
        .map(|(k, (wrench, hub_mass, hub_inertia, tire_radius))| {
            let w = format!("wheel[{}]", k + 1);
            let state = t.state(&w, true, "the wheel centre");
            let load_mass = t.output_real(
                &format!("{w}.load_mass"),
                "kg",
                "Vehicle mass carried by this wheel at rest on level ground, wheel and hub included",
            );
            let mut out = |name: &str, unit, text: &str| t.output_real(&format!("{w}.{name}"), unit, text);
            let speed = out("spin", "rad/s", "Angular speed of the wheel about its axle relative to the upright");
            let axle_torque =
                out("axle_torque", "N.m", "Torque of the axle shaft on the wheel; positive drives forward");
            let brake_torque = out("brake_torque", "N.m", "Torque of the brake on the wheel");
            let suspension = [
                out("spring.length", "m", "Length of the spring"),
                out("spring.force", "N", "Tension of the spring with its stops; compression is negative"),
                out("shock.length", "m", "Length of the shock absorber"),
                out("shock.force", "N", "Tension of the shock absorber"),
            ];
            t.depends_initially(load_mass, &loads);
            for v in [&state.position[..], &state.orientation, &state.velocity, &state.angular_velocity].concat() {
                t.depends_initially(v, &knowns);
            }
            for v in [speed].into_iter().chain(suspension) {
                t.depends_initially(v, &knowns);
            }
            WheelVars {
                wrench,
                hub_mass,
                hub_inertia,
                tire_radius,
                state,
                load_mass,
                speed,
                axle_torque,
                brake_torque,
                suspension,
            }
        })
        .collect();
    let chassis = t.state("chassis", true, "the chassis's reference frame");
    for v in [&chassis.position[..], &chassis.orientation, &chassis.velocity, &chassis.angular_velocity].concat() {
        t.depends_initially(v, &knowns);
    }
    let acceleration = [
        ("chassis.acceleration", "m/s2", "Acceleration of the chassis's centre of mass, in the inertial frame"),
        ("chassis.angular_acceleration", "rad/s2", "Angular acceleration of the chassis, in the inertial frame"),
    ]
    .map(|(name, unit, text)| t.xyz(name, |t, n| t.output_real(n, unit, text)));
    let used = [("steering", "Steering used"), ("throttle", "Throttle used"), ("braking", "Braking used")]
        .map(|(name, text)| t.output_real(&format!("driver_used.{name}"), "1", text));
    let handling = [
        ("speed", "m/s", "Forward speed of the chassis's reference point"),
        ("lateral_acceleration", "m/s2", "Acceleration of the chassis's centre of mass to its left, level"),
        ("yaw_rate", "rad/s", "Angular velocity of the chassis about Z"),
        ("roll", "rad", "Roll angle of the chassis, positive to the right"),
        ("pitch", "rad", "Pitch angle of the chassis, positive nose down"),
    ]
    .map(|(name, unit, text)| t.output_real(name, unit, text));
    for v in handling {
        t.depends_initially(v, &knowns);
    }
    let engine = [
        ("engine.speed", "rad/s", "Speed of the engine"),
        ("engine.torque", "N.m", "Torque of the engine, losses included"),
        ("engine.converter_torque", "N.m", "Torque into the torque converter"),
        ("engine.gearbox_torque", "N.m", "Torque at the gearbox's output, without inertia"),
    ]
    .map(|(name, unit, text)| t.output_real(name, unit, text));
    let energies = [
        ("engine_work", "Work of the engine since initialization, losses included"),
        ("wheel_work", "Work of the forces on the wheels since initialization"),
        ("kinetic_energy", "Kinetic energy of bodies and shafts"),
        ("potential_energy", "Energy in gravity and springs, less that at initialization"),
        ("dissipated_energy", "Energy turned into heat since initialization: shock absorbers, torque converter, brakes, changes of gear, drag"),
    ]
    .map(|(name, text)| t.output_real(name, "J", text));
    t.depends_initially(energies[2], &knowns);
    let gear = t.output_integer("gear", "Gear: -1 reverse, 0 neutral, 1 and up forward");
    let mass = t.output_real("mass", "kg", "Mass of the vehicle with payload, wheels and hubs");
    t.depends_initially(mass, &loads);
    let handling_tires = with_tires.then(|| {
        let tires = t.parameter_string("tires", "internal", "internal: tires inside, on a rigid plane; external: none");
        let forces = (1..=wheel_count)
            .map(|i| {
                [
                    ("longitudinal", "along the heading"),
                    ("lateral", "to the left"),
                    ("normal", "along the ground's normal"),
                ]
                .map(|(name, text)| {
                    t.output_real(
                        &format!("tire[{i}].{name}_force"),
                        "N",
                        &format!("Force of the ground on the tire {text}"),
                    )
                })
            })
            .collect();
        (tires, forces)
    });
    let vars = Variables {
        handling_tires,
        common,
        ground_height,
        driver,
        start,
        hold,
        slope,
        wheels,
        chassis,
        acceleration,
        used,
        handling,
        engine,
        energies,
        gear,
        mass,
    };
    (t, vars)
}
