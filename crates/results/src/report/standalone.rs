//! A plot as an SVG file of its own, for documentation: title above, legend below, colours of the page on white.

use super::plot::{HEIGHT, Plot};
use super::svg::{Tenth, escape};
use std::fmt::Write;

const TITLE: f64 = 30.0;
const ROW: f64 = 20.0;
/// Average width of a character of the legend (px at 12 px type).
const CHARACTER: f64 = 6.6;

/// The page's classes without its variables, which not every viewer of an SVG file knows.
const STYLE: &str = "text{fill:#1d1f22;font:12px sans-serif}.title{font-size:15px;font-weight:600}.axis{font-size:13px}.mid{text-anchor:middle}\
.end{text-anchor:end}.tick{fill:#5d6470}line.grid{stroke:#e9e7e1}line.zero{stroke:#5d6470;opacity:.55}.frame{fill:none;stroke:#5d6470;opacity:.6}\
.band{fill:#3b6ea51f}.level{fill:none;stroke:#1d1f22;stroke-width:1.4;stroke-dasharray:2 4}.line,.raw{fill:none;stroke-linejoin:round}\
.line{stroke-width:2}.raw{stroke-width:1.35;opacity:.34}.dashed{stroke-dasharray:7 5}";
const COLOURS: [&str; 8] = ["#1f66b0", "#d4570c", "#16845a", "#8a3fa8", "#a87700", "#bf1f5b", "#007f8c", "#6b4a3e"];

impl Plot {
    /// The plot as the text of an SVG file; it needs nothing else.
    pub fn svg(&self) -> String {
        let width = self.width();
        let mut rows = vec![Vec::new()];
        let mut x = 0.0;
        // One curve alone needs no legend, and has none.
        for (swatch, label) in self.entries() {
            let wide = 44.0 + CHARACTER * label.chars().count() as f64;
            if x > 0.0 && x + wide > width - 24.0 {
                rows.push(Vec::new());
                x = 0.0;
            }
            rows.last_mut().expect("never empty").push((x, swatch, label));
            x += wide;
        }
        let height = TITLE + HEIGHT + ROW * rows.len() as f64 + 4.0;
        let mut text = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\">\n<style>{STYLE}"
        );
        for (i, c) in COLOURS.iter().enumerate() {
            write!(text, ".c{i}{{stroke:{c}}}.f{i}{{fill:{c}}}").unwrap_or_default();
        }
        let (drawing, _) = self.drawing(0);
        let placed =
            drawing.replacen("<svg ", &format!("<svg y=\"{TITLE}\" width=\"{width}\" height=\"{HEIGHT}\" "), 1);
        write!(
            text,
            "</style>\n<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n<text class=\"title\" x=\"12\" y=\"20\">{}</text>\n{placed}\n",
            escape(&self.title)
        )
        .unwrap_or_default();
        for (row, entries) in rows.iter().enumerate() {
            let y = TITLE + HEIGHT + ROW * row as f64;
            for (x, swatch, label) in entries {
                let (x, y, label) = (Tenth(x + 12.0), Tenth(y), escape(label));
                writeln!(
                    text,
                    "<g transform=\"translate({x} {y})\">{swatch}<text x=\"30\" y=\"10\">{label}</text></g>"
                )
                .unwrap_or_default();
            }
        }
        text + "</svg>\n"
    }
}

#[cfg(test)]
mod tests {
    use crate::report::{Axis, Plot, Style};

    #[test]
    fn a_plot_alone_is_well_formed_and_holds_its_parts() {
        let x = [0.0, 1.0, 2.0];
        let plot = Plot::new("Wear & tear", Axis::new("time", "s"), Axis::new("pull", "N"))
            .with("computed", &x, &[0.0, 10.0, 5.0], Style::Line)
            .with("measured <1>", &x, &[0.5, 9.0, 6.0], Style::Points);
        let text = plot.svg();
        let mut reader = quick_xml::Reader::from_str(&text);
        let mut depth = 0_i32;
        loop {
            match reader.read_event().expect("well formed") {
                quick_xml::events::Event::Start(_) => depth += 1,
                quick_xml::events::Event::End(_) => depth -= 1,
                quick_xml::events::Event::Eof => break,
                _ => {}
            }
        }
        assert_eq!(depth, 0);
        for part in
            ["Wear &amp; tear", "measured &lt;1&gt;", "pull [N]", "time [s]", "class=\"line c0\"", "class=\"dot f1\""]
        {
            assert!(text.contains(part), "{part} is missing");
        }
    }
}
