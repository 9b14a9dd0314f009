//! What all air around planets has in common: the ground that turns under it, the wind over that, factors of a day, and where data end.
use crate::world::{DensityLayer, PlanetWorld, WindLayer, fault};
use linkwork_runtime::prelude::*;
use linkwork_world::atmosphere::{self as world, Profile, Sutherland};
use linkwork_world::planet::Geodetic;

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

/// Viscosity of a gas by Sutherland's law, μ = μ₀ (T₀ + S)/(T + S) (T/T₀)^1.5.
#[derive(Params, Clone, Debug)]
pub struct SutherlandParams {
    /// μ₀, at the temperature T₀: 14.8e-6 Pa s for carbon dioxide.
    #[param(unit = "Pa s", range = 1e-9..)]
    pub viscosity: f64,
    /// T₀: 293.15 K for carbon dioxide.
    #[param(unit = "K", range = 1.0..)]
    pub temperature: f64,
    /// S: 240 K for carbon dioxide.
    #[param(unit = "K", range = 0.0..)]
    pub constant: f64,
}

impl SutherlandParams {
    /// The law.
    pub fn law(&self) -> Sutherland {
        Sutherland::through(self.viscosity, self.temperature, self.constant)
    }
}

/// What the user wrote of it.
pub(super) struct Written<'a> {
    pub world: PlanetWorld,
    pub winds: &'a [WindLayer],
    pub wind_table: Option<&'a str>,
    pub density: &'a [DensityLayer],
    pub outside: Option<Outside>,
}

/// What all parameters of these services say alike.
macro_rules! written {
    ($p:ident, $world:expr) => {
        Written {
            world: $world,
            winds: &$p.winds,
            wind_table: $p.wind_table.as_deref(),
            density: &$p.density,
            outside: $p.outside,
        }
    };
}
pub(super) use written;

/// What all of these services do alike, each with its air `at` a time and a place.
macro_rules! around_a_planet {
    ($($service:ty),*) => {$(
        impl Atmosphere for $service {
            fn air(&self, t: f64, p: Vec3) -> Air {
                self.around.air(t, p, |place| self.at(t, place))
            }
            fn out_of_range(&self, t: f64, p: Vec3) -> Option<BuildError> {
                self.around.out_of_range(t, p)
            }
            fn viscosity(&self, temperature: f64) -> Option<f64> {
                self.around.viscosity.map(|law| law.at(temperature))
            }
            fn altitude(&self, t: f64, p: Vec3) -> Option<f64> {
                Some(self.around.altitude(t, p))
            }
            fn heating_constant(&self) -> Option<f64> {
                self.around.heating
            }
        }
    )*};
}
pub(super) use around_a_planet;

/// The ground under the air, and the wind over it.
pub(super) struct Around {
    pub world: PlanetWorld,
    /// Constant of Sutton and Graves for its gas, where it is known.
    pub heating: Option<f64>,
    /// What the user wrote.
    outside: Option<Outside>,
    /// Heights for which there are data, m.
    range: [f64; 2],
    /// That of its gas, where it is known.
    pub viscosity: Option<Sutherland>,
    winds: Option<Profile<Vec3>>,
    factors: Option<Profile<f64>>,
}

impl Around {
    /// With data for heights in `range`, m.
    pub fn new(
        w: &Written<'_>,
        range: [f64; 2],
        (viscosity, heating): (Option<Sutherland>, Option<f64>),
        files: &Files,
    ) -> Result<Around, BuildError> {
        let density = w.density;
        let factors = match density.is_empty() {
            true => None,
            false => {
                let entries = density.iter().map(|d| (d.altitude, d.factor)).collect();
                Some(Profile::factors(entries).map_err(|e| fault(&e, "density"))?)
            }
        };
        let (world, winds) = (w.world.clone(), winds(w, files)?);
        Ok(Around { world, heating, outside: w.outside, range, viscosity, winds, factors })
    }

    /// Height (m) of p (m, W) above the ellipsoid, NaN near the planet's centre.
    pub fn altitude(&self, t: f64, p: Vec3) -> f64 {
        self.world.planet.place(t, p).1.map_or(f64::NAN, |place| place.altitude)
    }

    /// What there is to say of a point whose height the data do not reach: nothing where going on is what was asked for.
    pub fn out_of_range(&self, t: f64, p: Vec3) -> Option<BuildError> {
        if self.outside == Some(Outside::Continue) {
            return None;
        }
        let h = self.world.planet.place(t, p).1?.altitude;
        let [low, high] = self.range;
        (!(low..=high).contains(&h)).then(|| self.told(h))
    }

    #[cold]
    fn told(&self, h: f64) -> BuildError {
        let [low, high] = self.range.map(|h| h.round() / 1000.0);
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
    pub fn air(&self, t: f64, p: Vec3, gas: impl FnOnce(&Geodetic) -> world::Air) -> Air {
        let (spin, place) = self.world.planet.place(t, p);
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

/// Wind over height, from layers or a file.
fn winds(w: &Written<'_>, files: &Files) -> Result<Option<Profile<Vec3>>, BuildError> {
    let Some(name) = w.wind_table else {
        let wind = |w: &WindLayer| (w.altitude, Vec3::new(w.east, w.north, w.up));
        let entries: Vec<_> = w.winds.iter().map(wind).collect();
        let given = !entries.is_empty();
        return given.then(|| Profile::winds(entries).map_err(|e| fault(&e, "winds"))).transpose();
    };
    if !w.winds.is_empty() {
        return Err(BuildError::new("`winds` and `wind_table` are both given")
            .help("give layers, or a file of them")
            .at("wind_table"));
    }
    let text = text_of(name, "wind_table", files)?;
    Ok(Some(Profile::read_winds(name, &text).map_err(|e| fault(&e, "wind_table"))?))
}

/// The text of a file that a parameter names.
pub(super) fn text_of(
    name: &str,
    param: &'static str,
    files: &Files,
) -> Result<String, BuildError> {
    let path = files.resolve(name).map_err(|e| e.at(param))?;
    linkwork_formats::whole_text(&path).map_err(|e| {
        BuildError::new(format!("`{name}`: {e}")).help("a text file is wanted").at(param)
    })
}
