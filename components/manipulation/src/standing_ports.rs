//! Parameters, inputs, outputs and state of `manipulation.standing_controller`.

use crate::arm::{InertiaCheck, RobotFile};
use linkwork_surroundings::prelude::*;

/// Parameters: the machine and its stance.
#[derive(Params, Clone, Debug)]
pub struct StandingParams {
    /// Robot description that the controller uses. It supplies masses and joint limits and may differ from the simulated machine.
    pub robot: RobotFile,
    /// Handling of moments of inertia that are not physical: `Warn` accepts them with a warning, `Physical` rejects them with an error.
    #[param(default = InertiaCheck::Warn)]
    pub inertia_check: InertiaCheck,
    /// Link of the trunk: the floating base.
    pub trunk: String,
    /// Mass of the trunk that the controller assumes; its moments of inertia are scaled in proportion. Default: the mass in the description.
    #[param(unit = "kg", default = None, range = 1e-6..)]
    pub trunk_mass: Option<f64>,
    /// Links whose origins are the points of the feet, around the machine; each ends a leg of three joints.
    pub feet: Vec<String>,
    /// Rotor inertia of each joint, reflected to the joint (gear² times rotor inertia): leg by leg, trunk to foot. Default: zeros.
    #[param(unit = "kg m^2", default = Vec::new())]
    pub armature: Vec<f64>,
    /// Height of the centre of mass over the mean position of the feet when standing.
    #[param(unit = "m", range = 1e-3..)]
    pub height: f64,
    /// Duration of standing up.
    #[param(unit = "s", default = 1.5, range = 1e-3..)]
    pub rise: f64,
    /// Amplitude of the sway of the centre of mass, in axes of the heading at the start.
    #[param(unit = "m", default = Vec3::zeros())]
    pub sway: Vec3,
    /// Period of the sway.
    #[param(unit = "s", default = 1.5, range = 1e-2.., needs = "sway")]
    pub sway_period: f64,
    /// Time after the start at which the sway begins. Its amplitude grows over one period.
    #[param(unit = "s", default = 4.0, range = 0.0.., needs = "sway")]
    pub sway_from: f64,
    /// Friction coefficient at the feet that the controller assumes.
    #[param(default = 0.6, range = 1e-3..)]
    pub friction: f64,
    /// Maximum force along each edge of a foot's friction pyramid.
    #[param(unit = "N", default = 100.0, range = 1e-3..)]
    pub force_max: f64,
    /// Natural frequency of the error dynamics of centre of mass and attitude.
    #[param(unit = "rad/s", default = 12.0, range = 1e-3..)]
    pub bandwidth: f64,
    /// Gravitational acceleration that the controller assumes, W. Default: the simulation's gravity at the origin of W; zero without gravity.
    #[param(unit = "m/s^2")]
    pub gravity: Option<Vec3>,
    /// Gravity of the simulation.
    #[param(service)]
    pub field: Option<Handle<dyn Gravity>>,
}

/// Measurements of the trunk.
#[derive(Ports, Clone, Copy, Debug)]
pub struct TrunkIn {
    /// Attitude: from the trunk's axes to W, z up.
    #[port("1")]
    pub rotation: Quat,
    /// Angular velocity, axes of the trunk.
    #[port("rad/s")]
    pub angular: Vec3,
}

/// Status of the controller.
#[derive(Ports, Clone, Copy, Debug)]
pub struct StandingOut {
    /// The machine stands: the rise is over, the centre of mass is inside the polygon of the feet and above half of `height`, and the trunk is within
    /// 0.5 rad of level.
    #[port("1")]
    pub stands: bool,
    /// A leg is fully extended (singular) or an input is not finite. The controller then only damps the joints.
    #[port("1")]
    pub singular: bool,
    /// A torque was limited to the effort limit of its joint.
    #[port("1")]
    pub limited: bool,
    /// Centre of mass relative to the mean position of the feet, from the embedded model.
    #[port("m")]
    pub com: Vec3,
    /// Position error of the centre of mass.
    #[port("m")]
    pub error: f64,
    /// Attitude error of the trunk.
    #[port("rad")]
    pub error_angle: f64,
    /// Distance of the centre of mass from the nearest edge of the support polygon; negative outside.
    #[port("m")]
    pub inside: f64,
    /// Required friction coefficient: the largest ratio of tangential to normal force at a foot.
    #[port("1")]
    pub friction: f64,
    /// Smallest normal force at a foot.
    #[port("N")]
    pub press: f64,
    /// Part of the required force that the feet cannot supply.
    #[port("N")]
    pub lack: f64,
    /// Largest ratio of a joint torque to its effort limit.
    #[port("1")]
    pub share: f64,
}

/// Discrete state.
#[derive(State, Clone, Copy, Debug)]
pub struct Stand {
    /// A first sample has been taken.
    #[port("1")]
    pub begun: bool,
    /// Time since the first sample.
    #[port("s")]
    pub elapsed: f64,
    /// Heading at the start.
    #[port("rad")]
    pub heading: f64,
    /// Centre of mass relative to the mean position of the feet at the start.
    #[port("m")]
    pub start: Vec3,
}
