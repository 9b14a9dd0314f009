//! Pacing: a run that is watched goes as fast as the clock on the wall, or at a fixed multiple of it.
//!
//! ```text
//! tick at simulated time t is due at   start + (t − begin) / factor
//! early: it sleeps until then; late: it goes on at once, and later ticks are not put off
//! ```
//! How late ticks are is counted in fixed memory. A tick whose work before it was not done in time is an overrun;
//! the lateness of others is what the system takes to wake a sleeper.
use crate::run::Stop;
use serde::Serialize;
use std::time::{Duration, Instant};

/// The longest sleep before another look at whether to stop.
const NAP: Duration = Duration::from_millis(20);

/// A clock and its sleep: the wall's, or one that a test moves.
pub trait WallClock: Send {
    /// Time since some fixed instant.
    fn now(&self) -> Duration;
    /// Waits about so long.
    fn sleep(&self, time: Duration);
}

/// The system's clock.
#[derive(Clone, Copy, Debug)]
pub struct SystemClock(Instant);

impl SystemClock {
    /// From now on.
    #[allow(clippy::disallowed_methods)] // When a step is taken, never what it computes.
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

/// Classes of lateness: from a microsecond up, eight to a doubling.
const CLASSES: usize = 320;
const EACH_DOUBLING: f64 = 8.0;

/// How late the ticks of a paced run were.
#[derive(Clone, Debug)]
pub struct Lateness {
    /// Ticks that were paced.
    pub ticks: u64,
    /// Of these, those whose work was not done when they were due.
    pub overruns: u64,
    /// The greatest delay of an overrun.
    pub overrun_worst: Duration,
    /// The greatest delay of any tick.
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

    /// The lateness (s) that this part of the ticks, from 0 to 1, do not exceed: at most 9 % too much, and no less than 1 µs.
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

/// What a summary says of a paced run. Times in s.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Realtime {
    /// Simulated over wall time as asked for.
    pub factor: f64,
    /// Ticks that were paced.
    pub ticks: u64,
    /// Ticks that were late because the work before them took too long.
    pub overruns: u64,
    /// The greatest delay of these.
    pub overrun_worst: f64,
    /// The greatest delay of any tick.
    pub late_worst: f64,
    /// The delay that 99 % of the ticks do not exceed.
    pub late_99: f64,
}

/// Holds a run back to a multiple of real time.
pub struct Pace {
    clock: Box<dyn WallClock>,
    factor: f64,
    start: Duration,
    begin: f64,
    late: Lateness,
}

impl Pace {
    /// From now on, at simulated time `begin` (s): `factor` simulated seconds in a second of the clock.
    pub fn new(clock: Box<dyn WallClock>, begin: f64, factor: f64) -> Pace {
        let start = clock.now();
        Pace { clock, factor, start, begin, late: Lateness::default() }
    }

    /// From now on again, at simulated time `begin` (s), because the run stood still; what was counted stays.
    pub fn again(&mut self, begin: f64) {
        (self.start, self.begin) = (self.clock.now(), begin);
    }

    /// Sleeps until the tick of simulated time `t` (s) is due, or until the run is to stop.
    pub fn wait(&mut self, t: f64, stop: &Stop) {
        let due = (t - self.begin) / self.factor;
        // Nothing came before the first.
        if !(due > 0.0) {
            return;
        }
        // A time that no clock reaches is waited for until the run is to stop.
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

    /// How late ticks were.
    pub fn lateness(&self) -> &Lateness {
        &self.late
    }

    /// What a summary says.
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
