//! `actuators.general_actuator`: a force that is affine in its control, its length and its rate, as the actuators of MuJoCo.
//! ```text
//! l = Σ cᵢ qᵢ, or the length of a line, or along a wrench      u: control, between its bounds
//! f = (g₀ + g₁ l + g₂ l̇) w + b₀ + b₁ l + b₂ l̇            between its bounds
//! w = u;  or an activation: ẇ = u, or ẇ = (u − w) / T, which stays between its bounds
//! P = f l̇; torques on the joints, or forces on the sites, by virtual work: `transmission.rs`
//! ```
//! A motor has g = (1, 0, 0), b = 0; a position servo of stiffness k and damping d has g = (k, 0, 0), b = (0, −k, −d).
//! It is an ideal force source without a supply. Use `actuators.dc_motor` for a motor with losses.

use crate::transmission::{Transmission, ordered};
use linkwork_runtime::prelude::*;

/// Joints and law of force.
#[derive(Params, Clone, Debug)]
pub struct GeneralActuatorParams {
    /// Change of the length per unit of each joint coordinate; for a line, its gear.
    #[param(default = vec![1.0])]
    pub factors: Vec<f64>,
    /// Sites of a line from the first to the last; 0: joints.
    #[param(default = 0)]
    pub sites: u32,
    /// Force per unit of the control: constant term, and coefficients of the length and of its rate.
    #[param(default = [1.0, 0.0, 0.0])]
    pub gain: [f64; 3],
    /// Force without control: constant term, and coefficients of the length and of its rate.
    #[param(default = [0.0, 0.0, 0.0])]
    pub bias: [f64; 3],
    /// Force and moment on site 1 per unit of force, in the axes of site 2, or of site 1 if `sites` is 1: a wrench instead of a line.
    #[param(default = None)]
    pub wrench: Option<[f64; 6]>,
    /// The force follows an activation that is the integral of the control over time.
    #[param(default = false)]
    pub integrates: bool,
    /// The force follows an activation that approaches the control with this time constant.
    #[param(unit = "s", default = None, range = 1e-9..)]
    pub time_constant: Option<f64>,
    /// Bounds of the activation; default: none.
    #[param(default = None)]
    pub activation_range: Option<[f64; 2]>,
    /// Bounds of the control; default: none.
    #[param(default = None)]
    pub control_range: Option<[f64; 2]>,
    /// Bounds of the force; default: none.
    #[param(default = None)]
    pub force_range: Option<[f64; 2]>,
}

impl GeneralActuatorParams {
    fn transmission(&self) -> Transmission<'_> {
        Transmission { factors: &self.factors, sites: self.sites, wrench: self.wrench }
    }

    fn has_activation(&self) -> bool {
        self.integrates || self.time_constant.is_some()
    }
}

/// Length, force and power.
#[derive(Ports, Clone, Copy, Debug)]
pub struct GeneralActuatorOut {
    /// Length of the transmission, rad or m.
    #[port("1")]
    pub length: f64,
    /// Its rate, rad/s or m/s.
    #[port("1/s")]
    pub velocity: f64,
    /// Force along it, N m or N.
    #[port("1")]
    pub force: f64,
    /// Power given to the joints.
    #[port("W")]
    pub power: f64,
}

/// An actuator with an affine law of force.
pub struct GeneralActuator {
    p: GeneralActuatorParams,
}

fn activation() -> PortSpec {
    let port = PortSpec::named("activation", PortKind::Numbers, 1).unit_of("1");
    port.doc_of("Activation, in the unit of the control.")
}

fn bounded(x: f64, range: Option<[f64; 2]>) -> f64 {
    range.map_or(x, |[lower, upper]| x.clamp(lower, upper))
}

/// Force affine in control or activation, length and rate, on a joint, a weighted sum of joints, a line over sites or as a wrench: motors and servos of MJCF files.
#[model("actuators.general_actuator")]
impl SizedModel for GeneralActuator {
    type Params = GeneralActuatorParams;

    fn ports(p: &GeneralActuatorParams) -> SizedPorts {
        let control = PortSpec::named("control", PortKind::Numbers, 1).unit_of("1");
        let control =
            control.doc_of("Control, in the unit that the gain converts to a force.").or(0.0);
        let inputs = std::iter::once(control).chain(p.transmission().inputs());
        SizedPorts {
            feedthrough_inputs: inputs.collect(),
            feedthrough_outputs: (GeneralActuatorOut::specs().into_iter())
                .chain(p.transmission().outputs())
                .collect(),
            continuous: match p.has_activation() {
                true => vec![activation()],
                false => Vec::new(),
            },
            ..SizedPorts::default()
        }
    }

    fn build(p: GeneralActuatorParams) -> Result<Self, BuildError> {
        p.transmission().check()?;
        ordered(p.control_range, "control_range")?;
        ordered(p.force_range, "force_range")?;
        ordered(p.activation_range, "activation_range")?;
        if p.integrates && p.time_constant.is_some() {
            return Err(BuildError::new("both `integrates` and `time_constant`")
                .help("write only one of them: `integrates` for an integrator, `time_constant` for a lag")
                .at("time_constant"));
        }
        if p.activation_range.is_some() && !p.has_activation() {
            return Err(BuildError::new(
                "`activation_range` is written, but the actuator has no activation",
            )
            .help("write `integrates: true` or `time_constant: ..`, or use `control_range`")
            .at("activation_range"));
        }
        Ok(GeneralActuator { p })
    }

    fn initial(&self, x: &mut [f64], _: &mut [f64]) {
        x.iter_mut().for_each(|w| *w = bounded(0.0, self.p.activation_range));
    }

    fn derivatives(&self, x: &[f64], u: &[f64], rates: &mut [f64]) {
        let p = &self.p;
        let control = bounded(u[0], p.control_range);
        let rate = p.time_constant.map_or(control, |time| (control - x[0]) / time);
        let [lower, upper] = p.activation_range.unwrap_or([f64::NEG_INFINITY, f64::INFINITY]);
        let held = (x[0] >= upper && rate > 0.0) || (x[0] <= lower && rate < 0.0);
        rates[0] = if held { 0.0 } else { rate };
    }

    fn feedthrough(&self, x: &[f64], u: &[f64], y: &mut [f64]) {
        let p = &self.p;
        let [length, velocity] = p.transmission().motion(&u[1..]);
        let affine = |c: &[f64; 3]| c[0] + c[1] * length + c[2] * velocity;
        let control = match x {
            [activation] => bounded(*activation, p.activation_range),
            _ => bounded(u[0], p.control_range),
        };
        let force = bounded(affine(&p.gain) * control + affine(&p.bias), p.force_range);
        let out = GeneralActuatorOut { length, velocity, force, power: force * velocity };
        let (own, torques) = y.split_at_mut(GeneralActuatorOut::N);
        out.put(own);
        p.transmission().load(&u[1..], force, torques);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn force(p: &GeneralActuatorParams, control: f64) -> Vec<f64> {
        let m = GeneralActuator::build(p.clone()).unwrap();
        let mut y = vec![0.0; 6];
        m.feedthrough(&[], &[control, 0.5, 2.0, -1.0, 4.0], &mut y);
        y
    }

    #[test]
    fn the_law_is_affine_between_its_bounds_and_does_its_work_on_the_joints() {
        let p = GeneralActuatorParams {
            factors: vec![2.0, -0.5],
            sites: 0,
            wrench: None,
            integrates: false,
            time_constant: None,
            activation_range: None,
            gain: [3.0, 1.0, 0.5],
            bias: [0.1, -3.0, -0.2],
            control_range: Some([-1.0, 1.0]),
            force_range: None,
        };
        // The length is 1 + 0.5 and its rate 4 − 2, so the gain is 3 + 1.5 + 1 and the bias 0.1 −
        // 4.5 − 0.4.
        let y = force(&p, 0.4);
        let f = 5.5 * 0.4 - 4.8;
        for (own, expected) in y.iter().zip([1.5, 2.0, f, 2.0 * f, 2.0 * f, -0.5 * f]) {
            assert!((own - expected).abs() < 1e-14, "{y:?}");
        }
        assert!((y[4] * 2.0 + y[5] * 4.0 - y[3]).abs() < 1e-14, "power of the torques");
        assert!((force(&p, 7.0)[2] - (5.5 - 4.8)).abs() < 1e-14);
        let bounded = GeneralActuatorParams { force_range: Some([-1.0, 0.3]), ..p };
        assert_eq!((force(&bounded, 7.0)[2], force(&bounded, -7.0)[2]), (0.3, -1.0));
    }

    #[test]
    fn factors_and_bounds_are_checked() {
        let p = GeneralActuatorParams {
            factors: vec![1.0],
            sites: 0,
            wrench: None,
            integrates: false,
            time_constant: None,
            activation_range: None,
            gain: [1.0, 0.0, 0.0],
            bias: [0.0; 3],
            control_range: None,
            force_range: None,
        };
        let wrong = |p: GeneralActuatorParams| GeneralActuator::build(p).is_err();
        assert!(wrong(GeneralActuatorParams { factors: Vec::new(), ..p.clone() }));
        assert!(wrong(GeneralActuatorParams { control_range: Some([1.0, 0.0]), ..p.clone() }));
        assert!(wrong(GeneralActuatorParams { force_range: Some([f64::NAN, 0.0]), ..p.clone() }));
        assert!(!wrong(p));
    }
}
