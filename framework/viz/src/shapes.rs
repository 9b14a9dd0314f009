//! Rerun archetypes of the shapes of bodies and grounds, which do not change during a run.
use crate::scene::Shape;
use crate::stream::Wrap;
use linkwork_collision::{Shape as Geometry, VisualShape};
use linkwork_spatial::{Pose, Vec3};
use re_sdk::{EntityPath, RecordingStream};

/// Converts a path to an entity: `Rover.Hardware.Wheels.Wheel1/wheel` → `/Rover/Hardware/Wheels/Wheel1/wheel`.
pub fn entity(path: &str) -> EntityPath {
    let parts: Vec<&str> = path.split(['.', '/']).filter(|p| !p.is_empty()).collect();
    EntityPath::from(parts.into_iter().map(re_sdk::EntityPathPart::from).collect::<Vec<_>>())
}

/// Returns the entity of a shape, below that of its body.
pub fn shape_path(shape: &Shape) -> EntityPath {
    entity(&shape.body).join(&entity(&format!("shapes/{}", shape.name)))
}

pub fn f3(v: &Vec3) -> [f32; 3] {
    [v.x as f32, v.y as f32, v.z as f32]
}

fn transform(pose: &Pose) -> re_sdk_types::archetypes::Transform3D {
    let q = pose.rotation;
    let q = re_sdk_types::datatypes::Quaternion::from_xyzw([
        q.i as f32, q.j as f32, q.k as f32, q.w as f32,
    ]);
    re_sdk_types::archetypes::Transform3D::from_translation_rotation(f3(&pose.position), q)
}

/// Time at which a shape exists.
#[derive(Clone, Copy, PartialEq)]
pub enum When {
    /// Always.
    Always,
    /// From the present time of the recording on.
    FromNow,
}

/// Sends a shape.
pub fn send(rec: &RecordingStream, shape: &Shape, when: When) -> Result<(), Wrap> {
    let fixed = when == When::Always;
    let path = shape_path(shape);
    let fill = re_sdk_types::components::FillMode::Solid;
    let [r, g, b, a] = shape.color;
    let color = re_sdk_types::components::Color::from_unmultiplied_rgba(r, g, b, a);
    match &shape.form {
        VisualShape::Shape(Geometry::Box { half }) => {
            let boxes = re_sdk_types::archetypes::Boxes3D::from_half_sizes([f3(half)]);
            rec.log_with_static(
                path.clone(),
                fixed,
                &boxes.with_fill_mode(fill).with_colors([color]),
            )?;
        }
        VisualShape::Shape(form @ (Geometry::Sphere { .. } | Geometry::Ellipsoid { .. })) => {
            let half = match form {
                Geometry::Ellipsoid { half } => f3(half),
                Geometry::Sphere { radius } => [*radius as f32; 3],
                _ => return Ok(()),
            };
            let ball = re_sdk_types::archetypes::Ellipsoids3D::from_half_sizes([half]);
            rec.log_with_static(
                path.clone(),
                fixed,
                &ball.with_fill_mode(fill).with_colors([color]),
            )?;
        }
        VisualShape::Shape(Geometry::Cylinder { radius, half_length }) => {
            let length = (2.0 * half_length) as f32;
            let body = re_sdk_types::archetypes::Cylinders3D::from_lengths_and_radii(
                [length],
                [*radius as f32],
            );
            rec.log_with_static(
                path.clone(),
                fixed,
                &body.with_fill_mode(fill).with_colors([color]),
            )?;
        }
        VisualShape::Shape(Geometry::Capsule { radius, half_length }) => {
            let length = (2.0 * half_length) as f32;
            let body = re_sdk_types::archetypes::Capsules3D::from_lengths_and_radii(
                [length],
                [*radius as f32],
            )
            .with_translations([[0.0, 0.0, -0.5 * length]]);
            rec.log_with_static(
                path.clone(),
                fixed,
                &body.with_fill_mode(fill).with_colors([color]),
            )?;
        }
        VisualShape::File { .. } => {
            // Mesh files were checked when the simulation was loaded. A file that has changed since then is not shown and does not end the run.
            let Ok(Geometry::Mesh { vertices, triangles }) = linkwork_render::shape_of(&shape.form)
            else {
                return Ok(());
            };
            rec.log_with_static(path.clone(), fixed, &mesh(vertices, triangles, shape.color))?;
        }
        VisualShape::Shape(Geometry::PointCloud { points, .. }) => {
            let centres = points.iter().map(|p| [p[0] as f32, p[1] as f32, p[2] as f32]);
            let drawn = re_sdk_types::archetypes::Points3D::new(centres)
                .with_radii(points.iter().map(|p| p[3] as f32))
                .with_colors([color]);
            rec.log_with_static(path.clone(), fixed, &drawn)?;
        }
        VisualShape::Shape(Geometry::VoxelMap { edge, occupied, .. }) => {
            let centres = occupied.iter().map(|c| c.map(|i| ((f64::from(i) + 0.5) * edge) as f32));
            let half = [(0.5 * edge) as f32; 3];
            let boxes = re_sdk_types::archetypes::Boxes3D::from_centers_and_half_sizes(
                centres,
                occupied.iter().map(|_| half),
            );
            rec.log_with_static(
                path.clone(),
                fixed,
                &boxes.with_fill_mode(fill).with_colors([color]),
            )?;
        }
        VisualShape::Shape(
            form @ (Geometry::Mesh { .. }
            | Geometry::HalfSpace
            | Geometry::ConvexHull { .. }
            | Geometry::HeightField { .. }),
        ) => {
            if let Some((corners, faces)) = linkwork_collision::drawn_surface(form)? {
                rec.log_with_static(path.clone(), fixed, &mesh(corners, faces, shape.color))?;
            }
        }
    }
    rec.log_with_static(path, fixed, &transform(&shape.pose))?;
    Ok(())
}

/// Returns triangles with separate vertices, so that edges are visible.
fn mesh(
    points: Vec<Vec3>,
    faces: Vec<[u32; 3]>,
    [r, g, b, a]: [u8; 4],
) -> re_sdk_types::archetypes::Mesh3D {
    let (mut corners, mut normals) = (Vec::new(), Vec::new());
    for face in &faces {
        let [p, q, s] = face.map(|k| points[k as usize]);
        let n = (q - p).cross(&(s - p));
        let n = n / n.norm().max(f64::MIN_POSITIVE);
        for v in [p, q, s] {
            corners.push(f3(&v));
            normals.push(f3(&n));
        }
    }
    let indices = (0..faces.len() as u32).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]);
    re_sdk_types::archetypes::Mesh3D::new(corners)
        .with_triangle_indices(indices)
        .with_vertex_normals(normals)
        .with_albedo_factor(re_sdk_types::datatypes::Rgba32::from_unmultiplied_rgba(r, g, b, a))
}
