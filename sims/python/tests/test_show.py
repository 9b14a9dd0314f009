"""`show`: the contents of the recordings for Rerun."""

import sys

import numpy as np
import pytest
import rerun.experimental

import linkwork as lw
from conftest import SOURCE

PIN = lw.Hinge.pin([0, 1, 0])


def recorded(path):
    """{entity: [chunk]} of a recording."""
    found = {}
    for chunk in rerun.experimental.RrdReader(str(path)).stream().to_chunks():
        found.setdefault(chunk.entity_path, []).append(chunk)
    return found


def column(chunks, name):
    """All values of a column, row by row."""
    rows = [row for chunk in chunks for row in chunk.to_record_batch().column(name).to_pylist()]
    return np.array(rows, dtype=float).reshape(len(rows), -1)


def test_a_motion_is_there_row_by_row(tmp_path):
    arm = lw.load(SOURCE / "assemblies/arms/six_axis.urdf")
    q = np.linspace(np.zeros(arm.nq), 0.5 * np.ones(arm.nq), 7)
    arm.show(q, path=tmp_path / "arm.rrd")
    found = recorded(tmp_path / "arm.rrd")
    places = column(found["/bodies/tool"], "Transform3D:translation")
    turns = column(found["/bodies/tool"], "Transform3D:quaternion")
    states = [arm.state(row) for row in q]
    # The viewer uses single precision.
    assert np.allclose(places, [s.position("tool") for s in states], atol=1e-6)
    assert np.allclose(turns, [s.quaternion("tool") for s in states], atol=1e-6)
    # Each visual shape of the file appears once.
    shapes = {(s["body"], s["name"]): s for s in arm._shapes()}
    assert len(shapes) > 5 and all(f"/bodies/{b}/{n}" in found for b, n in shapes)
    one = shapes["forearm", "1"]
    assert np.allclose(column(found["/bodies/forearm/1"], "Transform3D:translation"), [one["pose"][:3]], atol=1e-6)
    assert np.allclose(column(found["/bodies/forearm/1"], "Cylinders3D:lengths"), [[one["size"][1]]])


def test_without_shapes_bodies_are_the_boxes_of_their_inertia(tmp_path):
    edges = np.array([0.1, 0.2, 0.6])
    turned = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1.0]])
    inertia = turned @ np.diag(2.0 / 12 * (np.sum(edges**2) - edges**2)) @ turned.T
    one = lw.Builder().body("rod", "world", PIN, mass=2, com=[0.1, 0, -0.3], inertia=inertia).build()
    one.show(path=tmp_path / "one.rrd")
    found = recorded(tmp_path / "one.rrd")["/bodies/rod/inertia"]
    half = column(found, "Boxes3D:half_sizes")[0]
    x, y, z, w = column(found, "Transform3D:quaternion")[0]
    turn = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
    # These are half the edges along the axes of the body.
    assert np.allclose(np.abs(turn) @ half, 0.5 * np.array([0.2, 0.1, 0.6]), atol=1e-6)
    assert np.allclose(column(found, "Transform3D:translation"), [[0.1, 0, -0.3]], atol=1e-7)


def test_a_simulation_makes_a_film(tmp_path):
    sim = lw.Simulation(SOURCE / "sims/pendulum")
    path = tmp_path / "film.rrd"
    seen = []

    def look(run):
        run.show(path=path)
        seen.append(run.mechanism.state(run.q).quaternion("bob"))

    sim.every("100 ms", look)
    sim.run_until("1 s")
    chunks = recorded(path)["/bodies/bob"]
    assert len(seen) > 9
    assert np.allclose(column(chunks, "Transform3D:quaternion"), seen, atol=1e-6)
    times = [t for c in chunks for t in c.to_record_batch().column("time").to_pylist()]
    assert times[-1].total_seconds() == pytest.approx(1.0)
    # Another recording begins from the start, with the shapes.
    sim.show(path=tmp_path / "other.rrd")
    assert any(e.startswith("/bodies/bob/") for e in recorded(tmp_path / "other.rrd"))


def test_a_film_has_the_shapes_of_the_phase(tmp_path):
    text = (SOURCE / "sims/staging/sim.ron").read_text()
    free = '"upper": (parent: "world", at: (position: [0, 0, 0]), hinge: Free)'
    assert text.count(free) == 1
    other = free[:-1] + ', shapes: [(shape: Box([1, 2, 3]), name: "flag")])'
    (tmp_path / "sim.ron").write_text(text.replace(free, other))
    sim = lw.Simulation(tmp_path / "sim.ron")
    path = tmp_path / "film.rrd"
    before = {(s["body"], s["name"]) for s in sim.mechanism._shapes()}
    sim.show(path=path)
    sim.run_until(4)
    sim.show(path=path)
    sim.run_until(6)
    sim.show(path=path)
    assert sim.phase == "first_separation"
    after = {(s["body"], s["name"]) for s in sim.mechanism._shapes()}
    found = recorded(path)
    assert ("upper", "flag") in after and before - after
    flag = found["/bodies/upper/flag"]
    assert [t.total_seconds() for c in flag for t in c.to_record_batch().column("time").to_pylist()] == pytest.approx([6.0])
    assert np.allclose(column(flag, "Boxes3D:half_sizes"), [[0.5, 1.0, 1.5]])
    # Shapes that a phase no longer has are cleared when it begins; shapes are not drawn twice within a phase.
    for body, name in before - after:
        batches = [c.to_record_batch() for c in found[f"/bodies/{body}/{name}"]]
        cleared = [t.total_seconds() for b in batches if any("Clear" in n for n in b.schema.names) for t in b.column("time").to_pylist()]
        assert cleared == pytest.approx([6.0])
        drawn = [b for b in batches if any("half_sizes" in n or "lengths" in n for n in b.schema.names)]
        assert sum(b.num_rows for b in drawn) == 1


def test_what_cannot_be_shown_is_refused(tmp_path, monkeypatch):
    one = lw.Builder().body("rod", "world", PIN, mass=1, inertia=np.eye(3)).build()
    with pytest.raises(lw.LinkworkError, match="3 numbers"):
        one.show([1, 2, 3], path=tmp_path / "no.rrd")
    assert not (tmp_path / "no.rrd").exists()
    (tmp_path / "mug.urdf").write_text(
        '<robot name="m"><link name="cup"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
        '<visual><geometry><mesh filename="cup.stl"/></geometry></visual></link></robot>'
    )
    with pytest.raises(lw.LinkworkError, match="cup.stl.*does not exist"):
        lw.load(tmp_path / "mug.urdf", "free").show(path=tmp_path / "mug.rrd")
    monkeypatch.setitem(sys.modules, "rerun", None)
    with pytest.raises(lw.LinkworkError, match=r"pip install linkwork\[rerun\]"):
        one.show(path=tmp_path / "no.rrd")
