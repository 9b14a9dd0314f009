//! Distribution of a variable over time with constant memory: values, each with the time for which it was held. Neighbouring values are merged when
//! the memory is full.
//!
//! ```text
//! values  sorted, each with a weight (the time, s), and the part of it in which the variable passed through the value
//!         without staying (all of it for samples of a smooth variable, none for held values)
//! merge   neighbours whose weights together are at most 4 q (1−q) W / N, with q the fraction of the time below them
//! ```
//! The tails therefore keep a fine resolution (a merging t-digest, Dunning and Ertl 2019, with the scale function k₂ without its logarithm). Up to
//! [`ROOM`] values nothing is merged, and a percentile of held values is exact.
use serde::{Deserialize, Serialize};

/// Number of values that are kept before neighbours are merged, and largest number after that.
const ROOM: usize = 8192;
const LEFT: f64 = 1024.0;

/// A value, its time (s), and the part of the time (s) in which the variable moved on.
type Mass = (f64, f64, f64);

/// Values and the time for which each was held (s).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Quantiles {
    values: Vec<Mass>,
}

impl Quantiles {
    /// Allocates the memory for all values.
    pub fn with_room() -> Quantiles {
        Quantiles { values: Vec::with_capacity(ROOM) }
    }

    /// Allocates the memory for all values again, after reading from a file.
    pub fn make_room(&mut self) {
        self.values.truncate(ROOM);
        self.values.reserve_exact(ROOM - self.values.len());
    }

    /// Adds a value that is held for a time.
    pub fn hold(&mut self, value: f64, time: f64) {
        self.add((value, time, 0.0));
    }

    /// Adds a value that the variable passes through in the middle of a time.
    pub fn pass(&mut self, value: f64, time: f64) {
        self.add((value, time, time));
    }

    fn add(&mut self, (value, time, moving): Mass) {
        if !(time > 0.0) {
            return;
        }
        if let Some(last) = self.values.last_mut().filter(|last| last.0 == value) {
            (last.1, last.2) = (last.1 + time, last.2 + moving);
            return;
        }
        if self.values.len() == ROOM {
            self.join();
        }
        self.values.push((value, time, moving));
    }

    /// Sorts in place, without allocating memory.
    fn sort(values: &mut [Mass]) {
        values.sort_unstable_by(|a, b| {
            a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)).then(a.2.total_cmp(&b.2))
        });
    }

    fn join(&mut self) {
        Self::sort(&mut self.values);
        let total: f64 = self.values.iter().map(|v| v.1).sum();
        let (mut below, mut kept) = (0.0, 0);
        for k in 1..self.values.len() {
            let (own, next) = (self.values[kept], self.values[k]);
            let together = own.1 + next.1;
            let q = (below + 0.5 * together) / total;
            if own.0 == next.0 || together <= 4.0 * q * (1.0 - q) * total / LEFT {
                self.values[kept] = joined(own, next);
            } else {
                below += own.1;
                kept += 1;
                self.values[kept] = next;
            }
        }
        self.values.truncate(kept + 1);
        // If weights are very uneven, few merges are possible; then merge each value with its
        // neighbour.
        if self.values.len() > ROOM / 2 {
            let n = self.values.len();
            for k in 0..n.div_ceil(2) {
                let one = self.values[2 * k];
                let other = self.values.get(2 * k + 1).copied();
                self.values[k] = other.map_or(one, |other| joined(one, other));
            }
            self.values.truncate(n.div_ceil(2));
        }
    }

    /// Returns the value below which the variable was for this fraction of the time; `None` without values. `ends`: the smallest and the largest value.
    pub fn at(&self, share: f64, ends: (f64, f64)) -> Option<f64> {
        let mut values = self.values.clone();
        Self::sort(&mut values);
        let total: f64 = values.iter().map(|v| v.1).sum();
        // Round-off of the sums must not select the next value.
        let target = share * total * (1.0 - 1e-12);
        let (mut below, mut last): (f64, Option<(f64, f64)>) = (0.0, Some((0.0, ends.0)));
        if values.is_empty() {
            return None;
        }
        for (value, time, moving) in values {
            // The variable is constant in the middle part of its time, and changes linearly before
            // and after.
            let (from, to) = (below + 0.5 * moving, below + time - 0.5 * moving);
            if target <= from
                && let Some((at, before)) = last
                && from > at
            {
                return Some(before + (target - at) / (from - at) * (value - before));
            }
            if target <= to {
                return Some(value);
            }
            last = Some((to, value));
            below += time;
        }
        // Between the middle of the last time in which the variable moved and the end of this time.
        let (at, value) = last?;
        let part = if total > at { (target - at) / (total - at) } else { 0.0 };
        Some(value + part.clamp(0.0, 1.0) * (ends.1 - value))
    }
}

/// Merges two values. If they are different, the result stands for all values between them.
fn joined(a: Mass, b: Mass) -> Mass {
    let time = a.1 + b.1;
    let moving = if a.0 == b.0 { a.2 + b.2 } else { time };
    (a.0 + (b.0 - a.0) * (b.1 / time), time, moving)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_of_held_values_are_exact_and_of_many_values_nearly() {
        let mut q = Quantiles::with_room();
        for (value, time) in [(3.0, 1.0), (1.0, 2.0), (2.0, 1.0), (1.0, 1.0)] {
            q.hold(value, time);
        }
        let at = |share| q.at(share, (1.0, 3.0)).unwrap();
        assert_eq!(
            (at(0.0), at(0.59), at(0.6), at(0.61), at(0.8), at(0.81), at(1.0)),
            (1.0, 1.0, 1.0, 2.0, 2.0, 3.0, 3.0)
        );
        assert_eq!(Quantiles::with_room().at(0.5, (f64::INFINITY, f64::NEG_INFINITY)), None);
        // A million values in irregular order: x² of a uniform x has the percentile p².
        let mut q = Quantiles::with_room();
        for k in 0..1_000_000_u64 {
            let x = (k * 382_293 % 1_000_000) as f64 * 1e-6;
            q.pass(x * x, 1e-3);
        }
        assert!(q.values.len() <= ROOM && q.values.capacity() == ROOM, "fixed memory");
        for p in [0.001, 0.01, 0.25, 0.5, 0.95, 0.99, 0.999] {
            let found = q.at(p, (0.0, 1.0)).unwrap();
            // The error of the rank is q (1 - q) / 256.
            let rank = found.sqrt();
            assert!((rank - p).abs() < p * (1.0 - p) / 100.0 + 2e-6, "{p}: {rank}");
        }
    }
}
