//! Nested systems, parameter files, archives, and what is written against what is read.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use super::*;
use crate::check::plan::{Plan, Transform};
use crate::check::{self, Options};
use crate::fault::Faults;
use crate::model_description::Value;

fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(name)
}

fn described(path: &Path) -> (Description, Faults) {
    let mut faults = Faults::new();
    let description = read(path, &mut faults).unwrap_or_else(|| panic!("{faults}"));
    assert!(faults.is_empty(), "{faults}");
    (description, faults)
}

fn planned(path: &Path) -> Plan {
    let options = Options { need_library: false, ..Options::default() };
    check::plan(path, &options).unwrap_or_else(|faults| panic!("{faults}"))
}

#[test]
fn nested_systems_become_flat() {
    let plan = planned(&data("nested/system.ssd"));
    let names: Vec<_> = plan.components.iter().map(|c| c.name.as_str()).collect();
    assert_eq!(names, ["wheel.rig", "terrain", "tire"]);
    let connections: Vec<_> = plan
        .connections
        .iter()
        .map(|c| (plan.port_name(&c.from), plan.port_name(&c.to), c.transform.clone()))
        .collect();
    let expected = |from: &str, to: &str, transform| (from.to_owned(), to.to_owned(), transform);
    // 2 (3 h) + 1 through the system connector, "start" and "end" swapped on the way; the unfed force keeps its start value.
    let map = crate::unit::Linear { factor: 6.0, offset: 1.0 };
    assert_eq!(
        connections,
        [
            expected("wheel.rig.wheel[1].position.x", "tire.position.x", Transform::Copy),
            expected("terrain.height", "wheel.rig.ground_height", Transform::Linear(map)),
        ]
    );
    let notes: Vec<String> = plan.notes.iter().map(ToString::to_string).collect();
    for part in ["nothing feeds system connector", "nobody.x", "no parameter \"absent\"", "gives no base step"] {
        assert!(notes.iter().any(|note| note.contains(part)), "no {part} in {notes:?}");
    }
    // Extras of an inner system count from there.
    assert!(plan.recording.scalars.iter().any(|s| plan.port_name(&s.port) == "wheel.rig.slip"));
}

#[test]
fn higher_bindings_win_and_mappings_rename() {
    let plan = planned(&data("nested/system.ssd"));
    let model = plan.model(0);
    let value = |name: &str| {
        let found = plan.components[0].settings.iter().find(|s| &*model.variables[s.variable].name == name);
        found.map(|s| s.value.clone())
    };
    assert_eq!(value("hub_mass"), Some(Value::Real(7.0))); // outer, 7000 g, over inner, 5 kg
    assert_eq!(value("threads"), Some(Value::Integer(3))); // inner system over component
    assert_eq!(value("ground_height"), Some(Value::Real(0.5)));
    assert_eq!(value("mode"), Some(Value::Integer(2))); // mapped from "drive"
    assert_eq!(value("slip_target"), Some(Value::Real(0.2))); // 15 % + 0.05, through two system connectors
    assert_eq!(value("braked"), None);
    let files: Vec<_> = plan.inputs.iter().map(|i| i.path.file_name().unwrap().to_str().unwrap()).collect();
    assert_eq!(files, ["system.ssd", "values.ssv", "names.ssm"]);
}

/// Everything of a description but where it is written.
fn without_places(mut d: Description) -> String {
    d.place = Place::default();
    d.folder = PathBuf::new();
    d.files.clear();
    let text = format!("{d:?}");
    // Places print their file and line; nothing else holds this text.
    let mut out = String::new();
    let mut rest = text.as_str();
    while let Some(at) = rest.find("Place {") {
        out.push_str(&rest[..at]);
        let end = rest[at..].find('}').unwrap();
        rest = &rest[at + end + 1..];
    }
    out + rest
}

#[test]
fn what_is_written_is_read_back_alike() {
    for name in ["system.ssd", "nested/system.ssd"] {
        let (mut description, _) = described(&data(name));
        let text = write(&description, Audience::Terramech);
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("again.ssd");
        fs::write(&path, &text).unwrap();
        let (again, _) = described(&path);
        // Values that came from files and higher systems now stand at their component, where each must exist.
        let stand_at_component = |v: &mut Assignment| v.must_exist = true;
        description.components.iter_mut().flat_map(|c| &mut c.values).for_each(stand_at_component);
        if name.starts_with("nested") {
            description.units.retain(|u| u.base.is_some());
        }
        assert_eq!(without_places(description), without_places(again), "{text}");
    }
}

#[test]
fn prefixes_are_the_literal_ones_and_ours_can_be_left_out() {
    let (description, _) = described(&data("system.ssd"));
    let text = write(&description, Audience::OtherTools);
    for part in [
        "<ssd:SystemStructureDescription xmlns:ssd=",
        "<ssd:Connector ",
        "<ssc:Real unit=",
        "<ssv:ParameterSet ",
        "<osp:FixedStepAlgorithm baseStepSize=\"0.001\"/>",
    ] {
        assert!(text.contains(part), "no {part} in {text}");
    }
    assert!(!text.contains("terramech"), "{text}");
    assert!(write(&description, Audience::Terramech).contains("<tm:ArrayConnection "));
}

#[test]
fn an_archive_is_read_like_a_folder() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("wheel.ssp");
    let mut writer = zip::write::ZipWriter::new(fs::File::create(&path).unwrap());
    let options = zip::write::SimpleFileOptions::default();
    for (inside, file) in [
        ("SystemStructure.ssd", "system.ssd"),
        ("rig.json", "rig.json"),
        ("rig/modelDescription.xml", "rig/modelDescription.xml"),
        ("tire/modelDescription.xml", "tire/modelDescription.xml"),
        ("terrain/modelDescription.xml", "terrain/modelDescription.xml"),
    ] {
        writer.start_file(inside, options).unwrap();
        writer.write_all(&fs::read(data(file)).unwrap()).unwrap();
    }
    writer.finish().unwrap();
    let plan = planned(&path);
    assert_eq!(plan.connections.len(), 22);
    assert!(plan.folder.is_dir());
    assert!(plan.connections[0].place.to_string().ends_with("wheel.ssp/SystemStructure.ssd:90"));
    assert_eq!(plan.inputs[0].path, path);
}

/// Cut anywhere, or with any byte changed, a file is refused or read, and nothing panics.
#[test]
fn damaged_files_do_not_panic() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("x.ssd");
    for name in ["system.ssd", "nested/system.ssd", "tire/modelDescription.xml"] {
        let whole = fs::read(data(name)).unwrap();
        let is_model = name.ends_with("modelDescription.xml");
        let mut at = 0;
        while at < whole.len() {
            let mut changed = whole.clone();
            changed[at] = [b'"', b'<', b'9', b'-', 0, 0xFF][at % 6];
            for bytes in [&whole[..at], &changed] {
                let mut faults = Faults::new();
                if is_model {
                    crate::model_description::read(bytes, &path, &mut faults);
                } else {
                    fs::write(&path, bytes).unwrap();
                    if let Some(description) = read(&path, &mut faults) {
                        let _ = write(&description, Audience::Terramech);
                    }
                }
            }
            at += 41; // prime: the place in a line and the kind of change vary
        }
    }
}

/// A ring of units with many connections: reading and checking must stay linear.
#[test]
fn many_connections_are_read_and_checked() {
    let folder = tempfile::tempdir().unwrap();
    many(folder.path(), 3000);
    let plan = planned(&folder.path().join("many.ssd"));
    assert_eq!(plan.connections.len(), 6000);
    assert_eq!(plan.initialisation.len(), 1);
}

/// Writes two units that exchange `n` reals each way.
fn many(folder: &Path, n: usize) {
    let mut model = String::from(
        "<fmiModelDescription fmiVersion=\"2.0\" modelName=\"m\" guid=\"g\"><CoSimulation modelIdentifier=\"m\"/><ModelVariables>\n",
    );
    let (mut structure, mut connectors, mut connections) = (String::new(), String::new(), String::new());
    for i in 0..n {
        model += &format!(
            "<ScalarVariable name=\"in[{i}]\" valueReference=\"{i}\" causality=\"input\"><Real start=\"0\"/></ScalarVariable>\n"
        );
        connectors += &format!("<ssd:Connector name=\"in[{i}]\" kind=\"input\"><ssc:Real/></ssd:Connector>\n");
    }
    for i in 0..n {
        model += &format!(
            "<ScalarVariable name=\"out[{i}]\" valueReference=\"{}\" causality=\"output\"><Real/></ScalarVariable>\n",
            n + i
        );
        structure += &format!("<Unknown index=\"{}\" dependencies=\"\"/>\n", n + i + 1);
        connectors += &format!("<ssd:Connector name=\"out[{i}]\" kind=\"output\"><ssc:Real/></ssd:Connector>\n");
        for (a, b) in [("a", "b"), ("b", "a")] {
            connections += &format!(
                "<ssd:Connection startElement=\"{a}\" startConnector=\"out[{i}]\" endElement=\"{b}\" endConnector=\"in[{i}]\"/>\n"
            );
        }
    }
    model += &format!(
        "</ModelVariables><ModelStructure><InitialUnknowns>{structure}</InitialUnknowns></ModelStructure></fmiModelDescription>"
    );
    let component = |name: &str| {
        format!(
            "<ssd:Component name=\"{name}\" source=\"m\"><ssd:Connectors>{connectors}</ssd:Connectors></ssd:Component>"
        )
    };
    let text = format!(
        "<ssd:SystemStructureDescription xmlns:ssd=\"x\" xmlns:ssc=\"y\" version=\"1.0\" name=\"many\"><ssd:System name=\"s\"><ssd:Elements>{}{}</ssd:Elements>\
         <ssd:Connections>{connections}</ssd:Connections></ssd:System><ssd:DefaultExperiment stopTime=\"1\"><ssd:Annotations>\
         <ssc:Annotation type=\"com.opensimulationplatform\"><osp:Algorithm xmlns:osp=\"z\"><osp:FixedStepAlgorithm baseStepSize=\"0.01\"/></osp:Algorithm></ssc:Annotation>\
         </ssd:Annotations></ssd:DefaultExperiment></ssd:SystemStructureDescription>",
        component("a"),
        component("b")
    );
    fs::create_dir_all(folder.join("m")).unwrap();
    fs::write(folder.join("m/modelDescription.xml"), model).unwrap();
    fs::write(folder.join("many.ssd"), text).unwrap();
}

/// Leaves what the writer writes in the temporary folder, for a check against the schemas:
/// `cargo test -p terramech --lib -- --ignored written_files`, then `python master/schema/check.py FOLDER/*`.
#[test]
#[ignore = "leaves files for a schema check"]
fn written_files() {
    let folder = std::env::temp_dir().join("terramech-written");
    fs::create_dir_all(&folder).unwrap();
    for (name, file) in [("single", "system.ssd"), ("nested", "nested/system.ssd")] {
        let (description, _) = described(&data(file));
        fs::write(folder.join(format!("{name}.ssd")), write(&description, Audience::Terramech)).unwrap();
        fs::write(folder.join(format!("{name}-others.ssd")), write(&description, Audience::OtherTools)).unwrap();
    }
}

/// Not a test of speed: prints the times for reports. `cargo test -p terramech --lib -- --ignored --nocapture load_times`
#[test]
#[ignore = "prints times for a report"]
fn load_times() {
    for n in [3000, 30_000] {
        let folder = tempfile::tempdir().unwrap();
        many(folder.path(), n);
        let path = folder.path().join("many.ssd");
        let options = Options { need_library: false, ..Options::default() };
        let start = std::time::Instant::now();
        let plan = check::plan(&path, &options).unwrap();
        println!("{} connections: read and checked in {:?}", plan.connections.len(), start.elapsed());
    }
}

#[test]
fn signal_dictionaries_join_what_is_connected_to_their_entries() {
    let text = fs::read_to_string(data("nested/system.ssd")).unwrap();
    // Terrain and wheel meet in a dictionary's entry; geometry is told and left out.
    let text = text.replace(
        "<ssd:Component name=\"terrain\"",
        "<ssd:SignalDictionaryReference name=\"bus\" dictionary=\"ground\"/><ssd:Component name=\"terrain\"",
    );
    let from = "<ssd:Connection startElement=\"wheel\" startConnector=\"height\" endElement=\"terrain\" endConnector=\"height\">";
    let to = "<ssd:Connection startElement=\"terrain\" startConnector=\"height\" endElement=\"bus\" endConnector=\"h\"/>\
        <ssd:Connection startElement=\"bus\" startConnector=\"h\" endElement=\"wheel\" endConnector=\"height\">";
    assert!(text.contains(from));
    let text = text.replace(from, to).replace("<ssd:Connections>", "<ssd:SystemGeometry x1=\"0\"/><ssd:Connections>");
    let folder = tempfile::tempdir().unwrap();
    for name in ["values.ssv", "names.ssm"] {
        fs::copy(data("nested").join(name), folder.path().join(name)).unwrap();
    }
    let file = folder.path().join("system.ssd");
    fs::write(&file, text.replace("\"../", &format!("\"{}/", data("").display()))).unwrap();
    let plan = planned(&file);
    let heights: Vec<_> = plan.connections.iter().filter(|c| plan.port_name(&c.from) == "terrain.height").collect();
    assert_eq!(heights.len(), 1);
    let map = crate::unit::Linear { factor: 6.0, offset: 1.0 };
    assert_eq!(
        (plan.port_name(&heights[0].to).as_str(), &heights[0].transform),
        ("wheel.rig.ground_height", &Transform::Linear(map))
    );
    let notes: Vec<String> = plan.notes.iter().map(ToString::to_string).collect();
    assert!(
        notes.iter().any(|n| n.contains("dictionary")) && notes.iter().any(|n| n.contains("geometry")),
        "{notes:?}"
    );
}
