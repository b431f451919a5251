//! A bed over the members of a team, as threads of one process: the same bits as of one engine, for any number of members.

use fmu_terrain::dem::spread::team_of_threads;
use fmu_terrain::dem::{
    Adhesion, Body, CpuEngine, Cylinder, DemError, DemState, Fill, Grain, GrainEngine, Material, Radii, Recipe, Sample,
    Settle, Setup, Sleep, Surface, Wall, prepare, sample,
};

const LENGTH: f64 = 2.4;
const WIDTH: f64 = 0.2;
const STEP: f64 = 4e-5;

fn setup(sleep: bool) -> Setup {
    let adhesion = Adhesion { pressure: 2e3, ..Adhesion::default() };
    let soil = Material { rolling_friction: 0.1, spinning_friction: 0.05, adhesion, ..Material::default() };
    let sleep = sleep.then_some(Sleep { distance: 0.3, energy: 1e-3 });
    Setup { materials: vec![soil], walls: Wall::open_box(LENGTH, WIDTH, 0, 0), sleep, step: STEP, ..Setup::default() }
}

fn grains() -> Sample {
    Sample {
        length: LENGTH,
        width: WIDTH,
        fill: Fill::Count(6000),
        radii: Radii::Uniform(0.011, 0.013),
        density: 2500.0,
        material: 0,
        seed: 7,
        spacing: 1.0,
    }
}

/// A settled bed.
fn bed() -> CpuEngine {
    let settle = Settle { energy: 1e-3, least_time: 0.1, most_time: 3.0 };
    prepare(setup(false), &Recipe::new(grains(), settle, 0.05), 2, &mut |_, _| true).unwrap().0
}

/// What a wheel that drives over all cuts sees and leaves: impulses on it, and hashes of the whole state, after each of `calls`.
fn drive(engine: &mut CpuEngine, height: f64, calls: std::ops::Range<u32>) -> (Vec<[f64; 3]>, Vec<u64>) {
    let (mut impulses, mut hashes) = (Vec::new(), Vec::new());
    for k in calls {
        let t = f64::from(k) * 50.0 * STEP;
        let centre = [-0.5 + 4.5 * t, 0.0, height + 0.2 - 0.2 * t];
        let wheel = Cylinder::new(0.2, 0.1, centre, [0.0, 1.0, 0.0], [4.5, 0.0, -0.2], [0.0, 30.0, 0.0]);
        let mut bodies = [Body::new(Box::new(wheel), 0)];
        engine.advance(50, &mut bodies).unwrap();
        impulses.push(bodies[0].impulse);
        if let Some(whole) = engine.gather().unwrap() {
            hashes.push(whole.hash());
        }
    }
    (impulses, hashes)
}

/// Does the same on all members and gives what the lead has.
fn on_members<T: Send>(size: usize, work: impl Fn(Box<dyn fmu_terrain::dem::spread::Links>) -> T + Sync) -> Vec<T> {
    let work = &work;
    std::thread::scope(|scope| {
        let members: Vec<_> = team_of_threads(size).into_iter().map(|links| scope.spawn(move || work(links))).collect();
        members.into_iter().map(|m| m.join().unwrap()).collect()
    })
}

#[test]
fn any_number_of_members_gives_the_bits_of_one_engine() {
    let bed = bed();
    let height = Surface::of(bed.state(), LENGTH, WIDTH).mean();
    for sleep in [false, true] {
        let mut alone = CpuEngine::with_state(setup(sleep), bed.state().clone(), 2).unwrap();
        let expected = drive(&mut alone, height, 0..40);
        assert!(alone.state().rebuilds > bed.state().rebuilds + 40, "whole rebuilds too");
        assert!(!sleep || alone.state().asleep() > 0.1);
        for size in [1, 2, 3, 4] {
            let told = on_members(size, |links| {
                let threads = 1 + links.index() % 2;
                let mut engine = CpuEngine::spread(setup(sleep), bed.state(), links, threads).unwrap();
                let driven = drive(&mut engine, height, 0..40);
                (driven, engine.state().rows.len())
            });
            assert_eq!(told[0].0.1, expected.1, "{size} members, sleep {sleep}");
            assert_eq!(told[0].0.0, expected.0, "{size} members, sleep {sleep}");
            assert_eq!(told.iter().map(|t| t.1).sum::<usize>(), bed.state().rows.len());
            // While soil sleeps, the cuts are where the wheel is.
            let counts: Vec<usize> = told.iter().map(|t| t.1).collect();
            let (least, most) = (counts.iter().min().unwrap(), counts.iter().max().unwrap());
            let even = bed.state().rows.len() / size;
            assert!(if sleep && size > 1 { *most > 21 * even / 20 } else { *least > even / 3 }, "{counts:?}");
        }
    }
}

#[test]
fn what_some_members_leave_others_go_on_with() {
    let bed = bed();
    let height = Surface::of(bed.state(), LENGTH, WIDTH).mean();
    let mut alone = CpuEngine::with_state(setup(true), bed.state().clone(), 2).unwrap();
    let expected = drive(&mut alone, height, 0..30);
    let part = |state: &DemState, size: usize, calls: std::ops::Range<u32>| -> (DemState, Vec<u64>) {
        let mut told = on_members(size, |links| {
            let mut engine = CpuEngine::spread(setup(true), state, links, 1).unwrap();
            let driven = drive(&mut engine, height, calls.clone());
            engine.gather().unwrap().map(|whole| (whole, driven.1))
        });
        told.swap_remove(0).unwrap()
    };
    let (one, a) = part(bed.state(), 3, 0..10);
    let (two, b) = part(&one, 4, 10..20);
    let mut shared = CpuEngine::with_state(setup(true), two, 1).unwrap();
    let (_, c) = drive(&mut shared, height, 20..30);
    let all = [a, b, c].concat();
    let differs = all.iter().zip(&expected.1).position(|(x, y)| x != y);
    assert_eq!((differs, all.len()), (None, expected.1.len()));
}

#[test]
fn grains_that_were_just_placed_fall_as_they_do_alone() {
    let grains: Vec<Grain> = sample(&grains()).unwrap();
    let mut alone = CpuEngine::new(setup(false), &grains, 2).unwrap();
    alone.advance(3000, &mut []).unwrap();
    let energy = alone.energy(&[]);
    for size in [2, 4] {
        let told = on_members(size, |links| {
            let state = DemState::of(&grains, 5);
            let mut engine = CpuEngine::spread(setup(false), &state, links, 1).unwrap();
            engine.advance(3000, &mut []).unwrap();
            let energy = engine.energy(&[]);
            let walls = engine.state().wall_force.clone();
            (engine.gather().unwrap().map(|s| s.hash()), energy, walls)
        });
        assert_eq!(told[0].0, Some(alone.state().hash()), "{size}");
        assert!(told.iter().all(|t| t.1.to_bits() == energy.to_bits()), "{energy} {:?}", told[0].1);
        assert_eq!(told[0].2, alone.state().wall_force);
    }
}

#[test]
fn kinds_of_grains_that_lie_apart_meet_as_they_do_alone() {
    let hard = Material { friction: 0.9, restitution: 0.1, ..Material::default() };
    let setup = || Setup { materials: vec![Material::default(), hard], ..setup(false) };
    let mut grains: Vec<Grain> = sample(&grains()).unwrap();
    for g in &mut grains {
        g.material = usize::from(g.position[0] > 0.0);
    }
    let mut alone = CpuEngine::new(setup(), &grains, 2).unwrap();
    alone.advance(2000, &mut []).unwrap();
    // Of two members each has its own kind, and both meet at the cut.
    for size in [2, 3] {
        let told = on_members(size, |links| {
            let mut engine = CpuEngine::spread(setup(), &DemState::of(&grains, 5), links, 1).unwrap();
            engine.advance(2000, &mut []).unwrap();
            engine.gather().unwrap().map(|s| s.hash())
        });
        assert_eq!(told[0], Some(alone.state().hash()), "{size}");
    }
}

#[test]
fn a_failure_of_one_member_is_told_to_all() {
    let mut grains: Vec<Grain> = sample(&grains()).unwrap();
    // Far up, and fast enough to go through the floor in a step or two.
    grains[5].velocity = [0.0, 0.0, -4000.0];
    let told = on_members(3, |links| {
        let mut engine = CpuEngine::spread(setup(false), &DemState::of(&grains, 5), links, 1).unwrap();
        engine.advance(500, &mut []).unwrap_err()
    });
    let own = told.iter().filter(|e| !matches!(e, DemError::Elsewhere(_))).count();
    assert!((1..3).contains(&own), "{told:?}");
}

#[test]
fn what_one_member_has_found_wrong_all_are_told() {
    let bed: Vec<Grain> = sample(&grains()).unwrap();
    let told = on_members(3, |links| {
        let me = links.index();
        let mut engine = CpuEngine::spread(setup(false), &DemState::of(&bed, 5), links, 1).unwrap();
        engine.agree(Ok(())).unwrap();
        let wrong = if me == 1 { Err(DemError::Elsewhere("its mesh is missing".into())) } else { Ok(()) };
        engine.agree(wrong).unwrap_err().to_string()
    });
    assert!(told.iter().all(|t| t == "its mesh is missing"), "{told:?}");
}

#[test]
fn a_box_that_follows_is_not_spread() {
    let setup = Setup { follow: Some(0.5), ..setup(false) };
    let told = on_members(2, |links| CpuEngine::spread(setup.clone(), &DemState::of(&[], 5), links, 1).err());
    assert!(told.iter().all(|e| matches!(e, Some(DemError::Parameter { .. }))), "{told:?}");
}
