//! Bodies, joints and sites of an MJCF tree.
//!
//! ```text
//! D = C T(p_j)                 constant between the last subhinge and joint j's anchor
//! D S_a(q) = S_{Ra}(q) D       for a slide always; for a hinge when D only turns (R)
//! C ← D S_a(−ref) T(−p_j)
//! ```
//! Joints that can share a hinge become one chain of subhinges; where D moves the anchor of a later hinge, a massless body is inserted.

use super::defaults::MAIN;
use super::inside::Inside;
use super::{Classed, Mj};
use crate::error::FaultKind;
use crate::read::{Cx, root_body};
use crate::xml::Element;
use crate::{Description, Initial, Joint};
use linkwork_multibody::{BallLimits, BodySpec, Friction, Hinge, Limits, Subhinge, SubhingeKind};
use linkwork_names::suggest;
use linkwork_spatial::{Pose, Vec3};

/// A site, including sites on the world, which are not nodes.
pub(super) struct Site<'e> {
    pub body: String,
    pub pose: Pose,
    pub e: &'e Element,
    pub at: Classed<'e>,
}

/// Data of a joint for equalities.
#[derive(Clone, Copy)]
pub(super) struct JointRef {
    pub reference: f64,
    pub scalar: bool,
}

/// A body that is not read yet.
struct Pending<'e> {
    inside: Inside<'e>,
    parent: String,
    /// `X_WP` at the reference configuration.
    parent_pose: Pose,
}

/// A joint with its values.
struct Mover {
    name: String,
    kind: SubhingeKind,
    anchor: Vec3,
    reference: f64,
    subhinge: Subhinge,
    data: Joint,
}

impl<'e> Mj<'e> {
    /// Reads all bodies, without recursion, because chains may be long.
    pub fn bodies(&mut self, cx: &mut Cx<'_>, root: &'e Element, d: &mut Description) {
        let mut todo: Vec<Pending<'_>> = Vec::new();
        let mut worlds = 0;
        for world in root.all("worldbody") {
            worlds += 1;
            let class = self.class_of(cx, world, "childclass", MAIN);
            let inside = self.contents(cx, world, class);
            self.shapes_and_sites(cx, &inside, "world", d);
            push_bodies(&mut todo, inside, "world", Pose::identity());
        }
        if worlds == 0 {
            let help = "write <worldbody><body>..</body></worldbody>";
            cx.missing(root, "the model", "<worldbody>", help);
        }
        while let Some(next) = todo.pop() {
            self.body(cx, next, &mut todo, d);
        }
    }

    /// Returns the elements inside a body and its frames.
    fn contents(&self, cx: &mut Cx<'_>, e: &'e Element, class: &'e str) -> Vec<Inside<'e>> {
        let mut out = Vec::new();
        let mut open = vec![(e.children.iter(), Pose::identity(), class)];
        while let Some((children, pose, class)) = open.last_mut() {
            let (pose, class) = (*pose, *class);
            let Some(c) = children.next() else {
                open.pop();
                continue;
            };
            if c.name == "frame" {
                c.touch();
                let own = self.pose(cx, Classed { e: c, class, kind: "frame" }, "a <frame>");
                c.attr("name");
                let class = self.class_of(cx, c, "childclass", class);
                open.push((c.children.iter(), pose * own, class));
            } else {
                out.push(Inside { e: c, pose, class });
            }
        }
        out
    }

    fn body(
        &mut self,
        cx: &mut Cx<'_>,
        next: Pending<'e>,
        todo: &mut Vec<Pending<'e>>,
        d: &mut Description,
    ) {
        let (e, class) = (next.inside.e, next.inside.class);
        e.touch();
        let name = self.body_name(cx, e);
        let what = format!("body `{name}`");
        let X_PB = next.inside.pose * self.pose(cx, Classed { e, class, kind: "body" }, &what);
        let X_WB = next.parent_pose * X_PB;
        let class = self.class_of(cx, e, "childclass", class);
        self.elements.insert(name.clone(), e);
        self.poses.insert(name.clone(), X_WB);
        let inside = self.contents(cx, e, class);
        let joints = self.joints(cx, &inside, &name, &next.parent);
        let mass = self.mass(cx, e, &inside, &what);
        self.shapes_and_sites(cx, &inside, &name, d);
        let start = BodySpec::new(&name, &next.parent);
        let from = d.builder.bodies().len();
        chain(start, X_PB, joints, cx, d, next.parent == "world");
        if let Some(last) = d.builder.bodies_mut().last_mut() {
            last.mass = mass;
        }
        d.written_at(from, &e.place());
        push_bodies(todo, inside, &name, X_WB);
    }

    fn body_name(&mut self, cx: &mut Cx<'_>, e: &Element) -> String {
        let name = match e.attr("name") {
            Some(name) if !name.is_empty() => name.to_owned(),
            _ => loop {
                self.unnamed += 1;
                let name = format!("body{}", self.unnamed);
                if !self.elements.contains_key(&name) {
                    break name;
                }
            },
        };
        if name == "world" {
            let help = "`world` is the frame of <worldbody>; rename this body".to_owned();
            cx.fault(
                e.place_of("name"),
                FaultKind::BadName { kind: "body", name: name.clone(), help },
            );
        } else if let Some(first) = self.elements.get(&name) {
            let (first, name) = (first.place(), name.clone());
            cx.fault(e.place_of("name"), FaultKind::Duplicate { kind: "body", name, first });
        }
        name
    }

    fn joints(
        &mut self,
        cx: &mut Cx<'_>,
        inside: &[Inside<'e>],
        body: &str,
        parent: &str,
    ) -> Vec<Mover> {
        let mut out: Vec<Mover> = Vec::new();
        for i in inside.iter().filter(|i| matches!(i.e.name.as_str(), "joint" | "freejoint")) {
            i.e.touch();
            let name = match i.e.attr("name") {
                Some(n) if !n.is_empty() => n.to_owned(),
                _ => format!("{body}_joint{}", out.len() + 1),
            };
            let Some(mover) = self.joint(cx, i, &name, body) else { continue };
            self.spring_damper(cx, i, &name);
            self.joint_order.push(name.clone());
            let scalar = mover.kind.nv() == 1;
            let known = JointRef { reference: mover.reference, scalar };
            if self.joints.insert(name.clone(), known).is_some() {
                let what = format!("joint `{name}` is defined again");
                let help = "use different names".to_owned();
                cx.fault(i.e.place(), FaultKind::Unsupported { what, help });
            }
            if mover.kind == SubhingeKind::Free && parent != "world" {
                let what =
                    format!("joint `{name}` is free, but body `{body}` is not in <worldbody>");
                let help = "move the body there, or use slides and a ball".to_owned();
                cx.fault(i.e.place(), FaultKind::Unsupported { what, help });
            }
            out.push(mover);
        }
        if out.len() > 1
            && out.iter().any(|m| m.kind == SubhingeKind::Free)
            && let Some(first) = inside.iter().find(|i| i.e.name.ends_with("joint"))
        {
            let what = format!("body `{body}` has a free joint and other joints");
            let help = "a free joint must be the only joint".to_owned();
            cx.fault(first.e.place(), FaultKind::Unsupported { what, help });
        }
        out
    }

    fn joint(&self, cx: &mut Cx<'_>, i: &Inside<'e>, name: &str, body: &str) -> Option<Mover> {
        let what = format!("joint `{name}`");
        let (kind, anchor, reference) = (SubhingeKind::Free, Vec3::zeros(), 0.0);
        let data = Joint::new(name, body, 1);
        if i.e.name == "freejoint" {
            let subhinge = kind.into();
            return Some(Mover { name: name.into(), kind, anchor, reference, subhinge, data });
        }
        let at = self.classed(cx, i.e, i.class);
        let kind = self.joint_kind(cx, i, at, name)?;
        let mut out =
            Mover { name: name.into(), kind, anchor, reference, subhinge: kind.into(), data };
        out.subhinge.armature = self.size(cx, at, "armature", &what);
        out.data.damping = self.size(cx, at, "damping", &what);
        out.data.friction = self.size(cx, at, "frictionloss", &what);
        out.data.stiffness = self.size(cx, at, "stiffness", &what);
        out.subhinge.damping = out.data.damping;
        if kind == SubhingeKind::Free {
            self.free_joint(cx, i.e, &what, &out.data);
            return Some(out);
        }
        let anchor = self.numbers::<3>(cx, at, "pos", &what).unwrap_or_default();
        out.anchor = i.pose.transform_point(&Vec3::from(anchor));
        let turns = matches!(kind, SubhingeKind::Pin { .. } | SubhingeKind::Ball);
        let angle = if turns { self.of(i.e).angle } else { 1.0 };
        out.subhinge.spring.stiffness = out.data.stiffness;
        if kind.nv() == 1 {
            out.reference = self.number(cx, at, "ref", &what).unwrap_or(0.0) * angle;
            out.data.spring_reference =
                self.number(cx, at, "springref", &what).unwrap_or(0.0) * angle;
            out.subhinge.limits = self.limits(cx, at, &what, angle);
            out.subhinge.friction = Friction { force: out.data.friction, rate: 0.0 };
        } else {
            out.subhinge.ball = self.ball_limits(cx, at, &what, angle);
        }
        if out.data.stiffness != 0.0 {
            out.subhinge.spring.rest = out.data.spring_reference;
        }
        Some(out)
    }

    /// Returns the kind of a joint, with its axis in the body.
    fn joint_kind(
        &self,
        cx: &mut Cx<'_>,
        i: &Inside<'e>,
        at: Classed<'e>,
        name: &str,
    ) -> Option<SubhingeKind> {
        let (text, place) = self.attr(at, "type").unwrap_or(("hinge", i.e.place()));
        match text {
            "ball" => return Some(SubhingeKind::Ball),
            "free" => return Some(SubhingeKind::Free),
            "hinge" | "slide" => {}
            other => {
                let types = ["hinge", "slide", "ball", "free"];
                let help = suggest(other, "type", types);
                let (joint, kind) = (name.into(), other.into());
                cx.fault(place, FaultKind::UnknownJointType { joint, kind, help });
                return None;
            }
        }
        let what = format!("joint `{name}`");
        let axis = self.numbers::<3>(cx, at, "axis", &what).map_or(Vec3::z(), Vec3::from);
        let (written, place) = self.attr(at, "axis").unwrap_or(("", i.e.place()));
        let what = format!("{what}: `axis`");
        let axis = cx.unit(place, axis, written, &what).unwrap_or_else(Vec3::z);
        let axis = i.pose.transform_vector(&axis);
        Some(match text {
            "hinge" => SubhingeKind::Pin { axis },
            _ => SubhingeKind::Slider { axis },
        })
    }

    /// Reports unused attributes of a free joint, its own or those of its class.
    fn free_joint(&self, cx: &mut Cx<'_>, e: &Element, what: &str, data: &Joint) {
        for (name, value) in [("stiffness", data.stiffness), ("frictionloss", data.friction)] {
            if value != 0.0 {
                let note = format!("attribute {name}=\"{value}\" of a free joint");
                cx.ignored.push(e.ignored(what, note));
            }
        }
    }

    /// Reads `range="0 angle"` of a ball: the largest angle of its whole rotation.
    fn ball_limits(&self, cx: &mut Cx<'_>, at: Classed<'e>, what: &str, unit: f64) -> BallLimits {
        match self.range(cx, at, ("limited", "range"), what) {
            Some([lower, upper]) if lower == 0.0 && upper > 0.0 => {
                BallLimits { angle: upper * unit, ..BallLimits::NONE }
            }
            Some(_) => {
                let (text, place) = self.attr(at, "range").unwrap_or(("", at.e.place()));
                let what = format!("{what}: `range`");
                cx.bad(place, &what, text, "0 and an angle", "write range=\"0 ANGLE\" for a ball");
                BallLimits::NONE
            }
            None => BallLimits::NONE,
        }
    }

    /// Reads an active range. With `autolimits`, a range is active if its first number is smaller than the second.
    pub(super) fn range(
        &self,
        cx: &mut Cx<'_>,
        at: Classed<'e>,
        (limited, range): (&str, &str),
        what: &str,
    ) -> Option<[f64; 2]> {
        let flag = self.flag(cx, at, limited, what);
        let [lower, upper] = self.numbers::<2>(cx, at, range, what)?;
        let (text, place) = self.attr(at, range)?;
        match flag {
            Some(false) => None,
            None if !self.of(at.e).autolimits => {
                let fact =
                    format!("{what} has `{range}` but no `{limited}`, and `autolimits` is false");
                let help = format!("write {limited}=\"true\" or {limited}=\"false\"");
                cx.fault(place, FaultKind::Unsupported { what: fact, help });
                None
            }
            None if lower == upper => None,
            _ if lower < upper => Some([lower, upper]),
            _ => {
                let help = "write the lower number first";
                cx.bad(place, &format!("{what}: `{range}`"), text, "a range", help);
                None
            }
        }
    }

    fn limits(&self, cx: &mut Cx<'_>, at: Classed<'e>, what: &str, angle: f64) -> Limits {
        let mut limits = Limits::NONE;
        if let Some([lower, upper]) = self.range(cx, at, ("limited", "range"), what) {
            (limits.lower, limits.upper) = (lower * angle, upper * angle);
        }
        let names = ("actuatorfrclimited", "actuatorfrcrange");
        if let Some([lower, upper]) = self.range(cx, at, names, what) {
            limits.effort = upper.abs().max(lower.abs());
            if lower != -upper {
                let note =
                    format!("actuatorfrcrange {lower} .. {upper} is kept as ±{}", limits.effort);
                cx.ignored.push(at.e.ignored(what, note));
            }
        }
        limits
    }

    fn shapes_and_sites(
        &mut self,
        cx: &mut Cx<'_>,
        inside: &[Inside<'e>],
        body: &str,
        d: &mut Description,
    ) {
        for i in inside.iter().filter(|i| i.e.name == "geom") {
            self.shape(cx, i, body, d);
        }
        for i in inside.iter().filter(|i| i.e.name == "site") {
            // A site without a name stays in the list of unused elements.
            let Some((_, place)) =
                self.attr(Classed { e: i.e, class: i.class, kind: &i.e.name }, "name")
            else {
                continue;
            };
            i.e.touch();
            let name = i.e.attr("name").unwrap_or_default();
            let at = self.classed(cx, i.e, i.class);
            let pose = i.pose * self.pose(cx, at, &format!("site `{name}`"));
            if let Some(first) = self.sites.get(name) {
                let (name, first) = (name.to_owned(), first.e.place());
                cx.fault(place, FaultKind::Duplicate { kind: "site", name, first });
                continue;
            }
            self.sites.insert(name, Site { body: body.into(), pose, e: i.e, at });
            if body == "world" {
                let path = format!("mujoco/worldbody/{}", i.e.label());
                cx.ignored.push(i.e.ignored(path, "a site on the world is not a node"));
            } else {
                d.builder.node(name, body, pose);
            }
        }
    }
}

fn push_bodies<'e>(
    todo: &mut Vec<Pending<'e>>,
    inside: Vec<Inside<'e>>,
    parent: &str,
    parent_pose: Pose,
) {
    let bodies = inside.into_iter().filter(|i| i.e.name == "body").rev();
    todo.extend(bodies.map(|inside| Pending { inside, parent: parent.into(), parent_pose }));
}

/// Adds the body with its joints, and massless bodies if one hinge is not sufficient.
fn chain(
    start: BodySpec,
    X_PB: Pose,
    joints: Vec<Mover>,
    cx: &Cx<'_>,
    d: &mut Description,
    on_world: bool,
) {
    let name = start.name.clone();
    let mut spec = start;
    if joints.is_empty() {
        match on_world {
            true => root_body(cx, spec, X_PB, Hinge::locked(), d),
            false => drop(d.builder.body(spec.hinge_in_parent(X_PB))),
        }
        return;
    }
    let (mut C, mut q, mut moved, mut fresh) = (X_PB, Vec::new(), false, true);
    let mut carried = Vec::new(); // joints of this link of the chain
    for j in joints {
        if j.kind == SubhingeKind::Free {
            // As in MuJoCo, the coordinates of a free joint are the pose in the world.
            let subhinges = free_subhinges(j.subhinge);
            let (p, r) = (X_PB.position, X_PB.rotation.coords);
            q.extend([p.x, p.y, p.z, r.x, r.y, r.z, r.w]);
            moved |= X_PB != Pose::identity();
            carried.push(Joint { subhinge: 0, count: subhinges.len(), ..j.data });
            spec.hinge.subhinges.extend(subhinges);
            C = Pose::identity();
            continue;
        }
        let D = C * Pose::translation(j.anchor.x, j.anchor.y, j.anchor.z);
        let shares = match j.kind {
            SubhingeKind::Slider { .. } => true,
            SubhingeKind::Ball => D == Pose::identity(),
            _ => D.position.amax() <= 1e-15,
        };
        if fresh || !shares {
            if !fresh {
                let link = format!("{name}/{}", j.name);
                let parent = std::mem::replace(&mut spec, BodySpec::new(&name, &link));
                add(d, BodySpec { name: link, ..parent }, &mut carried, &mut q, &mut moved);
            }
            spec.hinge_in_parent = D;
            C = Pose::identity();
        } else {
            C = D;
        }
        fresh = false;
        let (kind, back) = turned(j.kind, &C, j.reference);
        carried.push(Joint { subhinge: spec.hinge.subhinges.len(), ..j.data });
        spec.hinge.subhinges.push(Subhinge { kind, ..j.subhinge });
        match kind {
            SubhingeKind::Ball => q.extend([0.0, 0.0, 0.0, 1.0]),
            _ => q.push(j.reference),
        }
        moved |= j.reference != 0.0;
        C = C * back * Pose::translation(-j.anchor.x, -j.anchor.y, -j.anchor.z);
    }
    spec.hinge_in_body = C.inverse();
    add(d, spec, &mut carried, &mut q, &mut moved);
}

/// Returns a free joint as one subhinge. A free subhinge has no armature and no damping: a joint with either becomes three
/// sliders along the axes of the world and a ball, which have the same coordinates and rates.
fn free_subhinges(s: Subhinge) -> Vec<Subhinge> {
    if s.armature == 0.0 && s.damping == 0.0 {
        return vec![s];
    }
    let sliders = [Vec3::x(), Vec3::y(), Vec3::z()].map(|axis| SubhingeKind::Slider { axis });
    let kinds = sliders.into_iter().chain([SubhingeKind::Ball]);
    kinds.map(|kind| Subhinge { kind, ..s }).collect()
}

/// Returns the subhinge with its axis rotated by C, and S(−ref) in the joint's own axes.
fn turned(kind: SubhingeKind, C: &Pose, reference: f64) -> (SubhingeKind, Pose) {
    let back = match kind {
        SubhingeKind::Ball => Pose::identity(),
        _ if reference == 0.0 => Pose::identity(),
        _ => kind.pose(&[-reference]),
    };
    let axis = |a: Vec3| C.transform_vector(&a);
    let kind = match kind {
        SubhingeKind::Pin { axis: a } => SubhingeKind::Pin { axis: axis(a) },
        SubhingeKind::Slider { axis: a } => SubhingeKind::Slider { axis: axis(a) },
        other => other,
    };
    (kind, back)
}

fn add(
    d: &mut Description,
    spec: BodySpec,
    joints: &mut Vec<Joint>,
    q: &mut Vec<f64>,
    moved: &mut bool,
) {
    let body = spec.name.clone();
    d.joints.extend(joints.drain(..).map(|j| Joint { body: body.clone(), ..j }));
    let q = std::mem::take(q);
    if std::mem::take(moved) {
        d.initial.push(Initial { body, q });
    }
    d.builder.body(spec);
}
