//! Ports of the usual connectors: structs for `#[port(connector)]` fields of models (`framework/runtime/src/compile/connectors.rs`).
//!
//! | kind | determined by the source | flows from the source to the load |
//! |---|---|---|
//! | electrical | [`Voltage`] | [`Current`]; the source takes the sum: [`Currents`] |
//! | propellant | [`Propellant`] | [`MassFlow`]; the source takes the sum: [`MassFlows`] |
//! | heat | [`Temperature`] | [`HeatFlow`], positive into the source, which is a thermal node and takes the sum: [`HeatFlows`] |
//!
//! A part that only supplies heat, such as a motor, has [`HeatFlow`] alone; if its connector is not connected, the heat goes to the surroundings.
//!
//! A load has [`Voltage`] (or [`OpenVoltage`], if it may remain unconnected) among its inputs and [`Current`] among its outputs; a source has
//! [`Currents`] among its inputs and [`Voltage`] among its outputs. A current is positive while the load takes power and negative while it feeds
//! power back. A voltage must not depend directly on the current that is drawn, because that is an algebraic loop; therefore a battery has its
//! voltage as a state, and an ideal supply has a constant voltage.
use linkwork_derive::Ports;

/// Voltage between the poles of a connector.
#[derive(Ports, Clone, Copy, Debug, PartialEq)]
pub struct Voltage {
    /// Voltage.
    #[port("V")]
    pub voltage: f64,
}

/// Voltage between the poles of a connector that may stay open, such as the output of a solar panel.
#[derive(Ports, Clone, Copy, Debug, PartialEq)]
pub struct OpenVoltage {
    /// Voltage; 0 where it is not connected.
    #[port("V", default = 0.0)]
    pub voltage: f64,
}

/// Current that a connector takes from its source.
#[derive(Ports, Clone, Copy, Debug, PartialEq)]
pub struct Current {
    /// Current taken; negative: given back.
    #[port("A")]
    pub current: f64,
}

/// Currents that are taken from a source.
#[derive(Ports, Clone, Copy, Debug, PartialEq)]
pub struct Currents {
    /// Sum of the currents taken.
    #[port("A", sum)]
    pub current: f64,
}

/// Availability of propellant at a connector.
#[derive(Ports, Clone, Copy, Debug, PartialEq)]
pub struct Propellant {
    /// There is propellant.
    #[port]
    pub available: bool,
}

/// Propellant that a connector takes from its source.
#[derive(Ports, Clone, Copy, Debug, PartialEq)]
pub struct MassFlow {
    /// Mass flow taken; negative: given back.
    #[port("kg/s")]
    pub flow: f64,
}

/// Propellant that is taken from a source.
#[derive(Ports, Clone, Copy, Debug, PartialEq)]
pub struct MassFlows {
    /// Sum of the mass flows taken.
    #[port("kg/s", sum, default = 0.0)]
    pub flow: f64,
}

/// Temperature at a connector.
#[derive(Ports, Clone, Copy, Debug, PartialEq)]
pub struct Temperature {
    /// Temperature.
    #[port("K")]
    pub temperature: f64,
}

/// Heat that a connector gives to its source, such as a thermal node.
#[derive(Ports, Clone, Copy, Debug, PartialEq)]
pub struct HeatFlow {
    /// Heat flow given; negative: taken.
    #[port("W")]
    pub heat: f64,
}

/// Heat that is given to a source, such as a thermal node.
#[derive(Ports, Clone, Copy, Debug, PartialEq)]
pub struct HeatFlows {
    /// Sum of the heat flows given.
    #[port("W", sum, default = 0.0)]
    pub heat: f64,
}

impl Voltage {
    /// Returns the current at which this voltage gives a power (W); zero without voltage, where no power can be drawn.
    pub fn current_of(&self, power: f64) -> Current {
        Current { current: if self.is_on() { power / self.voltage } else { 0.0 } }
    }

    /// Returns whether there is a voltage; without it a device has no output.
    pub fn is_on(&self) -> bool {
        self.voltage > 0.0
    }

    /// Returns the limit of a device on this supply, in its unit: Returns `most` while there is a voltage, else 0.
    pub fn limit(&self, most: f64) -> f64 {
        if self.is_on() { most } else { 0.0 }
    }
}

impl OpenVoltage {
    /// Returns the current like [`Voltage::current_of`].
    pub fn current_of(&self, power: f64) -> Current {
        Voltage { voltage: self.voltage }.current_of(power)
    }
}
