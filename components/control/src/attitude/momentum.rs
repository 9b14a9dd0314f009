//! `control.wheel_distribution`, `control.desaturation`: torque distribution to reaction wheels, and momentum dumping by magnetic torquers.
//! ```text
//! commanded body torque M → wheels u = −G⁺ M        G: spin axes as columns, G⁺ = Gᵀ (G Gᵀ)⁻¹: minimum-norm torques
//! momentum of the wheels h_w = G h                dipole d = −k (B × h_w)/|B|²: d × B = −k h_w across B
//! ```

use linkwork_runtime::prelude::*;
use linkwork_spatial::Mat3;

/// Maximum number of wheels of a set.
pub const WHEELS: usize = 6;

/// Axes.
#[derive(Params, Clone, Debug)]
pub struct DistributionParams {
    /// Spin axes, body axes; three to six.
    pub axes: Vec<Vec3>,
}

/// Commanded torque and wheel momenta.
#[derive(Ports, Clone, Copy, Debug)]
pub struct DistributionIn {
    /// Commanded torque on the body, body axes.
    #[port("N m")]
    pub torque: Vec3,
    /// Momentum of each wheel about its axis; values beyond the number of wheels are ignored.
    #[port("N m s", default = [0.0; WHEELS])]
    pub momenta: [f64; WHEELS],
}

/// Torques and momentum.
#[derive(Ports, Clone, Copy, Debug)]
pub struct DistributionOut {
    /// Torque for the motor of each wheel.
    #[port("N m")]
    pub torques: [f64; WHEELS],
    /// Momentum of all wheels, body axes.
    #[port("N m s")]
    pub momentum: Vec3,
}

/// A set of wheels.
pub struct WheelDistribution {
    axes: Vec<Vec3>,
    /// Rows of −G⁺.
    shares: Vec<Vec3>,
}

/// Distributes a torque to three to six wheels with minimum norm, and sums their momentum.
#[model("control.wheel_distribution")]
impl Model for WheelDistribution {
    type Params = DistributionParams;
    type FeedthroughInputs = DistributionIn;
    type FeedthroughOutputs = DistributionOut;
    fn build(p: DistributionParams) -> Result<Self, BuildError> {
        let wrong = |fact: String, help: &str| Err(BuildError::new(fact).help(help).at("axes"));
        if p.axes.len() > WHEELS {
            let fact = format!("{} wheels", p.axes.len());
            return wrong(fact, "the maximum is six wheels: use two sets");
        }
        if p.axes.iter().any(|a| !(a.norm() > 1e-9)) {
            return wrong("an axis is zero".into(), "write a direction, for example [1, 0, 0]");
        }
        let axes: Vec<Vec3> = p.axes.iter().map(|a| a.normalize()).collect();
        let sum: Mat3 = axes.iter().map(|a| a * a.transpose()).sum();
        let inverse = sum.try_inverse().filter(|_| sum.determinant() > 1e-9);
        let Some(inverse) = inverse else {
            let fact = "the axes are coplanar, so the wheels cannot exert a torque about the normal of their plane".to_string();
            return wrong(fact, "write three axes that are not coplanar");
        };
        let shares = axes.iter().map(|a| -(inverse * a)).collect();
        Ok(WheelDistribution { axes, shares })
    }
    fn feedthrough(&self, u: &DistributionIn) -> DistributionOut {
        let mut out = DistributionOut { torques: [0.0; WHEELS], momentum: Vec3::zeros() };
        for (k, (axis, share)) in self.axes.iter().zip(&self.shares).enumerate() {
            out.torques[k] = share.dot(&u.torque);
            out.momentum += axis * u.momenta[k];
        }
        out
    }
}

/// Gain and target momentum.
#[derive(Params, Clone, Debug)]
pub struct DesaturationParams {
    /// Gain k: across the field, momentum decays as e^(−k t).
    #[param(unit = "1/s", default = 1e-3, range = 0.0..)]
    pub gain: f64,
    /// Target momentum of the wheels, body axes.
    #[param(unit = "N m s", default = Vec3::zeros())]
    pub wanted: Vec3,
}

/// Momentum and field.
#[derive(Ports, Clone, Copy, Debug)]
pub struct DesaturationIn {
    /// Momentum of the wheels, body axes.
    #[port("N m s")]
    pub momentum: Vec3,
    /// Flux density, body axes.
    #[port("T")]
    pub field: Vec3,
}

/// Dipole.
#[derive(Ports, Clone, Copy, Debug)]
pub struct DesaturationOut {
    /// Dipole for the coils, body axes.
    #[port("A m^2")]
    pub dipole: Vec3,
}

/// Desaturation by coils.
pub struct Desaturation {
    p: DesaturationParams,
}

/// Computes the dipole that removes wheel momentum perpendicular to the magnetic field.
#[model("control.desaturation")]
impl Model for Desaturation {
    type Params = DesaturationParams;
    type FeedthroughInputs = DesaturationIn;
    type FeedthroughOutputs = DesaturationOut;
    fn feedthrough(&self, u: &DesaturationIn) -> DesaturationOut {
        let square = u.field.norm_squared();
        let excess = u.momentum - self.p.wanted;
        // Without a field, the torque is zero.
        let dipole = if square > 0.0 {
            u.field.cross(&excess) * (-self.p.gain / square)
        } else {
            Vec3::zeros()
        };
        DesaturationOut { dipole }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wheels_give_the_torque_that_is_wanted_with_the_least_effort() {
        let s = 1.0 / 3f64.sqrt();
        let axes = vec![[s, s, s], [-s, s, s], [-s, -s, s], [s, -s, s]]
            .into_iter()
            .map(Vec3::from)
            .collect();
        let m = WheelDistribution::build(DistributionParams { axes }).unwrap();
        let torque = Vec3::new(0.3, -0.1, 0.2);
        let momenta = [1.0, 2.0, -1.0, 0.5, 9.0, 9.0];
        let u = DistributionIn { torque, momenta };
        let y = m.feedthrough(&u);
        // The torque on the body is opposite to the torque on each wheel.
        let on_body: Vec3 = m.axes.iter().zip(y.torques).map(|(a, t)| -a * t).sum();
        assert!((on_body - torque).norm() < 1e-15);
        // The torques are the least ones, because they have no part along the null motion (+ − +
        // −).
        let null = y.torques[0] - y.torques[1] + y.torques[2] - y.torques[3];
        assert!(null.abs() < 1e-15 && y.torques[4] == 0.0);
        let momentum: Vec3 = m.axes.iter().zip(momenta).map(|(a, h)| a * h).sum();
        assert!((y.momentum - momentum).norm() < 1e-15);
        for axes in [
            vec![Vec3::x(), Vec3::y()],
            vec![Vec3::x(), Vec3::y(), Vec3::x() + Vec3::y()],
            vec![Vec3::x(), Vec3::y(), Vec3::zeros()],
            vec![Vec3::x(); 7],
        ] {
            let e = WheelDistribution::build(DistributionParams { axes }).err().unwrap();
            assert!(e.param.as_deref() == Some("axes") && e.help.is_some());
        }
    }

    #[test]
    fn coils_take_momentum_out_across_the_field() {
        let m = Desaturation { p: DesaturationParams { gain: 2e-3, wanted: Vec3::x() } };
        let (momentum, field) = (Vec3::new(5.0, -3.0, 2.0), Vec3::new(1e-5, 2e-5, -3e-5));
        let u = DesaturationIn { momentum, field };
        let d = m.feedthrough(&u).dipole;
        let torque = d.cross(&field);
        let excess = momentum - Vec3::x();
        let along = field.normalize();
        let across = excess - along * excess.dot(&along);
        assert!((torque + across * 2e-3).norm() < 1e-15, "{torque} {across}");
        let none = DesaturationIn { field: Vec3::zeros(), ..u };
        assert_eq!(m.feedthrough(&none).dipole, Vec3::zeros());
    }
}
