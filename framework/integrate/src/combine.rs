//! Sums over stages in one pass over the lanes: out = x + h Σⱼ wⱼ kⱼ.
//!
//! Zero weights are removed when an integrator is created. The number of weights is a compile-time constant of the inner loop, so that the compiler
//! unrolls it and vectorises the loop over lanes.

/// Computes a b + c, with one rounding if the target processor supports it.
#[inline(always)]
fn fma(a: f64, b: f64, c: f64) -> f64 {
    if cfg!(any(target_feature = "fma", target_arch = "aarch64")) {
        a.mul_add(b, c)
    } else {
        a * b + c
    }
}

/// The nonzero weights of a sum, and their stages.
#[derive(Clone, Debug, Default)]
pub(crate) struct Row {
    /// Weights, none zero.
    pub weights: Vec<f64>,
    /// Stage of each weight.
    pub stages: Vec<usize>,
}

impl Row {
    /// Removes zeros.
    pub fn new(weights: &[f64]) -> Self {
        let kept = weights.iter().enumerate().filter(|(_, w)| **w != 0.0);
        let (stages, weights): (Vec<_>, Vec<_>) = kept.unzip();
        assert!(
            weights.len() <= WIDTH_MAX,
            "{} weights in a row; at most {WIDTH_MAX}",
            weights.len()
        );
        Row { weights, stages }
    }
}

/// Maximum number of nonzero weights in any sum.
pub(crate) const WIDTH_MAX: usize = 16;

/// The stages of a step: a reference to the first, and the others in one vector.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stages<'a> {
    /// The first, of n lanes.
    pub first: &'a [f64],
    /// All stages one after the other, n lanes each; the first of them is not read.
    pub all: &'a [f64],
}

impl<'a> Stages<'a> {
    /// Refers to stages that are all in one vector.
    pub fn new(all: &'a [f64], n: usize) -> Self {
        Stages { first: &all[..n], all }
    }

    /// Returns stage j of n lanes.
    #[inline(always)]
    fn get(&self, j: usize, n: usize) -> &'a [f64] {
        if j == 0 { &self.first[..n] } else { &self.all[j * n..][..n] }
    }
}

/// Computes out = x + h Σⱼ wⱼ kⱼ. Returns whether all of `out` is finite. A single weight is checked only if CHECKED, because the check would take as
/// long as the sum.
#[inline(always)]
pub(crate) fn combine<const CHECKED: bool>(
    out: &mut [f64],
    x: &[f64],
    h: f64,
    row: &Row,
    k: Stages,
) -> bool {
    match (&row.weights[..], &row.stages[..]) {
        ([w], [j]) => axpy::<CHECKED>(out, x, h * w, k.get(*j, x.len())),
        (weights, stages) => sum(out, x, h, weights, stages, k),
    }
}

/// Computes out = x + a k. Returns whether all of it is finite; always true unless CHECKED.
#[inline(never)] // its parameters are known not to overlap
pub(crate) fn axpy<const CHECKED: bool>(out: &mut [f64], x: &[f64], a: f64, k: &[f64]) -> bool {
    let mut bad = 0;
    for ((out, x), k) in out.iter_mut().zip(x).zip(k) {
        *out = fma(a, *k, *x);
        if CHECKED {
            bad |= trace(*out);
        }
    }
    bad == 0
}

/// Computes the sum over plain slices, of any width, always checked.
pub(crate) fn sum(
    out: &mut [f64],
    x: &[f64],
    h: f64,
    weights: &[f64],
    stages: &[usize],
    k: Stages,
) -> bool {
    macro_rules! by_width {
        ($($n:literal)*) => {
            match weights.len() {
                0 => {
                    out.copy_from_slice(x);
                    finite(out)
                }
                $($n => fused::<$n>(out, x, h, weights, stages, (k.first, k.all)),)*
                width => panic!("{width} weights in a sum over stages; at most {WIDTH_MAX}"),
            }
        };
    }
    by_width!(1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16)
}

/// One function for each width, with parameters that are known not to overlap.
#[inline(never)]
fn fused<const N: usize>(
    out: &mut [f64],
    x: &[f64],
    h: f64,
    weights: &[f64],
    stages: &[usize],
    (first, all): (&[f64], &[f64]),
) -> bool {
    let n = out.len();
    let x = &x[..n];
    let mut w = [0.0; N];
    let mut k: [&[f64]; N] = [&[]; N];
    for j in 0..N {
        w[j] = h * weights[j];
        k[j] = Stages { first, all }.get(stages[j], n);
    }
    let mut bad = 0;
    for i in 0..n {
        let mut sum = w[0] * k[0][i];
        for j in 1..N {
            sum = fma(w[j], k[j][i], sum);
        }
        let value = x[i] + sum;
        bad |= trace(value);
        out[i] = value;
    }
    bad == 0
}

/// Computes the end of a step from the caller's x, four stages in one pass: writes x₁ to `x`, and the previous x to `x0`. Bit-identical with
/// [`combine`].
#[inline(never)] // its parameters are known not to overlap
pub(crate) fn four(
    x: &mut [f64],
    x0: &mut [f64],
    w: [f64; 4],
    k0: &[f64],
    k1: &[f64],
    k2: &[f64],
    k3: &[f64],
) {
    let n = x.len();
    let x0 = &mut x0[..n];
    let (k0, k1, k2, k3) = (&k0[..n], &k1[..n], &k2[..n], &k3[..n]);
    for i in 0..n {
        let old = x[i];
        let sum = fma(w[2], k2[i], fma(w[1], k1[i], w[0] * k0[i]));
        let value = old + fma(w[3], k3[i], sum);
        x0[i] = old;
        x[i] = value;
    }
}

/// Computes out = h Σⱼ wⱼ kⱼ.
#[inline]
pub(crate) fn weigh(out: &mut [f64], h: f64, row: &Row, k: &[f64]) {
    let n = out.len();
    out.fill(0.0);
    for (w, stage) in row.weights.iter().zip(&row.stages) {
        let w = h * w;
        for (o, k) in out.iter_mut().zip(&k[stage * n..][..n]) {
            *o += w * k;
        }
    }
}

/// Computes [`sum`] for one lane, bit-identical.
pub(crate) fn lane(
    x: f64,
    h: f64,
    weights: &[f64],
    stages: &[usize],
    k: &[f64],
    n: usize,
    i: usize,
) -> f64 {
    let mut terms = weights.iter().zip(stages).map(|(w, j)| (h * w, k[j * n + i]));
    match terms.next() {
        None => x,
        Some((w, k)) => x + terms.fold(w * k, |sum, (w, k)| fma(w, k, sum)),
    }
}

/// Returns zero if v is finite, otherwise not zero: v − v is +0 or NaN. Two vector instructions in a loop.
#[inline(always)]
#[allow(clippy::eq_op)] // the cheapest test of finiteness
fn trace(v: f64) -> u64 {
    (v - v).to_bits()
}

/// Returns whether every lane is finite.
#[inline]
pub(crate) fn finite(x: &[f64]) -> bool {
    x.iter().fold(0, |bad, v| bad | trace(*v)) == 0
}

/// Returns the first lane that is not finite.
pub(crate) fn first_bad(x: &[f64]) -> Option<usize> {
    x.iter().position(|v| !v.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Compares every width with the plain double loop; the single lane must be bit-identical.
    #[test]
    fn sums_of_all_widths() {
        let (n, stages) = (7, 19);
        let k: Vec<f64> = (0..n * stages).map(|i| ((i * i + 3) as f64).sin()).collect();
        let x: Vec<f64> = (0..n).map(|i| (i as f64 + 0.3).cos()).collect();
        for width in 0..=WIDTH_MAX {
            // Skip two of every fourteen stages, up to the width.
            let mut weights = vec![0.0; stages];
            for j in (0..stages).filter(|j| j % 7 != 5).take(width) {
                weights[j] = 0.3 + (j as f64).sin();
            }
            let row = Row::new(&weights);
            assert_eq!(row.weights.len(), width);
            let mut out = vec![0.0; n];
            assert!(combine::<true>(&mut out, &x, 0.7, &row, Stages::new(&k, n)));
            for i in 0..n {
                let plain: f64 = (0..stages).map(|j| weights[j] * k[j * n + i]).sum();
                assert!((out[i] - x[i] - 0.7 * plain).abs() < 1e-14, "width {width} lane {i}");
                // Dense output calls `sum`; a single weight is fused with x in `combine`.
                assert!(sum(&mut out, &x, 0.7, &row.weights, &row.stages, Stages::new(&k, n)));
                let single = lane(x[i], 0.7, &row.weights, &row.stages, &k, n, i);
                assert_eq!(single.to_bits(), out[i].to_bits(), "width {width} lane {i}");
            }
        }
    }

    #[test]
    fn what_is_not_finite_is_seen() {
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            let k = [1.0, 2.0, 3.0, bad, 5.0];
            let mut out = [0.0; 5];
            assert!(!combine::<true>(
                &mut out,
                &[0.0; 5],
                1.0,
                &Row::new(&[1.0]),
                Stages::new(&k, 5)
            ));
            assert_eq!(first_bad(&out), Some(3));
            assert!(!finite(&out) && finite(&out[..3]));
        }
    }
}
