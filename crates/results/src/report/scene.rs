//! A whole system at an angle from above: grains as shaded spheres, meshes coloured by a value on their vertices, as a PNG.
//!
//! Parallel projection into a depth buffer, so that a million grains take a second. The light comes from above and behind the viewer.

use super::png;
use crate::error::{Error, Result};
use std::f64::consts::PI;
use std::path::Path;

/// A mesh of a scene.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SceneMesh {
    /// Vertices x0, y0, z0, x1, ... (m).
    pub points: Vec<f64>,
    /// Triangles, three indices each.
    pub triangles: Vec<i32>,
    /// One value per vertex for its colour; empty: grey.
    pub values: Vec<f64>,
}

/// Grains and meshes, seen from the right front (+x, -y) and above.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Scene {
    grains: Vec<[f64; 4]>,
    meshes: Vec<SceneMesh>,
}

/// Pixels of the picture.
const WIDTH: usize = 1400;
const MOST_HEIGHT: usize = 900;
/// Of the view: turn about z from +x, and height above the horizon (rad).
const AZIMUTH: f64 = -60.0 * PI / 180.0;
const ELEVATION: f64 = 28.0 * PI / 180.0;
/// Room around what is to be seen, over its size (1).
const MARGIN: f64 = 0.06;
const BACKGROUND: [u8; 3] = [0xfb, 0xfa, 0xf7];
/// Low, middle and high values on a mesh: blue, pale, red; colour-blind eyes tell them apart too.
const STRAIN: [[f64; 3]; 5] =
    [[33.0, 72.0, 145.0], [110.0, 160.0, 205.0], [226.0, 222.0, 214.0], [222.0, 140.0, 96.0], [165.0, 30.0, 45.0]];
/// Deep to high soil.
const SOIL: [[f64; 3]; 3] = [[112.0, 88.0, 60.0], [186.0, 154.0, 108.0], [232.0, 212.0, 170.0]];

/// A colour of a scale at `t` from 0 to 1.
fn colour(scale: &[[f64; 3]], t: f64) -> [f64; 3] {
    let x = t.clamp(0.0, 1.0) * (scale.len() - 1) as f64;
    let k = (x as usize).min(scale.len() - 2);
    let f = x - k as f64;
    std::array::from_fn(|c| scale[k][c] * (1.0 - f) + scale[k + 1][c] * f)
}

struct View {
    right: [f64; 3],
    up: [f64; 3],
    towards: [f64; 3],
    scale: f64,
    low: [f64; 2],
    size: [usize; 2],
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

impl View {
    /// Axes of the view: to the right, up, towards the viewer.
    fn axes() -> [[f64; 3]; 3] {
        let ((s, c), (se, ce)) = (AZIMUTH.sin_cos(), ELEVATION.sin_cos());
        let towards = [c * ce, s * ce, se];
        let right = [-s, c, 0.0];
        let up = [-c * se, -s * se, ce];
        [right, up, towards]
    }
    /// Right, up (pixels from the lower left) and depth (m, larger is nearer).
    fn at(&self, p: [f64; 3]) -> [f64; 3] {
        [
            (dot(self.right, p) - self.low[0]) * self.scale,
            (dot(self.up, p) - self.low[1]) * self.scale,
            dot(self.towards, p),
        ]
    }
    /// Shade of a surface whose normal is `n` in axes of the view.
    fn shade(n: [f64; 3]) -> f64 {
        const LIGHT: [f64; 3] = [-0.35, 0.62, 0.70];
        0.42 + 0.62 * dot(n, LIGHT).max(0.0)
    }
}

struct Canvas {
    size: [usize; 2],
    depth: Vec<f64>,
    pixels: Vec<[u8; 3]>,
}

impl Canvas {
    fn put(&mut self, x: usize, y: usize, z: f64, c: [f64; 3], shade: f64) {
        // Rows run downwards.
        let k = (self.size[1] - 1 - y) * self.size[0] + x;
        if z > self.depth[k] {
            self.depth[k] = z;
            self.pixels[k] = c.map(|v| (v * shade).clamp(0.0, 255.0) as u8);
        }
    }
    /// Pixels from `low` to `high` that are in the picture.
    fn span(low: f64, high: f64, size: usize) -> std::ops::Range<usize> {
        let end = (high.ceil().max(-1.0) as i64 + 1).clamp(0, size as i64) as usize;
        (low.floor().max(0.0) as usize).min(end)..end
    }
}

impl Scene {
    /// Adds grains: positions (3n), radii (n). Their colour tells height.
    ///
    /// # Errors
    /// Lengths that do not fit.
    pub fn grains(mut self, position: &[f64], radius: &[f64]) -> Result<Self> {
        Error::length("scene: grain positions", position.len(), 3 * radius.len())?;
        let finite = |p: &&[f64]| p.iter().all(|x| x.is_finite());
        let all = position.chunks_exact(3).filter(finite).zip(radius).map(|(p, r)| [p[0], p[1], p[2], *r]);
        self.grains.extend(all);
        Ok(self)
    }

    /// Adds a mesh.
    ///
    /// # Errors
    /// Indices without a vertex, values that are not one per vertex.
    pub fn mesh(mut self, mesh: SceneMesh) -> Result<Self> {
        let count = mesh.points.len() / 3;
        Error::length("scene: mesh triangles", mesh.triangles.len(), mesh.triangles.len() / 3 * 3)?;
        if let Some(k) = mesh.triangles.iter().position(|k| *k < 0 || *k as usize >= count) {
            let what = "scene: mesh".to_string();
            return Err(Error::Vertex { what, triangle: k / 3, vertex: i64::from(mesh.triangles[k]), count });
        }
        if !mesh.values.is_empty() {
            Error::length("scene: mesh values", mesh.values.len(), count)?;
        }
        self.meshes.push(mesh);
        Ok(self)
    }

    /// Whether a mesh has values.
    pub fn coloured(&self) -> bool {
        self.meshes.iter().any(|m| !m.values.is_empty())
    }

    /// Range of the values on the meshes, symmetric about 0 if they have both signs.
    pub fn range(&self) -> [f64; 2] {
        let values = || self.meshes.iter().flat_map(|m| &m.values).copied().filter(|v| v.is_finite());
        let (low, high) = values().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
        if low < 0.0 && high > 0.0 {
            let m = high.max(-low);
            [-m, m]
        } else if low < high {
            [low, high]
        } else {
            [0.0, 1.0]
        }
    }

    /// The picture: what is to be seen are the meshes with room around them, or all grains where there is no mesh.
    ///
    /// # Errors
    /// Nothing to be seen.
    pub fn png(&self) -> Result<Vec<u8>> {
        let view = self.view()?;
        let count = view.size[0] * view.size[1];
        let mut canvas =
            Canvas { size: view.size, depth: vec![f64::NEG_INFINITY; count], pixels: vec![BACKGROUND; count] };
        self.draw_grains(&view, &mut canvas);
        let range = self.range();
        self.meshes.iter().for_each(|m| draw_mesh(m, range, &view, &mut canvas));
        png::encode_rgb(view.size[0] as u32, view.size[1] as u32, canvas.pixels.as_flattened())
            .map_err(Error::io("draw", Path::new("scene")))
    }

    fn view(&self) -> Result<View> {
        let [right, up, towards] = View::axes();
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        let mut take = |p: [f64; 3], r: f64| {
            for (k, a) in [right, up].into_iter().enumerate() {
                (low[k], high[k]) = (low[k].min(dot(a, p) - r), high[k].max(dot(a, p) + r));
            }
        };
        for p in self.meshes.iter().flat_map(|m| m.points.chunks_exact(3)) {
            take([p[0], p[1], p[2]], 0.0);
        }
        if self.meshes.is_empty() {
            self.grains.iter().for_each(|g| take([g[0], g[1], g[2]], g[3]));
        }
        if !(low[0] < high[0] && low[1] < high[1]) {
            return Err(Error::Length { what: "scene: grains and meshes".into(), given: 0, expected: 1 });
        }
        for k in 0..2 {
            let room = MARGIN * (high[0] - low[0]);
            (low[k], high[k]) = (low[k] - room, high[k] + room);
        }
        let scale = WIDTH as f64 / (high[0] - low[0]);
        let height = ((high[1] - low[1]) * scale).ceil() as usize;
        let (scale, height) = if height > MOST_HEIGHT {
            (scale * MOST_HEIGHT as f64 / height as f64, MOST_HEIGHT)
        } else {
            (scale, height.max(2))
        };
        let width = (((high[0] - low[0]) * scale).ceil() as usize).max(2);
        Ok(View { right, up, towards, scale, low, size: [width, height] })
    }

    fn draw_grains(&self, view: &View, canvas: &mut Canvas) {
        let heights = || self.grains.iter().map(|g| g[2]);
        let (low, high) = heights().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), z| (a.min(z), b.max(z)));
        for g in &self.grains {
            let [x, y, z] = view.at([g[0], g[1], g[2]]);
            let r = (g[3] * view.scale).max(0.5);
            let c = colour(&SOIL, (g[2] - low) / (high - low).max(1e-12));
            for py in Canvas::span(y - r, y + r, canvas.size[1]) {
                for px in Canvas::span(x - r, x + r, canvas.size[0]) {
                    let (dx, dy) = ((px as f64 + 0.5 - x) / r, (py as f64 + 0.5 - y) / r);
                    let rest = 1.0 - dx * dx - dy * dy;
                    if rest > 0.0 {
                        let n = [dx, dy, rest.sqrt()];
                        canvas.put(px, py, z + g[3] * n[2], c, View::shade(n));
                    }
                }
            }
        }
    }
}

fn draw_mesh(mesh: &SceneMesh, [low, high]: [f64; 2], view: &View, canvas: &mut Canvas) {
    let vertex = |k: i32| {
        let p = &mesh.points[3 * k as usize..3 * k as usize + 3];
        view.at([p[0], p[1], p[2]])
    };
    for t in mesh.triangles.chunks_exact(3) {
        let [a, b, c] = [vertex(t[0]), vertex(t[1]), vertex(t[2])];
        let area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        if !(area.is_finite() && area.abs() > 1e-9) {
            continue;
        }
        // The normal in axes of the view, depth in pixels as well; of both sides the one that faces the viewer.
        let (u, v) = (
            [b[0] - a[0], b[1] - a[1], (b[2] - a[2]) * view.scale],
            [c[0] - a[0], c[1] - a[1], (c[2] - a[2]) * view.scale],
        );
        let n = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], area];
        let size = dot(n, n).sqrt() * area.signum();
        let shade = View::shade(n.map(|x| x / size));
        let value = |k: i32| mesh.values.get(k as usize).map_or(f64::NAN, |v| (v - low) / (high - low));
        let values = [value(t[0]), value(t[1]), value(t[2])];
        let bounds = |k: usize| (a[k].min(b[k]).min(c[k]), a[k].max(b[k]).max(c[k]));
        let ((x0, x1), (y0, y1)) = (bounds(0), bounds(1));
        for py in Canvas::span(y0, y1, canvas.size[1]) {
            for px in Canvas::span(x0, x1, canvas.size[0]) {
                let (x, y) = (px as f64 + 0.5, py as f64 + 0.5);
                let wb = ((x - a[0]) * (c[1] - a[1]) - (y - a[1]) * (c[0] - a[0])) / area;
                let wc = ((b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0])) / area;
                let wa = 1.0 - wb - wc;
                if wa < -1e-9 || wb < -1e-9 || wc < -1e-9 {
                    continue;
                }
                let t = wa * values[0] + wb * values[1] + wc * values[2];
                let c3 = if t.is_finite() { colour(&STRAIN, t) } else { [150.0, 152.0, 156.0] };
                canvas.put(px, py, wa * a[2] + wb * b[2] + wc * c[2], c3, shade);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn decoded(png: &[u8]) -> (usize, usize, Vec<[u8; 3]>) {
        use std::io::Read;
        let size = |k: usize| u32::from_be_bytes(png[k..k + 4].try_into().unwrap()) as usize;
        let (w, h) = (size(16), size(20));
        let mut data = Vec::new();
        let mut at = 8;
        while at < png.len() {
            let n = size(at);
            if &png[at + 4..at + 8] == b"IDAT" {
                data.extend_from_slice(&png[at + 8..at + 8 + n]);
            }
            at += n + 12;
        }
        let mut raw = Vec::new();
        flate2::read::ZlibDecoder::new(&data[..]).read_to_end(&mut raw).unwrap();
        let mut out = vec![[0; 3]; w * h];
        for y in 0..h {
            let row = &raw[y * (3 * w + 1)..][..3 * w + 1];
            assert_eq!(row[0], 1, "filter sub");
            for x in 0..w {
                for c in 0..3 {
                    let left = if x > 0 { out[y * w + x - 1][c] } else { 0 };
                    out[y * w + x][c] = row[1 + 3 * x + c].wrapping_add(left);
                }
            }
        }
        (w, h, out)
    }

    #[test]
    fn a_mesh_hides_the_grain_behind_it_and_has_the_colours_of_its_values() {
        // A square that faces the viewer, one half low, one half high; a grain right behind its middle.
        let [right, up, towards] = View::axes();
        let at = |u: f64, v: f64| -> [f64; 3] { std::array::from_fn(|k| u * right[k] + v * up[k]) };
        let points: Vec<f64> = [at(-1.0, -1.0), at(1.0, -1.0), at(1.0, 1.0), at(-1.0, 1.0)].concat();
        let square = SceneMesh { points, triangles: vec![0, 1, 2, 0, 2, 3], values: vec![-1.0, 1.0, 1.0, -1.0] };
        let behind: Vec<f64> = towards.iter().map(|t| -0.5 * t).collect();
        let scene = Scene::default().grains(&behind, &[0.3]).unwrap().mesh(square).unwrap();
        assert_eq!(scene.range(), [-1.0, 1.0]);
        let (w, h, pixels) = decoded(&scene.png().unwrap());
        let pixel = |x: f64, y: f64| pixels[(y * h as f64) as usize * w + (x * w as f64) as usize];
        let (left, middle, right) = (pixel(0.15, 0.5), pixel(0.5, 0.5), pixel(0.85, 0.5));
        assert!(left[2] > left[0] && right[0] > right[2], "blue to red: {left:?} {right:?}");
        assert!(middle.iter().max().unwrap() - middle.iter().min().unwrap() < 30, "pale, and no soil: {middle:?}");
        assert_eq!(pixel(0.01, 0.01), BACKGROUND);
        // The grain alone fills the picture.
        let (w, h, pixels) = decoded(&Scene::default().grains(&behind, &[0.3]).unwrap().png().unwrap());
        assert_ne!(pixels[h / 2 * w + w / 2], BACKGROUND);
        assert!(Scene::default().png().is_err());
        assert!(Scene::default().grains(&[0.0; 4], &[1.0]).is_err());
    }
}
