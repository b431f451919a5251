//! Mesh of a tire: nodes on the profile, turned about the axle.

use super::AncfError;
use super::laminate::Laminate;
use super::mesh::{NODE, Shell, ShellMesh};
use super::spec::FlexibleTire;
use super::surface::Surface;

/// The mesh of a tire in the wheel's frame (axle Y, centre at the origin). Node (i, j), i around and j across, has index
/// `i (across + 1) + j`; the nodes j = 0 and j = across sit on the rim.
#[derive(Debug, Clone)]
pub struct TireMesh {
    /// The shells.
    pub mesh: ShellMesh,
    /// Elements around.
    pub around: usize,
    /// Elements from bead to bead.
    pub across: usize,
    /// The surface that meets the ground.
    pub surface: Surface,
    /// Undeformed radius, without lugs, m.
    pub radius: f64,
    /// Width, m.
    pub width: f64,
}

impl TireMesh {
    /// Builds the mesh.
    ///
    /// # Errors
    /// [`AncfError::Input`] with all faults.
    pub fn new(spec: &FlexibleTire) -> Result<Self, AncfError> {
        let laminates = spec.laminates()?;
        let profile = spec.profile()?;
        let (around, across) = (spec.divisions as usize, spec.across());
        let mut reference = Vec::with_capacity(NODE * around * (across + 1));
        for i in 0..around {
            let (s, c) = (2.0 * std::f64::consts::PI * i as f64 / around as f64).sin_cos();
            for j in 0..=across {
                let p = profile.at(j as f64 / across as f64);
                let r = spec.rim.radius + p.at[0];
                let length = p.tangent[0].hypot(p.tangent[1]);
                // Tangent across x circumferential direction: outward.
                let (radial, axial) = (p.tangent[1] / length, -p.tangent[0] / length);
                reference.extend([r * c, p.at[1], r * s, radial * c, axial, radial * s]);
            }
        }
        let node = |i: usize, j: usize| ((i % around) * (across + 1) + j) as u32;
        let mut shells = Vec::with_capacity(around * across);
        for i in 0..around {
            for j in 0..across {
                let nodes = [node(i + 1, j), node(i, j), node(i, j + 1), node(i + 1, j + 1)];
                shells.push(Shell { nodes, laminate: section_of(spec, j) });
            }
        }
        let mesh = ShellMesh::new(reference, shells, &laminates)?;
        let lugs = spec.lug_plan()?;
        Ok(Self {
            surface: Surface::new(&mesh, around, across, lugs.as_ref()),
            mesh,
            around,
            across,
            radius: spec.rim.radius + profile.height(),
            width: profile.width(),
        })
    }

    /// Whether a node sits on the rim.
    pub fn on_rim(&self, node: usize) -> bool {
        let j = node % (self.across + 1);
        j == 0 || j == self.across
    }

    /// The nodes on the rim.
    pub fn rim_nodes(&self) -> Vec<u32> {
        (0..self.mesh.node_count()).filter(|&n| self.on_rim(n)).map(|n| n as u32).collect()
    }

    /// Masses of the sections' share, kg, in the order of the specification.
    pub fn section_masses(&self, sections: &[Laminate]) -> Vec<f64> {
        let mut masses = vec![0.0; sections.len()];
        for (e, shell) in self.mesh.shells().iter().enumerate() {
            masses[shell.laminate as usize] += self.mesh.kind(e).total_mass();
        }
        masses
    }
}

fn section_of(spec: &FlexibleTire, j: usize) -> u32 {
    let mut left = j.min(spec.across() - 1 - j);
    for (k, section) in spec.sections.iter().enumerate() {
        if left < section.elements as usize {
            return k as u32;
        }
        left -= section.elements as usize;
    }
    spec.sections.len() as u32 - 1
}
