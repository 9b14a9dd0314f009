"""A02, A04 and A05 of the IFToMM benchmark problems in Exudyn: the values that
`framework/solvers/tests/benchmark_problems/references.rs` holds.

Usage: exudyn_references.py [four_bars] [bricard] [suite] [governor] [tree]; without words all, some minutes.
Each problem at three steps, halved each time; then the limit by Richardson's extrapolation, and how far
its last two values differ, which tells how far it may be trusted. For Exudyn 1.13; `suite` also wants
scipy.
"""
import sys

import exudyn as exu
import exudyn.utilities as eu
import numpy as np

DOWN_Y, DOWN_Z = [0, -9.81, 0], [0, 0, -9.81]
X, Y, Z = [1, 0, 0], [0, 1, 0], [0, 0, 1]


def settings(end, step, write, radius=1.0):
    """Generalised alpha (radius 1: no numerical damping), Newton to rounding, redundant rows allowed."""
    s = exu.SimulationSettings()
    s.solution.file.write = False
    s.solution.sensors.writePeriod = write
    s.timeIntegration.endTime = end
    s.timeIntegration.numberOfSteps = round(end / step)
    s.timeIntegration.verboseMode = 0
    s.timeIntegration.newton.useModifiedNewton = True
    s.timeIntegration.newton.relativeTolerance = 1e-10
    s.timeIntegration.newton.absoluteTolerance = 1e-12
    s.timeIntegration.generalizedAlpha.spectralRadius = radius
    s.linearSolver.solverType = exu.LinearSolverType.EigenDense
    s.linearSolver.ignoreSingularJacobian = True
    return s


def empty():
    """A system without anything."""
    return exu.SystemContainer().AddSystem()


def sampled(mbs, sensors, times):
    """Values of the sensors at the given times, a row each."""
    columns = [mbs.GetSensorStoredData(s) for s in sensors]
    rows = [np.argmin(abs(columns[0][:, 0] - t)) for t in times]
    for t, row in zip(times, rows):
        assert abs(columns[0][row, 0] - t) < 1e-6, (t, columns[0][row, 0])
    return np.hstack([c[rows, 1:] for c in columns])


def body_sensor(mbs, body, place, kind):
    return mbs.AddSensor(
        eu.SensorBody(bodyNumber=body, localPosition=place, storeInternal=True, outputVariableType=kind)
    )


def four_bars(windows, end, step):
    """Place and velocity of B0 (x, y, ẋ, ẏ) at the end."""
    mbs = empty()
    ground = mbs.AddObject(eu.ObjectGround())

    def bar(x, y, angle, velocity):
        node = mbs.AddNode(
            eu.NodeRigidBody2D(referenceCoordinates=[x, y, angle], initialVelocities=velocity)
        )
        body = mbs.AddObject(eu.RigidBody2D(nodeNumber=node, mass=1, inertia=1 / 12))
        mass = mbs.AddMarker(eu.MarkerBodyMass(bodyNumber=body))
        mbs.AddLoad(eu.LoadMassProportional(markerNumber=mass, loadVector=DOWN_Y))
        ends = [
            mbs.AddMarker(eu.MarkerBodyPosition(bodyNumber=body, localPosition=[s, 0, 0]))
            for s in (-0.5, 0.5)
        ]
        return body, ends

    def pin(a, b):
        mbs.AddObject(eu.RevoluteJoint2D(markerNumbers=[a, b]))

    uprights = [bar(i, 0.5, np.pi / 2, [0.5, 0, -1]) for i in range(windows + 1)]
    couplers = [bar(i + 0.5, 1, 0, [1, 0, 0]) for i in range(windows)]
    for i, (_, (foot, _)) in enumerate(uprights):
        place = eu.MarkerBodyPosition(bodyNumber=ground, localPosition=[i, 0, 0])
        pin(mbs.AddMarker(place), foot)
    for i, (_, (left, right)) in enumerate(couplers):
        pin(uprights[i][1][1], left)
        pin(uprights[i + 1][1][1], right)
    kinds = [exu.OutputVariableType.Position, exu.OutputVariableType.Velocity]
    sensors = [body_sensor(mbs, uprights[0][0], [0.5, 0, 0], k) for k in kinds]
    mbs.Assemble()
    s = settings(end, step, end, radius=0.95)
    # Near the singular positions Newton's method does not converge with an old Jacobian, and with
    # many bars it does not reach the default tolerances.
    s.timeIntegration.newton.useModifiedNewton = False
    if windows > 2:
        s.timeIntegration.newton.relativeTolerance = 1e-8
        s.timeIntegration.newton.absoluteTolerance = 1e-10
        s.timeIntegration.generalizedAlpha.spectralRadius = 0.9
    s.linearSolver.solverType = exu.LinearSolverType.EigenSparse
    mbs.SolveDynamic(s)
    return sampled(mbs, sensors, [end])[:, [0, 1, 3, 4]]


def bricard_system():
    """Five rods and six pins, the last one as rows of a general joint; also the sensor of P3."""
    mbs = empty()
    rod = eu.InertiaCuboid(density=100, sideLengths=[1, 0.1, 0.1]).Translated([0.5, 0, 0])
    corners = [[0, 0, 0], [1, 0, 0], [1, -1, 0], [1, -1, 1], [0, -1, 1], [0, 0, 1]]
    axes = [Y, Z, X, Y, Z, X]
    bodies = [mbs.AddObject(eu.ObjectGround())]
    for i in range(5):
        along = np.subtract(corners[i + 1], corners[i]).astype(float)
        # The x axis of the frame is along the rod; the section is square.
        y = np.roll(along, 1)
        turn = np.array([along, y, np.cross(along, y)]).T
        bodies.append(
            mbs.CreateRigidBody(
                inertia=rod,
                referencePosition=corners[i],
                referenceRotationMatrix=turn,
                gravity=DOWN_Y,
            )
        )
        mbs.CreateRevoluteJoint(itemNumbers=bodies[-2:], position=corners[i], axis=axes[i])
    mbs.CreateGenericJoint(
        itemNumbers=[bodies[-1], bodies[0]],
        position=corners[5],
        constrainedAxes=[1, 1, 1, 0, 1, 1],
    )
    P3 = body_sensor(mbs, bodies[4], [0, 0, 0], exu.OutputVariableType.Position)
    mbs.Assemble()
    return mbs, P3


def bricard(times, step):
    """P3, a row for each time."""
    mbs, P3 = bricard_system()
    mbs.SolveDynamic(settings(times[-1], step, times[0]))
    return sampled(mbs, [P3], times)


def suite():
    """The terms of the number that Exudyn's own test of this mechanism holds, 4.172189649307425."""

    def coordinates(step):
        mbs, _ = bricard_system()
        mbs.SolveDynamic(settings(1, step, 1))
        return np.array([np.linalg.norm(mbs.systemData.GetODE2Coordinates())])

    mbs, _ = bricard_system()
    freedom = mbs.ComputeSystemDegreeOfFreedom()
    eigenvalues, _ = mbs.ComputeODE2Eigenvalues()
    print("first eigenvalue", eigenvalues[0], freedom)
    series("A04 norm of coordinates at 1 s", coordinates, [1e-3, 5e-4, 2.5e-4])


SHAFT = eu.InertiaCuboid(density=3000, sideLengths=[0.01, 0.01, 1])
SLIDER = eu.InertiaCuboid(density=3000, sideLengths=[0.1, 0.1, 0.1])
STIFF, DAMP, SPIN = 8e5, 4e4, 2 * np.pi
"""Official stiffness (N/m) and damping (N s/m) of the springs, and rate of the shaft (rad/s)."""


def governor_rod(way):
    """Rod and ball about the rod's pin, the rod along `way`."""
    rod = eu.InertiaCuboid(density=3000, sideLengths=[1, 0.01, 0.01]).Translated([0.5 * way, 0, 0])
    return rod + eu.InertiaMassPoint(mass=5).Translated([way, 0, 0])


def governor(times, step):
    """s, angle of the rod from straight down, rate of the shaft; four free bodies and joints."""
    mbs = empty()
    ground = mbs.AddObject(eu.ObjectGround())
    start = dict(initialAngularVelocity=[0, 0, SPIN], gravity=DOWN_Z)
    shaft = mbs.CreateRigidBody(inertia=SHAFT, referencePosition=[0, 0, 0.5], **start)
    slider = mbs.CreateRigidBody(inertia=SLIDER, referencePosition=[0, 0, 0.5], **start)
    mbs.CreateRevoluteJoint(itemNumbers=[ground, shaft], position=[0, 0, 0], axis=Z)
    mbs.CreatePrismaticJoint(itemNumbers=[shaft, slider], position=[0, 0, 0.5], axis=Z)
    angle = np.radians(30)
    for way in (1, -1):
        pin = [0.05 * way, 0, 1]
        rod = mbs.CreateRigidBody(
            inertia=governor_rod(way),
            referencePosition=pin,
            referenceRotationMatrix=eu.RotationMatrixY(angle * way),
            initialVelocity=[0, SPIN * pin[0], 0],
            **start,
        )
        mbs.CreateRevoluteJoint(itemNumbers=[shaft, rod], position=pin, axis=Y)
        mbs.CreateSpringDamper(
            itemNumbers=[rod, slider],
            localPosition0=[0.5 * way, 0, 0],
            localPosition1=[0.05 * way, 0, 0],
            referenceLength=0.5,
            stiffness=STIFF,
            damping=DAMP,
        )
    kinds = exu.OutputVariableType
    sensors = [
        body_sensor(mbs, slider, [0, 0, 0], kinds.Position),
        body_sensor(mbs, rod, [-1, 0, 0], kinds.Position),
        body_sensor(mbs, shaft, [0, 0, 0], kinds.AngularVelocity),
    ]
    mbs.Assemble()
    mbs.SolveDynamic(settings(times[-1], step, times[0], radius=0.9))
    got = sampled(mbs, sensors, times)
    reach = np.hypot(got[:, 3], got[:, 4]) - 0.05
    return np.stack([got[:, 2], np.arctan2(reach, 1 - got[:, 5]), got[:, 8]], axis=1)


def tree(times, step):
    """The same from Exudyn's kinematic tree (minimal coordinates) and its RK44."""
    mbs = empty()
    ground = mbs.AddObject(eu.ObjectGround())
    # The coordinates are shaft, slider and rods; the angles of the rods are from the horizontal,
    # positive downward.
    reference = [0, 0.5, np.radians(30), -np.radians(30)]
    node = mbs.AddNode(
        eu.NodeGenericODE2(
            referenceCoordinates=reference,
            initialCoordinates=[0] * 4,
            initialCoordinates_t=[SPIN, 0, 0, 0],
            numberOfODE2Coordinates=4,
        )
    )
    joint = exu.JointType
    bodies = [SHAFT.Translated([0, 0, 0.5]), SLIDER, governor_rod(1), governor_rod(-1)]
    links = mbs.AddObject(
        eu.ObjectKinematicTree(
            nodeNumber=node,
            jointTypes=[joint.RevoluteZ, joint.PrismaticZ, joint.RevoluteY, joint.RevoluteY],
            linkParents=[-1, 0, 0, 0],
            jointTransformations=exu.Matrix3DList([np.eye(3)] * 4),
            jointOffsets=exu.Vector3DList([[0, 0, 0], [0, 0, 0], [0.05, 0, 1], [-0.05, 0, 1]]),
            linkInertiasCOM=exu.Matrix3DList([b.InertiaCOM() for b in bodies]),
            linkCOMs=exu.Vector3DList([list(b.COM()) for b in bodies]),
            linkMasses=[b.Mass() for b in bodies],
            baseOffset=[0, 0, 0],
            gravity=DOWN_Z,
        )
    )
    for link, way in ((2, 1), (3, -1)):
        ends = [
            mbs.AddMarker(
                eu.MarkerKinematicTreeRigid(objectNumber=links, linkNumber=n, localPosition=[x, 0, 0])
            )
            for n, x in ((link, 0.5 * way), (1, 0.05 * way))
        ]
        mbs.AddObject(
            eu.SpringDamper(markerNumbers=ends, referenceLength=0.5, stiffness=STIFF, damping=DAMP)
        )
    kinds = [exu.OutputVariableType.Coordinates, exu.OutputVariableType.Coordinates_t]
    sensors = [
        mbs.AddSensor(eu.SensorNode(nodeNumber=node, storeInternal=True, outputVariableType=k))
        for k in kinds
    ]
    mbs.Assemble()
    s = settings(times[-1], step, times[0])
    s.timeIntegration.automaticStepSize = False
    mbs.SolveDynamic(s, solverType=exu.DynamicSolverType.RK44)
    got = sampled(mbs, sensors, times)
    # Exudyn's coordinates are displacements from the reference.
    return np.stack([0.5 + got[:, 1], np.radians(60) - got[:, 2], got[:, 4]], axis=1)


def series(name, solve, steps, order=2):
    """Prints the values at each step and the extrapolated ones."""
    np.set_printoptions(precision=12, suppress=True, linewidth=140)
    values = []
    for step in steps:
        values.append(solve(step))
        print(name, "step", step)
        print(values[-1], flush=True)
    limits = [b + (b - a) / (2**order - 1) for a, b in zip(values, values[1:])]
    changes = [abs(b - a).max() for a, b in zip(values, values[1:])]
    print(name, "changes", changes, "ratio", changes[0] / changes[1])
    print(name, "limit", "uncertainty", abs(limits[-1] - limits[-2]).max())
    print(limits[-1], flush=True)


GOVERNOR_TIMES = np.arange(1, 101) / 10
# These rows are kept: 0.1, 0.2, 0.3, 0.5, 1, 2, 5, 10 s.
KEPT = [0, 1, 2, 4, 9, 19, 49, 99]
PROBLEMS = {
    "four_bars": lambda: [
        series(f"A02 {n}", lambda h, n=n: four_bars(n, end, h), [1e-3, 5e-4, 2.5e-4])
        for n, end in ((2, 10.0), (10, 10.0), (40, 1.5))
    ],
    "bricard": lambda: series(
        "A04", lambda h: bricard(np.arange(1.0, 11.0), h), [5e-4, 2.5e-4, 1.25e-4]
    ),
    "suite": suite,
    "governor": lambda: series(
        "A05", lambda h: governor(GOVERNOR_TIMES, h)[KEPT], [1e-4, 5e-5, 2.5e-5]
    ),
    "tree": lambda: series(
        "A05 tree", lambda h: tree(GOVERNOR_TIMES, h)[KEPT], [8e-5, 4e-5, 2e-5], order=4
    ),
}

if __name__ == "__main__":
    for name in sys.argv[1:] or PROBLEMS:
        PROBLEMS[name]()
