//! Kinds of services for the surroundings of machines: terrain, gravity, atmosphere, Sun. Models query them at points.
//!
//! W is the simulation's frame: inertial, or a [`Site`]: then z is up, x east, y north.
use crate::contradictions;
use crate::site::{Axes, Site};
use linkwork_collision::relief::{GridFault, Lattice, Relief};
use linkwork_runtime::prelude::Ports;
use linkwork_runtime::{AU, BuildError, Contradiction, Provided, Services};
use linkwork_spatial::{Mat3, Vec3};

/// The ground under a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ground {
    /// Height (m), W.
    pub height: f64,
    /// Unit normal, upwards, W.
    pub normal: Vec3,
}

impl Ground {
    /// Returns height (m), ∂h/∂x and ∂h/∂y.
    pub fn relief(&self) -> [f64; 3] {
        [self.height, -self.normal.x / self.normal.z, -self.normal.y / self.normal.z]
    }
}

/// Soil under the wheels (Bekker–Wong–Reece–Janosi).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Soil {
    /// Sinkage exponent at zero slip n₀ (1).
    pub n: f64,
    /// Slip sinkage: n = n₀ + n₁ |s| (1).
    pub n1: f64,
    /// Cohesive modulus k_c [N/m^(n+1)].
    pub k_c: f64,
    /// Frictional modulus k_φ [N/m^(n+2)].
    pub k_phi: f64,
    /// Cohesion c (Pa).
    pub cohesion: f64,
    /// Internal friction angle φ (rad).
    pub friction_angle: f64,
    /// Shear deformation modulus K (m).
    pub shear_modulus: f64,
    /// Maximum-stress angle θ_m = (a₀ + a₁ s) θ_f: a₀ (1).
    pub a0: f64,
    /// Coefficient a₁ of θ_m (1).
    pub a1: f64,
    /// Rear contact ratio λ (1).
    pub lambda: f64,
    /// Bulk density ρ (kg/m³).
    pub density: f64,
    /// Coulomb coefficient μ of a rigid wheel on this ground (1).
    pub friction: f64,
}

impl Soil {
    /// Soil of ground without a specified soil: NaN in every field, so that it cannot yield a finite force.
    pub const UNKNOWN: Soil = Soil {
        n: f64::NAN,
        n1: f64::NAN,
        k_c: f64::NAN,
        k_phi: f64::NAN,
        cohesion: f64::NAN,
        friction_angle: f64::NAN,
        shear_modulus: f64::NAN,
        a0: f64::NAN,
        a1: f64::NAN,
        lambda: f64::NAN,
        density: f64::NAN,
        friction: f64::NAN,
    };
}

/// A grid of heights, for display and for planners.
#[derive(Clone, Debug, PartialEq)]
pub struct Surface {
    /// x, y of the first node (m).
    pub origin: [f64; 2],
    /// Spacing of nodes along x and y (m).
    pub spacing: [f64; 2],
    /// Nodes along x.
    pub nx: usize,
    /// Nodes along y.
    pub ny: usize,
    /// Heights (m), x fastest; NaN: no data.
    pub heights: Vec<f32>,
}

impl Surface {
    /// Checks that this is a valid grid: it has cells, a height for each node, and positive spacings.
    ///
    /// # Errors
    /// Returns the first violated condition.
    pub fn check(&self) -> Result<(), GridFault> {
        let (nx, ny) = (self.nx, self.ny);
        if nx >= 2 && ny >= 2 && nx.checked_mul(ny) != Some(self.heights.len()) {
            return Err(GridFault::Count { got: self.heights.len(), nx, ny });
        }
        Lattice::new(self.origin, self.spacing, nx, ny)?;
        match self.heights.iter().position(|h| h.is_infinite()) {
            Some(index) => Err(GridFault::Infinite { index }),
            None => Ok(()),
        }
    }
}

/// A rock on the ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rock {
    /// Centre x (m).
    pub x: f64,
    /// Centre y (m).
    pub y: f64,
    /// Diameter (m).
    pub diameter: f64,
    /// Height above the ground (m).
    pub height: f64,
}

/// Terrain.
pub trait Terrain: Send + Sync {
    /// Returns height and normal; `None` off the map or where there is no data.
    fn ground(&self, x: f64, y: f64) -> Option<Ground>;
    /// Height (m), ∂h/∂x and ∂h/∂y at each of several points x, y (m), in one call; the height is NaN where `ground` returns `None`. The surface is
    /// the same as in `ground`; a service with an analytic gradient can override this to avoid the conversion from the normal.
    fn relief(&self, at: &[[f64; 2]], out: &mut [[f64; 3]]) {
        for ([x, y], out) in at.iter().zip(out) {
            *out = self.ground(*x, *y).map_or([f64::NAN; 3], |g| g.relief());
        }
    }
    /// x_min, y_min, x_max, y_max (m).
    fn bounds(&self) -> [f64; 4];
    /// Returns the soil at a point; [`Soil::UNKNOWN`] where none is specified.
    fn soil(&self, x: f64, y: f64) -> &Soil;
    /// Returns all soils of the map, so that a part can check each of them before the run. Default: the soil at the centre of the map.
    fn soils(&self) -> Vec<Soil> {
        let [x0, y0, x1, y1] = self.bounds();
        vec![*self.soil(0.5 * (x0 + x1), 0.5 * (y0 + y1))]
    }
    /// Returns whether the soil is known everywhere.
    fn has_soil(&self) -> bool {
        true
    }
    /// Checks that the soil is known, for a part that computes with it or with its friction.
    ///
    /// # Errors
    /// Returns an error if no soil is specified.
    fn needs_soil(&self) -> Result<(), BuildError> {
        if self.has_soil() {
            return Ok(());
        }
        let fact = "the terrain has no soil";
        let help = "write `soil: (kind: DrySand)`, or another kind, in the terrain (`linkwork describe environment.flat` lists them)";
        Err(BuildError::new(fact).help(help))
    }
    /// Returns heights for display; large maps are thinned out.
    fn surface(&self) -> Surface;
    /// Returns all heights, for collision, cameras and lidar.
    ///
    /// # Errors
    /// Returns an error with a remedy if the map is too large for memory.
    fn nodes(&self) -> Result<Surface, BuildError> {
        Ok(self.surface())
    }
    /// Returns the first failure since the creation of the service (such as a damaged tile), with a remedy. There is no ground at that position; the
    /// run stops at the end of the step in which the failure occurs.
    fn failure(&self, _t: f64) -> Option<BuildError> {
        None
    }
    /// Returns an error if p (m, W) is off the map and lower than the ground at the nearest point of its edge, because nothing supports a part there.
    fn out_of_range(&self, p: Vec3) -> Option<BuildError> {
        let [x0, y0, x1, y1] = self.bounds();
        if (x0..=x1).contains(&p.x) && (y0..=y1).contains(&p.y) || !(x0 <= x1 && y0 <= y1) {
            return None;
        }
        let edge = self.ground(p.x.clamp(x0, x1), p.y.clamp(y0, y1))?.height;
        if p.z >= edge {
            return None;
        }
        let fact = format!(
            "the map extends from ({x0:.1}, {y0:.1}) to ({x1:.1}, {y1:.1}) m, so there is no ground at ({:.1}, {:.1}) m, where the machine is at a height of {:.3} m and the edge of the map at {edge:.3} m",
            p.x, p.y, p.z
        );
        let help = "make the map larger, or end the run earlier (`stop_when`): there is no ground contact outside of the map";
        Some(BuildError::new(fact).help(help))
    }
    /// Returns the rocks, which are already part of the heights.
    fn rocks(&self) -> Vec<Rock> {
        Vec::new()
    }
}

/// Rolling contact queries several points of a terrain in one call.
impl Relief for dyn Terrain + '_ {
    fn relief(&self, at: &[[f64; 2]], out: &mut [[f64; 3]]) {
        Terrain::relief(self, at, out);
    }
}

/// A gravity field.
pub trait Gravity: Send + Sync {
    /// Returns the acceleration (m/s²) at p (m), both in W.
    fn acceleration(&self, t: f64, p: Vec3) -> Vec3;
    /// Returns the symmetric gradient ∂a/∂p (1/s²) of [`Gravity::acceleration`] at p (m), both in W, for variational equations; `None` if there is no
    /// closed form.
    fn gradient(&self, _t: f64, _p: Vec3) -> Option<Mat3> {
        None
    }
    /// Returns the acceleration of a uniform, constant field; `None` for other fields.
    fn uniform(&self) -> Option<Vec3> {
        None
    }
    /// Returns the distance (m) over which the field near p (m, W) changes by about its own magnitude; 0: unknown. The field is evaluated once for
    /// bodies that are locked together and small compared with this distance, and for each body otherwise.
    fn scale(&self, _t: f64, _p: Vec3) -> f64 {
        0.0
    }
    /// Returns an error if the data do not cover the simulated time t (s), with the covered span and a remedy. A run stops at the last row before
    /// that time, with valid results.
    fn failure(&self, _t: f64) -> Option<BuildError> {
        None
    }
    /// Returns the kind of axes that the field assumes for W; in a site `acceleration` includes the centrifugal acceleration.
    fn axes(&self) -> Axes {
        Axes::Any
    }
    /// Returns the site of W, if W rotates with a planet.
    fn site(&self) -> Option<Site> {
        self.axes().site()
    }
    /// Returns the acceleration (m/s²) of a point in free fall at p (m) with velocity v (m/s), all in W, including the Coriolis acceleration if W
    /// rotates.
    fn free_fall(&self, t: f64, p: Vec3, v: Vec3) -> Vec3 {
        let a = self.acceleration(t, p);
        self.site().map_or(a, |s| a - s.omega().cross(&v) * 2.0)
    }
}

/// Air at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Air {
    /// Density (kg/m³).
    pub density: f64,
    /// Pressure (Pa).
    pub pressure: f64,
    /// Temperature (K).
    pub temperature: f64,
    /// Speed of sound (m/s).
    pub speed_of_sound: f64,
    /// Velocity of the air in W (m/s).
    pub wind: Vec3,
}

/// An atmosphere.
pub trait Atmosphere: Send + Sync {
    /// Returns the air at p (m), W.
    fn air(&self, t: f64, p: Vec3) -> Air;
    /// Returns an error if p (m, W) lies outside the range of its data, and whether the run [stops](linkwork_runtime::BuildError::stops) there. It is evaluated
    /// at each row for the nodes of the parts that use the atmosphere.
    fn out_of_range(&self, _t: f64, _p: Vec3) -> Option<BuildError> {
        None
    }
    /// Returns the dynamic viscosity (Pa s) of the gas at a temperature (K); `None` if the gas is unknown.
    fn viscosity(&self, _temperature: f64) -> Option<f64> {
        None
    }
    /// Returns the height (m) of p (m, W) above the ellipsoid of the planet; NaN where it is undefined (near the planet's centre); `None` at every p
    /// if the planet is unknown.
    fn altitude(&self, _t: f64, _p: Vec3) -> Option<f64> {
        None
    }
    /// Returns an error if the data do not cover the simulated time t (s), with the covered span and a remedy. A run stops at the last row before
    /// that time, with valid results.
    fn failure(&self, _t: f64) -> Option<BuildError> {
        None
    }
    /// Returns the Sutton–Graves constant k (kg^½/m) of the gas: q = k √(ρ/r_n) V³; `None` if unknown.
    fn heating_constant(&self) -> Option<f64> {
        None
    }
}

/// Position of the Sun.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SunState {
    /// Unit vector towards the Sun, W.
    pub direction: Vec3,
    /// Distance (AU).
    pub distance_au: f64,
}

/// Sunlight at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Light {
    /// Unit vector from the point to the centre of the Sun, W.
    pub direction: Vec3,
    /// Distance to the Sun (m).
    pub distance: f64,
    /// Irradiance on an area that faces the Sun (W/m²), without shadow and atmosphere.
    pub irradiance: f64,
    /// Fraction of the Sun's disc that is not occulted by a body of the world or the horizon: 1 in full light, 0 in the umbra.
    pub visible: f64,
    /// Angle (rad) to the nearest outer edge of a penumbra: positive in full light. It changes sign where a body or the horizon begins to occult the
    /// Sun.
    pub penumbra: f64,
    /// Angle (rad) to the nearest edge of an umbra or antumbra: negative inside.
    pub umbra: f64,
}

impl Light {
    /// Returns the radiation pressure on an absorbing surface (N/m²): E/c, without shadow.
    #[must_use]
    pub fn pressure(&self) -> f64 {
        self.irradiance / SPEED_OF_LIGHT
    }
}

/// Guards of a model whose output depends on sunlight: the edges at which the light begins to fade and at which it ends. A step of the
/// integrator ends there, so that no shadow is missed.
#[derive(Ports, Clone, Copy, Debug)]
pub struct ShadowEdges {
    /// Angle to the outer edge of the penumbra, positive in the light.
    #[port("rad")]
    pub penumbra: f64,
    /// Angle to the umbra (or the antumbra), negative inside.
    #[port("rad")]
    pub umbra: f64,
}

impl ShadowEdges {
    /// Returns the guards for this light.
    #[must_use]
    pub fn of(light: &Light) -> ShadowEdges {
        ShadowEdges { penumbra: light.penumbra, umbra: light.umbra }
    }
}

/// Speed of light (m/s, exact).
pub const SPEED_OF_LIGHT: f64 = 299_792_458.0;

/// Solar irradiance at 1 AU (W/m²), nominal total solar irradiance of the IAU (2015, resolution B3).
pub const SOLAR_CONSTANT: f64 = 1361.0;

/// The Sun.
pub trait Sun: Send + Sync {
    /// Returns direction and distance at simulated time t (s), from the centre of the world's body, or from the origin of W without a body.
    fn state(&self, t: f64) -> SunState;
    /// Returns the light at p (m, W) and t (s), which solar panels, sun sensors, radiation pressure, cameras and thermal nodes use. Default: parallel
    /// light without occultation.
    fn light(&self, t: f64, _p: &Vec3) -> Light {
        let SunState { direction, distance_au } = self.state(t);
        let irradiance = SOLAR_CONSTANT / (distance_au * distance_au);
        let edge = std::f64::consts::PI;
        Light {
            direction,
            distance: distance_au * AU,
            irradiance,
            visible: 1.0,
            penumbra: edge,
            umbra: edge,
        }
    }
    /// Returns an error if the data do not cover the simulated time t (s), with the covered span and a remedy. A run stops at the last row before
    /// that time, with valid results.
    fn failure(&self, _t: f64) -> Option<BuildError> {
        None
    }
}

impl Provided for dyn Terrain {
    const WORD: &'static str = "terrain";
    const LOCAL: bool = true;
    fn failure(&self, t: f64) -> Option<BuildError> {
        Terrain::failure(self, t)
    }
    fn out_of_range(&self, _t: f64, p: Vec3) -> Option<BuildError> {
        Terrain::out_of_range(self, p)
    }
    fn contradictions(&self, path: &str, services: &Services) -> Vec<Contradiction> {
        contradictions::of_terrain(path, services).into_iter().collect()
    }
}

impl Provided for dyn Gravity {
    const WORD: &'static str = "gravity";
    fn failure(&self, t: f64) -> Option<BuildError> {
        Gravity::failure(self, t)
    }
    fn rotates(&self) -> bool {
        Gravity::site(self).is_some()
    }
    fn contradictions(&self, path: &str, services: &Services) -> Vec<Contradiction> {
        contradictions::of_gravity(path, self.axes(), services).into_iter().collect()
    }
}

impl Provided for dyn Atmosphere {
    const WORD: &'static str = "atmosphere";
    const LOCAL: bool = true;
    fn failure(&self, t: f64) -> Option<BuildError> {
        Atmosphere::failure(self, t)
    }
    fn out_of_range(&self, t: f64, p: Vec3) -> Option<BuildError> {
        Atmosphere::out_of_range(self, t, p)
    }
}

impl Provided for dyn Sun {
    const WORD: &'static str = "sun";
    fn failure(&self, t: f64) -> Option<BuildError> {
        Sun::failure(self, t)
    }
}
