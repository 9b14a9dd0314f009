//! Magnetic field: golden numbers, dipole, zero divergence and curl, errors.

use crate::support::*;
use linkwork_world::magnetic::*;
use linkwork_world::planet::{Ellipsoid, Epoch, Geodetic};
use linkwork_world::spatial::Vec3;

/// Returns north, east, down, nT.
fn ned(epoch: &str, lat: f64, lon: f64, h: f64) -> Vec3 {
    let field = Igrf::v14().at(&Epoch::parse(epoch).unwrap()).unwrap();
    let place = Geodetic::from_degrees(lat, lon, h);
    let b = place.east_north_up().inverse() * field.at(&Ellipsoid::wgs84().position(&place));
    Vec3::new(b.y, b.x, -b.z) * 1e9
}

/// Reference data quick_golden.json (ppigrf): measured 2e-4 nT at the years of the table, because ppigrf rounds the polar radius to metres, and 0.006
/// nT between them, where it counts days and IAGA's program counts years of 365 or 366.
#[test]
fn igrf_gives_the_golden_numbers() {
    let a = ned("2020-01-01 00:00:00 UTC", 0.0, 0.0, 4e5);
    near3(&a, &Vec3::new(22639.778, -1986.686, -11680.552), 0.001, "(0°, 0°, 400 km, 2020)");
    let b = ned("2025-01-01 00:00:00 UTC", 60.0, -30.0, 5e5);
    near3(&b, &Vec3::new(11941.127, -2695.961, 40152.011), 0.001, "(60°, −30°, 500 km, 2025)");
    let Some(golden) = golden() else { return };
    for case in golden["igrf14_ned_nT"]["cases"].as_array().unwrap() {
        let n = |key: &str| number(&case[key]);
        let epoch = format!("{} UTC", case["date"].as_str().unwrap());
        let b = ned(&epoch, n("lat"), n("lon"), n("h_m"));
        near3(&b, &vec3(&case["B_ned"]), 0.01, &epoch);
    }
}

/// quick_golden.json, tilted_dipole; also the reference field far away.
#[test]
fn far_away_it_is_a_dipole() {
    let m = Vec3::new(-1.4509e-6, 4.6525e-6, -2.94048e-5);
    let b = dipole(&m, RADIUS, &Vec3::new(6.9e6, 1e6, 2e6));
    let golden = Vec3::new(-1.6128006771743223e-05, -5.633075575567971e-06, 1.4968916584129132e-05);
    near3(&b, &golden, 1e-19, "dipole");
    // The dipole of 2020 is g₁₀ −29403.41, g₁₁ −1451.37, h₁₁ 4653.35 nT.
    let field = Igrf::v14().at(&Epoch::parse("2020-01-01 00:00:00 UTC").unwrap()).unwrap();
    let m = Vec3::new(-1451.37e-9, 4653.35e-9, -29403.41e-9);
    let p = Vec3::new(6e8, 1e8, -3e8);
    let (whole, part) = (field.at(&p), dipole(&m, RADIUS, &p));
    assert!((whole - part).norm() < 0.01 * part.norm(), "{whole:?} {part:?}");
}

/// Jupiter by JRM09 (Connerney and others 2018, Geophys. Res. Lett. 45): g₁₁ −71 498.3, h₁₁ 21 330.5, g₁₀ 410 244.7 nT for R_J = 71 492 km; its
/// moment is published as 4.170 G R_J³, tilted by 10.31 degrees.
#[test]
fn a_dipole_of_another_planet_has_its_own_radius() {
    let m = Vec3::new(-71_498.3e-9, 21_330.5e-9, 410_244.7e-9);
    let across = m.cross(&Vec3::new(0.3, -0.8, 0.1)).normalize();
    let b = dipole(&m, 71_492e3, &(across * 71_492e3));
    near(b.norm(), 4.170e-4, 1e-7, "field at the magnetic equator");
    near(m.angle(&Vec3::z()).to_degrees(), 10.31, 0.005, "tilt");
}

#[test]
fn the_field_has_no_sources_and_no_currents() {
    let field = Igrf::v14().at(&Epoch::parse("2013-05-05 00:00:00 UTC").unwrap()).unwrap();
    for p in [Vec3::new(6.6e6, 1e6, 2e6), Vec3::new(0.0, 0.0, 6.9e6), Vec3::new(-4e6, 4e6, -4e6)] {
        let slope = slope(|p| field.at(p), &p, 1e3);
        near(slope.trace(), 0.0, 1e-8 * slope.norm(), "divergence");
        near33(&slope, &slope.transpose(), 1e-8 * slope.norm(), "curl");
    }
}

/// Truncated to degree 1 it is the dipole; the coefficients of 2020 are those of `far_away_it_is_a_dipole`.
#[test]
fn a_field_is_cut_at_a_degree() {
    let epoch = Epoch::parse("2020-01-01 00:00:00 UTC").unwrap();
    let cut = |degree: usize| Igrf::v14().truncated(degree).map(|i| i.at(&epoch).unwrap());
    let m = Vec3::new(-1451.37e-9, 4653.35e-9, -29403.41e-9);
    let p = Vec3::new(4e6, -3e6, 5e6);
    near3(&cut(1).unwrap().at(&p), &dipole(&m, RADIUS, &p), 1e-10, "degree 1");
    let whole = Igrf::v14().at(&epoch).unwrap().at(&p);
    assert_eq!(cut(Igrf::v14().degree()).unwrap().at(&p), whole);
    let (five, twelve) =
        ((cut(5).unwrap().at(&p) - whole).norm(), (cut(12).unwrap().at(&p) - whole).norm());
    assert!(twelve > 0.0 && five > 10.0 * twelve && five < 3e-6, "{five} {twelve}");
    for wrong in [0, 14] {
        assert!(cut(wrong).is_err_and(|e| e.to_string().contains("degree of a magnetic field")));
    }
}

#[test]
fn years_and_tables_are_checked() {
    let igrf = Igrf::v14();
    assert_eq!(igrf.range(), (1900.0, 2030.0));
    let late = igrf.at(&Epoch::parse("2031-01-01 00:00:00 UTC").unwrap()).unwrap_err().to_string();
    assert!(late.contains("year of a magnetic field"), "{late}");
    // The field is continuous where the secular variation begins, and changes after that.
    let b = |d: &str| ned(d, 30.0, 40.0, 0.0);
    let (before, after) = (b("2024-12-31 23:59:00 UTC"), b("2025-01-01 00:01:00 UTC"));
    near3(&before, &after, 1e-3, "no step");
    assert!((b("2028-01-01 00:00:00 UTC") - after).norm() > 10.0);
    let fault = |t: &str| Igrf::parse("t", t).unwrap_err().to_string();
    let head = "g/h n m 2020.0 2025.0 SV\n";
    assert!(fault("").contains("0 years and 0 rows"));
    assert!(fault(&format!("{head}g 1 0 -29404 1\n")).contains("t:2: 1 values for 2 years"));
    assert!(fault(&format!("{head}g 1 0 -29404 x 1\n")).contains("`x` is not a number"));
    assert!(fault(&format!("{head}g 1 2 -29404 1 1\n")).contains("degree 1, order 2"));
    assert!(
        fault(&format!("{head}k 1 1 -29404 1 1\n")).contains("`k 1 1 -29404 1 1` is not a row")
    );
    assert!(fault("g 1 0 -29404 1 2\n").contains("for 0 years"));
}
