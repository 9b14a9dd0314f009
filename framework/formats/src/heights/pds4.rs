//! PDS4 products: an XML label (.xml) and its data file.
//! ```text
//! File_Area_Observational  File/file_name   Array_2D_Image, Array_2D_Map, Array_2D, Array_3D_Image of one band
//!                          offset, Axis_Array (Line, Sample), Element_Array (data_type, scaling_factor, value_offset, unit)
//!                          Special_Constants: missing, invalid, unknown, not applicable, saturated: no data
//! cart:Cartography         pixel_resolution_x, pixel_resolution_y; upperleft_corner_x, upperleft_corner_y of the
//!                          north-west pixel; all with their units
//! disp:Display_Direction   vertical_display_direction
//! ```

use super::projection::Projection;
use super::samples::{self, Array, First, Missing, Order, Sample};
use super::{Heights, HeightsError, HeightsOptions, length, text, units};
use crate::xml::{Element, parse};

/// Types of arrays with heights.
const ARRAYS: [&str; 4] = ["Array_2D_Image", "Array_2D_Map", "Array_2D", "Array_3D_Image"];

/// Returns the name without its prefix.
fn local(e: &Element) -> &str {
    e.name.rsplit_once(':').map_or(e.name.as_str(), |(_, name)| name)
}

/// Returns the first element with a name, in the order of the text.
fn inside<'a>(e: &'a Element, name: &str) -> Option<&'a Element> {
    e.children.iter().find_map(|c| if local(c) == name { Some(c) } else { inside(c, name) })
}

fn child<'a>(e: &'a Element, name: &str) -> Option<&'a Element> {
    e.children.iter().find(|c| local(c) == name)
}

fn wanted<'a>(e: &'a Element, name: &str) -> Result<&'a Element, HeightsError> {
    inside(e, name).ok_or_else(|| {
        let fact = format!("`{}` lacks `{name}`", local(e));
        HeightsError::at(format!("line {}", e.line), fact, "use the label of the data")
    })
}

fn number<T: std::str::FromStr>(e: &Element) -> Result<T, HeightsError> {
    e.text.trim().parse().map_err(|_| {
        let fact = format!("`{}` is not a valid number for `{}`", e.text, local(e));
        HeightsError::at(format!("line {}", e.line), fact, "write a number")
    })
}

/// Returns the unit of a value, from its attribute.
fn unit(e: &Element) -> &str {
    e.attributes.iter().find(|a| a.name == "unit").map_or("", |a| a.value.as_str())
}

/// Returns the type of an element of an array.
fn kind(e: &Element) -> Result<(Sample, Order), HeightsError> {
    let (sample, order) = match e.text.trim() {
        "UnsignedByte" => (Sample::Unsigned(1), Order::Big),
        "SignedByte" => (Sample::Signed(1), Order::Big),
        "UnsignedMSB2" => (Sample::Unsigned(2), Order::Big),
        "UnsignedLSB2" => (Sample::Unsigned(2), Order::Little),
        "UnsignedMSB4" => (Sample::Unsigned(4), Order::Big),
        "UnsignedLSB4" => (Sample::Unsigned(4), Order::Little),
        "SignedMSB2" => (Sample::Signed(2), Order::Big),
        "SignedLSB2" => (Sample::Signed(2), Order::Little),
        "SignedMSB4" => (Sample::Signed(4), Order::Big),
        "SignedLSB4" => (Sample::Signed(4), Order::Little),
        "IEEE754MSBSingle" => (Sample::Real(4), Order::Big),
        "IEEE754LSBSingle" => (Sample::Real(4), Order::Little),
        "IEEE754MSBDouble" => (Sample::Real(8), Order::Big),
        "IEEE754LSBDouble" => (Sample::Real(8), Order::Little),
        other => {
            return Err(HeightsError::at(
                format!("line {}", e.line),
                format!("elements of the type `{other}` are not supported"),
                "use integers of 1, 2 or 4 bytes, or IEEE 754 numbers",
            ));
        }
    };
    Ok((sample, order))
}

/// Lines and columns.
fn size(array: &Element) -> Result<[u64; 2], HeightsError> {
    if let Some(order) = child(array, "axis_index_order")
        && order.text.trim() != "Last Index Fastest"
    {
        let fact = format!("the order of axes `{}` is not supported", order.text);
        let help = "`Last Index Fastest` is";
        return Err(HeightsError::at(format!("line {}", order.line), fact, help));
    }
    let mut axes = Vec::new();
    for axis in array.children.iter().filter(|c| local(c) == "Axis_Array") {
        let name = wanted(axis, "axis_name")?.text.trim().to_lowercase();
        let elements: u64 = number(wanted(axis, "elements")?)?;
        let turn: u64 = child(axis, "sequence_number").map(number).transpose()?.unwrap_or(0);
        if name == "band" {
            if elements != 1 {
                return Err(HeightsError::Pixels { what: format!("{elements} bands") });
            }
        } else {
            axes.push((turn, elements));
        }
    }
    axes.sort_by_key(|axis| axis.0);
    match axes.as_slice() {
        [(_, lines), (_, columns)] => Ok([*lines, *columns]),
        _ => {
            let fact = format!("the array has {} axes besides bands", axes.len());
            let help = "heights must have lines and samples";
            Err(HeightsError::at(format!("line {}", array.line), fact, help))
        }
    }
}

/// Reads the heights of the array that a label describes.
pub(super) fn labelled(
    name: &str,
    bytes: &[u8],
    options: &HeightsOptions,
    beside: &mut dyn FnMut(&str) -> Result<Vec<u8>, String>,
) -> Result<Heights, HeightsError> {
    let label = parse(&text(bytes), name)?;
    let all: Vec<(&Element, &Element)> = label
        .children
        .iter()
        .filter(|area| local(area).starts_with("File_Area"))
        .flat_map(|area| area.children.iter().map(move |c| (area, c)))
        .filter(|(_, array)| ARRAYS.contains(&local(array)))
        .collect();
    let [(area, array)] = all.as_slice() else {
        return Err(HeightsError::content(
            format!("the label describes {} arrays of two dimensions", all.len()),
            "use a separate label for one array of heights",
        ));
    };
    let [lines, columns] = size(array)?;
    let element = wanted(array, "Element_Array")?;
    let (sample, order) = kind(wanted(element, "data_type")?)?;
    let of = |name: &str, otherwise: f64| {
        child(element, name).map(number).transpose().map(|n| n.unwrap_or(otherwise))
    };
    let metre = match child(element, "unit") {
        Some(u) => units::metres(&format!("line {}", u.line), u.text.trim())?,
        None => 1.0,
    };
    let mut missing = Vec::new();
    for constant in child(array, "Special_Constants").iter().flat_map(|s| &s.children) {
        if local(constant).starts_with("valid_") {
            continue;
        }
        let parsed = Missing::parse(&constant.text).ok_or_else(|| {
            let fact = format!("`{}` is not a sample", constant.text);
            HeightsError::at(format!("line {}", constant.line), fact, "write a number or 0x..")
        })?;
        missing.push(parsed);
    }
    let north = match inside(&label, "vertical_display_direction") {
        Some(way) if way.text.trim() == "Bottom to Top" => First::South,
        _ => First::North,
    };
    let array = Array {
        sample,
        order,
        start: number(wanted(array, "offset")?)?,
        lines,
        columns,
        around: [0, 0],
        first: north,
        missing,
        scale: metre * of("scaling_factor", 1.0)?,
        offset: metre * of("value_offset", 0.0)?,
    };
    let file = wanted(area, "file_name")?.text.trim().to_string();
    let data = beside(&file).map_err(|why| HeightsError::Companion { name: file, why })?;
    let (spacing, origin) = match options.spacing {
        Some(spacing) => (spacing, [0.0, 0.0]),
        None => {
            let spacing = spacing_of(&label)?;
            match (origin_of(&label, spacing, lines)?, cylindrical(&label)?) {
                (Some(origin), Some(map)) => map.apart(spacing, origin, 0.0, lines as usize)?,
                (origin, _) => (spacing, origin.unwrap_or_default()),
            }
        }
    };
    let (heights, datum) = samples::heights(&data, &array)?;
    let (nx, ny) = (columns as usize, lines as usize);
    Ok(Heights { nx, ny, heights, datum, spacing, origin })
}

/// Returns the spacing (m), from the cartography.
fn spacing_of(label: &Element) -> Result<[f64; 2], HeightsError> {
    let axis = |name: &str| {
        let Some(e) = inside(label, name) else { return Ok::<_, HeightsError>(None) };
        let value: f64 = number(e)?;
        Ok(Some((e, value)))
    };
    let (x, y) = (axis("pixel_resolution_x")?, axis("pixel_resolution_y")?);
    let (Some((ex, x)), Some((ey, y))) = (x, y) else {
        return Err(HeightsError::NoScale { what: "the label" });
    };
    let in_degrees = |e: &Element| unit(e).to_lowercase().starts_with("deg");
    if in_degrees(ex) || in_degrees(ey) {
        return Err(HeightsError::Degrees { x, y });
    }
    let one = |e: &Element, value: f64| {
        let place = format!("line {}", e.line);
        length(&place, value * units::metres(&place, unit(e))?)
    };
    Ok([one(ex, x)?, one(ey, y)?])
}

/// Returns the projection of the cartography if it is equidistant cylindrical.
fn cylindrical(label: &Element) -> Result<Option<Projection>, HeightsError> {
    let name = inside(label, "map_projection_name").map(|e| e.text.to_lowercase());
    if !matches!(name.as_deref(), Some("equirectangular" | "simple cylindrical")) {
        return Ok(None);
    }
    let radius = ["a_axis_radius", "semi_major_radius"].iter().find_map(|n| inside(label, n));
    let Some(e) = radius else { return Ok(None) };
    let place = format!("line {}", e.line);
    let radius = length(&place, number::<f64>(e)? * units::metres(&place, unit(e))?)?;
    let angle = |name: &str| -> Result<f64, HeightsError> {
        inside(label, name).map_or(Ok(0.0), |e| number::<f64>(e).map(f64::to_radians))
    };
    let parallel = angle("standard_parallel_1")?;
    let origin = angle("latitude_of_projection_origin")?;
    Ok(Some(Projection::Cylindrical { radius, parallel, origin }))
}

/// Returns the south-west node (m), from the corner of the north-west pixel, if the label contains it.
fn origin_of(label: &Element, s: [f64; 2], lines: u64) -> Result<Option<[f64; 2]>, HeightsError> {
    let axis = |name: &str| {
        let Some(e) = inside(label, name) else { return Ok::<_, HeightsError>(None) };
        let metre = units::metres(&format!("line {}", e.line), unit(e))?;
        Ok(Some(number::<f64>(e)? * metre).filter(|x: &f64| x.is_finite()))
    };
    Ok(match (axis("upperleft_corner_x")?, axis("upperleft_corner_y")?) {
        (Some(x), Some(y)) => Some([x + 0.5 * s[0], y - (lines as f64 - 0.5) * s[1]]),
        _ => None,
    })
}
