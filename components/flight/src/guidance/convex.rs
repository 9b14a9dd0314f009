//! Fuel-optimal powered descent as a convex problem (lossless convexification, Açıkmeşe and Ploen; G-FOLD).
//! ```text
//! variables at each node: r, v, u = T/m, z = ln m, s (slack for ‖u‖)
//! v̇ = u + g    ż = −α s    α = 1/(I_sp g₀ cos φ)    ρ₁,₂ = throttle T_max cos φ       φ: cant of the engines
//! ‖u‖ ≤ s      ρ₁ e^(−z₀) (1 − δ + δ²/2) ≤ s ≤ ρ₂ e^(−z₀) (1 − δ)      δ = z − z₀,  z₀ = ln(m₀ − α ρ₂ t)
//! z₀ ≤ z ≤ ln(m₀ − α ρ₁ t)      z ≥ ln m_dry at the end
//! glide slope: ‖(r − r_T)_xy‖ tan γ ≤ (r − r_T)_z      pointing: u_z ≥ s cos θ
//! u and s are linear between nodes: r and v exactly, z by the trapezoid rule;  maximise z at the end
//! ```
//! The ground is flat with z up, and gravity is uniform. The time of flight is found by golden section over [`plan`].

use clarabel::algebra::CscMatrix;
use clarabel::solver::{
    DefaultSettingsBuilder, DefaultSolver, IPSolver, SolverStatus, SupportedConeT,
};
use linkwork_spatial::Vec3;

/// Residuals and relative gap of a solution that is accepted although the solver did not reach its tolerance of 1e-10.
const ALMOST: f64 = 1e-8;

/// Standard gravity, m/s².
const G0: f64 = 9.80665;
/// Variables of a node: r, v, u, z, s.
const PER_NODE: usize = 11;

/// A descent to plan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Descent {
    /// Gravity, m/s².
    pub gravity: Vec3,
    /// Mass at the start, kg.
    pub mass: f64,
    /// Mass without propellant, kg.
    pub dry: f64,
    /// Specific impulse, s.
    pub specific_impulse: f64,
    /// Thrust of all engines at full throttle, N.
    pub thrust: f64,
    /// Least and greatest throttle.
    pub throttle: [f64; 2],
    /// Angle of the engines from the thrust's direction, rad.
    pub cant: f64,
    /// Position and velocity at the start.
    pub start: [Vec3; 2],
    /// Position and velocity at the end.
    pub end: [Vec3; 2],
    /// Least elevation above the horizon, seen from the target, rad; 0: only not below the target.
    pub glide: f64,
    /// Greatest angle of the thrust to the vertical, rad; π: no limit.
    pub pointing: f64,
}

/// A node of a plan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Node {
    /// Time from the start, s.
    pub time: f64,
    /// Position, m.
    pub position: Vec3,
    /// Velocity, m/s.
    pub velocity: Vec3,
    /// Thrust over mass, m/s².
    pub thrust: Vec3,
    /// Mass, kg.
    pub mass: f64,
    /// s − ‖u‖: zero where the relaxation is exact, m/s².
    pub gap: f64,
}

/// Reason for which no plan was found.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum NoPlan {
    /// The descent cannot be flown in this time.
    #[error(
        "no trajectory meets the constraints in {time} s\n  help: allow more time, more thrust, a lower glide slope, or start elsewhere"
    )]
    Infeasible {
        /// The time of flight.
        time: f64,
    },
    /// The solver did not converge.
    #[error(
        "the solver stopped with {status} for {time} s\n  help: choose another number of nodes"
    )]
    Solver {
        /// The time of flight.
        time: f64,
        /// The status of the solver.
        status: String,
    },
    /// The input does not describe a valid descent.
    #[error("{what}\n  help: {help}")]
    Input {
        /// The fact.
        what: String,
        /// The remedy.
        help: &'static str,
    },
}

/// Rows A x + s = b of one cone after the other, scaled so that variables are near 1, because the solver's tolerances are absolute.
struct Rows {
    triplets: [Vec<usize>; 2],
    values: Vec<f64>,
    b: Vec<f64>,
    /// Unit of each variable of a node.
    unit: [f64; PER_NODE],
    /// Origin of z.
    z_from: f64,
}

impl Rows {
    /// A row: s = b − Σ a x.
    fn row(&mut self, terms: &[(usize, f64)], mut b: f64) {
        for (column, value) in terms {
            let what = column % PER_NODE;
            if what == 9 {
                b -= value * self.z_from;
            }
            self.triplets[0].push(self.b.len());
            self.triplets[1].push(*column);
            self.values.push(value * self.unit[what]);
        }
        self.b.push(b);
    }

    /// Divides the rows from `from` on by `unit`, so that they are near 1, too.
    fn over(&mut self, from: usize, unit: f64) {
        self.b[from..].iter_mut().for_each(|b| *b /= unit);
        let first = self.triplets[0].partition_point(|row| *row < from);
        self.values[first..].iter_mut().for_each(|v| *v /= unit);
    }
}

impl Descent {
    fn flow(&self) -> f64 {
        1.0 / (self.specific_impulse * G0 * self.cant.cos())
    }

    fn check(&self) -> Result<(), NoPlan> {
        let wrong = |what: &str, help| Err(NoPlan::Input { what: what.into(), help });
        let [low, high] = self.throttle;
        if !(self.dry > 0.0 && self.mass > self.dry) {
            return wrong("the mass is not above the dry mass", "write mass > dry > 0");
        }
        if !(low > 0.0 && high > low && self.thrust > 0.0 && self.specific_impulse > 0.0) {
            return wrong(
                "`thrust` and `throttle` do not define a range",
                "write 0 < low < high and a thrust",
            );
        }
        if !(self.glide >= 0.0 && self.glide < 1.57 && self.cant >= 0.0 && self.cant < 1.5) {
            return wrong(
                "the glide slope or the cant is not an acute angle",
                "write angles in rad",
            );
        }
        Ok(())
    }
}

/// Returns the plan of `nodes` intervals and duration `time` s with the greatest final mass.
///
/// # Errors
/// The input is not valid, no trajectory satisfies the limits, or the solver fails.
pub fn plan(d: &Descent, time: f64, nodes: usize) -> Result<Vec<Node>, NoPlan> {
    d.check()?;
    if !(time > 0.0) || nodes < 2 {
        let what = format!("{time} s in {nodes} intervals");
        return Err(NoPlan::Input {
            what,
            help: "choose a time above 0 and at least two intervals",
        });
    }
    let (alpha, dt) = (d.flow(), time / nodes as f64);
    let [low, high] = d.throttle.map(|t| t * d.thrust * d.cant.cos());
    let at = |k: usize, what: usize| k * PER_NODE + what;
    let (r, v, u, z, s) = (0, 3, 6, 9, 10);
    let length = (d.start[0] - d.end[0]).norm().max(1.0);
    let (speed, push) = (length / time, length / (time * time));
    let mut unit = [1.0; PER_NODE];
    unit[r..v].fill(length);
    unit[v..u].fill(speed);
    unit[u..z].fill(push);
    unit[s] = push;
    let z_from = d.mass.ln();
    let mut rows = Rows { triplets: Default::default(), values: vec![], b: vec![], unit, z_from };
    // The equalities are the states at both ends and the motion between nodes.
    for i in 0..3 {
        for (k, [place, rate]) in [(0, d.start), (nodes, d.end)] {
            let from = rows.b.len();
            rows.row(&[(at(k, r + i), 1.0)], place[i]);
            rows.over(from, length);
            rows.row(&[(at(k, v + i), 1.0)], rate[i]);
            rows.over(from + 1, speed);
        }
    }
    rows.row(&[(at(0, z), 1.0)], d.mass.ln());
    for k in 0..nodes {
        for i in 0..3 {
            let (g, half, from) = (d.gravity[i], 0.5 * dt, rows.b.len());
            rows.row(
                &[
                    (at(k + 1, v + i), 1.0),
                    (at(k, v + i), -1.0),
                    (at(k, u + i), -half),
                    (at(k + 1, u + i), -half),
                ],
                g * dt,
            );
            rows.over(from, speed);
            rows.row(
                &[
                    (at(k + 1, r + i), 1.0),
                    (at(k, r + i), -1.0),
                    (at(k, v + i), -dt),
                    (at(k, u + i), -dt * dt / 3.0),
                    (at(k + 1, u + i), -dt * dt / 6.0),
                ],
                0.5 * g * dt * dt,
            );
            rows.over(from + 1, length);
        }
        let h = 0.5 * alpha * dt;
        rows.row(&[(at(k + 1, z), 1.0), (at(k, z), -1.0), (at(k, s), h), (at(k + 1, s), h)], 0.0);
    }
    let mut cones = vec![SupportedConeT::ZeroConeT(rows.b.len())];
    // The following rows are inequalities.
    let before = rows.b.len();
    let least = |k: usize| (d.mass - alpha * high * dt * k as f64).max(0.5 * d.dry).ln();
    for k in 0..=nodes {
        let z0 = least(k);
        let scale = high * (-z0).exp();
        // Upper limit of thrust: s ≤ μ₂ (1 + z₀ − z)
        let from = rows.b.len();
        rows.row(&[(at(k, s), 1.0), (at(k, z), scale)], scale * (1.0 + z0));
        rows.over(from, push);
        if k > 0 {
            rows.row(&[(at(k, z), -1.0)], -z0);
            let most = d.mass - alpha * low * dt * k as f64;
            rows.row(&[(at(k, z), 1.0)], most.max(0.5 * d.dry).ln());
        }
        if d.pointing < std::f64::consts::PI {
            rows.row(&[(at(k, u + 2), -1.0), (at(k, s), d.pointing.cos())], 0.0);
        }
    }
    rows.row(&[(at(nodes, z), -1.0)], -d.dry.ln());
    cones.push(SupportedConeT::NonnegativeConeT(rows.b.len() - before));
    for k in 0..=nodes {
        // Norm of thrust: ‖u‖ ≤ s
        let from = rows.b.len();
        rows.row(&[(at(k, s), -1.0)], 0.0);
        (0..3).for_each(|i| rows.row(&[(at(k, u + i), -1.0)], 0.0));
        rows.over(from, push);
        cones.push(SupportedConeT::SecondOrderConeT(4));
        // Lower limit of thrust: δ² ≤ y = 2 (s/μ₁ − 1 + δ), as the cone ‖(2δ, y − 1)‖ ≤ y + 1
        let z0 = least(k);
        let by_s = 2.0 * z0.exp() / low;
        rows.row(&[(at(k, s), -by_s), (at(k, z), -2.0)], -1.0 - 2.0 * z0);
        rows.row(&[(at(k, z), -2.0)], -2.0 * z0);
        rows.row(&[(at(k, s), -by_s), (at(k, z), -2.0)], -3.0 - 2.0 * z0);
        cones.push(SupportedConeT::SecondOrderConeT(3));
        // Glide slope constraint; an angle of 0 means the ground itself. Both ends are given, so
        // leave them out.
        if k > 0 && k < nodes {
            let slope = d.glide.tan();
            let goal = d.end[0];
            let from = rows.b.len();
            rows.row(&[(at(k, r + 2), -1.0)], -goal.z);
            rows.row(&[(at(k, r), -slope)], -slope * goal.x);
            rows.row(&[(at(k, r + 1), -slope)], -slope * goal.y);
            rows.over(from, length);
            cones.push(SupportedConeT::SecondOrderConeT(3));
        }
    }
    let n = (nodes + 1) * PER_NODE;
    let mut q = vec![0.0; n];
    q[at(nodes, z)] = -1.0;
    let [i, j] = rows.triplets;
    let a = CscMatrix::new_from_triplets(rows.b.len(), n, i, j, rows.values);
    let told = |status: String| NoPlan::Solver { time, status };
    let settings = DefaultSettingsBuilder::default()
        .verbose(false)
        .tol_gap_abs(1e-10)
        .tol_gap_rel(1e-10)
        .tol_feas(1e-10)
        .max_iter(500)
        .build()
        .map_err(|e| told(format!("{e:?}")))?;
    let p = CscMatrix::zeros((n, n));
    let mut solver = DefaultSolver::new(&p, &q, &a, &rows.b, &cones, settings)
        .map_err(|e| told(format!("{e:?}")))?;
    solver.solve();
    // Round-off can prevent the required tolerance: accept a solution whose residuals and gap are small.
    let found = &solver.solution;
    let gap = (found.obj_val - found.obj_val_dual).abs() / found.obj_val.abs().max(1.0);
    let small = found.r_prim < ALMOST && found.r_dual < ALMOST && gap < ALMOST;
    match found.status {
        SolverStatus::Solved => {}
        SolverStatus::AlmostSolved if small => {}
        SolverStatus::PrimalInfeasible | SolverStatus::AlmostPrimalInfeasible => {
            return Err(NoPlan::Infeasible { time });
        }
        other => return Err(told(format!("{other:?}"))),
    }
    let x = &solver.solution.x;
    let vector = |k: usize, what: usize| Vec3::from_fn(|i, _| x[at(k, what + i)] * unit[what + i]);
    Ok((0..=nodes)
        .map(|k| {
            let thrust = vector(k, u);
            Node {
                time: dt * k as f64,
                position: vector(k, r),
                velocity: vector(k, v),
                thrust,
                mass: d.mass * x[at(k, z)].exp(),
                gap: x[at(k, s)] * push - thrust.norm(),
            }
        })
        .collect())
}

/// Returns the plan with the greatest final mass among durations from `low` to `high` s; golden section finds the duration to within `exact` s.
///
/// # Errors
/// The error of [`plan`] at the best time, if there is no plan at any time.
pub fn best_plan(
    d: &Descent,
    (low, high): (f64, f64),
    exact: f64,
    nodes: usize,
) -> Result<Vec<Node>, NoPlan> {
    if !(exact > 0.0 && low < high) {
        let what =
            format!("times from {low} to {high} s with an accuracy of {exact} s are not valid");
        return Err(NoPlan::Input {
            what,
            help: "choose an interval of times above 0 and an accuracy above 0",
        });
    }
    let fuel = |time: f64| match plan(d, time, nodes) {
        Ok(p) => Ok(d.mass - p[nodes].mass),
        // A time that is too short counts as worse than any other.
        Err(NoPlan::Infeasible { .. } | NoPlan::Solver { .. }) => Ok(f64::INFINITY),
        Err(e) => Err(e),
    };
    // Find the best time on a grid; it brackets the minimum for the golden-section search.
    let steps = 24;
    let mut best = (f64::INFINITY, low);
    for k in 0..=steps {
        let time = low + (high - low) * f64::from(k) / f64::from(steps);
        let f = fuel(time)?;
        if f < best.0 {
            best = (f, time);
        }
    }
    let width = (high - low) / f64::from(steps);
    let (mut a, mut b) = ((best.1 - width).max(low), (best.1 + width).min(high));
    let ratio = 0.5 * (5f64.sqrt() - 1.0);
    let (mut x, mut y) = (b - ratio * (b - a), a + ratio * (b - a));
    let (mut f, mut g) = (fuel(x)?, fuel(y)?);
    while b - a > exact {
        if f < g {
            (b, y, g) = (y, x, f);
            x = b - ratio * (b - a);
            f = fuel(x)?;
        } else {
            (a, x, f) = (x, y, g);
            y = a + ratio * (b - a);
            g = fuel(y)?;
        }
    }
    plan(d, if f.min(g) <= best.0 { if f < g { x } else { y } } else { best.1 }, nodes)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn descent() -> Descent {
        Descent {
            gravity: Vec3::new(0.0, 0.0, -3.7114),
            mass: 1905.0,
            dry: 1505.0,
            specific_impulse: 225.0,
            thrust: 18_600.0,
            throttle: [0.3, 0.8],
            cant: 27f64.to_radians(),
            start: [Vec3::new(2000.0, 450.0, 1500.0), Vec3::new(-40.0, 12.0, -65.0)],
            end: [Vec3::zeros(), Vec3::zeros()],
            glide: 15f64.to_radians(),
            pointing: std::f64::consts::PI,
        }
    }

    /// The example of Açıkmeşe and Ploen with the constraint to stay above the ground: the reference uses 390.43 kg in 74 s. With more and more
    /// intervals the propellant here converges to 390.4417 kg, which is 0.012 kg more; with g₀ = 9.807 m/s², which the reference probably used, it is
    /// 390.43 kg to all its digits.
    #[test]
    fn the_published_descent_takes_its_published_fuel() {
        let start = [Vec3::new(2000.0, 0.0, 1500.0), Vec3::new(100.0, 0.0, -75.0)];
        let d = Descent { start, glide: 0.0, ..descent() };
        let p = plan(&d, 74.0, 200).unwrap();
        let burnt = |d: &Descent, n: usize| d.mass - plan(d, 74.0, n).unwrap()[n].mass;
        let (coarse, fine) = (d.mass - p[200].mass, burnt(&d, 400));
        // The error is proportional to the square of the interval, so extrapolate.
        let limit = fine + (fine - coarse) / 3.0;
        println!("{coarse} kg, {fine} kg, {limit} kg");
        assert!((limit - 390.4417).abs() < 5e-4 && (coarse - limit).abs() < 5e-3, "{limit}");
        let other = Descent { specific_impulse: d.specific_impulse * 9.807 / 9.80665, ..d };
        let limit = burnt(&other, 200) + (limit - coarse);
        println!("{limit} kg with 9.807 m/s²");
        assert!((limit - 390.43).abs() < 5e-3, "{limit}");
        assert!(p.iter().all(|n| n.position.z > -1e-3));
        let within = |time: f64| plan(&d, time, 60).unwrap()[60].mass;
        assert!(within(74.0) > within(73.0) && within(74.0) > within(76.0));
    }

    #[test]
    fn a_plan_keeps_its_limits_and_the_relaxation_is_exact() {
        let d = descent();
        let p = plan(&d, 39.0, 60).unwrap();
        let most = d.throttle.map(|t| t * d.thrust * d.cant.cos());
        for n in &p {
            let thrust = n.thrust.norm() * n.mass;
            // The limits are expanded about z₀, which is conservative with an error of third order.
            assert!(thrust < most[1] * 1.0001 && thrust > most[0] * 0.99, "{n:?}");
            assert!(n.gap.abs() < 1e-7, "{n:?}");
            let flat = n.position.x.hypot(n.position.y);
            assert!(n.position.z >= flat * d.glide.tan() - 0.1, "{n:?}");
        }
        assert!(p[60].position.norm() < 1e-6 && p[60].velocity.norm() < 1e-6);
        // The motion must agree with the thrust from node to node.
        for w in p.windows(2) {
            let (a, b, h) = (&w[0], &w[1], w[1].time - w[0].time);
            let v = a.velocity + (a.thrust + b.thrust) * (0.5 * h) + d.gravity * h;
            let r = a.position
                + a.velocity * h
                + (a.thrust / 3.0 + b.thrust / 6.0 + d.gravity / 2.0) * (h * h);
            let flow = 0.5 * h * d.flow() * (a.thrust.norm() + b.thrust.norm());
            assert!((v - b.velocity).norm() < 1e-6 && (r - b.position).norm() < 1e-6, "{b:?}");
            assert!(((a.mass / b.mass).ln() - flow).abs() < 1e-8, "{b:?}");
        }
        let upright = plan(&Descent { pointing: 0.5, ..d }, 45.0, 60).unwrap();
        assert!(upright.iter().all(|n| n.thrust.z >= n.thrust.norm() * 0.5f64.cos() - 1e-6));
        assert!(upright[60].mass < plan(&d, 45.0, 60).unwrap()[60].mass + 1e-6);
    }

    #[test]
    fn the_best_time_is_found_and_what_cannot_be_flown_is_told() {
        let p = best_plan(&descent(), (30.0, 90.0), 0.1, 40).unwrap();
        let time = p[40].time;
        assert!((38.0..40.0).contains(&time), "{time}");
        let e = plan(&descent(), 20.0, 40).unwrap_err();
        assert!(matches!(e, NoPlan::Infeasible { .. }), "{e}");
        assert!(e.to_string().contains("help:"));
        let e = plan(&Descent { dry: 2000.0, ..descent() }, 40.0, 40).unwrap_err();
        assert!(e.to_string().contains("dry mass"));
    }
}
