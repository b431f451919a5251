"""`terramech soil`: the virtual tests of a specification's soil, as a user calls them."""

import json
import subprocess

import pytest

from conftest import FMUS, TERRAMECH

# Coarse and few: the samples are some grains wide whatever their size.
SOIL = {
    "soil": {"radius": {"equal": 0.02}, "density": 2500, "friction": 0.5, "rolling_friction": 0.1, "young_modulus": 3e6},
    "bed": {"settle": {"energy": 3e-5}},
}


def soil(*args):
    words = [TERRAMECH, "soil", *map(str, args), "--fmu-path", FMUS]
    return subprocess.run(words, capture_output=True, text=True, timeout=600)


@pytest.fixture()
def specification(tmp_path):
    path = tmp_path / "soil.json"
    path.write_text(json.dumps(SOIL))
    return path


def test_a_sheet_of_a_soil(tmp_path, specification):
    out = tmp_path / "sheet"
    done = soil(specification, "--out", out)
    assert done.returncode == 0, done.stderr
    assert "packing fraction" in done.stdout and "Bekker k_phi" in done.stdout
    found = json.loads((out / "soil.json").read_text())
    assert 0.5 < found["packing_fraction"] < 0.66
    assert found["bulk_density"] == pytest.approx(2500 * found["packing_fraction"], rel=0.01)
    # Friction 0.5 with rolling resistance: sand-like.
    assert 15 < found["repose"]["angle"] * 180 / 3.14159 < 45
    assert 15 < found["shear"]["friction_angle"] * 180 / 3.14159 < 45
    assert len(found["shear"]["tests"]) == 3 and len(found["plates"]["tests"]) == 2 and found["plates"]["n"] > 0
    names = {p.name for p in out.iterdir()}
    assert {"repose.svg", "shear.svg", "plates.svg", "report.html"} <= names
    assert (out / "report.html").read_text().count("<svg") >= 3


def test_what_cannot_be_tested_is_told_and_nothing_written(tmp_path, specification):
    out = tmp_path / "out"
    for args, part in [
        ([tmp_path / "nothing.json"], "there is no such file"),
        ([specification, "--fmu", "terrain-rigid.fmu"], "nothing to measure"),
        ([specification, "--fmu", "terrain-dem-c.fmu"], "measured by terrain-dem-p"),
        ([specification, "--fmu", "vehicle.fmu"], ""),
        ([specification, "--fmu", "nowhere.fmu"], "nowhere.fmu"),
    ]:
        done = soil(*args, "--out", out)
        assert done.returncode == 1 and part in done.stderr and "panicked" not in done.stderr, (args, done.stderr)
    wrong = {**SOIL, "soil": {**SOIL["soil"], "density": -1, "colour": "red"}}
    specification.write_text(json.dumps(wrong))
    done = soil(specification, "--out", out)
    assert done.returncode == 1 and "colour" in done.stderr, done.stderr
    assert not out.exists()
    # A folder with somebody else's files is left alone.
    specification.write_text(json.dumps(SOIL))
    out.mkdir()
    (out / "thesis.tex").write_text("")
    done = soil(specification, "--out", out)
    assert done.returncode != 0 and "thesis.tex" in done.stderr, done.stderr
    assert [p.name for p in out.iterdir()] == ["thesis.tex"]
