//! Obstacles against each other, the box and driven bodies, and their motion: after the grains' contacts, at every step.
//!
//! A driven body's surface points are small spheres of radius [`POINT_RADIUS`] to an obstacle; the force acts at the point, on both,
//! so that force and moment balance to round-off. Stiffness and friction are those of the grains' law for that radius. A point of a
//! flexible tire weighs about 2 g: damping is reckoned with [`POINT_MASS`], which keeps explicit coupling stable there.
//! Two obstacles meet likewise: the points of each ([`FreeBody::skin`]) are small spheres to the other, a sphere is one itself; stiffness
//! is that of the lesser curvature. Sums run by obstacle, then body, then point.

use super::FreeBody;
use crate::dem::body::{Body, BodyTouch, Shape};
use crate::dem::contact::{Options, Slip, Touch, evaluate};
use crate::dem::engine::Setup;
use crate::dem::law::dispatch_law;
use crate::dem::material::{Pair, PairTable};
use crate::dem::vec3::{Vec3, add, add_scaled, cross, dot, norm, scale, sub};
use crate::dem::wall::Wall;
use std::collections::BTreeMap;

/// Radius of a driven body's surface points (m).
pub const POINT_RADIUS: f64 = 0.005;

/// Mass that damps the contact of such a point (kg).
pub const POINT_MASS: f64 = 0.002;

/// Push of soil that wakes an obstacle, over its weight.
const WAKING: f64 = 0.1;

/// Partners from here on are walls.
const WALLS: u32 = 1 << 16;
/// Partners from here on are other obstacles.
const OBSTACLES: u32 = 1 << 17;

/// What other obstacles do to one: force, moment about its centre, memories.
#[derive(Default)]
struct Met {
    force: Vec3,
    moment: Vec3,
    slips: BTreeMap<(u32, u32), Slip>,
}

/// Lets obstacles meet walls and driven bodies, and moves them on by a step. What the grains did to them is in `force` and
/// `moment` of their bodies.
pub fn step(bodies: &mut [Body], setup: &Setup, walls: &[Wall], pairs: &PairTable, options: &Options) {
    let free: Vec<usize> = (0..bodies.len()).filter(|&o| bodies[o].shape.as_free().is_some()).collect();
    let mut met: Vec<Met> = free.iter().map(|_| Met::default()).collect();
    for (m, &a) in free.iter().enumerate() {
        for (n, &b) in free.iter().enumerate().skip(m + 1) {
            // Taken out, so that both can be written to.
            let [mut one, mut two] = [a, b].map(|k| std::mem::replace(&mut bodies[k].shape, Box::new(Nowhere)));
            if let (Some(one), Some(two)) = (one.as_free(), two.as_free()) {
                let pair = pairs.get(bodies[a].material, bodies[b].material);
                meet([one, two], [a, b], (m, n, &mut met), setup, pair, options);
            }
            (bodies[a].shape, bodies[b].shape) = (one, two);
        }
    }
    for (o, met) in free.into_iter().zip(met) {
        let mut shape = std::mem::replace(&mut bodies[o].shape, Box::new(Nowhere));
        if let Some(free) = shape.as_free() {
            one(free, o, bodies, met, (setup, walls), pairs, options);
        }
        bodies[o].shape = shape;
    }
}

/// Contact of two obstacles: the points of each with the other's surface, action and reaction at the point.
fn meet(
    two: [&mut FreeBody; 2],
    numbers: [usize; 2],
    (m, n, met): (usize, usize, &mut [Met]),
    setup: &Setup,
    pair: &Pair,
    options: &Options,
) {
    if (two[0].now.asleep && two[1].now.asleep) || !overlap(&two[0].bounds(), &two[1].bounds()) {
        return;
    }
    let options = Options { adhesion: false, ..*options };
    let inv_m = 1.0 / two[0].mass() + 1.0 / two[1].mass();
    let radius = two[0].solid().curvature().min(two[1].solid().curvature());
    let mut touches = Vec::new();
    let mut touched = false;
    for (i, j, mine, others) in [(0, 1, m, n), (1, 0, n, m)] {
        for (k, &(p, r)) in (0_u32..).zip(two[i].skin()) {
            let x = two[i].to_world(p);
            touches.clear();
            two[j].touches(x, r, &mut touches);
            let Some(t) = touches.iter().max_by(|a, b| a.overlap.total_cmp(&b.overlap)) else { continue };
            touched = true;
            let at = t.point;
            let meeting = Meeting {
                n: t.normal,
                overlap: t.overlap,
                radius,
                inv_m,
                v: sub(two[i].velocity_at(at), two[j].velocity_at(at)),
                spin: t.angular_velocity,
            };
            let key = (OBSTACLES + numbers[j] as u32, k);
            let mut slip = two[i].now.slips.get(&key).copied().unwrap_or_default();
            let f = meeting.force(setup, pair, &options, &mut slip);
            let arms = [sub(at, two[i].centre()), sub(at, two[j].centre())];
            met[mine].slips.insert(key, slip);
            met[mine].force = add(met[mine].force, f);
            met[mine].moment = add(met[mine].moment, cross(arms[0], f));
            met[others].force = sub(met[others].force, f);
            met[others].moment = sub(met[others].moment, cross(arms[1], f));
        }
    }
    if touched {
        two.into_iter().for_each(|free| free.now.asleep = false);
    }
}

struct Nowhere;

impl Shape for Nowhere {
    fn move_to(&mut self, _: f64) {}
    fn bounds(&self) -> [Vec3; 2] {
        [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]]
    }
    fn touches(&self, _: Vec3, _: f64, _: &mut Vec<BodyTouch>) {}
    fn centre(&self) -> Vec3 {
        [0.0; 3]
    }
}

fn one(
    free: &mut FreeBody,
    o: usize,
    bodies: &mut [Body],
    met: Met,
    (setup, walls): (&Setup, &[Wall]),
    pairs: &PairTable,
    options: &Options,
) {
    let (mut force, mut moment) = (bodies[o].force, bodies[o].moment);
    if free.now.asleep && norm(force) > WAKING * free.mass() * norm(setup.gravity) {
        free.now.asleep = false;
    }
    let centre = free.centre();
    let options = Options { adhesion: false, ..*options };
    (force, moment) = (add(force, met.force), add(moment, met.moment));
    let mut slips = met.slips;
    let mut touches = Vec::new();
    let mut surface = Vec::new();
    for b in 0..bodies.len() {
        let material = bodies[o].material;
        let body = &mut bodies[b];
        if b == o || body.shape.as_free().is_some() || !overlap(&free.bounds(), &body.shape.bounds()) {
            continue;
        }
        surface.clear();
        body.shape.surface(&mut surface);
        for (k, &(x, v)) in surface.iter().enumerate() {
            touches.clear();
            free.touches(x, POINT_RADIUS, &mut touches);
            let Some(t) = touches.iter().max_by(|a, b| a.overlap.total_cmp(&b.overlap)) else { continue };
            free.now.asleep = false;
            let meeting = Meeting {
                n: t.normal,
                overlap: t.overlap,
                radius: POINT_RADIUS,
                inv_m: 1.0 / POINT_MASS + 1.0 / free.mass(),
                v: sub(v, free.velocity_at(x)),
                spin: t.angular_velocity,
            };
            let key = (b as u32, k as u32);
            let mut slip = free.now.slips.get(&key).copied().unwrap_or_default();
            let pair = pairs.get(body.material, material);
            let f = meeting.force(setup, pair, &options, &mut slip);
            slips.insert(key, slip);
            // On the point of the body; the opposite on the obstacle.
            let h = options.h;
            body.force = add(body.force, f);
            body.impulse = add_scaled(body.impulse, h, f);
            let arm = sub(x, body.shape.centre());
            body.angular_impulse = add_scaled(body.angular_impulse, h, cross(arm, f));
            if let Some(impulse) = body.vertex_impulse.get_mut(k) {
                *impulse = add_scaled(*impulse, h, f);
            }
            force = sub(force, f);
            moment = sub(moment, cross(sub(x, centre), f));
        }
    }
    let mut points = Vec::new();
    for (w, wall) in (0_u32..).zip(walls) {
        let height = dot(sub(centre, wall.point), wall.normal);
        if free.now.asleep || height > free.solid().reach() {
            continue;
        }
        points.clear();
        free.solid().points(free.to_body_direction(scale(-1.0, wall.normal)), &mut points);
        for (k, p) in (0_u32..).zip(&points) {
            let x = free.to_world(*p);
            let overlap = -dot(sub(x, wall.point), wall.normal);
            if overlap <= 0.0 {
                continue;
            }
            let meeting = Meeting {
                n: wall.normal,
                overlap,
                radius: free.solid().curvature(),
                inv_m: 1.0 / free.mass(),
                v: free.velocity_at(x),
                spin: [0.0; 3],
            };
            let key = (WALLS + w, k);
            let mut slip = free.now.slips.get(&key).copied().unwrap_or_default();
            let f = meeting.force(setup, pairs.get(bodies[o].material, wall.material), &options, &mut slip);
            slips.insert(key, slip);
            force = add(force, f);
            moment = add(moment, cross(sub(x, centre), f));
        }
    }
    free.now.slips = slips;
    free.advance(force, moment, setup.gravity, options.h);
}

fn overlap(a: &[Vec3; 2], b: &[Vec3; 2]) -> bool {
    (0..3).all(|c| a[0][c] - POINT_RADIUS < b[1][c] && b[0][c] < a[1][c] + POINT_RADIUS)
}

/// A contact at a point.
struct Meeting {
    /// Normal towards what the force acts on.
    n: Vec3,
    overlap: f64,
    radius: f64,
    inv_m: f64,
    /// Velocity of what the force acts on, relative to the other.
    v: Vec3,
    /// Angular velocity that turns the normal.
    spin: Vec3,
}

impl Meeting {
    fn force(&self, setup: &Setup, pair: &Pair, options: &Options, slip: &mut Slip) -> Vec3 {
        let touch = Touch {
            n: self.n,
            delta: self.overlap,
            r_eff: self.radius,
            r_adhesion: 0.0,
            inv_m: self.inv_m,
            inv_mr2: 0.0,
            v: self.v,
            w_rel: [0.0; 3],
            spin: dot(self.spin, self.n),
            tilt: [0.0; 3],
            weight: 1.0,
        };
        let load = dispatch_law!(setup.law, setup.form, law =>
            evaluate::<_, false>(&law, pair, options, &touch, slip, None));
        // A driven body is moved at any price: a contact that pulls while it parts would pull at it without end.
        add_scaled(load.tangential, load.normal.max(0.0), self.n)
    }
}
