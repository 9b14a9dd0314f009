//! SDF: models of links, joints and named frames, with poses relative to any of them.
//!
//! ```text
//! X_MF = X_M,relative_to · pose                        for every link, joint and frame
//! X_PJ = X_MP⁻¹ X_MJ        X_BJ = X_MB⁻¹ X_MJ          hinge frames where the file shows them
//! ```
//! A link without a joint floats, unless its model is static; the coordinates of its free hinge are its pose in the world. A second joint to a link
//! closes a loop.

mod frames;
mod include;
mod inertia;
mod joint;
mod link;
mod version;

use crate::error::FaultKind;
use crate::read::{Cx, ReadOptions, report_massless, root_body};
use crate::xml::{DEPTH, Element, parse};
use crate::{Description, Device, DeviceKind, FormatError};
use frames::{Frames, Scope};
use linkwork_multibody::{BodySpec, Hinge};
use std::collections::BTreeMap;

/// Reads an SDF text: its model, or all models of its world.
///
/// # Errors
/// Every mistake: malformed XML, duplicate or unknown names, circular frames, unknown joint types, invalid numbers, inertias that no rigid body can
/// have.
pub fn read_sdf(text: &str, options: &ReadOptions) -> Result<Description, FormatError> {
    let mut root = parse(text, &options.file_name())?;
    let mut cx = Cx::new(options);
    if !matches!(root.name.as_str(), "sdf" | "gazebo") {
        let help = "an SDF file is <sdf version=\"1.9\"> .. </sdf>".to_owned();
        let kind = FaultKind::WrongRoot { found: root.name.clone(), expected: "<sdf>", help };
        cx.fault(root.place(), kind);
        return cx.finish(&root, Description::default());
    }
    version::prepare(&mut cx, &mut root);
    include::expand(&mut cx, &mut root);
    if let Some((e, _)) = root.walk().find(|(_, depth)| *depth > DEPTH) {
        cx.fault(e.place(), FaultKind::TooDeep { limit: DEPTH });
        return cx.finish(&root, Description::default());
    }
    let root = root;
    let mut d = Description::default();
    let mut sdf = Sdf { frames: Frames::new(), links: BTreeMap::new(), joints: Vec::new() };
    let worlds: Vec<&Element> = root.all("world").collect();
    let holders = if worlds.is_empty() { vec![&root] } else { worlds };
    for holder in &holders {
        d.name = holder.attr("name").unwrap_or_default().to_owned();
        sdf.holder(&mut cx, holder, &mut d.name);
    }
    if sdf.links.is_empty() && cx.faults.is_empty() {
        let missed = cx.ignored.iter().filter(|i| i.path == "sdf/include").map(|i| i.what.as_str());
        let help = match missed.collect::<Vec<_>>().join("; ") {
            none if none.is_empty() => "write <model><link name=\"..\"/>".to_owned(),
            some => some,
        };
        cx.missing(&root, "the file", "<model> with a <link>", help);
    }
    sdf.frames.resolve(&mut cx);
    if cx.faults.is_empty() {
        sdf.build(&mut cx, &mut d);
    }
    let place = |body: &str| sdf.links.get(body).map(|l| (l.e, format!("sdf/{}", l.e.label())));
    report_massless(&mut cx, &d.builder, place);
    cx.finish(&root, d)
}

/// A link of some model.
struct Link<'e> {
    e: &'e Element,
    /// The key of its frame.
    key: String,
    fixed: bool,
}

/// A joint of some model.
struct JointAt<'e> {
    e: &'e Element,
    name: String,
    scope: Scope,
    key: String,
}

struct Sdf<'e> {
    frames: Frames<'e>,
    /// Links by the names of their bodies.
    links: BTreeMap<String, Link<'e>>,
    joints: Vec<JointAt<'e>>,
}

impl<'e> Sdf<'e> {
    /// Reads the models of a world, or of the file.
    fn holder(&mut self, cx: &mut Cx<'_>, holder: &'e Element, name: &mut String) {
        let models: Vec<&Element> = holder.all("model").collect();
        let alone = models.len() == 1;
        let world = Scope::world();
        for e in holder.all("frame") {
            self.frames.frame(cx, e, &world);
        }
        for model in models {
            let Some(own) = cx.required(model, "name", "a <model>") else { continue };
            if alone {
                *name = own.to_owned();
            }
            let scope = world.inner(own, if alone { "" } else { own });
            self.model(cx, model, own, &world, scope, false);
        }
        for e in holder.all("joint") {
            self.joint(cx, e, &world);
        }
    }

    fn model(
        &mut self,
        cx: &mut Cx<'_>,
        e: &'e Element,
        name: &str,
        outer: &Scope,
        scope: Scope,
        fixed: bool,
    ) {
        let fixed = match e.child_text("static") {
            None => fixed,
            Some((_, "true" | "1")) => true,
            Some((_, "false" | "0")) => fixed,
            Some((at, text)) => {
                let what = format!("model `{name}`: <static>");
                cx.bad(at.place(), &what, text, "true or false", "write true or false");
                fixed
            }
        };
        let first = e.all("link").find_map(|l| l.attr("name"));
        let canonical = e.attr("canonical_link").or(first);
        self.frames.model(cx, e, name, outer, &scope, canonical);
        for l in e.all("link") {
            let Some(own) = cx.required(l, "name", "a <link>") else { continue };
            let key = self.frames.link(cx, l, own, &scope);
            let body = scope.body(own);
            if body == "world" {
                let help = "`world` is the frame of the world; rename this link".to_owned();
                let kind = FaultKind::BadName { kind: "link", name: body.clone(), help };
                cx.fault(l.place_of("name"), kind);
            }
            // Duplicate links are reported with their frames.
            self.links.entry(body).or_insert(Link { e: l, key, fixed });
        }
        for f in e.all("frame") {
            self.frames.frame(cx, f, &scope);
        }
        for inner in e.all("model") {
            let Some(own) = cx.required(inner, "name", "a nested <model>") else { continue };
            let nested = scope.inner(own, own);
            self.model(cx, inner, own, &scope, nested, fixed);
        }
        for j in e.all("joint") {
            self.joint(cx, j, &scope);
        }
    }

    fn joint(&mut self, cx: &mut Cx<'_>, e: &'e Element, scope: &Scope) {
        let Some(name) = cx.required(e, "name", "a <joint>") else { return };
        let what = format!("joint `{name}`");
        let mut end = |tag: &str| match e.child_text(tag) {
            Some((_, text)) if !text.is_empty() => Some(text),
            _ => {
                cx.missing(e, &what, &format!("<{tag}>"), format!("write <{tag}>link</{tag}>"));
                None
            }
        };
        let (parent, child) = (end("parent"), end("child"));
        let (Some(_), Some(child)) = (parent, child) else { return };
        let key = self.frames.joint(cx, e, name, child, scope);
        let (name, scope) = (scope.body(name), scope.clone());
        self.joints.push(JointAt { e, name, scope, key });
    }

    /// Adds all bodies, after the poses of the frames are known.
    fn build(&self, cx: &mut Cx<'_>, d: &mut Description) {
        let mut movers: BTreeMap<String, BodySpec> = BTreeMap::new();
        for j in &self.joints {
            self.read_joint(cx, j, &mut movers, d);
        }
        for (body, l) in &self.links {
            let mass = inertia::inertial(cx, l.e, body);
            let weightless =
                l.e.child_text("gravity").is_some_and(|(_, t)| matches!(t, "false" | "0"));
            if weightless && !l.fixed {
                let kind = DeviceKind::GravityCompensation { body: body.clone(), share: 1.0 };
                d.devices.push(Device { name: format!("{body}_weightless"), kind });
            }
            link::shapes(cx, l.e, body, d);
            let from = d.builder.bodies().len();
            match movers.remove(body) {
                Some(spec) => drop(d.builder.body(spec.mass(mass))),
                None => {
                    let as_written = if l.fixed { Hinge::locked() } else { Hinge::free() };
                    let X_WB = self.frames.pose(&l.key);
                    root_body(cx, BodySpec::new(body, "world").mass(mass), X_WB, as_written, d);
                }
            }
            d.written_at(from, &l.e.place());
        }
        for (name, body, pose) in self.frames.nodes() {
            d.builder.node(name, body, pose);
        }
        link::usual_filters(&mut d.shapes);
        self.rings(cx, d);
        self.mimics(cx, d);
        self.gearboxes(cx, d);
    }

    /// Reports links that are circular parents of each other, each circle once.
    fn rings(&self, cx: &mut Cx<'_>, d: &Description) {
        let parents: BTreeMap<&str, &str> =
            d.builder.bodies().iter().map(|b| (b.name.as_str(), b.parent.as_str())).collect();
        let mut walks: BTreeMap<&str, usize> = BTreeMap::new();
        for (n, &start) in parents.keys().enumerate() {
            let (mut path, mut at) = (Vec::new(), Some(start));
            while let Some(body) = at.filter(|b| *b != "world" && !walks.contains_key(b)) {
                walks.insert(body, n);
                path.push(body);
                at = parents.get(body).copied();
            }
            if let Some(first) = at.and_then(|b| path.iter().position(|p| *p == b)) {
                let ring = path[first..].iter().chain([&path[first]]).map(|b| (*b).to_owned());
                let kind = FaultKind::Cycle { path: ring.collect() };
                cx.fault(self.links[path[first]].e.place(), kind);
            }
        }
    }
}
