//! The kept symmetric factorisation against a dense product.
#![cfg(feature = "sparse")]

use terramech_mechanics::sparse::{Precision, SparseError, SymmetricPattern, SymmetricSolver, block_order};

/// A grid of `m` x `m` nodes with `b` rows each, every row of a node coupled to all rows of its neighbours.
fn grid(m: usize, b: usize) -> (SymmetricPattern, SymmetricPattern, Vec<f64>) {
    let near = |i: usize, j: usize| (i / m).abs_diff(j / m) <= 1 && (i % m).abs_diff(j % m) <= 1;
    let lower = |n: usize, touch: &dyn Fn(usize, usize) -> bool| {
        let (mut ptr, mut rows) = (vec![0], Vec::new());
        for c in 0..n {
            rows.extend((c..n).filter(|&r| touch(r, c)));
            ptr.push(rows.len());
        }
        SymmetricPattern::new(ptr, rows).unwrap()
    };
    let nodes = lower(m * m, &near);
    let full = lower(m * m * b, &|r, c| near(r / b, c / b));
    let mut values = Vec::new();
    for c in 0..full.len() {
        for &r in &full.row_idx()[full.col_ptr()[c]..full.col_ptr()[c + 1]] {
            values.push(if r == c { 40.0 + (c % 7) as f64 } else { ((r * 31 + c * 17) % 11) as f64 / 11.0 - 0.5 });
        }
    }
    (nodes, full, values)
}

fn multiply(p: &SymmetricPattern, values: &[f64], x: &[f64]) -> Vec<f64> {
    let mut y = vec![0.0; p.len()];
    for c in 0..p.len() {
        for k in p.col_ptr()[c]..p.col_ptr()[c + 1] {
            let r = p.row_idx()[k];
            y[r] += values[k] * x[c];
            if r != c {
                y[c] += values[k] * x[r];
            }
        }
    }
    y
}

#[test]
fn solves_and_refactors() {
    let (nodes, full, mut values) = grid(9, 6);
    let order = block_order(&nodes, 6).unwrap();
    let x: Vec<f64> = (0..full.len()).map(|i| (i as f64 * 0.37).sin()).collect();
    for (precision, tolerance) in [(Precision::Double, 1e-12), (Precision::Single, 1e-5)] {
        for order in [None, Some(order.as_slice())] {
            let mut solver = SymmetricSolver::new(full.clone(), order, precision).unwrap();
            for factor in [1.0, 3.0] {
                values.iter_mut().for_each(|v| *v *= factor);
                solver.factor(&values).unwrap();
                assert_eq!(solver.negative_pivots(), 0);
                let mut y = multiply(&full, &values, &x);
                solver.solve_in_place(&mut y);
                let error = y.iter().zip(&x).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                assert!(error < tolerance, "{precision:?}: {error}");
            }
        }
    }
}

#[test]
fn counts_negative_eigenvalues_and_names_faults() {
    let diagonal = SymmetricPattern::new(vec![0, 1, 2, 3], vec![0, 1, 2]).unwrap();
    let mut solver = SymmetricSolver::new(diagonal, None, Precision::Double).unwrap();
    solver.factor(&[1.0, -2.0, -3.0]).unwrap();
    assert_eq!(solver.negative_pivots(), 2);
    assert!(matches!(solver.factor(&[1.0, 0.0, 1.0]), Err(SparseError::ZeroPivot { .. })));
    assert!(!solver.is_factored());
    assert_eq!(SymmetricPattern::new(vec![0, 1, 2], vec![0, 0]), Err(SparseError::Pattern { column: 1 }));
}
