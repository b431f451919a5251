//! Physical units: dimension, factor and offset to SI, and conversion between units of one dimension.

use std::fmt;

use serde::Serialize;

/// Exponents of kg, m, s, A, K, mol, cd, rad. The radian counts, as in FMI 2.0: it keeps a speed in rad/s from being fed
/// with a frequency in 1/s, a mistake of a factor of 2 pi.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Dimension(pub [i32; 8]);

/// Names of the base units, in the order of [`Dimension`].
pub const BASE_UNITS: [&str; 8] = ["kg", "m", "s", "A", "K", "mol", "cd", "rad"];

impl fmt::Display for Dimension {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut first = true;
        for (exponent, name) in self.0.iter().zip(BASE_UNITS) {
            if *exponent != 0 {
                let dot = if first { "" } else { "." };
                first = false;
                if *exponent == 1 { write!(f, "{dot}{name}")? } else { write!(f, "{dot}{name}{exponent}")? }
            }
        }
        if first { write!(f, "1") } else { Ok(()) }
    }
}

/// What a unit is in SI: `value in SI = factor * value + offset`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct BaseUnit {
    /// Dimension.
    pub dimension: Dimension,
    /// Factor to SI.
    pub factor: f64,
    /// Offset to SI, in SI units.
    pub offset: f64,
}

/// A named unit. Without a definition nothing is known but its name.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Unit {
    /// Name, such as `N.m`.
    pub name: String,
    /// What it is in SI, if the file (or the table below) says so.
    pub base: Option<BaseUnit>,
}

impl Unit {
    /// A unit known by name only: defined if the table of common units has it.
    pub fn named(name: &str) -> Self {
        Self { name: name.to_owned(), base: common(name) }
    }
}

impl fmt::Display for Unit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.base {
            Some(base) if base.dimension.to_string() != self.name => write!(f, "{} ({})", self.name, base.dimension),
            _ => write!(f, "{}", self.name),
        }
    }
}

/// `target = factor * source + offset`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Linear {
    /// Factor.
    pub factor: f64,
    /// Offset, in the target's unit.
    pub offset: f64,
}

impl Linear {
    /// No change.
    pub const IDENTITY: Self = Self { factor: 1.0, offset: 0.0 };

    /// Applies the map.
    pub fn apply(self, value: f64) -> f64 {
        self.factor * value + self.offset
    }

    /// The value that this map turns into `value`.
    pub fn inverse(self, value: f64) -> f64 {
        (value - self.offset) / self.factor
    }

    /// This map first, then another.
    pub fn then(self, next: Self) -> Self {
        Self { factor: next.factor * self.factor, offset: next.factor * self.offset + next.offset }
    }
}

/// How two units relate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Relation {
    /// The same, or nothing is known that speaks against it: the number goes over as it is.
    Same,
    /// One dimension, another scale.
    Convert(Linear),
    /// Different dimensions.
    Different,
    /// Different names, and at least one without a definition: nothing can be said.
    Unknown,
}

/// How a value in `from` becomes one in `to`. No unit on a side means no conversion.
pub fn relate(from: Option<&Unit>, to: Option<&Unit>) -> Relation {
    let (Some(from), Some(to)) = (from, to) else { return Relation::Same };
    match (&from.base, &to.base) {
        (Some(a), Some(b)) if a.dimension != b.dimension => Relation::Different,
        (Some(a), Some(b)) if a.factor == b.factor && a.offset == b.offset => Relation::Same,
        (Some(a), Some(b)) => {
            Relation::Convert(Linear { factor: a.factor / b.factor, offset: (a.offset - b.offset) / b.factor })
        }
        _ if from.name == to.name => Relation::Same,
        _ => Relation::Unknown,
    }
}

/// Units that people write without defining them. Exponents in the order of [`BASE_UNITS`].
fn common(name: &str) -> Option<BaseUnit> {
    let unit = |dimension: [i32; 8], factor: f64, offset: f64| {
        Some(BaseUnit { dimension: Dimension(dimension), factor, offset })
    };
    let si = |dimension| unit(dimension, 1.0, 0.0);
    let pi = std::f64::consts::PI;
    match name {
        "1" | "-" => si([0; 8]),
        "%" => unit([0; 8], 0.01, 0.0),
        "kg" => si([1, 0, 0, 0, 0, 0, 0, 0]),
        "g" => unit([1, 0, 0, 0, 0, 0, 0, 0], 1e-3, 0.0),
        "t" => unit([1, 0, 0, 0, 0, 0, 0, 0], 1e3, 0.0),
        "m" => si([0, 1, 0, 0, 0, 0, 0, 0]),
        "mm" => unit([0, 1, 0, 0, 0, 0, 0, 0], 1e-3, 0.0),
        "cm" => unit([0, 1, 0, 0, 0, 0, 0, 0], 1e-2, 0.0),
        "km" => unit([0, 1, 0, 0, 0, 0, 0, 0], 1e3, 0.0),
        "s" => si([0, 0, 1, 0, 0, 0, 0, 0]),
        "ms" => unit([0, 0, 1, 0, 0, 0, 0, 0], 1e-3, 0.0),
        "min" => unit([0, 0, 1, 0, 0, 0, 0, 0], 60.0, 0.0),
        "h" => unit([0, 0, 1, 0, 0, 0, 0, 0], 3600.0, 0.0),
        "A" => si([0, 0, 0, 1, 0, 0, 0, 0]),
        "K" => si([0, 0, 0, 0, 1, 0, 0, 0]),
        "degC" => unit([0, 0, 0, 0, 1, 0, 0, 0], 1.0, 273.15),
        "rad" => si([0, 0, 0, 0, 0, 0, 0, 1]),
        "deg" => unit([0, 0, 0, 0, 0, 0, 0, 1], pi / 180.0, 0.0),
        "m2" | "m^2" => si([0, 2, 0, 0, 0, 0, 0, 0]),
        "m3" | "m^3" => si([0, 3, 0, 0, 0, 0, 0, 0]),
        "m/s" => si([0, 1, -1, 0, 0, 0, 0, 0]),
        "km/h" => unit([0, 1, -1, 0, 0, 0, 0, 0], 1.0 / 3.6, 0.0),
        "m/s2" | "m/s^2" => si([0, 1, -2, 0, 0, 0, 0, 0]),
        "rad/s" => si([0, 0, -1, 0, 0, 0, 0, 1]),
        "deg/s" => unit([0, 0, -1, 0, 0, 0, 0, 1], pi / 180.0, 0.0),
        "rpm" | "rev/min" | "1/min" => unit([0, 0, -1, 0, 0, 0, 0, 1], pi / 30.0, 0.0),
        "rad/s2" | "rad/s^2" => si([0, 0, -2, 0, 0, 0, 0, 1]),
        "Hz" | "1/s" => si([0, 0, -1, 0, 0, 0, 0, 0]),
        "N" | "kg.m/s2" => si([1, 1, -2, 0, 0, 0, 0, 0]),
        "kN" => unit([1, 1, -2, 0, 0, 0, 0, 0], 1e3, 0.0),
        "N.m" | "Nm" | "N*m" | "J" | "W.s" => si([1, 2, -2, 0, 0, 0, 0, 0]),
        "W" | "J/s" | "N.m/s" => si([1, 2, -3, 0, 0, 0, 0, 0]),
        "kW" => unit([1, 2, -3, 0, 0, 0, 0, 0], 1e3, 0.0),
        "Pa" | "N/m2" | "N/m^2" => si([1, -1, -2, 0, 0, 0, 0, 0]),
        "kPa" => unit([1, -1, -2, 0, 0, 0, 0, 0], 1e3, 0.0),
        "MPa" => unit([1, -1, -2, 0, 0, 0, 0, 0], 1e6, 0.0),
        "GPa" => unit([1, -1, -2, 0, 0, 0, 0, 0], 1e9, 0.0),
        "bar" => unit([1, -1, -2, 0, 0, 0, 0, 0], 1e5, 0.0),
        "N/m" => si([1, 0, -2, 0, 0, 0, 0, 0]),
        "N.s/m" => si([1, 0, -1, 0, 0, 0, 0, 0]),
        "kg.m2" | "kg.m^2" => si([1, 2, 0, 0, 0, 0, 0, 0]),
        "kg/m3" | "kg/m^3" => si([1, -3, 0, 0, 0, 0, 0, 0]),
        "V" => si([1, 2, -3, -1, 0, 0, 0, 0]),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_dimension_is_converted_and_another_refused() {
        let unit = Unit::named;
        let Relation::Convert(map) = relate(Some(&unit("km/h")), Some(&unit("m/s"))) else { panic!() };
        assert!((map.apply(36.0) - 10.0).abs() < 1e-14);
        let Relation::Convert(map) = relate(Some(&unit("K")), Some(&unit("degC"))) else { panic!() };
        assert!((map.apply(300.0) - 26.85).abs() < 1e-12);
        assert_eq!(relate(Some(&unit("N.m")), Some(&unit("J"))), Relation::Same);
        assert_eq!(relate(Some(&unit("N")), Some(&unit("m"))), Relation::Different);
        assert_eq!(relate(Some(&unit("rad/s")), Some(&unit("1/s"))), Relation::Different);
        assert_eq!(relate(Some(&unit("foo")), Some(&unit("bar2"))), Relation::Unknown);
        assert_eq!(relate(None, Some(&unit("m"))), Relation::Same);
        assert_eq!(unit("Pa").to_string(), "Pa (kg.m-1.s-2)");
    }

    #[test]
    fn maps_chain_in_order() {
        let map = Linear { factor: 2.0, offset: 1.0 }.then(Linear { factor: 3.0, offset: -1.0 });
        assert_eq!(map.apply(5.0), 32.0);
    }
}
