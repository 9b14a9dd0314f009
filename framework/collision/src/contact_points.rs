//! Contact points of a pair, and memory for them.
use crate::axis::{self, Nearest};
use crate::core::{Core, Corner, Placed, Poly, mix};
use linkwork_multibody::spatial::{Pose, Quat, Vec3};
use parry3d_f64::query::epa::EPA;
use parry3d_f64::query::gjk::VoronoiSimplex;

/// A contact point of two cores, in the frame of the pair.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Point {
    /// Position on A, m.
    pub pa: Vec3,
    /// Position on B, m.
    pub pb: Vec3,
    /// Unit normal from A to B.
    pub n: Vec3,
    /// Gap, m.
    pub gap: f64,
    /// Name of the point.
    pub name: u64,
}

impl Point {
    /// Converts a point from the frame of the second core to the frame of the first, with both roles exchanged; `X_AB` is the pose of the second core
    /// in the frame of the first.
    pub(crate) fn swapped(&self, X_AB: &Pose) -> Self {
        Self {
            pa: X_AB.transform_point(&self.pb),
            pb: X_AB.transform_point(&self.pa),
            n: -X_AB.transform_vector(&self.n),
            ..*self
        }
    }
}

/// Work memory for one pair at a time.
pub(crate) struct Room {
    pub(crate) fa: Vec<Corner>,
    pub(crate) fb: Vec<Corner>,
    pub(crate) cut: Vec<Cut>,
    pub(crate) next: Vec<Cut>,
    /// Corners of one part.
    pub corners: Vec<Corner>,
    pub simplex: VoronoiSimplex,
    pub(crate) epa: EPA,
    /// Points of the pair.
    pub points: Vec<Point>,
    /// Points of several discs.
    pub gathered: Vec<Point>,
    /// Points of several pieces.
    pub kept: Vec<Point>,
    /// A triangle.
    pub triangle: Core,
    /// A second triangle.
    pub second: Core,
    /// Largest distance, m, behind a triangle of a mesh at which a core still belongs to it.
    pub behind: f64,
    /// Indices of triangles.
    pub list: Vec<u32>,
    /// More indices of triangles.
    pub others: Vec<u32>,
}

impl Default for Room {
    fn default() -> Self {
        Self::new(&Most::default())
    }
}

/// Maximum sizes of the geometry, which determine the memory.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Most {
    /// Corners of a face.
    pub corners: usize,
    /// Triangles of a surface.
    pub triangles: usize,
    /// Whether the penetration depth may have to be searched for.
    pub searched: bool,
}

impl Room {
    /// Reserves memory for faces and surfaces of this size. [`Want::Least`](crate::pairs::Want::Least) never needs more.
    pub fn new(most: &Most) -> Self {
        let corners = most.corners.max(64);
        let triangles = most.triangles.max(256);
        // Each clipping plane adds one corner, and because of the slack sometimes another.
        let cut = 4 * corners;
        let mut room = Self {
            fa: Vec::with_capacity(corners),
            fb: Vec::with_capacity(corners),
            cut: Vec::with_capacity(cut),
            next: Vec::with_capacity(cut),
            corners: Vec::with_capacity(corners),
            simplex: VoronoiSimplex::new(),
            epa: EPA::new(),
            points: Vec::with_capacity(2 * cut),
            gathered: Vec::with_capacity(256),
            kept: Vec::with_capacity(2 * cut),
            triangle: Core::Poly(Poly::of_triangle()),
            second: Core::Poly(Poly::of_triangle()),
            behind: 0.0,
            list: Vec::with_capacity(triangles),
            others: Vec::with_capacity(triangles),
        };
        if most.searched {
            room.reserve_depth();
        }
        room
    }

    /// Reserves the memory of the penetration-depth search. It grows with the faces that its steps (at most 100) create, and doubles when it is full.
    /// Pairs with nearly the same axis need most. The largest of 53 000 overlaps of many kinds fits into what these need.
    fn reserve_depth(&mut self) {
        let (axle, disc) = (Core::Segment { h: 1.0 }, Core::Cylinder { r: 1.0, h: 0.05 });
        let a = Placed::here(&axle);
        for (turn, p) in [
            (Vec3::new(1.7e-3, -1.4e-3, 2.7e-3), Vec3::new(-4.6e-4, 3.4e-4, 5.7e-4)),
            (Vec3::new(-2.2e-4, 1.9e-3, 2.8e-3), Vec3::new(3.7e-4, 6.0e-4, 5.7e-9)),
            (Vec3::new(2.6e-3, 1.7e-5, 2.4e-3), Vec3::new(2.0e-4, 3.1e-4, -5.8e-4)),
        ] {
            let R = Quat::from_scaled_axis(turn).to_rotation_matrix().into_inner();
            let b = Placed { core: &disc, R, p };
            if let Nearest::Overlap(_) = axis::nearest(&a, &b, 0.0, &Vec3::x(), &mut self.simplex) {
                axis::depth(&a, &b, &self.simplex, &mut self.epa);
            }
        }
    }

    /// Keeps only the deepest point, the first of several.
    pub fn deepest_alone(&mut self) {
        let low = least(&self.points);
        if let Some(best) = self.points.iter().find(|p| p.gap <= low).copied() {
            self.points.clear();
            self.points.push(best);
        }
    }
}

/// Owner of a name.
pub(crate) const OF_A: u64 = 1;

pub(crate) const OF_B: u64 = 2;

/// Returns the name of a corner of one core on the other.
pub(crate) fn corner(owner: u64, name: u64) -> u64 {
    mix(owner, name)
}

/// Returns the name of the point where two edges cross.
pub(crate) fn crossing(edge_a: u64, edge_b: u64) -> u64 {
    mix(3, mix(edge_a, edge_b))
}

/// A corner during clipping.
#[derive(Clone, Copy)]
pub(crate) struct Cut {
    pub(crate) p: Vec3,
    pub(crate) name: u64,
    /// The edge to the next corner: its name, and the plane that made it.
    pub(crate) edge: u64,
    pub(crate) plane: usize,
}

/// Returns the smallest distance of some points.
pub(crate) fn least(points: &[Point]) -> f64 {
    points.iter().fold(f64::INFINITY, |m, p| if p.gap < m { p.gap } else { m })
}
