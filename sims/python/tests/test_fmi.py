"""FMI units: FMPy validates and runs units exported by Linkwork, and Linkwork runs units from Python."""

import math
import subprocess
import sys

import pytest
from conftest import SOURCE, program

import linkwork as lw

pytestmark = pytest.mark.usefixtures("at_source")


@pytest.fixture(scope="module")
def arm(tmp_path_factory):
    out = tmp_path_factory.mktemp("unit") / "arm.fmu"
    subprocess.run([program(), "export", SOURCE / "sims/fmu/arm.ron", "--fmu", out], check=True)
    return out


def command(t):
    return 0.5 * math.sin(math.pi * t)


def native(h, n):
    sim = lw.Simulation("sims/fmu/arm.ron")
    rows = [sim["arm.angle"]]
    for k in range(n):
        sim["Servo.angle"] = command(k * h)
        sim.run_until(round((k + 1) * h, 9))
        rows.append(sim["arm.angle"])
    return rows


def test_fmpy_validates_and_runs_what_is_exported(arm):
    fmpy = pytest.importorskip("fmpy")
    from fmpy.fmi3 import FMU3Slave
    from fmpy.validation import validate_fmu

    assert validate_fmu(str(arm)) == []
    description = fmpy.read_model_description(str(arm))
    refs = {v.name: v.valueReference for v in description.modelVariables}
    units = {v.name: v.unit for v in description.modelVariables}
    assert (units["arm.angle"], units["Servo.angle"]) == ("rad", "rad")
    unit = FMU3Slave(
        guid=description.guid,
        unzipDirectory=fmpy.extract(str(arm)),
        modelIdentifier=description.coSimulation.modelIdentifier,
    )
    unit.instantiate()
    unit.enterInitializationMode(startTime=0.0)
    unit.exitInitializationMode()
    h, n = 0.005, 400
    angle = lambda: unit.getFloat64([refs["arm.angle"]])[0]
    rows, half = [angle()], None
    for k in range(n):
        if k == n // 2:
            state = unit.getFMUState()
            half = unit.serializeFMUState(state)
            unit.freeFMUState(state)
        unit.setFloat64([refs["Servo.angle"]], [command(k * h)])
        unit.doStep(k * h, h)
        rows.append(angle())
    # Both programs make the same steps with the same code, and differ only by the compiler's
    # choices.
    assert max(abs(a - b) for a, b in zip(rows, native(h, n))) < 1e-12
    assert max(rows) - min(rows) > 0.5
    # The second half is repeated from the serialized state.
    state = unit.deserializeFMUState(half)
    unit.setFMUState(state)
    for k in range(n // 2, n):
        unit.setFloat64([refs["Servo.angle"]], [command(k * h)])
        unit.doStep(k * h, h)
        assert angle() == rows[k + 1]
    # An invalid step and an invalid value are rejected.
    with pytest.raises(fmpy.fmi1.FMICallException):
        unit.doStep(n * h, 0.0003)
    with pytest.raises(fmpy.fmi1.FMICallException):
        unit.setFloat64([refs["Servo.angle"]], [math.nan])
    unit.terminate()
    unit.freeInstance()


def test_fmpy_simulates_it_by_itself(arm):
    fmpy = pytest.importorskip("fmpy")
    result = fmpy.simulate_fmu(
        str(arm), stop_time=1.0, step_size=0.01, output_interval=0.01, output=["arm.angle"]
    )
    sim = lw.Simulation("sims/fmu/arm.ron")
    sim.run_until(1)
    assert abs(result["arm.angle"][-1] - sim["arm.angle"]) < 1e-12


TANK = '''
from {module} import {version}Causality, {version}Slave, {real}

class Tank({version}Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.level, self.flow, self.area = 2.0, 0.0, 0.5
        {time}
        self.register_variable({real}("level", causality={version}Causality.output{continuous}))
        self.register_variable({real}("flow", causality={version}Causality.input{continuous}))
        self.register_variable({real}("area", causality={version}Causality.parameter{fixed}))

    def do_step(self, current_time, step_size):
        self.level += step_size * (self.flow - 0.1 * self.level) / self.area
        return True
'''


@pytest.mark.parametrize("module", ["pythonfmu", "pythonfmu3"])
def test_units_from_python_run(module, tmp_path):
    pytest.importorskip(module)
    if module == "pythonfmu":
        words = dict(version="Fmi2", real="Real", time="", continuous="", fixed="")
    else:
        kind = "from pythonfmu3 import Fmi3Variability as V; self.time = 0.0; "
        clock = "causality=Fmi3Causality.independent, variability=V.continuous"
        words = dict(
            version="Fmi3",
            real="Float64",
            time=f'{kind}self.register_variable(Float64("time", {clock}))',
            continuous=", variability=V.continuous",
            fixed=", variability=V.fixed",
        )
    # Units share the interpreter of this process: each script is a separate module.
    script = f"tank_{module}.py"
    (tmp_path / script).write_text(TANK.format(module=module, **words))
    subprocess.run([sys.executable, "-m", module, "build", "-f", script], cwd=tmp_path, check=True)
    (tmp_path / "sim.ron").write_text(
        """Simulation(
    parts: {
        "Tank": (model: "fmi.co_simulation", rate: "100 ms",
                 params: { "file": "Tank.fmu", "start": { "area": 0.25 } }),
        "Flow": (model: "basics.constant", params: { "value": 0.3 }),
    },
    wires: ["Flow.y -> Tank.flow"], step: "100 ms", until: "2 s",
)"""
    )
    sim = lw.Simulation(str(tmp_path / "sim.ron"))
    sim.run_until(2)
    level = 2.0
    for _ in range(20):
        level += 0.1 * (0.3 - 0.1 * level) / 0.25
    assert abs(sim["Tank.level"] - level) < 1e-12
