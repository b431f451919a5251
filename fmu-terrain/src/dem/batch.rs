//! Grain-grain contacts by the batch kernels of `crates/simd`, where there is one for the law.
//!
//! They cover Hertz-Mindlin from properties with history, with or without rolling resistance and adhesion, on every
//! instruction path; everything else, walls and bodies run in [`super::kernel`], which is also what they are tested
//! against.

use super::contact::Options;
use super::engine::Setup;
use super::grains::{MATERIAL, Row};
use super::law::hertz_mindlin::TWO_SQRT_5_6;
use super::law::{Form, LawKind, Tangential};
use super::material::{Pair, PairTable};
use super::slab::{Near, Scratch, Slab};
use std::f64::consts::PI;
use terramech_simd::Isa;
use terramech_simd::contact::{List, Memories, PairTerms, Precision, Terms, hertz_mindlin};

/// The kernel that a bed uses for its grain-grain contacts.
#[derive(Clone, Debug)]
pub struct BatchKernel {
    isa: Isa,
    precision: Precision,
    pairs: Vec<PairTerms>,
    materials: usize,
}

impl BatchKernel {
    /// The kernel for a setup, if there is one; `only`: the material of all grains of the whole bed, if it is one.
    pub fn of(setup: &Setup, pairs: &PairTable, only: Option<usize>, isa: Isa) -> Option<Self> {
        let covered = setup.law == LawKind::HertzMindlin
            && setup.form == Form::Properties
            && setup.tangential == Tangential::History;
        let precision = setup.precision;
        covered.then(|| {
            // Grains of one kind, whatever walls and bodies are made of: no pair needs to look up what it is.
            if let Some(k) = only {
                Self { isa, precision, pairs: vec![pair_terms(pairs.get(k, k))], materials: 1 }
            } else {
                Self {
                    isa,
                    precision,
                    pairs: pairs.all().iter().map(pair_terms).collect(),
                    materials: setup.materials.len(),
                }
            }
        })
    }

    /// All pairs of a slab, `rows` its grains and halo; loads are added to the scratch forces.
    pub fn run(&self, rows: &[Row], o: &Options, slab: &mut Slab, near: &mut Near, scratch: &mut Scratch) {
        let terms = Terms {
            pairs: &self.pairs,
            materials: self.materials,
            h: o.h,
            least_normal: o.least_normal,
            adhesion: o.adhesion,
            offsets: o.offsets,
            adhesion_scale: o.adhesion_scale,
            adhesion_growth: o.adhesion_growth,
            adhesion_per_overlap: o.adhesion_per_overlap,
            rolling_damping: o.rolling_damping,
        };
        let mut memories = Memories { slip: &mut slab.slip, roll: &mut slab.roll };
        if near.slack < 0.0 {
            let list = List { rows, first: slab.first as usize, owner: &slab.owner, other: &slab.other };
            near.active.select(self.isa, &list, &mut memories, o.margin);
            near.slack = o.margin;
        }
        hertz_mindlin(self.isa, self.precision, &terms, &near.active, rows, &mut memories, &mut scratch.force);
    }
}

/// The material of all grains, if it is one.
pub(super) fn only_material(rows: &[Row]) -> Option<usize> {
    let first = rows.first()?[MATERIAL];
    rows.iter().all(|r| r[MATERIAL] == first).then_some(first as usize)
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
