//! Parts and wires that were just added, for what else there is to say about them.
use super::here;
use linkwork_runtime::{IntoValue, Located, Value};

/// Sets a field of a map.
fn set(fields: &mut Located, field: &str, value: Located) {
    if let Value::Map(entries) = &mut fields.value {
        match entries.iter_mut().find(|(key, _)| key == field) {
            Some((_, there)) => *there = value,
            None => entries.push((field.to_string(), value)),
        }
    }
}

/// A part that was just added to an [`Assembly`](crate::Assembly).
pub struct NewPart<'a> {
    pub(super) fields: &'a mut Located,
}

impl NewPart<'_> {
    /// Binds ports of the model to the mechanism: `bind("shaft", "hinge:wheel")`, `bind("hub", "node:wheel")`,
    /// `bind("field", "field:Ruts")`.
    #[track_caller]
    pub fn bind(self, binding: &str, target: &str) -> Self {
        self.inside("bind", binding, here(target))
    }

    /// Sets the sample period or rate of a model that is sampled: `0.02`, `"20 ms"`, `"50 Hz"`.
    #[track_caller]
    pub fn rate(self, rate: impl IntoValue) -> Self {
        self.set("rate", here(rate))
    }

    /// Sets a parameter of an included assembly.
    #[track_caller]
    pub fn param(self, name: &str, value: impl IntoValue) -> Self {
        self.inside("params", name, here(value))
    }

    /// Connects a mount of an included assembly to a body or node.
    #[track_caller]
    pub fn mount(self, mount: &str, node: &str) -> Self {
        self.inside("mounts", mount, here(node))
    }

    /// Sets a field by the name that it has in files: `set("doc", "Left motor")`, `set("offset", "5 ms")`.
    #[track_caller]
    pub fn set(self, field: &str, value: impl IntoValue) -> Self {
        set(self.fields, field, here(value));
        self
    }

    /// Sets an entry of a field that is a map.
    fn inside(self, field: &str, key: &str, value: Located) -> Self {
        if self.fields.get(field).is_none() {
            let empty = Located { value: Value::Map(Vec::new()), origin: value.origin };
            set(self.fields, field, empty);
        }
        if let Some(map) = self.fields.get_mut(field) {
            set(map, key, value);
        }
        self
    }
}

/// A wire that was just added to an [`Assembly`](crate::Assembly).
pub struct NewWire<'a> {
    pub(super) item: &'a mut Located,
}

impl NewWire<'_> {
    /// Delays the values by a number of samples: of the reader, else of the writer, else integration steps.
    #[track_caller]
    pub fn delay(self, samples: u32) -> Self {
        self.set("delay", here(f64::from(samples)))
    }

    /// Sets what arrives before the first sample does: a number, or a list with one for each element of the port.
    #[track_caller]
    pub fn initial(self, values: impl IntoValue) -> Self {
        let values = match values.into_value() {
            Value::Number(x) => [x].into_value(),
            other => other,
        };
        self.set("initial", here(values))
    }

    /// Lets the wire close an algebraic loop, which is solved until its two ends differ by less than `tolerance`, relative to
    /// the value where that is above one.
    #[track_caller]
    pub fn solve(self, tolerance: f64) -> Self {
        self.set("solve", here(tolerance))
    }

    fn set(self, field: &str, value: Located) -> Self {
        if !matches!(self.item.value, Value::Map(_)) {
            let wire = Located {
                value: std::mem::replace(&mut self.item.value, Value::Null),
                ..*self.item
            };
            self.item.value = Value::Map(vec![("wire".to_string(), wire)]);
        }
        set(self.item, field, value);
        self
    }
}
