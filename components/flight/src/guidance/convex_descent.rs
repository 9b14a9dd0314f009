//! `flight.convex_descent`: fuel-optimal powered descent by convex optimization. The trajectory is planned at the first sample and then tracked with
//! feedback.
//! ```text
//! plan      `convex::best_plan` from where the lander is at the first row: r*(t), v*(t), u*(t), within thrust less a margin, glide slope, pointing
//! between nodes  u* straight, v* and r* its integrals
//! force     F = m (u* + g* + ω² (r* − r) + 2 ζ ω (v* − v) − g),  within the throttle         g*: the plan's gravity, g: of free fall now
//! no plan   the quadratic law of `flight.powered_descent` to the end of `times`; `planned` is false, and the run says so once
//! ```
//! The plan assumes flat ground and uniform gravity (the gravity at the target); the feedback corrects the effects of curvature and rotation of the
//! planet. From `freeze` before the end the last force is held. A part that a phase adds plans when the phase begins. Planning solves about 40 convex
//! problems with `nodes` intervals, three times, at the first sample only; later samples allocate no memory.

use super::convex::{Descent, NoPlan, Node, best_plan};
use super::powered_descent::{DescentIn, Last, Target, commanded, quadratic};
use linkwork_surroundings::prelude::*;
use serde::{Deserialize, Serialize};

/// Lander, target and limits.
#[derive(Params, Clone, Debug)]
pub struct ConvexDescentParams {
    /// Mass without propellant.
    #[param(unit = "kg", range = 1e-6..)]
    pub dry: f64,
    /// Specific impulse.
    #[param(unit = "s", range = 1e-3..)]
    pub specific_impulse: f64,
    /// Total thrust of the engines at full throttle.
    #[param(unit = "N", range = 1e-6..)]
    pub thrust: f64,
    /// Least and greatest throttle.
    #[param(default = [0.1, 1.0])]
    pub throttle: [f64; 2],
    /// Cant angle of the engines from the direction of the total thrust.
    #[param(unit = "rad", default = 0.0, range = 0.0..1.5)]
    pub cant: f64,
    /// Target position, W.
    #[param(unit = "m", default = Vec3::zeros())]
    pub position: Vec3,
    /// Target velocity, W.
    #[param(unit = "m/s", default = Vec3::zeros())]
    pub velocity: Vec3,
    /// Glide slope: least elevation of the lander above the horizon, seen from the target.
    #[param(unit = "rad", default = 0.0, range = 0.0..1.57)]
    pub glide: f64,
    /// Greatest angle between thrust and vertical.
    #[param(unit = "rad", default = std::f64::consts::PI, range = 0.0..=3.2)]
    pub pointing: f64,
    /// Shortest and longest time of flight.
    #[param(unit = "s")]
    pub times: [f64; 2],
    /// Tolerance of the optimal time of flight.
    #[param(unit = "s", default = 0.5, range = 1e-3..)]
    pub exact: f64,
    /// Number of intervals of the plan.
    #[param(default = 40, range = 2.0..=400.0)]
    pub nodes: u32,
    /// Fraction of the throttle range that the plan reserves at each limit for feedback corrections.
    #[param(default = 0.05, range = 0.0..=0.4)]
    pub margin: f64,
    /// Natural frequency ω of the feedback on errors relative to the plan.
    #[param(unit = "rad/s", default = 0.4, range = 0.0..)]
    pub frequency: f64,
    /// Damping ratio ζ of the feedback.
    #[param(default = 0.9, range = 0.0..)]
    pub damping: f64,
    /// Time before the end from which the last force is held.
    #[param(unit = "s", default = 1.0, range = 1e-3..)]
    pub freeze: f64,
    /// Gravity.
    #[param(service)]
    pub gravity: Handle<dyn Gravity>,
}

/// Force command and status of the plan.
#[derive(Ports, Clone, Copy, Debug)]
pub struct ConvexDescentOut {
    /// Commanded force, W.
    #[port("N")]
    pub force: Vec3,
    /// Time to go.
    #[port("s")]
    pub to_go: f64,
    /// The force was limited to the throttle range.
    #[port]
    pub limited: bool,
    /// A plan is tracked; false: the quadratic law is used.
    #[port]
    pub planned: bool,
    /// Propellant mass of the plan; 0 without a plan.
    #[port("kg")]
    pub propellant: f64,
    /// Distance from the planned position; 0 without a plan.
    #[port("m")]
    pub off: f64,
}

/// Planned trajectory.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Plan {
    made: bool,
    /// Start time and duration, s.
    start: f64,
    time: f64,
    propellant: f64,
    /// Position, velocity and thrust over mass at equally spaced nodes; empty without a plan.
    nodes: Vec<[Vec3; 3]>,
}

impl Store for Plan {}

impl Plan {
    /// Returns position, velocity and thrust over mass at time `t` (s) after the start, under uniform gravity `g`.
    fn at(&self, t: f64, g: &Vec3) -> Option<[Vec3; 3]> {
        let intervals = self.nodes.len().checked_sub(1).filter(|n| *n > 0)?;
        let h = self.time / intervals as f64;
        let k = ((t / h).max(0.0) as usize).min(intervals - 1);
        let ([r, v, u], [_, _, next]) = (self.nodes[k], self.nodes[k + 1]);
        let s = (t - k as f64 * h).clamp(0.0, h);
        let slope = (next - u) / h;
        let speed = v + (u + g) * s + slope * (0.5 * s * s);
        Some([
            r + v * s + (u + g) * (0.5 * s * s) + slope * (s * s * s / 6.0),
            speed,
            u + slope * s,
        ])
    }
}

/// Convex powered descent guidance.
pub struct ConvexDescent {
    p: ConvexDescentParams,
}

impl ConvexDescent {
    /// Returns the gravity of the plan: acceleration of free fall at the target, at rest.
    fn gravity(&self, t: f64) -> Vec3 {
        self.p.gravity.free_fall(t, self.p.position, Vec3::zeros())
    }

    fn best(&self, t: f64, u: &DescentIn) -> Result<Vec<Node>, NoPlan> {
        let p = &self.p;
        let left = p.margin * (p.throttle[1] - p.throttle[0]);
        let d = Descent {
            gravity: self.gravity(t),
            mass: u.mass,
            dry: p.dry,
            specific_impulse: p.specific_impulse,
            thrust: p.thrust,
            throttle: [p.throttle[0] + left, p.throttle[1] - left],
            cant: p.cant,
            start: [u.body.position, u.body.velocity],
            end: [p.position, p.velocity],
            glide: p.glide,
            pointing: p.pointing,
        };
        best_plan(&d, p.times.into(), p.exact, p.nodes as usize)
    }

    fn plan(&self, t: f64, u: &DescentIn) -> Plan {
        let nodes = self.best(t, u).unwrap_or_default();
        let last = nodes.last();
        Plan {
            made: true,
            start: t,
            time: last.map_or(self.p.times[1], |n| n.time),
            propellant: last.map_or(0.0, |n| u.mass - n.mass),
            nodes: nodes.iter().map(|n| [n.position, n.velocity, n.thrust]).collect(),
        }
    }

    /// Computes the command from the plan, or from the quadratic law without a plan. The planned thrust is evaluated at the middle of the sample,
    /// over which it is held.
    fn command(
        &self,
        (t, period): (f64, f64),
        last: &Last,
        u: &DescentIn,
        plan: &Plan,
    ) -> ConvexDescentOut {
        let p = &self.p;
        let to_go = plan.start + plan.time - t;
        let (r, v) = (&u.body.position, &u.body.velocity);
        let g = self.gravity(plan.start);
        let now = plan.at(t - plan.start, &g);
        let held = plan.at(t - plan.start + 0.5 * period, &g);
        let mut out = ConvexDescentOut {
            force: last.force,
            to_go,
            limited: false,
            planned: now.is_some(),
            propellant: plan.propellant,
            off: now.map_or(0.0, |[place, ..]| (place - r).norm()),
        };
        // The tolerance covers the round-off of sample times.
        if to_go < p.freeze - 1e-9 {
            return out;
        }
        let a = match now.zip(held) {
            Some(([place, speed, _], [.., thrust])) => {
                let w = p.frequency;
                thrust + g + (place - r) * (w * w) + (speed - v) * (2.0 * p.damping * w)
            }
            None => {
                let (position, velocity) = (p.position, p.velocity);
                quadratic(r, v, &Target { position, velocity, acceleration: Vec3::zeros() }, to_go)
            }
        };
        let falls = p.gravity.free_fall(t, *r, *v);
        let [low, high] = p.throttle.map(|x| x * p.thrust * p.cant.cos());
        (out.force, out.limited) = commanded(&a, &falls, u.mass, (low, high));
        out
    }
}

/// Fuel-optimal powered descent: a trajectory by convex optimization, tracked with feedback; sampled.
#[model("flight.convex_descent")]
impl Model for ConvexDescent {
    type Params = ConvexDescentParams;
    type FeedthroughInputs = DescentIn;
    type FeedthroughOutputs = ConvexDescentOut;
    type DiscreteState = Last;
    type Store = Plan;
    fn build(p: ConvexDescentParams) -> Result<Self, BuildError> {
        let [low, high] = p.times;
        if !(low > 0.0 && low < high) {
            let fact =
                format!("`times` from {low} to {high} s is not an interval of positive times");
            return Err(BuildError::new(fact).help("write times: [30, 90]").at("times"));
        }
        let [least, most] = p.throttle;
        if !(least >= 0.0 && least < most && most <= 1.0) {
            let fact =
                format!("`throttle` from {least} to {most} is not an interval within 0 to 1");
            return Err(BuildError::new(fact).help("write throttle: [0.3, 0.8]").at("throttle"));
        }
        Ok(ConvexDescent { p })
    }
    fn feedthrough(
        &self,
        clock: &Clock,
        d: &Last,
        u: &DescentIn,
        store: &Plan,
    ) -> ConvexDescentOut {
        if store.made {
            return self.command((clock.t, clock.dt), d, u, store);
        }
        self.command((clock.t, clock.dt), d, u, &self.plan(clock.t, u))
    }
    fn update(&self, clock: &Clock, d: &Last, u: &DescentIn, store: &mut Plan) -> Last {
        if !store.made {
            *store = self.plan(clock.t, u);
        }
        Last { force: self.command((clock.t, clock.dt), d, u, store).force }
    }
    fn startup_warnings(&self, clock: &Clock, u: &DescentIn, store: &Plan) -> Vec<BuildError> {
        let why = match store {
            Plan { made: true, nodes, .. } if nodes.is_empty() => String::new(),
            Plan { made: true, .. } => return Vec::new(),
            Plan { made: false, .. } => match self.best(clock.t, u) {
                Ok(_) => return Vec::new(),
                Err(NoPlan::Infeasible { .. }) => ": no trajectory satisfies the limits".into(),
                Err(NoPlan::Solver { status, .. }) => format!(": the solver stopped with {status}"),
                Err(NoPlan::Input { what, .. }) => format!(": {what}"),
            },
        };
        let [low, high] = self.p.times;
        let fact = format!(
            "no plan within {low} to {high} s{why}; the quadratic law is used to the end of `times`, without limits of glide slope, pointing and propellant"
        );
        let help = "change `times`, reduce `glide`, increase `pointing` or `thrust`, or start elsewhere; the output `planned` is false in this case";
        vec![BuildError::new(fact).help(help).at("times")]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use linkwork_surroundings::testing;

    fn params() -> ConvexDescentParams {
        ConvexDescentParams {
            dry: 1505.0,
            specific_impulse: 225.0,
            thrust: 18_600.0,
            throttle: [0.2, 0.9],
            cant: 27f64.to_radians(),
            position: Vec3::zeros(),
            velocity: Vec3::new(0.0, 0.0, -0.5),
            glide: 15f64.to_radians(),
            pointing: std::f64::consts::PI,
            times: [30.0, 70.0],
            exact: 0.5,
            nodes: 30,
            margin: 0.05,
            frequency: 0.4,
            damping: 0.9,
            freeze: 0.5,
            gravity: testing::gravity(|_, _| Vec3::new(0.0, 0.0, -3.7114)),
        }
    }

    /// Simulates a descent at 10 Hz from a given state with a thrust error; returns the final state, the propellant and the first output.
    fn flown(
        p: ConvexDescentParams,
        (r, v): (Vec3, Vec3),
        share: f64,
    ) -> (Vec3, Vec3, f64, ConvexDescentOut) {
        let flow = 1.0 / (p.specific_impulse * 9.80665 * p.cant.cos());
        let m = ConvexDescent::build(p).map_err(|e| e.message).unwrap();
        let (mut d, mut plan) = (Last { force: Vec3::zeros() }, Plan::default());
        let mut body = NodeState { position: r, velocity: v, ..NodeState::identity() };
        let (mut mass, mut n) = (1905.0, 0_u64);
        let mut first = None;
        loop {
            let c = Clock::at(0.1 * n as f64, 0.1, n);
            let u = DescentIn { body, mass };
            let y = m.feedthrough(&c, &d, &u, &plan);
            d = m.update(&c, &d, &u, &mut plan);
            first.get_or_insert(y);
            if y.to_go < 0.05 {
                return (body.position, body.velocity, 1905.0 - mass, first.unwrap());
            }
            let a = y.force * (share / mass) + Vec3::new(0.0, 0.0, -3.7114);
            body.position += body.velocity * 0.1 + a * 0.005;
            body.velocity += a * 0.1;
            mass -= flow * y.force.norm() * 0.1;
            n += 1;
        }
    }

    const START: (Vec3, Vec3) = (Vec3::new(2000.0, 450.0, 1500.0), Vec3::new(-40.0, 12.0, -65.0));

    #[test]
    fn it_flies_its_plan_and_takes_the_propellant_that_it_says() {
        let (r, v, used, y) = flown(params(), START, 1.0);
        assert!(y.planned && y.off < 1e-3, "{y:?}");
        // Measured errors: 2 cm, 0.3 m/s (because the force is held for half a second), 0.2 %.
        assert!(r.norm() < 1.0 && (v - Vec3::new(0.0, 0.0, -0.5)).norm() < 0.5, "{r} {v}");
        assert!((used / y.propellant - 1.0).abs() < 0.01, "{used} {}", y.propellant);
        // The feedback compensates engines with 3 % less thrust.
        let (r, v, ..) = flown(params(), START, 0.97);
        assert!(r.norm() < 5.0 && v.norm() < 2.0, "{r} {v}");
    }

    /// Between nodes the plan satisfies the equations of motion, tested by finite differences of r* and v*.
    #[test]
    fn between_nodes_the_plan_moves_as_its_thrust_says() {
        let m = ConvexDescent::build(params()).map_err(|e| e.message).unwrap();
        let body = NodeState { position: START.0, velocity: START.1, ..NodeState::identity() };
        let plan = m.plan(10.0, &DescentIn { body, mass: 1905.0 });
        let g = m.gravity(0.0);
        let h = 1e-3;
        for k in 1..60 {
            let t = plan.time * f64::from(k) / 60.0 + 0.013;
            let [at, ahead, behind] = [t, t + h, t - h].map(|t| plan.at(t, &g).unwrap());
            assert!(((ahead[0] - behind[0]) / (2.0 * h) - at[1]).norm() < 1e-5, "{k}");
            assert!(((ahead[1] - behind[1]) / (2.0 * h) - at[2] - g).norm() < 1e-3, "{k}");
        }
        let end = plan.at(plan.time + 5.0, &g).unwrap();
        assert!(end[0].norm() < 1e-4 && (end[1] - Vec3::new(0.0, 0.0, -0.5)).norm() < 1e-4);
    }

    #[test]
    fn without_a_plan_it_goes_on_by_the_quadratic_law_and_says_so() {
        // A state below the glide slope does not have a plan.
        let low = (Vec3::new(1500.0, 0.0, 150.0), Vec3::new(-20.0, 0.0, 2.0));
        let (r, v, _, y) = flown(params(), low, 1.0);
        assert!(!y.planned && y.propellant == 0.0 && (y.to_go - 70.0).abs() < 1e-9, "{y:?}");
        let a = quadratic(
            &low.0,
            &low.1,
            &Target {
                position: Vec3::zeros(),
                velocity: params().velocity,
                acceleration: Vec3::zeros(),
            },
            70.0,
        );
        let wanted = (a + Vec3::new(0.0, 0.0, 3.7114)) * 1905.0;
        assert!((y.force - wanted).norm() < 1e-9 * wanted.norm() || y.limited, "{y:?}");
        assert!(r.norm() < 5.0 && v.norm() < 2.0, "{r} {v}");
    }

    /// Without a plan the warning is given at the start and when a run resumes; with a plan there is none.
    #[test]
    fn that_there_is_no_plan_is_a_remark() {
        let m = ConvexDescent::build(params()).map_err(|e| e.message).unwrap();
        let (c, d) = (Clock::at(0.0, 0.1, 0), Last { force: Vec3::zeros() });
        let told = |(position, velocity): (Vec3, Vec3), begun: bool| {
            let body = NodeState { position, velocity, ..NodeState::identity() };
            let u = DescentIn { body, mass: 1905.0 };
            let mut plan = Plan::default();
            if begun {
                m.update(&c, &d, &u, &mut plan);
            }
            m.startup_warnings(&c, &u, &plan)
        };
        let low = (Vec3::new(1500.0, 0.0, 150.0), Vec3::new(-20.0, 0.0, 2.0));
        for begun in [false, true] {
            assert!(told(START, begun).is_empty());
            let remarks = told(low, begun);
            let [remark] = &remarks[..] else { panic!("{} remarks", remarks.len()) };
            assert!(remark.message.contains("no plan within 30 to 70 s"), "{}", remark.message);
            assert!(!remark.stops && remark.help.is_some() && remark.message.contains("quadratic"));
            let why = remark.message.contains("no trajectory satisfies the limits");
            assert_eq!(why, !begun, "{}", remark.message);
        }
    }

    #[test]
    fn what_is_no_descent_is_refused() {
        let told = |p: ConvexDescentParams| ConvexDescent::build(p).err().unwrap().to_string();
        assert!(
            told(ConvexDescentParams { times: [50.0, 40.0], ..params() })
                .contains("is not an interval")
        );
        assert!(
            told(ConvexDescentParams { throttle: [0.9, 0.2], ..params() })
                .contains("within 0 to 1")
        );
    }
}
