//! Tendons of an MJCF file.
//!
//! ```text
//! fixed    L = Σ cᵢ qᵢ           spring at rest between the two `springlength`, or where all joint springs are at rest
//! spatial  L = Σ |pₖ₊₁ − pₖ|      straight from site to site
//! limits   k = m / (0.95 T)²,  d = 2 m / (0.95 T)         T = 0.02 s, m = 1 / (J M⁻¹ Jᵀ) at the reference configuration
//! ```
//! Limits have the stiffness of MuJoCo's default `solreflimit` for a single violated limit. Tendons around geoms and with pulleys are not supported.

use super::defaults::MAIN;
use super::spring::{Moving, moving};
use super::{Classed, Mj};
use crate::error::FilePlace;
use crate::read::Cx;
use crate::xml::Element;
use crate::{Description, Device, DeviceFrame, DeviceKind, Length, Tendon, Term};
use linkwork_multibody::{BodyId, BodySpec, HingeCoordinate, Multibody};
use linkwork_spatial::nalgebra::{Cholesky, DVector};
use linkwork_spatial::{Pose, Vec3};
use std::cell::OnceCell;
use std::collections::{BTreeMap, BTreeSet};

/// Σ cᵢ qᵢ with its value at the reference configuration.
#[derive(Clone)]
pub(super) struct Sum {
    pub terms: Vec<Term>,
    pub reference: f64,
}

/// Lengths for equalities, actuators and sensors.
pub(super) struct Lengths<'e> {
    /// The coordinate of each joint with exactly one.
    coordinates: BTreeMap<String, HingeCoordinate>,
    /// Fixed tendons.
    pub tendons: BTreeMap<&'e str, Sum>,
    /// Sites of spatial tendons.
    lines: BTreeMap<&'e str, Vec<DeviceFrame>>,
    /// Names of unsupported spatial tendons.
    pub unread: BTreeSet<&'e str>,
    /// Bodies that represent sites of the world.
    anchors: BTreeMap<&'e str, String>,
    /// The mechanism at the reference configuration, computed on demand.
    moving: OnceCell<Option<(Multibody, Moving)>>,
}

/// Default time constant (s) and largest impedance of MuJoCo's limits.
const LIMIT: [f64; 2] = [0.02, 0.95];
/// Length of a line (m) below which its direction is round-off.
const NO_LENGTH: f64 = 1e-12;

impl Lengths<'_> {
    /// Returns the coordinate of a joint.
    pub fn coordinate(&self, joint: &str) -> Option<&HingeCoordinate> {
        self.coordinates.get(joint)
    }

    /// Returns the length of a tendon.
    pub fn tendon(&self, name: &str) -> Option<Length> {
        let fixed = self.tendons.get(name).map(|sum| Length::Joints(sum.terms.clone()));
        let line = || Some(Length::Line { gear: 1.0, sites: self.lines.get(name)?.clone() });
        fixed.or_else(line)
    }

    /// Returns the names of all tendons.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.tendons.keys().chain(self.lines.keys()).copied()
    }

    fn moving(&self, d: &Description) -> Option<&(Multibody, Moving)> {
        let make = || {
            let mbs = d.builder.build().ok()?;
            let moving = moving(&mbs, &d.configuration(&mbs))?;
            Some((mbs, moving))
        };
        self.moving.get_or_init(make).as_ref()
    }

    /// Returns 1 / (J M⁻¹ Jᵀ), or `None` if the mass matrix cannot be inverted or no joint changes the length: J is then round-off.
    pub fn inertia(&self, length: &Length, d: &Description) -> Option<f64> {
        let (mbs, moving) = self.moving(d)?;
        let J = jacobian(length, mbs, moving).filter(|J| J.amax() > 1e-12)?;
        let moved = Cholesky::new(moving.M.clone())?.solve(&J);
        Some(1.0 / J.dot(&moved)).filter(|m| m.is_finite())
    }
}

/// Returns the body of a site and its pose in the world.
fn frame(f: &DeviceFrame, mbs: &Multibody, poses: &[Pose]) -> Option<(BodyId, Pose)> {
    match f {
        DeviceFrame::Body(b) => mbs.body(b).map(|b| (b, poses[b.index()])),
        DeviceFrame::Node(n) => {
            let node = mbs.get_node(mbs.node(n)?);
            Some((node.body(), poses[node.body().index()] * node.pose()))
        }
    }
}

/// Returns the body of a site and its position in the world.
fn place(f: &DeviceFrame, mbs: &Multibody, poses: &[Pose]) -> Option<(BodyId, Vec3)> {
    frame(f, mbs, poses).map(|(body, pose)| (body, pose.position))
}

/// Returns dl/dν at the configuration of `moving`.
fn jacobian(length: &Length, mbs: &Multibody, moving: &Moving) -> Option<DVector<f64>> {
    let mut J = DVector::zeros(moving.M.nrows());
    let column = |k: usize, first: usize| -> Vec3 {
        moving.columns.fixed_view::<3, 1>(first, k).into_owned()
    };
    match length {
        Length::Joints(terms) => {
            for t in terms {
                let body = mbs.body(&t.coordinate.body)?;
                let rate = mbs.get(body).subhinges().get(t.coordinate.subhinge)?.v.start;
                J[rate] += t.factor;
            }
        }
        Length::Line { gear, sites } => {
            let places: Option<Vec<_>> =
                sites.iter().map(|f| place(f, mbs, &moving.poses)).collect();
            for pair in places?.windows(2) {
                let step = pair[1].1 - pair[0].1;
                // The direction of a line without length is round-off.
                let length = step.norm();
                let direction = if length > NO_LENGTH { step / length } else { Vec3::zeros() };
                for (sign, (body, p)) in [(-gear, pair[0]), (*gear, pair[1])] {
                    for k in mbs.ancestors(body).flat_map(|a| mbs.get(a).v()) {
                        let (w, v) = (column(k, 0), column(k, 3));
                        J[k] += sign * direction.dot(&(v + w.cross(&p)));
                    }
                }
            }
        }
        Length::Wrench { gear: [fx, fy, fz, mx, my, mz], site, reference } => {
            let (body, pose) = frame(site, mbs, &moving.poses)?;
            let base = match reference {
                Some(f) => Some(frame(f, mbs, &moving.poses)?),
                None => None,
            };
            let axes = base.map_or(pose, |b| b.1).rotation;
            let (force, moment) =
                (axes * Vec3::new(*fx, *fy, *fz), axes * Vec3::new(*mx, *my, *mz));
            let ends = [Some((body, 1.0)), base.map(|(b, _)| (b, -1.0))];
            for (body, sign) in ends.into_iter().flatten() {
                for k in mbs.ancestors(body).flat_map(|a| mbs.get(a).v()) {
                    let (w, v) = (column(k, 0), column(k, 3));
                    J[k] += sign * (force.dot(&(v + w.cross(&pose.position))) + moment.dot(&w));
                }
            }
        }
    }
    Some(J)
}

impl<'e> Mj<'e> {
    /// Reads all tendons as lengths and devices.
    pub(super) fn tendons(
        &self,
        cx: &mut Cx<'_>,
        root: &'e Element,
        d: &mut Description,
    ) -> Lengths<'e> {
        let own = d.coordinates().into_iter().map(|(name, at)| (name.to_owned(), at));
        let mut lengths = Lengths {
            coordinates: own.collect(),
            tendons: BTreeMap::new(),
            lines: BTreeMap::new(),
            unread: BTreeSet::new(),
            anchors: BTreeMap::new(),
            moving: OnceCell::new(),
        };
        let springs: BTreeMap<String, f64> =
            d.joints.iter().map(|j| (j.name.clone(), j.spring_reference)).collect();
        for (k, e) in root.all("tendon").flat_map(|l| &l.children).enumerate() {
            if !matches!(e.name.as_str(), "fixed" | "spatial") {
                continue; // listed with the unused elements
            }
            let name = e.attr("name");
            let label = name.map_or(format!("tendon{}", k + 1), str::to_owned);
            let what = format!("tendon `{label}`");
            let (length, rest) = match e.name.as_str() {
                "fixed" => {
                    let (sum, rest) = self.sum(cx, e, &what, &springs, &lengths);
                    lengths.tendons.extend(name.map(|n| (n, sum.clone())));
                    (Length::Joints(sum.terms), rest)
                }
                "spatial" => {
                    let Some(sites) = self.line(cx, e, &what, &mut lengths, d) else {
                        lengths.unread.extend(name);
                        continue;
                    };
                    lengths.lines.extend(name.map(|n| (n, sites.clone())));
                    let rest = rest_of_line(&sites, d).unwrap_or(0.0);
                    (Length::Line { gear: 1.0, sites }, rest)
                }
                _ => continue,
            };
            let tendon = self.tendon(cx, e, &what, (length, rest), &lengths, d);
            d.devices.push(Device { name: label, kind: DeviceKind::Tendon(tendon) });
        }
        lengths
    }

    /// Returns the sum of a fixed tendon, and its value with the springs of all joints relaxed.
    fn sum(
        &self,
        cx: &mut Cx<'_>,
        e: &'e Element,
        what: &str,
        springs: &BTreeMap<String, f64>,
        lengths: &Lengths<'e>,
    ) -> (Sum, f64) {
        e.touch();
        if e.all("joint").next().is_none() {
            cx.missing(e, what, "<joint>", "write <joint joint=\"..\" coef=\"..\"/>");
        }
        let mut sum = Sum { terms: Vec::new(), reference: 0.0 };
        let mut rest = 0.0;
        for j in e.all("joint") {
            let coefficient = cx.number(j, "coef", what);
            let Some(joint) = cx.required(j, "joint", what) else { continue };
            let one = self.joint_sum(cx, joint, j.place_of("joint"), what, lengths);
            let Some((one, c)) = one.zip(coefficient) else { continue };
            sum.reference += c * one.reference;
            rest += c * springs.get(joint).copied().unwrap_or(0.0);
            sum.terms.extend(one.terms.into_iter().map(|t| Term { factor: c, ..t }));
        }
        (sum, rest)
    }

    /// Returns the sites of a spatial tendon; `None`, and a fault or a note, for an unsupported one.
    fn line(
        &self,
        cx: &mut Cx<'_>,
        e: &'e Element,
        what: &str,
        lengths: &mut Lengths<'e>,
        d: &mut Description,
    ) -> Option<Vec<DeviceFrame>> {
        if let Some(other) = e.children.iter().find(|c| c.name != "site") {
            e.touch_all();
            let remedy = match other.name.as_str() {
                "pulley" => {
                    "write each branch as a separate tendon, and let its actuator have the gear divided by `divisor`"
                }
                _ => "replace the geom by sites along the path around it",
            };
            let lost = match self.passive(e)[..] {
                [] => String::new(),
                [one] => format!(", so its {one} has no force"),
                ref forces => format!(", so its {} have no force", forces.join(" and its ")),
            };
            let note = format!(
                "a spatial tendon with a <{}> is not supported, because tendons are straight from site to site{lost}; {remedy}",
                other.name
            );
            cx.ignored.push(other.ignored(what, note));
            return None;
        }
        e.touch();
        let mut sites = Vec::new();
        for s in e.all("site") {
            let name = cx.required(s, "site", what)?;
            sites.push(self.device_frame(cx, (s.place_of("site"), name), what, lengths, d)?);
        }
        if sites.len() < 2 {
            cx.missing(e, what, "two sites", "write <site site=\"..\"/> at least twice");
            return None;
        }
        Some(sites)
    }

    /// Returns the kinds of forces that a tendon has without an actuator.
    fn passive(&self, e: &'e Element) -> Vec<&'static str> {
        let class = e.attr("class").unwrap_or(MAIN);
        let at = Classed { e, class, kind: "tendon" };
        let zero = |text: &str| text.split_whitespace().all(|w| w.parse() == Ok(0.0));
        let has = |key: &str| self.attr(at, key).is_some_and(|(text, _)| !zero(text));
        let limits = has("range") && self.attr(at, "limited").is_none_or(|(t, _)| t != "false");
        let kinds = [
            (has("stiffness"), "spring"),
            (has("damping"), "damper"),
            (limits, "limit"),
            (has("frictionloss"), "friction"),
        ];
        kinds.into_iter().filter(|(there, _)| *there).map(|(_, kind)| kind).collect()
    }

    /// Returns the frame of a site for a device; a site of the world becomes a body. `None` after a fault.
    pub(super) fn device_frame(
        &self,
        cx: &mut Cx<'_>,
        (place, name): (FilePlace, &'e str),
        what: &str,
        lengths: &mut Lengths<'e>,
        d: &mut Description,
    ) -> Option<DeviceFrame> {
        let Some(site) = self.sites.get(name) else {
            cx.unknown(place, what, "site", name, self.sites.keys().copied());
            return None;
        };
        if site.body != "world" {
            return Some(DeviceFrame::Node(name.into()));
        }
        let moving = &mut lengths.moving;
        let body = lengths.anchors.entry(name).or_insert_with(|| {
            // The new body changes the mechanism, so compute its tree again.
            *moving = OnceCell::new();
            let mut body = name.to_owned();
            while self.elements.contains_key(&body) {
                body.push('_');
            }
            let anchor = BodySpec::new(&body, "world").hinge_in_parent(site.pose);
            d.builder.body(anchor);
            body
        });
        Some(DeviceFrame::Body(body.clone()))
    }

    /// Reads spring, damper and limits of a tendon.
    fn tendon(
        &self,
        cx: &mut Cx<'_>,
        e: &'e Element,
        what: &str,
        (length, rest): (Length, f64),
        lengths: &Lengths<'e>,
        d: &Description,
    ) -> Tendon {
        let at = Classed { kind: "tendon", ..self.classed(cx, e, MAIN) };
        let spring = self.attr(at, "springlength").and_then(|(text, place)| {
            cx.parse_list(place, text, &format!("{what}: `springlength`"), 1..=2)
        });
        let rest = match spring.as_deref() {
            None | Some([-1.0] | [-1.0, -1.0]) => [rest; 2],
            Some([one]) => [*one; 2],
            Some(two) => [two[0], two[1]],
        };
        if rest[0] > rest[1] {
            let (text, place) = self.attr(at, "springlength").unwrap_or(("", e.place()));
            let help = "write the shorter length first";
            cx.bad(place, &format!("{what}: `springlength`"), text, "two lengths in order", help);
        }
        let stiffness = self.size(cx, at, "stiffness", what);
        let damping = self.size(cx, at, "damping", what);
        let range = self.range(cx, at, ("limited", "range"), what);
        let mut limit = [0.0; 2];
        if range.is_some() && cx.faults.is_empty() {
            let [time, impedance] = LIMIT;
            match lengths.inertia(&length, d) {
                Some(m) => limit = [m / (impedance * time).powi(2), 2.0 * m / (impedance * time)],
                None => {
                    let note = "attribute range: the mass matrix cannot be inverted, so the limits have no force; give all moving bodies mass, or use limits of joints";
                    cx.ignored.push(e.ignored(what, note));
                }
            }
        }
        Tendon { length, stiffness, rest, damping, range, limit }
    }

    /// Returns a length that is q of one joint.
    pub(super) fn joint_sum(
        &self,
        cx: &mut Cx<'_>,
        name: &str,
        place: FilePlace,
        what: &str,
        lengths: &Lengths<'e>,
    ) -> Option<Sum> {
        let found = self.joints.get(name).filter(|j| j.scalar).zip(lengths.coordinate(name));
        if found.is_none() {
            let all = self.joints.iter().filter(|(_, j)| j.scalar).map(|(n, _)| n.as_str());
            cx.unknown(place, what, "hinge or slide joint", name, all);
        }
        let (joint, coordinate) = found?;
        let coordinate = coordinate.clone();
        Some(Sum { terms: vec![Term { coordinate, factor: 1.0 }], reference: joint.reference })
    }
}

/// Returns the length of a line with the springs of all joints relaxed.
fn rest_of_line(sites: &[DeviceFrame], d: &Description) -> Option<f64> {
    let mbs = d.builder.build().ok()?;
    let mut q = d.configuration(&mbs);
    for j in d.joints.iter().filter(|j| j.count == 1) {
        let range = &mbs.get(mbs.body(&j.body)?).subhinges().get(j.subhinge)?.q;
        if range.len() == 1 {
            q[range.start] = j.spring_reference;
        }
    }
    let poses = mbs.body_poses(&q);
    let places: Option<Vec<_>> = sites.iter().map(|f| place(f, &mbs, &poses)).collect();
    Some(places?.windows(2).map(|p| (p[1].1 - p[0].1).norm()).sum())
}
