//! Shapes of an SDF link.

use super::frames::plain_pose;
use crate::read::Cx;
use crate::xml::Element;
use crate::{BodyShape, Description, Filter, Geometry, ShapeRole, Surface, geometry};
use linkwork_spatial::{Pose, Quat, Vec3};

/// Reads numbers of a child element; returns `None` if it is missing.
pub(super) fn numbers<const N: usize>(
    cx: &mut Cx<'_>,
    e: &Element,
    name: &str,
    what: &str,
) -> Option<[f64; N]> {
    let (at, text) = e.child_text(name)?;
    cx.parse::<N>(at.place(), text, &format!("{what}: <{name}>"))
}

/// Reads one number of a child element.
pub(super) fn number(cx: &mut Cx<'_>, e: &Element, name: &str, what: &str) -> Option<f64> {
    numbers::<1>(cx, e, name, what).map(|[x]| x)
}

/// Visuals and collisions.
pub(super) fn shapes(cx: &mut Cx<'_>, link: &Element, body: &str, d: &mut Description) {
    for (list, role) in [("visual", ShapeRole::Visual), ("collision", ShapeRole::Collision)] {
        for e in link.all(list) {
            let name = e.attr("name").unwrap_or_default().to_owned();
            let what = format!("link `{body}`: <{}>", e.label());
            let pose = e.child("pose").map_or(Pose::identity(), |p| plain_pose(cx, p, &what));
            let color = e.child("material").and_then(|m| color(cx, m, &what));
            let Some(g) = e.child("geometry") else {
                let help = "write <geometry><sphere><radius>..</radius></sphere></geometry>";
                cx.missing(e, &what, "<geometry>", help);
                continue;
            };
            if let Some((turn, geometry)) = solid(cx, g, &what) {
                let pose = pose * Pose::rotation(turn);
                let shape = BodyShape::new(body, role, pose, geometry);
                let (surface, filter) = match role {
                    ShapeRole::Visual => (Surface::default(), Filter::default()),
                    _ => (surface(cx, e, &what), filter(cx, e, &what)),
                };
                d.shapes.push(BodyShape { name, color, surface, filter, ..shape });
            }
        }
    }
}

/// Reads `<surface>`: friction as in ODE and Bullet (`mu`), and restitution.
fn surface(cx: &mut Cx<'_>, collision: &Element, what: &str) -> Surface {
    let mut out = Surface::default();
    let Some(e) = collision.child("surface") else { return out };
    let what = format!("{what}: <surface>");
    if let Some(friction) = e.child("friction") {
        let of = |engine: &str, name: &'static str| Some((friction.child(engine)?, name));
        let all = [of("ode", "mu"), of("bullet", "friction")];
        if let Some((engine, name)) = all.into_iter().flatten().next() {
            out.friction = number(cx, engine, name, &what);
            let across = if name == "mu" { "mu2" } else { "friction2" };
            let second = number(cx, engine, across, &what);
            if let (Some(first), Some(second)) = (out.friction, second)
                && first != second
            {
                let note = format!("<{across}> {second}: friction is {first} in all directions");
                cx.ignored.push(engine.ignored(&what, note));
            }
        }
    }
    let bounce = e.child("bounce");
    out.restitution = bounce.and_then(|b| number(cx, b, "restitution_coefficient", &what));
    let mut sound = |x: Option<f64>, most: f64, name: &str| {
        let value = x?;
        if (0.0..=most).contains(&value) {
            return x;
        }
        let (expected, help) = (format!("a number from 0 to {most}"), "correct the number");
        cx.bad(e.place(), &format!("{what}: {name}"), &value.to_string(), &expected, help);
        None
    };
    out.friction = sound(out.friction, f64::MAX, "friction");
    out.restitution = sound(out.restitution, 1.0, "restitution");
    out
}

/// Reads `<collide_bitmask>` and `<category_bitmask>`; without the second, the first is used for both.
fn filter(cx: &mut Cx<'_>, collision: &Element, what: &str) -> Filter {
    let contact = collision.child("surface").and_then(|s| s.child("contact"));
    let mut mask = |name: &str| {
        let (at, text) = contact?.child_text(name)?;
        let bits = match text.strip_prefix("0x").or(text.strip_prefix("0X")) {
            Some(hex) => u32::from_str_radix(hex, 16).ok(),
            None => text.parse().ok(),
        };
        if bits.is_none() {
            let help = "write an integer, such as 3 or 0x03";
            cx.bad(at.place(), &format!("{what}: <{name}>"), text, "a mask of 32 bits", help);
        }
        bits
    };
    let (collide, category) = (mask("collide_bitmask"), mask("category_bitmask"));
    let meets = collide.unwrap_or(EVERY);
    Filter { category: category.unwrap_or(meets), meets }
}

/// Uses the usual filter for all collisions if none of a file has a mask.
pub(super) fn usual_filters(shapes: &mut [BodyShape]) {
    let every = Filter { category: EVERY, meets: EVERY };
    if shapes.iter().all(|s| s.role == ShapeRole::Visual || s.filter == every) {
        shapes.iter_mut().for_each(|s| s.filter = Filter::default());
    }
}

/// All default categories of a collision.
const EVERY: u32 = 0xFFFF;

/// Reads three or four numbers; the default opacity is 1.
fn color(cx: &mut Cx<'_>, material: &Element, what: &str) -> Option<[f64; 4]> {
    let (e, text) = material.child_text("diffuse").or_else(|| material.child_text("ambient"))?;
    let c = cx.parse_list(e.place(), text, &format!("{what}: <{}>", e.name), 3..=4)?;
    Some([c[0], c[1], c[2], c.get(3).copied().unwrap_or(1.0)])
}

/// Returns the shape inside a `<geometry>`, and the rotation of its frame.
pub(super) fn solid(cx: &mut Cx<'_>, g: &Element, what: &str) -> Option<(Quat, Geometry)> {
    let kinds = ["box", "sphere", "cylinder", "capsule", "ellipsoid", "plane", "mesh"];
    let e = kinds.iter().find_map(|k| g.child(k))?;
    let what = format!("{what}: <{}>", e.name);
    let lengths = |cx: &mut Cx<'_>, name: &str, count: usize| {
        let Some((at, text)) = e.child_text(name) else {
            cx.missing(e, &what, &format!("<{name}>"), format!("write <{name}>..</{name}> in m"));
            return None;
        };
        let what = format!("{what}: <{name}>");
        let list = cx.parse_list(at.place(), text, &what, count..=count)?;
        for x in &list {
            cx.not_negative(at.place(), *x, &what)?;
        }
        Some(list)
    };
    let mut turn = Quat::identity();
    let geometry = match e.name.as_str() {
        "box" => Geometry::Box { size: lengths(cx, "size", 3)?.try_into().ok()? },
        "ellipsoid" => Geometry::Ellipsoid { radii: lengths(cx, "radii", 3)?.try_into().ok()? },
        "sphere" => Geometry::Sphere { radius: lengths(cx, "radius", 1)?[0] },
        "cylinder" | "capsule" => {
            let (radius, length) = (lengths(cx, "radius", 1), lengths(cx, "length", 1));
            let (radius, length) = (radius?[0], length?[0]);
            match e.name.as_str() {
                "cylinder" => Geometry::Cylinder { radius, length },
                _ => Geometry::Capsule { radius, length },
            }
        }
        "plane" => {
            if let Some((at, text)) = e.child_text("normal") {
                let n = Vec3::from(cx.parse::<3>(at.place(), text, &what)?);
                let n = cx.unit(at.place(), n, text, &what)?;
                let half_turn = Quat::from_scaled_axis(Vec3::x() * std::f64::consts::PI);
                turn = Quat::rotation_between(&Vec3::z(), &n).unwrap_or(half_turn);
            }
            let size =
                if e.child("size").is_some() { lengths(cx, "size", 2)? } else { vec![0.0; 2] };
            Geometry::Plane { size: size.try_into().ok()? }
        }
        _ => {
            let (at, uri) = e.child_text("uri").or_else(|| {
                cx.missing(e, &what, "<uri>", "write <uri>model://..</uri>");
                None
            })?;
            let scale = numbers::<3>(cx, e, "scale", &what).unwrap_or([1.0; 3]);
            geometry::mesh_file(cx, at, uri, scale, &what)
        }
    };
    Some((turn, geometry))
}
