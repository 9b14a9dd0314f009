//! Sensors of an MJCF file, and bodies with gravity compensation.
//!
//! ```text
//! jointpos, jointvel                                         a joint
//! gyro, velocimeter, framepos, framequat, frame?axis,
//! framelinvel, frameangvel                                   the motion of a frame
//! accelerometer, framelinacc, frameangacc                    specific force and angular acceleration at a frame
//! force, torque                                              load of the hinge of the body of a site
//! tendonpos, tendonvel, actuatorpos, actuatorvel, actuatorfrc    outputs of other devices
//! ```
//! Readings are exact, as in MuJoCo, where `noise` is only information.

use super::Mj;
use super::tendon::Lengths;
use crate::read::Cx;
use crate::xml::Element;
use crate::{Description, Device, DeviceFrame, DeviceKind, Sensor};
use std::collections::BTreeSet;

/// Sensors of joints and frames.
const OWN: [&str; 16] = [
    "force",
    "torque",
    "jointpos",
    "jointvel",
    "gyro",
    "velocimeter",
    "accelerometer",
    "framepos",
    "framequat",
    "framelinvel",
    "frameangvel",
    "framexaxis",
    "frameyaxis",
    "framezaxis",
    "framelinacc",
    "frameangacc",
];

/// Sensors that are not converted, with a remedy.
const ALTERNATIVES: [(&str, &str); 9] = [
    ("touch", "bind `sensors.contact_switch` to the body, or log its `contact_force`"),
    ("rangefinder", "add `sensors.radar` with the beam [0, 0, 1], or `sensors.lidar`"),
    ("magnetometer", "add `sensors.magnetometer`"),
    (
        "subtreecom",
        "add `sensors.mass_properties`, which has the centre of mass of a whole vehicle",
    ),
    ("contact", "log `contact_force` of the body"),
    ("jointactuatorfrc", "log `force` of the actuators of the joint"),
    ("e_potential", "the balance of energy of a run reports it"),
    ("e_kinetic", "the balance of energy of a run reports it"),
    ("clock", "conditions and plots have `time`"),
];

/// Element, the attribute with the name of another device, and the output of that device.
const OTHERS: [(&str, &str, &str); 5] = [
    ("tendonpos", "tendon", "length"),
    ("tendonvel", "tendon", "velocity"),
    ("actuatorpos", "actuator", "length"),
    ("actuatorvel", "actuator", "velocity"),
    ("actuatorfrc", "actuator", "force"),
];

impl<'e> Mj<'e> {
    /// All sensors.
    pub(super) fn sensors(
        &self,
        cx: &mut Cx<'_>,
        root: &'e Element,
        lengths: &Lengths<'e>,
        d: &mut Description,
    ) {
        let named = |tendon: bool| -> BTreeSet<String> {
            let own = |k: &DeviceKind| match k {
                DeviceKind::Tendon(_) => tendon,
                DeviceKind::Actuator(_) => !tendon,
                _ => false,
            };
            d.devices.iter().filter(|x| own(&x.kind)).map(|x| x.name.clone()).collect()
        };
        let (tendons, actuators) = (named(true), named(false));
        for (k, e) in root.all("sensor").flat_map(|list| &list.children).enumerate() {
            let kind = e.name.as_str();
            if !OWN.contains(&kind) && OTHERS.iter().all(|(other, ..)| *other != kind) {
                // Sensors without an alternative are listed with the unused elements.
                if let Some((_, remedy)) = ALTERNATIVES.iter().find(|(k, _)| *k == kind) {
                    e.touch_all();
                    let note = format!("element <{kind}>: {remedy}");
                    cx.ignored.push(e.ignored(format!("mujoco/sensor/{}", e.label()), note));
                }
                continue;
            }
            let name = e.attr("name").map_or(format!("{}{}", e.name, k + 1), str::to_owned);
            let what = format!("sensor `{name}`");
            let sensor = match kind {
                "jointpos" | "jointvel" => self.joint_sensor(cx, e, &what, lengths),
                "gyro" | "velocimeter" => self.at_site(cx, e, &what).map(Sensor::Motion),
                "force" | "torque" => self.load_at_site(cx, e, &what, d),
                "accelerometer" => self.at_site(cx, e, &what).map(Sensor::SpecificForce),
                "framelinacc" | "frameangacc" => {
                    self.frame_sensor(cx, e, &what).map(Sensor::SpecificForce)
                }
                _ if kind.starts_with("frame") => {
                    self.frame_sensor(cx, e, &what).map(Sensor::Motion)
                }
                _ => {
                    let Some((_, key, output)) = OTHERS.iter().find(|(k, ..)| *k == kind) else {
                        continue;
                    };
                    e.touch();
                    let Some(device) = cx.required(e, key, &what) else { continue };
                    let known = if *key == "tendon" { &tendons } else { &actuators };
                    if !known.contains(device) {
                        e.touch_all();
                        let note =
                            format!("a sensor of the {key} `{device}`, which is not supported");
                        cx.ignored.push(e.ignored(&what, note));
                        continue;
                    }
                    Some(Sensor::Of { device: device.into(), output: (*output).into() })
                }
            };
            if let Some(sensor) = sensor {
                d.devices.push(Device { name, kind: DeviceKind::Sensor(sensor) });
            }
        }
    }

    fn joint_sensor(
        &self,
        cx: &mut Cx<'_>,
        e: &'e Element,
        what: &str,
        lengths: &Lengths<'e>,
    ) -> Option<Sensor> {
        e.touch();
        let joint = cx.required(e, "joint", what)?;
        let sum = self.joint_sum(cx, joint, e.place_of("joint"), what, lengths)?;
        Some(Sensor::Joint(sum.terms.into_iter().next()?.coordinate))
    }

    fn at_site(&self, cx: &mut Cx<'_>, e: &'e Element, what: &str) -> Option<DeviceFrame> {
        e.touch();
        let site = cx.required(e, "site", what)?;
        self.site_frame(cx, e, "site", site, what)
    }

    /// Returns the load of the hinge of a site's body: what its parent exerts on it.
    fn load_at_site(
        &self,
        cx: &mut Cx<'_>,
        e: &'e Element,
        what: &str,
        d: &Description,
    ) -> Option<Sensor> {
        e.touch();
        let name = cx.required(e, "site", what)?;
        self.site_frame(cx, e, "site", name, what)?;
        let site = self.sites.get(name)?;
        let spec = d.builder.bodies().iter().find(|b| b.name == site.body)?;
        let frame = spec.hinge_in_body.inverse() * site.pose;
        Some(Sensor::HingeLoad { body: site.body.clone(), frame })
    }

    /// Returns the frame of a site of a body; `None` after a fault or a note.
    fn site_frame(
        &self,
        cx: &mut Cx<'_>,
        e: &'e Element,
        key: &str,
        site: &str,
        what: &str,
    ) -> Option<DeviceFrame> {
        match self.sites.get(site) {
            Some(s) if s.body == "world" => {
                e.touch_all();
                cx.ignored
                    .push(e.ignored(what, "a sensor at a site of the world, which does not move"));
                None
            }
            Some(_) => Some(DeviceFrame::Node(site.into())),
            None => {
                cx.unknown(e.place_of(key), what, "site", site, self.sites.keys().copied());
                None
            }
        }
    }

    fn frame_sensor(&self, cx: &mut Cx<'_>, e: &'e Element, what: &str) -> Option<DeviceFrame> {
        let note = match (e.attr("objtype"), e.attr("refname")) {
            (Some("site" | "xbody"), None) => None,
            (_, Some(_)) => {
                Some("`refname`: a sensor of a frame relative to another frame is not supported")
            }
            _ => Some("a sensor of a frame that is neither a site nor an xbody is not supported"),
        };
        if let Some(note) = note {
            e.touch_all();
            cx.ignored.push(e.ignored(what, note));
            return None;
        }
        e.touch();
        let name = cx.required(e, "objname", what)?;
        if e.attr("objtype") == Some("site") {
            return self.site_frame(cx, e, "objname", name, what);
        }
        if !self.elements.contains_key(name) {
            let names = self.elements.keys().map(String::as_str);
            cx.unknown(e.place_of("objname"), what, "body", name, names);
            return None;
        }
        Some(DeviceFrame::Body(name.into()))
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
