//! A planar rover with three wheels, rocker and bogie, computed by hand: the friction that its wheels need to climb a vertical face.
//!
//! Rocker and chassis rotate as one (both sides are equal), the bogie about its pivot. All wheels slip forwards: the force of a contact with normal n
//! and driving direction t is N (n + μ t). On the ground n = z, t = x; on the face n = (−cos e, sin e), t = (sin e, cos e), where e is 0 on the face
//! itself and increases on its edge.
//!
//! ```text
//! Σ F_z = W,   Σ moments = 0,   Σ moments of the bogie about its pivot = 0      three N for a given μ
//! Σ F_x = 0                                                                     the required μ
//! ```
//! Positions and vectors are (x, z), x forwards, z up; angles rotate x towards −z, as about +y.
#![allow(dead_code, non_snake_case)]

use linkwork_dynamics::spatial::nalgebra::{
    Matrix2x4, Matrix4, Matrix6, Vector2, Vector4, Vector6,
};
use linkwork_dynamics::spatial::{Mat3, Vec3};

pub type V2 = Vector2<f64>;

/// Radius of the wheels, m.
pub const R: f64 = 0.25;
/// Hubs of front, middle and rear if all are at one level, from the ground below the frame's origin, m.
pub const HUBS: [V2; 3] = [V2::new(1.095, R), V2::new(-0.089, R), V2::new(-1.163, R)];
/// The bogie's pivot, in the same frame.
pub const PIVOT: V2 = V2::new(-0.54, 0.6443);
pub const G: f64 = 9.81;

/// Masses, kg, and moments of inertia about their centres, kg m². Those of bogie and wheels are at pivot and hubs.
#[derive(Clone, Copy, Debug)]
pub struct Rover {
    pub frame: (f64, f64),
    pub com: V2,
    pub bogie: (f64, f64),
    pub wheel: (f64, f64),
}

/// Height of the frame's origin, its pitch, and the bogie's angle relative to it.
pub type Posture = [f64; 3];

/// Positions of hubs, pivot and the frame's centre of mass.
pub struct Places {
    pub hubs: [V2; 3],
    pub pivot: V2,
    pub com: V2,
}

/// Returns a vector rotated by an angle.
fn turn(angle: f64, v: V2) -> V2 {
    let (s, c) = angle.sin_cos();
    V2::new(c * v.x + s * v.y, c * v.y - s * v.x)
}

/// Returns the moment of F at p about the origin; like an angle it is positive from x towards −z.
fn moment(p: V2, F: V2) -> f64 {
    p.y * F.x - p.x * F.y
}

/// Returns the contribution to the three equations of balance of a force at p on a wheel, or on its carrier.
fn part(at: &Places, wheel: usize, p: V2, F: V2) -> Vec3 {
    let of_bogie = if wheel == 0 { 0.0 } else { moment(p - at.pivot, F) };
    Vec3::new(F.y, moment(p, F), of_bogie)
}

impl Rover {
    pub fn places(&self, [z, pitch, bogie]: Posture) -> Places {
        let on_frame = |p: V2| V2::new(0.0, z) + turn(pitch, p);
        let pivot = on_frame(PIVOT);
        let on_bogie = |p: V2| pivot + turn(pitch + bogie, p - PIVOT);
        let hubs = [on_frame(HUBS[0]), on_bogie(HUBS[1]), on_bogie(HUBS[2])];
        Places { hubs, pivot, com: on_frame(self.com) }
    }

    /// Returns the posture with hubs at these heights, by Newton's method with differences.
    pub fn posture(&self, heights: [f64; 3]) -> Posture {
        let at = |u: Vec3| {
            let hubs = self.places(u.into()).hubs;
            Vec3::from_fn(|i, _| hubs[i].y - heights[i])
        };
        let mut u = Vec3::zeros();
        for _ in 0..30 {
            let (f, d) = (at(u), 1e-6);
            let J = Mat3::from_columns(
                &[Vec3::x(), Vec3::y(), Vec3::z()]
                    .map(|e| (at(u + e * d) - at(u - e * d)) / (2.0 * d)),
            );
            u -= J.try_inverse().unwrap() * f;
        }
        assert!(at(u).norm() < 1e-12, "no posture with hubs at {heights:?}");
        u.into()
    }

    /// Returns the load of the contacts: vertical force, moment, moment of the bogie about its pivot.
    fn load(&self, at: &Places) -> Vec3 {
        let weight = |m: f64, p: V2, wheel: usize| -part(at, wheel, p, V2::new(0.0, -m * G));
        let wheels = (0..3).map(|i| weight(self.wheel.0, at.hubs[i], i));
        weight(self.frame.0, at.com, 0)
            + weight(self.bogie.0, at.pivot, 1)
            + wheels.fold(Vec3::zeros(), |sum, w| sum + w)
    }

    /// Returns the friction with which `wheel`, at this elevation of its normal, neither climbs nor descends.
    pub fn required(&self, heights: [f64; 3], wheel: usize, elevation: f64) -> f64 {
        let at = self.places(self.posture(heights));
        let (s, c) = elevation.sin_cos();
        // Returns the residual horizontal force; NaN if a contact would have to pull.
        let left = |mu: f64| {
            let (mut points, mut ways) = (at.hubs.map(|h| h - V2::y() * R), [V2::new(mu, 1.0); 3]);
            points[wheel] = at.hubs[wheel] - V2::new(-c, s) * R;
            ways[wheel] = V2::new(-c, s) + V2::new(s, c) * mu;
            let A = Mat3::from_columns(&[0, 1, 2].map(|i| part(&at, i, points[i], ways[i])));
            let N = A.try_inverse().unwrap() * self.load(&at);
            let sum = (0..3).map(|i| N[i] * ways[i].x).sum::<f64>();
            if N.min() > 0.0 { sum } else { f64::NAN }
        };
        let grid = (1..200).map(|k| 0.01 * f64::from(k));
        let (mut low, mut high) = grid
            .map(|mu| (mu, mu + 0.01))
            .find(|(a, b)| left(*a) < 0.0 && left(*b) >= 0.0)
            .expect("some friction suffices");
        for _ in 0..50 {
            let mid = 0.5 * (low + high);
            *(if left(mid) < 0.0 { &mut low } else { &mut high }) = mid;
        }
        0.5 * (low + high)
    }

    /// Returns the largest friction required on the way up a face of height `step`, with the others at these heights.
    pub fn required_on_the_way(&self, mut heights: [f64; 3], wheel: usize, step: f64) -> f64 {
        let mut worst = 0.0_f64;
        for k in 0..100 {
            let z = R + step * f64::from(k) / 100.0;
            heights[wheel] = z;
            worst = worst.max(self.required(heights, wheel, ((z - step) / R).max(0.0).asin()));
        }
        worst
    }

    /// Returns the forces of a rover that is stalled at the face with all wheels slipping: on the wheels from below, and on `wheel` from the face.
    /// The latter balances the drive: N_w = μ Σ N.
    pub fn stalled(&self, heights: [f64; 3], wheel: usize, mu: f64) -> (Vec3, f64) {
        let at = self.places(self.posture(heights));
        let column = |i: usize| {
            let below = part(&at, i, at.hubs[i] - V2::y() * R, V2::new(mu, 1.0));
            below + part(&at, wheel, at.hubs[wheel] + V2::x() * R, V2::new(-mu, mu * mu))
        };
        let A = Mat3::from_columns(&[column(0), column(1), column(2)]);
        let N = A.try_inverse().unwrap() * self.load(&at);
        (N, mu * N.sum())
    }

    /// On one level, with the wheel just off ground and face and the others slipping on the ground: returns its acceleration away from the face, and
    /// the acceleration per unit of the face's force with its friction (1/kg).
    pub fn off_the_face(&self, wheel: usize, mu: f64) -> [f64; 2] {
        let at = self.places([0.0; 3]);
        // Rates: the frame's origin (x, z), its pitch, and the bogie.
        let J = |p: V2, of_bogie: bool| {
            let (f, b) = (p, p - at.pivot);
            let k = f64::from(of_bogie);
            Matrix2x4::new(1.0, 0.0, f.y, k * b.y, 0.0, 1.0, -f.x, -k * b.x)
        };
        let mut M = Matrix4::zeros();
        let mut Q = Vector4::zeros();
        let mut mass = |(m, I): (f64, f64), p: V2, of_bogie: bool| {
            let (j, w) = (J(p, of_bogie), Vector4::new(0.0, 0.0, 1.0, f64::from(of_bogie)));
            M += j.transpose() * j * m + w * w.transpose() * I;
            Q -= j.row(1).transpose() * (m * G);
        };
        mass(self.frame, at.com, false);
        mass(self.bogie, at.pivot, true);
        // Wheels rotate at given rates relative to their carrier, so their inertia adds to it.
        for (i, hub) in at.hubs.into_iter().enumerate() {
            mass(self.wheel, hub, i > 0);
        }
        let mut A = Matrix6::zeros();
        A.fixed_view_mut::<4, 4>(0, 0).copy_from(&M);
        for (k, i) in (0..3).filter(|i| *i != wheel).enumerate() {
            let j = J(at.hubs[i] - V2::y() * R, i > 0);
            A.fixed_view_mut::<1, 4>(4 + k, 0).copy_from(&j.row(1));
            let push = j.transpose() * V2::new(mu, 1.0);
            A.fixed_view_mut::<4, 1>(0, 4 + k).copy_from(&-push);
        }
        let face = J(at.hubs[wheel] + V2::x() * R, wheel > 0);
        let solve = |f: Vector4<f64>| {
            let mut right = Vector6::zeros();
            right.fixed_rows_mut::<4>(0).copy_from(&f);
            let x = A.lu().solve(&right).unwrap();
            -(face * x.fixed_rows::<4>(0)).x
        };
        [solve(Q), solve(face.transpose() * V2::new(-1.0, mu))]
    }
}

/// Returns the heights of hubs with all wheels on the ground, or with those of `before` on a step.
pub fn heights(before: &[usize], step: f64) -> [f64; 3] {
    [0, 1, 2].map(|i| if before.contains(&i) { R + step } else { R })
}
