//! `sensors.sun_sensor`: direction of the Sun in the sensor's frame, while it is visible.
//!
//! The boresight is the sensor's z axis. The Sun is visible inside the cone of view if neither the horizon nor a body of the world hides it (see
//! [`Sun::light`]) and no terrain is on the ray, which is sampled with growing steps up to `shadow_range`. Noise rotates the direction by two small
//! angles.

use linkwork_surroundings::prelude::*;

/// View and noise.
#[derive(Params, Clone, Debug)]
pub struct SunSensorParams {
    /// Half angle of the cone of view.
    #[param(unit = "rad", default = 1.05, range = 0.0..=3.15)]
    pub half_angle: f64,
    /// Standard deviation of the direction about each of two axes.
    #[param(unit = "rad", default = 0.0175, range = 0.0..)]
    pub sigma: f64,
    /// Length of the ray that is tested for terrain; 0: no shadows.
    #[param(unit = "m", default = 200.0, range = 0.0..)]
    pub shadow_range: f64,
    /// The sun.
    #[param(service)]
    pub sun: Handle<dyn Sun>,
    /// The ground that may hide the Sun (optional).
    #[param(service)]
    pub terrain: Option<Handle<dyn Terrain>>,
    /// The world, for the horizon.
    #[param(service)]
    pub world: Option<Handle<dyn World>>,
}

/// The mount.
#[derive(Ports, Clone, Copy, Debug)]
pub struct SunSensorIn {
    /// The mount.
    #[port(bind = "mount")]
    pub mount: NodeState,
}

/// Reading.
#[derive(Ports, Clone, Copy, Debug)]
pub struct SunSensorOut {
    /// Unit vector to the Sun in the sensor's frame; zero when it is not visible.
    #[port("1")]
    pub direction: Vec3,
    /// The sun is seen.
    #[port("1")]
    pub valid: bool,
    /// Elevation of the Sun (true value): above z = 0 at a site or on level ground, in inertial axes above the plane perpendicular to the line to the
    /// body's centre.
    #[port("rad")]
    pub elevation: f64,
}

/// A sun sensor.
pub struct SunSensor {
    p: SunSensorParams,
}

/// First step of the shadow ray, m.
const STEP_FIRST: f64 = 0.1;
/// Growth of the steps.
const STEP_GROWTH: f64 = 1.1;

/// Returns true if the ground blocks the ray from `from` along the unit vector `along` within `range` (m).
pub fn shaded(terrain: &dyn Terrain, from: Vec3, along: Vec3, range: f64) -> bool {
    let (mut s, mut step) = (0.0, STEP_FIRST);
    while s < range {
        s += step;
        step *= STEP_GROWTH;
        let p = from + along * s;
        match terrain.ground(p.x, p.y) {
            Some(g) if g.height > p.z => return true,
            Some(_) => {}
            None => return false,
        }
    }
    false
}

/// Sun direction with a cone of view, noise, horizon and terrain shadow; sampled.
#[model("sensors.sun_sensor")]
impl Model for SunSensor {
    type Params = SunSensorParams;
    type FeedthroughInputs = SunSensorIn;
    type FeedthroughOutputs = SunSensorOut;
    fn without_effect(&self, _: IsWired<'_>) -> Judged {
        let idle = self.p.terrain.is_none().then(|| {
            BuildError::new("the simulation has no terrain").help("remove it, or add a terrain")
        });
        vec![(Judge::Param("shadow_range"), idle)]
    }
    fn feedthrough(&self, clock: &Clock, u: &SunSensorIn) -> SunSensorOut {
        let p = &self.p;
        let light = p.sun.light(clock.t, &u.mount.position);
        let sun = light.direction;
        let seen = u.mount.rotation.inverse() * sun;
        let up = match p.world.as_ref().map(|w| w.axes()) {
            Some(Axes::Inertial) => u.mount.position.try_normalize(1e-9).unwrap_or_else(Vec3::z),
            _ => Vec3::z(),
        };
        let elevation = sun.dot(&up).clamp(-1.0, 1.0).asin();
        let hidden = |ground: &Handle<dyn Terrain>| {
            p.shadow_range > 0.0 && shaded(&**ground, u.mount.position, sun, p.shadow_range)
        };
        let valid = seen.z >= p.half_angle.cos()
            && light.visible > 0.0
            && !p.terrain.as_ref().is_some_and(hidden);
        if !valid {
            return SunSensorOut { direction: Vec3::zeros(), valid, elevation };
        }
        let turn = Vec3::new(clock.normal(0), clock.normal(1), clock.normal(2)) * p.sigma;
        let direction = (seen + turn.cross(&seen)).normalize();
        SunSensorOut { direction, valid, elevation }
    }
    fn update(&self) {}
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;

    struct Still(Vec3);
    impl Sun for Still {
        fn state(&self, _: f64) -> SunState {
            SunState { direction: self.0.normalize(), distance_au: 1.5 }
        }
        // The ground is level, so the Sun is visible above the horizontal.
        fn light(&self, _: f64, _: &Vec3) -> Light {
            Light {
                direction: self.0.normalize(),
                distance: 2e11,
                irradiance: 600.0,
                visible: if self.0.z > 0.0 { 1.0 } else { 0.0 },
                penumbra: 1.0,
                umbra: 1.0,
            }
        }
    }

    /// Level ground with a wall of 10 m beyond x = 20 m.
    struct Wall(Soil);
    impl Terrain for Wall {
        fn ground(&self, x: f64, _: f64) -> Option<Ground> {
            Some(Ground { height: if x > 20.0 { 10.0 } else { 0.0 }, normal: Vec3::z() })
        }
        fn bounds(&self) -> [f64; 4] {
            [-1e3, -1e3, 1e3, 1e3]
        }
        fn soil(&self, _: f64, _: f64) -> &Soil {
            &self.0
        }
        fn surface(&self) -> Surface {
            Surface { origin: [0.0; 2], spacing: [1.0; 2], nx: 0, ny: 0, heights: vec![] }
        }
    }

    fn sensor(sun: Vec3, sigma: f64) -> SunSensor {
        let soil = crate::test_ground::firm();
        SunSensor {
            p: SunSensorParams {
                half_angle: 1.0,
                sigma,
                shadow_range: 200.0,
                sun: Handle::new("sun", Arc::new(Still(sun)) as Arc<dyn Sun>),
                terrain: Some(Handle::new("ground", Arc::new(Wall(soil)) as Arc<dyn Terrain>)),
                world: None,
            },
        }
    }

    fn look(s: &SunSensor, n: u64, mount: NodeState) -> SunSensorOut {
        s.feedthrough(&Clock::at(0.0, 1.0, n), &SunSensorIn { mount })
    }

    #[test]
    fn cone_horizon_and_wall_hide_the_sun() {
        let mount = NodeState::identity();
        assert!(look(&sensor(Vec3::new(0.5, 0.0, 1.0), 0.0), 0, mount).valid);
        assert!(!look(&sensor(Vec3::new(-2.0, 0.0, 1.0), 0.0), 0, mount).valid, "outside the cone");
        // The Sun is 25° high, the wall 26.6°: the wall hides the Sun in the east, and a sensor that faces west
        // sees it.
        let mut turned = mount;
        turned.rotation = Quat::from_axis_angle(&Vec3::y_axis(), 1.0);
        assert!(!look(&sensor(Vec3::new(1.0, 0.0, 0.466), 0.0), 0, turned).valid);
        turned.rotation = Quat::from_axis_angle(&Vec3::y_axis(), -1.0);
        assert!(look(&sensor(Vec3::new(-1.0, 0.0, 0.466), 0.0), 0, turned).valid);
        assert!(
            !look(&sensor(Vec3::new(-1.0, 0.0, -0.1), 0.0), 0, turned).valid,
            "below the horizon"
        );
    }

    #[test]
    fn noise_has_its_spread_and_stays_a_unit_vector() {
        let s = sensor(Vec3::z(), 0.02);
        let (mut sum, n) = (0.0, 20_000);
        for k in 0..n {
            let y = look(&s, k, NodeState::identity());
            assert!((y.direction.norm() - 1.0).abs() < 1e-12);
            sum += y.direction.x * y.direction.x;
        }
        let spread = (sum / n as f64).sqrt();
        assert!((spread - 0.02).abs() < 5e-4, "{spread}");
    }
}
