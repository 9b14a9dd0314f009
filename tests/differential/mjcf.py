"""Random MJCF files, and Linkwork against MuJoCo on each of them."""

import pathlib
import tempfile

import mujoco
import numpy as np

from common import Linkwork, differs, rotation

# MuJoCo would print hundreds of warnings of its solver, which is not compared.
mujoco.set_mju_user_warning(lambda message: None)
LINKWORK = None
FOLDER = pathlib.Path(tempfile.mkdtemp())
# These differences are documented: Linkwork rejects the file with one of these messages.
REJECTED = ["is not supported", "a free joint must be the only joint", "lacks <worldbody>", "<inertial> lacks inertia", "cannot be inverted"]


class Maker:
    def __init__(self, r):
        self.r, self.bodies, self.joints, self.geoms, self.sites = r, [], [], [], []
        self.body_sites, self.fields = [], 0
        self.classes = [None]
        self.radian = r.random() < 0.3

    def n(self, scale=1.0):
        return f"{self.r.uniform(-scale, scale):.5g}"

    def v(self, k, scale=1.0):
        return " ".join(self.n(scale) for _ in range(k))

    def angle(self, scale=2.0):
        a = self.r.uniform(-scale, scale)
        return f"{a if self.radian else np.degrees(a):.5g}"

    def orientation(self):
        r = self.r.random()
        if r < 0.35:
            return ""
        if r < 0.5:
            return f' quat="{self.v(4)}"'
        if r < 0.65:
            return f' euler="{self.angle()} {self.angle()} {self.angle()}"'
        if r < 0.8:
            return f' axisangle="{self.v(3)} {self.angle()}"'
        if r < 0.9:
            return f' xyaxes="{self.v(6)}"'
        return f' zaxis="{self.v(3)}"'

    def maybe(self, p, text):
        return text if self.r.random() < p else ""

    def pose(self, p=0.6):
        return self.maybe(p, f' pos="{self.v(3)}"') + self.orientation()

    def klass(self):
        c = self.r.choice(self.classes)
        return f' class="{c}"' if c else ""

    def joint_attributes(self, kind):
        turns = kind in ("hinge", "ball", None)
        low, high = sorted(self.r.uniform(-2, 2) for _ in range(2))
        if kind == "ball":
            low, high = 0, abs(high) + 0.1
        unit = (1 if self.radian else 180 / np.pi) if turns else 1
        out = self.maybe(0.4, f' range="{low * unit:.5g} {high * unit:.5g}"')
        out = out or self.maybe(0.1, ' range="0 0"')
        out += self.maybe(0.3, f' damping="{abs(self.r.gauss(0, 1)):.4g}"')
        out += self.maybe(0.3, f' armature="{abs(self.r.gauss(0, 0.3)):.4g}"')
        out += self.maybe(0.2, f' stiffness="{abs(self.r.gauss(0, 3)):.4g}"')
        out += self.maybe(0.1, f' springdamper="{self.r.uniform(0, 1):.4g} {self.r.uniform(0, 2):.4g}"')
        out += self.maybe(0.2, f' frictionloss="{abs(self.r.gauss(0, 0.1)):.4g}"') if kind != "free" else ""
        out += self.maybe(0.2, f' springref="{self.angle(1)}"')
        out += self.maybe(0.2, f' actuatorfrcrange="-{self.r.uniform(0, 4):.4g} {self.r.uniform(0, 4):.4g}"')
        return out

    def geom_attributes(self):
        out = self.maybe(0.2, f' density="{self.r.uniform(10, 2000):.5g}"')
        out += self.maybe(0.2, f' mass="{self.r.uniform(0, 3):.4g}"')
        out += self.maybe(0.3, f' contype="{self.r.randrange(0, 8)}"')
        out += self.maybe(0.3, f' conaffinity="{self.r.randrange(0, 8)}"')
        out += self.maybe(0.2, f' group="{self.r.randrange(0, 5)}"')
        out += self.maybe(0.2, f' friction="{self.r.uniform(0, 2):.3g}"')
        out += self.maybe(0.1, f' rgba="{self.r.random():.3g} 0 0 1"')
        out += self.maybe(0.1, ' shellinertia="true"')
        return out

    def geom(self):
        name = f"g{len(self.geoms)}"
        kind = self.r.choice(["sphere", "capsule", "cylinder", "box", "ellipsoid", "mesh"])
        if self.r.random() < 0.06:
            self.geoms.append(name)
            attributes = self.geom_attributes().replace(' shellinertia="true"', "") + ' shellinertia="false"'
            return f'<geom name="{name}" type="hfield" hfield="hill"{self.klass()}{attributes}{self.pose()}/>'
        out = f'<geom name="{name}" type="{kind}"' + self.klass() + self.geom_attributes()
        if kind == "mesh":
            self.geoms.append(name)
            # Classes may have `shellinertia`, which MuJoCo rejects for meshes.
            return out.replace(' shellinertia="true"', "") + f' shellinertia="false" mesh="{self.r.choice(["tetra", "wedge", "cloud"])}"' + self.pose() + "/>"
        if kind != "sphere" and self.r.random() < 0.25:
            out += f' size="{self.r.uniform(0.05, 0.4):.4g}" fromto="{self.v(6)}"'
        else:
            out += f' size="{" ".join(f"{self.r.uniform(0.05, 0.5):.4g}" for _ in range(3))}"' + self.pose()
        self.geoms.append(name)
        return out + "/>"

    def joint(self, kind):
        """A joint of a kind; `default` leaves the attribute `type` out."""
        name = f"j{len(self.joints)}"
        kind = None if kind == "default" else kind
        out = f'<joint name="{name}"' + (f' type="{kind}"' if kind else "") + self.klass()
        if kind != "free":
            out += self.maybe(0.7, f' axis="{self.v(3)}"') + self.maybe(0.5, f' pos="{self.v(3)}"')
            out += self.maybe(0.2, f' ref="{self.angle(1)}"')
        out += self.joint_attributes(kind)
        # The range of a class may begin at another number than 0, which MuJoCo rejects for ball joints.
        if kind == "ball" and " range=" not in out:
            out += f' range="0 {self.r.uniform(0.1, 2) * (1 if self.radian else 180 / np.pi):.4g}"'
        self.joints.append((name, kind))
        return out + "/>"

    def range(self, key, scale=2.0):
        low, high = sorted(self.r.uniform(-scale, scale) for _ in range(2))
        return self.maybe(0.4, f' {key}="{low:.5g} {high:.5g}"')

    def positive(self, p, key, scale=3.0):
        return self.maybe(p, f' {key}="{self.r.uniform(0.01, scale):.4g}"')

    def tendon_attributes(self):
        out = self.range("range") + self.positive(0.5, "stiffness") + self.positive(0.4, "damping")
        low = self.r.uniform(0, 1)
        return out + self.r.choice(["", f' springlength="{low:.4g}"', f' springlength="{low:.4g} {low + 0.3:.4g}"'])

    def actuator_attributes(self, kind):
        out = self.range("forcerange") + self.maybe(0.4, f' gear="{self.n(3)}"')
        out += ' ctrlrange="0 1"' if kind == "damper" else self.range("ctrlrange")
        if kind == "position":
            out += self.positive(0.5, "kp", 9) + self.positive(0.4, self.r.choice(["kv", "dampratio"]))
        if kind in ("velocity", "damper"):
            out += self.positive(0.6, "kv")
        if kind == "position":
            out += self.positive(0.2, "timeconst")
        if kind == "intvelocity":
            out += ' actrange="-0.5 0.7"' + self.positive(0.5, "kp", 9) + self.positive(0.4, self.r.choice(["kv", "dampratio"]))
        if kind == "cylinder":
            out += self.positive(0.5, self.r.choice(["area", "diameter"])) + self.positive(0.5, "timeconst") + self.maybe(0.5, f' bias="{self.v(3)}"')
        if kind == "general":
            out += self.maybe(0.3, self.dynamics())
            out += self.maybe(0.5, f' gaintype="{self.r.choice(["fixed", "affine"])}"') + self.maybe(0.6, f' gainprm="{self.v(3, 4)}"')
            out += self.maybe(0.5, f' biastype="{self.r.choice(["none", "affine"])}"') + self.maybe(0.6, f' biasprm="{self.v(3, 4)}"')
        return out

    def devices(self):
        # A name inside a replication stands for all of its copies.
        scalar = [n for n, kind in self.joints if kind in ("hinge", "slide", None, "replicated")]
        if not scalar:
            return ""
        tendons, out = [], "<tendon>"
        for k in range(self.r.randrange(0, 3)):
            inside = "".join(f'<joint joint="{n}" coef="{self.n(2)}"/>' for n in self.r.sample(scalar, self.r.randrange(1, min(3, len(scalar)) + 1)))
            out += f'<fixed name="t{k}"{self.klass()}{self.tendon_attributes()}>{inside}</fixed>'
            tendons.append(f"t{k}")
        if len(self.sites) > 1 and self.r.random() < 0.7:
            inside = "".join(f'<site site="{s}"/>' for s in self.r.sample(self.sites, self.r.randrange(2, min(4, len(self.sites)) + 1)))
            out += f'<spatial name="line"{self.klass()}{self.tendon_attributes()}>{inside}</spatial>'
            tendons.append("line")
        out += "</tendon><actuator>"
        for k in range(self.r.randrange(0, 4)):
            kind = self.r.choice(["motor", "position", "velocity", "damper", "general"])
            on = f'tendon="{self.r.choice(tendons)}"' if tendons and self.r.random() < 0.3 else f'joint="{self.r.choice(scalar)}"'
            out += f'<{kind} name="a{k}" {on}{self.klass()}{self.actuator_attributes(kind)}/>'
        for k in range(self.r.randrange(0, 2)):
            kind = self.r.choice(["intvelocity", "cylinder"])
            out += f'<{kind} name="w{k}" joint="{self.r.choice(scalar)}"{self.klass()}{self.actuator_attributes(kind)}/>'
        if self.body_sites and self.r.random() < 0.5:
            on = f'site="{self.r.choice(self.body_sites)}" gear="{self.v(6)}"'
            on += self.maybe(0.5, f' refsite="{self.r.choice(self.sites)}"')
            out += f'<general name="thrust" {on}{self.klass()}{self.maybe(0.5, self.dynamics())}/>'
        return out + "</actuator>" + self.couplings(scalar)

    def dynamics(self):
        """The activation of a general actuator."""
        kind = self.r.choice(["none", "integrator", "filter", "filterexact"])
        out = f' dyntype="{kind}" dynprm="{self.r.uniform(0.01, 2):.4g}"'
        return out + (self.range("actrange") if kind != "none" else "")

    def couplings(self, scalar):
        """Equalities of joints, with polynomials up to the fourth degree."""
        out = "<equality>"
        for k in range(self.r.randrange(0, 3) if len(scalar) > 1 else 0):
            y, x = self.r.sample(scalar, 2)
            second = self.maybe(0.8, f' joint2="{x}"')
            out += f'<joint name="law{k}" joint1="{y}"{second} polycoef="{self.v(self.r.randrange(1, 6))}"/>'
        return out + "</equality>"

    def body(self, depth):
        name = f"b{len(self.bodies)}"
        self.bodies.append(name)
        out = f'<body name="{name}"' + self.pose() + self.maybe(0.1, f' gravcomp="{self.n(2)}"')
        c = self.klass()
        out += c.replace("class", "childclass") + ">" if self.r.random() < 0.3 else ">"
        free = depth == 0 and self.r.random() < 0.25
        if free:
            out += self.r.choice([f'<freejoint name="j{len(self.joints)}"/>', self.joint("free")])
            if "freejoint" in out:
                self.joints = [j for j in self.joints if j[0] != f"j{len(self.joints) - 1}" or j[1] != "free"]
                name = f"j{len(self.joints)}"
                out = out[: out.index("<freejoint")] + f'<freejoint name="{name}"/>'
                self.joints.append((name, "free"))
        else:
            # MuJoCo rejects a rotation after a ball joint.
            kinds = ["hinge", "hinge", "hinge", "slide", "ball", None]
            for _ in range(self.r.choice([0, 1, 1, 1, 2, 3])):
                kind = self.r.choice(kinds)
                kinds = ["slide"] if kind == "ball" else kinds
                out += self.joint(kind or "default")
        if self.r.random() < 0.3:
            i = sorted(self.r.uniform(0.1, 1) for _ in range(3))
            # With equality, round-off decides whether MuJoCo balances or rejects the moments.
            i[2] = min(i[2], 0.99 * (i[0] + i[1]))
            text = f'mass="{self.r.uniform(0.1, 4):.4g}" pos="{self.v(3)}"'
            if self.r.random() < 0.5:
                out += f'<inertial {text} diaginertia="{i[0]:.4g} {i[1]:.4g} {i[2]:.4g}"{self.orientation()}/>'
            else:
                out += f'<inertial {text} fullinertia="{i[0] + 1:.4g} {i[1] + 1:.4g} {i[2] + 1:.4g} {self.v(3, 0.1)}"/>'
        for _ in range(self.r.randrange(1, 3)):
            g = self.geom()
            out += self.maybe(0.2, f"<frame{self.pose()}>") or ""
            out += g + ("</frame>" if out.endswith(">") and out.rstrip().split("<")[-1].startswith("frame") else "")
        if self.r.random() < 0.4:
            out += f'<site name="s{len(self.sites)}"{self.pose()}/>'
            self.sites.append(f"s{len(self.sites)}")
            self.body_sites.append(self.sites[-1])
        if depth < 3:
            for _ in range(self.r.choice([0, 1, 1, 2])):
                if len(self.bodies) < 9:
                    inner = self.body(depth + 1)
                    out += f"<frame{self.pose()}>{inner}</frame>" if self.r.random() < 0.2 else inner
        return out + "</body>"

    def default(self, depth=0, name=None):
        out = f'<default class="{name}">' if name else "<default>"
        joint = self.joint_attributes(None)
        if self.r.random() < 0.7:
            out += f"<joint{joint}{self.maybe(0.2, f' axis={chr(34)}{self.v(3)}{chr(34)}')}/>"
        if self.r.random() < 0.7:
            out += f"<geom{self.geom_attributes()}{self.orientation()}/>"
        if self.r.random() < 0.3:
            out += f"<tendon{self.tendon_attributes()}/>"
        # In MuJoCo, a class shares its actuator with the class of which it is a copy: a later section of one changes the other, too.
        first = depth > 0 or len(self.classes) == 1
        if first and self.r.random() < 0.4:
            kind = self.r.choice(["motor", "position", "velocity", "general", "intvelocity", "cylinder"])
            out += f"<{kind}{self.actuator_attributes(kind)}/>"
        if depth < 2:
            for _ in range(self.r.randrange(0, 3)):
                inner = f"c{len(self.classes)}"
                self.classes.append(inner)
                out += self.default(depth + 1, inner)
        return out + "</default>"

    def file(self):
        r = self.r
        out = "<mujoco><compiler" + (' angle="radian"' if self.radian else "")
        out += self.maybe(0.3, f' eulerseq="{"".join(r.choice("xyzXYZ") for _ in range(3))}"')
        out += self.maybe(0.1, ' inertiafromgeom="true"') + self.maybe(0.1, ' boundmass="0.5"')
        out += self.maybe(0.1, ' boundinertia="0.05"') + self.maybe(0.1, ' settotalmass="12"')
        out += self.maybe(0.1, ' balanceinertia="true"') + self.maybe(0.1, ' inertiagrouprange="0 2"') + "/>"
        for _ in range(r.randrange(0, 3)):
            out += self.default()
        filling = r.choice(["", ' inertia="exact"', ' inertia="shell"', ' inertia="convex"'])
        out += f'<asset><mesh name="tetra"{filling} vertex="0 0 0 1 0 0 0 1 0 0 0 1" face="0 2 1 0 1 3 0 3 2 1 2 3"/>'
        out += f'<mesh name="wedge"{filling} scale="{r.uniform(0.2, 2):.3g} 1 1" refpos="{self.v(3)}" vertex="0 0 0 1 0 0 0 1 0 0 0 2 1 0 2 0 1 2" face="0 2 1 3 4 5 0 1 4 0 4 3 1 2 5 1 5 4 2 0 3 2 3 5"/>'
        out += f'<mesh name="cloud" vertex="{self.v(3 * r.randrange(8, 30))}"/>'
        rows, columns = r.randrange(2, 6), r.randrange(2, 6)
        heights = self.maybe(0.9, f' elevation="{self.v(rows * columns)}"')
        sizes = " ".join(f"{r.uniform(0.1, 2):.4g}" for _ in range(4))
        out += f'<hfield name="hill" nrow="{rows}" ncol="{columns}" size="{sizes}"{heights}/></asset>'
        world = "".join(self.body(0) for _ in range(r.randrange(1, 3)))
        if r.random() < 0.2:
            name = f"j{len(self.joints)}"
            count = r.randrange(2, 12)
            world += f'<replicate count="{count}" offset="{self.v(3)}" euler="{self.angle()} 0 {self.angle()}" sep="-"><body name="rep" pos="{self.v(3)}"><joint name="{name}" axis="{self.v(3)}"/><geom size="0.1"/></body></replicate>'
            width = len(str(count))
            self.joints += [(f"{name}-{k:0{width}d}", "hinge") for k in range(count)] + [(name, "replicated")]
        for _ in range(r.randrange(0, 2)):
            world += f'<site name="s{len(self.sites)}"{self.pose()}/>'
            self.sites.append(f"s{len(self.sites)}")
        out += f"<worldbody>{world}</worldbody>" + self.devices()
        if len(self.bodies) > 2 and r.random() < 0.4:
            a, b = r.sample(self.bodies, 2)
            out += f'<contact><exclude body1="{a}" body2="{b}"/></contact>'
        if len(self.geoms) > 2 and r.random() < 0.2:
            a, b = r.sample(self.geoms, 2)
            out += f'<contact><pair geom1="{a}" geom2="{b}"/></contact>'
        return out + "</mujoco>"


def make(r):
    return Maker(r).file()


def attached(r):
    """A model and a file that attaches parts of it; what differs between MuJoCo and Linkwork."""
    child = Maker(r)
    (FOLDER / "parts").mkdir(exist_ok=True)
    model = child.file()
    (FOLDER / "parts" / "child.xml").write_text(model)
    parts, outer = [], Maker(r)
    for k in range(r.randrange(1, 3)):
        part = r.choice([f' body="{r.choice(child.bodies)}"'] * 3 + [""])
        attach = f'<attach model="child"{part} prefix="p{k}_"/>'
        parts.append(f"<frame{outer.pose()}>{attach}</frame>" if r.random() < 0.5 else attach)
    if r.random() < 0.5:
        parts[0] = f'<body name="base"{outer.pose()}><joint name="base" axis="{outer.v(3)}"/><geom size="0.2"/>{parts[0]}</body>'
    world = "".join(parts)
    if r.random() < 0.2:
        world = f'<replicate count="2" offset="{outer.v(3)}" sep="_">{world}</replicate>'
    text = "<mujoco><compiler" + (' angle="radian"' if outer.radian else "") + "/>" + outer.maybe(0.5, outer.default())
    text += f'<asset><model name="child" file="parts/child.xml"/></asset><worldbody>{world}</worldbody></mujoco>'
    file = FOLDER / "attached.xml"
    file.write_text(text)
    result = compare_file(file, model)
    if result not in (None, "skip"):
        result += f"\n{text}\n{model}"
    return result


CASES = {"attach": attached}


def compare(text):
    """None where both agree, `skip` where MuJoCo rejects the file, else what differs."""
    try:
        m = mujoco.MjModel.from_xml_string(text)
    except ValueError:
        return "skip"
    file = FOLDER / "file.xml"
    file.write_text(text)
    return against(m, file, text)


def compare_file(path, more=""):
    """Like `compare`, but for a file with its meshes, includes and models (`more`: their text); elements without a name in MuJoCo are not compared."""
    try:
        m = mujoco.MjModel.from_xml_path(str(path))
    except ValueError:
        return "skip"
    return against(m, path, pathlib.Path(path).read_text() + more)


def against(m, file, text):
    """Compares a compiled model with what Linkwork reads of its file."""
    global LINKWORK
    LINKWORK = LINKWORK or Linkwork()
    data = mujoco.MjData(m)
    kinds = {0: (7, 6), 1: (4, 3), 2: (1, 1), 3: (1, 1)}
    names = [m.joint(i).name for i in range(m.njnt)]
    rng = np.random.default_rng(m.nv)
    states, expected, laws = [], [], []
    m.opt.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
    m.opt.disableflags &= ~int(mujoco.mjtDisableBit.mjDSBL_GRAVITY)
    for k in range(2):
        q = m.qpos0.copy() if k == 0 else rng.normal(size=m.nq)
        for i in range(m.njnt):
            if m.jnt_type[i] < 2 and k:
                at = m.jnt_qposadr[i] + (3 if m.jnt_type[i] == 0 else 0)
                q[at : at + 4] /= np.linalg.norm(q[at : at + 4])
        v = rng.normal(size=m.nv)
        data.qpos[:], data.qvel[:] = q, v
        mujoco.mj_forward(m, data)
        M = np.zeros((m.nv, m.nv))
        mujoco.mj_fullM(m, data, M)
        nq = lambda i: kinds[int(m.jnt_type[i])][0]
        nv = lambda i: kinds[int(m.jnt_type[i])][1]
        states.append(
            {
                "order": names,
                "q": {n: list(q[m.jnt_qposadr[i] :][: nq(i)]) for i, n in enumerate(names)},
                "v": {n: list(v[m.jnt_dofadr[i] :][: nv(i)]) for i, n in enumerate(names)},
                "gravity": list(m.opt.gravity),
            }
        )
        laws.append(equalities(m, data))
        expected.append((M, data.qfrc_bias.copy(), data.xpos.copy(), data.xmat.copy().reshape(-1, 3, 3)))
    answer = LINKWORK.ask(file, states)
    if "error" in answer:
        known = any(k in answer["error"] for k in REJECTED)
        return "skip" if known else f"rejected: {answer['error']}"
    # MuJoCo takes the shell of an ellipsoid as a difference of two solids, which has five digits.
    five = "shellinertia" in text and "ellipsoid" in text
    # MuJoCo keeps vertices of meshes as 32 bit numbers.
    tolerance = 1e-4 if five else 1e-6 if ' mesh="' in text else 1e-8
    if elsewhere(m, answer):
        return bodies(m, answer, tolerance) or contacts(m, answer) or couplings(m, answer, laws, tolerance) or height_fields(m, answer)
    return bodies(m, answer, tolerance) or joints(m, answer, tolerance) or contacts(m, answer) or dynamics(m, answer, expected, tolerance) or couplings(m, answer, laws, tolerance) or height_fields(m, answer) or devices(m, data, answer, tolerance)


def elsewhere(m, answer):
    """Whether the mass matrix differs for a known reason: moments without a mass, which Linkwork ignores with a warning, or the mass that `boundmass`
    gives to a body without geoms, which MuJoCo puts at the body's `pos`, twice as far from its parent."""
    if any("mass is zero but a moment of inertia" in line for line in answer["ignored"] + answer["doubtful"]):
        return True
    found = {b["name"]: b for b in answer["bodies"]}
    # MuJoCo does not name bodies without a name; Linkwork names them in the order of the file.
    own = [found.get(m.body(i).name) or found.get(f"body{i}") for i in range(1, m.nbody)]
    return any(b and b["mass"] > 0 and not np.any(b["com"]) and np.any(m.body_ipos[i]) and not differs(m.body_ipos[i], m.body_pos[i]) for i, b in enumerate(own, start=1))


def equalities(m, data):
    """Error and derivatives of each equality of joints or tendons, from the rows of MuJoCo's constraints."""
    out = {}
    for row in range(data.nefc):
        if data.efc_type[row] != int(mujoco.mjtConstraint.mjCNSTR_EQUALITY):
            continue
        i = int(data.efc_id[row])
        if m.eq_type[i] in (int(mujoco.mjtEq.mjEQ_JOINT), int(mujoco.mjtEq.mjEQ_TENDON)):
            J = np.ravel(data.efc_J)[row * m.nv : (row + 1) * m.nv]
            scalar = [k for k in range(m.njnt) if m.jnt_type[k] >= 2]
            out[m.eq(i).name] = (data.efc_pos[row], {m.joint(k).name: J[m.jnt_dofadr[k]] for k in scalar})
    return out


def couplings(m, answer, laws, tolerance):
    for state, law in zip(answer["states"], laws):
        if "missing" in state or "" in law:
            continue  # joints or equalities without names
        if set(state["couplings"]) != set(law):
            return f"couplings: {sorted(state['couplings'])} {sorted(law)}"
        for name, (error, factors) in law.items():
            own = state["couplings"][name]
            if differs(own["error"], error, tolerance):
                return f"coupling error: {name} {own['error']} {error}"
            for joint, factor in factors.items():
                if differs(own["factors"].get(joint, 0.0), factor, tolerance):
                    return f"coupling factor: {name} {joint} {own['factors'].get(joint)} {factor}"
    return None


def height_fields(m, answer):
    """Heights of the fields of geoms that collide; MuJoCo keeps them as 32 bit numbers."""
    found = {f["name"]: f for f in answer["height_fields"]}
    for i in range(m.ngeom):
        if int(m.geom_type[i]) != int(mujoco.mjtGeom.mjGEOM_HFIELD) or m.geom(i).name not in found:
            continue
        f, k = found[m.geom(i).name], int(m.geom_dataid[i])
        rows, columns, size = int(m.hfield_nrow[k]), int(m.hfield_ncol[k]), m.hfield_size[k]
        heights = m.hfield_data[m.hfield_adr[k] :][: rows * columns] * size[2]
        spacing = [2 * size[0] / (columns - 1), 2 * size[1] / (rows - 1)]
        if f["columns"] != columns or differs(f["spacing"], spacing) or differs(f["heights"], heights, 1e-7):
            return f"height field: {m.geom(i).name} {f} {heights}"
    return None


def bodies(m, answer, tolerance):
    found = {b["name"]: b for b in answer["bodies"]}
    for i in range(1, m.nbody):
        name = m.body(i).name
        if not name:
            continue
        if name not in found:
            return f"body missing: {name}"
        b = found[name]
        if differs(b["mass"], m.body_mass[i], tolerance):
            return f"mass: {name} {b['mass']} {m.body_mass[i]}"
        # MuJoCo puts the mass that `boundmass` gives to a body without geoms at the body's `pos`, twice as far from its parent.
        nowhere = not np.any(b["com"]) and not differs(m.body_ipos[i], m.body_pos[i])
        if m.body_mass[i] > 0 and not nowhere and differs(b["com"], m.body_ipos[i], tolerance):
            return f"com: {name} {b['com']} {m.body_ipos[i]}"
        R = rotation(*m.body_iquat[i])
        J = R @ np.diag(m.body_inertia[i]) @ R.T
        own = [J[0, 0], J[1, 1], J[2, 2], J[0, 1], J[0, 2], J[1, 2]]
        # Moments without a mass are left out with a warning.
        if m.body_mass[i] > 0 and differs(b["inertia"], own, tolerance):
            return f"inertia: {name} {b['inertia']} {own}"
    return None


def joints(m, answer, tolerance):
    found = {j["name"]: j for j in answer["joints"]}
    if any(not m.joint(i).name for i in range(m.njnt)):
        return None  # states of joints without names cannot be given
    for i in range(m.njnt):
        j, dof, kind = found.get(m.joint(i).name), m.jnt_dofadr[i], m.jnt_type[i]
        if j is None:
            return f"joint missing: {m.joint(i).name}"
        limited = bool(m.jnt_limited[i])
        if kind >= 2:
            lower, upper = (m.jnt_range[i] if limited else (-np.inf, np.inf))
            if differs([float(j["lower"]), float(j["upper"])], [lower, upper]):
                return f"limits: {m.joint(i).name} {j['lower']} {j['upper']} {lower} {upper}"
            if m.jnt_actfrclimited[i]:
                if differs(float(j["effort"]), np.abs(m.jnt_actfrcrange[i]).max()):
                    return f"effort: {m.joint(i).name}"
        if kind == 1 and differs(float(j["ball"]), m.jnt_range[i][1] if limited else np.inf):
            return f"ball limit: {m.joint(i).name}"
        # `springdamper` of a free joint is ignored with a warning.
        automatic = kind == 0 and any("springdamper of a free joint" in line for line in answer["ignored"])
        for name, value in (("damping", m.dof_damping[dof]), ("armature", m.dof_armature[dof])):
            if automatic and name == "damping":
                continue
            if differs(j[name], np.ravel(value)[0], tolerance):
                return f"{name}: {m.joint(i).name} {j[name]} {value}"
        # Joints in line with each other move no inertia: the stiffness of their `springdamper` is rounding
        # in both programs.
        rounding = np.ravel(m.jnt_stiffness[i])[0] < 1e-6 and j["stiffness"] < 1e-6
        if kind != 0 and not rounding and differs(j["stiffness"], np.ravel(m.jnt_stiffness[i])[0], tolerance):
            return f"stiffness: {m.joint(i).name} {j['stiffness']} {m.jnt_stiffness[i]}"
        if kind >= 2 and np.ravel(m.jnt_stiffness[i])[0] > 0:
            if differs(j["rest"], m.qpos_spring[m.jnt_qposadr[i]]):
                return f"spring reference: {m.joint(i).name}"
        if kind >= 2 and differs(j["friction"], m.dof_frictionloss[dof]):
            return f"friction: {m.joint(i).name}"
    return None


def contacts(m, answer):
    # Meshes without a file do not collide here, with a warning.
    mesh = int(mujoco.mjtGeom.mjGEOM_MESH)
    odd = {m.geom(i).name for i in range(m.ngeom) if int(m.geom_type[i]) == mesh}
    ours = {tuple(sorted(p)) for p in answer["contacts"] if not odd & set(p)}
    excluded = {int(s) for s in m.exclude_signature}
    pairs = {tuple(sorted((m.geom(a).name, m.geom(b).name))) for a, b in zip(m.pair_geom1, m.pair_geom2)}
    theirs = set()
    for a in range(m.ngeom):
        for b in range(a + 1, m.ngeom):
            one, two = m.geom(a).name, m.geom(b).name
            x, y = int(m.geom_bodyid[a]), int(m.geom_bodyid[b])
            if not one or not two or odd & {one, two} or m.body_weldid[x] == m.body_weldid[y]:
                continue
            key = tuple(sorted((one, two)))
            meet = (m.geom_contype[a] & m.geom_conaffinity[b]) or (m.geom_contype[b] & m.geom_conaffinity[a])
            out = (min(x, y) << 16) + max(x, y) in excluded
            if key in pairs or (meet and not out):
                theirs.add(key)
    return None if ours == theirs else f"contacts: only here {ours - theirs}, only MuJoCo {theirs - ours}"


def dynamics(m, answer, expected, tolerance):
    if any(not m.joint(i).name for i in range(m.njnt)):
        return None
    for state, (M, bias, xpos, xmat) in zip(answer["states"], expected):
        if "missing" in state:
            return f"state: {state['missing']}"
        for i in range(1, m.nbody):
            if not m.body(i).name:
                continue
            p = state["poses"][m.body(i).name]
            if differs(p[:3], xpos[i]) or differs(rotation(*p[3:]), xmat[i]):
                return f"pose: {m.body(i).name}"
        if differs(state["M"], M.T, tolerance):
            return "mass matrix: "
        # Products of rates and differences of inertias: round-off of single precision is larger in them.
        if differs(state["bias"], bias, 10 * tolerance if tolerance > 1e-8 else tolerance):
            return f"bias: {state['bias']} {bias}"
    return None


def along_wrench(m, data, gear, site, reference=None):
    """Length and rate of a wrench on a site, from MuJoCo's poses and Jacobians of sites."""

    def frame(i):
        linear, angular = np.zeros((3, m.nv)), np.zeros((3, m.nv))
        mujoco.mj_jacSite(m, data, linear, angular, i)
        return data.site_xmat[i].reshape(3, 3), data.site_xpos[i], linear @ data.qvel, angular @ data.qvel

    R, p, v, w = frame(site)
    if reference is None:
        return np.array([0.0, gear[:3] @ R.T @ v + gear[3:] @ R.T @ w])
    R0, p0, v0, w0 = frame(reference)
    quat, turn = np.zeros(4), np.zeros(3)
    mujoco.mju_mat2Quat(quat, (R0.T @ R).ravel())
    mujoco.mju_quat2Vel(turn, quat, 1)
    speed = R0.T @ (v - v0 - np.cross(w0, p - p0))
    return np.array([gear[:3] @ R0.T @ (p - p0) + gear[3:] @ turn, gear[:3] @ speed + gear[3:] @ R0.T @ (w - w0)])


def devices(m, data, answer, tolerance):
    """Forces of actuators, tendons and `gravcomp` at the last state, with random controls."""
    places = {(j["body"], j["subhinge"]): j["name"] for j in answer["joints"] if j["count"]}
    found = {d["name"]: d["kind"] for d in answer["devices"] if "Actuator" in d["kind"]}
    lines = {d["name"]: d["kind"]["Tendon"] for d in answer["devices"] if "Tendon" in d["kind"]}
    data.ctrl[:] = np.random.default_rng(m.nu).normal(size=m.nu) * 2
    if m.na:
        data.act[:] = np.random.default_rng(m.na).normal(size=m.na)
    mujoco.mj_forward(m, data)

    def length(of, tendon, trn=()):
        total = np.zeros(2)
        if "Wrench" in of:
            gear, name = np.array(of["Wrench"]["gear"]), next(iter(of["Wrench"]["site"].values()))
            reference = of["Wrench"]["reference"]
            theirs = [m.site(int(k)).name for k in trn if k >= 0]
            own = [name] + ([next(iter(reference.values()))] if reference else [])
            if own != theirs:
                return np.full(2, np.nan)
            return along_wrench(m, data, gear, *(m.site(n).id for n in own))
        if "Line" in of:
            # The sites are compared, and the length follows from them.
            sites = [next(iter(s.values())) for s in of["Line"]["sites"]]
            adr, num = m.tendon_adr[tendon], m.tendon_num[tendon]
            theirs = [m.site(int(m.wrap_objid[k])).name for k in range(adr, adr + num)]
            gear = of["Line"]["gear"]
            return gear * np.array([data.ten_length[tendon], data.ten_velocity[tendon]]) if sites == theirs else total
        for t in of["Joints"]:
            i = m.joint(places[t["coordinate"]["body"], t["coordinate"]["subhinge"]]).id
            total += t["factor"] * np.array([data.qpos[m.jnt_qposadr[i]], data.qvel[m.jnt_dofadr[i]]])
        return total

    bound = lambda x, pair: x if pair is None else min(max(x, pair[0]), pair[1])
    for i in range(m.nu):
        name = m.actuator(i).name
        if not name:
            continue
        if name not in found:
            if any(f"`{name}`" in line or f"[{name}]" in line for line in answer["ignored"]):
                continue
            return f"actuator missing: {name}"
        # The damping ratio of a negative stiffness is not a number in MuJoCo, and that of a length that no joint changes is round-off. The
        # direction of a line of zero length is arbitrary. Linkwork ignores these with a warning.
        warns = lambda text: any(text in line for line in answer["ignored"])
        if np.isnan(m.actuator_biasprm[i]).any() and warns("the stiffness is negative"):
            continue
        # Both programs use the mass matrix and the moments of the reference configuration.
        M, reference = np.zeros((m.nv, m.nv)), mujoco.MjData(m)
        mujoco.mj_forward(m, reference)
        mujoco.mj_fullM(m, reference, M)
        moment = reference.actuator_moment[reference.moment_rowadr[i] :][: reference.moment_rownnz[i]]
        singular = M.size > 0 and np.linalg.cond(M) > 1e12
        if (singular or np.abs(moment).max(initial=0.0) < 1e-12 or abs(reference.actuator_length[i]) < 1e-12) and warns("no joint changes the length"):
            continue
        a = found[name]["Actuator"]
        l, v = length(a["length"], m.actuator_trnid[i, 0], m.actuator_trnid[i])
        if differs([l, v], [data.actuator_length[i], data.actuator_velocity[i]], tolerance):
            return f"actuator length: {name} {l} {v} {data.actuator_length[i]} {data.actuator_velocity[i]}"
        affine = lambda c: np.dot(np.array(c, float), [1.0, l, v])
        w = bound(data.ctrl[i], a["control"])
        if (a["activation"] is None) != (m.actuator_dyntype[i] == 0):
            return f"activation: {name} {a['activation']} {m.actuator_dyntype[i]}"
        if a["activation"] is not None:
            # The rate of the activation is compared, then the force with the activation of the
            # state.
            time, own = a["activation"]["time_constant"], data.act[m.actuator_actadr[i]]
            rate = w if time is None else (w - own) / time
            if differs(rate, data.act_dot[m.actuator_actadr[i]], tolerance):
                return f"activation rate: {name} {rate} {data.act_dot[m.actuator_actadr[i]]}"
            bounds = list(m.actuator_actrange[i]) if m.actuator_actlimited[i] else None
            if (bounds is None) != (a["activation"]["range"] is None) or (bounds and differs(a["activation"]["range"], bounds)):
                return f"activation range: {name} {a['activation']['range']} {bounds}"
            w = own
        force = affine(a["gain"]) * w + affine(a["bias"])
        limits = m.actuator_forcerange[i] if m.actuator_forcelimited[i] else None
        # `actuatorfrcrange` of the joint is part of the bounds here; in MuJoCo it bounds the joint.
        own = bound(force, a["force"])
        theirs = bound(data.actuator_force[i], a["force"])
        if differs(own, theirs, tolerance) or (a["force"] is None and limits is not None):
            return f"actuator force: {name} {own} {theirs}"
    for i in range(m.ntendon):
        name = m.tendon(i).name
        if not name:
            continue
        if name not in lines:
            if any(f"`{name}`" in line for line in answer["ignored"]):
                continue
            return f"tendon missing: {name}"
        t = lines[name]
        l, v = length(t["length"], i)
        if differs([l, v], [data.ten_length[i], data.ten_velocity[i]], tolerance):
            return f"tendon length: {name} {l} {data.ten_length[i]}"
        for key, value in (("stiffness", m.tendon_stiffness[i]), ("damping", m.tendon_damping[i])):
            if differs(t[key], np.ravel(value)[0], tolerance):
                return f"tendon {key}: {name} {t[key]} {value}"
        if differs(t["rest"], m.tendon_lengthspring[i], tolerance):
            return f"tendon rest: {name} {t['rest']} {m.tendon_lengthspring[i]}"
        limits = list(m.tendon_range[i]) if m.tendon_limited[i] else None
        if (t["range"] is None) != (limits is None) or (limits and differs(t["range"], limits)):
            return f"tendon range: {name} {t['range']} {limits}"
    shares = {d["kind"]["GravityCompensation"]["body"]: d["kind"]["GravityCompensation"]["share"] for d in answer["devices"] if "GravityCompensation" in d["kind"]}
    for i in range(1, m.nbody):
        name = m.body(i).name
        if name and differs(shares.get(name, 0.0), m.body_gravcomp[i]):
            return f"gravcomp: {name}"
    return None
