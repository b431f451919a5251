//! Looking at contacts from outside: for energies, stresses, contact networks. Nothing here runs in a step.

use super::contact::{Load, Slip, Touch};
use super::engine::Setup;
use super::grains::{MATERIAL, Row};
use super::kernel::{Observer, Partner, World};
use super::law::{LawKind, terms_of};
use super::vec3::{Vec3, add_scaled, dot, scale};

/// A contact as an observer sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Touched {
    /// Unit normal, towards the grain.
    pub normal: Vec3,
    /// Overlap (m).
    pub overlap: f64,
    /// Force on the grain (N).
    pub force: Vec3,
    /// Energy stored (J): normal and tangential spring, less what adhesion has given. Springs of rolling resistance,
    /// which hold little, are left out.
    pub energy: f64,
}

pub(super) struct Show<'a> {
    pub world: &'a World<'a>,
    pub rows: &'a [Row],
    pub setup: &'a Setup,
    pub to: &'a mut dyn FnMut(usize, Partner, &Touched),
}

impl Observer for Show<'_> {
    fn contact(&mut self, i: usize, partner: Partner, touch: &Touch, load: &Load, slip: &Slip) {
        let w = self.world;
        let material = |i: usize| self.rows[i][MATERIAL] as usize;
        let other = match partner {
            Partner::Grain(j) => material(j),
            Partner::Wall(k) => w.walls[k].material,
            Partner::Body(b) => w.bodies[b].material,
        };
        let pair = w.pairs.get(material(i), other);
        let s = self.setup;
        let vn = dot(touch.v, touch.n);
        let t = terms_of(s.law, s.form, pair, touch.delta, touch.r_eff, 1.0 / touch.inv_m, vn);
        // Stiffness grows with the root of the overlap in all laws but the linear one.
        let share = if s.law == LawKind::Hooke { 0.5 } else { 0.4 };
        let repulsive = (t.kn * touch.delta - t.gn * vn).max(w.options.least_normal);
        let adhesion = repulsive - load.normal;
        let u2 = slip[0] * slip[0] + slip[1] * slip[1] + slip[2] * slip[2];
        let energy = share * t.kn * touch.delta * touch.delta + 0.5 * t.kt * u2 - adhesion * touch.delta;
        let force = scale(touch.weight, add_scaled(load.tangential, load.normal, touch.n));
        let energy = touch.weight * energy;
        (self.to)(i, partner, &Touched { normal: touch.n, overlap: touch.delta, force, energy });
    }
}
