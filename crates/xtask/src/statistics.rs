//! What several beds say together: mean, scatter, standard error, and the line through a series of sizes.

/// Mean and standard deviation of a sample (NaN of fewer than two).
pub fn mean_and_deviation(values: &[f64]) -> [f64; 2] {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let squares: f64 = values.iter().map(|v| (v - mean).powi(2)).sum();
    [mean, (squares / (n - 1.0)).sqrt()]
}

/// Mean and standard error of the mean.
pub fn mean_and_error(values: &[f64]) -> [f64; 2] {
    let [mean, deviation] = mean_and_deviation(values);
    [mean, deviation / (values.len() as f64).sqrt()]
}

/// The line of least squares through points (x, y), at x = 0.
pub fn at_zero(points: &[(f64, f64)]) -> f64 {
    let n = points.len() as f64;
    let (x, y) = points.iter().fold((0.0, 0.0), |(x, y), p| (x + p.0 / n, y + p.1 / n));
    let (xx, xy) = points.iter().fold((0.0, 0.0), |(xx, xy), p| (xx + (p.0 - x).powi(2), xy + (p.0 - x) * (p.1 - y)));
    y - xy / xx * x
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sample_deviation_standard_error_and_intercept() {
        let values = [1.0, 2.0, 3.0, 6.0];
        // Squares about 3: 4 + 1 + 0 + 9 = 14, over 3.
        let deviation = (14.0_f64 / 3.0).sqrt();
        assert_eq!(mean_and_deviation(&values), [3.0, deviation]);
        assert_eq!(mean_and_error(&values), [3.0, deviation / 2.0]);
        assert!(mean_and_deviation(&[1.0])[1].is_nan());
        let line = [(1.0, 5.0), (2.0, 7.0), (4.0, 11.0)];
        assert!((at_zero(&line) - 3.0).abs() < 1e-12);
    }
}
