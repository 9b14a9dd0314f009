//! Moves of a tip: lines and arcs with minimum jerk.
//! ```text
//! path parameter        s(u) = 10 u³ − 15 u⁴ + 6 u⁵           u = t/T, 0 … 1: no rate, no acceleration at either end
//! line                  p = p₀ + s (p₁ − p₀)                   R = exp(s θ n) R₀,  θ n = log(R₁ R₀⁻¹)
//! arc about (c, n)      p = c + exp(s θ n) (p₀ − c)            R = exp(s θ n) R₀
//! ```
//! Source of the polynomial: Flash and Hogan, J. Neurosci. 5 (1985) 1688.

use linkwork_runtime::prelude::*;
use linkwork_spatial::{Motion, Pose};

/// Frame in which a move is written.
#[derive(Params, Clone, Copy, Debug, PartialEq, Eq)]
pub enum Written {
    /// Frame of the work, at the pose that the controller assumes.
    Work,
    /// Frame of the arm's base.
    Base,
}

/// One move of the tip. The next move begins at the commanded pose at the end of this one.
#[derive(Params, Clone, Debug)]
pub struct Move {
    /// Name of the move, for messages.
    pub name: String,
    /// Duration of the motion. Afterwards the commanded pose stays at the target until the tip has arrived.
    #[param(unit = "s", range = 1e-3..=1e6)]
    pub duration: f64,
    /// Target position of the tip at the end of the move. Default: the position at its start.
    #[param(unit = "m", default = None)]
    pub position: Option<Vec3>,
    /// Target roll, pitch, yaw of the tip at the end of the move. Default: the attitude at its start.
    #[param(unit = "rad", default = None)]
    pub rpy: Option<Vec3>,
    /// Angle of an arc about `axis` through `axis_point`, instead of a line; for example a hand that opens a door.
    #[param(unit = "rad", default = None)]
    pub turn: Option<f64>,
    /// Point on the axis of the arc.
    #[param(unit = "m", default = Vec3::zeros(), needs = "turn")]
    pub axis_point: Vec3,
    /// Direction of the axis of the arc.
    #[param(default = Vec3::z(), needs = "turn")]
    pub axis: Vec3,
    /// Frame of position, arc and force: `work` is the frame of the work, `base` the frame of the arm's base.
    #[param(default = Written::Work)]
    pub frame: Written,
    /// Feedforward force of the tip that is added to the force that controls the pose.
    #[param(unit = "N", default = Vec3::zeros())]
    pub force: Vec3,
    /// Feedforward moment of the tip.
    #[param(unit = "N m", default = Vec3::zeros())]
    pub moment: Vec3,
    /// Stiffness of a compliant tip in translation (N/m) and rotation (N m/rad): a spring with damper instead of tracking. For stability, √(k/m)
    /// times the controller's sample period must be well below 1, where m is the moving inertia. Default: tracking of the pose, whatever the contact
    /// force.
    #[param(default = None, range = 0.0..)]
    pub stiffness: Option<[f64; 2]>,
    /// Direction in which the spring of a compliant tip does not act. Only `force` and the damper act there, for example to feed a tool into the
    /// work. Default: the spring acts in all directions.
    #[param(default = None)]
    pub feed: Option<Vec3>,
    /// The move ends as soon as the tip has advanced by this distance along `feed`. If it does not within `patience`, the move fails.
    #[param(unit = "m", default = None, range = 1e-9..)]
    pub depth: Option<f64>,
    /// The move ends as soon as the spring and damper push with more than this force. If the force is not reached within `patience`, the move fails.
    /// Requires `stiffness`.
    #[param(unit = "N", default = None, range = 1e-6..)]
    pub touch: Option<f64>,
    /// Name of the load that the hand holds during the move. Default: none.
    #[param(default = None)]
    pub holds: Option<String>,
    /// Gripper command: closed.
    #[param(default = false)]
    pub grip: bool,
    /// Whether the tip must arrive before the next move begins. If false, the move ends after its duration, unless it waits for a `touch` or a
    /// `depth`.
    #[param(default = true)]
    pub arrive: bool,
}

impl Move {
    /// Returns a move in which the tip stays for `duration` (s) and holds nothing: all other parameters have their defaults.
    #[must_use]
    pub fn stay(name: &str, duration: f64) -> Self {
        Self {
            name: name.into(),
            duration,
            position: None,
            rpy: None,
            turn: None,
            axis_point: Vec3::zeros(),
            axis: Vec3::z(),
            frame: Written::Work,
            force: Vec3::zeros(),
            moment: Vec3::zeros(),
            stiffness: None,
            feed: None,
            depth: None,
            touch: None,
            holds: None,
            grip: false,
            arrive: true,
        }
    }
}

/// Commanded pose with its velocity and acceleration, base axes, at the tip's origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reference {
    /// Pose of the tip in the base.
    pub X: Pose,
    /// Velocity.
    pub V: Motion,
    /// Acceleration; the linear part is the acceleration of the origin as a material point, not the spatial one.
    pub A: Motion,
}

/// A move in the base's frame, ready to be evaluated.
#[derive(Clone, Debug)]
pub struct Path {
    position: Option<Vec3>,
    rotation: Option<Quat>,
    /// Angle, axis, point.
    arc: Option<(f64, Vec3, Vec3)>,
    duration: f64,
    /// Frame in which the move is written.
    frame: Written,
    /// Feedforward moment (N m) and force (N) of the tip, base axes.
    pub push: [Vec3; 2],
    /// Unit vector along which the spring does not act, base axes.
    pub feed: Option<Vec3>,
}

impl Path {
    /// Prepares the path of a move; `work` is the pose of the work in the base.
    ///
    /// # Errors
    /// Returns an error if `turn` is combined with `position` or `rpy`, if an axis or `feed` is zero, if `touch` or `feed` is set without
    /// `stiffness`, if `depth` is set without `feed`, or if a stiffness is not positive and finite.
    pub fn new(m: &Move, work: &Pose) -> Result<Self, BuildError> {
        let fault = |fact: &str, help: &str, at: &str| {
            Err(BuildError::new(format!("move `{}`: {fact}", m.name)).help(help).at(at))
        };
        let X = if m.frame == Written::Work { *work } else { Pose::identity() };
        if m.turn.is_some() && (m.position.is_some() || m.rpy.is_some()) {
            return fault(
                "`turn` excludes `position` and `rpy`",
                "write `turn`, or `position` and `rpy`",
                "moves",
            );
        }
        if m.turn.is_some() && !(m.axis.norm() > 1e-9) {
            return fault("`axis` is zero", "write for example axis: [0, 0, 1]", "moves");
        }
        if m.stiffness.is_some_and(|k| !k.iter().all(|k| *k > 0.0 && k.is_finite())) {
            return fault(
                "`stiffness` must be positive and finite",
                "write values above 0, in N/m and N m/rad",
                "moves",
            );
        }
        if m.touch.is_some() && m.stiffness.is_none() {
            let fact = "`touch` needs a compliant move";
            return fault(fact, "add `stiffness`", "moves");
        }
        if m.feed.is_some() && m.stiffness.is_none() {
            return fault("`feed` needs a compliant move", "add `stiffness`", "moves");
        }
        if m.feed.is_some_and(|n| !(n.norm() > 1e-9)) {
            return fault("`feed` is zero", "write for example feed: [1, 0, 0]", "moves");
        }
        if m.depth.is_some() && m.feed.is_none() {
            return fault("`depth` needs `feed`", "add `feed`", "moves");
        }
        let rotation = m.rpy.map(|a| X.rotation * Quat::from_euler_angles(a.x, a.y, a.z));
        let arc = m.turn.map(|angle| {
            (angle, X.rotation * m.axis.normalize(), X.transform_point(&m.axis_point))
        });
        Ok(Self {
            position: m.position.map(|p| X.transform_point(&p)),
            rotation,
            arc,
            duration: m.duration,
            frame: m.frame,
            push: [X.rotation * m.moment, X.rotation * m.force],
            feed: m.feed.map(|n| X.rotation * n.normalize()),
        })
    }

    /// Returns a copy for a work that was observed at an offset from its assumed position (m, base axes). Paths in the frame of the work are shifted
    /// by the offset; paths in the frame of the base are unchanged.
    #[must_use]
    pub fn seen(&self, beside: &Vec3) -> Self {
        let mut new = self.clone();
        if self.frame == Written::Work {
            new.position = self.position.map(|p| p + beside);
            new.arc = self.arc.map(|(angle, n, c)| (angle, n, c + beside));
        }
        new
    }

    /// Returns the commanded pose, velocity and acceleration `t` seconds after the start at pose `from`.
    #[must_use]
    pub fn at(&self, from: &Pose, t: f64) -> Reference {
        let T = self.duration;
        let u = (t / T).clamp(0.0, 1.0);
        let s = u * u * u * (10.0 + u * (6.0 * u - 15.0));
        let ds = 30.0 * u * u * (1.0 - u) * (1.0 - u) / T;
        let dds = 60.0 * u * (1.0 - u) * (1.0 - 2.0 * u) / (T * T);
        if let Some((angle, n, c)) = self.arc {
            let turn = Quat::from_scaled_axis(n * (s * angle));
            let r = turn * (from.position - c);
            let (w, dw) = (n * (ds * angle), n * (dds * angle));
            let (v, a) = (w.cross(&r), dw.cross(&r) + w.cross(&w.cross(&r)));
            let X = Pose::new(turn * from.rotation, c + r);
            return Reference { X, V: Motion::new(w, v), A: Motion::new(dw, a) };
        }
        let way = self.position.map_or_else(Vec3::zeros, |p| p - from.position);
        let turn = self.rotation.map_or_else(Vec3::zeros, |R| short(R * from.rotation.inverse()));
        let rotation = Quat::from_scaled_axis(turn * s) * from.rotation;
        Reference {
            X: Pose::new(rotation, from.position + way * s),
            V: Motion::new(turn * ds, way * ds),
            A: Motion::new(turn * dds, way * dds),
        }
    }

    /// Returns the duration of the motion, s.
    #[must_use]
    pub fn duration(&self) -> f64 {
        self.duration
    }
}

/// Returns the shortest rotation vector of a rotation (norm at most π), rad.
#[must_use]
pub fn short(R: Quat) -> Vec3 {
    let R = if R.w < 0.0 { Quat::new_unchecked(-R.into_inner()) } else { R };
    R.scaled_axis()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plain(name: &str) -> Move {
        Move { frame: Written::Base, ..Move::stay(name, 2.0) }
    }

    fn start() -> Pose {
        Pose::new(Quat::from_euler_angles(0.3, -0.4, 1.1), Vec3::new(0.5, 0.1, 0.2))
    }

    /// Velocity and acceleration are the derivatives of the pose.
    fn differentiates(path: &Path) {
        let (from, h) = (start(), 1e-5);
        for t in [0.2, 0.9, 1.0, 1.7] {
            let (a, b, m) = (path.at(&from, t - h), path.at(&from, t + h), path.at(&from, t));
            let v = (b.X.position - a.X.position) / (2.0 * h);
            let w = short(b.X.rotation * a.X.rotation.inverse()) / (2.0 * h);
            assert!((v - m.V.linear).norm() < 1e-8 && (w - m.V.angular).norm() < 1e-8, "{t}");
            let dv = (b.V.linear - a.V.linear) / (2.0 * h);
            let dw = (b.V.angular - a.V.angular) / (2.0 * h);
            assert!((dv - m.A.linear).norm() < 1e-8 && (dw - m.A.angular).norm() < 1e-8, "{t}");
        }
        let (first, last) = (path.at(&from, 0.0), path.at(&from, 2.0));
        assert!((first.X.position - from.position).norm() < 1e-15);
        for r in [first, last, path.at(&from, 9.0)] {
            assert!(r.V.angular.norm() + r.V.linear.norm() + r.A.linear.norm() < 1e-12);
        }
    }

    #[test]
    fn a_line_ends_where_it_is_to_end() {
        let (p, rpy) = (Vec3::new(0.2, -0.3, 0.6), Vec3::new(-0.5, 0.2, 2.5));
        let line = Move { position: Some(p), rpy: Some(rpy), ..plain("line") };
        let path = Path::new(&line, &Pose::identity()).unwrap();
        differentiates(&path);
        let end = path.at(&start(), 2.0).X;
        assert!((end.position - p).norm() < 1e-14);
        assert!(end.rotation.angle_to(&Quat::from_euler_angles(rpy.x, rpy.y, rpy.z)) < 1e-7);
    }

    #[test]
    fn an_arc_keeps_its_distance_and_its_side_to_the_axis() {
        let axis_point = Vec3::new(0.4, 0.5, -1.0);
        let arc = Move { turn: Some(-1.2), axis_point, axis: Vec3::z() * 3.0, ..plain("arc") };
        let path = Path::new(&arc, &Pose::identity()).unwrap();
        differentiates(&path);
        let far = |p: Vec3| (p - axis_point).xy().norm();
        for t in [0.0, 0.7, 1.3, 2.0] {
            let X = path.at(&start(), t).X;
            assert!((far(X.position) - far(start().position)).abs() < 1e-14);
            assert!((X.position.z - 0.2).abs() < 1e-14);
        }
        let turned = path.at(&start(), 2.0).X.rotation * start().rotation.inverse();
        assert!((short(turned) - Vec3::z() * -1.2).norm() < 1e-12);
    }

    /// An observed offset of the work shifts moves in the frame of the work, and no others.
    #[test]
    fn what_is_seen_beside_takes_its_moves_along() {
        let (p, beside) = (Vec3::new(0.3, 0.2, 0.1), Vec3::new(1e-3, -2e-3, 3e-3));
        let end = |m: &Move| {
            let path = Path::new(m, &Pose::identity()).unwrap().seen(&beside);
            differentiates(&path);
            path.at(&start(), 2.0).X.position
        };
        let line = Move { position: Some(p), frame: Written::Work, ..plain("line") };
        assert!((end(&line) - p - beside).norm() < 1e-15);
        assert!((end(&Move { frame: Written::Base, ..line }) - p).norm() < 1e-15);
        let half = Some(std::f64::consts::PI);
        let arc = Move { turn: half, axis_point: p, frame: Written::Work, ..plain("arc") };
        let across = 2.0 * (p + beside) - start().position;
        assert!((end(&arc) - across).xy().norm() < 1e-14);
        let nowhere = Move { frame: Written::Work, ..plain("stay") };
        assert!((end(&nowhere) - start().position).norm() < 1e-15);
    }

    /// A move in the frame of the work moves with the pose of the work.
    #[test]
    fn the_work_takes_its_moves_along() {
        let work = Pose::new(Quat::from_euler_angles(0.1, 0.2, 0.3), Vec3::new(1.0, 2.0, 3.0));
        let p = Vec3::new(0.3, 0.2, 0.1);
        let m = Move {
            position: Some(p),
            force: Vec3::x(),
            frame: Written::Work,
            ..plain("in the work's frame")
        };
        let path = Path::new(&m, &work).unwrap();
        assert!((path.at(&start(), 2.0).X.position - work.transform_point(&p)).norm() < 1e-14);
        assert!((path.push[1] - work.rotation * Vec3::x()).norm() < 1e-15);
    }

    #[test]
    fn moves_that_mean_nothing_are_refused() {
        let refused = |m: Move, word: &str| {
            let e = Path::new(&m, &Pose::identity()).err().unwrap();
            assert!(e.message.contains(word), "{e:?}");
        };
        refused(Move { turn: Some(1.0), position: Some(Vec3::x()), ..plain("a") }, "excludes");
        refused(Move { turn: Some(1.0), axis: Vec3::zeros(), ..plain("b") }, "is zero");
        refused(Move { touch: Some(1.0), ..plain("c") }, "compliant");
        refused(Move { feed: Some(Vec3::x()), ..plain("e") }, "compliant");
        refused(Move { depth: Some(1e-3), ..plain("f") }, "needs `feed`");
        refused(Move { stiffness: Some([100.0, 0.0]), ..plain("d") }, "must be positive");
    }
}
