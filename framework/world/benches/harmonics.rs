//! Spherical harmonics. Targets: 20 × 20 in 2 µs, 70 × 70 in 8 µs on one core of a 2023 server.
//!   cargo bench -p linkwork-world --bench harmonics
use divan::{Bencher, black_box};
use linkwork_world::gravity::{Coefficients, Harmonics, point_mass};
use linkwork_world::spatial::Vec3;

fn main() {
    println!("targets: acceleration 20: 2 µs, 70: 8 µs (medians)");
    divan::main();
}

/// Returns a field of full size with coefficients as large as the Earth's by Kaula's rule. The values do not influence the time.
fn field(degree: usize) -> Harmonics {
    let mut c = Coefficients::new(3.986004415e14, 6378136.3, degree, degree).expect("a field");
    for n in 2..=degree {
        for m in 0..=n {
            let k = 1e-5 / (n * n) as f64;
            let (a, b) = ((n * 31 + m * 17) % 19, (n * 13 + m * 29) % 23);
            c.set(n, m, k * (a as f64 / 9.5 - 1.0), k * (b as f64 / 11.5 - 1.0)).expect("inside");
        }
    }
    Harmonics::new(&c)
}

const P: Vec3 = Vec3::new(4293652.41, -3955168.47, 3139356.57);

#[divan::bench(args = [2, 8, 20, 70, 180, 360])]
fn acceleration(bencher: Bencher, degree: usize) {
    let field = field(degree);
    bencher.bench(|| field.acceleration(black_box(&P)));
}

#[divan::bench(args = [2, 8, 20, 70, 180, 360])]
fn with_gradient(bencher: Bencher, degree: usize) {
    let field = field(degree);
    bencher.bench(|| field.full(black_box(&P)));
}

#[divan::bench]
fn point(bencher: Bencher) {
    bencher.bench(|| point_mass(black_box(3.986004415e14), black_box(&P)));
}
