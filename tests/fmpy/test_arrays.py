"""The array extension, called as any host would: by symbol name through ctypes."""

import ctypes

import numpy as np
from unit import Unit


def test_the_wheel_publishes_its_mesh_and_follows(extracted):
    with Unit(extracted["tire-rigid"]) as tire:
        tire.enter()
        position = tire.array("mesh.position").reshape(-1, 3)
        triangle = tire.array("mesh.triangle").reshape(-1, 3)
        assert len(position) and triangle.min() == 0 and triangle.max() == len(position) - 1
        radius = tire.get("radius")
        assert np.isclose(np.hypot(position[:, 0], position[:, 2]).max(), radius, rtol=1e-9)
        # Closed and wound outward: the volume by the divergence theorem is that of the cylinder, less the facets.
        a, b, c = (position[triangle[:, k]] for k in range(3))
        volume = np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6
        assert 0.98 < volume / (np.pi * radius**2 * tire.get("width")) <= 1.0
        tire.put({"wheel.position.x": 1.5, "wheel.angular_velocity.y": 2.0, "wheel.velocity.x": 0.25})
        moved = tire.array("mesh.position").reshape(-1, 3)
        assert np.allclose(moved - position, [1.5, 0, 0])
        velocity = tire.array("mesh.velocity").reshape(-1, 3)
        expected = np.array([0.25, 0, 0]) + np.cross([0, 2.0, 0], moved - [1.5, 0, 0])
        assert np.allclose(velocity, expected, atol=1e-14)


def test_forces_on_vertices_become_the_wrench(extracted):
    with Unit(extracted["tire-rigid"]) as tire:
        specification = '{"contact": "vertices"}'
        tire.initialise(specification=specification)
        position = tire.array("mesh.position").reshape(-1, 3)
        index, force = np.array([3, 7], dtype=np.int32), np.array([[1.0, 2, 3], [-4, 5, -6]])
        tire.put_array("contact.index", index)
        tire.put_array("contact.force", force.ravel())
        tire.step(1e-3)
        assert np.allclose(tire.get("wheel.force.x", "wheel.force.y", "wheel.force.z"), force.sum(0))
        moment = np.cross(position[index], force).sum(0)
        assert np.allclose(tire.get("wheel.moment.x", "wheel.moment.y", "wheel.moment.z"), moment)


def test_wrong_sizes_and_references_are_refused(extracted):
    with Unit(extracted["tire-rigid"]) as tire:
        tire.enter()
        vr, _ = tire.arrays["mesh.position"]
        few = (ctypes.c_double * 3)()
        assert tire.try_call("terramech_getRealArray", vr, few, ctypes.c_size_t(3)) == 3
        assert "3" in tire.messages[-1]
        assert tire.try_call("terramech_getRealArray", 4_000_000, few, ctypes.c_size_t(3)) == 3
        assert tire.try_call("terramech_setRealArray", vr, few, ctypes.c_size_t(3)) == 3
        assert "mesh.position" in tire.messages[-1]
        assert tire.try_call("terramech_getRealArray", vr, None, ctypes.c_size_t(3)) == 3


def test_the_bed_shows_its_grains(extracted):
    with Unit(extracted["terrain-dem-p"]) as terrain:
        terrain.enter()
        height = terrain.get("height")
        terrain.fmu.exitInitializationMode()
        position = terrain.array("grain.position").reshape(-1, 3)
        radius, ids = terrain.array("grain.radius"), terrain.array("grain.id")
        assert len(position) == len(radius) == len(ids) == len(set(ids))
        assert (position[:, 2] - radius).min() > -0.1 * radius.max()
        assert position[:, 2].max() - 2 * radius.max() < height < position[:, 2].max() + 2 * radius.max()
        assert terrain.array("grain.velocity").size == terrain.array("grain.force").size == position.size


def _cylinder(radius, width, n=24):
    """A closed cylinder about Y, wound outward."""
    angle = 2 * np.pi * np.arange(n) / n
    ring = np.stack([radius * np.cos(angle), 0 * angle, radius * np.sin(angle)], axis=1)
    left, right = ring + [0, width / 2, 0], ring - [0, width / 2, 0]
    vertices = np.vstack([left, right, [[0, width / 2, 0]], [[0, -width / 2, 0]]])
    triangles = []
    for i in range(n):
        j = (i + 1) % n
        triangles += [[i, j, n + i], [j, n + j, n + i], [2 * n, j, i], [2 * n + 1, n + i, n + j]]
    triangles = np.array(triangles, dtype=np.int32)
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    if np.einsum("ij,ij->i", a, np.cross(b, c)).sum() < 0:
        triangles = triangles[:, ::-1].copy()
    return vertices, triangles


def test_a_deforming_mesh_gets_forces_on_its_vertices_that_balance_the_wrench(extracted):
    """The path of flexible tires: mesh positions and velocities every step, forces on vertices back."""
    with Unit(extracted["terrain-dem-p"]) as terrain:
        terrain.put({"body[1].shape": "mesh"})
        terrain.enter()
        height = terrain.get("height")
        vertices, triangles = _cylinder(0.05, 0.04)
        start = np.array([0.0, 0.0, height + 0.051])
        speed = np.array([0.1, 0.0, -0.2])
        terrain.put_array("body[1].triangle", triangles.ravel())
        step = 1e-3
        touched = 0
        terrain.put_array("body[1].position", (vertices + start).ravel())
        terrain.put_array("body[1].velocity", np.tile(speed, len(vertices)))
        terrain.fmu.exitInitializationMode()
        for k in range(30):
            squeeze = 1 - 0.02 * np.sin(k * 0.3)
            centre = start + speed * k * step
            terrain.put_array("body[1].position", (vertices * [1, 1, squeeze] + centre).ravel())
            terrain.put_array("body[1].velocity", np.tile(speed, len(vertices)))
            terrain.step(step)
            index = terrain.array("body[1].contact.index")
            force = terrain.array("body[1].contact.force").reshape(-1, 3)
            assert len(index) == len(force) and np.all(np.diff(index) > 0)
            assert np.all((0 <= index) & (index < len(vertices))) if len(index) else True
            total = terrain.get("body[1].force.x", "body[1].force.y", "body[1].force.z")
            assert np.allclose(force.sum(0) if len(force) else np.zeros(3), total, rtol=1e-12, atol=1e-12)
            touched += len(index) > 0
        assert touched > 10 and total[2] > 0
