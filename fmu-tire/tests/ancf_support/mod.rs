//! Meshes that several shell tests use.
#![allow(dead_code)]

pub mod soil;

use fmu_tire::ancf::assembly::Fixed;
use fmu_tire::ancf::laminate::Laminate;
use fmu_tire::ancf::mesh::{Shell, ShellMesh};

pub const FREE: Fixed = [false; 6];

/// A flat plate over [0, length] x [0, width], directors along z.
pub struct Plate {
    pub mesh: ShellMesh,
    /// Nodes at x = length.
    pub right: Vec<u32>,
}

/// Elements of a grid of `nx` x `ny`; `node(i, j)` names its nodes.
pub fn shells(nx: usize, ny: usize, node: impl Fn(usize, usize) -> u32) -> Vec<Shell> {
    (0..nx)
        .flat_map(|i| (0..ny).map(move |j| (i, j)))
        .map(|(i, j)| Shell { nodes: [node(i, j), node(i + 1, j), node(i + 1, j + 1), node(i, j + 1)], laminate: 0 })
        .collect()
}

pub fn plate(length: f64, width: f64, nx: usize, ny: usize, laminate: &Laminate) -> Plate {
    let mut reference = Vec::new();
    for i in 0..=nx {
        for j in 0..=ny {
            reference.extend([length * i as f64 / nx as f64, width * j as f64 / ny as f64, 0.0, 0.0, 0.0, 1.0]);
        }
    }
    let node = |i: usize, j: usize| (i * (ny + 1) + j) as u32;
    let mesh = ShellMesh::new(reference, shells(nx, ny, node), std::slice::from_ref(laminate)).unwrap();
    Plate { mesh, right: (0..=ny).map(|j| node(nx, j)).collect() }
}

/// Prints a figure for the tables of `cargo xtask validate ancf`; `tolerance` in the unit of the figure.
pub fn report(case: &str, quantity: &str, unit: &str, expected: f64, computed: f64, tolerance: f64) {
    println!("VALIDATION|{case}|{quantity}|{unit}|{expected}|{computed:.6e}|{tolerance:.2e}");
}

/// Prints a curve for the plots of `cargo xtask validate ancf`; `plot`: file, title, x label and unit, y label and unit.
pub fn curve(plot: [&str; 6], style: &str, series: &str, points: &[(f64, f64)]) {
    let points: Vec<String> = points.iter().map(|(x, y)| format!("{x} {y}")).collect();
    println!("CURVE|{}|{style}|{series}|{}", plot.join("|"), points.join(";"));
}
