//! The filter over a Mars that turns: carried on, observed, consistent, refused.
use super::*;
use crate::guidance::planet::tests::Point;
use linkwork_runtime::noise;
use linkwork_spatial::Pose;
use linkwork_surroundings::PlainWorld;
use std::sync::Arc;

const MU: f64 = 4.282_837e13;
const RADIUS: f64 = 3.39e6;

/// W: east, north, up of a place in the tropics, at the ground.
fn site() -> Site {
    let up = Vec3::new(0.9, 0.1, 0.3).normalize();
    let axes = crate::guidance::ground_motion::east_north_up(&up);
    let rotation = Quat::from_rotation_matrix(
        &linkwork_spatial::nalgebra::Rotation3::from_matrix_unchecked(axes),
    );
    Site {
        pose: Pose { rotation, position: up * RADIUS },
        rate: 7.088_218_1e-5,
        start: Quat::identity(),
    }
}

fn gravity(site: Option<Site>) -> Handle<dyn Gravity> {
    Handle::new("g", Arc::new(Point { mu: MU, site }) as Arc<dyn Gravity>)
}

fn beams() -> Vec<Vec3> {
    let mut all = vec![-Vec3::z()];
    all.extend([0.0, 2.1, 4.2].map(|a: f64| Vec3::new(a.cos(), a.sin(), -2.4)));
    all
}

fn params() -> DescentFilterParams {
    DescentFilterParams {
        beams: beams(),
        range_sigma: 0.5,
        range_share: 0.01,
        speed_sigma: 0.1,
        ground_sigma: 1e-3,
        ground_length: 20.0,
        gyro_white: 2e-5,
        gyro_walk: 1e-8,
        accel_white: 3.5e-4,
        accel_walk: 1e-5,
        position_start: Vec3::new(200.0, 150.0, 100.0),
        velocity_start: Vec3::new(1.0, 1.5, 2.0),
        attitude_start: 1e-3,
        gyro_bias: 5e-6,
        accel_bias: 3e-3,
        radar_every: 1,
        gate: 0.0,
        ground_radius: Some(RADIUS),
        world: PlainWorld::of_site(MU, RADIUS, site()).handle(),
        gravity: gravity(Some(site())),
    }
}

fn filter(p: DescentFilterParams) -> DescentFilter {
    DescentFilter::build(p).map_err(|e| e.message).unwrap()
}

/// A braking descent that swings, with the specific force that flies it, by RK4 in W.
struct Flown {
    t: f64,
    r: Vec3,
    v: Vec3,
}

impl Flown {
    fn attitude(t: f64) -> Quat {
        Quat::from_scaled_axis(Vec3::new(0.1 * (0.3 * t).sin(), 0.08 * (0.23 * t).cos(), 0.02 * t))
    }
    /// Turn rate over W, body axes.
    fn rate(t: f64) -> Vec3 {
        let h = 1e-4;
        (Self::attitude(t - h).inverse() * Self::attitude(t + h)).scaled_axis() / (2.0 * h)
    }
    /// Specific force, body axes.
    fn force(t: f64) -> Vec3 {
        Vec3::new(0.4 * (0.5 * t).sin(), -0.3, 5.0 + 0.5 * (0.2 * t).cos())
    }
    fn acceleration(t: f64, r: Vec3, v: Vec3) -> Vec3 {
        Self::attitude(t) * Self::force(t) + gravity(Some(site())).free_fall(t, r, v)
    }
    fn begin() -> Flown {
        Flown { t: 0.0, r: Vec3::new(-900.0, 400.0, 4000.0), v: Vec3::new(25.0, -12.0, -85.0) }
    }
    fn step(&mut self, h: f64) {
        let (t, r, v) = (self.t, self.r, self.v);
        let a1 = Self::acceleration(t, r, v);
        let (v2, v3a) = (v + a1 * (0.5 * h), t + 0.5 * h);
        let a2 = Self::acceleration(v3a, r + v * (0.5 * h), v2);
        let v3 = v + a2 * (0.5 * h);
        let a3 = Self::acceleration(v3a, r + v2 * (0.5 * h), v3);
        let v4 = v + a3 * h;
        let a4 = Self::acceleration(t + h, r + v3 * h, v4);
        self.r += (v + v2 * 2.0 + v3 * 2.0 + v4) * (h / 6.0);
        self.v += (a1 + a2 * 2.0 + a3 * 2.0 + a4) * (h / 6.0);
        self.t += h;
    }
    fn node(&self) -> NodeState {
        let rotation = Self::attitude(self.t);
        let angular = rotation * Self::rate(self.t);
        NodeState { position: self.r, rotation, angular, velocity: self.v }
    }
}

/// Noise of one run: normal numbers of a row and a lane.
fn normal(run: u64, row: u64, lane: u32) -> f64 {
    noise::normal(noise::key(run, "descent"), row, lane)
}

/// Errors (W) after `rows` intervals of 50 ms, and the estimate.
fn fly(p: &DescentFilterParams, run: u64, noisy: f64, echoes: bool, rows: u64) -> (Row, Navigated) {
    fly_over(&filter(p.clone()), p, run, noisy, echoes, rows)
}

/// The same where beams meet the ground of another filter.
fn fly_over(
    ground: &DescentFilter,
    p: &DescentFilterParams,
    run: u64,
    noisy: f64,
    echoes: bool,
    rows: u64,
) -> (Row, Navigated) {
    let (m, h) = (filter(p.clone()), 0.05);
    let mut flown = Flown::begin();
    let three = |row, lane| Vec3::from_fn(|k, _| normal(run, row, lane + k as u32)) * noisy;
    let (gyro, accel) = (three(0, 40) * p.gyro_bias, three(0, 43) * p.accel_bias);
    let mut d = Navigated::zero();
    let n = p.beams.len();
    let mut radar = vec![0.0; 3 * n];
    for row in 0..=rows {
        if row > 0 {
            flown.step(h);
        }
        let mount = flown.node();
        let spin = mount.rotation.inverse() * site().omega();
        let u = DescentFilterIn {
            mount,
            rate: Flown::rate(flown.t) + spin + gyro + three(row, 50) * (p.gyro_white / h.sqrt()),
            force: Flown::force(flown.t) + accel + three(row, 53) * (p.accel_white / h.sqrt()),
        };
        // Compute the beams from the true state, with the filter's model and without errors.
        let truth = Navigated {
            position: mount.position,
            velocity: mount.velocity,
            attitude: mount.rotation,
            ..Navigated::zero()
        };
        for k in 0..n {
            let e = ground.expected(&truth, k).unwrap();
            let sigma = (p.range_sigma + p.range_share * e.range) * noisy;
            radar[k] = e.range + sigma * normal(run, row, 60 + k as u32);
            radar[n + k] = e.speed + p.speed_sigma * noisy * normal(run, row, 80 + k as u32);
            radar[2 * n + k] = f64::from(u8::from(echoes));
        }
        let c = Clock {
            t: flown.t,
            dt: h,
            n: row,
            key: noise::key(run, "filter"),
            sampled: false,
            span: None,
        };
        d = m.step(&c, &d, &u, &radar);
    }
    let turn = (Flown::attitude(flown.t) * d.attitude.inverse()).scaled_axis();
    let mut off = Row::zeros();
    for (k, v) in [flown.r - d.position, flown.v - d.velocity, turn, gyro - d.gyro, accel - d.accel]
        .iter()
        .enumerate()
    {
        off.fixed_rows_mut::<3>(3 * k).copy_from(v);
    }
    (off, d)
}

fn exact() -> DescentFilterParams {
    let none = Vec3::zeros();
    let p = DescentFilterParams { position_start: none, velocity_start: none, ..params() };
    DescentFilterParams { attitude_start: 0.0, gyro_bias: 0.0, accel_bias: 0.0, ..p }
}

#[test]
fn without_errors_it_goes_with_the_lander_on_a_planet_that_turns() {
    let (off, _) = fly(&exact(), 1, 0.0, false, 600);
    let part = |k: usize| off.fixed_rows::<3>(k).norm();
    println!("after 30 s: {} m, {} m/s, {} rad", part(0), part(3), part(6));
    // The remaining error is from the trapezoidal rule over instantaneous rates and forces.
    assert!(part(0) < 0.02 && part(3) < 2e-3 && part(6) < 1e-5, "{off}");
}

#[test]
fn partial_derivatives_are_those_of_differences() {
    let m = filter(params());
    let node = Flown::begin().node();
    let at = |x: &Row| Navigated {
        position: node.position + x.fixed_rows::<3>(0),
        velocity: node.velocity + x.fixed_rows::<3>(3),
        attitude: Quat::from_scaled_axis(x.fixed_rows::<3>(6).into_owned()) * node.rotation,
        ground: x[N - 1],
        ..Navigated::zero()
    };
    for beam in 0..4 {
        let e = m.expected(&at(&Row::zeros()), beam).unwrap();
        for k in (0..9).chain([N - 1]) {
            let h = if (6..9).contains(&k) { 1e-4 } else { 0.1 };
            let mut x = Row::zeros();
            x[k] = h;
            let (a, b) = (m.expected(&at(&x), beam).unwrap(), m.expected(&at(&-x), beam).unwrap());
            let range = (a.range - b.range) / (2.0 * h) - e.by_range[k];
            let speed = (a.speed - b.speed) / (2.0 * h) - e.by_speed[k];
            assert!(range.abs() < 1e-4 && speed.abs() < 1e-4, "{beam}, {k}: {range} {speed}");
        }
    }
}

/// Normalised squares of the errors have the mean of their number, over runs that draw everything.
#[test]
fn errors_are_as_large_as_it_says() {
    let (p, runs) = (params(), 60);
    let mut sums = [0.0; 4];
    for run in 0..runs {
        let (off, d) = fly(&p, run, 1.0, true, 300);
        let cov = Covariance::from_column_slice(&d.covariance);
        for (sum, from) in sums.iter_mut().zip([3, 6, 12]) {
            let part = cov.fixed_view::<3, 3>(from, from).into_owned();
            let e = off.fixed_rows::<3>(from).into_owned();
            *sum += e.dot(&(part.try_inverse().unwrap() * e)) / runs as f64;
        }
        sums[3] += off[2].powi(2) / cov[(2, 2)] / runs as f64;
    }
    println!(
        "velocity {:.2}, attitude {:.2}, force {:.2} of 3; height {:.2} of 1",
        sums[0], sums[1], sums[2], sums[3]
    );
    // For 60 runs, the mean of χ² with 3 degrees of freedom has a standard deviation of 0.32, and
    // with 1 degree of freedom 0.18.
    assert!(sums[..3].iter().all(|s| (2.0..4.0).contains(s)), "{sums:?}");
    assert!((0.45..1.6).contains(&sums[3]), "{sums:?}");
}

#[test]
fn height_and_velocity_are_found_and_the_place_is_not() {
    let (off, d) = fly(&params(), 7, 1.0, true, 400);
    let sigma = |k: usize| d.covariance[k * (N + 1)].sqrt();
    println!("{off}, {} {} {}", sigma(0), sigma(2), sigma(3));
    assert!(sigma(0) > 150.0 && sigma(1) > 100.0, "{} {}", sigma(0), sigma(1));
    assert!(sigma(2) < 5.0 && sigma(3) < 0.1, "{} {}", sigma(2), sigma(3));
    assert!(off[2].abs() < 4.0 * sigma(2) && off[3].abs() < 4.0 * sigma(3));
}

/// Ground that stands out of the sphere is a height that is not known so well, and no place.
#[test]
fn ground_over_the_sphere_moves_neither_place_nor_velocity() {
    let wavy = DescentFilterParams { ground_sigma: 1.0, ..params() };
    let (flat, d) = fly(&wavy, 7, 1.0, true, 400);
    let lifted = DescentFilterParams { ground_radius: Some(RADIUS + 1.0), ..wavy.clone() };
    let told = filter(lifted);
    let (off, _) = fly_over(&told, &wavy, 7, 1.0, true, 400);
    let sigma = |k: usize| d.covariance[k * (N + 1)].sqrt();
    println!("{} {}", off - flat, sigma(2));
    let moved = off - flat;
    assert!(moved.fixed_rows::<2>(0).norm() < 0.1 && moved.fixed_rows::<3>(3).norm() < 2e-3);
    assert!(moved[2].abs() < 1.1 && (0.5..1.5).contains(&sigma(2)), "{moved} {}", sigma(2));
}

/// Whatever the errors have to do with each other, a beam moves the position up and down alone, and the covariance is that of what was
/// done: (1 − K H) P (1 − K H)ᵀ + K σ² Kᵀ.
#[test]
fn a_beam_moves_no_place_over_the_ground() {
    let m = filter(params());
    let node = Flown::begin().node();
    let mut d = m.begin(&Clock::at(0.0, 0.05, 0), &node);
    let mixed = Covariance::from_fn(|i, j| normal(3, i as u64, j as u32));
    d.covariance.copy_from_slice((mixed * mixed.transpose()).as_slice());
    let (before, cov) = (d.position, mixed * mixed.transpose());
    let h = Row::from_fn(|i, _| normal(4, i as u64, 0));
    let (off, sigma) = (700.0, 1.3);
    m.mend(&mut d, &h, off, sigma);
    let up = site().relative_to_centre(&before).normalize();
    let moved = d.position - before;
    assert!(moved.dot(&up).abs() > 1e-3 && moved.cross(&up).norm() < 1e-9, "{moved}");
    let to = cov * h;
    let mut gain = to / (h.dot(&to) + sigma * sigma);
    let raised = up * up.dot(&gain.fixed_rows::<3>(0));
    gain.fixed_rows_mut::<3>(0).copy_from(&raised);
    let rest = Covariance::identity() - gain * h.transpose();
    let want = rest * cov * rest.transpose() + gain * gain.transpose() * (sigma * sigma);
    let got = Covariance::from_column_slice(&d.covariance);
    assert!((got - want).amax() < 1e-9 * want.amax(), "{}", (got - want).amax());
}

/// Between samples of a slower radar its held numbers are not taken again.
#[test]
fn a_slower_radar_is_read_once_a_sample() {
    let p = DescentFilterParams { radar_every: 5, ..params() };
    let sigma = |rows: u64| fly(&p, 3, 1.0, true, rows).1.covariance[2 * (N + 1)].sqrt();
    let (at_sample, before, after) = (sigma(40), sigma(44), sigma(45));
    assert!(before >= at_sample && after < 0.99 * before, "{at_sample} {before} {after}");
}

#[test]
fn what_is_far_off_is_left_out_and_counted() {
    let m = filter(DescentFilterParams { gate: 5.0, ..params() });
    let node = Flown::begin().node();
    let c = Clock::at(0.0, 0.05, 0);
    let force = node.rotation.inverse() * Vec3::z() * 3.7;
    let u = DescentFilterIn { mount: node, rate: Vec3::zeros(), force };
    let silent = m.step(&c, &Navigated::zero(), &u, &[0.0; 12]);
    let mut radar = [0.0; 12];
    let e = m.expected(&silent, 1).unwrap();
    (radar[1], radar[5], radar[9]) = (e.range + 2000.0, e.speed, 1.0);
    let d = m.step(&c, &Navigated::zero(), &u, &radar);
    assert_eq!(d.rejected, 1.0);
    assert!((d.position - silent.position).norm() < 1e-9, "{}", d.position - silent.position);
    let open = filter(params()).step(&c, &Navigated::zero(), &u, &radar);
    assert!(open.rejected == 0.0 && (open.position - silent.position).norm() > 100.0);
}

#[test]
fn what_it_cannot_be_is_refused() {
    let told = |p: DescentFilterParams| DescentFilter::build(p).err().unwrap();
    let e = told(DescentFilterParams { beams: vec![], ..params() });
    assert!(e.param.as_deref() == Some("beams") && e.help.is_some());
    let e = told(DescentFilterParams { beams: vec![Vec3::zeros()], ..params() });
    assert!(e.message.contains("beam 0"));
    let e = told(DescentFilterParams { velocity_start: -Vec3::x(), ..params() });
    assert!(e.param.as_deref() == Some("velocity_start"));
    let level = PlainWorld { axes: Axes::Level(site()), ..PlainWorld::inertial(MU, RADIUS, 0.0) };
    let e = told(DescentFilterParams { world: level.handle(), ..params() });
    assert!(e.message.contains("level") && e.help.is_some());
    let world = PlainWorld::inertial(MU, RADIUS, 7e-5).handle();
    let inertial = DescentFilterParams { world, gravity: gravity(None), ..params() };
    assert_eq!(
        DescentFilter::build(inertial).map_err(|e| e.message).unwrap().rate,
        Vec3::z() * 7e-5
    );
}
