"""Where the packed FMUs and the master are: `cargo xtask test` says it by environment; by hand the defaults hold."""

import os
import pathlib
import shutil

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
FMUS = pathlib.Path(os.environ.get("TERRAMECH_FMUS", ROOT / "target/fmus"))
TERRAMECH = pathlib.Path(os.environ.get("TERRAMECH_BIN", ROOT / "target/release/terramech"))

NAMES = sorted(p.stem for p in FMUS.glob("*.fmu"))


def pytest_generate_tests(metafunc):
    """Tests that take `name` run once for every FMU that was packed."""
    if "name" in metafunc.fixturenames:
        metafunc.parametrize("name", NAMES)


@pytest.fixture(scope="session", autouse=True)
def packed():
    assert NAMES, f"no FMU in {FMUS}: run `cargo xtask pack` first"
    assert {"rig", "tire-rigid", "terrain-dem-p"} <= set(NAMES)


@pytest.fixture(scope="session")
def extracted(tmp_path_factory):
    """Folders with the unpacked FMUs, by name."""
    import fmpy

    folders = {n: fmpy.extract(str(FMUS / f"{n}.fmu"), unzipdir=str(tmp_path_factory.mktemp(n))) for n in NAMES}
    yield folders
    for folder in folders.values():
        shutil.rmtree(folder, ignore_errors=True)
