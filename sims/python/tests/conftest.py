"""Shared fixtures and functions: the source tree, the reference robots, random mechanisms."""

import contextlib
import doctest
import inspect
import json
import os
import signal
from pathlib import Path

import numpy as np
import pytest

import linkwork as lw

# A shell that runs the tests in the background ignores SIGINT, and the tests would inherit that.
signal.signal(signal.SIGINT, signal.default_int_handler)

SOURCE = Path(os.environ.get("LINKWORK_SOURCE", Path(__file__).resolve().parents[3]))
ROBOTS = SOURCE.parent / "shared" / "reference" / "robots"


@pytest.fixture
def at_source(monkeypatch):
    """Change to the source tree, which contains `sims/...` and `assemblies`."""
    monkeypatch.chdir(SOURCE)
    return SOURCE


def program():
    """Return the path of the command line, which `cargo build --release --bin linkwork` builds."""
    path = Path(os.environ.get("CARGO_TARGET_DIR", SOURCE / "target")) / "release" / "linkwork"
    if not path.exists():
        assert "CI" not in os.environ, f"there is no {path}"
        pytest.skip(f"the command line is not built: {path}")
    return path


#: The result files of a campaign.
FILES = [f"{t}.{e}" for t in ("results", "statistics", "sensitivity", "requirements", "bands") for e in ("csv", "parquet")] + ["report.html"]


def files_of(folder):
    """Return {name: content} of the files that must not depend on how a campaign was run."""
    return {name: (folder / name).read_bytes() for name in FILES}


def left_by_runs(folder):
    """Return {name: content} of the files of the runs of a campaign: histories and folders of failures."""
    tops = [folder / "failures", folder / "histories"]
    files = [f for top in tops for f in top.rglob("*") if f.is_file()]
    return {str(f.relative_to(folder)): f.read_bytes() for f in files}


def campaign_file(folder, runs):
    """Write a campaign of pendulums, 2 s each. With high friction the step is too long, so the run fails; a text is rejected."""
    file = folder / f"pendulums_{runs}.ron"
    file.write_text(f"""Campaign(
    simulation: "{SOURCE / "sims/pendulum"}",
    runs: {runs},
    set: {{ "until": "2 s" }},
    vary: {{
        "bob.mass": Uniform(from: "0.5 kg", to: "2 kg"),
        "bob.com": [0, 0, Uniform(from: -1.2, to: -0.8)],
        "Friction.damping": Choice(of: [0.02, 0.05, 0.1, 1e4, "a lot"]),
    }},
    retain: (of: ["bob.angle"], every: "0.1 s"),
    require: {{ "it swings fast": (metric: "largest speed", most: "3 rad/s") }},
)
""")
    return file


def robot(name):
    """Return Pinocchio's values for a robot. Skips the test if they are missing, except in CI."""
    path = ROBOTS / f"{name}.json"
    if not path.exists():
        assert "CI" not in os.environ, f"there is no {path}"
        pytest.skip(f"reference data are not at hand: {path.name}")
    return json.loads(path.read_text())


def rotation(axis, angle):
    """Rodrigues' formula."""
    x, y, z = np.asarray(axis) / np.linalg.norm(axis)
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K


def matrix_of(quaternion):
    """Rotation matrix of [x y z w]."""
    *u, w = quaternion
    x, y, z = u
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + 2 * w * K + 2 * K @ K


def random_mechanism(seed, bodies=7, floating=False, prescribed=False):
    """Return a branching tree with every kind of hinge, and a node on each body."""
    r = np.random.default_rng(seed)

    def some(n):
        return r.uniform(0.1, 1.0, n) * r.choice([-1.0, 1.0], n)

    def hinge(first):
        if first and floating:
            return lw.Hinge.free()
        kinds = [
            lambda: lw.Hinge.pin(some(3)),
            lambda: lw.Hinge.slider(some(3)),
            lambda: lw.Hinge.screw(some(3), 0.3),
            lambda: lw.Hinge.ball(),
            lambda: lw.Hinge.universal(some(3), some(3)),
            lambda: lw.Hinge.planar(),
        ]
        made = kinds[r.integers(len(kinds))]().armature(0.05)
        return made.prescribed() if prescribed and r.random() < 0.4 else made

    def pose():
        q = some(4)
        return np.concatenate([0.5 * some(3), q / np.linalg.norm(q)])

    b = lw.Builder()
    for i in range(bodies):
        A = some(9).reshape(3, 3)
        second = A @ A.T + 0.1 * np.eye(3)
        b.body(
            f"b{i}",
            "world" if i == 0 else f"b{r.integers(max(0, i - 3), i)}",
            hinge(i == 0),
            mass=0.5 + abs(some(1)[0]),
            com=0.3 * some(3),
            inertia=0.1 * (np.trace(second) * np.eye(3) - second),
            hinge_in_parent=pose(),
            hinge_in_body=pose(),
        )
        b.node(f"n{i}", f"b{i}", pose())
    return b.build()


def off(a, b):
    """Return the largest difference relative to the largest magnitude; infinite for NaN and different shapes."""
    a, b = np.asarray(a, float), np.asarray(b, float)
    if a.shape != b.shape or not np.all(np.isfinite(a - b)):
        return np.inf
    return float(np.max(np.abs(a - b), initial=0.0) / max(np.max(np.abs(b), initial=0.0), 1e-300))


#: Classes whose objects need a run in another process; `test_docstrings.py` and the tests of `attach` create them.
ELSEWHERE = {"Attached"}


def exported_classes():
    """Return {name: class} of all classes that the package exports, except errors."""
    public = {name: getattr(lw, name) for name in lw.__all__}
    return {n: c for n, c in public.items() if inspect.isclass(c) and not issubclass(c, BaseException)}


def exported_objects(folder):
    """Return {name: object} of every class of `exported_classes` except `ELSEWHERE`, created by the example in its docstring. The examples use files in `folder`."""
    found = {}
    for name in ("sims", "assemblies"):
        if not (folder / name).exists():
            (folder / name).symlink_to(SOURCE / name)
    before = os.getcwd()
    os.chdir(folder)
    try:
        for name, cls in exported_classes().items():
            if name not in ELSEWHERE:
                found[name] = made_by_example(name, cls)
    finally:
        os.chdir(before)
    return found


def made_by_example(name, cls):
    """Return an object of a class from the example of its docstring."""
    space, values = {"linkwork": lw, "np": np}, []
    for example in doctest.DocTestParser().get_examples(cls.__doc__ or ""):
        with contextlib.suppress(lw.LinkworkError):
            try:
                values.append(eval(example.source, space))
            except SyntaxError:
                exec(example.source, space)
    of = [x for x in [*space.values(), *values] if type(x) is cls]
    assert of, f"the example of `{name}` makes no {name}"
    return of[0]
