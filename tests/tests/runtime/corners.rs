//! Outputs with jumps or kinks but without guard: every continuous model of the catalogue is in one of the lists, with the reason why a step may
//! cross them. `jumps.rs` has the models with guards.
use crate::common;
use std::collections::BTreeSet;

/// Outputs and derivatives are smooth functions of time, states and inputs.
const SMOOTH: &[&str] = &[
    "actuators.differential",
    "actuators.belt",
    "actuators.gravity_compensation",
    "actuators.spring_damper",
    "basics.constant",
    "basics.energy_meter",
    "basics.gain",
    "basics.integrator",
    "basics.lag",
    "basics.path_length",
    "basics.product",
    "basics.sine",
    "basics.sum",
    "control.wheel_distribution",
    "flight.drag",
    "flight.gravity_gradient",
    "flight.ground_motion",
    "flight.ideal_feed",
    "flight.magnetic_field",
    "flight.rate_damping",
    "flight.wired_mass",
    "power.heat_source",
    "power.ideal_supply",
    "power.rtg",
    "power.thermal_boundary",
    "power.thermal_link",
    "power.thermal_node",
    "sensors.hinge_load",
    "sensors.joint_motion",
    "sensors.mass_properties",
    "sensors.motion",
    "sensors.relative_motion",
    "sensors.specific_force",
];

/// The only jumps are those of a boolean input (`supply`, `brake`, `grip`, a command), or of a number whose source jumps: the source ends the step.
const BY_ITS_INPUT: &[&str] = &[
    "flight.drain",
    "flight.held_thruster",
    "flight.vector_thrust",
    "manipulation.finger",
    "power.programmable_supply",
    "power.source",
];

/// A continuous output with a kink that depends on the motion of the driven object. No pulse is lost, because the output does not return by itself,
/// and adaptive methods take shorter steps there.
const CORNER_BY_MOTION: &[(&str, &str)] = &[
    ("actuators.angle_follower", "its greatest rate and acceleration"),
    ("actuators.ball_drive", "its greatest torque; half a turn has no axis"),
    ("actuators.bushing", "half a turn has no axis"),
    ("actuators.dc_motor", "its greatest current, and friction that is smooth at zero"),
    ("actuators.position_servo", "its greatest torque"),
    ("actuators.rate_follower", "its greatest acceleration"),
    ("actuators.rate_servo", "its greatest torque"),
    ("actuators.soft_stop", "force from the stop on, which grows with the depth"),
    ("actuators.strut", "no length has no direction"),
    ("actuators.torque_drive", "its greatest torque"),
    ("control.desaturation", "no field has no direction"),
    ("flight.bank_control", "its greatest torque"),
    ("flight.control_moment_gyro", "its greatest rate"),
    ("flight.gravity_turn", "no airspeed has no direction"),
    ("flight.magnetic_torquer", "its greatest dipole"),
    (
        "flight.orbit",
        "the apocentre of an orbit that opens, which is 1e30 m then; it acts on nothing",
    ),
    ("flight.panel_aerodynamics", "panels that turn into the wind"),
    ("flight.plume", "panels that turn into the jet"),
    ("flight.slosh", "no spring against the acceleration"),
    ("flight.station_keeping", "its greatest force"),
    ("flight.thrust_direction", "its greatest tilt"),
    ("flight.thrust_vector_control", "its greatest angle"),
    ("mobility.foot", "ground that is touched"),
    ("mobility.wheel_rigid", "ground that is touched"),
    ("mobility.wheel_rigid_quasi_static", "vehicles without inertia: nothing is integrated across"),
    ("mobility.wheel_rolling", "vehicles without inertia: nothing is integrated across"),
    ("mobility.wheel_scm", "ground that is touched"),
    ("mobility.wheel_soil", "ground that is touched"),
    ("mobility.wheel_soil_quasi_static", "vehicles without inertia: nothing is integrated across"),
    ("sensors.solar_clock", "where the Sun stands; it acts on nothing"),
];

/// A jump that drives away from itself, so that it is crossed at most once.
const JUMPS_APART: &[(&str, &str)] =
    &[("control.pointing", "half a turn from the target: the shorter way is on either side")];

/// A new continuous model without guards must be put into a list, or get a guard.
#[test]
fn every_model_without_a_guard_is_considered() {
    let lists = SMOOTH.iter().chain(BY_ITS_INPUT).copied();
    let with_reasons = CORNER_BY_MOTION.iter().chain(JUMPS_APART).map(|m| m.0);
    let all: Vec<&str> = lists.chain(with_reasons).collect();
    let known: BTreeSet<&str> = all.iter().copied().collect();
    assert_eq!(known.len(), all.len(), "a model is in two lists");
    let catalogue = common::catalogue();
    let without: BTreeSet<&str> = (catalogue.iter())
        .map(|entry| &entry.description)
        .filter(|d| !d.functions.guards && !d.functions.update)
        .filter(|d| d.functions.feedthrough || d.functions.outputs || d.functions.derivatives)
        .map(|d| d.name.as_ref())
        .filter(|name| !name.starts_with("fmi."))
        .collect();
    let missing: Vec<_> = without.difference(&known).collect();
    let gone: Vec<_> = known.difference(&without).collect();
    assert!(missing.is_empty() && gone.is_empty(), "missing: {missing:?}, gone: {gone:?}");
}
