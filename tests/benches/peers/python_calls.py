"""Time of calls from Python: Linkwork compared with Pinocchio (`pin`) and MuJoCo, alternately in one process. Results are compared first.

    python tests/benches/peers/python_calls.py          # with linkwork, pin and mujoco installed: tests/benches/robots does it

Rows are medians over the rounds for each program, and of the ratios of the rounds (Linkwork / peer), because the speed of a machine varies.
"""

import statistics
import tempfile
import time
from pathlib import Path

import mujoco
import mujoco.rollout
import numpy as np
import pinocchio as pin

import linkwork

ROUNDS = 15


def spent(call, calls):
    """Return the microseconds per call."""
    start = time.perf_counter()
    for _ in range(calls):
        call()
    return 1e6 * (time.perf_counter() - start) / calls


def row(name, ours, theirs, target, calls=2000, rounds=ROUNDS, per=1):
    """Measure both alternately, and print the µs for each of the `per` operations of a call."""
    ours(), theirs()
    pairs = [(spent(ours, calls) / per, spent(theirs, calls) / per) for _ in range(rounds)]
    a, b = (statistics.median(p[k] for p in pairs) for k in (0, 1))
    ratio = statistics.median(p[0] / p[1] for p in pairs)
    print(f"{name:58} {a:9.3f} µs   peer {b:9.3f} µs   ratio {ratio:.3f}   {target}", flush=True)


def same(what, a, b, tolerance):
    off = np.abs(np.asarray(a) - np.asarray(b)).max()
    assert off < tolerance, f"{what}: {off}"


def arm_urdf():
    """An arm of seven pins; its moments are those of bodies."""
    links = ['<link name="base"/>']
    for k in range(7):
        mass, axis = 4 - 0.5 * k, ("0 0 1", "0 1 0")[k % 2]
        links.append(
            f'<link name="l{k}"><inertial><origin xyz="0.01 0.02 0.1"/><mass value="{mass}"/>'
            '<inertia ixx="0.1" iyy="0.12" izz="0.05" ixy="0.01" ixz="0" iyz="0"/></inertial></link>'
            f'<joint name="j{k}" type="revolute"><parent link="{f"l{k - 1}" if k else "base"}"/><child link="l{k}"/>'
            f'<origin xyz="0 0.01 0.2"/><axis xyz="{axis}"/><limit lower="-3" upper="3" effort="100" velocity="3"/></joint>'
        )
    links.append('<link name="tip"/><joint name="flange" type="fixed"><parent link="l6"/><child link="tip"/><origin xyz="0 0 0.1"/></joint>')
    return f'<robot name="arm">{"".join(links)}</robot>'


def limb(name, at, joints, links, end):
    """Bodies one on another: `joints` axes on each of `links` (length), a geom at the end."""
    text, close = "", ""
    for k, (axes, length) in enumerate(zip(joints, links, strict=True)):
        pins = "".join(f'<joint name="{name}{k}{a}" axis="{dict(x="1 0 0", y="0 1 0", z="0 0 1")[a]}"/>' for a in axes)
        text += (
            f'<body name="{name}{k}" pos="{at}">{pins}<inertial pos="0 0 {-length / 2}" mass="{8 * length + 0.5}" '
            'diaginertia="0.03 0.03 0.01"/>'
        )
        close += "</body>"
        at = f"0 0 {-length}"
    return text + end + close


def humanoid_mjcf():
    """27 degrees of freedom; feet are boxes, hands balls, and only they and the trunk meet the ground."""
    foot = '<geom type="box" size="0.11 0.05 0.03" pos="0.04 0 -0.03" mass="0"/>'
    hand = '<geom type="sphere" size="0.05" mass="0"/>'
    legs = "".join(
        limb(f"{side}leg", f"0 {y} -0.1", ("zxy", "y", "yx"), (0.4, 0.4, 0.06), foot) for side, y in (("l", 0.1), ("r", -0.1))
    )
    arms = "".join(limb(f"{side}arm", f"0 {y} 0.4", ("yxz", "y"), (0.3, 0.25), hand) for side, y in (("l", 0.22), ("r", -0.22)))
    return (
        '<mujoco><compiler angle="radian"/><option timestep="0.002"/><worldbody><geom name="ground" type="plane" size="0 0 1"/>'
        '<body name="pelvis" pos="0 0 1.02"><freejoint/><inertial pos="0 0 0" mass="10" diaginertia="0.1 0.1 0.1"/>'
        f'{legs}<body name="trunk" pos="0 0 0.1"><joint name="waist" axis="0 0 1"/><inertial pos="0 0 0.2" mass="25" diaginertia="0.8 0.7 0.3"/>'
        f'<geom type="sphere" size="0.2" pos="0 0 0.2" mass="0"/>{arms}</body></body></worldbody></mujoco>'
    )


def single_calls(folder):
    path = folder / "arm.urdf"
    path.write_text(arm_urdf())
    m = linkwork.load(path, "fixed")
    model = pin.buildModelFromUrdf(str(path))
    data = model.createData()
    r = np.random.default_rng(1)
    q, v, a = (r.normal(size=7) for _ in range(3))
    tip = model.getFrameId("tip")
    same("rnea", m.inverse_dynamics(q, v, a), pin.rnea(model, data, q, v, a), 1e-9)
    same("aba", m.forward_dynamics(q, v, a), pin.aba(model, data, q, v, a), 1e-7)
    M = np.triu(pin.crba(model, data, q))
    same("crba", np.triu(m.mass_matrix(q)), M, 1e-10)
    pin.framesForwardKinematics(model, data, q)
    same("kinematics", m.state(q).pose("tip"), data.oMf[tip].homogeneous, 1e-10)

    def kinematics():
        pin.framesForwardKinematics(model, data, q)
        return data.oMf[tip].homogeneous

    target = "at most 1"
    row("RNEA of 7 dofs, one call", lambda: m.inverse_dynamics(q, v, a), lambda: pin.rnea(model, data, q, v, a), target)
    row("ABA", lambda: m.forward_dynamics(q, v, a), lambda: pin.aba(model, data, q, v, a), target)
    row("CRBA", lambda: m.mass_matrix(q), lambda: pin.crba(model, data, q), target)
    row("kinematics, pose of the tip as an array", lambda: m.state(q).pose("tip"), kinematics, target)
    robot = linkwork.Robot(m, chains={"arm": ("world", "tip")}, colliders=[])

    def ours():
        robot.q = q
        return robot.tip_pose("arm")

    same("Robot.tip_pose", ours(), kinematics(), 1e-10)
    row("the same by Robot: q set, pose of the tip", ours, kinematics, target)

    n = 4096
    Q, V, A = (r.normal(size=(n, 7)) for _ in range(3))
    out = np.empty((n, 7))

    def loop(call):
        def run():
            for k in range(n):
                out[k] = call(model, data, Q[k], V[k], A[k])

        return run

    target = "at most 0.2"
    for name, ours, theirs in [
        ("inverse dynamics of 4096 states, two threads; pin in a loop", m.inverse_dynamics, pin.rnea),
        ("forward dynamics of 4096 states, two threads; pin in a loop", m.forward_dynamics, pin.aba),
    ]:
        batch = np.empty((n, 7))
        ours(Q, V, A, threads=2, out=batch)
        loop(theirs)()
        same(name, batch, out, 1e-6)
        row(name, lambda f=ours: f(Q, V, A, threads=2, out=batch), loop(theirs), target, calls=3, per=n)
    # Pinocchio's own batch functions are timed if this build has them.
    if hasattr(pin, "rneaInParallel"):
        pool = pin.ModelPool(model, 2)
        column = np.zeros((7, n), order="F")
        T = [np.asfortranarray(x.T) for x in (Q, V, A)]
        for name, ours, theirs in [
            ("inverse dynamics of 4096 states; pin's rneaInParallel", m.inverse_dynamics, pin.rneaInParallel),
            ("forward dynamics of 4096 states; pin's abaInParallel", m.forward_dynamics, pin.abaInParallel),
        ]:
            row(
                name,
                lambda f=ours: f(Q, V, A, threads=2, out=batch),
                lambda f=theirs: f(2, pool, *T, column),
                target,
                calls=3,
                per=n,
            )
    else:
        print("pin has no batches in this build (made without OpenMP): its loop stands for them")
    rollout(m, Q, V, path)


def rollout(m, Q, V, path):
    """1024 arms falling for 50 steps of 1 ms, semi-implicit Euler, two threads."""
    spec = mujoco.MjSpec.from_file(str(path))
    spec.option.timestep = 1e-3
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_EULER
    for flag in (mujoco.mjtDisableBit.mjDSBL_CONSTRAINT, mujoco.mjtDisableBit.mjDSBL_CONTACT):
        spec.option.disableflags |= flag
    model = spec.compile()
    assert model.nv == 7
    n, steps, dt = 1024, 50, 1e-3
    datas = [mujoco.MjData(model) for _ in range(2)]
    state0 = np.zeros((n, mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS)))
    q0, v0 = Q[:n], 0.1 * V[:n]
    state0[:, 1:8], state0[:, 8:15] = q0, v0
    # The arrays for the results exist before the call, as in Linkwork's case.
    state = np.empty((n, steps, state0.shape[1]))
    sensor = np.empty((n, steps, model.nsensordata))

    def theirs():
        with_pool.rollout(model, datas, state0, nstep=steps, state=state, sensordata=sensor)
        return state[:, -1, 1:8]

    q, v, a, tau = np.empty((n, 7)), np.empty((n, 7)), np.empty((n, 7)), np.zeros(7)

    def ours():
        q[:], v[:] = q0, v0
        for _ in range(steps):
            m.forward_dynamics(q, v, tau, threads=2, out=a)
            np.multiply(a, dt, out=a)
            np.add(v, a, out=v)
            np.add(q, dt * v, out=q)
        return q

    with mujoco.rollout.Rollout(nthread=2) as with_pool:
        same("rollout", ours(), theirs(), 1e-8)
        row("a step of an arm, 1024 of them; MuJoCo's rollout", ours, theirs, "at most 0.5", calls=1, rounds=9, per=n * steps)


def humanoid(folder):
    path = folder / "humanoid.xml"
    path.write_text(humanoid_mjcf())
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    m = linkwork.load(path)
    contact = linkwork.Contact(m)
    assert model.nv == m.nv == 27
    start = np.array(m.initial_q) if hasattr(m, "initial_q") else m.neutral_q()
    steps, worst = 250, {}

    def theirs():
        mujoco.mj_resetData(model, data)
        most = 0
        for _ in range(steps):
            mujoco.mj_step(model, data)
            most = max(most, data.ncon)
        worst["MuJoCo"] = most

    def ours():
        contact.reset()
        q, v, most = start, np.zeros(27), 0
        for _ in range(steps):
            done = contact.step(q, v, 0.002)
            q, v = done.q, done.v
            most = max(most, len(done.pairs))
        worst["Linkwork"] = most

    row("a step of 2 ms of a humanoid that falls on its feet", ours, theirs, "at most 1", calls=1, per=steps)
    print(f"  contacts at most: {worst}")
    assert min(worst.values()) > 3, "both stood on the ground"


with tempfile.TemporaryDirectory() as name:
    single_calls(Path(name))
    humanoid(Path(name))
