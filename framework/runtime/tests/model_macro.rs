//! The macros: lanes, parameters with units, and dependencies read from signatures.
use linkwork_runtime::prelude::*;
use linkwork_runtime::{
    Catalogue, Description, Entry, Functions, Located, Origin, ReadCx, Services, Value,
};

/// Winding and gear.
#[derive(Params, Clone, Debug)]
struct MotorParams {
    /// Winding resistance.
    #[param(unit = "ohm", range = 1e-3..)]
    resistance: f64,
    /// Winding inductance.
    #[param(unit = "H", range = 1e-6..)]
    inductance: f64,
    /// Gear ratio.
    #[param(default = 1.0)]
    gear: f64,
}
#[derive(Ports, Clone, Copy, Debug)]
struct MotorIn {
    /// Terminal voltage.
    #[port("V", default = 0.0)]
    volts: f64,
    /// The shaft.
    #[port(bind = "shaft")]
    shaft: HingeState,
}
#[derive(Ports, Clone, Copy, Debug)]
struct MotorOut {
    /// Torque on the shaft.
    #[port(bind = "shaft")]
    torque: HingeTorque,
    /// Winding current.
    #[port("A")]
    current: f64,
}
#[derive(State, Clone, Copy, Debug)]
struct Winding {
    /// Current.
    #[port("A")]
    current: f64,
}
struct Motor {
    p: MotorParams,
}
/// A motor.
#[model("test.motor")]
impl Model for Motor {
    type Params = MotorParams;
    type U = MotorIn;
    type Ym = MotorOut;
    type X = Winding;
    fn moore(&self, _: &Clock, x: &Winding, _: &()) -> MotorOut {
        MotorOut { torque: HingeTorque(self.p.gear * x.current), current: x.current }
    }
    fn deriv(&self, _: &Clock, x: &Winding, _: &(), u: &MotorIn) -> Winding {
        let back_emf = self.p.gear * u.shaft.rate;
        Winding {
            current: (u.volts - self.p.resistance * x.current - back_emf) / self.p.inductance,
        }
    }
}

fn map(entries: Vec<(&str, Value)>) -> Located {
    Value::Map(entries.into_iter().map(|(k, v)| (k.to_string(), v.into())).collect()).into()
}

#[test]
fn description_is_read_from_the_source() {
    let d = Description::of::<Motor>();
    assert_eq!((&*d.name, &*d.doc), ("test.motor", "A motor."));
    let f = Functions { moore: true, deriv: true, ..Functions::default() };
    assert_eq!(d.functions, f);
    assert_eq!(d.bindings(), ["shaft"]);
    assert_eq!(d.inputs[1].lanes, 2);
    assert_eq!(d.inputs[0].default, Some(vec![0.0]));
    assert_eq!(d.params[0].doc, "Winding resistance.");
}

#[test]
fn parameters_take_units_and_refuse_all_mistakes_at_once() {
    let services = Services::default();
    let entry = Entry::model::<Motor>();
    let mut cx = ReadCx::new("rover.motor", &services);
    let good = map(vec![
        ("resistance", Value::Text("600 mohm".into())),
        ("inductance", Value::Number(1e-3)),
    ]);
    let model = entry.make_model(&good, &mut cx).unwrap();
    assert_eq!(
        model.params().to_string(),
        r#"{"resistance": 0.6, "inductance": 0.001, "gear": 1.0}"#
    );

    let bad = map(vec![
        ("resistence", Value::Number(1.0)),
        ("resistance", Value::Text("3 V".into())),
        ("inductance", Value::Number(-1.0)),
        ("gear", Value::Number(f64::NAN)),
        ("gear", Value::Number(1.0)),
    ]);
    assert!(entry.make_model(&bad, &mut cx).is_none());
    let text: Vec<String> = cx
        .faults
        .iter()
        .map(|f| format!("{} {}", f.message, f.help.clone().unwrap_or_default()))
        .collect();
    let all = text.join("\n");
    for part in [
        "`rover.motor` has no parameter `resistence` did you mean `resistance`?",
        "`3 V` is in V, but ohm is wanted",
        "`rover.motor.inductance` = -1 H is out of range 1e-6 ..",
        "`rover.motor.gear` is not a number",
        "`gear` is written twice",
    ] {
        assert!(all.contains(part), "{part}\nis not in\n{all}");
    }
}

#[test]
fn unknown_models_are_guessed() {
    let catalogue = Catalogue::new([vec![Entry::model::<Motor>()]]);
    let fault = catalogue.find("test.moter", Origin::NONE, "rover.m").err().unwrap();
    assert!(fault.help.unwrap().contains("did you mean `test.motor`?"));
}
