//! Validation section 6: stable steps, growth, orders of convergence and energy residual of the coupling algorithms, on two masses
//! with a spring-damper between them.

mod support;

use std::fmt::Write as _;

use support::{Bench, part};
use terramech::coupling::{Stability, stability_of};
use terramech::run::{End, Outcome};

/// (m, k, d) of both masses, (cc, dc) between them, as in the table of validation section 6.
struct Case {
    name: &'static str,
    first: [f64; 3],
    second: [f64; 3],
    coupling: [f64; 2],
}

const CASE_1: Case = Case { name: "6.1", first: [1.0; 3], second: [1.0; 3], coupling: [1.0; 2] };
const CASE_2: Case =
    Case { name: "6.2", first: [40.0, 150_000.0, 0.0], second: [400.0, 0.0, 0.0], coupling: [15_000.0, 1000.0] };
const CASE_3: Case =
    Case { name: "6.3", first: [400.0, 0.0, 0.0], second: [40.0, 150_000.0, 0.0], coupling: [15_000.0, 1000.0] };
const PI2: f64 = std::f64::consts::PI * std::f64::consts::PI;
const CASE_4: Case =
    Case { name: "6.4", first: [1.0, 4.0 * PI2, 0.0], second: [1.0, 4.0 * PI2, 0.0], coupling: [16.0 * PI2, 0.0] };

const JACOBI: &str = "";
const RESOLVED: &str = "<tm:Algorithm scheme=\"jacobi\" resolveFeedThrough=\"true\"/>";
const GAUSS_SEIDEL: &str = "<tm:Algorithm scheme=\"gauss-seidel\"/>";
const ITERATED: &str = "<tm:Algorithm scheme=\"iterated\" tolerance=\"1e-10\"/>";
const BOND: &str = "<tm:PowerBond name=\"spring\"><tm:Pair effortElement=\"second\" effortConnector=\"force\" \
    flowElement=\"first\" flowConnector=\"velocity\"/></tm:PowerBond>";
const WIRES: [(&str, &str); 3] = [
    ("second.force", "first.force"),
    ("first.position", "second.other.position"),
    ("first.velocity", "second.other.velocity"),
];

fn extrapolated(order: u8) -> String {
    let rule = |unit: &str| format!("<tm:Extrapolation element=\"{unit}\" connector=\"*\" order=\"{order}\"/>");
    rule("first") + &rule("second")
}

fn bench(case: &Case, step: f64, steps: u32, extras: &str) -> Bench {
    let text = |x: f64| format!("{x:?}");
    let [first, second, coupling] =
        [&case.first[..], &case.second, &case.coupling].map(|v| v.iter().map(|x| text(*x)).collect::<Vec<_>>());
    let first = [("m", &*first[0]), ("k", &first[1]), ("d", &first[2]), ("x0", "0.01")];
    let second = [("m", &*second[0]), ("k", &second[1]), ("d", &second[2]), ("cc", &coupling[0]), ("dc", &coupling[1])];
    let parts = [part("first", "mass_first", &first), part("second", "mass_second", &second)];
    let record = "<tm:Recording><tm:Scalars element=\"*\" connector=\"*\"/></tm:Recording>";
    // Both times must be exact decimals.
    let step = format!("{step:.7}").parse::<f64>().unwrap();
    let stop = format!("{:.7}", step * f64::from(steps));
    Bench::new(&text(step), &stop, &parts, &WIRES, &format!("{extras}{record}"))
}

fn run(case: &Case, step: f64, steps: u32, extras: &str) -> (Bench, Outcome) {
    let bench = bench(case, step, steps, extras);
    let outcome = bench.run(1);
    assert!(matches!(outcome.end, End::Done), "{:?}", outcome.end);
    (bench, outcome)
}

/// A figure for the table; the tolerance is absolute.
fn validation(case: &str, quantity: &str, unit: &str, expected: f64, computed: f64, tolerance: f64) {
    println!("VALIDATION|{case}|{quantity}|{unit}|{expected:.6}|{computed:.6}|{tolerance:.3e}");
}

/// Factor by which the motion grows per step late in the run.
fn growth(case: &Case, step: f64, extras: &str) -> f64 {
    let (bench, _) = run(case, step, 2000, extras);
    let csv = bench.csv();
    let x = csv.numbers("first.position").unwrap();
    let size = |from: usize| x[from..from + 200].iter().map(|x| x * x).sum::<f64>().sqrt();
    (size(1800) / size(1000)).powf(1.0 / 800.0)
}

/// The limit between growth and decay in `low..high`, to 0.1 %.
fn limit(case: &Case, extras: &str, mut low: f64, mut high: f64) -> f64 {
    assert!(growth(case, low, extras) < 1.0 && growth(case, high, extras) > 1.0);
    while high / low > 1.001 {
        let middle = 0.5 * (low + high);
        if growth(case, middle, extras) > 1.0 { high = middle } else { low = middle }
    }
    0.5 * (low + high)
}

#[test]
fn the_stable_steps_of_the_two_mass_systems_are_met() {
    for (case, scheme, extras, expected) in [
        (&CASE_1, "Jacobi, feed-through resolved", RESOLVED, 1.1631),
        (&CASE_2, "Jacobi", JACOBI, 0.01256),
        (&CASE_2, "Jacobi, feed-through resolved", RESOLVED, 0.03810),
        (&CASE_2, "Gauss-Seidel", GAUSS_SEIDEL, 0.03921),
        (&CASE_3, "Jacobi", JACOBI, 0.03973),
        (&CASE_3, "Jacobi, feed-through resolved", RESOLVED, 0.16469),
        (&CASE_3, "Gauss-Seidel", GAUSS_SEIDEL, 0.11436),
    ] {
        let found = limit(case, extras, 0.97 * expected, 1.03 * expected);
        validation(case.name, &format!("stable step, {scheme}"), "s", expected, found, 0.01 * expected);
        assert!((found / expected - 1.0).abs() < 0.01, "{} {scheme}: {found}", case.name);
    }
    // No limit up to 30 s.
    assert!(growth(&CASE_1, 30.0, JACOBI) <= 1.0 + 1e-9 || growth(&CASE_1, 30.0, JACOBI).is_nan());
}

#[test]
fn undamped_masses_grow_by_the_spectral_radius() {
    for (scheme, extras, expected) in [
        ("Jacobi", JACOBI, 1.009586),
        ("Jacobi, feed-through resolved", RESOLVED, 1.005894),
        ("Gauss-Seidel", GAUSS_SEIDEL, 1.001976),
    ] {
        let found = growth(&CASE_4, 0.01, extras);
        validation("6.4", &format!("growth per step, {scheme}"), "1", expected, found, 1e-4);
        assert!((found - expected).abs() < 1e-4, "{scheme}: {found}");
    }
}

/// Position of the first mass of the coupled system at time `t` (s), by a Runge-Kutta method with a tiny step.
fn exact(case: &Case, t: f64) -> f64 {
    let ([m1, k1, d1], [m2, k2, d2], [cc, dc]) = (case.first, case.second, case.coupling);
    let f = |[x1, v1, x2, v2]: [f64; 4]| {
        let force = cc * (x2 - x1) + dc * (v2 - v1);
        [v1, (force - k1 * x1 - d1 * v1) / m1, v2, (-force - k2 * x2 - d2 * v2) / m2]
    };
    let n = 4000;
    let h = t / f64::from(n);
    let add = |s: [f64; 4], k: [f64; 4], h: f64| std::array::from_fn(|i| s[i] + h * k[i]);
    let mut s = [0.01, 0.0, 0.0, 0.0];
    for _ in 0..n {
        let k1 = f(s);
        let k2 = f(add(s, k1, h / 2.0));
        let k3 = f(add(s, k2, h / 2.0));
        let k4 = f(add(s, k3, h));
        s = std::array::from_fn(|i| s[i] + h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]));
    }
    s[0]
}

#[test]
fn algorithms_and_extrapolations_have_their_order() {
    let reference = exact(&CASE_1, 1.0);
    let mut table = String::new();
    for (scheme, extras, order) in [
        ("Jacobi", JACOBI.to_owned(), 1.0),
        ("Jacobi, resolved", RESOLVED.to_owned(), 1.0),
        ("Jacobi, resolved, order 1", RESOLVED.to_owned() + &extrapolated(1), 2.0),
        ("Jacobi, resolved, order 2", RESOLVED.to_owned() + &extrapolated(2), 2.0),
        ("Gauss-Seidel", GAUSS_SEIDEL.to_owned(), 1.0),
        ("iterated", ITERATED.to_owned(), 2.0),
    ] {
        let error = |steps: u32| {
            let (bench, _) = run(&CASE_1, 1.0 / f64::from(steps), steps, &extras);
            (bench.csv().numbers("first.position").unwrap()[steps as usize] - reference).abs()
        };
        // Steps that are exact decimals.
        let errors = [error(50), error(100), error(200)];
        let found = (errors[0] / errors[2]).log2() / 2.0;
        writeln!(table, "{scheme}: {errors:?} order {found:.3}").unwrap();
        validation("6.1", &format!("order of convergence, {scheme}"), "1", order, found, 0.15);
        assert!((found - order).abs() < 0.15, "{table}");
    }
}

/// Energy of both masses and all springs (J).
fn energy(case: &Case, bench: &Bench, row: usize) -> f64 {
    let csv = bench.csv();
    let [x1, v1, x2, v2] = ["first.position", "first.velocity", "second.position", "second.velocity"]
        .map(|name| csv.numbers(name).unwrap()[row]);
    let ([m1, k1, _], [m2, k2, _], [cc, _]) = (case.first, case.second, case.coupling);
    0.5 * (m1 * v1 * v1 + k1 * x1 * x1 + m2 * v2 * v2 + k2 * x2 * x2 + cc * (x2 - x1) * (x2 - x1))
}

#[test]
fn the_energy_residual_is_the_energy_the_coupling_makes() {
    for (scheme, extras) in
        [("Jacobi", JACOBI), ("Jacobi, feed-through resolved", RESOLVED), ("Gauss-Seidel", GAUSS_SEIDEL)]
    {
        let (bench, outcome) = run(&CASE_4, 0.0025, 400, &format!("{extras}{BOND}"));
        let made = energy(&CASE_4, &bench, 400) - energy(&CASE_4, &bench, 0);
        let told = outcome.bonds[0].energy;
        validation("6.4", &format!("energy made in 1 s, {scheme}"), "J", made, told.residual, 0.03 * made.abs());
        assert!((told.residual / made - 1.0).abs() < 0.03, "{scheme}: {told:?} {made}");
        assert!(outcome.bonds[0].step.unwrap() < 0.0025 && told.passed > told.residual);
        let csv = bench.csv();
        assert_eq!(*csv.numbers("coupling.spring.residual").unwrap().last().unwrap(), told.residual);
        assert_eq!(outcome.headlines.last().unwrap().value, told.residual);
    }
    // Iterated with the mean of both ends, a spring makes hardly any.
    let (bench, outcome) = run(&CASE_4, 0.0025, 400, &format!("{ITERATED}{BOND}"));
    let (begin, end) = (energy(&CASE_4, &bench, 0), energy(&CASE_4, &bench, 400));
    assert!((end / begin - 1.0).abs() < 1e-2, "{begin} {end}");
    assert!(outcome.bonds[0].energy.residual.abs() < 0.01 * outcome.bonds[0].energy.passed, "{:?}", outcome.bonds);
}

#[test]
fn an_iteration_that_does_not_converge_names_its_worst_input() {
    let short = "<tm:Algorithm scheme=\"iterated\" tolerance=\"1e-12\" iterations=\"2\"/>";
    let text = |extras: &str| {
        let parts = [part("first", "mass_first", &[("x0", "0.01")]), part("second", "mass_second", &[])];
        let bench = Bench::new("0.1", "1", &parts, &WIRES, extras);
        let outcome = bench.run(1);
        (outcome.exit_code() as i32, terramech::run::tell(&outcome.end))
    };
    let (code, message) = text(short);
    assert!(code == 3 && message.contains("after 2 iterations") && message.contains(" -> "), "{code} {message}");
}

#[test]
fn an_order_must_name_every_component() {
    let parts = [part("first", "mass_first", &[]), part("second", "mass_second", &[])];
    let bench = Bench::new("0.1", "1", &parts, &WIRES, "<tm:Algorithm scheme=\"gauss-seidel\" order=\"second\"/>");
    let faults = terramech::check::plan(&bench.file, &terramech::check::Options::default()).unwrap_err().to_string();
    assert!(faults.contains("\"first\" is not in it"), "{faults}");
}

#[test]
fn the_program_finds_the_stable_steps_itself() {
    let found = |case: &Case, step: f64, extras: &str| {
        let bench = bench(case, step, 10, extras);
        let plan = terramech::check::plan(&bench.file, &terramech::check::Options::default()).unwrap();
        stability_of(plan, 1).unwrap()
    };
    for (case, scheme, extras, base, expected) in [
        (&CASE_1, "Jacobi, feed-through resolved", RESOLVED, 0.1, 1.1631),
        (&CASE_2, "Jacobi", JACOBI, 0.01, 0.01256),
        (&CASE_2, "Jacobi, feed-through resolved", RESOLVED, 0.1, 0.03810),
        (&CASE_2, "Gauss-Seidel", GAUSS_SEIDEL, 0.01, 0.03921),
        (&CASE_3, "Jacobi", JACOBI, 0.01, 0.03973),
        (&CASE_3, "Jacobi, feed-through resolved", RESOLVED, 0.02, 0.16469),
        (&CASE_3, "Gauss-Seidel", GAUSS_SEIDEL, 0.02, 0.11436),
    ] {
        let Stability::Below(step) = found(case, base, extras) else { panic!("{} {scheme}: no limit", case.name) };
        validation(
            case.name,
            &format!("stable step told by check --stability, {scheme}"),
            "s",
            expected,
            step,
            0.01 * expected,
        );
        assert!((step / expected - 1.0).abs() < 0.01, "{} {scheme}: {step}", case.name);
    }
    assert!(matches!(found(&CASE_1, 0.1, JACOBI), Stability::NoLimit(x) if x > 30.0));
}

#[test]
fn a_run_that_rings_is_stopped_with_the_stable_step() {
    let bench = bench(&CASE_2, 0.015, 20_000, BOND);
    let outcome = bench.run(1);
    let message = terramech::run::tell(&outcome.end);
    assert_eq!(outcome.exit_code() as i32, 3, "{message}");
    assert!(message.contains("rings") && message.contains("spring") && message.contains("about 1.25"), "{message}");
    // A coarse but stable one is left alone.
    let (_, outcome) = run(&CASE_2, 0.012, 5000, BOND);
    assert!(outcome.bonds[0].energy.residual > 0.0);
}

/// Rows (communication points), energy residual and energy passed of a run of case 6.2 over 1 s.
fn energy_of(step: f64, steps: u32, algorithm: &str) -> (usize, f64, f64) {
    let (bench, outcome) = run(&CASE_2, step, steps, &format!("{algorithm}{BOND}"));
    let energy = outcome.bonds[0].energy;
    (bench.csv().time.len() - 1, energy.residual, energy.passed)
}

/// Section 4 of the paper on ECCO: with as many steps, a step that follows the residual makes less energy than one of fixed length.
#[test]
fn a_step_that_follows_the_energy_makes_less_of_it() {
    let ecco = "<tm:Algorithm scheme=\"ecco\" tolerance=\"0.02\" longest=\"0.01\"/>";
    let (steps, residual, passed) = energy_of(0.0001, 20_000, ecco);
    let (_, fixed, _) = energy_of(2.0 / steps as f64, steps as u32, JACOBI);
    println!("ecco: {steps} steps, residual {residual} J of {passed} J; fixed steps {fixed} J");
    assert!(steps > 100 && steps < 10_000, "{steps}");
    assert!(residual.abs() < 0.02 * passed, "{residual} of {passed}");
    assert!(residual.abs() < fixed.abs(), "{residual} {fixed}");
    // A tighter tolerance: more steps, less energy.
    let tight = "<tm:Algorithm scheme=\"ecco\" tolerance=\"0.002\" longest=\"0.01\"/>";
    let (more, less, _) = energy_of(0.0001, 20_000, tight);
    println!("ecco, tight: {more} steps, residual {less} J");
    assert!(more > steps && less.abs() < residual.abs(), "{more} {less}");
}

#[test]
fn steps_that_vary_end_where_values_are_recorded() {
    let ecco = "<tm:Algorithm scheme=\"ecco\" tolerance=\"0.05\" longest=\"0.01\"/>";
    let bench = bench(&CASE_2, 0.0001, 1000, &format!("{ecco}{BOND}"));
    // The recording of the bench itself is replaced by one with a period.
    let text = std::fs::read_to_string(&bench.file).unwrap();
    std::fs::write(&bench.file, text.replace("<tm:Recording>", "<tm:Recording every=\"0.004\">")).unwrap();
    let outcome = bench.run(2);
    assert!(matches!(outcome.end, End::Done), "{:?}", outcome.end);
    let time = bench.csv().time;
    assert_eq!(time.len(), 26);
    assert!(time.iter().enumerate().all(|(i, t)| (t - 0.004 * i as f64).abs() < 1e-12), "{time:?}");
}
