//! The flexible tire on grains, unit against unit: exact exchange of impulse (case 9.2, in the loop), the rigid limit (9.5).

mod ancf_support;

use ancf_support::report;
use ancf_support::soil::{Soil, surface_velocity};
use fmu_tire::ancf::spec::{HMMWV_LUMPED, parse};
use fmu_tire::ancf::tire::Tire;
use nalgebra::{UnitQuaternion, Vector3};
use terramech_mechanics::RigidState;
use terramech_mechanics::sparse::Precision;

const H: f64 = 1e-4;
const STEPS: usize = 600;
/// The wheel sinks at this speed (m/s) and rolls at that.
const SINKING: f64 = 0.45;
const SPEED: f64 = 0.5;

const BED: &str = r#"{"soil": {"radius": {"uniform": {"least": 0.0115, "greatest": 0.0125}}, "density": 2500.0, "friction": 0.9,
    "restitution": 0.2, "young_modulus": 1e7, "poisson_ratio": 0.3}, "bed": {"length": 0.9, "width": 0.5, "fill": {"depth": 0.08}, "seed": 1}}"#;

fn wheel(time: f64, height: f64) -> RigidState {
    let omega = SPEED / 0.46;
    RigidState {
        position: Vector3::new(SPEED * time - 0.02, 0.0, height - SINKING * time),
        orientation: UnitQuaternion::from_scaled_axis(Vector3::new(0.0, omega * time, 0.0)),
        velocity: Vector3::new(SPEED, 0.0, -SINKING),
        angular_velocity: Vector3::new(0.0, omega, 0.0),
    }
}

/// Mean vertical force (N) over the last 20 ms of a wheel that sinks 27 mm; worst relative errors of the exchange of force and moment.
/// `stiffness`: factor on all moduli; `None`: the inflated shape, rigid.
fn sink(stiffness: Option<f64>) -> (f64, [f64; 3]) {
    let mut spec = parse(HMMWV_LUMPED).unwrap();
    spec.divisions = 40;
    spec.sections.iter_mut().zip([1, 2, 3]).for_each(|(s, n)| s.elements = n);
    spec.integrator.step = H;
    let factor = stiffness.unwrap_or(1.0);
    for m in &mut spec.materials {
        m.young.iter_mut().chain(&mut m.shear).for_each(|x| *x *= factor);
    }
    // The same inflated shape for all, so that only what gives under the load differs.
    spec.pressure *= factor;
    let mut tire = Tire::new(&spec, Precision::Single).unwrap();
    let mut soil = Soil::new(fmu_terrain::dem_p::model(), BED, &[]);
    let reach = tire.state.shell.q.chunks(6).map(|n| -n[2]).fold(0.0, f64::max);
    let height = soil.get("height") + reach + 1e-3;
    tire.place(&wheel(0.0, height));
    soil.take(&tire, &surface_velocity(&tire), &wheel(0.0, height).position);
    soil.0.exit_initialization().unwrap();
    let (mut mean, mut worst) = (0.0, [0.0f64; 3]);
    for k in 0..STEPS {
        let told = wheel(k as f64 * H, height);
        let forces = soil.forces();
        soil.take(&tire, &surface_velocity(&tire), &told.position);
        soil.0.do_step(k as f64 * H, H).unwrap();
        match stiffness {
            None => tire.place(&wheel((k + 1) as f64 * H, height)),
            Some(_) => {
                let momentum = |t: &Tire| {
                    let [p, _, _] = t.mesh.mesh.momentum(&t.state.shell.q, &t.state.shell.v, &[0.0; 3]);
                    Vector3::from(p)
                };
                let before = momentum(&tire);
                let wrench = tire.step(&told, H, &forces).unwrap();
                let given: Vector3<f64> = forces.iter().map(|f| Vector3::from(f.1)).sum();
                let left = (momentum(&tire) - before) / H
                    - (given + Vector3::from(tire.gravity) * tire.hub.mass - wrench.force);
                worst[2] = worst[2].max(left.norm() / (given.norm() + 100.0));
            }
        }
        // What the soil felt is what the vertices get: force, and the moment at the arms of the step's middle.
        let (force, moment) = (soil.vector("force"), soil.vector("moment"));
        let new = soil.forces();
        let sum: Vector3<f64> = new.iter().map(|f| Vector3::from(f.1)).sum();
        worst[0] = worst[0].max((sum - force).norm() / (force.norm() + 1.0));
        let turn: Vector3<f64> = new
            .iter()
            .map(|(i, f)| {
                let arm = tire.mesh.surface.at(*i as usize, &tire.state.shell.q) - tire.state.rim.position;
                arm.cross(&Vector3::from(*f))
            })
            .sum();
        if force.norm() > 100.0 {
            worst[1] = worst[1].max((turn - moment).norm() / (force.norm() * reach));
        }
        if k >= STEPS - 200 {
            mean += force.z / 200.0;
        }
    }
    println!("stiffness {stiffness:?}: {mean:.1} N, errors {worst:?}");
    (mean, worst)
}

/// 9.5 on soil, and 9.2 in the loop. The stiffer the tire, the nearer its force to that of the rigid shape sunk into the same bed.
#[test]
fn on_grains_a_stiff_tire_is_a_rigid_one_and_no_impulse_is_lost() {
    let (rigid, _) = sink(None);
    let (soft, worst) = sink(Some(1.0));
    let (stiff, more) = sink(Some(100.0));
    let exchange = worst[0].max(more[0]);
    report(
        "9.2 in the loop",
        "sum of vertex forces less the soil's force on the body, relative",
        "1",
        0.0,
        exchange,
        1e-12,
    );
    let momentum = worst[2].max(more[2]);
    report("9.2 in the loop", "change of the tire's momentum less all impulses, relative", "1", 0.0, momentum, 1e-9);
    let arms = worst[1].max(more[1]);
    report(
        "9.2 in the loop",
        "moment of the held forces less the soil's, over force x radius (order H)",
        "1",
        0.0,
        arms,
        1e-2,
    );
    report("9.5 on soil", "mean force over that of the rigid shape, as it is", "1", 1.0, soft / rigid, f64::INFINITY);
    report("9.5 on soil", "mean force over that of the rigid shape, 100 x stiffness", "1", 1.0, stiff / rigid, 0.05);
    assert!(exchange < 1e-12 && momentum < 1e-9 && arms < 1e-2, "{exchange} {momentum} {arms}");
    assert!((stiff / rigid - 1.0).abs() < 0.05, "{stiff} {rigid}");
    assert!((soft - rigid).abs() > (stiff - rigid).abs(), "{soft} {stiff} {rigid}");
}
