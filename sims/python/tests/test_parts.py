"""Parts that are Python classes: their position in the order, their state, their errors."""

import importlib.util
import signal
import threading

import numpy as np
import pytest

import linkwork as lw

pytestmark = pytest.mark.usefixtures("at_source")

SIM = """Simulation(
    doc: "A wheel turned by a part in Python.",
    bodies: {{ "wheel": (parent: "world", hinge: Pin([0, 1, 0]), mass: 1, inertia: [0.1, 0.2, 0.1], nodes: {{ "hub": () }}) }},
    parts: {{
        "Wave": (model: "basics.sine", params: {{ "amplitude": 1, "frequency": "1 Hz" }}),
        "Part": (model: "t.part", rate: "50 Hz", params: {{ {params} }}, bind: {{ {bind} }}),
        "After": (model: "basics.gain", params: {{ "k": 2 }}),
    }},
    wires: [{wires}],
    gravity: "none", step: "1 ms", until: "1 s",
)"""


class Counter:
    """Add up the input and turn the wheel."""

    inputs = {"u": "1", "shaft": "hinge state"}
    outputs = {"y": "1", "torque": "hinge torque", "pair": ("m", 2)}

    def __init__(self, k=1.0):
        self.k, self.n, self.sum = k, 0, 0.0

    def step(self, t, u):
        self.n += 1
        self.sum += u["u"]
        angle, rate = u["shaft"]
        return {"y": self.k * u["u"], "torque": self.sum - 0.1 * rate, "pair": [t, self.n]}

    def save(self):
        return {"n": self.n, "sum": self.sum}

    def load(self, saved):
        self.n, self.sum = saved["n"], saved["sum"]


def write(tmp_path, params='"k": 3', bind='"shaft": "hinge:wheel", "torque": "hinge:wheel"',
          wires='"Wave.y -> Part.u", "Part.y -> After.u"'):
    path = tmp_path / "sim.ron"
    path.write_text(SIM.format(params=params, bind=bind, wires=wires))
    return path


def test_a_part_runs_in_its_place_and_at_its_rate(tmp_path):
    sim = lw.Simulation(write(tmp_path), models={"t.part": Counter})
    sim.run_until(0.25)
    # Sample 12 is at 0.24 s; the other parts use its outputs at the same tick.
    want = 3 * np.sin(2 * np.pi * 0.24)
    assert abs(sim["Part.y"] - want) < 1e-12 and abs(sim["After.y"] - 2 * want) < 1e-12
    assert np.allclose(sim["Part.pair"], [0.24, 13])
    assert sim["wheel.rate"] > 0 and sim.parameters("Part") == {"k": 3.0}


def test_its_state_is_the_runs(tmp_path):
    path, models = write(tmp_path), {"t.part": Counter}
    straight = lw.Simulation(path, models=models)
    straight.run_until(1)
    sim = lw.Simulation(path, models=models)
    for t in (0.1, 0.333, 0.5, 0.52):
        sim.run_until(t)
        sim.save(tmp_path / "c.lwck")
        other = sim.fork()
        other.run_until(0.9)
        sim = lw.Simulation.resume(tmp_path / "c.lwck", models=models)
    sim.run_until(1)
    assert sim.state_hash == straight.state_hash and np.allclose(sim["Part.pair"], [1.0, 51])
    with pytest.raises(lw.LinkworkError, match="there is no model `t.part`"):
        lw.Simulation.resume(tmp_path / "c.lwck")


def test_what_cannot_be_saved_is_refused_by_its_path(tmp_path):

    class Bare:
        inputs, outputs = {"u": "1"}, {"y": "1"}

        def step(self, t, u):
            return {"y": u["u"]}

    path = write(tmp_path, params="", bind="")
    sim = lw.Simulation(path, models={"t.part": Bare})
    sim.run_until(0.1)
    for action in (lambda: sim.save(tmp_path / "c.lwck"), sim.fork):
        with pytest.raises(lw.LinkworkError, match="`?Part`?.*(\n.*)*help: .*stateless = True"):
            action()
    assert not (tmp_path / "c.lwck").exists()
    Bare.stateless = True
    sim = lw.Simulation(path, models={"t.part": Bare})
    sim.fork().run_until(0.1)


def test_exceptions_stop_the_run_with_path_time_and_cause(tmp_path):
    class Late(Counter):
        def step(self, t, u):
            if t > 0.3:
                raise KeyError("no map")
            return super().step(t, u)

    sim = lw.Simulation(write(tmp_path), models={"t.part": Late})
    with pytest.raises(lw.LinkworkError, match="t = 0.32 s: .*Part.*KeyError: 'no map'") as caught:
        sim.run()
    assert isinstance(caught.value.__cause__, KeyError)
    # Ctrl-C in a part interrupts the run like Ctrl-C elsewhere.
    class Stopped(Counter):
        def step(self, t, u):
            if t > 0.5:
                signal.raise_signal(signal.SIGINT)
            return super().step(t, u)

    sim = lw.Simulation(write(tmp_path), models={"t.part": Stopped})
    if threading.current_thread() is threading.main_thread():
        with pytest.raises(KeyboardInterrupt):
            sim.run()

    class Early(Counter):
        def step(self, t, u):
            raise ValueError("at once")

    with pytest.raises(lw.LinkworkError, match="t = 0 s.*at once"):
        lw.Simulation(write(tmp_path), models={"t.part": Early})


@pytest.mark.parametrize(
    ("answer", "message"),
    [
        (None, "did not return a dict"),
        ({"y": 1.0}, "did not return `torque` of `outputs`"),
        ({"y": "1", "torque": 0, "pair": [0, 0]}, "`y` is a string"),
        ({"y": float("nan"), "torque": 0, "pair": [0, 0]}, "`y` is NaN"),
        ({"y": 0, "torque": 0, "pair": [0, 0, 0]}, "`pair` has 3 numbers, not 2"),
        ({"y": 0, "torque": 0, "pair": [0, 0], "pear": 1}, "returned `pear`"),
        ({"y": [1.0], "torque": object(), "pair": [0, 0]}, "not a number"),
    ],
)
def test_wrong_answers_are_told(tmp_path, answer, message):
    class Wrong(Counter):
        def step(self, t, u):
            return answer

    with pytest.raises(lw.LinkworkError, match=message) as caught:
        lw.Simulation(write(tmp_path), models={"t.part": Wrong})
    assert "help:" in str(caught.value)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"inputs": {"u": "kelvins"}}, "kelvins"),
        ({"inputs": {"u": ("1", 0)}}, "has 0 numbers"),
        ({"inputs": {"u": 3}}, "have `u: 3`"),
        ({"inputs": ["u"]}, "not a dict"),
        ({"inputs": {"y": "1"}}, "both an input and an output"),
        ({"inputs": {"a b": "1"}}, "not a valid name in `inputs`"),
        ({"outputs": {"y": "hinge state"}}, "only possible in `inputs`"),
        ({"load": property()}, "only `save`"),
        ({"__init__": lambda self: None}, "cannot be called"),
    ],
)
def test_wrong_classes_are_refused_with_the_part(tmp_path, change, message):
    broken = type("Broken", (Counter,), change)
    with pytest.raises(lw.LinkworkError, match=message) as caught:
        lw.Simulation(write(tmp_path), models={"t.part": broken})
    assert "Part" in str(caught.value) and "help:" in str(caught.value)


def test_wrong_models_are_refused(tmp_path):
    path = write(tmp_path)
    for models, message in [
        ({"t.part": Counter()}, "not a class"),
        ({"t.part": int}, "has no `step`"),
        ({3: Counter}, "not a string"),
        ({"t.part": Counter, "basics.gain": Counter}, "there is already a model `basics.gain`"),
        ({}, "there is no model `t.part`"),
    ]:
        with pytest.raises(lw.LinkworkError, match=message):
            lw.Simulation(path, models=models)
    unsampled = path.read_text().replace('rate: "50 Hz", ', "")
    path.write_text(unsampled)
    with pytest.raises(lw.LinkworkError, match="rate"):
        lw.Simulation(path, models={"t.part": Counter})


def test_a_part_cannot_ask_the_run_that_runs_it(tmp_path):
    held = []

    class Curious(Counter):
        def step(self, t, u):
            if held:
                held[0]["wheel.rate"]
            return super().step(t, u)

    sim = lw.Simulation(write(tmp_path), models={"t.part": Curious})
    held.append(sim)
    with pytest.raises(lw.LinkworkError, match="accesses the simulation that runs it"):
        sim.run()


def test_the_example_balances_its_pole(at_source):
    spec = importlib.util.spec_from_file_location(
        "run", at_source / "sims/python_controller/run.py"
    )
    run = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(run)
    sim, log = run.main()
    assert abs(log["pole.angle"][-1]) < 2e-3 and abs(sim["cart.displacement"] - 1.0) < 0.02
    assert np.abs(log["Controller.force"]).max() <= 20.0
    # A run that checkpoints interrupt is the same.
    other = lw.Simulation(
        at_source / "sims/python_controller/cart_pole.ron", models={"demo.balance": run.Balance}
    )
    for t in (1.0, 5.5):
        other.run_until(t)
        other = other.fork()
    other.run()
    assert other.state_hash == sim.state_hash
