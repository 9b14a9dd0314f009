//! `flight.radiation_pressure`: sunlight presses on a ball, except in the shadow of its planet.
//! ```text
//! F = −ν P (AU/d)² C_r A ŝ        P = 4.56e-6 N/m²; ŝ, d from the body to the Sun
//! ν = visible part of the Sun's disc behind a round planet (Montenbruck & Gill, 3.4.2)
//! ```
//! Edges of penumbra and umbra are events: an adaptive integrator stops at them instead of stumbling over them.
//! The force acts at the node and gives no moment there.

use super::{Edges, Sky, look};
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
    /// The Sun, seen from the planet's centre.
    #[param(service)]
    pub sun: Handle<dyn Sun>,
    /// Gravity, which knows the site that W may be.
    #[param(service)]
    pub gravity: Option<Handle<dyn Gravity>>,
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
    site: Option<Site>,
}

impl RadiationPressure {
    fn look(&self, c: &Clock, u: &RadiationIn) -> Sky {
        let p = &self.p;
        look(&*p.sun, self.site.as_ref(), p.planet_radius, c.t, &u.body.position)
    }
}

/// Pressure of sunlight on a ball, with the conical shadow of the planet.
#[model("flight.radiation_pressure")]
impl Model for RadiationPressure {
    type Params = RadiationParams;
    type Ud = RadiationIn;
    type Yd = RadiationOut;
    type G = Edges;
    fn build(p: RadiationParams) -> Result<Self, BuildError> {
        let site = p.gravity.as_ref().and_then(|g| g.site());
        Ok(RadiationPressure { p, site })
    }
    fn direct(&self, c: &Clock, _: &(), _: &(), u: &RadiationIn) -> RadiationOut {
        let sky = self.look(c, u);
        let to_sun = sky.sun - sky.body;
        let visible = sky.discs.visible_fraction();
        // Area over a mass of 1 kg: newtons.
        let force = cannonball(&to_sun, self.p.area, self.p.reflectivity, visible);
        RadiationOut {
            load: Wrench { moment: Vec3::zeros(), force },
            visible,
            pressure: visible * pressure(to_sun.norm()),
        }
    }
    fn guards(&self, c: &Clock, _: &(), _: &(), _: &(), u: &RadiationIn) -> Edges {
        Edges::of(&self.look(c, u).discs)
    }
    /// Nothing is remembered: the integrator begins anew behind the edge, and that is all.
    fn fired(&self, _: &Clock, _: Fired<'_>) -> ((), ()) {
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
        lit_from(at, Vec3::x(), None)
    }

    fn lit_from(
        at: Vec3,
        sun: Vec3,
        gravity: Option<Handle<dyn Gravity>>,
    ) -> (RadiationOut, Edges) {
        let sun = Arc::new(Along(sun)) as Arc<dyn Sun>;
        let p = RadiationParams {
            area: 18.0,
            reflectivity: 1.3,
            planet_radius: 6_378_137.0,
            sun: Handle::new("sun", sun),
            gravity,
        };
        let model = RadiationPressure::build(p).unwrap();
        let body = NodeState { position: at, ..NodeState::identity() };
        let (c, u) = (Clock::at(0.0, 0.01, 0), RadiationIn { body });
        let y = model.direct(&c, &(), &(), &u, &());
        (y, model.guards(&c, &(), &(), &(), &u, &()))
    }

    #[test]
    fn from_a_site_the_planet_is_below_it() {
        let (site, gravity) = crate::attitude::tests::fast_site();
        let to_W = Quat::from_euler_angles(0.7, -0.3, 1.9);
        // In the light, in the penumbra, in the umbra.
        for r in
            [Vec3::new(0.0, 7e6, 0.0), Vec3::new(-7e6, 6.377e6, 0.0), Vec3::new(-7e6, 1e5, 0.0)]
        {
            let place = to_W * r - site.from_centre(&Vec3::zeros());
            let (a, e) = lit(r);
            let (b, f) = lit_from(place, to_W * Vec3::x(), Some(gravity.clone()));
            assert!((to_W * a.load.force - b.load.force).norm() < 1e-9 * 4.56e-6, "{a:?} {b:?}");
            assert!((a.visible - b.visible).abs() < 1e-9, "{a:?} {b:?}");
            assert!((e.penumbra - f.penumbra).abs() + (e.umbra - f.umbra).abs() < 1e-12);
        }
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
