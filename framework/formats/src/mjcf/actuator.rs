//! Actuators of an MJCF file: forces that are affine in control or activation, length and rate, on joints, on tendons and on sites.
//!
//! ```text
//! f = (g₀ + g₁ l + g₂ l̇) w + b₀ + b₁ l + b₂ l̇            l = gear · (q, or the length of the tendon, or a pose of a site)
//! motor         g = (1, 0, 0)      b = 0
//! position      g = (kp, 0, 0)     b = (0, −kp, −kv)     w = u, or ẇ = (u − w) / timeconst
//! velocity      g = (kv, 0, 0)     b = (0, 0, −kv)
//! intvelocity   g = (kp, 0, 0)     b = (0, −kp, −kv)     ẇ = u
//! damper        g = (0, 0, −kv)    b = 0
//! cylinder      g = (area, 0, 0)   b = bias              ẇ = (u − w) / timeconst
//! ```
//! w = u where nothing else is written. The wrench of an actuator on a site has the axes of `refsite`, on which the opposite wrench acts.
//! All kinds share one set of default values, which each element of a class, and then the actuator, overwrites; the force law of one kind is not a
//! default for another, except that of `general`. A positive b₂ of a position servo is a damping ratio ζ: b₂ = −2 ζ √(kp m), with m = 1 / (J M⁻¹ Jᵀ),
//! J = dl/dν, at the reference configuration.

use super::defaults::{ACTUATORS, MAIN};
use super::tendon::Lengths;
use super::{Mj, word};
use crate::error::FaultKind;
use crate::read::Cx;
use crate::xml::Element;
use crate::{Activation, Actuator, Description, Device, DeviceKind, Length, Term};
use std::collections::BTreeMap;

/// Values of an actuator.
#[derive(Clone)]
struct Values<'e> {
    /// The kind that set the force law last.
    kind: &'e str,
    gain_affine: bool,
    gain: [f64; 3],
    bias_affine: bool,
    bias: [f64; 3],
    gear: [f64; 6],
    dynamics: Dynamics,
    /// The time constant of a filter, s.
    time: f64,
    control: ([f64; 2], Option<bool>),
    force: ([f64; 2], Option<bool>),
    activation: ([f64; 2], Option<bool>),
    /// Ratio of the control range to the range of the joint; 0: the control has its own range.
    inherit: f64,
    /// The reason why it is not supported.
    beyond: Option<&'e str>,
}

/// Activation dynamics: how the activation follows the control.
#[derive(Clone, Copy, PartialEq)]
enum Dynamics {
    None,
    Integrator,
    /// `filter`.
    Filter,
    /// `filterexact`, which is the same equation.
    FilterExact,
}

impl Default for Values<'_> {
    fn default() -> Self {
        Self {
            kind: "general",
            gain_affine: false,
            gain: [1.0, 0.0, 0.0],
            bias_affine: false,
            bias: [0.0; 3],
            gear: [1.0, 0.0, 0.0, 0.0, 0.0, 0.0],
            dynamics: Dynamics::None,
            time: 1.0,
            control: ([0.0; 2], None),
            force: ([0.0; 2], None),
            activation: ([0.0; 2], None),
            inherit: 0.0,
            beyond: None,
        }
    }
}

/// Actuators that are not converted, with the reason or a remedy.
const ALTERNATIVES: [(&str, &str); 6] = [
    ("muscle", "write a <general> with a gain and a bias for the force"),
    (
        "adhesion",
        "no model pulls a body towards the surface that it touches; connect the bodies by a phase that adds a hinge",
    ),
    ("dcmotor", "add `actuators.dc_motor`"),
    ("pid", "write a <position> or an <intvelocity>, or add a controller to the simulation"),
    ("orientation", "add `actuators.ball_drive`"),
    ("plugin", "add a part of the simulation that computes its force"),
];

/// Attributes for the target of an actuator, with the reason if it is not supported.
const TRANSMISSIONS: [(&str, Option<&str>); 6] = [
    ("joint", None),
    ("jointinparent", None),
    ("tendon", None),
    ("site", None),
    ("cranksite", Some("`cranksite`: an actuator with a crank; model the crank as a loop")),
    ("body", Some("`body`: an actuator on a body; use an actuator on a site of it")),
];

impl<'e> Mj<'e> {
    /// All actuators.
    pub(super) fn actuators(
        &self,
        cx: &mut Cx<'_>,
        root: &'e Element,
        lengths: &mut Lengths<'e>,
        d: &mut Description,
    ) {
        let mut count = 0;
        for e in root.all("actuator").flat_map(|list| &list.children) {
            count += 1;
            if !ACTUATORS.contains(&e.name.as_str()) {
                // Elements that are not part of the format are listed with the unused elements.
                if let Some((_, why)) = ALTERNATIVES.iter().find(|(k, _)| *k == e.name) {
                    e.touch_all();
                    let note = format!("element <{}>: it exerts no force; {why}", e.name);
                    cx.ignored.push(e.ignored(format!("mujoco/actuator/{}", e.label()), note));
                }
                continue;
            }
            let name = e.attr("name").map_or(format!("{}{count}", e.name), str::to_owned);
            let what = format!("actuator `{name}`");
            e.touch();
            let class = self.class_of(cx, e, "class", MAIN);
            let (mut values, mut levels) = (Values::default(), Vec::new());
            for level in self.classes.actuators(class) {
                level.iter().for_each(|one| values.write(cx, one, &what, &levels));
                levels.push(values.clone());
            }
            values.write(cx, e, &what, &levels);
            match self.acts_on(cx, e, &what, lengths, &values, d) {
                Ok(Some(length)) => {
                    let actuator = self.actuator(cx, (e, &what), &values, length, lengths, d);
                    d.devices.push(Device { name, kind: DeviceKind::Actuator(actuator) });
                }
                Ok(None) => {} // a fault was added
                Err(why) => {
                    e.touch_all();
                    cx.ignored
                        .push(e.ignored(&what, format!("an actuator is not supported: {why}")));
                }
            }
        }
        self.limit_forces(cx, root, d);
    }

    /// Returns the length along which an actuator acts, before its gear; `None` after a fault.
    fn acts_on(
        &self,
        cx: &mut Cx<'_>,
        e: &'e Element,
        what: &str,
        lengths: &mut Lengths<'e>,
        values: &Values<'e>,
        d: &mut Description,
    ) -> Result<Option<Length>, String> {
        let on = TRANSMISSIONS.iter().filter_map(|(k, not)| Some((*k, e.attr(k)?, *not)));
        let Some((key, target, not)) = on.last() else {
            cx.missing(e, what, "`joint` or `tendon`", "write the name of the joint or tendon");
            return Ok(None);
        };
        if let Some(why) = not.or(values.beyond) {
            return Err(why.into());
        }
        if key == "site" {
            return self.on_site(cx, e, (target, what), lengths, values, d);
        }
        if key != "tendon" {
            return match self.joints.get(target) {
                Some(j) if !j.scalar => {
                    Err("it acts on a ball or free joint; use an actuator on a site of its body"
                        .into())
                }
                _ => {
                    let sum = self.joint_sum(cx, target, e.place_of(key), what, lengths);
                    Ok(sum.map(|s| Length::Joints(s.terms)))
                }
            };
        }
        match lengths.tendon(target) {
            Some(length) => Ok(Some(length)),
            None if lengths.unread.contains(target) => Err(format!(
                "its tendon `{target}` is not supported, so it exerts no force; the warning about the tendon has a remedy"
            )),
            None => {
                cx.unknown(e.place_of(key), what, "tendon", target, lengths.names());
                Ok(None)
            }
        }
    }

    /// Returns the wrench of an actuator on a site.
    fn on_site(
        &self,
        cx: &mut Cx<'_>,
        e: &'e Element,
        (site, what): (&'e str, &str),
        lengths: &mut Lengths<'e>,
        values: &Values<'e>,
        d: &mut Description,
    ) -> Result<Option<Length>, String> {
        let gear = values.gear;
        let body = self.sites.get(site).map(|s| s.body.as_str());
        let on = self.device_frame(cx, (e.place_of("site"), site), what, lengths, d);
        let Some(on) = on else { return Ok(None) };
        let Some(name) = e.attr("refsite") else {
            return Ok(Some(Length::Wrench { gear, site: on, reference: None }));
        };
        let reference = self.device_frame(cx, (e.place_of("refsite"), name), what, lengths, d);
        let Some(reference) = reference else { return Ok(None) };
        // MuJoCo moves only the joints beyond the last common body. The result is a pair of opposite wrenches only if
        // `refsite` is on that body.
        let base = self.sites.get(name).map_or("world", |s| s.body.as_str());
        let inboard = base == "world"
            || body
                .zip(self.elements.get(base))
                .is_some_and(|(b, e)| holds_body(e, self.elements.get(b).copied()));
        if !inboard {
            return Err(format!(
                "`refsite`: `{base}` does not carry the body of `{site}`; move the reference site to the world or to a body that carries it"
            ));
        }
        Ok(Some(Length::Wrench { gear, site: on, reference: Some(reference) }))
    }

    fn actuator(
        &self,
        cx: &mut Cx<'_>,
        (e, what): (&'e Element, &str),
        values: &Values<'e>,
        length: Length,
        lengths: &Lengths<'e>,
        d: &Description,
    ) -> Actuator {
        let servo = !values.gain_affine && values.bias_affine && values.bias[1] == -values.gain[0];
        let limits = (servo && values.inherit > 0.0).then(|| bounds(&length, d)).flatten();
        if values.inherit > 0.0 && limits.is_none() {
            let note = "attribute inheritrange: it requires a servo on one joint with limits";
            cx.ignored.push(e.ignored(what, note));
        }
        let length = match length {
            Length::Wrench { .. } => length,
            _ => length.geared(values.gear[0]),
        };
        let mut range = |key: &str, (pair, limited): ([f64; 2], Option<bool>)| {
            let holds = limited.unwrap_or(self.of(e).autolimits && pair[0] != pair[1]);
            if holds && !(pair[0] < pair[1]) {
                let text = format!("{} {}", pair[0], pair[1]);
                let help = "write the lower number first";
                cx.bad(e.place_of(key), &format!("{what}: `{key}`"), &text, "a range", help);
                return None;
            }
            holds.then_some(pair)
        };
        let mut control = range("ctrlrange", values.control);
        let force = range("forcerange", values.force);
        let inherited = limits.is_some() && values.dynamics == Dynamics::Integrator;
        let unused = inherited || values.dynamics == Dynamics::None;
        let own = if unused { ([0.0; 2], None) } else { values.activation };
        let mut active = range("actrange", own);
        if let Some([lower, upper]) = limits {
            let (middle, half) = (0.5 * (lower + upper), 0.5 * values.inherit * (upper - lower));
            let target = if inherited { &mut active } else { &mut control };
            *target = Some([middle - half, middle + half]);
        }
        let bounded =
            values.activation.0[0] != values.activation.0[1] && values.activation.1 != Some(false);
        if bounded && values.dynamics == Dynamics::None {
            let [lower, upper] = values.activation.0;
            let what = format!("{what} has actrange {lower} {upper}, but no activation");
            let help = "write dyntype, or remove actrange".to_owned();
            cx.fault(e.place(), FaultKind::Unsupported { what, help });
        }
        let time_constant = match values.dynamics {
            Dynamics::None => None,
            Dynamics::Integrator => Some(None),
            _ if values.time > 0.0 => Some(Some(values.time)),
            _ => {
                let (expected, help) =
                    ("a positive time constant", "write timeconst or dynprm in s");
                cx.bad(e.place(), what, &values.time.to_string(), expected, help);
                None
            }
        };
        let activation =
            time_constant.map(|time_constant| Activation { time_constant, range: active });
        let zero = [0.0; 3];
        let mut bias = if values.bias_affine { values.bias } else { zero };
        let gain = match values.gain_affine {
            true => values.gain,
            false => [values.gain[0], 0.0, 0.0],
        };
        // MuJoCo reads a damping ratio with either kind of gain.
        let rated = values.bias_affine && values.bias[1] == -values.gain[0];
        if rated && bias[2] > 0.0 {
            match lengths.inertia(&length, d) {
                Some(mass) if gain[0] >= 0.0 => bias[2] *= -2.0 * (gain[0] * mass).sqrt(),
                Some(_) => {
                    let note = "attribute dampratio: the stiffness is negative";
                    cx.ignored.push(e.ignored(what, note));
                    bias[2] = 0.0;
                }
                None => {
                    let note = "attribute dampratio: the mass matrix cannot be inverted, or no joint changes the length";
                    cx.ignored.push(e.ignored(what, note));
                    bias[2] = 0.0;
                }
            }
        }
        Actuator { length, gain, bias, activation, control, force }
    }

    /// `actuatorfrcrange` of a joint limits the sum of all actuators: for a single one that acts on nothing else, it is its force range.
    fn limit_forces(&self, cx: &mut Cx<'_>, root: &Element, d: &mut Description) {
        let mut efforts: BTreeMap<(String, usize), f64> = BTreeMap::new();
        for b in d.builder.bodies() {
            for (k, s) in
                b.hinge.subhinges.iter().enumerate().filter(|(_, s)| s.limits.effort.is_finite())
            {
                efforts.insert((b.name.clone(), k), s.limits.effort);
            }
        }
        let key = |t: &Term| (t.coordinate.body.clone(), t.coordinate.subhinge);
        let mut acting: BTreeMap<(String, usize), Vec<usize>> = BTreeMap::new();
        for (k, device) in d.devices.iter().enumerate() {
            if let DeviceKind::Actuator(Actuator { length: Length::Joints(terms), .. }) =
                &device.kind
            {
                terms.iter().for_each(|t| acting.entry(key(t)).or_default().push(k));
            }
        }
        for (place, effort) in efforts {
            let Some(on) = acting.get(&place) else { continue };
            if let [one] = on[..]
                && let DeviceKind::Actuator(a) = &mut d.devices[one].kind
                && let Length::Joints(terms) = &a.length
                && let [term] = &terms[..]
                && term.factor != 0.0
            {
                let most = effort / term.factor.abs();
                let [lower, upper] = a.force.unwrap_or([-most, most]);
                a.force = Some([lower.clamp(-most, most), upper.clamp(-most, most)]);
            } else {
                let note = format!(
                    "actuatorfrcrange of a joint of `{}` with several actuators: their sum is not limited",
                    place.0
                );
                cx.ignored.push(root.ignored("mujoco/actuator", note));
            }
        }
    }
}

impl<'e> Values<'e> {
    /// Writes the attributes of an element as its kind does; `levels` are the values of the classes around it, from the outermost.
    fn write(&mut self, cx: &mut Cx<'_>, e: &'e Element, what: &str, levels: &[Self]) {
        let number = |cx: &mut Cx<'_>, name: &str| cx.number(e, name, what);
        let kind = e.name.as_str();
        if kind != "general" {
            // The force law of one kind is not a default for another kind, so use the law of an
            // outer class.
            let fits = |l: &Self| match l.kind {
                "general" => kind == "damper" || !l.gain_affine,
                other => other == kind,
            };
            if !fits(self) {
                let outer = levels.iter().rev().find(|l| fits(l)).cloned().unwrap_or_default();
                (self.gain_affine, self.gain) = (outer.gain_affine, outer.gain);
                (self.bias_affine, self.bias) = (outer.bias_affine, outer.bias);
                self.beyond = outer.beyond;
                (self.dynamics, self.time) = (outer.dynamics, outer.time);
            }
        }
        self.kind = kind;
        match kind {
            "motor" => {
                (self.gain_affine, self.gain) = (false, [1.0, 0.0, 0.0]);
                (self.bias_affine, self.bias) = (false, [0.0; 3]);
                (self.dynamics, self.time, self.beyond) = (Dynamics::None, 1.0, None);
            }
            "position" | "intvelocity" => {
                // A position servo takes only the activation of `filterexact` from its class, as in MuJoCo.
                if self.dynamics != Dynamics::FilterExact {
                    (self.dynamics, self.time) = (Dynamics::None, 1.0);
                }
                let kp = number(cx, "kp").unwrap_or(self.gain[0]);
                (self.gain_affine, self.gain[0]) = (false, kp);
                (self.bias_affine, self.bias) = (true, [0.0, -kp, self.bias[2]]);
                self.bias[2] = number(cx, "kv").map_or(self.bias[2], |kv| -kv);
                self.bias[2] = number(cx, "dampratio").unwrap_or(self.bias[2]);
                if kind == "intvelocity" {
                    (self.dynamics, self.activation.1) = (Dynamics::Integrator, Some(true));
                } else if let Some(time) = number(cx, "timeconst") {
                    let filters = time != 0.0;
                    self.dynamics = if filters { Dynamics::FilterExact } else { Dynamics::None };
                    self.time = if filters { time } else { self.time };
                }
            }
            "velocity" => {
                let kv = number(cx, "kv").unwrap_or(self.gain[0]);
                (self.gain_affine, self.gain) = (false, [kv, 0.0, 0.0]);
                (self.bias_affine, self.bias) = (true, [0.0, 0.0, -kv]);
                (self.dynamics, self.time, self.beyond) = (Dynamics::None, 1.0, None);
            }
            "damper" => {
                let own = if self.gain_affine { -self.gain[2] } else { 0.0 };
                let kv = number(cx, "kv").unwrap_or(own);
                (self.gain_affine, self.gain) = (true, [0.0, 0.0, -kv]);
                (self.bias_affine, self.bias) = (false, [0.0; 3]);
                (self.dynamics, self.time, self.beyond) = (Dynamics::None, 1.0, None);
            }
            "cylinder" => {
                let area = number(cx, "area");
                let diameter = number(cx, "diameter");
                let round = diameter.map(|d| 0.25 * std::f64::consts::PI * d * d);
                let area = round.or(area).unwrap_or(self.gain[0]);
                (self.gain_affine, self.gain) = (false, [area, 0.0, 0.0]);
                let bias = cx.numbers::<3>(e, "bias", what).unwrap_or(self.bias);
                (self.bias_affine, self.bias) = (true, bias);
                self.time = number(cx, "timeconst").unwrap_or(self.time);
                (self.dynamics, self.beyond) = (Dynamics::Filter, None);
            }
            _ => self.general(cx, e, what),
        }
        self.inherit = number(cx, "inheritrange").unwrap_or(self.inherit);
        let list = |cx: &mut Cx<'_>, name: &str, most| {
            cx.parse_list(e.place_of(name), e.attr(name)?, &format!("{what}: `{name}`"), 1..=most)
        };
        for (own, x) in self.gear.iter_mut().zip(list(cx, "gear", 6).unwrap_or_default()) {
            *own = x;
        }
        let auto = [("true", Some(true)), ("false", Some(false)), ("auto", None)];
        for (pair, key, limited) in [
            (&mut self.control, "ctrlrange", "ctrllimited"),
            (&mut self.force, "forcerange", "forcelimited"),
            (&mut self.activation, "actrange", "actlimited"),
        ] {
            pair.0 = cx.numbers::<2>(e, key, what).unwrap_or(pair.0);
            if let Some(text) = e.attr(limited) {
                let flag =
                    word(cx, e.place_of(limited), text, &format!("{what}: `{limited}`"), &auto);
                pair.1 = flag.unwrap_or(pair.1);
            }
        }
    }

    /// Reads the attributes of `<general>`.
    fn general(&mut self, cx: &mut Cx<'_>, e: &'e Element, what: &str) {
        let beyond = |kind: &str| !matches!(kind, "fixed" | "none" | "affine");
        if let Some(kind) = e.attr("gaintype") {
            self.gain_affine = kind == "affine";
            self.beyond = if beyond(kind) {
                Some(
                    "its `gaintype` is not fixed or affine; add a part of the simulation with its force",
                )
            } else {
                self.beyond
            };
        }
        if let Some(kind) = e.attr("biastype") {
            self.bias_affine = kind == "affine";
            self.beyond = if beyond(kind) {
                Some(
                    "its `biastype` is not none or affine; add a part of the simulation with its force",
                )
            } else {
                self.beyond
            };
        }
        if let Some(kind) = e.attr("dyntype") {
            let known = [
                ("none", Dynamics::None),
                ("integrator", Dynamics::Integrator),
                ("filter", Dynamics::Filter),
                ("filterexact", Dynamics::FilterExact),
            ];
            match known.iter().find(|(name, _)| *name == kind) {
                Some((_, dynamics)) => self.dynamics = *dynamics,
                None => {
                    self.beyond = Some(
                        "its `dyntype` is not none, integrator, filter or filterexact; add a part of the simulation with its activation",
                    )
                }
            }
        }
        if let Some(text) = e.attr("dynprm") {
            let list =
                cx.parse_list(e.place_of("dynprm"), text, &format!("{what}: `dynprm`"), 1..=10);
            self.time = list.and_then(|l| l.first().copied()).unwrap_or(self.time);
        }
        for (own, key) in [(&mut self.gain, "gainprm"), (&mut self.bias, "biasprm")] {
            let Some(text) = e.attr(key) else { continue };
            let list = cx.parse_list(e.place_of(key), text, &format!("{what}: `{key}`"), 1..=10);
            own.iter_mut().zip(list.unwrap_or_default()).for_each(|(own, x)| *own = x);
        }
    }
}

/// Returns whether a body contains another, or is the same.
fn holds_body(e: &Element, other: Option<&Element>) -> bool {
    other.is_some_and(|o| std::ptr::eq(e, o)) || e.children.iter().any(|c| holds_body(c, other))
}

/// Returns the limits of the joint of a length, if it has any.
fn bounds(length: &Length, d: &Description) -> Option<[f64; 2]> {
    // The length of a tendon is not a coordinate, so the limits of its joints do not limit it.
    let Length::Joints(terms) = length else { return None };
    let [Term { coordinate: at, factor: 1.0 }] = &terms[..] else { return None };
    let body = d.builder.bodies().iter().find(|b| b.name == at.body)?;
    let limits = body.hinge.subhinges.get(at.subhinge)?.limits;
    (limits.lower.is_finite() && limits.upper.is_finite()).then_some([limits.lower, limits.upper])
}
