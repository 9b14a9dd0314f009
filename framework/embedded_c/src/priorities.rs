//! Solvers of plain numbers, without a robot: least squares in order of priority within bounds, and between two ends.

use crate::edge::{self, Out, alone, disjoint, finite, numbers, numbers_mut};
use crate::status::{Fault, LwStatus, Message};
use crate::tool::{FEW, room};
use linkwork_embedded::{Priorities, RobotError, Sweeps, bounded};
use std::sync::Mutex;

/// A problem of least squares in order of priority: unknowns x with bounds c x <= d, and levels A x = b, of which each takes nothing from those before. For one thread at a time.
pub struct LwPriorities {
    inner: Mutex<Problem>,
    message: Mutex<Message>,
}

struct Problem {
    solver: Priorities,
    n: usize,
    rows: usize,
    bounds: usize,
    given: usize,
}

impl LwPriorities {
    fn parts(&self) -> (&Mutex<Problem>, &Mutex<Message>) {
        (&self.inner, &self.message)
    }
}

/// A problem of `n` unknowns with room for so many `rows` in one level and so many `bounds` (1024 each at most), into `out`; free it with `lw_priorities_free`. No later call allocates.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_priorities_new(
    n: usize,
    rows: usize,
    bounds: usize,
    out: *mut *mut LwPriorities,
) -> LwStatus {
    edge::plain(|| {
        let out = Out::new("out", out)?;
        let [n, rows, bounds] =
            [("n", n), ("rows", rows), ("bounds", bounds)].map(|(what, x)| room(what, x, FEW));
        let (n, rows, bounds) = (n?, rows?, bounds?);
        let mut solver = Priorities::new(n, rows, bounds);
        solver.begin();
        let inner = Mutex::new(Problem { solver, n, rows, bounds, given: 0 });
        let new = LwPriorities { inner, message: Mutex::new(Message::new()) };
        // SAFETY: the caller's promises.
        unsafe { out.set(Box::into_raw(Box::new(new))) };
        Ok(())
    })
}

/// Frees it; NULL is none.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_priorities_free(problem: *mut LwPriorities) {
    // SAFETY: the caller's promises.
    unsafe { edge::free(problem) }
}

/// As `lw_builder_message`, of a problem.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_priorities_message(
    problem: *const LwPriorities,
    buffer: *mut std::ffi::c_char,
    room: usize,
    wanted: *mut usize,
) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe { edge::message(problem, |p| &p.message, buffer, room, wanted) }
}

/// Begins anew: no bounds, no levels, x = 0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_priorities_begin(problem: *mut LwPriorities) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe {
        alone(problem, LwPriorities::parts, |p| {
            p.solver.begin();
            p.given = 0;
            Ok(())
        })
    }
}

/// A bound c x <= `most` (infinite: none) that all levels afterwards keep: `c` has `n` numbers. Give bounds before the first level.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_priorities_bound(
    problem: *mut LwPriorities,
    c: *const f64,
    n: usize,
    most: f64,
) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe {
        alone(problem, LwPriorities::parts, |p| {
            let c = numbers("c", c, n, p.n)?;
            finite("c", c)?;
            if most != f64::INFINITY {
                finite("most", &[most])?;
                if p.given == p.bounds {
                    let (what, wanted, room) = ("bounds", p.given + 1, p.bounds);
                    return Err(RobotError::NoRoom { what, wanted, room }.into());
                }
                p.given += 1;
            }
            p.solver.bound(c, most);
            Ok(())
        })
    }
}

/// The next level: `A` (`rows` times n numbers, row after row) and `b` (`rows`), met in the sense of least squares as far as bounds and the levels before leave it. How far it is from being met, |A x - b|, into `residual`, and
/// how many directions of x are left for levels afterwards into `left` (NULL: not asked for). `LW_STATUS_SINGULAR` when bounds contradict each other or what levels before have settled: begin anew.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_priorities_level(
    problem: *mut LwPriorities,
    A: *const f64,
    b: *const f64,
    rows: usize,
    residual: *mut f64,
    left: *mut usize,
) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe {
        alone(problem, LwPriorities::parts, |p| {
            let residual =
                if residual.is_null() { None } else { Some(Out::new("residual", residual)?) };
            let left = if left.is_null() { None } else { Some(Out::new("left", left)?) };
            if rows > p.rows {
                return Err(RobotError::NoRoom { what: "rows", wanted: rows, room: p.rows }.into());
            }
            let (A, b) = (numbers("A", A, rows * p.n, rows * p.n)?, numbers("b", b, rows, rows)?);
            finite("A", A)?;
            finite("b", b)?;
            let help = "begin anew with bounds that can be kept together";
            let none = RobotError::Singular { what: "a level within its bounds", help };
            let met = p.solver.level(A, b).map_err(|_| none)?;
            if let Some(residual) = residual {
                residual.set(met.residual);
            }
            if let Some(left) = left {
                left.set(met.free);
            }
            Ok(())
        })
    }
}

/// The unknowns that meet all levels until now as well as can be, into `x` (`n`).
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_priorities_x(
    problem: *mut LwPriorities,
    x: *mut f64,
    n: usize,
) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe {
        alone(problem, LwPriorities::parts, |p| {
            numbers_mut("x", x, n, p.n)?.copy_from_slice(p.solver.x());
            Ok(())
        })
    }
}

/// Moves `s` (`n` numbers) to the minimum of s N s / 2 - r s between `lower` and `upper`, from where it is: `normal` is N (n rows of n, row after row, symmetric with a positive diagonal), `right` r
/// (`n`). It ends after `most` iterations of an active set (sweeps, above 64 numbers), or when no number alone would move by more than `settled`; how many it took into `sweeps` (NULL: not asked for). Cost of each: n^2. No handle has a message of it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_bounded(
    normal: *const f64,
    right: *const f64,
    n: usize,
    lower: f64,
    upper: f64,
    most: usize,
    settled: f64,
    s: *mut f64,
    sweeps: *mut usize,
) -> LwStatus {
    edge::plain(|| {
        // SAFETY: the caller's promises.
        unsafe {
            let sweeps = if sweeps.is_null() { None } else { Some(Out::new("sweeps", sweeps)?) };
            let size = n.saturating_mul(n);
            disjoint(&[("normal", normal, size), ("right", right, n)], &[("s", s, n)])?;
            let (normal, right) =
                (numbers("normal", normal, size, size)?, numbers("right", right, n, n)?);
            let s = numbers_mut("s", s, n, n)?;
            for (what, x) in [("normal", normal), ("right", right), ("s", &*s)] {
                finite(what, x)?;
            }
            if lower.is_nan() || upper.is_nan() || lower > upper {
                let (what, help) = ("lower", "an end that is not above the other");
                return Err(Fault::from(RobotError::OutOfRange { what, value: lower, help }));
            }
            if let Some(value) = (0..n).map(|k| normal[n * k + k]).find(|x| *x <= 0.0) {
                let (what, help) = ("diagonal of `normal`", "give numbers above zero");
                return Err(RobotError::OutOfRange { what, value, help }.into());
            }
            let took = bounded(normal, right, [lower, upper], &Sweeps { most, settled }, s);
            if let Some(sweeps) = sweeps {
                sweeps.set(took);
            }
            Ok(())
        }
    })
}
