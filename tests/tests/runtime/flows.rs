//! Outputs that are a flow of mass, charge or energy: each is a connector, is declared in the balance of its part, or only reports a flow that is
//! elsewhere. A plain output of a conserved quantity that another part should receive is lost silently if no wire takes it.
use crate::common;
use std::collections::BTreeSet;

/// Units of flows.
const FLOWS: [&str; 5] = ["kg/s", "A", "mA", "W", "kW"];

/// Outputs that no part needs to take, with the reason.
const REPORTS: &[(&str, &str)] = &[
    ("mobility.foot.power", "dissipated in the ground"),
    ("actuators.ball_drive.power", "the power of its `supply`"),
    (
        "actuators.dc_motor.current",
        "the current of its winding; the current of `supply` follows from the chopper",
    ),
    ("actuators.dc_motor.power", "the power of its `supply`"),
    ("actuators.position_servo.power", "the power of its `supply`"),
    ("actuators.rate_follower.power", "the power of its `supply`"),
    ("actuators.rate_servo.power", "the power of its `supply`"),
    ("actuators.torque_drive.power", "the power of its `supply`"),
    ("flight.airbag.flow", "gas that leaves the vehicle; the airbag has no mass"),
    (
        "flight.balloon.flow",
        "gas that leaves the vehicle: its mass is the state of the balloon, which the body has",
    ),
    ("flight.control_moment_gyro.power", "the power of its `supply`"),
    ("flight.magnetic_torquer.power", "the power of its `supply`"),
    ("flight.reaction_wheel.power", "the power of its `supply`"),
    ("mobility.wheel_rigid.power", "dissipated in the contact"),
    ("mobility.wheel_rigid_quasi_static.power", "dissipated in the contact"),
    ("mobility.wheel_rolling.power", "dissipated by rolling"),
    ("mobility.wheel_scm.power", "dissipated in the ground"),
    ("mobility.wheel_soil.power", "dissipated in the ground"),
    ("mobility.wheel_soil_quasi_static.power", "dissipated in the ground"),
    ("power.battery.current", "the current of its `terminal` and `charger`, with the lag"),
    ("power.converter.power", "the power of its `input`"),
    ("power.heater.power", "the power of its `supply`"),
    ("power.ideal_supply.current", "the current of its `terminal`"),
    ("power.ideal_supply.power", "the power of its `terminal`"),
    ("power.load.power", "the power of its `supply`"),
    ("power.rtg.power", "the power of its `output`"),
    ("power.solar_panel.power", "the power of its `output`"),
    ("power.source.fed", "the power of its `output`"),
    ("sensors.current.reading", "a measurement"),
];

/// A new output in a unit of a flow must be a connector, have an account (`lost`, `gained`, `stored`), or be listed with its reason.
#[test]
fn every_flow_of_a_conserved_quantity_has_a_place_to_go() {
    let catalogue = common::catalogue();
    let listed: BTreeSet<&str> = REPORTS.iter().map(|r| r.0).collect();
    assert_eq!(listed.len(), REPORTS.len(), "an output is listed twice");
    let (mut plain, mut connected) = (BTreeSet::new(), 0);
    for entry in catalogue.iter().filter(|e| !e.description.name.starts_with("fmi.")) {
        for port in entry.description.all_outputs() {
            if !FLOWS.contains(&port.unit.as_ref()) {
                continue;
            }
            if port.connector.is_some() || port.account.is_some() {
                connected += 1;
            } else {
                plain.insert(format!("{}.{}", entry.description.name, port.name));
            }
        }
    }
    println!("{connected} flows with a connector or an account, {} reports", plain.len());
    assert!(connected > 30, "{connected}");
    let new: Vec<_> = plain.iter().filter(|p| !listed.contains(p.as_str())).collect();
    let gone: Vec<_> = listed.iter().filter(|p| !plain.contains(**p)).collect();
    assert!(new.is_empty() && gone.is_empty(), "not listed: {new:?}\nno such output: {gone:?}");
}
