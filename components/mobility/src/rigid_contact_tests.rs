//! Rigid contact: loads against hand-worked cases, holding, refusal of energy.

use super::*;

fn msl() -> RigidContact {
    RigidContact {
        wheel: Wheel { radius: 0.25, width: 0.4 },
        stiffness: 4e5,
        exponent: 1.0,
        dissipation: 3.0,
        tangential_stiffness: 2e5,
        tangential_damping: 1500.0,
        friction: 0.8,
    }
}

const MASS: f64 = 150.0;
const INERTIA: f64 = 0.1;
const GRAVITY: f64 = 3.72;

/// A wheel with a sixth of a rover on its hub: translation in W and spin about the axle (y).
#[derive(Clone, Copy)]
struct Rig {
    p: Vec3,
    v: Vec3,
    spin: f64,
    xi: Bristles,
}

impl Rig {
    fn at(p: Vec3) -> Rig {
        Rig { p, v: Vec3::zeros(), spin: 0.0, xi: [Vec3::zeros(); DISCS] }
    }

    /// Semi-implicit Euler; `brake` holds the wheel to the hub, else `torque` acts on it.
    fn step(
        &mut self,
        c: &RigidContact,
        slope: f64,
        dt: f64,
        brake: bool,
        torque: f64,
    ) -> ContactLoad {
        let n = Vec3::new(-slope.sin(), 0.0, slope.cos());
        let plane = |x: f64, _: f64| Some((x * slope.tan(), n));
        let hub = Hub {
            position: self.p,
            axle: Vec3::y(),
            velocity: self.v,
            angular: Vec3::y() * self.spin,
        };
        let (load, rates) = c.evaluate(&hub, &self.xi, &plane);
        for (x, r) in self.xi.iter_mut().zip(rates) {
            *x += r * dt;
        }
        self.v += (load.force / MASS - Vec3::z() * GRAVITY) * dt;
        if !brake {
            self.spin += (torque + load.moment.y) / INERTIA * dt;
        }
        self.p += self.v * dt;
        load
    }
}

#[test]
fn a_parked_wheel_does_not_creep() {
    for slope_deg in [5.0, 15.0, 25.0, 35.0_f64] {
        let slope = slope_deg.to_radians();
        let mut rig = Rig::at(Vec3::new(0.0, 0.0, 0.25 / slope.cos()));
        for _ in 0..20_000 {
            rig.step(&msl(), slope, 1e-3, true, 0.0);
        }
        let before = rig.p;
        for _ in 0..10_000 {
            rig.step(&msl(), slope, 1e-3, true, 0.0);
        }
        let creep = (rig.p - before).norm() / 10.0;
        println!("{slope_deg}°: {creep:e} m/s");
        assert!(creep < 1e-12, "{slope_deg}°: {creep} m/s");
    }
}

#[test]
fn beyond_the_friction_angle_it_slides_with_coulombs_acceleration() {
    let slope = 45f64.to_radians();
    let mut rig = Rig::at(Vec3::new(0.0, 0.0, 0.25 / slope.cos()));
    for _ in 0..1000 {
        rig.step(&msl(), slope, 1e-3, true, 0.0);
    }
    let v1 = rig.v.norm();
    for _ in 0..1000 {
        rig.step(&msl(), slope, 1e-3, true, 0.0);
    }
    let got = rig.v.norm() - v1;
    let want = GRAVITY * (slope.sin() - 0.8 * slope.cos());
    assert!((got - want).abs() < 0.02 * want, "{got} {want}");
}

#[test]
fn weight_is_carried_at_the_depth_of_the_spring() {
    let mut rig = Rig::at(Vec3::new(0.0, 0.0, 0.25));
    let mut load = rig.step(&msl(), 0.0, 1e-3, true, 0.0);
    for _ in 0..20_000 {
        load = rig.step(&msl(), 0.0, 1e-3, true, 0.0);
    }
    assert!((load.normal_force - MASS * GRAVITY).abs() < 1e-6, "{load:?}");
    assert!((load.depth - MASS * GRAVITY / 4e5).abs() < 1e-9);
}

#[test]
fn a_driven_wheel_rolls_without_slip_and_obeys_its_torque() {
    let mut rig = Rig::at(Vec3::new(0.0, 0.0, 0.2486));
    for _ in 0..3000 {
        rig.step(&msl(), 0.0, 1e-3, true, 0.0);
    }
    let torque = 20.0;
    let mut last = rig;
    for i in 0..6000 {
        rig.step(&msl(), 0.0, 1e-3, false, torque);
        if i == 2999 {
            last = rig;
        }
    }
    // F = M a, T − F r = I α and a = α r give a = T r/(I + M r²).
    // Forces act at the point on the rim, so the rolling radius is the radius of the wheel.
    let r = 0.25;
    let want = torque * r / (INERTIA + MASS * r * r);
    let got = (rig.v.x - last.v.x) / 3.0;
    assert!((got - want).abs() < 0.002 * want, "{got} {want}");
    assert!((rig.spin * r - rig.v.x).abs() < 1e-3 * rig.v.x, "{} {}", rig.spin * r, rig.v.x);
}

#[test]
fn too_much_torque_spins_the_wheel_at_the_friction_limit() {
    let mut rig = Rig::at(Vec3::new(0.0, 0.0, 0.2486));
    let mut load = rig.step(&msl(), 0.0, 1e-3, false, 0.0);
    for _ in 0..2000 {
        load = rig.step(&msl(), 0.0, 1e-3, false, 200.0);
    }
    assert!((load.force.x - 0.8 * load.normal_force).abs() < 1e-6 * load.normal_force, "{load:?}");
    assert!(load.dissipation > 0.0);
}

#[test]
fn energy_only_falls() {
    let c = msl();
    let mut rig = Rig::at(Vec3::new(0.0, 0.0, 0.30));
    rig.v = Vec3::new(0.4, 0.3, 0.0);
    rig.spin = 3.0;
    let dt = 1e-5;
    let energy = |r: &Rig, depth: f64| {
        let springs: f64 =
            r.xi.iter().map(|x| 0.5 * c.tangential_stiffness / 3.0 * x.norm_squared()).sum();
        0.5 * MASS * r.v.norm_squared()
            + 0.5 * INERTIA * r.spin * r.spin
            + MASS * GRAVITY * r.p.z
            + 0.5 * c.stiffness * depth * depth
            + springs
    };
    let start = energy(&rig, 0.0);
    let mut lost = 0.0;
    let mut load = rig.step(&c, 0.0, dt, false, 0.0);
    for i in 0..200_000 {
        load = rig.step(&c, 0.0, dt, false, 0.0);
        lost += load.dissipation * dt;
        assert!(load.dissipation > -1e-6, "step {i}: {load:?}");
    }
    let end = energy(&rig, load.depth);
    assert!(((start - end) - lost).abs() < 0.01 * start.abs(), "{start} {end} {lost}");
}

#[test]
fn turning_on_the_spot_is_resisted() {
    // The wheel spins about the normal. The two outer discs slide, so the moment is μ N times a
    // third of the width times two thirds.
    let plane = |_: f64, _: f64| Some((0.0, Vec3::z()));
    let hub = Hub {
        position: Vec3::new(0.0, 0.0, 0.2486),
        axle: Vec3::y(),
        velocity: Vec3::zeros(),
        angular: Vec3::z() * 2.0,
    };
    let (load, _) = msl().evaluate(&hub, &[Vec3::zeros(); DISCS], &plane);
    let want = -0.8 * load.normal_force * (0.4 / 3.0) * (2.0 / 3.0);
    // At 0.27 m/s, the damper alone (133 N) is below the friction limit (149 N).
    assert!(load.moment.z < 0.0 && load.moment.z >= want, "{} {want}", load.moment.z);
}

#[test]
fn order_of_rk4_is_kept_in_the_elastic_range() {
    // The contact is smooth while it sticks, so halving the step of RK4 divides the error by 16.
    let c = msl();
    let plane = |_: f64, _: f64| Some((0.0, Vec3::z()));
    let rhs = |y: &[f64; 6]| {
        let hub = Hub {
            position: Vec3::new(y[0], 0.0, y[1]),
            axle: Vec3::y(),
            velocity: Vec3::new(y[2], 0.0, y[3]),
            angular: Vec3::zeros(),
        };
        let xi = Vec3::new(y[4], 0.0, 0.0);
        let (load, rates) = c.evaluate(&hub, &[xi; DISCS], &plane);
        let f = load.force / MASS;
        [y[2], y[3], f.x, f.z - GRAVITY, rates[0].x, 0.0]
    };
    let run = |steps: u32| {
        let h = 0.1 / f64::from(steps);
        let mut y = [0.0, 0.2484, 0.01, 0.0, 0.0, 0.0];
        for _ in 0..steps {
            let add = |k: &[f64; 6], s: f64| std::array::from_fn(|i| y[i] + s * k[i]);
            let k1 = rhs(&y);
            let k2 = rhs(&add(&k1, 0.5 * h));
            let k3 = rhs(&add(&k2, 0.5 * h));
            let k4 = rhs(&add(&k3, h));
            y = std::array::from_fn(|i| y[i] + h / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]));
        }
        y
    };
    let exact = run(6400);
    let error = |y: [f64; 6]| (y[0] - exact[0]).abs() + (y[1] - exact[1]).abs();
    let ratio = error(run(50)) / error(run(100));
    assert!((10.0..25.0).contains(&ratio), "{ratio}");
}

#[test]
fn a_bristle_at_its_limit_springs_back_elastically() {
    // A bristle at its limit follows the wheel at once if the wheel slides back, because this motion is
    // elastic.
    let c = msl();
    let plane = |_: f64, _: f64| Some((0.0, Vec3::z()));
    let at = |vx: f64| {
        let hub = Hub {
            position: Vec3::new(0.0, 0.0, 0.2486),
            axle: Vec3::y(),
            velocity: Vec3::x() * vx,
            angular: Vec3::zeros(),
        };
        // The load is 560 N and the limit 448 N, so the largest deflection is 2.24 mm.
        c.rates(&hub, &[Vec3::x() * 2.24e-3; DISCS], &plane)[1].x
    };
    assert!(at(0.01).abs() < 1e-9, "forward it slides: {}", at(0.01));
    assert!((at(-0.01) + 0.01).abs() < 1e-12, "backward it is a spring: {}", at(-0.01));
}
