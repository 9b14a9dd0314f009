//! Air of planets: heights, winds, seasons, ends of data.
use super::*;
use crate::world::{Turning, WorldParams, handle};

/// A body that turns about z of W from x on, whatever the date.
fn fixed(body: Centre) -> WorldParams {
    WorldParams { turns: Some(Turning::Fixed), angle: Some(0.0), ..WorldParams::of(body) }
}

fn earth() -> WorldParams {
    WorldParams { rate: Some(1e-4), angle: Some(0.4), ..WorldParams::of(Centre::Earth) }
}

#[test]
fn the_standard_atmosphere_moves_with_the_ground_and_the_wind() {
    // The wind from the west is 6 m/s at the ground and stronger above.
    let layer = |altitude: f64, east: f64| WindLayer { altitude, east, north: 1.0, up: 0.0 };
    let winds = vec![layer(0.0, 6.0), layer(10_000.0, 16.0)];
    let p = Us76Params {
        world: handle(earth()),
        winds,
        wind_table: None,
        density: vec![],
        temperature_offset: 0.0,
        outside: None,
    };
    let air = StandardAtmosphere::build(p, &Files::default()).unwrap();
    let (t, r) = (3000.0, 6_378_137.0 + 5000.0);
    // The point is above the equator, at longitude 0.4 after the rotation of the planet.
    let at: f64 = 0.4 + 1e-4 * t + 0.4;
    let (up, east) = (Vec3::new(at.cos(), at.sin(), 0.0), Vec3::new(-at.sin(), at.cos(), 0.0));
    let a = air.air(t, up * r);
    assert!((a.wind - (east * (1e-4 * r + 11.0) + Vec3::z())).norm() < 1e-8, "{}", a.wind);
    // Values of the standard's table at 5 km.
    assert!((a.temperature - 255.676).abs() < 1e-2 && (a.density - 0.736_43).abs() < 1e-4);
    assert!((a.pressure / 54_048.0 - 1.0).abs() < 1e-4, "{}", a.pressure);
    // Altitude is measured from the ellipsoid, whose surface is 21.4 km nearer to the centre at the
    // pole.
    let pole = air.air(t, Vec3::z() * (6_356_752.314 + 5000.0));
    assert!((pole.density - a.density).abs() < 1e-7);
    assert!(air.air(t, Vec3::zeros()).density.is_nan());
}

#[test]
fn msis_knows_day_and_night_and_ends_above() {
    let epoch = Some("2012-08-06 05:17:57 UTC".to_string());
    let planet = WorldParams { turns: Some(Turning::Iau), epoch, ..WorldParams::of(Centre::Earth) };
    let p = MsisParams {
        world: handle(planet),
        f107: 150.0,
        f107_mean: None,
        ap: 4.0,
        winds: vec![],
        wind_table: None,
        density: vec![],
        outside: None,
    };
    let air = MsisAtmosphere::build(p.clone(), &Files::default()).unwrap();
    // In early August, the Sun is at right ascension 136°, and the density bulge is some 30°
    // behind.
    let at = |degrees: f64, h: f64| {
        let l = degrees.to_radians();
        air.air(0.0, Vec3::new(l.cos(), l.sin(), 0.0) * (6_378_137.0 + h))
    };
    let (day, night) = (at(166.0, 4e5), at(346.0, 4e5));
    assert!(day.density > 2.0 * night.density && day.temperature > night.temperature + 100.0);
    assert!(day.density > 1e-12 && day.density < 2e-11, "{}", day.density);
    let ground = at(50.0, 0.0);
    assert!((ground.density - 1.18).abs() < 0.05 && (ground.speed_of_sound - 346.0).abs() < 6.0);
    assert!((ground.pressure / 101_325.0 - 1.0).abs() < 0.02, "{}", ground.pressure);
    assert_eq!(at(50.0, 2.1e6).density, 0.0);
    let mars = MsisParams { world: handle(WorldParams::of(Centre::Mars)), ..p.clone() };
    let e = MsisAtmosphere::build(mars, &Files::default()).err().unwrap();
    assert!(e.message.contains("`earth`") && e.help.is_some());
    let no_date = MsisParams { world: handle(WorldParams::of(Centre::Earth)), ..p };
    let e = MsisAtmosphere::build(no_date, &Files::default()).err().unwrap();
    assert!(e.message.contains("needs an epoch"), "{}", e.message);
}

pub(super) fn bare(planet: WorldParams) -> MarsAirParams {
    MarsAirParams {
        table: None,
        climate: vec![],
        season: None,
        dust: None,
        world: handle(planet),
        winds: vec![],
        wind_table: None,
        density: vec![],
        outside: None,
    }
}

/// What it should be is written out: four tables with ln ρ and T by hand.
#[test]
fn season_and_dust_choose_the_air_of_mars() {
    let dir = tempfile::tempdir().unwrap();
    let files = Files::of(vec![dir.path().to_path_buf()]);
    let one = |name: &str, density: f64, kelvin: f64, top: f64| {
        let text = format!(
            "HgtMOLA Temp Denkgm3\n0 {kelvin} {density}\n{top} {} {}\n",
            kelvin - 20.0,
            0.1 * density
        );
        std::fs::write(dir.path().join(name), text).unwrap();
    };
    one("spring_clear.txt", 0.02, 220.0, 20.0);
    one("spring_dusty.txt", 0.01, 240.0, 20.0);
    one("autumn_clear.txt", 0.008, 200.0, 40.0);
    one("autumn_dusty.txt", 0.004, 230.0, 20.0);
    let table = |season: f64, dust: f64, name: &str| ClimateTable {
        season: season.to_radians(),
        dust,
        table: name.to_string(),
    };
    let climate = vec![
        table(200.0, 1.1, "autumn_dusty.txt"),
        table(20.0, 0.1, "spring_clear.txt"),
        table(200.0, 0.1, "autumn_clear.txt"),
        table(20.0, 1.1, "spring_dusty.txt"),
    ];
    let p = MarsAirParams { climate, ..bare(WorldParams::of(Centre::Mars)) };
    let at = |p: &MarsAirParams, season: Option<f64>, dust: Option<f64>| {
        let season = season.map(f64::to_radians);
        MarsAtmosphere::build(MarsAirParams { season, dust, ..p.clone() }, &files)
    };
    let air = |season: f64, dust: f64, h: f64| {
        let built = at(&p, Some(season), Some(dust)).unwrap_or_else(|e| panic!("{}", e.message));
        built.air(0.0, Vec3::x() * (3_396_190.0 + h))
    };
    let near = |a: Air, density: f64, kelvin: f64| {
        assert!((a.density / density - 1.0).abs() < 1e-9, "{} for {density}", a.density);
        assert!((a.temperature - kelvin).abs() < 1e-6, "{} for {kelvin}", a.temperature);
    };
    // Test the day of a table, the middle between two tables, and a quarter of the interval that contains the
    // new year.
    near(air(20.0, 0.1, 0.0), 0.02, 220.0);
    near(air(380.0, 1.1, 10_000.0), 0.01 * 0.1f64.sqrt(), 230.0);
    near(air(110.0, 0.1, 0.0), (0.02f64 * 0.008).sqrt(), 210.0);
    near(air(-25.0, 0.1, 0.0), 0.02f64.powf(0.75) * 0.008f64.powf(0.25), 215.0);
    near(air(20.0, 0.35, 0.0), 0.02f64.powf(0.75) * 0.01f64.powf(0.25), 225.0);
    // At 20 km the higher table is between its rows.
    let middle = (0.002f64 * 0.008 * 0.1f64.sqrt()).sqrt();
    near(air(110.0, 0.1, 20_000.0), middle, 0.5 * (200.0 + 190.0));
    // The season of a date: L_s is 327.3° on 2004-01-03, from the second example of Mars24.
    let epoch = Some("2004-01-03 13:46:31 UTC".to_string());
    let dated =
        MarsAirParams { world: handle(WorldParams { epoch, ..fixed(Centre::Mars) }), ..p.clone() };
    let of_date = at(&dated, None, Some(0.1)).unwrap().air(0.0, Vec3::x() * 3_396_190.0);
    let there = air(327.324_16, 0.1, 0.0);
    assert!((of_date.density / there.density - 1.0).abs() < 1e-7, "{}", of_date.density);
    assert!((of_date.temperature - there.temperature).abs() < 1e-5, "{}", of_date.temperature);

    let refused = |p: &MarsAirParams, season, dust| at(p, season, dust).err().unwrap().message;
    assert!(refused(&p, Some(20.0), Some(1.2)).contains("dust from 0.1 to 1.1"));
    assert!(refused(&p, Some(20.0), None).contains("needs `dust`"));
    assert!(refused(&p, None, Some(0.1)).contains("needs an epoch"));
    let mut hole = p.clone();
    hole.climate.pop();
    assert!(refused(&hole, Some(20.0), Some(0.1)).contains("0 tables at the season 20.0°"));
    let both = MarsAirParams { table: Some("spring_clear.txt".into()), ..p.clone() };
    assert!(refused(&both, Some(20.0), Some(0.1)).contains("both given"));
    let none = bare(WorldParams::of(Centre::Mars));
    assert!(refused(&none, None, Some(0.1)).contains("`dust` without `climate`"));
}

#[test]
fn the_air_of_mars_from_a_line_or_a_table() {
    let planet = WorldParams::of(Centre::Mars);
    let p = MarsAirParams { table: None, ..bare(planet) };
    let simple = MarsAtmosphere::build(p.clone(), &Files::default()).unwrap();
    let point = |h: f64| Vec3::x() * (3_396_190.0 + h);
    let a = simple.air(0.0, point(5000.0));
    let (kelvin, pascal) = (-31.0 - 0.000998 * 5000.0 + 273.1, 699.0 * (-0.45f64).exp());
    assert!((a.temperature - kelvin).abs() < 1e-6 && (a.pressure - pascal).abs() < 1e-6);
    assert!((a.wind.y - 7.088_218e-5 * 3_401_190.0).abs() < 1e-3, "{}", a.wind);

    let dir = tempfile::tempdir().unwrap();
    let file = |text: &str| {
        std::fs::write(dir.path().join("air.txt"), text).unwrap();
        let files = Files::of(vec![dir.path().to_path_buf()]);
        MarsAtmosphere::build(MarsAirParams { table: Some("air.txt".into()), ..p.clone() }, &files)
    };
    let rows = "HgtMOLA Temp Denkgm3\n0 220 0.02\n10 200 0.005\n20 180 0.002\n";
    let a = file(rows).unwrap().air(0.0, point(5000.0));
    assert!((a.density - 0.01).abs() < 1e-9 && (a.temperature - 210.0).abs() < 1e-6);
    // The error has the place, the fact and a remedy.
    let e = file(&rows.replace("200", "hot")).err().unwrap();
    assert!(e.message.contains("air.txt:3") && e.message.contains("`hot`"), "{}", e.message);
    assert_eq!(e.param.as_deref(), Some("table"));
    let e = file(&rows.replace("Denkgm3", "Dens")).err().unwrap();
    assert!(e.message.contains("column `Denkgm3` is missing") && e.help.is_some(), "{}", e.message);
    let missing = MarsAirParams { table: Some("none.txt".into()), ..p };
    let e = MarsAtmosphere::build(missing, &Files::default()).err().unwrap();
    assert!(e.message.contains("none.txt"));
}

#[test]
fn the_air_of_a_day_is_that_of_the_model_times_a_factor_by_height() {
    let planet = WorldParams::of(Centre::Mars);
    let of = |density: Vec<DensityLayer>| {
        let p = MarsAirParams { density, ..bare(planet.clone()) };
        MarsAtmosphere::build(p, &Files::default())
    };
    let layer = |altitude: f64, factor: f64| DensityLayer { altitude, factor };
    let model = of(vec![]).unwrap();
    let day = of(vec![layer(0.0, 1.2), layer(10_000.0, 0.8)]).unwrap();
    for (h, factor) in [(-3000.0, 1.2), (0.0, 1.2), (2500.0, 1.1), (10_000.0, 0.8), (2e4, 0.8)] {
        let p = Vec3::x() * (3_396_190.0 + h);
        let (a, b) = (model.air(0.0, p), day.air(0.0, p));
        assert!((b.density / a.density - factor).abs() < 1e-12, "{h}: {}", b.density / a.density);
        assert!((b.pressure / a.pressure - factor).abs() < 1e-12);
        let rest = |a: &Air| (a.temperature, a.speed_of_sound, a.wind);
        assert_eq!(rest(&a), rest(&b));
    }
    for (wrong, fact) in [
        (vec![layer(0.0, -0.1)], "an invalid factor"),
        (vec![layer(0.0, f64::NAN)], "an invalid factor"),
        (vec![layer(5.0, 1.0), layer(5.0, 1.0)], "altitude 5 m after 5 m"),
    ] {
        let e = of(wrong).err().unwrap();
        assert!(e.message.contains(fact) && e.param.as_deref() == Some("density"), "{}", e.message);
    }
}

/// Each model: where its data end it goes on, holds the air at the end, or has the run stopped; it tells the height and its range.
#[test]
fn where_data_end_the_user_says_what_happens() {
    let dir = tempfile::tempdir().unwrap();
    let files = Files::of(vec![dir.path().to_path_buf()]);
    let rows = "HgtMOLA Temp Denkgm3\n0 220 0.02\n10 200 0.005\n";
    std::fs::write(dir.path().join("air.txt"), rows).unwrap();
    let epoch = Some("2012-08-06 05:17:57 UTC".to_string());
    let earth = WorldParams { epoch, ..fixed(Centre::Earth) };
    let mars = WorldParams::of(Centre::Mars);
    let us76 = |outside| -> Box<dyn Atmosphere> {
        let world = handle(earth.clone());
        let p = Us76Params {
            world,
            winds: vec![],
            wind_table: None,
            density: vec![],
            temperature_offset: 0.0,
            outside,
        };
        Box::new(StandardAtmosphere::build(p, &files).unwrap())
    };
    let msis = |outside| -> Box<dyn Atmosphere> {
        let (f107, f107_mean, ap) = (150.0, None, 4.0);
        let (winds, density, world) = (vec![], vec![], handle(earth.clone()));
        let wind_table = None;
        let p = MsisParams { world, f107, f107_mean, ap, winds, wind_table, density, outside };
        Box::new(MsisAtmosphere::build(p, &files).unwrap())
    };
    let mars_air = |table: Option<&str>, outside| -> Box<dyn Atmosphere> {
        let p = MarsAirParams { table: table.map(Into::into), outside, ..bare(mars.clone()) };
        Box::new(MarsAtmosphere::build(p, &files).unwrap())
    };
    type Make<'a> = &'a dyn Fn(Option<Outside>) -> Box<dyn Atmosphere>;
    let all: [(&str, Make<'_>, f64, [f64; 2]); 4] = [
        ("us76", &us76, 6_378_137.0, [-5e3, 1e6]),
        ("msis", &msis, 6_378_137.0, [0.0, 2e6]),
        ("table", &|o| mars_air(Some("air.txt"), o), 3_396_190.0, [0.0, 1e4]),
        ("simple", &|o| mars_air(None, o), 3_396_190.0, [-8.5e3, 3e4]),
    ];
    for (name, make, radius, [low, high]) in all {
        let at = |h: f64| Vec3::x() * (radius + h);
        let [holds, stops, asked] =
            [Outside::Clamp, Outside::Stop, Outside::Continue].map(|o| make(Some(o)));
        let goes_on = make(None);
        for (end, out) in [(low + 1e-3, low - 1e3), (high - 1e-3, high + 1e3)] {
            let density = |air: &dyn Atmosphere, h: f64| air.air(0.0, at(h)).density;
            let edge = density(&*holds, end);
            assert!((density(&*holds, out) / edge - 1.0).abs() < 1e-5, "{name} {out}");
            assert_eq!(density(&*goes_on, end), edge, "{name}: inside all are the same");
            let on = density(&*goes_on, out);
            assert_eq!(density(&*asked, out), on, "{name}: the same, unsaid");
            assert!(asked.out_of_range(0.0, at(out)).is_none(), "{name} {out}");
            let level = name == "msis" && out < 0.0;
            assert!(level || (on / edge - 1.0).abs() > 1e-4, "{name} {out}: {on} {edge}");
            for (air, stops) in [(&goes_on, false), (&holds, false), (&stops, true)] {
                assert!(air.out_of_range(0.0, at(end)).is_none(), "{name} {end}");
                let told = air.out_of_range(0.0, at(out)).unwrap();
                assert_eq!(told.stops, stops);
                let words =
                    format!("from {} to {} km, not to {:.3} km", low / 1e3, high / 1e3, out / 1e3);
                assert!(told.message.contains(&words), "{}", told.message);
                assert!(told.help.unwrap().contains("`outside`"));
            }
        }
    }
}

#[test]
fn winds_that_do_not_rise_are_refused() {
    let layer = |altitude: f64| WindLayer { altitude, east: 1.0, north: 0.0, up: 0.0 };
    let winds = vec![layer(10.0), layer(10.0)];
    let p = Us76Params {
        world: handle(earth()),
        winds,
        wind_table: None,
        density: vec![],
        temperature_offset: 0.0,
        outside: None,
    };
    let e = StandardAtmosphere::build(p, &Files::default()).err().unwrap();
    assert!(e.message.contains("altitude 10 m") && e.param.as_deref() == Some("winds"));
}

/// The same wind from layers and from a file, for each atmosphere; what is wrong is told with place and remedy.
#[test]
fn winds_come_from_a_file() {
    let dir = tempfile::tempdir().unwrap();
    let files = Files::of(vec![dir.path().to_path_buf()]);
    let write = |text: &str| std::fs::write(dir.path().join("wind.csv"), text).unwrap();
    write("altitude, east, north, up\n0, 4, -2, 0\n10000, 24, 8, 1\n");
    let epoch = Some("2012-08-06 05:17:57 UTC".to_string());
    let earth = WorldParams { epoch, ..fixed(Centre::Earth) };
    let table = || Some("wind.csv".to_string());
    let us76 = |winds, wind_table| -> Result<Box<dyn Atmosphere>, BuildError> {
        let world = handle(earth.clone());
        let p = Us76Params {
            world,
            winds,
            wind_table,
            density: vec![],
            temperature_offset: 0.0,
            outside: None,
        };
        Ok(Box::new(StandardAtmosphere::build(p, &files)?))
    };
    let msis = |winds, wind_table| -> Result<Box<dyn Atmosphere>, BuildError> {
        let (f107, f107_mean, ap) = (150.0, None, 4.0);
        let (density, world, outside) = (vec![], handle(earth.clone()), None);
        let p = MsisParams { world, f107, f107_mean, ap, winds, wind_table, density, outside };
        Ok(Box::new(MsisAtmosphere::build(p, &files)?))
    };
    let mars = |winds, wind_table| -> Result<Box<dyn Atmosphere>, BuildError> {
        let p = MarsAirParams { winds, wind_table, ..bare(WorldParams::of(Centre::Mars)) };
        Ok(Box::new(MarsAtmosphere::build(p, &files)?))
    };
    let layer = |altitude: f64, east: f64, north: f64, up: f64| {
        let [altitude, east, north, up] = [altitude, east, north, up];
        WindLayer { altitude, east, north, up }
    };
    let layers = || vec![layer(0.0, 4.0, -2.0, 0.0), layer(1e4, 24.0, 8.0, 1.0)];
    type Make<'a> =
        &'a dyn Fn(Vec<WindLayer>, Option<String>) -> Result<Box<dyn Atmosphere>, BuildError>;
    let all: [(Make<'_>, f64); 3] =
        [(&us76, 6_378_137.0), (&msis, 6_378_137.0), (&mars, 3_396_190.0)];
    for (make, radius) in all {
        let [still, written, read] = [(vec![], None), (layers(), None), (vec![], table())]
            .map(|(winds, table)| make(winds, table).unwrap());
        let p = Vec3::x() * (radius + 2500.0);
        let [still, written, read] = [still, written, read].map(|a| a.air(0.0, p).wind);
        assert_eq!(read, written);
        // The position is at the equator and the prime meridian, so up is x, east is y and north is
        // z.
        assert!((read - still - Vec3::new(0.25, 9.0, 0.5)).norm() < 1e-9, "{}", read - still);
        let e = make(layers(), table()).err().unwrap();
        assert!(e.message.contains("both given") && e.param.as_deref() == Some("wind_table"));
        let e = make(vec![], Some("none.csv".into())).err().unwrap();
        assert!(e.message.contains("none.csv") && e.param.as_deref() == Some("wind_table"));
    }
    for (text, fact) in [
        ("altitude, east\n0, 1\n", "no columns of winds; the columns are altitude, east"),
        ("altitude, east, north\n0, 1, x\n", "wind.csv:2: `x` in column `north`"),
        ("altitude, east, north\n0, 1, 1\n0, 2, 2\n", "wind.csv:3: altitude 0 is next to 0"),
        ("altitude, east, north\n", "has no entry"),
    ] {
        write(text);
        let e = us76(vec![], table()).err().unwrap();
        assert!(e.message.contains(fact) && e.help.is_some(), "{}", e.message);
    }
}
