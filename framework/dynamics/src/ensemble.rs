//! Many states of one mechanism at once, in SIMD lanes and threads.
//!
//! States are stored one after another in flat arrays (all numbers of state 0, then of state 1, …), like a table with one row per state. They are
//! divided among the threads in equal parts, and each thread processes as many states at once as a lane holds. The result of every state is
//! bit-identical to the result of the state alone in the same lane width, for any number of threads.

use crate::error::DynamicsError;
use crate::lane::Lane;
use crate::tree::Tree;
use crate::{Batch, Compliance, Derivatives, ForwardDerivatives};
use linkwork_multibody::NodeId;
use linkwork_spatial::Vec3;
use rayon::prelude::*;
use std::sync::Arc;
use wide::{f64x4, f64x8};

/// The algorithms on tables of states. The memory of each algorithm is allocated at its first use and kept.
#[derive(Debug)]
pub struct Ensemble {
    tree: Arc<Tree>,
    workers: Workers,
    pool: Option<rayon::ThreadPool>,
}

#[derive(Debug)]
enum Workers {
    Four(Vec<Worker<f64x4>>),
    Eight(Vec<Worker<f64x8>>),
}

/// Memory of one thread.
#[derive(Debug)]
struct Worker<L: Lane> {
    batch: Batch<L>,
    derivatives: Option<Derivatives<L>>,
    compliance: Option<(Vec<NodeId>, Compliance<L>)>,
    inputs: Vec<Vec<L>>,
    outputs: Vec<Vec<L>>,
}

/// Maximum number of links for which eight lanes are used, if the program is compiled for a processor that has them.
const EIGHT_LANES: usize = 20;

/// The computation on one batch: inputs and outputs by index.
type Step<'a, L> = &'a (
        dyn Fn(&Tree, &mut Worker<L>, &[Vec<L>], &mut [Vec<L>]) -> Result<(), DynamicsError> + Sync
    );

impl Ensemble {
    /// Creates an ensemble for `tree` on `threads` threads (0: one per processor).
    ///
    /// # Panics
    /// If the operating system cannot create threads.
    #[must_use]
    pub fn new(tree: Arc<Tree>, threads: usize) -> Self {
        let pool = (threads != 1).then(|| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
            pool.unwrap_or_else(|e| panic!("no threads for the ensemble: {e}"))
        });
        let n = pool.as_ref().map_or(1, rayon::ThreadPool::current_num_threads);
        let eight = cfg!(target_feature = "avx512f") && tree.links.len() <= EIGHT_LANES;
        let workers = if eight {
            Workers::Eight((0..n).map(|_| Worker::new(&tree)).collect())
        } else {
            Workers::Four((0..n).map(|_| Worker::new(&tree)).collect())
        };
        Self { tree, workers, pool }
    }

    /// Sets the acceleration of gravity (m/s², world axes) for all states.
    pub fn set_uniform_gravity(&mut self, g: Vec3) {
        match &mut self.workers {
            Workers::Four(w) => w.iter_mut().for_each(|w| w.batch.set_uniform_gravity(g)),
            Workers::Eight(w) => w.iter_mut().for_each(|w| w.batch.set_uniform_gravity(g)),
        }
    }

    /// Runs a step over all states. `inputs` and `outputs` are tables of `count` rows each. Rows of outputs with the length of β are also read first,
    /// because a table may contain both given and computed values.
    fn run(
        &mut self,
        count: usize,
        inputs: &[&[f64]],
        outputs: &mut [&mut [f64]],
        four: Step<'_, f64x4>,
        eight: Step<'_, f64x8>,
    ) -> Result<(), DynamicsError> {
        for (i, table) in
            inputs.iter().map(|t| t.len()).chain(outputs.iter().map(|t| t.len())).enumerate()
        {
            assert!(
                count == 0 || table.is_multiple_of(count),
                "table {i} has {table} numbers, which is not a multiple of {count} states"
            );
        }
        let (tree, pool) = (&*self.tree, self.pool.as_ref());
        match &mut self.workers {
            Workers::Four(w) => deal(tree, pool, w, count, inputs, outputs, four),
            Workers::Eight(w) => deal(tree, pool, w, count, inputs, outputs, eight),
        }
    }
}

/// Assigns a part of the states to each worker.
fn deal<L: Lane>(
    tree: &Tree,
    pool: Option<&rayon::ThreadPool>,
    workers: &mut [Worker<L>],
    count: usize,
    inputs: &[&[f64]],
    outputs: &mut [&mut [f64]],
    step: Step<'_, L>,
) -> Result<(), DynamicsError> {
    if count == 0 {
        return Ok(());
    }
    // Divide into whole batches, as evenly as possible.
    let each = count.div_ceil(L::WIDTH).div_ceil(workers.len()) * L::WIDTH;
    let mut rest: Vec<&mut [f64]> = outputs.iter_mut().map(|t| &mut **t).collect();
    let mut jobs = Vec::new();
    for (n, worker) in workers.iter_mut().enumerate() {
        let (start, end) = ((n * each).min(count), ((n + 1) * each).min(count));
        let rows = |t: &[f64]| t.len() / (count - start).max(1);
        let (mut mine, mut others) = (Vec::new(), Vec::new());
        for t in rest {
            let width = if start < count { rows(t) } else { 0 };
            let (a, b) = t.split_at_mut(width * (end - start));
            mine.push(a);
            others.push(b);
        }
        rest = others;
        let given: Vec<&[f64]> =
            (inputs.iter()).map(|t| &t[t.len() / count * start..t.len() / count * end]).collect();
        jobs.push((worker, end - start, given, mine));
    }
    let job =
        |(worker, n, given, mut mine): (&mut Worker<L>, usize, Vec<&[f64]>, Vec<&mut [f64]>)| {
            worker.run(tree, n, &given, &mut mine, step)
        };
    match pool {
        // Returns the first error in the order of states, regardless of which thread was first.
        Some(pool) => {
            pool.install(|| jobs.into_par_iter().map(job).collect::<Vec<_>>()).into_iter().collect()
        }
        None => jobs.into_iter().try_for_each(job),
    }
}

impl<L: Lane> Worker<L> {
    fn new(tree: &Tree) -> Self {
        Self {
            batch: Batch::new(tree),
            derivatives: None,
            compliance: None,
            inputs: Vec::new(),
            outputs: Vec::new(),
        }
    }

    /// Processes states `0..count` of these tables, one lane width at a time. The last batch is filled by repeating its last state.
    fn run(
        &mut self,
        tree: &Tree,
        count: usize,
        inputs: &[&[f64]],
        outputs: &mut [&mut [f64]],
        step: Step<'_, L>,
    ) -> Result<(), DynamicsError> {
        let (mut ins, mut outs) =
            (std::mem::take(&mut self.inputs), std::mem::take(&mut self.outputs));
        ins.resize(inputs.len(), Vec::new());
        outs.resize(outputs.len(), Vec::new());
        let mut result = Ok(());
        for start in (0..count).step_by(L::WIDTH) {
            let state = |l: usize| (start + l).min(count - 1);
            for (to, from) in ins.iter_mut().zip(inputs) {
                pack(to, from, count, state);
            }
            for (to, from) in outs.iter_mut().zip(&*outputs) {
                // Tables of forces and accelerations also contain given values, so read them; matrices contain only
                // computed values.
                if from.len() / count == tree.nv() {
                    pack(to, from, count, state);
                } else {
                    to.resize(from.len() / count, L::default());
                }
            }
            result = step(tree, self, &ins, &mut outs);
            if result.is_err() {
                break;
            }
            let full = L::WIDTH.min(count - start);
            for (from, to) in outs.iter().zip(&mut *outputs) {
                let width = to.len() / count;
                for (l, row) in to.chunks_exact_mut(width.max(1)).skip(start).take(full).enumerate()
                {
                    for (x, from) in row.iter_mut().zip(from) {
                        *x = from.state(l);
                    }
                }
            }
        }
        (self.inputs, self.outputs) = (ins, outs);
        result
    }
}

/// Packs some rows of a table side by side.
fn pack<L: Lane>(to: &mut Vec<L>, from: &[f64], count: usize, state: impl Fn(usize) -> usize) {
    let width = from.len() / count;
    to.resize(width, L::default());
    for (i, to) in to.iter_mut().enumerate() {
        *to = L::gather(|l| from[state(l) * width + i]);
    }
}

/// Instantiates a step for both lane widths.
macro_rules! both {
    ($self:ident, $count:expr, [$($input:expr),*], [$($output:expr),*], $step:expr) => {
        $self.run($count, &[$($input),*], &mut [$($output),*], &$step, &$step)
    };
}

impl Ensemble {
    fn count(&self, q: &[f64]) -> usize {
        q.len().checked_div(self.tree.nq()).unwrap_or(0)
    }

    /// Like [`forward_dynamics`](crate::forward_dynamics), for each row: `q` (n × nq), all others (n × nv).
    ///
    /// # Errors
    /// [`DynamicsError::Singular`] if the dynamics of any state is singular.
    ///
    /// # Panics
    /// If the tables differ in their number of rows. This also applies to all other functions here.
    pub fn forward_dynamics(
        &mut self,
        q: &[f64],
        v: &[f64],
        tau: &mut [f64],
        vdot: &mut [f64],
    ) -> Result<(), DynamicsError> {
        both!(self, self.count(q), [q, v], [tau, vdot], |tree, w, i, o| {
            let [tau, vdot] = o else { unreachable!() };
            w.batch.forward_dynamics(tree, &i[0], &i[1], tau, vdot)
        })
    }

    /// Like [`inverse_dynamics`](crate::inverse_dynamics), for each row.
    pub fn inverse_dynamics(&mut self, q: &[f64], v: &[f64], vdot: &[f64], tau: &mut [f64]) {
        let run = both!(self, self.count(q), [q, v, vdot], [tau], |tree, w, i, o| {
            w.batch.inverse_dynamics(tree, &i[0], &i[1], &i[2], &mut o[0]);
            Ok(())
        });
        debug_assert!(run.is_ok());
    }

    /// Like [`mass_matrix`](crate::mass_matrix), for each row: `out` (n × nv·nv).
    pub fn mass_matrix(&mut self, q: &[f64], out: &mut [f64]) {
        let run = both!(self, self.count(q), [q], [out], |tree, w, i, o| {
            w.batch.poses(tree, &i[0]);
            w.batch.mass_matrix(tree, &mut o[0]);
            Ok(())
        });
        debug_assert!(run.is_ok());
    }

    /// Like [`inverse_mass_matrix`](crate::inverse_mass_matrix), for each row: `out` (n × nv·nv).
    ///
    /// # Errors
    /// [`DynamicsError::Singular`] if the dynamics of any state is singular.
    pub fn inverse_mass_matrix(&mut self, q: &[f64], out: &mut [f64]) -> Result<(), DynamicsError> {
        both!(self, self.count(q), [q], [out], |tree, w, i, o| {
            w.batch.poses(tree, &i[0]);
            w.batch.inverse_mass_matrix(tree, &mut o[0])
        })
    }

    /// Computes the position (3, m) of a node for each row, world axes: `out` (n × 3).
    pub fn node_position(&mut self, q: &[f64], node: NodeId, out: &mut [f64]) {
        let run = both!(self, self.count(q), [q], [out], |tree, w, i, o| {
            w.batch.poses(tree, &i[0]);
            o[0].copy_from_slice(&w.batch.node_position(tree, node));
            Ok(())
        });
        debug_assert!(run.is_ok());
    }

    /// Like [`node_jacobian`](crate::node_jacobian), for each row: `out` (n × 6·nv).
    pub fn node_jacobian(&mut self, q: &[f64], node: NodeId, out: &mut [f64]) {
        let run = both!(self, self.count(q), [q], [out], |tree, w, i, o| {
            w.batch.node_jacobian_at(tree, &i[0], node, &mut o[0]);
            Ok(())
        });
        debug_assert!(run.is_ok());
    }

    /// Like [`centroidal_matrix`](crate::centroidal_matrix), for each row: `out` (n × 6·nv).
    pub fn centroidal_matrix(&mut self, q: &[f64], out: &mut [f64]) {
        let run = both!(self, self.count(q), [q], [out], |tree, w, i, o| {
            w.batch.poses(tree, &i[0]);
            w.batch.centroidal_matrix(tree, &mut o[0]);
            Ok(())
        });
        debug_assert!(run.is_ok());
    }

    /// Like [`Compliance::compute`], for each row: `out` (n × size²).
    ///
    /// # Errors
    /// [`DynamicsError::Singular`] if the dynamics of any state is singular.
    pub fn compliance(
        &mut self,
        q: &[f64],
        nodes: &[NodeId],
        out: &mut [f64],
    ) -> Result<(), DynamicsError> {
        both!(self, self.count(q), [q], [out], |tree, w, i, o| {
            w.batch.poses(tree, &i[0]);
            let Worker { batch, compliance, .. } = w;
            if compliance.as_ref().is_none_or(|(n, _)| n != nodes) {
                *compliance = Some((nodes.to_vec(), Compliance::new(tree, nodes)));
            }
            let Some((_, c)) = compliance else { unreachable!() };
            c.compute_batch(tree, batch, &mut o[0])
        })
    }

    /// Like [`Derivatives::inverse_dynamics`], for each row: `dtau_dq`, `dtau_dv` (n × nv·nv).
    ///
    /// # Panics
    /// If a body is flexible; use [`Tree::check_rigid`] to check.
    pub fn inverse_dynamics_derivatives(
        &mut self,
        q: &[f64],
        v: &[f64],
        vdot: &[f64],
        dtau_dq: &mut [f64],
        dtau_dv: &mut [f64],
    ) {
        let run = both!(self, self.count(q), [q, v, vdot], [dtau_dq, dtau_dv], |tree, w, i, o| {
            let [dq, dv] = o else { unreachable!() };
            w.batch.kinematics(tree, &i[0], &i[1]);
            let Worker { batch, derivatives, .. } = w;
            let d = derivatives.get_or_insert_with(|| Derivatives::new(tree));
            d.inverse_dynamics_batch(tree, batch, &i[1], &i[2], dq, dv);
            Ok(())
        });
        debug_assert!(run.is_ok());
    }

    /// Like [`Derivatives::forward_dynamics`], for each row.
    ///
    /// # Errors
    /// [`DynamicsError::Singular`] if the dynamics of any state is singular.
    pub fn forward_dynamics_derivatives(
        &mut self,
        q: &[f64],
        v: &[f64],
        tau: &mut [f64],
        vdot: &mut [f64],
        out: ForwardDerivatives<'_>,
    ) -> Result<(), DynamicsError> {
        let ForwardDerivatives { dvdot_dq: a, dvdot_dv: b, dvdot_dtau: c } = out;
        both!(self, self.count(q), [q, v], [tau, vdot, a, b, c], |tree, w, i, o| {
            let [tau, vdot, dvdot_dq, dvdot_dv, dvdot_dtau] = o else { unreachable!() };
            w.batch.kinematics(tree, &i[0], &i[1]);
            let Worker { batch, derivatives, .. } = w;
            let d = derivatives.get_or_insert_with(|| Derivatives::new(tree));
            let out = ForwardDerivatives { dvdot_dq, dvdot_dv, dvdot_dtau };
            d.forward_dynamics_batch(tree, batch, &i[1], tau, vdot, out)
        })
    }
}
