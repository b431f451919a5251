//! Cross-section of a tire: a cubic spline through points.

use super::AncfError;

/// A cubic spline `x(t)`, `y(t)` whose second derivative is constant over the first and the last interval (a parabola there).
#[derive(Debug, Clone, PartialEq)]
pub struct Profile {
    t: Vec<f64>,
    /// Values and second derivatives at the points: radial offset from the rim radius, axial position; m.
    x: Vec<[f64; 2]>,
    second: Vec<[f64; 2]>,
}

/// A point of the profile with its tangent: radial offset and axial position, m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ProfilePoint {
    /// Position.
    pub at: [f64; 2],
    /// Derivative with respect to t.
    pub tangent: [f64; 2],
}

impl Profile {
    /// From rows `[t, radial offset from the rim radius, axial position]`, t ascending from 0 to 1.
    ///
    /// # Errors
    /// [`AncfError::Input`]: fewer than 4 points, t not ascending or not from 0 to 1, a profile that crosses itself.
    pub fn new(points: &[[f64; 3]]) -> Result<Self, AncfError> {
        let fault = |text: String| Err(AncfError::Input(vec![format!("profile: {text}")]));
        if points.len() < 4 {
            return fault(format!("{} points: at least 4 are needed", points.len()));
        }
        if points.iter().flatten().any(|x| !x.is_finite()) {
            return fault("points must be finite".into());
        }
        if let Some(k) = points.windows(2).position(|w| w[1][0] <= w[0][0]) {
            return fault(format!(
                "t falls from {} to {} after point {}: it must ascend",
                points[k][0],
                points[k + 1][0],
                k + 1
            ));
        }
        let (first, last) = (points[0][0], points[points.len() - 1][0]);
        if first.abs() > 1e-12 || (last - 1.0).abs() > 1e-12 {
            return fault(format!("t runs from {first} to {last}: it must run from 0 to 1"));
        }
        let t: Vec<f64> = points.iter().map(|p| p[0]).collect();
        let x: Vec<[f64; 2]> = points.iter().map(|p| [p[1], p[2]]).collect();
        let second = second_derivatives(&t, &x);
        let profile = Self { t, x, second };
        if let Some((a, b)) = profile.crossing() {
            return fault(format!("it crosses itself between t = {a:.4} and t = {b:.4}"));
        }
        Ok(profile)
    }

    /// Half an ellipse from bead to bead: `height` above the rim, `width` between the beads; m.
    ///
    /// # Errors
    /// [`AncfError::Input`] if a size is not positive.
    pub fn half_ellipse(height: f64, width: f64) -> Result<Self, AncfError> {
        if !(height > 0.0 && width > 0.0) {
            return Err(AncfError::Input(vec![format!(
                "toroid: height {height} m and width {width} m must be positive"
            )]));
        }
        const POINTS: usize = 72;
        let points: Vec<[f64; 3]> = (0..=POINTS)
            .map(|k| {
                let t = k as f64 / POINTS as f64;
                let (s, c) = (std::f64::consts::PI * t).sin_cos();
                [t, height * s, -0.5 * width * c]
            })
            .collect();
        Self::new(&points)
    }

    /// Position and tangent at t in [0, 1].
    pub fn at(&self, t: f64) -> ProfilePoint {
        let k = self.t.partition_point(|&x| x <= t).clamp(1, self.t.len() - 1) - 1;
        let h = self.t[k + 1] - self.t[k];
        let (b, a) = ((t - self.t[k]) / h, (self.t[k + 1] - t) / h);
        let mut point = ProfilePoint { at: [0.0; 2], tangent: [0.0; 2] };
        for c in 0..2 {
            let (x0, x1, s0, s1) = (self.x[k][c], self.x[k + 1][c], self.second[k][c], self.second[k + 1][c]);
            point.at[c] = a * x0 + b * x1 + ((a * a * a - a) * s0 + (b * b * b - b) * s1) * h * h / 6.0;
            point.tangent[c] = (x1 - x0) / h + ((3.0 * b * b - 1.0) * s1 - (3.0 * a * a - 1.0) * s0) * h / 6.0;
        }
        point
    }

    /// Largest distance from the rim radius, m.
    pub fn height(&self) -> f64 {
        (0..=1000).map(|k| self.at(f64::from(k) / 1000.0).at[0]).fold(f64::MIN, f64::max)
    }

    /// Extent along the axle, m.
    pub fn width(&self) -> f64 {
        let y = |k: i32| self.at(f64::from(k) / 1000.0).at[1];
        let (low, high) = (0..=1000).map(y).fold((f64::MAX, f64::MIN), |(l, h), y| (l.min(y), h.max(y)));
        high - low
    }

    /// Two places of the profile (as a polygon through samples) that cross.
    fn crossing(&self) -> Option<(f64, f64)> {
        let n = 2 * self.t.len();
        let t = |k: usize| k as f64 / n as f64;
        let p: Vec<[f64; 2]> = (0..=n).map(|k| self.at(t(k)).at).collect();
        let side =
            |a: [f64; 2], b: [f64; 2], c: [f64; 2]| (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        for i in 0..n {
            for j in i + 2..n {
                let (a, b, c, d) = (p[i], p[i + 1], p[j], p[j + 1]);
                if side(a, b, c) * side(a, b, d) < 0.0 && side(c, d, a) * side(c, d, b) < 0.0 {
                    return Some((t(i), t(j)));
                }
            }
        }
        None
    }
}

/// Second derivatives of the spline by elimination of the tridiagonal system, with `s0 = s1` and `sn = s(n-1)` at the ends.
fn second_derivatives(t: &[f64], x: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let n = t.len();
    let mut second = vec![[0.0; 2]; n];
    for c in 0..2 {
        // Unknowns at the inner points; the end conditions add the off-diagonal entry to the diagonal.
        let (mut diagonal, mut right) = (vec![0.0; n], vec![0.0; n]);
        let h = |k: usize| t[k + 1] - t[k];
        for k in 1..n - 1 {
            diagonal[k] = 2.0 * (h(k - 1) + h(k));
            if k == 1 {
                diagonal[k] += h(0);
            }
            if k == n - 2 {
                diagonal[k] += h(n - 2);
            }
            right[k] = 6.0 * ((x[k + 1][c] - x[k][c]) / h(k) - (x[k][c] - x[k - 1][c]) / h(k - 1));
        }
        for k in 2..n - 1 {
            let factor = h(k - 1) / diagonal[k - 1];
            diagonal[k] -= factor * h(k - 1);
            right[k] -= factor * right[k - 1];
        }
        second[n - 2][c] = right[n - 2] / diagonal[n - 2];
        for k in (1..n - 2).rev() {
            second[k][c] = (right[k] - h(k) * second[k + 1][c]) / diagonal[k];
        }
        second[0][c] = second[1][c];
        second[n - 1][c] = second[n - 2][c];
    }
    second
}
