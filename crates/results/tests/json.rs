//! Manifest, summary and log: what they hold and that they read back.

use terramech_results::{
    ExitState, Headline, Input, Level, LogEntry, LogWriter, Manifest, RunFolder, Timings, UnitFacts, UnitTiming,
    read_summary, sha256, write_summary,
};

#[test]
fn sha256_is_the_standards() {
    // FIPS 180-4 example "abc", and the empty message.
    assert_eq!(sha256(b"abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
    assert_eq!(sha256(b""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("input.json");
    std::fs::write(&path, vec![b'x'; 200_000]).unwrap();
    let input = Input::of(&path).unwrap();
    assert_eq!((input.bytes, input.sha256), (200_000, sha256(&vec![b'x'; 200_000])));
    assert!(Input::of(dir.path().join("none")).unwrap_err().to_string().contains("none"));
}

#[test]
fn the_manifest_reads_back() {
    let dir = tempfile::tempdir().unwrap();
    let folder = RunFolder::create(dir.path()).unwrap();
    let mut manifest = Manifest::start("0.1.0", vec!["terramech".into(), "run".into(), "a b.ssd".into()]);
    manifest.write(&folder).unwrap();
    assert_eq!(Manifest::read(folder.file("manifest.json")).unwrap().state, ExitState::Running);
    manifest.state = ExitState::Failed { code: 2, message: "tire: \"bead\" slipped".into() };
    manifest.wall_seconds = 4.0;
    manifest.simulated_seconds = 1.0;
    let (name, model, guid) = ("tire".into(), "tire-rigid".into(), "{0}".into());
    manifest.units.push(UnitFacts { name, model, guid, version: "0.1.0".into(), threads: 2, rank: 0 });
    let unit = UnitTiming { name: "tire".into(), calls: 100, seconds: 1.5, share: 0.0 };
    manifest.timings =
        Timings { run_seconds: 3.0, coupling_seconds: 0.03, io_seconds: 0.06, units: vec![unit], ..Timings::default() }
            .with_shares();
    manifest.write(&folder).unwrap();
    assert_eq!(Manifest::read(folder.file("manifest.json")).unwrap(), manifest);
    assert_eq!(manifest.real_time_factor(), 0.25);
    assert_eq!((manifest.timings.units[0].share, manifest.timings.io_share), (0.5, 0.02));
    assert!(manifest.machine.cores > 0);
    std::fs::write(dir.path().join("broken.json"), "{").unwrap();
    assert!(Manifest::read(dir.path().join("broken.json")).unwrap_err().to_string().contains("broken.json"));
}

#[test]
fn headlines_average_over_their_window_and_read_back() {
    let dir = tempfile::tempdir().unwrap();
    let folder = RunFolder::create(dir.path()).unwrap();
    let time: Vec<f64> = (0..=100).map(|i| i as f64 / 100.0).collect();
    // A straight line: its mean over a window is its value in the middle, whatever the rows.
    let line: Vec<f64> = time.iter().map(|t| 3.0 * t).collect();
    let pull = Headline::mean("rig.drawbar_pull", "N", &time, &line, [0.5, 1.0]).label("Drawbar pull");
    assert!((pull.value - 2.25).abs() < 1e-12);
    let none = Headline::mean("rig.slip", "", &time, &line, [5.0, 6.0]);
    assert!(none.value.is_nan());
    let list = [pull.measured(0.97, "a bench"), none];
    write_summary(&folder, &list).unwrap();
    let back = read_summary(folder.file("summary.json")).unwrap();
    assert_eq!(back[0], list[0]);
    assert!(back[1].value.is_nan() && back[1].window == Some([5.0, 6.0]));
    let text = std::fs::read_to_string(folder.file("summary.json")).unwrap();
    assert!(text.starts_with('[') && text.contains("\"value\": null"), "{text}");
}

#[test]
fn the_log_is_one_object_a_line() {
    let dir = tempfile::tempdir().unwrap();
    let folder = RunFolder::create(dir.path()).unwrap();
    let mut log = LogWriter::create(&folder).unwrap();
    log.write(None, "terrain", "logEvents", Level::Info, "settled\nin two lines").unwrap();
    log.write(Some(0.5), "rig", "logStatusError", Level::Error, "100 % lost").unwrap();
    let text = std::fs::read_to_string(folder.file("log.jsonl")).unwrap();
    let entries: Vec<LogEntry> = text.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!(entries.len(), 2);
    assert_eq!((entries[0].time, entries[0].message.as_str()), (None, "settled\nin two lines"));
    assert_eq!((entries[1].time, entries[1].level), (Some(0.5), Level::Error));
    assert!(entries[1].wall.ends_with('Z'));
}
