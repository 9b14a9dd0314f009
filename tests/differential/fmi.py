"""Units of FMI 2.0 and 3.0: random descriptions and equations, compiled around `unit.c`, simulated with the same inputs by FMPy and by Linkwork."""

import dataclasses
import os
import pathlib
import platform
import shutil
import subprocess
import tempfile
import zipfile

import numpy as np

import common

FOLDER = pathlib.Path(tempfile.mkdtemp())
HERE = pathlib.Path(__file__).parent
# Unit: attributes of its definition, factor and offset to SI. `turn` is not defined in the files.
UNITS = {
    "m": ('m="1"', 1, 0),
    "mm": ('m="1" factor="0.001"', 0.001, 0),
    "degC": ('K="1" offset="273.15"', 1, 273.15),
    "degF": ('K="1" factor="0.5555555555555556" offset="255.3722222222222"', 0.5555555555555556, 255.3722222222222),
    "deg": ('rad="1" factor="0.017453292519943295"', 0.017453292519943295, 0),
    "kN": ('kg="1" m="1" s="-2" factor="1000"', 1000, 0),
    "turn": (None, 1, 0),
}
# Letters of `unit.c`: elements of FMI 3.0, and the range of random values.
KINDS = {
    "d": ("Float64", None),
    "f": ("Float32", None),
    "c": ("Int8", (-50, 50)),
    "C": ("UInt8", (0, 100)),
    "s": ("Int16", (-3000, 3000)),
    "S": ("UInt16", (0, 6000)),
    "i": ("Int32", (-100000, 100000)),
    "I": ("UInt32", (0, 200000)),
    "l": ("Int64", (-(2**52), 2**52)),
    "L": ("UInt64", (0, 2**52)),
    "o": ("Boolean", (0, 1)),
    "e": ("Enumeration", (1, 3)),
    "t": ("String", None),
}
TWO = {"d": "Real", "i": "Integer", "o": "Boolean", "e": "Enumeration", "t": "String"}
TOKEN = "{3a1d9c52-8f6e-4a07-b1c4-5e2f90d7a6b8}"


@dataclasses.dataclass
class Var:
    """A variable: `role` as in `unit.c`; `start` in the unit of the file; `given` is a start value that the simulation sets."""

    name: str
    kind: str
    role: str
    causality: str
    variability: str
    slot: int
    initial: str = None
    start: list = None
    given: list = None
    size: int = 1
    array: bool = False
    unit: str = None
    relative: bool = False
    reference: int = 0
    derivative: int = None
    sees: list = None

    def scale(self):
        """Factor and offset to SI."""
        _, factor, offset = UNITS[self.unit] if self.unit else (None, 1, 0)
        return factor, 0 if self.relative else offset


class Maker:
    """A random unit: variables, C functions and the XML description."""

    def __init__(self, r):
        self.r, self.vars, self.slots, self.texts = r, [], 1, 0
        self.version = r.choice([2, 3])
        self.exchange = r.random() < 0.5
        self.events = self.version == 3 and not self.exchange and r.random() < 0.5
        self.build()

    def room(self, size=1):
        self.slots += size
        return self.slots - size

    def kind(self, whole):
        if self.version == 2:
            return self.r.choice("iioe" if whole else "d")
        return self.r.choice("cCsSiIlLoe" if whole else "ddf")

    def add(self, role, causality, variability, kind, **more):
        number = len(self.vars)
        name = self.r.choice(["v{}", "part.v{}", "v{}_x", "a{}[1]", "part.sub[2].v{}", "'q {}'"]).format(number)
        if kind == "t":
            slot, self.texts = self.texts, self.texts + 1
        else:
            slot = more.pop("slot", None) or self.room(more.get("size", 1))
        v = Var(name, kind, role, causality, variability, slot, **more)
        self.vars.append(v)
        return v

    def value(self, kind):
        if kind == "t":
            return "".join(self.r.choice("ab c<&>\"é") for _ in range(self.r.randrange(0, 9)))
        span = KINDS[kind][1]
        if span:
            return self.r.randint(*span)
        x = float(f"{self.r.uniform(-2, 2):.6g}")
        return float(np.float32(x)) if kind == "f" else x

    def values(self, v):
        return [self.value(v.kind) for _ in range(v.size)]

    def measure(self):
        """A unit of measurement of a variable."""
        r = self.r
        if r.random() < 0.4:
            return {}
        unit = r.choice(list(UNITS))
        return {"unit": unit, "relative": UNITS[unit][2] != 0 and r.random() < 0.5}

    def array(self):
        if self.version == 3 and self.r.random() < 0.25:
            return {"size": self.r.randint(1, 4), "array": True}
        return {}

    def build(self):
        r = self.r
        for _ in range(r.randrange(0, 5)):
            kind = self.kind(r.random() < 0.4)
            more = self.measure() if kind in "df" else {}
            tunable = r.random() < 0.2
            self.add("p", "parameter", "tunable" if tunable else "fixed", kind, **more, **self.array())
        for _ in range(r.randrange(0, 2)):
            self.add("p", "parameter", "fixed", "t")
        for _ in range(r.randrange(0, 3)):
            self.add("u", "input", "continuous", self.kind(False), **self.measure())
        for _ in range(r.randrange(0, 3)):
            whole = r.random() < 0.8
            kind = self.kind(whole)
            self.add("n", "input", "discrete", kind, **({} if whole else self.measure()))
        self.states = r.randrange(0, 4)
        self.x, self.dx = self.room(self.states), self.room(self.states)
        for k in range(self.states):
            causality = r.choice(["output", "local"])
            initial = r.choice(["exact", "approx"])
            self.add("x", causality, "continuous", "d", slot=self.x + k, initial=initial, **self.measure())
        for k in range(self.states):
            causality = r.choice(["output", "local", "local"])
            v = self.add("y", causality, "continuous", "d", slot=self.dx + k, initial="calculated")
            v.name, v.derivative = f"der({self.state(k).name})", k
        for v in self.vars:
            if v.role in "pun" or v.initial in ("exact", "approx"):
                v.start = self.values(v)
                if r.random() < 0.5:
                    v.given = self.values(v)
                if v.array and r.random() < 0.2:
                    v.start = v.start[:1] * v.size
        self.rules()
        self.outputs()
        names = r.sample(range(1, 5000), len(self.vars))
        for v, reference in zip(self.vars, names):
            v.reference = reference
        if self.version == 2:
            # Variables of different types may have one reference.
            for kind in "io":
                for k, v in enumerate(v for v in self.vars if v.kind == kind):
                    v.reference = k if kind == "o" or not any(w.kind == "e" for w in self.vars) else v.reference

    def state(self, k):
        return next(v for v in self.vars if v.role == "x" and v.slot == self.x + k)

    # Equations.
    def term(self, sees, held=True):
        """A bounded term; continuous inputs and states that it depends on are added to `sees`."""
        r = self.r
        pool = [v for v in self.vars if v.role in "pux" and v.kind != "t"]
        factor = f"{r.uniform(-1, 1):.5g}"
        if not pool or r.random() < 0.15:
            return f"{factor} * sin({r.uniform(0.5, 5):.4g} * v[0] + {r.uniform(0, 6):.4g})"
        if held and self.held and r.random() < 0.3:
            return f"{factor} * tanh(0.01 * v[{r.choice(self.held)}])"
        v = r.choice(pool)
        if v.role in "ux":
            sees.add(v.name)
        return f"{factor} * {r.choice(['sin', 'tanh'])}(v[{v.slot + r.randrange(v.size)}])"

    def sum(self, sees, count=3):
        return " + ".join(self.term(sees) for _ in range(self.r.randint(1, count)))

    def rules(self):
        """Held inputs, modes and counters, and the rates of the states."""
        r = self.r
        self.inside, self.z, self.due, self.event, self.begin = {}, [], [], [], []
        self.next = None
        self.held = []
        for v in (v for v in self.vars if v.role == "n"):
            slot = self.room()
            self.begin.append(f"v[{slot}] = v[{v.slot}];")
            self.event.append(f"if (v[{slot}] != v[{v.slot}]) {{ v[{slot}] = v[{v.slot}]; changed = 1; }}")
            self.held.append(slot)
        self.count = self.room()
        if self.states and r.random() < 0.6:
            mode, x = self.room(), f"v[{self.x + r.randrange(self.states)}]"
            low = r.uniform(-0.6, 0.4)
            high = low + r.uniform(0.2, 0.5)
            self.held.append(mode)
            self.z.append(f"v[{mode}] ? {x} - {low!r} : {high!r} - {x}")
            self.due.append(f"(v[{mode}] ? {x} <= {low!r} + 1e-9 : {x} >= {high!r} - 1e-9)")
            self.event.append(f"if ({self.due[-1]}) {{ v[{mode}] = !v[{mode}]; v[{self.count}] += 1; changed = 1; }}")
        if self.states and r.random() < 0.4:
            x, floor = f"v[{self.x + r.randrange(self.states)}]", r.uniform(-0.8, -0.2)
            self.z.append(f"{x} - {floor!r}")
            self.due.append(f"{x} <= {floor!r} + 1e-9")
            self.event.append(f"if ({self.due[-1]}) {{ {x} = {floor + r.uniform(0.3, 0.9)!r}; v[{self.count}] += 1; changed = 1; }}")
        if r.random() < 0.5:
            self.next, flag, seen = self.room(), self.room(), self.room()
            first, period = r.uniform(0.03, 0.7), r.uniform(0.1, 0.9)
            self.held.append(flag)
            self.begin.append(f"v[{self.next}] = {first!r};")
            self.due.append(f"v[0] >= v[{self.next}] - 1e-9")
            self.event.append(f"if ({self.due[-1]}) {{ v[{flag}] = !v[{flag}]; v[{self.next}] += {period!r}; changed = 1; }}")
            # Seen by the next pass of the event.
            self.event.insert(0, f"if (v[{seen}] != v[{flag}]) {{ v[{seen}] = v[{flag}]; v[{self.count}] += 1; changed = 1; }}")
        self.rates, self.rate_sees = [], []
        for k in range(self.states):
            sees = {self.state(k).name}
            decay = f"{-r.uniform(0.1, 3):.5g} * v[{self.x + k}]"
            self.rates.append(f"v[{self.dx + k}] = {decay} + {self.sum(sees, 4)};")
            self.rate_sees.append(sees)
            next(v for v in self.vars if v.derivative == k).sees = sees

    def outputs(self):
        r = self.r
        self.lines, self.discrete = [], []
        for v in self.vars:
            if v.role == "x":
                v.sees = {v.name}
        for _ in range(r.randrange(1, 5)):
            v = self.add("y", "output", "continuous", self.kind(False), initial="calculated", **self.measure(), **self.array())
            v.sees = set()
            for k in range(v.size):
                value = self.sum(v.sees)
                self.lines.append(f"v[{v.slot + k}] = {f'(float)({value})' if v.kind == 'f' else value};")
        for _ in range(r.randrange(0, 4)):
            v = self.add("y", "output", "discrete", self.kind(True), initial="calculated", **self.array())
            v.sees = set()
            wholes = [w for w in self.vars if w.role == "p" and w.kind not in "dft"]
            for k in range(v.size):
                terms = [f"{r.randint(1, 3)} * v[{self.count}]"]
                if self.held:
                    terms.append(f"floor(fmod(fabs(v[{r.choice(self.held)}]), 1000))")
                if wholes:
                    terms.append(f"fabs(v[{r.choice(wholes).slot}])")
                total = f"({' + '.join(terms)})"
                value = {"o": f"fmod({total}, 2)", "e": f"1 + fmod({total}, 3)"}.get(v.kind, f"fmod({total}, 90)")
                self.discrete.append(f"v[{v.slot + k}] = {value};")

    def header(self):
        """The C text `model.h`."""
        line = lambda v: f'{{{v.reference}, \'{v.kind}\', \'{v.role}\', {v.slot}, {v.size}}}'
        defaults = []
        for v in self.vars:
            for k, x in enumerate(v.start or []):
                if v.kind == "t":
                    text = "".join(f"\\{b:03o}" for b in x.encode())
                    defaults.append(f'strcpy(text[{v.slot}], "{text}");')
                else:
                    defaults.append(f"v[{v.slot + k}] = {x!r};")
        lengths = []
        for k in range(self.texts):
            # The length of a text is part of the count of events.
            lengths.append(f"v[{self.count}] += (double)strlen(text[{k}]);")
        z = [f"z[{k}] = {text};" for k, text in enumerate(self.z)]
        function = lambda kind, name, arguments, body: f"static {kind} {name}({arguments}) {{ {' '.join(body)} }}\n"
        v = "double *v"
        return (
            f'#define TOKEN "{TOKEN}"\n#define STEP {self.r.choice([0.01, 0.004])}\n'
            + f"enum {{ SLOTS = {self.slots}, TEXTS = {self.texts + 1}, STATES = {self.states}, X = {self.x}, DX = {self.dx}, INDICATORS = {len(self.z)}, VARS = {len(self.vars)} }};\n"
            + f"static const Var vars[] = {{ {', '.join(line(v) for v in self.vars)} }};\n"
            + function("void", "model_defaults", v + ", char (*text)[TEXT]", ["(void)v, (void)text;", *defaults])
            + function("void", "model_discrete", v, ["(void)v;", *self.discrete])
            + function("void", "model_start", v + ", char (*text)[TEXT]", ["(void)text;", *self.begin, *lengths, "model_discrete(v);"])
            + function("void", "model_rates", v, ["(void)v;", *self.rates])
            + function("void", "model_outputs", v, ["model_rates(v);", *self.lines])
            + function("void", "model_indicators", v + ", double *z", ["(void)v, (void)z;", *z])
            + function("int", "model_due", v, ["(void)v;", f"return {' || '.join(self.due) or '0'};"])
            + function("int", "model_event", v, ["int changed = 0;", *self.event, "if (changed) model_discrete(v); return changed;"])
            + function("double", "model_next", v, ["(void)v;", f"return {f'v[{self.next}]' if self.next else 'INFINITY'};"])
        )

    # Description.
    def attributes(self, v):
        r = self.r
        out = f' name="{escaped(v.name)}" valueReference="{v.reference}"'
        if v.causality != "local" or r.random() < 0.5:
            out += f' causality="{v.causality}"'
        # The default: continuous in FMI 2.0; in FMI 3.0 continuous for floats, otherwise discrete.
        default = "continuous" if v.kind in "df" or self.version == 2 else "discrete"
        if v.variability != default or r.random() < 0.5:
            out += f' variability="{v.variability}"'
        if v.initial and (v.initial != "calculated" or r.random() < 0.3):
            out += f' initial="{v.initial}"'
        return out

    def typed(self, v):
        """Attributes of the type."""
        r, out = self.r, ""
        if v.unit:
            if r.random() < 0.3:
                kind = "Real" if self.version == 2 else KINDS[v.kind][0]
                name = f"T{len(self.types)}"
                relative = ' relativeQuantity="true"' if v.relative else ""
                more = f' unit="{v.unit}"{relative}'
                self.types.append(
                    f'<SimpleType name="{name}"><Real{more}/></SimpleType>' if self.version == 2 else f'<{kind}Type name="{name}"{more}/>'
                )
                out += f' declaredType="{name}"'
            else:
                out += f' unit="{v.unit}"' + (' relativeQuantity="true"' if v.relative else "")
        if v.kind == "e":
            out += ' declaredType="Choice"'
        if v.kind in "df" and r.random() < 0.2:
            out += ' nominal="1"'
        if v.start is not None and v.kind != "t":
            words = [("true" if x else "false") if v.kind == "o" else repr(x) for x in v.start]
            if v.array and len(set(words)) == 1 and r.random() < 0.5:
                words = words[:1]
            out += f' start="{" ".join(words)}"'
        return out

    def description(self):
        r, two = self.r, self.version == 2
        self.types = []
        lines, index = [], {}
        order = list(self.vars)
        place = {id(v): k + 1 for k, v in enumerate(order)}
        for v in order:
            own = place[id(self.state(v.derivative))] if v.derivative is not None and two else None
            own = self.state(v.derivative).reference if v.derivative is not None and not two else own
            derivative = f' derivative="{own}"' if own is not None else ""
            if two:
                start = f' start="{escaped(v.start[0])}"' if v.kind == "t" else ""
                lines.append(f"<ScalarVariable{self.attributes(v)}><{TWO[v.kind]}{self.typed(v)}{derivative}{start}/></ScalarVariable>")
            else:
                inside = f'<Dimension start="{v.size}"/>' if v.array else ""
                inside += f'<Start value="{escaped(v.start[0])}"/>' if v.kind == "t" else ""
                tag = KINDS[v.kind][0]
                lines.append(f"<{tag}{self.attributes(v)}{self.typed(v)}{derivative}>{inside}</{tag}>")
        if not two:
            lines.insert(0, '<Float64 name="time" valueReference="5000" causality="independent" variability="continuous"/>')
            for k in range(len(self.z)):
                lines.append(f'<Float64 name="z{k}" valueReference="{6000 + k}" causality="local" variability="continuous" initial="calculated"/>')
        number = lambda v: place[id(v)] if two else v.reference
        by_name = {v.name: v for v in order}

        def unknown(tag, v, must=False):
            at = f'{"index" if two else "valueReference"}="{number(v)}"'
            listed = ""
            if must or r.random() < 0.6:
                listed = f' dependencies="{" ".join(str(n) for n in sorted(number(by_name[s]) for s in v.sees))}"'
            return f"<{tag} {at}{listed}/>"

        outputs = [v for v in order if v.causality == "output"]
        rates = [v for v in order if v.derivative is not None]
        starts = [v for v in order if v.causality == "output" and v.initial in ("calculated", "approx")] + [
            v for v in order if (v.role == "x" and v.initial == "approx" or v.derivative is not None) and v.causality != "output"
        ]
        if two:
            block = lambda name, inside: f"<{name}>{inside}</{name}>" if inside else ""
            structure = block("Outputs", "".join(unknown("Unknown", v) for v in outputs))
            structure += block("Derivatives", "".join(unknown("Unknown", v) for v in rates))
            structure += block("InitialUnknowns", "".join(f'<Unknown index="{n}"/>' for n in sorted(place[id(v)] for v in starts)))
        else:
            structure = "".join(unknown("Output", v) for v in outputs) + "".join(unknown("ContinuousStateDerivative", v) for v in rates)
            structure += "".join(f'<InitialUnknown valueReference="{v.reference}"/>' for v in starts)
            structure += "".join(f'<EventIndicator valueReference="{6000 + k}"/>' for k in range(len(self.z)))
        choice = "".join(f'<Item name="i{k}" value="{k}"/>' for k in (1, 2, 3))
        if any(v.kind == "e" for v in order):
            self.types.append(
                f'<SimpleType name="Choice"><Enumeration>{choice}</Enumeration></SimpleType>' if two else f'<EnumerationType name="Choice">{choice}</EnumerationType>'
            )
        units = "".join(f'<Unit name="{n}">{f"<BaseUnit {a}/>" if a else ""}</Unit>' for n, (a, *_) in UNITS.items())
        types = f"<TypeDefinitions>{''.join(self.types)}</TypeDefinitions>" if self.types else ""
        experiment = '<DefaultExperiment startTime="0" stopTime="1" tolerance="1e-6"/>' if r.random() < 0.3 else ""
        interfaces = ""
        need = r.random() < 0.5
        if self.exchange or r.random() < 0.3:
            step = f' completedIntegratorStepNotNeeded="{str(not need).lower()}"' if two else f' needsCompletedIntegratorStep="{str(need).lower()}"'
            interfaces += f'<ModelExchange modelIdentifier="unit"{step}/>'
        if not self.exchange or r.random() < 0.3:
            more = ' canHandleVariableCommunicationStepSize="true"' + (' hasEventMode="true"' if self.events else "")
            interfaces += f'<CoSimulation modelIdentifier="unit"{more}/>'
        head = f'fmiVersion="{"2.0" if two else r.choice(["3.0", "3.0.2"])}" modelName="random"'
        head += f' guid="{TOKEN}"' if two else f' instantiationToken="{TOKEN}"'
        head += f' numberOfEventIndicators="{len(self.z)}"' if two and self.exchange else ""
        return (
            f'<?xml version="1.0" encoding="UTF-8"?>\n<fmiModelDescription {head}>\n{interfaces}\n<UnitDefinitions>{units}</UnitDefinitions>{types}'
            f"{experiment}\n<ModelVariables>\n" + "\n".join(lines) + f"\n</ModelVariables>\n<ModelStructure>{structure}</ModelStructure>\n</fmiModelDescription>\n"
        )

    def write(self, folder):
        """Compiles and packs the unit."""
        (folder / "model.h").write_text(self.header())
        library = folder / "unit.so"
        command = ["cc", "-shared", "-fPIC", "-O0", "-w", f"-DVERSION={self.version}", f"-I{folder}", "-o", str(library), str(HERE / "unit.c"), "-lm"]
        subprocess.run(command, check=True)
        where = "linux64" if self.version == 2 else f"{platform.machine()}-linux"
        with zipfile.ZipFile(folder / "unit.fmu", "w") as out:
            out.writestr("modelDescription.xml", self.description())
            out.write(library, f"binaries/{where}/unit.so")
            out.writestr("resources/", "")


def escaped(text):
    for a, b in (("&", "&amp;"), ("<", "&lt;"), (">", "&gt;"), ('"', "&quot;"), ("'", "&apos;")):
        text = text.replace(a, b)
    return text


def port(name):
    """The name of a port, as `fmi.co_simulation` documents it."""
    plain = "".join(c if c.isascii() and (c.isalnum() or c == "_") else "_" for c in name).rstrip("_")
    return f"v{plain}" if plain[:1].isdigit() else plain or "v"


def script(m, v, times, start):
    """Rows (time, value) of an input in the unit of the file, which has the value of the last row. FMPy does not update continuous inputs inside a
    step of its solver, so inputs do not change between two events."""
    r = m.r
    rows, last = [], start
    for t in times:
        if t > 0 and r.random() < 0.6:
            continue
        # Model exchange: inputs change between the samples as well.
        off = r.choice([0, 0.31, 0.77]) * (times[1] - times[0]) if m.exchange and t > 0 else 0
        value = m.value(v.kind)
        value = start if t == 0 and m.known else value
        if t == 0 or value != last:
            rows.append((round(t + off, 9), value))
        last = value
    return rows


def signals(m, inputs, scripts, times):
    """The inputs for FMPy: rows at all times; at jumps of continuous inputs two rows."""
    all_times = sorted({t for rows in scripts for t, _ in rows} | set(times))
    jumps = {t for v, rows in zip(inputs, scripts) for t, _ in rows[1:] if v.role == "u"}
    table = []
    for t in all_times:
        for side in (0, 1) if t in jumps else (1,):
            row = [t]
            for v, rows in zip(inputs, scripts):
                row.append(next(b for a, b in reversed(rows) if a < t or (a == t and (side or v.role != "u")) or a == 0))
            table.append(tuple(row))
    types = {"d": np.float64, "f": np.float32, "o": np.bool_}
    return np.array(table, dtype=[("time", np.float64)] + [(v.name, types.get(v.kind, np.int64)) for v in inputs])


def written(m, inputs, scripts, h, until):
    """The simulation for Linkwork."""

    def number(v, x):
        factor, offset = v.scale()
        return repr(factor * x + offset)

    def given(v, x):
        if v.kind == "o":
            return "true" if x else "false"
        if v.kind == "t":
            return '"' + x.replace("\\", "\\\\").replace('"', '\\"') + '"'
        # A number alone is in the unit of the file if this is SI; otherwise the unit must be written.
        defined = v.unit and UNITS[v.unit][0]
        return f'"{x!r} {v.unit}"' if defined and v.kind in "df" and (v.scale() != (1, 0) or m.r.random() < 0.5) else repr(x)

    parts, wires = [], []
    for k, (v, rows) in enumerate(zip(inputs, scripts)):
        kind = "truth" if v.kind == "o" else "number"
        text = ", ".join(f"[{t!r}, {number(v, x)}]" for t, x in rows)
        parts.append(f'"In{k}": (model: "script.{kind}", params: {{ "rows": [{text}] }})')
        wires.append(f'"In{k}.y -> Unit.{port(v.name)}"')
    starts = []
    for v in m.vars:
        if v.given is not None:
            text = ", ".join(given(v, x) for x in v.given)
            starts.append(f'"{v.name}": ' + (f"[{text}]" if v.array else text))
    kind = 'model: "fmi.model_exchange"' if m.exchange else f'model: "fmi.co_simulation", rate: "{h!r} s"'
    parts.append(f'"Unit": ({kind}, params: {{ "file": "unit.fmu", "start": {{ {", ".join(starts)} }} }})')
    solver = 'integrator: "dormand_prince_54", accuracy: (relative: 1e-10, absolute: 1e-10)' if m.exchange else 'integrator: "rk4"'
    return f'Simulation(parts: {{ {", ".join(parts)} }}, wires: [{", ".join(wires)}], step: "{h!r} s", {solver}, until: "{until!r} s")\n'


def fmi(rng):
    """A random unit with random inputs: its outputs at the communication points."""
    import fmpy

    m = Maker(rng)
    folder = FOLDER / "case"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    m.write(folder)
    h, count = rng.choice([0.02, 0.05, 0.1]), rng.randint(8, 24)
    times = [round(k * h, 9) for k in range(count + 1)]
    inputs = [v for v in m.vars if v.causality == "input"]
    # Either the inputs begin with their start values, or outputs at the start are not compared: Linkwork initializes units with start values.
    m.known = rng.random() < 0.5
    scripts = [script(m, v, times, (v.given or v.start)[0]) for v in inputs]
    if m.known:
        scripts = [[(0.0, (v.given or v.start)[0])] + rows[1:] for v, rows in zip(inputs, scripts)]
    outputs = [v for v in m.vars if v.causality == "output"]
    simulate()
    # From here on, units of this process accept discrete inputs in continuous-time mode, where FMPy sets them as well.
    os.environ["UNIT_LENIENT"] = "1"
    unit = str(folder / "unit.fmu")
    single = lambda v: v.given if v.array else v.given[0]
    try:
        found = fmpy.simulate_fmu(
            unit,
            start_time=0,
            stop_time=times[-1],
            output_interval=h,
            relative_tolerance=1e-8,
            record_events=False,
            fmi_type="ModelExchange" if m.exchange else "CoSimulation",
            start_values={v.name: single(v) for v in m.vars if v.given is not None},
            input=signals(m, inputs, scripts, times) if inputs else None,
            output=[v.name for v in outputs],
            use_event_mode=m.events,
            early_return_allowed=m.events,
        )
    except RuntimeError as error:
        if "CVode" not in str(error):
            raise
        return "skip"
    file = folder / "sim.ron"
    file.write_text(written(m, inputs, scripts, h, times[-1]))
    names = [f"Unit.{port(v.name)}" + (f"[{k}]" if v.size > 1 else "") for v in outputs for k in range(v.size)]
    told = simulate().ask_json({"file": str(file), "times": times, "names": names})
    what = f"FMI {m.version} {'model exchange' if m.exchange else 'co-simulation'}{' with event mode' if m.events else ''}"
    if "error" in told:
        return f"{what}, rejected: {told['error']}"
    for k, t in enumerate(times):
        if k == 0 and not m.known and not m.exchange:
            continue
        row = found[np.argmin(np.abs(found["time"] - t))]
        if abs(row["time"] - t) > 1e-6:
            return f"{what}: FMPy has no sample at {t}"
        mine = iter(told["samples"][k])
        for v in outputs:
            factor, offset = v.scale()
            for theirs in np.ravel(row[v.name]):
                own, wanted = next(mine), factor * float(theirs) + offset
                # Model exchange: two solvers. Float32 has 24 bits.
                slack = 1e-5 if m.exchange else 1e-6 if v.kind == "f" else 1e-10
                if not abs(own - wanted) <= slack * max(1, abs(factor)) * max(1, abs(float(theirs))):
                    return f"{what}: output `{v.name}` ({v.kind}, {v.unit}) at {t}: {own}, FMPy {wanted}"
    return None


def simulate():
    """The example `simulate` of linkwork-fmi."""
    global LINKWORK
    LINKWORK = LINKWORK or common.Linkwork("simulate", "linkwork-fmi")
    return LINKWORK


LINKWORK = None
CASES = {"fmi": fmi}
