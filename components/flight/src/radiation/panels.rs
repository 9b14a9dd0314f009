//! `flight.panel_radiation_pressure`: solar radiation pressure, planetary albedo and infrared pressure on flat panels.
//! ```text
//! F_k = −p A cos θ [(1 − ρ_s) ŝ + 2 (ρ_s cos θ + ρ_d/3) n̂]  where cos θ = n̂ · ŝ > 0          M = Σ c_k × F_k
//! Sun       p = ν E/c, ŝ to the Sun; E power of its light, ν visible part of its disc
//! planet    p ŝ = −e E/c: light that its ground scatters (albedo), and its heat (infrared), as if from one place
//! ```
//! Panels are listed in the file, or are the facets of a `mesh`, or both; listed panels (a solar array, an antenna) are added to the mesh. The edges
//! of penumbra and umbra are events. Panels do not shade each other: the model is correct for convex bodies and overestimates the force on others.
//! The planet is a sphere; its light is computed by `linkwork_world::eclipse::planet_light`.

use crate::mesh::{MeshParams, some_panels};
use linkwork_runtime::AU;
use linkwork_surroundings::prelude::*;
use linkwork_world::eclipse::{planet_light, plate};
use linkwork_world::gravity::polyhedron::Facet;

/// Flat panel, lit from the side of its normal. Use two panels for a plate with two sides.
#[derive(Params, Clone, Debug)]
pub struct LitPanel {
    /// Area.
    #[param(unit = "m^2", range = 0.0..)]
    pub area: f64,
    /// Outward normal, body axes; its length does not matter.
    pub normal: Vec3,
    /// Centre relative to the node, body axes.
    #[param(unit = "m", default = Vec3::zeros())]
    pub centre: Vec3,
    /// Specular reflectivity ρ_s.
    #[param(default = 0.0, range = 0.0..=1.0)]
    pub specular: f64,
    /// Diffuse reflectivity ρ_d; the rest is absorbed.
    #[param(default = 0.0, range = 0.0..=1.0)]
    pub diffuse: f64,
}

/// Panels, planet and Sun.
#[derive(Params, Clone, Debug)]
pub struct RadiationPanelParams {
    /// Panels, added to the facets of `mesh`.
    #[param(default = Vec::new())]
    pub panels: Vec<LitPanel>,
    /// Mesh whose facets are panels.
    pub mesh: Option<MeshParams>,
    /// Specular reflectivity of the facets of `mesh`.
    #[param(default = 0.0, range = 0.0..=1.0, needs = "mesh")]
    pub mesh_specular: f64,
    /// Diffuse reflectivity of the facets of `mesh`.
    #[param(default = 0.0, range = 0.0..=1.0, needs = "mesh")]
    pub mesh_diffuse: f64,
    /// Albedo of the planet: the Earth 0.3, Mars 0.25, the Moon 0.12.
    #[param(default = 0.0, range = 0.0..=1.0)]
    pub albedo: f64,
    /// Fraction of the mean sunlight that the planet emits as infrared radiation: 1 − albedo in equilibrium.
    #[param(default = 0.0, range = 0.0..=1.0)]
    pub infrared: f64,
    /// The Sun, including eclipses by other bodies.
    #[param(service)]
    pub sun: Handle<dyn Sun>,
    /// The world, whose body reflects sunlight.
    #[param(service)]
    pub world: Option<Handle<dyn World>>,
}

/// The body.
#[derive(Ports, Clone, Copy, Debug)]
pub struct LitIn {
    /// Node with body axes.
    #[port(bind = "body")]
    pub body: NodeState,
}

/// Radiation load and pressures.
#[derive(Ports, Clone, Copy, Debug)]
pub struct LitOut {
    /// Force and moment at the node.
    #[port(bind = "body")]
    pub load: Wrench,
    /// Visible fraction of the solar disc.
    #[port("1")]
    pub visible: f64,
    /// Solar radiation pressure on an absorbing surface, including the shadow.
    #[port("N/m^2")]
    pub pressure: f64,
    /// Radiation pressure of albedo and infrared.
    #[port("N/m^2")]
    pub planet_pressure: f64,
}

/// Radiation pressure on flat panels.
pub struct PanelRadiation {
    p: RadiationPanelParams,
}

impl PanelRadiation {
    /// Returns force and moment of light with a pressure (N/m²) from a direction, body axes.
    fn lit(&self, pressure: f64, from: &Vec3) -> (Vec3, Vec3) {
        let (mut force, mut moment) = (Vec3::zeros(), Vec3::zeros());
        for k in &self.p.panels {
            let f = plate(pressure, k.area, &k.normal, from, k.specular, k.diffuse);
            force += f;
            moment += k.centre.cross(&f);
        }
        (force, moment)
    }
}

/// Solar radiation pressure, planetary albedo and infrared pressure on flat panels, with conical shadows.
#[model("flight.panel_radiation_pressure")]
impl Model for PanelRadiation {
    type Params = RadiationPanelParams;
    type FeedthroughInputs = LitIn;
    type FeedthroughOutputs = LitOut;
    type Guards = ShadowEdges;
    fn build(mut p: RadiationPanelParams) -> Result<Self, BuildError> {
        for (k, panel) in p.panels.iter_mut().enumerate() {
            let refuse = |fact: String, help: &str| {
                Err(BuildError::new(format!("panel {}: {fact}", k + 1)).help(help).at("panels"))
            };
            let length = panel.normal.norm();
            if !(length > 1e-9) {
                return refuse(
                    "its normal is the zero vector".into(),
                    "write a direction, e.g. normal: [1, 0, 0]",
                );
            }
            let sent = panel.specular + panel.diffuse;
            if sent > 1.0 {
                let fact = format!("it reflects {sent} of the light");
                return refuse(fact, "the sum of `specular` and `diffuse` must not exceed 1");
            }
            panel.normal /= length;
        }
        if let Some(mesh) = &p.mesh {
            let (specular, diffuse) = (p.mesh_specular, p.mesh_diffuse);
            let sent = specular + diffuse;
            if sent > 1.0 {
                return Err(BuildError::new(format!("the mesh reflects {sent} of the light"))
                    .help("the sum of `mesh_specular` and `mesh_diffuse` must not exceed 1")
                    .at("mesh_specular"));
            }
            let lit = |f: &Facet| {
                let Facet { area, normal, centre } = *f;
                LitPanel { area, normal, centre, specular, diffuse }
            };
            p.panels.extend(mesh.facets()?.iter().map(lit));
        }
        some_panels(p.panels.len())?;
        if p.world.is_none() && (p.albedo > 0.0 || p.infrared > 0.0) {
            let fact = "`albedo` and `infrared` need a planet, but the simulation has no `world`";
            let help =
                "write `world: (body: ..)` in the simulation, or remove `albedo` and `infrared`";
            return Err(BuildError::new(fact).help(help).at("albedo"));
        }
        Ok(PanelRadiation { p })
    }
    fn feedthrough(&self, clock: &Clock, u: &LitIn) -> LitOut {
        let p = &self.p;
        let light = p.sun.light(clock.t, &u.body.position);
        let (visible, to_body) = (light.visible, u.body.rotation.inverse());
        let sunlight = visible * light.pressure();
        let (mut force, mut moment) = self.lit(sunlight, &(to_body * light.direction));
        // The sunlight on the planet is scaled to the distance of the planet's centre from the Sun.
        let (e, planet_light_pressure) = match &p.world {
            Some(world) if p.albedo > 0.0 || p.infrared > 0.0 => {
                let (seen, r) = (p.sun.state(clock.t), world.relative_to_centre(&u.body.position));
                let e = planet_light(&r, &seen.direction, world.radius(), p.albedo, p.infrared);
                (e, light.pressure() * (light.distance / (seen.distance_au * AU)).powi(2))
            }
            _ => (Vec3::zeros(), 0.0),
        };
        let share = e.norm();
        let planet_pressure = share * planet_light_pressure;
        if share > 0.0 {
            let (f, m) = self.lit(planet_pressure, &(to_body * (e / -share)));
            force += f;
            moment += m;
        }
        let turn = u.body.rotation;
        let load = Wrench { moment: turn * moment, force: turn * force };
        LitOut { load, visible, pressure: sunlight, planet_pressure }
    }
    fn guards(&self, clock: &Clock, u: &LitIn) -> ShadowEdges {
        ShadowEdges::of(&self.p.sun.light(clock.t, &u.body.position))
    }
    /// The event has no state; it only restarts the integrator at the edge of the shadow.
    fn handle_event(&self) -> ((), ()) {
        ((), ())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use linkwork_spatial::Quat;
    use linkwork_surroundings::{PlainWorld, SPEED_OF_LIGHT};
    use std::sync::Arc;

    const RADIUS: f64 = 6_378_137.0;

    /// Sun at 1 AU from a planet at a given position in W, with a shadow without penumbra.
    struct Along(Vec3, Vec3);
    impl Sun for Along {
        fn state(&self, _: f64) -> SunState {
            SunState { direction: self.0, distance_au: 1.0 }
        }
        fn light(&self, _: f64, p: &Vec3) -> Light {
            let r = p - self.1;
            let to = self.0 * AU - r;
            let dark = r.dot(&self.0) < 0.0 && r.cross(&self.0).norm() < RADIUS;
            Light {
                direction: to.normalize(),
                distance: to.norm(),
                irradiance: 4.56e-6 * SPEED_OF_LIGHT * (AU / to.norm()).powi(2),
                visible: if dark { 0.0 } else { 1.0 },
                penumbra: 1.0,
                umbra: 1.0,
            }
        }
    }

    fn panel(area: f64, normal: Vec3, centre: Vec3) -> LitPanel {
        LitPanel { area, normal, centre, specular: 0.3, diffuse: 0.2 }
    }

    fn model(
        panels: Vec<LitPanel>,
        albedo: f64,
        infrared: f64,
    ) -> Result<PanelRadiation, BuildError> {
        let world = PlainWorld::inertial(4e14, RADIUS, 0.0);
        seen_from(panels, (albedo, infrared), Vec3::x(), world)
    }

    fn seen_from(
        panels: Vec<LitPanel>,
        (albedo, infrared): (f64, f64),
        sun: Vec3,
        world: PlainWorld,
    ) -> Result<PanelRadiation, BuildError> {
        let centre = -world.relative_to_centre(&Vec3::zeros());
        let sun = Arc::new(Along(sun, centre)) as Arc<dyn Sun>;
        PanelRadiation::build(RadiationPanelParams {
            panels,
            mesh: None,
            mesh_specular: 0.0,
            mesh_diffuse: 0.0,
            albedo,
            infrared,
            sun: Handle::new("sun", sun),
            world: Some(world.handle()),
        })
    }

    fn at(model: &PanelRadiation, position: Vec3, rotation: Quat) -> LitOut {
        let body = NodeState { position, rotation, ..NodeState::identity() };
        model.feedthrough(&Clock::at(0.0, 0.01, 0), &LitIn { body })
    }

    #[test]
    fn a_plate_has_the_golden_force_in_any_attitude() {
        let near = (AU / (AU - 7e6)).powi(2);
        let golden = Vec3::new(-2.2374781585018852e-5, -4.48781253029662e-6, 0.0) * near;
        let normal = Vec3::new(0.4f64.cos(), 0.4f64.sin(), 0.0);
        let turn = Quat::from_euler_angles(0.7, -0.3, 1.9);
        let arm = Vec3::new(0.2, -0.5, 1.1);
        let back = |v: Vec3| turn.inverse() * v;
        let m = model(vec![panel(4.0, back(normal * 3.0), back(arm))], 0.0, 0.0).unwrap();
        // The position is on the line to the Sun, and nearer to the Sun than the planet by its
        // distance from the planet.
        let y = at(&m, Vec3::new(7e6, 0.0, 0.0), turn);
        assert!((y.load.force - golden).norm() < 1e-13 * golden.norm(), "{:?}", y.load.force);
        assert!((y.load.moment - arm.cross(&golden)).norm() < 1e-12 * golden.norm());
        // The force on the back side and in the shadow is zero.
        let m = model(vec![panel(4.0, -Vec3::x(), arm)], 0.0, 0.0).unwrap();
        assert_eq!(at(&m, Vec3::new(0.0, 7e6, 0.0), Quat::identity()).load.force, Vec3::zeros());
        let m = model(vec![panel(4.0, Vec3::x(), arm)], 0.0, 0.0).unwrap();
        assert_eq!(at(&m, Vec3::new(-7e6, 0.0, 0.0), Quat::identity()).load.force, Vec3::zeros());
    }

    /// The force on a box of black panels equals that on a black body with the same projected area: F = −p A_shadow ŝ.
    #[test]
    fn a_black_cube_swallows_the_light_of_its_shadow() {
        let axes = [Vec3::x(), Vec3::y(), Vec3::z()];
        let faces = axes.iter().flat_map(|n| [*n, -n]);
        let black = |n: Vec3| LitPanel { specular: 0.0, diffuse: 0.0, ..panel(1.0, n, n * 0.5) };
        let m = model(faces.map(black).collect(), 0.0, 0.0).unwrap();
        let turn = Quat::from_euler_angles(0.4, 0.9, -0.2);
        let y = at(&m, Vec3::new(8e6, 0.0, 0.0), turn);
        let s = turn.inverse() * Vec3::x();
        let shadow = s.x.abs() + s.y.abs() + s.z.abs();
        let wanted = -Vec3::x() * (y.pressure * shadow);
        assert!((y.load.force - wanted).norm() < 1e-13 * wanted.norm(), "{:?}", y.load.force);
        assert!(y.load.moment.norm() < 1e-12 * y.load.force.norm(), "its middle is in the middle");
    }

    #[test]
    fn the_planet_pushes_up() {
        // The position is slightly sunward of the terminator, so the Sun does not light the panel that faces down.
        let r = Vec3::new(2e6, 6.7e6, 0.3e6);
        let up = r.normalize();
        let lit = |infrared: f64, albedo: f64| {
            let down = panel(2.0, -up, Vec3::zeros());
            let black = LitPanel { specular: 0.0, diffuse: 0.0, ..down };
            at(&model(vec![black], albedo, infrared).unwrap(), r, Quat::identity())
        };
        // The infrared pressure is (R/r)²/4 of the solar radiation pressure and acts upwards.
        let y = lit(1.0, 0.0);
        let wanted = 4.56e-6 * 0.25 * (6_378_137.0 / r.norm()).powi(2);
        assert!((y.planet_pressure / wanted - 1.0).abs() < 1e-8, "{}", y.planet_pressure);
        assert!((y.load.force - up * (2.0 * wanted)).norm() < 1e-8 * wanted, "{:?}", y.load.force);
        // Only half of the ground is lit, at a low elevation of the Sun.
        let y = lit(0.0, 0.3);
        assert!(
            y.planet_pressure > 0.02 * 4.56e-6 && y.planet_pressure < 0.1 * 4.56e-6,
            "{}",
            y.planet_pressure
        );
        assert_eq!(lit(0.0, 0.0).planet_pressure, 0.0);
    }

    #[test]
    fn from_a_site_the_planet_is_below_it() {
        let (site, _) = crate::attitude::tests::fast_site();
        let world = PlainWorld::of_site(4e14, RADIUS, site);
        let to_W = Quat::from_euler_angles(0.7, -0.3, 1.9);
        let attitude = Quat::from_euler_angles(0.1, 0.4, -0.8);
        let r = Vec3::new(2e6, 6.7e6, 0.3e6);
        let panels = [Vec3::x(), -Vec3::y(), Vec3::new(-0.3, -0.8, 0.2)];
        let panels = panels.map(|n| panel(2.0, n, Vec3::new(0.3, -0.2, 0.7))).to_vec();
        let there = model(panels.clone(), 0.3, 0.7).unwrap();
        let here = seen_from(panels, (0.3, 0.7), to_W * Vec3::x(), world).unwrap();
        let a = at(&there, r, attitude);
        let b = at(&here, to_W * r - site.relative_to_centre(&Vec3::zeros()), to_W * attitude);
        let scale = a.load.force.norm();
        assert!(scale > 1e-6 && a.planet_pressure > 1e-7, "{a:?}");
        assert!((to_W * a.load.force - b.load.force).norm() < 1e-9 * scale, "{a:?} {b:?}");
        assert!((to_W * a.load.moment - b.load.moment).norm() < 1e-9 * scale, "{a:?} {b:?}");
        assert!((a.planet_pressure - b.planet_pressure).abs() < 1e-9 * a.planet_pressure);
    }

    #[test]
    fn what_is_no_panel_is_refused() {
        let told = |p: LitPanel| model(vec![p], 0.0, 0.0).err().unwrap().to_string();
        assert!(
            told(panel(1.0, Vec3::zeros(), Vec3::zeros()))
                .contains("panel 1: its normal is the zero vector")
        );
        let mirror = LitPanel { specular: 0.9, ..panel(1.0, Vec3::x(), Vec3::zeros()) };
        assert!(told(mirror).contains("reflects 1.1 of the light"));
    }

    fn meshed(
        panels: Vec<LitPanel>,
        mesh: &str,
        specular: f64,
    ) -> Result<PanelRadiation, BuildError> {
        let sun = Arc::new(Along(Vec3::x(), Vec3::zeros())) as Arc<dyn Sun>;
        let mesh = crate::mesh::tests::mesh(mesh);
        PanelRadiation::build(RadiationPanelParams {
            panels,
            mesh: Some(MeshParams { origin: Vec3::new(0.3, -0.5, 1.1), scale: 0.7, ..mesh }),
            mesh_specular: specular,
            mesh_diffuse: 0.2,
            albedo: 0.0,
            infrared: 0.0,
            sun: Handle::new("sun", sun),
            world: None,
        })
    }

    /// A cube of 1.4 m from a mesh, and its plates in closed form: F = −p A Σ cos θ [(1 − ρ_s) ŝ + 2 (ρ_s cos θ + ρ_d/3) n̂].
    #[test]
    fn a_meshed_cube_is_its_plates() {
        use crate::mesh::tests::CUBE;
        let turn = Quat::from_euler_angles(0.4, 0.9, -0.2);
        let (middle, side, specular) = (Vec3::new(0.3, -0.5, 1.1), 1.4, 0.3);
        let y = at(&meshed(vec![], CUBE, specular).unwrap(), Vec3::new(8e6, 0.0, 0.0), turn);
        let s = turn.inverse() * Vec3::x();
        let (mut force, mut moment) = (Vec3::zeros(), Vec3::zeros());
        for n in [Vec3::x(), Vec3::y(), Vec3::z()].into_iter().flat_map(|n| [n, -n]) {
            let cosine = n.dot(&s).max(0.0);
            let along = s * (1.0 - specular) + n * (2.0 * (specular * cosine + 0.2 / 3.0));
            let f = along * (-y.pressure * side * side * cosine);
            force += f;
            moment += (middle + n * (0.5 * side)).cross(&f);
        }
        let (f, m) = (turn.inverse() * y.load.force, turn.inverse() * y.load.moment);
        assert!((f - force).norm() < 1e-13 * force.norm(), "{f} {force}");
        assert!((m - moment).norm() < 1e-13 * moment.norm(), "{m} {moment}");
        // A panel in the list is added to the mesh.
        let wing = || vec![panel(5.0, Vec3::x(), Vec3::y() * 3.0)];
        let both = at(&meshed(wing(), CUBE, specular).unwrap(), Vec3::new(8e6, 0.0, 0.0), turn);
        let wing = at(&model(wing(), 0.0, 0.0).unwrap(), Vec3::new(8e6, 0.0, 0.0), turn);
        let sum = y.load.force + wing.load.force;
        assert!(wing.load.force.norm() > 0.0);
        assert!((both.load.force - sum).norm() < 1e-14 * sum.norm());
    }

    #[test]
    fn a_bad_mesh_and_no_surface_are_refused() {
        let at = |r: Result<PanelRadiation, BuildError>| {
            let e = r.err().unwrap();
            assert!(e.help.is_some(), "{}", e.message);
            e.param.unwrap()
        };
        assert_eq!(at(meshed(vec![], "", 0.3)), "mesh");
        assert_eq!(at(meshed(vec![], crate::mesh::tests::CUBE, 0.9)), "mesh_specular");
        assert_eq!(at(model(vec![], 0.0, 0.0)), "panels");
    }
}
