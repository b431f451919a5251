//! What the platform before the box does to bodies: rigid ground beside the grains' engine, its impulses added to theirs.

use super::bodies::Slot;
use crate::config::Terrain;
use crate::dem::Body;
use crate::dem::vec3::{add, add_scaled};
use crate::rigid::ground::GroundPoint;
use crate::rigid::press::{of_body, press};
use crate::variables::BodyVars;
use serde::{Deserialize, Serialize};
use terramech_fmi2::{UnitError, Values};
use terramech_mechanics::Vec3;

/// What is kept between steps.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Run {
    /// Tangential displacement of each point of each body since its touch (m).
    slip: Vec<Vec<[f64; 3]>>,
    /// Work of the bodies so far, and what the springs hold now (J).
    work: f64,
    elastic: Vec<f64>,
}

impl Run {
    /// For so many bodies.
    pub fn new(bodies: usize) -> Self {
        Self { slip: vec![Vec::new(); bodies], work: 0.0, elastic: vec![0.0; bodies] }
    }

    /// Work of the bodies on the platform (J).
    pub fn work(&self) -> f64 {
        self.work
    }

    /// Heat made on the platform (J).
    pub fn heat(&self) -> f64 {
        self.work - self.elastic.iter().sum::<f64>()
    }

    /// Adds to body `k` the impulses of the platform, `top` m high, over a step of `size` s. `friction` is the body's.
    ///
    /// # Errors
    /// Inputs that do not make a body.
    pub fn press(
        &mut self,
        spec: &Terrain,
        top: f64,
        (v, vars): (&mut Values, &BodyVars),
        (slot, k, friction): (&mut Slot, usize, f64),
        body: &mut Body,
        size: f64,
    ) -> Result<(), UnitError> {
        let Some(platform) = &spec.bed.platform else { return Ok(()) };
        let edge = -0.5 * spec.bed.length;
        let [low, _] = body.shape.bounds();
        if low[0] > edge || low[2] > top + 0.1 {
            self.slip[k].clear();
            self.elastic[k] = 0.0;
            return Ok(());
        }
        let Some(points) = of_body(v, vars, slot, k)? else { return Ok(()) };
        let ground = |x: f64, y: f64| {
            platform.carries(&spec.bed, x, y).then_some(GroundPoint {
                height: top,
                normal: Vec3::z(),
                friction: platform.friction,
            })
        };
        let count = (size / platform.contact.step - 1e-9).ceil().max(1.0);
        let sum = press(&points, &ground, &platform.contact, friction, &mut self.slip[k], [size / count, count]);
        for (impulse, f) in body.vertex_impulse.iter_mut().zip(&sum.vertex) {
            *impulse = add_scaled(*impulse, size, (*f).into());
        }
        body.impulse = add_scaled(body.impulse, size, sum.force.into());
        body.angular_impulse = add_scaled(body.angular_impulse, size, sum.moment.into());
        body.force = add(body.force, sum.force.into());
        body.moment = add(body.moment, sum.moment.into());
        self.work += sum.work + sum.pressed_in;
        self.elastic[k] = sum.elastic;
        Ok(())
    }
}
