//! Maps that a simulation hands through as written: reading them, and `place`, which puts a machine down.
use crate::text::patterns::path_matches;
use linkwork_runtime::{
    Fault, Handle, Located, Origin, Placement, Plan, Terrain, Unit, Value, place_on_terrain,
    remedy, split_quantity,
};

/// A number with an optional unit, SI.
fn number(v: &Located) -> Option<f64> {
    match &v.value {
        Value::Number(x) => Some(*x),
        Value::Text(t) => {
            let (x, unit) = split_quantity(t)?;
            if unit.is_empty() {
                return Some(x);
            }
            Some(Unit::parse(unit).ok()?.to_si(x))
        }
        _ => None,
    }
}

/// A list of numbers, with or without units; SI.
pub fn numbers(v: &Located) -> Option<Vec<f64>> {
    match &v.value {
        Value::List(items) => items.iter().map(number).collect(),
        _ => None,
    }
}

/// A list of texts, or one text.
pub fn texts(v: &Located) -> Option<Vec<String>> {
    match &v.value {
        Value::Text(t) => Some(vec![t.clone()]),
        Value::List(items) => items
            .iter()
            .map(|i| match &i.value {
                Value::Text(t) => Some(t.clone()),
                _ => None,
            })
            .collect(),
        _ => None,
    }
}

/// Refuses fields that are not known.
pub fn only(v: &Located, what: &str, known: &[&str]) -> Result<(), Fault> {
    let Value::Map(entries) = &v.value else {
        return Err(Fault::new(v.origin, format!("`{what}` is a map, this is {}", v.value.what())));
    };
    for (key, value) in entries {
        if !known.contains(&key.as_str()) {
            return Err(Fault::new(value.origin, format!("`{what}` has no field `{key}`"))
                .help(remedy(key, "fields", known)));
        }
    }
    Ok(())
}

/// A field that must be there and be readable.
fn required<T>(
    v: &Located,
    what: &str,
    field: &str,
    read: impl Fn(&Located) -> Option<T>,
    form: &str,
) -> Result<T, Fault> {
    let at = v.get(field).ok_or_else(|| {
        Fault::new(v.origin, format!("`{what}` needs a field `{field}`"))
            .help(format!("write `{field}: {form}`"))
    })?;
    read(at).ok_or_else(|| {
        Fault::new(at.origin, format!("`{what}.{field}` is not {form}"))
            .help(format!("write `{field}: {form}`"))
    })
}

/// `place: (body, at, heading, wheels, radius, joints)`: puts a compiled machine on its ground. Names may
/// hold `*`. Gives the largest remaining gap of a wheel (m).
///
/// # Errors
/// The first mistake in the map, or why the machine cannot be put down.
pub fn put_down(plan: &mut Plan, v: &Located) -> Result<f64, Fault> {
    only(v, "place", &["body", "at", "heading", "wheels", "radius", "joints", "terrain"])?;
    let mb = plan
        .mechanism()
        .map(|m| m.multibody.clone())
        .ok_or_else(|| Fault::new(v.origin, "`place`: there are no bodies"))?;
    let names: Vec<&str> = mb.bodies().iter().map(|b| b.name()).collect();
    let expand = |patterns: Vec<String>, origin: Origin| -> Result<Vec<String>, Fault> {
        let mut out = Vec::new();
        for p in patterns {
            let found: Vec<String> = names
                .iter()
                .filter(|n| path_matches(&dotted(&p), &dotted(n)))
                .map(|n| (*n).to_string())
                .collect();
            if found.is_empty() {
                return Err(Fault::new(origin, format!("`place`: `{p}` matches no body"))
                    .help(remedy(&p, "bodies", &names)));
            }
            out.extend(found);
        }
        Ok(out)
    };
    let one = |v: &Located| texts(v).filter(|t| t.len() == 1).map(|t| t[0].clone());
    let body = required(v, "place", "body", one, "\"Rover/chassis\"")?;
    let at = required(v, "place", "at", numbers, "[x, y] in metres")?;
    let radius = required(v, "place", "radius", number, "the wheels' radius")?;
    let wheels = required(v, "place", "wheels", texts, "[\"Rover.Hardware.Wheels.*/wheel\"]")?;
    let joints = v.get("joints").and_then(texts).unwrap_or_default();
    let terrain = v.get("terrain").and_then(one);
    let handle: Handle<dyn Terrain> = plan
        .services
        .find(terrain.as_deref(), "")
        .map_err(|(m, h)| Fault::new(v.origin, format!("`place`: {m}")).help(h))?;
    if at.len() != 2 {
        return Err(Fault::new(v.origin, "`place.at` is [x, y]"));
    }
    let p = Placement {
        body,
        at: [at[0], at[1]],
        heading: v.get("heading").and_then(number).unwrap_or(0.0),
        wheels: expand(wheels, v.origin)?.into_iter().map(|w| (w, radius)).collect(),
        joints: expand(joints, v.origin)?,
    };
    place_on_terrain(plan, &*handle, &p)
        .map_err(|e| Fault::new(v.origin, format!("`place`: {}", e.message)).help(e.help))
}

/// `Rover.Wheels.Wheel1/wheel` with the slash as one more dot, for patterns.
pub fn dotted(path: &str) -> String {
    path.replace('/', ".")
}
