//! Positions of the nodes of a GeoTIFF: its keys, tie point and scale or transformation.

use super::super::degrees::{Ellipsoid, degrees_apart};
use super::super::projection::Projection;
use super::super::{HeightsError, HeightsOptions, epsg, length, units};
use std::io::{Read, Seek};
use tiff::decoder::Decoder;
use tiff::tags::Tag;

/// Positions of the nodes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame {
    /// Spacing (m).
    pub spacing: [f64; 2],
    /// x, y of the south-west node (m).
    pub origin: [f64; 2],
    /// Upward length of the unit of heights, in metres.
    pub height_unit: f64,
    /// Whether the first row is the southern one.
    pub from_south: bool,
}

/// The keys of a GeoTIFF.
#[derive(Default)]
struct Keys {
    keys: Vec<[u16; 4]>,
    doubles: Vec<f64>,
}

/// GTModelType, GTRasterType.
const MODEL: u16 = 1024;
const RASTER: u16 = 1025;
/// GeodeticCRS, its unit of angles, its ellipsoid with semi-major and semi-minor axis and inverse flattening.
const GEODETIC: u16 = 2048;
const ANGLE: u16 = 2054;
const ELLIPSOID: u16 = 2056;
const MAJOR: u16 = 2057;
const MINOR: u16 = 2058;
const INVERSE_FLATTENING: u16 = 2059;
/// ProjectedCRS, its unit and the size of a user-defined unit.
const PROJECTED: u16 = 3072;
const LINEAR: u16 = 3076;
const LINEAR_SIZE: u16 = 3077;
/// Method of a user-defined projection, its standard parallel, false northing, and two keys for the latitude of its origin.
const METHOD: u16 = 3075;
const PARALLEL: u16 = 3078;
const NORTHING: u16 = 3083;
const ORIGINS: [u16; 2] = [3089, 3081];
/// Methods: Mercator, equidistant cylindrical.
const MERCATOR: u16 = 7;
const CYLINDRICAL: u16 = 17;
/// VerticalCRS and its unit.
const VERTICAL: u16 = 4096;
const VERTICAL_UNIT: u16 = 4099;
/// The standard's `user-defined`.
const OWN: u16 = 32767;

impl Keys {
    fn read<R: Read + Seek>(decoder: &mut Decoder<R>) -> Result<Keys, HeightsError> {
        let Some(directory) = decoder.find_tag(Tag::GeoKeyDirectoryTag)? else {
            return Ok(Keys::default());
        };
        let words = directory.into_u16_vec()?;
        let doubles = decoder.find_tag(Tag::GeoDoubleParamsTag)?.map(|v| v.into_f64_vec());
        let keys = words.get(4..).unwrap_or_default().chunks_exact(4);
        let keys = keys.map(|k| [k[0], k[1], k[2], k[3]]).collect();
        Ok(Keys { keys, doubles: doubles.transpose()?.unwrap_or_default() })
    }

    fn short(&self, key: u16) -> Option<u16> {
        self.keys.iter().find(|k| k[0] == key && k[1] == 0).map(|k| k[3])
    }

    fn double(&self, key: u16) -> Option<f64> {
        let at = self.keys.iter().find(|k| k[0] == key && k[1] != 0).map(|k| usize::from(k[3]))?;
        self.doubles.get(at).copied()
    }

    /// Returns the length in metres of the unit in a key; without the key, of the unit of the system `of`.
    fn unit(&self, key: u16, of: f64, what: &str) -> Result<f64, HeightsError> {
        let Some(code) = self.short(key).filter(|c| *c != 0) else { return Ok(of) };
        let size = match code {
            OWN if key == LINEAR => self.double(LINEAR_SIZE),
            code => units::epsg(code),
        };
        size.filter(|s| *s > 0.0 && s.is_finite()).ok_or_else(|| {
            let fact = format!("the unit {code} (EPSG) of {what} is not supported");
            HeightsError::content(fact, "project it to metres (`gdalwarp -t_srs`)")
        })
    }

    /// Returns the upward length of the unit of heights, in metres.
    fn height_unit(&self) -> Result<f64, HeightsError> {
        let system = self.short(VERTICAL).map_or(1.0, epsg::vertical);
        Ok(self.unit(VERTICAL_UNIT, system.abs(), "heights")?.copysign(system))
    }

    /// Returns the length of the unit of coordinates, in metres.
    fn unit_of_coordinates(&self) -> Result<f64, HeightsError> {
        let system = self.short(PROJECTED).map_or(1.0, epsg::projected);
        self.unit(LINEAR, system, "coordinates")
    }

    /// Returns the projection with its false northing in the file's unit, if it stretches distances.
    fn projection(&self) -> Option<(Projection, f64)> {
        let code = self.short(PROJECTED)?;
        if code != OWN {
            return Projection::epsg(code).map(|p| (p, 0.0));
        }
        let body = self.ellipsoid()?;
        let angle = |key: u16| self.double(key).map(f64::to_radians);
        let parallel = angle(PARALLEL).unwrap_or(0.0);
        let projection = match self.short(METHOD)? {
            MERCATOR => Projection::Mercator { body, drawn: body, parallel },
            CYLINDRICAL => {
                let origin = ORIGINS.iter().find_map(|key| angle(*key)).unwrap_or(0.0);
                Projection::Cylindrical { radius: body.major, parallel, origin }
            }
            _ => return None,
        };
        Some((projection, self.double(NORTHING).unwrap_or(0.0)))
    }

    /// Returns the ellipsoid of angles, or `None` if it is not specified in a supported form.
    fn ellipsoid(&self) -> Option<Ellipsoid> {
        let major = self.double(MAJOR).filter(|a| *a > 0.0 && a.is_finite());
        if let Some(major) = major {
            let flattening = match (self.double(INVERSE_FLATTENING), self.double(MINOR)) {
                (Some(inverse), _) if inverse > 1.0 => 1.0 / inverse,
                (_, Some(minor)) if minor > 0.0 && minor <= major => 1.0 - minor / major,
                _ => 0.0,
            };
            return Some(Ellipsoid { major, flattening });
        }
        let (ellipsoid, system) = (self.short(ELLIPSOID), self.short(GEODETIC));
        ellipsoid.and_then(Ellipsoid::epsg).or(system.and_then(Ellipsoid::of_system))
    }
}

pub(super) fn frame<R: Read + Seek>(
    decoder: &mut Decoder<R>,
    ny: usize,
    options: &HeightsOptions,
) -> Result<Frame, HeightsError> {
    let keys = Keys::read(decoder)?;
    let height_unit = keys.height_unit()?;
    if let Some(spacing) = options.spacing {
        let from_south = placed(decoder, &keys).is_ok_and(|(_, _, from_south)| from_south);
        return Ok(Frame { spacing, origin: [0.0, 0.0], height_unit, from_south });
    }
    let (spacing, [x, y], from_south) = placed(decoder, &keys)?;
    // Compute the centre of the pixel in column 0 of the southern row.
    let south = if from_south { y } else { y - (ny as f64 - 1.0) * spacing[1] };
    match keys.short(MODEL) {
        Some(2) => {
            let degrees = keys.short(ANGLE).is_none_or(|unit| unit == 0 || unit == 9102);
            let ellipsoid = keys.ellipsoid().filter(|_| degrees);
            let spacing = degrees_apart(ellipsoid, spacing, south, ny)?;
            return Ok(Frame { spacing, origin: [0.0, 0.0], height_unit, from_south });
        }
        Some(3) => {
            return Err(HeightsError::content(
                "its coordinates are geocentric",
                "project it to metres (`gdalwarp -t_srs`)",
            ));
        }
        _ => {}
    }
    let unit = keys.unit_of_coordinates()?;
    let (spacing, origin) = (spacing.map(|s| s * unit), [x * unit, south * unit]);
    let Some((projection, northing)) = keys.projection() else {
        return Ok(Frame { spacing, origin, height_unit, from_south });
    };
    let (spacing, origin) = projection.apart(spacing, origin, northing * unit, ny)?;
    Ok(Frame { spacing, origin, height_unit, from_south })
}

/// Returns the spacing, the position of the node in the first row and column, in the file's unit, and whether the first row is the southern one.
fn placed<R: Read + Seek>(
    decoder: &mut Decoder<R>,
    keys: &Keys,
) -> Result<([f64; 2], [f64; 2], bool), HeightsError> {
    let mut list = |tag| decoder.find_tag(tag)?.map(|v| v.into_f64_vec()).transpose();
    let (scale, tie) = (list(Tag::ModelPixelScaleTag)?, list(Tag::ModelTiepointTag)?);
    let matrix = list(Tag::ModelTransformationTag)?;
    let centre = if keys.short(RASTER) == Some(2) { 0.0 } else { 0.5 };
    let (sx, sy, x, y) = match (scale.as_deref(), tie.as_deref(), matrix.as_deref()) {
        (Some([sx, sy, ..]), Some([i, j, _, x, y, ..]), _) => {
            (*sx, *sy, x + (centre - i) * sx, y - (centre - j) * sy)
        }
        (Some([sx, sy, ..]), _, _) => (*sx, *sy, 0.0, 0.0),
        (None, _, Some([a, b, _, x, c, d, _, y, ..])) => {
            if *b != 0.0 || *c != 0.0 {
                return Err(HeightsError::content(
                    "its rows are rotated relative to its coordinates",
                    "warp it so that north is up (`gdalwarp`)",
                ));
            }
            (*a, -*d, x + centre * a, y + centre * d)
        }
        _ => return Err(HeightsError::NoScale { what: "the TIFF" }),
    };
    if !(x.is_finite() && y.is_finite()) {
        return Err(HeightsError::content(
            "its tie point is not a position",
            "write the file again",
        ));
    }
    let from_south = sy < 0.0;
    Ok(([length("pixel scale", sx)?, length("pixel scale", sy.abs())?], [x, y], from_south))
}
