//! Draws a report from made-up wheel data: `cargo run -p terramech-results --example report -- DIR`.
//!
//! The numbers are shaped like those of a wheel at 50 % slip; they come from no simulation.

use std::f64::consts::TAU;
use terramech_results::report::SideView;
use terramech_results::{
    Column, CsvTable, CsvWriter, ExitState, Field, Headline, Kind, Manifest, PolyData, Report, RunFolder, Timings,
    UnitFacts, UnitTiming, Value, VtkSeries, write_summary,
};

const RADIUS: f64 = 0.058;
const STOP: f64 = 6.0;

/// Uniform numbers in 0..1 from a linear congruential generator (Knuth, MMIX).
struct Dice(u64);

impl Dice {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }
}

/// Sinkage at time t (m): touchdown in the first second, then settling into the rut.
fn sinkage(t: f64) -> f64 {
    0.0215 * (1.0 - (-3.0 * t).exp()) + 0.0008 * (1.3 * t).sin()
}

fn wheel_x(t: f64) -> f64 {
    0.12 + 0.06 * (t - 1.0).max(0.0)
}

fn main() -> terramech_results::Result<()> {
    let dir = std::env::args().nth(1).unwrap_or_else(|| "target/report-example".into());
    let folder = RunFolder::create(&dir)?;
    let mut manifest = Manifest::start(env!("CARGO_PKG_VERSION"), std::env::args().collect());
    manifest.write(&folder)?;

    record(&folder)?;
    let mut figures = Vec::new();
    let mut bed = VtkSeries::new("bed");
    let mut wheel = VtkSeries::new("wheel");
    for (name, t) in [("Start of the run", 0.0), ("End of the run", STOP)] {
        let (position, velocity, radius) = grains(t);
        let (vertices, triangles) = cylinder([wheel_x(t), 0.0, RADIUS - sinkage(t)]);
        let fields = vec![Field::scalar("radius", &radius), Field::vector("velocity", &velocity)];
        bed.write(&folder, t, &PolyData::points(&position, fields))?;
        wheel.write(&folder, t, &PolyData::triangles(&vertices, &triangles, vec![]))?;
        figures.push(
            SideView::new(format!("{name}, t = {t} s"))
                .caption("Grains at the wheel's middle plane, seen from the right.")
                .grains(&position, &radius, &velocity, 0.0)?
                .mesh(&vertices, &triangles)?,
        );
    }

    let csv = CsvTable::read(folder.file("results.csv"))?;
    let mean = |name: &str, unit: &str, label: &str| {
        Headline::mean(name, unit, &csv.time, csv.numbers(name).unwrap_or_default(), [3.0, STOP]).label(label)
    };
    let summary = [
        mean("rig.drawbar_pull", "N", "Drawbar pull").measured(0.97, "made up"),
        mean("rig.wheel_torque", "N.m", "Wheel torque"),
        mean("rig.sinkage", "m", "Sinkage").measured(0.0227, "made up"),
        mean("rig.slip", "", "Slip"),
    ];
    write_summary(&folder, &summary)?;

    manifest.state = ExitState::Done;
    manifest.simulated_seconds = STOP;
    manifest.wall_seconds = 151.3;
    let unit = |name: &str, model: &str| {
        let guid = "{00000000-0000-5000-8000-000000000000}".into();
        UnitFacts { name: name.into(), model: model.into(), guid, version: "0.1.0".into(), threads: 1, rank: 0 }
    };
    manifest.units = vec![unit("rig", "rig"), unit("tire", "tire-rigid"), unit("terrain", "terrain-dem-p")];
    let spent = |name: &str, seconds| UnitTiming { name: name.into(), calls: 6000, seconds, share: 0.0 };
    manifest.timings = Timings {
        initialise_seconds: 21.9,
        run_seconds: 128.2,
        units: vec![spent("rig", 0.11), spent("tire", 0.35), spent("terrain", 126.4)],
        coupling_seconds: 0.62,
        io_seconds: 1.1,
        ..Timings::default()
    }
    .with_shares();
    manifest.write(&folder)?;

    let mut report = Report::of_run("Single wheel on granular soil", &csv, &summary, &manifest, figures);
    report.subtitle = "Smooth rigid wheel, radius 58 mm, width 50 mm, at 50 % slip. Made-up numbers.".into();
    report.write(&folder)?;
    println!("{}", folder.file("report.html").display());
    Ok(())
}

fn record(folder: &RunFolder) -> terramech_results::Result<()> {
    let mut columns: Vec<Column> = [
        ("rig.drawbar_pull", "N"),
        ("rig.drawbar_pull_filtered", "N"),
        ("rig.wheel_torque", "N.m"),
        ("rig.wheel_torque_filtered", "N.m"),
        ("rig.sinkage", "m"),
        ("rig.slip", ""),
        ("rig.carrier.position", "m"),
        ("rig.wheel[1].velocity.x", "m/s"),
        ("rig.wheel[1].velocity.y", "m/s"),
        ("rig.wheel[1].velocity.z", "m/s"),
        ("rig.wheel[1].load_mass", "kg"),
        ("terrain.kinetic_energy", "J"),
        ("terrain.height", "m"),
    ]
    .map(|(name, unit)| Column::real(name, unit))
    .to_vec();
    columns.push(Column { name: "terrain.contact_count".into(), unit: String::new(), kind: Kind::Integer });
    columns.push(Column { name: "rig.phase".into(), unit: String::new(), kind: Kind::Text });
    let mut csv = CsvWriter::create(folder, &columns)?;
    let mut dice = Dice(7);
    let (mut pull, mut torque) = (0.0, 0.0);
    for step in 0..=6000 {
        let t = f64::from(step) * STOP / 6000.0;
        let rolling = 1.0 - (-2.0 * (t - 1.0).max(0.0)).exp();
        let spike = if dice.next() > 0.998 { 25.0 * dice.next() } else { 0.0 };
        let raw_pull = rolling * (1.0 + 0.4 * (2.3 * t).sin() + 5.0 * (dice.next() - 0.5)) - spike;
        let raw_torque = rolling * (0.62 + 0.03 * (1.9 * t).cos() + 0.4 * (dice.next() - 0.5));
        // A running mean of 0.1 s, as a first-order lag.
        pull += 0.01 * (raw_pull - pull);
        torque += 0.01 * (raw_torque - torque);
        let sink = sinkage(t);
        let numbers = [
            raw_pull,
            pull,
            raw_torque,
            torque,
            sink,
            0.5 * rolling,
            wheel_x(t),
            if t > 1.0 { 0.06 } else { 0.0 },
            0.0005 * (dice.next() - 0.5),
            -0.0645 * (-3.0 * t).exp(),
            2.55,
            1e-4 * (1.0 + dice.next()) * rolling,
            0.0,
        ];
        let phase = if t < 1.0 { "lowering" } else { "rolling" };
        let count = 51_000 + (300.0 * sink / 0.02) as i32;
        let row = numbers.into_iter().map(Value::Real).chain([Value::Integer(count), Value::Text(phase)]);
        csv.row(t, row)?;
    }
    csv.flush()
}

/// A bed with a rut behind the wheel: positions, velocities, radii.
fn grains(t: f64) -> (Vec<f64>, Vec<f64>, Vec<f64>) {
    let (mut dice, r) = (Dice(3), 0.0035);
    let (x_wheel, sink) = (wheel_x(t), sinkage(t));
    let (mut position, mut velocity, mut radius) = (Vec::new(), Vec::new(), Vec::new());
    for (i, j, k) in (0..90).flat_map(|i| (-3..=3).flat_map(move |j| (0..15).map(move |k| (i, j, k)))) {
        let jitter = |d: &mut Dice| 0.35 * r * (2.0 * d.next() - 1.0);
        let x = (2.0 * f64::from(i) + f64::from(k % 2) + 1.0) * r + jitter(&mut dice);
        let y = (2.0 * f64::from(j) + f64::from(k % 2)) * r + jitter(&mut dice);
        let z = -(1.7 * f64::from(k) + 1.0) * r + jitter(&mut dice);
        let rut = if x < x_wheel && x > wheel_x(1.0) - 0.03 { sink * (1.0 + z / 0.09).max(0.0) } else { 0.0 };
        let heap = 0.4 * sink * (-((x - x_wheel - 0.05) / 0.025).powi(2)).exp() * (1.0 + z / 0.05).max(0.0);
        let (px, pz) = (x, z - rut + heap);
        if (px - x_wheel).hypot(pz - RADIUS + sink) < RADIUS + 0.8 * r {
            continue;
        }
        let near = (-((px - x_wheel).powi(2) + (pz + sink).powi(2)) / 0.03_f64.powi(2)).exp();
        let speed = if t > 1.0 { 0.11 * near * (0.6 + 0.4 * dice.next()) } else { 0.0 };
        position.extend([px, y, pz]);
        velocity.extend([-0.8 * speed, 0.0, 0.6 * speed]);
        radius.push(r * (0.86 + 0.28 * dice.next()));
    }
    (position, velocity, radius)
}

/// A closed cylinder along y.
fn cylinder([x, y, z]: [f64; 3]) -> (Vec<f64>, Vec<i32>) {
    let n = 64;
    let mut vertices = vec![x, y - 0.025, z, x, y + 0.025, z];
    for i in 0..n {
        let (s, c) = (TAU * f64::from(i) / f64::from(n)).sin_cos();
        vertices.extend([x + RADIUS * c, y - 0.025, z + RADIUS * s, x + RADIUS * c, y + 0.025, z + RADIUS * s]);
    }
    let triangles = (0..n).flat_map(|i| {
        let (a, b) = (2 + 2 * i, 2 + 2 * ((i + 1) % n));
        [0, a, b, 1, b + 1, a + 1, a, a + 1, b, b, a + 1, b + 1]
    });
    (vertices, triangles.collect())
}
