//! Checkpoints: a run that is killed, stopped or cut at any moment goes on to the same bits.

mod support;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::Duration;

use support::{Bench, part};

/// A system with everything that a checkpoint has to keep, and a unit that sleeps 20 ms a step, so that there is time to kill it.
fn bench() -> Bench {
    support::of_everything(&[part("nap", "trouble", &[("mode", "slow")])], &[])
}

fn terramech(bench: &Bench, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_terramech"));
    command.args(arguments).current_dir(bench.folder.path()).stdin(Stdio::null()).stdout(Stdio::null());
    command.stderr(Stdio::piped());
    command
}

fn told(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// The undisturbed run.
fn reference(bench: &Bench) {
    let out = terramech(bench, &["run", "system.ssd", "--out", "whole", "--quiet"]).output().unwrap();
    assert!(out.status.success(), "{}", told(&out));
}

/// Every file with results is the same, byte for byte.
fn same(bench: &Bench, folder: &str) {
    let read = |run: &str, name: &str| fs::read(bench.folder.path().join(run).join(name)).unwrap();
    let mut names = vec!["results.csv".to_owned(), "summary.json".into(), "vtk/points.pvd".into()];
    let frames = fs::read_dir(bench.folder.path().join("whole/vtk")).unwrap();
    names.extend(frames.map(|e| format!("vtk/{}", e.unwrap().file_name().to_string_lossy())));
    assert!(names.len() > 15, "{names:?}");
    for name in names {
        assert!(read("whole", &name) == read(folder, &name), "{name} of {folder} differs");
    }
}

fn checkpoints(bench: &Bench, folder: &str) -> Vec<PathBuf> {
    let list = fs::read_dir(bench.folder.path().join(folder).join("checkpoint")).into_iter().flatten();
    let mut files: Vec<PathBuf> =
        list.map(|e| e.unwrap().path()).filter(|p| p.extension().is_some_and(|e| e == "tmc")).collect();
    files.sort();
    files
}

/// Starts a run with checkpoints and kills it when it has written this many.
fn killed(bench: &Bench, folder: &str, count: usize, more: Duration) {
    let arguments =
        ["run", "system.ssd", "--out", folder, "--checkpoint-every", "0.03", "--keep-checkpoints", "3", "--quiet"];
    let mut child = terramech(bench, &arguments).spawn().unwrap();
    for _ in 0..2000 {
        if checkpoints(bench, folder).len() >= count {
            break;
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    std::thread::sleep(more);
    child.kill().unwrap();
    child.wait().unwrap();
}

#[test]
fn a_run_killed_at_any_moment_is_resumed_to_the_same_bits() {
    let bench = bench();
    reference(&bench);
    // Moments that fall anywhere in a step, in writing a row or a checkpoint.
    for (k, more) in [3, 17, 32, 46].into_iter().enumerate() {
        let folder = format!("killed{k}");
        killed(&bench, &folder, 1 + k % 3, Duration::from_millis(more));
        // Killed again while it goes on.
        let mut child = terramech(&bench, &["run", "--resume", &folder, "--quiet"]).spawn().unwrap();
        std::thread::sleep(Duration::from_millis(10 * more));
        child.kill().unwrap();
        child.wait().unwrap();
        let out = terramech(&bench, &["run", "--resume", &folder, "--quiet"]).output().unwrap();
        assert!(out.status.success() && told(&out).contains("resuming at t = 0."), "{}", told(&out));
        same(&bench, &folder);
    }
}

#[test]
fn ctrl_c_writes_a_checkpoint_and_tells_how_to_go_on() {
    let bench = bench();
    reference(&bench);
    let child = terramech(&bench, &["run", "system.ssd", "--out", "r", "--quiet"]).spawn().unwrap();
    let csv = bench.folder.path().join("r/results.csv");
    while !csv.exists() {
        std::thread::sleep(Duration::from_millis(5));
    }
    std::thread::sleep(Duration::from_millis(150));
    Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    let out = child.wait_with_output().unwrap();
    assert!(out.status.code() == Some(130) && told(&out).contains("--resume"), "{}", told(&out));
    assert_eq!(checkpoints(&bench, "r").len(), 1);
    let out = terramech(&bench, &["run", "--resume", "r", "--quiet"]).output().unwrap();
    assert!(out.status.success(), "{}", told(&out));
    same(&bench, "r");
}

#[test]
fn a_damaged_checkpoint_gives_way_to_the_one_before() {
    let bench = bench();
    reference(&bench);
    let cut = |path: &Path| {
        let bytes = fs::read(path).unwrap();
        fs::write(path, &bytes[..bytes.len() / 2]).unwrap();
    };
    let flip = |path: &Path| {
        let mut bytes = fs::read(path).unwrap();
        let at = bytes.len() / 3;
        bytes[at] ^= 4;
        fs::write(path, bytes).unwrap();
    };
    for (folder, harm) in [("cut", &cut as &dyn Fn(&Path)), ("flipped", &flip)] {
        killed(&bench, folder, 3, Duration::ZERO);
        let files = checkpoints(&bench, folder);
        harm(files.last().unwrap());
        let out = terramech(&bench, &["run", "--resume", folder, "--quiet"]).output().unwrap();
        let message = told(&out);
        assert!(out.status.success() && message.contains("the checkpoint before it is used"), "{message}");
        assert!(message.contains(&*files.last().unwrap().file_name().unwrap().to_string_lossy()), "{message}");
        same(&bench, folder);
    }
}

#[test]
fn a_full_disk_ends_the_run_and_leaves_the_last_checkpoint() {
    let bench = bench();
    reference(&bench);
    // A limit on the size of files, set while the run goes, stands for the full disk.
    let script = "trap '' XFSZ; exec \"$0\" run system.ssd --out r --quiet --checkpoint-every 0.03";
    let child = Command::new("sh")
        .args(["-c", script, env!("CARGO_BIN_EXE_terramech")])
        .current_dir(bench.folder.path())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    while checkpoints(&bench, "r").is_empty() {
        std::thread::sleep(Duration::from_millis(5));
    }
    let limited = Command::new("prlimit").args(["--fsize=100", "--pid", &child.id().to_string()]).status();
    let out = child.wait_with_output().unwrap();
    if !limited.is_ok_and(|s| s.success()) {
        eprintln!("skipped: this machine has no prlimit");
        return;
    }
    assert!(out.status.code() == Some(4) && told(&out).contains("cannot write"), "{:?} {}", out.status, told(&out));
    let out = terramech(&bench, &["run", "--resume", "r", "--quiet"]).output().unwrap();
    assert!(out.status.success(), "{}", told(&out));
    same(&bench, "r");
}

#[test]
fn what_cannot_be_resumed_is_told() {
    let bench = bench();
    let fails = |arguments: &[&str], words: &str| {
        let out = terramech(&bench, arguments).output().unwrap();
        assert!(out.status.code() == Some(1) && told(&out).contains(words), "{:?} {}", out.status, told(&out));
    };
    fails(&["run", "--resume", "nowhere"], "nothing to resume");
    fails(&["run", "system.ssd", "--out", "r", "--checkpoint-every", "0.015"], "nearest are 0.01 and 0.02 s");
    killed(&bench, "r", 1, Duration::ZERO);
    let text = fs::read_to_string(&bench.file).unwrap();
    fs::write(&bench.file, text.replace("\"15000\"", "\"15001\"")).unwrap();
    fails(&["run", "--resume", "r"], "system.ssd is not what it was");
    // An earlier run's files stay as they are.
    assert!(!checkpoints(&bench, "r").is_empty());
}

#[test]
fn a_resumed_run_may_go_further_than_it_was_meant_to() {
    let bench = bench();
    reference(&bench);
    let run = |arguments: &[&str]| {
        let out = terramech(&bench, arguments).output().unwrap();
        assert!(out.status.success(), "{}", told(&out));
    };
    run(&["run", "system.ssd", "--out", "r", "--quiet", "--checkpoint-every", "0.12", "--stop-time", "0.3"]);
    run(&["run", "--resume", "r", "--quiet", "--stop-time", "0.6"]);
    let read = |run: &str| fs::read(bench.folder.path().join(run).join("results.csv")).unwrap();
    assert!(read("whole") == read("r"));
}

#[test]
fn a_step_that_varies_is_resumed_to_the_same_bits() {
    let first = [("m", "40"), ("k", "150000"), ("d", "0"), ("x0", "0.01")];
    let second = [("m", "400"), ("k", "0"), ("d", "0"), ("cc", "15000"), ("dc", "1000")];
    let parts = [part("first", "mass_first", &first), part("second", "mass_second", &second)];
    let extras = "<tm:Algorithm scheme=\"ecco\" tolerance=\"0.02\" longest=\"0.01\"/>\
        <tm:PowerBond name=\"spring\"><tm:Pair effortElement=\"second\" effortConnector=\"force\" flowElement=\"first\" \
        flowConnector=\"velocity\"/></tm:PowerBond>";
    let wires = [
        ("second.force", "first.force"),
        ("first.position", "second.other.position"),
        ("first.velocity", "second.other.velocity"),
    ];
    let bench = Bench::new("0.0001", "0.6", &parts, &wires, extras);
    reference(&bench);
    let run = |arguments: &[&str]| {
        let out = terramech(&bench, arguments).output().unwrap();
        assert!(out.status.success(), "{}", told(&out));
    };
    run(&["run", "system.ssd", "--out", "r", "--quiet", "--checkpoint-every", "0.12", "--stop-time", "0.3"]);
    run(&["run", "--resume", "r", "--quiet", "--stop-time", "0.6"]);
    let read = |run: &str| fs::read_to_string(bench.folder.path().join(run).join("results.csv")).unwrap();
    let whole = read("whole");
    let rows = whole.lines().count();
    assert!((60..3000).contains(&rows), "{rows}");
    assert!(whole == read("r"));
}
