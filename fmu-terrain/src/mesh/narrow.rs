//! The contacts of one grain with one mesh body.

use super::blend::{Blend, Leaf, Link, likeness};
use super::body::MeshBody;
use super::closest::{Closest, Feature, closest_on_segment, closest_on_triangle};
use crate::dem::vec3::{Vec3, add, dot, norm, scale, sub};

/// One contact of a grain with a mesh. A pair of grain and body has one on flat and convex parts, several in concave
/// ones; the force of the pair is the sum of `weight` times the contact law at each.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeshContact {
    /// The facet.
    pub triangle: u32,
    /// Factor on force and couple of this contact, above 0 and at most 1.
    pub weight: f64,
    /// This contact's part of what acts once per pair (adhesion); the parts of a pair sum to 1. To be used instead of
    /// `weight`.
    pub share: f64,
    /// Overlap to press with, in m.
    pub overlap: f64,
    /// Outward unit normal of the surface, towards the grain.
    pub normal: Vec3,
    /// The nearest point of the facet, in m.
    pub point: Vec3,
    /// Its barycentric weights on the facet's vertices.
    pub barycentric: [f64; 3],
    /// Velocity of the mesh there, in m/s.
    pub velocity: Vec3,
}

/// Memory for [`MeshBody::contacts`], one per thread. It grows to the largest number of facets that overlap one grain.
#[derive(Clone, Debug, Default)]
pub struct ContactScratch {
    found: Vec<(u32, Closest)>,
    leaves: Vec<Leaf>,
    sides: Vec<(u32, u32, u8)>,
    links: Vec<Link>,
    blend: Blend,
    contacts: Vec<MeshContact>,
}

/// Overlaps that differ by less than this times the radius are equal: round-off of a distance.
const ROUND_OFF: f64 = 1e-14;

/// A centre nearer to the surface than this times the radius has no direction to it: the facet's normal is taken.
const NO_DIRECTION: f64 = 1e-9;

impl MeshBody {
    /// The contacts of a grain with centre `c` and radius `r` (m). `candidates` are the facets that may be within r,
    /// ascending; facets further away do no harm. Contacts come in the order of their facets.
    pub fn contacts<'a>(
        &self,
        c: Vec3,
        r: f64,
        candidates: &[u32],
        scratch: &'a mut ContactScratch,
    ) -> &'a [MeshContact] {
        let ContactScratch { found, leaves, sides, links, blend, contacts } = scratch;
        contacts.clear();
        found.clear();
        let mut nearest: Option<(f64, usize)> = None;
        for &t in candidates {
            let q = closest_on_triangle(c, self.corners(t));
            let d = sub(c, q.point);
            let d2 = dot(d, d);
            if d2 < r * r {
                if nearest.is_none_or(|(least, _)| d2 < least) {
                    nearest = Some((d2, found.len()));
                }
                found.push((t, q));
            }
        }
        let Some((d2, nearest)) = nearest else { return contacts };
        let closed = self.is_closed();
        if closed || d2 <= NO_DIRECTION * NO_DIRECTION * r * r {
            let (t, q) = found[nearest];
            let outward = self.outward(t, &q);
            let d = sub(c, q.point);
            let inside = closed && dot(d, outward) < 0.0;
            if inside || d2 <= NO_DIRECTION * NO_DIRECTION * r * r {
                let depth = d2.sqrt();
                let normal = if depth > NO_DIRECTION * r { scale(-1.0 / depth, d) } else { unit(outward) };
                contacts.push(self.contact(t, &q, normal, r + depth));
                return contacts;
            }
        }

        leaves.clear();
        found.retain(|(_, q)| {
            let d = sub(c, q.point);
            // The far side of a thin wall: the way there leads through the body, past a nearer facet.
            if closed && q.feature == Feature::Face && dot(d, q.area_vector) < 0.0 {
                return false;
            }
            let distance = norm(d);
            let delta = r - distance;
            // A root rounds: what was within the radius by its square may not be by its length.
            if delta > 0.0 {
                leaves.push(Leaf { delta, normal: scale(1.0 / distance, d), rank: rank(q) });
            }
            delta > 0.0
        });
        if leaves.is_empty() {
            return contacts;
        }
        if let ([(t, q)], [leaf]) = (&found[..], &leaves[..]) {
            contacts.push(self.contact(*t, q, leaf.normal, leaf.delta));
            return contacts;
        }
        self.link(c, r, found, leaves, sides, links);
        let shares = blend.weigh(leaves, links, ROUND_OFF * r);
        let mut total = 0.0;
        for (k, share) in shares.iter().enumerate() {
            if share.weight > 0.0 {
                let (t, q) = &found[k];
                let contact = self.contact(*t, q, leaves[k].normal, share.overlap);
                contacts.push(MeshContact { weight: share.weight, ..contact });
                total += share.weight;
            }
        }
        contacts.iter_mut().for_each(|k| k.share = k.weight / total);
        contacts
    }

    /// The links between found facets that share an edge: the largest overlap on the edge.
    fn link(
        &self,
        c: Vec3,
        r: f64,
        found: &[(u32, Closest)],
        leaves: &[Leaf],
        sides: &mut Vec<(u32, u32, u8)>,
        links: &mut Vec<Link>,
    ) {
        let topology = self.topology();
        sides.clear();
        links.clear();
        for (k, (t, _)) in (0u32..).zip(found) {
            for side in 0..3 {
                sides.push((topology.edges[*t as usize][side as usize], k, side));
            }
        }
        sides.sort_unstable();
        for pair in sides.windows(2) {
            let [(edge, i, side_i), (same, j, side_j)] = [pair[0], pair[1]];
            if edge != same {
                continue;
            }
            let (a, b) = (&found[i as usize].1, &found[j as usize].1);
            let lower = leaves[i as usize].delta.min(leaves[j as usize].delta);
            // Taken from the facet where its nearest point is on the edge: the same number, so that it hides exactly.
            let level = if on_side(a, side_i) || on_side(b, side_j) {
                lower
            } else {
                let corners = self.corners(found[i as usize].0);
                let s = side_i as usize;
                let (_, q) = closest_on_segment(c, corners[s], corners[(s + 1) % 3]);
                (r - norm(sub(c, q))).min(lower)
            };
            links.push(Link { level, leaves: [i, j] });
        }
    }

    fn contact(&self, t: u32, q: &Closest, normal: Vec3, overlap: f64) -> MeshContact {
        MeshContact {
            triangle: t,
            weight: 1.0,
            share: 1.0,
            overlap,
            normal,
            point: q.point,
            barycentric: q.weights,
            velocity: self.velocity_at(t, q.weights),
        }
    }

    /// A vector that points out of the body at the nearest point, of any length: the area vector on a face, the sum of the
    /// two unit normals on an edge, the sum weighted by the corner angles at a vertex (Baerentzen and Aanaes, 2005: with
    /// these, its sign tells inside from outside for every closed mesh).
    fn outward(&self, t: u32, q: &Closest) -> Vec3 {
        let topology = self.topology();
        let normal = |f: u32| {
            let [a, b, c] = self.corners(f);
            unit(crate::dem::vec3::cross(sub(b, a), sub(c, a)))
        };
        match q.feature {
            Feature::Face => q.area_vector,
            Feature::Edge(k) => {
                let [f, g] = topology.edge_facets[topology.edges[t as usize][k as usize] as usize];
                add(normal(f), normal(g))
            }
            Feature::Corner(k) => {
                let v = topology.triangles[t as usize][k as usize];
                let corner = topology.corner(v);
                let mut sum = [0.0; 3];
                for &f in topology.around(v) {
                    let p = self.corners(f);
                    let at = topology.triangles[f as usize].iter().position(|&u| topology.corner(u) == corner);
                    let at = at.unwrap_or(0);
                    let (u, w) = (unit(sub(p[(at + 1) % 3], p[at])), unit(sub(p[(at + 2) % 3], p[at])));
                    let angle = dot(u, w).clamp(-1.0, 1.0).acos();
                    sum = add(sum, scale(angle, normal(f)));
                }
                sum
            }
        }
    }
}

/// Which of two facets that touch at the same point is the contact: a face before an edge, an edge before a corner (their
/// normals are exact to round-off over the facet's size, not over the distance from the edge), and last a facet without
/// area, which cannot carry a couple.
fn rank(q: &Closest) -> u8 {
    match q.feature {
        _ if q.degenerate => 3,
        Feature::Face => 0,
        Feature::Edge(_) => 1,
        Feature::Corner(_) => 2,
    }
}

fn on_side(q: &Closest, side: u8) -> bool {
    match q.feature {
        Feature::Face => false,
        Feature::Edge(k) => k == side,
        Feature::Corner(k) => k == side || k == (side + 1) % 3,
    }
}

fn unit(v: Vec3) -> Vec3 {
    let length = norm(v);
    if length > 0.0 { scale(1.0 / length, v) } else { v }
}

/// Which of a pair's old contacts, given by their normals, a contact with normal `n` continues, and how far (the factor
/// on the history it takes over, above 0 and at most 1); `None` for a new contact, which starts without history.
///
/// History belongs to the pair of grain and body: facets do not matter, so it survives the crossing of edges. Several
/// contacts may continue one old contact: where facets of one surface share a contact, each carries the whole
/// history and its weight counts it once.
#[inline]
pub fn inherited(n: Vec3, old_normals: impl Iterator<Item = Vec3>) -> Option<(usize, f64)> {
    let mut best: Option<(usize, f64, f64)> = None;
    for (k, m) in old_normals.enumerate() {
        let (like, closeness) = (likeness(n, m), dot(n, m));
        if like > 0.0 && best.is_none_or(|(_, _, most)| closeness > most) {
            best = Some((k, like, closeness));
        }
    }
    best.map(|(k, like, _)| (k, like))
}
