//! Forward and backward substitution with a supernodal L D L' factor.
//!
//! One right-hand side is bound by the memory the factor is streamed from; a general solver's loops over columns of a few dozen rows cost
//! three times that. Here the factor is laid out anew after each factorisation, in the order in which a solve reads it: eight rows by six
//! columns at a time, down the rows, then the next six columns. Forward going reads it from the beginning to the end, backward going from
//! the end, whole registers at a time. The unit triangle of a supernode is inverted, so that nothing waits for the row before.

use faer::sparse::linalg::cholesky::supernodal::SymbolicSupernodalCholesky;
use std::ops::{Add, Div, Mul, Sub};
use terramech_simd::{Kernel, Lanes, active, dispatch};

/// f32, which iterations solve with and which has kernels of its own, or f64.
pub(super) trait Real:
    Copy + Default + From<f32> + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self>
{
    /// `y += tiles x`, one tile a pack.
    fn tile_add<L: Lanes>(tiles: &[Tile<Self>], x: &[Self; COLUMNS], y: &mut [Pack<Self>]);
    /// Scalar products of the tiles' columns with `y`.
    fn tile_dots<L: Lanes>(tiles: &[Tile<Self>], y: &[Pack<Self>]) -> [Self; COLUMNS];
}

impl Real for f32 {
    #[inline(always)]
    fn tile_add<L: Lanes>(tiles: &[Tile<f32>], x: &[f32; COLUMNS], y: &mut [Pack<f32>]) {
        L::tile_add(tiles, x, y);
    }
    #[inline(always)]
    fn tile_dots<L: Lanes>(tiles: &[Tile<f32>], y: &[Pack<f32>]) -> [f32; COLUMNS] {
        L::tile_dots(tiles, y)
    }
}

impl Real for f64 {
    #[inline(always)]
    fn tile_add<L: Lanes>(tiles: &[Tile<f64>], x: &[f64; COLUMNS], y: &mut [Pack<f64>]) {
        for (t, y) in tiles.iter().zip(y) {
            let mut sum = L::load(y);
            for c in 0..COLUMNS {
                sum = L::load(&t[c]).fma(L::splat(x[c]), sum);
            }
            sum.store(y);
        }
    }
    #[inline(always)]
    fn tile_dots<L: Lanes>(tiles: &[Tile<f64>], y: &[Pack<f64>]) -> [f64; COLUMNS] {
        let mut sums = [L::splat(0.0); COLUMNS];
        for (t, y) in tiles.iter().zip(y).rev() {
            let y = L::load(y);
            for c in 0..COLUMNS {
                sums[c] = L::load(&t[c]).fma(y, sums[c]);
            }
        }
        let mut out = [0.0; COLUMNS];
        for c in 0..COLUMNS {
            let mut s = [0.0; ROWS];
            sums[c].store(&mut s);
            out[c] = ((s[0] + s[1]) + (s[2] + s[3])) + ((s[4] + s[5]) + (s[6] + s[7]));
        }
        out
    }
}

/// Rows of a pack: fixed, so that the result does not depend on the compiler's choice of vectors.
const ROWS: usize = 8;
/// Columns that go together: a shell node's.
const COLUMNS: usize = 6;

type Pack<T> = [T; ROWS];
type Tile<T> = [Pack<T>; COLUMNS];

/// A supernode: `width` columns from row `begin` on.
#[derive(Debug, Clone, Copy)]
struct Node {
    begin: usize,
    width: usize,
    /// Packs of rows of its own, and below; groups of columns.
    own: usize,
    below: usize,
    groups: usize,
    /// Where its tiles begin: by groups `own` of the inverted triangle, then by groups `below`.
    tiles: usize,
    /// Where its rows below begin, in packs.
    rows: usize,
}

/// A factor in the order in which a solve reads it.
#[derive(Debug)]
pub(super) struct Panels<T> {
    nodes: Vec<Node>,
    /// Rows below, padded to whole packs by the supernode's first row (against zeros).
    rows: Vec<[u32; ROWS]>,
    tiles: Vec<Tile<T>>,
    /// Inverse of D.
    inverse_d: Vec<T>,
    /// Scratch: a column of a triangle; a supernode's vector.
    column: Vec<T>,
    vector: Vec<Pack<T>>,
    x: Vec<T>,
}

impl<T: Real> Panels<T> {
    /// The layout of a factor of this shape.
    pub(super) fn new(symbolic: &SymbolicSupernodalCholesky<usize>, n: usize) -> Self {
        let (mut nodes, mut rows) = (Vec::new(), Vec::new());
        let (mut tiles, mut most) = (0, 0);
        for s in 0..symbolic.n_supernodes() {
            let begin = symbolic.supernode_begin()[s];
            let width = symbolic.supernode_end()[s] - begin;
            let list = &symbolic.row_idx()[symbolic.col_ptr_for_row_idx()[s]..][..symbolic.nnz_per_super()[s]];
            let (own, below) = (width.div_ceil(ROWS), list.len().div_ceil(ROWS));
            let groups = width.div_ceil(COLUMNS);
            nodes.push(Node { begin, width, own, below, groups, tiles, rows: rows.len() });
            rows.extend(list.chunks(ROWS).map(|chunk| {
                let mut pack = [begin as u32; ROWS];
                pack.iter_mut().zip(chunk).for_each(|(to, &row)| *to = row as u32);
                pack
            }));
            tiles += (own + below) * groups;
            most = most.max(own.max(below));
        }
        Self {
            nodes,
            rows,
            tiles: vec![[[T::default(); ROWS]; COLUMNS]; tiles],
            inverse_d: vec![T::default(); n],
            column: vec![T::default(); ROWS * most],
            vector: vec![[T::default(); ROWS]; most],
            x: vec![T::default(); n],
        }
    }

    /// Takes a factor over.
    pub(super) fn fill(&mut self, symbolic: &SymbolicSupernodalCholesky<usize>, values: &[T]) {
        dispatch(active(), Fill { panels: self, symbolic, values });
    }

    /// Solves `L D L' x = b`; `order[k]` is the place in `b` of the k-th row eliminated. `b` becomes the solution.
    pub(super) fn solve(&mut self, order: &[usize], b: &mut [T]) {
        let mut x = std::mem::take(&mut self.x);
        x.iter_mut().zip(order).for_each(|(x, &from)| *x = b[from]);
        dispatch(active(), Substitution { panels: self, x: &mut x });
        x.iter().zip(order).for_each(|(x, &to)| b[to] = *x);
        self.x = x;
    }
}

/// Laying out, compiled for each instruction path.
struct Fill<'a, T> {
    panels: &'a mut Panels<T>,
    symbolic: &'a SymbolicSupernodalCholesky<usize>,
    values: &'a [T],
}

impl<T: Real> Kernel for Fill<'_, T> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Panels { nodes, tiles, inverse_d, column, .. } = self.panels;
        for (s, node) in nodes.iter().enumerate() {
            let Node { begin, width, own, below, groups, .. } = *node;
            let height = width + self.symbolic.nnz_per_super()[s];
            let l = &self.values[self.symbolic.col_ptr_for_val()[s]..][..height * width];
            let (triangle, rest) = tiles[node.tiles..][..(own + below) * groups].split_at_mut(own * groups);
            for j in 0..width {
                let (group, c) = (j / COLUMNS, j % COLUMNS);
                inverse_d[begin + j] = T::from(1.0) / l[j * height + j];
                // Column j of the inverse of the unit triangle.
                let e = &mut column[..ROWS * own];
                e.fill(T::default());
                e[j] = T::from(1.0);
                for k in j..width {
                    let factor = e[k];
                    let source = &l[k * height + k + 1..k * height + width];
                    let target = &mut e[k + 1..width];
                    for i in 0..source.len() {
                        target[i] = target[i] - source[i] * factor;
                    }
                }
                for (b, chunk) in e.chunks_exact(ROWS).enumerate() {
                    triangle[group * own + b][c].copy_from_slice(chunk);
                }
                let source = &l[j * height + width..(j + 1) * height];
                for (b, chunk) in source.chunks(ROWS).enumerate() {
                    // The padding of the last pack and of the last group is zero from the beginning.
                    rest[group * below + b][c][..chunk.len()].copy_from_slice(chunk);
                }
            }
        }
    }
}

/// The solve, compiled for each instruction path: plain Rust that the compiler widens.
struct Substitution<'a, T> {
    panels: &'a mut Panels<T>,
    x: &'a mut [T],
}

impl<T: Real> Kernel for Substitution<'_, T> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { panels, x } = self;
        let Panels { nodes, rows, tiles, inverse_d, vector, .. } = panels;
        for node in nodes.iter() {
            forward::<T, L>(node, rows, tiles, vector, x);
        }
        for node in nodes.iter().rev() {
            backward::<T, L>(node, rows, tiles, inverse_d, vector, x);
        }
    }
}

/// Six numbers from `j` on; beyond the end zeros.
#[inline(always)]
fn six<T: Real>(x: &[T], j: usize) -> [T; COLUMNS] {
    let mut out = [T::default(); COLUMNS];
    match x.get(j..j + COLUMNS) {
        Some(x) => out.copy_from_slice(x),
        None => x[j..].iter().zip(&mut out).for_each(|(x, out)| *out = *x),
    }
    out
}

#[inline(always)]
fn forward<T: Real, L: Lanes>(
    node: &Node,
    rows: &[[u32; ROWS]],
    tiles: &[Tile<T>],
    vector: &mut [Pack<T>],
    x: &mut [T],
) {
    let Node { begin, width, own, below, groups, .. } = *node;
    let (triangle, rest) = tiles[node.tiles..][..(own + below) * groups].split_at(own * groups);
    let own_x = &mut x[begin..begin + width];
    let y = &mut vector[..own];
    y.fill([T::default(); ROWS]);
    for (g, tiles) in triangle.chunks_exact(own).enumerate() {
        // Rows above the group's columns hold zeros.
        let first = g * COLUMNS / ROWS;
        T::tile_add::<L>(&tiles[first..], &six(own_x, g * COLUMNS), &mut y[first..]);
    }
    own_x.copy_from_slice(&y.as_flattened()[..width]);
    if below == 0 {
        return;
    }
    let y = &mut vector[..below];
    y.fill([T::default(); ROWS]);
    for (g, tiles) in rest.chunks_exact(below).enumerate() {
        T::tile_add::<L>(tiles, &six(own_x, g * COLUMNS), y);
    }
    for (y, rows) in y.iter().zip(&rows[node.rows..]) {
        for k in 0..ROWS {
            let row = rows[k] as usize;
            x[row] = x[row] - y[k];
        }
    }
}

#[inline(always)]
fn backward<T: Real, L: Lanes>(
    node: &Node,
    rows: &[[u32; ROWS]],
    tiles: &[Tile<T>],
    inverse_d: &[T],
    vector: &mut [Pack<T>],
    x: &mut [T],
) {
    let Node { begin, width, own, below, groups, .. } = *node;
    let (triangle, rest) = tiles[node.tiles..][..(own + below) * groups].split_at(own * groups);
    let y = &mut vector[..below];
    for (y, rows) in y.iter_mut().zip(&rows[node.rows..]) {
        for k in 0..ROWS {
            y[k] = x[rows[k] as usize];
        }
    }
    let own_x = &mut x[begin..begin + width];
    for (x, d) in own_x.iter_mut().zip(&inverse_d[begin..]) {
        *x = *x * *d;
    }
    if below > 0 {
        for (own_x, tiles) in own_x.chunks_mut(COLUMNS).zip(rest.chunks_exact(below)).rev() {
            let d = T::tile_dots::<L>(tiles, y);
            own_x.iter_mut().zip(d).for_each(|(x, d)| *x = *x - d);
        }
    }
    let y = &mut vector[..own];
    y[own - 1] = [T::default(); ROWS];
    y.as_flattened_mut()[..width].copy_from_slice(own_x);
    for (g, (own_x, tiles)) in own_x.chunks_mut(COLUMNS).zip(triangle.chunks_exact(own)).enumerate().rev() {
        let first = g * COLUMNS / ROWS;
        own_x.iter_mut().zip(T::tile_dots::<L>(&tiles[first..], &y[first..])).for_each(|(x, d)| *x = d);
    }
}
