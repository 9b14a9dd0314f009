//! Quantities that a single-wheel rig measures, computed from the stress integrals: pull, torque and sinkage over slip, and slip over slope.
//! ```text
//! z            F_z(z) = W                       sinkage under the load W
//! efficiency   η = F_x v_x/(T ω) = F_x r (1 − s)/T
//! slope        F_x(s; W cos α) = W sin α        the least slip at which a lone driven wheel climbs steadily
//! ```

use crate::terramechanics::{Motion, WheelSoil};

/// Steady driving at one slip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    /// Slip, −1 to 1.
    pub slip: f64,
    /// Sinkage, m.
    pub sinkage: f64,
    /// Drawbar pull, N.
    pub pull: f64,
    /// Side force, N.
    pub side: f64,
    /// Torque of the drive, N m.
    pub torque: f64,
    /// Pull over load.
    pub coefficient: f64,
    /// Share of the drive's power that pulls; 0 where nothing pulls or nothing drives.
    pub efficiency: f64,
}

/// One row for each slip (above −1 to 1) at a slip angle (rad) under a load (N); `None` where the soil does not carry the load.
pub fn against_slip(
    wheel: &WheelSoil,
    load: f64,
    angle: f64,
    slips: &[f64],
) -> Vec<Option<Measured>> {
    slips.iter().map(|&slip| row(wheel, load, angle, slip)).collect()
}

fn row(wheel: &WheelSoil, load: f64, angle: f64, slip: f64) -> Option<Measured> {
    let motion = Motion::rolling(slip, angle);
    let sinkage = wheel.sinkage_under(load, &motion)?;
    let f = wheel.forces(sinkage, &motion);
    let driven = f.torque > 0.0 && f.fx > 0.0 && slip >= 0.0;
    let efficiency = if driven { f.fx * wheel.rim.radius * (1.0 - slip) / f.torque } else { 0.0 };
    Some(Measured {
        slip,
        sinkage,
        pull: f.fx,
        side: f.fy,
        torque: f.torque,
        coefficient: f.fx / load,
        efficiency,
    })
}

/// Greatest slip that is looked at on slopes.
const STALL: f64 = 0.99;
/// Steps in which the first slip that is enough is looked for.
const STEPS: u32 = 99;

/// Least slip at which a driven wheel of the weight (N) climbs a slope (rad, 0 to π/2) steadily; `None` where it stalls.
pub fn slip_on_slope(wheel: &WheelSoil, weight: f64, slope: f64) -> Option<f64> {
    let (sin, cos) = slope.sin_cos();
    let enough =
        |slip: f64| row(wheel, weight * cos, 0.0, slip).is_some_and(|r| r.pull >= weight * sin);
    // Slip sinkage may make the pull decrease again, so the first crossing counts.
    let at = |k: u32| STALL * f64::from(k) / f64::from(STEPS);
    let first = (0..=STEPS).find(|&k| enough(at(k)))?;
    if first == 0 {
        return Some(0.0);
    }
    let (mut low, mut high) = (at(first - 1), at(first));
    for _ in 0..50 {
        let middle = 0.5 * (low + high);
        if enough(middle) { high = middle } else { low = middle }
    }
    Some(high)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_soils::{golden_wheel, lunar};
    use linkwork_surroundings::prelude::Soil;

    #[test]
    fn the_table_is_that_of_an_independent_integration() {
        // Values of another program by adaptive quadrature: slip, sinkage (mm), pull (N), torque (N m).
        let known = [
            [0.0, 19.460, -1.00353, 1.595494],
            [0.1, 19.645, 13.39794, 3.830330],
            [0.2, 19.821, 22.98745, 5.330925],
            [0.4, 20.203, 33.84910, 7.069681],
            [0.6, 20.664, 38.97604, 7.945018],
            [0.8, 21.217, 41.41025, 8.420862],
        ];
        let rows = against_slip(&golden_wheel(), 100.0, 0.0, &known.map(|k| k[0]));
        for (row, [slip, z, pull, torque]) in rows.iter().zip(known) {
            let r = row.unwrap();
            assert!((r.sinkage - 1e-3 * z).abs() < 5.1e-7, "{r:?}");
            assert!((r.pull - pull).abs() < 6e-6 && (r.torque - torque).abs() < 6e-7, "{r:?}");
            assert!((r.coefficient - pull / 100.0).abs() < 1e-7 && r.slip == slip);
        }
        // Sideways motion by 20° at slip 0.2 and 0.6.
        let rows = against_slip(&golden_wheel(), 100.0, 20f64.to_radians(), &[0.2, 0.6]);
        for (row, [pull, side]) in rows.iter().zip([[14.36330, 37.84901], [37.96765, 14.05557]]) {
            let r = row.unwrap();
            assert!((r.pull - pull).abs() < 6e-6 && (r.side.abs() - side).abs() < 6e-6, "{r:?}");
        }
    }

    #[test]
    fn no_more_power_pulls_than_drives() {
        for k in 0..=99 {
            let r = row(&golden_wheel(), 100.0, 0.0, 0.01 * f64::from(k)).unwrap();
            assert!((0.0..1.0).contains(&r.efficiency), "{r:?}");
            // T ω = F v + loss, divided by r ω.
            assert!(r.torque / 0.15 >= r.pull * (1.0 - r.slip), "{r:?}");
        }
    }

    #[test]
    fn on_a_slope_the_pull_is_what_gravity_takes() {
        let mut last = 0.0;
        for degrees in [0.0, 5.0, 10.0, 15.0, 20.0] {
            let slope = f64::to_radians(degrees);
            let slip = slip_on_slope(&golden_wheel(), 100.0, slope).unwrap();
            let r = row(&golden_wheel(), 100.0 * slope.cos(), 0.0, slip).unwrap();
            assert!((r.pull - 100.0 * slope.sin()).abs() < 1e-6, "{degrees}: {r:?}");
            assert!(slip > last, "{degrees}: {slip} {last}");
            last = slip;
        }
        assert_eq!(slip_on_slope(&golden_wheel(), 100.0, 0.6), None);
        // Soil that cannot carry the load gives no row and no slope.
        let slime = WheelSoil { soil: Soil { k_phi: 10.0, k_c: 0.0, ..lunar() }, ..golden_wheel() };
        assert_eq!(against_slip(&slime, 1e4, 0.0, &[0.1]), [None]);
        assert_eq!(slip_on_slope(&slime, 1e4, 0.0), None);
    }
}
