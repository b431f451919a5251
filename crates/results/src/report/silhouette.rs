//! Outline of a triangle mesh seen along +y: the edges where it turns away from the viewer.

use std::collections::BTreeMap;

/// A mesh as a side view draws it, in x and z (m).
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Silhouette {
    /// Triangles that face the viewer, for a fill.
    pub faces: Vec<[[f64; 2]; 3]>,
    /// Lines of the outline.
    pub lines: Vec<Vec<[f64; 2]>>,
}

/// The silhouette of a mesh: positions (3N), triangles (3M, counter-clockwise from outside). Indices must be valid.
pub(super) fn of(position: &[f64], triangles: &[i32]) -> Silhouette {
    let at = |i: i32| [position[3 * i as usize], position[3 * i as usize + 2]];
    let scale = position.iter().fold(0.0_f64, |m, v| m.max(v.abs())).max(1e-9);
    let mut faces = Vec::new();
    // Orientation of the triangles on either side of each edge, projected: 1 towards the viewer, -1 away, 0 edge-on.
    let mut edges: BTreeMap<(i32, i32), Vec<i8>> = BTreeMap::new();
    for t in triangles.chunks_exact(3) {
        let [a, b, c] = [at(t[0]), at(t[1]), at(t[2])];
        // With x right and z up the viewer stands at y = -infinity: counter-clockwise is towards him.
        let area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        let side = if area.abs() < 1e-9 * scale * scale { 0 } else { area.signum() as i8 };
        if side > 0 {
            faces.push([a, b, c]);
        }
        for (i, j) in [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])] {
            edges.entry((i.min(j), i.max(j))).or_default().push(side);
        }
    }
    let towards = |sides: &[i8]| sides.iter().filter(|s| **s > 0).count();
    // One visible face on one side alone: outline of the part that faces the viewer.
    let outline = edges.iter().filter(|(_, sides)| towards(sides) == 1).map(|(edge, _)| *edge);
    Silhouette { faces, lines: chain(outline, at) }
}

/// Joins edges that share a vertex into lines.
fn chain(edges: impl Iterator<Item = (i32, i32)>, at: impl Fn(i32) -> [f64; 2]) -> Vec<Vec<[f64; 2]>> {
    let mut next: BTreeMap<i32, Vec<i32>> = BTreeMap::new();
    for (a, b) in edges {
        next.entry(a).or_default().push(b);
        next.entry(b).or_default().push(a);
    }
    let mut lines = Vec::new();
    while let Some(start) = next.iter().find(|(_, n)| !n.is_empty()).map(|(v, _)| *v) {
        let mut line = vec![at(start)];
        let mut vertex = start;
        while let Some(to) = next.get_mut(&vertex).and_then(Vec::pop) {
            if let Some(back) = next.get_mut(&to)
                && let Some(i) = back.iter().position(|v| *v == vertex)
            {
                back.swap_remove(i);
            }
            line.push(at(to));
            vertex = to;
        }
        lines.push(line);
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_box_shows_its_front_outline() {
        let corner = |i: i32| [f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2 & 1)];
        let position: Vec<f64> = (0..8).flat_map(corner).collect();
        // Faces counter-clockwise from outside: front (y = 0), back, left, right, bottom, top.
        let quads = [[0, 1, 5, 4], [3, 2, 6, 7], [2, 0, 4, 6], [1, 3, 7, 5], [2, 3, 1, 0], [4, 5, 7, 6]];
        let triangles: Vec<i32> = quads.iter().flat_map(|q| [q[0], q[1], q[2], q[0], q[2], q[3]]).collect();
        let shape = of(&position, &triangles);
        assert_eq!(shape.faces.len(), 2, "only the front faces the viewer");
        assert_eq!(shape.lines.len(), 1);
        assert_eq!(shape.lines[0].len(), 5, "closed, four sides");
        assert_eq!(shape.lines[0][0], shape.lines[0][4]);
    }
}
