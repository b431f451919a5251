//! Closing the joints at the start, and finding constraints that say the same twice. Dense linear algebra: it runs once.

use super::factor::{InverseMass, backward, cholesky, forward};
use super::primitive::Drive;
use super::{MbsError, Motion, Pose, Primitive, System};
use terramech_mechanics::Vec3;

type Row = (Primitive, usize, usize);

/// Gap allowed after assembly (m or rad).
pub const TOLERANCE: f64 = 1e-11;
const ITERATIONS: usize = 60;

/// The largest gap and its index in `rows`.
pub(crate) fn largest(rows: &[Row], poses: &[Pose], drives: &[Drive]) -> (f64, usize) {
    let mut worst = (0.0, 0);
    let mut r = [0.0; 3];
    for (k, (p, a, b)) in rows.iter().enumerate() {
        p.residual(&poses[*a], &poses[*b], drives, &mut r);
        let gap = r[..p.rows()].iter().fold(0.0_f64, |m, x| if x.is_nan() { f64::INFINITY } else { m.max(x.abs()) });
        if gap > worst.0 {
            worst = (gap, k);
        }
    }
    worst
}

/// Dense Jacobian rows (6 columns a body, the ground's left out as zero) of all position constraints, with their index in `rows`.
fn dense(rows: &[Row], poses: &[Pose], drives: &[Drive], with_velocity: bool) -> Vec<(usize, usize, usize, [f64; 12])> {
    let mut out = Vec::new();
    for (k, (p, a, b)) in rows.iter().enumerate() {
        if p.of_velocity() && !with_velocity {
            continue;
        }
        let mut g = [[0.0; 12]; 3];
        p.jacobian(&poses[*a], &poses[*b], drives, &mut g);
        out.extend(g[..p.rows()].iter().map(|row| (k, *a, *b, *row)));
    }
    out
}

/// `g M^-1 h'` of two sparse rows.
fn product(g: &(usize, usize, usize, [f64; 12]), h: &(usize, usize, usize, [f64; 12]), inverse: &[InverseMass]) -> f64 {
    let mut sum = 0.0;
    for (body, part) in [(g.1, &g.3[..6]), (g.2, &g.3[6..])] {
        for (other, opart) in [(h.1, &h.3[..6]), (h.2, &h.3[6..])] {
            if body == other && body != 0 {
                let x = inverse[body].times(opart);
                sum += (0..6).map(|t| part[t] * x[t]).sum::<f64>();
            }
        }
    }
    sum
}

/// Newton on `g = 0`, moving heavy bodies least. Redundant rows that agree do no harm.
///
/// # Errors
/// [`MbsError::DoesNotClose`] names the joint with the largest gap.
pub(crate) fn close(
    rows: &[Row],
    joint_of: &[usize],
    joints: &[String],
    inverse: &[InverseMass],
    drives: &[Drive],
    motions: &mut [Motion],
) -> Result<(), MbsError> {
    let mut poses: Vec<Pose> = motions.iter().map(Motion::pose).collect();
    for iteration in 0..=ITERATIONS {
        let (gap, k) = largest(rows, &poses, drives);
        if gap <= TOLERANCE {
            return Ok(());
        }
        if iteration == ITERATIONS || !gap.is_finite() {
            // Round-off of a large mechanism far from the origin may end above the aim; 1e-9 is still closed.
            if gap <= 1e-9 {
                return Ok(());
            }
            return Err(MbsError::DoesNotClose {
                joint: joints[joint_of[k]].clone(),
                residual: gap,
                unit: rows[k].0.unit(),
                iterations: iteration,
                tolerance: 1e-9,
            });
        }
        let g = dense(rows, &poses, drives, false);
        let n = g.len();
        let mut s = vec![0.0; n * n];
        for i in 0..n {
            for j in i..n {
                s[i * n + j] = product(&g[i], &g[j], inverse);
            }
        }
        for i in 0..n {
            // Keeps the matrix regular where rows repeat each other.
            s[i * n + i] *= 1.0 + 1e-10;
            s[i * n + i] += 1e-14;
        }
        let mut inv = vec![0.0; n];
        if cholesky(&mut s, n, &mut inv).is_err() {
            return Err(MbsError::Singular { joint: joints[joint_of[k]].clone(), time: 0.0 });
        }
        let mut x = Vec::with_capacity(n);
        let mut r = [0.0; 3];
        for (p, a, b) in rows.iter().filter(|r| !r.0.of_velocity()) {
            p.residual(&poses[*a], &poses[*b], drives, &mut r);
            x.extend(r[..p.rows()].iter().map(|v| -v));
        }
        forward(&s, n, &inv, &mut x);
        backward(&s, n, &inv, &mut x);
        let mut step = vec![[0.0; 6]; motions.len()];
        for (row, x) in g.iter().zip(&x) {
            for (body, part) in [(row.1, &row.3[..6]), (row.2, &row.3[6..])] {
                let d = inverse[body].times(part);
                for t in 0..6 {
                    step[body][t] += d[t] * x;
                }
            }
        }
        // At most 0.2 m and 0.2 rad a step: far from closure Newton would fly away.
        let most = step.iter().flatten().fold(0.0_f64, |m, x| m.max(x.abs()));
        let scale = (0.2 / most.max(1e-300)).min(1.0);
        for ((m, d), pose) in motions.iter_mut().zip(&step).zip(&mut poses).skip(1) {
            m.p += Vec3::new(d[0], d[1], d[2]) * scale;
            m.q = System::turned(&m.q, &(Vec3::new(d[3], d[4], d[5]) * scale));
            *pose = m.pose();
        }
    }
    unreachable!("the loop returns in its last round")
}

/// Gram-Schmidt over the rows in order: a row that lies in the span of those before it is redundant.
///
/// # Errors
/// [`MbsError::Redundant`] lists them with the joints they repeat.
pub(crate) fn check_redundancy(
    rows: &[Row],
    joint_of: &[usize],
    joints: &[String],
    inverse: &[InverseMass],
    drives: &[Drive],
    motions: &[Motion],
) -> Result<(), MbsError> {
    let poses: Vec<Pose> = motions.iter().map(Motion::pose).collect();
    let g = dense(rows, &poses, drives, false);
    let n = g.len();
    // Cholesky row by row of g M^-1 g'; a vanishing pivot is a dependent row, left out of what follows.
    let mut factor: Vec<Vec<f64>> = Vec::with_capacity(n);
    let mut kept: Vec<usize> = Vec::new();
    let mut redundant: Vec<String> = Vec::new();
    for i in 0..n {
        let mut l = Vec::with_capacity(kept.len() + 1);
        for (c, &k) in kept.iter().enumerate() {
            let row: &Vec<f64> = &factor[c];
            let s = product(&g[i], &g[k], inverse) - (0..c).map(|t| l[t] * row[t]).sum::<f64>();
            l.push(s / row[c]);
        }
        let whole = product(&g[i], &g[i], inverse);
        let rest = whole - l.iter().map(|x| x * x).sum::<f64>();
        if rest > 1e-9 * whole {
            l.push(rest.sqrt());
            factor.push(l);
            kept.push(i);
            continue;
        }
        // Which rows it repeats: the combination c with c' G_kept = g_i.
        let m = kept.len();
        let mut c = l;
        for a in (0..m).rev() {
            let s: f64 = (a + 1..m).map(|b| factor[b][a] * c[b]).sum();
            c[a] = (c[a] - s) / factor[a][a];
        }
        let most = c.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        let mut with: Vec<&str> = Vec::new();
        for (x, &k) in c.iter().zip(&kept) {
            let name = joints[joint_of[g[k].0]].as_str();
            if x.abs() > 1e-6 * most && !with.contains(&name) {
                with.push(name);
            }
        }
        let own = joints[joint_of[g[i].0]].as_str();
        with.retain(|n| *n != own);
        redundant.push(format!("joint '{own}' repeats what {} already say", quoted(&with)));
    }
    let count = redundant.len();
    redundant.dedup();
    if count == 0 { Ok(()) } else { Err(MbsError::Redundant { count, list: redundant.join("; ") }) }
}

fn quoted(names: &[&str]) -> String {
    if names.is_empty() {
        return "its own rows".into();
    }
    names.iter().map(|n| format!("'{n}'")).collect::<Vec<_>>().join(", ")
}
