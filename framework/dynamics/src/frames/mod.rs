//! Relative poses and motions of frames: any frame relative to any other, in the axes of any third; computed on demand, and only once.
//!
//! Frames form a tree whose root is the world: the bodies and nodes of mechanisms, frames fixed to them (cameras, instruments), frames that are moved
//! from outside (planets, turntables), and mechanisms on any of these, to any depth. For B relative to A:
//! ```text
//! pose           X_AB
//! velocity       [ω; v]   of B's axes and origin relative to A, as an observer fixed in A measures it
//! acceleration   [α; a]   their derivatives as this observer measures them (classical: a = d²p_AB/dt²)
//! ```
//! For an accelerometer A must be inertial. For a camera on a turntable the result contains Coriolis terms, because A rotates.
//!
//! The functions `set_…` only record what changed. A query for a pair computes the terms of the hinges on the path between the two frames that are
//! out of date, separately for pose, velocity and acceleration, and nothing else. Repeating the query computes nothing ([`Frames::counts`]). The path
//! goes through the nearest common ancestor, so frames that are near each other and far from the world's origin do not lose accuracy. Set-up and the
//! first query after [`Frames::fix`] allocate; all other calls do not.

mod edge;
mod error;
mod names;
mod pair;
mod relative;

pub use error::FramesError;

use edge::{Edge, Joint, Level, Mover, State};
use linkwork_multibody::{Multibody, SubhingeKind};
use linkwork_spatial::{Motion, Pose, Quat, Vec3};
use names::Name;
use pair::Path;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Handle of a frame of one [`Frames`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct FrameId(u32);

impl FrameId {
    fn index(self) -> usize {
        self.0 as usize
    }
}

/// Handle of a mechanism of one [`Frames`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MechanismId(u32);

/// A query that can be repeated: B relative to A, in the axes of A or of a third frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pair {
    path: u32,
    /// The path from the third frame to A.
    axes: Option<u32>,
}

/// Number of computations, for pose, velocity and acceleration.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Computations of subhinge terms.
    pub edges: [u64; 3],
    /// Computations of results along a path.
    pub pairs: [u64; 3],
}

/// One mechanism of the frames.
#[derive(Clone, Debug)]
struct Mechanism {
    name: String,
    multibody: Arc<Multibody>,
    bodies: Vec<FrameId>,
    nodes: Vec<FrameId>,
    /// Frames that its subhinges move.
    moved: Vec<FrameId>,
}

/// All frames of a scene, and the states that move them.
#[derive(Clone, Debug)]
pub struct Frames {
    edges: Vec<Edge>,
    names: Vec<Name>,
    own: BTreeMap<String, FrameId>,
    mechanisms: Vec<Mechanism>,
    states: Vec<State>,
    paths: Vec<Path>,
    index: BTreeMap<(FrameId, FrameId), u32>,
    /// Time stamp that increases with each change.
    now: u64,
    structure: u64,
    counts: Counts,
}

impl Default for Frames {
    fn default() -> Self {
        Self::new()
    }
}

impl Frames {
    /// Creates a scene that contains only the world.
    #[must_use]
    pub fn new() -> Self {
        Self {
            edges: vec![Edge::new(0, Mover::Fixed, Pose::identity())],
            names: vec![Name::World],
            own: BTreeMap::new(),
            mechanisms: Vec::new(),
            states: Vec::new(),
            paths: Vec::new(),
            index: BTreeMap::new(),
            now: 1,
            structure: 1,
            counts: Counts::default(),
        }
    }

    /// Returns the world.
    #[must_use]
    pub fn world(&self) -> FrameId {
        FrameId(0)
    }

    /// Adds all bodies and nodes of a mechanism; its `world` is the frame `on`. Its state is neutral and at rest until it is set. O(bodies).
    ///
    /// # Errors
    /// [`FramesError::Duplicate`] if there is a mechanism with this name, [`FramesError::Unknown`].
    pub fn add_mechanism(
        &mut self,
        name: &str,
        mbs: &Multibody,
        on: FrameId,
    ) -> Result<MechanismId, FramesError> {
        self.check(on)?;
        if self.mechanisms.iter().any(|m| m.name == name) {
            return Err(FramesError::Duplicate { name: name.to_owned() });
        }
        if let Some(b) = mbs.bodies().iter().find(|b| b.modes().is_some()) {
            let (mechanism, body) = (name.to_owned(), b.name().to_owned());
            return Err(FramesError::Flexible { mechanism, body });
        }
        let m = self.mechanisms.len();
        let (mut bodies, mut moved): (Vec<FrameId>, Vec<FrameId>) = (Vec::new(), Vec::new());
        for id in mbs.body_ids() {
            let body = mbs.get(id);
            let mut parent = body.parent().map_or(on, |p| bodies[p.index()]);
            let (mut before, after) = (body.hinge_in_parent(), body.hinge_in_body().inverse());
            let moving =
                body.subhinges().iter().filter(|s| s.subhinge.kind != SubhingeKind::Locked);
            let last = moving.clone().count();
            for (i, s) in moving.enumerate() {
                let mut joint = Joint::new(m, s.subhinge.kind, s.q.start, s.v.start, before);
                let mut name = Name::Inside(m as u32, id);
                if i + 1 == last {
                    joint.after = after;
                    name = Name::Body(m as u32, id);
                }
                parent = self.push(
                    name,
                    Edge::new(parent.index(), Mover::Subhinge(Box::new(joint)), before),
                );
                moved.push(parent);
                before = Pose::identity();
            }
            if last == 0 {
                let edge = Edge::new(parent.index(), Mover::Fixed, before * after);
                parent = self.push(Name::Body(m as u32, id), edge);
            }
            bodies.push(parent);
        }
        let nodes = mbs.node_ids().map(|id| {
            let node = mbs.get_node(id);
            let edge = Edge::new(bodies[node.body().index()].index(), Mover::Fixed, node.pose());
            self.push(Name::Node(m as u32, id), edge)
        });
        let nodes = nodes.collect();
        let (v, q) = (vec![0.0; mbs.nv()], mbs.neutral_q());
        self.states.push(State { q, vdot: v.clone(), v });
        let multibody = Arc::new(mbs.clone());
        self.mechanisms.push(Mechanism { name: name.to_owned(), multibody, bodies, nodes, moved });
        Ok(MechanismId(m as u32))
    }

    /// Adds a frame fixed to another at `X_AB` (`pose` of the new frame in `on`).
    ///
    /// # Errors
    /// [`FramesError::Duplicate`], [`FramesError::Unknown`], [`FramesError::NotFinite`].
    pub fn add_fixed(
        &mut self,
        name: &str,
        on: FrameId,
        pose: Pose,
    ) -> Result<FrameId, FramesError> {
        self.add_own(name, on, pose, Mover::Fixed)
    }

    /// Adds a frame that [`Frames::set_moving`] moves relative to another; initially it is at rest at `pose`.
    ///
    /// # Errors
    /// Like [`Frames::add_fixed`].
    pub fn add_moving(
        &mut self,
        name: &str,
        on: FrameId,
        pose: Pose,
    ) -> Result<FrameId, FramesError> {
        self.add_own(name, on, pose, Mover::Given)
    }

    fn add_own(
        &mut self,
        name: &str,
        on: FrameId,
        pose: Pose,
        mover: Mover,
    ) -> Result<FrameId, FramesError> {
        self.check(on)?;
        finite(&pose, &Motion::zero(), &Motion::zero(), || format!("frame `{name}`"))?;
        if self.own.contains_key(name) {
            return Err(FramesError::Duplicate { name: name.to_owned() });
        }
        let id = self.push(Name::Own(name.to_owned()), Edge::new(on.index(), mover, pose));
        self.own.insert(name.to_owned(), id);
        Ok(id)
    }

    /// Attaches a frame that was added by name, with everything that hangs on it, to another frame. A moving frame stops moving. Paths of pairs are
    /// updated at their next query.
    ///
    /// # Errors
    /// [`FramesError::Cycle`], [`FramesError::Kind`], [`FramesError::Unknown`],
    /// [`FramesError::NotFinite`].
    pub fn fix(&mut self, frame: FrameId, on: FrameId, pose: Pose) -> Result<(), FramesError> {
        self.check(frame)?;
        self.check(on)?;
        if !matches!(self.names[frame.index()], Name::Own(_)) {
            return Err(FramesError::Kind {
                frame: self.label(frame),
                want: "a frame that was added by name",
                help: "the mechanism defines the parents of bodies and nodes; edit the mechanism",
            });
        }
        finite(&pose, &Motion::zero(), &Motion::zero(), || self.label(frame))?;
        let mut at = on.index();
        while at != 0 {
            if at == frame.index() {
                return Err(FramesError::Cycle { frame: self.name(frame), on: self.label(on) });
            }
            at = self.edges[at].parent;
        }
        self.now += 1;
        self.structure += 1;
        let mut edge = Edge::new(on.index(), Mover::Fixed, pose);
        edge.mark(Level::Pose, self.now);
        self.edges[frame.index()] = edge;
        Ok(())
    }

    /// Returns the pair for frame `b` relative to frame `a`, in the axes of `a`. Equal pairs share their results.
    ///
    /// # Errors
    /// [`FramesError::Unknown`].
    pub fn pair(&mut self, a: FrameId, b: FrameId) -> Result<Pair, FramesError> {
        Ok(Pair { path: self.path(a, b)?, axes: None })
    }

    /// Returns the pair for frame `b` relative to frame `a`, in the axes of the frame `axes`.
    ///
    /// # Errors
    /// [`FramesError::Unknown`].
    pub fn pair_in(&mut self, a: FrameId, b: FrameId, axes: FrameId) -> Result<Pair, FramesError> {
        let turn = if axes == a { None } else { Some(self.path(axes, a)?) };
        Ok(Pair { path: self.path(a, b)?, axes: turn })
    }

    fn path(&mut self, a: FrameId, b: FrameId) -> Result<u32, FramesError> {
        self.check(a)?;
        self.check(b)?;
        if let Some(found) = self.index.get(&(a, b)) {
            return Ok(*found);
        }
        let mut path = Path::new(a, b);
        path.route(&self.edges, self.structure);
        let place = self.paths.len() as u32;
        self.paths.push(path);
        self.index.insert((a, b), place);
        Ok(place)
    }

    /// Sets the configuration (nq) of a mechanism. Only subhinges whose coordinates differ become out of date.
    ///
    /// # Errors
    /// [`FramesError::Length`], [`FramesError::NotFinite`], [`FramesError::Unknown`]. After an error nothing is set.
    pub fn set_q(&mut self, mechanism: MechanismId, q: &[f64]) -> Result<(), FramesError> {
        self.set(mechanism, Level::Pose, q)
    }

    /// Sets the rates β (nv) of a mechanism. Poses remain valid.
    ///
    /// # Errors
    /// Like [`Frames::set_q`].
    pub fn set_v(&mut self, mechanism: MechanismId, v: &[f64]) -> Result<(), FramesError> {
        self.set(mechanism, Level::Velocity, v)
    }

    /// Sets the accelerations β̇ (nv) of a mechanism. Poses and velocities remain valid.
    ///
    /// # Errors
    /// Like [`Frames::set_q`].
    pub fn set_vdot(&mut self, mechanism: MechanismId, vdot: &[f64]) -> Result<(), FramesError> {
        self.set(mechanism, Level::Acceleration, vdot)
    }

    fn set(&mut self, id: MechanismId, level: Level, new: &[f64]) -> Result<(), FramesError> {
        self.mechanism(id)?;
        let m = id.0 as usize;
        let state = &mut self.states[m];
        let (what, old) = match level {
            Level::Pose => ("q", &mut state.q),
            Level::Velocity => ("v", &mut state.v),
            Level::Acceleration => ("vdot", &mut state.vdot),
        };
        let mechanism = &self.mechanisms[m];
        if new.len() != old.len() {
            let (got, want) = (new.len(), old.len());
            return Err(FramesError::Length { mechanism: mechanism.name.clone(), what, got, want });
        }
        if let Some(i) = new.iter().position(|x| !x.is_finite()) {
            let place = format!("mechanism `{}`, {what}[{i}]", mechanism.name);
            return Err(FramesError::NotFinite { place });
        }
        if new == old {
            return Ok(());
        }
        self.now += 1;
        for frame in &mechanism.moved {
            let edge = &mut self.edges[frame.index()];
            let Mover::Subhinge(joint) = &edge.mover else { continue };
            let range = match level {
                Level::Pose => joint.q..joint.q + joint.kind.nq(),
                _ => joint.v..joint.v + joint.kind.nv(),
            };
            if new[range.clone()] != old[range] {
                edge.mark(level, self.now);
            }
        }
        old.copy_from_slice(new);
        Ok(())
    }

    /// Moves a moving frame: pose, velocity and acceleration relative to its parent frame, in the axes of the parent.
    ///
    /// # Errors
    /// [`FramesError::Kind`] if it was not added by [`Frames::add_moving`], [`FramesError::NotFinite`], [`FramesError::Unknown`]. After an error
    /// nothing is set.
    pub fn set_moving(
        &mut self,
        frame: FrameId,
        pose: Pose,
        velocity: Motion,
        acceleration: Motion,
    ) -> Result<(), FramesError> {
        self.check(frame)?;
        finite(&pose, &velocity, &acceleration, || self.label(frame))?;
        if !matches!(self.edges[frame.index()].mover, Mover::Given) {
            return Err(FramesError::Kind {
                frame: self.label(frame),
                want: "a moving frame",
                help: "add it with `add_moving`",
            });
        }
        let edge = &mut self.edges[frame.index()];
        let level = match () {
            () if edge.X != pose => Level::Pose,
            () if edge.V != velocity => Level::Velocity,
            () if edge.A != acceleration => Level::Acceleration,
            () => return Ok(()),
        };
        self.now += 1;
        (edge.X, edge.V, edge.A) = (pose, velocity, acceleration);
        edge.mark(level, self.now);
        Ok(())
    }

    /// Returns `X_AB`. Panics if the pair belongs to other frames.
    #[track_caller]
    pub fn pose(&mut self, pair: Pair) -> Pose {
        self.refresh(pair.path, Level::Pose).X
    }

    /// Returns the vector from A's origin to B's, in the requested axes, m.
    #[track_caller]
    pub fn position(&mut self, pair: Pair) -> Vec3 {
        let p = self.pose(pair).position;
        self.turn(pair).map_or(p, |R| R * p)
    }

    /// Returns the velocity of B relative to A, in the requested axes: rad/s, m/s.
    #[track_caller]
    pub fn velocity(&mut self, pair: Pair) -> Motion {
        let V = self.refresh(pair.path, Level::Velocity).V;
        self.turn(pair).map_or(V, |R| V.rotate(&R))
    }

    /// Returns the acceleration of B relative to A, in the requested axes: rad/s², m/s².
    #[track_caller]
    pub fn acceleration(&mut self, pair: Pair) -> Motion {
        let A = self.refresh(pair.path, Level::Acceleration).A;
        self.turn(pair).map_or(A, |R| A.rotate(&R))
    }

    /// Returns the numbers of computations since the frames were created.
    #[must_use]
    pub fn counts(&self) -> Counts {
        self.counts
    }

    /// Returns R from the axes of A to the requested axes, if these differ.
    #[track_caller]
    fn turn(&mut self, pair: Pair) -> Option<Quat> {
        pair.axes.map(|axes| self.refresh(axes, Level::Pose).X.rotation)
    }

    #[track_caller]
    fn refresh(&mut self, path: u32, level: Level) -> &Path {
        assert!((path as usize) < self.paths.len(), "a pair of other frames");
        let path = &mut self.paths[path as usize];
        path.route(&self.edges, self.structure);
        path.refresh(level, &mut self.edges, &self.states, self.now, &mut self.counts);
        path
    }

    fn push(&mut self, name: Name, edge: Edge) -> FrameId {
        self.names.push(name);
        self.edges.push(edge);
        FrameId(self.edges.len() as u32 - 1)
    }
}

fn finite(X: &Pose, V: &Motion, A: &Motion, place: impl Fn() -> String) -> Result<(), FramesError> {
    let numbers = [V.angular, V.linear, A.angular, A.linear];
    let sound = X.is_finite() && numbers.iter().all(|v| v.iter().all(|x| x.is_finite()));
    let unit = (X.rotation.norm() - 1.0).abs() < 1e-6;
    if sound && unit { Ok(()) } else { Err(FramesError::NotFinite { place: place() }) }
}
