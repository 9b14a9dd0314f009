//! Shapes for viewers: triangle surfaces, and boxes for bodies without a shape.

use crate::error::ShapeFault;
use crate::shape::Shape;
use crate::solid::hull_surface;
use linkwork_multibody::spatial::{MassProperties, Pose, Vec3, quat};

/// Corners (m, in the frame of the shape) and triangles, counter-clockwise seen from outside.
pub type Triangles = (Vec<Vec3>, Vec<[u32; 3]>);

/// Edge of the drawn part of a half space, m.
const PIECE: f64 = 40.0;

/// Maximum number of points along an edge of a drawn height field.
const NODES: usize = 512;

/// Edge of the cube that represents a point mass, m.
const POINT: f64 = 0.1;

/// Returns the surface of a shape that is drawn as triangles: hull, mesh, height field (coarsened if it is large, with its holes), and a part of a
/// half space. Returns `None` for shapes that a viewer draws itself: sphere, ellipsoid, box, capsule, cylinder, and the spheres and cubes of clouds
/// and voxel maps.
///
/// # Errors
/// [`ShapeFault`] if the points of a hull do not span a volume.
pub fn drawn_surface(shape: &Shape) -> Result<Option<Triangles>, ShapeFault> {
    Ok(Some(match shape {
        Shape::ConvexHull { points } => hull_surface(points)?,
        Shape::Mesh { vertices, triangles } => (vertices.clone(), triangles.clone()),
        Shape::HalfSpace => rectangle([PIECE; 2]),
        Shape::HeightField { x, y, spacing, heights } => field([*x, *y], *spacing, heights),
        Shape::Sphere { .. }
        | Shape::Ellipsoid { .. }
        | Shape::Box { .. }
        | Shape::Capsule { .. }
        | Shape::Cylinder { .. }
        | Shape::PointCloud { .. }
        | Shape::VoxelMap { .. } => return Ok(None),
    }))
}

/// Returns the drawn part of a plane z = 0 about the origin; `edges` along x and y in m, 0 for an unbounded plane.
pub fn drawn_plane(edges: [f64; 2]) -> Triangles {
    rectangle(edges.map(|e| if e > 0.0 { e } else { PIECE }))
}

fn rectangle([x, y]: [f64; 2]) -> Triangles {
    let corner = |[a, b]: [f64; 2]| Vec3::new(0.5 * a * x, 0.5 * b * y, 0.0);
    let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(corner);
    (corners.to_vec(), vec![[0, 1, 2], [0, 2, 3]])
}

/// Returns a height field with the triangulation of the collision queries, without triangles that have a corner without data.
fn field([x, y]: [usize; 2], spacing: [f64; 2], heights: &[f64]) -> Triangles {
    let kept = |n: usize| {
        let mut k: Vec<usize> = (0..n).step_by(n.div_ceil(NODES).max(1)).collect();
        if k.last() != Some(&(n - 1)) {
            k.push(n - 1);
        }
        k
    };
    let (xs, ys) = (kept(x), kept(y));
    let at = |k: usize, n: usize, d: f64| (k as f64 - 0.5 * (n - 1) as f64) * d;
    let nodes = ys.iter().flat_map(|&j| xs.iter().map(move |&i| (i, j)));
    let corner = |(i, j)| Vec3::new(at(i, x, spacing[0]), at(j, y, spacing[1]), heights[j * x + i]);
    let mut corners: Vec<Vec3> = nodes.map(corner).collect();
    let w = xs.len() as u32;
    let there = |f: &[u32; 3]| f.iter().all(|k| corners[*k as usize].z.is_finite());
    let faces = (0..ys.len() as u32 - 1)
        .flat_map(|j| (0..w - 1).map(move |i| j * w + i))
        .flat_map(|p| [[p, p + 1, p + w + 1], [p, p + w + 1, p + w]])
        .filter(there)
        .collect();
    // Viewers do not accept NaN, even in points that no triangle uses.
    for p in corners.iter_mut().filter(|p| !p.z.is_finite()) {
        p.z = 0.0;
    }
    (corners, faces)
}

/// Returns, for a body without a shape, the solid box of uniform density that has its mass and inertia, with its pose in the body's frame; `None` for
/// a body without mass. Each edge is at least a fiftieth of the longest one; a point mass becomes a cube.
pub fn box_of_inertia(mass: &MassProperties) -> Option<(Pose, Shape)> {
    if !(mass.mass > 0.0) {
        return None;
    }
    // The principal moments of a box with edges a, b, c are I_a = m (b² + c²) / 12.
    let principal = mass.inertia_com.symmetric_eigen();
    let moments = principal.eigenvalues;
    let squares = moments.map(|m| 6.0 / mass.mass * (moments.sum() - 2.0 * m));
    let edges = squares.map(|s| s.max(0.0).sqrt());
    let longest = if edges.max() > 0.0 { edges.max() } else { POINT };
    let mut axes = principal.eigenvectors;
    if axes.determinant() < 0.0 {
        axes.set_column(2, &-axes.column(2));
    }
    let half = 0.5 * edges.map(|e| e.max(0.02 * longest));
    let half = if edges.max() > 0.0 { half } else { Vec3::repeat(0.5 * POINT) };
    Some((Pose::new(quat(&axes), mass.com), Shape::Box { half }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use linkwork_multibody::spatial::{Mat3, Quat};

    #[test]
    fn a_height_field_has_its_heights_where_they_are() {
        let heights = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0];
        let (points, faces) = field([3, 2], [0.5, 2.0], &heights);
        assert_eq!(points[0], Vec3::new(-0.5, -1.0, 0.0));
        assert_eq!(points[5], Vec3::new(0.5, 1.0, 5.0));
        assert_eq!(faces.len(), 4);
        for f in &faces {
            let [p, q, s] = f.map(|k| points[k as usize]);
            assert!((q - p).cross(&(s - p)).z > 0.0, "{f:?} looks down");
        }
        // A large field is coarsened and keeps its corners.
        let n = 3000;
        let (points, faces) = field([n, 2], [1.0, 1.0], &vec![0.0; 2 * n]);
        assert!(faces.len() < 2 * 2 * NODES);
        assert_eq!(points[0].x, -0.5 * (n - 1) as f64);
        assert_eq!(points.last().unwrap().x, 0.5 * (n - 1) as f64);
    }

    #[test]
    fn a_height_field_keeps_its_holes() {
        let mut heights = [0.5; 9];
        heights[0] = f64::NAN;
        let (points, faces) = field([3, 3], [1.0, 1.0], &heights);
        // Two of the eight triangles use the first corner.
        assert_eq!(faces.len(), 6);
        assert!(faces.iter().flatten().all(|k| *k != 0));
        assert!(points.iter().all(|p| p.z.is_finite()));
    }

    /// Edges 0.3, 0.5, 0.9 m and 7 kg, rotated and displaced: the box is recovered from its mass and inertia.
    #[test]
    fn the_box_of_an_inertia_has_that_inertia() {
        let edges = Vec3::new(0.3, 0.5, 0.9);
        let moments_of = |e: &Vec3| {
            let squares = e.component_mul(e);
            squares.map(|s| 7.0 / 12.0 * (squares.sum() - s))
        };
        let turn = *Quat::from_euler_angles(0.3, -0.8, 1.1).to_rotation_matrix().matrix();
        let com = Vec3::new(0.1, -0.2, 0.4);
        let inertia = turn * Mat3::from_diagonal(&moments_of(&edges)) * turn.transpose();
        let (pose, shape) = box_of_inertia(&MassProperties::new(7.0, com, inertia)).unwrap();
        let Shape::Box { half } = shape else { panic!("{shape:?}") };
        assert_eq!(pose.position, com);
        let axes = *pose.rotation.to_rotation_matrix().matrix();
        let own = moments_of(&(2.0 * half));
        let found = axes * Mat3::from_diagonal(&own) * axes.transpose();
        assert!((found - inertia).norm() < 1e-12, "{found}");
        // A point mass is drawn, a body without mass is not.
        let point = MassProperties::new(1.0, Vec3::x(), Mat3::zeros());
        let (_, shape) = box_of_inertia(&point).unwrap();
        assert_eq!(shape, Shape::Box { half: Vec3::repeat(0.05) });
        assert!(box_of_inertia(&MassProperties::default()).is_none());
    }
}
