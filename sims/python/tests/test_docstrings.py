"""The examples in the package's docstrings run; and every method of the classes below has one, with what it takes, gives and refuses."""

import doctest
import inspect
import re

import numpy as np
import pytest
from conftest import SOURCE

import linkwork as lw

PUBLIC = {name: value for name, value in vars(lw).items() if name in lw.__all__}
CLASSES = {n: c for n, c in PUBLIC.items() if inspect.isclass(c)}

#: Classes of which every public method has an example, with shapes or units, and what it refuses.
COMPLETE = ["Builder", "Collisions", "Hinge", "Mechanism", "Robot", "State"]

#: Methods that refuse nothing: they take no argument that could be wrong.
REFUSE_NOTHING = {
    "Builder": set(),
    "Collisions": {"copy", "colliders"},
    "Hinge": {"ball", "free", "locked", "gimbal", "planar", "chain", "prescribed", "armature", "gear", "limits", "nq", "nv"},
    "Mechanism": {
        "nq", "nv", "bodies", "nodes", "subhinges", "total_mass", "prescribed", "position_limits", "rate_limits", "effort_limits", "neutral_q",
        "random_q", "random_v", "ignored", "joints", "initial_q", "couplings", "to_ron", "constraints", "inertial_parameters",
    },
    "State": {
        "q", "v", "center_of_mass", "com_velocity", "momentum", "kinetic_energy", "potential_energy", "clear_wrenches",
    },
    "Robot": {"copy", "parts", "objects", "hands", "gravity_forces", "mass_matrix", "center_of_mass", "object_pose"},
}

#: Methods of names and answers alone: there is nothing to measure.
NAMES = {
    "Builder": {"build"},
    "Hinge": {"pin", "slider", "ball", "free", "locked", "universal", "cylindrical", "gimbal", "planar", "chain", "prescribed", "gear", "nq", "nv"},
    "Mechanism": {
        "nq", "nv", "bodies", "nodes", "subhinges", "prescribed", "with_prescribed", "subgraph", "coordinates", "parent", "hinge", "state", "ignored",
        "joints", "to_urdf", "to_ron", "file_colliders", "constraints",
    },
    "State": {"clear_wrenches"},
    "Collisions": {"copy", "colliders", "hide", "show", "look_at", "looks_at", "clear_cells", "count"},
    "Robot": {"copy", "parts", "objects", "dofs", "release", "ungrasp", "hands"},
}

#: A shape, or a unit.
MEASURES = re.compile(r"\((?:n|nq|nv|k|\d+)\b[^)]*\)|\b(?:m|rad|kg|N|J)\b")


def own_methods(cls):
    """{name: docstring} of what a class adds itself, without what Python calls by itself."""
    # By `getattr`: in `vars` a static method hides what it is about.
    return {n: inspect.getdoc(getattr(cls, n)) or "" for n in vars(cls) if not n.startswith("_")}


def run(texts):
    """Examples one after another, in one namespace; how many there were."""
    space, count = {"linkwork": lw, "np": np}, 0
    for name, text in texts:
        parsed = doctest.DocTestParser().get_doctest(text, space, name, None, 0)
        count += len(parsed.examples)
        runner = doctest.DocTestRunner(optionflags=doctest.NORMALIZE_WHITESPACE)
        assert runner.run(parsed, clear_globs=False).failed == 0, f"{name}: see the output above"
        space = parsed.globs
    return count


@pytest.fixture(autouse=True)
def where_examples_find_files(tmp_path, monkeypatch):
    """A folder to write in, with the simulations."""
    (tmp_path / "sims").symlink_to(SOURCE / "sims")
    (tmp_path / "assemblies").symlink_to(SOURCE / "assemblies")
    monkeypatch.chdir(tmp_path)


def test_there_are_examples():
    assert sum(">>>" in t for c in CLASSES.values() for t in own_methods(c).values()) >= 40


@pytest.mark.parametrize("name", sorted(PUBLIC))
def test_examples_of_docstrings_run(name):
    value = PUBLIC[name]
    own = (name, getattr(value, "__doc__", None) or "")
    run([own])
    if inspect.isclass(value):
        # The example of the class makes what those of its methods use, anew for each.
        for method, text in own_methods(value).items():
            if ">>>" in text:
                run([own, (f"{name}.{method}", text)])


@pytest.mark.parametrize("name", COMPLETE)
def test_every_method_has_an_example_and_says_what_it_refuses(name):
    for method, text in own_methods(CLASSES[name]).items():
        assert ">>>" in text, f"{name}.{method} has no example"
        words = text.split(">>>")[0]
        assert MEASURES.search(words) or method in NAMES[name], f"{name}.{method} tells no shape and no unit"
        assert "LinkworkError" in words or method in REFUSE_NOTHING[name], f"{name}.{method}: what does it refuse?"
