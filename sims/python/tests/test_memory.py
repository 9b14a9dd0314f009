"""Calls do not leak memory: 10⁵ calls of each function do not enlarge the process."""

import gc
import inspect
import time

import numpy as np
import psutil
import pytest
from conftest import ELSEWHERE, exported_classes, exported_objects

import linkwork as lw

CALLS = 100_000


def resident():
    """Memory of this process, in bytes."""
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


def tool():
    """An object with a joint."""
    mass = dict(mass=0.2, com=[0.05, 0, 0], inertia=1e-3 * np.eye(3))
    return lw.Builder().body("tool", "world", lw.Hinge.free(), **mass).body("jaw", "tool", lw.Hinge.pin([0, 0, 1]), **mass).build()


def robots():
    """Calls of `Robot` and of steps with contact."""
    m = robot()
    shapes = [lw.Collider.sphere(f"on {b}", b, 0.05) for b in "abc"] + [lw.Collider.sphere("on jaw", "jaw", 0.02)]
    r = lw.Robot(m, chains={"arm": ("world", "c")}, objects={"cup": (0.3, [0, 0, 0], 1e-3 * np.eye(3)), "tool": tool()}, colliders=shapes)
    goal = m.state(Q + 0.1).position("c")
    ball = lw.Builder().body("ball", "world", lw.Hinge.free(), mass=2.0, com=[0, 0, 0], inertia=0.008 * np.eye(3)).build()
    contact = lw.Contact(ball, [lw.Collider.sphere("skin", "ball", 0.1), lw.Collider.half_space("ground")])
    rest = np.array([0, 0, 0.1, 0, 0, 0, 1.0])

    def hold():
        with r.grasp("arm", "cup", [0.1, 0, 0]):
            r.update_grasp("arm", "cup", [0.1, 0, 0.01])
            return r.gravity_forces()

    def open_and_close():
        with r.grasp("arm", "tool", np.eye(4)):
            r.set_object_q("tool", [0.3])
            r.feed_forward_with_object("tool", V, V, [0.1], [0.2])
            return r.mass_matrix_with_object("tool")

    def put_q():
        r.q = Q
        return r.tip_pose("arm")

    return {
        "Robot.q": put_q,
        "Robot.jacobian": lambda: r.jacobian("arm"),
        "Robot.manipulability": lambda: r.manipulability("arm", rows="linear"),
        "Robot.inverse_kinematics": lambda: r.inverse_kinematics("arm", goal, q=Q),
        "Robot.inverse_kinematics_together": lambda: r.inverse_kinematics_together({"arm": goal}, q=Q),
        "Robot.inverse_kinematics that is refused": lambda: refused(lambda: r.inverse_kinematics("arm", [np.nan, 0, 0], q=Q)),
        "Robot.grasp": hold,
        "Robot.grasp of an object with joints": open_and_close,
        "Robot.grasp that is refused": lambda: refused(lambda: r.release("arm", "cup")),
        "Robot.feed_forward": lambda: r.feed_forward(V, V, pushes={"arm": [0, 0, 0, 0, 0, 1.0]}),
        "Robot.mass_matrix": r.mass_matrix,
        "Robot.predict": lambda: r.predict(Q, V, V, 1e-3, np.eye(6), density=[0.1] * 3),
        "Robot.predict that is refused": lambda: refused(lambda: r.predict(Q, V, V, -1.0, np.eye(6))),
        "Robot.is_valid": lambda: r.is_valid(Q),
        "Robot.path": lambda: r.path(Q, Q + 0.01),
        "Robot.copy": r.copy,
        "Contact.step": lambda: contact.step(rest, np.zeros(6), 1e-3),
        "Contact.step that is refused": lambda: refused(lambda: contact.step(rest[:3], np.zeros(6), 1e-3)),
    }


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
        **robots(),
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
    # A single number that is kept per call would be 10 MB.
    assert grown < 2**20, f"{grown / CALLS:.1f} bytes a call"


@pytest.mark.parametrize("name", sorted(set(exported_classes()) - ELSEWHERE))
def test_what_an_object_tells_keeps_no_memory(name, tmp_path):
    """Every class that the package exports: its string form, its getters, and each method with invalid arguments."""
    thing = exported_objects(tmp_path)[name]
    of = type(thing)
    getters = [n for n in dir(of) if inspect.isgetsetdescriptor(getattr(of, n, None)) and not n.startswith("_")]
    methods = [n for n in dir(of) if not n.startswith("_") and n not in getters and callable(getattr(of, n))]

    def refused_by(method):
        # No method accepts nine arguments.
        with pytest.raises((TypeError, lw.LinkworkError)):
            getattr(thing, method)(*[object()] * 9)

    calls = {"repr": lambda: repr(thing)}
    calls.update({n: lambda n=n: getattr(thing, n, None) for n in getters})
    calls.update({n: lambda n=n: refused_by(n) for n in methods})
    for what, call in calls.items():
        try:
            call()
        except lw.LinkworkError:
            continue
        end, count = time.monotonic() + 0.2, 0
        for _ in range(1000):
            call()
        gc.collect()
        before = resident()
        while time.monotonic() < end:
            call()
            count += 1
        gc.collect()
        grown = resident() - before
        assert grown < 2**20, f"{name}.{what}: {grown / max(count, 1):.1f} bytes a call, {count} calls"
