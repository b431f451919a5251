//! Lugs: a closed surface, forces on their tops reach rim and shells whole.

use fmu_tire::ancf::geometry::TireMesh;
use fmu_tire::ancf::plane::Plane;
use fmu_tire::ancf::spec::{FlexibleTire, HMMWV_LUMPED, Lugs, parse};
use fmu_tire::ancf::statics::StaticOptions;
use fmu_tire::ancf::tire::Tire;
use nalgebra::Vector3;
use std::collections::BTreeMap;
use terramech_mechanics::RigidState;
use terramech_mechanics::sparse::Precision;

const HEIGHT: f64 = 0.012;

fn with_lugs(staggered: bool) -> FlexibleTire {
    let mut spec = parse(HMMWV_LUMPED).unwrap();
    spec.divisions = 32;
    spec.sections.iter_mut().zip([1, 1, 2]).for_each(|(s, n)| s.elements = n);
    spec.lugs = Some(Lugs { count: 8, height: HEIGHT, elements: 2, staggered });
    spec
}

#[test]
fn the_surface_stays_closed() {
    for staggered in [false, true] {
        let tire = TireMesh::new(&with_lugs(staggered)).unwrap();
        let surface = &tire.surface;
        // 8 lugs of 3 x 5 tops; split in two halves, 3 x 3 each.
        assert_eq!(surface.len(), 32 * 9 + if staggered { 8 * 2 * 9 } else { 8 * 15 });
        let mut edges = BTreeMap::new();
        for t in &surface.triangles {
            (0..3).for_each(|k| *edges.entry((t[k], t[(k + 1) % 3])).or_insert(0) += 1);
        }
        assert!(edges.iter().all(|(&(a, b), &n)| n == 1 && edges.get(&(b, a)) == Some(&1)));
        let q = tire.mesh.reference();
        let volume = |triangles: &[[u32; 3]]| -> f64 {
            let p = |k: u32| surface.at(k as usize, q);
            triangles.iter().map(|t| p(t[0]).dot(&p(t[1]).cross(&p(t[2]))) / 6.0).sum()
        };
        let mut smooth = with_lugs(staggered);
        smooth.lugs = None;
        let without = TireMesh::new(&smooth).unwrap();
        let more = volume(&surface.triangles) - volume(&without.surface.triangles);
        let tread: f64 = without.surface.areas.iter().sum::<f64>();
        assert!(more > 0.1 * HEIGHT * tread && more < HEIGHT * tread, "{more}");
        assert!((surface.areas.iter().sum::<f64>() - tread).abs() < 1e-12);
    }
}

/// Momentum: forces on tops, at their arms, weight and rim, to round-off.
#[test]
fn forces_on_tops_reach_the_rim_whole() {
    let mut tire = Tire::new(&with_lugs(true), Precision::Single).unwrap();
    let first = 32 * 9;
    let forces: Vec<(u32, [f64; 3])> =
        (0..30).map(|k| (first + 4 * k, [30.0 * f64::from(k).sin(), 20.0 * f64::from(k).cos(), 50.0])).collect();
    for k in 0..5 {
        let momentum = |t: &Tire| {
            let [p, l, _] = t.mesh.mesh.momentum(&t.state.shell.q, &t.state.shell.v, &[0.0; 3]);
            (Vector3::from(p), Vector3::from(l))
        };
        let before = momentum(&tire);
        let h = 1e-4;
        let wrench = tire.step(&RigidState::default(), h, &forces).unwrap();
        let after = momentum(&tire);
        let sum: Vector3<f64> = forces.iter().map(|f| Vector3::from(f.1)).sum();
        let weight = Vector3::from(tire.gravity) * tire.hub.mass;
        let left = (after.0 - before.0) / h - (sum + weight - wrench.force);
        assert!(left.norm() < 1e-9 * sum.norm(), "step {k}: {left}");
    }
}

/// On the plane it stands on its lugs: what touches are tops, and the rim carries what the plane gives.
#[test]
fn it_stands_on_its_lugs() {
    let mut tire = Tire::new(&with_lugs(false), Precision::Double).unwrap();
    tire.gravity = [0.0; 3];
    let surface = &tire.mesh.surface;
    let lowest = (0..surface.len()).map(|k| surface.at(k, &tire.state.shell.q).z).fold(f64::MAX, f64::min);
    let nodes = 32 * 9;
    let bare = (0..nodes).map(|k| surface.at(k, &tire.state.shell.q).z).fold(f64::MAX, f64::min);
    assert!(bare - lowest > 0.9 * HEIGHT);
    tire.state.plane = Some(Plane::horizontal(lowest));
    tire.press(lowest + 0.008, &StaticOptions { descent: 200, ..Default::default() }).unwrap();
    let forces = tire.plane_forces();
    assert!(forces.len() >= 3 && forces.iter().all(|f| f.0 as usize >= nodes), "{forces:?}");
    let load: f64 = forces.iter().map(|f| f.1[2]).sum();
    // At rest the rim's reaction over a step is the load.
    let wrench = tire.step(&RigidState::default(), 4e-5, &[]).unwrap();
    assert!(load > 500.0 && (wrench.force.z - load).abs() < 0.01 * load, "{load} {}", wrench.force.z);
}
