//! Solids: for display, and for inertia computed from the mass.
use crate::schema::pose::direction;
use crate::schema::read::{fields, number, numbers, text_field};
use crate::text::files::Near;
use crate::text::report::Cx;
use linkwork_runtime::{Located, Origin, Value, remedy};
use linkwork_spatial::{Mat3, Quat, Vec3};

/// A solid; lengths in m.
#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    /// Along z, centred.
    Cylinder {
        /// Radius.
        radius: f64,
        /// Whole length.
        length: f64,
    },
    /// Centred.
    Box {
        /// Whole lengths along x, y, z.
        size: [f64; 3],
    },
    /// Centred.
    Sphere {
        /// Radius.
        radius: f64,
    },
    /// A cylinder along z with half spheres on its ends, centred.
    Capsule {
        /// Radius.
        radius: f64,
        /// Length of the cylinder without the ends.
        length: f64,
    },
    /// A mesh file.
    Mesh {
        /// Path, as found.
        file: String,
        /// Factor to m.
        scale: f64,
    },
}

const KINDS: [&str; 5] = ["Cylinder", "Box", "Sphere", "Capsule", "Mesh"];

/// The kinds of shapes that only collide, but `Mesh`.
pub(crate) const COLLIDING: [&str; 4] = ["HalfSpace", "ConvexHull", "HeightField", "Mesh"];

/// A solid and the turn of its z axis.
pub(crate) fn shape(
    cx: &mut Cx,
    v: &Located,
    what: &str,
    files: Option<Near<'_>>,
) -> Option<(Shape, Quat)> {
    let Value::Variant(kind, inner) = &v.value else {
        let message = format!("{what} is a shape, this is {}", v.value.what());
        cx.fault(v.origin, message, format!("one of: {}", KINDS.join(", ")));
        return None;
    };
    let what = format!("{what}: `{kind}`");
    let length = |cx: &mut Cx, field: &str| match inner.get(field) {
        Some(x) => positive(cx, x, &format!("{what}: `{field}`")),
        None => {
            cx.fault(
                v.origin,
                format!("{what} has no `{field}`"),
                format!("write `{field}: ..` in m"),
            );
            None
        }
    };
    let turn = |cx: &mut Cx| match inner.get("axis") {
        Some(axis) => {
            let n = direction(cx, axis, &format!("{what}: `axis`"))?;
            let half_turn = Quat::from_axis_angle(&Vec3::x_axis(), std::f64::consts::PI);
            Some(Quat::rotation_between(&Vec3::z(), &n).unwrap_or(half_turn))
        }
        None => Some(Quat::identity()),
    };
    match kind.as_str() {
        "Cylinder" | "Capsule" => {
            fields(cx, inner, &what, &["radius", "length", "axis"]);
            let (radius, length, turn) = (length(cx, "radius"), length(cx, "length"), turn(cx)?);
            let (radius, length) = (radius?, length?);
            let solid = match kind.as_str() {
                "Cylinder" => Shape::Cylinder { radius, length },
                _ => Shape::Capsule { radius, length },
            };
            Some((solid, turn))
        }
        "Box" => {
            let list = inner.get("size").unwrap_or(inner);
            let size = numbers::<3>(cx, list, &what, "m")?;
            if size.iter().any(|s| *s <= 0.0) {
                cx.fault(list.origin, format!("{what} has a side that is not positive"), "");
                return None;
            }
            Some((Shape::Box { size }, Quat::identity()))
        }
        "Sphere" => {
            let radius = positive(cx, inner.get("radius").unwrap_or(inner), &what)?;
            Some((Shape::Sphere { radius }, Quat::identity()))
        }
        "Mesh" => {
            fields(cx, inner, &what, &["file", "scale"]);
            let scale = match inner.get("scale") {
                Some(s) => number(cx, s, &format!("{what}: `scale`"), "")?,
                None => 1.0,
            };
            let file = text_field(cx, inner, "file", &what);
            let Some(file) = file else {
                cx.fault(v.origin, format!("{what} has no `file`"), "write `file: \"part.stl\"`");
                return None;
            };
            let Some((files, home)) = files else {
                cx.fault(v.origin, format!("{what} cannot be used here"), "use a plain solid");
                return None;
            };
            match files.data(&file.text, home) {
                Some(path) => Some((Shape::Mesh { file: path, scale }, Quat::identity())),
                None => {
                    let message = format!("{what}: there is no file `{}`", file.text);
                    cx.fault(file.origin, message, "give the path relative to this file");
                    None
                }
            }
        }
        other => {
            let solids = KINDS.iter().copied();
            let colliding = COLLIDING.into_iter().filter(|k| files.is_some() && *k != "Mesh");
            let known: Vec<&str> = solids.chain(colliding).collect();
            let origin = Origin { end: v.origin.start + other.len() as u32, ..v.origin };
            cx.fault(
                origin,
                format!("there is no shape `{other}`"),
                remedy(other, "shapes", &known),
            );
            None
        }
    }
}

fn positive(cx: &mut Cx, v: &Located, what: &str) -> Option<f64> {
    let x = number(cx, v, what, "m")?;
    if x <= 0.0 {
        cx.fault(v.origin, format!("{what} is {x} m"), "write a length above zero");
        return None;
    }
    Some(x)
}

/// Red, green, blue, opacity.
pub(crate) fn rgba(cx: &mut Cx, v: &Located, what: &str) -> Option<[f64; 4]> {
    let what = format!("{what}: `color`");
    let opaque = matches!(&v.value, Value::List(items) if items.len() == 3);
    let c = if opaque {
        let [r, g, b] = numbers::<3>(cx, v, &what, "")?;
        [r, g, b, 1.0]
    } else {
        numbers::<4>(cx, v, &what, "")?
    };
    if c.iter().any(|x| !(0.0..=1.0).contains(x)) {
        cx.fault(
            v.origin,
            format!("{what} has a number outside 0 .. 1"),
            "write [red, green, blue]",
        );
        return None;
    }
    Some(c)
}

/// Inertia of a homogeneous solid about its centre, body axes; `None` for a mesh.
pub(crate) fn inertia(mass: f64, shape: &Shape, turn: &Quat) -> Option<Mat3> {
    let diagonal = match *shape {
        Shape::Cylinder { radius: r, length: l } => {
            let x = mass * (3.0 * r * r + l * l) / 12.0;
            Vec3::new(x, x, 0.5 * mass * r * r)
        }
        Shape::Box { size: [a, b, c] } => {
            Vec3::new(b * b + c * c, a * a + c * c, a * a + b * b) * (mass / 12.0)
        }
        Shape::Sphere { radius: r } => Vec3::repeat(0.4 * mass * r * r),
        Shape::Capsule { radius: r, length: l } => {
            // Cylinder and two half spheres, whose centres are l/2 + 3r/8 away.
            let (vc, vs) = (l, 4.0 / 3.0 * r);
            let (mc, ms) = (mass * vc / (vc + vs), mass * vs / (vc + vs));
            let x = mc * (3.0 * r * r + l * l) / 12.0
                + ms * (0.4 * r * r + 0.25 * l * l + 0.375 * r * l);
            Vec3::new(x, x, mc * 0.5 * r * r + ms * 0.4 * r * r)
        }
        Shape::Mesh { .. } => return None,
    };
    let R = turn.to_rotation_matrix();
    Some(R.matrix() * Mat3::from_diagonal(&diagonal) * R.matrix().transpose())
}
