//! Plots of a validation part: the errors of all figures, and the curves that tests print.
//!
//! A test prints a curve as one line, `CURVE|file|title|x label|x unit|y label|y unit|style|series|x y;x y;...`; lines of the same
//! file make one plot. `style` is `line`, `dashed` or `points`.

use anyhow::{Context, Result, bail};
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;
use terramech_results::report::{Axis, Level, Plot, Style};

/// The curves printed so far, by file.
#[derive(Default)]
pub struct Curves(BTreeMap<String, Plot>);

impl Curves {
    /// Takes what follows `CURVE|` on a line.
    ///
    /// # Errors
    /// A line that is not of the form above.
    pub fn add(&mut self, line: &str) -> Result<()> {
        let parts: Vec<&str> = line.split('|').map(str::trim).collect();
        let [file, title, x, x_unit, y, y_unit, style, series, points] = parts[..] else {
            bail!("a CURVE line has 9 fields after its name, this has {}: {line:.120}", parts.len());
        };
        let style = match style {
            "line" => Style::Line,
            "dashed" => Style::Dashed,
            "points" => Style::Points,
            _ => bail!("a CURVE's style is line, dashed or points; given: {style}"),
        };
        let number =
            |t: &str| t.parse::<f64>().with_context(|| format!("'{t}' is no number, in the curve {series} of {file}"));
        let (mut xs, mut ys) = (Vec::new(), Vec::new());
        for pair in points.split(';').filter(|p| !p.is_empty()) {
            let (px, py) =
                pair.trim().split_once(' ').with_context(|| format!("'{pair}' is no pair, in {series} of {file}"))?;
            xs.push(number(px)?);
            ys.push(number(py)?);
        }
        let plot = self.0.entry(file.to_string());
        let plot = plot.or_insert_with(|| Plot::new(title, Axis::new(x, x_unit), Axis::new(y, y_unit)));
        *plot = std::mem::take(plot).with(series, &xs, &ys, style);
        Ok(())
    }
}

/// Writes the plots of a part as SVG into `folder`; returns the Markdown that shows them.
///
/// # Errors
/// A file that cannot be written.
pub fn write(folder: &Path, part: &str, title: &str, rows: &[Vec<String>], curves: &Curves) -> Result<String> {
    let mut markdown = String::new();
    let mut add = |file: String, plot: &Plot| -> Result<()> {
        let path = folder.join(&file);
        std::fs::write(&path, plot.svg()).with_context(|| format!("cannot write {}", path.display()))?;
        writeln!(markdown, "![{}]({file})\n", plot.title)?;
        Ok(())
    };
    for (name, plot) in &curves.0 {
        add(format!("{part}-{name}.svg"), plot)?;
    }
    add(format!("{part}.svg"), &errors(title, rows))?;
    Ok(markdown)
}

/// Each figure's error over its tolerance, in the order of the table.
fn errors(title: &str, rows: &[Vec<String>]) -> Plot {
    let (mut x, mut y) = (Vec::new(), Vec::new());
    for (i, row) in rows.iter().enumerate() {
        let number = |k: usize| row.get(k).and_then(|t| t.parse::<f64>().ok());
        if let (Some(expected), Some(computed), Some(tolerance)) = (number(3), number(4), number(5)) {
            x.push((i + 1) as f64);
            // A figure that must be met exactly has tolerance 0.
            y.push(if computed == expected { 0.0 } else { (computed - expected) / tolerance });
        }
    }
    let mut plot = Plot::new(
        format!("{title}: error over tolerance"),
        Axis::new("row of the table", ""),
        Axis::new("error / tolerance", ""),
    );
    plot.wide = true;
    plot.levels = vec![Level { y: 1.0, label: "allowed".into() }, Level { y: -1.0, label: "allowed".into() }];
    plot.levels[1].label.clear();
    plot.with("computed", &x, &y, Style::Points)
}
