//! `control.jet_selection`: selects the open thrusters of a set for a commanded force and torque.
//! ```text
//! B: a column b_k = (r × d T, d T) for each jet      w: commanded torque and force, plus the carried remainder      body axes
//! s = argmin ½ |W (B s − w)|² + λ Σ s_k,  0 ≤ s ≤ 1      m = B s: achievable part of w, with minimum propellant
//! o = argmin ½ |W (B o − m)|² + μ Σ o_k |W b_k|²,  o_k = 0 or 1      open for one period; by exchange: open or close the jet that lowers the cost most, until none does
//! carried over: m − B o, and up to two fifths of a jet of w − m           W = diag(1/ℓ, 1), ℓ: the root mean square of |r|
//! ```
//! The mean wrench equals the command although a jet is open for whole periods only; the period is the minimum pulse. The part of the command that
//! the jets cannot supply is discarded and not carried over. λ is 1e-3 of the mean of |W b_k|², which avoids opposing jets; μ is 1/20: a jet opens
//! only if it reduces the residual by more than its cost. Each iteration of `bounded` of `linkwork-embedded` and each opened jet costs O(jets²); the
//! number of iterations is slightly above the number of jets that end between 0 and 1.

use linkwork_embedded::{Sweeps, bounded};
use linkwork_runtime::prelude::*;

/// Maximum number of jets of a set.
const JETS_MAX: usize = 32;
/// Iteration limit and convergence tolerance of the duty cycles.
const SWEEPS: Sweeps = Sweeps { most: 300, settled: 1e-9 };
/// λ relative to the mean diagonal, and the term that is added to the diagonal so that the minimum is unique.
const FUEL: f64 = 1e-3;
const WEIGHT: f64 = 1e-8;
/// μ.
const OPENING: f64 = 0.05;
/// Maximum part of the residual w − m that is carried over, relative to a jet.
const LEFT: f64 = 0.4;

/// A jet.
#[derive(Params, Clone, Debug)]
pub struct Jet {
    /// Position from the node, body axes.
    #[param(unit = "m")]
    pub position: Vec3,
    /// Direction of the force on the body (opposite to the exhaust), body axes.
    pub direction: Vec3,
    /// Thrust.
    #[param(unit = "N", range = 1e-9..)]
    pub thrust: f64,
}

impl Jet {
    /// Returns torque (N m) and force (N) of the fully open jet.
    pub(super) fn column(&self) -> Column {
        let force = self.direction.normalize() * self.thrust;
        let torque = self.position.cross(&force);
        [torque.x, torque.y, torque.z, force.x, force.y, force.z]
    }
}

/// The jets.
#[derive(Params, Clone, Debug)]
pub struct JetSelectionParams {
    /// The jets in the order of the output `open`.
    pub jets: Vec<Jet>,
}

/// Torque and force of a jet that is fully open.
pub(super) type Column = [f64; 6];

/// Body and command, in the order of the input values.
#[derive(Ports, Clone, Copy, Debug)]
pub struct WrenchCommand {
    /// The body; positions and torque refer to its node.
    #[port(bind = "body")]
    pub body: NodeState,
    /// Commanded force, W.
    #[port("N", default = Vec3::zeros())]
    pub force: Vec3,
    /// Commanded torque, body axes.
    #[port("N m", default = Vec3::zeros())]
    pub torque: Vec3,
}

/// Force and torque of the open jets.
#[derive(Ports, Clone, Copy, Debug)]
pub struct JetWrench {
    /// Number of open jets.
    #[port("1")]
    pub opened: f64,
    /// Torque, body axes.
    #[port("N m")]
    pub given_torque: Vec3,
    /// Force, body axes.
    #[port("N")]
    pub given_force: Vec3,
}

/// Remainder that is carried to the next period.
#[derive(State, Clone, Copy, Debug)]
pub struct Carried {
    /// Carried torque over one period, body axes.
    #[port("N m")]
    pub torque: Vec3,
    /// Carried force over one period, body axes.
    #[port("N")]
    pub force: Vec3,
}

/// A set of jets.
pub struct JetSelection {
    columns: Vec<Column>,
    /// (W B)ᵀ W B with a small diagonal term, by rows.
    normal: Vec<f64>,
    /// Diagonal of W².
    weights: Column,
    /// Size of a jet: root mean square of the columns of W B.
    size: f64,
}

impl JetSelection {
    /// Returns the duty cycles of the jets for a torque and a force.
    fn shares(&self, w: &Column) -> [f64; JETS_MAX] {
        let n = self.columns.len();
        let mut right = [0.0; JETS_MAX];
        for (b, column) in right.iter_mut().zip(&self.columns) {
            *b = self.dot(column, w) - FUEL * self.size * self.size;
        }
        let mut s = [0.0; JETS_MAX];
        bounded(&self.normal, &right[..n], [0.0, 1.0], &SWEEPS, &mut s[..n]);
        s
    }

    fn dot(&self, a: &Column, b: &Column) -> f64 {
        (0..6).map(|i| a[i] * self.weights[i] * b[i]).sum()
    }

    /// Returns the jets to open for a torque and a force.
    fn opened(&self, wanted: &Column) -> [bool; JETS_MAX] {
        let n = self.columns.len();
        let mut open = [false; JETS_MAX];
        // Compute the gradient of the cost without the opening term.
        let mut slopes = [0.0; JETS_MAX];
        for (slope, column) in slopes.iter_mut().zip(&self.columns) {
            *slope = -self.dot(column, wanted);
        }
        // Every exchange lowers the cost, so no set repeats. The limit is never reached.
        for _ in 0..4 * n {
            let change = |k: usize| {
                let (side, own) = (if open[k] { -1.0 } else { 1.0 }, self.normal[k * n + k]);
                side * slopes[k] + (0.5 + OPENING * side) * own
            };
            let best = (0..n).min_by(|a, b| change(*a).total_cmp(&change(*b)));
            let Some(k) = best.filter(|k| change(*k) < -1e-9 * self.normal[k * n + k]) else {
                break;
            };
            let side = if open[k] { -1.0 } else { 1.0 };
            open[k] = !open[k];
            for (slope, h) in slopes.iter_mut().zip(&self.normal[k * n..(k + 1) * n]) {
                *slope += side * h;
            }
        }
        open
    }

    /// Returns torque and force of the jets at given duty cycles.
    fn given(&self, shares: impl Fn(usize) -> f64) -> Column {
        let mut sum = [0.0; 6];
        for (k, column) in self.columns.iter().enumerate() {
            let share = shares(k);
            for (sum, x) in sum.iter_mut().zip(column) {
                *sum += share * x;
            }
        }
        sum
    }

    /// Returns the open jets, their torque and force, and the carried remainder.
    fn select(&self, d: &Carried, u: &WrenchCommand) -> ([bool; JETS_MAX], Column, Carried) {
        let force = u.body.rotation.inverse() * u.force + d.force;
        let torque = u.torque + d.torque;
        let wanted = [torque.x, torque.y, torque.z, force.x, force.y, force.z];
        let s = self.shares(&wanted);
        let mean = self.given(|k| s[k]);
        let open = self.opened(&mean);
        let now = self.given(|k| f64::from(u8::from(open[k])));
        let left: Column = std::array::from_fn(|i| wanted[i] - mean[i]);
        let square = self.dot(&left, &left);
        let part = if square > 0.0 { (LEFT * self.size / square.sqrt()).min(1.0) } else { 0.0 };
        let rest: Column = std::array::from_fn(|i| mean[i] - now[i] + part * left[i]);
        let carried = Carried {
            torque: Vec3::new(rest[0], rest[1], rest[2]),
            force: Vec3::new(rest[3], rest[4], rest[5]),
        };
        (open, now, carried)
    }
}

/// Selects the open jets of a set in each period for a force and a torque; the quantization remainder is carried over; sampled.
#[model("control.jet_selection")]
impl SizedModel for JetSelection {
    type Params = JetSelectionParams;

    fn ports(p: &JetSelectionParams) -> SizedPorts {
        let open = PortSpec::named("open", PortKind::Numbers, p.jets.len().min(JETS_MAX))
            .unit_of("1")
            .doc_of("1 for a jet that is open in this period, else 0; in the order of the jets.");
        SizedPorts {
            feedthrough_inputs: WrenchCommand::specs(),
            feedthrough_outputs: std::iter::once(open).chain(JetWrench::specs()).collect(),
            discrete: Carried::specs(),
            sampled: true,
            ..SizedPorts::default()
        }
    }

    fn build(p: JetSelectionParams) -> Result<Self, BuildError> {
        let n = p.jets.len();
        let wrong = |fact: String, help: &str| Err(BuildError::new(fact).help(help).at("jets"));
        if n == 0 || n > JETS_MAX {
            return wrong(
                format!("{n} jets are not supported"),
                "write 1 to 32 jets, or use several selections",
            );
        }
        if let Some(k) = p.jets.iter().position(|j| !(j.direction.norm() > 1e-9)) {
            let fact = format!("the direction of jet {k} is zero");
            return wrong(fact, "write a direction, for example [0, 0, 1]");
        }
        let square = p.jets.iter().map(|j| j.position.norm_squared()).sum::<f64>() / n as f64;
        let turn = if square > 0.0 { 1.0 / square } else { 1.0 };
        let weights = [turn, turn, turn, 1.0, 1.0, 1.0];
        let columns: Vec<Column> = p.jets.iter().map(Jet::column).collect();
        let dot = |a: &Column, b: &Column| (0..6).map(|i| a[i] * weights[i] * b[i]).sum::<f64>();
        let mean = columns.iter().map(|c| dot(c, c)).sum::<f64>() / n as f64;
        let mut normal = vec![0.0; n * n];
        for (i, a) in columns.iter().enumerate() {
            for (j, b) in columns.iter().enumerate() {
                normal[i * n + j] = dot(a, b) + if i == j { WEIGHT * mean } else { 0.0 };
            }
        }
        Ok(Self { columns, normal, weights, size: mean.sqrt() })
    }

    fn feedthrough(&self, d: &[f64], u: &[f64], y: &mut [f64]) {
        let (open, given, _) = self.select(&Carried::get(d), &WrenchCommand::get(u));
        let (jets, rest) = y.split_at_mut(self.columns.len());
        for (lane, open) in jets.iter_mut().zip(open) {
            *lane = f64::from(u8::from(open));
        }
        let [a, b, c, x, y, z] = given;
        let opened = jets.iter().sum();
        JetWrench { opened, given_torque: Vec3::new(a, b, c), given_force: Vec3::new(x, y, z) }
            .put(rest);
    }

    fn update(&self, d: &mut [f64], u: &[f64]) {
        let (_, _, carried) = self.select(&Carried::get(d), &WrenchCommand::get(u));
        carried.put(d);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sixteen jets at the four corners of a square: two along z, two across.
    fn jets() -> Vec<Jet> {
        let mut all = Vec::new();
        for (x, y) in [(1.0, 1.2), (1.0, -1.2), (-1.0, 1.2), (-1.0, -1.2)] {
            let towards = [Vec3::z(), -Vec3::z(), -Vec3::x() * x, -Vec3::y() * (y / 1.2)];
            for direction in towards {
                all.push(Jet { position: Vec3::new(x, y, 0.1), direction, thrust: 4.5 });
            }
        }
        all
    }

    fn set() -> JetSelection {
        JetSelection::build(JetSelectionParams { jets: jets() }).map_err(|e| e.message).unwrap()
    }

    fn wanted(force: Vec3, torque: Vec3) -> WrenchCommand {
        let rotation = Quat::from_scaled_axis(Vec3::new(0.3, -0.5, 0.9));
        let body = NodeState { rotation, ..NodeState::identity() };
        WrenchCommand { body, force: rotation * force, torque }
    }

    #[test]
    fn the_mean_is_what_is_wanted() {
        let m = set();
        let cases = [
            (Vec3::new(0.07, -0.02, 0.05), Vec3::zeros()),
            (Vec3::new(1.3, 0.4, -2.0), Vec3::new(0.8, -0.3, 0.5)),
            (Vec3::new(0.0, 0.0, 9.0), Vec3::new(0.0, 2.0, 0.0)),
        ];
        for (force, torque) in cases {
            let mut d = Carried { torque: Vec3::zeros(), force: Vec3::zeros() };
            let (mut sum, n) = ([0.0; 6], 20_000);
            for _ in 0..n {
                let (_, given, carried) = m.select(&d, &wanted(force, torque));
                for (sum, x) in sum.iter_mut().zip(given) {
                    *sum += x / f64::from(n);
                }
                d = carried;
            }
            let off = Vec3::new(sum[3], sum[4], sum[5]) - force;
            let turned = Vec3::new(sum[0], sum[1], sum[2]) - torque;
            println!("{off} {turned}");
            // The remaining error is less than the impulse of two jets in one of these periods.
            assert!(off.norm() < 6e-4 && turned.norm() < 9e-4, "{off} {turned}");
        }
    }

    #[test]
    fn shares_satisfy_the_conditions_of_the_minimum() {
        // Conditions of the minimum: the slope is 0 for shares inside the range, at least 0 for
        // shares of 0, and at most 0 for shares of 1.
        let m = set();
        let n = m.columns.len();
        for w in [[0.5, -1.0, 0.7, 2.0, 1.0, -0.5], [0.0, 0.0, 0.0, 40.0, 3.0, 0.0]] {
            let s = m.shares(&w);
            for k in 0..n {
                let all: f64 = (0..n).map(|j| m.normal[k * n + j] * s[j]).sum();
                let right = m.dot(&m.columns[k], &w) - FUEL * m.size * m.size;
                let slope = (all - right) / m.normal[k * n + k];
                let holds = match s[k] {
                    0.0 => slope > -1e-8,
                    1.0 => slope < 1e-8,
                    _ => slope.abs() < 1e-8,
                };
                assert!(holds, "{w:?}: jet {k}, {} {slope}", s[k]);
            }
        }
    }

    #[test]
    fn what_jets_cannot_give_is_not_saved_up() {
        let m = set();
        let mut d = Carried { torque: Vec3::zeros(), force: Vec3::zeros() };
        let most = 4.0 * 4.5;
        for _ in 0..100 {
            let (open, given, carried) = m.select(&d, &wanted(Vec3::z() * 500.0, Vec3::zeros()));
            assert!((given[5] - most).abs() < 1e-9 && open.iter().filter(|o| **o).count() == 4);
            d = carried;
        }
        let (open, _, _) = m.select(&d, &wanted(Vec3::zeros(), Vec3::zeros()));
        assert!(open.iter().all(|o| !o), "{d:?}");
    }

    #[test]
    fn what_is_no_set_is_refused() {
        let refused = |jets| JetSelection::build(JetSelectionParams { jets }).err().unwrap();
        assert_eq!(refused(Vec::new()).param.as_deref(), Some("jets"));
        let mut one = jets();
        one[3].direction = Vec3::zeros();
        assert!(refused(one).message.contains("jet 3"));
    }
}
