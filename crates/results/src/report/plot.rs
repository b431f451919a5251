//! Line plots as SVG.

use super::decimate::thin;
use super::scale::{self, Shown, inner_range, join, padded, range, shown, significant, tick_text, ticks};
use super::svg::{Svg, Tenth, escape, path};
use std::fmt::Write;

/// What an axis measures.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Axis {
    /// Name of the quantity.
    pub label: String,
    /// SI unit; empty = dimensionless.
    pub unit: String,
}

impl Axis {
    /// An axis.
    pub fn new(label: impl Into<String>, unit: impl Into<String>) -> Axis {
        Axis { label: label.into(), unit: unit.into() }
    }
}

/// How a series is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Style {
    /// A full line.
    #[default]
    Line,
    /// A thin pale line in the colour of the next full one: raw values under their filtered course. The axis does not
    /// follow its rare spikes; the plot says how far they reach.
    Raw,
    /// A dashed line.
    Dashed,
    /// Dots, for measurements.
    Points,
}

/// One curve.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Series {
    /// Name in the legend.
    pub label: String,
    /// Abscissas in the unit of the plot's x axis; values that are not finite break the line.
    pub x: Vec<f64>,
    /// Ordinates in the unit of the plot's y axis, as many.
    pub y: Vec<f64>,
    /// How it is drawn.
    pub style: Style,
    /// In the colour of the series before it: computed values with the measured ones they belong to.
    pub belongs: bool,
}

/// A marked stretch of the x axis, such as an averaging window.
#[derive(Debug, Clone, PartialEq)]
pub struct Band {
    /// From, in the unit of x.
    pub from: f64,
    /// To.
    pub to: f64,
    /// Name in the legend.
    pub label: String,
}

/// A marked value of the y axis, such as a measured one.
#[derive(Debug, Clone, PartialEq)]
pub struct Level {
    /// The value, in the unit of y.
    pub y: f64,
    /// Name in the legend; empty = not in it.
    pub label: String,
}

/// Curves over one pair of axes.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Plot {
    /// Heading.
    pub title: String,
    /// Abscissa.
    pub x: Axis,
    /// Ordinate.
    pub y: Axis,
    /// The curves; the first is drawn first.
    pub series: Vec<Series>,
    /// Marked stretches of x.
    pub bands: Vec<Band>,
    /// Marked values of y.
    pub levels: Vec<Level>,
    /// Takes the whole width of the page.
    pub wide: bool,
}

pub(super) const HEIGHT: f64 = 290.0;
const LEFT: f64 = 70.0;
const RIGHT: f64 = 14.0;
const TOP: f64 = 10.0;
const BOTTOM: f64 = 46.0;
/// Share of a raw series that may lie beyond the axis at each end.
const SPIKES: f64 = 0.005;

impl Plot {
    /// An empty plot.
    pub fn new(title: impl Into<String>, x: Axis, y: Axis) -> Plot {
        Plot { title: title.into(), x, y, ..Plot::default() }
    }

    /// With one more curve.
    pub fn with(mut self, label: impl Into<String>, x: &[f64], y: &[f64], style: Style) -> Plot {
        self.series.push(Series { label: label.into(), x: x.to_vec(), y: y.to_vec(), style, belongs: false });
        self
    }

    /// With one more curve, in the colour of the one before it.
    pub fn with_same_colour(self, label: impl Into<String>, x: &[f64], y: &[f64], style: Style) -> Plot {
        let mut plot = self.with(label, x, y, style);
        plot.series.iter_mut().last().expect("just added").belongs = true;
        plot
    }

    /// Range of y to draw, and the full range when spikes of raw series reach far beyond it.
    fn y_range(&self) -> ([f64; 2], Option<[f64; 2]>) {
        let of = |raw: bool| self.series.iter().filter(move |s| (s.style == Style::Raw) == raw);
        let levels = range(self.levels.iter().map(|l| &l.y));
        let smooth = of(false).fold(levels, |r, s| join(r, range(&s.y)));
        let full = of(true).fold(smooth, |r, s| join(r, range(&s.y)));
        let inner = of(true).fold(smooth, |r, s| join(r, inner_range(&s.y, SPIKES)));
        match (inner, full) {
            (Some(i), Some(f)) if f[1] - f[0] > 3.0 * (i[1] - i[0]) && i[1] > i[0] => (padded(i), Some(f)),
            (_, f) => (padded(f.unwrap_or([0.0, 1.0])), None),
        }
    }

    /// Number of the colour of each series: a raw one shares that of the next other, one that belongs to the series before that one's.
    fn colours(&self) -> Vec<usize> {
        let mut colours: Vec<usize> = Vec::with_capacity(self.series.len());
        let mut next = 0;
        for (i, s) in self.series.iter().enumerate() {
            if let (true, Some(&before)) = (s.belongs, colours.last()) {
                colours.push(before);
                continue;
            }
            colours.push(next % 8);
            let paired = s.style == Style::Raw && self.series.get(i + 1).is_some_and(|n| n.style != Style::Raw);
            next += usize::from(!paired);
        }
        colours
    }

    /// Width in user units (pixels of a page that does not scale).
    pub(super) fn width(&self) -> f64 {
        if self.wide { 1120.0 } else { 550.0 }
    }

    /// The curves within their axes as an `svg` element of [`Plot::width`] x [`HEIGHT`], and a note on spikes left out. `id` tells
    /// it from others of the page.
    pub(super) fn drawing(&self, id: usize) -> (String, Option<String>) {
        let width = self.width();
        let frame = [LEFT, TOP, width - RIGHT, HEIGHT - BOTTOM];
        let (y_si, spikes) = self.y_range();
        let x_si = self.series.iter().fold(None, |r, s| join(r, range(&s.x))).unwrap_or([0.0, 1.0]);
        let x_si = if x_si[0] < x_si[1] { x_si } else { padded(x_si) };
        // Time and travel keep their unit whatever their size: plots of one run are read side by side.
        let xs = Shown { factor: 1.0, unit: scale::pretty_unit(&self.x.unit) };
        let ys = shown(&self.y.unit, y_si[0].abs().max(y_si[1].abs()));
        let px = |x: f64| frame[0] + (x - x_si[0]) / (x_si[1] - x_si[0]) * (frame[2] - frame[0]);
        let py = |y: f64| frame[3] - (y - y_si[0]) / (y_si[1] - y_si[0]) * (frame[3] - frame[1]);

        let data = format!(
            " data-frame=\"{} {} {} {}\" data-x=\"{} {}\" data-y=\"{} {}\" data-units=\"{}|{}\" data-xname=\"{}\"",
            frame[0],
            frame[1],
            frame[2],
            frame[3],
            x_si[0] * xs.factor,
            x_si[1] * xs.factor,
            y_si[0] * ys.factor,
            y_si[1] * ys.factor,
            escape(&xs.unit),
            escape(&ys.unit),
            escape(&self.x.label),
        );
        let mut svg = Svg::new("plot", width, HEIGHT, &self.title, &data);
        let inside = [("width", frame[2] - frame[0]), ("height", frame[3] - frame[1])];
        let corner = [("x", frame[0]), ("y", frame[1])];
        write_clip(&mut svg, id, frame);
        for band in &self.bands {
            let (a, b) = (px(band.from).clamp(frame[0], frame[2]), px(band.to).clamp(frame[0], frame[2]));
            svg.shape("rect", "band", &[("x", a), ("y", frame[1]), ("width", b - a), ("height", inside[1].1)]);
        }
        draw_axes(&mut svg, frame, (x_si, &xs, &self.x.label), (y_si, &ys, &self.y.label));
        svg.raw(&format!("<g clip-path=\"url(#clip{id})\">"));
        for level in &self.levels {
            let y = py(level.y);
            svg.shape("line", "level", &[("x1", frame[0]), ("x2", frame[2]), ("y1", y), ("y2", y)]);
        }
        for (series, colour) in self.series.iter().zip(self.colours()) {
            // Clamped far outside the frame: a spike of 1e300 must not reach the file as 300 digits.
            let on_page = |v: f64, p: f64| if v.is_finite() { p.clamp(-1e4, 1e4) } else { f64::NAN };
            let x: Vec<f64> = series.x.iter().map(|v| on_page(*v, px(*v))).collect();
            let y: Vec<f64> = series.y.iter().map(|v| on_page(*v, py(*v))).collect();
            let style = series.style.class();
            let label = escape(&series.label);
            if series.style == Style::Points {
                for [x, y] in x.iter().zip(&y).map(|(x, y)| [*x, *y]).filter(|p| p[0].is_finite() && p[1].is_finite()) {
                    svg.shape("circle", &format!("dot f{colour}"), &[("cx", x), ("cy", y), ("r", 3.0)]);
                }
                continue;
            }
            let d = path(&thin(&x, &y, 0.2));
            svg.raw(&format!("<path class=\"{style} c{colour}\" data-label=\"{label}\" d=\"{d}\"/>"));
        }
        svg.raw("</g>");
        svg.shape("rect", "frame", &[corner, inside].concat());
        svg.raw("<g class=\"cursor\"></g>");

        let note = spikes.map(|[low, high]| {
            let text = |v: f64| significant(v * ys.factor, 3);
            let (low, high, unit) = (text(low), text(high), &ys.unit);
            format!("Raw values reach from {low} to {high} {unit}; the axis leaves rare spikes out.")
        });
        (svg.finish(), note)
    }

    /// The plot as an HTML figure. `id` tells it from others of the page.
    pub(super) fn html(&self, id: usize) -> String {
        let wide = if self.wide { " wide" } else { "" };
        let (drawing, note) = self.drawing(id);
        let note = note.map(|n| format!("<p class=\"note\">{}</p>", escape(&n))).unwrap_or_default();
        let (title, legend) = (escape(&self.title), self.legend());
        format!("<figure class=\"card{wide}\"><figcaption>{title}</figcaption>{legend}{drawing}{note}</figure>")
    }

    /// Entries of the legend: a swatch drawn within 24 x 12 units, and the text.
    pub(super) fn entries(&self) -> Vec<(String, String)> {
        let mut entries: Vec<(String, String)> = Vec::new();
        let single = self.series.len() == 1;
        for (series, colour) in self.series.iter().zip(self.colours()).filter(|_| !single) {
            let swatch = match series.style {
                Style::Points => format!("<circle class=\"dot f{colour}\" cx=\"12\" cy=\"6\" r=\"3\"/>"),
                _ => format!("<path class=\"{} c{colour}\" d=\"M1,6 23,6\"/>", series.style.class()),
            };
            entries.push((swatch, series.label.clone()));
        }
        for level in self.levels.iter().filter(|l| !l.label.is_empty()) {
            entries.push(("<path class=\"level\" d=\"M1,6 23,6\"/>".into(), level.label.clone()));
        }
        for band in &self.bands {
            entries
                .push(("<rect class=\"band\" x=\"1\" y=\"1\" width=\"22\" height=\"10\"/>".into(), band.label.clone()));
        }
        entries
    }

    fn legend(&self) -> String {
        // The line is there even when empty, so that plots side by side align.
        let items = self.entries().iter().fold(String::new(), |mut text, (swatch, label)| {
            let label = escape(label);
            write!(text, "<span><svg viewBox=\"0 0 24 12\" class=\"key\">{swatch}</svg>{label}</span>")
                .unwrap_or_default();
            text
        });
        format!("<div class=\"legend\">{items}</div>")
    }
}

impl Style {
    fn class(self) -> &'static str {
        match self {
            Style::Line => "line",
            Style::Raw => "raw",
            Style::Dashed => "line dashed",
            Style::Points => "dot",
        }
    }
}

fn write_clip(svg: &mut Svg, id: usize, [x0, y0, x1, y1]: [f64; 4]) {
    svg.raw(&format!("<clipPath id=\"clip{id}\">"));
    svg.shape("rect", "", &[("x", x0), ("y", y0 - 1.0), ("width", x1 - x0), ("height", y1 - y0 + 2.0)]);
    svg.raw("</clipPath>");
}

/// Grid, ticks and labels around a frame; each axis is its range in SI, how it is shown, and its name.
pub(super) fn draw_axes(
    svg: &mut Svg,
    [x0, y0, x1, y1]: [f64; 4],
    (x_si, xs, x_label): ([f64; 2], &Shown, &str),
    (y_si, ys, y_label): ([f64; 2], &Shown, &str),
) {
    let (xr, yr) = (x_si.map(|v| v * xs.factor), y_si.map(|v| v * ys.factor));
    let count = |length: f64, each: f64| (length / each).round().max(2.0) as usize;
    let (x_ticks, digits) = ticks(xr, count(x1 - x0, 75.0));
    for tick in x_ticks {
        let x = x0 + (tick - xr[0]) / (xr[1] - xr[0]) * (x1 - x0);
        svg.shape("line", "grid", &[("x1", x), ("x2", x), ("y1", y0), ("y2", y1)]);
        svg.label("tick mid", x, y1 + 16.0, &tick_text(tick, digits));
    }
    let (y_ticks, digits) = ticks(yr, count(y1 - y0, 42.0));
    for tick in y_ticks {
        let y = y1 - (tick - yr[0]) / (yr[1] - yr[0]) * (y1 - y0);
        let class = if tick == 0.0 && yr[0] < 0.0 { "zero" } else { "grid" };
        svg.shape("line", class, &[("x1", x0), ("x2", x1), ("y1", y), ("y2", y)]);
        svg.label("tick end", x0 - 7.0, y + 4.0, &tick_text(tick, digits));
    }
    svg.label("axis mid", 0.5 * (x0 + x1), y1 + 37.0, &format!("{x_label} [{}]", xs.unit));
    let middle = 0.5 * (y0 + y1);
    svg.raw(&format!("<g transform=\"translate(14 {}) rotate(-90)\">", Tenth(middle)));
    svg.label("axis mid", 0.0, 0.0, &format!("{y_label} [{}]", ys.unit));
    svg.raw("</g>");
}
