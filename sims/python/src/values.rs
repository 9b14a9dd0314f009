//! Values of a simulation: overrides from Python to RON, resolved parameters to Python, descriptions of variables.
use crate::error::{refuse, refuse_with};
use linkwork_runtime::{Seconds, Value};
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyFloat, PyInt, PyList, PyString};

/// Returns a copy of the entries of a dict, because reading a value can run foreign code that changes the dict.
pub fn pairs<'py>(given: &Bound<'py, PyDict>) -> Vec<(Bound<'py, PyAny>, Bound<'py, PyAny>)> {
    given.iter().collect()
}

/// Largest nesting of lists and largest number of values in an override.
const DEEP: usize = 32;
const MANY: usize = 1_000_000;

/// Reads a seed: an integer from 0 to 2⁶⁴ − 1.
pub fn seed(given: &Bound<'_, PyAny>) -> PyResult<u64> {
    let whole = || given.extract::<u64>();
    // In Python, True is an integer; 3.0 is not.
    match given.is_instance_of::<PyBool>() {
        false => whole(),
        true => Err(refuse("")),
    }
    .map_err(|_| {
        let shown = given.repr().map_or_else(|_| "?".to_string(), |text| text.to_string());
        refuse_with(
            format!("`seed` is {shown}"),
            format!("write an integer from 0 to {}, such as `seed=1`", u64::MAX),
        )
    })
}

/// Reads a seed, or None for that of the file.
pub fn seed_or_none(given: &Bound<'_, PyAny>) -> PyResult<Option<u64>> {
    if given.is_none() { Ok(None) } else { seed(given).map(Some) }
}

/// Returns `PATH=VALUE` for each entry.
pub fn overrides(given: Option<&Bound<'_, PyDict>>) -> PyResult<Vec<String>> {
    let Some(given) = given else { return Ok(Vec::new()) };
    let one = |(path, value): (Bound<'_, PyAny>, Bound<'_, PyAny>)| {
        let path: String = path.extract()?;
        let text = match value.cast::<PyString>() {
            Ok(text) => text.to_string(),
            Err(_) => ron(&value, &path, DEEP, &mut 0)?,
        };
        Ok(format!("{path}={text}"))
    };
    pairs(given).into_iter().map(one).collect()
}

/// Converts a number, truth value, text, list or array to RON. `deep`: nesting depth of lists; `many`: number of values so far.
fn ron(value: &Bound<'_, PyAny>, path: &str, deep: usize, many: &mut usize) -> PyResult<String> {
    *many += 1;
    if deep == 0 || *many > MANY {
        let fact = match deep {
            0 => format!("the override of `{path}` has more than {DEEP} nested lists"),
            _ => format!("the override of `{path}` has more than {MANY} values"),
        };
        return Err(refuse_with(fact, "give a flat list; a list must not contain itself"));
    }
    if let Ok(b) = value.cast::<PyBool>() {
        return Ok(b.is_true().to_string());
    }
    if let Ok(text) = value.cast::<PyString>() {
        return Ok(format!("{:?}", text.to_string()));
    }
    if value.is_instance_of::<PyInt>() {
        return Ok(value.str()?.to_string());
    }
    if value.hasattr("__len__")? {
        let mut items = Vec::new();
        for item in value.try_iter()? {
            items.push(ron(&item?, path, deep - 1, many)?);
        }
        return Ok(format!("[{}]", items.join(", ")));
    }
    match value.extract::<f64>() {
        Ok(x) if x.is_finite() => Ok(format!("{x:?}")),
        _ => Err(refuse_with(
            format!("the override of `{path}` is {}", value.repr()?),
            "give a number, a text such as \"0.7 ohm\", True, False, or a list of these",
        )),
    }
}

/// Converts a resolved value to a Python object; `Name(..)` becomes {"Name": ..}.
pub fn object<'py>(py: Python<'py>, value: &Value) -> PyResult<Bound<'py, PyAny>> {
    Ok(match value {
        Value::Null => py.None().into_bound(py),
        Value::Bool(b) => PyBool::new(py, *b).to_owned().into_any(),
        Value::Number(x) => PyFloat::new(py, *x).into_any(),
        Value::Text(text) => PyString::new(py, text).into_any(),
        Value::List(items) => {
            let items: Vec<_> =
                items.iter().map(|i| object(py, &i.value)).collect::<PyResult<_>>()?;
            PyList::new(py, items)?.into_any()
        }
        Value::Map(entries) => {
            let map = PyDict::new(py);
            for (key, item) in entries {
                map.set_item(key, object(py, &item.value)?)?;
            }
            map.into_any()
        }
        Value::Variant(name, inner) if inner.value == Value::Null => {
            PyString::new(py, name).into_any()
        }
        Value::Variant(name, inner) => {
            let map = PyDict::new(py);
            map.set_item(name, object(py, &inner.value)?)?;
            map.into_any()
        }
    })
}

/// Reads a time: seconds, or a text such as "20 s" or "2 min".
pub fn seconds(given: &Bound<'_, PyAny>, what: &str) -> PyResult<Seconds> {
    let read = match (given.extract::<f64>(), given.extract::<String>()) {
        (Ok(x), _) => Seconds::from_decimal(x),
        // A rate is not accepted as a time: "2 Hz" would mean half a second.
        (_, Ok(text)) if !text.contains("Hz") => Seconds::period(&Value::Text(text)).ok(),
        _ => None,
    };
    let shown = given.repr()?;
    read.ok_or_else(|| {
        refuse_with(format!("`{what}` = {shown} is not a time"), "write 20, \"20 s\" or \"2 min\"")
    })
}

/// Returns the period of a rate in Hz.
pub fn period(rate: f64) -> PyResult<Seconds> {
    let period = Seconds::from_decimal(rate).and_then(Seconds::inverse);
    period.ok_or_else(|| refuse(format!("`rate` is {rate}\n  help: give a positive rate, in Hz")))
}

/// A variable of a simulation.
///
/// Examples
/// --------
/// >>> variable = linkwork.Simulation("sims/pendulum").variables()["Friction.torque"]
/// >>> variable
/// Variable("Friction.torque", "N m", output)
#[pyclass(frozen, get_all, weakref, module = "linkwork")]
pub struct Variable {
    /// Path of the variable.
    ///
    /// Examples
    /// --------
    /// >>> variable.path
    /// 'Friction.torque'
    pub path: String,
    /// Unit, as in its model; "" for none.
    ///
    /// Examples
    /// --------
    /// >>> variable.unit
    /// 'N m'
    pub unit: String,
    /// Description of the variable.
    ///
    /// Examples
    /// --------
    /// >>> variable.doc
    /// 'Torque on the hinge.'
    pub doc: String,
    /// "state", "output", "input" (unconnected, so it can be set) or "wired input".
    ///
    /// Examples
    /// --------
    /// >>> variable.role
    /// 'output'
    pub role: &'static str,
    /// Path of the part to which it belongs.
    ///
    /// Examples
    /// --------
    /// >>> variable.part
    /// 'Friction'
    pub part: String,
}

#[pymethods]
impl Variable {
    fn __repr__(&self) -> String {
        format!("Variable(\"{}\", \"{}\", {})", self.path, self.unit, self.role)
    }
}
