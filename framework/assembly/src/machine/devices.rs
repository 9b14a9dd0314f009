//! Devices of a description as parts of an assembly: actuators, tendons, sensors, balancers.
use crate::form::assembly::{AssemblyForm, PartForm, PartKind};
use crate::text::value::{Text, empty_map, list, plain, push};
use linkwork_formats::{
    Actuator, Description, Device, DeviceFrame, DeviceKind, Geometry, HingeCoordinate, Length,
    Sensor, Tendon,
};
use linkwork_multibody::BodySpec;
use linkwork_runtime::{Located, Origin, Value};
use std::collections::{BTreeMap, BTreeSet};

/// Names for the references of parts.
pub(crate) struct Names<'a> {
    /// Body in the description → body of the assembly.
    pub bodies: &'a BTreeMap<String, String>,
    /// Node in the description → `body/node` of the assembly.
    pub nodes: &'a BTreeMap<String, String>,
}

/// Adds the parts and exports of all devices; unsupported ones are lines in `left_out`.
pub(crate) fn add(
    d: &Description,
    names: &Names<'_>,
    assembly: &mut AssemblyForm,
    left_out: &mut Vec<String>,
) {
    let specs: BTreeMap<&str, &BodySpec> =
        d.builder.bodies().iter().map(|b| (b.name.as_str(), b)).collect();
    let of_bodies: BTreeSet<&str> = names.bodies.values().map(String::as_str).collect();
    // Actuators keep their names; tendons and sensors are renamed after conflicts.
    let mut order: Vec<&Device> = d.devices.iter().collect();
    order.sort_by_key(|device| match device.kind {
        DeviceKind::Actuator(_) => 0,
        DeviceKind::Tendon(_) => 1,
        _ => 2,
    });
    let mut found: BTreeMap<(&str, bool), String> = BTreeMap::new();
    for device in order {
        // The names of parts and bodies must differ, because the paths of their variables have the
        // same form.
        let taken = |n: &str| {
            assembly.parts.contains_key(n)
                || assembly.exports.contains_key(n)
                || of_bodies.contains(n)
        };
        let name = plain(&device.name, taken);
        let made = match &device.kind {
            DeviceKind::Actuator(a) => actuator(a, &specs, names),
            DeviceKind::Tendon(t) => tendon(t, &specs, names),
            DeviceKind::GravityCompensation { body, share } => {
                let body = names.bodies.get(body);
                body.map(|local| {
                    let params = vec![("share".to_owned(), Value::Number(*share).into())];
                    let bind = vec![("body".to_owned(), text(format!("node:{local}")))];
                    ("actuators.gravity_compensation", params, bind)
                })
            }
            DeviceKind::Sensor(Sensor::Of { device: other, output }) => {
                let actuator = output == "force";
                let of = found.get(&(other.as_str(), actuator));
                if let Some(of) = of.or_else(|| found.get(&(other.as_str(), !actuator))) {
                    assembly.exports.insert(name, Text::new(format!("{of}.{output}")));
                    continue;
                }
                None
            }
            DeviceKind::Sensor(s) => sensor(s, &specs, names, assembly),
        };
        let Some((model, params, bind)) = made else {
            left_out.push(format!("device `{}`", device.name));
            continue;
        };
        found.insert((&device.name, matches!(device.kind, DeviceKind::Actuator(_))), name.clone());
        assembly.parts.insert(name, part(model, params, bind));
    }
}

/// Parameters and bindings.
type Fields = (Vec<(String, Located)>, Vec<(String, Located)>);
/// Model, parameters and bindings.
type ModelFields = (&'static str, Vec<(String, Located)>, Vec<(String, Located)>);

fn part(model: &str, params: Vec<(String, Located)>, bind: Vec<(String, Located)>) -> PartForm {
    let kind = PartKind::Model {
        model: Text::new(model),
        rate: None,
        offset: None,
        bind: Value::Map(bind).into(),
        folder: None,
    };
    let params = if params.is_empty() { empty_map() } else { Value::Map(params).into() };
    PartForm { kind, params, array: None, doc: String::new(), origin: Origin::NONE }
}

fn text(t: String) -> Located {
    Value::Text(t).into()
}

/// Returns `link` or `link[1]`: the coordinate of a term.
pub(crate) fn coordinate(
    at: &HingeCoordinate,
    specs: &BTreeMap<&str, &BodySpec>,
    bodies: &BTreeMap<String, String>,
) -> String {
    let chain = specs.get(at.body.as_str()).map_or(&[][..], |b| &b.hinge.subhinges);
    let before = chain.iter().take(at.subhinge).filter(|s| s.kind.nv() == 1).count();
    let local = bodies.get(&at.body).unwrap_or(&at.body);
    let one = chain.iter().filter(|s| s.kind.nv() == 1).count() < 2;
    if one { local.clone() } else { format!("{local}[{before}]") }
}

/// Returns the parameters and bindings of a length; terms of the same coordinate are added. `None`: a site does not exist.
fn length(l: &Length, specs: &BTreeMap<&str, &BodySpec>, names: &Names<'_>) -> Option<Fields> {
    let (mut params, mut bind) = (Vec::new(), Vec::new());
    match l {
        Length::Joints(terms) => {
            let mut sums: Vec<(String, f64)> = Vec::new();
            for t in terms {
                let at = coordinate(&t.coordinate, specs, names.bodies);
                match sums.iter_mut().find(|(k, _)| *k == at) {
                    Some((_, sum)) => *sum += t.factor,
                    None => sums.push((at, t.factor)),
                }
            }
            push(&mut params, "factors", list(sums.iter().map(|(_, c)| *c)));
            let joints = sums.iter().enumerate();
            bind.extend(
                joints.map(|(k, (at, _))| (format!("joint{}", k + 1), text(format!("hinge:{at}")))),
            );
        }
        Length::Line { gear, sites } => {
            push(&mut params, "factors", list([*gear]));
            push(&mut params, "sites", Value::Number(sites.len() as f64));
            for (k, site) in sites.iter().enumerate() {
                bind.push((format!("site{}", k + 1), frame(site, names)?));
            }
        }
        Length::Wrench { gear, site, reference } => {
            push(&mut params, "wrench", list(*gear));
            let sites = std::iter::once(site).chain(reference);
            push(&mut params, "sites", Value::Number(sites.clone().count() as f64));
            for (k, site) in sites.enumerate() {
                bind.push((format!("site{}", k + 1), frame(site, names)?));
            }
        }
    }
    Some((params, bind))
}

/// Returns the binding of a frame.
fn frame(f: &DeviceFrame, names: &Names<'_>) -> Option<Located> {
    let at = match f {
        DeviceFrame::Body(b) => names.bodies.get(b),
        DeviceFrame::Node(n) => names.nodes.get(n),
    };
    Some(text(format!("node:{}", at?)))
}

fn actuator(
    a: &Actuator,
    specs: &BTreeMap<&str, &BodySpec>,
    names: &Names<'_>,
) -> Option<ModelFields> {
    let (mut params, bind) = length(&a.length, specs, names)?;
    push(&mut params, "gain", list(a.gain));
    push(&mut params, "bias", list(a.bias));
    if let Some(w) = a.activation {
        match w.time_constant {
            Some(time) => push(&mut params, "time_constant", Value::Number(time)),
            None => push(&mut params, "integrates", Value::Bool(true)),
        }
        push(&mut params, "activation_range", w.range.map_or(Value::Null, list));
    }
    for (key, range) in [("control_range", a.control), ("force_range", a.force)] {
        push(&mut params, key, range.map_or(Value::Null, list));
    }
    Some(("actuators.general_actuator", params, bind))
}

fn tendon(t: &Tendon, specs: &BTreeMap<&str, &BodySpec>, names: &Names<'_>) -> Option<ModelFields> {
    let (mut params, bind) = length(&t.length, specs, names)?;
    push(&mut params, "stiffness", Value::Number(t.stiffness));
    if t.stiffness != 0.0 {
        push(&mut params, "rest", list(t.rest));
    }
    push(&mut params, "damping", Value::Number(t.damping));
    if let Some(range) = t.range {
        push(&mut params, "range", list(range));
        push(&mut params, "limit_stiffness", Value::Number(t.limit[0]));
        push(&mut params, "limit_damping", Value::Number(t.limit[1]));
    }
    Some(("actuators.tendon", params, bind))
}

fn sensor(
    s: &Sensor,
    specs: &BTreeMap<&str, &BodySpec>,
    names: &Names<'_>,
    assembly: &AssemblyForm,
) -> Option<ModelFields> {
    let frame = |f: &DeviceFrame| Some(vec![("mount".to_owned(), frame(f, names)?)]);
    Some(match s {
        Sensor::Joint(at) => {
            let at = coordinate(at, specs, names.bodies);
            let bind = vec![("shaft".to_owned(), text(format!("hinge:{at}")))];
            ("sensors.joint_motion", Vec::new(), bind)
        }
        Sensor::Motion(f) => ("sensors.motion", Vec::new(), frame(f)?),
        Sensor::SpecificForce(f) => ("sensors.specific_force", Vec::new(), frame(f)?),
        Sensor::Relative { frame: mount, reference } => {
            let mut bind = frame(mount)?;
            bind.push(("reference".to_owned(), self::frame(reference, names)?));
            ("sensors.relative_motion", Vec::new(), bind)
        }
        Sensor::Bodies(bodies) => {
            let mut params = Vec::new();
            push(&mut params, "bodies", Value::Number(bodies.len() as f64));
            let node = |(k, b): (usize, &String)| {
                let local = names.bodies.get(b)?;
                Some((format!("body{}", k + 1), text(format!("node:{local}"))))
            };
            let bind: Option<Vec<_>> = bodies.iter().enumerate().map(node).collect();
            ("sensors.subtree", params, bind?)
        }
        Sensor::HingeLoad { body, frame } => {
            let mut params = Vec::new();
            push(&mut params, "position", list(frame.position.iter().copied()));
            push(&mut params, "attitude", list(frame.rotation.coords.iter().copied()));
            let tool = format!("node:{}", names.bodies.get(body)?);
            ("sensors.hinge_load", params, vec![("tool".to_owned(), text(tool))])
        }
        Sensor::Touch { frame: site, zone, .. } => {
            let half = |size: &[f64; 3]| size.map(|x| 0.5 * x);
            let (shape, size) = match zone {
                Geometry::Sphere { radius } => ("ellipsoid", [*radius; 3]),
                Geometry::Ellipsoid { radii } => ("ellipsoid", *radii),
                Geometry::Box { size } => ("box", half(size)),
                Geometry::Cylinder { radius, length } => ("cylinder", [*radius, 0.5 * length, 0.0]),
                Geometry::Capsule { radius, length } => ("capsule", [*radius, 0.5 * length, 0.0]),
                _ => return None,
            };
            let mut params = Vec::new();
            push(&mut params, "shape", Value::Text(shape.into()));
            push(&mut params, "size", list(size));
            let site = self::frame(site, names)?;
            ("sensors.touch", params, vec![("site".to_owned(), site)])
        }
        Sensor::Range { body, frame: mount } => {
            let mut params = Vec::new();
            // A pattern for a body without shapes would be an error.
            let local = body.as_ref().and_then(|b| names.bodies.get(b));
            if let Some(local) = local.filter(|b| has_shapes(assembly, b)) {
                let other = Value::Text(format!("!./{local}")).into();
                push(&mut params, "sees", Value::List(vec![other]));
            }
            ("sensors.range_finder", params, frame(mount)?)
        }
        Sensor::Of { .. } => return None,
    })
}

/// Returns whether a body of an assembly has shapes.
fn has_shapes(assembly: &AssemblyForm, body: &str) -> bool {
    let fields = assembly.bodies.get(body).map(|b| &b.fields.value);
    let Some(Value::Map(fields)) = fields else { return false };
    fields.iter().any(|(key, v)| key == "shapes" && v.value != Value::List(Vec::new()))
}
