//! `<gazebo reference="..">` of a URDF: friction of a link's surfaces, and the spring of a joint.
//!
//! ```text
//! link     <mu1> (or <mu>)                            coefficient of friction of its collisions
//! joint    <springStiffness>, <springReference>        τ = −k (q − reference)
//! ```
//! Everything else in these blocks is listed as not used.

use crate::read::Cx;
use crate::xml::Element;
use crate::{Description, ShapeRole};
use linkwork_multibody::Spring;

/// Applies all blocks; `link` and `joint` contain the known names.
pub(crate) fn apply(
    cx: &mut Cx<'_>,
    root: &Element,
    d: &mut Description,
    link: impl Fn(&str) -> bool,
) {
    let used = ["mu", "mu1", "mu2", "springStiffness", "springReference"];
    for e in root.children.iter().filter(|c| c.name == "gazebo") {
        if !e.children.iter().any(|c| used.contains(&c.name.as_str())) {
            continue; // the whole block is listed as unused
        }
        let Some(name) = e.attr("reference") else { continue };
        let what = format!("<gazebo reference=\"{name}\">");
        if link(name) {
            friction(cx, e, name, &what, d);
        } else if d.joint(name).is_some() {
            spring(cx, e, name, &what, d);
        } else {
            let note = format!("there is neither a link nor a joint `{name}`");
            cx.ignored.push(e.ignored(what, note));
        }
    }
}

fn number(cx: &mut Cx<'_>, e: &Element, name: &str, what: &str) -> Option<f64> {
    let (at, text) = match e.child_text(name)? {
        (at, "") => (at, at.attr("value")?),
        both => both,
    };
    cx.parse::<1>(at.place(), text, &format!("{what}: <{name}>")).map(|[x]| x)
}

fn friction(cx: &mut Cx<'_>, e: &Element, name: &str, what: &str, d: &mut Description) {
    let first = number(cx, e, "mu1", what).or_else(|| number(cx, e, "mu", what));
    let second = number(cx, e, "mu2", what);
    let Some(mu) = first.or(second) else { return };
    let Some(mu) = cx.not_negative(e.place(), mu, &format!("{what}: friction")) else { return };
    if let Some(second) = second.filter(|s| *s != mu) {
        let note = format!("<mu2> {second}: friction is {mu} in all directions");
        cx.ignored.push(e.ignored(what, note));
    }
    let own = |s: &&mut crate::BodyShape| s.body == name && s.role == ShapeRole::Collision;
    d.shapes.iter_mut().filter(own).for_each(|s| s.surface.friction = Some(mu));
}

fn spring(cx: &mut Cx<'_>, e: &Element, name: &str, what: &str, d: &mut Description) {
    let stiffness = number(cx, e, "springStiffness", what);
    let rest = number(cx, e, "springReference", what).unwrap_or(0.0);
    let Some(k) = stiffness else { return };
    let Some(k) = cx.not_negative(e.place(), k, &format!("{what}: <springStiffness>")) else {
        return;
    };
    let Some(at) = d.coordinate(name) else {
        let note = "the spring of a joint that does not have one coordinate";
        cx.ignored.push(e.ignored(what, note));
        return;
    };
    if let Some(j) = d.joints.iter_mut().find(|j| j.name == name) {
        (j.stiffness, j.spring_reference) = (k, rest);
    }
    let body = d.builder.bodies_mut().iter_mut().find(|b| b.name == at.body);
    if let Some(s) = body.and_then(|b| b.hinge.subhinges.get_mut(at.subhinge)).filter(|_| k > 0.0) {
        s.spring = Spring { stiffness: k, rest };
    }
}
