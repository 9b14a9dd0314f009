"""A program that uses the stubs: mypy --strict reads it, nothing runs it."""

import numpy as np
from numpy.typing import NDArray

import linkwork
from linkwork import LinkworkError, Simulation

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
if shape is not None:
    rows: int = shape[0]


def controller(sim: Simulation) -> None:
    sim["Motor.volts"] = 1.0


sim = Simulation("sims/pendulum", {"Friction.damping": 0.1}, until="2 s")
sim.at(50, controller)
log = sim.log(["**"], rate=10)
sim.run()
angles: NDArray[np.float64] = log["bob.angle"]
units: list[str] = [variable.unit for variable in sim.variables().values()]
try:
    linkwork.load("arm.ron", root="free")
except LinkworkError as error:
    text: str = str(error)
series: dict[str, linkwork.Series] = linkwork.read_log("run.mcap")
