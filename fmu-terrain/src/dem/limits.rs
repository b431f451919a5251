//! What a setup must hold to, and the critical step.
//!
//! Critical step = factor x sqrt(m*/k_n), the smallest over all materials and radii, k_n at the largest overlap
//! expected (a fraction of the smaller radius, or where adhesion presses the two to, if that is more). The factor 0.2: a grain rolling between two others swings at 1.7
//! times the frequency of a normal contact (Mindlin's tangential stiffness on 2/7 of the mass), with six contacts at
//! another 1.7; explicit integration then needs h < 2 / (1.7 x 1.7 x 1.22) = 0.57 sqrt(m*/k_n), and about a third of
//! that to be accurate.

use super::engine::Setup;
use super::error::DemError;
use super::grains::{Grain, INV_M, MATERIAL, R, Row};
use super::law::{Form, LawKind, terms_of};
use super::material::PairTable;

/// Default factor on sqrt(m*/k_n).
pub const STEP_FACTOR: f64 = 0.2;

/// Critical step of a setup for these grains (s), with the overlap it holds for and the contact that decides.
#[derive(Clone, Debug, PartialEq)]
pub struct Critical {
    /// Step (s).
    pub step: f64,
    /// Overlap (m).
    pub overlap: f64,
    /// Which contact, in words.
    pub contact: String,
}

/// Checks setup and grains.
///
/// # Errors
/// The first parameter outside its range, or a step above the critical one.
pub fn check(setup: &Setup, grains: &[Grain]) -> Result<(), DemError> {
    for (i, g) in grains.iter().enumerate() {
        if !(g.radius > 0.0 && g.radius.is_finite()) {
            return Err(DemError::parameter(
                format!("radius of grain {i}"),
                g.radius,
                "a finite number greater than 0 [m]",
            ));
        }
        if !(g.density > 0.0 && g.density.is_finite()) {
            let what = format!("density of grain {i}");
            return Err(DemError::parameter(what, g.density, "a finite number greater than 0 [kg/m3]"));
        }
        if g.material >= setup.materials.len() {
            let allowed = format!("0 to {}", setup.materials.len().saturating_sub(1));
            return Err(DemError::parameter(format!("material of grain {i}"), g.material, allowed));
        }
    }
    let rows: Vec<Row> = grains.iter().map(Grain::row).collect();
    check_rows(setup, &rows)
}

/// As [`check`] for rows.
///
/// # Errors
/// As [`check`].
pub fn check_rows(setup: &Setup, rows: &[Row]) -> Result<(), DemError> {
    let positive = |what: &str, x: f64| {
        if x.is_finite() && x > 0.0 {
            Ok(())
        } else {
            Err(DemError::parameter(what, x, "a finite number greater than 0"))
        }
    };
    positive("step", setup.step)?;
    positive("skin", setup.skin)?;
    positive("expected overlap", setup.expected_overlap)?;
    positive("step factor", setup.step_factor)?;
    if let Some(length) = setup.period {
        let least = super::period::LEAST * super::period::greatest(rows);
        if !(length.is_finite() && length >= least) {
            return Err(DemError::parameter("period", length, format!("a finite number of at least {least} m")));
        }
        if setup.sleep.is_some() {
            return Err(DemError::parameter("sleep", "set", "none in a bed that repeats itself"));
        }
    }
    if setup.materials.is_empty() {
        return Err(DemError::parameter("materials", "an empty list", "at least one material"));
    }
    for (k, m) in setup.materials.iter().enumerate() {
        let within = |what: &str, x: f64, low: f64, high: f64| {
            if x >= low && x <= high {
                Ok(())
            } else {
                Err(DemError::parameter(format!("{what} of material {k}"), x, format!("{low} to {high}")))
            }
        };
        within("Young's modulus", m.young_modulus, f64::MIN_POSITIVE, f64::INFINITY)?;
        within("Poisson's ratio", m.poisson_ratio, -1.0, 0.5)?;
        within("restitution", m.restitution, 0.0, 1.0)?;
        within("friction", m.friction, 0.0, 1e3)?;
        within("rolling friction", m.rolling_friction, 0.0, 1e3)?;
        within("spinning friction", m.spinning_friction, 0.0, 1e3)?;
        for (what, x) in [
            ("adhesion", m.adhesion.constant),
            ("DMT adhesion", m.adhesion.dmt),
            ("Perko adhesion", m.adhesion.perko),
            ("cohesive pressure", m.adhesion.pressure),
        ] {
            within(what, x, 0.0, f64::MAX)?;
        }
        if setup.law == LawKind::Flores && setup.form == Form::Properties && m.restitution == 0.0 {
            return Err(DemError::parameter(
                format!("restitution of material {k}"),
                0,
                "above 0 for the law of Flores",
            ));
        }
    }
    match critical(setup, rows) {
        Some(c) if setup.step > c.step => Err(DemError::StepTooLarge {
            step: setup.step,
            critical: c.step,
            factor: setup.step_factor,
            overlap: c.overlap,
            pair: c.contact,
        }),
        _ => Ok(()),
    }
}

/// The critical step; none without a free grain.
pub fn critical(setup: &Setup, rows: &[Row]) -> Option<Critical> {
    let pairs = PairTable::new(&setup.materials, &setup.overrides);
    // Of each material, the lightest free grain is decisive: m*/k_n falls with the radius for every law.
    let lightest: Vec<Option<&Row>> = (0..setup.materials.len())
        .map(|m| {
            rows.iter()
                .filter(|r| r[MATERIAL] as usize == m && r[INV_M] > 0.0)
                .max_by(|a, b| a[INV_M].total_cmp(&b[INV_M]))
        })
        .collect();
    let mut least: Option<Critical> = None;
    for (a, row) in lightest.iter().enumerate() {
        let Some(row) = row else { continue };
        // Any material may be a wall's or a body's: flat and infinitely heavy.
        let flat = (0..setup.materials.len()).map(|b| (b, row[R], 1.0 / row[INV_M], "a wall or body"));
        let grains = lightest.iter().enumerate().filter_map(|(b, other)| {
            other.map(|o| (b, row[R] * o[R] / (row[R] + o[R]), 1.0 / (row[INV_M] + o[INV_M]), "a grain"))
        });
        for (b, r_eff, m_eff, what) in grains.chain(flat) {
            let kn = |overlap: f64| terms_of(setup.law, setup.form, pairs.get(a, b), overlap, r_eff, m_eff, 0.0).kn;
            // Adhesion presses grains together further than weight does: to where the spring balances it.
            let pull = &pairs.get(a, b).adhesion;
            let pull = pull.constant
                + pull.dmt * r_eff.sqrt()
                + pull.perko * r_eff
                + std::f64::consts::PI * row[R] * row[R] * pull.pressure;
            let mut overlap = setup.expected_overlap * row[R];
            // A fixed point of k_n(x) x = pull: no law's k_n grows so fast with the overlap that this would not close in on it.
            let mut balance = overlap;
            for _ in 0..if pull > 0.0 { 60 } else { 0 } {
                balance = (balance * pull / kn(balance)).sqrt().min(row[R]);
            }
            overlap = overlap.max(balance);
            let kn = kn(overlap);
            let step = setup.step_factor * (m_eff / kn).sqrt();
            if least.as_ref().is_none_or(|l| step < l.step) {
                let contact = format!("a grain of radius {:.3e} m, material {a}, with {what} of material {b}", row[R]);
                least = Some(Critical { step, overlap, contact });
            }
        }
    }
    least
}
