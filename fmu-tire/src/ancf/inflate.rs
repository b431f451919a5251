//! Inflation of a tire on its rim, by symmetry on one row of nodes.
//!
//! Without ground and weight, every row of nodes is the first one turned about the axle. So equilibrium needs one row's unknowns only,
//! and Newton's method on a small dense matrix, in a few milliseconds whatever the number of divisions.

use super::AncfError;
use super::geometry::TireMesh;
use super::kernel::{self, Loads, TangentWeights};
use super::mesh::{NODE, gather};
use super::strain::COORDS;
use nalgebra::{DMatrix, DVector};

/// Newton stops below this correction, m.
const TOLERANCE: f64 = 1e-12;

/// Coordinates of all nodes at equilibrium under `pressure` (Pa), in the wheel's frame.
///
/// # Errors
/// [`AncfError::Newton`] with the share of the pressure reached as time.
pub fn inflate(tire: &TireMesh, pressure: f64) -> Result<Vec<f64>, AncfError> {
    let row = tire.across + 1;
    let mut q: Vec<f64> = tire.mesh.reference()[..NODE * row].to_vec();
    let (mut share, mut increment) = (0.0, 0.05);
    while share < 1.0 && pressure > 0.0 {
        let next = f64::min(1.0, share + increment);
        let saved = q.clone();
        let (correction, iterations) = equilibrium(tire, next * pressure, &mut q);
        if correction <= TOLERANCE {
            share = next;
            increment *= 1.5;
        } else {
            q = saved;
            increment *= 0.5;
            if increment < 1e-5 {
                return Err(AncfError::Newton {
                    time: next,
                    iterations,
                    correction,
                    tolerance: TOLERANCE,
                    step: increment,
                });
            }
        }
    }
    Ok((0..tire.around).flat_map(|i| turned(&q, 2.0 * std::f64::consts::PI * i as f64 / tire.around as f64)).collect())
}

/// A row of nodes turned about the axle like the mesh builder turns it.
fn turned(row: &[f64], angle: f64) -> Vec<f64> {
    let (s, c) = angle.sin_cos();
    row.chunks_exact(3).flat_map(|x| [c * x[0] - s * x[2], x[1], s * x[0] + c * x[2]]).collect()
}

/// Newton at a fixed pressure; returns the last correction and the iterations.
fn equilibrium(tire: &TireMesh, pressure: f64, q: &mut [f64]) -> (f64, usize) {
    let row = tire.across + 1;
    let free = NODE * (row - 2);
    let step = 2.0 * std::f64::consts::PI / tire.around as f64;
    let loads = Loads { damping: 0.0, pressure };
    let weights = TangentWeights { stiffness: 1.0, velocity: 0.0, mass: 0.0, pressure: true, geometric: true };
    let mut correction = f64::INFINITY;
    const ITERATIONS: usize = 30;
    for iteration in 1..=ITERATIONS {
        // Rows -1, 0 and 1; the elements of division 0 span rows 0 and 1, those of division -1 rows -1 and 0.
        let ahead = turned(q, step);
        let behind = turned(q, -step);
        let mut force = DVector::<f64>::zeros(free);
        let mut matrix = DMatrix::<f64>::zeros(free, free);
        for (rows, own) in [([q.to_vec(), ahead].concat(), 0), ([behind, q.to_vec()].concat(), 1)] {
            for j in 0..tire.across {
                // In the order of the mesh builder: (1, j), (0, j), (0, j + 1), (1, j + 1).
                let corners = [(1, j), (0, j), (0, j + 1), (1, j + 1)];
                let local = gather(&rows, &corners.map(|(r, j)| (r * row + j) as u32));
                let kind = tire.mesh.kind(j);
                let (f, _) = kernel::force(kind, &loads, &local, &[0.0; COORDS], &[0.0; COORDS]);
                let k = kernel::dispatched_tangent(kind, &loads, &local, None, &weights);
                for (a, &(ra, ja)) in corners.iter().enumerate() {
                    if ra != own || ja == 0 || ja == tire.across {
                        continue;
                    }
                    for c in 0..NODE {
                        force[NODE * (ja - 1) + c] += f[NODE * a + c];
                    }
                    for (b, &(rb, jb)) in corners.iter().enumerate() {
                        if jb == 0 || jb == tire.across {
                            continue;
                        }
                        // The other row is this one turned by +-step: chain rule.
                        let angle = step * (rb as f64 - own as f64);
                        let (s, co) = angle.sin_cos();
                        for r in 0..NODE {
                            for half in 0..2 {
                                let at = |c: usize| k[NODE * a + r][NODE * b + 3 * half + c];
                                let column = NODE * (jb - 1) + 3 * half;
                                matrix[(NODE * (ja - 1) + r, column)] += at(0) * co + at(2) * s;
                                matrix[(NODE * (ja - 1) + r, column + 1)] += at(1);
                                matrix[(NODE * (ja - 1) + r, column + 2)] += at(2) * co - at(0) * s;
                            }
                        }
                    }
                }
            }
        }
        let Some(delta) = matrix.lu().solve(&force) else {
            return (f64::INFINITY, iteration);
        };
        correction = delta.amax();
        if !correction.is_finite() {
            return (f64::INFINITY, iteration);
        }
        q[NODE..NODE + free].iter_mut().zip(delta.iter()).for_each(|(q, d)| *q += d);
        if correction <= TOLERANCE {
            return (correction, iteration);
        }
    }
    (correction, ITERATIONS)
}
