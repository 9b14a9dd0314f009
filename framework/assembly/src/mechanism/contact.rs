//! `contact: (..)`: how contact is solved, who meets whom, and the colliders with all that they need.
//!
//! The outermost assembly that writes it counts. Without it, colliders are only there for queries.
use crate::body::collider::{Collider, within};
use crate::expand::instance::Instance;
use crate::expand::reference::{Target, resolve, visible};
use crate::mechanism::anchor::{Bodies, coordinate};
use crate::schema::read::{choice, fields, flag, list, table, text};
use crate::text::report::Cx;
use crate::text::value::{Text, entries, map, outer};
use linkwork_collision::{ColliderSpec, Colliders, Fault, Material, Neighbours, Rules};
use linkwork_multibody::{BodySpec, Multibody, Subhinge, SubhingeKind};
use linkwork_runtime::{Located, Origin, Value, remedy};
use linkwork_solvers::contact::Method;
use linkwork_solvers::{CompliantSettings, ContactSettings, JointLimits};
use std::collections::{BTreeMap, BTreeSet};

const FIELDS: [&str; 20] = [
    "compliant",
    "margin",
    "slop",
    "correction",
    "push_max",
    "bounce_min",
    "friction",
    "restitution",
    "limits",
    "dry",
    "method",
    "tolerance",
    "sweeps",
    "steps",
    "relaxation",
    "directions",
    "neighbours",
    "ignore",
    "collide",
    "doc",
];
/// The group of colliders that name none.
const DEFAULT: &str = "default";

/// What `contact` says, with names found.
#[derive(Default)]
pub(crate) struct Contact {
    /// `None`: it is not written, and nothing touches.
    pub settings: Option<ContactSettings>,
    /// Smooth forces instead of impulses.
    pub compliant: Option<CompliantSettings>,
    rules: Rules,
    material: Material,
    /// Whether every collider could be read.
    complete: bool,
    /// Body, which of its one-dof coordinates, force.
    dry: Vec<(String, usize, f64)>,
    /// The fields with references from the top.
    pub resolved: Option<Located>,
}

/// Instances that write `contact`, the outermost first; those of one depth in path order.
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
    let Some((here, v)) = all.first() else {
        return Contact { complete, ..Contact::default() };
    };
    for (other, again) in &all[1..] {
        let message = format!("`{}` and `{}` both write `contact`", here.path, other.path);
        cx.fault(again.origin, message, "write it once, in the simulation");
    }
    if !matches!(v.value, Value::Bool(true)) {
        fields(cx, v, "`contact`", &FIELDS);
    }
    let names: BTreeSet<&str> = colliders.iter().map(|c| c.spec.name.as_str()).collect();
    let scope = Scope { root, path: &here.path, names, complete };
    let settings = Some(settings(cx, v));
    let mut out = Contact { settings, complete, ..Contact::default() };
    let words = [("Pass", Neighbours::Pass), ("Collide", Neighbours::Collide)];
    out.rules.neighbours = choice(cx, v, "`contact`", "neighbours", &words).unwrap_or_default();
    out.rules.ignore = scope.pairs(cx, v, "ignore");
    out.rules.collide = scope.pairs(cx, v, "collide");
    let plain = Material::default();
    let mut of = |field: &str, high: f64, default: f64| {
        let Some(x) = v.get(field) else { return default };
        within(cx, x, &format!("`contact`: `{field}`"), "", (0.0, high)).unwrap_or(default)
    };
    out.material.friction = of("friction", f64::INFINITY, plain.friction);
    out.material.restitution = of("restitution", 1.0, plain.restitution);
    out.dry = dry(cx, v, root, &here.path, bodies);
    out.compliant = v.get("compliant").and_then(|c| compliant(cx, c));
    out.resolved = Some(resolved(v, &out));
    out
}

/// `compliant: (stiffness: .., ..)`; `true` or `()` for what is usual.
fn compliant(cx: &mut Cx, v: &Located) -> Option<CompliantSettings> {
    const FIELDS: [&str; 7] = [
        "stiffness",
        "exponent",
        "damping",
        "bristle_stiffness",
        "bristle_damping",
        "relaxation",
        "radius",
    ];
    let mut out = CompliantSettings::default();
    match v.value {
        Value::Bool(on) => return on.then_some(out),
        Value::Null => return Some(out),
        _ => {
            fields(cx, v, "`contact`: `compliant`", &FIELDS);
        }
    }
    let (all, some) = ((0.0, f64::INFINITY), (f64::MIN_POSITIVE, f64::INFINITY));
    let mut of = |field: &str, unit: &str, range: (f64, f64), to: &mut f64| {
        let Some(x) = v.get(field) else { return };
        let what = format!("`contact`: `compliant`: `{field}`");
        *to = within(cx, x, &what, unit, range).unwrap_or(*to);
    };
    of("stiffness", "", some, &mut out.stiffness);
    of("exponent", "", (1.0, 10.0), &mut out.exponent);
    of("damping", "s/m", all, &mut out.damping);
    of("bristle_stiffness", "N/m", some, &mut out.bristle_stiffness);
    of("bristle_damping", "N s/m", all, &mut out.bristle_damping);
    of("relaxation", "s", some, &mut out.relaxation);
    of("radius", "m", all, &mut out.radius);
    Some(out)
}

fn settings(cx: &mut Cx, v: &Located) -> ContactSettings {
    let d = ContactSettings::default();
    let all = (0.0, f64::INFINITY);
    let mut of = |field: &str, unit: &str, range: (f64, f64), default: f64| {
        let Some(x) = v.get(field) else { return default };
        within(cx, x, &format!("`contact`: `{field}`"), unit, range).unwrap_or(default)
    };
    let mut out = ContactSettings {
        margin: of("margin", "m", all, d.margin),
        slop: of("slop", "m", all, d.slop),
        correction: of("correction", "", (0.0, 1.0), d.correction),
        push_max: of("push_max", "m/s", all, d.push_max),
        bounce_min: of("bounce_min", "m/s", all, d.bounce_min),
        ..d
    };
    let solver = &mut out.solver;
    solver.tolerance = of("tolerance", "", (1e-15, 1.0), solver.tolerance);
    solver.relaxation = of("relaxation", "", (1e-3, 1.999), solver.relaxation);
    let mut count = |field: &str, least: u32, default: u32| {
        let Some(x) = v.get(field) else { return default };
        let what = format!("`contact`: `{field}`");
        let Some(n) = within(cx, x, &what, "", (f64::from(least), 1e9)) else { return default };
        if n.fract() != 0.0 {
            cx.fault(x.origin, format!("{what} is {n}"), "write a whole number");
        }
        n as u32
    };
    solver.sweeps = count("sweeps", 0, solver.sweeps);
    solver.steps = count("steps", 0, solver.steps);
    solver.directions = count("directions", 3, solver.directions as u32) as usize;
    let methods = [
        ("Auto", Method::Auto),
        ("GaussSeidel", Method::GaussSeidel),
        ("Newton", Method::Newton),
        ("Lemke", Method::Lemke),
    ];
    solver.method = choice(cx, v, "`contact`", "method", &methods).unwrap_or_default();
    if let Some(l) = v.get("limits")
        && flag(cx, l, "`contact`: `limits`") == Some(false)
    {
        out.limits = JointLimits::Ignore;
    }
    out
}

/// `dry: { "hinge:arm": "2 N m" }`.
fn dry(
    cx: &mut Cx,
    v: &Located,
    root: &Instance,
    scope: &str,
    bodies: &Bodies,
) -> Vec<(String, usize, f64)> {
    let mut out: Vec<(String, usize, f64)> = Vec::new();
    let Some(written) = v.get("dry") else { return out };
    for (key, force) in table(cx, written, "`contact`: `dry`") {
        let (what, origin) = (format!("`contact`: `dry`: `{key}`"), cx.key(force));
        let name = key.strip_prefix("hinge:").unwrap_or(key);
        let (body, index) = match coordinate(root, scope, name) {
            Ok(Some(found)) => found,
            Ok(None) => continue,
            Err((fact, help)) => {
                cx.fault(origin, format!("{what}: {fact}"), help);
                continue;
            }
        };
        let Some((found, _)) = bodies.get(&body) else { continue };
        let one_dof: Vec<_> = found.hinge.subhinges.iter().filter(|s| s.kind.nv() == 1).collect();
        let Some(s) = one_dof.get(index) else {
            let message = format!(
                "{what}: the hinge of `{body}` has {} one-dof coordinates, not {}",
                one_dof.len(),
                index + 1
            );
            cx.fault(origin, message, "name a pin, slider or screw");
            continue;
        };
        if out.iter().any(|(b, i, _)| *b == body && *i == index) {
            cx.fault(origin, format!("{what}: this coordinate comes twice"), "keep one of them");
        }
        let slides = matches!(s.kind, SubhingeKind::Slider { .. });
        let unit = if slides { "N" } else { "N m" };
        let force = within(cx, force, &what, unit, (0.0, f64::INFINITY));
        out.extend(force.map(|f| (body, index, f)));
    }
    out.sort_by(|a, b| (&a.0, a.1).cmp(&(&b.0, b.1)));
    out
}

/// Where the names of rules are looked up.
struct Scope<'s> {
    root: &'s Instance,
    path: &'s str,
    names: BTreeSet<&'s str>,
    complete: bool,
}

impl Scope<'_> {
    /// `[["a", "b"], ..]`: pairs of colliders or bodies, by full names.
    fn pairs(&self, cx: &mut Cx, v: &Located, field: &str) -> Vec<[String; 2]> {
        let mut out = Vec::new();
        let Some(written) = v.get(field) else { return out };
        let what = format!("`contact`: `{field}`");
        for pair in list(cx, written, &what).to_vec() {
            let items = match &pair.value {
                Value::List(items) if items.len() == 2 => items.clone(),
                _ => {
                    let help = "write [[\"body or collider\", \"another\"], ..]";
                    cx.fault(pair.origin, format!("{what} is a list of pairs of names"), help);
                    continue;
                }
            };
            let found: Vec<_> = items.iter().map(|i| self.name(cx, i, &what)).collect();
            if let [Some(a), Some(b)] = &found[..] {
                out.push([a.clone(), b.clone()]);
            }
        }
        out
    }

    /// The full name of a collider or body.
    fn name(&self, cx: &mut Cx, v: &Located, what: &str) -> Option<String> {
        let Text { text, origin } = text(cx, v, what)?;
        let mut here = self.path;
        let short = text.strip_prefix('/');
        here = if short.is_some() { "" } else { here };
        let text = short.unwrap_or(&text);
        loop {
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
                cx.fault(origin, message, "name a body or a collider");
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

/// The fields with names from the top.
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

/// Group → bit. At most 32.
fn groups(cx: &mut Cx, colliders: &[Collider]) -> BTreeMap<String, u32> {
    let named: BTreeSet<&str> = (colliders.iter().flat_map(|c| &c.groups))
        .map(|g| g.text.as_str())
        .filter(|g| *g != DEFAULT)
        .collect();
    if named.len() > 31
        && let Some(c) = colliders.iter().find(|c| !c.groups.is_empty())
    {
        let message = format!("the colliders are in {} groups", named.len());
        cx.fault(c.origin, message, "31 is the most; take together those that meet the same");
    }
    let all = std::iter::once(DEFAULT).chain(named).enumerate();
    all.map(|(bit, g)| (g.to_owned(), 1 << bit.min(31))).collect()
}

/// The colliders with groups and materials; checked when there is a mechanism.
pub(crate) fn colliders(
    cx: &mut Cx,
    contact: &Contact,
    all: Vec<Collider>,
    joined: Vec<[String; 2]>,
    multibody: Option<&Multibody>,
) -> Option<Colliders> {
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
        specs.push(spec);
    }
    let rules = Rules { joined, ..contact.rules.clone() };
    match Colliders::new(specs, rules, multibody?) {
        Ok(colliders) => Some(colliders),
        Err(error) => {
            for fault in error.faults {
                let origin = match &fault {
                    Fault::Shape { collider, .. }
                    | Fault::UnknownBody { collider, .. }
                    | Fault::Duplicate { name: collider, .. }
                    | Fault::Number { collider, .. }
                    | Fault::Pose { collider } => {
                        all.iter().find(|c| c.spec.name == *collider).map(|c| c.origin)
                    }
                    Fault::UnknownName { .. } => None,
                };
                let text = fault.to_string();
                let (message, help) = text.split_once("\n  help: ").unwrap_or((&text, ""));
                cx.fault(origin.unwrap_or(Origin::NONE), message, help);
            }
            None
        }
    }
}

impl Contact {
    /// Dry friction as that of hinges: where contact is smooth there are no rows for it.
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

    /// The settings with dry friction at its places in β.
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
