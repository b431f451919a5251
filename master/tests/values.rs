//! Values of every type, parameters, arrays of changing size, and what is recorded of them.

mod support;

use std::fs;

use support::{Bench, Part, part};
use terramech::check;
use terramech::description::Audience;
use terramech::pack::pack;
use terramech::run::{self, End, ExitCode, Stop};
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

#[test]
fn inputs_follow_a_table_over_time() {
    let parts = [part("a", "feedthrough", &[]), part("b", "feedthrough", &[])];
    let bench = Bench::new("0.1", "0.5", &parts, &[("a.real.out", "b.real.in")], ALL);
    let csv = bench.folder.path().join("drive.csv");
    fs::write(&csv, "time [s],a.real.in [mm],b.integer.in [1],b.boolean.in [1]\n0,0,1,0\n0.2,2000,1,1\n0.4,1000,9,1\n")
        .unwrap();
    let plan = |options: check::Options| check::plan(&bench.file, &options);
    let options = check::Options { inputs: Some(csv.clone()), ..Default::default() };
    let outcome = run::run(
        plan(options.clone()).unwrap(),
        &run::Options { out: bench.out(), threads: 1, ..Default::default() },
        run::Display::quiet(),
        &Stop::new(),
    )
    .unwrap();
    assert!(matches!(outcome.end, End::Done), "{:?}", outcome.end);
    let table = bench.csv();
    // The value set at a communication point is seen at the end of the step.
    let expected = [0.0, 0.0, 1.0, 2.0, 1.5, 1.0];
    let found = table.numbers("a.real.out").unwrap();
    assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12), "{found:?}");
    assert_eq!(table.numbers("b.integer.out").unwrap(), [1.0, 1.0, 1.0, 1.0, 1.0, 9.0]);
    fs::write(&csv, "time [s],b.real.in [m],a.real.out [m],c.x [1],a.real.in [kg]\n0,1,1,1,1\n").unwrap();
    let faults = plan(options).unwrap_err().to_string();
    for words in
        ["fed by the connection from \"a.real.out\"", "causality output", "no component \"c\"", "units do not match"]
    {
        assert!(faults.contains(words), "{words}: {faults}");
    }
}

#[test]
fn parameter_files_and_other_fmus_from_the_command_line() {
    let parts = [part("a", "relay", &[("gain", "3")]), part("b", "relay", &[])];
    let bench = Bench::new("0.1", "0.2", &parts, &[("a.out[1]", "b.in[1]")], ALL);
    let ssv = bench.folder.path().join("p.ssv");
    let set = |text: &str| {
        let head = "<ssv:ParameterSet xmlns:ssv=\"http://ssp-standard.org/SSP1/SystemStructureParameterValues\" version=\"1.0\" name=\"p\"><ssv:Parameters>";
        fs::write(&ssv, format!("{head}{text}</ssv:Parameters></ssv:ParameterSet>")).unwrap();
    };
    set(
        "<ssv:Parameter name=\"a.gain\"><ssv:Real value=\"7\"/></ssv:Parameter><ssv:Parameter name=\"b.gain\"><ssv:Real value=\"5\"/></ssv:Parameter>",
    );
    let options = check::Options { params: vec![ssv.clone()], set: vec!["b.gain=6".into()], ..Default::default() };
    let plan = check::plan(&bench.file, &options).unwrap();
    let value = |i: usize| plan.components[i].settings[0].value.to_string();
    assert_eq!((value(0), value(1)), ("7.0".into(), "6.0".into()));
    assert!(plan.inputs.iter().any(|i| i.path.ends_with("p.ssv")));
    set("<ssv:Parameter name=\"c.gain\"><ssv:Real value=\"7\"/></ssv:Parameter>");
    assert!(check::plan(&bench.file, &options).unwrap_err().to_string().contains("no component \"c\""));

    let other = bench.folder.path().join("other.fmu");
    fs::copy(bench.folder.path().join("relay.fmu"), &other).unwrap();
    let swap = |text: String| check::Options { swap: vec![text], ..Default::default() };
    let plan = check::plan(&bench.file, &swap(format!("b={}", other.display()))).unwrap();
    assert_eq!(plan.fmus[plan.components[1].fmu].path, other);
    let faults = check::plan(&bench.file, &swap("bb=other.fmu".into())).unwrap_err().to_string();
    assert!(faults.contains("--swap") && faults.contains("did you mean \"b\""), "{faults}");
}

#[test]
fn a_packed_system_runs_to_the_same_bits() {
    let parts =
        [part("a", "feedthrough", &[("specification", "bed.json"), ("real.in", "2.5")]), part("b", "feedthrough", &[])];
    let bench = Bench::new("0.1", "0.3", &parts, &[("a.real.out", "b.real.in")], ALL);
    fs::write(bench.folder.path().join("bed.json"), "{}").unwrap();
    bench.run(1);
    let expected = fs::read(bench.out().join("results.csv")).unwrap();
    let ssp = bench.folder.path().join("packed/system.ssp");
    fs::create_dir(ssp.parent().unwrap()).unwrap();
    let remarks = pack(&bench.file, &Default::default(), &ssp, Audience::Terramech).unwrap();
    assert!(remarks[0].contains("specifications"), "{remarks:?}");
    // It stands alone: what it was made of may go.
    fs::remove_file(bench.folder.path().join("feedthrough.fmu")).unwrap();
    fs::remove_file(bench.folder.path().join("bed.json")).unwrap();
    let plan = check::plan(&ssp, &check::Options::default()).unwrap_or_else(|f| panic!("{f}"));
    let options = run::Options { out: bench.out(), threads: 1, ..Default::default() };
    let outcome = run::run(plan, &options, run::Display::quiet(), &Stop::new()).unwrap();
    assert!(matches!(outcome.end, End::Done), "{:?}", outcome.end);
    assert!(fs::read(bench.out().join("results.csv")).unwrap() == expected);
}

#[test]
fn a_condition_of_the_user_ends_the_run() {
    let bench = Bench::new("0.125", "1", &[part("t", "trouble", &[])], &[], ALL);
    let run = |condition: &str| {
        let options = check::Options { stop_when: vec![condition.into()], ..Default::default() };
        let plan = check::plan(&bench.file, &options).map_err(|f| f.to_string())?;
        let options = run::Options { out: bench.out(), threads: 1, ..Default::default() };
        Ok::<_, String>(run::run(plan, &options, run::Display::quiet(), &Stop::new()).unwrap())
    };
    let outcome = run("t.value >= 0.5").unwrap();
    assert!(matches!(&outcome.end, End::Condition { time, .. } if *time == 0.5), "{:?}", outcome.end);
    assert_eq!((outcome.exit_code(), bench.csv().time.len()), (ExitCode::Done, 5));
    assert!(run("t.value ~ 3").unwrap_err().contains("rig.drawbar_pull < 0"));
    assert!(run("t.valu < 3").unwrap_err().contains("did you mean \"value\""));
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
