//! Contacts of spheres in batches: Hertz-Mindlin from properties, tangential displacement with history, optionally
//! rolling and spinning resistance and adhesion. Four (AVX2) or eight (AVX-512) pairs of a list go through at a time.
//!
//! A grain is a row of 16 reals: position (0-2), radius (3), velocity (4-6), 1/mass (7), angular velocity (8-10),
//! material (11); the rest is not looked at. Quarter rows are loaded whole and transposed in registers: no gathers. All
//! pairs of a list are computed, those that do not touch are masked out: a list with a thin skin holds few of them, and
//! a branch per pair would cost more. Loads are added to the force rows one pair after the other, in the list's order: so
//! a sum depends on the list alone. Divisions are merged (three reciprocals by one), and products contracted, which is
//! how results differ from the reference's, by round-off.

#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;
#[cfg(target_arch = "x86_64")]
mod kernel;
#[cfg(target_arch = "x86_64")]
mod reals;

use crate::Isa;

/// A grain, see the module.
pub type Row = [f64; 16];

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
    /// Factor on adhesion.
    pub adhesion_scale: f64,
    /// What adhesion grows by per step, as a fraction of itself.
    pub adhesion_growth: f64,
    /// 1/(overlap at which adhesion is fully grown) (1/m).
    pub adhesion_per_overlap: f64,
    /// Damping ratio of rolling and spinning.
    pub rolling_damping: f64,
}

/// A list of pairs with their memories, and where the loads go.
pub struct Batch<'a> {
    /// All grains.
    pub rows: &'a [Row],
    /// Grain i of each pair.
    pub owner: &'a [u32],
    /// Grain j of each pair.
    pub other: &'a [u32],
    /// Tangential displacement and growth of adhesion of each pair, all zero while it does not touch.
    pub slip: &'a mut [[f64; 4]],
    /// Relative rotation of each pair; empty where nothing resists rolling.
    pub roll: &'a mut [[f64; 3]],
    /// The grain that `force[0]` belongs to.
    pub first: usize,
    /// Force (0-2) and moment (4-6) on the grains from `first`: loads are added.
    pub force: &'a mut [[f64; 8]],
}

/// Adds the contact loads of all pairs of a batch and moves their memories on by one step. Whether this build has a
/// kernel for the path: `false` (portable) leaves everything as it was, and the caller's own loop is to run.
///
/// # Panics
/// Where the lengths of a batch do not fit together, a pair names a grain without a row or a force, or a row a material
/// without terms: a caller's mistake, found before memory is touched.
pub fn hertz_mindlin(isa: Isa, terms: &Terms, batch: &mut Batch) -> bool {
    assert!(isa.runs_here(), "instruction path {isa} is not there");
    let pairs = batch.other.len();
    assert!(batch.owner.len() == pairs && batch.slip.len() == pairs, "a batch of lists of different length");
    assert!(batch.roll.is_empty() || batch.roll.len() == pairs, "rotations do not belong to the pairs");
    assert!(batch.first + batch.force.len() <= batch.rows.len(), "forces on grains that are not there");
    assert!(terms.materials >= 1 && terms.pairs.len() == terms.materials * terms.materials, "pairs of materials");
    match isa {
        Isa::Portable => false,
        #[cfg(target_arch = "x86_64")]
        Isa::Avx2 => {
            // SAFETY: the processor has AVX2 and FMA (runs_here); the lengths are checked above, the indices inside.
            unsafe { kernel::avx2(terms, batch) };
            true
        }
        #[cfg(target_arch = "x86_64")]
        Isa::Avx512 => {
            // SAFETY: as above, for AVX-512 F.
            unsafe { kernel::avx512(terms, batch) };
            true
        }
        #[cfg(not(target_arch = "x86_64"))]
        _ => false,
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
            adhesion_scale: 1.0,
            adhesion_growth: 1.0,
            adhesion_per_overlap: f64::INFINITY,
            rolling_damping: 1.0,
        }
    }

    fn row(x: f64) -> Row {
        let mut row = [0.0; 16];
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
                let (mut slip, mut force) = (vec![[0.0; 4]; count], vec![[0.0; 8]; count + 1]);
                let mut batch = Batch {
                    rows: &rows,
                    owner: &owner,
                    other: &other,
                    slip: &mut slip,
                    roll: &mut [],
                    first: 0,
                    force: &mut force,
                };
                if !hertz_mindlin(isa, &terms(&pairs), &mut batch) {
                    assert_eq!(isa, Isa::Portable);
                    continue;
                }
                // F = 2/3 S_n delta with R* = r/2, delta = 1 mm.
                let expected = 2.0 / 3.0 * 1e7 * (0.005_f64 * 0.001).sqrt() * 0.001;
                assert!((force[0][0] + expected).abs() < 1e-9 * expected, "{isa}, {count}: {:?}", force[0]);
                assert!((force[count][0] - expected).abs() < 1e-9 * expected);
                assert!(force[1..count].iter().all(|f| f[0].abs() < 1e-9 * expected));
                assert!(slip.iter().all(|s| s[3] == 1.0));
            }
        }
    }

    #[test]
    #[should_panic(expected = "outside 0..2")]
    fn a_pair_of_a_grain_that_is_not_there_is_caught() {
        let isa = Isa::widest();
        assert!(isa != Isa::Portable, "a pair names a grain outside 0..2: nothing to test on this processor");
        let pairs = [PairTerms::default()];
        let rows = [row(0.0), row(0.1), row(0.2)];
        let (mut slip, mut force) = ([[0.0; 4]], [[0.0; 8]; 2]);
        let (owner, other) = ([0], [2]);
        let mut batch = Batch {
            rows: &rows,
            owner: &owner,
            other: &other,
            slip: &mut slip,
            roll: &mut [],
            first: 0,
            force: &mut force,
        };
        hertz_mindlin(isa, &terms(&pairs), &mut batch);
    }
}
