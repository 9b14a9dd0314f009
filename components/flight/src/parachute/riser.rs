//! `flight.riser`: a riser between a canopy and the legs of a bridle on a body that turns: it pulls and never pushes.
//! ```text
//! K = { p : |p − a_i| ≤ l_i for all legs }        where the legs let their joint be, fixed in the body
//! p: the point of K next to the canopy            d = p_c − p      δ = |d| − L      δ̇ = (v_c − v_p) · d/|d|
//! T = k δ + c δ̇  while taut, else 0               on the body: T d/|d| at p,  on the canopy: −T d/|d|
//! T d/|d| = Σ t_i (p − a_i)/|p − a_i|,  t_i ≥ 0   legs that are taut; one, two or three hold the joint
//! taut while both δ and k δ + c δ̇ are positive
//! ```
//! Legs do not stretch (k is that of riser, lines and legs together) and have no mass, nor has their joint. So the force is that of the potential ½ k δ²: the point
//! of K next to the canopy is where that is least, and v_p the velocity of the body there. While three legs are taut it is a riser on a point that stands off the
//! body; further to the side one leg, then a second, goes slack, continuously. Taut and slack of the whole are events, as those of `flight.line`.

use super::line::{Change, LineOut, Taut, TautOut};
use linkwork_runtime::prelude::*;
use linkwork_spatial::Mat3;

/// Legs of a bridle at most.
const LEGS_MAX: usize = 8;

/// A leg of the bridle.
#[derive(Params, Clone, Debug)]
pub struct Leg {
    /// Where it is fixed, from the node of the body, its axes.
    #[param(unit = "m")]
    pub at: Vec3,
    /// Its length.
    #[param(unit = "m", range = 1e-6..)]
    pub length: f64,
}

/// A riser and the legs of its bridle.
#[derive(Params, Clone, Debug)]
pub struct RiserParams {
    /// Length L without tension, from the canopy to the joint of the legs.
    #[param(unit = "m", range = 1e-6..)]
    pub length: f64,
    /// Stiffness k of all.
    #[param(unit = "N/m", range = 1e-9..)]
    pub stiffness: f64,
    /// Damping c along the riser.
    #[param(unit = "N s/m", default = 0.0, range = 0.0..)]
    pub damping: f64,
    /// Legs of the bridle, 1 to 8.
    pub legs: Vec<Leg>,
    /// It begins under tension; without this a riser that begins longer than L is a warning.
    #[param(default = false)]
    pub taut: bool,
}

/// Its ends.
#[derive(Ports, Clone, Copy, Debug)]
pub struct RiserIn {
    /// The body that has the legs.
    #[port(bind = "body")]
    pub body: NodeState,
    /// The canopy.
    #[port(bind = "canopy")]
    pub canopy: NodeState,
}

/// Forces and length.
#[derive(Ports, Clone, Copy, Debug)]
pub struct RiserOut {
    /// On the body, at its node.
    #[port(bind = "body")]
    pub on_body: Wrench,
    /// On the canopy.
    #[port(bind = "canopy")]
    pub on_canopy: Wrench,
    /// Tension of the riser.
    #[port("N")]
    pub tension: f64,
    /// Length over that without tension; negative when slack.
    #[port("m")]
    pub extension: f64,
    /// Its rate.
    #[port("m/s")]
    pub rate: f64,
    /// Angle from the body's z to the riser.
    #[port("rad")]
    pub angle: f64,
    /// Legs that are taut; 0 when the riser is slack.
    #[port("1")]
    pub legs: f64,
    /// Greatest tension of a leg.
    #[port("N")]
    pub leg_tension: f64,
    /// Where the legs meet, W; of a slack riser where they would, next to the canopy.
    #[port("m")]
    pub joint: Vec3,
}

/// Where the joint of the legs is next to a point: its place, body axes, and the legs that hold it.
#[derive(Clone, Copy, Debug)]
struct Joint {
    at: Vec3,
    legs: [usize; 3],
    taut: usize,
}

/// A circle on which two legs are taut: its centre, unit normal and radius.
struct Circle {
    legs: [usize; 2],
    centre: Vec3,
    normal: Vec3,
    radius: f64,
}

/// A riser.
pub struct Riser {
    p: RiserParams,
    circles: Vec<Circle>,
    /// Points at which three legs are taut.
    corners: Vec<Joint>,
}

/// The geometry of a riser: point of the joint from the body's node (W), unit vector to the canopy, extension and its rate.
struct Stretch {
    joint: Joint,
    arm: Vec3,
    n: Vec3,
    extension: f64,
    rate: f64,
}

impl Riser {
    /// The circle on which legs i and j are both taut, if there is one.
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

    /// The two points of a circle that lie at the length of leg k from its end.
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

    /// Whether all legs reach a point.
    fn reached(&self, p: &Vec3) -> bool {
        // Points of its edge are found to the rounding of their coordinates.
        let slop = 1e-12 * (1.0 + p.norm());
        self.p.legs.iter().all(|l| (p - l.at).norm() <= l.length + slop)
    }

    /// The joint next to a point, body axes; none where the legs do not reach each other.
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
        // The point that is sought holds one, two or three legs taut: of what all reach, the nearest.
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
        // Among the legs the canopy is where the joint is.
        let now = if joint.taut > 0 { d.norm() } else { 0.0 };
        let n = if now > 0.0 { d / now } else { Vec3::zeros() };
        let moved = u.canopy.velocity - u.body.velocity - u.body.angular.cross(&arm);
        Stretch { joint, arm, n, extension: now - self.p.length, rate: moved.dot(&n) }
    }

    /// Tensions of the taut legs, as shares of that of a riser with the direction `n`, body axes.
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

/// The riser of a parachute, from its canopy to the legs of a bridle on a rotating body; slack and taut are events.
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
            let help = "write 1 to 8, e.g. legs: [(at: [0, 0, 1], length: 2)]";
            return wrong(format!("a bridle of {n} legs"), help);
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
            return wrong("the legs are too short to meet".into(), "write greater lengths");
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
    fn startup_warnings(&self, d: &Taut, u: &RiserIn) -> Vec<BuildError> {
        let extension = self.stretch(u).extension;
        let stretched = !d.taut && extension > 1e-6 * self.p.length;
        let fact = format!("it starts slack and {extension:.6} m longer than without tension");
        let help = "write `taut: true`, or a greater `length`";
        stretched.then(|| BuildError::new(fact).help(help).at("taut")).into_iter().collect()
    }
}

#[cfg(test)]
#[path = "riser_tests.rs"]
mod tests;
