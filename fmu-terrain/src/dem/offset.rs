//! Cohesion let into a settled bed without a grain moving: overlaps that count from an offset.
//!
//! A contact that has come to rest with the overlap delta and the force F(delta), and is to be held by an adhesion A from now on, would
//! close until its spring carries F(delta) + A: the bed contracts, by 1 to 2 mm for each contact of 12 mm grains under 100 kPa. With an
//! offset o the overlap counts as delta + o, F(delta + o) - A(delta + o) = F(delta), and nothing moves; the contact
//! still tears at a pull of A, at the distance o apart, and its Coulomb limit is mu F(delta + o), which is what cohesion is for.
//! Displacements of the tangential and of the rolling spring are scaled as these springs grow stiffer, so that they keep their
//! forces as well.
//!
//! Offsets live in the fourth entry of a contact's memory as -o/(sum of the radii), end with the contact, and are not made for contacts
//! that come later. Lists reach further by the longest of them.

use super::contact::{Roll, Slip};
use super::engine::CpuEngine;
use super::error::DemError;
use super::grains::{INV_M, MATERIAL, R};
use super::law::terms_of;
use super::material::Pair;
use super::period::rows_of;
use super::vec3::{norm, sub};
use std::f64::consts::PI;

/// What the overlap of a contact counts from (m); `reach`: sum of the radii (m), of a wall the radius.
#[inline(always)]
pub fn offset(slip: &Slip, reach: f64) -> f64 {
    (-slip[3]).max(0.0) * reach
}

/// Greatest offset, over the lesser radius.
const MOST: f64 = 0.5;

/// A contact at rest.
struct AtRest {
    delta: f64,
    reach: f64,
    r_eff: f64,
    least_radius: f64,
    m_eff: f64,
}

impl CpuEngine {
    /// See [`super::GrainEngine::offset_overlaps`].
    pub(super) fn offset_all(&mut self) -> Result<(), DemError> {
        let per_overlap = self.options().adhesion_per_overlap;
        let (law, form, period) = (self.setup.law, self.setup.form, self.setup.period);
        let mut longest = 0.0_f64;
        let mut slabs = std::mem::take(&mut self.state.slabs);
        let mut set = |pair: &Pair, at: &AtRest, slip: &mut Slip, roll: Option<&mut Roll>| {
            let a = &pair.adhesion;
            let full = a.constant
                + a.dmt * at.r_eff.sqrt()
                + a.perko * at.r_eff
                + PI * at.least_radius * at.least_radius * a.pressure;
            let terms = |x: f64| terms_of(law, form, pair, x, at.r_eff, at.m_eff, 0.0);
            let now = terms(at.delta);
            let missing = |x: f64| terms(x).kn * x - full * (x * per_overlap).min(1.0) - now.kn * at.delta;
            let (mut low, mut high) = (at.delta, at.delta + MOST * at.least_radius);
            if missing(high) < 0.0 {
                let allowed = format!(
                    "one that presses grains together by less than half their radius: {full:.3e} N on radius {:.3e} m take a stiffer soil",
                    at.least_radius
                );
                return Err(DemError::parameter("adhesion", format!("{full:.3e} N"), allowed));
            }
            for _ in 0..60 {
                let middle = 0.5 * (low + high);
                if missing(middle) < 0.0 { low = middle } else { high = middle }
            }
            let then = terms(high);
            // What does not adhere keeps its memory as it is.
            if full > 0.0 {
                slip[3] = (at.delta - high) / at.reach;
            }
            let share = if then.kt > 0.0 { now.kt / then.kt } else { 1.0 };
            slip[..3].iter_mut().for_each(|u| *u *= share);
            if let Some(roll) = roll {
                *roll = roll.map(|x| x * now.kn / then.kn);
            }
            longest = longest.max(high - at.delta);
            Ok(())
        };
        let mut result = Ok(());
        'all: for slab in &mut slabs {
            let rows = &rows_of(&self.state.rows, slab, period, &[])[..];
            let first = slab.first as usize;
            for p in 0..slab.other.len() {
                let (a, b) = (&rows[slab.owner[p] as usize - first], &rows[slab.other[p] as usize - first]);
                let reach = a[R] + b[R];
                let delta = reach - norm(sub([a[0], a[1], a[2]], [b[0], b[1], b[2]]));
                let inv_m = a[INV_M] + b[INV_M];
                if delta > 0.0 && inv_m > 0.0 {
                    let (r_eff, least_radius) = (a[R] * b[R] / reach, a[R].min(b[R]));
                    let at = AtRest { delta, reach, r_eff, least_radius, m_eff: 1.0 / inv_m };
                    let pair = self.pairs.get(a[MATERIAL] as usize, b[MATERIAL] as usize);
                    result = set(pair, &at, &mut slab.slip[p], slab.roll.get_mut(p));
                    if result.is_err() {
                        break 'all;
                    }
                }
            }
            for w in &mut slab.walls {
                let (row, wall) = (&rows[w.grain as usize - first], &self.walls[w.wall as usize]);
                let delta = row[R] - wall.distance(row);
                if delta > 0.0 && row[INV_M] > 0.0 {
                    let at =
                        AtRest { delta, reach: row[R], r_eff: row[R], least_radius: row[R], m_eff: 1.0 / row[INV_M] };
                    let pair = self.pairs.get(row[MATERIAL] as usize, wall.material);
                    result = set(pair, &at, &mut w.slip, Some(&mut w.roll));
                    if result.is_err() {
                        break 'all;
                    }
                }
            }
        }
        self.state.slabs = slabs;
        result?;
        self.state.longest_offset = longest;
        // Lists must reach further from now on, those of slabs where nothing has moved, too.
        self.state.wake();
        self.rebuild("the bed was so when cohesion was let in", None)
    }
}
