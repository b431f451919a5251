"""A unit under test: FMPy's FMU2Slave plus our array extension by ctypes, with variables by name."""

import ctypes
import itertools

import numpy as np
from fmpy import read_model_description
from fmpy.fmi2 import FMU2Slave, fmi2CallbackFunctions, fmi2CallbackLoggerTYPE
from lxml import etree

_count = itertools.count(1)

Real = ctypes.c_double
Integer = ctypes.c_int


class Unit:
    """One instance. Use as a context manager: it is freed at the end."""

    def __init__(self, folder, name=None):
        self.folder = str(folder)
        self.description = read_model_description(self.folder)
        self.variables = {v.name: v for v in self.description.modelVariables}
        self.arrays = _arrays(self.folder)
        self.messages = []
        model = self.description.coSimulation.modelIdentifier
        self.fmu = FMU2Slave(
            guid=self.description.guid,
            unzipDirectory=self.folder,
            modelIdentifier=model,
            instanceName=name or f"{model}_{next(_count)}",
        )
        self._logger = fmi2CallbackLoggerTYPE(self._log)
        self._callbacks = fmi2CallbackFunctions()
        self._callbacks.logger = self._logger
        self.fmu.instantiate(callbacks=self._callbacks)
        self.component = self.fmu.component
        self.library = self.fmu.dll
        self.time = 0.0

    def _log(self, environment, instance, status, category, message, *args):
        self.messages.append(message.decode() if message else "")

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.fmu.freeInstance()

    # scalars

    def get(self, *names):
        values = self.fmu.getReal([self.variables[n].valueReference for n in names])
        return values[0] if len(names) == 1 else np.array(values)

    def set(self, **_):
        raise TypeError("use put({'name': value})")

    def put(self, values):
        """Sets scalars by name; the type follows the variable."""
        for name, value in values.items():
            v = self.variables[name]
            {
                "Real": self.fmu.setReal,
                "Integer": self.fmu.setInteger,
                "Boolean": self.fmu.setBoolean,
                "String": self.fmu.setString,
            }[v.type]([v.valueReference], [value])

    # arrays

    def array(self, name):
        vr, kind = self.arrays[name]
        n = ctypes.c_size_t()
        self._call("terramech_getArraySize", vr, ctypes.byref(n))
        values = ((Real if kind == "Real" else Integer) * n.value)()
        self._call(f"terramech_get{kind}Array", vr, values, n)
        return np.array(values[:], dtype=float if kind == "Real" else np.int32)

    def put_array(self, name, values):
        vr, kind = self.arrays[name]
        c = Real if kind == "Real" else Integer
        data = (c * len(values))(*(c(v).value for v in values))
        self._call(f"terramech_set{kind}Array", vr, data, ctypes.c_size_t(len(values)))

    def _call(self, symbol, vr, *args):
        status = self.try_call(symbol, vr, *args)
        assert status == 0, f"{symbol}({vr}) gave status {status}: {self.messages[-1:]}"

    def try_call(self, symbol, vr, *args):
        function = getattr(self.library, symbol)
        function.restype = ctypes.c_int
        return function(ctypes.c_void_p(self.component), ctypes.c_uint(vr), *args)

    # life cycle

    def enter(self, start=0.0, **parameters):
        self.put(parameters)
        self.time = start
        self.fmu.setupExperiment(startTime=start)
        self.fmu.enterInitializationMode()

    def initialise(self, **parameters):
        self.enter(**parameters)
        self.fmu.exitInitializationMode()

    def step(self, size):
        self.fmu.doStep(currentCommunicationPoint=self.time, communicationStepSize=size)
        self.time += size

    def outputs(self):
        """All real outputs and all readable arrays, as bytes: for comparing bit for bit."""
        names = [n for n, v in self.variables.items() if v.causality == "output" and v.type == "Real"]
        parts = [self.get(*names).tobytes()] if names else []
        parts += [self.array(n).tobytes() for n in sorted(self.arrays)]
        return b"".join(parts)


def _arrays(folder):
    tree = etree.parse(f"{folder}/modelDescription.xml")
    return {
        a.get("name"): (int(a.get("valueReference")), a.get("type"))
        for a in tree.iterfind("VendorAnnotations/Tool[@name='org.terramech']//Array")
    }
