//! Writing XML: indented, attributes escaped, one element per line.

use std::fmt::{Display, Write};

/// Writes elements into a text.
pub struct Writer {
    text: String,
    open: Vec<&'static str>,
    /// Whether the last tag still lacks its `>`.
    in_tag: bool,
}

impl Default for Writer {
    fn default() -> Self {
        Self { text: "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n".into(), open: Vec::new(), in_tag: false }
    }
}

impl Writer {
    /// Opens an element; attributes follow by [`Self::attribute`].
    pub fn open(&mut self, name: &'static str) -> &mut Self {
        self.end_tag();
        self.indent();
        self.text.push('<');
        self.text.push_str(name);
        self.open.push(name);
        self.in_tag = true;
        self
    }

    /// Adds an attribute to the element just opened.
    pub fn attribute(&mut self, name: &str, value: impl Display) -> &mut Self {
        debug_assert!(self.in_tag, "attribute {name} after the element's content");
        let mut plain = String::new();
        // Writing into a String cannot fail.
        let _ = write!(plain, "{value}");
        self.text.push(' ');
        self.text.push_str(name);
        self.text.push_str("=\"");
        for c in plain.chars() {
            match c {
                '&' => self.text.push_str("&amp;"),
                '<' => self.text.push_str("&lt;"),
                '>' => self.text.push_str("&gt;"),
                '"' => self.text.push_str("&quot;"),
                // As they are, a reader would turn them into blanks.
                '\n' | '\r' | '\t' => {
                    let _ = write!(self.text, "&#{};", c as u32);
                }
                c => self.text.push(c),
            }
        }
        self.text.push('"');
        self
    }

    /// Adds an attribute if there is a value.
    pub fn optional(&mut self, name: &str, value: Option<impl Display>) -> &mut Self {
        if let Some(value) = value {
            self.attribute(name, value);
        }
        self
    }

    /// Closes the innermost open element.
    pub fn close(&mut self) -> &mut Self {
        if let Some(name) = self.open.pop() {
            if self.in_tag {
                self.text.push_str("/>\n");
                self.in_tag = false;
            } else {
                self.indent();
                self.text.push_str("</");
                self.text.push_str(name);
                self.text.push_str(">\n");
            }
        }
        self
    }

    /// Closes whatever is open and gives the text.
    pub fn finish(mut self) -> String {
        while !self.open.is_empty() {
            self.close();
        }
        self.text
    }

    fn end_tag(&mut self) {
        if self.in_tag {
            self.text.push_str(">\n");
            self.in_tag = false;
        }
    }

    fn indent(&mut self) {
        for _ in 0..self.open.len() {
            self.text.push_str("  ");
        }
    }
}
