"""`Mechanism.show` and `Simulation.show`: bodies in the viewer Rerun."""

import weakref
from pathlib import Path
from typing import Any

import numpy as np

from ._linkwork import LinkworkError

#: Red, green, blue, opacity of what has no colour of its own.
GREY = (0.72, 0.72, 0.75, 1.0)

#: Edge of the box of a point mass, m.
POINT = 0.1

#: The recording of each simulation that is shown, with its path.
_recordings: "weakref.WeakKeyDictionary[Any, tuple[Any, Path | None]]" = weakref.WeakKeyDictionary()


def _rerun() -> Any:
    try:
        import rerun
    except ImportError as error:
        raise LinkworkError("the package rerun-sdk is not installed\n  help: pip install linkwork[rerun]") from error
    return rerun


def _opened(name: str, path: Path | None) -> Any:
    """A recording that goes to a file, or to a viewer."""
    rr = _rerun()
    recording = rr.RecordingStream(f"linkwork_{name}")
    if path is None:
        recording.spawn()
    else:
        recording.save(str(path))
    recording.log("/", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    return recording


def _entity(body: str) -> str:
    """Of a body: parts of names that are separated by dots or slashes stay one level."""
    rr = _rerun()
    return "bodies/" + str(rr.escape_entity_path_part(body))


def _shape(recording: Any, shape: dict[str, Any]) -> None:
    rr = _rerun()
    entity = f"{_entity(shape['body'])}/{rr.escape_entity_path_part(shape['name'])}"
    pose, kind = shape["pose"], shape["kind"]
    color = [round(255 * x) for x in shape["color"] or GREY]
    placed = {"translation": pose[:3], "quaternion": rr.Quaternion(xyzw=pose[3:])}
    solid = {"colors": [color], "fill_mode": "solid"}
    if kind == "box":
        what = rr.Boxes3D(half_sizes=[0.5 * np.array(shape["size"])], **solid)
    elif kind == "ellipsoid":
        what = rr.Ellipsoids3D(half_sizes=[shape["size"]], **solid)
    elif kind == "cylinder":
        radius, length = shape["size"]
        what = rr.Cylinders3D(lengths=[length], radii=[radius], **solid)
    elif kind == "capsule":
        # Rerun's begins at the middle of one of its half spheres.
        radius, length = shape["size"]
        what = rr.Capsules3D(lengths=[length], radii=[radius], translations=[[0, 0, -0.5 * length]], colors=[color], fill_mode="solid")
    elif kind == "surface":
        what = rr.Mesh3D(vertex_positions=shape["corners"], triangle_indices=shape["triangles"], albedo_factor=color)
    elif kind == "points":
        what = rr.Points3D(shape["points"][:, :3], radii=shape["points"][:, 3], colors=[color])
    else:
        if not Path(shape["file"]).is_file():
            raise LinkworkError(f"the mesh `{shape['file']}` of `{shape['body']}` is not there\n  help: give `packages` to linkwork.load, or put it there")
        what = rr.Asset3D(path=shape["file"], albedo_factor=color)
        placed["scale"] = shape["scale"]
    recording.log(entity, rr.Transform3D(**placed), what, static=True)


def _boxes(mechanism: Any) -> list[dict[str, Any]]:
    """For a machine without shapes: of each body with mass the solid box of its mass and inertia."""
    boxes = []
    for body, (mass, *rest) in zip(mechanism.bodies, mechanism.inertial_parameters().reshape(-1, 10), strict=True):
        if not mass > 0.0:
            continue
        h, (xx, xy, xz, yy, yz, zz) = np.array(rest[:3]), rest[3:]
        c = h / mass
        # About the mass centre.
        about = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) - mass * (c @ c * np.eye(3) - np.outer(c, c))
        moments, axes = np.linalg.eigh(about)
        axes[:, 2] *= np.sign(np.linalg.det(axes)) or 1.0
        size = np.sqrt(np.maximum(6.0 / mass * (moments.sum() - 2.0 * moments), 0.0))
        if not size.max() > 0.0:
            size[:] = POINT
        boxes.append({"body": body, "name": "inertia", "pose": np.concatenate([c, _quaternion(axes)]), "color": None, "kind": "box", "size": size})
    return boxes


def _quaternion(R: np.ndarray) -> np.ndarray:
    """[x y z w] of a rotation matrix: the eigenvector of Bar-Itzhack's matrix to its greatest eigenvalue."""
    (a, b, c), (d, e, f), (g, h, i) = R
    K = np.array([[a - e - i, b + d, c + g, h - f], [b + d, e - a - i, f + h, c - g], [c + g, f + h, i - a - e, d - b], [h - f, c - g, d - b, a + e + i]])
    return np.asarray(np.linalg.eigh(K)[1][:, -1])


def _scene(recording: Any, mechanism: Any) -> None:
    for shape in mechanism._shapes() or _boxes(mechanism):
        _shape(recording, shape)


def _place(recording: Any, mechanism: Any, q: Any) -> None:
    rr = _rerun()
    state = mechanism.state(q)
    for body in mechanism.bodies:
        place = {"translation": state.position(body), "quaternion": rr.Quaternion(xyzw=state.quaternion(body))}
        recording.log(_entity(body), rr.Transform3D(**place))


def mechanism(machine: Any, q: Any, path: Path | None) -> None:
    """`Mechanism.show`."""
    rows = np.atleast_2d(np.asarray(machine.initial_q if q is None else q, dtype=float))
    # What cannot be is refused before a viewer opens.
    for row in rows:
        machine.state(row)
    recording = _opened("mechanism", path)
    _scene(recording, machine)
    for k, row in enumerate(rows):
        recording.set_time("row", sequence=k)
        _place(recording, machine, row)
    recording.flush()


def simulation(run: Any, path: Path | None) -> None:
    """`Simulation.show`."""
    machine = run.mechanism
    known = _recordings.get(run)
    if known is None or known[1] != path:
        known = (_opened("simulation", path), path)
        _recordings[run] = known
        _scene(known[0], machine)
    known[0].set_time("time", duration=run.time)
    _place(known[0], machine, run.q)
    known[0].flush()
