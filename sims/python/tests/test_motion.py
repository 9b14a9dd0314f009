"""Timed motions, prioritized control, calibration: the same as the Rust crates, from Python."""

import math

import numpy as np
import pytest

import linkwork as lw


def arm(n=3, effort=60.0):
    builder, parent = lw.Builder(), "world"
    for k in range(n):
        axis = np.eye(3)[(k + 1) % 3] + 0.1 * np.array([1, -1, 0.5])
        hinge = lw.Hinge.pin(axis / np.linalg.norm(axis)).limits(-2.8, 2.8, rate=2.0 + 0.1 * k, effort=effort)
        at = [0, 0, 0] if k == 0 else [0.3, 0.02, 0.05]
        builder = builder.body(f"b{k}", parent, hinge, mass=2.0 - 0.2 * k, com=[0.15, 0.01, 0.02], inertia=np.diag([0.01, 0.02, 0.03]), hinge_in_parent=at)
        parent = f"b{k}"
    return builder.node("tip", parent, [0.3, 0, 0]).build()


def robot(n=3, **more):
    options = {"colliders": [], **more}
    return lw.Robot(arm(n), chains={"arm": ("world", f"b{n - 1}")}, objects={"cup": (0.8, [0, 0, 0.1], np.eye(3) / 100)}, **options)


WAY = np.array([[0.1, 0.3, -0.4], [0.9, -0.5, 0.3], [1.2, 0.4, 1.1]])


@pytest.mark.parametrize("round", [0.0, 0.1])
@pytest.mark.parametrize("held", [False, True])
def test_a_timed_way_keeps_its_limits_and_uses_them(round, held):
    r, m = robot(), arm()
    if held:
        r.grasp("arm", "cup")
    motion = r.time_parameterize(WAY, acceleration=20.0, round=round, sections=600)
    t = np.linspace(0, motion.duration, 3001)
    q, v, a = motion.at(t)
    assert np.array_equal(q[0], WAY[0]) and np.allclose(q[-1], WAY[-1], atol=1e-12) and not v[[0, -1]].any()
    tau = []
    for q_, v_, a_ in zip(q, v, a):
        r.q = q_
        tau.append(r.feed_forward(v_, a_))
    shares = np.max(np.abs(np.hstack([v / m.rate_limits, a / 20.0, np.array(tau) / m.effort_limits])), axis=1)
    assert shares.max() <= 1 + 1e-9
    assert (shares[1:-1] < 0.99).mean() < 0.02
    one = motion.at(0.4 * motion.duration)
    again = r.time_parameterize(WAY, acceleration=20.0, round=round, sections=600).at(0.4 * motion.duration)
    assert all(np.array_equal(x, y) for x, y in zip(one, again))


def test_a_way_that_is_impossible_says_where_and_what_would_do():
    r = robot()
    with pytest.raises(lw.LinkworkError, match="satisfies the limits") as told:
        r.time_parameterize(WAY, acceleration=20.0, effort=3.0)
    share, q = told.value.share, told.value.q
    r.q = q
    assert share > 1 and np.abs(r.gravity_forces()).max() > 3.0
    r.time_parameterize(WAY, acceleration=20.0 * share * 1.001, effort=3.0 * share * 1.001)
    with pytest.raises(lw.LinkworkError, match="satisfies the limits"):
        r.time_parameterize(WAY, acceleration=20.0 * share * 0.999, effort=3.0 * share * 0.999)


def test_rounded_corners_that_touch_are_refused():
    wall = lw.Collider.sphere("wall", "world", 0.02, at=[0.0, 0.0, 0.0])
    rail = lw.Builder().body("x", "world", lw.Hinge.slider([1, 0, 0]), mass=1, inertia=np.eye(3))
    rail = rail.body("y", "x", lw.Hinge.slider([0, 1, 0]), mass=1, inertia=np.eye(3)).build()
    ball = lw.Collider.sphere("ball", "y", 0.02)
    r = lw.Robot(rail, chains={"cart": ("world", "y")}, colliders=[wall, ball])
    # The path goes around the inner side of a corner.
    way = [[-1.0, 0.06], [0.06, 0.06], [0.06, -1.0]]
    assert r.time_parameterize(way, acceleration=1.0, rate=1.0).duration > 0
    with pytest.raises(lw.LinkworkError, match="ball.*wall|wall.*ball"):
        r.time_parameterize(way, acceleration=1.0, rate=1.0, round=0.06)
    assert r.time_parameterize(way, acceleration=1.0, rate=1.0, round=0.01).duration > 0


def test_moves_with_limits_of_jerk():
    r = robot()
    a, v = np.array([2.0, 3.0, 4.0]), [1.0, 1.5, 2.0]
    move = r.transfer([0.9, -0.5, 0.3], start=WAY[0], v=[0.3, 0, -0.1], a=[0.5, 0, 0], goal_v=[0.1, 0, 0.2], rate=v, acceleration=a, jerk=20.0)
    t = np.linspace(0, move.duration, 2001)
    q, rates, accelerations = move.at(t)
    assert np.allclose(q[0], WAY[0]) and np.allclose(rates[0], [0.3, 0, -0.1]) and np.allclose(accelerations[0], [0.5, 0, 0])
    assert np.allclose(q[-1], [0.9, -0.5, 0.3]) and np.allclose(rates[-1], [0.1, 0, 0.2], atol=1e-9)
    assert (np.abs(rates) <= np.array(v) + 1e-9).all() and (np.abs(accelerations) <= a + 1e-9).all()
    assert np.abs(np.diff(accelerations, axis=0)).max() <= 20.0 * t[1] + 1e-9
    # The duration from rest to rest is 4 ∛(d/(2 j)) if neither rate nor acceleration reaches its
    # limit.
    assert r.transfer([0.01, 0, 0], start=[0, 0, 0], rate=9, acceleration=9, jerk=1.0).duration == pytest.approx(4 * (0.01 / 2) ** (1 / 3))
    with pytest.raises(lw.LinkworkError, match="beyond its limits") as told:
        r.transfer([2.7, 0, 0], start=[2.6, 0, 0], v=[1.9, 0, 0], rate=2, acceleration=2, jerk=5)
    assert told.value.value > 2.8


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda r: r.time_parameterize(WAY, acceleration=0.0), "must be positive"),
        (lambda r: r.time_parameterize(WAY, acceleration=[1.0, math.nan, 1.0]), "must be positive"),
        (lambda r: r.time_parameterize(WAY, acceleration=[1.0, 1.0]), "acceleration"),
        (lambda r: r.time_parameterize(WAY, acceleration="fast"), "acceleration"),
        (lambda r: r.time_parameterize(WAY[:, :2], acceleration=1.0), "shape"),
        (lambda r: r.time_parameterize(np.where(WAY > 1, np.nan, WAY), acceleration=1.0), "nan|NaN"),
        (lambda r: r.time_parameterize(WAY, acceleration=1.0, round=-1.0), "round"),
        (lambda r: r.time_parameterize(WAY, acceleration=1.0, sections=3), "sections"),
        (lambda r: r.time_parameterize(WAY, rate=math.inf, effort=math.inf), "speed"),
        (lambda r: r.time_parameterize(WAY, acceleration=1.0).at(math.nan), "nan|NaN"),
        (lambda r: r.time_parameterize(WAY, acceleration=1.0).at(np.zeros((2, 2))), "shape"),
        (lambda r: r.transfer([0, 0, 0.1], acceleration=1.0, jerk=-1.0), "must be positive"),
        (lambda r: r.transfer([0, 0], acceleration=1.0, jerk=1.0), "2"),
        (lambda r: r.prioritized_joint_rates([{"leg": [0, 0, 0]}]), "leg"),
        (lambda r: r.prioritized_joint_rates([{"arm": [0, 0]}]), "shape"),
        (lambda r: r.prioritized_joint_rates([[0, 0, math.nan]]), "nan|NaN"),
        (lambda r: r.prioritized_joint_rates([], horizon=0.0), "horizon"),
        (lambda r: r.whole_body([0, 0, 0], [], touches=[("arm", [0, 0, 0], [0, 0, 2], 0.5)]), "unit vector"),
        (lambda r: r.whole_body([0, 0, 0], [], touches=["arm"]), "touch"),
        (lambda r: r.whole_body([0, 0, 0], [], effort=[1, 2]), "effort"),
        (lambda r: r.impedance({"arm": ([0, 0, 0], [1] * 5, [1] * 6)}, [0, 0, 0]), "stiffness"),
        (lambda r: r.impedance({"arm": [1]}, [0, 0, 0]), "spring"),
        (lambda r: r.composite_inertia("nobody"), "nobody"),
        (lambda r: r.momentum([0, 0]), "2"),
        (lambda r: lw.support_polygon([[0, 0, 0]]), "shape"),
        (lambda r: lw.support_margin(np.zeros((0, 2)), [0, 0]), "corners"),
        (lambda r: arm().fit_inertia(WAY, WAY, WAY, WAY[:2]), "rows"),
        (lambda r: arm().fit_inertia(WAY[:1], WAY[:1], WAY[:1], WAY[:1]), "are not enough for"),
        (lambda r: arm().identifiable_inertia(tolerance=0.0), "tolerance"),
        (lambda r: arm().calibrate_frames("top", WAY, WAY), "tip"),
        (lambda r: arm().calibrate_frames("tip", WAY, WAY[:, :2]), "shape"),
        (lambda r: arm().calibrate_frames("tip", WAY, np.ones((3, 7))), "length"),
    ],
)
def test_bad_input_is_refused(call, words):
    with pytest.raises(lw.LinkworkError, match=words):
        call(robot())


def test_rates_in_order_within_guards():
    r = robot(7)
    q = np.array([0.3, -0.6, 0.8, 1.1, -0.4, 0.7, 0.2])
    r.q = q
    twist = np.array([0.1, -0.2, 0.15, 0.05, 0.1, -0.08])
    posture = np.linspace(-0.5, 0.5, 7)
    v, residuals = r.prioritized_joint_rates([{"arm": twist}, posture])
    J = r.jacobian("arm")
    assert np.allclose(J @ v, twist, atol=1e-8) and residuals[0] < 1e-8
    # Of all suitable rates, the result must be the nearest to the posture.
    want = posture + np.linalg.pinv(J) @ (twist - J @ posture)
    assert np.allclose(v, want, atol=1e-6)
    w, _ = r.manipulability("arm")
    _, gradient = r.manipulability("arm")
    down, _ = r.prioritized_joint_rates([-gradient * 100], manipulable={"arm": 0.9 * w}, horizon=0.5)
    assert gradient @ down >= -0.1 * w / 0.5 - 1e-9


def quadruped():
    builder = lw.Builder().body("trunk", "world", lw.Hinge.free(), mass=12, com=[0.02, 0, 0.03], inertia=np.diag([0.2, 0.4, 0.5]))
    for k, (x, y) in enumerate([(0.3, 0.2), (0.3, -0.2), (-0.3, 0.2), (-0.3, -0.2)]):
        for part, parent, axis, at in [("hip", "trunk", [1, 0, 0], [x, y, 0]), ("thigh", f"hip{k}", [0, 1, 0], [0, 0, 0]), ("shank", f"thigh{k}", [0, 1, 0], [0, 0, -0.27])]:
            hinge = lw.Hinge.pin(axis).limits(-3, 3, effort=80)
            builder = builder.body(f"{part}{k}", parent, hinge, mass=0.8, com=[0, 0, -0.1], inertia=np.eye(3) / 200, hinge_in_parent=at)
    return builder.build()


def test_a_robot_on_its_feet():
    m = quadruped()
    r = lw.Robot(m, chains={f"leg{k}": ("trunk", f"shank{k}") for k in range(4)}, colliders=[])
    q = m.neutral_q()
    for k in range(4):
        q[m.coordinates(f"thigh{k}")[0]], q[m.coordinates(f"shank{k}")[0]] = 0.7, -1.35
    r.q = q
    touches = [(f"leg{k}", [0, 0, -0.28], [0, 0, 1], 0.6) for k in range(4)]
    v = np.zeros(m.nv)
    found = r.whole_body(v, [{"center_of_mass": [0.5, 0.2, 0.3]}, np.zeros(m.nv)], touches=touches)
    assert found.unbalanced < 1e-7 and found.slipping < 1e-7 and found.shortfall == 0
    mass, _ = r.center_of_mass()
    assert np.allclose(found.forces.sum(axis=0), mass * (np.array([0.5, 0.2, 0.3]) + [0, 0, 9.81]), atol=1e-6)
    feet = {f"leg{k}": np.hstack([np.cross(r.tip_pose(f"leg{k}")[:3, :3] @ [0, 0, -0.28], -f), -f]) for k, f in enumerate(found.forces)}
    assert np.allclose(r.feed_forward(v, found.vdot, feet), found.tau, atol=1e-7)
    polygon = lw.support_polygon([r.tip_pose(f"leg{k}")[:2, 3] for k in range(4)])
    assert len(polygon) == 4 and lw.support_margin(polygon, r.center_of_mass()[1][:2]) > 0.05
    weak = r.whole_body(v, [np.zeros(m.nv)], touches=touches, effort=np.where(np.arange(m.nv) < 6, 0.0, 1.0))
    assert np.abs(weak.tau).max() <= 1 + weak.shortfall + 1e-9


def test_impedance_is_a_spring():
    r = robot(6)
    r.q = [0.3, -0.6, 0.8, 1.1, -0.4, 0.7]
    X = r.tip_pose("arm")
    there = X.copy()
    there[:3, 3] += [0.01, -0.02, 0.03]
    tau = r.impedance({"arm": (there, 3 * [20.0] + 3 * [300.0], 6 * [4.0])}, np.zeros(6))
    assert np.allclose(tau - r.gravity_forces(), r.jacobian("arm")[3:].T @ [3.0, -6.0, 9.0], atol=1e-9)


def test_inertias_are_found_from_forces():
    m = arm()
    told = m.identifiable_inertia()
    rng = np.random.default_rng(4)
    q, v, a = rng.normal(size=(3, 60, 3))
    real = lw.Builder()
    for k, parent in enumerate(["world", "b0", "b1"]):
        axis = np.eye(3)[(k + 1) % 3] + 0.1 * np.array([1, -1, 0.5])
        at = [0, 0, 0] if k == 0 else [0.3, 0.02, 0.05]
        real = real.body(f"b{k}", parent, lw.Hinge.pin(axis / np.linalg.norm(axis)), mass=2.1, com=[0.1, 0.03, -0.02], inertia=np.diag([0.015, 0.02, 0.025]), hinge_in_parent=at)
    real = real.build()
    found = m.fit_inertia(q, v, a, real.inverse_dynamics(q, v, a))
    assert found.identifiable.base == told.base and found.residual < 1e-9
    assert np.allclose(found.base, found.identifiable.combinations @ real.inertial_parameters(), atol=1e-8)
    q, v, a = rng.normal(size=(3, 10, 3))
    change = m.regressor(q, v, a) @ (found.parameters - m.inertial_parameters())
    assert np.allclose(m.inverse_dynamics(q, v, a) + change, real.inverse_dynamics(q, v, a), atol=1e-8)
    assert (found.mechanism is None) == bool(found.unphysical)


def test_frames_are_found_from_places():
    m, rng = arm(), np.random.default_rng(5)
    q = rng.uniform(-2, 2, size=(30, 3))
    off = np.array([0.001, -0.002, 0.003])
    seen = np.array([np.hstack([m.state(x).position("tip") + off, m.state(x).quaternion("tip")]) for x in q])
    found = m.calibrate_frames("tip", q, seen)
    assert found.residual < 1e-10 and len(found.identifiable.base) == 4 * 3 + 6
    assert found.identifiable.names[-6:] == ["tip.rx", "tip.ry", "tip.rz", "tip.px", "tip.py", "tip.pz"]
    other = rng.uniform(-2, 2, size=3)
    assert np.allclose(found.mechanism.state(other).position("tip"), m.state(other).position("tip") + off, atol=1e-9)


def test_parts_of_a_pose_for_chains_and_frames():
    r, m = robot(6), arm(6)
    r.q = [0.3, -0.6, 0.8, 1.1, -0.4, 0.7]
    X = r.tip_pose("arm")
    point = X[:3, 3] + [0.02, 0.01, -0.03]
    q = r.inverse_kinematics("arm", point, axis=[0, 0, 2], along=[0.1, 0.2, 1.0])
    r.q = q
    Y = r.tip_pose("arm")
    assert np.allclose(Y[:3, 3], point, atol=1e-9) and np.allclose(np.cross(Y[:3, 2], [0.1, 0.2, 1.0]), 0, atol=1e-8)
    q = m.inverse_kinematics(q, [lw.Target("tip", point + 0.05, plane=[1, 1, 1], axis=[1, 0, 0], look_at=[2, 0, 0], within=0.2)])
    Z = m.state(q).pose("tip")
    to = np.array([2, 0, 0]) - Z[:3, 3]
    assert abs((Z[:3, 3] - point - 0.05).sum()) < 1e-8 and np.arccos(Z[:3, 0] @ to / np.linalg.norm(to)) < 0.2 + 1e-8
    for wrong, words in [({"axis": [1, 0, 0]}, "incomplete"), ({"within": 0.1}, "incomplete"), ({"plane": [0, 0, 0]}, "length zero"), ({"plane": [1, 0, 0], "line": [1, 0, 0]}, "one of them"),
                         ({"axis": [1, 0, 0], "along": [1, 0, 0], "within": 4.0}, "cone")]:
        with pytest.raises(lw.LinkworkError, match=words):
            r.inverse_kinematics("arm", point, **wrong)
        with pytest.raises(lw.LinkworkError, match=words):
            m.inverse_kinematics(q, [lw.Target("tip", point, **wrong)])
    with pytest.raises(lw.LinkworkError, match="give only one"):
        r.inverse_kinematics("arm", X, axis=[1, 0, 0], along=[1, 0, 0])


def test_mimic_fingers_are_timed_with_the_force_of_their_motor(tmp_path):
    link = '<link name="{}"><inertial><mass value="{}"/><inertia ixx="1e-4" iyy="1e-4" izz="1e-4" ixy="0" ixz="0" iyz="0"/></inertial></link>'
    joint = '<joint name="{0}" type="prismatic"><parent link="palm"/><child link="{1}"/><axis xyz="0 1 0"/><limit lower="-1" upper="1" effort="{2}" velocity="5"/>{3}</joint>'
    text = "".join(link.format(n, m) for n, m in [("palm", 1), ("left", 0.3), ("right", 0.5)])
    text += joint.format("close", "left", 4, "") + joint.format("follow", "right", 1e-3, '<mimic joint="close" multiplier="-1"/>')
    file = tmp_path / "gripper.urdf"
    file.write_text(f'<robot name="gripper">{text}</robot>')
    gripper = lw.load(file)
    robot = lw.Robot(gripper, colliders=[])
    close, follow = (gripper.coordinates(n)[0] for n in ("left", "right"))
    path = np.zeros((2, 2))
    path[1, close], path[1, follow] = 0.04, -0.04
    motion = robot.time_parameterize(path, sections=400)
    # The motor of one joint accelerates both fingers: 4 N for 0.8 kg.
    assert motion.duration == pytest.approx(2 * math.sqrt(0.04 * 0.8 / 4), rel=1e-6)
    q, v, _ = motion.at(0.3 * motion.duration)
    assert q[follow] == -q[close] and v[follow] == -v[close]
    path[1, follow] = 0.04
    with pytest.raises(lw.LinkworkError, match="coupling"):
        robot.time_parameterize(path)
    free = lw.Robot(lw.load(file, couplings=False), colliders=[])
    assert free.time_parameterize(path, effort=[4.0, 4.0]).duration < motion.duration
