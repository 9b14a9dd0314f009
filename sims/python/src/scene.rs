//! The shapes of bodies, for `show`: what `_show.py` of the package hands to Rerun.
use crate::array::{out1, out2};
use linkwork_assembly::BodyShape as Shown;
use linkwork_collision::{Seen, Shape, hull_surface};
use linkwork_formats::{BodyShape, Description, Geometry, ShapeRole};
use linkwork_spatial::{Pose, Vec3};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

/// Edge of the piece that is drawn of a plane without end, m.
const PIECE: f64 = 10.0;

/// What a shape is, in the words of `_show.py`.
enum Form {
    /// Kind and whole lengths or radii, m.
    Solid(&'static str, Vec<f64>),
    /// Corners and triangles.
    Surface(Vec<Vec3>, Vec<[u32; 3]>),
    /// Balls: centres with radii.
    Points(Vec<[f64; 4]>),
    /// A mesh file with factors to m.
    File(String, [f64; 3]),
}

/// A shape on a body.
pub struct Drawn {
    body: String,
    name: String,
    pose: Pose,
    color: Option<[f64; 4]>,
    form: Form,
}

/// Of a URDF, MJCF or SDF file: what is to be seen; what collides, where nothing is.
pub fn of_description(d: &Description) -> Vec<Drawn> {
    let seen = d.shapes.iter().any(|s| s.role == ShapeRole::Visual);
    let role = if seen { ShapeRole::Visual } else { ShapeRole::Collision };
    let drawn = |(k, s): (usize, &BodyShape)| Drawn {
        body: s.body.clone(),
        name: if s.name.is_empty() { k.to_string() } else { s.name.clone() },
        pose: s.pose,
        color: s.color,
        form: of_geometry(&s.geometry),
    };
    d.shapes.iter().enumerate().filter(|(_, s)| s.role == role).map(drawn).collect()
}

/// Of a file in RON.
pub fn of_simulation(shapes: &[Shown]) -> Vec<Drawn> {
    let drawn = |s: &Shown| Drawn {
        body: s.body.clone(),
        name: s.name.clone(),
        pose: s.pose,
        color: s.color,
        form: match &s.shape {
            Seen::Shape(shape) => of_shape(shape),
            Seen::File { file, scale } => Form::File(file.clone(), [scale.x, scale.y, scale.z]),
        },
    };
    shapes.iter().map(drawn).collect()
}

fn of_geometry(g: &Geometry) -> Form {
    match g {
        Geometry::Box { size } => Form::Solid("box", size.to_vec()),
        Geometry::Sphere { radius } => Form::Solid("ellipsoid", vec![*radius; 3]),
        Geometry::Ellipsoid { radii } => Form::Solid("ellipsoid", radii.to_vec()),
        Geometry::Cylinder { radius, length } => Form::Solid("cylinder", vec![*radius, *length]),
        Geometry::Capsule { radius, length } => Form::Solid("capsule", vec![*radius, *length]),
        Geometry::Plane { size: [x, y] } => plane(*x, *y),
        Geometry::Mesh { file, path, scale } => {
            let found = path.as_ref().map_or(file.clone(), |p| p.display().to_string());
            Form::File(found, *scale)
        }
    }
}

fn of_shape(shape: &Shape) -> Form {
    match shape {
        Shape::Sphere { radius } => Form::Solid("ellipsoid", vec![*radius; 3]),
        Shape::Box { half } => Form::Solid("box", (half * 2.0).as_slice().to_vec()),
        Shape::Capsule { radius, half_length } => {
            Form::Solid("capsule", vec![*radius, 2.0 * half_length])
        }
        Shape::Cylinder { radius, half_length } => {
            Form::Solid("cylinder", vec![*radius, 2.0 * half_length])
        }
        Shape::HalfSpace => plane(0.0, 0.0),
        Shape::ConvexHull { points } => match hull_surface(points) {
            Ok((corners, faces)) => Form::Surface(corners, faces),
            // Of points in one plane there is no hull.
            Err(_) => Form::Points(points.iter().map(|p| [p.x, p.y, p.z, 0.0]).collect()),
        },
        Shape::Mesh { vertices, triangles } => Form::Surface(vertices.clone(), triangles.clone()),
        Shape::HeightField { x, y, spacing, heights } => field(*x, *y, *spacing, heights),
        Shape::PointCloud { points, .. } => Form::Points(points.clone()),
        Shape::VoxelMap { edge, occupied, .. } => {
            let middle = |i: u32| (f64::from(i) + 0.5) * edge;
            let ball = |[x, y, z]: &[u32; 3]| [middle(*x), middle(*y), middle(*z), 0.5 * edge];
            Form::Points(occupied.iter().map(ball).collect())
        }
    }
}

/// 0 is without end.
fn plane(x: f64, y: f64) -> Form {
    let half = |size: f64| 0.5 * if size > 0.0 { size } else { PIECE };
    let (x, y) = (half(x), half(y));
    let corners = [[-x, -y], [x, -y], [x, y], [-x, y]].map(|[x, y]| Vec3::new(x, y, 0.0));
    Form::Surface(corners.to_vec(), vec![[0, 1, 2], [0, 2, 3]])
}

/// The triangles over a grid about the origin, without those that have a corner where there is no ground.
fn field(x: usize, y: usize, spacing: [f64; 2], heights: &[f64]) -> Form {
    let at = |k: usize, n: usize, d: f64| (k as f64 - 0.5 * (n - 1) as f64) * d;
    let nodes = (0..y).flat_map(|j| (0..x).map(move |i| (i, j)));
    let z = |i: usize, j: usize| heights.get(j * x + i).copied().unwrap_or(f64::NAN);
    let corner = |(i, j)| Vec3::new(at(i, x, spacing[0]), at(j, y, spacing[1]), z(i, j));
    let corners: Vec<Vec3> = nodes.map(corner).collect();
    let width = x as u32;
    let cells = (0..y.saturating_sub(1) as u32)
        .flat_map(|j| (0..width.saturating_sub(1)).map(move |i| j * width + i));
    let faces = cells.flat_map(|p| [[p, p + 1, p + width + 1], [p, p + width + 1, p + width]]);
    let there = |face: &[u32; 3]| face.iter().all(|k| corners[*k as usize].z.is_finite());
    let faces = faces.filter(there).collect();
    // What no triangle uses may be anywhere.
    let corners = corners.iter().map(|p| if p.z.is_finite() { *p } else { Vec3::zeros() });
    Form::Surface(corners.collect(), faces)
}

/// As dictionaries: `body`, `name`, `pose` [p, x y z w], `color`, `kind` and what the kind needs.
pub fn list<'py>(py: Python<'py>, shapes: &[Drawn]) -> PyResult<Bound<'py, PyList>> {
    let all = PyList::empty(py);
    for s in shapes {
        let one = PyDict::new(py);
        one.set_item("body", &s.body)?;
        one.set_item("name", &s.name)?;
        let (p, r) = (s.pose.position, s.pose.rotation);
        one.set_item("pose", out1(py, vec![p.x, p.y, p.z, r.i, r.j, r.k, r.w]))?;
        one.set_item("color", s.color.map(|c| c.to_vec()))?;
        match &s.form {
            Form::Solid(kind, size) => {
                one.set_item("kind", kind)?;
                one.set_item("size", size)?;
            }
            Form::Surface(corners, triangles) => {
                one.set_item("kind", "surface")?;
                let flat: Vec<f64> = corners.iter().flat_map(|p| [p.x, p.y, p.z]).collect();
                one.set_item("corners", out2(py, flat, corners.len(), 3)?)?;
                let triangles: Vec<Vec<u32>> = triangles.iter().map(|t| t.to_vec()).collect();
                one.set_item("triangles", triangles)?;
            }
            Form::Points(points) => {
                one.set_item("kind", "points")?;
                let flat: Vec<f64> = points.iter().flatten().copied().collect();
                one.set_item("points", out2(py, flat, points.len(), 4)?)?;
            }
            Form::File(file, scale) => {
                one.set_item("kind", "file")?;
                one.set_item("file", file)?;
                one.set_item("scale", scale.to_vec())?;
            }
        }
        all.append(one)?;
    }
    Ok(all)
}

/// The module of this package that draws.
pub fn drawing(py: Python<'_>) -> PyResult<Bound<'_, PyModule>> {
    let module = crate::package::module();
    let package = module.rsplit_once('.').map_or(module, |(package, _)| package);
    py.import(format!("{package}._show"))
}
