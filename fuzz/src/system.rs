//! A system: `.ssd`, then after a zero byte each, if there are, the `.ssv` and `.ssm` files that it may name. It is checked with units beside it,
//! and what passes can be written again and shown.

use crate::documents;
use terramech::check::{self, Options};
use terramech::description::{self, Audience};
use terramech::fault::Faults;
use terramech::inspect;

/// Names of the documents, in order.
const NAMES: [&str; 3] = ["SystemStructure.ssd", "values.ssv", "names.ssm"];

/// Checks it.
pub fn read(bytes: &[u8]) {
    let folder = documents::lay(bytes, &NAMES);
    let folder = folder.path();
    let options = Options { need_library: false, ..Options::default() };
    let mut faults = Faults::new();
    if let Some(description) = description::read(folder, &mut faults) {
        drop(description::write(&description, Audience::Terramech));
        drop(description::write(&description, Audience::OtherTools));
    }
    match check::plan(folder, &options) {
        Ok(plan) => drop((inspect::plan_json(&plan), inspect::plan_tables(&plan), inspect::mermaid(&plan))),
        Err(faults) => assert!(!faults.to_string().is_empty()),
    }
}
