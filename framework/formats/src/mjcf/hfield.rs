//! Height fields of an MJCF file: `<hfield>` in `<asset>`, and the geoms that show them.
//!
//! ```text
//! size     (X, Y, Z, base)      x from −X to X, y from −Y to Y
//! height   Z (h − h_min) / (h_max − h_min)      in 32 bits until Z, as in MuJoCo; 0 if all are equal
//! mass     that of a box of 2X × 2Y × (Z/2 + base), centred in the frame of the geom
//! ```
//! `elevation` and images begin with the row of the largest y, MuJoCo's own files with that of the smallest y. For an image, 8 bits per pixel are
//! used.

use super::mesh::stem as mesh_stem;
use super::{Classed, Mj};
use crate::error::{FaultKind, FilePlace};
use crate::heights::{HeightsOptions, read_heights};
use crate::read::{Cx, shortened, whole_file};
use crate::xml::Element;
use crate::{Geometry, mesh};

/// Largest number of points, as for a map in memory.
const MOST: usize = 64_000_000;

/// The size of a height field, with its heights from 0 to 1.
struct Field {
    columns: usize,
    heights: Vec<f32>,
}

impl<'e> Mj<'e> {
    /// Collects height fields by name; the default is the name of the file without its extension.
    pub(super) fn find_height_fields(&mut self, asset: &'e Element) {
        for e in asset.all("hfield") {
            let stem = mesh_stem(e.attr("file").unwrap_or_default());
            self.height_fields.insert(e.attr("name").unwrap_or(stem).to_owned(), e);
        }
    }

    /// Returns the asset of a geom, and its sizes; `None` after a fault.
    fn height_field_of(
        &self,
        cx: &mut Cx<'_>,
        at: Classed<'e>,
        what: &str,
    ) -> Option<(&'e Element, [f64; 4])> {
        let (name, place) = self.attr(at, "hfield").or_else(|| {
            cx.missing(at.e, what, "`hfield`", "write the name of an <hfield> in <asset>");
            None
        })?;
        let Some(&asset) = self.height_fields.get(name) else {
            let names = self.height_fields.keys().map(String::as_str);
            cx.unknown(place, what, "height field", name, names);
            return None;
        };
        asset.touch();
        let what = format!("<hfield> `{name}`");
        let size = cx.numbers::<4>(asset, "size", &what);
        if asset.attr("size").is_none() {
            cx.missing(asset, &what, "`size`", "write size=\"radius_x radius_y height base\" in m");
        }
        let size = size?;
        if size.iter().any(|s| !(*s > 0.0)) {
            let text = asset.attr("size").unwrap_or_default();
            let help = "write positive lengths in m";
            cx.bad(asset.place_of("size"), &what, text, "four positive lengths", help);
            return None;
        }
        Some((asset, size))
    }

    /// Returns the box that has the mass of a height field.
    pub(super) fn height_field_box(
        &self,
        cx: &mut Cx<'_>,
        at: Classed<'e>,
        what: &str,
    ) -> Option<Geometry> {
        let (_, [x, y, z, base]) = self.height_field_of(cx, at, what)?;
        Some(Geometry::Box { size: [2.0 * x, 2.0 * y, 0.5 * z + base] })
    }

    /// Returns the surface of a height field; `None` after a fault or a note.
    pub(super) fn height_field(
        &self,
        cx: &mut Cx<'_>,
        at: Classed<'e>,
        what: &str,
    ) -> Option<Geometry> {
        let (asset, [x, y, z, _]) = self.height_field_of(cx, at, what)?;
        let own = format!("<{}>", asset.label());
        let field = match asset.attr("file").filter(|f| !f.is_empty()) {
            Some(_) => self.file_heights(cx, asset, &own, what)?,
            None => written(cx, asset, &own)?,
        };
        let note = "its sides and its base do not collide: only its surface does";
        cx.ignored.push(at.e.ignored(what, note));
        let rows = field.heights.len() / field.columns;
        let spacing = [2.0 * x / (field.columns - 1) as f64, 2.0 * y / (rows - 1) as f64];
        let heights = field.heights.iter().map(|h| f64::from(*h) * z).collect();
        Some(Geometry::HeightField { columns: field.columns, spacing, heights })
    }

    fn file_heights(
        &self,
        cx: &mut Cx<'_>,
        asset: &Element,
        own: &str,
        geom: &str,
    ) -> Option<Field> {
        let file = self.mesh_file(asset)?;
        for unused in ["nrow", "ncol", "elevation"] {
            if asset.attr(unused).is_some() {
                let note = format!("attribute {unused}: the file has the heights");
                cx.ignored.push(asset.ignored(own, note));
            }
        }
        let Some(path) = mesh::find(&file, &self.options) else {
            let note = format!("the file `{}` of its height field was not found", shortened(&file));
            cx.ignored.push(asset.ignored(geom, note));
            return None;
        };
        let image = match asset.attr("content_type") {
            Some("image/png") => true,
            Some("image/vnd.mujoco.hfield") => false,
            Some(other) => {
                let (expected, help) =
                    ("a kind of height field", "write image/png or image/vnd.mujoco.hfield");
                cx.bad(asset.place_of("content_type"), own, other, expected, help);
                return None;
            }
            None => file.to_ascii_lowercase().ends_with(".png"),
        };
        let bytes = whole_file(&path);
        let read = bytes.and_then(|b| if image { of_image(&b) } else { of_binary(&b) });
        let read = read.and_then(|field| {
            field.normalized().ok_or_else(|| "a height is not a finite number".to_owned())
        });
        read.map_err(|why| {
            let what = format!("{own}: the file `{}` cannot be read: {why}", shortened(&file));
            let help = "use a grey PNG, or MuJoCo's format: rows, columns (32 bit integers) and heights (32 bits)".into();
            cx.fault(asset.place_of("file"), FaultKind::Unsupported { what, help });
        })
        .ok()
    }
}

impl Field {
    /// Moves the heights to 0 … 1; `None` if one of them is not finite.
    fn normalized(mut self) -> Option<Self> {
        let (mut low, mut high) = (f32::INFINITY, f32::NEG_INFINITY);
        for h in &self.heights {
            if !h.is_finite() {
                return None;
            }
            (low, high) = (low.min(*h), high.max(*h));
        }
        let span = high - low;
        for h in &mut self.heights {
            *h -= low;
            if span > f32::EPSILON {
                *h /= span;
            }
        }
        Some(self)
    }
}

/// Reads `nrow`, `ncol` and `elevation`; without `elevation`, the field is flat.
fn written(cx: &mut Cx<'_>, asset: &Element, own: &str) -> Option<Field> {
    let mut count = |name: &str| {
        let Some(n) = cx.number(asset, name, own) else {
            if asset.attr(name).is_none() {
                cx.missing(asset, own, &format!("`{name}`"), "write nrow and ncol, or a file");
            }
            return None;
        };
        if n >= 2.0 && n.fract() == 0.0 && n <= MOST as f64 {
            return Some(n as usize);
        }
        let what = format!("{own}: `{name}`");
        cx.bad(
            asset.place_of(name),
            &what,
            &n.to_string(),
            "an integer of at least 2",
            "write the number of points",
        );
        None
    };
    let (rows, columns) = (count("nrow"), count("ncol"));
    let (rows, columns) = (rows?, columns?);
    if rows.saturating_mul(columns) > MOST {
        let what = format!("{own}: {rows} by {columns} points");
        let help = format!("the limit is {MOST} points");
        cx.fault(asset.place(), FaultKind::Unsupported { what, help });
        return None;
    }
    let mut heights = vec![0.0; rows * columns];
    if let Some(text) = asset.attr("elevation") {
        let place: FilePlace = asset.place_of("elevation");
        let what = format!("{own}: `elevation`");
        let all = rows * columns;
        let list = cx.parse_list(place.clone(), text, &what, all..=all)?;
        if list.iter().any(|h| !(*h as f32).is_finite()) {
            cx.bad(place, &what, text, "a list of 32 bit numbers", "write smaller numbers");
            return None;
        }
        // The first row has the largest y.
        for (to, from) in heights.chunks_mut(columns).rev().zip(list.chunks(columns)) {
            to.iter_mut().zip(from).for_each(|(to, h)| *to = *h as f32);
        }
    }
    Field { columns, heights }.normalized()
}

/// Reads a grey PNG as MuJoCo does, with 8 bits.
fn of_image(bytes: &[u8]) -> Result<Field, String> {
    let options = HeightsOptions { spacing: Some([1.0; 2]), range: [0.0, 65535.0] };
    let none = &mut |_: &str| Err("its file was not found".to_owned());
    let read = read_heights("field.png", bytes, &options, none).map_err(|e| e.to_string())?;
    let heights = read.heights.iter().map(|h| (h / 256.0).floor()).collect();
    sized(read.ny, read.nx, heights)
}

/// Reads MuJoCo's own format.
fn of_binary(bytes: &[u8]) -> Result<Field, String> {
    let words: Vec<[u8; 4]> = bytes.as_chunks::<4>().0.to_vec();
    let [rows, columns, heights @ ..] = words.as_slice() else {
        return Err("it has no header".into());
    };
    let count = |w: &[u8; 4]| usize::try_from(i32::from_le_bytes(*w)).unwrap_or(0);
    let (rows, columns) = (count(rows), count(columns));
    let heights: Vec<f32> = heights.iter().map(|w| f32::from_le_bytes(*w)).collect();
    if !bytes.len().is_multiple_of(4) || rows.checked_mul(columns) != Some(heights.len()) {
        return Err(format!(
            "its header states {rows} by {columns} points, but it has {} heights",
            heights.len()
        ));
    }
    sized(rows, columns, heights)
}

fn sized(rows: usize, columns: usize, heights: Vec<f32>) -> Result<Field, String> {
    match rows.min(columns) {
        0 | 1 => {
            Err(format!("it has {rows} by {columns} points, but at least 2 by 2 are required"))
        }
        _ => Ok(Field { columns, heights }),
    }
}
