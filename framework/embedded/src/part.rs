//! Parts: named arms, legs, necks, grippers and bases.
//!
//! A part is a chain from a base (not included) to a tip, or a set of bodies. A set whose bodies follow one another is also a chain. Each chain has
//! its own mechanism, so the cost of its kinematics depends on its own joints only.

use crate::error::{ModelFault, RobotError};
use linkwork_dynamics::Tree;
use linkwork_multibody::{BodyId, Builder, Limits, Multibody, NodeId};
use linkwork_names::suggest;
use linkwork_spatial::Pose;
use serde::{Deserialize, Serialize};

/// Description of a part.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum PartSpec {
    /// The bodies after `base` up to `tip`.
    Chain {
        /// Its name, for example `left`, `neck`, `front_leg`.
        name: String,
        /// The body that carries it, or `world`.
        base: String,
        /// Its last body: the frame that inverse kinematics moves.
        tip: String,
    },
    /// A set of bodies, for example a gripper or a platform.
    Bodies {
        /// Its name.
        name: String,
        /// Names of bodies.
        bodies: Vec<String>,
    },
}

impl PartSpec {
    /// Describes a chain from a base (or `world`) to a tip.
    #[must_use]
    pub fn chain(name: &str, base: &str, tip: &str) -> Self {
        Self::Chain { name: name.into(), base: base.into(), tip: tip.into() }
    }

    /// Describes a set of bodies.
    #[must_use]
    pub fn bodies(name: &str, bodies: &[&str]) -> Self {
        let bodies = bodies.iter().map(|b| (*b).to_owned()).collect();
        Self::Bodies { name: name.into(), bodies }
    }

    /// Returns its name.
    #[must_use]
    pub fn name(&self) -> &str {
        match self {
            Self::Chain { name, .. } | Self::Bodies { name, .. } => name,
        }
    }
}

/// Handle of a part of one [`RobotModel`](crate::RobotModel).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Part(pub(crate) u32);

impl Part {
    /// Returns its index in the model's list of parts.
    #[must_use]
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// A part, with its names resolved.
#[derive(Debug)]
pub(crate) struct Resolved {
    pub name: String,
    pub bodies: Vec<BodyId>,
    pub chain: Option<Chain>,
}

/// A chain as a separate mechanism whose world is the frame of the base.
#[derive(Debug)]
pub(crate) struct Chain {
    pub tree: Tree,
    /// The tip in `tree`, and its body in the whole mechanism.
    pub tip: NodeId,
    pub tip_body: BodyId,
    /// Indices in the whole robot's q and β.
    pub q: Vec<usize>,
    pub v: Vec<usize>,
    /// For each entry of β that has exactly one entry of q: the index of that entry in the chain's q, and its limits.
    pub limits: Vec<Option<(usize, Limits)>>,
    /// For each entry of β: the first entry of the same subhinge (the columns of a ball or free hinge rotate together).
    pub first: Vec<usize>,
    /// The bodies from the world to the base; `None` when the base does not move.
    pub carrier: Option<Carrier>,
    /// Pose of the base when it does not move.
    pub fixed: Pose,
}

impl Chain {
    /// Checks that the chain's coordinates in the whole q are within their limits.
    ///
    /// # Errors
    /// [`RobotError::OutsideLimits`] for the first coordinate that is not.
    pub fn within_limits(&self, q: &[f64]) -> Result<(), RobotError> {
        for (dof, limit) in self.v.iter().zip(&self.limits) {
            let Some((at, limits)) = limit else { continue };
            let value = q[self.q[*at]];
            if !(value >= limits.lower && value <= limits.upper) {
                let (lower, upper) = (limits.lower, limits.upper);
                return Err(RobotError::OutsideLimits { dof: *dof, value, lower, upper });
            }
        }
        Ok(())
    }
}

/// The bodies from the world to the base of a chain.
#[derive(Debug)]
pub(crate) struct Carrier {
    pub tree: Tree,
    pub body: BodyId,
    pub q: Vec<usize>,
}

/// Resolves the names of a part, or adds faults.
pub(crate) fn resolve(
    mbs: &Multibody,
    spec: &PartSpec,
    faults: &mut Vec<ModelFault>,
) -> Option<Resolved> {
    let part = spec.name();
    let mut find = |name: &str| {
        let id = mbs.body(name);
        if id.is_none() {
            faults.push(ModelFault::Unknown {
                place: format!("part `{part}`"),
                kind: "body",
                name: name.to_owned(),
                help: suggest(name, "body", mbs.bodies().iter().map(|b| b.name())),
            });
        }
        id
    };
    let (bodies, base) = match spec {
        PartSpec::Chain { base, tip, .. } => {
            let base_id = if base == "world" { None } else { Some(find(base)?) };
            let tip_id = find(tip)?;
            let mut bodies: Vec<BodyId> =
                mbs.ancestors(tip_id).take_while(|b| Some(*b) != base_id).collect();
            bodies.reverse();
            let carried = base_id.is_none_or(|b| mbs.on_path(b, tip_id));
            if !carried || bodies.is_empty() {
                let (part, base, tip) = (part.to_owned(), base.clone(), tip.clone());
                faults.push(ModelFault::NoPath { part, base, tip });
                return None;
            }
            (bodies, Some(base_id))
        }
        PartSpec::Bodies { bodies, .. } => {
            let mut found: Vec<BodyId> = Vec::with_capacity(bodies.len());
            for name in bodies {
                found.push(find(name)?);
            }
            found.sort();
            found.dedup();
            let follows = found.windows(2).all(|w| mbs.get(w[1]).parent() == Some(w[0]));
            let Some(first) = found.first() else {
                faults.push(ModelFault::Empty { part: part.to_owned() });
                return None;
            };
            let base = follows.then(|| mbs.get(*first).parent());
            (found, base)
        }
    };
    let chain = match base {
        Some(base) => Some(chain(mbs, &bodies, base, faults)?),
        None => None,
    };
    Some(Resolved { name: part.to_owned(), bodies, chain })
}

fn chain(
    mbs: &Multibody,
    bodies: &[BodyId],
    base: Option<BodyId>,
    faults: &mut Vec<ModelFault>,
) -> Option<Chain> {
    let refuse = |text: String, faults: &mut Vec<ModelFault>| {
        faults.push(ModelFault::Mechanism { text });
        None
    };
    let tip_body = *bodies.last()?;
    let part = match mbs.subgraph(bodies) {
        Ok(part) => part,
        Err(e) => return refuse(e.to_string(), faults),
    };
    let mut builder = Builder::from(&part.multibody);
    builder.nodes_mut().clear();
    builder.node("tip", mbs.get(tip_body).name(), Pose::identity());
    let multibody = match builder.build() {
        Ok(multibody) => multibody,
        Err(e) => return refuse(e.to_string(), faults),
    };
    let tip = multibody.node("tip")?;
    let mut limits = vec![None; multibody.nv()];
    let mut first: Vec<usize> = (0..multibody.nv()).collect();
    for (_, s) in multibody.subhinges() {
        if s.v.len() == 1 && s.q.len() == 1 {
            limits[s.v.start] = Some((s.q.start, s.subhinge.limits));
        }
        first[s.v.clone()].fill(s.v.start);
    }
    let carrier = base.map(|b| {
        let path = mbs.path_graph(b);
        let body = path.multibody.body(mbs.get(b).name());
        (path, body)
    });
    let (mut fixed, mut moving) = (Pose::identity(), None);
    if let Some((path, Some(body))) = carrier {
        if path.multibody.nv() == 0 {
            fixed = path.multibody.body_poses(&[])[body.index()];
        } else {
            moving = Some(Carrier { tree: Tree::new(&path.multibody), body, q: path.q });
        }
    }
    Some(Chain {
        tree: Tree::new(&multibody),
        tip,
        tip_body,
        q: part.q,
        v: part.v,
        limits,
        first,
        carrier: moving,
        fixed,
    })
}
