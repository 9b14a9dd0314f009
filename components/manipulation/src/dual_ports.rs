//! What the controller of two arms is told, tells and remembers: parameters, outputs, state.

use crate::arm::{InertiaCheck, Load, RobotFile};
use crate::dual_moves::DualMove;
use linkwork_runtime::prelude::*;
use linkwork_spatial::Pose;

/// The robot, its programme, and how it is controlled.
#[derive(Params, Clone, Debug)]
pub struct DualArmParams {
    /// Description of the robot as the controller believes it to be; masses and limits of its joints come from there.
    pub robot: RobotFile,
    /// Moments of inertia in it that no body has: `Warn` reads them with a warning, `Physical` refuses them.
    #[param(default = InertiaCheck::Warn)]
    pub inertia_check: InertiaCheck,
    /// Link that carries both arms, or `world`: the base.
    #[param(default = "world".to_string())]
    pub base: String,
    /// Link whose frame is the left tip.
    pub left_tip: String,
    /// Link whose frame is the right tip.
    pub right_tip: String,
    /// The left tip's origin in that frame: a palm's point.
    #[param(unit = "m", default = Vec3::zeros())]
    pub left_tool: Vec3,
    /// The right tip's origin.
    #[param(unit = "m", default = Vec3::zeros())]
    pub right_tool: Vec3,
    /// Inertia of each joint's rotor seen at the joint, left arm then right, base to tip; default: zeros.
    #[param(unit = "kg m^2", default = Vec::new())]
    pub armature: Vec<f64>,
    /// What is done, in turn.
    pub moves: Vec<DualMove>,
    /// What hands may hold. Of what both hold, the centre of mass is from the point halfway between the tips, and its axes are those of the
    /// move's frame when they take hold of it.
    #[param(default = Vec::new())]
    pub loads: Vec<Load>,
    /// Where the controller believes the work's origin to be, in the base.
    #[param(unit = "m", default = Vec3::zeros())]
    pub work_position: Vec3,
    /// Roll, pitch, yaw of the work in the base.
    #[param(unit = "rad", default = Vec3::zeros())]
    pub work_rpy: Vec3,
    /// Standard deviation, on each axis, of where the work is seen about `work_position`: it is looked at anew when a move begins.
    #[param(unit = "m", default = 0.0, range = 0.0..)]
    pub work_noise: f64,
    /// Acceleration of free fall that it believes, the base's axes. Default: from the simulation's gravity at the origin of W, for a base whose axes are those of W; without gravity, none.
    #[param(unit = "m/s^2")]
    pub gravity: Option<Vec3>,
    /// Gravity of the simulation.
    #[param(service)]
    pub field: Option<Handle<dyn Gravity>>,
    /// Natural frequency with which errors go away when it tracks.
    #[param(unit = "rad/s", default = 30.0, range = 1e-3..)]
    pub bandwidth: f64,
    /// Friction between palms and what they hold, as the controller believes.
    #[param(default = 0.6, range = 1e-3..)]
    pub friction: f64,
    /// How many times the least force of friction grips the palms press with.
    #[param(default = 1.3, range = 1.0..)]
    pub margin: f64,
    /// Palms press with no more than this.
    #[param(unit = "N", default = 300.0, range = 0.0..)]
    pub squeeze_max: f64,
    /// It has arrived when each tip is this near.
    #[param(unit = "m", default = 1e-3, range = 1e-9..)]
    pub tolerance: f64,
    /// And turned no more than this.
    #[param(unit = "rad", default = 5e-3, range = 1e-9..)]
    pub tolerance_angle: f64,
    /// How long after the duration of a move the tips may take to arrive.
    #[param(unit = "s", default = 5.0, range = 0.0..)]
    pub patience: f64,
    /// Positions of the joints at the start, left arm then right, base to tip: with them every move is followed before the run, and one that
    /// ends out of reach, or on whose way a joint comes to its limits of position or rate, is refused. Default: nothing is looked at.
    #[param(unit = "rad", default = Vec::new())]
    pub ready: Vec<f64>,
}

/// How it goes.
#[derive(Ports, Clone, Copy, Debug)]
pub struct DualArmOut {
    /// Which move is under way, from 0.
    #[port("1")]
    pub index: f64,
    /// The left gripper is to be closed.
    #[port("1")]
    pub grip_left: bool,
    /// The right gripper is to be closed.
    #[port("1")]
    pub grip_right: bool,
    /// All moves are done.
    #[port("1")]
    pub done: bool,
    /// A move did not arrive, or not feel what it was to; the arms stay where they were to be.
    #[port("1")]
    pub failed: bool,
    /// The tips cannot move independently here.
    #[port("1")]
    pub singular: bool,
    /// A torque was cut to what its joint can do.
    #[port("1")]
    pub limited: bool,
    /// The palms cannot press as hard as friction needs.
    #[port("1")]
    pub slipping: bool,
    /// Distance from where it is to be: of the farther tip, or of what both hold.
    #[port("m")]
    pub error: f64,
    /// Angle to what it is to be.
    #[port("rad")]
    pub error_angle: f64,
    /// Force with which what is compliant pushes: spring, damper and the move's own force; zero while it tracks.
    #[port("N")]
    pub push: f64,
    /// Force with which both palms press what they hold beside what shares its load.
    #[port("N")]
    pub squeeze: f64,
    /// Friction that the palms need, by the embedded model: the larger ratio of force across to force along the line of the tips.
    #[port("1")]
    pub friction: f64,
    /// Largest share of what a joint can do.
    #[port("1")]
    pub share: f64,
    /// The left tip, by the embedded model, base axes.
    #[port("m")]
    pub tip_left: Vec3,
    /// The right tip.
    #[port("m")]
    pub tip_right: Vec3,
}

/// Discrete state: poses in the base, and of what both hold in each hand.
#[derive(State, Clone, Copy, Debug)]
pub struct DualProgress {
    /// A first sample has been taken.
    #[port("1")]
    pub begun: bool,
    /// Which move is under way.
    #[port("1")]
    pub index: f64,
    /// Since its start.
    #[port("s")]
    pub elapsed: f64,
    /// All moves are done.
    #[port("1")]
    pub done: bool,
    /// A move did not arrive.
    #[port("1")]
    pub failed: bool,
    /// Where the left tip's wanted position stood at the start of the move.
    #[port("m")]
    pub left: Vec3,
    /// How it was turned.
    #[port("1")]
    pub left_rotation: Quat,
    /// Where the right tip's wanted position stood.
    #[port("m")]
    pub right: Vec3,
    /// How it was turned.
    #[port("1")]
    pub right_rotation: Quat,
    /// Where O stood.
    #[port("m")]
    pub both: Vec3,
    /// How it was turned.
    #[port("1")]
    pub both_rotation: Quat,
    /// O in the left hand.
    #[port("m")]
    pub in_left: Vec3,
    /// How it is turned there.
    #[port("1")]
    pub in_left_rotation: Quat,
    /// O in the right hand.
    #[port("m")]
    pub in_right: Vec3,
    /// How it is turned there.
    #[port("1")]
    pub in_right_rotation: Quat,
    /// How far beside `work_position` the work was seen when the move began, base axes.
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
