"""Inverse kinematics, frames, changes of structure."""

import numpy as np
import pytest
from conftest import matrix_of, off, random_mechanism

import linkwork as lw


def arm():
    """Six pins with limits; the last frame is rotated."""
    b, axes = lw.Builder(), [[0, 0, 1], [0, 1, 0], [0, 1, 0], [0, 0, 1], [0, 1, 0], [0, 0, 1]]
    for i, axis in enumerate(axes):
        b.body(
            f"link{i}",
            "world" if i == 0 else f"link{i - 1}",
            lw.Hinge.pin(axis).limits(-2.8, 2.8, rate=3.0),
            mass=1.0,
            com=[0.01, 0.02, 0.1],
            hinge_in_parent=[0, 0, 0.3 if i else 0.1],
        )
    b.node("tool", "link5", [0.05, 0, 0.1, 0, 0.6, 0, 0.8])
    return b.build()


def test_inverse_kinematics_reaches_what_forward_kinematics_shows():
    m = arm()
    for seed in range(10):
        q = m.random_q(seed)
        X = m.state(q).pose("tool")
        found = m.inverse_kinematics(m.random_q(seed + 100), {"tool": X})
        assert off(m.state(found).pose("tool"), X) < 1e-8
        assert np.all(np.abs(found) <= 2.8)
        near = m.inverse_kinematics(q + 1e-3, {"tool": X})
        assert off(near, q) < 1e-6
    p = X[:3, 3]
    found = m.inverse_kinematics(q * 0.5, {"tool": p})
    assert off(m.state(found).position("tool"), p) < 1e-8
    turn = m.state(q).quaternion("tool")
    for at in (turn, X[:3, :3]):
        found = m.inverse_kinematics(0.5 * q, [lw.Target("tool", at)])
        assert off(m.state(found).pose("tool")[:3, :3], matrix_of(turn)) < 1e-8
    # The target is relative to another link, and one hinge is fixed.
    rel = np.linalg.inv(m.state(q).pose("link1")) @ X
    start = q.copy()
    start[3:] += 0.2
    found = m.inverse_kinematics(start, [lw.Target("tool", rel, relative_to="link1")], keep=["link0"])
    assert found[0] == start[0]
    assert off(np.linalg.inv(m.state(found).pose("link1")) @ m.state(found).pose("tool"), rel) < 1e-8


def test_rates_are_least_squares():
    m = arm()
    q = m.random_q(3)
    J, want = m.node_jacobian(q, "tool"), np.array([0.1, -0.2, 0.05, 0.02, 0.1, -0.04])
    v = m.inverse_kinematics_rates(q, {"tool": want})
    assert off(J @ v, want) < 1e-6
    v = m.inverse_kinematics_rates(q, [lw.RateTarget("tool", want, angular_weight=0.0)])
    assert off(v, np.linalg.pinv(J[3:]) @ want[3:]) < 1e-6
    v = m.inverse_kinematics_rates(q, {"tool": want}, keep=["link2"], v=[0, 0, 0.07, 0, 0, 0])
    assert v[2] == 0.07


def test_unreachable_targets_name_the_nearest():
    m = arm()
    with pytest.raises(lw.LinkworkError, match="not reached") as e:
        m.inverse_kinematics(m.neutral_q() + 0.1, {"tool": [9.0, 0, 0]}, restarts=2)
    nearest = e.value.q
    assert nearest.shape == (6,) and m.state(nearest).position("tool")[0] > 1.0
    q = m.neutral_q()
    for call, text in (
        (lambda: m.inverse_kinematics(q, {"tol": [0, 0, 1]}), "did you mean `tool`"),
        (lambda: m.inverse_kinematics(q, {"tool": [0, 0]}), "shape"),
        (lambda: m.inverse_kinematics(q, {"tool": [0, 0, np.nan]}), "NaN"),
        (lambda: m.inverse_kinematics(q, {"tool": 2 * np.eye(3)}), "not a rotation matrix"),
        (lambda: m.inverse_kinematics(q[1:], {"tool": [0, 0, 1]}), "`q` has 5 numbers"),
        (lambda: m.inverse_kinematics(q, {"tool": [0, 0, 1]}, position_tolerance=-1), "position_tolerance"),
        (lambda: m.inverse_kinematics(q, [lw.Target("tool", [0, 0, 1], position_weight=np.nan)]), "NaN"),
        (lambda: m.inverse_kinematics(q, {"tool": [0, 0, 1]}, keep=["lnk0"]), "did you mean `link0`"),
        (lambda: m.inverse_kinematics_rates(q, {"tool": [0, 0, 1]}), "shape"),
    ):
        with pytest.raises(lw.LinkworkError, match=text):
            call()
    with pytest.raises(TypeError):
        m.inverse_kinematics(q, 3)


def test_frames_agree_with_the_state_and_compute_only_what_is_asked():
    m = random_mechanism(6, floating=True)
    q, v, vdot = m.random_q(6), m.random_v(6), m.random_v(7)
    f = lw.Frames()
    f.add_mechanism("m", m)
    f.add_fixed("camera", "m/n4", [0.1, 0.2, 0.3, 0, 0, 0.6, 0.8])
    f.set_state("m", q, v, vdot)
    state = m.state(q, v)
    state.inverse_dynamics(vdot)
    for name in ("n2", "b5", "n6"):
        assert off(f.pose(f"m/{name}"), state.pose(name)) < 1e-14
        assert off(f.velocity(f"m/{name}"), state.velocity(name)) < 1e-13
        assert off(f.acceleration(f"m/{name}"), state.acceleration(name)) < 1e-12
    X = np.linalg.inv(state.pose("b1")) @ state.pose("n6")
    assert off(f.pose("m/n6", seen_from="m/b1"), X) < 1e-13
    # An observer on b1 sees the derivative of the observed pose.
    h = 1e-6
    seen = []
    for s in (h, -h):
        g = lw.Frames()
        g.add_mechanism("m", m)
        g.set_state("m", m.integrate(q, s * v + 0.5 * s * s * vdot), v + s * vdot)
        seen.append((g.position("m/n6", "m/b1"), g.velocity("m/n6", "m/b1")))
    assert off(f.velocity("m/n6", "m/b1")[3:], (seen[0][0] - seen[1][0]) / (2 * h)) < 1e-7
    assert off(f.acceleration("m/n6", "m/b1"), (seen[0][1] - seen[1][1]) / (2 * h)) < 1e-6
    in_world = f.velocity("m/n6", "m/b1", axes="world")
    R = state.pose("b1")[:3, :3]
    assert off(in_world, np.concatenate([R @ p for p in np.split(f.velocity("m/n6", "m/b1"), 2)])) < 1e-13
    # A new velocity does not compute poses.
    poses = f.counts[0]
    f.set_state("m", v=2 * v)
    f.velocity("m/n6")
    assert f.counts[0] == poses
    before = f.counts
    f.velocity("m/n6")
    assert f.counts == before
    # On a turntable a point has a centripetal acceleration.
    t = lw.Frames()
    t.add_moving("table", "world")
    t.add_fixed("mark", "table", [2.0, 0, 0])
    t.set_moving("table", [0, 0, 0], velocity=[0, 0, 3.0, 0, 0, 0])
    assert off(t.acceleration("mark"), [0, 0, 0, -18.0, 0, 0]) < 1e-15
    t.fix("mark", "world", [1.0, 0, 0])
    assert off(t.velocity("mark"), np.zeros(6)) == 0
    for call, text in (
        (lambda: f.pose("m/n66"), "n66"),
        (lambda: f.pose("camra"), "camra"),
        (lambda: f.add_fixed("camera"), "there is already a frame"),
        (lambda: f.add_mechanism("m", m), "m"),
        (lambda: f.set_state("k", q), "did you mean|mechanisms: m"),
        (lambda: f.set_state("m", q[1:]), "`q` has"),
        (lambda: f.set_moving("camera", [0, 0, 0]), "moving frame"),
        (lambda: f.fix("camera", "camera"), "which is attached to it"),
    ):
        with pytest.raises(lw.LinkworkError, match=text):
            call()


def test_detach_and_attach_keep_the_books():
    m = random_mechanism(8, floating=True)
    m.gravity = [0, 0, 0]
    q, v = m.random_q(8), m.random_v(8)
    leaf = m.bodies[-1]
    edit, before = m.edit(q, v), m.state(q, v)
    report = edit.detach(leaf)
    now = edit.mechanism
    after = now.state(edit.q, edit.v)
    for name in (leaf, "b0", "n3"):
        assert off(after.pose(name), before.pose(name)) < 1e-13
        assert off(after.velocity(name), before.velocity(name)) < 1e-12
    assert np.array_equal(now.gravity, [0, 0, 0])
    assert off(report.momentum_after, report.momentum_before) < 1e-13
    assert now.nv == m.nv - (m.hinge(leaf).stop - m.hinge(leaf).start) + 6
    kept = [(a, b) for a, b in enumerate(edit.places_v) if b is not None]
    assert len(kept) == m.nv - (m.hinge(leaf).stop - m.hinge(leaf).start)
    assert all(edit.v[b] == v[a] for a, b in kept)
    # The leaf is grasped again: momentum is conserved, energy decreases.
    report = edit.attach(leaf, "b0", lw.Hinge.locked())
    assert off(report.momentum_after, report.momentum_before) < 1e-12
    assert report.energy_after < report.energy_before
    assert off(edit.mechanism.state(edit.q).pose(leaf), before.pose(leaf)) < 1e-12
    assert np.linalg.norm(report.impulse) > 0 and report.point.shape == (3,)


def test_bodies_come_and_go():
    m = random_mechanism(2, floating=True)
    edit = m.edit(m.random_q(1), m.random_v(1))
    n = len(m.bodies)
    edit.add("rock", hinge=lw.Hinge.free(), mass=2.0, inertia=np.eye(3))
    edit.add("lid", "rock", lw.Hinge.pin([1, 0, 0]), q=[0.3], v=[0.1], mass=0.1, com=[0, 0.1, 0])
    edit.add_mechanism("other/", m, m.neutral_q(), np.zeros(m.nv), "world", [5, 0, 0])
    assert len(edit.mechanism.bodies) == 2 * n + 2
    edit.delete("rock")
    assert "lid" not in edit.mechanism.bodies and len(edit.mechanism.bodies) == 2 * n
    edit.reroot("b3")
    assert edit.mechanism.parent("b3") == "world"
    edit.attach_tree("b0", "other/b0", lw.Hinge.locked())
    assert edit.mechanism.parent("b0") == "other/b0"
    for call, text in (
        (lambda: edit.delete("b33"), "b33"),
        (lambda: edit.add("b3"), "exist"),
        (lambda: edit.add("x", hinge=lw.Hinge.pin([0, 0, 1]), q=[1, 2]), "numbers"),
        (lambda: edit.attach("other/b0", "b0", lw.Hinge.locked()), "which is outboard of it"),
        (lambda: m.edit(m.random_q(1)[1:], m.random_v(1)), "`q` has"),
    ):
        with pytest.raises(lw.LinkworkError, match=text):
            call()
