"""An entry in Basilisk, wired its usual way: how far steps of 1 s are from the converged path, and what a step costs.

A ballistic capsule (scene `entry` of tests/benches/space.rs): a point-mass Mars, an exponential atmosphere, cannonball drag, Runge-Kutta 4.
Density and drag are modules of the task. Prints `entry`, the greatest distance (m) of a path in steps of 1 s from the converged one,
microseconds a step, and where the converged one ends.
"""

import time

import numpy as np
from Basilisk.simulation import dragDynamicEffector, exponentialAtmosphere, spacecraft
from Basilisk.utilities import SimulationBaseClass, macros, simIncludeGravBody

RADIUS = 3396190.0
SECONDS = 160


def fly(step: float) -> tuple[np.ndarray, float]:
    """Places (m) every ten seconds, and microseconds a step, recorder included."""
    sim = SimulationBaseClass.SimBaseClass()
    process = sim.CreateNewProcess("process")
    process.addTask(sim.CreateNewTask("task", macros.sec2nano(step)))
    craft = spacecraft.Spacecraft()
    craft.ModelTag = "craft"
    craft.hub.mHub = 3150.0
    craft.hub.IHubPntBc_B = [[5600.0, 0.0, 0.0], [0.0, 4900.0, 0.0], [0.0, 0.0, 4700.0]]
    speed, angle = 5845.0, np.radians(-15.5)
    craft.hub.r_CN_NInit = [[RADIUS + 125e3], [0.0], [0.0]]
    craft.hub.v_CN_NInit = [[speed * np.sin(angle)], [speed * np.cos(angle)], [0.0]]
    mars = simIncludeGravBody.gravBodyFactory().createCustomGravObject("mars", 4.282837362e13)
    mars.isCentralBody = True
    craft.gravField.gravBodies = spacecraft.GravBodyVector([mars])
    air = exponentialAtmosphere.ExponentialAtmosphere()
    air.planetRadius, air.baseDensity, air.scaleHeight = RADIUS, 0.0158, 9354.0
    air.addSpacecraftToModel(craft.scStateOutMsg)
    drag = dragDynamicEffector.DragDynamicEffector()
    drag.coreParams.projectedArea, drag.coreParams.dragCoeff = 15.9, 1.45
    drag.coreParams.comOffset = [0.0, 0.0, 0.0]
    drag.atmoDensInMsg.subscribeTo(air.envOutMsgs[0])
    craft.addDynamicEffector(drag)
    sim.AddModelToTask("task", air, 11)
    sim.AddModelToTask("task", drag, 10)
    sim.AddModelToTask("task", craft, 9)
    recorder = craft.scStateOutMsg.recorder(macros.sec2nano(10.0))
    sim.AddModelToTask("task", recorder)
    sim.InitializeSimulation()
    sim.ConfigureStopTime(macros.sec2nano(SECONDS))
    begin = time.process_time()
    sim.ExecuteSimulation()
    return np.array(recorder.r_CN_N), (time.process_time() - begin) / (SECONDS / step) * 1e6


if __name__ == "__main__":
    fine, _ = fly(1.0 / 64.0)
    half, _ = fly(1.0 / 32.0)
    # In this wiring the error is of first order in the step: the limit follows from the last two.
    limit = 2.0 * fine - half
    coarse, _ = fly(1.0)
    _, each = fly(1.0 / 16.0)
    miss = np.linalg.norm(coarse - limit, axis=1).max()
    print(f"entry {miss:.3f}  {each:.2f}  {' '.join(f'{x:.4f}' for x in limit[-1])}")
