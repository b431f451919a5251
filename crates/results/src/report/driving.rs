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
            if let (Some(x), Some(v)) = (numbers("chassis.position.x"), numbers("speed")) {
                let axes = (Axis::new("x of the chassis", "m"), Axis::new("forward speed", "m/s"));
                plots.push(Plot::new("Speed against position", axes.0, axes.1).with("", x, v, Style::Line));
            }
            plots.push(per_wheel(csv, "Wheel loads", "force up", "N", |i| {
                [
                    format!("tire{i}.load"),
                    format!("{vehicle}.wheel[{i}].force.z"),
                    format!("{vehicle}.tire[{i}].normal_force"),
                ]
            }));
            plots.push(per_wheel(csv, "Longitudinal forces on the wheels", "force along x", "N", |i| {
                [format!("{vehicle}.wheel[{i}].force.x"), String::new(), String::new()]
            }));
            plots.extend(resistance(csv, vehicle));
            plots.push(per_wheel(csv, "Wheel speeds", "angular speed", "rad/s", |i| {
                [format!("{vehicle}.wheel[{i}].spin"), String::new(), String::new()]
            }));
            plots.retain(|p| !p.series.is_empty());
            Section::new(format!("Driving: {vehicle}"), plots.into_iter().map(Item::Plot).collect())
        })
        .collect()
}

/// Terrain resistance and net force, sums over the wheels of each axle. What drives a wheel is its axle torque over the height of its centre above the
/// ground at the start; the force of the ground along x is what is left of it (net force), the difference what the ground took (terrain resistance).
fn resistance(csv: &CsvTable, vehicle: &str) -> Option<Plot> {
    // The ground's height is the one output of that name, whatever its component is called.
    let mut heights = csv.columns.iter().filter(|c| c.name.split_once('.').is_some_and(|(_, n)| n == "height"));
    let ground = csv.numbers(&heights.next()?.name)?.first().copied()?;
    let axes = (Axis::new("time", "s"), Axis::new("force", "N"));
    let mut plot = Plot::new("Terrain resistance and net force by axle", axes.0, axes.1);
    for axle in 0.. {
        let (mut net, mut lost) = (vec![0.0; csv.time.len()], vec![0.0; csv.time.len()]);
        for i in [2 * axle + 1, 2 * axle + 2] {
            let wheel = |name: &str| csv.numbers(&format!("{vehicle}.wheel[{i}].{name}"));
            let (Some(force), Some(torque), Some(z)) = (wheel("force.x"), wheel("axle_torque"), wheel("position.z"))
            else {
                return (axle > 0).then_some(plot);
            };
            let arm = z.first().map(|z| z - ground).filter(|arm| *arm > 0.0)?;
            for (k, (f, m)) in force.iter().zip(torque).enumerate() {
                net[k] += f;
                lost[k] += m / arm - f;
            }
        }
        plot = plot.with(format!("net, axle {}", axle + 1), &csv.time, &net, Style::Line);
        plot = plot.with(format!("resistance, axle {}", axle + 1), &csv.time, &lost, Style::Line);
    }
    None
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
        assert_eq!(titles, ["Path", "Speed", "Speed against position", "Wheel loads"]);
        // 300 N m on wheels 0.5 m above the ground, of which 200 N of 600 N are lost.
        let text = "time [s],soil.height [m],car.chassis.position.x [m],car.wheel[1].force.x [N],car.wheel[1].axle_torque [N.m],\
                    car.wheel[1].position.z [m],car.wheel[2].force.x [N],car.wheel[2].axle_torque [N.m],car.wheel[2].position.z [m]\n\
                    0,0.1,0,400,300,0.6,400,300,0.6\n";
        let plot = resistance(&CsvTable::parse(text, Path::new("results.csv")).unwrap(), "car").unwrap();
        let curves: Vec<(&str, f64)> = plot.series.iter().map(|s| (s.label.as_str(), s.y[0])).collect();
        assert_eq!(curves, [("net, axle 1", 800.0), ("resistance, axle 1", 400.0)]);
        assert!(resistance(&csv, "car").is_none(), "without the height of the ground there is no arm");
        let none = CsvTable::parse("time [s],rig.slip [1]\n0,0\n", Path::new("results.csv")).unwrap();
        assert!(driving(&none).is_empty());
    }
}
