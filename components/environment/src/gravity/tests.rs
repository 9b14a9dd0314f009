//! Harmonics, third bodies, tides, zonal fields: closed forms, sites, gradients, mistakes.

use super::*;
use crate::world::Centre;
use crate::world::{SiteParams, handle};

/// A lopsided field up to degree and order 3, in Basilisk's layout.
const FIELD: &str = "\
6378136.3, 3.986004415e14, 7.2921150E-5, 3, 3, 1, 0.0, 0.0
0, 0, 1.0, 0.0, 0.0, 0.0
1, 0, 0.0, 0.0, 0.0, 0.0
1, 1, 0.0, 0.0, 0.0, 0.0
2, 0, -4.8416e-04, 0.0, 0.0, 0.0
2, 1, -2.0e-10, 1.38e-09, 0.0, 0.0
2, 2, 2.4e-05, -1.4e-05, 0.0, 0.0
3, 0, 9.57e-07, 0.0, 0.0, 0.0
3, 1, 2.03e-05, 2.48e-06, 0.0, 0.0
3, 2, 9.04e-06, -6.19e-06, 0.0, 0.0
3, 3, 7.21e-06, 1.41e-05, 0.0, 0.0
";

fn earth() -> WorldParams {
    WorldParams { angle: Some(0.7), ..WorldParams::of(Centre::Earth) }
}

fn params() -> HarmonicsParams {
    HarmonicsParams {
        file: "field.txt".into(),
        format: FieldFormat::Basilisk,
        degree: 3,
        order: None,
        axes: None,
        tide_system: None,
        world: handle(earth()),
        third_bodies: vec![],
        fields: vec![],
        love: 0.0,
    }
}

fn built(p: &HarmonicsParams, text: &str) -> Result<SphericalHarmonics, BuildError> {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("field.txt"), text).unwrap();
    SphericalHarmonics::build(p.clone(), &Files::of(vec![dir.path().to_path_buf()]))
}

const P: Vec3 = Vec3::new(-4_292_653.41, 955_168.47, 5_139_356.57);

#[test]
fn the_field_turns_with_the_planet() {
    let turning = built(&params(), FIELD).unwrap();
    let (t, rate) = (4321.0, Centre::Earth.rate().unwrap());
    let still = HarmonicsParams {
        world: handle(WorldParams {
            turns: Some(Turning::Still),
            angle: Some(0.7 + rate * t),
            ..earth()
        }),
        ..params()
    };
    let still = built(&still, FIELD).unwrap();
    let (a, b) = (turning.acceleration(t, P), still.acceleration(0.0, P));
    assert!((a - b).norm() < 1e-14, "{a} {b}");
    assert!((a - turning.acceleration(0.0, P)).norm() > 1e-4, "the turning matters");
    assert!(turning.uniform().is_none());
}

#[test]
fn degree_and_order_cut_and_zonals_agree_with_the_closed_form() {
    let p = HarmonicsParams { order: Some(0), ..params() };
    let cut = built(&p, FIELD).unwrap().acceleration(100.0, P);
    let (root5, root7) = (5f64.sqrt(), 7f64.sqrt());
    let j = ZonalParams {
        radius: Some(6_378_136.3),
        j2: 4.8416e-4 * root5,
        j3: -9.57e-7 * root7,
        j4: 0.0,
        world: handle(WorldParams { mu: Some(3.986004415e14), ..earth() }),
    };
    let closed = ZonalGravity::build(j, &Files::default()).unwrap();
    let want = closed.acceleration(0.0, P);
    assert!((cut - want).norm() < 1e-14 * want.norm() * 10.0, "{cut} {want}");
    // The acceleration is also the gradient of the potential, including J₄.
    let field = ZonalGravity::build(oblate(earth()), &Files::default()).unwrap();
    let v = |p: Vec3| {
        let (r, u) = (p.norm(), p.z / p.norm());
        let p2 = (3.0 * u * u - 1.0) / 2.0;
        let p3 = (5.0 * u.powi(3) - 3.0 * u) / 2.0;
        let p4 = (35.0 * u.powi(4) - 30.0 * u * u + 3.0) / 8.0;
        let k = 6.4e6 / r;
        4e14 / r * (1.0 - 1e-3 * k * k * p2 + 2e-3 * k.powi(3) * p3 - 3e-3 * k.powi(4) * p4)
    };
    for k in 0..3 {
        let mut e = Vec3::zeros();
        e[k] = 50.0;
        let slope = (v(P + e) - v(P - e)) / 100.0;
        assert!((field.acceleration(0.0, P)[k] - slope).abs() < 1e-8, "{k}");
    }
}

/// Zonal harmonics up to J₄ of a body of 4e14 m³/s² and 6400 km.
fn oblate(world: WorldParams) -> ZonalParams {
    let world = handle(WorldParams { mu: Some(4e14), ..world });
    ZonalParams { radius: Some(6.4e6), j2: 1e-3, j3: -2e-3, j4: 3e-3, world }
}

fn dated() -> WorldParams {
    let epoch = Some("2012-08-06 00:00:00 UTC".to_string());
    WorldParams {
        epoch,
        span: 3600.0,
        turns: Some(Turning::Fixed),
        angle: Some(0.0),
        ..WorldParams::of(Centre::Earth)
    }
}

/// By the IAU, in the axes of the ICRF.
fn by_iau() -> WorldParams {
    WorldParams { turns: None, angle: None, ..dated() }
}

fn with_sun_and_moon() -> HarmonicsParams {
    let world = handle(dated());
    HarmonicsParams { world, third_bodies: vec![Third::Sun, Third::Moon], ..params() }
}

#[test]
fn third_bodies_raise_a_tide_and_go_on_beyond_their_table() {
    let g = built(&with_sun_and_moon(), FIELD).unwrap();
    // Compare Sun and Moon with the plain difference of two accelerations.
    for (k, third) in g.pullers.iter().enumerate() {
        let s = g.towards(third, 100.0);
        let plain =
            (s - P) * (third.mu / (s - P).norm().powi(3)) - s * (third.mu / s.norm().powi(3));
        let a = g.thirds(100.0, P).nth(k).unwrap();
        assert!((a - plain).norm() < 1e-12 && a.norm() > 1e-7, "{a} {plain}");
    }
    let sum = g.field(100.0, P) + g.thirds(100.0, P).sum::<Vec3>();
    assert!((g.acceleration(100.0, P) - sum).norm() < 1e-14);
    // The table ends after an hour. The position of the Moon must not jump there.
    let moon = &g.pullers[1];
    let (before, after) = (g.towards(moon, 3600.9), g.towards(moon, 3601.1));
    assert!((after - before).norm() < 300.0 && (before.norm() - 3.9e8).abs() < 4e7);
}

/// The greatest tide of the Moon on the Earth lifts a low orbit by some 1e-7 m/s²; it is there by its closed form, towards both
/// sides alike, and a rigid planet has none.
#[test]
fn the_planet_answers_to_who_pulls() {
    let rigid = built(&with_sun_and_moon(), FIELD).unwrap();
    let g = built(&HarmonicsParams { love: 0.3, ..with_sun_and_moon() }, FIELD).unwrap();
    let radius = g.love.1;
    assert!((radius - 6.378e6).abs() < 1e5, "{radius}");
    let sum = rigid.acceleration(100.0, P) + g.tide(100.0, P);
    assert!((g.acceleration(100.0, P) - sum).norm() < 1e-15);
    assert_eq!(rigid.tide(100.0, P), Vec3::zeros());
    // Under the Moon alone, the tide is −3 k₂ μ₃ R⁵/(s³ r⁴) along r̂. It points inwards, because the bulge
    // is nearer than the undeformed sphere.
    let moon = &g.pullers[1];
    let s = g.towards(moon, 100.0);
    let r = s.normalize() * 7e6;
    let own = |p: Vec3| solid_tide(0.3, radius, &TideRaiser { mu: moon.mu, position: s }, &p);
    let wanted = -0.3 * 3.0 * moon.mu * radius.powi(5) / (s.norm().powi(3) * 7e6f64.powi(4));
    assert!((own(r).dot(&r) / 7e6 / wanted - 1.0).abs() < 1e-12, "{}", own(r).dot(&r) / 7e6);
    assert!((own(r) + own(-r)).norm() < 1e-20);
    let both = g.tide(100.0, r).dot(&r) / 7e6;
    assert!((0.5..2.0).contains(&(both / wanted)), "{both} {wanted}");
    let e = built(&HarmonicsParams { love: 0.3, ..params() }, FIELD).err().unwrap();
    assert!(e.message.contains("`love` needs third bodies") && e.param.as_deref() == Some("love"));
}

#[test]
fn third_bodies_pull_and_raise_tides_alike_over_a_site() {
    let p = HarmonicsParams { love: 0.3, ..with_sun_and_moon() };
    let there = HarmonicsParams { world: handle(by_iau()), ..p };
    let here =
        SiteParams { latitude: 0.9, longitude: 2.9, height: 0.0, heading: 0.4, turning: true };
    let world = handle(WorldParams { site: Some(here), ..by_iau() });
    let (there, here) =
        (built(&there, FIELD), built(&HarmonicsParams { world, ..there.clone() }, FIELD));
    let (there, here) = (there.unwrap(), here.unwrap());
    let Axes::Site(site) = here.axes() else { panic!("no site") };
    for t in [0.0, 3000.0] {
        let R = site.to_inertial(t);
        let p = R.inverse() * P - site.relative_to_centre(&Vec3::zeros());
        let pulls = here.thirds(t, p).sum::<Vec3>() + here.tide(t, p);
        let want = there.thirds(t, P).sum::<Vec3>() + there.tide(t, P);
        assert!((R * pulls - want).norm() < 1e-10 * want.norm(), "{pulls} {want}");
        // The total acceleration without the centrifugal part agrees. The pole keeps its direction of the start.
        let whole = R * (here.acceleration(t, p) - site.centrifugal(&p));
        assert!((whole - there.acceleration(t, P)).norm() < 1e-9, "{t} s");
        assert!((here.scale(t, p) / there.scale(t, P) - 1.0).abs() < 1e-12);
    }
}

/// Each service: ∂a/∂p is the slope of its acceleration, in inertial axes and from a site, with all that pulls.
#[test]
fn gradients_are_slopes_of_the_acceleration() {
    use crate::fields::{PointMassGravity, PointMassGravityParams};
    let here =
        SiteParams { latitude: 0.9, longitude: 2.9, height: 4e5, heading: 0.4, turning: true };
    let tidal = HarmonicsParams { love: 0.3, world: handle(by_iau()), ..with_sun_and_moon() };
    let moon = ThirdField {
        body: Centre::Moon,
        file: "field.txt".into(),
        format: FieldFormat::Basilisk,
        degree: 3,
        order: None,
        axes: None,
    };
    let lopsided = HarmonicsParams { fields: vec![moon], ..tidal.clone() };
    let over = handle(WorldParams { site: Some(here), ..by_iau() });
    let at_site = HarmonicsParams { world: over, ..lopsided.clone() };
    let zonal = |world| ZonalGravity::build(oblate(world), &Files::default()).unwrap();
    let point = |world: WorldParams| {
        let world = handle(WorldParams { mu: Some(4e14), ..world });
        PointMassGravity::build(PointMassGravityParams { world }, &Files::default()).unwrap()
    };
    let [tidal, lopsided, at_site] = [tidal, lopsided, at_site].map(|p| built(&p, FIELD).unwrap());
    let fixed = WorldParams { site: Some(here), ..WorldParams::of(Centre::Earth) };
    let (leans, zonal, zonal_site) = (zonal(by_iau()), zonal(earth()), zonal(fixed.clone()));
    let (point, point_site) = (point(earth()), point(fixed));
    let beside_the_moon = lopsided.towards(&lopsided.pullers[1], 500.0) + Vec3::new(5e6, -7e6, 4e6);
    let near = Vec3::new(3e5, -2e5, 1e5);
    let all: [(&str, &dyn Gravity, Vec3); 9] = [
        ("tide", &tidal, P),
        ("harmonics", &lopsided, P),
        ("at the Moon", &lopsided, beside_the_moon),
        ("site", &at_site, near),
        ("zonal", &zonal, P),
        ("zonal by the IAU", &leans, P),
        ("zonal site", &zonal_site, near),
        ("point", &point, P),
        ("point site", &point_site, near),
    ];
    for (name, field, p) in all {
        let g = field.gradient(500.0, p).unwrap();
        for k in 0..3 {
            let a = |s: f64| field.acceleration(500.0, p + Vec3::ith(k, 500.0 * s));
            let slope = ((a(1.0) - a(-1.0)) * 8.0 - (a(2.0) - a(-2.0))) / 6000.0;
            let off = (g.column(k) - slope).norm() / g.norm();
            assert!(off < 1e-8, "{name} {k}: {off}");
        }
    }
    // The gradient includes the tide and the rotation.
    let rigid = built(&HarmonicsParams { love: 0.0, ..with_sun_and_moon() }, FIELD).unwrap();
    assert!(rigid.gradient(0.0, P).is_some());
    let lean = |g: Mat3| (g - g.transpose()).norm() / g.norm();
    assert!(lean(at_site.gradient(0.0, near).unwrap()) < 1e-12);
    let turning = 2.0 * Centre::Earth.rate().unwrap().powi(2);
    let trace = point_site.gradient(0.0, near).unwrap().trace();
    assert!((trace / turning - 1.0).abs() < 1e-6, "{trace}");
}

#[test]
fn mistakes_have_place_fact_and_remedy() {
    let told = |p: &HarmonicsParams, text: &str| {
        let e = built(p, text).err().unwrap();
        (e.message.clone(), e.help.clone().unwrap(), e.param.clone().unwrap())
    };
    let (fact, _, param) = told(&params(), &FIELD.replace("2.4e-05", "?"));
    assert!(fact.contains("field.txt:7") && fact.contains('?') && param == "file", "{fact}");
    let (fact, _, _) = told(&params(), FIELD.rsplit_once("3, 3").unwrap().0);
    assert!(fact.contains("has 3 of its 4 orders"), "{fact}");
    let (fact, help, _) = told(&HarmonicsParams { degree: 4, ..params() }, FIELD);
    assert!(fact.contains("degree 3, not 4") && help.contains("use a lower degree"), "{fact}");
    let (fact, _, param) = told(&HarmonicsParams { order: Some(4), ..params() }, FIELD);
    assert!(fact.contains("order 4") && param == "order", "{fact}");
    let (fact, _, _) = told(&HarmonicsParams { file: "none.txt".into(), ..params() }, FIELD);
    assert!(fact.contains("none.txt"));
    let sun = HarmonicsParams { third_bodies: vec![Third::Sun], ..params() };
    let e = built(&sun, FIELD).err().unwrap();
    assert!(e.message.contains("a third body needs an epoch"), "{}", e.message);
    // The world must have the same body and the same gravity parameter as the field.
    for (world, words) in [
        (WorldParams::of(Centre::Moon), "`body` of `world` is `moon`"),
        (WorldParams { mu: Some(3.986e14), ..earth() }, "`mu` of `world`"),
    ] {
        let (fact, _, param) = told(&HarmonicsParams { world: handle(world), ..params() }, FIELD);
        assert!(fact.contains(words) && param == "file", "{fact}");
    }
    for (thirds, words) in [
        (vec![Third::Earth], "is the planet itself"),
        (vec![Third::Moon, Third::Moon], "is named twice"),
    ] {
        let p = HarmonicsParams { world: handle(dated()), third_bodies: thirds, ..params() };
        let (fact, _, param) = told(&p, FIELD);
        assert!(fact.contains(words) && param == "third_bodies", "{fact}");
    }
}

/// Over its `scale` a field changes by its own size at most: what is small against it may be taken as a whole.
#[test]
fn no_field_changes_faster_than_its_scale_says() {
    let series = built(&with_sun_and_moon(), FIELD).unwrap();
    let beside_the_moon = series.towards(&series.pullers[1], 0.0) + Vec3::new(3e6, -2e6, 4e6);
    let zonal = ZonalGravity::build(oblate(earth()), &Files::default()).unwrap();
    let rates = |field: &dyn Gravity, p: Vec3| {
        let change = |e: Vec3| {
            let g = |side: f64| field.acceleration(0.0, p + e * (100.0 * side));
            (g(1.0) - g(-1.0)).norm() / 200.0
        };
        let rate = (0..3).map(|k| change(Vec3::ith(k, 1.0))).fold(change(p.normalize()), f64::max);
        rate * field.scale(0.0, p) / field.acceleration(0.0, p).norm()
    };
    for p in [P, P * 3.0, Vec3::z() * 6.5e6, beside_the_moon] {
        for (name, field) in [("series", &series as &dyn Gravity), ("zonal", &zonal)] {
            let part = rates(field, p);
            assert!((0.01..=1.001).contains(&part), "{name} at {p}: {part}");
        }
    }
}

/// Oblateness is about the planet's own pole, however it stands in W: the zonal field is that of the harmonics of degree 2.
#[test]
fn a_zonal_field_leans_with_its_planet() {
    let (root5, radius) = (5f64.sqrt(), 6_378_136.3);
    let zonal = ZonalParams {
        radius: Some(radius),
        j2: 4.8416e-4 * root5,
        j3: 0.0,
        j4: 0.0,
        world: handle(WorldParams { mu: Some(3.986004415e14), ..by_iau() }),
    };
    let zonal = ZonalGravity::build(zonal, &Files::default()).unwrap();
    let series = HarmonicsParams { degree: 2, order: Some(0), world: handle(by_iau()), ..params() };
    let series = built(&series, FIELD).unwrap();
    let (a, b) = (zonal.acceleration(700.0, P), series.acceleration(700.0, P));
    assert!((a - b).norm() < 1e-13 * b.norm(), "{a} {b}");
    let about_z = ZonalGravity::build(oblate(earth()), &Files::default()).unwrap();
    let leans = ZonalGravity::build(oblate(by_iau()), &Files::default()).unwrap();
    assert!((about_z.acceleration(0.0, P) - leans.acceleration(0.0, P)).norm() > 1e-6);
}

/// IERS Conventions 2010, eq. 6.14 (k₂ = 0.3): a zero-tide field with the solid tide is the tide-free one with it, and a mean-tide field has the
/// attraction of Sun and Moon in it, which they bring along.
#[test]
fn the_permanent_tide_is_there_once() {
    let mean = 4.4228e-8 * -0.31460;
    let with = |c20: f64, tide_system, love| {
        let text = FIELD.replace("-4.8416e-04", &format!("{c20:.16e}"));
        let p = HarmonicsParams { love, tide_system, ..with_sun_and_moon() };
        built(&p, &text).unwrap().acceleration(100.0, P)
    };
    let free = -4.8416e-4;
    let wanted = with(free, None, 0.3);
    let zero = with(free + 0.3 * mean, Some(Permanent::ZeroTide), 0.3);
    let all = with(free + 1.3 * mean, Some(Permanent::MeanTide), 0.3);
    let twice = with(free + 0.3 * mean, None, 0.3);
    assert!((zero - wanted).norm() < 1e-11, "{}", zero - wanted);
    assert!((all - wanted).norm() < 1e-10, "{}", all - wanted);
    assert!((twice - wanted).norm() > 1e-8, "{}", twice - wanted);
    // A rigid body keeps the deformation of the file.
    let rigid = with(free, Some(Permanent::ZeroTide), 0.0);
    assert_eq!(rigid, with(free, None, 0.0));
    // This file states its tide system itself.
    let gfc = "earth_gravity_constant 3.986004415e14\nradius 6378136.3\nmax_degree 2\ntide_system zero_tide\nend_of_head\ngfc 2 0 -4.8416e-4 0\n";
    let read = |text: &str| {
        let format = FieldFormat::Icgem;
        let p = HarmonicsParams { love: 0.3, format, degree: 2, ..with_sun_and_moon() };
        built(&p, text).unwrap().acceleration(100.0, P)
    };
    let off = read(gfc) - read(&gfc.replace("zero_tide", "tide_free"));
    assert!(off.norm() > 1e-8 && off.norm() < 1e-6, "{off}");
}

/// Oblateness about the Moon's principal pole, which leans by 78.56″ (DE421, by NAIF's frame kernel of it) from that of the IAU, and the field's prime meridian is 67.92″ east.
#[test]
fn fields_of_the_moon_are_in_principal_axes() {
    let epoch = Some("2012-03-01 00:00:00 UTC".to_string());
    let moon = WorldParams { epoch, ..WorldParams::of(Centre::Moon) };
    let gfc = |rest: &str| {
        format!(
            "gravity_constant 4.9028e12\nradius 1738000\nmax_degree 2\nend_of_head\ngfc 2 0 -9e-5 0\n{rest}"
        )
    };
    let at = |axes, text: &str| {
        let world = handle(moon.clone());
        let format = FieldFormat::Icgem;
        built(&HarmonicsParams { axes, world, format, degree: 2, ..params() }, text).unwrap()
    };
    let arcsec = std::f64::consts::PI / 648_000.0;
    let (sin, cos) = (78.56 * arcsec).sin_cos();
    let R = handle(moon.clone()).planet_axes(0.0);
    // Compute the acceleration perpendicular to the radius. It is zero at the pole, and 3 J₂ (R/r)² of the weight per
    // radian of distance from it.
    let aside = |axes, pole: Vec3| {
        let p = R * pole * 1.838e6;
        let a = at(axes, &gfc("")).acceleration(0.0, p);
        a.cross(&p).norm() / (a.norm() * p.norm())
    };
    let (principal, mean) = (Vec3::new(sin, 0.0, cos), Vec3::z());
    assert!(aside(None, principal) < 1e-9 && aside(Some(FieldAxes::Rotation), mean) < 1e-12);
    let lean = 3.0 * 9e-5 * 5f64.sqrt() * (1.738f64 / 1.838).powi(2) * 78.56 * arcsec;
    assert!((aside(None, mean) / lean - 1.0).abs() < 0.01, "{} {lean}", aside(None, mean));
    // The long axis of C₂₂ is 67.92″ east of the mean-Earth meridian.
    let text = gfc("gfc 2 1 0 0\ngfc 2 2 3.5e-5 0\n");
    let along = |longitude: f64| {
        let p = R * Vec3::new(longitude.cos(), longitude.sin(), 0.0) * 1.838e6;
        at(None, &text).acceleration(0.0, p).cross(&p).dot(&(R * Vec3::z()))
    };
    let (west, east) = (along(0.0), along(2.0 * 67.92 * arcsec));
    assert!((west / east + 1.0).abs() < 0.01, "{west} {east}");
    let e = |p: HarmonicsParams| built(&p, FIELD).err().unwrap();
    let wrong = e(HarmonicsParams { axes: Some(FieldAxes::Principal), ..params() });
    assert!(wrong.param.as_deref() == Some("axes") && wrong.help.is_some(), "{}", wrong.message);
}
