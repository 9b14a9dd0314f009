//! Location of events: crossings, directions, double crossings, touches, arming, errors.
use linkwork_integrate::events::{
    Direction, EventSearch, Search, SearchError, Side, first_crossing,
};
use std::convert::Infallible;

/// A search that counts its evaluations.
fn search(g: impl Fn(f64) -> f64, side: Side, direction: Direction, h: f64) -> (EventSearch, u32) {
    let mut calls = 0;
    let guard = |theta: f64| {
        assert!(theta > 0.0 && theta < 1.0, "asked at {theta}");
        calls += 1;
        Ok::<f64, Infallible>(g(theta))
    };
    let found = first_crossing(guard, [g(0.0), g(1.0)], side, &Search::new(direction, h)).unwrap();
    (found, calls)
}

/// Returns θ of the crossing.
fn theta(g: impl Fn(f64) -> f64, direction: Direction, h: f64) -> Option<f64> {
    let side = Side::of(g(0.0), direction);
    search(g, side, direction, h).0.crossing.map(|c| c.theta)
}

#[test]
fn a_crossing_is_located_within_a_nanosecond_and_on_its_far_side() {
    let roots = [1e-7, 0.013, 0.25, 0.5, 0.631, 0.9999];
    let shapes: [fn(f64) -> f64; 5] = [
        |d| d,
        |d| d.tanh() * 3.0,
        |d| d * d * d,
        |d| d.signum() * d.abs().sqrt(),
        |d| (40.0 * d).exp() - 1.0,
    ];
    for (n, shape) in shapes.into_iter().enumerate() {
        for root in roots {
            for h in [1e-6, 1e-3, 0.25, 3600.0] {
                let g = |theta: f64| shape(theta - root);
                let (found, calls) = search(g, Side::Below, Direction::Rising, h);
                let crossing =
                    found.crossing.unwrap_or_else(|| panic!("shape {n} root {root} h {h}"));
                // The tolerance is round-off: for a root near 1 in θ, in a step of an hour, it is
                // 1e-12 s.
                let late = (crossing.theta - root) * h;
                assert!(
                    (-1e-12..1e-9 + 1e-12).contains(&late),
                    "shape {n} root {root} h {h}: {late:e}"
                );
                assert!(crossing.value >= 0.0 && crossing.direction == Direction::Rising);
                assert_eq!(found.side, Side::Above);
                // Bisection of the bracket would take log₂(h/4 / 1 ns) evaluations, and ITP takes one more. Samples and
                // the search for dips are added.
                let bound = 3.0 + (0.25 * h / 1e-9).max(1.0).log2().ceil().min(50.0) + 5.0;
                assert!(
                    f64::from(calls) <= bound,
                    "shape {n} root {root} h {h}: {calls} of {bound}"
                );
            }
        }
    }
}

/// On smooth guards the secant does most of the work: a step of 0.25 s needs 26 bisections.
#[test]
fn smooth_guards_take_few_evaluations() {
    let (found, calls) = search(|x| (3.0 * x).sin() - 0.7, Side::Below, Direction::Rising, 0.25);
    let exact = 0.7_f64.asin() / 3.0;
    assert!((found.crossing.unwrap().theta - exact) * 0.25 < 1e-9);
    println!("{calls} evaluations");
    // Measured: 10 evaluations, three of which are samples.
    assert!(calls <= 12, "{calls}");
}

#[test]
fn directions_count() {
    let rising = |x: f64| x - 0.4;
    let falling = |x: f64| 0.4 - x;
    assert!(theta(rising, Direction::Rising, 1.0).is_some());
    assert!(theta(rising, Direction::Falling, 1.0).is_none());
    assert!(theta(falling, Direction::Falling, 1.0).is_some());
    assert!(theta(falling, Direction::Rising, 1.0).is_none());
    assert!(theta(rising, Direction::Either, 1.0).is_some());
    // The guard rises at 0.3 and falls at 0.6.
    let hump = |x: f64| 0.0225 - (x - 0.45) * (x - 0.45);
    let rise = theta(hump, Direction::Rising, 1.0).unwrap();
    let fall = theta(hump, Direction::Falling, 1.0).unwrap();
    assert!((rise - 0.3).abs() < 2e-9 && (fall - 0.6).abs() < 2e-9, "{rise} {fall}");
    assert_eq!(theta(hump, Direction::Either, 1.0).unwrap(), rise, "the first of both");
}

/// Two crossings between two samples, down to dips of a millionth of the guard's size.
#[test]
fn double_crossings_between_samples_are_seen() {
    for depth in [2e-3, 1e-4, 1e-6] {
        for middle in [0.06, 0.19, 0.31, 0.5, 0.62, 0.93] {
            for sign in [1.0, -1.0] {
                // Add a cubic and a quartic term, so that the guard is not a parabola.
                let g = |x: f64| {
                    let d: f64 = x - middle;
                    sign * (d * d * (1.0 + 0.4 * d + d * d) - depth)
                };
                let what = format!("depth {depth:e} middle {middle} sign {sign}");
                let away = if sign > 0.0 { Direction::Falling } else { Direction::Rising };
                let back = if sign > 0.0 { Direction::Rising } else { Direction::Falling };
                let first = theta(g, away, 1.0).unwrap_or_else(|| panic!("{what}"));
                let second = theta(g, back, 1.0).unwrap_or_else(|| panic!("{what}"));
                assert!(first < middle && middle < second, "{what}: {first} {second}");
                for (x, before) in [(first, sign), (second, -sign)] {
                    assert!(g(x - 1.1e-9) * before > 0.0 && g(x) * before <= 0.0, "{what} at {x}");
                }
            }
        }
    }
}

#[test]
fn a_touch_is_not_a_crossing() {
    for middle in [0.11, 0.25, 0.5, 0.613, 0.87] {
        for sign in [1.0, -1.0] {
            let square = |x: f64| sign * (x - middle) * (x - middle);
            assert_eq!(theta(square, Direction::Either, 1.0), None, "square at {middle}");
            // Round-off makes this guard slightly negative; the dip is far shorter than a
            // nanosecond.
            let expanded = |x: f64| sign * (x * x - 2.0 * middle * x + middle * middle + 1e-18 * x);
            let found = theta(expanded, Direction::Either, 1e-3);
            assert_eq!(found, None, "expanded at {middle}");
            let near = |x: f64| sign * ((x - middle) * (x - middle) + 1e-9);
            assert_eq!(theta(near, Direction::Either, 1.0), None, "near at {middle}");
        }
    }
}

/// A dip of 0.2 ns is a touch, one of 20 ns is two crossings.
#[test]
fn dips_shorter_than_the_tolerance_are_touches() {
    let dip = |depth: f64| move |x: f64| (x - 0.4) * (x - 0.4) - depth;
    assert_eq!(theta(dip(1e-14), Direction::Either, 1e-3), None);
    assert!(theta(dip(1e-10), Direction::Either, 1e-3).is_some());
}

#[test]
fn a_guard_that_has_fired_is_armed_when_it_has_left() {
    // The guard leaves zero upwards, like a ball that has just bounced. The sign of the round-off at the start does
    // not matter.
    for off in [0.0, 1e-17, -1e-17] {
        let (found, _) = search(|x| x + off, Side::Unknown, Direction::Either, 1.0);
        assert_eq!(found, EventSearch { crossing: None, side: Side::Above });
        let (found, _) = search(|x| x + off, Side::Unknown, Direction::Rising, 1.0);
        assert_eq!(found, EventSearch { crossing: None, side: Side::Above });
    }
    // The guard leaves zero upwards and crosses it downwards later in the step, late or long before
    // the middle.
    for back in [0.8, 0.3, 0.01, 5e-4, 1e-5] {
        let (found, _) = search(|x| x * (back - x), Side::Unknown, Direction::Falling, 1.0);
        let crossing = found.crossing.unwrap_or_else(|| panic!("back at {back}"));
        assert!((crossing.theta - back).abs() < 2e-9 && crossing.direction == Direction::Falling);
    }
    // This guard stays at zero.
    let (found, calls) = search(|_| 0.0, Side::Unknown, Direction::Either, 1.0);
    assert_eq!((found, calls), (EventSearch { crossing: None, side: Side::Below }, 7));
}

/// Zero belongs to the side on which a guard has reached its threshold, at the end of a step and inside it.
#[test]
fn what_comes_to_rest_on_zero_has_reached_it() {
    for end in [1.0, 0.4] {
        let rising = |x: f64| (x - end).min(0.0);
        let falling = |x: f64| (end - x).max(0.0);
        for (g, direction) in [
            (&rising as &dyn Fn(f64) -> f64, Direction::Rising),
            (&falling, Direction::Falling),
            (&falling, Direction::Either),
        ] {
            let found =
                theta(g, direction, 1.0).unwrap_or_else(|| panic!("{direction:?} at {end}"));
            assert!((found - end).abs() < 2e-9, "{direction:?} at {end}: {found}");
        }
        // An FMI indicator that increases to zero does not count as crossed.
        assert_eq!(theta(rising, Direction::Either, 1.0), None);
    }
}

/// A crossing at the boundary of two steps is found once, in the first.
#[test]
fn a_crossing_on_a_seam_is_found_once() {
    let (first, _) = search(|x| x - 1.0, Side::Below, Direction::Rising, 1.0);
    assert_eq!(first.crossing.map(|c| c.theta), Some(1.0));
    assert_eq!(first.side, Side::Above);
    let (second, _) = search(|x| x, Side::Unknown, Direction::Rising, 1.0);
    assert_eq!(second, EventSearch { crossing: None, side: Side::Above });
}

/// A guard that jumped over its zero between steps crosses at the start.
#[test]
fn a_jump_crosses_at_the_start() {
    let (found, _) = search(|x| 1.0 + x, Side::Below, Direction::Rising, 1.0);
    let crossing = found.crossing.unwrap();
    assert_eq!((crossing.theta, crossing.value, found.side), (0.0, 1.0, Side::Above));
    let (found, _) = search(|x| 1.0 + x, Side::Below, Direction::Falling, 1.0);
    assert_eq!(found, EventSearch { crossing: None, side: Side::Above });
}

#[test]
fn the_first_of_many_is_found() {
    let wave = |x: f64| (9.0 * x + 0.4).sin();
    let first = (std::f64::consts::PI - 0.4) / 9.0;
    let found = theta(wave, Direction::Either, 1.0).unwrap();
    assert!((found - first).abs() < 2e-9, "{found} {first}");
}

#[test]
fn searches_are_deterministic_and_refuse_nan() {
    let g = |x: f64| (5.0 * x).cos() - x * 0.3;
    let once = search(g, Side::Above, Direction::Either, 0.037);
    let again = search(g, Side::Above, Direction::Either, 0.037);
    assert_eq!(once.0.crossing.unwrap().theta.to_bits(), again.0.crossing.unwrap().theta.to_bits());
    let settings = Search::new(Direction::Either, 1.0);
    let nan = |x: f64| Ok::<f64, Infallible>(if x > 0.6 { f64::NAN } else { 1.0 });
    let fault = first_crossing(nan, [1.0, 1.0], Side::Above, &settings).unwrap_err();
    assert!(matches!(fault, SearchError::NotANumber { theta: 0.75 }), "{fault}");
    let refuses = |_: f64| Err::<f64, &str>("no");
    let fault = first_crossing(refuses, [1.0, 1.0], Side::Above, &settings).unwrap_err();
    assert_eq!(fault, SearchError::Guard("no"));
    let infinite = |x: f64| Ok::<f64, Infallible>(if x > 0.6 { f64::INFINITY } else { -1.0 });
    let found = first_crossing(infinite, [-1.0, f64::INFINITY], Side::Below, &settings).unwrap();
    assert!((found.crossing.unwrap().theta - 0.6).abs() < 2e-9);
}
