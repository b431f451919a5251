//! Explicit pairs of materials, which replace the pair rules.

use super::dem_p::{CoefficientValues, FIRST_BODY, FLOOR, SOIL, WALLS, adhesion, coefficients};
use super::{Adhesion, BODIES};
use crate::dem::PairOverride;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::ops::Range;
use terramech_fmi2::specification::Faults;

/// Contact of two materials, where it is not what the pair rules give.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PairValues {
    /// The two materials, in any order, one of them the soil; `bodies` are all bodies.
    pub between: [MaterialName; 2],
    /// Coulomb friction (1).
    #[serde(default)]
    pub friction: Option<f64>,
    /// Coefficient of restitution, 0 to 1 (1).
    #[serde(default)]
    pub restitution: Option<f64>,
    /// Rolling friction (1).
    #[serde(default)]
    pub rolling_friction: Option<f64>,
    /// Spinning friction (1).
    #[serde(default)]
    pub spinning_friction: Option<f64>,
    /// Adhesion.
    #[serde(default)]
    pub adhesion: Option<Adhesion>,
    /// Stiffness and damping for the form coefficients.
    #[serde(default)]
    pub coefficients: Option<CoefficientValues>,
}

/// A material of the specification.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum MaterialName {
    /// The grains.
    Soil,
    /// The floor.
    Floor,
    /// The side walls.
    Walls,
    /// All bodies.
    Bodies,
}

impl MaterialName {
    fn indices(self) -> Range<usize> {
        match self {
            Self::Soil => SOIL..SOIL + 1,
            Self::Floor => FLOOR..FLOOR + 1,
            Self::Walls => WALLS..WALLS + 1,
            Self::Bodies => FIRST_BODY..FIRST_BODY + BODIES,
        }
    }
}

impl PairValues {
    pub(super) fn check(&self, f: &mut Faults, k: usize) {
        let at = |name: &str| format!("dem_p.pairs[{k}].{name}");
        let given = format!("{:?}", self.between);
        let grains = self.between.contains(&MaterialName::Soil);
        f.check(grains, &at("between"), given, "soil and one of soil, floor, walls, bodies");
        for (name, value, most) in [
            ("friction", self.friction, 100.0),
            ("restitution", self.restitution, 1.0),
            ("rolling_friction", self.rolling_friction, 100.0),
            ("spinning_friction", self.spinning_friction, 100.0),
        ] {
            if let Some(x) = value {
                f.within(&at(name), x, 0.0, most);
            }
        }
        if let Some(a) = self.adhesion {
            for (name, x) in [("pressure", a.pressure), ("constant", a.constant), ("dmt", a.dmt), ("perko", a.perko)] {
                f.not_negative(&at(&format!("adhesion.{name}")), x);
            }
        }
        if let Some(c) = self.coefficients {
            f.positive(&at("coefficients.kn"), c.kn);
            for (name, x) in [("gn", c.gn), ("kt", c.kt), ("gt", c.gt)] {
                f.not_negative(&at(&format!("coefficients.{name}")), x);
            }
        }
    }

    /// The engine's pairs: one for each body.
    pub(super) fn overrides(&self) -> impl Iterator<Item = PairOverride> + '_ {
        let [a, b] = self.between.map(MaterialName::indices);
        a.flat_map(move |i| b.clone().map(move |j| [i, j])).map(|materials| PairOverride {
            materials,
            restitution: self.restitution,
            friction: self.friction,
            rolling_friction: self.rolling_friction,
            spinning_friction: self.spinning_friction,
            adhesion: self.adhesion.map(adhesion),
            coefficients: self.coefficients.map(coefficients),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::Terrain;
    use crate::dem::material::PairTable;

    #[test]
    fn explicit_pairs_reach_the_engine_for_all_bodies() {
        let text = r#"{"dem_p": {"pairs": [{"between": ["bodies", "soil"], "friction": 0.33}]}}"#;
        let spec: Terrain = serde_json::from_str(text).unwrap();
        spec.check("test").unwrap();
        let setup = spec.setup(&[]);
        let table = PairTable::new(&setup.materials, &setup.overrides);
        assert_eq!(table.get(SOIL, FIRST_BODY + 7).friction, 0.33);
        assert_eq!(table.get(SOIL, FLOOR).friction, 0.7);
        let wrong = text.replace("soil\"]", "walls\"]").replace("0.33", "-1");
        let e = serde_json::from_str::<Terrain>(&wrong).unwrap().check("test").unwrap_err().to_string();
        assert!(e.contains("pairs[0].between") && e.contains("pairs[0].friction"), "{e}");
    }
}
