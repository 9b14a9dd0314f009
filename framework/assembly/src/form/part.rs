//! Parts of an assembly with their parameters replaced, and the elements of arrays of them.
use crate::form::assembly::{PartForm, PartKind, map_field};
use crate::schema::read::{fields, table, text_field};
use crate::scope::parameters::{Env, substitute};
use crate::text::report::Cx;
use crate::text::value::{entries, is_unknown, set};
use linkwork_runtime::{Located, Origin, Value};

impl PartForm {
    /// Returns the part with all parameters replaced; checks that maps are maps.
    pub(crate) fn with_values(&self, cx: &mut Cx, env: &Env, path: &str) -> PartForm {
        let mut part = self.clone();
        let replace = |cx: &mut Cx, v: &mut Located| *v = substitute(cx, env, v);
        let mut maps = vec![("params", &mut part.params)];
        match &mut part.kind {
            PartKind::Model { rate, offset, bind, .. } => {
                [rate, offset].into_iter().flatten().for_each(|v| replace(cx, v));
                maps.push(("bind", bind));
            }
            PartKind::File { mounts, overrides, stowed, .. } => {
                stowed.iter_mut().for_each(|v| replace(cx, v));
                maps.extend([("mounts", mounts), ("overrides", overrides)]);
            }
            PartKind::Inline(_) => {}
        }
        for (field, v) in maps {
            replace(cx, v);
            if !matches!(v.value, Value::Map(_)) {
                if !is_unknown(v) {
                    table(cx, v, format!("`{path}`: `{field}`"));
                }
                v.value = Value::Map(Vec::new());
            }
        }
        part.array.iter_mut().flatten().for_each(|v| replace(cx, v));
        part
    }

    /// Returns the elements of an array as separate parts, with names; a single part is returned unchanged.
    pub(crate) fn elements(&self, cx: &mut Cx, base: &str) -> Vec<(String, PartForm)> {
        let Some(array) = &self.array else {
            return vec![(base.to_string(), self.clone())];
        };
        let known: &[&str] = match self.kind {
            PartKind::Model { .. } => &["name", "params", "bind", "rate", "offset", "doc"],
            _ => &["name", "params", "mounts", "overrides", "stowed", "doc"],
        };
        let mut out = Vec::new();
        for (k, element) in array.iter().enumerate() {
            let what = format!("element {} of `{base}`", k + 1);
            fields(cx, element, &what, known);
            let own = text_field(cx, element, "name", &what);
            let element_name = own.map_or_else(|| format!("{base}{}", k + 1), |t| t.text);
            let mut part = self.clone();
            part.array = None;
            if array.len() > 1 || element.origin != Origin::NONE {
                part.origin = element.origin;
            }
            merge(&mut part.params, &map_field(cx, element, "params", &what));
            match &mut part.kind {
                PartKind::Model { rate, offset, bind, .. } => {
                    merge(bind, &map_field(cx, element, "bind", &what));
                    *rate = element.get("rate").cloned().or(rate.take());
                    *offset = element.get("offset").cloned().or(offset.take());
                }
                PartKind::File { mounts, overrides, stowed, .. } => {
                    match element.get("stowed") {
                        Some(v) if v.value == Value::Null => *stowed = None,
                        Some(v) => *stowed = Some(v.clone()),
                        None => {}
                    }
                    merge(mounts, &map_field(cx, element, "mounts", &what));
                    merge(overrides, &map_field(cx, element, "overrides", &what));
                }
                PartKind::Inline(_) => {}
            }
            out.push((element_name, part));
        }
        out
    }
}

/// Overrides the entries of `map` by those of `more`.
fn merge(map: &mut Located, more: &Located) {
    for (key, value) in entries(more) {
        set(map, std::slice::from_ref(key), value);
    }
}
