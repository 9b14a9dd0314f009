//! Numeric solvers through the C interface: results bit-identical with Rust, no allocation, errors as codes.

use crate::support::{all_null, quiet, same};
use linkwork_embedded::{Priorities, Sweeps, bounded};
use linkwork_robot::*;
use std::ffi::{CStr, c_char};
use std::ptr::{null, null_mut};

const A: [f64; 6] = [1.0, 2.0, -0.5, 0.3, -1.0, 0.8];
const B: [f64; 2] = [1.5, -0.4];
const POSTURE: [f64; 9] = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
const BOUND: [f64; 3] = [0.2, 1.0, 0.1];

fn says(p: *const LwPriorities) -> String {
    let mut text = [0 as c_char; 400];
    // SAFETY: memory of the length given; the call ends the text with a zero.
    unsafe {
        assert_eq!(lw_priorities_message(p, text.as_mut_ptr(), 400, null_mut()), LwStatus::Ok);
        CStr::from_ptr(text.as_ptr()).to_str().unwrap().to_owned()
    }
}

#[test]
fn levels_within_bounds() {
    let mut rust = Priorities::new(3, 3, 2);
    // SAFETY: valid handles of the library, arrays of the lengths given; the same applies below.
    unsafe {
        let (mut p, mut none) = (null_mut(), null_mut());
        assert_eq!(lw_priorities_new(3, 3, 2, &mut p), LwStatus::Ok);
        let (mut x, mut residual, mut left) = ([0.0; 3], 9.0, 9);
        let (a, b, q) = (A.as_ptr(), B.as_ptr(), x.as_mut_ptr());
        let (r, l) = (&raw mut residual, &raw mut left);
        // The second call gives the same result as the first.
        for _ in 0..2 {
            rust.begin();
            quiet(|| lw_priorities_begin(p));
            rust.bound(&BOUND, 0.1);
            quiet(|| lw_priorities_bound(p, BOUND.as_ptr(), 3, 0.1));
            quiet(|| lw_priorities_bound(p, BOUND.as_ptr(), 3, f64::INFINITY));
            let met = rust.level(&A, &B).unwrap();
            quiet(|| lw_priorities_level(p, a, b, 2, r, l));
            assert_eq!((residual.to_bits(), left), (met.residual.to_bits(), met.free));
            let met = rust.level(&POSTURE, &[0.2, 0.4, -0.1]).unwrap();
            let wanted = [0.2, 0.4, -0.1];
            quiet(|| lw_priorities_level(p, POSTURE.as_ptr(), wanted.as_ptr(), 3, r, null_mut()));
            same(&[residual], &[met.residual]);
            quiet(|| lw_priorities_x(p, q, 3));
            same(&x, rust.x());
        }
        let refused = |status, wanted, needle: &str| {
            assert_eq!(status, wanted, "{}", says(p));
            assert!(says(p).contains(needle), "{needle}: {}", says(p));
        };
        let (c, nan) = (BOUND.as_ptr(), [f64::NAN; 6]);
        refused(lw_priorities_bound(p, c, 2, 0.1), LwStatus::Length, "`c`");
        refused(lw_priorities_bound(p, c, 3, f64::NAN), LwStatus::NotFinite, "`most`");
        refused(lw_priorities_bound(p, nan.as_ptr(), 3, 1.0), LwStatus::NotFinite, "`c`");
        refused(lw_priorities_level(p, a, b, 4, r, l), LwStatus::NoRoom, "4 rows");
        refused(lw_priorities_level(p, nan.as_ptr(), b, 2, r, l), LwStatus::NotFinite, "`A`");
        refused(lw_priorities_level(p, a, nan.as_ptr(), 2, r, l), LwStatus::NotFinite, "`b`");
        refused(lw_priorities_x(p, q, 2), LwStatus::Length, "`x`");
        assert_eq!(lw_priorities_new(3, 3, 1 << 11, &mut none), LwStatus::OutOfRange);
        // The bounds require x to be at least 2 and at most 1.
        quiet(|| lw_priorities_begin(p));
        let unit = [[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]];
        quiet(|| lw_priorities_bound(p, unit[0].as_ptr(), 3, 1.0));
        quiet(|| lw_priorities_bound(p, unit[1].as_ptr(), 3, -2.0));
        refused(lw_priorities_bound(p, c, 3, 1.0), LwStatus::NoRoom, "3 bounds");
        refused(lw_priorities_level(p, a, b, 2, r, l), LwStatus::Singular, "start a new problem");
        all_null(&[
            lw_priorities_new(3, 3, 1, null_mut()),
            lw_priorities_begin(null_mut()),
            lw_priorities_bound(null_mut(), c, 3, 1.0),
            lw_priorities_bound(p, null(), 3, 1.0),
            lw_priorities_level(null_mut(), a, b, 2, r, l),
            lw_priorities_level(p, null(), b, 2, r, l),
            lw_priorities_level(p, a, null(), 2, r, l),
            lw_priorities_x(null_mut(), q, 3),
            lw_priorities_x(p, null_mut(), 3),
            lw_priorities_message(null(), null_mut(), 0, null_mut()),
        ]);
        lw_priorities_free(p);
        lw_priorities_free(null_mut());
    }
}

#[test]
fn least_squares_between_two_ends() {
    let (normal, right) = ([4.0, 1.0, -0.5, 1.0, 3.0, 0.7, -0.5, 0.7, 2.0], [6.0, -4.0, 0.3]);
    let (mut s, mut wanted, mut took) = ([0.5; 3], [0.5; 3], 0);
    let sweeps = Sweeps { most: 90, settled: 1e-13 };
    let count = bounded(&normal, &right, [-0.2, 1.0], &sweeps, &mut wanted);
    let (n, r, x, t) = (normal.as_ptr(), right.as_ptr(), s.as_mut_ptr(), &raw mut took);
    // SAFETY: as above.
    unsafe {
        quiet(|| lw_bounded(n, r, 3, -0.2, 1.0, 90, 1e-13, x, t));
        same(&s, &wanted);
        assert_eq!(took, count);
        quiet(|| lw_bounded(n, r, 3, -0.2, 1.0, 90, 1e-13, x, null_mut()));
        let kept = s;
        let nan = [f64::NAN; 9];
        assert_eq!(lw_bounded(n, r, 3, 1.0, 0.0, 90, 0.0, x, t), LwStatus::OutOfRange);
        assert_eq!(lw_bounded(n, r, 3, f64::NAN, 1.0, 90, 0.0, x, t), LwStatus::OutOfRange);
        assert_eq!(lw_bounded(nan.as_ptr(), r, 3, 0.0, 1.0, 90, 0.0, x, t), LwStatus::NotFinite);
        assert_eq!(
            lw_bounded([0.0; 9].as_ptr(), r, 3, 0.0, 1.0, 90, 0.0, x, t),
            LwStatus::OutOfRange
        );
        assert_eq!(lw_bounded(n, x, 3, 0.0, 1.0, 90, 0.0, x, t), LwStatus::Overlap);
        all_null(&[
            lw_bounded(null(), r, 3, 0.0, 1.0, 90, 0.0, x, t),
            lw_bounded(n, null(), 3, 0.0, 1.0, 90, 0.0, x, t),
            lw_bounded(n, r, 3, 0.0, 1.0, 90, 0.0, null_mut(), t),
        ]);
        assert_eq!(s, kept, "nothing was written");
    }
}
