//! What a file says of a mechanism besides its bodies, and writing it as URDF or RON.
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
    /// As the file described it, or bodies and nodes alone.
    fn description(&self) -> Cow<'_, Description> {
        match &self.core.description {
            Some(d) => Cow::Borrowed(d),
            None => Cow::Owned(Description::from(&self.core.mbs)),
        }
    }
}

#[pymethods]
impl Mechanism {
    /// The configuration (nq,) that the file shows; the neutral one where it shows none. Angles in rad, lengths in m.
    ///
    /// >>> arm.initial_q.tolist()
    /// [0.0, 0.0]
    #[getter]
    fn initial_q<'py>(&self, py: Python<'py>) -> Array1<'py> {
        PyArray1::from_slice(py, &self.core.initial)
    }
    /// Everything in the file that was not used, a line each: file, line, element, why. Actuators, tendons and sensors are among it: they act in a
    /// Simulation alone.
    ///
    /// >>> arm.ignored
    /// []
    #[getter]
    fn ignored(&self) -> Vec<String> {
        let d = self.description();
        let devices =
            d.devices.iter().map(|x| format!("device `{}`: it acts in a Simulation alone", x.name));
        d.ignored.iter().map(ToString::to_string).chain(devices).collect()
    }
    /// The joints of the file by name: their places in v (empty for fixed ones). Bodies go by the
    /// names of the file's links.
    ///
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
    /// Couplings of the file (mimic joints, differentials) as C q = c: C (k, nq), c (k,). Dynamics
    /// does not enforce them. q and c in rad and m.
    ///
    /// >>> C, c = arm.couplings()
    /// >>> C.shape, c.shape
    /// ((0, 2), (0,))
    fn couplings<'py>(&self, py: Python<'py>) -> PyResult<(Array2<'py>, Array1<'py>)> {
        let (description, nq) = (self.description(), self.core.nq());
        let all = &description.couplings;
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
    /// (text, left out): the mechanism as URDF, and what URDF cannot say, a line each.
    /// Raises LinkworkError for balls, screws and names that XML cannot carry.
    ///
    /// >>> text, lost = arm.to_urdf()
    /// >>> text.count("<joint")
    /// 3
    fn to_urdf(&self) -> PyResult<(String, Vec<String>)> {
        let made = write_urdf(&self.description()).map_err(refuse)?;
        Ok((made.text, made.left_out))
    }
    /// (text, left out): the mechanism as an assembly in RON of this name, and what an assembly
    /// does not hold. Loaded, it is the same mechanism bit for bit, its bodies named `name/body`.
    ///
    /// >>> text, lost = arm.to_ron("arm")
    /// >>> len(text) > 500
    /// True
    #[pyo3(signature = (name="Machine"))]
    fn to_ron(&self, name: &str) -> (String, Vec<String>) {
        let made = AssemblyForm::from_description(name, &self.description());
        (made.assembly.to_ron(), made.left_out)
    }
}
