"""Selection of the build of the compiled module.

A package has one build, `_linkwork.abi3.so`, or several for different processor levels: `_linkwork_v2.abi3.so`, `_v3`, `_v4` for
x86-64-v2 (any processor since 2009), -v3 (AVX2 and FMA) and -v4 (AVX-512). The highest level that the processor supports is
loaded, always under the name `_linkwork`. The environment variable LINKWORK_CPU selects another level. The build for the
lowest processor level is loaded first and detects which level the processor supports.
"""

import importlib
import importlib.util
import os
import sys
from collections.abc import Collection
from importlib.machinery import EXTENSION_SUFFIXES, ExtensionFileLoader
from pathlib import Path
from types import ModuleType

#: The levels, lowest first.
LEVELS = ("v2", "v3", "v4")


def choose(there: Collection[str], has: Collection[str], wanted: str) -> str:
    """Return the level to load: the wanted one, or the highest of `there` (the builds in the package) that is in `has` (the
    levels of the processor). Raises ImportError if there is none."""
    _known(wanted)
    if wanted and wanted not in there:
        raise _none_for(wanted, _list(there))
    best = wanted or next((level for level in reversed(LEVELS) if level in there and level in has), "")
    if not best:
        raise ImportError(
            f"this processor supports {_list(has)}, but the package is built for {_list(there)}\n  help: build it from source with "
            'RUSTFLAGS="-C target-cpu=native" pip install ./sims/python'
        )
    if best not in has:
        raise ImportError(
            f"LINKWORK_CPU selects {_list([best])}, but this processor supports {_list(has)}\n  help: unset LINKWORK_CPU"
        )
    return best


def load(package: str, folder: Path) -> None:
    """Load the compiled module of a package from a folder, as its submodule `_linkwork`."""
    name = f"{package}._linkwork"
    wanted = os.environ.get("LINKWORK_CPU", "")
    files = [(level, folder / f"_linkwork_{level}{suffix}") for level in LEVELS for suffix in EXTENSION_SUFFIXES]
    builds = {level: file for level, file in files if file.exists()}
    if not builds:
        _known(wanted)
        cpu = importlib.import_module(name).__cpu__
        if wanted and f"x86-64-{wanted}" != cpu:
            raise _none_for(wanted, cpu)
        return
    lowest = next(level for level in LEVELS if level in builds)
    module = _open(name, builds[lowest])
    chosen = choose(builds, module._levels(), wanted)
    if chosen != lowest:
        module = _open(name, builds[chosen])
    sys.modules[name] = module
    setattr(sys.modules[package], "_linkwork", module)


def _open(name: str, file: Path) -> ModuleType:
    loader = ExtensionFileLoader(name, str(file))
    spec = importlib.util.spec_from_file_location(name, file, loader=loader)
    if spec is None:
        raise ImportError(f"`{file}` cannot be loaded\n  help: install the package again")
    module = importlib.util.module_from_spec(spec)
    loader.exec_module(module)
    return module


def _known(wanted: str) -> None:
    if wanted and wanted not in LEVELS:
        raise ImportError(f"LINKWORK_CPU is `{wanted}`\n  help: set it to one of {', '.join(LEVELS)}, or unset it")


def _none_for(wanted: str, there: str) -> ImportError:
    return ImportError(
        f"LINKWORK_CPU selects {_list([wanted])}, but the package is built for {there}\n  help: unset LINKWORK_CPU, or build a "
        "wheel with all levels: sims/python/build"
    )


def _list(levels: Collection[str]) -> str:
    return ", ".join(f"x86-64-{level}" for level in LEVELS if level in levels) or "none of the levels x86-64-v2 to -v4"
