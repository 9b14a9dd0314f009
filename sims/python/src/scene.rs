//! The shapes of bodies for `show`. `_show.py` of the package passes them to Rerun.
use crate::array::{out1, out2};
use crate::core::Core;
use linkwork_assembly::BodyShape as Shown;
use linkwork_collision::{
    Shape, Triangles, VisualShape, box_of_inertia, drawn_plane, drawn_surface,
};
use linkwork_formats::{BodyShape, Geometry, ShapeRole};
use linkwork_multibody::Body;
use linkwork_spatial::{Pose, Vec3};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

/// The kind of a shape, as `_show.py` names it.
enum Form {
    /// Kind and full lengths or radii, m.
    Solid(&'static str, Vec<f64>),
    Surface(Triangles),
    /// Spheres: centres and radii.
    Points(Vec<[f64; 4]>),
    /// A mesh file and scale factors to m.
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

/// Returns the shapes of a mechanism. For a URDF, MJCF or SDF file: the visual shapes, or the collision shapes of bodies without visual shapes. For a
/// RON file: its shapes. Without any shapes: boxes with the inertia of the bodies.
pub fn of(core: &Core) -> Vec<Drawn> {
    let own = match &core.description {
        Some(d) => {
            let seen = d.shapes.iter().any(|s| s.role == ShapeRole::Visual);
            let role = if seen { ShapeRole::Visual } else { ShapeRole::Collision };
            let of_role = d.shapes.iter().enumerate().filter(|(_, s)| s.role == role);
            of_role.map(|(k, s)| of_file(k, s)).collect()
        }
        None => core.shapes.iter().map(of_simulation).collect::<Vec<_>>(),
    };
    if own.is_empty() { boxes(core) } else { own }
}

fn of_file(k: usize, s: &BodyShape) -> Drawn {
    Drawn {
        body: s.body.clone(),
        name: if s.name.is_empty() { k.to_string() } else { s.name.clone() },
        pose: s.pose,
        color: s.color,
        form: of_geometry(&s.geometry),
    }
}

fn of_simulation(s: &Shown) -> Drawn {
    Drawn {
        body: s.body.clone(),
        name: s.name.clone(),
        pose: s.pose,
        color: s.color,
        form: match &s.shape {
            VisualShape::Shape(shape) => of_shape(shape),
            VisualShape::File { file, scale } => mesh_file(file, [scale.x, scale.y, scale.z]),
        },
    }
}

fn boxes(core: &Core) -> Vec<Drawn> {
    let box_of = |body: &Body| {
        let (pose, shape) = box_of_inertia(body.mass_properties())?;
        let (body, name) = (body.name().to_string(), "inertia".to_string());
        Some(Drawn { body, name, pose, color: None, form: of_shape(&shape) })
    };
    core.mbs.bodies().iter().filter_map(box_of).collect()
}

fn of_geometry(g: &Geometry) -> Form {
    match g {
        Geometry::Box { size } => Form::Solid("box", size.to_vec()),
        Geometry::Sphere { radius } => Form::Solid("ellipsoid", vec![*radius; 3]),
        Geometry::Ellipsoid { radii } => Form::Solid("ellipsoid", radii.to_vec()),
        Geometry::Cylinder { radius, length } => Form::Solid("cylinder", vec![*radius, *length]),
        Geometry::Capsule { radius, length } => Form::Solid("capsule", vec![*radius, *length]),
        Geometry::Plane { size: [x, y] } => Form::Surface(drawn_plane([*x, *y])),
        Geometry::HeightField { columns, spacing, heights } => {
            let shape = Shape::HeightField {
                x: *columns,
                y: heights.len() / columns.max(&1),
                spacing: *spacing,
                heights: heights.as_slice().into(),
            };
            of_shape(&shape)
        }
        Geometry::Mesh { file, path, scale } => {
            let found = path.as_ref().map_or(file.clone(), |p| p.display().to_string());
            mesh_file(&found, *scale)
        }
    }
}

/// Returns a mesh file. Rerun would show a glTF file with its y axis up, so the vertices of glTF files are returned in the axes of the link instead.
fn mesh_file(file: &str, scale: [f64; 3]) -> Form {
    let ending = file.to_ascii_lowercase();
    if (ending.ends_with(".glb") || ending.ends_with(".gltf"))
        && let Ok(corners) = linkwork_formats::mesh_corners(std::path::Path::new(file))
    {
        let scale = Vec3::from(scale);
        let count = corners.len() as u32 / 3;
        let triangles = (0..count).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
        return Form::Surface((
            corners.iter().map(|p| p.component_mul(&scale)).collect(),
            triangles,
        ));
    }
    Form::File(file.into(), scale)
}

fn of_shape(shape: &Shape) -> Form {
    match shape {
        Shape::Sphere { radius } => Form::Solid("ellipsoid", vec![*radius; 3]),
        Shape::Ellipsoid { half } => Form::Solid("ellipsoid", half.as_slice().to_vec()),
        Shape::Box { half } => Form::Solid("box", (half * 2.0).as_slice().to_vec()),
        Shape::Capsule { radius, half_length } => {
            Form::Solid("capsule", vec![*radius, 2.0 * half_length])
        }
        Shape::Cylinder { radius, half_length } => {
            Form::Solid("cylinder", vec![*radius, 2.0 * half_length])
        }
        Shape::PointCloud { points, .. } => Form::Points(points.clone()),
        Shape::VoxelMap { edge, occupied, .. } => {
            let middle = |i: u32| (f64::from(i) + 0.5) * edge;
            let ball = |[x, y, z]: &[u32; 3]| [middle(*x), middle(*y), middle(*z), 0.5 * edge];
            Form::Points(occupied.iter().map(ball).collect())
        }
        Shape::HalfSpace
        | Shape::ConvexHull { .. }
        | Shape::Mesh { .. }
        | Shape::HeightField { .. } => match (drawn_surface(shape), shape) {
            (Ok(Some(surface)), _) => Form::Surface(surface),
            // Coplanar points do not have a convex hull.
            (_, Shape::ConvexHull { points }) => {
                Form::Points(points.iter().map(|p| [p.x, p.y, p.z, 0.0]).collect())
            }
            _ => Form::Points(Vec::new()),
        },
    }
}

/// Converts shapes to dictionaries: `body`, `name`, `pose` [p, x y z w], `color`, `kind` and the data of the kind.
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
            Form::Surface((corners, triangles)) => {
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

/// Returns the Python module that draws.
pub fn drawing(py: Python<'_>) -> PyResult<Bound<'_, PyModule>> {
    let module = crate::package::module();
    let package = module.rsplit_once('.').map_or(module, |(package, _)| package);
    py.import(format!("{package}._show"))
}
