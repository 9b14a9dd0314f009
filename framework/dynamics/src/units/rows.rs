//! Rows: constraints outside of the units, represented by a factor of their compliance.
//!
//! ```text
//! W = E E*                       E: the vectors e of a row, as `walk.rs` computes them
//! y = E* λ                       input of one scatter sweep
//! ```
//! Neither J nor M⁻¹ is formed, and no sweep is needed for single rows.

use super::{Unit, Units, UnitsWork};
use crate::linear::{V3, V6};
use wide::f64x4;

/// Fraction of the bound of its diagonal entry below which a row counts as zero.
const ROUNDING: f64 = 1e-20;

/// Maximum number of rows in a group.
pub const WIDTH: usize = 4;

/// A group of up to four rows.
#[derive(Clone, Copy, Debug, Default)]
pub struct RowGroup {
    /// Number of rows.
    pub n: usize,
    /// Error of the rows: d of a constraint, rad or m; zero for a contact.
    pub error: [f64; WIDTH],
    /// Its rate J β at the present state.
    pub rate: [f64; WIDTH],
    /// J β̇ due to the applied forces alone, without J̇ β.
    pub free: [f64; WIDTH],
    /// J̇ β.
    pub bias: [f64; WIDTH],
    /// Bound of W's diagonal from the sizes of wrenches and columns; a row that is small compared with it, because its terms cancel, counts as zero.
    pub gross: [f64; WIDTH],
}

/// Rows and their factor E. Call [`RowSet::clear`], then add rows; the memory is kept.
#[derive(Clone, Debug, Default)]
pub struct RowSet {
    pub(super) start: Vec<u32>,
    pub(super) dof: Vec<u32>,
    pub(super) e: Vec<[f64; WIDTH]>,
    pub(super) groups: Vec<RowGroup>,
    /// Parts at prescribed dofs: group, index in β, ε.
    pub(super) held: Vec<(u32, u32, [f64; WIDTH])>,
    /// Parts at members of aggregates: group, slot, z about the member's origin.
    pub(super) held_ends: Vec<(u32, u32, V6<f64x4>)>,
    /// Factors on members' dofs: group, unit, index among the members' dofs, c.
    pub(super) held_terms: Vec<(u32, u32, u32, f64x4)>,
    pub(super) independent: usize,
    pub(super) ends: Vec<(u32, V6<f64x4>)>,
    pub(super) terms: Vec<(u32, u32, f64x4)>,
}

impl RowSet {
    /// Removes all rows.
    pub fn clear(&mut self) {
        self.start.clear();
        self.start.push(0);
        self.dof.clear();
        self.e.clear();
        self.held.clear();
        self.held_ends.clear();
        self.held_terms.clear();
        self.groups.clear();
    }

    /// Returns the first entry of each group, and the end of the last one.
    #[must_use]
    pub fn start(&self) -> &[u32] {
        &self.start
    }

    /// Returns the independent rate of each entry, ascending within a group; tips come first.
    #[must_use]
    pub fn dof(&self) -> &[u32] {
        &self.dof
    }

    /// Returns the entries of E: one number for each row of the group.
    #[must_use]
    pub fn e(&self) -> &[[f64; WIDTH]] {
        &self.e
    }

    /// Returns the groups.
    #[must_use]
    pub fn groups(&self) -> &[RowGroup] {
        &self.groups
    }

    /// Returns the number of independent rates of the units.
    #[must_use]
    pub fn independent(&self) -> usize {
        self.independent
    }

    /// Returns the number of rows of all groups.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.groups.iter().map(|g| g.n).sum()
    }

    /// Adds E*λ of one group to `y`.
    pub fn pull(&self, group: usize, lambda: &[f64; WIDTH], y: &mut [f64]) {
        let range = self.start[group] as usize..self.start[group + 1] as usize;
        for (dof, e) in self.dof[range.clone()].iter().zip(&self.e[range]) {
            let sum = e[0] * lambda[0] + e[1] * lambda[1] + (e[2] * lambda[2] + e[3] * lambda[3]);
            y[*dof as usize] += sum;
        }
    }

    /// Adds E y of one group to `v`: the effect of a motion `y` of the independent rates on its rows.
    pub fn push(&self, group: usize, y: &[f64], v: &mut [f64; WIDTH]) {
        let range = self.start[group] as usize..self.start[group + 1] as usize;
        for (dof, e) in self.dof[range.clone()].iter().zip(&self.e[range]) {
            for (v, e) in v.iter_mut().zip(e) {
                *v += e * y[*dof as usize];
            }
        }
    }

    /// Clears the rows that contain only round-off, because everything in a row cancels. An example are three of the five rows of a planar loop in
    /// space, which are redundant. Otherwise a solver that divides by W would divide round-off by round-off.
    pub fn silence_rounding(&mut self) {
        for (g, row) in self.groups.iter().enumerate() {
            let range = self.start[g] as usize..self.start[g + 1] as usize;
            let mut size = [0.0; WIDTH];
            for e in &self.e[range.clone()] {
                size.iter_mut().zip(e).for_each(|(s, e)| *s += e * e);
            }
            for lane in 0..row.n {
                if size[lane] <= ROUNDING * row.gross[lane] {
                    self.e[range.clone()].iter_mut().for_each(|e| e[lane] = 0.0);
                }
            }
        }
    }

    /// Sets the error of the last group's first row: a gap, rad or m.
    pub fn set_error(&mut self, error: f64) {
        if let Some(row) = self.groups.last_mut() {
            row.error[0] = error;
        }
    }

    /// Subtracts the part of the rows' forces λ (by group) at prescribed coordinates from the forces that [`Units::scatter`] has computed there, and
    /// gives aggregates their part before [`Units::constraint_forces`].
    pub fn relieve(
        &self,
        units: &Units,
        uw: &mut UnitsWork,
        lambda: impl Fn(usize) -> [f64; WIDTH],
        tau: &mut [f64],
    ) {
        for (group, v, e) in &self.held {
            let x = lambda(*group as usize);
            tau[*v as usize] -= e[0] * x[0] + e[1] * x[1] + (e[2] * x[2] + e[3] * x[3]);
        }
        for (group, slot, z) in &self.held_ends {
            let Unit::Aggregate(i) = units.units[units.of_slot[*slot as usize] as usize] else {
                continue;
            };
            let x = f64x4::new(lambda(*group as usize));
            let sum = |a: &V3<f64x4>| {
                V3::new((a.x * x).reduce_add(), (a.y * x).reduce_add(), (a.z * x).reduce_add())
            };
            let to = &mut uw.embedded[i as usize].z[units.member[*slot as usize] as usize];
            *to = *to + V6 { n: sum(&z.n), f: sum(&z.f) };
        }
        for (group, unit, d, c) in &self.held_terms {
            if let Unit::Aggregate(i) = units.units[*unit as usize] {
                let x = f64x4::new(lambda(*group as usize));
                uw.embedded[i as usize].tau[*d as usize] += (*c * x).reduce_add();
            }
        }
    }

    /// Returns the block W_gh = Σ e_g e_h* of two groups, row after row.
    #[must_use]
    pub fn block(&self, g: usize, h: usize) -> [[f64; WIDTH]; WIDTH] {
        let mut out = [f64x4::splat(0.0); WIDTH];
        self.meeting(g, h, |i, j| add_product(&mut out, &self.e[i as usize], &self.e[j as usize]));
        out.map(|row| row.to_array())
    }

    /// Appends the index pairs of entries of two groups that belong to the same rates to `out`, for [`RowSet::product`]. They remain valid as long as
    /// [`RowSet::start`] and [`RowSet::dof`] do not change.
    pub fn shared(&self, g: usize, h: usize, out: &mut Vec<Run>) {
        let before = out.len();
        self.meeting(g, h, |i, j| match out[before..].last_mut() {
            Some(run) if (run.i + run.n, run.j + run.n) == (i, j) => run.n += 1,
            _ => out.push(Run { i, j, n: 1 }),
        });
    }

    /// Computes [`RowSet::block`] of two groups from their [shared](RowSet::shared) entries.
    #[must_use]
    #[inline]
    pub fn product(&self, shared: &[Run]) -> [f64x4; WIDTH] {
        let mut out = [f64x4::splat(0.0); WIDTH];
        for run in shared {
            let (i, j, n) = (run.i as usize, run.j as usize, run.n as usize);
            for (left, right) in self.e[i..i + n].iter().zip(&self.e[j..j + n]) {
                add_product(&mut out, left, right);
            }
        }
        out
    }

    /// Calls `f` for the entries of two groups that belong to the same rate.
    fn meeting(&self, g: usize, h: usize, mut f: impl FnMut(u32, u32)) {
        let (end_i, end_j) = (self.start[g + 1], self.start[h + 1]);
        let (mut i, mut j) = (self.start[g], self.start[h]);
        while i < end_i && j < end_j {
            match self.dof[i as usize].cmp(&self.dof[j as usize]) {
                std::cmp::Ordering::Less => i += 1,
                std::cmp::Ordering::Greater => j += 1,
                std::cmp::Ordering::Equal => {
                    f(i, j);
                    (i, j) = (i + 1, j + 1);
                }
            }
        }
    }
}

/// Adds left right*, row after row.
#[inline(always)]
fn add_product(to: &mut [f64x4; WIDTH], left: &[f64; WIDTH], right: &[f64; WIDTH]) {
    let right = f64x4::new(*right);
    for (to, x) in to.iter_mut().zip(left) {
        *to = f64x4::splat(*x).mul_add(right, *to);
    }
}

/// Consecutive entries of two groups that belong to the same rates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Run {
    i: u32,
    j: u32,
    n: u32,
}
