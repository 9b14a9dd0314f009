//! Air that turns with its planet: `environment.us76`, `environment.msis`, `environment.mars_air`.
//! ```text
//! h     geodetic height above the planet's ellipsoid
//! wind  ω_I × p + R_IP R_PE w(h)        in a site: R_WP R_PE w(h); what drag sees as moving air; w: straight lines between layers, east-north-up
//! ρ, p  those of the model times a factor of the height, for a day that differs from it; temperature and a stay
//! us76  NOAA-S/T 76-1562; heights are turned into geopotential ones with r₀ = 6356766 m inside
//! msis  NRLMSISE-00 (Picone et al. 2002); p = k T Σ n, a = √(γ p/ρ)
//! mars  a Mars-GRAM table (ln ρ and T linear between rows), or several by season and dust (linear in both), or one line each: p = 699 e^(−0.00009 h)
//! ```
//! Nearer to the centre than 43 km (Earth) there is no geodetic height and the numbers are NaN.

use crate::mars_sun::MarsTime;
use crate::planet::{Centre, DensityLayer, Planet, PlanetParams, WindLayer, fault};
use linkwork_runtime::prelude::*;
use linkwork_world::atmosphere::{
    self as world, Climate, ClimateEntry, Gas, Layout, Magnetic, Msis, Profile, SpaceWeather,
    Table, Us76,
};
use linkwork_world::planet::{Epoch, Geodetic};

/// Boltzmann's constant, J/K (exact).
const BOLTZMANN: f64 = 1.380_649e-23;
/// Highest place of NRLMSISE-00 here, m.
const MSIS_TOP: f64 = 2e6;
/// Heights of the standard, m.
const US76_RANGE: [f64; 2] = [-5e3, 1e6];
/// Heights for which the simple model of Mars is of use, m: the lowest ground, and where it leaves what was measured.
const SIMPLE_RANGE: [f64; 2] = [-8.5e3, 3e4];

/// What to do where the data of an atmosphere end.
#[derive(Params, Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outside {
    /// Go on as the model does beyond its end, and say nothing of it.
    Continue,
    /// Go on with the air at the end; a run tells it once.
    Clamp,
    /// Stop the run at the first row at which a part asks there.
    Stop,
}

/// The ground under the air, and the wind over it.
struct Around {
    planet: Planet,
    /// What the user wrote.
    outside: Option<Outside>,
    /// Heights for which there are data, m.
    range: [f64; 2],
    winds: Option<Profile<Vec3>>,
    factors: Option<Profile<f64>>,
}

impl Around {
    fn new(
        planet: &PlanetParams,
        winds: &[WindLayer],
        density: &[DensityLayer],
        outside: Option<Outside>,
        range: [f64; 2],
    ) -> Result<Around, BuildError> {
        let wind = |w: &WindLayer| (w.altitude, Vec3::new(w.east, w.north, w.up));
        let winds = match winds.is_empty() {
            true => None,
            false => {
                let entries = winds.iter().map(wind).collect();
                Some(Profile::winds(entries).map_err(|e| fault(&e, "winds"))?)
            }
        };
        let factors = match density.is_empty() {
            true => None,
            false => {
                let entries = density.iter().map(|d| (d.altitude, d.factor)).collect();
                Some(Profile::factors(entries).map_err(|e| fault(&e, "density"))?)
            }
        };
        Ok(Around { planet: planet.planet()?, outside, range, winds, factors })
    }

    /// What there is to say of a point whose height the data do not reach: nothing where going on is what was asked for.
    fn beyond(&self, t: f64, p: Vec3) -> Option<BuildError> {
        if self.outside == Some(Outside::Continue) {
            return None;
        }
        let h = self.planet.place(t, p).1?.altitude;
        let [low, high] = self.range;
        (!(low..=high).contains(&h)).then(|| self.told(h))
    }

    #[cold]
    fn told(&self, h: f64) -> BuildError {
        let [low, high] = self.range.map(|h| h / 1000.0);
        let fact = format!("its data reach from {low} to {high} km, not to {:.3} km", h / 1000.0);
        let goes_on = match self.outside {
            None | Some(Outside::Continue) => "the model goes on beyond its end; ",
            Some(Outside::Clamp) => "the air at the end is taken; ",
            Some(Outside::Stop) => "",
        };
        let help = format!(
            "{goes_on}take an atmosphere whose data reach there, or write `outside`: continue (which is then not told), clamp or stop"
        );
        BuildError::new(fact).help(help).stopping(self.outside == Some(Outside::Stop))
    }

    /// The air at `p`, given what it is at a geodetic place.
    fn air(&self, t: f64, p: Vec3, gas: impl FnOnce(&Geodetic) -> world::Air) -> Air {
        let (spin, place) = self.planet.place(t, p);
        let Some(place) = place else {
            let nan = f64::NAN;
            return Air {
                density: nan,
                pressure: nan,
                temperature: nan,
                speed_of_sound: nan,
                wind: Vec3::repeat(nan),
            };
        };
        let over_ground = self
            .winds
            .as_ref()
            .map_or(Vec3::zeros(), |w| spin.R_IP * (place.east_north_up() * w.at(place.altitude)));
        let a = match self.outside {
            Some(Outside::Clamp) => {
                let altitude = place.altitude.clamp(self.range[0], self.range[1]);
                gas(&Geodetic { altitude, ..place })
            }
            None | Some(Outside::Continue | Outside::Stop) => gas(&place),
        };
        let factor = self.factors.as_ref().map_or(1.0, |f| f.at(place.altitude));
        Air {
            density: a.density * factor,
            pressure: a.pressure * factor,
            temperature: a.temperature,
            speed_of_sound: a.sound_speed,
            wind: spin.omega_I.cross(&p) + over_ground,
        }
    }
}

/// The standard atmosphere around a planet.
#[derive(Params, Clone, Debug)]
pub struct Us76Params {
    /// Shape and rotation.
    #[param(default = PlanetParams::of(Centre::Earth))]
    pub planet: PlanetParams,
    /// Wind over the ground by height, in rising order; none: still air that turns with the planet.
    #[param(default = Vec::new())]
    pub winds: Vec<WindLayer>,
    /// Factors on the model's density by height, in rising order; none: the air of the model.
    #[param(default = Vec::new())]
    pub density: Vec<DensityLayer>,
    /// What happens where its data end (−5 and 1000 km, beyond which density falls on): continue, clamp, stop; unwritten: it goes on, and the run tells it once.
    #[param(default = None)]
    pub outside: Option<Outside>,
}

/// US Standard Atmosphere 1976 around a planet.
pub struct StandardAtmosphere {
    around: Around,
    model: Us76,
}

impl Atmosphere for StandardAtmosphere {
    fn air(&self, t: f64, p: Vec3) -> Air {
        self.around.air(t, p, |place| self.model.at(place.altitude))
    }
    fn beyond(&self, t: f64, p: Vec3) -> Option<BuildError> {
        self.around.beyond(t, p)
    }
    fn axes(&self) -> Axes {
        Axes::of(self.around.planet.site)
    }
}

/// US Standard Atmosphere 1976 from −5 to 1000 km above an ellipsoid that turns, with winds.
#[service("environment.us76", Atmosphere)]
impl Service for StandardAtmosphere {
    type Params = Us76Params;
    fn build(p: Us76Params, _: &Files) -> Result<Self, BuildError> {
        Ok(StandardAtmosphere {
            around: Around::new(&p.planet, &p.winds, &p.density, p.outside, US76_RANGE)?,
            model: Us76::new(),
        })
    }
}

/// NRLMSISE-00: the date is in `planet`.
#[derive(Params, Clone, Debug)]
pub struct MsisParams {
    /// The Earth, its rotation and the epoch.
    pub planet: PlanetParams,
    /// Solar flux at 10.7 cm of the day before, 1e-22 W/(m² Hz).
    #[param(default = 150.0, range = 1.0..=500.0)]
    pub f107: f64,
    /// Its mean over 81 days; unwritten: as `f107`.
    #[param(range = 1.0..=500.0)]
    pub f107_mean: Option<f64>,
    /// Daily magnetic index A_p.
    #[param(default = 4.0, range = 0.0..=400.0)]
    pub ap: f64,
    /// Wind over the ground by height, in rising order.
    #[param(default = Vec::new())]
    pub winds: Vec<WindLayer>,
    /// Factors on the model's density by height, in rising order; none: the air of the model.
    #[param(default = Vec::new())]
    pub density: Vec<DensityLayer>,
    /// What happens where its data end (0 and 2000 km, below as at 0, above nothing): continue, clamp, stop; unwritten: it goes on, and the run tells it once.
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

impl Atmosphere for MsisAtmosphere {
    fn air(&self, t: f64, p: Vec3) -> Air {
        self.around.air(t, p, |place| self.at(t, place))
    }
    fn beyond(&self, t: f64, p: Vec3) -> Option<BuildError> {
        self.around.beyond(t, p)
    }
    fn axes(&self) -> Axes {
        Axes::of(self.around.planet.site)
    }
}

/// NRLMSISE-00 of the Earth by date, place, hour and the Sun's mood, 0 to 2000 km; 5 µs a look.
#[service("environment.msis", Atmosphere)]
impl Service for MsisAtmosphere {
    type Params = MsisParams;
    fn build(p: MsisParams, _: &Files) -> Result<Self, BuildError> {
        if p.planet.body != Centre::Earth {
            return Err(BuildError::new("NRLMSISE-00 is the air of the Earth")
                .help("write `body: earth` in `planet`, or take another atmosphere")
                .at("planet"));
        }
        let epoch = p.planet.epoch("NRLMSISE-00")?;
        let weather = SpaceWeather {
            f107: p.f107,
            f107_mean: p.f107_mean.unwrap_or(p.f107),
            magnetic: Magnetic::Daily(p.ap),
        };
        let range = [0.0, MSIS_TOP];
        let around = Around::new(&p.planet, &p.winds, &p.density, p.outside, range)?;
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
    /// Output of Mars-GRAM with columns HgtMOLA, Denkgm3, Temp; unwritten: the simple model, which holds below 30 km.
    #[param(default = None)]
    pub table: Option<String>,
    /// Such tables at several seasons and dust loads, one for each pair of them, instead of `table`.
    #[param(default = Vec::new())]
    pub climate: Vec<ClimateTable>,
    /// With `climate`: the Sun's longitude L_s, 0 at the northern spring equinox; unwritten: that of the epoch in `planet`.
    #[param(unit = "rad")]
    pub season: Option<f64>,
    /// With `climate`: optical depth of the dust.
    #[param(range = 0.0..)]
    pub dust: Option<f64>,
    /// Shape and rotation.
    #[param(default = PlanetParams::of(Centre::Mars))]
    pub planet: PlanetParams,
    /// Wind over the ground by height, in rising order.
    #[param(default = Vec::new())]
    pub winds: Vec<WindLayer>,
    /// Factors on the model's density by height, in rising order; none: the air of the model.
    #[param(default = Vec::new())]
    pub density: Vec<DensityLayer>,
    /// What happens where its data end (the ends of the table, beyond which density goes on with its last slope; −8.5 and 30 km of the simple model): continue, clamp, stop; unwritten: it goes on, and the run tells it once.
    #[param(default = None)]
    pub outside: Option<Outside>,
}

/// A table of Mars-GRAM or the simple model, around Mars.
pub struct MarsAtmosphere {
    around: Around,
    table: Option<Table>,
}

impl Atmosphere for MarsAtmosphere {
    fn air(&self, t: f64, p: Vec3) -> Air {
        self.around.air(t, p, |place| match &self.table {
            Some(table) => table.at(place.altitude),
            None => world::mars_simple(place.altitude),
        })
    }
    fn beyond(&self, t: f64, p: Vec3) -> Option<BuildError> {
        self.around.beyond(t, p)
    }
    fn axes(&self) -> Axes {
        Axes::of(self.around.planet.site)
    }
}

/// The air of Mars from a Mars-GRAM table, from several by season and dust, or as one line each; heights are above the ellipsoid, the areoid
/// differs from it by up to 2 km. Beyond the table density goes on with its last slope.
#[service("environment.mars_air", Atmosphere)]
impl Service for MarsAtmosphere {
    type Params = MarsAirParams;
    fn build(p: MarsAirParams, files: &Files) -> Result<Self, BuildError> {
        let read = |name: &str, param: &'static str| {
            let path = files.resolve(name).map_err(|e| e.at(param))?;
            let text = linkwork_formats::whole_text(&path).map_err(|e| {
                BuildError::new(format!("`{name}`: {e}")).help("a text file is wanted").at(param)
            })?;
            Table::read(name, &text, &Layout::MARS_GRAM, world::Outside::Continue, Gas::MARS)
                .map_err(|e| fault(&e, param))
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
                        let epoch = p.planet.epoch("a climate without `season`")?;
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
        let range = table.as_ref().map_or(SIMPLE_RANGE, |table| table.range().into());
        let around = Around::new(&p.planet, &p.winds, &p.density, p.outside, range)?;
        Ok(MarsAtmosphere { around, table })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::planet::Turning;

    fn earth() -> PlanetParams {
        PlanetParams { rate: Some(1e-4), angle: 0.4, ..PlanetParams::of(Centre::Earth) }
    }

    #[test]
    fn the_standard_atmosphere_moves_with_the_ground_and_the_wind() {
        // 20 ft/s from the west at the ground, more above: NESC's case 8 upside down.
        let layer = |altitude: f64, east: f64| WindLayer { altitude, east, north: 1.0, up: 0.0 };
        let winds = vec![layer(0.0, 6.0), layer(10_000.0, 16.0)];
        let p = Us76Params { planet: earth(), winds, density: vec![], outside: None };
        let air = StandardAtmosphere::build(p, &Files::default()).unwrap();
        let (t, r) = (3000.0, 6_378_137.0 + 5000.0);
        // A point above the equator, at longitude 0.4 after the turning.
        let at: f64 = 0.4 + 1e-4 * t + 0.4;
        let (up, east) = (Vec3::new(at.cos(), at.sin(), 0.0), Vec3::new(-at.sin(), at.cos(), 0.0));
        let a = air.air(t, up * r);
        assert!((a.wind - (east * (1e-4 * r + 11.0) + Vec3::z())).norm() < 1e-8, "{}", a.wind);
        // The standard's table at 5 km.
        assert!((a.temperature - 255.676).abs() < 1e-2 && (a.density - 0.736_43).abs() < 1e-4);
        assert!((a.pressure / 54_048.0 - 1.0).abs() < 1e-4, "{}", a.pressure);
        // Height counts from the ellipsoid: at the pole it is 21.4 km further in.
        let pole = air.air(t, Vec3::z() * (6_356_752.314 + 5000.0));
        assert!((pole.density - a.density).abs() < 1e-7);
        assert!(air.air(t, Vec3::zeros()).density.is_nan());
    }

    #[test]
    fn msis_knows_day_and_night_and_ends_above() {
        let epoch = Some("2012-08-06 05:17:57 UTC".to_string());
        let planet = PlanetParams { turns: Turning::Iau, epoch, ..PlanetParams::of(Centre::Earth) };
        let p = MsisParams {
            planet,
            f107: 150.0,
            f107_mean: None,
            ap: 4.0,
            winds: vec![],
            density: vec![],
            outside: None,
        };
        let air = MsisAtmosphere::build(p.clone(), &Files::default()).unwrap();
        // Early August: the Sun is at right ascension 136°; the bulge is some 30° behind.
        let at = |degrees: f64, h: f64| {
            let l = degrees.to_radians();
            air.air(0.0, Vec3::new(l.cos(), l.sin(), 0.0) * (6_378_137.0 + h))
        };
        let (day, night) = (at(166.0, 4e5), at(346.0, 4e5));
        assert!(day.density > 2.0 * night.density && day.temperature > night.temperature + 100.0);
        assert!(day.density > 1e-12 && day.density < 2e-11, "{}", day.density);
        let ground = at(50.0, 0.0);
        assert!(
            (ground.density - 1.18).abs() < 0.05 && (ground.speed_of_sound - 346.0).abs() < 6.0
        );
        assert!((ground.pressure / 101_325.0 - 1.0).abs() < 0.02, "{}", ground.pressure);
        assert_eq!(at(50.0, 2.1e6).density, 0.0);
        let mars = MsisParams { planet: PlanetParams::of(Centre::Mars), ..p.clone() };
        let e = MsisAtmosphere::build(mars, &Files::default()).err().unwrap();
        assert!(e.message.contains("Earth") && e.help.is_some());
        let no_date = MsisParams { planet: PlanetParams::of(Centre::Earth), ..p };
        let e = MsisAtmosphere::build(no_date, &Files::default()).err().unwrap();
        assert!(e.message.contains("needs an epoch"), "{}", e.message);
    }

    fn bare(planet: PlanetParams) -> MarsAirParams {
        MarsAirParams {
            table: None,
            climate: vec![],
            season: None,
            dust: None,
            planet,
            winds: vec![],
            density: vec![],
            outside: None,
        }
    }

    /// What it should be is written out: four tables with ln ρ and T by hand.
    #[test]
    fn season_and_dust_choose_the_air_of_mars() {
        let dir = tempfile::tempdir().unwrap();
        let files = Files::of(vec![dir.path().to_path_buf()]);
        let one = |name: &str, density: f64, kelvin: f64, top: f64| {
            let text = format!(
                "HgtMOLA Temp Denkgm3\n0 {kelvin} {density}\n{top} {} {}\n",
                kelvin - 20.0,
                0.1 * density
            );
            std::fs::write(dir.path().join(name), text).unwrap();
        };
        one("spring_clear.txt", 0.02, 220.0, 20.0);
        one("spring_dusty.txt", 0.01, 240.0, 20.0);
        one("autumn_clear.txt", 0.008, 200.0, 40.0);
        one("autumn_dusty.txt", 0.004, 230.0, 20.0);
        let table = |season: f64, dust: f64, name: &str| ClimateTable {
            season: season.to_radians(),
            dust,
            table: name.to_string(),
        };
        let climate = vec![
            table(200.0, 1.1, "autumn_dusty.txt"),
            table(20.0, 0.1, "spring_clear.txt"),
            table(200.0, 0.1, "autumn_clear.txt"),
            table(20.0, 1.1, "spring_dusty.txt"),
        ];
        let p = MarsAirParams { climate, ..bare(PlanetParams::of(Centre::Mars)) };
        let at = |p: &MarsAirParams, season: Option<f64>, dust: Option<f64>| {
            let season = season.map(f64::to_radians);
            MarsAtmosphere::build(MarsAirParams { season, dust, ..p.clone() }, &files)
        };
        let air = |season: f64, dust: f64, h: f64| {
            let built =
                at(&p, Some(season), Some(dust)).unwrap_or_else(|e| panic!("{}", e.message));
            built.air(0.0, Vec3::x() * (3_396_190.0 + h))
        };
        let near = |a: Air, density: f64, kelvin: f64| {
            assert!((a.density / density - 1.0).abs() < 1e-9, "{} for {density}", a.density);
            assert!((a.temperature - kelvin).abs() < 1e-6, "{} for {kelvin}", a.temperature);
        };
        // A table itself; half of the way from one to the next; across the new year, a quarter of the way.
        near(air(20.0, 0.1, 0.0), 0.02, 220.0);
        near(air(380.0, 1.1, 10_000.0), 0.01 * 0.1f64.sqrt(), 230.0);
        near(air(110.0, 0.1, 0.0), (0.02f64 * 0.008).sqrt(), 210.0);
        near(air(-25.0, 0.1, 0.0), 0.02f64.powf(0.75) * 0.008f64.powf(0.25), 215.0);
        near(air(20.0, 0.35, 0.0), 0.02f64.powf(0.75) * 0.01f64.powf(0.25), 225.0);
        // At 20 km the higher table is between its rows.
        let middle = (0.002f64 * 0.008 * 0.1f64.sqrt()).sqrt();
        near(air(110.0, 0.1, 20_000.0), middle, 0.5 * (200.0 + 190.0));
        // The season of a date: L_s 327.3° on 2004-01-03, Mars24's second example.
        let epoch = Some("2004-01-03 13:46:31 UTC".to_string());
        let dated =
            MarsAirParams { planet: PlanetParams { epoch, ..p.planet.clone() }, ..p.clone() };
        let of_date = at(&dated, None, Some(0.1)).unwrap().air(0.0, Vec3::x() * 3_396_190.0);
        let there = air(327.324_16, 0.1, 0.0);
        assert!((of_date.density / there.density - 1.0).abs() < 1e-7, "{}", of_date.density);
        assert!((of_date.temperature - there.temperature).abs() < 1e-5, "{}", of_date.temperature);

        let refused = |p: &MarsAirParams, season, dust| at(p, season, dust).err().unwrap().message;
        assert!(refused(&p, Some(20.0), Some(1.2)).contains("dust from 0.1 to 1.1"));
        assert!(refused(&p, Some(20.0), None).contains("needs `dust`"));
        assert!(refused(&p, None, Some(0.1)).contains("needs an epoch"));
        let mut hole = p.clone();
        hole.climate.pop();
        assert!(refused(&hole, Some(20.0), Some(0.1)).contains("0 tables at the season 20.0°"));
        let both = MarsAirParams { table: Some("spring_clear.txt".into()), ..p.clone() };
        assert!(refused(&both, Some(20.0), Some(0.1)).contains("both given"));
        let none = bare(PlanetParams::of(Centre::Mars));
        assert!(refused(&none, None, Some(0.1)).contains("`dust` without `climate`"));
    }

    #[test]
    fn the_air_of_mars_from_a_line_or_a_table() {
        let planet = PlanetParams::of(Centre::Mars);
        let p = MarsAirParams { table: None, ..bare(planet) };
        let simple = MarsAtmosphere::build(p.clone(), &Files::default()).unwrap();
        let point = |h: f64| Vec3::x() * (3_396_190.0 + h);
        let a = simple.air(0.0, point(5000.0));
        let (kelvin, pascal) = (-31.0 - 0.000998 * 5000.0 + 273.1, 699.0 * (-0.45f64).exp());
        assert!((a.temperature - kelvin).abs() < 1e-6 && (a.pressure - pascal).abs() < 1e-6);
        assert!((a.wind.y - 7.088_218e-5 * 3_401_190.0).abs() < 1e-3, "{}", a.wind);

        let dir = tempfile::tempdir().unwrap();
        let file = |text: &str| {
            std::fs::write(dir.path().join("air.txt"), text).unwrap();
            let files = Files::of(vec![dir.path().to_path_buf()]);
            MarsAtmosphere::build(
                MarsAirParams { table: Some("air.txt".into()), ..p.clone() },
                &files,
            )
        };
        let rows = "HgtMOLA Temp Denkgm3\n0 220 0.02\n10 200 0.005\n20 180 0.002\n";
        let a = file(rows).unwrap().air(0.0, point(5000.0));
        assert!((a.density - 0.01).abs() < 1e-9 && (a.temperature - 210.0).abs() < 1e-6);
        // Place, fact, remedy.
        let e = file(&rows.replace("200", "hot")).err().unwrap();
        assert!(e.message.contains("air.txt:3") && e.message.contains("`hot`"), "{}", e.message);
        assert_eq!(e.param.as_deref(), Some("table"));
        let e = file(&rows.replace("Denkgm3", "Dens")).err().unwrap();
        assert!(e.message.contains("no column `Denkgm3`") && e.help.is_some(), "{}", e.message);
        let missing = MarsAirParams { table: Some("none.txt".into()), ..p };
        let e = MarsAtmosphere::build(missing, &Files::default()).err().unwrap();
        assert!(e.message.contains("none.txt"));
    }

    #[test]
    fn the_air_of_a_day_is_that_of_the_model_times_a_factor_by_height() {
        let planet = PlanetParams::of(Centre::Mars);
        let of = |density: Vec<DensityLayer>| {
            let p = MarsAirParams { density, ..bare(planet.clone()) };
            MarsAtmosphere::build(p, &Files::default())
        };
        let layer = |altitude: f64, factor: f64| DensityLayer { altitude, factor };
        let model = of(vec![]).unwrap();
        let day = of(vec![layer(0.0, 1.2), layer(10_000.0, 0.8)]).unwrap();
        for (h, factor) in [(-3000.0, 1.2), (0.0, 1.2), (2500.0, 1.1), (10_000.0, 0.8), (2e4, 0.8)]
        {
            let p = Vec3::x() * (3_396_190.0 + h);
            let (a, b) = (model.air(0.0, p), day.air(0.0, p));
            assert!(
                (b.density / a.density - factor).abs() < 1e-12,
                "{h}: {}",
                b.density / a.density
            );
            assert!((b.pressure / a.pressure - factor).abs() < 1e-12);
            let rest = |a: &Air| (a.temperature, a.speed_of_sound, a.wind);
            assert_eq!(rest(&a), rest(&b));
        }
        for (wrong, fact) in [
            (vec![layer(0.0, -0.1)], "a factor that is none"),
            (vec![layer(0.0, f64::NAN)], "a factor that is none"),
            (vec![layer(5.0, 1.0), layer(5.0, 1.0)], "altitude 5 m after 5 m"),
        ] {
            let e = of(wrong).err().unwrap();
            assert!(
                e.message.contains(fact) && e.param.as_deref() == Some("density"),
                "{}",
                e.message
            );
        }
    }

    /// Each model: where its data end it goes on, holds the air at the end, or has the run stopped; it tells the height and its range.
    #[test]
    fn where_data_end_the_user_says_what_happens() {
        let dir = tempfile::tempdir().unwrap();
        let files = Files::of(vec![dir.path().to_path_buf()]);
        let rows = "HgtMOLA Temp Denkgm3\n0 220 0.02\n10 200 0.005\n";
        std::fs::write(dir.path().join("air.txt"), rows).unwrap();
        let epoch = Some("2012-08-06 05:17:57 UTC".to_string());
        let earth = PlanetParams { epoch, ..PlanetParams::of(Centre::Earth) };
        let mars = PlanetParams::of(Centre::Mars);
        let us76 = |outside| -> Box<dyn Atmosphere> {
            let p = Us76Params { planet: earth.clone(), winds: vec![], density: vec![], outside };
            Box::new(StandardAtmosphere::build(p, &files).unwrap())
        };
        let msis = |outside| -> Box<dyn Atmosphere> {
            let (f107, f107_mean, ap) = (150.0, None, 4.0);
            let (winds, density, planet) = (vec![], vec![], earth.clone());
            let p = MsisParams { planet, f107, f107_mean, ap, winds, density, outside };
            Box::new(MsisAtmosphere::build(p, &files).unwrap())
        };
        let mars_air = |table: Option<&str>, outside| -> Box<dyn Atmosphere> {
            let p = MarsAirParams { table: table.map(Into::into), outside, ..bare(mars.clone()) };
            Box::new(MarsAtmosphere::build(p, &files).unwrap())
        };
        type Make<'a> = &'a dyn Fn(Option<Outside>) -> Box<dyn Atmosphere>;
        let all: [(&str, Make<'_>, f64, [f64; 2]); 4] = [
            ("us76", &us76, 6_378_137.0, [-5e3, 1e6]),
            ("msis", &msis, 6_378_137.0, [0.0, 2e6]),
            ("table", &|o| mars_air(Some("air.txt"), o), 3_396_190.0, [0.0, 1e4]),
            ("simple", &|o| mars_air(None, o), 3_396_190.0, [-8.5e3, 3e4]),
        ];
        for (name, make, radius, [low, high]) in all {
            let at = |h: f64| Vec3::x() * (radius + h);
            let [holds, stops, asked] =
                [Outside::Clamp, Outside::Stop, Outside::Continue].map(|o| make(Some(o)));
            let goes_on = make(None);
            for (end, out) in [(low + 1e-3, low - 1e3), (high - 1e-3, high + 1e3)] {
                let density = |air: &dyn Atmosphere, h: f64| air.air(0.0, at(h)).density;
                let edge = density(&*holds, end);
                assert!((density(&*holds, out) / edge - 1.0).abs() < 1e-5, "{name} {out}");
                assert_eq!(density(&*goes_on, end), edge, "{name}: inside all are the same");
                let on = density(&*goes_on, out);
                assert_eq!(density(&*asked, out), on, "{name}: the same, unsaid");
                assert!(asked.beyond(0.0, at(out)).is_none(), "{name} {out}");
                let level = name == "msis" && out < 0.0;
                assert!(level || (on / edge - 1.0).abs() > 1e-4, "{name} {out}: {on} {edge}");
                for (air, stops) in [(&goes_on, false), (&holds, false), (&stops, true)] {
                    assert!(air.beyond(0.0, at(end)).is_none(), "{name} {end}");
                    let told = air.beyond(0.0, at(out)).unwrap();
                    assert_eq!(told.stops, stops);
                    let words = format!(
                        "from {} to {} km, not to {:.3} km",
                        low / 1e3,
                        high / 1e3,
                        out / 1e3
                    );
                    assert!(told.message.contains(&words), "{}", told.message);
                    assert!(told.help.unwrap().contains("`outside`"));
                }
            }
        }
    }

    #[test]
    fn winds_that_do_not_rise_are_refused() {
        let layer = |altitude: f64| WindLayer { altitude, east: 1.0, north: 0.0, up: 0.0 };
        let winds = vec![layer(10.0), layer(10.0)];
        let p = Us76Params { planet: earth(), winds, density: vec![], outside: None };
        let e = StandardAtmosphere::build(p, &Files::default()).err().unwrap();
        assert!(e.message.contains("altitude 10 m") && e.param.as_deref() == Some("winds"));
    }
}
