"""The studies of examples/handling run by the command, and what they give is what physics asks for."""

import csv
import json
import math
import subprocess

import pytest
from conftest import FMUS, ROOT, TERRAMECH

FOLDER = ROOT / "examples/handling"


def command(verb, description, *args):
    line = [str(TERRAMECH), verb, str(description), "--fmu-path", str(FMUS), *map(str, args)]
    return subprocess.run(line, capture_output=True, text=True, timeout=300)


def run(name, out, *args):
    done = command("run", FOLDER / f"{name}.ssd", "--out", out, "--quiet", *args)
    assert done.returncode == 0, done.stderr
    with open(out / "results.csv", newline="") as file:
        rows = list(csv.reader(file))
    header = [h.rsplit(" [", 1)[0] for h in rows[0]]
    table = {h: [float(r[i]) for r in rows[1:]] for i, h in enumerate(header)}
    return table, {h["name"]: h["value"] for h in json.loads((out / "summary.json").read_text())}


def at(table, name, time):
    return table[name][min(range(len(table["time"])), key=lambda k: abs(table["time"][k] - time))]


def loads(table, k):
    return [table[f"tire{i}.load"][k] for i in (1, 2, 3, 4)]


def test_full_throttle_and_full_braking(tmp_path):
    table, summary = run("acceleration", tmp_path / "out")
    speed = table["vehicle.speed"]
    weight = sum(loads(table, 30))
    assert 2500 < weight / 9.81 < 2650, "four tires of 37.6 kg on 2,422.7 kg less what the tires weigh themselves"
    assert at(table, "vehicle.gear", 9.9) >= 2 and at(table, "vehicle.gear", 0.4) == 1
    assert 12 < at(table, "vehicle.speed", 9.9) < 30 and all(math.isfinite(v) for v in speed)
    braking = (at(table, "vehicle.speed", 10.4) - at(table, "vehicle.speed", 10.9)) / 0.5
    # Fiala's friction at full slip: 0.5568 to 0.9835, measured on 0.8.
    assert 0.5 * 9.81 < braking < 0.99 * 9.81, braking
    assert abs(speed[-1]) < 0.05, "it stands at the end"
    assert max(abs(y) for y in table["vehicle.chassis.position.y"]) < 0.6
    # Nose up when it accelerates, down when it brakes.
    assert at(table, "vehicle.pitch", 3) < 0 < at(table, "vehicle.pitch", 10.9)


def test_a_turn_of_twelve_metres(tmp_path):
    table, summary = run("constant-radius", tmp_path / "out")
    speed, yaw, lateral = summary["speed"], summary["yaw rate"], summary["lateral acceleration"]
    assert speed == pytest.approx(7.5, rel=0.02)
    assert speed / yaw == pytest.approx(12, rel=0.03)
    assert lateral == pytest.approx(speed * yaw, rel=0.03) and lateral == pytest.approx(4.69, rel=0.05)
    # To the left: the right tires carry more, the body rolls to the right.
    assert summary["load of the front right tire"] > 1.3 * summary["load of the front left tire"]
    assert summary["roll angle"] > 0.01 and 0 < summary["steering input"] < 1
    x, y = table["vehicle.chassis.position.x"], table["vehicle.chassis.position.y"]
    radius = [math.hypot(a - 8, b - 12) for a, b, t in zip(x, y, table["time"]) if t > 8]
    assert 11.5 < min(radius) and max(radius) < 12.5, (min(radius), max(radius))


def test_a_double_lane_change(tmp_path):
    table, summary = run("lane-change", tmp_path / "out")
    x, y = table["vehicle.chassis.position.x"], table["vehicle.chassis.position.y"]
    width = 2.16
    # Lanes of ISO 3888-1, each as wide as the vehicle's width asks; the wheels of the middle line keep within the cones.
    lanes = [(0, 30, 0.0, 1.1), (60, 85, 3.5, 1.2), (110, 140, 0.0, 1.3)]
    for start, end, middle, factor in lanes:
        most = 0.5 * (factor * width + 0.25 - width)
        off = [abs(b - middle) for a, b in zip(x, y) if start < a < end]
        assert off and max(off) < most, f"lane {start} to {end} m: {max(off)} m off, {most} m within the cones"
    assert min(table["vehicle.speed"]) > 12
    assert all(min(loads(table, k)) > 0 for k in range(50, len(x))), "no wheel leaves the ground"


def test_a_half_round(tmp_path):
    table, summary = run("half-round", tmp_path / "out")
    z, x, time = table["vehicle.chassis.position.z"], table["vehicle.chassis.position.x"], table["time"]
    rest = at(table, "vehicle.chassis.position.z", 1.0)
    assert max(z) - rest > 0.03 and abs(z[-1] - rest) < 0.02, (max(z) - rest, z[-1] - rest)
    front = max(range(len(time)), key=lambda k: table["tire1.load"][k] + table["tire2.load"][k])
    rear = max(range(len(time)), key=lambda k: table["tire3.load"][k] + table["tire4.load"][k])
    # The front wheels meet the bar at x = 10 m with the chassis 1.7 m behind it, the rear ones 3.4 m later.
    assert 7.0 < x[front] < 9.5 and 2.5 < x[rear] - x[front] < 4.5, (x[front], x[rear])
    assert max(table["tire1.load"]) > 1.3 * at(table, "tire1.load", 1.0)
    left, right = table["tire1.load"], table["tire2.load"]
    assert max(abs(a - b) for a, b in zip(left, right)) < 0.2 * max(left), "both sides alike"


def test_the_descriptions_are_sound():
    for file in sorted(FOLDER.glob("*.ssd")):
        done = command("check", file)
        assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(
    "specification, parts",
    [
        ('{"vehicle": {"name": "x"}}', ["chassis"]),
        ('{"payload": [{"mass": -5, "position": [0, 0, 0]}], "step": 0}', ["payload[0].mass", "-5", "'step' is 0"]),
        ('{"driver": {"kind": {"path": {"path": {"points": {"points": [[0, 0]]}}, "speed": 5}}}}', ["driver.kind.path.path.points.points", "at least two points"]),
        ('{"driver": {"kind": {"table": {"points": [{"time": 1}, {"time": 1}]}}}}', ["points[1].time", "rise"]),
        ('{"vehicle": "no_such.json"}', ["no_such.json", "hmmwv/vehicle.json"]),
    ],
)
def test_wrong_specifications_are_told_by_the_command(tmp_path, specification, parts):
    file = tmp_path / "vehicle.json"
    file.write_text(specification)
    told(tmp_path, file, parts)


def told(tmp_path, file, parts):
    done = command("run", FOLDER / "acceleration.ssd", "--out", tmp_path / "out", "--set", f"vehicle.specification={file}")
    assert done.returncode == 1, (done.returncode, done.stderr)
    for part in [*parts, "vehicle.json"]:
        assert part in done.stderr, f"{part} missing in: {done.stderr}"


def vehicle():
    """The HMMWV with its parts in place, to be spoiled."""
    data = ROOT / "fmu-vehicle/data/hmmwv"
    read = lambda name: json.loads((data / name).read_text())
    spec = read("vehicle.json")
    for axle in spec["axles"]:
        axle["suspension"] = read(axle["suspension"])
    spec["steering"] = [read(s) for s in spec["steering"]]
    spec["driveline"], spec["powertrain"] = read(spec["driveline"]), read(spec["powertrain"])
    return spec


def missing_hardpoint(v):
    del v["axles"][0]["suspension"]["double_wishbone"]["points"]["lower_outer"]
    return ["lower_outer", "axles[0].suspension"]


def zero_mass(v):
    v["axles"][1]["suspension"]["double_wishbone"]["upright"]["mass"] = 0
    return ["axles[1].suspension.double_wishbone.upright.mass", "is 0"]


def map_not_monotone(v):
    v["powertrain"]["shafts"]["engine"]["full_throttle"][3][0] = 850
    return ["powertrain.shafts.engine.full_throttle", "850"]


def spring_not_monotone(v):
    v["axles"][0]["suspension"]["double_wishbone"]["spring"]["curve"]["points"][2][0] = -0.5
    return ["axles[0].suspension.double_wishbone.spring.curve.points", "-0.5"]


def three_points_on_a_line(v):
    p = v["axles"][0]["suspension"]["double_wishbone"]["points"]
    p["upper_outer"] = [0.5 * (a + b) for a, b in zip(p["upper_front"], p["upper_back"])]
    return ["axles[0].suspension.double_wishbone.points.upper", "span a plane"]


def redundant_constraints(v):
    # A tie rod along the lower arm says once more how far the ball joint is from the hinge, and leaves the wheel free to steer.
    p = v["axles"][1]["suspension"]["double_wishbone"]["points"]
    p["tie_rod_chassis"], p["tie_rod_upright"] = p["lower_front"], p["lower_outer"]
    return ["vehicle.axles[1].suspension", "redundant", "tie rod", "lower arm hinge"]


def joints_that_cannot_close(v):
    # The suspension cannot reach down so far.
    v["axles"][1]["wheel"]["tire_radius"] = 0.467
    v["axles"][0]["suspension"]["double_wishbone"]["points"]["spindle"][2] = -3.0
    return ["does not close", "vehicle.axles"]


@pytest.mark.parametrize("spoil", [missing_hardpoint, zero_mass, map_not_monotone, spring_not_monotone, three_points_on_a_line, redundant_constraints, joints_that_cannot_close])
def test_spoiled_vehicles_are_told_by_the_command(tmp_path, spoil):
    spec = vehicle()
    parts = spoil(spec)
    file = tmp_path / "vehicle.json"
    file.write_text(json.dumps({"vehicle": spec}))
    told(tmp_path, file, parts)
