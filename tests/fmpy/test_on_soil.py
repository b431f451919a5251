"""The small studies of vehicles and tires on soil: they run, and what they give is what physics asks for."""

import json
import math

import pytest
from test_handling import at, command

from conftest import ROOT

WEIGHT = 9.81 * (2422.738 + 107.91 + 4 * 11.151)


def study(name, out, *args):
    """Runs `system.ssd` of a study; rows by name, headline results."""
    import csv

    done = command("run", ROOT / "examples" / name / "system.ssd", "--out", out, "--quiet", *args)
    assert done.returncode == 0, done.stderr
    with open(out / "results.csv", newline="") as file:
        rows = list(csv.reader(file))
    header = [h.rsplit(" [", 1)[0] for h in rows[0]]
    number = lambda text: float(text) if text else math.nan
    table = {h: [number(r[i]) for r in rows[1:]] for i, h in enumerate(header)}
    return table, {h["name"]: h["value"] for h in json.loads((out / "summary.json").read_text())}


def loads(table, first, last):
    """Sum of the vertical wheel forces, mean over a window (s)."""
    rows = [k for k, t in enumerate(table["time"]) if first <= t <= last]
    return sum(table[f"vehicle.wheel[{i}].force.z"][k] for i in (1, 2, 3, 4) for k in rows) / len(rows)


def finite(table):
    """No value is NaN or infinite; those recorded seldom are empty in between."""
    for name, values in table.items():
        assert math.isfinite(values[0]) and not any(math.isinf(v) for v in values), name
    often = "vehicle.speed" if "vehicle.speed" in table else "rig.drawbar_pull"
    assert all(math.isfinite(v) for v in table[often])




def test_straight_line(tmp_path):
    out = tmp_path / "out"
    table, summary = study("straight-line", out, "--stop-time", "1.9")
    finite(table)
    # Held and lowered: the wheels carry the weight before the throttle opens, the front ones their share.
    assert loads(table, 0.35, 0.5) == pytest.approx(WEIGHT, rel=0.03)
    assert abs(at(table, "vehicle.speed", 0.45)) < 0.1 and at(table, "vehicle.driver_used.throttle", 0.45) == 0
    # Events in order: throttle, engine, motion.
    assert at(table, "vehicle.driver_used.throttle", 0.8) == pytest.approx(0.8)
    assert at(table, "vehicle.engine.speed", 1.0) > 30 > at(table, "vehicle.engine.speed", 0.5)
    assert 0.5 < at(table, "vehicle.speed", 1.7) < at(table, "vehicle.speed", 1.88) < 4
    # The ground drives it: momentum is the integral of the wheels' forces along x.
    steps = [k for k, t in enumerate(table["time"]) if t >= 0.6]
    impulse = sum(
        (table["time"][k + 1] - table["time"][k]) * sum(table[f"vehicle.wheel[{i}].force.x"][k] for i in (1, 2, 3, 4))
        for k in steps[:-1]
    )
    gained = (WEIGHT / 9.81) * (table["vehicle.speed"][-1] - table["vehicle.speed"][steps[0]])
    assert impulse == pytest.approx(gained, rel=0.1)
    # Case 9.4: the engine's work is stored, turned into heat, or given to the soil. (The hubs carry the tires' mass: it is in the vehicle's energy.)
    change = lambda name: table[name][-1] - table[name][0]
    vehicle = sum(change(f"vehicle.{n}_energy") for n in ("kinetic", "potential", "dissipated"))
    tires = sum(change(f"tire{i}.{n}") for i in (1, 2, 3, 4) for n in ("strain_energy", "dissipated_energy"))
    tires -= sum(change(f"tire{i}.pressure_work") for i in (1, 2, 3, 4))
    engine = change("vehicle.engine_work")
    assert engine > 2e4
    assert vehicle + tires + change("terrain.body_work") == pytest.approx(engine, rel=3e-3)
    # Alone, the vehicle's account closes far better: what is left is the coupling's.
    assert engine + change("vehicle.wheel_work") == pytest.approx(vehicle, abs=1e-4 * engine)
    assert tires > 0 and change("terrain.body_work") > 0
    assert (out / "scene.png").stat().st_size > 10_000


def test_obstacle(tmp_path):
    table, _ = study("obstacle", tmp_path / "out", "--stop-time", "0.7")
    finite(table)
    before, on = at(table, "vehicle.speed", 0.14), min(
        v for t, v in zip(table["time"], table["vehicle.speed"]) if 0.2 < t < 0.7
    )
    assert on < before - 0.1, "the obstacle takes speed"
    # The left side goes up, left wheels leave the ground, the right ones carry more.
    assert max(table["vehicle.roll"]) > 0.05
    assert min(v for t, v in zip(table["time"], table["vehicle.wheel[3].force.z"]) if t > 0.3) < 100
    assert max(table["vehicle.wheel[4].force.z"]) > 1.4 * WEIGHT / 4


def test_turn_from_the_platform_onto_soil(tmp_path):
    table, _ = study("turn", tmp_path / "out", "--stop-time", "1.5")
    finite(table)
    # On the platform, before the first wheels reach its end at x = -4.5 m: smooth, the weight is carried.
    assert loads(table, 0.15, 0.3) == pytest.approx(WEIGHT, rel=0.1)
    # Hand-over without a step: no wheel ever carries three times its share, and the front sinks in by less than the bed.
    fall = at(table, "vehicle.chassis.position.z", 0.3) - min(table["vehicle.chassis.position.z"])
    assert 0 < fall < 0.08
    # Steering rises, the path bends to the left.
    assert at(table, "vehicle.driver_used.steering", 0.3) < 0.02 < at(table, "vehicle.driver_used.steering", 1.0)
    assert table["vehicle.chassis.position.y"][-1] > -1.2 and at(table, "vehicle.yaw_rate", 1.4) > 0.02


def test_two_passes_over_the_same_soil(tmp_path):
    bed = tmp_path / "first.bed"
    first, one = study("multi-pass", tmp_path / "one", "--set", f"terrain.bed_save_end={bed}", "--stop-time", "1")
    _, two = study("multi-pass", tmp_path / "two", "--set", f"terrain.bed_load={bed}", "--stop-time", "1")
    finite(first)
    assert one["vertical load"] == pytest.approx(5000, rel=0.1)
    # Deeper in all, but by less than the first time; and more pull on the firmer rut.
    assert one["sinkage"] < two["sinkage"] < 2 * one["sinkage"]
    assert two["drawbar pull"] > one["drawbar pull"] > 0


def test_a_study_that_was_killed_goes_on_to_the_same_bits(tmp_path):
    import subprocess
    import time

    from conftest import FMUS, TERRAMECH

    system = ROOT / "examples/obstacle/system.ssd"
    # A frame for the picture comes at 0.25 s.
    common = ("--quiet", "--stop-time", "0.26")
    assert command("run", system, "--out", tmp_path / "whole", *common).returncode == 0
    line = [TERRAMECH, "run", system, "--fmu-path", FMUS, "--out", tmp_path / "pieces", *common, "--checkpoint-every", "0.03"]
    process = subprocess.Popen([str(x) for x in line], stderr=subprocess.DEVNULL)
    for _ in range(3000):
        if len(list((tmp_path / "pieces/checkpoint").glob("*.tmc"))) > 1 or process.poll() is not None:
            break
        time.sleep(0.05)
    process.kill()
    process.wait()
    assert not (tmp_path / "pieces/summary.json").exists(), "it was killed before its end"
    line = [TERRAMECH, "run", "--resume", tmp_path / "pieces", "--quiet"]
    done = subprocess.run([str(x) for x in line], capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    for name in ("results.csv", "scene.png"):
        assert (tmp_path / "pieces" / name).read_bytes() == (tmp_path / "whole" / name).read_bytes(), name


def test_a_bed_that_cannot_be_written_is_told_before_it_is_made(tmp_path):
    description = ROOT / "examples/multi-pass/system.ssd"
    missing = tmp_path / "no" / "bed"
    done = command("run", description, "--out", tmp_path / "out", "--set", f"terrain.bed_save_end={missing}")
    assert done.returncode == 4 and str(missing) in done.stderr, done.stderr
