//! Builder: takes parts in any order and makes a mechanism in canonical order.

use crate::checks::{check_hinge, check_loop_hinge, check_names, check_numbers};
use crate::constraint::{Anchor, Coupled, Loop, rows};
use crate::error::{BuildError, MechanismFault};
use crate::mechanism::{Body, Multibody, Node, Parts, SubhingeRange};
use crate::modes::Modes;
use crate::{
    BodyId, Coordinate, Coupling, Hinge, HingeCoordinate, LoopClosure, NodeId, SubhingeKind, Term,
};
use linkwork_names::nearest;
use linkwork_spatial::{MassProperties, Pose, RigidInertia};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};

/// Description of a body.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BodySpec {
    /// Name, any string; by convention a path such as `Rover.Wheels.Wheel1/wheel`.
    pub name: String,
    /// `world`, or the name of the parent body.
    pub parent: String,
    /// `X_PJ`: the hinge frame in the parent body.
    #[serde(default)]
    pub hinge_in_parent: Pose,
    /// `X_BJ`: the hinge frame in this body.
    #[serde(default)]
    pub hinge_in_body: Pose,
    /// Hinge to the parent: the motion that it allows.
    #[serde(default)]
    pub hinge: Hinge,
    /// Mass properties in body axes.
    #[serde(default)]
    pub mass: MassProperties,
    /// Modes of a flexible body. If given, `mass` is only the part that does not bend: rigid mass fixed to the body frame.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub modes: Option<Modes>,
}

impl BodySpec {
    /// Returns a massless body welded to its parent's frame. The other methods change these defaults.
    #[must_use]
    pub fn new(name: impl Into<String>, parent: impl Into<String>) -> Self {
        Self {
            name: name.into(),
            parent: parent.into(),
            hinge_in_parent: Pose::identity(),
            hinge_in_body: Pose::identity(),
            hinge: Hinge::locked(),
            mass: MassProperties::massless(),
            modes: None,
        }
    }

    /// Sets the hinge frame on the parent (`X_PJ`).
    #[must_use]
    pub fn hinge_in_parent(mut self, X_PJ: Pose) -> Self {
        self.hinge_in_parent = X_PJ;
        self
    }

    /// Sets the hinge frame on this body (`X_BJ`).
    #[must_use]
    pub fn hinge_in_body(mut self, X_BJ: Pose) -> Self {
        self.hinge_in_body = X_BJ;
        self
    }

    /// Sets the hinge.
    #[must_use]
    pub fn hinge(mut self, hinge: Hinge) -> Self {
        self.hinge = hinge;
        self
    }

    /// Sets the mass properties, in body axes.
    #[must_use]
    pub fn mass(mut self, mass: MassProperties) -> Self {
        self.mass = mass;
        self
    }

    /// Sets the modes, which makes the body flexible.
    #[must_use]
    pub fn modes(mut self, modes: Modes) -> Self {
        self.modes = Some(modes);
        self
    }
}

/// Description of a node: a named frame on a body, where forces act and sensors are mounted.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NodeSpec {
    /// Its name.
    pub name: String,
    /// The body that carries it.
    pub body: String,
    /// `X_BN`: the node frame in the body.
    #[serde(default)]
    pub pose: Pose,
}

/// Collects parts; [`Builder::build`] makes the mechanism.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Builder {
    bodies: Vec<BodySpec>,
    nodes: Vec<NodeSpec>,
    #[serde(default)]
    loops: Vec<LoopClosure>,
    #[serde(default)]
    couplings: Vec<Coupling>,
    /// Names of the loops with gaps.
    #[serde(default, skip_serializing_if = "BTreeSet::is_empty")]
    gaps: BTreeSet<String>,
}

impl Builder {
    /// Returns a builder without parts.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a body; its parent may come later.
    pub fn body(&mut self, body: BodySpec) -> &mut Self {
        self.bodies.push(body);
        self
    }

    /// Adds a node at `X_BN` on a body, which may come later.
    pub fn node(
        &mut self,
        name: impl Into<String>,
        body: impl Into<String>,
        X_BN: Pose,
    ) -> &mut Self {
        self.nodes.push(NodeSpec { name: name.into(), body: body.into(), pose: X_BN });
        self
    }

    /// Adds a hinge that closes a loop; its bodies may come later.
    pub fn loop_closure(&mut self, closure: LoopClosure) -> &mut Self {
        self.loops.push(closure);
        self
    }

    /// Gives each equation of a loop a gap: a loop motion that sets the offset between the two ends, rad or m. An unknown loop name is ignored.
    pub fn gaps(&mut self, name: impl Into<String>) -> &mut Self {
        self.gaps.insert(name.into());
        self
    }

    /// Adds a relation between coordinates, whose bodies may come later.
    pub fn coupling(&mut self, coupling: Coupling) -> &mut Self {
        self.couplings.push(coupling);
        self
    }

    /// Returns the loop closures in the order they were added.
    #[must_use]
    pub fn loops(&self) -> &[LoopClosure] {
        &self.loops
    }

    /// Returns mutable access to the loop closures.
    pub fn loops_mut(&mut self) -> &mut Vec<LoopClosure> {
        &mut self.loops
    }

    /// Returns the couplings in the order they were added.
    #[must_use]
    pub fn couplings(&self) -> &[Coupling] {
        &self.couplings
    }

    /// Returns mutable access to the couplings.
    pub fn couplings_mut(&mut self) -> &mut Vec<Coupling> {
        &mut self.couplings
    }

    /// Returns the bodies in the order they were added.
    #[must_use]
    pub fn bodies(&self) -> &[BodySpec] {
        &self.bodies
    }

    /// Returns mutable access to the bodies.
    pub fn bodies_mut(&mut self) -> &mut Vec<BodySpec> {
        &mut self.bodies
    }

    /// Returns the nodes in the order they were added.
    #[must_use]
    pub fn nodes(&self) -> &[NodeSpec] {
        &self.nodes
    }

    /// Returns mutable access to the nodes.
    pub fn nodes_mut(&mut self) -> &mut Vec<NodeSpec> {
        &mut self.nodes
    }

    /// Builds the mechanism in canonical order. O(n log n).
    ///
    /// # Errors
    /// All [`MechanismFault`]s of all parts.
    pub fn build(&self) -> Result<Multibody, BuildError> {
        let mut faults = Vec::new();
        let names: BTreeMap<&str, usize> =
            self.bodies.iter().enumerate().map(|(i, b)| (b.name.as_str(), i)).collect();
        check_names("body", self.bodies.iter().map(|b| b.name.as_str()), &mut faults);
        check_names("node", self.nodes.iter().map(|n| n.name.as_str()), &mut faults);
        let mut inertias = Vec::with_capacity(self.bodies.len());
        for b in &self.bodies {
            if b.parent != "world" && !names.contains_key(b.parent.as_str()) {
                faults.push(MechanismFault::UnknownParent {
                    body: b.name.clone(),
                    parent: b.parent.clone(),
                    suggestion: nearest(&b.parent, names.keys().copied().chain(["world"]))
                        .map(str::to_owned),
                });
            }
            check_numbers(b, &mut faults);
            inertias.push(b.mass.validate().unwrap_or_else(|error| {
                faults.push(MechanismFault::Inertia { body: b.name.clone(), error });
                RigidInertia::zero()
            }));
        }
        for n in &self.nodes {
            if !names.contains_key(n.body.as_str()) {
                faults.push(MechanismFault::UnknownBody {
                    node: n.name.clone(),
                    body: n.body.clone(),
                    suggestion: nearest(&n.body, names.keys().copied()).map(str::to_owned),
                });
            }
            if !n.pose.is_finite() {
                faults
                    .push(MechanismFault::NotFinite { place: format!("node `{}`, pose", n.name) });
            }
        }
        self.check_modes(&names, &mut faults);
        self.check_cycles(&names, &mut faults);
        self.check_constraints(&names, &mut faults);
        if faults.is_empty() { Ok(self.order(&inertias)) } else { Err(BuildError { faults }) }
    }

    fn check_constraints(&self, names: &BTreeMap<&str, usize>, faults: &mut Vec<MechanismFault>) {
        check_names("loop", self.loops.iter().map(|l| l.name.as_str()), faults);
        check_names("coupling", self.couplings.iter().map(|c| c.name.as_str()), faults);
        let mut unknown = |what: String, body: &str, world: Option<&'static str>| {
            let found = names.contains_key(body) || world == Some(body);
            if !found {
                let suggestion =
                    nearest(body, names.keys().copied().chain(world)).map(str::to_owned);
                faults.push(MechanismFault::UnknownEnd { what, body: body.into(), suggestion });
            }
            found
        };
        let mut more = Vec::new();
        for l in &self.loops {
            let what = || format!("loop `{}`", l.name);
            unknown(what(), &l.body_a, Some("world"));
            unknown(what(), &l.body_b, Some("world"));
            if l.body_a == l.body_b {
                more.push(MechanismFault::LoopOnItself {
                    name: l.name.clone(),
                    body: l.body_a.clone(),
                });
            }
            for (X, end) in [(&l.frame_a, 'a'), (&l.frame_b, 'b')] {
                if !X.is_finite() {
                    more.push(MechanismFault::NotFinite {
                        place: format!("{}, frame {end}", what()),
                    });
                }
            }
            let before = more.len();
            check_hinge(&what(), &l.hinge, &mut more);
            check_loop_hinge(&what(), &l.hinge, &mut more);
            if more.len() == before {
                let hinge = normalised_hinge(&l.hinge);
                if let Err(error) = rows(&hinge, 0) {
                    more.push(MechanismFault::Loop { name: l.name.clone(), error });
                }
            }
        }
        for c in &self.couplings {
            let what = || format!("coupling `{}`", c.name);
            let higher = || c.powers.iter().flat_map(|p| p.factors);
            let finite = c.terms.iter().map(|t| t.factor).chain(higher()).all(f64::is_finite)
                && c.constant.is_finite();
            if !finite {
                more.push(MechanismFault::NotFinite { place: format!("{}, its factors", what()) });
            }
            if finite && c.terms.iter().map(|t| t.factor).chain(higher()).all(|x| x == 0.0) {
                more.push(MechanismFault::EmptyCoupling { name: c.name.clone() });
            }
            for (i, p) in c.powers.iter().enumerate() {
                let HingeCoordinate { body, subhinge } = p.coordinate.clone();
                let name = c.name.clone();
                if !c.terms.iter().any(|t| t.coordinate == p.coordinate) {
                    more.push(MechanismFault::PowersWithoutTerm { name, body, subhinge });
                } else if c.powers[..i].iter().any(|o| o.coordinate == p.coordinate) {
                    more.push(MechanismFault::CoordinateTwice { name, body, subhinge });
                }
            }
            for (i, t) in c.terms.iter().enumerate() {
                let at = &t.coordinate;
                if !unknown(what(), &at.body, None) {
                    continue;
                }
                let hinge = &self.bodies[names[at.body.as_str()]].hinge.subhinges;
                if hinge.get(at.subhinge).is_none_or(|s| s.kind.nv() != 1) {
                    let (body, subhinge) = (at.body.clone(), at.subhinge);
                    more.push(MechanismFault::NoCoordinate {
                        name: c.name.clone(),
                        body,
                        subhinge,
                    });
                }
                if c.terms[..i].iter().any(|o| o.coordinate == *at) {
                    let (body, subhinge) = (at.body.clone(), at.subhinge);
                    more.push(MechanismFault::CoordinateTwice {
                        name: c.name.clone(),
                        body,
                        subhinge,
                    });
                }
            }
        }
        faults.append(&mut more);
    }

    /// Reports each cycle of bodies once, starting at the body whose name is first.
    fn check_cycles(&self, names: &BTreeMap<&str, usize>, faults: &mut Vec<MechanismFault>) {
        // Each entry is the number of the walk that first visited the body, or 0.
        let mut walk = vec![0; self.bodies.len()];
        for (n, &start) in names.values().enumerate() {
            let (mut path, mut at) = (Vec::new(), Some(start));
            while let Some(i) = at.filter(|&i| walk[i] == 0) {
                walk[i] = n + 1;
                path.push(i);
                let parent = self.bodies[i].parent.as_str();
                at = names.get(parent).copied().filter(|_| parent != "world");
            }
            // A walk that meets its own path has found a cycle. If it meets the path of another walk, the cycle was already reported.
            if let Some(first) = at.and_then(|i| path.iter().position(|&j| j == i)) {
                let ring = path[first..].iter().chain([&path[first]]);
                faults.push(MechanismFault::Cycle {
                    path: ring.map(|&i| self.bodies[i].name.clone()).collect(),
                });
            }
        }
    }

    /// Puts bodies in depth-first order, parents first and siblings by name; puts nodes in order of their bodies, then by name.
    fn order(&self, inertias: &[RigidInertia]) -> Multibody {
        let mut children: BTreeMap<&str, BTreeMap<&str, usize>> = BTreeMap::new();
        for (i, b) in self.bodies.iter().enumerate() {
            children.entry(&b.parent).or_default().insert(&b.name, i);
        }
        let mut stack: Vec<(usize, Option<BodyId>)> = Vec::new();
        let push = |stack: &mut Vec<_>, name: &str, parent| {
            stack.extend(
                children.get(name).into_iter().flat_map(|c| c.values().rev()).map(|&i| (i, parent)),
            );
        };
        push(&mut stack, "world", None);
        let mut bodies: Vec<Body> = Vec::with_capacity(self.bodies.len());
        let mut index = BTreeMap::new();
        let (mut nq, mut nv) = (0, 0);
        while let Some((i, parent)) = stack.pop() {
            let spec = &self.bodies[i];
            let id = BodyId(bodies.len() as u32);
            index.insert(spec.name.clone(), id);
            let (q0, v0) = (nq, nv);
            let mut subhinges = Vec::with_capacity(spec.hinge.subhinges.len());
            for s in &spec.hinge.subhinges {
                subhinges.push(SubhingeRange {
                    subhinge: normalised(*s),
                    q: nq..nq + s.kind.nq(),
                    v: nv..nv + s.kind.nv(),
                });
                nq += s.kind.nq();
                nv += s.kind.nv();
            }
            let (modes_q, modes_v) = (nq, nv);
            let modes = spec.modes.as_ref().map_or(0, Modes::count);
            (nq, nv) = (nq + modes, nv + modes);
            bodies.push(Body {
                name: spec.name.clone(),
                parent,
                hinge_in_parent: spec.hinge_in_parent,
                hinge_in_body: spec.hinge_in_body,
                mass: spec.mass,
                inertia: inertias[i],
                subhinges,
                q: q0..modes_q,
                v: v0..modes_v,
                modes: spec.modes.clone(),
                modes_q: modes_q..nq,
                modes_v: modes_v..nv,
                subtree_end: id.0 + 1,
            });
            push(&mut stack, &spec.name, Some(id));
        }
        for i in (0..bodies.len()).rev() {
            let end = bodies[i].subtree_end;
            if let Some(p) = bodies[i].parent {
                let p = &mut bodies[p.index()];
                p.subtree_end = p.subtree_end.max(end);
            }
        }
        let mut nodes: Vec<Node> = (self.nodes.iter())
            .map(|n| Node { name: n.name.clone(), body: index[&n.body], pose: n.pose })
            .collect();
        nodes.sort_by(|a, b| (a.body, &a.name).cmp(&(b.body, &b.name)));
        let node_index =
            nodes.iter().enumerate().map(|(i, n)| (n.name.clone(), NodeId(i as u32))).collect();
        let (loops, couplings, motions) = self.constraints(&bodies, &index);
        let parts = Parts { bodies, index, nodes, node_index, loops, couplings };
        Multibody::assemble(parts, nq, nv, motions)
    }

    /// Returns loops and couplings by name, and the number of prescribed subhinges and gaps of the loops.
    fn constraints(
        &self,
        bodies: &[Body],
        index: &BTreeMap<String, BodyId>,
    ) -> (Vec<Loop>, Vec<Coupled>, usize) {
        let mut closures: Vec<&LoopClosure> = self.loops.iter().collect();
        closures.sort_by(|a, b| a.name.cmp(&b.name));
        let (mut loops, mut motions) = (Vec::new(), 0);
        for l in closures {
            let hinge = normalised_hinge(&l.hinge);
            let Ok(rows) = rows(&hinge, motions) else { unreachable!("checked before") };
            let given = |s: &&crate::Subhinge| s.coordinate == Coordinate::Prescribed;
            let end = motions + hinge.subhinges.iter().filter(given).count();
            let gaps = if self.gaps.contains(&l.name) { end..end + rows.len() } else { end..end };
            let anchor = |body: &str, pose| Anchor { body: index.get(body).copied(), pose };
            loops.push(Loop {
                a: anchor(&l.body_a, l.frame_a),
                b: anchor(&l.body_b, l.frame_b),
                rows,
                motions: motions..end,
                gaps: gaps.clone(),
                closure: LoopClosure { hinge, ..l.clone() },
            });
            motions = gaps.end;
        }
        let place = |at: &HingeCoordinate| {
            let id = index[&at.body];
            let s = &bodies[id.index()].subhinges[at.subhinge];
            (id, s.q.start, s.v.start)
        };
        let mut couplings: Vec<Coupled> = (self.couplings.iter())
            .map(|c| {
                let higher = |t: &Term| {
                    let own = c.powers.iter().find(|p| p.coordinate == t.coordinate);
                    own.map_or([0.0; 3], |p| p.factors)
                };
                let used: Vec<&Term> =
                    (c.terms.iter()).filter(|t| t.factor != 0.0 || higher(t) != [0.0; 3]).collect();
                let places: Vec<_> =
                    used.iter().map(|t| (place(&t.coordinate), t.factor)).collect();
                let powers: Vec<[f64; 3]> = used.iter().map(|t| higher(t)).collect();
                let linear = powers.iter().all(|p| *p == [0.0; 3]);
                Coupled {
                    coupling: c.clone(),
                    powers: if linear { Vec::new() } else { powers },
                    terms: places.iter().map(|((_, q, v), c)| (*q, *v, *c)).collect(),
                    bodies: places.iter().map(|((b, ..), _)| *b).collect(),
                }
            })
            .collect();
        couplings.sort_by(|a, b| a.coupling.name.cmp(&b.coupling.name));
        (loops, couplings, motions)
    }
}

impl From<&Multibody> for Builder {
    /// Returns a builder with the same parts, so that you can change them and build again.
    fn from(mbs: &Multibody) -> Self {
        let mut builder = Builder::new();
        for b in mbs.body_ids() {
            builder.body(mbs.spec(b));
        }
        for n in mbs.nodes() {
            builder.node(n.name(), mbs.get(n.body()).name(), n.pose());
        }
        builder.loops.extend(mbs.loops().iter().map(|l| l.closure.clone()));
        let apart = mbs.loops().iter().filter(|l| !l.gaps.is_empty());
        builder.gaps.extend(apart.map(|l| l.closure.name.clone()));
        builder.couplings.extend(mbs.couplings().iter().map(|c| c.coupling.clone()));
        builder
    }
}

fn normalised_hinge(hinge: &Hinge) -> Hinge {
    Hinge { subhinges: hinge.subhinges.iter().map(|s| normalised(*s)).collect() }
}

fn normalised(mut s: crate::Subhinge) -> crate::Subhinge {
    if let SubhingeKind::Pin { axis }
    | SubhingeKind::Slider { axis }
    | SubhingeKind::Screw { axis, .. } = &mut s.kind
    {
        // Keep the digits of a unit vector, so that a mechanism that is taken apart and built again stays identical.
        if (axis.norm_squared() - 1.0).abs() > 8.0 * f64::EPSILON {
            *axis = axis.normalize();
        }
    }
    if s.kind == SubhingeKind::Locked {
        s.coordinate = Coordinate::Free;
    }
    s
}
