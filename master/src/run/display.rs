//! What the user sees while a run goes: a bar on a terminal, a line every few seconds elsewhere, nothing when quiet.

use std::io::IsTerminal;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::decimal::Clock;

/// Between two plain lines.
const LINE_EVERY: Duration = Duration::from_secs(5);
/// Between two updates of the bar.
const BAR_EVERY: Duration = Duration::from_millis(100);
/// Parts of the bar.
const LENGTH: u64 = 1000;

#[derive(Debug)]
enum Kind {
    Quiet,
    Bar(ProgressBar),
    Lines,
}

/// The display. All output goes to stderr.
#[derive(Debug)]
pub struct Display {
    kind: Kind,
    shown: Instant,
    /// When stepping began, the clock, and the base step it began at.
    run: Option<(Instant, Clock, u64)>,
    /// Wall time of the last base steps is long: look at every one.
    slow: bool,
    stepped: Instant,
}

impl Display {
    fn new(kind: Kind) -> Self {
        let now = Instant::now();
        Self { kind, shown: now, run: None, slow: true, stepped: now }
    }

    /// Shows nothing.
    pub fn quiet() -> Self {
        Self::new(Kind::Quiet)
    }

    /// A bar if stderr is a terminal, plain lines otherwise.
    pub fn for_stderr() -> Self {
        if !std::io::stderr().is_terminal() {
            return Self::new(Kind::Lines);
        }
        let bar = ProgressBar::with_draw_target(Some(LENGTH), ProgressDrawTarget::stderr());
        if let Ok(style) = ProgressStyle::with_template("{prefix} [{bar:30}] {msg}") {
            bar.set_style(style.progress_chars("=> "));
        }
        Self::new(Kind::Bar(bar))
    }

    /// Whether steps take so long that each should be shown.
    pub fn is_slow(&self) -> bool {
        self.slow
    }

    fn due(&mut self) -> bool {
        let every = match self.kind {
            Kind::Quiet => return false,
            Kind::Bar(_) => BAR_EVERY,
            Kind::Lines => LINE_EVERY,
        };
        let due = self.shown.elapsed() >= every;
        if due {
            self.shown = Instant::now();
        }
        due
    }

    /// Initialisation begins.
    pub fn initialising(&mut self) {
        if let Kind::Bar(bar) = &self.kind {
            bar.set_prefix("initialising");
            bar.set_position(0);
        }
    }

    /// Stepping begins at base step `from`.
    pub fn running(&mut self, clock: Clock, from: u64) {
        let now = Instant::now();
        self.run = Some((now, clock, from));
        self.stepped = now;
        if let Kind::Bar(bar) = &self.kind {
            bar.set_prefix("running");
            bar.set_position(0);
            bar.set_message("");
        }
    }

    /// A unit reports long work.
    pub fn phase(&mut self, unit: &str, phase: &str, fraction: f64) {
        if !self.due() {
            return;
        }
        let known = (0.0..=1.0).contains(&fraction);
        let part = if known { format!(" {:.0} %", 100.0 * fraction) } else { String::new() };
        match &self.kind {
            Kind::Quiet => {}
            Kind::Lines => eprintln!("{unit}: {phase}{part}"),
            Kind::Bar(bar) => {
                if known {
                    bar.set_position((fraction * LENGTH as f64) as u64);
                }
                bar.set_message(format!("{unit}: {phase}{part}"));
            }
        }
    }

    /// The run stands at this time (s) and base step.
    pub fn step(&mut self, time: f64, tick: u64) {
        if matches!(self.kind, Kind::Quiet) {
            self.slow = false;
            return;
        }
        let now = Instant::now();
        self.slow = now - self.stepped > BAR_EVERY / 20;
        self.stepped = now;
        let Some((begin, clock, from)) = self.run else { return };
        if !self.due() {
            return;
        }
        let (factor, left) = pace(&clock, from, tick, begin.elapsed().as_secs_f64());
        let left = left.map_or(String::new(), |s| format!(", {} left", duration(s)));
        let text = format!("t = {time:.4} of {} s, real-time factor {}{left}", clock.stop(), short(factor));
        let done = tick as f64 / clock.steps.max(1) as f64;
        match &self.kind {
            Kind::Quiet => {}
            Kind::Lines => eprintln!("{:3.0} %  {text}", 100.0 * done),
            Kind::Bar(bar) => {
                bar.set_position((done * LENGTH as f64) as u64);
                bar.set_message(text);
            }
        }
    }

    /// A message that stays.
    pub fn message(&self, text: &str) {
        match &self.kind {
            Kind::Quiet => {}
            Kind::Lines => eprintln!("{text}"),
            Kind::Bar(bar) => bar.suspend(|| eprintln!("{text}")),
        }
    }

    /// Takes the bar away.
    pub fn finish(&self) {
        if let Kind::Bar(bar) = &self.kind {
            bar.finish_and_clear();
        }
    }
}

/// Real-time factor, and seconds left at this pace, of a run that went from one base step to another in `wall` seconds: what an earlier piece of it took
/// says nothing of now.
fn pace(clock: &Clock, from: u64, tick: u64, wall: f64) -> (f64, Option<f64>) {
    let steps = tick.saturating_sub(from);
    let simulated = clock.time(tick) - clock.time(from.min(tick));
    let factor = if wall > 0.0 { simulated / wall } else { 0.0 };
    (factor, (steps > 0).then(|| wall * clock.steps.saturating_sub(tick) as f64 / steps as f64))
}

/// A number with three figures.
pub fn short(x: f64) -> String {
    if x != 0.0 && !(1e-3..1e5).contains(&x.abs()) {
        return format!("{x:.2e}");
    }
    let digits = if x == 0.0 { 0 } else { (2 - x.abs().log10().floor() as i32).max(0) as usize };
    format!("{x:.digits$}")
}

/// A span of wall time for people.
pub fn duration(seconds: f64) -> String {
    let s = seconds.max(0.0).round() as u64;
    match (s / 3600, s / 60 % 60, s % 60) {
        (0, 0, _) if seconds < 10.0 => format!("{seconds:.1} s"),
        (0, 0, s) => format!("{s} s"),
        (0, m, s) => format!("{m} min {s} s"),
        (h, m, _) => format!("{h} h {m} min"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_left_is_told_by_the_pace_since_a_resume() {
        let [start, step] = ["1", "0.01"].map(|text| crate::decimal::Decimal::parse(text).unwrap());
        let clock = Clock { start, step, steps: 600 };
        let (factor, left) = pace(&clock, 300, 320, 40.0);
        assert!((factor - 0.005).abs() < 1e-12, "{factor}");
        assert_eq!(left, Some(560.0));
        assert_eq!(pace(&clock, 300, 300, 1.0), (0.0, None));
    }

    #[test]
    fn numbers_are_short() {
        assert_eq!(short(0.012345), "0.0123");
        assert_eq!(short(12.345), "12.3");
        assert_eq!(short(1234.5), "1234");
        assert_eq!(short(1.5e-6), "1.50e-6");
        assert_eq!(short(0.0), "0");
        assert_eq!(duration(3.21), "3.2 s");
        assert_eq!(duration(200.0), "3 min 20 s");
        assert_eq!(duration(7300.0), "2 h 1 min");
    }
}
