//! `terramech import`: a system of the Open Simulation Platform becomes a description that runs.

mod support;

use std::fs;
use std::process::Command;

use support::{Bench, part};

const SYSTEM: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<OspSystemStructure xmlns="http://opensimulationplatform.com/MSMI/OSPSystemStructure" version="0.1">
    <StartTime>0.0</StartTime>
    <EndTime>1</EndTime>
    <BaseStepSize>1e-2</BaseStepSize>
    <Algorithm>fixedStep</Algorithm>
    <Simulators>
        <Simulator name="first" source="mass_first.fmu" stepSize="0.025">
            <InitialValues>
                <InitialValue variable="x0"><Real value="0.01"/></InitialValue>
            </InitialValues>
        </Simulator>
        <Simulator name="second" source="mass_second.fmu"/>
        <Simulator name="relay" source="relay.fmu"/>
    </Simulators>
    <Functions>
        <LinearTransformation name="scale" factor="-2" offset="0.5"/>
    </Functions>
    <Connections>
        <VariableConnection powerBond="spring">
            <Variable simulator="first" name="velocity"/>
            <Variable simulator="second" name="other.velocity"/>
        </VariableConnection>
        <VariableConnection powerBond="spring">
            <Variable simulator="first" name="force"/>
            <Variable simulator="second" name="force"/>
        </VariableConnection>
        <VariableGroupConnection>
            <VariableGroup simulator="first" name="place"/>
            <VariableGroup simulator="second" name="seen"/>
        </VariableGroupConnection>
        <SignalConnection>
            <Variable simulator="first" name="position"/>
            <Signal function="scale" name="in"/>
        </SignalConnection>
        <SignalConnection>
            <Signal function="scale" name="out"/>
            <Variable simulator="relay" name="in[1]"/>
        </SignalConnection>
    </Connections>
</OspSystemStructure>
"#;

fn group(name: &str, variable: &str) -> String {
    format!(
        "<OspModelDescription xmlns=\"https://open-simulation-platform.com/OspModelDescription/1.0.0\" version=\"1.0\">\
         <VariableGroups><Generic name=\"{name}\"><Generic name=\"inner\"><Variable ref=\"{variable}\"/></Generic></Generic></VariableGroups>\
         </OspModelDescription>"
    )
}

/// A folder with the FMUs and the system.
fn folder(system: &str) -> Bench {
    let parts = [part("a", "mass_first", &[]), part("b", "mass_second", &[]), part("c", "relay", &[])];
    let bench = Bench::new("0.01", "1", &parts, &[], "");
    let write = |name: &str, text: &str| fs::write(bench.folder.path().join(name), text).unwrap();
    write("OspSystemStructure.xml", system);
    write("mass_first_OspModelDescription.xml", &group("place", "position"));
    write("mass_second_OspModelDescription.xml", &group("seen", "other.position"));
    bench
}

fn import(bench: &Bench) -> (Option<i32>, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_terramech"));
    command.current_dir(bench.folder.path()).args(["import", "OspSystemStructure.xml", "--out", "imported.ssd"]);
    let out = command.output().unwrap();
    (out.status.code(), String::from_utf8_lossy(&out.stderr).into_owned())
}

#[test]
fn simulators_groups_functions_and_bonds_are_taken_over_and_run() {
    let mut bench = folder(SYSTEM);
    let (code, said) = import(&bench);
    assert_eq!(code, Some(0), "{said}");
    assert!(said.contains("0.025 s is no multiple of the base step") && said.contains("0.02 s is taken"), "{said}");
    bench.file = bench.folder.path().join("imported.ssd");
    let text = fs::read_to_string(&bench.file).unwrap();
    for part in
        ["suppressUnitConversion=\"true\"", "PowerBond name=\"spring\"", "factor=\"-2.0\"", "source=\"relay.fmu\""]
    {
        assert!(text.contains(part), "{part} is not in {text}");
    }
    let outcome = bench.run(1);
    assert_eq!(outcome.bonds.len(), 1);
    let csv = bench.csv();
    let x = csv.numbers("first.position").unwrap();
    assert_eq!((x.len(), x[0]), (101, 0.01));
    assert_ne!(csv.numbers("second.force").unwrap()[50], 0.0);
}

#[test]
fn what_cannot_be_taken_over_is_refused_all_at_once() {
    let system = SYSTEM
        .replace(
            "<LinearTransformation name=\"scale\" factor=\"-2\" offset=\"0.5\"/>",
            "<Sum name=\"scale\" inputCount=\"2\"/>",
        )
        .replace("name=\"other.velocity\"", "name=\"other.velocitx\"")
        .replace("name=\"seen\"", "name=\"unseen\"")
        .replace("fixedStep", "magic")
        .replace("source=\"relay.fmu\"", "source=\"absent.fmu\"");
    let bench = folder(&system);
    let (code, said) = import(&bench);
    assert_eq!(code, Some(1), "{said}");
    for word in ["the function Sum", "did you mean \"other.velocity\"", "unseen", "magic", "absent.fmu"] {
        assert!(said.contains(word), "{word} is not in: {said}");
    }
    assert!(!bench.folder.path().join("imported.ssd").exists());
}

#[test]
fn a_folder_without_a_description_says_what_to_give() {
    let bench = folder(SYSTEM);
    fs::remove_file(&bench.file).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_terramech"));
    let out = command.arg("check").arg(bench.folder.path()).output().unwrap();
    let said = String::from_utf8_lossy(&out.stderr);
    assert!(said.contains("SystemStructure.ssd") && said.contains("terramech import"), "{said}");
}

#[test]
fn a_swap_that_does_not_fit_is_named_first() {
    let parts = [part("a", "mass_first", &[("x0", "1")]), part("b", "mass_second", &[]), part("c", "relay", &[])];
    let wires = [("b.force", "a.force"), ("a.position", "b.other.position")];
    let bench = Bench::new("0.01", "1", &parts, &wires, "");
    let mut command = Command::new(env!("CARGO_BIN_EXE_terramech"));
    command.current_dir(bench.folder.path()).args(["check", "system.ssd", "--swap", "a=relay.fmu"]);
    let said = String::from_utf8_lossy(&command.output().unwrap().stderr).into_owned();
    let first = said.lines().next().unwrap();
    assert!(first.starts_with("--swap a=relay.fmu: ") && first.contains("instead of mass_first.fmu"), "{said}");
}

#[test]
fn a_file_of_another_version_or_without_simulators_is_refused() {
    let bench = folder("<OspSystemStructure version=\"9\"><Simulators/></OspSystemStructure>");
    let (code, said) = import(&bench);
    assert_eq!(code, Some(1), "{said}");
    assert!(said.contains("version") && said.contains("0.1") && said.contains("one Simulator at least"), "{said}");
    assert!(!bench.folder.path().join("imported.ssd").exists());
}
