//! What elements of the same reference shape and layers share: condensed stiffness, mass.
//!
//! The strain energy is `1/2 e' K e` with e the generalised strains less those of the reference shape. K collects, exactly:
//! covariant strains at (xi, eta, zeta), linear in e; their transformation to the fibre axes of each layer at that point; the
//! layer's stiffness; integration over 2 x 2 in-plane points and [`LAYER_POINTS`] points through each layer; and the enhanced
//! strains `T0 M alpha det J0(0)/det J0`, linear in five parameters, which are eliminated in closed form.

use super::AncfError;
use super::laminate::Laminate;
use super::strain::{COORDS, Frame, GAUSS, STRAINS};
use nalgebra::{Matrix3, Matrix5, Matrix6, RowSVector, SMatrix, SVector, Vector3, Vector6};

/// Gauss points through each layer. Three are exact for a flat element; for a curved one the rest is of order (h/R)^6.
pub const LAYER_POINTS: usize = 3;
const LAYER_GAUSS: [(f64, f64); LAYER_POINTS] =
    [(-0.774_596_669_241_483_4, 5.0 / 9.0), (0.0, 8.0 / 9.0), (0.774_596_669_241_483_4, 5.0 / 9.0)];

type Map = SMatrix<f64, 6, STRAINS>;
type Enhanced = SMatrix<f64, 5, STRAINS>;

/// Constants of all elements with the same reference shape and layers.
#[derive(Debug, Clone)]
pub struct ElementType {
    /// Half of the thickness, m.
    pub half: f64,
    /// Condensed stiffness of the generalised strains, row by row, J/m4.
    pub stiffness: Box<[[f64; STRAINS]; STRAINS]>,
    /// Generalised strains of the reference shape, m2.
    pub reference: [f64; STRAINS],
    /// Consistent mass, one number per pair of vectors (node i: position 2 i, director 2 i + 1), kg and kg (directors are numbers).
    pub mass: [[f64; 8]; 8],
    /// Maps generalised strain changes to Cartesian in-plane strains (xx, yy, 2 xy along the element's own axes) at the centre of
    /// the mid-surface.
    pub centre: [[f64; STRAINS]; 3],
    /// Mid-surface area, m2.
    pub area: f64,
    /// Triple product of the covariant base at the centre of the reference shape, m3: volume scale for the inversion check.
    pub volume: f64,
}

/// Bilinear shape functions and their derivatives (value, d/dxi, d/deta) at a point.
fn shape(xi: f64, eta: f64) -> [[f64; 3]; 4] {
    let corner = |a: f64, b: f64| {
        [0.25 * (1.0 + a * xi) * (1.0 + b * eta), 0.25 * a * (1.0 + b * eta), 0.25 * b * (1.0 + a * xi)]
    };
    [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)]
}

/// Covariant base vectors of the reference shape as columns, m.
fn jacobian(q: &[f64; COORDS], half: f64, xi: f64, eta: f64, zeta: f64) -> Matrix3<f64> {
    let n = shape(xi, eta);
    let mut j = Matrix3::zeros();
    for i in 0..4 {
        let p = Vector3::from_column_slice(&q[6 * i..6 * i + 3]);
        let s = Vector3::from_column_slice(&q[6 * i + 3..6 * i + 6]) * half;
        let x = p + s * zeta;
        j.set_column(0, &(j.column(0) + x * n[i][1]));
        j.set_column(1, &(j.column(1) + x * n[i][2]));
        j.set_column(2, &(j.column(2) + s * n[i][0]));
    }
    j
}

/// Transformation of covariant strains (xx, yy, 2xy, zz, 2xz, 2yz) to Cartesian axes: first along the xi line, third normal to the
/// lamina, turned by `angle` about it.
fn transformation(j: &Matrix3<f64>, angle: f64) -> Matrix6<f64> {
    aligned_transformation(j, &j.column(0).into(), angle)
}

/// The same with the first axis along the projection of `along` on the lamina.
fn aligned_transformation(j: &Matrix3<f64>, along: &Vector3<f64>, angle: f64) -> Matrix6<f64> {
    let a3 = j.column(0).cross(&j.column(1)).normalize();
    let a1 = (along - a3 * a3.dot(along)).normalize();
    let a2 = a3.cross(&a1);
    let (s, c) = angle.sin_cos();
    let axes = Matrix3::from_columns(&[a1 * c + a2 * s, a2 * c - a1 * s, a3]);
    let dual = j.try_inverse().unwrap_or(Matrix3::from_element(f64::NAN));
    // beta(i, a): component of the contravariant base vector i along axis a.
    let beta = dual * axes;
    const PAIR: [(usize, usize); 6] = [(0, 0), (1, 1), (0, 1), (2, 2), (0, 2), (1, 2)];
    Matrix6::from_fn(|row, column| {
        let (a, b) = PAIR[row];
        let (i, k) = PAIR[column];
        let value = beta[(i, a)] * beta[(k, b)] + if i == k { 0.0 } else { beta[(k, a)] * beta[(i, b)] };
        // Engineering shear on both sides: rows double, columns halve.
        let row_factor = if a == b { 1.0 } else { 2.0 };
        let column_factor = if i == k { 1.0 } else { 0.5 };
        value * row_factor * column_factor
    })
}

/// Covariant strains at a point as a linear map of the generalised strains.
fn covariant(kx: usize, ky: usize, zeta: f64) -> Map {
    let (xi, eta) = ([-GAUSS, GAUSS][kx], [-GAUSS, GAUSS][ky]);
    let powers = [1.0, zeta, zeta * zeta];
    let mut map = Map::zeros();
    for p in 0..3 {
        map[(0, 3 * ky + p)] = powers[p];
        map[(1, 6 + 3 * kx + p)] = powers[p];
        map[(2, 12 + 3 * (kx + 2 * ky) + p)] = powers[p];
    }
    assumed(&mut map, xi, eta);
    map
}

/// The rows of the assumed natural strains.
fn assumed(map: &mut Map, xi: f64, eta: f64) {
    for (i, n) in shape(xi, eta).iter().enumerate() {
        map[(3, 24 + i)] = n[0];
    }
    map[(4, 28)] = 0.5 * (1.0 - eta);
    map[(4, 29)] = 0.5 * (1.0 + eta);
    map[(5, 30)] = 0.5 * (1.0 - xi);
    map[(5, 31)] = 0.5 * (1.0 + xi);
}

/// The enhanced covariant strains per parameter: in-plane strains linear in the plane, thickness strain linear in zeta.
fn enhancement(xi: f64, eta: f64, zeta: f64) -> SMatrix<f64, 6, 5> {
    let mut m = SMatrix::<f64, 6, 5>::zeros();
    m[(0, 0)] = xi;
    m[(1, 1)] = eta;
    m[(2, 2)] = xi;
    m[(2, 3)] = eta;
    m[(3, 4)] = zeta;
    m
}

impl ElementType {
    /// Builds the constants from reference coordinates (per node A, B, C, D: position m, director) and layers.
    ///
    /// # Errors
    /// [`AncfError::Input`] with all faults: a bad laminate, or a reference shape whose volume is not positive everywhere.
    pub fn new(q: &[f64; COORDS], laminate: &Laminate) -> Result<Self, AncfError> {
        let mut faults = laminate.faults();
        let half = 0.5 * laminate.thickness();
        for (xi, eta) in [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)] {
            for zeta in [-1.0, 1.0] {
                let det = jacobian(q, half, xi, eta, zeta).determinant();
                if !(det > 0.0 && det.is_finite()) {
                    faults.push(format!(
                        "reference shape: volume is {det:.3e} (must be positive) at the corner ({xi}, {eta}, {zeta}); the director must \
                         point to the side from which A, B, C, D run counter-clockwise"
                    ));
                }
            }
        }
        if !faults.is_empty() {
            return Err(AncfError::Input(faults));
        }
        let frame = Frame::new(q, half);
        let mut reference = frame.pair(&frame);
        reference.iter_mut().for_each(|e| *e *= 0.5);
        let centre_j = jacobian(q, half, 0.0, 0.0, 0.0);
        Ok(Self {
            half,
            stiffness: condensed_stiffness(q, laminate, &centre_j),
            reference,
            mass: mass(q, laminate),
            centre: centre_map(&centre_j),
            area: [(-GAUSS, -GAUSS), (GAUSS, -GAUSS), (GAUSS, GAUSS), (-GAUSS, GAUSS)]
                .iter()
                .map(|&(x, y)| {
                    let j = jacobian(q, half, x, y, 0.0);
                    j.column(0).cross(&j.column(1)).norm()
                })
                .sum(),
            volume: centre_j.determinant(),
        })
    }

    /// Mass, kg.
    pub fn total_mass(&self) -> f64 {
        (0..4).flat_map(|i| (0..4).map(move |j| (i, j))).map(|(i, j)| self.mass[2 * i][2 * j]).sum()
    }
}

/// Calls `f(layer index, kx, ky, zeta, weight)` for every integration point; the weights sum to 8, the volume of the cube.
fn integrate(laminate: &Laminate, mut f: impl FnMut(usize, usize, usize, f64, f64)) {
    let total = laminate.thickness();
    let mut below = 0.0;
    for (k, layer) in laminate.layers.iter().enumerate() {
        let (low, high) = (2.0 * below / total - 1.0, 2.0 * (below + layer.thickness) / total - 1.0);
        below += layer.thickness;
        for (x, w) in LAYER_GAUSS {
            let zeta = 0.5 * (low + high) + 0.5 * (high - low) * x;
            for ky in 0..2 {
                for kx in 0..2 {
                    f(k, kx, ky, zeta, 0.5 * (high - low) * w);
                }
            }
        }
    }
}

fn condensed_stiffness(
    q: &[f64; COORDS],
    laminate: &Laminate,
    centre_j: &Matrix3<f64>,
) -> Box<[[f64; STRAINS]; STRAINS]> {
    let half = 0.5 * laminate.thickness();
    let materials: Vec<Matrix6<f64>> = laminate.layers.iter().map(|l| l.material.stiffness()).collect();
    let mut k = Box::new(SMatrix::<f64, STRAINS, STRAINS>::zeros());
    let mut coupling = Enhanced::zeros();
    let mut inner = Matrix5::<f64>::zeros();
    integrate(laminate, |layer, kx, ky, zeta, weight| {
        let (xi, eta) = ([-GAUSS, GAUSS][kx], [-GAUSS, GAUSS][ky]);
        let angle = laminate.layers[layer].angle;
        let j = jacobian(q, half, xi, eta, zeta);
        let det = j.determinant();
        let b = transformation(&j, angle) * covariant(kx, ky, zeta);
        // In the in-plane axes of this point, else the enhanced strains of a distorted element do work on a uniform stress (patch test).
        let g = aligned_transformation(centre_j, &j.column(0).into(), angle)
            * enhancement(xi, eta, zeta)
            * (centre_j.determinant() / det);
        let cb = materials[layer] * b * (det * weight);
        *k += b.transpose() * cb;
        coupling += g.transpose() * cb;
        inner += g.transpose() * materials[layer] * g * (det * weight);
    });
    // The five parameters differ in scale by (h/L)^2 and more: scale before inverting.
    let scale = SVector::<f64, 5>::from_fn(|i, _| 1.0 / inner[(i, i)].sqrt());
    let scaled = Matrix5::from_fn(|i, j| inner[(i, j)] * scale[i] * scale[j]);
    if let Some(inverse) = scaled.try_inverse() {
        let coupling = Enhanced::from_fn(|i, j| coupling[(i, j)] * scale[i]);
        *k -= coupling.transpose() * inverse * coupling;
    }
    let mut out = Box::new([[0.0; STRAINS]; STRAINS]);
    for i in 0..STRAINS {
        for j in 0..STRAINS {
            out[i][j] = 0.5 * (k[(i, j)] + k[(j, i)]);
        }
    }
    out
}

fn mass(q: &[f64; COORDS], laminate: &Laminate) -> [[f64; 8]; 8] {
    let half = 0.5 * laminate.thickness();
    let mut m = [[0.0; 8]; 8];
    integrate(laminate, |layer, kx, ky, zeta, weight| {
        let (xi, eta) = ([-GAUSS, GAUSS][kx], [-GAUSS, GAUSS][ky]);
        let dm = laminate.layers[layer].material.density * jacobian(q, half, xi, eta, zeta).determinant() * weight;
        let n = shape(xi, eta);
        let row = RowSVector::<f64, 8>::from_fn(|_, k| n[k / 2][0] * if k % 2 == 0 { 1.0 } else { zeta * half });
        for i in 0..8 {
            for j in 0..8 {
                m[i][j] += dm * row[i] * row[j];
            }
        }
    });
    m
}

fn centre_map(j: &Matrix3<f64>) -> [[f64; STRAINS]; 3] {
    let mut map = Map::zeros();
    for k in 0..2 {
        map[(0, 3 * k)] = 0.5;
        map[(1, 6 + 3 * k)] = 0.5;
    }
    for k in 0..4 {
        map[(2, 12 + 3 * k)] = 0.25;
    }
    assumed(&mut map, 0.0, 0.0);
    let cartesian = transformation(j, 0.0) * map;
    let row = |r: usize| -> [f64; STRAINS] { std::array::from_fn(|c| cartesian[(r, c)]) };
    [row(0), row(1), row(2)]
}

/// Cartesian strains of a layer are not needed by the solver; tests use this to check the transformation.
#[doc(hidden)]
pub fn transform_for_test(j: &Matrix3<f64>, angle: f64, covariant: &Vector6<f64>) -> Vector6<f64> {
    transformation(j, angle) * covariant
}
