//! The studies of the publication that is followed: `examples/straight-line`, `examples/obstacle`, `examples/turn`; each as published (`paper.ssd`) and
//! small (`system.ssd`).

use super::study::{Headline, Study, Touch};

const STRAIGHT: &[Headline] = &[
    ("distance", "vehicle", "chassis.position.x", [3.5, 3.6]),
    ("speed", "vehicle", "speed", [3.5, 3.6]),
    ("load of the front left wheel", "vehicle", "wheel[1].force.z", [3.0, 3.6]),
    ("load of the rear left wheel", "vehicle", "wheel[3].force.z", [3.0, 3.6]),
];

/// A study with flexible tires on penalty granular soil.
const SOIL: Study = Study {
    file: "",
    description: "",
    vehicle: ["vehicle", "vehicle.json"],
    tire: ["tire_ancf", "../tires/hmmwv-lumped-30x12.json"],
    touch: Touch::Mesh,
    terrain: ["terrain_dem_p", "terrain.json"],
    time: [2e-4, 3.0],
    every: 0.005,
    frames: 0.2,
    obstacle: false,
    summary: &[],
};

/// The studies.
pub fn studies() -> Vec<Study> {
    vec![
        Study {
            file: "examples/straight-line/system.ssd",
            description: "HMMWV on flexible tires, accelerating on cohesive granular soil; small",
            summary: STRAIGHT,
            ..SOIL
        },
        Study {
            file: "examples/obstacle/system.ssd",
            description: "HMMWV on flexible tires crossing a free cylinder with its left wheels on cohesive granular soil; small",
            obstacle: true,
            time: [2e-4, 2.0],
            ..SOIL
        },
        Study {
            file: "examples/turn/system.ssd",
            description: "HMMWV on flexible tires from a rigid platform onto cohesive granular soil and into a turn of 12 m; small",
            time: [2e-4, 2.6],
            ..SOIL
        },
    ]
}
