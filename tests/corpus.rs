//! The fuzz target of specifications on its corpus and on changed pieces of it: read or refused, without a panic.

#[path = "../master/tests/support/changed.rs"]
mod changed;
#[path = "../fuzz/src/specification.rs"]
mod specification;

use changed::{Random, changed};
use std::path::Path;

/// Changes of each specification; `TERRAMECH_ROUNDS` makes it more, for a long search without nightly and cargo-fuzz.
const ROUNDS: usize = 200;

#[test]
fn specifications() {
    let rounds = std::env::var("TERRAMECH_ROUNDS").ok().and_then(|n| n.parse().ok()).unwrap_or(ROUNDS);
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/corpus/specification");
    let mut random = Random(0x94d0_49bb_1331_11eb);
    for entry in std::fs::read_dir(folder).unwrap() {
        let good = std::fs::read(entry.unwrap().path()).unwrap();
        specification::read(&good);
        specification::read(&good[..good.len() / 2]);
        for _ in 0..rounds {
            let mut bad = changed(&good[1..], &mut random);
            bad.insert(0, good[0]);
            specification::read(&bad);
        }
    }
}
