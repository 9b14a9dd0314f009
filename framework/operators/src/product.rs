//! Evaluation of operators: products with a vector, and matrices.
//!
//! A product is evaluated from right to left, `A B C x = A (B (C x))`; the terms of a sum one after the other. An expression of s symbols therefore
//! visits s · links links.

use crate::error::OperatorError;
use crate::expression::{Expr, Operator, Sound, Space};
use crate::side::Side;
use crate::sweeps::Sweep;
use linkwork_spatial::nalgebra::DMatrix;
use std::ops::Mul;

/// Memory for [`Operator::apply_into`], and a count of the work.
#[derive(Clone, Debug, Default)]
pub struct Scratch {
    buffer: Vec<f64>,
    visits: u64,
}

impl Scratch {
    /// Returns the number of links (and nodes) that all sweeps with this scratch have visited, a measure of the work that does not depend on time.
    #[must_use]
    pub fn link_visits(&self) -> u64 {
        self.visits
    }
}

impl Operator {
    /// Returns the product of the operator and a vector. O(links) for each symbol of the expression.
    ///
    /// # Errors
    /// The error of the expression, [`OperatorError::Length`], [`OperatorError::NotFinite`].
    pub fn apply(&self, x: &[f64]) -> Result<Vec<f64>, OperatorError> {
        let rows = self.rows()?.map_or(x.len(), |s| s.size());
        let mut out = vec![0.0; rows];
        self.apply_into(x, &mut out, &mut Scratch::default())?;
        Ok(out)
    }

    /// Creates scratch memory of the size that [`Operator::apply_into`] needs for this expression.
    ///
    /// # Errors
    /// The error of the expression.
    pub fn scratch(&self) -> Result<Scratch, OperatorError> {
        let columns = self.columns()?.map_or(0, |s| s.size());
        Ok(Scratch { buffer: vec![0.0; need(self.sound()?, columns)], visits: 0 })
    }

    /// Like [`Operator::apply`], but writes to a slice. Does not allocate if `scratch` was created by [`Operator::scratch`], or was used with this
    /// expression before.
    ///
    /// # Errors
    /// Like [`Operator::apply`].
    pub fn apply_into(
        &self,
        x: &[f64],
        out: &mut [f64],
        scratch: &mut Scratch,
    ) -> Result<(), OperatorError> {
        let sound = self.sound()?;
        let spaces = sound.size.as_ref();
        self.check_length(x.len(), "the vector", spaces.map(|s| &s.1), x.len())?;
        self.check_length(out.len(), "the result", spaces.map(|s| &s.0), x.len())?;
        if let Some(i) = x.iter().position(|x| !x.is_finite()) {
            let (operator, place) = (self.to_string(), format!("number {i} of the vector"));
            return Err(OperatorError::NotFinite { operator, place, value: x[i] });
        }
        let size = need(sound, x.len());
        if scratch.buffer.len() < size {
            scratch.buffer.resize(size, 0.0);
        }
        scratch.visits += run(sound, Side::Plain, x, out, &mut scratch.buffer);
        Ok(())
    }

    /// Returns the matrix, computed column by column. O(columns · links) for each symbol.
    ///
    /// # Errors
    /// The error of the expression, or [`OperatorError::NoSize`].
    pub fn dense(&self) -> Result<DMatrix<f64>, OperatorError> {
        let Some((rows, columns)) = &self.sound()?.size else {
            return Err(OperatorError::NoSize { operator: self.to_string() });
        };
        let mut matrix = DMatrix::zeros(rows.size(), columns.size());
        let (mut x, mut y) = (vec![0.0; columns.size()], vec![0.0; rows.size()]);
        let mut scratch = self.scratch()?;
        for j in 0..columns.size() {
            x[j] = 1.0;
            self.apply_into(&x, &mut y, &mut scratch)?;
            x[j] = 0.0;
            matrix.column_mut(j).copy_from_slice(&y);
        }
        Ok(matrix)
    }

    /// Returns the matrix row after row, with its numbers of rows and columns.
    ///
    /// # Errors
    /// Like [`Operator::dense`].
    pub fn dense_rows(&self) -> Result<(Vec<f64>, usize, usize), OperatorError> {
        let matrix = self.dense()?;
        let (rows, columns) = matrix.shape();
        Ok((matrix.transpose().as_slice().to_vec(), rows, columns))
    }

    fn check_length(
        &self,
        got: usize,
        what: &'static str,
        space: Option<&Space>,
        any: usize,
    ) -> Result<(), OperatorError> {
        let want = space.map_or(any, Space::size);
        if got == want {
            return Ok(());
        }
        let help = match space {
            Some(Space::Hinges(_)) => "one number for each degree of freedom",
            Some(Space::Links(_)) => "six numbers for each link, angular part or moment first",
            Some(Space::Nodes(_)) => "six numbers for each node, angular part or moment first",
            None => "argument and result have the same length",
        };
        Err(OperatorError::Length { operator: self.to_string(), what, got, want, help })
    }
}

/// Returns a part of a valid expression, which is also valid.
fn part(operator: &Operator) -> &Sound {
    let Ok(sound) = &operator.inner else { unreachable!("no mistake gets into an expression") };
    sound
}

/// Returns the length of the result for an argument of length `input`.
fn output(sound: &Sound, side: Side, input: usize) -> usize {
    let space = |s: &(Space, Space)| if side == Side::Plain { s.0.size() } else { s.1.size() };
    sound.size.as_ref().map_or(input, space)
}

/// Returns the length of the longest vector between two factors.
fn longest(factors: &[Operator], input: usize) -> usize {
    let sizes = factors
        .iter()
        .flat_map(|f| [Side::Plain, Side::Transposed].map(|side| output(part(f), side, input)));
    sizes.max().unwrap_or(input)
}

/// Returns the scratch length that an expression needs.
fn need(sound: &Sound, input: usize) -> usize {
    match &*sound.expr {
        Expr::Identity | Expr::Symbol(..) | Expr::Nodes(..) => 0,
        Expr::Transposed(sum) => need(part(sum), input),
        Expr::Product(factors) => {
            let m = longest(factors, input);
            let inner = factors.iter().map(|f| need(part(f), m)).max();
            2 * m + inner.unwrap_or(0)
        }
        Expr::Sum(terms) => {
            let m = output(sound, Side::Plain, input).max(output(sound, Side::Transposed, input));
            m + terms.iter().map(|(_, t)| need(part(t), m.max(input))).max().unwrap_or(0)
        }
    }
}

/// Computes `out` = expression `x`; returns the number of links visited.
fn run(sound: &Sound, side: Side, x: &[f64], out: &mut [f64], scratch: &mut [f64]) -> u64 {
    let sweep = || sound.system.as_deref().map(|s| Sweep { s, visits: 0 });
    let turned = |own: Side| if side == Side::Plain { own } else { own.flip() };
    match &*sound.expr {
        Expr::Identity => out.copy_from_slice(x),
        Expr::Symbol(symbol, own) => {
            if let Some(mut sweep) = sweep() {
                sweep.run(*symbol, turned(*own), x, out);
                return sweep.visits;
            }
        }
        Expr::Nodes(list, own) => {
            if let Some(mut sweep) = sweep() {
                match turned(*own) {
                    Side::Plain => sweep.nodes_in(list, x, out),
                    Side::Transposed => sweep.nodes_out(list, x, out),
                }
                return sweep.visits;
            }
        }
        Expr::Transposed(sum) => return run(part(sum), side.flip(), x, out, scratch),
        Expr::Product(factors) => return run_product(factors, side, x, out, scratch),
        Expr::Sum(terms) => return run_sum(terms, side, x, out, scratch),
    }
    0
}

fn run_product(
    factors: &[Operator],
    side: Side,
    x: &[f64],
    out: &mut [f64],
    scratch: &mut [f64],
) -> u64 {
    let m = longest(factors, x.len());
    let (a, rest) = scratch.split_at_mut(m);
    let (b, rest) = rest.split_at_mut(m);
    let (mut from, mut to) = (a, b);
    let (last, mut visits, mut length) = (factors.len() - 1, 0, x.len());
    for i in 0..=last {
        // Select the factor next to the vector: the last one, or the first one of the transposed product.
        let factor = part(&factors[if side == Side::Plain { last - i } else { i }]);
        let argument = if i == 0 { x } else { &from[..length] };
        length = output(factor, side, length);
        let result = if i == last { &mut *out } else { &mut to[..length] };
        visits += run(factor, side, argument, result, rest);
        std::mem::swap(&mut from, &mut to);
    }
    visits
}

fn run_sum(
    terms: &[(f64, Operator)],
    side: Side,
    x: &[f64],
    out: &mut [f64],
    scratch: &mut [f64],
) -> u64 {
    let (term, rest) = scratch.split_at_mut(out.len());
    let mut visits = 0;
    for (i, (factor, operator)) in terms.iter().enumerate() {
        visits += run(part(operator), side, x, term, rest);
        for (o, t) in out.iter_mut().zip(term.iter()) {
            *o = if i == 0 { factor * t } else { *o + factor * t };
        }
    }
    visits
}

impl Mul<&[f64]> for &Operator {
    type Output = Result<Vec<f64>, OperatorError>;
    /// [`Operator::apply`].
    fn mul(self, x: &[f64]) -> Self::Output {
        self.apply(x)
    }
}

impl Mul<&[f64]> for Operator {
    type Output = Result<Vec<f64>, OperatorError>;
    /// [`Operator::apply`].
    fn mul(self, x: &[f64]) -> Self::Output {
        self.apply(x)
    }
}
