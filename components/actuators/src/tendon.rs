//! `actuators.tendon`: spring, damper and soft limits on a weighted sum of joint coordinates or on a line over sites, as the tendons of MuJoCo.
//! ```text
//! l = Σ cᵢ qᵢ, or the length of the line
//! f = −k (l − r) − d l̇ + limits       r: l moved between the two rest lengths, so that there is no force between them
//! limits   max(0, k_l δ − d_l δ̇) at the lower bound, −max(0, ..) at the upper; δ: how far l is beyond it
//! torques on the joints, or forces on the sites, by virtual work: `transmission.rs`
//! ```

use crate::transmission::{Transmission, ordered};
use linkwork_runtime::prelude::*;

/// Joints, spring and limits.
#[derive(Params, Clone, Debug)]
pub struct TendonParams {
    /// Change of the length per unit of each joint coordinate; for a line, one factor, 1 by default.
    #[param(default = vec![1.0])]
    pub factors: Vec<f64>,
    /// Sites of a line from the first to the last; 0: joints.
    #[param(default = 0)]
    pub sites: u32,
    /// Stiffness: force per unit of length.
    #[param(default = 0.0, range = 0.0..)]
    pub stiffness: f64,
    /// Lengths between which the spring exerts no force.
    #[param(default = [0.0, 0.0], needs = "stiffness")]
    pub rest: [f64; 2],
    /// Damping: force per unit of rate.
    #[param(default = 0.0, range = 0.0..)]
    pub damping: f64,
    /// Bounds of the length; default: none.
    #[param(default = None)]
    pub range: Option<[f64; 2]>,
    /// Stiffness beyond a bound.
    #[param(default = 1e4, range = 0.0.., needs = "range")]
    pub limit_stiffness: f64,
    /// Damping beyond a bound.
    #[param(default = 0.0, range = 0.0.., needs = "range")]
    pub limit_damping: f64,
}

/// Length and force.
#[derive(Ports, Clone, Copy, Debug)]
pub struct TendonOut {
    /// Length, rad or m.
    #[port("1")]
    pub length: f64,
    /// Its rate, rad/s or m/s.
    #[port("1/s")]
    pub velocity: f64,
    /// Force along it, N m or N.
    #[port("1")]
    pub force: f64,
}

impl TendonParams {
    fn transmission(&self) -> Transmission<'_> {
        Transmission { factors: &self.factors, sites: self.sites, wrench: None }
    }
}

/// A tendon.
pub struct Tendon {
    p: TendonParams,
}

/// Spring, damper and soft limits on a weighted sum of joint coordinates or on a line over sites: tendons of MJCF files.
#[model("actuators.tendon")]
impl SizedModel for Tendon {
    type Params = TendonParams;

    fn ports(p: &TendonParams) -> SizedPorts {
        SizedPorts {
            feedthrough_inputs: p.transmission().inputs(),
            feedthrough_outputs: (TendonOut::specs().into_iter())
                .chain(p.transmission().outputs())
                .collect(),
            ..SizedPorts::default()
        }
    }

    fn build(p: TendonParams) -> Result<Self, BuildError> {
        p.transmission().check()?;
        ordered(Some(p.rest), "rest")?;
        ordered(p.range, "range")?;
        Ok(Tendon { p })
    }

    fn feedthrough(&self, u: &[f64], y: &mut [f64]) {
        let p = &self.p;
        let [length, velocity] = p.transmission().motion(u);
        let stretch = length - length.clamp(p.rest[0], p.rest[1]);
        let stop = |depth: f64, rate: f64| match depth > 0.0 {
            true => (p.limit_stiffness * depth + p.limit_damping * rate).max(0.0),
            false => 0.0,
        };
        let limits = p.range.map_or(0.0, |[lower, upper]| {
            stop(lower - length, -velocity) - stop(length - upper, velocity)
        });
        let force = limits - p.stiffness * stretch - p.damping * velocity;
        let (own, torques) = y.split_at_mut(TendonOut::N);
        TendonOut { length, velocity, force }.put(own);
        p.transmission().load(u, force, torques);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tendon() -> TendonParams {
        TendonParams {
            factors: vec![2.0, -1.0],
            sites: 0,
            stiffness: 10.0,
            rest: [-0.5, 1.0],
            damping: 0.5,
            range: Some([-2.0, 3.0]),
            limit_stiffness: 100.0,
            limit_damping: 4.0,
        }
    }

    /// Returns length, rate, force and torques with both joints at `q` and the rate `v`.
    fn outputs(q: [f64; 2], v: [f64; 2]) -> Vec<f64> {
        let m = Tendon::build(tendon()).unwrap();
        let mut y = vec![0.0; 5];
        m.feedthrough(&[q[0], v[0], q[1], v[1]], &mut y);
        y
    }

    #[test]
    fn the_spring_has_no_force_between_its_rest_lengths_and_limits_push_inwards() {
        assert_eq!(outputs([0.5, 0.25], [0.0; 2]), [0.75, 0.0, 0.0, 0.0, -0.0]);
        assert_eq!(outputs([1.0, 0.0], [0.0; 2])[2..], [-10.0, -20.0, 10.0]);
        assert_eq!(outputs([-0.5, 0.0], [1.0, 0.0])[2], 5.0 - 1.0);
        // The length is 1 above the upper bound and grows at a rate of 2; then it shrinks so fast that the
        // limit's damping exceeds its spring force, and the limit exerts no force.
        assert_eq!(outputs([2.0, 0.0], [1.0, 0.0])[2], -30.0 - 1.0 - 108.0);
        assert_eq!(outputs([2.0, 0.0], [-20.0, 0.0])[2], -30.0 + 20.0);
        assert_eq!(outputs([-1.5, 0.0], [0.0; 2])[2], 25.0 + 100.0);
        let wrong = TendonParams { rest: [1.0, 0.0], ..tendon() };
        assert!(Tendon::build(wrong).is_err());
    }
}
