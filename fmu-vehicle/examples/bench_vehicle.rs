//! Microseconds per step of the HMMWV at 1e-3 s: `cargo run --release -p fmu-vehicle --example bench_vehicle`.
//!
//! The vehicle drives straight, then steers in a sine on springs that stand for tires. One thread, direct solve, gaps below 1e-9 m.
//! The median of several runs is printed, as `name value unit`: by the wall clock, and by the time the thread was on a core (which
//! other work on the machine disturbs less).

use fmu_vehicle::powertrain::Mode;
use fmu_vehicle::vehicle::place::Rest;
use fmu_vehicle::vehicle::{Place, Vehicle, VehicleSpec};
use std::time::Instant;
use terramech_mechanics::Vec3;

const STEP: f64 = 1e-3;
const STEPS: usize = 10_000;

/// Seconds this thread has been on a core (Linux), if the system tells.
fn on_core() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    text.split_whitespace().next()?.parse::<f64>().ok().map(|ns| ns * 1e-9)
}

fn drive(v: &mut Vehicle) -> (f64, Option<f64>, usize) {
    let mut iterations = 0;
    let (start, core) = (Instant::now(), on_core());
    for k in 0..STEPS {
        let t = k as f64 * STEP;
        v.inputs.throttle = 0.6;
        v.inputs.steering = if t > 2.0 { 0.3 * (2.0 * t).sin() } else { 0.0 };
        for i in 0..4 {
            let s = v.wheel_state(i);
            let heading = s.orientation * Vec3::y();
            let side = s.velocity.dot(&heading);
            let load = (3e5 * (0.467 - s.position.z) - 3e3 * s.velocity.z).max(0.0);
            let forward = Vec3::new(heading.y, -heading.x, 0.0);
            let slip = 0.467 * s.angular_velocity.dot(&heading) - s.velocity.dot(&forward);
            let pull = (5e3 * slip).clamp(-0.8 * load, 0.8 * load);
            let lateral = (-5e3 * side).clamp(-0.8 * load, 0.8 * load);
            v.wrenches[i].force = Vec3::new(0.0, 0.0, load) + forward * pull + heading * lateral;
            v.wrenches[i].moment = -heading * (pull * 0.467);
        }
        iterations += v.step(STEP).expect("the vehicle moves").iterations;
    }
    let wall = start.elapsed().as_secs_f64();
    let core = on_core().zip(core).map(|(b, a)| (b - a) * 1e6 / STEPS as f64);
    (wall * 1e6 / STEPS as f64, core, iterations)
}

fn main() {
    let spec = VehicleSpec::read("hmmwv/vehicle.json", &Place::Folder(None)).expect("shipped data");
    let rest = Rest::find(&spec, &[], &[], Mode::Drive).expect("the HMMWV finds its rest").vehicle;
    let (mut runs, mut cores) = (Vec::new(), Vec::new());
    let mut iterations = 0;
    for _ in 0..5 {
        let mut v = rest.clone();
        let (time, core, n) = drive(&mut v);
        iterations = n;
        runs.push(time);
        cores.extend(core);
    }
    cores.sort_by(f64::total_cmp);
    runs.sort_by(f64::total_cmp);
    let us = runs[runs.len() / 2];
    println!("vehicle.hmmwv.us_per_step {us:.2} us");
    println!("vehicle.hmmwv.us_per_step_best {:.2} us", runs[0]);
    if let Some(core) = cores.get(cores.len() / 2) {
        println!("vehicle.hmmwv.core_us_per_step {core:.2} us");
    }
    println!("vehicle.hmmwv.real_time_factor {:.1} 1", STEP * 1e6 / us);
    println!("vehicle.hmmwv.newton_iterations_per_step {:.2} 1", iterations as f64 / STEPS as f64);
}
