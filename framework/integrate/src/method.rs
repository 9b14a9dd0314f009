//! Methods: coefficients and orders as plain data, and the list of all methods.
use crate::coefficients;

/// A method of integration.
#[derive(Clone, Copy, Debug)]
pub enum Method {
    /// Explicit Runge–Kutta.
    Explicit(&'static Explicit),
    /// Rosenbrock, for stiff systems.
    Rosenbrock(&'static Rosenbrock),
    /// Advances velocities first, then positions along the new velocities; order 1.
    SemiImplicitEuler,
}

/// All methods.
pub const METHODS: [Method; 7] = [
    Method::Explicit(&coefficients::euler::EULER),
    Method::SemiImplicitEuler,
    Method::Explicit(&coefficients::rk4::RK4),
    Method::Explicit(&coefficients::bogacki_shampine::BOGACKI_SHAMPINE),
    Method::Explicit(&coefficients::dormand_prince::DORMAND_PRINCE),
    Method::Explicit(&coefficients::verner87::VERNER_87),
    Method::Rosenbrock(&coefficients::rodas4p::RODAS_4P),
];

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

impl Method {
    /// Returns the method with this name in files; `None` if the name is unknown.
    pub fn by_name(name: &str) -> Option<Method> {
        METHODS.into_iter().find(|m| m.name() == name)
    }

    /// Returns the name in files.
    pub fn name(&self) -> &'static str {
        match self {
            Method::Explicit(table) => table.name,
            Method::Rosenbrock(table) => table.name,
            Method::SemiImplicitEuler => "semi-implicit-euler",
        }
    }

    /// Returns the order p of the step: the local error is O(hᵖ⁺¹).
    pub fn order(&self) -> u32 {
        match self {
            Method::Explicit(table) => table.order,
            Method::Rosenbrock(table) => table.order,
            Method::SemiImplicitEuler => 1,
        }
    }

    /// Returns the order of the error estimate; 0 for a method that cannot be adaptive.
    pub fn error_order(&self) -> u32 {
        match self {
            Method::Explicit(table) => table.error_order,
            Method::Rosenbrock(table) => table.error_order,
            Method::SemiImplicitEuler => 0,
        }
    }

    /// Returns the order q of the dense output: its error within a step is O(h^(q+1)).
    pub fn dense_order(&self) -> u32 {
        match self {
            Method::Explicit(table) => table.dense_order,
            Method::Rosenbrock(table) => table.dense_order,
            Method::SemiImplicitEuler => 1,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn names_are_unique_and_found() {
        let names: BTreeSet<_> = METHODS.iter().map(Method::name).collect();
        assert_eq!(names.len(), METHODS.len());
        for method in METHODS {
            let found = Method::by_name(method.name()).unwrap();
            assert_eq!((found.name(), found.order()), (method.name(), method.order()));
        }
        assert!(Method::by_name("ode45").is_none());
    }

    /// The lengths of the tables agree, so that no index can fail later.
    #[test]
    fn tables_have_their_shapes() {
        for method in METHODS {
            match method {
                Method::Explicit(t) => {
                    let all = t.a.len();
                    assert!(all >= t.stages && t.c.len() == all && t.dense.len() == all);
                    assert_eq!(t.b.len(), t.stages, "{}", t.name);
                    assert!(t.error.is_empty() == (t.error_order == 0), "{}", t.name);
                    assert!(t.error.is_empty() || t.error.len() == t.stages, "{}", t.name);
                    assert!(t.a.iter().enumerate().all(|(i, row)| row.len() <= i), "{}", t.name);
                }
                Method::Rosenbrock(t) => {
                    let s = t.a.len();
                    assert!([t.alpha.len(), t.d.len(), t.m.len(), t.error.len()] == [s; 4]);
                    assert!(
                        t.a.iter()
                            .zip(t.c)
                            .enumerate()
                            .all(|(i, (a, c))| { a.len() == i && c.len() == i })
                    );
                }
                Method::SemiImplicitEuler => {}
            }
        }
    }
}
