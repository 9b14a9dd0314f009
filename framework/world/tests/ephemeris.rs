//! Sun, Moon, planets: golden numbers, DE440, velocities, kernels.

use crate::kernel::Segment;
use crate::support::*;
use linkwork_world::ephemeris::*;
use linkwork_world::planet::{AU, Epoch, PointMotion};
use linkwork_world::spatial::Vec3;

const ARCSEC: f64 = std::f64::consts::PI / 648_000.0;

fn arcsec(a: &Vec3, b: &Vec3) -> f64 {
    a.cross(b).norm().atan2(a.dot(b)) / ARCSEC
}

/// Reference: DE440 at d = 4601.2211458333.
#[test]
fn errors_against_de440_are_as_told() {
    let d = (4601.2211458333, 0.0);
    let sun_de = Vec3::new(-106257021673.37, 99355478794.15, 43072878812.34);
    let moon_de = Vec3::new(388253608.336, 54719243.156, 53485455.283);
    let (s, m) = (sun(d).unwrap().position, moon(d).position);
    assert!((2e3..8.3e3).contains(&(s - sun_de).norm()), "{}", (s - sun_de).norm());
    assert!((2e3..7e3).contains(&(m - moon_de).norm()), "{}", (m - moon_de).norm());
    assert!((9.0..20.0).contains(&arcsec(&sun_low(d), &sun_de)));
    assert!((15.0..75.0).contains(&arcsec(&moon_low(d), &moon_de)));
}

/// Returns λ = 282.9400° + M + 6892″ sin M + 72″ sin 2M, M = 357.5256° + 35999.049° T, in the equator of J2000, m.
fn printed_sun(days: f64) -> Vec3 {
    let T = days / 36525.0;
    let M = (357.5256 + 35999.049 * T).to_radians();
    let longitude =
        282.94f64.to_radians() + M + ARCSEC * (6892.0 * M.sin() + 72.0 * (2.0 * M).sin());
    let r = (149.619 - 2.499 * M.cos() - 0.021 * (2.0 * M).cos()) * 1e9;
    let (tilt, (s, c)) = (23.43929111f64.to_radians(), longitude.sin_cos());
    Vec3::new(c, s * tilt.cos(), s * tilt.sin()) * r
}

/// quick_golden.json, ephemeris: results of the same models in other programs, and DE440.
#[test]
fn golden_positions() {
    let Some(golden) = golden() else { return };
    let cases = golden["ephemeris"]["cases"].as_array().unwrap();
    assert_eq!(cases.len(), 2);
    for case in cases {
        let n = |key: &str| number(&case[key]);
        let d = (n("tdb_days_past_J2000"), 0.0);
        let s = sun(d).unwrap();
        // The reference adds days to a Julian date in one number, which changes the time by some
        // microseconds.
        near3(&s.position, &vec3(&case["erfa_epv00_sun_wrt_earth_m"]), 1.0, "epv00");
        let m = moon(d);
        near3(&m.position, &vec3(&case["erfa_moon98_m"]), 0.02, "moon98");
        let de = vec3(&case["de440_sun_wrt_earth_m"]);
        near((s.position - de).norm(), n("erfa_epv00_error_m"), 1.0, "epv00 and DE440");
        let moon_de = vec3(&case["de440_moon_wrt_earth_m"]);
        near((m.position - moon_de).norm(), n("erfa_moon98_error_m"), 0.02, "moon98 and DE440");
        // The formula of Montenbruck and Gill as it is printed leaves out the motion of the perihelion, 0.3225°
        // T, which Linkwork includes.
        let printed = printed_sun(d.0);
        near3(&printed, &vec3(&case["low_sun_m"]), 1.0, "the Sun as printed");
        near(arcsec(&printed, &de), n("low_sun_error_arcsec"), 1e-4, "the Sun as printed, error");
        near(
            arcsec(&moon_low(d), &moon_de),
            n("low_moon_error_arcsec"),
            1e-4,
            "the Moon of a short series",
        );
        let far = moon_low(d).norm() - moon_de.norm();
        near(far.abs(), n("low_moon_dist_error_m"), 1.0, "its distance");
        near(
            arcsec(&sun_low(d), &de),
            n("low_sun_with_perihelion_motion_error_arcsec"),
            1e-4,
            "the Sun of a short series",
        );
        relative(sun_low(d).norm() / de.norm() - 1.0, n("low_sun_dist_rel"), 1e-6, "its distance");
        near3(&moon_low(d), &vec3(&case["low_moon_m"]), 1.0, "the Moon of a short series");
        let mars = planet(Body::Mars, d).unwrap().position;
        near3(&mars, &vec3(&case["kepler_mars_wrt_sun_m"]), 0.01, "Mars on an ellipse");
        let de = vec3(&case["de440_mars_bary_wrt_sun_m"]);
        near(arcsec(&mars, &de), n("kepler_mars_error_arcsec"), 0.01, "Mars and DE440");
        let state = Analytic.state(Body::Mars, Body::Sun, d).unwrap();
        near3(&state.position, &mars, 0.0, "the same through the door");
    }
}

/// SOFA's `plan94`, another theory, for the planets without golden numbers: both have errors of some 10″ to 100″, and Saturn on an ellipse 600″.
#[test]
fn ellipses_agree_with_plan94() {
    for (k, body, tolerance) in [
        (1, Body::Mercury, 40.0),
        (2, Body::Venus, 40.0),
        (4, Body::Mars, 80.0),
        (5, Body::Jupiter, 500.0),
        (6, Body::Saturn, 700.0),
        (7, Body::Uranus, 200.0),
        (8, Body::Neptune, 80.0),
    ] {
        for d in [-9000.0, -1234.5, 0.0, 4601.2, 8000.5] {
            let ours = planet(body, (d, 0.0)).unwrap();
            let (pv, _) = sofars::eph::plan94(2451545.0, d, k).unwrap();
            let theirs = Vec3::from(pv[0]) * AU;
            let angle = arcsec(&ours.position, &theirs);
            assert!(angle < tolerance, "{body:?} at {d}: {angle}″");
            relative(ours.position.norm(), theirs.norm(), 6e-3, &format!("{body:?} distance"));
            let v = Vec3::from(pv[1]) * (AU / 86400.0);
            let dv = (ours.velocity - v).norm() / v.norm();
            assert!(dv < 5e-3, "{body:?} at {d}: velocity {dv:e}");
        }
    }
}

#[test]
fn velocities_are_rates_of_positions() {
    let bodies = [
        (Body::Sun, Body::Earth, 1e-7),
        // The velocity of `moon98` neglects precession, which is 3 mm/s.
        (Body::Moon, Body::Earth, 4e-6),
        (Body::Moon, Body::Sun, 1e-6),
        (Body::Mars, Body::Earth, 3e-4),
        (Body::Jupiter, Body::Sun, 6e-4),
    ];
    for (target, origin, tolerance) in bodies {
        let at = |t: f64| Analytic.state(target, origin, (4601.0, 0.25 + t / 86400.0)).unwrap();
        let h = 500.0;
        let rate = (at(h).position - at(-h).position) / (2.0 * h);
        let v = at(0.0).velocity;
        near3(&rate, &v, tolerance * v.norm(), &format!("{target:?} from {origin:?}"));
    }
}

#[test]
fn the_way_back_is_minus_the_way() {
    let d = (4601.0, 0.25);
    let pairs = [(Body::Earth, Body::Moon), (Body::Mars, Body::Earth), (Body::Venus, Body::Sun)];
    for (a, b) in pairs {
        let (x, y) = (Analytic.state(a, b, d).unwrap(), Analytic.state(b, a, d).unwrap());
        near3(&x.position, &-y.position, 0.0, "position");
        near3(&x.velocity, &-y.velocity, 0.0, "velocity");
    }
    assert!(planet(Body::Moon, d).unwrap_err().to_string().contains("use `earth`, `moon`"));
    let late = earth((40_000.0, 0.0)).unwrap_err().to_string();
    assert!(late.contains("1900 to 2100"), "{late}");
    assert!(Analytic.state(Body::Mars, Body::Earth, (f64::NAN, 0.0)).is_err());
}

/// Compares with its source, within its intervals, at their boundaries, at both ends.
#[test]
fn a_sampled_ephemeris_is_its_source() {
    let epoch = Epoch::parse("2012-08-06 05:17:57 UTC").unwrap();
    let tdb = epoch.tdb_days();
    for (target, origin, tolerance) in [
        (Body::Moon, Body::Earth, 1e-3),
        (Body::Sun, Body::Earth, 0.02),
        (Body::Mars, Body::Earth, 0.05),
    ] {
        let sampled = Sampled::new(&Analytic, target, origin, &epoch, 2e6).unwrap();
        for t in [0.0, 1.0, 43_200.0, 86_400.0, 345_600.0, 777_777.7, 1.9e6, 2e6] {
            let now = (tdb.0, tdb.1 + t / 86_400.0);
            let source = Analytic.state(target, origin, now).unwrap();
            let out = sampled.at(t).unwrap();
            near3(&out.position, &source.position, tolerance, &format!("{target:?} at {t}"));
            let h = 100.0;
            let at = |t: f64| sampled.at(t.clamp(0.0, 2e6)).unwrap().position;
            if t > h && t + h < 2e6 {
                let rate = (at(t + h) - at(t - h)) / (2.0 * h);
                near3(&out.velocity, &rate, 2e-4, "velocity");
            }
        }
        for t in [-2.0, 2e6 + 2.0, f64::NAN] {
            let message = sampled.at(t).unwrap_err().to_string();
            assert!(message.contains("sample the ephemeris over the whole"), "{message}");
        }
    }
    assert!(Sampled::new(&Analytic, Body::Sun, Body::Earth, &epoch, 0.0).is_err());
    assert!(Sampled::new(&Analytic, Body::Sun, Body::Earth, &epoch.plus(3.1e9), 1e5).is_err());
}

type Path = fn(f64) -> PointMotion;

/// A kernel of segments (target, centre, type, motion) over the same time.
fn kernel(
    segments: &[(i32, i32, i32, Path)],
    start: f64,
    days: f64,
    count: usize,
    big: bool,
) -> Vec<u8> {
    let paths: Vec<_> = (segments.iter())
        .map(|(.., path)| {
            move |t: f64| {
                let m = path(t);
                [m.position.into(), m.velocity.into()]
            }
        })
        .collect();
    let all: Vec<Segment<'_>> = (segments.iter().zip(&paths))
        .map(|(&(target, centre, kind, _), path)| Segment {
            target,
            centre,
            kind,
            start,
            days,
            count,
            path,
        })
        .collect();
    crate::kernel::kernel(&all, big)
}

fn moon_at(et: f64) -> PointMotion {
    moon((0.0, et / 86400.0))
}

fn earth_at(et: f64) -> PointMotion {
    earth((0.0, et / 86400.0)).unwrap()
}

/// The Earth, opposite to the Moon at 1.2 % of its distance from the barycentre: artificial, to have a tree.
fn earth_of_barycentre(et: f64) -> PointMotion {
    let m = moon_at(et);
    PointMotion { position: m.position * -0.012, velocity: m.velocity * -0.012 }
}

#[test]
fn kernels_are_read_in_both_byte_orders_and_types() {
    let start = 3.9e8;
    let list: [(i32, i32, i32, Path); 4] = [
        (10, 0, 2, |_| PointMotion {
            position: Vec3::new(1e9, -2e8, 3e7),
            velocity: Vec3::zeros(),
        }),
        (3, 0, 2, earth_at),
        (399, 3, 3, earth_of_barycentre),
        (301, 3, 2, moon_at),
    ];
    for big in [false, true] {
        let spk = Spk::parse("made.bsp", &kernel(&list, start, 4.0, 5, big)).unwrap();
        assert_eq!(spk.segments().len(), 4);
        for t in [0.0, 1.0, 345_600.0, 1e6, 1_727_999.0, 1_728_000.0] {
            let et = start + t;
            let (m, e) = (moon_at(et), earth_of_barycentre(et));
            let days = (0.0, et / 86400.0);
            let out = spk.state(Body::Moon, Body::Earth, days).unwrap();
            near3(&out.position, &(m.position - e.position), 2e-2, "Moon from Earth");
            near3(&out.velocity, &(m.velocity - e.velocity), 4e-3, "its velocity");
            let out = spk.between(399, 10, et).unwrap();
            let sun = Vec3::new(1e9, -2e8, 3e7);
            near3(
                &out.position,
                &(earth_at(et).position + e.position - sun),
                0.2,
                "Earth from Sun",
            );
            near3(&out.velocity, &(earth_at(et).velocity + e.velocity), 1e-4, "its velocity");
            let back = spk.between(10, 399, et).unwrap();
            near3(&back.position, &-out.position, 0.0, "and back");
            near3(&spk.between(3, 399, et).unwrap().position, &-e.position, 1e-3, "up");
            assert_eq!(spk.between(399, 399, et).unwrap().position, Vec3::zeros());
        }
        let e = |target, origin, et| spk.between(target, origin, et).unwrap_err().to_string();
        let late = e(399, 10, start - 1.0);
        assert!(late.contains("does not connect bodies 399 and 10 at 2012-05-11T"), "{late}");
        assert!(late.contains("from 2012-05-11T") && late.contains(" to 2012-05-31T"), "{late}");
        for (target, origin) in [(499, 10), (10, 499)] {
            let e = e(target, origin, start);
            assert!(
                e.contains("no body 499; it has 0, 3, 10, 301, 399") && e.contains("help"),
                "{e}"
            );
        }
    }
}

#[test]
fn damaged_kernels_are_refused() {
    let list: [(i32, i32, i32, Path); 1] = [(301, 3, 2, moon_at)];
    let good = kernel(&list, 3.9e8, 4.0, 2, false);
    let fault = |data: &[u8]| Spk::parse("moon.bsp", data).unwrap_err().to_string();
    assert!(fault(b"GIF89a").contains("moon.bsp:0: it does not begin with `DAF/SPK`"));
    assert!(fault(&good[..2000]).contains("it ends before byte"));
    assert!(fault(&good[..good.len() - 8]).contains("it ends before byte"));
    let with = |at: usize, bytes: &[u8]| {
        let mut data = good.clone();
        data[at..at + bytes.len()].copy_from_slice(bytes);
        data
    };
    assert!(fault(&with(88, b"VAX-GFLT")).contains("neither LTL-IEEE nor BIG-IEEE"));
    assert!(fault(&with(8, &5i32.to_le_bytes())).contains("ND, NI are not 2, 6"));
    let told = fault(&with(1024 + 24 + 28, &10i32.to_le_bytes()));
    assert!(
        told.contains("no segment of a supported type; it has body 301 with type 10 in axes 1"),
        "{told}"
    );
    assert!(
        fault(&with(1024 + 24 + 24, &17i32.to_le_bytes()))
            .contains("no segment of a supported type")
    );
    assert!(fault(&with(1024 + 24 + 32, &(-7i32).to_le_bytes())).contains("an address is -7"));
    let count = good.len() - 8;
    assert!(fault(&with(count, &3f64.to_le_bytes())).contains("do not match its length"));
    // Truncated or modified files must not cause a panic.
    let mut random = Random(3);
    for _ in 0..2000 {
        let mut data = good.clone();
        let at = (random.next() as usize) % 1200;
        data[at] = random.next() as u8;
        let _ = Spk::parse("bent.bsp", &data);
    }
}

/// Consecutive pieces form one interval; a gap ends it. A cycle, which real kernels do not have, ends too.
#[test]
fn a_kernel_tells_its_span_through_all_pieces_of_the_way() {
    let (day, start) = (86_400.0, 1e8);
    let still = |_: f64| [[1e9, 0.0, 0.0], [0.0; 3]];
    let piece = |target, centre, from: f64, count| Segment {
        target,
        centre,
        kind: 2,
        start: start + from * day,
        days: 2.0,
        count,
        path: &still,
    };
    let list = [
        piece(10, 0, 0.0, 10),
        piece(399, 0, 1.0, 2),
        piece(399, 0, 5.0, 3),
        piece(399, 0, 13.0, 2),
        piece(7, 8, 0.0, 10),
        piece(8, 7, 0.0, 10),
    ];
    let spk = Spk::parse("made.bsp", &crate::kernel::kernel(&list, false)).unwrap();
    let span = |t: f64| spk.span(399, 10, start + t * day).map(|s| s.map(|et| (et - start) / day));
    for (t, want) in [(1.0, [1.0, 11.0]), (6.0, [1.0, 11.0]), (14.0, [13.0, 17.0])] {
        assert_eq!(span(t).unwrap(), want, "{t}");
    }
    let e = span(12.0).unwrap_err().to_string();
    assert_eq!(e.matches(" to 2003-").count(), 2, "both spans are told: {e}");
    assert!(spk.between(7, 399, start + 6.0 * day).is_err());
}

/// If a source ends, samples are not taken beyond its end, and the accuracy there is the same.
#[test]
fn a_table_takes_no_sample_beyond_its_span() {
    struct Short(Epoch, f64);
    impl Ephemeris for Short {
        fn state(
            &self,
            target: Body,
            origin: Body,
            tdb: (f64, f64),
        ) -> Result<PointMotion, linkwork_world::WorldError> {
            let start = self.0.tdb_days();
            let t = ((tdb.0 - start.0) + (tdb.1 - start.1)) * 86_400.0;
            assert!(t >= 0.0 && t <= self.1, "asked at {t} s of {} s", self.1);
            Analytic.state(target, origin, tdb)
        }
        fn span(
            &self,
            target: Body,
            origin: Body,
            tdb: (f64, f64),
        ) -> Result<[f64; 2], linkwork_world::WorldError> {
            Analytic.span(target, origin, tdb)
        }
    }
    let epoch = Epoch::parse("2012-08-06 05:17:57 UTC").unwrap();
    for (target, duration) in [(Body::Moon, 100_000.0), (Body::Sun, 172_800.0), (Body::Sun, 1e6)] {
        let source = Short(epoch, duration);
        let table = Sampled::new(&source, target, Body::Earth, &epoch, duration).unwrap();
        let tdb = epoch.tdb_days();
        let end = Analytic.state(target, Body::Earth, (tdb.0, tdb.1 + duration / 86_400.0));
        near3(&table.at(duration).unwrap().position, &end.unwrap().position, 0.02, "the end");
    }
}

#[test]
fn what_series_and_ellipses_do_not_hold_for_is_refused_with_their_span() {
    let century = |t: f64| (36_525.0 * t, 0.0);
    for (body, t, words) in [
        (Body::Sun, 1.0 + 1e-4, "from 1900 to 2100, not at 2100-01-05T"),
        (Body::Earth, -1.0 - 1e-4, "from 1900 to 2100"),
        (Body::Mars, 0.5 + 1e-4, "Mars's ellipse are valid from 1800 to 2050, not at 2050-01-04T"),
    ] {
        let origin = if body == Body::Earth { Body::Sun } else { Body::Earth };
        let e = Analytic.state(body, origin, century(t)).unwrap_err().to_string();
        assert!(e.contains(words) && e.contains("use a kernel"), "{e}");
    }
    let years = |body| {
        let span = Analytic.span(body, Body::Earth, (0.0, 0.0)).unwrap();
        span.map(|et| 2000.0 + et / (365.25 * 86_400.0))
    };
    assert_eq!(years(Body::Sun), [1900.0, 2100.0]);
    assert_eq!(years(Body::Moon), [1900.0, 2100.0]);
    assert_eq!(years(Body::Mars), [1900.0, 2050.0]);
}
