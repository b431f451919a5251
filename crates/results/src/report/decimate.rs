//! Thinning of long series to what the eye can tell apart, so that a report stays small.

/// Lines in pixels through the points that are finite, thinned: per pixel column first, lowest, highest and last point,
/// then whatever lies within `tolerance` pixels of a straight line goes. Peaks stay. A gap (not a number) splits the line.
pub(super) fn thin(x: &[f64], y: &[f64], tolerance: f64) -> Vec<Vec<[f64; 2]>> {
    let mut lines: Vec<Vec<[f64; 2]>> = vec![Vec::new()];
    for (x, y) in x.iter().zip(y) {
        if x.is_finite() && y.is_finite() {
            if let Some(line) = lines.last_mut() {
                line.push([*x, *y]);
            }
        } else if lines.last().is_some_and(|l| !l.is_empty()) {
            lines.push(Vec::new());
        }
    }
    lines.retain(|l| !l.is_empty());
    lines.iter().map(|line| simplify(&columns(line), tolerance)).collect()
}

/// At most four points for each run of consecutive points in one pixel column.
fn columns(line: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let mut out = Vec::new();
    for run in line.chunk_by(|a, b| a[0].floor() == b[0].floor()) {
        let by_y = |a: &usize, b: &usize| run[*a][1].total_cmp(&run[*b][1]);
        let low = (0..run.len()).min_by(by_y).unwrap_or(0);
        let high = (0..run.len()).max_by(by_y).unwrap_or(0);
        let mut keep = [0, low, high, run.len() - 1];
        keep.sort_unstable();
        out.extend(keep.chunk_by(|a, b| a == b).map(|same| run[same[0]]));
    }
    out
}

/// Douglas and Peucker's line simplification (1973), with an own stack.
fn simplify(line: &[[f64; 2]], tolerance: f64) -> Vec<[f64; 2]> {
    let mut keep = vec![false; line.len()];
    let mut stack = vec![(0, line.len().saturating_sub(1))];
    while let Some((a, b)) = stack.pop() {
        keep[a] = true;
        keep[b] = true;
        let farthest = (a + 1..b).map(|i| (i, distance(line[i], line[a], line[b]))).max_by(|p, q| p.1.total_cmp(&q.1));
        if let Some((i, _)) = farthest.filter(|(_, d)| *d > tolerance) {
            stack.push((a, i));
            stack.push((i, b));
        }
    }
    line.iter().zip(keep).filter(|(_, k)| *k).map(|(p, _)| *p).collect()
}

/// Distance of `p` from the segment `a` to `b`.
fn distance(p: [f64; 2], a: [f64; 2], b: [f64; 2]) -> f64 {
    let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
    let length2 = dx * dx + dy * dy;
    let t = if length2 > 0.0 { (((p[0] - a[0]) * dx + (p[1] - a[1]) * dy) / length2).clamp(0.0, 1.0) } else { 0.0 };
    (p[0] - a[0] - t * dx).hypot(p[1] - a[1] - t * dy)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_peak_of_one_sample_stays() {
        let n = 200_000;
        let x: Vec<f64> = (0..n).map(|i| 500.0 * i as f64 / n as f64).collect();
        let mut y = vec![100.0; n];
        y[123_457] = 3.0;
        let lines = thin(&x, &y, 0.2);
        assert_eq!(lines.len(), 1);
        assert!(lines[0].len() < 10, "{}", lines[0].len());
        assert!(lines[0].iter().any(|p| p[1] == 3.0));
        assert_eq!((lines[0][0], lines[0][lines[0].len() - 1]), ([x[0], 100.0], [x[n - 1], 100.0]));
    }

    #[test]
    fn gaps_split_and_single_points_survive() {
        let nan = f64::NAN;
        let lines = thin(&[0.0, 1.0, 2.0, 3.0, 4.0], &[1.0, nan, nan, 2.0, 5.0], 0.1);
        assert_eq!(lines, [vec![[0.0, 1.0]], vec![[3.0, 2.0], [4.0, 5.0]]]);
        assert!(thin(&[], &[], 0.1).is_empty());
    }

    #[test]
    fn noise_is_bounded_by_the_pixels() {
        let n = 100_000;
        let x: Vec<f64> = (0..n).map(|i| 300.0 * i as f64 / n as f64).collect();
        let y: Vec<f64> = (0..n).map(|i| (i as f64 * 12.9898).sin() * 50.0).collect();
        assert!(thin(&x, &y, 0.2)[0].len() <= 1200);
    }
}
