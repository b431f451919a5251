//! `bed`: the box, how it is filled, compacted and settled.

use super::{GREATEST_COUNT, Platform, Soil, Surface};
use crate::dem::Settle;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use terramech_fmi2::specification::Faults;

/// The box, and how it is filled.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Bed {
    /// Length of the box along x (m).
    pub length: f64,
    /// Width of the box along y (m).
    pub width: f64,
    /// How much soil.
    pub fill: Fill,
    /// Seed of the random placing: another one gives another bed of the same kind.
    pub seed: u64,
    /// Spacing of the grid that grains are poured from, over the largest diameter, 1 to 10 (1). Larger: more random, longer
    /// to settle.
    pub spacing: f64,
    /// How grains are placed before they fall.
    pub placing: PlacingOf,
    /// Factor on all friction (sliding, rolling, spinning) while the bed is poured, 0 to 1 (1). The smaller, the denser the bed; its grains have the
    /// specification's friction from then on. Find it by the bulk density that `terramech soil` prints.
    #[serde(skip_serializing_if = "is_one")]
    pub laying: f64,
    /// What is done to the settled bed, one after the other; it settles again after each.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub compaction: Vec<CompactionOf>,
    /// Length of tiles that the bed is laid of (m), about: one is settled in a box without ends and laid as often as the box is long.
    /// It makes large beds in minutes. Null: the bed is settled whole. Used by terrain_dem_p.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tile: Option<f64>,
    /// The box follows the bodies along +x: where one of them comes nearer to the foremost tile than this (m), soil behind is taken away and
    /// laid anew in front, a tile at a time. Needs tile; the box must be longer than the bodies, three tiles and this. Used by terrain_dem_p.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub follow: Option<f64>,
    /// Gravity x, y, z (m/s2).
    pub gravity: [f64; 3],
    /// Surface of the four side walls; null: as the soil, without adhesion.
    pub walls: Option<Surface>,
    /// Surface of the floor; null: as the soil.
    pub floor: Option<Surface>,
    /// When the bed counts as settled.
    pub settle: Settle,
    /// Time over which adhesion grows once the bed rests (s). Poured with it, grains would hang in loose clumps; the bed
    /// contracts as it grows, which the log reports.
    pub adhesion_time: f64,
    /// How adhesion comes into the bed that was settled without it.
    pub adhesion_onset: AdhesionOnset,
    /// Rigid run-up before the box, at -x.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub platform: Option<Platform>,
}

/// Whether a factor need not be written.
#[allow(clippy::trivially_copy_pass_by_ref)] // serde hands a reference.
fn is_one(x: &f64) -> bool {
    *x == 1.0
}

impl Default for Bed {
    fn default() -> Self {
        Self {
            length: 0.4,
            width: 0.15,
            fill: Fill::Depth(0.06),
            seed: 1,
            spacing: 1.05,
            placing: PlacingOf::Grid,
            laying: 1.0,
            compaction: Vec::new(),
            tile: None,
            follow: None,
            gravity: [0.0, 0.0, -9.81],
            walls: None,
            floor: None,
            settle: Settle::default(),
            adhesion_time: 0.1,
            adhesion_onset: AdhesionOnset::Growth,
            platform: None,
        }
    }
}

/// How adhesion comes into a settled bed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum AdhesionOnset {
    /// It grows over bed.adhesion_time: the bed contracts and settles again.
    #[default]
    Growth,
    /// At once, the overlap of every contact counting from an offset with which nothing moves. Used by terrain_dem_p.
    Offset,
}

/// How much soil: one of the two.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Fill {
    /// Depth of the settled bed (m): it is filled to a little more, settled and levelled off.
    Depth(f64),
    /// Number of grains.
    Count(usize),
}

/// How grains are placed before they fall.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum PlacingOf {
    /// One in each cell of a grid, at random within it.
    #[default]
    Grid,
    /// Hexagonal closest packing.
    Hcp,
    /// At random with a least distance.
    PoissonDisk,
}

/// What is done to the settled bed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum CompactionOf {
    /// The box is shaken.
    Vibrate {
        /// Amplitude (m).
        amplitude: f64,
        /// Frequency (Hz).
        frequency: f64,
        /// How long (s).
        time: f64,
        /// Along x instead of up and down.
        #[serde(default)]
        sideways: bool,
    },
    /// A plate presses on the whole surface.
    Press {
        /// Pressure (Pa).
        pressure: f64,
        /// How long (s).
        time: f64,
    },
}

impl Bed {
    pub(super) fn check(&self, f: &mut Faults, soil: &Soil) {
        let (least, greatest) = soil.range();
        for (path, x) in [("bed.length", self.length), ("bed.width", self.width)] {
            let allowed = format!("a finite number of at least two diameters, {} m", 4.0 * greatest);
            f.check(x.is_finite() && x >= 4.0 * greatest, path, x, &allowed);
        }
        match self.fill {
            Fill::Depth(d) => {
                f.positive("bed.fill.depth", d);
                // Told here: placing them would run out of memory, which ends the whole process.
                let r = 0.5 * (least + greatest);
                let grains = 0.6 * self.length * self.width * d / (4.0 / 3.0 * std::f64::consts::PI * r.powi(3));
                f.check(
                    grains <= GREATEST_COUNT as f64 || grains.is_nan(),
                    "bed.length x bed.width x bed.fill.depth",
                    format!("{} m x {} m x {d} m, about {grains:.1e} grains of radius {r} m", self.length, self.width),
                    &format!("at most {GREATEST_COUNT} grains; take a smaller box or larger soil.radius"),
                );
            }
            Fill::Count(n) => {
                f.check((1..=GREATEST_COUNT).contains(&n), "bed.fill.count", n, &format!("1 to {GREATEST_COUNT}"));
            }
        }
        f.within("bed.spacing", self.spacing, 1.0, 10.0);
        f.within("bed.laying", self.laying, 0.0, 1.0);
        for (k, what) in self.compaction.iter().enumerate() {
            let at = |name: &str| format!("bed.compaction[{k}].{name}");
            match what {
                CompactionOf::Vibrate { amplitude, frequency, time, .. } => {
                    f.positive(&at("vibrate.amplitude"), *amplitude);
                    f.positive(&at("vibrate.frequency"), *frequency);
                    f.within(&at("vibrate.time"), *time, 0.0, 60.0);
                }
                CompactionOf::Press { pressure, time } => {
                    f.positive(&at("press.pressure"), *pressure);
                    f.within(&at("press.time"), *time, 0.0, 60.0);
                }
            }
        }
        if let Some(tile) = self.tile {
            let allowed = format!("twelve greatest radii, {} m, to a third of bed.length", 12.0 * greatest);
            f.check(tile >= 12.0 * greatest && tile <= self.length / 3.0, "bed.tile", tile, &allowed);
        }
        if let Some(buffer) = self.follow {
            f.check(self.tile.is_some(), "bed.follow", buffer, "only together with bed.tile");
            f.check(
                self.platform.is_none(),
                "bed.follow",
                buffer,
                "not together with bed.platform, which stays behind",
            );
            let tile = self.tile.unwrap_or(0.0);
            let allowed =
                format!("above {} m, two greatest diameters, up to bed.length less three tiles", 4.0 * greatest);
            let inside = buffer > 4.0 * greatest && buffer <= self.length - 3.0 * tile;
            f.check(inside, "bed.follow", buffer, &allowed);
        }
        let g = self.gravity;
        f.check(g.iter().all(|x| x.is_finite()) && g[2] < 0.0, "bed.gravity", format!("{g:?}"), "finite, z below 0");
        for (path, s) in [("bed.walls", &self.walls), ("bed.floor", &self.floor)] {
            if let Some(s) = s {
                s.check(f, path);
            }
        }
        f.positive("bed.settle.energy", self.settle.energy);
        f.not_negative("bed.settle.least_time", self.settle.least_time);
        f.check(
            self.settle.most_time.is_finite() && self.settle.most_time > self.settle.least_time,
            "bed.settle.most_time",
            self.settle.most_time,
            "finite, above least_time",
        );
        f.not_negative("bed.adhesion_time", self.adhesion_time);
        if let Some(p) = &self.platform {
            p.check(f);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::Terrain;

    #[test]
    fn a_bed_beyond_memory_is_refused_with_its_count() {
        let bed = Bed { length: 1000.0, width: 1000.0, ..Bed::default() };
        let e = Terrain { bed, ..Terrain::default() }.check("bed.json").unwrap_err().to_string();
        assert!(e.contains("bed.length") && e.contains("50000000 grains"), "{e}");
    }
}
