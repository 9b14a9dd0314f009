//! Sensors of an MJCF file, and bodies with gravity compensation.
//!
//! ```text
//! jointpos, jointvel                                         a joint
//! gyro, velocimeter, framepos, framequat, frame?axis,
//! framelinvel, frameangvel                                   the motion of a frame, also relative to another frame
//! ballquat, ballangvel                                       the frames of a ball joint on the body and on its parent
//! accelerometer, framelinacc, frameangacc                    specific force and angular acceleration at a frame
//! force, torque                                              load of the hinge of the body of a site
//! touch, rangefinder                                         contacts in the zone of a site, a ray along its z axis
//! subtreecom, subtreelinvel, subtreeangmom                   a body and all bodies that it carries
//! tendonpos, tendonvel, actuatorpos, actuatorvel, actuatorfrc    outputs of other devices
//! ```
//! Readings are exact, as in MuJoCo, where `noise` is only information.

use super::Mj;
use super::tendon::Lengths;
use crate::read::Cx;
use crate::xml::Element;
use crate::{Description, Device, DeviceFrame, DeviceKind, Geometry, Sensor};
use linkwork_multibody::{BodySpec, SubhingeKind};
use linkwork_spatial::Pose;
use std::collections::{BTreeMap, BTreeSet};

/// Sensors that are not converted, with a remedy.
const ALTERNATIVES: [(&str, &str); 19] = [
    ("magnetometer", "add `sensors.magnetometer`, and wire the field to it"),
    ("camprojection", "add `sensors.camera`, or compute the pixel from `sensors.relative_motion`"),
    ("contact", "log `contact_force` of the body"),
    ("tactile", "log `contact_force` of the body"),
    ("jointactuatorfrc", "log `force` of the actuators of the joint"),
    ("tendonactuatorfrc", "log `force` of the actuators of the tendon"),
    ("jointlimitpos", "subtract `limits` from a `jointpos` in the program or metric that reads it"),
    ("jointlimitvel", "add a `jointvel`"),
    ("jointlimitfrc", "log the load of the hinge with `sensors.hinge_load`"),
    (
        "tendonlimitpos",
        "subtract `range` from a `tendonpos` in the program or metric that reads it",
    ),
    ("tendonlimitvel", "add a `tendonvel`"),
    ("tendonlimitfrc", "log `force` of the tendon, which contains the force of its limits"),
    (
        "insidesite",
        "add a `framepos` relative to the site, and compare it with the size of the site",
    ),
    ("distance", "add a `framepos` of one geom relative to the other, or log `contact_force`"),
    ("normal", "add a `framepos` of one geom relative to the other, or log `contact_force`"),
    ("fromto", "add a `framepos` of one geom relative to the other, or log `contact_force`"),
    ("e_potential", "the balance of energy of a run reports it"),
    ("e_kinetic", "the balance of energy of a run reports it"),
    ("clock", "conditions and plots have `time`"),
];

/// Sensors that other programs compute.
const FOREIGN: [&str; 2] = ["user", "plugin"];

/// Element, the attribute with the name of another device, and the output of that device.
const OTHERS: [(&str, &str, &str); 5] = [
    ("tendonpos", "tendon", "length"),
    ("tendonvel", "tendon", "velocity"),
    ("actuatorpos", "actuator", "length"),
    ("actuatorvel", "actuator", "velocity"),
    ("actuatorfrc", "actuator", "force"),
];

/// Data that the sensors of a file share while they are read.
struct Shared<'e, 'd> {
    lengths: &'d mut Lengths<'e>,
    d: &'d mut Description,
    tendons: BTreeSet<String>,
    actuators: BTreeSet<String>,
    /// Names of nodes and bodies.
    taken: BTreeSet<String>,
    /// The primitive shapes with a name: body and pose.
    geoms: BTreeMap<String, (String, Pose)>,
    /// The bodies that each body carries.
    carried: BTreeMap<String, Vec<String>>,
}

impl<'e, 'd> Shared<'e, 'd> {
    fn new(lengths: &'d mut Lengths<'e>, d: &'d mut Description) -> Self {
        let named = |tendon: bool| -> BTreeSet<String> {
            let own = |k: &DeviceKind| match k {
                DeviceKind::Tendon(_) => tendon,
                DeviceKind::Actuator(_) => !tendon,
                _ => false,
            };
            d.devices.iter().filter(|x| own(&x.kind)).map(|x| x.name.clone()).collect()
        };
        let (tendons, actuators) = (named(true), named(false));
        let nodes = d.builder.nodes().iter().map(|n| n.name.clone());
        let taken = nodes.chain(d.builder.bodies().iter().map(|b| b.name.clone())).collect();
        // The frame of a mesh or height field in MuJoCo differs from the frame of the shape.
        let plain =
            |g: &Geometry| !matches!(g, Geometry::Mesh { .. } | Geometry::HeightField { .. });
        let shapes = d.shapes.iter().filter(|s| !s.name.is_empty() && plain(&s.geometry));
        let geoms = shapes.map(|s| (s.name.clone(), (s.body.clone(), s.pose))).collect();
        let mut carried: BTreeMap<String, Vec<String>> = BTreeMap::new();
        for b in d.builder.bodies() {
            carried.entry(b.parent.clone()).or_default().push(b.name.clone());
        }
        Self { lengths, d, tendons, actuators, taken, geoms, carried }
    }

    /// Returns a node at a pose in a body, or a new body at a pose in the world.
    fn place(&mut self, body: &str, pose: Pose, wanted: String) -> DeviceFrame {
        let mut name = wanted;
        while self.taken.contains(&name) {
            name.push('_');
        }
        self.taken.insert(name.clone());
        if body == "world" {
            self.d.builder.body(BodySpec::new(&name, "world").hinge_in_parent(pose));
            return DeviceFrame::Body(name);
        }
        self.d.builder.node(&name, body, pose);
        DeviceFrame::Node(name)
    }

    /// Returns a body and all bodies that it carries.
    fn subtree(&self, body: &str) -> Vec<String> {
        let (mut out, mut todo) = (Vec::new(), vec![body]);
        while let Some(b) = todo.pop() {
            out.extend((b != "world").then(|| b.to_owned()));
            todo.extend(self.carried.get(b).into_iter().flatten().rev().map(String::as_str));
        }
        out
    }
}

impl<'e> Mj<'e> {
    /// All sensors.
    pub(super) fn sensors(
        &self,
        cx: &mut Cx<'_>,
        root: &'e Element,
        lengths: &mut Lengths<'e>,
        d: &mut Description,
    ) {
        let mut shared = Shared::new(lengths, d);
        for (k, e) in root.all("sensor").flat_map(|list| &list.children).enumerate() {
            let name = e.attr("name").map_or(format!("{}{}", e.name, k + 1), str::to_owned);
            if let Some(sensor) = self.sensor(cx, e, &format!("sensor `{name}`"), &mut shared) {
                shared.d.devices.push(Device { name, kind: DeviceKind::Sensor(sensor) });
            }
        }
    }

    /// Returns one sensor; `None` after a fault or a note.
    fn sensor(
        &self,
        cx: &mut Cx<'_>,
        e: &'e Element,
        what: &str,
        shared: &mut Shared<'e, '_>,
    ) -> Option<Sensor> {
        match e.name.as_str() {
            "jointpos" | "jointvel" => self.joint_sensor(cx, e, what, shared),
            "ballquat" | "ballangvel" => self.ball_sensor(cx, e, what, shared),
            "gyro" | "velocimeter" => self.at_site(cx, e, what, shared).map(Sensor::Motion),
            "accelerometer" => self.at_site(cx, e, what, shared).map(Sensor::SpecificForce),
            "force" | "torque" => self.load_at_site(cx, e, what, shared),
            "touch" => self.touch_at_site(cx, e, what, shared),
            "rangefinder" => self.range_at_site(cx, e, what, shared),
            "framelinacc" | "frameangacc" => {
                let reference = e.attr("refname").is_some();
                if reference {
                    let note = "`refname`: accelerations relative to another frame are not supported; differentiate a `framelinvel` with `refname`";
                    return leave_out(cx, e, what, note);
                }
                let moment = e.name == "frameangacc";
                self.object(cx, e, ("objtype", "objname"), moment, what, shared)
                    .map(Sensor::SpecificForce)
            }
            "framepos" | "framequat" | "framexaxis" | "frameyaxis" | "framezaxis"
            | "framelinvel" | "frameangvel" => self.frame_sensor(cx, e, what, shared),
            "subtreecom" | "subtreelinvel" | "subtreeangmom" => {
                e.touch();
                let body = cx.required(e, "body", what)?;
                if body != "world" && !self.elements.contains_key(body) {
                    let names = self.elements.keys().map(String::as_str);
                    cx.unknown(e.place_of("body"), what, "body", body, names);
                    return None;
                }
                let bodies = shared.subtree(body);
                if bodies.is_empty() {
                    return leave_out(cx, e, what, "a sensor of a world without bodies");
                }
                Some(Sensor::Bodies(bodies))
            }
            kind => {
                if let Some((_, key, output)) = OTHERS.iter().find(|(k, ..)| *k == kind) {
                    return device_sensor(cx, e, (*key, *output), what, shared);
                }
                // Elements that are not part of the format are listed with the unused elements.
                let alternative = ALTERNATIVES.iter().find(|(k, _)| *k == kind).map(|(_, r)| *r);
                let foreign = FOREIGN.contains(&kind);
                let remedy = alternative.or_else(|| {
                    foreign.then_some("add a part of the simulation that computes its readings")
                })?;
                e.touch_all();
                let note = format!("element <{kind}>: {remedy}");
                cx.ignored.push(e.ignored(format!("mujoco/sensor/{}", e.label()), note));
                None
            }
        }
    }

    fn joint_sensor(
        &self,
        cx: &mut Cx<'_>,
        e: &'e Element,
        what: &str,
        shared: &Shared<'e, '_>,
    ) -> Option<Sensor> {
        e.touch();
        let joint = cx.required(e, "joint", what)?;
        let sum = self.joint_sum(cx, joint, e.place_of("joint"), what, shared.lengths)?;
        Some(Sensor::Joint(sum.terms.into_iter().next()?.coordinate))
    }

    /// Reads a sensor of a ball joint: the frames of its hinge on the body and on the parent.
    fn ball_sensor(
        &self,
        cx: &mut Cx<'_>,
        e: &'e Element,
        what: &str,
        shared: &mut Shared<'e, '_>,
    ) -> Option<Sensor> {
        e.touch();
        let name = cx.required(e, "joint", what)?;
        let hinge_of = |joint: &str| {
            let body = &shared.d.joint(joint)?.body;
            let spec = shared.d.builder.bodies().iter().find(|b| b.name == *body)?;
            let balls = spec.hinge.subhinges.iter().filter(|s| s.kind == SubhingeKind::Ball);
            (balls.count() > 0).then_some(spec)
        };
        let Some(spec) = hinge_of(name) else {
            let all: Vec<&str> = self.joint_order.iter().map(String::as_str).collect();
            let balls = all.into_iter().filter(|j| hinge_of(j).is_some());
            cx.unknown(e.place_of("joint"), what, "ball joint", name, balls);
            return None;
        };
        if spec.hinge.subhinges.len() > 1 {
            let note = "a sensor of a ball on a body with several joints is not supported; write each joint on a separate body";
            return leave_out(cx, e, what, note);
        }
        let (body, parent) = (spec.name.clone(), spec.parent.clone());
        let (on_body, on_parent) = (spec.hinge_in_body, spec.hinge_in_parent);
        let frame = shared.place(&body, on_body, format!("{name}_ball"));
        let reference = shared.place(&parent, on_parent, format!("{name}_socket"));
        Some(Sensor::Relative { frame, reference })
    }

    fn at_site(
        &self,
        cx: &mut Cx<'_>,
        e: &'e Element,
        what: &str,
        shared: &mut Shared<'e, '_>,
    ) -> Option<DeviceFrame> {
        e.touch();
        let site = cx.required(e, "site", what)?;
        self.device_frame(cx, (e.place_of("site"), site), what, shared.lengths, shared.d)
    }

    /// Returns the load of the hinge of a site's body: what its parent exerts on it.
    fn load_at_site(
        &self,
        cx: &mut Cx<'_>,
        e: &'e Element,
        what: &str,
        shared: &Shared<'e, '_>,
    ) -> Option<Sensor> {
        e.touch();
        let name = cx.required(e, "site", what)?;
        let Some(site) = self.sites.get(name) else {
            cx.unknown(e.place_of("site"), what, "site", name, self.sites.keys().copied());
            return None;
        };
        if site.body == "world" {
            let note = "a load at a site of the world, which has no hinge; move the site to the body that carries the load";
            return leave_out(cx, e, what, note);
        }
        let spec = shared.d.builder.bodies().iter().find(|b| b.name == site.body)?;
        let frame = spec.hinge_in_body.inverse() * site.pose;
        Some(Sensor::HingeLoad { body: site.body.clone(), frame })
    }

    /// Reads a touch sensor: its zone is the site.
    fn touch_at_site(
        &self,
        cx: &mut Cx<'_>,
        e: &'e Element,
        what: &str,
        shared: &mut Shared<'e, '_>,
    ) -> Option<Sensor> {
        let on_world = e.attr("site").and_then(|s| self.sites.get(s)).filter(|s| s.body == "world");
        if on_world.is_some() {
            let note = "a touch sensor at a site of the world, whose contacts are not reported; move the site to the body that touches the world";
            return leave_out(cx, e, what, note);
        }
        let frame = self.at_site(cx, e, what, shared)?;
        let site = self.sites.get(e.attr("site")?)?;
        let named = format!("site `{}`", e.attr("site").unwrap_or_default());
        let faults = cx.faults.len();
        let Some(zone) = self.zone(cx, site, &named) else {
            let note = "the zone of its site follows from `fromto` or `mesh`; write `type`, `size`, and a pose for the <site>";
            return if cx.faults.len() > faults { None } else { leave_out(cx, e, what, note) };
        };
        Some(Sensor::Touch { body: site.body.clone(), frame, zone })
    }

    /// Reads a range finder at a site.
    fn range_at_site(
        &self,
        cx: &mut Cx<'_>,
        e: &'e Element,
        what: &str,
        shared: &mut Shared<'e, '_>,
    ) -> Option<Sensor> {
        if e.attr("camera").is_some() {
            let note = "`camera`: a range for each pixel is not supported; add `sensors.lidar` or `sensors.camera`";
            return leave_out(cx, e, what, note);
        }
        let frame = self.at_site(cx, e, what, shared)?;
        let site = self.sites.get(e.attr("site")?)?;
        let body = (site.body != "world").then(|| site.body.clone());
        Some(Sensor::Range { body, frame })
    }

    /// Reads the motion of a frame, which may be relative to another frame.
    fn frame_sensor(
        &self,
        cx: &mut Cx<'_>,
        e: &'e Element,
        what: &str,
        shared: &mut Shared<'e, '_>,
    ) -> Option<Sensor> {
        let turned =
            matches!(e.name.as_str(), "framequat" | "framexaxis" | "frameyaxis" | "framezaxis");
        let frame = self.object(cx, e, ("objtype", "objname"), turned, what, shared)?;
        let relative = e.attr("refname").is_some_and(|n| !n.is_empty());
        if !relative || (e.attr("reftype"), e.attr("refname")) == (Some("xbody"), Some("world")) {
            return Some(Sensor::Motion(frame));
        }
        // All readings have the axes of the reference.
        let reference = self.object(cx, e, ("reftype", "refname"), true, what, shared)?;
        Some(Sensor::Relative { frame, reference })
    }

    /// Returns the frame of an object of the file: a site, the frame of a body, its centre of mass, or a geom. `turned`: the reading depends on the
    /// axes of the frame. `None` after a fault or a note.
    fn object(
        &self,
        cx: &mut Cx<'_>,
        e: &'e Element,
        (type_key, name_key): (&str, &str),
        turned: bool,
        what: &str,
        shared: &mut Shared<'e, '_>,
    ) -> Option<DeviceFrame> {
        e.touch();
        let kind = cx.required(e, type_key, what)?;
        let name = cx.required(e, name_key, what)?;
        let place = e.place_of(name_key);
        match kind {
            "site" => self.device_frame(cx, (place, name), what, shared.lengths, shared.d),
            "xbody" | "body" => {
                if name == "world" {
                    let frame = shared.place("world", Pose::identity(), "world_frame".into());
                    return Some(frame);
                }
                if !self.elements.contains_key(name) {
                    let names = self.elements.keys().map(String::as_str);
                    cx.unknown(place, what, "body", name, names);
                    return None;
                }
                if kind == "xbody" {
                    return Some(DeviceFrame::Body(name.into()));
                }
                if turned {
                    let note = format!(
                        "`{type_key}=\"body\"`: the principal axes of a body are not supported; write `{type_key}=\"xbody\"` for the frame of the body"
                    );
                    return leave_out(cx, e, what, note);
                }
                let spec = shared.d.builder.bodies().iter().find(|b| b.name == name)?;
                let centre = Pose::translation(spec.mass.com.x, spec.mass.com.y, spec.mass.com.z);
                Some(shared.place(name, centre, format!("{name}_com")))
            }
            "geom" => match shared.geoms.get(name).cloned() {
                Some((body, pose)) => Some(shared.place(&body, pose, format!("{name}_geom"))),
                None if self.geoms.contains_key(name) => {
                    let note = format!(
                        "`{type_key}=\"geom\"`: the frame of a mesh or height field is not supported; write a <site> at its place"
                    );
                    leave_out(cx, e, what, note)
                }
                None => {
                    cx.unknown(place, what, "geom", name, self.geoms.keys().copied());
                    None
                }
            },
            "camera" => {
                let note = format!(
                    "`{type_key}=\"camera\"`: the frame of a camera is not supported; write a <site> at its place"
                );
                leave_out(cx, e, what, note)
            }
            other => {
                let help = linkwork_names::suggest(
                    other,
                    "type",
                    ["site", "xbody", "body", "geom", "camera"],
                );
                let what = format!("{what}: `{type_key}`");
                cx.bad(e.place_of(type_key), &what, other, "a type of object", &help);
                None
            }
        }
    }

    /// Reads `gravcomp` of all bodies, in the order of the bodies.
    pub(super) fn gravity_compensation(&self, cx: &mut Cx<'_>, d: &mut Description) {
        let names: Vec<String> = d.builder.bodies().iter().map(|b| b.name.clone()).collect();
        for body in names {
            let Some(e) = self.elements.get(&body) else { continue };
            let share = cx.number(e, "gravcomp", &format!("body `{body}`"));
            if let Some(share) = share.filter(|s| *s != 0.0) {
                let name = format!("{body}_gravcomp");
                let kind = DeviceKind::GravityCompensation { body, share };
                d.devices.push(Device { name, kind });
            }
        }
    }
}

/// Lists a sensor that is not converted, with the reason and the remedy.
fn leave_out<T>(cx: &mut Cx<'_>, e: &Element, what: &str, note: impl Into<String>) -> Option<T> {
    e.touch_all();
    cx.ignored.push(e.ignored(what, note));
    None
}

/// Reads a sensor that is an output of a tendon or actuator.
fn device_sensor(
    cx: &mut Cx<'_>,
    e: &Element,
    (key, output): (&str, &str),
    what: &str,
    shared: &Shared<'_, '_>,
) -> Option<Sensor> {
    e.touch();
    let device = cx.required(e, key, what)?;
    let known = if key == "tendon" { &shared.tendons } else { &shared.actuators };
    if !known.contains(device) {
        let note = format!(
            "a sensor of the {key} `{device}`, which is not supported; the warning about it has a remedy"
        );
        return leave_out(cx, e, what, note);
    }
    Some(Sensor::Of { device: device.into(), output: output.into() })
}
