//! What coupling costs: microseconds a step of the master and of a bare loop of the same calls, in turn, on one thread and without
//! recording; and how long systems take to load. `cargo xtask bench master` runs it beside FMPy and libcosim.
//!
//! Usage: `bench_master LIBRARY FOLDER [CASE]`: the shared library of the test units, and where the systems are written. Prints `name value` lines.

use std::fmt::Write as _;
use std::fs;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use terramech::check::{self, plan::Plan};
use terramech::coupling::{System, algorithm_of, assemble};
use terramech::loading::{BareLoop, Environment, Instance, Library, LogLine, Made};
use testunits::block::VALUES;

const STEP: f64 = 0.001;
/// Times each measurement is repeated. One lasts a fraction of a millisecond, so that among many some are not interrupted by the machine's
/// other work, and the fastest counts.
const REPEATS: usize = 400;

struct Silent;
impl Environment for Silent {
    fn log(&self, line: LogLine<'_>) {
        eprintln!("{}: {}", line.unit, line.text);
    }
    fn progress(&self, _: &str, _: &str, _: f64) -> bool {
        true
    }
}

/// How two blocks are connected, or lags in a ring.
#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Ring,
    Scalars,
    Arrays,
}

fn main() {
    let arguments: Vec<PathBuf> = std::env::args_os().skip(1).map(PathBuf::from).collect();
    let (library, folder, only) = match arguments.as_slice() {
        [library, folder] => (library, folder, ""),
        [library, folder, only] => (library, folder, only.to_str().unwrap_or_default()),
        _ => panic!("usage: bench_master LIBRARY FOLDER [CASE]"),
    };
    let wanted = |case: &str| only.is_empty() || case == only;
    fs::create_dir_all(folder).expect("the folder can be made");
    pack(folder, library);
    for n in [2, 10, 50, 100] {
        if !wanted(&format!("ring{n}")) {
            continue;
        }
        let file = system(folder, &format!("ring{n}"), Kind::Ring, n);
        measure(&format!("ring{n}"), &file, Kind::Ring, (3000 / n).max(20));
    }
    for (name, kind, steps) in [("pair3000_arrays", Kind::Arrays, 50), ("pair3000", Kind::Scalars, 8)] {
        if !wanted(name) {
            continue;
        }
        let file = system(folder, name, kind, 2);
        measure(name, &file, kind, steps);
    }
    for pairs in [1, 10] {
        let name = format!("load{}", pairs * 2 * VALUES);
        if !wanted(&name) {
            continue;
        }
        let file = system(folder, &name, Kind::Scalars, 2 * pairs);
        let best = (0..3).map(|_| {
            let begin = Instant::now();
            let plan = plan(&file);
            assert_eq!(plan.connections.len(), pairs * 2 * VALUES);
            begin.elapsed().as_secs_f64()
        });
        println!("{name}.seconds {}", best.fold(f64::INFINITY, f64::min));
    }
}

fn pack(folder: &Path, library: &Path) {
    let library = fs::read(library).expect("the library of the test units");
    for model in testunits::models().into_iter().filter(|m| ["lag", "block"].contains(&m.name)) {
        let file = fs::File::create(folder.join(format!("{}.fmu", model.name))).expect("an FMU can be written");
        let mut zip = zip::ZipWriter::new(file);
        let stored = zip::write::SimpleFileOptions::default().compression_method(zip::CompressionMethod::Stored);
        let mut add = |name: String, bytes: &[u8]| {
            zip.start_file(name, stored).and_then(|()| Ok(zip.write_all(bytes)?)).expect("an entry can be written");
        };
        add("modelDescription.xml".into(), model.xml().as_bytes());
        add(format!("binaries/linux64/{}.so", model.name), &library);
        add("resources/specification.json".into(), b"{}");
        zip.finish().expect("an FMU can be closed");
    }
}

/// Writes a system of `n` units.
fn system(folder: &Path, name: &str, kind: Kind, n: usize) -> PathBuf {
    let model = if kind == Kind::Ring { "lag" } else { "block" };
    let mut text = String::from(HEAD);
    for unit in 0..n {
        write!(text, "<ssd:Component name=\"u{unit}\" type=\"application/x-fmu-sharedlibrary\" source=\"{model}.fmu\"><ssd:Connectors>").unwrap();
        let count = if kind == Kind::Scalars { VALUES } else { usize::from(kind == Kind::Ring) };
        for (port, direction) in [("in", "input"), ("out", "output")] {
            for i in 1..=count {
                let port = if kind == Kind::Ring { port.to_owned() } else { format!("{port}[{i}]") };
                writeln!(text, "<ssd:Connector name=\"{port}\" kind=\"{direction}\"><ssc:Real/></ssd:Connector>")
                    .unwrap();
            }
        }
        text += "</ssd:Connectors></ssd:Component>\n";
    }
    text += "</ssd:Elements><ssd:Connections>\n";
    let mut arrays = String::new();
    for unit in 0..n {
        // A ring, or pairs.
        let next = if kind == Kind::Ring { (unit + 1) % n } else { unit ^ 1 };
        let ends = |from: &str, to: &str| {
            format!(
                "startElement=\"u{unit}\" startConnector=\"{from}\" endElement=\"u{next}\" endConnector=\"{to}\"/>\n"
            )
        };
        match kind {
            Kind::Ring => text += &format!("<ssd:Connection {}", ends("out", "in")),
            Kind::Scalars => {
                for i in 1..=VALUES {
                    text += &format!("<ssd:Connection {}", ends(&format!("out[{i}]"), &format!("in[{i}]")));
                }
            }
            Kind::Arrays => arrays += &format!("<tm:ArrayConnection {}", ends("out.all", "in.all")),
        }
    }
    text += "</ssd:Connections>";
    if kind == Kind::Arrays {
        text += &format!(
            "<ssd:Annotations><ssc:Annotation type=\"org.terramech\"><tm:System xmlns:tm=\"http://terramech.org/SSP1/Annotations\">{arrays}</tm:System></ssc:Annotation></ssd:Annotations>"
        );
    }
    text += &format!(
        "</ssd:System><ssd:DefaultExperiment startTime=\"0\" stopTime=\"1000\"><ssd:Annotations>\
         <ssc:Annotation type=\"com.opensimulationplatform\"><osp:Algorithm><osp:FixedStepAlgorithm baseStepSize=\"{STEP}\"/></osp:Algorithm>\
         </ssc:Annotation></ssd:Annotations></ssd:DefaultExperiment></ssd:SystemStructureDescription>"
    );
    let file = folder.join(format!("{name}.ssd"));
    fs::write(&file, text).expect("a description can be written");
    file
}

const HEAD: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<ssd:SystemStructureDescription xmlns:ssd="http://ssp-standard.org/SSP1/SystemStructureDescription"
    xmlns:ssc="http://ssp-standard.org/SSP1/SystemStructureCommon" xmlns:ssv="http://ssp-standard.org/SSP1/SystemStructureParameterValues"
    xmlns:osp="http://opensimulationplatform.com/SSP/OSPAnnotations" version="1.0" name="bench">
<ssd:System name="bench"><ssd:Elements>
"#;

fn plan(file: &Path) -> Plan {
    check::plan(file, &check::Options::default()).unwrap_or_else(|faults| panic!("{faults}"))
}

fn measure(name: &str, file: &Path, kind: Kind, steps: usize) {
    let plan = Arc::new(plan(file));
    let environment: Arc<dyn Environment> = Arc::new(Silent);
    let mut system = assemble(Arc::clone(&plan), 1, false, &environment, None).expect("the units load");
    system.initialise().expect("the units initialise");
    let mut algorithm = algorithm_of(&plan);
    let mut tick = 0_u64;
    let mut bare = bare(&plan, kind, &environment);
    let mut time = 0.0;
    let (mut ours, mut floor) = (f64::INFINITY, f64::INFINITY);
    for _ in 0..REPEATS {
        let begin = Instant::now();
        run(&mut system, algorithm.as_mut(), &mut tick, steps);
        ours = ours.min(begin.elapsed().as_secs_f64());
        let begin = Instant::now();
        for _ in 0..steps {
            assert!(bare.step(time, STEP));
            time += STEP;
        }
        floor = floor.min(begin.elapsed().as_secs_f64());
    }
    let micro = 1e6 / steps as f64;
    println!("{name}.microseconds_per_step {}", ours * micro);
    println!("{name}.floor {}", floor * micro);
    println!("{name}.ratio_to_floor {}", ours / floor);
}

fn run(system: &mut System, algorithm: &mut dyn terramech::coupling::Algorithm, tick: &mut u64, steps: usize) {
    for _ in 0..steps {
        system.read(*tick).expect("reading");
        algorithm.advance(system, *tick).expect("stepping");
        *tick += 1;
    }
}

/// The same units again, in a bare loop.
fn bare(plan: &Plan, kind: Kind, environment: &Arc<dyn Environment>) -> BareLoop {
    let mut bare = BareLoop::default();
    for (i, c) in plan.components.iter().enumerate() {
        let fmu = &plan.fmus[c.fmu];
        let library = Library::open(fmu.library.as_ref().expect("a library")).expect("the library opens");
        let resources = fmu.unpacked.folder();
        let made = Made { name: &c.name, guid: &fmu.model.guid, resources, logging: false, variable_steps: true };
        let mut unit = Instance::new(&library, &made, Arc::clone(environment)).expect("an instance");
        unit.setup(0.0, None)
            .and_then(|()| unit.enter_initialization())
            .and_then(|()| unit.exit_initialization())
            .expect("initialisation");
        let references = |to: bool| {
            let ends = plan.connections.iter().map(|c| if to { c.to } else { c.from });
            ends.filter(|p| p.component == i).map(|p| p.value_reference).collect::<Vec<_>>()
        };
        let array = |to: bool| {
            let mut ends = plan.arrays.iter().map(|c| if to { c.to } else { c.from });
            ends.find(|p| p.component == i).map(|p| p.value_reference)
        };
        bare.unit(unit, references(false), references(true), (array(false), array(true)));
    }
    let mut used = vec![[0; 2]; plan.components.len()];
    for c in &plan.connections {
        let (a, b) = (c.from.component, c.to.component);
        bare.copy(a, used[a][0], b, used[b][1]);
        used[a][0] += 1;
        used[b][1] += 1;
    }
    if kind == Kind::Arrays {
        plan.arrays.iter().for_each(|c| bare.copy_array(c.from.component, c.to.component));
    }
    bare
}
