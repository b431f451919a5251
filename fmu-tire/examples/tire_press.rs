//! Study `examples/tire-press`: the HMMWV tire pressed on a rigid plane at three pressures; load against deflection, footprint.
//!
//! `cargo run --release -p fmu-tire --example tire_press -- [layered|lumped] [divisions] [folder]` writes `load_deflection.csv`,
//! `footprint.csv`, and both as pictures (SVG).

use fmu_tire::ancf::plane::Plane;
use fmu_tire::ancf::spec::{FlexibleTire, HMMWV_LAYERED, HMMWV_LUMPED, parse};
use fmu_tire::ancf::statics::StaticOptions;
use fmu_tire::ancf::tire::Tire;
use std::fmt::Write as _;
use std::path::Path;
use terramech_mechanics::sparse::Precision;

const PRESSURES: [f64; 3] = [1e5, 1.5e5, 2e5];
const DEFLECTIONS: [f64; 6] = [0.005, 0.01, 0.015, 0.02, 0.03, 0.04];
/// Deflection of the footprint, and of the strains (about 5 kN), m.
const SHOWN: f64 = 0.03;
const STRAINED: f64 = 0.015;
/// Fitted curve of the same tire size (Project Chrono, HMMWV_FialaTire.json, BSD-3-Clause), m and N; its pressure is not given.
const FITTED: [(f64, f64); 9] = [
    (0.0, 0.0),
    (0.005, 585.0),
    (0.01, 1286.0),
    (0.015, 2352.0),
    (0.02, 3477.0),
    (0.025, 4798.0),
    (0.03, 6190.0),
    (0.035, 7540.0),
    (0.04, 9027.0),
];

/// A vertex on the ground: position along and across, side lengths of its share of the surface (m), pressure (Pa).
struct Spot {
    x: f64,
    y: f64,
    size: [f64; 2],
    pressure: f64,
}

struct Pressed {
    deflection: f64,
    force: f64,
    spots: Vec<Spot>,
    patches: Vec<Patch>,
}

/// An element: its corners, m, and its circumferential strain.
struct Patch {
    corners: [[f64; 3]; 4],
    strain: f64,
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut args = std::env::args().skip(1);
    let text = if args.next().as_deref() == Some("layered") { HMMWV_LAYERED } else { HMMWV_LUMPED };
    let mut spec = parse(text)?;
    if let Some(divisions) = args.next() {
        spec.divisions = divisions.parse()?;
    }
    let folder = args.next().unwrap_or_else(|| "out/tire-press".into());
    let folder = Path::new(&folder);
    std::fs::create_dir_all(folder)?;
    let mut curves = Vec::new();
    for pressure in PRESSURES {
        curves.push((pressure, press(&FlexibleTire { pressure, ..spec.clone() })?));
    }
    let mut csv =
        String::from("pressure [Pa],deflection [m],force [N],patch length [m],patch width [m],patch area [m2]\n");
    for (pressure, curve) in &curves {
        for p in curve {
            let (length, width, area) = patch(&p.spots);
            writeln!(csv, "{pressure},{},{},{length},{width},{area}", p.deflection, p.force)?;
            println!(
                "{:.0} kPa, {:4.1} mm: {:6.0} N, patch {:.0} x {:.0} mm, mean pressure {:.0} kPa",
                1e-3 * pressure,
                1e3 * p.deflection,
                p.force,
                1e3 * length,
                1e3 * width,
                1e-3 * p.force / area
            );
        }
    }
    std::fs::write(folder.join("load_deflection.csv"), csv)?;
    let spots = curves[2].1.iter().find(|p| p.deflection == SHOWN).map_or(&[][..], |p| &p.spots);
    let mut csv = String::from("x [m],y [m],pressure [Pa]\n");
    for s in spots {
        writeln!(csv, "{},{},{}", s.x, s.y, s.pressure)?;
    }
    std::fs::write(folder.join("footprint.csv"), csv)?;
    std::fs::write(folder.join("picture.svg"), picture(&curves, spots))?;
    if let Some(p) = curves[2].1.iter().find(|p| p.deflection == STRAINED) {
        std::fs::write(folder.join("strain.svg"), strain_picture(p))?;
    }
    println!("pictures and tables in {}", folder.display());
    Ok(())
}

/// Presses step by step; the wheel stands still, the plane comes up.
fn press(spec: &FlexibleTire) -> Result<Vec<Pressed>, Box<dyn std::error::Error>> {
    let mut tire = Tire::new(spec, Precision::Double)?;
    tire.gravity = [0.0; 3];
    let free = tire.state.shell.q.chunks(6).map(|n| -n[2]).fold(0.0, f64::max);
    tire.state.plane = Some(Plane::horizontal(-free));
    let options = StaticOptions { first: 0.5, largest: 1.0, tolerance: 1e-7, descent: 400, ..StaticOptions::default() };
    let areas = tire.mesh.surface.areas.clone();
    let around = 2.0 * std::f64::consts::PI * tire.mesh.radius / tire.mesh.around as f64;
    DEFLECTIONS
        .iter()
        .map(|&deflection| {
            tire.press(-free + deflection, &options)?;
            let q = &tire.state.shell.q;
            let spots: Vec<Spot> = tire
                .plane_forces()
                .iter()
                .map(|&(n, f)| {
                    let n = n as usize;
                    let area = areas[n];
                    Spot { x: q[6 * n], y: q[6 * n + 1], size: [around, area / around], pressure: f[2] / area }
                })
                .collect();
            let corners = |nodes: [u32; 4]| nodes.map(|n| std::array::from_fn(|k| q[6 * n as usize + k]));
            let patches = tire
                .mesh
                .mesh
                .shells()
                .iter()
                .zip(tire.strains())
                .map(|(shell, strain)| Patch { corners: corners(shell.nodes), strain: strain[0] })
                .collect();
            Ok(Pressed { deflection, force: tire.plane_forces().iter().map(|f| f.1[2]).sum(), spots, patches })
        })
        .collect()
}

/// Length and width between the outermost vertices (half a share beyond each), area; m, m, m2.
fn patch(spots: &[Spot]) -> (f64, f64, f64) {
    let extent = |f: &dyn Fn(&Spot) -> (f64, f64)| {
        let (low, high) = spots.iter().fold((f64::MAX, f64::MIN), |(l, h), s| {
            let (x, half) = f(s);
            (l.min(x - half), h.max(x + half))
        });
        (high - low).max(0.0)
    };
    (
        extent(&|s| (s.x, 0.5 * s.size[0])),
        extent(&|s| (s.y, 0.5 * s.size[1])),
        spots.iter().map(|s| s.size[0] * s.size[1]).sum(),
    )
}

/// Left: load against deflection; right: footprint.
fn picture(curves: &[(f64, Vec<Pressed>)], spots: &[Spot]) -> String {
    let mut s = String::from(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"1000\" height=\"460\" font-family=\"sans-serif\" font-size=\"13\"><rect width=\"1000\" height=\"460\" fill=\"white\"/>\n",
    );
    let most = curves.iter().flat_map(|c| &c.1).map(|p| p.force).fold(10_000.0, f64::max);
    let at = |d: f64, f: f64| (60.0 + 400.0 * d / 0.04, 410.0 - 360.0 * f / most);
    let mut line = |points: &[(f64, f64)], colour: &str, dash: &str, name: &str| {
        let path: Vec<String> = points.iter().map(|&(d, f)| at(d, f)).map(|(x, y)| format!("{x:.1},{y:.1}")).collect();
        let (x, y) = at(points[points.len() - 1].0, points[points.len() - 1].1);
        let _ = writeln!(
            s,
            "<polyline fill=\"none\" stroke=\"{colour}\" stroke-width=\"2\" stroke-dasharray=\"{dash}\" points=\"{}\"/><text x=\"{:.0}\" y=\"{:.0}\" text-anchor=\"end\" fill=\"{colour}\">{name}</text>",
            path.join(" "),
            x - 6.0,
            y - 6.0
        );
    };
    for ((pressure, curve), colour) in curves.iter().zip(["#7fb3d5", "#2e86c1", "#1b4f72"]) {
        let mut points = vec![(0.0, 0.0)];
        points.extend(curve.iter().map(|p| (p.deflection, p.force)));
        line(&points, colour, "none", &format!("{:.0} kPa", 1e-3 * pressure));
    }
    line(&FITTED, "#b03a2e", "6 4", "fitted curve");
    s += "<path d=\"M60 40V410H470\" fill=\"none\" stroke=\"black\"/>";
    for k in 0..=4 {
        let (x, _) = at(0.01 * f64::from(k), 0.0);
        let _ = write!(s, "<text x=\"{x:.0}\" y=\"428\" text-anchor=\"middle\">{}</text>", 10 * k);
        let force = f64::from(k) * 5000.0;
        if force <= most {
            let (_, y) = at(0.0, force);
            let _ = write!(s, "<text x=\"54\" y=\"{:.0}\" text-anchor=\"end\">{}</text>", y + 4.0, 5 * k);
        }
    }
    s += "<text x=\"265\" y=\"448\" text-anchor=\"middle\">deflection, mm</text><text x=\"60\" y=\"26\">load, kN</text>\n";
    // Footprint: 1,400 pixels to the metre, travel to the right.
    let highest = spots.iter().map(|s| s.pressure).fold(1.0, f64::max);
    for spot in spots {
        let (w, h) = (1400.0 * spot.size[0], 1400.0 * spot.size[1]);
        let (x, y) = (740.0 + 1400.0 * spot.x - 0.5 * w, 225.0 - 1400.0 * spot.y - 0.5 * h);
        let t = (spot.pressure / highest).sqrt();
        let colour = format!(
            "rgb({:.0},{:.0},{:.0})",
            255.0 * t.min(1.0),
            200.0 * (1.0 - (2.0 * t - 1.0).abs()),
            255.0 * (1.0 - t)
        );
        let _ = write!(
            s,
            "<rect x=\"{x:.1}\" y=\"{y:.1}\" width=\"{w:.1}\" height=\"{h:.1}\" fill=\"{colour}\" stroke=\"white\" stroke-width=\"0.5\"/>"
        );
    }
    let (length, width, _) = patch(spots);
    let _ = write!(
        s,
        "\n<text x=\"740\" y=\"26\" text-anchor=\"middle\">contact pressure at {:.0} mm and 200 kPa</text><text x=\"740\" y=\"428\" text-anchor=\"middle\">patch {:.0} x {:.0} mm; blue 0, red {:.0} kPa (colour by the root)</text><path d=\"M670 445h140\" stroke=\"black\"/><text x=\"820\" y=\"449\">100 mm</text></svg>\n",
        1e3 * SHOWN,
        1e3 * length,
        1e3 * width,
        1e-3 * highest
    );
    s
}

/// The tire from ahead and below, elements coloured by circumferential strain: blue shorter, red longer.
fn strain_picture(pressed: &Pressed) -> String {
    // Rows: to the right, up, towards the eye.
    let eye = nalgebra::Rotation3::from_euler_angles(0.0, 0.35, -0.75);
    let seen = |c: &[f64; 3]| eye * nalgebra::Vector3::new(c[0], c[1], c[2]);
    let most = pressed.patches.iter().map(|p| p.strain.abs()).fold(1e-9, f64::max);
    let mut faces: Vec<(f64, String)> = pressed
        .patches
        .iter()
        .map(|p| {
            let points = p.corners.map(|c| seen(&c));
            let depth = points.iter().map(|v| v.x).sum::<f64>();
            let path: Vec<String> =
                points.iter().map(|v| format!("{:.1},{:.1}", 300.0 + 500.0 * v.y, 290.0 - 500.0 * v.z)).collect();
            let t = p.strain / most;
            let (r, b) = (if t < 0.0 { 1.0 + t } else { 1.0 }, if t > 0.0 { 1.0 - t } else { 1.0 });
            let colour = format!("rgb({:.0},{:.0},{:.0})", 255.0 * r, 255.0 * (1.0 - t.abs()), 255.0 * b);
            (
                depth,
                format!(
                    "<polygon points=\"{}\" fill=\"{colour}\" stroke=\"#888\" stroke-width=\"0.3\"/>",
                    path.join(" ")
                ),
            )
        })
        .collect();
    faces.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut s = String::from(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"600\" height=\"580\" font-family=\"sans-serif\" font-size=\"13\"><rect width=\"600\" height=\"580\" fill=\"white\"/>\n",
    );
    for (_, face) in faces {
        s += &face;
        s.push('\n');
    }
    let _ = writeln!(
        s,
        "<text x=\"300\" y=\"22\" text-anchor=\"middle\">circumferential strain at {:.0} mm, {:.0} N, 200 kPa: blue -{:.2} %, white 0, red {:.2} %</text></svg>",
        1e3 * pressed.deflection,
        pressed.force,
        100.0 * most,
        100.0 * most
    );
    s
}
