//! `power.sunlit`: sunlit fraction of a panel, with shadows of hills, rocks, masts and its own vehicle.
//! ```text
//! points at the centres of n × n equal parts of the panel, `clearance` above it
//! fraction = number of points whose ray to the Sun hits nothing within `range`, over n²
//! ```
//! The fraction is 0 if the Sun is behind the panel, or occulted by the horizon or a body of the world (see [`Sun::light`]). Rays are intersected
//! with the terrain, as triangles between the nodes of its grid, and with the shapes of the bodies in `sees`; the terrain ends at its edge. The Sun
//! is a point: shadows have sharp edges, and the fraction changes in steps of 1/n². The model is sampled, because the shadow of a body at rest moves
//! slowly.

use linkwork_render::{Look, Surroundings};
use linkwork_runtime::Lane;
use linkwork_surroundings::prelude::*;

/// The panel and the bodies that may cast shadows on it.
#[derive(Params, Clone, Debug)]
pub struct SunlitParams {
    /// Size of the panel along x and y of its node, which is at its centre, m.
    pub size: [f64; 2],
    /// Number of points along each side.
    #[param(default = 8, range = 1.0..=64.0)]
    pub points: u32,
    /// Height of the points above the node; it must be above the panel's own shape.
    #[param(unit = "m", default = 0.02, range = 0.0..)]
    pub clearance: f64,
    /// Length of the rays.
    #[param(unit = "m", default = 1000.0, range = 1e-3..)]
    pub range: f64,
    /// Bodies that cast shadows, by patterns of their names; default: all.
    #[param(service)]
    pub sees: Scenery,
    /// The ground (optional).
    #[param(service)]
    pub terrain: Option<Handle<dyn Terrain>>,
    /// The sun.
    #[param(service)]
    pub sun: Handle<dyn Sun>,
}

/// A panel that may be in shadow.
pub struct Sunlit {
    size: [f64; 2],
    points: u32,
    clearance: f64,
    range: f64,
    sun: Handle<dyn Sun>,
    around: Surroundings,
}

impl Sunlit {
    /// Returns the points of the panel, W.
    fn points(&self, panel: &NodeState) -> impl Iterator<Item = Vec3> {
        let (n, [length, width], up) = (self.points, self.size, self.clearance);
        let middle = move |k: u32| (f64::from(k) + 0.5) / f64::from(n) - 0.5;
        let (rotation, position) = (panel.rotation, panel.position);
        (0..n * n).map(move |k| {
            let place = Vec3::new(length * middle(k % n), width * middle(k / n), up);
            position + rotation * place
        })
    }
}

/// Sunlit fraction of a solar panel, by ray casting against terrain and bodies; sampled.
#[model("power.sunlit")]
impl SizedModel for Sunlit {
    type Params = SunlitParams;

    fn ports(p: &SunlitParams) -> SizedPorts {
        let mut panel = PortSpec::named("panel", PortKind::NodeState, <NodeState as Lane>::N)
            .doc_of("The centre of the panel: its z axis is the normal.");
        panel.bind = Some("panel".into());
        let share = PortSpec::named("share", PortKind::Numbers, 1)
            .unit_of("1")
            .doc_of("Sunlit fraction of the panel, for `sunlit` of a solar panel.");
        SizedPorts {
            feedthrough_inputs: std::iter::once(panel).chain(p.sees.ports()).collect(),
            feedthrough_outputs: vec![share],
            sampled: true,
            ..SizedPorts::default()
        }
    }

    fn build(p: SunlitParams) -> Result<Self, BuildError> {
        if !p.size.iter().all(|s| *s > 0.0 && s.is_finite()) {
            let [length, width] = p.size;
            let fact = format!("a panel cannot be {length} m by {width} m");
            return Err(BuildError::new(fact).help("write two lengths above zero").at("size"));
        }
        // The colour of an object that casts a shadow does not matter.
        let around = Surroundings::new(p.terrain.as_ref(), Look::plain([0.0; 3]), p.sees)?;
        let SunlitParams { size, points, clearance, range, sun, .. } = p;
        Ok(Sunlit { size, points, clearance, range, sun, around })
    }

    fn feedthrough(&self, clock: &Clock, u: &[f64], y: &mut [f64]) {
        let panel = NodeState::get(u);
        let light = self.sun.light(clock.t, &panel.position);
        let sun = light.direction;
        if light.visible <= 0.0 || (panel.rotation * Vec3::z()).dot(&sun) <= 0.0 {
            y[0] = 0.0;
            return;
        }
        let Some(scene) = self.around.now(&u[<NodeState as Lane>::N..]) else {
            // A non-finite pose gives a NaN output, which stops the run with an error.
            y[0] = f64::NAN;
            return;
        };
        let free = self.points(&panel).filter(|p| !scene.blocked(p, &sun, self.range)).count();
        y[0] = free as f64 / f64::from(self.points * self.points);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use linkwork_surroundings::Sight;
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

    /// A wall of 1 m that begins 2 m behind the panel's edge, along y.
    fn wall() -> Scenery {
        Scenery::of(vec![Sight {
            body: "world".into(),
            name: "wall".into(),
            pose: linkwork_spatial::Pose::translation(-3.0, 0.0, 0.5),
            form: linkwork_render::collision::VisualShape::Shape(
                linkwork_render::collision::Shape::Box { half: Vec3::new(0.01, 20.0, 0.5) },
            ),
            color: [1.0; 3],
        }])
    }

    fn params(sun: Vec3, sees: Scenery) -> SunlitParams {
        SunlitParams {
            size: [2.0, 1.0],
            points: 20,
            clearance: 1e-6,
            range: 100.0,
            sees,
            terrain: None,
            sun: Handle::new("sun", Arc::new(Still(sun)) as Arc<dyn Sun>),
        }
    }

    fn share(p: SunlitParams, panel: NodeState) -> f64 {
        let mut u = vec![0.0; <NodeState as Lane>::N];
        panel.put(&mut u);
        let mut y = [f64::NAN];
        let model = Sunlit::build(p).unwrap();
        model.feedthrough(&Clock::at(0.0, 1.0, 0), &u, &mut y);
        y[0]
    }

    #[test]
    fn the_shadow_of_a_wall_ends_where_its_height_over_the_sun_says() {
        let flat = NodeState::identity();
        // The shadow of the wall is 1/tan(e) long from x = −2.99 m on; the panel extends from −1 m
        // to 1 m.
        for tan in [2.0, 0.45, 0.4, 0.35, 0.3, 0.26, 0.2] {
            let lit = (1.0 - (-2.99 + 1.0 / tan)) / 2.0_f64;
            let got = share(params(Vec3::new(-1.0, 0.0, tan), wall()), flat);
            assert!((got - lit.clamp(0.0, 1.0)).abs() <= 0.5 / 20.0 + 1e-9, "{tan}: {got} {lit}");
        }
        assert_eq!(share(params(Vec3::new(1.0, 0.0, 0.2), wall()), flat), 1.0);
    }

    #[test]
    fn below_the_horizon_and_behind_the_panel_is_no_sun() {
        let none = Scenery::default();
        let mut panel = NodeState::identity();
        assert_eq!(share(params(Vec3::new(-1.0, 0.0, -0.01), none.clone()), panel), 0.0);
        panel.rotation = Quat::from_axis_angle(&Vec3::y_axis(), 1.2);
        assert_eq!(share(params(Vec3::new(-1.0, 0.0, 0.1), none.clone()), panel), 0.0);
        assert_eq!(share(params(Vec3::new(1.0, 0.0, 0.1), none), panel), 1.0);
    }

    #[test]
    fn a_turned_panel_takes_its_points_with_it() {
        // After a right angle about z the length of the panel is parallel to the wall: the shadow covers a share of one
        // metre, not of two.
        let mut panel = NodeState::identity();
        panel.rotation = Quat::from_axis_angle(&Vec3::z_axis(), std::f64::consts::FRAC_PI_2);
        let sun = Vec3::new(-1.0, 0.0, 1.0 / 2.99);
        let got = share(params(sun, wall()), panel);
        assert!((got - 0.5).abs() <= 0.5 / 20.0 + 1e-9, "{got}");
        panel.position.x = 1.0;
        assert_eq!(share(params(sun, wall()), panel), 1.0);
    }

    #[test]
    fn a_panel_without_extent_is_refused() {
        let p = SunlitParams { size: [1.0, 0.0], ..params(Vec3::z(), Scenery::default()) };
        assert_eq!(Sunlit::build(p).err().unwrap().param.as_deref(), Some("size"));
    }
}
