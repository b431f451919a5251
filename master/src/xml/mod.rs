//! XML documents as a flat tree with line numbers, read within limits.
//!
//! Elements are looked up by local name, so that any namespace prefix will do. Of text between tags the first
//! piece of each element is kept: neither FMI 2.0 nor SSP puts data there, OSP does. A document type definition is refused, so no entity of the file's own making exists.
//!
//! Namespaces are not resolved: every file we read has one vocabulary per subtree, and tools disagree on the prefixes.

mod encoding;
pub mod write;

use std::path::Path;

use quick_xml::events::{BytesStart, Event};
use quick_xml::reader::Reader;

use crate::fault::{Fault, FaultKind, Faults, Place};

/// Limits of one document. The defaults hold a model of some hundred thousand variables and bound what a hostile file costs.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// Bytes of the file.
    pub bytes: u64,
    /// Elements.
    pub elements: usize,
    /// Nesting of elements.
    pub depth: usize,
    /// Attributes of one element.
    pub attributes: usize,
}

impl Default for Limits {
    fn default() -> Self {
        Self { bytes: 256 << 20, elements: 4_000_000, depth: 64, attributes: 64 }
    }
}

#[derive(Clone, Copy)]
struct Span {
    start: u32,
    end: u32,
}

struct Node {
    name: Span,
    attributes: (u32, u32),
    parent: u32,
    first_child: u32,
    next: u32,
    line: u32,
    /// The first text inside it that is not blank.
    text: Span,
}

const NONE: u32 = u32::MAX;

/// A parsed document.
pub struct Document {
    /// All names and attribute values, one after the other: one allocation instead of one for each.
    text: String,
    nodes: Vec<Node>,
    attributes: Vec<(Span, Span)>,
    place: Place,
}

/// An element of a [`Document`]; cheap to copy.
#[derive(Clone, Copy)]
pub struct Element<'d> {
    document: &'d Document,
    index: u32,
}

impl Document {
    /// Reads a document from the bytes of a file; `file` is its name in messages.
    ///
    /// # Errors
    /// The first thing that makes it no document we read, with its line.
    pub fn read(bytes: &[u8], file: &Path, limits: Limits) -> Result<Self, Fault> {
        let place = Place::file(file);
        let fault = |line: u32, kind| Fault::new(place.at(line), "", kind);
        // Offsets are kept in 32 bits.
        let most = limits.bytes.min(1 << 31);
        if bytes.len() as u64 > most {
            return Err(fault(0, FaultKind::TooMuch { what: "bytes", given: bytes.len() as u64, allowed: most }));
        }
        let source = encoding::decode(bytes).map_err(|reason| fault(0, FaultKind::Xml { reason }))?;
        let mut reader = Reader::from_str(&source);
        reader.config_mut().check_comments = false;
        let mut builder = Builder {
            document: Self { text: String::new(), nodes: Vec::new(), attributes: Vec::new(), place: place.clone() },
            open: Vec::new(),
            last_child: Vec::new(),
            limits,
        };
        let (mut line, mut counted) = (1_u32, 0_usize);
        loop {
            let start = reader.buffer_position() as usize;
            let event = reader.read_event();
            // Line of the event's first byte. Newlines are counted once, going forward.
            let upto = match &event {
                Ok(_) => start,
                Err(_) => reader.error_position() as usize,
            };
            if let Some(passed) = source.as_bytes().get(counted..upto) {
                line += passed.iter().filter(|&&b| b == b'\n').count() as u32;
                counted = upto;
            }
            let event = event.map_err(|e| fault(line, FaultKind::Xml { reason: e.to_string() }))?;
            match event {
                Event::Start(tag) => builder.open(&tag, line, true),
                Event::Empty(tag) => builder.open(&tag, line, false),
                Event::End(_) => {
                    builder.close();
                    Ok(())
                }
                Event::Text(text) => {
                    builder.text(&text);
                    Ok(())
                }
                Event::DocType(_) => Err(FaultKind::Doctype),
                Event::Eof => break,
                _ => Ok(()),
            }
            .map_err(|kind| fault(line, kind))?;
        }
        if !builder.open.is_empty() {
            return Err(fault(line, FaultKind::Xml { reason: "the file ends inside an element (cut off?)".into() }));
        }
        if builder.document.nodes.is_empty() {
            return Err(fault(0, FaultKind::Xml { reason: "there is no element".into() }));
        }
        Ok(builder.document)
    }

    /// The root element.
    pub fn root(&self) -> Element<'_> {
        Element { document: self, index: 0 }
    }

    /// All elements, in the order of the file.
    pub fn elements(&self) -> impl Iterator<Item = Element<'_>> {
        (0..self.nodes.len() as u32).map(|index| Element { document: self, index })
    }

    /// The root element, if it has that local name.
    ///
    /// # Errors
    /// [`FaultKind::WrongRoot`].
    pub fn root_named(&self, name: &'static str) -> Result<Element<'_>, Fault> {
        let root = self.root();
        if root.name() == name {
            return Ok(root);
        }
        let kind = FaultKind::WrongRoot { given: root.name().chars().take(60).collect(), allowed: name };
        Err(Fault::new(root.place(), "", kind))
    }

    /// The file.
    pub fn place(&self) -> &Place {
        &self.place
    }

    fn get(&self, span: Span) -> &str {
        &self.text[span.start as usize..span.end as usize]
    }
}

struct Builder {
    document: Document,
    open: Vec<u32>,
    /// Last child so far of each open element, and of the document itself.
    last_child: Vec<u32>,
    limits: Limits,
}

impl Builder {
    fn span(&mut self, text: &str) -> Span {
        let start = self.document.text.len() as u32;
        self.document.text.push_str(text);
        Span { start, end: self.document.text.len() as u32 }
    }

    fn open(&mut self, tag: &BytesStart<'_>, line: u32, has_content: bool) -> Result<(), FaultKind> {
        let nodes = self.document.nodes.len();
        if nodes >= self.limits.elements {
            let allowed = self.limits.elements as u64;
            return Err(FaultKind::TooMuch { what: "elements", given: allowed + 1, allowed });
        }
        if self.open.len() >= self.limits.depth {
            let allowed = self.limits.depth as u64;
            return Err(FaultKind::TooMuch { what: "levels of nested elements", given: allowed + 1, allowed });
        }
        if self.open.is_empty() && nodes > 0 {
            return Err(FaultKind::Xml { reason: "there is more than one root element".into() });
        }
        let name = self.span(tag.local_name().into_inner());
        let first = self.document.attributes.len();
        for attribute in tag.attributes() {
            let attribute = attribute.map_err(|e| FaultKind::Xml { reason: e.to_string() })?;
            let count = self.document.attributes.len() - first;
            if count >= self.limits.attributes {
                let allowed = self.limits.attributes as u64;
                return Err(FaultKind::TooMuch { what: "attributes on one element", given: allowed + 1, allowed });
            }
            let key = attribute.key;
            if key.as_namespace_binding().is_some() {
                continue;
            }
            let value = attribute
                .normalized_value(quick_xml::XmlVersion::Implicit1_0)
                .map_err(|e| FaultKind::Xml { reason: format!("attribute {}: {e}", key.into_inner()) })?;
            let key = self.span(key.local_name().into_inner());
            let value = self.span(&value);
            self.document.attributes.push((key, value));
        }
        let index = nodes as u32;
        let parent = self.open.last().copied().unwrap_or(NONE);
        if let Some(last) = self.last_child.last_mut() {
            if *last == NONE {
                self.document.nodes[parent as usize].first_child = index;
            } else {
                self.document.nodes[*last as usize].next = index;
            }
            *last = index;
        }
        let attributes = (first as u32, self.document.attributes.len() as u32);
        let text = Span { start: 0, end: 0 };
        self.document.nodes.push(Node { name, attributes, parent, first_child: NONE, next: NONE, line, text });
        if has_content {
            self.open.push(index);
            self.last_child.push(NONE);
        }
        Ok(())
    }

    fn text(&mut self, text: &str) {
        let text = text.trim_matches(|c: char| c.is_ascii_whitespace());
        let Some(&index) = self.open.last().filter(|_| !text.is_empty()) else { return };
        if self.document.nodes[index as usize].text.end == 0 {
            self.document.nodes[index as usize].text = self.span(text);
        }
    }

    fn close(&mut self) {
        self.open.pop();
        self.last_child.pop();
    }
}

impl<'d> Element<'d> {
    fn node(self) -> &'d Node {
        &self.document.nodes[self.index as usize]
    }

    /// Local name.
    pub fn name(self) -> &'d str {
        self.document.get(self.node().name)
    }

    /// Line in the file.
    pub fn line(self) -> u32 {
        self.node().line
    }

    /// File and line.
    pub fn place(self) -> Place {
        self.document.place.at(self.node().line)
    }

    /// An attribute by local name, with references resolved.
    pub fn attribute(self, name: &str) -> Option<&'d str> {
        let (from, to) = self.node().attributes;
        let list = &self.document.attributes[from as usize..to as usize];
        list.iter().find(|(key, _)| self.document.get(*key) == name).map(|(_, value)| self.document.get(*value))
    }

    /// The first text inside it, without the blanks around it; empty where there is none. References in it stay as they are.
    pub fn text(self) -> &'d str {
        self.document.get(self.node().text)
    }

    /// The children, in order.
    pub fn children(self) -> impl Iterator<Item = Element<'d>> {
        let document = self.document;
        let step = move |index: u32| (index != NONE).then_some(Element { document, index });
        std::iter::successors(step(self.node().first_child), move |child| step(child.node().next))
    }

    /// The children of that name.
    pub fn all(self, name: &'static str) -> impl Iterator<Item = Element<'d>> {
        self.children().filter(move |child| child.name() == name)
    }

    /// The first child of that name.
    pub fn child(self, name: &str) -> Option<Element<'d>> {
        self.children().find(|child| child.name() == name)
    }

    /// How messages call the element: its name, with the `name` attribute if it has one, and its parent's if not.
    pub fn label(self) -> String {
        match self.attribute("name") {
            Some(name) => format!("{} \"{name}\"", self.name()),
            None => match self.node().parent {
                NONE => self.name().to_owned(),
                parent => {
                    let parent = Element { document: self.document, index: parent };
                    match parent.attribute("name") {
                        Some(name) => format!("{} in {} \"{name}\"", self.name(), parent.name()),
                        None => format!("{} in {}", self.name(), parent.name()),
                    }
                }
            },
        }
    }

    /// An attribute that must be there; a fault if not.
    pub fn required(self, name: &'static str, faults: &mut Faults) -> Option<&'d str> {
        let value = self.attribute(name);
        if value.is_none() {
            faults.add(&self.place(), self.label(), FaultKind::MissingAttribute { name });
        }
        value
    }

    /// An optional attribute, parsed; a fault and `None` if it cannot be.
    pub fn parsed<T>(
        self,
        name: &'static str,
        allowed: &str,
        faults: &mut Faults,
        parse: impl Fn(&str) -> Option<T>,
    ) -> Option<T> {
        let text = self.attribute(name)?;
        let value = parse(text.trim());
        if value.is_none() {
            self.bad_value(name, text, allowed, faults);
        }
        value
    }

    /// An optional real; finite numbers only.
    pub fn real(self, name: &'static str, faults: &mut Faults) -> Option<f64> {
        self.parsed(name, "a finite number", faults, |text| text.parse().ok().filter(|v: &f64| v.is_finite()))
    }

    /// An optional Boolean of XML Schema: true, false, 1, 0.
    pub fn boolean(self, name: &'static str, faults: &mut Faults) -> Option<bool> {
        self.parsed(name, "true, false, 1 or 0", faults, boolean)
    }

    /// Adds a [`FaultKind::BadValue`] for this element.
    pub fn bad_value(self, what: &str, given: &str, allowed: &str, faults: &mut Faults) {
        let mut given: String = given.chars().take(80).collect();
        if given.len() == 80 {
            given.push_str("...");
        }
        let kind = FaultKind::BadValue { what: what.to_owned(), given, allowed: allowed.to_owned() };
        faults.add(&self.place(), self.label(), kind);
    }
}

/// Reads a Boolean of XML Schema.
pub fn boolean(text: &str) -> Option<bool> {
    match text {
        "true" | "1" => Some(true),
        "false" | "0" => Some(false),
        _ => None,
    }
}

#[cfg(test)]
mod tests;
