//! Side views and the picture of the whole system for the report, from the last frames.

use std::sync::Arc;

use terramech_results::report::{Scene, SceneMesh, SideView, vehicle_frame};

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

/// Field of a mesh whose first component colours it in the picture.
const STRAIN: &str = "strain";

/// The whole system at an angle, where several meshes are in one cloud of grains: the picture and what it shows.
pub fn scene(frames: &[Arc<Frame>]) -> Option<(Vec<u8>, String)> {
    let meshes: Vec<&Arc<Frame>> = frames.iter().filter(|f| f.triangles.is_some()).collect();
    if meshes.len() < 2 {
        return None;
    }
    let mut scene = Scene::default();
    let mut time = None;
    for cloud in frames.iter().filter(|f| f.triangles.is_none()) {
        if let Some(radius) = cloud.real("radius", 1) {
            scene = scene.grains(&cloud.points, radius).ok()?;
            time = Some(cloud.time);
        }
    }
    let mut wheels = Vec::new();
    for mesh in meshes {
        let field = mesh.fields.iter().find(|(name, ..)| name == STRAIN);
        let values = field.and_then(|(name, n, _)| {
            mesh.real(name, *n).map(|v| v.iter().step_by((*n).max(1)).copied().collect::<Vec<_>>())
        });
        let triangles = mesh.triangles.clone().unwrap_or_default();
        let values = values.unwrap_or_default();
        if !values.is_empty() {
            wheels.push(middle(&mesh.points));
        }
        scene = scene.mesh(SceneMesh { points: mesh.points.clone(), triangles, values }).ok()?;
    }
    // What carries the tires is drawn after them: it is no mesh of a unit.
    let frame = vehicle_frame(&wheels);
    let drawn = frame.is_some();
    if let Some(frame) = frame {
        scene = scene.mesh(frame).ok()?;
    }
    let [low, high] = scene.range();
    let mut caption = format!("At t = {} s; soil darker where it is lower.", time?);
    if scene.coloured() {
        caption += &format!(" Colour of meshes: {STRAIN}, first component, from {low:.3} (blue) to {high:.3} (red).");
    }
    if drawn {
        caption += " The vehicle is a schematic from the centres of its wheels.";
    }
    Some((scene.png().ok()?, caption))
}

/// Mean of the vertices.
fn middle(points: &[f64]) -> [f64; 3] {
    let count = (points.len() / 3).max(1) as f64;
    std::array::from_fn(|k| points.iter().skip(k).step_by(3).sum::<f64>() / count)
}

fn middle_y(points: &[f64]) -> f64 {
    let y = points.iter().skip(1).step_by(3);
    let (low, high) = y.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), &y| (a.min(y), b.max(y)));
    if low <= high { 0.5 * (low + high) } else { 0.0 }
}
