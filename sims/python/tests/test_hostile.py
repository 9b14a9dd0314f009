"""Hostile input: no call ends the interpreter, hangs, or accepts values that are not numbers."""

import multiprocessing
import os
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import pytest
from conftest import SOURCE

import linkwork as lw

PENDULUM = SOURCE / "sims" / "pendulum"


def arm(n=3):
    builder, parent = lw.Builder(), "world"
    for k in range(n):
        hinge = lw.Hinge.pin(np.eye(3)[k % 3]).limits(-3, 3)
        builder = builder.body(f"b{k}", parent, hinge, mass=1, com=[0.1, 0, 0], inertia=np.eye(3) / 50, hinge_in_parent=[0.3, 0, 0])
        parent = f"b{k}"
    return builder.node("tip", parent, [0.3, 0, 0]).build()


def python(code, timeout=120, **more):
    """Run a program and return its output."""
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=timeout, **more)
    assert run.returncode == 0, f"{run.returncode}\n{run.stdout}\n{run.stderr}"
    return run.stdout


@pytest.mark.parametrize(
    ("q", "words"),
    [
        (np.ma.masked_array([0.1, 0.2, 0.3], [False, True, False]), "masked"),
        (np.ma.masked_array(np.zeros((4, 3)), np.eye(4, 3) > 0), "masked"),
        (["0.1", "0.2", "0.3"], "strings"),
        ([0.1, "0.2", 0.3], "strings"),
        (np.array(["0.1", "0.2", "0.3"]), "strings"),
        (np.array([b"0.1", b"0.2", b"0.3"]), "strings"),
        (np.array([0.1, "0.2", 0.3], dtype=object), "strings"),
        (["inf", "0", "0"], "strings"),
        (["1e400", "0", "0"], "strings"),
        (np.array([1, 2, 3], dtype="m8[s]"), "timedelta"),
        (np.array(["2026-01-01"] * 3, dtype="M8[D]"), "datetime"),
        ([10**400, 0, 0], "number"),
        (np.array([0.1 + 1j, 0, 0]), "complex"),
        ([[0.1], [0.2, 0.3]], "number"),
        ([np.inf, 0, 0], "inf"),
    ],
)
def test_what_are_no_numbers_is_refused(q, words):
    m = arm()
    for call in (m.mass_matrix, m.state, lambda q: m.forward_dynamics(q, np.zeros(3), np.zeros(3))):
        with pytest.raises(lw.LinkworkError, match=words):
            call(q)


def test_what_are_numbers_is_taken():
    m = arm()
    want = m.mass_matrix([1.0, 0.0, 1.0])
    for q in (np.ma.masked_array([1.0, 0.0, 1.0]), [True, False, True], np.array([1, 0, 1], dtype="i1"), np.array([1, 0, 1], dtype="f2"),
              np.array([1, 0, 1], dtype=object), np.array([1.0, 9, 0, 9, 1.0])[::2], np.array([1.0, 0.0, 1.0]).astype(">f8")):
        assert np.array_equal(m.mass_matrix(q), want)


class Raises:
    """An array that raises when it is accessed."""

    def __init__(self, what):
        self.what = what

    def __array__(self, *_, **__):
        raise self.what


@pytest.mark.parametrize("what", [KeyboardInterrupt, MemoryError, SystemExit])
def test_exceptions_that_end_programs_stay_themselves(what):
    m = arm()
    with pytest.raises(what):
        m.mass_matrix(Raises(what("now")))
    with pytest.raises(lw.LinkworkError, match="now"):
        m.mass_matrix(Raises(RuntimeError("now")))


class Changes:
    """An array that changes a dict when it is accessed."""

    def __init__(self, of, values):
        self.of, self.values = of, np.asarray(values, float)

    def __array__(self, *_, **__):
        for k in range(50):
            self.of[f"more {k}"] = np.zeros(6)
        return self.values

    def __float__(self):
        self.__array__()
        return 1.0


def test_a_dict_that_changes_while_it_is_read():
    m, zero = arm(), np.zeros(3)
    wrenches = {}
    wrenches |= {"b0": Changes(wrenches, np.ones(6)), "tip": np.ones(6)}
    want = m.forward_dynamics(zero, zero, zero, wrenches={"b0": np.ones(6), "tip": np.ones(6)})
    assert np.array_equal(m.forward_dynamics(zero, zero, zero, wrenches=wrenches), want)
    targets = {}
    targets |= {"tip": Changes(targets, m.state(zero + 0.2).position("tip"))}
    assert m.inverse_kinematics(zero + 0.1, targets).shape == (3,)
    rates = {}
    rates |= {"tip": Changes(rates, [0, 0, 0, 0.1, 0, 0])}
    assert m.inverse_kinematics_rates(zero + 0.1, rates).shape == (3,)
    terms = {}
    terms |= {"a": Changes(terms, 1.0)}
    coupled = lw.Builder().body("a", "world", lw.Hinge.pin([0, 0, 1]), mass=1, inertia=np.eye(3)).coupling("c", terms)
    assert len(coupled.build().constraints) == 1
    objects = {}
    objects |= {"cup": (1.0, Changes(objects, [0, 0, 0]), np.eye(3))}
    robot = lw.Robot(m, chains={"arm": ("world", "b2")}, objects=objects, colliders=[])
    assert robot.objects == ["cup"]
    pushes = {}
    pushes |= {"arm": Changes(pushes, np.ones(6))}
    assert np.array_equal(robot.feed_forward(zero, zero, pushes), robot.feed_forward(zero, zero, {"arm": np.ones(6)}))


def test_overrides_without_end_are_refused():
    loop = []
    loop.append(loop)
    deep = 0.0
    for _ in range(100_000):
        deep = [deep]
    doubled = [0.0]
    for _ in range(40):
        doubled = [doubled, doubled]
    wide = [0.0]
    for _ in range(28):
        wide = [*wide, *wide] if len(wide) < 2**21 else wide
    for value in (loop, deep, doubled, wide):
        with pytest.raises(lw.LinkworkError, match=r"bob\.com.*more than"):
            lw.Simulation(PENDULUM, overrides={"bob.com": value})
    for value in ("inf", "nan", "1e400", float("inf"), np.float64("nan")):
        with pytest.raises(lw.LinkworkError):
            lw.Simulation(PENDULUM, overrides={"bob.mass": value})


def test_no_memory_is_a_memory_error():
    limit = "import resource\nresource.setrlimit(resource.RLIMIT_AS, (2 << 30, 2 << 30))\n"
    code = """
import numpy as np, linkwork as lw
b, parent = lw.Builder(), "world"
for k in range(7):
    b = b.body(f"b{k}", parent, lw.Hinge.pin(np.eye(3)[k % 3]), mass=1, com=[.1, 0, 0], inertia=np.eye(3) / 50, hinge_in_parent=[.3, 0, 0])
    parent = f"b{k}"
m = b.node("tip", parent, [.1, 0, 0]).build()
many = np.zeros((5_000_000, 7))
""" + limit + """
zero = np.zeros(7)
calls = {
    "mass_matrix": lambda: m.mass_matrix(many),
    "inverse_mass_matrix": lambda: m.inverse_mass_matrix(many),
    "node_jacobian": lambda: m.node_jacobian(many, "tip"),
    "forward_dynamics_derivatives": lambda: m.forward_dynamics_derivatives(many, zero, zero),
    "regressor": lambda: m.regressor(many, many, many),
    "centroidal_matrix": lambda: m.centroidal_matrix(many),
    "forward_dynamics": lambda: m.forward_dynamics(many, many, many, threads=2),
    "inverse_dynamics": lambda: m.inverse_dynamics(many, many, many),
    "list": lambda: m.inverse_dynamics([zero] * 40_000_000, zero, zero),
    "simulate": lambda: m.simulate(zero, zero, 1e-3, 10**9),
}
for name, call in calls.items():
    try:
        call()
        print(name, "did it")
    except MemoryError:
        print(name, "MemoryError")
assert m.mass_matrix(zero).shape == (7, 7)
"""
    said = python(code, timeout=400)
    assert said.count("MemoryError") >= 5, said


def test_an_array_that_changes_size_during_a_call():
    m = arm()
    many = np.random.default_rng(1).normal(size=(200_000, 3))
    want = m.mass_matrix(many)
    running, refused = True, []

    def resize():
        while running:
            try:
                many.resize((3, 3), refcheck=False)
                many.resize((200_000, 3), refcheck=False)
            except ValueError as e:
                refused.append(e)

    thread = threading.Thread(target=resize)
    thread.start()
    try:
        for _ in range(20):
            try:
                assert m.mass_matrix(many).shape[1:] == want.shape[1:]
            except lw.LinkworkError:
                pass
    finally:
        running = False
        thread.join()


def forked(_):
    m = arm()
    return m.mass_matrix(np.zeros((5000, 3)), threads=2)[-1, 0, 0], lw.Collisions(m, [lw.Collider.sphere("s", "b2", 0.1)]).collides(np.zeros((5000, 3)), threads=2).any()


def test_a_forked_process_goes_on():
    here = forked(None)
    with multiprocessing.get_context("fork").Pool(2) as pool:
        answers = pool.map_async(forked, range(4)).get(timeout=60)
    assert all(a == here for a in answers)


LONG = {
    "inverse kinematics": "m.inverse_kinematics(q, {'tip': [9, 0, 0]}, iterations=10**9, restarts=10**9)",
    "Robot.inverse_kinematics": "robot.inverse_kinematics('arm', [9, 0, 0], q=q, steps=10**9, restarts=10**9)",
    "Robot.inverse_kinematics_together": "robot.inverse_kinematics_together({'arm': [9, 0, 0]}, q=q, steps=10**9, restarts=10**9)",
    "search": "robot.begin_inverse_kinematics('arm', [9, 0, 0], q=q, steps=10**9, restarts=10**9).advance(10**12)",
    "plan": "robot.plan('arm', [2.5, 0, 0], [0.2, 0, 0], step=0.02, room=1_000_000)",
    "path": "robot.path([0.2, 0, 0], [1.0, 0, 0], 1e-9)",
    "collides": "robot.collides(np.tile(q, (20_000_000, 1)))",
    "simulate": "m.simulate(q, q, 1e-9, 10**7)",
    "contact": "contact.simulate(q, q, 1e-9, 10**7)",
}

BEGIN = """
import sys, numpy as np, linkwork as lw
b, parent = lw.Builder(), "world"
for k, axis in enumerate(([0, 0, 1], [0, 0, 1], [0, 1, 0])):
    b = b.body(f"b{k}", parent, lw.Hinge.pin(axis).limits(-3, 3), mass=1, com=[.1, 0, 0], inertia=np.eye(3) / 50, hinge_in_parent=[.3 * (k > 0), 0, 0])
    parent = f"b{k}"
m = b.node("tip", parent, [.3, 0, 0]).build()
rods = [lw.Collider.box(f"on b{k}", f"b{k}", [.3, .02, .02], at=[.15, 0, 0]) for k in range(3)]
# The first is passed within a hair all the way; the second is in the way.
near = lw.Collider.box("near", "world", [4, 4, 1], at=[0, 0, -0.51 - 1e-10])
wall = lw.Collider.box("wall", "world", [.05, 4, 4], at=[-.2, 0, 2])
robot = lw.Robot(m, chains={"arm": ("world", "b2")}, colliders=[rods[2], near] if sys.argv[1] == "path" else [rods[2], wall])
contact = lw.Contact(m, [lw.Collider.sphere("s", "b2", 0.01)])
q = np.array([0.2, 0.1, 0.1])
print("begin", flush=True)
"""


@pytest.mark.parametrize("name", list(LONG))
def test_ctrl_c_ends_long_calls(name):
    code = BEGIN + f"try:\n    {LONG[name]}\n    print('done')\nexcept KeyboardInterrupt:\n    print('interrupted')\n"
    run = subprocess.Popen([sys.executable, "-c", code, name], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        assert run.stdout.readline() == "begin\n", run.stderr.read()
        time.sleep(1.5)
        run.send_signal(signal.SIGINT)
        begin = time.monotonic()
        out, err = run.communicate(timeout=20)
    finally:
        run.kill()
    assert out == "interrupted\n", (out, err)
    assert time.monotonic() - begin < 5


def test_saving_goes_through_a_link_and_refuses_what_is_no_file(tmp_path):
    sim = lw.Simulation(PENDULUM)
    sim.run_until(0.1)
    target, link = tmp_path / "there" / "real.lwck", tmp_path / "link.lwck"
    target.parent.mkdir()
    target.write_bytes(b"before")
    link.symlink_to(target)
    sim.save(link)
    assert link.is_symlink() and target.read_bytes() != b"before"
    assert lw.Simulation.resume(link).state_hash == sim.state_hash
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    for path in (pipe, "/dev/null", tmp_path):
        before = os.stat(path).st_mode
        with pytest.raises(lw.LinkworkError, match="it is not a regular file"):
            sim.save(path)
        assert os.stat(path).st_mode == before


REAL = """<robot name="r"><link name="base"/>
<link name="cable"><inertial><mass value="0.5"/><inertia ixx="-3.5e-8" iyy="1e-3" izz="1e-3" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="j" type="continuous"><parent link="base"/><child link="cable"/><axis xyz="0 1 0"/></joint></robot>"""


def test_a_moment_that_is_just_below_zero_is_read_with_a_warning(tmp_path):
    path = tmp_path / "tiago.urdf"
    path.write_text(REAL)
    with pytest.warns(UserWarning, match="(?s)cable.*-3.5.*e-8|cable.*-0.000000035"):
        m = lw.load(path, "fixed")
    assert m.mass_matrix([0.3])[0, 0] == pytest.approx(1e-3)
    with pytest.raises(lw.LinkworkError, match="cable"):
        lw.load(path, "fixed", inertia_check="physical")
