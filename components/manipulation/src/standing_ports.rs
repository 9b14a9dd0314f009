//! What the controller of a legged machine is told, sees, tells and remembers: parameters, inputs, outputs, state.

use crate::arm::{InertiaCheck, RobotFile};
use linkwork_runtime::prelude::*;

/// The machine, and how it stands.
#[derive(Params, Clone, Debug)]
pub struct StandingParams {
    /// Description of the machine as the controller believes it to be; masses and limits of its joints come from there.
    pub robot: RobotFile,
    /// Moments of inertia in it that no body has: `Warn` reads them with a warning, `Physical` refuses them.
    #[param(default = InertiaCheck::Warn)]
    pub inertia_check: InertiaCheck,
    /// Link of the trunk, which floats.
    pub trunk: String,
    /// What the trunk is believed to weigh, its moments of inertia in proportion; default: what the description says.
    #[param(unit = "kg", default = None, range = 1e-6..)]
    pub trunk_mass: Option<f64>,
    /// Links whose origins are the points of the feet, around the machine; each ends a leg of three joints.
    pub feet: Vec<String>,
    /// Inertia of each joint's rotor seen at the joint, leg by leg, trunk to foot; default: zeros.
    #[param(unit = "kg m^2", default = Vec::new())]
    pub armature: Vec<f64>,
    /// Centre of mass over the middle of the feet when it stands.
    #[param(unit = "m", range = 1e-3..)]
    pub height: f64,
    /// How long it takes to stand up.
    #[param(unit = "s", default = 1.5, range = 1e-3..)]
    pub rise: f64,
    /// How far the centre of mass sways to either side, axes of the heading.
    #[param(unit = "m", default = Vec3::zeros())]
    pub sway: Vec3,
    /// Period of the sway.
    #[param(unit = "s", default = 1.5, range = 1e-2..)]
    pub sway_period: f64,
    /// When it begins to sway, from the start; within a period it grows to its size.
    #[param(unit = "s", default = 4.0, range = 0.0..)]
    pub sway_from: f64,
    /// Friction at the feet, as the controller believes.
    #[param(default = 0.6, range = 1e-3..)]
    pub friction: f64,
    /// Greatest force on each edge of a foot's friction pyramid.
    #[param(unit = "N", default = 100.0, range = 1e-3..)]
    pub force_max: f64,
    /// Natural frequency with which errors of the centre of mass and of the attitude go away.
    #[param(unit = "rad/s", default = 12.0, range = 1e-3..)]
    pub bandwidth: f64,
    /// Acceleration of free fall that it believes, W; default: from the simulation's gravity at the origin of W, none without it.
    #[param(unit = "m/s^2")]
    pub gravity: Option<Vec3>,
    /// Gravity of the simulation.
    #[param(service)]
    pub field: Option<Handle<dyn Gravity>>,
}

/// What is seen of the trunk.
#[derive(Ports, Clone, Copy, Debug)]
pub struct TrunkIn {
    /// Attitude: from the trunk's axes to W, z up.
    #[port("1")]
    pub rotation: Quat,
    /// Turn rate, the trunk's axes.
    #[port("rad/s")]
    pub angular: Vec3,
}

/// How it goes.
#[derive(Ports, Clone, Copy, Debug)]
pub struct StandingOut {
    /// It has stood up and stands: its centre of mass is over its feet, above half of its height, and the trunk within half a radian of level.
    #[port("1")]
    pub stands: bool,
    /// A leg is outstretched, or numbers are none: the joints are damped, and nothing else.
    #[port("1")]
    pub singular: bool,
    /// A torque was cut to what its joint can do.
    #[port("1")]
    pub limited: bool,
    /// Centre of mass from the middle of the feet, by the embedded model.
    #[port("m")]
    pub com: Vec3,
    /// Distance from where it is to be.
    #[port("m")]
    pub error: f64,
    /// Angle between the trunk's attitude and what it is to be.
    #[port("rad")]
    pub error_angle: f64,
    /// How far inside the polygon of the feet the centre of mass is; negative outside.
    #[port("m")]
    pub inside: f64,
    /// Friction that the feet are to use: the largest ratio of force along the ground to force on it.
    #[port("1")]
    pub friction: f64,
    /// Least force on the ground of a foot.
    #[port("N")]
    pub press: f64,
    /// What the feet cannot give of the force that is wanted.
    #[port("N")]
    pub lack: f64,
    /// Largest share of what a joint can do.
    #[port("1")]
    pub share: f64,
}

/// Discrete state.
#[derive(State, Clone, Copy, Debug)]
pub struct Stand {
    /// A first sample has been taken.
    #[port("1")]
    pub begun: bool,
    /// Since then.
    #[port("s")]
    pub elapsed: f64,
    /// Heading at the start.
    #[port("rad")]
    pub heading: f64,
    /// Centre of mass from the middle of the feet at the start.
    #[port("m")]
    pub start: Vec3,
}
