//! `terramech import`: a system of the Open Simulation Platform (`OspSystemStructure.xml`, format 0.1) as an SSP description.
//!
//! What is taken over: simulators with their initial values and step sizes, connections of variables and of variable groups
//! (`OspModelDescription.xml` of the FMUs, format 1.0), linear functions (they become the connection's transformation), power bonds, times, and the
//! ECCO algorithm with its tolerance and largest step. OSP converts no units, so the connections written suppress it. Sums have no like in
//! SSP: they are refused.

mod groups;

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use crate::check;
use crate::decimal::Decimal;
use crate::description::algorithm::{Algorithm, Scheme};
use crate::description::annotations::{Address, PowerBond};
use crate::description::parameters::read_document;
use crate::description::uri::{Roots, find};
use crate::description::{
    self, Assignment, Audience, Component, Connection, Connector, ConnectorKind, ConnectorType, Description, End,
    Given, Transformation,
};
use crate::fault::{FaultKind, Faults, Place, shown};
use crate::model_description::{Causality, Kind, ModelDescription, Variable};
use crate::unit::Linear;
use crate::xml::{Element, boolean};

/// The version of the format that is read.
const VERSION: &str = "0.1";

/// Most pairs of variables that groups may stand for.
const MOST_PAIRS: usize = 1_000_000;

/// Reads `path` and writes the description `out`. Gives remarks on what is not as it was.
///
/// # Errors
/// As [`read`]; a file that cannot be written.
pub fn import(path: &Path, fmu_path: &[PathBuf], out: &Path) -> Result<Vec<String>, Faults> {
    let folder = out.parent().unwrap_or(Path::new("")).to_path_buf();
    let (description, remarks) = read(path, fmu_path, &folder)?;
    let aside = out.with_extension("ssd.part");
    let text = description::write(&description, Audience::Terramech);
    let written = std::fs::write(&aside, text).and_then(|()| std::fs::rename(&aside, out));
    written.map(|()| remarks).map_err(|e| {
        let _ = std::fs::remove_file(&aside);
        let mut faults = Faults::new();
        faults.add(&Place::file(out), "", FaultKind::Environment { reason: format!("cannot be written: {e}") });
        faults
    })
}

/// Reads `path` (the file, or a folder with an `OspSystemStructure.xml`) for a description that will lie in `folder`. FMUs are opened, since only they tell
/// which end of a connection gives. Remarks go to the faults' notes.
///
/// # Errors
/// Every fault of the file, of the FMUs it names and of the connections.
pub fn read(path: &Path, fmu_path: &[PathBuf], folder: &Path) -> Result<(Description, Vec<String>), Faults> {
    let mut faults = Faults::new();
    let file = if path.is_dir() { path.join("OspSystemStructure.xml") } else { path.to_path_buf() };
    let document = match read_document(&file, &shown(&file)) {
        Ok(document) => document,
        Err(fault) => {
            faults.push(fault);
            return Err(faults);
        }
    };
    let root = match document.root_named("OspSystemStructure") {
        Ok(root) => root,
        Err(fault) => {
            faults.push(fault);
            return Err(faults);
        }
    };
    let base = file.parent().unwrap_or(Path::new("")).to_path_buf();
    let mut import = Import { faults, remarks: Vec::new(), base, models: Vec::new(), functions: HashMap::new() };
    let description = import.system(root, &file, fmu_path, folder);
    let remarks = import.remarks;
    import.faults.check((description, remarks))
}

/// A linear function, and its two ends so far.
struct Function {
    map: Linear,
    input: Option<(usize, usize)>,
    outputs: Vec<((usize, usize), Place)>,
}

struct Import {
    faults: Faults,
    remarks: Vec<String>,
    /// The file's folder.
    base: PathBuf,
    /// Of each component: its model and where its groups may be described.
    models: Vec<Option<(ModelDescription, groups::Groups)>>,
    functions: HashMap<String, Function>,
}

impl Import {
    fn system(&mut self, root: Element<'_>, file: &Path, fmu_path: &[PathBuf], folder: &Path) -> Description {
        let name = root.attribute("name").map(str::to_owned).or_else(|| {
            let folder = std::path::absolute(file).ok()?;
            Some(folder.parent()?.file_name()?.to_string_lossy().into_owned())
        });
        let mut d = Description {
            name: name.unwrap_or_else(|| "system".into()),
            place: Place::file(shown(file)),
            folder: folder.to_path_buf(),
            start: self.time(root, "StartTime", false),
            stop: self.time(root, "EndTime", false),
            base_step: self.time(root, "BaseStepSize", true),
            ..Description::default()
        };
        for (what, there) in [("BaseStepSize", d.base_step.is_some()), ("EndTime", d.stop.is_some())] {
            if !there {
                self.remarks.push(format!("the file gives no {what}"));
            }
        }
        let version = root.attribute("version").unwrap_or(VERSION);
        if version != VERSION {
            root.bad_value("version", version, VERSION, &mut self.faults);
        }
        if root.child("Simulators").is_none_or(|l| l.all("Simulator").next().is_none()) {
            root.bad_value("Simulators", "none", "one Simulator at least", &mut self.faults);
        }
        for s in root.child("Simulators").into_iter().flat_map(|l| l.all("Simulator")) {
            self.simulator(s, fmu_path, &mut d);
        }
        for f in root.child("Functions").into_iter().flat_map(Element::children) {
            self.function(f);
        }
        let mut bonds: Vec<(String, Vec<usize>, Place)> = Vec::new();
        for c in root.child("Connections").into_iter().flat_map(Element::children) {
            let from = d.connections.len();
            self.connection(c, &mut d);
            if let Some(bond) = c.attribute("powerBond") {
                let members = from..d.connections.len();
                match bonds.iter_mut().find(|(name, ..)| name == bond) {
                    Some((_, list, _)) => list.extend(members),
                    None => bonds.push((bond.to_owned(), members.collect(), c.place())),
                }
            }
        }
        self.finish_functions(&mut d);
        for (name, members, place) in bonds {
            self.bond(name, &members, place, &mut d);
        }
        self.connectors(&mut d);
        self.algorithm(root, &mut d);
        d
    }

    fn time(&mut self, root: Element<'_>, name: &'static str, positive: bool) -> Option<Decimal> {
        let e = root.child(name)?;
        match Decimal::parse(e.text()) {
            Ok(time) if !positive || time.is_positive() => Some(time),
            Ok(_) => {
                e.bad_value(name, e.text(), "a time above 0", &mut self.faults);
                None
            }
            Err(allowed) => {
                e.bad_value(name, e.text(), &allowed, &mut self.faults);
                None
            }
        }
    }

    fn simulator(&mut self, s: Element<'_>, fmu_path: &[PathBuf], d: &mut Description) {
        let (name, source) = (s.required("name", &mut self.faults), s.required("source", &mut self.faults));
        let (Some(name), Some(source)) = (name, source) else { return };
        if let Some(other) = d.components.iter().find(|c| c.name == name) {
            let kind = FaultKind::Duplicate { what: "simulator", name: name.to_owned(), first: other.place.line };
            return self.faults.add(&s.place(), s.label(), kind);
        }
        let mut component = Component { name: name.to_owned(), place: s.place(), ..Component::default() };
        let roots = Roots { base: &self.base, archive: None, search: fmu_path };
        let found = match find(source, roots) {
            Ok(path) => Some(path),
            Err(searched) => {
                let kind = FaultKind::NotFound { what: "FMU", source_uri: source.to_owned(), searched };
                self.faults.add(&s.place(), s.label(), kind);
                None
            }
        };
        let fmu = found.as_deref().and_then(|path| check::open_fmu(path, false, &mut self.faults));
        component.source = match &found {
            // A name beside the description stays a name, so that both may be moved.
            Some(path) if same_folder(&self.base, &d.folder) && path.starts_with(&self.base) => source.to_owned(),
            Some(path) => std::path::absolute(path).unwrap_or(path.clone()).to_string_lossy().into_owned(),
            None => source.to_owned(),
        };
        for v in s.child("InitialValues").into_iter().flat_map(|l| l.all("InitialValue")) {
            component.values.extend(self.initial_value(v));
        }
        component.step_hint = s.attribute("stepSize").and_then(|text| self.step_size(s, text, d.base_step));
        let base = self.base.clone();
        self.models.push(fmu.map(|fmu| {
            let groups = groups::Groups::of(&fmu, &base, &mut self.faults);
            ((*fmu.model).clone(), groups)
        }));
        d.components.push(component);
    }

    /// OSP rounds a step down to a multiple of the base step; SSP's reader here wants a multiple.
    fn step_size(&mut self, s: Element<'_>, text: &str, base: Option<Decimal>) -> Option<Decimal> {
        let step = match Decimal::parse(text) {
            Ok(step) if step.to_f64() > 0.0 => step,
            // 0 is OSP's word for the base step.
            Ok(_) => return None,
            Err(allowed) => {
                s.bad_value("stepSize", text, &allowed, &mut self.faults);
                return None;
            }
        };
        let Some(base) = base.filter(|base| step.count_of(*base).is_none()) else { return Some(step) };
        let (below, above) = step.neighbours(base);
        let taken = if below.is_positive() { below } else { above };
        self.remarks.push(format!(
            "simulator \"{}\": its step of {step} s is no multiple of the base step {base} s; {taken} s is taken, as OSP's tools do",
            s.attribute("name").unwrap_or_default()
        ));
        Some(taken)
    }

    fn initial_value(&mut self, e: Element<'_>) -> Option<Assignment> {
        let variable = e.required("variable", &mut self.faults)?.to_owned();
        let Some(body) = e.children().next() else {
            let kind = FaultKind::MissingElement { name: "Real, Integer, Boolean or String" };
            self.faults.add(&e.place(), e.label(), kind);
            return None;
        };
        let text = body.required("value", &mut self.faults)?;
        let value = match body.name() {
            "Real" => body.real("value", &mut self.faults).map(Given::Real),
            "Integer" => {
                let allowed = "a whole number from -2147483648 to 2147483647";
                body.parsed("value", allowed, &mut self.faults, |t| t.parse().ok()).map(Given::Integer)
            }
            "Boolean" => body.parsed("value", "true, false, 1 or 0", &mut self.faults, boolean).map(Given::Boolean),
            "String" => Some(Given::String(text.to_owned())),
            other => {
                body.bad_value("element", other, "Real, Integer, Boolean or String", &mut self.faults);
                None
            }
        }?;
        Some(Assignment {
            variable,
            value,
            unit: None,
            linear: None,
            suppress_unit_conversion: false,
            must_exist: true,
            place: e.place(),
        })
    }

    fn function(&mut self, f: Element<'_>) {
        if f.name() != "LinearTransformation" {
            let what = format!("the function {}", f.name());
            let instead = "SSP has no such connection: let a unit compute it";
            return self.faults.add(&f.place(), f.label(), FaultKind::Unsupported { what, instead });
        }
        let Some(name) = f.required("name", &mut self.faults) else { return };
        let map = Linear {
            factor: f.real("factor", &mut self.faults).unwrap_or(1.0),
            offset: f.real("offset", &mut self.faults).unwrap_or(0.0),
        };
        self.functions.insert(name.to_owned(), Function { map, input: None, outputs: Vec::new() });
    }

    /// Component and variable of a `Variable` element.
    fn variable(&mut self, e: Element<'_>, d: &Description) -> Option<(usize, usize)> {
        let component = self.component(e, d)?;
        let name = e.required("name", &mut self.faults)?;
        self.variable_of(component, name, e, d)
    }

    fn component(&mut self, e: Element<'_>, d: &Description) -> Option<usize> {
        let name = e.required("simulator", &mut self.faults)?;
        let found = d.components.iter().position(|c| c.name == name);
        if found.is_none() {
            let close = crate::suggest::close(name, d.components.iter().map(|c| c.name.as_str()));
            let kind = FaultKind::UnknownComponent { given: name.to_owned(), close };
            self.faults.add(&e.place(), e.label(), kind);
        }
        found
    }

    fn variable_of(&mut self, component: usize, name: &str, e: Element<'_>, d: &Description) -> Option<(usize, usize)> {
        let (model, _) = self.models[component].as_ref()?;
        let found = model.variables.iter().position(|v| &*v.name == name);
        if found.is_none() {
            let kind = FaultKind::UnknownVariable {
                component: d.components[component].name.clone(),
                model: model.model_name.clone(),
                given: name.to_owned(),
                close: crate::suggest::close(name, model.names()),
            };
            self.faults.add(&e.place(), e.label(), kind);
        }
        Some((component, found?))
    }

    fn connection(&mut self, c: Element<'_>, d: &mut Description) {
        let ends: Vec<Element<'_>> = c.children().collect();
        let [a, b] = ends.as_slice() else {
            let kind = FaultKind::MissingElement { name: "two ends" };
            return self.faults.add(&c.place(), c.label(), kind);
        };
        match (c.name(), a.name(), b.name()) {
            ("VariableConnection", ..) => {
                if let (Some(a), Some(b)) = (self.variable(*a, d), self.variable(*b, d)) {
                    self.connect(a, b, None, c.place(), d);
                }
            }
            ("VariableGroupConnection", ..) => self.groups(c, *a, *b, d),
            ("SignalConnection", "Variable", "Signal") => {
                let variable = self.variable(*a, d);
                if let (Some(function), Some(variable)) = (self.signal(*b, "in"), variable) {
                    function.input = Some(variable);
                }
            }
            ("SignalConnection", "Signal", "Variable") => {
                let variable = self.variable(*b, d);
                if let (Some(function), Some(variable)) = (self.signal(*a, "out"), variable) {
                    function.outputs.push((variable, c.place()));
                }
            }
            (other, ..) => {
                let what = format!("the connection {other} ({} to {})", a.name(), b.name());
                let instead = "allowed: VariableConnection, VariableGroupConnection, SignalConnection";
                self.faults.add(&c.place(), c.label(), FaultKind::Unsupported { what, instead });
            }
        }
    }

    fn signal(&mut self, e: Element<'_>, end: &'static str) -> Option<&mut Function> {
        let (name, signal) = (e.required("function", &mut self.faults)?, e.required("name", &mut self.faults)?);
        if !self.functions.contains_key(name) {
            e.bad_value("function", name, "a LinearTransformation of this file", &mut self.faults);
        } else if signal != end {
            e.bad_value("name", signal, &format!("\"{end}\" at this end"), &mut self.faults);
        }
        self.functions.get_mut(name).filter(|_| signal == end)
    }

    /// A function between variables is the transformation of their connection.
    fn finish_functions(&mut self, d: &mut Description) {
        let mut functions: Vec<(String, Function)> = self.functions.drain().collect();
        functions.sort_by(|a, b| a.0.cmp(&b.0));
        for (name, f) in functions {
            match f.input {
                Some(input) => {
                    for (output, place) in f.outputs {
                        self.connect(input, output, Some(f.map), place, d);
                    }
                }
                None if f.outputs.is_empty() => self.remarks.push(format!("the function \"{name}\" is not used")),
                None => {
                    let kind = FaultKind::MissingElement { name: "SignalConnection to its input \"in\"" };
                    self.faults.add(&d.place, format!("function \"{name}\""), kind);
                }
            }
        }
    }

    fn groups(&mut self, c: Element<'_>, a: Element<'_>, b: Element<'_>, d: &mut Description) {
        let mut lists: Vec<(usize, Vec<String>)> = Vec::new();
        for end in [a, b] {
            let Some(component) = self.component(end, d) else { return };
            let Some(name) = end.required("name", &mut self.faults) else { return };
            let Some((_, groups)) = &self.models[component] else { return };
            match groups.variables(name) {
                Ok(names) => lists.push((component, names.to_vec())),
                Err(allowed) => return end.bad_value("name", name, &allowed, &mut self.faults),
            }
        }
        let [(from, ours), (to, theirs)] = lists.as_slice() else { return };
        if ours.len() != theirs.len() || d.connections.len() + ours.len() > MOST_PAIRS {
            let given = format!("{} and {} variables", ours.len(), theirs.len());
            return c.bad_value("VariableGroup", &given, "two groups of equally many variables", &mut self.faults);
        }
        for (x, y) in ours.iter().zip(theirs) {
            let ends = (self.variable_of(*from, x, a, d), self.variable_of(*to, y, b, d));
            if let (Some(x), Some(y)) = ends {
                self.connect(x, y, None, c.place(), d);
            }
        }
    }

    /// OSP writes the source first, but groups mix directions: the variables tell.
    fn connect(
        &mut self,
        a: (usize, usize),
        b: (usize, usize),
        map: Option<Linear>,
        place: Place,
        d: &mut Description,
    ) {
        let takes = |v: &Variable| matches!(v.causality, Causality::Input | Causality::Parameter);
        let variable = |(component, index): (usize, usize)| {
            self.models[component].as_ref().map(|(model, _)| &model.variables[index])
        };
        let (Some(x), Some(y)) = (variable(a), variable(b)) else { return };
        let end = |(component, _): (usize, usize), v: &Variable| End { component, connector: v.name.to_string() };
        let (from, to) = match (takes(x), takes(y)) {
            (true, false) if map.is_none() => (end(b, y), end(a, x)),
            (false, true) => (end(a, x), end(b, y)),
            (both, _) => {
                let name = |(component, _): (usize, usize), v: &Variable| {
                    format!("{}.{}", d.components[component].name, v.name)
                };
                let kind = FaultKind::SameDirection {
                    first: name(a, x),
                    second: name(b, y),
                    both: if both { "targets" } else { "sources" },
                };
                return self.faults.add(&place, "Connection", kind);
            }
        };
        // Only between Reals is there a unit to convert.
        let suppress_unit_conversion = x.kind == Kind::Real && y.kind == Kind::Real;
        let transformation = map.map(Transformation::Linear);
        d.connections.push(Connection { from, to, transformation, suppress_unit_conversion, place });
    }

    /// The connections of a bond in both directions, in order: the one that carries N, N.m or nothing known against the other.
    fn bond(&mut self, name: String, members: &[usize], place: Place, d: &mut Description) {
        let ends = |c: &Connection| (c.from.component, c.to.component);
        let mut pairs = Vec::new();
        let mut rest: Vec<usize> = members.to_vec();
        while let Some(first) = (!rest.is_empty()).then(|| rest.remove(0)) {
            let (a, b) = ends(&d.connections[first]);
            let Some(at) = rest.iter().position(|&c| ends(&d.connections[c]) == (b, a)) else { break };
            let second = rest.remove(at);
            let address = |c: usize| {
                let from = &d.connections[c].from;
                Address { element: d.components[from.component].name.clone(), connector: from.connector.clone() }
            };
            let (effort, flow) = if self.is_effort(&d.connections[second]) { (second, first) } else { (first, second) };
            pairs.push((address(effort), address(flow)));
        }
        if pairs.is_empty() || !rest.is_empty() {
            let given = format!("{} connections", members.len());
            let allowed = "as many connections one way as the other between two simulators".into();
            let kind = FaultKind::BadValue { what: format!("powerBond \"{name}\""), given, allowed };
            return self.faults.add(&place, "Connection", kind);
        }
        d.extras.bonds.push(PowerBond { name, pairs, means: false, place });
    }

    /// Whether what a connection carries is a force or moment by its unit (the product is a power either way).
    fn is_effort(&self, c: &Connection) -> bool {
        let Some((model, _)) = &self.models[c.from.component] else { return false };
        let unit = model.find(&c.from.connector).and_then(|item| model.unit_of(item));
        unit.and_then(|u| u.base.as_ref()).is_some_and(|base| base.dimension.0[0] == 1)
    }

    /// Every connector that a connection names, with the variable's kind and type.
    fn connectors(&self, d: &mut Description) {
        for (component, model) in self.models.iter().enumerate() {
            let Some((model, _)) = model else { continue };
            let mut seen = std::collections::HashSet::new();
            let ends: Vec<(&End, &Place)> = d
                .connections
                .iter()
                .flat_map(|c| [(&c.from, &c.place), (&c.to, &c.place)])
                .filter(|(end, _)| end.component == component && seen.insert(end.connector.as_str()))
                .collect();
            let connectors: Vec<Connector> = ends
                .into_iter()
                .filter_map(|(end, place)| {
                    let v = model.variable(&end.connector)?;
                    Some(Connector {
                        name: end.connector.clone(),
                        kind: match v.causality {
                            Causality::Input => ConnectorKind::Input,
                            Causality::Output => ConnectorKind::Output,
                            Causality::Parameter => ConnectorKind::Parameter,
                            Causality::CalculatedParameter => ConnectorKind::CalculatedParameter,
                            _ => ConnectorKind::Output,
                        },
                        value_type: match v.kind {
                            Kind::Real => Some(ConnectorType::Real(None)),
                            Kind::Enumeration => None,
                            kind => Some(ConnectorType::Plain(kind)),
                        },
                        place: place.clone(),
                    })
                })
                .collect();
            d.components[component].connectors = connectors;
        }
    }

    fn algorithm(&mut self, root: Element<'_>, d: &mut Description) {
        let Some(e) = root.child("Algorithm") else { return };
        match e.text() {
            "" | "fixedStep" => {}
            "ecco" => {
                let of = |name: &str| root.child("EccoConfiguration")?.child(name);
                let number = |name: &str| of(name).and_then(|e| e.text().parse::<f64>().ok());
                let longest = of("MaximumStepSize").and_then(|e| Decimal::parse(e.text()).ok());
                if let Some(least) =
                    of("MinimumStepSize").and_then(|e| Decimal::parse(e.text()).ok()).filter(|s| s.is_positive())
                {
                    self.remarks.push(format!(
                        "the base step becomes {least} s, ECCO's smallest: steps are multiples of it here"
                    ));
                    d.base_step = Some(least);
                    d.components.iter_mut().for_each(|c| c.step_hint = None);
                }
                let longest =
                    longest.map(|s| d.base_step.filter(|b| s.count_of(*b).is_none()).map_or(s, |b| s.neighbours(b).0));
                d.extras.algorithm = Some(Box::new(Algorithm {
                    scheme: Scheme::Ecco,
                    order: Vec::new(),
                    resolve_feed_through: false,
                    tolerance: number("RelativeTolerance").filter(|t| *t > 0.0 && *t < 1.0),
                    iterations: None,
                    longest,
                    place: e.place(),
                }));
            }
            other => e.bad_value("Algorithm", other, "fixedStep or ecco", &mut self.faults),
        }
    }
}

fn same_folder(a: &Path, b: &Path) -> bool {
    let whole = |p: &Path| {
        let p = if p.as_os_str().is_empty() { Path::new(".") } else { p };
        std::fs::canonicalize(p).ok()
    };
    whole(a).is_some() && whole(a) == whole(b)
}
