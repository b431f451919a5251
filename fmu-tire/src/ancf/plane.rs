//! Contact of the surface's vertices with a rigid plane: penalty with Coulomb friction.
//!
//! A vertex below the plane feels `k d - c d'` along the normal (never pulled) and, tangentially, a spring to the point where it touched,
//! which slides along so that the force stays within `mu` times the normal force: static friction without creep.

use super::external::{Block, External};
use super::spec::Contact;
use super::surface::{Surface, Vertex};
use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

/// The plane and the memory of its contacts.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Plane {
    /// Unit normal, towards the tire.
    pub normal: [f64; 3],
    /// Distance of the plane from the origin along the normal, m.
    pub height: f64,
    /// Velocity of the plane (a moving road), m/s; tangential.
    pub velocity: [f64; 3],
    /// Per vertex in contact: where its tangential spring is attached, m.
    pub anchors: Vec<(u32, [f64; 3])>,
}

impl Plane {
    /// A horizontal plane at a height, m.
    pub fn horizontal(height: f64) -> Self {
        Self { normal: [0.0, 0.0, 1.0], height, velocity: [0.0; 3], anchors: Vec::new() }
    }
}

/// The plane's load on the vertices of a surface.
#[derive(Debug, Clone, Copy)]
pub struct PlaneLoad<'a> {
    /// The plane; its anchors are those at the beginning of the step.
    pub plane: &'a Plane,
    /// What it may touch.
    pub surface: &'a Surface,
    /// Constants.
    pub contact: &'a Contact,
    /// Time since the anchors were set, s: a moving plane carries them along.
    pub since: f64,
}

struct Touch {
    normal_force: f64,
    friction: Vector3<f64>,
    sticks: bool,
    /// Limit over the spring's force, 1 if it sticks.
    share: f64,
}

impl PlaneLoad<'_> {
    fn touch(&self, vertex: usize, q: &[f64], v: &[f64]) -> Option<Touch> {
        let normal = Vector3::from(self.plane.normal);
        let x = self.surface.at(vertex, q);
        let depth = self.plane.height - normal.dot(&x);
        if depth <= 0.0 {
            return None;
        }
        let speed = self.surface.at(vertex, v);
        let normal_force =
            (self.contact.normal_stiffness * depth - self.contact.normal_damping * normal.dot(&speed)).max(0.0);
        let slip = x - self.anchor(vertex, &x);
        let spring = (slip - normal * normal.dot(&slip)) * -self.contact.tangential_stiffness;
        let (size, limit) = (spring.norm(), self.contact.friction * normal_force);
        let sticks = size <= limit;
        let friction = if sticks { spring } else { spring * (limit / size) };
        Some(Touch { normal_force, friction, sticks, share: if sticks { 1.0 } else { limit / size } })
    }

    fn anchor(&self, vertex: usize, x: &Vector3<f64>) -> Vector3<f64> {
        let anchors = &self.plane.anchors;
        match anchors.binary_search_by_key(&(vertex as u32), |a| a.0) {
            Ok(k) => Vector3::from(anchors[k].1) + Vector3::from(self.plane.velocity) * self.since,
            Err(_) => *x,
        }
    }

    /// The contacts of a state: vertex and force on it, N.
    pub fn forces(&self, q: &[f64], v: &[f64]) -> Vec<(u32, [f64; 3])> {
        let normal = Vector3::from(self.plane.normal);
        (0..self.surface.len())
            .filter_map(|n| self.touch(n, q, v).map(|t| (n as u32, (normal * t.normal_force + t.friction).into())))
            .collect()
    }

    /// Anchors after a step that ended in a state: dragged along where the vertex slid, new where it touched.
    pub fn anchors(&self, q: &[f64], v: &[f64]) -> Vec<(u32, [f64; 3])> {
        let mut out = Vec::new();
        for vertex in 0..self.surface.len() {
            if let Some(touch) = self.touch(vertex, q, v) {
                let x = self.surface.at(vertex, q);
                let anchor = if self.contact.tangential_stiffness > 0.0 {
                    x + touch.friction / self.contact.tangential_stiffness
                } else {
                    x
                };
                out.push((vertex as u32, anchor.into()));
            }
        }
        out
    }
}

impl External for PlaneLoad<'_> {
    fn add_force(&self, scale: f64, _: f64, q: &[f64], v: &[f64], force: &mut [f64]) {
        let normal = Vector3::from(self.plane.normal);
        for vertex in 0..self.surface.len() {
            if let Some(t) = self.touch(vertex, q, v) {
                let f = (normal * t.normal_force + t.friction) * scale;
                self.surface.add(vertex, &f.into(), force);
            }
        }
    }

    fn add_tangent(&self, scale: f64, stiffness: f64, velocity: f64, q: &[f64], v: &[f64], blocks: &mut Vec<Block>) {
        let normal = Vector3::from(self.plane.normal);
        let along = normal * normal.transpose();
        let across = Matrix3::identity() - along;
        for vertex in 0..self.surface.len() {
            if let Some(t) = self.touch(vertex, q, v) {
                let mut block =
                    along * (stiffness * self.contact.normal_stiffness + velocity * self.contact.normal_damping);
                if t.sticks {
                    block += across * (stiffness * self.contact.tangential_stiffness);
                } else if t.normal_force > 0.0 {
                    // Sliding: friction grows with depth (not symmetric), and turns with its direction.
                    let s = t.friction / (self.contact.friction * t.normal_force);
                    block += s
                        * normal.transpose()
                        * (self.contact.friction
                            * (stiffness * self.contact.normal_stiffness + velocity * self.contact.normal_damping));
                    block += (across - s * s.transpose()) * (stiffness * self.contact.tangential_stiffness * t.share);
                }
                let b = block * scale;
                let stiffness = std::array::from_fn(|r| std::array::from_fn(|c| b[(r, c)]));
                let Vertex { node, offset } = self.surface.vertex(vertex);
                blocks.push(Block { node, offset, stiffness });
            }
        }
    }
}
