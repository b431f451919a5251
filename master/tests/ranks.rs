//! A run on several ranks, as threads of one process: the same bits as in one, for every placement; and nothing hangs whatever fails.

mod support;

use std::fs;
use std::path::Path;
use std::sync::Arc;

use support::{Bench, part};
use terramech::check;
use terramech::checkpoint::{self, How};
use terramech::run::{self, Checkpoints, Display, End, Options, Outcome, Placed, Stop};
use terramech::world::{Ranks, World, threads};

/// What differs from run to run.
#[derive(Clone, Default)]
struct Way<'w> {
    set: Vec<String>,
    stop_when: Vec<String>,
    every: Option<&'w str>,
    resume: bool,
    /// The rank that is asked to stop before it starts.
    stop: Option<usize>,
}

fn options(bench: &Bench, out: &str, way: &Way<'_>) -> (check::Options, Options) {
    let checks = check::Options { set: way.set.clone(), stop_when: way.stop_when.clone(), ..check::Options::default() };
    let how = How {
        system: bench.file.clone(),
        set: way.set.clone(),
        stop_when: way.stop_when.clone(),
        every: way.every.map(str::to_owned),
        keep: 2,
        ..How::default()
    };
    let folder = bench.folder.path().join(out);
    let from = way.resume.then(|| Arc::new(checkpoint::newest(&folder).unwrap().0));
    let options = Options {
        out: folder,
        threads: 2,
        command: vec!["test".into()],
        checkpoints: Checkpoints { how: Some(how), from },
        ..Options::default()
    };
    (checks, options)
}

fn placed(world: Box<dyn World>, owner: &[usize]) -> Placed {
    Placed { world, ranks: owner.iter().map(|r| Ranks::one(*r as u32)).collect() }
}

/// Runs on ranks: `owner` says which unit is on which.
fn on(bench: &Bench, size: usize, owner: &[usize], out: &str, way: &Way<'_>) -> Outcome {
    let ranks: Vec<_> = threads(size)
        .into_iter()
        .enumerate()
        .map(|(rank, world)| {
            let (checks, options) = options(bench, out, way);
            let plan = check::plan(&bench.file, &checks).unwrap_or_else(|faults| panic!("{faults}"));
            let (owner, stop) = (owner.to_vec(), Stop::new());
            if way.stop == Some(rank) {
                stop.ask();
            }
            std::thread::spawn(move || {
                let placed = placed(world, &owner);
                if rank == 0 {
                    return Some(run::run_on(plan, &options, Display::quiet(), &stop, Some(placed)).unwrap());
                }
                let _ = run::serve(plan, &options, &stop, placed);
                None
            })
        })
        .collect();
    // In the order of the ranks; a hang shows as a test that does not end.
    ranks.into_iter().filter_map(|r| r.join().unwrap()).next().unwrap()
}

fn alone(bench: &Bench, out: &str, way: &Way<'_>) -> Outcome {
    let (checks, options) = options(bench, out, way);
    let plan = check::plan(&bench.file, &checks).unwrap_or_else(|faults| panic!("{faults}"));
    run::run(plan, &options, Display::quiet(), &Stop::new()).unwrap()
}

/// All results of a run but what tells of times and machines.
fn results(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let mut files = Vec::new();
    for sub in ["", "vtk"] {
        for entry in fs::read_dir(folder.join(sub)).into_iter().flatten() {
            let path = entry.unwrap().path();
            let name = path.strip_prefix(folder).unwrap().display().to_string();
            let kept = |end: &str| name.ends_with(end);
            if path.is_file() && ["results.csv", "summary.json", ".pvd", ".vtp"].into_iter().any(kept) {
                files.push((name, fs::read(path).unwrap()));
            }
        }
    }
    files.sort();
    files
}

fn same(bench: &Bench, one: &str, other: &str) {
    let (one, other) = (results(&bench.folder.path().join(one)), results(&bench.folder.path().join(other)));
    let names = |files: &[(String, Vec<u8>)]| files.iter().map(|(n, _)| n.clone()).collect::<Vec<_>>();
    assert_eq!(names(&one), names(&other));
    for ((name, a), (_, b)) in one.iter().zip(&other) {
        let (one, other) = (String::from_utf8_lossy(a), String::from_utf8_lossy(b));
        let line = one.lines().zip(other.lines()).find(|(x, y)| x != y);
        assert!(a == b, "{name} differs ({} and {} lines): {line:?}", one.lines().count(), other.lines().count());
    }
}

/// Everything that crosses, one output to two units, and a unit that is coupled to nothing.
fn bench() -> Bench {
    let more = [("source.points.position", "twin.in.position"), ("source.points.id", "twin.in.id")];
    support::of_everything(&[part("twin", "array_echo", &[]), part("quiet", "trouble", &[])], &more)
}

const PLACEMENTS: [(usize, [usize; 6]); 6] = [
    (1, [0; 6]),
    (2, [0, 1, 0, 1, 0, 1]),
    (2, [1; 6]),
    (3, [1, 2, 1, 2, 0, 0]),
    (6, [0, 1, 2, 3, 4, 5]),
    (7, [6, 5, 4, 3, 2, 1]),
];

#[test]
fn every_placement_gives_the_same_bits() {
    let bench = bench();
    let way = Way::default();
    let outcome = alone(&bench, "alone", &way);
    assert!(matches!(outcome.end, End::Done) && outcome.bonds[0].energy.passed > 0.0);
    for (k, (size, owner)) in PLACEMENTS.into_iter().enumerate() {
        let out = format!("on{k}");
        let on = on(&bench, size, &owner, &out, &way);
        assert!(matches!(on.end, End::Done), "{:?}", on.end);
        same(&bench, "alone", &out);
        assert_eq!(on.bonds, outcome.bonds);
        // Steps are counted where they are taken, and told at the end.
        let calls = |o: &Outcome| o.manifest.timings.units.iter().map(|u| u.calls).collect::<Vec<_>>();
        assert_eq!(calls(&on), calls(&outcome), "{owner:?}");
        assert_eq!(on.manifest.units.iter().map(|u| u.rank).collect::<Vec<_>>(), owner);
    }
}

#[test]
fn a_checkpoint_of_some_ranks_is_gone_on_with_by_others() {
    let bench = bench();
    alone(&bench, "alone", &Way::default());
    for (k, (size, owner)) in PLACEMENTS.into_iter().enumerate().skip(1) {
        let out = format!("part{k}");
        let way = Way { every: Some("0.06"), stop_when: vec!["quiet.value > 0.3".into()], ..Way::default() };
        let ended = on(&bench, size, &owner, &out, &way);
        assert!(matches!(ended.end, End::Condition { .. }), "{:?}", ended.end);
        // Another placement each time, the last one alone.
        let resume = Way { resume: true, ..Way::default() };
        match PLACEMENTS.get(k + 1) {
            Some((size, owner)) => on(&bench, *size, owner, &out, &resume),
            None => alone(&bench, &out, &resume),
        };
        same(&bench, "alone", &out);
    }
}

#[test]
fn a_condition_ends_the_run_where_it_ends_alone() {
    let bench = bench();
    let way = Way { stop_when: vec!["second.force > 20".into()], ..Way::default() };
    let End::Condition { time, .. } = alone(&bench, "alone", &way).end else { panic!() };
    let End::Condition { time: other, .. } = on(&bench, 3, &[1, 2, 1, 2, 0, 0], "on", &way).end else { panic!() };
    assert_eq!(time, other);
    same(&bench, "alone", "on");
}

fn trouble(mode: &str) -> Bench {
    let set = [("mode", mode), ("at", "0.05")];
    let parts = [
        part("a", "mass_first", &[("m", "1"), ("k", "1"), ("d", "0"), ("x0", "0.01")]),
        part("b", "trouble", &set),
        part("c", "trouble", &set),
    ];
    Bench::new("0.01", "0.2", &parts, &[], "<tm:Recording><tm:Scalars element=\"*\" connector=\"*\"/></tm:Recording>")
}

#[test]
fn a_failure_anywhere_ends_the_run_with_rank_unit_and_time() {
    for mode in ["input", "nan", "panic", "numerical", "discard"] {
        let bench = trouble(mode);
        let one = alone(&bench, "alone", &Way::default());
        for (size, owner) in [(2, [0, 1, 1]), (2, [1, 0, 0]), (3, [0, 1, 2]), (3, [0, 2, 1]), (4, [3, 2, 1])] {
            let out = on(&bench, size, &owner, "on", &Way::default());
            assert_eq!(out.exit_code(), one.exit_code(), "{mode} {:?} {:?}", one.end, out.end);
            same(&bench, "alone", "on");
            if let End::Failed(failure) = &one.end {
                let (alone, told) = (failure.to_string(), run::tell(&out.end));
                // The first unit of the plan is told, wherever it is.
                assert_eq!(told, format!("rank {}: {alone}", owner[1]), "{mode}");
            }
        }
    }
}

#[test]
fn a_unit_may_end_the_run_from_any_rank() {
    let bench = trouble("end");
    let End::EndedBy { unit, time } = alone(&bench, "alone", &Way::default()).end else { panic!() };
    for (size, owner) in [(2, [0, 1, 1]), (2, [1, 0, 0]), (3, [0, 1, 2]), (3, [0, 2, 1])] {
        let out = on(&bench, size, &owner, "on", &Way::default());
        let End::EndedBy { unit: other, time: at } = &out.end else { panic!("{:?}", out.end) };
        assert_eq!((&unit, time), (other, *at), "{owner:?}");
        same(&bench, "alone", "on");
    }
}

#[test]
fn a_failure_before_the_first_step_leaves_nothing_and_nobody_waits() {
    let bench = bench();
    // A file that stands where the results should go: only rank 0 sees it.
    fs::write(bench.folder.path().join("file"), "x").unwrap();
    let (checks, options) = options(&bench, "file", &Way::default());
    let mut worlds = threads(2).into_iter();
    let (zero, one) = (worlds.next().unwrap(), worlds.next().unwrap());
    let plan = || check::plan(&bench.file, &checks).unwrap();
    let (plan_zero, plan_one, settings) = (plan(), plan(), options.clone());
    let server = std::thread::spawn(move || run::serve(plan_one, &settings, &Stop::new(), placed(one, &[1; 6])));
    let failed = run::run_on(plan_zero, &options, Display::quiet(), &Stop::new(), Some(placed(zero, &[1; 6])));
    assert!(failed.is_err());
    assert!(server.join().unwrap().is_err());
    // A unit that refuses its parameters, on another rank.
    let bench = trouble("late");
    let out = on(&bench, 2, &[0, 1, 1], "on", &Way::default());
    let End::Failed(failure) = &out.end else { panic!("{:?}", out.end) };
    assert!(failure.to_string().starts_with("rank 1: ") && !out.recorded, "{failure}");
}

#[test]
fn whoever_is_asked_to_stop_stops_all() {
    let bench = bench();
    alone(&bench, "alone", &Way::default());
    for rank in 0..3 {
        let out = format!("stopped{rank}");
        let way = Way { stop: Some(rank), ..Way::default() };
        let stopped = on(&bench, 3, &[1, 2, 1, 2, 0, 0], &out, &way);
        assert!(matches!(stopped.end, End::Stopped { saved: true, .. }), "{:?}", stopped.end);
        on(&bench, 2, &[0, 1, 0, 1, 0, 1], &out, &Way { resume: true, ..Way::default() });
        same(&bench, "alone", &out);
    }
}
