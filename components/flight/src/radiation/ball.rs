//! `flight.radiation_pressure`: solar radiation pressure on a sphere, with the shadows of bodies.
//! ```text
//! F = −ν E/c C_r A ŝ        E: power of sunlight at the place, ŝ from the body to the Sun
//! ν = visible part of the Sun's disc
//! ```
//! Edges of penumbra and umbra are events: an adaptive integrator stops at them instead of rejecting steps there.
//! The force acts at the node and gives no moment there.

use linkwork_surroundings::prelude::*;

/// Shape and light.
#[derive(Params, Clone, Debug)]
pub struct RadiationParams {
    /// Area against the Sun.
    #[param(unit = "m^2", range = 0.0..)]
    pub area: f64,
    /// C_r: 1 absorbs the light, 2 reflects it back.
    #[param(default = 1.3, range = 0.0..=2.0)]
    pub reflectivity: f64,
    /// The Sun, with the bodies that can eclipse it.
    #[param(service)]
    pub sun: Handle<dyn Sun>,
}

/// The body.
#[derive(Ports, Clone, Copy, Debug)]
pub struct RadiationIn {
    /// Node at which the radiation pressure acts.
    #[port(bind = "body")]
    pub body: NodeState,
}

/// Force and light.
#[derive(Ports, Clone, Copy, Debug)]
pub struct RadiationOut {
    /// Force of the light.
    #[port(bind = "body")]
    pub load: Wrench,
    /// Visible fraction of the solar disc.
    #[port("1")]
    pub visible: f64,
    /// Solar radiation pressure on an absorbing surface, including the shadow.
    #[port("N/m^2")]
    pub pressure: f64,
}

/// Pressure of sunlight.
pub struct RadiationPressure {
    p: RadiationParams,
}

/// Solar radiation pressure on a sphere, with the conical shadows of all bodies of the world.
#[model("flight.radiation_pressure")]
impl Model for RadiationPressure {
    type Params = RadiationParams;
    type FeedthroughInputs = RadiationIn;
    type FeedthroughOutputs = RadiationOut;
    type Guards = ShadowEdges;
    fn feedthrough(&self, clock: &Clock, u: &RadiationIn) -> RadiationOut {
        let light = self.p.sun.light(clock.t, &u.body.position);
        let pressure = light.visible * light.pressure();
        let force = light.direction * (-pressure * self.p.reflectivity * self.p.area);
        let load = Wrench { moment: Vec3::zeros(), force };
        RadiationOut { load, visible: light.visible, pressure }
    }
    fn guards(&self, clock: &Clock, u: &RadiationIn) -> ShadowEdges {
        ShadowEdges::of(&self.p.sun.light(clock.t, &u.body.position))
    }
    /// The event has no state: the integrator only restarts behind the edge of the shadow.
    fn handle_event(&self) -> ((), ()) {
        ((), ())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;

    /// A Sun along x at 1 AU that is partly visible.
    struct Along(f64);
    impl Sun for Along {
        fn state(&self, _: f64) -> SunState {
            SunState { direction: Vec3::x(), distance_au: 1.0 }
        }
        fn light(&self, _: f64, _: &Vec3) -> Light {
            Light {
                direction: Vec3::x(),
                distance: 1.5e11,
                irradiance: 1361.0,
                visible: self.0,
                penumbra: -0.1,
                umbra: 0.2,
            }
        }
    }

    #[test]
    fn light_presses_away_from_the_sun_as_far_as_it_is_seen() {
        for visible in [1.0, 0.3, 0.0] {
            let sun = Handle::new("sun", Arc::new(Along(visible)) as Arc<dyn Sun>);
            let m = RadiationPressure { p: RadiationParams { area: 18.0, reflectivity: 1.3, sun } };
            let (c, u) = (Clock::at(0.0, 0.01, 0), RadiationIn { body: NodeState::identity() });
            let y = m.feedthrough(&c, &u);
            let pressure = visible * linkwork_surroundings::SOLAR_CONSTANT
                / linkwork_surroundings::SPEED_OF_LIGHT;
            assert!((y.pressure - pressure).abs() < 1e-20 && y.visible == visible);
            assert!((y.load.force + Vec3::x() * (pressure * 1.3 * 18.0)).norm() < 1e-18);
            let g = m.guards(&c, &u);
            assert_eq!((g.penumbra, g.umbra), (-0.1, 0.2));
        }
    }
}
