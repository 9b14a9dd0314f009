//! Parameters of the rotation of the Earth at an instant.
use std::f64::consts::TAU;

/// Parameters that the IERS publishes daily. If all are zero, the error is up to 0.9 s of UT1 (400 m on the ground) and 10 m in the pole.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EarthParameters {
    /// UT1 − UTC at the epoch, s.
    pub dut1: f64,
    /// Coordinates of the pole, rad.
    pub pole: [f64; 2],
    /// Offsets dX, dY of the celestial pole, rad.
    pub celestial_pole_offsets: [f64; 2],
    /// Excess length of day over 86400 s, s; UT1 slows down by this.
    pub excess_of_day: f64,
}

impl EarthParameters {
    /// Creates parameters from the units of the IERS bulletins: s, arc seconds, milliarc seconds, s.
    #[must_use]
    pub fn from_bulletin(
        dut1: f64,
        pole_arcsec: [f64; 2],
        offsets_mas: [f64; 2],
        excess_of_day: f64,
    ) -> Self {
        let arcsec = TAU / 1_296_000.0;
        Self {
            dut1,
            pole: pole_arcsec.map(|x| x * arcsec),
            celestial_pole_offsets: offsets_mas.map(|x| x * arcsec * 1e-3),
            excess_of_day,
        }
    }
}
