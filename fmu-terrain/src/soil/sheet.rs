//! The data sheet of a soil: `soil.json`, a plot of each test, `report.html`, and a table for people.

use super::{Report, Soil, measure};
use crate::config::Terrain;
use crate::dem::settle::Progress;
use crate::error::unit_error;
use serde_json::json;
use std::path::Path;
use terramech_fmi2::UnitError;
use terramech_results::RunFolder;
use terramech_results::report::{Axis, Item, Plot, Report as Page, Section, Style, Table};

/// Measures the soil of a specification and writes the sheet into a folder, new, empty or of an earlier sheet; gives the table.
///
/// # Errors
/// What [`measure`] meets; a folder that holds something else, files that cannot be written.
pub fn sheet(
    spec: &Terrain,
    origin: &str,
    threads: usize,
    folder: &Path,
    progress: Progress,
) -> Result<String, UnitError> {
    let fault = |e: terramech_results::Error| UnitError::environment(e.to_string());
    // Before minutes of work.
    let folder = RunFolder::open(folder).map_err(fault)?;
    let report = measure(&Soil::new(spec), threads, progress).map_err(|e| unit_error(e, false))?;
    folder.begin().map_err(fault)?;
    folder.write_json("soil.json", &numbers(&report)).map_err(fault)?;
    let plots = plots(&report);
    for (name, plot) in &plots {
        folder.write(&format!("{name}.svg"), plot.svg().as_bytes()).map_err(fault)?;
    }
    let rows = rows(&report);
    let mut items: Vec<Item> = vec![Item::Table(Table {
        head: ["", "value", "unit"].map(String::from).to_vec(),
        rows: rows.iter().map(|row| row.to_vec()).collect(),
        ..Table::default()
    })];
    items.extend(plots.into_iter().map(|(_, plot)| Item::Plot(plot)));
    let page = Page {
        title: "Virtual soil tests".into(),
        subtitle: format!("{origin}, bed of seed {}: samples a few tens of grains wide", spec.bed.seed),
        sections: vec![Section::new("Measured", items)],
        ..Page::default()
    };
    page.write(&folder).map_err(fault)?;
    Ok(rows.iter().map(|[name, value, unit]| format!("{name:42} {value:>10} {unit}\n")).collect())
}

/// Name, value, unit.
type Row = [String; 3];

fn rows(r: &Report) -> Vec<Row> {
    let (s, p) = (&r.shear, &r.plates);
    let row = |name: &str, value: String, unit: &str| [name.to_owned(), value, unit.to_owned()];
    let mut rows = vec![
        row("bulk density", format!("{:.1}", r.bulk_density), "kg/m3"),
        row("packing fraction", format!("{:.4}", r.packing_fraction), "1"),
        row("angle of repose", format!("{:.2}", r.repose.angle.to_degrees()), "deg"),
        row("friction angle, residual", format!("{:.2}", s.friction_angle.to_degrees()), "deg"),
        row("friction angle, peak", format!("{:.2}", s.peak_angle.to_degrees()), "deg"),
        row("cohesion, residual", format!("{:.1}", s.cohesion), "Pa"),
    ];
    for t in &s.tests {
        let at = |what: &str| format!("shear stress at {:.0} Pa, {what}", t.normal);
        rows.push(row(&at("peak"), format!("{:.0}", t.peak), "Pa"));
        rows.push(row(&at("residual"), format!("{:.0}", t.residual), "Pa"));
    }
    rows.push(row("Bekker n", format!("{:.3}", p.n), "1"));
    rows.push(row("Bekker k_c", format!("{:.3e}", p.k_c), "N/m^(n+1)"));
    rows.push(row("Bekker k_phi", format!("{:.3e}", p.k_phi), "N/m^(n+2)"));
    rows
}

fn numbers(r: &Report) -> serde_json::Value {
    let (s, p) = (&r.shear, &r.plates);
    let sheared =
        |t: &super::Sheared| json!({"normal": t.normal, "peak": t.peak, "residual": t.residual, "curve": t.curve});
    json!({
        "bulk_density": r.bulk_density, "packing_fraction": r.packing_fraction,
        "repose": {"angle": r.repose.angle, "profile": r.repose.profile},
        "shear": {
            "friction_angle": s.friction_angle, "peak_angle": s.peak_angle, "cohesion": s.cohesion,
            "inertial_number": s.inertial_number, "tests": s.tests.iter().map(sheared).collect::<Vec<_>>(),
        },
        "plates": {
            "n": p.n, "k_c": p.k_c, "k_phi": p.k_phi,
            "tests": p.tests.iter().map(|t| json!({"width": t.width, "curve": t.curve})).collect::<Vec<_>>(),
        },
    })
}

fn plots(r: &Report) -> [(&'static str, Plot); 3] {
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
    for t in &r.shear.tests {
        shear = add(shear, format!("{:.1} kPa", t.normal / 1e3), &t.curve, Style::Line);
    }
    let p = &r.plates;
    let mut plates = plot("Plate sinkage", ["sinkage", "m"], ["pressure", "Pa"]);
    for t in &p.tests {
        let fit: Vec<[f64; 2]> = t.curve.iter().map(|c| [c[0], (p.k_c / t.width + p.k_phi) * c[0].powf(p.n)]).collect();
        let width = t.width * 1e3;
        plates = add(plates, format!("width {width:.0} mm"), &t.curve, Style::Line);
        plates = add(plates, format!("Bekker, {width:.0} mm"), &fit, Style::Dashed);
    }
    [("repose", slope), ("shear", shear), ("plates", plates)]
}
