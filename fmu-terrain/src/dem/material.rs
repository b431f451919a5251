//! Materials and what a pair of them makes of a contact.
//!
//! Grains, walls and bodies each have a material, an index into one list. Everything that depends only on the two
//! materials is worked out once into a [`PairTable`], so that the kernels multiply and never look up.
//!
//! Pair rules: friction, rolling and spinning friction, restitution and adhesion by the minimum; stiffness and damping
//! coefficients by the mean; a table of explicit pairs ([`PairOverride`]) replaces single values.

use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// Stiffness and damping given as numbers instead of through elastic properties. Their units depend on the law, see
/// [`super::law`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Coefficients {
    /// Normal stiffness.
    pub kn: f64,
    /// Normal damping.
    pub gn: f64,
    /// Tangential stiffness.
    pub kt: f64,
    /// Tangential damping.
    pub gt: f64,
}

/// Adhesion of a material: the pull A subtracted from the normal force, the sum of its four kinds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Adhesion {
    /// Constant pull (N).
    pub constant: f64,
    /// Derjaguin-Muller-Toporov: A = value sqrt(R*) (N/m^0.5).
    pub dmt: f64,
    /// Perko: A = value R* (N/m).
    pub perko: f64,
    /// Cohesive pressure p (Pa): A = pi r^2 p, r the smaller radius of the pair.
    pub pressure: f64,
}

impl Adhesion {
    fn least(self, other: Self) -> Self {
        Self {
            constant: self.constant.min(other.constant),
            dmt: self.dmt.min(other.dmt),
            perko: self.perko.min(other.perko),
            pressure: self.pressure.min(other.pressure),
        }
    }
    /// Whether there is any.
    pub fn any(self) -> bool {
        self != Self::default()
    }
}

/// Contact properties of a material.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Material {
    /// Young's modulus (Pa); infinite = rigid.
    pub young_modulus: f64,
    /// Poisson's ratio (1).
    pub poisson_ratio: f64,
    /// Coefficient of restitution (1), 0 to 1.
    pub restitution: f64,
    /// Coulomb friction (1).
    pub friction: f64,
    /// Rolling friction (1): limit torque = this x R* F_n.
    pub rolling_friction: f64,
    /// Spinning (torsional) friction (1): limit torque = this x R* F_n.
    pub spinning_friction: f64,
    /// Adhesion.
    pub adhesion: Adhesion,
    /// Stiffness and damping for laws used in their coefficient form.
    pub coefficients: Coefficients,
}

impl Default for Material {
    /// A soft, frictional soil: E 1e7 Pa, nu 0.3, e 0.2, mu 0.9, no rolling resistance, no adhesion; the coefficients
    /// are those of the source paper's driver.
    fn default() -> Self {
        Self {
            young_modulus: 1e7,
            poisson_ratio: 0.3,
            restitution: 0.2,
            friction: 0.9,
            rolling_friction: 0.0,
            spinning_friction: 0.0,
            adhesion: Adhesion::default(),
            coefficients: Coefficients { kn: 1e6, gn: 60.0, kt: 4e5, gt: 40.0 },
        }
    }
}

/// Values that replace what the pair rules give for two materials.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PairOverride {
    /// The two materials, in any order.
    pub materials: [usize; 2],
    /// Coefficient of restitution.
    pub restitution: Option<f64>,
    /// Coulomb friction.
    pub friction: Option<f64>,
    /// Rolling friction.
    pub rolling_friction: Option<f64>,
    /// Spinning friction.
    pub spinning_friction: Option<f64>,
    /// Adhesion.
    pub adhesion: Option<Adhesion>,
    /// Stiffness and damping.
    pub coefficients: Option<Coefficients>,
}

/// What two materials make of a contact, ready for the kernels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pair {
    /// Effective Young's modulus E* (Pa).
    pub e_star: f64,
    /// Effective shear modulus G* (Pa).
    pub g_star: f64,
    /// sqrt(S_t/S_n) = sqrt(4 G*/E*) of Hertz-Mindlin (1).
    pub sqrt_st_over_sn: f64,
    /// Restitution (1).
    pub restitution: f64,
    /// Damping ratio of the Hertz laws: -ln e / sqrt(ln^2 e + pi^2), 0 at e = 1 and 1 at e = 0.
    pub damping_ratio: f64,
    /// (pi / ln e)^2, infinite at e = 1, 0 at e = 0 (Hooke).
    pub pi_over_ln_e_squared: f64,
    /// Coulomb friction.
    pub friction: f64,
    /// Rolling friction.
    pub rolling_friction: f64,
    /// Spinning friction.
    pub spinning_friction: f64,
    /// Adhesion.
    pub adhesion: Adhesion,
    /// Stiffness and damping.
    pub coefficients: Coefficients,
}

impl Pair {
    /// The pair rules.
    pub fn of(a: &Material, b: &Material) -> Self {
        let compliance = |m: &Material| (1.0 - m.poisson_ratio * m.poisson_ratio) / m.young_modulus;
        let shear = |m: &Material| 2.0 * (2.0 - m.poisson_ratio) * (1.0 + m.poisson_ratio) / m.young_modulus;
        let (ca, cb) = (a.coefficients, b.coefficients);
        let mean = |x: f64, y: f64| 0.5 * (x + y);
        let e_star = 1.0 / (compliance(a) + compliance(b));
        let g_star = 1.0 / (shear(a) + shear(b));
        Self {
            e_star,
            g_star,
            sqrt_st_over_sn: (4.0 * g_star / e_star).sqrt(),
            restitution: 1.0,
            damping_ratio: 0.0,
            pi_over_ln_e_squared: f64::INFINITY,
            friction: a.friction.min(b.friction),
            rolling_friction: a.rolling_friction.min(b.rolling_friction),
            spinning_friction: a.spinning_friction.min(b.spinning_friction),
            adhesion: a.adhesion.least(b.adhesion),
            coefficients: Coefficients {
                kn: mean(ca.kn, cb.kn),
                gn: mean(ca.gn, cb.gn),
                kt: mean(ca.kt, cb.kt),
                gt: mean(ca.gt, cb.gt),
            },
        }
        .with_restitution(a.restitution.min(b.restitution))
    }

    fn with_restitution(mut self, e: f64) -> Self {
        let ln = e.ln();
        self.restitution = e;
        // e = 0 is the limit of critical damping; ln 0 would give infinity over infinity.
        self.damping_ratio = if e > 0.0 { -ln / (ln * ln + PI * PI).sqrt() } else { 1.0 };
        self.pi_over_ln_e_squared = (PI / ln) * (PI / ln);
        self
    }

    fn replace(mut self, by: &PairOverride) -> Self {
        self.friction = by.friction.unwrap_or(self.friction);
        self.rolling_friction = by.rolling_friction.unwrap_or(self.rolling_friction);
        self.spinning_friction = by.spinning_friction.unwrap_or(self.spinning_friction);
        self.adhesion = by.adhesion.unwrap_or(self.adhesion);
        self.coefficients = by.coefficients.unwrap_or(self.coefficients);
        match by.restitution {
            Some(e) => self.with_restitution(e),
            None => self,
        }
    }
}

/// All pairs of a list of materials.
#[derive(Clone, Debug)]
pub struct PairTable {
    count: usize,
    pairs: Vec<Pair>,
}

impl PairTable {
    /// Works out every pair.
    pub fn new(materials: &[Material], overrides: &[PairOverride]) -> Self {
        let count = materials.len();
        let mut pairs: Vec<Pair> = materials.iter().flat_map(|a| materials.iter().map(|b| Pair::of(a, b))).collect();
        for o in overrides {
            let [a, b] = o.materials;
            pairs[a * count + b] = pairs[a * count + b].replace(o);
            pairs[b * count + a] = pairs[a * count + b];
        }
        Self { count, pairs }
    }
    /// The pair of two materials.
    #[inline(always)]
    pub fn get(&self, a: usize, b: usize) -> &Pair {
        &self.pairs[a * self.count + b]
    }
    /// Place of a pair in [`PairTable::all`].
    pub fn index(&self, a: usize, b: usize) -> usize {
        a * self.count + b
    }
    /// All of them.
    pub fn all(&self) -> &[Pair] {
        &self.pairs
    }
    /// Whether any pair resists rolling or spinning.
    pub fn any_rolling(&self) -> bool {
        self.pairs.iter().any(|p| p.rolling_friction > 0.0 || p.spinning_friction > 0.0)
    }
    /// Whether any pair adheres.
    pub fn any_adhesion(&self) -> bool {
        self.pairs.iter().any(|p| p.adhesion.any())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rigid_partner_leaves_the_other_ones_compliance() {
        let soft = Material { young_modulus: 70e9, poisson_ratio: 0.3, ..Material::default() };
        let rigid = Material { young_modulus: f64::INFINITY, ..soft };
        assert!((Pair::of(&soft, &rigid).e_star - 70e9 / 0.91).abs() < 1.0);
    }

    #[test]
    fn limits_of_restitution_are_finite() {
        let with = |restitution| Material { restitution, ..Material::default() };
        assert_eq!(Pair::of(&with(1.0), &with(1.0)).damping_ratio, 0.0);
        assert_eq!(Pair::of(&with(0.0), &with(1.0)).damping_ratio, 1.0);
        assert!((Pair::of(&with(0.2), &with(1.0)).damping_ratio - 0.4559).abs() < 1e-4);
    }

    #[test]
    fn an_explicit_pair_overrides_the_rules_both_ways() {
        let m = Material::default();
        let o = PairOverride {
            materials: [1, 0],
            restitution: None,
            friction: Some(0.13),
            rolling_friction: None,
            spinning_friction: None,
            adhesion: None,
            coefficients: None,
        };
        let table = PairTable::new(&[m, m], &[o]);
        assert_eq!(table.get(0, 1).friction, 0.13);
        assert_eq!(table.get(1, 0).friction, 0.13);
        assert_eq!(table.get(0, 0).friction, 0.9);
    }
}
