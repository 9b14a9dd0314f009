//! The macros: lanes, parameters with units, and dependencies read from signatures.
use linkwork_runtime::prelude::*;
use linkwork_runtime::{
    Catalogue, Description, Entry, Files, Functions, Located, Origin, Params as _, ReadCx,
    Services, Value,
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
    type Inputs = MotorIn;
    type Outputs = MotorOut;
    type State = Winding;
    fn outputs(&self, x: &Winding) -> MotorOut {
        MotorOut { torque: HingeTorque(self.p.gear * x.current), current: x.current }
    }
    fn derivatives(&self, x: &Winding, u: &MotorIn) -> Winding {
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
    let f = Functions { outputs: true, derivatives: true, ..Functions::default() };
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
        "`3 V` is in V, but ohm is expected",
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

/// Tables as parameters.
#[derive(Params, Clone, Debug)]
struct TableParams {
    /// Numbers in m.
    #[param(unit = "m", range = 0.0..)]
    heights: Vec<f64>,
    /// Rows.
    #[param(default = vec![])]
    rows: Vec<[f64; 2]>,
    /// Rows of different quantities.
    #[param(unit = "s, N", default = vec![])]
    curve: Vec<[f64; 2]>,
    /// Words.
    #[param(default = vec![])]
    words: Vec<String>,
}
#[test]
fn lists_may_be_columns_of_a_file() {
    let folder = tempfile::tempdir().unwrap();
    let services = Services::default();
    let read = |text: &str, params: Vec<(&str, Value)>| {
        std::fs::write(folder.path().join("t.csv"), text).unwrap();
        let mut cx = ReadCx::new("part", &services);
        cx.files = Files::of(vec![folder.path().into()]);
        let read = TableParams::read_map(&map(params), &mut cx);
        let told = |f: &linkwork_runtime::Fault| format!("{} / {:?}", f.message, f.help);
        read.ok_or_else(|| cx.faults.iter().map(told).collect::<Vec<_>>().join("\n"))
    };
    let text = |t: &str| Value::Text(t.into());
    let column = |name: &str| map(vec![("file", text("t.csv")), ("column", text(name))]).value;
    let columns = |names: Vec<Value>| {
        let names = Value::List(names.into_iter().map(Located::from).collect());
        map(vec![("file", text("t.csv")), ("columns", names)]).value
    };
    let good = "# ignored\nh [km], cd, word\n1, 0.25, low\n2.5, 0.5, high\n";
    let all = vec![
        ("heights", column("h")),
        ("rows", columns(vec![text("cd"), text("cd")])),
        ("words", column("word")),
    ];
    let p = read(good, all).unwrap();
    assert_eq!(p.heights, [1000.0, 2500.0]);
    assert_eq!(p.rows, [[0.25, 0.25], [0.5, 0.5]]);
    assert_eq!(p.words, ["low", "high"]);
    // Spreadsheets of other countries write a byte order mark, semicolons and decimal commas; others write tabs.
    for other in ["\u{feff}h [km];cd\n1,5;3\n", "h [km]\tcd\n1.5\t3\n"] {
        assert_eq!(
            read(other, vec![("heights", column("h"))]).unwrap().heights,
            [1500.0],
            "{other}"
        );
    }
    // Rows of different quantities: each column is converted from the unit of its heading.
    let pair = || columns(vec![text("time"), text("thrust")]);
    let converted = read(
        "time [ms], thrust [kN]\n10, 2\n500, 3.5\n",
        vec![("curve", pair()), ("heights", Value::List(vec![]))],
    );
    assert_eq!(converted.unwrap().curve, [[0.01, 2000.0], [0.5, 3500.0]]);
    let lines = |rows: &[[&str; 2]]| {
        let row = |r: &[&str; 2]| Value::List(r.iter().map(|t| text(t).into()).collect()).into();
        Value::List(rows.iter().map(row).collect())
    };
    let given = vec![("curve", lines(&[["10 ms", "2 kN"]])), ("heights", Value::List(vec![]))];
    assert_eq!(read(good, given).unwrap().curve, [[0.01, 2000.0]]);
    for (content, which, wanted) in [
        (
            "time [N], thrust [s]\n1, 2\n",
            "curve",
            "t.csv:2: `part.curve`: `1.0 N` is in N, but s is expected",
        ),
        ("time [s], thrust [s]\n1, 2\n", "curve", "`2.0 s` is in s, but N is expected"),
        ("time [s], thrust [N]\n1, 2\n", "rows", "the heading of the column has the unit"),
    ] {
        let told = read(content, vec![(which, pair()), ("heights", Value::List(vec![]))]);
        let told = told.unwrap_err();
        assert!(told.contains(wanted), "{content:?}: {told}");
    }
    // A single column needs no name.
    let only = map(vec![("file", text("t.csv"))]).value;
    assert_eq!(read("h\n7\n", vec![("heights", only.clone())]).unwrap().heights, [7.0]);
    for (content, value, wanted) in [
        (good, column("hh"), "t.csv has no column `hh`"),
        (good, only, "one column or a list of columns is expected / Some(\"write `column: ..`"),
        (good, column("word"), "t.csv:3: `part.heights`"),
        ("h\n1\n-2\n", column("h"), "t.csv:3: `part.heights` = -2 m is out of range"),
        (
            "h [kg]\n1\n",
            column("h"),
            "t.csv:2: `part.heights`: `1.0 kg` is in kg, but m is expected",
        ),
        ("h, h\n1, 2\n", column("h"), "t.csv has two columns `h`"),
        ("h, g\n1\n", column("h"), "t.csv: line 2 has 1 cells, not 2"),
        ("h\n", column("h"), "t.csv has no rows below its headings"),
        ("h\nnan\n", column("h"), "t.csv:2: "),
    ] {
        let told = read(content, vec![("heights", value)]).unwrap_err();
        assert!(told.contains(wanted), "{content:?}: {told}");
    }
    let folderless = map(vec![("file", text("none.csv")), ("column", text("h"))]).value;
    let told = read(good, vec![("heights", folderless)]).unwrap_err();
    assert!(told.contains("there is no file `none.csv`"), "{told}");
}
