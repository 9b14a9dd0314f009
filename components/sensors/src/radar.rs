//! `sensors.radar`: landing radar: slant range and closing speed along each beam, and the velocity from all beams.
//! ```text
//! echo      near ≤ r ≤ near + depth, acos |n·d| ≤ `incidence_max`, and not lost (probability `drop_out`)
//! range     r + (σ_r + κ r) n₁, rounded to a multiple of the resolution
//! speed     d·(v − v_hit) + σ_v n₂, rounded to a multiple of its resolution; positive when closing
//! velocity  (Σ d dᵀ)⁻¹ Σ d s over the beams with an echo: velocity of the mount relative to the surface, axes of the mount; needs three
//!           beams that are not coplanar
//! ```
//! d: the beam, n: the surface's normal. The radar sees the terrain service as triangles between the nodes of its grid, the (moving) shapes of the
//! bodies in `sees`, and the sphere of `ground_radius` about the planet's centre. The sphere rotates with the planet if W is a site, or if the
//! planet's centre is the origin of W. The nearest hit counts. All beams of a sample are measured at one instant and have no width: neither the
//! leading edge of a footprint nor side lobes are modelled.

use linkwork_render::{Look, Scene, Surroundings};
use linkwork_runtime::Lane;
use linkwork_spatial::Mat3;
use linkwork_surroundings::prelude::*;

/// Maximum number of beams.
const BEAMS_MAX: usize = 32;

/// Beams, limits and noise.
#[derive(Params, Clone, Debug)]
pub struct RadarParams {
    /// Directions of the beams, axes of the mount; an altimeter has one.
    pub beams: Vec<Vec3>,
    /// Minimum range.
    #[param(unit = "m", default = 1.0, range = 0.0..=1e6)]
    pub near: f64,
    /// Length of the measuring interval: the maximum range is `near` plus `depth`.
    #[param(unit = "m", default = 6000.0, range = 1e-3..=1e6)]
    pub depth: f64,
    /// Maximum angle between a beam and the surface normal for an echo.
    #[param(unit = "rad", default = 1.0, range = 0.0..=1.571)]
    pub incidence_max: f64,
    /// Standard deviation σ_r of a range.
    #[param(unit = "m", default = 0.0, range = 0.0..)]
    pub range_sigma: f64,
    /// Standard deviation of a range relative to the range, κ.
    #[param(default = 0.01, range = 0.0..=1.0)]
    pub range_share: f64,
    /// Resolution of ranges; 0: no quantization.
    #[param(unit = "m", default = 0.0, range = 0.0..)]
    pub range_resolution: f64,
    /// Standard deviation σ_v of a speed.
    #[param(unit = "m/s", default = 0.1, range = 0.0..)]
    pub speed_sigma: f64,
    /// Resolution of speeds; 0: no quantization.
    #[param(unit = "m/s", default = 0.0, range = 0.0..)]
    pub speed_resolution: f64,
    /// Probability that an echo is lost.
    #[param(default = 0.0, range = 0.0..=1.0)]
    pub drop_out: f64,
    /// Radius of a sphere about the planet's centre that is additional ground. Default: none.
    #[param(unit = "m", range = 1.0..)]
    pub ground_radius: Option<f64>,
    /// Patterns of the names of visible bodies. Default: all. Exclude the body that carries the radar if it would block beams.
    #[param(service)]
    pub sees: Scenery,
    /// The ground (optional).
    #[param(service)]
    pub terrain: Option<Handle<dyn Terrain>>,
    /// The world (optional): position and rotation of the planet.
    #[param(service)]
    pub world: Option<Handle<dyn World>>,
}

/// Velocity from all beams.
#[derive(Ports, Clone, Copy, Debug)]
pub struct RadarOut {
    /// Number of beams with an echo.
    #[port("1")]
    pub echoes: f64,
    /// Velocity of the mount relative to the surface, axes of the mount; 0 without a fix.
    #[port("m/s")]
    pub velocity: Vec3,
    /// The velocity is valid.
    #[port]
    pub fix: bool,
}

/// Hit of a beam.
struct Hit {
    range: f64,
    /// Cosine of the angle to the normal.
    facing: f64,
    /// Velocity of the surface at the hit, W, m/s.
    velocity: Vec3,
}

/// A landing radar.
pub struct Radar {
    p: RadarParams,
    beams: Vec<Vec3>,
    around: Surroundings,
    site: Option<Site>,
    /// Angular velocity of the planet in W, rad/s.
    spin: Vec3,
    /// For each visible shape the index of its body among the ports; `None`: the world.
    bodies: Vec<Option<usize>>,
}

impl Radar {
    /// Returns the hit of the sphere along `d` (unit) from `o`, both in W.
    fn sphere(&self, o: &Vec3, d: &Vec3) -> Option<Hit> {
        let radius = self.p.ground_radius?;
        let from = self.site.as_ref().map_or(*o, |s| s.relative_to_centre(o));
        let along = from.dot(d);
        // The factored form (|o| − R)(|o| + R) avoids cancellation near the ground.
        let over = (from.norm() - radius) * (from.norm() + radius);
        let root = along * along - over;
        if !(over >= 0.0 && along < 0.0 && root >= 0.0) {
            return None;
        }
        let range = over / (root.sqrt() - along);
        let place = from + d * range;
        let velocity = self.spin.cross(&place);
        Some(Hit { range, facing: place.dot(d).abs() / radius, velocity })
    }

    /// Returns the nearest hit along `d` from `o`, W; `bodies` are the input values with the poses of the bodies.
    fn first(&self, scene: &Scene, o: &Vec3, d: &Vec3, bodies: &[f64]) -> Option<Hit> {
        let met = scene.cast(o, d, self.p.near + self.p.depth).map(|hit| {
            // In object masks the k-th shape has the number k + 2.
            let shape = (hit.object as usize).checked_sub(2);
            let body = shape.and_then(|k| *self.bodies.get(k)?);
            let velocity = body.map_or_else(Vec3::zeros, |k| {
                let b = NodeState::get(&bodies[k * <NodeState as Lane>::N..]);
                b.velocity + b.angular.cross(&(o + d * hit.distance - b.position))
            });
            Hit { range: hit.distance, facing: hit.normal.dot(d).abs(), velocity }
        });
        let nearest = |a: Hit, b: Hit| if a.range <= b.range { a } else { b };
        match (met, self.sphere(o, d)) {
            (Some(a), Some(b)) => Some(nearest(a, b)),
            (a, b) => a.or(b),
        }
    }

    /// Returns range (m) and speed (m/s) of beam `k` with noise; `None` without an echo.
    fn measured(&self, c: &Clock, hit: &Hit, closing: f64, k: u32) -> Option<(f64, f64)> {
        let p = &self.p;
        let seen =
            (p.near..=p.near + p.depth).contains(&hit.range) && hit.facing >= p.incidence_max.cos();
        let lost = p.drop_out > 0.0 && c.uniform(3 * k) < p.drop_out;
        if !seen || lost {
            return None;
        }
        let stepped = |x: f64, step: f64| if step > 0.0 { (x / step).round() * step } else { x };
        let spread = p.range_sigma + p.range_share * hit.range;
        let range = hit.range + spread * c.normal(3 * k + 1);
        let speed = closing + p.speed_sigma * c.normal(3 * k + 2);
        Some((stepped(range.max(0.0), p.range_resolution), stepped(speed, p.speed_resolution)))
    }
}

/// Landing radar: slant ranges and speeds along beams to ground and bodies, and the velocity from them, with noise and lost echoes; sampled.
#[model("sensors.radar")]
impl SizedModel for Radar {
    type Params = RadarParams;

    fn ports(p: &RadarParams) -> SizedPorts {
        let mut mount = PortSpec::named("mount", PortKind::NodeState, <NodeState as Lane>::N)
            .doc_of("The antenna; beams are in its axes.");
        mount.bind = Some("mount".into());
        let count = p.beams.len().min(BEAMS_MAX);
        let each = |name: &'static str, unit: &'static str, doc: &'static str| {
            PortSpec::named(name, PortKind::Numbers, count).unit_of(unit).doc_of(doc)
        };
        let beams = [
            each("range", "m", "Slant range of each beam; 0 without an echo."),
            each("speed", "m/s", "Closing speed along each beam; 0 without an echo."),
            each("found", "1", "1 for a beam with an echo, else 0."),
        ];
        SizedPorts {
            feedthrough_inputs: std::iter::once(mount).chain(p.sees.ports()).collect(),
            feedthrough_outputs: beams.into_iter().chain(RadarOut::specs()).collect(),
            sampled: true,
            ..SizedPorts::default()
        }
    }

    fn build(p: RadarParams) -> Result<Self, BuildError> {
        let wrong =
            |at: &str, fact: String, help: &str| Err(BuildError::new(fact).help(help).at(at));
        let n = p.beams.len();
        if n == 0 || n > BEAMS_MAX {
            return wrong(
                "beams",
                format!("{n} beams"),
                "write 1 to 32 beams; for an altimeter, for example, beams: [[0, 0, -1]]",
            );
        }
        if let Some(k) = p.beams.iter().position(|d| !(d.norm() > 1e-9)) {
            let fact = format!("beam {k} has no direction");
            return wrong("beams", fact, "write a vector of any length, for example [0.3, 0, -1]");
        }
        if p.ground_radius.is_some() && p.world.is_none() {
            let fact = "`ground_radius` needs a `world`, which locates the planet";
            return wrong(
                "ground_radius",
                fact.into(),
                "write `world: (body: ..)` in the simulation, or remove `ground_radius`",
            );
        }
        let site = p.world.as_ref().and_then(|w| w.axes().place());
        let spin = p.world.as_ref().map_or_else(Vec3::zeros, |w| w.planet_rate(0.0));
        let around = Surroundings::new(p.terrain.as_ref(), Look::plain([0.2; 3]), p.sees.clone())?;
        let place = |body: &String| p.sees.bodies().iter().position(|b| b == body);
        let bodies = p.sees.shapes().iter().map(|s| place(&s.body)).collect();
        let beams = p.beams.iter().map(|d| d.normalize()).collect();
        Ok(Self { beams, around, site, spin, bodies, p })
    }

    fn feedthrough(&self, clock: &Clock, u: &[f64], y: &mut [f64]) {
        let mount = NodeState::get(u);
        let moving = &u[<NodeState as Lane>::N..];
        let Some(scene) = self.around.now(moving) else {
            // A non-finite pose gives NaN outputs, which stop the run with an error.
            y.fill(f64::NAN);
            return;
        };
        let n = self.beams.len();
        y.fill(0.0);
        let (mut normal, mut right, mut echoes) = (Mat3::zeros(), Vec3::zeros(), 0.0);
        for (k, beam) in self.beams.iter().enumerate() {
            let d = mount.rotation * beam;
            let Some(hit) = self.first(&scene, &mount.position, &d, moving) else { continue };
            let closing = d.dot(&(mount.velocity - hit.velocity));
            let Some((range, speed)) = self.measured(clock, &hit, closing, k as u32) else {
                continue;
            };
            (y[k], y[n + k], y[2 * n + k]) = (range, speed, 1.0);
            normal += beam * beam.transpose();
            right += beam * speed;
            echoes += 1.0;
        }
        // A limit of 1e-6 for unit vectors corresponds to three beams within a few milliradians of a plane.
        let inverse = normal.try_inverse().filter(|_| normal.determinant() > 1e-6);
        let velocity = inverse.map_or_else(Vec3::zeros, |m| m * right);
        RadarOut { echoes, velocity, fix: inverse.is_some() }.put(&mut y[3 * n..]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_ground;

    fn beams() -> Vec<Vec3> {
        let canted = |x: f64, y: f64| Vec3::new(x, y, -2.0);
        vec![-Vec3::z(), canted(1.0, 0.0), canted(-0.5, 0.9), canted(-0.5, -0.9)]
    }

    fn params() -> RadarParams {
        RadarParams {
            beams: beams(),
            near: 2.0,
            depth: 3000.0,
            incidence_max: 1.0,
            range_sigma: 0.0,
            range_share: 0.0,
            range_resolution: 0.0,
            speed_sigma: 0.0,
            speed_resolution: 0.0,
            drop_out: 0.0,
            ground_radius: None,
            sees: Scenery::default(),
            terrain: None,
            world: None,
        }
    }

    fn slope() -> RadarParams {
        let terrain = test_ground::slope(4000.0);
        RadarParams { terrain: Some(terrain), ..params() }
    }

    fn moon(rate: f64) -> RadarParams {
        let world =
            Some(linkwork_surroundings::PlainWorld::inertial(4.9e12, 1.7374e6, rate).handle());
        RadarParams { ground_radius: Some(1.7374e6), world, ..params() }
    }

    /// Returns range, speed and echo of each beam, and the combined outputs.
    fn read(p: &RadarParams, n: u64, lanes: &[f64]) -> (Vec<[f64; 3]>, RadarOut) {
        let count = p.beams.len();
        let m = Radar::build(p.clone()).map_err(|e| e.message).unwrap();
        let mut y = vec![f64::NAN; 3 * count + 5];
        m.feedthrough(&Clock::at(0.05 * n as f64, 0.05, n), lanes, &mut y);
        let each = (0..count).map(|k| [y[k], y[count + k], y[2 * count + k]]).collect();
        (each, RadarOut::get(&y[3 * count..]))
    }

    fn lanes(state: &NodeState) -> Vec<f64> {
        let mut u = vec![0.0; <NodeState as Lane>::N];
        state.put(&mut u);
        u
    }

    fn craft(position: Vec3) -> NodeState {
        let rotation = Quat::from_scaled_axis(Vec3::new(0.1, -0.15, 0.8));
        let velocity = Vec3::new(12.0, -7.0, -30.0);
        NodeState { position, rotation, velocity, ..NodeState::identity() }
    }

    #[test]
    fn over_a_tilted_plane_ranges_speeds_and_velocity_are_those_of_the_plane() {
        let state = craft(Vec3::new(40.0, -10.0, 10.0 + 500.0));
        let (each, all) = read(&slope(), 0, &lanes(&state));
        let normal = Vec3::new(-0.25, 0.0, 1.0);
        for (beam, [range, speed, found]) in beams().iter().zip(&each) {
            let d = state.rotation * beam.normalize();
            assert!((range + 500.0 / normal.dot(&d)).abs() < 1e-9 && *found == 1.0, "{range}");
            assert!((speed - d.dot(&state.velocity)).abs() < 1e-12, "{speed}");
        }
        let want = state.rotation.inverse() * state.velocity;
        assert!(all.fix && all.echoes == 4.0 && (all.velocity - want).norm() < 1e-11);
    }

    #[test]
    fn over_a_sphere_that_turns_the_ground_moves() {
        let rate = 2e-5;
        let (radius, height) = (1.7374e6, 800.0);
        let up = Vec3::new(0.8, -0.3, 0.5).normalize();
        let place = up * (radius + height);
        // The radar has an altimeter beam that points down, and three beams around it.
        let rotation = Quat::rotation_between(&Vec3::z(), &up).unwrap();
        let carried = (Vec3::z() * rate).cross(&place);
        let velocity = carried + up * -25.0 + rotation * (Vec3::x() * 4.0);
        let state = NodeState { position: place, rotation, velocity, ..NodeState::identity() };
        let (each, all) = read(&moon(rate), 0, &lanes(&state));
        assert!((each[0][0] - height).abs() < 1e-6 && (each[0][1] - 25.0).abs() < 1e-9);
        // The slant range of a beam at the angle a follows from the triangle of centre, vehicle and
        // ground.
        let a = (1.0_f64 / 2.0).atan();
        let r = radius + height;
        let want = r * a.cos() - ((r * a.cos()).powi(2) - (r * r - radius * radius)).sqrt();
        assert!((each[1][0] / want - 1.0).abs() < 1e-7, "{} {want}", each[1][0]);
        // The velocity is relative to the ground under each beam, which moves with the planet.
        assert!(
            all.fix && (all.velocity - Vec3::new(4.0, 0.0, -25.0)).norm() < 0.05,
            "{}",
            all.velocity
        );
        // The speed is the inertial one if the planet does not rotate.
        let (still, _) = read(&moon(0.0), 0, &lanes(&state));
        assert!((still[1][1] - each[1][1]).abs() > 1.0);
    }

    #[test]
    fn a_body_that_moves_is_met_with_its_own_velocity() {
        let form = linkwork_render::collision::VisualShape::Shape(
            linkwork_render::collision::Shape::Sphere { radius: 3.0 },
        );
        let pose = linkwork_render::spatial::Pose::identity();
        let sight = linkwork_surroundings::Sight {
            body: "rock".into(),
            name: "rock".into(),
            pose,
            form,
            color: [1.0; 3],
        };
        let p = RadarParams { sees: Scenery::of(vec![sight]), beams: vec![-Vec3::z()], ..params() };
        let mut u = lanes(&NodeState { velocity: -Vec3::z() * 2.0, ..NodeState::identity() });
        let rock = NodeState {
            position: Vec3::z() * -50.0,
            velocity: Vec3::new(9.0, 0.0, 0.5),
            angular: Vec3::new(0.0, 0.7, 0.0),
            ..NodeState::identity()
        };
        u.extend(lanes(&rock));
        let (each, all) = read(&p, 0, &u);
        assert!((each[0][0] - 47.0).abs() < 1e-9 && (each[0][1] - 2.5).abs() < 1e-12, "{each:?}");
        // One beam does not determine the velocity.
        assert!(!all.fix && all.velocity == Vec3::zeros() && all.echoes == 1.0);
    }

    #[test]
    fn beyond_its_limits_and_its_cone_there_is_no_echo() {
        let found = |p: RadarParams, z: f64| {
            let state = NodeState { position: Vec3::z() * z, ..NodeState::identity() };
            read(&p, 0, &lanes(&state)).0.iter().map(|e| e[2]).collect::<Vec<_>>()
        };
        assert_eq!(found(slope(), 500.0), [1.0; 4]);
        assert_eq!(found(slope(), 1.0), [0.0; 4]);
        assert_eq!(found(RadarParams { depth: 460.0, ..slope() }, 500.0)[0], 0.0);
        // The beam that looks up the slope meets it at atan ½ − atan ¼ = 0.22; the two that look down it at 0.63.
        assert_eq!(
            found(RadarParams { incidence_max: 0.6, ..slope() }, 500.0),
            [1.0, 1.0, 0.0, 0.0]
        );
        assert_eq!(found(RadarParams { drop_out: 1.0, ..slope() }, 500.0), [0.0; 4]);
        // All beams point away from the sphere.
        let state = NodeState {
            position: Vec3::z() * 1.738e6,
            rotation: Quat::from_scaled_axis(Vec3::x() * std::f64::consts::PI),
            ..NodeState::identity()
        };
        assert!(read(&moon(0.0), 0, &lanes(&state)).0.iter().all(|e| e[2] == 0.0));
    }

    #[test]
    fn noise_has_its_deviations_and_numbers_their_steps() {
        let p = RadarParams {
            range_sigma: 0.5,
            range_share: 0.01,
            speed_sigma: 0.2,
            beams: vec![-Vec3::z()],
            ..slope()
        };
        let state = NodeState { position: Vec3::z() * 500.0, ..NodeState::identity() };
        let (mut square, count) = ([0.0; 2], 2000);
        for n in 0..count {
            let (each, _) = read(&p, n, &lanes(&state));
            square[0] += (each[0][0] - 500.0).powi(2) / count as f64;
            square[1] += each[0][1].powi(2) / count as f64;
        }
        // The bound is four standard errors of a variance.
        let within = 4.0 * (2.0 / count as f64).sqrt();
        assert!((square[0] / 5.5_f64.powi(2) - 1.0).abs() < within, "{square:?}");
        assert!((square[1] / 0.2_f64.powi(2) - 1.0).abs() < within, "{square:?}");
        let p = RadarParams { range_resolution: 8.0, speed_resolution: 0.3, ..p };
        let (each, _) = read(&p, 3, &lanes(&state));
        let whole = |x: f64| (x - x.round()).abs() < 1e-9;
        assert!(whole(each[0][0] / 8.0) && whole(each[0][1] / 0.3), "{each:?}");
    }

    #[test]
    fn what_is_no_radar_is_refused() {
        let at = |p: RadarParams| Radar::build(p).err().and_then(|e| e.param).unwrap();
        assert_eq!(at(RadarParams { beams: Vec::new(), ..params() }), "beams");
        assert_eq!(at(RadarParams { beams: vec![Vec3::zeros()], ..params() }), "beams");
        assert_eq!(at(RadarParams { ground_radius: Some(1e6), ..params() }), "ground_radius");
    }
}
