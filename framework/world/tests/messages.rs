//! Two-line elements and ephemeris messages that public reports are about (`tests/hunt/orbits.md`). Expected states: python-sgp4 2.27 with WGS 72.

use linkwork_spatial::Vec3;
use linkwork_world::orbit::{TwoLine, read_oem};
use linkwork_world::planet::Epoch;

fn read(lines: [&str; 2]) -> Result<TwoLine, String> {
    let text = format!("{}\n{}\n", lines[0], lines[1]);
    TwoLine::read("case.tle", &text).map_err(|e| e.to_string()).map(|mut all| all.remove(0))
}

/// Lines that other readers rejected or read wrongly: the number, the epoch, and the position (km) six hours later.
#[test]
fn lines_with_unusual_fields_are_read() {
    let cases: [([&str; 2], u64, &str, [f64; 3]); 4] = [
        // python-sgp4 #81: leading zeros are replaced by blanks.
        (
            [
                "1  4859U 21001A   21007.63955392  .00000000  00000+0  00000+0 0  9990",
                "2  4859 000.0000 000.0000 0000000 000.0000 000.0000 01.00000000    09",
            ],
            4859,
            "2021-01-07T15:20:57",
            [-7.472053450370515, 42240.55109125077, 13.16965486980523],
        ),
        // ostk-astrodynamics PR 693, strf PR 72: catalogue numbers above 99 999 use the notation
        // Alpha-5.
        (
            [
                "1 A5544U 98067A   08264.51782528 -.00002182  00000-0 -11606-4 0  2925",
                "2 A5544  51.6416 247.4627 0006703 130.5360 325.0288 15.72125391563535",
            ],
            105_544,
            "2008-09-20T12:25:40",
            [2748.401544598741, -3564.8924045783733, 4992.448308873714],
        ),
        // pyephem #98: the designator is missing, an exponent is `-0`, and angles have leading
        // zeros.
        (
            [
                "1 99998U          16033.50000000 -.00000082  00000-0 -21065-5 0 00006",
                "2 99998 055.0190 359.9965 0008971 268.7611 091.2409 15.38670435000016",
            ],
            99_998,
            "2016-02-02T12:00:00",
            [3894.679656347738, -3268.4002380556212, -4557.309101320406],
        ),
        // pypredict #59: the classification is C, and the fields for the element set number and the revolution number
        // are mostly blank.
        (
            [
                "1 70335C 23054AL  23105.34038169 -.00032587  00000+0 -14314-2 0    01",
                "2 70335  97.4114   1.1880 0010120 235.8387 209.1455 15.21961743    10",
            ],
            70_335,
            "2023-04-15T08:10:08",
            [6688.276282437229, -44.9543466805492, 1631.3536316420002],
        ),
    ];
    let mut wrong = Vec::new();
    for (lines, number, epoch, position) in cases {
        match read(lines) {
            Ok(e) => {
                let at = format!("{}", e.epoch);
                let state = e.state(&e.epoch.plus(6.0 * 3600.0)).unwrap();
                let off = (state.position / 1e3 - Vec3::from(position)).norm();
                // The microseconds of the epoch correspond to 5 mm of the path.
                if e.number != number || !at.starts_with(epoch) || off > 1e-5 {
                    wrong.push(format!("{}: {} at {at}, {off} km off", lines[0], e.number));
                }
            }
            Err(e) => wrong.push(format!("{}: {e}", lines[0])),
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// python-sgp4 #130: lines that lost blanks have fields in other columns. skyfield #453: a year does not have a day 0.
#[test]
fn lines_without_their_columns_or_with_a_day_0_are_rejected() {
    let lines = [
        "1 26463U 00045A 15061.55382988 .00000103 00000-0 00000+0 0 9994",
        "2 26463 139.1946 350.2185 6613884 203.1366 0.5457 0.44214876 25797",
    ];
    let Err(message) = read(lines) else { panic!("it is read") };
    assert!(message.contains("case.tle:2:") && message.contains("69 characters"), "{message}");
    let lines = [
        "1 42680U 16049E   17000.00000000 0.00000218  00000-0  80444-4 0  9993",
        "2 42680  98.3668 218.4259 0018140 186.3838 173.7123 14.41455213 48482",
    ];
    let Err(message) = read(lines) else { panic!("it is read") };
    assert!(message.contains("case.tle:1: the epoch is day 0 of the year 2017"), "{message}");
}

/// SGP4 computes a path through the Earth without an error; python-sgp4 reports error 6, a decayed satellite.
#[test]
fn a_satellite_inside_the_earth_has_no_state() {
    let lines = [
        "1 A5544U 98067A   02016.56655579  .00000000  00000-0  45944-3 0    18",
        "2 A5544 130.3698 359.6047 4102661 205.1379  21.7549 14.60597274    15",
    ];
    let elements = read(lines).unwrap();
    let told = elements.state(&elements.epoch).map_err(|e| e.to_string());
    assert!(told.is_err_and(|e| e.contains("is inside the Earth")));
}

fn message(meta: &str, rows: &str) -> String {
    format!(
        "CCSDS_OEM_VERS = 3.0\nMETA_START\nOBJECT_NAME = CRAFT\nCENTER_NAME = EARTH\nREF_FRAME = ICRF\n{meta}META_STOP\n{rows}"
    )
}

/// CCSDS 502.0-B-3, table 5-3: states outside of the usable time only support the interpolation; `Z` may follow a time.
#[test]
fn a_message_covers_its_usable_time() {
    let rows: String = (0..=10)
        .map(|k| format!("2026-01-01T00:{k:02}:00Z {k} 0 0 0.016666666666666666 0 0\n"))
        .collect();
    let meta = "USEABLE_START_TIME = 2026-01-01T00:02:00Z\nUSEABLE_STOP_TIME = 2026-001T00:07:30\nTIME_SYSTEM = TAI\n";
    let all = read_oem("case.oem", &message(meta, &rows)).unwrap();
    let at = |text: &str| Epoch::parse(&format!("2026-01-01 00:{text} TAI")).unwrap();
    let (first, last) = all[0].covers().unwrap();
    assert_eq!((first, last), (at("02:00"), at("07:30")));
    for (time, x) in
        [("01:59", None), ("02:00", Some(2e3)), ("07:15", Some(7.25e3)), ("07:31", None)]
    {
        let told = all[0].state(&at(time)).map(|s| s.position.x);
        assert_eq!(told.is_some(), x.is_some(), "{time}");
        assert!((told.unwrap_or(0.0) - x.unwrap_or(0.0)).abs() < 1e-6, "{time}: {told:?}");
    }
    let wrong =
        read_oem("case.oem", &message("USEABLE_START_TIME = soon\nTIME_SYSTEM = UTC\n", &rows));
    assert!(wrong.is_err_and(|e| e.to_string().contains("case.oem:6:")));
    let backwards = "USEABLE_START_TIME = 2026-001T00:07:00\nUSEABLE_STOP_TIME = 2026-001T00:05:00\nTIME_SYSTEM = TAI\n";
    let all = read_oem("case.oem", &message(backwards, &rows)).unwrap();
    assert!(all[0].covers().is_none() && all[0].state(&at("06:00")).is_none());
}
