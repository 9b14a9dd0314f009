"""Contact of a `Mechanism`: closed forms, momentum balances, the same motion as a simulation, errors."""

import doctest

import numpy as np
import pytest

import linkwork as lw

G = 9.81


def free(name="ball", mass=2.0, inertia=0.008, builder=None):
    """A free body about its centre of mass."""
    builder = builder or lw.Builder()
    return builder.body(name, "world", lw.Hinge.free(), mass=mass, com=[0, 0, 0], inertia=inertia * np.eye(3))


def at(*position):
    return np.array([*position, 0, 0, 0, 1.0])


def moving(*velocity):
    return np.array([0, 0, 0, *velocity], float)


@pytest.mark.parametrize("cls", [lw.Contact, lw.Collider])
def test_examples_of_the_docstrings_run(cls):
    tests = doctest.DocTestParser().get_doctest(cls.__doc__, {}, cls.__name__, None, 0)
    assert tests.examples and doctest.DocTestRunner().run(tests).failed == 0


def test_a_ball_at_rest_carries_its_weight():
    ball = free().build()
    contact = lw.Contact(ball, [lw.Collider.sphere("skin", "ball", 0.1), lw.Collider.half_space("ground")])
    assert contact.colliders == ["ground", "skin"] and repr(contact) == "Contact(1 bodies, 2 colliders)"
    q, v = at(0, 0, 0.1), np.zeros(6)
    for _ in range(100):
        step = contact.step(q, v, 1e-3)
        q, v = step.q, step.v
    assert step.pairs == [("ground", "skin")] and step.converged and step.impacts == 0
    assert np.allclose(step.forces, [[0, 0, 2 * G]], atol=1e-9) and np.allclose(step.forces * 1e-3, step.impulses)
    assert np.allclose(step.normals, [[0, 0, 1]]) and np.allclose(step.points, [[0, 0, 0]], atol=1e-9)
    assert np.allclose(q, at(0, 0, 0.1), atol=1e-9) and np.allclose(v, 0, atol=1e-9)
    # A pressed body is carried, and a lifted one is released.
    pressed = contact.step(q, v, 1e-3, wrenches={"ball": [0, 0, 0, 0, 0, -5.0]})
    assert np.allclose(pressed.forces, [[0, 0, 2 * G + 5]], atol=1e-9)
    lifted = contact.step(q, v, 1e-3, [0, 0, 0, 0, 0, 2 * G + 4])
    assert np.allclose(lifted.forces, 0, atol=1e-9) and lifted.v[5] == pytest.approx(4 / 2.0 * 1e-3, rel=1e-9)


@pytest.mark.parametrize("slope", [0.0, 0.4])
def test_a_box_slides_as_the_closed_form_says(slope):
    mu, dt, speed, mass = 0.3, 1e-3, 1.0, 3.0
    box = lw.Builder().body("box", "world", lw.Hinge.free(), mass=mass, com=[0, 0, 0], inertia=np.diag([0.02, 0.03, 0.04]))
    box = box.build()
    box.gravity = [G * np.sin(slope), 0, -G * np.cos(slope)]
    # The friction of the pair is the geometric mean, 0.3.
    shapes = [
        lw.Collider.box("block", "box", [0.4, 0.3, 0.1], friction=0.9),
        lw.Collider.half_space("ground", friction=0.1),
    ]
    contact = lw.Contact(box, shapes, tolerance=1e-10)
    step = contact.step(at(0, 0, 0.05), moving(speed, 0, 0), dt)
    # The names of a pair are in alphabetical order, so the forces are those on the ground.
    assert step.converged and len(step.pairs) >= 4 and set(step.pairs) == {("block", "ground")}
    total = -step.forces.sum(axis=0)
    assert np.allclose(total, [-mu * mass * G * np.cos(slope), 0, mass * G * np.cos(slope)], atol=1e-6)
    steps = 200
    t, q, v = contact.simulate(at(0, 0, 0.05), moving(speed, 0, 0), dt, steps)
    deceleration = G * (mu * np.cos(slope) - np.sin(slope))
    # The velocities are those of the closed form, the positions their sums.
    expected = speed - deceleration * t
    assert np.allclose(v[:, 3], expected, atol=1e-7) and np.allclose(v[:, [0, 1, 2, 4, 5]], 0, atol=1e-7)
    assert np.allclose(q[1:, 0], np.cumsum(expected[1:]) * dt, atol=1e-7)
    if slope == 0:
        t, q, v = contact.simulate(at(0, 0, 0.05), moving(speed, 0, 0), dt, 500)
        # The block stops after v² / 2 μ g, and stays there; the error is of first order in the
        # step.
        assert q[-1, 0] == pytest.approx(speed**2 / (2 * mu * G), abs=speed * dt) and abs(v[-1, 3]) < 1e-9


def test_a_ball_bounces_to_e_squared_of_its_height():
    e, height, radius, dt, mass = 0.8, 1.0, 0.1, 1e-4, 2.0
    ball = free(mass=mass).build()
    shapes = [lw.Collider.sphere("skin", "ball", radius, restitution=e), lw.Collider.half_space("ground")]
    contact = lw.Contact(ball, shapes)
    q, v = at(0, 0, radius + height), np.zeros(6)
    apex, bounced = 0.0, 0
    for _ in range(int(1.3 * np.sqrt(2 * height / G) / dt)):
        step = contact.step(q, v, dt)
        # The momentum of the ball changes by its weight and the impulses, including those of
        # impacts.
        gained = mass * (step.v[3:] - v[3:])
        assert np.allclose(gained, step.impulses.sum(axis=0) + [0, 0, -mass * G * dt], atol=1e-10)
        if step.impacts:
            bounced += 1
            # Gravity acts until the instant of the impact, so the speed there is up to half a step larger
            # than `v`.
            least = mass * (1 + e) * -v[5]
            assert least < step.impulses[0, 2] < least + mass * (1 + e) * 1.5 * G * dt + 1e-9
            assert step.v[5] == pytest.approx(-e * v[5], abs=2 * G * dt)
        q, v = step.q, step.v
        if bounced:
            apex = max(apex, q[2])
    assert bounced == 1
    # The ball moves up, and its energy gives the height.
    assert q[2] - radius + v[5] ** 2 / (2 * G) == pytest.approx(e**2 * height, rel=3e-3)
    assert apex == q[2]


def test_balls_that_collide_keep_their_momentum():
    masses = [1.0, 3.0]
    builder = free("a", masses[0])
    both = free("b", masses[1], builder=builder).build()
    both.gravity = [0, 0, 0]
    shapes = [lw.Collider.sphere(f"{n}_skin", n, 0.1, restitution=1.0) for n in "ab"]
    contact = lw.Contact(both, shapes)
    a, b = both.hinge("a"), both.hinge("b")
    q = np.concatenate([at(0, 0, 0), at(0.25, 0.03, 0)])
    v = np.zeros(12)
    v[a], v[b] = moving(2.0, 0, 0), moving(-0.5, 0.1, 0)

    def books(q, v):
        state = both.state(q, v)
        return state.momentum(), state.kinetic_energy()

    (p0, e0), hits = books(q, v), 0
    for _ in range(400):
        step = contact.step(q, v, 5e-4)
        hits += step.impacts
        q, v = step.q, step.v
    p1, e1 = books(q, v)
    # There is friction only between the two balls, 0.5; the line of centres is not along the
    # motion.
    assert hits >= 1 and np.allclose(p0[3:], p1[3:], atol=1e-12) and e1 <= e0 * (1 + 1e-12)
    assert np.linalg.norm(q[7:10] - q[:3]) > 0.25 and v[b][3] > 0


def test_elastic_balls_in_line_exchange_speeds():
    both = free("b", 1.0, builder=free("a", 1.0)).build()
    both.gravity = [0, 0, 0]
    contact = lw.Contact(both, [lw.Collider.sphere(n, n, 0.1, restitution=1.0) for n in "ab"])
    start = np.concatenate([at(0, 0, 0), at(0.3, 0, 0)])
    t, q, v = contact.simulate(start, np.concatenate([moving(1.0, 0, 0), moving(0, 0, 0)]), 1e-3, 300)
    assert np.allclose(v[-1], np.concatenate([moving(0, 0, 0), moving(1.0, 0, 0)]), atol=1e-9)
    ignoring = lw.Contact(both, [lw.Collider.sphere(n, n, 0.1) for n in "ab"], ignore=[("a", "b")])
    t, q, v = ignoring.simulate(start, np.concatenate([moving(1.0, 0, 0), moving(0, 0, 0)]), 1e-3, 300)
    assert np.allclose(v[-1], np.concatenate([moving(1.0, 0, 0), moving(0, 0, 0)]), atol=1e-12)


def test_ground_of_heights_is_the_plane_that_they_are():
    slope = 0.3
    x = np.linspace(-2, 2, 9)
    heights = np.tile(np.tan(slope) * x, (5, 1))
    ball = free().build()
    down = lw.Collider.terrain("hill", heights, [0.5, 1.0], friction=0.0)
    contact = lw.Contact(ball, [lw.Collider.sphere("skin", "ball", 0.1, friction=0.0), down])
    z = 0.1 / np.cos(slope)
    t, q, v = contact.simulate(at(0, 0, z), np.zeros(6), 1e-3, 200)
    along = -np.array([np.cos(slope), 0, np.sin(slope)])
    assert np.allclose(v[-1, 3:], G * np.sin(slope) * t[-1] * along, rtol=1e-3, atol=1e-6)
    force = contact.step(q[-1], v[-1], 1e-3).forces.sum(axis=0)
    assert np.allclose(force, 2.0 * G * np.cos(slope) * np.array([-np.sin(slope), 0, np.cos(slope)]), rtol=1e-3)


URDF = """<robot name="table"><link name="top"><inertial><mass value="6"/>
    <inertia ixx="0.2" iyy="0.3" izz="0.4" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision name="board"><geometry><box size="1 0.6 0.04"/></geometry></collision></link>{legs}</robot>"""
LEG = """<link name="leg{k}"><inertial><origin xyz="0 0 -0.2"/><mass value="0.5"/>
    <inertia ixx="0.01" iyy="0.01" izz="0.001" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision><origin xyz="0 0 -0.4"/><geometry><sphere radius="0.03"/></geometry></collision></link>
  <joint name="hip{k}" type="revolute"><parent link="top"/><child link="leg{k}"/><origin xyz="{x} {y} 0"/><axis xyz="0 1 0"/>
    <limit lower="0" upper="0.5" effort="50" velocity="5"/></joint>"""


def table(tmp_path):
    legs = [LEG.format(k=k, x=x, y=y) for k, (x, y) in enumerate([(-0.4, -0.25), (-0.4, 0.25), (0.4, -0.25), (0.4, 0.25)])]
    path = tmp_path / "table.urdf"
    path.write_text(URDF.format(legs="".join(legs)))
    return lw.load(path, root="free")


def test_a_table_of_a_file_stands_on_its_legs(tmp_path):
    robot = table(tmp_path)
    shapes = robot.file_colliders()
    assert {(c.name, c.body) for c in shapes} == {("board", "top"), *((f"leg{k}/0", f"leg{k}") for k in range(4))}
    contact = lw.Contact(robot, [*shapes, lw.Collider.half_space("ground")], tolerance=1e-8)
    q = robot.neutral_q()
    q[robot.coordinates("top")[0]] = at(0, 0, 0.43)
    # Springs at the joints hold the legs straight, at their lower limits.
    hips = [robot.coordinates(f"hip{k}") for k in range(4)]

    def springs(t, q, v):
        tau = np.zeros(robot.nv)
        for in_q, in_v in hips:
            tau[in_v] = -200 * (q[in_q] + 0.02) - 5 * v[in_v]
        return tau

    t, qs, vs = contact.simulate(q, np.zeros(robot.nv), 1e-3, 500, torque=springs)
    step = contact.step(qs[-1], vs[-1], 1e-3, springs(0, qs[-1], vs[-1]))
    weight = robot.total_mass * G
    assert np.allclose(step.forces.sum(axis=0), [0, 0, weight], atol=1e-3 * weight)
    assert {p for p in step.pairs} == {("ground", f"leg{k}/0") for k in range(4)}
    assert step.forces[:, 2].min() > 0.2 * weight and step.penetration < 2e-4 and np.abs(vs[-1]).max() < 1e-3
    # Without `limits` the springs bend the legs beyond them.
    free_to_bend = lw.Contact(robot, [*shapes, lw.Collider.half_space("ground")], limits="ignore")
    t, bent, _ = free_to_bend.simulate(q, np.zeros(robot.nv), 1e-3, 500, torque=springs)
    assert bent[-1, hips[0][0]] < -1e-3 and qs[-1, hips[0][0]] > -1e-4
    # Single steps give the same motion, bit for bit.
    contact.reset()
    state = (q, np.zeros(robot.nv))
    for k in range(20):
        step = contact.step(*state, 1e-3, springs(0, *state))
        state = (step.q, step.v)
        assert np.array_equal(step.q, qs[k + 1]) and np.array_equal(step.v, vs[k + 1])


def test_loops_stay_closed_with_contact():
    pin = lw.Hinge.pin([0, 1, 0])
    parts = lw.Builder()
    parts.body("crank", "world", pin, mass=1, com=[0.15, 0, 0], inertia=np.diag([0.001, 0.01, 0.01]), hinge_in_parent=[0, 0, 1])
    parts.body("coupler", "crank", pin, mass=2, com=[0.4, 0, 0], inertia=np.diag([0.001, 0.1, 0.1]), hinge_in_parent=[0.3, 0, 0])
    parts.body("rocker", "world", pin, mass=1, com=[0.3, 0, 0], inertia=np.diag([0.001, 0.05, 0.05]), hinge_in_parent=[0.7, 0, 1])
    parts.loop("knee", "coupler", "rocker", pin, at_a=[0.8, 0, 0], at_b=[0.6, 0, 0])
    linkage = parts.build()
    shapes = [lw.Collider.sphere("end", "coupler", 0.05, at=[0.8, 0, 0]), lw.Collider.half_space("floor", at=[0, 0, 0.9])]
    contact = lw.Contact(linkage, shapes)
    q, v = linkage.close([-1, 0.5, -1.9], np.zeros(3))
    t, qs, vs = contact.simulate(q, v, 1e-3, 600)
    errors = [linkage.constraint_errors(row)["knee"] for row in qs[::50]]
    assert max(errors) < 1e-9
    heights = [linkage.state(row).pose("coupler")[:3, :] @ [0.8, 0, 0, 1] for row in qs]
    assert min(h[2] for h in heights) > 0.9 + 0.05 - 2e-3
    with pytest.raises(lw.LinkworkError, match="knee.*not closed"):
        contact.step([-1, 0.5, -1.5], np.zeros(3), 1e-3)
    # Bodies connected by a loop do not collide, like bodies connected by a hinge: both have a ball at the knee.
    balls = [lw.Collider.sphere("a", "coupler", 0.05, at=[0.8, 0, 0]), lw.Collider.sphere("b", "rocker", 0.05, at=[0.6, 0, 0.0999])]
    assert lw.Contact(linkage, balls).step(q, v, 1e-3).pairs == []
    assert lw.Contact(linkage, balls, neighbours="collide").step(q, v, 1e-3).pairs == [("a", "b")]


def test_mistakes_are_refused():
    ball = free().build()
    skin, ground = lw.Collider.sphere("skin", "ball", 0.1), lw.Collider.half_space("ground")

    def refused(match, *colliders, **settings):
        with pytest.raises(lw.LinkworkError, match=match) as e:
            lw.Contact(ball, list(colliders or (skin, ground)), **settings)
        assert "help" in str(e.value)

    refused("radius is -0.1", lw.Collider.sphere("skin", "ball", -0.1))
    refused("radius is NaN", lw.Collider.sphere("skin", "ball", float("nan")))
    refused("`bal`", lw.Collider.sphere("skin", "bal", 0.1))
    refused("skin", skin, skin)
    refused("friction", skin.material(friction=-1.0), ground)
    refused("restitution", skin.material(restitution=-0.1), ground)
    refused("skim", ignore=[("skim", "ground")])
    refused("`neighbours` is", neighbours="perhaps")
    refused("`limits` is", limits="bounce")
    refused("`margin` is 0", margin=0.0)
    refused("`correction` is 1.5", correction=1.5)
    refused("`tolerance` is NaN", tolerance=float("nan"))
    refused("`slop` is -", slop=-1e-3)
    contact = lw.Contact(ball, [skin, ground])
    q, v = at(0, 0, 1), np.zeros(6)
    for match, args in [
        ("`dt` is 0", (q, v, 0.0)),
        ("`dt` is NaN", (q, v, float("nan"))),
        ("`q`", (q[:3], v, 1e-3)),
        ("`v`", (q, v * np.nan, 1e-3)),
        ("`tau`", (q, v, 1e-3, [1.0])),
        ("overflowed|NaN or infinite", (q, v, 1e300, np.full(6, 1e300))),
    ]:
        with pytest.raises(lw.LinkworkError, match=match):
            contact.step(*args)
    with pytest.raises(lw.LinkworkError, match="no node and no body `bal`"):
        contact.step(q, v, 1e-3, wrenches={"bal": np.zeros(6)})
    with pytest.raises(lw.LinkworkError, match="`torque` has the shape"):
        contact.simulate(q, v, 1e-3, 5, torque=np.zeros((4, 6)))
    with pytest.raises(lw.LinkworkError, match="does not have collision shapes of a file"):
        ball.file_colliders()
    for bad, match in [(np.zeros(3), r"give it the shape \(n, 3\)"), ([[0, 0, np.nan]], "points")]:
        with pytest.raises(lw.LinkworkError, match=match):
            lw.Collider.hull("h", "ball", bad)
    with pytest.raises(lw.LinkworkError, match="1 dimensions"):
        lw.Collider.terrain("h", [0.0, 1.0], [1, 1])


def test_ellipsoids_of_a_file_collide(tmp_path):
    path = tmp_path / "egg.xml"
    path.write_text('<mujoco><worldbody><body name="egg"><freejoint/><geom name="shell" type="ellipsoid" size=".1 .1 .2"/></body></worldbody></mujoco>')
    egg = lw.load(path)
    assert len(egg.file_colliders()) == 1
    contact = lw.Contact(egg, egg.file_colliders() + [lw.Collider.half_space("ground")], tolerance=1e-9)
    # The egg stands on its end, 0.2 m below its centre, and weighs 4/3 pi a b c 1000 kg/m3.
    step = contact.step(at(0, 0, 0.2), np.zeros(6), 1e-3)
    weight = 4 / 3 * np.pi * 0.1 * 0.1 * 0.2 * 1000 * G
    assert np.allclose(step.forces.sum(axis=0), [0, 0, weight], rtol=1e-6, atol=1e-6)


def test_all_shapes_carry_a_weight():
    corners = np.array([[x, y, z] for x in (-0.1, 0.1) for y in (-0.1, 0.1) for z in (-0.1, 0.1)])
    faces = [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]]
    shapes = [
        lw.Collider.box("s", "ball", [0.2, 0.2, 0.2]),
        lw.Collider.cylinder("s", "ball", 0.1, 0.2),
        lw.Collider.capsule("s", "ball", 0.05, 0.1),
        lw.Collider.ellipsoid("s", "ball", [0.3, 0.2, 0.1]),
        lw.Collider.hull("s", "ball", corners),
        lw.Collider.mesh("s", "ball", corners, faces),
    ]
    ball = free().build()
    for shape in shapes:
        contact = lw.Contact(ball, [shape, lw.Collider.half_space("ground")], tolerance=1e-9)
        step = contact.step(at(0, 0, 0.1), np.zeros(6), 1e-3)
        assert np.allclose(step.forces.sum(axis=0), [0, 0, 2 * G], atol=1e-6), shape
        assert str(shape).startswith("Collider(s on ball: ")


RON = """Simulation(
    doc: "A box that slides down a board, with a hidden wall in its way.",
    bodies: {
        "box": (parent: "world", hinge: Free, mass: 2, inertia: [0.02, 0.03, 0.04], initial: (position: [0, 0, 0.06], velocity: [1, 0.2, 0], angular: [0, 0, 2]),
            shapes: [(shape: Box([0.3, 0.2, 0.1]), collide: (friction: 0.4), name: "skin")]),
        "arm": (parent: "box", at: (position: [0, 0, 0.3]), hinge: Pin(axis: [0, 1, 0]), mass: 0.5, inertia: [0.01, 0.01, 0.01], com: [0.1, 0, 0]),
    },
    colliders: {
        "floor": (on: "world", shape: HalfSpace),
        "wall": (on: "world", at: (position: [0.4, 0, 0]), shape: Box([0.1, 2, 1]), hidden: true),
    },
    contact: (friction: 0.6, tolerance: 1e-8, dry: { "hinge:arm": "0.2 N m" }),
    parts: { "Gravity": (model: "environment.uniform_gravity", params: { "acceleration": [0, 0, -9.81] }) },
    step: "1 ms", until: "300 ms",
)"""


def test_a_file_with_contact_moves_as_its_simulation(tmp_path):
    path = tmp_path / "box.ron"
    path.write_text(RON)
    sim = lw.Simulation(path)
    robot = lw.load(path)
    contact = lw.Contact(robot)
    assert contact.colliders == ["box/skin", "floor", "wall"]
    q = robot.initial_q
    v = np.zeros(robot.nv)
    v[robot.hinge("box")] = [0, 0, 2, 1, 0.2, 0]
    t, qs, vs = contact.simulate(q, v, 1e-3, 300)
    sim.run_until(0.3)
    place = robot.state(qs[-1]).pose("box")[:3, 3]
    assert np.allclose(place, sim["box.position"], atol=1e-12) and place[0] > 0.12
    # Without the dry friction of the file the arm swings differently, also because a hidden wall is enabled.
    by_hand = lw.Contact(robot, robot.file_colliders(), tolerance=1e-8)
    t, others, _ = by_hand.simulate(q, v, 1e-3, 300)
    arm = robot.coordinates("arm")[0]
    assert abs(qs[-1, arm][0] - others[-1, arm][0]) > 1e-3
    # With another root the arm keeps its dry friction: it falls with the remaining moment of its weight.
    fixed = lw.load(path, root="fixed")
    t, falls, _ = lw.Contact(fixed).simulate([0.0], [0.0], 1e-3, 50)
    moment = 0.5 * G * 0.1 - 0.2
    assert falls[-1, 0] == pytest.approx(0.5 * moment / fixed.mass_matrix([0.0])[0, 0] * t[-1] ** 2, rel=0.05)


def test_compliant_contact_of_a_file_is_not_taken_for_impulses(tmp_path):
    path = tmp_path / "box.ron"
    path.write_text(RON.replace('contact: (friction: 0.6, tolerance: 1e-8, dry: { "hinge:arm": "0.2 N m" })', "contact: (compliant: (stiffness: 3e5))"))
    robot = lw.load(path)
    with pytest.raises(lw.LinkworkError, match="compliant"):
        lw.Contact(robot)
    assert len(lw.Contact(robot, robot.file_colliders()).colliders) == 3


def test_two_materials_do_to_each_other_what_their_pair_says():
    box = free("box").build()
    shape = lw.Collider.box("hull", "box", [0.1, 0.1, 0.1], friction=0.8).material(name="ice")
    ground = lw.Collider.half_space("ground", friction=0.8).material(name="board")
    slid = {}
    for name, pairs in [("alone", None), ("pair", {("board", "ice"): {"friction": 0.05}})]:
        contact = lw.Contact(box, [shape, ground], pairs=pairs)
        q, v = at(0, 0, 0.1), moving(1.0, 0, 0)
        for _ in range(200):
            step = contact.step(q, v, 1e-3)
            q, v = step.q, step.v
        slid[name] = v[3]
    # By Coulomb's law the speed is 1 m/s minus mu g t.
    assert slid["alone"] == pytest.approx(0.0, abs=1e-9)
    assert slid["pair"] == pytest.approx(1.0 - 0.05 * G * 0.2, rel=1e-6)
    with pytest.raises(lw.LinkworkError, match="(?s)no collider has the material `bord`.*did you mean `board`"):
        lw.Contact(box, [shape, ground], pairs={("bord", "ice"): {"friction": 0.1}})
    with pytest.raises(lw.LinkworkError, match="unknown property `frictoin`"):
        lw.Contact(box, [shape, ground], pairs={("board", "ice"): {"frictoin": 0.1}})
    with pytest.raises(lw.LinkworkError, match="friction is -1"):
        lw.Contact(box, [shape, ground], pairs={("board", "ice"): {"friction": -1.0}})
