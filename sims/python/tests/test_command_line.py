"""`python -m linkwork`: the commands of the program, with models that are Python classes."""

import subprocess
import sys
from pathlib import Path

import pytest
from conftest import program

pytestmark = pytest.mark.usefixtures("at_source")

MODELS = """
class Decay:
    \"\"\"Something that decays.\"\"\"
    inputs, outputs, states = {}, {"y": "1"}, {"amount": "1"}
    start = {"amount": 1.0}
    def __init__(self, rate=2.0):
        self.rate = rate
    def evaluate(self, t, x, u):
        return {"y": x["amount"]}
    def derivatives(self, t, x, u):
        return {"amount": -self.rate * x["amount"]}

models = {"demo.decay": Decay}
"""
SIM = """Simulation(
    doc: "Decay.", parts: { "Part": (model: "demo.decay", params: { "rate": 3 }) },
    log: [ (channels: ["Part.*"], rate: "10 ms") ],
    metrics: { "rest": (of: "Part.y", take: "last") },
    step: "10 ms", until: "1 s",
)"""


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "decay.py").write_text(MODELS)
    (tmp_path / "sim.ron").write_text(SIM)
    return tmp_path


def call(folder, *arguments):
    command = [sys.executable, "-m", "linkwork", *map(str, arguments)]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=120, check=False)


def test_a_simulation_with_a_class_runs_and_replays(folder):
    done = call(folder, "--models", "decay.py", "run", "sim.ron", "--save-rrd", "off", "--out", "out")
    assert done.returncode == 0, done.stderr
    # exp(-3)
    assert "rest  0.049787" in done.stdout
    done = call(folder, "--models=decay.py", "replay", "out/run.mcap", "--verify")
    assert done.returncode == 0 and "verified" in done.stdout + done.stderr, done.stderr
    done = call(folder, "--models", "decay.py", "describe", "demo.decay")
    assert done.returncode == 0 and "Something that decays." in done.stdout, done.stderr


def test_a_campaign_runs_on_the_command_line(folder):
    (folder / "campaign.ron").write_text('Campaign(simulation: "sim.ron", runs: 3, vary: {"Part.rate": Uniform(from: 1, to: 2)})')
    done = call(folder, "campaign", "campaign.ron", "--out", "out", "--models", "decay.py")
    assert done.returncode == 0, done.stderr
    assert len((folder / "out" / "results.csv").read_text().splitlines()) == 4


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["check", "sim.ron"], "python -m linkwork --models FILE.py"),
        (["--models"], "needs a file"),
        (["check", "sim.ron", "--models", "absent.py"], "not a Python file"),
        (["check", "sim.ron", "--models", "sim.ron"], "not a Python file"),
        (["check", "sim.ron", "--models", "empty.py"], "no dictionary `models`"),
        (["check", "sim.ron", "--models", "broken.py"], "NameError"),
        (["check", "sim.ron", "--models", "taken.py"], "already a model `basics.gain`"),
        (["fly"], "there is no command `fly`"),
    ],
)
def test_mistakes_end_with_a_message(folder, arguments, message):
    (folder / "empty.py").write_text("")
    (folder / "broken.py").write_text("models = {'a.b': Absent}\n")
    (folder / "taken.py").write_text(MODELS.replace("demo.decay", "basics.gain"))
    done = call(folder, *arguments)
    assert done.returncode not in (0, 1) or "check" in arguments
    assert done.returncode != 0 and message in done.stderr, done.stderr


def test_the_example_runs_on_the_command_line(at_source, tmp_path):
    example = at_source / "sims/python_controller"
    done = call(tmp_path, "--models", example / "run.py", "run", example / "cart_pole.ron", "--quiet", "--save-rrd", "off", "--out", "out")
    assert done.returncode == 0, done.stderr


def test_a_recording_passes_the_check_of_rerun(at_source, tmp_path):
    run = [program(), "run", "sims/pendulum", "--until", "2s", "--quiet", "--out", tmp_path / "out"]
    subprocess.run(run, check=True, timeout=120)
    rerun = Path(sys.executable).with_name("rerun")
    done = subprocess.run([rerun, "rrd", "verify", tmp_path / "out/run.rrd"], capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr
