"""Types of the compiled module, made by `sims/python/stubs` from its Rust sources. Shapes and units are in the docstrings."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import Any, Literal, NoReturn, final, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray
from typing_extensions import disjoint_base

__all__ = [
    "Builder",
    "Calibration",
    "Campaign",
    "Collider",
    "Collisions",
    "ConstrainedMotion",
    "Constraint",
    "Contact",
    "ContactStep",
    "Edit",
    "Frames",
    "Grip",
    "Hinge",
    "Identifiable",
    "InverseKinematicsSearch",
    "LinkworkError",
    "Log",
    "Mechanism",
    "Modes",
    "Operator",
    "Operators",
    "Outcome",
    "Rank",
    "RateTarget",
    "Report",
    "Results",
    "Robot",
    "Series",
    "Simulation",
    "State",
    "Subgraph",
    "Subhinge",
    "Target",
    "Trajectory",
    "Variable",
    "WholeBodyForces",
    "_Gathering",
    "__cpu__",
    "__version__",
    "_levels",
    "_main",
    "_restore",
    "load",
    "read_log",
    "support_margin",
    "support_polygon",
]

_Array = NDArray[np.float64]
_Path = str | PathLike[str]
_Time = float | str
_Wrenches = dict[str, Any]

__cpu__: str
__version__: str

class LinkworkError(ValueError): ...

def _main(arguments: list[str], models: dict[str, type]) -> int: ...
def _restore(bytes: bytes) -> Mechanism: ...
def read_log(path: _Path) -> dict[str, Series]: ...
def load(
    path: _Path,
    root: Literal["fixed", "free", "planar"] | None = None,
    *,
    inertia_check: Literal["warn", "physical", "positive_moments"] = "warn",
    packages: Sequence[_Path] | None = None,
    couplings: bool = True,
    keyframe: str | None = None,
) -> Mechanism: ...
def _levels() -> list[str]: ...
def support_polygon(points: ArrayLike) -> _Array: ...
def support_margin(polygon: ArrayLike, point: ArrayLike) -> float: ...

@final
class Builder:
    def __new__(cls) -> Builder: ...
    def body(
        self,
        name: str,
        parent: str = "world",
        hinge: Hinge | None = None,
        *,
        mass: float = 0.0,
        com: ArrayLike | None = None,
        inertia: ArrayLike | None = None,
        inertia_check: Literal["physical", "positive_moments"] = "physical",
        hinge_in_parent: ArrayLike | None = None,
        hinge_in_body: ArrayLike | None = None,
        modes: Modes | None = None,
    ) -> Builder: ...
    def node(self, name: str, body: str, pose: ArrayLike | None = None) -> Builder: ...
    def loop(
        self,
        name: str,
        body_a: str,
        body_b: str,
        hinge: Hinge,
        *,
        at_a: ArrayLike | None = None,
        at_b: ArrayLike | None = None,
    ) -> Builder: ...
    def coupling(
        self,
        name: str,
        terms: Mapping[str | tuple[str, int], float],
        constant: float = 0.0,
    ) -> Builder: ...
    def build(self) -> Mechanism: ...

@final
class Calibration:
    @property
    def identifiable(self) -> Identifiable: ...
    @property
    def base(self) -> _Array: ...
    @property
    def deviations(self) -> _Array: ...
    @property
    def parameters(self) -> _Array: ...
    @property
    def residual(self) -> float: ...
    @property
    def unphysical(self) -> list[str]: ...
    @property
    def mechanism(self) -> Mechanism | None: ...

@final
class Campaign:
    def __new__(cls, path: _Path, *, models: Mapping[str, type] | None = None) -> Campaign: ...
    @property
    def models(self) -> dict[str, type] | None: ...
    @property
    def path(self) -> Path: ...
    @property
    def name(self) -> str: ...
    @property
    def doc(self) -> str: ...
    @property
    def runs(self) -> int: ...
    @property
    def metrics(self) -> dict[str, str]: ...
    @property
    def drawn(self) -> dict[str, str]: ...
    @property
    def identity(self) -> str: ...
    def draws(self, run: int) -> dict[str, Any]: ...
    def simulation(self, run: int) -> Simulation: ...
    def run(
        self,
        run: int,
        *,
        log: _Path | None = None,
        checkpoint: _Path | None = None,
    ) -> Outcome: ...
    def execute(
        self,
        folder: _Path,
        *,
        threads: int | None = None,
        progress: Callable[[int, int, int, float | None], object] | None = None,
    ) -> Results: ...
    def _make(self, runs: Sequence[int], folder: _Path) -> list[str]: ...
    def _gather(self, folder: _Path) -> _Gathering: ...

@final
class Collider:
    @staticmethod
    def sphere(
        name: str,
        body: str,
        radius: float,
        *,
        at: ArrayLike | None = None,
        friction: float = 0.5,
        restitution: float = 0.0,
    ) -> Collider: ...
    @staticmethod
    def box(
        name: str,
        body: str,
        size: ArrayLike,
        *,
        at: ArrayLike | None = None,
        friction: float = 0.5,
        restitution: float = 0.0,
    ) -> Collider: ...
    @staticmethod
    def ellipsoid(
        name: str,
        body: str,
        radii: ArrayLike,
        *,
        at: ArrayLike | None = None,
        friction: float = 0.5,
        restitution: float = 0.0,
    ) -> Collider: ...
    @staticmethod
    def capsule(
        name: str,
        body: str,
        radius: float,
        length: float,
        *,
        at: ArrayLike | None = None,
        friction: float = 0.5,
        restitution: float = 0.0,
    ) -> Collider: ...
    @staticmethod
    def cylinder(
        name: str,
        body: str,
        radius: float,
        length: float,
        *,
        at: ArrayLike | None = None,
        friction: float = 0.5,
        restitution: float = 0.0,
    ) -> Collider: ...
    @staticmethod
    def half_space(
        name: str,
        body: str = "world",
        *,
        at: ArrayLike | None = None,
        friction: float = 0.5,
        restitution: float = 0.0,
    ) -> Collider: ...
    @staticmethod
    def hull(
        name: str,
        body: str,
        points: ArrayLike,
        *,
        at: ArrayLike | None = None,
        friction: float = 0.5,
        restitution: float = 0.0,
    ) -> Collider: ...
    @staticmethod
    def mesh(
        name: str,
        body: str,
        vertices: ArrayLike,
        triangles: Sequence[Sequence[int]],
        *,
        at: ArrayLike | None = None,
        friction: float = 0.5,
        restitution: float = 0.0,
    ) -> Collider: ...
    @staticmethod
    def terrain(
        name: str,
        heights: ArrayLike,
        spacing: ArrayLike,
        body: str = "world",
        *,
        at: ArrayLike | None = None,
        friction: float = 0.5,
        restitution: float = 0.0,
    ) -> Collider: ...
    @staticmethod
    def point_cloud(
        name: str,
        body: str,
        points: ArrayLike | None = None,
        *,
        room: int = 0,
        at: ArrayLike | None = None,
        friction: float = 0.5,
        restitution: float = 0.0,
    ) -> Collider: ...
    @staticmethod
    def voxel_map(
        name: str,
        body: str,
        cells: Sequence[int],
        edge: float,
        *,
        occupied: ArrayLike | None = None,
        at: ArrayLike | None = None,
        friction: float = 0.5,
        restitution: float = 0.0,
    ) -> Collider: ...
    @property
    def name(self) -> str: ...
    @property
    def body(self) -> str: ...
    @property
    def friction(self) -> float: ...
    @property
    def restitution(self) -> float: ...
    @property
    def material_name(self) -> str | None: ...
    def with_coarse(self, simpler: Collider) -> Collider: ...
    @property
    def has_coarse(self) -> bool: ...
    def material(
        self,
        *,
        friction: float | None = None,
        restitution: float | None = None,
        name: str | None = None,
    ) -> Collider: ...

@disjoint_base
class Collisions:
    def __new__(
        cls,
        mechanism: Mechanism,
        colliders: Sequence[Collider] | None = None,
        *,
        ignore: Sequence[Sequence[str]] | None = None,
        collide: Sequence[Sequence[str]] | None = None,
        neighbours: Literal["pass", "collide"] | None = None,
    ) -> Collisions: ...
    def copy(self) -> Collisions: ...
    @property
    def colliders(self) -> list[str]: ...
    def collides(self, q: ArrayLike, *, threads: int = 1) -> Any: ...
    def first_hit(self, q: ArrayLike) -> tuple[str, str] | None: ...
    def hits(self, q: ArrayLike) -> list[tuple[str, str]]: ...
    def clearance(
        self,
        q: ArrayLike,
        limit: float = ...,
    ) -> tuple[float, tuple[str, str], _Array] | None: ...
    def distance(self, q: ArrayLike, a: str, b: str) -> tuple[float, _Array] | None: ...
    def distances(
        self,
        q: ArrayLike,
        limit: float = ...,
    ) -> list[tuple[float, tuple[str, str], _Array]]: ...
    def path(
        self,
        start: ArrayLike,
        end: ArrayLike,
        least: float = 1e-3,
    ) -> tuple[Literal["free", "hit", "undecided"], float | None, tuple[str, str] | None]: ...
    def set_detail(self, detail: Literal["fine", "coarse"], *, of: str | None = None) -> None: ...
    def pad(self, name: str, padding: float) -> None: ...
    def hide(self, name: str) -> None: ...
    def show(self, name: str) -> None: ...
    def look_at(self, a: str, b: str, look: bool | None) -> None: ...
    def looks_at(self, a: str, b: str) -> bool: ...
    def set_points(self, collider: str, points: ArrayLike) -> None: ...
    def set_cells(self, collider: str, cells: ArrayLike, *, occupied: bool = True) -> None: ...
    def clear_cells(self, collider: str) -> None: ...
    def count(self, collider: str) -> int: ...

@final
class ConstrainedMotion:
    @property
    def vdot(self) -> _Array: ...
    @property
    def tau(self) -> _Array: ...
    @property
    def forces(self) -> dict[str, _Array]: ...
    @property
    def redundant(self) -> dict[str, int]: ...
    @property
    def rows(self) -> int: ...
    @property
    def rank(self) -> int: ...
    @property
    def contradiction(self) -> float: ...

@final
class Constraint:
    @property
    def name(self) -> str: ...
    @property
    def kind(self) -> Literal["loop", "coupling"]: ...
    @property
    def bodies(self) -> list[str]: ...
    @property
    def rows(self) -> int: ...
    @property
    def motions(self) -> int: ...

@final
class Contact:
    def __new__(
        cls,
        mechanism: Mechanism,
        colliders: Sequence[Collider] | None = None,
        *,
        ignore: Sequence[Sequence[str]] | None = None,
        collide: Sequence[Sequence[str]] | None = None,
        neighbours: Literal["pass", "collide"] | None = None,
        pairs: Mapping[tuple[str, str], Mapping[str, float]] | None = None,
        limits: Literal["stop", "ignore"] | None = None,
        margin: float | None = None,
        slop: float | None = None,
        correction: float | None = None,
        push_max: float | None = None,
        bounce_min: float | None = None,
        tolerance: float | None = None,
    ) -> Contact: ...
    @property
    def colliders(self) -> list[str]: ...
    def reset(self) -> None: ...
    def step(
        self,
        q: ArrayLike,
        v: ArrayLike,
        dt: float,
        tau: ArrayLike | None = None,
        *,
        wrenches: _Wrenches | None = None,
    ) -> ContactStep: ...
    def simulate(
        self,
        q: ArrayLike,
        v: ArrayLike,
        dt: float,
        steps: int,
        *,
        torque: ArrayLike | Callable[[float, _Array, _Array], ArrayLike] | None = None,
        wrenches: _Wrenches | None = None,
    ) -> tuple[_Array, _Array, _Array]: ...

@final
class ContactStep:
    @property
    def q(self) -> _Array: ...
    @property
    def v(self) -> _Array: ...
    @property
    def vdot(self) -> _Array: ...
    @property
    def pairs(self) -> list[tuple[str, str]]: ...
    @property
    def points(self) -> _Array: ...
    @property
    def normals(self) -> _Array: ...
    @property
    def gaps(self) -> _Array: ...
    @property
    def impulses(self) -> _Array: ...
    @property
    def forces(self) -> _Array: ...
    @property
    def penetration(self) -> float: ...
    @property
    def impacts(self) -> int: ...
    @property
    def converged(self) -> bool: ...
    @property
    def residual(self) -> float: ...

@final
class Edit:
    @property
    def mechanism(self) -> Mechanism: ...
    @property
    def q(self) -> _Array: ...
    @property
    def v(self) -> _Array: ...
    @property
    def places_v(self) -> list[int | None]: ...
    @property
    def places_q(self) -> list[int | None]: ...
    def add(
        self,
        name: str,
        parent: str = "world",
        hinge: Hinge | None = None,
        *,
        q: ArrayLike | None = None,
        v: ArrayLike | None = None,
        mass: float = 0.0,
        com: ArrayLike | None = None,
        inertia: ArrayLike | None = None,
        inertia_check: Literal["physical", "positive_moments"] = "physical",
        hinge_in_parent: ArrayLike | None = None,
        hinge_in_body: ArrayLike | None = None,
    ) -> Report: ...
    def add_mechanism(
        self,
        prefix: str,
        mechanism: Mechanism,
        q: ArrayLike,
        v: ArrayLike,
        onto: str = "world",
        pose: ArrayLike | None = None,
    ) -> Report: ...
    def delete(self, body: str) -> Report: ...
    def detach(self, body: str, base: str = "world") -> Report: ...
    def reroot(self, body: str) -> Report: ...
    def attach(
        self,
        body: str,
        onto: str,
        hinge: Hinge,
        *,
        q: ArrayLike | None = None,
        hinge_in_parent: ArrayLike | None = None,
        hinge_in_body: ArrayLike | None = None,
    ) -> Report: ...
    def attach_tree(
        self,
        body: str,
        onto: str,
        hinge: Hinge,
        *,
        q: ArrayLike | None = None,
        hinge_in_parent: ArrayLike | None = None,
        hinge_in_body: ArrayLike | None = None,
    ) -> Report: ...

@final
class Frames:
    def __new__(cls) -> Frames: ...
    def add_mechanism(self, name: str, mechanism: Mechanism, on: str = "world") -> None: ...
    def add_fixed(self, name: str, on: str = "world", pose: ArrayLike | None = None) -> None: ...
    def add_moving(self, name: str, on: str = "world", pose: ArrayLike | None = None) -> None: ...
    def fix(self, name: str, on: str, pose: ArrayLike | None = None) -> None: ...
    def set_state(
        self,
        mechanism: str,
        q: ArrayLike | None = None,
        v: ArrayLike | None = None,
        vdot: ArrayLike | None = None,
    ) -> None: ...
    def set_moving(
        self,
        name: str,
        pose: ArrayLike,
        velocity: ArrayLike | None = None,
        acceleration: ArrayLike | None = None,
    ) -> None: ...
    def pose(self, frame: str, seen_from: str = "world") -> _Array: ...
    def position(
        self,
        frame: str,
        seen_from: str = "world",
        axes: str | None = None,
    ) -> _Array: ...
    def velocity(
        self,
        frame: str,
        seen_from: str = "world",
        axes: str | None = None,
    ) -> _Array: ...
    def acceleration(
        self,
        frame: str,
        seen_from: str = "world",
        axes: str | None = None,
    ) -> _Array: ...
    @property
    def counts(self) -> tuple[int, int, int]: ...

@final
class Grip:
    def __enter__(self) -> Grip: ...
    def __exit__(self, *_exception: object) -> None: ...

@final
class Hinge:
    @staticmethod
    def pin(axis: ArrayLike) -> Hinge: ...
    @staticmethod
    def slider(axis: ArrayLike) -> Hinge: ...
    @staticmethod
    def screw(axis: ArrayLike, pitch: float) -> Hinge: ...
    @staticmethod
    def ball() -> Hinge: ...
    @staticmethod
    def free() -> Hinge: ...
    @staticmethod
    def locked() -> Hinge: ...
    @staticmethod
    def universal(first: ArrayLike, second: ArrayLike) -> Hinge: ...
    @staticmethod
    def cylindrical(axis: ArrayLike) -> Hinge: ...
    @staticmethod
    def gimbal() -> Hinge: ...
    @staticmethod
    def planar() -> Hinge: ...
    @staticmethod
    def chain(*hinges: Hinge) -> Hinge: ...
    def prescribed(self) -> Hinge: ...
    def armature(self, armature: float) -> Hinge: ...
    def gear(self, gear: float) -> Hinge: ...
    def limits(
        self,
        lower: float = ...,
        upper: float = ...,
        rate: float = ...,
        effort: float = ...,
    ) -> Hinge: ...
    @property
    def nq(self) -> int: ...
    @property
    def nv(self) -> int: ...

@final
class Identifiable:
    @property
    def names(self) -> list[str]: ...
    @property
    def base(self) -> list[str]: ...
    @property
    def combinations(self) -> _Array: ...
    @property
    def condition(self) -> float: ...
    @property
    def alone(self) -> list[str]: ...
    @property
    def without_influence(self) -> list[str]: ...

@final
class InverseKinematicsSearch:
    def advance(self, kinematics: int = 1000) -> bool: ...
    def solution(self) -> _Array: ...
    @property
    def outcome(self) -> Literal["met", "nearest", "open", "unfinished"]: ...
    @property
    def q(self) -> _Array: ...
    @property
    def residual(self) -> tuple[float, float] | None: ...
    @property
    def residuals(self) -> list[tuple[float, float]] | None: ...
    @property
    def kinematics(self) -> int: ...
    @property
    def restart(self) -> int: ...

@final
class Log:
    @property
    def t(self) -> _Array: ...
    @property
    def rows(self) -> int: ...
    def keys(self) -> list[str]: ...
    def unit(self, name: str) -> str: ...
    def __getitem__(self, name: str, /) -> _Array: ...
    def __len__(self) -> int: ...
    def __contains__(self, name: str, /) -> bool: ...
    def __iter__(self) -> Iterator[str]: ...

@final
class Mechanism:
    def inverse_mass_matrix(self, q: ArrayLike, *, threads: int = 1) -> _Array: ...
    def apply_inverse_mass(self, q: ArrayLike, x: ArrayLike, *, threads: int = 1) -> _Array: ...
    def node_jacobian(
        self,
        q: ArrayLike,
        frame: str,
        *,
        out: NDArray[np.float64] | None = None,
        threads: int = 1,
    ) -> _Array: ...
    def node_jacobian_rate(
        self,
        q: ArrayLike,
        v: ArrayLike,
        frame: str,
        *,
        threads: int = 1,
    ) -> _Array: ...
    def node_jacobian_transpose_product(
        self,
        q: ArrayLike,
        frame: str,
        wrench: ArrayLike,
        *,
        threads: int = 1,
    ) -> _Array: ...
    def centroidal_matrix(self, q: ArrayLike, *, threads: int = 1) -> _Array: ...
    def centroidal_bias(self, q: ArrayLike, v: ArrayLike, *, threads: int = 1) -> _Array: ...
    def com_jacobian(self, q: ArrayLike, *, threads: int = 1) -> _Array: ...
    def compliance(self, q: ArrayLike, frames: Sequence[str], *, threads: int = 1) -> _Array: ...
    def kinetic_energy(self, q: ArrayLike, v: ArrayLike, *, threads: int = 1) -> Any: ...
    def potential_energy(self, q: ArrayLike, *, threads: int = 1) -> Any: ...
    def identifiable_inertia(self, *, seed: int = 0, tolerance: float = 1e-8) -> Identifiable: ...
    def fit_inertia(
        self,
        q: ArrayLike,
        v: ArrayLike,
        vdot: ArrayLike,
        tau: ArrayLike,
        *,
        tolerance: float = 1e-6,
    ) -> Calibration: ...
    def calibrate_frames(
        self,
        node: str,
        q: ArrayLike,
        places: ArrayLike,
        *,
        length: float = 1.0,
        tolerance: float = 1e-6,
    ) -> Calibration: ...
    @property
    def constraints(self) -> list[Constraint]: ...
    def constraint_errors(
        self,
        q: ArrayLike,
        *,
        loop_motions: ArrayLike | None = None,
    ) -> dict[str, float]: ...
    @overload
    def close(self, q: ArrayLike, v: None = None, *, loop_motions: ArrayLike | None = None) -> _Array: ...
    @overload
    def close(self, q: ArrayLike, v: ArrayLike, *, loop_motions: ArrayLike | None = None) -> tuple[_Array, _Array]: ...
    def constrained_dynamics(
        self,
        q: ArrayLike,
        v: ArrayLike,
        tau: ArrayLike,
        *,
        solver: Literal["auto", "embed", "augment", "full"] = "auto",
        prescribed: ArrayLike | None = None,
        wrenches: _Wrenches | None = None,
        loop_motions: ArrayLike | None = None,
    ) -> ConstrainedMotion: ...
    def constraint_rank(self, q: ArrayLike, *, loop_motions: ArrayLike | None = None) -> Rank: ...
    def file_colliders(self) -> list[Collider]: ...
    def __copy__(self) -> Mechanism: ...
    def __deepcopy__(self, _memo: Any) -> Mechanism: ...
    def inverse_dynamics_derivatives(
        self,
        q: ArrayLike,
        v: ArrayLike,
        vdot: ArrayLike,
        *,
        wrenches: _Wrenches | None = None,
        threads: int = 1,
    ) -> tuple[_Array, _Array]: ...
    def forward_dynamics_derivatives(
        self,
        q: ArrayLike,
        v: ArrayLike,
        tau: ArrayLike,
        *,
        prescribed: ArrayLike | None = None,
        wrenches: _Wrenches | None = None,
        threads: int = 1,
    ) -> tuple[_Array, _Array, _Array]: ...
    def regressor(
        self,
        q: ArrayLike,
        v: ArrayLike,
        vdot: ArrayLike,
        *,
        threads: int = 1,
    ) -> _Array: ...
    def inertial_parameters(self) -> _Array: ...
    def inverse_dynamics(
        self,
        q: ArrayLike,
        v: ArrayLike,
        vdot: ArrayLike,
        *,
        wrenches: _Wrenches | None = None,
        out: NDArray[np.float64] | None = None,
        threads: int = 1,
    ) -> _Array: ...
    def forward_dynamics(
        self,
        q: ArrayLike,
        v: ArrayLike,
        tau: ArrayLike,
        *,
        prescribed: ArrayLike | None = None,
        wrenches: _Wrenches | None = None,
        out: NDArray[np.float64] | None = None,
        threads: int = 1,
    ) -> _Array: ...
    def mixed_dynamics(
        self,
        q: ArrayLike,
        v: ArrayLike,
        tau: ArrayLike,
        vdot: ArrayLike,
        *,
        wrenches: _Wrenches | None = None,
        threads: int = 1,
    ) -> tuple[_Array, _Array]: ...
    def bias_forces(
        self,
        q: ArrayLike,
        v: ArrayLike,
        *,
        wrenches: _Wrenches | None = None,
        threads: int = 1,
    ) -> _Array: ...
    def mass_matrix(
        self,
        q: ArrayLike,
        *,
        out: NDArray[np.float64] | None = None,
        threads: int = 1,
    ) -> _Array: ...
    def edit(self, q: ArrayLike, v: ArrayLike) -> Edit: ...
    @property
    def initial_q(self) -> _Array: ...
    @property
    def ignored(self) -> list[str]: ...
    @property
    def joints(self) -> dict[str, slice]: ...
    def couplings(self) -> tuple[_Array, _Array]: ...
    def to_urdf(self) -> tuple[str, list[str]]: ...
    def to_ron(self, name: str = "Machine") -> tuple[str, list[str]]: ...
    def inverse_kinematics(
        self,
        q: ArrayLike,
        targets: dict[str, Any] | Sequence[Target],
        *,
        keep: Sequence[str] | None = None,
        position_tolerance: float = 1e-9,
        orientation_tolerance: float = 1e-9,
        iterations: int = 100,
        restarts: int = 64,
        loop_motions: ArrayLike | None = None,
    ) -> _Array: ...
    def inverse_kinematics_rates(
        self,
        q: ArrayLike,
        targets: dict[str, Any] | Sequence[RateTarget],
        v: ArrayLike | None = None,
        *,
        keep: Sequence[str] | None = None,
    ) -> _Array: ...
    @property
    def nq(self) -> int: ...
    @property
    def nv(self) -> int: ...
    @property
    def bodies(self) -> list[str]: ...
    @property
    def nodes(self) -> list[str]: ...
    @property
    def subhinges(self) -> list[Subhinge]: ...
    @property
    def total_mass(self) -> float: ...
    @property
    def gravity(self) -> _Array: ...
    @gravity.setter
    def gravity(self, value: ArrayLike) -> None: ...
    @property
    def prescribed(self) -> list[bool]: ...
    def with_prescribed(self, bodies: Sequence[str]) -> Mechanism: ...
    def subgraph(self, bodies: Sequence[str]) -> Subgraph: ...
    @property
    def position_limits(self) -> tuple[_Array, _Array]: ...
    @property
    def rate_limits(self) -> _Array: ...
    @property
    def effort_limits(self) -> _Array: ...
    def coordinates(self, name: str) -> tuple[slice, slice]: ...
    def parent(self, body: str) -> str: ...
    def hinge(self, body: str) -> slice: ...
    def modes(self, body: str) -> tuple[slice, slice]: ...
    def neutral_q(self) -> _Array: ...
    def random_q(self, seed: int = 0) -> _Array: ...
    def random_v(self, seed: int = 0) -> _Array: ...
    def integrate(self, q: ArrayLike, dv: ArrayLike) -> _Array: ...
    def difference(self, q_from: ArrayLike, q_to: ArrayLike) -> _Array: ...
    def normalize(self, q: ArrayLike) -> _Array: ...
    def qdot(self, q: ArrayLike, v: ArrayLike) -> _Array: ...
    def state(self, q: ArrayLike, v: ArrayLike | None = None) -> State: ...
    def show(self, q: ArrayLike | None = None, *, path: _Path | None = None) -> None: ...
    def _repr_html_(self) -> str: ...
    def operators(self, q: ArrayLike, *, all_free: bool = False) -> Operators: ...
    def simulate(
        self,
        q: ArrayLike,
        v: ArrayLike,
        dt: float,
        steps: int,
        *,
        torque: ArrayLike | Callable[[float, _Array, _Array], ArrayLike] | None = None,
        integrator: Literal["rk4", "semi_implicit_euler"] = "rk4",
        wrenches: _Wrenches | None = None,
    ) -> tuple[_Array, _Array, _Array]: ...

@final
class Modes:
    @staticmethod
    def beam(
        length: float,
        *,
        young: float,
        shear: float,
        density: float,
        area: float,
        I_y: float,
        I_z: float,
        J: float,
        ends: Literal["clamped_free", "clamped_clamped", "clamped_pinned", "pinned_pinned", "free_free"] = "clamped_free",
        damping_ratio: float = 0.0,
        bending_y: int = 0,
        bending_z: int = 0,
        twist: int = 0,
        stretch: int = 0,
    ) -> Modes: ...
    @staticmethod
    def plate(
        length: float,
        width: float,
        thickness: float,
        *,
        young: float,
        poisson: float,
        density: float,
        count: int,
        damping_ratio: float = 0.0,
        attach: Sequence[tuple[float, float]] | None = None,
    ) -> Modes: ...
    @property
    def count(self) -> int: ...
    @property
    def mass(self) -> float: ...
    @property
    def stiffness(self) -> _Array: ...
    @property
    def damping(self) -> _Array: ...
    @property
    def mass_matrix(self) -> _Array: ...
    @property
    def frequencies(self) -> _Array: ...

@final
class Operator:
    @property
    def T(self) -> Operator: ...
    @property
    def shape(self) -> tuple[int, int] | None: ...
    def inv(self) -> Operator: ...
    def dense(self) -> _Array: ...
    def apply(self, x: ArrayLike) -> _Array: ...
    __array_ufunc__: None
    @overload
    def __mul__(self, right: Operator | float, /) -> Operator: ...
    @overload
    def __mul__(self, right: NDArray[Any] | Sequence[Any], /) -> _Array: ...
    @overload
    def __matmul__(self, right: Operator, /) -> Operator: ...
    @overload
    def __matmul__(self, right: NDArray[Any] | Sequence[Any], /) -> _Array: ...
    def __rmul__(self, left: float, /) -> Operator: ...
    def __truediv__(self, number: float, /) -> Operator: ...
    def __add__(self, other: Operator, /) -> Operator: ...
    def __sub__(self, other: Operator, /) -> Operator: ...
    def __neg__(self) -> Operator: ...
    def __radd__(self, other: NoReturn, /) -> NoReturn: ...
    def __rsub__(self, other: NoReturn, /) -> NoReturn: ...
    def __rmatmul__(self, left: NoReturn, /) -> NoReturn: ...
    def __rtruediv__(self, left: NoReturn, /) -> NoReturn: ...

@final
class Operators:
    @property
    def nv(self) -> int: ...
    @property
    def links(self) -> int: ...
    @property
    def link_bodies(self) -> list[str]: ...
    @property
    def I(self) -> Operator: ...
    @property
    def H(self) -> Operator: ...
    @property
    def Phi(self) -> Operator: ...
    @property
    def Psi(self) -> Operator: ...
    @property
    def EPhi(self) -> Operator: ...
    @property
    def EPsi(self) -> Operator: ...
    @property
    def M(self) -> Operator: ...
    @property
    def P(self) -> Operator: ...
    @property
    def D(self) -> Operator: ...
    @property
    def G(self) -> Operator: ...
    @property
    def K(self) -> Operator: ...
    @property
    def J(self) -> Operator: ...
    @property
    def Upsilon(self) -> Operator: ...
    @property
    def Omega(self) -> Operator: ...
    @property
    def mass(self) -> Operator: ...
    @property
    def mass_inverse(self) -> Operator: ...
    @property
    def jacobian(self) -> Operator: ...
    def B(self, *frames: str) -> Operator: ...

@final
class Outcome:
    @property
    def run(self) -> int: ...
    @property
    def ended(self) -> str: ...
    @property
    def orderly(self) -> bool: ...
    @property
    def why(self) -> str: ...
    @property
    def time(self) -> float: ...
    @property
    def seed(self) -> int: ...
    @property
    def state_hash(self) -> str: ...
    @property
    def wall(self) -> float: ...
    @property
    def metrics(self) -> dict[str, float]: ...

@final
class Rank:
    @property
    def free(self) -> int: ...
    @property
    def rows(self) -> int: ...
    @property
    def rank(self) -> int: ...
    @property
    def mobility(self) -> int: ...
    @property
    def redundant(self) -> dict[str, int]: ...

@final
class RateTarget:
    def __new__(
        cls,
        frame: str,
        velocity: ArrayLike,
        *,
        relative_to: str | None = None,
        linear_weight: float = 1.0,
        angular_weight: float = 1.0,
    ) -> RateTarget: ...

@final
class Report:
    @property
    def point(self) -> _Array: ...
    @property
    def momentum_before(self) -> _Array: ...
    @property
    def momentum_after(self) -> _Array: ...
    @property
    def impulse(self) -> _Array: ...
    @property
    def energy_before(self) -> float: ...
    @property
    def energy_after(self) -> float: ...

@final
class Results:
    @property
    def done(self) -> int: ...
    @property
    def runs(self) -> int: ...
    @property
    def files(self) -> list[Path]: ...
    @property
    def table(self) -> dict[str, Any]: ...
    @property
    def statistics(self) -> dict[str, Any]: ...
    @property
    def sensitivity(self) -> dict[str, Any]: ...
    @property
    def failures(self) -> dict[str, list[int]]: ...
    @property
    def missed(self) -> dict[str, list[int]]: ...
    @property
    def kept(self) -> int: ...

@final
class Robot(Collisions):
    def __new__(
        cls,
        mechanism: Mechanism,
        *,
        chains: Mapping[str, tuple[str, str]] | None = None,
        groups: Mapping[str, Sequence[str]] | None = None,
        srdf: _Path | None = None,
        objects: Mapping[str, tuple[float, ArrayLike, ArrayLike] | Mechanism] | None = None,
        colliders: Sequence[Collider] | None = None,
        ignore: Sequence[Sequence[str]] | None = None,
        collide: Sequence[Sequence[str]] | None = None,
        neighbours: Literal["pass", "collide"] | None = None,
    ) -> Robot: ...
    def copy(self) -> Robot: ...
    @property
    def q(self) -> _Array: ...
    @q.setter
    def q(self, value: ArrayLike) -> None: ...
    @property
    def parts(self) -> dict[str, list[str]]: ...
    @property
    def objects(self) -> list[str]: ...
    def dofs(self, part: str) -> list[int]: ...
    def tip_pose(self, part: str) -> _Array: ...
    def base_pose(self, part: str) -> _Array: ...
    def body_pose(self, body: str) -> _Array: ...
    def jacobian(self, part: str, *, whole: bool = False) -> _Array: ...
    def ellipsoid(
        self,
        part: str,
        *,
        rows: Literal["all", "linear", "angular"] = "all",
        length: float = 1.0,
    ) -> tuple[_Array, _Array]: ...
    def manipulability(
        self,
        part: str,
        *,
        rows: Literal["all", "linear", "angular"] = "all",
        length: float = 1.0,
    ) -> tuple[float, _Array]: ...
    def is_valid(self, q: ArrayLike) -> bool: ...
    def plan(
        self,
        part: str,
        goal: ArrayLike,
        start: ArrayLike | None = None,
        *,
        seed: int = 1,
        step: float = 0.5,
        room: int = 2000,
    ) -> _Array: ...
    def prioritized_joint_rates(
        self,
        levels: Sequence[Mapping[str, ArrayLike] | ArrayLike],
        *,
        horizon: float = 0.1,
        manipulable: Mapping[str, float] | None = None,
        length: float = 1.0,
    ) -> tuple[_Array, _Array]: ...
    def joint_rates(self, part: str, twist: ArrayLike) -> tuple[_Array, tuple[float, float]]: ...
    def whole_body(
        self,
        v: ArrayLike,
        levels: Sequence[Mapping[str, ArrayLike] | ArrayLike],
        *,
        touches: Sequence[Sequence[Any]] | None = None,
        effort: ArrayLike | None = None,
        length: float = 1.0,
    ) -> WholeBodyForces: ...
    def impedance(
        self,
        springs: Mapping[str, Sequence[ArrayLike]],
        v: ArrayLike,
        rest: ArrayLike | None = None,
    ) -> _Array: ...
    def composite_inertia(self, body: str) -> tuple[float, _Array, _Array]: ...
    def momentum(self, v: ArrayLike) -> _Array: ...
    def centroidal_matrix(self) -> _Array: ...
    def gravity_forces(self) -> _Array: ...
    def feed_forward(
        self,
        v: ArrayLike,
        a: ArrayLike,
        pushes: Mapping[str, ArrayLike] | None = None,
    ) -> _Array: ...
    def bias(self, v: ArrayLike, parts: Sequence[str]) -> tuple[_Array, _Array]: ...
    def predict(
        self,
        q: ArrayLike,
        v: ArrayLike,
        tau: ArrayLike,
        dt: float,
        covariance: ArrayLike,
        *,
        density: ArrayLike | None = None,
    ) -> tuple[_Array, _Array, _Array]: ...
    def balance(
        self,
        object: str,
        tau: ArrayLike,
        *,
        by: Literal["equal", "effort"] = "effort",
    ) -> tuple[_Array, float]: ...
    def mass_matrix(self) -> _Array: ...
    def center_of_mass(self) -> tuple[float, _Array]: ...
    def feed_forward_with_object(
        self,
        object: str,
        v: ArrayLike,
        a: ArrayLike,
        rates: ArrayLike,
        accelerations: ArrayLike,
        pushes: Mapping[str, ArrayLike] | None = None,
    ) -> tuple[_Array, _Array]: ...
    def mass_matrix_with_object(self, object: str) -> _Array: ...
    def squeeze(self, object: str, tau: ArrayLike, force: float) -> tuple[_Array, _Array]: ...
    def add_hand_wrenches(self, object: str, tau: ArrayLike, wrenches: ArrayLike) -> _Array: ...
    def split_hand_wrenches(
        self,
        object: str,
        wrenches: ArrayLike,
        *,
        hands: tuple[float, float] = ...,
        moment: float = 1.0,
    ) -> tuple[_Array, _Array, _Array]: ...
    def grip(
        self,
        object: str,
        wrenches: ArrayLike,
        *,
        friction: Sequence[tuple[Sequence[float], float, float, float]],
    ) -> tuple[_Array, float]: ...
    def task_inertia(self, parts: Sequence[str]) -> _Array: ...
    def task_forces(
        self,
        parts: Sequence[str],
        v: ArrayLike,
        a: ArrayLike,
        rest: ArrayLike | None = None,
    ) -> _Array: ...
    def grasp(self, hand: str, object: str, at: ArrayLike | None = None) -> Grip: ...
    def update_grasp(self, hand: str, object: str, at: ArrayLike) -> None: ...
    def release(self, hand: str, object: str) -> None: ...
    def ungrasp(self, object: str) -> None: ...
    def attach(
        self,
        object: str,
        on: str,
        body: str | None = None,
        at: ArrayLike | None = None,
    ) -> None: ...
    def detach(self, object: str) -> None: ...
    def hands(self, object: str) -> list[str]: ...
    def put(self, object: str, at: ArrayLike) -> None: ...
    def object_pose(self, object: str) -> _Array: ...
    def object_bodies(self, object: str) -> list[str]: ...
    def object_q(self, object: str) -> _Array: ...
    def set_object_q(self, object: str, q: ArrayLike) -> None: ...
    def object_body_pose(self, object: str, body: str) -> _Array: ...
    def object_jacobian(self, object: str, body: str) -> _Array: ...
    def closure(
        self,
        object: str,
        *,
        hand: str | None = None,
        body: str | None = None,
        free: list[bool] | None = None,
    ) -> dict[str, int]: ...
    def inverse_kinematics(
        self,
        part: str,
        at: ArrayLike | None = None,
        q: ArrayLike | None = None,
        *,
        in_base: bool = False,
        position_tolerance: float = 1e-9,
        orientation_tolerance: float = 1e-9,
        steps: int = 100,
        restarts: int = 64,
        axis: ArrayLike | None = None,
        along: ArrayLike | None = None,
        look_at: ArrayLike | None = None,
        within: float = 0.0,
        plane: ArrayLike | None = None,
        line: ArrayLike | None = None,
    ) -> _Array: ...
    def begin_inverse_kinematics(
        self,
        part: str,
        at: ArrayLike | None = None,
        q: ArrayLike | None = None,
        *,
        in_base: bool = False,
        position_tolerance: float = 1e-9,
        orientation_tolerance: float = 1e-9,
        steps: int = 100,
        restarts: int = 64,
        axis: ArrayLike | None = None,
        along: ArrayLike | None = None,
        look_at: ArrayLike | None = None,
        within: float = 0.0,
        plane: ArrayLike | None = None,
        line: ArrayLike | None = None,
    ) -> InverseKinematicsSearch: ...
    def inverse_kinematics_best(
        self,
        part: str,
        at: ArrayLike | None = None,
        q: ArrayLike | None = None,
        *,
        centred: float = 1.0,
        near: float = 0.0,
        manipulable: float = 0.0,
        length: float = 1.0,
        starts: int = 8,
        improve: int = 400,
        in_base: bool = False,
        axis: ArrayLike | None = None,
        along: ArrayLike | None = None,
        look_at: ArrayLike | None = None,
        within: float = 0.0,
        plane: ArrayLike | None = None,
        line: ArrayLike | None = None,
    ) -> tuple[_Array, float]: ...
    def inverse_kinematics_all(
        self,
        part: str,
        at: ArrayLike,
        q: ArrayLike | None = None,
        *,
        held: int | None = None,
        in_base: bool = False,
    ) -> _Array: ...
    def time_parameterize(
        self,
        path: ArrayLike,
        *,
        acceleration: ArrayLike | None = None,
        rate: ArrayLike | None = None,
        effort: ArrayLike | None = None,
        round: float = 0.0,
        sections: int | None = None,
    ) -> Trajectory: ...
    def transfer(
        self,
        goal: ArrayLike,
        *,
        start: ArrayLike | None = None,
        v: ArrayLike | None = None,
        a: ArrayLike | None = None,
        goal_v: ArrayLike | None = None,
        goal_a: ArrayLike | None = None,
        rate: ArrayLike | None = None,
        acceleration: ArrayLike,
        jerk: ArrayLike,
    ) -> Trajectory: ...
    def inverse_kinematics_together(
        self,
        targets: dict[str, Any] | Sequence[Target],
        q: ArrayLike | None = None,
        *,
        in_base: Sequence[str] | None = None,
        keep: Sequence[str] | None = None,
        position_tolerance: float = 1e-9,
        orientation_tolerance: float = 1e-9,
        steps: int = 100,
        restarts: int = 64,
    ) -> _Array: ...
    def begin_inverse_kinematics_together(
        self,
        targets: dict[str, Any] | Sequence[Target],
        q: ArrayLike | None = None,
        *,
        in_base: Sequence[str] | None = None,
        keep: Sequence[str] | None = None,
        position_tolerance: float = 1e-9,
        orientation_tolerance: float = 1e-9,
        steps: int = 100,
        restarts: int = 64,
    ) -> InverseKinematicsSearch: ...
    def inverse_kinematics_together_best(
        self,
        targets: dict[str, Any] | Sequence[Target],
        q: ArrayLike | None = None,
        *,
        centred: float = 1.0,
        near: float = 0.0,
        manipulable: float = 0.0,
        length: float = 1.0,
        starts: int = 8,
        improve: int = 400,
        in_base: Sequence[str] | None = None,
        keep: Sequence[str] | None = None,
    ) -> tuple[_Array, float]: ...
    def worst_case_steps(
        self,
        *,
        together: bool = False,
        weight: float = 1.0,
        position_tolerance: float = 1e-9,
        orientation_tolerance: float = 1e-9,
        steps: int = 100,
        restarts: int = 64,
    ) -> int: ...

@final
class Series:
    @property
    def t(self) -> _Array: ...
    @property
    def y(self) -> _Array: ...
    @property
    def unit(self) -> str: ...

@final
class Simulation:
    def __new__(
        cls,
        path: _Path,
        overrides: Mapping[str, Any] | None = None,
        *,
        seed: int | None = None,
        until: _Time | None = None,
        models: Mapping[str, type] | None = None,
    ) -> Simulation: ...
    @staticmethod
    def resume(
        path: _Path,
        *,
        until: _Time | None = None,
        models: Mapping[str, type] | None = None,
    ) -> Simulation: ...
    def save(self, path: _Path) -> None: ...
    def fork(self) -> Simulation: ...
    @property
    def time(self) -> float: ...
    @property
    def dt(self) -> float: ...
    @property
    def until(self) -> float | None: ...
    @property
    def seed(self) -> int: ...
    @property
    def state_hash(self) -> str: ...
    @property
    def configuration(self) -> str: ...
    def step(self, n: int = 1) -> None: ...
    def step_event(self) -> str: ...
    def run_until(self, t: _Time) -> None: ...
    def run(self) -> None: ...
    def at(self, rate: float, function: Callable[[Simulation], object]) -> None: ...
    def every(self, seconds: _Time, function: Callable[[Simulation], object]) -> None: ...
    @property
    def phase(self) -> str: ...
    @property
    def mechanism(self) -> Mechanism: ...
    def show(self, *, path: _Path | None = None) -> None: ...
    @property
    def q(self) -> _Array: ...
    @property
    def v(self) -> _Array: ...
    def _repr_html_(self) -> str: ...
    def log(
        self,
        channels: Sequence[str],
        rate: float | None = None,
        *,
        on_change: bool = False,
        around: str | None = None,
        before: _Time | None = None,
        after: _Time | None = None,
    ) -> Log: ...
    def record(
        self,
        path: _Path,
        channels: Sequence[str] | None = None,
        rate: float | None = None,
        *,
        on_change: bool = False,
        around: str | None = None,
        before: _Time | None = None,
        after: _Time | None = None,
    ) -> None: ...
    def stop_recording(self) -> None: ...
    def __getitem__(self, path: str, /) -> Any: ...
    def __setitem__(self, path: str, value: ArrayLike, /) -> None: ...
    def pin(self, pattern: str, value: float | str | None = None) -> dict[str, float]: ...
    def unpin(self, pattern: str = "**") -> dict[str, float]: ...
    @property
    def pins(self) -> dict[str, float]: ...
    def __contains__(self, path: str, /) -> bool: ...
    def variables(self, pattern: str = "**") -> dict[str, Variable]: ...
    @property
    def parts(self) -> list[str]: ...
    def parameters(self, part: str) -> dict[str, Any]: ...

@final
class State:
    @property
    def q(self) -> _Array: ...
    @property
    def v(self) -> _Array: ...
    def pose(self, frame: str) -> _Array: ...
    def position(self, frame: str) -> _Array: ...
    def quaternion(self, frame: str) -> _Array: ...
    def velocity(self, frame: str) -> _Array: ...
    def acceleration(self, frame: str) -> _Array: ...
    def bias_acceleration(self, frame: str) -> _Array: ...
    def body_com(self, body: str) -> _Array: ...
    def subtree_inertia(self, body: str) -> _Array: ...
    def center_of_mass(self) -> _Array: ...
    def com_velocity(self) -> _Array: ...
    def com_acceleration(self) -> _Array: ...
    def momentum(self) -> _Array: ...
    def kinetic_energy(self) -> float: ...
    def potential_energy(self) -> float: ...
    def add_wrench(self, frame: str, wrench: ArrayLike) -> None: ...
    def clear_wrenches(self) -> None: ...
    def forward_dynamics(self, tau: ArrayLike, vdot: ArrayLike | None = None) -> _Array: ...
    def inverse_dynamics(self, vdot: ArrayLike) -> _Array: ...

@final
class Subgraph:
    @property
    def mechanism(self) -> Mechanism: ...
    @property
    def base(self) -> str | None: ...
    @property
    def q(self) -> list[int]: ...
    @property
    def v(self) -> list[int]: ...

@final
class Subhinge:
    @property
    def body(self) -> str: ...
    @property
    def parent(self) -> str: ...
    @property
    def kind(self) -> str: ...
    @property
    def axis(self) -> _Array | None: ...
    @property
    def pitch(self) -> float: ...
    @property
    def q(self) -> slice: ...
    @property
    def v(self) -> slice: ...
    @property
    def prescribed(self) -> bool: ...
    @property
    def armature(self) -> float: ...
    @property
    def gear(self) -> float: ...
    @property
    def lower(self) -> float: ...
    @property
    def upper(self) -> float: ...
    @property
    def rate(self) -> float: ...
    @property
    def effort(self) -> float: ...

@final
class Target:
    def __new__(
        cls,
        frame: str,
        at: ArrayLike | None = None,
        *,
        relative_to: str | None = None,
        position_weight: float = 1.0,
        orientation_weight: float = 1.0,
        axis: ArrayLike | None = None,
        along: ArrayLike | None = None,
        look_at: ArrayLike | None = None,
        within: float = 0.0,
        plane: ArrayLike | None = None,
        line: ArrayLike | None = None,
    ) -> Target: ...

@final
class Trajectory:
    @property
    def duration(self) -> float: ...
    def at(self, t: ArrayLike) -> tuple[_Array, _Array, _Array]: ...

@final
class Variable:
    @property
    def path(self) -> str: ...
    @property
    def unit(self) -> str: ...
    @property
    def doc(self) -> str: ...
    @property
    def role(self) -> str: ...
    @property
    def part(self) -> str: ...

@final
class WholeBodyForces:
    @property
    def tau(self) -> _Array: ...
    @property
    def vdot(self) -> _Array: ...
    @property
    def forces(self) -> _Array: ...
    @property
    def unbalanced(self) -> float: ...
    @property
    def slipping(self) -> float: ...
    @property
    def shortfall(self) -> float: ...

@final
class _Gathering:
    def todo(self) -> list[int]: ...
    def counts(self) -> tuple[int, int]: ...
    def add(self, line: str) -> tuple[int, float]: ...
    @property
    def path(self) -> Path: ...
    def finish(self) -> Results: ...
