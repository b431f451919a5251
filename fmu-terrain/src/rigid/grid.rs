//! Values on a regular grid, bilinear between its nodes.

use super::config::Map;
use super::png;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Most nodes of a grid: 800 MB.
const MOST: usize = 100_000_000;

/// A grid of values. Node (i, j) lies at `low + (i dx, j dy)`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Grid {
    columns: usize,
    rows: usize,
    /// Values, rows with rising y.
    values: Vec<f64>,
    low: [f64; 2],
    spacing: [f64; 2],
}

impl Grid {
    /// Reads the file of a map.
    ///
    /// # Errors
    /// A message without the JSON path: the file cannot be read, is of another kind, or has rows of different lengths.
    pub fn read(map: &Map, folder: &Path) -> Result<Self, String> {
        let path = folder.join(&map.file);
        let shown = path.display();
        let bytes = std::fs::read(&path).map_err(|e| format!("file {shown}: cannot be read: {e}"))?;
        let (columns, rows, values) = if let Some([black, white]) = map.range {
            let grey = png::grey(&bytes).map_err(|e| format!("file {shown}: {e}"))?;
            let values = grey.values.iter().map(|x| black + (white - black) * x).collect();
            (grey.width, grey.height, values)
        } else {
            let text = std::str::from_utf8(&bytes).map_err(|e| format!("file {shown}: is no text: {e}"))?;
            csv(text).map_err(|e| format!("file {shown}: {e}"))?
        };
        Self::new(columns, rows, values, map).map_err(|e| format!("file {shown}: {e}"))
    }

    /// A grid from values row by row, the first row at the greatest y.
    ///
    /// # Errors
    /// Less than two rows or columns, or too many.
    pub fn new(columns: usize, rows: usize, values: Vec<f64>, map: &Map) -> Result<Self, String> {
        if columns < 2 || rows < 2 || columns.saturating_mul(rows) > MOST || values.len() != columns * rows {
            return Err(format!("{columns} columns and {rows} rows; allowed: 2 by 2 to {MOST} values"));
        }
        let values = values.chunks_exact(columns).rev().flatten().copied().collect();
        Ok(Self {
            columns,
            rows,
            values,
            low: [map.centre[0] - 0.5 * map.length, map.centre[1] - 0.5 * map.width],
            spacing: [map.length / (columns - 1) as f64, map.width / (rows - 1) as f64],
        })
    }

    /// The smallest and the largest value.
    pub fn range(&self) -> [f64; 2] {
        self.values.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], x| [a.min(*x), b.max(*x)])
    }

    /// Whether the point lies on the grid.
    pub fn covers(&self, x: f64, y: f64) -> bool {
        let at = [(x - self.low[0]) / self.spacing[0], (y - self.low[1]) / self.spacing[1]];
        at[0] >= 0.0 && at[1] >= 0.0 && at[0] <= (self.columns - 1) as f64 && at[1] <= (self.rows - 1) as f64
    }

    /// Value and its derivatives by x and y; outside, the value of the nearest point of the edge.
    pub fn at(&self, x: f64, y: f64) -> (f64, [f64; 2]) {
        let place = |p: f64, k: usize, n: usize| {
            let s = (p - self.low[k]) / self.spacing[k];
            let inside = s >= 0.0 && s <= (n - 1) as f64;
            let s = s.clamp(0.0, (n - 1) as f64);
            let i = (s as usize).min(n - 2);
            (i, s - i as f64, if inside { 1.0 / self.spacing[k] } else { 0.0 })
        };
        let (i, s, dx) = place(x, 0, self.columns);
        let (j, t, dy) = place(y, 1, self.rows);
        let v = |i: usize, j: usize| self.values[j * self.columns + i];
        let (a, b, c, d) = (v(i, j), v(i + 1, j), v(i, j + 1), v(i + 1, j + 1));
        let value = (1.0 - t) * (a + s * (b - a)) + t * (c + s * (d - c));
        (value, [((1.0 - t) * (b - a) + t * (d - c)) * dx, ((1.0 - s) * (c - a) + s * (d - b)) * dy])
    }
}

/// Columns, rows, values of a CSV text: numbers parted by commas, semicolons or blanks, a row a line.
fn csv(text: &str) -> Result<(usize, usize, Vec<f64>), String> {
    let (mut columns, mut rows, mut values) = (0, 0, Vec::new());
    for (k, line) in text.lines().enumerate().filter(|(_, l)| !l.trim().is_empty() && !l.starts_with('#')) {
        let before = values.len();
        for cell in line.split([',', ';', '\t', ' ']).map(str::trim).filter(|c| !c.is_empty()) {
            match cell.parse::<f64>() {
                Ok(x) if x.is_finite() => values.push(x),
                _ => return Err(format!("line {}: '{cell}'; allowed: a finite number", k + 1)),
            }
        }
        let n = values.len() - before;
        if rows == 0 {
            columns = n;
        } else if n != columns {
            return Err(format!("line {}: {n} values; allowed: {columns}, as in the first row", k + 1));
        }
        rows += 1;
    }
    Ok((columns, rows, values))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn map() -> Map {
        Map { file: "a.csv".into(), length: 4.0, width: 2.0, centre: [1.0, 0.0], range: None }
    }

    #[test]
    fn bilinear_with_its_slopes_and_held_outside() {
        let (c, r, v) = csv("# heights\n1, 2, 3\n0, 1, 2\n").unwrap();
        let g = Grid::new(c, r, v, &map()).unwrap();
        // z = 1 + (x - 1)/2 + y/2.
        assert_eq!(g.at(1.0, 0.0), (1.5, [0.5, 0.5]));
        assert_eq!(g.at(2.5, -0.5), (2.0, [0.5, 0.5]));
        assert_eq!(g.at(9.0, 0.0), (2.5, [0.0, 0.5]));
        assert!(g.covers(3.0, 1.0) && !g.covers(3.01, 0.0));
        assert_eq!(g.range(), [0.0, 3.0]);
    }

    #[test]
    fn ragged_rows_and_words_are_told_with_their_line() {
        assert!(csv("1,2\n3\n").unwrap_err().contains("line 2: 1 values; allowed: 2"));
        assert!(csv("1,x\n").unwrap_err().contains("line 1: 'x'"));
        assert!(Grid::new(1, 2, vec![1.0; 2], &map()).unwrap_err().contains("2 by 2"));
    }
}
