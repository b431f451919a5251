"""Units on the ranks of an MPI job: the same bits as in one process, and clear ends whatever fails. Left out where there is no MPI (`cargo xtask test` says what is missing)."""

import os
import pathlib
import re
import shutil
import signal
import struct
import subprocess
import time
import zlib

import pytest
from test_handling import command

from conftest import FMUS, ROOT, TERRAMECH

BINARY = os.environ.get("TERRAMECH_MPI_BIN")
SINGLE = ROOT / "examples/single-wheel/system.ssd"
STUDY = ROOT / "examples/straight-line/system.ssd"

pytestmark = pytest.mark.skipif(not BINARY, reason="no terramech with MPI: TERRAMECH_MPI_BIN is not set")


def job(ranks, *args, binary=BINARY):
    """The command line of a run on ranks, and its environment."""
    words = ["mpirun", "--oversubscribe", "-n", str(ranks), binary, *map(str, args)]
    root = {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}
    return words, {**os.environ, **root}


def mpirun(ranks, *args, binary=BINARY):
    words, environment = job(ranks, *args, binary=binary)
    return subprocess.run(words, env=environment, capture_output=True, text=True, timeout=300)


def same(one, other):
    """All recorded values and frames, byte for byte."""
    names = sorted(p.relative_to(one) for p in [one / "results.csv", one / "summary.json", *(one / "vtk").glob("*")])
    assert len(names) > 2
    for name in names:
        assert (one / name).read_bytes() == (other / name).read_bytes(), f"{name} differs"


@pytest.fixture(scope="module")
def beds(tmp_path_factory):
    """Settled beds of both systems, so that not every run settles its own."""
    folder = tmp_path_factory.mktemp("beds")
    for name, system, stop in [("wheel", SINGLE, "0.0002"), ("study", STUDY, "0.0002")]:
        bed = folder / name
        done = command("run", system, "--out", folder / f"run-{name}", "--quiet", "--stop-time", stop, "--set", f"terrain.bed_save={bed}")
        assert done.returncode == 0, done.stderr
    return folder


@pytest.mark.parametrize(("which", "system", "stop"), [("wheel", SINGLE, "0.02"), ("study", STUDY, "0.004")])
def test_any_number_of_ranks_gives_the_same_bits(tmp_path, beds, which, system, stop):
    args = ["run", system, "--fmu-path", FMUS, "--quiet", "--stop-time", stop, "--set", f"terrain.bed_load={beds / which}"]
    done = command(*[a for a in args if a not in ("--fmu-path", FMUS)], "--out", tmp_path / "alone")
    assert done.returncode == 0, done.stderr
    for ranks in [1, 2, 3, 6]:
        done = mpirun(ranks, *args, "--out", tmp_path / f"on{ranks}")
        assert done.returncode == 0, done.stderr
        same(tmp_path / "alone", tmp_path / f"on{ranks}")
    # Placed by hand, the terrain away from rank 0; and the terrain over several ranks.
    for ranks, places in [(3, ["t*=2"]), (2, ["terrain=0..1"]), (4, ["terrain=1..3"])]:
        out = tmp_path / f"placed{ranks}"
        orders = [word for place in places for word in ("--place", place)]
        done = mpirun(ranks, *args, "--out", out, *orders, "--place-by", tmp_path / "alone/manifest.json")
        assert done.returncode == 0, done.stderr
        same(tmp_path / "alone", out)


def children(pid):
    """Processes that a process has started."""
    found = []
    for stat in pathlib.Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = stat.read_text().rsplit(")", 1)[1].split()
        except OSError:
            continue
        if int(fields[1]) == pid:
            found.append(int(stat.parent.name))
    return sorted(found)


def test_a_rank_that_dies_leaves_its_last_checkpoint(tmp_path, beds):
    args = ["run", SINGLE, "--fmu-path", FMUS, "--quiet", "--stop-time", "0.1", "--set", f"terrain.bed_load={beds / 'wheel'}"]
    done = mpirun(1, *args, "--out", tmp_path / "whole")
    assert done.returncode == 0, done.stderr
    out = tmp_path / "pieces"
    words, environment = job(4, *args, "--out", out, "--checkpoint-every", "0.002", "--place", "terrain=2..3")
    process = subprocess.Popen(words, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    deadline = time.time() + 120
    while len(list(out.glob("checkpoint/*.tmc"))) < 2:
        assert process.poll() is None and time.time() < deadline
        time.sleep(0.02)
    # Any but rank 0, which has the lowest number.
    os.kill(children(process.pid)[-1], signal.SIGKILL)
    _, told = process.communicate(timeout=60)
    assert process.returncode != 0, told
    assert not (out / "summary.json").exists()
    # On another number of ranks, and the terrain on another number.
    done = mpirun(3, "run", "--resume", out, "--quiet", "--place", "terrain=0..2", "--place", "t*e=0", "--place", "rig=0")
    assert done.returncode == 0, done.stderr
    same(tmp_path / "whole", out)


def grains(path):
    """Arrays of a .vtp file (or of the pieces of a .pvtp), by the numbers of the grains: bytes of each grain."""
    if path.suffix == ".pvtp":
        pieces = re.findall(r'<Piece Source="([^"]+)"', path.read_text())
        return {k: v for piece in pieces for k, v in grains(path.parent / piece).items()}
    data = path.read_bytes()
    start = data.index(b"_", data.index(b"<AppendedData")) + 1
    arrays = {}
    for name, components, offset in re.findall(
        r'<DataArray type="\w+32" Name="(\w+)" NumberOfComponents="(\d)" format="appended" offset="(\d+)"', data[:start].decode()
    ):
        at = start + int(offset)
        (count,) = struct.unpack_from("<Q", data, at)
        sizes = struct.unpack_from(f"<{count}Q", data, at + 24)
        at, raw = at + 24 + 8 * count, b""
        for size in sizes:
            raw += zlib.decompress(data[at : at + size])
            at += size
        width = 4 * int(components)
        arrays[name] = [raw[k : k + width] for k in range(0, len(raw), width)]
    fields = sorted(set(arrays) - {"id", "connectivity", "offsets"})
    assert "Points" in fields
    return {number: [arrays[f][k] for f in fields] for k, number in enumerate(arrays["id"])}


def test_members_write_their_pieces_and_any_number_of_ranks_goes_on(tmp_path, beds):
    args = ["run", SINGLE, "--fmu-path", FMUS, "--quiet", "--stop-time", "0.03", "--set", f"terrain.bed_load={beds / 'wheel'}"]
    done = mpirun(1, *args, "--out", tmp_path / "whole")
    assert done.returncode == 0, done.stderr
    out = tmp_path / "pieces"
    done = mpirun(4, *args, "--out", out, "--checkpoint-every", "0.01", "--place", "terrain=1..3", "--pieces")
    assert done.returncode == 0, done.stderr
    assert (out / "results.csv").read_bytes() == (tmp_path / "whole/results.csv").read_bytes()
    lists = sorted((out / "vtk").glob("*.pvtp"))
    frames = sorted(p for p in (tmp_path / "whole/vtk").glob("*.vtp") if (out / "vtk" / p.with_suffix(".pvtp").name).exists())
    assert len(lists) == len(frames) > 0
    for frame, listed in zip(frames, lists):
        assert grains(frame) == grains(listed), frame
        assert not (out / "vtk" / frame.name).exists()
    assert lists[0].name in (out / "vtk" / (lists[0].name.rsplit("_", 1)[0] + ".pvd")).read_text()
    # The report's pictures show the soil of the last frame.
    pictures = [re.findall(r"<svg.*?</svg>", (run / "report.html").read_text(), re.S) for run in (out, tmp_path / "whole")]
    assert pictures[0] == pictures[1] and sum(p.count("<circle") for p in pictures[0]) > 100
    # Two checkpoints are kept, each with three pieces, far larger than what names them.
    states = sorted((out / "checkpoint").iterdir())
    assert [p.suffix for p in states] == [".1", ".2", ".3", ".tmc"] * 2 or len(states) == 8, states
    last = [p for p in states if p.name.startswith(states[-1].name.split(".")[0])]
    assert sum(p.stat().st_size for p in last if p.suffix != ".tmc") > 5 * last[-1].stat().st_size
    # One that lost a piece gives way to the one before; on other ranks, and then in one process.
    last[0].unlink()
    done = mpirun(3, "run", "--resume", out, "--quiet", "--stop-time", "0.03", "--place", "terrain=0..1", "--place", "t*e=0", "--place", "rig=0")
    assert done.returncode == 0 and "the checkpoint before it is used" in done.stderr, done.stderr
    assert (out / "results.csv").read_bytes() == (tmp_path / "whole/results.csv").read_bytes()
    for frame, listed in zip(frames, lists):
        assert grains(frame) == grains(listed), frame
    done = subprocess.run([TERRAMECH, "run", "--resume", out, "--quiet", "--stop-time", "0.03"], capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    assert (out / "results.csv").read_bytes() == (tmp_path / "whole/results.csv").read_bytes()


def test_wrong_places_and_programs_are_told_before_anything_runs(tmp_path, beds):
    args = ["run", SINGLE, "--fmu-path", FMUS, "--quiet", "--stop-time", "0.01", "--out", tmp_path / "out"]
    done = mpirun(2, *args, "--place", "terrain=0..1", "--place", "tire=1")
    assert done.returncode == 1 and "unit terrain is not spread over" in done.stderr, done.stderr
    done = mpirun(2, *args, "--place", "tire=7", "--place", "rg=0", "--place", "rig=0..1")
    assert done.returncode == 1
    for part in ['rank="7"', "0 to 1", 'no component "rg"', "announces no Team", "3 faults"]:
        assert done.stderr.count(part) == 1, (part, done.stderr)
    # A program without MPI would do the whole run on each rank.
    done = mpirun(2, *args, binary=str(TERRAMECH))
    assert done.returncode == 4 and "built without MPI" in done.stderr, done.stderr
    # One that sees another world than was started.
    environment = {**os.environ, "OMPI_COMM_WORLD_SIZE": "5", "OMPI_COMM_WORLD_RANK": "0"}
    done = subprocess.run([BINARY, *map(str, args)], env=environment, capture_output=True, text=True, timeout=60)
    assert done.returncode == 4 and "sees 1" in done.stderr, done.stderr
    # Other files on another rank.
    for path in SINGLE.parent.glob("*"):
        shutil.copy(path, tmp_path)
    other = tmp_path / "system.ssd"
    other.write_text(other.read_text().replace("tire-rigid.json", "tire-rigid-grousers.json"))
    assert other.read_text() != SINGLE.read_text()
    words, environment = job(1, *args)
    words += [":", "-n", "1", BINARY, "run", str(other), *map(str, args[2:])]
    done = subprocess.run(words, env=environment, capture_output=True, text=True, timeout=60)
    assert done.returncode == 1 and "rank 1 reads other files" in done.stderr, done.stderr
    # Units that wait for each other.
    done = mpirun(2, *args, "--algorithm", "gauss-seidel")
    assert done.returncode == 1 and "on several ranks allowed: jacobi" in done.stderr, done.stderr
    assert not (tmp_path / "out").exists()


def test_a_unit_that_fails_on_a_rank_ends_the_job(tmp_path, beds):
    args = ["run", SINGLE, "--fmu-path", FMUS, "--quiet", "--out", tmp_path / "out", "--place", "terrain=1"]
    done = mpirun(2, *args, "--set", f"terrain.bed_load={tmp_path / 'nothing'}")
    assert done.returncode != 0
    assert done.stderr.count("rank 1: ") == 1 and "nothing" in done.stderr, done.stderr


def test_ctrl_c_writes_a_checkpoint(tmp_path, beds):
    out = tmp_path / "out"
    words, environment = job(3, "run", SINGLE, "--fmu-path", FMUS, "--quiet", "--out", out, "--set", f"terrain.bed_load={beds / 'wheel'}")
    process = subprocess.Popen(words, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    deadline = time.time() + 60
    while not (out / "results.csv").exists():
        assert process.poll() is None and time.time() < deadline
        time.sleep(0.05)
    process.send_signal(signal.SIGINT)
    _, told = process.communicate(timeout=60)
    assert list((out / "checkpoint").glob("*.tmc")), told
