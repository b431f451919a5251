//! The constraint rows that joints are made of: residual, Jacobian and explicit time derivative of each.
//!
//! A row is `g(x_A, x_B, t) = 0` with `dg/dt = G_A u_A + G_B u_B + g_t`, where `u` = (`v_WC_W`, `w_WB_B`). Lengths in m, angles in rad.

use super::Pose;
use terramech_mechanics::Vec3;

/// Handle of a prescribed motion: an angle (rad) or displacement (m) with its rate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DriveId(pub(crate) usize);

/// Value and rate of a prescribed motion at one time.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Drive {
    /// Angle (rad) or displacement (m).
    pub value: f64,
    /// Its rate (rad/s or m/s).
    pub rate: f64,
}

/// One kind of constraint between bodies A and B. Points `p_AP` are from the body's centre of mass in body axes.
#[derive(Clone, Debug)]
pub enum Primitive {
    /// Two points coincide: 3 rows (m), inertial axes.
    Coincident {
        /// Point on A (m).
        p_ap: Vec3,
        /// Point on B (m).
        p_bp: Vec3,
    },
    /// A direction of A stays perpendicular to one of B: 1 row (rad for unit vectors).
    Perpendicular {
        /// Unit direction in A.
        u_a: Vec3,
        /// Unit direction in B.
        c_b: Vec3,
    },
    /// B is turned against A by a prescribed angle about `u_a x w_a`: 1 row (rad); `c_b` lies along `u_a` at angle 0.
    DrivenAngle {
        /// First direction in A.
        u_a: Vec3,
        /// Second direction in A, a quarter turn on.
        w_a: Vec3,
        /// Direction in B.
        c_b: Vec3,
        /// The angle.
        drive: DriveId,
    },
    /// The point of B lies at a distance from the plane of A: 1 row (m).
    Offset {
        /// Unit normal in A.
        n_a: Vec3,
        /// Point of the plane on A (m).
        p_ap: Vec3,
        /// Point on B (m).
        p_bp: Vec3,
        /// Constant part of the distance (m).
        offset: f64,
        /// Prescribed part.
        drive: Option<DriveId>,
    },
    /// Two points keep their distance: 1 row (m).
    Distance {
        /// Point on A (m).
        p_ap: Vec3,
        /// Point on B (m).
        p_bp: Vec3,
        /// Distance (m), positive.
        length: f64,
    },
    /// B turns about its axis at the speed of a shaft: 1 row (rad/s), of velocities only.
    Spin {
        /// Unit axis in B.
        axis_b: Vec3,
        /// Column of the shaft speed.
        shaft: usize,
    },
}

/// Writes (n, m) as the six coefficients of a row.
fn put(row: &mut [f64], v: &Vec3, w: &Vec3) {
    row[..6].copy_from_slice(&[v.x, v.y, v.z, w.x, w.y, w.z]);
}

impl Primitive {
    /// How many rows.
    pub fn rows(&self) -> usize {
        if matches!(self, Self::Coincident { .. }) { 3 } else { 1 }
    }

    /// Unit of the residual.
    pub fn unit(&self) -> &'static str {
        match self {
            Self::Coincident { .. } | Self::Offset { .. } | Self::Distance { .. } => "m",
            Self::Perpendicular { .. } | Self::DrivenAngle { .. } => "rad",
            Self::Spin { .. } => "rad/s",
        }
    }

    /// Whether it constrains velocities only.
    pub fn of_velocity(&self) -> bool {
        matches!(self, Self::Spin { .. })
    }

    /// g into `out` (as many as [`Self::rows`]); rows of velocity give 0.
    #[inline]
    pub fn residual(&self, a: &Pose, b: &Pose, drives: &[Drive], out: &mut [f64]) {
        match self {
            Self::Coincident { p_ap, p_bp } => {
                let d = a.point(p_ap) - b.point(p_bp);
                out[..3].copy_from_slice(&[d.x, d.y, d.z]);
            }
            Self::Perpendicular { u_a, c_b } => out[0] = (a.r * u_a).dot(&(b.r * c_b)),
            Self::DrivenAngle { u_a, w_a, c_b, drive } => {
                let (s, c) = drives[drive.0].value.sin_cos();
                out[0] = (a.r * (w_a * c - u_a * s)).dot(&(b.r * c_b));
            }
            Self::Offset { n_a, p_ap, p_bp, offset, drive } => {
                let d = b.point(p_bp) - a.point(p_ap);
                out[0] = (a.r * n_a).dot(&d) - offset - drive.map_or(0.0, |k| drives[k.0].value);
            }
            Self::Distance { p_ap, p_bp, length } => out[0] = (a.point(p_ap) - b.point(p_bp)).norm() - length,
            Self::Spin { .. } => out[0] = 0.0,
        }
    }

    /// The Jacobian rows: twelve coefficients each, A's six then B's six.
    #[inline]
    pub fn jacobian(&self, a: &Pose, b: &Pose, drives: &[Drive], g: &mut [[f64; 12]]) {
        // d(R x)/dt = R (w x x), so the coefficient of w_B in n . R x is x cross R' n.
        match self {
            Self::Coincident { p_ap, p_bp } => {
                for k in 0..3 {
                    let mut e = Vec3::zeros();
                    e[k] = 1.0;
                    let (ra, rb) = (a.r.row(k).transpose(), b.r.row(k).transpose());
                    put(&mut g[k][..6], &e, &p_ap.cross(&ra));
                    put(&mut g[k][6..], &-e, &-p_bp.cross(&rb));
                }
            }
            Self::Perpendicular { u_a, c_b } => perpendicular(u_a, c_b, a, b, &mut g[0]),
            Self::DrivenAngle { u_a, w_a, c_b, drive } => {
                let (s, c) = drives[drive.0].value.sin_cos();
                perpendicular(&(w_a * c - u_a * s), c_b, a, b, &mut g[0]);
            }
            Self::Offset { n_a, p_ap, p_bp, .. } => {
                let n_w = a.r * n_a;
                let d = b.point(p_bp) - a.point(p_ap);
                put(&mut g[0][..6], &-n_w, &n_a.cross(&(a.r.tr_mul(&d) + p_ap)));
                put(&mut g[0][6..], &n_w, &p_bp.cross(&b.r.tr_mul(&n_w)));
            }
            Self::Distance { p_ap, p_bp, .. } => {
                let d = a.point(p_ap) - b.point(p_bp);
                let e = d / d.norm();
                put(&mut g[0][..6], &e, &p_ap.cross(&a.r.tr_mul(&e)));
                put(&mut g[0][6..], &-e, &-p_bp.cross(&b.r.tr_mul(&e)));
            }
            Self::Spin { axis_b, .. } => {
                g[0] = [0.0; 12];
                put(&mut g[0][6..], &Vec3::zeros(), axis_b);
            }
        }
    }

    /// `-g_t`: what `G u` must be, into `out`.
    #[inline]
    pub fn rate(&self, drives: &[Drive], out: &mut [f64]) {
        match self {
            Self::Coincident { .. } => out[..3].fill(0.0),
            Self::DrivenAngle { drive, .. } => out[0] = drives[drive.0].rate,
            Self::Offset { drive: Some(k), .. } => out[0] = drives[k.0].rate,
            _ => out[0] = 0.0,
        }
    }
}

fn perpendicular(u_a: &Vec3, c_b: &Vec3, a: &Pose, b: &Pose, g: &mut [f64; 12]) {
    let (u_w, c_w) = (a.r * u_a, b.r * c_b);
    put(&mut g[..6], &Vec3::zeros(), &u_a.cross(&a.r.tr_mul(&c_w)));
    put(&mut g[6..], &Vec3::zeros(), &c_b.cross(&b.r.tr_mul(&u_w)));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mbs::Motion;
    use terramech_mechanics::rotation;

    /// G u + g_t against a central difference of g along the motion, for every primitive.
    #[test]
    fn jacobians_are_the_derivatives_of_residuals() {
        let v = Vec3::new;
        let mut a = Motion::at(v(0.3, -0.2, 0.5), rotation::exp(&v(0.2, 0.5, -0.3)));
        let mut b = Motion::at(v(-0.4, 0.6, 0.1), rotation::exp(&v(-0.7, 0.1, 0.4)));
        a.u = [0.3, -1.0, 0.4, 0.7, -0.2, 0.9];
        b.u = [-0.5, 0.2, 0.8, -0.6, 1.1, 0.3];
        let (p, q) = (v(0.1, 0.4, -0.3), v(-0.2, 0.3, 0.6));
        let drive = Drive { value: 0.4, rate: 0.8 };
        let all = [
            Primitive::Coincident { p_ap: p, p_bp: q },
            Primitive::Perpendicular { u_a: p, c_b: q },
            Primitive::Offset { n_a: p, p_ap: q, p_bp: p, offset: 0.2, drive: Some(DriveId(0)) },
            Primitive::Distance { p_ap: p, p_bp: q, length: 0.4 },
        ];
        let h = 1e-6;
        let at = |m: &Motion, s: f64| Motion { p: m.p + m.v() * s, q: m.q * rotation::exp(&(m.w_body() * s)), u: m.u };
        for c in all {
            let value = |s: f64| {
                let mut g = [0.0; 3];
                let d = [Drive { value: drive.value + drive.rate * s, ..drive }];
                c.residual(&at(&a, s).pose(), &at(&b, s).pose(), &d, &mut g);
                g
            };
            let (plus, minus) = (value(h), value(-h));
            let mut g = [[0.0; 12]; 3];
            let mut rate = [0.0; 3];
            c.jacobian(&a.pose(), &b.pose(), &[drive], &mut g);
            c.rate(&[drive], &mut rate);
            for k in 0..c.rows() {
                let by_row: f64 = (0..6).map(|i| g[k][i] * a.u[i] + g[k][6 + i] * b.u[i]).sum::<f64>() - rate[k];
                let by_difference = (plus[k] - minus[k]) / (2.0 * h);
                assert!((by_row - by_difference).abs() < 1e-8, "{c:?} row {k}: {by_row} {by_difference}");
            }
        }
    }
}
