//! What can be read off a tire: contact, deflection, strains, energies, compliance, the hub's share.

use super::{Hub, Tire, Wrench};
use crate::ancf::geometry::TireMesh;
use crate::ancf::kernel::Loads;
use crate::ancf::mesh::NODE;
use crate::ancf::plane::PlaneLoad;
use nalgebra::{Matrix3, Vector3};

/// Energies of a tire, J.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Energies {
    /// Strain energy, inflation included.
    pub strain: f64,
    /// Kinetic energy.
    pub kinetic: f64,
    /// Work of the pressure since inflation.
    pub pressure_work: f64,
    /// Dissipated by the structural damping since the tire was placed: what the forces inside did beyond energy and pressure work.
    pub dissipated: f64,
    /// Work of the ground on the tire since it was placed: plane, friction included, and given vertex forces.
    pub ground_work: f64,
}

impl Tire {
    /// Forces of the plane on vertices of the surface at the present state, N.
    pub fn plane_forces(&self) -> Vec<(u32, [f64; 3])> {
        self.state.plane.as_ref().map_or(Vec::new(), |plane| {
            PlaneLoad { plane, surface: &self.mesh.surface, contact: &self.spec.contact, since: 0.0 }
                .forces(&self.state.shell.q, &self.state.shell.v)
        })
    }

    /// The hub's share of a wrench over a step with these mean accelerations: what the vehicle integrates instead, added back.
    pub fn hub_share(&self, acceleration: &Vector3<f64>, angular: &Vector3<f64>) -> Wrench {
        let turn = self.state.rim.orientation.to_rotation_matrix();
        let inertia = turn * Matrix3::from_diagonal(&Vector3::from(self.hub.inertia)) * turn.inverse();
        let w = self.state.rim.angular_velocity;
        Wrench {
            force: (acceleration - Vector3::from(self.gravity)) * self.hub.mass,
            moment: inertia * angular + w.cross(&(inertia * w)),
        }
    }

    /// Estimated displacement of each vertex per newton held over a step of `h` seconds, m/N: the inverse of the diagonal of inertia, damping
    /// and stiffness; 0 on the rim.
    pub fn compliance(&mut self, h: f64) -> Vec<f64> {
        let weights = crate::ancf::kernel::TangentWeights {
            stiffness: 1.0,
            velocity: 1.0 / h,
            mass: 1.0 / (h * h),
            pressure: false,
            geometric: false,
        };
        let loads = Loads { damping: self.spec.damping, pressure: self.spec.pressure };
        let mut out = vec![0.0; self.mesh.mesh.node_count()];
        let assembly = self.hht.assembly_mut();
        assembly.assemble(&self.mesh.mesh, &loads, &self.inflated, &weights, &[]);
        for (&node, d) in assembly.free_nodes().iter().zip(assembly.mean_diagonal()) {
            out[node as usize] = 1.0 / d;
        }
        self.factor_orientation = None;
        let surface = &self.mesh.surface;
        (0..surface.len()).map(|k| out[surface.vertex(k).node as usize]).collect()
    }

    /// Volume that the shells enclose, m3: of the bilinear elements that the pressure acts on, exactly (the mean of both ways to cut them
    /// into triangles).
    pub fn volume(&self) -> f64 {
        let q = &self.state.shell.q;
        let p =
            |n: u32| Vector3::from_column_slice(&q[NODE * n as usize..NODE * n as usize + 3]) - self.state.rim.position;
        let six = |a: u32, b: u32, c: u32| p(a).dot(&p(b).cross(&p(c)));
        let mut sum = 0.0;
        for shell in self.mesh.mesh.shells() {
            let [a, b, c, d] = shell.nodes;
            sum += 0.5 * (six(a, b, c) + six(a, c, d) + six(a, b, d) + six(b, c, d));
        }
        let strip = &self.mesh.surface.triangles[2 * self.mesh.mesh.shells().len()..][..2 * self.mesh.around];
        sum += strip.iter().map(|t| six(t[0], t[1], t[2])).sum::<f64>();
        sum / 6.0
    }

    /// Largest inward movement of the crown against the inflated shape, m.
    pub fn deflection(&self) -> f64 {
        let axle = self.state.rim.orientation * Vector3::y();
        let (row, crown) = (self.mesh.across + 1, self.mesh.across / 2);
        let free = (self.inflated[NODE * crown].powi(2) + self.inflated[NODE * crown + 2].powi(2)).sqrt();
        (0..self.mesh.around)
            .map(|i| {
                let n = NODE * (i * row + crown);
                let arm = Vector3::from_column_slice(&self.state.shell.q[n..n + 3]) - self.state.rim.position;
                free - (arm - axle * axle.dot(&arm)).norm()
            })
            .fold(f64::MIN, f64::max)
    }

    /// Strains at the middle of each element: circumferential, radial (across), shear.
    pub fn strains(&self) -> Vec<[f64; 3]> {
        let mesh = &self.mesh.mesh;
        (0..mesh.shells().len())
            .map(|e| {
                let local = crate::ancf::mesh::gather(&self.state.shell.q, &mesh.shells()[e].nodes);
                crate::ancf::kernel::centre_strain(mesh.kind(e), &local)
            })
            .collect()
    }

    /// The same at each vertex of the surface: mean over the elements around its node.
    pub fn vertex_strains(&self) -> Vec<[f64; 3]> {
        let mut sums = vec![([0.0; 3], 0.0); self.mesh.mesh.node_count()];
        for (shell, strain) in self.mesh.mesh.shells().iter().zip(self.strains()) {
            for &n in &shell.nodes {
                let (sum, count) = &mut sums[n as usize];
                (0..3).for_each(|k| sum[k] += strain[k]);
                *count += 1.0;
            }
        }
        let surface = &self.mesh.surface;
        (0..surface.len())
            .map(|k| {
                let (sum, count) = sums[surface.vertex(k).node as usize];
                sum.map(|x| x / f64::max(count, 1.0))
            })
            .collect()
    }

    /// Strain energy, J.
    pub fn strain_energy(&self) -> f64 {
        self.mesh.mesh.energy(0.0, &self.state.shell.q, &self.state.shell.v).0
    }

    /// Growth of the strain energy and work of the pressure since inflation, J.
    pub(super) fn since_inflation(&self) -> (f64, f64) {
        (self.strain_energy() - self.inflated_energy, self.spec.pressure * (self.volume() - self.inflated_volume))
    }

    /// Where the work went since the tire was placed.
    pub fn energies(&self) -> Energies {
        let (growth, pressure) = self.since_inflation();
        let inside = self.state.shell.work - self.state.ground_work;
        Energies {
            strain: self.inflated_energy + growth,
            kinetic: self.mesh.mesh.kinetic_energy(&self.state.shell.v),
            pressure_work: pressure,
            dissipated: pressure - growth - inside,
            ground_work: self.state.ground_work,
        }
    }
}

/// Mass and moments of inertia of the whole tire about the wheel's axes, in the inflated shape.
pub(super) fn hub(tire: &TireMesh, q: &[f64]) -> Hub {
    let mut inertia = [0.0; 3];
    for axis in 0..3 {
        // Twice the kinetic energy of a unit turn.
        let omega = Vector3::ith(axis, 1.0);
        let v: Vec<f64> =
            q.chunks_exact(3).flat_map(|x| <[f64; 3]>::from(omega.cross(&Vector3::from_column_slice(x)))).collect();
        inertia[axis] = 2.0 * tire.mesh.kinetic_energy(&v);
    }
    Hub { mass: tire.mesh.total_mass(), inertia }
}
