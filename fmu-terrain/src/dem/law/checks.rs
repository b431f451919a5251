//! Checks that every law passes, through the same door the kernels use.

use super::*;
use crate::dem::contact::{Load, Options, Slip, Touch, evaluate};
use crate::dem::material::{Material, Pair};
use crate::dem::vec3::{Vec3, add, add_scaled, cross, dot, norm, scale, sub};

const R: f64 = 0.006;
const M: f64 = 0.009;

fn pair() -> Pair {
    let m = Material {
        restitution: 0.6,
        friction: 0.5,
        rolling_friction: 0.2,
        spinning_friction: 0.1,
        ..Material::default()
    };
    Pair::of(&m, &m)
}

fn options(tangential: Tangential) -> Options {
    Options {
        h: 1e-6,
        tangential,
        least_normal: f64::NEG_INFINITY,
        adhesion: false,
        offsets: false,
        adhesion_scale: 1.0,
        adhesion_growth: 1.0,
        adhesion_per_overlap: f64::INFINITY,
        rolling_damping: 0.3,
        margin: 0.0,
    }
}

fn touch(n: Vec3, delta: f64, v: Vec3, w_rel: Vec3) -> Touch {
    Touch {
        n,
        delta,
        r_eff: R,
        r_adhesion: 2.0 * R,
        inv_m: 1.0 / M,
        inv_mr2: 1.0 / (M * R * R),
        v,
        w_rel,
        spin: 0.0,
        tilt: [0.0; 3],
        weight: 1.0,
    }
}

fn load(kind: LawKind, form: Form, opt: &Options, t: &Touch, memory: &mut (Slip, [f64; 3])) -> Load {
    dispatch_law!(kind, form, law =>
        evaluate::<_, true>(&law, &pair(), opt, t, &mut memory.0, Some(&mut memory.1)))
}

fn each(check: impl Fn(LawKind, Form)) {
    for kind in LawKind::ALL {
        for form in [Form::Properties, Form::Coefficients] {
            check(kind, form);
        }
    }
}

#[test]
fn nothing_at_zero_overlap_at_rest() {
    each(|kind, form| {
        let opt = options(Tangential::History);
        let t = touch([0.0, 0.0, 1.0], 1e-300, [0.0; 3], [0.0; 3]);
        let l = load(kind, form, &opt, &t, &mut Default::default());
        assert!(l.normal.abs() < 1e-100 && l.tangential == [0.0; 3] && l.couple == [0.0; 3], "{kind:?} {form:?}");
    });
}

#[test]
fn overlap_repels_and_more_overlap_repels_more() {
    each(|kind, form| {
        let opt = options(Tangential::History);
        let at =
            |delta| load(kind, form, &opt, &touch([1.0, 0.0, 0.0], delta, [0.0; 3], [0.0; 3]), &mut Default::default());
        assert!(at(1e-4).normal > 0.0 && at(2e-4).normal > at(1e-4).normal, "{kind:?} {form:?}");
    });
}

#[test]
fn friction_opposes_slip_within_the_coulomb_limit() {
    each(|kind, form| {
        for tangential in [Tangential::None, Tangential::OneStep, Tangential::History] {
            let opt = options(tangential);
            let v = [0.3, -0.2, 0.01];
            let mut memory = Default::default();
            for _ in 0..2000 {
                let l = load(kind, form, &opt, &touch([0.0, 0.0, 1.0], 1e-4, v, [0.0; 3]), &mut memory);
                assert!(norm(l.tangential) <= 0.5 * l.normal * (1.0 + 1e-12), "{kind:?} {form:?} {tangential:?}");
                assert!(dot(l.tangential, v) <= 0.0, "{kind:?} {form:?} {tangential:?}");
                assert!(l.tangential[2].abs() < 1e-12 * l.normal);
            }
        }
    });
}

/// A frame turned by 0.9 rad about a skew axis.
fn turned(x: Vec3) -> Vec3 {
    crate::dem::cylinder::rotate([0.3, -0.6, 0.6], x)
}

#[test]
fn a_turned_observer_sees_turned_forces() {
    each(|kind, form| {
        let opt = options(Tangential::History);
        let (mut a, mut b) = (Default::default(), Default::default());
        for k in 0..500 {
            let v = [0.01 * (0.02 * f64::from(k)).sin(), 0.02, -0.01];
            let w = [1.0, -2.0, 0.5];
            let one = load(kind, form, &opt, &touch([0.0, 0.0, 1.0], 1e-4, v, w), &mut a);
            let t = touch(turned([0.0, 0.0, 1.0]), 1e-4, turned(v), turned(w));
            let two = load(kind, form, &opt, &t, &mut b);
            assert!((one.normal - two.normal).abs() < 1e-9 * one.normal);
            assert!(norm(sub(turned(one.tangential), two.tangential)) < 1e-9 * one.normal, "{kind:?} {form:?}");
            assert!(norm(sub(turned(one.couple), two.couple)) < 1e-9 * one.normal * R, "{kind:?} {form:?}");
        }
    });
}

#[test]
fn a_pair_that_turns_as_one_keeps_its_force_in_its_own_frame() {
    // Loaded tangentially, then both turn about a skew axis for one radian: the friction must turn with them.
    each(|kind, form| {
        if kind == LawKind::PlainCoulomb {
            return;
        }
        let opt = options(Tangential::History);
        let mut memory = Default::default();
        let n = [0.0, 0.0, 1.0];
        for _ in 0..100 {
            load(kind, form, &opt, &touch(n, 1e-4, [0.01, 0.0, 0.0], [0.2, 0.0, 0.1]), &mut memory);
        }
        let rest = load(kind, form, &opt, &touch(n, 1e-4, [0.0; 3], [0.0; 3]), &mut memory);
        let w = scale(1000.0, [2.0 / 3.0, 1.0 / 3.0, 2.0 / 3.0]);
        let mut last = rest;
        for k in 1..=1000 {
            let n = crate::dem::cylinder::rotate(scale(opt.h * f64::from(k), w), n);
            let tilt = cross(n, cross(w, n));
            let t = Touch { spin: dot(w, n), tilt, ..touch(n, 1e-4, [0.0; 3], [0.0; 3]) };
            last = load(kind, form, &opt, &t, &mut memory);
        }
        let expected = crate::dem::cylinder::rotate(scale(opt.h * 1000.0, w), rest.tangential);
        assert!(norm(expected) > 0.0);
        let error = norm(sub(expected, last.tangential)) / norm(expected);
        assert!(error < 2e-3, "{kind:?} {form:?} {error}");
        let expected = crate::dem::cylinder::rotate(scale(opt.h * 1000.0, w), rest.couple);
        let error = norm(sub(expected, last.couple)) / norm(expected);
        assert!(error < 5e-3, "{kind:?} {form:?} {error}");
    });
}

#[test]
fn a_closed_tangential_cycle_makes_no_energy() {
    each(|kind, form| {
        for amplitude in [1e-6, 1e-4] {
            let opt = options(Tangential::History);
            let mut memory = Default::default();
            let mut work = 0.0;
            let n = 20_000;
            for k in 0..n {
                let phase = std::f64::consts::TAU * f64::from(k) / f64::from(n) * 4.0;
                let rate = amplitude * 4.0 * std::f64::consts::TAU / (f64::from(n) * opt.h);
                let v = [rate * phase.cos(), 0.5 * rate * phase.sin(), 0.0];
                let w = [100.0 * rate * phase.cos(), 0.0, 50.0 * rate * phase.sin()];
                let l = load(kind, form, &opt, &touch([0.0, 0.0, 1.0], 1e-4, v, w), &mut memory);
                work += opt.h * (dot(l.tangential, v) + dot(l.couple, w));
            }
            assert!(work <= 1e-12, "{kind:?} {form:?} {amplitude}: {work}");
        }
    });
}

#[test]
fn a_bounce_makes_no_energy() {
    each(|kind, form| {
        // A small mass falls on a flat: speed after is never above speed before.
        let opt = options(Tangential::History);
        let (mut x, mut v) = (0.0_f64, -0.5_f64);
        let mut memory = Default::default();
        for _ in 0..2_000_000 {
            let l =
                load(kind, form, &opt, &touch([0.0, 0.0, 1.0], -x.min(-1e-12), [0.0, 0.0, v], [0.0; 3]), &mut memory);
            v += opt.h * l.normal / M;
            x += opt.h * v;
            if x > 0.0 {
                break;
            }
        }
        assert!(x > 0.0 && v > 0.0 && v <= 0.5 + 1e-9, "{kind:?} {form:?}: {x} {v}");
    });
}

#[test]
fn adhesion_pulls_and_adds_to_the_coulomb_limit() {
    each(|kind, form| {
        let material = Material {
            friction: 0.5,
            adhesion: crate::dem::Adhesion { constant: 3.0, ..Default::default() },
            ..Material::default()
        };
        let pair = Pair::of(&material, &material);
        let mut opt = options(Tangential::History);
        opt.adhesion = true;
        let (mut slip, mut l) = (Slip::default(), None);
        for _ in 0..50_000 {
            let t = touch([0.0, 0.0, 1.0], 1e-4, [1.0, 0.0, 0.0], [0.0; 3]);
            l = Some(dispatch_law!(kind, form, law => evaluate::<_, false>(&law, &pair, &opt, &t, &mut slip, None)));
        }
        let l = l.unwrap();
        let full = add(add_scaled([0.0; 3], l.normal, [0.0, 0.0, 1.0]), l.tangential);
        assert!(full[0] < 0.0);
        // mu (F_net + A) = mu (F_n): the limit holds the adhesion's share too.
        let limit = 0.5 * (l.normal + 3.0);
        let reached = norm(l.tangential) / limit;
        assert!((reached - 1.0).abs() < 1e-3, "{kind:?} {form:?}: {reached}");
    });
}

/// Every law, form, way of following the displacement, and kind of adhesion.
fn every(check: impl Fn(LawKind, Form, Tangential, crate::dem::Adhesion)) {
    let none = crate::dem::Adhesion::default();
    let adhesions = [
        none,
        crate::dem::Adhesion { constant: 2.0, ..none },
        crate::dem::Adhesion { dmt: 20.0, ..none },
        crate::dem::Adhesion { perko: 300.0, ..none },
        crate::dem::Adhesion { pressure: 5e3, ..none },
    ];
    each(|kind, form| {
        for tangential in [Tangential::None, Tangential::OneStep, Tangential::History] {
            adhesions.iter().for_each(|a| check(kind, form, tangential, *a));
        }
    });
}

/// A contact of a law with adhesion: load after a step.
fn sticky(
    (kind, form, tangential, adhesion): (LawKind, Form, Tangential, crate::dem::Adhesion),
    t: &Touch,
    memory: &mut (Slip, [f64; 3]),
) -> Load {
    let material = Material { restitution: 0.6, friction: 0.5, rolling_friction: 0.2, adhesion, ..Material::default() };
    let opt = Options { adhesion: adhesion != crate::dem::Adhesion::default(), ..options(tangential) };
    let pair = Pair::of(&material, &material);
    dispatch_law!(kind, form, law => evaluate::<_, true>(&law, &pair, &opt, t, &mut memory.0, Some(&mut memory.1)))
}

#[test]
fn the_normal_force_is_the_slope_of_an_energy_and_adhesion_shifts_it_by_its_pull() {
    every(|kind, form, tangential, adhesion| {
        let case = (kind, form, tangential, adhesion);
        let force = |delta: f64| {
            sticky(case, &touch([0.0, 0.0, 1.0], delta, [0.0; 3], [0.0; 3]), &mut Default::default()).normal
        };
        let pull = adhesion.constant
            + adhesion.dmt * R.sqrt()
            + adhesion.perko * R
            + std::f64::consts::PI * (2.0 * R).powi(2) * adhesion.pressure;
        // k_n delta^2 times 2/5, or 1/2 for the linear law, less what adhesion has given: `energy.rs` says the same.
        let share = if kind == LawKind::Hooke { 0.5 } else { 0.4 };
        let energy = |delta: f64| share * (force(delta) + pull) * delta - pull * delta;
        for delta in [3e-5, 1e-4, 4e-4] {
            let d = 1e-4 * delta;
            let slope = (energy(delta + d) - energy(delta - d)) / (2.0 * d);
            let off = (slope - force(delta)).abs() / (force(delta).abs() + pull);
            assert!(off < 1e-6, "{case:?} at {delta}: {slope} {}", force(delta));
            let plain = sticky(
                (kind, form, tangential, Default::default()),
                &touch([0.0, 0.0, 1.0], delta, [0.0; 3], [0.0; 3]),
                &mut Default::default(),
            );
            assert!((plain.normal - pull - force(delta)).abs() < 1e-9 * plain.normal, "{case:?}");
        }
    });
}

#[test]
fn the_tangential_stiffness_is_the_slope_of_the_force_while_it_sticks() {
    every(|kind, form, tangential, adhesion| {
        let case = (kind, form, tangential, adhesion);
        if kind == LawKind::PlainCoulomb {
            return;
        }
        let terms = dispatch_law!(kind, form, law => law.terms(&pair(), 1e-4, R, M, 0.0));
        let h = 1e-6;
        let mut memory = Default::default();
        // Slow enough to stick for all steps.
        let v = 1e-3 * 0.5 * 1e-4 / h / 200.0;
        let mut last = 0.0;
        for k in 1..=3 {
            let l = sticky(case, &touch([0.0, 0.0, 1.0], 1e-4, [v, 0.0, 0.0], [0.0; 3]), &mut memory);
            let slope = (last - l.tangential[0]) / (v * h);
            last = l.tangential[0];
            if k == 1 {
                continue;
            }
            let expected = if tangential == Tangential::History { terms.kt } else { 0.0 };
            assert!((slope - expected).abs() <= 1e-6 * terms.kt, "{case:?}: {slope} {expected}");
        }
    });
}

#[test]
fn a_turned_observer_sees_turned_forces_whatever_the_displacement_and_adhesion() {
    every(|kind, form, tangential, adhesion| {
        let case = (kind, form, tangential, adhesion);
        let (mut a, mut b) = (Default::default(), Default::default());
        for k in 0..200 {
            let v = [0.01 * (0.05 * f64::from(k)).sin(), 0.02, -0.01];
            let w = [1.0, -2.0, 0.5];
            let one = sticky(case, &touch([0.0, 0.0, 1.0], 1e-4, v, w), &mut a);
            let two = sticky(case, &touch(turned([0.0, 0.0, 1.0]), 1e-4, turned(v), turned(w)), &mut b);
            let size = one.normal.abs() + norm(one.tangential);
            assert!((one.normal - two.normal).abs() < 1e-9 * size, "{case:?}");
            assert!(norm(sub(turned(one.tangential), two.tangential)) < 1e-9 * size, "{case:?}");
            assert!(norm(sub(turned(one.couple), two.couple)) < 1e-9 * size * R, "{case:?}");
        }
    });
}

#[test]
fn no_closed_cycle_makes_energy_whatever_the_displacement_and_adhesion() {
    every(|kind, form, tangential, adhesion| {
        let case = (kind, form, tangential, adhesion);
        let mut memory = Default::default();
        // Two rounds of overlap and slip out of phase; the first grows adhesion and memory, the second counts.
        let (n, mut work) = (4000, 0.0);
        let h = 1e-6;
        for k in 0..2 * n {
            let phase = std::f64::consts::TAU * f64::from(k) / f64::from(n);
            let rate = std::f64::consts::TAU / (f64::from(n) * h);
            let delta = 2e-4 + 1e-4 * phase.sin();
            // The normal points to the grain: overlap grows as it comes nearer.
            let v = [5e-5 * rate * (phase + 0.7).cos(), 0.0, -1e-4 * rate * phase.cos()];
            let w = [0.02 * rate * phase.cos(), 0.0, 0.01 * rate * phase.sin()];
            let l = sticky(case, &touch([0.0, 0.0, 1.0], delta, v, w), &mut memory);
            if k >= n {
                work += h * (l.normal * v[2] + dot(l.tangential, v) + dot(l.couple, w));
            }
        }
        // Conservative parts sum to the quadrature's error.
        assert!(work < 1e-9, "{case:?}: {work}");
    });
}
