//! The rows of a loop at a state: error, rate, bias, and the wrench of each row.
//!
//! p is the vector from A's origin to B's, everything is in world axes, and a row's wrench w = [m; f] acts at B's origin on B, its opposite at the
//! same point on A:
//! ```text
//! v = v_B − v_A − ω_A × p                        velocity of B's origin relative to A
//! a = a_B − a_A − α_A × p − ω_A × (ω_A × p) − 2 ω_A × v
//! ω = ω_B − ω_A,  α = α_B − α_A
//! slide    f = n          d = n · p − Σ c u       ḋ = f · v − Σ c u̇     d̈ = f · a − Σ c ü
//! across   m = b × a      d = a · b − cos         ḋ = m · ω             d̈ = m · α + ω · ṁ
//! turn     m = n          d = angle − u           ḋ = m · ω − u̇         d̈ = m · α + ω · (ω_A × n) − ü
//! screw    f = n, m = −pitch n                    the sum of a slide and a turn
//! ```
//! For a row with a gap g, d is replaced by d − g. With the accelerations for β̇ = 0 as a and α, d̈ is the bias J̇β. Up to four rows are computed
//! side by side. Slides and crossings are computed for all of them at once, and a lane that is neither has zero axes.

use super::rows::WIDTH;
use crate::linear::{M3, V3, V6};
use crate::query::v3;
use crate::tree::OnLink;
use crate::work::Kin;
use linkwork_multibody::{LoopMotion, LoopRow};
use linkwork_spatial::{Mat3, Vec3};
use std::ops::Range;
use wide::f64x4;

/// A loop prepared for the kernels.
#[derive(Clone, Debug)]
pub(crate) struct Closure {
    /// Slots of A's and B's links.
    pub slots: [u32; 2],
    /// Origins of A and B in their links.
    at: [V3<f64>; 2],
    /// All rows; five or six are divided into three and the rest, which fills two blocks evenly.
    pub blocks: Vec<Block>,
}

/// Up to four rows of a loop: constants, directions in the links' axes.
#[derive(Clone, Debug, Default)]
pub(crate) struct Block {
    n: usize,
    /// n of slides, in A's link.
    slide: Option<V3<f64x4>>,
    /// a in A's link and b in B's, and the cosine.
    across: Option<(V3<f64x4>, V3<f64x4>, f64x4)>,
    /// Lane, index among the motions, c: prescribed sliders, and gaps.
    given: Vec<(usize, usize, f64)>,
    turns: Vec<(usize, Turn)>,
}

/// A row with an angle.
#[derive(Clone, Debug)]
struct Turn {
    /// Axis and reference direction in A's link, and reference direction in B's.
    axis: V3<f64>,
    from: V3<f64>,
    to: V3<f64>,
    kind: TurnKind,
}

#[derive(Clone, Copy, Debug)]
enum TurnKind {
    /// Index among the motions.
    Given(usize),
    /// Pitch.
    Screw(f64),
}

/// Quantities that all rows of a loop share at a state, world axes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ends {
    R: [M3<f64>; 2],
    /// Angular velocities of A and B.
    w: [V3<f64>; 2],
    /// Angular velocity of B relative to A.
    turning: V3<f64>,
    alpha: V3<f64>,
    p: V3<f64>,
    v: V3<f64>,
    a: V3<f64>,
    /// Vectors from the origins of A's and B's link to B's origin.
    pub arms: [V3<f64>; 2],
}

/// Rows of a block at a state, world axes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BlockRows {
    pub n: usize,
    /// Wrench about B's origin.
    pub wrench: V6<f64x4>,
    pub error: [f64; WIDTH],
    pub rate: [f64; WIDTH],
    pub bias: [f64; WIDTH],
}

impl Closure {
    /// Creates a closure from the frames of both ends; `gaps` are the indices of the rows' gaps among the motions, or empty.
    pub fn new([a, b]: &[OnLink; 2], rows: &[LoopRow], gaps: Range<usize>) -> Self {
        let split = if rows.len() > WIDTH { 3 } else { rows.len() };
        let (first, rest) = rows.split_at(split);
        let blocks = [first, rest].into_iter().filter(|rows| !rows.is_empty());
        let mut blocks: Vec<Block> = blocks.map(|rows| Block::new(rows, &a.R, &b.R)).collect();
        for (row, gap) in gaps.enumerate() {
            let (block, lane) = if row < split { (0, row) } else { (1, row - split) };
            blocks[block].given.push((lane, gap, 1.0));
        }
        Self { slots: [a.slot, b.slot], at: [v3(&a.p), v3(&b.p)], blocks }
    }

    /// Computes the ends. `r`: position of each link's origin relative to its root. Between different roots, world positions are used.
    #[inline]
    pub fn ends(&self, kin: &[Kin<f64>], r: &[V3<f64>], root: &[u32]) -> Ends {
        let [sa, sb] = self.slots.map(|s| s as usize);
        let (A, B) = (&kin[sa], &kin[sb]);
        let arms = [A.R.mul(self.at[0]), B.R.mul(self.at[1])];
        let between =
            if sa != 0 && sb != 0 && root[sa] == root[sb] { r[sb] - r[sa] } else { B.p - A.p };
        let p = between + arms[1] - arms[0];
        let point = |k: &Kin<f64>, arm: V3<f64>| {
            let u = k.V.n.cross(arm);
            (k.V.f + u, k.V.n.cross_add(u, k.A.n.cross_add(arm, k.A.f)))
        };
        let ((v_a, a_a), (v_b, a_b)) = (point(A, arms[0]), point(B, arms[1]));
        let (w, u) = (A.V.n, A.V.n.cross(p));
        let v = v_b - v_a - u;
        let a = a_b - a_a - A.A.n.cross_add(p, w.cross(u + v + v));
        Ends {
            R: [A.R, B.R],
            w: [w, B.V.n],
            turning: B.V.n - w,
            alpha: B.A.n - A.A.n,
            p,
            v,
            a,
            arms: [arms[0] + p, arms[1]],
        }
    }
}

impl Block {
    fn new(rows: &[LoopRow], R_A: &Mat3, R_B: &Mat3) -> Self {
        let mut out = Self { n: rows.len(), ..Self::default() };
        for (lane, row) in rows.iter().enumerate() {
            match row {
                LoopRow::Slide { axis, motions } => {
                    put(out.slide.get_or_insert_default(), lane, &(R_A * axis));
                    out.given.extend(motions.iter().map(|(u, c)| (lane, *u, *c)));
                }
                LoopRow::Across { a, b, cosine } => {
                    let across = out.across.get_or_insert_default();
                    put(&mut across.0, lane, &(R_A * a));
                    put(&mut across.1, lane, &(R_B * b));
                    across.2.as_mut_array()[lane] = *cosine;
                }
                LoopRow::Turn { axis, reference, motion } => {
                    let kind = TurnKind::Given(*motion);
                    out.turns.push((lane, Turn::new((axis, reference), R_A, R_B, kind)));
                }
                LoopRow::Screw { axis, reference, pitch } => {
                    let kind = TurnKind::Screw(*pitch);
                    out.turns.push((lane, Turn::new((axis, reference), R_A, R_B, kind)));
                }
            }
        }
        out
    }

    /// Computes the rows at the given ends.
    #[inline]
    pub fn rows(&self, ends: &Ends, motions: &[LoopMotion]) -> BlockRows {
        let o = f64x4::splat(0.0);
        let (mut wrench, mut error, mut rate, mut bias) = (V6::default(), o, o, o);
        if let Some(axis) = &self.slide {
            let n = M3::splat(&ends.R[0]).mul(*axis);
            wrench.f = n;
            error = n.dot(ends.p.block());
            rate = n.dot(ends.v.block());
            bias = n.dot(ends.a.block());
        }
        if let Some((a, b, cosine)) = &self.across {
            let (a, b) = (M3::splat(&ends.R[0]).mul(*a), M3::splat(&ends.R[1]).mul(*b));
            let (w_a, w_b) = (ends.w[0].block(), ends.w[1].block());
            let (w, m) = (ends.turning.block(), b.cross(a));
            let m_dot = w_b.cross(b).cross_add(a, b.cross(w_a.cross(a)));
            wrench.n = m;
            error += a.dot(b) - *cosine;
            rate += m.dot(w);
            bias += m.dot(ends.alpha.block()) + w.dot(m_dot);
        }
        let [error, rate, bias] = [error, rate, bias].map(|x| x.to_array());
        let mut out = BlockRows { n: self.n, wrench, error, rate, bias };
        for (lane, turn) in &self.turns {
            let (wrench, numbers) = turn.row(ends, motions);
            set(&mut out.wrench, *lane, &wrench);
            [out.error[*lane], out.rate[*lane], out.bias[*lane]] = numbers;
        }
        for (lane, u, c) in &self.given {
            let u = &motions[*u];
            out.error[*lane] -= c * u.position;
            out.rate[*lane] -= c * u.rate;
            out.bias[*lane] -= c * u.acceleration;
        }
        out
    }
}

impl Turn {
    fn new((axis, reference): (&Vec3, &Vec3), R_A: &Mat3, R_B: &Mat3, kind: TurnKind) -> Self {
        let (axis, from) = (v3(&(R_A * axis)), v3(&(R_A * reference)));
        Self { axis, from, to: v3(&(R_B * reference)), kind }
    }

    /// Computes wrench, error, rate and bias.
    fn row(&self, ends: &Ends, motions: &[LoopMotion]) -> (V6<f64>, [f64; 3]) {
        let (R_A, R_B) = (&ends.R[0], &ends.R[1]);
        let (n, x, to) = (R_A.mul(self.axis), R_A.mul(self.from), R_B.mul(self.to));
        let angle = n.cross(x).dot(to).atan2(x.dot(to));
        let turn = n.dot(ends.alpha) + ends.turning.dot(ends.w[0].cross(n));
        match self.kind {
            TurnKind::Given(motion) => {
                let (u, rate) = (&motions[motion], n.dot(ends.turning));
                let numbers = [wrap(angle - u.position), rate - u.rate, turn - u.acceleration];
                (V6 { n, f: V3::default() }, numbers)
            }
            TurnKind::Screw(pitch) => {
                let error = pitch * wrap(n.dot(ends.p) / pitch - angle);
                let rate = n.dot(ends.v) - pitch * n.dot(ends.turning);
                let bias = n.dot(ends.a) - pitch * turn;
                (V6 { n: n.scale(-pitch), f: n }, [error, rate, bias])
            }
        }
    }
}

fn put(to: &mut V3<f64x4>, lane: usize, x: &Vec3) {
    for (to, x) in [&mut to.x, &mut to.y, &mut to.z].into_iter().zip(x.iter()) {
        to.as_mut_array()[lane] = *x;
    }
}

fn set(to: &mut V6<f64x4>, lane: usize, x: &V6<f64>) {
    put(&mut to.n, lane, &crate::query::vec3(&x.n));
    put(&mut to.f, lane, &crate::query::vec3(&x.f));
}

/// Wraps an angle to −π … π.
fn wrap(x: f64) -> f64 {
    use std::f64::consts::TAU;
    x - TAU * (x / TAU).round()
}
