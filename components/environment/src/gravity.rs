//! Gravity of planets: `environment.spherical_harmonics`, `environment.zonal_gravity`.
//! ```text
//! a_I = R_IP ∇V(R_IPᵀ p)  +  Σ_k third body k             R_IP at the time of the stage
//! V   = μ/r Σ_n (R/r)ⁿ Σ_m P̄_nm(sin φ)(C̄_nm cos mλ + S̄_nm sin mλ)        Pines 1973, no singular poles
//! third body:  `third_bodies.rs`; with a field of its own: another centre
//! solid tide:  a = k₂ μ₃ R⁵/(2 s³ r⁴) [(3 − 15 c²) r̂ + 6 c ŝ]     c = r̂ · ŝ: how the planet answers to it
//! in a site:   r from the planet's centre
//! zonal: V = μ/r (1 − Σ J_n (R/r)ⁿ P_n(z/r))
//! ```
//! A series of high degree means nothing below the planet's surface.

pub use crate::third_bodies::Third;
use crate::third_bodies::{Puller, pullers};
use crate::world::{Centre, Planet, PlanetWorld, Turning, WorldParams, fault};
use linkwork_runtime::prelude::*;
use linkwork_spatial::Mat3;
use linkwork_world::gravity::{
    Format, Harmonics, Keep, TideRaiser, read, solid_tide, solid_tide_gradient, zonal,
    zonal_gradient,
};

/// Layouts of coefficient files.
#[derive(Params, Clone, Copy, Debug, PartialEq, Eq)]
pub enum FieldFormat {
    /// `.cof` of GMAT.
    Gmat,
    /// Text of Basilisk: header, then n, m, C, S; metres.
    Basilisk,
    /// `.gfc` of ICGEM.
    Icgem,
    /// SHADR of the Planetary Data System; kilometres.
    Shadr,
}

/// The field of a third body that the run comes near to.
#[derive(Params, Clone, Debug)]
pub struct ThirdField {
    /// Which of `third_bodies`: earth, mars, moon.
    pub body: Centre,
    /// File of coefficients, whose μ goes before that of the ephemeris.
    pub file: String,
    /// Its layout: gmat, basilisk, icgem, shadr.
    pub format: FieldFormat,
    /// Highest degree.
    #[param(default = 20, range = 0.0..=360.0)]
    pub degree: usize,
    /// Highest order; default: the degree.
    #[param(range = 0.0..=360.0)]
    pub order: Option<usize>,
}

/// A field of harmonics, the planet that carries it, and who else pulls.
#[derive(Params, Clone, Debug)]
pub struct HarmonicsParams {
    /// File of coefficients.
    pub file: String,
    /// Its layout: gmat, basilisk, icgem, shadr.
    pub format: FieldFormat,
    /// Highest degree.
    #[param(default = 20, range = 0.0..=360.0)]
    pub degree: usize,
    /// Highest order; default: the degree.
    #[param(range = 0.0..=360.0)]
    pub order: Option<usize>,
    /// The world, whose body has this field.
    #[param(service)]
    pub world: Handle<dyn World>,
    /// Who else pulls: sun, moon, earth, venus, mars, jupiter; needs an epoch in `world`.
    #[param(default = Vec::new())]
    pub third_bodies: Vec<Third>,
    /// Fields of third bodies that the run comes near to: so that it has several centres, as on the way from the Earth to an orbit about
    /// the Moon. Each turns by the IAU; W is in the axes of the ICRF.
    #[param(default = Vec::new())]
    pub fields: Vec<ThirdField>,
    /// Love number k₂ of the solid tide that the third bodies raise on the planet: the Earth 0.3, Mars 0.17; 0: none.
    #[param(default = 0.0, range = 0.0..=1.5)]
    pub love: f64,
}

/// A field of harmonics on a turning planet, and third bodies.
pub struct SphericalHarmonics {
    field: Harmonics,
    world: PlanetWorld,
    pullers: Vec<Puller>,
    /// Love number, and the radius that belongs to it, m.
    love: (f64, f64),
}

impl SphericalHarmonics {
    /// From the planet's centre to a third body, m, W; NaN where the ephemeris has nothing.
    fn towards(&self, third: &Puller, t: f64) -> Vec3 {
        third.towards(self.world.planet.site.as_ref(), t)
    }

    /// From the planet's centre to a point (m, W).
    fn around_centre(&self, p: &Vec3) -> Vec3 {
        self.world.planet.site.map_or(*p, |s| s.from_centre(p))
    }

    /// Acceleration (m/s²) of the planet's field alone at `p` (m), both in W, with the centrifugal part in a site.
    pub fn field(&self, t: f64, p: Vec3) -> Vec3 {
        self.world.planet.gravity(t, p, |p| self.field.acceleration(p))
    }

    /// Acceleration (m/s², W) relative to the planet by the third bodies alone, in the order written; `p` in W.
    pub fn thirds(&self, t: f64, p: Vec3) -> impl Iterator<Item = Vec3> + '_ {
        let r = self.around_centre(&p);
        self.pullers.iter().map(move |k| k.pull(self.world.planet.site.as_ref(), t, &r))
    }

    /// Acceleration (m/s², W) at `p` (m, W) by the tide that the third bodies raise on the planet.
    pub fn tide(&self, t: f64, p: Vec3) -> Vec3 {
        let (k2, radius) = self.love;
        if k2 == 0.0 {
            return Vec3::zeros();
        }
        let raiser = |k: &Puller| TideRaiser { mu: k.mu, position: self.towards(k, t) };
        let r = self.around_centre(&p);
        self.pullers.iter().map(|k| solid_tide(k2, radius, &raiser(k), &r)).sum()
    }
}

impl Gravity for SphericalHarmonics {
    fn acceleration(&self, t: f64, p: Vec3) -> Vec3 {
        let rigid = self.thirds(t, p).fold(self.field(t, p), |a, b| a + b);
        if self.love.0 == 0.0 { rigid } else { rigid + self.tide(t, p) }
    }
    fn gradient(&self, t: f64, p: Vec3) -> Option<Mat3> {
        let own = self.world.planet.gradient(t, p, |p| self.field.full(p).gradient);
        let r = self.around_centre(&p);
        let (k2, radius) = self.love;
        let others = self.pullers.iter().map(|k| {
            let rigid = k.gradient(self.world.planet.site.as_ref(), t, &r);
            if k2 == 0.0 {
                return rigid;
            }
            let raiser = TideRaiser { mu: k.mu, position: self.towards(k, t) };
            rigid + solid_tide_gradient(k2, radius, &raiser, &r)
        });
        Some(others.fold(own, |a, b| a + b))
    }
    fn scale(&self, t: f64, p: Vec3) -> f64 {
        let r = self.around_centre(&p);
        let own = r.norm() / (self.field.degree() + 2) as f64;
        let others = self.pullers.iter().map(|k| k.scale(self.world.planet.site.as_ref(), t, &r));
        others.fold(own, f64::min)
    }
    fn trouble(&self, t: f64) -> Option<BuildError> {
        self.pullers.iter().find_map(|k| k.trouble(t))
    }
    fn axes(&self) -> Axes {
        self.world.planet.axes()
    }
}

/// Those who pull, with their fields.
fn sources(
    p: &HarmonicsParams,
    world: &PlanetWorld,
    files: &Files,
) -> Result<Vec<Puller>, BuildError> {
    let mut all = pullers(world, &p.third_bodies, None)?;
    let own_params = &world.params;
    for (k, own) in p.fields.iter().enumerate() {
        let body = own.body.body();
        let of_body = |third: &Third| Some(third.body().0) == body;
        let (Some(at), false) = (
            p.third_bodies.iter().position(of_body),
            p.fields[..k].iter().any(|before| before.body == own.body),
        ) else {
            let fact = format!(
                "a field of `{}`, which is no third body here, or has one",
                own.body.word()
            );
            let help = "name it once in `third_bodies`, and its field once in `fields`";
            return Err(BuildError::new(fact).help(help).at("fields"));
        };
        let turns = WorldParams { epoch: own_params.epoch.clone(), ..WorldParams::of(own.body) };
        let (dut1, pole, span) = (own_params.dut1, own_params.pole, own_params.span);
        let turns = WorldParams { turns: Some(Turning::Iau), dut1, pole, span, ..turns };
        let field = field(&own.file, own.format, (own.degree, own.order), files)
            .map_err(|e| e.at("fields"))?;
        all[at].mu = field.mu();
        all[at].field = Some((field, turns.rotation(files)?));
    }
    Ok(all)
}

/// Differences of a file's gravity parameter from that of the world: as written, and of the body that it is.
const SAME: (f64, f64) = (1e-6, 0.02);

/// Whether a field from a file belongs to the body of the world.
fn of_the_world(mu: f64, file: &str, world: &PlanetWorld) -> Result<(), BuildError> {
    let off = |other: f64| (mu / other - 1.0).abs();
    let wrong = match (world.params.mu, world.params.body.mu()) {
        (Some(written), _) if off(written) > SAME.0 => {
            format!("`mu` of `world` is {written:e} m³/s²")
        }
        (None, Some(own)) if off(own) > SAME.1 => {
            format!("`body` of `world` is `{}`, which has {own:e} m³/s²", world.params.body.word())
        }
        _ => return Ok(()),
    };
    let fact = format!("`{file}` is the field of a body of {mu:e} m³/s², and {wrong}");
    Err(BuildError::new(fact).help("use the field of that body, or change `world`").at("file"))
}

/// A field from a file, cut at a degree and order.
fn field(
    file: &str,
    format: FieldFormat,
    (degree, order): (usize, Option<usize>),
    files: &Files,
) -> Result<Harmonics, BuildError> {
    let path = files.resolve(file).map_err(|e| e.at("file"))?;
    let text = linkwork_formats::whole_text(&path).map_err(|e| {
        BuildError::new(format!("`{file}`: {e}")).help("a text file is wanted").at("file")
    })?;
    let format = match format {
        FieldFormat::Gmat => Format::Gmat,
        FieldFormat::Basilisk => Format::Basilisk,
        FieldFormat::Icgem => Format::Icgem,
        FieldFormat::Shadr => Format::Shadr,
    };
    let all = read(format, file, &text, Keep::Degree(degree)).map_err(|e| fault(&e, "file"))?;
    let order = order.unwrap_or_else(|| degree.min(all.order()));
    Ok(Harmonics::new(&all.truncated(degree, order).map_err(|e| fault(&e, "order"))?))
}

/// Gravity of a planet from a file of spherical harmonics, turning with the planet, and of third bodies.
/// W is inertial with the planet at its origin, with `turns: iau` or third bodies in the axes of the ICRF; or it is a site, with third bodies on a planet that turns by the IAU.
#[service("environment.spherical_harmonics", Gravity)]
impl Service for SphericalHarmonics {
    type Params = HarmonicsParams;
    fn build(p: HarmonicsParams, files: &Files) -> Result<Self, BuildError> {
        let world = PlanetWorld::of(&p.world)?;
        let field = field(&p.file, p.format, (p.degree, p.order), files)?;
        of_the_world(field.mu(), &p.file, &world)?;
        let pullers = sources(&p, &world, files)?;
        if p.love > 0.0 && pullers.is_empty() {
            return Err(BuildError::new("nobody raises a tide: there are no third bodies")
                .help("write third_bodies: [\"sun\", \"moon\"], or leave `love` out")
                .at("love"));
        }
        let love = (p.love, field.radius());
        Ok(SphericalHarmonics { field, world, pullers, love })
    }
}

/// A field (m/s²) that is given in axes of the planet, at a site that W is, with the centrifugal part where W turns; without a site, in axes of W.
pub(crate) fn around(planet: &Planet, p: Vec3, field: impl Fn(&Vec3) -> Vec3) -> Vec3 {
    match &planet.site {
        Some(s) => {
            let own = s.from_planet_axes(&field(&s.to_planet(&p)));
            if planet.turning { own + s.centrifugal(&p) } else { own }
        }
        None => field(&p),
    }
}

/// ∂a/∂p (1/s²) of the same, given that of the field.
pub(crate) fn gradient_around(planet: &Planet, p: Vec3, gradient: impl Fn(&Vec3) -> Mat3) -> Mat3 {
    let Some(s) = &planet.site else { return gradient(&p) };
    let (R, omega) = (s.pose.rotation.to_rotation_matrix().into_inner(), s.omega());
    let own = R.transpose() * gradient(&s.to_planet(&p)) * R;
    match planet.turning {
        true => own + Mat3::identity() * omega.norm_squared() - omega * omega.transpose(),
        false => own,
    }
}

/// Distance (m) of a place in W from the planet's centre.
pub(crate) fn from_centre(site: Option<&Site>, p: Vec3) -> f64 {
    site.map_or(p, |s| s.from_centre(&p)).norm()
}

/// The zonal harmonics of the world's body.
#[derive(Params, Clone, Debug)]
pub struct ZonalParams {
    /// Radius that belongs to the coefficients; default: from the world's body.
    #[param(unit = "m", range = 1e-3..)]
    pub radius: Option<f64>,
    /// J₂, not normalised: the Earth 1.08262982e-3, Mars 1.9566e-3, the Moon 2.033e-4.
    pub j2: f64,
    /// J₃, not normalised.
    #[param(default = 0.0)]
    pub j3: f64,
    /// J₄, not normalised.
    #[param(default = 0.0)]
    pub j4: f64,
    /// The world, whose body it is.
    #[param(service)]
    pub world: Handle<dyn World>,
}

/// Point mass and J₂ to J₄.
pub struct ZonalGravity {
    mu: f64,
    radius: f64,
    /// J₂ … as far as the last that is not zero.
    j: Vec<f64>,
    world: PlanetWorld,
    /// The pole is not z of W, and W is inertial.
    leans: bool,
}

impl Gravity for ZonalGravity {
    fn acceleration(&self, t: f64, p: Vec3) -> Vec3 {
        let field = |p: &Vec3| zonal(self.mu, self.radius, &self.j, p);
        match self.leans {
            true => self.world.planet.gravity(t, p, field),
            false => around(&self.world.planet, p, field),
        }
    }
    fn gradient(&self, t: f64, p: Vec3) -> Option<Mat3> {
        let own = |p: &Vec3| zonal_gradient(self.mu, self.radius, &self.j, p);
        Some(match self.leans {
            true => self.world.planet.gradient(t, p, own),
            false => gradient_around(&self.world.planet, p, own),
        })
    }
    fn scale(&self, _: f64, p: Vec3) -> f64 {
        // As a series of degree 4.
        from_centre(self.world.planet.site.as_ref(), p) / 6.0
    }
    fn axes(&self) -> Axes {
        self.world.planet.axes()
    }
}

/// Point mass and zonal harmonics J₂, J₃, J₄ of the world's body, about its pole.
#[service("environment.zonal_gravity", Gravity)]
impl Service for ZonalGravity {
    type Params = ZonalParams;
    fn build(p: ZonalParams, _: &Files) -> Result<Self, BuildError> {
        let world = PlanetWorld::of(&p.world)?;
        let mu = world.needs_mu()?;
        let radius = p.radius.unwrap_or_else(|| world.planet.ellipsoid.equatorial_radius());
        let mut j = vec![p.j2, p.j3, p.j4];
        j.truncate(j.iter().rposition(|j| *j != 0.0).map_or(0, |last| last + 1));
        let leans = world.planet.site.is_none() && world.params.turning() == Turning::Iau;
        Ok(ZonalGravity { mu, radius, j, world, leans })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::{SiteParams, handle};

    /// A lopsided field up to degree and order 3, in Basilisk's layout.
    const FIELD: &str = "\
6378136.3, 3.986004415e14, 7.2921150E-5, 3, 3, 1, 0.0, 0.0
0, 0, 1.0, 0.0, 0.0, 0.0
1, 0, 0.0, 0.0, 0.0, 0.0
1, 1, 0.0, 0.0, 0.0, 0.0
2, 0, -4.8416e-04, 0.0, 0.0, 0.0
2, 1, -2.0e-10, 1.38e-09, 0.0, 0.0
2, 2, 2.4e-05, -1.4e-05, 0.0, 0.0
3, 0, 9.57e-07, 0.0, 0.0, 0.0
3, 1, 2.03e-05, 2.48e-06, 0.0, 0.0
3, 2, 9.04e-06, -6.19e-06, 0.0, 0.0
3, 3, 7.21e-06, 1.41e-05, 0.0, 0.0
";

    fn earth() -> WorldParams {
        WorldParams { angle: Some(0.7), ..WorldParams::of(Centre::Earth) }
    }

    fn params() -> HarmonicsParams {
        HarmonicsParams {
            file: "field.txt".into(),
            format: FieldFormat::Basilisk,
            degree: 3,
            order: None,
            world: handle(earth()),
            third_bodies: vec![],
            fields: vec![],
            love: 0.0,
        }
    }

    fn built(p: &HarmonicsParams, text: &str) -> Result<SphericalHarmonics, BuildError> {
        let dir = tempfile::tempdir().unwrap();
        std::fs::write(dir.path().join("field.txt"), text).unwrap();
        SphericalHarmonics::build(p.clone(), &Files::of(vec![dir.path().to_path_buf()]))
    }

    const P: Vec3 = Vec3::new(-4_292_653.41, 955_168.47, 5_139_356.57);

    #[test]
    fn the_field_turns_with_the_planet() {
        let turning = built(&params(), FIELD).unwrap();
        let (t, rate) = (4321.0, Centre::Earth.rate().unwrap());
        let still = HarmonicsParams {
            world: handle(WorldParams {
                turns: Some(Turning::Still),
                angle: Some(0.7 + rate * t),
                ..earth()
            }),
            ..params()
        };
        let still = built(&still, FIELD).unwrap();
        let (a, b) = (turning.acceleration(t, P), still.acceleration(0.0, P));
        assert!((a - b).norm() < 1e-14, "{a} {b}");
        assert!((a - turning.acceleration(0.0, P)).norm() > 1e-4, "the turning matters");
        assert!(turning.uniform().is_none());
    }

    #[test]
    fn degree_and_order_cut_and_zonals_agree_with_the_closed_form() {
        let p = HarmonicsParams { order: Some(0), ..params() };
        let cut = built(&p, FIELD).unwrap().acceleration(100.0, P);
        let (root5, root7) = (5f64.sqrt(), 7f64.sqrt());
        let j = ZonalParams {
            radius: Some(6_378_136.3),
            j2: 4.8416e-4 * root5,
            j3: -9.57e-7 * root7,
            j4: 0.0,
            world: handle(WorldParams { mu: Some(3.986004415e14), ..earth() }),
        };
        let closed = ZonalGravity::build(j, &Files::default()).unwrap();
        let want = closed.acceleration(0.0, P);
        assert!((cut - want).norm() < 1e-14 * want.norm() * 10.0, "{cut} {want}");
        // And the gradient of its potential, J₄ included.
        let field = ZonalGravity::build(oblate(earth()), &Files::default()).unwrap();
        let v = |p: Vec3| {
            let (r, u) = (p.norm(), p.z / p.norm());
            let p2 = (3.0 * u * u - 1.0) / 2.0;
            let p3 = (5.0 * u.powi(3) - 3.0 * u) / 2.0;
            let p4 = (35.0 * u.powi(4) - 30.0 * u * u + 3.0) / 8.0;
            let k = 6.4e6 / r;
            4e14 / r * (1.0 - 1e-3 * k * k * p2 + 2e-3 * k.powi(3) * p3 - 3e-3 * k.powi(4) * p4)
        };
        for k in 0..3 {
            let mut e = Vec3::zeros();
            e[k] = 50.0;
            let slope = (v(P + e) - v(P - e)) / 100.0;
            assert!((field.acceleration(0.0, P)[k] - slope).abs() < 1e-8, "{k}");
        }
    }

    /// Zonal harmonics up to J₄ of a body of 4e14 m³/s² and 6400 km.
    fn oblate(world: WorldParams) -> ZonalParams {
        let world = handle(WorldParams { mu: Some(4e14), ..world });
        ZonalParams { radius: Some(6.4e6), j2: 1e-3, j3: -2e-3, j4: 3e-3, world }
    }

    fn dated() -> WorldParams {
        let epoch = Some("2012-08-06 00:00:00 UTC".to_string());
        WorldParams {
            epoch,
            span: 3600.0,
            turns: Some(Turning::Fixed),
            angle: Some(0.0),
            ..WorldParams::of(Centre::Earth)
        }
    }

    /// By the IAU, in the axes of the ICRF.
    fn by_iau() -> WorldParams {
        WorldParams { turns: None, angle: None, ..dated() }
    }

    fn with_sun_and_moon() -> HarmonicsParams {
        let world = handle(dated());
        HarmonicsParams { world, third_bodies: vec![Third::Sun, Third::Moon], ..params() }
    }

    #[test]
    fn third_bodies_raise_a_tide_and_go_on_beyond_their_table() {
        let g = built(&with_sun_and_moon(), FIELD).unwrap();
        // Sun and Moon by the plain difference of two pulls.
        for (k, third) in g.pullers.iter().enumerate() {
            let s = g.towards(third, 100.0);
            let plain =
                (s - P) * (third.mu / (s - P).norm().powi(3)) - s * (third.mu / s.norm().powi(3));
            let a = g.thirds(100.0, P).nth(k).unwrap();
            assert!((a - plain).norm() < 1e-12 && a.norm() > 1e-7, "{a} {plain}");
        }
        let sum = g.field(100.0, P) + g.thirds(100.0, P).sum::<Vec3>();
        assert!((g.acceleration(100.0, P) - sum).norm() < 1e-14);
        // The table ends after an hour; the Moon's place has no jump there.
        let moon = &g.pullers[1];
        let (before, after) = (g.towards(moon, 3600.9), g.towards(moon, 3601.1));
        assert!((after - before).norm() < 300.0 && (before.norm() - 3.9e8).abs() < 4e7);
    }

    /// The greatest tide of the Moon on the Earth lifts a low orbit by some 1e-7 m/s²; it is there by its closed form, towards both
    /// sides alike, and a rigid planet has none.
    #[test]
    fn the_planet_answers_to_who_pulls() {
        let rigid = built(&with_sun_and_moon(), FIELD).unwrap();
        let g = built(&HarmonicsParams { love: 0.3, ..with_sun_and_moon() }, FIELD).unwrap();
        let radius = g.love.1;
        assert!((radius - 6.378e6).abs() < 1e5, "{radius}");
        let sum = rigid.acceleration(100.0, P) + g.tide(100.0, P);
        assert!((g.acceleration(100.0, P) - sum).norm() < 1e-15);
        assert_eq!(rigid.tide(100.0, P), Vec3::zeros());
        // Under the Moon, alone: −3 k₂ μ₃ R⁵/(s³ r⁴) along r̂, inwards: the bulge is nearer than the ball was.
        let moon = &g.pullers[1];
        let s = g.towards(moon, 100.0);
        let r = s.normalize() * 7e6;
        let own = |p: Vec3| solid_tide(0.3, radius, &TideRaiser { mu: moon.mu, position: s }, &p);
        let wanted = -0.3 * 3.0 * moon.mu * radius.powi(5) / (s.norm().powi(3) * 7e6f64.powi(4));
        assert!((own(r).dot(&r) / 7e6 / wanted - 1.0).abs() < 1e-12, "{}", own(r).dot(&r) / 7e6);
        assert!((own(r) + own(-r)).norm() < 1e-20);
        let both = g.tide(100.0, r).dot(&r) / 7e6;
        assert!((0.5..2.0).contains(&(both / wanted)), "{both} {wanted}");
        let e = built(&HarmonicsParams { love: 0.3, ..params() }, FIELD).err().unwrap();
        assert!(e.message.contains("nobody raises a tide") && e.param.as_deref() == Some("love"));
    }

    #[test]
    fn third_bodies_pull_and_raise_tides_alike_over_a_site() {
        let p = HarmonicsParams { love: 0.3, ..with_sun_and_moon() };
        let there = HarmonicsParams { world: handle(by_iau()), ..p };
        let here =
            SiteParams { latitude: 0.9, longitude: 2.9, height: 0.0, heading: 0.4, turning: true };
        let world = handle(WorldParams { site: Some(here), ..by_iau() });
        let (there, here) =
            (built(&there, FIELD), built(&HarmonicsParams { world, ..there.clone() }, FIELD));
        let (there, here) = (there.unwrap(), here.unwrap());
        let Axes::Site(site) = here.axes() else { panic!("no site") };
        for t in [0.0, 3000.0] {
            let R = site.to_inertial(t);
            let p = R.inverse() * P - site.from_centre(&Vec3::zeros());
            let pulls = here.thirds(t, p).sum::<Vec3>() + here.tide(t, p);
            let want = there.thirds(t, P).sum::<Vec3>() + there.tide(t, P);
            assert!((R * pulls - want).norm() < 1e-10 * want.norm(), "{pulls} {want}");
            // The whole, with the centrifugal part taken off; the pole is that of the start.
            let whole = R * (here.acceleration(t, p) - site.centrifugal(&p));
            assert!((whole - there.acceleration(t, P)).norm() < 1e-9, "{t} s");
            assert!((here.scale(t, p) / there.scale(t, P) - 1.0).abs() < 1e-12);
        }
    }

    /// Each service: ∂a/∂p is the slope of its acceleration, in inertial axes and from a site, with all that pulls.
    #[test]
    fn gradients_are_slopes_of_the_acceleration() {
        use crate::fields::{PointMassGravity, PointMassGravityParams};
        let here =
            SiteParams { latitude: 0.9, longitude: 2.9, height: 4e5, heading: 0.4, turning: true };
        let tidal = HarmonicsParams { love: 0.3, world: handle(by_iau()), ..with_sun_and_moon() };
        let moon = ThirdField {
            body: Centre::Moon,
            file: "field.txt".into(),
            format: FieldFormat::Basilisk,
            degree: 3,
            order: None,
        };
        let lopsided = HarmonicsParams { fields: vec![moon], ..tidal.clone() };
        let over = handle(WorldParams { site: Some(here), ..by_iau() });
        let at_site = HarmonicsParams { world: over, ..lopsided.clone() };
        let zonal = |world| ZonalGravity::build(oblate(world), &Files::default()).unwrap();
        let point = |world: WorldParams| {
            let world = handle(WorldParams { mu: Some(4e14), ..world });
            PointMassGravity::build(PointMassGravityParams { world }, &Files::default()).unwrap()
        };
        let [tidal, lopsided, at_site] =
            [tidal, lopsided, at_site].map(|p| built(&p, FIELD).unwrap());
        let fixed = WorldParams { site: Some(here), ..WorldParams::of(Centre::Earth) };
        let (leans, zonal, zonal_site) = (zonal(by_iau()), zonal(earth()), zonal(fixed.clone()));
        let (point, point_site) = (point(earth()), point(fixed));
        let beside_the_moon =
            lopsided.towards(&lopsided.pullers[1], 500.0) + Vec3::new(5e6, -7e6, 4e6);
        let near = Vec3::new(3e5, -2e5, 1e5);
        let all: [(&str, &dyn Gravity, Vec3); 9] = [
            ("tide", &tidal, P),
            ("harmonics", &lopsided, P),
            ("at the Moon", &lopsided, beside_the_moon),
            ("site", &at_site, near),
            ("zonal", &zonal, P),
            ("zonal by the IAU", &leans, P),
            ("zonal site", &zonal_site, near),
            ("point", &point, P),
            ("point site", &point_site, near),
        ];
        for (name, field, p) in all {
            let g = field.gradient(500.0, p).unwrap();
            for k in 0..3 {
                let a = |s: f64| field.acceleration(500.0, p + Vec3::ith(k, 500.0 * s));
                let slope = ((a(1.0) - a(-1.0)) * 8.0 - (a(2.0) - a(-2.0))) / 6000.0;
                let off = (g.column(k) - slope).norm() / g.norm();
                assert!(off < 1e-8, "{name} {k}: {off}");
            }
        }
        // The tide and the turning are in it.
        let rigid = built(&HarmonicsParams { love: 0.0, ..with_sun_and_moon() }, FIELD).unwrap();
        assert!(rigid.gradient(0.0, P).is_some());
        let lean = |g: Mat3| (g - g.transpose()).norm() / g.norm();
        assert!(lean(at_site.gradient(0.0, near).unwrap()) < 1e-12);
        let turning = 2.0 * Centre::Earth.rate().unwrap().powi(2);
        let trace = point_site.gradient(0.0, near).unwrap().trace();
        assert!((trace / turning - 1.0).abs() < 1e-6, "{trace}");
    }

    #[test]
    fn mistakes_have_place_fact_and_remedy() {
        let told = |p: &HarmonicsParams, text: &str| {
            let e = built(p, text).err().unwrap();
            (e.message.clone(), e.help.clone().unwrap(), e.param.clone().unwrap())
        };
        let (fact, _, param) = told(&params(), &FIELD.replace("2.4e-05", "?"));
        assert!(fact.contains("field.txt:7") && fact.contains('?') && param == "file", "{fact}");
        let (fact, _, _) = told(&params(), FIELD.rsplit_once("3, 3").unwrap().0);
        assert!(fact.contains("has 3 of its 4 orders"), "{fact}");
        let (fact, help, _) = told(&HarmonicsParams { degree: 4, ..params() }, FIELD);
        assert!(fact.contains("degree 3, not 4") && help.contains("ask for less"), "{fact}");
        let (fact, _, param) = told(&HarmonicsParams { order: Some(4), ..params() }, FIELD);
        assert!(fact.contains("order 4") && param == "order", "{fact}");
        let (fact, _, _) = told(&HarmonicsParams { file: "none.txt".into(), ..params() }, FIELD);
        assert!(fact.contains("none.txt"));
        let sun = HarmonicsParams { third_bodies: vec![Third::Sun], ..params() };
        let e = built(&sun, FIELD).err().unwrap();
        assert!(e.message.contains("a third body needs an epoch"), "{}", e.message);
        // The field of one body is not that of another, nor of another gravity parameter.
        for (world, words) in [
            (WorldParams::of(Centre::Moon), "`body` of `world` is `moon`"),
            (WorldParams { mu: Some(3.986e14), ..earth() }, "`mu` of `world`"),
        ] {
            let (fact, _, param) =
                told(&HarmonicsParams { world: handle(world), ..params() }, FIELD);
            assert!(fact.contains(words) && param == "file", "{fact}");
        }
        for (thirds, words) in [
            (vec![Third::Earth], "is the planet itself"),
            (vec![Third::Moon, Third::Moon], "is named twice"),
        ] {
            let p = HarmonicsParams { world: handle(dated()), third_bodies: thirds, ..params() };
            let (fact, _, param) = told(&p, FIELD);
            assert!(fact.contains(words) && param == "third_bodies", "{fact}");
        }
    }

    /// Over its `scale` a field changes by its own size at most: what is small against it may be taken as a whole.
    #[test]
    fn no_field_changes_faster_than_its_scale_says() {
        let series = built(&with_sun_and_moon(), FIELD).unwrap();
        let beside_the_moon = series.towards(&series.pullers[1], 0.0) + Vec3::new(3e6, -2e6, 4e6);
        let zonal = ZonalGravity::build(oblate(earth()), &Files::default()).unwrap();
        let rates = |field: &dyn Gravity, p: Vec3| {
            let change = |e: Vec3| {
                let g = |side: f64| field.acceleration(0.0, p + e * (100.0 * side));
                (g(1.0) - g(-1.0)).norm() / 200.0
            };
            let rate =
                (0..3).map(|k| change(Vec3::ith(k, 1.0))).fold(change(p.normalize()), f64::max);
            rate * field.scale(0.0, p) / field.acceleration(0.0, p).norm()
        };
        for p in [P, P * 3.0, Vec3::z() * 6.5e6, beside_the_moon] {
            for (name, field) in [("series", &series as &dyn Gravity), ("zonal", &zonal)] {
                let part = rates(field, p);
                assert!((0.01..=1.001).contains(&part), "{name} at {p}: {part}");
            }
        }
    }

    /// Oblateness is about the planet's own pole, however it stands in W: the zonal field is that of the harmonics of degree 2.
    #[test]
    fn a_zonal_field_leans_with_its_planet() {
        let (root5, radius) = (5f64.sqrt(), 6_378_136.3);
        let zonal = ZonalParams {
            radius: Some(radius),
            j2: 4.8416e-4 * root5,
            j3: 0.0,
            j4: 0.0,
            world: handle(WorldParams { mu: Some(3.986004415e14), ..by_iau() }),
        };
        let zonal = ZonalGravity::build(zonal, &Files::default()).unwrap();
        let series =
            HarmonicsParams { degree: 2, order: Some(0), world: handle(by_iau()), ..params() };
        let series = built(&series, FIELD).unwrap();
        let (a, b) = (zonal.acceleration(700.0, P), series.acceleration(700.0, P));
        assert!((a - b).norm() < 1e-13 * b.norm(), "{a} {b}");
        let about_z = ZonalGravity::build(oblate(earth()), &Files::default()).unwrap();
        let leans = ZonalGravity::build(oblate(by_iau()), &Files::default()).unwrap();
        assert!((about_z.acceleration(0.0, P) - leans.acceleration(0.0, P)).norm() > 1e-6);
    }
}
