//! Expressions of operators: construction, names, and size checks.
//!
//! The representation makes it easy to find and print patterns as they are usually written: products and sums are flat lists, factors of products
//! become coefficients of a sum, a transposed product is the product of the transposed factors, and a transposed sum stays a sum with a star.

use crate::error::{Operand, OperatorError};
use crate::side::Side;
use crate::snapshot::Snapshot;
use crate::sweeps::Symbol;
use std::fmt;
use std::ops::{Add, Mul, Neg, Sub};
use std::sync::Arc;

/// Meaning of the numbers of a vector.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Space {
    /// Six for each of the given number of links: angular part or moment, then linear part or force.
    Links(usize),
    /// One for each degree of freedom.
    Hinges(usize),
    /// Six for each node of a list (indices in the mechanism).
    Nodes(Arc<[usize]>),
}

impl Space {
    /// Returns the number of numbers.
    #[must_use]
    pub fn size(&self) -> usize {
        match self {
            Space::Links(n) => 6 * n,
            Space::Hinges(nv) => *nv,
            Space::Nodes(list) => 6 * list.len(),
        }
    }
}

impl fmt::Display for Space {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Space::Links(_) => write!(f, "6·links = {}", self.size()),
            Space::Hinges(nv) => write!(f, "nv = {nv}"),
            Space::Nodes(_) => write!(f, "6·nodes = {}", self.size()),
        }
    }
}

#[derive(Debug)]
pub(crate) enum Expr {
    Identity,
    Symbol(Symbol, Side),
    Nodes(Arc<[usize]>, Side),
    /// At least two factors, none of them a product or a multiple.
    Product(Vec<Operator>),
    /// At least one term with its coefficient, none of them a sum.
    Sum(Vec<(f64, Operator)>),
    /// Transpose of a sum.
    Transposed(Operator),
}

/// A valid expression.
#[derive(Clone, Debug)]
pub(crate) struct Sound {
    pub expr: Arc<Expr>,
    /// `None`: only `I`.
    pub system: Option<Arc<Snapshot>>,
    pub size: Option<(Space, Space)>,
}

/// A linear operator of one system, as an expression; inexpensive to clone. See [`Operators`](crate::Operators).
#[derive(Clone, Debug)]
pub struct Operator {
    pub(crate) inner: Result<Sound, Arc<OperatorError>>,
}

impl Operator {
    pub(crate) fn identity() -> Self {
        Self { inner: Ok(Sound { expr: Arc::new(Expr::Identity), system: None, size: None }) }
    }

    pub(crate) fn leaf(system: &Arc<Snapshot>, expr: Expr) -> Self {
        let (links, hinges) = (Space::Links(system.links.len()), Space::Hinges(system.nv));
        let size = |expr: &Expr| match expr {
            Expr::Symbol(symbol, _) => match symbol {
                Symbol::H => (hinges.clone(), links.clone()),
                Symbol::G | Symbol::K => (links.clone(), hinges.clone()),
                Symbol::D | Symbol::DInv | Symbol::J => (hinges.clone(), hinges.clone()),
                _ => (links.clone(), links.clone()),
            },
            Expr::Nodes(list, _) => (links.clone(), Space::Nodes(list.clone())),
            _ => unreachable!("only symbols are leaves"),
        };
        let (rows, columns) = size(&expr);
        let turned =
            matches!(expr, Expr::Symbol(_, Side::Transposed) | Expr::Nodes(_, Side::Transposed));
        let size = if turned { (columns, rows) } else { (rows, columns) };
        let system = Some(system.clone());
        Self { inner: Ok(Sound { expr: Arc::new(expr), system, size: Some(size) }) }
    }

    fn failed(error: OperatorError) -> Self {
        Self { inner: Err(Arc::new(error)) }
    }

    fn of(like: &Sound, expr: Expr, size: Option<(Space, Space)>) -> Self {
        let system = like.system.clone();
        Self { inner: Ok(Sound { expr: Arc::new(expr), system, size }) }
    }

    pub(crate) fn sound(&self) -> Result<&Sound, OperatorError> {
        self.inner.as_ref().map_err(|e| (**e).clone())
    }

    /// Returns the operator itself if its expression is valid.
    ///
    /// # Errors
    /// The first error of the expression.
    pub fn check(&self) -> Result<&Self, OperatorError> {
        self.sound().map(|_| self)
    }

    /// Returns the space of the results; `None` for an expression that consists only of `I`.
    ///
    /// # Errors
    /// The first error of the expression.
    pub fn rows(&self) -> Result<Option<Space>, OperatorError> {
        Ok(self.sound()?.size.as_ref().map(|s| s.0.clone()))
    }

    /// Returns the space of the arguments; `None` for an expression that consists only of `I`.
    ///
    /// # Errors
    /// The first error of the expression.
    pub fn columns(&self) -> Result<Option<Space>, OperatorError> {
        Ok(self.sound()?.size.as_ref().map(|s| s.1.clone()))
    }

    /// Describes the operator for error messages.
    fn operand(&self) -> Box<Operand> {
        let any = || ("any size".to_owned(), "the same".to_owned());
        let (rows, columns) = match self.inner.as_ref().map(|s| &s.size) {
            Ok(Some((rows, columns))) => (rows.to_string(), columns.to_string()),
            _ => any(),
        };
        Box::new(Operand { text: self.to_string(), rows, columns })
    }

    /// Returns the transposed operator.
    #[must_use]
    pub fn transpose(&self) -> Self {
        let Ok(sound) = &self.inner else { return self.clone() };
        let size = sound.size.clone().map(|(rows, columns)| (columns, rows));
        let expr = match &*sound.expr {
            Expr::Identity => Expr::Identity,
            Expr::Symbol(s, side) => {
                Expr::Symbol(*s, if s.symmetric() { *side } else { side.flip() })
            }
            Expr::Nodes(list, side) => Expr::Nodes(list.clone(), side.flip()),
            Expr::Product(f) => Expr::Product(f.iter().rev().map(Operator::transpose).collect()),
            Expr::Sum(terms) if terms.len() == 1 => {
                Expr::Sum(vec![(terms[0].0, terms[0].1.transpose())])
            }
            Expr::Sum(_) => Expr::Transposed(self.clone()),
            Expr::Transposed(sum) => return sum.clone(),
        };
        Self::of(sound, expr, size)
    }

    /// Short form of [`Operator::transpose`].
    #[must_use]
    pub fn t(&self) -> Self {
        self.transpose()
    }

    /// Returns `self * right`.
    ///
    /// # Errors
    /// [`OperatorError::Multiply`], [`OperatorError::Systems`], or the error of an operand.
    pub fn try_mul(&self, right: &Self) -> Result<Self, OperatorError> {
        let (a, b) = (self.sound()?, right.sound()?);
        let system = self.common_system(right)?;
        let size = match (&a.size, &b.size) {
            (Some((rows, inner)), Some((inner2, columns))) => {
                if inner != inner2 {
                    let (left, right) = (self.operand(), right.operand());
                    return Err(OperatorError::Multiply { left, right });
                }
                Some((rows.clone(), columns.clone()))
            }
            (Some(size), None) | (None, Some(size)) => Some(size.clone()),
            (None, None) => None,
        };
        let ((s, a), (t, b)) = (self.coefficient(), right.coefficient());
        let mut factors: Vec<Operator> = Vec::new();
        for operand in [a, b] {
            match &*operand.sound()?.expr {
                Expr::Product(list) => factors.extend(list.iter().cloned()),
                Expr::Identity => {}
                _ => factors.push(operand.clone()),
            }
        }
        let like = Sound { expr: Arc::new(Expr::Identity), system, size: size.clone() };
        let product = match factors.len() {
            // All factors were identities.
            0 => Self::identity(),
            1 => factors.swap_remove(0),
            _ => Self::of(&like, Expr::Product(factors), size),
        };
        Ok(product.scaled(s * t))
    }

    /// Returns `self + right`.
    ///
    /// # Errors
    /// [`OperatorError::Add`], [`OperatorError::Systems`], or the error of an operand.
    pub fn try_add(&self, right: &Self) -> Result<Self, OperatorError> {
        let (a, b) = (self.sound()?, right.sound()?);
        let system = self.common_system(right)?;
        let fits = match (&a.size, &b.size) {
            (Some(a), Some(b)) => a == b,
            (Some((rows, columns)), None) | (None, Some((rows, columns))) => rows == columns,
            (None, None) => true,
        };
        if !fits {
            return Err(OperatorError::Add { left: self.operand(), right: right.operand() });
        }
        let size = a.size.clone().or_else(|| b.size.clone());
        let mut terms = Vec::new();
        for operand in [self, right] {
            match &*operand.sound()?.expr {
                Expr::Sum(list) => terms.extend(list.iter().cloned()),
                _ => terms.push((1.0, operand.clone())),
            }
        }
        let like = Sound { expr: Arc::new(Expr::Identity), system, size: size.clone() };
        Ok(Self::of(&like, Expr::Sum(terms), size))
    }

    /// Returns the coefficient of an operator, and the operator without it.
    pub(crate) fn coefficient(&self) -> (f64, &Self) {
        match self.inner.as_ref().map(|s| &*s.expr) {
            Ok(Expr::Sum(terms)) if terms.len() == 1 => (terms[0].0, &terms[0].1),
            _ => (1.0, self),
        }
    }

    pub(crate) fn scaled(&self, factor: f64) -> Self {
        let Ok(sound) = &self.inner else { return self.clone() };
        let terms: Vec<(f64, Operator)> = match &*sound.expr {
            Expr::Sum(terms) => terms.iter().map(|(c, a)| (c * factor, a.clone())).collect(),
            _ => vec![(factor, self.clone())],
        };
        if let Some((value, _)) = terms.iter().find(|(c, _)| !c.is_finite()) {
            let (operator, place) = (self.to_string(), "a factor before it".to_owned());
            return Self::failed(OperatorError::NotFinite { operator, place, value: *value });
        }
        match &terms[..] {
            [(1.0, only)] => only.clone(),
            _ => Self::of(sound, Expr::Sum(terms), sound.size.clone()),
        }
    }

    fn common_system(&self, other: &Self) -> Result<Option<Arc<Snapshot>>, OperatorError> {
        match (&self.sound()?.system, &other.sound()?.system) {
            (Some(a), Some(b)) if !Arc::ptr_eq(a, b) => {
                Err(OperatorError::Systems { left: self.to_string(), right: other.to_string() })
            }
            (a, b) => Ok(a.clone().or_else(|| b.clone())),
        }
    }
}

/// Writes the expression in the usual notation: `H φ M φ* H* + J`. For an invalid operator it writes the error.
impl fmt::Display for Operator {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let star = |side: &Side| if *side == Side::Transposed { "*" } else { "" };
        match self.inner.as_ref().map(|s| &*s.expr) {
            Err(error) => write!(f, "⟨{error}⟩"),
            Ok(Expr::Identity) => write!(f, "I"),
            Ok(Expr::Symbol(symbol, side)) => write!(f, "{}{}", symbol.text(), star(side)),
            Ok(Expr::Nodes(_, side)) => write!(f, "B{}", star(side)),
            Ok(Expr::Transposed(sum)) => write!(f, "({sum})*"),
            Ok(Expr::Product(factors)) => {
                for (i, factor) in factors.iter().enumerate() {
                    let space = if i == 0 { "" } else { " " };
                    match factor.inner.as_ref().map(|s| &*s.expr) {
                        Ok(Expr::Sum(_)) => write!(f, "{space}({factor})")?,
                        _ => write!(f, "{space}{factor}")?,
                    }
                }
                Ok(())
            }
            Ok(Expr::Sum(terms)) => {
                for (i, (c, term)) in terms.iter().enumerate() {
                    match (i, *c < 0.0) {
                        (0, false) => {}
                        (0, true) => write!(f, "−")?,
                        (_, false) => write!(f, " + ")?,
                        (_, true) => write!(f, " − ")?,
                    }
                    if c.abs() != 1.0 {
                        write!(f, "{} ", c.abs())?;
                    }
                    write!(f, "{term}")?;
                }
                Ok(())
            }
        }
    }
}

/// Returns the operator, or one that carries the error.
fn settle(result: Result<Operator, OperatorError>) -> Operator {
    result.unwrap_or_else(Operator::failed)
}

macro_rules! binary {
    ($Trait:ident, $method:ident, $body:expr) => {
        impl $Trait<&Operator> for &Operator {
            type Output = Operator;
            fn $method(self, right: &Operator) -> Operator {
                let body: fn(&Operator, &Operator) -> Operator = $body;
                body(self, right)
            }
        }
        impl $Trait<Operator> for &Operator {
            type Output = Operator;
            fn $method(self, right: Operator) -> Operator {
                self.$method(&right)
            }
        }
        impl $Trait<&Operator> for Operator {
            type Output = Operator;
            fn $method(self, right: &Operator) -> Operator {
                (&self).$method(right)
            }
        }
        impl $Trait<Operator> for Operator {
            type Output = Operator;
            fn $method(self, right: Operator) -> Operator {
                (&self).$method(&right)
            }
        }
    };
}
binary!(Mul, mul, |a, b| settle(a.try_mul(b)));
binary!(Add, add, |a, b| settle(a.try_add(b)));
binary!(Sub, sub, |a, b| settle(a.try_add(&b.scaled(-1.0))));

impl Neg for &Operator {
    type Output = Operator;
    fn neg(self) -> Operator {
        self.scaled(-1.0)
    }
}

impl Neg for Operator {
    type Output = Operator;
    fn neg(self) -> Operator {
        self.scaled(-1.0)
    }
}

impl Mul<f64> for &Operator {
    type Output = Operator;
    fn mul(self, factor: f64) -> Operator {
        self.scaled(factor)
    }
}

impl Mul<f64> for Operator {
    type Output = Operator;
    fn mul(self, factor: f64) -> Operator {
        self.scaled(factor)
    }
}

impl Mul<&Operator> for f64 {
    type Output = Operator;
    fn mul(self, operator: &Operator) -> Operator {
        operator.scaled(self)
    }
}

impl Mul<Operator> for f64 {
    type Output = Operator;
    fn mul(self, operator: Operator) -> Operator {
        operator.scaled(self)
    }
}
