//! Conversion of a description of a mechanism to an assembly: the same bodies in RON, in full precision.
use crate::body::{hinge::hinge, initial, modes::modes};
use crate::form::assembly::{AssemblyForm, ItemForm};
use crate::machine::devices;
use crate::schema::kind::Kind;
use crate::schema::record::Record;
use crate::text::value::{list, map, plain, push, variant};
use linkwork_collision::hull_surface;
use linkwork_formats::{
    BodyShape, CollisionClasses, CollisionMeshes, Description, DeviceKind, Filter, Geometry,
    Initial, Sensor, ShapeRole, Term, mesh_corners,
};
use linkwork_multibody::{BodySpec, NodeSpec, Powers, SubhingeKind};
use linkwork_runtime::{Located, Origin, Value};
use std::collections::{BTreeMap, BTreeSet};

/// An assembly converted from a description.
#[derive(Clone, Debug, PartialEq)]
pub struct Converted {
    /// The assembly: [`AssemblyForm::to_ron`] is its text.
    pub assembly: AssemblyForm,
    /// Parts of the description that an assembly does not support, one line each.
    pub left_out: Vec<String>,
    /// Name in the description → name in the assembly. They differ if the first contains characters with a meaning in references, or already begins
    /// with `NAME/`.
    pub bodies: BTreeMap<String, String>,
}

/// Whether collision shapes are converted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Collide {
    On,
    Off,
}

impl AssemblyForm {
    /// Returns the bodies, nodes, shapes, loops, couplings and devices of a description as an assembly with this name. Loaded alone, its mechanism is
    /// bit-identical to that of the description, with bodies, loops and couplings named `NAME/..`.
    #[must_use]
    pub fn from_description(name: &str, d: &Description) -> Converted {
        convert(name, d, Collide::On)
    }
}

/// Like [`from_description`], with or without collision shapes.
pub(crate) fn convert(name: &str, d: &Description, collide: Collide) -> Converted {
    let mut left_out = Vec::new();
    let bodies = local_names(name, d);
    let mut assembly = AssemblyForm { name: Some(name.into()), ..AssemblyForm::default() };
    let groups = Groups::new(d, &mut left_out);
    let mut shapes_of: BTreeMap<&str, Vec<usize>> = BTreeMap::new();
    for (k, s) in d.shapes.iter().enumerate() {
        shapes_of.entry(&s.body).or_default().push(k);
    }
    let mut nodes_of: BTreeMap<&str, Vec<&NodeSpec>> = BTreeMap::new();
    d.builder.nodes().iter().for_each(|n| nodes_of.entry(&n.body).or_default().push(n));
    let initial: BTreeMap<&str, &Initial> =
        d.initial.iter().map(|i| (i.body.as_str(), i)).collect();
    let mut places: BTreeMap<String, String> = BTreeMap::new(); // full paths of nodes
    // A body whose load or contact is measured stays a separate body, even if its hinge is locked.
    let measured: BTreeSet<&str> = (d.devices.iter())
        .filter_map(|device| match &device.kind {
            DeviceKind::Sensor(Sensor::HingeLoad { body, .. } | Sensor::Touch { body, .. }) => {
                Some(body.as_str())
            }
            _ => None,
        })
        .collect();
    for spec in d.builder.bodies() {
        let local = bodies[&spec.name].clone();
        let mut out = body_fields(spec, &bodies);
        let own = nodes_of.get(spec.name.as_str()).map_or(&[][..], Vec::as_slice);
        let nodes = nodes(spec, &local, name, own);
        for (key, n) in nodes.iter().map(|(key, _)| key).zip(own) {
            places.insert(n.name.clone(), format!("{local}/{key}"));
        }
        push(&mut out, "nodes", Value::Map(nodes));
        if measured.contains(spec.name.as_str()) {
            push(&mut out, "reaction", Value::Bool(true));
        }
        let shapes: Vec<Located> = (shapes_of.get(spec.name.as_str()).into_iter().flatten())
            .map(|k| (*k, &d.shapes[*k]))
            .filter(|(_, s)| s.role == ShapeRole::Visual || collide == Collide::On)
            .filter(|(_, s)| collide == Collide::Off || !shown_by_collider(d, s))
            .filter_map(|(k, s)| shape(s, d.collision_meshes, &groups.of(k), &mut left_out))
            .map(Located::from)
            .collect();
        push(&mut out, "shapes", Value::List(shapes));
        if let Some(i) = initial.get(spec.name.as_str()) {
            // Write the reference configuration of the file. In a machine with closed loops it is approximate, so that
            // it is adjusted to explicit values.
            let free = spec.hinge.subhinges.iter().any(|s| s.kind == SubhingeKind::Free);
            let loops = d.builder.loops().iter().chain(&d.loops).count();
            let couplings = d.builder.couplings().iter().chain(&d.couplings).count();
            let closed = loops + couplings > 0;
            push(&mut out, "initial", initial::value(&spec.hinge, &i.q, closed && !free));
        }
        assembly.bodies.insert(local, item(out));
    }
    let mut taken = BTreeSet::new();
    loops(name, d, &bodies, &mut assembly, &mut taken);
    couplings(name, d, &bodies, &mut assembly, &mut taken);
    let names = devices::Names { bodies: &bodies, nodes: &places };
    devices::add(d, &names, &mut assembly, &mut left_out);
    if collide == Collide::On {
        on_world(d, &groups, &mut assembly, &mut left_out);
        let end = |b: &String| {
            Value::Text(bodies.get(b).map_or("world", String::as_str).to_owned()).into()
        };
        let pairs = d.exclusions.iter().map(|[a, b]| Value::List(vec![end(a), end(b)]).into());
        let pairs: Vec<Located> = pairs.collect();
        assembly.ignore = (!pairs.is_empty()).then(|| Value::List(pairs).into());
    }
    left_out.extend(d.wheels.iter().map(|w| format!("wheel `{}`", w.body)));
    let visual = |s: &BodyShape| s.role == ShapeRole::Visual;
    let hidden = |s: &&BodyShape| match visual(s) {
        true => s.body == "world" && (collide == Collide::Off || !shown_by_collider(d, s)),
        false => collide == Collide::Off,
    };
    let hidden = d.shapes.iter().filter(hidden);
    left_out.extend(hidden.map(|s| format!("{:?} shape of `{}`", s.role, s.body)));
    let specs: BTreeMap<&str, &BodySpec> =
        d.builder.bodies().iter().map(|b| (b.name.as_str(), b)).collect();
    for j in &d.joints {
        let own = specs.get(j.body.as_str()).and_then(|b| b.hinge.subhinges.get(j.subhinge));
        for (what, said, acts) in [
            ("spring", j.stiffness, own.map_or(0.0, |s| s.spring.stiffness)),
            ("damping", j.damping, own.map_or(0.0, |s| s.damping)),
            ("friction", j.friction, own.map_or(0.0, |s| s.friction.force)),
        ] {
            if said != 0.0 && acts == 0.0 {
                left_out.push(format!("{what} of `{}`", j.name));
            }
        }
    }
    Converted { assembly, left_out, bodies }
}

fn item(fields: Vec<(String, Located)>) -> ItemForm {
    ItemForm { fields: Value::Map(fields).into(), origin: Origin::NONE }
}

/// Returns a unique name among those of loops and couplings.
fn own_name(name: &str, written: &str, taken: &mut BTreeSet<String>) -> String {
    let short = written.strip_prefix(&format!("{name}/")).unwrap_or(written);
    let out = plain(short, |n| taken.contains(n));
    taken.insert(out.clone());
    out
}

/// Returns the loops of the builder, and the separate ones.
fn loops(
    name: &str,
    d: &Description,
    bodies: &BTreeMap<String, String>,
    assembly: &mut AssemblyForm,
    taken: &mut BTreeSet<String>,
) {
    for l in d.builder.loops().iter().chain(&d.loops) {
        let mut out = Vec::new();
        let end = |body: &String| {
            Value::Text(bodies.get(body).map_or("world", String::as_str).to_owned())
        };
        push(&mut out, "a", end(&l.body_a));
        push(&mut out, "at_a", l.frame_a.write());
        push(&mut out, "b", end(&l.body_b));
        push(&mut out, "at_b", l.frame_b.write());
        push(&mut out, "hinge", hinge().write(&l.hinge));
        assembly.loops.insert(own_name(name, &l.name, taken), item(out));
    }
}

/// Returns the couplings of the builder, and the separate ones.
fn couplings(
    name: &str,
    d: &Description,
    bodies: &BTreeMap<String, String>,
    assembly: &mut AssemblyForm,
    taken: &mut BTreeSet<String>,
) {
    let specs: BTreeMap<&str, &BodySpec> =
        d.builder.bodies().iter().map(|b| (b.name.as_str(), b)).collect();
    for c in d.builder.couplings().iter().chain(&d.couplings) {
        let term = |t: &Term| (devices::coordinate(&t.coordinate, &specs, bodies), t.factor);
        let terms: Vec<(String, f64)> = c.terms.iter().map(term).collect();
        // The terms of a map are sorted by body and subhinge when it is read. Write a list if the
        // order is different.
        let place = |t: &Term| (bodies.get(&t.coordinate.body), t.coordinate.subhinge);
        let written = match c.terms.is_sorted_by(|a, b| place(a) < place(b)) {
            true => {
                Value::Map(terms.into_iter().map(|(k, x)| (k, Value::Number(x).into())).collect())
            }
            false => Value::List(
                (terms.into_iter())
                    .map(|(k, x)| {
                        map(vec![
                            ("of", Value::Text(k).into()),
                            ("factor", Value::Number(x).into()),
                        ])
                    })
                    .collect(),
            ),
        };
        let mut out = Vec::new();
        push(&mut out, "terms", written);
        push(&mut out, "constant", Value::Number(c.constant));
        if !c.powers.is_empty() {
            let one = |p: &Powers| {
                (devices::coordinate(&p.coordinate, &specs, bodies), list(p.factors).into())
            };
            push(&mut out, "powers", Value::Map(c.powers.iter().map(one).collect()));
        }
        assembly.couplings.insert(own_name(name, &c.name, taken), item(out));
    }
}

/// Adds collision shapes of the world as colliders.
fn on_world(
    d: &Description,
    groups: &Groups,
    assembly: &mut AssemblyForm,
    left_out: &mut Vec<String>,
) {
    let shapes = d.shapes.iter().enumerate();
    for (k, s) in shapes.filter(|(_, s)| s.body == "world" && s.role != ShapeRole::Visual) {
        let surface = groups.of(k);
        let Some(Value::Map(fields)) = shape(s, d.collision_meshes, &surface, left_out) else {
            continue;
        };
        let keep = |k: &str| ["shape", "at", "color"].contains(&k);
        let mut out = vec![("on".to_owned(), Value::Text("world".into()).into())];
        out.extend(fields.into_iter().filter(|(k, _)| keep(k)));
        out.extend(surface_of(s, &surface));
        let written = if s.name.is_empty() { "ground" } else { &s.name };
        let key = plain(written, |n| assembly.colliders.contains_key(n));
        assembly.colliders.insert(key, item(out));
    }
}

/// Largest number of collision groups of a description in addition to `default`.
const GROUPS: usize = 126;

/// The collision groups of the shapes of a description.
struct Groups {
    classes: CollisionClasses,
    /// The group of each class.
    names: Vec<String>,
    /// Whether each class collides with shapes from outside the file, which have the default filter.
    outside: Vec<bool>,
}

/// The groups of one shape; empty: `default`, and it collides with all.
#[derive(Default)]
struct ShapeGroups {
    group: Option<String>,
    meets: Option<Vec<String>>,
}

impl Groups {
    fn new(d: &Description, left_out: &mut Vec<String>) -> Self {
        let classes = d.collision_classes();
        let mut filters = vec![Filter::default(); classes.meets.len()];
        let mut names = vec!["default".to_owned(); classes.meets.len()];
        for (k, s) in d.shapes.iter().enumerate().filter(|(_, s)| s.role != ShapeRole::Visual) {
            let class = classes.of[k];
            if class > 0 {
                filters[class] = s.filter;
                names[class] = format!("{:x}_{:x}", s.filter.category, s.filter.meets);
                // Each shape of a pair has a separate group.
                if d.pairs.iter().flatten().any(|p| *p == k) {
                    names[class] = format!("{}_{k}", names[class]);
                }
            }
        }
        if names.len() > GROUPS {
            left_out.push(format!(
                "collision bit masks with {} different combinations (the limit is {GROUPS}), so all shapes collide",
                names.len()
            ));
            return Self { classes, names: Vec::new(), outside: Vec::new() };
        }
        let outside = filters.iter().map(|f| f.lets(Filter::default())).collect();
        Self { classes, names, outside }
    }

    /// The groups of a shape of the description.
    fn of(&self, shape: usize) -> ShapeGroups {
        if self.names.len() < 2 {
            return ShapeGroups::default(); // with one class, all shapes collide
        }
        let class = self.classes.of[shape];
        let used = |k: &&usize| **k > 0 || self.outside[class];
        let all = self.classes.meets[class].iter().filter(used).map(|k| self.names[*k].clone());
        let mut meets: Vec<String> = all.collect();
        if self.outside[class] && !meets.iter().any(|m| m == "default") {
            meets.push("default".into());
        }
        let group = (class > 0).then(|| self.names[class].clone());
        ShapeGroups { group, meets: Some(meets) }
    }
}

/// Returns the fields of a colliding shape: its surface and its groups.
fn surface_of(s: &BodyShape, groups: &ShapeGroups) -> Vec<(String, Located)> {
    let mut out = Vec::new();
    let texts =
        |all: &[String]| Value::List(all.iter().map(|t| Value::Text(t.clone()).into()).collect());
    if let Some(group) = &groups.group {
        push(&mut out, "group", Value::Text(group.clone()));
    }
    if let Some(meets) = &groups.meets {
        // Write an empty list, too: it means that the shape does not collide with anything.
        out.push(("meets".into(), texts(meets).into()));
    }
    for (field, x) in [
        ("friction", s.surface.friction),
        ("restitution", s.surface.restitution),
        ("rolling_friction", s.surface.rolling),
        ("spinning_friction", s.surface.spinning),
    ] {
        if let Some(x) = x {
            push(&mut out, field, Value::Number(x));
        }
    }
    out
}

fn local_names(name: &str, d: &Description) -> BTreeMap<String, String> {
    let mut out: BTreeMap<String, String> = BTreeMap::new();
    let mut taken: BTreeSet<String> = BTreeSet::new();
    let prefix = format!("{name}/");
    let short = |n: &str| n.strip_prefix(&prefix).unwrap_or(n).to_owned();
    // Names that need no change are assigned first, so that they stay available.
    let mut names: Vec<&str> = d.builder.bodies().iter().map(|b| b.name.as_str()).collect();
    names.sort_by_key(|n| (plain(&short(n), |_| false) != short(n), *n));
    for n in names {
        let local = plain(&short(n), |l| taken.contains(l));
        taken.insert(local.clone());
        out.insert(n.to_owned(), local);
    }
    out
}

fn body_fields(spec: &BodySpec, names: &BTreeMap<String, String>) -> Vec<(String, Located)> {
    let mut out = Vec::new();
    let parent = names.get(&spec.parent).map_or("world", String::as_str);
    push(&mut out, "parent", Value::Text(parent.into()));
    push(&mut out, "at", spec.hinge_in_parent.write());
    push(&mut out, "hinge_frame", spec.hinge_in_body.write());
    push(&mut out, "hinge", hinge().write(&spec.hinge));
    spec.mass.write_fields(&mut out);
    if let Some(m) = &spec.modes {
        push(&mut out, "modes", modes().write(m));
    }
    out
}

fn nodes(spec: &BodySpec, local: &str, name: &str, all: &[&NodeSpec]) -> Vec<(String, Located)> {
    let mut out: Vec<(String, Located)> = Vec::new();
    let prefixes = [format!("{name}/{local}/"), format!("{}/", spec.name)];
    for n in all {
        let short = prefixes.iter().find_map(|p| n.name.strip_prefix(p.as_str()));
        let key = plain(short.unwrap_or(&n.name), |k| out.iter().any(|(o, _)| o == k));
        out.push((key, n.pose.write().into()));
    }
    out
}

/// Returns whether a visual height field is shown because it collides: a viewer shows the surfaces of colliders.
fn shown_by_collider(d: &Description, s: &BodyShape) -> bool {
    let field = matches!(s.geometry, Geometry::HeightField { .. });
    let twin = |o: &BodyShape| {
        o.role == ShapeRole::Collision
            && (&o.body, &o.pose) == (&s.body, &s.pose)
            && o.geometry == s.geometry
    };
    field && s.role == ShapeRole::Visual && d.shapes.iter().any(twin)
}

/// Returns why a shape cannot be converted; `None` for a mesh whose file does not exist.
fn unusable(geometry: &Geometry) -> Option<String> {
    Some(match geometry {
        Geometry::Mesh { path: None, .. } => return None,
        Geometry::Mesh { file, scale, .. } => {
            format!("mesh `{file}` with the scale {scale:?}, which mirrors or flattens it")
        }
        Geometry::Plane { .. } => "plane without collisions".into(),
        Geometry::HeightField { .. } => "height field without collisions".into(),
        _ => "its sizes are not all positive".into(),
    })
}

/// Returns a shape in the form of an assembly; `None`, and a line in `left_out`, if it is not supported.
fn shape(
    s: &BodyShape,
    meshes: CollisionMeshes,
    groups: &ShapeGroups,
    left_out: &mut Vec<String>,
) -> Option<Value> {
    let number = Value::Number;
    let collides = s.role != ShapeRole::Visual;
    let of = |name: &str, fields: Vec<(&str, Value)>| {
        let fields = fields.into_iter().map(|(k, v)| (k.to_owned(), v.into())).collect();
        variant(name, Value::Map(fields))
    };
    let positive = |sizes: &[f64]| sizes.iter().all(|x| *x > 0.0);
    let solid = match &s.geometry {
        Geometry::Box { size } if positive(size) => Some(variant("Box", list(*size))),
        Geometry::Sphere { radius } if positive(&[*radius]) => {
            Some(variant("Sphere", number(*radius)))
        }
        Geometry::Ellipsoid { radii } if positive(radii) => {
            Some(variant("Ellipsoid", list(*radii)))
        }
        Geometry::Cylinder { radius, length } if positive(&[*radius, *length]) => {
            Some(of("Cylinder", vec![("radius", number(*radius)), ("length", number(*length))]))
        }
        Geometry::Capsule { radius, length } if positive(&[*radius, *length]) => {
            Some(of("Capsule", vec![("radius", number(*radius)), ("length", number(*length))]))
        }
        Geometry::Mesh { path: Some(path), scale: [x, y, z], file }
            if (x == y && y == z) || *x * *y * *z > 0.0 =>
        {
            // An unreadable visual mesh is reported by the warnings of a loaded simulation.
            let hull = collides && meshes == CollisionMeshes::Hulls;
            let corners = if collides { mesh_corners(path) } else { Ok(Vec::new()) };
            let corners = corners.and_then(|corners| match hull.then(|| hull_surface(&corners)) {
                Some(Err(why)) => Err(why.to_string()),
                _ => Ok(()),
            });
            if let Err(why) = corners {
                left_out.push(format!("shape of `{}`: mesh `{file}`: {why}", s.body));
                return None;
            }
            let path = std::path::absolute(path).unwrap_or_else(|_| path.clone());
            let file = Value::Text(path.display().to_string());
            let scale = if x == y && y == z { number(*x) } else { list([*x, *y, *z]) };
            let kind = if hull { "ConvexHull" } else { "Mesh" };
            Some(of(kind, vec![("file", file), ("scale", scale)]))
        }
        Geometry::Plane { .. } if collides => Some(variant("HalfSpace", Value::Null)),
        Geometry::HeightField { columns, spacing, heights } if collides && *columns > 1 => {
            let rows = (heights.len() / columns) as f64;
            let all = [("rows", number(rows)), ("columns", number(*columns as f64))];
            let fields = [("spacing", list(*spacing)), ("heights", list(heights.iter().copied()))];
            Some(of("HeightField", fields.into_iter().chain(all).collect()))
        }
        _ => None,
    };
    let Some(solid) = solid else {
        // A missing mesh file is reported by the reader.
        if let Some(why) = unusable(&s.geometry) {
            left_out.push(format!("shape of `{}`: {why}", s.body));
        }
        return None;
    };
    let mut out = Vec::new();
    push(&mut out, "shape", solid);
    push(&mut out, "at", s.pose.write());
    if let Some(c) = s.color {
        push(&mut out, "color", list(c.map(|x| x.clamp(0.0, 1.0))));
    }
    if !s.name.is_empty() {
        push(&mut out, "name", Value::Text(s.name.replace('$', "_")));
    }
    if collides {
        let surface = surface_of(s, groups);
        let plain = surface.is_empty();
        push(&mut out, "collide", if plain { Value::Bool(true) } else { Value::Map(surface) });
        push(&mut out, "visible", Value::Bool(false));
    }
    Some(Value::Map(out))
}
