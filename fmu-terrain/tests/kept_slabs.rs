//! A rebuild keeps the slabs whose grains have hardly moved: no contact is missed, and neither threads nor a saved state change a bit.

use fmu_terrain::dem::grains::X0;
use fmu_terrain::dem::{
    Body, CpuEngine, Cylinder, Fill, GrainEngine, Material, Radii, Recipe, Sample, Settle, Setup, Surface, Wall,
    prepare,
};
use std::collections::BTreeSet;

const LENGTH: f64 = 1.6;
const WIDTH: f64 = 0.3;

fn setup() -> Setup {
    Setup { materials: vec![Material::default()], walls: Wall::open_box(LENGTH, WIDTH, 0, 0), ..Setup::default() }
}

/// Touching pairs by grain numbers, looked for without lists.
fn touching(bed: &CpuEngine) -> BTreeSet<(u32, u32)> {
    let state = bed.state();
    let mut order: Vec<usize> = (0..state.rows.len()).collect();
    order.sort_by(|&a, &b| state.rows[a][0].total_cmp(&state.rows[b][0]));
    let mut pairs = BTreeSet::new();
    for (k, &i) in order.iter().enumerate() {
        let a = &state.rows[i];
        for &j in order[k + 1..].iter().take_while(|&&j| state.rows[j][0] - a[0] < 0.026) {
            let b = &state.rows[j];
            let d2: f64 = (0..3).map(|c| (a[c] - b[c]).powi(2)).sum();
            if d2 < (a[3] + b[3]).powi(2) {
                let (one, two) = (state.ids[i], state.ids[j]);
                pairs.insert((one.min(two), one.max(two)));
            }
        }
    }
    pairs
}

/// Touching pairs that the lists hold.
fn listed(bed: &CpuEngine) -> BTreeSet<(u32, u32)> {
    let state = bed.state();
    let pairs = state.slabs.iter().flat_map(|s| s.owner.iter().zip(&s.other));
    pairs
        .filter(|(i, j)| {
            let (a, b) = (&state.rows[**i as usize], &state.rows[**j as usize]);
            (0..3).map(|c| (a[c] - b[c]).powi(2)).sum::<f64>() < (a[3] + b[3]).powi(2)
        })
        .map(|(i, j)| [state.ids[*i as usize], state.ids[*j as usize]])
        .map(|[a, b]| (a.min(b), a.max(b)))
        .collect()
}

/// A wheel that ploughs at one end.
fn advance(bed: &mut CpuEngine, height: f64, step: u32) {
    let t = f64::from(step) * 4e-5;
    let centre = [-0.5 + 2.0 * t, 0.0, height + 0.2 - 0.5 * t];
    let wheel = Cylinder::new(0.2, 0.15, centre, [0.0, 1.0, 0.0], [2.0, 0.0, -0.5], [0.0, 20.0, 0.0]);
    bed.advance(25, &mut [Body::new(Box::new(wheel), 0)]).unwrap();
}

#[test]
fn no_contact_is_missed_and_the_bits_are_the_same() {
    let sample = Sample {
        length: LENGTH,
        width: WIDTH,
        fill: Fill::Count(7000),
        radii: Radii::Uniform(0.011, 0.013),
        density: 2500.0,
        material: 0,
        seed: 5,
        spacing: 1.0,
    };
    let settle = Settle { energy: 1e-3, least_time: 0.1, most_time: 2.0 };
    let (mut bed, _) = prepare(setup(), &Recipe::new(sample, settle, 0.0), 2, &mut |_, _| true).unwrap();
    let height = Surface::of(bed.state(), LENGTH, WIDTH).mean();
    let mut twin = CpuEngine::with_state(setup(), bed.state().clone(), 3).unwrap();
    let (mut kept, mut anew) = (0, 0);
    for k in 0..60 {
        let before: Vec<[f64; 3]> = bed.state().rows.iter().map(|r| [r[X0], r[X0 + 1], r[X0 + 2]]).collect();
        let rebuilds = bed.state().rebuilds;
        advance(&mut bed, height, 25 * k);
        advance(&mut twin, height, 25 * k);
        assert_eq!(bed.state().hash(), twin.state().hash(), "{k}");
        assert_eq!(listed(&bed), touching(&bed), "{k}");
        if bed.state().rebuilds > rebuilds {
            let same = bed.state().rows.iter().zip(&before).filter(|(r, x)| r[X0..X0 + 3] == x[..]).count();
            kept += same;
            anew += before.len() - same;
        }
        if k == 20 {
            twin = CpuEngine::with_state(setup(), bed.state().clone(), 1).unwrap();
        }
    }
    println!("{} rebuilds, grains kept {kept}, listed anew {anew}", bed.state().rebuilds);
    assert!(2 * kept > anew && anew > 0, "{kept} {anew}");
}
