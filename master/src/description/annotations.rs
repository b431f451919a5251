//! The vocabulary of our annotations: read and written here and nowhere else. `schema/org.terramech.xsd` is its schema.
//!
//! An annotation of type `org.terramech` holds one element: `Component` under a component, `System` under a system.
//!
//! ```xml
//! <ssc:Annotation type="org.terramech">
//!   <tm:Component xmlns:tm="http://terramech.org/SSP1/Annotations" multiple="5" threads="4" ranks="2..5"/>
//! </ssc:Annotation>
//!
//! <ssc:Annotation type="org.terramech">
//!   <tm:System xmlns:tm="http://terramech.org/SSP1/Annotations">
//!     <tm:ArrayConnection startElement="tire" startConnector="mesh.position"
//!                         endElement="terrain" endConnector="body[1].position"/>
//!     <tm:Algorithm scheme="jacobi"/>
//!     <tm:Extrapolation element="rig" connector="wheel[1].force.*" order="1"/>
//!     <tm:PowerBond name="wheel" efforts="mean">
//!       <tm:Pair effortElement="tire" effortConnector="force.x" flowElement="rig" flowConnector="wheel[1].velocity.x"/>
//!     </tm:PowerBond>
//!     <tm:Recording every="0.001">
//!       <tm:Scalars element="rig" connector="*" every="0.01"/>
//!       <tm:Dataset name="bed" element="terrain" position="grain.position" every="0.02">
//!         <tm:Field name="radius" array="grain.radius"/>
//!       </tm:Dataset>
//!       <tm:Dataset name="wheel" element="tire" position="mesh.position" triangle="mesh.triangle" every="0.02">
//!         <tm:Field name="force" element="terrain" array="body[1].contact.force" index="body[1].contact.index"/>
//!       </tm:Dataset>
//!     </tm:Recording>
//!     <tm:Summary>
//!       <tm:Item name="drawbar pull" element="rig" connector="drawbar_pull" from="2" to="3" measured="12.5" source="..."/>
//!     </tm:Summary>
//!   </tm:System>
//! </ssc:Annotation>
//! ```
//!
//! Elements are named as in the system that holds the annotation. Times are decimal numbers in s.

use super::algorithm::Algorithm;
use crate::decimal::Decimal;
use crate::fault::{FaultKind, Faults, Place};
use crate::world::Ranks;
use crate::xml::Element;
use crate::xml::write::Writer;

/// The schema of our annotations (XSD).
pub const SCHEMA: &str = include_str!("../../schema/org.terramech.xsd");
/// The type of our annotations.
pub const TYPE: &str = "org.terramech";
/// Our namespace.
pub const NAMESPACE: &str = "http://terramech.org/SSP1/Annotations";

/// What we say about a component.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ComponentExtras {
    /// Communication step in base steps.
    pub multiple: Option<u64>,
    /// Threads of the unit.
    pub threads: Option<u32>,
    /// MPI ranks: `rank` or `ranks`.
    pub ranks: Option<Ranks>,
}

/// What we say about a system.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SystemExtras {
    /// Vector-to-vector connections.
    pub arrays: Vec<ArrayConnection>,
    /// Orders of extrapolation.
    pub extrapolations: Vec<Extrapolation>,
    /// How units are coupled in time; Jacobi if absent.
    pub algorithm: Option<Box<Algorithm>>,
    /// Power bonds.
    pub bonds: Vec<PowerBond>,
    /// Default period of recorded scalars, s; every base step if absent.
    pub every: Option<Decimal>,
    /// Scalars to record beside the connected ones.
    pub scalars: Vec<Scalars>,
    /// VTK datasets.
    pub datasets: Vec<Dataset>,
    /// Headline results.
    pub summary: Vec<Item>,
}

/// An element and one of its connectors (a scalar, an array, or a pattern with `*`).
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Address {
    /// Component.
    pub element: String,
    /// Variable.
    pub connector: String,
}

impl std::fmt::Display for Address {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}.{}", self.element, self.connector)
    }
}

/// `ArrayConnection`.
#[derive(Clone, Debug, PartialEq)]
pub struct ArrayConnection {
    /// Output array.
    pub from: Address,
    /// Input array.
    pub to: Address,
    /// Where it is written.
    pub place: Place,
}

/// `Extrapolation`: how inputs that match are continued between communication points.
#[derive(Clone, Debug, PartialEq)]
pub struct Extrapolation {
    /// Inputs, `*` allowed in the connector.
    pub to: Address,
    /// 0, 1 or 2.
    pub order: u8,
    /// Where it is written.
    pub place: Place,
}

/// `PowerBond`.
#[derive(Clone, Debug, PartialEq)]
pub struct PowerBond {
    /// Name.
    pub name: String,
    /// Outputs whose product is a power: force or moment, and velocity or angular velocity.
    pub pairs: Vec<(Address, Address)>,
    /// Whether its efforts are means over the sender's last step, not values at its end.
    pub means: bool,
    /// Where it is written.
    pub place: Place,
}

/// `Scalars`: variables to record.
#[derive(Clone, Debug, PartialEq)]
pub struct Scalars {
    /// Variables, `*` allowed in both parts.
    pub what: Address,
    /// Period, s.
    pub every: Option<Decimal>,
    /// Where it is written.
    pub place: Place,
}

/// `Dataset`: a VTK time series.
#[derive(Clone, Debug, PartialEq)]
pub struct Dataset {
    /// Name of the series.
    pub name: String,
    /// Array of point positions.
    pub position: Address,
    /// Array of triangles, of the same element.
    pub triangle: Option<String>,
    /// Period, s.
    pub every: Option<Decimal>,
    /// Point data.
    pub fields: Vec<Field>,
    /// Where it is written.
    pub place: Place,
}

/// `Field`: point data of a dataset.
#[derive(Clone, Debug, PartialEq)]
pub struct Field {
    /// Name in the files.
    pub name: String,
    /// The array; its element is the dataset's if none is written.
    pub array: Address,
    /// Array of point numbers, of the array's element, where the values belong to some points only.
    pub index: Option<String>,
    /// Where it is written.
    pub place: Place,
}

/// `Item`: a headline result.
#[derive(Clone, Debug, PartialEq)]
pub struct Item {
    /// Name.
    pub name: String,
    /// Variable to average.
    pub what: Address,
    /// Window from, s; start time if absent.
    pub from: Option<Decimal>,
    /// Window to, s; stop time if absent.
    pub to: Option<Decimal>,
    /// Measured value, in the variable's unit.
    pub measured: Option<f64>,
    /// Where the measured value is from.
    pub source: Option<String>,
    /// Where it is written.
    pub place: Place,
}

/// The element inside the annotation of a type, if there is one.
pub fn of_type<'d>(annotations: Option<Element<'d>>, kind: &str) -> Option<Element<'d>> {
    annotations?.all("Annotation").find(|a| a.attribute("type") == Some(kind))?.children().next()
}

fn whole<T: TryFrom<u64>>(e: Element<'_>, name: &'static str, least: u64, faults: &mut Faults) -> Option<T> {
    let allowed = if least == 0 { "a whole number from 0" } else { "a whole number from 1" };
    e.parsed(name, allowed, faults, |text| {
        text.parse::<u64>().ok().filter(|n| (least..=1_000_000_000).contains(n)).and_then(|n| T::try_from(n).ok())
    })
}

/// The place under MPI, by one of two attributes.
fn ranks(e: Element<'_>, faults: &mut Faults) -> Option<Ranks> {
    let one = e.parsed("rank", "a whole number from 0", faults, |t| {
        Ranks::parse(t).filter(|r| r.count() == 1 && !t.contains('.'))
    });
    let several = e.parsed("ranks", Ranks::ALLOWED, faults, Ranks::parse);
    if let (Some(_), Some(_), Some(given)) = (one, several, e.attribute("ranks")) {
        e.bad_value("ranks", given, "rank or ranks, not both", faults);
    }
    several.or(one)
}

/// A time in s, above zero if asked for.
pub(super) fn time(e: Element<'_>, name: &'static str, positive: bool, faults: &mut Faults) -> Option<Decimal> {
    let text = e.attribute(name)?;
    match Decimal::parse(text) {
        Ok(value) if positive && !value.is_positive() => e.bad_value(name, text, "a time above 0", faults),
        Ok(value) => return Some(value),
        Err(allowed) => e.bad_value(name, text, &allowed, faults),
    }
    None
}

/// A word we do not know is a misspelling or of a later version; to skip it silently would change the run.
fn unknown(e: Element<'_>, allowed: &str, faults: &mut Faults) {
    e.bad_value("element", e.name(), allowed, faults);
}

impl ComponentExtras {
    /// Reads from a component's `Annotations`.
    pub fn read(annotations: Option<Element<'_>>, faults: &mut Faults) -> Self {
        let Some(e) = of_type(annotations, TYPE) else { return Self::default() };
        if e.name() != "Component" {
            unknown(e, "Component", faults);
            return Self::default();
        }
        Self {
            multiple: whole(e, "multiple", 1, faults),
            threads: whole(e, "threads", 1, faults),
            ranks: ranks(e, faults),
        }
    }

    /// Writes the annotation, if there is something to say.
    pub fn write(&self, writer: &mut Writer) {
        if *self == Self::default() {
            return;
        }
        writer.open("ssc:Annotation").attribute("type", TYPE);
        writer.open("tm:Component").attribute("xmlns:tm", NAMESPACE);
        writer.optional("multiple", self.multiple).optional("threads", self.threads);
        if let Some(ranks) = self.ranks {
            writer.attribute(if ranks.count() == 1 { "rank" } else { "ranks" }, ranks);
        }
        writer.close().close();
    }
}

/// The address in two attributes; faults if one is missing.
fn address(e: Element<'_>, element: &'static str, connector: &'static str, faults: &mut Faults) -> Option<Address> {
    let element = e.required(element, faults);
    let connector = e.required(connector, faults);
    Some(Address { element: element?.to_owned(), connector: connector?.to_owned() })
}

impl SystemExtras {
    /// Reads from a system's `Annotations`.
    pub fn read(annotations: Option<Element<'_>>, faults: &mut Faults) -> Self {
        let mut extras = Self::default();
        let Some(system) = of_type(annotations, TYPE) else { return extras };
        if system.name() != "System" {
            unknown(system, "System", faults);
            return extras;
        }
        for e in system.children() {
            match e.name() {
                "ArrayConnection" => {
                    let from = address(e, "startElement", "startConnector", faults);
                    let to = address(e, "endElement", "endConnector", faults);
                    if let (Some(from), Some(to)) = (from, to) {
                        extras.arrays.push(ArrayConnection { from, to, place: e.place() });
                    }
                }
                "Extrapolation" => {
                    let order = e.required("order", faults).and_then(|_| {
                        e.parsed("order", "0, 1 or 2", faults, |t| t.parse().ok().filter(|o: &u8| *o <= 2))
                    });
                    if let (Some(to), Some(order)) = (address(e, "element", "connector", faults), order) {
                        extras.extrapolations.push(Extrapolation { to, order, place: e.place() });
                    }
                }
                "Algorithm" => {
                    if let Some(first) = &extras.algorithm {
                        first.twice(faults);
                    }
                    extras.algorithm = Algorithm::read(e, faults).map(Box::new).or(extras.algorithm);
                }
                "PowerBond" => extras.bonds.extend(bond(e, faults)),
                "Recording" => extras.read_recording(e, faults),
                "Summary" => {
                    let items: Vec<_> = e.all("Item").filter_map(|item| summary_item(item, faults)).collect();
                    extras.summary.extend(items);
                }
                _ => unknown(e, "Algorithm, ArrayConnection, Extrapolation, PowerBond, Recording, Summary", faults),
            }
        }
        extras
    }

    fn read_recording(&mut self, recording: Element<'_>, faults: &mut Faults) {
        self.every = time(recording, "every", true, faults);
        for e in recording.children() {
            match e.name() {
                "Scalars" => {
                    let every = time(e, "every", true, faults);
                    if let Some(what) = address(e, "element", "connector", faults) {
                        self.scalars.push(Scalars { what, every, place: e.place() });
                    }
                }
                "Dataset" => self.datasets.extend(dataset(e, faults)),
                _ => unknown(e, "Scalars, Dataset", faults),
            }
        }
    }

    /// Adds those of a nested system, whose names are relative to `path` (dotted, with the final dot).
    pub fn append(&mut self, mut nested: Self, path: &str) {
        if !path.is_empty() {
            nested.for_each_address(|address| address.element.insert_str(0, path));
        }
        self.arrays.append(&mut nested.arrays);
        self.extrapolations.append(&mut nested.extrapolations);
        self.algorithm = self.algorithm.take().or(nested.algorithm.take());
        self.bonds.append(&mut nested.bonds);
        self.every = self.every.or(nested.every);
        self.scalars.append(&mut nested.scalars);
        self.datasets.append(&mut nested.datasets);
        self.summary.append(&mut nested.summary);
    }

    fn for_each_address(&mut self, mut change: impl FnMut(&mut Address)) {
        for c in &mut self.arrays {
            change(&mut c.from);
            change(&mut c.to);
        }
        self.extrapolations.iter_mut().for_each(|e| change(&mut e.to));
        for name in self.algorithm.iter_mut().flat_map(|a| &mut a.order) {
            let mut address = Address { element: std::mem::take(name), connector: String::new() };
            change(&mut address);
            *name = address.element;
        }
        for (effort, flow) in self.bonds.iter_mut().flat_map(|b| &mut b.pairs) {
            change(effort);
            change(flow);
        }
        self.scalars.iter_mut().for_each(|s| change(&mut s.what));
        for dataset in &mut self.datasets {
            change(&mut dataset.position);
            dataset.fields.iter_mut().for_each(|f| change(&mut f.array));
        }
        self.summary.iter_mut().for_each(|i| change(&mut i.what));
    }

    /// Writes the annotation, if there is something to say.
    pub fn write(&self, writer: &mut Writer) {
        if *self == Self::default() {
            return;
        }
        writer.open("ssc:Annotation").attribute("type", TYPE);
        writer.open("tm:System").attribute("xmlns:tm", NAMESPACE);
        for c in &self.arrays {
            writer.open("tm:ArrayConnection");
            writer.attribute("startElement", &c.from.element).attribute("startConnector", &c.from.connector);
            writer.attribute("endElement", &c.to.element).attribute("endConnector", &c.to.connector).close();
        }
        for e in &self.extrapolations {
            writer.open("tm:Extrapolation").attribute("element", &e.to.element);
            writer.attribute("connector", &e.to.connector).attribute("order", e.order).close();
        }
        if let Some(algorithm) = &self.algorithm {
            algorithm.write(writer);
        }
        for bond in &self.bonds {
            writer.open("tm:PowerBond").attribute("name", &bond.name);
            writer.optional("efforts", bond.means.then_some("mean"));
            for (effort, flow) in &bond.pairs {
                writer.open("tm:Pair");
                writer.attribute("effortElement", &effort.element).attribute("effortConnector", &effort.connector);
                writer.attribute("flowElement", &flow.element).attribute("flowConnector", &flow.connector).close();
            }
            writer.close();
        }
        if self.every.is_some() || !self.scalars.is_empty() || !self.datasets.is_empty() {
            writer.open("tm:Recording").optional("every", self.every);
            for s in &self.scalars {
                writer.open("tm:Scalars").attribute("element", &s.what.element);
                writer.attribute("connector", &s.what.connector).optional("every", s.every).close();
            }
            self.datasets.iter().for_each(|dataset| write_dataset(dataset, writer));
            writer.close();
        }
        if !self.summary.is_empty() {
            writer.open("tm:Summary");
            for i in &self.summary {
                writer.open("tm:Item").attribute("name", &i.name);
                writer.attribute("element", &i.what.element).attribute("connector", &i.what.connector);
                writer.optional("from", i.from).optional("to", i.to);
                writer.optional("measured", i.measured).optional("source", i.source.as_ref()).close();
            }
            writer.close();
        }
        writer.close().close();
    }
}

fn bond(e: Element<'_>, faults: &mut Faults) -> Option<PowerBond> {
    let mut pairs = Vec::new();
    for pair in e.all("Pair") {
        let effort = address(pair, "effortElement", "effortConnector", faults);
        let flow = address(pair, "flowElement", "flowConnector", faults);
        if let (Some(effort), Some(flow)) = (effort, flow) {
            pairs.push((effort, flow));
        }
    }
    if pairs.is_empty() {
        faults.add(&e.place(), e.label(), FaultKind::MissingElement { name: "Pair" });
    }
    let means = e.parsed("efforts", "sample or mean", faults, |word| match word {
        "sample" => Some(false),
        "mean" => Some(true),
        _ => None,
    });
    let name = e.required("name", faults)?.to_owned();
    Some(PowerBond { name, pairs, means: means.unwrap_or(false), place: e.place() })
}

fn dataset(e: Element<'_>, faults: &mut Faults) -> Option<Dataset> {
    let position = address(e, "element", "position", faults);
    let every = time(e, "every", true, faults);
    // The name becomes a file name.
    let name = e.required("name", faults).and_then(|name| {
        let plain = !name.is_empty() && name.chars().all(|c| c.is_ascii_alphanumeric() || matches!(c, '_' | '-'));
        if !plain {
            e.bad_value("name", name, "letters, digits, _ and - (it becomes a file name)", faults);
        }
        plain.then(|| name.to_owned())
    });
    let element = position.as_ref().map(|p| p.element.clone()).unwrap_or_default();
    let mut fields = Vec::new();
    for f in e.all("Field") {
        let (Some(name), Some(array)) = (f.required("name", faults), f.required("array", faults)) else { continue };
        let element = f.attribute("element").unwrap_or(&element).to_owned();
        let array = Address { element, connector: array.to_owned() };
        let index = f.attribute("index").map(str::to_owned);
        fields.push(Field { name: name.to_owned(), array, index, place: f.place() });
    }
    let triangle = e.attribute("triangle").map(str::to_owned);
    Some(Dataset { name: name?, position: position?, triangle, every, fields, place: e.place() })
}

fn write_dataset(dataset: &Dataset, writer: &mut Writer) {
    writer.open("tm:Dataset").attribute("name", &dataset.name);
    writer.attribute("element", &dataset.position.element).attribute("position", &dataset.position.connector);
    writer.optional("triangle", dataset.triangle.as_ref()).optional("every", dataset.every);
    for f in &dataset.fields {
        writer.open("tm:Field").attribute("name", &f.name);
        writer.attribute("element", &f.array.element).attribute("array", &f.array.connector);
        writer.optional("index", f.index.as_ref()).close();
    }
    writer.close();
}

fn summary_item(e: Element<'_>, faults: &mut Faults) -> Option<Item> {
    let what = address(e, "element", "connector", faults);
    Some(Item {
        from: time(e, "from", false, faults),
        to: time(e, "to", false, faults),
        measured: e.real("measured", faults),
        source: e.attribute("source").map(str::to_owned),
        name: e.required("name", faults)?.to_owned(),
        what: what?,
        place: e.place(),
    })
}
