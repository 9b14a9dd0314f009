//! Pacing: a watched run advances with the wall clock, or at a fixed multiple of it.
//!
//! ```text
//! tick at simulated time t is due at   start + (t − begin) / factor
//! early: the run sleeps until then; late: the run continues at once, and later ticks keep their due times
//! ```
//! The lateness of ticks is recorded with constant memory. A tick is an overrun if the work before it was not done in time. The lateness of other
//! ticks is the time that the system takes to wake a sleeping thread.
use crate::stop::Stop;
use serde::Serialize;
use std::time::{Duration, Instant};

/// Longest sleep before the next check of the stop flag.
const NAP: Duration = Duration::from_millis(20);

/// A clock and its sleep: the wall clock, or a clock for tests.
pub trait WallClock: Send {
    /// Returns the time since some fixed instant.
    fn now(&self) -> Duration;
    /// Sleeps for approximately this time.
    fn sleep(&self, time: Duration);
}

/// The system's clock.
#[derive(Clone, Copy, Debug)]
pub struct SystemClock(Instant);

impl SystemClock {
    /// Creates a clock that starts now.
    #[allow(clippy::disallowed_methods)] // It affects when a step is taken, never its result.
    pub fn start() -> SystemClock {
        SystemClock(Instant::now())
    }
}

impl WallClock for SystemClock {
    fn now(&self) -> Duration {
        self.0.elapsed()
    }
    fn sleep(&self, time: Duration) {
        std::thread::sleep(time);
    }
}

/// Number of classes of lateness: logarithmic from a microsecond, eight per factor of two.
const CLASSES: usize = 320;
const EACH_DOUBLING: f64 = 8.0;

/// Lateness of the ticks of a paced run.
#[derive(Clone, Debug)]
pub struct Lateness {
    /// Number of paced ticks.
    pub ticks: u64,
    /// Number of ticks whose preceding work was not done when they were due.
    pub overruns: u64,
    /// Largest delay of an overrun.
    pub overrun_worst: Duration,
    /// Largest delay of any tick.
    pub worst: Duration,
    classes: [u64; CLASSES],
}

impl Default for Lateness {
    fn default() -> Self {
        let (overrun_worst, worst) = (Duration::ZERO, Duration::ZERO);
        Lateness { ticks: 0, overruns: 0, overrun_worst, worst, classes: [0; CLASSES] }
    }
}

impl Lateness {
    fn count(&mut self, late: Duration, overrun: bool) {
        self.ticks += 1;
        self.worst = self.worst.max(late);
        if overrun {
            self.overruns += 1;
            self.overrun_worst = self.overrun_worst.max(late);
        }
        let microseconds = (late.as_secs_f64() * 1e6).max(1.0);
        let class = (EACH_DOUBLING * microseconds.log2()).ceil() as usize;
        self.classes[class.min(CLASSES - 1)] += 1;
    }

    /// Returns the lateness (s) that this fraction of the ticks, from 0 to 1, does not exceed. It is at most 9 % too large, and at least 1 µs.
    pub fn within(&self, part: f64) -> f64 {
        let wanted = (part * self.ticks as f64).ceil() as u64;
        let mut seen = 0;
        for (class, count) in self.classes.iter().enumerate() {
            seen += count;
            if seen >= wanted {
                let edge = (class as f64 / EACH_DOUBLING).exp2() * 1e-6;
                return edge.min(self.worst.as_secs_f64().max(1e-6));
            }
        }
        self.worst.as_secs_f64()
    }
}

/// Report of a paced run in the summary. Times in s.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Realtime {
    /// Requested ratio of simulated time to wall time.
    pub factor: f64,
    /// Number of paced ticks.
    pub ticks: u64,
    /// Number of ticks that were late because the work before them took too long.
    pub overruns: u64,
    /// Largest delay of these.
    pub overrun_worst: f64,
    /// Largest delay of any tick.
    pub late_worst: f64,
    /// The delay that 99 % of the ticks do not exceed.
    pub late_99: f64,
}

/// Limits a run to a multiple of real time.
pub struct Pace {
    clock: Box<dyn WallClock>,
    factor: f64,
    start: Duration,
    begin: f64,
    late: Lateness,
}

impl Pace {
    /// Starts pacing now, at simulated time `begin` (s): `factor` simulated seconds per second of the clock.
    pub fn new(clock: Box<dyn WallClock>, begin: f64, factor: f64) -> Pace {
        let start = clock.now();
        Pace { clock, factor, start, begin, late: Lateness::default() }
    }

    /// Restarts pacing now, at simulated time `begin` (s), after the run was paused. The statistics are kept.
    pub fn again(&mut self, begin: f64) {
        (self.start, self.begin) = (self.clock.now(), begin);
    }

    /// Sleeps until the tick of simulated time `t` (s) is due, or until the run is to stop.
    pub fn wait(&mut self, t: f64, stop: &Stop) {
        let due = (t - self.begin) / self.factor;
        // The first tick is due at once.
        if !(due > 0.0) {
            return;
        }
        // If the due time is beyond the range of the clock, wait until the run stops.
        let due = self.start + Duration::try_from_secs_f64(due).unwrap_or(Duration::MAX / 4);
        let mut overrun = true;
        loop {
            let now = self.clock.now();
            let ahead = due.saturating_sub(now);
            if ahead.is_zero() {
                self.late.count(now - due, overrun && now > due);
                return;
            }
            if stop.is_set() {
                return;
            }
            overrun = false;
            self.clock.sleep(NAP.min(ahead));
        }
    }

    /// Returns the lateness of the ticks.
    pub fn lateness(&self) -> &Lateness {
        &self.late
    }

    /// Returns the report for the summary.
    pub fn report(&self) -> Realtime {
        let Lateness { ticks, overruns, overrun_worst, worst, .. } = self.late;
        Realtime {
            factor: self.factor,
            ticks,
            overruns,
            overrun_worst: overrun_worst.as_secs_f64(),
            late_worst: worst.as_secs_f64(),
            late_99: self.late.within(0.99),
        }
    }
}
