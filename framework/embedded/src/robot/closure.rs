//! Mobility of loops that hands close: two hands on one object, or a hand on an object that is fixed in the world or in another hand.
//!
//! ```text
//! hands on one object      C = J_L − J_R                          at the object's origin, over the joints of both chains
//! hand onto a body         C = J_H − J_K − J_B                    at the body's origin; J_B: the object's movable joints,
//!                                                                 J_K: the chain that carries the object, when a hand does
//! mobility                 n − rank C                             n: columns of C
//! ```
//! "Hand onto a body" is a hand that is welded to a body of an object, such as a key in a lock or a hand on a lever. The loop is evaluated in its
//! current configuration.

use super::Robot;
use super::dual::columns_rank;
use crate::error::RobotError;
use crate::linkage::ROOT_V;
use crate::model::Object;
use crate::part::Part;
use linkwork_dynamics::{body_jacobian, poses};
use linkwork_multibody::BodyId;
use linkwork_spatial::nalgebra::{Matrix6, Vector6};
use linkwork_spatial::{Motion, Vec3};

/// A closed loop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Closing<'a> {
    /// Two hands that hold one object.
    Hands(Object),
    /// A hand, or the object in it, welded to a body of an object with joints.
    Onto {
        /// The hand.
        hand: Part,
        /// The object.
        object: Object,
        /// Its body ([`RobotModel::object_body`](crate::RobotModel::object_body)).
        body: BodyId,
        /// For each of the object's degrees of freedom (nv of the object), whether it may move.
        free: &'a [bool],
    },
}

/// Rank and mobility of a closed loop.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ClosureRank {
    /// Number of equations of the loop.
    pub rows: usize,
    /// Number of independent equations in this configuration.
    pub rank: usize,
    /// Remaining degrees of freedom of the chains and joints in the loop.
    pub mobility: usize,
}

impl Robot {
    /// Writes the Jacobian of a body of an object (6 × n, row after row). It maps rates of the object's n degrees of freedom to the velocity [ω; v]
    /// of the body relative to the object's base, at the body's origin, in world axes. Its transpose maps a wrench on the body to the joint forces
    /// that balance it.
    ///
    /// # Errors
    /// [`RobotError::ForeignHandle`], [`RobotError::NoJoints`], [`RobotError::Length`].
    pub fn object_jacobian(
        &mut self,
        object: Object,
        body: BodyId,
        J: &mut [f64],
    ) -> Result<(), RobotError> {
        let n = self.object_columns(object, body)?;
        if J.len() != 6 * n {
            return Err(RobotError::Length { what: "J", got: J.len(), wanted: 6 * n });
        }
        if let Some(m) = &self.linkages[object.index()] {
            let rows = m.J.chunks_exact(ROOT_V + n);
            for (out, row) in J.chunks_exact_mut(n).zip(rows) {
                out.copy_from_slice(&row[ROOT_V..]);
            }
        }
        Ok(())
    }

    /// Returns rank and mobility of a loop at the robot's q and the current coordinates of the object's joints. O(nv).
    ///
    /// # Errors
    /// [`RobotError::ForeignHandle`]; [`RobotError::NotAChain`]. For two hands also [`RobotError::NotHeld`] and [`RobotError::EmptyHand`] (no second
    /// hand). For a hand on a body also [`RobotError::NoJoints`], [`RobotError::Length`], and [`RobotError::Held`] when this hand holds the object,
    /// because then there is no loop.
    pub fn closure(&mut self, closing: Closing<'_>) -> Result<ClosureRank, RobotError> {
        let model = self.model.clone();
        let mut A = Matrix6::zeros();
        let mut n = 0;
        let mut take = |c: Vector6<f64>| {
            A += c * c.transpose();
            n += 1;
        };
        match closing {
            Closing::Hands(object) => {
                let (first, second) = self.hands(object)?;
                let p = self.object_pose(object)?.position;
                self.loop_columns(first, second, &p)?;
                let (l, r) = (&model.chain(first)?.v, &model.chain(second)?.v);
                let both = l.iter().chain(r.iter().filter(|v| !l.contains(v)));
                both.for_each(|v| take(self.columns[*v]));
            }
            Closing::Onto { hand, object, body, free } => {
                let own = &model.chain(hand)?.v;
                let joints = self.object_columns(object, body)?;
                if free.len() != joints {
                    let (got, wanted) = (free.len(), joints);
                    return Err(RobotError::Length { what: "free", got, wanted });
                }
                let p = self.object_body_pose(object, body)?.position;
                let carrier = self.holds[self.root(object.index())].map(|h| h.hand.0);
                if carrier == Some(hand) {
                    return Err(RobotError::Held { object: object.index() });
                }
                match carrier {
                    Some(carrier) => {
                        self.loop_columns(hand, carrier, &p)?;
                        let other = &model.chain(carrier)?.v;
                        let both = own.iter().chain(other.iter().filter(|v| !own.contains(v)));
                        both.for_each(|v| take(self.columns[*v]));
                    }
                    None => {
                        self.chain_columns(hand, &p, 1.0)?;
                        own.iter().for_each(|v| take(self.columns[*v]));
                    }
                }
                if let Some(m) = &self.linkages[object.index()] {
                    for (k, _) in free.iter().enumerate().filter(|(_, free)| **free) {
                        let of = |row: usize| m.J[row * (ROOT_V + joints) + ROOT_V + k];
                        take(-Vector6::from_fn(|row, _| of(row)));
                    }
                }
            }
        }
        let rank = columns_rank(&A);
        Ok(ClosureRank { rows: 6, rank, mobility: n - rank })
    }

    /// Computes the Jacobian of an object's body over its whole tree into its memory. Returns the number of degrees of freedom of the object's
    /// joints.
    fn object_columns(&mut self, object: Object, body: BodyId) -> Result<usize, RobotError> {
        // This call also rejects an unknown object or body.
        self.object_body_pose(object, body)?;
        let X_WO = self.object_pose(object)?;
        let Some(m) = &mut self.linkages[object.index()] else {
            return Err(RobotError::NoJoints { object: object.index() });
        };
        m.ws.set_base(&X_WO, &Motion::zero(), &Motion::zero());
        poses(&m.tree, &mut m.ws, &m.q);
        body_jacobian(&m.tree, &m.ws, body, &mut m.J);
        Ok(m.tree.nv() - ROOT_V)
    }

    /// Writes velocities at `p` through a chain into `columns`, and zeros for all other degrees of freedom.
    fn chain_columns(&mut self, part: Part, p: &Vec3, sign: f64) -> Result<(), RobotError> {
        self.columns.fill(Vector6::zeros());
        self.add_chain(part, part, p, sign)
    }
}
