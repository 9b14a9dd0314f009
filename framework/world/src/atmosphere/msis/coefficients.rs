//! The model's coefficients, in the order and with the names of its authors.
//!
//! Values of the Naval Research Laboratory's distribution (a work of the US government), taken from the crate `tobari` (MIT).

/// The model's arrays.
#[derive(Clone, Debug)]
pub(super) struct Coefficients {
    /// Temperature of the exosphere.
    pub(super) pt: [f64; 150],
    /// Densities at 120 km of He, O, N₂, (temperature at 120 km), O₂, Ar, H, N, anomalous O.
    pub(super) pd: [[f64; 150]; 9],
    /// Temperature gradient at 120 km.
    pub(super) ps: [f64; 150],
    /// Corrections of the turbopause and of chemistry.
    pub(super) pdl: [[f64; 25]; 2],
    /// Mean temperatures.
    pub(super) ptm: [f64; 10],
    /// Mean densities of He, O, N₂, O₂, Ar, H, N, anomalous O.
    pub(super) pdm: [[f64; 10]; 8],
    /// Temperatures at 110, 100, 90, 72.5 km.
    pub(super) ptl: [[f64; 100]; 4],
    /// Temperatures and gradients below 72.5 km.
    pub(super) pma: [[f64; 100]; 10],
    /// Mean values of `pma`.
    pub(super) pavgm: [f64; 10],
}

/// Number of coefficients.
const COUNT: usize = 3200;

impl Coefficients {
    pub(super) fn new() -> Self {
        let text = include_str!("coefficients.txt");
        let all: Vec<f64> = text.split_whitespace().filter_map(|w| w.parse().ok()).collect();
        assert!(all.len() == COUNT, "coefficients.txt has {} numbers, not {COUNT}", all.len());
        let mut rest = all.into_iter();
        let mut next = || rest.next().unwrap_or(f64::NAN);
        Self {
            pt: std::array::from_fn(|_| next()),
            pd: std::array::from_fn(|_| std::array::from_fn(|_| next())),
            ps: std::array::from_fn(|_| next()),
            pdl: std::array::from_fn(|_| std::array::from_fn(|_| next())),
            ptm: std::array::from_fn(|_| next()),
            pdm: std::array::from_fn(|_| std::array::from_fn(|_| next())),
            ptl: std::array::from_fn(|_| std::array::from_fn(|_| next())),
            pma: std::array::from_fn(|_| std::array::from_fn(|_| next())),
            pavgm: std::array::from_fn(|_| next()),
        }
    }
}
