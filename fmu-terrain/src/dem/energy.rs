//! Energies and a look at all contacts: nothing here runs in a step.

use super::body::Body;
use super::contact::Options;
use super::diagnostics::{Show, Touched};
use super::engine::CpuEngine;
use super::grains::{INV_M, MATERIAL, R, Row};
use super::kernel::{Partner, World, contacts};
use super::law::{Law, LawKind, dispatch_law};
use super::offset::offset;
use super::period::rows_of;
use super::slab::{Near, Scratch, Slab};
use super::vec3::{dot, sub};
use super::{contact::Slip, material::Pair};
use std::f64::consts::PI;

impl CpuEngine {
    fn still(&self) -> Options {
        Options { h: 0.0, adhesion_growth: 0.0, ..self.options() }
    }

    pub(super) fn show_contacts(&self, bodies: &[Body], observer: &mut dyn FnMut(usize, Partner, &Touched)) {
        // No batch kernel: it shows its contacts to nobody.
        let (rows, walls) = (&self.state.rows, &self.walls[..]);
        let world = World { pairs: &self.pairs, walls, bodies, batch: None, options: self.still() };
        let mut show = Show { world: &world, rows, setup: &self.setup, to: observer };
        for slab in &self.state.slabs {
            let rows = &rows_of(rows, slab, self.setup.period, self.ghosts())[..];
            let (mut slab, mut scratch) = (slab.clone(), Scratch::default());
            dispatch_law!(self.setup.law, self.setup.form, law => {
                if self.rolling {
                    contacts::<_, true>(law, &world, rows, &mut slab, &mut Near::default(), &mut scratch, &mut show);
                } else {
                    contacts::<_, false>(law, &world, rows, &mut slab, &mut Near::default(), &mut scratch, &mut show);
                }
            });
        }
    }

    /// Copies of grains behind the last slab.
    pub(super) fn ghosts(&self) -> &[Row] {
        self.spread.as_ref().map_or(&[], |s| &s.ghosts)
    }

    /// Kinetic, potential (in gravity) and elastic energy (J). Slab by slab on all threads, summed in their order; of a team all members call it, and all get the
    /// energy of the whole, not a number where the team is broken.
    pub fn energy(&self, bodies: &[Body]) -> f64 {
        let g = self.setup.gravity;
        let options = self.still();
        let share = if self.setup.law == LawKind::Hooke { 0.5 } else { 0.4 };
        let of_slab = |slab: &Slab| {
            let all = &rows_of(&self.state.rows, slab, self.setup.period, self.ghosts())[..];
            let own = &all[..slab.grains().len()];
            let free = || own.iter().filter(|r| r[INV_M] > 0.0);
            let kinetic: f64 = free().map(super::grains::kinetic_energy).sum();
            let potential: f64 = free().map(|r| -(g[0] * r[0] + g[1] * r[1] + g[2] * r[2]) / r[INV_M]).sum();
            let elastic = dispatch_law!(self.setup.law, self.setup.form, law => {
                let store = Store { law, options: &options, share };
                self.elastic(&store, slab, all)
            });
            kinetic + potential + elastic
        };
        let parts = self.team.enter(|| self.team.map(&self.state.slabs, |_, slab| of_slab(slab)));
        let of_bodies = self.elastic_of_bodies(bodies);
        let Some(spread) = &self.spread else { return parts.iter().sum::<f64>() + of_bodies.iter().sum::<f64>() };
        match spread.all_parts([parts, of_bodies]) {
            Ok([parts, of_bodies]) => parts.iter().sum::<f64>() + of_bodies.iter().sum::<f64>(),
            Err(_) => f64::NAN,
        }
    }

    fn elastic<L: Law>(&self, store: &Store<L>, slab: &Slab, rows: &[Row]) -> f64 {
        let first = slab.first as usize;
        let mut sum = 0.0;
        for (p, (&i, &j)) in slab.owner.iter().zip(&slab.other).enumerate() {
            let (a, b) = (&rows[i as usize - first], &rows[j as usize - first]);
            let d = sub([a[0], a[1], a[2]], [b[0], b[1], b[2]]);
            let (d2, reach) = (dot(d, d), a[R] + b[R]);
            let held = reach + offset(&slab.slip[p], reach);
            if d2 < held * held {
                let dist = d2.sqrt();
                let dv = sub([a[4], a[5], a[6]], [b[4], b[5], b[6]]);
                let (vn, m_eff) = (dot(dv, d) / dist, 1.0 / (a[INV_M] + b[INV_M]));
                let pair = self.pairs.get(a[MATERIAL] as usize, b[MATERIAL] as usize);
                let radii = [a[R] * b[R] / reach, a[R].min(b[R])];
                sum += store.energy(pair, held - dist, radii, m_eff, vn, &slab.slip[p]);
            }
        }
        for w in &slab.walls {
            let (row, wall) = (&rows[w.grain as usize - first], &self.walls[w.wall as usize]);
            let delta = row[R] + offset(&w.slip, row[R]) - wall.distance(row);
            if delta > 0.0 && row[INV_M] > 0.0 {
                let pair = self.pairs.get(row[MATERIAL] as usize, wall.material);
                let vn = dot([row[4], row[5], row[6]], wall.normal);
                sum += store.energy(pair, delta, [row[R]; 2], 1.0 / row[INV_M], vn, &w.slip);
            }
        }
        sum
    }

    /// Few contacts with much geometry: as the kernels see them.
    fn elastic_of_bodies(&self, bodies: &[Body]) -> Vec<f64> {
        if bodies.is_empty() {
            return Vec::new();
        }
        let mut all = Vec::new();
        let walls = &self.walls[..];
        let world = World { pairs: &self.pairs, walls, bodies, batch: None, options: self.still() };
        let mut add = |_: usize, partner: Partner, c: &Touched| {
            if matches!(partner, Partner::Body(_)) {
                all.push(c.energy);
            }
        };
        let mut show = Show { world: &world, rows: &self.state.rows, setup: &self.setup, to: &mut add };
        for slab in &self.state.slabs {
            let touched = bodies.iter().any(|b| super::kernel::may_touch(&b.shape.bounds(), slab));
            if !touched {
                continue;
            }
            let rows = &rows_of(&self.state.rows, slab, self.setup.period, self.ghosts())[..];
            let mut part = Slab {
                first: slab.first,
                last: slab.last,
                halo: slab.halo,
                extent: slab.extent,
                bodies: slab.bodies.clone(),
                ..Slab::default()
            };
            part.start = vec![0; slab.grains().len() + 1];
            dispatch_law!(self.setup.law, self.setup.form, law => {
                if self.rolling {
                    contacts::<_, true>(law, &world, rows, &mut part, &mut Near::default(), &mut Scratch::default(), &mut show);
                } else {
                    contacts::<_, false>(law, &world, rows, &mut part, &mut Near::default(), &mut Scratch::default(), &mut show);
                }
            });
        }
        all
    }

    /// Energy turned into heat since the account was opened (J): work of the bodies less the change of kinetic,
    /// potential and elastic energy. It holds the integrator's own error too, and 0 before an account is open.
    pub fn dissipated(&self, bodies: &[Body]) -> f64 {
        match self.state.energy_account {
            Some([energy, work]) => (self.state.body_work - work) - (self.energy(bodies) - energy),
            None => 0.0,
        }
    }
}

/// What a contact stores.
struct Store<'a, L> {
    law: L,
    options: &'a Options,
    /// Energy over k_n delta^2: stiffness grows with the root of the overlap in all laws but the linear one.
    share: f64,
}

impl<L: Law> Store<'_, L> {
    /// Normal and tangential spring, less what adhesion has given (J). `radii`: R* and that of the cohesive pressure.
    #[inline(always)]
    fn energy(&self, pair: &Pair, delta: f64, radii: [f64; 2], m_eff: f64, vn: f64, slip: &Slip) -> f64 {
        let o = self.options;
        let t = self.law.terms(pair, delta, radii[0], m_eff, vn);
        let adhesion = if o.adhesion {
            let grown = if slip[3] < 0.0 { 1.0 } else { slip[3].min(1.0) };
            let grown = grown * (delta * o.adhesion_per_overlap).min(1.0);
            let a = &pair.adhesion;
            let full =
                a.constant + a.dmt * radii[0].sqrt() + a.perko * radii[0] + PI * radii[1] * radii[1] * a.pressure;
            o.adhesion_scale * grown * full
        } else {
            0.0
        };
        let u2 = slip[0] * slip[0] + slip[1] * slip[1] + slip[2] * slip[2];
        self.share * t.kn * delta * delta + 0.5 * t.kt * u2 - adhesion * delta
    }
}
