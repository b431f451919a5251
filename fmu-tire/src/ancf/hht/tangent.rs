//! The kept tangent: factorised once, used over steps in axes that turn with the nodes.

use super::{Dynamics, Hht, ShellState};
use crate::ancf::AncfError;
use crate::ancf::assembly::Assembly;
use crate::ancf::external::Block;
use crate::ancf::kernel::{Loads, TangentWeights};
use crate::ancf::mesh::{NODE, ShellMesh};
use crate::ancf::secant::Secant;
use nalgebra::{Matrix3, Vector3};

/// A residual that falls to more than this share makes a secant pair.
const STALE: f64 = 0.05;

/// What determines the kept tangent: with it, a restored run goes on with the same bits.
#[derive(Debug, Clone, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct KeptTangent {
    /// Step it was factorised for, s; `None` if no tangent is kept.
    step: Option<f64>,
    /// Coordinates it was assembled at.
    q: Vec<f64>,
    blocks: Vec<Block>,
    rho: f64,
    least: Option<f64>,
    since_measured: usize,
    secant: Secant,
}

impl Hht {
    /// What determines the kept tangent.
    pub fn kept(&self) -> KeptTangent {
        if !self.has_tangent() {
            return KeptTangent::default();
        }
        KeptTangent {
            step: Some(self.step_of_factor),
            rho: self.rho,
            least: self.least.is_finite().then_some(self.least),
            since_measured: self.since_measured,
            secant: self.secant.clone(),
            ..self.kept.clone()
        }
    }

    /// Builds the tangent again that another integrator of the same mesh kept.
    ///
    /// # Errors
    /// [`AncfError::Sparse`].
    pub fn restore_kept(&mut self, mesh: &ShellMesh, loads: &Loads, kept: &KeptTangent) -> Result<(), AncfError> {
        self.forget_tangent();
        if let Some(h) = kept.step {
            let alpha = self.options.alpha;
            let (gamma, beta) = (0.5 * (1.0 - 2.0 * alpha), 0.25 * (1.0 - alpha) * (1.0 - alpha));
            self.kept = kept.clone();
            self.factor_kept(mesh, loads, h, gamma, beta)?;
            self.rho = kept.rho;
            self.least = kept.least.unwrap_or(f64::INFINITY);
            self.since_measured = kept.since_measured;
            self.secant = kept.secant.clone();
        }
        Ok(())
    }

    /// Rotations of the free nodes' local axes since the tangent was factorised. Solves are done in those axes, `K(R u) = R K R'` node by
    /// node: exact for a rigid turn, and good where the shell turns locally.
    pub(super) fn follow(&mut self, mesh: &ShellMesh) {
        let now = local_axes(mesh, &self.assembly, &self.trial.q);
        let place = |b: usize| self.places.as_ref().map_or(b, |p| p[b] as usize);
        self.turns = now.iter().enumerate().map(|(b, axes)| axes * self.axes[place(b)].transpose()).collect();
    }

    /// Solves for `free` with the kept factor in its axes, corrected by the secant pairs.
    pub(super) fn solve_in_frame(&mut self) {
        let place = |b: usize| self.places.as_ref().map_or(b, |p| p[b] as usize);
        self.turned.resize(self.free.len(), 0.0);
        for (b, r) in self.turns.iter().enumerate() {
            for half in [0, 3] {
                let x = Vector3::from_column_slice(&self.free[NODE * b + half..NODE * b + half + 3]);
                let to = NODE * place(b) + half;
                self.turned[to..to + 3].copy_from_slice(r.tr_mul(&x).as_slice());
            }
        }
        let residual = self.turned.clone();
        if let Some((earlier, correction)) = self.before.take() {
            let fall: Vec<f64> = earlier.iter().zip(&residual).map(|(a, b)| a - b).collect();
            // A pair is worth its memory where the factor alone did badly.
            let size = |x: &[f64]| x.iter().map(|x| x * x).sum::<f64>();
            if size(&residual) > STALE * STALE * size(&earlier) {
                self.secant.add(&correction, &fall);
            }
        }
        let assembly = &mut self.assembly;
        self.secant.solve(&mut self.turned, |x| assembly.solve(x));
        self.before = Some((residual, self.turned.clone()));
        for (b, r) in self.turns.iter().enumerate() {
            for half in [0, 3] {
                let from = NODE * place(b) + half;
                let y = r * Vector3::from_column_slice(&self.turned[from..from + 3]);
                self.free[NODE * b + half..NODE * b + half + 3].copy_from_slice(y.as_slice());
            }
        }
    }

    fn weights(&self, h: f64, gamma: f64, beta: f64) -> TangentWeights {
        let factor = 1.0 + self.options.alpha;
        TangentWeights {
            stiffness: factor,
            velocity: factor * gamma / (beta * h),
            mass: 1.0 / (beta * h * h),
            pressure: true,
            geometric: true,
        }
    }

    /// Assembles and factorises the tangent at the trial state.
    pub(super) fn renew(&mut self, dynamics: &Dynamics<'_>, h: f64, gamma: f64, beta: f64) -> Result<(), AncfError> {
        let weights = self.weights(h, gamma, beta);
        let ShellState { q, v, .. } = &self.trial;
        self.kept.blocks.clear();
        dynamics.external.add_tangent(1.0, weights.stiffness, weights.velocity, q, v, &mut self.kept.blocks);
        self.kept.q.clone_from(q);
        self.factor_kept(dynamics.mesh, &dynamics.loads, h, gamma, beta)?;
        self.cost.factorisations += 1;
        Ok(())
    }

    fn factor_kept(&mut self, mesh: &ShellMesh, loads: &Loads, h: f64, gamma: f64, beta: f64) -> Result<(), AncfError> {
        let weights = self.weights(h, gamma, beta);
        self.step_of_factor = f64::NAN;
        let KeptTangent { q, blocks, .. } = &self.kept;
        self.assembly.factor(mesh, loads, q, &weights, blocks)?;
        self.secant.clear();
        self.before = None;
        self.step_of_factor = h;
        self.places = None;
        self.axes = local_axes(mesh, &self.assembly, q);
        self.turns = vec![Matrix3::identity(); self.axes.len()];
        self.least = f64::INFINITY;
        self.rho = 1.0;
        Ok(())
    }
}

/// Axes of the free nodes: third along the director, first along the elements' local x.
fn local_axes(mesh: &ShellMesh, assembly: &Assembly, q: &[f64]) -> Vec<Matrix3<f64>> {
    let mut along = vec![Vector3::zeros(); mesh.node_count()];
    let position = |n: u32| Vector3::from_column_slice(&q[NODE * n as usize..NODE * n as usize + 3]);
    for shell in mesh.shells() {
        let [a, b, c, d] = shell.nodes;
        for (from, to) in [(a, b), (d, c)] {
            let edge = position(to) - position(from);
            along[from as usize] += edge;
            along[to as usize] += edge;
        }
    }
    assembly
        .free_nodes()
        .iter()
        .map(|&n| {
            let first = NODE * n as usize + 3;
            let third = Vector3::from_column_slice(&q[first..first + 3]).normalize();
            let along = along[n as usize];
            let x = (along - third * third.dot(&along)).normalize();
            let axes = Matrix3::from_columns(&[x, third.cross(&x), third]);
            // Where an element has collapsed there is no direction: any axes are as good.
            if axes.iter().all(|v| v.is_finite()) { axes } else { Matrix3::identity() }
        })
        .collect()
}
