"""Public reports about the Python interfaces of other simulators, tested with this one. The list is `tests/hunt/python.md`."""

import numpy as np
import pytest

import linkwork as lw

pytestmark = pytest.mark.usefixtures("at_source")
PENDULUM = "sims/pendulum"
COM, INERTIA = np.array([0.1, 0.2, 0.3]), np.diag([0.3, 0.4, 0.5])


@pytest.fixture
def body():
    free = lw.Builder().body("a", "world", lw.Hinge.free(), mass=2.0, com=COM, inertia=INERTIA)
    return free.node("n", "a", [0.4, -0.1, 0.2]).build()


@pytest.fixture
def state():
    r = np.random.default_rng(1)
    quat = r.normal(size=4)
    return np.r_[1, 2, 3, quat / np.linalg.norm(quat)], r.normal(size=6)


def test_results_do_not_change_later(body, state):
    """mujoco-py #610, dm_control #34, MFrontGenericInterfaceSupport #290: arrays that are views of the simulator's memory."""
    q, v = state
    now = body.state(q, v)
    place = now.position("n")
    kept = place.copy()
    q[:3] = 99
    assert np.array_equal(now.position("n"), kept)
    # See grid2op #151: changes to a result do not affect the simulator.
    place[:] = 7
    assert np.array_equal(now.position("n"), kept)
    sim = lw.Simulation(PENDULUM)
    log = sim.log(["bob.angle"], rate=50)
    sim.run_until(0.5)
    angles = log["bob.angle"]
    kept = angles.copy()
    sim.run_until(1)
    assert len(angles) == 26 and np.array_equal(angles, kept) and len(log["bob.angle"]) == 51


def test_velocities_jacobians_and_positions_agree(body, state):
    """bullet3 #2429, pinocchio #1759, #417, #901: a Jacobian of another point or in other axes than the velocity."""
    q, v = state
    jacobian, velocity = body.node_jacobian(q, "n"), body.state(q, v).velocity("n")
    assert np.abs(jacobian @ v - velocity).max() < 1e-14
    h = 1e-6
    ahead, behind = (body.state(body.integrate(q, s * h * v), v).position("n") for s in (1, -1))
    assert np.abs((ahead - behind) / (2 * h) - velocity[3:]).max() < 1e-9


def test_the_velocity_of_a_body_is_of_its_frame(body, state):
    """IsaacLab #942, pinocchio #1381: velocity of the frame or of the centre of mass."""
    q, v = state
    at = body.state(q, v)
    turn, speed = at.velocity("a")[:3], at.velocity("a")[3:]
    R = np.asarray(at.pose("a")[1]) if isinstance(at.pose("a"), tuple) else np.asarray(at.pose("a"))[:3, :3]
    arm = R @ COM
    momentum = at.momentum()
    assert np.abs(momentum[3:] - 2.0 * (speed + np.cross(turn, arm))).max() < 1e-13


def test_quaternions_are_xyzw_and_any_length_is_the_same_attitude(body, state):
    """pinocchio #1122, RoboManipBaselines PR 11: order of the quaternion, and one without unit length."""
    q, v = state
    assert np.array_equal(body.neutral_q(), [0, 0, 0, 0, 0, 0, 1])
    twice = q.copy()
    twice[3:] *= 2
    assert np.abs(body.state(twice, v).position("n") - body.state(q, v).position("n")).max() < 1e-15
    assert abs(body.state(twice, v).kinetic_energy() - body.state(q, v).kinetic_energy()) < 1e-14
    # A zero quaternion is not an attitude: it raises an error, here and in a table of states.
    zeros = np.zeros(7)
    for ask in (
        lambda: body.state(zeros, v),
        lambda: body.integrate(zeros, v),
        lambda: body.difference(zeros, q),
        lambda: body.mass_matrix(np.stack([q, zeros])),
        lambda: body.inverse_dynamics(zeros, v, v),
        lambda: body.inverse_kinematics(zeros, {"n": [0, 0, 0]}),
        lambda: body.simulate(zeros, v, dt=1e-3, steps=1),
    ):
        with pytest.raises(lw.LinkworkError, match="the quaternion at index (3|10) has length zero"):
            ask()


def test_a_quaternion_of_zeros_does_not_hide_a_collision():
    """Poses with NaN touch nothing: a robot inside a rock would be valid."""
    free = lw.Builder().body("a", "world", lw.Hinge.free(), mass=2.0, com=COM, inertia=INERTIA)
    free = free.body("l", "a", lw.Hinge.pin([0, 1, 0]), mass=1, com=[0.1, 0, 0], inertia=0.1 * np.eye(3)).build()
    shapes = [lw.Collider.sphere("hand", "l", 0.1), lw.Collider.sphere("rock", "world", 1.0)]
    zeros, good = np.zeros(8), np.r_[0, 0, 0, 0, 0, 0, 1, 0]
    collisions = lw.Collisions(free, shapes)
    robot = lw.Robot(free, chains={"arm": ("a", "l")}, colliders=shapes)
    assert collisions.collides(good) and not robot.is_valid(good)
    for ask in (
        lambda: collisions.collides(zeros),
        lambda: collisions.collides(np.stack([good, zeros])),
        lambda: robot.is_valid(zeros),
        lambda: setattr(robot, "q", zeros),
        lambda: lw.Contact(free, shapes).step(zeros, np.zeros(7), dt=1e-3),
    ):
        with pytest.raises(lw.LinkworkError, match="the quaternion at index (3|11) has length zero"):
            ask()


def test_what_overflows_is_refused(body, state):
    """A state never returns numbers that are not finite."""
    q, v = state
    at = body.state(q, v * 1e200)
    for ask in (at.kinetic_energy, lambda: at.bias_acceleration("n")):
        with pytest.raises(lw.LinkworkError):
            ask()


def test_arrays_of_any_layout_are_read_as_numpy_reads_them(body, state):
    """pybind11 users: strided, reversed, Fortran, integer and single-precision arrays."""
    q, v = state
    want = body.mass_matrix(q)
    wide = np.zeros((7, 3))
    wide[:, 1] = q
    assert np.array_equal(body.mass_matrix(wide[:, 1]), want)
    assert np.array_equal(body.mass_matrix(q[::-1].copy()[::-1]), want)
    rows = np.asfortranarray(np.tile(q, (3, 1)))
    assert np.array_equal(body.mass_matrix(rows)[2], want)
    assert np.abs(body.mass_matrix(q.astype(np.float32)) - want).max() < 1e-6
    for wrong in (q[:, None], q[:6], 0.3, q.astype(complex), np.full(7, np.nan)):
        with pytest.raises(lw.LinkworkError):
            body.mass_matrix(wrong)


def test_a_reset_acts_at_once_and_an_action_is_held(tmp_path):
    """bullet3 #2027: a reset of position and rate. Gymnasium: an action applies until the next one."""
    sim = lw.Simulation(PENDULUM)
    sim["bob.angle"], sim["bob.rate"] = 0.0, 2.0
    sim.run_until(0.001)
    assert abs(sim["bob.angle"] - 0.002) < 1e-6
    cart = tmp_path / "cart.ron"
    cart.write_text(
        """Simulation(
            bodies: { "cart": (parent: "world", hinge: Slider([1, 0, 0]), mass: 2, inertia: [1, 1, 1]) },
            parts: { "Force": (model: "actuators.torque_drive", bind: { "shaft": "hinge:cart" }), "Supply": (model: "power.ideal_supply", params: { "voltage": 24 }) },
            connect: [("Force.supply", "Supply.terminal")], gravity: "none", step: "1 ms",
        )"""
    )
    sim = lw.Simulation(str(cart))
    sim["Force.torque"] = 4.0
    for k in range(50):
        sim.run_until((k + 1) * 0.02)
    assert abs(sim["cart.speed"] - 2) < 1e-12 and abs(sim["cart.displacement"] - 1) < 1e-12


def test_episodes_of_one_seed_are_the_same(tmp_path):
    """gymnasium: reset(seed) repeats the episode, another seed gives another one."""
    noisy = tmp_path / "noisy.ron"
    noisy.write_text(NOISY)

    def episode(seed):
        sim = lw.Simulation(str(noisy), seed=seed)
        sim.run_until(0.5)
        return sim["S.angular.y"], sim.state_hash

    assert episode(3) == episode(3) and episode(3) != episode(4)


def test_a_loop_of_periods_does_not_drift():
    """Reference-FMUs #346, FMPy #887: a loop that adds its period to the time."""
    sim = lw.Simulation(PENDULUM)
    rounds = 0
    while sim.time < 1.0 - 1e-9:
        sim.run_until(sim.time + 0.02)
        rounds += 1
    assert (rounds, sim.time) == (50, 1.0)


def test_a_fork_shares_nothing_with_its_original():
    """rebound #736, sncosmo #154, tfel #567: a copy of a simulation whose changes reach the original."""
    sim = lw.Simulation(PENDULUM)
    sim.run_until(0.3)
    other, before = sim.fork(), sim.state_hash
    assert other.state_hash == before and other.time == sim.time
    other["bob.rate"] = 5.0
    other.run_until(1)
    assert sim.state_hash == before and sim.time == 0.3
    sim.run_until(1)
    whole = lw.Simulation(PENDULUM)
    whole.run_until(1)
    assert sim.state_hash == whole.state_hash != other.state_hash


def test_a_value_of_another_length_changes_nothing():
    """bipedal-locomotion-framework #851: a shorter vector ends the interpreter, a longer one is accepted."""
    sim = lw.Simulation(PENDULUM)
    sim.run_until(0.2)
    before = sim.state_hash
    for wrong in ([], [0.1, 0.2], [[0.1, 0.2]], np.zeros(7)):
        with pytest.raises(lw.LinkworkError, match="bob.angle"):
            sim["bob.angle"] = wrong
    assert sim.state_hash == before
    sim.run_until(0.4)


def test_a_name_that_does_not_exist_is_an_error(body, state):
    """orocos_kinematics_dynamics #42: a segment that does not exist is a crash."""
    now = body.state(*state)
    for ask in (now.position, now.velocity, lambda name: body.node_jacobian(state[0], name)):
        with pytest.raises(lw.LinkworkError, match="carrot"):
            ask("carrot")
    sim = lw.Simulation(PENDULUM)
    with pytest.raises(lw.LinkworkError, match="carrot"):
        sim["carrot"]
    assert "carrot" not in sim and "bob.angle" in sim


NOISY = """Simulation(
    bodies: { "bob": (parent: "world", hinge: Pin([0, 1, 0]), mass: 1, inertia: [1, 1, 1], initial: (rate: 1)) },
    parts: { "S": (model: "sensors.attitude", rate: "100 Hz", params: { "rate_sigma": 0.1 }, bind: { "mount": "node:bob" }) },
    gravity: "none", step: "1 ms",
)"""


def test_simulations_of_one_process_share_no_random_numbers(tmp_path):
    """botbowl #70, osim-rl #173, baba-is-auto #175: a seed that other instances, or earlier episodes, change."""
    noisy = tmp_path / "noisy.ron"
    noisy.write_text(NOISY)

    def alone(seed):
        sim = lw.Simulation(str(noisy), seed=seed)
        sim.run_until(0.5)
        return sim["S.angular.y"]

    first, second = (lw.Simulation(str(noisy), seed=seed) for seed in (3, 4))
    for k in range(1, 51):
        first.run_until(k * 0.01)
        second.run_until(k * 0.01)
    assert (first["S.angular.y"], second["S.angular.y"]) == (alone(3), alone(4))
    assert first["S.angular.y"] != second["S.angular.y"] and first.seed == 3


def test_results_of_runs_are_separate(tmp_path):
    """prog_algs #84: results of a Monte Carlo analysis that are all the last one."""
    noisy = tmp_path / "noisy.ron"
    noisy.write_text(NOISY)
    logs = []
    for seed in range(4):
        sim = lw.Simulation(str(noisy), seed=seed)
        logs.append(sim.log(["S.angular.y"], rate=100))
        sim.run_until(0.3)
    all_values = np.array([log["S.angular.y"] for log in logs])
    assert all_values.shape == (4, 31)
    assert len({tuple(values) for values in all_values}) == 4
    assert abs(all_values.std() - 0.1) < 0.02 and abs(all_values.mean() - 1) < 0.03
