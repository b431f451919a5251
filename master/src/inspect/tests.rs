use std::path::{Path, PathBuf};

use super::*;

fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(name)
}

fn opened(name: &str) -> Subject {
    let options = Options { need_library: false, ..Options::default() };
    open(&data(name), &options).unwrap_or_else(|faults| panic!("{faults}"))
}

#[test]
fn a_system_is_shown_in_three_forms() {
    let subject = opened("system.ssd");
    let tables = show(&subject, Form::Tables);
    for part in [
        "System single wheel: 0 s to 1 s in 1000 steps of 0.001 s",
        "terrain  terrain",
        "rig.slip_target",
        "tire.mesh.position",
        "every step, extrapolated, order 1",
        "Initialisation",
    ] {
        assert!(tables.contains(part), "no \"{part}\" in:\n{tables}");
    }
    assert!(tables.lines().all(|line| line == line.trim_end()), "{tables}");
    let graph = show(&subject, Form::Mermaid);
    assert!(
        graph.starts_with("flowchart LR\n") && graph.contains("c1 -->|\"force.{x,y,z}<br/>moment.{x,y,z}"),
        "{graph}"
    );
    assert!(graph.contains("c1 ==>|\"mesh.{position,velocity,triangle}\"| c2"), "{graph}");
    let json: serde_json::Value = serde_json::from_str(&show(&subject, Form::Json)).unwrap();
    assert_eq!(json["components"][0]["values"]["slip_target"], 0.3);
    assert_eq!(json["connections"][0]["to"], "tire.position.x");
    assert_eq!(json["time"]["steps"], 1000);
}

#[test]
fn an_fmu_is_shown_in_three_forms() {
    let subject = opened("tire");
    let tables = show(&subject, Form::Tables);
    assert!(
        tables.contains("hub.mass") && tables.contains("array of Integer") && tables.contains("position.x, position.y")
    );
    assert!(show(&subject, Form::Mermaid).contains("m --> calculatedParameter([\"hub.mass<br/>radius\"])"));
    let json: serde_json::Value = serde_json::from_str(&show(&subject, Form::Json)).unwrap();
    assert_eq!(json["variables"][1]["unit"], "m");
    assert_eq!(json["arrays"][0]["initial_dependencies"][0], "position.x");
    assert!(open(&data("nothing.fmu"), &Options::default()).unwrap_err().to_string().contains("cannot be read"));
}
