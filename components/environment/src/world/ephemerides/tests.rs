//! Tests of starts by two-line elements and ephemeris messages: against python-sgp4 with Astropy, and against a circular orbit.

use crate::world::{Centre, PlanetWorld, WorldParams};
use linkwork_surroundings::prelude::*;
use linkwork_surroundings::{Start, StartFrame, TwoLineSource};
use linkwork_world::spatial::Mat3;

const ISS: [&str; 2] = [
    "1 25544U 98067A   08264.51782528 -.00002182  00000-0 -11606-4 0  2927",
    "2 25544  51.6416 247.4627 0006703 130.5360 325.0288 15.72125391563537",
];

fn world(body: Centre, epoch: &str, folder: &std::path::Path) -> Handle<dyn World> {
    let p = WorldParams { epoch: Some(epoch.into()), ..WorldParams::of(body) };
    PlanetWorld::handle(p, &Files::of(vec![folder.to_path_buf()])).unwrap()
}

fn told<T>(result: Result<T, BuildError>) -> String {
    let Err(e) = result else { panic!("it starts") };
    format!("{}\n{}", e.message, e.help.unwrap_or_default())
}

/// The station at 2008-09-20 14:00 UTC: python-sgp4 with WGS 72, then Astropy 7 from TEME to GCRS. Astropy takes UT1 from the IERS, which
/// cancels between both axes but for 1e-9.
#[test]
fn two_lines_start_a_satellite_where_sgp4_has_it() {
    let folder = tempfile::tempdir().unwrap();
    let file = format!(
        "MOLNIYA\n{}\n{}\nISS (ZARYA)\n{}\n{}\n",
        "1 00005U 58002B   00179.78495062  .00000023  00000-0  28098-4 0  4753",
        "2 00005  34.2682 348.7242 1859667 331.7664  19.3264 10.82419157413667",
        ISS[0],
        ISS[1]
    );
    std::fs::write(folder.path().join("two.tle"), file).unwrap();
    let earth = world(Centre::Earth, "2008-09-20 14:00:00 UTC", folder.path());
    let lines = TwoLineSource::Lines(ISS.map(String::from).to_vec());
    let of = |from: &TwoLineSource, satellite: Option<&str>| Start::TwoLine {
        from: from.clone(),
        satellite: satellite.map(String::from),
    };
    let file = TwoLineSource::File("two.tle".into());
    for start in [of(&lines, None), of(&file, Some("ISS (ZARYA)")), of(&file, Some("25544"))] {
        let (r, v) = earth.start(&start).unwrap();
        let want = Vec3::new(4_434_038.211_28, 202_057.792_02, 5_045_657.024_1);
        assert!((r - want).norm() < 1.0, "{}", (r - want).norm());
        let want = Vec3::new(1_628.881_86, 7_331.145_46, -1_723.615_37);
        assert!((v - want).norm() < 2e-3, "{}", (v - want).norm());
    }
    let message = told(earth.start(&of(&file, None)));
    assert!(message.contains("several") && message.contains("MOLNIYA, ISS (ZARYA)"), "{message}");
    let message = told(earth.start(&of(&file, Some("MIR"))));
    assert!(message.contains("no `MIR`"), "{message}");
    let message = told(earth.start(&of(&file, Some("5"))));
    assert!(message.contains("days away"), "{message}");
    let message = told(
        world(Centre::Mars, "2008-09-20 14:00:00 UTC", folder.path()).start(&of(&lines, None)),
    );
    assert!(message.contains("satellites of the Earth"), "{message}");
    let broken = TwoLineSource::Lines(vec![ISS[0].replace("2927", "2926"), ISS[1].into()]);
    let message = told(earth.start(&of(&broken, None)));
    assert!(message.contains(":2:") && message.contains("checksum"), "{message}");
}

fn message(frame: &str, rows: &str) -> String {
    format!(
        "CCSDS_OEM_VERS = 2.0\nCREATION_DATE = 2012-01-01T00:00:00\nORIGINATOR = TEST\n\nMETA_START\nOBJECT_NAME = CRAFT\nOBJECT_ID = 2012-001A\nCENTER_NAME = Earth\nREF_FRAME = {frame}\nTIME_SYSTEM = UTC\nSTART_TIME = 2012-08-06T00:00:00\nSTOP_TIME = 2012-08-06T00:10:00\nMETA_STOP\nCOMMENT rows\n{rows}"
    )
}

/// A circle of 7000 km radius, a row every `step` s: position (km) and velocity (km/s).
fn circle(t: f64) -> (Vec3, Vec3) {
    let n = (398_600.441_8_f64 / 7000.0_f64.powi(3)).sqrt();
    let (s, c) = (n * t).sin_cos();
    (Vec3::new(c, s, 0.0) * 7000.0, Vec3::new(-s, c, 0.0) * (7000.0 * n))
}

#[test]
fn an_ephemeris_message_starts_a_craft_between_its_rows() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: String| std::fs::write(folder.path().join(name), text).unwrap();
    let rows: String = (0..=10)
        .map(|k| {
            let (r, v) = circle(60.0 * f64::from(k));
            format!("2012-219T00:{k:02}:00.000 {} {} {} {} {} {}\n", r.x, r.y, r.z, v.x, v.y, v.z)
        })
        .collect();
    for (frame, name) in
        [("ICRF", "icrf.oem"), ("EME2000", "eme.oem"), ("ITRF2014", "itrf.oem"), ("TOD", "tod.oem")]
    {
        write(name, message(frame, &rows));
    }
    let start = |file: &str| Start::Ephemeris { file: file.into(), object: None };
    // Test at rows and between rows, where Hermite's polynomial of degree 7 over steps of 60 s has an error of
    // millimetres.
    for t in [0.0, 180.0, 93.5, 599.0] {
        let epoch = format!("2012-08-06 00:{:02}:{:06.3} UTC", (t / 60.0) as u32, t % 60.0);
        let earth = world(Centre::Earth, &epoch, folder.path());
        let (r, v) = earth.start(&start("icrf.oem")).unwrap();
        let (want_r, want_v) = circle(t);
        assert!((r - want_r * 1e3).norm() < 5e-3, "{t}: {}", (r - want_r * 1e3).norm());
        assert!((v - want_v * 1e3).norm() < 1e-4, "{t}: {}", (v - want_v * 1e3).norm());
        // The frame bias of `bp00` in ERFA is dα₀ = −14.6 mas, ξ₀ = −16.6 mas.
        let (turned, _) = earth.start(&start("eme.oem")).unwrap();
        let bias = Mat3::new(
            1.0,
            7.078_279e-8,
            -8.056_217e-8,
            -7.078_279e-8,
            1.0,
            -3.306_041e-8,
            8.056_217e-8,
            3.306_041e-8,
            1.0,
        );
        assert!((turned - bias * r).norm() < 1e-5, "{}", (turned - bias * r).norm());
        let fixed = Start::State {
            frame: StartFrame::Itrf,
            position: want_r * 1e3,
            velocity: want_v * 1e3,
        };
        let (a, b) = (earth.start(&start("itrf.oem")).unwrap(), earth.start(&fixed).unwrap());
        assert!((a.0 - b.0).norm() < 5e-3);
    }
    let earth = world(Centre::Earth, "2012-08-06 00:05:00 UTC", folder.path());
    let message_of = |file: &str| told(earth.start(&start(file)));
    assert!(message_of("tod.oem").contains("REF_FRAME = TOD"));
    // A rotating frame that is frozen at an epoch is not supported; inertial axes do not depend on the epoch.
    let frozen =
        |frame: &str| message(&format!("{frame}\nREF_FRAME_EPOCH = 2012-08-06T00:00:00"), &rows);
    write("teme.oem", frozen("TEME"));
    assert!(message_of("teme.oem").contains("the frame TEME is frozen at 2012-08-06T00:00:00"));
    write("frozen.oem", frozen("ICRF"));
    assert_eq!(
        earth.start(&start("frozen.oem")).unwrap(),
        earth.start(&start("icrf.oem")).unwrap()
    );
    let late = world(Centre::Earth, "2012-08-07 00:00:00 UTC", folder.path());
    let message = told(late.start(&start("icrf.oem")));
    assert!(
        message.contains("no state at the epoch") && message.contains("2012-08-06T00:10:00"),
        "{message}"
    );
    let moon = world(Centre::Moon, "2012-08-06 00:05:00 UTC", folder.path());
    assert!(
        told(moon.start(&start("icrf.oem")))
            .contains("`EARTH`, but the body of the world is `moon`")
    );
    let other = Start::Ephemeris { file: "icrf.oem".into(), object: Some("OTHER".into()) };
    assert!(told(earth.start(&other)).contains("`object` with one of: CRAFT"));
    for (rows, part) in [
        ("2012-08-06T00:00:00 1 2 3 4 5\n", "this row has 5 numbers"),
        ("2012-08-06T00:00:00 1 2 3 4 5 x\n", "a number cannot be read"),
        ("2012-08-06T00:01:00 1 2 3 4 5 6\n2012-08-06T00:00:00 1 2 3 4 5 6\n", "not after"),
        ("", "has no states"),
    ] {
        write("bad.oem", super::tests::message("ICRF", rows));
        let message = message_of("bad.oem");
        assert!(message.contains("bad.oem:") && message.contains(part), "{message}");
    }
    write("bad.oem", "<?xml version=\"1.0\"?>".into());
    assert!(message_of("bad.oem").contains("XML is not read"));
}
