//! The studies of the publication that is followed: `examples/straight-line`, `examples/obstacle`, `examples/turn`; each small (`system.ssd`) and as
//! published (`paper.ssd`).

use super::study::{Headline, Study, Touch};

const STRAIGHT: &[Headline] = &[
    ("distance", "vehicle", "chassis.position.x", [2.4, 2.5]),
    ("speed", "vehicle", "speed", [2.4, 2.5]),
    ("load of the front left wheel", "vehicle", "wheel[1].force.z", [0.35, 0.5]),
    ("load of the rear left wheel", "vehicle", "wheel[3].force.z", [0.35, 0.5]),
];
const OBSTACLE: &[Headline] = &[
    ("speed before", "vehicle", "speed", [0.1, 0.15]),
    ("speed on the obstacle", "vehicle", "speed", [0.65, 0.75]),
    ("speed behind", "vehicle", "speed", [1.1, 1.2]),
];
const TURN: &[Headline] = &[
    ("speed", "vehicle", "speed", [1.8, 2.0]),
    ("lateral acceleration", "vehicle", "lateral_acceleration", [1.8, 2.0]),
    ("steering input", "vehicle", "driver_used.steering", [1.8, 2.0]),
];
const STRAIGHT_PAPER: &[Headline] = &[
    ("distance", "vehicle", "chassis.position.x", [5.9, 6.0]),
    ("speed", "vehicle", "speed", [5.9, 6.0]),
    ("net force of the front left tire before 3.4 s", "vehicle", "wheel[1].force.x", [3.0, 3.4]),
    ("net force of the rear left tire before 3.4 s", "vehicle", "wheel[3].force.x", [3.0, 3.4]),
    ("net force of the front left tire after 3.45 s", "vehicle", "wheel[1].force.x", [3.45, 3.9]),
    ("net force of the rear left tire after 3.45 s", "vehicle", "wheel[3].force.x", [3.45, 3.9]),
];
const OBSTACLE_PAPER: &[Headline] =
    &[("distance", "vehicle", "chassis.position.x", [7.49, 7.595]), ("speed", "vehicle", "speed", [7.49, 7.595])];
const TURN_PAPER: &[Headline] = &[
    ("speed", "vehicle", "speed", [8.0, 10.0]),
    ("lateral acceleration", "vehicle", "lateral_acceleration", [8.0, 10.0]),
    ("steering input", "vehicle", "driver_used.steering", [8.0, 10.0]),
];

/// Small: coarse flexible tires on coarse penalty granular soil.
const SMALL: Study = Study {
    file: "",
    description: "",
    vehicle: ["vehicle", "vehicle.json"],
    tire: ["tire_ancf", "../tires/tire-ancf-lumped-30x12.json"],
    touch: Touch::Mesh,
    terrain: ["terrain_dem_p", "terrain.json"],
    time: [2e-4, 2.5],
    every: 0.005,
    seldom: 0.1,
    frames: 0.25,
    obstacle: false,
    summary: &[],
};

/// As published: the layered tire, fine soil, small steps.
const PAPER: Study = Study {
    vehicle: ["vehicle", "vehicle-paper.json"],
    tire: ["tire_ancf", "../tires/tire-ancf-layered-90x24.json"],
    terrain: ["terrain_dem_p", "terrain-paper.json"],
    time: [4e-5, 6.0],
    frames: 0.1,
    ..SMALL
};

/// The studies.
pub fn studies() -> Vec<Study> {
    vec![
        Study {
            file: "examples/straight-line/system.ssd",
            description: "HMMWV on flexible tires, accelerating on cohesive granular soil; small",
            summary: STRAIGHT,
            ..SMALL
        },
        Study {
            file: "examples/obstacle/system.ssd",
            description: "HMMWV on flexible tires crossing a free cylinder with its left wheels on cohesive granular soil; small",
            obstacle: true,
            time: [2e-4, 1.2],
            summary: OBSTACLE,
            ..SMALL
        },
        Study {
            file: "examples/turn/system.ssd",
            description: "HMMWV on flexible tires from a rigid platform onto cohesive granular soil and into a turn of 12 m; small",
            time: [2e-4, 2.0],
            summary: TURN,
            ..SMALL
        },
        Study {
            file: "examples/straight-line/paper.ssd",
            description: "HMMWV on flexible tires, accelerating on 500,000 cohesive grains",
            summary: STRAIGHT_PAPER,
            ..PAPER
        },
        Study {
            file: "examples/obstacle/paper.ssd",
            description: "HMMWV on flexible tires crossing a free cylinder of 1,200 kg on 923,000 cohesive grains",
            obstacle: true,
            // Whole multiples of the step as published.
            time: [3.5e-5, 7.595],
            every: 0.0049,
            seldom: 0.098,
            frames: 0.098,
            summary: OBSTACLE_PAPER,
            ..PAPER
        },
        Study {
            file: "examples/turn/paper.ssd",
            description: "HMMWV on flexible tires from a rigid platform onto cohesive granular soil and into a turn of 12 m at 7.5 m/s",
            time: [4e-5, 10.0],
            summary: TURN_PAPER,
            ..PAPER
        },
    ]
}
