"""Calls keep no memory: 10⁵ of each leave the process as large as it was."""

import gc

import numpy as np
import psutil
import pytest

import linkwork as lw

CALLS = 100_000


def resident():
    """Bytes of this process in memory."""
    return psutil.Process().memory_info().rss


def robot():
    builder, parent = lw.Builder(), "world"
    for name, axis in (("a", [0, 0, 1]), ("b", [0, 1, 0]), ("c", [1, 0, 0])):
        builder = builder.body(
            name, parent, lw.Hinge.pin(axis), hinge_in_parent=[0.1, 0, 0.2], mass=1.0, com=[0.1, 0, 0], inertia=0.01 * np.eye(3)
        )
        parent = name
    return builder.node("tip", "c", [0.2, 0, 0]).build()


Q = np.array([0.3, -0.4, 0.5])
V = np.array([0.1, 0.2, -0.3])


def refused(call):
    with pytest.raises(lw.LinkworkError):
        call()


def calls():
    m = robot()
    shapes = [lw.Collider.sphere(f"on {b}", b, 0.05) for b in "abc"]
    shapes.append(lw.Collider.point_cloud("seen", "world", room=20))
    c = lw.Collisions(m, shapes)
    points = np.random.default_rng(1).uniform(-1, 1, (20, 4)) ** 2
    state = m.state(Q, V)
    return {
        "inverse_dynamics": lambda: m.inverse_dynamics(Q, V, V),
        "forward_dynamics": lambda: m.forward_dynamics(Q, V, V),
        "mass_matrix": lambda: m.mass_matrix(Q),
        "node_jacobian": lambda: m.node_jacobian(Q, "tip"),
        "integrate": lambda: m.integrate(Q, V),
        "state": lambda: m.state(Q, V),
        "pose": lambda: state.pose("tip"),
        "a length that is wrong": lambda: refused(lambda: m.mass_matrix(Q[:2])),
        "a name that is wrong": lambda: refused(lambda: m.node_jacobian(Q, "tib")),
        "collides": lambda: c.collides(Q),
        "clearance": lambda: c.clearance(Q),
        "set_points": lambda: c.set_points("seen", points),
    }


@pytest.mark.parametrize("name", list(calls()))
def test_calls_keep_no_memory(name):
    call = calls()[name]
    for _ in range(CALLS // 10):
        call()
    gc.collect()
    before = resident()
    for _ in range(CALLS):
        call()
    gc.collect()
    grown = resident() - before
    # An array of one number more for each call would be 10 MB.
    assert grown < 2**20, f"{grown / CALLS:.1f} bytes a call"
