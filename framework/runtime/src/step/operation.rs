//! Execution of one operation of a plan; algebraic loops are solved by Newton's method for the values of the cut wires.
//! ```text
//! r(t) = s(t) − t = 0      t: what the reader sees, s: what the writer then sends
//! J ≈ ∂r/∂t by differences, J Δ = −r with pivots; steps halve while |r| does not fall
//! ```
//! It starts from the values of the last solution, which are part of the state. A loop of linear parts takes one step, or two if differences are not
//! exact enough.
use super::stopped::{Stopped, of};
use crate::author::block::{Block, EvalTime, Failure};
use crate::plan::compiled::{Loop, Op, Plan};

/// Maximum number of Newton steps.
const STEPS: usize = 40;
/// Halvings of one step.
const HALVINGS: usize = 12;

type Lanes<'a> = (&'a [f64], &'a [f64], &'a mut [f64]);

fn solve(
    blocks: &mut [Box<dyn Block>],
    plan: &Plan,
    l: &Loop,
    now: &EvalTime,
    (x, d, sig): Lanes<'_>,
) -> Result<(), Stopped> {
    let n = l.tears.len();
    // The solution is one evaluation: the state does not change, and blocks keep the values that
    // they cache by the number of the evaluation.
    let mut evaluate = |sig: &mut [f64]| -> Result<f64, Stopped> {
        for op in &l.ops {
            run(blocks, plan, *op, now, x, d, sig)?;
        }
        let miss = l.tears.iter().map(|(t, s, tolerance)| {
            let (t, s) = (sig[*t as usize], sig[*s as usize]);
            (s - t).abs() / (tolerance * t.abs().max(1.0))
        });
        Ok(miss.fold(0.0, worse))
    };
    let [report, matrix, right, step, from] = {
        let at = l.work as usize;
        let matrix = at + crate::plan::compiled::REPORT;
        [at, matrix, matrix + n * n, matrix + n * n + n, matrix + n * n + 2 * n]
    };
    let mut miss = evaluate(sig)?;
    let mut steps = 0;
    while !(miss <= 1.0) && steps < STEPS {
        steps += 1;
        for (i, (t, s, _)) in l.tears.iter().enumerate() {
            sig[from + i] = sig[*t as usize];
            sig[right + i] = sig[*s as usize] - sig[*t as usize];
        }
        // These are the columns of J = ∂s/∂t − 1.
        for (j, (t, ..)) in l.tears.iter().enumerate() {
            let t = *t as usize;
            let h = 1e-7 * sig[from + j].abs().max(sig[right + j].abs()).max(1e-3);
            sig[t] = sig[from + j] + h;
            let h = sig[t] - sig[from + j];
            evaluate(sig)?;
            sig[t] = sig[from + j];
            for (i, (ti, si, _)) in l.tears.iter().enumerate() {
                let before = sig[right + i] + sig[from + i];
                let identity = if *ti as usize == t { 1.0 } else { 0.0 };
                sig[matrix + i * n + j] = (sig[*si as usize] - before) / h - identity;
            }
        }
        for i in 0..n {
            sig[step + i] = -sig[right + i];
        }
        let (head, tail) = sig.split_at_mut(step);
        let solvable = eliminate(&mut head[matrix..matrix + n * n], &mut tail[..n], n);
        let mut length = if solvable { 1.0 } else { 0.0 };
        let before = miss;
        for _ in 0..HALVINGS {
            for (i, (t, ..)) in l.tears.iter().enumerate() {
                sig[*t as usize] = sig[from + i] + length * sig[step + i];
            }
            miss = evaluate(sig)?;
            if miss < before || !solvable {
                break;
            }
            length *= 0.5;
        }
        if !(miss < before) {
            break;
        }
    }
    // Clear the workspace, because it is not part of the state: left-over values must not make equal
    // runs differ, and must not be infinite.
    sig[matrix..matrix + n * n + 3 * n].fill(0.0);
    (sig[report], sig[report + 1]) = (steps as f64, if miss.is_finite() { miss } else { 1e300 });
    if miss <= 1.0 {
        return Ok(());
    }
    let message = format!(
        "Newton's method finds no solution of the loop of {}: after {steps} steps the ends of the \
         wires differ by {miss:.3e} times the tolerance",
        l.wires.iter().map(|w| format!("`{w}`")).collect::<Vec<_>>().join(", ")
    );
    let help = "start nearer to a solution (the default of the input), loosen `solve`, or write `delay: 1`";
    let failure = Box::new(Failure { message, help: Some(help.into()) });
    Err(Stopped { block: l.block, failure })
}

/// Returns the larger of two errors; NaN counts as the largest.
fn worse(a: f64, b: f64) -> f64 {
    if a.is_nan() || b <= a { a } else { b }
}

/// Solves A x = b in place by elimination with pivots; returns false if A is singular.
pub(super) fn eliminate(a: &mut [f64], b: &mut [f64], n: usize) -> bool {
    for k in 0..n {
        let Some(p) = (k..n).max_by(|i, j| a[i * n + k].abs().total_cmp(&a[j * n + k].abs()))
        else {
            return false;
        };
        if !(a[p * n + k].abs() > 1e-300) || !a[p * n + k].is_finite() {
            return false;
        }
        for c in 0..n {
            a.swap(k * n + c, p * n + c);
        }
        b.swap(k, p);
        for i in k + 1..n {
            let f = a[i * n + k] / a[k * n + k];
            for c in k..n {
                a[i * n + c] -= f * a[k * n + c];
            }
            b[i] -= f * b[k];
        }
    }
    for k in (0..n).rev() {
        let rest: f64 = (k + 1..n).map(|c| a[k * n + c] * b[c]).sum();
        b[k] = (b[k] - rest) / a[k * n + k];
    }
    b.iter().all(|v| v.is_finite())
}

/// Executes one operation.
#[inline(always)]
pub(super) fn run(
    blocks: &mut [Box<dyn Block>],
    plan: &Plan,
    op: Op,
    now: &EvalTime,
    x: &[f64],
    d: &[f64],
    sig: &mut [f64],
) -> Result<(), Stopped> {
    match op {
        Op::Outputs(k) => blocks[k as usize].outputs(now, x, d, sig).map_err(of(k)),
        Op::Feedthrough(k) => blocks[k as usize].feedthrough(now, x, d, sig).map_err(of(k)),
        Op::Sum(j) => {
            let sum = &plan.sums[j as usize];
            let (dst, n) = (sum.dst as usize, sum.lanes as usize);
            for k in 0..n {
                let mut total = 0.0;
                for source in sum.sources[k..].iter().step_by(n) {
                    total += sig[*source as usize];
                }
                sig[dst + k] = total;
            }
            Ok(())
        }
        Op::Loop(j) => solve(blocks, plan, &plan.loops[j as usize], now, (x, d, sig)),
    }
}

#[cfg(test)]
mod tests {
    use super::worse;

    #[test]
    fn a_wire_that_is_not_a_number_is_never_solved() {
        for errors in [[f64::NAN, 0.3], [0.3, f64::NAN], [0.0, f64::NAN]] {
            assert!(errors.into_iter().fold(0.0, worse).is_nan());
        }
        assert_eq!([0.2, 0.7, 0.1].into_iter().fold(0.0, worse), 0.7);
    }
}
