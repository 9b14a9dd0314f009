"""A program with correct and wrong lines. `test_typed.py` runs it; `mypy --strict` checks it.

A wrong line is marked with its error of mypy. `test_typed.py` removes the marks and compares: mypy
must reject exactly these lines, with these errors. Runs in a folder that contains `sims`, and writes
into the given folder.
"""

import sys
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

import linkwork
from linkwork import LinkworkError, Simulation

folder = Path(sys.argv[1])
arm: linkwork.Mechanism = (
    linkwork.Builder()
    .body("link", hinge=linkwork.Hinge.pin([0, 0, 1]).limits(-1.0, 1.0), mass=1.0, com=[0.1, 0, 0])
    .node("tip", "link", [0.2, 0, 0])
    .build()
)
q: NDArray[np.float64] = arm.neutral_q()
v = np.zeros(arm.nv)
tau: NDArray[np.float64] = arm.inverse_dynamics(q, v, [0.0], wrenches={"tip": np.zeros(6)})
vdot, held = arm.mixed_dynamics(q, v, tau, v)
arm.gravity = [0.0, 0.0, -1.62]
pose: NDArray[np.float64] = arm.state(q, v).pose("tip")
t, qs, vs = arm.simulate(q, v, 1e-3, 10, torque=lambda t, q, v: -0.1 * v)

ops = arm.operators(q)
H, Phi, M = ops.H, ops.Phi, ops.M
expression: linkwork.Operator = 2.0 * (H * Phi * M * Phi.T * H.T)
force: NDArray[np.float64] = expression * v
shape = expression.shape
assert shape is not None
rows: int = shape[0]
assert (rows, len(t), qs.shape, pose.shape) == (1, 11, (11, 1), (4, 4))
assert np.allclose(force, 2.0 * arm.mass_matrix(q) @ v) and np.allclose(vdot, arm.forward_dynamics(q, v, tau))
assert held.shape == tau.shape
robot = linkwork.Robot(arm, chains={"arm": ("world", "link")}, colliders=[])
both: NDArray[np.float64] = robot.inverse_kinematics_together({"arm": [0.0, 0.0, 0.0]}, q=q)
search: linkwork.InverseKinematicsSearch = robot.begin_inverse_kinematics("arm", [0.0, 0.0, 0.0], q=q)
ended: bool = search.advance(100)
assert ended and search.outcome == "met"
how_far: tuple[float, float] | None = search.residual


def controller(sim: Simulation) -> None:
    sim["bob.rate"] = 0.5


sim = Simulation("sims/pendulum", {"Friction.damping": 0.1}, until="2 s")
sim.at(50, controller)
log = sim.log(["**"], rate=10)
sim.record(folder / "run.mcap")
sim.run()
sim.stop_recording()
angles: NDArray[np.float64] = log["bob.angle"]
units: list[str] = [variable.unit for variable in sim.variables().values()]
series: dict[str, linkwork.Series] = linkwork.read_log(folder / "run.mcap")
assert len(angles) == 21 and "rad" in units and series["bob.angle"].unit == "rad"
campaign = linkwork.Campaign("sims/ballistic_entry/dispersions.ron")
outcome: linkwork.Outcome = campaign.run(17, checkpoint=folder / "run_17.lwck")
heating: float = outcome.metrics["peak heating"]
assert heating > 0 and campaign.draws(17).keys() == campaign.drawn.keys()
text: str = ""
try:
    linkwork.load(folder / "no such.ron", root="free")
except LinkworkError as error:
    text = str(error)
assert "no such.ron" in text

if TYPE_CHECKING:
    arm.inverse_dynamics(q)  # type: ignore[call-arg]
    arm.no_such_algorithm(q)  # type: ignore[attr-defined]
    linkwork.load("arm.urdf", root="floating")  # type: ignore[arg-type]
    wrong: int = arm.mass_matrix(q)  # type: ignore[assignment]
    sim.at("often", controller)  # type: ignore[arg-type]
    results: linkwork.Results = campaign.execute(folder, threads=2)
    campaign.execute()  # type: ignore[call-arg]
    campaign.run("17")  # type: ignore[arg-type]
