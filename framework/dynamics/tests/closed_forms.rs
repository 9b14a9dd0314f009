//! Closed forms: double pendulum, tops, free rotation by elliptic functions, screws.
//!
//! Algebraic results are compared directly. Motions are integrated with the solver layer's RK4, with a step whose error is below the tolerance, and
//! compared with the closed form at the end.

use crate::support::{Rng, close};
use linkwork_dynamics::multibody::{BodySpec, Builder, Hinge, Multibody};
use linkwork_dynamics::spatial::nalgebra::{Quaternion, Unit};
use linkwork_dynamics::spatial::{MassProperties, Mat3, Pose, Quat, Vec3};
use linkwork_dynamics::*;
use linkwork_integrate::{Field, Integrator, Method};

/// A mechanism and its workspace.
struct System {
    mbs: Multibody,
    tree: Tree,
    ws: Workspace,
    gravity: Vec3,
}

impl System {
    fn new(bodies: impl IntoIterator<Item = BodySpec>, gravity: Vec3) -> Self {
        let mut b = Builder::new();
        for body in bodies {
            b.body(body);
        }
        let mbs = b.build().unwrap();
        let tree = Tree::new(&mbs);
        let ws = Workspace::new(&tree);
        Self { mbs, tree, ws, gravity }
    }

    /// Computes v̇. `tau` is an input on free coordinates and an output on prescribed ones; `vdot` vice versa.
    fn forward(&mut self, q: &[f64], v: &[f64], tau: &mut [f64], vdot: &mut [f64]) {
        self.ws.clear_forces();
        self.ws.apply_uniform_gravity(self.gravity);
        forward_dynamics(&self.tree, &mut self.ws, q, v, tau, vdot).unwrap();
    }

    fn inverse(&mut self, q: &[f64], v: &[f64], vdot: &[f64]) -> Vec<f64> {
        let mut tau = vec![0.0; v.len()];
        self.ws.clear_forces();
        self.ws.apply_uniform_gravity(self.gravity);
        inverse_dynamics(&self.tree, &mut self.ws, q, v, vdot, &mut tau);
        tau
    }

    /// Moves `q` and `v` by `time` in `steps` of RK4, under constant `tau`.
    fn run(&mut self, q: &mut [f64], v: &mut [f64], tau: &[f64], time: f64, steps: usize) {
        let (nq, h) = (q.len(), time / steps as f64);
        let mut x = [&*q, &*v].concat();
        let mut rk = Integrator::new(Method::by_name("rk4").unwrap(), x.len());
        let mut tau = tau.to_vec();
        let mut rate = |_: f64, x: &[f64], dx: &mut [f64]| {
            let (q, v) = x.split_at(nq);
            let (dq, dv) = dx.split_at_mut(nq);
            self.mbs.qdot(q, v, dq);
            self.forward(q, v, &mut tau, dv);
        };
        for k in 0..steps {
            let t = k as f64 * h;
            rk.step_fixed(&mut Field(&mut rate), t, h, &mut x, None).unwrap();
        }
        q.copy_from_slice(&x[..nq]);
        v.copy_from_slice(&x[nq..]);
    }
}

fn matrix(R: Quat) -> Mat3 {
    R.to_rotation_matrix().into_inner()
}

/// Rotation about a unit axis.
fn turn(axis: Vec3, angle: f64) -> Mat3 {
    matrix(Quat::from_axis_angle(&Unit::new_normalize(axis), angle))
}

/// Returns the attitude in a state whose quaternion [x y z w] starts at `at`.
fn attitude(q: &[f64], at: usize) -> Mat3 {
    matrix(Quat::from_quaternion(Quaternion::new(q[at + 3], q[at], q[at + 1], q[at + 2])))
}

fn quaternion(R: Quat) -> [f64; 4] {
    [R.i, R.j, R.k, R.w]
}

/// A positive number, 0.2 … 1.
fn size(r: &mut Rng) -> f64 {
    0.1 + 0.9 * r.signed().abs()
}

#[test]
fn double_pendulum_of_rigid_bodies() {
    // Pins about −y, hanging along −z at q = 0, q2 relative to the first body. Body i has mass m_i,
    // centre of mass at distance c_i from its pin, moment J_i about the axis through it; a is the
    // distance between the pins, g gravity; s12 = sin(q1 + q2). Lagrange's equations are
    //   M11 = J1 + m1 c1² + J2 + m2 (a² + c2² + 2 a c2 cos q2)
    //   M12 = J2 + m2 (c2² + a c2 cos q2),   M22 = J2 + m2 c2²
    //   C1 = −m2 a c2 s2 (2 u1 u2 + u2²),    C2 = m2 a c2 s2 u1²
    //   G1 = (m1 c1 + m2 a) g s1 + m2 c2 g s12,   G2 = m2 c2 g s12
    //   M u̇ + C + G = τ
    let mut r = Rng(41);
    for _ in 0..30 {
        let [m1, m2, c1, c2, a, g] = [(); 6].map(|()| size(&mut r));
        // The bodies have a full inertia matrix, but only the moment about y matters.
        let (I1, I2) = (r.mass().inertia_com, r.mass().inertia_com);
        let (J1, J2) = (I1[(1, 1)], I2[(1, 1)]);
        let body = |name: &str, parent: &str, at: f64, m, c: f64, I| {
            BodySpec::new(name, parent)
                .hinge_in_parent(Pose::translation(0.0, 0.0, -at))
                .hinge(Hinge::pin(-Vec3::y()))
                .mass(MassProperties::new(m, Vec3::new(0.0, 0.0, -c), I))
        };
        let bodies =
            [body("upper", "world", 0.0, m1, c1, I1), body("lower", "upper", a, m2, c2, I2)];
        let mut s = System::new(bodies, Vec3::new(0.0, 0.0, -g));
        let (q, u, mut tau) = (r.vec(2), r.vec(2), r.vec(2));
        let (s1, s2, k2, s12) = (q[0].sin(), q[1].sin(), q[1].cos(), (q[0] + q[1]).sin());
        let M11 = J1 + m1 * c1 * c1 + J2 + m2 * (a * a + c2 * c2 + 2.0 * a * c2 * k2);
        let (M12, M22) = (J2 + m2 * (c2 * c2 + a * c2 * k2), J2 + m2 * c2 * c2);
        let C =
            [-m2 * a * c2 * s2 * (2.0 * u[0] * u[1] + u[1] * u[1]), m2 * a * c2 * s2 * u[0] * u[0]];
        let G = [(m1 * c1 + m2 * a) * g * s1 + m2 * c2 * g * s12, m2 * c2 * g * s12];

        let mut M = [0.0; 4];
        poses(&s.tree, &mut s.ws, &q);
        mass_matrix(&s.tree, &mut s.ws, &mut M);
        close(&M, &[M11, M12, M12, M22], 1e-13, "mass matrix");
        let still = [0.0; 2];
        close(&s.inverse(&q, &still, &still), &G, 1e-12, "gravity");
        let gravity = std::mem::take(&mut s.gravity);
        close(&s.inverse(&q, &u, &still), &C, 1e-12, "Coriolis and centrifugal");
        s.gravity = gravity;
        let (r1, r2) = (tau[0] - C[0] - G[0], tau[1] - C[1] - G[1]);
        let det = M11 * M22 - M12 * M12;
        let want = [(M22 * r1 - M12 * r2) / det, (M11 * r2 - M12 * r1) / det];
        let mut vdot = [0.0; 2];
        s.forward(&q, &u, &mut tau, &mut vdot);
        close(&vdot, &want, 1e-12, "accelerations");
    }
}

#[test]
fn a_free_symmetric_top_precesses_about_its_angular_momentum() {
    // The moments of inertia are J3 about the symmetry axis e, and J about the axes across it. L is the angular momentum in the world.
    //   ω = L/J + (1 − J3/J) ω3 e
    //   R(t) = turn(L, |L| t/J) R(0) turn(e, κ t),   κ = (1 − J3/J) ω3
    //   ω(t) = turn(e, −κ t) ω(0)                    in the body: ω3 stays
    let (J, J3, time) = (0.8, 0.3, 3.0);
    let mut r = Rng(5);
    for free in [false, true] {
        let e = r.vec3().normalize();
        let I = Mat3::identity() * J + e * e.transpose() * (J3 - J);
        let hinge = if free { Hinge::free() } else { Hinge::ball() };
        let mass = MassProperties::new(1.7, Vec3::zeros(), I);
        let mut s =
            System::new([BodySpec::new("top", "world").hinge(hinge).mass(mass)], Vec3::zeros());
        let (R0, w0, at) = (r.quat(), r.vec3(), if free { 3 } else { 0 });
        let (mut q, mut v) = (vec![0.0; at + 4], vec![0.0; at + 3]);
        q[at..].copy_from_slice(&quaternion(R0));
        v[..3].copy_from_slice(w0.as_slice());
        s.run(&mut q, &mut v, &vec![0.0; at + 3], time, 3000);

        let (R0, kappa) = (matrix(R0), (1.0 - J3 / J) * w0.dot(&e));
        let L = R0 * I * w0;
        let R = turn(L, L.norm() * time / J) * R0 * turn(e, kappa * time);
        // Measured over all motions of this file: 3e-13, mostly round-off.
        close(&v[..3], (turn(e, -kappa * time) * w0).as_slice(), 1e-12, "rates");
        close(attitude(&q, at).as_slice(), R.as_slice(), 1e-12, "attitude");
    }
}

#[test]
fn a_heavy_top_precesses_steadily_without_nutation() {
    // Axis e at the angle θ from the vertical z, fixed point at distance c below the centre of mass;
    // J about the fixed point across e, J3 along it. Steady precession at the rate Ω needs
    //   J Ω² cos θ − J3 ω3 Ω + m g c = 0
    // and then, with s = ω3 − Ω cos θ,
    //   R(t) = turn(z, Ω t) R(0) turn(e, s t),   ω = Ω z + s e,   ω̇ = Ω s z × e   (world axes)
    // so that the body components change by R^T ω̇. Upright (θ = 0) it sleeps: ω̇ = 0.
    let (m, g, c, J, J3, time) = (1.3, 9.81, 0.21, 0.35, 0.12, 1.5);
    let mut r = Rng(6);
    for theta in [0.0, 0.4, 1.1, 2.3] {
        let e = r.vec3().normalize();
        let I = Mat3::identity() * (J - m * c * c) + e * e.transpose() * (J3 - J + m * c * c);
        let mass = MassProperties::new(m, e * c, I);
        let top = BodySpec::new("top", "world").hinge(Hinge::ball()).mass(mass);
        let mut s = System::new([top], Vec3::new(0.0, 0.0, -g));
        // Choose any attitude with e at θ from z.
        let up = Quat::rotation_between(&e, &Vec3::z()).unwrap();
        let tilt = Quat::from_axis_angle(&Vec3::x_axis(), theta);
        let R0 = Quat::from_axis_angle(&Vec3::z_axis(), 0.7) * tilt * up;
        let R = matrix(R0);
        let Omega = 2.1_f64;
        let w3 = (J * Omega * Omega * theta.cos() + m * g * c) / (J3 * Omega);
        let spin = w3 - Omega * theta.cos();
        let w = R.transpose() * (Vec3::z() * Omega) + e * spin;
        let (mut q, mut v) = (quaternion(R0).to_vec(), w.as_slice().to_vec());
        let mut vdot = [0.0; 3];
        s.forward(&q, &v, &mut [0.0; 3], &mut vdot);
        let want = R.transpose() * Vec3::z().cross(&(R * e)) * (Omega * spin);
        for (x, y) in vdot.iter().zip(want.iter()) {
            assert!((x - y).abs() <= 1e-12 * Omega * spin, "θ {theta}: {vdot:?}, not {want:?}");
        }
        s.run(&mut q, &mut v, &[0.0; 3], time, 14_000);
        let after = turn(Vec3::z(), Omega * time) * R * turn(e, spin * time);
        let w = after.transpose() * (Vec3::z() * Omega) + e * spin;
        close(attitude(&q, 0).as_slice(), after.as_slice(), 1e-12, "attitude");
        close(&v, w.as_slice(), 1e-12, "rates");
    }
}

/// Free rotation of an asymmetric body in principal axes, ordered so that ω3 keeps its sign.
///
/// From Euler's equations with L² and 2E constant, ω1 = W1 cn u, ω2 = W2 sn u, ω3 = W3 dn u,
/// u = p t + u0, where with Δi = L² − 2E Ii
/// ```text
/// W1² = Δ3 / (I1 (I1 − I3)),  W2² = Δ3 / (I2 (I2 − I3)),  W3² = Δ1 / (I3 (I3 − I1))
/// p = −(I2 − I3) W2 W3 / (I1 W1),   modulus m = Δ3 (I1 − I2) / (Δ1 (I3 − I2))
/// ```
/// (I1 ω̇1 = −I1 W1 p sn dn = (I2 − I3) W2 W3 sn dn). For the attitude let T turn L to z:
/// ```text
/// T = [L1 L3, L2 L3, −L⊥²] / (L L⊥);  [−L2, L1, 0] / L⊥;  [L1, L2, L3] / L,   L⊥² = L1² + L2²
/// R(t) = R(0) T(0)^T turn(z, ψ) T(t)
/// ψ̇ = L (2E − I3 ω3²) / L⊥²                    and L⊥² = I1² W1² (1 − n sn² u)
///   = L/I3 − L (I1 − I3) / (I1 I3 (1 − n sn² u)),   n = I3 (I2 − I1) / (I1 (I2 − I3))
/// ψ = L t/I3 − L (I1 − I3) / (I1 I3 p) (Π(n; u) − Π(n; u0))
/// ```
struct FreeRotation {
    I: [f64; 3],
    W: [f64; 3],
    p: f64,
    m: f64,
    u0: f64,
}

impl FreeRotation {
    /// `delta` selects a motion between the separatrix (0) and pure spin about axis 3 (1).
    fn new(I: [f64; 3], L: f64, delta: f64, u0: f64, signs: [f64; 2]) -> Self {
        // 2E lies between L²/I2 and L²/I3.
        let E2 = L * L * ((1.0 - delta) / I[1] + delta / I[2]);
        let D = |i: usize| L * L - E2 * I[i];
        let W1 = signs[0] * (D(2) / (I[0] * (I[0] - I[2]))).sqrt();
        let W2 = (D(2) / (I[1] * (I[1] - I[2]))).sqrt();
        let W3 = signs[1] * (D(0) / (I[2] * (I[2] - I[0]))).sqrt();
        let p = -(I[1] - I[2]) * W2 * W3 / (I[0] * W1);
        let m = D(2) * (I[0] - I[1]) / (D(0) * (I[2] - I[1]));
        Self { I, W: [W1, W2, W3], p, m, u0 }
    }

    fn rates(&self, t: f64) -> Vec3 {
        let phi = amplitude(self.p * t + self.u0, self.m);
        let (sn, cn) = phi.sin_cos();
        let dn = (1.0 - self.m * sn * sn).sqrt();
        Vec3::new(self.W[0] * cn, self.W[1] * sn, self.W[2] * dn)
    }

    /// From the body at `t` to the body at 0.
    fn attitude(&self, t: f64) -> Mat3 {
        let I = Vec3::from_column_slice(&self.I);
        let [I1, I2, I3] = self.I;
        let momentum = |t: f64| I.component_mul(&self.rates(t));
        let L = momentum(0.0).norm();
        let n = I3 * (I2 - I1) / (I1 * (I2 - I3));
        let Pi = |t: f64| third_kind(n, amplitude(self.p * t + self.u0, self.m), self.m);
        let psi = L * t / I3 - L * (I1 - I3) / (I1 * I3 * self.p) * (Pi(t) - Pi(0.0));
        let T = |t: f64| {
            let l = momentum(t) / L;
            let across = l.x.hypot(l.y);
            Mat3::new(
                l.x * l.z / across,
                l.y * l.z / across,
                -across,
                -l.y / across,
                l.x / across,
                0.0,
                l.x,
                l.y,
                l.z,
            )
        };
        T(0.0).transpose() * turn(Vec3::z(), psi) * T(t)
    }
}

/// am(u | m) by the arithmetic-geometric mean: φ_N = 2^N a_N u, then back by
/// sin(2 φ_{n−1} − φ_n) = (c_n/a_n) sin φ_n. sn u = sin am u, cn u = cos am u.
fn amplitude(u: f64, m: f64) -> f64 {
    let (mut a, mut b, mut ratios) = (1.0_f64, (1.0 - m).sqrt(), Vec::new());
    while ratios.last().is_none_or(|x| *x > 1e-17) && ratios.len() < 30 {
        let c = 0.5 * (a - b);
        (a, b) = (0.5 * (a + b), (a * b).sqrt());
        ratios.push(c / a);
    }
    let mut phi = a * u * 2.0_f64.powi(ratios.len() as i32);
    for ratio in ratios.into_iter().rev() {
        phi = 0.5 * (phi + (ratio * phi.sin()).asin());
    }
    phi
}

/// Π(n; φ | m) = ∫₀^φ dθ / ((1 − n sin²θ) √(1 − m sin²θ)), any φ, by Gauss–Legendre: the integrand
/// is smooth, and each piece of π/16 is exact to rounding with eight points.
fn third_kind(n: f64, phi: f64, m: f64) -> f64 {
    const NODES: [(f64, f64); 4] = [
        (0.183_434_642_495_649_80, 0.362_683_783_378_361_98),
        (0.525_532_409_916_328_99, 0.313_706_645_877_887_29),
        (0.796_666_477_413_626_74, 0.222_381_034_453_374_47),
        (0.960_289_856_497_536_23, 0.101_228_536_290_376_26),
    ];
    let f = |x: f64| {
        let s2 = x.sin().powi(2);
        1.0 / ((1.0 - n * s2) * (1.0 - m * s2).sqrt())
    };
    let pieces = (phi.abs() * 16.0 / std::f64::consts::PI).ceil().max(1.0);
    let half = 0.5 * phi / pieces;
    let piece = |k: usize| {
        let mid = half * (2 * k + 1) as f64;
        NODES.iter().map(|(x, w)| w * (f(mid - half * x) + f(mid + half * x))).sum::<f64>()
    };
    half * (0..pieces as usize).map(piece).sum::<f64>()
}

#[test]
fn the_elliptic_functions_of_this_test_are_right() {
    // Check sn, cn, dn at m = 0 and at a quarter period, and their differential equation.
    assert!((amplitude(0.7, 0.0) - 0.7).abs() < 1e-15);
    let (mut a, mut b) = (1.0_f64, 0.3_f64.sqrt());
    for _ in 0..8 {
        (a, b) = (0.5 * (a + b), (a * b).sqrt());
    }
    let quarter = std::f64::consts::FRAC_PI_2;
    assert!((amplitude(quarter / a, 0.7) - quarter).abs() < 1e-14);
    for u in [-2.3, 0.4, 1.9, 6.5] {
        let (h, m) = (1e-5, 0.83);
        let slope = (amplitude(u + h, m) - amplitude(u - h, m)) / (2.0 * h);
        let dn = (1.0 - m * amplitude(u, m).sin().powi(2)).sqrt();
        assert!((slope - dn).abs() < 1e-9, "{slope} {dn}");
        // Π(0; am u) = u, and Π(n; φ | 0) = atan(√(1−n) tan φ) / √(1−n).
        assert!((third_kind(0.0, amplitude(u, m), m) - u).abs() < 1e-13);
    }
    let k = 1.6_f64.sqrt();
    assert!((third_kind(-0.6, 1.2, 0.0) - (k * 1.2_f64.tan()).atan() / k).abs() < 1e-14);
}

#[test]
fn an_asymmetric_body_rotates_freely_by_elliptic_functions() {
    let (time, mut r) = (4.0, Rng(17));
    // Test ω3 about the smallest and about the largest moment, near the separatrix and far from it.
    for I in [[0.9, 0.7, 0.4], [0.4, 0.7, 0.9]] {
        for (delta, signs) in [(0.05, [1.0, 1.0]), (0.4, [-1.0, 1.0]), (0.8, [1.0, -1.0])] {
            let exact = FreeRotation::new(I, 1.1, delta, 0.6, signs);
            assert!(exact.m > 0.0 && exact.m < 1.0, "modulus {}", exact.m);
            // The principal axes are rotated in the body, and the attitude is random; all vectors
            // are in axes of the body B.
            let X = matrix(r.quat());
            let J = X * Mat3::from_diagonal(&Vec3::from_column_slice(&I)) * X.transpose();
            let mass = MassProperties::new(2.2, Vec3::zeros(), (J + J.transpose()) * 0.5);
            for free in [false, true] {
                let hinge = if free { Hinge::free() } else { Hinge::ball() };
                let body = BodySpec::new("body", "world").hinge(hinge).mass(mass);
                let mut s = System::new([body], Vec3::zeros());
                let (R0, at) = (r.quat(), if free { 3 } else { 0 });
                let (mut q, mut v) = (vec![0.0; at + 4], vec![0.0; at + 3]);
                q[at..].copy_from_slice(&quaternion(R0));
                v[..3].copy_from_slice((X * exact.rates(0.0)).as_slice());
                s.run(&mut q, &mut v, &vec![0.0; at + 3], time, 4000);
                let R = matrix(R0) * X * exact.attitude(time) * X.transpose();
                close(&v[..3], (X * exact.rates(time)).as_slice(), 1e-12, "rates");
                close(attitude(&q, at).as_slice(), R.as_slice(), 1e-12, "attitude");
            }
        }
    }
}

/// A nut on a screw along `axis` (unit): mass m, centre of mass c off the axis, inertia I, pitch s,
/// rotor A.
struct Nut {
    axis: Vec3,
    mass: MassProperties,
    s: f64,
    A: f64,
    g: Vec3,
}

impl Nut {
    fn random(r: &mut Rng) -> Self {
        let (axis, mass) = (r.vec3().normalize(), r.mass());
        Self { axis, mass, s: r.signed(), A: size(r), g: r.vec3() * 5.0 }
    }

    fn hinge(&self) -> Hinge {
        Hinge::screw(self.axis, self.s).armature(self.A)
    }

    fn system(&self, hinge: Hinge) -> System {
        System::new([BodySpec::new("nut", "world").hinge(hinge).mass(self.mass)], self.g)
    }

    /// N = a·I a + m |a × c|² + m s² + A is constant, so the velocity has no influence.
    fn inertia(&self) -> f64 {
        let (m, c) = (self.mass.mass, self.mass.com);
        let across = self.axis.cross(&c).norm_squared();
        self.axis.dot(&(self.mass.inertia_com * self.axis))
            + m * across
            + m * self.s.powi(2)
            + self.A
    }

    /// m g · (s a + a × r) with r = turn(a, q) c: the effect of gravity.
    fn weight(&self, q: f64) -> f64 {
        let arm = self.axis.cross(&(turn(self.axis, q) * self.mass.com));
        self.mass.mass * self.g.dot(&(self.axis * self.s + arm))
    }
}

#[test]
fn a_screw_under_torque_and_weight() {
    // N q̈ = T + m g · (s a + a × r).
    let mut r = Rng(23);
    for _ in 0..20 {
        let nut = Nut::random(&mut r);
        let mut s = nut.system(nut.hinge());
        let (q, u, T) = (r.signed() * 3.0, r.signed() * 4.0, r.signed());
        let mut vdot = [0.0];
        s.forward(&[q], &[u], &mut [T], &mut vdot);
        close(&vdot, &[(T + nut.weight(q)) / nut.inertia()], 1e-12, "acceleration");

        // The motion without weight is q + u t + T/N t²/2, and the nut advances by s a q.
        s.gravity = Vec3::zeros();
        let (time, mut x, mut v) = (2.0, [q], [u]);
        s.run(&mut x, &mut v, &[T], time, 7);
        let a = T / nut.inertia();
        close(&x, &[q + u * time + 0.5 * a * time * time], 1e-12, "angle");
        close(&v, &[u + a * time], 1e-12, "rate");
        poses(&s.tree, &mut s.ws, &x);
        let id = s.mbs.body("nut").unwrap();
        let p = s.ws.body_pose(&s.tree, id).position;
        close(p.as_slice(), (nut.axis * nut.s * x[0]).as_slice(), 1e-12, "advance");
    }
}

#[test]
fn a_driven_screw_says_what_torque_it_takes() {
    // With q̈ given, T = N q̈ − m g · (s a + a × r).
    let mut r = Rng(29);
    for _ in 0..20 {
        let nut = Nut::random(&mut r);
        let mut s = nut.system(nut.hinge().prescribed());
        let (q, u, given) = (r.signed() * 3.0, r.signed() * 4.0, r.signed());
        let (mut tau, mut vdot) = ([0.0], [given]);
        s.forward(&[q], &[u], &mut tau, &mut vdot);
        assert_eq!(vdot, [given]);
        close(&tau, &[nut.inertia() * given - nut.weight(q)], 1e-12, "torque");
    }
}
