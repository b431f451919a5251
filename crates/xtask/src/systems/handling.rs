//! `examples/handling`: the HMMWV on rigid ground.

use super::study::{Headline, Study, Touch};

const HMMWV: &str = "vehicle";
const GROUND: &str = "terrain_rigid";

const ACCELERATION: &[Headline] = &[
    ("distance", "vehicle", "chassis.position.x", [15.9, 16.0]),
    ("top speed (at the end of full throttle)", "vehicle", "speed", [9.95, 10.0]),
    ("speed at the end", "vehicle", "speed", [15.9, 16.0]),
];
const CIRCLE: &[Headline] = &[
    ("speed", "vehicle", "speed", [10.0, 15.0]),
    ("lateral acceleration", "vehicle", "lateral_acceleration", [10.0, 15.0]),
    ("yaw rate", "vehicle", "yaw_rate", [10.0, 15.0]),
    ("roll angle", "vehicle", "roll", [10.0, 15.0]),
    ("steering input", "vehicle", "driver_used.steering", [10.0, 15.0]),
    ("load of the front left tire", "tire1", "load", [10.0, 15.0]),
    ("load of the front right tire", "tire2", "load", [10.0, 15.0]),
];
const LANE_CHANGE: &[Headline] = &[
    ("speed in the other lane", "vehicle", "speed", [4.4, 5.4]),
    ("lateral position in the other lane", "vehicle", "chassis.position.y", [4.9, 5.3]),
    ("lateral position at the end", "vehicle", "chassis.position.y", [11.9, 12.0]),
];
const HALF_ROUND: &[Headline] = &[
    ("speed before", "vehicle", "speed", [1.0, 1.5]),
    ("speed at the end", "vehicle", "speed", [7.9, 8.0]),
    ("pitch at the end", "vehicle", "pitch", [7.9, 8.0]),
];

/// The studies.
pub fn studies() -> Vec<Study> {
    let fiala = ["tire_fiala", ""];
    let flat = [GROUND, "ground.json"];
    vec![
        Study {
            file: "examples/handling/acceleration.ssd",
            description: "HMMWV on rigid ground: full throttle from rest, then full braking",
            vehicle: [HMMWV, "acceleration.json"],
            tire: fiala,
            touch: Touch::Probes(1),
            terrain: flat,
            time: [1e-3, 16.0],
            every: 0.01,
            seldom: 0.1,
            frames: 0.0,
            obstacle: false,
            summary: ACCELERATION,
        },
        Study {
            file: "examples/handling/constant-radius.ssd",
            description: "HMMWV on rigid ground: turn of 12 m radius at 7.5 m/s",
            vehicle: [HMMWV, "constant-radius.json"],
            tire: fiala,
            touch: Touch::Probes(1),
            terrain: flat,
            time: [1e-3, 15.0],
            every: 0.01,
            seldom: 0.1,
            frames: 0.0,
            obstacle: false,
            summary: CIRCLE,
        },
        Study {
            file: "examples/handling/lane-change.ssd",
            description: "HMMWV on rigid ground: double lane change (track of ISO 3888-1) at 15 m/s, Magic Formula tires",
            vehicle: [HMMWV, "lane-change.json"],
            tire: ["tire_pac02", "tire-pac02.json"],
            touch: Touch::Probes(1),
            terrain: flat,
            time: [1e-3, 12.0],
            every: 0.01,
            seldom: 0.1,
            frames: 0.0,
            obstacle: false,
            summary: LANE_CHANGE,
        },
        Study {
            file: "examples/handling/half-round.ssd",
            description: "HMMWV on rigid ground: a half-round bar of 0.15 m across both tracks at 4 m/s",
            vehicle: [HMMWV, "half-round.json"],
            tire: fiala,
            touch: Touch::Probes(41),
            terrain: [GROUND, "ground-half-round.json"],
            // At 4 m/s the tires' lateral spring has little damping (speed over relaxation length, 2/s); the delay of the coupling
            // at 1 ms takes more than that away.
            time: [5e-4, 8.0],
            every: 0.005,
            seldom: 0.1,
            frames: 0.0,
            obstacle: false,
            summary: HALF_ROUND,
        },
    ]
}
