//! Further content of a mechanism's file, and export to URDF and RON.
use crate::array::{Array1, Array2, out1, out2};
use crate::error::refuse;
use crate::mechanism::Mechanism;
use linkwork_assembly::form::AssemblyForm;
use linkwork_formats::{Description, write_urdf};
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PySlice};
use std::borrow::Cow;

impl Mechanism {
    /// Returns the description of the file, or a description with only bodies and nodes.
    fn description(&self) -> Cow<'_, Description> {
        match &self.core.description {
            Some(d) => Cow::Borrowed(d),
            None => Cow::Owned(Description::from(&self.core.mbs)),
        }
    }
}

#[pymethods]
impl Mechanism {
    /// The initial configuration (nq,) of the file, rad and m; the neutral configuration if the file does not define one.
    ///
    /// Examples
    /// --------
    /// >>> arm.initial_q.tolist()
    /// [0.0, 0.0]
    #[getter]
    fn initial_q<'py>(&self, py: Python<'py>) -> Array1<'py> {
        PyArray1::from_slice(py, &self.core.initial)
    }
    /// All elements of the file that were not used, one line each: file, line, element, reason.
    ///
    /// Actuators, tendons and sensors are listed, too, because they act only in a Simulation.
    ///
    /// Examples
    /// --------
    /// >>> arm.ignored
    /// []
    #[getter]
    fn ignored(&self) -> Vec<String> {
        let d = self.description();
        let devices =
            d.devices.iter().map(|x| format!("device `{}`: it acts only in a Simulation", x.name));
        d.ignored.iter().map(ToString::to_string).chain(devices).collect()
    }
    /// The joints of the file by name, with their slices of v (empty for fixed joints).
    ///
    /// Bodies have the names of the file's links.
    ///
    /// Examples
    /// --------
    /// >>> arm.joints
    /// {}
    #[getter]
    fn joints<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let all = PyDict::new(py);
        for joint in &self.description().joints {
            let body = self.core.mbs.get(self.core.body(&joint.body)?);
            let mut own = body.subhinges().iter().skip(joint.subhinge).take(joint.count);
            let start = own.clone().next().map_or(0, |s| s.v.start);
            let stop = own.next_back().map_or(start, |s| s.v.end);
            all.set_item(&joint.name, PySlice::new(py, start as isize, stop as isize, 1))?;
        }
        Ok(all)
    }
    /// Return the couplings of the file (mimic joints, differentials) as a linear system C q = c.
    ///
    /// `forward_dynamics` and the other tree algorithms do not enforce them.
    ///
    /// Returns
    /// -------
    /// C : ndarray, shape (k, nq)
    ///     Factors of the coordinates (rad and m).
    /// c : ndarray, shape (k,)
    ///     Constants.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If a coupling has higher powers of a coordinate.
    ///
    /// Examples
    /// --------
    /// >>> C, c = arm.couplings()
    /// >>> C.shape, c.shape
    /// ((0, 2), (0,))
    fn couplings<'py>(&self, py: Python<'py>) -> PyResult<(Array2<'py>, Array1<'py>)> {
        let (description, nq) = (self.description(), self.core.nq());
        let all = &description.couplings;
        if let Some(curved) = all.iter().find(|c| !c.powers.is_empty()) {
            return Err(refuse(format!(
                "the coupling `{}` has higher powers, so the couplings are not a linear system\n  help: use `close` and `constrained_dynamics`, which support it",
                curved.name
            )));
        }
        let mut rows = vec![0.0; all.len() * nq];
        for (k, coupling) in all.iter().enumerate() {
            for term in &coupling.terms {
                let body = self.core.mbs.get(self.core.body(&term.coordinate.body)?);
                if let Some(s) = body.subhinges().get(term.coordinate.subhinge) {
                    rows[k * nq + s.q.start] += term.factor;
                }
            }
        }
        let constants = all.iter().map(|c| c.constant).collect();
        Ok((out2(py, rows, all.len(), nq)?, out1(py, constants)))
    }
    /// Write the mechanism as URDF.
    ///
    /// Returns
    /// -------
    /// text : str
    ///     The file.
    /// left_out : list of str
    ///     Properties that URDF does not support, one line each.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the mechanism has ball or screw hinges, or names that XML does not allow.
    ///
    /// Examples
    /// --------
    /// >>> text, lost = arm.to_urdf()
    /// >>> text.count("<joint")
    /// 3
    fn to_urdf(&self) -> PyResult<(String, Vec<String>)> {
        let made = write_urdf(&self.description()).map_err(refuse)?;
        Ok((made.text, made.left_out))
    }
    /// Write the mechanism as an assembly in RON.
    ///
    /// A mechanism loaded from the text is bit-identical; its bodies are named `name/body`.
    ///
    /// Parameters
    /// ----------
    /// name : str
    ///     Name of the assembly (default: "Machine").
    ///
    /// Returns
    /// -------
    /// text : str
    ///     The file.
    /// left_out : list of str
    ///     Properties that an assembly does not support, one line each.
    ///
    /// Examples
    /// --------
    /// >>> text, lost = arm.to_ron("arm")
    /// >>> len(text) > 500
    /// True
    #[pyo3(signature = (name="Machine"))]
    fn to_ron(&self, name: &str) -> (String, Vec<String>) {
        let made = AssemblyForm::from_description(name, &self.description());
        (made.assembly.to_ron(), made.left_out)
    }
}
