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
    s: Vec<f64>,
    y: Vec<f64>,
    /// 1 / (s . y).
    rho: f64,
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

fn axpy(to: &mut [f64], factor: f64, x: &[f64]) {
    to.iter_mut().zip(x).for_each(|(t, x)| *t += factor * x);
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

    /// Takes a correction and the fall of the residual it caused. A pair without positive curvature is not kept.
    pub fn add(&mut self, s: &[f64], y: Vec<f64>) {
        let curvature = dot(s, &y);
        if curvature > 1e-6 * (dot(s, s) * dot(&y, &y)).sqrt() && !self.is_full() {
            self.pairs.push(Pair { s: s.to_vec(), y, rho: 1.0 / curvature });
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
            axpy(x, alpha - beta, &pair.s);
        }
    }
}
