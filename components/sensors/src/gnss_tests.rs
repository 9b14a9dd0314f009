//! Tests of `sensors.gnss`: exact without errors, errors as the geometry says, visibility in closed form, what is refused.
use super::*;
use linkwork_runtime::Lane;
use linkwork_spatial::Pose;
use linkwork_surroundings::PlainWorld;

const RADIUS: f64 = 6_378_137.0;

/// The Earth, with W at a site of it or inertial.
fn earth(site: Option<Site>) -> Handle<dyn World> {
    let mu = 3.986_004_418e14;
    match site {
        Some(site) => PlainWorld::of_site(mu, RADIUS, site).handle(),
        None => PlainWorld::inertial(mu, RADIUS, 7.292_115e-5).handle(),
    }
}

/// Elsewhere than at the Earth there are only satellites of the user's.
#[test]
fn without_satellites_it_is_refused() {
    let e = Gnss::build(GnssParams { orbit_radius: None, ..quiet(None) }).err().unwrap();
    assert!(e.message.contains("no navigation satellites") && e.help.is_some());
}

fn quiet(site: Option<Site>) -> GnssParams {
    GnssParams {
        planes: 6,
        per_plane: 4,
        phasing: 1,
        inclination: 55f64.to_radians(),
        orbit_radius: Some(2.656e7),
        node: 0.3,
        mask: 5f64.to_radians(),
        cone: std::f64::consts::PI,
        range_sigma: 0.0,
        wander_sigma: 0.0,
        wander_time: 600.0,
        rate_sigma: 0.0,
        clock_start: 1e-6,
        drift_start: 1e-8,
        clock_white: 0.0,
        clock_walk: 0.0,
        pdop_max: 20.0,
        world: earth(site),
    }
}

/// The orbits stand on the pole of the body: every satellite of a plane has its distance from the equator within a sin i.
#[test]
fn orbits_are_inclined_to_the_equator_of_the_body() {
    let tilt = Quat::from_axis_angle(&Vec3::x_axis(), 0.6);
    let world = PlainWorld { start: tilt, ..PlainWorld::inertial(4.28e13, 3_396_190.0, 7.088e-5) };
    let m = receiver(GnssParams { world: world.handle(), ..quiet(None) });
    let pole = tilt * Vec3::z();
    let most = (0..200)
        .map(|k| m.satellite(0, f64::from(k) * 2e3).p.dot(&pole) / m.a)
        .fold(0.0, |a: f64, b| a.max(b.abs()));
    assert!((most - 55f64.to_radians().sin()).abs() < 1e-3, "{most}");
}

fn receiver(p: GnssParams) -> Gnss {
    Gnss::build(p).map_err(|e| e.message).unwrap()
}

fn start(m: &Gnss) -> Vec<f64> {
    vec![0.0; GnssClock::N + m.count() as usize]
}

fn read(m: &Gnss, c: &Clock, d: &[f64], mount: &NodeState) -> GnssOut {
    let mut u = vec![0.0; <NodeState as Lane>::N];
    mount.put(&mut u);
    let mut y = vec![f64::NAN; GnssOut::N];
    m.feedthrough(c, d, &u, &mut y);
    GnssOut::get(&y)
}

/// Where the frame of a site on the sphere is, and how the planet turns.
fn site() -> Site {
    let rotation = Quat::from_euler_angles(0.4, 0.9, -1.3);
    let up = Vec3::new(0.5, -0.6, 0.624_5).normalize();
    Site { pose: Pose::new(rotation, up * RADIUS), rate: 7.292_115e-5, start: Quat::identity() }
}

#[test]
fn without_errors_it_tells_where_it_is_how_it_moves_and_its_clock() {
    for place in [None, Some(site())] {
        let m = receiver(quiet(place));
        let up = Vec3::new(0.5, -0.6, 0.624_5).normalize();
        let position =
            if place.is_some() { Vec3::new(40.0, -12.0, 9.0) } else { up * (RADIUS + 300.0) };
        let velocity = Vec3::new(31.0, -220.0, 75.0);
        let mount = NodeState { position, velocity, ..NodeState::identity() };
        let mut d = start(&m);
        for n in 0..200 {
            let c = Clock::at(400.0 * n as f64, 400.0, n);
            let y = read(&m, &c, &d, &mount);
            assert!(y.fix && y.satellites >= 4.0 && y.pdop > 1.0, "{n}: {y:?}");
            assert!((y.position - position).norm() < 1e-6, "{n}: {}", y.position - position);
            assert!((y.velocity - velocity).norm() < 1e-9, "{n}: {}", y.velocity - velocity);
            let (clock, _) = m.state(&c, &d);
            assert!((y.clock * LIGHT - clock.bias).abs() < 1e-6 && clock.bias != 0.0);
            assert!((y.drift * LIGHT - clock.rate).abs() < 1e-9 && clock.rate != 0.0);
            m.update(&c, &mut d);
        }
        // A clock without noise continues with its drift.
        let (c, end) = (Clock::at(0.0, 1.0, 0), GnssClock::get(&d));
        let (first, _) = m.state(&c, &start(&m));
        assert!((end.bias / (first.bias + first.rate * 80_000.0) - 1.0).abs() < 1e-12);
    }
}

/// White errors of the ranges make an error of the place whose mean square is σ² PDOP²; of the rates, of the velocity.
#[test]
fn errors_are_those_of_the_geometry() {
    let m = receiver(GnssParams { range_sigma: 2.0, rate_sigma: 0.1, ..quiet(None) });
    let position = Vec3::new(0.5, -0.6, 0.624_5).normalize() * (RADIUS + 200.0);
    let mount = NodeState { position, ..NodeState::identity() };
    let (count, mut place, mut speed, mut pdop) = (4000, 0.0, 0.0, 0.0);
    for n in 0..count {
        // The time does not advance, so that the satellites stay at their places.
        let y = read(&m, &Clock::at(1000.0, 1.0, n), &start(&m), &mount);
        place += (y.position - position).norm_squared() / count as f64;
        speed += y.velocity.norm_squared() / count as f64;
        pdop = y.pdop;
    }
    let [place, speed] = [place / (2.0 * pdop).powi(2), speed / (0.1 * pdop).powi(2)];
    println!("PDOP {pdop}: mean squares over σ² PDOP² {place}, {speed}");
    // The bound is four standard errors of √(2/4000): one of the three squares may be nearly the
    // whole sum.
    assert!((place - 1.0).abs() < 0.09 && (speed - 1.0).abs() < 0.09);
}

/// From the pole a satellite of inclination i is never higher than atan((a sin i − R)/(a cos i)), 45° of GPS; from orbits within the constellation's
/// the planet hides what is behind it, and from outside nothing is over the horizontal.
#[test]
fn satellites_are_seen_as_the_geometry_says() {
    let m = receiver(quiet(None));
    let pole = Vec3::z() * RADIUS;
    let mut highest = f64::NEG_INFINITY;
    for step in 0..20_000 {
        for k in 0..m.count() {
            let s = m.satellite(k, 5.0 * f64::from(step));
            highest = highest.max(Gnss::elevation(&pole, &s.p));
            let speed = (m.mu / m.a).sqrt();
            assert!((s.v.norm() / speed - 1.0).abs() < 1e-12 && s.v.dot(&s.p).abs() < 1.0);
        }
    }
    let (sin, cos) = 55f64.to_radians().sin_cos();
    let want = ((2.656e7 * sin - RADIUS) / (2.656e7 * cos)).atan();
    assert!((highest - want).abs() < 1e-4 && (want.to_degrees() - 45.3).abs() < 0.1, "{highest}");
    // At a height of 700 km the planet hides satellites behind it, within asin(R/r) of its centre.
    let low = receiver(GnssParams { mask: -1.571, ..quiet(None) });
    let own = Vec3::x() * (RADIUS + 7e5);
    let limb = (RADIUS / own.norm()).asin();
    let behind = |angle: f64| own + Vec3::new(-angle.cos(), angle.sin(), 0.0) * 2e7;
    assert!(!low.seen(&own, &Vec3::x(), &behind(limb - 1e-6)));
    assert!(low.seen(&own, &Vec3::x(), &behind(limb + 1e-6)));
    // A satellite that is nearer than the planet is not hidden by it.
    assert!(low.seen(&own, &Vec3::x(), &(own - Vec3::x() * 1e5)));
    let mount = NodeState { position: Vec3::x() * 8e7, ..NodeState::identity() };
    let y = read(&m, &Clock::at(0.0, 1.0, 0), &start(&m), &mount);
    assert!(!y.fix && y.satellites == 0.0 && y.position == Vec3::zeros(), "{y:?}");
    // An antenna that points down receives no satellite on the ground; one with a narrow cone receives
    // fewer than all.
    let up = |angle: f64, cone: f64| {
        let rotation = Quat::from_scaled_axis(Vec3::y() * angle);
        let mount = NodeState { position: Vec3::z() * RADIUS, rotation, ..NodeState::identity() };
        read(
            &receiver(GnssParams { cone, ..quiet(None) }),
            &Clock::at(0.0, 1.0, 0),
            &start(&m),
            &mount,
        )
    };
    let all = up(0.0, std::f64::consts::PI).satellites;
    assert!(up(std::f64::consts::PI, 1.5).satellites == 0.0 && all >= 6.0, "{all}");
    assert!(up(0.0, 1.2).satellites < all);
}

/// Errors that go on have their deviation from the first sample on, and the correlation of their time constant.
#[test]
fn errors_go_on_with_their_time_constant_and_clocks_walk() {
    let (sigma, tau, dt) = (3.0, 50.0_f64, 20.0_f64);
    let walks = GnssParams {
        clock_white: 1e-9,
        clock_walk: 2e-11,
        clock_start: 0.0,
        drift_start: 0.0,
        ..quiet(None)
    };
    let m = receiver(GnssParams { wander_sigma: sigma, wander_time: tau, ..walks });
    let (mut d, count, first) = (start(&m), 4000, GnssClock::N);
    let (mut square, mut product, mut terms) = (0.0, 0.0, 0.0);
    let mut clocks = Vec::new();
    for n in 0..count {
        let c = Clock::at(dt * n as f64, dt, n);
        let (clock, before) = m.state(&c, &d);
        clocks.push(clock.bias / LIGHT);
        m.update(&c, &mut d);
        for (a, b) in before.iter().zip(&d[first..]) {
            (square, product, terms) = (square + a * a, product + a * b, terms + 1.0);
        }
        if n == 0 {
            assert!(square / terms > 0.2 * sigma * sigma, "{square}");
        }
    }
    let [square, product] = [square, product].map(|s: f64| s / terms / (sigma * sigma));
    let phi = (-dt / tau).exp();
    println!("variance {square}, correlation {product} of {phi}");
    assert!((square - 1.0).abs() < 0.03 && (product - phi).abs() < 0.03);
    // The reference is the variance of second differences over m samples: 2 q₁ mΔ + (2/3) q₂ (mΔ)³ (Brown,
    // Hwang: Random Signals, clock model).
    for steps in [1, 5, 20] {
        let span = dt * steps as f64;
        let second = |k: usize| clocks[k + 2 * steps] - 2.0 * clocks[k + steps] + clocks[k];
        let all: Vec<f64> = (0..clocks.len() - 2 * steps).map(second).collect();
        let mean = all.iter().map(|x| x * x).sum::<f64>() / all.len() as f64;
        let want = 2.0 * 1e-18 * span + 2.0 / 3.0 * 4e-22 * span.powi(3);
        println!("{span} s: {mean:e} of {want:e}");
        assert!(
            (mean / want - 1.0).abs() < 0.12 * (steps as f64).sqrt(),
            "{span} s: {mean:e} of {want:e}"
        );
    }
}

#[test]
fn too_few_satellites_or_a_poor_geometry_give_no_fix() {
    let m = receiver(GnssParams { planes: 3, per_plane: 1, ..quiet(None) });
    let mount = NodeState { position: Vec3::z() * RADIUS, ..NodeState::identity() };
    let y = read(&m, &Clock::at(0.0, 1.0, 0), &start(&m), &mount);
    assert!(!y.fix && y.satellites <= 3.0 && y.pdop == 0.0);
    let strict = receiver(GnssParams { pdop_max: 1.0, ..quiet(None) });
    assert!(!read(&strict, &Clock::at(0.0, 1.0, 0), &start(&strict), &mount).fix);
}
