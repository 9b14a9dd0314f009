//! Mass properties and shapes of an SDF link.

use super::frames::plain_pose;
use crate::read::Cx;
use crate::urdf::turned;
use crate::xml::Element;
use crate::{BodyShape, Description, Geometry, ShapeRole, geometry};
use linkwork_spatial::{MassProperties, Mat3, Pose, Quat, Vec3};

/// Numbers inside a child element, or `None` when it is not there.
pub(super) fn numbers<const N: usize>(
    cx: &mut Cx<'_>,
    e: &Element,
    name: &str,
    what: &str,
) -> Option<[f64; N]> {
    let (at, text) = e.child_text(name)?;
    cx.parse::<N>(at.place(), text, &format!("{what}: <{name}>"))
}

/// One number inside a child element.
pub(super) fn number(cx: &mut Cx<'_>, e: &Element, name: &str, what: &str) -> Option<f64> {
    numbers::<1>(cx, e, name, what).map(|[x]| x)
}

/// What is not written is 1 kg and 1 kg m², as in the format's specification, and listed.
pub(super) fn inertial(cx: &mut Cx<'_>, link: &Element, body: &str) -> MassProperties {
    let what = format!("link `{body}`");
    let Some(e) = link.child("inertial") else {
        let note = "no <inertial>: the format's default of 1 kg and 1 kg m² is used";
        cx.ignored.push(link.ignored(format!("sdf/{}", link.label()), note));
        return MassProperties::new(1.0, Vec3::zeros(), Mat3::identity());
    };
    let what = format!("{what}: <inertial>");
    let X_BC = e.child("pose").map_or(Pose::identity(), |p| plain_pose(cx, p, &what));
    let mass = number(cx, e, "mass", &what).unwrap_or(1.0);
    let mut entry = |name: &str, default: f64| {
        e.child("inertia").and_then(|i| number(cx, i, name, &what)).unwrap_or(default)
    };
    let [xx, yy, zz] = ["ixx", "iyy", "izz"].map(|n| entry(n, 1.0));
    let [xy, xz, yz] = ["ixy", "ixz", "iyz"].map(|n| entry(n, 0.0));
    if e.child("inertia").is_none() || e.child("mass").is_none() {
        let note = "without <mass> or <inertia>: the format's default of 1 is used";
        cx.ignored.push(e.ignored(&what, note));
    }
    let J = Mat3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
    cx.checked(e, what, MassProperties::new(mass, X_BC.position, turned(&J, &X_BC)))
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
                d.shapes.push(BodyShape { body: body.into(), name, role, pose, geometry, color });
            }
        }
    }
}

/// Three or four numbers: opacity is 1 when it is not written.
fn color(cx: &mut Cx<'_>, material: &Element, what: &str) -> Option<[f64; 4]> {
    let (e, text) = material.child_text("diffuse").or_else(|| material.child_text("ambient"))?;
    let c = cx.parse_list(e.place(), text, &format!("{what}: <{}>", e.name), 3..=4)?;
    Some([c[0], c[1], c[2], c.get(3).copied().unwrap_or(1.0)])
}

fn solid(cx: &mut Cx<'_>, g: &Element, what: &str) -> Option<(Quat, Geometry)> {
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
