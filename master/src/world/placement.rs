//! Which unit runs on which ranks.
//!
//! The description may say it (`rank="1"`, `ranks="2..5"` of `tm:Component`), the command line over it (`--place`), and what nobody says is chosen: the heaviest unit first, each on
//! the rank that has least to do so far. A unit's weight is the one its FMU declares, or the wall time that it took in an earlier run.

use serde::Serialize;

use crate::fault::{FaultKind, Faults, Place as Written};
use crate::suggest;

/// A rank.
pub type Rank = u32;

/// One rank, or several in a row: `3`, `2..5` (from 2 to 5, both included).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Ranks {
    /// The first.
    pub first: Rank,
    /// The last; not below the first.
    pub last: Rank,
}

impl Ranks {
    /// What may be written, in words.
    pub const ALLOWED: &'static str = "a rank from 0, such as 3, or ranks from the lowest to the highest, such as 2..5";

    /// One rank.
    pub fn one(rank: Rank) -> Self {
        Self { first: rank, last: rank }
    }

    /// From text; `None`: see [`Ranks::ALLOWED`].
    pub fn parse(text: &str) -> Option<Self> {
        let number = |text: &str| text.trim().parse::<Rank>().ok().filter(|r| *r < 1_000_000);
        let ranks = match text.split_once("..") {
            None => Self::one(number(text)?),
            Some((first, last)) => Self { first: number(first)?, last: number(last)? },
        };
        (ranks.first <= ranks.last).then_some(ranks)
    }

    /// All of them.
    pub fn all(self) -> impl Iterator<Item = usize> {
        self.first as usize..=self.last as usize
    }

    /// How many; at least one.
    pub fn count(self) -> usize {
        (self.last - self.first) as usize + 1
    }
}

impl std::fmt::Display for Ranks {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if self.first == self.last { write!(f, "{}", self.first) } else { write!(f, "{}..{}", self.first, self.last) }
    }
}

/// An order of the command line: `NAME=RANKS` or `NAME=auto`, where `*` in the name stands for any text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    /// As typed.
    text: String,
    name: String,
    /// `None`: to be chosen.
    ranks: Option<Ranks>,
}

impl Place {
    /// From text.
    ///
    /// # Errors
    /// What is wrong and what is allowed.
    pub fn parse(text: &str) -> Result<Self, String> {
        let wrong = || format!("--place {text}: allowed: NAME=RANKS or NAME=auto, with RANKS {}", Ranks::ALLOWED);
        let (name, ranks) = text.split_once('=').filter(|(name, _)| !name.is_empty()).ok_or_else(wrong)?;
        let ranks = match ranks.trim() {
            "auto" => None,
            ranks => Some(Ranks::parse(ranks).ok_or_else(wrong)?),
        };
        Ok(Self { text: text.into(), name: name.trim().into(), ranks })
    }
}

/// A unit that wants a place.
#[derive(Clone, Debug)]
pub struct Placer<'u> {
    /// Its name.
    pub name: &'u str,
    /// What the description says.
    pub ranks: Option<Ranks>,
    /// Where it says so.
    pub written: &'u Written,
    /// How much it has to do, in any unit that is the same for all.
    pub weight: f64,
    /// Whether it can be spread over several ranks.
    pub spreads: bool,
}

/// Places units on a world of `size` ranks.
///
/// # Errors
/// All orders that cannot be followed.
pub fn place(units: &[Placer<'_>], orders: &[Place], size: usize) -> Result<Vec<Ranks>, Faults> {
    let mut faults = Faults::new();
    let mut ranks: Vec<Option<Ranks>> = units.iter().map(|u| u.ranks).collect();
    let mut by: Vec<Option<&Place>> = vec![None; units.len()];
    for order in orders {
        let written = Written::file("--place");
        let fits = |u: &Placer<'_>| suggest::matches(&order.name, u.name);
        if !units.iter().any(fits) {
            let close = suggest::close(&order.name, units.iter().map(|u| u.name));
            faults.add(&written, &order.text, FaultKind::UnknownComponent { given: order.name.clone(), close });
        }
        for (i, unit) in units.iter().enumerate().filter(|(_, u)| fits(u)) {
            if let Some(first) = by[i] {
                let what = format!("place of unit {} (by {} before)", unit.name, first.text);
                let allowed = "one --place for each unit".to_owned();
                faults.add(&written, "", FaultKind::BadValue { what, given: order.text.clone(), allowed });
            }
            by[i] = Some(order);
            ranks[i] = order.ranks;
        }
    }
    for ((unit, ranks), by) in units.iter().zip(&ranks).zip(&by) {
        let Some(ranks) = ranks else { continue };
        let by_line = Written::file("--place");
        let written = if by.is_some() { &by_line } else { unit.written };
        let mut wrong = |allowed: String| {
            let what = if ranks.count() == 1 { "rank" } else { "ranks" }.to_owned();
            let given = ranks.to_string();
            faults.add(written, format!("unit {}", unit.name), FaultKind::BadValue { what, given, allowed });
        };
        if ranks.last as usize >= size {
            wrong(format!("0 to {}: the run was started on {size} ranks", size.saturating_sub(1)));
        }
        if ranks.count() > 1 && !unit.spreads {
            wrong("one rank: this unit cannot be spread over several (its model announces no Team)".into());
        }
    }
    // A rank that serves the lead of a unit that is spread does nothing else.
    let serves = |rank: usize| {
        let spread = ranks.iter().zip(units).filter_map(|(r, u)| Some((r.filter(|r| r.count() > 1)?, u)));
        spread.into_iter().find(|(r, _)| r.first < rank as Rank && rank as Rank <= r.last).map(|(_, u)| u.name)
    };
    for (unit, ranks) in units.iter().zip(&ranks) {
        let Some(ranks) = ranks else { continue };
        let clash = (ranks.first..=ranks.last).find_map(|r| serves(r as usize).filter(|name| *name != unit.name));
        if let Some(name) = clash {
            let what = format!("{} of unit {}", if ranks.count() == 1 { "rank" } else { "ranks" }, unit.name);
            let allowed = format!("ranks that unit {name} is not spread over, its first one aside");
            faults.add(unit.written, "", FaultKind::BadValue { what, given: ranks.to_string(), allowed });
        }
    }
    let free_ranks: Vec<usize> = (0..size).filter(|r| serves(*r).is_none()).collect();
    let mut load = vec![0.0; size];
    let sane = |weight: f64| if weight.is_finite() && weight > 0.0 { weight } else { 0.0 };
    for (unit, ranks) in units.iter().zip(&ranks) {
        let Some(ranks) = ranks else { continue };
        for rank in ranks.first..=ranks.last {
            if let Some(load) = load.get_mut(rank as usize) {
                *load += sane(unit.weight) / ranks.count() as f64;
            }
        }
    }
    let mut free: Vec<usize> = (0..units.len()).filter(|&i| ranks[i].is_none()).collect();
    free.sort_by(|&a, &b| sane(units[b].weight).total_cmp(&sane(units[a].weight)).then(a.cmp(&b)));
    for i in free {
        let least =
            free_ranks.iter().copied().min_by(|&a, &b| load[a].total_cmp(&load[b]).then(a.cmp(&b))).unwrap_or(0);
        load[least] += sane(units[i].weight);
        ranks[i] = Some(Ranks::one(least as Rank));
    }
    faults.check(ranks.into_iter().flatten().collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    const UNITS: [(&str, f64); 4] = [("vehicle", 1.0), ("tire[1]", 20.0), ("tire[2]", 20.0), ("terrain", 100.0)];

    fn placed(written: [Option<Ranks>; 4], orders: &[&str], size: usize) -> Result<Vec<String>, String> {
        let here = Written::file("system.ssd");
        let units: Vec<Placer<'_>> = UNITS
            .iter()
            .zip(written)
            .map(|(&(name, weight), ranks)| Placer { name, ranks, written: &here, weight, spreads: name == "terrain" })
            .collect();
        let orders: Vec<Place> = orders.iter().map(|o| Place::parse(o).unwrap()).collect();
        match place(&units, &orders, size) {
            Ok(ranks) => Ok(ranks.iter().map(ToString::to_string).collect()),
            Err(faults) => Err(faults.to_string()),
        }
    }

    #[test]
    fn the_heaviest_unit_is_placed_first() {
        assert_eq!(placed([None; 4], &[], 1).unwrap(), ["0", "0", "0", "0"]);
        assert_eq!(placed([None; 4], &[], 2).unwrap(), ["1", "1", "1", "0"]);
        assert_eq!(placed([None; 4], &[], 3).unwrap(), ["1", "1", "2", "0"]);
        assert_eq!(placed([None; 4], &[], 9).unwrap(), ["3", "1", "2", "0"]);
    }

    #[test]
    fn what_is_said_counts_and_the_command_line_most() {
        let written = [Some(Ranks::one(1)), None, None, Ranks::parse("0..1")];
        assert!(placed(written, &[], 3).unwrap_err().contains("not spread over"));
        assert_eq!(placed(written, &["vehicle=auto"], 3).unwrap(), ["2", "2", "2", "0..1"]);
        assert_eq!(placed(written, &["tire*=0", "terrain=2"], 3).unwrap(), ["1", "0", "0", "2"]);
        assert_eq!(placed(written, &["*=auto"], 2).unwrap(), ["1", "1", "1", "0"]);
    }

    #[test]
    fn all_orders_that_cannot_be_followed_are_told() {
        let told =
            placed([Some(Ranks::one(4)), None, None, None], &["tire[1]=0..1", "wheel=0", "tire*=1"], 3).unwrap_err();
        for part in ["rank=\"4\"", "0 to 2", "no component \"wheel\"", "one --place for each unit"] {
            assert!(told.contains(part), "{part} in {told}");
        }
        let told = placed([None; 4], &["tire[1]=0..1"], 3).unwrap_err();
        assert!(told.contains("announces no Team"), "{told}");
        for bad in ["vehicle", "=3", "vehicle=-1", "vehicle=5..2", "vehicle=1,2", "vehicle="] {
            assert!(Place::parse(bad).unwrap_err().contains("allowed"), "{bad}");
        }
    }
}
