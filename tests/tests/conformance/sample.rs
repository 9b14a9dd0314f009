//! Parameters for an unconfigured model: defaults, and made-up values for required ones.
use linkwork_runtime::{Entry, Fault, Located, ParamSpec, Prototype, ReadCx, Services, Value};

/// Path at which the model under test is built.
pub const PATH: &str = "bench.part";

/// Required parameters that are only valid in combination, for which a made-up value would be rejected.
fn written(model: &str, param: &str) -> Option<Value> {
    let list = |v: &[f64]| Value::List(v.iter().map(|x| Value::Number(*x).into()).collect());
    let pairs = |v: &[[f64; 2]]| Value::List(v.iter().map(|p| list(p).into()).collect());
    match (model, param) {
        ("control.ackermann" | "control.odometry", "wheels") => {
            let wheel = |[x, y]: [f64; 2]| {
                let steered = Value::Bool(x != 0.0).into();
                let place = list(&[x, y]).into();
                Value::Map(vec![("position".into(), place), ("steered".into(), steered)]).into()
            };
            let places = [[1.1, 1.0], [1.1, -1.0], [0.0, 1.1], [0.0, -1.1], [-1.0, 1.0]];
            Some(Value::List(places.map(wheel).to_vec()))
        }
        ("control.plan", "commands" | "steps") => {
            let entry = |key: &str, value: Value| (key.into(), value.into());
            let text = |t: &str| Value::Text(t.into());
            let on = |on: bool| Value::Map(vec![entry("radio", Value::Bool(on))]);
            let only = match param {
                "commands" => vec![entry("name", text("radio"))],
                _ => vec![
                    entry("name", text("talk")),
                    entry("when", text("time > 0.05 s")),
                    entry("set", on(true)),
                    entry("duration", Value::Number(0.06)),
                    entry("then", on(false)),
                ],
            };
            Some(Value::List(vec![Value::Map(only).into()]))
        }
        ("actuators.soft_stop", "lower") => Some(Value::Number(-0.4)),
        ("actuators.soft_stop", "upper") => Some(Value::Number(0.3)),
        ("basics.lookup", "table") => Some(pairs(&[[-1.0, 2.0], [0.0, 0.5], [3.0, 4.0]])),
        ("basics.hinge_trajectory" | "basics.slider_trajectory", "profile") => {
            Some(pairs(&[[0.3, 0.0], [0.7, 0.4], [1.2, -0.1]]))
        }
        ("flight.axisymmetric_aerodynamics", "angles") => Some(list(&[0.0, 2.0, 4.0])),
        ("flight.axisymmetric_aerodynamics", "axial" | "normal" | "pitch") => {
            let row = |x: f64| list(&[x]).into();
            Some(Value::List(vec![row(1.5), row(0.7), row(-0.2)]))
        }
        ("flight.entry_aerodynamics", "drag" | "lift_to_drag") => {
            Some(pairs(&[[0.0, 1.1], [2.0, 1.4], [5.0, 1.3]]))
        }
        ("control.wheel_distribution", "axes") => {
            let axis = |v: [f64; 3]| list(&v).into();
            let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
            Some(Value::List(axes.map(axis).to_vec()))
        }
        ("flight.waypoints", "waypoints") => {
            let place = |z: f64, through: f64| {
                let place = ("position".into(), list(&[0.0, 0.0, z]).into());
                let number = |key: &str, x: f64| (key.into(), Value::Number(x).into());
                Value::Map(vec![place, number("speed", 0.3), number("through", through)]).into()
            };
            Some(Value::List(vec![place(9.0, 0.1), place(2.0, 0.0)]))
        }
        ("flight.entry_guidance", "ballistic") => Some(Value::Number(137.0)),
        ("flight.entry_guidance", "density") => Some(Value::Number(0.0158)),
        ("flight.entry_guidance", "scale_height") => Some(Value::Number(9354.0)),
        ("flight.entry_guidance", "lift_to_drag") => Some(Value::Number(0.24)),
        ("flight.entry_guidance", "start_height") => Some(Value::Number(80_000.0)),
        ("flight.entry_guidance", "start_speed") => Some(Value::Number(5845.0)),
        ("flight.entry_guidance", "start_angle") => Some(Value::Number(-0.26)),
        ("flight.entry_guidance", "end_speed") => Some(Value::Number(450.0)),
        ("flight.hazard_map", "spacing") => Some(Value::Number(0.1)),
        ("flight.convex_descent", "times") => Some(list(&[30.0, 90.0])),
        ("flight.line_twist", "length") => Some(Value::Number(5.0)),
        ("flight.solid_motor", "curve") => Some(pairs(&[[0.0, 0.0], [0.05, 9.0], [0.1, 0.0]])),
        ("flight.body_load", "rows") => {
            let row = |t: f64| Value::Map(vec![("time".into(), Value::Number(t).into())]).into();
            Some(Value::List(vec![row(0.0), row(0.1)]))
        }
        ("flight.pitch_program", "rows") => {
            let entry = |key: &str, x: f64| (key.into(), Value::Number(x).into());
            let row = |t: f64, x: f64| Value::Map(vec![entry("time", t), entry("pitch", x)]).into();
            Some(Value::List(vec![row(0.0, 0.0), row(0.1, 0.4), row(0.3, 0.5)]))
        }
        ("flight.sequence", "rows") => Some(pairs(&[[0.0, 1.0], [0.1, 2.0], [5.0, 0.0]])),
        ("flight.dave_aerodynamics" | "flight.dave_model", "model") => {
            let text = include_str!("../../../sims/nesc/brick.dml");
            let entry = |key: &str, text: &str| (key.into(), Value::Text(text.into()).into());
            Some(Value::Map(vec![entry("name", "brick.dml"), entry("text", text)]))
        }
        ("manipulation.arm_controller", "robot") => {
            let text = include_str!("../../../assemblies/arms/six_axis.urdf");
            let entry = |key: &str, text: &str| (key.into(), Value::Text(text.into()).into());
            Some(Value::Map(vec![entry("name", "six_axis.urdf"), entry("text", text)]))
        }
        ("manipulation.dual_arm_controller", "robot") => {
            let text = include_str!("../../../assemblies/arms/dual_six_axis.urdf");
            let entry = |key: &str, text: &str| (key.into(), Value::Text(text.into()).into());
            Some(Value::Map(vec![entry("name", "dual_six_axis.urdf"), entry("text", text)]))
        }
        ("manipulation.dual_arm_controller", "left_tip") => Some(Value::Text("left_tool".into())),
        ("manipulation.dual_arm_controller", "right_tip") => Some(Value::Text("right_tool".into())),
        ("manipulation.standing_controller", "robot") => {
            let text = include_str!("../../../assemblies/legs/quadruped.urdf");
            let entry = |key: &str, text: &str| (key.into(), Value::Text(text.into()).into());
            Some(Value::Map(vec![entry("name", "quadruped.urdf"), entry("text", text)]))
        }
        ("manipulation.standing_controller", "trunk") => Some(Value::Text("trunk".into())),
        ("manipulation.standing_controller", "feet") => {
            let feet = ["lf_foot", "rf_foot", "rh_foot", "lh_foot"];
            Some(Value::List(feet.map(|f| Value::Text(f.into()).into()).to_vec()))
        }
        ("manipulation.arm_controller", "tip") => Some(Value::Text("tool".into())),
        _ => None,
    }
}

/// Returns a value of a kind with every number equal to `x`; `None` for a service.
pub fn filled(kind: &str, fields: &[ParamSpec], x: f64) -> Option<Value> {
    if kind.starts_with("path of a") {
        return None;
    }
    if let Some(inner) = kind.strip_suffix(" or nothing") {
        return filled(inner, fields, x);
    }
    if let Some(rest) = kind.strip_prefix("list of ") {
        let (n, inner) = match rest.split_once(' ') {
            Some((n, inner)) if n.parse::<usize>().is_ok() => (n.parse().unwrap(), inner),
            _ => (2, rest),
        };
        let item = filled(inner, fields, x)?;
        return Some(Value::List(vec![item.into(); n]));
    }
    Some(match kind {
        "number" | "numbers" | "integer" => Value::Number(x),
        "true | false" => Value::Bool(false),
        "struct" => map(fields),
        "text" => Value::Text("x".into()),
        choices if choices.contains(" | ") => {
            Value::Text(choices.split(" | ").next().unwrap_or_default().into())
        }
        other => Value::Text(other.into()),
    })
}

/// Returns 1, or the middle of the range, or an end of it.
fn number(spec: &ParamSpec) -> f64 {
    match spec.range {
        None => 1.0,
        Some(r) if r.low <= 1.0 && 1.0 < r.high => 1.0,
        Some(r) if r.low.is_finite() && r.high.is_finite() => {
            let middle = 0.5 * (r.low + r.high);
            if spec.kind == "integer" { middle.floor() } else { middle }
        }
        Some(r) if r.low.is_finite() => r.low,
        Some(r) => r.high - 1.0,
    }
}

fn map(specs: &[ParamSpec]) -> Value {
    let required = specs.iter().filter(|s| s.default.is_none() && !s.kind.ends_with("or nothing"));
    Value::Map(
        required
            .filter_map(|s| {
                Some((s.name.to_string(), filled(&s.kind, &s.fields, number(s))?.into()))
            })
            .collect(),
    )
}

/// Returns the parameters of a model: only required ones.
pub fn params(entry: &Entry) -> Value {
    let d = &entry.description;
    let Value::Map(mut entries) = map(&d.params) else { return Value::Null };
    for (name, value) in &mut entries {
        if let Some(better) = written(&d.name, name) {
            *value = better.into();
        }
    }
    // The model requires either `porosity` or `filling_time`.
    if &*d.name == "flight.canopy" {
        entries.push(("filling_time".into(), Value::Number(1.0).into()));
    }
    // The models require either `panels` or `mesh`.
    if matches!(&*d.name, "flight.panel_aerodynamics" | "flight.panel_radiation_pressure") {
        let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
        let entry = |key: &str, v: Value| (key.into(), v.into());
        let word = |key: &str, text: &str| entry(key, Value::Text(text.into()));
        let file = Value::Map(vec![word("name", "corner.obj"), word("text", text)]);
        entries.push(("mesh".into(), Value::Map(vec![entry("file", file)]).into()));
    }
    Value::Map(entries)
}

/// Returns the parameters for a check of one parameter, including those without which it would be rejected.
pub fn params_for(entry: &Entry, param: &str) -> Value {
    match (&*entry.description.name, param) {
        ("flight.magnetic_field", "dipole_radius") => {
            let number = |x: f64| Value::Number(x).into();
            let dipole = Value::List([1e-6, 5e-6, -3e-5].map(number).to_vec());
            with(&params(entry), &["dipole"], dipole)
        }
        _ => params(entry),
    }
}

/// Returns the parameters with one more, which may be inside nested structs.
pub fn with(base: &Value, path: &[&str], value: Value) -> Value {
    let Value::Map(entries) = base else { return base.clone() };
    let mut entries = entries.clone();
    let (name, rest) = (path[0], &path[1..]);
    let old = entries.iter().position(|(k, _)| k == name);
    let new: Located = match (rest.is_empty(), old) {
        (true, _) => value.into(),
        (false, Some(k)) => with(&entries[k].1.value, rest, value).into(),
        (false, None) => with(&Value::Map(Vec::new()), rest, value).into(),
    };
    match old {
        Some(k) => entries[k].1 = new,
        None => entries.push((name.to_string(), new)),
    }
    Value::Map(entries)
}

/// Builds the model.
pub fn build(
    entry: &Entry,
    params: &Value,
    services: &Services,
) -> Result<Box<dyn Prototype>, Vec<Fault>> {
    let mut cx = ReadCx::new(PATH, services);
    let built = entry.make_model(&params.clone().into(), &mut cx);
    match built {
        Some(model) if cx.faults.is_empty() => Ok(model),
        _ => Err(cx.faults),
    }
}
