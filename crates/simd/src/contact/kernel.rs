//! The kernel, written once for any width.
//!
//! Its functions are unsafe for one reason, the instruction set of [`Reals`], and no closure calls into it: a closure
//! would be compiled without that set. SAFETY lines stand where anything else is relied on.
#![allow(clippy::undocumented_unsafe_blocks, clippy::needless_range_loop)]

use super::avx2::Four;
use super::avx512::Eight;
use super::reals::Reals;
use super::{Batch, PairTerms, Terms};
use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};

/// How many pairs ahead rows are asked for: they lie in other cells, which no hardware prefetcher guesses.
const AHEAD: usize = 24;

/// # Safety
/// The processor has AVX2 and FMA; the batch's lengths fit together.
#[target_feature(enable = "avx2,fma")]
pub unsafe fn avx2(terms: &Terms, batch: &mut Batch) {
    // SAFETY: handed on.
    unsafe { choose::<Four>(terms, batch) }
}

/// # Safety
/// The processor has AVX-512 F, AVX2 and FMA; the batch's lengths fit together.
#[target_feature(enable = "avx512f,avx2,fma")]
pub unsafe fn avx512(terms: &Terms, batch: &mut Batch) {
    // SAFETY: handed on.
    unsafe { choose::<Eight>(terms, batch) }
}

#[inline(always)]
unsafe fn choose<V: Reals>(terms: &Terms, batch: &mut Batch) {
    // SAFETY: handed on.
    unsafe {
        match (!batch.roll.is_empty(), terms.adhesion) {
            (false, false) => run::<V, false, false>(terms, batch),
            (false, true) => run::<V, false, true>(terms, batch),
            (true, false) => run::<V, true, false>(terms, batch),
            (true, true) => run::<V, true, true>(terms, batch),
        }
    }
}

/// Three components.
type Vec3<V> = [V; 3];

#[inline(always)]
unsafe fn dot<V: Reals>(a: Vec3<V>, b: Vec3<V>) -> V {
    unsafe { a[2].fma(b[2], a[1].fma(b[1], a[0].mul(b[0]))) }
}

#[inline(always)]
unsafe fn cross<V: Reals>(a: Vec3<V>, b: Vec3<V>) -> Vec3<V> {
    unsafe { [a[2].fnma(b[1], a[1].mul(b[2])), a[0].fnma(b[2], a[2].mul(b[0])), a[1].fnma(b[0], a[0].mul(b[1]))] }
}

/// a + s b
#[inline(always)]
unsafe fn add_scaled<V: Reals>(a: Vec3<V>, s: V, b: Vec3<V>) -> Vec3<V> {
    unsafe { [s.fma(b[0], a[0]), s.fma(b[1], a[1]), s.fma(b[2], a[2])] }
}

#[inline(always)]
unsafe fn sub<V: Reals>(a: Vec3<V>, b: Vec3<V>) -> Vec3<V> {
    unsafe { [a[0].sub(b[0]), a[1].sub(b[1]), a[2].sub(b[2])] }
}

#[inline(always)]
unsafe fn scale<V: Reals>(s: V, a: Vec3<V>) -> Vec3<V> {
    unsafe { [s.mul(a[0]), s.mul(a[1]), s.mul(a[2])] }
}

#[inline(always)]
unsafe fn choose3<V: Reals>(mask: V::Mask, a: Vec3<V>, b: Vec3<V>) -> Vec3<V> {
    unsafe { [V::select(mask, a[0], b[0]), V::select(mask, a[1], b[1]), V::select(mask, a[2], b[2])] }
}

#[inline(always)]
fn three<V: Copy>(a: [V; 4]) -> Vec3<V> {
    [a[0], a[1], a[2]]
}

/// Widest register.
const MOST: usize = 8;

#[inline(always)]
unsafe fn run<V: Reals, const ROLL: bool, const ADHESION: bool>(terms: &Terms, batch: &mut Batch) {
    let (first, end) = (batch.first as u32, (batch.first + batch.force.len()) as u32);
    // In one pass ahead: a check per pair would stand in the way of the loads.
    let mut inside = true;
    for (&i, &j) in batch.owner.iter().zip(batch.other) {
        inside &= (i >= first) & (i < end) & (j >= first) & (j < end);
    }
    assert!(inside, "a pair names a grain outside {first}..{end}");
    // SAFETY: indices checked above, lengths by the caller.
    unsafe {
        let only = PairTerms::split::<V>([&terms.pairs[0]; MOST]);
        let pairs = batch.other.len();
        let mut p = 0;
        while p + V::N <= pairs {
            some::<V, ROLL, ADHESION>(terms, only, batch, p, V::N);
            p += V::N;
        }
        if p < pairs {
            some::<V, ROLL, ADHESION>(terms, only, batch, p, pairs - p);
        }
    }
}

/// `count` pairs from `p`, at most a register full.
#[inline(always)]
unsafe fn some<V: Reals, const ROLL: bool, const ADHESION: bool>(
    terms: &Terms,
    only: Split<V>,
    batch: &mut Batch,
    p: usize,
    count: usize,
) {
    unsafe {
        let rows = batch.rows.as_ptr();
        let forces = batch.force.as_mut_ptr();
        let slips = batch.slip.as_mut_ptr().add(p);
        // The end of the list has nothing ahead.
        let ahead = if p + V::N + AHEAD <= batch.other.len() { AHEAD } else { 0 };
        let [zero, half] = [V::splat(0.0), V::splat(0.5)];
        let h = V::splat(terms.h);
        let (mut spare_slip, mut spare_force) = ([0.0_f64; 4], [0.0_f64; 8]);
        let (mut a, mut b) = ([rows.cast::<f64>(); MOST], [rows.cast::<f64>(); MOST]);
        let (mut on_a, mut on_b) = ([spare_force.as_mut_ptr(); MOST], [spare_force.as_mut_ptr(); MOST]);
        let mut slip_at = [spare_slip.as_mut_ptr(); MOST];
        for l in 0..V::N {
            // The last batch's empty places repeat its first pair, are masked out, and write to spare memory.
            let at = if l < count { p + l } else { p };
            let (i, j) = (*batch.owner.get_unchecked(at) as usize, *batch.other.get_unchecked(at) as usize);
            (a[l], b[l]) = (rows.add(i).cast(), rows.add(j).cast());
            if l < count {
                on_a[l] = forces.add(i - batch.first).cast();
                on_b[l] = forces.add(j - batch.first).cast();
                slip_at[l] = slips.add(l).cast();
            }
            let next: *const i8 = rows.add(*batch.other.get_unchecked(at + ahead) as usize).cast();
            _mm_prefetch::<_MM_HINT_T0>(next);
            _mm_prefetch::<_MM_HINT_T0>(next.add(64));
        }
        let (xa, xb) = (quarter::<V>(&a, 0), quarter::<V>(&b, 0));
        let (va, vb) = (quarter::<V>(&a, 1), quarter::<V>(&b, 1));
        let d = sub(three(xa), three(xb));
        let d2 = dot(d, d);
        let reach = xa[3].add(xb[3]);
        let inv_m = va[3].add(vb[3]);
        let mut touching = V::both(V::lt(d2, reach.mul(reach)), V::lt(zero, inv_m));
        if count < V::N {
            touching = V::both(touching, V::first(count));
        }
        if V::bits(touching) == 0 {
            V::store4([zero; 4], &slip_at);
            if ROLL {
                batch.roll[p..p + count].fill([0.0; 3]);
            }
            return;
        }

        let (wa, wb) = (three(quarter::<V>(&a, 2)), three(quarter::<V>(&b, 2)));
        let pair = if terms.materials == 1 {
            only
        } else {
            let mut of = [&terms.pairs[0]; MOST];
            for l in 0..V::N {
                let (ma, mb) = (*a[l].add(11) as usize, *b[l].add(11) as usize);
                of[l] = &terms.pairs[ma * terms.materials + mb];
            }
            PairTerms::split::<V>(of)
        };
        let dist = d2.sqrt();
        // One division for three reciprocals, beside the root and not after it.
        let inverse = V::splat(1.0).div(d2.mul(inv_m.mul(reach)));
        let inv_dist = dist.mul(inverse.mul(inv_m.mul(reach)));
        let m_eff = inverse.mul(d2.mul(reach));
        let r_eff = xa[3].mul(xb[3]).mul(inverse.mul(d2.mul(inv_m)));
        let n = scale(inv_dist, d);
        let delta = reach.sub(dist);
        let (la, lb) = (half.fnma(delta, xa[3]), half.fnma(delta, xb[3]));
        let dv = sub(three(va), three(vb));
        let v = sub(dv, cross(add_scaled(scale(la, wa), lb, wb), n));
        let vn = dot(v, n);
        let vt = add_scaled(v, zero.sub(vn), n);

        let contact_radius = r_eff.mul(delta).sqrt();
        let sn = pair.normal.mul(contact_radius);
        let kt = pair.tangential.mul(contact_radius);
        let kn = V::splat(2.0 / 3.0).mul(sn);
        let gn = pair.damping.mul(sn.mul(m_eff).sqrt());
        let gt = gn.mul(pair.damping_ratio);
        // In this order of arguments a NaN survives the maximum: the gate at the rebuild finds it.
        let repulsive = V::splat(terms.least_normal).max(gn.fnma(vn, kn.mul(delta)));
        let push = zero.max(repulsive);

        let slip = quarter::<V>(&slip_at.map(<*mut f64>::cast_const), 0);
        let (mut normal, mut grown) = (repulsive, V::splat(1.0));
        if ADHESION {
            grown = slip[3].add(V::splat(terms.adhesion_growth)).min(V::splat(1.0));
            let by_overlap = delta.mul(V::splat(terms.adhesion_per_overlap)).min(V::splat(1.0));
            let smaller = xa[3].min(xb[3]);
            let full = pair.dmt.fma(r_eff.sqrt(), pair.constant);
            let full = pair.pressure.fma(smaller.mul(smaller), pair.perko.fma(r_eff, full));
            normal = grown.mul(by_overlap).fnma(full.mul(V::splat(terms.adhesion_scale)), repulsive);
        }

        // The slider in series with spring and dashpot: `contact.rs` of the reference says why.
        let limit = pair.friction.mul(push);
        let spin = half.mul(dot(wa, n).add(dot(wb, n)));
        let old = three(slip);
        let turned = add_scaled(old, h.mul(spin), cross(n, old));
        let kept = add_scaled(turned, zero.sub(dot(turned, n)), n);
        let mut u = add_scaled(kept, h, vt);
        let trial = add_scaled(scale(kt, u), gt, vt);
        let (trial2, limit2) = (dot(trial, trial), limit.mul(limit));
        let mut tangential = scale(V::splat(-1.0), trial);
        let slides = V::lt(limit2, trial2);
        if V::bits(V::both(slides, touching)) != 0 {
            let inv = V::splat(1.0).div(trial2.sqrt());
            let direction = scale(inv, trial);
            let relaxed = add_scaled(scale(gt, kept), h.mul(limit), direction);
            let relaxed = scale(V::splat(1.0).div(kt.fma(h, gt)), relaxed);
            u = choose3(slides, scale(cut(limit, scale(kt, relaxed)), relaxed), u);
            tangential = choose3(slides, scale(zero.sub(limit), direction), tangential);
        }
        let kept = kept_where::<V>(touching, u);
        V::store4([kept[0], kept[1], kept[2], V::select(touching, grown, zero)], &slip_at);

        let f = add_scaled(tangential, normal, n);
        let q = cross(n, tangential);
        let (mut ta, mut tb) = (scale(zero.sub(la), q), scale(zero.sub(lb), q));
        if ROLL {
            let mut memory = [[0.0_f64; 4]; MOST];
            for l in 0..count {
                memory[l][..3].copy_from_slice(&batch.roll[p + l]);
            }
            let mut at = [std::ptr::null_mut::<f64>(); MOST];
            let mut read = [std::ptr::null::<f64>(); MOST];
            for l in 0..V::N {
                at[l] = memory.as_mut_ptr().add(l).cast();
                read[l] = at[l];
            }
            let rho = three(V::load4(&read));
            let (ra2, rb2) = (xa[3].mul(xa[3]), xb[3].mul(xb[3]));
            // 1/(1/(m1 r1^2) + 1/(m2 r2^2)).
            let inertia = ra2.mul(rb2).div(va[3].fma(rb2, vb[3].mul(ra2)));
            let w_rel = sub(wa, wb);
            let frame = add_scaled(scale(inv_dist, cross(n, dv)), spin, n);
            let now = add_scaled(add_scaled(rho, h, cross(frame, rho)), h, w_rel);
            let (rho_n, w_n) = (dot(now, n), dot(w_rel, n));
            let rho_t = add_scaled(now, zero.sub(rho_n), n);
            let w_t = add_scaled(w_rel, zero.sub(w_n), n);
            let damping = V::splat(-2.0 * terms.rolling_damping);
            let (arm, share) = (pair.rolling.mul(r_eff), V::splat(1.4).mul(inertia));
            let (rho_t, torque_t) = resist(kn, arm, push, share, damping, rho_t, w_t);
            let (arm, share) = (pair.spinning.mul(r_eff), V::splat(0.4).mul(inertia));
            let (rho_n, torque_n) = resist(kn, arm, push, share, damping, scale(rho_n, n), scale(w_n, n));
            let one = V::splat(1.0);
            let rho = add_scaled(rho_t, one, rho_n);
            let couple = add_scaled(torque_t, one, torque_n);
            ta = add_scaled(ta, one, couple);
            tb = sub(tb, couple);
            V::store4(kept_where::<V>(touching, rho), &at);
            for l in 0..count {
                batch.roll[p + l].copy_from_slice(&memory[l][..3]);
            }
        }

        let f = kept_where::<V>(touching, f);
        V::add4(f, &on_a);
        V::add4([zero.sub(f[0]), zero.sub(f[1]), zero.sub(f[2]), zero], &on_b);
        for l in 0..V::N {
            (on_a[l], on_b[l]) = (on_a[l].add(4), on_b[l].add(4));
        }
        V::add4(kept_where::<V>(touching, ta), &on_a);
        V::add4(kept_where::<V>(touching, tb), &on_b);
    }
}

/// Quarter `q` of the rows at these addresses.
#[inline(always)]
unsafe fn quarter<V: Reals>(rows: &[*const f64; MOST], q: usize) -> [V; 4] {
    unsafe {
        let mut at = *rows;
        for l in 0..V::N {
            at[l] = at[l].add(4 * q);
        }
        V::load4(&at)
    }
}

/// A vector where the mask is set, zero elsewhere; a fourth component of zero.
#[inline(always)]
unsafe fn kept_where<V: Reals>(mask: V::Mask, x: Vec3<V>) -> [V; 4] {
    unsafe {
        let zero = V::splat(0.0);
        [V::select(mask, x[0], zero), V::select(mask, x[1], zero), V::select(mask, x[2], zero), zero]
    }
}

/// `limit / |x|` where |x| exceeds it, 1 elsewhere.
#[inline(always)]
unsafe fn cut<V: Reals>(limit: V, x: Vec3<V>) -> V {
    unsafe {
        let x2 = dot(x, x);
        V::select(V::lt(limit.mul(limit), x2), limit.div(x2.sqrt()), V::splat(1.0))
    }
}

/// Spring-dashpot-slider of rolling or spinning: the rotation kept and the torque on grain i.
#[inline(always)]
unsafe fn resist<V: Reals>(
    kn: V,
    arm: V,
    push: V,
    inertia: V,
    damping: V,
    rho: Vec3<V>,
    w: Vec3<V>,
) -> (Vec3<V>, Vec3<V>) {
    unsafe {
        let zero = V::splat(0.0);
        let k = V::splat(2.25).mul(kn).mul(arm).mul(arm);
        let limit = arm.mul(push);
        let rho = scale(cut(limit, scale(k, rho)), rho);
        let dashpot = damping.mul(k.mul(inertia).sqrt());
        let torque = add_scaled(scale(zero.sub(k), rho), dashpot, w);
        let torque = scale(cut(limit, torque), torque);
        // Nothing resists where there is no arm or no push, and nothing is remembered.
        let acts = V::both(V::lt(zero, arm), V::lt(zero, push));
        (choose3(acts, rho, [zero; 3]), choose3(acts, torque, [zero; 3]))
    }
}

/// Terms of the pairs in a register.
#[derive(Clone, Copy)]
struct Split<V> {
    normal: V,
    tangential: V,
    damping: V,
    damping_ratio: V,
    friction: V,
    rolling: V,
    spinning: V,
    constant: V,
    dmt: V,
    perko: V,
    pressure: V,
}

impl PairTerms {
    #[inline(always)]
    unsafe fn split<V: Reals>(of: [&Self; MOST]) -> Split<V> {
        // SAFETY: a PairTerms is 12 reals in the order of its fields.
        unsafe {
            let mut at = [std::ptr::null::<f64>(); MOST];
            for l in 0..V::N {
                at[l] = std::ptr::from_ref(of[l]).cast::<f64>();
            }
            let [normal, tangential, damping, damping_ratio] = quarter::<V>(&at, 0);
            let [friction, rolling, spinning, _] = quarter::<V>(&at, 1);
            let [constant, dmt, perko, pressure] = quarter::<V>(&at, 2);
            Split {
                normal,
                tangential,
                damping,
                damping_ratio,
                friction,
                rolling,
                spinning,
                constant,
                dmt,
                perko,
                pressure,
            }
        }
    }
}
