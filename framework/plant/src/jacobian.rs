//! Derivatives of the operations of the mechanism, for stiff methods; they come from the kernels where these provide them.
//!
//! ```text
//! v̇ = M⁻¹ (τ + Jᵀ w − …)         w: wrenches in world axes at frames, J: their Jacobians
//! ∂v̇/∂τ = M⁻¹,  ∂v̇/∂w = M⁻¹ Jᵀ
//! ∂v̇/∂q = kernel − M⁻¹ Jᵀ (ω_i × w)     the kernel takes wrenches for fixed in their bodies; ω_i: rotation by qᵢ
//! lanes of q: ∂/∂q = ∂/∂β-direction N⁺,  q̇ = N v;  lengths of quaternions change nothing
//! ```
//! All derivatives are available for a rigid tree without constraints, compliant contact, variable masses, accelerations that are read, or gravity
//! that depends on position; otherwise these columns are computed by differences.
#![allow(non_snake_case)]
use crate::block::MechanismBlock;
use crate::forward_jacobian::ForwardJacobian;
use crate::frame::Frame;
use linkwork_dynamics::{ForwardDerivatives, body_jacobian, node_jacobian};
use linkwork_runtime::{EvalTime, Failure, Jacobian, Lane, Outcome, VehicleMass};
use linkwork_spatial::nalgebra::Vector6;
use linkwork_spatial::{Force, Vec3};

impl MechanismBlock {
    /// Returns whether the kernels provide all derivatives of `feedthrough`.
    fn differentiable(&self) -> bool {
        let plan = &*self.plan;
        self.solver.is_none()
            && self.compliant.is_none()
            && self.stepper.is_none()
            && plan.varies.is_empty()
            && plan.ports.accels.is_empty()
            && plan.ports.loads.is_empty()
            && plan.ports.vehicles.is_empty()
            && !plan.joints.has_balls()
            && (plan.gravity.is_none() || plan.uniform.is_some())
            && plan.omega.is_none()
            && !self.tree.is_flexible()
    }

    /// Hinge states are states; velocities of frames are linear in v. Derivatives of poses and velocities of frames with respect to q are computed by
    /// differences.
    pub(crate) fn output_jacobian(&mut self, now: &EvalTime, x: &[f64], out: &mut Jacobian) {
        self.kinematics(now, x);
        let plan = self.plan.clone();
        let ports = &plan.ports;
        let (nq, nv) = (plan.multibody.nq(), plan.multibody.nv());
        let framed = !ports.states.is_empty();
        let states = nq + nv + 2 * self.motions.len() + plan.bristles();
        (nq..states).for_each(|j| out.column(j).fill(0.0));
        if !framed {
            (0..nq).for_each(|j| out.column(j).fill(0.0));
        }
        let mut row = 0;
        let mut s = self.forward_slopes();
        for frame in &ports.states {
            self.jacobian(*frame, &mut s.J);
            for k in 0..nv {
                let column = out.column(nq + k);
                (0..6).for_each(|i| column[row + 7 + i] = s.J[i * nv + k]);
            }
            row += 13;
        }
        self.slopes = Some(s);
        for (iq, iv) in &ports.hinges {
            if !framed {
                out.column(*iq as usize)[row] = 1.0;
            }
            out.column(nq + *iv as usize)[row + 1] = 1.0;
            row += 2;
        }
        for i in &ports.loop_states {
            let motion = nq + nv + 2 * *i as usize;
            out.column(motion)[row] = 1.0;
            out.column(motion + 1)[row + 1] = 1.0;
            row += 2;
        }
        for (iq, iv) in &ports.balls {
            if !framed {
                (0..4).for_each(|i| out.column(*iq as usize + i)[row + i] = 1.0);
            }
            (0..3).for_each(|i| out.column(nq + *iv as usize + i)[row + 4 + i] = 1.0);
            row += 7;
        }
    }

    /// Returns the work space, which is created once.
    fn forward_slopes(&mut self) -> Box<ForwardJacobian> {
        match self.slopes.take() {
            Some(slopes) => slopes,
            None => Box::new(ForwardJacobian::new(&self.tree, self.plan.multibody.nq())),
        }
    }

    fn jacobian(&self, frame: Frame, J: &mut [f64]) {
        match frame {
            Frame::Node(n) => node_jacobian(&self.tree, &self.ws, n, J),
            Frame::Body(b) => body_jacobian(&self.tree, &self.ws, b, J),
        }
    }

    /// Computes the derivatives of v̇ with respect to the states of the block, torques and wrenches.
    pub(crate) fn feedthrough_jacobian(
        &mut self,
        now: &EvalTime,
        x: &[f64],
        sig: &[f64],
        out: &mut Jacobian,
    ) -> Outcome {
        if !self.differentiable() {
            return Ok(());
        }
        self.kinematics(now, x);
        self.forces(now, x, sig)?;
        let plan = self.plan.clone();
        let m = &plan.multibody;
        let (nq, nv) = (m.nq(), m.nv());
        let mut s = self.forward_slopes();
        let Some(derivatives) = &mut s.derivatives else { return Ok(()) };
        let (q, v) = x[self.w.x..self.w.x + nq + nv].split_at(nq);
        let done = derivatives.forward_dynamics(
            &self.tree,
            &mut self.ws,
            v,
            &mut self.tau,
            &mut self.vdot,
            ForwardDerivatives {
                dvdot_dq: &mut s.by_q,
                dvdot_dv: &mut s.by_v,
                dvdot_dtau: &mut s.by_tau,
            },
        );
        if let Err(e) = done {
            self.slopes = Some(s);
            return Err(Failure::of(&e));
        }
        self.hinge_slopes(&mut s, q, v);
        let lanes = &self.w.ud;
        let mut input = nq + nv + 2 * self.motions.len();
        for (i, frame) in plan.ports.wrenches.iter().enumerate() {
            let w: [f64; 6] = std::array::from_fn(|k| sig[lanes[6 * i + k] as usize]);
            self.wrench_slopes(&mut s, *frame, w);
            for k in 0..6 {
                if out.wanted(input + k) {
                    let response = s.response.column(k);
                    out.column(input + k)[..nv].copy_from_slice(response.as_slice());
                }
            }
            input += 6;
        }
        let balls = plan.ports.ball_torques.iter().flat_map(|v| *v..*v + 3);
        for v in plan.ports.torques.iter().copied().chain(balls) {
            if out.wanted(input) {
                let column = out.column(input);
                (0..nv).for_each(|i| column[i] = s.by_tau[i * nv + v as usize]);
            }
            input += 1;
        }
        // The derivative is taken along the columns of N, which are orthogonal: N⁺ = Nᵀ / |N_k|².
        (0..nq).for_each(|j| out.column(j).fill(0.0));
        for k in 0..nv {
            s.unit[k] = 1.0;
            m.qdot(q, &s.unit, &mut s.rate);
            s.unit[k] = 0.0;
            let length: f64 = s.rate.iter().map(|r| r * r).sum();
            for (j, rate) in s.rate.iter().enumerate().filter(|(_, r)| **r != 0.0) {
                let column = out.column(j);
                (0..nv).for_each(|i| column[i] += s.by_q[i * nv + k] * rate / length);
            }
            let column = out.column(nq + k);
            (0..nv).for_each(|i| column[i] = s.by_v[i * nv + k]);
        }
        self.slopes = Some(s);
        Ok(())
    }

    /// Adds what damping, friction and stops of hinges change.
    fn hinge_slopes(&self, s: &mut ForwardJacobian, q: &[f64], v: &[f64]) {
        let nv = v.len();
        let ForwardJacobian { by_q, by_v, by_tau, .. } = s;
        self.plan.joints.jacobian(q, v, |at, by_position, by_rate| {
            for i in 0..nv {
                let response = by_tau[i * nv + at];
                by_q[i * nv + at] += response * by_position;
                by_v[i * nv + at] += response * by_rate;
            }
        });
    }

    /// Computes the response to a wrench at a frame, and removes the rotation of the wrench with its body that the kernel includes.
    fn wrench_slopes(&self, s: &mut ForwardJacobian, frame: Frame, w: [f64; 6]) {
        let nv = self.tree.nv();
        self.jacobian(frame, &mut s.J);
        let ForwardJacobian { by_q, by_tau, J, response, .. } = s;
        for k in 0..6 {
            let row = &J[k * nv..(k + 1) * nv];
            for i in 0..nv {
                let inverse = &by_tau[i * nv..(i + 1) * nv];
                response[(i, k)] = inverse.iter().zip(row).map(|(m, j)| m * j).sum();
            }
        }
        let w = Force::new(Vec3::new(w[0], w[1], w[2]), Vec3::new(w[3], w[4], w[5]));
        for i in 0..nv {
            let omega = Vec3::new(J[i], J[nv + i], J[2 * nv + i]);
            let (n, f) = (omega.cross(&w.moment), omega.cross(&w.force));
            let turned = Vector6::new(n.x, n.y, n.z, f.x, f.y, f.z);
            for row in 0..nv {
                by_q[row * nv + i] -= response.row(row).transpose().dot(&turned);
            }
        }
    }

    /// ∂ẋ: the accelerations are the block's own outputs; q̇ is linear in v.
    pub(crate) fn deriv_slopes(&mut self, x: &[f64], out: &mut Jacobian) {
        let plan = self.plan.clone();
        let m = &plan.multibody;
        let (nq, nv) = (m.nq(), m.nv());
        let (q, _) = self.split(x);
        self.dv.fill(0.0);
        for k in 0..nv {
            self.dv[k] = 1.0;
            m.qdot(q, &self.dv, &mut self.q);
            self.dv[k] = 0.0;
            out.column(nq + k)[..nq].copy_from_slice(&self.q);
        }
        // Coordinates of one degree of freedom have q̇ = v; quaternions are left to differences.
        for (_, s) in m.subhinges().filter(|(_, s)| s.q.len() == s.v.len()) {
            s.q.clone().for_each(|j| out.column(j).fill(0.0));
        }
        let motions = nq + nv;
        for i in 0..self.motions.len() {
            out.column(motions + 2 * i).fill(0.0);
            out.column(motions + 2 * i + 1)[motions + 2 * i] = 1.0;
        }
        for gaps in &plan.gaps {
            let [by_position, by_rate] = gaps.jacobian();
            for at in gaps.motions.clone().map(|i| motions + 2 * i) {
                out.column(at)[at + 1] = by_position;
                out.column(at + 1)[at + 1] = by_rate;
            }
        }
        let bristles = motions + 2 * self.motions.len();
        let states = bristles + plan.bristles();
        (bristles..states).for_each(|j| out.column(j).fill(0.0));
        let outputs = states + self.w.ud.len();
        (states..outputs).for_each(|j| out.column(j).fill(0.0));
        let given = &plan.ports.loop_motions;
        for (j, motion) in (outputs - given.len()..outputs).zip(given) {
            out.column(j)[motions + 2 * *motion as usize + 1] = 1.0;
        }
        for i in 0..nv {
            out.column(outputs + i)[nq + i] = 1.0;
        }
        for i in 0..plan.bristles() {
            out.column(outputs + nv + i)[bristles + i] = 1.0;
        }
        let [_, reports, .., accels] = self.output_lanes();
        let ports = &plan.ports;
        let frames = ports.accels.len() + ports.contacts.len() + ports.loads.len();
        let lanes = 6 * frames + VehicleMass::N * ports.vehicles.len() + ports.zones.len();
        let rest = reports - self.w.yd..accels - self.w.yd + lanes;
        rest.for_each(|j| out.column(outputs + j).fill(0.0));
    }
}
