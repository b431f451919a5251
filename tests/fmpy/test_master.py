"""The master against a loop of a few lines, and against itself: same values, same bits."""

import csv
import json
import os
import subprocess

import numpy as np
import pytest
from conftest import FMUS, ROOT, TERRAMECH
from unit import Unit

SYSTEM = ROOT / "tests/systems/wheel-on-soil/system.ssd"
XYZ, WXYZ = "xyz", "wxyz"


def run(out, *args, check=True):
    command = [str(TERRAMECH), "run", str(SYSTEM), "--out", str(out), "--fmu-path", str(FMUS), "--quiet", *args]
    done = subprocess.run(command, capture_output=True, text=True, timeout=600)
    assert not check or done.returncode == 0, done.stderr
    return done


def columns(out):
    with open(out / "results.csv", newline="") as file:
        rows = list(csv.reader(file))
    header = [h.rsplit(" [", 1)[0] for h in rows[0]]
    return {h: [r[i] for r in rows[1:]] for i, h in enumerate(header)}


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    out = tmp_path_factory.mktemp("master") / "out"
    run(out, "--threads", "1")
    return out


def test_a_loop_in_python_gives_the_same_bits(results, extracted):
    """Explicit Jacobi as the design writes it: all outputs are read before any input is set."""
    table = columns(results)
    folder = SYSTEM.parent
    with Unit(extracted["rig"], "rig") as rig, Unit(extracted["tire-rigid"], "tire") as tire, Unit(extracted["terrain-dem-p"], "terrain") as terrain:
        for unit, file in ((rig, "rig.json"), (tire, "tire-rigid.json"), (terrain, "terrain-dem-p.json")):
            unit.put({"specification": str(folder / file)})
        terrain.put({"body[1].shape": "rigid_mesh"})
        for unit in (rig, tire, terrain):
            unit.enter()
        copy = lambda a, names, b, to: b.put(dict(zip(to, np.atleast_1d(a.get(*names)))))
        state = [f"position.{a}" for a in XYZ] + [f"orientation.{a}" for a in WXYZ] + [f"{v}.{a}" for v in ("velocity", "angular_velocity") for a in XYZ]
        wrench = [f"{v}.{a}" for v in ("force", "moment") for a in XYZ]
        material = [f"material.{m}" for m in ("friction", "restitution", "young_modulus", "poisson_ratio")]
        copy(tire, material, terrain, [f"body[1].{m}" for m in material])
        hub = ["radius", "outer_radius", "hub.mass", *(f"hub.inertia.{a}" for a in ("xx", "yy", "zz"))]
        copy(tire, hub, rig, ["wheel[1].tire_radius", "wheel[1].outer_radius", "wheel[1].hub_mass", *(f"wheel[1].hub_inertia.{a}" for a in ("xx", "yy", "zz"))])
        copy(terrain, ["height"], rig, ["ground_height"])
        wheel = [f"wheel[1].{s}" for s in state]
        copy(rig, wheel, tire, [f"wheel.{s}" for s in state])
        copy(rig, wheel, terrain, [f"body[1].{s}" for s in state])
        for array in ("position", "velocity"):
            terrain.put_array(f"body[1].{array}", tire.array(f"mesh.{array}"))
        terrain.put_array("body[1].triangle", tire.array("mesh.triangle"))
        for unit in (rig, tire, terrain):
            unit.fmu.exitInitializationMode()
        step = 5e-4
        watched = {"rig.drawbar_pull": (rig, "drawbar_pull"), "rig.sinkage": (rig, "sinkage"), "tire.wheel.force.z": (tire, "wheel.force.z"), "terrain.body[1].force.z": (terrain, "body[1].force.z")}
        for k in range(len(table["time"])):
            for column, (unit, name) in watched.items():
                assert float(table[column][k]) == unit.get(name), f"{column} at communication point {k}"
            if k + 1 == len(table["time"]):
                break
            read = {
                "state": rig.get(*wheel),
                "tire": tire.get(*(f"wheel.{w}" for w in wrench)),
                "terrain": terrain.get(*(f"body[1].{w}" for w in wrench)),
            }
            rig.put({f"wheel[1].{w}": x for w, x in zip(wrench, read["tire"])})
            tire.put({f"wheel.{s}": x for s, x in zip(state, read["state"])})
            tire.put({f"contact.{w}": x for w, x in zip(wrench, read["terrain"])})
            terrain.put({f"body[1].{s}": x for s, x in zip(state, read["state"])})
            for unit in (rig, tire, terrain):
                # The master counts whole steps and forms each time once.
                unit.time = k * step
                unit.step(step)
        assert terrain.get("body[1].force.z") > 0, "the wheel never touched the soil"


def test_threads_do_not_change_a_bit(results, tmp_path):
    run(tmp_path / "two", "--threads", "2")
    run(tmp_path / "three", "--threads", "3")
    expected = (results / "results.csv").read_bytes()
    assert (tmp_path / "two" / "results.csv").read_bytes() == expected
    assert (tmp_path / "three" / "results.csv").read_bytes() == expected


def test_a_run_leaves_what_the_design_lists(results):
    for name in ("manifest.json", "summary.json", "results.csv", "log.jsonl", "report.html", "vtk"):
        assert (results / name).exists(), name
    manifest = json.loads((results / "manifest.json").read_text())
    assert len(manifest["inputs"]) >= 4
    for item in json.loads((results / "summary.json").read_text()):
        assert {"name", "value", "unit"} <= set(item)
    html = (results / "report.html").read_text()
    assert "http://" not in html.replace("http://www.w3.org", "") and "<svg" in html


def test_set_overrides_and_is_checked(tmp_path):
    done = run(tmp_path / "a", "--set", "rig.drive.slip=7", check=False)
    assert done.returncode == 1 and "rig.drive.slip" in done.stderr.replace("'", "") and "7" in done.stderr, done.stderr
    assert not (tmp_path / "a" / "results.csv").exists()
    done = run(tmp_path / "b", "--set", "rig.no_such=7", check=False)
    assert done.returncode == 1 and "no_such" in done.stderr
    done = run(tmp_path / "c", "--set", "terrain.specification=missing.json", check=False)
    assert done.returncode != 0 and "missing.json" in done.stderr


def test_the_grouser_wheel_replaces_the_smooth_one_by_its_specification_alone(tmp_path):
    grousers = ROOT / "examples/single-wheel/tire-rigid-grousers.json"
    run(tmp_path / "g", "--set", f"tire.specification={grousers}", "--stop-time", "0.05")
    assert len(columns(tmp_path / "g")["time"]) > 10


def test_a_run_can_be_interrupted(tmp_path):
    import signal
    import time

    out = tmp_path / "out"
    command = [str(TERRAMECH), "run", str(SYSTEM), "--out", str(out), "--fmu-path", str(FMUS), "--stop-time", "1000"]
    env = {**os.environ, "TERM": "dumb"}
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, env=env)
    for _ in range(600):
        if (out / "results.csv").exists() and (out / "results.csv").stat().st_size > 4000:
            break
        time.sleep(0.1)
    process.send_signal(signal.SIGINT)
    _, said = process.communicate(timeout=60)
    assert process.returncode not in (0, -signal.SIGINT), said
    table = columns(out)
    assert len({len(c) for c in table.values()}) == 1 and len(table["time"]) > 1
    assert json.loads((out / "manifest.json").read_text())
