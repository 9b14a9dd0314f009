//! Air from files over altitude: every row of the reference files, ends, columns by name, refusals.
use super::*;
use crate::world::{WorldParams, handle};
use linkwork_world::atmosphere::geometric_altitude;

const EARTH_GRAM: &str = "basilisk_EarthGRAMNominal.txt";
const MARS_GRAM: &str = "basilisk_MarsGRAMNominal.txt";
const US76: &str = "basilisk_USStandardAtmosphere1976.csv";

/// The reference files; without them the test says so and is skipped, with `CI=true` it fails.
fn reference() -> Option<Files> {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/reference/atmosphere");
    let files = Files::of(vec![folder.into()]);
    for name in [EARTH_GRAM, MARS_GRAM, US76] {
        if files.find(name).is_err() {
            assert!(!std::env::var("CI").is_ok_and(|v| v == "true"), "{name} is missing");
            println!("SKIPPED: no reference file {name}");
            return None;
        }
    }
    Some(files)
}

fn params(file: &str, layout: TableLayout) -> TableAirParams {
    TableAirParams {
        file: file.to_string(),
        layout,
        columns: None,
        gas: None,
        world: handle(WorldParams::of(match layout {
            TableLayout::MarsGram => Centre::Mars,
            _ => Centre::Earth,
        })),
        winds: vec![],
        wind_table: None,
        density: vec![],
        outside: None,
    }
}

/// Above the equator.
fn point(radius: f64, h: f64) -> Vec3 {
    Vec3::x() * (radius + h)
}

/// Files are read here once more, column by column.
#[test]
fn each_row_of_the_reference_files_is_reproduced() {
    let Some(files) = reference() else { return };
    let (earth, mars) = (6_378_137.0, 3_396_190.0);
    let air_of_mars = [188.92, 1.29, 1.572e-6, 240.0];
    let air_of_earth = [8314.32 / 28.9644, 1.4, 1.458e-6, 110.4];
    // Each layout has the columns of altitude, density and temperature, the unit of altitude in
    // metres, the number of lines above the numbers, and the number of rows.
    let layouts = [
        (MARS_GRAM, TableLayout::MarsGram, [1, 4, 5], 1e3, 1, 401, mars, air_of_mars),
        (EARTH_GRAM, TableLayout::EarthGram, [1, 4, 6], 1e3, 1, 401, earth, air_of_earth),
        (US76, TableLayout::Us76, [0, 2, 1], 1.0, 2, 183, earth, air_of_earth),
    ];
    for (file, layout, columns, unit, skip, count, radius, [constant, gamma, b, s]) in layouts {
        let air = TableAtmosphere::build(params(file, layout), &files).unwrap();
        let text = files.text(file).unwrap();
        let mut rows = 0;
        let mut ends = [f64::INFINITY, f64::NEG_INFINITY];
        for line in text.lines().skip(skip).filter(|l| !l.trim().is_empty()) {
            let words: Vec<&str> = line.split([',', ' ']).filter(|w| !w.is_empty()).collect();
            let [h, density, kelvin] = columns.map(|c| words[c].parse::<f64>().unwrap());
            // The altitude of 86 km in Basilisk's table is geopotential; it is 87.18 km above the
            // ground.
            let h = if file == US76 { geometric_altitude(h) } else { h * unit };
            ends = [ends[0].min(h), ends[1].max(h)];
            let p = point(radius, h);
            let a = air.air(0.0, p);
            let near = |x: f64, want: f64, what: &str| {
                assert!((x / want - 1.0).abs() < 1e-9, "{file}, {h} m: {what} {x} for {want}");
            };
            near(a.density, density, "ρ");
            near(a.temperature, kelvin, "T");
            near(a.pressure, density * constant * kelvin, "p");
            near(a.speed_of_sound, (gamma * constant * kelvin).sqrt(), "a");
            near(air.viscosity(kelvin).unwrap(), b * kelvin.powf(1.5) / (kelvin + s), "μ");
            assert!((air.altitude(0.0, p).unwrap() - h).abs() < 1e-6);
            rows += 1;
        }
        assert_eq!(rows, count, "{file}");

        // Test both ends of the table.
        let [low, high] = ends;
        for (h, out) in [(low + 1.0, low - 250.0), (high - 1.0, high + 250.0)] {
            assert!(air.out_of_range(0.0, point(radius, h)).is_none(), "{file} {h}");
            let told = air.out_of_range(0.0, point(radius, out)).unwrap();
            let words = format!("from {} to {} km", low.round() / 1e3, high.round() / 1e3);
            assert!(told.message.contains(&words) && !told.stops, "{}", told.message);
            let of = |outside| {
                let p = TableAirParams { outside: Some(outside), ..params(file, layout) };
                TableAtmosphere::build(p, &files).unwrap()
            };
            assert!(of(Outside::Stop).out_of_range(0.0, point(radius, out)).unwrap().stops);
            assert!(of(Outside::Continue).out_of_range(0.0, point(radius, out)).is_none());
            let end = point(radius, if out < low { low } else { high });
            let [held, edge] = [point(radius, out), end].map(|p| of(Outside::Clamp).air(0.0, p));
            assert!((held.density / edge.density - 1.0).abs() < 1e-9, "{file} {out}");
            // Extrapolation by half a row changes the density by the same factor as half a row
            // inside.
            let on = air.air(0.0, point(radius, out));
            let inwards = air.air(0.0, end * 2.0 - point(radius, out));
            let (there, back) = (on.density / edge.density, inwards.density / edge.density);
            assert!((there * back - 1.0).abs() < 1e-4 && (there - 1.0).abs() > 1e-4, "{there}");
            assert!((on.temperature - edge.temperature).abs() < 1e-6);
        }
    }
}

/// The same air by the names of its columns, and from the service of Mars alone.
#[test]
fn columns_by_name_and_the_air_of_mars_are_the_same_air() {
    let Some(files) = reference() else { return };
    let by_layout =
        TableAtmosphere::build(params(MARS_GRAM, TableLayout::MarsGram), &files).unwrap();
    let columns = Columns {
        altitude: "HgtMOLA".into(),
        density: "Denkgm3".into(),
        temperature: "Temp".into(),
        altitude_unit: "km".into(),
        density_unit: "kg/m^3".into(),
        counts: Altitudes::Geometric,
        skip: 0,
    };
    let gas = GasParams {
        heat_ratio: 1.29,
        constant: Some(188.92),
        molar_mass: None,
        viscosity: Some(SutherlandParams {
            viscosity: 14.8e-6,
            temperature: 293.15,
            constant: 240.0,
        }),
        heating_constant: None,
    };
    let p = TableAirParams {
        columns: Some(columns),
        gas: Some(gas),
        world: handle(WorldParams::of(Centre::Mars)),
        ..params(MARS_GRAM, TableLayout::Columns)
    };
    let by_name = TableAtmosphere::build(p, &files).unwrap();
    let mars = MarsAirParams {
        table: Some(MARS_GRAM.into()),
        ..tests::bare(WorldParams::of(Centre::Mars))
    };
    let mars = MarsAtmosphere::build(mars, &files).unwrap();
    for h in [-800.0, 0.0, 12_345.6, 77_700.0, 200_000.0, 231_000.0] {
        let p = Vec3::new(0.3, -0.8, 0.52).normalize() * (3_396_190.0 + h);
        let a = by_layout.air(3.0, p);
        assert_eq!(by_name.air(3.0, p), a);
        assert_eq!(mars.air(3.0, p), a);
    }
    let [a, b, c] =
        [&by_layout as &dyn Atmosphere, &by_name, &mars].map(|m| m.viscosity(210.0).unwrap());
    assert!(a == c && (b / a - 1.0).abs() < 1e-4, "{a} {b}");
}

/// Another planet, other units: rows and gas by hand.
#[test]
fn a_planet_that_is_none_of_the_list_has_its_air_from_columns() {
    let dir = tempfile::tempdir().unwrap();
    let files = Files::of(vec![dir.path().to_path_buf()]);
    let text = "z rho T\n\nkm g/cm^3 K\n60 4e-4 260\n50 1.6e-3 350\n";
    std::fs::write(dir.path().join("venus.txt"), text).unwrap();
    let planet = WorldParams {
        radius: Some(6_051_800.0),
        flattening: Some(0.0),
        rate: Some(-2.992_4e-7),
        ..WorldParams::of(Centre::Other)
    };
    let columns = Columns {
        altitude: "z".into(),
        density: "rho".into(),
        temperature: "T".into(),
        altitude_unit: "km".into(),
        density_unit: "g/cm^3".into(),
        counts: Altitudes::Geometric,
        skip: 1,
    };
    let gas = GasParams {
        heat_ratio: 1.29,
        constant: None,
        molar_mass: Some(43.45e-3),
        viscosity: None,
        heating_constant: None,
    };
    let full = TableAirParams {
        columns: Some(columns.clone()),
        gas: Some(gas.clone()),
        world: handle(planet),
        ..params("venus.txt", TableLayout::Columns)
    };
    let build = |p: &TableAirParams| TableAtmosphere::build(p.clone(), &files);
    let air = build(&full).unwrap();
    // The planet is a sphere, so pole and equator have the same air.
    for along in [Vec3::x(), Vec3::z()] {
        let a = air.air(0.0, along * (6_051_800.0 + 55e3));
        assert!((a.density - 0.8).abs() < 1e-9 && (a.temperature - 305.0).abs() < 1e-6);
        let constant = 8.314_462_618 / 43.45e-3;
        assert!((a.pressure / (0.8 * constant * 305.0) - 1.0).abs() < 1e-9);
        assert!((a.speed_of_sound / (1.29 * constant * 305.0_f64).sqrt() - 1.0).abs() < 1e-9);
    }
    let wind = air.air(0.0, Vec3::x() * 6_106_800.0).wind;
    assert!((wind - Vec3::y() * (-2.992_4e-7 * 6_106_800.0)).norm() < 1e-9, "{wind}");
    assert_eq!(air.viscosity(300.0), None);

    let refused = |p: TableAirParams, param: &str, fact: &str| {
        let e = build(&p).err().unwrap_or_else(|| panic!("{fact}"));
        assert!(e.message.contains(fact) && e.help.is_some(), "{}", e.message);
        assert_eq!(e.param.as_deref(), Some(param), "{}", e.message);
    };
    let with = |columns: Columns| TableAirParams { columns: Some(columns), ..full.clone() };
    let of = |gas: GasParams| TableAirParams { gas: Some(gas), ..full.clone() };
    refused(
        TableAirParams { columns: None, ..full.clone() },
        "columns",
        "needs `columns`, which is missing",
    );
    let layout = TableLayout::MarsGram;
    refused(
        TableAirParams { layout, ..full.clone() },
        "columns",
        "cannot be combined with a layout",
    );
    let of_body = |p: TableAirParams, body: &str| {
        let e = build(&p).err().unwrap();
        assert!(e.message.contains(body) && e.help.is_some(), "{}", e.message);
    };
    of_body(TableAirParams { layout, columns: None, ..full.clone() }, "heights are of `mars`");
    let mars = || handle(WorldParams::of(Centre::Mars));
    refused(
        TableAirParams { layout, columns: None, world: mars(), ..full.clone() },
        "file",
        "column `HgtMOLA` is missing; found z, rho, T",
    );
    let counts = Altitudes::Geopotential;
    of_body(
        TableAirParams { world: mars(), ..with(Columns { counts, ..columns.clone() }) },
        "heights are of `earth`",
    );
    refused(TableAirParams { gas: None, ..full.clone() }, "gas", "needs the `gas`");
    refused(of(GasParams { constant: Some(190.0), ..gas.clone() }), "gas", "both");
    refused(of(GasParams { molar_mass: None, ..gas.clone() }), "gas", "neither");
    let lb = "lb".to_string();
    refused(
        with(Columns { density_unit: lb.clone(), ..columns.clone() }),
        "columns",
        "`lb` is not compatible with the unit kg/m^3",
    );
    refused(
        with(Columns { altitude_unit: "furlong".into(), ..columns.clone() }),
        "columns",
        "furlong",
    );
    refused(
        with(Columns { skip: 0, ..columns.clone() }),
        "file",
        "venus.txt:3: `km` in column `z`",
    );
    refused(with(Columns { density: "ro".into(), ..columns }), "file", "column `ro` is missing");
    refused(TableAirParams { file: "none.txt".into(), ..full }, "file", "none.txt");
}

/// A file in the layout of another.
#[test]
fn files_of_another_layout_are_refused() {
    let Some(files) = reference() else { return };
    let cases = [
        (EARTH_GRAM, TableLayout::MarsGram, "column `HgtMOLA` is missing"),
        (MARS_GRAM, TableLayout::EarthGram, "column `Hgtkm` is missing"),
        (US76, TableLayout::EarthGram, "column `Hgtkm` is missing"),
        (MARS_GRAM, TableLayout::Us76, "column `Altitude` is missing"),
    ];
    for (file, layout, fact) in cases {
        let e = TableAtmosphere::build(params(file, layout), &files).err().unwrap();
        assert!(e.message.contains(&format!("{file}:1: {fact}")), "{}", e.message);
        assert!(e.param.as_deref() == Some("file") && e.help.is_some());
    }
}
