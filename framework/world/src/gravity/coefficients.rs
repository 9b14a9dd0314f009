//! Normalised Stokes coefficients of a gravity field, as stored in files and used for evaluation.
//!
//! ```text
//! V = μ/r Σ_n (R/r)ⁿ Σ_m P̄_nm(sin φ) (C̄_nm cos mλ + S̄_nm sin mλ)
//! C̄ = C / N,   N² = (2 − δ₀ₘ)(2n+1)(n−m)!/(n+m)!
//! ```
//! Full normalisation of geodesy: the mean square of every P̄_nm cos mλ over the sphere is 1
//! (Heiskanen & Moritz, *Physical Geodesy*, 1967, section 1-14).

use crate::error::{WorldError, number};

/// Maximum degree that [`super::Harmonics`] evaluates. At higher degrees, the functions without their factor cosᵐφ exceed the range of f64 near the
/// poles.
pub const DEGREE_MAX: usize = 360;

/// Handling of the permanent tide in C̄₂₀.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum TideSystem {
    /// The file does not specify it.
    #[default]
    Unknown,
    /// The permanent tide is removed.
    TideFree,
    /// The permanent deformation is included, the direct part is removed.
    ZeroTide,
    /// Both are included.
    MeanTide,
}

/// Fully normalised coefficients.
#[derive(Clone, Debug, PartialEq)]
pub struct Coefficients {
    /// Gravitational parameter μ, m³/s².
    pub mu: f64,
    /// Reference radius R, m.
    pub radius: f64,
    /// Handling of the permanent tide.
    pub tide: TideSystem,
    degree: usize,
    order: usize,
    c: Vec<f64>,
    s: Vec<f64>,
}

/// Returns the index of (n, m) in a triangle stored row by row.
fn at(n: usize, m: usize) -> usize {
    n * (n + 1) / 2 + m
}

/// Returns N of degree n and order m, so that C = N C̄; dimensionless. The relative error is about 1e-15 (n + m). Returns zero if N underflows (n + m
/// above about 290). O(m).
#[must_use]
pub fn normalisation(n: usize, m: usize) -> f64 {
    let k = if m == 0 { 1.0 } else { 2.0 };
    // Take the root of each factor, so that the product underflows only at higher degrees.
    let falling = ((n - m + 1)..=(n + m)).fold(1.0, |p, i| p / (i as f64).sqrt());
    (k * (2 * n + 1) as f64).sqrt() * falling
}

impl Coefficients {
    /// Creates a point mass: C̄₀₀ = 1 and memory for `degree` × `order`.
    ///
    /// # Errors
    /// μ or R is not above zero, the degree is above [`DEGREE_MAX`], or the order is above the degree.
    pub fn new(mu: f64, radius: f64, degree: usize, order: usize) -> Result<Self, WorldError> {
        number("mu, m³/s²", mu, |x| x > 0.0, "a gravitational parameter is above 0")?;
        number("radius, m", radius, |x| x > 0.0, "a reference radius is above 0")?;
        if degree > DEGREE_MAX {
            let help = "truncate the field: the maximum degree is 360";
            return Err(WorldError::Degree {
                what: "degree",
                asked: degree,
                max: DEGREE_MAX,
                help,
            });
        }
        if order > degree {
            let help = "the order of a field must not exceed its degree";
            return Err(WorldError::Degree { what: "order", asked: order, max: degree, help });
        }
        let size = at(degree + 1, 0);
        let mut c = vec![0.0; size];
        c[0] = 1.0;
        Ok(Self { mu, radius, tide: TideSystem::Unknown, degree, order, c, s: vec![0.0; size] })
    }

    /// Creates a field from zonal harmonics J₂, J₃, … (not normalised, as in data sheets): C̄_n0 = −J_n/√(2n+1). `j[0]` is J₂.
    ///
    /// # Errors
    /// As [`Coefficients::new`].
    pub fn zonal(mu: f64, radius: f64, j: &[f64]) -> Result<Self, WorldError> {
        let mut out = Self::new(mu, radius, j.len() + 1, 0)?;
        for (k, j) in j.iter().enumerate() {
            let n = k + 2;
            out.set(n, 0, -j / ((2 * n + 1) as f64).sqrt(), 0.0)?;
        }
        Ok(out)
    }

    /// Returns the highest degree.
    #[must_use]
    pub fn degree(&self) -> usize {
        self.degree
    }

    /// Returns the highest order.
    #[must_use]
    pub fn order(&self) -> usize {
        self.order
    }

    /// Returns (C̄_nm, S̄_nm); zeros outside the field.
    #[must_use]
    pub fn get(&self, n: usize, m: usize) -> (f64, f64) {
        if n > self.degree || m > self.order.min(n) {
            return (0.0, 0.0);
        }
        (self.c[at(n, m)], self.s[at(n, m)])
    }

    /// Sets C̄_nm and S̄_nm.
    ///
    /// # Errors
    /// The degree or order exceeds those given to [`Coefficients::new`], or a value is NaN or infinite.
    pub fn set(&mut self, n: usize, m: usize, c: f64, s: f64) -> Result<(), WorldError> {
        let help = "create a larger field: `Coefficients::new(mu, radius, degree, order)`";
        if n > self.degree {
            return Err(WorldError::Degree { what: "degree", asked: n, max: self.degree, help });
        }
        if m > self.order.min(n) {
            let max = self.order.min(n);
            return Err(WorldError::Degree { what: "order", asked: m, max, help });
        }
        self.c[at(n, m)] = number("C, normalised", c, |_| true, "coefficients are finite")?;
        self.s[at(n, m)] = number("S, normalised", s, |_| true, "coefficients are finite")?;
        Ok(())
    }

    /// Returns J_n = −C_n0, not normalised.
    #[must_use]
    pub fn j(&self, n: usize) -> f64 {
        -self.get(n, 0).0 * ((2 * n + 1) as f64).sqrt()
    }

    /// Returns the part up to `degree` and `order`.
    ///
    /// # Errors
    /// The degree or order exceeds that of the field. A field is never silently padded with zeros.
    pub fn truncated(&self, degree: usize, order: usize) -> Result<Self, WorldError> {
        let help = "read a larger field, or use a lower degree or order";
        for (what, asked, max) in [("degree", degree, self.degree), ("order", order, self.order)] {
            if asked > max {
                return Err(WorldError::Degree { what, asked, max, help });
            }
        }
        let mut out = Self::new(self.mu, self.radius, degree, order)?;
        out.tide = self.tide;
        for n in 0..=degree {
            for m in 0..=order.min(n) {
                (out.c[at(n, m)], out.s[at(n, m)]) = self.get(n, m);
            }
        }
        Ok(out)
    }

    /// Returns the RMS of the high orders (m > n/2) divided by that of the low ones, at the highest degree that has both. It is about 1 for
    /// normalised fields; without normalisation high orders are smaller by factorials. `None` below degree 8, where the two cannot be distinguished.
    pub(crate) fn high_over_low(&self) -> Option<f64> {
        let n = self.degree.min(self.order);
        if n < 8 {
            return None;
        }
        let rms = |orders: std::ops::RangeInclusive<usize>| {
            let count = orders.clone().count() as f64;
            let sum: f64 = orders.map(|m| self.get(n, m)).map(|(c, s)| c * c + s * s).sum();
            (sum / count).sqrt()
        };
        let (low, high) = (rms(1..=n / 2), rms(n / 2 + 1..=n));
        (low > 0.0).then(|| high / low)
    }
}
