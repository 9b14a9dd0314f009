//! Methods: coefficients and orders as plain data, and the list of all methods.
use crate::coefficients;
use crate::tableau::{Explicit, Rosenbrock};

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
