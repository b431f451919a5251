#![no_main]

#[path = "../src/specification.rs"]
mod specification;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| specification::read(bytes));
