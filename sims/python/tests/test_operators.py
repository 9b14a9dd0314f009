"""Operator expressions: the lines of the literature as written, compared with dense algebra; errors."""

import numpy as np
import pytest
from conftest import off, random_mechanism

import linkwork as lw

SEEDS = range(8)


def symbols(m, q, **options):
    o = m.operators(q, **options)
    return o.H, o.Phi, o.Psi, o.M, o.K, o.D, o.I, o.P, o.J


@pytest.mark.parametrize("seed", SEEDS)
def test_the_expressions_of_the_literature_run_as_written(seed):
    m = random_mechanism(seed, floating=seed % 2 == 0)
    q, udot = m.random_q(seed), m.random_v(seed)
    H, Phi, Psi, M, K, D, I, P, J = symbols(m, q)
    mass = m.mass_matrix(q)

    T = H * Phi * M * Phi.T * H.T * udot + J * udot
    assert off(T, mass @ udot) < 1e-13

    found = (I - H * Psi * K).T * D.inv() * (I - H * Psi * K) * T
    # Measured: 3e-15.
    assert off(found, udot) < 1e-13
    assert off(mass @ found, T) < 1e-13

    factors = (I + H * Phi * K) * D * (I + H * Phi * K).T
    assert off(factors.dense(), mass) < 1e-13
    assert off((H * P * H.T + J).dense(), D.dense()) < 1e-13


def test_without_armature_as_in_the_seed():
    m = lw.Builder().body("a", hinge=lw.Hinge.pin([0, 1, 0]), mass=2.0, com=[0.3, 0.1, -0.4])
    m = m.body("b", "a", lw.Hinge.ball(), mass=1.0, com=[0.1, 0.2, 0.3], inertia=np.diag([0.3, 0.2, 0.4]))
    m = m.build()
    q, udot = m.random_q(1), m.random_v(1)
    H, Phi, Psi, M, K, D, I, *_ = symbols(m, q)
    T = H * Phi * M * Phi.T * H.T * udot
    assert off(T, m.mass_matrix(q) @ udot) < 1e-14
    udot2 = (I - H * Psi * K).T * D.inv() * (I - H * Psi * K) * T
    assert off(udot2, udot) < 1e-13


def test_signs_of_multiplication():
    m = random_mechanism(3)
    q, x = m.random_q(3), m.random_v(3)
    H, Phi, Psi, M, K, D, I, P, J = symbols(m, q)
    A = H * Phi * M * Phi.T * H.T
    dense = A.dense()
    assert dense.shape == A.shape == (m.nv, m.nv)
    for y in (A * x, A @ x, A.apply(x), A * list(x), (H @ Phi @ M) @ (Phi.T @ (H.T @ x))):
        assert isinstance(y, np.ndarray) and off(y, dense @ x) < 1e-13
    X = np.array([m.random_v(k) for k in range(4)]).T
    assert off(A * X, dense @ X) < 1e-13
    assert off((2.0 * A - A / 4 + A * np.float64(3)).dense(), 4.75 * dense) < 1e-14
    assert off((-A).dense(), -dense) < 1e-15
    assert off((H * Psi * K).T.dense(), (H.dense() @ Psi.dense() @ K.dense()).T) < 1e-13
    assert off(I * x, x) == 0.0


def test_prescribed_coordinates():
    for seed in SEEDS:
        m = random_mechanism(seed, prescribed=True)
        q, fixed = m.random_q(seed), np.array(m.prescribed)
        o, mass = m.operators(q), m.mass_matrix(q)
        inverse = o.mass_inverse.dense()
        assert np.all(inverse[fixed] == 0) and np.all(inverse[:, fixed] == 0)
        free = np.ix_(~fixed, ~fixed)
        assert off(inverse[free] @ mass[free], np.eye((~fixed).sum())) < 1e-12
        whole = m.operators(q, all_free=True).mass_inverse.dense()
        assert off(whole @ mass, np.eye(m.nv)) < 1e-12


def test_compliance_of_frames_is_that_of_the_dense_formula():
    m = random_mechanism(5, floating=True)
    q = m.random_q(5)
    o = m.operators(q)
    B = o.B("n2", "b4", "n6")
    J = (B.T * o.jacobian).dense()
    assert J.shape == (18, m.nv)
    want = J @ np.linalg.solve(m.mass_matrix(q), J.T)
    assert off((B.T * o.Omega * B).dense(), want) < 1e-13
    # A Jacobian is the derivative of the velocity: J v is what the state reports.
    v = m.random_v(5)
    state = m.state(q, v)
    assert off(J @ v, np.concatenate([state.velocity(f) for f in ("n2", "b4", "n6")])) < 1e-12


def test_an_expression_prints_as_it_is_read():
    o = random_mechanism(1).operators(random_mechanism(1).random_q(1))
    assert repr(o.H * o.Phi * o.M * o.Phi.T * o.H.T + o.J) == "H φ M φ* H* + J"
    assert repr((o.I - o.H * o.Psi * o.K).T * o.D.inv()) == "(I − H ψ K)* D⁻¹"


def test_mistakes_name_both_operands():
    m = random_mechanism(2)
    q, v = m.random_q(2), m.random_v(2)
    o = m.operators(q)
    with pytest.raises(lw.LinkworkError, match=r"cannot multiply `M` .*6·links = .* by `H` .*nv = "):
        o.M * o.H
    with pytest.raises(lw.LinkworkError, match=r"cannot add `H` .* and `M`"):
        o.H + o.M
    with pytest.raises(lw.LinkworkError, match=r"`H φ`.* has \d+ numbers, expected"):
        o.H * o.Phi * v
    with pytest.raises(lw.LinkworkError, match=r"cannot multiply an array .* by `H`"):
        v * o.H
    with pytest.raises(lw.LinkworkError, match=r"cannot multiply an array .* by `H`"):
        v @ o.H
    with pytest.raises(lw.LinkworkError, match="different systems"):
        o.H * m.operators(q).Phi
    with pytest.raises(lw.LinkworkError, match="no inverse of low order"):
        o.K.inv()
    with pytest.raises(lw.LinkworkError, match="the size of `I` is not defined"):
        o.I.dense()
    with pytest.raises(lw.LinkworkError, match="NaN"):
        o.M * np.full(6 * o.links, np.nan)
    with pytest.raises(lw.LinkworkError, match="did you mean `n3`"):
        o.B("n33")
    with pytest.raises(lw.LinkworkError, match="cannot add"):
        o.H + v
    with pytest.raises(TypeError):
        o.H @ 2.0
    with pytest.raises(lw.LinkworkError, match="finite"):
        o.H / 0.0
