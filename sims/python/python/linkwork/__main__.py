"""The command line: `python -m linkwork [--models FILE.py]... COMMAND ...`.

It has all commands of the program `linkwork`. `--models FILE.py` makes the classes of the dictionary `models` in that
file available to simulations, for example `models = {"demo.balance": Balance}`.
"""

import importlib.util
import sys
import traceback
from pathlib import Path

from ._linkwork import LinkworkError, _main

_OPTION = "--models"


def _split(arguments: list[str]) -> tuple[list[str], list[str]]:
    """Return the files of `--models`, and the other arguments."""
    files: list[str] = []
    others: list[str] = []
    left = iter(arguments)
    for argument in left:
        if argument == _OPTION:
            file = next(left, None)
            if file is None:
                raise LinkworkError(f"`{_OPTION}` needs a file\n  help: write {_OPTION} FILE.py")
            files.append(file)
        elif argument.startswith(f"{_OPTION}="):
            files.append(argument.removeprefix(f"{_OPTION}="))
        else:
            others.append(argument)
    return files, others


def _models(file: str) -> dict[str, type]:
    """Import a file and return its dictionary `models`."""
    path = Path(file).resolve()
    name = path.stem
    spec = importlib.util.spec_from_file_location(name, path)
    if not path.is_file() or spec is None or spec.loader is None:
        raise LinkworkError(f"`{file}` is not a Python file\n  help: give the path of a .py file")
    if name in sys.modules:
        raise LinkworkError(f"`{file}` has the name of a module of Python, `{name}`\n  help: rename the file")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    # Its imports of neighbouring files work as in `python FILE.py`.
    sys.path.insert(0, str(path.parent))
    spec.loader.exec_module(module)
    models = getattr(module, "models", None)
    if not isinstance(models, dict):
        raise LinkworkError(f"`{file}` has no dictionary `models`\n  help: write models = {{\"my.model\": MyModel}}")
    return models


def main() -> int:
    """Run the command line and return its exit code."""
    try:
        files, others = _split(sys.argv[1:])
        models: dict[str, type] = {}
        for file in files:
            models |= _models(file)
        return _main(others, models)
    except LinkworkError as e:
        print(f"error: {e}", file=sys.stderr)
        return 2
    except Exception:
        traceback.print_exc()
        return 2


if __name__ == "__main__":
    sys.exit(main())
