//! Systems of small units for the tests: builds the test units, packs them as FMUs, writes descriptions and runs them.

#![allow(dead_code)] // each test file uses its part

use std::fmt::Write as _;
use std::fs;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

use terramech::check;
use terramech::run::{self, Display, Options, Outcome, Stop};
use terramech_fmi2::variables::{Causality, Start};

/// The shared library of the test units, built with its exports.
fn library() -> &'static [u8] {
    static LIBRARY: OnceLock<Vec<u8>> = OnceLock::new();
    LIBRARY.get_or_init(|| {
        // target/PROFILE/deps/this-test
        let profile = std::env::current_exe().unwrap().ancestors().nth(2).unwrap().to_path_buf();
        let mut cargo = Command::new(env!("CARGO"));
        // --workspace: the same features as the test was built with, so that no dependency compiles again.
        cargo.args(["build", "--quiet", "--workspace", "--example", "testunits", "--target-dir"]);
        cargo.arg(profile.parent().unwrap()).current_dir(env!("CARGO_MANIFEST_DIR"));
        if profile.file_name().unwrap() == "release" {
            cargo.arg("--release");
        }
        assert!(cargo.status().unwrap().success(), "the test units cannot be built");
        fs::read(profile.join("examples/libtestunits.so")).unwrap()
    })
}

/// A component of a test system: name, model, parameters (numbers, `true`, or text), attributes of our annotation.
pub struct Part<'a> {
    pub name: &'a str,
    pub model: &'a str,
    pub set: &'a [(&'a str, &'a str)],
    pub extras: &'a str,
}

pub fn part<'a>(name: &'a str, model: &'a str, set: &'a [(&'a str, &'a str)]) -> Part<'a> {
    Part { name, model, set, extras: "" }
}

/// A system in a temporary folder.
pub struct Bench {
    pub folder: tempfile::TempDir,
    pub file: PathBuf,
}

impl Bench {
    /// Writes FMUs and description. `connections` are `a.x -> b.y` (an array where both are arrays), `extras` goes into our
    /// annotation of the system.
    pub fn new(step: &str, stop: &str, parts: &[Part], connections: &[(&str, &str)], extras: &str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let models = testunits::models();
        let model = |name: &str| models.iter().find(|m| m.name == name).unwrap();
        let mut text = String::from(HEAD);
        for p in parts {
            let model = model(p.model);
            let fmu = folder.path().join(format!("{}.fmu", p.model));
            if !fmu.exists() {
                pack(&fmu, model.name, &model.xml());
            }
            writeln!(text, "<ssd:Component name=\"{}\" source=\"{}.fmu\"><ssd:Connectors>", p.name, p.model).unwrap();
            for v in model.table.variables().iter().filter(|v| !v.start.is_array()) {
                let kind = match v.causality {
                    Causality::Input => "input",
                    Causality::Output => "output",
                    _ => continue,
                };
                writeln!(
                    text,
                    "<ssd:Connector name=\"{}\" kind=\"{kind}\"><ssc:{}/></ssd:Connector>",
                    v.name,
                    v.start.type_name()
                )
                .unwrap();
            }
            text += "</ssd:Connectors>";
            if !p.set.is_empty() {
                text += "<ssd:ParameterBindings><ssd:ParameterBinding><ssd:ParameterValues>\
                    <ssv:ParameterSet version=\"1.0\" name=\"p\"><ssv:Parameters>";
                for (name, value) in p.set {
                    let start = &model.table.find(name).unwrap().1.start;
                    let value = value.replace('"', "&quot;");
                    let kind = start.type_name();
                    assert!(!matches!(start, Start::RealArray | Start::IntegerArray));
                    write!(text, "<ssv:Parameter name=\"{name}\"><ssv:{kind} value=\"{value}\"/></ssv:Parameter>")
                        .unwrap();
                }
                text += "</ssv:Parameters></ssv:ParameterSet></ssd:ParameterValues></ssd:ParameterBinding></ssd:ParameterBindings>";
            }
            if !p.extras.is_empty() {
                write!(text, "<ssd:Annotations><ssc:Annotation type=\"org.terramech\"><tm:Component xmlns:tm=\"http://terramech.org/SSP1/Annotations\" {}/></ssc:Annotation></ssd:Annotations>", p.extras).unwrap();
            }
            text += "</ssd:Component>\n";
        }
        text += "</ssd:Elements><ssd:Connections>\n";
        let mut arrays = String::new();
        for (from, to) in connections {
            let ((a, x), (b, y)) = (from.split_once('.').unwrap(), to.split_once('.').unwrap());
            let of = parts.iter().find(|p| p.name == a).unwrap().model;
            let is_array = model(of).table.find(x).unwrap().1.start.is_array();
            let ends = format!("startElement=\"{a}\" startConnector=\"{x}\" endElement=\"{b}\" endConnector=\"{y}\"");
            if is_array {
                writeln!(arrays, "<tm:ArrayConnection {ends}/>").unwrap();
            } else {
                writeln!(text, "<ssd:Connection {ends}/>").unwrap();
            }
        }
        write!(
            text,
            "</ssd:Connections><ssd:Annotations><ssc:Annotation type=\"org.terramech\">\
             <tm:System xmlns:tm=\"http://terramech.org/SSP1/Annotations\">{arrays}{extras}</tm:System></ssc:Annotation></ssd:Annotations>\
             </ssd:System><ssd:DefaultExperiment startTime=\"0\" stopTime=\"{stop}\"><ssd:Annotations>\
             <ssc:Annotation type=\"com.opensimulationplatform\"><osp:Algorithm>\
             <osp:FixedStepAlgorithm baseStepSize=\"{step}\"/></osp:Algorithm></ssc:Annotation></ssd:Annotations>\
             </ssd:DefaultExperiment></ssd:SystemStructureDescription>"
        )
        .unwrap();
        let file = folder.path().join("system.ssd");
        fs::write(&file, text).unwrap();
        Self { folder, file }
    }

    /// Packs an FMU anew with another model description.
    pub fn change_model(&self, model: &str, change: impl Fn(String) -> String) {
        let models = testunits::models();
        let model = models.iter().find(|m| m.name == model).unwrap();
        let fmu = self.folder.path().join(format!("{}.fmu", model.name));
        fs::remove_file(&fmu).unwrap();
        pack(&fmu, model.name, &change(model.xml()));
    }

    pub fn out(&self) -> PathBuf {
        self.folder.path().join("out")
    }

    /// Runs it in this process.
    pub fn run(&self, threads: usize) -> Outcome {
        self.run_with(threads, &Stop::new(), &[])
    }

    pub fn run_with(&self, threads: usize, stop: &Stop, set: &[&str]) -> Outcome {
        let options = check::Options { set: set.iter().map(|s| s.to_string()).collect(), ..check::Options::default() };
        let plan = check::plan(&self.file, &options).unwrap_or_else(|faults| panic!("{faults}"));
        let options = Options { out: self.out(), threads, command: vec!["test".into()], ..Options::default() };
        run::run(plan, &options, Display::quiet(), stop).unwrap()
    }

    pub fn csv(&self) -> terramech_results::CsvTable {
        terramech_results::CsvTable::read(self.out().join("results.csv")).unwrap()
    }

    pub fn log(&self) -> String {
        fs::read_to_string(self.out().join("log.jsonl")).unwrap()
    }
}

/// A system with all that is read, carried and kept: scalars, arrays that change their sizes, extrapolation and holds over steps of different lengths, a power bond, means, a series of
/// frames. With more units and connections behind its own.
pub fn of_everything(parts: &[Part], connections: &[(&str, &str)]) -> Bench {
    let first = [("m", "40"), ("k", "150000"), ("d", "0"), ("x0", "0.01")];
    let second = [("m", "400"), ("k", "0"), ("d", "0"), ("cc", "15000"), ("dc", "1000")];
    let mut all = vec![
        part("first", "mass_first", &first),
        part("second", "mass_second", &second),
        Part { name: "source", model: "array_source", set: &[], extras: "multiple=\"3\"" },
        part("echo", "array_echo", &[]),
    ];
    all.extend(parts.iter().map(|p| Part { name: p.name, model: p.model, set: p.set, extras: p.extras }));
    let mut wires = vec![
        ("second.force", "first.force"),
        ("first.position", "second.other.position"),
        ("first.velocity", "second.other.velocity"),
        ("source.points.position", "echo.in.position"),
        ("source.points.id", "echo.in.id"),
    ];
    wires.extend(connections);
    let extras = "<tm:Extrapolation element=\"second\" connector=\"*\" order=\"2\"/>\
        <tm:Extrapolation element=\"first\" connector=\"*\" order=\"1\"/>\
        <tm:PowerBond name=\"spring\"><tm:Pair effortElement=\"second\" effortConnector=\"force\" flowElement=\"first\" \
        flowConnector=\"velocity\"/></tm:PowerBond>\
        <tm:Recording><tm:Scalars element=\"*\" connector=\"*\"/>\
        <tm:Dataset name=\"points\" element=\"source\" position=\"points.position\" every=\"0.03\"/></tm:Recording>\
        <tm:Summary><tm:Item name=\"force\" element=\"second\" connector=\"force\" from=\"0.05\" to=\"0.5\"/></tm:Summary>";
    Bench::new("0.01", "0.6", &all, &wires, extras)
}

const HEAD: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<ssd:SystemStructureDescription xmlns:ssd="http://ssp-standard.org/SSP1/SystemStructureDescription"
    xmlns:ssc="http://ssp-standard.org/SSP1/SystemStructureCommon" xmlns:ssv="http://ssp-standard.org/SSP1/SystemStructureParameterValues"
    xmlns:osp="http://opensimulationplatform.com/SSP/OSPAnnotations" version="1.0" name="bench">
<ssd:System name="bench"><ssd:Elements>
"#;

/// Packs one model of the test library as an FMU.
fn pack(path: &Path, name: &str, xml: &str) {
    pack_with(path, name, xml, library());
}

/// Packs an FMU whose library is these bytes of the test library.
pub fn pack_part(path: &Path, model: &str, part: std::ops::RangeTo<usize>) {
    let models = testunits::models();
    let model = models.iter().find(|m| m.name == model).unwrap();
    pack_with(path, model.name, &model.xml(), &library()[part]);
}

pub fn library_size() -> usize {
    library().len()
}

fn pack_with(path: &Path, name: &str, xml: &str, library: &[u8]) {
    let mut zip = zip::ZipWriter::new(fs::File::create(path).unwrap());
    let stored = zip::write::SimpleFileOptions::default().compression_method(zip::CompressionMethod::Stored);
    for (entry, bytes) in [
        ("modelDescription.xml".to_string(), xml.as_bytes()),
        (format!("binaries/linux64/{name}.so"), library),
        ("resources/specification.json".to_string(), b"{}"),
    ] {
        zip.start_file(entry, stored).unwrap();
        zip.write_all(bytes).unwrap();
    }
    zip.finish().unwrap();
}
