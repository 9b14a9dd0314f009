//! `control.throttles`: control allocation: throttles of a set of body-fixed engines for a commanded force and torque.
//! ```text
//! B: a column (r × d T, d T) for each engine      w: commanded torque and force      body axes
//! s = argmin |W (B s − w)|² + ε |s|²,  s_min ≤ s ≤ 1      W² = diag(weights of the torque/ℓ², weights of the force), ℓ: the root mean square of |r|
//! ```
//! Engines in `off` have throttle 0. If the engines cannot supply the command, the weighted residual is minimized; give weight 0 to components that
//! do not matter, such as the lateral force. The bounded least-squares problem is solved by `bounded` of `linkwork-embedded`; ε is 1e-6 of the mean
//! diagonal of (W B)ᵀ W B. An iteration costs O(engines²); the number of iterations is slightly above the number of engines that end between their
//! limits.

use super::jets::Jet;
use linkwork_embedded::{Sweeps, bounded};
use linkwork_runtime::prelude::*;

/// Maximum number of engines of a set.
const ENGINES_MAX: usize = 32;
/// Iteration limit, convergence tolerance of a throttle, and ε relative to the mean diagonal.
const SWEEPS: Sweeps = Sweeps { most: 300, settled: 1e-7 };
const WEIGHT: f64 = 1e-6;

/// The engines.
#[derive(Params, Clone, Debug)]
pub struct ThrottlesParams {
    /// The engines with their thrust at full throttle, in the order of the output `throttle`.
    pub engines: Vec<Jet>,
    /// Minimum throttle s_min of a burning engine.
    #[param(default = 0.0, range = 0.0..=1.0)]
    pub throttle_min: f64,
    /// Indices of engines that are off, from 0.
    #[param(default = Vec::new())]
    pub off: Vec<u32>,
    /// Weights of the torque about x, y, z.
    #[param(default = Vec3::repeat(1.0))]
    pub torque_weights: Vec3,
    /// Weights of the force along x, y, z.
    #[param(default = Vec3::repeat(1.0))]
    pub force_weights: Vec3,
}

/// Command.
#[derive(Ports, Clone, Copy, Debug)]
pub struct WrenchCommand {
    /// Commanded force, body axes.
    #[port("N", default = Vec3::zeros())]
    pub force: Vec3,
    /// Commanded torque about the origin of the engine positions, body axes.
    #[port("N m", default = Vec3::zeros())]
    pub torque: Vec3,
}

/// Force and torque of the engines in vacuum.
#[derive(Ports, Clone, Copy, Debug)]
pub struct EngineWrench {
    /// Torque, body axes.
    #[port("N m")]
    pub given_torque: Vec3,
    /// Force, body axes.
    #[port("N")]
    pub given_force: Vec3,
}

/// A set of engines.
pub struct Throttles {
    columns: Vec<[f64; 6]>,
    /// Indices of the burning engines.
    on: Vec<usize>,
    /// (W B)ᵀ W B + ε of the burning engines, by rows.
    normal: Vec<f64>,
    /// Diagonal of W².
    weights: [f64; 6],
    least: f64,
}

impl Throttles {
    /// Returns the throttles of all engines for a torque and a force.
    fn throttles(&self, w: &[f64; 6]) -> [f64; ENGINES_MAX] {
        let n = self.on.len();
        let mut right = [0.0; ENGINES_MAX];
        for (b, k) in right.iter_mut().zip(&self.on) {
            *b = (0..6).map(|i| self.columns[*k][i] * self.weights[i] * w[i]).sum();
        }
        let mut s = [self.least; ENGINES_MAX];
        bounded(&self.normal, &right[..n], [self.least, 1.0], &SWEEPS, &mut s[..n]);
        let mut all = [0.0; ENGINES_MAX];
        self.on.iter().zip(s).for_each(|(k, s)| all[*k] = s);
        all
    }
}

/// Allocates throttles of body-fixed engines for a commanded force and torque; a residual is minimized by weights.
#[model("control.throttles")]
impl SizedModel for Throttles {
    type Params = ThrottlesParams;

    fn ports(p: &ThrottlesParams) -> SizedPorts {
        let throttle =
            PortSpec::named("throttle", PortKind::Numbers, p.engines.len().min(ENGINES_MAX))
                .unit_of("1")
                .doc_of("Throttle of each engine, 0 to 1; in the order of the engines.");
        SizedPorts {
            feedthrough_inputs: WrenchCommand::specs(),
            feedthrough_outputs: std::iter::once(throttle).chain(EngineWrench::specs()).collect(),
            ..SizedPorts::default()
        }
    }

    fn build(p: ThrottlesParams) -> Result<Self, BuildError> {
        let n = p.engines.len();
        let wrong =
            |at: &str, fact: String, help: &str| Err(BuildError::new(fact).help(help).at(at));
        if n == 0 || n > ENGINES_MAX {
            return wrong(
                "engines",
                format!("{n} engines are not supported"),
                "write 1 to 32 engines",
            );
        }
        if let Some(k) = p.engines.iter().position(|e| !(e.direction.norm() > 1e-9)) {
            let fact = format!("the direction of engine {k} is zero");
            return wrong("engines", fact, "write a direction, for example [0, 0, 1]");
        }
        if let Some(k) = p.off.iter().find(|k| **k as usize >= n) {
            let fact = format!("`off` contains {k}, but there are {n} engines");
            return wrong("off", fact, "engines are counted from 0");
        }
        let on: Vec<usize> = (0..n).filter(|k| !p.off.contains(&(*k as u32))).collect();
        if on.is_empty() {
            return wrong("off", "all engines are off".into(), "remove at least one from `off`");
        }
        for (at, weights) in
            [("torque_weights", p.torque_weights), ("force_weights", p.force_weights)]
        {
            if weights.iter().any(|w| !(*w >= 0.0)) {
                return wrong(at, "a weight is below 0".into(), "write three weights of 0 or more");
            }
        }
        let square = p.engines.iter().map(|e| e.position.norm_squared()).sum::<f64>() / n as f64;
        let turn = p.torque_weights * if square > 0.0 { 1.0 / square } else { 1.0 };
        let push = p.force_weights;
        let weights = [turn.x, turn.y, turn.z, push.x, push.y, push.z];
        let columns: Vec<[f64; 6]> = p.engines.iter().map(Jet::column).collect();
        let dot = |i: usize, j: usize| {
            (0..6).map(|k| columns[i][k] * weights[k] * columns[j][k]).sum::<f64>()
        };
        let mean = on.iter().map(|k| dot(*k, *k)).sum::<f64>() / on.len() as f64;
        if !(mean > 0.0) {
            let help = "write at least one weight above 0, for example force_weights: [0, 0, 1]";
            return wrong(
                "force_weights",
                "all weighted components are zero for these engines".into(),
                help,
            );
        }
        let mut normal = Vec::with_capacity(on.len() * on.len());
        for i in &on {
            normal
                .extend(on.iter().map(|j| dot(*i, *j) + if i == j { WEIGHT * mean } else { 0.0 }));
        }
        Ok(Throttles { columns, on, normal, weights, least: p.throttle_min })
    }

    fn feedthrough(&self, u: &[f64], y: &mut [f64]) {
        let WrenchCommand { force, torque } = WrenchCommand::get(u);
        let s = self.throttles(&[torque.x, torque.y, torque.z, force.x, force.y, force.z]);
        let (lanes, rest) = y.split_at_mut(self.columns.len());
        lanes.copy_from_slice(&s[..self.columns.len()]);
        let sum = |i: usize| self.columns.iter().zip(s).map(|(c, s)| c[i] * s).sum::<f64>();
        let given_torque = Vec3::new(sum(0), sum(1), sum(2));
        EngineWrench { given_torque, given_force: Vec3::new(sum(3), sum(4), sum(5)) }.put(rest);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Eight engines at four corners, leaning outwards and to the side in turn.
    fn engines() -> Vec<Jet> {
        let corner = |k: usize| {
            let a = std::f64::consts::FRAC_PI_4 * (2.0 * (k / 2) as f64 + 1.0);
            let (out, across) =
                (Vec3::new(a.cos(), a.sin(), 0.0), Vec3::new(-a.sin(), a.cos(), 0.0));
            let side = if k.is_multiple_of(2) { 0.15 } else { -0.15 };
            let direction = Vec3::z() - out * 0.2 + across * side;
            Jet { position: out * 1.4 + across * side + Vec3::z() * 0.6, direction, thrust: 3000.0 }
        };
        (0..8).map(corner).collect()
    }

    fn params() -> ThrottlesParams {
        ThrottlesParams {
            engines: engines(),
            throttle_min: 0.13,
            off: Vec::new(),
            torque_weights: Vec3::repeat(1.0),
            force_weights: Vec3::new(0.0, 0.0, 1.0),
        }
    }

    fn set(p: ThrottlesParams) -> Throttles {
        Throttles::build(p).map_err(|e| e.message).unwrap()
    }

    fn at(m: &Throttles, force: Vec3, torque: Vec3) -> (Vec<f64>, EngineWrench) {
        let (mut u, mut y) = ([0.0; 6], vec![0.0; m.columns.len() + EngineWrench::N]);
        WrenchCommand { force, torque }.put(&mut u);
        m.feedthrough(&u, &mut y);
        let given = EngineWrench::get(&y[m.columns.len()..]);
        (y[..m.columns.len()].to_vec(), given)
    }

    #[test]
    fn what_is_wanted_within_the_throttles_is_given() {
        let m = set(params());
        for (thrust, torque) in [
            (9e3, Vec3::new(900.0, -400.0, 250.0)),
            (16e3, Vec3::new(-2500.0, 300.0, -300.0)),
            (5e3, Vec3::zeros()),
        ] {
            let (s, given) = at(&m, Vec3::z() * thrust, torque);
            assert!((given.given_force.z - thrust).abs() < 1e-4 * thrust, "{given:?}");
            assert!((given.given_torque - torque).norm() < 1e-4 * thrust, "{given:?}");
            // The reported wrench agrees with the sum of the forces of the engine models at their positions.
            let (mut force, mut turn) = (Vec3::zeros(), Vec3::zeros());
            for (e, s) in engines().iter().zip(&s) {
                let f = e.direction.normalize() * (3000.0 * s);
                (force, turn) = (force + f, turn + e.position.cross(&f));
            }
            assert!((force - given.given_force).norm() < 1e-9 * thrust);
            assert!((turn - given.given_torque).norm() < 1e-9 * thrust);
        }
    }

    /// The slope of the cost is 0 for throttles inside the range, not below 0 at the lower end and not above 0 at 1; throttles are within the limits,
    /// and engines that are off stay off.
    #[test]
    fn the_throttles_satisfy_the_conditions_of_the_minimum() {
        for (off, w) in [
            (vec![], [0.0, 0.0, 0.0, 0.0, 0.0, 1e3]),
            (vec![], [4e3, -1e3, 500.0, 0.0, 0.0, 22e3]),
            (vec![0, 3, 4, 7], [200.0, 100.0, -50.0, 0.0, 0.0, 6e3]),
        ] {
            let m = set(ThrottlesParams { off: off.clone(), ..params() });
            let all = m.throttles(&w);
            assert!(off.iter().all(|k| all[*k as usize] == 0.0));
            let n = m.on.len();
            let (mut least, mut most) = (false, false);
            for i in 0..n {
                let right: f64 = (0..6).map(|k| m.columns[m.on[i]][k] * m.weights[k] * w[k]).sum();
                let sum: f64 = (0..n).map(|j| m.normal[i * n + j] * all[m.on[j]]).sum();
                let slope = (sum - right) / m.normal[i * n + i];
                let s = all[m.on[i]];
                assert!((0.13..=1.0).contains(&s), "{s}");
                (least, most) = (least || s == 0.13, most || s == 1.0);
                let holds = (s == 0.13 && slope > -1e-3)
                    || (s == 1.0 && slope < 1e-3)
                    || slope.abs() < 1e-3;
                assert!(holds, "{w:?} engine {i}: {s} {slope}");
            }
            assert!(off.len() == 4 || least || most, "no end is met: {all:?}");
        }
    }

    #[test]
    fn what_is_no_set_is_refused() {
        let refused = |p: ThrottlesParams| Throttles::build(p).err().unwrap().param.unwrap();
        assert_eq!(refused(ThrottlesParams { engines: Vec::new(), ..params() }), "engines");
        let mut one = params();
        one.engines[2].direction = Vec3::zeros();
        assert_eq!(refused(one), "engines");
        assert_eq!(refused(ThrottlesParams { off: vec![8], ..params() }), "off");
        assert_eq!(refused(ThrottlesParams { off: (0..8).collect(), ..params() }), "off");
        let torque_weights = Vec3::new(1.0, -1.0, 1.0);
        assert_eq!(refused(ThrottlesParams { torque_weights, ..params() }), "torque_weights");
        let none = ThrottlesParams {
            torque_weights: Vec3::zeros(),
            force_weights: Vec3::zeros(),
            ..params()
        };
        assert_eq!(refused(none), "force_weights");
    }
}
