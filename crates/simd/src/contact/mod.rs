//! Contacts of spheres in batches: Hertz-Mindlin from properties, tangential displacement with history, optionally
//! rolling and spinning resistance and adhesion. Two (portable), four (AVX2) or eight (AVX-512) pairs of a list go through
//! at a time, by one kernel written over the width of a register.
//!
//! A grain is a [`Row`]. Quarter rows are loaded whole and transposed in registers: no gathers. A list holds pairs with a
//! skin, a quarter of which do not touch; [`Active::select`] takes those that may touch in the next steps, so that
//! registers are full of work. Loads are added to the force rows one pair after the other, in the list's order: so a sum
//! depends on which pairs touch, and not on what else was looked at. Divisions are merged (three reciprocals by one), and
//! the wider paths contract products, which is how their results differ from the portable ones, by round-off.
//!
//! The portable path has the bits of plain arithmetic on every processor: on x86-64 it uses SSE2, which all of them have.

mod kernel;
#[cfg(any(test, not(target_arch = "x86_64")))]
mod plain;
mod reals;
#[cfg(target_arch = "x86_64")]
mod single;
#[cfg(target_arch = "x86_64")]
mod x86;

use crate::Isa;
use crate::rows::{Force, Row, Slip};

/// What two materials make of a contact.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct PairTerms {
    /// S_n = this x sqrt(R* delta): 2 E* (Pa).
    pub normal: f64,
    /// S_t = this x sqrt(R* delta): 8 G* (Pa).
    pub tangential: f64,
    /// g_n = this x sqrt(S_n m*) (1).
    pub damping: f64,
    /// g_t / g_n (1).
    pub damping_ratio: f64,
    /// Coulomb friction (1).
    pub friction: f64,
    /// Rolling friction (1): limit torque = this x R* F_n.
    pub rolling: f64,
    /// Spinning friction (1).
    pub spinning: f64,
    /// Nothing: fills the row.
    pub zero: f64,
    /// Adhesion: constant part (N).
    pub constant: f64,
    /// Adhesion per sqrt(R*) (N/m^0.5).
    pub dmt: f64,
    /// Adhesion per R* (N/m).
    pub perko: f64,
    /// Adhesion per square of the smaller radius (Pa): pi x cohesive pressure.
    pub pressure: f64,
}

/// What is the same for all contacts of a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Terms<'a> {
    /// Pairs of materials, row by row: `pairs[a * materials + b]`.
    pub pairs: &'a [PairTerms],
    /// Number of materials.
    pub materials: usize,
    /// Step h (s).
    pub h: f64,
    /// Least normal force before adhesion (N): 0 or -infinity.
    pub least_normal: f64,
    /// Whether any pair adheres.
    pub adhesion: bool,
    /// Whether pairs may have an offset of their overlap: see [`crate::Slip`]. Only where there is adhesion.
    pub offsets: bool,
    /// Factor on adhesion.
    pub adhesion_scale: f64,
    /// What adhesion grows by per step, as a fraction of itself.
    pub adhesion_growth: f64,
    /// 1/(overlap at which adhesion is fully grown) (1/m).
    pub adhesion_per_overlap: f64,
    /// Damping ratio of rolling and spinning.
    pub rolling_damping: f64,
}

/// What contacts are computed with, once the overlap is known.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Precision {
    /// Double precision.
    #[default]
    Double,
    /// Single precision behind the overlap. Differences of positions and velocities and the overlap itself are formed in double
    /// precision, sums of forces too, and what is remembered is kept so: a contact's load is right to some 1e-6 of itself.
    Single,
}

/// A list of pairs. No pair is of two fixed grains.
#[derive(Clone, Copy, Debug)]
pub struct List<'a> {
    /// Grains from `first` on.
    pub rows: &'a [Row],
    /// The grain that `rows[0]` is.
    pub first: usize,
    /// Grain i of each pair.
    pub owner: &'a [u32],
    /// Grain j of each pair.
    pub other: &'a [u32],
}

/// What the pairs of a list remember.
#[derive(Debug)]
pub struct Memories<'a> {
    /// Tangential displacement and growth of adhesion of each pair, all zero while it does not touch.
    pub slip: &'a mut [Slip],
    /// Relative rotation of each pair; empty where nothing resists rolling.
    pub roll: &'a mut [[f64; 3]],
}

/// The pairs of a list that may touch until some have come closer by a margin.
#[derive(Clone, Debug, Default)]
pub struct Active {
    /// Places of grains i and j among the rows and of the memory of the pair, each counted in reals. Inside `grains` and `listed`: nothing but `select` writes them.
    pairs: Vec<[u32; 3]>,
    grains: usize,
    listed: usize,
}

impl Active {
    /// Takes the pairs that are closer than touching plus `margin` (m); the others forget what they remember.
    ///
    /// # Panics
    /// Where the lengths of list and memories do not fit together, or a pair names a grain without a row: a caller's
    /// mistake, found before memory is touched.
    pub fn select(&mut self, isa: Isa, list: &List, memories: &mut Memories, margin: f64) {
        assert!(isa.runs_here(), "instruction path {isa} is not there");
        let listed = list.other.len();
        assert!(list.owner.len() == listed && memories.slip.len() == listed, "lists of different length");
        assert!(memories.roll.is_empty() || memories.roll.len() == listed, "rotations do not belong to the pairs");
        let (first, end) = (list.first, list.first + list.rows.len());
        let most = (u32::MAX / kernel::IN_ROW) as usize;
        assert!(end - first <= most && listed <= most && end <= u32::MAX as usize, "more than places can number");
        let mut inside = true;
        for (&i, &j) in list.owner.iter().zip(list.other) {
            let (i, j) = (i as usize, j as usize);
            inside &= (i >= first) & (i < end) & (j >= first) & (j < end);
        }
        assert!(inside, "a pair names a grain outside {first}..{end}");
        (self.grains, self.listed) = (list.rows.len(), listed);
        // SAFETY: the processor has the path (runs_here); lengths and indices are checked above.
        unsafe {
            match isa {
                #[cfg(target_arch = "x86_64")]
                Isa::Portable => kernel::portable::near(list, memories, margin, &mut self.pairs),
                #[cfg(target_arch = "x86_64")]
                Isa::Avx2 => kernel::avx2::near(list, memories, margin, &mut self.pairs),
                #[cfg(target_arch = "x86_64")]
                Isa::Avx512 => kernel::avx512::near(list, memories, margin, &mut self.pairs),
                #[cfg(not(target_arch = "x86_64"))]
                _ => kernel::plain::near(list, memories, margin, &mut self.pairs),
            }
        }
    }

    /// How many pairs.
    pub fn len(&self) -> usize {
        self.pairs.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.pairs.is_empty()
    }

    /// Memory held (bytes).
    pub fn memory(&self) -> usize {
        self.pairs.capacity() * size_of::<[u32; 3]>()
    }
}

/// Adds the contact loads of all active pairs to `force`, one entry for each row, and moves their memories on by one step.
///
/// # Panics
/// Where rows, memories or forces are not as many as those that the pairs were selected from, or a row has a material
/// without terms: a caller's mistake.
pub fn hertz_mindlin(
    isa: Isa,
    precision: Precision,
    terms: &Terms,
    active: &Active,
    rows: &[Row],
    memories: &mut Memories,
    force: &mut [Force],
) {
    assert!(isa.runs_here(), "instruction path {isa} is not there");
    assert!(rows.len() == active.grains && force.len() == active.grains, "other grains than were selected from");
    assert!(memories.slip.len() == active.listed, "another list than was selected from");
    assert!(memories.roll.is_empty() || memories.roll.len() == active.listed, "rotations do not belong to the pairs");
    assert!(terms.materials >= 1 && terms.pairs.len() == terms.materials * terms.materials, "pairs of materials");
    let mut batch = kernel::Batch { terms, active, rows, slip: &mut *memories.slip, roll: &mut *memories.roll, force };
    // SAFETY: the processor has the path (runs_here); the pairs lie inside the lengths checked above.
    unsafe {
        match (isa, precision) {
            #[cfg(target_arch = "x86_64")]
            (Isa::Portable, Precision::Double) => kernel::portable::loads(&mut batch),
            #[cfg(target_arch = "x86_64")]
            (Isa::Portable, Precision::Single) => kernel::portable::mixed_loads(&mut batch),
            #[cfg(target_arch = "x86_64")]
            (Isa::Avx2, Precision::Double) => kernel::avx2::loads(&mut batch),
            #[cfg(target_arch = "x86_64")]
            (Isa::Avx2, Precision::Single) => kernel::avx2::mixed_loads(&mut batch),
            #[cfg(target_arch = "x86_64")]
            (Isa::Avx512, Precision::Double) => kernel::avx512::loads(&mut batch),
            #[cfg(target_arch = "x86_64")]
            (Isa::Avx512, Precision::Single) => kernel::avx512::mixed_loads(&mut batch),
            #[cfg(not(target_arch = "x86_64"))]
            (_, Precision::Double) => kernel::plain::loads(&mut batch),
            #[cfg(not(target_arch = "x86_64"))]
            (_, Precision::Single) => kernel::plain::mixed_loads(&mut batch),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn terms(pairs: &[PairTerms]) -> Terms<'_> {
        let (h, adhesion) = (1e-5, false);
        Terms {
            pairs,
            materials: 1,
            h,
            least_normal: f64::NEG_INFINITY,
            adhesion,
            offsets: false,
            adhesion_scale: 1.0,
            adhesion_growth: 1.0,
            adhesion_per_overlap: f64::INFINITY,
            rolling_damping: 1.0,
        }
    }

    fn row(x: f64) -> Row {
        let mut row = Row::default();
        (row[0], row[3], row[7], row[15]) = (x, 0.01, 100.0, 1e6);
        row
    }

    /// Grains in a line, each touching the next: every batch length from one pair to past the widest register.
    #[test]
    fn batches_of_any_length_push_apart_by_the_law_and_balance() {
        let pairs = [PairTerms { normal: 1e7, tangential: 1e7, friction: 0.5, ..PairTerms::default() }];
        for isa in Isa::ALL.into_iter().filter(|i| i.runs_here()) {
            for count in 1..20_usize {
                let rows: Vec<Row> = (0..=count).map(|k| row(0.019 * k as f64)).collect();
                let owner: Vec<u32> = (0..count as u32).collect();
                let other: Vec<u32> = (1..=count as u32).collect();
                let (mut slip, mut force) = (vec![Slip::default(); count], vec![Force::default(); count + 1]);
                let list = List { rows: &rows, first: 0, owner: &owner, other: &other };
                let mut memories = Memories { slip: &mut slip, roll: &mut [] };
                let mut active = Active::default();
                active.select(isa, &list, &mut memories, 0.001);
                hertz_mindlin(isa, Precision::Double, &terms(&pairs), &active, &rows, &mut memories, &mut force);
                // F = 2/3 S_n delta with R* = r/2, delta = 1 mm.
                let expected = 2.0 / 3.0 * 1e7 * (0.005_f64 * 0.001).sqrt() * 0.001;
                assert!((force[0][0] + expected).abs() < 1e-9 * expected, "{isa}, {count}: {:?}", force[0]);
                assert!((force[count][0] - expected).abs() < 1e-9 * expected);
                assert!(force[1..count].iter().all(|f| f[0].abs() < 1e-9 * expected));
                assert!(slip.iter().all(|s| s[3] == 1.0));
            }
        }
    }

    /// Grains far from the origin, overlapping by a thousandth to a ten-millionth of their radius.
    #[test]
    fn single_precision_behind_the_overlap_keeps_loads_to_a_millionth() {
        let full = PairTerms {
            normal: 1e7,
            tangential: 1.3e7,
            damping: 0.4,
            damping_ratio: 1.1,
            friction: 0.3,
            ..PairTerms::default()
        };
        for isa in Isa::ALL.into_iter().filter(|i| i.runs_here()) {
            for k in 0..40 {
                let overlap = 1e-5 * 0.8_f64.powi(k);
                let (mut a, mut b) = (row(50.0), row(50.0 + 0.6 * (0.02 - overlap)));
                b[1] = 0.8 * (0.02 - overlap);
                (a[4], a[5], b[8], b[10]) = (0.01, 0.003, 0.2, -0.7);
                let loads = [Precision::Double, Precision::Single].map(|precision| {
                    let (mut slip, mut force) = ([Slip::default()], [Force::default(); 2]);
                    let rows = [a, b];
                    let list = List { rows: &rows, first: 0, owner: &[0], other: &[1] };
                    let mut memories = Memories { slip: &mut slip, roll: &mut [] };
                    let mut active = Active::default();
                    active.select(isa, &list, &mut memories, 0.0);
                    hertz_mindlin(isa, precision, &terms(&[full]), &active, &rows, &mut memories, &mut force);
                    (0..3).for_each(|c| assert_eq!(force[0][c], -force[1][c]));
                    (force[0], slip[0])
                });
                let [(f, u), (g, v)] = loads;
                let size = |x: &[f64]| x.iter().map(|x| x * x).sum::<f64>().sqrt();
                let apart = |x: &[f64], y: &[f64]| x.iter().zip(y).map(|(x, y)| (x - y) * (x - y)).sum::<f64>().sqrt();
                for (x, y) in [(&f[..3], &g[..3]), (&f[4..7], &g[4..7]), (&u[..3], &v[..3])] {
                    assert!(size(x) > 0.0 && apart(x, y) < 2e-6 * size(x), "{isa}, {overlap}: {x:?}, {y:?}");
                }
            }
        }
    }

    #[test]
    #[should_panic(expected = "outside 0..2")]
    fn a_pair_of_a_grain_that_is_not_there_is_caught() {
        let isa = Isa::widest();
        let rows = [row(0.0), row(0.1)];
        let list = List { rows: &rows, first: 0, owner: &[0], other: &[2] };
        let mut memories = Memories { slip: &mut [Slip::default()], roll: &mut [] };
        Active::default().select(isa, &list, &mut memories, 0.0);
    }

    #[test]
    #[should_panic(expected = "other grains")]
    fn pairs_of_other_grains_are_refused() {
        let (isa, pairs) = (Isa::widest(), [PairTerms::default()]);
        let rows = [row(0.0), row(0.1)];
        let list = List { rows: &rows, first: 0, owner: &[0], other: &[1] };
        let mut memories = Memories { slip: &mut [Slip::default()], roll: &mut [] };
        let mut active = Active::default();
        active.select(isa, &list, &mut memories, 1.0);
        hertz_mindlin(
            isa,
            Precision::Double,
            &terms(&pairs),
            &active,
            &rows[..1],
            &mut memories,
            &mut [Force::default()],
        );
    }

    /// Pairs at all distances, sliding and sticking, turning, adhering: numbers without pattern.
    #[cfg(target_arch = "x86_64")]
    #[test]
    fn the_portable_path_has_the_bits_of_plain_arithmetic() {
        let mut seed = 1_u64;
        let mut random = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 / (1_u64 << 53) as f64
        };
        let full = PairTerms {
            normal: 1e7,
            tangential: 1.3e7,
            damping: 0.4,
            damping_ratio: 1.1,
            friction: 0.3,
            rolling: 0.1,
            spinning: 0.05,
            constant: 0.1,
            dmt: 0.2,
            perko: 3.0,
            pressure: 100.0,
            ..PairTerms::default()
        };
        let pairs = [full, full, full, PairTerms { rolling: 0.0, ..full }];
        let count = 151_usize;
        let rows: Vec<Row> = (0..=count)
            .map(|k| {
                let mut row = self::row(0.0193 * k as f64 + 0.001 * random());
                (1..11)
                    .filter(|c| ![3, 7].contains(c))
                    .for_each(|c| row[c] = 0.003 * (random() - 0.5) * f64::from(c as u32));
                row[11] = (k % 2) as f64;
                row
            })
            .collect();
        let owner: Vec<u32> = (0..count as u32).collect();
        let other: Vec<u32> = (1..=count as u32).collect();
        for (adhesion, rolling) in [(false, false), (true, false), (false, true), (true, true)] {
            let terms = Terms { adhesion, materials: 2, adhesion_growth: 0.3, ..terms(&pairs) };
            for precision in [Precision::Double, Precision::Single] {
                let results = [false, true].map(|plain| {
                    let (mut slip, mut force) = (vec![Slip::default(); count], vec![Force::default(); count + 1]);
                    let mut roll = vec![[0.0; 3]; if rolling { count } else { 0 }];
                    let list = List { rows: &rows, first: 0, owner: &owner, other: &other };
                    let mut active = Active::default();
                    let mut memories = Memories { slip: &mut slip, roll: &mut roll };
                    active.select(Isa::Portable, &list, &mut memories, 1e-3);
                    for _ in 0..3 {
                        if plain {
                            let (slip, roll) = (&mut *memories.slip, &mut *memories.roll);
                            let (terms, active, rows, force) = (&terms, &active, &rows[..], &mut force[..]);
                            let mut batch = kernel::Batch { terms, active, rows, slip, roll, force };
                            // SAFETY: the lengths fit together.
                            unsafe {
                                match precision {
                                    Precision::Double => kernel::plain::loads(&mut batch),
                                    Precision::Single => kernel::plain::mixed_loads(&mut batch),
                                }
                            }
                        } else {
                            hertz_mindlin(Isa::Portable, precision, &terms, &active, &rows, &mut memories, &mut force);
                        }
                    }
                    let all = slip.iter().flat_map(|s| s.0).chain(roll.concat()).chain(force.iter().flat_map(|f| f.0));
                    all.map(f64::to_bits).collect::<Vec<_>>()
                });
                assert!(results[0] == results[1], "adhesion {adhesion}, rolling {rolling}, {precision:?}");
                assert!(results[0].iter().filter(|b| **b != 0).count() > 5 * count);
            }
        }
    }
}
