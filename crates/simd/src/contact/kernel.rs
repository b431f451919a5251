//! The kernel, written once for any width.
//!
//! Pairs go through in blocks of [`BLOCK`], in two loops over each block: *place* them (rows gathered, normal, overlap, slip
//! velocity), then *load* them (law, friction, forces). In one loop the chain of roots and quotients of a pair, some 200
//! cycles, would be longer than what a processor looks ahead; in two the chains of several registers full run side by side.
//!
//! Its functions are unsafe for one reason, the instruction set of [`Reals`], and no closure calls into it: a closure
//! would be compiled without that set. SAFETY lines stand where anything else is relied on.
#![allow(clippy::undocumented_unsafe_blocks, clippy::needless_range_loop)]

use super::reals::{Apart, Reals};
use super::{Active, List, Memories, PairTerms, Terms};
use crate::rows::{Force, Row};
use std::mem::MaybeUninit;

/// How many pairs ahead rows are asked for: they lie in other cells, which no hardware prefetcher guesses.
const AHEAD: usize = 48;

/// Pairs that go through the loops together: their intermediate values stay in the first-level cache.
const BLOCK: usize = 64;

/// Where a row holds radius, velocity, 1/mass and angular velocity: see [`Row`].
const R: usize = 3;
const SPEED: usize = 4;
const INV_M: usize = 7;
const TURN: usize = 8;
const MATERIAL: usize = 11;

/// Reals in a row, and in a memory: places of active pairs count reals, which is how processors add them to an address without another
/// instruction.
pub const IN_ROW: u32 = 16;
pub const IN_SLIP: u32 = 4;

/// Narrowest register.
const LEAST: usize = 2;

/// What the kernel is run with.
pub struct Batch<'a> {
    pub terms: &'a Terms<'a>,
    pub active: &'a Active,
    pub rows: &'a [Row],
    pub slip: &'a mut [crate::Slip],
    pub roll: &'a mut [[f64; 3]],
    pub force: &'a mut [Force],
}

/// Functions for one instruction path, compiled for it.
macro_rules! path {
    ($name:ident, $register:ty, $single:ty, $($feature:literal)?) => {
        #[allow(dead_code)]
        pub mod $name {
            use super::*;
            /// # Safety
            /// The processor has what the path needs; the batch's lengths fit the active pairs.
            $(#[target_feature(enable = $feature)])?
            pub unsafe fn loads(batch: &mut Batch) {
                // SAFETY: handed on.
                unsafe { choose::<$register>(batch) }
            }
            /// As `loads`, in single precision behind the overlap.
            ///
            /// # Safety
            /// As `loads`.
            $(#[target_feature(enable = $feature)])?
            pub unsafe fn mixed_loads(batch: &mut Batch) {
                // SAFETY: handed on.
                unsafe { choose::<$single>(batch) }
            }
            /// # Safety
            /// The processor has what the path needs; the list's pairs lie inside its rows, its lengths fit together.
            $(#[target_feature(enable = $feature)])?
            pub unsafe fn near(list: &List, memories: &mut Memories, margin: f64, found: &mut Vec<[u32; 3]>) {
                // SAFETY: handed on.
                unsafe { find::<$register>(list, memories, margin, found) }
            }
        }
    };
}
#[cfg(target_arch = "x86_64")]
path!(portable, super::super::x86::Two, super::super::single::Four32,);
#[cfg(target_arch = "x86_64")]
path!(avx2, super::super::x86::Four, super::super::single::Eight32, "avx2,fma");
#[cfg(target_arch = "x86_64")]
path!(avx512, super::super::x86::Eight, super::super::single::Eight32, "avx512f,avx2,fma");
#[cfg(any(test, not(target_arch = "x86_64")))]
path!(plain, super::super::plain::Plain, super::super::plain::PlainSingle,);

#[inline(always)]
unsafe fn choose<V: Reals>(batch: &mut Batch) {
    // SAFETY: handed on.
    unsafe {
        match (!batch.roll.is_empty(), batch.terms.adhesion, batch.terms.offsets) {
            (false, false, _) => run::<V, false, false, false>(batch),
            (false, true, false) => run::<V, false, true, false>(batch),
            (true, false, _) => run::<V, true, false, false>(batch),
            (true, true, false) => run::<V, true, true, false>(batch),
            (false, true, true) => run::<V, false, true, true>(batch),
            (true, true, true) => run::<V, true, true, true>(batch),
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
unsafe fn run<V: Reals, const ROLL: bool, const ADHESION: bool, const OFFSETS: bool>(batch: &mut Batch) {
    // SAFETY: indices and lengths by the caller.
    unsafe {
        let only = PairTerms::split::<V>([&batch.terms.pairs[0]; MOST]);
        let mut placed = [const { MaybeUninit::<Placed<V>>::uninit() }; BLOCK / LEAST];
        let mut turning = [const { MaybeUninit::<Turning<V>>::uninit() }; BLOCK / LEAST];
        let all = &batch.active.pairs;
        let mut from = 0;
        while from < all.len() {
            let count = (all.len() - from).min(BLOCK);
            let (full, rest) = (count / V::N, count % V::N);
            // The last register's empty places repeat its first pair, and what they yield goes to spare memory.
            let mut last = [[0; 3]; MOST];
            for l in 0..V::N {
                let at = from + full * V::N + if l < rest { l } else { 0 };
                last[l] = *all.get(at).unwrap_or(&[0; 3]);
            }
            for k in 0..full {
                // Far enough ahead for the rows of the next block; the end of the list has nothing ahead.
                let at = from + k * V::N;
                let ahead = all.as_ptr().add(if at + AHEAD + V::N <= all.len() { at + AHEAD } else { at });
                place::<V, ROLL, OFFSETS>(batch, all.as_ptr().add(at), ahead, &mut placed[k], &mut turning[k]);
            }
            if rest > 0 {
                place::<V, ROLL, OFFSETS>(batch, last.as_ptr(), last.as_ptr(), &mut placed[full], &mut turning[full]);
            }
            for k in 0..full {
                let pairs = all.as_ptr().add(from + k * V::N);
                load::<V, ROLL, ADHESION, OFFSETS>(only, batch, pairs, V::N, placed[k].assume_init_ref(), &turning[k]);
            }
            if rest > 0 {
                let at = placed[full].assume_init_ref();
                load::<V, ROLL, ADHESION, OFFSETS>(only, batch, last.as_ptr(), rest, at, &turning[full]);
            }
            from += count;
        }
    }
}

/// Numbers of the pairs that are closer than touching plus `margin`, with the places of their grains; the others forget.
#[inline(always)]
unsafe fn find<V: Reals>(list: &List, memories: &mut Memories, margin: f64, found: &mut Vec<[u32; 3]>) {
    unsafe {
        let rows = list.rows.as_ptr();
        let pairs = list.other.len();
        let first = list.first as u32;
        found.clear();
        found.reserve(pairs + MOST);
        let to = found.as_mut_ptr();
        let margin = V::splat(margin);
        let (mut count, mut p) = (0, 0);
        while p < pairs {
            let filled = (pairs - p).min(V::N);
            let (mut a, mut b) = ([rows.cast::<f64>(); MOST], [rows.cast::<f64>(); MOST]);
            let mut at = [[0; 3]; MOST];
            for l in 0..V::N {
                let q = if l < filled { p + l } else { p };
                let (i, j) = (*list.owner.get_unchecked(q) - first, *list.other.get_unchecked(q) - first);
                (a[l], b[l]) = (rows.add(i as usize).cast(), rows.add(j as usize).cast());
                at[l] = [IN_ROW * i, IN_ROW * j, IN_SLIP * q as u32];
            }
            let (xa, xb) = (V::load4(&a), V::load4(&b));
            let d = sub(three(xa), three(xb));
            let reach = xa[3].add(xb[3]).add(margin);
            let bits = V::bits(V::lt(dot(d, d), reach.mul(reach)));
            for l in 0..filled {
                let mut near = bits >> l & 1;
                // What is offset may hold on further apart: the kernel looks whether it does.
                near |= u32::from(near == 0 && memories.slip.get_unchecked(p + l)[3] < 0.0);
                // SAFETY: count never exceeds the pairs looked at, and there is room for all of them.
                to.add(count).write(at[l]);
                count += near as usize;
                if near == 0 && memories.slip.get_unchecked(p + l)[3] != 0.0 {
                    **memories.slip.get_unchecked_mut(p + l) = [0.0; 4];
                    if let Some(roll) = memories.roll.get_mut(p + l) {
                        *roll = [0.0; 3];
                    }
                }
            }
            p += filled;
        }
        found.set_len(count);
    }
}

#[inline(always)]
fn prefetch<T>(at: *const T) {
    #[cfg(target_arch = "x86_64")]
    // SAFETY: asking for memory ahead reads nothing; SSE is part of x86-64.
    unsafe {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        _mm_prefetch::<_MM_HINT_T0>(at.cast());
        if size_of::<T>() > 64 {
            _mm_prefetch::<_MM_HINT_T0>(at.cast::<i8>().wrapping_add(64));
        }
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = at;
}

/// Where a register full of pairs is: what every law needs.
struct Placed<V> {
    n: Vec3<V>,
    delta: V,
    /// Levers of the two grains.
    lever: [V; 2],
    r_eff: V,
    m_eff: V,
    smaller: V,
    /// Separation speed, slip velocity, mean spin about the normal.
    vn: V,
    vt: Vec3<V>,
    spin: V,
}

/// What rolling needs on top.
struct Turning<V> {
    inertia: V,
    w_rel: Vec3<V>,
    tilt: Vec3<V>,
}

/// Gathers rows and works out the kinematics.
#[inline(always)]
unsafe fn place<V: Reals, const ROLL: bool, const OFFSETS: bool>(
    batch: &Batch,
    pairs: *const [u32; 3],
    ahead: *const [u32; 3],
    placed: &mut MaybeUninit<Placed<V>>,
    turning: &mut MaybeUninit<Turning<V>>,
) {
    unsafe {
        let rows = batch.rows.as_ptr();
        let (mut a, mut b) = ([rows.cast::<f64>(); MOST], [rows.cast::<f64>(); MOST]);
        for l in 0..V::N {
            let [i, j, _] = *pairs.add(l);
            (a[l], b[l]) = (row_at(rows, i), row_at(rows, j));
            let [_, j, p] = *ahead.add(l);
            prefetch(row_at(rows, j).cast::<Row>());
            prefetch(batch.slip.as_ptr().cast::<f64>().add(p as usize).cast::<crate::Slip>());
        }
        let apart = V::apart(&a, &b);
        let [dvx, dvy, dvz, inv_m] = V::difference(&part(&a, SPEED), &part(&b, SPEED));
        let (wa, wb) = (quarter::<V>(&a, TURN), quarter::<V>(&b, TURN));
        let half = V::splat(0.5);
        let Apart { d, d2, reach, .. } = apart;
        let ra = V::load1(&part(&a, R));
        let rb = reach.sub(ra);
        let dist = d2.sqrt();
        // One division for three reciprocals, beside the root and not after it.
        let inverse = V::splat(1.0).div(d2.mul(inv_m.mul(reach)));
        let inv_dist = dist.mul(inverse.mul(inv_m.mul(reach)));
        let n = scale(inv_dist, d);
        // Zero, and with it every force, where the two do not touch.
        let mut delta = V::overlap(&apart, dist);
        let mut lens = delta;
        if OFFSETS {
            // As the root of what differs in the squares, which single precision keeps; negative where they stand apart.
            lens = apart.gap.div(reach.add(dist));
            let mut memory = [batch.slip.as_ptr().cast::<f64>(); MOST];
            for l in 0..V::N {
                // SAFETY: the fourth real of the pair's memory.
                memory[l] = memory[l].add((*pairs.add(l))[2] as usize + 3);
            }
            let zero = V::splat(0.0);
            let offset = zero.max(zero.sub(V::load1(&memory))).mul(reach);
            delta = zero.max(lens.add(offset));
        }
        let (la, lb) = (half.fnma(lens, ra), half.fnma(lens, rb));
        let (dv, wa, wb) = ([dvx, dvy, dvz], three(wa), three(wb));
        let v = sub(dv, cross(add_scaled(scale(la, wa), lb, wb), n));
        let vn = dot(v, n);
        placed.write(Placed {
            n,
            delta,
            lever: [la, lb],
            r_eff: ra.mul(rb).mul(inverse.mul(d2.mul(inv_m))),
            m_eff: inverse.mul(d2.mul(reach)),
            smaller: ra.min(rb),
            vn,
            vt: add_scaled(v, V::splat(0.0).sub(vn), n),
            spin: half.mul(dot(wa, n).add(dot(wb, n))),
        });
        if ROLL {
            let (ra2, rb2) = (ra.mul(ra), rb.mul(rb));
            let (inv_a, inv_b) = (V::load1(&part(&a, INV_M)), V::load1(&part(&b, INV_M)));
            turning.write(Turning {
                // 1/(1/(m1 r1^2) + 1/(m2 r2^2)).
                inertia: ra2.mul(rb2).div(inv_a.fma(rb2, inv_b.mul(ra2))),
                w_rel: sub(wa, wb),
                tilt: scale(inv_dist, cross(n, dv)),
            });
        }
    }
}

/// Law, friction, memories; adds the loads of the first `filled` pairs.
#[inline(always)]
unsafe fn load<V: Reals, const ROLL: bool, const ADHESION: bool, const OFFSETS: bool>(
    only: Split<V>,
    batch: &mut Batch,
    pairs: *const [u32; 3],
    filled: usize,
    c: &Placed<V>,
    turning: &MaybeUninit<Turning<V>>,
) {
    unsafe {
        let terms = batch.terms;
        let zero = V::splat(0.0);
        let h = V::splat(terms.h);
        let (mut spare_slip, mut spare_roll, mut spare_force) = ([0.0_f64; 4], [0.0_f64; 3], [0.0_f64; 8]);
        let (forces, slips, rolls) = (batch.force.as_mut_ptr(), batch.slip.as_mut_ptr(), batch.roll.as_mut_ptr());
        let mut slip_at = [spare_slip.as_mut_ptr(); MOST];
        let mut roll_at = [spare_roll.as_mut_ptr(); MOST];
        let (mut on_a, mut on_b) = ([spare_force.as_mut_ptr(); MOST], [spare_force.as_mut_ptr(); MOST]);
        for l in 0..V::N {
            if l < filled {
                let [i, j, p] = (*pairs.add(l)).map(|x| x as usize);
                slip_at[l] = slips.cast::<f64>().add(p);
                // Half as many reals as a row has.
                on_a[l] = forces.cast::<f32>().add(i).cast();
                on_b[l] = forces.cast::<f32>().add(j).cast();
                if ROLL {
                    roll_at[l] = rolls.add(p / IN_SLIP as usize).cast();
                }
            }
        }
        let pair = if terms.materials == 1 {
            only
        } else {
            let mut of = [&terms.pairs[0]; MOST];
            for l in 0..V::N {
                let [i, j, _] = (*pairs.add(l)).map(|x| *row_at(batch.rows.as_ptr(), x).add(MATERIAL) as usize);
                of[l] = &terms.pairs[i * terms.materials + j];
            }
            PairTerms::split::<V>(of)
        };
        let (n, delta, r_eff, vt, spin) = (c.n, c.delta, c.r_eff, c.vt, c.spin);
        let touching = V::lt(zero, delta);
        let contact_radius = r_eff.mul(delta).sqrt();
        let sn = pair.normal.mul(contact_radius);
        let kt = pair.tangential.mul(contact_radius);
        let kn = V::splat(2.0 / 3.0).mul(sn);
        let gn = pair.damping.mul(sn.mul(c.m_eff).sqrt());
        let gt = gn.mul(pair.damping_ratio);
        // In this order of arguments a NaN survives the maximum: the gate at the rebuild finds it.
        let repulsive = V::splat(terms.least_normal).max(gn.fnma(c.vn, kn.mul(delta)));
        let push = zero.max(repulsive);

        let slip = V::load4(&slip_at.map(<*mut f64>::cast_const));
        let (mut normal, mut remembered) = (repulsive, V::splat(1.0));
        if ADHESION {
            let mut grown = slip[3].add(V::splat(terms.adhesion_growth)).min(V::splat(1.0));
            remembered = grown;
            if OFFSETS {
                let offset = V::lt(slip[3], zero);
                grown = V::select(offset, V::splat(1.0), grown);
                remembered = V::select(offset, slip[3], grown);
            }
            let by_overlap = delta.mul(V::splat(terms.adhesion_per_overlap)).min(V::splat(1.0));
            let full = pair.dmt.fma(r_eff.sqrt(), pair.constant);
            let full = pair.pressure.fma(c.smaller.mul(c.smaller), pair.perko.fma(r_eff, full));
            normal = grown.mul(by_overlap).fnma(full.mul(V::splat(terms.adhesion_scale)), repulsive);
            // Zero overlap by an infinite slope is no number.
            normal = V::select(touching, normal, zero);
        }

        // The slider in series with spring and dashpot: `contact.rs` of the reference says why.
        let limit = pair.friction.mul(push);
        let old = three(slip);
        let turned = add_scaled(old, h.mul(spin), cross(n, old));
        let kept = add_scaled(turned, zero.sub(dot(turned, n)), n);
        let mut u = add_scaled(kept, h, vt);
        let trial = add_scaled(scale(kt, u), gt, vt);
        let (trial2, limit2) = (dot(trial, trial), limit.mul(limit));
        let mut tangential = scale(V::splat(-1.0), trial);
        let slides = V::lt(limit2, trial2);
        if V::bits(slides) != 0 {
            let inv = V::splat(1.0).div(trial2.sqrt());
            let direction = scale(inv, trial);
            let relaxed = add_scaled(scale(gt, kept), h.mul(limit), direction);
            let relaxed = scale(V::splat(1.0).div(kt.fma(h, gt)), relaxed);
            u = choose3(slides, scale(cut(limit, scale(kt, relaxed)), relaxed), u);
            tangential = choose3(slides, scale(zero.sub(limit), direction), tangential);
        }
        let u = choose3(touching, u, [zero; 3]);
        V::store4([u[0], u[1], u[2], V::select(touching, remembered, zero)], &slip_at);

        let f = add_scaled(tangential, normal, n);
        let q = cross(n, tangential);
        let (mut ta, mut tb) = (scale(zero.sub(c.lever[0]), q), scale(zero.sub(c.lever[1]), q));
        if ROLL {
            let turning = turning.assume_init_ref();
            let rho = V::load3(&roll_at.map(<*mut f64>::cast_const));
            let w_rel = turning.w_rel;
            let frame = add_scaled(turning.tilt, spin, n);
            let now = add_scaled(add_scaled(rho, h, cross(frame, rho)), h, w_rel);
            let (rho_n, w_n) = (dot(now, n), dot(w_rel, n));
            let rho_t = add_scaled(now, zero.sub(rho_n), n);
            let w_t = add_scaled(w_rel, zero.sub(w_n), n);
            let damping = V::splat(-2.0 * terms.rolling_damping);
            let (arm, share) = (pair.rolling.mul(r_eff), V::splat(1.4).mul(turning.inertia));
            let (rho_t, torque_t) = resist(kn, arm, push, share, damping, rho_t, w_t);
            let (arm, share) = (pair.spinning.mul(r_eff), V::splat(0.4).mul(turning.inertia));
            let (rho_n, torque_n) = resist(kn, arm, push, share, damping, scale(rho_n, n), scale(w_n, n));
            let one = V::splat(1.0);
            let couple = add_scaled(torque_t, one, torque_n);
            ta = add_scaled(ta, one, couple);
            tb = sub(tb, couple);
            V::store3(add_scaled(rho_t, one, rho_n), &roll_at);
        }

        let back = [zero.sub(f[0]), zero.sub(f[1]), zero.sub(f[2])];
        V::add_both([f[0], f[1], f[2], zero], [back[0], back[1], back[2], zero], &on_a, &on_b);
        for l in 0..V::N {
            (on_a[l], on_b[l]) = (on_a[l].add(4), on_b[l].add(4));
        }
        V::add_both([ta[0], ta[1], ta[2], zero], [tb[0], tb[1], tb[2], zero], &on_a, &on_b);
    }
}

/// Address of the row whose place counts reals.
#[inline(always)]
unsafe fn row_at(rows: *const Row, place: u32) -> *const f64 {
    // SAFETY: places lie inside the rows.
    unsafe { rows.cast::<f64>().add(place as usize) }
}

/// Addresses of an entry of the rows at these addresses.
#[inline(always)]
unsafe fn part(rows: &[*const f64; MOST], entry: usize) -> [*const f64; MOST] {
    // SAFETY: every address given is that of a whole row.
    rows.map(|at| unsafe { at.add(entry) })
}

/// Four entries, from `entry` on, of the rows at these addresses.
#[inline(always)]
unsafe fn quarter<V: Reals>(rows: &[*const f64; MOST], entry: usize) -> [V; 4] {
    unsafe { V::load4(&part(rows, entry)) }
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
            let mut at = [std::ptr::from_ref(of[0]).cast::<f64>(); MOST];
            for l in 1..V::N {
                at[l] = std::ptr::from_ref(of[l]).cast::<f64>();
            }
            let [normal, tangential, damping, damping_ratio] = quarter::<V>(&at, 0);
            let [friction, rolling, spinning, _] = quarter::<V>(&at, 4);
            let [constant, dmt, perko, pressure] = quarter::<V>(&at, 8);
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
