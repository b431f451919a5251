//! How the cores a run may use are shared among its units.

/// Threads for each unit: `asked[i]` where the description says so, else its share of `budget` by `weight[i]` (a granular
/// terrain declares 100, a vehicle 1), at least one.
///
/// Shares are rounded by largest remainder, the heavier unit first. A unit whose share is below one thread still gets one,
/// and takes none away: it is idle most of the time while the heavy ones compute.
pub fn share_threads(budget: usize, asked: &[Option<u32>], weight: &[f64]) -> Vec<u32> {
    let free: Vec<usize> = (0..asked.len()).filter(|&i| asked[i].is_none()).collect();
    let taken: usize = asked.iter().flatten().map(|&n| n as usize).sum();
    let budget = budget.saturating_sub(taken);
    let sane = |i: usize| if weight[i].is_finite() && weight[i] > 0.0 { weight[i] } else { 0.0 };
    let total: f64 = free.iter().map(|&i| sane(i)).sum();
    let ideal = |i: usize| if total > 0.0 { budget as f64 * sane(i) / total } else { 0.0 };
    let mut threads: Vec<u32> = asked.iter().map(|a| a.unwrap_or(0)).collect();
    for &i in &free {
        threads[i] = ideal(i).floor() as u32;
    }
    let given: usize = free.iter().map(|&i| threads[i] as usize).sum();
    let mut order = free.clone();
    order.sort_by(|&a, &b| {
        let rest = |i: usize| ideal(i) - ideal(i).floor();
        rest(b).total_cmp(&rest(a)).then(sane(b).total_cmp(&sane(a))).then(a.cmp(&b))
    });
    for &i in order.iter().take(budget.saturating_sub(given)) {
        threads[i] += 1;
    }
    for &i in &free {
        threads[i] = threads[i].max(1);
    }
    threads
}

#[cfg(test)]
mod tests {
    use super::share_threads;

    #[test]
    fn the_terrain_gets_the_cores() {
        assert_eq!(share_threads(2, &[None; 3], &[1.0, 1.0, 100.0]), [1, 1, 2]);
        assert_eq!(share_threads(16, &[None; 3], &[1.0, 1.0, 100.0]), [1, 1, 16]);
        assert_eq!(share_threads(16, &[None; 3], &[1.0, 20.0, 100.0]), [1, 3, 13]);
        assert_eq!(share_threads(1, &[None; 2], &[1.0, 100.0]), [1, 1]);
    }

    #[test]
    fn what_the_description_asks_for_is_given() {
        assert_eq!(share_threads(8, &[Some(3), None, None], &[1.0, 1.0, 100.0]), [3, 1, 5]);
        assert_eq!(share_threads(2, &[Some(5), None], &[1.0, 1.0]), [5, 1]);
        assert_eq!(share_threads(3, &[None, None], &[1.0, 1.0]), [2, 1]);
        assert_eq!(share_threads(4, &[None, None], &[0.0, f64::NAN]), [1, 1]);
    }
}
