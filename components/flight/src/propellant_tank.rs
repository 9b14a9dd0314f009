//! `flight.propellant_tank`: propellant that is part of a body's mass while it lasts.
//! ```text
//! ṁ = −Σ flow        h = m/(ρ π r²)        from the node: com (0, 0, h/2)
//! I about the com: x, y: m (3 r² + h²)/12, z: m r²/2
//! ```
//! The propellant stands settled on the bottom of an upright cylinder (no slosh): node z points from
//! the bottom to the surface. The body's own mass in the file is the dry mass. Running dry is an event.

use linkwork_runtime::prelude::*;

/// The tank and what is in it.
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
}

/// What is drawn.
#[derive(Ports, Clone, Copy, Debug)]
pub struct Drawn {
    /// Mass flow out of the tank, of all that draw from it.
    #[port("kg/s", sum, default = 0.0)]
    pub flow: f64,
}

/// Mass, and what is left.
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
    /// There is propellant.
    #[port]
    pub supplies: bool,
}

/// What is in it.
#[derive(State, Clone, Copy, Debug)]
pub struct Content {
    /// Propellant.
    #[port("kg")]
    pub mass: f64,
}

/// Whether it has run dry.
#[derive(State, Clone, Copy, Debug)]
pub struct Dry {
    /// Nothing is left.
    #[port]
    pub dry: bool,
}

/// The end of the propellant.
#[derive(Ports, Clone, Copy, Debug)]
pub struct Bottom {
    /// Propellant left.
    #[port("kg", falling)]
    pub left: f64,
}

/// A tank.
pub struct PropellantTank {
    p: TankParams,
}

/// A tank of settled propellant that adds its mass to a body and runs dry.
#[model("flight.propellant_tank")]
impl Model for PropellantTank {
    type Params = TankParams;
    type U = Drawn;
    type Ym = TankOut;
    type X = Content;
    type D = Dry;
    type G = Bottom;
    fn init_x(&self) -> Content {
        Content { mass: self.p.propellant }
    }
    fn init_d(&self) -> Dry {
        Dry { dry: self.p.propellant == 0.0 }
    }
    fn moore(&self, _: &Clock, x: &Content, d: &Dry) -> TankOut {
        // A stage of the integrator may look behind the end of the propellant.
        let m = if d.dry { 0.0 } else { x.mass.max(0.0) };
        let r2 = self.p.radius * self.p.radius;
        let level = m / (self.p.density * std::f64::consts::PI * r2);
        let across = m * (3.0 * r2 + level * level) / 12.0;
        let central = Vec3::new(across, across, 0.5 * m * r2);
        TankOut {
            added: AddedMass::of(m, &Vec3::new(0.0, 0.0, 0.5 * level), &central),
            propellant: m,
            level,
            supplies: !d.dry,
        }
    }
    fn deriv(&self, _: &Clock, _: &Content, d: &Dry, u: &Drawn) -> Content {
        Content { mass: if d.dry { 0.0 } else { -u.flow } }
    }
    fn guards(&self, _: &Clock, x: &Content) -> Bottom {
        Bottom { left: x.mass }
    }
    fn fired(&self, _: &Clock, _: usize, _: &Content, _: &Dry) -> (Content, Dry) {
        (Content { mass: 0.0 }, Dry { dry: true })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_full_tank_is_a_cylinder() {
        let p = TankParams { propellant: 1000.0, radius: 0.5, density: 800.0 };
        let tank = PropellantTank { p };
        let x = tank.init_x();
        let y = tank.moore(&Clock::at(0.0, 0.01, 0), &x, &Dry { dry: false }, &());
        let h = 1000.0 / (800.0 * std::f64::consts::PI * 0.25);
        assert!((y.level - h).abs() < 1e-15 && y.supplies);
        assert!((y.added.first_moment - Vec3::new(0.0, 0.0, 500.0 * h)).norm() < 1e-12);
        // About its end: m (r²/4 + h²/3).
        let want = 1000.0 * (0.25 / 4.0 + h * h / 3.0);
        assert!((y.added.inertia[0] - want).abs() < 1e-12 * want);
        assert!((y.added.inertia[2] - 125.0).abs() < 1e-12);
    }

    #[test]
    fn it_ends_empty_and_draws_no_more() {
        let tank =
            PropellantTank { p: TankParams { propellant: 1.0, radius: 0.5, density: 1000.0 } };
        let c = Clock::at(0.0, 0.01, 0);
        let (x, d) = tank.fired(
            &c,
            0,
            &Content { mass: -1e-15 },
            &Dry { dry: false },
            &Drawn { flow: 0.0 },
            &(),
            &mut (),
        );
        assert_eq!((x.mass, d.dry), (0.0, true));
        let rate = tank.deriv(&c, &x, &d, &Drawn { flow: 3.0 }, &(), &(), &());
        assert_eq!(rate.mass, 0.0);
        let y = tank.moore(&c, &x, &d, &());
        assert!(!y.supplies && y.added == AddedMass::zero());
    }
}
