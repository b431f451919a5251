//! Validation 2.8: a settled bed carries its weight, and nothing drifts.

#[path = "common/checks.rs"]
mod checks;

use checks::{below, relative};
use fmu_terrain::dem::kernel::Partner;
use fmu_terrain::dem::{
    Adhesion, BedReport, CpuEngine, Fill, GrainEngine, Material, Radii, Recipe, Sample, Settle, Setup, Wall, prepare,
    vec3,
};

const G: f64 = 9.81;
const RADIUS: f64 = 0.012;

/// r 12 mm, E 1e7, 0.3 m deep, frictionless side walls. With rolling and spinning resistance: without, caged grains
/// that nothing presses roll to and fro for ever.
fn bed(pressure: f64, [length, width]: [f64; 2], calm: f64) -> (CpuEngine, BedReport) {
    let adhesion = Adhesion { pressure, ..Adhesion::default() };
    let soil = Material {
        young_modulus: 1e7,
        rolling_friction: 0.1,
        spinning_friction: 0.05,
        adhesion,
        ..Material::default()
    };
    let side = Material { friction: 0.0, adhesion: Adhesion::default(), ..soil };
    let setup = Setup {
        materials: vec![soil, side],
        walls: Wall::open_box(length, width, 0, 1),
        step: 1e-4,
        expected_overlap: 0.2,
        ..Setup::default()
    };
    let sample = Sample {
        length,
        width,
        fill: Fill::Depth(0.3),
        radii: Radii::Equal(RADIUS),
        density: 2500.0,
        material: 0,
        seed: 2,
        spacing: 1.05,
    };
    prepare(setup, &Recipe::new(sample, Settle { energy: calm, ..Settle::default() }, 0.2), 1, &mut |_, _| true)
        .unwrap()
}

/// Vertical force carried across the horizontal plane at `z` by contacts between grains, the floor aside.
fn carried(engine: &CpuEngine, z: f64) -> f64 {
    let mut force = 0.0;
    let height = |i: usize| engine.state().rows[i][2];
    engine.observe(&[], &mut |i, partner, c| match partner {
        Partner::Grain(j) if (height(i) > z) != (height(j) > z) => {
            force += if height(i) > z { c.force[2] } else { -c.force[2] };
        }
        _ => {}
    });
    force
}

/// Rows by grain number: a rebuild reorders them.
fn by_id(engine: &CpuEngine) -> Vec<[f64; 3]> {
    let row = |&i: &u32| engine.state().rows[i as usize];
    engine.state().by_id().iter().map(row).map(|r| [r[0], r[1], r[2]]).collect()
}

/// The longest way from one to the other.
fn moved(a: &[[f64; 3]], b: &[[f64; 3]]) -> f64 {
    a.iter().zip(b).map(|(&a, &b)| vec3::norm(vec3::sub(a, b))).fold(0.0, f64::max)
}

/// Largest kinetic energy (J), and largest distance (m) of a grain from its place at the beginning.
fn watch(engine: &mut CpuEngine, steps: u32) -> (f64, f64) {
    const LOOK: u32 = 50;
    let start = by_id(engine);
    (0..steps / LOOK).fold((0.0, 0.0), |(energy, way): (f64, f64), _| {
        engine.advance(LOOK, &mut []).unwrap();
        (energy.max(engine.state().kinetic_energy()), way.max(moved(&start, &by_id(engine))))
    })
}

/// `calm`: kinetic energy per grain over m g r at which the watch begins; `third`: steps of a third of it;
/// `drift`: way allowed in the last third, in radii.
fn rests(name: &str, pressure: f64, footprint: [f64; 2], calm: f64, third: u32, drift: f64) -> BedReport {
    let case = format!("2.8 {name}");
    let (mut engine, report) = bed(pressure, footprint, calm);
    println!("{report:?}");
    relative(&case, "height before cohesion", "m", 0.3, report.height - report.cohesion_change, 0.05);

    // Kinetic energy decays and stays: the largest of a third, since a swing passes still moments, whose depth and
    // time are left to round-off. Nothing drifts: the way of every grain within a third.
    let thirds = [(); 3].map(|()| watch(&mut engine, third));
    println!("largest kinetic energy (J) and way (m) in each third: {thirds:?}");
    let quantity = "largest kinetic energy of the last third over that of the first";
    below(&case, quantity, "1", thirds[2].0 / thirds[0].0, 0.1);
    below(&case, "largest way of a grain in the first third", "m", thirds[0].1, 0.5 * RADIUS);
    below(&case, "largest way of a grain in the last third", "m", thirds[2].1, drift * RADIUS);

    let weight = engine.state().mass() * G;
    relative(&case, "force on the floor", "N", weight, -engine.state().wall_force[0][2], 1e-3);
    // sigma_z = gamma z: what is carried across a plane is the weight above it.
    for z in [0.05, 0.15, 0.25] {
        let above: f64 = engine.state().rows.iter().filter(|r| r[2] > z).map(|r| G / r[7]).sum();
        relative(&case, &format!("carried at {z} m"), "N", above, carried(&engine, z), 2e-3);
    }
    report
}

#[test]
fn case_2_8_without_cohesion() {
    rests("no cohesion", 0.0, [0.15, 0.12], 1e-5, 5000, 0.01);
}

#[test]
fn case_2_8_with_10_kpa() {
    rests("10 kPa", 1e4, [0.15, 0.12], 1e-5, 5000, 0.01);
}

#[test]
fn case_2_8_with_100_kpa_the_bed_contracts() {
    // Contracted, it stands clear of the walls and sways as a block, which dies slowly; more so the slimmer it is.
    // The way holds what is left of the sway, whose amplitude round-off may make several times larger.
    let report = rests("100 kPa", 1e5, [0.2, 0.15], 1e-4, 25_000, 0.03);
    // The overlap of each contact grows by 1.3 to 1.9 mm, some 25 contacts deep.
    println!("VALIDATION|2.8 100 kPa|height change by cohesion|m||{:.5}|reported", report.cohesion_change);
    assert!(report.cohesion_change < -0.005, "{}", report.cohesion_change);
}
