//! Collision filters and friction of an MJCF file.
//!
//! ```text
//! geoms collide  contype₁ ∧ conaffinity₂ ≠ 0 or contype₂ ∧ conaffinity₁ ≠ 0
//! <exclude>      two bodies that do not collide       <pair>    two geoms that collide regardless of their masks
//! friction       sliding, spinning (m, condim ≥ 4), rolling (m, condim 6)
//! ```

use super::defaults::MAIN;
use super::{Classed, Mj};
use crate::read::Cx;
use crate::xml::Element;
use crate::{BodyShape, Description, Filter, ShapeRole, Surface};
use linkwork_spatial::Vec3;
use std::collections::BTreeSet;

/// Default friction of MuJoCo.
const FRICTION: [f64; 3] = [1.0, 0.005, 0.0001];

impl<'e> Mj<'e> {
    /// Reads the bit masks of a geom.
    pub(super) fn filter(&self, cx: &mut Cx<'_>, at: Classed<'e>, what: &str) -> Filter {
        let mut mask = |name: &str| {
            let Some(x) = self.number(cx, at, name, what) else { return 1 };
            let bits = x as i64;
            if x.fract() != 0.0 || !(i64::from(i32::MIN)..=i64::from(u32::MAX)).contains(&bits) {
                let (text, place) = self.attr(at, name).unwrap_or(("", at.e.place()));
                let help = "write the sum of the bits, for example 5 for the first and third";
                cx.bad(place, &format!("{what}: `{name}`"), text, "a mask of 32 bits", help);
                return 1;
            }
            bits as u32
        };
        let category = mask("contype");
        Filter { category, meets: mask("conaffinity") }
    }

    /// Reads the friction of a geom; `condim` selects the active kinds.
    pub(super) fn surface(&self, cx: &mut Cx<'_>, at: Classed<'e>, what: &str) -> Surface {
        let mut friction = FRICTION;
        if let Some((text, place)) = self.attr(at, "friction") {
            let what = format!("{what}: `friction`");
            let list = cx.parse_list(place.clone(), text, &what, 1..=3).unwrap_or_default();
            for (own, x) in friction.iter_mut().zip(list) {
                *own = cx.not_negative(place.clone(), x, &what).unwrap_or(*own);
            }
        }
        let kinds = self.number(cx, at, "condim", what).unwrap_or(3.0);
        if ![1.0, 3.0, 4.0, 6.0].contains(&kinds) {
            let (text, place) = self.attr(at, "condim").unwrap_or(("", at.e.place()));
            let help = "write 1, 3, 4 or 6";
            cx.bad(place, &format!("{what}: `condim`"), text, "a number of dimensions", help);
        }
        Surface {
            friction: Some(if kinds > 1.0 { friction[0] } else { 0.0 }),
            restitution: None,
            rolling: (kinds > 4.0).then_some(friction[2]),
            spinning: (kinds > 3.0).then_some(friction[1]),
        }
    }

    /// Reads `<contact>`: pairs and exclusions, after all bodies.
    pub(super) fn contacts(&self, cx: &mut Cx<'_>, root: &'e Element, d: &mut Description) {
        for list in root.all("contact") {
            for e in list.all("exclude") {
                let mut body = |key: &str| {
                    let name = cx.required(e, key, "<exclude>")?;
                    if self.poses.contains_key(name) {
                        return Some(name.to_owned());
                    }
                    let all = self.poses.keys().map(String::as_str);
                    cx.unknown(e.place_of(key), "<exclude>", "body", name, all);
                    None
                };
                e.attr("name");
                if let (Some(a), Some(b)) = (body("body1"), body("body2")) {
                    d.exclusions.push([a, b]);
                }
            }
            for e in list.all("pair") {
                self.pair(cx, e, d);
            }
        }
        note_frictions(cx, root, &d.shapes);
    }

    fn pair(&self, cx: &mut Cx<'_>, e: &'e Element, d: &mut Description) {
        e.attr("name");
        self.classed(cx, e, MAIN);
        let mut end = |key: &str| {
            let name = cx.required(e, key, "<pair>")?;
            let shape = |s: &BodyShape| s.name == name && s.role == ShapeRole::Collision;
            let found = d.shapes.iter().position(shape);
            if found.is_none() {
                match self.geoms.contains_key(name) {
                    true => cx.ignored.push(e.ignored(
                        "<pair>",
                        format!("its geom `{name}` does not have a collision shape"),
                    )),
                    false => cx.unknown(
                        e.place_of(key),
                        "<pair>",
                        "geom",
                        name,
                        self.geoms.keys().copied(),
                    ),
                }
            }
            found
        };
        if let (Some(a), Some(b)) = (end("geom1"), end("geom2")) {
            d.pairs.push([a, b]);
        }
    }
}

/// Returns the names of the geoms in `<pair>` elements.
pub(super) fn paired(root: &Element) -> BTreeSet<&str> {
    let pairs =
        root.all("contact").flat_map(|list| list.children.iter().filter(|e| e.name == "pair"));
    pairs.flat_map(|e| ["geom1", "geom2"].map(|k| e.attr(k))).flatten().collect()
}

/// MuJoCo uses the larger friction of two surfaces, this engine the geometric mean: adds a note if they differ.
fn note_frictions(cx: &mut Cx<'_>, root: &Element, shapes: &[BodyShape]) {
    let colliding = shapes.iter().filter(|s| s.role == ShapeRole::Collision);
    let mut all: Vec<f64> = colliding.filter_map(|s| s.surface.friction).collect();
    all.sort_by(f64::total_cmp);
    let (Some(least), Some(most)) = (all.first(), all.last()) else { return };
    if least < most {
        let note = format!(
            "friction of pairs of surfaces that differ ({least} to {most}): the geometric mean of the two is used, \
             where MuJoCo uses the larger"
        );
        cx.ignored.push(root.ignored("mujoco", note));
    }
}

/// Reports a moving surface (`surfacevel`), in the axes of the geom.
pub(super) fn moving_surface(cx: &mut Cx<'_>, e: &Element, velocity: Option<[f64; 3]>, what: &str) {
    if velocity.is_some_and(|v| Vec3::from(v) != Vec3::zeros()) {
        cx.ignored.push(e.ignored(what, "attribute surfacevel"));
    }
}
