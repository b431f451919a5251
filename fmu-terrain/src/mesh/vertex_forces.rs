//! From a contact's force and couple to forces on vertices.

use crate::dem::vec3::{Vec3, add, cross, scale, sub};

/// Forces on the three corners of a facet that together are the force `f` (N) acting at point `p` (m) and the couple `m`
/// (N m): sum f_k = f and sum x_k x f_k = p x f + m, to round-off. `b` are barycentric weights (they sum to 1), best those
/// of the point of the facet nearest to `p`; whatever moment they leave is carried as a couple.
///
/// The couple becomes f_k += a x (x_k - g), g the centroid: the least forces that do it, with a from the 3 x 3 inertia-like
/// matrix of the corners. **A facet without area cannot carry a couple about its line**: then `Err` gives the forces
/// b_k f alone, and the couple they leave out, which the caller has to put elsewhere (see [`spread_couple`]).
#[inline]
pub fn to_vertices(x: [Vec3; 3], b: [f64; 3], f: Vec3, p: Vec3, m: Vec3) -> Result<[Vec3; 3], ([Vec3; 3], Vec3)> {
    let at: Vec3 = std::array::from_fn(|k| b[0] * x[0][k] + b[1] * x[1][k] + b[2] * x[2][k]);
    let couple = add(m, cross(sub(p, at), f));
    let mut forces = b.map(|w| scale(w, f));
    if couple == [0.0; 3] {
        return Ok(forces);
    }
    // From differences of corners: a centroid in world coordinates would cost the digits of the distance to the origin.
    let (u, v) = (sub(x[1], x[0]), sub(x[2], x[0]));
    let g = scale(1.0 / 3.0, add(u, v));
    let arms = [scale(-1.0, g), sub(u, g), sub(v, g)];
    let Some(inverse) = Spread::new(arms.iter().copied()) else { return Err((forces, couple)) };
    let mut left = couple;
    // The second time on what the first left over: at a flat facet the large forces lose digits.
    for _ in 0..2 {
        let a = inverse.solve(left);
        let (f1, f2) = (cross(a, arms[1]), cross(a, arms[2]));
        let f0 = scale(-1.0, add(f1, f2));
        for (sum, f) in forces.iter_mut().zip([f0, f1, f2]) {
            *sum = add(*sum, f);
        }
        let done = add(add(cross(arms[0], f0), cross(arms[1], f1)), cross(arms[2], f2));
        left = sub(left, done);
    }
    Ok(forces)
}

/// Solves sum y x (a x y) = m for a, over arms y from a common centroid.
struct Spread {
    /// sum (|y|^2 1 - y y'): xx, yy, zz, xy, xz, yz.
    j: [f64; 6],
    det: f64,
}

impl Spread {
    /// `None` if the arms lie on a line, nearly.
    #[inline]
    fn new(arms: impl Iterator<Item = Vec3>) -> Option<Self> {
        let mut j = [0.0; 6];
        for y in arms {
            let [xx, yy, zz] = [y[0] * y[0], y[1] * y[1], y[2] * y[2]];
            j[0] += yy + zz;
            j[1] += xx + zz;
            j[2] += xx + yy;
            j[3] -= y[0] * y[1];
            j[4] -= y[0] * y[2];
            j[5] -= y[1] * y[2];
        }
        let det = j[0] * (j[1] * j[2] - j[5] * j[5]) - j[3] * (j[3] * j[2] - j[5] * j[4])
            + j[4] * (j[3] * j[5] - j[1] * j[4]);
        let trace = j[0] + j[1] + j[2];
        // det/trace^3 is about (height/length)^2: flatter than 1e-6, round-off would eat the balance.
        (det > 1e-12 * trace * trace * trace).then_some(Self { j, det })
    }

    #[inline]
    fn solve(&self, m: Vec3) -> Vec3 {
        let [a, b, c, d, e, f] = self.j;
        [
            ((b * c - f * f) * m[0] + (e * f - d * c) * m[1] + (d * f - b * e) * m[2]) / self.det,
            ((e * f - d * c) * m[0] + (a * c - e * e) * m[1] + (d * e - a * f) * m[2]) / self.det,
            ((d * f - b * e) * m[0] + (d * e - a * f) * m[1] + (a * b - d * d) * m[2]) / self.det,
        ]
    }
}

/// Forces on all points `x` that sum to zero and have the moment `couple` (N m), each given to `put` with its number. For a
/// couple that no single facet can carry. Points on a line carry what they can.
pub fn spread_couple(x: &[Vec3], couple: Vec3, mut put: impl FnMut(usize, Vec3)) {
    let g = scale(1.0 / x.len() as f64, x.iter().fold([0.0; 3], |s, &p| add(s, p)));
    if let Some(spread) = Spread::new(x.iter().map(|&p| sub(p, g))) {
        let a = spread.solve(couple);
        x.iter().enumerate().for_each(|(k, &p)| put(k, cross(a, sub(p, g))));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dem::vec3::norm;

    /// A fixed pseudo-random sequence in -1..1.
    fn noise(seed: &mut u64) -> f64 {
        *seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (*seed >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    #[test]
    fn force_and_moment_balance_to_round_off() {
        let mut seed = 7;
        let mut vector = || [noise(&mut seed), noise(&mut seed), noise(&mut seed)];
        for flatness in [1.0, 1e-2, 1e-4] {
            for _ in 0..500 {
                let (o, u, w) = (vector(), scale(0.02, vector()), scale(0.02 * flatness, vector()));
                // A sliver has its third corner near the side between the other two.
                let x = [o, add(o, u), add(add(o, scale(0.5, u)), w)];
                let (f, m) = (scale(50.0, vector()), scale(0.01, vector()));
                let raw = vector().map(f64::abs);
                let sum: f64 = raw.iter().sum();
                let b = raw.map(|k| k / sum);
                let p = add(o, scale(0.01, vector()));
                let Ok(forces) = to_vertices(x, b, f, p, m) else { continue };
                let total = forces.iter().fold([0.0; 3], |s, &k| add(s, k));
                let size: f64 = forces.iter().map(|&k| norm(k)).sum();
                assert!(norm(sub(total, f)) < 1e-14 * size);
                let moment = (0..3).fold([0.0; 3], |s, k| add(s, cross(sub(x[k], o), forces[k])));
                let asked = add(m, cross(sub(p, o), f));
                // Positions are of size 1 and carry its round-off.
                assert!(norm(sub(moment, asked)) < 5e-15 * size, "{flatness}: {:e}", norm(sub(moment, asked)) / size);
            }
        }
    }

    #[test]
    fn a_facet_without_area_hands_its_couple_back() {
        let x = [[0.0; 3], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]];
        let (forces, couple) =
            to_vertices(x, [0.5, 0.5, 0.0], [0.0, 0.0, 4.0], [0.5, 0.1, 0.0], [0.3, 0.0, 0.0]).unwrap_err();
        assert_eq!(forces, [[0.0, 0.0, 2.0], [0.0, 0.0, 2.0], [0.0; 3]]);
        assert!(norm(sub(couple, [0.7, 0.0, 0.0])) < 1e-15);
    }

    #[test]
    fn a_couple_spread_over_a_body_is_that_couple() {
        let mut noise_seed = 3;
        let x: Vec<Vec3> = (0..40).map(|_| [0; 3].map(|_| noise(&mut noise_seed))).collect();
        let (mut sum, mut moment) = ([0.0; 3], [0.0; 3]);
        spread_couple(&x, [0.3, -0.2, 0.9], |k, f| {
            sum = add(sum, f);
            moment = add(moment, cross(x[k], f));
        });
        assert!(norm(sum) < 1e-14 && norm(sub(moment, [0.3, -0.2, 0.9])) < 1e-14);
    }
}
