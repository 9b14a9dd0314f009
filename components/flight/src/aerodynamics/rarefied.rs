//! Aerodynamics in thin air: free molecular flow on a surface, and the transition to the continuum.
//! ```text
//! one side of a flat plate, s = V/√(2 R T), σ = sin of the incidence (1: head on), diffuse share a, T_w
//! C_p = [ (2−a)/√π σs + a/2 √(T_w/T) ] e^(−σ²s²)/s² + [ (2−a)(σ² s² + ½) + a/2 √(π T_w/T) σ s ] (1 + erf σs)/s²
//! C_τ = a cosθ/(√π s) [ e^(−σ²s²) + √π σ s (1 + erf σs) ]
//! bridge  C = C_c + (C_fm − C_c) sin²(π (3/8 + log₁₀Kn/8)),  10⁻³ < Kn < 10
//! ```
//! The formulas for the plate are those of Schaaf and Chambré (Maxwellian gas, one accommodation coefficient for pressure and shear).

use std::f64::consts::PI;

/// Pressure and shear coefficients (C_p, C_τ) of one side of a plate in free molecular flow.
///
/// `sine`: sine of the angle between surface and stream, 1 if the stream is normal to the surface, negative on the lee side; `speed_ratio`
/// s > 0; `diffuse` a: 0 specular, 1 diffuse; `wall`: wall temperature over that of the gas.
pub fn free_molecular(sine: f64, speed_ratio: f64, diffuse: f64, wall: f64) -> (f64, f64) {
    let (s, a) = (speed_ratio, diffuse);
    let x = sine * s;
    let (gauss, full) = ((-x * x).exp(), 1.0 + erf(x));
    let root_pi = PI.sqrt();
    let p = ((2.0 - a) / root_pi * x + 0.5 * a * wall.sqrt()) * gauss
        + ((2.0 - a) * (x * x + 0.5) + 0.5 * a * (PI * wall).sqrt() * x) * full;
    let cosine = (1.0 - sine * sine).max(0.0).sqrt();
    let shear = a * cosine / (root_pi * s) * (gauss + root_pi * x * full);
    (p / (s * s), shear)
}

/// Fraction of the free molecular coefficient at a Knudsen number: 0 in the continuum, 1 in free molecular flow.
pub fn bridge(knudsen: f64) -> f64 {
    if knudsen <= 1e-3 {
        0.0
    } else if knudsen >= 10.0 {
        1.0
    } else {
        (PI * (0.375 + 0.125 * knudsen.log10())).sin().powi(2)
    }
}

/// The error function, to 1e-15: its series below 2.5, a continued fraction of erfc above.
pub fn erf(x: f64) -> f64 {
    let a = x.abs();
    if a > 6.0 {
        return x.signum();
    }
    if a < 2.5 {
        // The series is 2/√π e^(−x²) Σ 2ⁿ x^(2n+1)/(2n+1)!!, whose terms all have the same sign.
        let (mut term, mut sum, mut n) = (x, x, 0.0);
        while term.abs() > 1e-17 * sum.abs() {
            n += 1.0;
            term *= 2.0 * x * x / (2.0 * n + 1.0);
            sum += term;
        }
        return 2.0 / PI.sqrt() * (-x * x).exp() * sum;
    }
    // Evaluate the continued fraction erfc(a) √π e^(a²) = 1/(a + ½/(a + 1/(a + 3⁄2/(a + …)))) from
    // the inside.
    let fraction = (1..=80).rev().fold(a, |f, k| a + 0.5 * f64::from(k) / f);
    x.signum() * (1.0 - (-a * a).exp() / (PI.sqrt() * fraction))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn erf_is_that_of_the_tables() {
        // Reference: Abramowitz and Stegun, table 7.1, with 15 digits.
        for (x, want) in [
            (0.0, 0.0),
            (0.5, 0.520_499_877_813_047),
            (1.0, 0.842_700_792_949_715),
            (2.0, 0.995_322_265_018_953),
            (3.0, 0.999_977_909_503_001),
        ] {
            assert!((erf(x) - want).abs() < 2e-15, "{x}: {}", erf(x));
            assert_eq!(erf(-x), -erf(x));
        }
        // The series and the continued fraction agree where one replaces the other.
        assert!((erf(2.5 - 1e-12) - erf(2.5 + 1e-12)).abs() < 1e-14);
        assert!(erf(f64::NAN).is_nan());
    }

    #[test]
    fn a_plate_in_a_fast_stream_stops_or_turns_back_what_hits_it() {
        // In the limit s → ∞, head on, specular molecules reverse (C_p = 4), and diffuse ones from a cold
        // wall stop (C_p = 2).
        let (specular, shear) = free_molecular(1.0, 1e4, 0.0, 1.0);
        assert!((specular - 4.0).abs() < 1e-7 && shear == 0.0);
        assert!((free_molecular(1.0, 1e4, 1.0, 1e-9).0 - 2.0).abs() < 1e-7);
        // For an oblique plate with diffuse reflection from a cold wall, the force is the momentum
        // 2 sin θ of the stream, along the stream.
        let (p, t) = free_molecular(0.6, 1e4, 1.0, 1e-9);
        assert!((p - 2.0 * 0.36).abs() < 1e-7 && (t - 2.0 * 0.6 * 0.8).abs() < 1e-7);
        let lee = free_molecular(-0.5, 20.0, 1.0, 1.0);
        assert!(lee.0.abs() < 1e-12 && lee.1.abs() < 1e-12, "nothing comes from behind");
    }

    /// Limit of slow flow: the pressure of a Maxwellian gas on a wall at the same temperature, C_p = 1/s².
    #[test]
    fn a_plate_at_rest_feels_the_pressure_of_the_gas() {
        for a in [0.0, 0.4, 1.0] {
            let s = 1e-4;
            let (p, _) = free_molecular(0.3, s, a, 1.0);
            assert!((p * s * s - 1.0).abs() < 1e-3, "{a}: {}", p * s * s);
        }
    }

    #[test]
    fn the_bridge_has_its_ends_and_its_middle() {
        assert_eq!((bridge(1e-4), bridge(100.0)), (0.0, 1.0));
        assert!(bridge(1.0001e-3) < 1e-8 && bridge(9.999) > 1.0 - 1e-8);
        assert!((bridge(0.1) - 0.5).abs() < 1e-15);
        assert!((bridge(1.0) - (3.0 * PI / 8.0).sin().powi(2)).abs() < 1e-15);
    }
}
