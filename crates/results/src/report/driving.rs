//! The section of a run with a vehicle: path, speed, driver, lateral acceleration, yaw rate, attitude, wheel loads.

use super::plot::{Axis, Plot, Style};
use super::{Item, Section};
use crate::csv::CsvTable;

/// Curves of one plot over time: title, axis label, unit, and (variable, label) of each curve.
type Curves = (&'static str, &'static str, &'static str, &'static [(&'static str, &'static str)]);

const OVER_TIME: &[Curves] = &[
    ("Speed", "forward speed", "m/s", &[("speed", "")]),
    (
        "Driver",
        "input",
        "",
        &[
            ("driver_used.steering", "steering"),
            ("driver_used.throttle", "throttle"),
            ("driver_used.braking", "braking"),
        ],
    ),
    ("Lateral acceleration", "to the left", "m/s2", &[("lateral_acceleration", "")]),
    ("Yaw rate", "yaw rate", "rad/s", &[("yaw_rate", "")]),
    ("Attitude", "angle", "rad", &[("roll", "roll"), ("pitch", "pitch")]),
    ("Height", "height of the chassis", "m", &[("chassis.position.z", "")]),
];

/// The section, for every component that records its chassis's path. Curves that were not recorded are left out.
pub fn driving(csv: &CsvTable) -> Vec<Section> {
    let vehicles = csv.columns.iter().filter_map(|c| c.name.strip_suffix(".chassis.position.x"));
    vehicles
        .map(|vehicle| {
            let numbers = |name: &str| csv.numbers(&format!("{vehicle}.{name}"));
            let mut plots = Vec::new();
            if let (Some(x), Some(y)) = (numbers("chassis.position.x"), numbers("chassis.position.y")) {
                let plot =
                    Plot::new("Path", Axis::new("x", "m"), Axis::new("y", "m")).with("chassis", x, y, Style::Line);
                plots.push(plot);
            }
            for (title, label, unit, curves) in OVER_TIME {
                let mut plot = Plot::new(*title, Axis::new("time", "s"), Axis::new(*label, *unit));
                for (name, label) in *curves {
                    if let Some(values) = numbers(name) {
                        plot = plot.with(*label, &csv.time, values, Style::Line);
                    }
                }
                plots.push(plot);
            }
            plots.push(per_wheel(csv, "Wheel loads", "force up", "N", |i| {
                [
                    format!("tire{i}.load"),
                    format!("{vehicle}.wheel[{i}].force.z"),
                    format!("{vehicle}.tire[{i}].normal_force"),
                ]
            }));
            plots.push(per_wheel(csv, "Wheel speeds", "angular speed", "rad/s", |i| {
                [format!("{vehicle}.wheel[{i}].spin"), String::new(), String::new()]
            }));
            plots.retain(|p| !p.series.is_empty());
            Section::new(format!("Driving: {vehicle}"), plots.into_iter().map(Item::Plot).collect())
        })
        .collect()
}

/// A curve for each wheel that has one of the columns, the first found.
fn per_wheel(csv: &CsvTable, title: &str, label: &str, unit: &str, names: impl Fn(usize) -> [String; 3]) -> Plot {
    let mut plot = Plot::new(title, Axis::new("time", "s"), Axis::new(label, unit));
    for i in 1..=16 {
        if let Some(values) = names(i).iter().find_map(|n| csv.numbers(n)) {
            plot = plot.with(format!("wheel {i}"), &csv.time, values, Style::Line);
        }
    }
    plot
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    #[test]
    fn a_vehicle_s_run_shows_what_an_engineer_looks_at_first() {
        let text = "time [s],car.chassis.position.x [m],car.chassis.position.y [m],car.speed [m/s],tire1.load [N],tire2.load [N]\n\
                    0,0,0,5,6000,6100\n1,5,0.1,5,6200,5900\n";
        let csv = CsvTable::parse(text, Path::new("results.csv")).unwrap();
        let sections = driving(&csv);
        assert_eq!(sections.len(), 1);
        let titles: Vec<&str> = sections[0]
            .items
            .iter()
            .filter_map(|i| if let Item::Plot(p) = i { Some(p.title.as_str()) } else { None })
            .collect();
        assert_eq!(titles, ["Path", "Speed", "Wheel loads"]);
        let none = CsvTable::parse("time [s],rig.slip [1]\n0,0\n", Path::new("results.csv")).unwrap();
        assert!(driving(&none).is_empty());
    }
}
