//! A figure that is checked is also printed, so that `cargo xtask validate` can make tables.
#![allow(dead_code)]

/// Checks `computed` against `expected` within `tolerance` (absolute) and prints the line for the tables.
#[track_caller]
pub fn figure(case: &str, quantity: &str, unit: &str, expected: f64, computed: f64, tolerance: f64) {
    // Short enough for a table, and exact enough for every tolerance here.
    let short =
        |x: f64| if x == 0.0 || (1e-3..1e5).contains(&x.abs()) { format!("{x:.7}") } else { format!("{x:.6e}") };
    println!("\nVALIDATION|{case}|{quantity}|{unit}|{expected}|{}|{tolerance:.2e}", short(computed));
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

/// A figure that must vanish up to `limit`.
#[track_caller]
pub fn below(case: &str, quantity: &str, unit: &str, computed: f64, limit: f64) {
    figure(case, quantity, unit, 0.0, computed, limit);
}

/// Prints a curve for the plots of `cargo xtask validate`; `plot` is (file, title, x label, x unit, y label, y unit), `style` one of line,
/// dashed, points.
pub fn curve(plot: [&str; 6], style: &str, series: &str, points: &[[f64; 2]]) {
    let points: Vec<String> = points.iter().map(|p| format!("{:.6e} {:.6e}", p[0], p[1])).collect();
    println!("\nCURVE|{}|{style}|{series}|{}", plot.join("|"), points.join(";"));
}
