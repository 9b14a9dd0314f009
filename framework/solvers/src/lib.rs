//! Integrators over flat state vectors, and solvers of contact problems (`contact`). The caller of
//! an integrator evaluates the first stage: it usually has it already.
//!
//! Error conventions: a method of order p has a local error O(hᵖ⁺¹) when *everything* that
//! depends on the state is evaluated in `f` at every stage (ARCHITECTURE.md, law 4).

pub mod contact;

/// Storage of the classical Runge–Kutta method, made once.
#[derive(Clone, Debug)]
pub struct Rk4 {
    stage: Vec<f64>,
    k: Vec<f64>,
    sum: Vec<f64>,
}

impl Rk4 {
    /// For n states.
    pub fn new(n: usize) -> Self {
        Rk4 { stage: vec![0.0; n], k: vec![0.0; n], sum: vec![0.0; n] }
    }

    /// Advances `x` by `h`, given `k1` = f(t, x). `f(t, x, ẋ)` is called three times.
    ///
    /// ```text
    /// x₊ = x + h/6 (k₁ + 2 k₂ + 2 k₃ + k₄)
    /// k₂ = f(t + h/2, x + h/2 k₁)   k₃ = f(t + h/2, x + h/2 k₂)   k₄ = f(t + h, x + h k₃)
    /// ```
    pub fn step(
        &mut self,
        t: f64,
        h: f64,
        x: &mut [f64],
        k1: &[f64],
        mut f: impl FnMut(f64, &[f64], &mut [f64]),
    ) {
        let half = 0.5 * h;
        self.sum.copy_from_slice(k1);
        axpy(&mut self.stage, x, half, k1);
        f(t + half, &self.stage, &mut self.k);
        add(&mut self.sum, 2.0, &self.k);
        axpy(&mut self.stage, x, half, &self.k);
        f(t + half, &self.stage, &mut self.k);
        add(&mut self.sum, 2.0, &self.k);
        axpy(&mut self.stage, x, h, &self.k);
        f(t + h, &self.stage, &mut self.k);
        add(&mut self.sum, 1.0, &self.k);
        add(x, h / 6.0, &self.sum);
    }
}

/// out = x + a k.
#[inline]
fn axpy(out: &mut [f64], x: &[f64], a: f64, k: &[f64]) {
    for ((o, x), k) in out.iter_mut().zip(x).zip(k) {
        *o = x + a * k;
    }
}

/// x += a k.
#[inline]
pub fn add(x: &mut [f64], a: f64, k: &[f64]) {
    for (x, k) in x.iter_mut().zip(k) {
        *x += a * k;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// ẋ = −x² t has the closed form x = 1 / (1/x₀ + t²/2).
    #[test]
    fn rk4_has_order_four() {
        let error = |n: usize| {
            let (h, mut x) = (2.0 / n as f64, [1.3]);
            let mut rk = Rk4::new(1);
            let f = |t: f64, x: &[f64], d: &mut [f64]| d[0] = -x[0] * x[0] * t;
            for k in 0..n {
                let (t, mut k1) = (k as f64 * h, [0.0]);
                f(t, &x, &mut k1);
                rk.step(t, h, &mut x, &k1, f);
            }
            (x[0] - 1.0 / (1.0 / 1.3 + 2.0)).abs()
        };
        let order = (error(40) / error(80)).log2();
        // Measured 4.01.
        assert!((order - 4.0).abs() < 0.1, "order {order}");
    }
}
