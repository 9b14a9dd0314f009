//! Kinematics of the chains and of the whole robot.

use super::{ChainMemory, Robot};
use crate::error::RobotError;
use crate::manipulability::{Manipulability, Rows};
use crate::part::{Chain, Part};
use linkwork_dynamics::{node_jacobian, poses};
use linkwork_multibody::BodyId;
use linkwork_spatial::{Motion, Pose};

impl Robot {
    /// Returns `X_WT`, the pose of the tip of a chain. Computes only the links between the world and the tip.
    ///
    /// # Errors
    /// [`RobotError::ForeignHandle`], [`RobotError::NotAChain`].
    pub fn tip_pose(&mut self, part: Part) -> Result<Pose, RobotError> {
        let (chain, memory) = self.chain(part)?;
        Ok(memory.ws.node_pose(&chain.tree, chain.tip))
    }

    /// Writes the Jacobian of a chain (6 × n, row after row). It maps rates of the chain's n degrees of freedom to the velocity [ω; v] of its tip
    /// relative to its base, at the tip's origin, in world axes. [`RobotModel::dofs`](crate::RobotModel::dofs) returns the columns.
    ///
    /// # Errors
    /// [`RobotError::ForeignHandle`], [`RobotError::NotAChain`], [`RobotError::Length`].
    pub fn jacobian(&mut self, part: Part, J: &mut [f64]) -> Result<(), RobotError> {
        let (chain, memory) = self.chain(part)?;
        let wanted = 6 * chain.v.len();
        if J.len() != wanted {
            return Err(RobotError::Length { what: "J", got: J.len(), wanted });
        }
        node_jacobian(&chain.tree, &memory.ws, chain.tip, J);
        Ok(())
    }

    /// Writes the Jacobian of a chain's tip over the whole mechanism (6 × nv, row after row), world axes. It includes the degrees of freedom that
    /// carry the chain.
    ///
    /// # Errors
    /// [`RobotError::ForeignHandle`], [`RobotError::NotAChain`], [`RobotError::Length`].
    pub fn whole_jacobian(&mut self, part: Part, J: &mut [f64]) -> Result<(), RobotError> {
        let tip = self.model.tip(part)?;
        let wanted = 6 * self.tree.nv();
        if J.len() != wanted {
            return Err(RobotError::Length { what: "J", got: J.len(), wanted });
        }
        self.move_all();
        node_jacobian(&self.tree, &self.ws, tip, J);
        Ok(())
    }

    /// Returns the manipulability of a chain and, if `gradient` is given, writes its gradient over the chain's degrees of freedom (n). The gradient
    /// is set to zero where the measure is zero, because it does not exist there.
    ///
    /// # Errors
    /// [`RobotError::ForeignHandle`], [`RobotError::NotAChain`], [`RobotError::Length`];
    /// [`RobotError::OutOfRange`] when the length that scales angular rows is not positive.
    pub fn manipulability(
        &mut self,
        part: Part,
        rows: Rows,
        gradient: Option<&mut [f64]>,
    ) -> Result<Manipulability, RobotError> {
        if let Rows::All { length: value } = rows
            && !(value > 0.0 && value.is_finite())
        {
            let help = "the length must be positive; 1 m leaves the Jacobian unchanged";
            return Err(RobotError::OutOfRange { what: "length", value, help });
        }
        let (chain, memory) = self.chain(part)?;
        let wanted = chain.v.len();
        if let Some(got) = gradient.as_deref().map(<[f64]>::len).filter(|n| *n != wanted) {
            return Err(RobotError::Length { what: "gradient", got, wanted });
        }
        node_jacobian(&chain.tree, &memory.ws, chain.tip, &mut memory.J);
        Ok(Manipulability::new(&memory.J, &chain.first, rows, gradient))
    }

    /// Returns `X_WB`, the pose of a body.
    #[must_use]
    pub fn body_pose(&mut self, body: BodyId) -> Pose {
        self.move_all();
        self.ws.body_pose(&self.tree, body)
    }

    /// Returns `X_WB` of the base of a chain.
    ///
    /// # Errors
    /// [`RobotError::ForeignHandle`], [`RobotError::NotAChain`].
    pub fn base_pose(&mut self, part: Part) -> Result<Pose, RobotError> {
        let (model, q) = (&self.model, &self.q);
        let chain = model.chain(part)?;
        let Some(memory) = self.chains[part.index()].as_mut() else {
            return Err(RobotError::NotAChain { part: part.index() });
        };
        Ok(base(chain, memory, q))
    }

    /// Returns a chain with its poses at the robot's q.
    fn chain(&mut self, part: Part) -> Result<(&Chain, &mut ChainMemory), RobotError> {
        let (model, q) = (&self.model, &self.q);
        let chain = model.chain(part)?;
        let Some(memory) = self.chains[part.index()].as_mut() else {
            return Err(RobotError::NotAChain { part: part.index() });
        };
        if !memory.fresh {
            let X_WB = base(chain, memory, q);
            memory.ws.set_base(&X_WB, &Motion::zero(), &Motion::zero());
            gather(&chain.q, q, &mut memory.q);
            poses(&chain.tree, &mut memory.ws, &memory.q);
            memory.fresh = true;
        }
        Ok((chain, memory))
    }

    /// Computes the poses of all bodies at q.
    pub(super) fn move_all(&mut self) {
        if !self.fresh {
            poses(&self.tree, &mut self.ws, &self.q);
            self.fresh = true;
        }
    }
}

/// Returns the pose of a chain's base at the whole robot's q.
pub(super) fn base(chain: &Chain, memory: &mut ChainMemory, q: &[f64]) -> Pose {
    match (&chain.carrier, &mut memory.carrier) {
        (Some(carrier), Some(ws)) => {
            gather(&carrier.q, q, &mut memory.carrier_q);
            poses(&carrier.tree, ws, &memory.carrier_q);
            ws.body_pose(&carrier.tree, carrier.body)
        }
        _ => chain.fixed,
    }
}

pub(super) fn gather(places: &[usize], whole: &[f64], out: &mut [f64]) {
    for (x, at) in out.iter_mut().zip(places) {
        *x = whole[*at];
    }
}
