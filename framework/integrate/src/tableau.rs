//! Coefficients of a method.
/// An explicit Runge–Kutta method with s stages, and e more stages for its dense output.
///
/// ```text
/// kᵢ = f(t + cᵢ h, x + h Σⱼ aᵢⱼ kⱼ)      i = 1 … s + e,  j < i
/// x₊ = x + h Σ bᵢ kᵢ                     i = 1 … s
/// error = h Σ eᵢ kᵢ                      eᵢ = bᵢ − b̂ᵢ, with b̂ of the lower order
/// x(t + θh) = x + h Σ bᵢ(θ) kᵢ           bᵢ(θ) = Σₚ βᵢₚ C(P,p) θᵖ (1−θ)^(P−p),  p = 1 … P
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Explicit {
    /// Name in files: `"rk4"`.
    pub name: &'static str,
    /// Order p of the step: the local error is O(hᵖ⁺¹).
    pub order: u32,
    /// Order of b̂; 0 without an error estimate.
    pub error_order: u32,
    /// Order q of the dense output: its error within a step is O(h^(q+1)).
    pub dense_order: u32,
    /// s, the number of stages that every step evaluates. The caller may already have the first.
    pub stages: usize,
    /// Rows of aᵢⱼ for i = 1 … s + e; row i has at most i − 1 entries.
    pub a: &'static [&'static [f64]],
    /// s weights.
    pub b: &'static [f64],
    /// s + e nodes.
    pub c: &'static [f64],
    /// s weights of the error estimate; empty if the method does not have one.
    pub error: &'static [f64],
    /// Whether the last of the s stages is f at the end of the step.
    pub first_same_as_last: bool,
    /// βᵢₚ, s + e rows, p from 1 to P, so that the last value of a row is bᵢ; empty for a stage that does not contribute.
    pub dense: &'static [&'static [f64]],
}

/// A Rosenbrock method in the variables u = Σ γᵢⱼ kⱼ h, which avoid products with the Jacobian.
///
/// ```text
/// W = 1/(γh) − J                                          J = ∂f/∂x at (t, x)
/// W uᵢ = f(t + αᵢ h, x + Σⱼ aᵢⱼ uⱼ) + Σⱼ cᵢⱼ uⱼ / h + h dᵢ ∂f/∂t      j < i
/// x₊ = x + Σ mᵢ uᵢ      error = Σ eᵢ uᵢ
/// x(t + θh) = x + θ (x₊ − x) + θ(1−θ) Σ (h₁ᵢ + θ h₂ᵢ) uᵢ
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Rosenbrock {
    /// Name in files.
    pub name: &'static str,
    /// Order of the step.
    pub order: u32,
    /// Order of the embedded method.
    pub error_order: u32,
    /// Order of the dense output.
    pub dense_order: u32,
    /// γ.
    pub gamma: f64,
    /// Rows of aᵢⱼ, the first empty.
    pub a: &'static [&'static [f64]],
    /// Rows of cᵢⱼ, the first empty.
    pub c: &'static [&'static [f64]],
    /// αᵢ.
    pub alpha: &'static [f64],
    /// dᵢ.
    pub d: &'static [f64],
    /// mᵢ.
    pub m: &'static [f64],
    /// eᵢ.
    pub error: &'static [f64],
    /// h₁ᵢ and h₂ᵢ.
    pub dense: [&'static [f64]; 2],
}
