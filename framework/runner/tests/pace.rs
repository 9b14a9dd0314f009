//! The pace of a run with a clock that the test controls: slow and fast, late wake-ups, overruns, pauses.
use linkwork_runner::{Pace, Stop, SystemClock, WallClock};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

/// A clock that advances when someone sleeps, always `slack` too far, or when it is pushed.
#[derive(Clone)]
struct Toy {
    now: Arc<Mutex<Duration>>,
    slack: Duration,
    sleeps: Arc<Mutex<Vec<Duration>>>,
}

impl Toy {
    fn new(slack: Duration) -> Toy {
        let now = Arc::new(Mutex::new(Duration::from_secs(100)));
        Toy { now, slack, sleeps: Arc::default() }
    }
    fn push(&self, by: Duration) {
        *self.now.lock().unwrap() += by;
    }
}

impl WallClock for Toy {
    fn now(&self) -> Duration {
        *self.now.lock().unwrap()
    }
    fn sleep(&self, time: Duration) {
        self.sleeps.lock().unwrap().push(time);
        self.push(time + self.slack);
    }
}

const MS: Duration = Duration::from_millis(1);

fn near(a: f64, b: f64) {
    assert!((a - b).abs() < 1e-8, "{a} against {b}");
}

#[test]
fn slow_and_fast_factors_take_their_time() {
    for factor in [0.1, 1.0, 25.0] {
        let clock = Toy::new(Duration::ZERO);
        let mut pace = Pace::new(Box::new(clock.clone()), 10.0, factor);
        for k in 0..=1000 {
            pace.wait(10.0 + 1e-3 * f64::from(k), &Stop::default());
        }
        near((clock.now() - Duration::from_secs(100)).as_secs_f64(), 1.0 / factor);
        let r = pace.report();
        assert_eq!((r.ticks, r.overruns, r.late_worst), (1000, 0, 0.0), "{factor}");
        assert!(clock.sleeps.lock().unwrap().iter().all(|s| *s <= 20 * MS));
    }
}

#[test]
fn a_sleeper_that_wakes_late_is_jitter_and_work_that_takes_long_an_overrun() {
    let clock = Toy::new(50 * MS / 1000);
    let mut pace = Pace::new(Box::new(clock.clone()), 0.0, 1.0);
    let stop = Stop::default();
    for k in 1..=1000 {
        if k == 500 {
            // The work before this tick takes 7 ms instead of 5 ms.
            clock.push(7 * MS);
        }
        pace.wait(5e-3 * f64::from(k), &stop);
    }
    // The clock does not drift: the last tick is as late as any other.
    let last = clock.now() - Duration::from_secs(100);
    near(last.as_secs_f64(), 5.0 + 50e-6);
    let r = pace.report();
    assert_eq!((r.ticks, r.overruns), (1000, 1));
    near(r.overrun_worst, 7e-3 - 5e-3 + 50e-6);
    near(r.late_worst, r.overrun_worst);
    assert!(r.late_99 >= 50e-6 && r.late_99 < 1.1 * 50e-6, "{r:?}");
    // A pause does not count as an overrun.
    clock.push(Duration::from_secs(9));
    pace.again(5.0);
    pace.wait(5.0, &stop);
    pace.wait(5.005, &stop);
    let r = pace.report();
    assert_eq!((r.ticks, r.overruns), (1001, 1));
}

#[test]
fn work_that_is_always_too_slow_falls_behind_and_is_counted() {
    let clock = Toy::new(Duration::ZERO);
    let mut pace = Pace::new(Box::new(clock.clone()), 0.0, 2.0);
    for k in 1..=100 {
        clock.push(MS);
        pace.wait(1e-3 * f64::from(k), &Stop::default());
    }
    let r = pace.report();
    assert_eq!((r.ticks, r.overruns), (100, 100));
    near(r.overrun_worst, 0.05);
    assert!(clock.sleeps.lock().unwrap().is_empty());
}

#[test]
fn a_long_wait_ends_when_the_run_is_to_stop() {
    let (stop, clock) = (Stop::default(), Instant::now());
    let mut pace = Pace::new(Box::new(SystemClock::start()), 0.0, 1e-6);
    let other = stop.clone();
    let setter = std::thread::spawn(move || {
        std::thread::sleep(Duration::from_millis(100));
        other.set();
    });
    pace.wait(600.0, &stop);
    let waited = clock.elapsed();
    setter.join().unwrap();
    assert!(waited >= Duration::from_millis(90), "it did not wait: {waited:?}");
    assert!(waited < Duration::from_secs(5), "it slept on: {waited:?}");
    // These times are not valid, so the call must return at once.
    for t in [-1.0, f64::NAN] {
        pace.wait(t, &Stop::default());
    }
    pace.wait(f64::INFINITY, &stop);
    assert_eq!(pace.report().ticks, 0);
}
