//! Parameters, outputs and state of `manipulation.dual_arm_controller`.

use crate::arm::{InertiaCheck, Load, RobotFile};
use crate::dual_moves::DualMove;
use linkwork_spatial::Pose;
use linkwork_surroundings::prelude::*;

/// Parameters: the robot, its moves and the gains of the controller.
#[derive(Params, Clone, Debug)]
pub struct DualArmParams {
    /// Robot description that the controller uses. It supplies masses and joint limits and may differ from the simulated robot.
    pub robot: RobotFile,
    /// Handling of moments of inertia that are not physical: `Warn` accepts them with a warning, `Physical` rejects them with an error.
    #[param(default = InertiaCheck::Warn)]
    pub inertia_check: InertiaCheck,
    /// Link that carries both arms, or `world`: the base.
    #[param(default = "world".to_string())]
    pub base: String,
    /// Link whose frame is the left tip.
    pub left_tip: String,
    /// Link whose frame is the right tip.
    pub right_tip: String,
    /// Origin of the left tip in the frame of that link: a point of the palm.
    #[param(unit = "m", default = Vec3::zeros())]
    pub left_tool: Vec3,
    /// Origin of the right tip in the frame of its link.
    #[param(unit = "m", default = Vec3::zeros())]
    pub right_tool: Vec3,
    /// Rotor inertia of each joint, reflected to the joint (gear² times rotor inertia): left arm then right, base to tip. Default: zeros.
    #[param(unit = "kg m^2", default = Vec::new())]
    pub armature: Vec<f64>,
    /// Moves, in order.
    pub moves: Vec<DualMove>,
    /// Loads that the hands may hold. For an object in both hands, `com` is measured from the point halfway between the tips, and its axes are the
    /// axes of the move's frame at the moment of grasping.
    #[param(default = Vec::new())]
    pub loads: Vec<Load>,
    /// Assumed position of the work's origin in the base.
    #[param(unit = "m", default = Vec3::zeros())]
    pub work_position: Vec3,
    /// Roll, pitch, yaw of the work in the base.
    #[param(unit = "rad", default = Vec3::zeros())]
    pub work_rpy: Vec3,
    /// Standard deviation on each axis of the observed position of the work. A new observation is drawn when a move begins.
    #[param(unit = "m", default = 0.0, range = 0.0..)]
    pub work_noise: f64,
    /// Gravitational acceleration that the controller assumes, base axes. Default: the simulation's gravity at the origin of W, in the present axes of
    /// the node that is bound to `base`; zero without gravity.
    #[param(unit = "m/s^2")]
    pub gravity: Option<Vec3>,
    /// Gravity of the simulation.
    #[param(service)]
    pub field: Option<Handle<dyn Gravity>>,
    /// Natural frequency of the error dynamics while tracking.
    #[param(unit = "rad/s", default = 30.0, range = 1e-3..)]
    pub bandwidth: f64,
    /// Friction coefficient between palms and object that the controller assumes.
    #[param(default = 0.6, range = 1e-3..)]
    pub friction: f64,
    /// Safety factor on the minimum squeeze that friction requires.
    #[param(default = 1.3, range = 1.0..)]
    pub margin: f64,
    /// Maximum squeeze force.
    #[param(unit = "N", default = 300.0, range = 0.0..)]
    pub squeeze_max: f64,
    /// Position tolerance of each tip for arrival.
    #[param(unit = "m", default = 1e-3, range = 1e-9..)]
    pub tolerance: f64,
    /// Angle tolerance of each tip for arrival.
    #[param(unit = "rad", default = 5e-3, range = 1e-9..)]
    pub tolerance_angle: f64,
    /// Time after the duration of a move within which the tips must arrive.
    #[param(unit = "s", default = 5.0, range = 0.0..)]
    pub patience: f64,
    /// Joint positions at the start, left arm then right, base to tip. If given, every move is checked before the run: a move that ends out of reach
    /// or exceeds a position or rate limit of a joint is an error. Default: no check.
    #[param(unit = "rad", default = Vec::new())]
    pub ready: Vec<f64>,
}

/// Status of the controller.
#[derive(Ports, Clone, Copy, Debug)]
pub struct DualArmOut {
    /// Index of the current move, from 0.
    #[port("1")]
    pub index: f64,
    /// Left gripper command: closed.
    #[port("1")]
    pub grip_left: bool,
    /// Right gripper command: closed.
    #[port("1")]
    pub grip_right: bool,
    /// All moves are done.
    #[port("1")]
    pub done: bool,
    /// A move did not arrive, or did not reach its `touch` force. The arms hold the commanded poses.
    #[port("1")]
    pub failed: bool,
    /// The tips cannot move independently here.
    #[port("1")]
    pub singular: bool,
    /// A torque was limited to the effort limit of its joint.
    #[port("1")]
    pub limited: bool,
    /// The palms cannot squeeze as hard as friction requires.
    #[port("1")]
    pub slipping: bool,
    /// Position error: the larger one of both tips, or that of the object in both hands.
    #[port("m")]
    pub error: f64,
    /// Angle error, likewise.
    #[port("rad")]
    pub error_angle: f64,
    /// Force of a compliant motion: spring, damper and the feedforward force of the move; zero while tracking.
    #[port("N")]
    pub push: f64,
    /// Squeeze force of both palms, in addition to the forces that carry the load.
    #[port("N")]
    pub squeeze: f64,
    /// Friction coefficient that the grip needs, from the embedded model: the larger ratio of the force across the line through the tips to the force
    /// along it.
    #[port("1")]
    pub friction: f64,
    /// Largest ratio of a joint torque to its effort limit.
    #[port("1")]
    pub share: f64,
    /// Position of the left tip from the embedded model, base axes.
    #[port("m")]
    pub tip_left: Vec3,
    /// Position of the right tip, likewise.
    #[port("m")]
    pub tip_right: Vec3,
}

/// Discrete state: poses in the base, and poses of the object O in each hand.
#[derive(State, Clone, Copy, Debug)]
pub struct DualProgress {
    /// A first sample has been taken.
    #[port("1")]
    pub begun: bool,
    /// Index of the current move.
    #[port("1")]
    pub index: f64,
    /// Time since the start of the current move.
    #[port("s")]
    pub elapsed: f64,
    /// All moves are done.
    #[port("1")]
    pub done: bool,
    /// A move did not arrive.
    #[port("1")]
    pub failed: bool,
    /// Commanded position of the left tip at the start of the move.
    #[port("m")]
    pub left: Vec3,
    /// Attitude of that frame at the start of the move.
    #[port("1")]
    pub left_rotation: Quat,
    /// Commanded position of the right tip at the start of the move.
    #[port("m")]
    pub right: Vec3,
    /// Attitude of that frame at the start of the move.
    #[port("1")]
    pub right_rotation: Quat,
    /// Commanded position of O at the start of the move.
    #[port("m")]
    pub both: Vec3,
    /// Attitude of that frame at the start of the move.
    #[port("1")]
    pub both_rotation: Quat,
    /// Position of O in the left hand.
    #[port("m")]
    pub in_left: Vec3,
    /// Attitude of O in that hand.
    #[port("1")]
    pub in_left_rotation: Quat,
    /// Position of O in the right hand.
    #[port("m")]
    pub in_right: Vec3,
    /// Attitude of O in that hand.
    #[port("1")]
    pub in_right_rotation: Quat,
    /// Observed offset of the work from `work_position` at the start of the move, base axes.
    #[port("m")]
    pub seen: Vec3,
}

impl DualProgress {
    pub(crate) fn tips(&self) -> [Pose; 2] {
        [Pose::new(self.left_rotation, self.left), Pose::new(self.right_rotation, self.right)]
    }
    pub(crate) fn set_tips(&mut self, [l, r]: [Pose; 2]) {
        (self.left, self.left_rotation) = (l.position, l.rotation);
        (self.right, self.right_rotation) = (r.position, r.rotation);
    }
    pub(crate) fn object(&self) -> Pose {
        Pose::new(self.both_rotation, self.both)
    }
    pub(crate) fn set_object(&mut self, O: Pose) {
        (self.both, self.both_rotation) = (O.position, O.rotation);
    }
    pub(crate) fn in_hands(&self) -> [Pose; 2] {
        let right = Pose::new(self.in_right_rotation, self.in_right);
        [Pose::new(self.in_left_rotation, self.in_left), right]
    }
    pub(crate) fn set_in_hands(&mut self, [l, r]: [Pose; 2]) {
        (self.in_left, self.in_left_rotation) = (l.position, l.rotation);
        (self.in_right, self.in_right_rotation) = (r.position, r.rotation);
    }
}
