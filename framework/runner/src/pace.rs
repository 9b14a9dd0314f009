//! Pacing: a run that is watched does not go faster than the clock on the wall.
use crate::run::Stop;
use std::time::{Duration, Instant};

/// The longest sleep before another look at whether to stop.
const NAP: Duration = Duration::from_millis(20);

/// Holds a run back to real time, from where it began.
#[derive(Clone, Copy, Debug)]
pub struct Pace {
    start: Instant,
    begin: f64,
}

impl Pace {
    /// Real time from now on, at simulated time `begin` (s).
    #[allow(clippy::disallowed_methods)] // When a step is taken, never what it computes.
    pub fn from(begin: f64) -> Pace {
        Pace { start: Instant::now(), begin }
    }

    /// Sleeps until the clock has come to `t` (s), or until the run is to stop.
    pub fn wait(&self, t: f64, stop: &Stop) {
        loop {
            let ahead = t - self.begin - self.start.elapsed().as_secs_f64();
            if !(ahead > 0.0) || stop.is_set() {
                return;
            }
            std::thread::sleep(NAP.min(Duration::from_secs_f64(ahead.min(1.0))));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_wait_ends_when_the_run_is_to_stop() {
        let stop = Stop::default();
        let pace = Pace::from(0.0);
        let other = stop.clone();
        let setter = std::thread::spawn(move || {
            std::thread::sleep(Duration::from_millis(100));
            other.set();
        });
        pace.wait(600.0, &stop);
        let waited = pace.start.elapsed();
        setter.join().unwrap();
        assert!(waited >= Duration::from_millis(90), "it did not wait: {waited:?}");
        assert!(waited < Duration::from_secs(5), "it slept on: {waited:?}");
    }

    #[test]
    fn it_waits_for_the_clock_and_no_longer() {
        let pace = Pace::from(10.0);
        pace.wait(10.05, &Stop::default());
        assert!(pace.start.elapsed() >= Duration::from_millis(50));
        pace.wait(9.0, &Stop::default());
        pace.wait(f64::NAN, &Stop::default());
    }
}
