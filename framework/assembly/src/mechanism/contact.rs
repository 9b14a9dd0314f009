//! `contact: (..)`: settings of the solver, collision rules, and the colliders with their groups and materials.
//!
//! The outermost assembly with `contact` counts. Without it, colliders are only used for queries. `self_collision: false` counts in every assembly,
//! with or without contact.
use crate::body::collider::Collider;
use crate::body::contact::ContactForm;
use crate::body::hinge::slides;
use crate::expand::instance::Instance;
use crate::expand::reference::{Target, resolve, visible};
use crate::mechanism::anchor::{Bodies, one_dof};
use crate::schema::kind::{At, Kind, drive_number, flag, list_of, text};
use crate::schema::record::Record;
use crate::text::report::Cx;
use crate::text::value::{Text, entries, map, outer};
use linkwork_collision::{
    ColliderFault, ColliderSpec, Colliders, Material, PairLaw, Resistance, Rules, TERRAIN,
};
use linkwork_multibody::{BodySpec, Multibody, Subhinge};
use linkwork_runtime::{Located, Origin, Setting, Value, remedy};
use linkwork_solvers::{CompliantLaws, ContactSettings};
use std::collections::{BTreeMap, BTreeSet};

/// The group of colliders without a group.
const DEFAULT: &str = "default";

/// `contact` with resolved names.
#[derive(Default)]
pub(crate) struct Contact {
    /// `None`: the field `contact` is absent, so there is no contact.
    pub settings: Option<ContactSettings>,
    /// Compliant contact instead of impulses.
    pub compliant: Option<CompliantLaws>,
    rules: Rules,
    material: Material,
    resistance: Resistance,
    /// Whether every collider could be read.
    complete: bool,
    /// Body, index among its one-dof coordinates, force.
    dry: Vec<(String, usize, f64)>,
    /// Pairs of bodies that report their contact force.
    pub pair_forces: Vec<[String; 2]>,
    /// Path of the terrain, as in the file.
    pub terrain: Option<String>,
    /// Friction of all contact, which also applies to ground without a soil.
    pub ground_friction: Option<f64>,
    /// The fields, with references from the top level.
    pub resolved: Option<Located>,
    /// Settings of one kind of contact, which do not act if the contact is of the other kind.
    pub written: Vec<Setting>,
}

/// Returns the instances with `contact`, the outermost first; equal depths are in path order.
fn outermost<'i>(instances: &[&'i Instance]) -> Vec<(&'i Instance, &'i Located)> {
    let depth = |i: &Instance| if i.path.is_empty() { 0 } else { 1 + i.path.matches('.').count() };
    let off = Value::Bool(false);
    let all = instances.iter().filter_map(|i| Some((*i, i.contact.as_ref()?)));
    let mut all: Vec<_> = all.collect();
    all.sort_by_key(|(i, _)| depth(i));
    let first = all.first().map_or(0, |(i, _)| depth(i));
    all.retain(|(i, _)| depth(i) == first);
    all.retain(|(_, c)| c.value != off);
    all
}

/// Reads `contact`; `colliders` are those there are, all of them when they are complete.
pub(crate) fn read(
    cx: &mut Cx,
    root: &Instance,
    instances: &[&Instance],
    bodies: &Bodies,
    (colliders, complete): (&[Collider], bool),
) -> Contact {
    let all = outermost(instances);
    let apart = apart(cx, instances, bodies);
    let names: BTreeSet<&str> = colliders.iter().map(|c| c.spec.name.as_str()).collect();
    let own = own_pairs(cx, root, instances, (&names, complete));
    let none = |apart| {
        let ignore = own.clone();
        let rules = Rules { apart, ignore, welded: welded(bodies), ..Rules::default() };
        Contact { complete, rules, ..Contact::default() }
    };
    let Some((here, v)) = all.first() else { return none(apart) };
    for (other, again) in &all[1..] {
        let message = format!("`{}` and `{}` both write `contact`", here.path, other.path);
        cx.fault(again.origin, message, "write it once, in the simulation");
    }
    // `None` and `()` have the same value, so look at the text to distinguish them.
    let place = (v.origin.start as usize)..(v.origin.end as usize);
    let source = cx.sources.files.get(v.origin.file as usize).and_then(|(_, t)| t.get(place));
    if v.value == Value::Null && source.is_some_and(|t| t.trim() == "None") {
        let help =
            "write `contact: false` to disable contact, `contact: ()` for the default settings";
        cx.fault(v.origin, "`contact: None` is ambiguous", help);
    }
    let at = At::new("`contact`");
    let empty = Value::Null.into();
    let written = if v.value == Value::Bool(true) { &empty } else { *v };
    let Some(form) = ContactForm::read(cx, written, &at) else { return none(apart) };
    let scope = Scope { root, path: &here.path, names, complete };
    let rules = Rules {
        neighbours: form.neighbours,
        ignore: scope.pairs(cx, v, &form.ignore, "ignore"),
        collide: scope.pairs(cx, v, &form.collide, "collide"),
        joined: Vec::new(),
        welded: welded(bodies),
        apart,
        laws: laws(cx, v, &form, (colliders, complete)),
    };
    if let (None, Some(limit)) = (form.compliant, form.touching_max) {
        let origin = v.get("touching_max").map_or(v.origin, |t| t.origin);
        let fact = format!("`contact`: `touching_max` is {limit}, without compliant contact");
        let help = "write `compliant: true`, or remove it: contact by impulses has no limit";
        cx.fault(origin, fact, help);
    }
    let pair_forces = scope.pairs(cx, v, &form.pair_forces, "pair_forces");
    let pair_forces = of_bodies(cx, v, bodies, colliders, complete, pair_forces);
    let mut out = Contact {
        pair_forces,
        settings: Some(form.settings()),
        rules,
        material: Material { friction: form.friction, restitution: form.restitution },
        resistance: Resistance { rolling: form.rolling_friction, spinning: form.spinning_friction },
        complete,
        dry: dry(cx, &form.dry, root, &here.path, bodies, &at.field("dry")),
        compliant: form.compliant.map(|usual| CompliantLaws {
            usual,
            of_laws: form.pairs.iter().map(|p| p.over(usual)).collect(),
            touching_max: form.touching_max,
        }),
        terrain: form.terrain.as_ref().map(|t| t.text.clone()),
        ground_friction: v.get("friction").map(|_| form.friction),
        resolved: None,
        written: of_impulses(v, &form, colliders),
    };
    out.resolved = Some(resolved(v, &out));
    // The resolved text contains these pairs in its assemblies, so add them only after it was
    // written.
    out.rules.ignore.extend(own);
    out
}

/// Fields of `contact` that compliant contact does not use.
const OF_IMPULSES: [&str; 13] = [
    "margin",
    "slop",
    "correction",
    "push_max",
    "bounce_min",
    "restitution",
    "limits",
    "method",
    "tolerance",
    "sweeps",
    "steps",
    "relaxation",
    "directions",
];

/// Returns the settings in `contact`, its `pairs` and colliders that only contact by impulses uses.
fn of_impulses(v: &Located, form: &ContactForm, colliders: &[Collider]) -> Vec<Setting> {
    let idle = form.compliant.map(|_| {
        let remedy = "remove them, or remove `compliant` for contact by impulses; compliant contact loses energy by `damping`";
        ("compliant contact does not use them".to_string(), remedy.to_string())
    });
    let setting = |owner: String, name: &'static str, origin: Origin| Setting {
        owner,
        name,
        origin,
        idle: idle.clone(),
    };
    // All fields of `contact` have the same origin, so that they are reported in one warning.
    let written = OF_IMPULSES.iter().filter(|name| v.get(name).is_some());
    let mut out: Vec<Setting> =
        written.map(|name| setting("`contact`".into(), name, v.origin)).collect();
    for pair in form.pairs.iter().filter(|p| p.restitution.is_some()) {
        let (Some(a), Some(b)) = (&pair.a, &pair.b) else { continue };
        let owner = format!("`contact`: pair of `{}` and `{}`", a.text, b.text);
        out.push(setting(owner, "restitution", a.origin));
    }
    // The origin of all colliders of an imported file is the import.
    let mut bouncing: BTreeMap<Origin, Vec<&str>> = BTreeMap::new();
    for c in colliders.iter().filter(|c| c.restitution.is_some()) {
        bouncing.entry(c.origin).or_default().push(&c.spec.name);
    }
    for (origin, names) in bouncing {
        let owner = match &names[..] {
            [one] => format!("collider `{one}`"),
            [first, more @ ..] => format!("collider `{first}` and {} more", more.len()),
            [] => continue,
        };
        out.push(setting(owner, "restitution", origin));
    }
    out
}

/// Returns the pairs in `ignore` of all assemblies, with full names.
fn own_pairs(
    cx: &mut Cx,
    root: &Instance,
    instances: &[&Instance],
    (names, complete): (&BTreeSet<&str>, bool),
) -> Vec<[String; 2]> {
    let mut out = Vec::new();
    for here in instances {
        let Some(v) = &here.ignore else { continue };
        let list = list_of(list_of(text()));
        let Some(pairs) = list.read(cx, v, &At::new("`ignore`").origin(v.origin)) else { continue };
        let scope = Scope { root, path: &here.path, names: names.clone(), complete };
        out.extend(scope.pairs(cx, v, &pairs, "ignore"));
    }
    out
}

/// Returns bodies on locked hinges that are represented by prescribed coordinates.
fn welded(bodies: &Bodies) -> Vec<String> {
    bodies.iter().filter(|(_, (b, _))| b.held).map(|(name, _)| name.clone()).collect()
}

/// Reads `pairs: [(a: "tyre", b: "rock", friction: 0.9), ..]`.
fn laws(
    cx: &mut Cx,
    v: &Located,
    form: &ContactForm,
    (colliders, complete): (&[Collider], bool),
) -> Vec<PairLaw> {
    let named = colliders.iter().filter_map(|c| c.spec.material_name.as_deref());
    let known: BTreeSet<&str> = named.chain([TERRAIN]).collect();
    let known: Vec<&str> = known.into_iter().collect();
    let (mut out, mut seen) = (Vec::new(), BTreeSet::new());
    for pair in &form.pairs {
        let (Some(a), Some(b)) = (&pair.a, &pair.b) else { continue };
        for name in [a, b].into_iter().filter(|n| complete && !known.contains(&n.text.as_str())) {
            let fact =
                format!("`contact`: `pairs`: no collider is of the material `{}`", name.text);
            cx.fault(name.origin, fact, remedy(&name.text, "materials", &known));
        }
        let mut key = [a.text.clone(), b.text.clone()];
        key.sort();
        if !seen.insert(key) {
            let fact =
                format!("`contact`: `pairs`: `{}` and `{}` are listed twice", a.text, b.text);
            cx.fault(a.origin, fact, "keep one of them");
        }
        let own = pair.compliant();
        if form.compliant.is_none() && !own.is_empty() {
            let origin = v.get("pairs").map_or(v.origin, |p| p.origin);
            let fact = format!("`contact`: `pairs`: {} without compliant contact", own.join(", "));
            let help = "write `compliant: true`, or remove them: contact by impulses only uses friction and restitution";
            cx.fault(origin, fact, help);
        }
        out.push(PairLaw {
            materials: [a.text.clone(), b.text.clone()],
            friction: pair.friction,
            restitution: pair.restitution,
            rolling: pair.rolling_friction,
            spinning: pair.spinning_friction,
        });
    }
    out
}

/// Resolves the pairs of `pair_forces` (the terrain is part of the world): two bodies with colliders, or one and the world.
fn of_bodies(
    cx: &mut Cx,
    v: &Located,
    bodies: &Bodies,
    colliders: &[Collider],
    complete: bool,
    mut pairs: Vec<[String; 2]>,
) -> Vec<[String; 2]> {
    let origin = v.get("pair_forces").map_or(v.origin, |p| p.origin);
    for pair in &mut pairs {
        if pair[1] == TERRAIN {
            pair[1] = "world".into();
        }
        let [of, from] = &*pair;
        let touches = |name: &String| colliders.iter().any(|c| c.spec.body == *name);
        let known = |name: &String| bodies.contains_key(name);
        let fact = if !known(of) {
            format!("`{of}` is not a body: the first of a pair is the body on which the force acts")
        } else if !known(from) && from != "world" {
            format!("`{from}` is neither a body nor `world`")
        } else if of == from {
            format!("`{of}` and `{from}` are the same body")
        } else if let Some(name) = [of, from].into_iter().find(|n| known(n) && !touches(n)) {
            format!("`{name}` does not have collision shapes")
        } else {
            continue;
        };
        if complete {
            let help = "write [[\"body\", \"other body or world\"], ..]; the reported force acts on the first";
            cx.fault(origin, format!("`contact`: `pair_forces`: {fact}"), help);
        }
    }
    pairs
}

/// Returns the bodies of each assembly with `self_collision: false`, including those of its parts.
fn apart(cx: &mut Cx, instances: &[&Instance], bodies: &Bodies) -> Vec<Vec<String>> {
    let within = |path: &str, outer: &str| {
        let rest = path.strip_prefix(outer);
        outer.is_empty() || rest.is_some_and(|r| r.is_empty() || r.starts_with('.'))
    };
    let mut machines: Vec<&Instance> = Vec::new();
    // Outer assemblies precede the assemblies inside them.
    for here in instances {
        let Some(written) = &here.self_collision else { continue };
        let name = if here.path.is_empty() { "simulation" } else { &here.path };
        let at = At::new(format!("`{name}`: `self_collision`")).origin(written.origin);
        let around = machines.iter().find(|outer| within(&here.path, &outer.path));
        match (flag().read(cx, written, &at), around) {
            (Some(false), None) => machines.push(here),
            (Some(true), Some(outer)) => {
                let outer = if outer.path.is_empty() { "simulation" } else { &outer.path };
                let fact =
                    format!("{} is true, but it is false in `{outer}`, which contains it", at.what);
                let help = "remove one of them; `collide` of `contact` lists pairs that collide nevertheless";
                cx.fault(written.origin, fact, help);
            }
            _ => {}
        }
    }
    let of = |here: &Instance| {
        let own = bodies.iter().filter(|(_, (_, scope))| within(scope, &here.path));
        own.map(|(name, _)| name.clone()).collect()
    };
    machines.into_iter().map(of).collect()
}

/// Reads `dry: { "hinge:arm": "2 N m" }`.
fn dry(
    cx: &mut Cx,
    written: &[(Text, Located)],
    root: &Instance,
    scope: &str,
    bodies: &Bodies,
    at: &At<'_>,
) -> Vec<(String, usize, f64)> {
    let mut out: Vec<(String, usize, f64)> = Vec::new();
    for (key, force) in written {
        let at = at.field(&key.text);
        let Some((body, index, subhinge)) = one_dof(cx, root, scope, bodies, (key, &at.what))
        else {
            continue;
        };
        if out.iter().any(|(b, i, _)| *b == body && *i == index) {
            let message = format!("{}: this coordinate is listed twice", at.what);
            cx.fault(key.origin, message, "keep one of them");
        }
        let kind = bodies.get(&body).map(|b| b.0.hinge.subhinges[subhinge].kind);
        let at = at.sliding(kind.is_some_and(|k| slides(&k)));
        let force = drive_number("N m", "N").at_least(0.0).read(cx, force, &at);
        out.extend(force.map(|f| (body, index, f)));
    }
    out.sort_by(|a, b| (&a.0, a.1).cmp(&(&b.0, b.1)));
    out
}

/// Scope of the names in rules.
struct Scope<'s> {
    root: &'s Instance,
    path: &'s str,
    names: BTreeSet<&'s str>,
    complete: bool,
}

impl Scope<'_> {
    /// Resolves `[["a", "b"], ..]`: pairs of colliders or bodies, by full names.
    fn pairs(&self, cx: &mut Cx, v: &Located, all: &[Vec<Text>], field: &str) -> Vec<[String; 2]> {
        let what = format!("`contact`: `{field}`");
        let mut out = Vec::new();
        for pair in all {
            let [a, b] = &pair[..] else {
                let origin = pair.first().map(|t| t.origin);
                let origin = origin.or(v.get(field).map(|f| f.origin)).unwrap_or(v.origin);
                let help = "write [[\"body or collider\", \"another\"], ..]";
                cx.fault(origin, format!("{what} must be a list of pairs of names"), help);
                continue;
            };
            let (a, b) = (self.name(cx, a, &what), self.name(cx, b, &what));
            out.extend(a.zip(b).map(|(a, b)| [a, b]));
        }
        out
    }

    /// Returns the full name of a collider or body.
    fn name(&self, cx: &mut Cx, written: &Text, what: &str) -> Option<String> {
        let (text, origin) = (&written.text, written.origin);
        let mut here = self.path;
        let short = text.strip_prefix('/');
        here = if short.is_some() { "" } else { here };
        let text = short.unwrap_or(text);
        loop {
            if text == TERRAIN {
                return Some(text.to_owned());
            }
            let near = match here {
                "" => [text.to_owned(), text.to_owned()],
                _ => [format!("{here}/{text}"), format!("{here}.{text}")],
            };
            if let Some(full) = near.into_iter().find(|n| self.names.contains(n.as_str())) {
                return Some(full);
            }
            if here.is_empty() {
                break;
            }
            here = outer(here);
        }
        let reference = if short.is_some() { format!("/{text}") } else { text.to_owned() };
        match resolve(self.root, self.path, &reference) {
            Ok(Target::World) => Some("world".into()),
            Ok(Target::Body(full)) => Some(full),
            Ok(Target::Unknown) => None,
            Ok(Target::Node(body, node)) => {
                let message = format!("{what}: `{text}` is the node `{node}` of `{body}`");
                cx.fault(origin, message, "use a body or a collider");
                None
            }
            Err(_) if !self.complete => None,
            Err(_) => {
                let bodies = visible(self.root, self.path);
                let known: Vec<&str> =
                    bodies.iter().map(String::as_str).chain(self.names.iter().copied()).collect();
                let message = format!("{what}: there is no collider or body `{text}`");
                cx.fault(origin, message, remedy(text, "colliders and bodies", &known));
                None
            }
        }
    }
}

/// Returns the fields with names from the top level.
fn resolved(v: &Located, contact: &Contact) -> Located {
    let pairs = |all: &[[String; 2]]| -> Located {
        let name = |n: &String| match n.as_str() {
            "world" => Value::Text(n.clone()).into(),
            _ => Value::Text(format!("/{n}")).into(),
        };
        let pair = |p: &[String; 2]| Value::List(p.iter().map(name).collect()).into();
        Value::List(all.iter().map(pair).collect()).into()
    };
    let mut out: Vec<(&str, Located)> = Vec::new();
    for (key, value) in entries(v) {
        let value = match key.as_str() {
            "ignore" => pairs(&contact.rules.ignore),
            "collide" => pairs(&contact.rules.collide),
            "pair_forces" => pairs(&contact.pair_forces),
            "dry" => {
                let dry = contact.dry.iter();
                let dry =
                    dry.map(|(b, i, f)| (format!("hinge:/{b}[{i}]"), Value::Number(*f).into()));
                Value::Map(dry.collect()).into()
            }
            _ => value.clone(),
        };
        out.push((key, value));
    }
    if out.is_empty() { Value::Bool(true).into() } else { map(out) }
}

/// Returns group → bit; at most 128.
fn groups(cx: &mut Cx, colliders: &[Collider]) -> BTreeMap<String, u128> {
    let named: BTreeSet<&str> = (colliders.iter().flat_map(|c| &c.groups))
        .map(|g| g.text.as_str())
        .filter(|g| *g != DEFAULT)
        .collect();
    if named.len() > 127
        && let Some(c) = colliders.iter().find(|c| !c.groups.is_empty())
    {
        let message = format!("the colliders are in {} groups", named.len());
        cx.fault(c.origin, message, "the limit is 127; merge groups with the same collision rules");
    }
    let all = std::iter::once(DEFAULT).chain(named).enumerate();
    all.map(|(bit, g)| (g.to_owned(), 1 << bit.min(127))).collect()
}

/// Returns the colliders with groups and materials; they are checked if there is a mechanism.
pub(crate) fn colliders(
    cx: &mut Cx,
    contact: &Contact,
    all: Vec<Collider>,
    joined: Vec<[String; 2]>,
    multibody: Option<&Multibody>,
) -> Option<Colliders> {
    for c in all.iter().filter(|c| c.spec.name == TERRAIN) {
        let fact = format!(
            "collider `{TERRAIN}`: this name is reserved for the ground of a terrain service"
        );
        cx.fault(c.origin, fact, "use another name");
    }
    let bits = groups(cx, &all);
    let known: Vec<&str> = bits.keys().map(String::as_str).collect();
    let mut specs: Vec<ColliderSpec> = Vec::new();
    for c in &all {
        let mut spec = c.spec.clone();
        if !c.groups.is_empty() {
            spec.groups = c.groups.iter().filter_map(|g| bits.get(&g.text)).fold(0, |a, b| a | b);
        }
        if let Some(meets) = &c.meets {
            spec.collides_with = 0;
            for g in meets {
                match bits.get(&g.text) {
                    Some(bit) => spec.collides_with |= bit,
                    None if !contact.complete => {}
                    None => {
                        let message = format!(
                            "collider `{}`: no collider is in the group `{}`",
                            spec.name, g.text
                        );
                        cx.fault(g.origin, message, remedy(&g.text, "groups", &known));
                    }
                }
            }
        }
        spec.material = Material {
            friction: c.friction.unwrap_or(contact.material.friction),
            restitution: c.restitution.unwrap_or(contact.material.restitution),
        };
        spec.resistance = Resistance {
            rolling: c.rolling.unwrap_or(contact.resistance.rolling),
            spinning: c.spinning.unwrap_or(contact.resistance.spinning),
        };
        specs.push(spec);
    }
    let rules = Rules { joined, ..contact.rules.clone() };
    match Colliders::new(specs, rules, multibody?) {
        Ok(colliders) => Some(colliders),
        Err(error) => {
            for fault in error.faults {
                let origin = match &fault {
                    ColliderFault::Shape { collider, .. }
                    | ColliderFault::UnknownBody { collider, .. }
                    | ColliderFault::Duplicate { name: collider, .. }
                    | ColliderFault::Number { collider, .. }
                    | ColliderFault::Discs { collider }
                    | ColliderFault::Pose { collider } => {
                        all.iter().find(|c| c.spec.name == *collider).map(|c| c.origin)
                    }
                    ColliderFault::UnknownName { .. }
                    | ColliderFault::UnknownMaterial { .. }
                    | ColliderFault::LawNumber { .. } => None,
                };
                cx.explained(origin.unwrap_or(Origin::NONE), "", [fault]);
            }
            None
        }
    }
}

impl Contact {
    /// Converts dry friction to that of hinges, because compliant contact does not have constraint rows for it.
    pub fn rub(&self, bodies: &mut [BodySpec]) {
        for (body, index, force) in &self.dry {
            let spec = bodies.iter_mut().find(|b| b.name == *body);
            let one = |s: &&mut Subhinge| s.kind.nv() == 1;
            let hinge = spec.map(|b| b.hinge.subhinges.iter_mut().filter(one));
            if let Some(s) = hinge.and_then(|mut h| h.nth(*index)) {
                s.friction.force = *force;
            }
        }
    }

    /// Returns the settings with dry friction at its indices in β.
    pub fn on(&self, multibody: &Multibody) -> Option<ContactSettings> {
        let place = |(body, index, force): &(String, usize, f64)| {
            let body = multibody.get(multibody.body(body)?);
            let s = body.subhinges().iter().filter(|s| s.v.len() == 1).nth(*index)?;
            Some((s.v.start, *force))
        };
        let settings = self.settings.clone()?;
        Some(ContactSettings { dry: self.dry.iter().filter_map(place).collect(), ..settings })
    }
}
