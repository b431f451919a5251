//! What crosses a cut in a step.

use super::{Spread, pack, unpack};
use crate::dem::body::BodyLoad;
use crate::dem::error::DemError;
use crate::dem::grains::Row;
use crate::dem::obstacle::{FreeBody, FreeState};
use crate::dem::vec3::Vec3;
use terramech_simd::Force;

/// What changes of a grain from step to step: position, velocity, angular velocity.
const MOVING: [usize; 9] = [0, 1, 2, 4, 5, 6, 8, 9, 10];
/// Entries of a force that are used: force, moment.
const ACTING: [usize; 6] = [0, 1, 2, 4, 5, 6];

fn put(bytes: &mut Vec<u8>, x: f64) {
    bytes.extend_from_slice(&x.to_le_bytes());
}

fn reals(bytes: &[u8]) -> impl Iterator<Item = f64> + '_ {
    bytes.as_chunks().0.iter().map(|b| f64::from_le_bytes(*b))
}

fn broken() -> DemError {
    DemError::Team("a message of another length than expected: the members have lost step".into())
}

impl Spread {
    /// Tells the member before where the grains are that it looks at, and learns the same from behind. `speed` and `asleep` are of the first slab.
    pub(in crate::dem) fn look_behind(&mut self, rows: &[Row], speed: f64, asleep: bool) -> Result<(), DemError> {
        let mut out = Vec::new();
        if let Some(before) = self.before {
            let mut bytes = Vec::with_capacity(16 + 72 * self.front);
            put(&mut bytes, speed);
            put(&mut bytes, f64::from(u8::from(asleep)));
            // Where neither side moves, nothing has changed.
            let rows = rows.get(..self.front).ok_or_else(broken)?;
            rows.iter().for_each(|r| MOVING.iter().for_each(|&k| put(&mut bytes, r[k])));
            out.push((before, bytes));
        }
        let from: Vec<usize> = self.behind.into_iter().collect();
        let came = self.links().round(out, &from)?;
        let Some(bytes) = came.first() else { return Ok(()) };
        if bytes.len() != 16 + 72 * self.ghosts.len() {
            return Err(broken());
        }
        let mut values = reals(bytes);
        let mut next = || values.next().unwrap_or_default();
        self.speed = next();
        self.asleep = next() != 0.0;
        for ghost in &mut self.ghosts {
            MOVING.iter().for_each(|&k| ghost[k] = next());
        }
        Ok(())
    }

    /// Tells the member behind what the last slab does to the ghosts, and learns the same from before.
    pub(in crate::dem) fn push(&mut self, forces: &[Force]) -> Result<(), DemError> {
        let mut out = Vec::new();
        if let Some(behind) = self.behind {
            let mut bytes = Vec::with_capacity(48 * forces.len());
            forces.iter().for_each(|f| ACTING.iter().for_each(|&k| put(&mut bytes, f[k])));
            out.push((behind, bytes));
        }
        let from: Vec<usize> = self.before.into_iter().collect();
        let came = self.links().round(out, &from)?;
        self.pushed.clear();
        let Some(bytes) = came.first() else { return Ok(()) };
        if !bytes.is_empty() && bytes.len() != 48 * self.front {
            return Err(broken());
        }
        let mut values = reals(bytes);
        for _ in 0..bytes.len() / 48 {
            let mut force = Force::default();
            ACTING.iter().for_each(|&k| force[k] = values.next().unwrap_or_default());
            self.pushed.push(force);
        }
        Ok(())
    }

    /// How much flows before the first slab and behind the last, from what each member knows of its own slabs.
    pub(in crate::dem) fn beside(&mut self, energies: &[[f64; 2]]) -> Result<[f64; 2], DemError> {
        let ends = energies.first().zip(energies.last()).map(|(first, last)| [first[1], last[1]]);
        let all: Vec<Option<[f64; 2]>> = self.share(&ends)?;
        let of = |m: Option<usize>, end: usize| m.and_then(|m| all[m]).map_or(0.0, |e| e[end]);
        Ok([of(self.before, 1), of(self.behind, 0)])
    }

    /// The lead gets what grains do to walls, if it is to be told, and to bodies, slab after slab; on the others nothing is left.
    pub(in crate::dem) fn lead_gets(
        &mut self,
        walls: Vec<Vec3>,
        loads: Vec<BodyLoad>,
        with_walls: bool,
        zones: &[[f64; 2]],
    ) -> Result<(Vec<Vec3>, Vec<BodyLoad>), DemError> {
        // Who is far from every body has nothing to tell, and both sides know it.
        let reach = &self.reach;
        let tells = |m: usize| with_walls || zones.iter().any(|z| z[0] <= reach[m][1] && z[1] >= reach[m][0]);
        let mut all = (if with_walls { walls } else { Vec::new() }, loads);
        if !self.is_lead() {
            if tells(self.index) {
                let told = pack(&all)?;
                self.links().round(vec![(0, told)], &[])?;
            }
            return Ok((Vec::new(), Vec::new()));
        }
        let others: Vec<usize> = (1..self.size).filter(|m| tells(*m)).collect();
        for bytes in self.links().round(Vec::new(), &others)? {
            let (walls, loads): (Vec<Vec3>, Vec<BodyLoad>) = unpack(&bytes)?;
            all.0.extend(walls);
            all.1.extend(loads);
        }
        Ok(all)
    }

    /// Obstacles as the lead has them, on all.
    pub(in crate::dem) fn same_obstacles(&mut self, free: Vec<&mut FreeBody>) -> Result<(), DemError> {
        let others: Vec<usize> = (1..self.size).collect();
        if self.is_lead() {
            let now: Vec<&FreeState> = free.iter().map(|f| &f.now).collect();
            let bytes = pack(&now)?;
            self.links().round(others.iter().map(|m| (*m, bytes.clone())).collect(), &[])?;
            return Ok(());
        }
        let came = self.links().round(Vec::new(), &[0])?;
        let now: Vec<FreeState> = unpack(came.first().ok_or_else(broken)?)?;
        free.into_iter().zip(now).for_each(|(mine, theirs)| mine.restore(theirs));
        Ok(())
    }
}
