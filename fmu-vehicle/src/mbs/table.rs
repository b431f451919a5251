//! Piecewise linear tables: spring curves, engine maps, stops.

/// Why points are not a table.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum TableError {
    /// Fewer than two points.
    #[error("{0} points; allowed: at least 2")]
    TooFew(usize),
    /// The abscissa does not rise, or a number is not finite.
    #[error("point {index}: ({x}, {y}) after x = {before}; allowed: finite numbers with x rising from point to point")]
    NotRising {
        /// Which point, counted from 0.
        index: usize,
        /// Its abscissa.
        x: f64,
        /// Its ordinate.
        y: f64,
        /// The abscissa before it.
        before: f64,
    },
}

/// A piecewise linear function; outside its range the end values hold.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    x: Vec<f64>,
    y: Vec<f64>,
}

impl Table {
    /// A table of points (x, y).
    ///
    /// # Errors
    /// [`TableError`] unless there are two points at least with rising x.
    pub fn new(points: &[[f64; 2]]) -> Result<Self, TableError> {
        if points.len() < 2 {
            return Err(TableError::TooFew(points.len()));
        }
        let mut before = f64::NEG_INFINITY;
        for (index, &[x, y]) in points.iter().enumerate() {
            if !(x.is_finite() && y.is_finite() && x > before) {
                return Err(TableError::NotRising { index, x, y, before });
            }
            before = x;
        }
        Ok(Self { x: points.iter().map(|p| p[0]).collect(), y: points.iter().map(|p| p[1]).collect() })
    }

    /// As [`Self::new`], both columns multiplied: revolutions per minute to rad/s, for example.
    ///
    /// # Errors
    /// [`TableError`].
    pub fn scaled(points: &[[f64; 2]], by_x: f64, by_y: f64) -> Result<Self, TableError> {
        let points: Vec<[f64; 2]> = points.iter().map(|p| [p[0] * by_x, p[1] * by_y]).collect();
        Self::new(&points)
    }

    /// The value at `x`, end values held outside.
    #[inline]
    pub fn at(&self, x: f64) -> f64 {
        let n = self.x.len();
        let k = self.x.partition_point(|&t| t <= x);
        if k == 0 {
            return self.y[0];
        }
        if k == n {
            return self.y[n - 1];
        }
        let s = (x - self.x[k - 1]) / (self.x[k] - self.x[k - 1]);
        self.y[k - 1] + s * (self.y[k] - self.y[k - 1])
    }

    /// The value at `x`, the last segments continued outside: a stop that has no end.
    #[inline]
    pub fn extrapolated(&self, x: f64) -> f64 {
        let n = self.x.len();
        let k = self.x.partition_point(|&t| t <= x).clamp(1, n - 1);
        let s = (x - self.x[k - 1]) / (self.x[k] - self.x[k - 1]);
        self.y[k - 1] + s * (self.y[k] - self.y[k - 1])
    }

    /// First and last abscissa.
    pub fn range(&self) -> (f64, f64) {
        (self.x[0], self.x[self.x.len() - 1])
    }

    /// Least and greatest ordinate.
    pub fn extremes(&self) -> (f64, f64) {
        self.y.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), &y| (a.min(y), b.max(y)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn interpolates_and_holds() {
        let t = Table::new(&[[0.0, 1.0], [1.0, 3.0], [3.0, 2.0]]).unwrap();
        assert_eq!((t.at(-1.0), t.at(0.5), t.at(1.0), t.at(2.0), t.at(9.0)), (1.0, 2.0, 3.0, 2.5, 2.0));
        assert_eq!((t.extrapolated(-1.0), t.extrapolated(5.0)), (-1.0, 1.0));
    }

    #[test]
    fn faults_name_the_point() {
        assert_eq!(Table::new(&[[0.0, 0.0]]), Err(TableError::TooFew(1)));
        let e = Table::new(&[[0.0, 0.0], [2.0, 1.0], [2.0, 3.0]]).unwrap_err().to_string();
        assert!(e.contains("point 2") && e.contains("rising"), "{e}");
    }
}
