//! The contact kernels of one slab: grain-grain, grain-wall, grain-body. One at a time; the reference for the
//! kernels of [`super::batch`].

use super::body::{Body, BodyLoad, BodyTouch};
use super::contact::{Load, Options, Roll, Slip, Touch, evaluate};
use super::grains::{INV_M, MATERIAL, R, Row, V, W, vec_at};
use super::law::Law;
use super::material::PairTable;
use super::offset::offset;
use super::slab::{BodyPair, Near, Scratch, Slab};
use super::vec3::{Vec3, add, add_scaled, cross, dot, reject, scale, sub};
use super::wall::Wall;
use crate::mesh::inherited;
use terramech_simd::Force;

/// All that the kernels read.
pub struct World<'a> {
    /// Materials in pairs.
    pub pairs: &'a PairTable,
    /// Walls.
    pub walls: &'a [Wall],
    /// Bodies, moved to this step's time.
    pub bodies: &'a [Body],
    /// Batch kernel for grain-grain contacts; none: the loop of this file, the reference.
    pub batch: Option<&'a super::batch::BatchKernel>,
    /// Step and switches.
    pub options: Options,
}

/// Told of every contact: for diagnostics. The kernels take `()` in a run, which costs nothing.
pub trait Observer {
    /// A contact of grain row `i` with `partner`, force on i, normal towards i.
    fn contact(&mut self, i: usize, partner: Partner, touch: &Touch, load: &Load, slip: &Slip);
}

impl Observer for () {
    #[inline(always)]
    fn contact(&mut self, _: usize, _: Partner, _: &Touch, _: &Load, _: &Slip) {}
}

/// With what a grain is in contact.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Partner {
    /// Row of another grain.
    Grain(usize),
    /// Number of a wall.
    Wall(usize),
    /// Number of a body.
    Body(usize),
}

/// All contacts of a slab; `rows` are its grains and those of its halo. Forces and moments are in `scratch.force`, in the
/// same order; loads on bodies and walls are appended.
pub fn contacts<L: Law, const ROLL: bool>(
    law: L,
    world: &World,
    rows: &[Row],
    slab: &mut Slab,
    near: &mut Near,
    scratch: &mut Scratch,
    observer: &mut impl Observer,
) {
    scratch.force.clear();
    // To the number, not to the next power of two: these buffers are what threads add to the memory.
    scratch.force.reserve_exact((slab.halo - slab.first) as usize);
    scratch.force.resize((slab.halo - slab.first) as usize, Force::default());
    match world.batch {
        Some(batch) => batch.run(rows, &world.options, slab, near, scratch),
        None => grain_grain::<L, ROLL>(law, world, rows, slab, scratch, observer),
    }
    grain_wall::<L, ROLL>(law, world, rows, slab, scratch, observer);
    grain_body::<L, ROLL>(law, world, rows, slab, scratch, observer);
}

fn grain_grain<L: Law, const ROLL: bool>(
    law: L,
    world: &World,
    rows: &[Row],
    slab: &mut Slab,
    scratch: &mut Scratch,
    observer: &mut impl Observer,
) {
    let first = slab.first as usize;
    let force = &mut scratch.force[..];
    for i in slab.grains() {
        let a = &rows[i - first];
        let (xa, va, wa) = (vec_at(a, 0), vec_at(a, V), vec_at(a, W));
        let (mut fa, mut ta) = ([0.0; 3], [0.0; 3]);
        let k = i - first;
        let list = slab.start[k] as usize..slab.start[k + 1] as usize;
        let others = &slab.other[list.clone()];
        let slips = &mut slab.slip[list.clone()];
        for (p, (&j, slip)) in others.iter().zip(slips).enumerate() {
            let j = j as usize;
            let b = &rows[j - first];
            let d = sub(xa, vec_at(b, 0));
            let d2 = dot(d, d);
            let reach = a[R] + b[R];
            let inv_m = a[INV_M] + b[INV_M];
            let held = reach + offset(slip, reach);
            if d2 >= held * held || inv_m == 0.0 {
                if slip[3] != 0.0 {
                    *slip = Slip::default();
                    if ROLL {
                        slab.roll[list.start + p] = Roll::default();
                    }
                }
                continue;
            }
            let dist = d2.sqrt();
            let n = scale(1.0 / dist, d);
            let delta = held - dist;
            // The contact point halves the overlap of the spheres: then the levers add up to the distance of the centres, and
            // angular momentum is conserved to round-off.
            let lens = reach - dist;
            let (la, lb) = (a[R] - 0.5 * lens, b[R] - 0.5 * lens);
            let wb = vec_at(b, W);
            let dv = sub(va, vec_at(b, V));
            let v = sub(dv, cross(add_scaled(scale(la, wa), lb, wb), n));
            let r_eff = a[R] * b[R] / reach;
            let touch = Touch {
                n,
                delta,
                r_eff,
                r_adhesion: a[R].min(b[R]),
                inv_m,
                inv_mr2: if ROLL { a[INV_M] / (a[R] * a[R]) + b[INV_M] / (b[R] * b[R]) } else { 0.0 },
                v,
                w_rel: if ROLL { sub(wa, wb) } else { [0.0; 3] },
                spin: 0.5 * dot(add(wa, wb), n),
                tilt: if ROLL { scale(1.0 / dist, cross(n, dv)) } else { [0.0; 3] },
                weight: 1.0,
            };
            let pair = world.pairs.get(a[MATERIAL] as usize, b[MATERIAL] as usize);
            let roll = if ROLL { Some(&mut slab.roll[list.start + p]) } else { None };
            let load = evaluate::<L, ROLL>(&law, pair, &world.options, &touch, slip, roll);
            observer.contact(i, Partner::Grain(j), &touch, &load, slip);
            let f = add_scaled(load.tangential, load.normal, n);
            let q = cross(n, load.tangential);
            fa = add(fa, f);
            ta = add(add_scaled(ta, -la, q), load.couple);
            let o = &mut force[j - first];
            for c in 0..3 {
                o[c] -= f[c];
                o[4 + c] -= lb * q[c] + load.couple[c];
            }
        }
        add_to(&mut force[k], fa, ta);
    }
}

#[inline(always)]
fn add_to(o: &mut Force, f: Vec3, t: Vec3) {
    for c in 0..3 {
        o[c] += f[c];
        o[4 + c] += t[c];
    }
}

/// Kinematics against something flat and infinitely heavy that moves with `v_j`, `w_j` at the contact point; `lever`
/// from the grain's centre to that point.
#[inline(always)]
fn against(row: &Row, n: Vec3, delta: f64, lever: Vec3, v_j: Vec3, w_j: Vec3) -> Touch {
    let w = vec_at(row, W);
    Touch {
        n,
        delta,
        r_eff: row[R],
        r_adhesion: row[R],
        inv_m: row[INV_M],
        inv_mr2: row[INV_M] / (row[R] * row[R]),
        v: sub(add(vec_at(row, V), cross(w, lever)), v_j),
        w_rel: sub(w, w_j),
        spin: 0.5 * dot(add(w, w_j), n),
        tilt: reject(w_j, n),
        weight: 1.0,
    }
}

fn grain_wall<L: Law, const ROLL: bool>(
    law: L,
    world: &World,
    rows: &[Row],
    slab: &mut Slab,
    scratch: &mut Scratch,
    observer: &mut impl Observer,
) {
    let totals = scratch.wall_force.len();
    scratch.wall_force.resize(totals + world.walls.len(), [0.0; 3]);
    for pair in &mut slab.walls {
        let row = &rows[(pair.grain - slab.first) as usize];
        let wall = &world.walls[pair.wall as usize];
        let distance = wall.distance(row);
        let delta = row[R] + offset(&pair.slip, row[R]) - distance;
        if delta <= 0.0 || row[INV_M] == 0.0 {
            pair.slip = Slip::default();
            pair.roll = Roll::default();
            continue;
        }
        let n = wall.normal;
        let lever = scale(-distance, n);
        let touch = against(row, n, delta, lever, [0.0; 3], [0.0; 3]);
        let material = world.pairs.get(row[MATERIAL] as usize, wall.material);
        let load = evaluate::<L, ROLL>(&law, material, &world.options, &touch, &mut pair.slip, Some(&mut pair.roll));
        observer.contact(pair.grain as usize, Partner::Wall(pair.wall as usize), &touch, &load, &pair.slip);
        let f = add_scaled(load.tangential, load.normal, n);
        let t = add(cross(lever, f), load.couple);
        add_to(&mut scratch.force[(pair.grain - slab.first) as usize], f, t);
        let total = &mut scratch.wall_force[totals + pair.wall as usize];
        *total = sub(*total, f);
    }
}

fn grain_body<L: Law, const ROLL: bool>(
    law: L,
    world: &World,
    rows: &[Row],
    slab: &mut Slab,
    scratch: &mut Scratch,
    observer: &mut impl Observer,
) {
    scratch.body_pairs.clear();
    if world.bodies.is_empty() {
        slab.bodies.clear();
        return;
    }
    let mut touches = Vec::new();
    let mut known = &slab.bodies[..];
    for (b, body) in world.bodies.iter().enumerate() {
        let bounds = body.shape.bounds();
        if !may_touch(&bounds, slab) {
            continue;
        }
        let [low, high] = bounds;
        for i in slab.grains() {
            let row = &rows[i - slab.first as usize];
            let r = row[R];
            // Height first: most of the grains under a wheel are below it.
            let inside = [2, 0, 1].into_iter().all(|k: usize| row[k] + r > low[k] && row[k] - r < high[k]);
            if !inside || row[INV_M] == 0.0 {
                continue;
            }
            touches.clear();
            body.shape.touches(vec_at(row, 0), r, &mut touches);
            if touches.is_empty() {
                continue;
            }
            let key = (b as u32, i as u32);
            let from = known.partition_point(|p| (p.body, p.grain) < key);
            let to = from + known[from..].iter().take_while(|p| (p.body, p.grain) == key).count();
            let (f, t) = body_loads::<L, ROLL>(law, world, row, key, &touches, &known[from..to], scratch, observer);
            known = &known[to..];
            add_to(&mut scratch.force[i - slab.first as usize], f, t);
        }
    }
    std::mem::swap(&mut slab.bodies, &mut scratch.body_pairs);
}

/// Whether a body within these bounds may touch grains of a slab.
pub(super) fn may_touch([low, high]: &[Vec3; 2], slab: &Slab) -> bool {
    low[0] <= slab.extent[1] && high[0] >= slab.extent[0]
}

/// The contacts of one grain with one body; force and torque on the grain.
///
/// History belongs to the pair: a touch continues that old touch of the pair whose normal is nearest to its own
/// ([`inherited`]), whatever facets they lie on, so that friction survives the crossing of edges; and in a corner each
/// face has its own displacement and its own Coulomb limit. Adhesion acts once: each touch carries its share.
fn body_loads<L: Law, const ROLL: bool>(
    law: L,
    world: &World,
    row: &Row,
    (body, grain): (u32, u32),
    touches: &[BodyTouch],
    old: &[BodyPair],
    scratch: &mut Scratch,
    observer: &mut impl Observer,
) -> (Vec3, Vec3) {
    let material = world.pairs.get(row[MATERIAL] as usize, world.bodies[body as usize].material);
    let (mut f_sum, mut t_sum) = ([0.0; 3], [0.0; 3]);
    for at in touches {
        let mut pair = BodyPair { body, grain, normal: at.normal, slip: Slip::default(), roll: Roll::default() };
        if let Some((k, kept)) = inherited(at.normal, old.iter().map(|p| p.normal)) {
            let from = &old[k];
            pair.slip = Slip(from.slip.map(|u| kept * u));
            pair.roll = scale(kept, from.roll);
        }
        // How far adhesion has grown is the pair's too.
        pair.slip[3] = old.first().map_or(0.0, |p| p.slip[3]);
        let lever = sub(at.point, vec_at(row, 0));
        let touch =
            Touch { weight: at.weight, ..against(row, at.normal, at.overlap, lever, at.velocity, at.angular_velocity) };
        let mut options = world.options;
        // Divided by the weight that the whole load is multiplied with below.
        options.adhesion_scale *= at.share / at.weight;
        let load = evaluate::<L, ROLL>(&law, material, &options, &touch, &mut pair.slip, Some(&mut pair.roll));
        observer.contact(grain as usize, Partner::Body(body as usize), &touch, &load, &pair.slip);
        scratch.body_pairs.push(pair);
        let f = scale(at.weight, add_scaled(load.tangential, load.normal, at.normal));
        let couple = scale(at.weight, load.couple);
        f_sum = add(f_sum, f);
        t_sum = add(t_sum, add(cross(lever, f), couple));
        scratch.body_loads.push(BodyLoad { body, touch: *at, force: scale(-1.0, f), couple: scale(-1.0, couple) });
    }
    (f_sum, t_sum)
}
