//! Connectors: one statement connects the flow of a part with its supply in both directions.
use linkwork_assembly::{Look, Options, load_text};
use linkwork_runtime::prelude::*;
use linkwork_runtime::{Catalogue, Files, Seconds, Simulation};

/// Voltage at a connector.
#[derive(Ports, Clone, Copy, Debug)]
pub struct Volts {
    /// Voltage.
    #[port("V")]
    pub voltage: f64,
}
/// Current that a connector receives from its parts.
#[derive(Ports, Clone, Copy, Debug)]
pub struct TakesAmps {
    /// Sum of the currents drawn.
    #[port("A", sum)]
    pub current: f64,
}
/// Current that a connector draws.
#[derive(Ports, Clone, Copy, Debug)]
pub struct DrawsAmps {
    /// Current drawn.
    #[port("A")]
    pub current: f64,
}
/// Heat that a connector receives.
#[derive(Ports, Clone, Copy, Debug)]
pub struct TakesHeat {
    /// Heat flow.
    #[port("W", sum)]
    pub heat: f64,
}
/// Temperature at a connector.
#[derive(Ports, Clone, Copy, Debug)]
pub struct Temperature {
    /// Temperature.
    #[port("K")]
    pub temperature: f64,
}

/// Inputs of the source.
#[derive(Ports, Clone, Copy, Debug)]
pub struct SourceIn {
    /// Terminal.
    #[port(connector)]
    pub terminal: TakesAmps,
}
/// A source of 28 V that measures its current.
pub struct Source;
/// A source of 28 V that measures its current.
#[model("test.source")]
impl Model for Source {
    type FeedthroughInputs = SourceIn;
    type Outputs = SourceVolts;
    type FeedthroughOutputs = SourceGiven;
    fn build(_: ()) -> Result<Self, BuildError> {
        Ok(Source)
    }
    fn outputs(&self) -> SourceVolts {
        SourceVolts { terminal: Volts { voltage: 28.0 } }
    }
    fn feedthrough(&self, u: &SourceIn) -> SourceGiven {
        SourceGiven { given: u.terminal.current }
    }
}
/// Voltage of the source.
#[derive(Ports, Clone, Copy, Debug)]
pub struct SourceVolts {
    /// Terminal.
    #[port(connector)]
    pub terminal: Volts,
}
/// Current of the source.
#[derive(Ports, Clone, Copy, Debug)]
pub struct SourceGiven {
    /// The measured current.
    #[port("A")]
    pub given: f64,
}

/// Resistance of a load.
#[derive(Params, Clone, Debug)]
pub struct LoadParams {
    /// Resistance.
    #[param(unit = "ohm", range = 1e-3..)]
    pub resistance: f64,
}
/// Supply of a load.
#[derive(Ports, Clone, Copy, Debug)]
pub struct LoadIn {
    /// Supply.
    #[port(connector)]
    pub supply: Volts,
}
/// Current of a load.
#[derive(Ports, Clone, Copy, Debug)]
pub struct LoadOut {
    /// Supply.
    #[port(connector)]
    pub supply: DrawsAmps,
}
/// A resistor.
pub struct Load {
    p: LoadParams,
}
/// A resistor.
#[model("test.load")]
impl Model for Load {
    type Params = LoadParams;
    type FeedthroughInputs = LoadIn;
    type FeedthroughOutputs = LoadOut;
    fn build(p: LoadParams) -> Result<Self, BuildError> {
        Ok(Load { p })
    }
    fn feedthrough(&self, u: &LoadIn) -> LoadOut {
        LoadOut { supply: DrawsAmps { current: u.supply.voltage / self.p.resistance } }
    }
}

/// Inputs of a thermal mass.
#[derive(Ports, Clone, Copy, Debug)]
pub struct MassIn {
    /// Surface.
    #[port(connector)]
    pub surface: TakesHeat,
}
/// Outputs of a thermal mass.
#[derive(Ports, Clone, Copy, Debug)]
pub struct MassOut {
    /// Surface.
    #[port(connector)]
    pub surface: Temperature,
}
/// A thermal mass at 300 K.
pub struct Mass;
/// A thermal mass at 300 K.
#[model("test.mass")]
impl Model for Mass {
    type FeedthroughInputs = MassIn;
    type Outputs = MassOut;
    fn build(_: ()) -> Result<Self, BuildError> {
        Ok(Mass)
    }
    fn outputs(&self) -> MassOut {
        MassOut { surface: Temperature { temperature: 300.0 } }
    }
}

/// A voltage that is not a connector.
pub struct Constant;
/// A voltage that is not a connector.
#[model("test.constant")]
impl Model for Constant {
    type Outputs = Volts;
    fn build(_: ()) -> Result<Self, BuildError> {
        Ok(Constant)
    }
    fn outputs(&self) -> Volts {
        Volts { voltage: 5.0 }
    }
}

fn catalogue() -> Catalogue {
    Catalogue::new([vec![
        Entry::model::<Source>(),
        Entry::model::<Load>(),
        Entry::model::<Mass>(),
        Entry::model::<Constant>(),
    ]])
}

const BOX: &str = r#"Assembly(
    parts: { "Inner": (model: "test.load", params: { "resistance": 28 }) },
    exports: { "supply": "Inner.supply" },
)"#;

const PARTS: &str = r#""Battery": (model: "test.source"), "Motor": (model: "test.load", params: { "resistance": 14 }), "Box": (assembly: "box.ron"),
    "Heaters": (model: "test.load", params: { "resistance": 7 }, array: [(), ()]), "Plate": (model: "test.mass"), "Fixed": (model: "test.constant"),"#;

/// Returns the current of the battery, or the report of faults.
fn given(more: &str) -> Result<f64, String> {
    let catalogue = catalogue();
    let options = Options::new(&catalogue).embed("box.ron", BOX);
    let text = format!("Simulation(parts: {{ {PARTS} }}, step: \"1 ms\", until: \"1 s\", {more})");
    let loaded =
        load_text("sim.ron", &text, &options).map_err(|f| f.show(Look::Plain).to_string())?;
    let program = loaded.compile(&catalogue, &Files::default()).map_err(|f| f.to_string())?;
    // The resolved text contains the same wires.
    let again = load_text("again.ron", &loaded.resolved, &options)
        .map_err(|f| f.show(Look::Plain).to_string())?;
    again.compile(&catalogue, &Files::default()).map_err(|f| f.to_string())?;
    let mut sim = Simulation::of(program.into());
    sim.run_until(Seconds { num: 1, den: 100 }).unwrap();
    Ok(sim.get("Battery.given").unwrap())
}

const ALL: &str = r#"("Motor.supply", "Battery.terminal"), ("Box.supply", "Battery.terminal"), ("Heaters[*].supply", "Motor.supply"),"#;

#[test]
fn currents_of_all_that_is_connected_add_up() {
    // 28 V at 14 Ω, at 28 Ω and twice at 7 Ω: 2 + 1 + 4 + 4 A. The loads are connected through an export,
    // an array, and a chain of entries.
    assert_eq!(given(&format!("connect: [{ALL}]")).unwrap(), 11.0);
    // One entry that lists many connectors makes the same node.
    let one =
        r#"connect: [("Heaters[*].supply", "Motor.supply", "Box.supply", "Battery.terminal")]"#;
    assert_eq!(given(one).unwrap(), 11.0);
    // A sensor may read an output of a connector. A removed load draws no current.
    let phase = format!(
        r#"connect: [{ALL}], phases: {{ "all": (remove: ["Motor"], connect: [("Heaters[*].supply", "Battery.terminal")]) }}, start: "all""#
    );
    assert_eq!(given(&phase).unwrap(), 9.0);
}

#[test]
fn a_connector_that_is_forgotten_is_named() {
    let fault =
        given(r#"connect: [("Motor.supply", "Box.supply", "Battery.terminal")]"#).unwrap_err();
    assert!(fault.contains("connector `Heaters1.supply` is not connected"), "{fault}");
    assert!(fault.contains("connect: [(\"Heaters1.supply\""), "{fault}");
    // There is one message per connector instead of one per port.
    assert_eq!(fault.matches("Heaters1.supply` is not connected").count(), 1, "{fault}");
}

#[test]
fn what_does_not_belong_together_is_refused() {
    let refused = |more: &str| given(&format!("connect: [{ALL} {more}]")).unwrap_err();
    let fault = refused(r#"("Plate.surface", "Battery.terminal")"#);
    assert!(
        fault.contains("(current, voltage)") && fault.contains("(heat, temperature)"),
        "{fault}"
    );
    let fault = refused(r#"("Fixed.voltage", "Motor.supply")"#);
    assert!(fault.contains("`Fixed.voltage`: it is not a connector"), "{fault}");
    assert!(fault.contains("`Fixed` has no connectors"), "{fault}");
    let fault = refused(r#"("Motor.power", "Battery.terminal")"#);
    assert!(fault.contains("connectors of `Motor`: supply"), "{fault}");
    let fault = refused(r#"("Motor.supply",)"#);
    assert!(fault.contains("two or more connectors"), "{fault}");
    let fault = refused(r#"("Motr.supply", "Battery.terminal")"#);
    assert!(fault.contains("did you mean `Motor`"), "{fault}");
    let fault =
        given(r#"connect: [("Motor.supply", "Heaters[*].supply", "Box.supply")]"#).unwrap_err();
    assert!(fault.contains("no source among `Box.Inner.supply`, `Heaters1.supply`"), "{fault}");
}

#[test]
fn two_sources_at_one_node_are_refused() {
    let catalogue = catalogue();
    let text = r#"Simulation(
        parts: { "A": (model: "test.source"), "B": (model: "test.source"), "Load": (model: "test.load", params: { "resistance": 1 }) },
        connect: [("Load.supply", "A.terminal", "B.terminal")], step: "1 ms", until: "1 s",
    )"#;
    let fault = load_text("sim.ron", text, &Options::new(&catalogue))
        .err()
        .unwrap()
        .show(Look::Plain)
        .to_string();
    assert!(fault.contains("2 sources: `A.terminal`, `B.terminal`"), "{fault}");
}

#[test]
fn wires_that_leave_half_of_a_connector_out_are_refused() {
    let wired = |wires: &str| {
        given(&format!(
            r#"connect: [("Heaters[*].supply", "Box.supply", "Battery.terminal")], wires: [{wires}]"#
        ))
    };
    // If only the voltage is wired, the current has no source.
    let fault = wired(r#""Battery.terminal.voltage -> Motor.supply.voltage""#).unwrap_err();
    assert!(fault.contains("`Motor.supply` receives `supply.voltage` from `Battery.terminal`, but its `supply.current` is not connected back to it"), "{fault}");
    // A voltage output that is not part of a connector cannot receive a current.
    let fault = wired(r#""Fixed.voltage -> Motor.supply.voltage""#).unwrap_err();
    assert!(fault.contains("`Fixed.voltage` drives `Motor.supply.voltage`, an input of the connector `Motor.supply`"), "{fault}");
    // Two single wires are equivalent to the connection.
    let both = r#""Battery.terminal.voltage -> Motor.supply.voltage", "Motor.supply.current -> Battery.terminal.current""#;
    assert_eq!(wired(both).unwrap(), 11.0);
}
