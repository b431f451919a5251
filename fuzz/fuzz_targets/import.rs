#![no_main]

#[path = "../src/documents.rs"]
mod documents;
#[path = "../src/import.rs"]
mod import;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    import::read(bytes);
});
