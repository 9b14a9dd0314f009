//! Convex cores: point, segment, cylinder, ellipsoid, polytope. A shape is a core with a radius around it.
//!
//! ```text
//! h(d) = max over x in the core of d · x        support
//! sep(n) = −h_B(−n) − h_A(n)                    along a unit normal n from A to B
//! distance = max over n of sep(n)               for overlap it is negative: the smallest penetration depth
//! ellipsoid with H = diag(half axes):           h(d) = |H d|, at the point H² d / |H d|
//! ```

use linkwork_multibody::spatial::{Mat3, Pose, Vec3};

/// Combines two feature names into one. The result is the same in every run.
#[inline]
pub(crate) fn mix(a: u64, b: u64) -> u64 {
    let mut z = a.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ b.wrapping_add(0x2545_f491_4f6c_dd1d);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// Returns the name of the edge between two corners.
#[inline]
pub(crate) fn edge_name(a: u64, b: u64) -> u64 {
    mix(a.min(b) + 1, a.max(b) + 1)
}

/// A face of a polytope.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Face {
    /// Outward normal, unit.
    pub n: Vec3,
    /// Index of its first corner in `ring`.
    pub start: u32,
    /// Number of its corners.
    pub len: u32,
}

/// A convex polytope, or a triangle.
#[derive(Clone, Debug, Default)]
pub(crate) struct Poly {
    /// Corners, m.
    pub vertices: Vec<Vec3>,
    /// Names of the corners.
    pub names: Vec<u64>,
    /// Faces with contact on their outside. A triangle has one.
    pub faces: Vec<Face>,
    /// Corners of all faces, counter-clockwise seen from outside.
    pub ring: Vec<u32>,
    /// Unit directions of edges, each once.
    pub edges: Vec<Vec3>,
    /// Half edges if the polytope is a box.
    pub half: Option<Vec3>,
    /// Half the smallest distance between a face and the corner farthest behind it, m; zero for a triangle.
    pub thick: f64,
}

impl Poly {
    /// Creates a box.
    pub(crate) fn cuboid(half: Vec3) -> Self {
        let mut p = Self { half: Some(half), thick: half.min(), ..Self::default() };
        for i in 0..8u64 {
            let sign = |bit: u64| if i >> bit & 1 == 1 { 1.0 } else { -1.0 };
            p.vertices.push(half.component_mul(&Vec3::new(sign(0), sign(1), sign(2))));
            p.names.push(i);
        }
        for axis in 0..3 {
            let (u, v) = (1u32 << ((axis + 1) % 3), 1u32 << ((axis + 2) % 3));
            for side in [0, 1u32] {
                let mut n = Vec3::zeros();
                n[axis] = if side == 1 { 1.0 } else { -1.0 };
                p.faces.push(Face { n, start: p.ring.len() as u32, len: 4 });
                let base = side << axis;
                let turn = [base, base | u, base | u | v, base | v];
                if side == 1 {
                    p.ring.extend(turn);
                } else {
                    p.ring.extend(turn.iter().rev());
                }
            }
            p.edges.push(Vec3::ith(axis, 1.0));
        }
        p
    }

    /// Reserves memory for a triangle; [`set_triangle`](Self::set_triangle) sets its corners.
    pub(crate) fn of_triangle() -> Self {
        Self {
            vertices: Vec::with_capacity(3),
            names: Vec::with_capacity(3),
            faces: Vec::with_capacity(1),
            ring: Vec::with_capacity(3),
            edges: Vec::with_capacity(3),
            ..Self::default()
        }
    }

    /// Sets the corners, names and unit normal `n` of the triangle.
    pub(crate) fn set_triangle(&mut self, v: &[Vec3; 3], names: &[u64; 3], n: Vec3) {
        for list in [&mut self.vertices, &mut self.edges] {
            list.clear();
        }
        self.vertices.extend(v);
        self.edges.extend((0..3).map(|k| (v[(k + 1) % 3] - v[k]).normalize()));
        self.names.clear();
        self.names.extend(names);
        self.faces.clear();
        self.faces.push(Face { n, start: 0, len: 3 });
        self.ring.clear();
        self.ring.extend([0, 1, 2]);
    }

    /// Returns the corner indices of a face.
    pub(crate) fn ring_of(&self, face: &Face) -> &[u32] {
        &self.ring[face.start as usize..(face.start + face.len) as usize]
    }
}

/// A convex set in its own frame.
#[derive(Clone, Debug)]
pub(crate) enum Core {
    /// The origin.
    Point,
    /// The segment from −h to h on the z axis.
    Segment { h: f64 },
    /// The cylinder of radius r about the z axis, from −h to h.
    Cylinder { r: f64, h: f64 },
    /// The ellipsoid with half axes along x, y, z.
    Ellipsoid { half: Vec3 },
    /// A polytope.
    Poly(Poly),
}

impl Core {
    /// Returns the support point: the point farthest along d.
    #[inline]
    pub(crate) fn support(&self, d: &Vec3) -> Vec3 {
        match self {
            Core::Point => Vec3::zeros(),
            Core::Segment { h } => Vec3::new(0.0, 0.0, h.copysign(d.z)),
            Core::Cylinder { r, h } => {
                // d has nearly unit length, so squares cannot overflow, and underflow has no effect.
                let s = (d.x * d.x + d.y * d.y).sqrt();
                let (x, y) = if s > 0.0 { (d.x / s, d.y / s) } else { (1.0, 0.0) };
                Vec3::new(r * x, r * y, h.copysign(d.z))
            }
            Core::Ellipsoid { half } => ellipsoid_support(half, d),
            Core::Poly(p) => {
                let (mut best, mut far) = (0, f64::NEG_INFINITY);
                for (i, v) in p.vertices.iter().enumerate() {
                    let along = v.dot(d);
                    if along > far {
                        (best, far) = (i, along);
                    }
                }
                p.vertices[best]
            }
        }
    }

    /// Returns the smallest and largest d · x; d may have any length.
    #[inline]
    fn range(&self, d: &Vec3) -> (f64, f64) {
        match self {
            Core::Poly(p) => {
                if let Some(h) = &p.half {
                    let e = h.x * d.x.abs() + h.y * d.y.abs() + h.z * d.z.abs();
                    return (-e, e);
                }
                p.vertices.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), v| {
                    let x = v.dot(d);
                    (if x < lo { x } else { lo }, if x > hi { x } else { hi })
                })
            }
            Core::Cylinder { r, h } => {
                let e = r * (d.x * d.x + d.y * d.y).sqrt() + h * d.z.abs();
                (-e, e)
            }
            Core::Segment { h } => {
                let e = h * d.z.abs();
                (-e, e)
            }
            Core::Ellipsoid { half } => {
                let e = half.component_mul(d).norm();
                (-e, e)
            }
            Core::Point => (0.0, 0.0),
        }
    }

    /// Returns half of its smallest extent, m; for a polytope, between a face and the corners behind it.
    pub(crate) fn least_half(&self) -> f64 {
        match self {
            Core::Point | Core::Segment { .. } => 0.0,
            Core::Cylinder { r, h } => r.min(*h),
            Core::Ellipsoid { half } => half.min(),
            Core::Poly(p) => p.thick,
        }
    }

    /// Returns an upper bound for the change of the support distance per radian of the direction on a smooth part, m.
    pub(crate) fn radius(&self) -> f64 {
        match self {
            Core::Cylinder { r, .. } => *r,
            // The largest radius of curvature is at the end of the shortest axis, along the longest axis.
            Core::Ellipsoid { half } => half.max() * half.max() / half.min(),
            _ => 0.0,
        }
    }

    /// Returns true for a triangle, which has no interior.
    pub(crate) fn is_triangle(&self) -> bool {
        matches!(self, Core::Poly(p) if p.faces.len() == 1)
    }

    /// Returns the directions of straight edges.
    pub(crate) fn edges(&self) -> &[Vec3] {
        const Z: [Vec3; 1] = [Vec3::new(0.0, 0.0, 1.0)];
        match self {
            Core::Point | Core::Ellipsoid { .. } => &[],
            Core::Segment { .. } | Core::Cylinder { .. } => &Z,
            Core::Poly(p) => &p.edges,
        }
    }
}

/// Returns the support point of an ellipsoid along d.
#[inline]
fn ellipsoid_support(half: &Vec3, d: &Vec3) -> Vec3 {
    let w = half.component_mul(d);
    let length = w.norm();
    if length > 0.0 { half.component_mul(&w) / length } else { Vec3::new(half.x, 0.0, 0.0) }
}

/// Returns the approximate distance of a point q from an ellipsoid, m; negative inside. The error is of second order in the distance.
pub(crate) fn over_ellipsoid(half: &Vec3, q: &Vec3) -> f64 {
    let scaled = q.component_div(half);
    let (f, slope) = (scaled.norm(), scaled.component_div(half).norm());
    if slope > 0.0 { (f - 1.0) * f / slope } else { -half.min() }
}

/// Returns the excess of x beyond −h … h. Uses one comparison per side, without the checks of `clamp`.
#[inline(always)]
pub(crate) fn beyond(x: f64, h: f64) -> f64 {
    let held = if x > h { h } else { x };
    x - if held < -h { -h } else { held }
}

/// A core at a pose.
#[derive(Clone, Copy)]
pub(crate) struct Placed<'a> {
    /// The core.
    pub core: &'a Core,
    /// Rotation from the core's frame to the frame of the pair.
    pub R: Mat3,
    /// Position of the core's origin, m.
    pub p: Vec3,
}

impl<'a> Placed<'a> {
    /// Returns a core at the origin.
    pub(crate) fn here(core: &'a Core) -> Self {
        Self { core, R: Mat3::identity(), p: Vec3::zeros() }
    }

    /// Returns a core at a pose.
    pub(crate) fn at(core: &'a Core, X: &Pose) -> Self {
        Self { core, R: X.rotation.to_rotation_matrix().into_inner(), p: X.position }
    }

    /// Returns the support point along d.
    #[inline]
    pub(crate) fn support(&self, d: &Vec3) -> Vec3 {
        if let Core::Cylinder { r, h } = self.core {
            // Only the axis and the direction of w matter, unless d is nearly parallel to the axis: then w
            // suffers from cancellation.
            let z = self.R.column(2);
            let along = z.dot(d);
            let w = d - z * along;
            let s = w.norm_squared().sqrt();
            if s > 0.01 {
                return self.p + z * h.copysign(along) + w * (r / s);
            }
        }
        self.R * self.core.support(&self.R.tr_mul(d)) + self.p
    }

    /// Returns a vector of any length from a point to the core: to the nearest point of a cylinder, segment or box, otherwise to the origin. Zero
    /// inside a cylinder or box.
    #[inline(always)]
    pub(crate) fn toward(&self, from: &Vec3) -> Vec3 {
        let q = self.R.tr_mul(&(from - self.p));
        let out = match self.core {
            Core::Point => q,
            Core::Segment { h } => Vec3::new(q.x, q.y, beyond(q.z, *h)),
            Core::Cylinder { r, h } => {
                let s = (q.x * q.x + q.y * q.y).sqrt();
                let part = if s > *r { 1.0 - r / s } else { 0.0 };
                Vec3::new(q.x * part, q.y * part, beyond(q.z, *h))
            }
            Core::Poly(Poly { half: Some(h), .. }) => {
                Vec3::new(beyond(q.x, h.x), beyond(q.y, h.y), beyond(q.z, h.z))
            }
            Core::Ellipsoid { .. } | Core::Poly(_) => q,
        };
        -(self.R * out)
    }

    /// Returns the change of the support point when d changes by `step`; zero at corners.
    #[inline]
    pub(crate) fn support_rate(&self, d: &Vec3, step: &Vec3) -> Vec3 {
        let r = match self.core {
            Core::Cylinder { r, .. } => r,
            Core::Ellipsoid { half } => {
                let (d, step) = (self.R.tr_mul(d), self.R.tr_mul(step));
                let (w, v) = (half.component_mul(&d), half.component_mul(&step));
                let length = w.norm();
                let u = w / length;
                return self.R * half.component_mul(&((v - u * u.dot(&v)) / length));
            }
            _ => return Vec3::zeros(),
        };
        let (d, step) = (self.R.tr_mul(d), self.R.tr_mul(step));
        let s = (d.x * d.x + d.y * d.y).sqrt();
        let (x, y) = (d.x / s, d.y / s);
        let across = r / s * (x * step.y - y * step.x);
        self.R * Vec3::new(-y * across, x * across, 0.0)
    }

    /// Returns the smallest and largest d · x.
    #[inline(always)]
    pub(crate) fn range(&self, d: &Vec3) -> (f64, f64) {
        let at = self.p.dot(d);
        if let Core::Cylinder { r, h } = self.core {
            let z = self.R.column(2);
            let along = z.dot(d);
            let e = r * (d - z * along).norm_squared().sqrt() + h * along.abs();
            return (at - e, at + e);
        }
        let (lo, hi) = self.core.range(&self.R.tr_mul(d));
        (lo + at, hi + at)
    }
}

/// A corner of a polygon, and the edge to the next corner.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Corner {
    /// Position, m.
    pub p: Vec3,
    /// Name of the corner.
    pub name: u64,
    /// Name of the edge.
    pub edge: u64,
}

/// A flat end counts as facing n if the sine of the angle is below this.
const FACING: f64 = 0.2;
/// Below this tilt the eight points on a rim are fixed on the body; above, they rotate with the tilt.
const LEVEL: f64 = 1e-4;

impl Placed<'_> {
    /// Returns true if the surface has a flat part perpendicular to n.
    pub(crate) fn lies_flat(&self, n: &Vec3) -> bool {
        let d = self.R.tr_mul(n);
        match self.core {
            Core::Point | Core::Ellipsoid { .. } => false,
            Core::Segment { .. } => d.z.abs() < LEVEL,
            Core::Cylinder { .. } => d.z.abs() < LEVEL || d.x.hypot(d.y) < LEVEL,
            Core::Poly(p) => {
                p.faces.iter().any(|f| f.n.dot(&d) > 0.5 && f.n.cross(&d).norm() < LEVEL)
            }
        }
    }

    /// Writes the corners of the surface part that faces n to `out`. Returns its normal if it is a face.
    pub(crate) fn facing(&self, n: &Vec3, out: &mut Vec<Corner>) -> Option<Vec3> {
        out.clear();
        let d = self.R.tr_mul(n);
        let normal = match self.core {
            Core::Point => {
                out.push(Corner { p: Vec3::zeros(), name: 0, edge: 0 });
                None
            }
            Core::Ellipsoid { half } => {
                out.push(Corner { p: ellipsoid_support(half, &d), name: 0, edge: 0 });
                None
            }
            Core::Segment { h } => {
                push_line(out, &[Vec3::new(0.0, 0.0, -h), Vec3::new(0.0, 0.0, *h)], [16, 17]);
                None
            }
            Core::Cylinder { r, h } => facing_cylinder(*r, *h, &d, out),
            Core::Poly(p) => facing_poly(p, &d, out),
        };
        for c in out.iter_mut() {
            c.p = self.R * c.p + self.p;
        }
        normal.map(|m| self.R * m)
    }
}

fn push_line(out: &mut Vec<Corner>, ends: &[Vec3; 2], names: [u64; 2]) {
    let edge = edge_name(names[0], names[1]);
    out.extend((0..2).map(|i| Corner { p: ends[i], name: names[i], edge }));
}

/// Returns an end (eight points of its rim), a line on the side, or the farthest point of a rim.
fn facing_cylinder(r: f64, h: f64, d: &Vec3, out: &mut Vec<Corner>) -> Option<Vec3> {
    let s = (d.x * d.x + d.y * d.y).sqrt();
    let (x, y) = if s > LEVEL { (d.x / s, d.y / s) } else { (1.0, 0.0) };
    if s < FACING {
        let (up, c) = (1f64.copysign(d.z), std::f64::consts::FRAC_1_SQRT_2);
        let end = if up > 0.0 { 0 } else { 8 };
        let eighth = [(1., 0.), (c, c), (0., 1.), (-c, c), (-1., 0.), (-c, -c), (0., -1.), (c, -c)];
        for k in 0..8u64 {
            let (u, v) = eighth[k as usize];
            let v = v * up; // counter-clockwise from outside
            let p = Vec3::new(r * (u * x - v * y), r * (u * y + v * x), h * up);
            out.push(Corner { p, name: end + k, edge: edge_name(end + k, end + (k + 1) % 8) });
        }
        return Some(Vec3::new(0.0, 0.0, up));
    }
    let side = |z: f64| Vec3::new(r * x, r * y, z);
    if d.z.abs() < FACING {
        push_line(out, &[side(-h), side(h)], [16, 17]);
    } else {
        let name = if d.z > 0.0 { 17 } else { 16 };
        out.push(Corner { p: side(h.copysign(d.z)), name, edge: 0 });
    }
    None
}

/// Returns the face whose normal is nearest to d.
fn facing_poly(p: &Poly, d: &Vec3, out: &mut Vec<Corner>) -> Option<Vec3> {
    let (mut best, mut near) = (p.faces.first()?, f64::NEG_INFINITY);
    for f in &p.faces {
        let along = f.n.dot(d);
        if along > near {
            (best, near) = (f, along);
        }
    }
    let ring = p.ring_of(best);
    for (k, i) in ring.iter().enumerate() {
        let (i, j) = (*i as usize, ring[(k + 1) % ring.len()] as usize);
        let edge = edge_name(p.names[i], p.names[j]);
        out.push(Corner { p: p.vertices[i], name: p.names[i], edge });
    }
    Some(best.n)
}
