//! Virtual soil tests on a specification: the numbers an engineer knows, with plots.
//!
//! `cargo run --release -p fmu-terrain --example soil -- [SPECIFICATION.json] [--out DIR] [--threads N] [--seed S]`; without a
//! file, the default soil. `cargo xtask soil` is the same. Writes `soil.json` and one SVG for each test into DIR (default
//! `out/soil`).

use fmu_terrain::config::Terrain;
use fmu_terrain::soil::{Report, Soil, measure};
use serde_json::json;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

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
    let profile = [("slope".to_string(), r.repose.profile.clone())];
    plot(&out.join("repose.svg"), "Angle of repose", ["x [m]", "height [m]"], &profile)?;
    let curves: Vec<_> = s.tests.iter().map(|t| (format!("{:.1} kPa", t.normal / 1e3), t.curve.clone())).collect();
    plot(&out.join("shear.svg"), "Direct shear", ["displacement [m]", "shear stress [Pa]"], &curves)?;
    let mut curves: Vec<_> = p.tests.iter().map(|t| (format!("b {:.0} mm", t.width * 1e3), t.curve.clone())).collect();
    for t in &p.tests {
        let fit = t.curve.iter().map(|c| [c[0], (p.k_c / t.width + p.k_phi) * c[0].powf(p.n)]).collect();
        curves.push((format!("fit, b {:.0} mm", t.width * 1e3), fit));
    }
    plot(&out.join("plates.svg"), "Plate sinkage", ["sinkage [m]", "pressure [Pa]"], &curves)?;
    println!("written to {}", out.display());
    Ok(())
}

/// Lines over common axes from zero.
fn plot(
    path: &Path,
    title: &str,
    [x, y]: [&str; 2],
    curves: &[(String, Vec<[f64; 2]>)],
) -> Result<(), Box<dyn std::error::Error>> {
    const COLOURS: [&str; 4] = ["#1f6feb", "#d29922", "#2da44e", "#cf222e"];
    let all = || curves.iter().flat_map(|(_, c)| c);
    let most = [0, 1].map(|k| all().map(|p| p[k]).fold(1e-12, f64::max));
    let at = |p: &[f64; 2]| (70.0 + 480.0 * p[0] / most[0], 330.0 - 280.0 * p[1].max(0.0) / most[1]);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 600 390\" font-family=\"sans-serif\" font-size=\"13\">\n\
         <rect width=\"600\" height=\"390\" fill=\"white\"/><text x=\"300\" y=\"24\" text-anchor=\"middle\" font-size=\"16\">{title}</text>\n\
         <path d=\"M70 50V330H550\" fill=\"none\" stroke=\"#57606a\"/>\n\
         <text x=\"310\" y=\"375\" text-anchor=\"middle\">{x}</text>\
         <text transform=\"translate(16 190) rotate(-90)\" text-anchor=\"middle\">{y}</text>\n"
    );
    for k in 0..=4 {
        let part = f64::from(k) / 4.0;
        let (px, py) = at(&[part * most[0], part * most[1]]);
        writeln!(
            svg,
            "<text x=\"{px:.0}\" y=\"348\" text-anchor=\"middle\">{:.3}</text><text x=\"64\" y=\"{:.0}\" \
             text-anchor=\"end\">{:.3e}</text><path d=\"M70 {py:.0}H550\" stroke=\"#d0d7de\"/>",
            part * most[0],
            py + 4.0,
            part * most[1]
        )?;
    }
    for (k, (name, curve)) in curves.iter().enumerate() {
        let line: Vec<String> = curve.iter().map(at).map(|(x, y)| format!("{x:.1},{y:.1}")).collect();
        let colour = COLOURS[k % COLOURS.len()];
        let dash = if name.starts_with("fit") { " stroke-dasharray=\"5 4\"" } else { "" };
        writeln!(
            svg,
            "<polyline points=\"{}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"2\"{dash}/>",
            line.join(" ")
        )?;
        writeln!(svg, "<text x=\"84\" y=\"{}\" fill=\"{colour}\">{name}</text>", 64 + 17 * k)?;
    }
    svg.push_str("</svg>\n");
    std::fs::write(path, svg).map_err(|e| format!("{}: cannot be written: {e}", path.display()))?;
    Ok(())
}
