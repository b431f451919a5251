//! Side views for the report, from the last frames.

use std::sync::Arc;

use terramech_results::report::SideView;

use super::frames::Frame;

/// A view for each cloud of grains, with all meshes in it: the cut goes through the middle of the first mesh, or of the
/// bed where there is none.
pub fn side_views(frames: &[Arc<Frame>]) -> Vec<SideView> {
    let meshes: Vec<&Arc<Frame>> = frames.iter().filter(|f| f.triangles.is_some()).collect();
    let clouds = frames.iter().filter(|f| f.triangles.is_none() && !f.points.is_empty());
    clouds
        .filter_map(|cloud| {
            let middle = meshes.first().map_or_else(|| middle_y(&cloud.points), |m| middle_y(&m.points));
            let radius = cloud.real("radius", 1)?;
            let still = vec![0.0; cloud.points.len()];
            let velocity = cloud.real("velocity", 3).unwrap_or(&still);
            let mut view = SideView::new(format!("{} at t = {} s", cloud.name, cloud.time))
                .caption(format!("Cut along the plane y = {middle:.4} m"))
                .grains(&cloud.points, radius, velocity, middle)
                .ok()?;
            for mesh in &meshes {
                view = view.mesh(&mesh.points, mesh.triangles.as_deref().unwrap_or_default()).ok()?;
            }
            Some(view)
        })
        .collect()
}

fn middle_y(points: &[f64]) -> f64 {
    let y = points.iter().skip(1).step_by(3);
    let (low, high) = y.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), &y| (a.min(y), b.max(y)));
    if low <= high { 0.5 * (low + high) } else { 0.0 }
}
