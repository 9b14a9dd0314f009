//! Parameters of a part with a unit: the file, and start values of parameters and other variables by their names in the unit's description.
use crate::Refusal;
use crate::instance::Instance;
use crate::slot::Slot;
use linkwork_formats::fmi::{
    Causality, FmiVariable, Initial, ModelDescription, Variability, VariableKind,
};
use linkwork_runtime::prelude::Params;
use linkwork_runtime::{
    Failure, Located, Origin, Param, ParamSpec, ReadCx, Unit as Measure, Value, remedy,
    split_quantity,
};

/// Parameters of a part with a unit.
#[derive(Params, Clone, Debug)]
pub struct UnitParams {
    /// The unit: an .fmu file, in the folder of the RON file or in the search folders. It contains machine code, which runs with all rights of this
    /// process.
    pub file: String,
    /// Start values by the names in the unit: `{"mass": "2 kg", "enabled": true, "gains": [1, 2]}`.
    #[param(default = Starts::default())]
    pub start: Starts,
}

/// Start values as in the file.
#[derive(Clone, Debug, Default)]
pub struct Starts(Vec<(String, Located)>);

impl Starts {
    /// Returns whether a variable has a start value in the file.
    pub(crate) fn sets(&self, name: &str) -> bool {
        self.0.iter().any(|(written, _)| written == name)
    }

    /// Returns the values that the description permits. [`find`] reports the others.
    pub(crate) fn permitted(&self, description: &ModelDescription) -> Vec<Start> {
        self.0.iter().filter_map(|(name, v)| one(name, &v.value, description).ok()).collect()
    }
}

impl Param for Starts {
    fn kind() -> String {
        "map of values".into()
    }
    fn read(v: &Located, spec: &ParamSpec, cx: &mut ReadCx<'_>) -> Option<Self> {
        match &v.value {
            Value::Map(entries) => {
                let mut ok = true;
                for (k, (name, value)) in entries.iter().enumerate() {
                    if entries[..k].iter().any(|(other, _)| other == name) {
                        let message =
                            format!("`{}.{}`: `{name}` is written twice", cx.path, spec.name);
                        cx.fault(value.origin, message, Some("keep one of the two".into()));
                        ok = false;
                    }
                }
                ok.then(|| Starts(entries.clone()))
            }
            Value::Null => Some(Starts::default()),
            other => {
                let message = format!(
                    "`{}.{}` must be a map of values by name, but it is {}",
                    cx.path,
                    spec.name,
                    other.what()
                );
                cx.fault(v.origin, message, Some("write {\"name\": value}".into()));
                None
            }
        }
    }
    fn show(&self) -> Value {
        Value::Map(self.0.clone())
    }
}

/// A checked start value.
#[derive(Clone, Debug)]
pub(crate) enum Start {
    Numbers(Slot, Vec<f64>),
    Text(u32, String),
}

/// Sets start values.
pub(crate) fn apply(instance: &mut Instance, starts: &[Start]) -> Result<(), Box<Failure>> {
    for start in starts {
        match start {
            Start::Numbers(slot, values) => instance.set(slot, values)?,
            Start::Text(reference, text) => instance.set_text(*reference, text)?,
        }
    }
    Ok(())
}

/// Resolves start values in the description; faults are added to `cx`.
pub(crate) fn find(
    starts: &Starts,
    description: &ModelDescription,
    cx: &mut ReadCx<'_>,
) -> Option<Vec<Start>> {
    let (mut out, mut ok) = (Vec::new(), true);
    for (name, written) in &starts.0 {
        match one(name, &written.value, description) {
            Ok(start) => out.push(start),
            Err(refusal) => {
                refusal.tell(written.origin, cx);
                ok = false;
            }
        }
    }
    ok.then_some(out)
}

/// Returns true if a value may be set before the start.
fn settable(v: &FmiVariable) -> bool {
    v.variability != Variability::Constant
        && matches!(v.initial, Some(Initial::Exact | Initial::Approx))
        && v.causality != Causality::StructuralParameter
}

fn one(name: &str, value: &Value, description: &ModelDescription) -> Result<Start, Refusal> {
    let Some(v) = description.variables.iter().find(|v| v.name == name) else {
        let known: Vec<&str> =
            description.variables.iter().filter(|v| settable(v)).map(|v| &*v.name).collect();
        return Err(Refusal::new(format!("the unit does not have a variable `{name}`"))
            .help(remedy(name, "variables that can be set", &known)));
    };
    if !settable(v) {
        let why = match (v.causality, v.variability) {
            (Causality::StructuralParameter, _) => "array sizes depend on it",
            (_, Variability::Constant) => "it is a constant",
            _ => "the unit computes it",
        };
        return Err(Refusal::new(format!("variable `{name}` of the unit cannot be set: {why}"))
            .help("set a parameter or another start value"));
    }
    if v.kind == VariableKind::String {
        return match value {
            Value::Text(text) if v.size == 1 => Ok(Start::Text(v.reference, text.clone())),
            other => Err(Refusal::new(format!(
                "variable `{name}` must be a text, but it is {}",
                other.what()
            ))
            .help("write it in quotes")),
        };
    }
    if !v.kind.is_numeric() {
        return Err(Refusal::new(format!(
            "variable `{name}` is not a number, so it cannot be set"
        ))
        .help("remove it from `start`"));
    }
    let numbers: Vec<f64> = match value {
        Value::List(items) => {
            items.iter().map(|i| number(v, &i.value)).collect::<Result<_, _>>()?
        }
        single => vec![number(v, single)?],
    };
    if numbers.len() != v.size {
        return Err(Refusal::new(format!(
            "variable `{name}` requires {} values, but there are {}",
            v.size,
            numbers.len()
        ))
        .help("write a list of that length, row by row"));
    }
    Ok(Start::Numbers(Slot::of(v), numbers))
}

/// Converts a value to SI.
fn number(v: &FmiVariable, value: &Value) -> Result<f64, Refusal> {
    let name = &v.name;
    let wrong = |what: &str| {
        Refusal::new(format!("variable `{name}` must be {what}, but it is {}", value.what()))
    };
    match (v.kind, value) {
        (VariableKind::Boolean, Value::Bool(b)) => Ok(f64::from(u8::from(*b))),
        (VariableKind::Boolean, _) => Err(wrong("true or false").help("write true or false")),
        (_, Value::Number(x)) => {
            // A number without a unit is accepted only if the unit's own unit of measurement is SI.
            let base = v.unit.as_ref().and_then(|u| u.base.map(|b| (b, &u.name)));
            if let Some(((_, factor, offset), unit)) = base
                && v.kind.is_float()
                && (factor != 1.0 || offset != 0.0)
            {
                return Err(Refusal::new(format!(
                    "variable `{name}` is in {unit}, which is not SI, so a number without a unit is ambiguous"
                ))
                .help(format!("write it with its unit, such as \"{x} {unit}\"")));
            }
            whole(v, *x)
        }
        (_, Value::Text(text)) => whole(v, quantity(v, text)?),
        _ => Err(wrong("a number").help("write a number")),
    }
}

fn whole(v: &FmiVariable, x: f64) -> Result<f64, Refusal> {
    if x.is_finite() && (v.kind.is_float() || x.fract() == 0.0) {
        return Ok(x);
    }
    let what = if v.kind.is_float() { "a finite" } else { "a whole" };
    Err(Refusal::new(format!("variable `{}` must be {what} number, but it is {x}", v.name))
        .help("write another number"))
}

fn quantity(v: &FmiVariable, text: &str) -> Result<f64, Refusal> {
    let name = &v.name;
    let Some((x, unit)) = split_quantity(text) else {
        return Err(Refusal::new(format!("variable `{name}`: `{text}` is not a quantity"))
            .help("write a number, or a number with a unit"));
    };
    if unit.is_empty() {
        return number(v, &Value::Number(x));
    }
    let measure = v.unit.as_ref();
    // Try the unit name of the file if Linkwork does not know the unit.
    if let Some((own, (_, factor, offset))) = measure.and_then(|u| Some((&u.name, u.base?)))
        && own == unit
    {
        return Ok(factor * x + offset);
    }
    let given = Measure::parse(unit)
        .map_err(|e| Refusal::new(format!("variable `{name}`: {e}")).help("write another unit"))?;
    match measure.and_then(|u| u.base) {
        Some((exponents, ..)) if exponents == given.exponents && v.relative => Ok(given.scale * x),
        Some((exponents, ..)) if exponents == given.exponents => Ok(given.to_si(x)),
        Some(_) => Err(Refusal::new(format!(
            "variable `{name}` is in {}, but `{text}` is a different quantity",
            measure.map_or("", |u| &u.name)
        ))
        .help("write a unit of the same quantity")),
        None => Err(Refusal::new(format!(
            "the file does not define the unit of variable `{name}`, so `{text}` cannot be converted"
        ))
        .help("write a number without a unit, as the unit expects it")),
    }
}

impl Refusal {
    /// Adds it to the report, at a position.
    pub(crate) fn tell(self, origin: Origin, cx: &mut ReadCx<'_>) {
        let message = format!("`{}`: {}", cx.path, self.message);
        cx.fault(origin, message, self.help);
    }
}
