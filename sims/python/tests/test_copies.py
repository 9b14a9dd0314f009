"""Copies, pickles, limits, names of coordinates, the printed tree."""

import copy
import multiprocessing
import pickle
import re
import weakref

import numpy as np
import pytest
from conftest import random_mechanism

import linkwork as lw

URDF = """<robot name="arm">
  <link name="base"/>
  <link name="upper"><inertial><mass value="2"/><origin xyz="0 0 0.2"/><inertia ixx="0.1" iyy="0.1" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="lower"><inertial><mass value="1"/><origin xyz="0 0 0.2"/><inertia ixx="0.1" iyy="0.1" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 1 0"/>
    <limit lower="-0.5" upper="2" velocity="3" effort="40"/></joint>
  <joint name="elbow" type="continuous"><parent link="upper"/><child link="lower"/><origin xyz="0 0 0.5"/><axis xyz="0 1 0"/>
    <limit velocity="5" effort="7"/></joint>
</robot>"""


@pytest.fixture
def arm(tmp_path):
    file = tmp_path / "arm.urdf"
    file.write_text(URDF)
    return lw.load(file, root="fixed")


@pytest.mark.parametrize("again", [copy.copy, copy.deepcopy, lambda m: pickle.loads(pickle.dumps(m))])
@pytest.mark.parametrize("seed", range(4))
def test_a_copy_has_the_same_bits_and_a_gravity_of_its_own(again, seed):
    m = random_mechanism(seed, floating=seed % 2 == 1)
    m.gravity = [0.1, 0.2, -3.7]
    other = again(m)
    q, v, tau = m.random_q(seed), m.random_v(seed), m.random_v(seed + 9)
    assert np.array_equal(m.forward_dynamics(q, v, tau), other.forward_dynamics(q, v, tau))
    assert m.bodies == other.bodies and m.nodes == other.nodes and repr(m) == repr(other)
    other.gravity = [0, 0, 0]
    assert m.gravity[2] == -3.7


def test_a_copy_knows_what_its_file_said(arm):
    other = pickle.loads(pickle.dumps(arm))
    assert other.joints == arm.joints and sorted(other.joints) == ["elbow", "shoulder"]
    assert other.ignored == arm.ignored and np.array_equal(other.initial_q, arm.initial_q)
    assert other.to_urdf() == arm.to_urdf()


def mass(mechanism, q):
    return mechanism.mass_matrix(q)


def test_other_processes_take_it(arm):
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        there = pool.apply(mass, (arm, [0.3, 0.4]))
    assert np.array_equal(there, arm.mass_matrix([0.3, 0.4]))


def test_bytes_that_are_no_pickle_are_refused(arm):
    restore, (data,) = arm.__reduce__()
    for bad in [b"", data[:-3], data[: len(data) // 2], b"\xff" * 40, data.replace(b"0.", b"9.", 1)]:
        with pytest.raises(lw.LinkworkError, match="pickle"):
            restore(bad)
    for k in range(0, len(data), 7):
        broken = data[:k] + bytes([data[k] ^ 0x55]) + data[k + 1 :]
        try:
            restore(broken)
        except lw.LinkworkError:
            pass


def test_weak_references(arm):
    for thing in [arm, arm.state([0, 0]), arm.operators([0, 0])]:
        assert weakref.ref(thing)() is thing
    gone = weakref.ref(copy.copy(arm))
    assert gone() is None


def test_limits_as_arrays(arm):
    lower, upper = arm.position_limits
    assert lower.tolist() == [-0.5, -np.inf] and upper.tolist() == [2.0, np.inf]
    assert arm.rate_limits.tolist() == [3.0, 5.0] and arm.effort_limits.tolist() == [40.0, 7.0]
    some = np.array([arm.random_q(seed) for seed in range(400)])
    assert (some >= lower).all() and (some <= upper).all()
    # The samples are uniform over the whole range: the first and last tenth contain about a tenth
    # of the samples.
    shoulder = some[:, 0]
    for part in [shoulder < -0.25, shoulder > 1.75]:
        assert 20 < part.sum() < 60
    free = lw.Builder().body("b", hinge=lw.Hinge.free(), mass=1, inertia=np.eye(3)).build()
    assert free.position_limits[0].shape == (7,) and free.rate_limits.shape == (6,)
    assert np.isinf(free.position_limits[1]).all() and np.isinf(free.effort_limits).all()


def test_coordinates_by_name(arm):
    assert arm.coordinates("elbow") == (slice(1, 2, 1), slice(1, 2, 1))
    assert arm.coordinates("lower") == arm.coordinates("elbow")
    with pytest.raises(lw.LinkworkError, match="shoulder"):
        arm.coordinates("sholder")
    m = random_mechanism(1, floating=True)
    for body in m.bodies:
        assert m.coordinates(body)[1] == m.hinge(body)
    ends = [m.coordinates(b)[0] for b in m.bodies]
    assert sorted(i for s in ends for i in range(s.start, s.stop)) == list(range(m.nq))


def test_the_tree_is_printed(arm):
    lines = str(arm).splitlines()
    assert "nq=2" in lines[0] and lines[1] == "world"
    upper = next(line for line in lines if "upper" in line)
    lower = next(line for line in lines if "lower" in line)
    assert "pin" in upper and "q[0:1]" in upper and "2 kg" in upper
    assert len(lower) - len(lower.lstrip(" │")) > len(upper) - len(upper.lstrip(" │"))
    table = arm._repr_html_()
    rows = [re.sub("<[^>]*>", "|", row) for row in table.split("<tr>")[1:]]
    assert len(rows) == 4 and "3 bodies, nq = 2, nv = 2, 3 kg" in table
    assert re.search(r"upper\|+shoulder\|+pin\|+0\|+0\|+2\|", rows[2]) and re.search(r"lower\|+elbow\|+pin\|+1\|+1\|+1\|", rows[3])
    chain = lw.Builder()
    for k in range(3000):
        chain.body(f"b{k}", "world" if k == 0 else f"b{k - 1}", lw.Hinge.pin([0, 1, 0]), mass=1, com=[0, 0, 1], inertia=np.eye(3))
    long = chain.build()
    text = str(long)
    assert len(text.splitlines()) == 3002 and len(text) < 1_000_000
    assert "and 2800 more" in long._repr_html_() and len(long._repr_html_()) < 200_000


def test_names_in_tables_are_shown_and_not_obeyed():
    name = "<script>alert('a & b')</script>"
    table = lw.Builder().body(name, hinge=lw.Hinge.pin([0, 1, 0]), mass=1, com=[0, 0, 1], inertia=np.eye(3)).build()._repr_html_()
    assert "<script" not in table and "&lt;script&gt;alert(&#39;a &amp; b&#39;)&lt;/script&gt;" in table


def test_the_version_is_that_of_the_wheel():
    from importlib.metadata import version

    assert lw.__version__ == version("linkwork")
