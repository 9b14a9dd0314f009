//! Converts a user's shape to the geometry of queries: a convex core with a radius, a half space, or a surface. Reports all faults at once.

use crate::axis::complete;
use crate::contact_points::Most;
use crate::convert::{from_parry, to_parry};
use crate::core::{Core, Face, Poly};
use crate::error::ShapeFault;
use crate::pieces::{Balls, Cells, Pieces};
use crate::shape::Shape;
use crate::surface::{Grid, Surface, Triangles};
use linkwork_multibody::spatial::Vec3;
use parry3d_f64::shape::ConvexPolyhedron;

/// The kinds of geometry.
#[derive(Debug)]
pub(crate) enum Kind {
    /// A convex core; the solid contains all points within `round` of it.
    Convex { core: Core, round: f64 },
    /// The half space z ≤ 0.
    HalfSpace,
    /// Triangles.
    Surface(Surface),
    /// Spheres or cells.
    Pieces(Pieces),
}

impl Most {
    /// Returns the maximum sizes of some solids.
    pub(crate) fn of<'a>(solids: impl Iterator<Item = &'a Solid>) -> Self {
        let mut most = Self::default();
        for solid in solids {
            match &solid.kind {
                Kind::Convex { core, .. } => {
                    if let Core::Poly(p) = core {
                        let longest = p.faces.iter().map(|f| f.len as usize).max();
                        most.corners = most.corners.max(longest.unwrap_or(0));
                    }
                    // Two different solids have at most as many edge products as the larger one has with itself,
                    // so this test is sufficient.
                    most.searched |= !complete(core, core);
                }
                Kind::Surface(s) => most.triangles = most.triangles.max(s.count()),
                Kind::HalfSpace | Kind::Pieces(_) => {}
            }
        }
        most
    }
}

/// A shape prepared for queries.
#[derive(Debug)]
pub(crate) struct Solid {
    /// Its geometry.
    pub kind: Kind,
    /// Lower corner of its bounding box in its own frame, m; infinite for an unbounded shape.
    pub lo: Vec3,
    /// Upper corner of the bounding box, m.
    pub hi: Vec3,
    /// Length for tolerances: the largest extent of a core, m.
    pub size: f64,
}

impl Solid {
    /// Builds the geometry, or returns all faults.
    pub(crate) fn new(shape: &Shape) -> Result<Self, Vec<ShapeFault>> {
        let faults = sizes(shape);
        if !faults.is_empty() {
            return Err(faults);
        }
        let kind = match shape {
            Shape::Sphere { radius } => Kind::Convex { core: Core::Point, round: *radius },
            Shape::Capsule { radius, half_length } => {
                Kind::Convex { core: Core::Segment { h: *half_length }, round: *radius }
            }
            Shape::Cylinder { radius, half_length } => {
                Kind::Convex { core: Core::Cylinder { r: *radius, h: *half_length }, round: 0.0 }
            }
            Shape::Ellipsoid { half } => {
                Kind::Convex { core: Core::Ellipsoid { half: *half }, round: 0.0 }
            }
            Shape::Box { half } => {
                Kind::Convex { core: Core::Poly(Poly::cuboid(*half)), round: 0.0 }
            }
            Shape::HalfSpace => Kind::HalfSpace,
            Shape::ConvexHull { points } => {
                Kind::Convex { core: Core::Poly(hull(points).map_err(|f| vec![f])?), round: 0.0 }
            }
            Shape::Mesh { vertices, triangles } => {
                Kind::Surface(Surface::Mesh(Triangles::new(vertices, triangles)?))
            }
            Shape::HeightField { x, y, spacing, heights } => {
                Kind::Surface(Surface::Grid(Grid::new(*x, *y, *spacing, heights)?))
            }
            Shape::PointCloud { points, room } => {
                Kind::Pieces(Pieces::Balls(Balls::new(points, *room)?))
            }
            Shape::VoxelMap { cells, edge, occupied } => {
                Kind::Pieces(Pieces::Cells(Cells::new(*cells, *edge, occupied)?))
            }
        };
        Ok(Self::around(kind))
    }

    pub(crate) fn around(kind: Kind) -> Self {
        let far = Vec3::repeat(f64::INFINITY);
        let (lo, hi) = match &kind {
            Kind::HalfSpace => (-far, far),
            Kind::Surface(s) => s.bounds(),
            Kind::Pieces(p) => p.bounds(),
            Kind::Convex { core, round } => {
                let axis = |i: usize, sign: f64| {
                    let d = Vec3::ith(i, sign);
                    core.support(&d)[i] + sign * round
                };
                let corner = |sign| Vec3::new(axis(0, sign), axis(1, sign), axis(2, sign));
                (corner(-1.0), corner(1.0))
            }
        };
        let size = match &kind {
            Kind::HalfSpace => 1.0,
            Kind::Surface(s) => s.size(),
            Kind::Pieces(p) => p.size(),
            Kind::Convex { .. } => (hi - lo).max(),
        };
        Self { kind, lo, hi, size }
    }
}

/// Returns the faults of single numbers.
fn sizes(shape: &Shape) -> Vec<ShapeFault> {
    let named: Vec<(&'static str, f64)> = match shape {
        Shape::Sphere { radius } => vec![("radius", *radius)],
        Shape::Capsule { radius, half_length } | Shape::Cylinder { radius, half_length } => {
            vec![("radius", *radius), ("half length", *half_length)]
        }
        Shape::Box { half } => {
            vec![("half edge x", half.x), ("half edge y", half.y), ("half edge z", half.z)]
        }
        Shape::Ellipsoid { half } => {
            vec![("half axis x", half.x), ("half axis y", half.y), ("half axis z", half.z)]
        }
        Shape::HeightField { spacing, .. } => {
            vec![("spacing along x", spacing[0]), ("spacing along y", spacing[1])]
        }
        _ => vec![],
    };
    let good = |v: f64| v > 0.0 && v.is_finite();
    named
        .into_iter()
        .filter(|(_, v)| !good(*v))
        .map(|(what, value)| ShapeFault::Size { what, value })
        .collect()
}

/// Returns the surface of the convex hull of points for drawing: corners, and triangles that are counter-clockwise seen from outside.
///
/// # Errors
/// [`ShapeFault`] for a number that is not finite, or points that do not span a volume.
pub fn hull_surface(points: &[Vec3]) -> Result<(Vec<Vec3>, Vec<[u32; 3]>), ShapeFault> {
    let poly = hull(points)?;
    let fan = |ring: &[u32]| {
        let first = ring[0];
        ring[1..].windows(2).map(move |w| [first, w[0], w[1]]).collect::<Vec<_>>()
    };
    let triangles = poly.faces.iter().flat_map(|f| fan(poly.ring_of(f))).collect();
    Ok((poly.vertices, triangles))
}

/// Computes the hull of points and merges coplanar faces. The result does not depend on the order of the points.
fn hull(points: &[Vec3]) -> Result<Poly, ShapeFault> {
    if let Some(index) = points.iter().position(|p| !p.iter().all(|x| x.is_finite())) {
        return Err(ShapeFault::NotFinite { what: "point", index });
    }
    let flat = ShapeFault::Flat { count: points.len() };
    let mut sorted = points.to_vec();
    sorted.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)).then(a.z.total_cmp(&b.z)));
    sorted.dedup();
    if !spans(&sorted) {
        return Err(flat);
    }
    let list: Vec<_> = sorted.iter().map(to_parry).collect();
    let made = ConvexPolyhedron::from_convex_hull(&list).ok_or(flat)?;
    let mut poly = Poly::default();
    poly.vertices.extend(made.points().iter().map(|p| from_parry(*p)));
    poly.names.extend(0..poly.vertices.len() as u64);
    for f in made.faces() {
        let range = f.first_vertex_or_edge as usize
            ..(f.first_vertex_or_edge + f.num_vertices_or_edges) as usize;
        let start = poly.ring.len() as u32;
        poly.ring.extend(&made.vertices_adj_to_face()[range]);
        poly.faces.push(Face { n: from_parry(f.normal), start, len: f.num_vertices_or_edges });
    }
    for i in 0..poly.faces.len() {
        let f = poly.faces[i];
        poly.faces[i].n = normal(poly.ring_of(&f).iter().map(|i| poly.vertices[*i as usize]));
    }
    let widths = poly.faces.iter().map(|f| {
        let top = f.n.dot(&poly.vertices[poly.ring[f.start as usize] as usize]);
        top - poly.vertices.iter().map(|v| v.dot(&f.n)).fold(f64::INFINITY, f64::min)
    });
    poly.thick = 0.5 * widths.fold(f64::INFINITY, f64::min);
    for i in 0..poly.faces.len() {
        let ring: Vec<u32> = poly.ring_of(&poly.faces[i]).to_vec();
        for k in 0..ring.len() {
            let ends = [ring[k], ring[(k + 1) % ring.len()]].map(|i| poly.vertices[i as usize]);
            let d = (ends[1] - ends[0]).normalize();
            if poly.edges.iter().all(|e| e.cross(&d).norm() > 1e-9) {
                poly.edges.push(d);
            }
        }
    }
    Ok(poly)
}

/// Returns the unit normal of a ring of corners (Newell's method, which uses all corners).
fn normal(ring: impl Iterator<Item = Vec3> + Clone) -> Vec3 {
    let first = ring.clone().next().unwrap_or_default();
    let next = ring.clone().skip(1).chain(std::iter::once(first));
    ring.zip(next).map(|(a, b)| (a - first).cross(&(b - first))).sum::<Vec3>().normalize()
}

/// Returns true if points span a volume, with a margin for round-off.
fn spans(points: &[Vec3]) -> bool {
    let Some(a) = points.first() else { return false };
    let farthest = |measure: &dyn Fn(&Vec3) -> f64| {
        points.iter().fold((*a, 0.0), |best, p| {
            let m = measure(p);
            if m > best.1 { (*p, m) } else { best }
        })
    };
    let (b, length) = farthest(&|p| (p - a).norm());
    let (c, width) = farthest(&|p| (p - a).cross(&(b - a)).norm() / length);
    let n = (b - a).cross(&(c - a)).normalize();
    let (_, height) = farthest(&|p| (p - a).dot(&n).abs());
    width > 1e-9 * length && height > 1e-9 * length
}
