//! Grain-grain contacts by the batch kernels of `crates/simd`, where there is one for the law and the processor.
//!
//! They cover Hertz-Mindlin from properties with history, with or without rolling resistance and adhesion; everything
//! else, walls and bodies, and every law on a processor without AVX2, runs in [`super::kernel`], which is also what
//! they are tested against.

use super::contact::Options;
use super::engine::Setup;
use super::grains::Row;
use super::law::hertz_mindlin::TWO_SQRT_5_6;
use super::law::{Form, LawKind, Tangential};
use super::material::{Pair, PairTable};
use super::slab::{Scratch, Slab};
use std::f64::consts::PI;
use terramech_simd::Isa;
use terramech_simd::contact::{Batch, PairTerms, Terms, hertz_mindlin};

/// The kernel that a bed uses for its grain-grain contacts.
#[derive(Clone, Debug)]
pub struct BatchKernel {
    isa: Isa,
    pairs: Vec<PairTerms>,
    materials: usize,
}

impl BatchKernel {
    /// The kernel for a setup, if there is one.
    pub fn of(setup: &Setup, pairs: &PairTable, isa: Isa) -> Option<Self> {
        let covered = setup.law == LawKind::HertzMindlin
            && setup.form == Form::Properties
            && setup.tangential == Tangential::History
            && isa != Isa::Portable;
        covered.then(|| Self {
            isa,
            pairs: pairs.all().iter().map(pair_terms).collect(),
            materials: setup.materials.len(),
        })
    }

    /// All pairs of a slab; loads are added to the scratch forces.
    pub fn run(&self, rows: &[Row], o: &Options, slab: &mut Slab, scratch: &mut Scratch) {
        let terms = Terms {
            pairs: &self.pairs,
            materials: self.materials,
            h: o.h,
            least_normal: o.least_normal,
            adhesion: o.adhesion,
            adhesion_scale: o.adhesion_scale,
            adhesion_growth: o.adhesion_growth,
            adhesion_per_overlap: o.adhesion_per_overlap,
            rolling_damping: o.rolling_damping,
        };
        let mut batch = Batch {
            rows,
            owner: &slab.owner,
            other: &slab.other,
            slip: &mut slab.slip,
            roll: &mut slab.roll,
            first: slab.first as usize,
            force: &mut scratch.force,
        };
        let done = hertz_mindlin(self.isa, &terms, &mut batch);
        debug_assert!(done, "made for a path that has a kernel");
    }
}

fn pair_terms(p: &Pair) -> PairTerms {
    PairTerms {
        normal: 2.0 * p.e_star,
        tangential: 8.0 * p.g_star,
        damping: TWO_SQRT_5_6 * p.damping_ratio,
        damping_ratio: p.sqrt_st_over_sn,
        friction: p.friction,
        rolling: p.rolling_friction,
        spinning: p.spinning_friction,
        zero: 0.0,
        constant: p.adhesion.constant,
        dmt: p.adhesion.dmt,
        perko: p.adhesion.perko,
        pressure: PI * p.adhesion.pressure,
    }
}
