//! Ports and states of a Python part: their declarations, and their values as Python objects.
use super::{Problem, failure};
use crate::array::{Input, out1};
use crate::values::pairs;
use linkwork_runtime::{Failure, PortKind, PortSpec, Unit, remedy};
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyFloat, PyString};

/// Ports that bind to the mechanism under their own names: word, kind, number of values, direction.
///
/// | word | values |
/// |---|---|
/// | hinge state | angle, rate |
/// | node state | position, rotation x y z w, angular velocity, velocity |
/// | node acceleration | angular, linear |
/// | hinge load | force, moment of a body's hinge, in the axes of its frame |
/// | ball state | rotation x y z w, rate |
/// | body mass, vehicle mass | mass, centre of mass, inertia xx yy zz xy xz yz about it; axes of the node |
/// | contact load | force, point |
/// | wrench | moment, force |
/// | added mass | mass, first moment, inertia xx yy zz xy xz yz about the node; axes of the node |
pub(super) const BOUND: [(&str, PortKind, usize, &str); 14] = [
    ("hinge state", PortKind::HingeState, 2, "inputs"),
    ("node state", PortKind::NodeState, 13, "inputs"),
    ("node acceleration", PortKind::NodeAccel, 6, "inputs"),
    ("hinge load", PortKind::HingeLoad, 6, "inputs"),
    ("ball state", PortKind::BallState, 7, "inputs"),
    ("body mass", PortKind::BodyMass, 10, "inputs"),
    ("vehicle mass", PortKind::VehicleMass, 10, "inputs"),
    ("contact load", PortKind::ContactLoad, 6, "inputs"),
    ("hinge torque", PortKind::HingeTorque, 1, "outputs"),
    ("hinge acceleration", PortKind::HingeAccel, 1, "outputs"),
    ("wrench", PortKind::Wrench, 6, "outputs"),
    ("ball torque", PortKind::BallTorque, 3, "outputs"),
    ("surface velocity", PortKind::SurfaceVelocity, 3, "outputs"),
    ("added mass", PortKind::AddedMass, 10, "outputs"),
];

/// Reads `{name: unit}` or `{name: (unit, lanes)}` from the attribute `which` of an object.
pub(super) fn read(made: &Bound<'_, PyAny>, which: &str) -> Result<Vec<PortSpec>, Problem> {
    let help = || {
        Some(format!("write {which} = {{\"angle\": \"rad\", \"rates\": (\"rad/s\", 3)}}, or {{}}"))
    };
    let Ok(given) = made.getattr(which) else {
        return Err((format!("it has no `{which}`"), help()));
    };
    let Ok(given) = given.cast_into::<PyDict>() else {
        return Err((format!("its `{which}` is not a dict"), help()));
    };
    let mut all = Vec::new();
    for (name, port) in pairs(&given) {
        let wrong = || (format!("its `{which}` have `{name}: {port}`"), help());
        let name: String = name.extract().map_err(|_| wrong())?;
        let plain = !name.is_empty() && name.chars().all(|c| c.is_alphanumeric() || c == '_');
        if !plain {
            let fact = format!("`{name}` is not a valid name in `{which}`");
            return Err((fact, Some("use letters, digits and `_`".into())));
        }
        let (unit, lanes) = match port.extract::<String>() {
            Ok(unit) => (unit, 1),
            Err(_) => port.extract::<(String, usize)>().map_err(|_| wrong())?,
        };
        if !(1..=100_000).contains(&lanes) {
            return Err((format!("`{name}` has {lanes} numbers"), Some("from 1 to 100000".into())));
        }
        let bound = BOUND.iter().find(|b| b.0 == unit);
        if let Some((_, kind, n, of)) = bound {
            if *of != which {
                let fact = format!("`{name}`: the kind \"{unit}\" is only possible in `{of}`");
                return Err((fact, Some(format!("declare it in `{of}`"))));
            }
            let mut port = PortSpec::named(name.clone(), *kind, *n);
            port.bind = Some(name.into());
            all.push(port);
            continue;
        }
        if unit == "bool" && which != "states" {
            all.push(PortSpec::named(name, PortKind::Bool, 1));
            continue;
        }
        Unit::parse(&unit).map_err(|e| {
            let kinds: Vec<&str> = BOUND.iter().filter(|b| b.3 == which).map(|b| b.0).collect();
            let help = match kinds[..] {
                [] => "give a unit".into(),
                _ => format!(
                    "give a unit, \"bool\", or a kind that binds to the mechanism: {}",
                    kinds.join(", ")
                ),
            };
            (format!("`{name}`: {e}"), Some(help))
        })?;
        all.push(PortSpec::named(name, PortKind::Numbers, lanes).unit_of(unit));
    }
    Ok(all)
}

/// Returns `{name: value}`; `at` gives the numbers of all ports one after the other.
pub(super) fn values<'py>(
    py: Python<'py>,
    ports: &[PortSpec],
    at: impl Fn(usize) -> f64,
) -> PyResult<Bound<'py, PyDict>> {
    let (mut lane, given) = (0, PyDict::new(py));
    for port in ports {
        let value = match (port.kind, port.lanes) {
            (PortKind::Bool, _) => PyBool::new(py, at(lane) > 0.5).to_owned().into_any(),
            (_, 1) => PyFloat::new(py, at(lane)).into_any(),
            (_, n) => out1(py, (lane..lane + n).map(&at).collect()).into_any(),
        };
        given.set_item(&*port.name, value)?;
        lane += port.lanes;
    }
    Ok(given)
}

/// Writes `{name: value}` to `to`. `of` names the object that made it, and `what` the ports: outputs, states.
pub(super) fn write(
    answer: &Bound<'_, PyAny>,
    of: &str,
    (what, ports): (&str, &[PortSpec]),
    to: &mut [f64],
) -> Result<(), Box<Failure>> {
    if ports.is_empty() && answer.is_none() {
        return Ok(());
    }
    let known: Vec<&str> = ports.iter().map(|p| &*p.name).collect();
    let help = || {
        let names: Vec<String> = known.iter().map(|name| format!("\"{name}\"")).collect();
        format!("return a dict with {}", names.join(", "))
    };
    let Ok(answer) = answer.cast::<PyDict>() else {
        return Err(failure(format!("{of} did not return a dict"), &help()));
    };
    for key in answer.keys() {
        let key = key.to_string();
        if !known.contains(&key.as_str()) {
            let message = format!("{of} returned `{key}`, which is not in `{what}`");
            return Err(failure(message, &remedy(&key, what, &known)));
        }
    }
    let mut at = 0;
    for port in ports {
        let Ok(Some(value)) = answer.get_item(&*port.name) else {
            let message = format!("{of} did not return `{}` of `{what}`", port.name);
            return Err(failure(message, &help()));
        };
        number(&value, port, &mut to[at..at + port.lanes])
            .map_err(|e| failure(format!("{of}: `{}` {e}", port.name), &help()))?;
        at += port.lanes;
    }
    Ok(())
}

/// Writes a number, truth value or array into the slots of a port.
pub(super) fn number(
    value: &Bound<'_, PyAny>,
    port: &PortSpec,
    to: &mut [f64],
) -> Result<(), String> {
    if port.lanes == 1 {
        let x = match value.cast::<PyBool>() {
            Ok(b) => f64::from(u8::from(b.is_true())),
            Err(_) if value.is_instance_of::<PyString>() => return Err("is a string".into()),
            Err(_) => value.extract::<f64>().map_err(|_| "is not a number".to_string())?,
        };
        if !x.is_finite() {
            return Err(format!("is {x}"));
        }
        to[0] = x;
        return Ok(());
    }
    let given =
        Input::read(value, &port.name).map_err(|e| format!("is not an array of numbers: {e}"))?;
    if given.slice().len() != port.lanes {
        return Err(format!("has {} numbers, not {}", given.slice().len(), port.lanes));
    }
    to.copy_from_slice(given.slice());
    Ok(())
}
