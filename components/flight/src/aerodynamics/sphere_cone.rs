//! Newtonian coefficients of a sphere-cone at angles of attack at which the flow reaches its whole front.
//! ```text
//! c = C_p,max    ν = r_n/r_b    r_t = ν cos δ (radius of the seam over r_b)    α ≤ δ
//! C_A = c [(cos²α sin²δ + ½ sin²α cos²δ)(1 − r_t²) + ν² (½ cos²α (1 − sin⁴δ) + ¼ sin²α cos⁴δ)]
//! C_N = c sin α cos α [cos²δ (1 − r_t²) + ½ ν² cos⁴δ]
//! moment  the cap acts through its centre, x = ν behind the nose; the cone has, about its apex at
//!         x = ν (1 − 1/sin δ), ⅔ c sin α cos α (cos δ/sin δ)(1 − r_t³), nose down
//! C_p,max = 4/(γ+1) ((γ+1)²/4γ)^(γ/(γ−1))  for M → ∞; 2 is pure Newtonian flow
//! ```
//! Areas are relative to the base area, moments to base area times base diameter, lengths to the base radius r_b.

/// A sphere-cone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SphereCone {
    /// Half angle of the cone δ, rad, 0 to π/2.
    pub half_angle: f64,
    /// Ratio ν of nose radius to base radius.
    pub bluntness: f64,
    /// Pressure coefficient at the stagnation point.
    pub pressure_max: f64,
}

/// Coefficients: axial force (backwards), normal force (towards −z at positive α), pitching moment (nose up).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coefficients {
    /// C_A.
    pub axial: f64,
    /// C_N.
    pub normal: f64,
    /// C_m about the given point.
    pub pitch: f64,
}

impl Coefficients {
    /// Lift and drag (C_L, C_D) at an angle of attack (rad).
    pub fn lift_drag(&self, alpha: f64) -> (f64, f64) {
        let (s, c) = alpha.sin_cos();
        (self.normal * c - self.axial * s, self.axial * c + self.normal * s)
    }
}

impl SphereCone {
    /// Returns the coefficients at an angle of attack α (rad, |α| ≤ δ), with moments about a point `aft` base radii behind the nose.
    pub fn at(&self, alpha: f64, aft: f64) -> Coefficients {
        let (c, nu) = (self.pressure_max, self.bluntness);
        let (sa, ca) = alpha.sin_cos();
        let (sd, cd) = self.half_angle.sin_cos();
        let rt = nu * cd;
        let ring = 1.0 - rt * rt;
        let cone_axial = (ca * ca * sd * sd + 0.5 * sa * sa * cd * cd) * ring;
        let cap_axial =
            nu * nu * (0.5 * ca * ca * (1.0 - sd.powi(4)) + 0.25 * sa * sa * cd.powi(4));
        let cone_normal = c * sa * ca * cd * cd * ring;
        let cap_normal = c * sa * ca * 0.5 * nu * nu * cd.powi(4);
        let apex = nu * (1.0 - 1.0 / sd);
        let cone_about_apex = -2.0 / 3.0 * c * sa * ca * (cd / sd) * (1.0 - rt.powi(3));
        // A normal force behind the point turns the nose down. The moment is in base radii; below it
        // is divided by the diameter.
        let pitch = cone_about_apex - cone_normal * (apex - aft) - cap_normal * (nu - aft);
        Coefficients {
            axial: c * (cone_axial + cap_axial),
            normal: cone_normal + cap_normal,
            pitch: 0.5 * pitch,
        }
    }
}

/// Pressure coefficient at the stagnation point behind a normal shock at M → ∞, ratio of heats γ.
pub fn pressure_max(gamma: f64) -> f64 {
    let g = gamma + 1.0;
    4.0 / g * (g * g / (4.0 * gamma)).powf(gamma / (gamma - 1.0))
}

/// Pressure coefficient on the base of a blunt body at a Mach number; it is negative, and its magnitude adds to C_A.
/// ```text
/// C_p,b = 8.325e-3 + 0.11293/M − 1.801/M² + 1.2885/M³
/// ```
/// The formula is a fit to Viking for M ≥ 1; at M = 1 it is −0.39. For M → ∞ the formula approaches +0.008 and is positive beyond M = 8.9, where a
/// vacuum on the base is within its uncertainty; 0 is used at these Mach numbers. Below M = 1 the value at M = 1 is used.
#[must_use]
pub fn base_pressure(mach: f64) -> f64 {
    let m = mach.max(1.0);
    (8.325e-3 + (0.11293 + (-1.801 + 1.2885 / m) / m) / m).min(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn viking() -> SphereCone {
        SphereCone { half_angle: 70f64.to_radians(), bluntness: 0.5, pressure_max: 2.0 }
    }

    #[test]
    fn seventy_degrees_gives_the_numbers_of_the_quadrature() {
        // C_A, C_N, C_m, C_D and C_L were computed by another program and agree with a quadrature of
        // the pressure to 4e-16.
        for (alpha, want) in [
            (0.0_f64, [1.769465393281197, 0.0, 0.0, 1.769465393281197, 0.0]),
            (
                5.0,
                [
                    1.7568999003067842,
                    0.02001595717294129,
                    -0.01771771058789569,
                    1.7519588713777476,
                    -0.1331841253316088,
                ],
            ),
            (
                11.0,
                [
                    1.709239228935653,
                    0.04317989184370387,
                    -0.03822194563533635,
                    1.686074801921527,
                    -0.28375166451928224,
                ],
            ),
            (
                16.0,
                [
                    1.6437861187321867,
                    0.06108236458635961,
                    -0.05406884359387428,
                    1.5969452137140026,
                    -0.39437272192182105,
                ],
            ),
            (
                20.0,
                [
                    1.575960975621609,
                    0.07409239440140282,
                    -0.06558505243720869,
                    1.5062599907906968,
                    -0.4693863224824061,
                ],
            ),
        ] {
            let a = alpha.to_radians();
            let c = viking().at(a, 0.3);
            let (lift, drag) = c.lift_drag(a);
            for (found, want) in [c.axial, c.normal, c.pitch, drag, lift].into_iter().zip(want) {
                assert!((found - want).abs() < 1e-14, "{alpha}: {found} {want}");
            }
        }
    }

    #[test]
    fn a_stagnation_point_behind_a_strong_shock() {
        // The reference formula was evaluated separately with more digits: 1.876969 for γ = 1.29.
        assert!((pressure_max(1.4) - 1.839_371_051_130_667).abs() < 1e-14);
        assert!((pressure_max(1.29) - 1.876_968_671_833_093).abs() < 1e-14);
        // In the limit γ → 1 the shock lies on the body, and the value is Newton's 2.
        assert!((pressure_max(1.000001) - 2.0).abs() < 1e-4);
    }

    /// Reference formula, evaluated separately in exact fractions; −1/M² approximates it at flight speeds.
    #[test]
    fn the_base_is_sucked_back() {
        for (mach, wanted) in [(1.0, -0.391_245), (2.0, -0.224_397_5), (5.0, -0.030_821)] {
            assert!(
                (base_pressure(mach) - wanted).abs() < 1e-12,
                "{mach}: {}",
                base_pressure(mach)
            );
        }
        for mach in [1.7, 2.0, 2.5, 3.0] {
            assert!((base_pressure(mach) + 1.0 / (mach * mach)).abs() < 0.06, "{mach}");
        }
        assert_eq!((base_pressure(0.3), base_pressure(25.0)), (base_pressure(1.0), 0.0));
        assert!(base_pressure(f64::NAN).is_finite());
        // The base never has less pressure than a vacuum: −C_p ≤ 2/(γ M²).
        for k in 10..120 {
            let m = 0.1 * f64::from(k);
            assert!(base_pressure(m) >= -2.0 / (1.29 * m * m), "{m}");
        }
    }

    #[test]
    fn a_sharp_cone_and_a_hemisphere_are_the_textbook_ones() {
        let cone = SphereCone { half_angle: 0.7, bluntness: 0.0, pressure_max: 2.0 };
        assert!((cone.at(0.0, 0.0).axial - 2.0 * 0.7f64.sin().powi(2)).abs() < 1e-15);
        let ball = SphereCone { half_angle: 1e-9, bluntness: 1.0, pressure_max: 2.0 };
        assert!((ball.at(0.0, 0.0).axial - 1.0).abs() < 1e-9, "C_D of a sphere is 1");
    }
}
