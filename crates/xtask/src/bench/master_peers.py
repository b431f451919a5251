"""Microseconds a step of FMPy and libcosim on the systems that `bench_master` wrote: rings of lags and pairs of blocks.

Usage: master_peers.py FOLDER. Prints `name value` lines; a peer that is not installed or cannot run a system is told on stderr.
"""

import sys
import tempfile
import time
import zipfile
from pathlib import Path

STEP = 0.001


def ssp(folder: Path, name: str) -> Path:
    """The system as an archive with its FMUs inside."""
    path = Path(tempfile.mkdtemp()) / f"{name}.ssp"
    model = "lag" if name.startswith("ring") else "block"
    with zipfile.ZipFile(path, "w") as archive:
        archive.write(folder / f"{name}.ssd", "SystemStructure.ssd")
        archive.write(folder / f"{model}.fmu", f"{model}.fmu")
    return path


def fmpy_seconds(path: Path, steps: int) -> float:
    """Seconds of FMPy's SSP simulation beyond those of one with no steps to speak of."""
    from fmpy.ssp.simulation import simulate_ssp

    def run(n: int) -> float:
        best = float("inf")
        for _ in range(3):
            begin = time.perf_counter()
            simulate_ssp(str(path), start_time=0.0, stop_time=n * STEP, step_size=STEP)
            best = min(best, time.perf_counter() - begin)
        return best

    return (run(steps + 1) - run(1)) / steps


def cosim_seconds(folder: Path, n: int, steps: int, values: int) -> float:
    """Seconds a step of libcosim, units connected one scalar at a time."""
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimSlave import CosimLocalSlave

    model = "lag" if values == 1 else "block"
    execution = CosimExecution.from_step_size(step_size=int(STEP * 1e9))
    units = []
    for i in range(n):
        slave = CosimLocalSlave(fmu_path=str(folder / f"{model}.fmu"), instance_name=f"u{i}")
        units.append(execution.add_local_slave(local_slave=slave))

    def references(index: int) -> dict:
        return {v.name.decode(): v.reference for v in execution.slave_variables(slave_index=index)}

    known = references(units[0])
    for i in range(n):
        next_unit = (i + 1) % n if values == 1 else i ^ 1
        for k in range(1, values + 1):
            out, into = ("out", "in") if values == 1 else (f"out[{k}]", f"in[{k}]")
            execution.connect_real_variables(units[i], known[out], units[next_unit], known[into])
    execution.step(step_count=10)
    best = float("inf")
    for _ in range(5):
        begin = time.perf_counter()
        execution.step(step_count=steps)
        best = min(best, time.perf_counter() - begin)
    return best / steps


def main() -> None:
    folder = Path(sys.argv[1])
    cases = [("ring2", 2, 1), ("ring10", 10, 1), ("ring50", 50, 1), ("ring100", 100, 1), ("pair3000", 2, 3000)]
    for name, n, values in cases:
        steps = max(20, (20000 if values == 1 else 60000) // (n * values))
        for peer, seconds in [
            ("fmpy", lambda: fmpy_seconds(ssp(folder, name), steps)),
            ("libcosim", lambda: cosim_seconds(folder, n, 10 * steps, values)),
        ]:
            try:
                print(f"{name}.{peer} {1e6 * seconds():.6g}", flush=True)
            except Exception as e:  # noqa: BLE001: a peer that fails is a row less
                print(f"{name}: {peer} cannot be measured: {e!r}", file=sys.stderr)


main()
