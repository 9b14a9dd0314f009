//! Common part of all atmospheres of planets: rotation with the planet, wind, density factors, and behaviour outside the data.
use crate::world::{DensityLayer, PlanetWorld, WindLayer, fault};
use linkwork_surroundings::prelude::*;
use linkwork_world::atmosphere::{self as world, Profile, Sutherland};
use linkwork_world::planet::Geodetic;

/// Behaviour outside the height range of an atmosphere's data.
#[derive(Params, Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outside {
    /// Extrapolate as the model does, without a warning.
    Continue,
    /// Use the air at the end of the data; one warning per run.
    Clamp,
    /// Stop the run at the first step in which a part queries the air there.
    Stop,
}

/// Viscosity of a gas by Sutherland's law, μ = μ₀ (T₀ + S)/(T + S) (T/T₀)^1.5.
#[derive(Params, Clone, Debug)]
pub struct SutherlandParams {
    /// Viscosity μ₀ at the temperature T₀: 14.8e-6 Pa s for carbon dioxide.
    #[param(unit = "Pa s", range = 1e-9..)]
    pub viscosity: f64,
    /// Reference temperature T₀: 293.15 K for carbon dioxide.
    #[param(unit = "K", range = 1.0..)]
    pub temperature: f64,
    /// Sutherland constant S: 240 K for carbon dioxide.
    #[param(unit = "K", range = 0.0..)]
    pub constant: f64,
}

impl SutherlandParams {
    /// Returns Sutherland's law with these parameters.
    pub fn law(&self) -> Sutherland {
        Sutherland::through(self.viscosity, self.temperature, self.constant)
    }
}

/// Parameters that all services of this module share.
pub(super) struct Written<'a> {
    pub world: PlanetWorld,
    pub winds: &'a [WindLayer],
    pub wind_table: Option<&'a str>,
    pub density: &'a [DensityLayer],
    pub outside: Option<Outside>,
}

/// Collects the shared parameters of a service in [`Written`].
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

/// Implements `Atmosphere` for services that have a field `around` and a function `at` with the air at a time and a geodetic position.
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

/// Planet, wind and data range of an atmosphere.
pub(super) struct Around {
    pub world: PlanetWorld,
    /// Sutton-Graves constant of the gas, if known.
    pub heating: Option<f64>,
    /// Behaviour outside the data from the file; `None` continues with a warning.
    outside: Option<Outside>,
    /// Height range of the data, m.
    range: [f64; 2],
    /// Viscosity law of the gas, if known.
    pub viscosity: Option<Sutherland>,
    winds: Option<Profile<Vec3>>,
    factors: Option<Profile<f64>>,
}

impl Around {
    /// Creates the common part for data in the height `range`, m.
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

    /// Returns the height (m) of p (m, W) above the ellipsoid, NaN near the planet's centre.
    pub fn altitude(&self, t: f64, p: Vec3) -> f64 {
        self.world.planet.place(t, p).1.map_or(f64::NAN, |place| place.altitude)
    }

    /// Returns a warning or error if the height of p (m, W) is outside the data; `None` with `outside: continue`.
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
        let fact = format!("its data extend from {low} to {high} km, not to {:.3} km", h / 1000.0);
        let goes_on = match self.outside {
            None | Some(Outside::Continue) => "the model extrapolates; ",
            Some(Outside::Clamp) => "the air at the end of the data is used; ",
            Some(Outside::Stop) => "",
        };
        let help = format!(
            "{goes_on}choose an atmosphere whose data extend to this height, or write `outside`: continue (without this warning), clamp or stop"
        );
        BuildError::new(fact).help(help).stopping(self.outside == Some(Outside::Stop))
    }

    /// Returns the air at `p` (m, W); `gas` returns the air of the model at a geodetic position.
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

/// Returns the wind profile, from layers or a file.
fn winds(w: &Written<'_>, files: &Files) -> Result<Option<Profile<Vec3>>, BuildError> {
    let Some(name) = w.wind_table else {
        let wind = |w: &WindLayer| (w.altitude, Vec3::new(w.east, w.north, w.up));
        let entries: Vec<_> = w.winds.iter().map(wind).collect();
        let given = !entries.is_empty();
        return given.then(|| Profile::winds(entries).map_err(|e| fault(&e, "winds"))).transpose();
    };
    if !w.winds.is_empty() {
        return Err(BuildError::new("`winds` and `wind_table` are both given")
            .help("remove one of them: `winds` lists layers, `wind_table` names a file")
            .at("wind_table"));
    }
    let text = text_of(name, "wind_table", files)?;
    Ok(Some(Profile::read_winds(name, &text).map_err(|e| fault(&e, "wind_table"))?))
}

/// Reads the text file that a parameter names.
pub(super) fn text_of(
    name: &str,
    param: &'static str,
    files: &Files,
) -> Result<String, BuildError> {
    let path = files.resolve(name).map_err(|e| e.at(param))?;
    linkwork_formats::whole_text(&path).map_err(|e| {
        BuildError::new(format!("`{name}`: {e}"))
            .help("the parameter must name a text file")
            .at(param)
    })
}
