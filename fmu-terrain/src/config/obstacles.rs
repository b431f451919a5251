//! Obstacles of a specification: rigid bodies that are free to move.

use super::Surface;
use crate::dem::{FreeBody, MassOf, Solid};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::Path;
use terramech_fmi2::UnitError;
use terramech_fmi2::specification::Faults;
use terramech_mechanics::{RigidState, obj, rotation};

/// Most obstacles.
pub const GREATEST_OBSTACLES: usize = 64;

/// A rigid body that is free to move: driven by what touches it, with the soil and with the bodies of other units.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Obstacle {
    /// What it looks like.
    pub shape: ObstacleShape,
    /// Mass (kg); exactly one of mass and density.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mass: Option<f64>,
    /// Density (kg/m3), over the volume of the shape.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub density: Option<f64>,
    /// Where its centre of mass is, x and y (m).
    pub position: [f64; 2],
    /// Height of its centre of mass (m); null: it lies on the highest grain below it.
    #[serde(default)]
    pub height: Option<f64>,
    /// Orientation as a quaternion w, x, y, z.
    #[serde(default = "upright")]
    pub orientation: [f64; 4],
    /// Whether it lies still until a body touches it or the soil pushes with more than a tenth of its weight.
    #[serde(default = "yes")]
    pub asleep: bool,
    /// Its surface.
    #[serde(default)]
    pub surface: Surface,
}

/// Shape of an obstacle.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum ObstacleShape {
    /// A sphere.
    Sphere {
        /// Radius (m).
        radius: f64,
    },
    /// A cylinder, axis along its y.
    Cylinder {
        /// Radius (m).
        radius: f64,
        /// Length (m).
        length: f64,
    },
    /// A box.
    Box {
        /// Edges along its x, y and z (m).
        edges: [f64; 3],
    },
    /// A closed mesh from a file; mass, centre and inertia by integration over the solid that it bounds.
    Obj {
        /// Path of a Wavefront OBJ file, relative to the specification.
        file: String,
        /// Factor on its lengths (1).
        #[serde(default = "one")]
        scale: f64,
    },
}

fn upright() -> [f64; 4] {
    [1.0, 0.0, 0.0, 0.0]
}
fn yes() -> bool {
    true
}
fn one() -> f64 {
    1.0
}

impl Obstacle {
    pub(super) fn check(&self, f: &mut Faults, k: usize) {
        let at = |name: &str| format!("obstacles[{k}].{name}");
        match (self.mass, self.density) {
            (Some(x), None) => f.positive(&at("mass"), x),
            (None, Some(x)) => f.positive(&at("density"), x),
            _ => f.add(format!("'{}' has {}; allowed: exactly one of mass and density", at(""), "both or neither")),
        }
        match &self.shape {
            ObstacleShape::Sphere { radius } => f.positive(&at("shape.sphere.radius"), *radius),
            ObstacleShape::Cylinder { radius, length } => {
                f.positive(&at("shape.cylinder.radius"), *radius);
                f.positive(&at("shape.cylinder.length"), *length);
            }
            ObstacleShape::Box { edges } => edges.iter().for_each(|x| f.positive(&at("shape.box.edges"), *x)),
            ObstacleShape::Obj { scale, .. } => f.positive(&at("shape.obj.scale"), *scale),
        }
        let finite = self.position.iter().all(|x| x.is_finite()) && self.height.is_none_or(f64::is_finite);
        f.check(finite, &at("position"), format!("{:?}, height {:?}", self.position, self.height), "finite numbers");
        let size = self.orientation.iter().map(|x| x * x).sum::<f64>().sqrt();
        f.check(
            (size - 1.0).abs() < 1e-6,
            &at("orientation"),
            format!("{:?}", self.orientation),
            "a unit quaternion w, x, y, z",
        );
        self.surface.check(f, &at("surface"));
    }

    /// Its shape, files read.
    ///
    /// # Errors
    /// A mesh that cannot be read, is open or faulty: named with the file.
    pub fn solid(&self, folder: Option<&Path>) -> Result<Solid, UnitError> {
        Ok(match &self.shape {
            ObstacleShape::Sphere { radius } => Solid::Sphere(*radius),
            ObstacleShape::Cylinder { radius, length } => Solid::Cylinder(*radius, *length),
            ObstacleShape::Box { edges } => Solid::Box(*edges),
            ObstacleShape::Obj { file, scale } => {
                let fault = |e: String| UnitError::input(format!("obstacle of {file}: {e}"));
                let path = folder.map_or_else(|| file.into(), |folder| folder.join(file));
                let text = std::fs::read_to_string(&path).map_err(|e| fault(format!("cannot be read: {e}")))?;
                let mut mesh = obj::read(&text).map_err(|e| fault(e.to_string()))?;
                mesh.vertices.iter_mut().flatten().for_each(|x| *x *= scale);
                Solid::mesh(mesh).map_err(|e| fault(e.to_string()))?
            }
        })
    }

    /// The body; `ground` gives the height of the highest grain in a rectangle (m), where it is to lie on it.
    ///
    /// # Errors
    /// Values that make no body.
    pub fn body(&self, solid: Solid, ground: impl Fn([f64; 2], [f64; 2]) -> f64) -> Result<FreeBody, UnitError> {
        let fault = |e: String| UnitError::input(format!("obstacle at {:?}: {e}", self.position));
        let mass = match (self.mass, self.density) {
            (Some(m), _) => MassOf::Mass(m),
            (None, d) => MassOf::Density(d.unwrap_or(f64::NAN)),
        };
        let orientation = rotation::from_wxyz(self.orientation).map_err(|e| fault(e.to_string()))?;
        let [x, y] = self.position;
        let at = |z: f64| RigidState { position: [x, y, z].into(), orientation, ..RigidState::default() };
        let make = |z: f64| FreeBody::new(solid.clone(), mass, at(z), self.asleep).map_err(|e| fault(e.to_string()));
        match self.height {
            Some(z) => make(z),
            None => {
                use crate::dem::Shape as _;
                let body = make(0.0)?;
                let [low, high] = body.bounds();
                make(ground([low[0], low[1]], [high[0], high[1]]) + body.depth())
            }
        }
    }
}
