//! From the tree of instances to the flat `Spec` that `compile` takes.
use crate::body::{self, Body};
use crate::collider::{self, Collider};
use crate::constraints::{self, Bodies};
use crate::contact;
use crate::context::{Cx, Text, entries};
use crate::expand::{Instance, ModelInst, Node};
use crate::files::Files;
use crate::reference::{Target, full_name, resolve, resolve_loop};
use crate::shape::BodyShape;
use linkwork_collision::{ColliderSpec, Colliders};
use linkwork_multibody::{BodySpec, Builder, Fault as MechanismFault, Loop, Modes, Multibody};
use linkwork_runtime::{
    BindSpec, BindTarget, ContactSpec, Located, MechanismSpec, Origin, PartSpec, Seconds,
};
use linkwork_spatial::Pose;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Every model of the tree, in path order.
pub(crate) fn models(root: &Instance) -> Vec<&ModelInst> {
    fn walk<'i>(here: &'i Instance, out: &mut Vec<&'i ModelInst>) {
        for node in here.parts.values() {
            match node {
                Node::Model(m) => out.push(m),
                Node::Assembly(inner) => walk(inner, out),
            }
        }
    }
    let mut out = Vec::new();
    walk(root, &mut out);
    out.sort_by(|a, b| a.path.cmp(&b.path));
    out
}

/// Parts by path.
pub(crate) fn parts(cx: &mut Cx, root: &Instance) -> Vec<PartSpec> {
    models(root)
        .into_iter()
        .map(|m| {
            let rate =
                m.rate.as_ref().and_then(|v| period(cx, v, &format!("`{}`: `rate`", m.path)));
            let offset =
                m.offset.as_ref().and_then(|v| period(cx, v, &format!("`{}`: `offset`", m.path)));
            PartSpec {
                path: m.path.clone(),
                model: m.model.text.clone(),
                model_origin: m.model.origin,
                params: Located {
                    value: m.params.value.clone(),
                    // Nothing written: faults of parameters point at the part.
                    origin: match m.params.origin {
                        Origin::NONE => m.origin,
                        origin => origin,
                    },
                },
                rate,
                rate_origin: m.rate.as_ref().map_or(m.origin, |r| r.origin),
                offset: offset.unwrap_or(Seconds::ZERO),
                origin: m.origin,
                folder: m.folder.clone(),
            }
        })
        .collect()
}

/// A period or time: `"50 Hz"`, `"20 ms"`, seconds.
pub(crate) fn period(cx: &mut Cx, v: &Located, what: &str) -> Option<Seconds> {
    match Seconds::period(&v.value) {
        Ok(s) => Some(s),
        Err(fact) => {
            // The fact without the remedy, which stands in the help.
            let fact = fact.split(": write").next().unwrap_or(&fact).replace('"', "");
            let fact = fact.replace("a period", "a time");
            let help = "write \"50 Hz\", \"20 ms\", \"2 min\" or a number of seconds";
            cx.fault(v.origin, format!("{what}: {fact}"), help);
            None
        }
    }
}

/// Bindings by part and name.
pub(crate) fn binds(cx: &mut Cx, root: &Instance) -> Vec<BindSpec> {
    let mut out = Vec::new();
    for m in models(root) {
        let scope = m.path.rsplit_once('.').map_or("", |(head, _)| head);
        for (bind, v) in entries(&m.bind) {
            let what = format!("`{}`: binding `{bind}`", m.path);
            let Some(t) = crate::read::text(cx, v, &what) else { continue };
            match bind_target(root, scope, &t.text) {
                Ok(None) => {}
                Ok(Some(target)) => out.push(BindSpec {
                    part: m.path.clone(),
                    bind: bind.clone(),
                    target,
                    origin: t.origin,
                }),
                Err((fact, help)) => cx.fault(t.origin, format!("{what}: {fact}"), help),
            }
        }
    }
    out.sort_by(|a, b| (&a.part, &a.bind).cmp(&(&b.part, &b.bind)));
    out
}

type Problem = (String, String);

/// `name[k]`: the name and k, 0 when it is not written.
fn indexed(text: &str) -> Result<(&str, usize), Problem> {
    match text.trim().strip_suffix(']').and_then(|h| h.rsplit_once('[')) {
        Some((name, digits)) => match digits.parse() {
            Ok(index) => Ok((name, index)),
            Err(_) => {
                let fact = format!("`{digits}` is not the number of a coordinate");
                Err((fact, "write hinge:body[0]".to_string()))
            }
        },
        None => Ok((text.trim(), 0)),
    }
}

fn no_world() -> Problem {
    ("the world has neither nodes nor hinges".to_string(), "bind to a body".to_string())
}

/// `body` or `body[k]`: the body's full name and which of its one-dof coordinates; nothing when it could not be read.
pub(crate) fn coordinate(
    root: &Instance,
    scope: &str,
    text: &str,
) -> Result<Option<(String, usize)>, Problem> {
    let (name, index) = indexed(text)?;
    match resolve(root, scope, name)? {
        Target::Unknown => Ok(None),
        Target::Body(body) => Ok(Some((body, index))),
        Target::Node(body, node) => Err((
            format!("`{name}` is the node `{node}` of `{body}`; a hinge is named by its body"),
            format!("write \"hinge:{}\"", name.rsplit_once('/').map_or(name, |(b, _)| b)),
        )),
        Target::World => Err(no_world()),
    }
}

fn bind_target(root: &Instance, scope: &str, text: &str) -> Result<Option<BindTarget>, Problem> {
    if let Some(hinge) = text.strip_prefix("hinge:") {
        let found = coordinate(root, scope, hinge)?;
        return Ok(found.map(|(body, index)| BindTarget::Hinge { body, index }));
    }
    if let Some(closure) = text.strip_prefix("loop:") {
        let (name, index) = indexed(closure)?;
        let found = resolve_loop(root, scope, name)?;
        return Ok(found.map(|name| BindTarget::Loop { name, index }));
    }
    let name = text.strip_prefix("node:").unwrap_or(text).trim();
    match resolve(root, scope, name)? {
        Target::Unknown => Ok(None),
        Target::Body(body) => Ok(Some(BindTarget::Node(body))),
        Target::Node(body, node) => Ok(Some(BindTarget::Node(format!("{body}/{node}")))),
        Target::World => Err(no_world()),
    }
}

/// The mechanism with its shapes.
pub(crate) struct Mechanism {
    pub spec: Option<MechanismSpec>,
    pub shapes: Vec<BodyShape>,
    pub colliders: Option<Arc<Colliders>>,
    /// Where the first collider is written.
    pub collides: Option<Origin>,
    /// What the resolved text says instead of what was written.
    pub told: Told,
}

/// References from the top, and geometry that came out of files.
#[derive(Default)]
pub(crate) struct Told {
    /// Full name of each body → full reference of its parent; of each standing collider → that of its body.
    pub parents: BTreeMap<String, String>,
    /// Full name of each loop and coupling → its fields.
    pub constraints: BTreeMap<String, Located>,
    /// Full name of each body → place in its shapes, collider.
    pub colliders: BTreeMap<String, Vec<(usize, ColliderSpec)>>,
    /// Full name of each standing collider → itself.
    pub standing: BTreeMap<String, ColliderSpec>,
    /// References from the top of standing colliders.
    pub on: BTreeMap<String, String>,
    /// Full name of each flexible body → its modes.
    pub modes: BTreeMap<String, Modes>,
    /// What `contact` says.
    pub contact: Option<Located>,
}

/// Reads every body, loop, coupling and collider, and builds the mechanism.
pub(crate) fn mechanism(
    cx: &mut Cx,
    root: &Instance,
    files: &Files<'_>,
    path: &str,
    gravity: Option<String>,
    origin: Origin,
) -> Mechanism {
    let mut instances = Vec::new();
    root.walk(&mut instances);
    let before = cx.faults.len();
    let bodies = bodies(cx, root, &instances, files);
    let (mut shapes, mut told) = (Vec::new(), Told::default());
    let mut builder = Builder::new();
    for (full, (body, scope)) in &bodies {
        let (parent, offset, reference) = parent(cx, root, &bodies, body, scope);
        told.parents.insert(full.clone(), reference);
        let mut spec = BodySpec::new(full.clone(), parent)
            .hinge_in_parent(offset * body.at)
            .hinge_in_body(body.hinge_frame)
            .hinge(body.hinge.clone())
            .mass(body.mass);
        spec.modes.clone_from(&body.modes);
        builder.body(spec);
        told.modes.extend(body.modes.clone().map(|m| (full.clone(), m)));
        for (node, pose, _) in &body.nodes {
            builder.node(format!("{full}/{node}"), full.clone(), *pose);
        }
        shapes.extend(body.shapes.iter().cloned());
        let own = body.colliders.iter().map(|(k, c)| (*k, c.spec.clone())).collect();
        told.colliders.insert(full.clone(), own);
    }
    let mut constraints = constraints::read(cx, root, &instances, &bodies, &mut builder);
    let standing = collider::standing(cx, root, &instances, files, &bodies);
    shapes.extend(standing.shapes);
    told.on = standing.references;
    for c in &standing.colliders {
        told.standing.insert(c.spec.name.clone(), c.spec.clone());
    }
    let of_bodies = bodies.values().flat_map(|(b, _)| b.colliders.iter().map(|(_, c)| c.clone()));
    let all: Vec<Collider> = of_bodies.chain(standing.colliders).collect();
    let collides = all.first().map(|c| c.origin);
    // After a mistake a collider may be missing: what names it stays silent.
    let complete = cx.faults.len() == before;
    let contact = contact::read(cx, root, &instances, &bodies, (&all, complete));
    told.constraints = std::mem::take(&mut constraints.resolved);
    told.contact = contact.resolved.clone();
    if contact.compliant.is_some() {
        contact.rub(builder.bodies_mut());
    }
    if bodies.is_empty() {
        return Mechanism { spec: None, shapes, colliders: None, collides: None, told };
    }
    let built = match builder.build() {
        Ok(multibody) => Some(Arc::new(multibody)),
        Err(error) => {
            for fault in error.faults {
                let place = fault_origin(&fault, &bodies, &constraints.origins).unwrap_or(origin);
                let text = fault.to_string();
                let (message, help) = text.split_once("\n  help: ").unwrap_or((&text, ""));
                cx.fault(place, message, if help.is_empty() { remedy(&fault) } else { help });
            }
            None
        }
    };
    let joined = std::mem::take(&mut constraints.joined);
    let colliders = contact::colliders(cx, &contact, all, joined, built.as_deref()).map(Arc::new);
    let spec = built.map(|multibody| {
        let (q, v) = start(&multibody, &bodies);
        let on = contact.on(&multibody).zip(colliders.clone());
        let started = |l: &Loop| constraints.motions.remove(&l.closure.name).unwrap_or_default();
        let motions = multibody.loops().iter().flat_map(started).collect();
        MechanismSpec {
            gravity,
            origin,
            treatments: constraints.treatments,
            motions,
            origins: constraints.origins,
            bodies: bodies.iter().map(|(name, (body, _))| (name.clone(), body.origin)).collect(),
            contact: on
                .filter(|_| contact.compliant.is_none())
                .map(|(settings, colliders)| ContactSpec { colliders, settings }),
            compliant: colliders.clone().zip(contact.compliant),
            ..MechanismSpec::new(path, multibody, q, v)
        }
    });
    let colliders = colliders.filter(|c| !c.is_empty());
    Mechanism { spec, shapes, colliders, collides, told }
}

/// Every body of every instance.
fn bodies(cx: &mut Cx, root: &Instance, instances: &[&Instance], files: &Files<'_>) -> Bodies {
    let mut bodies = Bodies::new();
    for here in instances {
        let outer = here.path.rsplit_once('.').map_or("", |(head, _)| head);
        for (mount, text) in &here.mounts {
            if let Err((fact, help)) = resolve(root, outer, &text.text) {
                let message = format!("`{}`: mount `{mount}`: {fact}", here.path);
                cx.fault(text.origin, message, help);
            }
        }
        for (name, b) in &here.bodies {
            let full = full_name(&here.path, name);
            let body = body::read(cx, &full, &b.fields, b.origin, (files, &b.home));
            bodies.insert(full, (body, here.path.clone()));
        }
    }
    bodies
}

/// A body, or a node on one, or the world.
pub(crate) struct Anchor {
    /// Full name, or `world`.
    pub body: String,
    /// The node's pose, when it is one.
    pub node: Option<Pose>,
    /// How it is named from the top.
    pub reference: String,
}

/// The body or node that a text names; `None` when there is none, which is recorded, or when it could not be read.
pub(crate) fn anchor(
    cx: &mut Cx,
    root: &Instance,
    bodies: &Bodies,
    (scope, text): (&str, &Text),
    what: &str,
) -> Option<Anchor> {
    match resolve(root, scope, &text.text) {
        Ok(Target::World) => {
            Some(Anchor { body: "world".into(), node: None, reference: "world".into() })
        }
        Ok(Target::Unknown) => None,
        Ok(Target::Body(p)) => {
            Some(Anchor { body: p.clone(), node: None, reference: format!("/{p}") })
        }
        Ok(Target::Node(p, node)) => {
            let pose = bodies.get(&p).and_then(|(b, _)| b.nodes.iter().find(|n| n.0 == node));
            let reference = format!("/{p}/{node}");
            Some(Anchor { body: p, node: pose.map(|n| n.1), reference })
        }
        Err((fact, help)) => {
            cx.fault(text.origin, format!("{what}: {fact}"), help);
            None
        }
    }
}

fn parent(
    cx: &mut Cx,
    root: &Instance,
    bodies: &Bodies,
    body: &Body,
    scope: &str,
) -> (String, Pose, String) {
    let what = format!("body `{}`: parent", body.name);
    let found = anchor(cx, root, bodies, (scope, &body.parent), &what);
    let world = || ("world".to_string(), Pose::identity(), "world".to_string());
    found.map_or_else(world, |a| (a.body, a.node.unwrap_or_else(Pose::identity), a.reference))
}

fn start(mb: &Multibody, bodies: &Bodies) -> (Vec<f64>, Vec<f64>) {
    let (mut q, mut v) = (mb.neutral_q(), vec![0.0; mb.nv()]);
    for b in mb.bodies() {
        if let Some((body, _)) = bodies.get(b.name()) {
            q[b.q()].copy_from_slice(&body.q);
            v[b.v()].copy_from_slice(&body.v);
        }
    }
    (q, v)
}

/// The name behind a word: ``body `NAME` ``.
fn named<'t>(text: &'t str, kind: &str) -> Option<&'t str> {
    text.strip_prefix(kind)?.strip_prefix(" `")?.split('`').next()
}

fn fault_origin(
    fault: &MechanismFault,
    bodies: &Bodies,
    constraints: &BTreeMap<String, Origin>,
) -> Option<Origin> {
    let body = |name: &str| bodies.get(name).map(|(b, _)| b);
    let constraint = |name: &str| constraints.get(name).copied();
    // A body, or a node of one.
    let hanging = |place: &str| {
        let node = named(place, "node").and_then(|n| n.rsplit_once('/'));
        let of_node = node.and_then(|(b, n)| body(b)?.nodes.iter().find(|x| x.0 == n).map(|x| x.2));
        of_node.or_else(|| body(named(place, "body")?).map(|b| b.origin))
    };
    // What carries a hinge, or the place of a number.
    let any = |what: &str| {
        let kinds = ["loop", "coupling"];
        let loops = kinds.iter().find_map(|kind| constraint(named(what, kind)?));
        loops.or_else(|| body(named(what, "body")?).map(|b| b.origin))
    };
    match fault {
        MechanismFault::Inertia { body: name, .. } => body(name).map(|b| b.inertia_origin),
        MechanismFault::UnknownParent { body: name, .. } => body(name).map(|b| b.origin),
        MechanismFault::BadAxis { body: what, .. }
        | MechanismFault::BadArmature { body: what, .. }
        | MechanismFault::BadGear { body: what, .. }
        | MechanismFault::BadLimits { body: what, .. }
        | MechanismFault::BadDamping { body: what, .. }
        | MechanismFault::BadFriction { body: what, .. }
        | MechanismFault::BadStop { body: what, .. }
        | MechanismFault::NotOnLoop { body: what, .. }
        | MechanismFault::UnknownEnd { what, .. }
        | MechanismFault::NotFinite { place: what } => any(what),
        MechanismFault::Loop { name, .. }
        | MechanismFault::LoopOnItself { name, .. }
        | MechanismFault::EmptyCoupling { name }
        | MechanismFault::NoCoordinate { name, .. }
        | MechanismFault::CoordinateTwice { name, .. } => constraint(name),
        MechanismFault::Cycle { path } => body(path.first()?).map(|b| b.parent.origin),
        MechanismFault::Duplicate { what, name, .. } | MechanismFault::BadName { what, name } => {
            match *what {
                "loop" | "coupling" => constraint(name),
                _ => body(name).map(|b| b.origin),
            }
        }
        MechanismFault::UnknownBody { body: name, .. } => body(name).map(|b| b.origin),
        MechanismFault::Modes { body: name, .. } => body(name).map(|b| b.modes_origin),
        MechanismFault::Attachment { place, body: name, .. } => {
            hanging(place).or_else(|| body(name).map(|b| b.modes_origin))
        }
    }
}

fn remedy(fault: &MechanismFault) -> &'static str {
    match fault {
        MechanismFault::Inertia { .. } => {
            "inertia is about the centre of mass in body axes; a solid such as \
             Cylinder(radius: .., length: ..) computes it from the mass"
        }
        _ => "",
    }
}
