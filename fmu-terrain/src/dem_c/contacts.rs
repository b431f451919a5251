//! From grains, walls and bodies to the contacts of a cone-complementarity problem, and back.
//!
//! A contact is made where two surfaces touch or may touch within the step: their gap, less what they approach each other in it, is below
//! the margin. Its impulses at the end of the step start the next one; they are kept where DEM-P keeps its histories, so that sorting
//! carries them along: `slip` holds the impulse on the first grain (N s) and 1 plus the slip speed at the end (m/s), `roll` the couple over R* (N s).
//!
//! **Elastic contacts** (the default) are Hertz's and Mindlin's, taken implicitly: the force after the step is that of the present overlap less k times what
//! the surfaces approach in the step, k the tangent stiffness; tangentially the force of the step before, less k times the slip. So N gains
//! 1/(k h^2) on its diagonal, the cone problem is well conditioned (a tenth of the iterations), forces are unique, a bed of DEM-P
//! goes on with its own overlaps, and one at rest has no residual. With rigid contacts an overlap is undone over the recovery time instead.
//!
//! **Without the lift.** The relaxation asks u_n - mu |u_t| >= 0: taken as it is, a contact that slides at 5 m/s with mu .5 is thrown
//! up at 2.5 m/s. b_n therefore holds mu |u_t| as well (the change of variable of De Saxce and Feng 1998), with the slip of the step before; of a
//! new contact, that before contact. What is left of the lift is mu h times the change of slip in a step.

use crate::dem::body::{BodyLoad, BodyTouch};
use crate::dem::contact::Slip;
use crate::dem::grains::{INV_I, INV_M, MATERIAL, R, Row, V, W, vec_at};
use crate::dem::material::{Pair, PairTable};
use crate::dem::slab::{BodyPair, Slab};
use crate::dem::vec3::{Vec3, add, add_scaled, cross, dot, norm, reject, scale, sub};
use crate::dem::{Body, Wall};
use crate::mesh::inherited;
use std::f64::consts::PI;
use terramech_mechanics::cone;

/// What making contacts needs to know.
pub struct World<'a> {
    /// Grains with their velocities before contact.
    pub rows: &'a [Row],
    pub pairs: &'a PairTable,
    pub walls: &'a [Wall],
    pub bodies: &'a [Body],
    /// Step (s).
    pub h: f64,
    /// Gap up to which a contact is made whatever the velocities (m).
    pub margin: f64,
    /// How far a body may come towards a grain in the step (m), for each body.
    pub reach: &'a [f64],
    /// Time over which an overlap is undone (s), and the fastest that it is (m/s).
    pub recovery_time: f64,
    pub recovery: f64,
    /// Approach from which restitution counts (m/s).
    pub bounce: f64,
    pub adhesion_scale: f64,
    pub rolling: bool,
    /// Whether contacts have the elasticity of their materials; else they are rigid.
    pub elastic: bool,
    /// This step over the last: what impulses of the last one are worth in this.
    pub ratio: f64,
}

/// Who a contact belongs to: where its impulses go.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Owner {
    /// A pair of the slab's list.
    Pair(u32),
    /// A wall pair of the slab.
    Wall(u32),
    /// A touch of a body: its place in [`Made::touches`].
    Body(u32),
}

/// Contacts of a slab.
#[derive(Default)]
pub struct Made {
    pub owner: Vec<Owner>,
    pub a: Vec<u32>,
    /// The partner: a grain, or a number among [`Made::prescribed`] with the top bit set; `u32::MAX` = at rest.
    pub b: Vec<u32>,
    pub frame: Vec<[f64; 4]>,
    pub class: Vec<u8>,
    pub cohesion: Vec<f64>,
    pub compliance: Vec<f64>,
    pub bias: Vec<Vec3>,
    pub couple_compliance: Vec<f64>,
    pub couple_bias: Vec<Vec3>,
    pub lever: Vec<[f64; 2]>,
    pub force: Vec<Vec3>,
    pub couple: Vec<Vec3>,
    pub prescribed: Vec<cone::Row>,
    pub touches: Vec<(u32, u32, BodyTouch)>,
}

/// Marks a partner that moves as prescribed.
pub const PRESCRIBED: u32 = 1 << 31;

/// A partner at rest: walls.
const AT_REST: u32 = u32::MAX;

/// Classes of a problem: one for each pair of materials.
pub fn classes(pairs: &PairTable) -> Vec<cone::Class> {
    pairs
        .all()
        .iter()
        .map(|p| cone::Class { friction: p.friction, rolling: p.rolling_friction, spinning: p.spinning_friction })
        .collect()
}

impl Made {
    fn clear(&mut self) {
        self.owner.clear();
        self.a.clear();
        self.b.clear();
        self.frame.clear();
        self.class.clear();
        self.cohesion.clear();
        self.compliance.clear();
        self.bias.clear();
        self.couple_compliance.clear();
        self.couple_bias.clear();
        self.lever.clear();
        self.force.clear();
        self.couple.clear();
        self.prescribed.clear();
        self.touches.clear();
    }
}

/// What two surfaces do to each other.
struct Meeting {
    owner: Owner,
    a: u32,
    b: u32,
    n: Vec3,
    gap: f64,
    /// Normal velocity before contact (m/s), positive apart.
    apart: f64,
    /// Slip speed to reckon with (m/s): that of the step before.
    slip: f64,
    /// R* and the radius that cohesive pressure acts on (m).
    r_eff: f64,
    r_adhesion: f64,
    lever: [f64; 2],
    /// Part of the pair's adhesion that is this contact's.
    share: f64,
    /// Part of the spring that is this contact's, where several touches are one surface.
    weight: f64,
    /// Inverse of the effective mass (1/kg).
    inv_m: f64,
    force: Vec3,
    couple: Vec3,
}

/// Hertz's spring at the present overlap, as the implicit step feels it.
struct Spring {
    /// 1/(k h max(h, alpha)) (1/kg), alpha the material's damping over its stiffness.
    compliance: f64,
    /// Force at the present overlap (N); negative across a gap.
    force: f64,
}

/// Overlap over R* below which the spring is linear: at a first touch Hertz's has no stiffness at all.
const LINEAR: f64 = 0.005;

/// Overlap over R* beyond which a contact is a misplaced one: its force grows no more, or what somebody has put into a bed would be shot out of it.
/// Rigid it must not be: between two bodies that are driven together a rigid grain has no solution.
const DEEPEST: f64 = 1.0;

impl Spring {
    fn of(pair: &Pair, m: &Meeting, h: f64) -> Self {
        let (overlap, least) = ((-m.gap).min(DEEPEST * m.r_eff), LINEAR * m.r_eff);
        let tangent = m.weight * 2.0 * pair.e_star * (m.r_eff * overlap.max(least)).sqrt();
        let secant = 2.0 / 3.0 * tangent;
        let k = if overlap > least { tangent } else { secant };
        // An implicit step damps as a dashpot k h does: a material that damps more gets the rest, or small steps would ring.
        let alpha = 2.0 * pair.damping_ratio / (k * m.inv_m).sqrt();
        Self { compliance: 1.0 / (k * h * h.max(alpha)), force: secant * overlap }
    }
}

/// Slip speed to reckon with: the one kept (as 1 + speed; 0 = none), else that of the velocities before contact.
fn slipping(kept: f64, before: impl FnOnce() -> Vec3, n: Vec3) -> f64 {
    if kept >= 1.0 { kept - 1.0 } else { norm(reject(before(), n)) }
}

impl World<'_> {
    /// All contacts of a slab, by pair, wall, body.
    pub fn contacts(&self, slab: &Slab, made: &mut Made) {
        made.clear();
        self.grains(slab, made);
        self.walls(slab, made);
        for b in 0..self.bodies.len() {
            self.body(slab, b, made);
        }
    }

    fn push(&self, pair: &Pair, class: usize, m: Meeting, made: &mut Made) {
        let a = &pair.adhesion;
        // It holds what touches, to a hundredth of a radius: the relaxation opens sliding contacts by mu v h.
        let holds = if m.gap <= 0.01 * m.r_eff { self.adhesion_scale * m.share } else { 0.0 };
        let full =
            a.constant + a.dmt * m.r_eff.sqrt() + a.perko * m.r_eff + PI * m.r_adhesion * m.r_adhesion * a.pressure;
        let cohesion = holds * full * self.h;
        // A gap may close within the step; an overlap is undone over a longer time, or a bed of many layers would jump: the speeds of its layers add up.
        let stabilised =
            if m.gap > 0.0 { m.gap / self.h } else { (m.gap / self.recovery_time.max(self.h)).max(-self.recovery) };
        // A touching rigid contact that was hit bounces. Springs have their damping for it; rigid for a step, they would kick a bed in motion.
        let hit = !self.elastic && m.gap <= 0.0 && m.apart < -self.bounce;
        let bounced = if hit { pair.restitution * m.apart } else { f64::INFINITY };
        let lift = pair.friction * m.slip;
        let mut b = stabilised.min(bounced);
        let force = scale(self.ratio, m.force);
        let couple = scale(self.ratio, m.couple);
        if self.elastic {
            let Spring { compliance: e, force: spring } = Spring::of(pair, &m, self.h);
            let tangential = reject(force, m.n);
            b = e * (cohesion - spring * self.h);
            made.compliance.push(e);
            made.bias.push(scale(-e, tangential));
            if self.rolling {
                // The element of model C on the relative rotation: 2.25 k_n (mu_r R*)^2, for the couple over R*.
                let mu = pair.rolling_friction.max(pair.spinning_friction);
                let e = if mu > 0.0 { e / (2.25 * mu * mu) } else { 0.0 };
                made.couple_compliance.push(e);
                made.couple_bias.push(scale(-e, couple));
            }
        }
        made.owner.push(m.owner);
        made.a.push(m.a);
        made.b.push(m.b);
        made.frame.push([m.n[0], m.n[1], m.n[2], b + lift]);
        made.class.push(class as u8);
        made.cohesion.push(cohesion);
        made.force.push(force);
        if self.rolling {
            made.lever.push(m.lever);
            made.couple.push(couple);
        }
    }

    fn near(&self, gap: f64, apart: f64) -> bool {
        gap + self.h * apart.min(0.0) < self.margin
    }

    fn grains(&self, slab: &Slab, made: &mut Made) {
        for (p, (&i, &j)) in slab.owner.iter().zip(&slab.other).enumerate() {
            let (a, b) = (&self.rows[i as usize], &self.rows[j as usize]);
            let d = sub(vec_at(a, 0), vec_at(b, 0));
            let (ra, rb) = (a[R], b[R]);
            let reach = ra + rb;
            let d2 = dot(d, d);
            // Far and not coming nearer: most pairs of the list, told without a root.
            let v = sub(vec_at(a, V), vec_at(b, V));
            let far = reach + self.margin;
            let closing = dot(v, d);
            if (d2 >= far * far && closing >= 0.0) || a[INV_M] + b[INV_M] == 0.0 {
                continue;
            }
            let length = d2.sqrt();
            let apart = closing / length;
            let gap = length - reach;
            if !self.near(gap, apart) {
                continue;
            }
            let (ma, mb) = (a[MATERIAL] as usize, b[MATERIAL] as usize);
            let slip = slab.slip[p].0;
            // The solver wants a movable first body.
            let (first, second, sign) = if a[INV_M] > 0.0 { (i, j, 1.0) } else { (j, i, -1.0) };
            let meeting = Meeting {
                owner: Owner::Pair(p as u32),
                a: first,
                b: second,
                n: scale(sign / length, d),
                gap,
                apart,
                slip: slipping(
                    slip[3],
                    || {
                        let turn = add(scale(ra, vec_at(a, W)), scale(rb, vec_at(b, W)));
                        add(v, cross(scale(1.0 / length, d), turn))
                    },
                    scale(1.0 / length, d),
                ),
                r_eff: ra * rb / reach,
                r_adhesion: ra.min(rb),
                lever: if sign > 0.0 { [rb / reach, ra / reach] } else { [ra / reach, rb / reach] },
                share: 1.0,
                weight: 1.0,
                inv_m: a[INV_M] + b[INV_M],
                force: scale(sign, [slip[0], slip[1], slip[2]]),
                couple: slab.roll.get(p).map_or([0.0; 3], |q| scale(sign, *q)),
            };
            self.push(self.pairs.get(ma, mb), self.pairs.index(ma, mb), meeting, made);
        }
    }

    fn walls(&self, slab: &Slab, made: &mut Made) {
        for (p, pair) in slab.walls.iter().enumerate() {
            let row = &self.rows[pair.grain as usize];
            let wall = &self.walls[pair.wall as usize];
            let gap = wall.distance(row) - row[R];
            let apart = dot(vec_at(row, V), wall.normal);
            if !self.near(gap, apart) || row[INV_M] == 0.0 {
                continue;
            }
            let material = row[MATERIAL] as usize;
            let meeting = Meeting {
                owner: Owner::Wall(p as u32),
                a: pair.grain,
                b: AT_REST,
                n: wall.normal,
                gap,
                apart,
                slip: slipping(
                    pair.slip.0[3],
                    || add(vec_at(row, V), cross(wall.normal, scale(row[R], vec_at(row, W)))),
                    wall.normal,
                ),
                r_eff: row[R],
                r_adhesion: row[R],
                lever: [1.0, 1.0],
                share: 1.0,
                weight: 1.0,
                inv_m: row[INV_M],
                force: [pair.slip.0[0], pair.slip.0[1], pair.slip.0[2]],
                couple: pair.roll,
            };
            self.push(
                self.pairs.get(material, wall.material),
                self.pairs.index(material, wall.material),
                meeting,
                made,
            );
        }
    }

    fn body(&self, slab: &Slab, b: usize, made: &mut Made) {
        let body = &self.bodies[b];
        let [low, high] = body.shape.bounds();
        let more = self.margin + self.reach[b];
        if low[0] > slab.extent[1] + more || high[0] < slab.extent[0] - more {
            return;
        }
        let mut touches = Vec::new();
        for i in slab.grains() {
            let row = &self.rows[i];
            // What it may come nearer by itself is its own speed's.
            let own = self.h * dot(vec_at(row, V), vec_at(row, V)).sqrt();
            let r = row[R] + more + own;
            if row[INV_M] == 0.0 || !(0..3).all(|k| row[k] + r > low[k] && row[k] - r < high[k]) {
                continue;
            }
            touches.clear();
            body.shape.touches(vec_at(row, 0), r, &mut touches);
            let key = (b as u32, i as u32);
            let from = slab.bodies.partition_point(|p| (p.body, p.grain) < key);
            let old = &slab.bodies[from..];
            let old = &old[..old.iter().take_while(|p| (p.body, p.grain) == key).count()];
            for touch in &touches {
                let gap = r - row[R] - touch.overlap;
                let apart = dot(sub(vec_at(row, V), touch.velocity), touch.normal);
                if self.near(gap, apart) {
                    self.touch(key, row, *touch, gap, apart, old, made);
                }
            }
        }
    }

    fn touch(
        &self,
        (body, grain): (u32, u32),
        row: &Row,
        touch: BodyTouch,
        gap: f64,
        apart: f64,
        old: &[BodyPair],
        made: &mut Made,
    ) {
        let (mut force, mut couple, mut known) = ([0.0; 3], [0.0; 3], 0.0);
        if let Some((k, kept)) = inherited(touch.normal, old.iter().map(|p| p.normal)) {
            force = [0, 1, 2].map(|c| kept * old[k].slip.0[c]);
            couple = scale(kept, old[k].roll);
            known = old[k].slip.0[3];
        }
        let n = touch.normal;
        // s of the surface, R* = r; its part in the slip at the contact is taken out of v, since the velocity given is the surface's already.
        let s = scale(row[R], touch.angular_velocity);
        let v = add(touch.velocity, cross(n, s));
        let b = PRESCRIBED | made.prescribed.len() as u32;
        made.prescribed.push([v[0], v[1], v[2], 0.0, s[0], s[1], s[2], 0.0]);
        let (ma, mb) = (row[MATERIAL] as usize, self.bodies[body as usize].material);
        let meeting = Meeting {
            owner: Owner::Body(made.touches.len() as u32),
            a: grain,
            b,
            n,
            gap,
            apart,
            slip: slipping(
                known,
                || sub(add(vec_at(row, V), cross(n, scale(row[R], vec_at(row, W)))), touch.velocity),
                n,
            ),
            r_eff: row[R],
            r_adhesion: row[R],
            lever: [1.0, 1.0],
            share: touch.share,
            // Never nothing: a compliance without end is no number.
            weight: touch.weight.max(1e-6),
            inv_m: row[INV_M],
            force,
            couple,
        };
        made.touches.push((body, grain, touch));
        self.push(self.pairs.get(ma, mb), self.pairs.index(ma, mb), meeting, made);
    }
}

/// A grain as the solver has it.
pub fn ball(row: &Row) -> cone::Row {
    let (v, w, r) = (vec_at(row, V), vec_at(row, W), row[R]);
    [v[0], v[1], v[2], row[INV_M], r * w[0], r * w[1], r * w[2], r * r * row[INV_I]]
}

/// Keeps the impulses of a slab's contacts for the next step, and lists what they are on bodies and walls. `impulse(c)` gives force, couple
/// and slip speed of the slab's contact `c`.
pub fn keep(
    slab: &mut Slab,
    made: &Made,
    rows: &[Row],
    rolling: bool,
    h: f64,
    impulse: impl Fn(usize) -> (Vec3, Vec3, f64),
    wall_force: &mut [Vec3],
    loads: &mut Vec<BodyLoad>,
) {
    slab.slip.fill(Slip::default());
    slab.roll.fill([0.0; 3]);
    for w in &mut slab.walls {
        (w.slip, w.roll) = (Slip::default(), [0.0; 3]);
    }
    slab.bodies.clear();
    wall_force.fill([0.0; 3]);
    loads.clear();
    for (c, owner) in made.owner.iter().enumerate() {
        let (g, q, slip) = impulse(c);
        if g == [0.0; 3] && q == [0.0; 3] {
            continue;
        }
        match *owner {
            Owner::Pair(p) => {
                let p = p as usize;
                let sign = if made.a[c] == slab.owner[p] { 1.0 } else { -1.0 };
                slab.slip[p] = Slip([sign * g[0], sign * g[1], sign * g[2], 1.0 + slip]);
                if rolling {
                    slab.roll[p] = scale(sign, q);
                }
            }
            Owner::Wall(p) => {
                let pair = &mut slab.walls[p as usize];
                (pair.slip, pair.roll) = (Slip([g[0], g[1], g[2], 1.0 + slip]), q);
                let sum = &mut wall_force[pair.wall as usize];
                *sum = add_scaled(*sum, -1.0 / h, g);
            }
            Owner::Body(t) => {
                let (body, grain, touch) = made.touches[t as usize];
                slab.bodies.push(BodyPair {
                    body,
                    grain,
                    normal: touch.normal,
                    slip: Slip([g[0], g[1], g[2], 1.0 + slip]),
                    roll: q,
                });
                let couple = scale(-rows[grain as usize][R] / h, q);
                loads.push(BodyLoad { body, touch, force: scale(-1.0 / h, g), couple });
            }
        }
    }
}
