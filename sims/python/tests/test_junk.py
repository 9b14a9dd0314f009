"""Any argument gives a value or an exception, never a panic and never the end of the interpreter.

A panic in Rust raises `PanicException`, which is not a subclass of `Exception`: it ends these tests.
"""

import random

import numpy as np
import pytest
from conftest import ELSEWHERE, SOURCE, exported_classes, exported_objects, random_mechanism

import linkwork as lw

PENDULUM = SOURCE / "sims" / "pendulum" / "sim.ron"


def junk(m, r):
    """Values that are sometimes valid, and values that never are."""
    q, v = m.random_q(r.randrange(99)), m.random_v(r.randrange(99))
    right = [q, v, q[:-1], np.append(v, 1.0), np.array([q, q]), np.array([v] * 3), np.zeros((0, m.nq)), np.zeros((0, m.nv))]
    names = ["b0", "n1", "world", "", "\0", "b0.x", "**", "**.angle", "ü", "1e999", "a" * 5000]
    numbers = [0, 1, -1, 2**40, -(2**70), 0.0, -0.0, 1e308, -1e-320, np.nan, np.inf, True, None, 3 + 1j]
    arrays = [
        [],
        [[]],
        np.zeros(6),
        np.eye(3),
        np.eye(4),
        np.full(6, 1e300),
        np.full(m.nq, 1e200),
        np.full(m.nv, -1e200),
        np.zeros(3, dtype=object),
        np.array(["a", "b"]),
        np.zeros((2, 3, 4)),
        np.zeros(m.nq, dtype=[("a", "f8")]),
        np.broadcast_to(np.float64(1.0), (m.nv,)),
        np.array([q] * 2)[:, ::-1],
        np.ma.masked_array(q, q > 0),
    ]
    others = [{}, {"b0": np.zeros(6)}, {"n1": [0, 0, 1]}, {1: 2}, ["b0"], ["b0", "n9"], lambda *a: v, lambda *a: 1 / 0, object(), b"x", lw.Hinge.pin([1, 0, 0]), m]
    kinds = [right, right, right, names, numbers, arrays, others]
    return r.choice(r.choice(kinds))


def objects(m, examples):
    """Objects of a random mechanism, often, and one of every class that the package exports."""
    q, v = m.random_q(1), m.random_v(1)
    frames = lw.Frames()
    frames.add_mechanism("m", m)
    o = m.operators(q)
    sim = lw.Simulation(PENDULUM)
    return [m, m, m, m, m.state(q, v), o, o.H, o.Phi * o.M, m.edit(q, v), frames, sim, sim.log(["**"]), *examples.values()]


# These functions run for a given time, or write to a given file.
LONG = {"simulate", "run_until", "step", "run", "save", "record", "resume", "execute"}


@pytest.mark.parametrize("seed", range(12))
def test_any_call_gives_a_value_or_an_exception(seed, tmp_path):
    r = random.Random(seed)
    m = random_mechanism(seed, bodies=r.randrange(1, 6), floating=seed % 2 == 0, prescribed=seed % 3 == 0)
    values = errors = 0
    asked = set()
    with np.errstate(all="ignore"):
        things = objects(m, exported_objects(tmp_path))
        for _ in range(1500):
            thing = r.choice(things)
            public = [n for n in dir(thing) if not n.startswith("_") and n not in LONG]
            special = [n for n in ("__getitem__", "__setitem__", "__contains__", "__mul__", "__matmul__", "__rmul__", "__add__", "__truediv__") if hasattr(thing, n)]
            # Some objects only have a string form.
            name = r.choice(public + special or ["__repr__"])
            try:
                member = getattr(thing, name)
                asked.add(type(thing).__name__)
                if callable(member):
                    args = [junk(m, r) for _ in range(r.randrange(5))]
                    options = {"threads": r.choice([1, 2, 0, -1])} if r.random() < 0.1 else {}
                    result = member(*args, **options)
                    if isinstance(thing, (lw.Mechanism, lw.Operator)):
                        finite(result)
                    if isinstance(result, (lw.Mechanism, lw.State, lw.Operator)) and len(things) < 40:
                        things.append(result)
                values += 1
            except Exception as e:  # noqa: BLE001
                assert type(e).__name__ != "PanicException"
                errors += 1
    # Both happen often; otherwise the test would be useless.
    assert values > 200 and errors > 200, (values, errors)
    assert asked >= set(exported_classes()) - ELSEWHERE


def damaged(good, r):
    """Bytes with a few pieces flipped, removed, doubled, moved or overwritten."""
    data = bytearray(good)
    for _ in range(r.randrange(1, 4)):
        a = r.randrange(len(data))
        b = min(len(data), a + r.randrange(1, 40))
        kind = r.randrange(5)
        if kind == 0:
            data[a] ^= 1 << r.randrange(8)
        elif kind == 1:
            del data[a:b]
        elif kind == 2:
            data[a:a] = data[a:b]
        elif kind == 3:
            data[a:b] = bytes(r.choice([0, 0xFF, 0x7F, 0xC1, r.randrange(256)]) for _ in range(b - a))
        else:
            at = r.randrange(len(data))
            data[a:b] = data[at : at + b - a]
    return bytes(data) if data != good and data else good[:-1]


def checksum(body):
    """Checksum of a checkpoint: FNV-1a of 64 bits, and a mixing step."""
    h, most = 0xCBF29CE484222325, 2**64 - 1
    for byte in body:
        h = (h ^ byte) * 0x100000001B3 & most
    h ^= h >> 33
    h = h * 0xFF51AFD7ED558CCD & most
    return (h ^ h >> 33).to_bytes(8, "little")


def test_damaged_checkpoints_are_refused_or_go_on(tmp_path):
    r = random.Random(1)
    sim = lw.Simulation(PENDULUM)
    sim.run_until(0.1)
    sim.save(tmp_path / "good.lwck")
    good = (tmp_path / "good.lwck").read_bytes()
    body = good[16:]
    assert good[8:16] == checksum(body)
    path = tmp_path / "bad.lwck"
    read = refused = 0
    for k in range(600):
        # The checksum is correct, as only after a deliberate change; every tenth file keeps the old
        # one.
        bad = damaged(body, r)
        path.write_bytes(good[:8] + (good[8:16] if k % 10 == 0 else checksum(bad)) + bad)
        try:
            lw.Simulation.resume(path).step()
            assert k % 10 != 0
            read += 1
        except lw.LinkworkError as e:
            assert str(e)
            refused += 1
    assert read > 3 and refused > 300, (read, refused)


def test_damaged_logs_are_refused_or_read_as_far_as_they_go(tmp_path):
    r = random.Random(2)
    sim = lw.Simulation(PENDULUM)
    sim.record(tmp_path / "good.mcap", ["bob"], rate=100)
    sim.run_until(0.5)
    sim.stop_recording()
    good, path = (tmp_path / "good.mcap").read_bytes(), tmp_path / "bad.mcap"
    whole = lw.read_log(tmp_path / "good.mcap")["bob.angle"].y
    read = refused = 0
    for _ in range(400):
        path.write_bytes(damaged(good, r))
        try:
            log = lw.read_log(path)
            angle = log["bob.angle"].y if "bob.angle" in log else np.zeros(0)
            # The values that are read are those that were written.
            assert np.array_equal(angle, whole[: len(angle)])
            read += 1
        except lw.LinkworkError as e:
            assert str(e)
            refused += 1
    # The number of readable logs depends on the position of the damage in a log of this length.
    assert read > 0 and refused > 100, (read, refused)


def finite(result):
    """An algorithm returns numbers, or raises."""
    for x in result if isinstance(result, tuple) else (result,):
        if isinstance(x, np.ndarray) and x.dtype == np.float64:
            assert np.isfinite(x).all()


def test_an_overflow_is_refused():
    m = random_mechanism(1)
    q, v, huge = m.random_q(1), m.random_v(1), np.full(m.nv, 1e200)
    for call in (
        lambda: m.bias_forces(q, huge),
        lambda: m.bias_forces(np.array([q, q]), huge),
        lambda: m.state(q, huge).inverse_dynamics(v),
        lambda: m.regressor(q, huge, v),
        lambda: m.simulate(q, huge, 1.0, 3),
    ):
        with pytest.raises(lw.LinkworkError, match="overflowed|NaN or infinite|not finite"):
            call()


def test_empty_mechanisms_answer():
    welded = lw.Builder().body("a", mass=1.0, com=[0.1, 0, 0]).node("n", "a").build()
    nothing = lw.Builder().build()
    for m in (welded, nothing):
        e = np.zeros(0)
        assert m.nq == m.nv == 0
        assert m.mass_matrix(e).shape == (0, 0) and m.inverse_mass_matrix(e).shape == (0, 0)
        assert m.forward_dynamics(e, e, e).shape == (0,) and m.bias_forces(e, e).shape == (0,)
        assert m.mass_matrix(np.zeros((3, 0))).shape == (3, 0, 0)
        assert m.inverse_dynamics_derivatives(e, e, e)[0].shape == (0, 0)
        assert m.forward_dynamics_derivatives(np.zeros((2, 0)), e, e)[2].shape == (2, 0, 0)
        assert m.centroidal_matrix(e).shape == (6, 0) and m.com_jacobian(e).shape == (3, 0)
        assert m.kinetic_energy(e, e) == 0.0
        assert m.state(e).momentum().shape == (6,)
        assert m.operators(e).mass.dense().shape == (0, 0)
        t, qs, vs = m.simulate(e, e, 0.1, 3)
        assert t.shape == (4,) and qs.shape == vs.shape == (4, 0)
        assert m.regressor(e, e, e).shape == (0, 10 * len(m.bodies))
    assert welded.node_jacobian(e, "n").shape == (6, 0)
    assert np.all(welded.compliance(e, ["n"]) == 0) and welded.compliance(e, []).shape == (0, 0)
    assert np.array_equal(welded.compliance(np.zeros((2, 0)), ["n"]), np.zeros((2, 6, 6)))
    assert list(welded.state(e).position("a")) == [0, 0, 0]


def test_too_much_is_a_memory_error_and_the_interpreter_lives():
    arm = lw.Builder().body("a", hinge=lw.Hinge.pin([0, 1, 0]), mass=1.0, inertia=np.eye(3)).build()
    for steps in (10**12, 2**62, 2**63):
        with pytest.raises(MemoryError):
            arm.simulate([0.1], [0.0], 1e-3, steps)
    t, _, _ = arm.simulate([0.1], [0.0], 1e-3, 10)
    assert len(t) == 11
