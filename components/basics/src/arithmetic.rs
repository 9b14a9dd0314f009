//! Algebra of signals: gain, sum, product, quotient, saturation, lookup table, comparator.
//! ```text
//! gain y = k u + c     sum y = Σ u     product y = a b     quotient y = a/b     saturation y = min(max(u, lower), upper)
//! lookup y = table(u), straight between rows, constant beyond     comparator y = a > b + threshold
//! ```

use crate::ports::{Input, Inputs, Output, Pair, Truth};
use linkwork_runtime::prelude::*;

/// Factor and offset.
#[derive(Params, Clone, Debug)]
pub struct GainParams {
    /// Factor.
    pub k: f64,
    /// Offset.
    #[param(default = 0.0)]
    pub offset: f64,
}

/// A gain.
pub struct Gain {
    p: GainParams,
}

/// Factor and offset: y = k u + offset.
#[model("basics.gain")]
impl Model for Gain {
    type Params = GainParams;
    type Ud = Input;
    type Yd = Output;
    fn direct(&self, _: &Clock, _: &(), _: &(), u: &Input) -> Output {
        Output { y: self.p.k * u.u + self.p.offset }
    }
}

/// Nothing to set.
#[derive(Params, Clone, Debug)]
pub struct NoParams {}

/// A sum.
pub struct Sum {}

/// Sum of any number of inputs.
#[model("basics.sum")]
impl Model for Sum {
    type Params = NoParams;
    type Ud = Inputs;
    type Yd = Output;
    fn build(_: NoParams) -> Result<Self, BuildError> {
        Ok(Sum {})
    }
    fn direct(&self, _: &Clock, _: &(), _: &(), u: &Inputs) -> Output {
        Output { y: u.u }
    }
}

/// A product.
pub struct Product {}

/// Product of two inputs.
#[model("basics.product")]
impl Model for Product {
    type Params = NoParams;
    type Ud = Pair;
    type Yd = Output;
    fn build(_: NoParams) -> Result<Self, BuildError> {
        Ok(Product {})
    }
    fn direct(&self, _: &Clock, _: &(), _: &(), u: &Pair) -> Output {
        Output { y: u.a * u.b }
    }
}

/// Where a quotient means nothing.
#[derive(Params, Clone, Debug)]
pub struct QuotientParams {
    /// Least |b|, SI: the output is 0 where |b| is less, or is zero.
    #[param(default = 0.0, range = 0.0..)]
    pub least: f64,
}

/// A quotient.
pub struct Quotient {
    p: QuotientParams,
}

/// Quotient of two inputs: y = a/b; 0 where |b| is below its least value.
#[model("basics.quotient")]
impl Model for Quotient {
    type Params = QuotientParams;
    type Ud = Pair;
    type Yd = Output;
    fn direct(&self, _: &Clock, _: &(), _: &(), u: &Pair) -> Output {
        let none = u.b == 0.0 || u.b.abs() < self.p.least;
        Output { y: if none { 0.0 } else { u.a / u.b } }
    }
}

/// Limits.
#[derive(Params, Clone, Debug)]
pub struct SaturationParams {
    /// Lower limit.
    pub lower: f64,
    /// Upper limit.
    pub upper: f64,
}

/// A saturation.
pub struct Saturation {
    p: SaturationParams,
}

/// Limits its input between two values.
#[model("basics.saturation")]
impl Model for Saturation {
    type Params = SaturationParams;
    type Ud = Input;
    type Yd = Output;
    fn build(p: SaturationParams) -> Result<Self, BuildError> {
        if p.lower.is_nan() || p.upper.is_nan() || p.lower > p.upper {
            return Err(BuildError::new("the lower limit is above the upper one").at("lower"));
        }
        Ok(Saturation { p })
    }
    fn direct(&self, _: &Clock, _: &(), _: &(), u: &Input) -> Output {
        Output { y: u.u.clamp(self.p.lower, self.p.upper) }
    }
}

/// Rows of a table.
#[derive(Params, Clone, Debug)]
pub struct LookupParams {
    /// Rows (u, y) with u rising.
    pub table: Vec<[f64; 2]>,
}

/// A lookup table.
pub struct Lookup {
    p: LookupParams,
}

/// Table of (u, y), straight between rows and constant beyond its ends.
#[model("basics.lookup")]
impl Model for Lookup {
    type Params = LookupParams;
    type Ud = Input;
    type Yd = Output;
    fn build(p: LookupParams) -> Result<Self, BuildError> {
        if p.table.is_empty() || p.table.windows(2).any(|w| w[0][0] >= w[1][0]) {
            return Err(BuildError::new("the first column of the table must rise").at("table"));
        }
        Ok(Lookup { p })
    }
    fn direct(&self, _: &Clock, _: &(), _: &(), u: &Input) -> Output {
        let t = &self.p.table;
        let i = t.partition_point(|r| r[0] <= u.u);
        let y = if i == 0 {
            t[0][1]
        } else if i == t.len() {
            t[i - 1][1]
        } else {
            let (a, b) = (t[i - 1], t[i]);
            a[1] + (u.u - a[0]) / (b[0] - a[0]) * (b[1] - a[1])
        };
        Output { y }
    }
}

/// Threshold.
#[derive(Params, Clone, Debug)]
pub struct ComparatorParams {
    /// How far `a` must exceed `b`.
    #[param(default = 0.0)]
    pub threshold: f64,
}

/// A comparator.
pub struct Comparator {
    p: ComparatorParams,
}

/// True when a exceeds b by more than the threshold.
#[model("basics.comparator")]
impl Model for Comparator {
    type Params = ComparatorParams;
    type Ud = Pair;
    type Yd = Truth;
    fn direct(&self, _: &Clock, _: &(), _: &(), u: &Pair) -> Truth {
        Truth { y: u.a > u.b + self.p.threshold }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn c() -> Clock {
        Clock::at(0.0, 0.1, 0)
    }

    #[test]
    fn algebra() {
        let g = Gain { p: GainParams { k: -2.0, offset: 1.0 } };
        assert_eq!(g.direct(&c(), &(), &(), &Input { u: 3.0 }, &()).y, -5.0);
        assert_eq!(Sum {}.direct(&c(), &(), &(), &Inputs { u: 3.0 }, &()).y, 3.0);
        assert_eq!(Product {}.direct(&c(), &(), &(), &Pair { a: 3.0, b: 4.0 }, &()).y, 12.0);
        let q = Quotient { p: QuotientParams { least: 0.5 } };
        let y = [4.0, -0.5, 0.4, 0.0].map(|b| q.direct(&c(), &(), &(), &Pair { a: 3.0, b }, &()).y);
        assert_eq!(y, [0.75, -6.0, 0.0, 0.0]);
        let s = Saturation::build(SaturationParams { lower: -1.0, upper: 2.0 }).unwrap();
        let y = [-5.0, 0.5, 5.0].map(|u| s.direct(&c(), &(), &(), &Input { u }, &()).y);
        assert_eq!(y, [-1.0, 0.5, 2.0]);
        let k = Comparator { p: ComparatorParams { threshold: 0.5 } };
        assert!(k.direct(&c(), &(), &(), &Pair { a: 2.0, b: 1.0 }, &()).y);
        assert!(!k.direct(&c(), &(), &(), &Pair { a: 1.4, b: 1.0 }, &()).y);
    }

    #[test]
    fn tables_are_straight_between_rows_and_refuse_disorder() {
        let t = Lookup::build(LookupParams { table: vec![[0.0, 1.0], [2.0, 5.0], [3.0, 0.0]] })
            .unwrap();
        let y =
            [-1.0, 0.0, 1.0, 2.0, 2.5, 9.0].map(|u| t.direct(&c(), &(), &(), &Input { u }, &()).y);
        assert_eq!(y, [1.0, 1.0, 3.0, 5.0, 2.5, 0.0]);
        assert!(Lookup::build(LookupParams { table: vec![[0.0, 1.0], [0.0, 2.0]] }).is_err());
        assert!(Saturation::build(SaturationParams { lower: 1.0, upper: 0.0 }).is_err());
    }
}
