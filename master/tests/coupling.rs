//! The Jacobi loop against a bare loop of the same physics, bit for bit.

mod support;

use support::{Bench, Part, part};
use terramech::run::{End, ExitCode};
use testunits::masses::{Oscillator, Partner};

/// Parameters of a two-mass case of validation section 6: (m, k, d) of both, (cc, dc).
struct Case {
    first: [f64; 3],
    second: [f64; 3],
    coupling: [f64; 2],
}

const CASE_2: Case = Case { first: [40.0, 150_000.0, 0.0], second: [400.0, 0.0, 0.0], coupling: [15_000.0, 1000.0] };

const WIRES: [(&str, &str); 3] = [
    ("second.force", "first.force"),
    ("first.position", "second.other.position"),
    ("first.velocity", "second.other.velocity"),
];

fn bench(case: &Case, step: &str, stop: &str, multiples: [u64; 2], extras: &str) -> Bench {
    let names = |values: &[f64], names: &[&'static str]| -> Vec<(&'static str, String)> {
        names.iter().copied().zip(values.iter().map(|x| format!("{x:?}"))).collect()
    };
    let mut first = names(&case.first, &["m", "k", "d"]);
    first.push(("x0", "0.01".into()));
    let mut second = names(&case.second, &["m", "k", "d"]);
    second.extend(names(&case.coupling, &["cc", "dc"]));
    let borrowed = |list: &'static str, v: &[(&'static str, String)]| {
        let _ = list;
        v.iter().map(|(n, x)| (*n, Box::leak(x.clone().into_boxed_str()) as &str)).collect::<Vec<_>>()
    };
    let (first, second) = (borrowed("first", &first), borrowed("second", &second));
    let extra = multiples.map(|m| format!("multiple=\"{m}\""));
    let parts = [
        Part { name: "first", model: "mass_first", set: &first, extras: &extra[0] },
        Part { name: "second", model: "mass_second", set: &second, extras: &extra[1] },
    ];
    Bench::new(step, stop, &parts, &WIRES, extras)
}

/// The same by hand: time and the recorded columns (first x, v; second force) at every base step.
fn bare(case: &Case, h: f64, steps: u64, multiples: [u64; 2]) -> Vec<[f64; 3]> {
    let [m, k, d] = case.first;
    let mut first = Oscillator { m, k, d, x: 0.01, v: 0.0 };
    let [m, k, d] = case.second;
    let [cc, dc] = case.coupling;
    let mut second = Partner { own: Oscillator { m, k, d, x: 0.0, v: 0.0 }, cc, dc };
    let mut outputs = [first.x, first.v, second.force(first.x, first.v)];
    let (mut force, mut motion) = (outputs[2], [outputs[0], outputs[1]]);
    let mut rows = Vec::new();
    let mut ahead = outputs;
    for tick in 0..=steps {
        let due = multiples.map(|m| tick % m == 0);
        if due[0] {
            (outputs[0], outputs[1]) = (ahead[0], ahead[1]);
        }
        if due[1] {
            outputs[2] = ahead[2];
        }
        rows.push(outputs);
        // What is not read anew is not set again: the input keeps its value.
        if due[0] && due[1] {
            force = outputs[2];
            motion = [outputs[0], outputs[1]];
        } else if due[1] && multiples[0] <= multiples[1] {
            motion = [outputs[0], outputs[1]];
        } else if due[0] && multiples[1] <= multiples[0] {
            force = outputs[2];
        }
        if tick == steps {
            break;
        }
        if due[0] {
            first.step(force, h * multiples[0] as f64);
            (ahead[0], ahead[1]) = (first.x, first.v);
        }
        if due[1] {
            second.step(motion[0], motion[1], h * multiples[1] as f64);
            ahead[2] = second.force(motion[0], motion[1]);
        }
    }
    rows
}

fn same_bits(bench: &Bench, expected: &[[f64; 3]]) {
    let csv = bench.csv();
    let columns = ["first.position", "first.velocity", "second.force"].map(|c| csv.numbers(c).unwrap());
    assert_eq!(csv.time.len(), expected.len());
    for (i, row) in expected.iter().enumerate() {
        for (column, x) in columns.iter().zip(row) {
            assert_eq!(column[i].to_bits(), x.to_bits(), "row {i}: {} is not {x}", column[i]);
        }
    }
}

#[test]
fn jacobi_gives_the_bits_of_a_bare_loop_for_any_number_of_threads() {
    let bench = bench(&CASE_2, "0.0078125", "4", [1, 1], "");
    let expected = bare(&CASE_2, 0.0078125, 512, [1, 1]);
    for threads in [1, 2, 4] {
        let outcome = bench.run(threads);
        assert!(matches!(outcome.end, End::Done), "{:?}", outcome.end);
        assert_eq!(outcome.exit_code(), ExitCode::Done);
        same_bits(&bench, &expected);
        assert_eq!(outcome.manifest.timings.units[0].calls, 512);
    }
}

#[test]
fn units_that_are_handed_to_other_threads_give_the_same_bits() {
    // Two units that sleep make it worth while to hand over all units but one, at every step.
    let slow = [("mode", "slow")];
    let mass =
        |set| -> Vec<(&str, &str)> { [("m", "40"), ("k", "150000"), ("d", "0")].into_iter().chain(set).collect() };
    let first = mass(vec![("x0", "0.01")]);
    let second = [("m", "400"), ("k", "0"), ("d", "0"), ("cc", "15000"), ("dc", "1000")];
    let parts = [
        part("nap", "trouble", &slow),
        part("first", "mass_first", &first),
        part("rest", "trouble", &slow),
        part("second", "mass_second", &second),
    ];
    let bench = Bench::new("0.0078125", "0.125", &parts, &WIRES, "");
    for threads in [2, 4] {
        let outcome = bench.run(threads);
        assert!(matches!(outcome.end, End::Done), "{:?}", outcome.end);
        same_bits(&bench, &bare(&CASE_2, 0.0078125, 16, [1, 1]));
    }
}

#[test]
fn a_unit_may_communicate_at_a_multiple_of_the_base_step() {
    for multiples in [[1, 4], [4, 1]] {
        let bench = bench(&CASE_2, "0.0009765625", "0.25", multiples, "");
        let outcome = bench.run(2);
        assert!(matches!(outcome.end, End::Done), "{:?}", outcome.end);
        same_bits(&bench, &bare(&CASE_2, 0.0009765625, 256, multiples));
        let calls = [0, 1].map(|i| outcome.manifest.timings.units[i].calls);
        assert_eq!(calls, multiples.map(|m| 256 / m));
    }
}

/// Largest |position| in the last tenth over that in the first tenth.
fn growth(case: &Case, step: &str, stop: &str) -> f64 {
    let bench = bench(case, step, stop, [1, 1], "");
    bench.run(1);
    let csv = bench.csv();
    let x = csv.numbers("first.position").unwrap();
    let largest = |part: &[f64]| part.iter().fold(0.0f64, |a, x| a.max(x.abs()));
    let tenth = x.len() / 10;
    largest(&x[x.len() - tenth..]) / largest(&x[..tenth])
}

/// Validation section 6, case 6.2, convention a: stable below H = 0.01256 s (tolerance here: 1 %).
#[test]
fn the_stable_step_of_validation_case_6_2_is_met() {
    assert!(growth(&CASE_2, "0.01243", "24.86") < 1.0);
    assert!(growth(&CASE_2, "0.01269", "25.38") > 1.0);
}

#[test]
fn what_was_asked_for_is_recorded_at_its_rate_and_averaged() {
    let extras = "<tm:Recording every=\"0.0625\"><tm:Scalars element=\"second\" connector=\"position\" every=\"0.25\"/></tm:Recording>\
        <tm:Summary><tm:Item name=\"coupling force\" element=\"second\" connector=\"force\" from=\"1\" to=\"2\" measured=\"-0.5\" source=\"nowhere\"/></tm:Summary>";
    let bench = bench(&CASE_2, "0.0078125", "2", [1, 1], extras);
    let outcome = bench.run(1);
    let csv = bench.csv();
    assert_eq!(csv.time[..3], [0.0, 0.0625, 0.125]);
    assert_eq!(csv.time.len(), 33);
    assert_eq!(csv.columns.iter().find(|c| c.name == "second.position").unwrap().unit, "m");
    let rows = bare(&CASE_2, 0.0078125, 256, [1, 1]);
    let window = &rows[128..=256];
    let mean = window.windows(2).map(|w| 0.5 * (w[0][2] + w[1][2])).sum::<f64>() / 128.0;
    let head = &outcome.headlines[0];
    assert!((head.value - mean).abs() < 1e-12 * mean.abs().max(1.0), "{} {mean}", head.value);
    assert_eq!((head.window, head.measured), (Some([1.0, 2.0]), Some(-0.5)));
    for file in ["summary.json", "manifest.json", "report.html", "log.jsonl"] {
        assert!(bench.out().join(file).is_file(), "{file}");
    }
}

#[test]
fn a_chain_that_visits_units_twice_is_initialised_in_order() {
    // in -> a.1 -> b.1 -> a.2 -> b.2, each 2 x + 1, ready at t = 0.
    let parts = [part("a", "relay", &[]), part("b", "relay", &[])];
    let wires = [("a.out[1]", "b.in[1]"), ("b.out[1]", "a.in[2]"), ("a.out[2]", "b.in[2]")];
    let extras = "<tm:Recording><tm:Scalars element=\"b\" connector=\"out[2]\"/></tm:Recording>";
    let bench = Bench::new("0.1", "0.2", &parts, &wires, extras);
    let outcome = bench.run(2);
    assert!(matches!(outcome.end, End::Done), "{:?}", outcome.end);
    let csv = bench.csv();
    assert_eq!(csv.numbers("a.out[1]").unwrap()[0], 1.0);
    assert_eq!(csv.numbers("b.out[1]").unwrap()[0], 3.0);
    assert_eq!(csv.numbers("a.out[2]").unwrap()[0], 7.0);
    assert_eq!(csv.numbers("b.out[2]").unwrap()[0], 15.0);
}
