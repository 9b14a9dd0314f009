//! `flight.propellant_tank`: tank whose propellant is part of the mass of a body.
//! ```text
//! ṁ = −Σ ṁ_out      h = m/(ρ π r²)        from the node: com (0, 0, h/2)
//! I about the com: x, y: m (3 r² + h²)/12, z: m r²/2
//! ```
//! The propellant is settled on the bottom of an upright cylinder: node z points from the bottom to
//! the surface. The body's own mass in the file is the dry mass. Running dry is an event. A dry tank can be filled; it supplies propellant again when
//! 0.1 mm of propellant cover its bottom, so that the supply does not switch on and off endlessly.
//!
//! If `slosh: apart` is written, a `flight.slosh` part carries the mass m₁ of the first slosh mode, with data from these outputs:
//! ```text
//! m₀ = m − m₁      m₀ h₀ = m h/2 − m₁ h₁      I₀ + m₀ h₀² = m (r²/4 + h²/3) − m₁ h₁²      I_z: the less of m r²/2 and 2 I₀
//! ```
//! While the slosh mass is at rest, mass, first moment and lateral moments of inertia equal those of the whole propellant. The moments are those of
//! solid propellant; those of a liquid are not greater about any axis.

use crate::propulsion::slosh::Slosh;
use linkwork_runtime::prelude::*;

/// Representation of the first slosh mode.
#[derive(Params, Clone, Copy, Debug, PartialEq, Eq)]
pub enum SloshMode {
    /// All of the propellant moves with the tank.
    Settled,
    /// A `flight.slosh` represents the mass of the first mode.
    Apart,
}

/// Data of the tank and its propellant.
#[derive(Params, Clone, Debug)]
pub struct TankParams {
    /// Propellant at the start.
    #[param(unit = "kg", range = 0.0..)]
    pub propellant: f64,
    /// Inner radius.
    #[param(unit = "m", range = 1e-6..)]
    pub radius: f64,
    /// Density of the propellant.
    #[param(unit = "kg/m^3", default = 1000.0, range = 1e-3..)]
    pub density: f64,
    /// Mass of the first slosh mode: settled (in the tank), apart (in a `flight.slosh`).
    #[param(default = SloshMode::Settled)]
    pub slosh: SloshMode,
}

/// Flow out of the tank.
#[derive(Ports, Clone, Copy, Debug)]
pub struct Drawn {
    /// Flow that engines, lines and drains draw from the outlet.
    #[port(connector)]
    pub outlet: MassFlows,
}

/// Mass properties and remaining propellant.
#[derive(Ports, Clone, Copy, Debug)]
pub struct TankOut {
    /// Mass that the propellant adds to the body.
    #[port(bind = "bottom")]
    pub added: AddedMass,
    /// Propellant.
    #[port("kg")]
    pub propellant: f64,
    /// Height of the surface over the bottom.
    #[port("m")]
    pub level: f64,
    /// Outlet, to which engines, lines and drains are connected.
    #[port(connector)]
    pub outlet: Propellant,
    /// Volume of the propellant.
    #[port("m^3")]
    pub volume: f64,
    /// Mass of the first slosh mode, for `flight.slosh`.
    #[port("kg")]
    pub swinging: f64,
    /// Height of the mass of the first slosh mode over the bottom.
    #[port("m")]
    pub swing_height: f64,
    /// Ratio of the square of its frequency to the acceleration along z.
    #[port("1/m")]
    pub swing_stiffness: f64,
}

/// Content of the tank.
#[derive(State, Clone, Copy, Debug)]
pub struct Content {
    /// Propellant.
    #[port("kg", stored)]
    pub mass: f64,
}

/// State of the supply.
#[derive(State, Clone, Copy, Debug)]
pub struct Dry {
    /// The tank is empty, or contains too little propellant to supply it.
    #[port]
    pub dry: bool,
}

/// Guards for the end of the propellant and for the return of the supply.
#[derive(Ports, Clone, Copy, Debug)]
pub struct Bottom {
    /// Remaining propellant, while the tank supplies it.
    #[port("kg", falling)]
    pub left: f64,
    /// Propellant minus the amount from which a dry tank supplies again.
    #[port("kg", rising)]
    pub filled: f64,
}

/// Indices of the guards in [`Bottom`].
const FILLED: usize = 1;

/// Level (m) from which a dry tank supplies again.
const FILM: f64 = 1e-4;

/// A tank.
pub struct PropellantTank {
    p: TankParams,
}

impl PropellantTank {
    /// Mass (kg) of propellant per metre of level.
    fn per_metre(&self) -> f64 {
        self.p.density * std::f64::consts::PI * self.p.radius * self.p.radius
    }
}

/// A tank of settled propellant that adds its mass to a body and runs dry.
#[model("flight.propellant_tank")]
impl Model for PropellantTank {
    type Params = TankParams;
    type Inputs = Drawn;
    type Outputs = TankOut;
    type State = Content;
    type DiscreteState = Dry;
    type Guards = Bottom;
    fn must_be_read(&self) -> Vec<(&'static str, BuildError)> {
        if self.p.slosh == SloshMode::Settled {
            return Vec::new();
        }
        let fact = "the mass of the first slosh mode belongs to a `flight.slosh`, but none is connected, so this mass is in no body";
        let help = "wire swinging, swing_height and swing_stiffness to a `flight.slosh`, or write `slosh: settled`";
        vec![("swinging", BuildError::new(fact).help(help))]
    }
    fn init_x(&self) -> Content {
        Content { mass: self.p.propellant }
    }
    fn init_d(&self) -> Dry {
        Dry { dry: self.p.propellant == 0.0 }
    }
    fn outputs(&self, x: &Content, d: &Dry) -> TankOut {
        // A stage of the integrator may continue past the end of the propellant.
        let m = x.mass.max(0.0);
        let r2 = self.p.radius * self.p.radius;
        let level = m / self.per_metre();
        let mode = Slosh { radius: self.p.radius, height: level, mass: m };
        let swing_height = mode.attachment();
        let (mut swinging, mut centre) = (0.0, 0.5 * level);
        let mut across = m * (3.0 * r2 + level * level) / 12.0;
        let mut about = 0.5 * m * r2;
        if self.p.slosh == SloshMode::Apart && m > 0.0 {
            swinging = mode.swinging();
            let rest = m - swinging;
            let gap = |h: f64| (h - centre) * (h - centre);
            let h0 = (m * centre - swinging * swing_height) / rest;
            // Subtract the moments about the common centre of mass, which does not change.
            across -= swinging * gap(swing_height) + rest * gap(h0);
            about = about.min(2.0 * across);
            centre = h0;
        }
        let rest = m - swinging;
        let central = Vec3::new(across, across, about);
        TankOut {
            added: AddedMass::of(rest, &Vec3::new(0.0, 0.0, centre), &central),
            propellant: m,
            level,
            outlet: Propellant { available: !d.dry },
            volume: m / self.p.density,
            swinging,
            swing_height,
            swing_stiffness: mode.per_acceleration(),
        }
    }
    fn derivatives(&self, d: &Dry, u: &Drawn) -> Content {
        // A dry tank supplies nothing, but it can be filled.
        let flow = u.outlet.flow;
        Content { mass: if d.dry { (-flow).max(0.0) } else { -flow } }
    }
    fn guards(&self, x: &Content, d: &Dry) -> Bottom {
        let filled = x.mass - FILM * self.per_metre();
        match d.dry {
            // A positive value means that the end of the propellant has already been reported, so
            // that it is not due again in a later phase.
            true => Bottom { left: 1.0, filled },
            false => Bottom { left: x.mass, filled: -1.0 },
        }
    }
    fn handle_event(&self, fired: Fired<'_>, x: &Content) -> (Content, Dry) {
        if fired.rose(FILLED) {
            return (*x, Dry { dry: false });
        }
        (Content { mass: 0.0 }, Dry { dry: true })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use linkwork_spatial::RigidInertia;
    use linkwork_spatial::nalgebra::Matrix3;

    fn params(propellant: f64, density: f64) -> TankParams {
        TankParams { propellant, radius: 0.5, density, slosh: SloshMode::Settled }
    }

    /// At all fill levels, mass and moments including the slosh mass equal those of the whole propellant, and the remainder is physically possible.
    #[test]
    fn what_swings_is_taken_from_the_rest() {
        for propellant in [1e-3, 1.0, 30.0, 200.0, 600.0, 5000.0] {
            let at = |slosh| {
                let tank = PropellantTank { p: TankParams { slosh, ..params(propellant, 800.0) } };
                let x = tank.init_x();
                tank.outputs(&x, &Dry { dry: false })
            };
            let (all, apart) = (at(SloshMode::Settled), at(SloshMode::Apart));
            assert!(all.swinging == 0.0 && apart.swinging > 0.0);
            let particle = Vec3::new(0.0, 0.0, apart.swing_height);
            let particle = AddedMass::of(apart.swinging, &particle, &Vec3::zeros());
            let near = |a: f64, b: f64| (a - b).abs() < 1e-12 * b.abs().max(1e-9 * propellant);
            assert!(near(apart.added.mass + particle.mass, propellant));
            let first = apart.added.first_moment + particle.first_moment;
            assert!(near(first.z, all.added.first_moment.z), "{propellant}");
            for k in [0, 1] {
                let sum = apart.added.inertia[k] + particle.inertia[k];
                assert!(near(sum, all.added.inertia[k]), "{propellant}");
            }
            let [xx, yy, zz, ..] = apart.added.inertia;
            assert!(zz <= all.added.inertia[2] && zz > 0.4 * all.added.inertia[2]);
            let moments = Matrix3::from_diagonal(&Vec3::new(xx, yy, zz));
            let (m, h) = (apart.added.mass, apart.added.first_moment);
            assert!(RigidInertia::from_moments(m, h, moments).is_ok(), "{propellant}");
        }
    }

    #[test]
    fn a_full_tank_is_a_cylinder() {
        let p = params(1000.0, 800.0);
        let tank = PropellantTank { p };
        let x = tank.init_x();
        let y = tank.outputs(&x, &Dry { dry: false });
        let h = 1000.0 / (800.0 * std::f64::consts::PI * 0.25);
        assert!((y.level - h).abs() < 1e-15 && y.outlet.available);
        assert!((y.added.first_moment - Vec3::new(0.0, 0.0, 500.0 * h)).norm() < 1e-12);
        // The moment of inertia about the end is m (r²/4 + h²/3).
        let want = 1000.0 * (0.25 / 4.0 + h * h / 3.0);
        assert!((y.added.inertia[0] - want).abs() < 1e-12 * want);
        assert!((y.added.inertia[2] - 125.0).abs() < 1e-12);
    }

    #[test]
    fn it_ends_empty_and_draws_no_more() {
        let tank = PropellantTank { p: params(1.0, 1000.0) };
        let (x, d) = tank.handle_event(Fired::falling(0), &Content { mass: -1e-15 });
        assert_eq!((x.mass, d.dry), (0.0, true));
        let rate = tank.derivatives(&d, &Drawn { outlet: MassFlows { flow: 3.0 } });
        assert_eq!(rate.mass, 0.0);
        let y = tank.outputs(&x, &d);
        assert!(!y.outlet.available && y.added == AddedMass::zero());
    }

    #[test]
    fn a_dry_tank_can_be_filled() {
        let tank = PropellantTank { p: params(0.0, 1000.0) };
        let d = tank.init_d();
        assert!(d.dry);
        let rate = |d: &Dry| tank.derivatives(d, &Drawn { outlet: MassFlows { flow: -2.0 } }).mass;
        assert_eq!((rate(&d), rate(&Dry { dry: false })), (2.0, 2.0));
        // A film of 0.1 mm has a mass of 78.5 g.
        let film = 0.1 * std::f64::consts::PI * 0.25;
        let over = |mass: f64| tank.guards(&Content { mass }, &d).filled;
        assert!(over(film - 1e-6) < 0.0 && over(film + 1e-6) > 0.0);
        let full = Content { mass: film };
        let y = tank.outputs(&full, &d);
        assert!((y.added.mass - film).abs() < 1e-15 && (y.volume * 1000.0 - film).abs() < 1e-15);
        let (x, d) = tank.handle_event(Fired::rising(FILLED), &full);
        assert!(x.mass == film && !d.dry);
    }
}
