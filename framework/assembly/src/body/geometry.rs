//! Shapes that collide: those that can be shown, and half spaces, hulls, meshes, height fields.
//!
//! ```text
//! HalfSpace                                          all points with z ≤ 0
//! ConvexHull(points: [..]) | (file: "x.stl")         the hull of points or of a mesh's corners
//! Mesh(file: ..) | (vertices: [..], triangles: [..]) triangles, counter-clockwise from outside
//! HeightField(spacing: .., heights: [[..], ..])      rows from low y to high y, each along x; centred
//! ```
use crate::body::solid::{self, COLLIDING};
use crate::body::stl;
use crate::schema::read::{fields, list, number, numbers, text_field};
use crate::text::files::{Home, Near};
use crate::text::report::Cx;
use crate::text::value;
use linkwork_collision::Shape;
use linkwork_runtime::{Located, Value};
use linkwork_spatial::{Quat, Vec3};

/// True for what only collides and cannot be shown.
pub(crate) fn only_collides(v: &Located) -> bool {
    match &v.value {
        Value::Variant(kind, inner) if kind == "Mesh" => inner.get("file").is_none(),
        Value::Variant(kind, _) => COLLIDING.contains(&kind.as_str()),
        _ => false,
    }
}

/// A shape and the turn of its z axis.
pub(crate) fn read(
    cx: &mut Cx,
    v: &Located,
    what: &str,
    files: Option<Near<'_>>,
) -> Option<(Shape, Quat)> {
    let special = match &v.value {
        Value::Variant(kind, inner) if COLLIDING.contains(&kind.as_str()) => Some((kind, inner)),
        _ => None,
    };
    let Some((kind, inner)) = special else {
        let (solid, turn) = solid::shape(cx, v, what, files)?;
        return Some((solid_shape(&solid)?, turn));
    };
    let at = format!("{what}: `{kind}`");
    let found = match kind.as_str() {
        "HalfSpace" => {
            fields(cx, inner, &at, &[]);
            Some(Shape::HalfSpace)
        }
        "ConvexHull" => {
            fields(cx, inner, &at, &["points", "file", "scale"]);
            let points = match inner.get("points") {
                Some(p) => vectors(cx, p, &format!("{at}: `points`")),
                None => corners(cx, v, inner, &at, files, "points: [[x, y, z], ..]"),
            };
            points.map(|points| Shape::ConvexHull { points })
        }
        "Mesh" => {
            fields(cx, inner, &at, &["file", "scale", "vertices", "triangles"]);
            mesh(cx, v, inner, &at, files)
        }
        _ => height_field(cx, v, inner, &at),
    };
    Some((found?, Quat::identity()))
}

/// Half extents of what can be shown; a mesh is read elsewhere.
fn solid_shape(solid: &solid::Shape) -> Option<Shape> {
    Some(match *solid {
        solid::Shape::Cylinder { radius, length } => {
            Shape::Cylinder { radius, half_length: 0.5 * length }
        }
        solid::Shape::Capsule { radius, length } => {
            Shape::Capsule { radius, half_length: 0.5 * length }
        }
        solid::Shape::Box { size } => Shape::Box { half: 0.5 * Vec3::from(size) },
        solid::Shape::Sphere { radius } => Shape::Sphere { radius },
        solid::Shape::Mesh { .. } => return None,
    })
}

fn vectors(cx: &mut Cx, v: &Located, what: &str) -> Option<Vec<Vec3>> {
    let items = list(cx, v, what);
    let read: Vec<_> = items.iter().map(|i| numbers::<3>(cx, i, what, "m")).collect();
    let found: Option<Vec<_>> = read.into_iter().map(|p| p.map(Vec3::from)).collect();
    found.filter(|_| matches!(v.value, Value::List(_)))
}

/// `scale: 0.001`, or one for each axis.
fn scale(cx: &mut Cx, inner: &Located, what: &str) -> Option<Vec3> {
    let what = format!("{what}: `scale`");
    match inner.get("scale") {
        None => Some(Vec3::repeat(1.0)),
        Some(s) if matches!(s.value, Value::List(_)) => {
            numbers::<3>(cx, s, &what, "").map(Vec3::from)
        }
        Some(s) => number(cx, s, &what, "").map(Vec3::repeat),
    }
}

/// The corners of an STL file, in m.
fn corners(
    cx: &mut Cx,
    v: &Located,
    inner: &Located,
    what: &str,
    files: Option<Near<'_>>,
    other: &str,
) -> Option<Vec<Vec3>> {
    let Some(file) = text_field(cx, inner, "file", what) else {
        if inner.get("file").is_none() {
            let help = format!("write `file: \"part.stl\"` or `{other}`");
            cx.fault(v.origin, format!("{what} has neither"), help);
        }
        return None;
    };
    let scale = scale(cx, inner, what)?;
    let Some((files, home)) = files else {
        cx.fault(v.origin, format!("{what} cannot be used here"), "use a plain solid");
        return None;
    };
    let bytes = match files.find(&file.text, home) {
        Ok((key, Home::Folder(_))) => std::fs::read(&key).map_err(|e| e.to_string()),
        Ok((key, Home::Embedded(_))) => {
            Ok(files.embedded.get(&key).map(|t| t.as_bytes().to_vec()).unwrap_or_default())
        }
        Err(_) => {
            let message = format!("{what}: there is no file `{}`", file.text);
            cx.fault(file.origin, message, "give the path relative to this file");
            return None;
        }
    };
    match bytes.and_then(|b| stl::read(&b)) {
        Ok(points) => Some(points.iter().map(|p| p.component_mul(&scale)).collect()),
        Err(why) => {
            let message = format!("{what}: `{}` cannot be read: {why}", file.text);
            cx.fault(file.origin, message, "what collides is an STL file, binary or text");
            None
        }
    }
}

fn mesh(
    cx: &mut Cx,
    v: &Located,
    inner: &Located,
    what: &str,
    files: Option<Near<'_>>,
) -> Option<Shape> {
    let Some(written) = inner.get("vertices") else {
        let other = "vertices: [..], triangles: [..]";
        let vertices = corners(cx, v, inner, what, files, other)?;
        let count = vertices.len() as u32 / 3;
        let triangles = (0..count).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
        return Some(Shape::Mesh { vertices, triangles });
    };
    let vertices = vectors(cx, written, &format!("{what}: `vertices`"));
    let Some(written) = inner.get("triangles") else {
        let help = "write `triangles: [[0, 1, 2], ..]`, counter-clockwise seen from outside";
        cx.fault(v.origin, format!("{what} has no `triangles`"), help);
        return None;
    };
    let at = format!("{what}: `triangles`");
    let mut triangles = Vec::new();
    for item in list(cx, written, &at) {
        let corners = numbers::<3>(cx, item, &at, "")?;
        if corners.iter().any(|c| c.fract() != 0.0 || !(0.0..=f64::from(u32::MAX)).contains(c)) {
            cx.fault(item.origin, format!("{at}: these are no indices"), "count from 0");
            return None;
        }
        triangles.push(corners.map(|c| c as u32));
    }
    Some(Shape::Mesh { vertices: vertices?, triangles })
}

fn height_field(cx: &mut Cx, v: &Located, inner: &Located, what: &str) -> Option<Shape> {
    fields(cx, inner, what, &["rows", "columns", "spacing", "heights"]);
    let help = "write HeightField(spacing: 0.5, heights: [[..], [..]]): rows from low y to high y";
    let (Some(spacing), Some(written)) = (inner.get("spacing"), inner.get("heights")) else {
        cx.fault(v.origin, format!("{what} needs `spacing` and `heights`"), help);
        return None;
    };
    let at = format!("{what}: `spacing`");
    let spacing = match &spacing.value {
        Value::List(_) => numbers::<2>(cx, spacing, &at, "m"),
        _ => number(cx, spacing, &at, "m").map(|s| [s, s]),
    };
    let at = format!("{what}: `heights`");
    let items = list(cx, written, &at);
    let nested = items.iter().any(|i| matches!(i.value, Value::List(_)));
    let mut heights = Vec::new();
    let (mut rows, mut columns) = (items.len(), 0);
    if nested {
        for row in items {
            let row_items = list(cx, row, &at);
            columns = if heights.is_empty() { row_items.len() } else { columns };
            if row_items.len() != columns {
                let message =
                    format!("{at}: a row has {} numbers, the first {columns}", row_items.len());
                cx.fault(row.origin, message, "rows are of one length");
                return None;
            }
            for h in row_items {
                heights.push(number(cx, h, &at, "m")?);
            }
        }
    } else {
        for h in items {
            heights.push(number(cx, h, &at, "m")?);
        }
        let mut count = |field: &str| {
            let n = number(cx, inner.get(field)?, &format!("{what}: `{field}`"), "")?;
            (n.fract() == 0.0 && (2.0..1e9).contains(&n)).then_some(n as usize)
        };
        let (Some(r), Some(c)) = (count("rows"), count("columns")) else {
            cx.fault(v.origin, format!("{what} needs `rows` and `columns`, 2 or more"), help);
            return None;
        };
        (rows, columns) = (r, c);
    }
    let told = [("rows", rows), ("columns", columns)];
    for (field, n) in told.into_iter().filter(|_| nested) {
        let Some(w) = inner.get(field) else { continue };
        if number(cx, w, &format!("{what}: `{field}`"), "").is_some_and(|x| x != n as f64) {
            cx.fault(w.origin, format!("{at} have {n} {field}"), "leave it out");
        }
    }
    Some(Shape::HeightField { x: columns, y: rows, spacing: spacing?, heights })
}

/// The geometry as RON that needs no file, in the frame in which it stands.
pub(crate) fn value(shape: &Shape) -> Value {
    let of = |name: &str, fields: Vec<(&str, Value)>| {
        let fields = fields.into_iter().map(|(k, v)| (k.to_owned(), v.into())).collect();
        value::variant(name, Value::Map(fields))
    };
    let number = Value::Number;
    let all = |v: &[Vec3]| Value::List(v.iter().map(|p| value::vector(p).into()).collect());
    match shape {
        Shape::Sphere { radius } => value::variant("Sphere", number(*radius)),
        Shape::Box { half } => value::variant("Box", value::vector(&(2.0 * half))),
        Shape::Capsule { radius, half_length } => {
            of("Capsule", vec![("radius", number(*radius)), ("length", number(2.0 * half_length))])
        }
        Shape::Cylinder { radius, half_length } => {
            of("Cylinder", vec![("radius", number(*radius)), ("length", number(2.0 * half_length))])
        }
        Shape::HalfSpace => value::variant("HalfSpace", Value::Null),
        Shape::ConvexHull { points } => of("ConvexHull", vec![("points", all(points))]),
        Shape::Mesh { vertices, triangles } => {
            let corners = triangles.iter().map(|t| value::list(t.map(f64::from)).into());
            let triangles = Value::List(corners.collect());
            of("Mesh", vec![("vertices", all(vertices)), ("triangles", triangles)])
        }
        Shape::HeightField { x, spacing, heights, .. } => {
            let rows = heights.chunks((*x).max(1));
            let rows = rows.map(|row| value::list(row.iter().copied()).into()).collect();
            let fields = vec![("spacing", value::list(*spacing)), ("heights", Value::List(rows))];
            of("HeightField", fields)
        }
    }
}
