//! Layers of a shell, stacked from the bottom face along the director.

use super::material::Orthotropic;

/// One layer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Layer {
    /// Thickness, m.
    pub thickness: f64,
    /// Angle of the fibre axis from the element's local x, about the normal, rad.
    pub angle: f64,
    /// Material.
    pub material: Orthotropic,
}

/// Layers from the bottom face to the top; the node's position lies on the mid-surface of the stack.
#[derive(Debug, Clone, PartialEq)]
pub struct Laminate {
    /// The layers.
    pub layers: Vec<Layer>,
}

impl Laminate {
    /// One layer of one material, fibre along local x.
    pub fn single(thickness: f64, material: Orthotropic) -> Self {
        Self { layers: vec![Layer { thickness, angle: 0.0, material }] }
    }

    /// Total thickness, m.
    pub fn thickness(&self) -> f64 {
        self.layers.iter().map(|l| l.thickness).sum()
    }

    /// Mass per area, kg/m2.
    pub fn surface_density(&self) -> f64 {
        self.layers.iter().map(|l| l.thickness * l.material.density).sum()
    }

    /// What forbids this laminate; empty if nothing.
    pub fn faults(&self) -> Vec<String> {
        let mut faults = Vec::new();
        if self.layers.is_empty() {
            faults.push("no layers: at least one is needed".to_owned());
        }
        for (k, layer) in self.layers.iter().enumerate() {
            if !(layer.thickness > 0.0 && layer.thickness.is_finite()) {
                faults.push(format!("layer {}: thickness = {} m: must be positive", k + 1, layer.thickness));
            }
            if !layer.angle.is_finite() {
                faults.push(format!("layer {}: angle = {} rad: must be finite", k + 1, layer.angle));
            }
            faults.extend(layer.material.faults().into_iter().map(|f| format!("layer {}: {f}", k + 1)));
        }
        faults
    }
}
