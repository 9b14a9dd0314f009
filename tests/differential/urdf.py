"""Random URDF files, and Linkwork against Pinocchio on each of them."""

import pathlib
import tempfile

import numpy as np
import pinocchio as pin

from common import Linkwork, differs, rotation

LINKWORK = None
FOLDER = pathlib.Path(tempfile.mkdtemp())


def make(r):
    n = lambda s=1.0: f"{r.uniform(-s, s):.5g}"
    v = lambda k, s=1.0: " ".join(n(s) for _ in range(k))
    maybe = lambda p, text: text if r.random() < p else ""
    origin = lambda: maybe(0.8, f"<origin{maybe(0.7, f' xyz={chr(34)}{v(3)}{chr(34)}')}{maybe(0.6, f' rpy={chr(34)}{v(3, 3)}{chr(34)}')}/>")
    links = r.randrange(2, 9)
    out = f'<robot name="r{r.randrange(9)}">'
    for k in range(links):
        inside = ""
        if k == 0 and r.random() < 0.5:
            pass
        else:
            i = sorted(r.uniform(0.1, 1) for _ in range(3))
            inside += f'<inertial>{origin()}<mass value="{r.uniform(0.1, 3):.5g}"/><inertia ixx="{i[0] + 1:.5g}" iyy="{i[1] + 1:.5g}" izz="{i[2] + 1:.5g}" ixy="{n(0.1)}" ixz="{n(0.1)}" iyz="{n(0.1)}"/></inertial>'
        for kind in ("visual", "collision"):
            if r.random() < 0.3:
                shape = r.choice(['<box size="1 2 3"/>', '<sphere radius="0.2"/>', '<cylinder radius="0.2" length="1"/>'])
                inside += f"<{kind}>{origin()}<geometry>{shape}</geometry></{kind}>"
        out += f'<link name="l{k}">{inside}</link>'
    for k in range(1, links):
        kind = r.choice(["fixed", "revolute", "revolute", "continuous", "prismatic"])
        inside = f'<parent link="l{r.randrange(k)}"/><child link="l{k}"/>' + origin()
        inside += maybe(0.7, f'<axis xyz="{v(3)}"/>') if kind != "fixed" else ""
        if kind in ("revolute", "prismatic"):
            low, high = sorted(r.uniform(-3, 3) for _ in range(2))
            inside += f'<limit effort="{r.uniform(1, 9):.4g}" velocity="{r.uniform(1, 9):.4g}"{maybe(0.9, f" lower={chr(34)}{low:.4g}{chr(34)} upper={chr(34)}{high:.4g}{chr(34)}")}/>'
        inside += maybe(0.3, f'<dynamics damping="{r.uniform(0, 2):.4g}"{maybe(0.5, f" friction={chr(34)}{r.uniform(0, 2):.4g}{chr(34)}")}/>')
        out += f'<joint name="j{k}" type="{kind}">{inside}</joint>'
    return out + "</robot>"


def compare(text):
    """None where both agree, `skip` where Pinocchio rejects the file, else what differs."""
    try:
        m = pin.buildModelFromXML(text)
    except Exception:
        return "skip"
    file = FOLDER / "file.urdf"
    file.write_text(text)
    return against(m, file)


def compare_file(path, packages=()):
    """The same for a file with its meshes, which are searched in `packages`."""
    try:
        m = pin.buildModelFromUrdf(str(path))
    except Exception:
        return "skip"
    return against(m, path, packages)


def against(m, file, packages=()):
    """Compares a model with the mechanism that Linkwork reads. Joints with several rates (floating, planar) stay at their origin, at rest."""
    global LINKWORK
    LINKWORK = LINKWORK or Linkwork()
    d = m.createData()
    joints = [(m.names[i], m.joints[i]) for i in range(1, m.njoints) if m.joints[i].nv == 1]
    names = [name for name, _ in joints]
    rng = np.random.default_rng(m.nv)
    states, expected = [], []
    for k in range(2):
        ours = rng.normal(size=m.nv) * k
        v = np.zeros(m.nv)
        q = pin.neutral(m)
        for _, j in joints:
            v[j.idx_v] = rng.normal()
            if j.nq == 2:
                q[j.idx_q : j.idx_q + 2] = [np.cos(ours[j.idx_v]), np.sin(ours[j.idx_v])]
            else:
                q[j.idx_q] = ours[j.idx_v]
        pin.forwardKinematics(m, d, q)
        pin.updateFramePlacements(m, d)
        M = np.array(pin.crba(m, d, q))
        M = np.triu(M) + np.triu(M, 1).T
        bias = np.array(pin.rnea(m, d, q, v, np.zeros(m.nv)))
        poses = {f.name: d.oMf[i].copy() for i, f in enumerate(m.frames) if f.type == pin.FrameType.BODY}
        states.append(
            {
                "order": names,
                "q": {n: [ours[j.idx_v]] for n, j in joints},
                "v": {n: [v[j.idx_v]] for n, j in joints},
                "gravity": [0, 0, -9.81],
            }
        )
        order = [j.idx_v for _, j in joints]
        expected.append((M[np.ix_(order, order)], bias[order], poses))
    answer = LINKWORK.ask(file, states, packages)
    if "error" in answer:
        return f"rejected: {answer['error']}"
    found = {j["name"]: j for j in answer["joints"]}
    for name, at in joints:
        j = found[name]
        if at.nq == 1:
            own = [float(j[k]) for k in ("lower", "upper", "rate", "effort")]
            theirs = [m.lowerPositionLimit[at.idx_q], m.upperPositionLimit[at.idx_q], m.velocityLimit[at.idx_v], m.effortLimit[at.idx_v]]
            if differs(own, theirs):
                return f"limits: {name} {own} {theirs}"
        if differs([j["damping"], j["friction"]], [m.damping[at.idx_v], m.friction[at.idx_v]]):
            return f"damping or friction: {name} {j['damping']} {j['friction']} {m.damping[at.idx_v]} {m.friction[at.idx_v]}"
    for state, (M, bias, poses) in zip(answer["states"], expected):
        if "missing" in state:
            return f"state: {state['missing']}"
        for name, X in poses.items():
            # A root link `world` without mass is the world itself.
            if name == "world":
                continue
            p = state["poses"].get(name)
            if p is None:
                return f"link missing: {name}"
            if differs(p[:3], X.translation) or differs(rotation(*p[3:]), X.rotation):
                return f"pose: {name} {p} {X}"
        if differs(state["M"], M.T):
            return f"mass matrix: {np.abs(np.reshape(state['M'], M.shape) - M).max():.1e} of {np.abs(M).max():.1e}"
        if differs(state["bias"], bias, 1e-8):
            return f"bias: {state['bias']} {bias}"
    return None
