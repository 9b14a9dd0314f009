//! Bristles of compliant contact: which bristle belongs to which pair of colliders.
//!
//! Usually each pair that may meet has its own bristle. The number of pairs grows with the square of the number of machines, but few pairs touch at
//! the same time. Where there are more pairs than [`touching_max`](crate::CompliantLaws::touching_max) or than the usual limit, the limit is the
//! number of bristles, and pairs share them. The table of pairs is a state of the caller: one number for each bristle.
//! ```text
//! entry      1 + a n + b for colliders a < b of n; 0: the bristle is free, and its deflection is zero
//! stage      a touching pair that is not in the table uses the first free bristle from a place that follows from its number
//! boundary   of a step: pairs that touch and are not in the table are entered with the bristle that they used at this state
//!            pairs that are apart and whose bristle has relaxed are removed; if no bristle is free, also pairs that are apart
//! ```
//! Within a step the table is constant and each evaluation is a function of table and state. Nothing depends on earlier evaluations, so rejected steps,
//! differences for a Jacobian, and the location of events need no special treatment. Pairs are entered in the order of the names of
//! their colliders. A pair first touches with a deflection of zero, as a pair that has its own bristle does.

use crate::compliant::{CompliantLaws, CompliantSettings};
use linkwork_collision::{ColliderId, Colliders};
use std::mem::take;
use thiserror::Error;

/// Number of states per bristle.
pub const BRISTLE: usize = 4;

/// Usual limit of touching pairs for each collider. A stable packing of rigid bodies has about as many contacts as degrees of freedom, six per body.
const TOUCHING_EACH: usize = 6;
/// Least usual limit of touching pairs.
const TOUCHING_MIN: usize = 256;
/// Deflection (m or rad) below which a bristle has relaxed: it is lost in the round-off of any deflection that it could add to.
const RELAXED: f64 = 1e-24;

/// More pairs touch than there are bristles.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error(
    "compliant contact: {touching} pairs of colliders touch at the same time, and there are bristles for {bristles}\n  help: write `touching_max: {wanted}` in `contact`; each pair adds {BRISTLE} states",
    wanted = touching + touching / 2
)]
pub struct TooManyTouch {
    /// Number of pairs that touch.
    pub touching: usize,
    /// Number of bristles.
    pub bristles: usize,
}

/// A pair with a bristle.
#[derive(Clone, Copy)]
struct Owner {
    pair: (u32, u32),
    bristle: u32,
    settings: CompliantSettings,
}

/// The bristles of the pairs of one set of colliders. It is work space: the table belongs to the caller.
pub(crate) struct Bristles {
    count: usize,
    /// Number of colliders.
    colliders: u32,
    shared: bool,
    /// Pairs with a bristle, ascending.
    owners: Vec<Owner>,
    /// The table that `owners` were taken from.
    table: Vec<f64>,
    /// Says for each bristle whether it is in use, by an owner or in this evaluation.
    used: Vec<bool>,
    /// Bristles in use in this evaluation only.
    lent: Vec<u32>,
    /// Memory for the next table, and for pairs that found no free bristle.
    next: Vec<f64>,
    without: Vec<(u32, u32)>,
}

/// Returns the pairs of colliders that can collide, ascending.
fn pairs(colliders: &Colliders) -> impl Iterator<Item = (ColliderId, ColliderId)> + '_ {
    let ids = colliders.ids();
    ids.flat_map(move |a| {
        let others = colliders.ids().skip(a.index() + 1);
        others.filter(move |b| colliders.meet(a, *b)).map(move |b| (a, b))
    })
}

/// Returns the number of bristles, and whether pairs share them.
pub(crate) fn count(colliders: &Colliders, laws: &CompliantLaws) -> (usize, bool) {
    let usual = (TOUCHING_EACH * colliders.len()).max(TOUCHING_MIN);
    let most = laws.touching_max.map_or(usual, |n| n as usize);
    let pairs = pairs(colliders).count();
    (pairs.min(most), pairs > most)
}

impl Bristles {
    pub fn new(colliders: &Colliders, laws: &CompliantLaws) -> Self {
        let (count, shared) = count(colliders, laws);
        let n = colliders.len() as u32;
        if shared {
            return Self::shared(n, count);
        }
        let owner = |(bristle, (a, b)): (u32, (ColliderId, ColliderId))| {
            let settings = laws.of(colliders, (a, b));
            Owner { pair: (a.index() as u32, b.index() as u32), bristle, settings }
        };
        let owners = (0..).zip(pairs(colliders)).map(owner).collect();
        Self { count, shared, owners, ..Self::shared(n, 0) }
    }

    /// Bristles that the pairs of some colliders share; all are free.
    fn shared(colliders: u32, count: usize) -> Self {
        Self {
            count,
            colliders,
            shared: true,
            owners: Vec::with_capacity(count),
            table: vec![0.0; count],
            used: vec![false; count],
            lent: Vec::with_capacity(count),
            next: vec![0.0; count],
            without: Vec::with_capacity(count),
        }
    }

    fn entry(&self, (a, b): (u32, u32)) -> f64 {
        (u64::from(a) * u64::from(self.colliders) + u64::from(b) + 1) as f64
    }

    /// Returns the pair of an entry; `None` when the bristle is free, or when somebody set an entry that cannot be a pair.
    fn pair(&self, entry: f64) -> Option<(u32, u32)> {
        let n = f64::from(self.colliders);
        if !(entry >= 1.0 && entry <= n * n && entry.fract() == 0.0) {
            return None;
        }
        let at = entry as u64 - 1;
        let (a, b) = (at / u64::from(self.colliders), at % u64::from(self.colliders));
        (a < b).then_some((a as u32, b as u32))
    }

    /// Prepares an evaluation with a table.
    pub fn begin(&mut self, table: &[f64], of: impl Fn((u32, u32)) -> CompliantSettings) {
        self.release();
        if !self.shared || self.table == table {
            return;
        }
        self.table.copy_from_slice(table);
        self.owners.clear();
        for (bristle, entry) in (0..).zip(table) {
            if let Some(pair) = self.pair(*entry) {
                self.owners.push(Owner { pair, bristle, settings: of(pair) });
            }
        }
        self.owners.sort_unstable_by_key(|o| (o.pair, o.bristle));
        // Keep one bristle for each pair.
        self.owners.dedup_by_key(|o| o.pair);
        self.used.fill(false);
        for owner in &self.owners {
            self.used[owner.bristle as usize] = true;
        }
    }

    /// Returns the settings of a touching pair, and its bristle, which is `None` if all are in use. Call it for the touching pairs in their order,
    /// after [`Bristles::begin`].
    pub fn of(
        &mut self,
        pair: (u32, u32),
        of: impl Fn((u32, u32)) -> CompliantSettings,
    ) -> (CompliantSettings, Option<usize>) {
        match self.owners.binary_search_by_key(&pair, |o| o.pair) {
            Ok(at) => (self.owners[at].settings, Some(self.owners[at].bristle as usize)),
            Err(_) => (of(pair), self.lend(pair)),
        }
    }

    /// Returns the first free bristle from a place that follows from the pair, so that it rarely depends on which other pairs begin to touch.
    fn lend(&mut self, pair: (u32, u32)) -> Option<usize> {
        if self.owners.len() + self.lent.len() >= self.count {
            return None;
        }
        let mixed = (self.entry(pair) as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 32;
        let mut at = mixed as usize % self.count;
        while self.used[at] {
            at = if at + 1 == self.count { 0 } else { at + 1 };
        }
        self.used[at] = true;
        self.lent.push(at as u32);
        Some(at)
    }

    /// Enters pairs that touch (ascending, each once) into the table of the last [`Bristles::begin`], and removes those whose bristle has relaxed.
    /// Returns whether deflections changed.
    pub fn assign(
        &mut self,
        touching: &[(u32, u32)],
        bristles: &mut [f64],
        table: &mut [f64],
    ) -> Result<bool, TooManyTouch> {
        if touching.len() > self.count {
            return Err(TooManyTouch { touching: touching.len(), bristles: self.count });
        }
        self.release();
        let (mut next, mut without) = (take(&mut self.next), take(&mut self.without));
        next.fill(0.0);
        without.clear();
        for pair in touching {
            let entered = self.owners.binary_search_by_key(pair, |o| o.pair);
            let own = entered.ok().map(|k| self.owners[k].bristle as usize);
            match own.or_else(|| self.lend(*pair)) {
                Some(bristle) => next[bristle] = self.entry(*pair),
                None => without.push(*pair),
            }
        }
        // Pairs that are apart keep their bristles until these have relaxed, as long as there are enough for those that touch.
        let apart = |o: &&Owner| touching.binary_search(&o.pair).is_err();
        let state = |o: &Owner| &bristles[BRISTLE * o.bristle as usize..][..BRISTLE];
        let bent = |o: &&Owner| state(o).iter().any(|z| z.abs() > RELAXED);
        let free = self.count - self.owners.len() - self.lent.len();
        let relaxed = self.owners.iter().filter(apart).filter(|o| !bent(o)).count();
        let missing = without.len().saturating_sub(free + relaxed);
        for owner in self.owners.iter().filter(apart).filter(bent).skip(missing) {
            next[owner.bristle as usize] = self.entry(owner.pair);
        }
        let mut changed = false;
        let mut without_one = without.iter();
        for (state, entry) in bristles.chunks_exact_mut(BRISTLE).zip(next.iter_mut()) {
            if *entry != 0.0 {
                continue;
            }
            changed |= state.iter().any(|z| *z != 0.0);
            state.fill(0.0);
            if let Some(pair) = without_one.next() {
                *entry = self.entry(*pair);
                changed = true;
            }
        }
        table.copy_from_slice(&next);
        (self.next, self.without) = (next, without);
        Ok(changed)
    }

    /// Takes back the bristles of the last evaluation.
    fn release(&mut self) {
        for bristle in self.lent.drain(..) {
            self.used[bristle as usize] = false;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn settings(_: (u32, u32)) -> CompliantSettings {
        CompliantSettings::default()
    }

    /// Evaluates touching pairs, and assigns at the same state. Returns the bristle of each in the evaluation.
    fn step(
        bristles: &mut Bristles,
        touching: &[(u32, u32)],
        (x, table): (&mut [f64], &mut [f64]),
    ) -> (Vec<Option<usize>>, Result<bool, TooManyTouch>) {
        bristles.begin(table, settings);
        let used = touching.iter().map(|p| bristles.of(*p, settings).1).collect();
        (used, bristles.assign(touching, x, table))
    }

    /// The pair of each bristle.
    fn pairs(bristles: &Bristles, table: &[f64]) -> Vec<Option<(u32, u32)>> {
        table.iter().map(|entry| bristles.pair(*entry)).collect()
    }

    #[test]
    fn a_pair_keeps_the_bristle_that_it_used_when_it_began_to_touch() {
        let (mut all, mut x, mut table) = (Bristles::shared(100, 7), vec![0.0; 28], vec![0.0; 7]);
        let touching = [(0, 1), (3, 99), (50, 51), (98, 99)];
        let (first, _) = step(&mut all, &touching[1..3], (&mut x, &mut table));
        // An evaluation with another workspace gives the same result.
        let mut other = Bristles::shared(100, 7);
        for work in [&mut all, &mut other] {
            let (used, changed) = step(work, &touching, (&mut x, &mut table.clone()));
            assert_eq!(used[1..3], first[..]);
            assert_eq!(changed, Ok(false));
            let mut distinct = used.clone();
            distinct.sort_unstable();
            distinct.dedup();
            assert_eq!(distinct.len(), 4, "{used:?}");
        }
        let (used, _) = step(&mut all, &touching, (&mut x, &mut table));
        for (pair, bristle) in touching.iter().zip(used) {
            assert_eq!(all.pair(table[bristle.unwrap()]), Some(*pair));
        }
    }

    #[test]
    fn a_pair_that_is_apart_leaves_when_its_bristle_has_relaxed() {
        let (mut all, mut x, mut table) = (Bristles::shared(9, 3), vec![0.0; 12], vec![0.0; 3]);
        let (used, _) = step(&mut all, &[(2, 5)], (&mut x, &mut table));
        let at = used[0].unwrap();
        x[4 * at + 3] = -1e-20;
        assert_eq!(step(&mut all, &[], (&mut x, &mut table)).1, Ok(false));
        assert_eq!(pairs(&all, &table)[at], Some((2, 5)));
        x[4 * at + 3] = -1e-25;
        assert_eq!(step(&mut all, &[], (&mut x, &mut table)).1, Ok(true));
        assert_eq!((pairs(&all, &table), &x[..]), (vec![None; 3], &[0.0; 12][..]));
    }

    #[test]
    fn pairs_that_touch_take_the_bristles_of_pairs_that_are_apart_only_where_none_is_free() {
        let (mut all, mut x, mut table) = (Bristles::shared(9, 3), vec![0.0; 12], vec![0.0; 3]);
        step(&mut all, &[(0, 1), (0, 2)], (&mut x, &mut table)).1.unwrap();
        x.fill(1e-3);
        // The third bristle is free; it is set to zero only when no pair uses it.
        let (used, changed) = step(&mut all, &[(0, 3)], (&mut x, &mut table));
        assert_eq!((used[0].is_some(), changed), (true, Ok(false)));
        assert_eq!(pairs(&all, &table).iter().flatten().count(), 3);
        // No bristle is free. The pair uses no bristle in the evaluation, and gets the bristle of (0, 1) afterwards.
        let (used, changed) = step(&mut all, &[(0, 3), (7, 8)], (&mut x, &mut table));
        assert_eq!((used[1], changed), (None, Ok(true)));
        let mut now: Vec<_> = pairs(&all, &table).into_iter().flatten().collect();
        now.sort_unstable();
        assert_eq!(now, [(0, 2), (0, 3), (7, 8)]);
        let own = table.iter().position(|e| all.pair(*e) == Some((7, 8))).unwrap();
        assert_eq!(
            (&x[4 * own..4 * own + 4], x.iter().filter(|z| **z != 0.0).count()),
            (&[0.0; 4][..], 8)
        );
        let told = step(&mut all, &[(0, 3), (1, 2), (4, 5), (7, 8)], (&mut x, &mut table)).1;
        assert_eq!(told, Err(TooManyTouch { touching: 4, bristles: 3 }));
    }

    /// A variable can be set to any number. An entry that cannot be a pair, or repeats one, counts as free.
    #[test]
    fn entries_that_are_no_pairs_count_as_free() {
        let (mut all, mut x) = (Bristles::shared(9, 5), vec![1.0; 20]);
        let pair = all.entry((2, 5));
        let mut table = vec![pair, f64::NAN, -3.0, pair, 1e300];
        step(&mut all, &[], (&mut x, &mut table)).1.unwrap();
        assert_eq!(pairs(&all, &table), [Some((2, 5)), None, None, None, None]);
        assert_eq!(x[4..], [0.0; 16]);
    }
}
