//! The model: constant, checked, shared.

use crate::collision::Scene;
use crate::error::{ModelError, ModelFault, RobotError};
use crate::linkage::{Linkage, linkages};
use crate::part::{Chain, Part, PartSpec, Resolved, resolve};
use linkwork_collision::{ColliderId, ColliderSpec, Rules, Shape};
use linkwork_dynamics::Tree;
use linkwork_formats::{
    Description, Geometry, ReadOptions, ShapeRole, Srdf, read_file, read_srdf_file,
};
use linkwork_multibody::names::suggest;
use linkwork_multibody::{BodyId, Builder, HingeCoordinate, Limits, Multibody, NodeId};
use linkwork_spatial::{MassProperties, Pose, RigidInertia, Vec3};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

/// What a model is made of. [`RobotModel::new`] checks it.
#[derive(Clone, Debug, Default)]
pub struct ModelSpec {
    /// Bodies and hinges. Loops and couplings are refused.
    pub mechanism: Builder,
    /// Parts by name.
    pub parts: Vec<PartSpec>,
    /// Objects that hands may hold.
    pub objects: Vec<ObjectSpec>,
    /// Bodies that hang on objects by hinges: the parent of each is an object's name or another's of these. Loops and couplings are refused.
    pub linkages: Builder,
    /// Shapes on bodies, on objects and their bodies (by name) and in the world.
    pub colliders: Vec<ColliderSpec>,
    /// Which of them meet; what a hand holds is told apart from it by itself.
    pub rules: Rules,
    /// Names of joints, and what they move.
    pub joints: BTreeMap<String, HingeCoordinate>,
    /// What the files say beside this and nobody uses: one line each.
    pub unused: Vec<String>,
    /// Mass properties of the files that no body has and that were read all the same ([`Unphysical::Read`](linkwork_formats::Unphysical::Read)): a line
    /// each, with link and numbers.
    pub doubtful: Vec<String>,
}

impl ModelSpec {
    /// The mechanism of a description, with its joints' names.
    ///
    /// # Errors
    /// A description with loops or couplings: the embedded model is a tree.
    pub fn from_description(d: &Description) -> Result<Self, ModelError> {
        let mut faults = Vec::new();
        let help = "remove it from the description, and keep it in the software that needs it";
        for l in &d.loops {
            faults.push(ModelFault::Refused { what: format!("loop `{}`", l.name), help });
        }
        for c in &d.couplings {
            faults.push(ModelFault::Refused { what: format!("coupling `{}`", c.name), help });
        }
        if !faults.is_empty() {
            return Err(ModelError { faults });
        }
        // By the joints themselves: looking each up by its name would take the square of their number.
        let joints = d.joints.iter().filter(|j| j.count == 1).map(|j| {
            (j.name.clone(), HingeCoordinate { body: j.body.clone(), subhinge: j.subhinge })
        });
        Ok(Self {
            mechanism: d.builder.clone(),
            joints: joints.collect(),
            unused: d.ignored.iter().map(ToString::to_string).collect(),
            doubtful: d.doubtful.iter().map(ToString::to_string).collect(),
            ..Self::default()
        })
    }

    /// Adds the [collision shapes](colliders_of) of a description.
    ///
    /// # Errors
    /// Shapes that a collider cannot be.
    pub fn shapes(mut self, d: &Description) -> Result<Self, ModelError> {
        self.colliders.extend(colliders_of(d)?);
        Ok(self)
    }

    /// Adds the groups of an SRDF file as parts: one chain each, or the bodies of its links, joints
    /// and chains. Its pairs without collision are added to the rules, what else the file says to `unused`.
    ///
    /// # Errors
    /// Joints or links that the mechanism has not.
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
                // A group of groups: its members are parts of their own.
                self.unused.push(format!("SRDF: group `{}` has no links of its own", g.name));
                continue;
            }
            self.parts.push(PartSpec::Bodies { name: g.name.clone(), bodies });
        }
        self.rules.ignore.extend(srdf.ignore.iter().cloned());
        self.unused.extend(srdf.ignored.iter().map(ToString::to_string));
        if faults.is_empty() { Ok(self) } else { Err(ModelError { faults }) }
    }
}

/// An object that a hand may hold: rigid, unless [`ModelSpec::linkages`] has bodies that hang on it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ObjectSpec {
    /// Its name.
    pub name: String,
    /// Mass properties in its own axes; without those of bodies that hang on it.
    pub mass: MassProperties,
}

/// An object of one [`RobotModel`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Object(pub(crate) u32);

impl Object {
    /// Its place among the model's objects.
    #[must_use]
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// What never changes about a robot: mechanism, parts, objects. Shared by any number of [`Robot`](crate::Robot)s.
#[derive(Debug)]
pub struct RobotModel {
    pub(crate) tree: Tree,
    pub(crate) parts: Vec<Resolved>,
    /// In the whole: the tip of each part that is a chain.
    pub(crate) tips: Vec<Option<NodeId>>,
    pub(crate) objects: Vec<(String, RigidInertia)>,
    /// For each object: what hangs on it.
    pub(crate) linkages: Vec<Option<Linkage>>,
    /// For each number of β with one number of q: its place there, and its limits.
    pub(crate) limits: Vec<Option<(usize, Limits)>>,
    pub(crate) scene: Scene,
    joints: BTreeMap<String, (usize, usize)>,
    unused: Vec<String>,
    doubtful: Vec<String>,
}

impl RobotModel {
    /// Checks everything. O(parts · bodies).
    ///
    /// # Errors
    /// All that is wrong, at once.
    pub fn new(spec: &ModelSpec) -> Result<Arc<Self>, ModelError> {
        let mut faults = Vec::new();
        let help = "leave it out: the embedded model is a tree";
        let names = spec.mechanism.loops().iter().map(|l| format!("loop `{}`", l.name));
        let couplings = spec.mechanism.couplings().iter();
        let names = names.chain(couplings.map(|c| format!("coupling `{}`", c.name)));
        faults.extend(names.map(|what| ModelFault::Refused { what, help }));
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
        let bare = match spec.mechanism.build() {
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
        let multibody = with_tips(&spec.mechanism, &bare, &parts)?;
        let tips = parts.iter().map(|p| multibody.node(&tip_name(&p.name))).collect();
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
        Ok(Arc::new(Self {
            tree: Tree::new(&multibody),
            parts,
            tips,
            objects,
            linkages,
            limits,
            scene,
            joints,
            unused: spec.unused.clone(),
            doubtful: spec.doubtful.clone(),
        }))
    }

    /// A robot from a URDF (MJCF, SDF) file; parts from the groups of an SRDF file, where one is given. Look at [`doubtful`](Self::doubtful)
    /// afterwards, unless the options refuse such numbers.
    ///
    /// # Errors
    /// All that is wrong with the files and the parts.
    pub fn load(
        robot: impl AsRef<Path>,
        groups: Option<&Path>,
        options: &ReadOptions,
    ) -> Result<Arc<Self>, ModelError> {
        let file = |e: String| ModelError { faults: vec![ModelFault::File { text: e }] };
        let d = read_file(robot, options).map_err(|e| file(e.to_string()))?;
        let mut spec = ModelSpec::from_description(&d)?;
        if let Some(path) = groups {
            let srdf = read_srdf_file(path).map_err(|e| file(e.to_string()))?;
            spec = spec.groups(&srdf, &d)?;
        }
        Self::new(&spec)
    }

    /// The mechanism.
    #[must_use]
    pub fn multibody(&self) -> &Multibody {
        self.tree.multibody()
    }

    /// Numbers of q.
    #[must_use]
    pub fn nq(&self) -> usize {
        self.tree.nq()
    }

    /// Degrees of freedom.
    #[must_use]
    pub fn nv(&self) -> usize {
        self.tree.nv()
    }

    /// The part of that name.
    #[must_use]
    pub fn part(&self, name: &str) -> Option<Part> {
        self.parts.iter().position(|p| p.name == name).map(|i| Part(i as u32))
    }

    /// All parts with their names, in the order in which they were given.
    pub fn parts(&self) -> impl ExactSizeIterator<Item = (Part, &str)> {
        self.parts.iter().enumerate().map(|(i, p)| (Part(i as u32), p.name.as_str()))
    }

    /// The bodies of a part, inboard ones first.
    ///
    /// # Errors
    /// [`RobotError::ForeignHandle`].
    pub fn bodies(&self, part: Part) -> Result<&[BodyId], RobotError> {
        self.parts.get(part.index()).map(|p| &p.bodies[..]).ok_or(RobotError::ForeignHandle)
    }

    /// Places in β of the degrees of freedom of a chain: the columns of its Jacobian.
    ///
    /// # Errors
    /// [`RobotError::ForeignHandle`], [`RobotError::NotAChain`].
    pub fn dofs(&self, part: Part) -> Result<&[usize], RobotError> {
        self.chain(part).map(|c| &c.v[..])
    }

    /// The object of that name.
    #[must_use]
    pub fn object(&self, name: &str) -> Option<Object> {
        self.objects.iter().position(|o| o.0 == name).map(|i| Object(i as u32))
    }

    /// All objects with their names, in the order in which they were given.
    pub fn objects(&self) -> impl ExactSizeIterator<Item = (Object, &str)> {
        self.objects.iter().enumerate().map(|(i, o)| (Object(i as u32), o.0.as_str()))
    }

    /// The bodies of an object with joints: the object itself on a free hinge, of which no call makes use, and what hangs on it. `None` for a rigid one.
    #[must_use]
    pub fn object_multibody(&self, object: Object) -> Option<&Multibody> {
        Some(self.linkages.get(object.index())?.as_ref()?.multibody())
    }

    /// A body of an object with joints, by name.
    #[must_use]
    pub fn object_body(&self, object: Object, name: &str) -> Option<BodyId> {
        self.object_multibody(object)?.body(name)
    }

    /// The collider of that name.
    #[must_use]
    pub fn collider(&self, name: &str) -> Option<ColliderId> {
        self.scene.colliders.find(name)
    }

    /// All colliders with their names, in the order of names.
    pub fn colliders(&self) -> impl ExactSizeIterator<Item = (ColliderId, &str)> {
        self.scene.colliders.ids().map(|i| (i, self.scene.colliders.spec(i).name.as_str()))
    }

    /// The name of a collider.
    #[must_use]
    #[track_caller]
    pub fn collider_name(&self, id: ColliderId) -> &str {
        &self.scene.colliders.spec(id).name
    }

    /// What a collider was made of.
    #[must_use]
    #[track_caller]
    pub fn collider_spec(&self, id: ColliderId) -> &ColliderSpec {
        self.scene.colliders.spec(id)
    }

    /// Places in q and β of a joint with one coordinate, by the name that the file gives it.
    #[must_use]
    pub fn coordinate(&self, joint: &str) -> Option<(usize, usize)> {
        self.joints.get(joint).copied()
    }

    /// What the files say and the model does not use, one line each.
    #[must_use]
    pub fn unused(&self) -> &[String] {
        &self.unused
    }

    /// Mass properties of the files that no body has and that were read all the same: warnings, one line each, with link and numbers.
    /// [`Unphysical::Refused`](linkwork_formats::Unphysical::Refused) refuses them instead.
    #[must_use]
    pub fn doubtful(&self) -> &[String] {
        &self.doubtful
    }

    pub(crate) fn chain(&self, part: Part) -> Result<&Chain, RobotError> {
        let found = self.parts.get(part.index()).ok_or(RobotError::ForeignHandle)?;
        found.chain.as_ref().ok_or(RobotError::NotAChain { part: part.index() })
    }

    /// The tip of a chain in the whole mechanism.
    pub(crate) fn tip(&self, part: Part) -> Result<NodeId, RobotError> {
        let tip = self.tips.get(part.index()).ok_or(RobotError::ForeignHandle)?;
        tip.ok_or(RobotError::NotAChain { part: part.index() })
    }
}

/// The collision shapes of a description as colliders, by their own names where they have one that is free, else
/// `body/number` (from 0).
///
/// # Errors
/// Shapes that a collider cannot be: mesh files, ellipsoids, planes with an end. All at once; none is left out in silence.
pub fn colliders_of(d: &Description) -> Result<Vec<ColliderSpec>, ModelError> {
    let (mut out, mut faults) = (Vec::<ColliderSpec>::new(), Vec::new());
    let mut count: BTreeMap<&str, usize> = BTreeMap::new();
    for s in d.shapes.iter().filter(|s| s.role != ShapeRole::Visual) {
        let number = count.entry(&s.body).or_default();
        let numbered = format!("{}/{number}", s.body);
        *number += 1;
        let taken = out.iter().any(|c| c.name == s.name);
        let name = if s.name.is_empty() || taken { numbered } else { s.name.clone() };
        match solid(&s.geometry) {
            Some(shape) => out.push(ColliderSpec::new(name, &s.body, shape).at(s.pose)),
            None => faults.push(ModelFault::Refused {
                what: format!("collision shape `{name}`: {:?}", s.geometry),
                help: "give that body solids (or a mesh of your own) as colliders instead",
            }),
        }
    }
    if faults.is_empty() { Ok(out) } else { Err(ModelError { faults }) }
}

/// A shape of a file as one that collides.
fn solid(g: &Geometry) -> Option<Shape> {
    Some(match *g {
        Geometry::Box { size } => Shape::Box { half: 0.5 * Vec3::from(size) },
        Geometry::Sphere { radius } => Shape::Sphere { radius },
        Geometry::Cylinder { radius, length } => {
            Shape::Cylinder { radius, half_length: 0.5 * length }
        }
        Geometry::Capsule { radius, length } => {
            Shape::Capsule { radius, half_length: 0.5 * length }
        }
        Geometry::Plane { size: [0.0, 0.0] } => Shape::HalfSpace,
        Geometry::Plane { .. } | Geometry::Ellipsoid { .. } | Geometry::Mesh { .. } => return None,
    })
}

fn tip_name(part: &str) -> String {
    format!("tip of part {part}")
}

/// The mechanism with a node at the tip of every chain.
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
