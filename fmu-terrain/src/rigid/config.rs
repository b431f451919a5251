//! The block `rigid` of the specification.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use terramech_fmi2::specification::Faults;

/// Rigid ground: a height field with friction.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Rigid {
    /// Height (m) of the plane at x = y = 0; a height map is added to it.
    pub height: f64,
    /// Coulomb friction (1), 0 to 10, where no map of friction says otherwise.
    pub friction: f64,
    /// Shape of the ground.
    pub shape: Shape,
    /// Friction by place: replaces `friction` within the map.
    pub friction_map: Option<Map>,
    /// Obstacles on the ground.
    pub obstacles: Vec<GroundObstacle>,
    /// How meshes and cylinders are pushed out of the ground; tires that use probes have their own contact.
    pub contact: Penalty,
}

impl Default for Rigid {
    fn default() -> Self {
        Self {
            height: 0.0,
            friction: 0.9,
            shape: Shape::default(),
            friction_map: None,
            obstacles: Vec::new(),
            contact: Penalty::default(),
        }
    }
}

/// Shape of the ground.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Shape {
    /// A plane.
    Plane {
        /// Slopes dz/dx and dz/dy (1), at most 2 each.
        #[serde(default)]
        slope: [f64; 2],
    },
    /// The facets of a Wavefront OBJ mesh: the highest one over a point counts. Where there is none, the level plane at `height`.
    Mesh {
        /// File, relative to the specification; coordinates in m, inertial frame.
        file: String,
        /// Normals are blended between the vertices of a facet, so that they are continuous across edges.
        #[serde(default)]
        smooth: bool,
    },
    /// Heights on a regular grid, bilinear between its nodes; outside, those of its edge.
    HeightMap(Map),
}

impl Default for Shape {
    fn default() -> Self {
        Self::Plane { slope: [0.0; 2] }
    }
}

/// Values on a regular grid, seen from above: columns along x, the first row at the greatest y.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Map {
    /// Grey PNG of 8 or 16 bits (`.png`), or CSV with a row of numbers per line (`.csv`); relative to the specification.
    pub file: String,
    /// Distance along x between the first and the last column (m), above 0.
    pub length: f64,
    /// Distance along y between the first and the last row (m), above 0.
    pub width: f64,
    /// Place of the middle, x and y (m).
    #[serde(default)]
    pub centre: [f64; 2],
    /// PNG: values of black and of white (m for heights, 1 for friction). A CSV file has the values themselves.
    #[serde(default)]
    pub range: Option<[f64; 2]>,
}

/// An obstacle on the ground.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum GroundObstacle {
    /// A half-round bar: half a circular cylinder lying on the ground.
    HalfRound {
        /// Middle of its axis, x and y (m).
        position: [f64; 2],
        /// Radius (m), above 0.
        radius: f64,
        /// Length along its axis (m), above 0.
        length: f64,
        /// Angle (rad) about Z of its axis from Y: 0 lies across the x direction.
        #[serde(default)]
        angle: f64,
    },
    /// A rounded bump `height/2 (1 + cos(2 pi s/length))` along its direction of travel, over its whole width.
    Bump {
        /// Middle, x and y (m).
        position: [f64; 2],
        /// Height (m), above 0.
        height: f64,
        /// Length in the direction of travel (m), above 0.
        length: f64,
        /// Width across (m), above 0.
        width: f64,
        /// Angle (rad) about Z of the direction of travel from X.
        #[serde(default)]
        angle: f64,
    },
}

/// Penalty contact of points that carry an area A: normal force `A k d (1 + d'/v)`, never below 0, with depth d; friction
/// by a tangential spring `A k s` with slip s since the touch, cut back at `mu` times the normal force.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Penalty {
    /// k: pressure per depth (Pa/m), above 0.
    pub stiffness: f64,
    /// v: speed of approach that doubles the force (m/s), above 0. Smaller: more damping.
    pub damping_speed: f64,
    /// Tangential over normal stiffness (1), 0 to 1.
    pub tangential: f64,
    /// Longest inner step (s), above 0.
    pub step: f64,
}

impl Default for Penalty {
    /// A vertex of the HMMWV tire's mesh (4.4 cm2) gets 4.4e4 N/m, half of a grain's contact stiffness.
    fn default() -> Self {
        Self { stiffness: 1e8, damping_speed: 2.0, tangential: 0.7, step: 2e-4 }
    }
}

impl Rigid {
    /// Collects faults.
    pub fn check(&self, f: &mut Faults) {
        f.check(self.height.is_finite(), "rigid.height", self.height, "a finite number");
        f.within("rigid.friction", self.friction, 0.0, 10.0);
        match &self.shape {
            Shape::Plane { slope } => {
                for (k, s) in slope.iter().enumerate() {
                    f.within(&format!("rigid.shape.plane.slope[{k}]"), *s, -2.0, 2.0);
                }
            }
            Shape::Mesh { file, .. } => {
                f.check(!file.is_empty(), "rigid.shape.mesh.file", "empty", "the name of an OBJ file");
            }
            Shape::HeightMap(m) => m.check("rigid.shape.height_map", f),
        }
        if let Some(m) = &self.friction_map {
            m.check("rigid.friction_map", f);
        }
        for (k, o) in self.obstacles.iter().enumerate() {
            o.check(&format!("rigid.obstacles[{k}]"), f);
        }
        self.contact.check("rigid.contact", f);
    }
}

impl Penalty {
    /// Collects faults of the block at `path`.
    pub fn check(&self, path: &str, f: &mut Faults) {
        f.positive(&format!("{path}.stiffness"), self.stiffness);
        f.positive(&format!("{path}.damping_speed"), self.damping_speed);
        f.within(&format!("{path}.tangential"), self.tangential, 0.0, 1.0);
        f.positive(&format!("{path}.step"), self.step);
    }
}

impl Map {
    fn check(&self, path: &str, f: &mut Faults) {
        let png = self.file.to_lowercase().ends_with(".png");
        let known = png || self.file.to_lowercase().ends_with(".csv");
        f.check(known, &format!("{path}.file"), format!("'{}'", self.file), "a file that ends in .png or .csv");
        f.positive(&format!("{path}.length"), self.length);
        f.positive(&format!("{path}.width"), self.width);
        f.check(
            self.centre.iter().all(|x| x.is_finite()),
            &format!("{path}.centre"),
            format!("{:?}", self.centre),
            "two finite numbers",
        );
        match self.range {
            Some([black, white]) => {
                f.check(
                    png && black.is_finite() && white.is_finite(),
                    &format!("{path}.range"),
                    format!("[{black}, {white}]"),
                    "two finite numbers, and only for a PNG (a CSV file has the values themselves)",
                );
            }
            None => {
                f.check(!png, &format!("{path}.range"), "missing", "the values of black and white: a PNG needs them");
            }
        }
    }
}

impl GroundObstacle {
    fn check(&self, path: &str, f: &mut Faults) {
        let (name, position, sizes, angle) = match self {
            Self::HalfRound { position, radius, length, angle } => {
                ("half_round", position, vec![("radius", radius), ("length", length)], angle)
            }
            Self::Bump { position, height, length, width, angle } => {
                ("bump", position, vec![("height", height), ("length", length), ("width", width)], angle)
            }
        };
        for (what, x) in sizes {
            f.positive(&format!("{path}.{name}.{what}"), *x);
        }
        f.check(
            position.iter().chain([angle]).all(|x| x.is_finite()),
            &format!("{path}.{name}.position, angle"),
            format!("{position:?}, {angle}"),
            "finite numbers",
        );
    }
}
