//! Just enough SVG and HTML text for the report.

use std::fmt::{Display, Write};

/// Text made safe for element content and quoted attributes.
pub(super) fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// A drawing under way. Coordinates are user units of its `viewBox`, y downward.
#[derive(Debug, Default)]
pub(super) struct Svg {
    text: String,
}

impl Svg {
    /// Opens a drawing of `width` x `height` user units that scales with the page; `label` is what a screen reader says,
    /// `more` further attributes as text.
    pub fn new(class: &str, width: f64, height: f64, label: &str, more: &str) -> Svg {
        let mut svg = Svg::default();
        svg.raw(&format!(
            "<svg class=\"{class}\" viewBox=\"0 0 {width} {height}\" role=\"img\" aria-label=\"{}\"{more}>",
            escape(label)
        ));
        svg
    }

    /// Appends text as it is.
    pub fn raw(&mut self, text: &str) {
        self.text.push_str(text);
    }

    /// Appends `<name attributes/>`, numbers in tenths of a unit.
    pub fn shape(&mut self, name: &str, class: &str, numbers: &[(&str, f64)]) {
        write!(self.text, "<{name} class=\"{class}\"").unwrap_or_default();
        for (key, value) in numbers {
            write!(self.text, " {key}=\"{}\"", Tenth(*value)).unwrap_or_default();
        }
        self.text.push_str("/>");
    }

    /// Appends a text; `class` sets size and anchor.
    pub fn label(&mut self, class: &str, x: f64, y: f64, text: &str) {
        let (x, y, text) = (Tenth(x), Tenth(y), escape(text));
        write!(self.text, "<text class=\"{class}\" x=\"{x}\" y=\"{y}\">{text}</text>").unwrap_or_default();
    }

    /// Ends the drawing.
    pub fn finish(mut self) -> String {
        self.text.push_str("</svg>");
        self.text
    }
}

/// A coordinate in tenths of a unit, in its shortest form.
pub(super) struct Tenth(pub f64);

impl Display for Tenth {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let tenths = (self.0 * 10.0).round();
        // `+ 0.0` turns a rounded -0 into 0.
        write!(f, "{}", tenths / 10.0 + 0.0)
    }
}

/// The `d` of a path through `lines`, each a run of points: `M1,2 3,4M5,6 7,8`. The page's script reads this form back.
pub(super) fn path(lines: &[Vec<[f64; 2]>]) -> String {
    let mut d = String::new();
    for line in lines {
        for (i, [x, y]) in line.iter().enumerate() {
            let lead = if i == 0 { "M" } else { " " };
            write!(d, "{lead}{},{}", Tenth(*x), Tenth(*y)).unwrap_or_default();
        }
    }
    d
}

/// Bytes as base64 (RFC 4648, with padding), for pictures inside the page.
pub(super) fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for chunk in bytes.chunks(3) {
        let word = chunk.iter().fold(0_u32, |w, b| w << 8 | u32::from(*b)) << (8 * (3 - chunk.len()));
        for i in 0..4 {
            let digit = DIGITS[(word >> (18 - 6 * i) & 63) as usize] as char;
            text.push(if i <= chunk.len() { digit } else { '=' });
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_is_the_standards() {
        // RFC 4648, section 10.
        let known =
            [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("foob", "Zm9vYg=="), ("fooba", "Zm9vYmE=")];
        for (plain, coded) in known {
            assert_eq!(base64(plain.as_bytes()), coded);
        }
    }

    #[test]
    fn coordinates_are_short() {
        assert_eq!(path(&[vec![[1.0, 2.04], [-0.04, 3.96]], vec![[5.0, 6.5]]]), "M1,2 0,4M5,6.5");
    }
}
