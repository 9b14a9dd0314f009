//! Interpolants in Bernstein form, computed from a method's weights.
//!
//! ```text
//! bᵢ(θ) = Σₚ βᵢₚ C(P,p) θᵖ (1−θ)^(P−p)      p = 1 … P,  βᵢ₀ = 0
//! ```
//! `b` are the weights, padded with zeros. The first stage is f at the start of the step, and stage `last` is f at its end.

/// Cubic Hermite interpolant through both end points and derivatives, order 3. The control points are x₀, x₀ + h k_first/3, x₁ − h k_last/3, x₁.
pub(crate) const fn hermite<const S: usize>(b: [f64; S], last: usize) -> [[f64; 3]; S] {
    let mut beta = [[0.0; 3]; S];
    let mut i = 0;
    while i < S {
        let first = if i == 0 { 1.0 } else { 0.0 };
        let end = if i == last { 1.0 } else { 0.0 };
        beta[i] = [first / 3.0, b[i] - end / 3.0, b[i]];
        i += 1;
    }
    beta
}

/// Quartic of Shampine and Hairer for Dormand–Prince 5(4), order 4: the cubic of [`hermite`], raised to degree four, plus θ² (1−θ)² h Σ δᵢ kᵢ. Stage
/// S is f at the end.
pub(crate) const fn quartic<const S: usize>(b: [f64; S], delta: [f64; S]) -> [[f64; 4]; S] {
    let cubic = hermite(b, S - 1);
    let mut beta = [[0.0; 4]; S];
    let mut i = 0;
    while i < S {
        let [p, q, r] = cubic[i];
        beta[i] = [0.75 * p, 0.5 * (p + q) + delta[i] / 6.0, 0.75 * q + 0.25 * r, r];
        i += 1;
    }
    beta
}
