//! Algebra of signals: gain, sum, product, quotient, saturation, lookup table, comparator.
//! ```text
//! gain y = k u + c     sum y = Σ u     product y = a b     quotient y = a/b     saturation y = min(max(u, lower), upper)
//! lookup y = table(u), straight between rows, constant beyond     comparator y = a > b + threshold
//! ```
//! Jumps and corners (the limits of a saturation, the rows of a table, the threshold of a comparator) are events: every integrator ends a step there
//! and begins a new one after it. Within a step an output stays on its smooth piece.

use crate::ports::{Input, Inputs, Output, Pair, Truth};
use linkwork_runtime::prelude::*;

/// Factor and offset.
#[derive(Params, Clone, Debug)]
pub struct GainParams {
    /// Factor.
    #[param(unit = "*")]
    pub k: f64,
    /// Offset.
    #[param(unit = "*", default = 0.0)]
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
    type FeedthroughInputs = Input;
    type FeedthroughOutputs = Output;
    fn feedthrough(&self, u: &Input) -> Output {
        Output { y: self.p.k * u.u + self.p.offset }
    }
}

/// The model has no parameters.
#[derive(Params, Clone, Debug)]
pub struct NoParams {}

/// A sum.
pub struct Sum {}

/// Sum of any number of inputs.
#[model("basics.sum")]
impl Model for Sum {
    type Params = NoParams;
    type FeedthroughInputs = Inputs;
    type FeedthroughOutputs = Output;
    fn build(_: NoParams) -> Result<Self, BuildError> {
        Ok(Sum {})
    }
    fn feedthrough(&self, u: &Inputs) -> Output {
        Output { y: u.u }
    }
}

/// A product.
pub struct Product {}

/// Product of two inputs.
#[model("basics.product")]
impl Model for Product {
    type Params = NoParams;
    type FeedthroughInputs = Pair;
    type FeedthroughOutputs = Output;
    fn build(_: NoParams) -> Result<Self, BuildError> {
        Ok(Product {})
    }
    fn feedthrough(&self, u: &Pair) -> Output {
        Output { y: u.a * u.b }
    }
}

/// Range of a quotient.
#[derive(Params, Clone, Debug)]
pub struct QuotientParams {
    /// Least |b|, SI: the output is 0 where |b| is less, or is zero.
    #[param(unit = "*", default = 0.0, range = 0.0..)]
    pub least: f64,
}

/// Present smooth piece of an output.
#[derive(State, Clone, Copy, Debug)]
pub struct Piece {
    /// Its number; 0 at the start.
    #[port("1")]
    pub piece: f64,
}

impl Piece {
    fn new(piece: f64) -> Piece {
        Piece { piece }
    }
}

/// The ends of a piece.
#[derive(Ports, Clone, Copy, Debug)]
pub struct Ends {
    /// Excess over the upper limit; positive beyond it.
    #[port("*")]
    pub upper: f64,
    /// Distance below the lower limit; positive beyond it.
    #[port("*")]
    pub lower: f64,
}

/// Indices of the guards in [`Ends`].
const UPPER: usize = 0;
const LOWER: usize = 1;

/// A quotient.
pub struct Quotient {
    p: QuotientParams,
}

/// Quotient of two inputs: y = a/b; 0 where |b| is below its least value.
#[model("basics.quotient")]
impl Model for Quotient {
    const MODES: bool = true;
    type Params = QuotientParams;
    type FeedthroughInputs = Pair;
    type FeedthroughOutputs = Output;
    type DiscreteState = Piece;
    type Guards = Ends;
    fn feedthrough(&self, d: &Piece, u: &Pair) -> Output {
        let least = self.p.least;
        let none = if least == 0.0 { u.b == 0.0 } else { d.piece < 0.5 };
        // The piece does not change within a step, so keep the divisor away from zero until the
        // event.
        let b = if u.b.abs() < least { least.copysign(u.b) } else { u.b };
        Output { y: if none { 0.0 } else { u.a / b } }
    }
    fn mode(&self, u: &Pair) -> Piece {
        Piece::new(f64::from(u8::from(u.b.abs() >= self.p.least)))
    }
    fn guards(&self, u: &Pair) -> Ends {
        let none = self.p.least == 0.0;
        Ends { upper: -1.0, lower: if none { -1.0 } else { self.p.least - u.b.abs() } }
    }
    fn handle_event(&self, fired: Fired<'_>) -> ((), Piece) {
        ((), Piece::new(f64::from(u8::from(fired.fell(LOWER)))))
    }
}

/// Limits.
#[derive(Params, Clone, Debug)]
pub struct SaturationParams {
    /// Lower limit.
    #[param(unit = "*")]
    pub lower: f64,
    /// Upper limit.
    #[param(unit = "*")]
    pub upper: f64,
}

/// A saturation.
pub struct Saturation {
    p: SaturationParams,
}

/// Limits its input between two values.
#[model("basics.saturation")]
impl Model for Saturation {
    const MODES: bool = true;
    type DiscreteState = Piece;
    type Guards = Ends;
    type Params = SaturationParams;
    type FeedthroughInputs = Input;
    type FeedthroughOutputs = Output;
    fn build(p: SaturationParams) -> Result<Self, BuildError> {
        if p.lower.is_nan() || p.upper.is_nan() || p.lower > p.upper {
            return Err(BuildError::new("the lower limit is above the upper one").at("lower"));
        }
        Ok(Saturation { p })
    }
    fn feedthrough(&self, d: &Piece, u: &Input) -> Output {
        let (lower, upper) = (self.p.lower, self.p.upper);
        let y = match () {
            () if d.piece > 0.5 => upper,
            () if d.piece < -0.5 => lower,
            () => u.u,
        };
        Output { y }
    }
    fn mode(&self, u: &Input) -> Piece {
        let (lower, upper) = (self.p.lower, self.p.upper);
        Piece::new(f64::from(u8::from(u.u > upper)) - f64::from(u8::from(u.u < lower)))
    }
    fn guards(&self, u: &Input) -> Ends {
        // An infinite limit is never reached, so its guard stays negative.
        let or = |x: f64| if x.is_finite() { x } else { -1.0 };
        Ends { upper: or(u.u - self.p.upper), lower: or(self.p.lower - u.u) }
    }
    fn handle_event(&self, fired: Fired<'_>, u: &Input) -> ((), Piece) {
        let above = fired.rose(UPPER) || (u.u > self.p.upper && !fired.fell(UPPER));
        let below = fired.rose(LOWER) || (u.u < self.p.lower && !fired.fell(LOWER));
        ((), Piece::new(f64::from(u8::from(above)) - f64::from(u8::from(below))))
    }
}

/// Rows of a table.
#[derive(Params, Clone, Debug)]
pub struct LookupParams {
    /// Rows (u, y) with u rising.
    #[param(unit = "*")]
    pub table: Vec<[f64; 2]>,
}

/// A lookup table.
pub struct Lookup {
    p: LookupParams,
}

impl Lookup {
    /// Returns the number of rows at or below a value, which is the index of the piece.
    fn level(&self, u: f64) -> usize {
        self.p.table.partition_point(|r| r[0] <= u)
    }
}

/// Table of (u, y), with linear interpolation between rows and constant values beyond its ends.
#[model("basics.lookup")]
impl Model for Lookup {
    const MODES: bool = true;
    type DiscreteState = Piece;
    type Guards = Ends;
    type Params = LookupParams;
    type FeedthroughInputs = Input;
    type FeedthroughOutputs = Output;
    fn build(p: LookupParams) -> Result<Self, BuildError> {
        if p.table.is_empty() || p.table.windows(2).any(|w| w[0][0] >= w[1][0]) {
            return Err(BuildError::new(
                "the first column of the table must be strictly increasing",
            )
            .help("sort the rows by their first number, and write each value once")
            .at("table"));
        }
        Ok(Lookup { p })
    }
    fn feedthrough(&self, d: &Piece, u: &Input) -> Output {
        let t = &self.p.table;
        let i = (d.piece as usize).min(t.len());
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
    fn mode(&self, u: &Input) -> Piece {
        Piece::new(self.level(u.u) as f64)
    }
    fn guards(&self, d: &Piece, u: &Input) -> Ends {
        let (t, k) = (&self.p.table, d.piece as usize);
        Ends {
            upper: t.get(k).map_or(-1.0, |r| u.u - r[0]),
            lower: if k == 0 { -1.0 } else { t.get(k - 1).map_or(-1.0, |r| r[0] - u.u) },
        }
    }
    fn handle_event(&self, fired: Fired<'_>, d: &Piece, u: &Input) -> ((), Piece) {
        let (level, was) = (self.level(u.u), d.piece as usize);
        let piece = match () {
            () if fired.rose(UPPER) => level.max(was + 1),
            () if fired.rose(LOWER) => level.min(was.saturating_sub(1)),
            () => level,
        };
        ((), Piece::new(piece as f64))
    }
}

/// Threshold.
#[derive(Params, Clone, Debug)]
pub struct ComparatorParams {
    /// Difference by which `a` must exceed `b`.
    #[param(unit = "*", default = 0.0)]
    pub threshold: f64,
}

/// A comparator.
pub struct Comparator {
    p: ComparatorParams,
}

impl Comparator {
    /// Returns a minus b minus the threshold.
    fn over(&self, u: &Pair) -> f64 {
        u.a - u.b - self.p.threshold
    }
}

/// True when a exceeds b by more than the threshold. In a feedback loop use `basics.relay`, which has two thresholds.
#[model("basics.comparator")]
impl Model for Comparator {
    const MODES: bool = true;
    type Params = ComparatorParams;
    type FeedthroughInputs = Pair;
    type FeedthroughOutputs = Truth;
    type DiscreteState = Piece;
    type Guards = Ends;
    fn feedthrough(&self, d: &Piece) -> Truth {
        Truth { y: d.piece > 0.5 }
    }
    fn mode(&self, u: &Pair) -> Piece {
        Piece::new(f64::from(u8::from(self.over(u) > 0.0)))
    }
    fn guards(&self, u: &Pair) -> Ends {
        Ends { upper: self.over(u), lower: -1.0 }
    }
    fn handle_event(&self, fired: Fired<'_>) -> ((), Piece) {
        ((), Piece::new(f64::from(u8::from(fired.rose(UPPER)))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn c() -> Clock {
        Clock::at(0.0, 0.1, 0)
    }

    /// Returns the output for the piece that follows from the input, as at a row.
    fn y<M>(m: &M, u: M::FeedthroughInputs) -> M::FeedthroughOutputs
    where
        M: Model<State = (), DiscreteState = Piece, Store = ()>,
    {
        let d = m.mode(&c(), &(), &Piece::new(0.0), &u, &());
        m.feedthrough(&c(), &(), &d, &u, &())
    }

    #[test]
    fn algebra() {
        let g = Gain { p: GainParams { k: -2.0, offset: 1.0 } };
        assert_eq!(g.feedthrough(&Input { u: 3.0 }).y, -5.0);
        assert_eq!(Sum {}.feedthrough(&Inputs { u: 3.0 }).y, 3.0);
        assert_eq!(Product {}.feedthrough(&Pair { a: 3.0, b: 4.0 }).y, 12.0);
        let q = Quotient { p: QuotientParams { least: 0.5 } };
        let of = [4.0, -0.5, 0.4, 0.0].map(|b| y(&q, Pair { a: 3.0, b }).y);
        assert_eq!(of, [0.75, -6.0, 0.0, 0.0]);
        let s = Saturation::build(SaturationParams { lower: -1.0, upper: 2.0 }).unwrap();
        let of = [-5.0, 0.5, 5.0].map(|u| y(&s, Input { u }).y);
        assert_eq!(of, [-1.0, 0.5, 2.0]);
        let k = Comparator { p: ComparatorParams { threshold: 0.5 } };
        assert!(y(&k, Pair { a: 2.0, b: 1.0 }).y);
        assert!(!y(&k, Pair { a: 1.4, b: 1.0 }).y && !y(&k, Pair { a: 1.5, b: 1.0 }).y);
    }

    #[test]
    fn tables_are_straight_between_rows_and_refuse_disorder() {
        let t = Lookup::build(LookupParams { table: vec![[0.0, 1.0], [2.0, 5.0], [3.0, 0.0]] })
            .unwrap();
        let of = [-1.0, 0.0, 1.0, 2.0, 2.5, 9.0].map(|u| y(&t, Input { u }).y);
        assert_eq!(of, [1.0, 1.0, 3.0, 5.0, 2.5, 0.0]);
        // Within a step a piece continues beyond its last row, where the guard is positive.
        let (d, u) = (Piece::new(1.0), Input { u: 2.5 });
        assert_eq!(t.feedthrough(&d, &u).y, 6.0);
        assert_eq!(t.guards(&d, &u).upper, 0.5);
        // If the input is at the end of a piece except for round-off, the event determines the next
        // piece.
        let near = Input { u: 2.0 - 1e-13 };
        assert_eq!(t.handle_event(Fired::rising(UPPER), &d, &near).1.piece, 2.0);
        assert_eq!(t.mode(&Input { u: 1.9 }).piece, 1.0);
        assert!(Lookup::build(LookupParams { table: vec![[0.0, 1.0], [0.0, 2.0]] }).is_err());
        assert!(Saturation::build(SaturationParams { lower: 1.0, upper: 0.0 }).is_err());
    }
}
