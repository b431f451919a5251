//! A body of shells: nodes, elements grouped by type, and the forces of all of them.

use super::AncfError;
use super::batch::{Batch, BatchForces, Momentum};
use super::element::ElementType;
use super::kernel::{self, Loads};
use super::laminate::Laminate;
use super::strain::COORDS;
use super::team::Team;
use std::collections::BTreeMap;
use terramech_simd::{WIDTH, active, dispatch};

/// Coordinates per node: position, director.
pub const NODE: usize = 6;

/// What one task of a team does: a whole number of microseconds' work.
const BATCHES_PER_TASK: usize = 20;
const NODES_PER_TASK: usize = 500;

/// Faulty elements named in one message.
const FAULTS_TOLD: usize = 8;

/// One element of a mesh description.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shell {
    /// Nodes A, B, C, D: counter-clockwise seen from the director's side; local x runs from A to B.
    pub nodes: [u32; 4],
    /// Which laminate.
    pub laminate: u32,
}

/// Shells with their reference shape. Immutable; states live outside.
#[derive(Debug, Clone)]
pub struct ShellMesh {
    reference: Vec<f64>,
    pub(super) shells: Vec<Shell>,
    pub(super) kinds: Vec<ElementType>,
    kind_of: Vec<u32>,
    pub(super) batches: Vec<Batch>,
    /// Places of a node's force contributions in the batch buffer, in ascending order of element: the canonical order of sums.
    places: Vec<u32>,
    place_start: Vec<u32>,
}

/// Memory for [`ShellMesh::forces`], kept between calls, and the threads it may run on.
#[derive(Debug, Clone, Default)]
pub struct ForceBuffer {
    values: Vec<[f64; WIDTH]>,
    team: Team,
}

impl ForceBuffer {
    /// Memory that lets a team do the work.
    pub fn with_team(team: Team) -> Self {
        Self { values: Vec::new(), team }
    }
}

impl ShellMesh {
    /// Takes the nodes' reference coordinates (6 per node: position m, unit director), the elements and the laminates they name.
    ///
    /// # Errors
    /// [`AncfError::Input`] with all faults found, each with its element.
    pub fn new(reference: Vec<f64>, shells: Vec<Shell>, laminates: &[Laminate]) -> Result<Self, AncfError> {
        let nodes = reference.len() / NODE;
        let mut faults = Vec::new();
        let mut kinds: Vec<ElementType> = Vec::new();
        let mut known: BTreeMap<Vec<i64>, u32> = BTreeMap::new();
        let mut kind_of = Vec::with_capacity(shells.len());
        for (index, shell) in shells.iter().enumerate() {
            let Some(laminate) = laminates.get(shell.laminate as usize) else {
                faults.push(format!("element {index}: laminate {} of {}", shell.laminate, laminates.len()));
                continue;
            };
            if shell.nodes.iter().any(|&n| n as usize >= nodes) {
                faults.push(format!("element {index}: nodes {:?}, but there are {nodes}", shell.nodes));
                continue;
            }
            let q = gather(&reference, &shell.nodes);
            let key = congruence_key(&q, shell.laminate, 0.5 * laminate.thickness());
            let kind = match known.get(&key) {
                Some(&kind) => kind,
                None => match ElementType::new(&q, laminate) {
                    Ok(kind) => {
                        kinds.push(kind);
                        known.insert(key, kinds.len() as u32 - 1);
                        kinds.len() as u32 - 1
                    }
                    Err(AncfError::Input(list)) => {
                        // One line per element: a mesh that is wound wrongly is wrong everywhere.
                        faults.push(format!("element {index}: {}", list[0]));
                        continue;
                    }
                    Err(other) => return Err(other),
                },
            };
            kind_of.push(kind);
        }
        if !faults.is_empty() {
            let more = faults.len().saturating_sub(FAULTS_TOLD);
            faults.truncate(FAULTS_TOLD);
            if more > 0 {
                faults.push(format!("and {more} more elements"));
            }
            return Err(AncfError::Input(faults));
        }
        let batches = batches(&kind_of, kinds.len());
        let (place_start, places) = places(nodes, &shells, &batches);
        Ok(Self { reference, shells, kinds, kind_of, batches, places, place_start })
    }

    /// Number of nodes.
    pub fn node_count(&self) -> usize {
        self.reference.len() / NODE
    }

    /// Reference coordinates, 6 per node.
    pub fn reference(&self) -> &[f64] {
        &self.reference
    }

    /// The elements.
    pub fn shells(&self) -> &[Shell] {
        &self.shells
    }

    /// The distinct element types.
    pub fn kinds(&self) -> &[ElementType] {
        &self.kinds
    }

    /// The type of an element.
    pub fn kind(&self, element: usize) -> &ElementType {
        &self.kinds[self.kind_of[element] as usize]
    }

    /// Mass of all elements, kg.
    pub fn total_mass(&self) -> f64 {
        self.kind_of.iter().map(|&k| self.kinds[k as usize].total_mass()).sum()
    }

    /// Forces on all nodes: internal, damping and pressure into `force`, and the inertia `M a` into `inertia` (give `a - g` for gravity);
    /// N and N m, 6 per node. The sums run in the order of elements.
    pub fn forces(
        &self,
        loads: &Loads,
        q: &[f64],
        v: &[f64],
        a: &[f64],
        buffer: &mut ForceBuffer,
        force: &mut [f64],
        inertia: &mut [f64],
    ) {
        let ForceBuffer { values, team } = buffer;
        values.resize(self.batches.len() * 2 * COORDS, [0.0; WIDTH]);
        team.chunks(values, 2 * COORDS * BATCHES_PER_TASK, |task, buffer| {
            let first = task * BATCHES_PER_TASK;
            let batches = &self.batches[first..first + buffer.len() / (2 * COORDS)];
            dispatch(active(), BatchForces { mesh: self, batches, loads, q, v, a, buffer });
        });
        let sum = |node: usize, first: usize, out: &mut [f64]| {
            let mut f = [0.0; NODE];
            for &place in &self.places[self.place_start[node] as usize..self.place_start[node + 1] as usize] {
                let (slot, lane) = (place as usize / WIDTH, place as usize % WIDTH);
                for k in 0..NODE {
                    f[k] += values[first + slot + k][lane];
                }
            }
            out.copy_from_slice(&f);
        };
        for (first, out) in [(0, force), (COORDS, inertia)] {
            team.chunks(out, NODE * NODES_PER_TASK, |task, out| {
                for (k, out) in out.chunks_exact_mut(NODE).enumerate() {
                    sum(task * NODES_PER_TASK + k, first, out);
                }
            });
        }
    }

    /// Strain energy, J, and power dissipated by the structural damping, W.
    pub fn energy(&self, damping: f64, q: &[f64], v: &[f64]) -> (f64, f64) {
        (0..self.shells.len()).fold((0.0, 0.0), |(energy, power), e| {
            let nodes = &self.shells[e].nodes;
            let (de, dp) = kernel::energy(self.kind(e), damping, &gather(q, nodes), &gather(v, nodes));
            (energy + de, power + dp)
        })
    }

    /// Kinetic energy, J.
    pub fn kinetic_energy(&self, v: &[f64]) -> f64 {
        let mut sum = 0.0;
        for e in 0..self.shells.len() {
            let local = gather(v, &self.shells[e].nodes);
            let mass = &self.kind(e).mass;
            for i in 0..8 {
                for j in 0..8 {
                    sum += 0.5 * mass[i][j] * (0..3).map(|c| local[3 * i + c] * local[3 * j + c]).sum::<f64>();
                }
            }
        }
        sum
    }

    /// Momentum (kg m/s), angular momentum about `about` (kg m2/s) and first moment of mass (kg m) of all elements.
    pub fn momentum(&self, q: &[f64], v: &[f64], about: &[f64; 3]) -> [[f64; 3]; 3] {
        dispatch(active(), Momentum { mesh: self, q, v, about })
    }

    /// The first element whose volume at its centre is below `least` of the reference volume, with that ratio.
    pub fn first_inverted(&self, q: &[f64], least: f64) -> Option<(usize, f64)> {
        (0..self.shells.len()).find_map(|e| {
            let local = gather(q, &self.shells[e].nodes);
            let ratio = centre_volume(&local, self.kind(e).half) / self.kind(e).volume;
            // Written so that NaN counts as inverted.
            if ratio > least { None } else { Some((e, ratio)) }
        })
    }
}

/// Coordinates of an element out of those of all nodes.
#[inline(always)]
pub fn gather(q: &[f64], nodes: &[u32; 4]) -> [f64; COORDS] {
    std::array::from_fn(|c| q[NODE * nodes[c / NODE] as usize + c % NODE])
}

/// Base vectors' triple product at the centre, m3.
fn centre_volume(q: &[f64; COORDS], half: f64) -> f64 {
    let sum = |signs: [f64; 4], k: usize| -> f64 { (0..4).map(|i| 0.25 * signs[i] * q[NODE * i + k]).sum() };
    let x: [f64; 3] = std::array::from_fn(|k| sum([-1.0, 1.0, 1.0, -1.0], k));
    let y: [f64; 3] = std::array::from_fn(|k| sum([-1.0, -1.0, 1.0, 1.0], k));
    let s: [f64; 3] = std::array::from_fn(|k| half * sum([1.0; 4], 3 + k));
    super::strain::dot(&super::strain::cross(&x, &y), &s)
}

/// Equal for reference shapes that differ by a rigid motion: the rounded scalar products of corner vectors. A difference at the edge of
/// rounding only costs one more type.
fn congruence_key(q: &[f64; COORDS], laminate: u32, half: f64) -> Vec<i64> {
    let mut vectors: Vec<[f64; 3]> = (1..4).map(|i| std::array::from_fn(|k| q[NODE * i + k] - q[k])).collect();
    // A length that turning does not change.
    let size = vectors.iter().map(|x| super::strain::dot(x, x).sqrt()).fold(0.0, f64::max);
    vectors.extend((0..4).map(|i| std::array::from_fn(|k| q[NODE * i + 3 + k])));
    let mut key = vec![i64::from(laminate)];
    for i in 0..vectors.len() {
        for j in i..vectors.len() {
            let length = |k: usize| if k < 3 { size } else { 1.0 };
            let product = super::strain::dot(&vectors[i], &vectors[j]) / (length(i) * length(j));
            key.push((product * 1e10).round() as i64);
        }
    }
    key.push((centre_volume(q, half).signum()) as i64);
    key.push((size / half * 1e8).round() as i64);
    key.push((size * 1e12).round() as i64);
    key
}

fn batches(kind_of: &[u32], kinds: usize) -> Vec<Batch> {
    let mut by_kind = vec![Vec::new(); kinds];
    for (e, &kind) in kind_of.iter().enumerate() {
        by_kind[kind as usize].push(e as u32);
    }
    let mut batches = Vec::new();
    for (kind, members) in by_kind.iter().enumerate() {
        for chunk in members.chunks(WIDTH) {
            let elements = std::array::from_fn(|k| chunk[k.min(chunk.len() - 1)]);
            batches.push(Batch { kind: kind as u32, elements, count: chunk.len() as u32 });
        }
    }
    batches
}

fn places(nodes: usize, shells: &[Shell], batches: &[Batch]) -> (Vec<u32>, Vec<u32>) {
    let mut slot_of = vec![(0usize, 0usize); shells.len()];
    for (b, batch) in batches.iter().enumerate() {
        // Backwards, so that a repeated element keeps its first lane.
        for lane in (0..WIDTH).rev() {
            slot_of[batch.elements[lane] as usize] = (b, lane);
        }
    }
    let mut lists = vec![Vec::new(); nodes];
    for (shell, &(batch, lane)) in shells.iter().zip(&slot_of) {
        for corner in 0..4 {
            lists[shell.nodes[corner] as usize].push(((batch * 2 * COORDS + NODE * corner) * WIDTH + lane) as u32);
        }
    }
    let mut start = vec![0u32];
    let mut places = Vec::new();
    for list in lists {
        places.extend(list);
        start.push(places.len() as u32);
    }
    (start, places)
}
