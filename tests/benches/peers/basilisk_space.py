"""Microseconds a step of Basilisk for the scenes of tests/benches/space.rs, wired its usual way, without recorders.

Runge-Kutta 4, its default. Prints `name microseconds` and the state that shows that the scene is the same.
"""

import os
import sys
import tempfile
import time

import numpy as np
from Basilisk.architecture import messaging
from Basilisk.fswAlgorithms import attTrackingError, inertial3D, mrpFeedback, rwMotorTorque
from Basilisk.simulation import (
    hingedRigidBodyStateEffector,
    nHingedRigidBodyStateEffector,
    planetEphemeris,
    reactionWheelStateEffector,
    simpleNav,
    spacecraft,
)
from Basilisk.utilities import SimulationBaseClass, macros, simIncludeGravBody, simIncludeRW
from Basilisk.utilities.MonteCarlo.Controller import Controller
from Basilisk.utilities.MonteCarlo.Dispersions import NormalDispersion
from Basilisk.utilities.MonteCarlo.RetentionPolicy import RetentionPolicy

POSITION = [[7.0e6], [0.0], [0.0]]
VELOCITY = [[0.0], [6000.0], [4500.0]]
RATES = [[0.01], [0.02], [-0.03]]
INERTIA = [[900.0, 0.0, 0.0], [0.0, 800.0, 0.0], [0.0, 0.0, 600.0]]


def simulation(step: float):
    sim = SimulationBaseClass.SimBaseClass()
    process = sim.CreateNewProcess("process")
    process.addTask(sim.CreateNewTask("task", macros.sec2nano(step)))
    craft = spacecraft.Spacecraft()
    craft.ModelTag = "craft"
    craft.hub.mHub = 750.0
    craft.hub.IHubPntBc_B = INERTIA
    craft.hub.r_CN_NInit = POSITION
    craft.hub.v_CN_NInit = VELOCITY
    craft.hub.omega_BN_BInit = RATES
    sim.AddModelToTask("task", craft, 10)
    return sim, craft


def measure(name: str, sim, craft, step: float, steps: int) -> None:
    sim.InitializeSimulation()
    sim.ConfigureStopTime(macros.sec2nano(step * steps / 10))
    sim.ExecuteSimulation()
    begin = time.process_time()
    sim.ConfigureStopTime(macros.sec2nano(step * steps * 1.1))
    sim.ExecuteSimulation()
    each = (time.process_time() - begin) / steps * 1e6
    state = craft.scStateOutMsg.read()
    print(f"{name} {each:.2f}  r = {np.array(state.r_CN_N)} m  w = {np.array(state.omega_BN_B)} rad/s")


def orbit(steps: int) -> None:
    """A rigid body around the Earth with J2."""
    sim, craft = simulation(10.0)
    factory = simIncludeGravBody.gravBodyFactory()
    earth = factory.createEarth()
    earth.isCentralBody = True
    c20 = -1.08262668e-3 / np.sqrt(5.0)
    with tempfile.NamedTemporaryFile("w", suffix=".txt") as file:
        file.write("6378136.6, 3.986004415e14, 0, 2, 2, 1, 0, 0\n0, 0, 1, 0, 0, 0\n1, 0, 0, 0, 0, 0\n1, 1, 0, 0, 0, 0\n")
        file.write(f"2, 0, {c20}, 0, 0, 0\n2, 1, 0, 0, 0, 0\n2, 2, 0, 0, 0, 0\n")
        file.flush()
        earth.useSphericalHarmonicsGravityModel(file.name, 2)
    craft.gravField.gravBodies = spacecraft.GravBodyVector([earth])
    measure("orbit", sim, craft, 10.0, steps)


def field(degree: int, steps: int) -> None:
    """A rigid body in the field GGM03S of the Earth, cut at a degree and order, which turns; the file is in the environment."""
    sim, craft = simulation(10.0)
    factory = simIncludeGravBody.gravBodyFactory()
    earth = factory.createEarth()
    earth.isCentralBody = True
    earth.useSphericalHarmonicsGravityModel(os.environ["LINKWORK_FIELD"], degree)
    turning = planetEphemeris.PlanetEphemeris()
    turning.setPlanetNames(planetEphemeris.StringVector(["earth"]))
    place = planetEphemeris.ClassicElements()
    place.a, place.e, place.i, place.Omega, place.omega, place.f = 1.496e11, 0.0167, 0.0, 0.0, 0.0, 0.0
    turning.planetElements = planetEphemeris.classicElementVector([place])
    turning.rightAscension = planetEphemeris.DoubleVector([0.0])
    turning.declination = planetEphemeris.DoubleVector([np.pi / 2.0])
    turning.lst0 = planetEphemeris.DoubleVector([0.0])
    turning.rotRate = planetEphemeris.DoubleVector([7.292115e-5])
    sim.AddModelToTask("task", turning, 20)
    earth.planetBodyInMsg.subscribeTo(turning.planetOutMsgs[0])
    craft.gravField.gravBodies = spacecraft.GravBodyVector([earth])
    measure(f"field{degree}", sim, craft, 10.0, steps)


def field20(steps: int) -> None:
    """Degree and order 20."""
    field(20, steps)


def field70(steps: int) -> None:
    """Degree and order 70."""
    field(70, steps)


WHEELS_STEP = 0.1


def three_wheels():
    """Three reaction wheels that hold an attitude."""
    sim, craft = simulation(WHEELS_STEP)
    factory = simIncludeRW.rwFactory()
    for axis in ([1, 0, 0], [0, 1, 0], [0, 0, 1]):
        factory.create("Honeywell_HR16", axis, maxMomentum=50.0, Omega=100.0, RWModel=messaging.BalancedWheels)
    effector = reactionWheelStateEffector.ReactionWheelStateEffector()
    factory.addToSpacecraft("wheels", effector, craft)
    sim.AddModelToTask("task", effector, 9)
    nav = simpleNav.SimpleNav()
    nav.scStateInMsg.subscribeTo(craft.scStateOutMsg)
    sim.AddModelToTask("task", nav, 8)
    reference = inertial3D.inertial3D()
    reference.sigma_R0N = [0.0, 0.0, 0.0]
    sim.AddModelToTask("task", reference, 7)
    error = attTrackingError.attTrackingError()
    error.attNavInMsg.subscribeTo(nav.attOutMsg)
    error.attRefInMsg.subscribeTo(reference.attRefOutMsg)
    sim.AddModelToTask("task", error, 6)
    control = mrpFeedback.mrpFeedback()
    control.K, control.Ki, control.P = 3.5, -1.0, 30.0
    control.guidInMsg.subscribeTo(error.attGuidOutMsg)
    control.vehConfigInMsg.subscribeTo(
        messaging.VehicleConfigMsg().write(messaging.VehicleConfigMsgPayload(ISCPntB_B=np.array(INERTIA).flatten()))
    )
    parameters = factory.getConfigMessage()
    control.rwParamsInMsg.subscribeTo(parameters)
    control.rwSpeedsInMsg.subscribeTo(effector.rwSpeedOutMsg)
    sim.AddModelToTask("task", control, 5)
    torque = rwMotorTorque.rwMotorTorque()
    torque.vehControlInMsg.subscribeTo(control.cmdTorqueOutMsg)
    torque.rwParamsInMsg.subscribeTo(parameters)
    torque.controlAxes_B = [1, 0, 0, 0, 1, 0, 0, 0, 1]
    sim.AddModelToTask("task", torque, 4)
    effector.rwMotorCmdInMsg.subscribeTo(torque.rwMotorTorqueOutMsg)
    # The C++ side points to these Python objects, so the simulation keeps them.
    sim.kept = (craft, effector, nav, reference, error, control, torque, parameters, factory)
    return sim, craft


def wheels(steps: int) -> None:
    """Three reaction wheels that hold an attitude."""
    sim, craft = three_wheels()
    measure("wheels", sim, craft, WHEELS_STEP, steps)


CAMPAIGN_RUNS = 16
CAMPAIGN_STEPS = 6000


def retained_wheels():
    """The three wheels, with rates of the hub recorded every ten seconds."""
    sim, craft = three_wheels()
    sim.hub = craft.hub
    sim.msgRecList = {"craft": craft.scStateOutMsg.recorder(macros.sec2nano(10.0))}
    sim.AddModelToTask("task", sim.msgRecList["craft"])
    return sim


def executed(sim) -> None:
    sim.InitializeSimulation()
    sim.ConfigureStopTime(macros.sec2nano(WHEELS_STEP * CAMPAIGN_STEPS))
    sim.ExecuteSimulation()


def campaign(_steps: int) -> None:
    """Sixteen retained runs of 6000 steps on two processes, by Basilisk's Monte Carlo controller: seconds of wall time."""
    with tempfile.TemporaryDirectory() as folder:
        control = Controller()
        control.setSimulationFunction(retained_wheels)
        control.setExecutionFunction(executed)
        control.setExecutionCount(CAMPAIGN_RUNS)
        control.setThreadCount(2)
        control.setShouldDisperseSeeds(False)
        control.setShowProgressBar(False)
        control.setVerbose(False)
        control.setArchiveDir(f"{folder}/runs")
        control.addDispersion(NormalDispersion("hub.mHub", 750.0, 5.0))
        policy = RetentionPolicy()
        policy.addMessageLog("craft", ["omega_BN_B"])
        control.addRetentionPolicy(policy)
        begin = time.perf_counter()
        failures = control.executeSimulations()
        wall = time.perf_counter() - begin
        kept = control.getRetainedData(CAMPAIGN_RUNS - 1)["messages"]["craft.omega_BN_B"]
        assert not failures, failures
        print(f"campaign {wall:.2f}  {len(kept)} rows of a run, the last w = {kept[-1, 1:]} rad/s")


def chain(steps: int) -> None:
    """A hub with a chain of sixteen hinged plates."""
    step = 0.01
    sim, craft = simulation(step)
    plates = nHingedRigidBodyStateEffector.NHingedRigidBodyStateEffector()
    plates.r_HB_B = [[0.5], [0.0], [1.0]]
    plates.dcm_HB = [[-1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0]]
    for k in range(16):
        plate = nHingedRigidBodyStateEffector.HingedPanel()
        plate.mass = 5.0
        plate.IPntS_S = [[5.0, 0.0, 0.0], [0.0, 3.0, 0.0], [0.0, 0.0, 2.5]]
        plate.d = 0.5
        plate.k = 50.0
        plate.c = 0.1
        plate.thetaInit = 0.01 * (k + 1)
        plate.thetaDotInit = 0.0
        plates.addHingedPanel(plate)
    craft.addStateEffector(plates)
    sim.AddModelToTask("task", plates, 9)
    measure("chain", sim, craft, step, steps)


def panels(steps: int) -> None:
    """A hub with four hinged plates."""
    step = 0.01
    sim, craft = simulation(step)
    kept = []
    for k, (x, y, yaw) in enumerate(((0.5, 0.0, 180.0), (0.0, 0.5, 270.0), (-0.5, 0.0, 0.0), (0.0, -0.5, 90.0))):
        c, s = np.cos(np.radians(yaw)), np.sin(np.radians(yaw))
        plate = hingedRigidBodyStateEffector.HingedRigidBodyStateEffector()
        plate.mass = 5.0
        plate.IPntS_S = [[5.0, 0.0, 0.0], [0.0, 3.0, 0.0], [0.0, 0.0, 2.5]]
        plate.d = 0.5
        plate.k = 50.0
        plate.c = 0.1
        plate.r_HB_B = [[x], [y], [1.0]]
        plate.dcm_HB = [[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]
        plate.thetaInit = 0.01 * (k + 1)
        plate.thetaDotInit = 0.0
        craft.addStateEffector(plate)
        sim.AddModelToTask("task", plate, 9)
        kept.append(plate)
    measure("panels", sim, craft, step, steps)


if __name__ == "__main__":
    scenes = ((orbit, 20000), (field20, 5000), (field70, 2000), (wheels, 20000), (chain, 5000), (panels, 5000), (campaign, 0))
    for scene, steps in scenes:
        if len(sys.argv) < 2 or scene.__name__ in sys.argv[1:]:
            scene(steps)
