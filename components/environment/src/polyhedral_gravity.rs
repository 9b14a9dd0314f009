//! `environment.polyhedral_gravity`: gravity of a body of uniform density whose surface is a mesh; the body rotates at the origin of W, or carries
//! the site W.
//! ```text
//! a = R_IP ∇U(R_IPᵀ p) + Σ_k third body k      R_IP = R_z(angle + rate t)      U: Werner and Scheeres 1997, exact outside and inside
//! ```
//! Third bodies (`third_bodies.rs`) are relative to the body on its `orbit` about the Sun. Their positions are in ICRF axes, so W then has ICRF axes,
//! and the body rotates about the pole of the ICRF. W is inertial, or a site on this body. At a site the field does not rotate in W and includes the
//! centrifugal acceleration. The computing time is proportional to the number of faces and edges.

use crate::third::Third;
use crate::third_bodies::{Puller, SolarOrbit, pullers};
use crate::world::{PlanetWorld, Turning, fault};
use linkwork_spatial::Mat3;
use linkwork_surroundings::prelude::*;
use linkwork_world::gravity::polyhedron::{Polyhedron, from_obj};

/// Gravitational constant, m³/(kg s²): CODATA 2018.
const G: f64 = 6.674_30e-11;

/// Mesh, density and third bodies.
#[derive(Params, Clone, Debug)]
pub struct PolyhedralParams {
    /// Wavefront OBJ file of a closed surface with outward normals.
    pub file: String,
    /// Length of one unit of the file: 1000 m for the usual shape models in km.
    #[param(unit = "m", default = 1.0, range = 1e-9..)]
    pub scale: f64,
    /// Density; instead of `mu` of the world.
    #[param(unit = "kg/m^3", range = 1e-9..)]
    pub density: Option<f64>,
    /// The world, whose body has this shape. The body rotates about z of the file; `angle` is the angle from x of W to x of the file at t = 0.
    #[param(service)]
    pub world: Handle<dyn World>,
    /// Bodies whose gravity acts in addition: sun, moon, earth, venus, mars, jupiter. They need an epoch in `world`, no site, and either `orbit` or a
    /// shape with the mass of the Earth, Mars or the Moon.
    #[param(default = Vec::new())]
    pub third_bodies: Vec<Third>,
    /// With `third_bodies`: the orbit of this body about the Sun.
    #[param(default = None)]
    pub orbit: Option<SolarOrbit>,
}

/// Greatest ratio of the mass of a shape and the mass of the planet of the world for which both are the same body.
const SAME_MASS: f64 = 1.5;

/// Returns an error if a shape of `mu` (m³/s²) by its density is not the body of the world, because other parts use the gravitational parameter of
/// the world.
fn of_the_world(mu: f64, world: &PlanetWorld) -> Result<(), BuildError> {
    let Some(own) = world.mu().filter(|own| (mu / own - 1.0).abs() > 0.02) else { return Ok(()) };
    let body = world.params.body.word();
    let fact = format!(
        "with `density` the shape has {mu:.4e} m³/s², but `body: {body}` of `world` {own:.4e} m³/s²"
    );
    let help = "write `body: other`, or leave `density` out and write `mu` in `world`";
    Err(BuildError::new(fact).help(help).at("density"))
}

impl PolyhedralParams {
    /// Returns the third bodies for a body of `mu` (m³/s²).
    fn thirds(&self, mu: f64, world: &PlanetWorld) -> Result<Vec<Puller>, BuildError> {
        let told =
            |fact: String, help: &str, param: &str| Err(BuildError::new(fact).help(help).at(param));
        if self.third_bodies.is_empty() {
            return match self.orbit {
                None => Ok(Vec::new()),
                Some(_) => {
                    let help = "write third_bodies: [\"sun\"], or leave `orbit` out";
                    told("`orbit` is written, but no third bodies".into(), help, "orbit")
                }
            };
        }
        if world.planet.site.is_some() {
            let fact = "third bodies from an ephemeris need W in ICRF axes, but the site of this body has its own pole";
            return told(
                fact.into(),
                "remove `site` from `world`, or remove `third_bodies`",
                "third_bodies",
            );
        }
        let own = world.params.body.mu();
        let same = own.is_some_and(|own| (1.0 / SAME_MASS..=SAME_MASS).contains(&(mu / own)));
        if self.orbit.is_none() && !same {
            let body = world.params.body.word();
            let fact = format!(
                "the orbit of this body of {mu:.3e} m³/s² is not known: `orbit` is missing, and its mass is not the mass of `{body}` of the world"
            );
            return told(fact, "write `orbit`, the elements of its orbit about the Sun", "orbit");
        }
        pullers(world, &self.third_bodies, self.orbit.as_ref())
    }
}

/// Gravity of a mesh and of third bodies.
pub struct PolyhedralGravity {
    body: Polyhedron,
    world: PlanetWorld,
    pullers: Vec<Puller>,
}

impl PolyhedralGravity {
    /// Returns the vector from the body's origin to a point (m, W).
    fn around_centre(&self, p: &Vec3) -> Vec3 {
        self.world.planet.site.map_or(*p, |s| s.relative_to_centre(p))
    }
}

impl Gravity for PolyhedralGravity {
    fn acceleration(&self, t: f64, p: Vec3) -> Vec3 {
        let own = self.world.planet.gravity(t, p, |p| self.body.gravity(p).acceleration);
        let r = self.around_centre(&p);
        self.pullers.iter().fold(own, |a, k| a + k.pull(self.world.planet.site.as_ref(), t, &r))
    }
    fn gradient(&self, t: f64, p: Vec3) -> Option<Mat3> {
        let own = self.world.planet.gradient(t, p, |p| self.body.gravity(p).gradient);
        let r = self.around_centre(&p);
        let site = self.world.planet.site.as_ref();
        Some(self.pullers.iter().fold(own, |a, k| a + k.gradient(site, t, &r)))
    }
    fn failure(&self, t: f64) -> Option<BuildError> {
        self.pullers.iter().find_map(|k| k.failure(t))
    }
    fn axes(&self) -> Axes {
        self.world.planet.axes()
    }
}

/// Gravity of an asteroid or comet of uniform density from its shape, and of third bodies. The body rotates about z at the origin of W, or W is a
/// site on it.
#[service("environment.polyhedral_gravity", Gravity)]
impl Service for PolyhedralGravity {
    type Params = PolyhedralParams;
    fn build(p: PolyhedralParams, files: &Files) -> Result<Self, BuildError> {
        let path = files.resolve(&p.file).map_err(|e| e.at("file"))?;
        let text = linkwork_formats::whole_text(&path).map_err(|e| {
            let help = "`file` must name the text of a Wavefront OBJ file";
            BuildError::new(format!("`{}`: {e}", p.file)).help(help).at("file")
        })?;
        let read = |g_rho| from_obj(&p.file, &text, p.scale, g_rho).map_err(|e| fault(&e, "file"));
        let world = PlanetWorld::of(&p.world)?;
        if world.params.turning() == Turning::Iau {
            let fact = "a shape from a file rotates about z of the file, but `turns: iau` of the world defines other axes";
            let help = "write `turns: fixed` with `rate` and `angle` in `world`, or `turns: still`";
            return Err(BuildError::new(fact).help(help).at("file"));
        }
        let body = match (p.density, world.params.mu) {
            (Some(density), None) => {
                let body = read(G * density)?;
                of_the_world(body.mu(), &world)?;
                body
            }
            (None, Some(mu)) => read(mu / read(1.0)?.volume())?,
            (None, None) | (Some(_), Some(_)) => {
                let fact = match p.density {
                    None => "neither `density` here nor `mu` in `world` is written",
                    Some(_) => "both `density` here and `mu` in `world` are written",
                };
                return Err(BuildError::new(fact).help("write one of them").at("density"));
            }
        };
        let pullers = p.thirds(body.mu(), &world)?;
        Ok(PolyhedralGravity { body, world, pullers })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::{Centre, SiteParams, WorldParams, handle};
    use linkwork_runtime::AU;

    /// Cube with edges of 2 m, centred at the origin.
    const CUBE: &str = "v -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1\n\
        f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";

    /// Body of 150 m that rotates about z of W.
    fn turning() -> WorldParams {
        WorldParams {
            rate: Some(1e-3),
            angle: Some(0.4),
            radius: Some(150.0),
            ..WorldParams::of(Centre::Other)
        }
    }

    fn params() -> PolyhedralParams {
        let file = "cube.obj".to_string();
        PolyhedralParams {
            file,
            scale: 100.0,
            density: Some(2000.0),
            world: handle(turning()),
            third_bodies: vec![],
            orbit: None,
        }
    }

    fn built(p: PolyhedralParams, text: &str) -> Result<PolyhedralGravity, BuildError> {
        let dir = tempfile::tempdir().unwrap();
        std::fs::write(dir.path().join("cube.obj"), text).unwrap();
        PolyhedralGravity::build(p, &Files::of(vec![dir.path().to_path_buf()]))
    }

    #[test]
    fn from_afar_it_is_a_point_and_near_by_it_turns() {
        let body = built(params(), CUBE).unwrap();
        let mu = G * 2000.0 * 200.0_f64.powi(3);
        let far = Vec3::new(3e4, -2e4, 1e4);
        let want = -far * (mu / far.norm().powi(3));
        // The field of a cube differs from the field of a point mass by the fourth power of size over
        // distance.
        assert!((body.acceleration(0.0, far) - want).norm() < 1e-8 * want.norm());
        // A rotation by 90° maps a cube onto itself, a rotation by 45° does not.
        let (near, quarter) = (Vec3::new(150.0, 20.0, 30.0), std::f64::consts::FRAC_PI_2 / 1e-3);
        let now = body.acceleration(0.0, near);
        assert!((body.acceleration(quarter, near) - now).norm() < 1e-12 * now.norm());
        assert!((body.acceleration(0.5 * quarter, near) - now).norm() > 1e-2 * now.norm());
        // `mu` of the world instead of `density` gives the same field.
        let world = handle(WorldParams { mu: Some(mu), ..turning() });
        let by_mu = PolyhedralParams { density: None, world, ..params() };
        let same = built(by_mu, CUBE).unwrap().acceleration(7.0, near);
        assert!((same - body.acceleration(7.0, near)).norm() < 1e-12 * now.norm());
    }

    fn at_site() -> WorldParams {
        let site = SiteParams {
            latitude: 0.6,
            longitude: -0.9,
            height: 25.0,
            heading: 0.3,
            turning: true,
        };
        WorldParams { site: Some(site), ..turning() }
    }

    /// At a site, the field without the centrifugal part equals the field in inertial axes at any rotation angle. The gradient agrees as well, and
    /// equals finite differences of the acceleration.
    #[test]
    fn a_site_on_it_has_its_field_and_turns_with_it() {
        let there = built(params(), CUBE).unwrap();
        let here = built(p_of(at_site()), CUBE).unwrap();
        let site = here.site().unwrap();
        // The origin is 25 m above the sphere, at the latitude of the site.
        let origin = site.to_planet(&Vec3::zeros());
        assert!(
            (origin.norm() - 175.0).abs() < 1e-9 && (origin.z / 175.0 - 0.6f64.sin()).abs() < 1e-12
        );
        let p = Vec3::new(30.0, -20.0, 10.0);
        for t in [0.0, 700.0] {
            let R = site.to_inertial(t);
            let r = R * site.relative_to_centre(&p);
            let field = R * (here.acceleration(t, p) - site.centrifugal(&p));
            let want = there.acceleration(t, r);
            assert!((field - want).norm() < 1e-12 * want.norm(), "{field} {want}");
            for (body, at) in [(&here, p), (&there, r)] {
                let g = body.gradient(t, at).unwrap();
                for k in 0..3 {
                    let e = Vec3::ith(k, 0.01);
                    let slope =
                        (body.acceleration(t, at + e) - body.acceleration(t, at - e)) / 0.02;
                    assert!((g.column(k) - slope).norm() < 1e-7 * g.norm(), "{k} at {t}");
                }
            }
        }
        // A shape cannot be combined with IAU axes.
        let epoch = Some("2012-08-06 05:17:57 UTC".to_string());
        let e = built(p_of(WorldParams { epoch, ..WorldParams::of(Centre::Moon) }), CUBE);
        let e = e.err().unwrap();
        assert!(e.message.contains("`turns: iau`") && e.help.is_some(), "{}", e.message);
    }

    fn p_of(world: WorldParams) -> PolyhedralParams {
        PolyhedralParams { world: handle(world), ..params() }
    }

    /// Circular orbit in the ecliptic, 120° from the equinox.
    fn round_orbit() -> SolarOrbit {
        SolarOrbit {
            semi_major_axis: 1.5 * AU,
            eccentricity: 0.0,
            inclination: 0.0,
            ascending_node: 0.0,
            perihelion: 0.0,
            mean_anomaly: std::f64::consts::TAU / 3.0,
            epoch: None,
        }
    }

    fn in_orbit(third_bodies: Vec<Third>) -> PolyhedralParams {
        PolyhedralParams { third_bodies, orbit: Some(round_orbit()), ..p_of(dated()) }
    }

    fn dated() -> WorldParams {
        WorldParams { epoch: Some("2012-08-06 05:17:57 UTC".to_string()), ..turning() }
    }

    /// Compares third-body accelerations with direct formulas: the Sun for a circular orbit, and Jupiter from its ellipse.
    #[test]
    fn third_bodies_pull_as_from_where_the_body_is() {
        use linkwork_world::ephemeris::{Body, OBLIQUITY_J2000, planet};
        use linkwork_world::gravity::third_body;
        use linkwork_world::planet::{Epoch, MU_JUPITER, MU_SUN};
        let alone = built(in_orbit(vec![]).alone(), CUBE).unwrap();
        let all = built(in_orbit(vec![Third::Sun, Third::Jupiter]), CUBE).unwrap();
        let epoch = Epoch::parse("2012-08-06 05:17:57 UTC").unwrap();
        let rate = (MU_SUN / (1.5 * AU).powi(3)).sqrt();
        let p = Vec3::new(2.1e3, -1.7e3, 0.9e3);
        // Test times within the interpolation table of Jupiter and after its end.
        for t in [0.0, 5e4, 4e5] {
            let (sin, cos) = (std::f64::consts::TAU / 3.0 + rate * t).sin_cos();
            let (tilt, lean) = OBLIQUITY_J2000.sin_cos();
            let body = Vec3::new(cos, sin * lean, sin * tilt) * (1.5 * AU);
            let (day, part) = epoch.tdb_days();
            let jupiter = planet(Body::Jupiter, (day, part + t / 86_400.0)).unwrap().position;
            let want =
                third_body(MU_SUN, &p, &-body) + third_body(MU_JUPITER, &p, &(jupiter - body));
            let have = all.acceleration(t, p) - alone.acceleration(t, p);
            assert!((have - want).norm() < 1e-6 * want.norm(), "{have} {want} at {t}");
            // To first order the acceleration is the tidal term μ₃/s³ (3 ŝ ŝᵀ − 1) r.
            let s = -body.normalize();
            let tide = (s * (3.0 * s.dot(&p)) - p) * (MU_SUN / (1.5 * AU).powi(3));
            assert!((have - tide).norm() < 1e-3 * tide.norm(), "{have} {tide}");
            let g = all.gradient(t, p).unwrap() - alone.gradient(t, p).unwrap();
            assert!((g * p - have).norm() < 1e-6 * have.norm());
        }
        assert!(all.failure(0.0).is_none() && all.failure(4e9).is_some());
    }

    /// A shape with the Earth's mass is treated as the Earth and needs no orbit.
    #[test]
    fn third_bodies_of_a_planet_are_those_of_its_ephemeris() {
        use linkwork_world::ephemeris::moon;
        use linkwork_world::gravity::third_body;
        use linkwork_world::planet::{Epoch, MU_EARTH, MU_MOON};
        let p = in_orbit(vec![Third::Moon]);
        let still = WorldParams {
            body: Centre::Earth,
            mu: Some(MU_EARTH),
            turns: Some(Turning::Still),
            rate: None,
            ..dated()
        };
        let earth = || PolyhedralParams {
            density: None,
            world: handle(still.clone()),
            scale: 6e6,
            orbit: None,
            ..p.clone()
        };
        let (alone, with) = (built(earth().alone(), CUBE).unwrap(), built(earth(), CUBE).unwrap());
        let r = Vec3::new(3e7, -2e7, 1e7);
        let epoch = Epoch::parse("2012-08-06 05:17:57 UTC").unwrap();
        let want = third_body(MU_MOON, &r, &moon(epoch.tdb_days()).position);
        let have = with.acceleration(0.0, r) - alone.acceleration(0.0, r);
        assert!((have - want).norm() < 1e-7 * want.norm(), "{have} {want}");

        let refused = |p: PolyhedralParams, param: &str, fact: &str| {
            let e = built(p, CUBE).err().unwrap_or_else(|| panic!("{fact}"));
            assert!(e.message.contains(fact) && e.help.is_some(), "{}", e.message);
            assert_eq!(e.param.as_deref(), Some(param), "{}", e.message);
        };
        refused(PolyhedralParams { orbit: None, ..p.clone() }, "orbit", "`other` of the world");
        refused(in_orbit(vec![]), "orbit", "no third bodies");
        refused(in_orbit(vec![Third::Sun; 2]), "third_bodies", "named twice");
        let undated = PolyhedralParams { world: handle(turning()), ..p.clone() };
        let e = built(undated, CUBE).err().unwrap();
        assert!(e.message.contains("needs an epoch") && e.help.is_some(), "{}", e.message);
        let site = at_site().site;
        let on_it = handle(WorldParams { site, ..dated() });
        let on_it = PolyhedralParams { world: on_it, ..p.clone() };
        refused(on_it, "third_bodies", "its own pole");
        let third_bodies = vec![Third::Earth];
        refused(PolyhedralParams { third_bodies, ..earth() }, "third_bodies", "the planet itself");
    }

    impl PolyhedralParams {
        /// Returns the parameters without third bodies.
        fn alone(self) -> PolyhedralParams {
            PolyhedralParams { third_bodies: vec![], orbit: None, ..self }
        }
    }

    #[test]
    fn what_is_no_body_is_refused() {
        let fact = |p, text| built(p, text).err().map(|e| (e.message, e.help)).unwrap();
        let world = handle(WorldParams { mu: Some(1.0), ..turning() });
        let both = PolyhedralParams { world, ..params() };
        assert!(fact(both, CUBE).0.contains("both"));
        let moon = WorldParams { body: Centre::Moon, ..turning() };
        let moon = PolyhedralParams { world: handle(moon), ..params() };
        assert!(fact(moon, CUBE).0.contains("`body: moon` of `world` 4.90"));
        let neither = PolyhedralParams { density: None, ..params() };
        assert!(fact(neither, CUBE).0.contains("neither"));
        let open = CUBE.replace("f 4 1 5 8\n", "");
        for text in [open.as_str(), "", "v 1 2\n", "f 1 2 3\n"] {
            let (message, help) = fact(params(), text);
            assert!(!message.is_empty() && help.is_some(), "{text}: {message}");
        }
        let gone = PolyhedralParams { file: "other.obj".into(), ..params() };
        assert!(fact(gone, CUBE).0.contains("other.obj"));
    }
}
