//! Validation case 2.9, geometry: where and how deep a sphere touches a triangle mesh.

#[path = "common/surfaces.rs"]
mod surfaces;

use fmu_terrain::dem::vec3::{Vec3, add, add_scaled, dot, norm, scale, sub};
use fmu_terrain::mesh::{ContactScratch, FacetGrid, MeshBody, MeshContact};
use surfaces::{Noise, folded, sheet};
use terramech_mechanics::{RigidState, TriangleMesh, cylinder::Cylinder};

fn bodied(mesh: &TriangleMesh) -> (MeshBody, Vec<u32>) {
    (MeshBody::deforming(mesh).unwrap(), (0..mesh.triangles.len() as u32).collect())
}

/// Hertz-like force of all contacts: sum of weight x overlap^1.5, in units of `of`^1.5.
fn force(contacts: &[MeshContact], of: f64) -> Vec3 {
    contacts.iter().fold([0.0; 3], |f, k| add_scaled(f, k.weight * (k.overlap / of).powf(1.5), k.normal))
}

const R: f64 = 0.01;

#[test]
fn a_plate_of_triangles_is_the_plane() {
    // 20 x 30 x 2 = 1,200 triangles, in a tilted plane.
    let (u, v) = ([0.8, 0.0, 0.6], [0.0, 1.0, 0.0]);
    let normal = [-0.6, 0.0, 0.8];
    let o = [3.0, -2.0, 1.0];
    let mesh = sheet(20, 30, |s, t| add_scaled(add_scaled(o, 0.2 * s, u), 0.3 * t, v));
    assert_eq!(mesh.triangles.len(), 1200);
    let (mut body, _) = bodied(&mesh);
    let mut grid = FacetGrid::default();
    grid.refit(&mut body);
    let mut scratch = ContactScratch::default();
    let mut noise = Noise(1);
    let mut found = Vec::new();
    for k in 0..3000 {
        // On vertices, edges (straight and diagonal), faces; and within round-off of them.
        let (i, j) = ((noise.next() * 9.0).round(), (noise.next() * 14.0).round());
        let (a, b) = match k % 6 {
            0 => (0.0, 0.0),
            1 => (noise.next(), 0.0),
            2 => (0.5, 0.5),
            3 => (1e-12 * noise.next(), 1e-9 * noise.next()),
            4 => (1e-5 * noise.next(), 1e-6 * noise.next()),
            _ => (noise.next(), noise.next()),
        };
        let depth = R * 10f64.powf(-2.5 + 1.5 * noise.next());
        let foot = add_scaled(add_scaled(o, 0.02 * (i + a), u), 0.02 * (j + b), v);
        found.clear();
        let c = add_scaled(foot, R - depth, normal);
        grid.near(c, R, &mut found);
        let contacts = body.contacts(c, R, &found, &mut scratch);
        let total: f64 = contacts.iter().map(|k| k.weight).sum();
        assert!((total - 1.0).abs() < 1e-12, "{k}: {contacts:?}");
        assert!((contacts.iter().map(|k| k.share).sum::<f64>() - 1.0).abs() < 1e-12);
        for contact in contacts {
            assert!((contact.overlap / depth - 1.0).abs() < 1e-9, "{k}: {contact:?}");
            assert!(norm(sub(contact.normal, normal)) < 1e-6, "{k}: {contact:?}");
        }
        assert!(norm(sub(force(contacts, depth), normal)) < 1e-6, "{k}: {contacts:?}");
    }
}

#[test]
fn across_a_fold_the_force_of_a_given_overlap_is_that_of_the_plate() {
    let mut scratch = ContactScratch::default();
    for degrees in [-30.0f64, -5.0, -1.0, -0.1, 0.1, 1.0, 5.0, 10.0] {
        let (sin, cos) = (0.5 * degrees.to_radians()).sin_cos();
        let (body, all) = bodied(&folded(degrees.to_radians()));
        for overlap in [1e-4 * R, 1e-3 * R, 1e-2 * R, 5e-2 * R] {
            let d = R - overlap;
            for k in -400..=400 {
                let x = 2.5e-5 * f64::from(k);
                // The curve at distance d from the surface: lines, and an arc about a convex edge.
                let z = if x.abs() <= -d * sin { (d * d - x * x).sqrt() } else { (x.abs() * sin + d) / cos };
                let contacts = body.contacts([x, 0.0037, z], R, &all, &mut scratch);
                let size = norm(force(contacts, overlap));
                // A group pulls with |sum w n| of its deepest contact: 1 - cos(fold/2) less at most.
                let least = (0.5 * degrees.max(0.0).to_radians()).cos();
                assert!(size > least - 1e-9 && size < 1.0 + 1e-9, "{degrees} deg, overlap {overlap}, x {x}: {size}");
            }
        }
    }
}

/// Bisects an interval of a path to where the force changes most: what is left is the jump.
fn jump(mut at: impl FnMut(f64) -> Vec3, steps: usize) -> f64 {
    let values: Vec<Vec3> = (0..=steps).map(|k| at(k as f64 / steps as f64)).collect();
    let mut order: Vec<usize> = (0..steps).collect();
    let change = |k: &usize| norm(sub(values[k + 1], values[*k]));
    order.sort_by(|a, b| change(b).total_cmp(&change(a)));
    let mut worst = 0.0f64;
    for &k in order.iter().take(8) {
        let (mut a, mut b) = (k as f64 / steps as f64, (k + 1) as f64 / steps as f64);
        let (mut fa, mut fb) = (values[k], values[k + 1]);
        for _ in 0..36 {
            let middle = 0.5 * (a + b);
            let f = at(middle);
            if norm(sub(f, fa)) > norm(sub(fb, f)) {
                (b, fb) = (middle, f);
            } else {
                (a, fa) = (middle, f);
            }
        }
        worst = worst.max(norm(sub(fb, fa)));
    }
    worst
}

#[test]
fn the_force_is_continuous_as_grains_move_over_any_surface() {
    let mut noise = Noise(5);
    let mut scratch = ContactScratch::default();
    let mut several = 0;
    for k in 0..60 {
        // Bumpy sheets: folds of about 1, 5, 15 and 45 degrees, cells larger and smaller than the grain.
        let rough = [0.01, 0.05, 0.15, 0.5][k % 4];
        let cell = [0.3, 1.0, 3.0][k % 3] * R;
        let mut mesh = sheet(12, 12, |s, t| [6.0 * cell * s, 6.0 * cell * t, 0.0]);
        for p in &mut mesh.vertices {
            *p = add(*p, scale(rough * cell, noise.vector()));
        }
        let (body, all) = bodied(&mesh);
        let (from, to) = (scale(cell, noise.vector()), scale(4.0 * cell, noise.vector()));
        let height = R * (1.0 - [1e-3, 1e-2, 5e-2][(k / 4) % 3]) + 0.3 * rough * cell;
        let deep = 0.05 * R;
        let found = jump(
            |s| {
                let c = [from[0] + s * to[0], from[1] + s * to[1], height];
                let contacts = body.contacts(c, R, &all, &mut scratch);
                several = several.max(contacts.len());
                force(contacts, deep)
            },
            2000,
        );
        assert!(found < 1e-5, "sheet {k}: the force jumps by {found}");
    }
    assert!(several >= 3, "the test meets no corner");
}

#[test]
fn the_force_is_continuous_as_a_plate_folds() {
    let mut scratch = ContactScratch::default();
    for x in [0.0, 1e-5, 1e-4, 1e-3, 3e-3] {
        for overlap in [1e-3 * R, 1e-2 * R, 5e-2 * R] {
            let (mut body, all) = bodied(&folded(0.0));
            let n = body.positions().len();
            let found = jump(
                |s| {
                    let mesh = folded((80.0 * s - 40.0f64).to_radians());
                    body.set_vertices(&mesh.vertices.concat(), &vec![0.0; 3 * n]).unwrap();
                    force(body.contacts([x, 0.0037, R - overlap], R, &all, &mut scratch), overlap)
                },
                4000,
            );
            assert!(found < 1e-5, "x {x}, overlap {overlap}: the force jumps by {found}");
        }
    }
}

#[test]
fn a_sharp_valley_is_two_contacts_and_a_corner_three() {
    let mut scratch = ContactScratch::default();
    for degrees in [31.0f64, 45.0, 90.0] {
        let half = (0.5 * degrees).to_radians();
        let (body, all) = bodied(&folded(2.0 * half));
        let overlap = 1e-3 * R;
        let contacts = body.contacts([0.0, 0.0037, (R - overlap) / half.cos()], R, &all, &mut scratch);
        assert_eq!(contacts.len(), 2, "{degrees}");
        for k in contacts {
            assert!((k.weight - 1.0).abs() < 1e-12 && (k.overlap / overlap - 1.0).abs() < 1e-9);
            assert!((k.normal[2] - half.cos()).abs() < 1e-12 && (k.share - 0.5).abs() < 1e-12);
        }
    }
    // The inside of a box, wound inward: an open shell of three faces that meet at the origin.
    let mut room = TriangleMesh::default();
    room.vertices.extend([
        [0.0; 3],
        [1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, 0.0, 1.0],
        [1.0, 1.0, 0.0],
        [0.0, 1.0, 1.0],
        [1.0, 0.0, 1.0],
    ]);
    room.triangles.extend([[0, 1, 4], [0, 4, 2], [0, 2, 5], [0, 5, 3], [0, 3, 6], [0, 6, 1]]);
    let (body, all) = bodied(&room);
    let contacts = body.contacts([0.0099, 0.0098, 0.0097], R, &all, &mut scratch);
    assert_eq!(contacts.len(), 3);
    let sum = contacts.iter().fold([0.0; 3], |s, k| add_scaled(s, k.weight * k.overlap, k.normal));
    assert!(norm(sub(sum, [1e-4, 2e-4, 3e-4])) < 1e-15);
}

fn box_mesh() -> TriangleMesh {
    TriangleMesh {
        vertices: (0..8).map(|k| [k & 1, k >> 1 & 1, k >> 2 & 1].map(f64::from)).collect(),
        triangles: vec![
            [0, 2, 3],
            [0, 3, 1],
            [4, 5, 7],
            [4, 7, 6],
            [0, 1, 5],
            [0, 5, 4],
            [2, 6, 7],
            [2, 7, 3],
            [0, 4, 6],
            [0, 6, 2],
            [1, 3, 7],
            [1, 7, 5],
        ],
    }
}

#[test]
fn a_convex_box_touches_once_anywhere_and_pushes_out_what_got_in() {
    let (body, all) = bodied(&box_mesh());
    assert!(body.is_closed());
    let mut scratch = ContactScratch::default();
    let mut noise = Noise(9);
    for _ in 0..2000 {
        let c = noise.vector().map(|x| 0.5 + 0.52 * x);
        let r = 0.05;
        let contacts = body.contacts(c, r, &all, &mut scratch);
        // The signed distance of a box, in closed form.
        let q = c.map(|x| (x - 0.5).abs() - 0.5);
        let outside = norm(q.map(|x| x.max(0.0)));
        let distance = outside + q[0].max(q[1]).max(q[2]).min(0.0);
        if distance >= r || distance <= -r {
            assert!(contacts.is_empty());
            continue;
        }
        assert_eq!(contacts.len(), 1, "{c:?}: {contacts:?}");
        let k = contacts[0];
        assert!((k.overlap - (r - distance)).abs() < 1e-14 && k.weight == 1.0);
        assert!((norm(k.normal) - 1.0).abs() < 1e-12);
        // Along the normal, the distance grows.
        let away = add_scaled(c, 1e-3, k.normal);
        let q = away.map(|x| (x - 0.5).abs() - 0.5);
        let further = norm(q.map(|x| x.max(0.0))) + q[0].max(q[1]).max(q[2]).min(0.0);
        assert!((further - distance - 1e-3).abs() < 1e-12);
    }
    // Right on a face, an edge, a corner: no direction, but a normal.
    for (c, normal) in [([0.4, 0.3, 1.0], [0.0, 0.0, 1.0]), ([0.4, 1.0, 1.0], [0.0, 1.0, 1.0]), ([1.0; 3], [1.0; 3])] {
        let k = body.contacts(c, 0.05, &all, &mut scratch)[0];
        assert!((dot(k.normal, normal) / norm(normal) - 1.0).abs() < 1e-12 && (k.overlap - 0.05).abs() < 1e-12);
    }
}

#[test]
fn the_grid_finds_what_brute_force_finds() {
    let mut noise = Noise(3);
    for round in 0..12 {
        // A wheel, rolling and sheared, or a soup of separate triangles of very different sizes.
        let mesh = if round % 2 == 0 {
            Cylinder::smooth(0.3, 0.2, 24 + round).mesh().unwrap()
        } else {
            let mut soup = TriangleMesh::default();
            for t in 0..60 {
                let (o, size) = (scale(0.4, noise.vector()), 0.2 * 10f64.powf(noise.next() - 0.5));
                soup.vertices.extend((0..3).map(|_| add_scaled(o, size, noise.vector())));
                soup.triangles.push([3 * t, 3 * t + 1, 3 * t + 2]);
            }
            soup
        };
        let (mut body, all) = bodied(&mesh);
        let mut grid = FacetGrid::default();
        grid.refit(&mut body);
        let velocity: Vec<f64> = (0..3 * body.positions().len()).map(|_| noise.next()).collect();
        body.set_vertices(&body.positions().concat(), &velocity).unwrap();
        body.move_to(0.01);
        let drift = body.drift();
        assert!(drift > 0.0 && drift < 0.018);
        let (mut one, mut two) = (ContactScratch::default(), ContactScratch::default());
        let (mut found, mut touching) = (Vec::new(), 0);
        for _ in 0..400 {
            let (c, r) = (scale(0.5, noise.vector()), 0.03 + 0.02 * noise.next());
            found.clear();
            grid.near(c, r + drift, &mut found);
            assert!(found.is_sorted_by(|a, b| a < b));
            let quick = body.contacts(c, r, &found, &mut one);
            assert_eq!(quick, body.contacts(c, r, &all, &mut two));
            touching += quick.len();
        }
        assert!(touching > 5, "round {round}: {touching}");
    }
}

#[test]
fn facets_in_another_order_give_the_same_force() {
    let mut noise = Noise(13);
    let mut mesh = sheet(8, 8, |s, t| [0.05 * s, 0.05 * t, 0.0]);
    for p in &mut mesh.vertices {
        p[2] = 0.002 * noise.next();
    }
    let (body, all) = bodied(&mesh);
    let mut turned = mesh.clone();
    turned.triangles.reverse();
    turned.triangles.iter_mut().for_each(|t| t.rotate_left(1));
    let (other, _) = bodied(&turned);
    let (mut one, mut two) = (ContactScratch::default(), ContactScratch::default());
    for _ in 0..500 {
        let c = [0.03 * noise.next(), 0.03 * noise.next(), 0.0095];
        let f = force(body.contacts(c, R, &all, &mut one), 1e-4);
        let g = force(other.contacts(c, R, &all, &mut two), 1e-4);
        assert!(norm(sub(f, g)) < 1e-9 * (1.0 + norm(f)));
    }
}

#[test]
fn contacts_move_with_the_mesh() {
    let state = RigidState {
        position: [0.2, 0.1, 0.5].into(),
        velocity: [0.7, 0.0, 0.0].into(),
        angular_velocity: [0.0, 3.0, 0.5].into(),
        ..RigidState::default()
    };
    let mesh = Cylinder::smooth(0.3, 0.2, 60).mesh().unwrap();
    let mut body = MeshBody::rigid(&mesh, state).unwrap();
    let all: Vec<u32> = (0..mesh.triangles.len() as u32).collect();
    body.move_to(0.02);
    let mut scratch = ContactScratch::default();
    let c = add(body.center(), [0.0, 0.0, -0.3 - 0.009]);
    let contacts = body.contacts(c, R, &all, &mut scratch);
    let now = state.advanced(0.02);
    for k in contacts {
        let v: Vec3 = now.velocity_at(&k.point.into()).into();
        assert!(norm(sub(k.velocity, v)) < 1e-13);
        assert!(k.normal[2] < -0.99);
    }
    assert_eq!(contacts.len(), 1);
}
