//! `flight.vector_thrust`: engines represented by one force that follows a command, for flight in three degrees of freedom.
//! ```text
//! Ḟ = (F_cmd − F)/τ      F in vacuum, W, at the node      ṁ = |F|/(I_sp g₀)
//! F max(0, 1 − p A_e/|F|)      what acts: the ambient pressure on the nozzles' exits
//! ```
//! The attitude is not used; this is valid if the vehicle turns fast enough. Without τ the force is the command.

use crate::engine::nozzle_thrust;
use linkwork_runtime::prelude::*;

/// Standard gravity, m/s².
const G0: f64 = 9.80665;

/// Engines.
#[derive(Params, Clone, Debug)]
pub struct VectorThrustParams {
    /// Specific impulse.
    #[param(unit = "s", range = 1e-3..)]
    pub specific_impulse: f64,
    /// Time constant τ of the lag; 0: none.
    #[param(unit = "s", default = 0.0, range = 0.0..)]
    pub lag: f64,
    /// Area of the nozzles' exits, on which the ambient pressure acts.
    #[param(unit = "m^2", default = 0.0, range = 0.0..)]
    pub exit_area: f64,
    /// Force at the start, W.
    #[param(unit = "N", default = Vec3::zeros(), needs = "lag")]
    pub start: Vec3,
}

/// Node and command.
#[derive(Ports, Clone, Copy, Debug)]
pub struct VectorThrustIn {
    /// Node at which the force acts.
    #[port(bind = "body")]
    pub body: NodeState,
    /// Commanded force in vacuum, W.
    #[port("N")]
    pub command: Vec3,
    /// Connection to the source of the propellant.
    #[port(connector)]
    pub propellant: Propellant,
    /// Ambient pressure.
    #[port("Pa", default = 0.0)]
    pub pressure: f64,
}

/// Load and flow.
#[derive(Ports, Clone, Copy, Debug)]
pub struct VectorThrustOut {
    /// Load on the body.
    #[port(bind = "body")]
    pub load: Wrench,
    /// Magnitude of the force; 0 where the ambient pressure is stronger than the jets.
    #[port("N")]
    pub thrust: f64,
    /// Propellant that it takes.
    #[port(connector)]
    pub propellant: MassFlow,
}

/// The force.
#[derive(State, Clone, Copy, Debug)]
pub struct Force {
    /// Force, W.
    #[port("N")]
    pub force: Vec3,
}

/// Engines as one force.
pub struct VectorThrust {
    p: VectorThrustParams,
}

/// Engines as one force in W that follows a command with a lag and consumes propellant.
#[model("flight.vector_thrust")]
impl Model for VectorThrust {
    type Params = VectorThrustParams;
    type FeedthroughInputs = VectorThrustIn;
    type FeedthroughOutputs = VectorThrustOut;
    type State = Force;
    fn must_be_wired(&self) -> Vec<(&'static str, BuildError)> {
        crate::engine::needs_pressure(self.p.exit_area)
    }
    fn init_x(&self) -> Force {
        Force { force: self.p.start }
    }
    fn feedthrough(&self, x: &Force, u: &VectorThrustIn) -> VectorThrustOut {
        let force = match (u.propellant.available, self.p.lag > 0.0) {
            (false, _) => Vec3::zeros(),
            (true, true) => x.force,
            (true, false) => u.command,
        };
        let vacuum = force.norm();
        let thrust = nozzle_thrust(vacuum, u.pressure, self.p.exit_area);
        let acting = if thrust < vacuum { force * (thrust / vacuum) } else { force };
        VectorThrustOut {
            load: Wrench { moment: Vec3::zeros(), force: acting },
            thrust,
            propellant: MassFlow { flow: vacuum / (self.p.specific_impulse * G0) },
        }
    }
    fn derivatives(&self, x: &Force, u: &VectorThrustIn) -> Force {
        let lag = self.p.lag;
        let zero = Vec3::zeros();
        Force { force: if lag > 0.0 { (u.command - x.force) / lag } else { zero } }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_pressure_takes_thrust_and_no_propellant() {
        let p = VectorThrustParams {
            specific_impulse: 311.0,
            lag: 0.0,
            exit_area: 4.2,
            start: Vec3::zeros(),
        };
        let m = VectorThrust { p };
        let at = |command: Vec3, pressure: f64| {
            let u = VectorThrustIn {
                body: NodeState::identity(),
                command,
                propellant: Propellant { available: true },
                pressure,
            };
            m.feedthrough(&Force { force: Vec3::zeros() }, &u)
        };
        let command = Vec3::new(-3.0e5, 0.0, 4.0e5);
        let (vacuum, ground) = (at(command, 0.0), at(command, 1e5));
        assert_eq!((vacuum.load.force, vacuum.thrust), (command, 5.0e5));
        assert!(
            (ground.thrust - 0.8e5).abs() < 1e-9
                && ground.propellant.flow == vacuum.propellant.flow
        );
        assert!((ground.load.force - command * 0.16).norm() < 1e-9);
        // After a command of zero, the rest of a lagging force must not pull backwards.
        let weak = at(Vec3::z() * 1e-3, 1e5);
        assert!(
            weak.thrust == 0.0 && weak.load.force == Vec3::zeros() && weak.propellant.flow > 0.0
        );
        // An engine that is off does not have a jet, so the ambient pressure has no effect.
        assert_eq!(at(Vec3::zeros(), 1e5).load, Wrench::zero());
    }

    #[test]
    fn it_follows_its_command_with_the_lag_and_takes_propellant() {
        let p = VectorThrustParams {
            specific_impulse: 222.0,
            lag: 0.12,
            exit_area: 0.0,
            start: Vec3::x() * 10.0,
        };
        let m = VectorThrust { p };
        let command = Vec3::new(0.0, 300.0, 400.0);
        let u = VectorThrustIn {
            body: NodeState::identity(),
            command,
            propellant: Propellant { available: true },
            pressure: 0.0,
        };
        let x = Force { force: Vec3::y() * 60.0 };
        let y = m.feedthrough(&x, &u);
        assert!(y.thrust == 60.0 && (y.propellant.flow * 222.0 * G0 - 60.0).abs() < 1e-12);
        let rate = m.derivatives(&x, &u).force;
        assert!((rate - Vec3::new(0.0, 2000.0, 400.0 / 0.12)).norm() < 1e-9);
        let dry = VectorThrustIn { propellant: Propellant { available: false }, ..u };
        assert_eq!(m.feedthrough(&x, &dry).load, Wrench::zero());
        let p = VectorThrustParams { lag: 0.0, start: Vec3::zeros(), ..m.p.clone() };
        assert_eq!(VectorThrust { p }.feedthrough(&x, &u).thrust, 500.0);
    }
}
