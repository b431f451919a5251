//! The tangent of a mesh as a sparse symmetric matrix over its free nodes.

use super::AncfError;
use super::external::Block;
use super::kernel::{self, Loads, TangentWeights};
use super::mesh::{NODE, ShellMesh};
use super::strain::COORDS;
use super::team::Team;
use terramech_mechanics::sparse::{Precision, SymmetricPattern, SymmetricSolver, block_order};
use terramech_simd::{Kernel, Lanes, active, dispatch};

/// Which coordinates of a node are prescribed: position x, y, z, director x, y, z.
pub type Fixed = [bool; NODE];

const NONE: u32 = u32::MAX;

/// Free coordinates, sparse pattern and scatter table of a mesh with given constraints.
///
/// Nodes with all six coordinates prescribed leave the system; a single prescribed coordinate stays as a row of the identity.
#[derive(Debug)]
pub struct Assembly {
    /// Block index of each node, or `NONE`.
    block_of: Vec<u32>,
    /// Node of each block.
    node_of: Vec<u32>,
    /// Rows of the free system that are pinned.
    pinned: Vec<bool>,
    any_pinned: bool,
    /// Start of a block column's values, and the blocks below the diagonal in it.
    column_start: Vec<u32>,
    below: Vec<u32>,
    /// Per element and pair of corners: the position among the blocks of its column (0 = diagonal), `NONE` if not free.
    scatter: Vec<[[u32; 4]; 4]>,
    values: Vec<f64>,
    solver: SymmetricSolver,
    team: Team,
    /// Tangents of the elements under way.
    tangents: Vec<[[f64; COORDS]; COORDS]>,
}

/// Elements whose tangents are computed before they are scattered: they stay in the cache.
const ELEMENTS_AT_ONCE: usize = 64;
const ELEMENTS_PER_TASK: usize = 8;

impl Assembly {
    /// Analyses the mesh with the given constraints, one per node.
    ///
    /// # Errors
    /// [`AncfError::Sparse`] if the analysis fails.
    pub fn new(mesh: &ShellMesh, fixed: &[Fixed], precision: Precision) -> Result<Self, AncfError> {
        let mut block_of = vec![NONE; mesh.node_count()];
        let mut node_of = Vec::new();
        for (node, f) in fixed.iter().enumerate() {
            if !f.iter().all(|&x| x) {
                block_of[node] = node_of.len() as u32;
                node_of.push(node as u32);
            }
        }
        let blocks = node_of.len();
        let mut neighbours = vec![vec![]; blocks];
        for shell in mesh.shells() {
            for a in shell.nodes {
                for b in shell.nodes {
                    let (ia, ib) = (block_of[a as usize], block_of[b as usize]);
                    if ia != NONE && ib != NONE && ia > ib {
                        neighbours[ib as usize].push(ia as usize);
                    }
                }
            }
        }
        neighbours.iter_mut().for_each(|list| {
            list.sort_unstable();
            list.dedup();
        });
        let (nodes, rows) = patterns(&neighbours)?;
        let order = block_order(&nodes, NODE)?;
        let mut column_start = Vec::with_capacity(blocks);
        let mut start = 0u32;
        for list in &neighbours {
            column_start.push(start);
            start += (NODE * (NODE + 1) / 2 + NODE * NODE * list.len()) as u32;
        }
        let place = |row: u32, column: u32| -> u32 {
            if row == NONE || column == NONE || row < column {
                NONE
            } else if row == column {
                0
            } else {
                neighbours[column as usize].binary_search(&(row as usize)).map_or(NONE, |k| k as u32 + 1)
            }
        };
        let scatter = mesh
            .shells()
            .iter()
            .map(|shell| {
                let block = shell.nodes.map(|n| block_of[n as usize]);
                block.map(|row| block.map(|column| place(row, column)))
            })
            .collect();
        let pinned: Vec<bool> = node_of.iter().flat_map(|&n| fixed[n as usize]).collect();
        Ok(Self {
            any_pinned: pinned.iter().any(|&p| p),
            pinned,
            below: neighbours.iter().map(|l| l.len() as u32).collect(),
            block_of,
            node_of,
            column_start,
            scatter,
            values: vec![0.0; rows.row_idx().len()],
            team: Team::default(),
            tangents: vec![[[0.0; COORDS]; COORDS]; ELEMENTS_AT_ONCE],
            solver: SymmetricSolver::new(rows, Some(&order), precision)?,
        })
    }

    /// Lets a team do the element work.
    pub fn set_team(&mut self, team: Team) {
        self.team = team;
    }

    /// Rows of the free system.
    pub fn len(&self) -> usize {
        NODE * self.node_of.len()
    }

    /// True if nothing is free.
    pub fn is_empty(&self) -> bool {
        self.node_of.is_empty()
    }

    /// Block of six rows of a node, if it is free.
    pub fn block(&self, node: u32) -> Option<u32> {
        self.block_of.get(node as usize).copied().filter(|&b| b != NONE)
    }

    /// Node of each block of six rows.
    pub fn free_nodes(&self) -> &[u32] {
        &self.node_of
    }

    /// The solver, for its figures.
    pub fn solver(&self) -> &SymmetricSolver {
        &self.solver
    }

    /// Takes the free rows out of a vector over all coordinates; pinned rows become 0.
    pub fn restrict(&self, full: &[f64], free: &mut [f64]) {
        for (block, &node) in self.node_of.iter().enumerate() {
            free[NODE * block..NODE * block + NODE]
                .copy_from_slice(&full[NODE * node as usize..NODE * node as usize + NODE]);
        }
        if self.any_pinned {
            free.iter_mut().zip(&self.pinned).filter(|(_, p)| **p).for_each(|(x, _)| *x = 0.0);
        }
    }

    /// Adds `factor` times a free vector to one over all coordinates.
    pub fn add_to(&self, full: &mut [f64], factor: f64, free: &[f64]) {
        for (block, &node) in self.node_of.iter().enumerate() {
            for k in 0..NODE {
                full[NODE * node as usize + k] += factor * free[NODE * block + k];
            }
        }
    }

    /// Assembles the tangent (its symmetric part) at a state and factorises it. `extra` adds what the ground does to
    /// vertices, already weighted.
    ///
    /// # Errors
    /// [`AncfError::Sparse`] if the factorisation fails.
    pub fn factor(
        &mut self,
        mesh: &ShellMesh,
        loads: &Loads,
        q: &[f64],
        weights: &TangentWeights,
        extra: &[Block],
    ) -> Result<(), AncfError> {
        self.assemble(mesh, loads, q, weights, extra);
        self.solver.factor(&self.values)?;
        Ok(())
    }

    /// The assembly alone; see [`factor`](Self::factor).
    pub fn assemble(&mut self, mesh: &ShellMesh, loads: &Loads, q: &[f64], weights: &TangentWeights, extra: &[Block]) {
        self.values.fill(0.0);
        let mut tangents = std::mem::take(&mut self.tangents);
        for first in (0..mesh.shells().len()).step_by(ELEMENTS_AT_ONCE) {
            let count = ELEMENTS_AT_ONCE.min(mesh.shells().len() - first);
            self.team.chunks(&mut tangents[..count], ELEMENTS_PER_TASK, |task, out| {
                let first = first + ELEMENTS_PER_TASK * task;
                dispatch(active(), Tangents { mesh, loads, q, weights, first, out });
            });
            for (e, k) in (first..).zip(&tangents[..count]) {
                let blocks = mesh.shells()[e].nodes.map(|n| self.block_of[n as usize]);
                self.scatter_element(e, blocks, k);
            }
        }
        self.tangents = tangents;
        for Block { node, offset, stiffness } in extra {
            let column = self.block_of[*node as usize];
            if column != NONE {
                let share = |k: usize| if k < 3 { 1.0 } else { *offset };
                for c in 0..NODE {
                    for r in c..NODE {
                        let place = self.place(column as usize, 0, r, c);
                        let both = stiffness[r % 3][c % 3] + stiffness[c % 3][r % 3];
                        self.values[place] += 0.5 * share(r) * share(c) * both;
                    }
                }
            }
        }
        if self.any_pinned {
            self.pin();
        }
    }

    /// Factorises what [`assemble`](Self::assemble) left.
    ///
    /// # Errors
    /// [`AncfError::Sparse`].
    pub fn factorise(&mut self) -> Result<(), AncfError> {
        Ok(self.solver.factor(&self.values)?)
    }

    /// Mean of the diagonal over each free node's position in what was assembled last, N/m, by block.
    pub fn mean_diagonal(&self) -> Vec<f64> {
        let at = |b: usize, k: usize| self.values[self.place(b, 0, k, k)];
        (0..self.node_of.len()).map(|b| (at(b, 0) + at(b, 1) + at(b, 2)) / 3.0).collect()
    }

    /// Solves with the kept factor, in place.
    pub fn solve(&mut self, free: &mut [f64]) {
        self.solver.solve_in_place(free);
    }

    /// Index of a value: block column, block below the diagonal (0 = diagonal), row and column inside the block.
    #[inline(always)]
    fn place(&self, column: usize, block: usize, r: usize, c: usize) -> usize {
        let below = NODE * self.below[column] as usize;
        // Columns 0..c of the block column have NODE - i + below entries each.
        let start = self.column_start[column] as usize + c * (NODE + below) - c * c.saturating_sub(1) / 2;
        if block == 0 { start + r - c } else { start + NODE - c + NODE * (block - 1) + r }
    }

    #[inline(always)]
    fn scatter_element(&mut self, e: usize, blocks: [u32; 4], k: &[[f64; COORDS]; COORDS]) {
        for a in 0..4 {
            for b in 0..4 {
                let block = self.scatter[e][a][b];
                if block == NONE {
                    continue;
                }
                for c in 0..NODE {
                    let first = if block == 0 { c } else { 0 };
                    let start = self.place(blocks[b] as usize, block as usize, first, c);
                    for r in first..NODE {
                        let (i, j) = (NODE * a + r, NODE * b + c);
                        self.values[start + r - first] += 0.5 * (k[i][j] + k[j][i]);
                    }
                }
            }
        }
    }

    fn pin(&mut self) {
        let pattern = self.solver.pattern();
        for column in 0..pattern.len() {
            for place in pattern.col_ptr()[column]..pattern.col_ptr()[column + 1] {
                let row = pattern.row_idx()[place];
                if self.pinned[row] || self.pinned[column] {
                    self.values[place] = f64::from(u8::from(row == column));
                }
            }
        }
    }
}

/// The element work of [`Assembly::assemble`]: tangents of the elements from `first` on.
struct Tangents<'a> {
    mesh: &'a ShellMesh,
    loads: &'a Loads,
    q: &'a [f64],
    weights: &'a TangentWeights,
    first: usize,
    out: &'a mut [[[f64; COORDS]; COORDS]],
}

impl Kernel for Tangents<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        for (e, out) in (self.first..).zip(self.out) {
            let mut local = [0.0; COORDS];
            for corner in 0..4 {
                let node = self.mesh.shells()[e].nodes[corner] as usize;
                local[NODE * corner..NODE * corner + NODE].copy_from_slice(&self.q[NODE * node..NODE * node + NODE]);
            }
            *out = kernel::tangent::<L>(self.mesh.kind(e), self.loads, &local, None, self.weights);
        }
    }
}

/// Patterns of the node graph and of the rows.
fn patterns(neighbours: &[Vec<usize>]) -> Result<(SymmetricPattern, SymmetricPattern), AncfError> {
    let (mut node_ptr, mut node_rows) = (vec![0], Vec::new());
    let (mut ptr, mut rows) = (vec![0], Vec::new());
    for (column, list) in neighbours.iter().enumerate() {
        node_rows.push(column);
        node_rows.extend(list);
        node_ptr.push(node_rows.len());
        for c in 0..NODE {
            rows.extend((c..NODE).map(|r| NODE * column + r));
            rows.extend(list.iter().flat_map(|&block| (0..NODE).map(move |r| NODE * block + r)));
            ptr.push(rows.len());
        }
    }
    Ok((SymmetricPattern::new(node_ptr, node_rows)?, SymmetricPattern::new(ptr, rows)?))
}
