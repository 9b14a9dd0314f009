"""`Robot`: parts, inverse kinematics, grasped objects, forces and paths; compared with the reference and with identities."""

import json
import os
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from conftest import ROBOTS, matrix_of

import linkwork as lw

DARTS = ROBOTS.parent / "robodarts"


def reference(name):
    """A file of the reference; the test is skipped if it is missing, except in CI."""
    path = DARTS / name
    if not path.exists():
        assert "CI" not in os.environ, f"there is no {path}"
        pytest.skip(f"reference data are not at hand: {path.name}")
    return json.loads(path.read_text())


def load(path):
    return lw.load(path, "fixed", inertia_check="positive_moments")


def arm_of(n):
    """n hinges about alternating axes, without files."""
    builder, parent = lw.Builder(), "world"
    for k in range(n):
        hinge = lw.Hinge.pin(np.eye(3)[(2 * k + 2) % 3] + [0.1, 0.05, 0.2]).limits(-3, 3)
        builder = builder.body(f"b{k}", parent, hinge, mass=1, com=[0.1, 0, 0], inertia=np.eye(3) / 50, hinge_in_parent=[0.3, 0.02 * k, 0])
        parent = f"b{k}"
    return builder.build()


def ur5(**more):
    reference("ik_ur5.json")
    return lw.Robot(load(ROBOTS / "ur5.urdf"), chains={"arm": ("base_link", "ee_link")}, colliders=[], **more)


Q = [0.3, -1.2, 1.5, -0.9, 0.7, 0.2]


def test_golden_numbers_of_an_arm():
    robot = ur5(objects={"load": (2.0, [0, 0, 0.1], np.zeros((3, 3)))})
    robot.q = Q
    assert np.abs(robot.tip_pose("arm")[:3, 3] - [0.547120317375, 0.349386446631, 0.321176639129]).max() < 1e-11
    w, gradient = robot.manipulability("arm")
    assert w == pytest.approx(0.06236625851105, abs=1e-13)
    golden = [0, 0.021648125, -0.016363605, -0.008368477, 0.074043831, 0]
    assert np.abs(gradient - golden).max() < 1e-8
    assert robot.manipulability("arm", rows="linear")[0] == pytest.approx(0.13904487755451, abs=1e-12)
    J = robot.jacobian("arm")
    assert np.sqrt(np.linalg.det(J @ J.T)) == pytest.approx(w, rel=1e-10)
    bare = robot.gravity_forces()
    assert np.abs(bare - [0, -30.83968653, -15.08184583, -0.09851218, 0, 0]).max() < 1e-8
    mass = robot.center_of_mass()[0]
    with robot.grasp("arm", "load", np.eye(4)) as grip:
        assert repr(grip) == "Grip(arm holds load)" and robot.hands("load") == ["arm"]
        held = robot.gravity_forces()
        assert robot.center_of_mass()[0] == pytest.approx(mass + 2)
        assert (robot.feed_forward(np.zeros(6), np.zeros(6)) == held).all()
        force = robot.feed_forward(np.zeros(6), np.zeros(6), pushes={"arm": [0, 0, 0, 1, 2, 3]})
        assert np.abs(force - held - J.T @ [0, 0, 0, 1, 2, 3]).max() < 1e-12
    assert np.abs(held - [0, -43.96021717, -25.18085633, -2.84530561, 0.83912629, -0.50871720]).max() < 1e-8
    assert robot.hands("load") == [] and (robot.gravity_forces() == bare).all()
    M = robot.mass_matrix()
    assert np.allclose(M, load(ROBOTS / "ur5.urdf").mass_matrix(Q), atol=1e-12)


def test_targets_whole_and_in_part_are_met():
    robot = ur5()
    low, high = (np.array(reference("ik_ur5.json")[k]) for k in ("lower", "upper"))
    rng = np.random.default_rng(3)
    for _ in range(40):
        robot.q = rng.uniform(low, high)
        X = robot.tip_pose("arm")
        start = rng.uniform(low, high)
        for at in (X, X[:3, 3], X[:3, :3]):
            q = robot.inverse_kinematics("arm", at, q=start)
            assert (q >= low).all() and (q <= high).all()
            other = robot.copy()
            other.q = q
            Y = other.tip_pose("arm")
            if at.shape != (3, 3):
                assert np.abs(Y[:3, 3] - X[:3, 3]).max() < 2e-9
            if at.shape != (3,):
                assert np.abs(Y[:3, :3] - X[:3, :3]).max() < 4e-9
    with pytest.raises(lw.LinkworkError) as e:
        robot.inverse_kinematics("arm", [3.0, 0, 0], q=np.clip(np.zeros(6), low, high))
    p, turn = e.value.residual
    assert p > 1.5 and turn == 0 and "remaining error" in str(e.value)
    other.q = e.value.q
    assert np.linalg.norm(other.tip_pose("arm")[:3, 3] - [3, 0, 0]) == pytest.approx(p, abs=1e-9)


@pytest.mark.parametrize("portion", [1, 7, 10_000])
def test_a_search_goes_on_in_portions_to_the_same_bits(portion):
    m = arm_of(5)
    robot = lw.Robot(m, chains={"arm": ("world", "b4")}, objects={"load": (1.0, [0, 0, 0], np.eye(3) / 100)}, colliders=[])
    rng = np.random.default_rng(5)
    unfinished = 0
    for _ in range(20):
        robot.q = rng.uniform(-2, 2, 5)
        at, start = robot.tip_pose("arm")[:3, 3], rng.uniform(-2, 2, 5)
        search = robot.begin_inverse_kinematics("arm", at, q=start, orientation_tolerance=1e-3)
        assert (search.outcome, search.kinematics, search.restart, search.residual) == ("unfinished", 0, 0, None)
        assert (search.q == start).all() and not search.advance(0)
        # The search does not depend on later changes of the robot.
        robot.q = np.zeros(5)
        while not search.advance(portion):
            unfinished += 1
            assert search.outcome == "unfinished" and search.q.shape == (5,)
        assert search.outcome == "met" and max(search.residual) <= 1e-9
        assert (search.solution() == robot.inverse_kinematics("arm", at, q=start)).all()
        done = search.kinematics
        assert search.advance() and search.kinematics == done
    assert unfinished > 0 or portion > 100


def test_a_search_that_ends_nowhere_tells_the_nearest():
    robot = lw.Robot(arm_of(3), chains={"arm": ("world", "b2")}, colliders=[])
    search = robot.begin_inverse_kinematics("arm", [9, 0, 0], q=[0.3, 0.3, 0.3])
    assert not search.advance(5) and search.kinematics == 5
    with pytest.raises(lw.LinkworkError, match="has not ended after 5") as e:
        search.solution()
    assert (e.value.q == search.q).all() and not hasattr(e.value, "residual")
    while not search.advance():
        pass
    with pytest.raises(lw.LinkworkError) as at_once:
        robot.inverse_kinematics("arm", [9, 0, 0], q=[0.3, 0.3, 0.3])
    with pytest.raises(lw.LinkworkError, match="remaining error") as e:
        search.solution()
    assert search.outcome == "nearest" and (e.value.q == at_once.value.q).all()
    assert e.value.residual == at_once.value.residual == search.residual
    with pytest.raises(lw.LinkworkError, match="0 or more"):
        search.advance(-1)
    for wrong, words in [({"part": "leg"}, "no part"), ({"at": [0.1, 0.2]}, "shape"), ({"q": [9.0, 0, 0]}, "limits"), ({"position_tolerance": 0.0}, "above zero")]:
        with pytest.raises(lw.LinkworkError, match=words):
            robot.begin_inverse_kinematics(**{"part": "arm", "at": [0.1, 0.2, 0.0], **wrong})


def test_threads_share_a_search():
    robot = lw.Robot(arm_of(3), chains={"arm": ("world", "b2")}, colliders=[])
    search = robot.begin_inverse_kinematics("arm", [9, 0, 0], q=[0.3, 0.3, 0.3])

    def go(_):
        while not search.advance(3):
            pass

    with ThreadPoolExecutor(4) as pool:
        list(pool.map(go, range(4)))
    alone = robot.begin_inverse_kinematics("arm", [9, 0, 0], q=[0.3, 0.3, 0.3])
    assert alone.advance(10**9) and (alone.q == search.q).all() and alone.kinematics == search.kinematics


def test_all_solutions_of_arms_with_a_closed_form():
    robot = ur5()
    low, high = (np.array(reference("ik_ur5.json")[k]) for k in ("lower", "upper"))
    rng = np.random.default_rng(4)
    for _ in range(40):
        robot.q = rng.uniform(low, high)
        X, other = robot.tip_pose("arm"), robot.copy()
        every = robot.inverse_kinematics_all("arm", X)
        assert 1 <= len(every) <= 8 and np.abs(every[0] - robot.q).max() < 1e-6
        assert (np.diff(((every - robot.q) ** 2).sum(axis=1)) >= 0).all()
        for q in every:
            assert (q >= low).all() and (q <= high).all()
            other.q = q
            assert np.abs(other.tip_pose("arm") - X).max() < 4e-9
    X[0, 3] = 5
    assert robot.inverse_kinematics_all("arm", X).shape == (0, 6)
    seven = lw.Robot(load(ROBOTS / "iiwa7.urdf"), chains={"arm": ("world", "lbr_iiwa_link_7")}, colliders=[])
    seven.q = [0.3, 0.5, -0.4, 1.1, 0.2, -0.7, 0.9]
    for held in (None, 2, 4):
        every = seven.inverse_kinematics_all("arm", seven.tip_pose("arm"), held=held)
        assert np.abs(every[0] - seven.q).max() < 1e-6
        assert (every[:, 2 if held is None else held] == seven.q[2 if held is None else held]).all()


def dual():
    data = reference("dual_ur5_beam.json")
    beam = data["beam"]
    chains = {s: (f"{s}_base_link", f"{s}_tcp") for s in ("left", "right")}
    mass = (beam["mass"], [0, 0, 0], np.diag(beam["inertia_diagonal"]))
    shapes = [lw.Collider.sphere(s, f"{s}_tcp", 0.03) for s in ("left", "right")]
    shapes.append(lw.Collider.box("beam", "beam", [0.04, 0.4, 0.04]))
    m = load(DARTS / "dual_ur5.urdf")
    groups = {"left_gripper": ["left_finger_a", "left_finger_b"]}
    return data, m, lw.Robot(m, chains=chains, groups=groups, objects={"beam": mass}, colliders=shapes)


def test_two_hands_share_a_load_and_leave_no_trace():
    data, m, robot = dual()
    case = data["cases"][0]
    q = np.zeros(m.nq)
    for joint, x in zip(data["dof"], case["q"], strict=True):
        q[m.joints[joint]] = x
    robot.q = q
    before = [robot.gravity_forces().tolist(), robot.mass_matrix().tolist(), robot.hits(q)]
    met = [robot.looks_at("beam", s) for s in ("left", "right")]
    X = {s: inverse(data["beam"][f"{s}_tip_in_beam"]) for s in ("left", "right")}
    robot.grasp("left", "beam", X["left"])
    robot.grasp("right", "beam", X["right"])
    assert robot.hands("beam") == ["left", "right"]
    assert not robot.looks_at("beam", "left") and not robot.looks_at("beam", "right")
    tau = robot.gravity_forces()
    for key in ("equal", "effort"):
        shared, share = robot.balance("beam", tau, by=key)
        J = [whole(robot, m, s) for s in ("left", "right")]
        p = robot.object_pose("beam")[:3, 3]
        C = J[0](p) - J[1](p)
        # The difference does no work in the closed loop: it is in the row space of C.
        off = shared - tau
        fit = np.linalg.lstsq(C.T, off, rcond=None)[0]
        assert np.abs(C.T @ fit - off).max() < 1e-9 * np.abs(off).max()
    assert share == pytest.approx(0.2574, abs=5e-5)
    there = robot.object_pose("beam")
    robot.release("left", "beam")
    assert robot.hands("beam") == ["right"] and np.abs(robot.object_pose("beam") - there).max() < 1e-9
    robot.ungrasp("beam")
    robot.put("beam", np.eye(4))
    assert [robot.gravity_forces().tolist(), robot.mass_matrix().tolist(), robot.hits(q)] == before
    assert [robot.looks_at("beam", s) for s in ("left", "right")] == met
    assert robot.parts["left_gripper"] == ["left_finger_a", "left_finger_b"] and robot.objects == ["beam"]


def tips(robot, q):
    other = robot.copy()
    other.q = q
    return [other.tip_pose(s) for s in ("left", "right")]


def test_two_tips_at_once_in_the_world_and_as_one_sees_the_other():
    _, m, robot = dual()
    rng = np.random.default_rng(7)
    low, high = np.clip(m.position_limits, -2.6, 2.6)
    for _ in range(6):
        left, right = tips(robot, rng.uniform(low, high))
        robot.q = rng.uniform(low, high)
        between = np.linalg.inv(left) @ right
        for goals in ({"left": left, "right": right}, [lw.Target("left", left), lw.Target("right", between, relative_to="left")]):
            search = robot.begin_inverse_kinematics_together(goals)
            assert search.residuals is None
            while not search.advance(7):
                pass
            q = robot.inverse_kinematics_together(goals)
            assert search.outcome == "met" and (search.q == q).all() and len(search.residuals) == 2
            assert search.kinematics <= robot.worst_case_steps(together=True)
            for X, Y in zip(tips(robot, q), (left, right), strict=True):
                assert np.abs(X - Y).max() < 1e-8
    # The target is in the base of the arm, and the other arm is fixed.
    start = robot.q
    near = tips(robot, start)[0][:3, 3] * 0.95
    q = robot.inverse_kinematics_together({"left": near}, keep=["right"])
    assert (q[robot.dofs("right")] == start[robot.dofs("right")]).all() and np.abs(tips(robot, q)[0][:3, 3] - near).max() < 2e-9
    alone = robot.inverse_kinematics("left", [0.3, 0.2, 0.4], in_base=True)
    both = robot.inverse_kinematics_together({"left": [0.3, 0.2, 0.4]}, in_base=["left"])
    assert np.abs(tips(robot, alone)[0][:3, 3] - tips(robot, both)[0][:3, 3]).max() < 4e-9
    with pytest.raises(lw.LinkworkError, match="the tips of `left`, `right` do not reach their goals") as e:
        robot.inverse_kinematics_together({"left": [5, 0, 0], "right": right}, restarts=2)
    assert e.value.q.shape == (m.nq,) and e.value.residual[0] > 3
    liked, cost = robot.inverse_kinematics_together_best({"left": near}, starts=3)
    assert np.abs(tips(robot, liked)[0][:3, 3] - near).max() < 2e-9 and cost < 1
    for wrong, words in [
        ({"targets": {"leg": near}}, "no part `leg`"),
        ({"targets": {"left": [1, 2]}}, "shape"),
        ({"targets": [lw.Target("left", near, relative_to="left")]}, "relative to itself"),
        ({"targets": [lw.Target("left", near, relative_to="right")], "in_base": ["left"]}, "both in its base and relative to a tip"),
        ({"keep": ["leg"]}, "no part `leg`"),
        ({"q": np.full(m.nq, 9.0)}, "limits"),
        ({"orientation_tolerance": 0.0}, "above zero"),
    ]:
        with pytest.raises(lw.LinkworkError, match=words):
            robot.inverse_kinematics_together(**{"targets": {"left": near}, **wrong})


def test_what_two_hands_hold_stays_held_while_it_is_moved():
    data, m, robot = dual()
    q = np.zeros(m.nq)
    for joint, x in zip(data["dof"], data["cases"][0]["q"], strict=True):
        q[m.joints[joint]] = x
    robot.q = q
    for side in ("left", "right"):
        robot.grasp(side, "beam", inverse(data["beam"][f"{side}_tip_in_beam"]))
    left, right = tips(robot, q)
    between = np.linalg.inv(left) @ right
    for shift, met in [([0, 0.02, 0.05], True), ([0.02, -0.03, 0.01], True), ([4, 0, 0], False)]:
        goal = left.copy()
        goal[:3, 3] += shift
        if met:
            there = robot.inverse_kinematics_together({"left": goal})
        else:
            with pytest.raises(lw.LinkworkError, match="the tip of `left` does not reach its goal") as e:
                robot.inverse_kinematics_together({"left": goal}, restarts=4)
            there = e.value.q
        X, Y = tips(robot, there)
        assert np.abs(np.linalg.inv(X) @ Y - between).max() < 1e-8
        assert (np.abs(X - goal).max() < 1e-8) == met
    # Only one wrist may move, and the hands are apart.
    off = q.copy()
    off[robot.dofs("left")[0]] += 0.1
    search = robot.begin_inverse_kinematics_together({}, q=off, keep=["left", "right"])
    assert search.advance(10**6) and search.outcome == "open"
    with pytest.raises(lw.LinkworkError, match="the grasp of object 0 by two hands cannot be closed") as e:
        search.solution()
    assert e.value.residual == search.residual and search.residual[0] > 0.01 and (e.value.q == search.q).all()
    X, Y = tips(robot, search.q)
    seen = np.linalg.inv(X) @ Y
    assert np.linalg.norm(seen[:3, 3] - between[:3, 3]) == pytest.approx(search.residual[0], abs=1e-9)
    assert robot.worst_case_steps(together=True, restarts=0) > robot.worst_case_steps(restarts=0) > 0
    with pytest.raises(lw.LinkworkError, match="above zero"):
        robot.worst_case_steps(weight=0.0)


def test_a_robot_keeps_what_is_coupled():
    parts, parent = lw.Builder(), "world"
    for k, axis in enumerate(([0, 0, 1], [0, 1, 0], [0, 1, 0], [0, 1, 0])):
        hinge = lw.Hinge.pin(axis).limits(-2, 2)
        parts = parts.body(f"b{k}", parent, hinge, mass=1, com=[0.1, 0, 0], inertia=np.eye(3) / 50, hinge_in_parent=[0.4 * (k > 1), 0, 0])
        parent = f"b{k}"
    m = parts.coupling("level", {"b2": 1.0, "b3": 1.0}, 0.2).build()
    robot = lw.Robot(m, chains={"arm": ("world", "b3"), "turn": ("world", "b0")}, colliders=[])
    at = [0.35, 0.2, 0.3]
    q = robot.inverse_kinematics_together({"arm": at}, q=[0.1, 0.2, 0.4, -0.2])
    robot.q = q
    assert np.abs(robot.tip_pose("arm")[:3, 3] - at).max() < 2e-9 and abs(q[2] + q[3] - 0.2) < 2e-9
    with pytest.raises(lw.LinkworkError, match="remaining error") as e:
        robot.inverse_kinematics_together({"arm": [3, 0, 0]})
    assert abs(e.value.q[2] + e.value.q[3] - 0.2) < 2e-9
    for refused in (lambda: robot.inverse_kinematics("arm", at), lambda: robot.plan("arm", q, q), lambda: robot.joint_rates("arm", np.zeros(6))):
        with pytest.raises(lw.LinkworkError, match="does not support coupling 0"):
            refused()
    assert robot.inverse_kinematics("turn", axis=[1, 0, 0], along=[1, 1, 0])[0] == pytest.approx(np.pi / 4)


def inverse(x):
    """The pose (4, 4) that inverts x y z qx qy qz qw."""
    R = matrix_of(x[3:])
    X = np.eye(4)
    X[:3, :3], X[:3, 3] = R.T, -R.T @ np.array(x[:3])
    return X


def whole(robot, m, side):
    """The Jacobian (6, nv) of a tip about a point of the world, over all degrees of freedom."""
    J = m.node_jacobian(robot.q, f"{side}_tcp")

    def about(p):
        r = p - robot.tip_pose(side)[:3, 3]
        out = J.copy()
        out[3:] += np.cross(J[:3].T, r).T
        return out

    return about


def planar():
    parts = lw.Builder()
    for link, parent, at in (("upper", "world", 0.0), ("lower", "upper", 0.5)):
        hinge = lw.Hinge.pin([0, 0, 1]).limits(-3, 3)
        parts = parts.body(link, parent, hinge, mass=1, inertia=np.eye(3), hinge_in_parent=[at, 0, 0])
    shapes = [lw.Collider.box(b, b, [0.46, 0.04, 0.04], at=[0.25, 0, 0]) for b in ("upper", "lower")]
    shapes += [lw.Collider.box(n, "world", [0.1, 1.0, 0.2], at=[0.75, y, 0]) for n, y in (("above", 0.6), ("below", -0.6))]
    return lw.Robot(parts.build(), chains={"arm": ("world", "lower")}, colliders=shapes)


def test_ways_are_free_and_the_same_each_time():
    robot = planar()
    start, goal = [1.6, -0.4], [-1.6, 0.4]
    assert robot.path(start, goal)[0] == "hit"
    way = robot.plan("arm", goal, start)
    assert way[0].tolist() == start and way[-1].tolist() == goal and len(way) > 2
    for a, b in zip(way[:-1], way[1:], strict=True):
        assert robot.path(a, b) == ("free", None, None)
    assert (robot.plan("arm", goal, start) == way).all()
    with pytest.raises(lw.LinkworkError, match="no path of"):
        robot.plan("arm", goal, start, room=3, step=0.01)
    with pytest.raises(lw.LinkworkError, match="at the goal"):
        robot.plan("arm", [0.9, -0.4], start)
    assert robot.is_valid(start) and not robot.is_valid([0.9, -0.4]) and not robot.is_valid([3.1, 0.0])


def test_forces_of_two_hands_and_of_tips_are_those_of_the_reference():
    data, m, robot = dual()
    case = data["cases"][0]
    place = [m.joints[j].start for j in data["dof"]]
    q = np.zeros(m.nq)
    q[place] = case["q"]
    robot.q = q
    for side in ("left", "right"):
        robot.grasp(side, "beam", inverse(data["beam"][f"{side}_tip_in_beam"]))
    tau, wrenches = robot.squeeze("beam", np.zeros(m.nv), 20.0)
    golden = case["squeeze_20N"]
    assert np.abs(wrenches.ravel() - golden["wrenches"]).max() < 1e-9
    assert np.abs(tau[place] - golden["tau"]).max() < 1e-9
    given = np.reshape(case["given_wrenches"], (2, 6))
    for golden in case["move_squeeze"]:
        moment = golden["moment_weight_per_force_weight"]
        moving, squeezing, net = robot.split_hand_wrenches("beam", given, hands=tuple(golden["weights"]), moment=moment)
        assert np.abs(moving.ravel() - golden["move"]).max() < 1e-9
        assert np.abs(squeezing.ravel() - golden["squeeze"]).max() < 1e-9 and np.allclose(moving + squeezing, given)
        assert np.abs(net[3:] - given[:, 3:].sum(axis=0)).max() < 1e-12
    robot.ungrasp("beam")
    golden = case["task_control"]
    tau = robot.task_forces(["left"], np.zeros(m.nv), golden["acceleration"])
    assert np.abs(tau[place] - golden["tau"]).max() < 1e-8 * np.abs(tau).max()
    A = np.linalg.inv(robot.task_inertia(["left", "right"]))
    assert np.abs(A - case["osim"]["compliance"]).max() < 1e-8 * np.abs(A).max()
    # Additional forces do not move the tip: (J M⁻¹) of the difference is zero.
    rest = np.linspace(-1, 1, m.nv)
    more = robot.task_forces(["left"], np.zeros(m.nv), golden["acceleration"], rest) - tau
    J = m.node_jacobian(q, "left_tcp")
    assert np.abs(J @ np.linalg.solve(robot.mass_matrix(), more)).max() < 1e-9 < np.abs(more).max()


def trimmers(free=True, builder=None, parent="world", at=None):
    """Handles on a pin, and a ring that slides on the second; alone, or on a body of another mechanism."""
    parts = builder or lw.Builder()
    hinge = lw.Hinge.free() if free else lw.Hinge.locked()
    parts.body("handle", parent, hinge, mass=0.45, com=[0.05, 0.01, 0.02], inertia=np.diag([1, 2, 2.5]) * 1e-3, hinge_in_parent=at)
    inertia = np.array([[2, 0.1, 0], [0.1, 1, 0.2], [0, 0.2, 2.5]]) * 1e-3
    parts.body("jaw", "handle", lw.Hinge.pin([0, 0.6, 0.8]), mass=0.4, com=[0.08, -0.02, 0.01], inertia=inertia, hinge_in_parent=[0.03, 0, 0.01])
    return parts.body("ring", "jaw", lw.Hinge.slider([1, 0, 0]), mass=0.1, com=[0, 0, 0.01], inertia=np.eye(3) * 1e-4, hinge_in_parent=[0.05, 0, 0])


AT = np.array([0.1, 0.02, -0.05, *(np.array([0.3, -0.2, 0.1, 0.9]) / np.linalg.norm([0.3, -0.2, 0.1, 0.9]))])


def chain():
    parts, parent = lw.Builder(), "world"
    for k, name in enumerate(("one", "two", "hand")):
        inertia = np.diag([0.02, 0.03, 0.04])
        parts.body(name, parent, lw.Hinge.pin(np.eye(3)[(k + 1) % 3]).limits(-3, 3), mass=1.5, com=[0.2, 0, 0.1], inertia=inertia, hinge_in_parent=[0.3 * (k > 0), 0, 0])
        parent = name
    return parts


def test_an_object_with_joints_is_the_same_as_a_mechanism_that_has_it():
    m = chain().build()
    shapes = [lw.Collider.sphere("tip of jaw", "jaw", 0.02, at=[0.2, 0, 0]), lw.Collider.sphere("post", "world", 0.02, at=[9, 9, 9])]
    robot = lw.Robot(m, chains={"arm": ("world", "hand")}, objects={"handle": trimmers().build()}, colliders=shapes)
    whole = trimmers(free=False, builder=chain(), parent="hand", at=AT).build()
    rng = np.random.default_rng(11)
    q, v, a = (rng.uniform(-1, 1, 3) for _ in range(3))
    theta, rates, more = (rng.uniform(-0.5, 0.5, 2) for _ in range(3))
    robot.q = q
    assert robot.object_bodies("handle") == ["handle", "jaw", "ring"] and robot.object_q("handle").tolist() == [0, 0]
    before = (robot.gravity_forces().tolist(), robot.mass_matrix().tolist(), robot.center_of_mass()[0])
    places = [whole.coordinates(b)[1] for b in ("one", "two", "hand", "jaw", "ring")]
    place = np.array([p if isinstance(p, int) else p.start for p in places])

    def both(x, y):
        out = np.zeros(5)
        out[place] = np.concatenate([x, y])
        return out

    Q = both(q, theta)
    with robot.grasp("arm", "handle", AT):
        robot.set_object_q("handle", theta)
        assert robot.object_q("handle").tolist() == theta.tolist()
        tau, forces = robot.feed_forward_with_object("handle", v, a, rates, more)
        want = whole.inverse_dynamics(Q, both(v, rates), both(a, more))[place]
        assert np.abs(np.concatenate([tau, forces]) - want).max() < 1e-12 * np.abs(want).max()
        M = whole.mass_matrix(Q)[np.ix_(place, place)]
        assert np.abs(robot.mass_matrix_with_object("handle") - M).max() < 1e-12 * np.abs(M).max()
        still = whole.inverse_dynamics(Q, np.zeros(5), np.zeros(5))[place]
        assert np.abs(robot.gravity_forces() - still[:3]).max() < 1e-12 * np.abs(still).max()
        state = whole.state(Q, np.zeros(5))
        for body in ("handle", "jaw", "ring"):
            assert np.abs(robot.object_body_pose("handle", body) - state.pose(body)).max() < 1e-12
        tip = state.pose("jaw") @ [0.2, 0, 0, 1]
        d, _ = robot.distance(q, "tip of jaw", "post")
        assert d == pytest.approx(np.linalg.norm(tip[:3] - 9) - 0.04, abs=1e-12)
        there = robot.object_body_pose("handle", "ring")
        other = robot.copy()
        other.set_object_q("handle", [0, 0])
        assert robot.object_q("handle").tolist() == theta.tolist() and other.gravity_forces().tolist() != robot.gravity_forces().tolist()
    # The released object stays where it is, and its weight loads no arm.
    assert np.abs(robot.object_body_pose("handle", "ring") - there).max() < 1e-15
    assert (robot.gravity_forces().tolist(), robot.mass_matrix().tolist(), robot.center_of_mass()[0]) == before
    robot.put("handle", np.eye(4))
    robot.set_object_q("handle", [0, 0])
    assert robot.object_body_pose("handle", "jaw")[:3, 3].tolist() == [0.03, 0, 0.01]


def test_objects_with_joints_that_cannot_be_are_refused():
    m, help = chain().build(), "help"
    two = lw.Builder().body("a", "world", lw.Hinge.free(), mass=1, inertia=np.eye(3)).body("b", "world", lw.Hinge.free(), mass=1, inertia=np.eye(3))
    pinned = lw.Builder().body("tool", "world", lw.Hinge.pin([0, 0, 1]), mass=1, inertia=np.eye(3))
    looped = trimmers().body("link", "handle", lw.Hinge.pin([0, 0, 1]), mass=0.1, inertia=np.eye(3) * 1e-4)
    looped = looped.loop("shut", "link", "ring", lw.Hinge.pin([0, 0, 1]))
    taken = trimmers().body("hand", "ring", lw.Hinge.pin([0, 0, 1]), mass=0.1, inertia=np.eye(3) * 1e-4)
    for name, given, words in (
        ("pliers", trimmers(), "its body on the world is `handle`"),
        ("a", two, "2 of its bodies are on the world"),
        ("tool", pinned, "1 degrees of freedom"),
        ("handle", looped, "loop `shut`"),
        ("handle", taken, "hand"),
    ):
        with pytest.raises(lw.LinkworkError, match=words) as e:
            lw.Robot(m, colliders=[], objects={name: given.build()})
        assert help in str(e.value)
    cup = (1.0, [0, 0, 0], np.eye(3))
    robot = lw.Robot(m, chains={"arm": ("world", "hand")}, objects={"handle": trimmers().build(), "cup": cup}, colliders=[])
    zero, two_zeros = np.zeros(3), np.zeros(2)
    for call, words in (
        (lambda: robot.set_object_q("cup", [0.1]), "no joints"),
        (lambda: robot.set_object_q("handle", [0.1]), "2"),
        (lambda: robot.set_object_q("handle", [0.1, np.nan]), "nan"),
        (lambda: robot.object_body_pose("handle", "jwa"), "jaw"),
        (lambda: robot.object_body_pose("cup", "lid"), "no body"),
        (lambda: robot.object_bodies("cpu"), "cup"),
        (lambda: robot.feed_forward_with_object("cup", zero, zero, [], []), "no joints"),
        (lambda: robot.feed_forward_with_object("handle", zero, zero, two_zeros, two_zeros), "not held"),
        (lambda: robot.feed_forward_with_object("handle", zero, zero, zero, two_zeros), "rates"),
        (lambda: robot.mass_matrix_with_object("handle"), "not held"),
        (lambda: robot.squeeze("cup", zero, 1.0), "not held"),
        (lambda: robot.split_hand_wrenches("cup", np.zeros((2, 5))), "(2, 6)"),
        (lambda: robot.grip("cup", np.zeros((2, 5)), friction=[([1, 0, 0], 0.5, 0.02, 9.0)] * 2), "(2, 6)"),
        (lambda: robot.task_inertia([]), "parts"),
        (lambda: robot.task_forces(["arm"], zero, np.zeros(6)), "no solution"),
        (lambda: robot.feed_forward([1e200] * 3, zero), "overflowed"),
    ):
        with pytest.raises(lw.LinkworkError) as e:
            call()
        assert words in str(e.value).lower()


def test_gravity_is_that_of_the_mechanism():
    m = chain().build()
    m.gravity = [0, 0, -1.62]
    robot = lw.Robot(m, colliders=[], chains={"arm": ("world", "hand")})
    robot.q = [0.1, 0.2, 0.3]
    assert np.abs(robot.gravity_forces() - m.bias_forces([0.1, 0.2, 0.3], np.zeros(3))).max() < 1e-14


def test_a_prediction_is_the_midpoint_step_and_spreads_as_its_slopes_say():
    m = lw.Builder()
    for link, parent in (("upper", "world"), ("lower", "upper")):
        m = m.body(link, parent, lw.Hinge.pin([0, 1, 0]), mass=2, com=[0.2, 0, 0], inertia=0.02 * np.eye(3), hinge_in_parent=[0.4, 0, 0])
    m = m.build()
    robot = lw.Robot(m, chains={"arm": ("world", "lower")}, colliders=[])
    q, v, tau, h = np.array([0.3, -0.5]), np.array([0.7, 0.2]), np.array([1.0, -0.4]), 0.02

    def step(x):
        q, v = x[:2], x[2:]
        half = v + h / 2 * m.forward_dynamics(q, v, tau)
        return np.concatenate([q + h * half, v + h * m.forward_dynamics(q + h / 2 * v, half, tau)])

    x = np.concatenate([q, v])
    slopes = np.column_stack([(step(x + e) - step(x - e)) / 2e-6 for e in 1e-6 * np.eye(4)])
    P = np.diag([1e-4, 2e-4, 3e-3, 4e-3])
    after = robot.predict(q, v, tau, h, P)
    assert np.allclose(np.concatenate(after[:2]), step(x), atol=1e-13)
    assert np.allclose(after[2], slopes @ P @ slopes.T, rtol=1e-6, atol=1e-12)
    noisy = robot.predict(q, v, tau, h, P, density=[0.1, 0.2])[2] - after[2]
    inverse = m.inverse_mass_matrix(q + h / 2 * v)
    assert np.allclose(noisy[2:, 2:], h * inverse @ np.diag([0.1, 0.2]) @ inverse, rtol=1e-12)
    assert (robot.q == 0).all()


def three(**more):
    """Three links in a plane, with shapes."""
    links = lw.Builder()
    for name, parent in [("upper", "world"), ("lower", "upper"), ("hand", "lower")]:
        at = [0, 0, 0] if parent == "world" else [0.4, 0, 0]
        hinge = lw.Hinge.pin([0, -1, 0]).limits(-3, 3, rate=2.0)
        links = links.body(name, parent, hinge, mass=1, com=[0.2, 0, 0], inertia=np.eye(3) / 100, hinge_in_parent=at)
    return lw.Robot(links.build(), chains={"arm": ("world", "hand")}, **more)


def test_the_solution_that_is_liked_best():
    robot = three(colliders=[])
    at, q = [0.6, 0, 0.2], [0.3, 0.3, 0.3]
    cost = lambda x: 0.5 * ((x / 6) ** 2).sum()  # noqa: E731
    first = robot.inverse_kinematics("arm", at, q=q)
    best, told = robot.inverse_kinematics_best("arm", at, q=q, starts=12)
    assert told == pytest.approx(cost(best), rel=1e-9) and told <= cost(first)
    # No motion along the null space has a lower cost.
    other = robot.copy()
    other.q = best
    assert np.abs(other.tip_pose("arm")[:3, 3] - at).max() < 1e-8
    J = other.jacobian("arm")[[3, 5]]
    along = np.linalg.svd(J)[2][-1]
    assert abs(along @ best) / 36 < 1e-5
    moves, w = robot.inverse_kinematics_best("arm", at, q=q, centred=0, manipulable=1, length=0.5)
    other.q = moves
    assert -np.log(other.manipulability("arm", length=0.5)[0]) == pytest.approx(w, rel=1e-6)
    assert (robot.q == 0).all()
    with pytest.raises(lw.LinkworkError, match="from any of 3 starts") as e:
        robot.inverse_kinematics_best("arm", [3.0, 0, 0], q=q, starts=3)
    assert e.value.q.shape == (3,)
    for wrong in ({"centred": -1.0}, {"centred": 0.0}, {"length": 0.0}, {"starts": 0}, {"improve": 10**6}, {"manipulable": np.nan}):
        with pytest.raises(lw.LinkworkError):
            robot.inverse_kinematics_best("arm", at, q=q, **wrong)


def test_rates_of_a_tip():
    robot = three(colliders=[])
    robot.q = [0.3, 0.5, 0.4]
    J = robot.jacobian("arm")
    twist = J @ [0.1, -0.2, 0.3]
    v, missing = robot.joint_rates("arm", twist)
    assert np.abs(J @ v - twist).max() < 1e-9 and max(missing) < 1e-9
    # The arm is planar, so motions out of the plane are missing; rates stay within their limits.
    v, (linear, angular) = robot.joint_rates("arm", [0, 0, 0, 0, 0.2, 0])
    assert linear == pytest.approx(0.2) and angular < 1e-9
    v, (linear, _) = robot.joint_rates("arm", 50 * twist)
    assert np.abs(v).max() <= 2.0 + 1e-12 and linear > 0.1
    for wrong in (["leg", twist], ["arm", twist[:5]], ["arm", [np.nan] * 6]):
        with pytest.raises(lw.LinkworkError):
            robot.joint_rates(*wrong)


def test_a_battery_goes_with_its_driver():
    block = dict(mass=0.4, com=[0, 0, 0], inertia=np.eye(3) / 1000)
    arm = lw.Builder().body("a", "world", lw.Hinge.pin([0, 1, 0]), mass=1, com=[0.2, 0, 0], inertia=np.eye(3) / 100)
    arm = arm.body("hand", "a", lw.Hinge.pin([0, 1, 0]), hinge_in_parent=[0.4, 0, 0], mass=1, com=[0.1, 0, 0], inertia=np.eye(3) / 100).build()
    objects = {"driver": (0.8, [0, 0, 0], np.eye(3) / 1000), "battery": (0.4, [0, 0, 0], np.eye(3) / 1000)}
    robot = lw.Robot(arm, chains={"arm": ("world", "hand")}, objects=objects, colliders=[])
    bare = robot.gravity_forces()
    robot.attach("battery", "driver", at=[0, 0, -0.1])
    robot.grasp("arm", "driver", [0.3, 0, 0])
    assert np.allclose(robot.object_pose("battery")[:3, 3], [0.7, 0, -0.1], atol=1e-15)
    load = robot.gravity_forces() - bare
    assert np.allclose(load, [-1.2 * 9.81 * 0.7, -1.2 * 9.81 * 0.3], atol=1e-12)
    robot.update_grasp("arm", "driver", [0.35, 0, 0])
    assert np.allclose(robot.object_pose("battery")[:3, 3], [0.75, 0, -0.1], atol=1e-15)
    with pytest.raises(lw.LinkworkError, match="attached to object 0"):
        robot.grasp("arm", "battery")
    robot.detach("battery")
    robot.ungrasp("driver")
    assert robot.gravity_forces().tobytes() == bare.tobytes()
    # The object is attached to a jaw, and moves with it.
    body = lw.Builder().body("pliers", "world", lw.Hinge.free(), **block)
    pliers = body.body("jaw", "pliers", lw.Hinge.pin([0, 0, 1]), **block).build()
    fitter = lw.Robot(arm, chains={"arm": ("world", "hand")}, objects={"pliers": pliers, "nut": (0.1, [0, 0, 0], np.eye(3) / 1e4)}, colliders=[])
    fitter.attach("nut", "pliers", "jaw", [0.1, 0, 0])
    fitter.set_object_q("pliers", [np.pi / 2])
    assert np.allclose(fitter.object_pose("nut")[:3, 3], [0, 0.1, 0], atol=1e-15)


def test_ellipsoid_bias_and_forces_of_two_hands():
    arm = lw.Builder().body("a", "world", lw.Hinge.pin([0, 0, 1]), mass=1, com=[0.2, 0, 0], inertia=np.eye(3) / 100)
    arm = arm.body("hand", "a", lw.Hinge.pin([0, 0, 1]), hinge_in_parent=[0.4, 0, 0], mass=1, com=[0.1, 0, 0], inertia=np.eye(3) / 100).build()
    robot = lw.Robot(arm, chains={"arm": ("world", "hand")}, objects={}, colliders=[])
    robot.q = [0.3, 0.7]
    J = robot.jacobian("arm")
    half, directions = robot.ellipsoid("arm", rows="linear")
    U, s, _ = np.linalg.svd(J[3:])
    assert np.allclose(half[: len(s)], s, atol=1e-12)
    assert np.allclose(np.abs(np.sum(U * directions, axis=0))[:1], 1, atol=1e-9)
    v = np.array([0.4, -0.9])
    tau, tips = robot.bias(v, ["arm"])
    assert np.allclose(tau, robot.feed_forward(v, [0, 0]), atol=1e-14)
    # The tip moves on a circle about its base, so its acceleration points to the base.
    expected = [0, 0, 0, -0.4 * np.cos(0.3) * v[0] ** 2, -0.4 * np.sin(0.3) * v[0] ** 2, 0]
    assert np.allclose(tips[0], expected, atol=1e-14)
    assert np.array_equal(robot.jacobian("arm", whole=True), J)
