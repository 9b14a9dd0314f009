"""Shapes of `Robot`: distances of all pairs, coarse shapes, and names for several shapes."""

import numpy as np
import pytest
from test_robot import three

import linkwork as lw


def test_distances_of_all_pairs_and_coarse_shapes():
    rod = lw.Collider.box("rod", "hand", [0.3, 0.05, 0.05], at=[0.2, 0, 0])
    around = lw.Collider.sphere("around", "hand", 0.2, at=[0.2, 0, 0])
    posts = [lw.Collider.sphere(f"post {k}", "world", 0.05, at=[1.0, 0, 0.15 + 0.1 * k]) for k in range(3)]
    robot = three(colliders=[rod.with_coarse(around), *posts])
    q = np.zeros(3)
    every = robot.distances(q)
    assert [pair for _, pair, _ in every] == [(f"post {k}", "rod") for k in range(3)]
    for d, pair, ends in every:
        one, points = robot.distance(q, *pair)
        assert d == one and (ends == points).all()
        assert np.linalg.norm(ends[1] - ends[0]) == pytest.approx(d)
    nearest = robot.clearance(q)
    assert nearest[0] == min(d for d, _, _ in every) == pytest.approx(0.075)
    assert len(robot.distances(q, limit=0.1)) == 1 and robot.distances(q, limit=0.01) == []
    assert rod.with_coarse(around).has_coarse and not rod.has_coarse
    robot.set_detail("coarse")
    assert robot.collides(q) and robot.copy().collides(q)
    assert robot.clearance(q)[0] == pytest.approx(0.15 - 0.25)
    robot.set_detail("fine")
    assert not robot.collides(q)
    with pytest.raises(lw.LinkworkError, match="detail"):
        robot.set_detail("rough")
    with pytest.raises(lw.LinkworkError, match="frames"):
        rod.with_coarse(lw.Collider.sphere("elsewhere", "hand", 0.2))
    for wrong in (q[:2], [np.nan, 0, 0]):
        with pytest.raises(lw.LinkworkError):
            robot.distances(wrong)
    with pytest.raises(lw.LinkworkError):
        robot.distances(q, limit=np.nan)


def test_parts_objects_and_bodies_stand_for_their_colliders():
    at = lambda x: [x, 0, 0]
    rods = [lw.Collider.sphere(f"ball {link}", link, 0.05, at=at(0.2)) for link in ("upper", "lower", "hand")]
    rough = rods[2].with_coarse(lw.Collider.sphere("rough", "hand", 0.3, at=at(0.2)))
    cup = lw.Collider.sphere("cup shape", "cup", 0.05)
    post = lw.Collider.sphere("post", "world", 0.05, at=[1.0, 0, 0.2])
    robot = three(colliders=[*rods[:2], rough, cup, post], objects={"cup": (0.3, [0, 0, 0], np.eye(3) / 1000)})
    robot.put("cup", [9, 9, 9])
    q = np.zeros(3)
    gap = lambda name: robot.distance(q, name, "post")[0]
    names = ["ball upper", "ball lower", "ball hand", "cup shape"]
    before = [gap(n) for n in names]
    robot.pad("arm", 0.01)
    assert np.allclose([b - gap(n) for b, n in zip(before, names)], [0.01, 0.01, 0.01, 0])
    robot.pad("lower", 0.02)
    robot.pad("cup", 0.03)
    assert np.allclose([b - gap(n) for b, n in zip(before, names)], [0.01, 0.02, 0.01, 0.03])
    robot.pad("ball upper", 0.0)
    assert gap("ball upper") == before[0]
    robot.pad("arm", 0.0)
    # Only the coarse shape of the hand touches the post.
    assert not robot.collides(q)
    robot.set_detail("coarse", of="arm")
    assert robot.hits(q) == [("ball hand", "post")]
    robot.look_at("arm", "post", False)
    assert not robot.collides(q)
    robot.look_at("arm", "post", None)
    robot.hide("arm")
    assert robot.hits(q) == []
    robot.show("hand")
    assert robot.hits(q) == [("ball hand", "post")]
    assert robot.body_pose("hand")[:3, 3].tolist() == pytest.approx([0.8, 0, 0])
    many = np.linspace(-1, 1, 30).reshape(10, 3)
    assert robot.collides(many, threads=3).tolist() == [robot.collides(row) for row in many]
    for call in (lambda: robot.pad("harm", 0.1), lambda: robot.hide("harm"), lambda: robot.look_at("arm", "pots", False), lambda: robot.set_detail("fine", of="harm")):
        with pytest.raises(lw.LinkworkError, match="there is no .*`(harm|pots)`(.|\n)*`(arm|post)`"):
            call()
    with pytest.raises(lw.LinkworkError, match="hando"):
        robot.body_pose("hando")
    bare = three(colliders=[], objects={"cup": (0.3, [0, 0, 0], np.eye(3) / 1000)})
    for name in ("arm", "cup", "hand"):
        with pytest.raises(lw.LinkworkError, match="with colliders"):
            bare.pad(name, 0.01)
