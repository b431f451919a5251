#![no_main]

#[path = "../src/documents.rs"]
mod documents;
#[path = "../src/system.rs"]
mod system;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| system::read(bytes));
