"""Random SDF files, and Linkwork against Drake on each of them."""

import itertools
import logging
import pathlib
import tempfile
import xml.etree.ElementTree as ET

import numpy as np
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import BodyIndex

from common import Linkwork, differs, rotation

logging.getLogger("drake").setLevel(logging.CRITICAL)
LINKWORK = None
FOLDER = pathlib.Path(tempfile.mkdtemp())
# Other models include this model.
SUB = """<sdf version="1.9"><model name="sub"><pose>0.1 0.2 0.3 0.4 0.5 0.6</pose>
<link name="s0"><pose>0.3 0 0 0 0.7 0</pose><inertial><mass>2</mass><inertia><ixx>1</ixx><iyy>1.2</iyy><izz>1.3</izz></inertia></inertial></link>
<link name="s1"><pose relative_to="s0">0 0.5 0 0.2 0 0</pose><inertial><pose>0.1 0 0 0 0 0</pose><mass>1</mass><inertia><ixx>1</ixx><iyy>1.1</iyy><izz>1.2</izz></inertia></inertial></link>
<link name="s2"><inertial><mass>1</mass><inertia><ixx>1</ixx><iyy>1.1</iyy><izz>1.2</izz></inertia></inertial></link>
<frame name="sf" attached_to="s1"><pose>0.2 0 0.1 0 0 0.5</pose></frame><frame name="sg"><pose>0 0 0.4 0.3 0 0</pose></frame>
<joint name="k1" type="revolute"><parent>s0</parent><child>s1</child><axis><xyz expressed_in="__model__">0 0.6 0.8</xyz></axis></joint>
<joint name="k2" type="prismatic"><parent>s1</parent><child>s2</child><pose relative_to="sg">0 0 0 0 0 0.3</pose><axis><xyz>1 0 0</xyz></axis></joint></model></sdf>"""
(FOLDER / "differential").mkdir()
(FOLDER / "differential" / "sub.sdf").write_text(SUB)
(FOLDER / "differential" / "package.xml").write_text("<package><name>differential</name></package>")


def make(r):
    n = lambda s=1.0: f"{r.uniform(-s, s):.5g}"
    v = lambda k, s=1.0: " ".join(n(s) for _ in range(k))
    maybe = lambda p, text: text if r.random() < p else ""
    version = r.choice(["1.7", "1.8", "1.9", "1.10", "1.11", "1.12"])
    new = version not in ("1.7", "1.8")

    def pose(frames=(), p=0.8):
        if r.random() > p:
            return ""
        relative = f' relative_to="{r.choice(frames)}"' if frames and r.random() < 0.4 else ""
        if new and r.random() < 0.2:
            return f'<pose{relative} degrees="true">{v(3)} {v(3, 170)}</pose>'
        if new and r.random() < 0.2:
            # The quaternion has unit length: sdformat accepts others unchanged, which are not
            # rotations.
            turn = np.array([r.gauss(0, 1) for _ in range(4)])
            turn = " ".join(repr(float(x)) for x in turn / np.linalg.norm(turn))
            return f'<pose{relative} rotation_format="quat_xyzw">{v(3)} {turn}</pose>'
        return f"<pose{relative}>{v(3)} {v(3, 3)}</pose>"

    def inertial():
        i = sorted(r.uniform(0.1, 1) for _ in range(3))
        return f"<inertial>{pose()}<mass>{r.uniform(0.1, 3):.5g}</mass><inertia><ixx>{i[0] + 1:.5g}</ixx><iyy>{i[1] + 1:.5g}</iyy><izz>{i[2] + 1:.5g}</izz><ixy>{n(0.1)}</ixy><ixz>{n(0.1)}</ixz><iyz>{n(0.1)}</iyz></inertia></inertial>"

    def automatic():
        shape = r.choice(["<box><size>1 0.5 0.2</size></box>", "<sphere><radius>0.3</radius></sphere>", "<cylinder><radius>0.2</radius><length>0.5</length></cylinder>", "<capsule><radius>0.2</radius><length>0.5</length></capsule>", "<ellipsoid><radii>0.2 0.3 0.4</radii></ellipsoid>"])
        density = maybe(0.5, f"<density>{r.uniform(100, 900):.4g}</density>")
        return f'<inertial auto="true">{maybe(0.3, "<mass>3</mass>")}</inertial><collision name="c">{pose()}{density}<geometry>{shape}</geometry></collision>'

    def model(name, depth):
        links = [f"l{k}" for k in range(r.randrange(2, 6))]
        out, frames = "", ["__model__"] + links
        for k, link in enumerate(links):
            own = automatic() if version in ("1.11", "1.12") and r.random() < 0.3 else inertial()
            out += f'<link name="{link}">{pose(frames[: k + 1])}{own}</link>'
        named = []
        for k in range(r.randrange(0, 3)):
            attached = maybe(0.5, f' attached_to="{r.choice(links + named)}"')
            out += f'<frame name="f{k}"{attached}>{pose(frames + named)}</frame>'
            named.append(f"f{k}")
        for k, link in enumerate(links[1:], start=1):
            kind = r.choice(["revolute", "revolute", "continuous", "prismatic", "fixed"])
            inside = f"<parent>{r.choice(links[:k])}</parent><child>{link}</child>{pose(frames + named, 0.5)}"
            if kind != "fixed":
                expressed = f' expressed_in="{r.choice(frames + named)}"' if r.random() < 0.4 else ""
                low, high = sorted(r.uniform(-3, 3) for _ in range(2))
                limit = maybe(0.6, f"<limit><lower>{low:.4g}</lower><upper>{high:.4g}</upper>{maybe(0.5, f'<effort>{r.uniform(1, 9):.4g}</effort>')}</limit>")
                dynamics = maybe(0.4, f"<dynamics><damping>{r.uniform(0, 2):.4g}</damping>{maybe(0.4, f'<spring_stiffness>{r.uniform(0, 3):.4g}</spring_stiffness><spring_reference>{n()}</spring_reference>')}</dynamics>")
                inside += f"<axis><xyz{expressed}>{v(3)}</xyz>{limit}{dynamics}</axis>"
            out += f'<joint name="j{k}" type="{kind}">{inside}</joint>'
        if depth == 0 and r.random() < 0.3:
            out += model("inner", 1)
            out += f'<joint name="hold" type="fixed"><parent>l0</parent><child>inner::l0</child></joint>'
        if depth == 0 and r.random() < 0.3:
            merge = new and r.random() < 0.5
            frame = maybe(0.4, f'<placement_frame>{r.choice(["s0", "s1", "sf", "sg"])}</placement_frame>')
            place = pose(frames, 1.0) if frame else pose(frames)
            own = "" if merge else "<name>part</name>"
            out += f'<include{maybe(merge, " merge=" + chr(34) + "true" + chr(34))}><uri>package://differential/sub.sdf</uri>{own}{place}{frame}</include>'
            out += f'<joint name="held" type="fixed"><parent>l0</parent><child>{"s0" if merge else "part::s0"}</child></joint>'
        placement = maybe(0.3, f' placement_frame="{r.choice(links + named)}"')
        return f'<model name="{name}"{placement}{maybe(0.2, f" canonical_link={chr(34)}{r.choice(links)}{chr(34)}")}>{pose(p=0.6)}{out}{hold if depth == 0 else ""}</model>'

    hold = '<joint name="base" type="fixed"><parent>world</parent><child>l0</child></joint>'
    return f'<sdf version="{version}">{model("m", 0)}</sdf>'


def compare(text):
    """None where both agree, `skip` where Drake rejects the file, else what differs."""
    plant = MultibodyPlant(0.0)
    try:
        parser = Parser(plant)
        parser.package_map().Add("differential", str(FOLDER / "differential"))
        instances = parser.AddModelsFromString(text, "sdf")
        plant.Finalize()
    except Exception:
        return "skip"
    if any(plant.get_joint(i).num_velocities() > 1 for i in plant.GetJointIndices()):
        return "skip"
    file = FOLDER / "file.sdf"
    file.write_text(text)
    return against(plant, plant.GetModelInstanceName(instances[0]), file, [FOLDER])


def compare_file(path, packages=()):
    """The same for a file with its meshes and includes. Bodies that are free in Drake are welded, because Linkwork leaves their base to the machine."""

    def load(weld):
        plant = MultibodyPlant(0.0)
        parser = Parser(plant)
        for folder in packages:
            parser.package_map().PopulateFromFolder(str(folder))
        instances = parser.AddModels(str(path))
        for name, instance, X in weld:
            plant.WeldFrames(plant.world_frame(), plant.GetFrameByName(name, instance), X)
        plant.Finalize()
        return plant, instances

    try:
        plant, _ = load([])
        context = plant.CreateDefaultContext()
        free = [plant.get_body(i) for i in plant.GetFloatingBaseBodies()]
        plant, instances = load([(b.name(), b.model_instance(), b.EvalPoseInWorld(context)) for b in free])
    except Exception:
        return "skip"
    # Linkwork leaves the name of the model out if the file has only one.
    alone = len(ET.parse(path).getroot().findall(".//model")) == 1
    first = plant.GetModelInstanceName(instances[0]) if instances and alone else ""
    return against(plant, first, path, packages)


def against(plant, first, path, packages):
    """Compares a plant with the mechanism that Linkwork reads. Joints with several rates stay at their default, at rest."""
    global LINKWORK
    LINKWORK = LINKWORK or Linkwork()
    context = plant.CreateDefaultContext()
    short = lambda scoped: scoped.removeprefix(f"{first}::")
    joints = [plant.get_joint(i) for i in plant.GetJointIndices()]
    scope = lambda instance, name: short(f"{plant.GetModelInstanceName(instance)}::{name}")

    def joint_name(j):
        """Drake names a joint by the model of its child, Linkwork by the model in which it is written: the one that contains both bodies."""
        child, parent = (plant.GetModelInstanceName(b.model_instance()).split("::") for b in (j.child_body(), j.parent_body()))
        if j.parent_body().index() == plant.world_body().index() or child == parent:
            return scope(j.model_instance(), j.name())
        common = [a for a, _ in itertools.takewhile(lambda pair: pair[0] == pair[1], zip(child, parent))]
        return short("::".join([*common, j.name()]))

    moving = [(joint_name(j), j) for j in joints if j.num_velocities() == 1]
    names = [n for n, _ in moving]
    bodies = [plant.get_body(BodyIndex(index)) for index in range(1, plant.num_bodies())]
    rng = np.random.default_rng(plant.num_velocities())
    states, expected = [], []
    for k in range(2):
        q, v = plant.GetDefaultPositions(), np.zeros(plant.num_velocities())
        for _, j in moving:
            q[j.position_start()] = rng.normal() * k
            v[j.velocity_start()] = rng.normal()
        plant.SetPositions(context, q)
        plant.SetVelocities(context, v)
        M = plant.CalcMassMatrix(context)
        bias = plant.CalcBiasTerm(context) - plant.CalcGravityGeneralizedForces(context)
        poses = {scope(b.model_instance(), b.name()): b.EvalPoseInWorld(context) for b in bodies}
        order = [j.velocity_start() for _, j in moving]
        states.append(
            {
                "order": names,
                "q": {n: [q[j.position_start()]] for n, j in moving},
                "v": {n: [v[j.velocity_start()]] for n, j in moving},
                "gravity": list(plant.gravity_field().gravity_vector()),
            }
        )
        expected.append((M[np.ix_(order, order)], bias[order], poses))
    answer = LINKWORK.ask(path, states, packages)
    if "error" in answer:
        return f"rejected: {answer['error']}"
    found = {b["name"]: b for b in answer["bodies"]}
    for b in bodies:
        own = found.get(scope(b.model_instance(), b.name()))
        if own is None:
            return f"link missing: {b.name()} {list(found)}"
        inertia = b.default_spatial_inertia()
        if differs(own["mass"], inertia.get_mass()) or differs(own["com"], inertia.get_com()):
            return f"mass: {b.name()} {own['mass']} {inertia.get_mass()} {own['com']} {inertia.get_com()}"
        J = inertia.Shift(inertia.get_com()).CalcRotationalInertia().CopyToFullMatrix3()
        if differs(own["inertia"], [J[0, 0], J[1, 1], J[2, 2], J[0, 1], J[0, 2], J[1, 2]]):
            return f"inertia: {b.name()}"
    found = {j["name"]: j for j in answer["joints"]}
    for name, j in moving:
        own = found.get(name)
        if own is None:
            return f"joint missing: {name} {list(found)}"
        limits = [j.position_lower_limits()[0], j.position_upper_limits()[0]]
        if differs([float(own["lower"]), float(own["upper"])], limits):
            return f"limits: {name} {own} {limits}"
        if differs(own["damping"], j.default_damping_vector()[0]):
            return f"damping: {name}"
    for state, (M, bias, poses) in zip(answer["states"], expected):
        if "missing" in state:
            return f"state: {state['missing']}"
        for name, X in poses.items():
            p = state["poses"][name]
            if differs(p[:3], X.translation()) or differs(rotation(*p[3:]), X.rotation().matrix()):
                return f"pose: {name}"
        if differs(state["M"], M.T):
            return "mass matrix: "
        if differs(state["bias"], bias, 1e-8):
            return f"bias: {state['bias']} {bias}"
    return None
