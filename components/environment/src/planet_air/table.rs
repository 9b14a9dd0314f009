//! `environment.table_air`: atmosphere of any planet from a table over altitude in a file.
use super::around::{Around, Outside, SutherlandParams, Written, text_of, written};
use super::{HEATING_AIR, HEATING_MARS};
use crate::world::{Centre, DensityLayer, PlanetWorld, WindLayer, fault};
use linkwork_runtime::Unit;
use linkwork_surroundings::prelude::*;
use linkwork_world::atmosphere::{self as world, AltitudeKind, Gas, Layout, Sutherland, Table};
use linkwork_world::planet::Geodetic;

/// Gas constant, J/(mol K) (exact).
const GAS_CONSTANT: f64 = 8.314_462_618_153_24;

/// Layout of the columns of a file.
#[derive(Params, Clone, Copy, Debug, PartialEq, Eq)]
pub enum TableLayout {
    /// Output of Mars-GRAM: HgtMOLA (km), Denkgm3, Temp.
    MarsGram,
    /// Output of Earth-GRAM: Hgtkm, DensMean, Tmean.
    EarthGram,
    /// `USStandardAtmosphere1976.csv` of Basilisk: Altitude, Density, Temperature, a line of units below; its altitudes are geopotential.
    Us76,
    /// The columns that `columns` names.
    Columns,
}

/// Kind of altitude in a column.
#[derive(Params, Clone, Copy, Debug, PartialEq, Eq)]
pub enum Altitudes {
    /// Geometric height above the ellipsoid.
    Geometric,
    /// Geopotential height of the US Standard Atmosphere (r₀ = 6356766 m).
    Geopotential,
}

/// Names and units of the columns.
#[derive(Params, Clone, Debug)]
pub struct Columns {
    /// Heading of the altitude.
    pub altitude: String,
    /// Heading of the density.
    pub density: String,
    /// Heading of the temperature, K.
    pub temperature: String,
    /// Unit of the altitude, such as km or ft.
    #[param(default = "m".to_string())]
    pub altitude_unit: String,
    /// Unit of the density, such as g/cm^3.
    #[param(default = "kg/m^3".to_string())]
    pub density_unit: String,
    /// Kind of altitude: geometric, geopotential (of the Earth).
    #[param(default = Altitudes::Geometric)]
    pub counts: Altitudes,
    /// Number of lines between the headings and the numbers, such as a line of units.
    #[param(default = 0)]
    pub skip: usize,
}

/// A perfect gas.
#[derive(Params, Clone, Debug)]
pub struct GasParams {
    /// Ratio of specific heats.
    #[param(range = 1.0..)]
    pub heat_ratio: f64,
    /// Specific gas constant; instead of `molar_mass`.
    #[param(unit = "J/(kg K)", range = 1.0..)]
    pub constant: Option<f64>,
    /// Molar mass; instead of `constant`.
    #[param(unit = "kg/mol", range = 1e-3..)]
    pub molar_mass: Option<f64>,
    /// Viscosity, for Reynolds numbers; default: none.
    pub viscosity: Option<SutherlandParams>,
    /// Sutton-Graves constant k (kg^½/m), for heating; default: none.
    #[param(range = 0.0..)]
    pub heating_constant: Option<f64>,
}

impl GasParams {
    fn gas(&self) -> Result<(Gas, Option<Sutherland>), BuildError> {
        let constant = match (self.constant, self.molar_mass) {
            (Some(constant), None) => constant,
            (None, Some(mass)) => GAS_CONSTANT / mass,
            (both, _) => {
                let fact = match both {
                    None => "neither `constant` nor `molar_mass` is written",
                    Some(_) => "both `constant` and `molar_mass` are written",
                };
                return Err(BuildError::new(fact).help("write one of them").at("gas"));
            }
        };
        let viscosity = self.viscosity.as_ref().map(SutherlandParams::law);
        Ok((Gas { constant, gamma: self.heat_ratio }, viscosity))
    }
}

/// File with the table, and properties that are not in the file.
#[derive(Params, Clone, Debug)]
pub struct TableAirParams {
    /// Text file with columns under headings, separated by commas or blanks, in ascending or descending order of altitude.
    pub file: String,
    /// Layout of the columns: mars_gram, earth_gram, us76 (Basilisk's file), or columns (named by `columns`).
    pub layout: TableLayout,
    /// With `layout: columns`: names and units of the columns.
    #[param(default = None)]
    pub columns: Option<Columns>,
    /// The gas, for pressure and speed of sound; default: dry air of the Earth (R 287.05 J/(kg K), γ 1.4), with `mars_gram` the Mars atmosphere
    /// (188.92, 1.29); both with Sutherland's viscosity of air or carbon dioxide. Required with `layout: columns`.
    #[param(default = None)]
    pub gas: Option<GasParams>,
    /// The world, whose body this air surrounds.
    #[param(service)]
    pub world: Handle<dyn World>,
    /// Wind relative to the ground by height, in ascending order.
    #[param(default = Vec::new())]
    pub winds: Vec<WindLayer>,
    /// Wind relative to the ground from a file instead of `winds`; may be the file of the table. Output of Mars-GRAM (columns HgtMOLA, EWind, NWind)
    /// or Earth-GRAM (Hgtkm, EWmean, NSmean), or columns altitude, east, north (m, m/s) and optionally up. Interpolated linearly, constant beyond the
    /// ends.
    #[param(default = None)]
    pub wind_table: Option<String>,
    /// Factors on density and pressure of the table by height, in ascending order; default: none.
    #[param(default = Vec::new())]
    pub density: Vec<DensityLayer>,
    /// Behaviour outside the table: `continue` extrapolates ln ρ with its last slope at constant temperature, `clamp` holds the air at the end,
    /// `stop` stops the run. Default: continue, with one warning per run.
    #[param(default = None)]
    pub outside: Option<Outside>,
}

/// Atmosphere from a table over altitude, around a planet.
pub struct TableAtmosphere {
    pub(super) around: Around,
    table: Table,
}

impl TableAtmosphere {
    pub(super) fn at(&self, _: f64, place: &Geodetic) -> world::Air {
        self.table.at(place.altitude)
    }
}

/// Reads a table from a file, which the parameter `param` names. The table extrapolates beyond its ends.
pub(super) fn table(
    file: &str,
    param: &'static str,
    layout: &Layout,
    gas: Gas,
    files: &Files,
) -> Result<Table, BuildError> {
    let text = text_of(file, param, files)?;
    Table::read(file, &text, layout, world::Outside::Continue, gas).map_err(|e| fault(&e, param))
}

/// Returns the factor of a unit to SI.
fn scale(unit: &str, wanted: &str) -> Result<f64, BuildError> {
    let wrong = |fact: String| {
        BuildError::new(fact)
            .help(format!("write a unit of the same quantity as {wanted}"))
            .at("columns")
    };
    let want = Unit::parse(wanted).map_err(|e| wrong(e.to_string()))?;
    let read = Unit::parse(unit).map_err(|e| wrong(e.to_string()))?;
    match read.exponents == want.exponents && read.offset == 0.0 {
        true => Ok(read.scale),
        false => Err(wrong(format!("`{unit}` is not compatible with the unit {wanted}"))),
    }
}

impl Columns {
    fn layout(&self) -> Result<Layout<'_>, BuildError> {
        Ok(Layout {
            altitude: &self.altitude,
            altitude_unit: scale(&self.altitude_unit, "m")?,
            kind: match self.counts {
                Altitudes::Geometric => AltitudeKind::Geometric,
                Altitudes::Geopotential => AltitudeKind::Geopotential,
            },
            density: &self.density,
            density_unit: scale(&self.density_unit, "kg/m^3")?,
            temperature: &self.temperature,
            skip: self.skip,
        })
    }
}

impl TableAirParams {
    fn layout(&self) -> Result<Layout<'_>, BuildError> {
        let wrong = |fact: &str, help: &str| Err(BuildError::new(fact).help(help).at("columns"));
        match (self.layout, &self.columns) {
            (TableLayout::Columns, Some(columns)) => columns.layout(),
            (TableLayout::Columns, None) => wrong(
                "`layout: columns` needs `columns`, which is missing",
                "write columns: (altitude: .., density: .., temperature: ..) with the headings of the file",
            ),
            (_, Some(_)) => wrong(
                "`columns` cannot be combined with a layout that defines its own columns",
                "write `layout: columns`",
            ),
            (TableLayout::MarsGram, None) => Ok(Layout::MARS_GRAM),
            (TableLayout::EarthGram, None) => Ok(Layout::EARTH_GRAM),
            (TableLayout::Us76, None) => Ok(Layout::BASILISK_US76),
        }
    }

    fn gas(&self) -> Result<(Gas, (Option<Sutherland>, Option<f64>)), BuildError> {
        match (&self.gas, self.layout) {
            (Some(gas), _) => {
                gas.gas().map(|(own, viscosity)| (own, (viscosity, gas.heating_constant)))
            }
            (None, TableLayout::MarsGram) => {
                Ok((Gas::MARS, (Some(Sutherland::CARBON_DIOXIDE), Some(HEATING_MARS))))
            }
            (None, TableLayout::EarthGram | TableLayout::Us76) => {
                Ok((Gas::EARTH, (Some(Sutherland::EARTH), Some(HEATING_AIR))))
            }
            (None, TableLayout::Columns) => Err(BuildError::new(
                "`layout: columns` needs the `gas` of the table, which is missing",
            )
            .help("write gas: (heat_ratio: 1.4, molar_mass: \"28.96 g/mol\")")
            .at("gas")),
        }
    }

    /// Returns an error if the table belongs to another body than the body of the world.
    fn check(&self, world: &PlanetWorld, kind: AltitudeKind) -> Result<(), BuildError> {
        let own = match self.layout {
            TableLayout::MarsGram => Some(Centre::Mars),
            TableLayout::EarthGram | TableLayout::Us76 => Some(Centre::Earth),
            TableLayout::Columns => (kind == AltitudeKind::Geopotential).then_some(Centre::Earth),
        };
        own.map_or(Ok(()), |body| world.only(body, "these heights are"))
    }
}

/// Atmosphere of a planet from a table over altitude: output of Mars-GRAM or Earth-GRAM, Basilisk's standard atmosphere, or any columns of altitude,
/// density and temperature. ln ρ and T are interpolated linearly; pressure and speed of sound follow from the perfect gas. Heights are above the
/// ellipsoid.
#[service("environment.table_air", Atmosphere)]
impl Service for TableAtmosphere {
    type Params = TableAirParams;
    fn build(p: TableAirParams, files: &Files) -> Result<Self, BuildError> {
        let layout = p.layout()?;
        let (gas, known) = p.gas()?;
        let world = PlanetWorld::of(&p.world)?;
        p.check(&world, layout.kind)?;
        let table = table(&p.file, "file", &layout, gas, files)?;
        let around = Around::new(&written!(p, world), table.heights().into(), known, files)?;
        Ok(TableAtmosphere { around, table })
    }
}
