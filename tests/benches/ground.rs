//! Cost of ground contact for a wheel: a terrain query, the discs of a wheel, the stresses of soft soil.
#![allow(missing_docs, clippy::disallowed_methods)]
use linkwork_collision::relief::Wheel;
use linkwork_environment::height_field::HeightField;
use linkwork_mobility::rigid_contact::Hub;
use linkwork_mobility::soil_contact::{SoilContact, SoilState};
use linkwork_mobility::terramechanics::{Motion, Rim, Shear, Sinkage, WheelSoil};
use linkwork_spatial::Vec3;
use linkwork_surroundings::Soil;
use std::hint::black_box;
use std::time::Instant;

/// Returns the shortest of several repeats, in ns per call; `f` gets the call's number.
fn best(calls: u32, mut f: impl FnMut(f64) -> f64) -> f64 {
    let mut least = f64::INFINITY;
    for _ in 0..10 {
        let start = Instant::now();
        let mut sum = 0.0;
        for k in 0..calls {
            sum += f(f64::from(k));
        }
        black_box(sum);
        least = least.min(start.elapsed().as_nanos() as f64 / f64::from(calls));
    }
    least
}

/// Lunar regolith of the Apollo source book.
const LUNAR: Soil = Soil {
    n: 1.0,
    n1: 0.0,
    k_c: 1400.0,
    k_phi: 8.2e5,
    cohesion: 170.0,
    friction_angle: 0.576,
    shear_modulus: 0.018,
    a0: 0.4,
    a1: 0.15,
    lambda: 0.5,
    density: 1600.0,
    friction: 0.65,
};

fn main() {
    let n = 2001;
    if let Ok(field) = HeightField::new([0.0; 2], [0.05; 2], n, n, vec![1.0; n * n]) {
        let height = |x, y| field.ground(x, y).map_or(0.0, |g| g.0);
        let ns = best(200_000, |k| height(10.0 + 4e-4 * k, 5.0 + 1.2e-4 * k));
        println!("height field of 2001 by 2001 nodes: {ns:8.1} ns a query");
    }
    let normal = Vec3::new(0.1, 0.05, 1.0).normalize();
    let plane = |x: f64, y: f64| Some((-(normal.x * x + normal.y * y) / normal.z, normal));
    let wheel = Wheel { radius: 0.25, width: 0.4 };
    let ns = best(50_000, |k| {
        let centre = Vec3::new(1e-6 * k, 0.0, 0.25);
        wheel.discs(centre, Vec3::y(), &plane)[0].depth()
    });
    println!("three discs of a wheel on a plane:  {ns:8.1} ns");
    for exponent in [1.0, 1.1] {
        let w = WheelSoil {
            rim: Rim { radius: 0.15, width: 0.10 },
            soil: Soil { n: exponent, ..LUNAR },
            shear: Shear::Isotropic,
            sinkage: Sinkage::Bekker,
            gravity: 9.81,
            approach: None,
            grousers: None,
        };
        let ns = best(20_000, |k| w.forces(0.02 + 1e-8 * k, &Motion::rolling(0.2, 1e-6 * k)).fx);
        println!("wheel on soil, exponent {exponent:3}:       {ns:8.1} ns");
    }
    let contact = SoilContact {
        wheel,
        shear: Shear::Isotropic,
        gravity: 3.72,
        shear_damping: 0.02,
        shear_unloading: 20.0,
        normal_damping: 4.0,
        unloading_stiffness: 3e5,
        grousers: None,
    };
    let state = SoilState { xi_x: 0.01, xi_y: 0.001, pressed: 0.0, rolled: 1.0, rolling: 0.1 };
    let hub = |k: f64| Hub {
        position: Vec3::new(1e-6 * k, 0.0, 0.235),
        axle: Vec3::y(),
        velocity: Vec3::x() * 0.04,
        angular: Vec3::y() * 0.2,
    };
    let slope = |x: f64, _: f64| Some((0.1 * x, Vec3::new(-0.0995, 0.0, 0.995)));
    let ns = best(20_000, |k| contact.evaluate(&LUNAR, &hub(k), &state, &slope, None).0.local.fx);
    println!("soil contact, load and rates:       {ns:8.1} ns");
}
