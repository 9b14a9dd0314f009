//! Schedule of actions at the first tick at or after each multiple of a period.
//!
//! The schedule is exact: the next tick is computed in integers, so that a period such as 1/3 s neither drifts nor overflows in a run of years. The
//! query costs one comparison.
use crate::author::time::Seconds;

/// Multiples of a period at the ticks of a base.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Schedule {
    period: Seconds,
    base: Seconds,
    /// The first tick at or after the next multiple; `u64::MAX` if it is too large.
    next: u64,
}

impl Schedule {
    /// Creates a schedule from `tick` on, which is itself due if it is the first tick at or after a multiple of the period.
    pub fn from(tick: u64, base: Seconds, period: Seconds) -> Schedule {
        // Index of the first multiple after the previous tick.
        let before = tick.checked_sub(1).map_or(0, |t| multiples(t, base, period) + 1);
        Schedule { period, base, next: tick_of(before, base, period) }
    }

    /// Creates a schedule after `tick`, which itself is not due.
    pub fn after(tick: u64, base: Seconds, period: Seconds) -> Schedule {
        let next = tick_of(multiples(tick, base, period) + 1, base, period);
        Schedule { period, base, next }
    }

    /// Returns true once for each multiple that has been reached; several multiples in one step count as one.
    #[inline]
    pub fn is_due(&mut self, tick: u64) -> bool {
        let due = tick >= self.next;
        if due {
            *self = Schedule::after(tick, self.base, self.period);
        }
        due
    }
}

/// Returns the number of whole periods in `tick` ticks.
fn multiples(tick: u64, base: Seconds, period: Seconds) -> u128 {
    let n = (u128::from(tick) * u128::from(base.num)).checked_mul(u128::from(period.den));
    let d = u128::from(base.den) * u128::from(period.num);
    n.map_or(u128::MAX - 1, |n| n / d.max(1))
}

/// Returns the first tick at or after `multiple` periods.
fn tick_of(multiple: u128, base: Seconds, period: Seconds) -> u64 {
    let n = multiple
        .checked_mul(u128::from(period.num))
        .and_then(|n| n.checked_mul(u128::from(base.den)));
    let d = u128::from(period.den) * u128::from(base.num);
    n.and_then(|n| u64::try_from(n.div_ceil(d.max(1))).ok()).unwrap_or(u64::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: Seconds = Seconds { num: 1, den: 1000 };

    fn due(mut s: Schedule, ticks: std::ops::Range<u64>) -> Vec<u64> {
        ticks.filter(|t| s.is_due(*t)).collect()
    }

    #[test]
    fn each_multiple_is_met_once_at_or_after_it() {
        let p = Seconds { num: 1, den: 400 }; // 2.5 ms
        assert_eq!(due(Schedule::from(0, MS, p), 0..12), [0, 3, 5, 8, 10]);
        assert_eq!(due(Schedule::after(0, MS, p), 0..12), [3, 5, 8, 10]);
        // Tick 3 is the first at or after 2.5 ms, tick 4 is not.
        assert_eq!(due(Schedule::from(3, MS, p), 3..9), [3, 5, 8]);
        assert_eq!(due(Schedule::from(4, MS, p), 4..9), [5, 8]);
        // A schedule whose period is shorter than a tick is due at every tick.
        assert_eq!(due(Schedule::from(0, MS, Seconds { num: 1, den: 7000 }), 0..4), [0, 1, 2, 3]);
        // Steps over several multiples count once.
        let mut s = Schedule::after(0, MS, p);
        assert!(s.is_due(9) && !s.is_due(9) && s.is_due(10));
    }

    #[test]
    fn a_third_of_a_second_is_kept_for_years() {
        // A third that is read from "0.3333333333333333" has a denominator near 10^16.
        let third = Seconds::from_decimal(1.0 / 3.0).unwrap();
        for p in [third, Seconds { num: 1, den: 3 }] {
            for years in [0u64, 1, 30] {
                let tick = years * 365 * 86_400_000 + 1234;
                let s = Schedule::after(tick, MS, p);
                let found = due(s, tick..tick + 10_000);
                assert_eq!(found.len(), 30, "{p} after {years} years: {found:?}");
                let gaps = found.windows(2).map(|w| w[1] - w[0]);
                assert!(gaps.into_iter().all(|g| g == 333 || g == 334), "{found:?}");
            }
        }
    }

    #[test]
    fn what_is_out_of_reach_is_never_due() {
        let far = Seconds { num: u64::MAX, den: 1 };
        let base = Seconds { num: 1, den: u64::MAX };
        assert!(!Schedule::after(1, base, far).is_due(u64::MAX - 1));
    }
}
