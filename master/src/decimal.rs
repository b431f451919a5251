//! Exact decimal times and the clock of a run.
//!
//! Times in a description are decimal texts ("4e-5", "0.02"). They are kept as `mantissa / 10^places`, so that "is a
//! multiple of" is a question about integers. **The tick of a run is its base step**: [`Clock::time`] turns a count of base
//! steps into the nearest double, with no sum of rounded steps.

use std::fmt;

use serde::{Serialize, Serializer};

/// Decimal places a time may have: 1e-15 s is far below any step, and the arithmetic below stays inside `i128`.
const MOST_PLACES: u32 = 15;
/// Largest time in seconds (some thirty million years; keeps products inside `i128`).
const MOST_SECONDS: i128 = 1_000_000_000_000_000;

/// An exact decimal number `mantissa / 10^places` with 0 <= places <= 15, reduced, so that equal numbers are equal values.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub struct Decimal {
    mantissa: i128,
    places: u32,
}

impl Decimal {
    /// Zero.
    pub const ZERO: Self = Self { mantissa: 0, places: 0 };

    /// Reads a decimal text such as `12`, `-0.5`, `4e-5`, `1.25E+3`.
    ///
    /// # Errors
    /// What is allowed, in words, if the text is no decimal number, has digits below 1e-15 or exceeds 1e15.
    pub fn parse(text: &str) -> Result<Self, String> {
        const ALLOWED: &str = "a decimal number such as 0.001 or 1e-3";
        let text = text.trim();
        let (digits, exponent) = match text.find(['e', 'E']) {
            Some(at) => (&text[..at], text[at + 1..].parse::<i32>().map_err(|_| ALLOWED.to_owned())?),
            None => (text, 0),
        };
        let (negative, digits) = match digits.as_bytes().first() {
            Some(b'-') => (true, &digits[1..]),
            Some(b'+') => (false, &digits[1..]),
            _ => (false, digits),
        };
        let (whole, fraction) = digits.split_once('.').unwrap_or((digits, ""));
        if whole.len() + fraction.len() == 0 || !whole.bytes().chain(fraction.bytes()).all(|b| b.is_ascii_digit()) {
            return Err(ALLOWED.to_owned());
        }
        let fraction = fraction.trim_end_matches('0');
        let whole = whole.trim_start_matches('0');
        if whole.len() + fraction.len() > 33 {
            return Err(format!("{ALLOWED} with at most {MOST_PLACES} decimal places"));
        }
        let mut mantissa: i128 = 0;
        for b in whole.bytes().chain(fraction.bytes()) {
            mantissa = mantissa * 10 + i128::from(b - b'0');
        }
        let mut places = fraction.len() as i64 - i64::from(exponent);
        while mantissa != 0 && places > 0 && mantissa % 10 == 0 {
            mantissa /= 10;
            places -= 1;
        }
        if mantissa == 0 {
            return Ok(Self::ZERO);
        }
        while places < 0 {
            mantissa *= 10;
            places += 1;
            if mantissa > MOST_SECONDS {
                return Err("a number up to 1e15".to_owned());
            }
        }
        if places > i64::from(MOST_PLACES) {
            return Err(format!("{ALLOWED} with at most {MOST_PLACES} decimal places"));
        }
        let places = places as u32;
        if mantissa / power(places) >= MOST_SECONDS {
            return Err("a number up to 1e15".to_owned());
        }
        Ok(Self { mantissa: if negative { -mantissa } else { mantissa }, places })
    }

    /// Whether the number is above zero.
    pub fn is_positive(self) -> bool {
        self.mantissa > 0
    }

    /// The nearest double.
    pub fn to_f64(self) -> f64 {
        nearest(self.mantissa, self.places)
    }

    /// `self - other`, exactly.
    pub fn minus(self, other: Self) -> Self {
        let places = self.places.max(other.places);
        Self::reduced(self.scaled(places) - other.scaled(places), places)
    }

    /// `self / unit` if that is a whole number that fits `u64`; `None` otherwise or for `unit` not above zero.
    pub fn count_of(self, unit: Self) -> Option<u64> {
        let places = self.places.max(unit.places);
        let (a, b) = (self.scaled(places), unit.scaled(places));
        if b <= 0 || a < 0 || a % b != 0 { None } else { u64::try_from(a / b).ok() }
    }

    /// The whole multiples of `unit` next below and next above (for messages).
    pub fn neighbours(self, unit: Self) -> (Self, Self) {
        let places = self.places.max(unit.places);
        let (a, b) = (self.scaled(places), unit.scaled(places).max(1));
        let below = a.div_euclid(b);
        (Self::reduced(below * b, places), Self::reduced((below + 1) * b, places))
    }

    fn scaled(self, places: u32) -> i128 {
        self.mantissa * power(places - self.places)
    }

    fn reduced(mut mantissa: i128, mut places: u32) -> Self {
        while places > 0 && mantissa % 10 == 0 {
            mantissa /= 10;
            places -= 1;
        }
        Self { mantissa, places }
    }
}

fn power(places: u32) -> i128 {
    10_i128.pow(places)
}

/// `mantissa / 10^places` rounded to the nearest double.
fn nearest(mantissa: i128, places: u32) -> f64 {
    // Both operands exact: one IEEE division rounds once. Larger mantissas go through the text, which also rounds once.
    if mantissa.unsigned_abs() < 1 << 53 {
        mantissa as f64 / power(places) as f64
    } else {
        Decimal { mantissa, places }.to_string().parse().unwrap_or(f64::NAN)
    }
}

impl fmt::Display for Decimal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let sign = if self.mantissa < 0 { "-" } else { "" };
        let digits = self.mantissa.unsigned_abs().to_string();
        let places = self.places as usize;
        if places == 0 {
            return write!(f, "{sign}{digits}");
        }
        let digits = format!("{digits:0>width$}", width = places + 1);
        let (whole, fraction) = digits.split_at(digits.len() - places);
        write!(f, "{sign}{whole}.{fraction}")
    }
}

impl Serialize for Decimal {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_f64(self.to_f64())
    }
}

/// The clock of a run: it ticks in base steps.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Clock {
    /// Start time, s.
    pub start: Decimal,
    /// Base communication step, s: one tick.
    pub step: Decimal,
    /// Number of base steps from start to stop.
    pub steps: u64,
}

/// [`Clock::time`] in two machine instructions, for clocks whose numbers fit: the same bits.
#[derive(Clone, Copy, Debug)]
pub struct Ticker {
    start: i64,
    step: i64,
    over: f64,
}

impl Ticker {
    /// Simulated time after `ticks` base steps, s.
    #[inline]
    pub fn time(&self, ticks: u64) -> f64 {
        (self.start + self.step * ticks as i64) as f64 / self.over
    }
}

impl Clock {
    /// The quick way to [`Clock::time`]; `None` where a time of the run, in units of the last decimal place, is no exact double.
    pub fn ticker(&self) -> Option<Ticker> {
        let places = self.start.places.max(self.step.places);
        let (start, step) = (self.start.scaled(places), self.step.scaled(places));
        let last = start.saturating_add(i128::from(self.steps.saturating_add(1)).saturating_mul(step));
        let fits = |x: i128| x.unsigned_abs() < 1 << 53;
        (fits(start) && fits(last)).then(|| Ticker {
            start: start as i64,
            step: step as i64,
            over: power(places) as f64,
        })
    }

    /// Simulated time after `ticks` base steps, exactly.
    pub fn exact_time(&self, ticks: u64) -> Decimal {
        let places = self.start.places.max(self.step.places);
        let passed = i128::from(ticks).saturating_mul(self.step.scaled(places));
        Decimal::reduced(self.start.scaled(places).saturating_add(passed), places)
    }

    /// Simulated time after `ticks` base steps, s: `start + ticks * step`, computed exactly and rounded once.
    pub fn time(&self, ticks: u64) -> f64 {
        let places = self.start.places.max(self.step.places);
        let passed = i128::from(ticks).saturating_mul(self.step.scaled(places));
        nearest(self.start.scaled(places).saturating_add(passed), places)
    }

    /// Length of `multiple` base steps, s, rounded once.
    pub fn length(&self, multiple: u64) -> f64 {
        nearest(i128::from(multiple).saturating_mul(self.step.mantissa), self.step.places)
    }

    /// Time at the end, s.
    pub fn stop(&self) -> f64 {
        self.time(self.steps)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn decimal_texts_are_read_exactly() {
        for (text, shown) in [
            ("4e-5", "0.00004"),
            ("0.0200", "0.02"),
            ("1.25E+3", "1250"),
            ("-0.5", "-0.5"),
            ("0e99", "0"),
            (" 7 ", "7"),
        ] {
            assert_eq!(Decimal::parse(text).unwrap().to_string(), shown);
        }
        assert_eq!(Decimal::parse("100").unwrap(), Decimal::parse("1e2").unwrap());
        for text in ["", ".", "1,5", "1e", "nan", "inf", "1e-16", "1e16", "0x10", "1e-999999999", "1e999999999", "--1"]
        {
            assert!(Decimal::parse(text).is_err(), "{text}");
        }
    }

    #[test]
    fn multiples_are_counted_without_rounding() {
        let (stop, step) = (Decimal::parse("0.3").unwrap(), Decimal::parse("0.1").unwrap());
        assert_eq!(stop.count_of(step), Some(3)); // 0.3 / 0.1 is 2.9999999999999996 in doubles
        assert_eq!(Decimal::parse("0.25").unwrap().count_of(step), None);
        let (below, above) = Decimal::parse("0.25").unwrap().neighbours(step);
        assert_eq!((below.to_string(), above.to_string()), ("0.2".to_owned(), "0.3".to_owned()));
    }

    #[test]
    fn the_clock_does_not_drift() {
        let clock = Clock { start: Decimal::ZERO, step: Decimal::parse("0.0001").unwrap(), steps: 10_000_000 };
        assert_eq!(clock.time(3), 0.0003);
        assert_eq!(clock.time(1_234_567), 123.4567);
        assert_eq!(clock.stop(), 1000.0);
        assert_eq!(clock.length(7), 0.0007);
        let ticker = clock.ticker().unwrap();
        for tick in [0, 1, 3, 1_234_567, 9_999_999, 10_000_000] {
            assert_eq!(ticker.time(tick).to_bits(), clock.time(tick).to_bits());
        }
        assert_eq!(clock.exact_time(1_234_567).to_string(), "123.4567");
    }
}
