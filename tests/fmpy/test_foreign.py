"""Units that others made: an FMU of `pythonfmu`, alone in the master, gives FMPy's values to the last bit."""

import csv
import os
import pathlib
import subprocess
import sys
import sysconfig
import zipfile

import pytest
from conftest import TERRAMECH

pytest.importorskip("pythonfmu")

SOURCE = '''
from pythonfmu import Boolean, Fmi2Causality, Fmi2Slave, Fmi2Variability, Integer, Real, String


class Spring(Fmi2Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.mass, self.stiffness, self.force = 2.0, 50.0, 0.0
        self.position, self.velocity = 0.1, 0.0
        self.steps, self.moving, self.label = 0, False, "spring"
        tunable = {"causality": Fmi2Causality.parameter, "variability": Fmi2Variability.tunable}
        self.register_variable(Real("mass", **tunable))
        self.register_variable(Real("stiffness", **tunable))
        self.register_variable(Real("force", causality=Fmi2Causality.input))
        for name in ("position", "velocity"):
            self.register_variable(Real(name, causality=Fmi2Causality.output))
        self.register_variable(Integer("steps", causality=Fmi2Causality.output))
        self.register_variable(Boolean("moving", causality=Fmi2Causality.output))
        self.register_variable(String("label", causality=Fmi2Causality.output))

    def do_step(self, current_time, step_size):
        self.velocity += step_size * (self.force - self.stiffness * self.position) / self.mass
        self.position += step_size * self.velocity
        self.steps += 1
        self.moving = abs(self.velocity) > 1e-3
        return True
'''

SYSTEM = """<?xml version="1.0" encoding="UTF-8"?>
<ssd:SystemStructureDescription xmlns:ssd="http://ssp-standard.org/SSP1/SystemStructureDescription"
    xmlns:ssc="http://ssp-standard.org/SSP1/SystemStructureCommon" xmlns:osp="http://opensimulationplatform.com/SSP/OSPAnnotations"
    version="1.0" name="foreign">
<ssd:System name="foreign"><ssd:Elements><ssd:Component name="spring" source="Spring.fmu"/></ssd:Elements>
<ssd:Annotations><ssc:Annotation type="org.terramech"><tm:System xmlns:tm="http://terramech.org/SSP1/Annotations"><tm:Recording>
<tm:Scalars element="spring" connector="*"/></tm:Recording></tm:System></ssc:Annotation></ssd:Annotations></ssd:System>
<ssd:DefaultExperiment startTime="0" stopTime="1"><ssd:Annotations><ssc:Annotation type="com.opensimulationplatform">
<osp:Algorithm><osp:FixedStepAlgorithm baseStepSize="0.0078125"/></osp:Algorithm></ssc:Annotation></ssd:Annotations></ssd:DefaultExperiment>
</ssd:SystemStructureDescription>
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("foreign")
    (folder / "spring.py").write_text(SOURCE)
    (folder / "system.ssd").write_text(SYSTEM)
    build = [sys.executable, "-m", "pythonfmu", "build", "-f", "spring.py", "-d", "."]
    done = subprocess.run(build, cwd=folder, capture_output=True, text=True, timeout=120)
    if not (folder / "Spring.fmu").exists():
        pytest.skip(f"pythonfmu makes no FMU here: {done.stderr}")
    return folder


def terramech(folder, *args):
    # Such an FMU expects a Python library in the process and starts an interpreter: this one's, with its packages.
    library = pathlib.Path(sysconfig.get_config_var("LIBDIR") or "/", sysconfig.get_config_var("LDLIBRARY") or "none")
    if not (library.is_file() and sysconfig.get_config_var("Py_ENABLE_SHARED")):
        pytest.skip("this Python has no shared library to embed")
    packages = os.pathsep.join(p for p in sys.path if p)
    env = {**os.environ, "PYTHONPATH": packages, "PYTHONHOME": sys.base_prefix, "LD_PRELOAD": str(library)}
    return subprocess.run([str(TERRAMECH), *args], cwd=folder, env=env, capture_output=True, text=True, timeout=120)


def test_a_python_fmu_gives_the_values_of_fmpy(folder):
    import fmpy

    done = terramech(folder, "check", "system.ssd", "--no-units")
    assert done.returncode == 0, done.stderr
    done = terramech(folder, "run", "system.ssd", "--out", "out", "--quiet", "--set", "spring.mass=1.5")
    assert done.returncode == 0, done.stderr
    # A power of two: FMPy forms its steps by differences of times, which are exact then.
    step = 2.0**-7
    # It refuses the model description otherwise: pythonfmu declares no variability.
    expected = fmpy.simulate_fmu(
        str(folder / "Spring.fmu"), stop_time=1.0, step_size=step, output_interval=step, start_values={"mass": 1.5}, fmi_type="CoSimulation", validate=False
    )
    with open(folder / "out/results.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == len(expected) == 129
    for name, unit in (("position", "1"), ("velocity", "1"), ("steps", "1"), ("moving", "1")):
        ours = [float(r[f"spring.{name} [{unit}]"]) for r in rows]
        assert ours == [float(x) for x in expected[name]], name


def test_a_condition_ends_it_and_what_it_cannot_do_is_told(folder):
    done = terramech(folder, "run", "system.ssd", "--out", "five", "--stop-when", "spring.steps >= 5", "--quiet")
    assert done.returncode == 0 and "spring.steps >= 5" in done.stderr, done.stderr
    assert len((folder / "five/results.csv").read_text().splitlines()) == 7
    model = zipfile.ZipFile(folder / "Spring.fmu").read("modelDescription.xml").decode()
    if 'canGetAndSetFMUstate="true"' not in model:
        done = terramech(folder, "check", "system.ssd", "--no-units", "--algorithm", "iterated")
        assert done.returncode == 1 and "canGetAndSetFMUstate" in done.stderr, done.stderr
