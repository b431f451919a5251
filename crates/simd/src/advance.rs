//! Moving grains on by a step: semi-implicit Euler over whole rows.
//!
//! Whole rows go through, the fourth entry of each quarter as one that nothing is added to: the fourth entries of a load are 0. Products
//! and sums are not contracted, so every instruction path gives the same bits.

use crate::dispatch::{Kernel, dispatch};
use crate::isa::Isa;
use crate::lanes::Lanes;
use crate::rows::{Force, Row};

/// How grains move on in a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// Step h (s).
    pub h: f64,
    /// Gravity (m/s2).
    pub gravity: [f64; 3],
    /// Distance from where the lists were made beyond which a grain has moved (m).
    pub reach: f64,
}

/// What a stretch of grains did in a step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Moved {
    /// Some grain is further than the reach from where the lists were made, or nowhere: not finite.
    pub far: bool,
    /// No grain is faster (m/s): the root of the sum of the greatest squares of the components.
    pub speed: f64,
}

/// Moves `rows` on by one step, where entries 12 to 14 of a row are the place where the lists were made and 15 is 1/inertia. Loads on
/// them are `own`, to which `more` are added for the first of them: in this order, which is that of the sums. Fixed grains (1/mass = 0) stay.
///
/// # Panics
/// Where there are fewer loads than rows: a caller's mistake.
pub fn advance(isa: Isa, rows: &mut [Row], own: &[Force], more: &[Force], motion: Motion) -> Moved {
    let own = &own[..rows.len()];
    let (shared, alone) = rows.split_at_mut(more.len().min(own.len()));
    let (own_shared, own_alone) = own.split_at(shared.len());
    let mut sweep = Sweep { motion, far: false, squares: [0.0; 4] };
    sweep = dispatch(isa, Stretch { rows: shared, own: own_shared, more: Some(more), sweep });
    sweep = dispatch(isa, Stretch { rows: alone, own: own_alone, more: None, sweep });
    let [x, y, z, _] = sweep.squares;
    Moved { far: sweep.far, speed: (x + y + z).sqrt() }
}

#[derive(Clone, Copy)]
struct Sweep {
    motion: Motion,
    far: bool,
    squares: [f64; 4],
}

struct Stretch<'a> {
    rows: &'a mut [Row],
    own: &'a [Force],
    more: Option<&'a [Force]>,
    sweep: Sweep,
}

impl Kernel for Stretch<'_> {
    type Output = Sweep;
    #[inline(always)]
    fn run<L: Lanes>(self) -> Sweep {
        let mut sweep = self.sweep;
        match self.more {
            Some(more) => {
                for ((row, own), more) in self.rows.iter_mut().zip(self.own).zip(more) {
                    let mut load = own.0;
                    for (load, more) in load.iter_mut().zip(more.0) {
                        *load += more;
                    }
                    sweep.grain(&mut row.0, &load);
                }
            }
            None => {
                for (row, own) in self.rows.iter_mut().zip(self.own) {
                    sweep.grain(&mut row.0, &own.0);
                }
            }
        }
        sweep
    }
}

impl Sweep {
    // Four entries at a time, so that the compiler sees whole registers: the fourth load of each quarter is 0, and what must not
    // move has a step of 0. Comparisons are written so that NaN is far.
    #[inline(always)]
    #[allow(clippy::neg_cmp_op_on_partial_ord)]
    fn grain(&mut self, row: &mut [f64; 16], load: &[f64; 8]) {
        let Motion { h, gravity: [gx, gy, gz], reach } = self.motion;
        let (inv_m, inv_i) = (row[7], row[15]);
        if inv_m == 0.0 {
            return;
        }
        let (g, step, own) = ([gx, gy, gz, 0.0], [h, h, h, 0.0], [1.0, 1.0, 1.0, 0.0]);
        let (mut x, mut v, mut w, mut d2) = ([0.0; 4], [0.0; 4], [0.0; 4], [0.0; 4]);
        for c in 0..4 {
            v[c] = row[4 + c] + h * (load[c] * inv_m + g[c]);
            x[c] = row[c] + step[c] * v[c];
            w[c] = row[8 + c] + h * (load[4 + c] * inv_i);
            let d = (x[c] - row[12 + c]) * own[c];
            d2[c] = d * d;
            let square = v[c] * v[c];
            self.squares[c] = if square > self.squares[c] { square } else { self.squares[c] };
        }
        row[..4].copy_from_slice(&x);
        row[4..8].copy_from_slice(&v);
        row[8..12].copy_from_slice(&w);
        self.far |= !((d2[0] + d2[2]) + (d2[1] + d2[3]) <= reach * reach);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(k: usize) -> Row {
        Row(std::array::from_fn(|c| ((k * 16 + c) as f64 * 0.377).sin().abs() + 0.01))
    }

    #[test]
    fn rows_move_by_the_law_with_the_same_bits_on_every_path() {
        let motion = Motion { h: 1e-3, gravity: [0.1, 0.0, -9.81], reach: 10.0 };
        let own: Vec<Force> = (0..7)
            .map(|k| Force(std::array::from_fn(|c| if c % 4 == 3 { 0.0 } else { (k * 8 + c) as f64 - 20.0 })))
            .collect();
        let more = &own[3..6];
        let mut before: Vec<Row> = (0..7).map(row).collect();
        before[5][7] = 0.0;
        let results = Isa::ALL.map(|isa| {
            let mut rows = before.clone();
            let moved = advance(isa, &mut rows, &own, more, motion);
            (rows, moved)
        });
        assert!(results.iter().all(|r| *r == results[0]));
        let (rows, moved) = &results[0];
        for (k, (row, old)) in rows.iter().zip(&before).enumerate() {
            if k == 5 {
                assert_eq!(row, old);
                continue;
            }
            for c in 0..3 {
                let load = |e: usize| own[k][e] + more.get(k).map_or(0.0, |m| m[e]);
                let v = old[4 + c] + 1e-3 * (load(c) * old[7] + motion.gravity[c]);
                assert_eq!(row[4 + c], v);
                assert_eq!(row[c], old[c] + 1e-3 * v);
                assert_eq!(row[8 + c], old[8 + c] + 1e-3 * (load(4 + c) * old[15]));
            }
            assert!([3, 7, 11, 12, 13, 14, 15].iter().all(|&e| row[e] == old[e]));
            assert!(moved.speed >= (row[4].powi(2) + row[5].powi(2) + row[6].powi(2)).sqrt());
        }
        assert!(!moved.far);
    }

    #[test]
    fn a_grain_that_is_far_or_nowhere_has_moved() {
        let motion = Motion { h: 1e-3, gravity: [0.0; 3], reach: 0.5 };
        for (x, far) in [(0.4, false), (0.6, true), (f64::NAN, true), (f64::INFINITY, true)] {
            let mut row = Row::default();
            (row[0], row[7]) = (x, 1.0);
            assert_eq!(advance(Isa::widest(), &mut [row], &[Force::default()], &[], motion).far, far, "{x}");
        }
    }
}
