//! Season and time of day on Mars: the Mars24 algorithm (Allison and McEwen 2000).
//! ```text
//! M = 19.3871 + 0.52402073 Δt          α = 270.3871 + 0.524038496 Δt         (Δt: days of TT since J2000)
//! ν − M = (10.691 + 3e-7 Δt) sin M + 0.623 sin 2M + 0.050 sin 3M + 0.005 sin 4M + 0.0005 sin 5M + PBS
//! PBS = Σ A_i cos(0.985626 Δt/τ_i + φ_i)                 L_s = α + (ν − M)
//! EOT = 2.861 sin 2L_s − 0.071 sin 4L_s + 0.002 sin 6L_s − (ν − M)
//! MSD = (Δt − 4.5)/1.0274912517 + 44796 − 0.0009626      MTC = 24 frac(MSD)
//! LTST = MTC − λ_W/15 + EOT/15                           δ = asin(0.42565 sin L_s) + 0.25° sin L_s
//! R = 1.52367934 (1.00436 − 0.09309 cos M − 0.004336 cos 2M − 0.00031 cos 3M − 0.00003 cos 4M)  AU
//! ```
//! Angles in degrees, times in hours. The error is about 3 s of Mars time.

use linkwork_spatial::Vec3;
use std::str::FromStr;

/// Short periodic terms caused by the other planets: amplitude (deg), period (Julian years), phase (deg).
const PERTURBERS: [(f64, f64, f64); 7] = [
    (0.0071, 2.2353, 49.409),
    (0.0057, 2.7543, 168.173),
    (0.0039, 1.1177, 191.837),
    (0.0037, 15.7866, 21.736),
    (0.0021, 2.1354, 15.704),
    (0.0020, 2.4694, 95.528),
    (0.0018, 32.8493, 49.095),
];

/// Mars and the Sun at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MarsTime {
    /// Areocentric solar longitude L_s, deg in 0 to 360.
    pub solar_longitude_deg: f64,
    /// Equation of time, deg.
    pub equation_of_time_deg: f64,
    /// Mars sol date.
    pub sol_date: f64,
    /// Coordinated Mars time at the prime meridian, h.
    pub mtc_h: f64,
    /// Planetographic declination of the Sun, deg; the planetocentric one is asin(0.42565 sin L_s).
    pub declination_deg: f64,
    /// Distance of the Sun, AU.
    pub distance_au: f64,
}

/// The text is not a UTC date.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("`{0}` is not a date: write UTC as 2004-01-03T13:46:31Z")]
pub struct DateError(pub String);

/// Returns the days of terrestrial time since J2000 of a UTC text such as `2004-01-03T13:46:31Z`.
pub fn days_since_j2000(utc: &str) -> Result<f64, DateError> {
    let epoch = hifitime::Epoch::from_str(utc).map_err(|_| DateError(utc.to_string()))?;
    Ok(epoch.to_jde_tt_days() - 2_451_545.0)
}

impl MarsTime {
    /// Computes Mars and the Sun at `days` of terrestrial time since J2000 (2000-01-01 12:00 TT).
    pub fn at(days: f64) -> MarsTime {
        let m = (19.3871 + 0.524_020_73 * days).to_radians();
        let alpha = 270.3871 + 0.524_038_496 * days;
        let pbs: f64 = PERTURBERS
            .iter()
            .map(|(a, tau, phi)| a * (0.985_626 * days / tau + phi).to_radians().cos())
            .sum();
        let centre = (10.691 + 3e-7 * days) * m.sin()
            + 0.623 * (2.0 * m).sin()
            + 0.050 * (3.0 * m).sin()
            + 0.005 * (4.0 * m).sin()
            + 0.0005 * (5.0 * m).sin()
            + pbs;
        let ls_deg = (alpha + centre).rem_euclid(360.0);
        let ls = ls_deg.to_radians();
        let eot =
            2.861 * (2.0 * ls).sin() - 0.071 * (4.0 * ls).sin() + 0.002 * (6.0 * ls).sin() - centre;
        let sol_date = (days - 4.5) / 1.027_491_251_7 + 44_796.0 - 0.000_962_6;
        MarsTime {
            solar_longitude_deg: ls_deg,
            equation_of_time_deg: eot,
            sol_date,
            mtc_h: 24.0 * sol_date.rem_euclid(1.0),
            declination_deg: (0.42565 * ls.sin()).asin().to_degrees() + 0.25 * ls.sin(),
            distance_au: 1.523_679_34
                * (1.00436
                    - 0.09309 * m.cos()
                    - 0.004_336 * (2.0 * m).cos()
                    - 0.000_31 * (3.0 * m).cos()
                    - 0.000_03 * (4.0 * m).cos()),
        }
    }

    /// Returns the local true solar time at an east longitude (deg), h in 0 to 24.
    pub fn local_true_solar_h(&self, longitude_deg: f64) -> f64 {
        (self.mtc_h + longitude_deg / 15.0 + self.equation_of_time_deg / 15.0).rem_euclid(24.0)
    }

    /// Returns the unit vector towards the Sun in the site's frame (x east, y north, z up) at a geodetic latitude and an east
    /// longitude (deg). The Sun is far away, so its direction has the planetocentric declination at every latitude.
    pub fn sun_direction(&self, latitude_deg: f64, longitude_deg: f64) -> Vec3 {
        let (sin_lat, cos_lat) = latitude_deg.to_radians().sin_cos();
        let sin_dec = 0.42565 * self.solar_longitude_deg.to_radians().sin();
        let cos_dec = (1.0 - sin_dec * sin_dec).sqrt();
        let hour = (self.local_true_solar_h(longitude_deg) - 12.0) * 15.0;
        let (sin_h, cos_h) = hour.to_radians().sin_cos();
        Vec3::new(
            -cos_dec * sin_h,
            sin_dec * cos_lat - cos_dec * cos_h * sin_lat,
            sin_dec * sin_lat + cos_dec * cos_h * cos_lat,
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(got: f64, want: f64, tolerance: f64) {
        assert!((got - want).abs() <= tolerance, "{got} instead of {want}");
    }

    #[test]
    fn worked_example_of_2000() {
        let days = days_since_j2000("2000-01-06T00:00:00Z").unwrap();
        close(days, 4.500_74, 5e-6);
        let t = MarsTime::at(days);
        close(t.solar_longitude_deg, 277.18758, 1e-5);
        close(t.equation_of_time_deg, -5.18774, 1e-5);
        close(t.sol_date, 44_795.999_76, 5.1e-6);
        close(t.mtc_h, 23.0 + 59.0 / 60.0 + 39.0 / 3600.0, 0.5 / 3600.0);
        close(t.local_true_solar_h(0.0), 23.0 + 38.0 / 60.0 + 54.0 / 3600.0, 0.6 / 3600.0);
        close(t.declination_deg, -25.2282, 5.1e-5);
        close(t.distance_au, 1.3935, 1e-4);
    }

    #[test]
    fn worked_example_of_spirits_landing() {
        let days = days_since_j2000("2004-01-03T13:46:31Z").unwrap();
        close(days, 1463.07471, 5.1e-6);
        let t = MarsTime::at(days);
        close(t.solar_longitude_deg, 327.32416, 5.1e-6);
        close(t.equation_of_time_deg, -12.77553, 5.1e-5);
        close(t.sol_date, 46_215.548_56, 5.1e-6);
        close(t.mtc_h, 13.16537, 1e-4);
        close(t.local_true_solar_h(-184.702), 0.0002, 1e-4);
        close(t.declination_deg, -13.42040, 5.1e-5);
        close(t.distance_au, 1.47767, 5.1e-6);
        // At true midnight the Sun is due north or south, and at its lowest below the horizon.
        let d = t.sun_direction(-14.640, -184.702);
        close(d.x, 0.0, 1e-4);
        let centric = (0.42565 * 327.32416f64.to_radians().sin()).asin();
        close(d.z, -f64::cos(14.640f64.to_radians() - centric), 1e-6);
    }

    #[test]
    fn sun_rises_in_the_east_and_culminates_at_true_noon() {
        let start = days_since_j2000("2012-08-06T05:17:57Z").unwrap();
        let (lat, lon) = (-4.59, 137.44);
        let (mut best, mut high) = (0.0, -1.0);
        let mut last = -1.0;
        for k in 0..2000 {
            let t = MarsTime::at(start + 1.0275 * f64::from(k) / 2000.0);
            let d = t.sun_direction(lat, lon);
            close(d.norm(), 1.0, 1e-12);
            if d.z > high {
                (high, best) = (d.z, t.local_true_solar_h(lon));
            }
            if last < 0.0 && d.z >= 0.0 && k > 0 {
                assert!(d.x > 0.9, "sunrise in the east: {d}");
            }
            last = d.z;
        }
        close(best, 12.0, 0.03);
    }

    #[test]
    fn a_wrong_date_is_refused_with_an_example() {
        let e = days_since_j2000("yesterday").unwrap_err().to_string();
        assert!(e.contains("yesterday") && e.contains("2004-01-03T13:46:31Z"));
    }
}
