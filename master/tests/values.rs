//! Values of every type, parameters, arrays of changing size, and what is recorded of them.

mod support;

use std::fs;

use support::{Bench, Part, part};
use terramech::run::{End, ExitCode, Stop};
use testunits::arrays::published;

const ALL: &str = "<tm:Recording><tm:Scalars element=\"*\" connector=\"*\"/></tm:Recording>";

#[test]
fn every_type_passes_through_two_units() {
    let set =
        [("real.in", "2.5"), ("integer.in", "-7"), ("boolean.in", "false"), ("string.in", "a \"quoted\", 100 % text")];
    let parts = [part("a", "feedthrough", &set), part("b", "feedthrough", &[])];
    let wires = ["real", "integer", "boolean", "string"].map(|t| (format!("a.{t}.out"), format!("b.{t}.in")));
    let wires: Vec<(&str, &str)> = wires.iter().map(|(a, b)| (a.as_str(), b.as_str())).collect();
    let bench = Bench::new("0.1", "0.3", &parts, &wires, ALL);
    let outcome = bench.run(1);
    assert!(matches!(outcome.end, End::Done), "{:?}", outcome.end);
    let csv = bench.csv();
    assert_eq!(csv.numbers("b.real.out").unwrap(), [2.5; 4]);
    assert_eq!(csv.numbers("b.integer.out").unwrap(), [-7.0; 4]);
    assert_eq!(csv.numbers("b.boolean.out").unwrap(), [0.0; 4]);
    assert_eq!(csv.numbers("b.string.length").unwrap(), [22.0; 4]);
}

#[test]
fn parameters_from_the_command_line_win_and_paths_count_from_the_description() {
    let parts = [
        part("a", "feedthrough", &[("specification", "bed.json"), ("real.in", "1")]),
        Part { name: "b", model: "feedthrough", set: &[("specification", "{\"a\": 1}")], extras: "threads=\"3\"" },
    ];
    let bench = Bench::new("0.1", "0.1", &parts, &[("a.real.out", "b.real.in")], ALL);
    let file = bench.folder.path().join("bed.json");
    fs::write(&file, "{}").unwrap();
    let outcome = bench.run_with(2, &Stop::new(), &["a.real.in=4.25"]);
    assert!(matches!(outcome.end, End::Done), "{:?}", outcome.end);
    let csv = bench.csv();
    assert_eq!(csv.numbers("a.real.out").unwrap()[0], 4.25);
    assert_eq!(csv.numbers("a.given.is_file").unwrap()[0], 1.0);
    assert_eq!(csv.numbers("b.given.is_file").unwrap()[0], 0.0);
    assert_eq!(csv.numbers("b.given.threads").unwrap()[0], 3.0);
    assert_eq!(csv.numbers("a.given.threads").unwrap()[0], 1.0);
    assert_eq!(outcome.manifest.units[1].threads, 3);
    assert!(outcome.manifest.inputs.iter().any(|i| i.path.ends_with("feedthrough.fmu") && i.sha256.len() == 64));
}

const ARRAYS: [(&str, &str); 2] = [("source.points.position", "echo.in.position"), ("source.points.id", "echo.in.id")];

#[test]
fn arrays_change_their_size_from_step_to_step() {
    let parts = [part("source", "array_source", &[]), part("echo", "array_echo", &[])];
    let bench = Bench::new("0.1", "1", &parts, &ARRAYS, ALL);
    let outcome = bench.run(2);
    assert!(matches!(outcome.end, End::Done), "{:?}", outcome.end);
    let csv = bench.csv();
    for n in 1..=10 {
        // The echo works on what the source had published one step before.
        let (points, ids) = published(n - 1);
        let sum: f64 = points.iter().map(|x| 2.0 * x).sum();
        assert_eq!(csv.numbers("echo.count").unwrap()[n as usize], ids.len() as f64);
        assert_eq!(csv.numbers("echo.sum").unwrap()[n as usize], sum);
    }
}

#[test]
fn arrays_are_written_as_vtk_series() {
    let extras = "<tm:Recording every=\"0.1\">\
        <tm:Dataset name=\"cloud\" element=\"source\" position=\"points.position\" every=\"0.2\"><tm:Field name=\"id\" array=\"points.id\"/></tm:Dataset>\
        <tm:Dataset name=\"echo\" element=\"echo\" position=\"out.position\" every=\"0.2\">\
        <tm:Field name=\"sparse\" element=\"source\" array=\"points.id\" index=\"points.id\"/></tm:Dataset>\
        </tm:Recording>";
    let parts = [part("source", "array_source", &[]), part("echo", "array_echo", &[])];
    let bench = Bench::new("0.1", "1", &parts, &ARRAYS, extras);
    let outcome = bench.run(1);
    assert!(matches!(outcome.end, End::Done), "{:?}", outcome.end);
    let vtk = bench.out().join("vtk");
    let pvd = fs::read_to_string(vtk.join("cloud.pvd")).unwrap();
    assert_eq!(pvd.matches("<DataSet").count(), 6, "{pvd}");
    assert!(pvd.contains("timestep=\"0.2\"") && pvd.contains("timestep=\"1\""), "{pvd}");
    for (frame, n) in [0, 2, 4, 6, 8, 10].into_iter().enumerate() {
        let bytes = fs::read(vtk.join(format!("cloud_{frame:06}.vtp"))).unwrap();
        let head = String::from_utf8_lossy(&bytes[..700.min(bytes.len())]).into_owned();
        assert!(head.contains(&format!("NumberOfPoints=\"{}\"", n % 5)), "{head}");
    }
    // Ids go up to 2 (n - 1): no point of the echo has such a number once there are two. That stops this series alone.
    assert!(
        outcome.remarks.iter().any(|r| r.contains("vtk/echo.pvd") && r.contains("sparse")),
        "{:?}",
        outcome.remarks
    );
    assert_eq!(outcome.exit_code(), ExitCode::Done);
}
