//! Shapes of bodies: visual shapes, collision shapes, and solids for inertias that are computed from the mass.
//!
//! ```text
//! Cylinder(radius: .., length: ..)  Capsule(radius: .., length: ..)  Box([x, y, z])  Sphere(radius)
//! Ellipsoid([a, b, c])                               half axes along x, y, z
//! Mesh(file: ..) | (vertices: [..], triangles: [..]) triangles, counter-clockwise as seen from outside
//! HalfSpace                                          all points with z ≤ 0
//! ConvexHull(points: [..]) | (file: "x.stl")         the convex hull of points or of a mesh's vertices
//! HeightField(spacing: .., heights: [[..], ..])      rows from low y to high y, each along x; centred
//! PointCloud(points: [[x, y, z, r], ..], room: ..)   spheres, which a program can replace at run time
//! VoxelMap(cells: [..], edge: .., occupied: [..])    cubes that begin at the origin; a program can change which are occupied
//! ```
use crate::schema::describe::Schema;
use crate::schema::kind::{
    At, Kind, direction, list_of, mapped, number, numbers, one_or_list, text, vector, whole,
};
use crate::schema::record::{Presence, Record, argument, record, variant_name, variant_of};
use crate::text::files::Home;
use crate::text::report::Cx;
use crate::text::value::{Text, variant};
use linkwork_collision::{Shape, VisualShape};
use linkwork_runtime::{Located, Value};
use linkwork_spatial::{Mat3, Quat, Vec3};
use std::path::Path;

record! {
    struct Round: "cylinder or capsule" {
        /// Radius.
        radius: f64 = number("m").positive().need("write `radius: ..` in m"),
        /// Full length of a cylinder; length of a capsule without its half spheres.
        length: f64 = number("m").positive().need("write `length: ..` in m"),
        /// Axis (default: z).
        axis: Option<Vec3> = direction().maybe(),
    }
}
record! {
    struct Ball: "sphere" {
        /// Radius.
        radius: f64 = number("m").positive().need("write `Sphere(0.1)`"),
    }
}
record! {
    struct Egg: "ellipsoid" {
        /// Half axes along x, y, z.
        radii: [f64; 3] = numbers::<3>("m").need("write `Ellipsoid([0.3, 0.2, 0.1])`: half axes in m"),
    }
}
record! {
    struct Block: "box" {
        /// Full lengths along x, y, z.
        size: [f64; 3] = numbers::<3>("m").need("write `Box([1, 2, 3])`"),
    }
}
record! {
    struct Plain: "half space" {}
}
record! {
    struct Mesh: "mesh" {
        /// STL file, binary or text; for visual shapes any format that the viewer reads.
        file: Option<Text> = text().maybe(),
        /// Scale factor from the file's unit to m, or one along each axis.
        scale: Vec3 = scale().or(Vec3::repeat(1.0)),
        /// Corners.
        vertices: Option<Vec<Vec3>> = list_of(vector("m")).maybe(),
        /// Vertices of each triangle by index from 0, counter-clockwise as seen from outside.
        triangles: Option<Vec<[u32; 3]>> = list_of(corners()).maybe(),
    }
}
record! {
    struct Hull: "convex hull" {
        /// Points in it.
        points: Option<Vec<Vec3>> = list_of(vector("m")).maybe(),
        /// STL file, binary or text.
        file: Option<Text> = text().maybe(),
        /// Scale factor from the file's unit to m, or one along each axis.
        scale: Vec3 = scale().or(Vec3::repeat(1.0)),
    }
}
record! {
    struct Field: "height field" {
        /// Distance of neighbouring points, or the distances along x and y.
        spacing: [f64; 2] = spacing().need(FIELD),
        /// Rows from low y to high y, each along x; or all numbers in one list.
        heights: Vec<Vec<f64>> = rows().need(FIELD),
        /// Number of rows, if all numbers are in one list.
        rows: Option<u32> = whole::<u32>(2, 1_000_000).maybe(),
        /// Number of columns, if all numbers are in one list.
        columns: Option<u32> = whole::<u32>(2, 1_000_000).maybe(),
    }
}

record! {
    struct Cloud: "point cloud" {
        /// x, y, z and radius of each point.
        points: Vec<[f64; 4]> = list_of(numbers::<4>("m")).or(Vec::new()),
        /// Number of points for which memory is allocated; at least the number of given points.
        room: u32 = whole::<u32>(0, 100_000_000).or(0),
    }
}
record! {
    struct Voxels: "voxel map" {
        /// Cells along x, y, z.
        cells: [u32; 3] = corners().need(VOXELS),
        /// Edge of a cell.
        edge: f64 = number("m").positive().need(VOXELS),
        /// Indices of the occupied cells along x, y, z, from 0.
        occupied: Vec<[u32; 3]> = list_of(corners()).or(Vec::new()),
    }
}

const VOXELS: &str = "write VoxelMap(cells: [100, 100, 20], edge: 0.05, occupied: [[0, 0, 0], ..])";
const FIELD: &str =
    "write HeightField(spacing: 0.5, heights: [[..], [..]]): rows from low y to high y";
const SOLIDS: [&str; 5] = ["Cylinder", "Box", "Sphere", "Capsule", "Ellipsoid"];
const SHOWN: [&str; 6] = ["Cylinder", "Box", "Sphere", "Capsule", "Ellipsoid", "Mesh"];
const ALL: [&str; 11] = [
    "Cylinder",
    "Box",
    "Sphere",
    "Capsule",
    "Ellipsoid",
    "Mesh",
    "HalfSpace",
    "ConvexHull",
    "HeightField",
    "PointCloud",
    "VoxelMap",
];

fn scale() -> impl Kind<Of = Vec3> {
    one_or_list(mapped(number(""), Vec3::repeat, |_| None), vector(""))
}

fn spacing() -> impl Kind<Of = [f64; 2]> {
    one_or_list(mapped(number("m"), |s| [s, s], |_| None), numbers::<2>("m"))
}

/// Reads rows of numbers, or one list of all numbers.
fn rows() -> impl Kind<Of = Vec<Vec<f64>>> {
    struct Rows;
    impl Kind for Rows {
        type Of = Vec<Vec<f64>>;
        fn read(&self, cx: &mut Cx, v: &Located, at: &At<'_>) -> Option<Self::Of> {
            let nested = matches!(&v.value, Value::List(items)
                if items.iter().any(|i| matches!(i.value, Value::List(_))));
            match nested {
                true => list_of(list_of(number("m"))).read(cx, v, at),
                false => Some(vec![list_of(number("m")).read(cx, v, at)?]),
            }
        }
        fn write(&self, x: &Self::Of) -> Value {
            list_of(list_of(number("m"))).write(x)
        }
        fn describe(&self) -> Schema {
            let row = list_of(number("m"));
            Schema::Any(vec![row.describe(), list_of(row).describe()])
        }
    }
    Rows
}

/// Reads the vertex indices of a triangle.
fn corners() -> impl Kind<Of = [u32; 3]> {
    struct Corners;
    impl Kind for Corners {
        type Of = [u32; 3];
        fn read(&self, cx: &mut Cx, v: &Located, at: &At<'_>) -> Option<[u32; 3]> {
            let c = numbers::<3>("").read(cx, v, at)?;
            if c.iter().any(|c| c.fract() != 0.0 || !(0.0..=f64::from(u32::MAX)).contains(c)) {
                let message = format!("{}: these are not indices", at.what);
                cx.fault(v.origin, message, "write integers, 0 or larger");
                return None;
            }
            Some(c.map(|c| c as u32))
        }
        fn write(&self, x: &[u32; 3]) -> Value {
            numbers::<3>("").write(&x.map(f64::from))
        }
        fn describe(&self) -> Schema {
            Schema::List(Box::new(whole::<u32>(0, u32::MAX).describe()), Some(3))
        }
    }
    Corners
}

/// Use of a shape.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Use {
    /// Visual: mesh files are not read.
    Visual,
    /// Collision: mesh files are read.
    Collides,
}

/// A shape and the rotation of its z axis.
pub(crate) struct ShapeKind(Use);

/// Returns the reader of a visual shape.
pub(crate) fn seen() -> ShapeKind {
    ShapeKind(Use::Visual)
}

/// Returns the reader of a collision shape.
pub(crate) fn colliding() -> impl Kind<Of = (Shape, Quat)> {
    Geometry(&ALL, Use::Collides)
}

/// Returns the reader of a solid that has an inertia.
pub(crate) fn solid() -> impl Kind<Of = (Shape, Quat)> {
    Geometry(&SOLIDS, Use::Collides)
}

/// Returns true for shapes that can only collide and cannot be shown.
pub(crate) fn only_collides(v: &Located) -> bool {
    match &v.value {
        Value::Variant(kind, inner) if kind == "Mesh" => inner.get("file").is_none(),
        Value::Variant(kind, _) => ALL.contains(&kind.as_str()) && !SHOWN.contains(&kind.as_str()),
        _ => false,
    }
}

impl Kind for ShapeKind {
    type Of = (VisualShape, Quat);
    fn read(&self, cx: &mut Cx, v: &Located, at: &At<'_>) -> Option<(VisualShape, Quat)> {
        let known: &[&str] = if at.near.is_some() { &ALL } else { &SHOWN };
        read(cx, v, at, known, self.0)
    }
    fn write(&self, (shape, _): &(VisualShape, Quat)) -> Value {
        match shape {
            VisualShape::Shape(shape) => value(shape),
            VisualShape::File { file, scale } => {
                let mesh = Mesh {
                    file: Some(Text::new(file)),
                    scale: *scale,
                    vertices: None,
                    triangles: None,
                };
                variant("Mesh", mesh.write())
            }
        }
    }
    fn describe(&self) -> Schema {
        describe(&ALL)
    }
}

/// A shape of one of several kinds with known geometry.
struct Geometry(&'static [&'static str], Use);

impl Kind for Geometry {
    type Of = (Shape, Quat);
    fn read(&self, cx: &mut Cx, v: &Located, at: &At<'_>) -> Option<(Shape, Quat)> {
        match read(cx, v, at, self.0, self.1)? {
            (VisualShape::Shape(shape), turn) => Some((shape, turn)),
            (VisualShape::File { .. }, _) => None,
        }
    }
    fn write(&self, (shape, _): &(Shape, Quat)) -> Value {
        value(shape)
    }
    fn describe(&self) -> Schema {
        describe(self.0)
    }
}

fn describe(kinds: &[&str]) -> Schema {
    let all = [
        ("Cylinder", variant_of::<Round>("Cylinder", "")),
        ("Capsule", variant_of::<Round>("Capsule", "")),
        ("Box", variant_of::<Block>("Box", "size")),
        ("Sphere", variant_of::<Ball>("Sphere", "radius")),
        ("Ellipsoid", variant_of::<Egg>("Ellipsoid", "radii")),
        ("Mesh", variant_of::<Mesh>("Mesh", "")),
        ("HalfSpace", variant_of::<Plain>("HalfSpace", "")),
        ("ConvexHull", variant_of::<Hull>("ConvexHull", "")),
        ("HeightField", variant_of::<Field>("HeightField", "")),
        ("PointCloud", variant_of::<Cloud>("PointCloud", "")),
        ("VoxelMap", variant_of::<Voxels>("VoxelMap", "")),
    ];
    Schema::Any(all.into_iter().filter(|(k, _)| kinds.contains(k)).map(|(_, s)| s).collect())
}

fn read(
    cx: &mut Cx,
    v: &Located,
    at: &At<'_>,
    known: &[&str],
    what_for: Use,
) -> Option<(VisualShape, Quat)> {
    let (kind, inner) = variant_name(cx, v, &at.what, ("shape", "shapes", known))?;
    let at = At { origin: Some(v.origin), ..at.field(kind) };
    let shape = match kind {
        "Cylinder" | "Capsule" => {
            let Round { radius, length, axis } = argument(cx, inner, &at, "")?;
            let half_length = 0.5 * length;
            let shape = match kind {
                "Cylinder" => Shape::Cylinder { radius, half_length },
                _ => Shape::Capsule { radius, half_length },
            };
            return Some((VisualShape::Shape(shape), axis.map_or_else(Quat::identity, turned)));
        }
        "Box" => {
            let Block { size } = argument(cx, inner, &at, "size")?;
            Shape::Box { half: 0.5 * positive(cx, inner, &at, size)? }
        }
        "Ellipsoid" => {
            let Egg { radii } = argument(cx, inner, &at, "radii")?;
            Shape::Ellipsoid { half: positive(cx, inner, &at, radii)? }
        }
        "Sphere" => Shape::Sphere { radius: argument::<Ball>(cx, inner, &at, "radius")?.radius },
        "HalfSpace" => {
            argument::<Plain>(cx, inner, &at, "")?;
            Shape::HalfSpace
        }
        "ConvexHull" => {
            let hull: Hull = argument(cx, inner, &at, "")?;
            let points = match (hull.points, inner.get("points")) {
                (Some(points), _) => points,
                (None, Some(_)) => return None,
                _ => file_corners(cx, hull.file, hull.scale, &at, "points: [[x, y, z], ..]")?,
            };
            Shape::ConvexHull { points }
        }
        "PointCloud" => {
            let Cloud { points, room } = argument(cx, inner, &at, "")?;
            Shape::PointCloud { points, room: room as usize }
        }
        "VoxelMap" => {
            let Voxels { cells, edge, occupied } = argument(cx, inner, &at, "")?;
            Shape::VoxelMap { cells: cells.map(|n| n as usize), edge, occupied }
        }
        "Mesh" => {
            let mesh: Mesh = argument(cx, inner, &at, "")?;
            return Some((mesh_shape(cx, mesh, inner, &at, what_for)?, Quat::identity()));
        }
        _ => {
            let field = argument(cx, inner, &at, "")?;
            height_field(cx, field, inner, &at)?
        }
    };
    Some((VisualShape::Shape(shape), Quat::identity()))
}

/// Returns three lengths, each positive.
fn positive(cx: &mut Cx, inner: &Located, at: &At<'_>, lengths: [f64; 3]) -> Option<Vec3> {
    if lengths.iter().any(|s| *s <= 0.0) {
        let message = format!("{} has a side that is not positive", at.what);
        cx.fault(inner.origin, message, "write positive lengths, in m");
        return None;
    }
    Some(Vec3::from(lengths))
}

/// Returns the rotation of z onto an axis.
fn turned(axis: Vec3) -> Quat {
    let half_turn = Quat::from_axis_angle(&Vec3::x_axis(), std::f64::consts::PI);
    Quat::rotation_between(&Vec3::z(), &axis).unwrap_or(half_turn)
}

fn mesh_shape(
    cx: &mut Cx,
    mesh: Mesh,
    inner: &Located,
    at: &At<'_>,
    what_for: Use,
) -> Option<VisualShape> {
    let here = at.origin.unwrap_or(inner.origin);
    if inner.get("vertices").is_some() || inner.get("triangles").is_some() {
        for (field, there) in
            [("vertices", inner.get("vertices")), ("triangles", inner.get("triangles"))]
        {
            if there.is_none() {
                let help = "write vertices: [[x, y, z], ..] and triangles: [[0, 1, 2], ..], \
                            counter-clockwise seen from outside";
                cx.fault(here, format!("{} lacks `{field}`", at.what), help);
            }
        }
        let (vertices, triangles) = (mesh.vertices?, mesh.triangles?);
        return Some(VisualShape::Shape(Shape::Mesh { vertices, triangles }));
    }
    if what_for == Use::Visual {
        let Some(file) = mesh.file else {
            if inner.get("file").is_none() {
                let message = format!("{} lacks `file`", at.what);
                cx.fault(here, message, "write `file: \"part.stl\"`");
            }
            return None;
        };
        let (files, home) = at.near.or_else(|| nowhere(cx, at))?;
        return match files.data(&file.text, home) {
            Some(file) => Some(VisualShape::File { file, scale: mesh.scale }),
            None => missing(cx, &file, at),
        };
    }
    let other = "vertices: [..], triangles: [..]";
    let vertices = file_corners(cx, mesh.file, mesh.scale, at, other)?;
    let count = vertices.len() as u32 / 3;
    let triangles = (0..count).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
    Some(VisualShape::Shape(Shape::Mesh { vertices, triangles }))
}

fn nowhere<T>(cx: &mut Cx, at: &At<'_>) -> Option<T> {
    let origin = at.origin.unwrap_or(linkwork_runtime::Origin::NONE);
    cx.fault(origin, format!("{} cannot be used here", at.what), "use a plain solid");
    None
}

fn missing<T>(cx: &mut Cx, file: &Text, at: &At<'_>) -> Option<T> {
    let message = format!("{}: there is no file `{}`", at.what, file.text);
    cx.fault(file.origin, message, "give the path relative to this file");
    None
}

/// Reads the vertices of a mesh file, in m.
fn file_corners(
    cx: &mut Cx,
    file: Option<Text>,
    scale: Vec3,
    at: &At<'_>,
    other: &str,
) -> Option<Vec<Vec3>> {
    let Some(file) = file else {
        let origin = at.origin.unwrap_or(linkwork_runtime::Origin::NONE);
        let help = format!("write `file: \"part.stl\"` or `{other}`");
        cx.fault(origin, format!("{} has neither", at.what), help);
        return None;
    };
    let (files, home) = at.near.or_else(|| nowhere(cx, at))?;
    let corners = match files.find(&file.text, home) {
        Ok((key, Home::Folder(_))) => linkwork_formats::mesh_corners(Path::new(&key)),
        Ok((key, Home::Embedded(_))) => {
            let text = files.embedded.get(&key).map(String::as_str).unwrap_or_default();
            linkwork_formats::mesh_corners_of(text.as_bytes(), Path::new(&key))
        }
        Err(_) => return missing(cx, &file, at),
    };
    match corners {
        Ok(points) => Some(points.iter().map(|p| p.component_mul(&scale)).collect()),
        Err(why) => {
            let message = format!("{}: `{}` cannot be read: {why}", at.what, file.text);
            cx.fault(
                file.origin,
                message,
                "collision shapes can be STL, OBJ, COLLADA or glTF files",
            );
            None
        }
    }
}

fn height_field(cx: &mut Cx, f: Field, inner: &Located, at: &At<'_>) -> Option<Shape> {
    let nested = matches!(inner.get("heights").map(|h| &h.value), Some(Value::List(items))
        if items.iter().any(|i| matches!(i.value, Value::List(_))));
    let (rows, columns) = match (nested, f.rows, f.columns) {
        (true, ..) => (f.heights.len(), f.heights.first().map_or(0, Vec::len)),
        (false, Some(rows), Some(columns)) => (rows as usize, columns as usize),
        _ => {
            let message = format!("{} needs `rows` and `columns`, each at least 2", at.what);
            cx.fault(at.origin.unwrap_or(inner.origin), message, FIELD);
            return None;
        }
    };
    let what = format!("{}: `heights`", at.what);
    if let Some(row) = f.heights.iter().find(|row| nested && row.len() != columns) {
        let origin = inner.get("heights").map_or(inner.origin, |h| h.origin);
        let message =
            format!("{what}: a row has {} numbers, but the first has {columns}", row.len());
        cx.fault(origin, message, "all rows must have the same length");
        return None;
    }
    for (field, said, n) in [("rows", f.rows, rows), ("columns", f.columns, columns)] {
        if let (true, Some(said), Some(v)) = (nested, said, inner.get(field))
            && said as usize != n
        {
            cx.fault(v.origin, format!("{what} have {n} {field}"), "remove it");
        }
    }
    let heights = f.heights.concat().into();
    Some(Shape::HeightField { x: columns, y: rows, spacing: f.spacing, heights })
}

/// Returns the geometry as RON that does not need a file, in its own frame.
pub(crate) fn value(shape: &Shape) -> Value {
    match shape {
        Shape::Sphere { radius } => variant("Sphere", Value::Number(*radius)),
        Shape::Box { half } => variant("Box", crate::text::value::vector(&(2.0 * half))),
        Shape::Ellipsoid { half } => variant("Ellipsoid", crate::text::value::vector(half)),
        Shape::Capsule { radius, half_length } => variant(
            "Capsule",
            Round { radius: *radius, length: 2.0 * half_length, axis: None }.write(),
        ),
        Shape::Cylinder { radius, half_length } => variant(
            "Cylinder",
            Round { radius: *radius, length: 2.0 * half_length, axis: None }.write(),
        ),
        Shape::HalfSpace => variant("HalfSpace", Value::Null),
        Shape::ConvexHull { points } => {
            let points = Some(points.clone());
            variant("ConvexHull", Hull { points, file: None, scale: Vec3::repeat(1.0) }.write())
        }
        Shape::Mesh { vertices, triangles } => {
            let mesh = Mesh {
                file: None,
                scale: Vec3::repeat(1.0),
                vertices: Some(vertices.clone()),
                triangles: Some(triangles.clone()),
            };
            variant("Mesh", mesh.write())
        }
        Shape::HeightField { x, spacing, heights, .. } => {
            let heights = heights.chunks((*x).max(1)).map(<[f64]>::to_vec).collect();
            let field = Field { spacing: *spacing, heights, rows: None, columns: None };
            variant("HeightField", field.write())
        }
        Shape::PointCloud { points, room } => {
            let cloud = Cloud { points: points.clone(), room: *room as u32 };
            variant("PointCloud", cloud.write())
        }
        Shape::VoxelMap { cells, edge, occupied } => {
            let cells = cells.map(|n| n as u32);
            let map = Voxels { cells, edge: *edge, occupied: occupied.clone() };
            variant("VoxelMap", map.write())
        }
    }
}

/// Computes the inertia of a homogeneous solid about its centre, body axes; `None` for shapes without volume.
pub(crate) fn inertia(mass: f64, shape: &Shape, turn: &Quat) -> Option<Mat3> {
    let diagonal = match *shape {
        Shape::Cylinder { radius: r, half_length } => {
            let l = 2.0 * half_length;
            let x = mass * (3.0 * r * r + l * l) / 12.0;
            Vec3::new(x, x, 0.5 * mass * r * r)
        }
        Shape::Box { half } => {
            let [a, b, c]: [f64; 3] = (2.0 * half).into();
            Vec3::new(b * b + c * c, a * a + c * c, a * a + b * b) * (mass / 12.0)
        }
        Shape::Sphere { radius: r } => Vec3::repeat(0.4 * mass * r * r),
        Shape::Ellipsoid { half } => {
            let [a, b, c] = [half.x * half.x, half.y * half.y, half.z * half.z];
            Vec3::new(b + c, a + c, a + b) * (mass / 5.0)
        }
        Shape::Capsule { radius: r, half_length } => {
            // The solid is a cylinder and two half spheres, whose centres of mass are at the
            // distance l/2 + 3r/8.
            let l = 2.0 * half_length;
            let (vc, vs) = (l, 4.0 / 3.0 * r);
            let (mc, ms) = (mass * vc / (vc + vs), mass * vs / (vc + vs));
            let x = mc * (3.0 * r * r + l * l) / 12.0
                + ms * (0.4 * r * r + 0.25 * l * l + 0.375 * r * l);
            Vec3::new(x, x, mc * 0.5 * r * r + ms * 0.4 * r * r)
        }
        _ => return None,
    };
    let R = turn.to_rotation_matrix();
    Some(R.matrix() * Mat3::from_diagonal(&diagonal) * R.matrix().transpose())
}
