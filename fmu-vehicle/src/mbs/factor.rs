//! The arrow-shaped KKT system: clusters eliminated densely, hubs and shafts last.
//!
//! With interior velocities `u_i`, hub velocities `u_b` (bodies flagged hub, independent shaft speeds) and impulses `l`:
//!
//! ```text
//! M_i u_i = r_i + G_i' l        M_b u_b = r_b + G_b' l        G_i u_i + G_b u_b = d
//! S = G_i M_i^-1 G_i' = U'U     Y = U^-T G_b                  K = M_b + sum Y'Y
//! ```
//!
//! Rows between hubs alone enter last: their Schur complement on K. All matrices are small, dense, row-major, upper Cholesky.

use super::layout::{Cluster, Layout};

/// `a = U'U` in place (upper, row-major, n x n); `inv` gets the inverse diagonal. Err: the row whose pivot vanished.
pub(crate) fn cholesky(a: &mut [f64], n: usize, inv: &mut [f64]) -> Result<(), usize> {
    for k in 0..n {
        let pivot = a[k * n + k];
        if pivot.is_nan() || pivot <= inv[k] {
            return Err(k);
        }
        let s = 1.0 / pivot.sqrt();
        inv[k] = s;
        let (head, tail) = a.split_at_mut((k + 1) * n);
        let row = &mut head[k * n..];
        for x in &mut row[k..] {
            *x *= s;
        }
        for i in k + 1..n {
            let f = row[i];
            // Structural zeros: joints that share no body.
            if f != 0.0 {
                let target = &mut tail[(i - k - 1) * n + i..(i - k - 1) * n + n];
                for (t, r) in target.iter_mut().zip(&row[i..n]) {
                    *t -= f * r;
                }
            }
        }
    }
    Ok(())
}

/// Least pivots that count as regular, from the diagonal before factorisation.
pub(crate) fn thresholds(a: &[f64], n: usize, inv: &mut [f64]) {
    for k in 0..n {
        inv[k] = a[k * n + k] * 1e-11;
    }
}

/// `x <- U^-T x`.
pub(crate) fn forward(u: &[f64], n: usize, inv: &[f64], x: &mut [f64]) {
    for i in 0..n {
        let f = x[i] * inv[i];
        x[i] = f;
        for (t, r) in x[i + 1..n].iter_mut().zip(&u[i * n + i + 1..(i + 1) * n]) {
            *t -= f * r;
        }
    }
}

/// `x <- U^-1 x`.
pub(crate) fn backward(u: &[f64], n: usize, inv: &[f64], x: &mut [f64]) {
    for i in (0..n).rev() {
        let s: f64 = u[i * n + i + 1..(i + 1) * n].iter().zip(&x[i + 1..n]).map(|(a, b)| a * b).sum();
        x[i] = (x[i] - s) * inv[i];
    }
}

/// `y <- U^-T y` for n x m.
fn forward_multi(u: &[f64], n: usize, inv: &[f64], y: &mut [f64], m: usize) {
    for i in 0..n {
        let (head, tail) = y.split_at_mut((i + 1) * m);
        let row = &mut head[i * m..];
        for x in row.iter_mut() {
            *x *= inv[i];
        }
        for j in i + 1..n {
            let f = u[i * n + j];
            if f != 0.0 {
                for (t, r) in tail[(j - i - 1) * m..(j - i) * m].iter_mut().zip(row.iter()) {
                    *t -= f * r;
                }
            }
        }
    }
}

/// Upper part of `k += y' y` for n x m.
fn gram(y: &[f64], n: usize, m: usize, k: &mut [f64]) {
    for i in 0..n {
        let row = &y[i * m..(i + 1) * m];
        for p in 0..m {
            let f = row[p];
            if f != 0.0 {
                for (t, r) in k[p * m + p..(p + 1) * m].iter_mut().zip(&row[p..]) {
                    *t += f * r;
                }
            }
        }
    }
}

/// Numeric factor of one cluster.
#[derive(Clone, Debug, Default)]
struct ClusterFactor {
    u: Vec<f64>,
    inv: Vec<f64>,
    y: Vec<f64>,
    gram: Vec<f64>,
}

/// Numeric factor of the whole, with scratch memory.
#[derive(Clone, Debug, Default)]
pub struct Factor {
    clusters: Vec<ClusterFactor>,
    /// Hub matrix K, upper factor.
    k: Vec<f64>,
    k_inv: Vec<f64>,
    /// `U_K^-T G_bb'` (nb x nr).
    w: Vec<f64>,
    /// Schur complement of the hub rows, upper factor.
    s: Vec<f64>,
    s_inv: Vec<f64>,
    // Scratch of `solve`.
    x: Vec<f64>,
    z: Vec<f64>,
    l: Vec<f64>,
}

/// Which cluster became singular: `None` for the hub rows.
pub struct SingularCluster(pub Option<usize>);

fn dot6(a: &[f64], b: &[f64; 6]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + (a[3] * b[3] + a[4] * b[4] + a[5] * b[5])
}

/// Inverse mass of a body: 1/m and the inverse inertia's six different entries (xx, yy, zz, xy, xz, yz).
#[derive(Clone, Copy, Debug, Default)]
pub struct InverseMass {
    pub(crate) m: f64,
    pub(crate) i: [f64; 6],
}

impl InverseMass {
    #[inline]
    pub(crate) fn times(&self, g: &[f64]) -> [f64; 6] {
        let (m, i) = (self.m, &self.i);
        [
            m * g[0],
            m * g[1],
            m * g[2],
            i[0] * g[3] + i[3] * g[4] + i[4] * g[5],
            i[3] * g[3] + i[1] * g[4] + i[5] * g[5],
            i[4] * g[3] + i[5] * g[4] + i[2] * g[5],
        ]
    }
}

/// What the right-hand side of a solve holds: parts that are zero are not worked on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reach {
    /// Everything.
    All,
    /// Row velocities `d` alone; momenta are zero.
    Rows,
    /// Momenta of hubs and shafts alone.
    Hubs,
}

impl Factor {
    /// Factors for the Jacobian rows `g` (12 coefficients a row), inverse masses per body and the hub mass matrix.
    ///
    /// # Errors
    /// The cluster whose rows are dependent.
    pub fn factor(
        &mut self,
        layout: &Layout,
        g: &[[f64; 12]],
        inverse: &[InverseMass],
        hub_mass: &[f64],
    ) -> Result<(), SingularCluster> {
        let nb = layout.nb;
        self.clusters.resize_with(layout.clusters.len(), Default::default);
        self.k.clear();
        self.k.extend_from_slice(hub_mass);
        for (c, (cluster, f)) in layout.clusters.iter().zip(&mut self.clusters).enumerate() {
            cluster_factor(cluster, f, g, inverse).map_err(|()| SingularCluster(Some(c)))?;
            let m = cluster.cols.len();
            for p in 0..m {
                for q in p..m {
                    self.k[cluster.cols[p] * nb + cluster.cols[q]] += f.gram[p * m + q];
                }
            }
        }
        self.k_inv.resize(nb, 0.0);
        thresholds(&self.k, nb, &mut self.k_inv);
        cholesky(&mut self.k, nb, &mut self.k_inv).map_err(|_| SingularCluster(None))?;
        let nr = layout.hub_rows.len();
        if nr > 0 {
            self.w.clear();
            self.w.resize(nb * nr, 0.0);
            for (j, row) in layout.hub_rows.clone().enumerate() {
                let (a, b) = layout.sides[row];
                for (body, part) in [(a, &g[row][..6]), (b, &g[row][6..])] {
                    if let Some(col) = layout.hub_col[body] {
                        for t in 0..6 {
                            self.w[(col + t) * nr + j] = part[t];
                        }
                    }
                }
            }
            for &(row, col) in &layout.hub_spins {
                self.w[col * nr + row - layout.hub_rows.start] = -1.0;
            }
            forward_multi(&self.k, nb, &self.k_inv, &mut self.w, nr);
            self.s.clear();
            self.s.resize(nr * nr, 0.0);
            gram(&self.w, nb, nr, &mut self.s);
            self.s_inv.resize(nr, 0.0);
            thresholds(&self.s, nr, &mut self.s_inv);
            cholesky(&mut self.s, nr, &mut self.s_inv).map_err(|_| SingularCluster(None))?;
        }
        Ok(())
    }

    /// Solves for velocities from momenta `r` (6 a body) and `ry` (independent shafts), and row velocities `d`; `reach` says which of them
    /// may differ from zero. `u`, `y` receive the velocities, `l` the impulses.
    pub fn solve(
        &mut self,
        layout: &Layout,
        g: &[[f64; 12]],
        inverse: &[InverseMass],
        reach: Reach,
        r: &[[f64; 6]],
        ry: &[f64],
        d: &[f64],
        u: &mut [[f64; 6]],
        y: &mut [f64],
    ) {
        let nb = layout.nb;
        self.x.resize(nb, 0.0);
        self.l.resize(g.len(), 0.0);
        for (body, col) in layout.hub_col.iter().enumerate() {
            match col {
                Some(c) => self.x[*c..c + 6].copy_from_slice(&r[body]),
                None if reach == Reach::All => u[body] = inverse[body].times(&r[body]),
                None => u[body] = [0.0; 6],
            }
        }
        self.x[layout.shaft_col..].copy_from_slice(ry);
        for (cluster, f) in layout.clusters.iter().zip(&self.clusters) {
            let (n, m) = (cluster.n, cluster.cols.len());
            let z = &mut self.l[cluster.row0..cluster.row0 + n];
            if reach == Reach::Hubs {
                z.fill(0.0);
                continue;
            }
            z.copy_from_slice(&d[cluster.row0..cluster.row0 + n]);
            if reach == Reach::All {
                for b in &cluster.bodies {
                    for e in &b.entries {
                        z[e.row] -= dot6(&g[cluster.row0 + e.row][e.side..e.side + 6], &u[b.body]);
                    }
                }
            }
            forward(&f.u, n, &f.inv, z);
            for i in 0..n {
                for p in 0..m {
                    self.x[cluster.cols[p]] += f.y[i * m + p] * z[i];
                }
            }
        }
        forward(&self.k, nb, &self.k_inv, &mut self.x);
        let nr = layout.hub_rows.len();
        if nr > 0 {
            let first = layout.hub_rows.start;
            self.z.clear();
            self.z.extend_from_slice(&d[layout.hub_rows.clone()]);
            for i in 0..nb {
                for j in 0..nr {
                    self.z[j] -= self.w[i * nr + j] * self.x[i];
                }
            }
            forward(&self.s, nr, &self.s_inv, &mut self.z);
            backward(&self.s, nr, &self.s_inv, &mut self.z);
            for i in 0..nb {
                self.x[i] += (0..nr).map(|j| self.w[i * nr + j] * self.z[j]).sum::<f64>();
            }
            self.l[first..first + nr].copy_from_slice(&self.z);
        }
        backward(&self.k, nb, &self.k_inv, &mut self.x);
        for (body, col) in layout.hub_col.iter().enumerate() {
            if let Some(c) = col {
                u[body].copy_from_slice(&self.x[*c..c + 6]);
            }
        }
        y.copy_from_slice(&self.x[layout.shaft_col..]);
        for (cluster, f) in layout.clusters.iter().zip(&self.clusters) {
            let (n, m) = (cluster.n, cluster.cols.len());
            let z = &mut self.l[cluster.row0..cluster.row0 + n];
            for i in 0..n {
                z[i] -= (0..m).map(|p| f.y[i * m + p] * self.x[cluster.cols[p]]).sum::<f64>();
            }
            backward(&f.u, n, &f.inv, z);
            for b in &cluster.bodies {
                let mut p = [0.0; 6];
                for e in &b.entries {
                    let row = &g[cluster.row0 + e.row][e.side..e.side + 6];
                    for t in 0..6 {
                        p[t] += row[t] * z[e.row];
                    }
                }
                let du = inverse[b.body].times(&p);
                for t in 0..6 {
                    u[b.body][t] += du[t];
                }
            }
        }
    }

    /// Impulses of the last solve, one a row.
    pub fn impulses(&self) -> &[f64] {
        &self.l
    }
}

fn cluster_factor(c: &Cluster, f: &mut ClusterFactor, g: &[[f64; 12]], inverse: &[InverseMass]) -> Result<(), ()> {
    let (n, m) = (c.n, c.cols.len());
    let g = &g[c.row0..c.row0 + n];
    f.u.clear();
    f.u.resize(n * n, 0.0);
    for b in &c.bodies {
        let inv = &inverse[b.body];
        for (k, e) in b.entries.iter().enumerate() {
            let h = inv.times(&g[e.row][e.side..e.side + 6]);
            // Entries are sorted by row: this fills the upper half.
            for o in &b.entries[k..] {
                f.u[e.row * n + o.row] += dot6(&g[o.row][o.side..o.side + 6], &h);
            }
        }
    }
    f.inv.resize(n, 0.0);
    thresholds(&f.u, n, &mut f.inv);
    cholesky(&mut f.u, n, &mut f.inv).map_err(|_| ())?;
    f.y.clear();
    f.y.resize(n * m, 0.0);
    for e in &c.hub_entries {
        let row = &g[e.row][e.side..e.side + 6];
        f.y[e.row * m + e.col..e.row * m + e.col + 6].copy_from_slice(row);
    }
    for &(row, col) in &c.spins {
        f.y[row * m + col] = -1.0;
    }
    forward_multi(&f.u, n, &f.inv, &mut f.y, m);
    f.gram.clear();
    f.gram.resize(m * m, 0.0);
    gram(&f.y, n, m, &mut f.gram);
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dense_kernels_solve() {
        let n = 5;
        // A = B'B + I from fixed numbers.
        let b: Vec<f64> = (0..n * n).map(|i| ((i * 7 + 3) % 11) as f64 / 11.0).collect();
        let mut a = vec![0.0; n * n];
        for i in 0..n {
            for j in 0..n {
                a[i * n + j] = (0..n).map(|k| b[k * n + i] * b[k * n + j]).sum::<f64>() + f64::from(u8::from(i == j));
            }
        }
        let x: Vec<f64> = (0..n).map(|i| i as f64 - 1.5).collect();
        let mut rhs: Vec<f64> = (0..n).map(|i| (0..n).map(|j| a[i * n + j] * x[j]).sum()).collect();
        let mut inv = vec![0.0; n];
        thresholds(&a, n, &mut inv);
        cholesky(&mut a, n, &mut inv).unwrap();
        forward(&a, n, &inv, &mut rhs);
        backward(&a, n, &inv, &mut rhs);
        assert!(rhs.iter().zip(&x).all(|(p, q)| (p - q).abs() < 1e-12));
    }
}
