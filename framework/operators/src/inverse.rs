//! Inverses by recursions: only the small blocks of single links are factorized.
//!
//! ```text
//! φ⁻¹ = I − ℰφ,  ψ⁻¹ = I − ℰψ,  (D)⁻¹ = D⁻¹,  (M)⁻¹ = M⁻¹ link by link
//! (I + H φ K)⁻¹ = I − H ψ K                   since φ − ψ = φ K H ψ
//! (H φ M φ* H* + J)⁻¹ = (I − H ψ K)* D⁻¹ (I − H ψ K)            all coordinates free
//! (c A)⁻¹ = c⁻¹ A⁻¹,  (A B)⁻¹ = B⁻¹ A⁻¹,  (A*)⁻¹ = (A⁻¹)*
//! ```

use crate::error::OperatorError;
use crate::expression::{Expr, Operator};
use crate::side::Side;
use crate::sweeps::Symbol;

use Side::{Plain, Transposed};

/// H φ K.
const GAIN: [(Symbol, Side); 3] = [(Symbol::H, Plain), (Symbol::Phi, Plain), (Symbol::K, Plain)];
/// H ψ K.
const INNOVATION: [(Symbol, Side); 3] =
    [(Symbol::H, Plain), (Symbol::Psi, Plain), (Symbol::K, Plain)];
/// H φ M φ* H*.
const MASS: [(Symbol, Side); 5] = [
    (Symbol::H, Plain),
    (Symbol::Phi, Plain),
    (Symbol::M, Plain),
    (Symbol::Phi, Transposed),
    (Symbol::H, Transposed),
];

impl Operator {
    /// Returns the inverse if one of low order is known: for φ, ψ, D, M, `I + H φ K`, `I − H ψ K`, `H φ M φ* H* + J` as a whole, and for products,
    /// multiples and transposes of these. With prescribed coordinates, D is inverted on the free coordinates and zero elsewhere.
    ///
    /// # Errors
    /// The error of the expression, [`OperatorError::NoInverse`], or [`OperatorError::Singular`].
    pub fn inverse(&self) -> Result<Operator, OperatorError> {
        let sound = self.sound()?;
        match &*sound.expr {
            Expr::Identity => Ok(self.clone()),
            Expr::Symbol(symbol, side) => self.inverse_of_symbol(*symbol, *side),
            Expr::Nodes(..) => Err(self.no_inverse("it is not square")),
            Expr::Transposed(sum) => Ok(sum.inverse()?.transpose()),
            Expr::Product(factors) => {
                if self.is_product(&MASS) {
                    return self.inverse_of_mass(Rotors::LeftOut);
                }
                if let Some((rows, columns)) = &sound.size
                    && rows != columns
                {
                    return Err(self.no_inverse("it is not square"));
                }
                let mut out = Operator::identity();
                for factor in factors.iter().rev() {
                    let inverse = factor.inverse().map_err(|e| match e {
                        OperatorError::NoInverse { operator, reason, .. } => {
                            self.no_inverse(&format!("of its factor `{operator}`, {reason}"))
                        }
                        e => e,
                    })?;
                    out = out.try_mul(&inverse)?;
                }
                Ok(out)
            }
            Expr::Sum(terms) => self.inverse_of_sum(terms),
        }
    }

    fn inverse_of_symbol(&self, symbol: Symbol, side: Side) -> Result<Operator, OperatorError> {
        let minus = |step| Operator::identity().try_add(&self.sibling(step, side)?.scaled(-1.0));
        match symbol {
            Symbol::Phi => minus(Symbol::EPhi),
            Symbol::Psi => minus(Symbol::EPsi),
            Symbol::D => self.sibling(Symbol::DInv, side),
            Symbol::DInv => self.sibling(Symbol::D, side),
            Symbol::MInv => self.sibling(Symbol::M, side),
            Symbol::M => {
                if let Some(system) = &self.sound()?.system
                    && let Err(k) = system.M_inv()
                {
                    let body = system.name(&system.links[k]).to_owned();
                    return Err(OperatorError::Singular { operator: "M".into(), body });
                }
                self.sibling(Symbol::MInv, side)
            }
            Symbol::H | Symbol::G | Symbol::K => Err(self.no_inverse("it is not square")),
            Symbol::EPhi | Symbol::EPsi => Err(self.no_inverse("it is nilpotent")),
            Symbol::P | Symbol::J | Symbol::Upsilon => {
                Err(self.no_inverse("its blocks may be singular"))
            }
        }
    }

    fn inverse_of_sum(&self, terms: &[(f64, Operator)]) -> Result<Operator, OperatorError> {
        let unknown = || self.no_inverse("it is a sum of another form");
        let one = Operator::identity;
        let over = |c: f64, op: Operator| {
            if c == 0.0 { Err(self.no_inverse("it is zero")) } else { Ok(op.scaled(1.0 / c)) }
        };
        match terms {
            [(c, only)] => over(*c, only.inverse()?),
            [(a, x), (b, y)] => {
                // Put the identity first.
                let ((a, x), (b, y)) =
                    if y.is_identity() { ((*b, y), (*a, x)) } else { ((*a, x), (*b, y)) };
                if x.is_identity() && a != 0.0 {
                    let (ratio, back) = (b / a, y.transpose());
                    for (term, turned) in [(y, Plain), (&back, Transposed)] {
                        let (s, found) = if term.is_product(&GAIN) {
                            (1.0, one() - term.with_middle(Symbol::Psi)?)
                        } else if term.is_product(&INNOVATION) {
                            (-1.0, one() + term.with_middle(Symbol::Phi)?)
                        } else if term.is_symbol(Symbol::EPhi) {
                            (-1.0, term.sibling(Symbol::Phi, Plain)?)
                        } else if term.is_symbol(Symbol::EPsi) {
                            (-1.0, term.sibling(Symbol::Psi, Plain)?)
                        } else {
                            continue;
                        };
                        if ratio == s {
                            let found = if turned == Plain { found } else { found.transpose() };
                            return over(a, found);
                        }
                    }
                }
                let mass =
                    |x: &Operator, y: &Operator| x.is_product(&MASS) && y.is_symbol(Symbol::J);
                if a == b && (mass(x, y) || mass(y, x)) {
                    return over(a, self.inverse_of_mass(Rotors::Included)?);
                }
                Err(unknown())
            }
            _ => Err(unknown()),
        }
    }

    fn inverse_of_mass(&self, rotors: Rotors) -> Result<Operator, OperatorError> {
        let sound = self.sound()?;
        let Some(system) = &sound.system else { return Err(self.no_inverse("it has no system")) };
        if system.has_prescribed() {
            return Err(OperatorError::NoInverse {
                operator: self.to_string(),
                reason: "it has prescribed coordinates".into(),
                help: "use the operators of `Operators::all_free`; or write \
                       `(I − H ψ K)* D⁻¹ (I − H ψ K)`, the inverse on the free coordinates",
            });
        }
        if rotors == Rotors::LeftOut && system.has_armature() {
            return Err(OperatorError::NoInverse {
                operator: self.to_string(),
                reason: "rotors have inertia, and D and ψ include it".into(),
                help: "add `J`: `H φ M φ* H* + J`",
            });
        }
        let symbol = |s| Operator::leaf(system, Expr::Symbol(s, Plain));
        let innovation =
            Operator::identity() - symbol(Symbol::H) * symbol(Symbol::Psi) * symbol(Symbol::K);
        innovation.transpose().try_mul(&symbol(Symbol::DInv))?.try_mul(&innovation)
    }

    /// Returns another symbol of the same system.
    fn sibling(&self, symbol: Symbol, side: Side) -> Result<Operator, OperatorError> {
        match &self.sound()?.system {
            Some(system) => Ok(Operator::leaf(system, Expr::Symbol(symbol, side))),
            None => Err(self.no_inverse("it has no system")),
        }
    }

    /// Returns `H x K` with another x.
    fn with_middle(&self, symbol: Symbol) -> Result<Operator, OperatorError> {
        let side = Plain;
        let (H, K) = (self.sibling(Symbol::H, side)?, self.sibling(Symbol::K, side)?);
        H.try_mul(&self.sibling(symbol, side)?)?.try_mul(&K)
    }

    fn is_identity(&self) -> bool {
        matches!(self.inner.as_ref().map(|s| &*s.expr), Ok(Expr::Identity))
    }

    fn is_symbol(&self, symbol: Symbol) -> bool {
        matches!(self.inner.as_ref().map(|s| &*s.expr), Ok(Expr::Symbol(s, Plain)) if *s == symbol)
    }

    fn is_product(&self, pattern: &[(Symbol, Side)]) -> bool {
        let Ok(Expr::Product(factors)) = self.inner.as_ref().map(|s| &*s.expr) else {
            return false;
        };
        factors.len() == pattern.len()
            && factors.iter().zip(pattern).all(|(factor, (symbol, side))| {
                matches!(factor.inner.as_ref().map(|s| &*s.expr),
                    Ok(Expr::Symbol(s, own)) if s == symbol && own == side)
            })
    }

    fn no_inverse(&self, reason: &str) -> OperatorError {
        OperatorError::NoInverse {
            operator: self.to_string(),
            reason: reason.to_owned(),
            help: "inverses are known for φ, ψ, D, M, I + H φ K, I − H ψ K, H φ M φ* H* + J, and \
                   products of these; or take `dense()`",
        }
    }
}

/// Whether an expression contains the reflected inertia of rotors.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Rotors {
    Included,
    LeftOut,
}
