//! Running averages of the outputs.

use serde::{Deserialize, Serialize};
use std::collections::VecDeque;

/// Time-weighted means of N quantities over the last `window` seconds (less while the run is younger).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RunningMean {
    window: f64,
    width: usize,
    /// Durations (s) of the samples kept, oldest first; the oldest is cut where the window begins.
    durations: VecDeque<f64>,
    /// Their values, `width` each.
    samples: VecDeque<f64>,
}

impl RunningMean {
    /// Averages of `width` quantities over `window` (s); 0 keeps the newest value alone.
    pub fn new(window: f64, width: usize) -> Self {
        Self { window, width, durations: VecDeque::new(), samples: VecDeque::new() }
    }

    /// Adds the values that held for `duration` (s), and gives the means now.
    pub fn push<const N: usize>(&mut self, duration: f64, values: [f64; N]) -> [f64; N] {
        debug_assert_eq!(N, self.width);
        self.durations.push_back(duration);
        self.samples.extend(values);
        let mut excess = self.durations.iter().sum::<f64>() - self.window;
        // Round-off of the sum must not keep a sliver of a sample.
        while self.durations.len() > 1 && excess > -1e-9 * self.durations[0] {
            if excess < self.durations[0] * (1.0 - 1e-9) {
                self.durations[0] -= excess.max(0.0);
                break;
            }
            excess -= self.durations[0];
            self.durations.pop_front();
            self.samples.drain(..self.width);
        }
        // Summed anew at each call: a sum that adds and subtracts would keep the round-off of every peak for ever.
        let total: f64 = self.durations.iter().sum();
        let mut mean = [0.0; N];
        for (k, w) in self.durations.iter().enumerate() {
            for (j, m) in mean.iter_mut().enumerate() {
                *m += w / total * self.samples[k * N + j];
            }
        }
        mean
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mean_of_a_line_lags_by_half_a_window() {
        let mut mean = RunningMean::new(0.1, 1);
        for k in 0..1000 {
            let t = f64::from(k) * 1e-3;
            let [m] = mean.push(1e-3, [t]);
            let expected = if k < 100 { t / 2.0 } else { t - 0.0495 };
            assert!((m - expected).abs() < 1e-12, "{t}: {m}");
        }
        assert_eq!(mean.durations.len(), 100);
    }

    #[test]
    fn windows_that_steps_do_not_divide_weigh_the_oldest_in_part() {
        let mut mean = RunningMean::new(0.25, 2);
        for x in [1.0, 2.0, 3.0, 4.0] {
            mean.push(0.1, [x, -x]);
        }
        let [a, b] = mean.push(0.1, [5.0, -5.0]);
        assert!((a - (0.05 * 3.0 + 0.1 * 4.0 + 0.1 * 5.0) / 0.25).abs() < 1e-12 && b == -a);
        let mut newest = RunningMean::new(0.0, 1);
        newest.push(0.1, [7.0]);
        assert_eq!(newest.push(0.1, [3.0]), [3.0]);
    }
}
