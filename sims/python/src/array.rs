//! Conversion between numpy arrays and Rust vectors. Input arrays are checked for shape and NaN; results become arrays without a copy.
//!
//! Input is copied, because other Python threads may write to an array or resize it while Rust works. Everything that numpy can convert to float64 is
//! accepted.
use crate::error::{refuse, refuse_with, unless_own};
use linkwork_dynamics::checked;
use linkwork_spatial::nalgebra::Quaternion;
use linkwork_spatial::{Force, Mat3, Motion, Pose, Quat, Vec3, quat};
use numpy::ndarray::ArrayView2;
use numpy::{BorrowError, PyUntypedArray, PyUntypedArrayMethods};
use numpy::{PyArray1, PyArray2, PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn};
use pyo3::exceptions::PyMemoryError;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyString};
use std::marker::PhantomData;
use std::ops::Range;

/// Array with any number of dimensions: the result of a function that accepts one state or many.
pub type Array<'py> = Bound<'py, PyArrayDyn<f64>>;
/// One-dimensional array.
pub type Array1<'py> = Bound<'py, PyArray1<f64>>;
/// Two-dimensional array.
pub type Array2<'py> = Bound<'py, PyArray2<f64>>;

/// Arrays up to this length are copied element by element. It covers one state of any usual machine.
const FEW: usize = 256;

/// Checked copy of an input array: finite numbers in row-major order, of a known shape.
///
/// The copy is made while the interpreter's lock is held, so changes of the array by other threads have no effect.
pub struct Input<'py> {
    numbers: Vec<f64>,
    /// Number of dimensions. The sizes of up to two dimensions are stored inline, without an allocation; more are in `sizes`.
    dimensions: usize,
    two: [usize; 2],
    sizes: Vec<usize>,
    /// Address range of the array's memory.
    memory: Range<usize>,
    of: PhantomData<Bound<'py, PyAny>>,
}

/// Returns the address range of an array's numbers.
fn memory(array: &Array<'_>) -> Range<usize> {
    let from = array.data() as usize;
    from..from + size_of::<f64>() * array.len()
}

impl<'py> Input<'py> {
    /// Reads any array of finite numbers. Messages call it `what`.
    pub fn read(given: &Bound<'py, PyAny>, what: &str) -> PyResult<Self> {
        // Subclasses of ndarray take the slow path, because they can have additional data such as masks.
        let direct = given.cast_exact::<PyUntypedArray>().ok();
        let direct = direct.and_then(|_| given.cast::<PyArrayDyn<f64>>().ok());
        let direct = direct.filter(|a| a.is_c_contiguous());
        // A copy is faster than borrowing the array if it has few numbers.
        let few = direct.filter(|a| a.len() <= FEW);
        if let Some((array, numbers)) = few.and_then(|a| Some((a, a.to_vec().ok()?))) {
            return Self::checked(numbers, array, what);
        }
        let lent = direct.and_then(|a| a.try_readonly().ok());
        let array = match lent.filter(|a| a.as_slice().is_ok()) {
            Some(a) => a,
            None => copied(given, what)?,
        };
        let all = array.as_slice().map_err(|e| refuse(format!("`{what}`: {e}")))?;
        let mut numbers = room(all.len(), 1)?;
        numbers.extend_from_slice(all);
        Self::checked(numbers, &array, what)
    }

    fn checked(numbers: Vec<f64>, array: &Array<'py>, what: &str) -> PyResult<Self> {
        let (mut two, mut sizes) = ([0; 2], Vec::new());
        let shape = array.shape();
        let dimensions = shape.len();
        match two.get_mut(..dimensions) {
            Some(few) => few.copy_from_slice(shape),
            None => sizes = shape.to_vec(),
        }
        let input =
            Self { numbers, dimensions, two, sizes, memory: memory(array), of: PhantomData };
        // The Rust function provides the message.
        checked::finite(what, input.slice()).map_err(|e| refuse(e.to_string()))?;
        Ok(input)
    }

    /// Returns the numbers in row-major order.
    pub fn slice(&self) -> &[f64] {
        &self.numbers
    }

    /// Returns the shape.
    pub fn shape(&self) -> &[usize] {
        self.two.get(..self.dimensions).unwrap_or(&self.sizes)
    }

    /// Returns the address range of the original array's memory.
    pub fn memory(&self) -> &Range<usize> {
        &self.memory
    }
}

fn copied<'py>(given: &Bound<'py, PyAny>, what: &str) -> PyResult<PyReadonlyArrayDyn<'py, f64>> {
    let py = given.py();
    let numpy = py.import("numpy")?;
    let help = "give a numpy array of float64, or a list of numbers";
    let not_numbers = |e: PyErr| {
        let fact = |e: &PyErr| format!("`{what}` is not an array of numbers: {}", e.value(py));
        unless_own(py, e, |e| refuse_with(fact(e), help))
    };
    let masked = numpy.getattr("ma")?.call_method1("is_masked", (given,)).map_err(not_numbers)?;
    if masked.is_truthy()? {
        let help = "replace the masked values (`x.filled(0.0)`), or remove them";
        return Err(refuse_with(format!("`{what}` contains masked values"), help));
    }
    let made = numpy.call_method1("asarray", (given,)).map_err(not_numbers)?;
    let kind: char = made.getattr("dtype")?.getattr("kind")?.extract()?;
    let texts = || -> PyResult<bool> {
        let text = |x: PyResult<Bound<'py, PyAny>>| {
            x.map(|x| x.is_instance_of::<PyString>() || x.is_instance_of::<PyBytes>())
        };
        made.getattr("flat")?.try_iter()?.try_fold(false, |any, x| Ok(any || text(x)?))
    };
    match kind {
        'f' | 'i' | 'u' | 'b' => {}
        'c' => return Err(refuse_with(format!("`{what}` is complex"), "give real numbers")),
        'O' if !texts()? => {}
        'O' | 'U' | 'S' => {
            let fact = format!("`{what}` is not an array of numbers: it contains strings");
            return Err(refuse_with(fact, help));
        }
        _ => {
            let kind = made.getattr("dtype")?;
            let fact = format!("`{what}` is not an array of numbers, but of {kind}");
            return Err(refuse_with(fact, help));
        }
    }
    let options = PyDict::new(py);
    options.set_item("dtype", "float64")?;
    options.set_item("order", "C")?;
    options.set_item("copy", true)?;
    let made = numpy.call_method("array", (made,), Some(&options)).map_err(not_numbers)?;
    let made = made.cast_into::<PyArrayDyn<f64>>().map_err(|e| not_numbers(e.into()))?;
    made.try_readonly().map_err(|e| refuse(format!("`{what}`: {e}")))
}

fn wrong_shape(what: &str, shape: &[usize], want: &str) -> PyErr {
    let sizes: Vec<String> = shape.iter().map(usize::to_string).collect();
    refuse_with(
        format!("`{what}` has the shape ({})", sizes.join(", ")),
        format!("give it the shape {want}"),
    )
}

/// Reads a vector of `n` numbers, one per coordinate or degree of freedom of the mechanism.
pub fn vector<'py>(given: &Bound<'py, PyAny>, n: usize, what: &str) -> PyResult<Input<'py>> {
    let input = Input::read(given, what)?;
    match input.shape()[..] {
        [m] => {
            checked::length(what, m, n).map_err(|e| refuse(e.to_string()))?;
            Ok(input)
        }
        _ => Err(wrong_shape(what, input.shape(), &format!("({n},)"))),
    }
}

/// Reads a vector of exactly `N` numbers that does not depend on the mechanism, such as an axis or a force.
pub fn fixed<const N: usize>(given: &Bound<'_, PyAny>, what: &str) -> PyResult<[f64; N]> {
    let input = Input::read(given, what)?;
    match (input.shape(), <[f64; N]>::try_from(input.slice())) {
        ([_], Ok(found)) => Ok(found),
        (shape, _) => Err(wrong_shape(what, shape, &format!("({N},)"))),
    }
}

/// Reads a vector (3,).
pub fn vec3(given: &Bound<'_, PyAny>, what: &str) -> PyResult<Vec3> {
    fixed::<3>(given, what).map(Vec3::from)
}

/// Reads a wrench (6,): moment about the origin, N m, then force, N.
pub fn wrench(given: &Bound<'_, PyAny>, what: &str) -> PyResult<Force> {
    let [a, b, c, x, y, z] = fixed::<6>(given, what)?;
    Ok(Force::new(Vec3::new(a, b, c), Vec3::new(x, y, z)))
}

/// Reads a 3 × 3 matrix.
pub fn mat3(given: &Bound<'_, PyAny>, what: &str) -> PyResult<Mat3> {
    let input = Input::read(given, what)?;
    match input.shape() {
        [3, 3] => Ok(Mat3::from_row_slice(input.slice())),
        shape => Err(wrong_shape(what, shape, "(3, 3)")),
    }
}

/// Reads a pose: (3,) position; (7,) position and quaternion [x y z w]; (4, 4) homogeneous matrix. `None` is the identity.
pub fn pose(given: Option<&Bound<'_, PyAny>>, what: &str) -> PyResult<Pose> {
    let Some(given) = given else { return Ok(Pose::identity()) };
    let input = Input::read(given, what)?;
    let x = input.slice();
    match input.shape() {
        [3] => Ok(Pose::translation(x[0], x[1], x[2])),
        [7] => {
            let raw = Quaternion::new(x[6], x[3], x[4], x[5]);
            if !((raw.norm() - 1.0).abs() < 1e-6) {
                return Err(refuse_with(
                    format!("`{what}`: the quaternion has the length {}", raw.norm()),
                    "give [px py pz qx qy qz qw] with a quaternion of length 1",
                ));
            }
            Ok(Pose::new(Quat::from_quaternion(raw), Vec3::new(x[0], x[1], x[2])))
        }
        [4, 4] => matrix_pose(x, what),
        shape => Err(wrong_shape(what, shape, "(3,), (7,) or (4, 4)")),
    }
}

fn matrix_pose(x: &[f64], what: &str) -> PyResult<Pose> {
    let R = Mat3::new(x[0], x[1], x[2], x[4], x[5], x[6], x[8], x[9], x[10]);
    let off = (R * R.transpose() - Mat3::identity()).norm();
    if !(off < 1e-6 && R.determinant() > 0.0 && x[12..] == [0.0, 0.0, 0.0, 1.0]) {
        return Err(refuse_with(
            format!("`{what}` is not a pose: its rotation matrix has an error of {off:e}"),
            "give [[R, p], [0, 0, 0, 1]] with a rotation matrix R",
        ));
    }
    Ok(Pose::new(quat(&R), Vec3::new(x[3], x[7], x[11])))
}

/// Converts a vector to an array. Only short vectors are copied.
pub fn out1(py: Python<'_>, values: Vec<f64>) -> Array1<'_> {
    if values.len() <= FEW {
        return PyArray1::from_slice(py, &values);
    }
    PyArray1::from_vec(py, values)
}

/// Returns an empty vector with capacity for `rows` rows of `width` numbers. Raises `MemoryError`, like numpy, if the allocation fails.
pub fn room(rows: usize, width: usize) -> PyResult<Vec<f64>> {
    let mut values = Vec::new();
    let fits = rows.checked_mul(width).is_some_and(|n| values.try_reserve_exact(n).is_ok());
    match fits {
        true => Ok(values),
        false => Err(PyMemoryError::new_err(format!(
            "cannot allocate memory for {rows} rows of {width} numbers"
        ))),
    }
}

/// Like [`room`], filled with zeros.
pub fn zeros(rows: usize, width: usize) -> PyResult<Vec<f64>> {
    let mut values = room(rows, width)?;
    values.resize(rows * width, 0.0);
    Ok(values)
}

/// Returns an error if a result is not finite (overflow).
fn finite(values: &[f64]) -> PyResult<()> {
    // The loop does not exit early, so that the compiler can vectorize the test.
    if values.iter().fold(true, |all, x| all & x.is_finite()) {
        return Ok(());
    }
    let x = values.iter().find(|x| !x.is_finite()).copied().unwrap_or(f64::NAN);
    Err(refuse_with(
        format!("the result is {x}: a number overflowed during the computation"),
        "give numbers of realistic magnitude, in SI units",
    ))
}

/// Like [`out1`], with an error for numbers that are not finite.
pub fn checked1(py: Python<'_>, values: Vec<f64>) -> PyResult<Array1<'_>> {
    finite(&values)?;
    Ok(out1(py, values))
}

/// Converts numbers in row-major order to a matrix, with an error for numbers that are not finite.
pub fn out2(py: Python<'_>, values: Vec<f64>, rows: usize, columns: usize) -> PyResult<Array2<'_>> {
    finite(&values)?;
    if let (true, Ok(few)) = (values.len() <= FEW, ArrayView2::from_shape((rows, columns), &values))
    {
        return Ok(PyArray2::from_array(py, &few));
    }
    PyArray1::from_vec(py, values).reshape([rows, columns])
}

/// Converts numbers in row-major order to an array of any shape, with an error for numbers that are not finite. Only short vectors are copied.
pub fn out<'py>(py: Python<'py>, values: Vec<f64>, shape: &[usize]) -> PyResult<Array<'py>> {
    match *shape {
        [_] => Ok(checked1(py, values)?.to_dyn().clone()),
        [rows, columns] => Ok(out2(py, values, rows, columns)?.to_dyn().clone()),
        _ => {
            finite(&values)?;
            PyArray1::from_vec(py, values).reshape(shape)
        }
    }
}

/// Like [`out`], but writes into the caller's array `to` if there is one, and returns it. The array must be writable, C-contiguous, float64, of the
/// result's shape, and must not overlap the memory of the arguments (`read`: their address ranges).
pub fn out_into<'py>(
    py: Python<'py>,
    values: Vec<f64>,
    shape: &[usize],
    given: Option<&Bound<'py, PyAny>>,
    read: impl Iterator<Item = Range<usize>>,
) -> PyResult<Array<'py>> {
    let Some(given) = given else { return out(py, values, shape) };
    finite(&values)?;
    let Ok(array) = given.cast::<PyArrayDyn<f64>>() else {
        let kind =
            given.getattr("dtype").map_or_else(|_| given.get_type().to_string(), |d| d.to_string());
        return Err(refuse_with(
            format!("`out` is not an array of float64: {kind}"),
            "give a numpy array of float64, such as the result of an earlier call",
        ));
    };
    if array.shape() != shape {
        let sizes: Vec<String> = shape.iter().map(usize::to_string).collect();
        return Err(wrong_shape("out", array.shape(), &format!("({})", sizes.join(", "))));
    }
    let shares = || refuse_with("`out` shares memory with an argument", "give a separate array");
    let own = memory(array);
    if array.is_c_contiguous() && read.into_iter().any(|r| r.start < own.end && own.start < r.end) {
        return Err(shares());
    }
    let mut writable = array.try_readwrite().map_err(|e| match e {
        BorrowError::AlreadyBorrowed => shares(),
        _ => refuse_with("`out` is read-only", "give a writable array"),
    })?;
    // A slice exists for column-major arrays, too, so the order is tested.
    let rows = array.is_c_contiguous();
    match writable.as_slice_mut() {
        Ok(to) if rows => to.copy_from_slice(&values),
        _ => {
            let fact = "`out` is not C-contiguous (row-major)";
            return Err(refuse_with(fact, "give an array such as numpy.empty returns"));
        }
    }
    Ok(array.clone())
}

/// Converts a few numbers, with an error for numbers that are not finite.
fn few<'py>(py: Python<'py>, values: &[f64]) -> PyResult<Array1<'py>> {
    finite(values)?;
    Ok(PyArray1::from_slice(py, values))
}

/// Returns a number, with an error if it is not finite.
pub fn out_number(x: f64) -> PyResult<f64> {
    finite(&[x])?;
    Ok(x)
}

/// Converts a vector to an array (3,), with an error for numbers that are not finite.
pub fn out_vec3<'py>(py: Python<'py>, v: &Vec3) -> PyResult<Array1<'py>> {
    few(py, v.as_slice())
}

/// Converts a motion to an array (6,), [ω; v], with an error for numbers that are not finite.
pub fn out_motion<'py>(py: Python<'py>, m: &Motion) -> PyResult<Array1<'py>> {
    let (w, v) = (&m.angular, &m.linear);
    few(py, &[w.x, w.y, w.z, v.x, v.y, v.z])
}

/// Converts a force to an array (6,), [n; F], with an error for numbers that are not finite.
pub fn out_force<'py>(py: Python<'py>, f: &Force) -> PyResult<Array1<'py>> {
    let (n, f) = (&f.moment, &f.force);
    few(py, &[n.x, n.y, n.z, f.x, f.y, f.z])
}

/// Converts a pose to a matrix (4, 4), [[R, p], [0, 0, 0, 1]].
pub fn out_pose<'py>(py: Python<'py>, X: &Pose) -> PyResult<Array2<'py>> {
    let R = X.rotation.to_rotation_matrix();
    let (R, p) = (R.matrix(), &X.position);
    let mut m = Vec::with_capacity(16);
    for i in 0..3 {
        m.extend([R[(i, 0)], R[(i, 1)], R[(i, 2)], p[i]]);
    }
    m.extend([0.0, 0.0, 0.0, 1.0]);
    out2(py, m, 4, 4)
}
