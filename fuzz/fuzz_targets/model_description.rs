#![no_main]

#[path = "../src/model_description.rs"]
mod model_description;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| model_description::read(bytes));
