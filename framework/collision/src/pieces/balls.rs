//! Spheres in a tree of boxes, halved along the longest side and stored as an implicit binary heap. It can be rebuilt without new memory.

use super::Piece;
use crate::error::ShapeFault;
use linkwork_multibody::spatial::Vec3;
use std::ops::ControlFlow;

/// Maximum number of spheres in a leaf.
const LEAF: usize = 8;
/// Maximum number of points.
pub(crate) const MOST: usize = 1 << 26;
/// Stack size for traversing a tree of any size.
const DEPTH: usize = 64;

#[derive(Clone, Copy, Debug)]
struct Ball {
    centre: Vec3,
    radius: f64,
    index: u32,
}

/// Spheres around points.
#[derive(Debug)]
pub(crate) struct Balls {
    balls: Vec<Ball>,
    /// Corners of the boxes; the children of node k are 2k + 1 and 2k + 2.
    boxes: Vec<(Vec3, Vec3)>,
    room: usize,
}

impl Clone for Balls {
    /// Keeps the same capacity.
    fn clone(&self) -> Self {
        let mut new = Self::empty(self.room);
        new.balls.extend_from_slice(&self.balls);
        new.boxes.extend_from_slice(&self.boxes);
        new
    }
}

/// Returns the number of boxes in a tree of spheres.
fn nodes(count: usize) -> usize {
    let leaves = count.div_ceil(LEAF).next_power_of_two();
    2 * leaves - 1
}

/// Returns the fault of the first invalid point.
fn wrong(points: &[[f64; 4]]) -> Option<ShapeFault> {
    let bad = |p: &[f64; 4]| !(p.iter().all(|x| x.is_finite()) && p[3] >= 0.0);
    let index = points.iter().position(bad)?;
    let radius = points[index][3];
    if points[index].iter().all(|x| x.is_finite()) {
        return Some(ShapeFault::Radius { index, radius });
    }
    Some(ShapeFault::NotFinite { what: "point", index })
}

impl Balls {
    fn empty(room: usize) -> Self {
        let (balls, boxes) = (Vec::with_capacity(room), Vec::with_capacity(nodes(room)));
        Self { balls, boxes, room }
    }

    /// Creates spheres from x, y, z, radius of each, m, with a capacity of at least `room`.
    pub fn new(points: &[[f64; 4]], room: usize) -> Result<Self, Vec<ShapeFault>> {
        let room = room.max(points.len());
        if room > MOST {
            return Err(vec![ShapeFault::Points { count: room, most: MOST }]);
        }
        let mut new = Self::empty(room);
        new.fill(points).map_err(|f| vec![f])?;
        Ok(new)
    }

    /// Replaces the spheres; after an error nothing has changed. O(n log n), no allocation.
    pub fn fill(&mut self, points: &[[f64; 4]]) -> Result<(), ShapeFault> {
        if points.len() > self.room {
            return Err(ShapeFault::Points { count: points.len(), most: self.room });
        }
        if let Some(fault) = wrong(points) {
            return Err(fault);
        }
        self.balls.clear();
        self.balls.extend(points.iter().enumerate().map(|(i, p)| Ball {
            centre: Vec3::new(p[0], p[1], p[2]),
            radius: p[3],
            index: i as u32,
        }));
        self.boxes.clear();
        if !points.is_empty() {
            self.boxes.resize(nodes(points.len()), (Vec3::zeros(), Vec3::zeros()));
            cut(&mut self.balls, 0, &mut self.boxes);
        }
        Ok(())
    }

    pub fn len(&self) -> usize {
        self.balls.len()
    }

    /// Returns the largest radius, m.
    pub fn largest(&self) -> f64 {
        self.balls.iter().map(|b| b.radius).fold(0.0, f64::max)
    }

    pub fn bounds(&self) -> (Vec3, Vec3) {
        self.boxes.first().copied().unwrap_or_default()
    }

    /// Visits spheres near a box; the half that is nearer to the centre of the box comes first.
    pub fn visit(
        &self,
        lo: &Vec3,
        hi: &Vec3,
        far: &mut impl FnMut(&Vec3, &Vec3) -> bool,
        each: &mut impl FnMut(&Piece) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        if self.balls.is_empty() {
            return ControlFlow::Continue(());
        }
        let middle = (lo + hi) / 2.0;
        let off = |node: usize| {
            let (lo, hi) = &self.boxes[node];
            (middle - middle.sup(lo).inf(hi)).norm_squared()
        };
        let mut wait = [(0usize, 0usize, self.balls.len()); DEPTH];
        let mut waiting = 1;
        while waiting > 0 {
            waiting -= 1;
            let (node, from, to) = wait[waiting];
            let (low, high) = &self.boxes[node];
            let outside = (0..3).any(|k| low[k] > hi[k] || high[k] < lo[k]);
            if outside || far(low, high) {
                continue;
            }
            if to - from <= LEAF {
                for b in &self.balls[from..to] {
                    let piece = Piece { centre: b.centre, round: b.radius, name: b.index.into() };
                    each(&piece)?;
                }
                continue;
            }
            let middle = from + (to - from) / 2;
            let halves = [(2 * node + 1, from, middle), (2 * node + 2, middle, to)];
            let second = usize::from(off(halves[0].0) <= off(halves[1].0));
            (wait[waiting], wait[waiting + 1]) = (halves[second], halves[1 - second]);
            waiting += 2;
        }
        ControlFlow::Continue(())
    }
}

/// Computes the boxes of a node and all nodes below it; reorders the spheres.
fn cut(balls: &mut [Ball], node: usize, boxes: &mut [(Vec3, Vec3)]) {
    let none = (Vec3::repeat(f64::INFINITY), Vec3::repeat(f64::NEG_INFINITY));
    let (lo, hi) = balls.iter().fold(none, |(lo, hi), b| {
        (lo.inf(&b.centre.add_scalar(-b.radius)), hi.sup(&b.centre.add_scalar(b.radius)))
    });
    boxes[node] = (lo, hi);
    if balls.len() <= LEAF {
        return;
    }
    let axis = (hi - lo).imax();
    let middle = balls.len() / 2;
    balls.select_nth_unstable_by(middle, |a, b| {
        a.centre[axis].total_cmp(&b.centre[axis]).then(a.index.cmp(&b.index))
    });
    let (left, right) = balls.split_at_mut(middle);
    cut(left, 2 * node + 1, boxes);
    cut(right, 2 * node + 2, boxes);
}
