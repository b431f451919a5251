"""Saved states: the continuation is the same bit for bit, in the same, in a fresh and in another instance."""

import pytest
from unit import Unit


def _run(unit, steps, size):
    trace = []
    for _ in range(steps):
        unit.step(size)
        trace.append(unit.outputs())
    return trace


@pytest.fixture
def size(name, extracted):
    with Unit(extracted[name]) as unit:
        return float(unit.description.defaultExperiment.stepSize)


def test_restoring_continues_bit_for_bit(name, extracted, size):
    with Unit(extracted[name]) as unit:
        unit.initialise()
        _run(unit, 3, size)
        state, time = unit.fmu.getFMUState(), unit.time
        expected = _run(unit, 5, size)
        unit.fmu.setFMUState(state)
        unit.time = time
        assert _run(unit, 5, size) == expected
        unit.fmu.freeFMUState(state)


def test_saving_changes_nothing(name, extracted, size):
    with Unit(extracted[name]) as a, Unit(extracted[name]) as b:
        a.initialise()
        b.initialise()
        for _ in range(4):
            state = a.fmu.getFMUState()
            a.fmu.freeFMUState(state)
            assert _run(a, 1, size) == _run(b, 1, size)


def test_serialised_bytes_continue_in_a_fresh_instance_with_other_threads(name, extracted, size):
    with Unit(extracted[name]) as unit:
        unit.initialise(threads=1)
        _run(unit, 3, size)
        state = unit.fmu.getFMUState()
        data = unit.fmu.serializeFMUState(state)
        unit.fmu.freeFMUState(state)
        time, expected = unit.time, _run(unit, 5, size)
    with Unit(extracted[name]) as fresh:
        fresh.put({"threads": 2})
        state = fresh.fmu.deserializeFMUState(data)
        fresh.fmu.setFMUState(state)
        fresh.fmu.freeFMUState(state)
        fresh.time = time
        assert _run(fresh, 5, size) == expected


def test_damaged_bytes_are_refused(name, extracted, size):
    with Unit(extracted[name]) as unit:
        unit.initialise()
        state = unit.fmu.getFMUState()
        data = bytearray(unit.fmu.serializeFMUState(state))
        unit.fmu.freeFMUState(state)
        data[len(data) // 2] ^= 1
        with pytest.raises(Exception):
            unit.fmu.deserializeFMUState(bytes(data))
        assert any("hash" in m for m in unit.messages), unit.messages
