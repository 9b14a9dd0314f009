//! URDF: links and joints by name, one tree.
//!
//! ```text
//! X_PJ = origin of the joint in the parent link      X_BJ = 1: a link's frame is its joint's frame
//! J_c  = R(rpy) J R(rpy)ᵀ                            inertia in link axes about the centre of mass
//! mimic: q = multiplier · q_other + offset
//! ```
//! A root link `world` without mass is the world itself.

use crate::error::FaultKind;
use crate::read::{Cx, ReadOptions, Root, Unphysical, report_massless, root_hinge};
use crate::xml::{Element, parse};
use crate::{BodyShape, Coupling, Description, FormatError, Joint, ShapeRole, gazebo, geometry};
use linkwork_multibody::{BodySpec, Friction, Hinge, HingeCoordinate, Limits, SubhingeKind};
use linkwork_names::suggest;
use linkwork_spatial::{MassProperties, Mat3, Pose, Vec3};
use std::collections::{BTreeMap, BTreeSet};

const TYPES: [&str; 6] = ["fixed", "revolute", "continuous", "prismatic", "floating", "planar"];

/// Reads a URDF text.
///
/// # Errors
/// Every mistake: malformed XML, xacro, missing or duplicate names, unknown joint types, circular links, several roots, invalid numbers, inertias
/// that no rigid body can have.
pub fn read_urdf(text: &str, options: &ReadOptions) -> Result<Description, FormatError> {
    let root = parse(text, &options.file_name())?;
    let mut cx = Cx::new(options);
    if root.name != "robot" {
        let help = "a URDF file is <robot name=\"..\"> .. </robot>".to_owned();
        let kind = FaultKind::WrongRoot { found: root.name.clone(), expected: "<robot>", help };
        cx.fault(root.place(), kind);
        return cx.finish(&root, Description::default());
    }
    cx.refuse_xacro(&root);
    if !cx.faults.is_empty() {
        return cx.finish(&root, Description::default());
    }
    let mut d = Description::default();
    version(&mut cx, &root);
    d.name = root.attr("name").unwrap_or_default().to_owned();
    let mut reader =
        Urdf { links: BTreeMap::new(), movers: BTreeMap::new(), colors: colors(&mut cx, &root) };
    reader.names(&mut cx, &root);
    let base = reader.tree(&mut cx, &root);
    reader.build(&mut cx, base, &mut d);
    reader.mimics(&mut cx, &mut d);
    gazebo::apply(&mut cx, &root, &mut d, |name| reader.links.contains_key(name));
    let place = |body: &str| reader.links.get(body).map(|e| (*e, format!("robot/{}", e.label())));
    report_massless(&mut cx, &d.builder, place);
    cx.finish(&root, d)
}

/// Checks the version: 1.0, 1.1 or 1.2. Quaternions belong to 1.1; a reader of 1.0 ignores them.
fn version(cx: &mut Cx<'_>, root: &Element) {
    let version = root.attr("version").unwrap_or("1.0");
    if !["1.0", "1.1", "1.2"].contains(&version) {
        let (what, place) = ("<robot>: `version`", root.place_of("version"));
        cx.bad(place, what, version, "a supported version", "one of: 1.0, 1.1, 1.2");
    }
    if version == "1.0" {
        refuse_quaternions(cx, root);
    }
}

fn refuse_quaternions(cx: &mut Cx<'_>, e: &Element) {
    for c in &e.children {
        if c.name == "origin" && c.attributes.iter().any(|a| a.name == "quat_xyzw") {
            let what = format!("<{}>: <origin>: an attribute", e.name);
            let help = "write <robot version=\"1.1\"> or rpy";
            cx.bad(c.place_of("quat_xyzw"), &what, "quat_xyzw", "part of version 1.0", help);
        }
        refuse_quaternions(cx, c);
    }
}

/// The joint of a child link.
struct Mover<'e> {
    name: &'e str,
    parent: &'e str,
    e: &'e Element,
}

struct Urdf<'e> {
    links: BTreeMap<&'e str, &'e Element>,
    /// Joints by the name of the child link.
    movers: BTreeMap<&'e str, Mover<'e>>,
    colors: BTreeMap<&'e str, [f64; 4]>,
}

impl<'e> Urdf<'e> {
    /// Collects all links and joints by name.
    fn names(&mut self, cx: &mut Cx<'_>, root: &'e Element) {
        for e in root.all("link") {
            let Some(name) = cx.required(e, "name", "a <link>") else { continue };
            match self.links.get(name) {
                Some(first) => duplicate(cx, "link", name, first, e),
                None => drop(self.links.insert(name, e)),
            }
        }
        let mut joints: BTreeMap<&str, &Element> = BTreeMap::new();
        // Read only joints with a parent element, because the <joint> of a transmission is
        // different.
        for e in root.all("joint") {
            let Some(name) = cx.required(e, "name", "a <joint>") else { continue };
            match joints.get(name) {
                Some(first) => duplicate(cx, "joint", name, first, e),
                None => drop(joints.insert(name, e)),
            }
            let ends = (self.end(cx, e, name, "parent"), self.end(cx, e, name, "child"));
            let (Some(parent), Some(child)) = ends else { continue };
            match self.movers.get(child) {
                Some(first) => {
                    let (link, joint, first) = (child.into(), name.into(), first.name.into());
                    cx.fault(e.place(), FaultKind::TwoParents { link, joint, first });
                }
                None => drop(self.movers.insert(child, Mover { name, parent, e })),
            }
        }
    }

    /// Returns the parent or child link of a joint.
    fn end(&self, cx: &mut Cx<'_>, e: &'e Element, joint: &str, which: &str) -> Option<&'e str> {
        let what = format!("joint `{joint}`");
        let Some(end) = e.child(which) else {
            cx.missing(e, &what, &format!("<{which}>"), format!("write <{which} link=\"..\"/>"));
            return None;
        };
        let link = cx.required(end, "link", &format!("{what}: <{which}>"))?;
        if !self.links.contains_key(link) {
            let what = format!("{what}: <{which}>");
            cx.unknown(end.place_of("link"), &what, "link", link, self.links.keys().copied());
            return None;
        }
        Some(link)
    }

    /// Returns the root link; reports circular links, several roots, and the name `world` elsewhere.
    fn tree(&self, cx: &mut Cx<'_>, root: &Element) -> Option<&'e str> {
        if self.links.is_empty() {
            if cx.faults.is_empty() {
                cx.missing(root, "the robot", "<link>", "write at least one <link name=\"..\"/>");
            }
            return None;
        }
        self.rings(cx);
        let roots: Vec<&str> =
            self.links.keys().copied().filter(|l| !self.movers.contains_key(l)).collect();
        // An invalid joint makes its child look like a root, so report several roots only without
        // other faults.
        if roots.len() > 1 && cx.faults.is_empty() {
            let names = roots.iter().map(|r| (*r).to_owned()).collect();
            let second = self.links[roots[1]];
            cx.fault(second.place(), FaultKind::SeveralRoots { roots: names });
        }
        let base = *roots.first()?;
        if let Some(e) = self.links.get("world").filter(|_| base != "world") {
            let help = "only the root may have the name `world`; rename this link".to_owned();
            let kind = FaultKind::BadName { kind: "link", name: "world".into(), help };
            cx.fault(e.place_of("name"), kind);
        }
        Some(base)
    }

    fn rings(&self, cx: &mut Cx<'_>) {
        // For each link, the number of the first walk that reached it.
        let mut walks: BTreeMap<&str, usize> = BTreeMap::new();
        for (n, &start) in self.links.keys().enumerate() {
            let (mut path, mut at) = (Vec::new(), Some(start));
            while let Some(link) = at.filter(|l| !walks.contains_key(l)) {
                walks.insert(link, n);
                path.push(link);
                at = self.movers.get(link).map(|m| m.parent);
            }
            if let Some(first) = at.and_then(|l| path.iter().position(|p| *p == l)) {
                let ring = path[first..].iter().chain([&path[first]]).map(|l| (*l).to_owned());
                let place = self.movers[path[first]].e.place();
                cx.fault(place, FaultKind::Cycle { path: ring.collect() });
            }
        }
    }

    fn build(&self, cx: &mut Cx<'_>, base: Option<&str>, d: &mut Description) {
        for (&name, &e) in &self.links {
            let what = format!("link `{name}`");
            let mass = inertial(cx, e, &what);
            for (list, role) in [("visual", ShapeRole::Visual), ("collision", ShapeRole::Collision)]
            {
                for s in e.all(list) {
                    self.shape(cx, s, name, role, d);
                }
            }
            if base == Some(name) && name == "world" {
                self.world(cx, e, mass);
                continue;
            }
            let from = d.builder.bodies().len();
            let spec = match self.movers.get(name) {
                Some(m) => mover(cx, name, m, d),
                None => {
                    BodySpec::new(name, "world").hinge(root_hinge(cx.options.root, Hinge::locked()))
                }
            };
            d.builder.body(spec.mass(mass));
            d.written_at(from, &e.place());
        }
    }

    /// A root link `world` is the world, which has no mass and no hinge.
    fn world(&self, cx: &mut Cx<'_>, e: &Element, mass: MassProperties) {
        if mass != MassProperties::massless() {
            let help = "rename the link, or remove its <inertial>".to_owned();
            let kind = FaultKind::BadName { kind: "link", name: "world".into(), help };
            cx.fault(e.place(), kind);
        }
        if matches!(cx.options.root, Root::Free | Root::Planar) {
            let what = "the root link is `world`, which cannot have a hinge".to_owned();
            let help = "remove the link `world` and its joint, or read it with its root as written"
                .to_owned();
            cx.fault(e.place(), FaultKind::Unsupported { what, help });
        }
    }

    fn shape(
        &self,
        cx: &mut Cx<'_>,
        e: &'e Element,
        body: &str,
        role: ShapeRole,
        d: &mut Description,
    ) {
        let what = format!("link `{body}`: <{}>", e.name);
        let pose = geometry::urdf_origin(cx, e, &what);
        let color = e.child("material").and_then(|m| {
            let own = m.child("color").and_then(|c| cx.numbers::<4>(c, "rgba", &what));
            own.or_else(|| self.colors.get(m.attr("name")?).copied())
        });
        let Some(g) = e.child("geometry") else {
            cx.missing(
                e,
                &what,
                "<geometry>",
                "write <geometry><sphere radius=\"..\"/></geometry>",
            );
            return;
        };
        let name = e.attr("name").unwrap_or_default().to_owned();
        if let Some(geometry) = geometry::urdf(cx, g, &what) {
            let shape = BodyShape::new(body, role, pose, geometry);
            d.shapes.push(BodyShape { name, color, ..shape });
        }
    }

    fn mimics(&self, cx: &mut Cx<'_>, d: &mut Description) {
        let coordinates: BTreeMap<String, HingeCoordinate> =
            d.coordinates().into_iter().map(|(name, at)| (name.to_owned(), at)).collect();
        let names: BTreeSet<&str> = self.movers.values().map(|o| o.name).collect();
        for (child, m) in &self.movers {
            let Some(own) = coordinates.get(m.name).cloned() else { continue };
            let Some(e) = m.e.child("mimic") else { continue };
            let what = format!("joint `{}`: <mimic>", m.name);
            let Some(other) = cx.required(e, "joint", &what) else { continue };
            let ratio = cx.number(e, "multiplier", &what).unwrap_or(1.0);
            let offset = cx.number(e, "offset", &what).unwrap_or(0.0);
            match coordinates.get(other).cloned() {
                Some(at) if at.body == **child => {
                    let kind = FaultKind::BadValue {
                        what: format!("{what}: `joint`"),
                        text: other.into(),
                        expected: "another joint".into(),
                        help: "write the name of the joint that this one follows".into(),
                    };
                    cx.fault(e.place_of("joint"), kind);
                }
                Some(at) => d.couplings.push(Coupling::mimic(m.name, own, at, ratio, offset)),
                None if names.contains(other) => {
                    let what = format!(
                        "`{}` follows `{other}`, which does not have exactly one coordinate",
                        m.name
                    );
                    cx.ignored.push(e.ignored(format!("robot/{}/mimic", m.e.label()), what));
                }
                None => {
                    let names = names.iter().copied();
                    cx.unknown(e.place_of("joint"), &what, "joint", other, names);
                }
            }
        }
    }
}

fn duplicate(cx: &mut Cx<'_>, kind: &'static str, name: &str, first: &Element, e: &Element) {
    let (name, first) = (name.into(), first.place());
    cx.fault(e.place_of("name"), FaultKind::Duplicate { kind, name, first });
}

fn colors<'e>(cx: &mut Cx<'_>, root: &'e Element) -> BTreeMap<&'e str, [f64; 4]> {
    let mut out = BTreeMap::new();
    for m in root.all("material") {
        let color = m.child("color").and_then(|c| cx.numbers::<4>(c, "rgba", "a <material>"));
        if let (Some(name), Some(color)) = (m.attr("name"), color) {
            out.insert(name, color);
        }
    }
    out
}

fn inertial(cx: &mut Cx<'_>, link: &Element, what: &str) -> MassProperties {
    let Some(e) = link.child("inertial") else { return MassProperties::massless() };
    let what = format!("{what}: <inertial>");
    let X_BC = geometry::urdf_origin(cx, e, &what);
    let mass = match e.child("mass") {
        Some(m) => cx.required(m, "value", &what).and_then(|_| cx.number(m, "value", &what)),
        None => {
            cx.missing(e, &what, "<mass>", "write <mass value=\"..\"/> in kg");
            None
        }
    };
    let Some(i) = e.child("inertia") else {
        if let (Some(mass), Unphysical::Read) = (mass, cx.options.unphysical) {
            cx.doubtful.push(e.ignored(&what, "no <inertia>: a point mass"));
            return cx.checked(e, what, MassProperties::new(mass, X_BC.position, Mat3::zeros()));
        }
        let help =
            "write <inertia ixx=\"..\" ixy=\"..\" ixz=\"..\" iyy=\"..\" iyz=\"..\" izz=\"..\"/>";
        cx.missing(e, &what, "<inertia>", help);
        return MassProperties::massless();
    };
    let mut entry = |name: &str| {
        cx.required(i, name, &format!("{what}: <inertia>"))?;
        cx.number(i, name, &what)
    };
    let all = ["ixx", "iyy", "izz", "ixy", "ixz", "iyz"].map(&mut entry);
    let ([Some(xx), Some(yy), Some(zz), Some(xy), Some(xz), Some(yz)], Some(mass)) = (all, mass)
    else {
        return MassProperties::massless();
    };
    let J = Mat3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
    let properties = MassProperties::new(mass, X_BC.position, turned(&J, &X_BC));
    cx.checked(e, what, properties)
}

/// Rotates the inertia to the axes around the pose; without a rotation, returns exactly the same numbers.
pub(crate) fn turned(J: &Mat3, X: &Pose) -> Mat3 {
    if X.rotation == linkwork_spatial::Quat::identity() {
        return *J;
    }
    let R = X.rotation.to_rotation_matrix().into_inner();
    let J = R * J * R.transpose();
    (J + J.transpose()) * 0.5
}

/// Reads the body that a joint moves.
fn mover(cx: &mut Cx<'_>, child: &str, m: &Mover<'_>, d: &mut Description) -> BodySpec {
    let (e, what) = (m.e, format!("joint `{}`", m.name));
    let X_PJ = geometry::urdf_origin(cx, e, &what);
    let kind = cx.required(e, "type", &what).unwrap_or("fixed");
    let mut axis = || {
        let a = e.child("axis")?;
        cx.required(a, "xyz", &format!("{what}: <axis>"))?;
        cx.direction(a, "xyz", &format!("{what}: <axis>"))
    };
    let hinge = match kind {
        "fixed" => Hinge::locked(),
        "floating" => Hinge::free(),
        "revolute" | "continuous" => Hinge::pin(axis().unwrap_or_else(Vec3::x)),
        "prismatic" => Hinge::slider(axis().unwrap_or_else(Vec3::x)),
        "planar" => planar(axis().unwrap_or_else(Vec3::x)),
        other => {
            let help = suggest(other, "type", TYPES);
            let (joint, kind) = (m.name.into(), other.into());
            cx.fault(e.place_of("type"), FaultKind::UnknownJointType { joint, kind, help });
            Hinge::locked()
        }
    };
    let limits = match kind {
        "revolute" | "prismatic" => limits(cx, e, &what, Position::Limited),
        "continuous" => limits(cx, e, &what, Position::Endless),
        _ => Limits::NONE,
    };
    let mut joint = Joint::new(m.name, child, hinge.subhinges.len());
    if hinge.nv() == 1
        && let Some(dynamics) = e.child("dynamics")
    {
        let mut number = |name| {
            let x = cx.number(dynamics, name, &what).unwrap_or(0.0);
            cx.not_negative(dynamics.place_of(name), x, &format!("{what}: `{name}`")).unwrap_or(0.0)
        };
        (joint.damping, joint.friction) = (number("damping"), number("friction"));
    }
    let hinge = match hinge.nv() {
        1 => {
            let friction = Friction { force: joint.friction, rate: 0.0 };
            hinge.limits(limits).damping(joint.damping).friction(friction)
        }
        _ => hinge,
    };
    d.joints.push(joint);
    BodySpec::new(child, m.parent).hinge_in_parent(X_PJ).hinge(hinge)
}

/// Whether a joint's position is limited.
#[derive(PartialEq)]
enum Position {
    Limited,
    Endless,
}

fn limits(cx: &mut Cx<'_>, joint: &Element, what: &str, position: Position) -> Limits {
    let Some(e) = joint.child("limit") else {
        if position == Position::Limited {
            let note = "no <limit>: its motion is not limited";
            cx.ignored.push(joint.ignored(format!("robot/{}", joint.label()), note));
        }
        return Limits::NONE;
    };
    let what = format!("{what}: <limit>");
    // Linkwork's export writes the greatest double for a missing limit.
    let endless = |x: f64| if x.abs() == f64::MAX { x.signum() * f64::INFINITY } else { x };
    // Some files contain words instead, which are not part of the format.
    let words = |name: &str| match e.attr(name) {
        Some("inf" | "+inf" | "Infinity") => Some(f64::INFINITY),
        Some("-inf" | "-Infinity") => Some(f64::NEG_INFINITY),
        _ => None,
    };
    let mut size = |name| {
        let x = words(name).unwrap_or_else(|| cx.number(e, name, &what).unwrap_or(f64::INFINITY));
        let x = endless(x);
        cx.not_negative(e.place_of(name), x, &format!("{what}: `{name}`")).unwrap_or(0.0)
    };
    let (rate, effort) = (size("velocity"), size("effort"));
    if position == Position::Endless {
        return Limits { rate, effort, ..Limits::NONE };
    }
    let mut bound = |name| words(name).unwrap_or_else(|| cx.number(e, name, &what).unwrap_or(0.0));
    let (lower, upper) = (bound("lower"), bound("upper"));
    let (lower, upper) = (endless(lower), endless(upper));
    if lower == 0.0 && upper == 0.0 {
        let note = "<limit> without `lower` and `upper`, or with 0 for both: according to the format, the joint cannot move";
        cx.ignored.push(e.ignored(format!("robot/{}", joint.label()), note));
    }
    if !(lower <= upper) || lower == f64::INFINITY || upper == f64::NEG_INFINITY {
        let text = format!("{lower} .. {upper}");
        cx.bad(e.place(), &what, &text, "a range", "lower must not exceed upper");
        return Limits::NONE;
    }
    Limits { lower, upper, rate, effort }
}

/// Returns a hinge for motion in the plane perpendicular to `n`: sliders along two axes of the plane, then a rotation about `n`. For n = z the
/// sliders are x and y, and likewise in cyclic order for x and y.
pub(crate) fn planar(n: Vec3) -> Hinge {
    let first = Vec3::ith((n.iamax() + 1) % 3, 1.0);
    let u = (first - n * n.dot(&first)).normalize();
    let w = n.cross(&u);
    Hinge::chain([
        SubhingeKind::Slider { axis: u },
        SubhingeKind::Slider { axis: w },
        SubhingeKind::Pin { axis: n },
    ])
}
