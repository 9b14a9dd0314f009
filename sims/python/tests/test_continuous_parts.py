"""Continuous parts that are Python classes: their states, their errors; ports of masses; parts in campaigns."""

import numpy as np
import pytest

import linkwork as lw

pytestmark = pytest.mark.usefixtures("at_source")

SIM = """Simulation(
    doc: "A circuit that is a part in Python.",
    parts: {{
        "Source": (model: "basics.constant", params: {{ "value": 10 }}),
        "Part": (model: "t.part", params: {{ {params} }}),
        "After": (model: "basics.gain", params: {{ "k": 2 }}),
    }},
    wires: ["Source.y -> Part.u", "Part.y -> After.u"],
    metrics: {{ "current": (of: "Part.y", take: "last") }},
    step: "1 ms", until: "0.1 s",
)"""


class Winding:
    """Current of a winding: L di/dt = u - R i."""

    inputs = {"u": "1"}
    outputs = {"y": "1"}
    states = {"i": "A"}
    direct_feedthrough = False

    def __init__(self, resistance=2.0, inductance=0.04, current=0.0):
        self.R, self.L = resistance, inductance
        self.start = {"i": current}

    def evaluate(self, t, x):
        return {"y": x["i"]}

    def derivatives(self, t, x, u):
        return {"i": (u["u"] - self.R * x["i"]) / self.L}


class Direct(Winding):
    direct_feedthrough = True

    def evaluate(self, t, x, u):
        return {"y": u["u"] - self.R * x["i"]}


def write(tmp_path, params="", text=SIM):
    path = tmp_path / "sim.ron"
    path.write_text(text.format(params=params))
    return path


@pytest.mark.parametrize("current", [0.0, 3.0])
def test_a_state_follows_its_differential_equation(tmp_path, current):
    sim = lw.Simulation(write(tmp_path, f'"current": {current}'), models={"t.part": Winding})
    assert sim["Part.y"] == current
    sim.run()
    # i = V/R + (i0 - V/R) exp(-R t / L) with V = 10 V, R = 2 ohm, L = 0.04 H, t = 0.1 s. The method is RK4; measured: 9e-9.
    want = 5 + (current - 5) * np.exp(-5)
    assert abs(sim["Part.y"] - want) < 2e-8 and sim["After.y"] == 2 * sim["Part.y"]
    factor = 1 - 0.05 + 0.05**2 / 2 - 0.05**3 / 6 + 0.05**4 / 24
    assert abs(sim["Part.y"] - (5 + (current - 5) * factor**100)) < 1e-13
    assert sim["Part.state.i"] == sim["Part.y"]


def test_an_output_may_depend_on_the_input_of_the_instant(tmp_path):
    sim = lw.Simulation(write(tmp_path), models={"t.part": Direct})
    assert sim["Part.y"] == 10.0
    sim.run()
    assert abs(sim["Part.y"] - 10 * np.exp(-5)) < 4e-8


def test_states_are_part_of_checkpoints_and_forks(tmp_path):
    path, models = write(tmp_path), {"t.part": Winding}
    straight = lw.Simulation(path, models=models)
    straight.run()
    sim = lw.Simulation(path, models=models)
    sim.run_until(0.03)
    sim.save(tmp_path / "c.lwck")
    other = sim.fork()
    other.run()
    resumed = lw.Simulation.resume(tmp_path / "c.lwck", models=models)
    resumed.run()
    assert straight.state_hash == other.state_hash == resumed.state_hash


def test_several_numbers_are_one_state(tmp_path):
    class Oscillator:
        inputs, outputs, states = {"u": "1"}, {"y": "1"}, {"x": ("m", 2)}
        start = {"x": [1.0, 0.0]}
        direct_feedthrough = False

        def evaluate(self, t, x):
            return {"y": x["x"][0]}

        def derivatives(self, t, x, u):
            position, speed = x["x"]
            return {"x": [speed, -400 * position]}

    sim = lw.Simulation(write(tmp_path), models={"t.part": Oscillator})
    sim.run()
    assert abs(sim["Part.y"] - np.cos(2.0)) < 1e-7


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"step": lambda self, t, u: {}}, "has `step`, and also `evaluate`"),
        ({"states": {}}, "has `derivatives` but no `states`"),
        ({"outputs": {}}, "has `evaluate` but no `outputs`"),
        ({"states": {"u": "A"}, "start": {}}, "both a state and a port"),
        ({"states": {"i": "bool"}}, "`i`"),
        ({"states": {"i": "hinge state"}}, "only possible in `inputs`"),
        ({"save": lambda self: {}, "load": lambda self, saved: None}, "does not have `save`"),
        ({"__init__": lambda self: setattr(self, "start", {"j": 1})}, "`start` has `j`"),
        ({"__init__": lambda self: setattr(self, "start", {"i": "1"})}, "`i` is a string"),
        ({"__init__": lambda self: setattr(self, "start", 1)}, "`start` is not a dict"),
        ({"derivatives": lambda self, t, x, u: {"i": np.nan}}, "`derivatives` of `t.part`: `i` is NaN"),
        ({"derivatives": lambda self, t, x, u: {"j": 0}}, "returned `j`, which is not in `states`"),
        ({"derivatives": lambda self, t, x, u: {}}, "did not return `i` of `states`"),
        ({"evaluate": lambda self, t, x: {"y": 1 / 0}}, r"ZeroDivisionError: .*\(test_continuous_parts.py:\d+\)"),
    ],
)
def test_mistakes_are_told_with_their_part(tmp_path, change, message):
    broken = type("Broken", (Winding,), change)
    with pytest.raises(lw.LinkworkError, match=message) as caught:
        lw.Simulation(write(tmp_path), models={"t.part": broken}).run()
    assert "art" in str(caught.value) and "help:" in str(caught.value)


def test_a_sampled_part_has_no_continuous_states(tmp_path):
    class Both:
        inputs, outputs, states = {"u": "1"}, {"y": "1"}, {"i": "A"}

        def step(self, t, u):
            return {"y": 0}

    with pytest.raises(lw.LinkworkError, match="has `step`, but `states` belongs to a continuous part"):
        lw.Simulation(write(tmp_path), models={"t.part": Both})


CART = """Simulation(
    doc: "A cart with a load that a part in Python describes.",
    bodies: { "cart": (parent: "world", hinge: Slider([1, 0, 0]), mass: 1, inertia: [1, 1, 1], nodes: { "bed": () }) },
    parts: {
        "Load": (model: "t.load", bind: { "load": "node:cart/bed", "push": "node:cart/bed" }),
        "Scale": (model: "t.scale", bind: { "all": "node:cart/bed" }),
    },
    gravity: "none", step: "1 ms", until: "1 s",
)"""


def test_a_load_adds_to_the_mass_of_its_body(tmp_path):
    class Load:
        """3 kg, pushed by 8 N: 2 m/s^2 with the cart of 1 kg."""

        inputs, outputs = {}, {"load": "added mass", "push": "wrench"}

        def evaluate(self, t, x, u):
            return {"load": [3, 0, 0, 0, 0.1, 0.1, 0.1, 0, 0, 0], "push": [0, 0, 0, 8, 0, 0]}

    class Scale:
        inputs, outputs = {"all": "vehicle mass"}, {"mass": "kg"}

        def evaluate(self, t, x, u):
            return {"mass": u["all"][0]}

    (tmp_path / "sim.ron").write_text(CART)
    sim = lw.Simulation(tmp_path / "sim.ron", models={"t.load": Load, "t.scale": Scale})
    sim.run()
    assert abs(sim["cart.speed"] - 2.0) < 1e-12 and sim["Scale.mass"] == 4.0


CAMPAIGN = """Campaign(
    simulation: "sim.ron", runs: 6,
    vary: { "Part.resistance": Uniform(from: 1, to: 3) },
)"""


def campaign(tmp_path, models, text=SIM):
    write(tmp_path, '"resistance": 2', text)
    (tmp_path / "campaign.ron").write_text(CAMPAIGN)
    return lw.Campaign(tmp_path / "campaign.ron", models=models)


def test_campaigns_run_parts_in_python(tmp_path):
    made = campaign(tmp_path, {"t.part": Winding})
    results = made.execute(tmp_path / "out", threads=2)
    assert results.done == 6 and not results.failures
    for run in range(6):
        R = made.draws(run)["Part.resistance"]
        want = 10 / R * (1 - np.exp(-R * 0.1 / 0.04))
        assert abs(results.table["current"][run] - want) < 1e-7
        assert made.run(run).metrics["current"] == results.table["current"][run]
    sim = made.simulation(2)
    sim.run()
    assert sim["Part.y"] == results.table["current"][2]
    assert made.models == {"t.part": Winding}


def test_a_campaign_continues_with_the_same_class_only(tmp_path):
    made = campaign(tmp_path, {"t.part": Winding})
    made.execute(tmp_path / "out", threads=1)
    other = campaign(tmp_path, {"t.part": Direct})
    assert made.identity != other.identity
    with pytest.raises(lw.LinkworkError, match="campaign"):
        other.execute(tmp_path / "out")
    with pytest.raises(lw.LinkworkError, match="there is no model `t.part`"):
        campaign(tmp_path, None)


def test_a_run_whose_class_raises_fails_alone(tmp_path):
    class Fragile(Winding):
        def derivatives(self, t, x, u):
            if self.R > 2 and t > 0.05:
                raise RuntimeError("burnt out")
            return super().derivatives(t, x, u)

    made = campaign(tmp_path, {"t.part": Fragile})
    results = made.execute(tmp_path / "out", threads=2)
    burnt = [run for run in range(6) if made.draws(run)["Part.resistance"] > 2]
    assert 0 < len(burnt) < 6 and results.done == 6
    assert [made.run(run).ended for run in burnt] == ["failed"] * len(burnt)
    assert "RuntimeError: burnt out (test_continuous_parts.py:" in made.run(burnt[0]).why
