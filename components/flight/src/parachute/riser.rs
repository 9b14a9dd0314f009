//! `flight.riser`: tension-only riser between a canopy and the legs of a bridle on a rotating body.
//! ```text
//! K = { p : |p − a_i| ≤ l_i for all legs }        where the legs let their joint be, fixed in the body
//! p: the point of K next to the canopy            d = p_c − p      δ = |d| − L      δ̇ = (v_c − v_p) · d/|d|
//! T = k δ + c δ̇  while taut, else 0               on the body: T d/|d| at p,  on the canopy: −T d/|d|
//! T d/|d| = Σ t_i (p − a_i)/|p − a_i|,  t_i ≥ 0   legs that are taut; one, two or three hold the joint
//! taut while both δ and k δ + c δ̇ are positive
//! ```
//! The legs are inextensible (k is the stiffness of riser, lines and legs in series) and massless, as is their joint. The force therefore derives
//! from the potential ½ k δ², which is least at the point of K closest to the canopy; v_p is the velocity of the body at that point. While three legs
//! are taut, the riser acts at a point fixed to the body. As the canopy moves to the side, one leg and then a second goes slack, and the force stays
//! continuous. Transitions of the riser between taut and slack are events, as in `flight.line`.

use super::line::{Change, LineOut, Taut, TautOut};
use linkwork_runtime::prelude::*;
use linkwork_spatial::Mat3;

/// Greatest number of legs of a bridle.
const LEGS_MAX: usize = 8;

/// Leg of the bridle.
#[derive(Params, Clone, Debug)]
pub struct Leg {
    /// Attachment point relative to the node of the body, axes of the node.
    #[param(unit = "m")]
    pub at: Vec3,
    /// Length of the leg.
    #[param(unit = "m", range = 1e-6..)]
    pub length: f64,
}

/// Parameters of a riser and its bridle.
#[derive(Params, Clone, Debug)]
pub struct RiserParams {
    /// Unstretched length L from the canopy to the joint of the legs.
    #[param(unit = "m", range = 1e-6..)]
    pub length: f64,
    /// Stiffness k of riser, lines and legs in series.
    #[param(unit = "N/m", range = 1e-9..)]
    pub stiffness: f64,
    /// Damping c along the riser.
    #[param(unit = "N s/m", default = 0.0, range = 0.0..)]
    pub damping: f64,
    /// Legs of the bridle, 1 to 8.
    pub legs: Vec<Leg>,
    /// The riser is meant to be taut at the start. Otherwise a riser that is longer than L at the start causes a warning.
    #[param(default = false)]
    pub taut: bool,
}

/// Ends of the riser.
#[derive(Ports, Clone, Copy, Debug)]
pub struct RiserIn {
    /// Node of the body with the legs.
    #[port(bind = "body")]
    pub body: NodeState,
    /// Node of the canopy.
    #[port(bind = "canopy")]
    pub canopy: NodeState,
}

/// Forces and length.
#[derive(Ports, Clone, Copy, Debug)]
pub struct RiserOut {
    /// Load on the body, at its node.
    #[port(bind = "body")]
    pub on_body: Wrench,
    /// Load on the canopy.
    #[port(bind = "canopy")]
    pub on_canopy: Wrench,
    /// Tension of the riser.
    #[port("N")]
    pub tension: f64,
    /// Extension over the unstretched length; negative when slack.
    #[port("m")]
    pub extension: f64,
    /// Rate of the extension.
    #[port("m/s")]
    pub rate: f64,
    /// Angle from the body's z to the riser.
    #[port("rad")]
    pub angle: f64,
    /// Number of taut legs; 0 when the riser is slack.
    #[port("1")]
    pub legs: f64,
    /// Greatest tension of a leg.
    #[port("N")]
    pub leg_tension: f64,
    /// Joint of the legs, W; for a slack riser the point of K closest to the canopy.
    #[port("m")]
    pub joint: Vec3,
}

/// Joint of the legs closest to a point: position in body axes, m, and the taut legs.
#[derive(Clone, Copy, Debug)]
struct Joint {
    at: Vec3,
    legs: [usize; 3],
    taut: usize,
}

/// Circle on which two legs are taut: centre, unit normal and radius.
struct Circle {
    legs: [usize; 2],
    centre: Vec3,
    normal: Vec3,
    radius: f64,
}

/// Riser with a bridle.
pub struct Riser {
    p: RiserParams,
    circles: Vec<Circle>,
    /// Points at which three legs are taut.
    corners: Vec<Joint>,
}

/// Geometry of a riser: joint relative to the body's node (W), unit vector to the canopy, extension and its rate.
struct Stretch {
    joint: Joint,
    arm: Vec3,
    n: Vec3,
    extension: f64,
    rate: f64,
}

impl Riser {
    /// Returns the circle on which legs i and j are both taut, if it exists.
    fn circle(legs: &[Leg], i: usize, j: usize) -> Option<Circle> {
        let between = legs[j].at - legs[i].at;
        let apart = between.norm();
        if !(apart > 0.0) {
            return None;
        }
        let (l, m) = (legs[i].length, legs[j].length);
        let along = (apart * apart + (l - m) * (l + m)) / (2.0 * apart);
        let square = (l - along) * (l + along);
        let normal = between / apart;
        let centre = legs[i].at + normal * along;
        (square > 0.0).then(|| Circle { legs: [i, j], centre, normal, radius: square.sqrt() })
    }

    /// Returns the points of a circle at which leg k is taut, too.
    fn corners(legs: &[Leg], c: &Circle, k: usize) -> Vec<Joint> {
        let to = legs[k].at - c.centre;
        let height = to.dot(&c.normal);
        let flat = to - c.normal * height;
        let off = flat.norm();
        let square = legs[k].length.powi(2) - height * height;
        if !(off > 0.0 && square > 0.0) {
            return Vec::new();
        }
        let along = (off * off + c.radius.powi(2) - square) / (2.0 * off);
        let root = (c.radius - along) * (c.radius + along);
        if !(root > 0.0) {
            return Vec::new();
        }
        let (u, across) = (flat / off, c.normal.cross(&(flat / off)) * root.sqrt());
        let at = |side: f64| Joint {
            at: c.centre + u * along + across * side,
            legs: [c.legs[0], c.legs[1], k],
            taut: 3,
        };
        vec![at(1.0), at(-1.0)]
    }

    /// Returns true if all legs reach a point.
    fn reached(&self, p: &Vec3) -> bool {
        // The tolerance covers the round-off of points on the boundary of K.
        let slop = 1e-12 * (1.0 + p.norm());
        self.p.legs.iter().all(|l| (p - l.at).norm() <= l.length + slop)
    }

    /// Returns the joint closest to a point, body axes; `None` if the legs are too short to meet.
    fn nearest(&self, c: &Vec3) -> Option<Joint> {
        if self.reached(c) {
            return Some(Joint { at: *c, legs: [0; 3], taut: 0 });
        }
        let one = |k: usize| {
            let (leg, d) = (&self.p.legs[k], c - self.p.legs[k].at);
            let at = leg.at + d * (leg.length / d.norm());
            Joint { at, legs: [k; 3], taut: 1 }
        };
        let two = |s: &Circle| {
            let d = c - s.centre;
            let flat = d - s.normal * d.dot(&s.normal);
            let off = flat.norm();
            let at = s.centre + flat * (s.radius / off);
            (off > 0.0).then_some(Joint { at, legs: [s.legs[0], s.legs[1], 0], taut: 2 })
        };
        // At the closest point one, two or three legs are taut. Choose the closest candidate that all legs reach.
        let mut best: Option<(f64, Joint)> = None;
        let mut take = |j: Joint| {
            let apart = (c - j.at).norm_squared();
            if self.reached(&j.at) && best.is_none_or(|(b, _)| apart < b) {
                best = Some((apart, j));
            }
        };
        (0..self.p.legs.len()).for_each(|k| take(one(k)));
        self.circles.iter().filter_map(two).for_each(&mut take);
        self.corners.iter().copied().for_each(&mut take);
        best.map(|(_, j)| j)
    }

    fn stretch(&self, u: &RiserIn) -> Stretch {
        let to_body = u.body.rotation.inverse();
        let c = to_body * (u.canopy.position - u.body.position);
        let none = Joint { at: c, legs: [0; 3], taut: 0 };
        let joint = self.nearest(&c).unwrap_or(none);
        let arm = u.body.rotation * joint.at;
        let d = u.canopy.position - u.body.position - arm;
        // If the canopy is inside K, the joint is at the canopy.
        let now = if joint.taut > 0 { d.norm() } else { 0.0 };
        let n = if now > 0.0 { d / now } else { Vec3::zeros() };
        let moved = u.canopy.velocity - u.body.velocity - u.body.angular.cross(&arm);
        Stretch { joint, arm, n, extension: now - self.p.length, rate: moved.dot(&n) }
    }

    /// Returns the tensions of the taut legs relative to the tension of a riser with the direction `n`, body axes.
    fn shares(&self, joint: &Joint, n: &Vec3) -> Vec3 {
        let e = |i: usize| (joint.at - self.p.legs[joint.legs[i]].at).normalize();
        match joint.taut {
            0 => Vec3::zeros(),
            1 => Vec3::x(),
            2 => {
                let (a, b) = (e(0), e(1));
                let (c, x, y) = (a.dot(&b), a.dot(n), b.dot(n));
                Vec3::new(x - c * y, y - c * x, 0.0) / (1.0 - c * c)
            }
            _ => Mat3::from_columns(&[e(0), e(1), e(2)])
                .try_inverse()
                .map_or_else(Vec3::zeros, |m| m * n),
        }
    }
}

/// Riser of a parachute, from its canopy to the legs of a bridle on a rotating body; transitions between slack and taut are events.
#[model("flight.riser")]
impl Model for Riser {
    const MODES: bool = true;
    type Params = RiserParams;
    type FeedthroughInputs = RiserIn;
    type Outputs = TautOut;
    type FeedthroughOutputs = RiserOut;
    type DiscreteState = Taut;
    type Guards = Change;
    fn build(p: RiserParams) -> Result<Self, BuildError> {
        let wrong = |fact: String, help: &str| Err(BuildError::new(fact).help(help).at("legs"));
        let n = p.legs.len();
        if n == 0 || n > LEGS_MAX {
            let help = "write 1 to 8 legs, e.g. legs: [(at: [0, 0, 1], length: 2)]";
            return wrong(format!("the bridle has {n} legs"), help);
        }
        let mut circles = Vec::new();
        for i in 0..n {
            circles.extend((i + 1..n).filter_map(|j| Self::circle(&p.legs, i, j)));
        }
        let mut corners = Vec::new();
        for c in &circles {
            let after = c.legs[1] + 1;
            corners.extend((after..n).flat_map(|k| Self::corners(&p.legs, c, k)));
        }
        let m = Riser { p, circles, corners };
        let far = m.p.legs.iter().map(|l| l.at.norm() + l.length).sum::<f64>();
        if m.nearest(&Vec3::new(0.3 * far, -0.2 * far, 2.0 * far)).is_none() {
            return wrong("the legs are too short to meet".into(), "increase the lengths");
        }
        Ok(m)
    }
    fn init_d(&self) -> Taut {
        Taut { taut: self.p.taut, changes: 0.0 }
    }
    fn outputs(&self, d: &Taut) -> TautOut {
        TautOut { taut: d.taut, changes: d.changes }
    }
    fn feedthrough(&self, d: &Taut, u: &RiserIn) -> RiserOut {
        let s = self.stretch(u);
        let law = (self.p.stiffness, self.p.damping);
        let line = LineOut::of((s.n, s.extension, s.rate), law, d.taut);
        let shares = self.shares(&s.joint, &(u.body.rotation.inverse() * s.n));
        let z = u.body.rotation * Vec3::z();
        RiserOut {
            on_body: Wrench { moment: s.arm.cross(&line.on_a.force), force: line.on_a.force },
            on_canopy: line.on_b,
            tension: line.tension,
            extension: s.extension,
            rate: s.rate,
            angle: s.n.cross(&z).norm().atan2(s.n.dot(&z)),
            legs: if line.tension > 0.0 { s.joint.taut as f64 } else { 0.0 },
            leg_tension: shares.max() * line.tension,
            joint: u.body.position + s.arm,
        }
    }
    fn guards(&self, u: &RiserIn) -> Change {
        let s = self.stretch(u);
        Change::of(s.extension, s.rate, (self.p.stiffness, self.p.damping))
    }
    fn mode(&self, d: &Taut, u: &RiserIn) -> Taut {
        let s = self.stretch(u);
        let law = (self.p.stiffness, self.p.damping);
        d.after(Change::of(s.extension, s.rate, law).within > 0.0)
    }
    fn handle_event(&self, fired: Fired<'_>, d: &Taut) -> ((), Taut) {
        ((), d.after(fired.rose(0)))
    }
    fn startup_warnings(&self, u: &RiserIn) -> Vec<BuildError> {
        let extension = self.stretch(u).extension;
        let unexpected = !self.p.taut && extension > 1e-6 * self.p.length;
        let fact = super::line::stretched("riser", extension, self.p.stiffness * extension);
        let help = "write `taut: true`, or increase `length`";
        unexpected.then(|| BuildError::new(fact).help(help).at("taut")).into_iter().collect()
    }
}

#[cfg(test)]
#[path = "riser_tests.rs"]
mod tests;
