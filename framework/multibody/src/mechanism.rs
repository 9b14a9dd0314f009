//! The immutable mechanism and what can be asked of it.

use crate::constraint::{ConstraintId, Coupled, Loop};
use crate::modes::Modes;
use crate::{BodyId, BodySpec, Coordinate, Hinge, NodeId, Subhinge, SubhingeKind};
use linkwork_spatial::{MassProperties, Pose, RigidInertia};
use serde::Serialize;
use std::collections::BTreeMap;
use std::ops::Range;

/// A subhinge and its places in q and β.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SubhingeRange {
    /// The subhinge; its axis is of unit length.
    pub subhinge: Subhinge,
    /// Its numbers in q.
    pub q: Range<usize>,
    /// Its numbers in β (and in forces and accelerations).
    pub v: Range<usize>,
}

/// A body in its mechanism.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Body {
    pub(crate) name: String,
    pub(crate) parent: Option<BodyId>,
    pub(crate) hinge_in_parent: Pose,
    pub(crate) hinge_in_body: Pose,
    pub(crate) mass: MassProperties,
    pub(crate) inertia: RigidInertia,
    pub(crate) subhinges: Vec<SubhingeRange>,
    pub(crate) q: Range<usize>,
    pub(crate) v: Range<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) modes: Option<Modes>,
    #[serde(skip_serializing_if = "Range::is_empty")]
    pub(crate) modes_q: Range<usize>,
    #[serde(skip_serializing_if = "Range::is_empty")]
    pub(crate) modes_v: Range<usize>,
    pub(crate) subtree_end: u32,
}

impl Body {
    /// Its name.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The body that it hangs on; `None` for the world.
    #[must_use]
    pub fn parent(&self) -> Option<BodyId> {
        self.parent
    }

    /// `X_PJ`: the hinge frame in the parent body.
    #[must_use]
    pub fn hinge_in_parent(&self) -> Pose {
        self.hinge_in_parent
    }

    /// `X_BJ`: the hinge frame in this body.
    #[must_use]
    pub fn hinge_in_body(&self) -> Pose {
        self.hinge_in_body
    }

    /// How it bends; `None` for a rigid body.
    #[must_use]
    pub fn modes(&self) -> Option<&Modes> {
        self.modes.as_ref()
    }

    /// The modal coordinates' numbers in q, directly after the hinge's; empty for a rigid body.
    #[must_use]
    pub fn modes_q(&self) -> Range<usize> {
        self.modes_q.clone()
    }

    /// The modal rates' numbers in β, directly after the hinge's; empty for a rigid body.
    #[must_use]
    pub fn modes_v(&self) -> Range<usize> {
        self.modes_v.clone()
    }

    /// Inertia about the body origin, body axes. Of a flexible body: of what does not bend.
    #[must_use]
    pub fn inertia(&self) -> &RigidInertia {
        &self.inertia
    }

    /// Mass properties as they were given: about the centre of mass, body axes. Of a flexible body: of
    /// what does not bend.
    #[must_use]
    pub fn mass_properties(&self) -> &MassProperties {
        &self.mass
    }

    /// The hinge's chain, parent's side first, with places in q and β.
    #[must_use]
    pub fn subhinges(&self) -> &[SubhingeRange] {
        &self.subhinges
    }

    /// Whether its hinge permits any pose and any motion, and dynamics finds which.
    #[must_use]
    pub fn is_free(&self) -> bool {
        let free = |s: &SubhingeRange| {
            s.subhinge.kind == SubhingeKind::Free && s.subhinge.coordinate == Coordinate::Free
        };
        self.subhinges.iter().any(free)
    }

    /// The hinge's numbers in q.
    #[must_use]
    pub fn q(&self) -> Range<usize> {
        self.q.clone()
    }

    /// The hinge's numbers in β.
    #[must_use]
    pub fn v(&self) -> Range<usize> {
        self.v.clone()
    }
}

/// A named frame on a body.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Node {
    pub(crate) name: String,
    pub(crate) body: BodyId,
    pub(crate) pose: Pose,
}

impl Node {
    /// Its name.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The body that carries it.
    #[must_use]
    pub fn body(&self) -> BodyId {
        self.body
    }

    /// `X_BN`: the node frame in the body.
    #[must_use]
    pub fn pose(&self) -> Pose {
        self.pose
    }
}

/// What a mechanism is made of, in canonical order.
pub(crate) struct Parts {
    pub bodies: Vec<Body>,
    pub index: BTreeMap<String, BodyId>,
    pub nodes: Vec<Node>,
    pub node_index: BTreeMap<String, NodeId>,
    pub loops: Vec<Loop>,
    pub couplings: Vec<Coupled>,
}

/// A mechanism: bodies, hinges, nodes, constraints. It never changes.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Multibody {
    bodies: Vec<Body>,
    body_index: BTreeMap<String, BodyId>,
    nodes: Vec<Node>,
    node_index: BTreeMap<String, NodeId>,
    loops: Vec<Loop>,
    couplings: Vec<Coupled>,
    nq: usize,
    nv: usize,
    motions: usize,
}

impl Multibody {
    pub(crate) fn assemble(parts: Parts, nq: usize, nv: usize, motions: usize) -> Self {
        let Parts { bodies, index, nodes, node_index, loops, couplings } = parts;
        Self { bodies, body_index: index, nodes, node_index, loops, couplings, nq, nv, motions }
    }

    /// Hinges that close loops, by name.
    #[must_use]
    pub fn loops(&self) -> &[Loop] {
        &self.loops
    }

    /// Relations between coordinates, by name.
    #[must_use]
    pub fn couplings(&self) -> &[Coupled] {
        &self.couplings
    }

    /// Every constraint: loops, then couplings, each kind by name.
    pub fn constraints(&self) -> impl Iterator<Item = ConstraintId> + use<> {
        let loops = (0..self.loops.len() as u32).map(ConstraintId::Loop);
        loops.chain((0..self.couplings.len() as u32).map(ConstraintId::Coupling))
    }

    /// Scalar equations of a constraint.
    #[must_use]
    pub fn rows(&self, constraint: ConstraintId) -> usize {
        match constraint {
            ConstraintId::Loop(i) => self.loops[i as usize].rows.len(),
            ConstraintId::Coupling(_) => 1,
        }
    }

    /// The name of a constraint.
    #[must_use]
    pub fn constraint_name(&self, constraint: ConstraintId) -> &str {
        match constraint {
            ConstraintId::Loop(i) => &self.loops[i as usize].closure.name,
            ConstraintId::Coupling(i) => &self.couplings[i as usize].coupling.name,
        }
    }

    /// The constraint of that name, loops before couplings.
    #[must_use]
    pub fn constraint(&self, name: &str) -> Option<ConstraintId> {
        self.constraints().find(|c| self.constraint_name(*c) == name)
    }

    /// Prescribed subhinges of all loops and gaps of their rows: how many loop motions the caller gives.
    #[must_use]
    pub fn motions(&self) -> usize {
        self.motions
    }

    /// All bodies in canonical order: depth first, parents first, siblings by name.
    #[must_use]
    pub fn bodies(&self) -> &[Body] {
        &self.bodies
    }

    /// All nodes, by body, then by name.
    #[must_use]
    pub fn nodes(&self) -> &[Node] {
        &self.nodes
    }

    /// The identifiers of all bodies, in canonical order.
    pub fn body_ids(&self) -> impl ExactSizeIterator<Item = BodyId> + use<> {
        (0..self.bodies.len() as u32).map(BodyId)
    }

    /// The identifiers of all nodes.
    pub fn node_ids(&self) -> impl ExactSizeIterator<Item = NodeId> + use<> {
        (0..self.nodes.len() as u32).map(NodeId)
    }

    /// The body of that name. O(log n); do it before stepping.
    #[must_use]
    pub fn body(&self, name: &str) -> Option<BodyId> {
        self.body_index.get(name).copied()
    }

    /// The node of that name. O(log n); do it before stepping.
    #[must_use]
    pub fn node(&self, name: &str) -> Option<NodeId> {
        self.node_index.get(name).copied()
    }

    /// The places in β of the hinge that carries the body of that name.
    #[must_use]
    pub fn hinge(&self, body: &str) -> Option<Range<usize>> {
        self.body(body).map(|b| self.get(b).v())
    }

    /// Another inertia for a body, about its origin, body axes: propellant was spent, a sample taken.
    pub fn set_inertia(&mut self, body: BodyId, inertia: RigidInertia) {
        let body = &mut self.bodies[body.index()];
        body.inertia = inertia;
        (body.mass.mass, body.mass.com) = (inertia.mass(), inertia.com());
        body.mass.inertia_com = inertia.inertia_com();
    }

    /// A body by identifier.
    #[must_use]
    pub fn get(&self, body: BodyId) -> &Body {
        &self.bodies[body.index()]
    }

    /// A node by identifier.
    #[must_use]
    pub fn get_node(&self, node: NodeId) -> &Node {
        &self.nodes[node.index()]
    }

    /// Numbers in q.
    #[must_use]
    pub fn nq(&self) -> usize {
        self.nq
    }

    /// Degrees of freedom: numbers in β.
    #[must_use]
    pub fn nv(&self) -> usize {
        self.nv
    }

    /// The body itself, its parent, and so on to the body that hangs on the world.
    pub fn ancestors(&self, body: BodyId) -> impl Iterator<Item = BodyId> + '_ {
        std::iter::successors(Some(body), |b| self.get(*b).parent)
    }

    /// The body and everything outboard of it: a contiguous piece of the canonical order.
    pub fn subtree(&self, body: BodyId) -> impl ExactSizeIterator<Item = BodyId> + use<> {
        (body.0..self.get(body).subtree_end).map(BodyId)
    }

    /// True when `a` is on the path from the world to `b`, both ends included. O(1).
    #[must_use]
    pub fn on_path(&self, a: BodyId, b: BodyId) -> bool {
        a <= b && b.0 < self.get(a).subtree_end
    }

    /// Every subhinge of every body in order, with its body.
    pub fn subhinges(&self) -> impl Iterator<Item = (BodyId, &SubhingeRange)> {
        self.bodies
            .iter()
            .enumerate()
            .flat_map(|(i, b)| b.subhinges.iter().map(move |s| (BodyId(i as u32), s)))
    }

    /// One flag per degree of freedom: `true` where the motion is prescribed.
    #[must_use]
    pub fn prescribed(&self) -> Vec<bool> {
        let mut mask = vec![false; self.nv];
        for (_, s) in self.subhinges() {
            mask[s.v.clone()].fill(s.subhinge.coordinate == Coordinate::Prescribed);
        }
        mask
    }

    /// The same mechanism with all subhinges of one body free or prescribed.
    #[must_use]
    pub fn with_coordinate(mut self, body: BodyId, coordinate: Coordinate) -> Self {
        for s in &mut self.bodies[body.index()].subhinges {
            if !s.v.is_empty() {
                s.subhinge.coordinate = coordinate;
            }
        }
        self
    }

    /// Sum of all masses, kg.
    #[must_use]
    pub fn total_mass(&self) -> f64 {
        let of = |b: &Body| b.inertia.mass() + b.modes.as_ref().map_or(0.0, Modes::mass);
        self.bodies.iter().map(of).sum()
    }

    /// True when some body bends.
    #[must_use]
    pub fn is_flexible(&self) -> bool {
        self.bodies.iter().any(|b| b.modes.is_some())
    }
}

impl Multibody {
    /// A body as its author would describe it.
    #[must_use]
    pub fn spec(&self, body: BodyId) -> BodySpec {
        let b = self.get(body);
        let parent = b.parent().map_or("world", |p| self.get(p).name());
        let hinge = Hinge { subhinges: b.subhinges().iter().map(|s| s.subhinge).collect() };
        BodySpec {
            name: b.name().into(),
            parent: parent.into(),
            hinge_in_parent: b.hinge_in_parent(),
            hinge_in_body: b.hinge_in_body(),
            hinge,
            mass: *b.mass_properties(),
            modes: b.modes.clone(),
        }
    }

    /// `X_WB` of every body in canonical order at a configuration, without a workspace: for set-up.
    /// O(bodies), allocates.
    #[must_use]
    pub fn body_poses(&self, q: &[f64]) -> Vec<Pose> {
        let mut poses: Vec<Pose> = Vec::with_capacity(self.bodies().len());
        for b in self.bodies() {
            let mut X = b.parent().map_or_else(Pose::identity, |p| poses[p.index()]);
            X = X * self.carried(b.parent(), &b.hinge_in_parent(), q);
            for s in b.subhinges() {
                X = X * s.subhinge.kind.pose(&q[s.q.clone()]);
            }
            poses.push(X * b.hinge_in_body().inverse());
        }
        poses
    }

    /// Where a frame that hangs on a body is in the body frame: where it was put, but for deflection.
    fn carried(&self, on: Option<BodyId>, X: &Pose, q: &[f64]) -> Pose {
        let body = on.map(|b| self.get(b));
        let modes = body.and_then(|b| b.modes.as_ref().map(|m| (m, &q[b.modes_q.clone()])));
        modes.map_or(*X, |(m, eta)| m.carried(X, eta))
    }
}
