"""Loops and couplings of a Mechanism: closing, dynamics, rank, simulation."""

import copy
import pickle
import warnings

import numpy as np
import pytest

import linkwork as lw

PIN = lw.Hinge.pin([0.0, 1.0, 0.0])
# : The lengths of crank, coupler, rocker and ground, m.
A, B, C, D = 0.3, 0.8, 0.6, 0.7


def bar(parts, name, parent, length, mass, at=(0.0, 0.0, 0.0)):
    inertia = np.diag([1e-4, mass * length**2 / 12, mass * length**2 / 12])
    return parts.body(
        name, parent, PIN, mass=mass, com=[length / 2, 0, 0], inertia=inertia, hinge_in_parent=at
    )


def four_bar(hinge=PIN):
    """A plane four-bar linkage: crank and rocker on the world, the coupler closed on the rocker."""
    parts = lw.Builder()
    bar(parts, "crank", "world", A, 1.0)
    bar(parts, "coupler", "crank", B, 2.0, (A, 0, 0))
    bar(parts, "rocker", "world", C, 1.5, (D, 0, 0))
    parts.loop("knee", "coupler", "rocker", hinge, at_a=[B, 0, 0], at_b=[C, 0, 0])
    return parts.build()


def closed(linkage, crank=-1.0):
    """The linkage in its upper configuration (z), at a crank angle; rates with the crank at 2 rad/s."""
    q = linkage.close([crank, 0.5, -1.9])
    v = linkage.close(q, [2.0, 0.0, 0.0])[1]
    return q, v * (2.0 / v[0])


def ends(q):
    """Positions of the tips of coupler and rocker in the plane, by trigonometry."""
    direction = lambda angle: np.array([np.cos(angle), -np.sin(angle)])
    tip = A * direction(q[0]) + B * direction(q[0] + q[1])
    return tip, np.array([D, 0.0]) + C * direction(q[2])


def test_closing_is_that_of_trigonometry():
    linkage = four_bar()
    assert linkage.nv == 3
    (loop,) = linkage.constraints
    assert (loop.name, loop.kind, loop.bodies, loop.rows) == ("knee", "loop", ["coupler", "rocker"], 5)
    open_q = [-1.0, 0.5, -1.9]
    tip, knee = ends(open_q)
    # The rows are along the axes of frame A: along the coupler and across it.
    angle = open_q[0] + open_q[1]
    along = np.array([np.cos(angle), -np.sin(angle)])
    across = np.array([-along[1], along[0]])
    error = max(abs((tip - knee) @ along), abs((tip - knee) @ across))
    assert linkage.constraint_errors(open_q)["knee"] == pytest.approx(error, rel=1e-9)
    q, v = closed(linkage)
    tip, knee = ends(q)
    assert np.abs(tip - knee).max() < 1e-12 and linkage.constraint_errors(q)["knee"] < 1e-12
    h = 1e-6
    later = np.subtract(*ends(q + h * v)) - np.subtract(*ends(q - h * v))
    assert np.abs(later / (2 * h)).max() < 1e-8


def test_a_linkage_has_one_degree_of_freedom_and_names_redundant_rows():
    linkage = four_bar()
    q, _ = closed(linkage)
    rank = linkage.constraint_rank(q)
    assert (rank.free, rank.rows, rank.rank, rank.mobility) == (3, 5, 2, 1)
    assert rank.redundant == {"knee": 3}


@pytest.mark.parametrize("solver", ["auto", "embed", "augment", "full"])
def test_dynamics_is_that_of_lagrange_s_equation(solver):
    """M(θ) θ̈ + M'(θ) θ̇²/2 + V'(θ) = Q for the crank angle, with M and V from the tree at closed states."""
    linkage = four_bar()
    q, v = closed(linkage)

    def reduced(theta):
        q = linkage.close([theta, *closed_near(theta)])
        rates = linkage.close(q, [1.0, 0.0, 0.0])[1]
        rates /= rates[0]
        return rates @ linkage.mass_matrix(q) @ rates, linkage.potential_energy(q)

    def closed_near(theta):
        # The guess continues from the known state, so that the solution stays on its branch; then the crank
        # angle is corrected.
        guess = q + (theta - q[0]) * v / v[0]
        return guess[1:]

    def at(theta):
        # `close` moves all coordinates, so the values are returned with the resulting crank angle.
        found = linkage.close([theta, *closed_near(theta)])
        return (found[0], *reduced(theta))

    h = 1e-4
    (t0, m0, v0), (t1, m1, v1) = at(q[0] - h), at(q[0] + h)
    slope_m, slope_v = (m1 - m0) / (t1 - t0), (v1 - v0) / (t1 - t0)
    tau = np.array([0.7, 0.0, 0.0])
    inertia = (v / v[0]) @ linkage.mass_matrix(q) @ (v / v[0])
    want = (tau @ v / v[0] - slope_v - 0.5 * slope_m * v[0] ** 2) / inertia
    motion = linkage.constrained_dynamics(q, v, tau, solver=solver)
    assert motion.vdot[0] == pytest.approx(want, rel=2e-6)
    assert np.allclose(motion.vdot, linkage.constrained_dynamics(q, v, tau).vdot, atol=1e-9)
    # The result differs from that of the tree alone.
    assert abs(linkage.forward_dynamics(q, v, tau)[0] - want) > 0.5


def test_forces_of_the_loop_are_what_the_tree_lacks():
    linkage = four_bar(lw.Hinge.pin([0.0, 1.0, 0.0]))
    q, v = closed(linkage)
    motion = linkage.constrained_dynamics(q, v, [0.0, 0.0, 0.0], solver="augment")
    lacking = linkage.inverse_dynamics(q, v, motion.vdot)
    # The force at the knee follows from the Jacobians of the two tips, in the plane.
    parts = lw.Builder()
    bar(parts, "crank", "world", A, 1.0)
    bar(parts, "coupler", "crank", B, 2.0, (A, 0, 0))
    bar(parts, "rocker", "world", C, 1.5, (D, 0, 0))
    tree = parts.node("tip", "coupler", [B, 0, 0]).node("knee", "rocker", [C, 0, 0]).build()
    rows = tree.node_jacobian(q, "tip")[[3, 5]] - tree.node_jacobian(q, "knee")[[3, 5]]
    force = np.linalg.lstsq(rows.T, lacking, rcond=None)[0]
    assert np.abs(rows.T @ force - lacking).max() < 1e-9
    assert np.linalg.norm(motion.forces["knee"]) == pytest.approx(np.linalg.norm(force), rel=1e-9)
    assert (motion.rows, motion.rank) == (5, 2) and motion.contradiction < 1e-9
    assert motion.redundant == {"knee": 3}


def test_simulating_keeps_loops_closed_and_energy():
    linkage = four_bar()
    q, v = closed(linkage)
    energy = lambda q, v: linkage.kinetic_energy(q, v) + linkage.potential_energy(q)
    t, qs, vs = linkage.simulate(q, v, 1e-3, 2000)
    assert max(linkage.constraint_errors(q)["knee"] for q in qs[::100]) < 1e-11
    start = energy(q, v)
    assert abs(energy(qs[-1], vs[-1]) - start) < 1e-7
    assert np.ptp(qs[:, 0]) > 0.1
    with pytest.raises(lw.LinkworkError, match="`knee` is not closed at the start.*\n  help: start from `q, v = mech"):
        linkage.simulate([-1.0, 0.5, -1.9], v, 1e-3, 1)
    with pytest.raises(lw.LinkworkError, match="the rates at the start violate the constraints"):
        linkage.simulate(q, [1.0, 0.0, 0.0], 1e-3, 1)


def test_couplings_of_builders_and_of_files(tmp_path):
    parts = lw.Builder()
    for name in ("left", "right"):
        bar(parts, name, "world", 0.5, 1.0)
    parts.coupling("differential", {"left": 1.0, "right": 1.0}, 0.2)
    pair = parts.build()
    (c,) = pair.constraints
    assert (c.kind, c.bodies, c.rows) == ("coupling", ["left", "right"], 1)
    q = pair.close([0.3, 0.3])
    assert q.sum() == pytest.approx(0.2, abs=1e-12)
    motion = pair.constrained_dynamics(q, [0.0, 0.0], [1.0, 0.0])
    assert motion.vdot.sum() == pytest.approx(0.0, abs=1e-12)
    lacking = pair.inverse_dynamics(q, [0.0, 0.0], motion.vdot) - [1.0, 0.0]
    assert np.allclose(lacking, motion.forces["differential"][0], atol=1e-12)

    # The second joint is a mimic joint of the URDF, which follows the first at half its angle.
    link = '<link name="{}"><inertial><mass value="1"/><origin xyz="0.1 0 0"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>'
    joint = '<joint name="{0}" type="continuous"><parent link="{1}"/><child link="{2}"/><axis xyz="0 1 0"/>{3}</joint>'
    text = '<robot name="r">' + "".join(link.format(n) for n in ("base", "a", "b"))
    text += joint.format("first", "base", "a", "") + joint.format("second", "base", "b", '<mimic joint="first" multiplier="0.5"/>')
    file = tmp_path / "r.urdf"
    file.write_text(text + "</robot>")
    with pytest.warns(UserWarning, match="second.*satisfy them, the tree algorithms"):
        robot = lw.load(file)
    q = robot.close([0.4, 0.0])
    first, second = (robot.coordinates(n)[0] for n in ("first", "second"))
    assert q[second] == pytest.approx(0.5 * q[first], abs=1e-12)
    for other in (copy.copy(robot), pickle.loads(pickle.dumps(robot))):
        assert [c.name for c in other.constraints] == [c.name for c in robot.constraints]
        assert (other.close([0.4, 0.0]) == q).all()


def test_prescribed_motion_across_a_loop():
    linkage = four_bar(PIN.prescribed())
    (loop,) = linkage.constraints
    assert loop.motions == 1
    with pytest.raises(lw.LinkworkError, match=r"give loop_motions \(1, 3\)"):
        linkage.constraint_errors([0.0, 0.0, 0.0])
    q, _ = closed(four_bar())
    angle = -(q[0] + q[1] - q[2])
    errors = [linkage.constraint_errors(q, loop_motions=[[s * angle, 0, 0]])["knee"] for s in (1, -1)]
    assert min(errors) < 1e-9 and max(errors) > 0.1
    with pytest.raises(lw.LinkworkError, match="linkwork.Simulation"):
        linkage.simulate(q, [0.0, 0.0, 0.0], 1e-3, 1)


def test_inverse_kinematics_keeps_loops_and_couplings(tmp_path):
    parts = lw.Builder()
    bar(parts, "crank", "world", A, 1.0)
    bar(parts, "coupler", "crank", B, 2.0, (A, 0, 0))
    bar(parts, "rocker", "world", C, 1.5, (D, 0, 0))
    parts.loop("knee", "coupler", "rocker", PIN, at_a=[B, 0, 0], at_b=[C, 0, 0])
    linkage = parts.node("point", "coupler", [0.5 * B, 0, 0.2]).build()
    for crank in (-0.4, -1.0, -1.7):
        there = linkage.close([crank, 0.5, -1.9])
        at = linkage.state(there).position("point")
        q = linkage.inverse_kinematics([-1.2, 0.4, -1.8], {"point": at})
        assert np.abs(linkage.state(q).position("point") - at).max() < 2e-9
        assert linkage.constraint_errors(q)["knee"] < 2e-9
        v = linkage.inverse_kinematics_rates(q, {"point": [0, 0, 0, 0.3, 0, 0.1]})
        assert np.abs(v).max() > 0.05 and linkage.constraint_errors(q + 1e-5 * v)["knee"] < 1e-8
    with pytest.raises(lw.LinkworkError, match="not reached") as e:
        linkage.inverse_kinematics([-1.2, 0.4, -1.8], {"point": [9, 0, 0]})
    assert linkage.constraint_errors(e.value.q)["knee"] < 2e-9
    with pytest.raises(lw.LinkworkError, match="loop `knee` does not close") as e:
        linkage.inverse_kinematics([-1.2, 0.4, 0.0], {}, keep=["rocker", "crank"])
    assert linkage.constraint_errors(e.value.q)["knee"] > 1e-3
    given = four_bar(PIN.prescribed())
    q, _ = closed(four_bar())
    angle = -(q[0] + q[1] - q[2])
    with pytest.raises(lw.LinkworkError, match=r"give loop_motions \(1, 3\)"):
        given.inverse_kinematics(q, {})
    motions = min(([[s * angle, 0, 0]] for s in (1, -1)), key=lambda u: given.constraint_errors(q, loop_motions=u)["knee"])
    found = given.inverse_kinematics(q + [0.05, -0.02, 0.01], {}, loop_motions=motions)
    assert given.constraint_errors(found, loop_motions=motions)["knee"] < 2e-9
    # The chain has a coupling.
    chain = lw.Builder()
    bar(chain, "a", "world", 0.5, 1.0)
    bar(chain, "b", "a", 0.5, 1.0, (0.5, 0, 0))
    chain.coupling("half", {"a": 0.5, "b": -1.0})
    m = chain.node("tip", "b", [0.5, 0, 0]).build()
    want = np.array([0.8, 0.4])
    q = m.inverse_kinematics([0.1, 0.5], {"tip": m.state(want).position("tip")})
    assert np.abs(q - want).max() < 1e-7 and abs(0.5 * q[0] - q[1]) < 2e-9


def test_bad_input():
    linkage = four_bar()
    q, v = closed(linkage)
    for call, told in [
        (lambda: linkage.constrained_dynamics(q, v, v, solver="quick"), "`solver` is \"quick\""),
        (lambda: linkage.constrained_dynamics(q[:2], v, v), "q"),
        (lambda: linkage.close([0.0, 0.0, np.nan]), "q"),
        (lambda: linkage.close(q, v, loop_motions=[[0, 0, 0]]), "loop_motions"),
        (lambda: lw.Builder().body("a").loop("l", "a", "b", PIN).build(), "`b`"),
        (lambda: lw.Builder().body("a", "world", PIN).coupling("c", {"b": 1.0}).build(), "`b`"),
        (lambda: lw.Builder().body("a", "world", PIN).coupling("c", {}).build(), "c"),
    ]:
        with pytest.raises((lw.LinkworkError, TypeError, ValueError), match=told):
            call()
    # The linkage cannot close, because its rocker is too far away.
    parts = lw.Builder()
    bar(parts, "crank", "world", A, 1.0)
    bar(parts, "rocker", "world", C, 1.5, (3.0, 0, 0))
    parts.loop("knee", "crank", "rocker", PIN, at_a=[A, 0, 0], at_b=[C, 0, 0])
    with pytest.raises(lw.LinkworkError, match="loop `knee` does not close"):
        parts.build().close([0.1, 3.0])
    # A tree has no constraints, and reports that without an error.
    tree = bar(lw.Builder(), "a", "world", 1.0, 1.0).build()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert tree.constraints == [] and tree.constraint_errors([0.3]) == {}
        assert tree.constraint_rank([0.3]).mobility == 1
        assert (tree.close([0.3]) == [0.3]).all()
        assert tree.constrained_dynamics([0.3], [0.0], [0.0]).vdot == tree.forward_dynamics([0.3], [0.0], [0.0])


def linkage_files(folder):
    """One linkage as MJCF with a `connect`, as URDF with a companion file that contains a loop, and as a simulation in RON with a loop."""
    at = {"crank": 0.0, "rod": 0.2, "rocker": 0.4}
    parents = {"crank": "world", "rod": "crank", "rocker": "world"}
    inertial = '<inertial pos="0.1 0 0" mass="1" diaginertia="0.01 0.01 0.01"/><joint type="hinge" axis="0 0 1"/>'
    mjcf = lambda name, inner="": f'<body name="{name}" pos="{at[name]} 0 0">{inertial}{inner}</body>'
    machine = mjcf("crank", mjcf("rod")) + mjcf("rocker")
    connect = '<equality><connect name="knee" body1="rod" body2="rocker" anchor="0.3 0 0"/></equality>'
    (folder / "machine.xml").write_text(f'<mujoco model="bar"><worldbody>{machine}</worldbody>{connect}</mujoco>')
    link = '<inertial><origin xyz="0.1 0 0"/><mass value="1"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>'
    links = "".join(f'<link name="{name}">{link}</link>' for name in at)
    joints = "".join(
        f'<joint name="{name}_joint" type="continuous"><parent link="{parents[name].replace("world", "base")}"/>'
        f'<child link="{name}"/><origin xyz="{x} 0 0"/><axis xyz="0 0 1"/></joint>'
        for name, x in at.items()
    )
    (folder / "bar.urdf").write_text(f'<robot name="bar"><link name="base"/>{links}{joints}</robot>')
    side = '"knee": (a: (body: "rod", position: [0.3, 0, 0]), b: (body: "rocker", position: [0.1, 0, 0]), hinge: Ball)'
    (folder / "bar.linkwork.ron").write_text(f"Companion(loops: {{ {side} }})")
    body = '"{}": (parent: "{}", at: (position: [{}, 0, 0]), hinge: Pin([0, 0, 1]), mass: 1, com: [0.1, 0, 0], inertia: [0.01, 0.01, 0.01])'
    bodies = ", ".join(body.format(name, parents[name], x) for name, x in at.items())
    loop = '"knee": (a: "rod", at_a: (position: [0.3, 0, 0]), b: "rocker", at_b: (position: [0.1, 0, 0]), hinge: Ball)'
    (folder / "sim.ron").write_text(f'Simulation(doc: "A linkage.", bodies: {{ {bodies} }}, loops: {{ {loop} }}, until: "1 s")')
    return [folder / name for name in ("machine.xml", "bar.urdf", "sim.ron")]


def test_loops_of_files_arrive(tmp_path):
    """The loop of each file is a constraint of its mechanism, and closes the same linkage."""
    closed = []
    for path in linkage_files(tmp_path):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            linkage = lw.load(path)
        (loop,) = linkage.constraints
        assert (linkage.nv, loop.kind, sorted(loop.bodies)) == (3, "loop", ["rocker", "rod"]), path
        order = [linkage.bodies.index(name) for name in ("crank", "rod", "rocker")]
        q = np.empty(3)
        q[np.argsort(np.argsort(order))] = [0.6, -0.9, 0.5]
        assert linkage.constraint_errors(q)[loop.name] > 1e-3
        q = linkage.close(q)
        assert linkage.constraint_errors(q)[loop.name] < 1e-12
        closed.append([q[k] for k in np.argsort(np.argsort(order))])
    for other in closed[1:]:
        assert other == pytest.approx(closed[0], abs=1e-9)
