//! Validation case 1.8: what every element of this kind must satisfy.

use fmu_tire::ancf::element::ElementType;
use fmu_tire::ancf::kernel::{self, Loads, TangentWeights};
use fmu_tire::ancf::laminate::{Laminate, Layer};
use fmu_tire::ancf::material::Orthotropic;
use fmu_tire::ancf::strain::COORDS;
use nalgebra::{Rotation3, Vector3};

fn layers() -> Laminate {
    let fibre =
        Orthotropic { density: 1200.0, young: [2e8, 1e8, 0.8e8], poisson: [0.3, 0.2, 0.25], shear: [4e7, 3e7, 2e7] };
    let rubber = Orthotropic::isotropic(900.0, 3e7, 0.4);
    Laminate {
        layers: vec![
            Layer { thickness: 0.006, angle: 0.35, material: fibre },
            Layer { thickness: 0.003, angle: -0.8, material: fibre },
            Layer { thickness: 0.004, angle: 0.0, material: rubber },
        ],
    }
}

/// A warped, curved element.
fn curved() -> [f64; COORDS] {
    let corners = [(0.0, 0.0, 0.0), (0.21, 0.01, 0.03), (0.2, 0.17, 0.02), (-0.02, 0.16, -0.02)];
    let mut q = [0.0; COORDS];
    for (i, (x, y, z)) in corners.into_iter().enumerate() {
        let d = Vector3::new(0.3 - 2.0 * x, 0.4 - 3.0 * y, 1.0).normalize();
        q[6 * i..6 * i + 6].copy_from_slice(&[x, y, z, d.x, d.y, d.z]);
    }
    q
}

fn wobble(seed: f64, size: f64) -> [f64; COORDS] {
    std::array::from_fn(|i| size * ((i as f64 + 1.0) * seed).sin())
}

fn plus(a: &[f64; COORDS], s: f64, b: &[f64; COORDS]) -> [f64; COORDS] {
    std::array::from_fn(|i| a[i] + s * b[i])
}

const NO_LOADS: Loads = Loads { damping: 0.0, pressure: 0.0 };
const ZERO: [f64; COORDS] = [0.0; COORDS];

#[test]
fn rigid_motion_stores_no_energy() {
    let q = curved();
    let kind = ElementType::new(&q, &layers()).unwrap();
    let turn = Rotation3::from_euler_angles(0.7, -1.9, 2.4);
    let shift = Vector3::new(3.0, -2.0, 1.0);
    let mut moved = q;
    for i in 0..4 {
        let p = turn * Vector3::from_column_slice(&q[6 * i..6 * i + 3]) + shift;
        let d = turn * Vector3::from_column_slice(&q[6 * i + 3..6 * i + 6]);
        moved[6 * i..6 * i + 3].copy_from_slice(p.as_slice());
        moved[6 * i + 3..6 * i + 6].copy_from_slice(d.as_slice());
    }
    let (scale, _) = kernel::energy(&kind, 0.0, &plus(&q, 1.0, &wobble(1.3, 1e-3)), &ZERO);
    let (energy, _) = kernel::energy(&kind, 0.0, &moved, &ZERO);
    assert!(energy.abs() < 1e-20 * scale.max(1.0), "{energy} against {scale}");
    let (force, _) = kernel::force::<f64>(&kind, &NO_LOADS, &moved, &ZERO, &ZERO);
    assert!(force.iter().all(|f| f.abs() < 1e-6), "{force:?}");
    // A rigid rotation rate dissipates nothing.
    let omega = Vector3::new(1.0, 2.0, -0.5);
    let mut v = ZERO;
    for i in 0..8 {
        v[3 * i..3 * i + 3]
            .copy_from_slice(omega.cross(&Vector3::from_column_slice(&moved[3 * i..3 * i + 3])).as_slice());
    }
    assert!(kernel::energy(&kind, 0.1, &moved, &v).1.abs() < 1e-16 * scale.max(1.0));
}

#[test]
fn force_is_the_gradient_of_the_energy() {
    let q = curved();
    let kind = ElementType::new(&q, &layers()).unwrap();
    let x = plus(&q, 1.0, &wobble(1.3, 8e-3));
    let (force, _) = kernel::force::<f64>(&kind, &NO_LOADS, &x, &ZERO, &ZERO);
    let size = force.iter().fold(0.0f64, |m, f| m.max(f.abs()));
    for c in 0..COORDS {
        let mut unit = ZERO;
        unit[c] = 1.0;
        let h = 1e-6;
        let up = kernel::energy(&kind, 0.0, &plus(&x, h, &unit), &ZERO).0;
        let down = kernel::energy(&kind, 0.0, &plus(&x, -h, &unit), &ZERO).0;
        let slope = -(up - down) / (2.0 * h);
        assert!((force[c] - slope).abs() < 2e-8 * size, "coordinate {c}: {} against {slope}", force[c]);
    }
}

#[test]
fn tangent_is_the_derivative_of_the_force() {
    let q = curved();
    let kind = ElementType::new(&q, &layers()).unwrap();
    let (x, v, a) = (plus(&q, 1.0, &wobble(1.3, 8e-3)), wobble(0.7, 0.4), wobble(2.1, 30.0));
    let loads = Loads { damping: 0.03, pressure: 2e5 };
    let w = |stiffness, velocity, mass| TangentWeights { stiffness, velocity, mass, pressure: true, geometric: true };
    // Linear laws take a large step, for less round-off.
    let check = |tangent: [[f64; COORDS]; COORDS], h: f64, f: &dyn Fn(f64, &[f64; COORDS]) -> [f64; COORDS]| {
        let size = tangent.iter().flatten().fold(0.0f64, |m, t| m.max(t.abs()));
        for c in 0..COORDS {
            let mut unit = ZERO;
            unit[c] = 1.0;
            let (up, down) = (f(h, &unit), f(-h, &unit));
            for r in 0..COORDS {
                let slope = -(up[r] - down[r]) / (2.0 * h);
                assert!((tangent[r][c] - slope).abs() < 1e-7 * size, "({r}, {c}): {} against {slope}", tangent[r][c]);
            }
        }
    };
    check(kernel::dispatched_tangent(&kind, &loads, &x, Some(&v), &w(1.0, 0.0, 0.0)), 1e-6, &|h, u| {
        kernel::force::<f64>(&kind, &loads, &plus(&x, h, u), &v, &a).0
    });
    check(kernel::dispatched_tangent(&kind, &loads, &x, Some(&v), &w(0.0, 1.0, 0.0)), 1.0, &|h, u| {
        kernel::force::<f64>(&kind, &loads, &x, &plus(&v, h, u), &a).0
    });
    check(kernel::dispatched_tangent(&kind, &loads, &x, Some(&v), &w(0.0, 0.0, 1.0)), 1e4, &|h, u| {
        kernel::force::<f64>(&kind, &loads, &x, &v, &plus(&a, h, u)).1.map(|m| -m)
    });
}

#[test]
fn layers_of_one_material_are_one_layer() {
    let q = curved();
    let material =
        Orthotropic { density: 1200.0, young: [2e8, 1e8, 0.8e8], poisson: [0.3, 0.2, 0.25], shear: [4e7, 3e7, 2e7] };
    let layer = |thickness| Layer { thickness, angle: 0.4, material };
    let one = ElementType::new(&q, &Laminate { layers: vec![layer(0.012)] }).unwrap();
    let many = ElementType::new(&q, &Laminate { layers: vec![layer(0.001), layer(0.008), layer(0.003)] }).unwrap();
    let size = one.stiffness.iter().flatten().fold(0.0f64, |m, t| m.max(t.abs()));
    for (a, b) in one.stiffness.iter().flatten().zip(many.stiffness.iter().flatten()) {
        assert!((a - b).abs() < 1e-8 * size, "{a} {b}");
    }
    assert!((one.total_mass() - many.total_mass()).abs() < 1e-12);
}

#[test]
fn stiffness_is_never_negative() {
    let kind = ElementType::new(&curved(), &layers()).unwrap();
    let k = nalgebra::DMatrix::from_fn(32, 32, |i, j| kind.stiffness[i][j]);
    let eigenvalues = k.symmetric_eigenvalues();
    let (low, high) = (eigenvalues.min(), eigenvalues.max());
    assert!(low > -1e-12 * high, "{low} {high}");
}

#[test]
fn bad_input_is_named() {
    let mut laminate = layers();
    laminate.layers[1].thickness = -0.001;
    laminate.layers[2].material.poisson = [0.9, 0.9, 0.9];
    let text = ElementType::new(&curved(), &laminate).unwrap_err().to_string();
    assert!(
        text.contains("layer 2: thickness = -0.001 m") && text.contains("layer 3: not positive definite"),
        "{text}"
    );
    let mut flipped = curved();
    (0..4).for_each(|i| (3..6).for_each(|k| flipped[6 * i + k] *= -1.0));
    assert!(ElementType::new(&flipped, &layers()).unwrap_err().to_string().contains("counter-clockwise"));
}

/// Patch test: distorted elements under a uniform in-plane deformation, and under a uniform thickness stretch, leave the inner node in
/// equilibrium.
#[test]
fn patch_test() {
    use fmu_tire::ancf::mesh::{ForceBuffer, Shell, ShellMesh};
    let corners =
        [(0.0, 0.0), (0.4, 0.0), (1.0, 0.0), (0.0, 0.6), (0.55, 0.42), (1.0, 0.5), (0.0, 1.0), (0.35, 1.0), (1.0, 1.0)];
    let reference: Vec<f64> = corners.iter().flat_map(|&(x, y)| [x, y, 0.0, 0.0, 0.0, 1.0]).collect();
    // Isotropic: fibres would follow each element's own x, and the patch would not be uniform.
    let laminate = Laminate::single(0.013, Orthotropic::isotropic(900.0, 3e7, 0.4));
    let shell = |a: u32| Shell { nodes: [a, a + 1, a + 4, a + 3], laminate: 0 };
    let mesh = ShellMesh::new(reference.clone(), [0, 1, 3, 4].map(shell).to_vec(), &[laminate]).unwrap();
    let stretched = |f: [[f64; 2]; 2], thickness: f64| -> Vec<f64> {
        reference
            .chunks(6)
            .flat_map(|n| [f[0][0] * n[0] + f[0][1] * n[1], f[1][0] * n[0] + f[1][1] * n[1], 0.0, 0.0, 0.0, thickness])
            .collect()
    };
    let mut largest = 0.0f64;
    for (f, thickness) in
        [([[1.01, 0.0], [0.0, 1.0]], 1.0), ([[1.02, 0.01], [-0.02, 0.97]], 1.0), ([[1.0, 0.0], [0.0, 1.0]], 0.98)]
    {
        let q = stretched(f, thickness);
        let n = q.len();
        let (mut force, mut inertia) = (vec![0.0; n], vec![0.0; n]);
        mesh.forces(&NO_LOADS, &q, &vec![0.0; n], &vec![0.0; n], &mut ForceBuffer::default(), &mut force, &mut inertia);
        largest = force.iter().fold(largest, |m, f| m.max(f.abs()));
        let inner = (24..27).map(|k| force[k].abs()).fold(0.0, f64::max);
        println!("inner node {inner:.2e} N of {largest:.2e} N");
        assert!(inner < 1e-10 * largest, "{inner} of {largest}");
    }
}
