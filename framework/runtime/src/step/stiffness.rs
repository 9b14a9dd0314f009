//! A step that is too long for what decays or swings fast, found from the whole system at its start.
//!
//! ```text
//! J = ∂ẋ/∂x             by differences to both sides; where they differ, the smaller one or nothing
//! explicit methods      |R(h λ)| ≤ 1, R(z) = 1 + z Σ bᵢ gᵢ, gᵢ = 1 + z Σ aᵢⱼ gⱼ
//! semi-implicit Euler   h² |λ|² + 4 h |Re λ| ≤ 4, for a real λ h |λ| ≤ 2
//! ```
//! for all eigenvalues λ of J that decay or swing. What is not yet there at the start, a contact that does not
//! yet press, is not seen; sampled controllers are not, either. Adaptive methods find their step themselves.
//! Cubic in the number of states; beyond [`STATES_MAX`] nothing is asked.
#![allow(non_snake_case)]
use super::evaluate::Running;
use super::{Simulation, State};
use crate::block::{Evaluation, Now};
use crate::plan::Place;
use crate::value::{Fault, Origin};
use linkwork_integrate::{Method, System};
use linkwork_spatial::nalgebra::{Complex, DMatrix, DVector, Schur};

/// States beyond which eigenvalues take longer than they are worth.
pub const STATES_MAX: usize = 400;
/// Iterations of the QR algorithm, beyond which nothing is said.
const ITERATIONS_MAX: usize = 20_000;
/// An eigenvalue grows by itself when its real part is more than this of its size.
const GROWS: f64 = 1e-3;
/// Growth in a step that is rounding, or the slow growth of methods on undamped swings.
const SLACK: f64 = 1e-3;

/// |R(z)| less 1 for a method, positive where a step of it amplifies.
fn amplifies(method: &Method, z: Complex<f64>) -> f64 {
    match method {
        Method::Rosenbrock(_) => -1.0,
        Method::SemiImplicitEuler if z.im == 0.0 => z.re.abs() - 2.0,
        Method::SemiImplicitEuler => z.norm_sqr() + 4.0 * z.re.abs() - 4.0,
        Method::Explicit(table) => {
            let one = Complex::new(1.0, 0.0);
            let mut g: Vec<Complex<f64>> = Vec::with_capacity(table.stages);
            for row in table.a.iter().take(table.stages) {
                let sum: Complex<f64> = row.iter().zip(&g).map(|(a, g)| g * *a).sum();
                g.push(one + z * sum);
            }
            let sum: Complex<f64> = table.b.iter().zip(&g).map(|(b, g)| g * *b).sum();
            (one + z * sum).norm() - 1.0
        }
    }
}

/// The smaller of two numbers of one sign; of two signs nothing.
fn cautious(a: f64, b: f64) -> f64 {
    if !(a * b > 0.0) {
        0.0
    } else if a.abs() < b.abs() {
        a
    } else {
        b
    }
}

impl Simulation {
    /// Why the step of a fixed method is too long for the system as it stands, with the step that would
    /// do; nothing when it is not, or when steps are adaptive. Asked before the first step of a run.
    pub fn stiffness(&mut self) -> Option<Fault> {
        let plan = self.plan.clone();
        let (n, h) = (plan.sizes.x, plan.step.seconds());
        if plan.integration.control.is_some() || plan.derivs.is_empty() || n > STATES_MAX {
            return None;
        }
        let method = &plan.integration.method;
        let J = self.jacobian()?;
        let decays = |l: &Complex<f64>| l.norm() > 0.0 && l.re <= GROWS * l.norm();
        let schur = Schur::try_new(J.clone(), f64::EPSILON, ITERATIONS_MAX)?;
        let all: Vec<Complex<f64>> =
            schur.complex_eigenvalues().iter().copied().filter(decays).collect();
        let worst = |h: f64| {
            let by = all.iter().map(|l| (amplifies(method, l * h), *l));
            by.max_by(|a, b| a.0.total_cmp(&b.0)).filter(|w| w.0 > SLACK)
        };
        let (_, mode) = worst(h)?;
        let (mut low, mut high) = (0.0, h);
        for _ in 0..40 {
            let middle = 0.5 * (low + high);
            if worst(middle).is_some() { high = middle } else { low = middle }
        }
        if low == 0.0 {
            return None;
        }
        let lane = participant(&J, mode)?;
        let (path, _) = plan.lanes.iter().find(|(_, v)| v.place == Place::X(lane as u32))?;
        let has =
            |p: &&crate::plan::PartPlan| (p.wiring.x..p.wiring.x + p.lanes().x).contains(&lane);
        let origin = plan.parts.iter().find(has).map_or(Origin::NONE, |p| p.origin);
        let what = match mode.im.abs() > mode.re.abs() {
            true => format!("swings at {:.3} Hz", mode.norm() / std::f64::consts::TAU),
            false => format!("decays in {:.3e} s", 1.0 / mode.re.abs()),
        };
        let fact = format!("the step of {} s is too long: `{path}` {what}", short(h));
        let help = format!(
            "write `step: \"{} s\"` or less, or an adaptive integrator; for stiff parts `rodas4p`",
            short(round_down(0.8 * low))
        );
        Some(Fault::new(origin, fact).help(help))
    }

    /// ∂ẋ/∂x, cautious where it jumps; `None` where it is not finite.
    fn jacobian(&mut self) -> Option<DMatrix<f64>> {
        let plan = self.plan.clone();
        let now = Now {
            t: self.time(),
            dt: plan.step.seconds(),
            tick: self.state.tick,
            evaluation: Evaluation::Stage,
            number: 0,
        };
        let t = now.t;
        let n = plan.sizes.x;
        let mut x = self.state.x.clone();
        // Signals are work space here: the run keeps its own.
        let mut sig = self.state.sig.clone();
        let Simulation { state, blocks, work, .. } = self;
        let State { d, .. } = state;
        let number = &mut work.number;
        let mut system = Running { plan: &plan, blocks, d, sig: &mut sig, now, number };
        let [mut f0, mut f1, mut f2] = [(); 3].map(|()| vec![0.0; n]);
        system.derivatives(t, &x, &mut f0).ok()?;
        let mut J = DMatrix::zeros(n, n);
        for k in 0..n {
            let (old, step) = (x[k], 1e-7 * (1.0 + x[k].abs()));
            x[k] = old + step;
            system.derivatives(t, &x, &mut f1).ok()?;
            x[k] = old - step;
            system.derivatives(t, &x, &mut f2).ok()?;
            x[k] = old;
            for i in 0..n {
                J[(i, k)] = cautious((f1[i] - f0[i]) / step, (f0[i] - f2[i]) / step);
            }
        }
        J.iter().all(|v| v.is_finite()).then_some(J)
    }
}

/// The state with the greatest share in a mode: |vᵢ wᵢ| of its right and left eigenvectors, which no choice of
/// units changes.
fn participant(J: &DMatrix<f64>, mode: Complex<f64>) -> Option<usize> {
    let n = J.nrows();
    let near = mode * (1.0 + 1e-7);
    let vector = |J: DMatrix<f64>| {
        let shifted = J.map(|v| Complex::new(v, 0.0)) - DMatrix::from_diagonal_element(n, n, near);
        let lu = shifted.lu();
        let mut v = DVector::from_fn(n, |i, _| Complex::new(1.0 + 0.1 * (i % 7) as f64, 0.3));
        for _ in 0..3 {
            v = lu.solve(&v)?;
            let norm = v.norm();
            v /= Complex::new(norm, 0.0);
        }
        Some(v)
    };
    let (v, w) = (vector(J.clone())?, vector(J.transpose())?);
    let share = |i: usize| v[i].norm() * w[i].norm();
    (0..n).max_by(|a, b| share(*a).total_cmp(&share(*b)))
}

/// Two digits, rounded down.
fn round_down(x: f64) -> f64 {
    let digit = 10f64.powf(x.log10().floor() - 1.0);
    (x / digit).floor() * digit
}

/// A time as one writes it.
fn short(x: f64) -> String {
    let text = format!("{x:.6}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if x >= 1e-4 { text.to_string() } else { format!("{x:.1e}") }
}
