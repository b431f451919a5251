//! What suspension templates build with: one side of an axle, and the elements that every template has.

use super::elements::{MassSpec, ShockSpec, SpringSpec, StopsSpec};
use super::{AxleContext, Corner};
use crate::mbs::{BodyId, DamperLaw, Model, SpringDamper, SpringLaw};
use terramech_fmi2::specification::Faults;
use terramech_mechanics::{Quat, Vec3};

/// Names of the sides, and 1 for the left, -1 for the right.
const SIDES: [(&str, f64); 2] = [("left", 1.0), ("right", -1.0)];

/// What every template has besides its bodies and points.
pub(crate) struct Elements<'a> {
    /// Main spring.
    pub spring: &'a SpringSpec,
    /// Its stops.
    pub stops: Option<&'a StopsSpec>,
    /// Shock absorber.
    pub shock: &'a ShockSpec,
    /// Inertia of the axle shaft (kg m2).
    pub axle_inertia: f64,
}

/// The elements of a template: all have the same fields.
macro_rules! elements {
    ($template:expr) => {
        $crate::suspension::side::Elements {
            spring: &$template.spring,
            stops: $template.stops.as_ref(),
            shock: &$template.shock,
            axle_inertia: $template.axle_inertia,
        }
    };
}
pub(crate) use elements;

impl Elements<'_> {
    /// Collects faults of the elements and of the bodies.
    pub fn check(&self, path: &str, bodies: &[(&str, &MassSpec)], f: &mut Faults) {
        for (name, body) in bodies {
            body.check(&format!("{path}.{name}"), f);
        }
        f.positive(&format!("{path}.axle_inertia"), self.axle_inertia);
        self.spring.check(&format!("{path}.spring"), f);
        if let Some(s) = self.stops {
            s.check(&format!("{path}.stops"), f);
        }
        self.shock.check(&format!("{path}.shock"), f);
    }
}

/// One side of an axle while it is built. Points are those of the left side from the suspension's origin; the right is its
/// mirror image.
pub(crate) struct Side<'m, 'c> {
    model: &'m mut Model,
    context: &'c AxleContext,
    name: &'static str,
    /// 1 for the left, -1 for the right.
    pub sign: f64,
}

/// Builds both sides, the left first.
pub(crate) fn sides(model: &mut Model, c: &AxleContext, mut build: impl FnMut(&mut Side) -> Corner) -> [Corner; 2] {
    SIDES.map(|(name, sign)| build(&mut Side { model: &mut *model, context: c, name, sign }))
}

impl Side<'_, '_> {
    /// Name of a part in messages.
    fn name(&self, part: &str) -> String {
        format!("{} {} {part}", self.context.name, self.name)
    }
    /// A point in the inertial frame.
    pub fn at(&self, p: [f64; 3]) -> Vec3 {
        self.context.origin + Vec3::new(p[0], self.sign * p[1], p[2])
    }
    /// A body with axes of the chassis.
    pub fn body(&mut self, part: &str, mass: &MassSpec, com: [f64; 3]) -> BodyId {
        self.turned(part, mass, com, Quat::identity())
    }
    /// A body with axes of its own.
    pub fn turned(&mut self, part: &str, mass: &MassSpec, com: [f64; 3], axes: Quat) -> BodyId {
        let (name, p) = (self.name(part), self.at(com));
        mass.add(self.model, &name, p, axes)
    }
    /// A body that turns against `base` about the line through two points.
    pub fn hinge(&mut self, part: &str, base: BodyId, body: BodyId, front: [f64; 3], back: [f64; 3]) {
        let (name, f, b) = (self.name(part), self.at(front), self.at(back));
        self.model.revolute(&name, base, body, &((f + b) / 2.0), &(f - b));
    }
    /// A hinge on the chassis.
    pub fn chassis_hinge(&mut self, part: &str, body: BodyId, front: [f64; 3], back: [f64; 3]) {
        self.hinge(part, self.context.chassis, body, front, back);
    }
    /// A ball joint.
    pub fn ball(&mut self, part: &str, a: BodyId, b: BodyId, point: [f64; 3]) {
        let (name, p) = (self.name(part), self.at(point));
        self.model.spherical(&name, a, b, &p);
    }
    /// A ball joint on the chassis.
    pub fn chassis_ball(&mut self, part: &str, body: BodyId, point: [f64; 3]) {
        self.ball(part, self.context.chassis, body, point);
    }
    /// A slide along the line through two points.
    pub fn slide(&mut self, part: &str, a: BodyId, b: BodyId, at: [f64; 3], to: [f64; 3]) {
        let (name, p, q) = (self.name(part), self.at(at), self.at(to));
        self.model.prismatic(&name, a, b, &p, &(q - p));
    }
    /// A massless rod from the chassis.
    pub fn rod(&mut self, part: &str, body: BodyId, inner: [f64; 3], outer: [f64; 3]) {
        let (name, p, q) = (self.name(part), self.at(inner), self.at(outer));
        self.model.distance(&name, self.context.chassis, body, &p, &q);
    }
    /// A massless rod from what steers, or from the chassis where nothing does.
    pub fn tie_rod(&mut self, part: &str, body: BodyId, inner: [f64; 3], outer: [f64; 3]) {
        let (name, p, q) = (self.name(part), self.at(inner), self.at(outer));
        self.model.distance(&name, self.context.tie_rod, body, &p, &q);
    }
    /// Ends the side: a spindle in `upright`, spring and shock between the chassis and `carrier`.
    pub fn corner(
        &mut self,
        (mass, center, axes): (&MassSpec, [f64; 3], Quat),
        (upright, carrier): (BodyId, BodyId),
        e: &Elements,
        spring: [[f64; 3]; 2],
        shock: [[f64; 3]; 2],
    ) -> Corner {
        let spindle = self.turned("spindle", mass, center, axes);
        let (bearing, center) = (self.name("wheel bearing"), self.at(center));
        self.model.revolute(&bearing, upright, spindle, &center, &(axes * Vec3::y()));
        let spring = self.element("spring", carrier, spring, e.spring.law(), DamperLaw::None, e.stops);
        let shock = self.element("shock", carrier, shock, SpringLaw::None, e.shock.law(), None);
        Corner { spindle, upright, center, axle_inertia: e.axle_inertia, spring, shock }
    }
    /// A force element between chassis and `body`; its index.
    fn element(
        &mut self,
        part: &str,
        body: BodyId,
        [a, b]: [[f64; 3]; 2],
        spring: SpringLaw,
        damper: DamperLaw,
        stops: Option<&StopsSpec>,
    ) -> usize {
        let element = SpringDamper {
            name: self.name(&format!("suspension {part}")),
            a: self.context.chassis,
            b: body,
            p_ap: Vec3::zeros(),
            p_bp: Vec3::zeros(),
            spring,
            damper,
            stops: stops.map(StopsSpec::law),
        };
        let (a, b) = (self.at(a), self.at(b));
        self.model.spring(&a, &b, element)
    }
}
