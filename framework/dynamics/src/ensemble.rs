//! Many states of one mechanism at once: lanes and threads.
//!
//! States lie one after another in plain arrays (state 0's numbers, state 1's, …), as a table with a
//! row for each. They are dealt to threads in equal runs, and each thread works on as many as a
//! lane holds. Every state gets the bits that it would get alone in the same lane, whatever the
//! number of threads.

use crate::error::DynamicsError;
use crate::lane::Lane;
use crate::tree::Tree;
use crate::{Batch, Compliance, Derivatives, ForwardDerivatives};
use linkwork_multibody::NodeId;
use linkwork_spatial::Vec3;
use rayon::prelude::*;
use std::sync::Arc;
use wide::{f64x4, f64x8};

/// The algorithms on tables of states. Memory is made at first use of each algorithm and kept.
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

/// One thread's memory.
#[derive(Debug)]
struct Worker<L: Lane> {
    batch: Batch<L>,
    derivatives: Option<Derivatives<L>>,
    compliance: Option<(Vec<NodeId>, Compliance<L>)>,
    inputs: Vec<Vec<L>>,
    outputs: Vec<Vec<L>>,
}

/// Up to this many links eight lanes pay where the processor was told to have them.
const EIGHT_LANES: usize = 20;

/// What one call does to one batch: inputs and outputs by number.
type Step<'a, L> = &'a (
        dyn Fn(&Tree, &mut Worker<L>, &[Vec<L>], &mut [Vec<L>]) -> Result<(), DynamicsError> + Sync
    );

impl Ensemble {
    /// For `tree`, on `threads` threads (0: as many as there are processors).
    ///
    /// # Panics
    /// If the system refuses to make threads.
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

    /// Sets the acceleration of free fall (m/s², world axes) for every state.
    pub fn set_uniform_gravity(&mut self, g: Vec3) {
        match &mut self.workers {
            Workers::Four(w) => w.iter_mut().for_each(|w| w.batch.set_uniform_gravity(g)),
            Workers::Eight(w) => w.iter_mut().for_each(|w| w.batch.set_uniform_gravity(g)),
        }
    }

    /// Runs a step over all states. `inputs` and `outputs` are tables of `count` rows each; rows of
    /// outputs as long as β are read first, so that what is given here and found there may be one
    /// table.
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
                "table {i} has {table} numbers, which is no multiple of {count} states"
            );
        }
        let (tree, pool) = (&*self.tree, self.pool.as_ref());
        match &mut self.workers {
            Workers::Four(w) => deal(tree, pool, w, count, inputs, outputs, four),
            Workers::Eight(w) => deal(tree, pool, w, count, inputs, outputs, eight),
        }
    }
}

/// Gives each worker its run of states.
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
    // Whole batches, as evenly as they go.
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
        // The first error in the order of states, whichever thread was first.
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

    /// States `0..count` of these tables, a lane's width at a time; the last batch repeats its last
    /// state to be full.
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
                // Forces and accelerations are given or found; matrices are only found.
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

/// Some rows of a table side by side.
fn pack<L: Lane>(to: &mut Vec<L>, from: &[f64], count: usize, state: impl Fn(usize) -> usize) {
    let width = from.len() / count;
    to.resize(width, L::default());
    for (i, to) in to.iter_mut().enumerate() {
        *to = L::gather(|l| from[state(l) * width + i]);
    }
}

/// Writes a step for both lane widths.
macro_rules! both {
    ($self:ident, $count:expr, [$($input:expr),*], [$($output:expr),*], $step:expr) => {
        $self.run($count, &[$($input),*], &mut [$($output),*], &$step, &$step)
    };
}

impl Ensemble {
    fn count(&self, q: &[f64]) -> usize {
        q.len().checked_div(self.tree.nq()).unwrap_or(0)
    }

    /// As [`forward_dynamics`](crate::forward_dynamics) for each row: `q` (n × nq), the others
    /// (n × nv).
    ///
    /// # Errors
    /// [`DynamicsError::Singular`] if any state is.
    ///
    /// # Panics
    /// If tables differ in their number of rows; so do the others.
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

    /// As [`inverse_dynamics`](crate::inverse_dynamics) for each row.
    pub fn inverse_dynamics(&mut self, q: &[f64], v: &[f64], vdot: &[f64], tau: &mut [f64]) {
        let run = both!(self, self.count(q), [q, v, vdot], [tau], |tree, w, i, o| {
            w.batch.inverse_dynamics(tree, &i[0], &i[1], &i[2], &mut o[0]);
            Ok(())
        });
        debug_assert!(run.is_ok());
    }

    /// As [`mass_matrix`](crate::mass_matrix) for each row: `out` (n × nv·nv).
    pub fn mass_matrix(&mut self, q: &[f64], out: &mut [f64]) {
        let run = both!(self, self.count(q), [q], [out], |tree, w, i, o| {
            w.batch.poses(tree, &i[0]);
            w.batch.mass_matrix(tree, &mut o[0]);
            Ok(())
        });
        debug_assert!(run.is_ok());
    }

    /// As [`inverse_mass_matrix`](crate::inverse_mass_matrix) for each row: `out` (n × nv·nv).
    ///
    /// # Errors
    /// [`DynamicsError::Singular`] if any state is.
    pub fn inverse_mass_matrix(&mut self, q: &[f64], out: &mut [f64]) -> Result<(), DynamicsError> {
        both!(self, self.count(q), [q], [out], |tree, w, i, o| {
            w.batch.poses(tree, &i[0]);
            w.batch.inverse_mass_matrix(tree, &mut o[0])
        })
    }

    /// Position (3, m) of a node for each row, world axes: `out` (n × 3).
    pub fn node_position(&mut self, q: &[f64], node: NodeId, out: &mut [f64]) {
        let run = both!(self, self.count(q), [q], [out], |tree, w, i, o| {
            w.batch.poses(tree, &i[0]);
            o[0].copy_from_slice(&w.batch.node_position(tree, node));
            Ok(())
        });
        debug_assert!(run.is_ok());
    }

    /// As [`node_jacobian`](crate::node_jacobian) for each row: `out` (n × 6·nv).
    pub fn node_jacobian(&mut self, q: &[f64], node: NodeId, out: &mut [f64]) {
        let run = both!(self, self.count(q), [q], [out], |tree, w, i, o| {
            w.batch.node_jacobian_at(tree, &i[0], node, &mut o[0]);
            Ok(())
        });
        debug_assert!(run.is_ok());
    }

    /// As [`centroidal_matrix`](crate::centroidal_matrix) for each row: `out` (n × 6·nv).
    pub fn centroidal_matrix(&mut self, q: &[f64], out: &mut [f64]) {
        let run = both!(self, self.count(q), [q], [out], |tree, w, i, o| {
            w.batch.poses(tree, &i[0]);
            w.batch.centroidal_matrix(tree, &mut o[0]);
            Ok(())
        });
        debug_assert!(run.is_ok());
    }

    /// As [`Compliance::compute`] for each row: `out` (n × size²).
    ///
    /// # Errors
    /// [`DynamicsError::Singular`] if any state is.
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

    /// As [`Derivatives::inverse_dynamics`] for each row: `dtau_dq`, `dtau_dv` (n × nv·nv).
    ///
    /// # Panics
    /// If a body is flexible: [`Tree::check_rigid`] asks first.
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

    /// As [`Derivatives::forward_dynamics`] for each row.
    ///
    /// # Errors
    /// [`DynamicsError::Singular`] if any state is.
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
