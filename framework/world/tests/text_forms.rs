//! Texts as editors, spreadsheet programs and downloads change them: every reader of a text returns the same content with a byte order mark, with line
//! ends of Windows, with blanks at the ends of lines, with empty lines and with comments.
use crate::planet::{C04, CELESTRAK, FINALS};
use linkwork_world::gravity::polyhedron::{self, Polyhedron};
use linkwork_world::gravity::{Format, Keep, read};
use linkwork_world::magnetic::Igrf;
use linkwork_world::orbit::{TwoLine, read_oem};
use linkwork_world::planet::Epoch;
use linkwork_world::planet::rotation::{EarthOrientation, PckConstants};
use linkwork_world::spatial::Vec3;

const OEM: &str = "CCSDS_OEM_VERS = 2.0
CREATION_DATE = 2026-01-01T00:00:00
ORIGINATOR = TEST
META_START
OBJECT_NAME = ONE
OBJECT_ID = 2026-001A
CENTER_NAME = EARTH
REF_FRAME = ICRF
TIME_SYSTEM = UTC
START_TIME = 2026-01-31T12:00:00
STOP_TIME = 2026-01-31T12:02:00
META_STOP
2026-01-31T12:00:00 7000.0 10.0 -20.0 0.1 7.5 0.2
2026-01-31T12:01:00 6985.0 460.0 -8.0 -0.4 7.49 0.21
2026-01-31T12:02:00 6940.0 905.0 4.0 -0.9 7.46 0.22
";

/// Vanguard 1, from the report of Vallado and others (2006).
const TLE: &str = "VANGUARD 1
1 00005U 58002B   00179.78495062  .00000023  00000-0  28098-4 0  4753
2 00005  34.2682 348.7242 1859667 331.7664  19.3264 10.82419157413667
";

const ICGEM: &str = "product_type gravity_field
earth_gravity_constant 3.986004415e14
radius 6378136.3
max_degree 2
norm fully_normalized
end_of_head ====
gfc 0 0 1 0
gfc 1 0 0 0
gfc 1 1 0 0
gfc 2 0 -4.84165143790815e-4 0
gfc 2 1 -2.06615509074176e-10 1.38441389137979e-9
gfc 2 2 2.43938357328313e-6 -1.40027370385934e-6
";

const SHADR: &str = "1738.0, 4902.79, 0.1, 2, 2, 1, 0.0, 0.0
0, 0, 1.0, 0.0, 0.0, 0.0
1, 0, 0.0, 0.0, 0.0, 0.0
1, 1, 0.0, 0.0, 0.0, 0.0
2, 0, -9.0882e-5, 0.0, 0.0, 0.0
2, 1, 1.2e-9, 3.0e-9, 0.0, 0.0
2, 2, 3.4673e-5, 1.0e-8, 0.0, 0.0
";

const PCK: &str = "KPL/PCK
A text kernel.
\\begindata
BODY399_RADII = ( 6378.1366 6378.1366 6356.7519 )
BODY399_POLE_RA = ( 0. -0.641 0. )
BODY399_GM = 398600.435436
\\begintext
The end.
";

const IGRF: &str = "c/s deg ord IGRF IGRF SV
g/h n m 2020.0 2025.0 2025-30
g 1 0 -29403.4 -29350.0 12.6
g 1 1 -1451.4 -1410.3 10.0
h 1 1 4653.4 4545.5 -21.5
";

const OBJ: &str = "v -0.5 -0.5 -0.5
v 0.5 -0.5 -0.5
v 0.5 0.5 -0.5
v -0.5 0.5 -0.5
v 0 0 0.5
f 4 3 2 1
f 1 2 5
f 2 3 5
f 3 4 5
f 4 1 5
";

fn field(format: Format, text: &str) -> Result<Vec<f64>, String> {
    let f = read(format, "f", text, Keep::All).map_err(|e| e.to_string())?;
    let mut all = vec![f.mu, f.radius];
    for n in 0..=f.degree() {
        for m in 0..=n {
            let (c, s) = f.get(n, m);
            all.extend([c, s]);
        }
    }
    Ok(all)
}

fn orientation(text: &str) -> Result<Vec<f64>, String> {
    let table = EarthOrientation::read("f", text).map_err(|e| e.to_string())?;
    let p = table.at(&table.span()[0].plus(40_000.0));
    let [x, y] = p.celestial_pole_offsets;
    Ok(vec![p.dut1, p.pole[0], p.pole[1], x, y])
}

type Reader = fn(&str) -> Result<Vec<f64>, String>;

/// Name, content, beginning of a comment, and the reader.
const ALL: &[(&str, &str, Option<&str>, Reader)] = &[
    ("OEM", OEM, Some("COMMENT any"), |text| {
        let all = read_oem("f", text).map_err(|e| e.to_string())?;
        let at = Epoch::parse("2026-01-31 12:00:40 UTC").unwrap();
        let s = all[0].state(&at).unwrap();
        Ok(s.position.iter().chain(s.velocity.iter()).copied().collect())
    }),
    ("TLE", TLE, Some("# any"), |text| {
        let all = TwoLine::read("f", text).map_err(|e| e.to_string())?;
        assert_eq!(all[0].name.as_deref(), Some("VANGUARD 1"));
        let s = all[0].state(&all[0].epoch.plus(3600.0)).unwrap();
        Ok(s.position.iter().chain(s.velocity.iter()).copied().collect())
    }),
    ("finals2000A", FINALS, None, orientation),
    ("EOP-All", CELESTRAK, Some("# any"), orientation),
    ("C04", C04, Some("# any"), orientation),
    ("ICGEM", ICGEM, Some("# any"), |text| field(Format::Icgem, text)),
    ("SHADR", SHADR, Some("# any"), |text| field(Format::Shadr, text)),
    ("PCK", PCK, None, |text| {
        let p = PckConstants::read("f", text).map_err(|e| e.to_string())?;
        let [a, b, c] = p.radii(399).unwrap();
        let ra = p.get(399, "POLE_RA").unwrap();
        Ok(vec![a, b, c, p.gravity_parameter(399).unwrap(), ra[0], ra[1], ra[2]])
    }),
    ("IGRF", IGRF, Some("# any"), |text| {
        let field = Igrf::parse("f", text).map_err(|e| e.to_string())?;
        let at = field.at(&Epoch::parse("2023-03-04 00:00:00 UTC").unwrap());
        let b = at.map_err(|e| e.to_string())?.at(&Vec3::new(4e6, 3e6, 4.5e6));
        Ok(b.iter().copied().collect())
    }),
    ("OBJ", OBJ, Some("# any"), |text| {
        let p: Polyhedron = polyhedron::from_obj("f", text, 2.0, 1.0).map_err(|e| e.to_string())?;
        Ok(vec![p.volume(), p.mu()])
    }),
];

#[test]
fn every_reader_accepts_the_forms_of_a_text() {
    for (name, text, comment, read) in ALL {
        let want = read(text).unwrap_or_else(|e| panic!("{name}: {e}"));
        let every = |f: &dyn Fn(&str) -> String| -> String { text.lines().map(f).collect() };
        let mut forms = vec![
            ("byte order mark", format!("\u{feff}{text}")),
            ("CRLF", text.replace('\n', "\r\n")),
            ("trailing blanks", every(&|l| format!("{l} \t \n"))),
            ("empty lines", every(&|l| format!("{l}\n\n"))),
            ("no last line end", text.trim_end_matches('\n').to_owned()),
            ("all", format!("\u{feff}{}", every(&|l| format!("{l}  \r\n \r\n")))),
        ];
        if let Some(comment) = comment {
            // The version of a message and the name of elements come first.
            let (first, rest) = text.split_once('\n').unwrap();
            forms.push((
                "comments",
                format!("{first}\n{comment}\n{}", rest.replace('\n', &format!("\n{comment}\n"))),
            ));
        }
        for (form, changed) in forms {
            let found = read(&changed).unwrap_or_else(|e| panic!("{name}, {form}: {e}"));
            assert_eq!(found, want, "{name}, {form}");
        }
    }
}

/// The day 366 of a common year would be the first day of the next year. The message names the line of the epoch.
#[test]
fn a_day_that_a_year_does_not_have_is_refused() {
    let with = |year: &str, day: &str| {
        let line = format!("1 00005U 58002B   {year}{day}  .00000023  00000-0  28098-4 0  475");
        let sum: u32 = line.chars().map(|c| c.to_digit(10).unwrap_or(u32::from(c == '-'))).sum();
        let second = TLE.lines().nth(2).unwrap();
        TwoLine::read("f.tle", &format!("NAME\n{line}{}\n{second}\n", sum % 10))
            .map(|all| all[0].epoch)
    };
    for (year, day, fact) in [
        ("26", "366.50000000", "the epoch is day 366.5 of the year 2026, which has 365 days"),
        ("24", "367.00000000", "the epoch is day 367 of the year 2024, which has 366 days"),
        ("99", "000.50000000", "the epoch is day 0.5 of the year 1999, which has 365 days"),
    ] {
        let told = with(year, day).unwrap_err().to_string();
        assert!(told.contains("f.tle:2: ") && told.contains(fact), "{told}");
        assert!(told.contains("correct the day of the year in columns 21 to 32"), "{told}");
    }
    let leap = with("24", "366.50000000").unwrap();
    assert_eq!(leap, Epoch::parse("2024-12-31 12:00:00 UTC").unwrap());
    assert!(with("26", "365.99999999").is_ok());
}
