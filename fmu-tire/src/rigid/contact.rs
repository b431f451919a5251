//! The wrench of forces at vertices about the wheel centre.

use super::error::ContactError;
use terramech_mechanics::{RigidState, TriangleMesh, Vec3};

/// Force (N) and moment (N m) about the wheel centre, in the inertial frame, of `force` (3n) on the vertices `index` (n)
/// of `mesh` placed at `wheel`.
///
/// # Errors
/// Lengths that do not fit, indices out of range or not ascending.
pub fn wrench(
    mesh: &TriangleMesh,
    wheel: &RigidState,
    index: &[i32],
    force: &[f64],
) -> Result<[Vec3; 2], ContactError> {
    if force.len() != 3 * index.len() {
        return Err(ContactError::Length { indices: index.len(), reals: force.len() });
    }
    let mut sum = [Vec3::zeros(); 2];
    let mut previous = -1;
    for (k, (&i, f)) in index.iter().zip(force.chunks_exact(3)).enumerate() {
        if i < 0 || i as usize >= mesh.vertices.len() {
            return Err(ContactError::Range { element: k, index: i, vertices: mesh.vertices.len() });
        }
        if i <= previous {
            return Err(ContactError::Order { element: k, index: i, previous });
        }
        previous = i;
        let f = Vec3::new(f[0], f[1], f[2]);
        let arm = wheel.orientation * mesh.vertex(i as u32);
        sum[0] += f;
        sum[1] += arm.cross(&f);
    }
    Ok(sum)
}
