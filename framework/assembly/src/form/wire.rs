//! A wire as written in a file: `"Part.output -> Part.input"`, or with its timing; and connected connectors: `("Motor.supply", "Battery.terminal")`.
use crate::schema::describe::Schema;
use crate::schema::kind::{At, list_of, number, text, whole};
use crate::schema::read;
use crate::schema::record::{Presence, Record, record};
use crate::text::report::Cx;
use crate::text::value::Text;
use linkwork_runtime::{Located, Value, WireTiming};

/// A wire as written in a file.
#[derive(Clone, Debug, PartialEq)]
pub struct WireText {
    /// `Part.output -> Part.input`.
    pub text: Text,
    /// Delay of the wire.
    pub timing: WireTiming,
}

record! {
    /// A wire with a delay, or a wire that closes an algebraic loop.
    pub(crate) struct WireForm: "wire" {
        /// The wire: `"Part.output -> Part.input"`.
        wire: Text = text().need("write (wire: \"Part.output -> Part.input\", delay: 1)"),
        /// Delay in samples: of the reader if it is sampled, else of the writer, else integration steps.
        delay: Option<u32> = whole::<u32>(1, 100_000).maybe(),
        /// Value before the first sample arrives, SI: one number, or one per component (default: zeros).
        initial: Vec<f64> = list_of(number("")).or(Vec::new()),
        /// The wire closes an algebraic loop, which is solved until its two ends differ by less than this value (relative for values above one).
        solve: Option<f64> = number("").within(1e-15, 0.1).maybe(),
    }
}

/// Returns the schema of a wire.
pub(crate) fn wire_schema() -> Schema {
    Schema::Any(vec![Schema::Text, WireForm::describe()])
}

/// Reads a wire; `None` if it is not valid (a fault is added).
pub(crate) fn read_wire(cx: &mut Cx, v: &Located) -> Option<WireText> {
    let Value::Map(_) = v.value else {
        let text = read::text(cx, v, "a wire")?;
        return Some(WireText { text, timing: WireTiming::AtOnce });
    };
    let form = WireForm::read(cx, v, &At::new("a wire"))?;
    let timing = match (form.delay, form.solve) {
        (Some(_), Some(_)) => {
            let message = format!("wire `{}` has both `delay` and `solve`", form.wire.text);
            cx.fault(v.origin, message, "remove one of them: a delay already breaks the loop");
            return None;
        }
        (Some(samples), None) => WireTiming::Delayed { samples, initial: form.initial },
        (None, _) if !form.initial.is_empty() => {
            let message = format!("wire `{}` has `initial` but lacks `delay`", form.wire.text);
            cx.fault(v.origin, message, "write `delay: 1`, or remove `initial`");
            return None;
        }
        (None, Some(tolerance)) => WireTiming::Solved { tolerance },
        (None, None) => WireTiming::AtOnce,
    };
    Some(WireText { text: form.wire, timing })
}

/// Returns the wire in the form of the file.
pub(crate) fn write_wire(text: String, timing: &WireTiming) -> Value {
    let form = WireForm { wire: Text::new(&text), delay: None, initial: Vec::new(), solve: None };
    match timing {
        WireTiming::AtOnce => Value::Text(text),
        WireTiming::Delayed { samples, initial } => {
            WireForm { delay: Some(*samples), initial: initial.clone(), ..form }.write()
        }
        WireTiming::Solved { tolerance } => WireForm { solve: Some(*tolerance), ..form }.write(),
    }
}

/// Returns the schema of an entry of `connect`.
pub(crate) fn connect_schema() -> Schema {
    let entry = Schema::List(Box::new(Schema::Text), None);
    Schema::List(Box::new(entry), None)
}

/// Returns the connectors that one entry of `connect` connects; `None` unless it lists two or more (a fault is added).
pub(crate) fn read_connection(cx: &mut Cx, v: &Located) -> Option<Vec<Text>> {
    let before = cx.faults.len();
    let ends: Vec<Text> = read::list(cx, v, "an entry of `connect`")
        .iter()
        .filter_map(|end| read::text(cx, end, "a connector"))
        .collect();
    if cx.faults.len() > before {
        return None;
    }
    if ends.len() < 2 {
        let help = "write (\"Motor.supply\", \"Battery.terminal\")";
        cx.fault(
            v.origin,
            "an entry of `connect` must list two or more connectors".to_string(),
            help,
        );
        return None;
    }
    Some(ends)
}
