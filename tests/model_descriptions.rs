//! `modelDescriptions/` is what the code says.

use std::path::Path;
use terramech_fmi2::Model;

fn models() -> Vec<Model> {
    [fmu_vehicle::models(), fmu_tire::models(), fmu_terrain::models()].into_iter().flatten().collect()
}

#[test]
fn committed_descriptions_are_what_the_code_writes() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("modelDescriptions");
    for model in models() {
        for (ending, expected) in [("xml", model.xml()), ("schema.json", model.schema_text())] {
            let path = folder.join(format!("{}.{ending}", model.file_name()));
            let found = std::fs::read_to_string(&path).unwrap_or_default();
            // No assert_eq: a difference of hundreds of lines helps nobody.
            assert!(found == expected, "{} is out of date: run `cargo xtask pack` and commit it", path.display());
        }
    }
}

#[test]
fn every_model_has_its_own_guid_and_a_c_identifier() {
    let mut guids = std::collections::HashSet::new();
    for model in models() {
        assert!(guids.insert(model.guid()), "{} shares its GUID", model.name);
        let ok = |c: char| c.is_ascii_alphanumeric() || c == '_';
        assert!(model.name.chars().all(ok) && !model.name.starts_with(|c: char| c.is_ascii_digit()), "{}", model.name);
    }
}

#[test]
fn every_unit_has_the_common_parameters_and_si_units() {
    for model in models() {
        for name in ["specification", "threads"] {
            assert!(model.table.find(name).is_some(), "{} has no '{name}'", model.name);
        }
        for v in model.table.variables() {
            assert!(!v.description.is_empty(), "{}.{} has no description", model.name, v.name);
        }
    }
}
