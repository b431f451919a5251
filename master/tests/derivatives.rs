//! Input derivatives: a unit that interpolates its inputs is given the slope and bend of an extrapolated connection.

mod support;

use support::{Bench, part};
use terramech::run::End;
use testunits::smooth::position;

/// Largest error of the position over 1 s (m), after the first steps, in which the past is not known yet.
fn error(order: u8, interpolates: bool) -> f64 {
    let parts = [part("force", "parabola", &[]), part("mass", "smooth", &[])];
    let rule = format!("<tm:Extrapolation element=\"mass\" connector=\"force\" order=\"{order}\"/>");
    let record = "<tm:Recording><tm:Scalars element=\"*\" connector=\"*\"/></tm:Recording>";
    let bench = Bench::new("0.0625", "1", &parts, &[("force.force", "mass.force")], &format!("{rule}{record}"));
    if !interpolates {
        bench.change_model("smooth", |xml| {
            xml.replace("canInterpolateInputs=\"true\"", "canInterpolateInputs=\"false\"")
        });
    }
    let outcome = bench.run(1);
    assert!(matches!(outcome.end, End::Done), "{:?}", outcome.end);
    let csv = bench.csv();
    let x = csv.numbers("mass.position").unwrap();
    // What the first steps lack in velocity and position goes on as a straight line: it is taken out.
    let (t0, t1) = (csv.time[3], csv.time[4]);
    let off = |i: usize| x[i] - position(csv.time[i]);
    let line = |t: f64| off(3) + (off(4) - off(3)) * (t - t0) / (t1 - t0);
    (4..x.len()).map(|i| (off(i) - line(csv.time[i])).abs()).fold(0.0, f64::max)
}

#[test]
fn a_parabola_is_followed_exactly_with_two_derivatives() {
    assert!(error(2, true) < 1e-13, "{}", error(2, true));
}

#[test]
fn without_derivatives_the_unit_is_given_the_mean_over_the_step() {
    let (mean, slope) = (error(2, false), error(1, true));
    assert!(mean > 1e-7 && slope > 1e-7, "{mean} {slope}");
}
