//! Which facets near a grain are contacts of their own, and how much each counts.
//!
//! Take the overlap of the grain with each point s of the surface, delta(s) = r - |c - s|. A contact is a **local maximum**
//! of delta(s). This is the rule "a face contact hides the edges and vertices it shares, an edge contact its vertices", without
//! comparing features, which round-off can tell apart wrongly: on a facet delta falls off from its nearest point in all
//! directions, so a facet whose nearest point lies on an edge hides in the neighbour there, unless that neighbour's
//! nearest point is the same. Flat and convex surfaces give one contact, concave ones several.
//!
//! Alone, that rule jumps. At a concave fold by theta the second facet's maximum is born not at delta = 0 but as soon as the
//! centre passes over it, with nearly the full overlap if delta > r theta^2/2; and a plate that unfolds to flat would drop from
//! two contacts to one. So a contact counts by how much of a maximum it is: its **persistence**, the height above
//! the saddle (here always a point of a shared edge) over which one gets to a higher maximum. That is zero exactly where a maximum
//! is born or dies, whatever moves.
//!
//! *Merge tree.* Facets are leaves with overlap delta_i; edges link two facets at the level e = the largest delta on the
//! edge. Links are taken from the highest level down; what is not linked above 0 is linked at 0. A component X has the branch length
//! Omega_X(e) = the total length of its tree above level e: delta_i - e for a leaf, and Omega_X + Omega_Y where X and Y join.
//! Joining, X and Y share the weight 1 in the ratio of their branch lengths: lambda_i = product over the joins above leaf i of
//! Omega_X/(Omega_X + Omega_Y). So the lambda_i sum to 1; a leaf that dies (Omega -> 0) has lambda -> 0 and leaves no trace in
//! Omega; and joins at one level may be taken in any order.
//!
//! *Groups by angle.* Contacts whose normals differ by less than [`FULL_ANGLE`] are one surface (likeness K = 1): their weights
//! lambda sum to 1. Those that differ by more than [`SEPARATE_ANGLE`] are two (K = 0) and count fully, except near birth. With
//! 1/lambda = 1 + sum over joins of I, I = P Omega_Y/Omega_X (P: the product so far), the weight is
//!
//! 1/w_i = 1 + sum over joins of I kappa_i, kappa_i = sum over j in Y of lambda_j (K_ij + (1 - K_ij) e/delta_max),
//!
//! so that w = lambda for K = 1; w = 1 for K = 0 where facets are parted by more than a saddle above zero overlap
//! (e <= 0); and w -> 0 at every birth. Between, all is continuous in the position of the grain and of every vertex.
//!
//! *Overlap.* Within a group each contact presses with the overlap of the deepest: delta^_i = delta_i + max_j K_ij min(1, 2
//! lambda_j/(lambda_i + lambda_j)) (delta_j - delta_i). The mean over a group would dip by up to a fifth where a shallow contact is
//! born; like this the normal force of a group is that of its deepest contact times |sum w n|: low by at most 1 - cos(theta/2) at
//! a fold of theta, 4e-5 at 1 degree, 0.4 % at 10.
//!
//! *What it costs in truth.* Two places of one body that press with nearly the same normal, such as two parallel ridges under
//! one grain, are one contact. Folds between the two angles are neither: the force grows smoothly from one to two contacts.

use crate::dem::vec3::{Vec3, dot, norm, sub};

/// Normals closer than this are one surface, in rad (10 degrees).
pub const FULL_ANGLE: f64 = 10.0 * std::f64::consts::PI / 180.0;

/// Normals further apart than this are two surfaces, in rad (30 degrees).
pub const SEPARATE_ANGLE: f64 = 30.0 * std::f64::consts::PI / 180.0;

// Chords 2 sin(angle/2) of the two angles: cheaper than the angle of two normals.
const FULL_CHORD: f64 = 0.174_311_485_495_316_36;
const SEPARATE_CHORD: f64 = 0.517_638_090_205_041_5;

/// Likeness K of two unit normals: 1 up to [`FULL_ANGLE`], 0 from [`SEPARATE_ANGLE`], smooth between.
#[inline]
pub fn likeness(n: Vec3, m: Vec3) -> f64 {
    let chord = norm(sub(n, m));
    if chord <= FULL_CHORD {
        return 1.0;
    }
    if chord >= SEPARATE_CHORD || dot(n, m) <= 0.0 {
        return 0.0;
    }
    let s = (SEPARATE_CHORD - chord) / (SEPARATE_CHORD - FULL_CHORD);
    s * s * (3.0 - 2.0 * s)
}

/// A facet that overlaps the grain.
#[derive(Clone, Copy, Debug)]
pub struct Leaf {
    /// Its overlap, positive.
    pub delta: f64,
    /// Its contact normal.
    pub normal: Vec3,
    /// Decides ties: the lowest wins.
    pub rank: u8,
}

/// Two leaves that share an edge.
#[derive(Clone, Copy, Debug)]
pub struct Link {
    /// Largest overlap on the edge; at most those of the two leaves.
    pub level: f64,
    /// The leaves.
    pub leaves: [u32; 2],
}

/// What a leaf counts.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Share {
    /// Factor on its force; 0 for a facet that hides.
    pub weight: f64,
    /// Overlap to press with.
    pub overlap: f64,
    component: u32,
    /// 1/lambda within the component so far; infinite for a leaf that hides.
    p: f64,
    /// sum of I kappa.
    s: f64,
}

/// Scratch of [`Blend::weigh`].
#[derive(Clone, Debug, Default)]
pub struct Blend {
    shares: Vec<Share>,
    /// Omega(e) = top - e of the component of that number.
    top: Vec<f64>,
    best: Vec<u32>,
}

impl Blend {
    /// The shares of all leaves. `links` are sorted here; differences of overlap up to `tolerance` are round-off.
    pub fn weigh(&mut self, leaves: &[Leaf], links: &mut [Link], tolerance: f64) -> &[Share] {
        self.shares.clear();
        self.top.clear();
        self.best.clear();
        let mut delta_max = 0.0f64;
        for (k, leaf) in (0u32..).zip(leaves) {
            self.shares.push(Share { weight: 0.0, overlap: leaf.delta, component: k, p: 1.0, s: 0.0 });
            self.top.push(leaf.delta);
            self.best.push(k);
            delta_max = delta_max.max(leaf.delta);
        }
        links.sort_unstable_by(|a, b| b.level.total_cmp(&a.level).then(a.leaves.cmp(&b.leaves)));
        for link in links.iter().filter(|l| l.level > 0.0) {
            let [x, y] = link.leaves.map(|k| self.shares[k as usize].component);
            if x != y {
                self.join(leaves, x, y, link.level, delta_max, tolerance);
            }
        }
        for y in 1..leaves.len() as u32 {
            let x = self.shares[0].component;
            let y = self.shares[y as usize].component;
            if x != y {
                self.join(leaves, x, y, 0.0, delta_max, tolerance);
            }
        }
        self.finish(leaves)
    }

    /// Whether the deepest leaf of component `x` is to be kept before that of `y`.
    fn before(&self, leaves: &[Leaf], x: u32, y: u32, tolerance: f64) -> bool {
        let (i, j) = (self.best[x as usize], self.best[y as usize]);
        let (a, b) = (&leaves[i as usize], &leaves[j as usize]);
        let rise = a.delta - b.delta;
        if rise.abs() > tolerance { rise > 0.0 } else { (a.rank, i) < (b.rank, j) }
    }

    fn join(&mut self, leaves: &[Leaf], x: u32, y: u32, level: f64, delta_max: f64, tolerance: f64) {
        let (x, y) = if self.before(leaves, x, y, tolerance) { (x, y) } else { (y, x) };
        let omega = |c: u32| (self.top[c as usize] - level).max(0.0);
        let (omega_x, omega_y) = (omega(x), omega(y));
        if omega_y <= tolerance {
            // Hidden: its maximum is no higher than the way to a better one. Of two that are level, as two facets are
            // for a grain right above their common edge, one stays; they are the same contact.
            for share in self.shares.iter_mut().filter(|s| s.component == y) {
                share.p = f64::INFINITY;
                share.component = x;
            }
            return;
        }
        let ratio = level / delta_max;
        for i in 0..leaves.len() {
            let share = self.shares[i];
            if share.p.is_finite() && (share.component == x || share.component == y) {
                let (other, part) = if share.component == x { (y, omega_y / omega_x) } else { (x, omega_x / omega_y) };
                // Kept in `overlap` until all have been worked out: p is still needed by the others.
                let increment = share.p * part;
                self.shares[i].s += increment * self.kappa(leaves, i, other, ratio);
                self.shares[i].overlap = share.p + increment;
            }
        }
        for share in &mut self.shares {
            if share.component == x || share.component == y {
                if share.p.is_finite() {
                    share.p = share.overlap;
                }
                share.component = x;
            }
        }
        self.top[x as usize] = level + omega_x + omega_y;
    }

    /// kappa of leaf i towards component `other`.
    fn kappa(&self, leaves: &[Leaf], i: usize, other: u32, ratio: f64) -> f64 {
        let mut kappa = 0.0;
        for (j, share) in self.shares.iter().enumerate() {
            if share.component == other && share.p.is_finite() {
                let k = likeness(leaves[i].normal, leaves[j].normal);
                kappa += (k + (1.0 - k) * ratio) / share.p;
            }
        }
        kappa
    }

    fn finish(&mut self, leaves: &[Leaf]) -> &[Share] {
        for i in 0..leaves.len() {
            let p = self.shares[i].p;
            self.shares[i].overlap = leaves[i].delta;
            if !p.is_finite() {
                continue;
            }
            self.shares[i].weight = 1.0 / (1.0 + self.shares[i].s);
            let mut deeper = 0.0f64;
            for (j, other) in self.shares.iter().enumerate() {
                let rise = leaves[j].delta - leaves[i].delta;
                if other.p.is_finite() && rise > 0.0 {
                    // lambda = 1/p.
                    let presence = (2.0 * p / (p + other.p)).min(1.0);
                    deeper = deeper.max(likeness(leaves[i].normal, leaves[j].normal) * presence * rise);
                }
            }
            self.shares[i].overlap += deeper;
        }
        &self.shares
    }
}
