//! Terrain made from a seed: `environment.generated_terrain`.

use crate::generator::{self, Recipe};
use crate::landforms::{Dunes, Landform};
use crate::soil::SoilParams;
use crate::soil_map::{SoilMap, SoilPatch, SoilRaster};
use crate::terrain::GridTerrain;
use linkwork_surroundings::prelude::*;

/// Parameters of generated terrain.
#[derive(Params, Clone, Debug)]
pub struct GeneratedParams {
    /// Seed; equal seeds give the same terrain.
    #[param(
        default = 1,
        needs = "relief or craters or crater_age_gyr or rock_cover or dunes or landforms"
    )]
    pub seed: u64,
    /// Extent along x and y, centred on the origin, m.
    #[param(default = [100.0, 100.0])]
    pub size: [f64; 2],
    /// Spacing of nodes.
    #[param(unit = "m", default = 0.1, range = 1e-3..)]
    pub spacing: f64,
    /// Slope of the mean plane along x and y, rise over run.
    #[param(default = [0.0, 0.0])]
    pub slope: [f64; 2],
    /// RMS of the fractal relief.
    #[param(unit = "m", default = 0.3, range = 0.0..)]
    pub relief: f64,
    /// Hurst exponent of the relief: 0 rough, 1 smooth.
    #[param(default = 0.85, range = 0.0..=1.0, needs = "relief")]
    pub hurst: f64,
    /// Longest wavelength of the relief.
    #[param(unit = "m", default = 40.0, range = 1e-3.., needs = "relief")]
    pub wavelength: f64,
    /// Number of craters.
    #[param(default = 0)]
    pub craters: u32,
    /// Smallest and largest crater diameter, m.
    #[param(default = [1.0, 10.0], needs = "craters or crater_age_gyr")]
    pub crater_diameters: [f64; 2],
    /// Age of the surface in Gyr: it has the craters of the Moon's size-frequency law for that age, each degraded since its formation, in addition to
    /// `craters`; 0: none.
    #[param(default = 0.0, range = 0.0..=4.5)]
    pub crater_age_gyr: f64,
    /// Degradation rate of these craters: diffusivity of the ground for craters of 1 km, m²/Myr; it is proportional to the diameter.
    #[param(default = 5.5, range = 1e-3..=1e3, needs = "crater_age_gyr")]
    pub crater_diffusivity_m2_myr: f64,
    /// Dunes across the whole map.
    #[param(default = None)]
    pub dunes: Option<Dunes>,
    /// Steps, ramps, washboards, egg cartons, levelled areas and trenches, each applied to the result of the previous ones; rocks lie on them.
    #[param(default = vec![])]
    pub landforms: Vec<Landform>,
    /// Fraction of the ground covered by rocks (Golombek's k).
    #[param(default = 0.0, range = 0.0..=0.5)]
    pub rock_cover: f64,
    /// Smallest and largest rock diameter, m.
    #[param(default = [0.1, 0.8], needs = "rock_cover")]
    pub rock_diameters: [f64; 2],
    /// Least and greatest fraction of a rock's height that is buried; with ½ a rock rises above the ground by half its width.
    #[param(default = [0.5, 0.5], needs = "rock_cover")]
    pub rock_burial: [f64; 2],
    /// Discs without rocks and craters: x, y and radius, m.
    #[param(unit = "m", default = vec![], needs = "craters or crater_age_gyr or rock_cover")]
    pub clear: Vec<[f64; 3]>,
    /// Moves the height at x = y = 0 to z = 0.
    #[param(default = true)]
    pub level: bool,
    /// Soil of the remaining ground; models that use soil or its friction need it.
    #[param(default = None)]
    pub soil: Option<SoilParams>,
    /// Polygons of other soils; a later polygon covers earlier ones.
    #[param(default = vec![])]
    pub soils: Vec<SoilPatch>,
    /// A raster of other soils; polygons cover it.
    #[param(default = None)]
    pub soil_map: Option<SoilRaster>,
}

/// Maximum number of nodes of a generated map.
const NODES_MAX: f64 = 64e6;

/// Maximum number of craters of a generated map.
const CRATERS_MAX: u32 = 1_000_000;

/// Maximum number of rocks of a generated map.
const ROCKS_MAX: f64 = 5e6;

/// Ground generated from a seed: fractal relief, craters with raised rims, dunes and other landforms, rocks with Golombek's distribution.
#[service("environment.generated_terrain", Terrain)]
impl Service for GridTerrain {
    type Params = GeneratedParams;
    fn build(p: GeneratedParams, files: &Files) -> Result<Self, BuildError> {
        let nodes = p.size[0] / p.spacing * (p.size[1] / p.spacing);
        if nodes.is_nan() || nodes > NODES_MAX {
            return Err(BuildError::new(format!("{:.0} million nodes are too many", nodes / 1e6))
                .at("spacing")
                .help("make `spacing` larger or `size` smaller: 64 million nodes at most"));
        }
        if p.craters > CRATERS_MAX {
            return Err(BuildError::new(format!("{} craters are too many", p.craters))
                .at("craters")
                .help("a million at most"));
        }
        for (name, [low, high]) in
            [("crater_diameters", p.crater_diameters), ("rock_diameters", p.rock_diameters)]
        {
            if !(low > 0.0 && high > low) {
                return Err(
                    BuildError::new("the smaller diameter comes first, both positive").at(name)
                );
            }
        }
        if p.relief > 0.0 && !(p.wavelength > 2.0 * p.spacing) {
            let fact = format!(
                "a relief with wavelengths up to {} m cannot be shown by nodes {} m apart: the ground would be flat",
                p.wavelength, p.spacing
            );
            return Err(BuildError::new(fact)
                .at("wavelength")
                .help("write a `wavelength` of more than twice the `spacing`, or `relief: 0`"));
        }
        let rocks = generator::rocks_wanted(p.rock_cover, p.rock_diameters, p.size);
        if !(rocks <= ROCKS_MAX) {
            return Err(BuildError::new(format!("{:.0} million rocks are too many", rocks / 1e6))
                .at("rock_diameters")
                .help("make the smallest diameter larger: 5 million rocks at most"));
        }
        let [least, most] = p.rock_burial;
        if !(least >= 0.0 && least <= most && most < 1.0) {
            return Err(BuildError::new(format!(
                "`rock_burial` from {least} to {most} is not a valid range"
            ))
            .at("rock_burial")
            .help("write two fractions, each at least 0 and below 1, the smaller one first"));
        }
        if let Some(dunes) = &p.dunes {
            dunes.lee_length()?;
        }
        for (k, form) in p.landforms.iter().enumerate() {
            form.check().map_err(|e| e.at(format!("landforms[{k}]")))?;
        }
        let recipe = Recipe {
            seed: p.seed,
            size: p.size,
            spacing: p.spacing,
            slope: p.slope,
            relief: p.relief,
            hurst: p.hurst,
            wavelength: p.wavelength,
            craters: p.craters,
            crater_diameters: p.crater_diameters,
            crater_age: p.crater_age_gyr,
            crater_diffusivity: p.crater_diffusivity_m2_myr,
            dunes: p.dunes,
            landforms: p.landforms,
            rock_cover: p.rock_cover,
            rock_diameters: p.rock_diameters,
            rock_burial: p.rock_burial,
            clear: p.clear,
        };
        let aged = generator::aged(&recipe).map_or(0.0, |(surface, table)| surface.wanted(&table));
        if !(aged <= f64::from(CRATERS_MAX)) {
            return Err(BuildError::new(format!("{:.0} million craters are too many", aged / 1e6))
                .at("crater_diameters")
                .help("make the smallest diameter larger: a million craters at most"));
        }
        let (mut field, rocks) =
            generator::make(&recipe).map_err(|e| BuildError::new(e.to_string()).at("size"))?;
        if p.level
            && let Some((zero, _)) = field.ground(0.0, 0.0)
        {
            field.map(|_, _, h| h - zero);
        }
        let rocks = rocks
            .iter()
            .map(|r| Rock { x: r.x, y: r.y, diameter: r.diameter, height: r.height })
            .collect();
        let soils =
            SoilMap::new(p.soil.as_ref(), p.soil_map.as_ref(), &p.soils, field.bounds(), files)?;
        Ok(GridTerrain { field, soils, rocks })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn generated() -> GeneratedParams {
        GeneratedParams {
            seed: 3,
            size: [20.0, 20.0],
            spacing: 0.1,
            slope: [0.0; 2],
            relief: 0.2,
            hurst: 0.8,
            wavelength: 10.0,
            craters: 2,
            crater_diameters: [1.0, 3.0],
            crater_age_gyr: 0.0,
            crater_diffusivity_m2_myr: 5.5,
            dunes: None,
            landforms: vec![],
            rock_cover: 0.05,
            rock_diameters: [0.2, 0.8],
            rock_burial: [0.5, 0.5],
            clear: vec![[0.0, 0.0, 3.0]],
            level: true,
            soil: None,
            soils: vec![],
            soil_map: None,
        }
    }

    #[test]
    fn generated_ground_is_level_at_the_origin_and_shows_its_rocks() {
        let t = GridTerrain::build(generated(), &Files::default()).unwrap();
        assert!(t.ground(0.0, 0.0).unwrap().height.abs() < 1e-6);
        assert!(!t.rocks().is_empty());
        assert!(t.ground(11.0, 0.0).is_none());
        let s = t.surface();
        assert_eq!((s.nx, s.ny, s.heights.len()), (201, 201, 201 * 201));
        let big = GeneratedParams { spacing: 1e-3, size: [1000.0, 1000.0], ..generated() };
        let e = GridTerrain::build(big, &Files::default()).err().unwrap();
        assert_eq!(e.param.as_deref(), Some("spacing"));
        let refused = |p: GeneratedParams| GridTerrain::build(p, &Files::default()).err().unwrap();
        // The shortest wavelength that nodes can represent is twice their distance.
        let e = refused(GeneratedParams { wavelength: 0.2, ..generated() });
        assert_eq!((e.param.as_deref(), e.help.is_some()), (Some("wavelength"), true), "{e:?}");
        let even = GeneratedParams { wavelength: 0.2, relief: 0.0, ..generated() };
        assert!(GridTerrain::build(even, &Files::default()).is_ok());
        let e = refused(GeneratedParams { rock_burial: [0.9, 0.2], ..generated() });
        assert!(e.message.contains("from 0.9 to 0.2"), "{e:?}");
        let many = GeneratedParams {
            crater_age_gyr: 4.0,
            crater_diameters: [0.01, 10.0],
            size: [300.0, 300.0],
            ..generated()
        };
        let e = refused(many);
        assert!(e.message.contains("million craters") && e.help.is_some(), "{e:?}");
    }
}
