//! Two hands that hold an object by friction alone: contact wrenches under which neither hand slips.
//!
//! In the axes of its contact (n: normal force on the object, t: tangential), a hand can exert the wrench [m; f] about its tip if
//! ```text
//! ‖ f_t/µ,  m_n/(⅔ µ r),  m_t/r ‖ ≤ f_n ≤ f_max            u = (f_n, f_t/µ, m_n/(⅔ µ r), m_t/r)
//! min ½ Σ ‖u − u₀‖²   over the internal wrench between the hands; the net wrench on the object does not change
//! ```
//! The contact is a patch of radius r with uniform pressure. Its limit surface is approximated by an ellipsoid (Howe, Cutkosky 1996), and its centre
//! of pressure must lie within the patch. Both conditions form one cone, which is stricter than each of them. This is a second-order cone problem
//! with six unknowns. A barrier method with Newton's method first finds any feasible point, then the nearest one.

use super::Robot;
use crate::error::RobotError;
use crate::model::Object;
use linkwork_spatial::nalgebra::{Matrix6, SMatrix, SVector, Vector6};
use linkwork_spatial::{Force, Mat3, Pose, Vec3};

/// Friction contact of a hand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Friction {
    /// Direction in which the hand presses on the object, in the tip's axes; any length except zero.
    pub normal: Vec3,
    /// Coefficient of friction µ, above zero.
    pub coefficient: f64,
    /// Radius of the contact patch, m, above zero.
    pub radius: f64,
    /// Largest normal force, N, above zero; infinity for no limit.
    pub most: f64,
}

/// Wrenches of two hands under which neither slips.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gripped {
    /// Wrenches on the object about the tips, world axes: first hand, then second hand.
    pub wrenches: [Force; 2],
    /// 0 if neither hand slips. Otherwise no such wrenches exist, and this is the smallest force, N, by which all cones and limits would have to be
    /// enlarged; `wrenches` are those for the enlarged cones.
    pub shortfall: f64,
}

/// Unknowns: the internal wrench between the hands, and the enlargement of the cones.
type Unknowns = SVector<f64, 7>;
type Hessian = SMatrix<f64, 7, 7>;

/// Maximum number of Newton steps for one weight of the barrier.
const STEPS: usize = 60;
/// Duality gap at which the optimization ends, relative to the square of the forces.
const GAP: f64 = 1e-13;

/// One hand: u = a + B λ.
#[derive(Clone, Copy)]
struct Hand {
    a: Vector6<f64>,
    B: Matrix6<f64>,
    most: f64,
}

impl Hand {
    fn u(&self, x: &Unknowns) -> Vector6<f64> {
        self.a + self.B * x.fixed_rows::<6>(0)
    }

    /// Returns the distance from the cone in force, N; negative inside.
    fn shortfall(&self, x: &Unknowns) -> f64 {
        let u = self.u(x);
        (u.fixed_rows::<5>(1).norm() - u[0]).max(u[0] - self.most)
    }

    /// Adds value, gradient and Hessian of the barrier; returns `None` outside the cone.
    fn barrier(&self, x: &Unknowns, g: &mut Unknowns, H: &mut Hessian) -> Option<f64> {
        let u = self.u(x);
        let p = u[0] + x[6];
        let s = u.fixed_rows::<5>(1);
        // This product is accurate near the cone, where the difference of the squares would lose all digits.
        let norm = s.norm();
        let w = (p - norm) * (p + norm);
        if !(p > norm && w > 0.0) {
            return None;
        }
        let mut v = -u;
        v[0] = p;
        // The columns are the derivatives of u with respect to the unknowns; the last one enlarges
        // the cone.
        let mut D = SMatrix::<f64, 6, 7>::zeros();
        D.fixed_columns_mut::<6>(0).copy_from(&self.B);
        D[(0, 6)] = 1.0;
        let slope = D.transpose() * v;
        *g -= slope * (2.0 / w);
        let mut signed = D;
        signed.row_mut(0).neg_mut();
        *H += slope * slope.transpose() * (4.0 / (w * w)) + D.transpose() * signed * (2.0 / w);
        let mut value = -w.ln();
        if self.most.is_finite() {
            let room = self.most + x[6] - u[0];
            if !(room > 0.0) {
                return None;
            }
            let mut d = -D.row(0).transpose();
            d[6] = 1.0;
            *g -= d / room;
            *H += d * d.transpose() / (room * room);
            value -= room.ln();
        }
        Some(value)
    }
}

/// Objective that is added to the barrier.
#[derive(Clone, Copy, PartialEq)]
enum Aim {
    /// x₆, the enlargement of the cones.
    Within,
    /// The distance from the given wrenches.
    Nearest,
}

struct Problem {
    hands: [Hand; 2],
    /// ΣBᵀB.
    weight: Matrix6<f64>,
}

impl Problem {
    /// Returns value, gradient and Hessian of barrier and objective, the objective multiplied by t.
    fn at(&self, x: &Unknowns, aim: Aim, t: f64) -> Option<(f64, Unknowns, Hessian)> {
        let (mut g, mut H) = (Unknowns::zeros(), Hessian::zeros());
        let mut value = 0.0;
        for hand in &self.hands {
            value += hand.barrier(x, &mut g, &mut H)?;
        }
        match aim {
            Aim::Within => {
                value += t * x[6];
                g[6] += t;
            }
            Aim::Nearest => {
                let l = x.fixed_rows::<6>(0);
                let Wl = self.weight * l;
                value += 0.5 * t * l.dot(&Wl);
                let mut top = g.fixed_rows_mut::<6>(0);
                top += Wl * t;
                let mut block = H.fixed_view_mut::<6, 6>(0, 0);
                block += self.weight * t;
                // The cones are not enlarged in this stage.
                g[6] = 0.0;
                H.row_mut(6).fill(0.0);
                H.column_mut(6).fill(0.0);
                H[(6, 6)] = 1.0;
            }
        }
        Some((value, g, H))
    }

    /// Performs Newton's method for one weight until `enough` returns true.
    fn settle(&self, x: &mut Unknowns, aim: Aim, t: f64, enough: impl Fn(&Unknowns) -> bool) {
        for _ in 0..STEPS {
            let Some((value, g, H)) = self.at(x, aim, t) else { return };
            let scale = 1e-14 * H.diagonal().max();
            let damped = H + Hessian::identity() * scale;
            let Some(step) = damped.cholesky().map(|c| -c.solve(&g)) else { return };
            let fall = -g.dot(&step);
            if !(fall > 1e-12) {
                return;
            }
            let mut length = 1.0;
            let next = loop {
                let next = *x + step * length;
                match self.at(&next, aim, t) {
                    Some((after, ..)) if after <= value - 0.1 * length * fall => break next,
                    _ if length < 1e-10 => return,
                    _ => length *= 0.5,
                }
            };
            *x = next;
            if enough(x) {
                return;
            }
        }
    }

    fn shortfall(&self, x: &Unknowns) -> f64 {
        self.hands.iter().map(|h| h.shortfall(x)).fold(f64::NEG_INFINITY, f64::max)
    }

    /// Returns the unknowns and the enlargement of the cones that is needed.
    fn solve(&self) -> (Unknowns, f64) {
        let mut x = Unknowns::zeros();
        let off = self.shortfall(&x);
        if off <= 0.0 {
            return (x, 0.0);
        }
        let size = self.hands.iter().map(|h| h.a.norm()).fold(off, f64::max);
        // First find a strictly feasible point, with a margin for the barrier of the second stage.
        x[6] = off + size;
        let within = |x: &Unknowns| self.shortfall(x) < -1e-9 * size;
        let mut t = 1.0 / size;
        while t * size < 1e12 && !within(&x) {
            self.settle(&mut x, Aim::Within, t, within);
            t *= 10.0;
        }
        if !within(&x) {
            let shortfall = self.shortfall(&x).max(0.0);
            return (x, shortfall);
        }
        x[6] = 0.0;
        let mut t = 1.0 / (size * size);
        while t * size * size * GAP < 6.0 {
            self.settle(&mut x, Aim::Nearest, t, |_| false);
            t *= 8.0;
        }
        (x, 0.0)
    }
}

/// Returns the matrix that maps [m; f] in world axes to a hand's scaled wrench in the axes of its contact.
fn rows(friction: &Friction, X: &Pose) -> Matrix6<f64> {
    let n = (X.rotation * friction.normal).normalize();
    let a = n.cross(&Vec3::ith(n.iamin(), 1.0)).normalize();
    let b = n.cross(&a);
    let (mu, r) = (friction.coefficient, friction.radius);
    let mut out = Matrix6::zeros();
    let mut put = |row: usize, first: usize, axis: &Vec3, scale: f64| {
        (0..3).for_each(|k| out[(row, first + k)] = axis[k] / scale);
    };
    put(0, 3, &n, 1.0);
    put(1, 3, &a, mu);
    put(2, 3, &b, mu);
    put(3, 0, &n, 2.0 / 3.0 * mu * r);
    put(4, 0, &a, r);
    put(5, 0, &b, r);
    out
}

/// Returns the matrix that shifts a wrench from O to a tip at `l` from O.
fn shifted(l: &Vec3) -> Matrix6<f64> {
    let mut out = Matrix6::identity();
    let lx = Mat3::new(0.0, -l.z, l.y, l.z, 0.0, -l.x, -l.y, l.x, 0.0);
    out.fixed_view_mut::<3, 3>(0, 3).copy_from(&-lx);
    out
}

fn six(f: &Force) -> Vector6<f64> {
    let mut out = Vector6::zeros();
    out.fixed_rows_mut::<3>(0).copy_from(&f.moment);
    out.fixed_rows_mut::<3>(3).copy_from(&f.force);
    out
}

impl Robot {
    /// Computes wrenches of two hands on an object under which neither hand slips, at the robot's q. They are the nearest to the given `wrenches`
    /// (first hand, then second hand; on the object, each about its tip, world axes) with the same net wrench on the object: the hands press as hard
    /// as friction requires and not harder than their limits. Distances are scaled by what friction can hold. Wrenches under which neither hand slips
    /// are returned unchanged; all others lie inside the cones by 1e-6 of the forces. If there is no solution, `shortfall` of the result is positive.
    ///
    /// # Errors
    /// [`RobotError::ForeignHandle`], [`RobotError::NotHeld`], [`RobotError::EmptyHand`] (no second hand), [`RobotError::NotFinite`],
    /// [`RobotError::OutOfRange`] (friction parameters that are not positive).
    pub fn grip(
        &mut self,
        object: Object,
        wrenches: &[Force; 2],
        friction: &[Friction; 2],
    ) -> Result<Gripped, RobotError> {
        super::dual::check(wrenches)?;
        for f in friction {
            super::numbers("normal of a grip", f.normal.as_slice(), 3)?;
            let most = if f.most == f64::INFINITY { f64::MAX } else { f.most };
            let asked = [
                ("length of a grip's normal", f.normal.norm()),
                ("coefficient of friction", f.coefficient),
                ("radius of a patch", f.radius),
                ("greatest normal force", most),
            ];
            let bad = asked.into_iter().find(|(_, x)| !(*x > 0.0 && x.is_finite()));
            if let Some((what, value)) = bad {
                return Err(RobotError::OutOfRange {
                    what,
                    value,
                    help: "give a number above zero",
                });
            }
        }
        let (first, second) = self.hands(object)?;
        let p_O = self.object_pose(object)?.position;
        let tips = [self.tip_pose(first)?, self.tip_pose(second)?];
        let about = tips.map(|X| shifted(&(X.position - p_O)));
        let hand = |i: usize, sign: f64| {
            let rows = rows(&friction[i], &tips[i]);
            let B = rows * about[i] * sign;
            Hand { a: rows * six(&wrenches[i]), B, most: friction[i].most }
        };
        let hands = [hand(0, -1.0), hand(1, 1.0)];
        let weight = hands.iter().map(|h| h.B.transpose() * h.B).sum();
        let (x, shortfall) = Problem { hands, weight }.solve();
        let mut out = Gripped { wrenches: *wrenches, shortfall };
        let l = x.fixed_rows::<6>(0).into_owned();
        if l != Vector6::zeros() {
            for (i, sign) in [(0, -1.0), (1, 1.0)] {
                let more = about[i] * l * sign;
                out.wrenches[i].moment += more.fixed_rows::<3>(0);
                out.wrenches[i].force += more.fixed_rows::<3>(3);
            }
        }
        Ok(out)
    }
}
