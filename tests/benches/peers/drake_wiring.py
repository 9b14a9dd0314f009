"""The chains and the six-wheel drive of tests/benches/wiring.rs in Drake (PyPI `drake`).

Prints lines `drake <row> <scheme> <ns>`: per block and step for chains, per tick for the drive.
All systems are Drake's own C++ ones; Python only builds the diagram. Fixed steps of 1 ms. Drake has
no RK4: its explicit Euler stands beside our Euler, its three-stage RK3 beside our four-stage RK4.
"""
import time

from pydrake.systems.analysis import ApplySimulatorConfig, Simulator, SimulatorConfig
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import (
    ConstantVectorSource, Gain, Integrator, LinearSystem, Multiplexer, ZeroOrderHold)

STEP = 1e-3


def best(diagram, scheme, steps, repeats):
    """The least time of a step, in ns."""
    simulator = Simulator(diagram)
    config = SimulatorConfig(
        integration_scheme=scheme, max_step_size=STEP, use_error_control=False)
    ApplySimulatorConfig(config, simulator)
    simulator.Initialize()
    least, end = float("inf"), 0.0
    for _ in range(repeats):
        end += steps * STEP
        start = time.perf_counter_ns()
        simulator.AdvanceTo(end)
        least = min(least, (time.perf_counter_ns() - start) / steps)
    return least


def chain(n):
    builder = DiagramBuilder()
    before = builder.AddSystem(ConstantVectorSource([1.0])).get_output_port()
    for k in range(n):
        block = [lambda: Gain(0.01, 1), lambda: Integrator(1), lambda: ZeroOrderHold(STEP, 1)][k % 3]()
        builder.AddSystem(block)
        builder.Connect(before, block.get_input_port())
        before = block.get_output_port()
    return builder.Build()


def drive():
    """Per wheel: PI controller, motor with inductance, wheel load, encoder sampled at 1 kHz.

    A linear system has one vector input, so each wheel needs two multiplexers more.
    """
    builder = DiagramBuilder()
    command = builder.AddSystem(ConstantVectorSource([2.0]))
    for _ in range(6):
        # The controller is e = r − y:  ż = e, u = 4 e + 20 z.
        control = builder.AddSystem(LinearSystem([[0.0]], [[1.0, -1.0]], [[20.0]], [[4.0, -4.0]]))
        # The motor is L di/dt = u − R i − k ω, τ = k i.
        motor = builder.AddSystem(LinearSystem([[-400.0]], [[200.0, -20.0]], [[0.1]], [[0.0, 0.0]]))
        # The wheel is J ω̇ = τ − b ω.
        wheel = builder.AddSystem(LinearSystem([[-1.0]], [[20.0]], [[1.0]], [[0.0]]))
        encoder = builder.AddSystem(ZeroOrderHold(STEP, 1))
        error, terminals = builder.AddSystem(Multiplexer(2)), builder.AddSystem(Multiplexer(2))
        builder.Connect(command.get_output_port(), error.get_input_port(0))
        builder.Connect(encoder.get_output_port(), error.get_input_port(1))
        builder.Connect(error.get_output_port(), control.get_input_port())
        builder.Connect(control.get_output_port(), terminals.get_input_port(0))
        builder.Connect(wheel.get_output_port(), terminals.get_input_port(1))
        builder.Connect(terminals.get_output_port(), motor.get_input_port())
        builder.Connect(motor.get_output_port(), wheel.get_input_port())
        builder.Connect(wheel.get_output_port(), encoder.get_input_port())
    return builder.Build()


if __name__ == "__main__":
    for scheme in ["explicit_euler", "runge_kutta3"]:
        for n, steps in [(100, 200), (1000, 20)]:
            ns = best(chain(n), scheme, steps, 6) / n
            print(f"drake chain{n} {scheme} {ns:.1f}", flush=True)
    print(f"drake drive runge_kutta3 {best(drive(), 'runge_kutta3', 1000, 6):.1f}", flush=True)
