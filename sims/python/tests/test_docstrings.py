"""The examples in the docstrings of the package run. Every method has an example, and its docstring states shapes, units and errors."""

import ast
import contextlib
import copy
import doctest
import inspect
import pickle
import re
import subprocess
import time
from pathlib import Path

import numpy as np
import pytest
from conftest import SOURCE, program

import linkwork as lw

PUBLIC = {name: value for name, value in vars(lw).items() if name in lw.__all__}
CLASSES = {n: c for n, c in PUBLIC.items() if inspect.isclass(c)}

#: Methods that never raise, because they do not have an argument that can be wrong. Getters never raise either, except those of `REFUSING`.
REFUSE_NOTHING = {
    "Collider": {"material"},
    "Collisions": {"copy"},
    "Contact": {"reset"},
    "Hinge": {"ball", "free", "locked", "gimbal", "planar", "chain", "prescribed", "armature", "gear", "limits"},
    "Log": {"keys"},
    "Mechanism": {"couplings", "neutral_q", "random_q", "random_v", "initial_q", "to_ron"},
    "State": {"center_of_mass", "com_velocity", "momentum", "kinetic_energy", "potential_energy", "clear_wrenches"},
    "Robot": {"copy", "gravity_forces", "mass_matrix", "center_of_mass", "centroidal_matrix"},
    "Attached": {"close"},
}

#: Getters that raise because a value is missing, or whose setters raise.
REFUSING = {"Mechanism": {"gravity"}, "Robot": {"q"}, "Simulation": {"mechanism", "q", "v"}}

#: Methods with dimensionless numbers or arrays: ratios, unit vectors, quaternions, factors.
RATIOS = {
    "Collider": {"friction", "restitution", "material"},
    "ContactStep": {"normals", "residual"},
    "Hinge": {"gear"},
    "Identifiable": {"condition"},
    "Outcome": {"metrics"},
    "State": {"quaternion"},
    "Subhinge": {"gear"},
}

#: The shape of an array.
SHAPE = re.compile(r"\((?:n|nq|nv|k|m|6m|rank|rows|columns|steps|links|bodies|\d+)\b[^)]*\)")

#: A unit; "SI" if it depends on a variable or a parameter.
UNIT = re.compile(r"\b(?:m|rad|kg|N|J|Hz|SI)\b|(?<!')\bs\b")

#: Names of array types in annotations.
ARRAY = re.compile(r"\b(?:_Array|ArrayLike|NDArray)\b")


def annotated():
    """Return {(class, method): text of all annotations} from the stub file (.pyi) and the Python modules of the package."""
    package = Path(lw.__file__).parent
    found = {}
    classes = [cls for name in ["_linkwork.pyi", "live.py"] for cls in ast.parse((package / name).read_text()).body]
    for cls in classes:
        if not isinstance(cls, ast.ClassDef):
            continue
        for method in cls.body:
            if isinstance(method, ast.FunctionDef):
                parts = [a.annotation for a in method.args.args + method.args.kwonlyargs] + [method.returns]
                told = " ".join(ast.unparse(p) for p in parts if p is not None)
                found[cls.name, method.name] = found.get((cls.name, method.name), "") + " " + told
    return found


ANNOTATED = annotated()

#: Names of the exceptions of a call.
RAISES = re.compile(r"LinkworkError|Refused|ConnectionError")


def own_methods(cls):
    """Return {name: docstring} of the public attributes that a class defines itself."""
    # `getattr` is necessary, because static methods in `vars` do not have the docstring.
    return {n: inspect.getdoc(getattr(cls, n)) or "" for n in vars(cls) if not n.startswith("_")}


def run(texts):
    """Run examples in order, in one namespace. Returns the number of examples."""
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
    """Change to a temporary folder that contains the simulations."""
    (tmp_path / "sims").symlink_to(SOURCE / "sims")
    (tmp_path / "assemblies").symlink_to(SOURCE / "assemblies")
    monkeypatch.chdir(tmp_path)


@contextlib.contextmanager
def served(folder):
    """Start a run in real time to which `linkwork.attach("runs/pendulum")` can connect."""
    out = folder / "runs" / "pendulum"
    with contextlib.suppress(FileNotFoundError):
        (out / "live.json").unlink()
    arguments = ["run", "sims/pendulum", "--out", out, "--save-rrd", "off", "--serve", "--realtime", "--until", "1000s"]
    run = subprocess.Popen([program(), *arguments], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        end = time.monotonic() + 30
        while not (out / "live.json").exists():
            assert run.poll() is None and time.monotonic() < end, "the run is not served"
            time.sleep(0.01)
        yield
    finally:
        run.kill()
        run.wait()


def surroundings(name, folder):
    """Return the context that the examples of a class or function need: a run to connect to, or none."""
    return served(folder) if name in ("Attached", "attach") else contextlib.nullcontext()


@pytest.mark.parametrize("name", sorted(PUBLIC))
def test_examples_of_docstrings_run(name, tmp_path):
    value = PUBLIC[name]
    own = (name, getattr(value, "__doc__", None) or "")
    if isinstance(value, str):
        return
    with surroundings(name, tmp_path):
        assert run([own]) > 0, f"{name} has no example"
    if inspect.isclass(value):
        # The example of the class creates the objects that the examples of its methods use; it runs again for each method.
        for method, text in own_methods(value).items():
            with surroundings(name, tmp_path):
                run([own, (f"{name}.{method}", text)])


@pytest.mark.parametrize("name", sorted(CLASSES))
def test_every_method_has_an_example_shapes_units_and_says_what_it_refuses(name):
    cls = CLASSES[name]
    getters = {n for n, v in vars(cls).items() if inspect.isgetsetdescriptor(v)}
    silent = REFUSE_NOTHING.get(name, set()) | getters - REFUSING.get(name, set())
    for method, text in own_methods(cls).items():
        assert ">>>" in text, f"{name}.{method} has no example"
        words = text.split(">>>")[0]
        told = ANNOTATED[name, method]
        if ARRAY.search(told):
            assert SHAPE.search(words), f"{name}.{method} does not state a shape"
        if (ARRAY.search(told) or re.search(r"\bfloat\b", told)) and method not in RATIOS.get(name, ()):
            assert UNIT.search(words), f"{name}.{method} does not state a unit"
        assert RAISES.search(words) or method in silent, f"{name}.{method}: does not state what it raises"


@pytest.mark.parametrize("table", [REFUSE_NOTHING, REFUSING, RATIOS])
def test_the_tables_above_name_what_there_is(table):
    for name, methods in table.items():
        assert methods <= set(own_methods(CLASSES[name])), name


#: Special methods, which Python calls for syntax such as `x[k]`, `k in x`, `a * b`, `with x`.
BINARY = {ast.Mult: "mul", ast.MatMult: "matmul", ast.Div: "truediv", ast.Add: "add", ast.Sub: "sub"}
CALLED = {
    "len": "__len__", "print": "__str__", "str": "__str__", "list": "__iter__", "sorted": "__iter__", "copy.copy": "__copy__",
    "copy.deepcopy": "__deepcopy__", "pickle.dumps": "__reduce__",
}
SPECIAL = {"__getitem__", "__setitem__", "__contains__", "__enter__", "__neg__", *CALLED.values()}
#: Of the reflected operators only `2.0 * A`, because pyo3 defines the others in the same slot.
SPECIAL |= {f"__{name}__" for name in BINARY.values()} | {"__rmul__"}


class Watch(ast.NodeTransformer):
    """Passes every operand of a special method through `_seen`, which records its class."""

    def wrap(self, node, name):
        call = ast.Call(ast.Name("_seen", ast.Load()), [ast.Constant(name), node], [])
        return ast.copy_location(call, node)

    def visit_Subscript(self, node):
        self.generic_visit(node)
        node.value = self.wrap(node.value, "__getitem__" if isinstance(node.ctx, ast.Load) else "__setitem__")
        return node

    def visit_Compare(self, node):
        self.generic_visit(node)
        if isinstance(node.ops[0], (ast.In, ast.NotIn)):
            node.comparators[0] = self.wrap(node.comparators[0], "__contains__")
        return node

    def visit_BinOp(self, node):
        self.generic_visit(node)
        if name := BINARY.get(type(node.op)):
            node.left, node.right = self.wrap(node.left, f"__{name}__"), self.wrap(node.right, f"__r{name}__")
        return node

    def visit_UnaryOp(self, node):
        self.generic_visit(node)
        if isinstance(node.op, ast.USub):
            node.operand = self.wrap(node.operand, "__neg__")
        return node

    def visit_Call(self, node):
        self.generic_visit(node)
        if node.args and (name := CALLED.get(ast.unparse(node.func))):
            node.args[0] = self.wrap(node.args[0], name)
        return node

    def visit_loop(self, node):
        self.generic_visit(node)
        node.iter = self.wrap(node.iter, "__iter__")
        return node

    visit_For = visit_comprehension = visit_loop

    def visit_withitem(self, node):
        self.generic_visit(node)
        node.context_expr = self.wrap(node.context_expr, "__enter__")
        return node


def shown(texts):
    """Return {(class, special method)} that the examples use. They run in order, in one namespace."""
    used = set()

    def seen(name, value):
        used.add((type(value), name))
        return value

    space = {"linkwork": lw, "np": np, "copy": copy, "pickle": pickle, "_seen": seen}
    for text in texts:
        for example in doctest.DocTestParser().get_examples(text):
            tree = ast.fix_missing_locations(Watch().visit(ast.parse(example.source)))
            # Examples of errors raise exceptions here, too.
            with contextlib.suppress(*([Exception] if example.exc_msg else [])), contextlib.redirect_stdout(None):
                exec(compile(tree, "<example>", "exec"), space)
    return used


@pytest.mark.parametrize("name", sorted(CLASSES))
def test_what_python_calls_by_itself_is_shown(name, tmp_path):
    cls = CLASSES[name]
    # These are the special methods that the class defines. For compiled classes pyo3 defines both methods
    # of a pair.
    mine = {m for m in SPECIAL if m in vars(cls)}
    if not mine:
        return
    used = set()
    for text in [inspect.getdoc(cls), *own_methods(cls).values()]:
        with surroundings(name, tmp_path):
            used |= shown([inspect.getdoc(cls), text])
    missing = {m for m in mine if (cls, m) not in used}
    assert not missing, f"{name}: no example shows {sorted(missing)}"
