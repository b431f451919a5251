//! Solvers against conditions that hold at the solution, and against each other.

use super::*;

/// A random heap in a corner: balls of two sizes, gaps small or negative, thrown about.
fn heap(count: usize, rolling: bool) -> (Problem, Impulses) {
    let mut seed = 12345_u64;
    let mut noise = move || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    let mut p = Problem { classes: vec![Class { friction: 0.6, rolling: 0.1, spinning: 0.05 }], ..Problem::default() };
    let side = (count as f64).cbrt().ceil() as usize;
    let mut x = Vec::new();
    for i in 0..count {
        let at = [i / (side * side), i / side % side, i % side];
        x.push(at.map(|k| k as f64 * 1.02 + 0.1 * noise()));
        let r = if i.is_multiple_of(3) { 0.5 } else { 0.48 };
        let m = 8.0 * r * r * r;
        p.bodies.push([noise(), noise(), -1.0 + noise(), 1.0 / m, noise(), noise(), noise(), 2.5 / m]);
    }
    p.movable = count;
    let radius = |i: usize| if i.is_multiple_of(3) { 0.5 } else { 0.48 };
    // The floor does not move.
    p.bodies.push([0.0; 8]);
    let layer = side * side;
    let blocks = count.div_ceil(layer);
    for block in 0..blocks {
        let (first, last) = (block * layer, ((block + 1) * layer).min(count));
        p.blocks.push(Block { contact: p.a.len(), first, last, end: (last + layer).min(count) });
        for i in first..last {
            let mut add = |b: usize, n: Vec3, gap: f64, lever: [f64; 2]| {
                p.a.push(i as u32);
                p.b.push(b as u32);
                p.frame.push([n[0], n[1], n[2], (gap / 0.05).max(-0.5)]);
                p.class.push(0);
                if rolling {
                    p.lever.push(lever);
                }
            };
            for j in i + 1..(last + layer).min(count) {
                let d: Vec3 = std::array::from_fn(|c| x[i][c] - x[j][c]);
                let l = (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt();
                let (ri, rj) = (radius(i), radius(j));
                if l < ri + rj + 0.06 {
                    add(j, d.map(|c| c / l), l - ri - rj, [rj / (ri + rj), ri / (ri + rj)]);
                }
            }
            if i.is_multiple_of(side) {
                add(count, [0.0, 0.0, 1.0], x[i][2] - radius(i) + 0.5, [1.0, 1.0]);
            }
        }
    }
    let n = p.contacts();
    let couple = if rolling { vec![[0.0; 3]; n] } else { Vec::new() };
    (p, Impulses { force: vec![[0.0; 3]; n], couple })
}

fn dot(a: Vec3, b: Vec3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Largest violations of: g in its cone, u_n - mu |u_t| >= 0, g . u = 0 (the last over the sum of |g| |u|).
fn violations(p: &Problem, g: &Impulses) -> [f64; 3] {
    let mut worst = [0.0_f64; 3];
    let (mut product, mut size) = (0.0, 1e-30);
    for k in 0..p.contacts() {
        let slip = sweep::contact::<false>(p, &p.bodies, k).with_compliance(p, k, g.force[k], [0.0; 3]);
        let part = |x: Vec3| {
            let n = dot(x, slip.n);
            (n, (dot(x, x) - n * n).max(0.0).sqrt())
        };
        let ((gn, gt), (un, ut)) = (part(g.force[k]), part(slip.u));
        let c = p.cohesion.get(k).copied().unwrap_or(0.0);
        worst[0] = worst[0].max(gt - 0.6 * (gn + c)).max(-(gn + c));
        worst[1] = worst[1].max(0.6 * ut - un);
        product += (gn + c) * un + dot(g.force[k], slip.u) - gn * un;
        size += (gn + c + gt) * (un.abs() + ut);
    }
    worst[2] = (product / size).abs();
    worst
}

const ALL: [Method; 4] = [Method::Relaxation, Method::Nesterov, Method::BarzilaiBorwein, Method::GaussSeidel];

#[test]
fn case_3_4_the_conditions_hold_at_the_solution() {
    for method in ALL {
        let (mut p, mut g) = heap(200, false);
        let options = Options { method, tolerance: 1e-9, iterations: 20_000, ..Options::default() };
        let outcome = solve(&mut p, &mut g, &mut Memory::default(), &options);
        assert!(outcome.converged, "{method:?}: {outcome:?}");
        let [cone, dual, product] = violations(&p, &g);
        for (quantity, unit, x, limit) in [
            ("distance outside the cone", "N s", cone, 1e-12),
            ("friction times tangential slip less normal slip", "m/s", dual, 2e-8),
            ("product of impulses and slips over that of their sizes", "1", product, 1e-7),
        ] {
            println!("\nVALIDATION|3.4 {method:?}|{quantity}|{unit}|0|{x:.3e}|{limit:.1e}");
        }
        assert!(cone < 1e-12 && dual < 2e-8 && product < 1e-7, "{method:?}: {cone:e} {dual:e} {product:e}");
    }
}

#[test]
fn all_methods_find_the_same_velocities() {
    for rolling in [false, true] {
        let mut found: Vec<(Vec<Row>, f64)> = Vec::new();
        for method in ALL {
            let (mut p, mut g) = heap(120, rolling);
            p.compliance = vec![0.01; p.contacts()];
            p.bias = (0..p.contacts()).map(|k| [0.01 * (k % 5) as f64, 0.0, -0.02]).collect();
            if rolling {
                p.couple_compliance = vec![0.1; p.contacts()];
                p.couple_bias = (0..p.contacts()).map(|k| [0.0, 0.01 * (k % 3) as f64, 0.0]).collect();
            }
            p.cohesion = vec![0.002; p.contacts()];
            let options = Options { method, tolerance: 1e-10, iterations: 50_000, ..Options::default() };
            let outcome = solve(&mut p, &mut g, &mut Memory::default(), &options);
            assert!(outcome.converged, "{method:?}, rolling {rolling}: {outcome:?}");
            found.push((p.bodies, outcome.objective));
        }
        for (bodies, objective) in &found[1..] {
            assert!((objective - found[0].1).abs() < 1e-10 * found[0].1.abs());
            // Velocities are unique even where impulses are not.
            for (a, b) in bodies.iter().flatten().zip(found[0].0.iter().flatten()) {
                assert!((a - b).abs() < 1e-6, "rolling {rolling}: {a} {b}");
            }
        }
    }
}

#[test]
fn the_objective_kept_never_rises_and_the_residual_falls() {
    for method in ALL {
        let mut last = (f64::INFINITY, f64::INFINITY);
        for iterations in [0, 10, 20, 40, 80, 160, 320] {
            let (mut p, mut g) = heap(200, false);
            let options = Options { method, tolerance: 0.0, iterations, ..Options::default() };
            let o = solve(&mut p, &mut g, &mut Memory::default(), &options);
            assert!(
                o.objective <= last.0 && o.residual <= last.1,
                "{method:?} after {iterations}: {o:?}, before {last:?}"
            );
            last = (o.objective, o.residual);
        }
        assert!(last.1 < 1e-3, "{method:?}: {last:?}");
    }
}

#[test]
fn threads_change_no_bit_and_a_warm_start_is_the_end() {
    let (mut p, mut g) = heap(400, true);
    let (mut q, mut h) = (p.clone(), g.clone());
    let options = Options { tolerance: 1e-6, iterations: 5000, ..Options::default() };
    let one = solve(&mut p, &mut g, &mut Memory::default(), &options);
    let two = solve(&mut q, &mut h, &mut Memory::default(), &Options { parallel: true, ..options });
    assert_eq!((one, &g, &p.bodies), (two, &h, &q.bodies));
    let (mut again, _) = heap(400, true);
    let warm = solve(&mut again, &mut g, &mut Memory::default(), &options);
    assert_eq!(warm.iterations, 0, "{warm:?}");
}

#[test]
fn a_ball_on_the_floor_is_a_closed_form() {
    // Sliding at 2 m/s with mu .5 and an approach of 1 m/s: g_n from the relaxation, u_n = mu |u_t| after.
    let mut p = Problem {
        bodies: vec![[2.0, 0.0, -1.0, 0.5, 0.0, 0.0, 0.0, 1.25], [0.0; 8]],
        movable: 1,
        a: vec![0],
        b: vec![1],
        frame: vec![[0.0, 0.0, 1.0, 0.0]],
        class: vec![0],
        classes: vec![Class { friction: 0.5, ..Class::default() }],
        blocks: vec![Block { contact: 0, first: 0, last: 1, end: 1 }],
        ..Problem::default()
    };
    let mut g = Impulses { force: vec![[0.0; 3]], couple: vec![] };
    let options = Options { tolerance: 1e-12, iterations: 1000, ..Options::default() };
    assert!(solve(&mut p, &mut g, &mut Memory::default(), &options).converged);
    // g_t = mu g_n; u_n = -1 + g_n/2; u_t = 2 - 3.5 mu g_n/2; u_n = mu u_t.
    let gn = (1.0 + 0.5 * 2.0) / (0.5 + 0.25 * 1.75);
    assert!((g.force[0][2] - gn).abs() < 1e-9 && (g.force[0][0] + 0.5 * gn).abs() < 1e-9, "{:?} {gn}", g.force);
}
