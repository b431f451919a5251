//! One-dimensional shafts with gears and differentials, reduced to independent speeds.
//!
//! Constraints between shaft speeds are linear with constant coefficients: `C w = D W`, with `w` the speeds and `W = w_WB_B` the angular
//! velocity of the *carrier*, the body whose housing the gears sit in. Elimination gives `w = Z y + B W`; the shafts' kinetic energy in (y, W) is added to
//! the mass matrix of the hubs. So gears hold to round-off, stiff gear meshes do not exist, and the housing takes exactly the reaction
//! torques that virtual power says. When a gear changes, the new speeds follow from the balance of momentum.

use super::MbsError;
use terramech_mechanics::Vec3;

/// Handle of a shaft.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ShaftId(pub(crate) usize);

impl ShaftId {
    /// Position in lists of shafts.
    pub fn index(self) -> usize {
        self.0
    }
}

/// Handle of a constraint between shafts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GearId(usize);

#[derive(Clone, Debug)]
struct Constraint {
    name: String,
    terms: Vec<(usize, f64)>,
    carrier: Vec3,
    active: bool,
}

/// The shafts of a model.
#[derive(Clone, Debug, Default)]
pub struct ShaftNetwork {
    names: Vec<String>,
    inertia: Vec<f64>,
    constraints: Vec<Constraint>,
    /// Shafts that turn with a body: always independent, the first columns.
    coupled: Vec<usize>,
}

/// `w = Z y + B W`, and the inertia in (y, W).
#[derive(Clone, Debug, Default)]
pub struct Reduction {
    /// Number of independent speeds; the coupled shafts come first, in the order of coupling.
    pub ny: usize,
    /// The independent shafts.
    pub independent: Vec<usize>,
    /// Shafts x ny, row-major.
    pub z: Vec<f64>,
    /// Shafts x 3.
    pub b: Vec<[f64; 3]>,
    /// `Z' J Z` (ny x ny), row-major.
    pub m_yy: Vec<f64>,
    /// `Z' J B` (ny x 3).
    pub m_yw: Vec<[f64; 3]>,
    /// `B' J B`.
    pub m_ww: [[f64; 3]; 3],
}

impl ShaftNetwork {
    /// A shaft with its inertia about its axis (kg m2).
    pub fn shaft(&mut self, name: &str, inertia: f64) -> ShaftId {
        self.names.push(name.into());
        self.inertia.push(inertia);
        ShaftId(self.names.len() - 1)
    }
    /// Number of shafts.
    pub fn len(&self) -> usize {
        self.names.len()
    }
    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.names.is_empty()
    }
    /// Inertias (kg m2).
    pub fn inertia(&self) -> &[f64] {
        &self.inertia
    }
    /// Names.
    pub fn names(&self) -> &[String] {
        &self.names
    }
    pub(crate) fn couple(&mut self, shaft: ShaftId) -> usize {
        self.coupled.push(shaft.0);
        self.coupled.len() - 1
    }

    /// A gear: `w_out - d_out . W = ratio (w_in - d_in . W)`. Directions are the shafts' axes in the carrier, both the same for coaxial
    /// shafts, perpendicular for a conical gear.
    pub fn gear(&mut self, name: &str, input: ShaftId, output: ShaftId, ratio: f64, d_in: Vec3, d_out: Vec3) -> GearId {
        self.push(name, vec![(output.0, 1.0), (input.0, -ratio)], d_out - d_in * ratio)
    }

    /// A planetary differential of ordinary ratio `t0` (-1: the usual open one): `w_box = (w_1 - t0 w_2) / (1 - t0)`.
    pub fn differential(&mut self, name: &str, carrier: ShaftId, out: [ShaftId; 2], t0: f64) -> GearId {
        let s = 1.0 / (1.0 - t0);
        self.push(name, vec![(carrier.0, 1.0), (out[0].0, -s), (out[1].0, t0 * s)], Vec3::zeros())
    }

    /// Two shafts joined end to end.
    pub fn join(&mut self, name: &str, a: ShaftId, b: ShaftId) -> GearId {
        self.push(name, vec![(a.0, 1.0), (b.0, -1.0)], Vec3::zeros())
    }

    /// A shaft fixed to the carrier along `d`: it turns with it, only its inertia counts.
    pub fn fix(&mut self, name: &str, shaft: ShaftId, d: Vec3) -> GearId {
        self.push(name, vec![(shaft.0, 1.0)], d)
    }

    fn push(&mut self, name: &str, terms: Vec<(usize, f64)>, carrier: Vec3) -> GearId {
        self.constraints.push(Constraint { name: name.into(), terms, carrier, active: true });
        GearId(self.constraints.len() - 1)
    }

    /// Gives a coaxial gear along `d` a new ratio; `None` opens it (neutral).
    pub(crate) fn set_ratio(&mut self, gear: GearId, ratio: Option<f64>, d: Vec3) {
        let c = &mut self.constraints[gear.0];
        c.active = ratio.is_some();
        if let Some(r) = ratio {
            c.terms[1].1 = -r;
            c.carrier = d * (1.0 - r);
        }
    }

    /// Reduces to independent speeds.
    ///
    /// # Errors
    /// [`MbsError::Shafts`] names a constraint that repeats or contradicts others, or that binds two coupled shafts directly (a
    /// spool; use a clutch).
    pub fn reduce(&self) -> Result<Reduction, MbsError> {
        let ns = self.len();
        let active: Vec<&Constraint> = self.constraints.iter().filter(|c| c.active).collect();
        // Rows [C | D]; Gauss-Jordan on the columns of shafts that no body drives.
        let mut rows: Vec<Vec<f64>> = active
            .iter()
            .map(|c| {
                let mut r = vec![0.0; ns + 3];
                for &(s, x) in &c.terms {
                    r[s] += x;
                }
                r[ns..].copy_from_slice(c.carrier.as_slice());
                r
            })
            .collect();
        let mut pivot_of_row = Vec::new();
        let mut eliminated = vec![None; ns];
        for k in 0..rows.len() {
            let best = (0..ns)
                .filter(|s| eliminated[*s].is_none() && !self.coupled.contains(s))
                .max_by(|&i, &j| rows[k][i].abs().total_cmp(&rows[k][j].abs()));
            let Some(p) = best.filter(|&p| rows[k][p].abs() > 1e-12) else {
                return Err(MbsError::Shafts(active[k].name.clone()));
            };
            let by = 1.0 / rows[k][p];
            rows[k].iter_mut().for_each(|x| *x *= by);
            let pivot = rows[k].clone();
            for (i, row) in rows.iter_mut().enumerate() {
                let f = row[p];
                if i != k && f != 0.0 {
                    row.iter_mut().zip(&pivot).for_each(|(x, y)| *x -= f * y);
                }
            }
            eliminated[p] = Some(k);
            pivot_of_row.push(p);
        }
        let independent: Vec<usize> = self
            .coupled
            .iter()
            .copied()
            .chain((0..ns).filter(|s| eliminated[*s].is_none() && !self.coupled.contains(s)))
            .collect();
        let ny = independent.len();
        let (mut z, mut b) = (vec![0.0; ns * ny], vec![[0.0; 3]; ns]);
        for (col, &s) in independent.iter().enumerate() {
            z[s * ny + col] = 1.0;
            for (k, &p) in pivot_of_row.iter().enumerate() {
                z[p * ny + col] = -rows[k][s];
            }
        }
        for (k, &p) in pivot_of_row.iter().enumerate() {
            b[p].copy_from_slice(&rows[k][ns..]);
        }
        let mut m = Reduction { ny, m_yy: vec![0.0; ny * ny], m_yw: vec![[0.0; 3]; ny], ..Default::default() };
        for s in 0..ns {
            let j = self.inertia[s];
            for p in 0..ny {
                for q in 0..ny {
                    m.m_yy[p * ny + q] += j * z[s * ny + p] * z[s * ny + q];
                }
                for t in 0..3 {
                    m.m_yw[p][t] += j * z[s * ny + p] * b[s][t];
                }
            }
            for t in 0..3 {
                for v in 0..3 {
                    m.m_ww[t][v] += j * b[s][t] * b[s][v];
                }
            }
        }
        (m.z, m.b) = (z, b);
        m.independent = independent;
        Ok(m)
    }
}

impl Reduction {
    /// Speeds of all shafts (rad/s) from the independent ones and the carrier's angular velocity in its axes.
    pub fn speeds(&self, y: &[f64], omega: &[f64], w: &mut [f64]) {
        for (s, w) in w.iter_mut().enumerate() {
            *w = (0..self.ny).map(|p| self.z[s * self.ny + p] * y[p]).sum::<f64>()
                + (0..3).map(|t| self.b[s][t] * omega[t]).sum::<f64>();
        }
    }
    /// Adds `Z' x` to `y` and `B' x` to `omega`: torques or momenta of shafts as generalised ones.
    pub fn gather(&self, x: &[f64], y: &mut [f64], omega: &mut [f64]) {
        for (s, x) in x.iter().enumerate() {
            for p in 0..self.ny {
                y[p] += self.z[s * self.ny + p] * x;
            }
            for t in 0..3 {
                omega[t] += self.b[s][t] * x;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn open_differentials_of_a_four_wheel_drive() {
        let mut n = ShaftNetwork::default();
        let wheels: Vec<ShaftId> = (0..4).map(|i| n.shaft(&format!("axle {i}"), 0.4)).collect();
        for &w in &wheels {
            n.couple(w);
        }
        let [f, r, d] = ["front", "rear", "drive"].map(|s| n.shaft(s, 0.5));
        let (bf, br) = (n.shaft("front box", 0.6), n.shaft("rear box", 0.6));
        let (x, y) = (Vec3::x(), Vec3::y());
        n.differential("central", d, [f, r], -1.0);
        n.gear("front gear", f, bf, 0.2, x, y);
        n.gear("rear gear", r, br, 0.2, x, y);
        n.differential("front", bf, [wheels[0], wheels[1]], -1.0);
        n.differential("rear", br, [wheels[2], wheels[3]], -1.0);
        let m = n.reduce().unwrap();
        assert_eq!(m.ny, 4);
        let mut w = vec![0.0; 9];
        m.speeds(&[1.0, 3.0, 5.0, 7.0], &[0.0; 3], &mut w);
        assert!((w[bf.0] - 2.0).abs() < 1e-14 && (w[br.0] - 6.0).abs() < 1e-14);
        assert!((w[f.0] - 10.0).abs() < 1e-13 && (w[d.0] - 20.0).abs() < 1e-13);
        // A housing that pitches and rolls with everything turning along with it leaves all relative speeds zero.
        m.speeds(&[1.0; 4], &[0.5, 1.0, 0.0], &mut w);
        assert!((w[f.0] - 0.5).abs() < 1e-13, "{w:?}");
        n.join("again", f, f);
        assert!(matches!(n.reduce(), Err(MbsError::Shafts(name)) if name == "again"));
    }
}
