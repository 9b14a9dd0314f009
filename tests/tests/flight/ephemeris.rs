//! Sun and Moon of a simulation from an SPK kernel that the test writes.
use super::kernel::{Segment, kernel};
use crate::common::{self, get, scene, seconds};
use linkwork_spatial::Vec3;
use linkwork_world::gravity::{third_body, zonal};
use linkwork_world::orbit::propagate;
use linkwork_world::planet::{AU, Epoch, MU_EARTH, MU_MOON, MU_SUN, PointMotion};

const MU: f64 = 3.986004415e14;
const RADIUS: f64 = 6_378_136.3;
/// Positions of the bodies relative to the kernel's barycentre, m, chosen to differ from every ephemeris.
const SUN: Vec3 = Vec3::new(0.6e11, -1.2e11, 0.4e11);
const MOON: Vec3 = Vec3::new(3.0e8, 2.0e8, -1.0e8);
const EARTH: Vec3 = Vec3::new(-4e6, 1e6, 2e6);

fn moon(t: f64) -> Vec3 {
    MOON + Vec3::new(-500.0, 700.0, 100.0) * t
}

/// Coefficients in Basilisk's layout: a point mass, or an asymmetric field of degree 2.
fn coefficients(mu: f64, radius: f64, lopsided: bool) -> String {
    let (c20, c21, c22) = if lopsided { (-9e-5, 4e-6, 3.5e-5) } else { (0.0, 0.0, 0.0) };
    let s22 = -0.4 * c22;
    format!(
        "{radius:?}, {mu:?}, 7.29e-5, 2, 2, 1, 0.0, 0.0\n0, 0, 1.0, 0.0, 0.0, 0.0\n1, 0, 0.0, 0.0, 0.0, 0.0\n1, 1, 0.0, 0.0, 0.0, 0.0\n2, 0, {c20:?}, 0.0, 0.0, 0.0\n2, 1, {c21:?}, 0.0, 0.0, 0.0\n2, 2, {c22:?}, {s22:?}, 0.0, 0.0\n"
    )
}

/// A flight past the Moon, whose rotating field has degree 2, with the Earth as the other central body: integration about the Earth gives the same
/// flight as about the Moon. The kernel moves both on Kepler's ellipse, as both equations of motion assume, near J2000, where its seconds resolve
/// nanometres: in 2027 a double resolves only 0.1 µs, in which the Moon moves 0.1 mm.
#[test]
fn a_flight_past_the_moon_is_the_same_about_the_earth_and_about_the_moon() {
    let epoch = "2000-01-02 00:00:00 TDB";
    let folder = tempfile::tempdir().unwrap();
    let (days, part) = Epoch::parse(epoch).unwrap().tdb_days();
    let start = days * 86_400.0 + part * 86_400.0;
    let begin = PointMotion {
        position: Vec3::new(3.1e8, 2.1e8, -0.9e8),
        velocity: Vec3::new(-560.0, 750.0, 320.0),
    };
    let moon = |t: f64| propagate(MU_EARTH + MU_MOON, &begin, t).unwrap();
    let path = |et: f64| {
        let m = moon(et - start);
        [m.position.into(), m.velocity.into()]
    };
    let one =
        |kind| Segment { target: 301, centre: 399, kind, start, days: 1.0, count: 3, path: &path };
    std::fs::write(folder.path().join("two.bsp"), kernel(&[one(2)], false)).unwrap();
    let file = |name: &str| format!("{:?}", folder.path().join(name).display().to_string());
    std::fs::write(folder.path().join("earth.txt"), coefficients(MU_EARTH, RADIUS, false)).unwrap();
    std::fs::write(folder.path().join("moon.txt"), coefficients(MU_MOON, 1.738e6, true)).unwrap();
    // The start is 40 000 km from the Moon, and the craft passes within 14 000 km of its centre.
    let from_moon = PointMotion {
        position: Vec3::new(3.4e7, -2.0e7, 4.0e6),
        velocity: Vec3::new(-1180.0, 1500.0, -60.0),
    };
    let fly = |centre: &str, third: &str, start: &PointMotion, fields: &str| {
        let (p, v) = (start.position, start.velocity);
        let text = format!(
            r#"Simulation(
    bodies: {{ "craft": (parent: "world", hinge: Free, mass: 100, inertia: [10, 10, 10], initial: (position: [{:?}, {:?}, {:?}], velocity: [{:?}, {:?}, {:?}])) }},
    parts: {{
        "Gravity": (model: "environment.spherical_harmonics", params: {{ "file": {}, "format": basilisk, "degree": 2, "third_bodies": ["{third}"], "fields": [{fields}] }}),
    }},
    world: (body: "{centre}", turns: "iau", epoch: "{epoch}", span: "2 day", kernel: {}),
    step: "200 s", integrator: "verner_87", until: "60000 s",
)"#,
            p.x,
            p.y,
            p.z,
            v.x,
            v.y,
            v.z,
            file(&format!("{centre}.txt")),
            file("two.bsp"),
        );
        scene(&text, &[]).unwrap()
    };
    let m = moon(0.0);
    let from_earth = PointMotion {
        position: m.position + from_moon.position,
        velocity: m.velocity + from_moon.velocity,
    };
    let field =
        format!("(body: \"moon\", file: {}, format: basilisk, degree: 2)", file("moon.txt"));
    let mut about_earth = fly("earth", "moon", &from_earth, &field);
    let mut point_moon = fly("earth", "moon", &from_earth, "");
    let mut about_moon = fly("moon", "earth", &from_moon, "");
    let (mut worst, mut nearest, mut shape) = (common::Worst(0.0), f64::INFINITY, 0.0_f64);
    for k in 1..=150 {
        let t = 400.0 * f64::from(k);
        for sim in [&mut about_earth, &mut about_moon, &mut point_moon] {
            sim.run_until(seconds(t)).unwrap();
        }
        let (a, b) = (get(&about_earth, "craft.position"), get(&about_moon, "craft.position"));
        let s = moon(t).position;
        worst.take((a - (s + b)).norm());
        nearest = nearest.min(b.norm());
        shape = shape.max((a - get(&point_moon, "craft.position")).norm());
    }
    println!(
        "{:.1e} m apart, {nearest:.3e} m from the Moon; its shape is worth {shape:.1e} m",
        worst.0
    );
    assert!(nearest > 1e7 && nearest < 2e7 && shape > 1.0);
    worst.below(2e-6, "position, m");
    // A body that cannot be a central body here is rejected.
    let twice = text_with_fields(&format!("{field}, {field}"), &file("earth.txt"), epoch);
    for (text, fact) in [
        (
            twice,
            "`fields` has an entry for `moon`, which is not a third body here, or has two entries",
        ),
        (
            text_with_fields(&field.replace("moon", "mars"), &file("earth.txt"), epoch),
            "`fields` has an entry for `mars`",
        ),
        (
            text_with_fields(&field.replace("degree: 2", "degree: 3"), &file("earth.txt"), epoch),
            "degree 2, not 3",
        ),
    ] {
        let told = scene(&text, &[]).err().unwrap();
        assert!(told.contains("`Gravity.fields`") && told.contains(fact), "{told}");
    }
}

fn text_with_fields(fields: &str, file: &str, epoch: &str) -> String {
    format!(
        r#"Simulation(
    bodies: {{ "craft": (parent: "world", hinge: Free, mass: 100, inertia: [10, 10, 10], initial: (position: [7e6, 0, 0])) }},
    parts: {{
        "Gravity": (model: "environment.spherical_harmonics", params: {{ "file": {file}, "format": basilisk, "degree": 2, "third_bodies": ["moon"], "fields": [{fields}] }}),
    }},
    world: (body: "earth", epoch: "{epoch}"),
    step: "1 s", until: "1 s",
)"#
    )
}

/// Writes a kernel of ten days from the epoch on; the Moon is covered only in the first six.
fn write(folder: &tempfile::TempDir, epoch: &str, with_moon: bool) {
    let (days, part) = Epoch::parse(epoch).unwrap().tdb_days();
    let start = days * 86_400.0 + part * 86_400.0;
    let still = |p: Vec3| move |_: f64| [p.into(), [0.0; 3]];
    let (sun, earth) = (still(SUN), still(EARTH));
    let moves = |t: f64| [moon(t - start).into(), [0.0; 3]];
    let one = |target, centre, count, path| Segment {
        target,
        centre,
        kind: 2,
        start,
        days: 2.0,
        count,
        path,
    };
    let mut list = vec![one(10, 0, 5, &sun as _), one(399, 3, 5, &earth as _)];
    let zero = still(Vec3::zeros());
    list.push(one(3, 0, 5, &zero as _));
    if with_moon {
        list.push(one(301, 3, 3, &moves as _));
    }
    std::fs::write(folder.path().join("made.bsp"), kernel(&list, false)).unwrap();
}

fn text(folder: &tempfile::TempDir, epoch: &str) -> String {
    let field = "6378136.3, 3.986004415e14, 7.29e-5, 2, 2, 1, 0.0, 0.0\n0, 0, 1.0, 0.0, 0.0, 0.0\n1, 0, 0.0, 0.0, 0.0, 0.0\n1, 1, 0.0, 0.0, 0.0, 0.0\n2, 0, -4.8e-4, 0.0, 0.0, 0.0\n2, 1, 0.0, 0.0, 0.0, 0.0\n2, 2, 0.0, 0.0, 0.0, 0.0\n";
    std::fs::write(folder.path().join("field.txt"), field).unwrap();
    let file = |name: &str| folder.path().join(name).display().to_string();
    format!(
        r#"Simulation(
    bodies: {{ "craft": (parent: "world", hinge: Free, mass: 100, inertia: [10, 10, 10], initial: (position: [2.4e8, 1.5e8, -0.7e8], velocity: [-400, 700, 100])) }},
    parts: {{
        "Gravity": (model: "environment.spherical_harmonics", params: {{ "file": {:?}, "format": basilisk, "degree": 2, "third_bodies": ["sun", "moon"] }}),
        "Sun": (model: "environment.ephemeris_sun"),
    }},
    world: "$planet",
    params: {{ "planet": (default: (body: "earth", turns: "still", epoch: "{epoch}", span: "1 day", kernel: {:?})) }},
    step: "1000 s", integrator: "verner_87", until: "800000 s",
)"#,
        file("field.txt"),
        file("made.bsp"),
    )
}

/// Past a Moon at an artificial position for its six days: one from the table, five from the kernel itself. The orbit agrees with Cowell's equation
/// with the same attraction, from another integrator.
#[test]
fn a_kernel_moves_sun_and_moon_and_the_run_stops_where_it_ends() {
    let epoch = "2150-03-01 12:00:00 UTC";
    let folder = tempfile::tempdir().unwrap();
    write(&folder, epoch, true);
    let mut sim = scene(&text(&folder, epoch), &[]).unwrap();
    let pull = |t: f64, r: Vec3| {
        let own = zonal(MU, RADIUS, &[4.8e-4 * 5f64.sqrt()], &r);
        own + third_body(MU_SUN, &r, &(SUN - EARTH)) + third_body(MU_MOON, &r, &(moon(t) - EARTH))
    };
    let (mut r, mut v, h) =
        (Vec3::new(2.4e8, 1.5e8, -0.7e8), Vec3::new(-400.0, 700.0, 100.0), 50.0);
    for k in 0..4000 {
        let t = f64::from(k) * h;
        // The reference uses the method of Runge, Kutta and Nyström.
        let k1 = pull(t, r);
        let k2 = pull(t + h / 2.0, r + v * (h / 2.0) + k1 * (h * h / 8.0));
        let k3 = pull(t + h, r + v * h + k2 * (h * h / 2.0));
        r += v * h + (k1 + k2 * 2.0) * (h * h / 6.0);
        v += (k1 + k2 * 4.0 + k3) * (h / 6.0);
    }
    sim.run_until(seconds(2e5)).unwrap();
    let off = (get(&sim, "craft.position") - r).norm();
    let near = (r - (moon(2e5) - EARTH)).norm();
    println!("{off:.1e} m apart; {near:.3e} m from the Moon");
    assert!(off < 1e-3, "{off}");
    let told = sim.run_until(seconds(8e5)).unwrap_err().to_string();
    // The data of six days end within a step of 1000 s.
    assert_eq!(sim.time(), 518_000.0, "{told}");
    for part in [
        "`Gravity`: the kernel `",
        "made.bsp` covers the Moon relative to the Earth from 2150-03-01T12:00:00",
        " to 2150-03-07T12:00:00",
        "after the epoch 2150-03-01T12:00:00",
    ] {
        assert!(told.contains(part), "{part}: {told}");
    }
}

#[test]
fn the_sun_stands_where_the_kernel_has_it_and_what_it_has_not_is_refused() {
    let epoch = "2012-08-06 00:00:00 UTC";
    let folder = tempfile::tempdir().unwrap();
    write(&folder, epoch, true);
    let text = text(&folder, epoch);
    let sim = scene(&text, &[]).unwrap();
    let sun = sim.plan().services.find::<dyn linkwork_surroundings::Sun>(None, "").unwrap();
    for t in [0.0, 5e5] {
        let s = sun.state(t);
        let want = SUN - EARTH;
        assert!((s.direction - want.normalize()).norm() < 1e-12, "{t}: {}", s.direction);
        assert!((s.distance_au / (want.norm() / AU) - 1.0).abs() < 1e-12);
    }
    // The kernel contains ten days of the Sun, and six of the Moon.
    assert!(sun.failure(863_999.0).is_none() && sun.failure(864_001.0).is_some());
    let refused = |text: &str, parts: &[&str]| {
        let told = scene(text, &[]).err().unwrap();
        for part in parts {
            assert!(told.contains(part), "{part}: {told}");
        }
    };
    let late = text.replace(epoch, "2012-09-06 00:00:00 UTC");
    refused(
        &late,
        &[
            "`Gravity.third_bodies`",
            "`Sun`: the Moon may shadow the Sun",
            "shadows: []",
            "at the epoch 2012-09-06T00:00:00",
            "does not connect bodies 301 and 399",
            "to 2012-08-12T00:00:00",
            "covers this time",
        ],
    );
    let other = text.replace("[\"sun\", \"moon\"]", "[\"mars\"]");
    refused(&other, &["`Gravity.third_bodies`", "no body 4; it has 0, 3, 10, 301, 399", "de440"]);
    write(&folder, epoch, false);
    refused(&text, &["`Gravity.third_bodies`", "no body 301; it has 0, 3, 10, 399"]);
    // A simulation without a Sun does not need the Sun in the kernel.
    let dark = text.replace("[\"sun\", \"moon\"]", "[\"sun\"]");
    refused(&dark, &["`Sun`: the Moon may shadow the Sun", "shadows: []"]);
    let (from, to) =
        (dark.find("\"Sun\":").unwrap(), dark.find("environment.ephemeris_sun").unwrap());
    let end = to + dark[to..].find("),").unwrap() + 2;
    let dark = format!("{}{}", &dark[..from], &dark[end..]);
    assert!(scene(&dark, &[]).is_ok(), "{}", scene(&dark, &[]).err().unwrap());
    std::fs::write(folder.path().join("made.bsp"), "GIF89a").unwrap();
    refused(&text, &["`world.kernel`", "it does not begin with `DAF/SPK`", "give an SPK kernel"]);
    std::fs::remove_file(folder.path().join("made.bsp")).unwrap();
    refused(&text, &["`world.kernel`", "there is no file", "made.bsp"]);
}
