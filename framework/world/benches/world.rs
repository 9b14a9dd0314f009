//! Cost of one query of each environment model: rotation, ephemeris, air, shadow, polyhedron, two bodies.
//!   cargo bench -p linkwork-world --bench world
use divan::{Bencher, black_box};
use linkwork_world::atmosphere::*;
use linkwork_world::eclipse::visible_fraction;
use linkwork_world::ephemeris::{self, Body};
use linkwork_world::gravity::polyhedron::Polyhedron;
use linkwork_world::orbit::propagate;
use linkwork_world::planet::rotation::{Earth, EarthParameters, FixedRate, gcrs_to_itrs};
use linkwork_world::planet::*;
use linkwork_world::spatial::Vec3;

fn main() {
    divan::main();
}

const P: Vec3 = Vec3::new(4293652.41, -3955168.47, 3139356.57);

fn epoch() -> Epoch {
    Epoch::parse("2012-08-06 05:17:57 UTC").expect("a date")
}

fn rotation(bencher: Bencher, rotation: &Rotation, t: f64) {
    bencher.bench(|| rotation.at(black_box(t)));
}

#[divan::bench]
fn rotation_fixed(bencher: Bencher) {
    let fixed = FixedRate::about_z(1.0, 7.29e-5).expect("finite");
    rotation(bencher, &Rotation::Fixed(fixed), 1234.5);
}

#[divan::bench]
fn rotation_mars(bencher: Bencher) {
    rotation(bencher, &Rotation::mars(&epoch()), 1234.5);
}

#[divan::bench]
fn rotation_moon(bencher: Bencher) {
    rotation(bencher, &Rotation::moon(&epoch()), 1234.5);
}

fn earth() -> Rotation {
    let earth = Earth::new(&epoch(), EarthParameters::default(), 1e5).expect("parameters");
    Rotation::Earth(Box::new(earth))
}

#[divan::bench]
fn rotation_earth_table(bencher: Bencher) {
    rotation(bencher, &earth(), 1234.5);
}

#[divan::bench]
fn rotation_earth_beyond(bencher: Bencher) {
    rotation(bencher, &earth(), 1e7);
}

#[divan::bench]
fn rotation_earth_series(bencher: Bencher) {
    let (epoch, p) = (epoch(), EarthParameters::default());
    bencher.bench(|| gcrs_to_itrs(black_box(&epoch), &p));
}

#[divan::bench]
fn geodetic(bencher: Bencher) {
    let ellipsoid = Ellipsoid::wgs84();
    bencher.bench(|| ellipsoid.geodetic(black_box(&P)));
}

const TDB: (f64, f64) = (4601.0, 0.25);

#[divan::bench]
fn ephemeris_sun() -> f64 {
    ephemeris::sun(black_box(TDB)).map_or(0.0, |s| s.position.x)
}

#[divan::bench]
fn ephemeris_sampled(bencher: Bencher) {
    use ephemeris::{Analytic, Sampled};
    let sampled = Sampled::new(&Analytic, Body::Sun, Body::Earth, &epoch(), 1e6).expect("years");
    bencher.bench(|| sampled.at(black_box(123_456.7)));
}

#[divan::bench]
fn ephemeris_moon() -> Vec3 {
    ephemeris::moon(black_box(TDB)).position
}

#[divan::bench]
fn ephemeris_sun_low() -> Vec3 {
    ephemeris::sun_low(black_box(TDB))
}

#[divan::bench]
fn ephemeris_moon_low() -> Vec3 {
    ephemeris::moon_low(black_box(TDB))
}

#[divan::bench]
fn ephemeris_mars() -> f64 {
    ephemeris::planet(Body::Mars, black_box(TDB)).map_or(0.0, |s| s.position.x)
}

#[divan::bench(args = [1e4, 4e5])]
fn air_us76(bencher: Bencher, z: f64) {
    let air = Us76::new();
    bencher.bench(|| air.at(black_box(z)));
}

#[divan::bench]
fn air_us76_made() -> Us76 {
    Us76::new()
}

#[divan::bench(args = [2e4, 1e5, 4e5])]
fn air_msis(bencher: Bencher, h: f64) {
    let (model, epoch) = (Msis::new(), epoch());
    let weather = SpaceWeather { f107: 150.0, f107_mean: 140.0, magnetic: Magnetic::Daily(8.0) };
    let place = Geodetic::from_degrees(38.0, -77.0, h);
    bencher.bench(|| model.at(&epoch, black_box(&place), &weather));
}

#[divan::bench]
fn shadow(bencher: Bencher) {
    let (r, s) = (Vec3::new(-7e6, 6.37e6, 0.0), Vec3::new(149.6e9, 0.0, 0.0));
    bencher.bench(|| visible_fraction(black_box(&r), &s, 6378137.0, 6.957e8));
}

#[divan::bench]
fn polyhedron_of_4_triangles(bencher: Bencher) {
    let corners = vec![Vec3::zeros(), Vec3::x(), Vec3::y(), Vec3::z()];
    let faces = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
    let body = Polyhedron::new(corners, &faces, 1.0).expect("closed");
    let p = Vec3::new(2.0, 1.0, 1.5);
    bencher.bench(|| body.gravity(black_box(&p)));
}

#[divan::bench]
fn two_bodies(bencher: Bencher) {
    let start = PointMotion { position: P, velocity: Vec3::new(100.0, 5000.0, 5500.0) };
    bencher.bench(|| propagate(3.986e14, black_box(&start), 3000.0));
}
