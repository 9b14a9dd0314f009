//! A body with numbers, from fields whose parameters have been replaced.
pub(crate) mod collider;
pub(crate) mod constraint;
pub(crate) mod contact;
pub(crate) mod hinge;
pub(crate) mod initial;
pub(crate) mod mass;
pub(crate) mod modes;
pub(crate) mod shapes;
pub(crate) mod solid;

use crate::body::collider::Collider;
use crate::body::hinge::{Drive, hinge};
use crate::body::modes::modes;
use crate::body::shapes::{BodyShape, Shapes, shapes};
use crate::schema::kind::{At, flag, raw, table_of, text};
use crate::schema::read::{fields, name};
use crate::schema::record::{Presence, Record, of, record};
use crate::text::report::Cx;
use crate::text::value::Text;
use linkwork_multibody::{Coordinate, Hinge, Modes, SubhingeKind};
use linkwork_runtime::{Located, Origin};
use linkwork_spatial::{MassProperties, Pose, Vec3};
use linkwork_surroundings::Start;

record! {
    /// A body, without its mass and the drive of its hinge.
    pub(crate) struct BodyForm: "body" {
        /// The parent: `world`, a body, a node or a mount.
        parent: Option<Text> = text().wanted("write `parent: \"world\"`, another body, or a mount"),
        /// The hinge's frame in the parent.
        at: Pose = of::<Pose>().or(Pose::identity()),
        /// The hinge (default: a weld).
        hinge: Hinge = hinge().or(Hinge::locked()),
        /// The hinge's frame in the body.
        hinge_frame: Pose = of::<Pose>().or(Pose::identity()),
        /// The initial state.
        initial: Option<Located> = raw(initial::schema).maybe(),
        /// Report the force and moment that its hinge transmits, and the effort at its coordinates.
        reaction: bool = flag().or(false),
        /// The flexible modes.
        modes: Option<Modes> = modes().maybe(),
        /// Visual and collision shapes.
        shapes: Option<Located> = raw(shapes::schema).maybe(),
        /// Named frames on the body.
        nodes: Vec<(Text, Pose)> = table_of(of::<Pose>()).or(Vec::new()),
        /// Documentation.
        doc: Option<Text> = text().maybe(),
    }
}

/// All fields of a body.
pub(crate) type BodyFields = (BodyForm, (Drive, MassProperties));

/// A body before the name of its parent is resolved.
pub(crate) struct Body {
    pub name: String,
    pub parent: Text,
    pub at: Pose,
    pub hinge_frame: Pose,
    pub hinge: Hinge,
    pub mass: MassProperties,
    pub q: Vec<f64>,
    pub v: Vec<f64>,
    /// Which entries of q and of v are specified and must be kept, by their indices among the rates.
    pub kept: [Vec<bool>; 2],
    /// The orbital or geodetic start, in place of position and velocity.
    pub start: Option<Start>,
    pub shapes: Vec<BodyShape>,
    /// Index in `shapes`, and collider.
    pub colliders: Vec<(usize, Collider)>,
    pub nodes: Vec<(String, Pose, Origin)>,
    /// Whether its hinge reports its load.
    pub reaction: bool,
    /// Its hinge is locked, and a prescribed coordinate replaces it, so that its load is computed.
    pub held: bool,
    pub origin: Origin,
    /// Position of mass and inertia in the file, for faults.
    pub inertia_origin: Origin,
    /// The flexible modes.
    pub modes: Option<Modes>,
    pub modes_origin: Origin,
}

/// Reads a body; what cannot be read is recorded and left at its neutral value.
pub(crate) fn read(cx: &mut Cx, full: &str, v: &Located, at: &At<'_>) -> Option<Body> {
    let origin = at.origin.unwrap_or(v.origin);
    fields(cx, v, &at.what, &BodyFields::names());
    let form = BodyForm::read_fields(cx, v, at)?;
    let mut hinge = form.hinge;
    hinge::options(cx, v, at, &mut hinge.subhinges);
    let (q, rates, start) = initial::read(cx, form.initial.as_ref(), &hinge, &at.field("initial"));
    let kept = initial::kept(form.initial.as_ref(), &hinge);
    let held = form.reaction && hinge.subhinges.iter().all(|s| s.kind == SubhingeKind::Locked);
    let (q, rates, kept) = if held {
        hinge = Hinge::pin(Vec3::z());
        hinge.subhinges[0].coordinate = Coordinate::Prescribed;
        (vec![0.0], vec![0.0], [vec![true], vec![true]])
    } else {
        (q, rates, kept)
    };
    let mass = MassProperties::read_fields(cx, v, at).unwrap_or_else(MassProperties::massless);
    for (key, _) in &form.nodes {
        name(cx, &key.text, key.origin, "node");
    }
    let Shapes { shown, colliders } =
        form.shapes.map(|s| shapes(cx, &s, full, at)).unwrap_or_default();
    Some(Body {
        name: full.into(),
        parent: form.parent.unwrap_or_else(|| Text::new("world")),
        at: form.at,
        hinge_frame: form.hinge_frame,
        hinge,
        mass,
        q,
        v: rates,
        kept,
        start,
        shapes: shown,
        colliders,
        reaction: form.reaction,
        held,
        nodes: form.nodes.into_iter().map(|(key, p)| (key.text, p, key.origin)).collect(),
        origin,
        inertia_origin: v.get("inertia").or(v.get("mass")).map_or(origin, |i| i.origin),
        modes: form.modes,
        modes_origin: v.get("modes").map_or(origin, |m| m.origin),
    })
}
