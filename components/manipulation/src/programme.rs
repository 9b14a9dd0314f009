//! A programme of moves: when one ends and the next begins, and whether joints can follow all of it.

use crate::arm::Arm;
use linkwork_embedded::{Effort, Frame, Goal, Outcome, Robot, RobotError};
use linkwork_runtime::prelude::{BuildError, Clock};
use linkwork_spatial::{Pose, Vec3};

/// Where a programme is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// A first sample has been taken.
    pub begun: bool,
    /// Which move is under way.
    pub index: f64,
    /// Since its start, s.
    pub elapsed: f64,
    /// All moves are done.
    pub done: bool,
    /// A move did not arrive.
    pub failed: bool,
}

/// What has come about of a move at a sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MoveProgress {
    /// How long its motion takes, s.
    pub duration: f64,
    /// All that moves is near where it is to be.
    pub near: bool,
    /// The move waits until it is.
    pub arrive: bool,
    /// The move ends by a touch or at a depth, not by its duration.
    pub waits: bool,
    /// A touch was felt, or a depth reached.
    pub ended: bool,
}

impl Place {
    /// One sample of `dt` s on, of so many moves; true when tips stand from now on where they are wanted at this sample:
    /// at the start, and when a move has ended or failed.
    pub fn sample(&mut self, met: &MoveProgress, moves: usize, patience: f64, dt: f64) -> bool {
        // A rounding of sums of the sample is no time.
        let over = self.elapsed - met.duration + 1e-9 * dt;
        if !self.begun {
            (self.begun, self.elapsed) = (true, dt);
        } else if self.done || self.failed {
            return false;
        } else if met.ended || (over >= 0.0 && !met.waits && (met.near || !met.arrive)) {
            if (self.index as usize) + 1 < moves {
                (self.index, self.elapsed) = (self.index + 1.0, dt);
            } else {
                self.done = true;
            }
        } else if over > patience {
            self.failed = true;
        } else {
            self.elapsed += dt;
            return false;
        }
        true
    }
}

/// Where the work is seen, beside where it is believed to stand (m, on each axis): white noise of a standard deviation, drawn from the clock's
/// generator. A stand-in for a camera that looks at the work when a move begins.
#[must_use]
pub fn look(c: &Clock, sigma: f64) -> Vec3 {
    match sigma > 0.0 {
        true => Vec3::new(c.normal(0), c.normal(1), c.normal(2)) * sigma,
        false => Vec3::zeros(),
    }
}

/// Places of a move's way that are looked at before the run.
const WAY: u32 = 50;

/// Joints that follow a programme before the run.
pub struct Follower<'a> {
    arm: &'a Arm,
    robot: Robot,
    /// Joints now, by place in β.
    q: Vec<f64>,
    to: Vec<f64>,
}

fn fault(e: &RobotError) -> BuildError {
    BuildError::new(e.to_string()).at("ready")
}

impl<'a> Follower<'a> {
    /// Beginning at joints `ready`, hand by hand, base to tip.
    ///
    /// # Errors
    /// Another number of joints; positions that are no numbers.
    pub fn new(arm: &'a Arm, ready: &[f64]) -> Result<Self, BuildError> {
        let n = arm.joints();
        if ready.len() != n {
            let fact = format!("{} positions for {n} joints", ready.len());
            return Err(BuildError::new(fact).help("write one for each, base to tip").at("ready"));
        }
        let mut q = vec![0.0; n];
        arm.dofs.iter().zip(ready).for_each(|(k, x)| q[*k] = *x);
        let mut robot = Robot::new(&arm.model);
        robot.set_q(&q).map_err(|e| fault(&e))?;
        let to = q.clone();
        Ok(Self { arm, robot, q, to })
    }

    /// Where a hand's tip is.
    ///
    /// # Errors
    /// A hand that is not there.
    pub fn tip(&mut self, hand: usize) -> Result<Pose, BuildError> {
        self.robot.set_q(&self.q).map_err(|e| fault(&e))?;
        self.robot.tip_pose(self.arm.chains[hand]).map_err(|e| fault(&e))
    }

    /// That hands can go the way of a move; `way` gives the pose of each hand's tip at a time, `None` for one that stays.
    ///
    /// # Errors
    /// A move that ends out of reach, or on whose way a joint comes to its limits of position or rate.
    pub fn follow(
        &mut self,
        name: &str,
        duration: f64,
        way: impl Fn(usize, f64) -> Option<Pose>,
    ) -> Result<(), BuildError> {
        let refused = |fact: String, help: &str| Err(BuildError::new(fact).help(help).at("moves"));
        let hands = 0..self.arm.chains.len();
        for hand in hands.clone() {
            let Some(end) = way(hand, duration) else { continue };
            let answer = self.near(hand, &end, 64)?;
            if answer.outcome != Outcome::Met {
                let p = end.position;
                let (far, turned) =
                    (1e3 * answer.residual.position, answer.residual.orientation.to_degrees());
                let fact = format!(
                    "move `{name}` ends at [{:.4}, {:.4}, {:.4}] m in the base, out of reach: the nearest pose within the limits of the joints is {far:.1} mm and {turned:.2}° away",
                    p.x, p.y, p.z
                );
                return refused(fact, "move the work, the arm's base, or the end of the move");
            }
        }
        // On the way, from where the joints are.
        let dt = duration / f64::from(WAY);
        for k in 1..=WAY {
            let t = f64::from(k) * dt;
            for hand in hands.clone() {
                let Some(X) = way(hand, t) else { continue };
                self.to.copy_from_slice(&self.q);
                let met = self.near(hand, &X, 0)?.outcome == Outcome::Met;
                let rate = |j: usize| (self.to[j] - self.q[j]).abs() / dt;
                let fast = (0..self.q.len()).find(|j| rate(*j) > self.arm.limits[*j].rate);
                if !met || fast.is_some() {
                    let why = fast.filter(|_| met).map_or_else(
                        || "a joint comes to its limit".into(),
                        |j| {
                            let most = self.arm.limits[j].rate;
                            let rate = rate(j);
                            format!("joint {j} would have to turn at {rate:.1} rad/s, its limit is {most:.2}")
                        },
                    );
                    let fact =
                        format!("move `{name}` cannot be followed {t:.2} s after its start: {why}");
                    let help = "the way leads near a singular pose or a limit: begin with other joints (`ready`), go round by a move in between, or take longer";
                    return refused(fact, help);
                }
                self.q.copy_from_slice(&self.to);
            }
        }
        Ok(())
    }

    /// Joints for a pose of a tip, from those in `to`.
    fn near(
        &mut self,
        hand: usize,
        X: &Pose,
        restarts: usize,
    ) -> Result<linkwork_embedded::Answer, BuildError> {
        let effort = Effort { tolerances: [1e-6; 2], restarts, ..Effort::default() };
        let part = self.arm.chains[hand];
        self.robot
            .inverse_kinematics(part, &Goal::pose(*X), Frame::World, &effort, &mut self.to)
            .map_err(|e| fault(&e))
    }
}
