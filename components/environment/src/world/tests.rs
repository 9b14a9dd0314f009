//! Rotation, sites, tables of the Earth, mistakes, shadows.

use super::service::*;
use super::*;
use crate::third::Third;
use linkwork_surroundings::SOLAR_CONSTANT;
use linkwork_surroundings::prelude::*;
use linkwork_world::ephemeris::Body;

fn refused(p: &WorldParams) -> BuildError {
    p.planet(&Files::default()).err().unwrap()
}

#[test]
fn bodies_turn_at_their_own_rate_or_the_written_one() {
    for (body, day) in
        [(Centre::Earth, 86_164.1), (Centre::Mars, 88_642.66), (Centre::Moon, 2_360_591.5)]
    {
        let planet = WorldParams::of(body).planet(&Files::default()).unwrap();
        let turn = planet.rotation.at(day).R_IP * Vec3::x();
        assert!((turn - Vec3::x()).norm() < 1e-5, "{body:?}: {turn}");
        // After a quarter of a day, the meridian points to the former east, because the rotation is
        // eastward.
        assert!((planet.rotation.at(day / 4.0).R_IP * Vec3::x() - Vec3::y()).norm() < 1e-5);
    }
    let p = WorldParams { rate: Some(0.01), angle: Some(0.5), ..WorldParams::of(Centre::Mars) };
    let x = p.planet(&Files::default()).unwrap().rotation.at(20.0).R_IP * Vec3::x();
    assert!((x - Vec3::new(0.7f64.cos(), 0.7f64.sin(), 0.0)).norm() < 1e-15);
}

#[test]
fn the_iau_rotation_is_the_bodys_own() {
    let epoch = Some("2007-11-20 00:00:00 UTC".to_string());
    for (body, rate) in [(Centre::Earth, 7.292_115e-5), (Centre::Mars, 7.088_218e-5)] {
        let p = WorldParams {
            turns: Some(Turning::Iau),
            epoch: epoch.clone(),
            ..WorldParams::of(body)
        };
        let point = Vec3::new(0.0, 7e6, 1e6);
        let (spin, place) = p.planet(&Files::default()).unwrap().place(3600.0, point);
        assert!((spin.omega_I.norm() - rate).abs() < 1e-10, "{}", spin.omega_I.norm());
        // Latitude is measured from the body's own equator. Geodetic and geocentric latitude differ
        // by 0.3°.
        let sine = (spin.R_IP * Vec3::z()).dot(&point) / point.norm();
        assert!((place.unwrap().latitude.sin() - sine).abs() < 0.005);
    }
    // The pole of Mars is inclined by 37° to the pole of the Earth.
    let p = WorldParams { turns: Some(Turning::Iau), epoch, ..WorldParams::of(Centre::Mars) };
    let pole = p.planet(&Files::default()).unwrap().rotation.at(0.0).R_IP * Vec3::z();
    assert!((pole.z - 52.88_f64.to_radians().sin()).abs() < 1e-3, "{pole}");
}

const HERE: SiteParams =
    SiteParams { latitude: 0.4, longitude: -1.1, height: -2e3, heading: 0.3, turning: true };

/// How far a site is turned from where its planet has it, rad, at t (s).
fn apart(p: &WorldParams, t: f64) -> f64 {
    let planet = p.planet(&Files::default()).unwrap();
    let site = planet.site.unwrap();
    (planet.rotation.at(t).R_IP * site.pose.rotation).angle_to(&site.to_inertial(t))
}

#[test]
fn a_site_stands_among_the_stars_where_its_planet_has_it() {
    let site = Some(HERE);
    for (turns, rate) in [(Turning::Still, None), (Turning::Fixed, Some(3e-3))] {
        let turns = Some(turns);
        let p =
            WorldParams { turns, rate, angle: Some(0.7), site, ..WorldParams::of(Centre::Mars) };
        assert!(apart(&p, 4321.0) < 1e-12, "{turns:?}");
        let site = p.planet(&Files::default()).unwrap().site.unwrap();
        assert_eq!(site.rate, rate.unwrap_or(0.0));
    }
    // With `Iau`, pole and rate are constant; changes by precession, tides and libration within a day are neglected.
    let epoch = Some("2026-11-02 00:00:00 UTC".to_string());
    for (body, day) in [(Centre::Mars, 3e-8), (Centre::Earth, 7e-7), (Centre::Moon, 2e-4)] {
        let p = WorldParams {
            turns: Some(Turning::Iau),
            epoch: epoch.clone(),
            site,
            ..WorldParams::of(body)
        };
        let (hour, whole) = (apart(&p, 3600.0), apart(&p, 86_400.0));
        println!("{body:?}: {hour:.1e} rad in an hour, {whole:.1e} rad in a day");
        assert!(apart(&p, 0.0) < 1e-15 && whole < 1.5 * day && whole > 0.2 * day, "{body:?}");
        assert!(hour < 0.1 * whole.max(day), "{body:?}");
    }
}

/// Rows of IERS's finals2000A: MJD, x, y (″), UT1 − UTC (s), dX, dY (mas), in its columns.
fn finals(first: i64) -> String {
    let row = |k: i64| {
        let (mjd, x, y, ut) = (first + k, 0.1 + 1e-3 * k as f64, 0.2, -0.3 - 1e-3 * k as f64);
        format!(
            "{:7}{mjd:5}.00 I {x:9.6} 0.000050 {y:9.6} 0.000050  I{ut:10.7} 0.0000042  0.6887 0.0028  I {:9.3} {:8.3} {:9.3} {:8.3}\n",
            "", 0.1, 0.09, -0.2, 0.1
        )
    };
    (0..10).map(row).collect()
}

#[test]
fn the_earth_turns_by_a_table() {
    let folder = std::env::temp_dir().join(format!("linkwork_eop_{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join("finals2000A.all"), finals(56_000)).unwrap();
    let files = Files::of(vec![folder.clone()]);
    // MJD 56001 is 2012-03-15.
    let p = WorldParams {
        turns: Some(Turning::Iau),
        epoch: Some("2012-03-15 00:00:00 UTC".into()),
        orientation: Some("finals2000A.all".into()),
        ..WorldParams::of(Centre::Earth)
    };
    let by_day = p.planet(&files).unwrap();
    let arcsec = std::f64::consts::TAU / 1_296_000.0;
    let written = WorldParams {
        orientation: None,
        dut1: -0.301,
        pole: [0.101 * arcsec, 0.2 * arcsec],
        ..p.clone()
    };
    let still = written.planet(&files).unwrap();
    // At midnight, the two differ by dX and dY, 0.22 mas. A day later they also differ by a
    // millisecond of UT1.
    let apart = |t: f64| by_day.rotation.at(t).R_IP.angle_to(&still.rotation.at(t).R_IP);
    assert!((apart(0.0) - 0.2236e-3 * arcsec).abs() < 1e-5 * arcsec, "{}", apart(0.0) / arcsec);
    assert!((apart(86_400.0) - 1e-3 * 7.2921e-5).abs() < 0.1e-7, "{}", apart(86_400.0));

    let refused = |p: WorldParams, fact: &str| {
        let e = p.planet(&files).err().unwrap();
        assert!(e.message.contains(fact) && e.help.is_some(), "{}", e.message);
    };
    refused(WorldParams { dut1: 0.1, ..p.clone() }, "`dut1` or `pole` is written in addition");
    refused(WorldParams { turns: Some(Turning::Fixed), ..p.clone() }, "requires the Earth");
    refused(WorldParams { body: Centre::Mars, ..p.clone() }, "requires the Earth");
    refused(WorldParams { span: 1e6, ..p.clone() }, "covers 2012-03-14");
    let early = Some("2011-03-15 00:00:00 UTC".to_string());
    refused(WorldParams { epoch: early, ..p.clone() }, "but 2011-03-15");
    refused(WorldParams { orientation: Some("finals.txt".into()), ..p }, "finals.txt");
    std::fs::remove_dir_all(folder).unwrap();
}

/// A world with a binary kernel, which covers 18 days from 2019-03-02 12:00 TDB.
#[test]
fn a_body_turns_by_a_binary_kernel() {
    let data = concat!(env!("CARGO_MANIFEST_DIR"), "/../../framework/world/tests/data/pck");
    let files = Files::of(vec![data.into()]);
    let p = |epoch: &str, naif| WorldParams {
        turns: Some(Turning::Iau),
        epoch: Some(epoch.into()),
        constants: Some("rotations.bpc".into()),
        naif: Some(naif),
        ..WorldParams::of(Centre::Moon)
    };
    let world = PlanetWorld::build(p("2019-03-03 00:00:00 TDB", 31001), &files).unwrap();
    // The angle about the pole has a rate of 2.66e-6 rad/s and small periodic terms.
    assert!((world.planet.rotation.at(0.0).omega_P().z - 2.66e-6).abs() < 3e-8);
    let day = 86_400.0;
    assert!(world.failure(17.4 * day).is_none() && world.failure(-0.4 * day).is_none());
    let error = world.failure(17.6 * day).unwrap();
    assert!(error.message.contains("`rotations.bpc` has the rotation"), "{}", error.message);
    assert!(world.planet_rate(17.6 * day).x.is_nan());
    for (epoch, naif, part) in [
        ("2019-04-03 00:00:00 TDB", 31001, "but not at 2019-04-02T23"),
        ("2019-03-03 00:00:00 TDB", 499, "has no rotation of body 499"),
    ] {
        let message = p(epoch, naif).planet(&files).err().unwrap().message;
        assert!(message.contains(part), "{part}: {message}");
    }
}

#[test]
fn mistakes_have_fact_and_remedy() {
    let iau = WorldParams { turns: Some(Turning::Iau), ..WorldParams::of(Centre::Earth) };
    let e = refused(&iau);
    assert!(e.message.contains("needs an epoch") && e.help.unwrap().contains("epoch: "));
    let e = refused(&WorldParams { epoch: Some("noon".into()), ..iau.clone() });
    assert!(e.message.contains("`noon` is not an epoch") && e.help.unwrap().contains("UTC"));
    let date = Some("2012-08-06 05:17:57 UTC".to_string());
    let e = refused(&WorldParams { epoch: date.clone(), pole: [0.3, 0.2], ..iau.clone() });
    assert!(e.message.contains("pole"), "arc seconds taken for radians: {}", e.message);
    let e = refused(&WorldParams { epoch: date, rate: Some(1e-4), ..iau });
    assert!(e.message.contains("`rate`") && e.help.unwrap().contains("fixed"));
}

fn built(p: WorldParams) -> PlanetWorld {
    PlanetWorld::build(p, &Files::default()).map_err(|e| e.message).unwrap()
}

#[test]
fn a_world_with_a_date_turns_by_it() {
    let date = Some("2024-06-21 00:00:00 UTC".to_string());
    let dated = WorldParams { epoch: date.clone(), ..WorldParams::of(Centre::Earth) };
    // Greenwich sidereal time of that midnight is 269.4 degrees.
    let meridian = built(dated.clone()).planet_axes(0.0) * Vec3::x();
    let angle = meridian.y.atan2(meridian.x).to_degrees().rem_euclid(360.0);
    assert!((angle - 269.4).abs() < 0.4, "{angle}");
    let e = refused(&WorldParams { turns: Some(Turning::Fixed), ..dated.clone() });
    assert!(e.message.contains("prime meridian") && e.help.unwrap().contains("iau"));
    let known = WorldParams { turns: Some(Turning::Fixed), angle: Some(0.2), ..dated.clone() };
    assert!(known.planet(&Files::default()).is_ok());
    let e = refused(&WorldParams { angle: Some(0.2), ..dated });
    assert!(e.message.contains("`angle` is written"), "{}", e.message);
}

#[test]
fn another_body_has_all_of_its_numbers_written() {
    let other = WorldParams::of(Centre::Other);
    assert!(refused(&other).message.contains("`radius`"));
    let sized = WorldParams { radius: Some(242.0), ..other };
    assert!(refused(&sized).message.contains("`rate`"));
    let turns = WorldParams { rate: Some(4e-4), ..sized };
    let world = built(turns.clone());
    assert!(world.mu().is_none() && world.needs_mu().err().unwrap().help.is_some());
    assert_eq!((world.radius(), world.flattening(), world.body()), (242.0, 0.0, "other"));
    let dated = WorldParams {
        epoch: Some("2024-06-21 00:00:00 UTC".into()),
        angle: Some(0.0),
        shadows: Some(vec![Third::Earth]),
        ..turns
    };
    let e = PlanetWorld::build(dated, &Files::default()).err().unwrap();
    assert!(e.param.as_deref() == Some("shadows") && e.help.is_some(), "{}", e.message);
}

/// 160 km over the north pole of the ICRF at the Moon in the total eclipse of 14 March 2025: 0.29 of the Sun is visible at 6:00 UTC
/// (tudat's issue 655, from JPL's ephemeris), and it is hidden an hour later.
#[test]
fn the_earth_hides_the_sun_from_the_moon() {
    let moon = |shadows| WorldParams {
        epoch: Some("2025-03-14 06:00:00 UTC".into()),
        shadows,
        ..WorldParams::of(Centre::Moon)
    };
    let (world, alone) = (built(moon(None)), built(moon(Some(vec![]))));
    // The neighbours' ephemerides are loaded only when light is needed, because a world without a
    // Sun does not need them.
    assert!(world.needs_light().is_ok() && alone.needs_light().is_ok());
    let course = world.heavens("").unwrap().course(Body::Sun, "").unwrap();
    let at = |world: &PlanetWorld, minute: f64| {
        let t = 60.0 * minute;
        let sun = course.at(t);
        world.light(t, &(Vec3::z() * 1.9e6), &sun)
    };
    let seen = [-120.0, 0.0, 10.0, 58.0].map(|m| at(&world, m).visible);
    assert!(seen[0] == 1.0 && (seen[1] - 0.29).abs() < 0.02, "{seen:?}");
    assert!(seen[2] < seen[1] && seen[3] == 0.0, "{seen:?}");
    let light = at(&world, 58.0);
    assert!(light.penumbra < 0.0 && light.umbra < 0.0 && (light.irradiance - 1374.0).abs() < 5.0);
    assert_eq!(at(&alone, 58.0).visible, 1.0);
}

/// The central body's shadow is Montenbruck's cone; on a site and on level ground the horizon hides the Sun, half of it when its middle is there.
#[test]
fn bodies_and_horizons_hide_the_sun() {
    use linkwork_world::eclipse::visible_fraction;
    use linkwork_world::planet::{AU, RADIUS_SUN};
    let earth = built(WorldParams::of(Centre::Earth));
    let sun = Vec3::x() * AU;
    for y in [0.0, 6.2e6, 6.36e6, 6.378e6, 6.41e6, 7e6] {
        let r = Vec3::new(-7e6, y, 0.0);
        let want = visible_fraction(&r, &sun, 6_378_137.0, RADIUS_SUN);
        assert!((earth.light(0.0, &r, &sun).visible - want).abs() < 1e-12, "{y}");
    }
    let before = earth.light(0.0, &(Vec3::x() * 7e6), &sun);
    assert_eq!(before.visible, 1.0);
    assert!((before.irradiance / SOLAR_CONSTANT - 1.0 - 1.4e7 / AU).abs() < 1e-8);
    for turning in [true, false] {
        let site = Some(SiteParams { turning, ..HERE });
        let world = built(WorldParams { site, ..WorldParams::of(Centre::Mars) });
        assert_eq!(matches!(world.axes(), Axes::Level(_)), !turning);
        let at = |elevation: f64| {
            let (sin, cos) = elevation.sin_cos();
            world.light(0.0, &Vec3::zeros(), &(Vec3::new(cos, 0.0, sin) * (1.5 * AU)))
        };
        assert_eq!((at(0.01).visible, at(-0.01).visible), (1.0, 0.0));
        assert!((at(0.0).visible - 0.5).abs() < 5e-3, "{}", at(0.0).visible);
        assert!(at(0.01).penumbra > 0.0 && at(-0.01).umbra < 0.0);
    }
}

/// Mars by a text kernel with the constants that are built in, and a body that only the kernel has.
#[test]
fn a_body_turns_by_a_kernel_of_constants() {
    let folder = std::env::temp_dir().join(format!("linkwork_pck_{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let text = "\\begindata\nBODY499_POLE_RA = (317.68143 -0.1061)\nBODY499_POLE_DEC = (52.88650 -0.0609)\nBODY499_PM = (176.630 350.89198226)\n\
        BODY2000001_POLE_RA = (291.418)\nBODY2000001_POLE_DEC = (66.764)\nBODY2000001_PM = (170.65 952.1532)\nBODY2000001_RADII = (487.3 487.3 446.0)\n\\begintext\n";
    std::fs::write(folder.join("c.tpc"), text).unwrap();
    let files = Files::of(vec![folder.clone()]);
    let p = |body, naif| WorldParams {
        turns: Some(Turning::Iau),
        epoch: Some("2012-08-06 05:17:57 UTC".into()),
        constants: Some("c.tpc".into()),
        naif,
        ..WorldParams::of(body)
    };
    let own = WorldParams { constants: None, ..p(Centre::Mars, None) }.planet(&files).unwrap();
    let mars = p(Centre::Mars, Some(499)).planet(&files).unwrap();
    for t in [0.0, 1e6] {
        assert!(mars.rotation.at(t).R_IP.angle_to(&own.rotation.at(t).R_IP) < 1e-15);
    }
    let ceres = p(Centre::Other, Some(2_000_001)).planet(&files).unwrap();
    assert_eq!(ceres.ellipsoid.equatorial_radius(), 487_300.0);
    // Ceres rotates by 952.1532 degrees per day.
    let rate = ceres.rotation.at(0.0).omega_P().z;
    assert!((rate - 952.1532_f64.to_radians() / 86_400.0).abs() < 1e-15, "{rate}");
    for (p, part) in [
        (p(Centre::Mars, None), "must be written together"),
        (p(Centre::Earth, Some(499)), "does not use it"),
        (p(Centre::Mars, Some(7)), "BODY7_POLE_RA is missing"),
    ] {
        let message = p.planet(&files).err().unwrap().message;
        assert!(message.contains(part), "{part}: {message}");
    }
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn the_orientation_of_the_earth_belongs_to_the_earth() {
    let files = Files::default();
    let epoch = Some("2025-01-01 00:00:00 UTC".to_string());
    let of = |body: Centre, turns: Option<Turning>| {
        let angle = (turns == Some(Turning::Fixed)).then_some(0.3);
        WorldParams { turns, angle, epoch: epoch.clone(), ..WorldParams::of(body) }
    };
    assert!(WorldParams { dut1: 0.3, ..of(Centre::Earth, None) }.planet(&files).is_ok());
    for (p, param) in [
        (WorldParams { dut1: 0.3, ..of(Centre::Mars, None) }, "dut1"),
        (WorldParams { dut1: 0.3, ..of(Centre::Earth, Some(Turning::Fixed)) }, "dut1"),
        (WorldParams { dut1: 0.3, ..WorldParams::of(Centre::Earth) }, "dut1"),
        (WorldParams { pole: [1e-6, 0.0], ..of(Centre::Moon, None) }, "pole"),
        (WorldParams { span: 1e6, ..WorldParams::of(Centre::Earth) }, "span"),
    ] {
        let e = p.planet(&files).err().unwrap();
        assert!(e.param.as_deref() == Some(param) && e.help.is_some(), "{param}: {e:?}");
    }
}
