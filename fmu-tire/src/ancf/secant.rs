//! Secant pairs: what iterations have shown of the tangent since it was factorised.
//!
//! As a shell rolls through the edge of its contact patch, a few modes of the kept tangent go stale long before the rest. Each slow iteration
//! shows one of them: a correction `s` and the change of the residual `y` that it caused. The inverse BFGS update by these pairs on top of
//! the factor removes the mode; pairs are kept, in the factor's axes, until the tangent is renewed.

use serde::{Deserialize, Serialize};

/// Pairs kept at most.
const MOST: usize = 16;

/// The pairs, oldest first.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Secant {
    pairs: Vec<Pair>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Pair {
    /// Single precision, like the factor they correct: solves are bound by the memory they stream.
    s: Vec<f32>,
    y: Vec<f32>,
    /// 1 / (s . y), both of unit size.
    rho: f64,
    /// Size of the correction over that of the residual's fall.
    ratio: f64,
}

/// Eight partial sums: fixed, so that the result does not depend on the compiler's choice of vectors.
fn dot(a: &[f32], b: &[f64]) -> f64 {
    let mut sums = [0.0; 8];
    let (a_chunks, b_chunks) = (a.chunks_exact(8), b.chunks_exact(8));
    let rest: f64 = a_chunks.remainder().iter().zip(b_chunks.remainder()).map(|(x, y)| f64::from(*x) * y).sum();
    for (x, y) in a_chunks.zip(b_chunks) {
        for k in 0..8 {
            sums[k] += f64::from(x[k]) * y[k];
        }
    }
    sums.into_iter().sum::<f64>() + rest
}

fn axpy(to: &mut [f64], factor: f64, x: &[f32]) {
    to.iter_mut().zip(x).for_each(|(t, x)| *t += factor * f64::from(*x));
}

impl Secant {
    /// Forgets all.
    pub fn clear(&mut self) {
        self.pairs.clear();
    }

    /// Whether no more pairs are worth keeping: a new tangent is cheaper.
    pub fn is_full(&self) -> bool {
        self.pairs.len() >= MOST
    }

    /// Pairs kept.
    pub fn len(&self) -> usize {
        self.pairs.len()
    }

    /// Whether none is.
    pub fn is_empty(&self) -> bool {
        self.pairs.is_empty()
    }

    /// Takes a correction and the fall of the residual it caused. A pair without positive curvature is not kept.
    pub fn add(&mut self, s: &[f64], y: &[f64]) {
        let square = |x: &[f64]| x.iter().map(|x| x * x).sum::<f64>();
        let size = (square(s), square(y));
        if self.is_full() || !(size.0 > 0.0 && size.1 > 0.0) {
            return;
        }
        // Scaled to unit size: single precision has little range.
        let narrow = |x: &[f64], size: f64| x.iter().map(|x| (x / size.sqrt()) as f32).collect::<Vec<f32>>();
        let (s, y) = (narrow(s, size.0), narrow(y, size.1));
        let ratio = (size.0 / size.1).sqrt();
        let curvature: f64 = s.iter().zip(&y).map(|(a, b)| f64::from(*a) * f64::from(*b)).sum();
        if curvature > 1e-6 {
            self.pairs.push(Pair { s, y, rho: 1.0 / curvature, ratio });
        }
    }

    /// Solves in place: `inner` is the solve with the factor.
    pub fn solve(&self, x: &mut [f64], inner: impl FnOnce(&mut [f64])) {
        let mut alpha = vec![0.0; self.pairs.len()];
        for (pair, alpha) in self.pairs.iter().zip(&mut alpha).rev() {
            *alpha = pair.rho * dot(&pair.s, x);
            axpy(x, -*alpha, &pair.y);
        }
        inner(x);
        for (pair, alpha) in self.pairs.iter().zip(&alpha) {
            let beta = pair.rho * dot(&pair.y, x);
            axpy(x, alpha * pair.ratio - beta, &pair.s);
        }
    }
}
