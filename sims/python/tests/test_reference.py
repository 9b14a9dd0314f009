"""Compared with Pinocchio's values for five robots, at full precision, and with the formulas in numpy."""

import numpy as np
import pytest
from conftest import ROBOTS, matrix_of, off, robot

import linkwork as lw

NAMES = ["double_pendulum", "ur5", "iiwa7", "solo12_ff", "chain10_rand"]


class Robot:
    """A robot of the reference data as a mechanism, and the order of its numbers in ours."""

    def __init__(self, name):
        data = robot(name)
        axes = [
            [float(x) for x in piece.split('"')[0].split()]
            for piece in (ROBOTS / f"{name}.urdf").read_text().split('<axis xyz="')[1:]
        ]
        pins = {"JointModelRX": [1, 0, 0], "JointModelRY": [0, 1, 0], "JointModelRZ": [0, 0, 1]}
        joints = data["joints"]
        b = lw.Builder()
        for j, joint in enumerate(joints):
            kind, X = joint["type"], np.eye(4)
            X[:3, :3], X[:3, 3] = joint["placement_R"], joint["placement_p"]
            if kind == "JointModelFreeFlyer":
                hinge = lw.Hinge.free()
            else:
                hinge = lw.Hinge.pin(pins[kind] if kind in pins else axes[j])
            b.body(
                joint["name"],
                "world" if joint["parent"] == 0 else joints[joint["parent"] - 1]["name"],
                hinge,
                mass=joint["mass"],
                com=joint["com"],
                inertia=joint["inertia_com"],
                inertia_check="positive_moments",
                hinge_in_parent=X,
            )
        for f in data["contact_frames"]:
            X = np.eye(4)
            X[:3, :3], X[:3, 3] = f["R"], f["p"]
            b.node(f["name"], joints[f["joint"] - 1]["name"], X)
        self.frames = [f["name"] for f in data["contact_frames"]]
        self.contact_dim = data["contact_dim"]
        self.joints = [j["name"] for j in joints]
        self.m = b.build()
        self.states = data["states"]
        rows = {s.body: s for s in self.m.subhinges}
        self.qs, self.vs = [], []
        for name in self.joints:
            q, v = rows[name].q, rows[name].v
            self.qs += range(q.start, q.stop)
            # The reference has [v; ω], Linkwork [ω; v].
            n = v.stop - v.start
            self.vs += [v.start + i for i in ([3, 4, 5, 0, 1, 2] if n == 6 else range(n))]

    def q(self, x):
        out = np.empty(len(x))
        out[self.qs] = x
        return out

    def v(self, x):
        out = np.empty(len(x))
        out[self.vs] = x
        return out

    def matrix(self, upper):
        n = self.m.nv
        A = np.zeros((n, n))
        A[np.triu_indices(n)] = upper
        A = A + np.triu(A, 1).T
        out = np.empty((n, n))
        out[np.ix_(self.vs, self.vs)] = A
        return out

    def columns(self, J):
        """Columns in the order of our v; rows [linear; angular] changed to [angular; linear]."""
        J = np.asarray(J)
        out = np.empty(J.shape)
        out[:, self.vs] = J
        return np.vstack([out[3:], out[:3]]) if len(J) == 6 else out


@pytest.fixture(scope="module", params=NAMES)
def case(request):
    return Robot(request.param)


# Measured: at most 9e-15, and 3.4e-13 for the inverse of the mass matrix, whose reference is a
# separate solution.
TOL = 1e-12


def test_dynamics(case):
    m = case.m
    for s in case.states:
        q, v = case.q(s["q"]), case.v(s["v"])
        tau, vdot = case.v(s["tau"]), case.v(s["a_in"])
        assert off(m.forward_dynamics(q, v, tau), case.v(s["aba"])) < TOL
        assert off(m.inverse_dynamics(q, v, vdot), case.v(s["rnea"])) < TOL
        assert off(m.mass_matrix(q), case.matrix(s["M_upper_rowmajor"])) < TOL
        assert off(m.bias_forces(q, v), case.v(s["nle"])) < TOL
        assert off(m.bias_forces(q, 0 * v), case.v(s["gravity"])) < TOL
        assert off(m.integrate(q, 0.01 * v), case.q(s["q_integrated_v_0p01"])) < TOL


def test_external_wrenches(case):
    m = case.m
    for s in case.states:
        q, v = case.q(s["q"]), case.v(s["v"])
        tau, vdot = case.v(s["tau"]), case.v(s["a_in"])
        state, wrenches = m.state(q, v), {}
        for name, f in zip(case.joints, s["fext_local"], strict=True):
            R = state.pose(name)[:3, :3]
            wrenches[name] = np.concatenate([R @ f[3:], R @ f[:3]])
        forward = m.forward_dynamics(q, v, tau, wrenches=wrenches)
        assert off(forward, case.v(s["aba_fext"])) < TOL
        inverse = m.inverse_dynamics(q, v, vdot, wrenches=wrenches)
        assert off(inverse, case.v(s["rnea_fext"])) < TOL
        for name, f in wrenches.items():
            state.add_wrench(name, f)
        assert off(state.forward_dynamics(tau), forward) < 1e-14
        state.clear_wrenches()
        assert off(state.forward_dynamics(tau), case.v(s["aba"])) < TOL
        # In a batch, the wrenches act once on each state.
        many = m.inverse_dynamics(np.array([q] * 3), v, vdot, wrenches=wrenches)
        assert off(many, [inverse] * 3) < 1e-12


def test_frames(case):
    for s in case.states:
        q, v = case.q(s["q"]), case.v(s["v"])
        state = case.m.state(q, v)
        with pytest.raises(lw.LinkworkError, match="not computed yet"):
            state.acceleration(case.frames[0])
        state.inverse_dynamics(case.v(s["a_in"]))
        for name, f in zip(case.frames, s["frames"], strict=True):
            X = state.pose(name)
            assert off(X[:3, :3], f["R"]) < TOL and off(X[:3, 3], f["p"]) < TOL
            assert off(state.position(name), f["p"]) < TOL
            assert off(matrix_of(state.quaternion(name)), f["R"]) < TOL
            turn = [3, 4, 5, 0, 1, 2]
            assert off(state.velocity(name), np.array(f["v_lwa"])[turn]) < TOL
            assert off(state.acceleration(name), np.array(f["ac_lwa"])[turn]) < TOL


def test_whole_body_quantities(case):
    for s in case.states:
        q, v = case.q(s["q"]), case.v(s["v"])
        state = case.m.state(q, v)
        state.inverse_dynamics(case.v(s["a_in"]))
        assert off(state.center_of_mass(), s["com"]) < TOL
        assert off(state.com_velocity(), s["vcom"]) < TOL
        assert off(state.com_acceleration(), s["acom"]) < TOL
        h = np.array(s["hg"])
        assert off(state.momentum(), np.concatenate([h[3:], h[:3]])) < TOL
        assert off(state.kinetic_energy(), s["kinetic"]) < TOL
        assert off(state.potential_energy(), s["potential"]) < TOL


def test_jacobians_compliance_and_inverse(case):
    m = case.m
    for k, s in enumerate(case.states):
        q, v, turn = case.q(s["q"]), case.v(s["v"]), [3, 4, 5, 0, 1, 2]
        assert off(m.node_jacobian(q, case.frames[0]), case.columns(s["J_lwa_frame0"])) < TOL
        assert off(m.com_jacobian(q), case.columns(s["Jcom"])) < TOL
        assert off(m.centroidal_matrix(q) @ v, np.array(s["hg"])[turn]) < TOL
        rate = m.centroidal_matrix(q) @ case.v(s["a_in"]) + m.centroidal_bias(q, v)
        assert off(rate, np.array(s["dhg"])[turn]) < TOL
        assert off(m.kinetic_energy(q, v), s["kinetic"]) < TOL
        assert off(m.potential_energy(q), s["potential"]) < TOL
        if k < 3:
            want = case.matrix(s["Minv_upper_rowmajor"])
            assert off(m.inverse_mass_matrix(q), want) < TOL
            assert off(m.apply_inverse_mass(q, v), want @ v) < TOL
        # The compliance is in the axes of the frames, [linear; angular], with the linear rows first.
        state, blocks, turns = m.state(q), [], []
        for f in case.frames:
            R = state.pose(f)[:3, :3].T
            zero = np.zeros((3, 3))
            turns.append(np.block([[zero, R], [R, zero]])[: case.contact_dim])
            blocks.append(m.node_jacobian(q, f))
        n = len(turns) * case.contact_dim
        T, want = np.zeros((n, 6 * len(turns))), np.zeros((n, n))
        for j, turn6 in enumerate(turns):
            T[j * case.contact_dim : (j + 1) * case.contact_dim, 6 * j : 6 * j + 6] = turn6
        want[np.triu_indices(n)] = s["delassus_upper_rowmajor"]
        want = want + np.triu(want, 1).T
        assert off(T @ m.compliance(q, case.frames) @ T.T, want) < TOL
        J = np.vstack(blocks)
        assert off(m.compliance(q, case.frames), J @ m.inverse_mass_matrix(q) @ J.T) < TOL


def test_derivatives(case):
    """With a fixed base, where the derivative along v is that by q."""
    m = case.m
    for s in case.states[:3]:
        q, v, tau, vdot = case.q(s["q"]), *(case.v(s[k]) for k in ("v", "tau", "a_in"))

        def turned(A):
            out = np.empty((m.nv, m.nv))
            out[np.ix_(case.vs, case.vs)] = A
            return out

        by_q, by_v = m.inverse_dynamics_derivatives(q, v, vdot)
        assert off(by_q, turned(s["drnea_dq"])) < TOL
        assert off(by_v, turned(s["drnea_dv"])) < TOL
        by_q, by_v, by_tau = m.forward_dynamics_derivatives(q, v, tau)
        assert off(by_q, turned(s["daba_dq"])) < 10 * TOL
        assert off(by_v, turned(s["daba_dv"])) < 10 * TOL
        assert off(by_tau, case.matrix(s["Minv_upper_rowmajor"])) < TOL


def test_operators(case):
    """The expressions of the seed compared with Pinocchio's matrices."""
    for s in case.states[:3]:
        q = case.q(s["q"])
        ops = case.m.operators(q)
        H, Phi, Psi, M, K, D, I = ops.H, ops.Phi, ops.Psi, ops.M, ops.K, ops.D, ops.I
        want = case.matrix(s["M_upper_rowmajor"])
        assert off((H * Phi * M * Phi.T * H.T).dense(), want) < TOL
        inverse = (I - H * Psi * K).T * D.inv() * (I - H * Psi * K)
        assert off(inverse.dense(), case.matrix(s["Minv_upper_rowmajor"])) < TOL
        J = (ops.B(case.frames[0]).T * ops.jacobian).dense()
        assert off(J, case.columns(s["J_lwa_frame0"])) < TOL
