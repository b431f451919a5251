"""The Reference FMUs of the Modelica Association in the master: FMPy's values to the last bit, alone and coupled; ends, checkpoints, rollback."""

import csv
import subprocess

import numpy as np
import pytest
import reference
from conftest import TERRAMECH

# A power of two: FMPy forms its steps by differences of times, which are exact then.
STEP = 2.0**-5

HEAD = """<?xml version="1.0" encoding="UTF-8"?>
<ssd:SystemStructureDescription xmlns:ssd="http://ssp-standard.org/SSP1/SystemStructureDescription"
    xmlns:ssc="http://ssp-standard.org/SSP1/SystemStructureCommon" xmlns:osp="http://opensimulationplatform.com/SSP/OSPAnnotations"
    version="1.0" name="reference">
<ssd:System name="reference">"""
TAIL = """<ssd:Annotations><ssc:Annotation type="org.terramech"><tm:System xmlns:tm="http://terramech.org/SSP1/Annotations"><tm:Recording>
{recorded}</tm:Recording></tm:System></ssc:Annotation></ssd:Annotations></ssd:System>
<ssd:DefaultExperiment startTime="0" stopTime="{stop}"><ssd:Annotations><ssc:Annotation type="com.opensimulationplatform">
<osp:Algorithm><osp:FixedStepAlgorithm baseStepSize="{step}"/></osp:Algorithm></ssc:Annotation></ssd:Annotations></ssd:DefaultExperiment>
</ssd:SystemStructureDescription>
"""
# Model, end in s, outputs.
ALONE = [
    ("BouncingBall", 3.0, ["h", "v"]),
    ("Dahlquist", 10.0, ["x"]),
    ("Resource", 2.0, ["y"]),
    ("Stair", 9.0, ["counter"]),
    ("VanDerPol", 20.0, ["x0", "x1"]),
]


@pytest.fixture(scope="session")
def fmus():
    try:
        return reference.build()
    except (OSError, subprocess.SubprocessError) as e:
        pytest.skip(f"the Reference FMUs cannot be built here: {e} {getattr(e, 'stderr', '')}")


def system(folder, fmus, parts, stop, connections="", step=STEP):
    """Writes a system of `parts` (name: model)."""
    folder.mkdir(exist_ok=True)
    elements = "".join(f'<ssd:Component name="{n}" source="{fmus[m].as_uri()}">{c}</ssd:Component>' for n, (m, c) in parts.items())
    recorded = "".join(f'<tm:Scalars element="{n}" connector="*"/>\n' for n in parts)
    connections = f"<ssd:Connections>{connections}</ssd:Connections>" if connections else ""
    text = HEAD + f"<ssd:Elements>{elements}</ssd:Elements>{connections}" + TAIL.format(recorded=recorded, stop=stop, step=step)
    (folder / "system.ssd").write_text(text)
    return folder


def terramech(folder, *args):
    return subprocess.run([str(TERRAMECH), *args], cwd=folder, capture_output=True, text=True, timeout=120)


def columns(out):
    with open(out / "results.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    return {name.split(" [")[0]: [r[name] for r in rows] for name in rows[0]}


def simulate(fmu, stop, outputs, **options):
    import fmpy

    # The description of 2022 gives the Integer of `Stair` no variability, which FMPy refuses.
    options["validate"] = False
    return fmpy.simulate_fmu(str(fmu), stop_time=stop, step_size=STEP, output_interval=STEP, output=outputs, fmi_type="CoSimulation", **options)


@pytest.mark.parametrize("model, stop, outputs", ALONE, ids=[m[0] for m in ALONE])
def test_each_alone_gives_the_values_of_fmpy(fmus, tmp_path, model, stop, outputs):
    system(tmp_path, fmus, {"u": (model, "")}, stop)
    done = terramech(tmp_path, "run", "system.ssd", "--out", "out", "--quiet")
    assert done.returncode == 0, done.stderr
    ours, theirs = columns(tmp_path / "out"), simulate(fmus[model], stop, outputs)
    assert len(ours["time"]) == len(theirs) == stop / STEP + 1
    for name in outputs:
        assert [float(x) for x in ours[f"u.{name}"]] == [float(x) for x in theirs[name]], name
    assert len(set(ours[f"u.{outputs[0]}"])) > 2 or model == "Resource"


def test_every_type_of_input_over_time_gives_the_values_of_fmpy(fmus, tmp_path):
    stop = 2.0
    time = np.arange(0, stop + STEP, STEP)
    names = ["Float64_continuous", "Float64_discrete", "Int32", "Boolean"]
    values = [np.sin(time), np.floor(4 * time) / 3, np.floor(8 * time).astype(int), np.floor(2 * time) % 2 == 1]
    rows = ["time [s]," + ",".join(f"u.{n}_input [1]" for n in names)]
    rows += [",".join([repr(float(t)), *(repr(v[k].item()) if v.dtype != bool else str(int(v[k])) for v in values)]) for k, t in enumerate(time)]
    (tmp_path / "inputs.csv").write_text("\n".join(rows) + "\n")
    system(tmp_path, fmus, {"u": ("Feedthrough", "")}, stop)
    done = terramech(tmp_path, "run", "system.ssd", "--out", "out", "--inputs", "inputs.csv", "--set", "u.String_parameter=soil", "--quiet")
    assert done.returncode == 0, done.stderr
    types = [("time", np.float64), ("Float64_continuous_input", np.float64), ("Float64_discrete_input", np.float64), ("Int32_input", np.int32), ("Boolean_input", np.bool_)]
    given = np.array(list(zip(time, *values)), dtype=types)
    theirs = simulate(fmus["Feedthrough"], stop, [f"{n}_output" for n in names], input=given, start_values={"String_parameter": "soil"})
    ours = columns(tmp_path / "out")
    for name, value in zip(names, values):
        out = [float(x) for x in ours[f"u.{name}_output"]]
        assert out == [float(x) for x in theirs[f"{name}_output"]], name
        # Discrete outputs follow at once, and each value arrives.
        assert {float(v) for v in value[:-1]} <= set(out), name


def test_coupled_units_pass_on_each_kind_of_value(fmus, tmp_path):
    parts = {
        "ball": ("BouncingBall", '<ssd:Connectors><ssd:Connector name="h" kind="output"/></ssd:Connectors>'),
        "stair": ("Stair", '<ssd:Connectors><ssd:Connector name="counter" kind="output"/></ssd:Connectors>'),
        "one": ("Feedthrough", "".join(["<ssd:Connectors>", *(f'<ssd:Connector name="{n}" kind="{k}"/>' for n, k in (("Float64_continuous_input", "input"), ("Int32_input", "input"), ("Float64_continuous_output", "output"))), "</ssd:Connectors>"])),
        "two": ("Feedthrough", '<ssd:Connectors><ssd:Connector name="Float64_continuous_input" kind="input"/></ssd:Connectors>'),
    }
    lines = [("ball", "h", "one", "Float64_continuous_input"), ("stair", "counter", "one", "Int32_input"), ("one", "Float64_continuous_output", "two", "Float64_continuous_input")]
    connections = "".join(f'<ssd:Connection startElement="{a}" startConnector="{x}" endElement="{b}" endConnector="{y}"/>' for a, x, b, y in lines)
    system(tmp_path, fmus, parts, 4.0, connections)
    done = terramech(tmp_path, "run", "system.ssd", "--out", "out", "--quiet")
    assert done.returncode == 0, done.stderr
    ours, ball = columns(tmp_path / "out"), simulate(fmus["BouncingBall"], 4.0, ["h"])
    stair = simulate(fmus["Stair"], 4.0, ["counter"])
    # Jacobi: what a unit is given at a point is what the others had there; it shows after the step.
    assert [float(x) for x in ours["one.Float64_continuous_output"]][1:] == [float(x) for x in ball["h"]][:-1]
    assert [int(float(x)) for x in ours["one.Int32_output"]][1:] == [int(x) for x in stair["counter"]][:-1]
    assert ours["two.Float64_continuous_output"][2:] == ours["ball.h"][:-2]


def test_a_unit_that_asks_for_the_end_ends_the_run(fmus, tmp_path):
    system(tmp_path, fmus, {"stair": ("Stair", ""), "ball": ("BouncingBall", "")}, 30.0)
    done = terramech(tmp_path, "run", "system.ssd", "--out", "out", "--quiet")
    assert done.returncode == 0 and "stair" in done.stderr, done.stderr
    last = float(columns(tmp_path / "out")["time"][-1])
    assert 8.9 <= last <= 10.0 + STEP


@pytest.mark.parametrize("algorithm", ["jacobi", "iterated"])
def test_a_run_that_was_cut_goes_on_to_the_same_bits(fmus, tmp_path, algorithm):
    parts = {
        "a": ("VanDerPol", '<ssd:Connectors><ssd:Connector name="x0" kind="output"/></ssd:Connectors>'),
        "b": ("Feedthrough", '<ssd:Connectors><ssd:Connector name="Float64_continuous_input" kind="input"/></ssd:Connectors>'),
        "c": ("BouncingBall", ""),
    }
    connection = '<ssd:Connection startElement="a" startConnector="x0" endElement="b" endConnector="Float64_continuous_input"/>'
    system(tmp_path, fmus, parts, 4.0, connection)
    common = ("run", "system.ssd", "--quiet", "--algorithm", algorithm)
    assert terramech(tmp_path, *common, "--out", "whole").returncode == 0
    done = terramech(tmp_path, *common, "--out", "pieces", "--stop-time", "1.5", "--checkpoint-every", "0.5")
    assert done.returncode == 0, done.stderr
    done = terramech(tmp_path, "run", "--resume", "pieces", "--stop-time", "4", "--quiet")
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "pieces/results.csv").read_bytes() == (tmp_path / "whole/results.csv").read_bytes()
