"""Balances a pole on a cart with a controller that is a Python class (see README.md)."""

import sys
from pathlib import Path

import numpy as np

import linkwork

HERE = Path(__file__).resolve().parent


class Balance:
    """State feedback on cart and pole; gains by the Riccati equation from the machine's own derivatives."""

    inputs = {"cart": "hinge state", "pole": "hinge state"}
    outputs = {"force": "hinge torque", "target": "m"}

    def __init__(self, force_max=20.0, cart_weight=1.0, pole_weight=1.0, period=0.01):
        self.force_max = force_max
        self.gains = gains(cart_weight, pole_weight, period)
        self.worst = 0.0

    def step(self, t, u):
        # The target of the cart moves in the middle of the run.
        target = 0.0 if t < 5.0 else 1.0
        (x, vx), (angle, rate) = u["cart"], u["pole"]
        force = -self.gains @ [x - target, angle, vx, rate]
        self.worst = max(self.worst, abs(angle))
        return {"force": np.clip(force, -self.force_max, self.force_max), "target": target}

    # Values that a part keeps between two samples are part of the state of the run.
    def save(self):
        return {"worst": self.worst}

    def load(self, saved):
        self.worst = saved["worst"]


def gains(cart_weight, pole_weight, period):
    """Discrete linear-quadratic gains about the upright pole."""
    machine = linkwork.load(HERE / "cart_pole.ron")
    dq, dv, inverse_mass = machine.forward_dynamics_derivatives([0, 0], [0, 0], [0, 0])
    A = np.block([[np.zeros((2, 2)), np.eye(2)], [dq, dv]])
    B = np.concatenate([np.zeros(2), inverse_mass[:, 0]])[:, None]
    # The discrete matrices are exact over one period, by the series of the exponential of [[A, B],
    # [0, 0]].
    whole, term, n = np.zeros((5, 5)), np.eye(5), 5
    M = np.zeros((n, n))
    M[:4, :4], M[:4, 4:] = A * period, B * period
    for k in range(1, 20):
        whole, term = whole + term, term @ M / k
    F, G = whole[:4, :4], whole[:4, 4:]
    Q, R = np.diag([cart_weight, pole_weight, 1.0, 1.0]), np.eye(1)
    P = Q.copy()
    for _ in range(10_000):
        K = np.linalg.solve(R + G.T @ P @ G, G.T @ P @ F)
        new = Q + F.T @ P @ (F - G @ K)
        if np.abs(new - P).max() < 1e-10 * np.abs(P).max():
            break
        P = new
    return K[0]


models = {"demo.balance": Balance}


def main(folder="."):
    sim = linkwork.Simulation(HERE / "cart_pole.ron", models=models)
    log = sim.log(["cart.displacement", "pole.angle", "Controller.force"], rate=100)
    sim.run()
    angle = np.degrees(log["pole.angle"])
    print(f"largest tilt {np.abs(angle).max():.2f} deg, at the end {abs(angle[-1]):.2e} deg")
    print(f"cart at {log['cart.displacement'][-1]:.4f} m, largest force {np.abs(log['Controller.force']).max():.2f} N")
    return sim, log


if __name__ == "__main__":
    main(*sys.argv[1:])
