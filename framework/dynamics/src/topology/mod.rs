//! Topology changes at run time: bodies and whole mechanisms are added, deleted, detached and attached.
//!
//! An [`Edit`] holds a mechanism with its state. Each operation yields a new mechanism in which every body has the same pose and motion as before, as
//! far as its hinge permits. The part of the motion that the hinge does not permit is removed by an inelastic impact. A [`Report`] contains momentum
//! and energy before and after.
//! ```text
//! let mut edit = Edit::new(&mbs, &q, &v)?;
//! edit.detach("stage", "world")?;                                a free body from now on
//! let report = edit.attach("gripper", "rock", Hinge::locked(), &Placement::here())?;
//! let edited = edit.finish();                                    a mechanism, q, v, and what went where
//! ```
//! Each operation costs a rebuild, O(n log n), and a few sweeps. An operation that fails does not change the edit. Relative poses of bodies are
//! computed through their nearest common ancestor ([`Frames`]), so distance from the world's origin does not reduce accuracy.

mod carry;
mod error;
mod impact;
mod joint;
mod reverse;
mod scene;

pub use carry::{Carried, carry};
pub use error::TopologyError;

use crate::frames::Frames;
use joint::Joint;
use linkwork_multibody::{
    BodyId, BodySpec, Coordinate, Hinge, Multibody, NodeSpec, Subhinge, SubhingeKind,
};
use linkwork_spatial::{Force, Motion, Pose, Vec3};
use scene::{Part, Parts, Scene, free_state};
use std::collections::BTreeSet;

/// Frames of a new hinge.
#[derive(Clone, Debug, PartialEq)]
pub enum Placement {
    /// The hinge is placed at the present pose of the body: its frame on the body is given, the frame on the other body follows.
    Here {
        /// `X_BJ`: the hinge frame in the attached body.
        hinge_in_body: Pose,
        /// Coordinates of the hinge at this moment (nq); `None` for neutral ones.
        q: Option<Vec<f64>>,
    },
    /// Both frames are given; the coordinates are computed, or an error is returned.
    Frames {
        /// `X_PJ`: the hinge frame in the parent body.
        hinge_in_parent: Pose,
        /// `X_BJ`: the hinge frame in the attached body.
        hinge_in_body: Pose,
    },
}

impl Placement {
    /// Uses the body's own frame as the hinge frame, with neutral coordinates at the present pose.
    #[must_use]
    pub fn here() -> Self {
        Self::Here { hinge_in_body: Pose::identity(), q: None }
    }
}

/// Momentum and energy of the whole scene before and after an operation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Report {
    /// The point of the world about which moments are computed, m: the origin of the edited body.
    pub point: Vec3,
    /// Momentum of all bodies before: angular about the point (kg m²/s), linear (kg m/s), world axes.
    pub momentum_before: Force,
    /// Momentum of all bodies after the operation, like `momentum_before`. It differs when mass is added or removed, and when the world takes part in
    /// an impact.
    pub momentum_after: Force,
    /// Impulse of the new hinge on the attached body and everything outboard of it: moment about the point (N m s), force (N s). The other side
    /// receives the opposite impulse.
    pub impulse: Force,
    /// Kinetic energy before, including rotors, J.
    pub energy_before: f64,
    /// Kinetic energy after, including rotors, J. The energy of the rotors (½ armature β²) of a detached hinge is lost.
    pub energy_after: f64,
}

/// Maps indices of a mechanism before an edit to indices after it; `None`: deleted, or the hinge is different.
#[derive(Clone, Debug, PartialEq)]
pub struct Places {
    /// Corresponding body of the other mechanism, for each body.
    pub bodies: Vec<Option<BodyId>>,
    /// For each entry of q.
    pub q: Vec<Option<usize>>,
    /// For each entry of β (also for forces and accelerations).
    pub v: Vec<Option<usize>>,
}

/// The result of an edit.
#[derive(Clone, Debug, PartialEq)]
pub struct Edited {
    /// The mechanism.
    pub multibody: Multibody,
    /// Its configuration.
    pub q: Vec<f64>,
    /// Its rates.
    pub v: Vec<f64>,
    /// Maps indices of the original mechanism to indices of this one.
    pub places: Places,
    /// Loops and couplings that were removed with deleted bodies or replaced hinges.
    pub dropped: Vec<String>,
}

/// A mechanism in motion whose structure can be changed. Bodies are identified by name; `world` is the world.
#[derive(Clone, Debug)]
pub struct Edit {
    scene: Scene,
    original: Multibody,
    /// Bodies whose hinge differs from the original.
    changed: BTreeSet<String>,
    /// Loops and couplings that were removed.
    dropped: Vec<String>,
}

impl Edit {
    /// Creates an edit of a mechanism with its state (nq, nv).
    ///
    /// # Errors
    /// [`TopologyError::Length`], [`TopologyError::NotFinite`], [`TopologyError::Flexible`].
    pub fn new(mbs: &Multibody, q: &[f64], v: &[f64]) -> Result<Self, TopologyError> {
        check_state("the mechanism", (q, mbs.nq()), (v, mbs.nv()))?;
        refuse_flexible(mbs)?;
        let scene = Scene { mbs: mbs.clone(), q: q.to_vec(), v: v.to_vec() };
        Ok(Self { scene, original: mbs.clone(), changed: BTreeSet::new(), dropped: Vec::new() })
    }

    /// Returns the present mechanism.
    #[must_use]
    pub fn multibody(&self) -> &Multibody {
        &self.scene.mbs
    }

    /// Returns its configuration.
    #[must_use]
    pub fn q(&self) -> &[f64] {
        &self.scene.q
    }

    /// Returns its rates.
    #[must_use]
    pub fn v(&self) -> &[f64] {
        &self.scene.v
    }

    /// Adds a body with the state of its hinge.
    ///
    /// # Errors
    /// [`TopologyError::NameClash`], [`TopologyError::Length`], [`TopologyError::NotFinite`],
    /// [`TopologyError::Flexible`], [`TopologyError::Build`].
    pub fn add(&mut self, body: BodySpec, q: &[f64], v: &[f64]) -> Result<Report, TopologyError> {
        let place = format!("body `{}`", body.name);
        check_state(&place, (q, body.hinge.nq()), (v, body.hinge.nv()))?;
        if body.modes.is_some() {
            return Err(TopologyError::Flexible { body: body.name });
        }
        let name = body.name.clone();
        self.refuse_clash("add a body", std::iter::once(name.as_str()), std::iter::empty())?;
        let mut parts = Parts::of(&self.scene);
        parts.bodies.push(Part { spec: body, q: q.to_vec(), v: v.to_vec() });
        self.commit(&parts, &name, &[&name])
    }

    /// Adds a whole mechanism with its state. `prefix` is put before its names. Its `world` is placed at `X_PW` on the body `onto`, and its state is
    /// relative to that.
    ///
    /// # Errors
    /// Like [`Edit::add`], and [`TopologyError::Unknown`].
    pub fn add_mechanism(
        &mut self,
        prefix: &str,
        mbs: &Multibody,
        state: (&[f64], &[f64]),
        onto: &str,
        X_PW: Pose,
    ) -> Result<Report, TopologyError> {
        const ACTION: &str = "add a mechanism";
        let (q, v) = state;
        check_state(&format!("mechanism `{prefix}`"), (q, mbs.nq()), (v, mbs.nv()))?;
        refuse_flexible(mbs)?;
        self.frame(onto, ACTION)?;
        let added = Parts::of(&Scene { mbs: mbs.clone(), q: q.to_vec(), v: v.to_vec() });
        let mut parts = Parts::of(&self.scene);
        let named = |name: &str| format!("{prefix}{name}");
        let names: Vec<String> = added.bodies.iter().map(|p| named(&p.spec.name)).collect();
        let nodes: Vec<String> = added.nodes.iter().map(|n| named(&n.name)).collect();
        let (bodies, marks) = (names.iter().map(String::as_str), nodes.iter().map(String::as_str));
        self.refuse_clash(ACTION, bodies, marks)?;
        for mut part in added.bodies {
            part.spec.name = named(&part.spec.name);
            if part.spec.parent == "world" {
                onto.clone_into(&mut part.spec.parent);
                part.spec.hinge_in_parent = X_PW * part.spec.hinge_in_parent;
            } else {
                part.spec.parent = named(&part.spec.parent);
            }
            parts.bodies.push(part);
        }
        parts.nodes.extend(added.nodes.into_iter().map(|n| NodeSpec {
            name: named(&n.name),
            body: named(&n.body),
            pose: n.pose,
        }));
        let about = names.first().cloned().unwrap_or_default();
        let moved = |body: &str| if body == "world" { onto.to_owned() } else { named(body) };
        for mut l in added.loops {
            if l.body_a == "world" {
                l.frame_a = X_PW * l.frame_a;
            }
            if l.body_b == "world" {
                l.frame_b = X_PW * l.frame_b;
            }
            (l.name, l.body_a, l.body_b) = (named(&l.name), moved(&l.body_a), moved(&l.body_b));
            parts.loops.push(l);
        }
        for mut c in added.couplings {
            c.name = named(&c.name);
            let terms = c.terms.iter_mut().map(|t| &mut t.coordinate);
            let powers = c.powers.iter_mut().map(|p| &mut p.coordinate);
            terms.chain(powers).for_each(|at| at.body = named(&at.body));
            parts.couplings.push(c);
        }
        self.commit(&parts, &about, &names.iter().map(String::as_str).collect::<Vec<_>>())
    }

    /// Deletes a body with everything that hangs on it, including nodes. Their momentum is removed.
    ///
    /// # Errors
    /// [`TopologyError::Unknown`].
    pub fn delete(&mut self, body: &str) -> Result<Report, TopologyError> {
        let id = self.body(body, "delete")?;
        let gone: Vec<String> = self.names(self.scene.mbs.subtree(id));
        let mut parts = Parts::of(&self.scene);
        parts.bodies.retain(|p| !gone.contains(&p.spec.name));
        parts.nodes.retain(|n| !gone.contains(&n.body));
        let mut dropped = parts.open_loops(&gone);
        dropped.extend(gone.iter().flat_map(|b| parts.uncouple(b)));
        let lost: Vec<&str> = gone.iter().map(String::as_str).collect();
        let report = self.commit(&parts, body, &lost)?;
        self.dropped.extend(dropped);
        Ok(report)
    }

    /// Puts a body with its subtree on a free hinge on `base`. Pose and motion of all bodies are unchanged. Rotors of the old hinge are removed.
    ///
    /// # Errors
    /// [`TopologyError::Unknown`], [`TopologyError::OwnSubtree`].
    pub fn detach(&mut self, body: &str, base: &str) -> Result<Report, TopologyError> {
        self.check_base(body, base, "detach")?;
        let mut parts = Parts::of(&self.scene);
        self.set_free(&mut parts, body, base, Coordinate::Free)?;
        let dropped = parts.uncouple(body);
        let report = self.commit(&parts, body, &[body])?;
        self.dropped.extend(dropped);
        Ok(report)
    }

    /// Makes a body the root of the free tree to which it belongs: it gets the free hinge, and the hinges between it and the old root are reversed
    /// (coordinates of pins, sliders and screws are unchanged). Pose and motion of every body are unchanged.
    ///
    /// # Errors
    /// [`TopologyError::NotFree`] if the root of its tree has another hinge,
    /// [`TopologyError::Unknown`].
    pub fn reroot(&mut self, body: &str) -> Result<Report, TopologyError> {
        let id = self.body(body, "reroot")?;
        let mbs = &self.scene.mbs;
        let is_free = |b: &BodyId| {
            let mut kinds = mbs.get(*b).subhinges().iter().map(|s| s.subhinge.kind);
            kinds.next() == Some(SubhingeKind::Free) && kinds.next().is_none()
        };
        let mut path: Vec<BodyId> = Vec::new();
        for b in mbs.ancestors(id) {
            path.push(b);
            if is_free(&b) {
                break;
            }
        }
        let Some(root) = path.last().copied().filter(is_free) else {
            let root = path.last().map_or("", |b| mbs.get(*b).name()).to_owned();
            return Err(TopologyError::NotFree { body: body.to_owned(), root });
        };
        path.reverse();
        let base = mbs.get(root).parent().map_or("world", |p| mbs.get(p).name()).to_owned();
        let coordinate = mbs.get(root).subhinges()[0].subhinge.coordinate;
        let path = self.names(path.into_iter());
        let mut parts = Parts::of(&self.scene);
        if path.len() > 1 {
            let turned = |c: &&linkwork_multibody::Coupling| {
                c.terms.iter().any(|t| path.contains(&t.coordinate.body))
            };
            if let Some(c) = parts.couplings.iter().find(turned) {
                return Err(TopologyError::Constrained {
                    action: "reroot",
                    body: body.to_owned(),
                    constraint: format!("coupling `{}` of a hinge that would be reversed", c.name),
                });
            }
            reverse::turn_path(&mut parts, &path);
            self.set_free(&mut parts, body, &base, coordinate)?;
        }
        let turned: Vec<&str> = path.iter().map(String::as_str).collect();
        self.commit(&parts, body, if turned.len() > 1 { &turned } else { &[] })
    }

    /// Puts a body with its subtree on a new hinge on `onto` at its present pose; its old hinge is removed. Rates that the new hinge does not permit
    /// vanish in an inelastic impact, in which all free coordinates of the mechanism take part. Prescribed coordinates of the new hinge get the
    /// nearest rate (least squares over rad/s and m/s); all other prescribed coordinates keep their rates.
    ///
    /// # Errors
    /// [`TopologyError::Unknown`], [`TopologyError::OwnSubtree`], [`TopologyError::Unreachable`],
    /// [`TopologyError::Length`], [`TopologyError::Build`], [`TopologyError::Dynamics`];
    /// [`TopologyError::Constrained`] when loops or couplings would take part in the impact.
    pub fn attach(
        &mut self,
        body: &str,
        onto: &str,
        hinge: Hinge,
        placement: &Placement,
    ) -> Result<Report, TopologyError> {
        self.check_base(body, onto, "attach")?;
        let (X_PB, V_PB) = self.seen(onto, body)?;
        let mut parts = Parts::of(&self.scene);
        let Some(part) = parts.find(body) else { unreachable!("checked above") };
        onto.clone_into(&mut part.spec.parent);
        part.spec.hinge = hinge;
        match placement {
            Placement::Here { hinge_in_body, q } => {
                part.spec.hinge_in_parent = Pose::identity();
                part.spec.hinge_in_body = *hinge_in_body;
                let joint = Joint::new(&part.spec)?;
                let q = q.clone().unwrap_or_else(|| joint.neutral());
                let want = part.spec.hinge.nq();
                check_state(&format!("hinge of `{body}`"), (&q, want), (&[], 0))?;
                // X_PB = X_PJ · (pose at q with X_PJ = 1).
                part.spec.hinge_in_parent = X_PB * joint.pose(&q).inverse();
                part.q = q;
            }
            Placement::Frames { hinge_in_parent, hinge_in_body } => {
                part.spec.hinge_in_parent = *hinge_in_parent;
                part.spec.hinge_in_body = *hinge_in_body;
                part.q = Joint::new(&part.spec)?.solve(&X_PB, body)?;
            }
        }
        part.v = Joint::new(&part.spec)?.rates(&part.q, &V_PB);
        let dropped = parts.uncouple(body);
        let mut after = parts.assemble()?;
        let impact = impact::take_hold(&self.scene, &mut after)?;
        if let (true, Some(c)) = (impact, after.mbs.constraints().next()) {
            return Err(TopologyError::Constrained {
                action: "attach with an impact",
                body: body.to_owned(),
                constraint: format!("constraint `{}`", after.mbs.constraint_name(c)),
            });
        }
        self.dropped.extend(dropped);
        Ok(self.accept(after, body, Some(body), &[body]))
    }

    /// Performs [`Edit::reroot`] and [`Edit::attach`]: attaches a body by a new hinge together with the *whole* free tree to which it belongs,
    /// regardless of its structure.
    ///
    /// # Errors
    /// The errors of both.
    pub fn attach_tree(
        &mut self,
        body: &str,
        onto: &str,
        hinge: Hinge,
        placement: &Placement,
    ) -> Result<Report, TopologyError> {
        let mut turned = self.clone();
        turned.reroot(body)?;
        let report = turned.attach(body, onto, hinge, placement)?;
        *self = turned;
        Ok(report)
    }

    /// Returns the mechanism, its state, and the maps of indices. O(n log n).
    #[must_use]
    pub fn finish(self) -> Edited {
        let (old, new) = (&self.original, &self.scene.mbs);
        let mut places = Places {
            bodies: Vec::with_capacity(old.bodies().len()),
            q: vec![None; old.nq()],
            v: vec![None; old.nv()],
        };
        for body in old.bodies() {
            let id = new.body(body.name());
            places.bodies.push(id);
            if let Some(now) = id.filter(|_| !self.changed.contains(body.name())) {
                let now = new.get(now);
                body.q().zip(now.q()).for_each(|(from, to)| places.q[from] = Some(to));
                body.v().zip(now.v()).for_each(|(from, to)| places.v[from] = Some(to));
            }
        }
        let Scene { mbs: multibody, q, v } = self.scene;
        Edited { multibody, q, v, places, dropped: self.dropped }
    }

    fn commit(
        &mut self,
        parts: &Parts,
        about: &str,
        changed: &[&str],
    ) -> Result<Report, TopologyError> {
        let after = parts.assemble()?;
        Ok(self.accept(after, about, None, changed))
    }

    /// Accepts a new scene and reports about the origin of a body that exists in either scene.
    fn accept(
        &mut self,
        after: Scene,
        about: &str,
        taken: Option<&str>,
        changed: &[&str],
    ) -> Report {
        let at = |scene: &Scene| {
            let id = scene.mbs.body(about)?;
            Some(scene.mbs.body_poses(&scene.q)[id.index()].position)
        };
        let point = at(&self.scene).or_else(|| at(&after)).unwrap_or_else(Vec3::zeros);
        let report = impact::report(&self.scene, &after, point, taken);
        self.changed.extend(changed.iter().map(|s| (*s).to_owned()));
        self.scene = after;
        report
    }

    /// Gives a body a free hinge on `base` at its present pose and velocity.
    fn set_free(
        &self,
        parts: &mut Parts,
        body: &str,
        base: &str,
        coordinate: Coordinate,
    ) -> Result<(), TopologyError> {
        let (X, V) = self.seen(base, body)?;
        let Some(part) = parts.find(body) else { unreachable!("checked by the caller") };
        base.clone_into(&mut part.spec.parent);
        (part.spec.hinge_in_parent, part.spec.hinge_in_body) = (Pose::identity(), Pose::identity());
        let subhinge = Subhinge { coordinate, ..Subhinge::from(SubhingeKind::Free) };
        part.spec.hinge = Hinge { subhinges: vec![subhinge] };
        (part.q, part.v) = free_state(&X, &V);
        Ok(())
    }

    /// Returns pose and velocity of a body relative to another (or the world), in the axes of the latter.
    fn seen(&self, from: &str, body: &str) -> Result<(Pose, Motion), TopologyError> {
        let answer = || {
            let mut frames = Frames::new();
            let world = frames.world();
            let m = frames.add_mechanism("", &self.scene.mbs, world)?;
            frames.set_q(m, &self.scene.q)?;
            frames.set_v(m, &self.scene.v)?;
            let a = if from == "world" { world } else { frames.body_named(m, from)? };
            let b = frames.body_named(m, body)?;
            let pair = frames.pair(a, b)?;
            Ok((frames.pose(pair), frames.velocity(pair)))
        };
        // The names are checked, so the only possible error is a state that is not finite.
        answer().map_err(|e: crate::frames::FramesError| TopologyError::NotFinite {
            place: format!("body `{body}` ({e})"),
        })
    }

    fn body(&self, name: &str, action: &'static str) -> Result<BodyId, TopologyError> {
        self.scene.mbs.body(name).ok_or_else(|| TopologyError::Unknown {
            action,
            name: name.to_owned(),
            help: if name == "world" {
                "the world cannot be edited: give a body"
            } else {
                "use the names of the mechanism, including prefixes"
            },
        })
    }

    fn frame(&self, name: &str, action: &'static str) -> Result<Option<BodyId>, TopologyError> {
        if name == "world" { Ok(None) } else { self.body(name, action).map(Some) }
    }

    fn check_base(
        &self,
        body: &str,
        base: &str,
        action: &'static str,
    ) -> Result<(), TopologyError> {
        let (id, on) = (self.body(body, action)?, self.frame(base, action)?);
        if on.is_some_and(|on| self.scene.mbs.on_path(id, on)) {
            return Err(TopologyError::OwnSubtree { body: body.to_owned(), onto: base.to_owned() });
        }
        Ok(())
    }

    fn names(&self, bodies: impl Iterator<Item = BodyId>) -> Vec<String> {
        bodies.map(|b| self.scene.mbs.get(b).name().to_owned()).collect()
    }

    fn refuse_clash<'a>(
        &self,
        action: &'static str,
        bodies: impl Iterator<Item = &'a str>,
        nodes: impl Iterator<Item = &'a str>,
    ) -> Result<(), TopologyError> {
        let mbs = &self.scene.mbs;
        let taken = bodies.filter(|n| mbs.body(n).is_some());
        let taken = taken.chain(nodes.filter(|n| mbs.node(n).is_some()));
        let names: BTreeSet<String> = taken.map(str::to_owned).collect();
        if names.is_empty() {
            return Ok(());
        }
        Err(TopologyError::NameClash { action, names: names.into_iter().collect() })
    }
}

fn refuse_flexible(mbs: &Multibody) -> Result<(), TopologyError> {
    match mbs.bodies().iter().find(|b| b.modes().is_some()) {
        Some(b) => Err(TopologyError::Flexible { body: b.name().to_owned() }),
        None => Ok(()),
    }
}

fn check_state(
    place: &str,
    (q, nq): (&[f64], usize),
    (v, nv): (&[f64], usize),
) -> Result<(), TopologyError> {
    for (what, x, want) in [("q", q, nq), ("v", v, nv)] {
        if x.len() != want {
            let got = x.len();
            return Err(TopologyError::Length { place: place.to_owned(), what, got, want });
        }
        if let Some(i) = x.iter().position(|x| !x.is_finite()) {
            return Err(TopologyError::NotFinite { place: format!("{place}, {what}[{i}]") });
        }
    }
    Ok(())
}
