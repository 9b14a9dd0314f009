//! The robot model: constant, checked and shared.

use crate::collision::{Carrier, Scene};
use crate::error::{Closure, ModelError, ModelFault, RobotError};
use crate::linkage::{Linkage, linkages};
use crate::part::{Chain, Part, PartSpec, Resolved, resolve};
use crate::robot::numbers;
use linkwork_collision::{ColliderId, ColliderSpec, Rules, Shape};
use linkwork_dynamics::Tree;
use linkwork_formats::{
    Description, Geometry, ReadOptions, ShapeRole, Srdf, mesh_corners, read_file, read_srdf_file,
};
use linkwork_multibody::{
    BodyId, Builder, HingeCoordinate, Limits, Multibody, NodeId, SubhingeKind, SubhingeRange,
};
use linkwork_names::suggest;
use linkwork_spatial::{MassProperties, Pose, RigidInertia, Vec3};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::sync::Arc;

/// Description of a robot model. [`RobotModel::new`] checks it and builds the model.
#[derive(Clone, Debug, Default)]
pub struct ModelSpec {
    /// Bodies and hinges. Loops and couplings are errors unless `closures` is [`Closures::Kept`].
    pub mechanism: Builder,
    /// Handling of the mechanism's loops and couplings.
    pub closures: Closures,
    /// Parts by name.
    pub parts: Vec<PartSpec>,
    /// Objects that hands may hold.
    pub objects: Vec<ObjectSpec>,
    /// Bodies that hang on objects by hinges. The parent of each is an object or another of these bodies, by name. Loops and couplings are errors.
    pub linkages: Builder,
    /// Shapes on bodies, on objects and their bodies (by name), and in the world.
    pub colliders: Vec<ColliderSpec>,
    /// Which shapes are checked against each other. Pairs of a hand and the object that it holds are excluded automatically.
    pub rules: Rules,
    /// Names of joints and the hinge coordinates that they move.
    pub joints: BTreeMap<String, HingeCoordinate>,
    /// Content of the files that the model does not use, one line each.
    pub unused: Vec<String>,
    /// Mass properties in the files that no rigid body can have but that were read all the same
    /// ([`Unphysical::Read`](linkwork_formats::Unphysical::Read)), one line each, with link and numbers.
    pub doubtful: Vec<String>,
}

/// Handling of loops and couplings of the mechanism, such as joints that mimic others.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Closures {
    /// A model with loops or couplings is an error.
    #[default]
    Refused,
    /// [`WholeBodyIk`](crate::WholeBodyIk) keeps them closed, for all kinds of hinges. Kinematics, collisions, masses and forces are those of the tree
    /// at the given q. The forces are those of a motion that keeps the closures closed, as if every coordinate had its own motor. Functions that
    /// would open a closure return [`RobotError::OpensClosure`]: searches, rates and paths of a chain that takes part in one, paths between
    /// configurations, tasks, operational space, predictions and transfers. Paths between configurations and their time parameterization support
    /// linear couplings; in the latter, coordinates that follow others have no motor.
    Kept,
}

impl ModelSpec {
    /// Reads the mechanism of a description and the names of its joints.
    ///
    /// # Errors
    /// A description with loops or couplings, because the embedded model is a tree.
    pub fn from_description(d: &Description) -> Result<Self, ModelError> {
        let mut faults = Vec::new();
        let help = "remove it from the description, or keep it (`ModelSpec::with_closures`, `lw_builder_keep_closures`)";
        for l in &d.loops {
            faults.push(ModelFault::Refused { what: format!("loop `{}`", l.name), help });
        }
        for c in &d.couplings {
            faults.push(ModelFault::Refused { what: format!("coupling `{}`", c.name), help });
        }
        if !faults.is_empty() {
            return Err(ModelError { faults });
        }
        Ok(Self::of(d))
    }

    /// Like [`from_description`](Self::from_description), but [keeps](Closures::Kept) the loops and couplings of the description.
    #[must_use]
    pub fn with_closures(d: &Description) -> Self {
        let mut spec = Self { closures: Closures::Kept, ..Self::of(d) };
        for l in &d.loops {
            spec.mechanism.loop_closure(l.clone());
        }
        for c in &d.couplings {
            spec.mechanism.coupling(c.clone());
        }
        spec
    }

    fn of(d: &Description) -> Self {
        // Iterate over the joints: a look-up by name for each would take quadratic time.
        let joints = d.joints.iter().filter(|j| j.count == 1).map(|j| {
            (j.name.clone(), HingeCoordinate { body: j.body.clone(), subhinge: j.subhinge })
        });
        Self {
            mechanism: d.builder.clone(),
            joints: joints.collect(),
            unused: d.ignored.iter().map(ToString::to_string).collect(),
            doubtful: d.doubtful.iter().map(ToString::to_string).collect(),
            ..Self::default()
        }
    }

    /// Adds the [collision shapes](colliders_of) of a description, and its pairs of bodies that are not checked for collisions.
    ///
    /// # Errors
    /// Shapes that are not supported as colliders.
    pub fn shapes(mut self, d: &Description) -> Result<Self, ModelError> {
        self.colliders.extend(colliders_of(d)?);
        self.rules.ignore.extend(d.exclusions.iter().cloned());
        Ok(self)
    }

    /// Adds the groups of an SRDF file as parts. A part is one chain, or the bodies of the group's links, joints and chains. The file's disabled
    /// pairs are added to the rules; all other content of the file is listed in `unused`.
    ///
    /// # Errors
    /// Joints or links that the mechanism does not have.
    pub fn groups(mut self, srdf: &Srdf, d: &Description) -> Result<Self, ModelError> {
        let mut faults = Vec::new();
        let parents: BTreeMap<&str, &str> =
            d.builder.bodies().iter().map(|b| (b.name.as_str(), b.parent.as_str())).collect();
        for g in &srdf.groups {
            if let ([[base, tip]], [], []) = (&g.chains[..], &g.links[..], &g.joints[..]) {
                self.parts.push(PartSpec::chain(&g.name, base, tip));
                continue;
            }
            let mut bodies = g.links.clone();
            for j in &g.joints {
                match d.joint(j) {
                    Some(joint) => bodies.push(joint.body.clone()),
                    None => faults.push(ModelFault::Unknown {
                        place: format!("group `{}`", g.name),
                        kind: "joint",
                        name: j.clone(),
                        help: suggest(j, "joint", d.joints.iter().map(|j| j.name.as_str())),
                    }),
                }
            }
            for [base, tip] in &g.chains {
                let mut at = Some(tip.as_str());
                while let Some(body) = at.filter(|b| *b != base && *b != "world") {
                    bodies.push(body.to_owned());
                    at = parents.get(body).copied();
                }
                if at.is_none_or(|b| b != base) {
                    let (base, tip) = (base.clone(), tip.clone());
                    faults.push(ModelFault::NoPath { part: g.name.clone(), base, tip });
                }
            }
            if bodies.is_empty() {
                // This group contains only groups, whose members are separate parts.
                self.unused.push(format!("SRDF: group `{}` has no links and is not used", g.name));
                continue;
            }
            self.parts.push(PartSpec::Bodies { name: g.name.clone(), bodies });
        }
        self.rules.ignore.extend(srdf.ignore.iter().cloned());
        self.unused.extend(srdf.ignored.iter().map(ToString::to_string));
        if faults.is_empty() { Ok(self) } else { Err(ModelError { faults }) }
    }
}

/// An object that a hand may hold. It is rigid unless bodies in [`ModelSpec::linkages`] hang on it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ObjectSpec {
    /// Its name.
    pub name: String,
    /// Mass properties in the object's axes, without the bodies that hang on it.
    pub mass: MassProperties,
}

/// An object of one [`RobotModel`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Object(pub(crate) u32);

impl Object {
    /// Returns its index in the model's list of objects.
    #[must_use]
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// The constant data of a robot: mechanism, parts and objects. Any number of [`Robot`](crate::Robot)s can share it.
#[derive(Debug)]
pub struct RobotModel {
    pub(crate) tree: Tree,
    pub(crate) parts: Vec<Resolved>,
    /// Node in the whole mechanism at the tip of each part that is a chain.
    pub(crate) tips: Vec<Option<NodeId>>,
    /// Nodes at the bases of chains whose base is a body.
    pub(crate) bases: Vec<Option<NodeId>>,
    /// Loops and couplings, with the degrees of freedom that they constrain.
    closures: Vec<(Closure, Vec<usize>)>,
    pub(crate) objects: Vec<(String, RigidInertia)>,
    /// For each object, the bodies that hang on it.
    pub(crate) linkages: Vec<Option<Linkage>>,
    /// For each entry of β that has exactly one entry of q: the index of that entry, and its limits.
    pub(crate) limits: Vec<Option<(usize, Limits)>>,
    /// Index in q of the first number of each quaternion.
    attitudes: Vec<usize>,
    pub(crate) scene: Scene,
    joints: BTreeMap<String, (usize, usize)>,
    unused: Vec<String>,
    doubtful: Vec<String>,
}

impl RobotModel {
    /// Checks configurations, row after row. Returns an error for numbers that [`numbers`] rejects and for quaternions of length zero.
    pub(crate) fn configurations(
        &self,
        what: &'static str,
        q: &[f64],
        rows: usize,
    ) -> Result<(), RobotError> {
        let nq = self.tree.nq();
        numbers(what, q, rows * nq)?;
        for (k, at) in (0..rows).flat_map(|k| self.attitudes.iter().map(move |at| (k, at))) {
            let index = k * nq + at;
            if q[index..index + 4].iter().map(|x| x * x).sum::<f64>() < 1e-200 {
                return Err(RobotError::ZeroQuaternion { what, index });
            }
        }
        Ok(())
    }

    /// Checks the description and builds the model. O(parts · bodies).
    ///
    /// # Errors
    /// All faults of the description at once.
    pub fn new(spec: &ModelSpec) -> Result<Arc<Self>, ModelError> {
        let mut faults = Vec::new();
        if spec.closures == Closures::Refused {
            let help = "remove it, or keep it with `Closures::Kept`, whose documentation lists what then works";
            let names = spec.mechanism.loops().iter().map(|l| format!("loop `{}`", l.name));
            let couplings = spec.mechanism.couplings().iter();
            let names = names.chain(couplings.map(|c| format!("coupling `{}`", c.name)));
            faults.extend(names.map(|what| ModelFault::Refused { what, help }));
        }
        for b in spec.mechanism.bodies().iter().filter(|b| b.modes.is_some()) {
            let what = format!("the flexibility of body `{}`", b.name);
            faults.push(ModelFault::Refused { what, help: "make the body rigid" });
        }
        twice("part", spec.parts.iter().map(PartSpec::name), &mut faults);
        twice("object", spec.objects.iter().map(|o| o.name.as_str()), &mut faults);
        let mut objects = Vec::with_capacity(spec.objects.len());
        for o in &spec.objects {
            match o.mass.validate() {
                Ok(inertia) => objects.push((o.name.clone(), inertia)),
                Err(e) => {
                    faults.push(ModelFault::Inertia { object: o.name.clone(), text: e.to_string() })
                }
            }
        }
        let mut open = spec.mechanism.clone();
        open.loops_mut().clear();
        open.couplings_mut().clear();
        let bare = match open.build() {
            Ok(bare) => bare,
            Err(e) => {
                faults.push(ModelFault::Mechanism { text: e.to_string() });
                return Err(ModelError { faults });
            }
        };
        let parts: Vec<Resolved> =
            spec.parts.iter().filter_map(|p| resolve(&bare, p, &mut faults)).collect();
        if !faults.is_empty() {
            return Err(ModelError { faults });
        }
        let closed = spec.closures == Closures::Kept;
        let multibody = with_tips(if closed { &spec.mechanism } else { &open }, &bare, &parts)?;
        let moves =
            multibody.loops().iter().filter(|l| !l.motions.is_empty() || !l.gaps.is_empty());
        let faults: Vec<ModelFault> = moves
            .map(|l| ModelFault::Refused {
                what: format!("the motion across loop `{}`", l.closure.name),
                help: "use a loop hinge without prescribed motion and without clearance",
            })
            .collect();
        if !faults.is_empty() {
            return Err(ModelError { faults });
        }
        let tips = parts.iter().map(|p| multibody.node(&tip_name(&p.name))).collect();
        let bases = parts.iter().map(|p| multibody.node(&base_name(&p.name))).collect();
        let mut limits = vec![None; multibody.nv()];
        for (_, s) in multibody.subhinges().filter(|(_, s)| s.v.len() == 1 && s.q.len() == 1) {
            limits[s.v.start] = Some((s.q.start, s.subhinge.limits));
        }
        let mut joints = BTreeMap::new();
        for (name, c) in &spec.joints {
            let body = multibody.body(&c.body).map(|b| multibody.get(b));
            if let Some(s) = body.and_then(|b| b.subhinges().get(c.subhinge)) {
                joints.insert(name.clone(), (s.q.start, s.v.start));
            }
        }
        let linkages = linkages(spec)?;
        let scene = Scene::new(spec, &multibody, &parts, &linkages)?;
        let turns =
            |s: &SubhingeRange| matches!(s.subhinge.kind, SubhingeKind::Ball | SubhingeKind::Free);
        let attitudes = multibody.subhinges().filter(|(_, s)| turns(s)).map(|(_, s)| s.q.end - 4);
        Ok(Arc::new(Self {
            attitudes: attitudes.collect(),
            tree: Tree::new(&multibody),
            parts,
            tips,
            bases,
            closures: closures_of(&multibody),
            objects,
            linkages,
            limits,
            scene,
            joints,
            unused: spec.unused.clone(),
            doubtful: spec.doubtful.clone(),
        }))
    }

    /// Loads a robot from a URDF, MJCF or SDF file with its collision shapes, and keeps its loops and couplings. The groups of an SRDF file become
    /// parts. Check [`doubtful`](Self::doubtful) and [`unused`](Self::unused) afterwards.
    ///
    /// # Errors
    /// All faults of the files and the parts at once; shapes that [are not supported as colliders](colliders_of).
    pub fn load(
        robot: impl AsRef<Path>,
        groups: Option<&Path>,
        options: &ReadOptions,
    ) -> Result<Arc<Self>, ModelError> {
        let file = |e: String| ModelError { faults: vec![ModelFault::File { text: e }] };
        let d = read_file(robot, options).map_err(|e| file(e.to_string()))?;
        let mut spec = ModelSpec::with_closures(&d).shapes(&d)?;
        if let Some(path) = groups {
            let srdf = read_srdf_file(path).map_err(|e| file(e.to_string()))?;
            spec = spec.groups(&srdf, &d)?;
        }
        Self::new(&spec)
    }

    /// Returns the mechanism.
    #[must_use]
    pub fn multibody(&self) -> &Multibody {
        self.tree.multibody()
    }

    /// Returns the number of coordinates in q.
    #[must_use]
    pub fn nq(&self) -> usize {
        self.tree.nq()
    }

    /// Returns the number of degrees of freedom.
    #[must_use]
    pub fn nv(&self) -> usize {
        self.tree.nv()
    }

    /// Returns the part with the given name.
    #[must_use]
    pub fn part(&self, name: &str) -> Option<Part> {
        self.parts.iter().position(|p| p.name == name).map(|i| Part(i as u32))
    }

    /// Returns all parts with their names, in the order of the description.
    pub fn parts(&self) -> impl ExactSizeIterator<Item = (Part, &str)> {
        self.parts.iter().enumerate().map(|(i, p)| (Part(i as u32), p.name.as_str()))
    }

    /// Returns the bodies of a part, from base to tip.
    ///
    /// # Errors
    /// [`RobotError::ForeignHandle`].
    pub fn bodies(&self, part: Part) -> Result<&[BodyId], RobotError> {
        self.parts.get(part.index()).map(|p| &p.bodies[..]).ok_or(RobotError::ForeignHandle)
    }

    /// Returns the indices in β of a chain's degrees of freedom, which are the columns of its Jacobian.
    ///
    /// # Errors
    /// [`RobotError::ForeignHandle`], [`RobotError::NotAChain`].
    pub fn dofs(&self, part: Part) -> Result<&[usize], RobotError> {
        self.chain(part).map(|c| &c.v[..])
    }

    /// Returns the object with the given name.
    #[must_use]
    pub fn object(&self, name: &str) -> Option<Object> {
        self.objects.iter().position(|o| o.0 == name).map(|i| Object(i as u32))
    }

    /// Returns all objects with their names, in the order of the description.
    pub fn objects(&self) -> impl ExactSizeIterator<Item = (Object, &str)> {
        self.objects.iter().enumerate().map(|(i, o)| (Object(i as u32), o.0.as_str()))
    }

    /// Returns the bodies of an object with joints, or `None` for a rigid object. The first body is the object itself on a free hinge, which no
    /// function uses.
    #[must_use]
    pub fn object_multibody(&self, object: Object) -> Option<&Multibody> {
        Some(self.linkages.get(object.index())?.as_ref()?.multibody())
    }

    /// Returns a body of an object with joints, by name.
    #[must_use]
    pub fn object_body(&self, object: Object, name: &str) -> Option<BodyId> {
        self.object_multibody(object)?.body(name)
    }

    /// Returns the collider with the given name.
    #[must_use]
    pub fn collider(&self, name: &str) -> Option<ColliderId> {
        self.scene.colliders.find(name)
    }

    /// Returns all colliders with their names, sorted by name.
    pub fn colliders(&self) -> impl ExactSizeIterator<Item = (ColliderId, &str)> {
        self.scene.colliders.ids().map(|i| (i, self.scene.colliders.spec(i).name.as_str()))
    }

    /// Returns the name of a collider.
    #[must_use]
    #[track_caller]
    pub fn collider_name(&self, id: ColliderId) -> &str {
        &self.scene.colliders.spec(id).name
    }

    /// Returns the description of a collider.
    #[must_use]
    #[track_caller]
    pub fn collider_spec(&self, id: ColliderId) -> &ColliderSpec {
        self.scene.colliders.spec(id)
    }

    /// Returns the colliders on the bodies of a part, sorted by name.
    ///
    /// # Errors
    /// [`RobotError::ForeignHandle`].
    pub fn colliders_of_part(
        &self,
        part: Part,
    ) -> Result<impl Iterator<Item = ColliderId> + '_, RobotError> {
        let bodies = self.bodies(part)?;
        Ok(self.carried(|c| matches!(c, Carrier::Body(b) if bodies.contains(&b))))
    }

    /// Returns the colliders of an object, including those on bodies that hang on it, sorted by name.
    ///
    /// # Errors
    /// [`RobotError::ForeignHandle`].
    pub fn colliders_of_object(
        &self,
        object: Object,
    ) -> Result<impl Iterator<Item = ColliderId> + '_, RobotError> {
        let own = object.index();
        if own >= self.objects.len() {
            return Err(RobotError::ForeignHandle);
        }
        let of = move |c| matches!(c, Carrier::Object(o) | Carrier::Linked(o, _) if o == own);
        Ok(self.carried(of))
    }

    fn carried(&self, by: impl Fn(Carrier) -> bool) -> impl Iterator<Item = ColliderId> {
        let all = self.scene.colliders.ids();
        all.filter(move |i| by(self.scene.carriers[i.index()]))
    }

    /// Returns the indices in q and β of a joint with one coordinate, by the joint's name in the file.
    #[must_use]
    pub fn coordinate(&self, joint: &str) -> Option<(usize, usize)> {
        self.joints.get(joint).copied()
    }

    /// Returns the content of the files that the model does not use, one line each.
    #[must_use]
    pub fn unused(&self) -> &[String] {
        &self.unused
    }

    /// Returns warnings about mass properties in the files that no rigid body can have but that were read all the same, one line each, with link and
    /// numbers. With [`Unphysical::Refused`](linkwork_formats::Unphysical::Refused) such files are errors.
    #[must_use]
    pub fn doubtful(&self) -> &[String] {
        &self.doubtful
    }

    pub(crate) fn chain(&self, part: Part) -> Result<&Chain, RobotError> {
        let found = self.parts.get(part.index()).ok_or(RobotError::ForeignHandle)?;
        found.chain.as_ref().ok_or(RobotError::NotAChain { part: part.index() })
    }

    /// Returns an error if a chain takes part in a loop or a coupling.
    pub(crate) fn opens(&self, chain: &Chain, what: &'static str) -> Result<(), RobotError> {
        let mut all = self.closures.iter();
        match all.find(|(_, dofs)| dofs.iter().any(|d| chain.v.contains(d))) {
            Some((closure, _)) => Err(RobotError::OpensClosure { what, closure: *closure }),
            None => Ok(()),
        }
    }

    /// Returns an error if the model has loops or couplings. For functions that do not support them.
    pub(crate) fn open_tree(&self, what: &'static str) -> Result<(), RobotError> {
        match self.closures.first() {
            Some((closure, _)) => Err(RobotError::OpensClosure { what, closure: *closure }),
            None => Ok(()),
        }
    }

    /// Returns an error if a straight path opens a loop or a coupling. A linear coupling that is satisfied at both ends is satisfied between
    /// them; a coupling with higher powers is not, if its coordinates move.
    pub(crate) fn opens_between(&self, qa: &[f64], qb: &[f64]) -> Result<(), RobotError> {
        let what = "a straight path";
        let multibody = self.multibody();
        for (closure, dofs) in &self.closures {
            if let Closure::Coupling { index } = *closure {
                let c = &multibody.couplings()[index];
                let still = c.terms.iter().all(|(at, ..)| qa[*at] == qb[*at]);
                let closed = |q: &[f64]| c.error(q).abs() <= 1e-6;
                if (c.is_linear() || still) && closed(qa) && closed(qb) {
                    continue;
                }
                return Err(RobotError::OpensClosure { what, closure: *closure });
            }
            let moves = multibody.subhinges().any(|(_, s)| {
                qa[s.q.clone()] != qb[s.q.clone()] && s.v.clone().any(|d| dofs.contains(&d))
            });
            if moves {
                return Err(RobotError::OpensClosure { what, closure: *closure });
            }
        }
        Ok(())
    }

    /// Returns the node at the tip of a chain in the whole mechanism.
    pub(crate) fn tip(&self, part: Part) -> Result<NodeId, RobotError> {
        let tip = self.tips.get(part.index()).ok_or(RobotError::ForeignHandle)?;
        tip.ok_or(RobotError::NotAChain { part: part.index() })
    }
}

/// Converts the collision shapes of a description to colliders. A collider has the name of its shape if that is unique, otherwise `body/number` (from
/// 0). A mesh file collides as its convex hull, which encloses the mesh, so no contact is missed.
///
/// # Errors
/// All shapes that are not supported, at once: meshes in other formats, missing mesh files, and bounded planes. No shape is skipped silently.
pub fn colliders_of(d: &Description) -> Result<Vec<ColliderSpec>, ModelError> {
    let (mut out, mut faults) = (Vec::<ColliderSpec>::new(), Vec::new());
    let classes = d.collision_classes();
    if classes.meets.len() > 128 {
        faults.push(ModelFault::Refused {
            what: format!("bit masks of {} kinds of collision shapes", classes.meets.len()),
            help: "at most 128 are supported; give shapes that collide with the same shapes the same masks",
        });
    }
    let bits = |all: &[usize]| all.iter().filter(|k| **k < 128).fold(0_u128, |sum, k| sum | 1 << k);
    let one = classes.meets.len() < 2;
    let mut count: BTreeMap<&str, usize> = BTreeMap::new();
    let mut names = BTreeSet::new();
    let shapes = d.shapes.iter().zip(&classes.of);
    for (s, class) in shapes.filter(|(s, _)| s.role != ShapeRole::Visual) {
        let number = count.entry(&s.body).or_default();
        let numbered = format!("{}/{number}", s.body);
        *number += 1;
        let taken = names.contains(&s.name);
        let name = if s.name.is_empty() || taken { numbered } else { s.name.clone() };
        names.insert(name.clone());
        match solid(&s.geometry) {
            Ok(shape) => {
                let mut spec = ColliderSpec::new(name, &s.body, shape).at(s.pose);
                if !one {
                    (spec.groups, spec.collides_with) =
                        (bits(&[*class]), bits(&classes.meets[*class]));
                }
                let (own, of_file) = (&mut spec.material, &s.surface);
                own.friction = of_file.friction.unwrap_or(own.friction);
                own.restitution = of_file.restitution.unwrap_or(own.restitution);
                let own = &mut spec.resistance;
                own.rolling = of_file.rolling.unwrap_or(own.rolling);
                own.spinning = of_file.spinning.unwrap_or(own.spinning);
                out.push(spec);
            }
            Err(why) => faults.push(ModelFault::Refused {
                what: format!("collision shape `{name}`: {why}"),
                help: "give that body primitive shapes or your own mesh as colliders",
            }),
        }
    }
    if faults.is_empty() { Ok(out) } else { Err(ModelError { faults }) }
}

/// Converts a shape of a file to a collision shape, or returns the reason why it cannot be one.
fn solid(g: &Geometry) -> Result<Shape, String> {
    Ok(match *g {
        Geometry::Box { size } => Shape::Box { half: 0.5 * Vec3::from(size) },
        Geometry::Sphere { radius } => Shape::Sphere { radius },
        Geometry::Ellipsoid { radii } => Shape::Ellipsoid { half: Vec3::from(radii) },
        Geometry::Cylinder { radius, length } => {
            Shape::Cylinder { radius, half_length: 0.5 * length }
        }
        Geometry::Capsule { radius, length } => {
            Shape::Capsule { radius, half_length: 0.5 * length }
        }
        Geometry::Plane { size: [0.0, 0.0] } => Shape::HalfSpace,
        Geometry::HeightField { columns, spacing, ref heights } => Shape::HeightField {
            x: columns,
            y: heights.len() / columns.max(1),
            spacing,
            heights: heights.as_slice().into(),
        },
        Geometry::Mesh { ref file, ref path, scale } => {
            let path = path.as_deref().ok_or_else(|| format!("`{file}` is not found"))?;
            let corners = mesh_corners(path).map_err(|e| format!("`{file}`: {e}"))?;
            let scale = Vec3::from(scale);
            Shape::ConvexHull { points: corners.iter().map(|p| p.component_mul(&scale)).collect() }
        }
        Geometry::Plane { .. } => {
            return Err(format!("{g:?} is not a solid"));
        }
    })
}

/// Collects loops and couplings with the degrees of freedom that they constrain. For a loop these are the ones between its ends.
fn closures_of(multibody: &Multibody) -> Vec<(Closure, Vec<usize>)> {
    let loops = multibody.loops().iter().enumerate().map(|(index, l)| {
        let path = |end: Option<BodyId>| -> Vec<BodyId> {
            end.map_or_else(Vec::new, |b| multibody.ancestors(b).collect())
        };
        let (a, b) = (path(l.a.body), path(l.b.body));
        let between =
            a.iter().filter(|x| !b.contains(x)).chain(b.iter().filter(|x| !a.contains(x)));
        let dofs = between.flat_map(|body| multibody.get(*body).v());
        (Closure::Loop { index }, dofs.collect())
    });
    let couplings = multibody.couplings().iter().enumerate();
    let couplings = couplings
        .map(|(index, c)| (Closure::Coupling { index }, c.terms.iter().map(|t| t.1).collect()));
    loops.chain(couplings).collect()
}

fn tip_name(part: &str) -> String {
    format!("tip of part {part}")
}

fn base_name(part: &str) -> String {
    format!("base of part {part}")
}

/// Adds nodes to the mechanism at the tip of every chain, and at its base where that is a body.
fn with_tips(
    mechanism: &Builder,
    bare: &Multibody,
    parts: &[Resolved],
) -> Result<Multibody, ModelError> {
    let mut builder = mechanism.clone();
    for p in parts {
        if let Some(chain) = &p.chain {
            let body = bare.get(chain.tip_body).name();
            builder.node(tip_name(&p.name), body, Pose::identity());
            if let Some(base) = p.bodies.first().and_then(|b| bare.get(*b).parent()) {
                builder.node(base_name(&p.name), bare.get(base).name(), Pose::identity());
            }
        }
    }
    let fault = |text| ModelError { faults: vec![ModelFault::Mechanism { text }] };
    builder.build().map_err(|e| fault(e.to_string()))
}

fn twice<'a>(
    kind: &'static str,
    names: impl Iterator<Item = &'a str>,
    faults: &mut Vec<ModelFault>,
) {
    let mut seen = BTreeMap::new();
    for name in names {
        let count: &mut usize = seen.entry(name).or_default();
        *count += 1;
        if *count == 2 {
            faults.push(ModelFault::Twice { kind, name: name.to_owned() });
        }
    }
}
