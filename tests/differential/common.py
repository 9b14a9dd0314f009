"""What the three comparisons share: asking Linkwork, comparing numbers, shrinking a file that differs."""

import functools
import json
import os
import pathlib
import random
import re
import subprocess
import xml.etree.ElementTree as ET

import numpy as np

HERE = pathlib.Path(__file__).parent
ROOT = HERE.parent.parent

# These are the comparisons other than of robot files, and their modules.
OTHERS = {name: "world" for name in ["gravity", "kernel", "earth", "air", "magnetic", "elements"]}
OTHERS |= {name: "maps" for name in ["meshes", "maps"]}
OTHERS |= {"fmi": "fmi", "attach": "mjcf"}


def program(name, package):
    """Path of an example of a package; built if the variable with its name in capitals does not name it."""
    if name.upper() in os.environ:
        return os.environ[name.upper()]
    subprocess.run(["cargo", "build", "--release", "--locked", "-p", package, "--example", name], cwd=ROOT, check=True)
    target = os.environ.get("CARGO_TARGET_DIR", ROOT / "target")
    return str(pathlib.Path(target) / "release" / "examples" / name)


class Linkwork:
    """An example as a process that answers one line after another."""

    def __init__(self, name="describe", package="linkwork-formats"):
        self.name, self.package = name, package
        self.process = subprocess.Popen(
            [program(name, package)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, cwd=HERE
        )

    def ask_json(self, request):
        self.process.stdin.write(json.dumps(request) + "\n")
        self.process.stdin.flush()
        line = self.process.stdout.readline()
        if not line:
            self.__init__(self.name, self.package)
            return {"error": "the reader ended (panic)", "panic": True}
        return json.loads(line)

    def ask(self, file, states=(), packages=()):
        return self.ask_json({"file": str(file), "states": list(states), "packages": [str(p) for p in packages]})


@functools.cache
def answer():
    """The example `answer` of linkwork-world."""
    return Linkwork("answer", "linkwork-world")


@functools.cache
def describe():
    """The example `describe` of linkwork-formats."""
    return Linkwork()


def differs(a, b, tolerance=1e-9):
    """Whether two arrays differ by more than the tolerance relative to the larger of 1 and their largest number."""
    a, b = np.asarray(a, float).ravel(), np.asarray(b, float).ravel()
    if a.shape != b.shape:
        return True
    if a.size == 0:
        return False
    scale = max(1.0, np.abs(b[np.isfinite(b)]).max(initial=0.0))
    same = (a == b) | (np.abs(a - b) <= tolerance * scale)
    return not bool(np.all(same))


def rotation(w, x, y, z):
    """The matrix of a quaternion."""
    n = np.array([w, x, y, z]) / np.linalg.norm([w, x, y, z])
    w, x, y, z = n
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def shrink(text, bad, limit=400):
    """The smallest text that is found by removing elements and attributes for which `bad` returns the same kind."""
    kind = bad(text)
    tries = 0
    changed = True
    while changed and tries < limit:
        changed = False
        root = ET.fromstring(text)
        places = [(parent, child) for parent in root.iter() for child in parent]
        for index in range(len(places) - 1, -1, -1):
            tries += 1
            again = ET.fromstring(text)
            parents = [(parent, child) for parent in again.iter() for child in parent]
            if index >= len(parents):
                continue
            parent, child = parents[index]
            parent.remove(child)
            smaller = ET.tostring(again, encoding="unicode")
            if bad(smaller) == kind:
                text, changed = smaller, True
        for number, element in enumerate(ET.fromstring(text).iter()):
            for name in list(element.attrib):
                tries += 1
                again = ET.fromstring(text)
                list(again.iter())[number].attrib.pop(name, None)
                smaller = ET.tostring(again, encoding="unicode")
                if bad(smaller) == kind:
                    text, changed = smaller, True
    return text


def kind_of(result):
    """What differs, without names and numbers: differences of one kind are counted together."""
    if result in (None, "skip"):
        return result
    if result.startswith("rejected"):
        return re.sub(r"`[^`]*`|[^ ]*:\d+:\d+:|[\d.]+", "", result.split("\n")[0])
    return result.split(":")[0]


def run(name, make, compare, count, seed, keep):
    """Makes and compares `count` files; returns how many differ. A file that differs is shrunk and kept."""
    seen, skipped, kinds = 0, 0, {}
    for number in range(count):
        text = make(random.Random(f"{name} {seed} {number}"))
        result = compare(text)
        if result == "skip":
            skipped += 1
            continue
        seen += 1
        if result is None:
            continue
        kind = kind_of(result)
        kinds[kind] = kinds.get(kind, 0) + 1
        if kinds[kind] <= 3:
            small = shrink(text, lambda smaller: kind_of(compare(smaller)))
            keep.mkdir(parents=True, exist_ok=True)
            ending = "xml" if name == "mjcf" else name
            (keep / f"{name}_{seed}_{number}.{ending}").write_text(small)
            print(f"{name} {number}: {compare(small)}\n{small}\n", flush=True)
    print(f"{name}: {seen} files compared, {skipped} rejected by the reference, differences: {kinds or 'none'}")
    return sum(kinds.values())


def run_cases(name, case, count, seed):
    """Asks `count` random questions; `case` returns what differs, or `skip` if the reference program fails. Returns how many differ."""
    kinds, skipped = {}, 0
    for number in range(count):
        result = case(random.Random(f"{name} {seed} {number}"))
        if result == "skip":
            skipped += 1
            continue
        if result is None:
            continue
        kind = kind_of(result)
        kinds[kind] = kinds.get(kind, 0) + 1
        if kinds[kind] <= 3:
            print(f"{name} {number}: {result}", flush=True)
    failed = f", {skipped} failed in the reference program" if skipped else ""
    print(f"{name}: {count - skipped} cases compared{failed}, differences: {kinds or 'none'}", flush=True)
    return sum(kinds.values())
