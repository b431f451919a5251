"""Case 9.7: a vehicle on a slope holds or slides as the tangent of the slope against friction says, and stands on soil with its weight."""

import json
import math
import zipfile

import pytest
from test_handling import at, command
from test_on_soil import WEIGHT

from conftest import FMUS, ROOT

UNITS = ("vehicle", "terrain")
BRAKED = {"kind": {"table": {"points": [{"time": 0, "braking": 1}]}}}


def run(system, out, specification, angle, stop, tilted, *args):
    """A run of `system` with the vehicle's specification replaced, on a slope; rows by name."""
    import csv

    file = out.parent / f"{out.name}.json"
    file.write_text(json.dumps(specification))
    slopes = [x for unit in tilted for x in ("--set", f"{unit}.slope={angle!r}")]
    done = command("run", ROOT / "examples" / system, "--out", out, "--quiet", "--stop-time", str(stop), "--set", f"vehicle.specification={file}", *slopes, *args)
    assert done.returncode == 0, done.stderr
    with open(out / "results.csv", newline="") as file:
        rows = list(csv.reader(file))
    return {h.rsplit(" [", 1)[0]: [float(r[i] or "nan") for r in rows[1:]] for i, h in enumerate(rows[0])}


@pytest.mark.parametrize("tangent", [0.4, 0.7, 0.9, 0.98])
def test_on_a_rigid_slope_it_holds_or_slides(tmp_path, tangent):
    friction, angle = 0.8, math.atan(tangent)
    vehicle = {"vehicle": "hmmwv/vehicle.json", "start": {"clearance": -0.03}, "driver": BRAKED}
    # One coefficient, whatever the slip.
    tire = json.loads(zipfile.ZipFile(FMUS / "tire-fiala.fmu").read("resources/specification.json"))
    (tmp_path / "tire.json").write_text(json.dumps(tire | {"friction_min": friction, "friction_max": friction}))
    tires = [x for i in (1, 2, 3, 4) for x in ("--set", f"tire{i}.specification={tmp_path / 'tire.json'}")]
    table = run("handling/acceleration.ssd", tmp_path / "out", vehicle, angle, 3.0, UNITS, *tires)
    speeds = [at(table, "vehicle.speed", t) for t in (1.5, 2.9)]
    if tangent < friction:
        # The tires give way by their relaxation length first.
        assert abs(speeds[1]) < 0.03 and abs(speeds[1]) <= abs(speeds[0]) + 1e-3, speeds
    else:
        expected = -9.81 * (math.sin(angle) - friction * math.cos(angle))
        assert (speeds[1] - speeds[0]) / 1.4 == pytest.approx(expected, rel=0.02)


def test_on_a_slope_of_soil_the_wheels_carry_the_weight(tmp_path):
    angle = 0.15
    vehicle = json.loads((ROOT / "examples/straight-line/vehicle.json").read_text()) | {"driver": BRAKED}
    units = (*UNITS, "tire1", "tire2", "tire3", "tire4")
    table = run("straight-line/system.ssd", tmp_path / "out", vehicle, angle, 0.9, units)
    rows = [k for k, t in enumerate(table["time"]) if t >= 0.7]
    mean = lambda axis: sum(table[f"vehicle.wheel[{i}].force.{axis}"][k] for i in (1, 2, 3, 4) for k in rows) / len(rows)
    # About 1 m/s2 too little in x would be a slide.
    assert mean("z") == pytest.approx(WEIGHT * math.cos(angle), rel=0.03)
    assert mean("x") == pytest.approx(WEIGHT * math.sin(angle), rel=0.05)
    assert abs(at(table, "vehicle.speed", 0.88)) < 0.05
    # The rear axle, downhill, carries more than on level ground.
    rear = sum(table[f"vehicle.wheel[{i}].force.z"][k] for i in (3, 4) for k in rows) / len(rows)
    assert rear > 0.52 * mean("z")


def test_too_steep_is_refused(tmp_path):
    done = command("run", ROOT / "examples/handling/acceleration.ssd", "--out", tmp_path / "o", "--quiet", "--set", "vehicle.slope=1.2")
    assert done.returncode == 1 and "slope" in done.stderr and "1.2" in done.stderr, done.stderr
