//! Shapes of URDF and SDF, and code for shapes of all formats.

use crate::read::Cx;
use crate::xml::Element;
use crate::{Geometry, mesh};
use linkwork_spatial::nalgebra::Quaternion;
use linkwork_spatial::{Pose, Quat, Vec3};

/// Reads a length that must not be negative.
pub(crate) fn length(cx: &mut Cx<'_>, e: &Element, name: &str, what: &str) -> Option<f64> {
    let Some(x) = cx.number(e, name, what) else {
        if e.attr(name).is_none() {
            cx.missing(e, what, &format!("`{name}`"), format!("write {name}=\"..\" in m"));
        }
        return None;
    };
    cx.not_negative(e.place_of(name), x, &format!("{what}: `{name}`"))
}

/// Reads the only shape inside a URDF `<geometry>`.
pub(crate) fn urdf(cx: &mut Cx<'_>, e: &Element, what: &str) -> Option<Geometry> {
    if let Some(g) = e.child("box") {
        let what = format!("{what}: <box>");
        let Some(size) = cx.numbers::<3>(g, "size", &what) else {
            if g.attr("size").is_none() {
                cx.missing(g, &what, "`size`", "write size=\"x y z\" in m");
            }
            return None;
        };
        let place = g.place_of("size");
        for s in size {
            cx.not_negative(place.clone(), s, &format!("{what}: `size`"))?;
        }
        return Some(Geometry::Box { size });
    }
    if let Some(g) = e.child("sphere") {
        let radius = length(cx, g, "radius", &format!("{what}: <sphere>"))?;
        return Some(Geometry::Sphere { radius });
    }
    for name in ["cylinder", "capsule"] {
        if let Some(g) = e.child(name) {
            let what = format!("{what}: <{name}>");
            let radius = length(cx, g, "radius", &what);
            let length = length(cx, g, "length", &what);
            let (radius, length) = (radius?, length?);
            return Some(match name {
                "cylinder" => Geometry::Cylinder { radius, length },
                _ => Geometry::Capsule { radius, length },
            });
        }
    }
    if let Some(g) = e.child("mesh") {
        let what = format!("{what}: <mesh>");
        let file = cx.required(g, "filename", &what)?;
        let scale = cx.numbers::<3>(g, "scale", &what).unwrap_or([1.0; 3]);
        return Some(mesh_file(cx, g, file, scale, &what));
    }
    None
}

/// Reads a mesh; a missing file is a warning.
pub(crate) fn mesh_file(
    cx: &mut Cx<'_>,
    e: &Element,
    file: &str,
    scale: [f64; 3],
    what: &str,
) -> Geometry {
    let path = mesh::find(file, cx.options);
    if path.is_none() {
        let package = file.contains("://");
        let help = if package { "; specify the folder of their packages" } else { "" };
        let place = format!("{what} `{}`", crate::read::shortened(file));
        cx.ignored.push(e.ignored(place, format!("missing mesh files{help}")));
    }
    Geometry::Mesh { file: file.into(), path, scale }
}

/// Reads `xyz` and `rpy` or `quat_xyzw` of a URDF `<origin>`; without it, returns the identity.
pub(crate) fn urdf_origin(cx: &mut Cx<'_>, e: &Element, what: &str) -> Pose {
    let Some(o) = e.child("origin") else { return Pose::identity() };
    let what = format!("{what}: <origin>");
    let p = cx.numbers::<3>(o, "xyz", &what).unwrap_or_default();
    let angles = cx.numbers::<3>(o, "rpy", &what);
    let Some([x, y, z, w]) = cx.numbers::<4>(o, "quat_xyzw", &what) else {
        let [r, p_, y] = angles.unwrap_or_default();
        return Pose::new(Quat::from_euler_angles(r, p_, y), Vec3::from(p));
    };
    let text = o.attr("quat_xyzw").unwrap_or_default();
    let place = o.place_of("quat_xyzw");
    if angles.is_some() {
        cx.bad(place, &what, text, "the only orientation", "write either rpy or quat_xyzw");
        return Pose::identity();
    }
    match Quat::try_new(Quaternion::new(w, x, y, z), 1e-12) {
        Some(turn) => Pose::new(turn, Vec3::from(p)),
        None => {
            cx.bad(place, &what, text, "a quaternion", "write x y z w, for example 0 0 0 1");
            Pose::identity()
        }
    }
}
