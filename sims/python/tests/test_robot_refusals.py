"""`Robot`: errors contain the known names; infeasible requests contain the best solution."""

import numpy as np
import pytest

import linkwork as lw


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda r: r.tip_pose("amr"), "parts: arm, side arm, both"),
        (lambda r: r.grasp("arm", "cpu"), "cup"),
        (lambda r: r.release("arm", "cup"), "not held"),
        (lambda r: r.balance("cup", np.zeros(2)), "not held"),
        (lambda r: r.jacobian("both"), "not a chain"),
        (lambda r: setattr(r, "q", [0.0]), "2"),
        (lambda r: setattr(r, "q", [0.0, np.nan]), "nan"),
        (lambda r: r.inverse_kinematics("arm", [0.1, 0.2]), "shape"),
        (lambda r: r.inverse_kinematics("arm", [0.1, 0.2, 0.0], position_tolerance=0.0), "above zero"),
        (lambda r: r.inverse_kinematics("arm", [0.1, 0.2, 0.0], q=[9.0, 0.0]), "limits"),
        (lambda r: r.inverse_kinematics_all("arm", np.eye(4)), "neither six nor seven"),
        (lambda r: r.inverse_kinematics_all("amr", np.eye(4)), "parts: arm, side arm, both"),
        (lambda r: r.manipulability("arm", rows="some"), "rows"),
        (lambda r: r.manipulability("arm", length=0.0), "length"),
        (lambda r: r.feed_forward([0, 0], [0, 0], pushes={"amr": [0] * 6}), "arm"),
        (lambda r: r.predict([0, 0], [0, 0], [0, 0], 0.1, np.eye(2)), "give (4, 4)"),
        (lambda r: r.predict([0, 0], [0, 0], [0, 0], -0.1, np.eye(4)), "step"),
        (lambda r: r.predict([0, 0], [0, 0], [0, 0], 0.1, np.eye(4), density=[-1.0, 0]), "density"),
        (lambda r: r.plan("arm", [0, 0], [0, 0], room=1), "room"),
        (lambda r: r.put("cup", [0, 0]), "shape"),
        (lambda r: r.inverse_kinematics("arm", [np.nan, 0.2, 0.0]), "nan"),
        (lambda r: (r.grasp("arm", "cup"), r.grasp("arm", "cup")), "already held"),
        (lambda r: (r.grasp("arm", "cup"), r.release("side arm", "cup")), "holds nothing"),
        (lambda r: (r.grasp("arm", "cup"), r.grasp("side arm", "cup", [9, 0, 0])), "its grasp requires"),
        (lambda r: (r.grasp("arm", "cup"), r.closure("cup")), "holds nothing"),
        (lambda r: r.closure("cup", hand="arm"), "hand and a body"),
        (lambda r: r.pad("fore", 3.0), "touch at every configuration"),
        (lambda r: r.grasp("both", "cup"), "not a chain"),
    ],
)
def test_mistakes_are_refused(call, words):
    parts = lw.Builder()
    for link, parent in (("upper", "world"), ("lower", "upper"), ("side", "world")):
        parts = parts.body(link, parent, lw.Hinge.pin([0, 0, 1]).limits(-3, 3) if link != "side" else lw.Hinge.locked(), mass=1, inertia=np.eye(3), hinge_in_parent=[0.5, 0, 0])
    groups = {"both": ["lower", "side"]}
    chains = {"arm": ("world", "lower"), "side arm": ("world", "side")}
    shapes = [lw.Collider.sphere("fore", "lower", 0.1), lw.Collider.sphere("post", "side", 0.1, at=[0, 0, 1])]
    robot = lw.Robot(parts.build(), chains=chains, groups=groups, objects={"cup": (1.0, [0, 0, 0], np.eye(3))}, colliders=shapes)
    with pytest.raises(lw.LinkworkError) as e:
        call(robot)
    assert words.lower() in str(e.value).lower()


def test_models_that_cannot_be_are_refused():
    m = lw.Builder().body("a", "world", lw.Hinge.pin([0, 0, 1]), mass=1).build()
    for options, words in (
        ({"chains": {"arm": ("world", "b")}}, "one of: a"),
        ({"objects": {"cup": (-1.0, [0, 0, 0], np.eye(3))}}, "cup"),
        ({"objects": {"cup": 3.0}}, "com"),
        ({"srdf": "none.srdf"}, "file"),
        ({"colliders": [lw.Collider.sphere("s", "b", 0.1)]}, "no body"),
    ):
        with pytest.raises(lw.LinkworkError, match=words):
            lw.Robot(m, **{"colliders": [], **options})


def test_what_is_not_feasible_comes_with_the_best_that_is():
    parts = lw.Builder()
    for side, y in (("left", 0.3), ("right", -0.3)):
        block = dict(mass=1, com=[0.1, 0, 0], inertia=np.eye(3) / 100)
        pin = lw.Hinge.pin([0, 1, 0]).limits(-2, 2, effort=20)
        parts = parts.body(f"{side} upper", "world", pin, hinge_in_parent=[0, y, 0], **block).body(f"{side} fore", f"{side} upper", pin, hinge_in_parent=[0.4, 0, 0], **block)
    chains = {side: ("world", f"{side} fore") for side in ("left", "right")}
    robot = lw.Robot(parts.build(), chains=chains, objects={"plate": (300.0, [0, 0, 0], np.eye(3))}, colliders=[])
    robot.q = [0.5, -1.2, 0.5, -1.2]
    robot.grasp("left", "plate", [0, 0, 0])
    robot.grasp("right", "plate")
    closure = robot.closure("plate")
    assert closure["rows"] == 6 and closure["rank"] + closure["mobility"] == 4
    alone = robot.gravity_forces()
    tau, share = robot.balance("plate", alone, by="effort")
    assert share > 10 and np.abs(tau).max() / 20 == pytest.approx(share, rel=1e-12) and np.abs(alone).max() / 20 > share
    half = [0, 0, 0, 0, 0, 150 * 9.81]
    palms = [([0, y, 0], 0.5, 0.05, 10.0) for y in (-1, 1)]
    wrenches, missing = robot.grip("plate", [half, half], friction=palms)
    assert missing > 100 and wrenches.sum(axis=0)[5] == pytest.approx(300 * 9.81, rel=1e-6)
