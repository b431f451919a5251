//! A figure that is checked is also printed, so that `cargo xtask validate` can make tables.
#![allow(dead_code)]

/// Checks `computed` against `expected` within `tolerance` (absolute) and prints the line for the tables.
#[track_caller]
pub fn figure(case: &str, quantity: &str, unit: &str, expected: f64, computed: f64, tolerance: f64) {
    println!("VALIDATION|{case}|{quantity}|{unit}|{expected}|{computed:.9}|{tolerance:.2e}");
    assert!(
        (computed - expected).abs() <= tolerance,
        "{case} {quantity}: {computed} {unit}, expected {expected} +- {tolerance}"
    );
}

/// As [`figure`] with a relative tolerance.
#[track_caller]
pub fn relative(case: &str, quantity: &str, unit: &str, expected: f64, computed: f64, tolerance: f64) {
    figure(case, quantity, unit, expected, computed, tolerance * expected.abs());
}
