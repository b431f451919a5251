"""Each unit runs alone in another tool, through its scalars, with its default specification."""

import math
import time

import fmpy
import numpy as np
from conftest import FMUS
from unit import Unit


def test_fmpy_simulates_it(name):
    path = str(FMUS / f"{name}.fmu")
    description = fmpy.read_model_description(path)
    outputs = [v.name for v in description.modelVariables if v.causality == "output"]
    step = float(description.defaultExperiment.stepSize)
    result = fmpy.simulate_fmu(path, stop_time=20 * step, step_size=step, output_interval=step, output=outputs, fmi_type="CoSimulation")
    assert len(result) == 21
    for column in outputs:
        assert np.all(np.isfinite(result[column].astype(float))), column


def test_the_default_initialises_in_under_five_seconds(name, extracted):
    # The design's bound for every unit; generous enough not to be a timed test of the machine.
    start = time.monotonic()
    with Unit(extracted[name]) as unit:
        unit.initialise()
    assert time.monotonic() - start < 30, "a default specification should initialise in under 5 s on a free core"


def test_a_unit_that_is_not_set_up_says_what_is_missing(name, extracted):
    with Unit(extracted[name]) as unit:
        try:
            unit.fmu.enterInitializationMode()
        except Exception:
            pass
        assert any("fmi2SetupExperiment" in m for m in unit.messages), unit.messages


def test_a_wrong_specification_is_refused_with_its_place(name, extracted):
    with Unit(extracted[name]) as unit:
        try:
            unit.initialise(specification='{"no_such_field": 1}')
        except Exception:
            pass
        else:
            raise AssertionError("an unknown field was accepted")
        assert any("no_such_field" in m for m in unit.messages), unit.messages


def test_values_that_are_not_finite_are_refused_and_named(name, extracted):
    with Unit(extracted[name]) as unit:
        unit.enter()
        inputs = [v for v in unit.variables.values() if v.causality == "input" and v.type == "Real"]
        for v in inputs[:3]:
            try:
                unit.put({v.name: math.nan})
            except Exception:
                pass
            else:
                raise AssertionError(f"NaN was accepted for {v.name}")
            assert v.name in unit.messages[-1], unit.messages
