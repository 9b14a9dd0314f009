//! Clusters of degrees of freedom, and contacts sorted so that four neighbours in order touch different clusters.
//!
//! ```text
//! cluster    neighbouring degrees of freedom that every group touches all or none of: the six of a free body
//! colour     each contact takes the first colour that neither of its clusters has yet
//! batch      four contacts of one colour
//! ```
//! Colours are assigned in the order of the groups, so that they depend only on the problem.

use super::super::problem::{Cone, Problem};
use super::super::room;
use super::NONE;

/// Maximum number of degrees of freedom of a cluster, for contacts that are solved in batches.
pub(super) const SIX: usize = 6;
/// Maximum number of colours: bits of a mask.
const COLOURS: usize = 64;
/// Contacts of a batch with fewer than this are solved one by one instead.
const LEAST: usize = 2;
/// Minimum number of batched contacts to use batches, and minimum mean number of contacts per batch.
const FEWEST: usize = 24;
const FILL: f64 = 2.5;

/// A contact that can be in a batch, with its clusters; [`NONE`] if it has only one.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ends {
    pub group: u32,
    pub clusters: [u32; 2],
    colour: u32,
}

/// Clusters and colours of a problem; reuses its memory.
#[derive(Clone, Debug, Default)]
pub(crate) struct Colours {
    cut: Vec<bool>,
    cluster: Vec<u32>,
    size: Vec<u32>,
    ends: Vec<Ends>,
    used: Vec<u64>,
    count: Vec<usize>,
    /// Contacts by colour.
    pub(super) order: Vec<Ends>,
    /// End of each batch in `order`.
    pub(super) batches: Vec<(u32, u32)>,
    /// Groups that are solved one by one, ascending.
    pub singles: Vec<u32>,
}

impl Colours {
    /// Sorts the groups of a problem. Returns false if there are too few contacts for batches to be faster.
    pub fn set(&mut self, problem: &Problem) -> bool {
        self.singles.clear();
        if problem.groups() < FEWEST || !problem.r.is_empty() {
            return false;
        }
        self.clusters(problem);
        self.contacts(problem);
        if self.ends.len() < FEWEST {
            return false;
        }
        self.colour();
        self.sort();
        let batched: usize = self.batches.iter().map(|(a, b)| (b - a) as usize).sum();
        if batched < FEWEST || (batched as f64) < FILL * self.batches.len() as f64 {
            return false;
        }
        self.singles.sort_unstable();
        true
    }

    /// Returns the sizes of the clusters.
    pub fn sizes(&self) -> &[u32] {
        &self.size
    }

    /// Allocates for the given numbers of groups and degrees of freedom.
    pub fn reserve(&mut self, groups: usize, dofs: usize) {
        room(&mut self.cut, dofs + 1);
        room(&mut self.cluster, dofs);
        room(&mut self.size, dofs);
        room(&mut self.used, dofs);
        room(&mut self.ends, groups);
        room(&mut self.order, groups);
        room(&mut self.singles, groups);
        room(&mut self.batches, groups / 4 + COLOURS);
        room(&mut self.count, COLOURS);
    }

    fn clusters(&mut self, problem: &Problem) {
        let n = problem.factor.dofs;
        self.cut.clear();
        self.cut.resize(n + 1, false);
        for g in 0..problem.groups() {
            let (dof, _) = problem.entries(g);
            let (Some(first), Some(last)) = (dof.first(), dof.last()) else { continue };
            self.cut[*first as usize] = true;
            self.cut[*last as usize + 1] = true;
            for pair in dof.windows(2).filter(|p| p[1] != p[0] + 1) {
                self.cut[pair[0] as usize + 1] = true;
                self.cut[pair[1] as usize] = true;
            }
        }
        self.size.clear();
        self.cluster.clear();
        for d in 0..n {
            if self.cut[d] || d == 0 {
                self.size.push(0);
            }
            self.cluster.push(self.size.len() as u32 - 1);
            if let Some(size) = self.size.last_mut() {
                *size += 1;
            }
        }
    }

    /// Finds contacts with friction on one or two clusters of at most six; all others are solved one by one.
    fn contacts(&mut self, problem: &Problem) {
        self.ends.clear();
        for (g, cone) in problem.cones.iter().enumerate() {
            let (dof, _) = problem.entries(g);
            let group = g as u32;
            let end = |k: usize| dof.get(k).map_or(NONE, |d| self.cluster[*d as usize]);
            let clusters = [end(0), end(SIX)];
            let six = |c: u32| c == NONE || self.size[c as usize] as usize == SIX;
            let fits = matches!(cone, Cone::Coulomb { .. })
                && (dof.len() == SIX || dof.len() == 2 * SIX)
                && clusters.iter().all(|c| six(*c));
            if fits {
                self.ends.push(Ends { group, clusters, colour: NONE });
            } else {
                self.singles.push(group);
            }
        }
    }

    fn colour(&mut self) {
        self.used.clear();
        self.used.resize(self.size.len(), 0);
        self.count.clear();
        self.count.resize(COLOURS, 0);
        for end in &mut self.ends {
            let [a, b] = end.clusters;
            let taken = self.used[a as usize] | self.used.get(b as usize).copied().unwrap_or(0);
            let colour = taken.trailing_ones();
            if colour as usize >= COLOURS {
                self.singles.push(end.group);
                continue;
            }
            end.colour = colour;
            self.count[colour as usize] += 1;
            for c in [a, b].into_iter().filter(|c| *c != NONE) {
                self.used[c as usize] |= 1 << colour;
            }
        }
    }

    /// Sorts contacts by colour, in batches of four.
    fn sort(&mut self) {
        let mut begin = 0;
        self.batches.clear();
        for count in &mut self.count {
            let (from, n) = (begin, *count);
            begin += n;
            *count = from;
            for first in (from..begin).step_by(4) {
                self.batches.push((first as u32, (first + 4).min(begin) as u32));
            }
        }
        let empty = Ends { group: NONE, clusters: [NONE; 2], colour: NONE };
        self.order.clear();
        self.order.resize(begin, empty);
        for end in self.ends.iter().filter(|e| e.colour != NONE) {
            let at = &mut self.count[end.colour as usize];
            self.order[*at] = *end;
            *at += 1;
        }
        let (order, singles) = (&self.order, &mut self.singles);
        self.batches.retain(|(from, to)| {
            let few = ((to - from) as usize) < LEAST;
            if few {
                singles.extend(order[*from as usize..*to as usize].iter().map(|e| e.group));
            }
            !few
        });
    }
}
