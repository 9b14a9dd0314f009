//! Solves contacts with Coulomb friction between free bodies four at a time: each vector of E has the same entry of four contacts.
//!
//! ```text
//! batch    four contacts that share no cluster of six degrees of freedom (colours.rs)
//! y        each cluster has two vectors of its own, filled up with zeros
//! v        Σ e y, 36 products of vectors for four contacts, y transposed on the way
//! λ        local solutions side by side (law.rs)
//! y        Σ e (λ' − λ), 36 products, transposed back
//! ```
//! Contacts of the same two bodies must be solved one after the other, because each needs the result of the previous one. Contacts of a batch are
//! independent, and so are batches of one colour. The same contacts in the same order give bit-identical results.
//!
//! After a few sweeps, most contacts of a heap hardly change. Their batches are skipped for one sweep, then for two, up to [`WAIT`]. Before a
//! solution is accepted, the residual of all contacts is measured.

mod colours;
mod law;
#[cfg(test)]
mod tests;

use super::largest::larger;
use super::problem::Problem;
pub(crate) use colours::Colours;
use colours::SIX;
use law::Law;
use wide::f64x4;

/// Marks a missing cluster, group or contact.
pub(crate) const NONE: u32 = u32::MAX;

/// Maximum number of sweeps that skip a batch which hardly changes.
const WAIT: u8 = 4;

/// Four contacts.
#[derive(Clone, Copy, Debug)]
struct Batch {
    /// Groups; [`NONE`] in lanes without a contact.
    group: [u32; 4],
    /// First vector of y of each side, by lane. Lanes without a side use the last vectors, which stay 0.
    at: [[u32; 4]; 2],
    /// E by side, degree of freedom and row.
    e: [[[f64x4; 3]; SIX]; 2],
    law: Law,
    /// Number of sweeps that still skip the batch, and number of sweeps that last skipped it.
    wait: u8,
    level: u8,
}

/// Batches of a problem with their impulses; reuses its memory.
#[derive(Clone, Debug, Default)]
pub(crate) struct Lanes {
    batches: Vec<Batch>,
    lambda: Vec<[f64x4; 3]>,
    /// Change of the last sweep, and the direction of the conjugate gradients.
    r: Vec<[f64x4; 3]>,
    p: Vec<[f64x4; 3]>,
}

/// Change of a sweep: the largest change of an impulse times the compliance of its contact (m/s), and Σ w r².
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Change {
    pub most: f64x4,
    pub square: f64x4,
}

/// The largest entries of a residual.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Worst {
    pub natural: f64,
    pub work: f64,
    pub violation: f64,
    pub impulse: f64,
}

impl Lanes {
    /// Removes all batches.
    pub fn clear(&mut self) {
        self.batches.clear();
        self.lambda.clear();
    }

    /// Returns whether there are no batches.
    pub fn is_empty(&self) -> bool {
        self.batches.is_empty()
    }

    /// Builds the batches from a problem with sorted contacts. `vector` is the first vector of y of a cluster, the last but one for [`NONE`]. Writes
    /// mean compliances to `scales` by group.
    pub fn set(
        &mut self,
        problem: &Problem,
        colours: &Colours,
        vector: impl Fn(u32) -> u32,
        scales: &mut [f64],
    ) {
        self.batches.clear();
        for (from, to) in &colours.batches {
            let batch = Batch::new(problem, &colours.order[*from as usize..*to as usize], &vector);
            let scale = batch.law.scale.to_array();
            for (group, scale) in batch.group.iter().zip(scale).filter(|(g, _)| **g != NONE) {
                scales[*group as usize] = scale;
            }
            self.batches.push(batch);
        }
        let none = [f64x4::splat(0.0); 3];
        for x in [&mut self.lambda, &mut self.r, &mut self.p] {
            x.clear();
            x.resize(self.batches.len(), none);
        }
    }

    /// Returns false if a compliance overflows or is NaN.
    pub fn is_finite(&self) -> bool {
        self.batches.iter().fold(true, |fine, b| fine & b.law.is_finite())
    }

    /// Reads the impulses from those of all groups, and adds Eᵀ λ to y.
    pub fn pull(&mut self, lambda: &[[f64; 4]], y: &mut [f64x4]) {
        self.wake();
        for (batch, to) in self.batches.iter().zip(&mut self.lambda) {
            let lane = |g: u32| match g {
                NONE => f64x4::splat(0.0),
                g => f64x4::new(lambda[g as usize]),
            };
            let [n, x, z, _] = f64x4::transpose(batch.group.map(lane));
            *to = [n, x, z];
            let sides = batch.sides(y);
            batch.spread(*to, sides, y);
        }
    }

    /// Writes the impulses into those of all groups.
    pub fn store(&self, lambda: &mut [[f64; 4]]) {
        for (batch, l) in self.batches.iter().zip(&self.lambda) {
            let by_lane = f64x4::transpose([l[0], l[1], l[2], f64x4::splat(0.0)]);
            for (group, l) in batch.group.iter().zip(by_lane).filter(|(g, _)| **g != NONE) {
                lambda[*group as usize] = l.to_array();
            }
        }
    }

    /// Makes the next sweep visit every batch.
    pub fn wake(&mut self) {
        for batch in &mut self.batches {
            (batch.wait, batch.level) = (0, 0);
        }
    }

    /// Makes one sweep. The next sweeps skip batches that change by at most `quiet` (m/s). Returns whether every batch was visited.
    pub fn sweep(
        &mut self,
        relaxation: f64,
        quiet: f64,
        y: &mut [f64x4],
        change: &mut Change,
    ) -> bool {
        let zero = [f64x4::splat(0.0); 3];
        let quiet = f64x4::splat(quiet);
        let mut every = true;
        for ((batch, lambda), r) in self.batches.iter_mut().zip(&mut self.lambda).zip(&mut self.r) {
            if batch.wait > 0 {
                batch.wait -= 1;
                every = false;
                *r = zero;
                continue;
            }
            let sides = batch.sides(y);
            let v = batch.law.velocity(batch.gathered(&sides));
            let mut new = batch.law.solve(*lambda, v);
            if relaxation != 1.0 {
                new = batch.law.relaxed(lambda, &new, relaxation);
            }
            *r = std::array::from_fn(|k| new[k] - lambda[k]);
            batch.spread(*r, sides, y);
            let mut own = f64x4::splat(0.0);
            for r in r {
                let moved = batch.law.scale * *r;
                own = own.fast_max(moved.abs());
                change.square = moved.mul_add(*r, change.square);
            }
            change.most = change.most.fast_max(own);
            if own.simd_gt(quiet).any() {
                batch.level = 0;
            } else {
                batch.level = (batch.level + 1).min(WAIT);
                batch.wait = batch.level;
            }
            *lambda = new;
        }
        every
    }

    /// Restarts the conjugate directions.
    pub fn restart(&mut self) {
        self.p.fill([f64x4::splat(0.0); 3]);
    }

    /// Moves along the direction, and updates the direction with the change of the sweep.
    pub fn conjugate(&mut self, beta: f64) {
        let beta = f64x4::splat(beta);
        for ((l, p), r) in self.lambda.iter_mut().zip(&mut self.p).zip(&self.r) {
            for k in 0..3 {
                let along = beta * p[k];
                l[k] += along;
                p[k] = along + r[k];
            }
        }
    }

    /// Returns the largest entries of the residual of the present impulses, whose Eᵀ λ is in y.
    pub fn measure(&self, y: &[f64x4]) -> Worst {
        let zero = f64x4::splat(0.0);
        let (mut natural, mut work, mut outside, mut impulse) = (zero, zero, zero, zero);
        // 0, unless something is infinite or NaN.
        let mut bad = zero;
        for (batch, l) in self.batches.iter().zip(&self.lambda) {
            let v = batch.law.velocity(batch.gathered(&batch.sides(y)));
            let (map, idle, out) = batch.law.residual(l, &v);
            for k in 0..3 {
                natural = natural.fast_max(map[k].abs());
                impulse = impulse.fast_max(l[k].abs());
                bad = zero.mul_add(map[k], bad);
            }
            work = work.fast_max(idle.abs());
            outside = outside.fast_max(out);
        }
        let most = |x: f64x4| x.to_array().into_iter().fold(0.0, f64::max);
        let mut worst = Worst {
            natural: most(natural),
            work: most(work),
            violation: most(outside),
            impulse: most(impulse),
        };
        larger(&mut worst.natural, if bad.reduce_add() == 0.0 { 0.0 } else { f64::NAN });
        worst
    }

    /// Allocates for a number of contacts.
    pub fn reserve(&mut self, groups: usize) {
        // Batches have at least two contacts.
        super::room(&mut self.batches, groups / 2);
        for x in [&mut self.lambda, &mut self.r, &mut self.p] {
            super::room(x, groups / 2);
        }
    }
}

/// y of the two sides of four contacts, by degree of freedom.
type Sides = [[f64x4; SIX]; 2];

impl Batch {
    fn new(problem: &Problem, ends: &[colours::Ends], vector: &impl Fn(u32) -> u32) -> Batch {
        let zero = f64x4::splat(0.0);
        let mut group = [NONE; 4];
        let mut at = [[vector(NONE); 4]; 2];
        let mut e = [[[zero; 3]; SIX]; 2];
        let (mut b, mut friction) = ([zero; 4], [0.0; 4]);
        for (lane, end) in ends.iter().enumerate() {
            group[lane] = end.group;
            for side in 0..2 {
                at[side][lane] = vector(end.clusters[side]);
            }
            b[lane] = f64x4::new(problem.b[end.group as usize]);
            if let super::Cone::Coulomb { friction: mu } = problem.cones[end.group as usize] {
                friction[lane] = mu;
            }
        }
        for (side, e) in e.iter_mut().enumerate() {
            for (d, e) in e.iter_mut().enumerate() {
                let lane = |lane: usize| match ends.get(lane) {
                    Some(end) => {
                        let (_, e) = problem.entries(end.group as usize);
                        e.get(SIX * side + d).map_or(zero, |e| f64x4::new(*e))
                    }
                    None => zero,
                };
                let [n, x, y, _] = f64x4::transpose([lane(0), lane(1), lane(2), lane(3)]);
                *e = [n, x, y];
            }
        }
        let mut w = [zero; 6];
        for [n, x, y] in e.iter().flatten() {
            w[0] = n.mul_add(*n, w[0]);
            w[1] = n.mul_add(*x, w[1]);
            w[2] = n.mul_add(*y, w[2]);
            w[3] = x.mul_add(*x, w[3]);
            w[4] = x.mul_add(*y, w[4]);
            w[5] = y.mul_add(*y, w[5]);
        }
        let [bn, bx, by, _] = f64x4::transpose(b);
        let law = Law::new(w, [bn, bx, by], f64x4::new(friction));
        Batch { group, at, e, law, wait: 0, level: 0 }
    }

    /// Returns y of both sides.
    #[inline(always)]
    fn sides(&self, y: &[f64x4]) -> Sides {
        [side(&self.at[0], y), side(&self.at[1], y)]
    }

    /// Computes E_g y of each contact.
    #[inline(always)]
    fn gathered(&self, sides: &Sides) -> [f64x4; 3] {
        let mut sum = [[f64x4::splat(0.0); 3]; 2];
        for ((sum, e), y) in sum.iter_mut().zip(&self.e).zip(sides) {
            for (e, y) in e.iter().zip(y) {
                for k in 0..3 {
                    sum[k] = e[k].mul_add(*y, sum[k]);
                }
            }
        }
        std::array::from_fn(|k| sum[0][k] + sum[1][k])
    }

    /// Computes y = sides + E_gᵀ λ of each contact.
    #[inline(always)]
    fn spread(&self, l: [f64x4; 3], mut sides: Sides, y: &mut [f64x4]) {
        let zero = f64x4::splat(0.0);
        for ((at, e), to) in self.at.iter().zip(&self.e).zip(&mut sides) {
            for (e, to) in e.iter().zip(to.iter_mut()) {
                *to = e[2].mul_add(l[2], e[1].mul_add(l[1], e[0].mul_add(l[0], *to)));
            }
            let [a, b, c, d, e, f] = *to;
            let first = f64x4::transpose([a, b, c, d]);
            let second = f64x4::transpose([e, f, zero, zero]);
            for lane in 0..4 {
                y[at[lane] as usize] = first[lane];
                y[at[lane] as usize + 1] = second[lane];
            }
        }
    }
}

/// Returns the two vectors of y of each lane, by degree of freedom.
#[inline(always)]
fn side(at: &[u32; 4], y: &[f64x4]) -> [f64x4; SIX] {
    let [i, j, k, l] = [at[0] as usize, at[1] as usize, at[2] as usize, at[3] as usize];
    let [a, b, c, d] = f64x4::transpose([y[i], y[j], y[k], y[l]]);
    let [e, f, ..] = f64x4::transpose([y[i + 1], y[j + 1], y[k + 1], y[l + 1]]);
    [a, b, c, d, e, f]
}
