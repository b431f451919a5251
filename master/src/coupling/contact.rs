//! A power bond through the vertices of a mesh: forces on some of them one way, velocities of all of them the other.

use super::connect::Links;
use crate::check::plan::{ContactPair, Plan};
use crate::loading::{Outputs, Slot};

/// Forces and velocities of a contact, with what both sides hold over a step.
///
/// The same formula as for scalars (see [`super::bonds`]), summed over vertices: the mesh's own velocity is the mean of both ends of the step, the terrain's own
/// force is its mean over the step as it tells it at the end.
#[derive(Clone, Debug)]
pub struct Contact {
    terrain: usize,
    mesh: usize,
    force: Slot,
    index: Slot,
    velocity: Slot,
    /// What the mesh holds: forces (N) and their vertices.
    held_force: Vec<f64>,
    held_index: Vec<i32>,
    /// What the terrain holds, which is what the mesh's velocities (m/s) are at the beginning.
    held_velocity: Vec<f64>,
    begin: Vec<f64>,
    /// What of the step under way has been noted, of the mesh and of the terrain: an iteration gives inputs several times, arrays only the first.
    noted: [bool; 2],
    /// What the mesh takes, what the terrain gives (W).
    terms: [f64; 2],
}

impl Contact {
    /// Resolves a pair of the plan; `None` where one of its connections is served at the start only.
    pub fn new(plan: &Plan, links: &Links, pair: ContactPair) -> Option<Self> {
        let c = &plan.arrays[pair.effort];
        Some(Self {
            terrain: c.from.component,
            mesh: c.to.component,
            force: links.array_slot(plan, pair.effort)?,
            index: links.array_slot(plan, pair.index)?,
            velocity: links.array_slot(plan, pair.flow)?,
            held_force: Vec::new(),
            held_index: Vec::new(),
            held_velocity: Vec::new(),
            begin: Vec::new(),
            noted: [false; 2],
            terms: [0.0; 2],
        })
    }

    /// A unit has been given its inputs: notes what it holds and how it begins.
    pub fn begin(&mut self, unit: usize, outputs: &[Outputs]) {
        if unit == self.mesh && !std::mem::replace(&mut self.noted[0], true) {
            self.held_force.keep(outputs[self.terrain].reals_of(self.force));
            self.held_index.keep(outputs[self.terrain].integers_of(self.index));
            self.begin.keep(outputs[self.mesh].reals_of(self.velocity));
        }
        if unit == self.terrain && !std::mem::replace(&mut self.noted[1], true) {
            self.held_velocity.keep(outputs[self.mesh].reals_of(self.velocity));
        }
    }

    /// A step that was begun does not count.
    pub fn forget(&mut self) {
        self.noted = [false; 2];
    }

    /// The step just done, as far as its units are here: power that the mesh takes, power that the terrain gives (W).
    pub fn end(&mut self, outputs: &[Outputs], is_here: impl Fn(usize) -> bool) {
        self.forget();
        if is_here(self.mesh) {
            let end = outputs[self.mesh].reals_of(self.velocity);
            let of = |values: &[f64], i: usize| values.get(i).copied().unwrap_or(0.0);
            let mean = |i: usize| 0.5 * (of(&self.begin, i) + of(end, i));
            self.terms[0] = power(&self.held_force, &self.held_index, mean);
        }
        if is_here(self.terrain) {
            let terrain = &outputs[self.terrain];
            let held = |i: usize| self.held_velocity.get(i).copied().unwrap_or(0.0);
            self.terms[1] = power(terrain.reals_of(self.force), terrain.integers_of(self.index), held);
        }
    }

    /// Both powers with the unit that computes each.
    pub fn terms(&mut self) -> [(usize, &mut f64); 2] {
        let [taken, given] = &mut self.terms;
        [(self.mesh, taken), (self.terrain, given)]
    }

    /// Power that the coupling makes, and power that passes (W).
    pub fn made_and_passed(&self) -> (f64, f64) {
        let [taken, given] = self.terms;
        (taken - given, taken)
    }
}

/// Sum of force times velocity; vertices that do not exist count as at rest.
fn power(force: &[f64], index: &[i32], velocity: impl Fn(usize) -> f64) -> f64 {
    let at = |&i: &i32| usize::try_from(i).map_or(usize::MAX / 4, |i| 3 * i);
    let one = |(f, i): (&[f64], &i32)| (0..3).map(|k| f[k] * velocity(at(i) + k)).sum::<f64>();
    force.chunks_exact(3).zip(index).map(one).sum()
}

/// Copies into a list that keeps its room.
trait Keep<T> {
    fn keep(&mut self, from: &[T]);
}

impl<T: Copy> Keep<T> for Vec<T> {
    fn keep(&mut self, from: &[T]) {
        self.clear();
        self.extend_from_slice(from);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn forces_work_on_the_vertices_they_belong_to() {
        let velocity = [0.0, 0.0, 0.0, 1.0, 2.0, 3.0, 0.0, 0.0, -1.0];
        let of = |i: usize| velocity.get(i).copied().unwrap_or(0.0);
        assert_eq!(power(&[1.0, 1.0, 1.0, 5.0, 5.0, 2.0], &[1, 2], of), 6.0 - 2.0);
        assert_eq!(power(&[1.0, 1.0, 1.0], &[7], of), 0.0);
        assert_eq!(power(&[1.0, 1.0, 1.0], &[-1], of), 0.0);
    }
}
