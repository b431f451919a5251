//! Values continued between communication points, for receivers that hold an input over their step.
//!
//! A unit that does not interpolate its inputs takes one constant over its step. What it is given is the mean, over that step, of the
//! polynomial through the sender's last values: a straight line (order 1) or a parabola (order 2). The mean keeps the impulse of a force right, so
//! that order 1 makes the coupling second order in the step; order 2 lowers its error, not its order. At the start, with fewer values, the
//! order is lower. An output that depends directly on inputs is as old as those: second order needs it read again after they are set
//! (`resolveFeedThrough`). Times are counted in base steps.

/// The last values of one output.
#[derive(Clone, Debug, PartialEq)]
pub struct Track {
    order: u8,
    /// Newest first: base step and value.
    last: [(f64, f64); 3],
    known: usize,
}

impl Track {
    /// A track of order 1 or 2.
    pub fn new(order: u8) -> Self {
        Self { order, last: [(0.0, 0.0); 3], known: 0 }
    }

    /// Notes the value at a base step; a second value of the same instant replaces the first.
    pub fn note(&mut self, tick: u64, value: f64) {
        let time = tick as f64;
        if self.known > 0 && self.last[0].0 == time {
            self.last[0].1 = value;
            return;
        }
        self.last = [(time, value), self.last[0], self.last[1]];
        self.known = (self.known + 1).min(3);
    }

    /// As new.
    pub fn forget(&mut self) {
        self.known = 0;
    }

    /// Mean over the base steps from `a` to `b`.
    pub fn mean(&self, a: u64, b: u64) -> f64 {
        let [(t0, y0), (t1, y1), (t2, y2)] = self.last;
        let points = self.known.min(usize::from(self.order) + 1);
        if points < 2 {
            return y0;
        }
        // Newton's form about the newest point; a and b are counted from it.
        let (a, b) = (a as f64 - t0, b as f64 - t0);
        let slope = (y0 - y1) / (t0 - t1);
        let middle = 0.5 * (a + b);
        let mut mean = y0 + slope * middle;
        if points == 3 {
            let before = (y1 - y2) / (t1 - t2);
            let bend = (slope - before) / (t0 - t2);
            mean += bend * ((a * a + a * b + b * b) / 3.0 - (t1 - t0) * middle);
        }
        mean
    }

    /// Value, first and second derivative at a base step of this length (s): for receivers that interpolate themselves. Derivatives that are not known yet are 0.
    pub fn at(&self, tick: u64, length: f64) -> [f64; 3] {
        let [(t0, y0), (t1, y1), (t2, y2)] = self.last;
        let points = self.known.min(usize::from(self.order) + 1);
        if points < 2 {
            return [y0, 0.0, 0.0];
        }
        let t = tick as f64 - t0;
        let slope = (y0 - y1) / (t0 - t1);
        let (mut value, mut first, mut second) = (y0 + slope * t, slope, 0.0);
        if points == 3 {
            let bend = (slope - (y1 - y2) / (t1 - t2)) / (t0 - t2);
            value += bend * t * (t + t0 - t1);
            first += bend * (2.0 * t + t0 - t1);
            second = 2.0 * bend;
        }
        [value, first / length, second / (length * length)]
    }

    /// For a checkpoint: number of known values, then base steps and values.
    pub fn to_numbers(&self) -> [f64; 7] {
        let [(t0, y0), (t1, y1), (t2, y2)] = self.last;
        [self.known as f64, t0, y0, t1, y1, t2, y2]
    }

    /// The reverse of [`Track::to_numbers`].
    pub fn take_numbers(&mut self, n: [f64; 7]) {
        self.known = n[0] as usize;
        self.last = [(n[1], n[2]), (n[3], n[4]), (n[5], n[6])];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn polynomials_of_their_order_are_continued_exactly() {
        for (order, f) in [(1, (|t| 3.0 - 2.0 * t) as fn(f64) -> f64), (2, |t| 1.0 + t - 0.5 * t * t)] {
            let mut track = Track::new(order);
            for tick in [2, 5, 6] {
                track.note(tick, f(tick as f64));
            }
            // Mean over 6..9 by Simpson's rule, which is exact here.
            let exact = (f(6.0) + 4.0 * f(7.5) + f(9.0)) / 6.0;
            assert!((track.mean(6, 9) - exact).abs() < 1e-12, "{order}");
            // Base steps of 2 s.
            let e = 1e-3;
            let first = (f(7.0 + e) - f(7.0 - e)) / (2.0 * e) / 2.0;
            let second = (f(8.0) - 2.0 * f(7.0) + f(6.0)) / 4.0;
            for (got, wanted) in track.at(7, 2.0).into_iter().zip([f(7.0), first, second]) {
                assert!((got - wanted).abs() < 1e-9, "{order}: {got} {wanted}");
            }
        }
    }

    #[test]
    fn with_one_value_it_is_held_and_a_repeated_instant_replaces() {
        let mut track = Track::new(2);
        track.note(0, 5.0);
        track.note(0, 7.0);
        assert_eq!(track.mean(0, 1), 7.0);
        track.note(1, 8.0);
        assert_eq!(track.mean(1, 2), 8.5);
        let mut other = Track::new(2);
        other.take_numbers(track.to_numbers());
        assert_eq!(other, track);
    }
}
