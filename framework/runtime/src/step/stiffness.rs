//! Check for a step that is too long for fast decays or oscillations, from the linearized system at the start of a run.
//!
//! ```text
//! J = ∂ẋ/∂x               by differences to both sides; where they differ, the smaller one or nothing
//! A(h)                    what a step makes of a deviation: explicit methods Σ of powers of h J by their
//!                         coefficients, semi-implicit Euler (1 + h J_positions)(1 + h J_others)
//! ρ(A) = lim ‖Aⁿ‖^(1/n)   growth in a step, n = 2¹⁶ by squaring
//! too long                ρ(A(h)) > 1.001 ρ(A(h/m))ᵐ, m steps so short that ‖h/m J‖ < 1/4: what the system does
//! ```
//! Forces that begin later, such as a contact that does not yet press, are not included; sampled controllers are held
//! (`sampled.rs` examines them). Adaptive methods find their step themselves. The cost is cubic in the number of states;
//! a simulation with more than [`STATES_MAX`] states is not examined.
#![allow(non_snake_case)]
use super::simulation::Simulation;
use crate::author::value::{Fault, Origin};
use crate::author::variable::Place;
use crate::plan::compiled::Plan;
use linkwork_integrate::{Method, System};
use linkwork_spatial::nalgebra::DMatrix;

/// Number of states beyond which the analysis would take too long.
pub const STATES_MAX: usize = 400;
/// Growth in a step, relative to that of the system, that counts as round-off.
const SLACK: f64 = 1.001;

/// Returns the number with the smaller magnitude if both have the same sign, or else 0.
fn cautious(a: f64, b: f64) -> f64 {
    if !(a * b > 0.0) {
        0.0
    } else if a.abs() < b.abs() {
        a
    } else {
        b
    }
}

/// Returns the growth of a small deviation over a step of h (s).
fn step_map(plan: &Plan, J: &DMatrix<f64>, h: f64) -> Option<DMatrix<f64>> {
    let n = J.nrows();
    let one = DMatrix::identity(n, n);
    match &plan.integration.method {
        Method::Rosenbrock(_) => None,
        Method::SemiImplicitEuler => {
            let (mut first, mut second) = (J * h, J * h);
            for i in 0..n {
                let moved = plan.positions.iter().any(|p| p.contains(&i));
                if moved { first.row_mut(i).fill(0.0) } else { second.row_mut(i).fill(0.0) }
            }
            Some((&one + second) * (one + first))
        }
        Method::Explicit(table) => {
            // The stability function of a Runge-Kutta method with z = J h: gᵢ = 1 + z Σ aᵢⱼ gⱼ, R =
            // 1 + z Σ bᵢ gᵢ.
            let z = J * h;
            let sum = |weights: &[f64], g: &[DMatrix<f64>]| {
                let zero = DMatrix::zeros(n, n);
                weights.iter().zip(g).fold(zero, |s, (w, g)| s + g * *w)
            };
            let mut g: Vec<DMatrix<f64>> = Vec::with_capacity(table.stages);
            for row in table.a.iter().take(table.stages) {
                let next = &one + &z * sum(row, &g);
                g.push(next);
            }
            Some(one + z * sum(table.b, &g))
        }
    }
}

/// Spectral radius of a matrix, and of a high power of it, normed, the diagonal: the share of each state in what
/// grows most, which no choice of units changes.
pub(super) fn growth(mut A: DMatrix<f64>) -> Option<(f64, Vec<f64>)> {
    let (mut log, mut power) = (0.0, 1.0);
    for _ in 0..16 {
        let norm = A.norm();
        if !norm.is_finite() || norm == 0.0 {
            return None;
        }
        A /= norm;
        log += norm.ln() / power;
        A = &A * &A;
        power *= 2.0;
    }
    let norm = A.norm();
    if !(norm > 0.0) {
        return None;
    }
    let shares = A.diagonal().iter().map(|v| v.abs()).collect();
    Some(((log + norm.ln() / power).exp(), shares))
}

impl Simulation {
    /// Returns the reason for which the step of a fixed-step method is too long for the system in its present state, with a sufficiently short step;
    /// `None` if it is not too long or steps are adaptive. Call it before the first step of a run.
    pub fn stiffness(&mut self) -> Option<Fault> {
        let plan = self.plan.clone();
        let (n, h) = (plan.sizes.x, plan.step.seconds());
        if plan.integration.control.is_some() || plan.derivs.is_empty() || n > STATES_MAX {
            return None;
        }
        let J = self.jacobian()?;
        // Growth rate of the system itself (1/s), from a step that is short enough to be accurate.
        let short_step = h.min(0.25 / J.norm().max(1e-300));
        let own = growth(step_map(&plan, &J, short_step)?)?.0.ln() / short_step;
        let excess = |h: f64| {
            let (by, shares) = growth(step_map(&plan, &J, h)?)?;
            (by > SLACK * (own.max(0.0) * h).exp()).then_some((by, shares))
        };
        let (by, shares) = excess(h)?;
        let (mut low, mut high) = (0.0, h);
        for _ in 0..20 {
            let middle = 0.5 * (low + high);
            if excess(middle).is_some() { high = middle } else { low = middle }
        }
        if low == 0.0 {
            return None;
        }
        let lane = (0..n).max_by(|a, b| shares[*a].total_cmp(&shares[*b]))?;
        let (path, _) = plan.lanes.iter().find(|(_, v)| v.place == Place::X(lane as u32))?;
        let has = |p: &&crate::plan::compiled::PartPlan| {
            (p.wiring.x..p.wiring.x + p.lanes().x).contains(&lane)
        };
        let origin = plan.parts.iter().find(has).map_or(Origin::NONE, |p| p.origin);
        let fact = format!(
            "the step of {} s is too long: errors of `{path}` grow by a factor of {by:.3} in each step",
            short(h)
        );
        let help = format!(
            "write `step: \"{} s\"` or less, or an adaptive integrator; for stiff parts `rodas4p`",
            short(round_down(0.8 * low))
        );
        Some(Fault::new(origin, fact).help(help))
    }

    /// Computes ∂ẋ/∂x with the smaller slope at jumps; `None` if it is not finite.
    fn jacobian(&mut self) -> Option<DMatrix<f64>> {
        let plan = self.plan.clone();
        let n = plan.sizes.x;
        let mut x = self.state.x.clone();
        let mut J = DMatrix::zeros(n, n);
        self.beside(|system, t| {
            let [mut f0, mut f1, mut f2] = [(); 3].map(|()| vec![0.0; n]);
            system.derivatives(t, &x, &mut f0)?;
            for k in 0..n {
                let (old, step) = (x[k], 1e-7 * (1.0 + x[k].abs()));
                x[k] = old + step;
                system.derivatives(t, &x, &mut f1)?;
                x[k] = old - step;
                system.derivatives(t, &x, &mut f2)?;
                x[k] = old;
                for i in 0..n {
                    J[(i, k)] = cautious((f1[i] - f0[i]) / step, (f0[i] - f2[i]) / step);
                }
            }
            Ok(())
        })
        .ok()?;
        J.iter().all(|v| v.is_finite()).then_some(J)
    }
}

/// Two digits, rounded down.
pub(super) fn round_down(x: f64) -> f64 {
    let digit = 10f64.powf(x.log10().floor() - 1.0);
    (x / digit).floor() * digit
}

/// Formats a time for messages.
fn short(x: f64) -> String {
    let text = format!("{x:.6}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if x >= 1e-4 { text.to_string() } else { format!("{x:.1e}") }
}
