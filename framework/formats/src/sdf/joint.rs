//! Joints of an SDF model.
//!
//! ```text
//! axis in J: R_MJ⁻¹ R_M,expressed_in · xyz
//! screw       advance = screw_thread_pitch / 2π  m/rad = −1 / thread_pitch
//! mimic       q = multiplier (q_leader − reference) + offset
//! gearbox     θ₂ = −ratio θ₁, both measured from the reference body
//! ```

use super::link::number;
use super::{JointAt, Sdf};
use crate::error::FaultKind;
use crate::read::Cx;
use crate::xml::Element;
use crate::{Coupling, Description, HingeCoordinate, Joint, LoopClosure, Term};
use linkwork_multibody::{BodySpec, Friction, Hinge, Limits, Spring, Subhinge, SubhingeKind};
use linkwork_names::suggest;
use linkwork_spatial::Vec3;
use std::collections::BTreeMap;
use std::f64::consts::PI;

const TYPES: [&str; 9] = [
    "fixed",
    "revolute",
    "continuous",
    "prismatic",
    "ball",
    "universal",
    "revolute2",
    "screw",
    "gearbox",
];

impl<'e> Sdf<'e> {
    /// Reads a joint, which becomes the hinge of its child, or closes a loop if the child already has one.
    pub fn read_joint(
        &self,
        cx: &mut Cx<'_>,
        j: &JointAt<'e>,
        movers: &mut BTreeMap<String, BodySpec>,
        d: &mut Description,
    ) {
        let what = format!("joint `{}`", j.name);
        let kind = cx.required(j.e, "type", &what).unwrap_or("fixed");
        if kind == "gearbox" {
            return; // this type is a coupling
        }
        let Some((parent, child)) = self.ends(cx, j, &what) else { return };
        if child == "world" || child == parent {
            let fact =
                format!("{what} connects `{parent}` and `{child}`, which cannot be its child");
            let help = "the child must be a link other than the parent; swap them, or remove \
                        the joint";
            let kind = FaultKind::Unsupported { what: fact, help: help.into() };
            cx.fault(j.e.place(), kind);
            return;
        }
        let (hinge, data) = self.hinge(cx, j, kind, &what);
        let frame = |body: &str| self.frames.on_body(&j.key, self.frames.key_of_body(body));
        let (X_PJ, X_BJ) = (frame(&parent), frame(&child));
        if movers.contains_key(&child) {
            let mut hinge = hinge;
            for s in &mut hinge.subhinges {
                if s.damping != 0.0 || s.friction != Friction::NONE || s.spring != Spring::NONE {
                    let note =
                        "damping, friction and springs do not act on a joint that closes a loop";
                    cx.ignored.push(j.e.ignored(what.as_str(), note));
                }
                (s.damping, s.friction, s.spring) = (0.0, Friction::NONE, Spring::NONE);
            }
            let name = j.name.clone();
            let (body_a, frame_a, body_b, frame_b) = (parent, X_PJ, child, X_BJ);
            d.loops.push(LoopClosure { name, body_a, frame_a, body_b, frame_b, hinge });
            return;
        }
        d.joints.push(Joint { body: child.clone(), count: hinge.subhinges.len(), ..data });
        let spec = BodySpec::new(&child, parent);
        movers.insert(child, spec.hinge_in_parent(X_PJ).hinge_in_body(X_BJ).hinge(hinge));
    }

    /// Returns the names of the bodies of a joint.
    fn ends(&self, cx: &mut Cx<'_>, j: &JointAt<'e>, what: &str) -> Option<(String, String)> {
        let mut end = |tag: &str| {
            let (at, text) = j.e.child_text(tag)?;
            let what = format!("{what}: <{tag}>");
            let key = self.frames.look_up(cx, &j.scope, text, at.place(), &what)?;
            Some(self.frames.carrier(&key).to_owned())
        };
        let (parent, child) = (end("parent"), end("child"));
        Some((parent?, child?))
    }

    fn hinge(&self, cx: &mut Cx<'_>, j: &JointAt<'e>, kind: &str, what: &str) -> (Hinge, Joint) {
        let mut data = Joint::new(&j.name, "", 1);
        let mut one = |cx: &mut Cx<'_>, tag: &str, make: &dyn Fn(Vec3) -> SubhingeKind| {
            let (axis, limits, own) = self.axis(cx, j, tag, what);
            if tag == "axis" {
                (data.damping, data.friction) = (own.damping, own.friction);
                (data.stiffness, data.spring_reference) = (own.stiffness, own.spring_reference);
            }
            let friction = Friction { force: own.friction, rate: 0.0 };
            let spring = match own.stiffness {
                0.0 => Spring::NONE,
                stiffness => Spring { stiffness, rest: own.spring_reference },
            };
            Subhinge { limits, damping: own.damping, friction, spring, ..make(axis).into() }
        };
        let pin = |axis| SubhingeKind::Pin { axis };
        let subhinges = match kind {
            "fixed" => vec![],
            "ball" => vec![SubhingeKind::Ball.into()],
            "revolute" => vec![one(cx, "axis", &pin)],
            "continuous" => {
                let s = one(cx, "axis", &pin);
                let limits =
                    Limits { rate: s.limits.rate, effort: s.limits.effort, ..Limits::NONE };
                vec![Subhinge { limits, ..s }]
            }
            "prismatic" => vec![one(cx, "axis", &|axis| SubhingeKind::Slider { axis })],
            "universal" | "revolute2" => vec![one(cx, "axis", &pin), one(cx, "axis2", &pin)],
            "screw" => {
                let pitch = self.pitch(cx, j, what);
                vec![one(cx, "axis", &|axis| SubhingeKind::Screw { axis, pitch })]
            }
            other => {
                let help = suggest(other, "type", TYPES);
                let (joint, kind) = (j.name.clone(), other.to_owned());
                cx.fault(j.e.place_of("type"), FaultKind::UnknownJointType { joint, kind, help });
                vec![]
            }
        };
        (Hinge { subhinges }, data)
    }

    fn pitch(&self, cx: &mut Cx<'_>, j: &JointAt<'e>, what: &str) -> f64 {
        if let Some(pitch) = number(cx, j.e, "screw_thread_pitch", what) {
            return pitch / (2.0 * PI);
        }
        match number(cx, j.e, "thread_pitch", what) {
            Some(t) if t.abs() > 1e-100 => -1.0 / t,
            Some(t) => {
                let help = "write <screw_thread_pitch> in m per revolution";
                let expected = "a pitch that is not zero";
                cx.bad(j.e.place(), what, &t.to_string(), expected, help);
                0.0
            }
            None => {
                let help = "write <screw_thread_pitch>..</screw_thread_pitch> in m per revolution";
                cx.missing(j.e, what, "<screw_thread_pitch>", help);
                0.0
            }
        }
    }

    /// Reads the axis in the joint's frame, limits, damping, friction and spring.
    fn axis(
        &self,
        cx: &mut Cx<'_>,
        j: &JointAt<'e>,
        tag: &str,
        what: &str,
    ) -> (Vec3, Limits, Joint) {
        let mut data = Joint::new("", "", 1);
        let what = format!("{what}: <{tag}>");
        let Some(e) = j.e.child(tag) else {
            cx.missing(j.e, &what, "an axis", format!("write <{tag}><xyz>0 0 1</xyz></{tag}>"));
            return (Vec3::z(), Limits::NONE, data);
        };
        let mut axis = Vec3::z();
        let mut expressed = None;
        if let Some((xyz, text)) = e.child_text("xyz") {
            let n = cx.parse::<3>(xyz.place(), text, &what).map(Vec3::from);
            axis = n.and_then(|n| cx.unit(xyz.place(), n, text, &what)).unwrap_or(axis);
            expressed = xyz.attr("expressed_in").filter(|t| !t.is_empty()).map(|t| (xyz, t));
        }
        let in_model = match e.child_text("use_parent_model_frame") {
            Some((_, text)) => matches!(text, "true" | "1"),
            None => false,
        };
        let key = match expressed {
            Some((xyz, text)) => {
                let what = format!("{what}: `expressed_in`");
                let place = xyz.place_of("expressed_in");
                self.frames.look_up(cx, &j.scope, text, place, &what)
            }
            None if in_model => self.frames.look_up(cx, &j.scope, "__model__", e.place(), &what),
            None => None,
        };
        if let Some(key) = key {
            axis = self.frames.pose(&j.key).rotation.inverse()
                * (self.frames.pose(&key).rotation * axis);
        }
        let limits = e.child("limit").map_or(Limits::NONE, |l| limits(cx, l, &what));
        if let Some(dynamics) = e.child("dynamics") {
            let mut of = |name: &str| number(cx, dynamics, name, &what).unwrap_or(0.0);
            let (damping, friction) = (of("damping"), of("friction"));
            let (stiffness, reference) = (of("spring_stiffness"), of("spring_reference"));
            let mut sound = |name: &str, x: f64| {
                let place = dynamics.child(name).map_or(dynamics.place(), |e| e.place());
                cx.not_negative(place, x, &format!("{what}: <{name}>")).unwrap_or(0.0)
            };
            (data.damping, data.friction) =
                (sound("damping", damping), sound("friction", friction));
            data.stiffness = sound("spring_stiffness", stiffness);
            data.spring_reference = reference;
        }
        (axis, limits, data)
    }

    /// Reads `<mimic>` of axes.
    pub fn mimics(&self, cx: &mut Cx<'_>, d: &mut Description) {
        for j in &self.joints {
            for (index, tag) in ["axis", "axis2"].into_iter().enumerate() {
                let Some(e) = j.e.child(tag).and_then(|a| a.child("mimic")) else { continue };
                let what = format!("joint `{}`: <mimic>", j.name);
                let Some(leader) = cx.required(e, "joint", &what) else { continue };
                let second = usize::from(e.attr("axis") == Some("axis2"));
                let leader = j.scope.body(leader);
                let own = coordinate(d, &j.name, index);
                let Some(other) = coordinate(d, &leader, second) else {
                    let names: Vec<String> = d.joints.iter().map(|j| j.name.clone()).collect();
                    let names = names.iter().map(String::as_str);
                    cx.unknown(e.place_of("joint"), &what, "joint", &leader, names);
                    continue;
                };
                let mut of = |name, default| number(cx, e, name, &what).unwrap_or(default);
                let (ratio, offset) = (of("multiplier", 1.0), of("offset", 0.0));
                let constant = offset - ratio * of("reference", 0.0);
                if let Some(own) = own.filter(|own| *own != other) {
                    d.couplings.push(Coupling::mimic(&j.name, own, other, ratio, constant));
                } else {
                    cx.bad(
                        e.place(),
                        &what,
                        &leader,
                        "another joint",
                        "write the name of the joint to follow",
                    );
                }
            }
        }
    }

    /// Reads `gearbox` joints: couplings of the two pins on the reference body.
    pub fn gearboxes(&self, cx: &mut Cx<'_>, d: &mut Description) {
        for j in self.joints.iter().filter(|j| j.e.attr("type") == Some("gearbox")) {
            let what = format!("joint `{}`", j.name);
            let Some((parent, child)) = self.ends(cx, j, &what) else { continue };
            let ratio = number(cx, j.e, "gearbox_ratio", &what).unwrap_or(1.0);
            let Some((at, text)) = j.e.child_text("gearbox_reference_body") else {
                let help = "write <gearbox_reference_body>link</gearbox_reference_body>";
                cx.missing(j.e, &what, "<gearbox_reference_body>", help);
                continue;
            };
            let Some(key) = self.frames.look_up(cx, &j.scope, text, at.place(), &what) else {
                continue;
            };
            let base = self.frames.carrier(&key).to_owned();
            let ends = [(&parent, "axis"), (&child, "axis2")];
            let turns = ends.map(|(body, tag)| {
                let (axis, ..) = self.axis(cx, j, tag, &what);
                self.turn(d, &base, body, self.frames.pose(&j.key).rotation * axis)
            });
            let [Some(mut one), Some(two)] = turns else {
                let note =
                    "a gearbox whose links do not rotate on its reference body about its axes";
                cx.ignored.push(j.e.ignored(&what, note));
                continue;
            };
            one.factor *= ratio;
            d.couplings.push(Coupling::linear(&j.name, vec![two, one], 0.0));
        }
    }

    /// Returns ± the coordinate by which `body` rotates relative to `base` about an axis of the world.
    fn turn(&self, d: &Description, base: &str, body: &str, axis: Vec3) -> Option<Term> {
        let joins = |child: &str, parent: &str| {
            let b = d.builder.bodies().iter().find(|b| b.name == child && b.parent == parent)?;
            match b.hinge.subhinges[..] {
                [Subhinge { kind: SubhingeKind::Pin { axis }, .. }] => {
                    let X_WB = self.frames.pose(self.frames.key_of_body(child));
                    Some((child.to_owned(), (X_WB * b.hinge_in_body).transform_vector(&axis)))
                }
                _ => None,
            }
        };
        let (found, sign) = match joins(body, base) {
            Some(found) => (found, 1.0),
            None => (joins(base, body)?, -1.0),
        };
        let along = found.1.dot(&axis);
        let coordinate = HingeCoordinate { body: found.0, subhinge: 0 };
        (along.abs() > 1.0 - 1e-6).then(|| Term { coordinate, factor: sign * along.signum() })
    }
}

fn coordinate(d: &Description, joint: &str, index: usize) -> Option<HingeCoordinate> {
    let j = d.joint(joint).filter(|j| index < j.count)?;
    let body = d.builder.bodies().iter().find(|b| b.name == j.body)?;
    let subhinge = j.subhinge + index;
    (body.hinge.subhinges.get(subhinge)?.kind.nv() == 1)
        .then(|| HingeCoordinate { body: j.body.clone(), subhinge })
}

/// Negative effort and velocity, and bounds of at least 1e16, mean no limit.
fn limits(cx: &mut Cx<'_>, e: &Element, what: &str) -> Limits {
    let what = format!("{what}: <limit>");
    let mut of = |name: &str, none: f64| {
        let Some((at, text)) = e.child_text(name) else { return none };
        if let "inf" | "+inf" | "-inf" = text {
            return if text.starts_with('-') { f64::NEG_INFINITY } else { f64::INFINITY };
        }
        let x = cx.parse::<1>(at.place(), text, &format!("{what}: <{name}>"));
        x.map_or(none, |[x]| if x.abs() >= 1e16 { x.signum() * f64::INFINITY } else { x })
    };
    let (lower, upper) = (of("lower", f64::NEG_INFINITY), of("upper", f64::INFINITY));
    let size = |x: f64| if x < 0.0 { f64::INFINITY } else { x };
    let (rate, effort) = (size(of("velocity", -1.0)), size(of("effort", -1.0)));
    let limits = Limits { lower, upper, rate, effort };
    if !limits.is_valid() || lower == f64::INFINITY || upper == f64::NEG_INFINITY {
        let text = format!("{lower} .. {upper}");
        cx.bad(e.place(), &what, &text, "a range", "<lower> must be below <upper>");
        return Limits::NONE;
    }
    limits
}
