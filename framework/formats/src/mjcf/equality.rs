//! Equality constraints of an MJCF file: loop closures and couplings.
//!
//! ```text
//! connect   the anchor is one point of both bodies         → loop with a ball
//! weld      X_12 is constant                                → loop with a locked hinge
//! joint     y − y₀ = Σ aₖ (x − x₀)ᵏ, k = 0 … 4              → y − Σ pₖ xᵏ = p₀, with p from the binomial theorem
//! tendon    the same for fixed tendons L = Σ cᵢ qᵢ; higher powers if x has one joint
//! ```
//! Subscript 0 is the reference configuration, at which the frames of a loop coincide.

use super::defaults::MAIN;
use super::tendon::{Lengths, Sum};
use super::{Classed, Mj, word};
use crate::error::FilePlace;
use crate::read::Cx;
use crate::xml::Element;
use crate::{Coupling, Description, LoopClosure, Term};
use linkwork_multibody::{Hinge, Powers};
use linkwork_spatial::nalgebra::Quaternion;
use linkwork_spatial::{Pose, Quat, Vec3};

impl<'e> Mj<'e> {
    /// Reads all equalities; unsupported ones are listed as ignored.
    pub fn equalities(
        &self,
        cx: &mut Cx<'_>,
        root: &'e Element,
        lengths: &Lengths<'e>,
        d: &mut Description,
    ) {
        let mut count = 0;
        for e in root.all("equality").flat_map(|list| &list.children) {
            count += 1;
            let kind = e.name.as_str();
            if !matches!(kind, "connect" | "weld" | "joint" | "tendon") {
                continue;
            }
            let at = Classed { kind: "equality", ..self.classed(cx, e, MAIN) };
            let name = e.attr("name").map_or(format!("{kind}{count}"), str::to_owned);
            let what = format!("equality `{name}`");
            let active = self.attr(at, "active").and_then(|(text, place)| {
                word(cx, place, text, &what, &[("true", true), ("false", false)])
            });
            if active == Some(false) {
                e.touch_all();
                cx.ignored.push(e.ignored(&what, "not active"));
            } else if matches!(kind, "joint" | "tendon") {
                let sum = |cx: &mut Cx<'_>, name: &str, place: FilePlace| match kind {
                    "joint" => self.joint_sum(cx, name, place, &what, lengths),
                    _ => lengths.tendons.get(name).cloned().or_else(|| {
                        let names = lengths.tendons.keys().copied();
                        cx.unknown(place, &what, "fixed tendon", name, names);
                        None
                    }),
                };
                if let Some(coupling) = self.coupling(cx, at, name, &what, kind, sum) {
                    d.couplings.push(coupling);
                }
            } else if let Some(closure) = self.closure(cx, at, name, &what) {
                d.loops.push(closure);
            }
        }
    }

    fn coupling(
        &self,
        cx: &mut Cx<'_>,
        at: Classed<'e>,
        name: String,
        what: &str,
        kind: &str,
        sum: impl Fn(&mut Cx<'_>, &str, FilePlace) -> Option<Sum>,
    ) -> Option<Coupling> {
        let e = at.e;
        let first = cx.required(e, &format!("{kind}1"), what)?;
        let y = sum(cx, first, e.place_of(&format!("{kind}1")))?;
        let x = match e.attr(&format!("{kind}2")) {
            Some(second) => Some(sum(cx, second, e.place_of(&format!("{kind}2")))?),
            None => None,
        };
        let a = match self.attr(at, "polycoef") {
            Some((text, place)) => {
                cx.parse_list(place, text, &format!("{what}: `polycoef`"), 1..=5)?
            }
            None => vec![0.0, 1.0],
        };
        let (mut terms, mut constant) = (y.terms, a[0] + y.reference);
        let Some(x) = x else { return Some(Coupling::linear(name, terms, constant)) };
        let slope = a.get(1).copied().unwrap_or(1.0);
        let bent = a.iter().skip(2).any(|c| *c != 0.0);
        let (mut linear, mut powers) = (slope, Vec::new());
        if bent {
            let [t] = &x.terms[..] else {
                e.touch_all();
                let note = "a polynomial of higher degree than one in a tendon over several joints";
                cx.ignored.push(e.ignored(what, note));
                return None;
            };
            let all =
                std::array::from_fn(
                    |k| if k == 1 { slope } else { a.get(k).copied().unwrap_or(0.0) },
                );
            let [p0, p1, p2, p3, p4] = shifted(all, t.factor, x.reference);
            linear = if t.factor == 0.0 { 0.0 } else { p1 / t.factor };
            constant = p0 + y.reference;
            let factors = [-p2, -p3, -p4];
            powers.push(Powers { coordinate: t.coordinate.clone(), factors });
        } else {
            constant -= slope * x.reference;
        }
        for t in x.terms {
            let factor = -linear * t.factor;
            match terms.iter_mut().find(|own| own.coordinate == t.coordinate) {
                Some(own) => own.factor += factor,
                None => terms.push(Term { factor, ..t }),
            }
        }
        Some(Coupling { name, terms, constant, powers })
    }

    fn closure(
        &self,
        cx: &mut Cx<'_>,
        at: Classed<'e>,
        name: String,
        what: &str,
    ) -> Option<LoopClosure> {
        let (e, weld) = (at.e, at.e.name == "weld");
        let hinge = if weld { Hinge::locked() } else { Hinge::ball() };
        if let (Some(one), Some(two)) = (e.attr("site1"), e.attr("site2")) {
            let mut site = |name: &str, key: &str| {
                let found = self.sites.get(name).map(|s| (s.body.clone(), s.pose));
                if found.is_none() {
                    cx.unknown(e.place_of(key), what, "site", name, self.sites.keys().copied());
                }
                found
            };
            let (a, b) = (site(one, "site1"), site(two, "site2"));
            let ((body_a, frame_a), (body_b, frame_b)) = (a?, b?);
            return Some(LoopClosure { name, body_a, frame_a, body_b, frame_b, hinge });
        }
        let mut body = |key: &str, default: Option<&str>| {
            let name = match e.attr(key).or(default) {
                Some(name) => name,
                None => cx.required(e, key, what)?,
            };
            let pose = self.poses.get(name);
            if pose.is_none() {
                cx.unknown(
                    e.place_of(key),
                    what,
                    "body",
                    name,
                    self.poses.keys().map(String::as_str),
                );
            }
            Some((name.to_owned(), *pose?))
        };
        let (a, b) = (body("body1", None), body("body2", Some("world")));
        let ((body_a, X_WA), (body_b, X_WB)) = (a?, b?);
        let anchor = self.numbers::<3>(cx, at, "anchor", what);
        let X_AB = X_WA.inverse() * X_WB;
        let (frame_a, frame_b) = if weld {
            // In this form, the anchor is given in the frame of body 2.
            let anchor = Pose::new(Quat::identity(), Vec3::from(anchor.unwrap_or_default()));
            let relative = self.relative(cx, at, what).unwrap_or(X_AB);
            (relative * anchor, anchor)
        } else {
            // In this form, the anchor is given in the frame of body 1, and frame B has the axes of
            // A at the reference configuration.
            let Some(anchor) = anchor else {
                cx.missing(e, what, "`anchor`", "write anchor=\"x y z\" in body1, or two sites");
                return None;
            };
            let frame_a = Pose::new(Quat::identity(), Vec3::from(anchor));
            (frame_a, X_AB.inverse() * frame_a)
        };
        Some(LoopClosure { name, body_a, frame_a, body_b, frame_b, hinge })
    }

    /// Reads `relpose` of a weld, unless its quaternion is zero.
    fn relative(&self, cx: &mut Cx<'_>, at: Classed<'e>, what: &str) -> Option<Pose> {
        let [px, py, pz, w, x, y, z] = self.numbers::<7>(cx, at, "relpose", what)?;
        let raw = Quaternion::new(w, x, y, z);
        let size = raw.coords.amax();
        if !(1e-100..=1e100).contains(&size) {
            return None;
        }
        Some(Pose::new(Quat::new_normalize(raw / size), Vec3::new(px, py, pz)))
    }
}

/// Returns the coefficients of Σ aₖ (f q − r)ᵏ as a polynomial of q.
fn shifted(a: [f64; 5], f: f64, r: f64) -> [f64; 5] {
    // Horner's scheme: multiply by (f q − r), then add the next coefficient.
    let mut p = [0.0; 5];
    for c in a.into_iter().rev() {
        for k in (0..5).rev() {
            p[k] = -r * p[k] + if k > 0 { f * p[k - 1] } else { c };
        }
    }
    p
}
