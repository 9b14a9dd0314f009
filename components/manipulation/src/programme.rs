//! Sequence of moves: transitions from one move to the next, and the check before a run that the joints can follow all moves.

use crate::arm::Arm;
use linkwork_embedded::{Effort, Frame, Goal, Outcome, Robot, RobotError};
use linkwork_spatial::{Pose, Vec3};
use linkwork_surroundings::prelude::{BuildError, Clock};

/// Progress of a sequence of moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// A first sample has been taken.
    pub begun: bool,
    /// Index of the current move.
    pub index: f64,
    /// Time since the start of the current move, s.
    pub elapsed: f64,
    /// All moves are done.
    pub done: bool,
    /// A move did not arrive.
    pub failed: bool,
}

/// State of the current move at a sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MoveProgress {
    /// Duration of its motion, s.
    pub duration: f64,
    /// All tips are within the arrival tolerance.
    pub near: bool,
    /// The move ends only after arrival.
    pub arrive: bool,
    /// The move ends at a contact force or a depth, not after its duration.
    pub waits: bool,
    /// The contact force or the depth was reached.
    pub ended: bool,
}

impl Place {
    /// Advances by one sample of `dt` (s) in a sequence of `moves` moves. Returns true if the commanded poses of this sample become the new start
    /// poses: at the first sample, and when a move has ended or failed.
    pub fn sample(&mut self, met: &MoveProgress, moves: usize, patience: f64, dt: f64) -> bool {
        // The tolerance covers the round-off of the summed sample periods.
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

/// Returns the observed offset of the work from its assumed position (m): white noise with the given standard deviation on each axis, from the
/// clock's generator. It represents a camera that measures the pose of the workpiece when a move begins.
#[must_use]
pub fn look(c: &Clock, sigma: f64) -> Vec3 {
    match sigma > 0.0 {
        true => Vec3::new(c.normal(0), c.normal(1), c.normal(2)) * sigma,
        false => Vec3::zeros(),
    }
}

/// Number of points of a move that are checked before the run.
const WAY: u32 = 50;

/// Checks before a run that the joints can follow a sequence of moves.
pub struct Follower<'a> {
    arm: &'a Arm,
    robot: Robot,
    /// Current joint positions, by index in β.
    q: Vec<f64>,
    to: Vec<f64>,
}

fn fault(e: &RobotError) -> BuildError {
    BuildError::new(e.to_string()).at("ready")
}

impl<'a> Follower<'a> {
    /// Creates a follower at the joint positions `ready`, hand by hand, base to tip.
    ///
    /// # Errors
    /// Returns an error if the number of positions is wrong or a position is not finite.
    pub fn new(arm: &'a Arm, ready: &[f64]) -> Result<Self, BuildError> {
        let n = arm.joints();
        if ready.len() != n {
            let fact = format!("`ready` has {} positions for {n} joints", ready.len());
            return Err(BuildError::new(fact)
                .help("write one value for each joint, from base to tip")
                .at("ready"));
        }
        let mut q = vec![0.0; n];
        arm.dofs.iter().zip(ready).for_each(|(k, x)| q[*k] = *x);
        let mut robot = Robot::new(&arm.model);
        robot.set_q(&q).map_err(|e| fault(&e))?;
        let to = q.clone();
        Ok(Self { arm, robot, q, to })
    }

    /// Returns the pose of a hand's tip.
    ///
    /// # Errors
    /// Returns an error if the hand does not exist.
    pub fn tip(&mut self, hand: usize) -> Result<Pose, BuildError> {
        self.robot.set_q(&self.q).map_err(|e| fault(&e))?;
        self.robot.tip_pose(self.arm.chains[hand]).map_err(|e| fault(&e))
    }

    /// Checks that the hands can follow a move. `way` returns the pose of a hand's tip at a time (s), or `None` for a hand that stays.
    ///
    /// # Errors
    /// Returns an error if the move ends out of reach or a joint exceeds its position or rate limit.
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
        // Follow the path in small steps from the current joint positions.
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
                        || "a joint reaches its position limit".into(),
                        |j| {
                            let most = self.arm.limits[j].rate;
                            let rate = rate(j);
                            format!(
                                "joint {j} would need {rate:.1} rad/s; its limit is {most:.2} rad/s"
                            )
                        },
                    );
                    let fact =
                        format!("move `{name}` cannot be followed {t:.2} s after its start: {why}");
                    let help = "the path passes near a singular pose or a limit: use other start positions (`ready`), add an intermediate move, or increase `duration`";
                    return refused(fact, help);
                }
                self.q.copy_from_slice(&self.to);
            }
        }
        Ok(())
    }

    /// Computes joint positions for a pose of a tip, starting from those in `to`.
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
