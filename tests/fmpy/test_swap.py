"""One terrain in place of another: by `--swap`, by the attribute `source`, and a bed of one that starts the other."""

import csv
import json

import pytest
from test_handling import FMUS, at, command

from conftest import ROOT

SINGLE = ROOT / "examples" / "single-wheel"
SMALL = {
    "soil": {
        "radius": {"uniform": {"least": 0.0054, "greatest": 0.0066}},
        "density": 2200.0,
        "friction": 0.8,
        "young_modulus": 4e6,
        "rolling_friction": 0.3,
        "spinning_friction": 0.1,
    },
    "bed": {"length": 0.34, "width": 0.12, "fill": {"depth": 0.05}},
}


def table(out):
    """The results of a run, columns by name."""
    with open(out / "results.csv", newline="") as file:
        rows = list(csv.reader(file))
    header = [h.rsplit(" [", 1)[0] for h in rows[0]]
    return {h: [float(r[i]) if r[i] else float("nan") for r in rows[1:]] for i, h in enumerate(header)}


def run(out, *args, system=SINGLE / "system.ssd"):
    """The small wheel study on a small bed."""
    small = f"terrain.specification={json.dumps(SMALL)}"
    done = command("run", system, "--out", out, "--quiet", "--set", small, "--stop-time", "0.6", *args)
    assert done.returncode == 0, done.stderr
    return table(out)


def sinks(table):
    """The wheel stands in the bed, carried by it: the sinkage at the end (m)."""
    sinkage = at(table, "rig.sinkage", 0.6)
    assert 0.001 < sinkage < 0.04, sinkage
    window = [f for t, f in zip(table["time"], table["rig.wheel_force.z"]) if t > 0.4]
    # The slide's damper carries the rest while it sinks.
    assert 0.7 * 25.28 < sum(window) / len(window) < 1.1 * 25.28
    return sinkage


def test_the_other_terrain_takes_its_place_and_its_bed(tmp_path):
    bed = tmp_path / "soil.bed"
    one = sinks(run(tmp_path / "p", "--set", f"terrain.bed_save={bed}"))
    swap = ("--swap", "terrain=terrain-dem-c.fmu")
    two = sinks(run(tmp_path / "c", *swap, "--set", f"terrain.bed_load={bed}"))
    assert two == pytest.approx(one, rel=0.2), "the same bed under the same wheel"
    # The attribute, and a bed of its own.
    text = (SINGLE / "system.ssd").read_text().replace('source="terrain-dem-p.fmu"', 'source="terrain-dem-c.fmu"')
    # Specifications are named relative to the description.
    for name in SINGLE.glob("*.json"):
        (tmp_path / name.name).write_text(name.read_text())
    (tmp_path / "other.ssd").write_text(text)
    sinks(run(tmp_path / "s", system=tmp_path / "other.ssd"))
    assert (FMUS / "terrain-dem-c.fmu").exists()


def test_a_flexible_tire_on_complementarity_soil_is_exchanged_every_millisecond(tmp_path):
    """The tire takes steps of 4e-5 s: nothing rings, and the coupling makes little energy (the table of docs/dem-c.md)."""
    tire = json.loads((ROOT / "examples" / "tires" / "tire-ancf-lumped-30x12.json").read_text())
    tire["integrator"]["step"] = 4e-5
    soil = json.loads((SINGLE / "terrain-dem-p-flexible.json").read_text())
    soil["bed"] |= {"length": 1.4, "width": 0.6, "fill": {"depth": 0.1}}
    text = (SINGLE / "flexible-soil.ssd").read_text().replace('source="terrain-dem-p.fmu"', 'source="terrain-dem-c.fmu"')
    text = text.replace('baseStepSize="0.00004"', 'baseStepSize="0.001"')
    text = text.replace('Recording every="0.002"', 'Recording every="0.001"')
    (tmp_path / "system.ssd").write_text(text)
    (tmp_path / "rig-flexible.json").write_text((SINGLE / "rig-flexible.json").read_text())
    given = ("--set", f"tire.specification={json.dumps(tire)}", "--set", f"terrain.specification={json.dumps(soil)}")
    done = command("run", tmp_path / "system.ssd", "--out", tmp_path / "out", "--quiet", "--stop-time", "0.2", *given)
    assert done.returncode == 0, done.stderr
    rows = table(tmp_path / "out")
    force = [f for t, f in zip(rows["time"], rows["rig.wheel_force.z"]) if t > 0.1]
    mean = sum(force) / len(force)
    assert mean > 500.0, "the soil carries the wheel"
    # Amplitude at half the exchange's frequency.
    ring = sum(abs(a - 2 * b + c) for a, b, c in zip(force, force[1:], force[2:])) / (len(force) - 2) / 4
    assert ring < 0.01 * mean, (ring, mean)
    for bond in ("wheel", "terrain.body[1]"):
        residual, passed = (rows[f"coupling.{bond}.{x}"][-1] for x in ("residual", "passed"))
        assert abs(residual) < 0.06 * passed, (bond, residual, passed)
