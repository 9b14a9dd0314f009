//! Two hands that hold one object: load sharing, squeezing, and separation of wrenches into moving and squeezing parts.
//!
//! O is the object's origin, L the hand that carries it, R the second hand. J_L and J_R are Jacobians of the object's velocity at O
//! over all degrees of freedom of both chains:
//! ```text
//! C = J_L − J_R                        rows of the closed loop: C β = 0
//! τ = τ₀ − Cᵀ λ                        the same motion for every λ; λ is the wrench of R on the object, about O
//! min τᵀ W τ:  λ = (C W Cᵀ)⁺ C W τ₀
//! F_move = W⁻¹ Gᵀ (G W⁻¹ Gᵀ)⁻¹ G F,    F_squeeze = F − F_move,    G F_squeeze = 0
//! ```
//! The balance is that of the closed mechanism, so it does not depend on which hand took the object first. Hands may pull as well as press: for grips
//! that hold by friction alone, which have limits that this function does not consider, use [`Robot::grip`].

use super::Robot;
use crate::error::RobotError;
use crate::model::Object;
use crate::part::Part;
use linkwork_dynamics::{node_jacobian, node_jacobian_transpose_product};
use linkwork_spatial::nalgebra::{Matrix6, Vector6};
use linkwork_spatial::{Force, Vec3};

/// Cost that a balance minimizes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Balance {
    /// Σ τ².
    Equal,
    /// Σ (τ / limit)²: squared fractions of the effort limits.
    Effort,
}

/// Result of [`Robot::balance`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shared {
    /// Wrench of the second hand on the object: moment about this hand's tip, and force; world axes.
    pub second: Force,
    /// The minimized sum.
    pub cost: f64,
    /// Largest |τ| / limit over all joints of both chains that have a limit. Above 1 the joints cannot exert these forces; the forces are returned
    /// nevertheless.
    pub largest_share: f64,
}

/// Weights of wrenches in [`Robot::split_hand_wrenches`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HandWeights {
    /// Weight of the hand that carries the object, and of the second hand.
    pub hands: [f64; 2],
    /// Weight of 1 N m relative to 1 N, 1/m². The result depends on it.
    pub moment: f64,
}

/// Wrenches of two hands, separated. First hand, then second hand; each about its own tip, world axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HandWrenches {
    /// The part that moves the object.
    pub moving: [Force; 2],
    /// The part that only squeezes it.
    pub squeezing: [Force; 2],
    /// Net wrench on the object, about its origin.
    pub net: Force,
}

impl Robot {
    /// Shares a load between the two hands of an object. `tau` (nv) contains forces of the mechanism with the object on the hand that carries it on
    /// input, such as [`feed_forward`](Self::feed_forward) returns, and forces for the same motion with both hands on output. Only forces of the two
    /// chains change. Where the loop is singular, the smallest λ is chosen.
    ///
    /// # Errors
    /// [`RobotError::ForeignHandle`]; [`RobotError::NotHeld`]; [`RobotError::EmptyHand`] (no second hand); [`RobotError::Length`];
    /// [`RobotError::NotFinite`]; [`RobotError::OutOfRange`] when a joint has no effort limit and the cost is [`Balance::Effort`].
    pub fn balance(
        &mut self,
        object: Object,
        balance: Balance,
        tau: &mut [f64],
    ) -> Result<Shared, RobotError> {
        super::numbers("tau", tau, self.tree.nv())?;
        let (first, second) = self.hands(object)?;
        let model = self.model.clone();
        let (chain_l, chain_r) = (model.chain(first)?, model.chain(second)?);
        let effort = |v: usize| {
            let limit = model.limits[v].map_or(f64::INFINITY, |l| l.1.effort);
            if limit > 0.0 { limit } else { f64::INFINITY }
        };
        let dofs = || {
            let right = chain_r.v.iter().filter(|v| !chain_l.v.contains(v));
            chain_l.v.iter().chain(right).copied()
        };
        if balance == Balance::Effort
            && let Some(v) = dofs().find(|v| effort(*v).is_infinite())
        {
            let (what, value) = ("effort limit of a joint of the hands", v as f64);
            let help =
                "the joint with this index in β has no limit: give one, or use `Balance::Equal`";
            return Err(RobotError::OutOfRange { what, value, help });
        }
        let weight = |v: usize| match balance {
            Balance::Equal => 1.0,
            Balance::Effort => effort(v).powi(-2),
        };
        let p_O = self.object_pose(object)?.position;
        self.loop_columns(first, second, &p_O)?;
        let (mut A, mut b) = (Matrix6::zeros(), Vector6::zeros());
        for v in dofs() {
            let c = self.columns[v];
            A += c * c.transpose() * weight(v);
            b += c * (weight(v) * tau[v]);
        }
        let lambda = pseudo_solve(&A, &b);
        let (mut cost, mut largest_share) = (0.0, 0.0_f64);
        for v in dofs() {
            tau[v] -= self.columns[v].dot(&lambda);
            cost += weight(v) * tau[v] * tau[v];
            largest_share = largest_share.max(tau[v].abs() / effort(v));
        }
        let on_object =
            Force::new(lambda.fixed_rows::<3>(0).into(), lambda.fixed_rows::<3>(3).into());
        let tip = self.tip_pose(second)?.position;
        Ok(Shared { second: on_object.shift_to_parent(&(p_O - tip)), cost, largest_share })
    }

    /// Adds to `tau` (nv) forces that press the two hands of an object towards each other with `force` (N) along the line between their tips. The net
    /// wrench on the object is zero. Returns the wrenches of both hands on the object, each about its tip.
    ///
    /// # Errors
    /// [`RobotError::ForeignHandle`], [`RobotError::NotHeld`], [`RobotError::EmptyHand`] (no second hand), [`RobotError::Length`],
    /// [`RobotError::NotFinite`]; [`RobotError::Singular`] when both tips are at the same point.
    pub fn squeeze(
        &mut self,
        object: Object,
        force: f64,
        tau: &mut [f64],
    ) -> Result<[Force; 2], RobotError> {
        super::numbers("tau", tau, self.tree.nv())?;
        super::numbers("force", &[force], 1)?;
        let (first, second) = self.hands(object)?;
        let line = self.tip_pose(second)?.position - self.tip_pose(first)?.position;
        let length = line.norm();
        if !(length > 1e-9) {
            let help = "both tips are at the same point, so there is no line along which to press";
            return Err(RobotError::Singular { what: "the squeeze", help });
        }
        let F = line * (force / length);
        let wrenches = [Force::new(Vec3::zeros(), F), Force::new(Vec3::zeros(), -F)];
        self.add_wrenches([first, second], &wrenches, tau)?;
        Ok(wrenches)
    }

    /// Adds to `tau` (nv) the forces with which two hands exert the given wrenches on an object. First hand, then second hand; each about its tip,
    /// world axes.
    ///
    /// # Errors
    /// Like [`squeeze`](Self::squeeze).
    pub fn add_hand_wrenches(
        &mut self,
        object: Object,
        wrenches: &[Force; 2],
        tau: &mut [f64],
    ) -> Result<(), RobotError> {
        super::numbers("tau", tau, self.tree.nv())?;
        check(wrenches)?;
        let (first, second) = self.hands(object)?;
        self.add_wrenches([first, second], wrenches, tau)
    }

    /// Separates the wrenches of two hands on an object (first hand, then second; each about its tip) into the part that moves the object, with the
    /// smallest weighted sum of squares, and the part that only squeezes it.
    ///
    /// # Errors
    /// [`RobotError::ForeignHandle`], [`RobotError::NotHeld`], [`RobotError::EmptyHand`] (no second hand), [`RobotError::NotFinite`],
    /// [`RobotError::OutOfRange`] for weights that are not positive.
    pub fn split_hand_wrenches(
        &mut self,
        object: Object,
        wrenches: &[Force; 2],
        weights: &HandWeights,
    ) -> Result<HandWrenches, RobotError> {
        check(wrenches)?;
        let all = [weights.hands[0], weights.hands[1], weights.moment];
        if let Some(value) = all.into_iter().find(|w| !(*w > 0.0 && w.is_finite())) {
            let help = "weights must be positive";
            return Err(RobotError::OutOfRange { what: "weight", value, help });
        }
        let (first, second) = self.hands(object)?;
        let p_O = self.object_pose(object)?.position;
        let l = [self.tip_pose(first)?.position - p_O, self.tip_pose(second)?.position - p_O];
        // The grasp matrix of a hand for moments about O is G_i = φ(O, tip). W_i⁻¹ is diagonal.
        let mut net = Force::zero();
        let mut A = Matrix6::zeros();
        for i in 0..2 {
            let at_object = wrenches[i].shift_to_parent(&l[i]);
            net = Force::new(net.moment + at_object.moment, net.force + at_object.force);
            for k in 0..6 {
                let unit = unit(k).shift_to_parent(&l[i]);
                let g = six(&unit);
                let weight = weights.hands[i] * if k < 3 { weights.moment } else { 1.0 };
                A += g * g.transpose() / weight;
            }
        }
        let x = pseudo_solve(&A, &six(&net));
        let mut out = HandWrenches { moving: [Force::zero(); 2], squeezing: *wrenches, net };
        for i in 0..2 {
            let mut f = Vector6::zeros();
            for k in 0..6 {
                let weight = weights.hands[i] * if k < 3 { weights.moment } else { 1.0 };
                f[k] = six(&unit(k).shift_to_parent(&l[i])).dot(&x) / weight;
            }
            out.moving[i] = Force::new(f.fixed_rows::<3>(0).into(), f.fixed_rows::<3>(3).into());
            out.squeezing[i].moment -= out.moving[i].moment;
            out.squeezing[i].force -= out.moving[i].force;
        }
        Ok(out)
    }

    /// Returns both hands of an object.
    pub(super) fn hands(&self, object: Object) -> Result<(Part, Part), RobotError> {
        let Some(hold) = self.hold(object)? else {
            return Err(RobotError::NotHeld { object: object.index() });
        };
        let (first, X) = (hold.hand.0, hold.second);
        X.map(|(second, _)| (first, second)).ok_or(RobotError::EmptyHand { part: first.index() })
    }

    /// Writes C into `columns`: velocities of the object at `p` through the first chain minus those through the second chain.
    pub(super) fn loop_columns(
        &mut self,
        first: Part,
        second: Part,
        p: &Vec3,
    ) -> Result<(), RobotError> {
        self.columns.fill(Vector6::zeros());
        for (part, other, sign) in [(first, second, 1.0), (second, first, -1.0)] {
            self.add_chain(part, other, p, sign)?;
        }
        Ok(())
    }

    /// Adds velocities at `p`, moving with a chain's tip, to `columns`, over the joints of this and another chain.
    pub(super) fn add_chain(
        &mut self,
        part: Part,
        other: Part,
        p: &Vec3,
        sign: f64,
    ) -> Result<(), RobotError> {
        self.move_all();
        let nv = self.tree.nv();
        let arm = p - self.tip_pose(part)?.position;
        let tip = self.model.tip(part)?;
        // The Jacobian of the whole tree is used because the two chains may begin on different bodies.
        node_jacobian(&self.tree, &self.ws, tip, &mut self.jacobian);
        let J = &self.jacobian;
        let (own, other) = (&self.model.chain(part)?.v, &self.model.chain(other)?.v);
        // Degrees of freedom that both chains contain are used once.
        let dofs = own.iter().chain(other.iter().filter(|v| !own.contains(v)));
        for v in dofs {
            let of = |row: usize| J[row * nv + v];
            let w = Vec3::new(of(0), of(1), of(2));
            let at = Vec3::new(of(3), of(4), of(5)) + w.cross(&arm);
            self.columns[*v] += Vector6::new(w.x, w.y, w.z, at.x, at.y, at.z) * sign;
        }
        Ok(())
    }

    fn add_wrenches(
        &mut self,
        hands: [Part; 2],
        wrenches: &[Force; 2],
        tau: &mut [f64],
    ) -> Result<(), RobotError> {
        self.move_all();
        for (part, wrench) in hands.into_iter().zip(wrenches) {
            let tip = self.model.tip(part)?;
            node_jacobian_transpose_product(&self.tree, &self.ws, tip, wrench, &mut self.room);
            tau.iter_mut().zip(&self.room).for_each(|(t, x)| *t += x);
        }
        Ok(())
    }
}

pub(super) fn check(wrenches: &[Force; 2]) -> Result<(), RobotError> {
    for w in wrenches {
        super::numbers("moment of a wrench", w.moment.as_slice(), 3)?;
        super::numbers("force of a wrench", w.force.as_slice(), 3)?;
    }
    Ok(())
}

fn six(f: &Force) -> Vector6<f64> {
    let (n, F) = (f.moment, f.force);
    Vector6::new(n.x, n.y, n.z, F.x, F.y, F.z)
}

fn unit(k: usize) -> Force {
    let e = Vec3::ith(k % 3, 1.0);
    if k < 3 { Force::new(e, Vec3::zeros()) } else { Force::new(Vec3::zeros(), e) }
}

/// Returns the rank of columns from the matrix of their inner products. Singular values below 1e-6 of the largest count as zero. Rows are scaled as
/// below.
pub(super) fn columns_rank(A: &Matrix6<f64>) -> usize {
    let scaled = scaled(A).1;
    if scaled.iter().any(|a| !a.is_finite()) {
        return 0;
    }
    let e = scaled.symmetric_eigenvalues();
    let most = e.max();
    e.iter().filter(|e| **e > 1e-12 * most).count()
}

/// Returns the scale factors of the rows, and A scaled to ones on its diagonal.
fn scaled(A: &Matrix6<f64>) -> (Matrix6<f64>, Matrix6<f64>) {
    let scale = A.diagonal().map(|d| if d > 0.0 { d.sqrt().recip() } else { 0.0 });
    let S = Matrix6::from_diagonal(&scale);
    (S, S * A * S)
}

/// Solves A x = b for a symmetric positive semidefinite A, with the smallest x if the solution is not unique. Rows are scaled to ones on the diagonal
/// first, so that the rank does not depend on the units of lengths and angles.
fn pseudo_solve(A: &Matrix6<f64>, b: &Vector6<f64>) -> Vector6<f64> {
    let (S, scaled) = scaled(A);
    // The eigenvalue iteration does not end for NaN.
    if scaled.iter().any(|a| !a.is_finite()) {
        return Vector6::repeat(f64::NAN);
    }
    // If no pivot is small, A has full rank and the Cholesky factor is accurate enough.
    if let Some(factor) = scaled.cholesky()
        && (0..6).all(|i| factor.l_dirty()[(i, i)] > 1e-3)
    {
        return S * factor.solve(&(S * b));
    }
    let e = scaled.symmetric_eigen();
    let most = e.eigenvalues.max();
    let mut x = Vector6::zeros();
    for i in 0..6 {
        if e.eigenvalues[i] > 1e-13 * most {
            let u = e.eigenvectors.column(i);
            x += u * (u.dot(&(S * b)) / e.eigenvalues[i]);
        }
    }
    S * x
}
