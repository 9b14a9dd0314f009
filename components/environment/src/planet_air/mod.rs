//! Air that turns with its planet: `environment.us76`, `environment.msis`, `environment.mars_air`, `environment.table_air`.
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
//! Nearer to the centre than 43 km (Earth) there is no geodetic height and the numbers are NaN.

mod around;
mod table;

pub use around::{Outside, SutherlandParams};
pub use table::{Altitudes, Columns, GasParams, TableAirParams, TableAtmosphere, TableLayout};

use crate::mars_sun::MarsTime;
use crate::world::{Centre, DensityLayer, PlanetWorld, WindLayer, fault};
use around::{Around, Written, around_a_planet, written};
use linkwork_runtime::prelude::*;
use linkwork_world::atmosphere::{
    self as world, Climate, ClimateEntry, Gas, Layout, Magnetic, Msis, SpaceWeather, Sutherland,
    Table, Us76,
};
use linkwork_world::planet::{Epoch, Geodetic};

/// Boltzmann's constant, J/K (exact).
const BOLTZMANN: f64 = 1.380_649e-23;
/// Highest place of NRLMSISE-00 here, m.
const MSIS_TOP: f64 = 2e6;
/// Constants of Sutton and Graves, kg^½/m: air, and the atmosphere of Mars.
pub(crate) const HEATING_AIR: f64 = 1.7415e-4;
pub(crate) const HEATING_MARS: f64 = 1.9027e-4;
/// Heights of the standard, m.
const US76_RANGE: [f64; 2] = [-5e3, 1e6];
/// Heights for which the simple model of Mars is of use, m: the lowest ground, and where it leaves what was measured.
const SIMPLE_RANGE: [f64; 2] = [-8.5e3, 3e4];

/// The standard atmosphere around a planet.
#[derive(Params, Clone, Debug)]
pub struct Us76Params {
    /// The world, whose body this air surrounds.
    #[param(service)]
    pub world: Handle<dyn World>,
    /// Wind over the ground by height, in rising order; none: still air that turns with the planet.
    #[param(default = Vec::new())]
    pub winds: Vec<WindLayer>,
    /// Wind over the ground from a file instead of `winds`: output of Mars-GRAM (columns HgtMOLA, EWind, NWind) or Earth-GRAM (Hgtkm, EWmean, NSmean), or columns altitude, east,
    /// north (m, m/s), and up where there is one; straight lines between rows, constant beyond the ends.
    #[param(default = None)]
    pub wind_table: Option<String>,
    /// Factors on the model's density by height, in rising order; none: the air of the model.
    #[param(default = Vec::new())]
    pub density: Vec<DensityLayer>,
    /// Added to the temperature of the standard, for hot and cold days: up to 71 km, fading to zero at 86 km. The pressure at height 0 stays, and the
    /// air is in hydrostatic balance.
    #[param(unit = "K", default = 0.0, range = -80.0..=80.0)]
    pub temperature_offset: f64,
    /// What happens where its data end (−5 and 1000 km, beyond which density falls on): continue, clamp, stop; default: it goes on, and the run tells it once.
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

/// US Standard Atmosphere 1976 from −5 to 1000 km above an ellipsoid that turns, with winds.
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

/// NRLMSISE-00: the date is that of the world.
#[derive(Params, Clone, Debug)]
pub struct MsisParams {
    /// The world: the Earth, with an epoch.
    #[param(service)]
    pub world: Handle<dyn World>,
    /// Solar flux at 10.7 cm of the day before, 1e-22 W/(m² Hz).
    #[param(default = 150.0, range = 1.0..=500.0)]
    pub f107: f64,
    /// Its mean over 81 days; default: as `f107`.
    #[param(range = 1.0..=500.0)]
    pub f107_mean: Option<f64>,
    /// Daily magnetic index A_p.
    #[param(default = 4.0, range = 0.0..=400.0)]
    pub ap: f64,
    /// Wind over the ground by height, in rising order.
    #[param(default = Vec::new())]
    pub winds: Vec<WindLayer>,
    /// Wind over the ground from a file instead of `winds`: output of Mars-GRAM (columns HgtMOLA, EWind, NWind) or Earth-GRAM (Hgtkm, EWmean, NSmean), or columns altitude, east,
    /// north (m, m/s), and up where there is one; straight lines between rows, constant beyond the ends.
    #[param(default = None)]
    pub wind_table: Option<String>,
    /// Factors on the model's density by height, in rising order; none: the air of the model.
    #[param(default = Vec::new())]
    pub density: Vec<DensityLayer>,
    /// What happens where its data end (0 and 2000 km, below as at 0, above nothing): continue, clamp, stop; default: it goes on, and the run tells it once.
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
    /// The model's air; below 0 m as at 0 m, above 2000 km nothing.
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

/// NRLMSISE-00 of the Earth by date, place, hour and the Sun's mood, 0 to 2000 km; 5 µs a look.
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

/// A table of a climate.
#[derive(Params, Clone, Debug)]
pub struct ClimateTable {
    /// The Sun's longitude L_s for which it was made.
    #[param(unit = "rad")]
    pub season: f64,
    /// Optical depth of the dust for which it was made.
    #[param(range = 0.0..)]
    pub dust: f64,
    /// Output of Mars-GRAM, as in `table`.
    pub table: String,
}

/// The air of Mars.
#[derive(Params, Clone, Debug)]
pub struct MarsAirParams {
    /// Output of Mars-GRAM with columns HgtMOLA, Denkgm3, Temp; default: the simple model, which holds below 30 km.
    #[param(default = None)]
    pub table: Option<String>,
    /// Such tables at several seasons and dust loads, one for each pair of them, instead of `table`.
    #[param(default = Vec::new())]
    pub climate: Vec<ClimateTable>,
    /// With `climate`: the Sun's longitude L_s, 0 at the northern spring equinox; default: from the epoch of the world.
    #[param(unit = "rad")]
    pub season: Option<f64>,
    /// With `climate`: optical depth of the dust.
    #[param(range = 0.0..)]
    pub dust: Option<f64>,
    /// The world, whose body this air surrounds.
    #[param(service)]
    pub world: Handle<dyn World>,
    /// Wind over the ground by height, in rising order.
    #[param(default = Vec::new())]
    pub winds: Vec<WindLayer>,
    /// Wind over the ground from a file instead of `winds`: output of Mars-GRAM (columns HgtMOLA, EWind, NWind) or Earth-GRAM (Hgtkm, EWmean, NSmean), or columns altitude, east,
    /// north (m, m/s), and up where there is one; straight lines between rows, constant beyond the ends.
    #[param(default = None)]
    pub wind_table: Option<String>,
    /// Factors on the model's density by height, in rising order; none: the air of the model.
    #[param(default = Vec::new())]
    pub density: Vec<DensityLayer>,
    /// What happens where its data end (the ends of the table, beyond which density goes on with its last slope; −8.5 and 30 km of the simple model): continue, clamp, stop; default: it goes on, and the run tells it once.
    #[param(default = None)]
    pub outside: Option<Outside>,
}

/// A table of Mars-GRAM or the simple model, around Mars.
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

/// The air of Mars from a Mars-GRAM table, from several by season and dust, or as one line each; heights are above the ellipsoid, the areoid
/// differs from it by up to 2 km. Beyond the table density goes on with its last slope.
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
                    .help("give one table, or a climate of several")
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
