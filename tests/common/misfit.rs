//! Whether a value fits a JSON Schema of the keywords that schemas of file formats use: for tests of them.
use serde_json::{Value as Json, json};

/// Why a value does not fit, at a path; the keywords are those that `describe.rs` uses.
pub fn misfit(v: &Json, s: &Json, root: &Json, path: &str) -> Option<String> {
    if let Some(name) = s["$ref"].as_str() {
        let def = root.pointer(&name.replacen('#', "", 1));
        return misfit(v, def.expect("a definition"), root, path);
    }
    for any in ["anyOf", "oneOf"] {
        let Some(all) = s[any].as_array() else { continue };
        let whys: Vec<_> = all.iter().filter_map(|s| misfit(v, s, root, path)).collect();
        if whys.len() == all.len() {
            // The alternative with the deepest mismatch is probably the intended one; of several,
            // the first.
            return whys.into_iter().rev().max_by_key(|w| w.matches('/').count());
        }
    }
    let kinds = match &s["type"] {
        Json::Array(kinds) => kinds.iter().filter_map(Json::as_str).collect(),
        one => Vec::from_iter(one.as_str()),
    };
    let is = |kind: &&str| match *kind {
        "object" => v.is_object(),
        "array" => v.is_array(),
        "string" => v.is_string(),
        "boolean" => v.is_boolean(),
        "null" => v.is_null(),
        "integer" => v.as_f64().is_some_and(|x| x.fract() == 0.0),
        _ => v.is_number(),
    };
    if !kinds.is_empty() && !kinds.iter().any(is) {
        return Some(format!("{path}: {v} is no {kinds:?}"));
    }
    if s["pattern"].is_string() && !v.as_str().is_some_and(|t| t.contains('$')) {
        return Some(format!("{path}: {v} is no parameter"));
    }
    if s["enum"].as_array().is_some_and(|words| !words.contains(v)) {
        return Some(format!("{path}: {v} is none of {}", s["enum"]));
    }
    let x = v.as_f64().unwrap_or(f64::NAN);
    if s["minimum"].as_f64().is_some_and(|low| x < low)
        || s["maximum"].as_f64().is_some_and(|high| x > high)
        || s["exclusiveMinimum"].as_f64().is_some_and(|low| x <= low)
    {
        return Some(format!("{path}: {x} is out of range"));
    }
    if let Some(items) = v.as_array() {
        let n = json!(items.len());
        if [&s["minItems"], &s["maxItems"]].iter().any(|m| m.is_number() && **m != n) {
            return Some(format!("{path}: {n} items"));
        }
        let mut whys = items.iter().filter_map(|i| misfit(i, &s["items"], root, path));
        return whys.next();
    }
    let fields = v.as_object()?;
    if let Some(gone) = s["required"]
        .as_array()
        .and_then(|all| all.iter().filter_map(Json::as_str).find(|f| !fields.contains_key(*f)))
    {
        return Some(format!("{path}: no `{gone}`"));
    }
    let barred = s["propertyNames"]["not"]["enum"].as_array();
    if let Some(name) = fields.keys().find(|k| barred.is_some_and(|b| b.contains(&json!(k)))) {
        return Some(format!("{path}/{name} is no name here"));
    }
    fields.iter().find_map(|(k, v)| {
        let path = format!("{path}/{k}");
        match (s["properties"].get(k), &s["additionalProperties"]) {
            (Some(s), _) => misfit(v, s, root, &path),
            (None, Json::Bool(false)) => Some(format!("{path} is not in the schema")),
            (None, more) => misfit(v, more, root, &path),
        }
    })
}
