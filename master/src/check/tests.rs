//! The whole reading side on the hand-made rig, tire and terrain of `tests/data`.

use std::fs;
use std::path::{Path, PathBuf};

use super::plan::{When, *};
use super::*;
use crate::fault::FaultKind;
use crate::model_description::Value;
use crate::world::Ranks;

fn data() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data")
}

fn options() -> Options {
    Options { need_library: false, ..Options::default() }
}

/// A copy of the test data in which texts of a file are replaced.
fn edited(file: &str, edits: &[(&str, &str)]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for name in [
        "system.ssd",
        "rig.json",
        "rig/modelDescription.xml",
        "tire/modelDescription.xml",
        "terrain/modelDescription.xml",
    ] {
        let target = folder.path().join(name);
        fs::create_dir_all(target.parent().unwrap()).unwrap();
        let mut text = fs::read_to_string(data().join(name)).unwrap();
        if name == file {
            for (from, to) in edits {
                assert!(text.contains(from), "{name} has no {from}");
                text = text.replacen(from, to, 1);
            }
        }
        fs::write(target, text).unwrap();
    }
    folder
}

fn check_edited(file: &str, edits: &[(&str, &str)]) -> Result<Plan, Faults> {
    let folder = edited(file, edits);
    plan(&folder.path().join("system.ssd"), &options())
}

/// The faults of an edited system description.
fn faults(edits: &[(&str, &str)]) -> Faults {
    check_edited("system.ssd", edits).expect_err("accepted")
}

/// Exactly one fault, with these parts in its message.
fn one_fault(edits: &[(&str, &str)], parts: &[&str]) {
    let faults = faults(edits);
    assert_eq!(faults.len(), 1, "{faults}");
    assert_eq!(faults.exit_code(), 1);
    let text = faults.to_string();
    for part in parts {
        assert!(text.contains(part), "no \"{part}\" in: {text}");
    }
}

fn good() -> Plan {
    plan(&data().join("system.ssd"), &options()).unwrap_or_else(|faults| panic!("{faults}"))
}

#[test]
fn the_single_wheel_becomes_a_plan() {
    let plan = good();
    assert_eq!(plan.notes.iter().map(ToString::to_string).collect::<Vec<_>>(), Vec::<String>::new());
    assert_eq!(plan.components.iter().map(|c| c.name.as_str()).collect::<Vec<_>>(), ["rig", "tire", "terrain"]);
    assert_eq!((plan.connections.len(), plan.arrays.len(), plan.fmus.len()), (13 + 6 + 3, 5, 3));
    assert_eq!((plan.clock.steps, plan.clock.stop()), (1000, 1.0));
    assert_eq!(plan.components.iter().map(|c| c.multiple).collect::<Vec<_>>(), [1, 2, 2]);
    assert_eq!(plan.components[2].threads, Some(4));
    assert_eq!(plan.components[2].ranks, Ranks::parse("1..3"));
    // 30 % of a dimensionless unit; an enumeration item by name; a specification beside the description.
    let settings = &plan.components[0].settings;
    let value = |name: &str| {
        let variable = |s: &&Setting| &*plan.model(0).variables[s.variable].name == name;
        settings.iter().find(variable).map(|s| s.value.clone()).unwrap()
    };
    assert_eq!(value("slip_target"), Value::Real(0.3));
    assert_eq!(value("mode"), Value::Integer(2));
    assert_eq!(value("braked"), Value::Boolean(true));
    let specification = data().join("rig.json").canonicalize().unwrap();
    assert_eq!(value("specification"), Value::String(specification.to_str().unwrap().into()));
    assert!(plan.inputs.iter().any(|input| input.path == specification && input.sha256.len() == 64));
    // Force inputs are extrapolated, moments held.
    let order = |name: &str| plan.connections.iter().find(|c| plan.port_name(&c.to) == name).unwrap().extrapolation;
    assert_eq!((order("rig.wheel[1].force.z"), order("rig.wheel[1].moment.z")), (1, 0));
    let when = |name: &str| plan.connections.iter().find(|c| plan.port_name(&c.to) == name).unwrap().when;
    assert_eq!((when("rig.hub_mass"), when("rig.ground_height")), (When::Initially, When::Always));
    assert_eq!(plan.arrays.iter().filter(|a| a.when == When::Initially).count(), 1);
}

#[test]
fn recording_bonds_and_summary_are_resolved() {
    let plan = good();
    let columns: Vec<(String, u64)> =
        plan.recording.scalars.iter().map(|s| (plan.port_name(&s.port), s.every)).collect();
    assert!(columns.contains(&("rig.drawbar_pull".into(), 10)));
    assert!(columns.contains(&("terrain.contact_count".into(), 2)));
    assert!(columns.contains(&("tire.force.x".into(), 2)));
    assert_eq!(columns.len(), 22 + 2); // the connected sources and the two chosen ones
    let [bed, wheel] = plan.recording.vtk.as_slice() else { panic!() };
    assert_eq!((bed.every, bed.triangle, bed.fields.len()), (20, None, 1));
    assert!(wheel.triangle.is_some() && wheel.fields[1].index.is_some());
    let bond = &plan.bonds[0];
    assert_eq!(plan.port_name(&plan.connections[bond.pairs[1].effort].from), "tire.moment.y");
    assert_eq!(plan.port_name(&plan.connections[bond.pairs[1].flow].to), "tire.angular_velocity.y");
    let item = &plan.summary[0];
    assert_eq!((item.from, item.to, item.measured), (500, 1000, Some(12.5)));
}

/// The stage in which an input or parameter is set.
fn stage_of(plan: &Plan, name: &str) -> usize {
    let scalar = |s: &InitialStage| s.connections.iter().any(|&c| plan.port_name(&plan.connections[c].to) == name);
    let array = |s: &InitialStage| s.arrays.iter().any(|&c| plan.array_name(&plan.arrays[c].to) == name);
    plan.initialisation.iter().position(|s| scalar(s) || array(s)).unwrap_or_else(|| panic!("{name} is never set"))
}

#[test]
fn units_are_visited_as_often_as_their_variables_need() {
    let plan = good();
    // Radius first, since the height depends on it; then height, vehicle placed; tire placed; mesh to the terrain again.
    let (radius, height) = (stage_of(&plan, "terrain.body[1].radius"), stage_of(&plan, "rig.ground_height"));
    let (pose, mesh) = (stage_of(&plan, "tire.position.x"), stage_of(&plan, "terrain.body[1].position"));
    assert!(radius < height && height < pose && pose < mesh, "{radius} {height} {pose} {mesh}");
    assert_eq!(stage_of(&plan, "rig.hub_mass"), radius);
    let served: usize = plan.initialisation.iter().map(|s| s.connections.len() + s.arrays.len()).sum();
    assert_eq!(served, plan.connections.len() + plan.arrays.len());
}

#[test]
fn a_true_loop_of_initial_values_names_its_path() {
    // The height now depends on the mesh, which depends on the pose, which depends on the height.
    let scalar = "      </Extension>";
    let loops =
        "        <Scalar name=\"height\"><InitialDependency name=\"body[1].position\"/></Scalar>\n      </Extension>";
    let faults = check_edited("terrain/modelDescription.xml", &[(scalar, loops)]).unwrap_err();
    assert_eq!(faults.len(), 1, "{faults}");
    let FaultKind::Loop { path } = &*faults.faults()[0].kind else { panic!("{faults}") };
    assert_eq!(path.first(), path.last());
    assert_eq!(path.len(), 7, "{path:?}");
    for part in ["terrain.height", "rig.ground_height", "tire.mesh.position", "terrain.body[1].position"] {
        assert!(path.iter().any(|p| p == part), "{path:?}");
    }
}

#[test]
fn a_loop_of_assumed_dependencies_is_cut_with_a_note() {
    // The tire lists nothing any more: by the standard its forces may depend on its pose, and the rig's pose does not.
    let text = fs::read_to_string(data().join("rig/modelDescription.xml")).unwrap();
    let from = text.find("<ModelStructure>").unwrap();
    let plan = check_edited("rig/modelDescription.xml", &[(&text[from..], "<ModelStructure/></fmiModelDescription>")]);
    let plan = plan.unwrap_or_else(|faults| panic!("{faults}"));
    let served: usize = plan.initialisation.iter().map(|s| s.connections.len() + s.arrays.len()).sum();
    assert_eq!(served, plan.connections.len() + plan.arrays.len());
}

#[test]
fn every_kind_of_mistake_has_one_clear_message() {
    one_fault(
        &[("source=\"./tire\"", "source=\"tyre.fmu\"")],
        &["system.ssd:", "no such FMU", "tyre.fmu", "looked for"],
    );
    one_fault(
        &[("startConnector=\"height\"", "startConnector=\"heigth\"")],
        &["system.ssd:", "no variable \"heigth\"", "\"height\""],
    );
    one_fault(&[("endElement=\"tire\"", "endElement=\"tires\"")], &["no component \"tires\"", "did you mean \"tire\""]);
    one_fault(
        &[("endConnector=\"ground_height\"", "endConnector=\"wheel[1].force.z\"")],
        &["wheel[1].force.z\" is fed twice", "tire.force.z", "terrain.height", "line "],
    );
    one_fault(
        &[("startConnector=\"wheel[1].position.x\"", "startConnector=\"slip\"")],
        &["units do not match", "\"rig.slip\" is in 1", "tire.position.x\" in m"],
    );
    one_fault(
        &[("startConnector=\"wheel[1].position.x\"", "startConnector=\"touching\"")],
        &["types do not match", "\"rig.touching\" is Boolean", "is Real"],
    );
    one_fault(
        &[("startConnector=\"height\"", "startConnector=\"body[1].radius\"")],
        &["\"terrain.body[1].radius\" and \"rig.ground_height\" are both targets"],
    );
    one_fault(
        &[(
            "startElement=\"terrain\" startConnector=\"height\"",
            "startElement=\"tire\" startConnector=\"mesh.position\"",
        )],
        &["\"tire.mesh.position\" is an array", "a scalar is needed"],
    );
    one_fault(
        &[("startConnector=\"mesh.position\"", "startConnector=\"force.x\"")],
        &["\"tire.force.x\" is a scalar", "an array is needed"],
    );
    one_fault(
        &[("startConnector=\"mesh.position\"", "startConnector=\"mesh.triangle\"")],
        &["types do not match", "an array of Integer"],
    );
    one_fault(&[("StepSizeHint value=\"0.002\"", "StepSizeHint value=\"0.0015\"")], &["0.0015 s", "0.001 and 0.002"]);
    one_fault(&[("stopTime=\"1\"", "stopTime=\"1.0005\"")], &["whole multiple of the base step 0.001"]);
    one_fault(&[("every=\"0.01\"", "every=\"0.0105\"")], &["Scalars rig.drawbar_*", "0.0105"]);
    one_fault(&[("value=\"30\" unit=\"%\"", "value=\"130\" unit=\"%\"")], &["slip_target\" = 1.3", "0 to 1"]);
    one_fault(&[("value=\"30\" unit=\"%\"", "value=\"30\" unit=\"kg\"")], &["units do not match", "kg", "slip_target"]);
    one_fault(
        &[("<ssv:Real value=\"30\" unit=\"%\"/>", "<ssv:String value=\"much\"/>")],
        &["slip_target\" takes Real", "given was String \"much\""],
    );
    one_fault(
        &[("imposed_speed", "imposed_spede")],
        &["no item \"imposed_spede\"", "imposed_slip (1), imposed_speed (2)"],
    );
    one_fault(&[("name=\"braked\"", "name=\"breaked\"")], &["no variable \"breaked\"", "\"braked\""]);
    one_fault(&[("value=\"rig.json\"", "value=\"wheel.json\"")], &["no such specification", "wheel.json"]);
    one_fault(
        &[(
            "name=\"hub_mass\" kind=\"parameter\"><ssc:Real unit=\"kg\"/>",
            "name=\"hub_mass\" kind=\"parameter\"><ssc:Integer/>",
        )],
        &["\"connector hub_mass\" is Integer", "Real"],
    );
    one_fault(&[("ssc:Real unit=\"kg\"", "ssc:Real unit=\"N\"")], &["connector hub_mass", "in N", "kg"]);
    one_fault(&[("connector=\"wheel[1].force.*\"", "connector=\"force.*\"")], &["Extrapolation", "rig.force.*"]);
    one_fault(&[("order=\"1\"", "order=\"3\"")], &["order=\"3\"", "0, 1 or 2"]);
    one_fault(&[("multiple=\"2\"", "multiple=\"0\"")], &["multiple=\"0\"", "whole number from 1"]);
    one_fault(&[("<tm:Summary>", "<tm:Sumary/><tm:Summary>")], &["Sumary", "Recording, Summary"]);
    one_fault(
        &[("position=\"grain.position\"", "position=\"body[1].position\"")],
        &["causality input", "record the output"],
    );
    one_fault(
        &[("flowConnector=\"wheel[1].velocity.x\"", "flowConnector=\"wheel[1].angular_velocity.x\"")],
        &["product is a power", "[N"],
    );
    one_fault(&[("from=\"0.5\" to=\"1\"", "from=\"1\" to=\"1\"")], &["window", "at least one base step"]);
}

#[test]
fn all_mistakes_are_told_at_once_with_their_lines() {
    let faults = faults(&[
        ("endElement=\"tire\"", "endElement=\"tires\""),
        ("startConnector=\"height\"", "startConnector=\"heigth\""),
        ("imposed_speed", "flying"),
        ("order=\"1\"", "order=\"x\""),
    ]);
    assert_eq!(faults.len(), 4, "{faults}");
    assert!(faults.faults().iter().all(|fault| fault.place.line > 0), "{faults}");
}

#[test]
fn broken_xml_is_told_and_nothing_else() {
    one_fault(&[("</ssd:Elements>", "</ssd:Element>")], &["system.ssd:", "not well-formed"]);
    one_fault(&[("<ssd:System name", "<!DOCTYPE a [<!ENTITY b \"c\">]><ssd:System name")], &["DOCTYPE"]);
    one_fault(&[("version=\"1.0\" name=\"single", "version=\"3.0\" name=\"single")], &["version \"3.0\""]);
    let missing = plan(Path::new("nowhere.ssd"), &options()).unwrap_err();
    assert!(missing.to_string().starts_with("nowhere.ssd: cannot be read"), "{missing}");
}

#[test]
fn overrides_win_and_are_checked_alike() {
    let with = |set: &[&str]| {
        let set = set.iter().map(|&s| s.to_owned()).collect();
        plan(&data().join("system.ssd"), &Options { set, ..options() })
    };
    let plan = with(&["rig.slip_target=0.5", "rig.mode=imposed_slip", "tire.specification={\"a\": 1}"]).unwrap();
    let rig = &plan.components[0].settings;
    assert!(rig.iter().any(|s| s.value == Value::Real(0.5)) && rig.iter().any(|s| s.value == Value::Integer(1)));
    assert_eq!(plan.components[1].settings[0].value, Value::String("{\"a\": 1}".into()));
    for (text, part) in [
        ("rig.slip_target=5", "outside its range 0 to 1"),
        ("rig.slip_target=a", "takes Real"),
        ("rig.slip_targt=0.1", "did you mean \"slip_target\""),
        ("rigg.slip_target=0.1", "no component \"rigg\""),
        ("rig.slip=0.1", "causality output"),
        ("slip", "unit.variable=value"),
        ("slip=1", "unit.variable=value"),
        ("rig.specification=nowhere.json", "no such specification"),
        ("tire.mesh.position=1", "is an array"),
    ] {
        let faults = with(&[text]).unwrap_err();
        assert!(faults.len() == 1 && faults.to_string().contains(part), "{text}: {faults}");
    }
    let short = Options { stop_time: Some("0.1".into()), ..options() };
    let plan = super::plan(&data().join("system.ssd"), &short).unwrap();
    assert_eq!((plan.clock.steps, plan.summary.len(), plan.notes.len()), (100, 0, 1));
    for text in ["0", "-1", "1.0001", "x"] {
        let bad = Options { stop_time: Some(text.into()), ..options() };
        assert_eq!(super::plan(&data().join("system.ssd"), &bad).unwrap_err().len(), 1, "{text}");
    }
}

#[test]
fn fmus_that_cannot_run_here_are_told() {
    let faults = plan(&data().join("system.ssd"), &Options::default()).unwrap_err();
    assert_eq!(faults.len(), 3);
    assert!(faults.to_string().contains("needed binaries/"), "{faults}");
    for (from, to, part) in [
        ("<CoSimulation", "<ModelExchange", "model exchange only"),
        ("fmiVersion=\"2.0\"", "fmiVersion=\"3.0\"", "version \"3.0\""),
        ("fmiVersion=\"2.0\"", "fmiVersion=\"1.0\"", "version \"1.0\""),
        ("modelIdentifier=\"rig\"", "modelIdentifier=\"../rig\"", "C identifier"),
        ("valueReference=\"0\"", "valueReference=\"-1\"", "valueReference=\"-1\""),
        ("name=\"threads\"", "name=\"specification\"", "is there twice (first at line"),
        ("start=\"0.2\"", "start=\"0,2\"", "start=\"0,2\""),
        ("declaredType=\"Mode\"", "declaredType=\"Mood\"", "a SimpleType of kind Enumeration"),
        ("dependencies=\"7\"", "dependencies=\"700\"", "numbers of ScalarVariables"),
    ] {
        let faults = check_edited("rig/modelDescription.xml", &[(from, to)]).unwrap_err();
        assert!(faults.len() == 1 && faults.to_string().contains(part), "{to}: {faults}");
    }
    let once = ("canGetAndSetFMUstate=", "canBeInstantiatedOnlyOncePerProcess=\"true\" canGetAndSetFMUstate=");
    assert!(check_edited("rig/modelDescription.xml", &[once]).is_ok());
}

#[test]
fn wheels_and_contacts_of_our_units_are_power_bonds_without_a_declaration() {
    let plan = check_edited("system.ssd", &[]).unwrap();
    let names: Vec<&str> = plan.bonds.iter().map(|b| b.name.as_str()).collect();
    // The declared pairs are not taken twice: force.x and moment.y stand in "wheel".
    assert_eq!(names, ["wheel", "rig.wheel[1]", "terrain.body[1]"]);
    assert_eq!((plan.bonds[1].pairs.len(), plan.bonds[1].means), (4, true));
    for pair in &plan.bonds[1].pairs {
        let (effort, flow) = (&plan.connections[pair.effort], &plan.connections[pair.flow]);
        assert_eq!((effort.from.component, effort.to.component), (flow.to.component, flow.from.component));
    }
    let contact = plan.bonds[2].contacts[0];
    let name = |array: usize| plan.array_name(&plan.arrays[array].from);
    let wanted = ["terrain.body[1].contact.force", "terrain.body[1].contact.index", "tire.mesh.velocity"];
    assert_eq!([name(contact.effort), name(contact.index), name(contact.flow)], wanted);
    // Units of others have the bonds that are declared and no more.
    let foreign = check_edited("tire/modelDescription.xml", &[("org.terramech", "org.example")]);
    assert!(foreign.is_err() || foreign.unwrap().bonds.len() == 1);
}
