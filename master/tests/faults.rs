//! What happens when a unit fails, ends the run, or the user stops it: message, exit code, readable results.

mod support;

use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use support::{Bench, part};
use terramech::run::{End, ExitCode, Outcome, Stop, tell};
use terramech_results::{ExitState, Manifest};

fn trouble(mode: &str, at: &str) -> Bench {
    // A healthy neighbour, whose results must survive.
    let set = [("mode", mode), ("at", at)];
    let parts = [part("good", "mass_first", &[("x0", "1")]), part("bad", "trouble", &set)];
    let extras = "<tm:Recording><tm:Scalars element=\"*\" connector=\"*\"/></tm:Recording>";
    Bench::new("0.125", "1", &parts, &[], extras)
}

/// Rows that were recorded before the fault, of a run that is told as failed everywhere.
fn failed(bench: &Bench, outcome: &Outcome, code: ExitCode, words: &[&str]) -> usize {
    assert_eq!(outcome.exit_code(), code, "{:?}", outcome.end);
    let message = tell(&outcome.end);
    for word in words {
        assert!(message.contains(word), "{word:?} is not in: {message}");
    }
    let manifest = Manifest::read(bench.out().join("manifest.json")).unwrap();
    match manifest.state {
        ExitState::Failed { code: told, message: text } => {
            assert_eq!(told, code as i32);
            assert_eq!(text, message);
        }
        other => panic!("{other:?}"),
    }
    assert!(bench.out().join("report.html").is_file());
    let csv = bench.csv();
    assert_eq!(csv.numbers("good.position").unwrap()[0], 1.0);
    csv.time.len()
}

#[test]
fn a_unit_that_refuses_its_input_ends_the_run_with_its_own_words() {
    let bench = trouble("input", "0.5");
    let outcome = bench.run(2);
    let words = ["unit bad", "t = 0.5 s", "fmi2DoStep", "fmi2Error", "the input makes no sense"];
    assert_eq!(failed(&bench, &outcome, ExitCode::Unit, &words), 5);
    assert_eq!(outcome.manifest.simulated_seconds, 0.5);
    assert!(bench.log().contains("\"unit\":\"bad\"") && bench.log().contains("makes no sense"));
}

#[test]
fn a_numerical_failure_is_told_apart() {
    let bench = trouble("numerical", "0.5");
    assert_eq!(failed(&bench, &bench.run(1), ExitCode::Numerical, &["bad", "no convergence after 50"]), 5);
}

#[test]
fn a_value_that_is_not_finite_is_named() {
    let bench = trouble("nan", "0.5");
    // The step from 0.5 s gives it; it is read at 0.625 s.
    let words = ["t = 0.625 s", "fmi2GetReal", "'value'", "NaN"];
    assert_eq!(failed(&bench, &bench.run(1), ExitCode::Numerical, &words), 5);
}

#[test]
fn a_panic_in_a_unit_is_a_failure_of_that_unit() {
    let bench = trouble("panic", "0.25");
    let words = ["unit bad", "t = 0.25 s", "panicked", "the spring broke at 100 %"];
    assert_eq!(failed(&bench, &bench.run(2), ExitCode::Unit, &words), 3);
}

#[test]
fn a_discarded_step_tells_how_far_it_came() {
    let bench = trouble("stuck", "0.5");
    let words = ["fmi2Discard", "stuck", "up to t = 0.5 s"];
    assert_eq!(failed(&bench, &bench.run(1), ExitCode::Unit, &words), 5);
}

#[test]
fn a_step_that_a_unit_breaks_off_is_gone_on_with_from_there() {
    // 0.125 s in parts of 0.06, 0.06, 0.005; in quarters; in ever smaller parts of what is left.
    for (mode, returns) in [("event", 16), ("fussy", 16), ("discard", 0)] {
        let bench = trouble(mode, "0");
        let outcome = bench.run(1);
        assert_eq!(outcome.exit_code(), ExitCode::Done, "{mode}: {:?}", outcome.end);
        let csv = bench.csv();
        let value = csv.numbers("bad.value").unwrap();
        assert_eq!(csv.time.len(), 9);
        for (time, value) in csv.time.iter().zip(value).skip(1) {
            assert!((time - value).abs() < 1e-9, "{mode}: {value} at {time}");
        }
        if returns > 0 {
            assert_eq!(bench.log().matches("step discarded").count(), returns, "{mode}");
        }
    }
}

#[test]
fn a_unit_with_steps_of_one_length_is_not_gone_on_with() {
    let bench = trouble("event", "0.5");
    bench.change_model("trouble", |xml| {
        xml.replace(
            "canHandleVariableCommunicationStepSize=\"true\"",
            "canHandleVariableCommunicationStepSize=\"false\"",
        )
    });
    let words = ["fmi2Discard", "an event", "up to t = 0.56 s", "canHandleVariableCommunicationStepSize"];
    assert_eq!(failed(&bench, &bench.run(1), ExitCode::Unit, &words), 5);
}

#[test]
fn input_that_a_unit_refuses_late_in_initialisation_is_still_wrong_input() {
    let outcome = trouble("late", "0").run(1);
    assert_eq!(outcome.exit_code(), ExitCode::Input);
    let message = tell(&outcome.end);
    assert!(message.starts_with("unit bad: 'mode' is \"late\"; allowed"), "{message}");
    assert!(!message.contains("fmi2"), "{message}");
}

#[test]
fn a_disk_that_a_unit_cannot_write_is_the_machines_fault() {
    let outcome = trouble("disk", "0").run(1);
    assert_eq!(outcome.exit_code(), ExitCode::Environment);
    assert!(tell(&outcome.end).contains("bed.bin: cannot be written"));
}

#[test]
fn a_run_that_does_not_start_leaves_an_earlier_one_as_it_was() {
    let bench = trouble("", "0");
    assert_eq!(bench.run(1).exit_code(), ExitCode::Done);
    let names = ["manifest.json", "results.csv", "summary.json", "report.html", "log.jsonl"];
    let read = || names.map(|n| std::fs::read(bench.out().join(n)).unwrap());
    let before = read();
    for mode in ["bad.mode=early", "bad.mode=late", "bad.mode=disk"] {
        let outcome = bench.run_with(1, &Stop::new(), &[mode]);
        assert!(!outcome.recorded && outcome.exit_code() != ExitCode::Done);
        assert!(read() == before, "{mode}");
    }
    // A folder that was not there before is not there after.
    let fresh = trouble("late", "0");
    fresh.run(1);
    assert!(!fresh.out().exists());
}

#[test]
fn a_unit_may_end_the_run() {
    let bench = trouble("end", "0.5");
    let outcome = bench.run(2);
    assert_eq!(outcome.exit_code(), ExitCode::Done);
    assert!(matches!(&outcome.end, End::EndedBy { unit, time } if unit == "bad" && *time == 0.5), "{:?}", outcome.end);
    assert!(tell(&outcome.end).contains("bad ended the run by itself at t = 0.5 s"));
    assert_eq!(bench.csv().time.len(), 5);
}

#[test]
fn warnings_go_to_the_log_with_unit_and_time() {
    let bench = trouble("talk", "0.5");
    assert_eq!(bench.run(1).exit_code(), ExitCode::Done);
    let log = bench.log();
    let line = log.lines().find(|l| l.contains("100 % of the bed")).unwrap();
    assert!(line.contains("\"time\":0.5") && line.contains("\"unit\":\"bad\"") && line.contains("warning"), "{line}");
}

#[test]
fn a_request_to_stop_ends_the_run_after_the_step() {
    let bench = trouble("slow", "0");
    let stop = Stop::new();
    let outcome = std::thread::scope(|s| {
        s.spawn(|| {
            std::thread::sleep(Duration::from_millis(60));
            stop.ask();
        });
        bench.run_with(2, &stop, &["bad.mode=slow"])
    });
    assert_eq!(outcome.exit_code(), ExitCode::Stopped);
    let rows = bench.csv().time.len();
    assert!((1..9).contains(&rows), "{rows}");
    assert!(matches!(Manifest::read(bench.out().join("manifest.json")).unwrap().state, ExitState::Stopped { .. }));
}

#[test]
fn a_request_to_stop_reaches_a_unit_that_settles() {
    let bench = trouble("settle", "0");
    let stop = Stop::new();
    stop.ask();
    let outcome = bench.run_with(1, &stop, &[]);
    assert!(matches!(outcome.end, End::Stopped { time: None, .. }), "{:?}", outcome.end);
    assert_eq!(outcome.exit_code(), ExitCode::Stopped);
}

fn terramech(arguments: &[&str], bench: &Bench) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_terramech"));
    command.args(arguments).current_dir(bench.folder.path()).stdin(Stdio::null());
    command
}

#[test]
fn the_command_tells_faults_on_stderr_and_by_its_exit_code() {
    let bench = trouble("panic", "0.25");
    let out = terramech(&["run", "system.ssd", "--out", "r", "--threads", "1"], &bench).output().unwrap();
    let error = String::from_utf8(out.stderr).unwrap();
    assert_eq!(out.status.code(), Some(2), "{error}");
    assert!(error.contains("the spring broke at 100 %") && error.contains("t = 0.25 s"), "{error}");

    let out = terramech(&["run", "system.ssd", "--out", "r", "--set", "bad.mode=", "--stop-time", "0.5"], &bench)
        .output()
        .unwrap();
    let text = String::from_utf8(out.stdout).unwrap();
    assert_eq!(out.status.code(), Some(0), "{}", String::from_utf8_lossy(&out.stderr));
    assert!(text.contains("4 steps") && text.contains("coupling") && text.contains("results in r"), "{text}");

    let out = terramech(&["check", "system.ssd", "--set", "bad.mod=x"], &bench).output().unwrap();
    assert_eq!(out.status.code(), Some(1));
    assert!(String::from_utf8(out.stderr).unwrap().contains("did you mean \"mode\""));
    let out = terramech(&["check", "system.ssd"], &bench).output().unwrap();
    assert_eq!(out.status.code(), Some(0));
    let out = terramech(&["inspect", "trouble.fmu", "--json"], &bench).output().unwrap();
    assert!(out.status.success() && String::from_utf8(out.stdout).unwrap().contains("\"value\""));
    let out = terramech(&["run", "system.ssd"], &bench).output().unwrap();
    assert_eq!(out.status.code(), Some(1));
    // A folder that holds something else is left alone.
    let out = terramech(&["run", "system.ssd", "--out", "."], &bench).output().unwrap();
    assert_eq!(out.status.code(), Some(1));
}

#[test]
fn ctrl_c_stops_the_command_cleanly() {
    let bench = trouble("settle", "0");
    let mut child = terramech(&["run", "system.ssd", "--out", "r"], &bench)
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    // The folder is made when the handler is set and before the units are.
    let begin = Instant::now();
    while !bench.folder.path().join("r/.terramech-run").exists() && begin.elapsed() < Duration::from_secs(20) {
        std::thread::sleep(Duration::from_millis(10));
    }
    Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    let status = child.wait().unwrap();
    assert_eq!(status.code(), Some(130));
    assert!(!bench.folder.path().join("r").exists(), "nothing was simulated, nothing is left");
}

/// Exit code and stderr of a command.
fn told(arguments: &[&str], bench: &Bench) -> (i32, String) {
    let out = terramech(arguments, bench).output().unwrap();
    (out.status.code().unwrap(), String::from_utf8(out.stderr).unwrap())
}

#[test]
fn check_asks_the_units_about_their_specifications() {
    let bench = trouble("early", "0");
    let (code, error) = told(&["check", "system.ssd"], &bench);
    assert!(code == 1 && error.contains("unit bad: 'mode' is \"early\""), "{code} {error}");
    assert_eq!(told(&["check", "system.ssd", "--no-units"], &bench).0, 0);
    let (code, error) = told(&["check", "system.ssd", "--set", "bad.mode="], &bench);
    assert!(code == 0 && error.is_empty(), "{code} {error}");
    let out = terramech(&["check", "trouble.fmu"], &bench).output().unwrap();
    assert_eq!(String::from_utf8(out.stdout).unwrap(), "trouble.fmu: model trouble: no fault\n");
    let (code, error) = told(&["run", "trouble.fmu", "--out", "r"], &bench);
    assert!(code == 1 && error.contains("this is an FMU, no system description"), "{code} {error}");
}

#[test]
fn a_library_that_is_cut_is_told_before_it_is_loaded() {
    let bench = trouble("", "0");
    let size = support::library_size();
    for part in [20, 3000, size / 2, size - 100] {
        support::pack_part(&bench.folder.path().join("trouble.fmu"), "trouble", ..part);
        for command in [&["check", "system.ssd"][..], &["run", "system.ssd", "--out", "r"], &["check", "trouble.fmu"]] {
            let (code, error) = told(command, &bench);
            assert!(
                code == 1 && error.contains("trouble.fmu") && error.contains("linux64/trouble.so"),
                "{code} {error}"
            );
            assert!(error.contains("bytes"), "{error}");
        }
        let (_, error) = told(&["check", "system.ssd"], &bench);
        assert!(error.contains("Component \"bad\" (system.ssd:"), "{error}");
    }
}

#[test]
fn a_panic_is_told_once_with_its_place() {
    let bench = trouble("panic", "0.25");
    let (code, error) = told(&["run", "system.ssd", "--out", "r", "--quiet"], &bench);
    assert_eq!((code, error.matches("the spring broke").count()), (2, 1), "{error}");
    assert!(error.contains("trouble.rs:") && !error.contains("RUST_BACKTRACE"), "{error}");
}

#[test]
fn a_value_set_twice_or_against_a_connection_is_refused() {
    let parts = [part("a", "relay", &[]), part("b", "relay", &[])];
    let bench = Bench::new("0.1", "0.2", &parts, &[("a.out[1]", "b.in[1]")], "");
    let (code, error) = told(&["check", "system.ssd", "--set", "b.in[1]=3"], &bench);
    assert!(code == 1 && error.contains("\"b.in[1]\" is fed by the connection from \"a.out[1]\""), "{error}");
    let (code, error) = told(&["check", "system.ssd", "--set", "a.gain=3", "--set", "a.gain=4"], &bench);
    assert!(code == 1 && error.contains("\"a.gain\" is set twice: to \"3\" and to \"4\""), "{error}");
    let (code, error) = told(&["check", "system.ssd", "--stop-time", "0"], &bench);
    assert!(code == 1 && error.contains("--stop-time") && !error.contains("DefaultExperiment"), "{error}");
}

#[test]
fn a_unit_that_never_returns_is_named_and_the_run_given_up() {
    let bench = trouble("hang", "0.5");
    let (code, error) = told(&["run", "system.ssd", "--out", "r", "--call-limit", "0.5", "--quiet"], &bench);
    assert_eq!(code, 2, "{error}");
    for words in ["unit bad", "t = 0.5 s", "fmi2DoStep has not returned"] {
        assert!(error.contains(words) || log(&bench).contains(words), "{words}: {error}");
    }
    // Rows are written at the latest half a second after the one before.
    let manifest = Manifest::read(bench.folder.path().join("r/manifest.json")).unwrap();
    assert!(matches!(manifest.state, ExitState::Failed { code: 2, .. }), "{:?}", manifest.state);
    terramech_results::CsvTable::read(bench.folder.path().join("r/results.csv")).unwrap();
}

fn log(bench: &Bench) -> String {
    std::fs::read_to_string(bench.folder.path().join("r/log.jsonl")).unwrap_or_default()
}
