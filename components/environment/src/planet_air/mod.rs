//! Atmospheres that rotate with their planet: `environment.us76`, `environment.msis`, `environment.mars_air`, `environment.table_air`.
//! ```text
//! h     geodetic height above the planet's ellipsoid
//! wind  ω_I × p + R_IP R_PE w(h)        in a site: R_WP R_PE w(h); what drag sees as moving air; w: straight lines between layers, east-north-up
//! ρ, p  those of the model times a factor of the height, for a day that differs from it; temperature and a stay
//! us76  NOAA-S/T 76-1562; heights are turned into geopotential ones with r₀ = 6356766 m inside
//! msis  NRLMSISE-00 (Picone et al. 2002); p = k T Σ n, a = √(γ p/ρ)
//! mars  a Mars-GRAM table (ln ρ and T linear between rows), or several by season and dust (linear in both), or one line each: p = 699 e^(−0.00009 h)
//! table any table over altitude: ln ρ and T linear between rows, p = ρ R T
//! μ     b T^1.5/(T + S), Sutherland: of air around the Earth, of carbon dioxide around Mars, of a gas that is written
//! ```
//! Within 43 km of the centre (Earth) the geodetic height is undefined, and all outputs are NaN.

mod around;
mod table;

pub use around::{Outside, SutherlandParams};
pub use table::{Altitudes, Columns, GasParams, TableAirParams, TableAtmosphere, TableLayout};

use crate::mars_sun::MarsTime;
use crate::world::{Centre, DensityLayer, PlanetWorld, WindLayer, fault};
use around::{Around, Written, around_a_planet, written};
use linkwork_surroundings::prelude::*;
use linkwork_world::atmosphere::{
    self as world, Climate, ClimateEntry, Gas, Layout, Magnetic, Msis, SpaceWeather, Sutherland,
    Table, Us76,
};
use linkwork_world::planet::{Epoch, Geodetic};

/// Boltzmann's constant, J/K (exact).
const BOLTZMANN: f64 = 1.380_649e-23;
/// Greatest height at which this service evaluates NRLMSISE-00, m.
const MSIS_TOP: f64 = 2e6;
/// Sutton-Graves constants of air and of the Mars atmosphere, kg^½/m.
pub(crate) const HEATING_AIR: f64 = 1.7415e-4;
pub(crate) const HEATING_MARS: f64 = 1.9027e-4;
/// Height range of the US Standard Atmosphere 1976, m.
const US76_RANGE: [f64; 2] = [-5e3, 1e6];
/// Height range of the simple Mars model, m: from the lowest terrain to the height above which it deviates from measurements.
const SIMPLE_RANGE: [f64; 2] = [-8.5e3, 3e4];

/// Parameters of the US Standard Atmosphere 1976.
#[derive(Params, Clone, Debug)]
pub struct Us76Params {
    /// The world, whose body has this atmosphere.
    #[param(service)]
    pub world: Handle<dyn World>,
    /// Wind relative to the ground by height, in ascending order; default: still air that rotates with the planet.
    #[param(default = Vec::new())]
    pub winds: Vec<WindLayer>,
    /// Wind relative to the ground from a file instead of `winds`: output of Mars-GRAM (columns HgtMOLA, EWind, NWind) or Earth-GRAM (Hgtkm, EWmean,
    /// NSmean), or columns altitude, east, north (m, m/s) and optionally up. The wind is interpolated linearly and constant beyond the ends.
    #[param(default = None)]
    pub wind_table: Option<String>,
    /// Factors on density and pressure of the model by height, in ascending order; default: none.
    #[param(default = Vec::new())]
    pub density: Vec<DensityLayer>,
    /// Offset added to the standard temperature for hot and cold days: constant up to 71 km, decreasing to zero at 86 km. The pressure at height 0 is
    /// unchanged, and the air stays in hydrostatic equilibrium.
    #[param(unit = "K", default = 0.0, range = -80.0..=80.0)]
    pub temperature_offset: f64,
    /// Behaviour outside −5 to 1000 km: `continue` extrapolates the density, `clamp` holds the air at the end, `stop` stops the run. Default:
    /// continue, with one warning per run.
    #[param(default = None)]
    pub outside: Option<Outside>,
}

/// US Standard Atmosphere 1976 around a planet.
pub struct StandardAtmosphere {
    around: Around,
    model: Us76,
}

impl StandardAtmosphere {
    fn at(&self, _: f64, place: &Geodetic) -> world::Air {
        self.model.at(place.altitude)
    }
}

/// US Standard Atmosphere 1976 from −5 to 1000 km above the rotating ellipsoid, with winds.
#[service("environment.us76", Atmosphere)]
impl Service for StandardAtmosphere {
    type Params = Us76Params;
    fn build(p: Us76Params, files: &Files) -> Result<Self, BuildError> {
        let world = PlanetWorld::of(&p.world)?;
        world.only(Centre::Earth, "the US Standard Atmosphere 1976 is the air")?;
        let gas = (Some(Sutherland::EARTH), Some(HEATING_AIR));
        let around = Around::new(&written!(p, world), US76_RANGE, gas, files)?;
        Ok(StandardAtmosphere { around, model: Us76::with_offset(p.temperature_offset) })
    }
}

/// Parameters of NRLMSISE-00; the date comes from the epoch of the world.
#[derive(Params, Clone, Debug)]
pub struct MsisParams {
    /// The world; its body must be the Earth, and it must have an epoch.
    #[param(service)]
    pub world: Handle<dyn World>,
    /// Solar flux at 10.7 cm of the day before, 1e-22 W/(m² Hz).
    #[param(default = 150.0, range = 1.0..=500.0)]
    pub f107: f64,
    /// Mean of the 10.7 cm solar flux over 81 days; default: `f107`.
    #[param(range = 1.0..=500.0)]
    pub f107_mean: Option<f64>,
    /// Daily magnetic index A_p.
    #[param(default = 4.0, range = 0.0..=400.0)]
    pub ap: f64,
    /// Wind relative to the ground by height, in ascending order.
    #[param(default = Vec::new())]
    pub winds: Vec<WindLayer>,
    /// Wind relative to the ground from a file instead of `winds`: output of Mars-GRAM (columns HgtMOLA, EWind, NWind) or Earth-GRAM (Hgtkm, EWmean,
    /// NSmean), or columns altitude, east, north (m, m/s) and optionally up. Interpolated linearly, constant beyond the ends.
    #[param(default = None)]
    pub wind_table: Option<String>,
    /// Factors on density and pressure of the model by height, in ascending order; default: none.
    #[param(default = Vec::new())]
    pub density: Vec<DensityLayer>,
    /// Behaviour outside 0 to 2000 km: `continue` uses the air at 0 km below and a vacuum above, `clamp` holds the air at the end, `stop` stops the
    /// run. Default: continue, with one warning per run.
    #[param(default = None)]
    pub outside: Option<Outside>,
}

/// NRLMSISE-00 around the Earth.
pub struct MsisAtmosphere {
    around: Around,
    model: Msis,
    epoch: Epoch,
    weather: SpaceWeather,
}

impl MsisAtmosphere {
    /// Returns the air of the model; below 0 m the air at 0 m, above 2000 km zero density.
    fn at(&self, t: f64, place: &Geodetic) -> world::Air {
        let inside = Geodetic { altitude: place.altitude.clamp(0.0, MSIS_TOP), ..*place };
        let found = self.model.at(&self.epoch.plus(t), &inside, &self.weather);
        let Ok(air) = found else {
            let nan = f64::NAN;
            return world::Air { density: nan, temperature: nan, pressure: nan, sound_speed: nan };
        };
        let pressure = air.species.iter().sum::<f64>() * BOLTZMANN * air.temperature;
        let sound_speed = (Gas::EARTH.gamma * pressure / air.density).sqrt();
        let share = if place.altitude > MSIS_TOP { 0.0 } else { 1.0 };
        world::Air {
            density: air.density * share,
            temperature: air.temperature,
            pressure: pressure * share,
            sound_speed,
        }
    }
}

/// NRLMSISE-00 as a function of date, position, local time and solar and geomagnetic activity, 0 to 2000 km; about 5 µs per query.
#[service("environment.msis", Atmosphere)]
impl Service for MsisAtmosphere {
    type Params = MsisParams;
    fn build(p: MsisParams, files: &Files) -> Result<Self, BuildError> {
        let world = PlanetWorld::of(&p.world)?;
        world.only(Centre::Earth, "NRLMSISE-00 is the air")?;
        let epoch = world.params.epoch("NRLMSISE-00")?;
        let weather = SpaceWeather {
            f107: p.f107,
            f107_mean: p.f107_mean.unwrap_or(p.f107),
            magnetic: Magnetic::Daily(p.ap),
        };
        let gas = (Some(Sutherland::EARTH), Some(HEATING_AIR));
        let around = Around::new(&written!(p, world), [0.0, MSIS_TOP], gas, files)?;
        Ok(MsisAtmosphere { around, model: Msis::new(), epoch, weather })
    }
}

/// One Mars-GRAM table of a climate.
#[derive(Params, Clone, Debug)]
pub struct ClimateTable {
    /// Solar longitude L_s of the table.
    #[param(unit = "rad")]
    pub season: f64,
    /// Dust optical depth of the table.
    #[param(range = 0.0..)]
    pub dust: f64,
    /// Output of Mars-GRAM, as in `table`.
    pub table: String,
}

/// Parameters of the Mars atmosphere.
#[derive(Params, Clone, Debug)]
pub struct MarsAirParams {
    /// Output of Mars-GRAM with columns HgtMOLA, Denkgm3, Temp; default: the simple model, which is valid below 30 km.
    #[param(default = None)]
    pub table: Option<String>,
    /// Mars-GRAM tables for several seasons and dust optical depths, one for each pair, instead of `table`.
    #[param(default = Vec::new())]
    pub climate: Vec<ClimateTable>,
    /// With `climate`: solar longitude L_s, 0 at the northern spring equinox; default: from the epoch of the world.
    #[param(unit = "rad")]
    pub season: Option<f64>,
    /// With `climate`: dust optical depth.
    #[param(range = 0.0..)]
    pub dust: Option<f64>,
    /// The world, whose body this air surrounds.
    #[param(service)]
    pub world: Handle<dyn World>,
    /// Wind relative to the ground by height, in ascending order.
    #[param(default = Vec::new())]
    pub winds: Vec<WindLayer>,
    /// Wind relative to the ground from a file instead of `winds`: output of Mars-GRAM (columns HgtMOLA, EWind, NWind) or Earth-GRAM (Hgtkm, EWmean,
    /// NSmean), or columns altitude, east, north (m, m/s) and optionally up. Interpolated linearly, constant beyond the ends.
    #[param(default = None)]
    pub wind_table: Option<String>,
    /// Factors on density and pressure of the model by height, in ascending order; default: none.
    #[param(default = Vec::new())]
    pub density: Vec<DensityLayer>,
    /// Behaviour outside the table, or outside −8.5 to 30 km for the simple model: `continue` extrapolates ln ρ with its last slope, `clamp` holds
    /// the air at the end, `stop` stops the run. Default: continue, with one warning per run.
    #[param(default = None)]
    pub outside: Option<Outside>,
}

/// Mars atmosphere from Mars-GRAM tables or the simple model.
pub struct MarsAtmosphere {
    around: Around,
    table: Option<Table>,
}

impl MarsAtmosphere {
    fn at(&self, _: f64, place: &Geodetic) -> world::Air {
        match &self.table {
            Some(table) => table.at(place.altitude),
            None => world::mars_simple(place.altitude),
        }
    }
}

/// Mars atmosphere from a Mars-GRAM table, from several tables by season and dust, or from a simple model with closed formulas. Heights are above the
/// ellipsoid; the areoid differs from it by up to 2 km. Outside the table the density is extrapolated with its last logarithmic slope.
#[service("environment.mars_air", Atmosphere)]
impl Service for MarsAtmosphere {
    type Params = MarsAirParams;
    fn build(p: MarsAirParams, files: &Files) -> Result<Self, BuildError> {
        let world = PlanetWorld::of(&p.world)?;
        world.only(Centre::Mars, "this is the air")?;
        let read = |name: &str, param: &'static str| {
            table::table(name, param, &Layout::MARS_GRAM, Gas::MARS, files)
        };
        let table = match (&p.table, p.climate.is_empty()) {
            (Some(_), false) => {
                return Err(BuildError::new("`table` and `climate` are both given")
                    .help("remove one of them: `table` is one table, `climate` a list of tables by season and dust")
                    .at("climate"));
            }
            (table, true) => {
                for (param, given) in [("season", p.season), ("dust", p.dust)] {
                    if given.is_some() {
                        return Err(BuildError::new(format!("`{param}` without `climate`"))
                            .help("give `climate: [(season: .., dust: .., table: ..)]`, or leave it out")
                            .at(param));
                    }
                }
                table.as_deref().map(|name| read(name, "table")).transpose()?
            }
            (None, false) => {
                let one = |c: &ClimateTable| {
                    let air = read(&c.table, "climate")?;
                    Ok(ClimateEntry { season: c.season, dust: c.dust, air })
                };
                let tables: Vec<ClimateEntry> =
                    p.climate.iter().map(one).collect::<Result<_, BuildError>>()?;
                let climate = Climate::new(tables).map_err(|e| fault(&e, "climate"))?;
                let season = match p.season {
                    Some(season) => season,
                    None => {
                        let epoch = world.params.epoch("a climate without `season`")?;
                        let (day, part) = epoch.tt();
                        let mars = MarsTime::at(day - 2_451_545.0 + part);
                        mars.solar_longitude_deg.to_radians()
                    }
                };
                let Some(dust) = p.dust else {
                    let (least, most) = climate.dust_range();
                    return Err(BuildError::new("`climate` needs `dust`, the optical depth now")
                        .help(format!("its tables have {least} to {most}"))
                        .at("dust"));
                };
                let air = climate.table(season, dust, world::Outside::Continue, Gas::MARS);
                Some(air.map_err(|e| fault(&e, "dust"))?)
            }
        };
        let range = table.as_ref().map_or(SIMPLE_RANGE, |table| table.heights().into());
        let gas = (Some(Sutherland::CARBON_DIOXIDE), Some(HEATING_MARS));
        let around = Around::new(&written!(p, world), range, gas, files)?;
        Ok(MarsAtmosphere { around, table })
    }
}

around_a_planet!(StandardAtmosphere, MsisAtmosphere, MarsAtmosphere, TableAtmosphere);

#[cfg(test)]
mod table_tests;
#[cfg(test)]
mod tests;
