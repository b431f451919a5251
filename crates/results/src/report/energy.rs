//! Where the engine's work goes: stored and dissipated in the vehicle, in the tires, given to the ground; what is left is the coupling's residual.
//!
//! ```text
//! engine = (kinetic + potential + dissipated) of the vehicle + (strain + dissipated - work of the pressure) of the tires + ground + residual
//! ```
//!
//! All are changes since the first row. Mass and weight of the tires are carried by the hubs, so that the vehicle's kinetic and potential
//! energy hold theirs, too; what the treads move besides is part of the residual.

use super::plot::{Axis, Plot, Style};
use super::{Item, Section, Table};
use crate::csv::CsvTable;

/// Shares of the engine's work over time (J), at the rows where all of them are new.
#[derive(Clone, Debug, Default, PartialEq)]
struct Balance {
    time: Vec<f64>,
    engine: Vec<f64>,
    /// Name and curve of each share.
    shares: Vec<(&'static str, Vec<f64>)>,
}

/// Columns to be added up with their signs.
type Signed<'a> = Vec<(&'a [f64], f64)>;

/// A share: its name, and the columns it is the sum of, with their signs.
type Share = (&'static str, Vec<(String, f64)>);

/// The section, where a vehicle's, tires' and ground's energies were recorded.
pub fn energy(csv: &CsvTable) -> Option<Section> {
    let balance = balance(csv)?;
    let mut plot = Plot::new("Where the engine's work goes", Axis::new("time", "s"), Axis::new("energy", "J"));
    plot = plot.with("engine work", &balance.time, &balance.engine, Style::Line);
    for (name, values) in &balance.shares {
        plot = plot.with(*name, &balance.time, values, Style::Line);
    }
    let whole = *balance.engine.last()?;
    let mut rows = vec![vec!["engine work".into(), format!("{whole:.0} J"), String::new()]];
    for (name, values) in &balance.shares {
        let last = *values.last()?;
        rows.push(vec![(*name).into(), format!("{last:.0} J"), format!("{:.1} %", 100.0 * last / whole)]);
    }
    let head = ["at the end", "energy", "of the engine's work"].map(String::from).to_vec();
    let caption = "Counted from the first row".into();
    Some(Section::new("Energy", vec![Item::Plot(plot), Item::Table(Table { caption, head, rows })]))
}

fn balance(csv: &CsvTable) -> Option<Balance> {
    let vehicle = csv.columns.iter().find_map(|c| c.name.strip_suffix(".engine_work"))?;
    let names = |suffix: &str| -> Vec<String> {
        csv.columns.iter().filter_map(|c| c.name.strip_suffix(suffix)).map(str::to_owned).collect()
    };
    let (tires, grounds) = (names(".strain_energy"), names(".body_work"));
    let of = |owner: &str, parts: &[(&str, f64)]| -> Vec<(String, f64)> {
        parts.iter().map(|(name, sign)| (format!("{owner}.{name}"), *sign)).collect()
    };
    let tire = [("strain_energy", 1.0), ("dissipated_energy", 1.0), ("pressure_work", -1.0)];
    let shares: Vec<Share> = vec![
        ("stored in the vehicle", of(vehicle, &[("kinetic_energy", 1.0), ("potential_energy", 1.0)])),
        ("dissipated in the vehicle", of(vehicle, &[("dissipated_energy", 1.0)])),
        ("stored and dissipated in the tires", tires.iter().flat_map(|t| of(t, &tire)).collect()),
        ("given to the ground", grounds.iter().flat_map(|g| of(g, &[("body_work", 1.0)])).collect()),
    ];
    let engine = csv.numbers(&format!("{vehicle}.engine_work"))?;
    let mut columns: Vec<(&'static str, Signed)> = Vec::new();
    for (name, parts) in shares.iter().filter(|(_, parts)| !parts.is_empty()) {
        let values: Option<Signed> = parts.iter().map(|(n, sign)| Some((csv.numbers(n)?, *sign))).collect();
        columns.push((name, values?));
    }
    // Without the ground the balance has no end.
    if grounds.is_empty() {
        return None;
    }
    let sum = |parts: &[(&[f64], f64)], row: usize| parts.iter().map(|(v, sign)| sign * v[row]).sum::<f64>();
    // What is recorded seldom keeps its value in the rows between: only rows in which it is new count.
    let given = grounds.iter().filter_map(|g| csv.numbers(&format!("{g}.body_work"))).collect::<Vec<_>>();
    let is_new = |row: usize| row == 0 || given.iter().any(|v| v[row] != v[row - 1]);
    let rows: Vec<usize> = (0..csv.time.len()).filter(|&row| is_new(row)).collect();
    let (&first, _) = rows.split_first().filter(|(_, rest)| !rest.is_empty())?;
    let curve =
        |parts: &[(&[f64], f64)]| -> Vec<f64> { rows.iter().map(|&row| sum(parts, row) - sum(parts, first)).collect() };
    let engine = curve(&[(engine, 1.0)]);
    let mut shares: Vec<(&'static str, Vec<f64>)> = columns.iter().map(|(name, parts)| (*name, curve(parts))).collect();
    let residual = (0..rows.len()).map(|k| engine[k] - shares.iter().map(|(_, v)| v[k]).sum::<f64>()).collect();
    shares.push(("residual of the coupling", residual));
    Some(Balance { time: rows.iter().map(|&row| csv.time[row]).collect(), engine, shares })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    #[test]
    fn the_shares_add_up_to_the_engine_s_work_where_all_are_new() {
        let text = "time [s],car.engine_work [J],car.kinetic_energy [J],car.potential_energy [J],car.dissipated_energy [J],\
                    t1.strain_energy [J],t1.dissipated_energy [J],t1.pressure_work [J],soil.body_work [J]\n\
                    0,5,10,0,1,2,3,1,7\n0.5,50,20,2,5,2,3,1,7\n1,105,50,5,11,4,6,1,32\n";
        let csv = CsvTable::parse(text, Path::new("results.csv")).unwrap();
        let b = balance(&csv).unwrap();
        assert_eq!((b.time, b.engine), (vec![0.0, 1.0], vec![0.0, 100.0]));
        let last: Vec<f64> = b.shares.iter().map(|(_, v)| v[1]).collect();
        assert_eq!(last, [45.0, 10.0, 5.0, 25.0, 15.0]);
        let section = energy(&csv).unwrap();
        assert!(matches!(&section.items[1], Item::Table(t) if t.rows[5][2] == "15.0 %"));
        let without = CsvTable::parse("time [s],car.engine_work [J]\n0,1\n1,2\n", Path::new("results.csv")).unwrap();
        assert!(energy(&without).is_none());
    }
}
