//! Virtual soil tests on a specification: the numbers an engineer knows, with plots.
//!
//! `cargo run --release -p fmu-terrain --example soil -- [SPECIFICATION.json] [--out DIR] [--threads N] [--seed S]`; without a
//! file, the default soil. `cargo xtask soil` is the same. Writes `soil.json` and one SVG for each test into DIR (default
//! `out/soil`).

use fmu_terrain::config::Terrain;
use fmu_terrain::soil::{Report, Soil, measure};
use serde_json::json;
use std::path::{Path, PathBuf};
use terramech_results::report::{Axis, Plot, Style};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let (mut file, mut out, mut threads, mut seed) = (None, PathBuf::from("out/soil"), 1, None);
    let mut args = std::env::args().skip(1);
    while let Some(arg) = args.next() {
        let mut value = || args.next().ok_or(format!("{arg} needs a value"));
        match arg.as_str() {
            "--out" => out = value()?.into(),
            "--threads" => threads = value()?.parse()?,
            "--seed" => seed = Some(value()?.parse()?),
            _ => file = Some(arg),
        }
    }
    let mut spec: Terrain = match &file {
        Some(path) => {
            let text = std::fs::read_to_string(path).map_err(|e| format!("{path}: cannot be read: {e}"))?;
            terramech_fmi2::specification::parse(&text, path)?
        }
        None => Terrain::default(),
    };
    spec.check(file.as_deref().unwrap_or("the default specification"))?;
    if let Some(seed) = seed {
        spec.bed.seed = seed;
    }
    let mut last = String::new();
    let report = measure(&Soil::new(&spec), threads, &mut |phase, _| {
        if phase != last {
            eprintln!("   {phase}");
            last = phase.to_string();
        }
        true
    })?;
    write(&report, &out)?;
    Ok(())
}

fn write(r: &Report, out: &Path) -> Result<(), Box<dyn std::error::Error>> {
    std::fs::create_dir_all(out)?;
    let (s, p) = (&r.shear, &r.plates);
    println!("bulk density             {:10.1} kg/m3", r.bulk_density);
    println!("packing fraction         {:10.4}", r.packing_fraction);
    println!("angle of repose          {:10.2} deg", r.repose.angle.to_degrees());
    println!("friction angle, residual {:10.2} deg", s.friction_angle.to_degrees());
    println!("friction angle, peak     {:10.2} deg", s.peak_angle.to_degrees());
    println!("cohesion, residual       {:10.1} Pa", s.cohesion);
    for t in &s.tests {
        println!("  at {:8.0} Pa: peak {:8.0} Pa, residual {:8.0} Pa", t.normal, t.peak, t.residual);
    }
    println!("Bekker n                 {:10.3}", p.n);
    println!("Bekker k_c               {:10.3e} N/m^(n+1)", p.k_c);
    println!("Bekker k_phi             {:10.3e} N/m^(n+2)", p.k_phi);
    let value = json!({
        "bulk_density": r.bulk_density, "packing_fraction": r.packing_fraction,
        "repose": {"angle": r.repose.angle, "profile": r.repose.profile},
        "shear": {
            "friction_angle": s.friction_angle, "peak_angle": s.peak_angle, "cohesion": s.cohesion,
            "inertial_number": s.inertial_number,
            "tests": s.tests.iter().map(|t| json!({
                "normal": t.normal, "peak": t.peak, "residual": t.residual, "curve": t.curve
            })).collect::<Vec<_>>(),
        },
        "plates": {
            "n": p.n, "k_c": p.k_c, "k_phi": p.k_phi,
            "tests": p.tests.iter().map(|t| json!({"width": t.width, "curve": t.curve})).collect::<Vec<_>>(),
        },
    });
    std::fs::write(out.join("soil.json"), serde_json::to_string_pretty(&value)? + "\n")?;
    let plot = |title: &str, [x, x_unit]: [&str; 2], [y, y_unit]: [&str; 2]| {
        Plot::new(title, Axis::new(x, x_unit), Axis::new(y, y_unit))
    };
    let add = |plot: Plot, label: String, points: &[[f64; 2]], style: Style| {
        let [x, y] = [0, 1].map(|c| points.iter().map(|p| p[c]).collect::<Vec<_>>());
        plot.with(label, &x, &y, style)
    };
    let slope = plot("Angle of repose: a column whose side is taken away", ["x", "m"], ["height", "m"]);
    let slope = add(slope, format!("{:.1} deg", r.repose.angle.to_degrees()), &r.repose.profile, Style::Line);
    let mut shear = plot("Direct shear", ["displacement", "m"], ["shear stress", "Pa"]);
    for t in &s.tests {
        shear = add(shear, format!("{:.1} kPa", t.normal / 1e3), &t.curve, Style::Line);
    }
    let mut plates = plot("Plate sinkage", ["sinkage", "m"], ["pressure", "Pa"]);
    for t in &p.tests {
        let fit: Vec<[f64; 2]> = t.curve.iter().map(|c| [c[0], (p.k_c / t.width + p.k_phi) * c[0].powf(p.n)]).collect();
        let width = t.width * 1e3;
        plates = add(plates, format!("width {width:.0} mm"), &t.curve, Style::Line);
        plates = add(plates, format!("Bekker, {width:.0} mm"), &fit, Style::Dashed);
    }
    for (plot, name) in [(slope, "repose"), (shear, "shear"), (plates, "plates")] {
        let path = out.join(format!("{name}.svg"));
        std::fs::write(&path, plot.svg()).map_err(|e| format!("{}: cannot be written: {e}", path.display()))?;
    }
    println!("written to {}", out.display());
    Ok(())
}
