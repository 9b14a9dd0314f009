"""URDF, MJCF and SDF with the readers; URDF and RON written and read back."""

import numpy as np
import pytest
from conftest import ROBOTS, off, robot

import linkwork as lw

URDF = """<robot name="gripper">
  <link name="base"/>
  <link name="left"><inertial><origin xyz="0.1 0 0"/><mass value="0.5"/>
    <inertia ixx="0.01" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="right"><inertial><origin xyz="0.1 0 0"/><mass value="0.5"/>
    <inertia ixx="0.01" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="tip"/>
  <joint name="open" type="revolute"><parent link="base"/><child link="left"/><axis xyz="0 0 1"/>
    <limit lower="-1" upper="0.5" velocity="2" effort="7"/></joint>
  <joint name="follow" type="revolute"><parent link="base"/><child link="right"/><axis xyz="0 0 1"/>
    <limit lower="-1" upper="1" velocity="2" effort="7"/><mimic joint="open" multiplier="-2" offset="0.1"/></joint>
  <joint name="mark" type="fixed"><parent link="left"/><child link="tip"/><origin xyz="0.2 0 0"/></joint>
  <gazebo/>
</robot>
"""


@pytest.fixture
def gripper(tmp_path):
    path = tmp_path / "gripper.urdf"
    path.write_text(URDF)
    return path


def test_urdf(gripper):
    m = lw.load(gripper)
    assert m.nv == 2 and off(m.total_mass, 1.0) < 1e-15
    a, b = m.joints["open"].start, m.joints["follow"].start
    assert m.joints["mark"].start == m.joints["mark"].stop
    C, c = m.couplings()
    assert C.shape == (1, 2) and C[0, b] == 1 and C[0, a] == 2 and c[0] == 0.1
    row = next(s for s in m.subhinges if s.v == m.joints["open"])
    assert (row.lower, row.upper, row.rate, row.effort) == (-1, 0.5, 2, 7)
    assert any("gazebo" in line and "gripper.urdf:" in line for line in m.ignored)
    q = np.array([0.3, -0.2])
    x = m.state(q).position("tip")
    assert off(x, [0.2 * np.cos(q[a]), 0.2 * np.sin(q[a]), 0]) < 1e-15
    assert lw.load(gripper, root="free").nv == 8 and lw.load(gripper, root="planar").nv == 5
    assert lw.load(gripper, "fixed").nv == 2
    assert np.array_equal(m.initial_q, m.neutral_q())


def test_robots_from_their_own_files_agree_with_pinocchio():
    for name in ("ur5", "iiwa7", "chain10_rand", "double_pendulum", "solo12_ff"):
        data = robot(name)
        root = "free" if "free_flyer" in (data["root"] or "") else None
        m = lw.load(ROBOTS / f"{name}.urdf", root=root, inertia_check="positive_moments")
        places, n = [], data["nv"]
        for joint in data["joints"]:
            if joint["nv"] == 6:
                free = next(s.v for s in m.subhinges if s.kind == "free")
                places += [free.start + i for i in (3, 4, 5, 0, 1, 2)]
            else:
                places += range(m.joints[joint["name"]].start, m.joints[joint["name"]].stop)
        assert m.nv == n == len(places)
        qs = [p + (1 if "free_flyer" in (data["root"] or "") else 0) for p in places]
        if n != data["nq"]:
            qs = [*range(7), *qs[6:]]
        for s in data["states"][:5]:
            q, v, tau, want = np.empty(m.nq), np.empty(n), np.empty(n), np.empty(n)
            q[qs], v[places], tau[places], want[places] = s["q"], s["v"], s["tau"], s["aba"]
            # Measured: 3.4e-15 at most.
            assert off(m.forward_dynamics(q, v, tau), want) < 1e-12, name


def test_mjcf_and_sdf(tmp_path):
    mjcf, sdf = tmp_path / "arm.xml", tmp_path / "arm.sdf"
    mjcf.write_text(
        """<mujoco><worldbody><body name="rod" pos="0 0 1"><joint name="swing" type="hinge" axis="0 1 0"/>
        <inertial pos="0 0 -0.5" mass="2" diaginertia="0.1 0.1 0.01"/></body></worldbody></mujoco>"""
    )
    sdf.write_text(
        """<sdf version="1.9"><model name="arm"><link name="rod"><pose>0 0 1 0 0 0</pose><inertial>
        <pose>0 0 -0.5 0 0 0</pose><mass>2</mass><inertia><ixx>0.1</ixx><iyy>0.1</iyy><izz>0.01</izz></inertia>
        </inertial></link><joint name="swing" type="revolute"><parent>world</parent><child>rod</child>
        <axis><xyz>0 1 0</xyz></axis></joint></model></sdf>"""
    )
    for path in (mjcf, sdf):
        m = lw.load(path)
        assert off(m.mass_matrix([0.4]), [[0.1 + 2 * 0.25]]) < 1e-14, path.name
        assert off(m.bias_forces([0.4], [0.0]), [-2 * 9.81 * 0.5 * -np.sin(0.4)]) < 1e-14


def test_what_is_written_is_read_back(gripper, tmp_path):
    m = lw.load(gripper)
    q, v = m.random_q(1), m.random_v(1)
    text, left_out = m.to_urdf()
    assert isinstance(left_out, list)
    again = tmp_path / "again.urdf"
    again.write_text(text)
    n = lw.load(again)
    assert off(n.forward_dynamics(q, v, v), m.forward_dynamics(q, v, v)) < 1e-14
    text, left_out = m.to_ron("Gripper")
    assert "couplings" in text and not any("coupling" in line for line in left_out)
    ron = tmp_path / "gripper.ron"
    ron.write_text(text)
    n = lw.load(ron)
    assert np.array_equal(n.forward_dynamics(q, v, v), m.forward_dynamics(q, v, v))
    ball = lw.Builder().body("a", hinge=lw.Hinge.ball(), mass=1.0, inertia=np.eye(3)).build()
    with pytest.raises(lw.LinkworkError, match="no ball joint"):
        ball.to_urdf()


def test_refusals_have_places(tmp_path):
    bad = tmp_path / "bad.urdf"
    for text, pattern in (
        ("<robot name='x'><link name='a'>", r"bad\.urdf:1:"),
        (URDF.replace('type="fixed"', 'type="elastic"'), r"bad\.urdf:\d+:\d+.*\n?.*elastic|elastic"),
        (URDF.replace('value="0.5"', 'value="-0.5"', 1), "left"),
        (URDF.replace('<parent link="left"/>', '<parent link="lift"/>'), "did you mean `left`"),
        ("<robot name='x'/>", "bad"),
        ("not xml", r"bad\.urdf"),
        ("<scene/>", "scene"),
    ):
        bad.write_text(text)
        with pytest.raises(lw.LinkworkError, match=pattern):
            lw.load(bad)
    with pytest.raises(lw.LinkworkError, match="none.urdf"):
        lw.load(tmp_path / "none.urdf")
    with pytest.raises(lw.LinkworkError, match="`root`"):
        lw.load(bad, root="loose")
    with pytest.raises(lw.LinkworkError, match="inertia_check"):
        lw.load(bad, inertia_check="none")
    with pytest.raises(lw.LinkworkError):
        lw.load("README.txt")


def test_couplings_can_be_left_out(gripper):
    assert len(lw.load(gripper).constraints) == 1
    free = lw.load(gripper, couplings=False)
    assert free.nv == 2 and not free.constraints


def test_a_keyframe_is_the_start(tmp_path):
    path = tmp_path / "slide.xml"
    path.write_text(
        """<mujoco><worldbody><body name="a"><joint name="p" type="slide" stiffness="3"/><geom size="0.1"/></body></worldbody>
        <keyframe><key name="up" qpos="0.25"/></keyframe></mujoco>"""
    )
    with pytest.warns(UserWarning, match="springs"):
        assert lw.load(path).initial_q[0] == 0
        assert lw.load(path, keyframe="up").initial_q[0] == 0.25
    with pytest.raises(lw.LinkworkError, match="one of: up"):
        lw.load(path, keyframe="op")
