"""The Reference FMUs of the Modelica Association, built from source.

They come from no package of their own; the crate `fmi-sys` carries their sources (version of 2022, 2-clause BSD licence) in its documentation. Cargo
fetches it, the C compiler builds them.
"""

import os
import pathlib
import shutil
import subprocess
import zipfile

from conftest import FMUS

CRATE, VERSION = "fmi-sys", "0.5.0"
MODELS = ("BouncingBall", "Dahlquist", "Feedthrough", "Resource", "Stair", "VanDerPol")

MANIFEST = f"""[package]
name = "reference-fmus"
version = "0.0.0"
edition = "2021"
[workspace]
[dependencies]
{CRATE} = {{ version = "={VERSION}", default-features = false }}
"""


def sources(folder):
    """The folder of the sources; `OSError` or `CalledProcessError` when they cannot be had."""
    (folder / "src").mkdir(parents=True, exist_ok=True)
    (folder / "src/lib.rs").touch()
    (folder / "Cargo.toml").write_text(MANIFEST)
    cargo = os.environ.get("CARGO", "cargo")
    subprocess.run([cargo, "fetch"], cwd=folder, check=True, capture_output=True, text=True, timeout=600)
    home = pathlib.Path(os.environ.get("CARGO_HOME", pathlib.Path.home() / ".cargo"))
    found = sorted(home.glob(f"registry/src/*/{CRATE}-{VERSION}/fmi-standard3/docs/Reference-FMUs"))
    if not found:
        raise FileNotFoundError(f"{CRATE} {VERSION} lies nowhere below {home}/registry/src")
    return found[0]


def build():
    """FMUs by name, built once beside the packed ones."""
    folder = FMUS.parent / "reference-fmus"
    made = {model: folder / f"{model}.fmu" for model in MODELS}
    if all(fmu.is_file() for fmu in made.values()):
        return made
    source = sources(folder)
    for model, fmu in made.items():
        library = folder / f"{model}.so"
        compile = [os.environ.get("CC", "cc"), "-shared", "-fPIC", "-O1", "-DFMI_VERSION=2", "-DDISABLE_PREFIX", f"-I{source}/include", f"-I{source}/{model}"]
        files = [source / model / "model.c", source / "src/fmi2Functions.c", source / "src/cosimulation.c"]
        subprocess.run([*compile, *map(str, files), "-o", str(library), "-lm"], check=True, capture_output=True, text=True)
        aside = fmu.with_suffix(".part")
        with zipfile.ZipFile(aside, "w", zipfile.ZIP_DEFLATED) as archive:
            archive.write(source / model / "FMI2.xml", "modelDescription.xml")
            archive.write(library, f"binaries/linux64/{model}.so")
            for resource in sorted((source / model).glob("resources/*")):
                archive.write(resource, f"resources/{resource.name}")
        library.unlink()
        shutil.move(aside, fmu)
    return made
