"""Structure, coordinates, dynamics of random mechanisms, batches, errors, threads."""

import os
import signal
import threading
import time

import numpy as np
import pytest
from conftest import SOURCE, matrix_of, off, random_mechanism, rotation

import linkwork as lw

SEEDS = range(6)


@pytest.mark.parametrize("seed", SEEDS)
def test_coordinates(seed):
    m = random_mechanism(seed, floating=True)
    q, v = m.random_q(seed), m.random_v(seed)
    assert q.shape == (m.nq,) and v.shape == (m.nv,) and m.neutral_q().shape == (m.nq,)
    assert off(m.difference(q, m.integrate(q, 0.3 * v)), 0.3 * v) < 1e-13
    h = 1e-6
    slope = (m.integrate(q, h * v) - m.integrate(q, -h * v)) / (2 * h)
    assert off(slope, m.qdot(q, v)) < 1e-8
    stretched = q.copy()
    free = next(s for s in m.subhinges if s.kind == "free").q
    stretched[free.stop - 4 : free.stop] *= 3.0
    assert off(m.normalize(stretched), q) < 1e-15
    covered = [i for s in m.subhinges for i in range(s.v.start, s.v.stop)]
    assert covered == list(range(m.nv))


def test_poses_against_rodrigues():
    b = lw.Builder()
    b.body("a", hinge=lw.Hinge.pin([1, 2, -1]), mass=1, hinge_in_parent=[0.1, 0.2, 0.3])
    b.body("b", "a", lw.Hinge.screw([0, 0, 2], 0.4), mass=1, hinge_in_parent=[0.5, 0, 0])
    b.body("c", "b", lw.Hinge.free(), mass=1, hinge_in_body=[0, 0.7, 0])
    b.node("tip", "c", [0, 0, 0.6])
    m = b.build()
    q = m.random_q(4)
    Xa, Xb, Xc, Xj, Xn = (np.eye(4) for _ in range(5))
    Xa[:3, :3], Xa[:3, 3] = rotation([1, 2, -1], q[0]), [0.1, 0.2, 0.3]
    Xb[:3, :3], Xb[:3, 3] = rotation([0, 0, 1], q[1]), [0.5, 0, 0.4 * q[1]]
    Xc[:3, :3], Xc[:3, 3] = matrix_of(q[5:9]), q[2:5]
    Xj[:3, 3], Xn[:3, 3] = [0, -0.7, 0], [0, 0, 0.6]
    state = m.state(q)
    assert off(state.pose("tip"), Xa @ Xb @ Xc @ Xj @ Xn) < 1e-15
    assert off(state.pose("b"), Xa @ Xb) < 1e-15
    assert m.parent("c") == "b" and m.parent("a") == "world" and m.hinge("c") == slice(2, 8, 1)


@pytest.mark.parametrize("seed", SEEDS)
def test_dynamics_are_consistent(seed):
    m = random_mechanism(seed, floating=seed % 2 == 1)
    q, v, tau = m.random_q(seed), m.random_v(seed), m.random_v(seed + 50)
    vdot = m.forward_dynamics(q, v, tau)
    assert off(m.inverse_dynamics(q, v, vdot), tau) < 1e-12
    assert off(m.mass_matrix(q) @ vdot + m.bias_forces(q, v), tau) < 1e-12
    state = m.state(q, v)
    assert off(state.kinetic_energy(), 0.5 * v @ m.mass_matrix(q) @ v) < 1e-13
    # The power satisfies dE/dt = τ·v along the motion.
    h = 1e-6
    after, before = (m.state(m.integrate(q, s * v), v + s * vdot) for s in (h, -h))
    total = [s.kinetic_energy() + s.potential_energy() for s in (after, before)]
    assert abs((total[0] - total[1]) / (2 * h) - tau @ v) < 1e-6 * (1 + abs(tau @ v))


@pytest.mark.parametrize("seed", SEEDS)
def test_velocities_accelerations_and_momentum_are_derivatives(seed):
    m = random_mechanism(seed, floating=True)
    q, v, vdot = m.random_q(seed), m.random_v(seed), m.random_v(seed + 1)
    state = m.state(q, v)
    state.inverse_dynamics(vdot)
    h = 1e-5
    after, before = (m.state(m.integrate(q, s * v + 0.5 * s * s * vdot), v + s * vdot) for s in (h, -h))
    for frame in ("n3", "b5"):
        slope = (after.position(frame) - before.position(frame)) / (2 * h)
        assert off(state.velocity(frame)[3:], slope) < 1e-8
        slope = (after.velocity(frame) - before.velocity(frame)) / (2 * h)
        assert off(state.acceleration(frame), slope) < 1e-7
    slope = (after.center_of_mass() - before.center_of_mass()) / (2 * h)
    assert off(state.com_velocity(), slope) < 1e-8
    slope = (after.com_velocity() - before.com_velocity()) / (2 * h)
    assert off(state.com_acceleration(), slope) < 1e-7
    assert off(state.momentum()[3:], m.total_mass * state.com_velocity()) < 1e-12
    still = m.state(q, v)
    still.inverse_dynamics(np.zeros(m.nv))
    assert off(still.acceleration("n3"), state.bias_acceleration("n3")) < 1e-12
    # The inertia is that of the whole mechanism at the base body: its lower right corner is the mass.
    inertia = state.subtree_inertia("b0")
    assert off(inertia, inertia.T) < 1e-14
    assert off(inertia[3:, 3:], m.total_mass * np.eye(3)) < 1e-13
    c = state.center_of_mass() - state.position("b0")
    assert off(inertia[:3, 3:], m.total_mass * np.array([[0, -c[2], c[1]], [c[2], 0, -c[0]], [-c[1], c[0], 0]])) < 1e-12
    parts = sum(b * state.body_com(n) for n, b in masses(m).items())
    assert off(parts / m.total_mass, state.center_of_mass()) < 1e-13


@pytest.mark.parametrize("seed", SEEDS)
def test_jacobians_are_derivatives_and_batches_are_rows(seed):
    m = random_mechanism(seed, floating=seed % 2 == 0)
    q, v = m.random_q(seed), m.random_v(seed)
    h = 1e-6
    after, before = m.integrate(q, h * v), m.integrate(q, -h * v)
    state = m.state(q, v)
    for frame in ("n2", "b6"):
        J = m.node_jacobian(q, frame)
        assert off(J @ v, state.velocity(frame)) < 1e-13
        rate = m.node_jacobian_rate(q, v, frame)
        assert off(rate @ v, state.bias_acceleration(frame)) < 1e-12
        slope = (m.node_jacobian(after, frame) - m.node_jacobian(before, frame)) / (2 * h)
        assert off(rate, slope) < 1e-7
        f = np.array([1.0, -2.0, 0.5, 3.0, 0.2, -0.7])
        assert off(m.node_jacobian_transpose_product(q, frame, f), J.T @ f) < 1e-13
        # A wrench acts like its transposed Jacobian.
        with_wrench = m.inverse_dynamics(q, v, 0 * v, wrenches={frame: f})
        assert off(with_wrench, m.bias_forces(q, v) - J.T @ f) < 1e-13
    assert off(m.com_jacobian(q) @ v, state.com_velocity()) < 1e-13
    assert off(m.centroidal_matrix(q) @ v, state.momentum()) < 1e-12
    slope = (m.centroidal_matrix(after) - m.centroidal_matrix(before)) @ v / (2 * h)
    assert off(m.centroidal_bias(q, v), slope) < 1e-6
    M, inverse = m.mass_matrix(q), m.inverse_mass_matrix(q)
    assert off(M @ inverse, np.eye(m.nv)) < 1e-12
    assert off(m.apply_inverse_mass(q, v), inverse @ v) < 1e-13
    J = np.vstack([m.node_jacobian(q, f) for f in ("n2", "b6", "n0")])
    assert off(m.compliance(q, ["n2", "b6", "n0"]), J @ inverse @ J.T) < 1e-13
    Q, V = np.array([m.random_q(k) for k in range(5)]), np.array([m.random_v(k) for k in range(5)])
    calls = [
        lambda q, v, **o: m.node_jacobian(q, "n3", **o),
        lambda q, v, **o: m.node_jacobian_rate(q, v, "n3", **o),
        lambda q, v, **o: m.node_jacobian_transpose_product(q, "n3", np.arange(6.0), **o),
        lambda q, v, **o: m.centroidal_matrix(q, **o),
        lambda q, v, **o: m.centroidal_bias(q, v, **o),
        lambda q, v, **o: m.com_jacobian(q, **o),
        lambda q, v, **o: m.compliance(q, ["n3", "n5"], **o),
        lambda q, v, **o: m.inverse_mass_matrix(q, **o),
        lambda q, v, **o: m.apply_inverse_mass(q, v, **o),
        lambda q, v, **o: m.kinetic_energy(q, v, **o),
        lambda q, v, **o: m.potential_energy(q, **o),
    ]
    for k, f in enumerate(calls):
        rows = np.array([f(a, b) for a, b in zip(Q, V, strict=True)])
        many = f(Q, V)
        assert off(many, rows) < 1e-12, k
        assert np.array_equal(f(Q, V, threads=2), many), k


@pytest.mark.parametrize("seed", SEEDS)
def test_derivatives_against_differences(seed):
    m = random_mechanism(seed, floating=seed % 2 == 0, prescribed=seed % 3 == 0)
    q, v, x = m.random_q(seed), m.random_v(seed), m.random_v(seed + 9)
    h, eye, fixed = 1e-6, np.eye(m.nv), np.array(m.prescribed)

    def slopes(f):
        return np.array([(f(h * e) - f(-h * e)) / (2 * h) for e in eye]).T

    by_q, by_v = m.inverse_dynamics_derivatives(q, v, x)
    assert off(by_q, slopes(lambda d: m.inverse_dynamics(m.integrate(q, d), v, x))) < 1e-7
    assert off(by_v, slopes(lambda d: m.inverse_dynamics(q, v + d, x))) < 1e-7
    by_q, by_v, by_tau = m.forward_dynamics_derivatives(q, v, x, prescribed=0.5 * x)
    forward = [
        lambda d: m.forward_dynamics(m.integrate(q, d), v, x, prescribed=0.5 * x),
        lambda d: m.forward_dynamics(q, v + d, x, prescribed=0.5 * x),
        lambda d: m.forward_dynamics(q, v, x + d, prescribed=0.5 * x),
    ]
    for found, f in zip((by_q, by_v, by_tau), forward, strict=True):
        assert off(found, slopes(f)) < 1e-6
        assert np.all(found[fixed] == 0)
    many = m.forward_dynamics_derivatives(np.array([q, q]), v, x, prescribed=0.5 * x, threads=2)
    assert all(off(a, [b, b]) < 1e-12 for a, b in zip(many, (by_q, by_v, by_tau), strict=True))
    many = m.inverse_dynamics_derivatives(np.array([q, q]), v, x)
    single = m.inverse_dynamics_derivatives(q, v, x)
    assert all(off(a, [b, b]) < 1e-12 for a, b in zip(many, single, strict=True))
    # Calls with wrenches do not use lanes, so the same numbers are computed in another way.
    none = {"n1": np.zeros(6)}
    loop = m.inverse_dynamics_derivatives(np.array([q, q]), v, x, wrenches=none, threads=2)
    assert all(off(a, [b, b]) < 1e-13 for a, b in zip(loop, single, strict=True))


@pytest.mark.parametrize("seed", SEEDS)
def test_the_regressor_is_linear_in_the_inertial_parameters(seed):
    m = random_mechanism(seed, floating=True)
    q, v, vdot = m.random_q(seed), m.random_v(seed), m.random_v(seed + 1)
    Y = m.regressor(q, v, vdot)
    rotors = np.concatenate([np.full(s.v.stop - s.v.start, s.gear**2 * s.armature) for s in m.subhinges])
    assert Y.shape == (m.nv, 10 * len(m.bodies))
    assert off(Y @ m.inertial_parameters() + rotors * vdot, m.inverse_dynamics(q, v, vdot)) < 1e-13
    assert np.array_equal(m.regressor(np.array([q, q]), v, vdot), [Y, Y])


def masses(m):
    rest = m.state(m.neutral_q())
    mass = {b: rest.subtree_inertia(b)[5, 5] for b in m.bodies}
    own = dict(mass)
    for b in m.bodies:
        if m.parent(b) != "world":
            own[m.parent(b)] -= mass[b]
    return own


def test_prescribed_coordinates():
    for seed in SEEDS:
        m = random_mechanism(seed, prescribed=True)
        q, v, tau, given = (f(seed + k) for k, f in enumerate([m.random_q, m.random_v, m.random_v, m.random_v]))
        fixed = np.array(m.prescribed)
        vdot, found = m.mixed_dynamics(q, v, tau, given)
        assert np.all(vdot[fixed] == given[fixed]) and np.all(found[~fixed] == tau[~fixed])
        assert off(m.inverse_dynamics(q, v, vdot), found) < 1e-12
        assert off(m.forward_dynamics(q, v, tau, prescribed=given), vdot) == 0.0
        many = m.mixed_dynamics(np.array([q, q]), v, tau, given)
        assert off(many[0], [vdot, vdot]) == 0.0 and off(many[1], [found, found]) == 0.0
        free = m.with_prescribed([])
        assert not any(free.prescribed)


@pytest.mark.parametrize("bodies", [5, 30])
def test_many_states_equal_single_ones(bodies):
    m = random_mechanism(9, bodies=bodies, floating=True)
    n = 37  # not a multiple of the lanes
    Q = np.array([m.random_q(k) for k in range(n)])
    V, T = (np.array([m.random_v(s + k) for k in range(n)]) for s in (100, 200))
    for f, args in (
        (m.forward_dynamics, (Q, V, T)),
        (m.inverse_dynamics, (Q, V, T)),
        (m.bias_forces, (Q, V)),
        (m.mass_matrix, (Q,)),
    ):
        many = f(*args)
        single = np.array([f(*(a[k] for a in args)) for k in range(n)])
        assert off(many, single) < 1e-12, f.__name__
        for threads in (2, 5, 10**9):
            assert np.array_equal(f(*args, threads=threads), many), f.__name__
    # The inputs are one row for all states, and no rows.
    assert off(m.forward_dynamics(Q, V[0], T), m.forward_dynamics(Q, np.tile(V[0], (n, 1)), T)) == 0
    assert m.mass_matrix(Q[:0]).shape == (0, m.nv, m.nv)


def test_inputs_of_any_layout():
    m = random_mechanism(1)
    q = m.random_q(1)
    want = m.mass_matrix(q)
    wide = np.zeros((m.nq, 2))
    wide[:, 0] = q
    for same in (list(q), tuple(q), wide[:, 0], q[::-1].copy()[::-1], q.astype(">f8")):
        assert np.array_equal(m.mass_matrix(same), want)
    Q = np.array([m.random_q(k) for k in range(3)])
    assert np.array_equal(m.mass_matrix(np.asfortranarray(Q)), m.mass_matrix(Q))
    assert np.array_equal(m.mass_matrix(q.astype("f4")), m.mass_matrix(q.astype("f4").astype("f8")))
    q.flags.writeable = False
    assert np.array_equal(m.mass_matrix(q), want)


def test_subgraphs():
    m = random_mechanism(4, bodies=8)
    names = [b for b in m.bodies if b != "b0"]
    rest = [b for b in names if m.parent(b) != "world"]
    part = m.subgraph([b for b in m.bodies if b in rest or m.parent(b) == "world"])
    assert part.base is None and part.mechanism.nv == m.nv
    leaf = m.bodies[-1]
    one = m.subgraph([leaf])
    q = m.random_q(1)
    assert one.mechanism.bodies == [leaf] and one.base == (None if m.parent(leaf) == "world" else m.parent(leaf))
    M, small = m.mass_matrix(q), one.mechanism.mass_matrix(q[one.q])
    assert off(small, M[np.ix_(one.v, one.v)]) < 1e-12
    with pytest.raises(lw.LinkworkError, match="no body `leg`"):
        m.subgraph(["leg"])
    with pytest.raises(lw.LinkworkError, match="no bodies"):
        m.subgraph([])


def test_gravity_can_be_set():
    m = random_mechanism(2)
    q = m.random_q(1)
    assert np.array_equal(m.gravity, [0, 0, -9.81])
    down = m.bias_forces(q, np.zeros(m.nv))
    m.gravity = [0, 0, -9.81 / 6]
    assert off(m.bias_forces(q, np.zeros(m.nv)), down / 6) < 1e-14
    m.gravity = [0, 0, 0]
    assert np.all(m.bias_forces(q, np.zeros(m.nv)) == 0)
    with pytest.raises(lw.LinkworkError, match="gravity"):
        m.gravity = [0, 0]


def bad_calls(m):
    q, v = m.random_q(1), m.random_v(1)
    nan = v.copy()
    nan[1] = np.nan
    inf = q.copy()
    inf[0] = np.inf
    f, i, M = m.forward_dynamics, m.inverse_dynamics, m.mass_matrix
    return [
        (lambda: M(q[1:]), "`q` has .* numbers, the mechanism has"),
        (lambda: M(inf), "`q`: number 0 is inf"),
        (lambda: f(q, nan, v), "`v`: number 1 is NaN"),
        (lambda: f(q, v, v[:1]), "`tau` has 1 numbers"),
        (lambda: f([q, q], [v, v, v], v), "`q` has 2 states, `v` has 3"),
        (lambda: M(np.zeros((2, 2, 2))), "3 dimensions"),
        (lambda: M(3.0), "0 dimensions"),
        (lambda: M("abc"), "not an array of numbers"),
        (lambda: M(None), "`q`"),
        (lambda: M(q + 1j), "complex"),
        (lambda: M([[1.0], [2.0, 3.0]]), "not an array of numbers"),
        (lambda: M(q, threads=0), "threads"),
        (lambda: i(q, v, v, wrenches={"nowhere": np.zeros(6)}), "no node and no body `nowhere`"),
        (lambda: i(q, v, v, wrenches={"n1": np.zeros(3)}), r"wrenches\[\"n1\"\]"),
        (lambda: i(q, v, v, wrenches={"n1": np.full(6, np.nan)}), "number 0 is NaN"),
        (lambda: m.state(q).pose("n11"), "did you mean `n1`"),
        (lambda: m.state(q).body_com("n1"), "no body `n1`"),
        (lambda: m.state(v, q), "`"),
        (lambda: m.integrate(q, q), "`dv`"),
        (lambda: m.simulate(q, v, 0.0, 10), "`dt` is 0"),
        (lambda: m.simulate(q, v, np.nan, 10), "`dt` is NaN"),
        (lambda: m.simulate(q, v, 0.1, 10, torque=np.zeros((3, m.nv))), "`torque`"),
        (lambda: m.simulate(q, v, 0.1, 10, integrator="rk5"), "did you mean `rk4`"),
        (lambda: m.simulate(q, v, 0.1, 10, torque=lambda t, q, v: [1.0]), r"torque\(t, q, v\)"),
    ]


def test_refusals():
    m = random_mechanism(3)
    assert issubclass(lw.LinkworkError, ValueError)
    for call, text in bad_calls(m):
        with pytest.raises(lw.LinkworkError, match=text) as e:
            call()
        assert "\n  help: " in str(e.value), str(e.value)
    for call in (lambda: m.state(), lambda: m.simulate(1, 2, 3, -1), lambda: m.subgraph([1])):
        with pytest.raises((TypeError, OverflowError)):
            call()


def test_faults_of_a_description_come_all_at_once():
    b = lw.Builder()
    b.body("arm", "wrold", lw.Hinge.pin([0, 0, 0]), mass=-1.0)
    b.body("arm", hinge=lw.Hinge.pin([0, 0, 1]).armature(-1.0))
    b.node("tip", "arms")
    with pytest.raises(lw.LinkworkError) as e:
        b.build()
    for text in ("did you mean `world`", "axis has no direction", "mass -1", "defined 2 times", "armature", "did you mean `arm`"):
        assert text in str(e.value), text
    with pytest.raises(lw.LinkworkError, match="not a pose"):
        b.node("x", "arm", np.zeros((4, 4)))
    with pytest.raises(lw.LinkworkError, match="quaternion has the length"):
        b.node("x", "arm", [0, 0, 0, 1, 1, 1, 1])
    with pytest.raises(lw.LinkworkError, match="shape"):
        b.node("x", "arm", [0, 0])
    free = lw.Builder().body("a", hinge=lw.Hinge.pin([0, 0, 1])).build()
    with pytest.raises(lw.LinkworkError, match="the hinge moves no inertia"):
        free.forward_dynamics([0.1], [0.2], [0.3])
    with pytest.raises(lw.LinkworkError, match="the hinge moves no inertia"):
        free.operators([0.1])
    with pytest.raises(lw.LinkworkError, match="the hinge moves no inertia"):
        free.forward_dynamics(np.full((9, 1), 0.1), [0.2], [0.3], threads=2)


def test_load_from_ron(at_source):
    m = lw.load("sims/pendulum")
    assert (m.nq, m.nv, m.bodies) == (1, 1, ["bob"])
    assert off(m.mass_matrix([0.3]), [[1.0 + 0.4 * 0.1**2]]) < 1e-12
    free = lw.load("sims/pendulum", root="free")
    assert (free.nq, free.nv) == (7, 6) and lw.load("sims/pendulum/sim.ron", root="fixed").nv == 0
    rover = lw.load("sims/rover_traverse")
    assert rover.nv == 20
    for path, text in (("gone.ron", "cannot be read"), ("arm.stl", "cannot be read"), ("README.md", "not well-formed XML")):
        with pytest.raises(lw.LinkworkError, match=text):
            lw.load(path)
    with pytest.raises(lw.LinkworkError, match="`root`"):
        lw.load("sims/pendulum", root="loose")


def pendulum(length=0.7):
    return lw.Builder().body("bob", hinge=lw.Hinge.pin([0, 1, 0]), mass=2.0, com=[0, 0, -length]).build()


def test_small_integration_has_its_order():
    m = pendulum()
    q, v = np.array([1.1]), np.array([0.4])

    def end(n, method):
        _, qs, vs = m.simulate(q, v, 1.0 / n, n, integrator=method)
        return np.array([qs[-1, 0], vs[-1, 0]])

    fine = end(10_000, "rk4")
    for method, order in (("rk4", 4), ("semi_implicit_euler", 1)):
        errors = [np.linalg.norm(end(n, method) - fine) for n in (100, 200)]
        # Measured: 4.00 and 1.02.
        assert abs(np.log2(errors[0] / errors[1]) - order) < 0.1, (method, errors)


def test_small_integration_conserves_and_takes_torques():
    m = random_mechanism(7, floating=True)
    q, v = m.random_q(7), 0.3 * m.random_v(7)
    t, qs, vs = m.simulate(q, v, 1e-3, 200)
    assert t.shape == (201,) and qs.shape == (201, m.nq) and vs.shape == (201, m.nv)
    energy = [s.kinetic_energy() + s.potential_energy() for s in (m.state(q, v), m.state(qs[-1], vs[-1]))]
    assert abs(energy[1] - energy[0]) < 1e-8 * (1 + abs(energy[0]))
    push = 0.1 * m.random_v(3)
    runs = [
        m.simulate(q, v, 1e-3, 50, torque=given)
        for given in (push, np.tile(push, (50, 1)), lambda t, q, v: push, lambda t, q, v: list(push))
    ]
    for run in runs[1:]:
        assert all(np.array_equal(a, b) for a, b in zip(run, runs[0], strict=True))
    assert not np.array_equal(runs[0][1], qs[:51])

    def fails(t, q, v):
        raise KeyError("mine")

    with pytest.raises(KeyError, match="mine"):
        m.simulate(q, v, 1e-3, 5, torque=fails)
    # A damped pendulum with a small amplitude satisfies x'' + 2 d x' + w² x = 0.
    p = pendulum()
    w2, d = 9.81 / 0.7, 0.1 / (2 * 2.0 * 0.49)
    t, qs, _ = p.simulate([1e-4], [0.0], 1e-3, 2000, torque=lambda t, q, v: -0.1 * v)
    w = np.sqrt(w2 - d * d)
    want = 1e-4 * np.exp(-d * t) * (np.cos(w * t) + d / w * np.sin(w * t))
    assert off(qs[:, 0], want) < 1e-8


def test_a_run_that_explodes_is_reported():
    with pytest.raises(lw.LinkworkError, match=r"t = .* s: "):
        pendulum().simulate([0.1], [0.0], 0.1, 4000, torque=lambda t, q, v: 1e3 * v)


def test_other_threads_run_meanwhile():
    """During a long call in one thread, another thread continues: the lock is not held."""
    m = random_mechanism(9, bodies=30, floating=True)
    Q = np.tile(m.random_q(1), (100_000, 1))
    V = np.zeros(m.nv)
    spans = []

    def work():
        begin = time.perf_counter()
        m.inverse_dynamics(Q, V, V)
        spans.append((begin, time.perf_counter()))

    worker = threading.Thread(target=work)
    worker.start()
    ticks = []
    while worker.is_alive():
        ticks.append(time.perf_counter())
        time.sleep(0.001)
    worker.join()
    begin, end = spans[0]
    during = [t for t in ticks if begin < t < end]
    # If the call held the lock, there would be no tick, or one at either end.
    assert end - begin > 0.02, "too short to tell"
    assert len(during) > 5, (len(during), end - begin)
    # Two threads on one mechanism do not disturb each other.
    q, v = m.random_q(2), m.random_v(2)
    want, wrong = m.forward_dynamics(q, v, v), []

    def check():
        for _ in range(300):
            if not np.array_equal(m.forward_dynamics(q, v, v), want):
                wrong.append(1)

    threads = [threading.Thread(target=check) for _ in range(4)]
    for th in threads:
        th.start()
    for th in threads:
        th.join()
    assert not wrong


def test_a_printed_mechanism_has_masses_without_rounding_in_the_last_digits():
    text = str(lw.load(SOURCE / "assemblies/arms/six_axis.urdf"))
    assert text.splitlines()[0] == "8 bodies, nq=6, nv=6, 21.1 kg"
    assert "forearm  pin  q[2:3] v[2:3]  2.3 kg" in text


@pytest.mark.filterwarnings("ignore:.*fork")
def test_a_child_after_fork_makes_threads_of_its_own():
    """The child does not wait for the threads of its parent, which it does not have."""
    arm = lw.Builder().body("a", "world", lw.Hinge.pin([0, 1, 0]), mass=1.0, com=[0, 0, -1], inertia=np.eye(3)).build()
    many = np.linspace(0, 1, 1000)[:, None]
    wanted = arm.mass_matrix(many, threads=2)
    child = os.fork()
    if child == 0:
        signal.alarm(30)
        same = np.array_equal(arm.mass_matrix(many, threads=2), wanted)
        os._exit(0 if same else 1)
    _, status = os.waitpid(child, 0)
    assert os.waitstatus_to_exitcode(status) == 0
    assert np.array_equal(arm.mass_matrix(many, threads=2), wanted)
