//! A cylinder as thin discs across its length, for what rolls.
//!
//! A cylinder on a face touches along a line, of which contact knows the ends; on an edge it touches at the ends of the stretch
//! that they share while both are parallel, and at one point as soon as they are not. What sums a force over such points jumps. A
//! disc touches a face, an edge or a corner at one place, which moves without jumps while the disc rolls over them; each disc of
//! a wheel is asked for itself.

use crate::manifold::Point;
use crate::shape::Shape;
use crate::solid::Solid;

/// Half of a disc's thickness in radii.
const THIN: f64 = 1e-3;

/// The discs of one cylinder.
#[derive(Debug)]
pub(crate) struct Discs {
    /// One of them about its own middle.
    pub solid: Solid,
    /// Where their middles are on the cylinder's axis, m.
    pub places: Vec<f64>,
    /// Points of one disc nearer than this are one, m.
    near: f64,
}

impl Discs {
    /// `count` discs, the first and last at the ends; `None` when the shape is no cylinder, or there is not one disc.
    pub(crate) fn new(shape: &Shape, count: u32) -> Option<Self> {
        let Shape::Cylinder { radius, half_length } = *shape else { return None };
        let half = THIN * radius;
        let solid = Solid::new(&Shape::Cylinder { radius, half_length: half }).ok()?;
        let reach = f64::max(half_length - half, 0.0);
        let places = match count {
            0 => return None,
            1 => vec![0.0],
            n => (0..n).map(|k| reach * (2.0 * f64::from(k) / f64::from(n - 1) - 1.0)).collect(),
        };
        Some(Self { solid, places, near: 3.0 * half })
    }

    /// Makes one point of those at both sides of a disc that has hardly any thickness.
    pub(crate) fn join(&self, points: &mut Vec<Point>) {
        let mut kept = 0;
        for i in 0..points.len() {
            let p = points[i];
            let same =
                |q: &Point| (q.pb - p.pb).norm() < self.near && q.n.dot(&p.n) > 0.999;
            match points[..kept].iter().position(same) {
                Some(k) => {
                    let q = &mut points[k];
                    (q.pa, q.pb) = ((q.pa + p.pa) / 2.0, (q.pb + p.pb) / 2.0);
                    q.gap = (q.gap + p.gap) / 2.0;
                }
                None => {
                    points[kept] = p;
                    kept += 1;
                }
            }
        }
        points.truncate(kept);
    }
}
