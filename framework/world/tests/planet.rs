//! Ellipsoids, epochs, rotations, sites, orbital frames.

use crate::support::*;
use linkwork_world::planet::rotation::{
    Earth, EarthOrientation, EarthParameters, FixedRate, IauRotation, earth_rotation_angle,
    gcrs_to_itrs,
};
use linkwork_world::planet::*;
use linkwork_world::spatial::{Mat3, Quat, Vec3};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

fn matrix(R: &Quat) -> Mat3 {
    *R.to_rotation_matrix().matrix()
}

#[test]
fn geodetic_and_back_keeps_nanometres() {
    let mut random = Random(1);
    let oblate = Ellipsoid::new(7e6, 0.1).unwrap();
    for e in [Ellipsoid::wgs84(), Ellipsoid::mars(), Ellipsoid::moon(), oblate] {
        let mut worst: f64 = 0.0;
        for k in 0..4000 {
            let latitude = match k % 4 {
                0 => random.between(-FRAC_PI_2, FRAC_PI_2),
                1 => FRAC_PI_2 - 10f64.powf(random.between(-16.0, -2.0)),
                2 => -FRAC_PI_2 + 10f64.powf(random.between(-16.0, -2.0)),
                _ => 10f64.powf(random.between(-16.0, -2.0)),
            };
            // Test distances from half the radius to a hundred radii.
            let a = e.equatorial_radius();
            let altitude = match k % 3 {
                0 => random.between(-100.0, 100.0),
                1 => random.between(-0.5, 0.5) * a,
                _ => random.between(0.0, 100.0) * a,
            };
            let place = Geodetic { latitude, longitude: random.between(-PI, PI), altitude };
            let p = e.position(&place);
            let back = e.geodetic(&p).unwrap();
            let error = (e.position(&back) - p).norm() / p.norm();
            assert!(error.is_finite(), "{place:?}");
            worst = worst.max(error);
            near(back.altitude, altitude, 1e-15 * p.norm().max(1e7), "altitude");
        }
        // Measured: 4e-16 of the distance from the centre, which is 3 nm on the ground.
        assert!(worst < 1e-15, "{worst:e}");
    }
}

/// Closed forms at poles and equator, and the example of Hofmann-Wellenhof: N at latitude 0 is a,
/// at the pole a²/b.
#[test]
fn places_with_closed_forms() {
    let e = Ellipsoid::wgs84();
    let b = e.polar_radius();
    near(b, 6356752.3142, 1e-4, "b of WGS 84");
    for sign in [1.0, -1.0] {
        let pole = e.geodetic(&Vec3::new(0.0, 0.0, sign * (b + 123.0))).unwrap();
        near(pole.latitude, sign * FRAC_PI_2, 1e-16, "latitude of a pole");
        near(pole.altitude, 123.0, 1e-8, "altitude at a pole");
        assert_eq!(pole.longitude, 0.0);
        let up = Geodetic { latitude: sign * FRAC_PI_2, longitude: 0.3, altitude: 0.0 }.up();
        near3(&up, &Vec3::new(0.0, 0.0, sign), 1e-16, "up at a pole");
    }
    let west = e.geodetic(&Vec3::new(0.0, -(e.equatorial_radius() + 5.0), 0.0)).unwrap();
    near(west.longitude, -FRAC_PI_2, 0.0, "longitude");
    near(west.altitude, 5.0, 1e-8, "altitude");
    let (m, n) = e.curvature_radii(0.0);
    near(n, e.equatorial_radius(), 0.0, "N at the equator");
    near(m, b * b / e.equatorial_radius(), 1e-8, "M at the equator");
    let (m, n) = e.curvature_radii(FRAC_PI_2);
    near(m, e.equatorial_radius().powi(2) / b, 1e-8, "M at a pole");
    near(m, n, 1e-8, "M = N at a pole");
}

/// Compares 1000 positions with SOFA's own conversion, another algorithm (Fukushima 2006).
#[test]
fn sofa_agrees_about_wgs84() {
    let e = Ellipsoid::wgs84();
    let mut random = Random(2);
    for _ in 0..1000 {
        let p = random.on_sphere(10f64.powf(random.0 as f64 / u64::MAX as f64 * 1.2 + 6.81));
        let ours = e.geodetic(&p).unwrap();
        let theirs =
            sofars::coords::gc2gde(e.equatorial_radius(), e.flattening(), [p.x, p.y, p.z]).unwrap();
        let (longitude, latitude, altitude) = theirs;
        near(ours.longitude, longitude, 1e-15, "longitude");
        near(
            ours.latitude,
            latitude,
            2e-10,
            "latitude: SOFA takes one step; ours comes back to 1e-15",
        );
        near(ours.altitude, altitude, 1e-7 * (1.0 + p.norm() / 6e6), "altitude");
    }
}

#[test]
fn geodetic_and_geocentric_latitude_are_two_things() {
    let e = Ellipsoid::wgs84();
    let place = Geodetic::from_degrees(45.0, 10.0, 0.0);
    let p = e.position(&place);
    let geocentric = geocentric_latitude(&p);
    near(geocentric, e.geocentric_from_geodetic(place.latitude), 1e-15, "on the surface");
    near(e.geodetic_from_geocentric(geocentric), place.latitude, 1e-15, "and back");
    // On the Earth, the difference at 45° is 11.5′.
    near((place.latitude - geocentric).to_degrees() * 60.0, 11.545, 0.005, "difference in minutes");
}

#[test]
fn east_north_up_follows_the_ellipsoid() {
    let e = Ellipsoid::mars();
    let place = Geodetic::from_degrees(-37.0, 137.4, -4500.0);
    let R = place.east_north_up();
    let h = 1e-3;
    let step = |dlat: f64, dlon: f64, dh: f64| {
        let moved = Geodetic {
            latitude: place.latitude + dlat,
            longitude: place.longitude + dlon,
            altitude: place.altitude + dh,
        };
        e.position(&moved)
    };
    let derivative = |a: Vec3, b: Vec3| (a - b).normalize();
    near3(&(R * Vec3::x()), &derivative(step(0.0, h, 0.0), step(0.0, -h, 0.0)), 1e-9, "east");
    near3(&(R * Vec3::y()), &derivative(step(h, 0.0, 0.0), step(-h, 0.0, 0.0)), 1e-6, "north");
    near3(&(R * Vec3::z()), &derivative(step(0.0, 0.0, 1.0), step(0.0, 0.0, -1.0)), 1e-9, "up");
    near3(&(R * Vec3::z()), &place.up(), 1e-15, "up");
    let (m, n) = e.curvature_radii(place.latitude);
    let north = (step(h, 0.0, 0.0) - step(-h, 0.0, 0.0)).norm() / (2.0 * h);
    relative(north, m + place.altitude, 1e-6, "M + h");
    let east = (step(0.0, h, 0.0) - step(0.0, -h, 0.0)).norm() / (2.0 * h);
    relative(east, (n + place.altitude) * place.latitude.cos(), 1e-6, "(N + h) cos φ");
}

#[test]
fn ellipsoids_refuse() {
    let text = |r: Result<Geodetic, linkwork_world::WorldError>| r.unwrap_err().to_string();
    assert!(
        text(Ellipsoid::wgs84().geodetic(&Vec3::new(1e4, 0.0, 2e4)))
            .contains("no geodetic latitude")
    );
    assert!(
        text(Ellipsoid::wgs84().geodetic(&Vec3::zeros())).contains("help: stay at least 42841")
    );
    assert!(text(Ellipsoid::moon().geodetic(&Vec3::zeros())).contains("no geodetic latitude"));
    assert!(Ellipsoid::moon().geodetic(&Vec3::new(1.0, 0.0, 0.0)).is_ok());
    assert!(
        text(Ellipsoid::wgs84().geodetic(&Vec3::new(f64::NAN, 0.0, 7e6)))
            .contains("a coordinate, m")
    );
    assert!(Ellipsoid::new(-1.0, 0.0).unwrap_err().to_string().contains("equatorial radius"));
    assert!(Ellipsoid::new(1.0, 298.25).unwrap_err().to_string().contains("flattening"));
    assert!(Ellipsoid::new(1.0, -0.1).is_err());
}

#[test]
fn epochs_are_read_and_scales_converted() {
    let e = Epoch::parse("2007-04-05 12:00:00 UTC").unwrap();
    assert_eq!(e, Epoch::utc(2007, 4, 5, 12, 0, 0.0).unwrap());
    assert_eq!(e, Epoch::parse("2007-04-05T12:00:00").unwrap());
    near(e.tt_minus_utc(), 65.184, 1e-12, "33 leap seconds");
    let (day, fraction) = e.tt();
    assert_eq!(day, 2454195.5);
    near(fraction, 0.5007544444444444, 1e-16, "TT of the SOFA example");
    near(e.ut1(-0.072073685).1, 0.49999916581383097, 1e-16, "UT1 of the SOFA example");
    assert_eq!(Epoch::j2000().tt(), (2451544.5, 0.5));
    near(e.plus(86400.25).since(&e), 86400.25, 1e-9, "plus and since");
    let tt = Epoch::parse("2007-04-05 12:01:05.184 TT").unwrap();
    near(tt.since(&e), 0.0, 1e-9, "TT text");
    assert_eq!(e.utc_day_and_second(), (95, 43200.0));
    near(Epoch::utc(2020, 7, 2, 0, 0, 0.0).unwrap().decimal_year(), 2020.5, 1e-12, "half a year");
    assert_eq!(Epoch::utc(2012, 12, 31, 0, 0, 1.5).unwrap().utc_day_and_second(), (366, 1.5));
    assert_eq!(e.to_string(), "2007-04-05T12:00:00 UTC");
    // The interval contains the leap second 2016-12-31 23:59:60.
    let (a, b) = (Epoch::parse("2016-12-31 23:59:59 UTC"), Epoch::parse("2017-01-01 00:00:00 UTC"));
    near(b.unwrap().since(&a.unwrap()), 2.0, 1e-9, "the leap second counts");
}

#[test]
fn tdb_agrees_with_sofa() {
    for days in [-9000.0, -3.7, 100.2, 4601.0, 8000.5, 9400.3] {
        let ours = tdb_minus_tt(days / 36525.0);
        let theirs = sofars::ts::dtdb(JD_J2000, days, 0.0, 0.0, 0.0, 0.0);
        near(ours, theirs, 1e-5, "TDB − TT");
        assert!(ours.abs() > 1e-5);
    }
}

#[test]
fn wrong_epochs_are_refused() {
    for text in ["yesterday", "2012-13-06 05:17:57 UTC", "2012-02-30 00:00:00 UTC", ""] {
        let message = Epoch::parse(text).unwrap_err().to_string();
        assert!(message.contains(&format!("`{text}` is not an epoch")), "{message}");
        assert!(message.contains("help: write `2012-08-06 05:17:57 UTC`"), "{message}");
    }
    assert!(Epoch::utc(2012, 2, 30, 0, 0, 0.0).is_err());
    assert!(Epoch::utc(2012, 2, 3, 0, 0, f64::NAN).is_err());
}

/// Reference: SOFA's own example.
#[test]
fn the_earth_of_sofas_example() {
    let epoch = Epoch::parse("2007-04-05 12:00:00 UTC").unwrap();
    let p = EarthParameters::from_bulletin(
        -0.072073685,
        [0.0349282, 0.4833163],
        [0.1750, -0.2259],
        0.0,
    );
    let (tt, ut) = (epoch.tt(), epoch.ut1(p.dut1));
    let (x, y, s) = sofars::pnp::xys06a(tt.0, tt.1);
    near(x, 7.122638811749682e-4, 1e-18, "X");
    near(y, 4.438634561981791e-5, 1e-18, "Y");
    near(s, -1.0668203757686418e-8, 1e-22, "s");
    near(earth_rotation_angle(ut.0, ut.1), 0.23245155366208792, 1e-15, "ERA");
    near(sofars::erst::gmst06(ut.0, ut.1, tt.0, tt.1), 0.23407458483538107, 1e-15, "GMST06");
    let direct = gcrs_to_itrs(&epoch, &p);
    near(direct[(0, 0)], 0.973104317697536, 5e-16, "(1,1)");
    near(direct[(2, 0)], 7.115601626678917e-4, 1e-18, "(3,1)");
    let earth = Earth::new(&epoch, p, 86400.0).unwrap();
    near33(&matrix(&earth.at(0.0).R_IP.inverse()), &direct, 1e-14, "table and SOFA");
    let Some(golden) = golden() else { return };
    let cases = golden["earth_orientation"]["cases"].as_array().unwrap();
    assert_eq!(cases.len(), 2);
    for case in cases {
        let u: Vec<f64> = numbers(&case["utc"]);
        let epoch =
            Epoch::utc(u[0] as i32, u[1] as u8, u[2] as u8, u[3] as u8, u[4] as u8, u[5]).unwrap();
        let n = |key: &str| number(&case[key]);
        let full = EarthParameters::from_bulletin(
            n("dut1_s"),
            [n("xp_arcsec"), n("yp_arcsec")],
            [n("dX_arcsec") * 1e3, n("dY_arcsec") * 1e3],
            0.0,
        );
        let bare = EarthParameters { dut1: full.dut1, ..EarthParameters::default() };
        let ((t1, t2), (u1, u2)) = (epoch.tt(), epoch.ut1(full.dut1));
        let (x, y, s) = sofars::pnp::xys06a(t1, t2);
        near(x, n("X_rad"), 1e-17, "X");
        near(y, n("Y_rad"), 1e-17, "Y");
        near(s, n("s_rad"), 1e-21, "s");
        near(sofars::pnp::sp00(t1, t2), n("sprime_rad"), 1e-25, "s'");
        near(earth_rotation_angle(u1, u2), n("era_rad"), 2e-15, "ERA");
        near(sofars::erst::gmst06(u1, u2, t1, t2), n("gmst06_rad"), 2e-15, "GMST06");
        near(sofars::erst::gst06a(u1, u2, t1, t2), n("gast06a_rad"), 2e-15, "GAST06A");
        // Compare the rotation from GCRS to the intermediate system, which is Linkwork's rotation
        // without the Earth's rotation and s'.
        let s1 = n("sprime_rad");
        let own = Earth::new(&epoch, bare, 0.0).unwrap().at(0.0).R_IP;
        let back = Quat::from_scaled_axis(Vec3::z() * -(earth_rotation_angle(u1, u2) + s1));
        let celestial = matrix(&(own * back).inverse());
        near33(&celestial, &mat3(&case["nutation_bpn_matrix_c2i"]), 5e-16, "Q");
        for (p, key) in [(full, "gcrs_to_itrs_full"), (bare, "gcrs_to_itrs_no_eop_c2t06a")] {
            let golden = mat3(&case[key]);
            near33(&gcrs_to_itrs(&epoch, &p), &golden, 2e-15, key);
            let earth = Earth::new(&epoch, p, 0.0).unwrap();
            near33(&matrix(&earth.at(0.0).R_IP.inverse()), &golden, 2e-15, key);
        }
    }
}

/// Between the entries of its table, at its ends, before and after it.
#[test]
fn the_table_of_the_earth_is_as_good_as_its_series() {
    let epoch = Epoch::parse("2012-08-06 05:17:57 UTC").unwrap();
    let p = EarthParameters::from_bulletin(0.4078, [0.138, 0.357], [0.1, -0.2], 0.0);
    let earth = Earth::new(&epoch, p, 3.0 * 86400.0).unwrap();
    for t in [-1e5, -3.0, 0.0, 1.0, 10799.9, 21600.0, 98765.4, 259200.0, 270000.0, 1e6] {
        let now = epoch.plus(t);
        let spin = earth.at(t);
        near33(&matrix(&spin.R_IP.inverse()), &gcrs_to_itrs(&now, &p), 1e-13, &format!("t = {t}"));
    }
}

/// IERS, finals2000A.all: 2008-12-28 to 2009-01-06, with the leap second of New Year.
pub const FINALS: &str = "\
\x2081228 54828.00 I -0.001065 0.000020  0.141752 0.000036  I-0.5903208 0.0000044  0.2999 0.0065  I    -0.370    0.095    -0.225    0.340  -.001040   .141780  -.5903140    -0.397    -0.222  
 81229 54829.00 I -0.005290 0.000037  0.143089 0.000036  I-0.5906704 0.0000046  0.4023 0.0032  I    -0.359    0.100    -0.213    0.236  -.005310   .143150  -.5906630    -0.315    -0.302  
 81230 54830.00 I -0.009667 0.000036  0.144216 0.000035  I-0.5911538 0.0000046  0.5899 0.0031  I    -0.353    0.100    -0.215    0.236  -.009630   .144190  -.5911480    -0.190    -0.307  
 81231 54831.00 I -0.013383 0.000036  0.145068 0.000033  I-0.5918732 0.0000043  0.8465 0.0031  I    -0.356    0.100    -0.216    0.236  -.013450   .145110  -.5918660    -0.168    -0.358  
 9 1 1 54832.00 I -0.017042 0.000036  0.146216 0.000033  I 0.4071598 0.0000042  1.0833 0.0029  I    -0.366    0.100    -0.199    0.236  -.017020   .146240   .4071580    -0.122    -0.334  
 9 1 2 54833.00 I -0.020395 0.000036  0.147540 0.000033  I 0.4059799 0.0000039  1.2609 0.0045  I    -0.385    0.100    -0.174    0.236  -.020430   .147560   .4059740    -0.134    -0.313  
 9 1 3 54834.00 I -0.023225 0.000035  0.149037 0.000019  I 0.4046740 0.0000080  1.3306 0.0028  I    -0.377    0.103    -0.143    0.269  -.023270   .149070   .4046730    -0.114    -0.259  
";

/// IERS, finals2000A.all: 2006-01-22 to 24.
const OF_2006: &str = "\
\x206 122 53757.00 I  0.050108 0.000051  0.381596 0.000056  I 0.3311881 0.0000037  0.6832 0.0027  I     0.059    0.100    -0.392    0.184   .050170   .381260   .3311800     0.146    -0.383  
 6 123 53758.00 I  0.050171 0.000051  0.381097 0.000058  I 0.3305383 0.0000033  0.6020 0.0031  I     0.054    0.091    -0.420    0.180   .050240   .380720   .3305400     0.211    -0.325  
 6 124 53759.00 I  0.050324 0.000055  0.380681 0.000065  I 0.3299876 0.0000050  0.5104 0.0024  I     0.073    0.056    -0.419    0.183   .050300   .380240   .3299810     0.185    -0.282  
";

/// CelesTrak, EOP-All.csv: the same days.
pub const CELESTRAK: &str = "\
DATE,MJD,X,Y,UT1-UTC,LOD,DPSI,DEPS,DX,DY,DAT,DATA_TYPE
2006-01-22,53757,0.050100,0.381623,0.3312267,0.0006738,-0.055919,-0.001260,0.000012,-0.000103,33,O
2006-01-23,53758,0.050154,0.381123,0.3305735,0.0006236,-0.056308,-0.001684,0.000043,-0.000169,33,O
2006-01-24,53759,0.050234,0.380619,0.3299960,0.0005197,-0.056532,-0.002140,0.000086,-0.000282,33,O
";

/// Numbers of the second day above in the columns of EOP 20 C04.
pub const C04: &str = "\
# EARTH ORIENTATION PARAMETER (EOP) PRODUCT CENTER CENTER (PARIS OBSERVATORY)
# EOP (IERS) 20 C04 TIME SERIES  consistent with ITRF 2020 - sampled at 0h UTC
# YR  MM  DD  HH       MJD        x(\")        y(\")  UT1-UTC(s)       dX(\")      dY(\")       xrt(\")      yrt(\")      LOD(s)
2006   1  22   0  53757.00    0.050100    0.381623   0.3312267    0.000012   -0.000103    0.000000    0.000000   0.0006738
2006   1  23   0  53758.00    0.050154    0.381123   0.3305735    0.000043   -0.000169    0.000000    0.000000   0.0006236
";

const ARCSEC: f64 = TAU / 1_296_000.0;

#[test]
fn a_leap_second_is_a_second() {
    let before = Epoch::parse("2008-12-31 23:59:50 UTC").unwrap();
    let after = Epoch::parse("2009-01-01 00:00:10 UTC").unwrap();
    assert_eq!(after.since(&before), 21.0);
    assert_eq!(before.plus(21.0), after);
    // The leap second itself is the last second of the old year.
    for (t, leap) in [(-40.0, 33.0), (0.0, 33.0), (10.9, 33.0), (11.0, 34.0), (50.0, 34.0)] {
        assert_eq!(before.plus(t).tt_minus_utc(), leap + 32.184, "{t}");
    }
    assert_eq!(
        (before.plus(21.0).tt(), before.plus(21.0).tdb_days()),
        (after.tt(), after.tdb_days())
    );
}

/// TAI − UTC of ERFA 2.0.1 (`dat`). Public report: layup #138. hifitime alone takes UTC for TAI before 1972, which is 7.6 s in July 1969.
#[test]
fn utc_before_1972_has_its_drift() {
    for (text, offset) in [
        ("1961-06-01 00:00:00 UTC", 1.618514),
        ("1965-03-02 12:00:00 UTC", 3.718538),
        ("1969-07-20 20:17:40 UTC", 7.574_593_8),
        ("1971-12-31 23:59:59 UTC", 9.892_241_97),
        ("1972-01-01 00:00:00 UTC", 10.0),
        ("1972-07-01 00:00:00 UTC", 11.0),
    ] {
        let e = Epoch::parse(text).unwrap();
        near(e.tt_minus_utc(), offset + 32.184, 1e-7, text);
        let tai = Epoch::parse(&text.replace("UTC", "TAI")).unwrap();
        near(e.since(&tai), offset, 1e-7, text);
        let shown = e.to_string();
        assert!(shown.starts_with(&text[..19].replace(' ', "T")), "{shown} {text}");
        let again = Epoch::parse(&tai.plus(offset).to_string()).unwrap();
        near(again.since(&e), 0.0, 1e-8, text);
    }
    let landing = Epoch::utc(1969, 7, 20, 20, 17, 40.0).unwrap();
    assert_eq!(landing, Epoch::parse("1969-07-20 20:17:40 UTC").unwrap());
    // UT1 = UTC + ΔUT1.
    near(landing.ut1(0.0).1, (20.0 * 3600.0 + 17.0 * 60.0 + 40.0) / 86400.0, 1e-12, "UT1");
    near(landing.utc_day_and_second().1, 73060.0, 1e-8, "second");
    let early = Epoch::parse("1957-10-04 19:28:34 UTC").unwrap_err().to_string();
    assert!(early.contains("UTC begins in 1960") && early.contains("TT or TAI"), "{early}");
    assert!(Epoch::parse("1957-10-04 19:29:06 TT").is_ok());
}

/// IERS Bulletin C 52: 2016-12-31 23:59:60 UTC is the second between 23:59:59 and midnight.
#[test]
fn a_leap_second_can_be_written() {
    let at = |text: &str| Epoch::parse(text).unwrap();
    let midnight = at("2017-01-01 00:00:00 UTC");
    for text in ["2016-12-31 23:59:60 UTC", "2016-12-31T23:59:60", "2017-01-01 00:00:36 TAI"] {
        assert_eq!(midnight.since(&at(text)), 1.0, "{text}");
        assert_eq!(at(text).tt_minus_utc(), 68.184, "{text}");
    }
    assert_eq!(midnight.since(&at("2016-12-31 23:59:60.25 UTC")), 0.75);
    assert_eq!(midnight.since(&Epoch::utc(2016, 12, 31, 23, 59, 60.25).unwrap()), 0.75);
    for text in [
        "2016-12-30 23:59:60 UTC",
        "2016-12-31 22:59:60 UTC",
        "2016-12-31 23:59:60 TT",
        "2023-12-31 23:59:60 UTC",
    ] {
        let message = Epoch::parse(text).unwrap_err().to_string();
        assert!(message.contains(text) && message.contains("leap second"), "{message}");
    }
    assert!(Epoch::utc(2023, 12, 31, 23, 59, 60.0).is_err());
}

#[test]
fn tables_of_the_earths_orientation_are_read() {
    let table = EarthOrientation::read("finals2000A.all", FINALS).unwrap();
    let [first, last] = table.span();
    assert_eq!(
        (first.to_string(), last.since(&first)),
        ("2008-12-28T00:00:00 UTC".into(), 6.0 * 86400.0 + 1.0)
    );
    // The table uses Bulletin B where it is available.
    let p = table.at(&Epoch::utc(2009, 1, 1, 0, 0, 0.0).unwrap());
    near(p.dut1, 0.407158, 1e-12, "UT1 − UTC after the leap second");
    near(p.pole[0] / ARCSEC, -0.01702, 1e-12, "x");
    near(p.pole[1] / ARCSEC, 0.14624, 1e-12, "y");
    near(p.celestial_pole_offsets[0] / ARCSEC, -0.122e-3, 1e-15, "dX");
    near(p.celestial_pole_offsets[1] / ARCSEC, -0.334e-3, 1e-15, "dY");
    // The excess length of day agrees with the IERS, 0.85 to 1.1 ms.
    near(p.excess_of_day, 1.08e-3, 0.1e-3, "excess of the day");
    let p = table.at(&Epoch::utc(2008, 12, 31, 23, 59, 59.0).unwrap());
    near(p.dut1, -0.59284, 5e-6, "UT1 − UTC before the leap second");
    // Bulletin A is used where bulletin B lacks values.
    let a: String = FINALS.lines().map(|l| format!("{}\n", l[..134].trim_end())).collect();
    let p =
        EarthOrientation::read("a", &a).unwrap().at(&Epoch::utc(2009, 1, 1, 0, 0, 0.0).unwrap());
    near(p.dut1, 0.4071598, 1e-12, "bulletin A");
    near(p.celestial_pole_offsets[1] / ARCSEC, -0.199e-3, 1e-15, "dY of bulletin A");
    // A prediction without dX and dY keeps the last values; the table ends at days without numbers.
    let blank = format!("{}\n", &FINALS.lines().last().unwrap()[..95])
        .replace("9 1 3 54834", "9 1 4 54835");
    let open = format!("{FINALS}{blank} 9 1 5 54836.00\n 9 1 6 54837.00\n");
    let table = EarthOrientation::read("open", &open).unwrap();
    assert_eq!(table.span()[1].since(&first), 7.0 * 86400.0 + 1.0);
    let p = table.at(&table.span()[1]);
    near(p.celestial_pole_offsets[0] / ARCSEC, -0.114e-3, 1e-15, "dX kept");

    let day = Epoch::utc(2006, 1, 23, 0, 0, 0.0).unwrap();
    let [iers, theirs, c04] = [OF_2006, CELESTRAK, C04]
        .map(|text| EarthOrientation::read("2006", text).unwrap().at(&day));
    assert_eq!(theirs.pole, c04.pole);
    assert_eq!(
        (theirs.dut1, theirs.celestial_pole_offsets),
        (c04.dut1, c04.celestial_pole_offsets)
    );
    near(theirs.dut1, iers.dut1, 5e-5, "UT1 − UTC of two series");
    for k in 0..2 {
        near(theirs.pole[k] / ARCSEC, iers.pole[k] / ARCSEC, 5e-4, "pole of two series");
        let [a, b] = [theirs, iers].map(|p| p.celestial_pole_offsets[k] / ARCSEC);
        near(a, b, 5e-4, "celestial pole of two series");
    }
}

/// Across a leap second, between midnights and at them.
#[test]
fn the_earth_follows_its_table() {
    let table = EarthOrientation::read("finals2000A.all", FINALS).unwrap();
    let epoch = Epoch::parse("2008-12-29 15:00:00 UTC").unwrap();
    let earth = Earth::by_day(&epoch, &table, 4.0 * 86400.0).unwrap();
    for t in [0.0, 1.0, 32400.0, 205199.5, 205200.5, 205201.5, 250000.0, 345600.0] {
        let now = epoch.plus(t);
        let golden = gcrs_to_itrs(&now, &table.at(&now));
        near33(&matrix(&earth.at(t).R_IP.inverse()), &golden, 1e-13, &format!("t = {t}"));
        let h = 20.0;
        let rate = (matrix(&earth.at(t + h).R_IP) - matrix(&earth.at(t - h).R_IP)) / (2.0 * h);
        let spin = earth.at(t);
        let by_omega = spin.omega_I.cross_matrix() * matrix(&spin.R_IP);
        let w = spin.omega_I.norm();
        near33(&rate, &by_omega, w * w * w * h * h / 5.0 + 3e-17, "Ṙ = ω × R");
        // The planet's own pole is a third of an arc second from the rotation axis, so the daily motion of the axis in
        // the Earth is visible here (1e-13 rad/s).
        let pole = |t: f64| earth.at(t).R_IP * Vec3::z();
        let rate = (pole(t + h) - pole(t - h)) / (2.0 * h);
        near3(&spin.omega_I.cross(&pole(t)), &rate, 2e-15, "ṗ = ω × p");
    }
    // Parameters of the first day deviate by the change of UT1 and of the pole in the meantime: 3 ms are
    // 1.4 m.
    let still = Earth::new(&epoch, table.at(&epoch), 4.0 * 86400.0).unwrap();
    let off = earth.at(345600.0).R_IP.angle_to(&still.at(345600.0).R_IP) * 6.378e6;
    assert!((0.05..3.0).contains(&off), "{off} m");
}

#[test]
fn tables_that_do_not_fit_are_refused() {
    let refused = |text: &str, fact: &str| {
        let said = EarthOrientation::read("eop.txt", text).unwrap_err().to_string();
        assert!(
            said.contains("eop.txt:") && said.contains(fact) && said.contains("help: "),
            "{said}"
        );
    };
    refused("", "not a supported format of Earth orientation tables");
    refused(
        "1962 1 1 37665 -0.0127 0.2130 0.0326338\n",
        "not a supported format of Earth orientation tables",
    );
    refused(&FINALS.replace(" .4071580", "  .407x80"), "eop.txt:5: UT1 − UTC, s, is `.407x80`");
    refused(
        &FINALS.replace("54832.00", "54833.00"),
        "2009-01-02T00:00:00 UTC comes after 2008-12-31",
    );
    refused(FINALS.lines().next().unwrap(), "fewer than two days");
    refused(&CELESTRAK.replace(",DX,", ",DZ,"), "no column `DX`");
    refused(&CELESTRAK.replace("0.381123", "381.123"), "eop.txt:3: y of the pole, ″, is `381.123`");
    refused(&C04.replace("53758.00", "53757.50"), "not midnight");
    let table = EarthOrientation::read("finals2000A.all", FINALS).unwrap();
    for (epoch, span) in [("2008-12-27 00:00:00 UTC", 0.0), ("2008-12-29 00:00:00 UTC", 1e6)] {
        let said =
            Earth::by_day(&Epoch::parse(epoch).unwrap(), &table, span).unwrap_err().to_string();
        assert!(said.contains("covers 2008-12-28") && said.contains("help: "), "{said}");
    }
}

/// Ṙ = ω × R by central differences, for each kind.
#[test]
fn angular_velocity_is_the_rate_of_the_rotation() {
    let epoch = Epoch::parse("2012-08-06 05:17:57 UTC").unwrap();
    let tilted = FixedRate { R_I0: Quat::from_euler_angles(0.3, -0.2, 0.9), rate: 7.08822e-5 };
    let p = EarthParameters { excess_of_day: 0.002, ..EarthParameters::default() };
    let kinds = [
        Rotation::Fixed(tilted),
        Rotation::mars(&epoch),
        Rotation::moon(&epoch),
        Rotation::Earth(Box::new(Earth::new(&epoch, p, 1e5).unwrap())),
    ];
    for rotation in &kinds {
        for t in [0.0, 1234.5, 80000.0] {
            let h = 20.0;
            let rate =
                (matrix(&rotation.at(t + h).R_IP) - matrix(&rotation.at(t - h).R_IP)) / (2.0 * h);
            let spin = rotation.at(t);
            let by_omega = spin.omega_I.cross_matrix() * matrix(&spin.R_IP);
            // The error of the difference is the third derivative: ω³ h²/6 = 2e-11 for the Earth.
            let w = spin.omega_I.norm();
            near33(&rate, &by_omega, w * w * w * h * h / 5.0 + 3e-17, "Ṙ = ω × R");
            near3(
                &spin.omega_P(),
                &(spin.R_IP.inverse() * spin.omega_I),
                0.0,
                "axes of the planet",
            );
        }
    }
    // The pole's own motion by precession and nutation is some 1e-12 rad/s, so it is checked separately
    // over hours.
    let pole = |t: f64| kinds[3].at(t).R_IP * Vec3::z();
    for t in [7e3, 4e4] {
        let omega = kinds[3].at(t).omega_I;
        let rate = (pole(t + 7200.0) - pole(t - 7200.0)) / 14400.0;
        assert!((1e-13..1e-11).contains(&rate.norm()), "{:e}", rate.norm());
        near3(&omega.cross(&pole(t)), &rate, 1e-15, "ṗ = ω × p");
    }
}

#[test]
fn the_earth_turns_once_in_a_sidereal_day() {
    let epoch = Epoch::j2000();
    let p = EarthParameters::default();
    let earth = Earth::new(&epoch, p, 1e5).unwrap();
    // ω agrees with 7.292115e-5 rad/s to all its digits. With a longer day the Earth rotates more
    // slowly.
    near(earth.at(0.0).omega_I.norm(), 7.292115e-5, 5e-12, "ω");
    let long = EarthParameters { excess_of_day: 0.003, ..p };
    let slow = Earth::new(&epoch, long, 1e5).unwrap().at(0.0).omega_I.norm();
    relative(earth.at(0.0).omega_I.norm() - slow, 7.292115e-5 * 0.003 / 86400.0, 1e-3, "ω");
}

/// Reference: d = 4601.2211458333, Mars row 1; both planets at two dates in quick_golden.json.
#[test]
fn mars_and_the_moon_of_the_iau() {
    let d = 4601.2211458333;
    let R = matrix(&IauRotation::mars((d, 0.0)).at(0.0).R_IP.inverse());
    let row = Vec3::new(-0.7706060457790, 0.2786166465923, 0.5731832921942);
    // For an angle of 1.6e6 degrees, the last binary digit is 4e-12 rad. A computation with forty digits gives
    // (−0.77060604577956, 0.27861664659130, 0.57318329219388). The golden row has an error of 1.1e-12, and Linkwork's
    // row has 2.6e-12.
    near3(&R.row(0).transpose(), &row, 4e-12, "Mars, row 1");
    let exact = Vec3::new(-0.77060604577956, 0.2786166465912998, 0.5731832921938752);
    near3(&R.row(0).transpose(), &exact, 3e-12, "Mars, row 1, exact");
    let Some(golden) = golden() else { return };
    let cases = golden["planet_rotation"]["cases"].as_array().unwrap();
    assert_eq!(cases.len(), 2);
    for case in cases {
        let d = number(&case["tdb_days_past_J2000"]);
        for (spin, key) in [
            (IauRotation::mars((d, 0.0)).at(0.0), "icrf_to_iau_mars"),
            (IauRotation::moon((d, 0.0)).at(0.0), "icrf_to_iau_moon"),
        ] {
            // The angles are many revolutions in degrees, which causes a round-off of 3e-12 on both
            // sides.
            near33(&matrix(&spin.R_IP.inverse()), &mat3(&case[key]), 8e-12, key);
        }
        // The result must be equal with an epoch that is two thousand days earlier, and a later
        // time.
        for (a, b) in [
            (
                IauRotation::moon((d, 0.0)).at(0.0),
                IauRotation::moon((d - 2000.0, 0.0)).at(2000.0 * 86400.0),
            ),
            (
                IauRotation::mars((d, 0.0)).at(0.0),
                IauRotation::mars((d - 2000.0, 0.0)).at(2000.0 * 86400.0),
            ),
        ] {
            near33(&matrix(&a.R_IP), &matrix(&b.R_IP), 1e-9, "epoch and time");
            near3(&a.omega_I, &b.omega_I, 1e-16, "ω");
        }
    }
}

#[test]
fn wrong_rotations_are_refused() {
    let epoch = Epoch::j2000();
    let fault = |p: EarthParameters, d: f64| Earth::new(&epoch, p, d).unwrap_err().to_string();
    let p = EarthParameters::default();
    assert!(fault(EarthParameters { dut1: 32.0, ..p }, 1.0).contains("dut1"));
    assert!(fault(EarthParameters { pole: [0.3, 0.1], ..p }, 1.0).contains("radians"));
    assert!(fault(EarthParameters { excess_of_day: 1.0, ..p }, 1.0).contains("excess_of_day"));
    assert!(fault(p, -1.0).contains("duration"));
    assert!(fault(p, f64::NAN).contains("duration"));
    assert!(FixedRate::about_z(0.0, f64::INFINITY).unwrap_err().to_string().contains("rate"));
    near(Rotation::none().at(1e9).R_IP.angle(), 0.0, 0.0, "no rotation");
    let turned = Rotation::Fixed(FixedRate::about_z(1.1, TAU / 86400.0).unwrap());
    near(turned.at(21600.0).R_IP.angle(), 1.1 + FRAC_PI_2, 1e-15, "angle");
}
