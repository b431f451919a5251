//! `cargo xtask pack`: the FMUs of every model, and their descriptions.
//!
//! An FMU is one unit library (the cdylib that adds the C exports to a unit crate, `fmu/lib.rs` there) plus the `modelDescription.xml` of one of its models. Everything in it is written from the code.

use crate::process::{cargo, fmus, root, step, target};
use anyhow::{Context, Result};
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use terramech_fmi2::Model;
use zip::write::SimpleFileOptions;

/// A unit crate, the name of its library file, and its models.
pub struct Library {
    /// Cargo package.
    pub package: &'static str,
    /// Models it carries.
    pub models: Vec<Model>,
}

/// All unit crates.
pub fn libraries() -> Vec<Library> {
    vec![
        Library { package: "fmu-vehicle", models: fmu_vehicle::models() },
        Library { package: "fmu-tire", models: fmu_tire::models() },
        Library { package: "fmu-terrain", models: fmu_terrain::models() },
    ]
}

/// Builds the command `terramech` and all units, packs them; returns the FMUs written.
///
/// # Errors
/// When a build fails or a file cannot be written.
pub fn pack() -> Result<Vec<PathBuf>> {
    write_descriptions(&root().join("modelDescriptions"))?;
    let out = fmus();
    fs::create_dir_all(&out).with_context(|| format!("cannot make {}", out.display()))?;
    let mut written = Vec::new();
    let libraries = libraries();
    let examples: Vec<String> = libraries.iter().map(|l| l.package.replace('-', "_")).collect();
    build(&examples)?;
    for (library, example) in libraries.iter().zip(&examples) {
        let file = format!("{}{example}{}", std::env::consts::DLL_PREFIX, std::env::consts::DLL_SUFFIX);
        let built = target().join("release/examples").join(file);
        let binary = fs::read(&built).with_context(|| format!("cannot read {}", built.display()))?;
        for model in &library.models {
            let path = out.join(format!("{}.fmu", model.file_name()));
            write_fmu(&path, model, &binary).with_context(|| format!("cannot write {}", path.display()))?;
            eprintln!("   {}", path.display());
            written.push(path);
        }
    }
    Ok(written)
}

/// Builds the command `terramech` and the unit libraries, side by side.
///
/// With `--workspace` cargo resolves the same features as for this task itself and for the tests, so that no dependency compiles twice.
fn build(examples: &[String]) -> Result<()> {
    let mut args = vec!["build", "--release", "--quiet", "--workspace", "--bin", "terramech"];
    for example in examples {
        args.extend(["--example", example]);
    }
    step("building terramech and the units", &mut cargo(&args))
}

/// Writes `modelDescriptions/`: per model the XML and the JSON schema of its specification.
///
/// # Errors
/// When a file cannot be written.
pub fn write_descriptions(folder: &Path) -> Result<()> {
    fs::create_dir_all(folder)?;
    for (name, text) in descriptions() {
        let path = folder.join(name);
        // Untouched when equal, so that a build does not follow from packing.
        if fs::read_to_string(&path).ok().as_deref() != Some(&text) {
            fs::write(&path, text).with_context(|| format!("cannot write {}", path.display()))?;
        }
    }
    Ok(())
}

/// The files of `modelDescriptions/` as (name, content).
pub fn descriptions() -> Vec<(String, String)> {
    let mut files = vec![("org.terramech.xsd".to_string(), terramech::description::annotations::SCHEMA.to_string())];
    for model in libraries().iter().flat_map(|l| &l.models) {
        let name = model.file_name();
        files.push((format!("{name}.xml"), model.xml()));
        files.push((format!("{name}.schema.json"), model.schema_text()));
    }
    files
}

/// The platform folder of FMI 2.0.
fn platform() -> &'static str {
    match (std::env::consts::OS, std::env::consts::ARCH) {
        ("macos", _) => "darwin64",
        ("windows", _) => "win64",
        (_, "aarch64") => "aarch64-linux",
        _ => "linux64",
    }
}

fn write_fmu(path: &Path, model: &Model, binary: &[u8]) -> Result<()> {
    // Written aside and renamed: a reader never sees half an archive.
    let aside = path.with_extension("fmu.part");
    let mut zip = zip::ZipWriter::new(fs::File::create(&aside)?);
    let options = SimpleFileOptions::default().compression_method(zip::CompressionMethod::Deflated);
    let mut add = |name: String, content: &[u8]| -> Result<()> {
        zip.start_file(name, options)?;
        zip.write_all(content)?;
        Ok(())
    };
    add("modelDescription.xml".into(), model.xml().as_bytes())?;
    add(format!("binaries/{}/{}{}", platform(), model.name, std::env::consts::DLL_SUFFIX), binary)?;
    add("resources/specification.json".into(), model.default_specification.as_bytes())?;
    add("resources/specification.schema.json".into(), model.schema_text().as_bytes())?;
    add("documentation/index.html".into(), documentation(model).as_bytes())?;
    for licence in ["LICENSE-MIT", "LICENSE-APACHE"] {
        add(format!("documentation/licenses/{licence}"), &fs::read(root().join(licence))?)?;
    }
    zip.finish()?;
    fs::rename(&aside, path)?;
    Ok(())
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

/// `documentation/index.html`: what the unit is, its variables, its default specification.
fn documentation(model: &Model) -> String {
    let mut rows = String::new();
    for v in model.table.variables() {
        rows += &format!(
            "<tr><td><code>{}</code></td><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>\n",
            escape(&v.name),
            v.causality.word(),
            v.start.type_name(),
            escape(v.unit),
            escape(&v.description)
        );
    }
    let paragraphs: String = model
        .documentation
        .split("\n\n")
        .filter(|p| !p.trim().is_empty())
        .map(|p| format!("<p>{}</p>\n", escape(p)))
        .collect();
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>{name}</title>\n<style>body{{font:15px/1.5 sans-serif;max-width:70em;margin:2em \
         auto;padding:0 1em}}td,th{{text-align:left;padding:.15em .8em .15em 0;vertical-align:top;border-bottom:1px solid #ddd}}pre{{background:#f4f4f4;\
         padding:1em;overflow:auto}}</style></head><body>\n<h1>{name}</h1>\n<p>{description}</p>\n{paragraphs}\
         <h2>Specification</h2>\n<p>String parameter <code>specification</code>: empty = the default below, text that starts with <code>{{</code> = inline \
         JSON, else an absolute path. Its schema is <code>resources/specification.schema.json</code>.</p>\n<pre>{spec}</pre>\n\
         <h2>Variables</h2>\n<table><tr><th>name</th><th>causality</th><th>type</th><th>unit</th><th>meaning</th></tr>\n{rows}</table>\n\
         <p>Arrays are read and written by the functions <code>terramech_getRealArray</code> and its relatives; they are announced in \
         <code>VendorAnnotations</code>.</p>\n</body></html>\n",
        name = escape(model.name),
        description = escape(model.description),
        spec = escape(&model.default_specification),
    )
}
