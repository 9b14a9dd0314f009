//! One state or many: the rows of the inputs, the loop over them, and the lanes that take four or
//! eight states at once.
//!
//! Every algorithm is a closure over the numbers of one state. Inputs of shape (w,) serve all
//! states; of shape (n, w) one each. Rows are cut for the threads at multiples of the lane width,
//! so the number of threads changes no bit.
use crate::array::{Array, Input, out};
use crate::core::Core;
use crate::error::{refuse, refuse_with};
use linkwork_dynamics::{Batch, DynamicsError, Lane, Tree, Workspace, f64x4, f64x8};
use linkwork_multibody::NodeId;
use linkwork_spatial::Force;
use pyo3::prelude::*;

/// Inputs of an algorithm, checked against each other.
pub struct Rows<'py> {
    inputs: Vec<(Input<'py>, usize)>,
    /// `None`: one state.
    n: Option<usize>,
}

/// The numbers of the inputs, free of the interpreter.
pub struct View<'a> {
    inputs: Vec<(&'a [f64], usize, bool)>,
    n: usize,
}

impl<'py> Rows<'py> {
    /// Reads (array, width, name) each.
    pub fn read(given: &[(&Bound<'py, PyAny>, usize, &str)]) -> PyResult<Self> {
        let mut rows = Rows { inputs: Vec::with_capacity(given.len()), n: None };
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

    /// The shape of a result: `each` for one state, (n, each) for many.
    fn shape(&self, each: &[usize]) -> Vec<usize> {
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
    /// Row `k` of each input.
    fn row(&self, k: usize) -> impl Iterator<Item = &[f64]> {
        self.inputs.iter().map(move |(x, w, many)| {
            let at = if *many { k * w } else { 0 };
            x.get(at..at + w).unwrap_or_default()
        })
    }

    fn at(&self, input: usize, k: usize, i: usize) -> f64 {
        let (x, w, many) = self.inputs[input];
        x[if many { k * w + i } else { i }]
    }
}

/// An algorithm at one state: rows of the inputs in, numbers out.
pub trait Kernel:
    Fn(&Tree, &mut Workspace, &[&[f64]], &mut [f64]) -> Result<(), DynamicsError> + Sync
{
}
impl<K: Fn(&Tree, &mut Workspace, &[&[f64]], &mut [f64]) -> Result<(), DynamicsError> + Sync> Kernel
    for K
{
}

/// The algorithm at each state; `each` is the shape of its result.
pub fn states<'py>(
    py: Python<'py>,
    core: &Core,
    rows: &Rows<'_>,
    threads: usize,
    each: &[usize],
    kernel: impl Kernel,
) -> PyResult<Array<'py>> {
    let (view, width) = (rows.view(), each.iter().product::<usize>());
    let mut values = vec![0.0; view.n * width];
    let piece = |first: usize, out: &mut [f64], ws: &mut Workspace| {
        let mut inputs: Vec<&[f64]> = Vec::with_capacity(view.inputs.len());
        for (k, out) in out.chunks_mut(width.max(1)).enumerate() {
            inputs.clear();
            inputs.extend(view.row(first + k));
            kernel(&core.tree, ws, &inputs, out)?;
        }
        Ok(())
    };
    let threads = at_least_one(threads)?;
    let result = if rows.n.is_none() {
        core.run(py, |_, ws| piece(0, &mut values, ws))
    } else {
        let cut = Cut { n: view.n, width, threads, lanes: 1 };
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
    out(py, values, &rows.shape(each))
}

fn at_least_one(threads: usize) -> PyResult<usize> {
    if threads == 0 {
        return Err(refuse_with("`threads` is 0", "give 1 or more"));
    }
    Ok(threads)
}

/// How rows are dealt to threads.
struct Cut {
    n: usize,
    width: usize,
    threads: usize,
    lanes: usize,
}

impl Cut {
    /// `piece(first row, rows of the result)` on each thread; the first error.
    fn spread(
        &self,
        values: &mut [f64],
        piece: impl Fn(usize, &mut [f64]) -> Result<(), DynamicsError> + Sync,
    ) -> Result<(), DynamicsError> {
        let groups = self.n.div_ceil(self.lanes);
        let rows = groups.div_ceil(self.threads.min(groups.max(1))) * self.lanes;
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
            // A panic of a thread goes on in this one.
            let join = |t: std::thread::ScopedJoinHandle<'_, _>| {
                t.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
            };
            threads.into_iter().map(join).fold(Ok(()), |first, next| first.and(next))
        })
    }
}

/// A lane that is filled and read state by state.
pub trait Pack: Lane {
    /// From a number for each state.
    fn pack(each: impl FnMut(usize) -> f64) -> Self;
    /// The numbers of all states.
    fn unpack(&self, each: impl FnMut(usize, f64));
}

macro_rules! pack {
    ($T:ident, $n:literal) => {
        impl Pack for $T {
            fn pack(each: impl FnMut(usize) -> f64) -> Self {
                $T::from(std::array::from_fn::<f64, $n, _>(each))
            }
            fn unpack(&self, mut each: impl FnMut(usize, f64)) {
                self.to_array().iter().enumerate().for_each(|(k, x)| each(k, *x));
            }
        }
    };
}
pack!(f64x4, 4);
pack!(f64x8, 8);

/// An algorithm on several states at once: one vector of lanes for each input, lanes out.
pub trait LaneKernel {
    /// Runs it.
    ///
    /// # Errors
    /// As the algorithm.
    fn run<L: Pack>(
        &self,
        tree: &Tree,
        batch: &mut Batch<L>,
        inputs: &mut [Vec<L>],
        out: &mut [L],
    ) -> Result<(), DynamicsError>;
}

/// Runs many states in lanes: eight up to 20 degrees of freedom, four beyond. `None`: the rows
/// are one state.
pub fn lanes<'py>(
    py: Python<'py>,
    core: &Core,
    rows: &Rows<'_>,
    threads: usize,
    each: &[usize],
    kernel: &(impl LaneKernel + Sync),
) -> PyResult<Option<Array<'py>>> {
    if rows.n.is_none() {
        return Ok(None);
    }
    let (view, width) = (rows.view(), each.iter().product::<usize>());
    let mut values = vec![0.0; view.n * width];
    let wide = core.nv() <= 20;
    let lanes = if wide { f64x8::WIDTH } else { f64x4::WIDTH };
    let cut = Cut { n: view.n, width, threads: at_least_one(threads)?, lanes };
    let result = py.detach(|| {
        cut.spread(&mut values, |first, out| {
            if wide {
                groups::<f64x8>(core, &view, first, width, out, kernel)
            } else {
                groups::<f64x4>(core, &view, first, width, out, kernel)
            }
        })
    });
    result.map_err(refuse)?;
    Ok(Some(out(py, values, &rows.shape(each))?))
}

/// Groups of `L::WIDTH` states from row `first` on; the last group repeats its last state.
fn groups<L: Pack>(
    core: &Core,
    view: &View<'_>,
    first: usize,
    width: usize,
    out: &mut [f64],
    kernel: &impl LaneKernel,
) -> Result<(), DynamicsError> {
    let mut batch = Batch::<L>::new(&core.tree);
    let mut inputs: Vec<Vec<L>> =
        view.inputs.iter().map(|(_, w, _)| vec![L::default(); *w]).collect();
    let mut lanes = vec![L::default(); width];
    for (g, out) in out.chunks_mut((width * L::WIDTH).max(1)).enumerate() {
        let last = first + g * L::WIDTH + out.len() / width.max(1) - 1;
        for (j, input) in inputs.iter_mut().enumerate() {
            for (i, lane) in input.iter_mut().enumerate() {
                *lane = L::pack(|k| view.at(j, (first + g * L::WIDTH + k).min(last), i));
            }
        }
        batch.clear_forces();
        batch.set_uniform_gravity(core.gravity());
        kernel.run(&core.tree, &mut batch, &mut inputs, &mut lanes)?;
        for (i, lane) in lanes.iter().enumerate() {
            lane.unpack(|k, x| {
                if let Some(out) = out.get_mut(k * width + i) {
                    *out = x;
                }
            });
        }
    }
    Ok(())
}

/// The same wrenches in every state. After `batch.kinematics`.
pub fn add_wrenches<L: Pack>(tree: &Tree, batch: &mut Batch<L>, wrenches: &[(NodeId, Force)]) {
    let three = |v: &linkwork_spatial::Vec3| [L::splat(v.x), L::splat(v.y), L::splat(v.z)];
    for (node, f) in wrenches {
        batch.add_wrench_at_node(tree, *node, three(&f.moment), three(&f.force));
    }
}
