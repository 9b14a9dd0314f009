//! Least-squares solvers without a robot: prioritized with bounds, and with lower and upper limits.

use crate::call::calls;
use crate::edge::{self, Out, disjoint, finite, numbers, numbers_mut};
use crate::status::{Fault, LwStatus, Message};
use crate::tool::{FEW, room};
use linkwork_embedded::{Priorities, RobotError, Sweeps, bounded};
use std::sync::Mutex;

/// A prioritized least-squares problem: unknowns x with bounds c x <= d, and levels A x = b. A level never degrades the levels before it. Use it from
/// one thread at a time.
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

calls![
    /// Creates a problem of `n` unknowns with up to `rows` rows in one level and up to `bounds` bounds (at most 1024 each) and writes it to `out`; free
    /// it with `lw_priorities_free`. Later calls do not allocate.
    fn lw_priorities_new(n: usize, rows: usize, bounds: usize, out: Out<*mut LwPriorities>) {
        let [n, rows, bounds] =
            [("n", n), ("rows", rows), ("bounds", bounds)].map(|(what, x)| room(what, x, FEW));
        let (n, rows, bounds) = (n?, rows?, bounds?);
        let mut solver = Priorities::new(n, rows, bounds);
        solver.begin();
        let inner = Mutex::new(Problem { solver, n, rows, bounds, given: 0 });
        let new = LwPriorities { inner, message: Mutex::new(Message::new()) };
        out.set(Box::into_raw(Box::new(new)));
    }

    /// Frees the problem; NULL has no effect.
    fn lw_priorities_free(problem: *mut LwPriorities);
];

/// Like `lw_builder_message`, for a problem.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_priorities_message(
    problem: *const LwPriorities,
    buffer: *mut std::ffi::c_char,
    room: usize,
    wanted: *mut usize,
) -> LwStatus {
    // SAFETY: guaranteed by the caller.
    unsafe { edge::message(problem, |p| &p.message, buffer, room, wanted) }
}

calls![
    /// Starts a new problem: no bounds, no levels, x = 0.
    fn lw_priorities_begin(p: &mut LwPriorities) {
        p.solver.begin();
        p.given = 0;
    }

    /// Adds the bound c x <= `most` (infinite: no bound) for all later levels; `c` has `n` numbers. Add bounds before the first level.
    fn lw_priorities_bound(p: &mut LwPriorities, c: *const f64, n: usize, most: f64) {
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
    }

    /// Adds and solves the next level: `A` (`rows` times n numbers, row after row) and `b` (`rows`), in the least-squares sense within the bounds and
    /// without degrading earlier levels. Writes the residual |A x - b| to `residual`, and the number of directions of x that remain for later levels to
    /// `left` (may be NULL). Returns `LW_STATUS_SINGULAR` when bounds contradict each other or earlier levels; start a new problem then.
    fn lw_priorities_level(
        p: &mut LwPriorities,
        A: *const f64,
        b: *const f64,
        rows: usize,
        residual: Option<Out<f64>>,
        left: Option<Out<usize>>,
    ) {
        if rows > p.rows {
            return Err(RobotError::NoRoom { what: "rows", wanted: rows, room: p.rows }.into());
        }
        let (A, b) = (numbers("A", A, rows * p.n, rows * p.n)?, numbers("b", b, rows, rows)?);
        finite("A", A)?;
        finite("b", b)?;
        let help = "start a new problem with bounds that do not contradict each other";
        let none = RobotError::Singular { what: "the level within the bounds", help };
        let met = p.solver.level(A, b).map_err(|_| none)?;
        if let Some(residual) = residual {
            residual.set(met.residual);
        }
        if let Some(left) = left {
            left.set(met.free);
        }
    }

    /// Writes the solution of all levels so far to `x` (`n`).
    fn lw_priorities_x(p: &mut LwPriorities, x: *mut f64, n: usize) {
        numbers_mut("x", x, n, p.n)?.copy_from_slice(p.solver.x());
    }

    /// Moves `s` (`n` numbers) from its current value to the minimum of s N s / 2 - r s between `lower` and `upper`. `normal` is N (n rows of n, row
    /// after row, symmetric with a positive diagonal), `right` is r (`n`). Ends after `most` iterations of an active-set method (sweeps, for more than 64
    /// numbers), or when no number would move by more than `settled` on its own. Writes the number of iterations to `sweeps` (may be NULL). Each costs
    /// n^2. There is no handle and no message.
    fn lw_bounded(
        normal: *const f64,
        right: *const f64,
        n: usize,
        lower: f64,
        upper: f64,
        most: usize,
        settled: f64,
        s: *mut f64,
        sweeps: Option<Out<usize>>,
    ) {
        let size = n.saturating_mul(n);
        disjoint(&[("normal", normal, size), ("right", right, n)], &[("s", s, n)])?;
        let (normal, right) =
            (numbers("normal", normal, size, size)?, numbers("right", right, n, n)?);
        let s = numbers_mut("s", s, n, n)?;
        for (what, x) in [("normal", normal), ("right", right), ("s", &*s)] {
            finite(what, x)?;
        }
        if lower.is_nan() || upper.is_nan() || lower > upper {
            let (what, help) = ("lower", "a lower limit that is not above the upper limit");
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
    }
];
