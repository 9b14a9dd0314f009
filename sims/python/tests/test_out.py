"""`out=`: results in arrays of the caller, and arrays that cannot be used."""

import numpy as np
import pytest

import linkwork as lw


@pytest.fixture
def arm():
    parts = lw.Builder()
    pins = [[0, 0, 1], [0, 1, 0], [1, 0, 0]]
    for k, axis in enumerate(pins):
        parent = f"b{k - 1}" if k else "world"
        parts.body(f"b{k}", parent, lw.Hinge.pin(axis), mass=1.0 + k, com=[0.1, 0.05, 0.2], inertia=np.diag([0.1, 0.12, 0.15]), hinge_in_parent=[0.1, 0, 0.3])
    return parts.build()


def calls(arm, many):
    """{name: (function of out, shape)}."""
    rows = (5,) if many else ()
    q, v, a = (np.random.default_rng(k).uniform(-1, 1, rows + (3,)) for k in range(3))
    return {
        "inverse": (lambda **o: arm.inverse_dynamics(q, v, a, **o), rows + (3,)),
        "wrenched": (lambda **o: arm.inverse_dynamics(q, v, a, wrenches={"b2": [1, 2, 3, 4, 5, 6]}, **o), rows + (3,)),
        "forward": (lambda **o: arm.forward_dynamics(q, v, a, **o), rows + (3,)),
        "mass": (lambda **o: arm.mass_matrix(q, **o), rows + (3, 3)),
        "jacobian": (lambda **o: arm.node_jacobian(q, "b2", **o), rows + (6, 3)),
    }


@pytest.mark.parametrize("many", [False, True])
@pytest.mark.parametrize("name", ["inverse", "wrenched", "forward", "mass", "jacobian"])
def test_results_are_written_where_they_are_wanted(arm, name, many):
    call, shape = calls(arm, many)[name]
    expected, out = call(), np.full(shape, np.nan)
    assert call(out=out) is out and np.array_equal(out, expected)
    assert call(out=None) is not out
    # The result is written to a part of a larger array.
    whole = np.zeros((2,) + shape)
    call(out=whole[1])
    assert np.array_equal(whole[1], expected) and not whole[0].any()


@pytest.mark.parametrize("many", [False, True])
@pytest.mark.parametrize("name", ["inverse", "wrenched", "forward", "mass", "jacobian"])
def test_arrays_that_cannot_be_are_refused(arm, name, many):
    call, shape = calls(arm, many)[name]
    locked = np.zeros(shape)
    locked.flags.writeable = False
    apart = np.zeros(shape + (2,))[..., 0]
    bad = {
        "not an array of float64: float32": np.zeros(shape, np.float32),
        "not an array of float64": [0.0] * 3,
        "`out` has the shape": np.zeros(shape + (1,)),
        "read-only": locked,
        "not C-contiguous": apart,
    }
    if sum(n > 1 for n in shape) > 1:
        bad["`out` is not C-contiguous"] = np.zeros(shape, order="F")
    for match, out in bad.items():
        with pytest.raises(lw.LinkworkError, match=match) as e:
            call(out=out)
        assert "help" in str(e.value)
        assert not np.any(out)


def test_memory_of_an_argument_is_refused(arm):
    q, v, a = np.array([0.1, 0.2, 0.3]), np.zeros(3), np.ones(3)
    for out in (q, v, a):
        before = out.copy()
        with pytest.raises(lw.LinkworkError, match="shares memory with an argument"):
            arm.inverse_dynamics(q, v, a, out=out)
        assert np.array_equal(out, before)
    # Adjacent parts of one array do not overlap.
    both = np.array([0.1, 0.2, 0.3, 0, 0, 0])
    arm.forward_dynamics(both[:3], v, a, out=both[3:])
    assert np.array_equal(both[3:], arm.forward_dynamics(q, v, a)) and np.array_equal(both[:3], q)


def test_what_is_refused_leaves_out_alone(arm):
    out = np.full(3, 7.0)
    for args in [([np.nan] * 3, [0] * 3, [0] * 3), ([0] * 3, [1e200] * 3, [0] * 3)]:
        with pytest.raises(lw.LinkworkError):
            arm.inverse_dynamics(*args, out=out)
        assert np.array_equal(out, [7, 7, 7])
