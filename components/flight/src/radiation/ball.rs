//! `flight.radiation_pressure`: sunlight presses on a ball, except in the shadow of its planet.
//! ```text
//! F = −ν P (AU/d)² C_r A ŝ        P = 4.56e-6 N/m²; ŝ, d from the body to the Sun
//! ν = visible part of the Sun's disc behind a round planet at the origin of W (Montenbruck & Gill, 3.4.2)
//! ```
//! Edges of penumbra and umbra are events: an adaptive integrator stops at them instead of stumbling over them.
//! The force acts at the node and gives no moment there.

use super::{Edges, look};
use linkwork_runtime::prelude::*;
use linkwork_world::eclipse::{cannonball, pressure};

/// Shape and light.
#[derive(Params, Clone, Debug)]
pub struct RadiationParams {
    /// Area against the Sun.
    #[param(unit = "m^2", range = 0.0..)]
    pub area: f64,
    /// C_r: 1 swallows the light, 2 throws it back.
    #[param(default = 1.3, range = 0.0..=2.0)]
    pub reflectivity: f64,
    /// Radius of the planet that casts a shadow; 0: none.
    #[param(unit = "m", default = 6_378_137.0, range = 0.0..)]
    pub planet_radius: f64,
    /// The Sun, seen from the origin of W.
    #[param(service)]
    pub sun: Handle<dyn Sun>,
}

/// The body.
#[derive(Ports, Clone, Copy, Debug)]
pub struct RadiationIn {
    /// Where the light presses.
    #[port(bind = "body")]
    pub body: NodeState,
}

/// Force and light.
#[derive(Ports, Clone, Copy, Debug)]
pub struct RadiationOut {
    /// Force of the light.
    #[port(bind = "body")]
    pub load: Wrench,
    /// Visible part of the Sun.
    #[port("1")]
    pub visible: f64,
    /// Pressure on what swallows it, shadow included.
    #[port("N/m^2")]
    pub pressure: f64,
}

/// Pressure of sunlight.
pub struct RadiationPressure {
    p: RadiationParams,
}

/// Pressure of sunlight on a ball, with the conical shadow of the planet at the origin of W.
#[model("flight.radiation_pressure")]
impl Model for RadiationPressure {
    const INERTIAL: bool = true;
    type Params = RadiationParams;
    type Ud = RadiationIn;
    type Yd = RadiationOut;
    type G = Edges;
    fn direct(&self, c: &Clock, _: &(), _: &(), u: &RadiationIn) -> RadiationOut {
        let (sun, discs) = look(&*self.p.sun, self.p.planet_radius, c.t, u.body.position);
        let to_sun = sun - u.body.position;
        let visible = discs.visible_fraction();
        // Area over a mass of 1 kg: newtons.
        let force = cannonball(&to_sun, self.p.area, self.p.reflectivity, visible);
        RadiationOut {
            load: Wrench { moment: Vec3::zeros(), force },
            visible,
            pressure: visible * pressure(to_sun.norm()),
        }
    }
    fn guards(&self, c: &Clock, _: &(), _: &(), _: &(), u: &RadiationIn) -> Edges {
        Edges::of(&look(&*self.p.sun, self.p.planet_radius, c.t, u.body.position).1)
    }
    /// Nothing is remembered: the integrator begins anew behind the edge, and that is all.
    fn fired(&self, _: &Clock, _: usize) -> ((), ()) {
        ((), ())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;

    struct Along(Vec3);
    impl Sun for Along {
        fn state(&self, _: f64) -> SunState {
            SunState { direction: self.0, distance_au: 1.0 }
        }
    }

    fn lit(at: Vec3) -> (RadiationOut, Edges) {
        let sun = Arc::new(Along(Vec3::x())) as Arc<dyn Sun>;
        let p = RadiationParams {
            area: 18.0,
            reflectivity: 1.3,
            planet_radius: 6_378_137.0,
            sun: Handle::new("sun", sun),
        };
        let model = RadiationPressure { p };
        let body = NodeState { position: at, ..NodeState::identity() };
        let (c, u) = (Clock::at(0.0, 0.01, 0), RadiationIn { body });
        let y = model.direct(&c, &(), &(), &u, &());
        (y, model.guards(&c, &(), &(), &(), &u, &()))
    }

    #[test]
    fn light_presses_away_from_the_sun_and_not_in_the_shadow() {
        let (y, g) = lit(Vec3::new(0.0, 7e6, 0.0));
        let want = 4.56e-6 * 1.3 * 18.0;
        assert!((y.load.force.norm() / want - 1.0).abs() < 1e-8 && y.load.force.x < 0.0);
        assert!((y.pressure - 4.56e-6).abs() < 1e-13 && g.penumbra > 0.0 && g.umbra > 0.0);
        let (y, g) = lit(Vec3::new(-7e6, 1e5, 0.0));
        assert!(y.visible == 0.0 && y.load.force.norm() == 0.0 && g.umbra < 0.0);
        // Somewhere between them the Sun is cut in two.
        let edge = |h: f64| lit(Vec3::new(-7e6, h, 0.0));
        let (mut low, mut high) = (6.2e6, 6.5e6);
        for _ in 0..60 {
            let h = 0.5 * (low + high);
            if edge(h).0.visible < 0.5 { low = h } else { high = h }
        }
        let (y, g) = edge(low);
        assert!((y.visible - 0.5).abs() < 1e-6 && g.penumbra < 0.0 && g.umbra > 0.0, "{low} {y:?}");
        // The planet's edge hides the middle of the Sun: its height is the planet's radius, nearly.
        assert!((low - 6_378_137.0).abs() < 5e3, "{low}");
    }
}
