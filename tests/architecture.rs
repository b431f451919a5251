//! The map is true: every path that ARCHITECTURE.md names exists.

use std::path::Path;

#[test]
fn every_path_in_the_map_exists() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(root.join("ARCHITECTURE.md")).unwrap();
    let rooms = ["master", "fmu-", "crates", "modelDescriptions", "tests", "examples", "docs"];
    let mut checked = 0;
    for (i, name) in text.split('`').enumerate() {
        // Odd pieces stand between backquotes; `fmu-*` and commands are no paths.
        let path = i % 2 == 1 && rooms.iter().any(|r| name.starts_with(r)) && !name.contains(['*', ' ', '\n']);
        if path {
            assert!(root.join(name).exists(), "ARCHITECTURE.md names `{name}`, which does not exist");
            checked += 1;
        }
    }
    assert!(checked > 15, "only {checked} paths found: has the map changed its form?");
}
