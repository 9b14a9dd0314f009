//! `flight.engine`: thrust and mass flow of a rocket engine, and the effect of the flow on a rotating vehicle.
//! ```text
//! T = max(0, c T_vac − p A_e)  (c: throttle, 0 … 1)        ṁ = c T_vac/(I_sp g₀)        g₀ = 9.80665 m/s²
//! c < c_min: it goes out where c < 0.98 c_min, burns at c_min until then, and burns again from c_min on
//! F = T R_x(δ_x) R_y(δ_y) z at the nozzle (node z: against the jet; δ: gimbal, cut off at δ_max)
//! flow from the surface of the propellant to the nozzle, along L: F_c = −2 ṁ ω × L in the middle of L
//! ```
//! F_c is the Coriolis force of the flow inside the vehicle (Thomson, Introduction to Space Dynamics, 8.4): about
//! the centre of mass it is the jet damping ṁ (k² − l²) ω with k, l the distances of the two ends of L.

use linkwork_runtime::prelude::*;

/// Standard gravity, m/s², to which the specific impulse refers.
const G0: f64 = 9.80665;

/// The ambient pressure of a nozzle whose exit area is written must be wired; otherwise vacuum would be assumed.
pub(crate) fn needs_pressure(exit_area: f64) -> Vec<(&'static str, BuildError)> {
    if exit_area == 0.0 {
        return Vec::new();
    }
    let why = BuildError::new("the thrust depends on it, because `exit_area` is written")
        .help("wire the pressure of the air, for example from `environment.us76`, or remove `exit_area` in vacuum");
    vec![("pressure", why)]
}

/// Thrust (N) of a nozzle that gives `vacuum` (N) without ambient pressure, under `pressure` (Pa) on its exit of `area` (m²).
///
/// The pressure reduces the thrust by p A_e while the jet fills the nozzle. A jet that is too weak for that separates from the wall, and the
/// ambient pressure then acts on both sides of it: the thrust is never negative, and zero without a jet.
pub(crate) fn nozzle_thrust(vacuum: f64, pressure: f64, area: f64) -> f64 {
    let thrust = vacuum - pressure * area;
    // Keep NaN, so that it stops the run.
    if thrust < 0.0 { 0.0 } else { thrust }
}

/// An engine.
#[derive(Params, Clone, Debug)]
pub struct EngineParams {
    /// Thrust in vacuum at full throttle.
    #[param(unit = "N", range = 0.0..)]
    pub thrust: f64,
    /// Specific impulse in vacuum.
    #[param(unit = "s", range = 1e-3..)]
    pub specific_impulse: f64,
    /// Area of the nozzle's exit, on which the ambient pressure acts.
    #[param(unit = "m^2", default = 0.0, range = 0.0..)]
    pub exit_area: f64,
    /// Vector from the surface of the propellant to the nozzle, nozzle axes; zero: no jet damping.
    #[param(unit = "m", default = Vec3::zeros())]
    pub flow_path: Vec3,
    /// Throttle at and above which the engine burns. The engine burns at this throttle for commands down to 0.98 of it, and goes out below, so a
    /// controller whose command varies about this value does not switch it on and off repeatedly.
    #[param(unit = "1", default = 0.0, range = 0.0..=1.0)]
    pub throttle_min: f64,
    /// Greatest angle δ_max of the gimbal about each of its axes.
    #[param(unit = "rad", default = 0.0, range = 0.0..=1.5)]
    pub gimbal_max: f64,
}

/// Command and supply.
#[derive(Ports, Clone, Copy, Debug)]
pub struct EngineIn {
    /// The nozzle.
    #[port(bind = "nozzle")]
    pub nozzle: NodeState,
    /// Throttle: 0 off, 1 full; values outside are clamped.
    #[port("1")]
    pub throttle: f64,
    /// Connection to the source of the propellant.
    #[port(connector)]
    pub propellant: Propellant,
    /// Ambient pressure.
    #[port("Pa", default = 0.0)]
    pub pressure: f64,
    /// Angle of the gimbal about x of the nozzle.
    #[port("rad", default = 0.0)]
    pub gimbal_x: f64,
    /// Angle of the gimbal about y, which turns with the one about x.
    #[port("rad", default = 0.0)]
    pub gimbal_y: f64,
}

/// Force and flow.
#[derive(Ports, Clone, Copy, Debug)]
pub struct EngineOut {
    /// Thrust and jet damping.
    #[port(bind = "nozzle")]
    pub load: Wrench,
    /// Propellant that it takes.
    #[port(connector)]
    pub propellant: MassFlow,
    /// Thrust.
    #[port("N")]
    pub thrust: f64,
}

/// State of the combustion.
#[derive(State, Clone, Copy, Debug)]
pub struct Burning {
    /// The engine burns: the throttle has reached its minimum, and the engine has not gone out since.
    #[port]
    pub burns: bool,
}

/// The least throttle.
#[derive(Ports, Clone, Copy, Debug)]
pub struct LeastThrottle {
    /// Throttle minus the throttle from which the engine burns.
    #[port("1", rising)]
    pub lights: f64,
    /// Throttle at which the engine goes out, minus the present throttle.
    #[port("1", rising)]
    pub goes_out: f64,
}

/// Fraction of the minimum throttle at which the engine goes out.
const OUT: f64 = 0.98;

/// Limits an angle to ± `most`; NaN remains NaN.
fn cut(angle: f64, most: f64) -> f64 {
    angle.clamp(-most, most)
}

/// A rocket engine.
pub struct Engine {
    pub(crate) p: EngineParams,
}

/// A rocket engine: thrust, mass flow, jet damping.
#[model("flight.engine")]
impl Model for Engine {
    const MODES: bool = true;
    type Params = EngineParams;
    type DiscreteState = Burning;
    type Guards = LeastThrottle;
    type FeedthroughInputs = EngineIn;
    type FeedthroughOutputs = EngineOut;
    fn without_effect(&self, wired: IsWired<'_>) -> Judged {
        let fixed = self.p.gimbal_max == 0.0;
        let wire = |name: &str| {
            (fixed && wired(name)).then(|| {
                BuildError::new("`gimbal_max` is 0").help("write `gimbal_max`, or remove the wire")
            })
        };
        let still = !wired("gimbal_x") && !wired("gimbal_y");
        let idle = still.then(|| {
            BuildError::new(
                "no wire leads to `gimbal_x` or `gimbal_y`, so the nozzle does not move",
            )
            .help("wire one of them, set it from a program, or remove `gimbal_max`")
        });
        vec![
            (Judge::Input("gimbal_x"), wire("gimbal_x")),
            (Judge::Input("gimbal_y"), wire("gimbal_y")),
            (Judge::Param("gimbal_max"), idle),
        ]
    }
    fn mode(&self, d: &Burning, u: &EngineIn) -> Burning {
        let least = self.p.throttle_min;
        // A NaN throttle counts as burning, so that it stops the run.
        Burning { burns: !(u.throttle < least) || (d.burns && u.throttle > OUT * least) }
    }
    fn guards(&self, u: &EngineIn) -> LeastThrottle {
        let least = self.p.throttle_min;
        if least == 0.0 {
            return LeastThrottle { lights: -1.0, goes_out: -1.0 };
        }
        LeastThrottle { lights: u.throttle - least, goes_out: OUT * least - u.throttle }
    }
    fn handle_event(&self, fired: Fired<'_>, d: &Burning) -> ((), Burning) {
        ((), Burning { burns: fired.rose(0) || (d.burns && !fired.rose(1)) })
    }
    fn must_be_wired(&self) -> Vec<(&'static str, BuildError)> {
        crate::engine::needs_pressure(self.p.exit_area)
    }
    fn feedthrough(&self, d: &Burning, u: &EngineIn) -> EngineOut {
        let p = &self.p;
        let throttle = u.throttle.clamp(0.0, 1.0);
        let off = p.throttle_min == 0.0 && throttle <= 0.0;
        // Within a step the engine continues to burn, at least at its minimum throttle.
        let throttle = if throttle < p.throttle_min { p.throttle_min } else { throttle };
        if !u.propellant.available || off || (p.throttle_min > 0.0 && !d.burns) {
            return EngineOut {
                load: Wrench::zero(),
                propellant: MassFlow { flow: 0.0 },
                thrust: 0.0,
            };
        }
        let thrust = nozzle_thrust(throttle * p.thrust, u.pressure, p.exit_area);
        let flow = throttle * p.thrust / (p.specific_impulse * G0);
        let path = u.nozzle.rotation * p.flow_path;
        let coriolis = u.nozzle.angular.cross(&path) * (-2.0 * flow);
        let (x, y) = (cut(u.gimbal_x, p.gimbal_max), cut(u.gimbal_y, p.gimbal_max));
        // The direction of the thrust is R_x R_y z.
        let along = Vec3::new(y.sin(), -x.sin() * y.cos(), x.cos() * y.cos());
        let force = u.nozzle.rotation * along * thrust + coriolis;
        let moment = (path * -0.5).cross(&coriolis);
        EngineOut { load: Wrench { moment, force }, propellant: MassFlow { flow }, thrust }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// At 5 % throttle on the ground the ambient pressure is stronger than the jet: the thrust is zero and not negative.
    #[test]
    fn a_jet_that_is_too_weak_does_not_pull_backwards() {
        let p = EngineParams {
            thrust: 1e5,
            specific_impulse: 300.0,
            exit_area: 0.1,
            flow_path: Vec3::zeros(),
            throttle_min: 0.0,
            gimbal_max: 0.0,
        };
        let m = Engine { p };
        let at = |throttle: f64| {
            let (nozzle, pressure) = (NodeState::identity(), 101_325.0);
            let u = EngineIn {
                nozzle,
                throttle,
                propellant: Propellant { available: true },
                pressure,
                gimbal_x: 0.0,
                gimbal_y: 0.0,
            };
            m.feedthrough(&Burning { burns: throttle > 0.0 }, &u)
        };
        assert!(at(0.05).thrust == 0.0 && at(0.05).propellant.flow > 0.0 && at(0.0).thrust == 0.0);
        // NaN must not be replaced.
        assert!(nozzle_thrust(1e5, f64::NAN, 0.1).is_nan() && at(f64::NAN).thrust.is_nan());
        assert!((at(0.5).thrust - (5e4 - 10_132.5)).abs() < 1e-9);
    }

    fn engine() -> Engine {
        let p = EngineParams {
            thrust: 1000.0,
            specific_impulse: 300.0,
            exit_area: 0.01,
            flow_path: Vec3::new(0.0, 0.0, -2.0),
            throttle_min: 0.4,
            gimbal_max: 0.1,
        };
        Engine { p }
    }

    fn at(throttle: f64, supply: bool, pressure: f64, angular: Vec3) -> EngineOut {
        let nozzle = NodeState { angular, ..NodeState::identity() };
        let u = EngineIn {
            nozzle,
            throttle,
            propellant: Propellant { available: supply },
            pressure,
            gimbal_x: 0.0,
            gimbal_y: 0.0,
        };
        {
            let m = engine();
            let d = m.mode(&Burning { burns: false }, &u);
            m.feedthrough(&d, &u)
        }
    }

    #[test]
    fn thrust_and_flow_follow_throttle_supply_and_pressure() {
        let full = at(2.0, true, 0.0, Vec3::zeros());
        assert_eq!((full.thrust, full.load.force), (1000.0, Vec3::new(0.0, 0.0, 1000.0)));
        assert!((full.propellant.flow * 300.0 * 9.80665 - 1000.0).abs() < 1e-12);
        let air = at(0.5, true, 1e4, Vec3::zeros());
        assert!(
            (air.thrust - 400.0).abs() < 1e-12
                && (air.propellant.flow - 0.5 * full.propellant.flow).abs() < 1e-15
        );
        assert!(at(f64::NAN, true, 0.0, Vec3::zeros()).thrust.is_nan());
        for off in [at(0.3, true, 0.0, Vec3::x()), at(1.0, false, 1e5, Vec3::x())] {
            assert_eq!((off.propellant.flow, off.thrust, off.load), (0.0, 0.0, Wrench::zero()));
        }
    }

    #[test]
    fn a_gimbal_turns_the_thrust_as_far_as_it_goes() {
        let rotation = Quat::from_scaled_axis(Vec3::new(0.3, 0.9, -0.4));
        let nozzle = NodeState { rotation, ..NodeState::identity() };
        let force = |gimbal_x: f64, gimbal_y: f64| {
            let u = EngineIn {
                nozzle,
                throttle: 1.0,
                propellant: Propellant { available: true },
                pressure: 0.0,
                gimbal_x,
                gimbal_y,
            };
            {
                let m = engine();
                let d = m.mode(&Burning { burns: false }, &u);
                m.feedthrough(&d, &u)
            }
            .load
            .force
        };
        let turn = |x: f64, y: f64| {
            let q = Quat::from_scaled_axis(Vec3::x() * x) * Quat::from_scaled_axis(Vec3::y() * y);
            rotation * q * Vec3::z() * 1000.0
        };
        assert!((force(0.06, -0.03) - turn(0.06, -0.03)).norm() < 1e-11);
        assert!((force(0.5, -0.2) - turn(0.1, -0.1)).norm() < 1e-11, "cut off");
    }

    #[test]
    fn jet_damping_is_that_of_the_flow_between_two_points() {
        // The nozzle is at −3 m and the surface at −1 m from the centre of mass, so the jet damping
        // is ṁ (k² − l²) ω.
        let omega = Vec3::new(0.1, 0.0, 0.0);
        let y = at(1.0, true, 0.0, omega);
        let coriolis = y.load.force - Vec3::new(0.0, 0.0, 1000.0);
        let about_com = y.load.moment + Vec3::new(0.0, 0.0, -3.0).cross(&coriolis);
        let want = omega * (y.propellant.flow * (1.0 - 9.0));
        assert!((about_com - want).norm() < 1e-14, "{about_com} {want}");
    }
}
