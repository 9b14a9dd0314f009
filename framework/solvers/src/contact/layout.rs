//! The factor E laid out for sweeps: rows across degrees of freedom, four a vector, and one local copy
//! of y for groups that follow each other on the same degrees of freedom (points of one pair of bodies).
//!
//! ```text
//! run     groups on dofs d₁ … d_n;  local y = (y_d₁, …, y_d_n, 0 …), n4 vectors
//! group   n4 × rows vectors:        E_g y = Σ row · y,   y += Σ λ_k row_k
//! ```
//! So a group costs 2 × rows × n4 multiplications of vectors, and no index is looked up between the
//! groups of a run. Places beyond a run's degrees of freedom point at one more entry of y and are 0 in E.

use super::problem::Problem;
use std::ops::Range;
use wide::f64x4;

/// Groups that share degrees of freedom.
#[derive(Clone, Debug)]
pub(crate) struct Run {
    /// The groups.
    pub groups: Range<usize>,
    /// Places of their degrees of freedom, a multiple of four.
    dofs: Range<usize>,
    /// First vector of the first group.
    e: usize,
}

/// E and y of a problem; keeps its memory.
#[derive(Clone, Debug, Default)]
pub(crate) struct Layout {
    runs: Vec<Run>,
    dofs: Vec<u32>,
    e: Vec<f64x4>,
    local: Vec<f64x4>,
    /// Eᵀ λ, and one entry more.
    pub y: Vec<f64>,
}

impl Layout {
    /// From a problem. O(entries).
    pub fn set(&mut self, problem: &Problem) {
        self.runs.clear();
        self.dofs.clear();
        self.e.clear();
        let none = problem.factor.dofs as u32;
        self.y.clear();
        self.y.resize(problem.factor.dofs + 1, 0.0);
        let mut widest = 0;
        for (g, cone) in problem.cones.iter().enumerate() {
            let (dof, e) = problem.entries(g);
            match self.runs.last_mut() {
                Some(run) if problem.entries(g - 1).0 == dof => run.groups.end = g + 1,
                _ => {
                    let from = self.dofs.len();
                    self.dofs.extend_from_slice(dof);
                    self.dofs.resize(from + dof.len().next_multiple_of(4), none);
                    let dofs = from..self.dofs.len();
                    widest = widest.max(dofs.len() / 4);
                    self.runs.push(Run { groups: g..g + 1, dofs, e: self.e.len() });
                }
            }
            let rows = cone.rows();
            let mut chunks = e.chunks_exact(4);
            for e in chunks.by_ref() {
                let e = f64x4::transpose([0, 1, 2, 3].map(|k| f64x4::new(e[k])));
                self.e.extend_from_slice(&e[..rows]);
            }
            let rest = chunks.remainder();
            if !rest.is_empty() {
                let e = [0, 1, 2, 3].map(|k| f64x4::new(rest.get(k).copied().unwrap_or_default()));
                self.e.extend_from_slice(&f64x4::transpose(e)[..rows]);
            }
        }
        self.local.resize(widest, f64x4::splat(0.0));
    }

    /// y = Eᵀ λ.
    pub fn pull(&mut self, problem: &Problem, lambda: &[[f64; 4]]) {
        self.y.fill(0.0);
        self.each_run(problem, |g, e, y| spread(e, f64x4::new(lambda[g]), y));
    }

    /// Calls `f` with each group, its rows and the local y, in order; what `f` does to y is kept.
    #[inline(always)]
    pub fn each_run(
        &mut self,
        problem: &Problem,
        mut f: impl FnMut(usize, &[f64x4], &mut [f64x4]),
    ) {
        let y = &mut self.y;
        for run in &self.runs {
            let dofs = &self.dofs[run.dofs.clone()];
            let local = &mut self.local[..dofs.len() / 4];
            load(y, dofs, local);
            let mut at = run.e;
            for g in run.groups.clone() {
                let size = local.len() * problem.cones[g].rows();
                f(g, &self.e[at..at + size], local);
                at += size;
            }
            for (from, d) in local.iter().zip(dofs.chunks_exact(4)) {
                for (x, d) in from.to_array().into_iter().zip(d) {
                    y[*d as usize] = x;
                }
            }
        }
    }

    /// Calls `f` with each group, its rows and E_g y.
    #[inline(always)]
    pub fn each_velocity(&mut self, problem: &Problem, mut f: impl FnMut(usize, f64x4)) {
        for run in &self.runs {
            let dofs = &self.dofs[run.dofs.clone()];
            let local = &mut self.local[..dofs.len() / 4];
            load(&self.y, dofs, local);
            let mut at = run.e;
            for g in run.groups.clone() {
                let size = local.len() * problem.cones[g].rows();
                f(g, gathered(&self.e[at..at + size], local));
                at += size;
            }
        }
    }

    /// Calls `f` with each group and its E_g E_gᵀ.
    pub fn each_compliance(&self, problem: &Problem, mut f: impl FnMut(usize, [[f64; 4]; 4])) {
        for run in &self.runs {
            let mut at = run.e;
            for g in run.groups.clone() {
                let rows = problem.cones[g].rows();
                let size = run.dofs.len() / 4 * rows;
                f(g, compliance(&self.e[at..at + size], rows));
                at += size;
            }
        }
    }
}

/// The local copy of y.
#[inline(always)]
fn load(y: &[f64], dofs: &[u32], local: &mut [f64x4]) {
    for (to, d) in local.iter_mut().zip(dofs.chunks_exact(4)) {
        *to = f64x4::new([0, 1, 2, 3].map(|k| y[d[k] as usize]));
    }
}

/// E_g y.
#[inline(always)]
pub(crate) fn gathered(e: &[f64x4], y: &[f64x4]) -> f64x4 {
    let mut sum = [f64x4::splat(0.0); 4];
    if e.len() == 3 * y.len() {
        for (y, e) in y.iter().zip(e.as_chunks::<3>().0) {
            sum[0] = e[0].mul_add(*y, sum[0]);
            sum[1] = e[1].mul_add(*y, sum[1]);
            sum[2] = e[2].mul_add(*y, sum[2]);
        }
    } else if let Some(rows) = e.len().checked_div(y.len()) {
        for (y, e) in y.iter().zip(e.chunks_exact(rows.max(1))) {
            for (sum, e) in sum.iter_mut().zip(e) {
                *sum = e.mul_add(*y, *sum);
            }
        }
    }
    let [a, b, c, d] = f64x4::transpose(sum);
    (a + b) + (c + d)
}

/// y += E_gᵀ λ.
#[inline(always)]
pub(crate) fn spread(e: &[f64x4], lambda: f64x4, y: &mut [f64x4]) {
    let l = lambda.to_array().map(f64x4::splat);
    if e.len() == 3 * y.len() {
        for (y, e) in y.iter_mut().zip(e.as_chunks::<3>().0) {
            *y = e[2].mul_add(l[2], e[1].mul_add(l[1], e[0].mul_add(l[0], *y)));
        }
    } else if let Some(rows) = e.len().checked_div(y.len()) {
        for (y, e) in y.iter_mut().zip(e.chunks_exact(rows.max(1))) {
            for (e, l) in e.iter().zip(l) {
                *y = e.mul_add(l, *y);
            }
        }
    }
}

/// E_g E_gᵀ.
fn compliance(e: &[f64x4], rows: usize) -> [[f64; 4]; 4] {
    let mut W = [[f64x4::splat(0.0); 4]; 4];
    for e in e.chunks_exact(rows) {
        for i in 0..rows {
            for j in 0..=i {
                W[i][j] = e[i].mul_add(e[j], W[i][j]);
            }
        }
    }
    let mut out = W.map(|row| {
        let [a, b, c, d] = f64x4::transpose(row);
        ((a + b) + (c + d)).to_array()
    });
    for i in 0..4 {
        for j in 0..i {
            out[j][i] = out[i][j];
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::super::problem::Factor;
    use super::super::samples::{CONES, number};
    use super::*;

    /// Groups of one to four rows on 0 to 9 degrees of freedom, some side by side on the same ones:
    /// E y, Eᵀ λ and E Eᵀ as the entries give them.
    #[test]
    fn the_layout_multiplies_as_the_entries_do() {
        let (dofs, mut seed) = (11, 3);
        let lists: [&[u32]; 6] =
            [&[0, 2, 3], &[0, 2, 3], &[], &[1, 4, 5, 6], &[0, 1, 2, 3, 5, 7, 8, 9, 10], &[10]];
        let (mut cones, mut start, mut dof, mut e) = (vec![], vec![0], vec![], vec![]);
        for (list, cone) in lists.iter().flat_map(|l| CONES.iter().map(move |c| (l, c))) {
            cones.push(*cone);
            for d in *list {
                dof.push(*d);
                let mut row = [0.0; 4];
                row[..cone.rows()].fill_with(|| number(&mut seed));
                e.push(row);
            }
            start.push(dof.len() as u32);
        }
        let b = vec![[0.0; 4]; cones.len()];
        let factor = Factor { start: &start, dof: &dof, e: &e, dofs };
        let problem = Problem::new(factor, &cones, &b, &[]).expect("a good problem");
        let mut layout = Layout::default();
        layout.set(&problem);
        let lambda: Vec<[f64; 4]> = (cones.iter())
            .map(|c| {
                let mut l = [0.0; 4];
                l[..c.rows()].fill_with(|| number(&mut seed));
                l
            })
            .collect();
        layout.pull(&problem, &lambda);
        let mut y = vec![0.0; dofs];
        (0..cones.len()).for_each(|g| problem.scatter(g, &lambda[g], &mut y));
        let near = |a: &[f64], b: &[f64]| {
            assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-13), "{a:?} {b:?}");
        };
        near(&layout.y[..dofs], &y);
        assert_eq!(layout.y[dofs], 0.0);
        let mut seen = 0;
        layout.each_velocity(&problem, |g, v| {
            assert_eq!(g, seen);
            seen += 1;
            near(&v.to_array(), &problem.gathered(g, &y));
        });
        assert_eq!(seen, cones.len());
        layout.each_compliance(&problem, |g, W| {
            for i in 0..4 {
                let row: [f64; 4] =
                    std::array::from_fn(|j| problem.entries(g).1.iter().map(|e| e[i] * e[j]).sum());
                near(&W[i], &row);
            }
        });
        // Runs: what one does to y the next one sees.
        let before = layout.y.clone();
        layout.each_run(&problem, |g, e, y| spread(e, f64x4::new(lambda[g]), y));
        let twice: Vec<f64> = before.iter().map(|y| 2.0 * y).collect();
        near(&layout.y, &twice);
        assert!(layout.runs.len() < cones.len());
    }
}
