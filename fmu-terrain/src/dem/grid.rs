//! The neighbour grid: cubic cells, numbered linearly with x slowest and z fastest.
//!
//! Linear order, not a space-filling curve: layers of constant x are contiguous in memory, which makes slabs
//! contiguous ranges, and a column of three cells in z is one range of grains in the search. (Measured on a throw-away
//! kernel: Morton order is 15 % slower and rules slabs out.)

use super::grains::{DemState, Row, X0};
use super::team::Team;
use super::vec3::Vec3;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Cells over a region. Grains outside belong to the nearest border cell, so that none is lost: clamping never moves
/// two positions apart, so neighbours stay in neighbouring cells.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Grid {
    /// Corner of the first cell (m).
    pub origin: Vec3,
    /// Edge length (m).
    pub size: f64,
    /// Cells along x, y, z.
    pub n: [usize; 3],
}

impl Grid {
    /// A grid around grains within the box from `low` to `high`, cells of at least `size`. Far outliers do not stretch it:
    /// where the box would need many more cells than there are grains, it ends four standard deviations from the mean.
    pub fn around(rows: &[Row], low: Vec3, high: Vec3, size: f64) -> Self {
        match Self::fitting(rows.len(), low, high, size) {
            Some(grid) => grid,
            None => Self::without_outliers(&Moments::of(rows), low, high, size),
        }
    }

    /// The grid around so many grains, if it does not need many more cells than there are grains.
    pub fn fitting(count: usize, low: Vec3, high: Vec3, size: f64) -> Option<Self> {
        Some(Self::over(low, high, size)).filter(|g| g.cells() <= most(count))
    }

    /// One that ends four standard deviations from the mean.
    pub fn without_outliers(moments: &Moments, low: Vec3, high: Vec3, size: f64) -> Self {
        let (mut low, mut high) = (low, high);
        for k in 0..3 {
            let (mean, spread) = moments.mean_and_spread(k);
            low[k] = low[k].max(mean - 4.0 * spread);
            high[k] = high[k].min(mean + 4.0 * spread);
        }
        let mut grid = Self::over(low, high, size);
        while grid.cells() > most(moments.count as usize) {
            grid = Self::over(low, high, grid.size * 1.5);
        }
        grid
    }

    fn over(low: Vec3, high: Vec3, size: f64) -> Self {
        // Far more cells than memory would overflow an integer: the cap keeps the product finite.
        let along = |k: usize| (((high[k] - low[k]) / size) as usize).min(1 << 20) + 1;
        Self { origin: low, size, n: [along(0), along(1), along(2)] }
    }

    /// Number of cells.
    pub fn cells(&self) -> usize {
        self.n[0] * self.n[1] * self.n[2]
    }

    /// Cells in a layer of constant x.
    pub fn layer(&self) -> usize {
        self.n[1] * self.n[2]
    }

    /// Cell along each axis.
    #[inline]
    pub fn place(&self, x: &[f64]) -> [usize; 3] {
        let inv = 1.0 / self.size;
        // A negative or large quotient saturates in the cast: the border cell.
        let along = |k: usize| (((x[k] - self.origin[k]) * inv) as usize).min(self.n[k] - 1);
        [along(0), along(1), along(2)]
    }

    /// Number of the cell.
    #[inline]
    pub fn index(&self, c: [usize; 3]) -> usize {
        (c[0] * self.n[1] + c[1]) * self.n[2] + c[2]
    }
}

/// Cells that so many grains may need.
fn most(count: usize) -> usize {
    8 * count + 4096
}

/// Sums over positions, in whole nanometres and their squares: the same in whatever order they are summed, and wherever.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Moments {
    /// How many.
    pub count: u64,
    sums: [i128; 3],
    squares: [i128; 3],
}

impl Moments {
    /// Of these grains. What is farther than 1e6 m counts as that far.
    pub fn of(rows: &[Row]) -> Self {
        let mut all = Self { count: rows.len() as u64, ..Self::default() };
        for r in rows {
            for k in 0..3 {
                let x = (r[k].clamp(-1e6, 1e6) * 1e9) as i128;
                all.sums[k] += x;
                all.squares[k] += x * x;
            }
        }
        all
    }

    /// Adds others.
    pub fn add(&mut self, other: &Self) {
        self.count += other.count;
        for k in 0..3 {
            self.sums[k] += other.sums[k];
            self.squares[k] += other.squares[k];
        }
    }

    fn mean_and_spread(&self, k: usize) -> (f64, f64) {
        let count = self.count as f64;
        let mean = 1e-9 * self.sums[k] as f64 / count;
        let square = 1e-18 * self.squares[k] as f64 / count;
        (mean, (square - mean * mean).max(0.0).sqrt())
    }
}

/// Grains of a block of layers sorted by cell, then grain number.
pub struct Sorted {
    /// Old place of the grain at each new place, both counted from the block's first grain.
    pub order: Vec<u32>,
    /// First grain of each cell of the block, counted likewise; one more than there are cells.
    start: Vec<u32>,
    /// The block's first grain.
    row: usize,
    /// The block's first cell.
    cell: usize,
}

impl Sorted {
    /// Place of the first grain of a cell of the block, or of what comes after its last.
    #[inline]
    pub fn first_of(&self, cell: usize) -> usize {
        self.row + self.start[cell - self.cell] as usize
    }

    /// Where the grain at a place of the block was before.
    #[inline]
    pub fn old_place(&self, place: u32) -> u32 {
        self.row as u32 + self.order[place as usize - self.row]
    }
}

/// Counting sort by cell, then by grain number within a cell: the grains `block`, which all lie in `layers`.
pub fn sort(grid: &Grid, state: &DemState, block: Range<usize>, layers: Range<usize>, team: &Team) -> Sorted {
    sort_rows(grid, (&state.rows, &state.ids), block, layers, team)
}

/// As [`sort`], of rows and numbers by themselves.
pub fn sort_rows(
    grid: &Grid,
    (rows, ids): (&[Row], &[u32]),
    block: Range<usize>,
    layers: Range<usize>,
    team: &Team,
) -> Sorted {
    const CHUNK: usize = 2048;
    let (rows, ids) = (&rows[block.clone()], &ids[block.clone()]);
    let first = layers.start * grid.layer();
    let cells = layers.len() * grid.layer();
    let mut cell = vec![0_u32; rows.len()];
    let chunks: Vec<_> = cell.chunks_mut(CHUNK).zip(rows.chunks(CHUNK)).collect();
    team.each(chunks, |(cell, rows)| {
        for (c, r) in cell.iter_mut().zip(rows) {
            let [x, y, z] = grid.place(&r[X0..X0 + 3]);
            // Nothing lies outside: but a place that did would write outside of what follows.
            let x = x.clamp(layers.start, layers.end - 1);
            *c = (grid.index([x, y, z]) - first) as u32;
        }
    });
    let mut start = vec![0_u32; cells + 1];
    for &c in &cell {
        start[c as usize + 1] += 1;
    }
    for c in 1..start.len() {
        start[c] += start[c - 1];
    }
    // Each start moves on as its cell fills, up to where the next one's began.
    let mut order = vec![0_u32; rows.len()];
    for (i, &c) in cell.iter().enumerate() {
        let at = &mut start[c as usize];
        order[*at as usize] = i as u32;
        *at += 1;
    }
    start.copy_within(0..cells, 1);
    start[0] = 0;
    for c in start.windows(2) {
        let cell = &mut order[c[0] as usize..c[1] as usize];
        if cell.len() > 1 {
            cell.sort_unstable_by_key(|&i| ids[i as usize]);
        }
    }
    Sorted { order, start, row: block.start, cell: first }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(x: f64, y: f64, z: f64) -> Row {
        let mut r = Row::default();
        r[..3].copy_from_slice(&[x, y, z]);
        r.copy_within(0..3, X0);
        r
    }

    #[test]
    fn an_outlier_does_not_stretch_the_grid() {
        let mut rows: Vec<Row> =
            (0..1000).map(|i| row(f64::from(i % 10), f64::from(i / 10 % 10), f64::from(i / 100))).collect();
        rows.push(row(1e7, 0.0, 0.0));
        let grid = Grid::around(&rows, [0.0; 3], [1e7, 9.0, 9.0], 1.0);
        assert!(grid.cells() <= 8 * rows.len() + 4096);
        assert_eq!(grid.place(&rows[1000][..3])[0], grid.n[0] - 1);
    }

    #[test]
    fn the_order_depends_on_positions_and_numbers_alone() {
        let rows = [row(2.5, 0.1, 0.1), row(0.1, 0.1, 0.1), row(0.2, 0.2, 0.2)];
        let (grid, team) = (Grid::around(&rows, [0.1; 3], [2.5, 0.2, 0.2], 1.0), Team::new(1).unwrap());
        let order = |rows: [Row; 3], ids: [u32; 3]| {
            let state = DemState { rows: rows.to_vec(), ids: ids.to_vec(), ..DemState::default() };
            sort(&grid, &state, 0..3, 0..grid.n[0], &team).order
        };
        assert_eq!(order(rows, [5, 9, 7]), [2, 1, 0]);
        assert_eq!(order([rows[2], rows[0], rows[1]], [7, 5, 9]), [0, 2, 1]);
    }
}
