"""`Collisions`: checks, distances, paths, settings, point clouds and voxel maps, compared with brute force; errors."""

import doctest

import numpy as np
import pytest

import linkwork as lw

TURN = [0, 0.5**0.5, 0, 0.5**0.5]


def arm():
    """Three links of 0.3 m along x, about z, y, y."""
    builder, parent = lw.Builder(), "world"
    for name, axis in (("one", [0, 0, 1]), ("two", [0, 1, 0]), ("three", [0, 1, 0])):
        at = [0, 0, 0] if parent == "world" else [0.3, 0, 0]
        hinge = lw.Hinge.pin(axis).limits(-3, 3)
        builder = builder.body(
            name, parent, hinge, hinge_in_parent=at, mass=1.0, com=[0.15, 0, 0], inertia=0.01 * np.eye(3)
        )
        parent = name
    return builder.build()


def links():
    return [lw.Collider.capsule(f"on {b}", b, 0.03, 0.2, at=[0.15, 0, 0, *TURN]) for b in ("one", "two", "three")]


POSE = np.array([-0.7, -0.4, -0.2, *(np.array([0.1, -0.2, 0.2, 0.9]) / np.linalg.norm([0.1, -0.2, 0.2, 0.9]))])
EDGE, CELLS = 0.05, (24, 24, 16)


def seen(rng):
    points = np.column_stack([rng.uniform(-0.6, 0.6, (150, 3)), rng.uniform(0.001, 0.02, 150)])
    return points, np.unique(rng.integers(0, CELLS, (120, 3)), axis=0)


def robot():
    cloud = lw.Collider.point_cloud("cloud", "world", room=150)
    grid = lw.Collider.voxel_map("map", "world", CELLS, EDGE, at=POSE)
    return lw.Collisions(arm(), [*links(), cloud, grid])


def rotation(q):
    x, y, z, w = q
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


@pytest.mark.parametrize("cls", [lw.Collisions])
def test_examples_of_the_docstring_run(cls):
    tests = doctest.DocTestParser().get_doctest(cls.__doc__, {}, cls.__name__, None, 0)
    assert tests.examples and doctest.DocTestRunner().run(tests).failed == 0


def test_clouds_and_maps_are_met_as_their_balls_and_cells_would_be():
    rng = np.random.default_rng(5)
    points, cells = seen(rng)
    live = robot()
    assert live.colliders == ["cloud", "map", "on one", "on three", "on two"]
    assert repr(live) == "Collisions(3 bodies, 5 colliders)"
    empty = live.copy()
    live.set_points("cloud", points)
    live.set_cells("map", cells)
    assert (live.count("cloud"), live.count("map"), empty.count("cloud")) == (150, len(cells), 0)
    single = [lw.Collider.sphere(f"ball {k}", "world", p[3], at=p[:3]) for k, p in enumerate(points)]
    for k, c in enumerate(cells):
        centre = POSE[:3] + rotation(POSE[3:]) @ ((c + 0.5) * EDGE)
        single.append(lw.Collider.box(f"cell {k}", "world", [EDGE] * 3, at=[*centre, *POSE[3:]]))
    brute = lw.Collisions(arm(), [*links(), *single])
    Q = rng.uniform(-2, 2, (400, 3))
    hits = live.collides(Q)
    assert hits.dtype == bool and hits.shape == (400,) and 40 < hits.sum() < 360
    assert (hits == brute.collides(Q)).all() and not empty.collides(Q).any()
    assert (live.collides(Q, threads=3) == hits).all()

    def names(robot, q):
        short = {"ball": "cloud", "cell": "map"}
        return sorted({tuple(sorted(short.get(n.split()[0], n) for n in pair)) for pair in robot.hits(q)})

    for q, hit in zip(Q[:120], hits[:120], strict=True):
        assert live.collides(q) is bool(hit)
        assert names(live, q) == names(brute, q) and (live.first_hit(q) is not None) == hit
        (d, pair, ends), (e, *_) = live.clearance(q), brute.clearance(q)
        assert d == pytest.approx(e, abs=1e-9) and np.linalg.norm(ends[1] - ends[0]) == pytest.approx(abs(d), abs=1e-8)
        assert live.distance(q, *pair)[0] == pytest.approx(d, abs=1e-12)
        to = q + rng.uniform(-0.4, 0.4, 3)
        assert live.path(q, to)[:2] == brute.path(q, to)[:2]


def test_what_changes_can_be_undone():
    rng = np.random.default_rng(6)
    points, cells = seen(rng)
    live, fresh = robot(), robot()
    Q = rng.uniform(-2, 2, (200, 3))
    live.set_points("cloud", points)
    only_cloud = live.collides(Q)
    live.set_cells("map", cells)
    both = live.collides(Q)
    assert only_cloud.sum() < both.sum()
    live.hide("map")
    assert (live.collides(Q) == only_cloud).all()
    live.show("map")
    for link in ("on one", "on two", "on three"):
        live.look_at("map", link, False)
    assert not live.looks_at("map", "on two") and (live.collides(Q) == only_cloud).all()
    for link in ("on one", "on two", "on three"):
        live.look_at("map", link, None)
    assert (live.collides(Q) == both).all()
    live.pad("on three", 0.05)
    assert live.collides(Q).sum() > both.sum()
    live.pad("on three", 0.0)
    live.set_cells("map", cells, occupied=False)
    assert live.count("map") == 0 and (live.collides(Q) == only_cloud).all()
    live.set_cells("map", cells)
    live.clear_cells("map")
    live.set_points("cloud", np.empty((0, 4)))
    q = Q[0]
    assert live.clearance(q, 1.0)[:2] == fresh.clearance(q, 1.0)[:2]
    assert (live.collides(Q) == fresh.collides(Q)).all() and live.distance(q, "cloud", "on two") is None


def test_a_way_past_a_point_is_told():
    live = robot()
    live.set_points("cloud", [[0.4, 0.4, 0.0, 0.0]])
    word, at, pair = live.path([0, 0, 0], [2, 0, 0])
    assert word == "hit" and 0.3 < at < 0.5 and set(pair) <= {"cloud", "on two", "on three"}
    assert live.path([0, 0, 0], [0.5, 0, 0]) == ("free", None, None)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda r: r.collides([0.0]), "3"),
        (lambda r: r.collides(np.zeros((2, 4))), "(n, 3)"),
        (lambda r: r.collides([0, 0, np.nan]), "nan"),
        (lambda r: r.collides(np.zeros((2, 3)), threads=0), "threads"),
        (lambda r: r.pad("on one", -1.0), "padding"),
        (lambda r: r.hide("on oen"), "did you mean"),
        (lambda r: r.set_points("cloud", [[0, 0, 0]]), "(n, 4)"),
        (lambda r: r.set_points("cloud", np.zeros((151, 4))), "room"),
        (lambda r: r.set_points("cloud", [[0, 0, 0, -1.0]]), "radius"),
        (lambda r: r.set_points("map", [[0, 0, 0, 1.0]]), "point cloud"),
        (lambda r: r.set_cells("cloud", [[0, 0, 0]]), "voxel map"),
        (lambda r: r.set_cells("map", [[0, 0, 16]]), "indices count from 0"),
        (lambda r: r.set_cells("map", [[0, 0, -1]]), "give integers"),
        (lambda r: r.set_cells("map", [[0, 0, 0.5]]), "give integers"),
        (lambda r: r.count("on two"), "point cloud"),
        (lambda r: r.path([0, 0, 0], [1, 1, 1], 0.0), "least"),
        (lambda r: r.clearance([0, 0, 0], np.nan), "limit"),
        (lambda r: lw.Collisions(arm(), [lw.Collider.voxel_map("m", "world", (0, 1, 1), 0.1)]), "at least one"),
        (lambda r: lw.Collisions(arm(), [lw.Collider.point_cloud("p", "no", room=3)]), "no body"),
    ],
)
def test_mistakes_are_refused(call, words):
    with pytest.raises(lw.LinkworkError) as e:
        call(robot())
    assert words.lower() in str(e.value).lower()


def linkage(**more):
    """A plane four-bar linkage whose coupler (0.8 m) ends at the end of the rocker (0.6 m), with a bar for each; y is out of the plane."""
    pin, parts = lw.Hinge.pin([0, 1, 0]), lw.Builder()
    for name, parent, length, at in (("crank", "world", 0.3, 0.0), ("coupler", "crank", 0.8, 0.3), ("rocker", "world", 0.6, 0.7)):
        parts.body(name, parent, pin, mass=1, com=[length / 2, 0, 0], inertia=0.1 * np.eye(3), hinge_in_parent=[at, 0, 0])
    parts.loop("knee", "coupler", "rocker", pin, at_a=[0.8, 0, 0], at_b=[0.6, 0, 0])
    m = parts.build()
    bars = [lw.Collider.box(n, n, [x, 0.02, 0.02], at=[x / 2, 0, 0]) for n, x in (("crank", 0.3), ("coupler", 0.8), ("rocker", 0.6))]
    post = lw.Collider.sphere("post", "world", 0.02, at=[0.455, 0, 0.46])
    # The world is connected to crank and rocker by hinges: its shapes collide with them only on request.
    return m, lw.Collisions(m, [*bars, post], collide=[("post", "crank"), ("post", "rocker")], **more)


def test_linkages_with_loops_are_asked_where_they_close():
    m, robot = linkage()
    rng = np.random.default_rng(8)
    Q = np.array([m.close([a, 0.5, -1.9]) for a in rng.uniform(-1.2, -0.6, 60)])
    answers = robot.collides(Q, threads=2)
    # The reference is computed by hand: a bar touches the post if its centre line (half width 0.01 m) comes within the
    # radius, except at corners.
    for q, hit in zip(Q, answers, strict=True):
        base, near = np.zeros(2), np.inf
        knee = 0.3 * np.array([np.cos(q[0]), -np.sin(q[0])])
        for start, angle, length in ((base, q[0], 0.3), (knee, q[0] + q[1], 0.8), (np.array([0.7, 0]), q[2], 0.6)):
            along = np.array([np.cos(angle), -np.sin(angle)])
            r = np.array([0.455, 0.46]) - start
            x, z = r @ along, r @ [-along[1], along[0]]
            near = min(near, np.hypot(x - np.clip(x, 0, length), z - np.clip(z, -0.01, 0.01)))
        assert hit == (near <= 0.02) and robot.collides(q) == hit
        if near > 0:
            assert robot.clearance(q)[0] == pytest.approx(near - 0.02, abs=1e-9)
        # Bodies of the same loop do not collide, except on request.
        assert ("coupler", "rocker") not in robot.hits(q)
    assert 5 < answers.sum() < 55
    assert ("coupler", "rocker") in linkage(neighbours="collide")[1].hits(Q[0])


def test_configurations_that_open_a_loop_are_refused():
    m, robot = linkage()
    q = m.close([-1.0, 0.5, -1.9])
    off = q + [0, 0, 2e-5]
    for call in (robot.collides, robot.hits, robot.first_hit, robot.clearance, lambda q: robot.distance(q, "post", "rocker")):
        call(q)
        with pytest.raises(lw.LinkworkError, match=r"(?s)`q` violates the constraint `knee`.*mechanism.close"):
            call(off)
    with pytest.raises(lw.LinkworkError, match="row 1 of `q` violates the constraint `knee`"):
        robot.collides([q, off], threads=2)
    with pytest.raises(lw.LinkworkError, match="opens the loop `knee`"):
        robot.path(q, q)
    assert not robot.copy().looks_at("coupler", "rocker")


@pytest.mark.filterwarnings("ignore:.*coupling")
def test_ways_of_coupled_joints_keep_the_coupling(tmp_path):
    link = '<link name="{0}"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>'
    joint = '<joint name="j{0}" type="revolute"><parent link="base"/><child link="{0}"/><axis xyz="0 0 1"/><limit lower="-2" upper="2" effort="1" velocity="1"/>{1}</joint>'
    text = '<link name="base"/>' + "".join(link.format(n) for n in "ab") + joint.format("a", "") + joint.format("b", '<mimic joint="ja" multiplier="-0.5" offset="0.1"/>')
    path = tmp_path / "pair.urdf"
    path.write_text(f'<robot name="pair">{text}</robot>')
    m = lw.load(path, "fixed")
    shapes = [lw.Collider.box(n, n, [1.0, 0.02, 0.02], at=[0.5, 0, z]) for n, z in (("a", 0.0), ("b", 0.1))]
    robot = lw.Collisions(m, [*shapes, lw.Collider.sphere("ball", "world", 0.05, at=[0, 0.8, 0])], neighbours="collide")
    a, b = m.joints["ja"].start, m.joints["jb"].start

    def at(x):
        q = np.zeros(2)
        q[a], q[b] = x, -0.5 * x + 0.1
        return q

    assert robot.path(at(0), at(1.0)) == ("free", None, None) and robot.path(at(0), at(1.9))[0] == "hit"
    for q in (at(1.0) + [1e-3, 0], at(1.0) + [0, 1e-3]):
        with pytest.raises(lw.LinkworkError, match="violates the constraint"):
            robot.path(at(0), q)
