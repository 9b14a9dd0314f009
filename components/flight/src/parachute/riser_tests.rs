//! Tests of `flight.riser`: its potential, its legs, closed forms of three legs, what is refused.
use super::*;

fn legs(radius: f64, length: f64) -> Vec<Leg> {
    let at = |k: usize| {
        let a = std::f64::consts::TAU * k as f64 / 3.0;
        Vec3::new(radius * a.cos(), radius * a.sin(), 0.4)
    };
    (0..3).map(|k| Leg { at: at(k), length }).collect()
}

fn riser(legs: Vec<Leg>, damping: f64) -> Riser {
    let p = RiserParams { length: 10.0, stiffness: 5e3, damping, legs, taut: true };
    Riser::build(p).map_err(|e| e.message).unwrap()
}

/// A body somewhere, turned and turning, and a canopy at a place in its axes.
fn ends(canopy: Vec3) -> RiserIn {
    let body = NodeState {
        position: Vec3::new(3.0, -2.0, 50.0),
        rotation: Quat::from_scaled_axis(Vec3::new(0.4, -0.9, 0.3)),
        velocity: Vec3::new(1.0, 0.4, -20.0),
        angular: Vec3::new(0.2, -0.5, 0.3),
    };
    let position = body.position + body.rotation * canopy;
    let canopy = NodeState { position, velocity: Vec3::new(-0.3, 0.8, -18.0), ..body };
    RiserIn { body, canopy }
}

fn at(m: &Riser, u: &RiserIn) -> RiserOut {
    let d = Taut { taut: true, changes: 0.0 };
    m.feedthrough(&d, u)
}

/// Places of the canopy for which one, two and three legs are taut.
const PLACES: [(Vec3, f64); 3] = [
    (Vec3::new(0.4, -0.3, 13.0), 3.0),
    (Vec3::new(12.0, 1.5, 5.0), 2.0),
    (Vec3::new(-13.0, 0.4, -1.0), 1.0),
];

#[test]
fn force_and_moment_are_slopes_of_the_energy_stored_in_it() {
    let m = riser(legs(0.8, 2.0), 0.0);
    let energy = |u: &RiserIn| 0.5 * 5e3 * m.stretch(u).extension.max(0.0).powi(2);
    for (place, taut) in PLACES {
        let (u, h) = (ends(place), 1e-5);
        let y = at(&m, &u);
        assert_eq!(y.legs, taut, "{place}");
        assert!(y.tension > 100.0);
        assert!(((u.canopy.position - y.joint).norm() - 10.0 - y.extension).abs() < 1e-12);
        let from_end = |leg: &Leg| (u.body.position + u.body.rotation * leg.at - y.joint).norm();
        let full = |leg: &&Leg| (from_end(leg) - leg.length).abs() < 1e-12;
        assert_eq!(m.p.legs.iter().filter(full).count() as f64, taut, "legs that are stretched");
        assert!(m.p.legs.iter().all(|leg| from_end(leg) < leg.length + 1e-12));
        for k in 0..3 {
            let axis = Vec3::ith(k, 1.0);
            let moved = |side: f64| {
                let mut v = u;
                v.body.position += axis * (side * h);
                energy(&v)
            };
            let turned = |side: f64| {
                let mut v = u;
                v.body.rotation = Quat::from_scaled_axis(axis * (side * h)) * v.body.rotation;
                energy(&v)
            };
            let pulled = |side: f64| {
                let mut v = u;
                v.canopy.position += axis * (side * h);
                energy(&v)
            };
            let slope = |e: &dyn Fn(f64) -> f64| (e(-1.0) - e(1.0)) / (2.0 * h);
            let size = y.tension;
            assert!((slope(&moved) - y.on_body.force[k]).abs() < 1e-6 * size, "{place} {k}");
            assert!((slope(&turned) - y.on_body.moment[k]).abs() < 1e-6 * size, "{place} {k}");
            assert!((slope(&pulled) - y.on_canopy.force[k]).abs() < 1e-6 * size, "{place} {k}");
        }
    }
}

/// The rate is that of the length as both ends move, also where the joint slides from one place of the body to another.
#[test]
fn its_rate_is_that_of_its_length_and_damping_only_takes() {
    let m = riser(legs(0.8, 2.0), 700.0);
    for (place, _) in PLACES {
        let (u, h) = (ends(place), 1e-5);
        let after = |t: f64| {
            let mut v = u;
            v.body.position += u.body.velocity * t;
            v.body.rotation = Quat::from_scaled_axis(u.body.angular * t) * u.body.rotation;
            v.canopy.position += u.canopy.velocity * t;
            m.stretch(&v).extension
        };
        let y = at(&m, &u);
        let rate = (after(h) - after(-h)) / (2.0 * h);
        assert!((rate - y.rate).abs() < 1e-8 * (1.0 + rate.abs()), "{place}: {rate} {}", y.rate);
        assert!((y.tension - (5e3 * y.extension + 700.0 * y.rate)).abs() < 1e-8);
        // The power on both ends equals the rate of the stored energy plus the power of the damper.
        let power = y.on_body.force.dot(&u.body.velocity)
            + y.on_body.moment.dot(&u.body.angular)
            + y.on_canopy.force.dot(&u.canopy.velocity);
        assert!((power + y.tension * y.rate).abs() < 1e-8 * y.tension, "{place}: {power}");
    }
}

#[test]
fn three_legs_make_a_point_over_the_body_and_share_its_load() {
    let m = riser(legs(0.8, 2.0), 0.0);
    let u = ends(Vec3::z() * 13.0);
    let y = at(&m, &u);
    let high = (2.0_f64.powi(2) - 0.8_f64.powi(2)).sqrt();
    assert!((y.extension - (13.0 - 0.4 - high - 10.0)).abs() < 1e-12, "{}", y.extension);
    assert!((y.leg_tension / y.tension - 2.0 / high / 3.0).abs() < 1e-12);
    assert!(y.on_body.moment.norm() < 1e-9 * y.tension && y.angle < 1e-12);
    // While all three legs are taut, they act like a line to that point.
    let u = ends(Vec3::new(1.0, -0.7, 13.0));
    let (y, body) = (at(&m, &u), &u.body);
    let line = u.canopy.position - body.position - body.rotation * Vec3::z() * (0.4 + high);
    assert!((y.extension - (line.norm() - 10.0)).abs() < 1e-12 && y.legs == 3.0);
    // A single leg of negligible length acts like a line to its end.
    let end = Vec3::new(0.3, -0.2, 0.9);
    let one = riser(vec![Leg { at: end, length: 1e-6 }], 0.0);
    let y = at(&one, &u);
    let line = u.canopy.position - body.position - body.rotation * end;
    assert!((y.extension - (line.norm() - 10.0)).abs() < 2e-6 && y.legs == 1.0);
}

/// Pulled all the way around, the joint moves without a jump and is where no point that all legs reach is nearer.
#[test]
fn the_joint_is_the_nearest_point_and_never_jumps() {
    let m = riser(legs(0.8, 2.0), 0.0);
    let mut before: Option<Vec3> = None;
    for k in 0..3000 {
        let a = f64::from(k) * 2e-3;
        let c = Quat::from_scaled_axis(Vec3::new(0.1, 1.0, 0.3) * a) * (Vec3::z() * 14.0);
        let j = m.nearest(&c).unwrap();
        assert!(m.reached(&j.at));
        if let Some(b) = before {
            assert!((j.at - b).norm() < 0.035, "{k}");
        }
        before = Some(j.at);
        // K is convex, so every point of it lies behind the plane through the nearest point that is perpendicular
        // to the direction of the canopy.
        for s in 0..40 {
            let b = f64::from(s);
            let other = Vec3::new((3.1 * b).sin(), (1.7 * b).cos(), 0.4 + 1.6 * (0.9 * b).sin());
            if m.reached(&other) {
                assert!((other - j.at).dot(&(c - j.at)) < 1e-9, "{k} {s}");
            }
        }
        let n = (c - j.at).normalize();
        let shares = m.shares(&j, &n);
        let sum: Vec3 =
            (0..j.taut).map(|i| (j.at - m.p.legs[j.legs[i]].at).normalize() * shares[i]).sum();
        assert!((sum - n).norm() < 1e-9 && shares.min() > -1e-9, "{k}: {j:?} {shares}");
    }
}

#[test]
fn it_never_pushes_and_what_makes_no_sense_is_refused() {
    let m = riser(legs(0.8, 2.0), 700.0);
    let u = ends(Vec3::z() * 6.0);
    let y = at(&m, &u);
    assert_eq!(
        (y.tension, y.legs, y.on_body, y.on_canopy.force.norm()),
        (0.0, 0.0, Wrench::zero(), 0.0)
    );
    // The canopy is between the legs.
    let y = at(&m, &ends(Vec3::z() * 0.5));
    assert!(y.extension == -10.0 && y.tension == 0.0 && y.rate == 0.0);
    let guards = |z: f64| m.guards(&ends(Vec3::z() * z));
    let full = 10.0 + 0.4 + (2.0_f64.powi(2) - 0.8_f64.powi(2)).sqrt();
    assert!(guards(full - 1e-6).within < 0.0 && guards(full + 1e-6).within > 0.0);
    let refused = |legs: Vec<Leg>| {
        let p = RiserParams { length: 10.0, stiffness: 5e3, damping: 0.0, legs, taut: false };
        Riser::build(p).err().unwrap()
    };
    assert_eq!(refused(Vec::new()).param.as_deref(), Some("legs"));
    assert!(refused(legs(0.8, 0.7)).message.contains("too short"));
    let far = ends(Vec3::z() * 13.0);
    assert!(m.startup_warnings(&far).is_empty(), "the start with a taut riser is written");
    let mut loose = m;
    loose.p.taut = false;
    assert_eq!(loose.startup_warnings(&far).len(), 1);
}
