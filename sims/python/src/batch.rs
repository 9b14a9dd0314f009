//! Evaluation of an algorithm at one state or at many: the rows of the inputs, the loop over them, and the use of `Ensemble`.
//!
//! An input of shape (w,) applies to all states; an input of shape (n, w) has one row per state. An algorithm is a closure over the numbers of one
//! state. Frequently used algorithms process many states in an `Ensemble`, four or eight at once. Results do not depend on the number of threads.
use crate::array::{Array, Input, out_into, zeros};
use crate::core::Core;
use crate::error::{refuse, refuse_with};
use linkwork_dynamics::{DynamicsError, Ensemble, Tree, Workspace};
use pyo3::prelude::*;
use smallvec::SmallVec;
use std::ops::Range;
use std::sync::OnceLock;

/// Inputs of an algorithm, with consistent numbers of rows.
pub struct Rows<'py> {
    inputs: SmallVec<[(Input<'py>, usize); 4]>,
    /// `None`: one state.
    n: Option<usize>,
}

/// The numbers of the inputs, without references to Python objects.
pub struct View<'a> {
    inputs: SmallVec<[(&'a [f64], usize, bool); 4]>,
    n: usize,
}

impl<'py> Rows<'py> {
    /// Returns the number of states; 0 for one state without a row dimension.
    pub fn count(&self) -> usize {
        self.n.unwrap_or(0)
    }

    /// Reads inputs from (array, width, name).
    pub fn read(given: &[(&Bound<'py, PyAny>, usize, &str)]) -> PyResult<Self> {
        let mut rows = Rows { inputs: SmallVec::new(), n: None };
        let mut first = "";
        for (array, width, what) in given {
            let input = Input::read(array, what)?;
            let found = match *input.shape() {
                [w] => Some((w, None)),
                [n, w] => Some((w, Some(n))),
                _ => None,
            };
            let Some((w, n)) = found.filter(|f| f.0 == *width) else {
                return Err(wrong(&input, *width, what));
            };
            match (rows.n, n) {
                (Some(a), Some(b)) if a != b => {
                    return Err(refuse_with(
                        format!("`{first}` has {a} states, `{what}` has {b}"),
                        "give each the same number of rows, or one row for all",
                    ));
                }
                (None, Some(_)) => (rows.n, first) = (n, what),
                _ => {}
            }
            rows.inputs.push((input, w));
        }
        Ok(rows)
    }

    fn view(&self) -> View<'_> {
        let one = |(input, w): &'_ (Input<'py>, usize)| (input.shape().len() > 1, *w);
        let inputs = self.inputs.iter().map(|i| {
            let (many, w) = one(i);
            (i.0.slice(), w, many)
        });
        View { inputs: inputs.collect(), n: self.n.unwrap_or(1) }
    }

    /// Returns the address ranges of the inputs.
    fn memory(&self) -> impl Iterator<Item = Range<usize>> + '_ {
        self.inputs.iter().map(|(input, _)| input.memory().clone())
    }

    /// Returns the shape of a result: `each` for one state, (n, each) for many.
    fn shape(&self, each: &[usize]) -> SmallVec<[usize; 4]> {
        self.n.into_iter().chain(each.iter().copied()).collect()
    }
}

fn wrong(input: &Input<'_>, width: usize, what: &str) -> PyErr {
    let help = format!("give it the shape ({width},), or (n, {width}) for n states");
    match input.shape() {
        [w] | [_, w] => {
            refuse_with(format!("`{what}` has {w} numbers, the mechanism has {width}"), help)
        }
        shape => refuse_with(format!("`{what}` has {} dimensions", shape.len()), help),
    }
}

impl View<'_> {
    /// Returns the configurations in row-major order. They are the first input of every algorithm.
    fn configurations(&self) -> &[f64] {
        self.inputs.first().map_or(&[], |(q, ..)| q)
    }

    /// Returns row `k` of each input.
    fn row(&self, k: usize) -> impl Iterator<Item = &[f64]> {
        self.inputs.iter().map(move |(x, w, many)| {
            let at = if *many { k * w } else { 0 };
            x.get(at..at + w).unwrap_or_default()
        })
    }
}

/// An algorithm for one state: maps rows of the inputs to result numbers.
pub trait Kernel:
    Fn(&Tree, &mut Workspace, &[&[f64]], &mut [f64]) -> Result<(), DynamicsError> + Sync
{
}
impl<K: Fn(&Tree, &mut Workspace, &[&[f64]], &mut [f64]) -> Result<(), DynamicsError> + Sync> Kernel
    for K
{
}

/// Evaluates an algorithm at each state; `each` is the shape of its result.
pub fn states<'py>(
    py: Python<'py>,
    core: &Core,
    rows: &Rows<'_>,
    threads: usize,
    each: &[usize],
    kernel: impl Kernel,
) -> PyResult<Array<'py>> {
    states_into(py, core, rows, threads, each, None, kernel)
}

/// Like [`states`], with the result in the caller's array if there is one.
pub fn states_into<'py>(
    py: Python<'py>,
    core: &Core,
    rows: &Rows<'_>,
    threads: usize,
    each: &[usize],
    given: Option<&Bound<'py, PyAny>>,
    kernel: impl Kernel,
) -> PyResult<Array<'py>> {
    let (view, width) = (rows.view(), each.iter().product::<usize>());
    core.attitudes(view.configurations())?;
    let mut values = zeros(view.n, width)?;
    let piece = |first: usize, out: &mut [f64], ws: &mut Workspace| {
        let mut inputs: SmallVec<[&[f64]; 4]> = SmallVec::new();
        for (k, out) in out.chunks_mut(width.max(1)).enumerate() {
            inputs.clear();
            inputs.extend(view.row(first + k));
            kernel(&core.tree, ws, &inputs, out)?;
        }
        Ok(())
    };
    let threads = checked(threads)?;
    let result = if rows.n.is_none() {
        core.run(py, |_, ws| piece(0, &mut values, ws))
    } else {
        let cut = Cut { n: view.n, width, threads };
        py.detach(|| {
            cut.spread(&mut values, |first, out| {
                let mut ws = core.workspace();
                let result = piece(first, out, &mut ws);
                core.give_back(ws);
                result
            })
        })
    };
    result.map_err(|e: DynamicsError| refuse(e))?;
    out_into(py, values, &rows.shape(each), given, rows.memory())
}

/// Checks a number of threads: returns at most one per processor, and an error for 0.
pub fn checked(threads: usize) -> PyResult<usize> {
    if threads == 0 {
        return Err(refuse_with("`threads` is 0", "give 1 or more"));
    }
    // The number of processors is read once, because the system call takes longer than the evaluation of one state.
    static PROCESSORS: OnceLock<usize> = OnceLock::new();
    let count = || std::thread::available_parallelism().map_or(1, usize::from);
    Ok(if threads == 1 { 1 } else { threads.min(*PROCESSORS.get_or_init(count)) })
}

/// Distribution of rows to threads.
struct Cut {
    n: usize,
    width: usize,
    threads: usize,
}

impl Cut {
    /// Calls `piece(first row, rows of the result)` on each thread and returns the first error.
    fn spread(
        &self,
        values: &mut [f64],
        piece: impl Fn(usize, &mut [f64]) -> Result<(), DynamicsError> + Sync,
    ) -> Result<(), DynamicsError> {
        let rows = self.n.div_ceil(self.threads.min(self.n.max(1)));
        if self.threads == 1 || self.width == 0 || values.is_empty() {
            return piece(0, values);
        }
        std::thread::scope(|scope| {
            let pieces = values.chunks_mut(rows * self.width).enumerate();
            let threads: Vec<_> = pieces
                .map(|(k, out)| {
                    scope.spawn({
                        let piece = &piece;
                        move || piece(k * rows, out)
                    })
                })
                .collect();
            // A panic of a thread is propagated to this thread.
            let join = |t: std::thread::ScopedJoinHandle<'_, _>| {
                t.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
            };
            let results: Vec<Result<(), DynamicsError>> = threads.into_iter().map(join).collect();
            results.into_iter().collect()
        })
    }
}

/// Evaluates many states with the SIMD lanes and threads of the ensemble: `f(ensemble, input tables, result tables)`, with a result of each shape in
/// `each`. Returns `None` if the rows are one state.
pub fn ensemble<'py>(
    py: Python<'py>,
    core: &Core,
    rows: &Rows<'_>,
    threads: usize,
    each: &[&[usize]],
    f: impl FnOnce(&mut Ensemble, &[&[f64]], &mut [Vec<f64>]) -> Result<(), DynamicsError> + Send,
) -> PyResult<Option<Vec<Array<'py>>>> {
    ensemble_into(py, core, rows, threads, each, None, f)
}

/// Like [`ensemble`], but writes the first result into the caller's array if one is given.
pub fn ensemble_into<'py>(
    py: Python<'py>,
    core: &Core,
    rows: &Rows<'_>,
    threads: usize,
    each: &[&[usize]],
    given: Option<&Bound<'py, PyAny>>,
    f: impl FnOnce(&mut Ensemble, &[&[f64]], &mut [Vec<f64>]) -> Result<(), DynamicsError> + Send,
) -> PyResult<Option<Vec<Array<'py>>>> {
    let (threads, Some(n)) = (checked(threads)?, rows.n) else { return Ok(None) };
    let view = rows.view();
    core.attitudes(view.configurations())?;
    let size = |shape: &&[usize]| zeros(n, shape.iter().product());
    let mut results: Vec<Vec<f64>> = each.iter().map(size).collect::<PyResult<_>>()?;
    let repeated: Vec<Vec<f64>> =
        view.inputs.iter().map(|i| repeated(i, n)).collect::<PyResult<_>>()?;
    let run = || {
        let rows = view.inputs.iter().zip(&repeated);
        let inputs: Vec<&[f64]> =
            rows.map(|((values, _, many), own)| if *many { *values } else { &own[..] }).collect();
        core.with_ensemble(threads, |ensemble| f(ensemble, &inputs, &mut results))
    };
    py.detach(run).map_err(refuse)?;
    let given = std::iter::once(given).chain(std::iter::repeat(None));
    let shaped = results.into_iter().zip(each).zip(given);
    let shaped =
        shaped.map(|((x, shape), to)| out_into(py, x, &rows.shape(shape), to, rows.memory()));
    shaped.collect::<PyResult<_>>().map(Some)
}

/// Repeats a single row for each state. Returns an empty vector if there is already a row per state.
fn repeated((values, _, many): &(&[f64], usize, bool), n: usize) -> PyResult<Vec<f64>> {
    if *many {
        return Ok(Vec::new());
    }
    let mut rows = crate::array::room(n, values.len())?;
    (0..n).for_each(|_| rows.extend_from_slice(values));
    Ok(rows)
}
