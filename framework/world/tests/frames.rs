//! Sites on a rotating planet, moving frames, frames of orbits.

use crate::support::*;
use linkwork_world::planet::*;
use linkwork_world::spatial::{Mat3, Pose, Quat, Vec3};

fn matrix(R: &Quat) -> Mat3 {
    *R.to_rotation_matrix().matrix()
}

/// A site on Mars, 3.4e6 m from the centre, years after J2000: a distance of a metre is preserved, and a parked vehicle moves with the ground.
#[test]
fn a_site_keeps_micrometres() {
    let epoch = Epoch::parse("2012-08-06 05:17:57 UTC").unwrap();
    let rotation = Rotation::mars(&epoch);
    let site =
        Site::new(&Ellipsoid::mars(), Geodetic::from_degrees(-4.5895, 137.4417, -4501.0), 0.3);
    let rock = PointMotion {
        position: Vec3::new(1.2345678901, -2.5, 0.25),
        velocity: Vec3::new(0.0, 1e-3, 0.0),
    };
    for t in [0.0, 0.1, 5e4, 1e7] {
        let frame = site.motion(&rotation.at(t));
        let out = frame.to_outer(&rock);
        let back = frame.to_inner(&out);
        near3(&back.position, &rock.position, 2e-9, "position there and back");
        near3(&back.velocity, &rock.velocity, 2e-13, "velocity there and back");
    }
    // The reported velocity must equal the rate of the rock's position in inertial axes.
    let parked = PointMotion { position: rock.position, velocity: Vec3::zeros() };
    let at = |t: f64| site.motion(&rotation.at(t)).to_outer(&parked);
    let (t, h) = (4321.0, 1.0);
    let difference = ((at(t + h).position - at(t - h).position) * 8.0
        - (at(t + 2.0 * h).position - at(t - 2.0 * h).position))
        / (12.0 * h);
    near3(&difference, &at(t).velocity, 1e-8, "velocity of the ground");
    assert!((at(t).velocity.norm() - 240.0).abs() < 1.0, "{:?}", at(t).velocity);
    // The ground must move smoothly, although the angles are large: check second differences at times that are exact in
    // f64. Measured: 9e-9 m, of which 1e-9 is the curvature of the path. With a rounded product of rate and time it
    // would be 3e-7.
    let h = f64::from(2.0f32.powi(-12));
    let mut worst: f64 = 0.0;
    for k in 0..400 {
        let p = |steps: f64| at(1e7 + 0.8125 * f64::from(k) + steps * h).position;
        let bend = p(0.0) - p(-1.0) * 2.0 + p(-2.0);
        assert!(bend.norm().is_finite());
        worst = worst.max(bend.norm());
    }
    assert!(worst < 3e-8, "{worst:e}");
}

#[test]
fn two_sites_see_each_other_without_the_planet() {
    let (a, b) = (
        Site::new(&Ellipsoid::wgs84(), Geodetic::from_degrees(48.0, 11.0, 500.0), 0.0),
        Site::new(&Ellipsoid::wgs84(), Geodetic::from_degrees(48.001, 11.001, 510.0), 0.7),
    );
    let spin =
        Spin { R_IP: Quat::from_euler_angles(0.1, 0.2, 2.0), omega_I: Vec3::new(0.0, 1e-6, 7e-5) };
    let through_space = a.motion(&spin).inverse().then(&b.motion(&spin));
    let direct = a.other(&b);
    near3(&through_space.pose.position, &direct.position, 3e-9, "position");
    near(through_space.pose.rotation.angle_to(&direct.rotation), 0.0, 3e-15, "rotation");
    near3(&through_space.velocity.linear, &Vec3::zeros(), 1e-12, "they stand still");
    near3(&through_space.velocity.angular, &Vec3::zeros(), 1e-19, "and do not turn");
    let q = Vec3::new(3.0, 4.0, 5.0);
    near3(&a.from_planet(&a.to_planet(&q)), &q, 3e-9, "to the planet's axes and back");
    near3(&direct.transform_point(&q), &a.from_planet(&b.to_planet(&q)), 3e-9, "b in a");
    // The other site is 111.2 m north and 74.6 m east; the small deviation is curvature at 48°.
    near(direct.position.y, 111.19, 0.05, "north");
    near(direct.position.x, 74.65, 0.05, "east");
    near(direct.position.z, 10.0, 2e-3, "up");
}

#[test]
fn frames_compose_as_their_motions_say() {
    let mut random = Random(5);
    let mut frame = || FrameMotion {
        pose: Pose::new(Quat::from_scaled_axis(random.on_sphere(1.3)), random.on_sphere(10.0)),
        velocity: linkwork_world::spatial::Motion::new(
            random.on_sphere(0.7),
            random.on_sphere(3.0),
        ),
    };
    let (ab, bc) = (frame(), frame());
    let q =
        PointMotion { position: Vec3::new(1.0, 2.0, -3.0), velocity: Vec3::new(-0.3, 0.1, 0.6) };
    let (one, two) = (ab.then(&bc).to_outer(&q), ab.to_outer(&bc.to_outer(&q)));
    near3(&one.position, &two.position, 1e-14, "position");
    near3(&one.velocity, &two.velocity, 1e-14, "velocity");
    let (one, two) = (ab.inverse().to_outer(&q), ab.to_inner(&q));
    near3(&one.position, &two.position, 1e-14, "inverse position");
    near3(&one.velocity, &two.velocity, 1e-14, "inverse velocity");
    let round = ab.then(&ab.inverse());
    near3(&round.velocity.linear, &Vec3::zeros(), 1e-14, "there and back");
    near3(&round.velocity.angular, &Vec3::zeros(), 1e-14, "there and back");
    // Compare with finite differences: both frames move uniformly for a short time.
    let moved = |f: &FrameMotion, h: f64| {
        Pose::new(
            Quat::from_scaled_axis(f.velocity.angular * h) * f.pose.rotation,
            f.pose.position + f.velocity.linear * h,
        )
    };
    let path =
        |h: f64| (moved(&ab, h) * moved(&bc, h)).transform_point(&(q.position + q.velocity * h));
    let difference = (path(1e-4) - path(-1e-4)) / 2e-4;
    near3(&difference, &ab.to_outer(&bc.to_outer(&q)).velocity, 1e-6, "by differences");
}

/// A free particle moves straight in inertial axes; the same path in rotating axes has the apparent acceleration.
#[test]
fn apparent_acceleration_is_that_of_a_straight_path() {
    let omega = Vec3::new(0.1, -0.2, 0.5);
    let path = |t: f64| {
        Quat::from_scaled_axis(omega * t).inverse()
            * (Vec3::new(3.0, 1.0, -2.0) + Vec3::new(0.4, -1.0, 0.2) * t)
    };
    let (t, h) = (0.8, 1e-3);
    let velocity = (path(t + h) - path(t - h)) / (2.0 * h);
    let acceleration = (path(t + h) - path(t) * 2.0 + path(t - h)) / (h * h);
    let apparent = apparent_acceleration(&omega, &PointMotion { position: path(t), velocity });
    near3(&apparent, &acceleration, 1e-6, "−2 ω × v − ω × (ω × p)");
}

/// RTN, LVLH, VNC of an eccentric, perturbed orbit: checks the axes, and compares ω with differences.
#[test]
fn orbital_frames_turn_as_they_say() {
    let (r, v) = (Vec3::new(7e6, -2e6, 1e6), Vec3::new(1500.0, 6500.0, 3900.0));
    let a = r * (-3.986e14 / r.norm().powi(3)) + Vec3::new(1e-2, -3e-2, 2e-2);
    let h = 0.05;
    let ahead = |s: f64| (r + v * (s * h) + a * (0.5 * h * h), v + a * (s * h));
    let hat = r.cross(&v).normalize();
    for axes in [OrbitalAxes::Rtn, OrbitalAxes::Lvlh, OrbitalAxes::Vnc] {
        let frame = orbital_frame(axes, &r, &v, &a).unwrap();
        let R = matrix(&frame.pose.rotation);
        near(R.determinant(), 1.0, 1e-14, "right-handed");
        let column = |k: usize| R.column(k).into_owned();
        match axes {
            OrbitalAxes::Rtn => {
                near3(&column(0), &r.normalize(), 1e-15, "r̂");
                near3(&column(2), &hat, 1e-15, "ĥ");
            }
            OrbitalAxes::Lvlh => {
                near3(&column(2), &-r.normalize(), 1e-15, "nadir");
                near3(&column(1), &-hat, 1e-15, "−ĥ");
                assert!(column(0).dot(&v) > 0.0);
            }
            OrbitalAxes::Vnc => {
                near3(&column(0), &v.normalize(), 1e-15, "v̂");
                near3(&column(1), &hat, 1e-15, "ĥ");
            }
        }
        near3(&frame.pose.position, &r, 0.0, "origin");
        near3(&frame.velocity.linear, &v, 0.0, "velocity");
        let at = |s: f64| {
            let (r, v) = ahead(s);
            matrix(&orbital_frame(axes, &r, &v, &a).unwrap().pose.rotation)
        };
        let rate = (at(1.0) - at(-1.0)) / (2.0 * h);
        near33(&rate, &(frame.velocity.angular.cross_matrix() * R), 2e-12, "Ṙ = ω × R");
    }
    // For two bodies, ω = h/r² along ĥ.
    let kepler = r * (-3.986e14 / r.norm().powi(3));
    let omega = orbital_frame(OrbitalAxes::Rtn, &r, &v, &kepler).unwrap().velocity.angular;
    near3(&omega, &(r.cross(&v) / r.norm_squared()), 1e-18, "h/r²");
    let message =
        orbital_frame(OrbitalAxes::Rtn, &r, &(r * 1e-3), &kepler).unwrap_err().to_string();
    assert!(message.contains("no orbital plane"), "{message}");
    assert!(orbital_frame(OrbitalAxes::Vnc, &Vec3::zeros(), &v, &kepler).is_err());
    assert!(orbital_frame(OrbitalAxes::Vnc, &Vec3::new(f64::NAN, 1.0, 0.0), &v, &kepler).is_err());
}

/// JEOD's run 2: the attitude with a pitch of −11.6° from LVLH, and the rate (jeod_run2.json).
#[test]
fn lvlh_of_jeod() {
    let Some(text) = reference("orbit/jeod_run2.json") else { return };
    let all: serde_json::Value = serde_json::from_str(&text).unwrap();
    let orbit = &all["run"]["scenario"]["orbit"];
    let (r, v) = (vec3(&orbit["pos_m"]), vec3(&orbit["vel_mps"]));
    let a = r * (-number(&all["mu_m3s2"]) / r.norm().powi(3));
    let frame = orbital_frame(OrbitalAxes::Lvlh, &r, &v, &a).unwrap();
    let pitch = Quat::from_axis_angle(
        &linkwork_world::spatial::nalgebra::Vector3::y_axis(),
        (-11.6f64).to_radians(),
    );
    let R_IB = frame.pose.rotation * pitch;
    near33(&matrix(&R_IB.inverse()), &mat3(&all["initial_T_run2"]), 1e-14, "inertial to body");
    let omega = R_IB.inverse() * frame.velocity.angular;
    near3(&omega, &vec3(&all["initial_omega_run2"]), 1e-15, "rate");
}

/// A body that moves straight in inertial axes, seen from a site, has the apparent acceleration.
#[test]
fn a_straight_path_seen_from_a_site() {
    let fixed = rotation::FixedRate::about_z(0.7, 7.088e-5).unwrap();
    let rotation = Rotation::Fixed(fixed);
    let site = Site::new(&Ellipsoid::mars(), Geodetic::from_degrees(25.0, 70.0, 100.0), 0.4);
    let inertial = |t: f64| PointMotion {
        position: Vec3::new(-9e5, 3e6, 1.4e6) + Vec3::new(50.0, -300.0, 120.0) * t,
        velocity: Vec3::new(50.0, -300.0, 120.0),
    };
    let seen = |t: f64| site.motion(&rotation.at(t)).to_inner(&inertial(t));
    let (t, h) = (30.0, 5.0);
    let difference = (seen(t + h).velocity - seen(t - h).velocity) / (2.0 * h);
    let apparent = site.apparent_acceleration(&rotation.at(t).omega_P(), &seen(t));
    assert!(apparent.norm() > 0.01);
    near3(&apparent, &difference, 1e-8, "acceleration in the site");
}
