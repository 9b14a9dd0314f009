//! Loops and couplings of a `Mechanism`: description, closure, constrained dynamics.
use crate::array::{Input, checked1, vector};
use crate::core::{Core, lock};
use crate::error::{refuse, refuse_with};
use crate::mechanism::{Mechanism, choice};
use linkwork_dynamics::kinematics;
use linkwork_multibody::{ConstraintId, LoopMotion};
use linkwork_solvers::{
    ConstrainedSolver, ConstraintMethod, FullyAugmentedSolver, Projector, Redundant, Report,
    SolverError,
};
use pyo3::prelude::*;
use pyo3::types::PyDict;

mod reports;
pub use reports::{ConstrainedMotion, Constraint, Rank};

/// Treatment of constraints in the equations.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Solver {
    /// Tree-augmented, constraint embedding, or both.
    Tree(ConstraintMethod),
    /// Fully augmented: every hinge and every constraint has multipliers.
    Full,
}

const SOLVERS: [(&str, Solver); 4] = [
    ("auto", Solver::Tree(ConstraintMethod::Auto)),
    ("embed", Solver::Tree(ConstraintMethod::Embed)),
    ("augment", Solver::Tree(ConstraintMethod::Augment)),
    ("full", Solver::Full),
];

/// Largest closure error of loops and couplings, rad or m, with which a simulation may begin and collision queries are answered.
pub const CLOSED: f64 = 1e-6;

/// Memory of the solvers of constraints.
pub struct Constrained {
    /// Choice of constraints that are embedded, and of those with multipliers.
    constraint_method: ConstraintMethod,
    solver: ConstrainedSolver,
    projector: Projector,
}

impl Core {
    /// Runs `f` with memory for constraint solvers.
    pub fn with_constrained<R>(
        &self,
        constraint_method: ConstraintMethod,
        f: impl FnOnce(&mut Constrained) -> R,
    ) -> R {
        let spare = {
            let mut all = lock(&self.constrained);
            let same = all.iter().position(|c| c.constraint_method == constraint_method);
            same.map(|k| all.swap_remove(k))
        };
        let mut memory = spare.unwrap_or_else(|| Constrained {
            constraint_method,
            solver: ConstrainedSolver::new(&self.tree, |_| constraint_method),
            projector: Projector::new(&self.tree),
        });
        let result = f(&mut memory);
        lock(&self.constrained).push(memory);
        result
    }

    /// Returns whether there is a loop or a coupling.
    pub fn is_constrained(&self) -> bool {
        self.mbs.constraints().next().is_some()
    }

    /// Returns the closure error of each loop and coupling, rad or m.
    pub fn errors(&self, q: &[f64], motions: &[LoopMotion]) -> Vec<(ConstraintId, f64)> {
        self.with_constrained(ConstraintMethod::Augment, |c| {
            let mut ws = self.workspace();
            kinematics(&self.tree, &mut ws, q, &vec![0.0; self.nv()]);
            let error = |id| (id, c.solver.error(&self.tree, &ws, id, motions, q));
            let errors = self.mbs.constraints().map(error).collect();
            self.give_back(ws);
            errors
        })
    }
}

impl Constrained {
    /// Computes the constrained accelerations. The kinematics must be up to date.
    pub fn forward(
        &mut self,
        core: &Core,
        ws: &mut linkwork_dynamics::Workspace,
        state: (&[f64], &[f64]),
        tau: &mut [f64],
        vdot: &mut [f64],
    ) -> Result<Report, SolverError> {
        self.solver.forward_given_kinematics(&core.tree, ws, state, &[], tau, vdot)
    }

    /// Projects q, then v, onto the constraints.
    pub fn close(
        &mut self,
        core: &Core,
        motions: &[LoopMotion],
        q: &mut [f64],
        v: Option<&mut [f64]>,
    ) -> Result<(), linkwork_solvers::ProjectionError> {
        let mut ws = core.workspace();
        let (tree, solver) = (&core.tree, &mut self.solver);
        let mut result = self.projector.positions(tree, &mut ws, solver, motions, q).map(|_| ());
        if let (Ok(()), Some(v)) = (&result, v) {
            result = self.projector.rates(tree, &mut ws, solver, motions, q, v).map(|_| ());
        }
        core.give_back(ws);
        result
    }
}

impl Mechanism {
    /// Reads positions, rates and accelerations of the prescribed subhinges of loops.
    pub fn motions(&self, given: Option<&Bound<'_, PyAny>>) -> PyResult<Vec<LoopMotion>> {
        let n = self.core.mbs.motions();
        let Some(given) = given else {
            return match n {
                0 => Ok(Vec::new()),
                _ => Err(refuse_with(
                    format!(
                        "{n} motions across loops are prescribed, but `loop_motions` is missing"
                    ),
                    format!("give loop_motions ({n}, 3): position, rate, acceleration of each"),
                )),
            };
        };
        let input = Input::read(given, "loop_motions")?;
        if *input.shape() != [n, 3] {
            let fact = format!("`loop_motions` has the shape {:?}", input.shape());
            return Err(refuse_with(fact, format!("give ({n}, 3)")));
        }
        let rows = input.slice().as_chunks::<3>().0;
        let motion =
            |[position, rate, acceleration]: [f64; 3]| LoopMotion { position, rate, acceleration };
        Ok(rows.iter().map(|row| motion(*row)).collect())
    }

    fn names(&self, all: &[Redundant]) -> Vec<(String, usize)> {
        let name =
            |r: &Redundant| (self.core.mbs.constraint_name(r.constraint).to_string(), r.rows);
        all.iter().map(name).collect()
    }
}

#[pymethods]
impl Mechanism {
    /// The loops, then the couplings, each kind by name.
    ///
    /// Examples
    /// --------
    /// >>> arm.constraints
    /// []
    #[getter]
    fn constraints(&self) -> Vec<Constraint> {
        let mbs = &self.core.mbs;
        let name = |b: Option<linkwork_multibody::BodyId>| {
            b.map_or("world", |b| mbs.get(b).name()).to_string()
        };
        let one = |id: ConstraintId| {
            let (kind, bodies, motions) = match id {
                ConstraintId::Loop(i) => {
                    let l = &mbs.loops()[i as usize];
                    ("loop", vec![name(l.a.body), name(l.b.body)], l.motions.len())
                }
                ConstraintId::Coupling(i) => {
                    let bodies = mbs.couplings()[i as usize].bodies.iter();
                    ("coupling", bodies.map(|b| name(Some(*b))).collect(), 0)
                }
            };
            let (name, rows) = (mbs.constraint_name(id).to_string(), mbs.rows(id));
            Constraint { name, kind, bodies, rows, motions }
        };
        mbs.constraints().map(one).collect()
    }

    /// Compute the closure error of each loop and coupling.
    ///
    /// Parameters
    /// ----------
    /// q : array_like, shape (nq,)
    ///     Configuration, rad and m.
    /// loop_motions : array_like, shape (m, 3), optional
    ///     Position, rate and acceleration of each prescribed motion across a loop. Required if there are any.
    ///
    /// Returns
    /// -------
    /// dict of str to float
    ///     Largest error of each constraint's rows, rad or m.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If an array has a wrong shape or contains NaN.
    ///
    /// Examples
    /// --------
    /// >>> arm.constraint_errors(q)
    /// {}
    #[pyo3(signature = (q, *, loop_motions=None))]
    fn constraint_errors<'py>(
        &self,
        q: &Bound<'py, PyAny>,
        loop_motions: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let (py, q) = (q.py(), self.core.configuration(q, "q")?);
        let motions = self.motions(loop_motions)?;
        let out = PyDict::new(py);
        for (id, error) in self.core.errors(q.slice(), &motions) {
            out.set_item(self.core.mbs.constraint_name(id), error)?;
        }
        Ok(out)
    }

    /// Compute the nearest configuration that closes all loops and couplings to 1e-12 rad or m.
    ///
    /// Newton's method with the smallest motion in the metric of the mass matrix. Prescribed coordinates do not change.
    ///
    /// Parameters
    /// ----------
    /// q : array_like, shape (nq,)
    ///     Configuration, rad and m.
    /// v : array_like, shape (nv,), optional
    ///     Rates, rad/s and m/s. If passed, the nearest rates that keep the constraints closed are computed, too.
    /// loop_motions : array_like, shape (m, 3), optional
    ///     As in `constraint_errors`.
    ///
    /// Returns
    /// -------
    /// ndarray, shape (nq,), or tuple of ndarray
    ///     The configuration, or (q, v) if you passed v.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If a constraint cannot be closed. The message names it.
    ///
    /// Examples
    /// --------
    /// >>> arm.close(q).tolist()
    /// [0.3, -0.7]
    #[pyo3(signature = (q, v=None, *, loop_motions=None))]
    fn close<'py>(
        &self,
        q: &Bound<'py, PyAny>,
        v: Option<&Bound<'py, PyAny>>,
        loop_motions: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let (py, core) = (q.py(), &*self.core);
        let motions = self.motions(loop_motions)?;
        let mut q = core.configuration(q, "q")?.slice().to_vec();
        core.mbs.normalize(&mut q);
        let mut v = match v {
            Some(v) => Some(vector(v, core.nv(), "v")?.slice().to_vec()),
            None => None,
        };
        core.with_constrained(ConstraintMethod::Augment, |c| {
            c.close(core, &motions, &mut q, v.as_deref_mut())
        })
        .map_err(refuse)?;
        let q = checked1(py, q)?;
        match v {
            None => Ok(q.into_any()),
            Some(v) => Ok((q, checked1(py, v)?).into_pyobject(py)?.into_any()),
        }
    }

    /// Compute the accelerations that generalized forces produce, with all loops and couplings.
    ///
    /// Parameters
    /// ----------
    /// q : array_like, shape (nq,)
    ///     Configuration, rad and m. It must satisfy the constraints (see `close`).
    /// v : array_like, shape (nv,)
    ///     Rates, rad/s and m/s. They must keep the constraints closed.
    /// tau : array_like, shape (nv,)
    ///     Generalized forces, N m and N.
    /// prescribed : array_like, shape (nv,), optional
    ///     As in `forward_dynamics`.
    /// wrenches : dict of str to array_like, shape (6,), optional
    ///     As in `inverse_dynamics`.
    /// solver : {"auto", "embed", "augment", "full"}
    ///     "auto" embeds small loops and uses multipliers for the other constraints. "embed" embeds all of them. "augment" uses multipliers for
    ///     all of them. "full" uses multipliers for the hinges, too.
    /// loop_motions : array_like, shape (m, 3), optional
    ///     As in `constraint_errors`.
    ///
    /// Returns
    /// -------
    /// ConstrainedMotion
    ///     Accelerations and constraint forces.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If a free coordinate moves no inertia.
    ///
    /// Examples
    /// --------
    /// >>> motion = arm.constrained_dynamics(q, v, [0, 0])
    /// >>> bool(np.allclose(motion.vdot, arm.forward_dynamics(q, v, [0, 0])))
    /// True
    #[pyo3(signature = (q, v, tau, *, solver="auto", prescribed=None, wrenches=None, loop_motions=None))]
    fn constrained_dynamics<'py>(
        &self,
        py: Python<'py>,
        q: &Bound<'py, PyAny>,
        v: &Bound<'py, PyAny>,
        tau: &Bound<'py, PyAny>,
        solver: &str,
        prescribed: Option<&Bound<'py, PyAny>>,
        wrenches: Option<&Bound<'py, PyDict>>,
        loop_motions: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<ConstrainedMotion> {
        let (core, nv) = (&*self.core, self.core.nv());
        let solver = choice("solver", solver, &SOLVERS)?;
        let (q, v) = (core.configuration(q, "q")?, vector(v, nv, "v")?);
        let state = (q.slice(), v.slice());
        let mut tau = vector(tau, nv, "tau")?.slice().to_vec();
        let mut vdot = match prescribed {
            Some(given) => vector(given, nv, "prescribed")?.slice().to_vec(),
            None => vec![0.0; nv],
        };
        let motions = self.motions(loop_motions)?;
        let wrenches = core.wrenches(wrenches)?;
        let solved = py.detach(|| {
            let mut ws = core.workspace();
            core.load(&mut ws, state.0, state.1, &wrenches);
            let tree = &core.tree;
            let ids = core.mbs.constraints();
            let solved = match solver {
                Solver::Tree(constraint_method) => core.with_constrained(constraint_method, |c| {
                    let s = &mut c.solver;
                    let report = s
                        .forward_given_kinematics(
                            tree, &mut ws, state, &motions, &mut tau, &mut vdot,
                        )
                        .map_err(|e| e.to_string())?;
                    let forces = ids.map(|id| s.forces(tree, id).to_vec()).collect();
                    Ok((report, forces, s.redundant(tree)))
                }),
                Solver::Full => {
                    FullyAugmentedSolver::new(tree).map_err(|e| e.to_string()).and_then(|mut s| {
                        let report = s
                            .forward_given_kinematics(
                                tree, &ws, state, &motions, &mut tau, &mut vdot,
                            )
                            .map_err(|e| e.to_string())?;
                        let forces = ids.map(|id| s.forces(tree, id).to_vec()).collect();
                        Ok((report, forces, s.redundant(tree)))
                    })
                }
            };
            core.give_back(ws);
            solved
        });
        let (report, forces, redundant): (Report, Vec<Vec<f64>>, Vec<Redundant>) =
            solved.map_err(refuse)?;
        let names = core.mbs.constraints().map(|id| core.mbs.constraint_name(id).to_string());
        let forces = names.zip(forces).collect();
        Ok(ConstrainedMotion { vdot, tau, forces, redundant: self.names(&redundant), report })
    }

    /// Compute the degrees of freedom that remain with all loops and couplings.
    ///
    /// The rank depends on the configuration: it can be lower where the links of a linkage are aligned.
    ///
    /// Parameters
    /// ----------
    /// q : array_like, shape (nq,)
    ///     Configuration, rad and m.
    /// loop_motions : array_like, shape (m, 3), optional
    ///     As in `constraint_errors`.
    ///
    /// Returns
    /// -------
    /// Rank
    ///     Rank and mobility.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If an array has a wrong shape or contains NaN.
    ///
    /// Examples
    /// --------
    /// >>> arm.constraint_rank(q)
    /// Rank(free=2, rows=0, rank=0, mobility=2)
    #[pyo3(signature = (q, *, loop_motions=None))]
    fn constraint_rank(
        &self,
        q: &Bound<'_, PyAny>,
        loop_motions: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Rank> {
        let core = &*self.core;
        let q = core.configuration(q, "q")?;
        let motions = self.motions(loop_motions)?;
        let still = vec![0.0; core.nv()];
        let (report, redundant) = core
            .with_constrained(ConstraintMethod::Augment, |c| {
                let (mut tau, mut vdot) = (still.clone(), still.clone());
                let (mut ws, state) = (core.workspace(), (q.slice(), &still[..]));
                let report =
                    c.solver.forward(&core.tree, &mut ws, state, &motions, &mut tau, &mut vdot);
                core.give_back(ws);
                report.map(|report| (report, c.solver.redundant(&core.tree)))
            })
            .map_err(refuse)?;
        let free = core.mbs.prescribed().iter().filter(|p| !**p).count();
        Ok(Rank { free, rows: report.rows, rank: report.rank, redundant: self.names(&redundant) })
    }
}

/// Returns an error if a simulation cannot begin at q, v: a loop is open, the rates open it, or a motion across it is prescribed.
pub fn may_begin(core: &Core, q: &[f64], v: &[f64]) -> PyResult<()> {
    if core.mbs.motions() > 0 {
        let fact = "a motion across a loop is prescribed";
        return Err(refuse_with(fact, "simulate it with linkwork.Simulation"));
    }
    let errors = core.errors(q, &[]);
    let Some((worst, error)) = errors.into_iter().max_by(|a, b| a.1.total_cmp(&b.1)) else {
        return Ok(());
    };
    let help = "start from `q, v = mechanism.close(q, v)`";
    if !(error <= CLOSED) {
        let name = core.mbs.constraint_name(worst);
        let fact =
            format!("`{name}` is not closed at the start: closure error {error:.3e} (rad or m)");
        return Err(refuse_with(fact, help));
    }
    let (mut there, mut rates) = (q.to_vec(), v.to_vec());
    core.with_constrained(ConstraintMethod::Augment, |c| {
        c.close(core, &[], &mut there, Some(&mut rates))
    })
    .map_err(refuse)?;
    let off = v.iter().zip(&rates).map(|(a, b)| (a - b).abs()).fold(0.0_f64, f64::max);
    if !(off <= CLOSED * v.iter().fold(1.0_f64, |most, v| most.max(v.abs()))) {
        let fact =
            format!("the rates at the start violate the constraints by {off:.3e} rad/s or m/s");
        return Err(refuse_with(fact, help));
    }
    Ok(())
}
