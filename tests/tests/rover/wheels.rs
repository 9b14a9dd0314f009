//! Wheels on the soils of the library, and on height fields: tests that involve several component crates.
use linkwork_collision::relief::{DISCS, DiscContact, Wheel};
use linkwork_environment::height_field::HeightField;
use linkwork_environment::soil::{SoilKind, SoilParams};
use linkwork_mobility::terramechanics::{Motion, Rim, Shear, Sinkage, WheelSoil};
use linkwork_mobility::wheel_test::slip_on_slope;
use linkwork_spatial::Vec3;

/// A rover's wheel on a published soil, under the gravity of Mars.
fn wheel(kind: SoilKind) -> WheelSoil {
    WheelSoil {
        rim: Rim { radius: 0.25, width: 0.4 },
        soil: SoilParams::of(kind).soil().unwrap(),
        shear: Shear::Isotropic,
        sinkage: Sinkage::Bekker,
        gravity: 3.72,
        approach: None,
        grousers: None,
    }
}

/// Returns pull (N) and sinkage (m) under a load (N) at a slip.
fn pull(w: &WheelSoil, load: f64, slip: f64) -> (f64, f64) {
    let m = Motion::rolling(slip, 0.0);
    let z = w.sinkage_under(load, &m).unwrap();
    (w.forces(z, &m).fx, z)
}

const ALL: [SoilKind; 12] = [
    SoilKind::Lunar,
    SoilKind::LunarSimulant,
    SoilKind::DrySand,
    SoilKind::DrySandRover,
    SoilKind::SandyLoam,
    SoilKind::ClayeySoil,
    SoilKind::Snow,
    SoilKind::LeteSand,
    SoilKind::SoilSimulant,
    SoilKind::SilicaSand,
    SoilKind::CrushedGranite,
    SoilKind::MarsDrift,
];

#[test]
fn every_published_soil_carries_a_rover_and_grips_more_the_more_it_slips() {
    for kind in ALL {
        let w = wheel(kind);
        let mut last = f64::NEG_INFINITY;
        for slip in [-0.2, 0.0, 0.1, 0.2, 0.4] {
            let (fx, z) = pull(&w, 560.0, slip);
            assert!(z > 1e-4 && z < 0.2, "{kind:?}: {z} m");
            assert!(fx > last, "{kind:?}: pull falls to {fx} N at slip {slip}");
            last = fx;
        }
        println!("{kind:?}: pull {last:.0} N at slip 0.4");
    }
}

#[test]
fn slip_against_slope_is_that_for_which_the_soil_is_made() {
    // The soil is tuned to the slips of a single-wheel rig on Earth (lunar prototype wheel of 0.225 m in simulant of
    // the type GRC-1): 43 % at 15 degrees, 76 % at 20 degrees.
    let w = wheel(SoilKind::MarsDrift);
    let slips =
        [0.0, 5.0, 10.0, 15.0, 20.0, 25.0].map(|d| slip_on_slope(&w, 560.0, f64::to_radians(d)));
    println!("slip at 0, 5, 10, 15, 20, 25 degrees: {slips:?}");
    let [s0, s5, s10, s15, s20] = [0, 1, 2, 3, 4].map(|k| slips[k].unwrap());
    assert!(s0 > 0.0 && s0 < 0.1 && (s15 - 0.43).abs() < 0.03 && (s20 - 0.76).abs() < 0.03);
    assert!(slips[5].is_none(), "25 degrees are too steep");
    // The slip increases more and more with the slope.
    assert!(s10 - s5 > s5 - s0 && s15 - s10 > s10 - s5 && s20 - s15 > s15 - s10);
}

#[test]
fn slip_sinks_a_wheel_where_the_soil_has_slip_sinkage() {
    let ratio = |kind| {
        let w = wheel(kind);
        pull(&w, 560.0, 0.67).1 / pull(&w, 560.0, 0.01).1
    };
    // Without slip sinkage the ratio is 1.09. For comparison, a smooth 58 mm wheel on silica sand has 1.76 at a slip of
    // 0.75, and 1.58 at 0.5 (robomechanics/3d-terramechanics).
    assert!(ratio(SoilKind::Lunar) < 1.15);
    println!("{} {}", ratio(SoilKind::MarsDrift), ratio(SoilKind::SoilSimulant));
    assert!(ratio(SoilKind::MarsDrift) > 1.25 && ratio(SoilKind::SoilSimulant) > 2.0);
}

/// Nodes 5 cm apart with relief, rocks and a step, as in a generated yard.
fn yard() -> HeightField {
    let n = 121;
    let mut heights = Vec::new();
    for j in 0..n {
        for i in 0..n {
            let (x, y) = (0.05 * f64::from(i), 0.05 * f64::from(j));
            let mut h =
                0.06 * (1.3 * x + 0.4).sin() * (1.1 * y).cos() + 0.01 * (5.0 * x - 3.0 * y).sin();
            for (rx, ry, size) in
                [(1.5, 3.0, 0.15), (2.3, 2.9, 0.08), (3.1, 3.15, 0.2), (4.4, 2.85, 0.12)]
            {
                let d2 = (x - rx) * (x - rx) + (y - ry) * (y - ry);
                h += (size * size - d2).max(0.0).sqrt();
            }
            heights.push((h + if x > 5.0 { 0.1 } else { 0.0 }) as f32);
        }
    }
    HeightField::new([0.0; 2], [0.05; 2], n as usize, n as usize, heights).unwrap()
}

#[test]
fn a_wheel_crosses_a_yard_of_rocks_without_a_jolt() {
    // In an earlier version the penetration jumped from 2.9 mm to 21.4 mm within one step of 0.25
    // mm.
    let field = yard();
    let wheel = Wheel { radius: 0.25, width: 0.4 };
    let ground = |x: f64, y: f64| field.ground(x, y);
    let (mut c, hair) = (Vec3::new(0.5, 3.0, 0.5), 2.5e-4);
    let mut last: Option<(Vec3, [DiscContact; DISCS])> = None;
    let (mut worst, mut most) = (0.0_f64, 0.0_f64);
    while c.x < 5.6 {
        let now = wheel.discs(c, Vec3::y(), &ground);
        let depth = now.iter().fold(0.0_f64, |a, d| a.max(d.depth()));
        if let Some((was, old)) = last {
            for (a, b) in now.iter().zip(&old) {
                let change = (a.depth() - b.depth()).abs();
                worst = worst.max(change / (c - was).norm());
                most = most.max(change);
            }
        }
        last = Some((c, now));
        let rise = (0.1 * (depth - 0.003)).clamp(-hair, hair);
        c += Vec3::new(if depth > 0.006 { 0.0 } else { hair }, 0.0, rise);
    }
    println!("depth changes by {worst} times the motion at most, {} mm a step", most * 1e3);
    assert!(worst < 4.0 && most < 1e-3, "{worst} {most}");
}
