//! Conversion of the tree of instances to the mechanism: bodies, loops, couplings, colliders, contact.
pub(crate) mod anchor;
mod colliders;
mod constraints;
mod contact;
mod faults;

use crate::body::collider::Collider;
use crate::body::shapes::BodyShape;
use crate::body::{self, Body};
use crate::expand::instance::Instance;
use crate::expand::reference::resolve;
use crate::mechanism::anchor::{Bodies, anchor};
use crate::schema::kind::At;
use crate::text::files::Files;
use crate::text::report::Cx;
use crate::text::value::{full_name, outer};
use linkwork_collision::{ColliderSpec, Colliders, Shape, VisualShape};
use linkwork_multibody::{BodySpec, Builder, Loop, LoopMotion, Modes, Multibody};
use linkwork_plant::{ContactSpec, MechanismSpec};
use linkwork_runtime::{Located, Origin};
use linkwork_solvers::FixedValues;
use linkwork_spatial::Pose;
use linkwork_surroundings::{BodyStart, PLAIN, Scenery, Sight};
use std::collections::BTreeMap;
use std::sync::Arc;

/// The mechanism with its shapes.
pub(crate) struct Mechanism {
    pub spec: Option<MechanismSpec>,
    pub shapes: Vec<BodyShape>,
    /// Colliding ground without a visual shape.
    pub grounds: Vec<BodyShape>,
    pub colliders: Option<Arc<Colliders>>,
    /// Position of the first collider in the file.
    pub collides: Option<Origin>,
    /// Replacements for the resolved text.
    pub told: References,
}

/// References from the top level, and geometry from files.
#[derive(Default)]
pub(crate) struct References {
    /// Full name of each body → full reference of its parent; of each separate collider → that of its body.
    pub parents: BTreeMap<String, String>,
    /// Full name of each loop and coupling → its fields.
    pub constraints: BTreeMap<String, Located>,
    /// Full name of each body → index of the shape, collider.
    pub colliders: BTreeMap<String, Vec<(usize, ColliderSpec)>>,
    /// Full name of each separate collider → itself.
    pub standing: BTreeMap<String, ColliderSpec>,
    /// References of separate colliders from the top level.
    pub on: BTreeMap<String, String>,
    /// Full name of each flexible body → its modes.
    pub modes: BTreeMap<String, Modes>,
    /// The resolved `contact`.
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
    let (mut shapes, mut told) = (Vec::new(), References::default());
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
    let standing = colliders::standing(cx, root, &instances, files, &bodies);
    shapes.extend(standing.shapes);
    told.on = standing.references;
    for c in &standing.colliders {
        told.standing.insert(c.spec.name.clone(), c.spec.clone());
    }
    let of_bodies = bodies.values().flat_map(|(b, _)| b.colliders.iter().map(|(_, c)| c.clone()));
    let all: Vec<Collider> = of_bodies.chain(standing.colliders).collect();
    let collides = all.first().map(|c| c.origin);
    // After a mistake, a collider may be missing; references to it do not cause further faults.
    let complete = cx.faults.len() == before;
    let contact = contact::read(cx, root, &instances, &bodies, (&all, complete));
    told.constraints = std::mem::take(&mut constraints.resolved);
    told.contact = contact.resolved.clone();
    if contact.compliant.is_some() {
        contact.rub(builder.bodies_mut());
    }
    if bodies.is_empty() {
        let grounds = Vec::new();
        return Mechanism { spec: None, shapes, grounds, colliders: None, collides: None, told };
    }
    let built = match builder.build() {
        Ok(multibody) => Some(Arc::new(multibody)),
        Err(error) => {
            for fault in error.faults {
                let place =
                    faults::fault_origin(&fault, &bodies, &constraints.origins).unwrap_or(origin);
                cx.explained(place, "", [faults::Placed(fault)]);
            }
            None
        }
    };
    let named = |which: &dyn Fn(&Body) -> bool| -> Vec<String> {
        bodies.iter().filter(|(_, (b, _))| which(b)).map(|(name, _)| name.clone()).collect()
    };
    let joined = std::mem::take(&mut constraints.joined);
    let colliders = contact::colliders(cx, &contact, all, joined, built.as_deref()).map(Arc::new);
    let grounds = grounds(colliders.as_deref(), &shapes);
    let spec = built.map(|multibody| {
        let (q, v, kept) = start(&multibody, &bodies);
        let on = contact.on(&multibody).zip(colliders.clone());
        let started = |l: &Loop| {
            let mut all = constraints.motions.remove(&l.closure.name).unwrap_or_default();
            all.extend(l.gaps.clone().map(|_| LoopMotion::default()));
            all
        };
        let motions = multibody.loops().iter().flat_map(started).collect();
        MechanismSpec {
            gravity,
            origin,
            constraint_methods: constraints.constraint_methods,
            closings: constraints.closings,
            motions,
            origins: constraints.origins,
            bodies: Arc::new(
                bodies.iter().map(|(name, (body, _))| (name.clone(), body.origin)).collect(),
            ),
            contact: on
                .filter(|_| contact.compliant.is_none())
                .map(|(settings, colliders)| ContactSpec { colliders, settings }),
            compliant: colliders.clone().zip(contact.compliant),
            terrain: contact.terrain,
            ground_friction: contact.ground_friction,
            reactions: named(&|b| b.reaction),
            held: named(&|b| b.held),
            pair_forces: contact.pair_forces,
            settings: contact.written,
            kept,
            starts: starts(cx, &bodies),
            scenery: Scenery::of(shapes.iter().chain(&grounds).map(sight).collect()),
            ..MechanismSpec::new(path, multibody, q, v)
        }
    });
    let colliders = colliders.filter(|c| !c.is_empty());
    Mechanism { spec, shapes, grounds, colliders, collides, told }
}

/// Default colour of ground.
const GROUND: [f64; 4] = [0.59, 0.53, 0.45, 1.0];

/// Returns visual shapes for colliders without one, so that obstacles are visible. Solids and mesh files are shown as shapes, unless the file hides
/// them.
fn grounds(colliders: Option<&Colliders>, shapes: &[BodyShape]) -> Vec<BodyShape> {
    let shown = |name: &str| shapes.iter().any(|s| format!("{}/{}", s.body, s.name) == name);
    let ground = |c: &&ColliderSpec| {
        let solid = matches!(
            c.fine,
            Shape::Sphere { .. }
                | Shape::Ellipsoid { .. }
                | Shape::Box { .. }
                | Shape::Capsule { .. }
                | Shape::Cylinder { .. }
                | Shape::Mesh { .. }
        );
        !solid && !shown(&c.name)
    };
    let shape = |c: &ColliderSpec| BodyShape {
        body: c.body.clone(),
        pose: c.pose,
        shape: VisualShape::Shape(c.fine.clone()),
        color: Some(GROUND),
        name: c.name.replace(['.', '/'], "_"),
    };
    let all = colliders.into_iter().flat_map(|all| all.ids().map(|id| all.spec(id)));
    all.filter(ground).map(shape).collect()
}

/// Returns a shape for cameras.
fn sight(s: &BodyShape) -> Sight {
    Sight {
        body: s.body.clone(),
        name: s.name.clone(),
        pose: s.pose,
        form: s.shape.clone(),
        color: s.color.map_or(PLAIN, |[r, g, b, _]| [r, g, b]),
    }
}

/// Returns all bodies of all instances.
fn bodies(cx: &mut Cx, root: &Instance, instances: &[&Instance], files: &Files<'_>) -> Bodies {
    let mut bodies = Bodies::new();
    for here in instances {
        let around = outer(&here.path);
        for (mount, text) in &here.mounts {
            if let Err((fact, help)) = resolve(root, around, &text.text) {
                let message = format!("`{}`: mount `{mount}`: {fact}", here.path);
                cx.fault(text.origin, message, help);
            }
        }
        for (name, b) in &here.bodies {
            let full = full_name(&here.path, name);
            let at = At::new(format!("body `{full}`")).origin(b.origin).among((files, &b.home));
            let body = body::read(cx, &full, &b.fields, &at);
            bodies.extend(body.map(|body| (full, (body, here.path.clone()))));
        }
    }
    bodies
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

/// Returns bodies with an orbital or geodetic start. W must be the frame of their hinge on both sides.
fn starts(cx: &mut Cx, bodies: &Bodies) -> Vec<BodyStart> {
    let mut all = Vec::new();
    for (name, (body, _)) in bodies {
        let Some(start) = body.start.clone() else { continue };
        let plain = body.at == Pose::identity() && body.hinge_frame == Pose::identity();
        if body.parent.text != "world" || !plain {
            let fact = format!(
                "body `{name}` starts on an orbit or in named axes, but its hinge is not at the origin of W"
            );
            let help = "write `parent: \"world\"`, and neither `at` nor `hinge_frame`";
            cx.fault(body.origin, fact, help);
            continue;
        }
        all.push(BodyStart { body: name.clone(), start, origin: body.origin });
    }
    all
}

fn start(mb: &Multibody, bodies: &Bodies) -> (Vec<f64>, Vec<f64>, FixedValues) {
    let (mut q, mut v) = (mb.neutral_q(), vec![0.0; mb.nv()]);
    let mut kept = FixedValues { positions: vec![false; mb.nv()], rates: vec![false; mb.nv()] };
    for b in mb.bodies() {
        if let Some((body, _)) = bodies.get(b.name()) {
            q[b.q()].copy_from_slice(&body.q);
            v[b.v()].copy_from_slice(&body.v);
            kept.positions[b.v()].copy_from_slice(&body.kept[0]);
            kept.rates[b.v()].copy_from_slice(&body.kept[1]);
        }
    }
    (q, v, kept)
}
