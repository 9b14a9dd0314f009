//! Ports of the usual connectors: structs for `#[port(connector)]` fields of models (`framework/runtime/src/compile/connectors.rs`).
//!
//! | kind | determined by the source | flows from the source to the load |
//! |---|---|---|
//! | electrical | [`Voltage`] | [`Current`]; the source takes the sum: [`Currents`] |
//! | propellant | [`Propellant`] | [`MassFlow`]; the source takes the sum: [`MassFlows`] |
//! | heat | [`Temperature`] | [`HeatFlow`], positive into the source, which is a thermal node and takes the sum: [`HeatFlows`] |
//!
//! A part that only gives heat, such as a motor, has [`HeatFlow`] alone; it may stay open: its heat then goes to the surroundings.
//!
//! A load has [`Voltage`] (or [`OpenVoltage`], where it may stay open) among its inputs and [`Current`] among its outputs; a source has [`Currents`] among its inputs and [`Voltage`] among its
//! outputs. A current is positive where the load takes power; negative where it gives power back. A voltage must not depend at once on the
//! current that is drawn, because that is an algebraic loop: a battery has its voltage as state, an ideal supply has a constant one.
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

/// Whether there is propellant at a connector.
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

    /// Whether there is a voltage: a device without one gives nothing.
    pub fn is_on(&self) -> bool {
        self.voltage > 0.0
    }

    /// Returns the limit of a device on this supply, in its unit: `most` while there is a voltage, else 0.
    pub fn limit(&self, most: f64) -> f64 {
        if self.is_on() { most } else { 0.0 }
    }
}

impl OpenVoltage {
    /// As [`Voltage::current_of`].
    pub fn current_of(&self, power: f64) -> Current {
        Voltage { voltage: self.voltage }.current_of(power)
    }
}
