//! Moves of a tip: lines and arcs with minimum jerk.
//! ```text
//! share of the way      s(u) = 10 u³ − 15 u⁴ + 6 u⁵           u = t/T, 0 … 1: no rate, no acceleration at either end
//! line                  p = p₀ + s (p₁ − p₀)                   R = exp(s θ n) R₀,  θ n = log(R₁ R₀⁻¹)
//! arc about (c, n)      p = c + exp(s θ n) (p₀ − c)            R = exp(s θ n) R₀
//! ```
//! Source of the polynomial: Flash and Hogan, J. Neurosci. 5 (1985) 1688.

use linkwork_runtime::prelude::*;
use linkwork_spatial::{Motion, Pose};

/// In which frame a move is written.
#[derive(Params, Clone, Copy, Debug, PartialEq, Eq)]
pub enum Written {
    /// In that of the work, where the controller believes it to stand.
    Work,
    /// In that of the arm's base.
    Base,
}

/// One move of the tip. The move after it begins where the wanted pose stood when this one ended.
#[derive(Params, Clone, Debug)]
pub struct Move {
    /// Its name, for messages.
    pub name: String,
    /// How long the motion takes; afterwards the tip stays at its end until it has arrived.
    #[param(unit = "s", range = 1e-3..=1e6)]
    pub duration: f64,
    /// Where the tip is to be at the end; unwritten: where it is.
    #[param(unit = "m", default = None)]
    pub position: Option<Vec3>,
    /// Roll, pitch, yaw of the tip at the end; unwritten: as it is.
    #[param(unit = "rad", default = None)]
    pub rpy: Option<Vec3>,
    /// Instead of a line: the tip turns by this angle about `axis` through `axis_point`, as a hand with a door.
    #[param(unit = "rad", default = None)]
    pub turn: Option<f64>,
    /// A point of that axis.
    #[param(unit = "m", default = Vec3::zeros())]
    pub axis_point: Vec3,
    /// Direction of that axis.
    #[param(default = Vec3::z())]
    pub axis: Vec3,
    /// work: position, turn and force are written in the frame of the work; base: in that of the arm's base.
    #[param(default = Written::Work)]
    pub frame: Written,
    /// Force that the tip presses with beside what holds its pose.
    #[param(unit = "N", default = Vec3::zeros())]
    pub force: Vec3,
    /// Moment that it turns with.
    #[param(unit = "N m", default = Vec3::zeros())]
    pub moment: Vec3,
    /// Stiffness of the tip, N/m and N m/rad: it gives way as a spring with its damper. √(k/m) of the inertia m
    /// that it moves, times the controller's sample, has to stay well below one. Unwritten: it tracks the pose, whatever the force.
    #[param(default = None, range = 0.0..)]
    pub stiffness: Option<[f64; 2]>,
    /// Direction along which the spring of a compliant tip does not act: there only `force` does, and the damper, as when something is
    /// fed into its work. Unwritten: it acts along all.
    #[param(default = None)]
    pub feed: Option<Vec3>,
    /// The move ends as soon as the tip has gone this far along `feed`, and fails when it does not come so far.
    #[param(unit = "m", default = None, range = 1e-9..)]
    pub depth: Option<f64>,
    /// The move ends as soon as that spring, with its damper, pushes with more than this, and fails when it feels nothing; for moves
    /// with `stiffness`.
    #[param(unit = "N", default = None, range = 1e-6..)]
    pub touch: Option<f64>,
    /// The load that the hand holds during the move; unwritten: none.
    #[param(default = None)]
    pub holds: Option<String>,
    /// The gripper is told to be closed.
    #[param(default = false)]
    pub grip: bool,
    /// The tip has to arrive before the next move; false: the duration alone counts, but for a `touch` or a `depth`.
    #[param(default = true)]
    pub arrive: bool,
}

impl Move {
    /// The tip stays where it is for so long (s), and holds nothing: what a file gives that names no more.
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

/// A wanted pose with its velocity and acceleration, base axes, at the tip's origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reference {
    /// Pose of the tip in the base.
    pub X: Pose,
    /// Velocity.
    pub V: Motion,
    /// Acceleration (of the origin as a point: not spatial).
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
    /// In which frame its places are written.
    frame: Written,
    /// What the tip pushes with: moment, force, base axes.
    pub push: [Vec3; 2],
    /// Unit vector along which no spring acts, base axes.
    pub feed: Option<Vec3>,
}

impl Path {
    /// From a move; `work` is the frame of the work in the base.
    ///
    /// # Errors
    /// A turn beside an end, an axis or a feed without a direction, a touch or a feed without stiffness, a depth without feed, a
    /// stiffness that is none.
    pub fn new(m: &Move, work: &Pose) -> Result<Self, BuildError> {
        let fault = |fact: &str, help: &str, at: &str| {
            Err(BuildError::new(format!("move `{}`: {fact}", m.name)).help(help).at(at))
        };
        let X = if m.frame == Written::Work { *work } else { Pose::identity() };
        if m.turn.is_some() && (m.position.is_some() || m.rpy.is_some()) {
            return fault(
                "a turn has no other end",
                "write `turn`, or `position` and `rpy`",
                "moves",
            );
        }
        if m.turn.is_some() && !(m.axis.norm() > 1e-9) {
            return fault("the axis has no direction", "write e.g. axis: [0, 0, 1]", "moves");
        }
        if m.stiffness.is_some_and(|k| !k.iter().all(|k| *k > 0.0 && k.is_finite())) {
            return fault("a stiffness is not positive", "write N/m and N m/rad above 0", "moves");
        }
        if m.touch.is_some() && m.stiffness.is_none() {
            let fact = "it is to feel a touch, and is not compliant";
            return fault(fact, "write `stiffness`, too", "moves");
        }
        if m.feed.is_some() && m.stiffness.is_none() {
            return fault("it is fed, and is not compliant", "write `stiffness`, too", "moves");
        }
        if m.feed.is_some_and(|n| !(n.norm() > 1e-9)) {
            return fault("`feed` has no direction", "write e.g. feed: [1, 0, 0]", "moves");
        }
        if m.depth.is_some() && m.feed.is_none() {
            return fault("it ends at a depth, and is not fed", "write `feed`, too", "moves");
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

    /// The same where the work is seen so far beside where it was believed to be (m, base axes): what is written in its
    /// frame goes along.
    #[must_use]
    pub fn seen(&self, beside: &Vec3) -> Self {
        let mut new = self.clone();
        if self.frame == Written::Work {
            new.position = self.position.map(|p| p + beside);
            new.arc = self.arc.map(|(angle, n, c)| (angle, n, c + beside));
        }
        new
    }

    /// The wanted pose `t` s after the start at `from`.
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

    /// How long the motion takes, s.
    #[must_use]
    pub fn duration(&self) -> f64 {
        self.duration
    }
}

/// The rotation vector of a turn, the short way round (at most π), rad.
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

    /// What is seen beside where it was believed takes along what is written in its frame, and nothing else.
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

    /// A move that is written in the work's frame goes along with it.
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
        refused(Move { turn: Some(1.0), position: Some(Vec3::x()), ..plain("a") }, "no other end");
        refused(Move { turn: Some(1.0), axis: Vec3::zeros(), ..plain("b") }, "no direction");
        refused(Move { touch: Some(1.0), ..plain("c") }, "not compliant");
        refused(Move { feed: Some(Vec3::x()), ..plain("e") }, "not compliant");
        refused(Move { depth: Some(1e-3), ..plain("f") }, "not fed");
        refused(Move { stiffness: Some([100.0, 0.0]), ..plain("d") }, "not positive");
    }
}
