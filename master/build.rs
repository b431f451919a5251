//! Compiles the log callback: stable Rust cannot define variadic functions.

fn main() {
    println!("cargo::rerun-if-changed=src/loading/log.c");
    cc::Build::new().file("src/loading/log.c").warnings(true).extra_warnings(true).compile("terramech_log");
}
