//! Stored hashes of a few beds, on the portable path: the same bits on every machine, build and number of threads.
//!
//! A hash may change only with a change that is meant to change results (a law, the order of a sum, what the state holds);
//! the commit says so and why. The beds avoid functions whose last bit depends on the system's library (powers, angles).
//! How far the wider paths are from these beds is printed, and bounded while a bed still remembers how it began.

use fmu_terrain::dem::{
    Adhesion, Body, CpuEngine, Cylinder, Fill, GrainEngine, LawKind, Material, Radii, Sample, Setup, Surface, Wall,
    sample,
};
use terramech_simd::Isa;

struct Bed {
    name: &'static str,
    law: LawKind,
    material: Material,
    radii: Radii,
    hash: u64,
}

fn beds() -> [Bed; 3] {
    let plain = Material::default();
    let sticky = Material {
        rolling_friction: 0.2,
        spinning_friction: 0.1,
        adhesion: Adhesion { pressure: 2e4, ..Adhesion::default() },
        ..plain
    };
    let bouncing = Material { restitution: 0.5, ..plain };
    [
        Bed {
            name: "Hertz-Mindlin, equal grains",
            law: LawKind::HertzMindlin,
            material: plain,
            radii: Radii::Equal(0.01),
            hash: 0x7559_bfc0_db8d_1dce,
        },
        Bed {
            name: "Hertz-Mindlin, adhesion and rolling resistance",
            law: LawKind::HertzMindlin,
            material: sticky,
            radii: Radii::Uniform(0.008, 0.012),
            hash: 0xd91b_8a66_a660_20e9,
        },
        Bed {
            name: "Flores",
            law: LawKind::Flores,
            material: bouncing,
            radii: Radii::Equal(0.01),
            hash: 0x0b0e_ed89_205e_84ac,
        },
    ]
}

/// Grains fall for 0.06 s, then a cylinder that does not turn is pushed into them.
fn engine(bed: &Bed, isa: Isa, threads: usize) -> CpuEngine {
    let (length, width) = (0.5, 0.14);
    let setup = Setup {
        law: bed.law,
        materials: vec![bed.material],
        walls: Wall::open_box(length, width, 0, 0),
        ..Setup::default()
    };
    let (fill, radii) = (Fill::Count(1500), bed.radii.clone());
    let grains =
        sample(&Sample { length, width, fill, radii, density: 2500.0, material: 0, seed: 7, spacing: 1.0 }).unwrap();
    let mut engine = CpuEngine::new(setup, &grains, threads).unwrap();
    engine.set_isa(isa).unwrap();
    engine
}

fn run(engine: &mut CpuEngine) {
    engine.advance(1500, &mut []).unwrap();
    let top = Surface::of(engine.state(), 0.5, 0.14).mean();
    let wheel = Cylinder::new(0.08, 0.06, [0.0, 0.0, top + 0.085], [0.0, 1.0, 0.0], [0.5, 0.0, -0.4], [0.0; 3]);
    engine.advance(700, &mut [Body::new(Box::new(wheel), 0)]).unwrap();
}

#[test]
fn stored_hashes_of_the_portable_path() {
    let mut wrong = Vec::new();
    for bed in beds() {
        for threads in [1, 2] {
            let mut e = engine(&bed, Isa::Portable, threads);
            run(&mut e);
            assert!(e.state().rebuilds > 5 && e.state().boundary_contacts() > 50, "{}", bed.name);
            if e.state().hash() != bed.hash {
                wrong.push(format!("{}, {threads} threads: 0x{:016x}", bed.name, e.state().hash()));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn wider_paths_stay_close_to_the_portable_one() {
    for bed in beds() {
        let at = |isa: Isa| {
            let mut e = engine(&bed, isa, 1);
            e.advance(1500, &mut []).unwrap();
            let s = e.state();
            s.by_id().iter().map(|&i| s.rows[i as usize]).collect::<Vec<_>>()
        };
        let portable = at(Isa::Portable);
        for isa in Isa::ALL.into_iter().filter(|i| i.runs_here() && *i != Isa::Portable) {
            let far = portable.iter().zip(at(isa)).flat_map(|(a, b)| [0, 1, 2].map(|c| (a[c] - b[c]).abs()));
            let far = far.fold(0.0_f64, f64::max);
            println!("{}, {isa}: positions differ by {far:.1e} m at most after 1500 steps", bed.name);
            assert!(far < 1e-6, "{}, {isa}: {far}", bed.name);
        }
    }
}
