//! Exact time: rational seconds, integer ticks of a common base, and the clock models see.
use crate::author::noise;
use crate::author::units::{Unit, split_quantity};
use crate::author::value::Value;
use std::fmt;

/// A non-negative rational number of seconds, in lowest terms.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Seconds {
    /// Numerator.
    pub num: u64,
    /// Denominator, > 0.
    pub den: u64,
}

fn gcd(a: u128, b: u128) -> u128 {
    if b == 0 { a } else { gcd(b, a % b) }
}

impl Default for Seconds {
    /// Zero.
    fn default() -> Self {
        Seconds::ZERO
    }
}

impl Seconds {
    /// Zero.
    pub const ZERO: Seconds = Seconds { num: 0, den: 1 };

    /// num/den, reduced; `None` when it does not fit or den = 0.
    pub fn new(num: u128, den: u128) -> Option<Seconds> {
        if den == 0 {
            return None;
        }
        let g = gcd(num, den).max(1);
        Some(Seconds { num: u64::try_from(num / g).ok()?, den: u64::try_from(den / g).ok()? })
    }

    /// Returns the exact value of the shortest decimal notation of this number: 0.1 is one tenth.
    pub fn from_decimal(x: f64) -> Option<Seconds> {
        if !x.is_finite() || x < 0.0 {
            return None;
        }
        let text = format!("{x}");
        let (whole, fraction) = text.split_once('.').unwrap_or((&text, ""));
        let den = 10u128.checked_pow(u32::try_from(fraction.len()).ok()?)?;
        let digits: u128 = format!("{whole}{fraction}").parse().ok()?;
        Seconds::new(digits, den)
    }

    /// Reads a period: `0.02`, `"20 ms"`, `"50 Hz"`.
    pub fn period(v: &Value) -> Result<Seconds, String> {
        let refuse = || format!("`{v}` is not a period: write \"50 Hz\", \"20 ms\" or seconds");
        let period = match v {
            Value::Number(x) => Seconds::from_decimal(*x),
            Value::Text(text) => {
                let (x, unit) = split_quantity(text).ok_or_else(refuse)?;
                let number = Seconds::from_decimal(x).ok_or_else(refuse)?;
                let unit = if unit.is_empty() { "s" } else { unit };
                let u = Unit::parse(unit).map_err(|e| e.to_string())?;
                // The unit's factor is a ratio: 1e-3 → 1/1000, 60 → 60/1.
                let factor = if u.scale >= 1.0 {
                    Seconds::from_decimal(u.scale)
                } else {
                    Seconds::from_decimal((1.0 / u.scale).round()).and_then(|f| f.inverse())
                }
                .ok_or_else(refuse)?;
                let product = Seconds::new(
                    u128::from(number.num) * u128::from(factor.num),
                    u128::from(number.den) * u128::from(factor.den),
                );
                match u.exponents {
                    [0, 0, 1, 0, 0, 0, 0, 0] => product,
                    [0, 0, -1, 0, 0, 0, 0, 0] => product.and_then(|f| f.inverse()),
                    _ => None,
                }
            }
            _ => None,
        };
        period.ok_or_else(refuse)
    }

    /// 1/x; `None` for zero.
    pub fn inverse(self) -> Option<Seconds> {
        (self.num > 0).then_some(Seconds { num: self.den, den: self.num })
    }

    /// The largest rational that divides both.
    pub fn common(self, other: Seconds) -> Option<Seconds> {
        let (a, b) = (u128::from(self.num), u128::from(self.den));
        let (c, d) = (u128::from(other.num), u128::from(other.den));
        Seconds::new(gcd(a * d, c * b), b * d)
    }

    /// Returns this time as a multiple of `base`; `None` if it is not a multiple.
    pub fn ticks(self, base: Seconds) -> Option<u64> {
        let (n, d) = (
            u128::from(self.num) * u128::from(base.den),
            u128::from(self.den) * u128::from(base.num),
        );
        (d > 0 && n.is_multiple_of(d)).then(|| u64::try_from(n / d).ok()).flatten()
    }

    /// Returns how often this time fits into `span`, rounded down; at most `u64::MAX`.
    pub fn ticks_in(self, span: Seconds) -> u64 {
        let n = u128::from(span.num) * u128::from(self.den);
        let d = u128::from(span.den) * u128::from(self.num);
        u64::try_from(n / d.max(1)).unwrap_or(u64::MAX)
    }

    /// Returns `ticks` times this time, rounded to the nearest double.
    pub fn times(self, ticks: u64) -> f64 {
        if let Some(product) = self.num.checked_mul(ticks) {
            return (product / self.den) as f64 + (product % self.den) as f64 / self.den as f64;
        }
        let product = u128::from(self.num) * u128::from(ticks);
        (product / u128::from(self.den)) as f64
            + (product % u128::from(self.den)) as f64 / self.den as f64
    }

    /// Returns the time as a double.
    pub fn seconds(self) -> f64 {
        self.num as f64 / self.den as f64
    }
}

/// Types that are accepted as a time: seconds as a number, a text with a unit (`"2 min"`), or [`Seconds`].
pub trait IntoSeconds {
    /// Returns the time.
    ///
    /// # Errors
    /// The value is negative or not finite, or its unit is not a unit of time.
    fn into_seconds(self) -> Result<Seconds, String>;
}

impl IntoSeconds for Seconds {
    fn into_seconds(self) -> Result<Seconds, String> {
        Ok(self)
    }
}
impl IntoSeconds for f64 {
    fn into_seconds(self) -> Result<Seconds, String> {
        Seconds::from_decimal(self)
            .ok_or_else(|| format!("{self} s is not a time: it must be finite and at least zero"))
    }
}
impl IntoSeconds for i32 {
    fn into_seconds(self) -> Result<Seconds, String> {
        f64::from(self).into_seconds()
    }
}
impl IntoSeconds for &str {
    fn into_seconds(self) -> Result<Seconds, String> {
        Seconds::period(&Value::Text(self.into()))
    }
}

/// Time of a tick (ns), rounded down.
pub(crate) fn nanoseconds(tick: u64, base: Seconds) -> u64 {
    let n = u128::from(tick) * u128::from(base.num) * 1_000_000_000;
    u64::try_from(n / u128::from(base.den)).unwrap_or(u64::MAX)
}

impl fmt::Display for Seconds {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.den == 1 {
            write!(f, "{} s", self.num)
        } else if self.num == 1 {
            write!(f, "1/{} s", self.den)
        } else {
            write!(f, "{}/{} s", self.num, self.den)
        }
    }
}

/// The clock of a model, and its source of noise; models have no other clock.
#[derive(Clone, Copy, Debug)]
pub struct Clock {
    /// Simulated time (s) (of the stage, inside an integration step).
    pub t: f64,
    /// Own sample period (s); for continuous functions the integration step.
    pub dt: f64,
    /// Own sample index (0 at the first sample); 0 for continuous functions.
    pub n: u64,
    /// Key of the noise: hash of (seed, path).
    pub key: u64,
    /// True if its outputs change at rows and events only, because it has a rate or inputs that do; no event then corrects
    /// [`Model::mode`](crate::Model::mode).
    pub sampled: bool,
    /// Begin and end (s) of the step of a fixed method that an evaluation belongs to. A model with
    /// [averages](crate::Model::AVERAGES) returns its average over that time.
    pub span: Option<[f64; 2]>,
}

impl Clock {
    /// A clock for a unit test.
    pub fn at(t: f64, dt: f64, n: u64) -> Clock {
        Clock { t, dt, n, key: 1, sampled: false, span: None }
    }

    /// Returns a number in [0, 1) that depends only on (seed, path, sample, lane).
    #[inline]
    pub fn uniform(&self, lane: u32) -> f64 {
        noise::uniform(self.key, self.n, lane)
    }

    /// Returns a standard normal number that depends only on (seed, path, sample, lane).
    #[inline]
    pub fn normal(&self, lane: u32) -> f64 {
        noise::normal(self.key, self.n, lane)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn decimals_are_exact() {
        assert_eq!(Seconds::from_decimal(0.1), Some(Seconds { num: 1, den: 10 }));
        assert_eq!(Seconds::from_decimal(0.3), Some(Seconds { num: 3, den: 10 }));
        assert_eq!(Seconds::from_decimal(1e-9), Some(Seconds { num: 1, den: 1_000_000_000 }));
        assert_eq!(Seconds::from_decimal(30.0), Some(Seconds { num: 30, den: 1 }));
        assert_eq!(Seconds::from_decimal(f64::NAN), None);
        let tenth = Seconds::from_decimal(0.1).unwrap();
        assert_eq!(tenth.times(3), 0.3);
        assert_eq!(tenth.times(3_000_000_007), 300_000_000.7);
    }

    #[test]
    fn periods() {
        let p = |t: &str| Seconds::period(&Value::Text(t.into()));
        assert_eq!(p("50 Hz"), Ok(Seconds { num: 1, den: 50 }));
        assert_eq!(p("20 ms"), Ok(Seconds { num: 1, den: 50 }));
        assert_eq!(p("1 kHz"), Ok(Seconds { num: 1, den: 1000 }));
        assert_eq!(p("2 min"), Ok(Seconds { num: 120, den: 1 }));
        assert!(p("3 V").unwrap_err().contains("50 Hz"));
        assert!(p("0 Hz").is_err());
    }

    #[test]
    fn common_base() {
        let (a, b) = (Seconds { num: 1, den: 30 }, Seconds { num: 1, den: 1000 });
        let base = a.common(b).unwrap();
        assert_eq!(base, Seconds { num: 1, den: 3000 });
        assert_eq!((a.ticks(base), b.ticks(base)), (Some(100), Some(3)));
    }
}
