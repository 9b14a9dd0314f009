//! From the tree of instances to the flat `Spec` that `compile` takes.
use crate::body::{self, Body};
use crate::context::{Cx, entries};
use crate::expand::{Instance, ModelInst, Node};
use crate::files::Files;
use crate::reference::{Target, full_name, resolve};
use crate::shape::BodyShape;
use linkwork_multibody::{BodySpec, Builder, Fault as MechanismFault, Multibody};
use linkwork_runtime::{BindSpec, BindTarget, Located, MechanismSpec, Origin, PartSpec, Seconds};
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

fn bind_target(
    root: &Instance,
    scope: &str,
    text: &str,
) -> Result<Option<BindTarget>, (String, String)> {
    let world =
        || ("the world has neither nodes nor hinges".to_string(), "bind to a body".to_string());
    if let Some(hinge) = text.strip_prefix("hinge:") {
        let (name, index) = match hinge.trim().strip_suffix(']').and_then(|h| h.rsplit_once('[')) {
            Some((name, digits)) => (
                name,
                digits.parse().map_err(|_| {
                    let fact = format!("`{digits}` is not the number of a coordinate");
                    (fact, "write hinge:body[0]".to_string())
                })?,
            ),
            None => (hinge.trim(), 0),
        };
        return match resolve(root, scope, name)? {
            Target::Unknown => Ok(None),
            Target::Body(body) => Ok(Some(BindTarget::Hinge { body, index })),
            Target::Node(body, node) => Err((
                format!("`{name}` is the node `{node}` of `{body}`; a hinge is named by its body"),
                format!("write \"hinge:{}\"", name.rsplit_once('/').map_or(name, |(b, _)| b)),
            )),
            Target::World => Err(world()),
        };
    }
    let name = text.strip_prefix("node:").unwrap_or(text).trim();
    match resolve(root, scope, name)? {
        Target::Unknown => Ok(None),
        Target::Body(body) => Ok(Some(BindTarget::Node(body))),
        Target::Node(body, node) => Ok(Some(BindTarget::Node(format!("{body}/{node}")))),
        Target::World => Err(world()),
    }
}

/// The mechanism with its shapes.
pub(crate) struct Mechanism {
    pub spec: Option<MechanismSpec>,
    pub shapes: Vec<BodyShape>,
    /// Full name of each body → full reference of its parent.
    pub parents: BTreeMap<String, String>,
}

/// Reads every body and builds the mechanism.
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
    let mut bodies: BTreeMap<String, (Body, String)> = BTreeMap::new();
    for here in &instances {
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
    let mut shapes: Vec<BodyShape> = Vec::new();
    let mut parents = BTreeMap::new();
    let mut builder = Builder::new();
    for (full, (body, scope)) in &bodies {
        let (parent, offset, reference) = parent(cx, root, &bodies, body, scope);
        parents.insert(full.clone(), reference);
        builder.body(
            BodySpec::new(full.clone(), parent)
                .hinge_in_parent(offset * body.at)
                .hinge_in_body(body.hinge_frame)
                .hinge(body.hinge.clone())
                .mass(body.mass),
        );
        for (node, pose, _) in &body.nodes {
            builder.node(format!("{full}/{node}"), full.clone(), *pose);
        }
        shapes.extend(body.shapes.iter().cloned());
    }
    if bodies.is_empty() {
        return Mechanism { spec: None, shapes, parents };
    }
    let spec = match builder.build() {
        Ok(multibody) => {
            let (q, v) = start(&multibody, &bodies);
            let path = path.to_string();
            let spec = MechanismSpec::new(path, Arc::new(multibody), q, v);
            Some(MechanismSpec { gravity, origin, ..spec })
        }
        Err(error) => {
            for fault in error.faults {
                let place = fault_origin(&fault, &bodies).unwrap_or(origin);
                let text = fault.to_string();
                let (message, help) = text.split_once("\n  help: ").unwrap_or((&text, ""));
                cx.fault(place, message, if help.is_empty() { remedy(&fault) } else { help });
            }
            None
        }
    };
    Mechanism { spec, shapes, parents }
}

fn parent(
    cx: &mut Cx,
    root: &Instance,
    bodies: &BTreeMap<String, (Body, String)>,
    body: &Body,
    scope: &str,
) -> (String, Pose, String) {
    let world = || ("world".to_string(), Pose::identity(), "world".to_string());
    match resolve(root, scope, &body.parent.text) {
        Ok(Target::World | Target::Unknown) => world(),
        Ok(Target::Body(p)) => (p.clone(), Pose::identity(), format!("/{p}")),
        Ok(Target::Node(p, node)) => {
            let pose = bodies.get(&p).and_then(|(b, _)| b.nodes.iter().find(|n| n.0 == node));
            let reference = format!("/{p}/{node}");
            (p, pose.map_or_else(Pose::identity, |n| n.1), reference)
        }
        Err((fact, help)) => {
            let message = format!("body `{}`: parent: {fact}", body.name);
            cx.fault(body.parent.origin, message, help);
            world()
        }
    }
}

fn start(mb: &Multibody, bodies: &BTreeMap<String, (Body, String)>) -> (Vec<f64>, Vec<f64>) {
    let (mut q, mut v) = (mb.neutral_q(), vec![0.0; mb.nv()]);
    for b in mb.bodies() {
        if let Some((body, _)) = bodies.get(b.name()) {
            q[b.q()].copy_from_slice(&body.q);
            v[b.v()].copy_from_slice(&body.v);
        }
    }
    (q, v)
}

fn fault_origin(
    fault: &MechanismFault,
    bodies: &BTreeMap<String, (Body, String)>,
) -> Option<Origin> {
    let body = |name: &str| bodies.get(name).map(|(b, _)| b);
    match fault {
        MechanismFault::Inertia { body: name, .. } => body(name).map(|b| b.inertia_origin),
        MechanismFault::UnknownParent { body: name, .. } => body(name).map(|b| b.origin),
        MechanismFault::BadAxis { body: what, .. }
        | MechanismFault::BadArmature { body: what, .. }
        | MechanismFault::BadGear { body: what, .. }
        | MechanismFault::BadLimits { body: what, .. } => {
            let name = what.strip_prefix("body `")?.strip_suffix('`')?;
            body(name).map(|b| b.origin)
        }
        MechanismFault::Cycle { path } => body(path.first()?).map(|b| b.parent.origin),
        MechanismFault::Duplicate { name, .. } | MechanismFault::BadName { name, .. } => {
            body(name).map(|b| b.origin)
        }
        MechanismFault::UnknownBody { body: name, .. } => body(name).map(|b| b.origin),
        MechanismFault::Modes { body: name, .. }
        | MechanismFault::Attachment { body: name, .. } => body(name).map(|b| b.origin),
        _ => None,
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
