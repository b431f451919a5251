//! A deforming ball drawn through a long bed that sleeps.

use crate::terrain::Terrain;

const LONG: &str = r#"{"soil": {"radius": {"uniform": {"least": 0.0055, "greatest": 0.0065}}, "rolling_friction": 0.1, "young_modulus": 1e7},
    "bed": {"length": 2.0, "width": 0.1, "fill": {"depth": 0.03}}, "dem_p": {"sleep": {"distance": 0.1}}}"#;

/// The bed.
pub fn long_bed() -> Terrain {
    Terrain::of(fmu_terrain::dem_p::model(), LONG)
}

/// A ball of so many vertices (6, 18, 66, 258, ...) and radius (m): vertices and triangles.
fn ball(splits: u32, radius: f64) -> (Vec<[f64; 3]>, Vec<[usize; 3]>) {
    let mut points =
        vec![[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, -1.0]];
    let mut faces = vec![[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]];
    for _ in 0..splits {
        let mut middles = std::collections::BTreeMap::new();
        let mut halves = Vec::new();
        for [a, b, c] in faces {
            let [ab, bc, ca] = [(a, b), (b, c), (c, a)].map(|(a, b): (usize, usize)| {
                *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                    let sum: [f64; 3] = std::array::from_fn(|k| points[a][k] + points[b][k]);
                    let length = sum.iter().map(|x| x * x).sum::<f64>().sqrt();
                    points.push(sum.map(|x| x / length));
                    points.len() - 1
                })
            });
            halves.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        faces = halves;
    }
    (points.into_iter().map(|p| p.map(|x| x * radius)).collect(), faces)
}

/// A deforming ball is pressed into the near end of the bed and drawn along it, from the beginning or from a state saved in the middle: bits of the forces on its vertices and of where the
/// grains are in the end, and a state saved in the middle. `begins` is called before the first step.
pub fn plough(mut t: Terrain, saved: Option<&[u8]>, begins: &dyn Fn()) -> (Vec<u64>, Vec<u8>) {
    const STEP: f64 = 5e-5;
    let (points, faces) = ball(3, 0.04);
    let triangles: Vec<i32> = faces.iter().flatten().map(|&k| k as i32).collect();
    let place = |t: &mut Terrain, height: f64, k: usize| {
        let time = k as f64 * STEP;
        let at = [-0.62 + 3.0 * time, 0.0, height + 0.039 - 0.1 * time];
        let swell = 1.0 + 0.5 * time;
        t.xyz("body[1].position", at);
        t.put(
            "body[1].position",
            &points.iter().flat_map(|p| [0, 1, 2].map(|c| at[c] + swell * p[c])).collect::<Vec<_>>(),
        );
        let velocity = [3.0, 0.0, -0.1];
        t.put(
            "body[1].velocity",
            &points.iter().flat_map(|p| [0, 1, 2].map(|c| velocity[c] + 0.5 * p[c])).collect::<Vec<_>>(),
        );
        let vr = t.vr("body[1].triangle");
        t.0.set_integer_array(vr, &triangles).unwrap();
    };
    let mut from = 0;
    if let Some(saved) = saved {
        t.0.restore(saved).unwrap();
        from = 300;
    } else {
        t.string("body[1].shape", "mesh");
        t.begin().unwrap();
        let height = t.get("height");
        place(&mut t, height, 0);
        t.0.exit_initialization().unwrap();
    }
    let height = t.get("height");
    begins();
    let (mut seen, mut middle) = (Vec::new(), Vec::new());
    for k in from..600 {
        if k == 300 {
            middle = t.0.save().unwrap();
        }
        place(&mut t, height, k);
        t.advance(k, STEP).unwrap();
        if k >= 300 {
            seen.extend(t.array("body[1].contact.force"));
            seen.extend(t.get_xyz("body[1].moment"));
        }
    }
    seen.extend(t.array("grain.position"));
    (seen.iter().map(|x| x.to_bits()).collect(), middle)
}
