//! How a variable is spread over time, in fixed memory: values with the time that each was held, of which neighbours
//! are joined when there is no more room.
//!
//! ```text
//! values  sorted, each with a weight (the time, s)
//! join    neighbours whose weights together are at most 4 q (1−q) W / N, with q the share of the time below them
//! ```
//! So the tails stay fine (a merging t-digest, Dunning and Ertl 2019, with the scale function k₂ without its logarithm).
//! Up to [`ROOM`] values nothing is joined, and a percentile is exact for held values.
use serde::{Deserialize, Serialize};

/// Values that are kept before neighbours are joined, and how many are left at the most.
const ROOM: usize = 8192;
const LEFT: f64 = 1024.0;

/// Values and the time that each was held (s).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Quantiles {
    values: Vec<(f64, f64)>,
    /// Whether some values stand for several.
    joined: bool,
}

impl Quantiles {
    /// With the memory for all that is to come.
    pub fn with_room() -> Quantiles {
        Quantiles { values: Vec::with_capacity(ROOM), joined: false }
    }

    /// After it was read from a file: the memory for all that is to come.
    pub fn make_room(&mut self) {
        self.values.truncate(ROOM);
        self.values.reserve_exact(ROOM - self.values.len());
    }

    /// A value and its time.
    pub fn add(&mut self, value: f64, time: f64) {
        if !(time > 0.0) {
            return;
        }
        if let Some(last) = self.values.last_mut().filter(|last| last.0 == value) {
            last.1 += time;
            return;
        }
        if self.values.len() == ROOM {
            self.join();
        }
        self.values.push((value, time));
    }

    fn sort(values: &mut [(f64, f64)]) {
        // In place, without allocating; equal values in any order are the same multiset.
        values.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    }

    fn join(&mut self) {
        Self::sort(&mut self.values);
        let total: f64 = self.values.iter().map(|v| v.1).sum();
        let (mut below, mut kept) = (0.0, 0);
        for k in 1..self.values.len() {
            let (value, time) = self.values[k];
            let (own, weight) = self.values[kept];
            let together = weight + time;
            let q = (below + 0.5 * together) / total;
            if own == value || together <= 4.0 * q * (1.0 - q) * total / LEFT {
                self.joined |= own != value;
                self.values[kept] = (own + (value - own) * (time / together), together);
            } else {
                below += weight;
                kept += 1;
                self.values[kept] = (value, time);
            }
        }
        self.values.truncate(kept + 1);
        // Weights so uneven that nothing may be joined: the lightest half goes into its neighbours.
        if self.values.len() > ROOM / 2 {
            let pairs = self.values.len() / 2;
            for k in 0..pairs {
                let ((a, m), (b, n)) = (self.values[2 * k], self.values[2 * k + 1]);
                self.values[k] = (a + (b - a) * (n / (m + n)), m + n);
            }
            if self.values.len() % 2 == 1 {
                self.values[pairs] = self.values[2 * pairs];
            }
            self.values.truncate(pairs + self.values.len() % 2);
            self.joined = true;
        }
    }

    /// The value that the variable was below for this share of the time; between two values in proportion to the
    /// time when it varies without jumps. `None` of nothing.
    pub fn at(&self, share: f64, smooth: bool) -> Option<f64> {
        let mut values = self.values.clone();
        Self::sort(&mut values);
        let total: f64 = values.iter().map(|v| v.1).sum();
        let (first, last) = (values.first()?.0, values.last()?.0);
        let target = share * total;
        let smooth = smooth || self.joined;
        let mut below = 0.0;
        // Each value stands in the middle of its time.
        let mut before: Option<(f64, f64)> = None;
        for (value, time) in values {
            if !smooth {
                // Rounding of sums must not make the next value of one whose time is just over.
                if below + time >= target * (1.0 - 1e-12) {
                    return Some(value);
                }
            } else {
                let middle = below + 0.5 * time;
                if middle >= target {
                    let Some((at, own)) = before else { return Some(first) };
                    let part = (target - at) / (middle - at);
                    return Some(own + part * (value - own));
                }
                before = Some((middle, value));
            }
            below += time;
        }
        Some(last)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_of_held_values_are_exact_and_of_many_values_nearly() {
        let mut q = Quantiles::with_room();
        for (value, time) in [(3.0, 1.0), (1.0, 2.0), (2.0, 1.0), (1.0, 1.0)] {
            q.add(value, time);
        }
        let at = |share| q.at(share, false).unwrap();
        assert_eq!(
            (at(0.0), at(0.59), at(0.6), at(0.61), at(0.8), at(0.81), at(1.0)),
            (1.0, 1.0, 1.0, 2.0, 2.0, 3.0, 3.0)
        );
        assert_eq!(Quantiles::with_room().at(0.5, true), None);
        // A million values in an order that is none: x² of a uniform x has the percentile p².
        let mut q = Quantiles::with_room();
        for k in 0..1_000_000_u64 {
            let x = (k * 382_293 % 1_000_000) as f64 * 1e-6;
            q.add(x * x, 1e-3);
        }
        assert!(q.values.len() <= ROOM && q.values.capacity() == ROOM, "fixed memory");
        for p in [0.001, 0.01, 0.25, 0.5, 0.95, 0.99, 0.999] {
            let found = q.at(p, true).unwrap();
            // Of the rank: q (1 - q) / 256.
            let rank = found.sqrt();
            assert!((rank - p).abs() < p * (1.0 - p) / 100.0 + 2e-6, "{p}: {rank}");
        }
    }
}
