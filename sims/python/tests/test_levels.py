"""The choice between builds of the compiled module, and data that is transferred between them."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from conftest import SOURCE

import linkwork as lw
from linkwork import _choose, _linkwork

PACKAGE = Path(lw.__file__).parent
#: The levels whose builds are in the package and run here; empty if it has one build.
BUILDS = [level for level in _choose.LEVELS if list(PACKAGE.glob(f"_linkwork_{level}.*")) and level in _linkwork._levels()]


@pytest.mark.parametrize(
    "there, has, wanted, chosen",
    [
        (["v2", "v3", "v4"], ["v2", "v3", "v4"], "", "v4"),
        (["v2", "v3", "v4"], ["v2", "v3"], "", "v3"),
        (["v4", "v3", "v2"], ["v2"], "", "v2"),
        (["v2", "v4"], ["v2", "v3"], "", "v2"),
        (["v2", "v3", "v4"], ["v2", "v3", "v4"], "v2", "v2"),
        (["v3"], ["v2", "v3", "v4"], "", "v3"),
    ],
)
def test_the_highest_that_the_processor_has_or_the_one_that_is_wanted(there, has, wanted, chosen):
    assert _choose.choose(there, has, wanted) == chosen


@pytest.mark.parametrize(
    "there, has, wanted, said",
    [
        (["v2", "v3", "v4"], ["v2", "v3"], "v4", "selects x86-64-v4, but this processor supports x86-64-v2, x86-64-v3"),
        (["v2", "v3"], ["v2", "v3", "v4"], "v4", "the package is built for x86-64-v2, x86-64-v3"),
        (["v2"], ["v2"], "avx2", "LINKWORK_CPU is `avx2`"),
        (["v3", "v4"], ["v2"], "", "this processor supports x86-64-v2, but the package is built for x86-64-v3"),
        (["v2"], [], "", "this processor supports none of the levels"),
    ],
)
def test_what_cannot_be_chosen_is_refused_with_a_remedy(there, has, wanted, said):
    with pytest.raises(ImportError, match=said) as refused:
        _choose.choose(there, has, wanted)
    assert "\n  help: " in str(refused.value)


def python(code, cpu="", folder=None):
    """Return the output of a fresh interpreter, or raise with its last two lines."""
    given = {**os.environ, "LINKWORK_CPU": cpu, "LINKWORK_SOURCE": str(SOURCE)}
    if folder is not None:
        given["PYTHONPATH"] = str(folder)
    ran = subprocess.run([sys.executable, "-c", code], env=given, capture_output=True, text=True, cwd=folder)
    assert ran.returncode in (0, 1), f"{ran.returncode}: {ran.stderr}"
    return (ran.stdout or "\n".join(ran.stderr.splitlines()[-2:])).strip()


def test_the_processor_is_as_the_system_says():
    cpuinfo = Path("/proc/cpuinfo")
    flags = cpuinfo.read_text().split() if cpuinfo.exists() else []
    if "flags" in flags:
        assert ("v3" in _linkwork._levels()) == ("avx2" in flags and "fma" in flags and "movbe" in flags)
        assert ("v4" in _linkwork._levels()) == ("avx512vl" in flags and "avx512dq" in flags)


def builds(folder, levels):
    """The installed package with the present build under the names of these levels; without levels as the only one."""
    package = folder / "linkwork"
    shutil.copytree(PACKAGE, package, ignore=shutil.ignore_patterns("_linkwork*.so", "_linkwork*.pyd", "__pycache__"))
    file = Path(_linkwork.__file__)
    ending = "." + file.name.split(".", 1)[1]
    for name in [f"_linkwork_{level}" for level in levels] or ["_linkwork"]:
        shutil.copy(file, package / f"{name}{ending}")
    return folder


FILE = "import linkwork; print(linkwork._linkwork.__file__.split('/')[-1].split('.')[0], linkwork._linkwork.__name__)"
#: Pickles contain the name of the module, so that they can be transferred between builds.
WORKS = (
    "import pickle, linkwork as lw; b = lw.Builder().body('a', hinge=lw.Hinge.pin([0, 1, 0]), mass=1, com=[0, 0, -1], inertia=[[1, 0, 0], [0, 1, 0], [0, 0, 1]]);"
    "m = pickle.loads(pickle.dumps(b.build())); print(m.forward_dynamics([0.5], [0.0], [0.0])[0], type(m).__module__, lw.LinkworkError.__module__)"
)


@pytest.mark.parametrize("levels", [[], ["v2"], ["v3"], ["v2", "v3"], ["v2", "v3", "v4"]])
def test_a_package_works_with_the_builds_that_it_has(levels, tmp_path):
    folder = builds(tmp_path, levels)
    has = _linkwork._levels()
    if levels and not set(levels) & set(has):
        assert "the package is built for" in python(FILE, folder=folder)
        return
    best = max((level for level in levels if level in has), default="")
    assert python(FILE, folder=folder) == f"_linkwork{'_' * bool(best)}{best} linkwork._linkwork"
    said, *modules = python(WORKS, folder=folder).split()
    # The equation of motion is (I + m c²) ω̇ = −m g c sin q.
    assert float(said) == pytest.approx(-9.81 * np.sin(0.5) / 2, rel=1e-12)
    assert modules == ["linkwork", "linkwork"]
    for level in levels:
        if level in has:
            assert python(FILE, level, folder).startswith(f"_linkwork_{level} ")


@pytest.mark.parametrize("cpu", ["v1", "v4 ", "x86-64-v3"])
def test_a_level_that_there_is_not_is_refused_at_import(cpu):
    said = python(FILE, cpu)
    assert said.startswith("ImportError: LINKWORK_CPU is `") and "help: set it to one of v2, v3, v4" in said


def test_the_only_build_is_the_one_that_is_asked_for_or_refused(tmp_path):
    folder = builds(tmp_path, [])
    for level in _choose.LEVELS:
        said = python(FILE, level, folder)
        if lw.__cpu__ == f"x86-64-{level}":
            assert said == "_linkwork linkwork._linkwork"
        else:
            assert f"selects x86-64-{level}, but the package is built for {lw.__cpu__}\n  help: " in said


RUN = """
import linkwork as lw
start, stop, to = ARGS
sim = lw.Simulation.resume(start) if start.endswith('lwck') else lw.Simulation(start)
sim.run_until(float(stop))
sim.save(to)
print(lw.__cpu__, repr(sim['bob.angle']), sim.state_hash)
"""


def test_a_checkpoint_goes_over_to_another_level(tmp_path):
    """Within a level, results are bit-identical with and without interruption; from one level to another, values continue."""
    sim = SOURCE / "sims/pendulum"

    def run(cpu, start, stop, to):
        code = RUN.replace("ARGS", repr([str(start), str(stop), str(tmp_path / to)]))
        built, angle, state = python(code, cpu, tmp_path).split()
        assert built == f"x86-64-{cpu}" or not cpu
        return float(angle), state

    angles = []
    for level in BUILDS or [""]:
        angle, straight = run(level, sim, 4, f"{level}.lwck")
        run(level, sim, 2, f"half{level}.lwck")
        angles.append(angle)
        for other in BUILDS or [""]:
            resumed, state = run(other, tmp_path / f"half{level}.lwck", 4, "end.lwck")
            assert resumed == pytest.approx(angle, rel=1e-9)
            assert other != level or state == straight
    assert np.ptp(angles) < 1e-9
