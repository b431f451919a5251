//! How numbers meet the eye: axis ranges, ticks, unit prefixes, digits.

/// Values beyond this are as good as infinite: differences of larger ones overflow.
const HUGE: f64 = 1e100;

fn usable(v: &f64) -> bool {
    v.abs() < HUGE
}

/// Range of the finite values; `None` when there is none.
pub(super) fn range<'a>(values: impl IntoIterator<Item = &'a f64>) -> Option<[f64; 2]> {
    values.into_iter().filter(|v| usable(v)).fold(None, |r, v| {
        let [low, high] = r.unwrap_or([*v, *v]);
        Some([low.min(*v), high.max(*v)])
    })
}

/// The range that holds all but `share` of the finite values at each end.
pub(super) fn inner_range(values: &[f64], share: f64) -> Option<[f64; 2]> {
    let mut sorted: Vec<f64> = values.iter().copied().filter(usable).collect();
    sorted.sort_by(f64::total_cmp);
    let cut = (sorted.len() as f64 * share) as usize;
    Some([*sorted.get(cut)?, *sorted.get(sorted.len() - 1 - cut)?])
}

/// The smaller range of both.
pub(super) fn join(a: Option<[f64; 2]>, b: Option<[f64; 2]>) -> Option<[f64; 2]> {
    match (a, b) {
        (Some(a), Some(b)) => Some([a[0].min(b[0]), a[1].max(b[1])]),
        (a, b) => a.or(b),
    }
}

/// A range to draw: zero included when it is near, margins added, never empty.
pub(super) fn padded([low, high]: [f64; 2]) -> [f64; 2] {
    let size = low.abs().max(high.abs());
    if high - low <= (1e-9 * size).max(1.0 / HUGE) {
        let half = if size > 1.0 / HUGE { 0.1 * size } else { 1.0 };
        return [low - half, high + half];
    }
    let low = if low > 0.0 && low < 0.4 * high { 0.0 } else { low };
    let high = if high < 0.0 && high > 0.4 * low { 0.0 } else { high };
    let margin = 0.06 * (high - low);
    [if low == 0.0 { 0.0 } else { low - margin }, if high == 0.0 { 0.0 } else { high + margin }]
}

/// Round ticks inside a range, at most about `count`, with the digits after the point that they need.
pub(super) fn ticks([low, high]: [f64; 2], count: usize) -> (Vec<f64>, usize) {
    let rough = (high - low) / count.max(1) as f64;
    if !rough.is_finite() || rough <= 0.0 {
        return (Vec::new(), 0);
    }
    let decade = 10_f64.powf(rough.log10().floor());
    let step =
        [1.0, 2.0, 5.0, 10.0].into_iter().map(|m| m * decade).find(|s| *s >= rough * 0.999).unwrap_or(10.0 * decade);
    let digits = (-(step.log10() + 1e-9).floor()).max(0.0) as usize;
    let (first, last) = ((low / step - 1e-6).ceil() as i64, (high / step + 1e-6).floor() as i64);
    ((first..=last).map(|i| i as f64 * step).collect(), digits)
}

/// A tick's text, with a typographic minus.
pub(super) fn tick_text(x: f64, digits: usize) -> String {
    let text = format!("{:.digits$}", x);
    let zero = text.chars().all(|c| matches!(c, '-' | '0' | '.'));
    if zero { "0".into() } else { text.replace('-', "\u{2212}") }
}

/// How a quantity is shown: values times `factor`, in `unit`.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Shown {
    pub factor: f64,
    pub unit: String,
}

/// Chooses a prefix (mm, kN, MPa, ...) for values up to `size`, or a power of ten where prefixes are unusual.
pub(super) fn shown(unit: &str, size: f64) -> Shown {
    let plain = Shown { factor: 1.0, unit: pretty_unit(unit) };
    if !(1.0 / HUGE..HUGE).contains(&size) || unit == "1" || (unit.is_empty() && (1e-3..1e5).contains(&size)) {
        return plain;
    }
    // Whoever reads soil and wheel data expects mm for sinkage, but m for travel.
    let small = |limit: f64| size < limit;
    let prefixed = match unit {
        "m" | "m/s" if small(1e-4) => Some((1e6, "\u{b5}")),
        "m" | "m/s" if small(0.2) => Some((1e3, "m")),
        "m" if size >= 1e4 => Some((1e-3, "k")),
        "s" if small(1e-3) => Some((1e6, "\u{b5}")),
        "s" if small(0.2) => Some((1e3, "m")),
        "N" | "N.m" | "J" | "W" | "Pa" | "N/m" => match size {
            _ if small(1e-6) => Some((1e9, "n")),
            _ if small(1e-3) => Some((1e6, "\u{b5}")),
            _ if small(0.1) => Some((1e3, "m")),
            _ if size >= 1e9 => Some((1e-9, "G")),
            _ if size >= 2e6 => Some((1e-6, "M")),
            _ if size >= 2e3 => Some((1e-3, "k")),
            _ => None,
        },
        _ => None,
    };
    if let Some((factor, prefix)) = prefixed {
        return Shown { factor, unit: format!("{prefix}{}", plain.unit) };
    }
    if (1e-3..1e5).contains(&size) {
        return plain;
    }
    let power = 3 * (size.log10() / 3.0).floor() as i32;
    let unit = if unit.is_empty() { String::new() } else { format!(" {}", plain.unit) };
    Shown { factor: 10_f64.powi(-power), unit: format!("10{}{unit}", superscript(&power.to_string())) }
}

/// `N.m` as N·m, `m/s2` as m/s², nothing as an en dash.
pub(super) fn pretty_unit(unit: &str) -> String {
    if unit.is_empty() || unit == "1" {
        return "\u{2013}".into();
    }
    let mut text = String::new();
    let mut exponent = String::new();
    let mut letter = false;
    for c in unit.chars() {
        if letter && (c.is_ascii_digit() || c == '-') {
            exponent.push(c);
            continue;
        }
        text.push_str(&superscript(&std::mem::take(&mut exponent)));
        letter = c.is_alphabetic();
        text.push(if c == '.' { '\u{b7}' } else { c });
    }
    text + &superscript(&exponent)
}

fn superscript(digits: &str) -> String {
    let raised = |c| match c {
        '-' => '\u{207b}',
        '1' => '\u{b9}',
        '2' => '\u{b2}',
        '3' => '\u{b3}',
        c => c.to_digit(10).and_then(|d| char::from_u32(0x2070 + d)).unwrap_or(c),
    };
    digits.chars().map(raised).collect()
}

/// A number with `digits` significant digits for tables; exponents outside 1e-4 .. 1e7.
pub(super) fn significant(x: f64, digits: usize) -> String {
    if !x.is_finite() {
        return if x.is_nan() { "\u{2013}".into() } else { format!("{x}") };
    }
    if x == 0.0 {
        return "0".into();
    }
    let rounded = format!("{x:.*e}", digits.saturating_sub(1));
    let power: i32 = rounded.split_once('e').and_then(|(_, p)| p.parse().ok()).unwrap_or(0);
    if !(-4..7).contains(&power) {
        return rounded;
    }
    format!("{x:.*}", (digits as i32 - 1 - power).max(0) as usize)
}

/// The same without zeros at the end, for numbers that people chose.
pub(super) fn short(x: f64) -> String {
    let text = significant(x, 6);
    if !text.contains('.') || text.contains('e') {
        return text;
    }
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_inside() {
        assert_eq!(ticks([0.0, 1.0], 5), (vec![0.0, 0.2, 0.4, 0.6000000000000001, 0.8, 1.0], 1));
        assert_eq!(ticks([-0.013, 0.021], 4), (vec![-0.01, 0.0, 0.01, 0.02], 2));
        assert_eq!(ticks([0.0, 1000.0], 4).1, 0);
        assert!(ticks([1.0, 1.0], 4).0.is_empty());
        assert_eq!(tick_text(-0.0001, 2), "0");
        assert_eq!(tick_text(-0.1, 2), "\u{2212}0.10");
    }

    #[test]
    fn units_take_prefixes_where_engineers_use_them() {
        assert_eq!(shown("m", 0.023), Shown { factor: 1e3, unit: "mm".into() });
        assert_eq!(shown("m", 1.2).unit, "m");
        assert_eq!(shown("N", 25e3).unit, "kN");
        assert_eq!(shown("Pa", 2.1e8).unit, "MPa");
        assert_eq!(shown("N.m", 0.5).unit, "N\u{b7}m");
        assert_eq!(shown("", 0.5).unit, "\u{2013}");
        assert_eq!(shown("rad", 2e-7), Shown { factor: 1e9, unit: "10\u{207b}\u{2079} rad".into() });
        assert_eq!(pretty_unit("kg.m2/s2"), "kg\u{b7}m\u{b2}/s\u{b2}");
        assert_eq!(pretty_unit("s-1"), "s\u{207b}\u{b9}");
    }

    #[test]
    fn digits_are_significant() {
        assert_eq!(significant(22.712, 4), "22.71");
        assert_eq!(significant(0.9996, 3), "1.00");
        assert_eq!((short(6.0), short(0.25), short(1e-9)), ("6".into(), "0.25".into(), "1.00000e-9".into()));
        assert_eq!(significant(-12345.6, 4), "-12346");
        assert_eq!(significant(3.2e-9, 3), "3.20e-9");
        assert_eq!(significant(f64::NAN, 3), "\u{2013}");
    }

    #[test]
    fn ranges_are_never_empty() {
        assert_eq!(padded([5.0, 5.0]), [4.5, 5.5]);
        assert_eq!(padded([0.0, 0.0]), [-1.0, 1.0]);
        assert_eq!(padded([0.1, 1.0])[0], 0.0);
        assert_eq!(range(&[f64::NAN]), None);
        assert_eq!(inner_range(&[1.0, 2.0, 3.0, 400.0], 0.25), Some([2.0, 3.0]));
    }
}
