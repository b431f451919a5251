//! Bed and bodies from the side: grains as discs coloured by a value, meshes as outlines, axes in equal measure.

use super::plot::draw_axes;
use super::png;
use super::scale::{Shown, pretty_unit, shown, tick_text, ticks};
use super::silhouette::{self, Silhouette};
use super::svg::{Svg, Tenth, base64, escape, path};
use crate::error::{Error, Result};
use std::fmt::Write;

/// A grain as the side view draws it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Disc {
    /// Centre: forward, lateral (larger is farther), up (m).
    pub p: [f64; 3],
    /// Radius (m).
    pub radius: f64,
    /// What its colour shows, SI.
    pub value: f64,
}

/// A view along +y: x to the right, z up.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SideView {
    title: String,
    caption: String,
    discs: Vec<Disc>,
    bodies: Vec<Silhouette>,
    value: (String, String),
    value_max: Option<f64>,
    window: Option<[f64; 2]>,
}

const WIDTH: f64 = 1120.0;
const LEFT: f64 = 70.0;
const RIGHT: f64 = 14.0;
const TOP: f64 = 10.0;
/// Room below the frame: ticks, axis label, colour bar.
const BELOW: f64 = 92.0;
const HEIGHT_MAX: f64 = 520.0;
/// Number of colours on the scale.
const SHADES: usize = 32;
/// Above this many discs a picture of pixels takes less room than a drawing.
const DRAWN_MAX: usize = 5000;
/// Pixels of that picture for each unit of the drawing.
const PIXELS: f64 = 2.0;
/// Beyond this many triangles a body is drawn as an outline without fill.
const FACES_MAX: usize = 4000;

/// Sand at rest to dark red: equal steps of lightness, legible in grey and with colour-blind eyes.
const SCALE: [[u8; 3]; 6] = [
    [0xe9, 0xdc, 0xbd],
    [0xf0, 0xc0, 0x75],
    [0xe8, 0x93, 0x3f],
    [0xcf, 0x5f, 0x2c],
    [0x9e, 0x33, 0x2b],
    [0x5c, 0x16, 0x2b],
];

impl SideView {
    /// An empty view.
    pub fn new(title: impl Into<String>) -> SideView {
        SideView { title: title.into(), value: ("grain speed".into(), "m/s".into()), ..SideView::default() }
    }

    /// With a line of text below it.
    pub fn caption(mut self, caption: impl Into<String>) -> SideView {
        self.caption = caption.into();
        self
    }

    /// Adds the grains that the plane y = `plane_y` cuts, and the layer of grains behind it that shows between them, coloured
    /// by their speed: positions (3N), radii (N), velocities (3N).
    ///
    /// # Errors
    /// [`Error::Length`] when the arrays do not fit each other.
    pub fn grains(mut self, position: &[f64], radius: &[f64], velocity: &[f64], plane_y: f64) -> Result<SideView> {
        Error::length("side view: grain positions", position.len(), 3 * radius.len())?;
        Error::length("side view: grain velocities", velocity.len(), 3 * radius.len())?;
        let grains = position.chunks_exact(3).zip(velocity.chunks_exact(3)).zip(radius);
        self.discs.extend(grains.filter(|((p, _), r)| (-1.0..=3.0).contains(&((p[1] - plane_y) / **r))).map(
            |((p, v), r)| Disc {
                p: [p[0], p[1], p[2]],
                radius: *r,
                value: v.iter().map(|c| c * c).sum::<f64>().sqrt(),
            },
        ));
        Ok(self)
    }

    /// Adds discs chosen by the caller; `label` and `unit` say what their value is.
    pub fn discs(mut self, discs: Vec<Disc>, label: impl Into<String>, unit: impl Into<String>) -> SideView {
        self.discs.extend(discs);
        self.value = (label.into(), unit.into());
        self
    }

    /// Adds a body: vertex positions (3N), triangles (3M, indices from 0, counter-clockwise from outside).
    ///
    /// # Errors
    /// [`Error::Length`], [`Error::Vertex`].
    pub fn mesh(mut self, position: &[f64], triangles: &[i32]) -> Result<SideView> {
        let count = position.len() / 3;
        Error::length("side view: mesh positions", position.len(), 3 * count)?;
        Error::length("side view: mesh triangles", triangles.len(), triangles.len() / 3 * 3)?;
        if let Some(at) = triangles.iter().position(|i| usize::try_from(*i).map_or(true, |i| i >= count)) {
            let (what, vertex) = ("side view".to_owned(), i64::from(triangles[at]));
            return Err(Error::Vertex { what, triangle: at / 3, vertex, count });
        }
        self.bodies.push(silhouette::of(position, triangles));
        Ok(self)
    }

    /// Shows x from..to (m) only.
    pub fn window(mut self, from: f64, to: f64) -> SideView {
        self.window = Some([from, to]);
        self
    }

    /// Ends the colour scale at `max` (SI) instead of at the value that all but 0.3 % of the grains stay below: for views that are
    /// compared.
    pub fn scale_to(mut self, max: f64) -> SideView {
        self.value_max = Some(max);
        self
    }

    /// The end of the colour scale, rounded up to a round number.
    pub fn scale_max(&self) -> f64 {
        let mut values: Vec<f64> = self.discs.iter().map(|d| d.value).filter(|v| v.is_finite()).collect();
        values.sort_by(f64::total_cmp);
        let high = values.get(values.len().saturating_sub(1 + values.len() / 300)).copied().unwrap_or(0.0);
        self.value_max.unwrap_or_else(|| {
            let (marks, _) = ticks([0.0, high], 4);
            let step = marks.get(1).copied().unwrap_or(0.0);
            if step > 0.0 { (high / step).ceil() * step } else { 0.0 }
        })
    }

    /// Ends the colour scale at `max` unless the caller set its end.
    pub(super) fn scale_to_default(mut self, max: f64) -> SideView {
        self.value_max.get_or_insert(max);
        self
    }

    /// Extent in x and z of everything that is finite, a little more than it; `None` when nothing is there.
    fn extent(&self) -> Option<[[f64; 2]; 2]> {
        let mut low = [f64::INFINITY; 2];
        let mut high = [f64::NEG_INFINITY; 2];
        let mut add = |x: f64, z: f64, r: f64| {
            let inside = self.window.is_none_or(|[a, b]| (a..=b).contains(&x));
            if inside && x.is_finite() && z.is_finite() && r.is_finite() {
                low = [low[0].min(x - r), low[1].min(z - r)];
                high = [high[0].max(x + r), high[1].max(z + r)];
            }
        };
        self.discs.iter().for_each(|d| add(d.p[0], d.p[2], d.radius));
        self.bodies.iter().flat_map(|b| b.lines.iter().flatten()).for_each(|p| add(p[0], p[1], 0.0));
        if let Some([a, b]) = self.window {
            (low[0], high[0]) = (a, b);
        }
        let margin = 0.03 * (high[1] - low[1]);
        let size = [high[0] - low[0], high[1] - low[1]];
        (size.iter().all(|s| s.is_finite() && *s > 0.0))
            .then(|| [[low[0] - margin, high[0] + margin], [low[1] - margin, high[1] + margin]])
    }

    /// The view as an HTML figure. `id` tells it from others of the page.
    pub(super) fn html(&self, id: usize) -> String {
        let title = escape(&self.title);
        let Some([xr, zr]) = self.extent() else {
            return format!(
                "<figure class=\"card wide\"><figcaption>{title}</figcaption><p>Nothing to show.</p></figure>"
            );
        };
        let scale = ((WIDTH - LEFT - RIGHT) / (xr[1] - xr[0])).min(HEIGHT_MAX / (zr[1] - zr[0]));
        let (w, h) = (scale * (xr[1] - xr[0]), scale * (zr[1] - zr[0]));
        let frame = [LEFT, TOP, LEFT + w, TOP + h];
        let view = View { scale, origin: [LEFT - scale * xr[0], TOP + scale * zr[1]] };
        let max = self.scale_max();

        let mut svg = Svg::new("side", LEFT + w + RIGHT, TOP + h + BELOW, &self.title, "");
        let unit = Shown { factor: 1.0, unit: "m".into() };
        draw_axes(&mut svg, frame, (xr, &unit, "x"), (zr, &unit, "z"));
        let (x, y) = (Tenth(LEFT), Tenth(TOP));
        let size = format!("x=\"{x}\" y=\"{y}\" width=\"{}\" height=\"{}\"", Tenth(w), Tenth(h));
        svg.raw(&format!("<clipPath id=\"clip{id}\"><rect {size}/></clipPath><g clip-path=\"url(#clip{id})\">"));
        let mut discs: Vec<&Disc> = self.discs.iter().filter(|d| view.shows(d, frame)).collect();
        discs.sort_by(|a, b| b.p[1].total_cmp(&a.p[1]));
        if discs.len() <= DRAWN_MAX {
            draw_discs(&mut svg, &view, &discs, max);
        } else if let Some(png) = paint_discs(&view, &discs, max, frame) {
            let data = base64(&png);
            svg.raw(&format!("<image {size} preserveAspectRatio=\"none\" href=\"data:image/png;base64,{data}\"/>"));
        }
        for body in &self.bodies {
            draw_body(&mut svg, &view, body);
        }
        svg.raw("</g>");
        svg.raw(&format!("<rect class=\"frame\" {size}/>"));
        if !self.discs.is_empty() {
            self.draw_bar(&mut svg, frame, max);
        }
        let mut html = format!("<figure class=\"card wide\"><figcaption>{title}</figcaption>{}", svg.finish());
        if !self.caption.is_empty() {
            write!(html, "<p class=\"note\">{}</p>", escape(&self.caption)).unwrap_or_default();
        }
        html + "</figure>"
    }

    /// The colour bar, below the x axis on the right.
    fn draw_bar(&self, svg: &mut Svg, frame: [f64; 4], max: f64) {
        let (label, unit) = (&self.value.0, &self.value.1);
        let shown = shown(unit, max);
        let width = 300.0_f64.min(0.45 * (frame[2] - frame[0]));
        // The last label may be wider than what is right of the frame.
        let (x, y) = (frame[2] - width - 12.0, frame[3] + 54.0);
        for shade in 0..SHADES {
            let [r, g, b] = colour(shade);
            let step = width / SHADES as f64;
            // Half a unit wider than its share: no seams between neighbours.
            let (x, step) = (Tenth(x + step * shade as f64), Tenth(step + 0.5));
            svg.raw(&format!("<rect x=\"{x}\" y=\"{}\" width=\"{step}\" height=\"12\" ", Tenth(y)));
            svg.raw(&format!("fill=\"#{r:02x}{g:02x}{b:02x}\"/>"));
        }
        let end = if max > 0.0 { max * shown.factor } else { 1.0 };
        let (marks, digits) = if max > 0.0 { ticks([0.0, end], 4) } else { (vec![0.0], 0) };
        let beyond = self.discs.iter().any(|d| d.value > max);
        for mark in &marks {
            // The last colour also stands for everything above.
            let least = if beyond && marks.last() == Some(mark) { "\u{2265} " } else { "" };
            let text = format!("{least}{}", tick_text(*mark, digits));
            svg.label("tick mid", x + width * mark / end, y + 27.0, &text);
        }
        let unit = if max > 0.0 { shown.unit } else { pretty_unit(unit) };
        svg.label("axis end", x - 12.0, y + 11.0, &format!("{label} [{unit}]"));
    }
}

/// From x, z in m to the drawing.
struct View {
    scale: f64,
    origin: [f64; 2],
}

impl View {
    fn at(&self, x: f64, z: f64) -> [f64; 2] {
        [self.origin[0] + self.scale * x, self.origin[1] - self.scale * z]
    }

    fn shows(&self, disc: &Disc, frame: [f64; 4]) -> bool {
        let [x, y] = self.at(disc.p[0], disc.p[2]);
        let r = self.scale * disc.radius;
        x + r > frame[0] && x - r < frame[2] && y + r > frame[1] && y - r < frame[3]
    }
}

fn shade(value: f64, max: f64) -> usize {
    let share = if max > 0.0 { value / max } else { 0.0 };
    // A value that is not a number becomes 0 in the cast.
    ((share * SHADES as f64) as usize).min(SHADES - 1)
}

fn colour(shade: usize) -> [u8; 3] {
    let at = shade as f64 / (SHADES - 1) as f64 * (SCALE.len() - 1) as f64;
    let i = (at as usize).min(SCALE.len() - 2);
    let t = at - i as f64;
    std::array::from_fn(|c| (f64::from(SCALE[i][c]) * (1.0 - t) + f64::from(SCALE[i + 1][c]) * t).round() as u8)
}

/// Circles back to front; neighbours in that order of the same colour share a group.
fn draw_discs(svg: &mut Svg, view: &View, discs: &[&Disc], max: f64) {
    svg.raw("<g class=\"grains\">");
    for run in discs.chunk_by(|a, b| shade(a.value, max) == shade(b.value, max)) {
        let [r, g, b] = colour(shade(run[0].value, max));
        svg.raw(&format!("<g fill=\"#{r:02x}{g:02x}{b:02x}\">"));
        for disc in run {
            let [x, y] = view.at(disc.p[0], disc.p[2]);
            let (x, y, r) = (Tenth(x), Tenth(y), Tenth(view.scale * disc.radius));
            svg.raw(&format!("<circle cx=\"{x}\" cy=\"{y}\" r=\"{r}\"/>"));
        }
        svg.raw("</g>");
    }
    svg.raw("</g>");
}

/// The same as a PNG of the frame.
fn paint_discs(view: &View, discs: &[&Disc], max: f64, frame: [f64; 4]) -> Option<Vec<u8>> {
    let (width, height) = (((frame[2] - frame[0]) * PIXELS) as usize, ((frame[3] - frame[1]) * PIXELS) as usize);
    let mut pixels = vec![0_u8; width * height];
    for disc in discs {
        let [x, y] = view.at(disc.p[0], disc.p[2]);
        let (x, y) = ((x - frame[0]) * PIXELS, (y - frame[1]) * PIXELS);
        let r = (view.scale * disc.radius * PIXELS).max(0.6);
        let fill = 1 + shade(disc.value, max) as u8;
        let span =
            |centre: f64, end: usize| (centre - r).max(0.0) as usize..((centre + r + 1.0).max(0.0) as usize).min(end);
        for row in span(y, height) {
            for column in span(x, width) {
                let d = (column as f64 + 0.5 - x).hypot(row as f64 + 0.5 - y);
                if d <= r {
                    // A darker rim, as the drawn discs have.
                    let rim = if d > r - 1.0 && r > 3.0 { SHADES as u8 } else { 0 };
                    pixels[row * width + column] = fill + rim;
                }
            }
        }
    }
    let mut palette = vec![[0; 3]];
    palette.extend((0..SHADES).map(colour));
    palette.extend((0..SHADES).map(|s| colour(s).map(|c| (f64::from(c) * 0.72) as u8)));
    png::encode(width as u32, height as u32, &pixels, &palette).ok()
}

fn draw_body(svg: &mut Svg, view: &View, body: &Silhouette) {
    if body.faces.len() <= FACES_MAX {
        let faces: Vec<Vec<[f64; 2]>> =
            body.faces.iter().map(|f| f.iter().map(|p| view.at(p[0], p[1])).collect()).collect();
        svg.raw(&format!(
            "<g class=\"body\"><path d=\"{}\"/></g>",
            path(&faces).replace('M', "ZM").trim_start_matches('Z')
        ));
    }
    let lines: Vec<Vec<[f64; 2]>> =
        body.lines.iter().map(|line| line.iter().map(|p| view.at(p[0], p[1])).collect()).collect();
    svg.raw(&format!("<path class=\"outline\" d=\"{}\"/>", path(&lines)));
}
