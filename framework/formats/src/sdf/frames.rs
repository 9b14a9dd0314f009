//! The graph of an SDF file's frames, with the body of each.
//!
//! ```text
//! link      relative to its model                       carried by itself
//! joint     relative to its child                       carried by its child
//! frame     relative to what it is attached to          carried by the same body
//! model     relative to the model or world around it    carried by its canonical link
//! ```
//! `relative_to` replaces the first column. Names refer to the model that contains them; `a::b` is b in the nested model a.

use crate::error::{FaultKind, FilePlace};
use crate::read::Cx;
use crate::xml::Element;
use linkwork_spatial::nalgebra::Quaternion;
use linkwork_spatial::{Pose, Quat, Vec3};
use std::collections::{BTreeMap, BTreeSet};

/// The position of a model in the tree of models.
#[derive(Clone)]
pub(super) struct Scope {
    /// Prefix of names in keys: `` or `model::nested::`.
    prefix: String,
    /// Prefix of names of bodies; without the model's own name if it is the only one.
    bodies: String,
}

impl Scope {
    pub fn world() -> Self {
        Self { prefix: String::new(), bodies: String::new() }
    }

    /// Returns the scope inside a model; `shown` is empty if names do not contain it.
    pub fn inner(&self, name: &str, shown: &str) -> Self {
        let colons = if shown.is_empty() { "" } else { "::" };
        Self {
            prefix: format!("{}{name}::", self.prefix),
            bodies: format!("{}{shown}{colons}", self.bodies),
        }
    }

    /// Returns the name of a body, joint or node in the description.
    pub fn body(&self, name: &str) -> String {
        format!("{}{name}", self.bodies)
    }

    /// Returns the frame to which everything without `relative_to` is relative.
    fn base(&self) -> String {
        if self.prefix.is_empty() { "world".into() } else { format!("{}__model__", self.prefix) }
    }
}

/// A frame as written.
struct Frame<'e> {
    e: &'e Element,
    kind: &'static str,
    /// `None` for the world.
    relative_to: Option<Name>,
    pose: Pose,
    /// The frame that carries it; `None` for links and the world.
    attached_to: Option<Name>,
    /// For a link its body; for a `<frame>` the name of its node.
    body: Option<String>,
    /// The frame inside a model that is at the model's pose, if it is not the model's own.
    placement: Option<Name>,
}

/// A name for a later lookup, when all frames are known.
struct Name {
    text: String,
    scope: String,
    place: FilePlace,
    what: String,
}

/// All frames by key.
pub(super) struct Frames<'e> {
    all: BTreeMap<String, Frame<'e>>,
    /// `X_WF` and the body of each frame (also `world`), after [`Frames::resolve`].
    placed: BTreeMap<String, (Pose, String)>,
    /// The key of each body.
    keys: BTreeMap<String, String>,
}

impl<'e> Frames<'e> {
    pub fn new() -> Self {
        let placed = BTreeMap::from([("world".to_owned(), (Pose::identity(), "world".to_owned()))]);
        Self { all: BTreeMap::new(), placed, keys: BTreeMap::new() }
    }

    fn add(&mut self, cx: &mut Cx<'_>, key: &str, name: &str, frame: Frame<'e>) {
        let reserved = name.contains("::") || (name.starts_with("__") && name.ends_with("__"));
        if reserved && frame.kind != "model" {
            let help =
                "names must not contain `::`, and must not begin and end with `__`".to_owned();
            let kind = FaultKind::BadName { kind: frame.kind, name: name.into(), help };
            cx.fault(frame.e.place_of("name"), kind);
        }
        if let Some(first) = self.all.get(key) {
            let (kind, first, name) = (frame.kind, first.e.place(), name.to_owned());
            cx.fault(frame.e.place_of("name"), FaultKind::Duplicate { kind, name, first });
            return;
        }
        self.all.insert(key.to_owned(), frame);
    }

    pub fn model(
        &mut self,
        cx: &mut Cx<'_>,
        e: &'e Element,
        name: &str,
        outer: &Scope,
        own: &Scope,
        canonical: Option<&str>,
    ) {
        let what = format!("model `{name}`");
        let (pose, relative) = pose(cx, e, &what, outer);
        let relative_to = Some(relative.unwrap_or_else(|| base(outer, e, &what)));
        let place = e.place_of("canonical_link");
        let attached_to = canonical.map(|text| {
            let (text, scope) = (text.to_owned(), own.prefix.clone());
            Name { text, scope, place, what: format!("{what}: `canonical_link`") }
        });
        let attached_to = attached_to.or_else(|| Some(base(outer, e, &what)));
        let placement = placement(e, own, &what);
        let frame =
            Frame { e, kind: "model", relative_to, pose, attached_to, body: None, placement };
        self.add(cx, &own.base(), name, frame);
    }

    pub fn link(&mut self, cx: &mut Cx<'_>, e: &'e Element, name: &str, scope: &Scope) -> String {
        let what = format!("link `{name}`");
        let (pose, relative) = pose(cx, e, &what, scope);
        let relative_to = Some(relative.unwrap_or_else(|| base(scope, e, &what)));
        let key = format!("{}{name}", scope.prefix);
        let body = Some(scope.body(name));
        let (attached_to, placement) = (None, None);
        let frame = Frame { e, kind: "link", relative_to, pose, attached_to, body, placement };
        self.add(cx, &key, name, frame);
        key
    }

    pub fn joint(
        &mut self,
        cx: &mut Cx<'_>,
        e: &'e Element,
        name: &str,
        child: &str,
        scope: &Scope,
    ) -> String {
        let what = format!("joint `{name}`");
        let (pose, relative) = pose(cx, e, &what, scope);
        let place = e.child("child").map_or(e.place(), Element::place);
        let child = || Name {
            text: child.to_owned(),
            scope: scope.prefix.clone(),
            place: place.clone(),
            what: format!("{what}: <child>"),
        };
        let key = format!("{}{name}", scope.prefix);
        let relative_to = Some(relative.unwrap_or_else(child));
        let attached_to = Some(child());
        let (body, placement) = (None, None);
        let frame = Frame { e, kind: "joint", relative_to, pose, attached_to, body, placement };
        self.add(cx, &key, name, frame);
        key
    }

    pub fn frame(&mut self, cx: &mut Cx<'_>, e: &'e Element, scope: &Scope) {
        let Some(name) = cx.required(e, "name", "a <frame>") else { return };
        let what = format!("frame `{name}`");
        let (pose, relative) = pose(cx, e, &what, scope);
        let attached = || match e.attr("attached_to").filter(|a| !a.is_empty()) {
            Some(text) => Name {
                text: text.to_owned(),
                scope: scope.prefix.clone(),
                place: e.place_of("attached_to"),
                what: format!("{what}: `attached_to`"),
            },
            None => base(scope, e, &what),
        };
        let relative_to = Some(relative.unwrap_or_else(attached));
        let (attached_to, body) = (Some(attached()), Some(scope.body(name)));
        let key = format!("{}{name}", scope.prefix);
        // The frame of a merged model does not become a node.
        let merged = e.attr("merged").is_some() && name.starts_with("_merged__");
        let (kind, placement) = match merged {
            true => ("merged", placement(e, scope, &what)),
            false => ("frame", None),
        };
        let frame = Frame { e, kind, relative_to, pose, attached_to, body, placement };
        self.add(cx, &key, name, frame);
    }

    /// Returns the key of a name in a scope.
    fn key(&self, scope: &str, text: &str) -> Option<String> {
        let own = format!("{scope}{text}");
        let model = format!("{scope}{text}::__model__");
        let found = [own, model].into_iter().find(|k| self.all.contains_key(k));
        found.or_else(|| (text == "world").then(|| "world".to_owned()))
    }

    /// Returns the key of a name, or reports a fault.
    pub fn look_up(
        &self,
        cx: &mut Cx<'_>,
        scope: &Scope,
        text: &str,
        place: FilePlace,
        what: &str,
    ) -> Option<String> {
        let name =
            Name { text: text.into(), scope: scope.prefix.clone(), place, what: what.into() };
        self.find(cx, &name)
    }

    fn find(&self, cx: &mut Cx<'_>, name: &Name) -> Option<String> {
        let found = self.key(&name.scope, &name.text);
        if found.is_none() {
            let near = self.all.keys().filter_map(|k| k.strip_prefix(&name.scope));
            cx.unknown(name.place.clone(), &name.what, "frame", &name.text, near);
        }
        found
    }

    /// Computes poses in the world and bodies of all frames.
    pub fn resolve(&mut self, cx: &mut Cx<'_>) {
        let keys: Vec<String> = self.all.keys().cloned().collect();
        let mut next: BTreeMap<String, (String, String)> = BTreeMap::new();
        for k in &keys {
            let f = &self.all[k];
            let relative = f.relative_to.as_ref().and_then(|n| self.find(cx, n));
            let attached = f.attached_to.as_ref().map(|n| self.find(cx, n));
            let attached = attached.unwrap_or_else(|| f.body.as_ref().map(|_| String::new()));
            if let (Some(r), Some(a)) = (relative, attached) {
                next.insert(k.clone(), (r, a));
            }
        }
        if next.len() < keys.len() {
            return; // undefined names have already been reported
        }
        let from_base = self.order(cx, &keys, |k| next[k].0.as_str(), "relative to");
        let from_body = self.order(cx, &keys, |k| next[k].1.as_str(), "attached to");
        let (Some(from_base), Some(from_body)) = (from_base, from_body) else { return };
        for k in from_base {
            let Some(own) = self.own_pose(cx, k, &next, 0) else { return };
            let X = self.pose(&next[k].0) * own;
            self.placed.insert(k.to_owned(), (X, "world".to_owned()));
        }
        for k in from_body {
            let body = match (self.all[k].kind, &self.all[k].body) {
                ("link", Some(body)) => body.clone(),
                _ => self.carrier(&next[k].1).to_owned(),
            };
            if self.all[k].kind == "link" {
                self.keys.insert(body.clone(), k.to_owned());
            }
            if let Some(placed) = self.placed.get_mut(k) {
                placed.1 = body;
            }
        }
    }

    /// Returns the pose of a frame relative to its parent; for a model as written, without the pose of its placement frame.
    fn own_pose(
        &self,
        cx: &mut Cx<'_>,
        key: &str,
        next: &BTreeMap<String, (String, String)>,
        depth: usize,
    ) -> Option<Pose> {
        let frame = &self.all[key];
        let Some(name) = &frame.placement else { return Some(frame.pose) };
        // Find the pose of the placement frame relative to the model, which is an ancestor of every frame
        // inside it.
        let mut at = self.find(cx, name)?;
        let mut X = Pose::identity();
        while at != key {
            let inside = next.get(&at).filter(|_| at != "world" && depth < PLACEMENTS);
            let Some((base, _)) = inside else {
                let what = format!("{}: `{}` is not inside the model", name.what, name.text);
                let help = "use a link or frame of the model".to_owned();
                cx.fault(name.place.clone(), FaultKind::Unsupported { what, help });
                return None;
            };
            X = self.own_pose(cx, &at, next, depth + 1)? * X;
            at.clone_from(base);
        }
        Some(frame.pose * X.inverse())
    }

    /// Returns the keys, each after the one to which it refers; `None` and a fault for a circle.
    fn order<'a>(
        &self,
        cx: &mut Cx<'_>,
        keys: &'a [String],
        next: impl Fn(&'a str) -> &'a str,
        how: &str,
    ) -> Option<Vec<&'a str>> {
        let mut out: Vec<&str> = Vec::new();
        let mut seen: BTreeSet<&str> = BTreeSet::new();
        for start in keys {
            let (mut trail, mut at) = (Vec::new(), start.as_str());
            while !at.is_empty() && at != "world" && seen.insert(at) {
                trail.push(at);
                at = next(at);
            }
            if let Some(first) = trail.iter().position(|k| *k == at) {
                let ring: Vec<&str> = trail[first..].iter().copied().chain([at]).collect();
                let what =
                    format!("frames are {how} each other in a circle: {}", ring.join(" -> "));
                let help = "change one of them to be relative to the model".to_owned();
                cx.fault(self.all[at].e.place(), FaultKind::Unsupported { what, help });
                return None;
            }
            out.extend(trail.iter().rev());
        }
        Some(out)
    }

    /// Returns `X_WF` of a resolved frame.
    pub fn pose(&self, key: &str) -> Pose {
        self.placed.get(key).map_or(Pose::identity(), |(X, _)| *X)
    }

    /// Returns the body of a resolved frame, or `world`.
    pub fn carrier(&self, key: &str) -> &str {
        self.placed.get(key).map_or("world", |(_, b)| b.as_str())
    }

    /// Returns `X_BF` of a resolved frame on its body.
    pub fn on_body(&self, key: &str, body_key: &str) -> Pose {
        self.pose(body_key).inverse() * self.pose(key)
    }

    /// Returns the key of the link of a body.
    pub fn key_of_body(&self, body: &str) -> &str {
        self.keys.get(body).map_or("world", String::as_str)
    }

    /// Returns the nodes: every `<frame>` on a body.
    pub fn nodes(&self) -> Vec<(String, String, Pose)> {
        let frames = self.all.iter().filter(|(_, f)| f.kind == "frame");
        frames
            .filter_map(|(key, f)| {
                let body = self.carrier(key);
                let pose = self.on_body(key, self.key_of_body(body));
                (body != "world").then(|| (f.body.clone().unwrap_or_default(), body.into(), pose))
            })
            .collect()
    }
}

/// Maximum nesting of models with placement frames.
const PLACEMENTS: usize = 100;

/// Returns the placement frame of a model, a name inside it.
fn placement(e: &Element, own: &Scope, what: &str) -> Option<Name> {
    let text = e.attr("placement_frame").filter(|t| !t.is_empty() && *t != "__model__")?;
    let (text, scope) = (text.to_owned(), own.prefix.clone());
    let (place, what) = (e.place_of("placement_frame"), format!("{what}: `placement_frame`"));
    Some(Name { text, scope, place, what })
}

fn base(scope: &Scope, e: &Element, what: &str) -> Name {
    let text = if scope.prefix.is_empty() { "world" } else { "__model__" };
    let (text, scope) = (text.to_owned(), scope.prefix.clone());
    Name { text, scope, place: e.place(), what: what.to_owned() }
}

/// Returns the `<pose>` of an element, and its `relative_to` if it is written.
fn pose(cx: &mut Cx<'_>, e: &Element, what: &str, scope: &Scope) -> (Pose, Option<Name>) {
    let Some(p) = e.child("pose") else { return (Pose::identity(), None) };
    let what = format!("{what}: <pose>");
    let relative = p.attr("relative_to").filter(|r| !r.is_empty()).map(|text| Name {
        text: text.to_owned(),
        scope: scope.prefix.clone(),
        place: p.place_of("relative_to"),
        what: format!("{what}: `relative_to`"),
    });
    (plain_pose(cx, p, &what), relative)
}

/// Reads the numbers of a `<pose>`: x y z and roll, pitch, yaw, or a quaternion x y z w.
pub(super) fn plain_pose(cx: &mut Cx<'_>, p: &Element, what: &str) -> Pose {
    if p.text.is_empty() {
        return Pose::identity();
    }
    let degrees = matches!(p.attr("degrees"), Some("true" | "1"));
    if p.attr("rotation_format") == Some("quat_xyzw") {
        let Some([px, py, pz, x, y, z, w]) = cx.parse::<7>(p.place(), &p.text, what) else {
            return Pose::identity();
        };
        let raw = Quaternion::new(w, x, y, z);
        let size = raw.coords.amax();
        if !(1e-100..=1e100).contains(&size) {
            let help = "write x y z w, for example 0 0 0 1";
            cx.bad(p.place(), what, &p.text, "a nonzero quaternion", help);
            return Pose::identity();
        }
        return Pose::new(Quat::new_normalize(raw / size), Vec3::new(px, py, pz));
    }
    let Some([x, y, z, r, p_, yaw]) = cx.parse::<6>(p.place(), &p.text, what) else {
        return Pose::identity();
    };
    let unit = if degrees { std::f64::consts::PI / 180.0 } else { 1.0 };
    Pose::new(Quat::from_euler_angles(r * unit, p_ * unit, yaw * unit), Vec3::new(x, y, z))
}
