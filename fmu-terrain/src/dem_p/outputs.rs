//! Outputs that are computed when they are read.

use crate::config::Terrain;
use crate::dem::grains::{R, V, vec_at};
use crate::dem::{Body, DemState, Surface};
use crate::variables::{ObstacleVars, ProbeVars, Variables};
use terramech_fmi2::{UnitError, Values, Var};

/// Writes one of the arrays `grain.*`, by grain number, of the grains in the region that is handed out: a recorder asks for one
/// after the other.
pub fn grain(v: &mut Values, vars: &Variables, state: &DemState, spec: &Terrain, vr: u32) {
    let mut order = state.by_id();
    if let Some(region) = &spec.output {
        order.retain(|&i| (0..3).all(|c| (region.low[c]..=region.high[c]).contains(&state.rows[i as usize][c])));
    }
    let rows = || order.iter().map(|&i| &state.rows[i as usize]);
    if vr == vars.grain_id.vr() {
        let id = v.integers_mut(vars.grain_id);
        id.clear();
        id.extend(order.iter().map(|&i| state.ids[i as usize] as i32));
    } else if vr == vars.grain_position.vr() {
        fill(v.reals_mut(vars.grain_position), rows().flat_map(|r| vec_at(r, 0)));
    } else if vr == vars.grain_velocity.vr() {
        fill(v.reals_mut(vars.grain_velocity), rows().flat_map(|r| vec_at(r, V)));
    } else if vr == vars.grain_radius.vr() {
        fill(v.reals_mut(vars.grain_radius), rows().map(|r| r[R]));
    } else if vr == vars.grain_force.vr() {
        fill(v.reals_mut(vars.grain_force), order.iter().flat_map(|&i| state.force[i as usize]));
    }
}

/// Writes the arrays `obstacle.*`.
pub fn obstacles(v: &mut Values, vars: &ObstacleVars, bodies: &mut [Body]) {
    let (mut positions, mut orientations, mut velocities, mut spins, mut forces, mut vertices, mut triangles) =
        (vec![], vec![], vec![], vec![], vec![], vec![], vec![]);
    for free in bodies.iter_mut().filter_map(|b| b.shape.as_free()) {
        let a = free.now.state.to_array();
        positions.extend(&a[..3]);
        orientations.extend(&a[3..7]);
        velocities.extend(&a[7..10]);
        spins.extend(&a[10..]);
        forces.extend(free.now.load[0]);
        let mesh = free.solid().to_mesh();
        let first = vertices.len() as i32 / 3;
        triangles.extend(mesh.triangles.iter().flatten().map(|k| first + *k as i32));
        vertices.extend(mesh.vertices.iter().flat_map(|p| free.to_world(*p)));
    }
    *v.reals_mut(vars.position) = positions;
    *v.reals_mut(vars.orientation) = orientations;
    *v.reals_mut(vars.velocity) = velocities;
    *v.reals_mut(vars.angular_velocity) = spins;
    *v.reals_mut(vars.force) = forces;
    *v.reals_mut(vars.mesh_position) = vertices;
    *v.integers_mut(vars.mesh_triangle) = triangles;
}

/// Answers a set of probes; `top` is the height of the platform, if the specification has one.
///
/// # Errors
/// A number of reals that is no multiple of 3.
pub fn probes(v: &mut Values, vars: &ProbeVars, state: &DemState, spec: &Terrain, top: f64) -> Result<(), UnitError> {
    let points = v.reals(vars.position);
    if !points.len().is_multiple_of(3) {
        return Err(UnitError::input(format!(
            "probe.position has {} values; allowed: three for each point",
            points.len()
        )));
    }
    let points: Vec<[f64; 2]> = points.chunks_exact(3).map(|p| [p[0], p[1]]).collect();
    let surface = Surface::of(state, spec.bed.length, spec.bed.width);
    let platform = |p: &[f64; 2]| spec.bed.platform.filter(|x| x.carries(&spec.bed, p[0], p[1]));
    let height = |p: &[f64; 2]| surface.at(p[0], p[1]).or(platform(p).map(|_| top)).unwrap_or(0.0);
    fill(v.reals_mut(vars.height), points.iter().map(height));
    let up = [0.0, 0.0, 1.0];
    fill(v.reals_mut(vars.normal), points.iter().flat_map(|p| surface.normal(p[0], p[1]).unwrap_or(up)));
    fill(v.reals_mut(vars.friction), points.iter().map(|p| platform(p).map_or(spec.soil.friction, |x| x.friction)));
    Ok(())
}

fn fill(to: &mut Vec<f64>, from: impl Iterator<Item = f64>) {
    to.clear();
    to.extend(from);
}
