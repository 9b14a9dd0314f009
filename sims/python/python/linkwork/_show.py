"""`Mechanism.show` and `Simulation.show`: bodies in the Rerun viewer."""

import weakref
from pathlib import Path
from typing import Any

import numpy as np

from ._linkwork import LinkworkError

# : The default colour of shapes: red, green, blue, opacity.
GREY = (0.72, 0.72, 0.75, 1.0)

#: The recording of each simulation that is shown.
_films: "weakref.WeakKeyDictionary[Any, _Film]" = weakref.WeakKeyDictionary()


def _rerun() -> Any:
    try:
        import rerun
    except ImportError as error:
        raise LinkworkError("the package rerun-sdk is not installed\n  help: pip install linkwork[rerun]") from error
    return rerun


def _opened(name: str, path: Path | None) -> Any:
    """Open a recording to a file or to a viewer."""
    rr = _rerun()
    recording = rr.RecordingStream(f"linkwork_{name}")
    if path is None:
        recording.spawn()
    else:
        recording.save(str(path))
    recording.log("/", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    return recording


def _entity(body: str) -> str:
    """Return the entity of a body. Dots and slashes in its name do not create levels."""
    rr = _rerun()
    return "bodies/" + str(rr.escape_entity_path_part(body))


def _shape(recording: Any, shape: dict[str, Any], *, static: bool) -> str:
    """Draw a shape and return its entity."""
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
        # The origin of a Rerun capsule is the centre of one of its half spheres.
        radius, length = shape["size"]
        what = rr.Capsules3D(lengths=[length], radii=[radius], translations=[[0, 0, -0.5 * length]], colors=[color], fill_mode="solid")
    elif kind == "surface":
        what = rr.Mesh3D(vertex_positions=shape["corners"], triangle_indices=shape["triangles"], albedo_factor=color)
    elif kind == "points":
        what = rr.Points3D(shape["points"][:, :3], radii=shape["points"][:, 3], colors=[color])
    else:
        if not Path(shape["file"]).is_file():
            raise LinkworkError(f"the mesh `{shape['file']}` of `{shape['body']}` does not exist\n  help: pass `packages` to linkwork.load, or provide the file")
        what = rr.Asset3D(path=shape["file"], albedo_factor=color)
        placed["scale"] = shape["scale"]
    recording.log(entity, rr.Transform3D(**placed), what, static=static)
    return entity


def _place(recording: Any, state: Any, bodies: list[str]) -> None:
    rr = _rerun()
    for body in bodies:
        place = {"translation": state.position(body), "quaternion": rr.Quaternion(xyzw=state.quaternion(body))}
        recording.log(_entity(body), rr.Transform3D(**place))


def mechanism(machine: Any, q: Any, path: Path | None) -> None:
    """`Mechanism.show`."""
    rows = np.atleast_2d(np.asarray(machine.initial_q if q is None else q, dtype=float))
    # Invalid configurations raise before a viewer opens.
    states = [machine.state(row) for row in rows]
    recording = _opened("mechanism", path)
    for shape in machine._shapes():
        _shape(recording, shape, static=True)
    for k, state in enumerate(states):
        recording.set_time("row", sequence=k)
        _place(recording, state, machine.bodies)
    recording.flush()


class _Film:
    """The recording of a simulation, for all of its phases."""

    def __init__(self, path: Path | None) -> None:
        self.path = path
        self.recording = _opened("simulation", path)
        self.phase: str | None = None
        self.machine: Any = None
        self.entities: set[str] = set()

    def enter(self, run: Any) -> None:
        """Replace the shapes at the beginning of a phase."""
        if self.machine is not None and run.phase == self.phase:
            return
        rr = _rerun()
        self.phase, self.machine = run.phase, run.mechanism
        for entity in sorted(self.entities):
            self.recording.log(entity, rr.Clear(recursive=False))
        shapes = self.machine._shapes()
        self.entities = {_shape(self.recording, shape, static=False) for shape in shapes}


def simulation(run: Any, path: Path | None) -> None:
    """`Simulation.show`."""
    film = _films.get(run)
    if film is None or film.path != path:
        # A simulation without a mechanism raises here, before a viewer opens.
        _ = run.q
        film = _films[run] = _Film(path)
    film.recording.set_time("time", duration=run.time)
    film.enter(run)
    _place(film.recording, film.machine.state(run.q), film.machine.bodies)
    film.recording.flush()
