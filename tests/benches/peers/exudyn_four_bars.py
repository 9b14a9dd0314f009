"""A02, N four-bars in a row, in Exudyn: seconds of the solver, start and end energy (J).

Usage: exudyn_four_bars.py loops end_time step
Bars of 1 m and 1 kg; cranks upright on the ground at x = 0, 1, …, N; the tip of the first moves with
1 m/s along x. Generalised alpha of the package with its sparse solver.
"""
import sys
import time

import exudyn as exu
from exudyn.itemInterface import (
    Force,
    MarkerBodyPosition,
    ObjectGround,
    RevoluteJoint2D,
    Rigid2D,
    RigidBody2D,
)

loops, end, step = int(sys.argv[1]), float(sys.argv[2]), float(sys.argv[3])
system = exu.SystemContainer()
mbs = system.AddSystem()
ground = mbs.AddObject(ObjectGround(referencePosition=[0, 0, 0]))
PI_2 = 1.5707963267948966
nodes = []


def bar(x, y, angle, velocity):
    node = mbs.AddNode(
        Rigid2D(referenceCoordinates=[x, y, angle], initialVelocities=velocity)
    )
    body = mbs.AddObject(RigidBody2D(physicsMass=1, physicsInertia=1 / 12, nodeNumber=node))
    ends = [
        mbs.AddMarker(MarkerBodyPosition(bodyNumber=body, localPosition=[s, 0, 0]))
        for s in (-0.5, 0.5)
    ]
    centre = mbs.AddMarker(MarkerBodyPosition(bodyNumber=body, localPosition=[0, 0, 0]))
    mbs.AddLoad(Force(markerNumber=centre, loadVector=[0, -9.81, 0]))
    nodes.append((node, y))
    return ends


cranks = [bar(i, 0.5, PI_2, [0.5, 0, -1]) for i in range(loops + 1)]
couplers = [bar(i + 0.5, 1.0, 0.0, [1, 0, 0]) for i in range(loops)]
for i, (foot, tip) in enumerate(cranks):
    pin = mbs.AddMarker(MarkerBodyPosition(bodyNumber=ground, localPosition=[i, 0, 0]))
    mbs.AddObject(RevoluteJoint2D(markerNumbers=[pin, foot]))
    if i < loops:
        mbs.AddObject(RevoluteJoint2D(markerNumbers=[tip, couplers[i][0]]))
    if i > 0:
        mbs.AddObject(RevoluteJoint2D(markerNumbers=[tip, couplers[i - 1][1]]))
mbs.Assemble()
settings = exu.SimulationSettings()
settings.solutionSettings.writeSolutionToFile = False
settings.solutionSettings.sensorsWritePeriod = end
settings.timeIntegration.endTime = end
settings.timeIntegration.numberOfSteps = round(end / step)
settings.timeIntegration.verboseMode = 0
settings.timeIntegration.newton.useModifiedNewton = True
settings.timeIntegration.generalizedAlpha.spectralRadius = 0.8
settings.linearSolverType = exu.LinearSolverType.EigenSparse


def energy(kind):
    total = 0.0
    for node, y in nodes:
        u = mbs.GetNodeOutput(node, exu.OutputVariableType.Coordinates, kind)
        v = mbs.GetNodeOutput(node, exu.OutputVariableType.Coordinates_t, kind)
        total += 0.5 * (v[0] ** 2 + v[1] ** 2 + v[2] ** 2 / 12) + 9.81 * (y + u[1])
    return total


before = energy(exu.ConfigurationType.Initial)
start = time.perf_counter()
mbs.SolveDynamic(settings)
spent = time.perf_counter() - start
print(spent, before, energy(exu.ConfigurationType.Current))
