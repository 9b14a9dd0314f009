//! The immutable mechanism and its queries.

use crate::constraint::{ConstraintId, Coupled, Loop};
use crate::modes::Modes;
use crate::{BodyId, BodySpec, Coordinate, Hinge, NodeId, Subhinge, SubhingeKind};
use linkwork_spatial::{MassProperties, Pose, RigidInertia};
use serde::Serialize;
use std::collections::BTreeMap;
use std::ops::Range;

/// A subhinge and its ranges in q and β.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SubhingeRange {
    /// The subhinge; its axis has unit length.
    pub subhinge: Subhinge,
    /// Range in q.
    pub q: Range<usize>,
    /// Range in β (and in forces and accelerations).
    pub v: Range<usize>,
}

/// A body of a mechanism.
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
    /// Returns the name.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Returns the parent body; `None` for the world.
    #[must_use]
    pub fn parent(&self) -> Option<BodyId> {
        self.parent
    }

    /// Returns `X_PJ`: the hinge frame in the parent body.
    #[must_use]
    pub fn hinge_in_parent(&self) -> Pose {
        self.hinge_in_parent
    }

    /// Returns `X_BJ`: the hinge frame in this body.
    #[must_use]
    pub fn hinge_in_body(&self) -> Pose {
        self.hinge_in_body
    }

    /// Returns the modes; `None` for a rigid body.
    #[must_use]
    pub fn modes(&self) -> Option<&Modes> {
        self.modes.as_ref()
    }

    /// Returns the range of the modal coordinates in q, directly after the hinge's; empty for a rigid body.
    #[must_use]
    pub fn modes_q(&self) -> Range<usize> {
        self.modes_q.clone()
    }

    /// Returns the range of the modal rates in β, directly after the hinge's; empty for a rigid body.
    #[must_use]
    pub fn modes_v(&self) -> Range<usize> {
        self.modes_v.clone()
    }

    /// Returns the inertia about the body origin, in body axes. For a flexible body: of the rigid part only.
    #[must_use]
    pub fn inertia(&self) -> &RigidInertia {
        &self.inertia
    }

    /// Returns the mass properties as given: about the centre of mass, in body axes. For a flexible body: of the rigid part only.
    #[must_use]
    pub fn mass_properties(&self) -> &MassProperties {
        &self.mass
    }

    /// Returns the subhinges with their ranges in q and β, parent's side first.
    #[must_use]
    pub fn subhinges(&self) -> &[SubhingeRange] {
        &self.subhinges
    }

    /// Returns whether the hinge permits any motion and dynamics computes all of it.
    #[must_use]
    pub fn is_free(&self) -> bool {
        let free = |s: &SubhingeRange| {
            s.subhinge.kind == SubhingeKind::Free && s.subhinge.coordinate == Coordinate::Free
        };
        self.subhinges.iter().any(free)
    }

    /// Returns the range of the hinge in q.
    #[must_use]
    pub fn q(&self) -> Range<usize> {
        self.q.clone()
    }

    /// Returns the range of the hinge in β.
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
    /// Returns the name.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Returns the body that carries the node.
    #[must_use]
    pub fn body(&self) -> BodyId {
        self.body
    }

    /// Returns `X_BN`: the node frame in the body.
    #[must_use]
    pub fn pose(&self) -> Pose {
        self.pose
    }
}

/// The parts of a mechanism, in canonical order.
pub(crate) struct Parts {
    pub bodies: Vec<Body>,
    pub index: BTreeMap<String, BodyId>,
    pub nodes: Vec<Node>,
    pub node_index: BTreeMap<String, NodeId>,
    pub loops: Vec<Loop>,
    pub couplings: Vec<Coupled>,
}

/// A mechanism: bodies, hinges, nodes, constraints. Its structure never changes.
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

    /// Returns the hinges that close loops, by name.
    #[must_use]
    pub fn loops(&self) -> &[Loop] {
        &self.loops
    }

    /// Returns the relations between coordinates, by name.
    #[must_use]
    pub fn couplings(&self) -> &[Coupled] {
        &self.couplings
    }

    /// Returns all constraints: first the loops, then the couplings, each sorted by name.
    pub fn constraints(&self) -> impl Iterator<Item = ConstraintId> + use<> {
        let loops = (0..self.loops.len() as u32).map(ConstraintId::Loop);
        loops.chain((0..self.couplings.len() as u32).map(ConstraintId::Coupling))
    }

    /// Returns the number of scalar equations of a constraint.
    #[must_use]
    pub fn rows(&self, constraint: ConstraintId) -> usize {
        match constraint {
            ConstraintId::Loop(i) => self.loops[i as usize].rows.len(),
            ConstraintId::Coupling(_) => 1,
        }
    }

    /// Returns the name of a constraint.
    #[must_use]
    pub fn constraint_name(&self, constraint: ConstraintId) -> &str {
        match constraint {
            ConstraintId::Loop(i) => &self.loops[i as usize].closure.name,
            ConstraintId::Coupling(i) => &self.couplings[i as usize].coupling.name,
        }
    }

    /// Returns the constraint with this name; a loop has priority over a coupling.
    #[must_use]
    pub fn constraint(&self, name: &str) -> Option<ConstraintId> {
        self.constraints().find(|c| self.constraint_name(*c) == name)
    }

    /// Returns the number of loop motions that the caller gives: prescribed subhinges of all loops, and gaps of their rows.
    #[must_use]
    pub fn motions(&self) -> usize {
        self.motions
    }

    /// Returns all bodies in canonical order: depth first, parents first, siblings by name.
    #[must_use]
    pub fn bodies(&self) -> &[Body] {
        &self.bodies
    }

    /// Returns all nodes, by body, then by name.
    #[must_use]
    pub fn nodes(&self) -> &[Node] {
        &self.nodes
    }

    /// Returns the identifiers of all bodies, in canonical order.
    pub fn body_ids(&self) -> impl ExactSizeIterator<Item = BodyId> + use<> {
        (0..self.bodies.len() as u32).map(BodyId)
    }

    /// Returns the identifiers of all nodes.
    pub fn node_ids(&self) -> impl ExactSizeIterator<Item = NodeId> + use<> {
        (0..self.nodes.len() as u32).map(NodeId)
    }

    /// Returns the body with this name. O(log n); look it up before stepping.
    #[must_use]
    pub fn body(&self, name: &str) -> Option<BodyId> {
        self.body_index.get(name).copied()
    }

    /// Returns the node with this name. O(log n); look it up before stepping.
    #[must_use]
    pub fn node(&self, name: &str) -> Option<NodeId> {
        self.node_index.get(name).copied()
    }

    /// Returns the range in β of the hinge of the body with this name.
    #[must_use]
    pub fn hinge(&self, body: &str) -> Option<Range<usize>> {
        self.body(body).map(|b| self.get(b).v())
    }

    /// Replaces the inertia of a body, about its origin, in body axes: for spent propellant or a collected sample.
    pub fn set_inertia(&mut self, body: BodyId, inertia: RigidInertia) {
        let body = &mut self.bodies[body.index()];
        body.inertia = inertia;
        (body.mass.mass, body.mass.com) = (inertia.mass(), inertia.com());
        body.mass.inertia_com = inertia.inertia_com();
    }

    /// Returns a body.
    #[must_use]
    pub fn get(&self, body: BodyId) -> &Body {
        &self.bodies[body.index()]
    }

    /// Returns a node.
    #[must_use]
    pub fn get_node(&self, node: NodeId) -> &Node {
        &self.nodes[node.index()]
    }

    /// Returns the number of elements in q.
    #[must_use]
    pub fn nq(&self) -> usize {
        self.nq
    }

    /// Returns the number of degrees of freedom: elements in β.
    #[must_use]
    pub fn nv(&self) -> usize {
        self.nv
    }

    /// Iterates from the body itself over its parent and so on, up to the body that is attached to the world.
    pub fn ancestors(&self, body: BodyId) -> impl Iterator<Item = BodyId> + '_ {
        std::iter::successors(Some(body), |b| self.get(*b).parent)
    }

    /// Iterates over the body and all bodies outboard of it, which are contiguous in canonical order.
    pub fn subtree(&self, body: BodyId) -> impl ExactSizeIterator<Item = BodyId> + use<> {
        (body.0..self.get(body).subtree_end).map(BodyId)
    }

    /// Returns whether `a` is on the path from the world to `b`, both ends included. O(1).
    #[must_use]
    pub fn on_path(&self, a: BodyId, b: BodyId) -> bool {
        a <= b && b.0 < self.get(a).subtree_end
    }

    /// Iterates over every subhinge of every body in order, with its body.
    pub fn subhinges(&self) -> impl Iterator<Item = (BodyId, &SubhingeRange)> {
        self.bodies
            .iter()
            .enumerate()
            .flat_map(|(i, b)| b.subhinges.iter().map(move |s| (BodyId(i as u32), s)))
    }

    /// Returns one flag per degree of freedom: `true` if its motion is prescribed.
    #[must_use]
    pub fn prescribed(&self) -> Vec<bool> {
        let mut mask = vec![false; self.nv];
        for (_, s) in self.subhinges() {
            mask[s.v.clone()].fill(s.subhinge.coordinate == Coordinate::Prescribed);
        }
        mask
    }

    /// Returns the mechanism with all subhinges of one body free or prescribed.
    #[must_use]
    pub fn with_coordinate(mut self, body: BodyId, coordinate: Coordinate) -> Self {
        for s in &mut self.bodies[body.index()].subhinges {
            if !s.v.is_empty() {
                s.subhinge.coordinate = coordinate;
            }
        }
        self
    }

    /// Returns the total mass, kg.
    #[must_use]
    pub fn total_mass(&self) -> f64 {
        let of = |b: &Body| b.inertia.mass() + b.modes.as_ref().map_or(0.0, Modes::mass);
        self.bodies.iter().map(of).sum()
    }

    /// Returns whether any body is flexible.
    #[must_use]
    pub fn is_flexible(&self) -> bool {
        self.bodies.iter().any(|b| b.modes.is_some())
    }
}

impl Multibody {
    /// Returns the description of a body, as for a [`Builder`](crate::Builder).
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

    /// Computes `X_WB` of every body in canonical order at a configuration, without a workspace. For set-up: O(bodies), allocates.
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

    /// Returns the pose in the body frame of a frame that is attached to a body, including deflection.
    fn carried(&self, on: Option<BodyId>, X: &Pose, q: &[f64]) -> Pose {
        let body = on.map(|b| self.get(b));
        let modes = body.and_then(|b| b.modes.as_ref().map(|m| (m, &q[b.modes_q.clone()])));
        modes.map_or(*X, |(m, eta)| m.carried(X, eta))
    }
}
