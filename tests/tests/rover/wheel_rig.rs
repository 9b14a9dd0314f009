//! The single-wheel rig of `sims/wheel_rig` compared with the stress integrals that `linkwork wheel-test` prints.
use linkwork_environment::soil::{SoilKind, SoilParams};
use linkwork_mobility::terramechanics::{Rim, Shear, Sinkage, WheelSoil};
use linkwork_mobility::wheel_test::against_slip;
use linkwork_runtime::Seconds;

use crate::common;

#[test]
fn the_rig_measures_the_curves_of_the_stress_integrals() {
    for (soil, kind) in [("mars_drift", SoilKind::MarsDrift), ("dry_sand", SoilKind::DrySand)] {
        let set = [format!("soil={{ \"kind\": \"{soil}\" }}")];
        let set = set.each_ref().map(String::as_str);
        let mut sim =
            common::repository("wheel_rig/sim.ron", &set).unwrap_or_else(|e| panic!("{e}"));
        let wheel = WheelSoil {
            rim: Rim { radius: 0.25, width: 0.4 },
            soil: SoilParams::of(kind).soil().unwrap(),
            shear: Shear::Isotropic,
            sinkage: Sinkage::Bekker,
            gravity: 3.72076,
            approach: None,
            grousers: None,
        };
        let load = 150.5 * 3.72076;
        let (mut worst, mut last) = ([0.0_f64; 3], -1.0);
        for second in (10..=75).step_by(5) {
            sim.run_until(Seconds { num: second, den: 1 }).unwrap();
            let get = |port: &str| sim.get(&format!("SurfaceContact.{port}")).unwrap();
            let slip = get("slip");
            let row = against_slip(&wheel, load, 0.0, &[slip])[0].unwrap();
            let torque = sim.get("Drive.power").unwrap() / sim.get("wheel.rate").unwrap();
            let off = [
                (get("contact_force.x") - row.pull).abs() / load,
                (get("sinkage") - row.sinkage).abs() / row.sinkage,
                (torque - row.torque).abs() / (load * 0.25),
            ];
            println!("{soil}: slip {slip:.3}, pull {:.1} N, off by {off:?}", row.pull);
            for (w, o) in worst.iter_mut().zip(off) {
                *w = if o <= *w { *w } else { o };
            }
            assert!(slip > last, "the slip grows");
            last = slip;
        }
        println!("{soil}: pull, sinkage, torque off by {worst:?}");
        // The spin increases slowly: the remaining difference is the lag of the soil's state, and the armature's own torque. Measured: 4e-5 of the
        // load, 1.1e-3 of the sinkage, 1.1e-3 of load times radius.
        assert!(worst[0] < 2e-4 && worst.iter().all(|w| *w < 2e-3), "{soil}: {worst:?}");
        assert!(last > 0.8, "{last}");
    }
}
