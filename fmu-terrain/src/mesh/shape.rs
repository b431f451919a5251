//! A mesh as a body of the granular engine.

use super::body::MeshBody;
use super::broad::FacetGrid;
use super::narrow::ContactScratch;
use crate::dem::body::{BodyTouch, Shape};
use crate::dem::vec3::Vec3;
use std::cell::RefCell;

/// A mesh body with its facet grid. The grid is refitted when the mesh has moved by half a cell; until then the search
/// reaches further by how far it has moved. When it is refitted changes no contact: only how many facets are looked at.
pub struct MeshShape {
    body: MeshBody,
    grid: FacetGrid,
    drift: f64,
    /// Of the vertices alone: what sleeps by it must be the same for a mesh that was made anew from a saved state.
    bounds: [Vec3; 2],
}

thread_local! {
    /// Candidates and scratch of this thread: no contact allocates. Nothing in it outlives a call.
    static SCRATCH: RefCell<(Vec<u32>, ContactScratch)> = RefCell::default();
}

impl MeshShape {
    /// A body as it lies now.
    pub fn new(mut body: MeshBody) -> Self {
        let mut grid = FacetGrid::default();
        grid.refit(&mut body);
        let bounds = around(body.positions().iter().copied());
        Self { body, grid, drift: 0.0, bounds }
    }

    /// The body.
    pub fn body(&self) -> &MeshBody {
        &self.body
    }

    /// Gives the body new vertices or a new state by `change`, at a communication point.
    ///
    /// # Errors
    /// Those of `change`.
    pub fn update<E>(&mut self, change: impl FnOnce(&mut MeshBody) -> Result<(), E>) -> Result<(), E> {
        change(&mut self.body)?;
        self.moved();
        Ok(())
    }

    /// The box that a deforming mesh will be in at `t` (s), which it is not moved to.
    pub fn bounds_at(&self, t: f64) -> Option<[Vec3; 2]> {
        self.body.vertices_at(t).map(around)
    }

    fn moved(&mut self) {
        self.drift = self.body.drift();
        if self.drift > 0.5 * self.grid.cell_size() {
            self.grid.refit(&mut self.body);
            self.drift = 0.0;
        }
        self.bounds = around(self.body.positions().iter().copied());
    }
}

/// The box around points.
fn around(points: impl Iterator<Item = Vec3>) -> [Vec3; 2] {
    points.fold([[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]], |[low, high], p| {
        [std::array::from_fn(|c| low[c].min(p[c])), std::array::from_fn(|c| high[c].max(p[c]))]
    })
}

impl Shape for MeshShape {
    fn move_to(&mut self, t: f64) {
        self.body.move_to(t);
        self.moved();
    }

    fn bounds(&self) -> [Vec3; 2] {
        self.bounds
    }

    fn touches(&self, centre: Vec3, radius: f64, out: &mut Vec<BodyTouch>) {
        SCRATCH.with_borrow_mut(|(near, scratch)| {
            near.clear();
            self.grid.near(centre, radius + self.drift, near);
            if near.is_empty() {
                return;
            }
            out.extend(self.body.contacts(centre, radius, near, scratch).iter().map(|k| BodyTouch {
                overlap: k.overlap,
                weight: k.weight,
                share: k.share,
                normal: k.normal,
                point: k.point,
                velocity: k.velocity,
                angular_velocity: self.body.spin_at(k.triangle),
                vertices: self.body.triangles()[k.triangle as usize],
                weights: k.barycentric,
            }));
        });
    }

    fn centre(&self) -> Vec3 {
        self.body.center()
    }

    fn vertices(&self) -> usize {
        self.body.positions().len()
    }

    fn vertex(&self, k: usize) -> Vec3 {
        self.body.positions()[k]
    }

    fn as_mesh(&mut self) -> Option<&mut MeshShape> {
        Some(self)
    }

    fn positions(&self) -> &[Vec3] {
        self.body.positions()
    }

    fn surface(&self, out: &mut Vec<(Vec3, Vec3)>) {
        out.extend(self.body.positions().iter().copied().zip(self.body.velocities().iter().copied()));
    }
}
