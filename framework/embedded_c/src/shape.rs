//! Shapes with many points: hulls, meshes, terrain; and coarse shapes.

use crate::builder::{Draft, LwBuilder, LwShape};
use crate::call::calls;
use crate::edge::{LwPose, numbers, value};
use crate::status::Fault;
use linkwork_embedded::Shape;
use linkwork_embedded::spatial::Vec3;

/// # Safety
/// The conditions in the crate documentation apply.
unsafe fn points(what: &'static str, p: *const f64, n: usize) -> Result<Vec<Vec3>, Fault> {
    // SAFETY: the caller has 3 `n` numbers.
    let all = unsafe { numbers(what, p.cast::<[f64; 3]>(), n, n) }?;
    Ok(all.iter().map(|p| Vec3::from(*p)).collect())
}

impl Draft {
    /// Adds a coarse shape to a collider, by name.
    fn coarse(&mut self, name: &str, shape: Shape) -> Result<(), Fault> {
        let found = self.spec.colliders.iter_mut().find(|c| c.name == name);
        let none = || {
            let help =
                "add the collider first, with `lw_builder_shape` or `lw_builder_file_shapes`";
            Fault::Unknown(format!("there is no collider `{name}`\n  help: {help}"))
        };
        found.ok_or_else(none)?.coarse = Some(shape);
        Ok(())
    }
}

calls![
    /// Adds the convex hull of `n` points (3 numbers each, m) that are not all in one plane. `at` and `carrier` as in `lw_builder_shape`.
    fn lw_builder_hull(
        d: &mut LwBuilder,
        name: &str,
        carrier: &str,
        at: *const LwPose,
        points: *const f64,
        n: usize,
    ) {
        let points = self::points("points", points, n)?;
        d.collider(name, carrier, at, Shape::ConvexHull { points })?;
    }
];

/// # Safety
/// The conditions in the crate documentation apply.
unsafe fn mesh(
    (vertices, vertex_count): (*const f64, usize),
    (triangles, triangle_count): (*const u32, usize),
) -> Result<Shape, Fault> {
    // SAFETY: the caller has 3 numbers of each.
    unsafe {
        let vertices = points("vertices", vertices, vertex_count)?;
        let triangles = triangles.cast::<[u32; 3]>();
        let triangles = numbers("triangles", triangles, triangle_count, triangle_count)?.to_vec();
        Ok(Shape::Mesh { vertices, triangles })
    }
}

calls![
    /// Adds a triangle mesh: `vertex_count` corners (3 numbers each, m), and `triangle_count` triangles (3 indices of corners each, from 0,
    /// counter-clockwise seen from outside). Only its outside collides. A convex hull is faster and more robust where it fits. Every robot uses 8 bytes
    /// for each triangle of the largest mesh. `at` and `carrier` as in `lw_builder_shape`.
    fn lw_builder_mesh(
        d: &mut LwBuilder,
        name: &str,
        carrier: &str,
        at: *const LwPose,
        vertices: *const f64,
        vertex_count: usize,
        triangles: *const u32,
        triangle_count: usize,
    ) {
        let shape = mesh((vertices, vertex_count), (triangles, triangle_count))?;
        d.collider(name, carrier, at, shape)?;
    }

    /// Adds terrain: heights (z, m) of `x` by `y` points (at least 2 each) on a grid that is centred on the origin, `spacing` (2 numbers, m) apart along
    /// x and y. It is solid below, without limit. `heights`: `n` = x y numbers, the row of lowest y first; NaN where there is no ground. Memory as in
    /// `lw_builder_mesh`. `at` and `carrier` as in `lw_builder_shape`.
    fn lw_builder_height_field(
        d: &mut LwBuilder,
        name: &str,
        carrier: &str,
        at: *const LwPose,
        x: usize,
        y: usize,
        spacing: *const f64,
        heights: *const f64,
        n: usize,
    ) {
        let spacing = value("spacing", spacing.cast::<[f64; 2]>())?;
        let heights = numbers("heights", heights, n, x.saturating_mul(y))?.into();
        d.collider(name, carrier, at, Shape::HeightField { x, y, spacing, heights })?;
    }

    /// Adds a coarse shape to a collider that was added before, by name, in the same frame, for `LW_DETAIL_COARSE`. It should be simpler than the fine
    /// shape and enclose it.
    fn lw_builder_coarse(d: &mut LwBuilder, name: &str, shape: *const LwShape) {
        let shape = value("shape", shape)?.checked()?;
        d.coarse(name, shape)?;
    }

    /// Like `lw_builder_coarse`, with the convex hull of `n` points (3 numbers each, m) as the coarse shape.
    fn lw_builder_coarse_hull(d: &mut LwBuilder, name: &str, points: *const f64, n: usize) {
        let points = self::points("points", points, n)?;
        d.coarse(name, Shape::ConvexHull { points })?;
    }

    /// Like `lw_builder_coarse`, with a triangle mesh as the coarse shape, as in `lw_builder_mesh`.
    fn lw_builder_coarse_mesh(
        d: &mut LwBuilder,
        name: &str,
        vertices: *const f64,
        vertex_count: usize,
        triangles: *const u32,
        triangle_count: usize,
    ) {
        let shape = mesh((vertices, vertex_count), (triangles, triangle_count))?;
        d.coarse(name, shape)?;
    }

    /// Like `lw_builder_coarse`, with cubes as the coarse shape: a grid of `cells` (3 numbers) cubes along x, y, z from the origin of the frame, with
    /// edge length `edge` (m), of which `n` are occupied; `occupied` has three indices of each, from 0. They do not change: `lw_robot_set_cells` changes
    /// only a collider's fine shape.
    fn lw_builder_coarse_voxel_map(
        d: &mut LwBuilder,
        name: &str,
        cells: *const u32,
        edge: f64,
        occupied: *const u32,
        n: usize,
    ) {
        let cells = value("cells", cells.cast::<[u32; 3]>())?.map(|n| n as usize);
        let occupied = numbers("occupied", occupied.cast::<[u32; 3]>(), n, n)?.to_vec();
        d.coarse(name, Shape::VoxelMap { cells, edge, occupied })?;
    }
];
