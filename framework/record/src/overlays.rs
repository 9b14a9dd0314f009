//! Overlays of parts on the ground in a log: a `foxglove.Grid` for each tile that changed, and `foxglove.PosesInFrame` for a planned path.
use crate::ballast::Ballast;
use foxglove::Encode;
use foxglove::messages::packed_element_field::NumericType;
use foxglove::messages::{
    Grid, PackedElementField, Pose, PosesInFrame, Quaternion, Timestamp, Vector2, Vector3,
};
use linkwork_runtime::{
    Group, OVERLAY_PERIOD, OverlayNews, OverlayTile, OverlayValues, Program, Sample,
};
use std::collections::{BTreeMap, BTreeSet};
use std::io::BufWriter;

/// Names of their schemas.
pub(crate) const TILES: &str = "foxglove.Grid";
pub(crate) const WAYS: &str = "foxglove.PosesInFrame";

/// The frame of the ground.
const WORLD: &str = "world";
/// Names of the fields of a tile.
const CHANGE: &str = "change";
const COLOR: [&str; 4] = ["red", "green", "blue", "alpha"];
/// Largest number of squares of a tile when reading.
const SQUARES: usize = 1 << 20;

/// A part with an overlay on the ground.
struct Shower {
    /// Channel and sequence number of its tiles and of its path.
    tiles: (u16, u32),
    way: (u16, u32),
    news: OverlayNews,
}

/// The overlays of all parts.
pub(crate) struct Overlays {
    pub group: u32,
    parts: Vec<Shower>,
}

/// A message: its channel and its sequence number.
type To = (u16, u32);

/// Returns the channels of all parts in all phases with an overlay on the ground, and their group; `None` if there are none.
pub(crate) fn open(
    writer: &mut mcap::Writer<BufWriter<Ballast>>,
    program: &Program,
    group: u32,
) -> Result<Option<(Group, Overlays)>, mcap::McapError> {
    let all: BTreeSet<&str> = program.phases.iter().flat_map(|p| p.plan.overlays()).collect();
    if all.is_empty() {
        return Ok(None);
    }
    let mut channel = |path: &str, what: &str, schema: Option<foxglove::Schema>| {
        let schema = schema.ok_or(mcap::McapError::BadMagic)?;
        let id = writer.add_schema(&schema.name, &schema.encoding, &schema.data)?;
        let topic = format!("/{}/{what}", path.replace('.', "/"));
        let about = BTreeMap::from([(PART.to_string(), path.to_string())]);
        writer.add_channel(id, &topic, "protobuf", &about).map(|id| (id, 0))
    };
    let mut parts = Vec::new();
    for path in &all {
        let tiles = channel(path, "ground", Grid::get_schema())?;
        let way = channel(path, "way", PosesInFrame::get_schema())?;
        parts.push(Shower { tiles, way, news: OverlayNews::default() });
    }
    let overlays = all.into_iter().map(String::from).collect();
    let of = Group { period: OVERLAY_PERIOD, overlays, ..Group::default() };
    Ok(Some((of, Overlays { group, parts })))
}

/// Key of the part in the metadata of a channel.
pub(crate) const PART: &str = "part";

impl Overlays {
    /// Returns the messages of a sample: the changes of the overlays.
    pub fn messages(
        &mut self,
        row: &Sample,
        mut write: impl FnMut(To, &dyn Fn(&mut Vec<u8>) -> Result<(), String>) -> Result<(), String>,
    ) -> Result<(), String> {
        let timestamp =
            Timestamp::new((row.ns / 1_000_000_000) as u32, (row.ns % 1_000_000_000) as u32);
        for (part, now) in self.parts.iter_mut().zip(&row.overlays) {
            let Some(now) = now else { continue };
            let Shower { tiles, way, news } = part;
            let (changed, other) = news.of(now);
            for tile in changed {
                let message = grid(&tile, timestamp);
                write(next(tiles), &|out| {
                    Encode::encode(&message, out).map_err(|e| e.to_string())
                })?;
            }
            if let Some(points) = other {
                let message = poses(points, timestamp);
                write(next(way), &|out| Encode::encode(&message, out).map_err(|e| e.to_string()))?;
            }
        }
        Ok(())
    }
}

fn next((id, sequence): &mut To) -> To {
    let now = (*id, *sequence);
    *sequence = sequence.wrapping_add(1);
    now
}

fn at([x, y]: [f64; 2]) -> Pose {
    Pose {
        position: Some(Vector3 { x, y, z: 0.0 }),
        orientation: Some(Quaternion { x: 0.0, y: 0.0, z: 0.0, w: 1.0 }),
    }
}

fn grid(tile: &OverlayTile, timestamp: Timestamp) -> Grid {
    let field = |name: &str, offset: u32, kind: NumericType| PackedElementField {
        name: name.into(),
        offset,
        r#type: kind.into(),
    };
    let (fields, data): (Vec<PackedElementField>, Vec<u8>) = match &tile.seen {
        OverlayValues::Change(values) => (
            vec![field(CHANGE, 0, NumericType::Float32)],
            values.iter().flat_map(|v| v.to_le_bytes()).collect(),
        ),
        OverlayValues::Colors(colors) => (
            COLOR.into_iter().zip(0..).map(|(n, k)| field(n, k, NumericType::Uint8)).collect(),
            colors.concat(),
        ),
    };
    Grid {
        timestamp: Some(timestamp),
        frame_id: WORLD.into(),
        pose: Some(at(tile.corner)),
        column_count: tile.columns as u32,
        cell_size: Some(Vector2 { x: tile.cell, y: tile.cell }),
        row_stride: 4 * tile.columns as u32,
        cell_stride: 4,
        fields,
        data: data.into(),
    }
}

fn poses(points: &[[f64; 2]], timestamp: Timestamp) -> PosesInFrame {
    let poses = points.iter().map(|p| at(*p)).collect();
    PosesInFrame { timestamp: Some(timestamp), frame_id: WORLD.into(), poses }
}

/// Returns the tile of a message. Messages that [`grid`] cannot have written are an error.
pub(crate) fn tile(data: &[u8]) -> Result<OverlayTile, String> {
    let message: Grid = prost::Message::decode(data).map_err(|e| e.to_string())?;
    let place = message.pose.and_then(|p| p.position).map(|p| [p.x, p.y]);
    let (Some(corner), Some(size)) = (place, message.cell_size) else {
        return Err("it lacks a pose or cells".into());
    };
    let (columns, bytes) = (message.column_count as usize, message.data.len());
    let whole = columns > 0
        && bytes > 0
        && bytes.is_multiple_of(4 * columns)
        && bytes <= 4 * SQUARES
        && (message.row_stride as usize, message.cell_stride) == (4 * columns, 4);
    let sound = size.x == size.y
        && size.x > 0.0
        && size.x.is_finite()
        && corner.iter().all(|v| v.is_finite());
    if !whole || !sound {
        return Err(format!("{bytes} bytes in {columns} columns of {} m are not a grid", size.x));
    }
    let names: Vec<&str> = message.fields.iter().map(|f| f.name.as_str()).collect();
    let seen = if names == [CHANGE] {
        let values = message.data.as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b));
        OverlayValues::Change(values.collect())
    } else if names == COLOR {
        OverlayValues::Colors(message.data.as_chunks::<4>().0.to_vec())
    } else {
        return Err(format!("its fields are {names:?}"));
    };
    Ok(OverlayTile { corner, cell: size.x, columns, seen })
}

/// Returns the planned path of a message.
pub(crate) fn way(data: &[u8]) -> Result<Vec<[f64; 2]>, String> {
    let message: PosesInFrame = prost::Message::decode(data).map_err(|e| e.to_string())?;
    let place = |p: &Pose| p.position.as_ref().map(|p| [p.x, p.y]);
    let points: Option<Vec<[f64; 2]>> = message.poses.iter().map(place).collect();
    points.ok_or_else(|| "a corner lacks a position".into())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bytes(message: &impl Encode) -> Vec<u8> {
        let mut out = Vec::new();
        assert!(message.encode(&mut out).is_ok());
        out
    }

    #[test]
    fn tiles_and_ways_are_read_as_they_were_written_and_others_are_refused() {
        let now = Timestamp::new(1, 2);
        let change = OverlayValues::Change((0..12).map(|k| -0.01 * k as f32).collect());
        let colors = OverlayValues::Colors((0..12).map(|k| [k, 2 * k, 3 * k, 255]).collect());
        for seen in [change, colors] {
            let written = OverlayTile { corner: [-3.2, 0.1 + 0.2], cell: 0.1, columns: 4, seen };
            let message = grid(&written, now);
            assert_eq!(tile(&bytes(&message)), Ok(written));
            let spoilt: [(&str, &dyn Fn(&mut Grid)); 6] = [
                ("not a grid", &|g| g.column_count = 5),
                ("not a grid", &|g| g.column_count = 0),
                ("not a grid", &|g| g.data = Vec::new().into()),
                ("not a grid", &|g| g.cell_size = Some(Vector2 { x: f64::NAN, y: f64::NAN })),
                ("lacks a pose", &|g| g.pose = None),
                ("fields", &|g| g.fields.clear()),
            ];
            for (says, spoil) in spoilt {
                let mut other = message.clone();
                spoil(&mut other);
                let fault = tile(&bytes(&other)).unwrap_err();
                assert!(fault.contains(says), "{fault}");
            }
        }
        let corners = vec![[1.0, 2.0], [-0.5, 0.1]];
        assert_eq!(way(&bytes(&poses(&corners, now))), Ok(corners));
        assert!(tile(&[7; 9]).is_err() && way(&[7; 9]).is_err());
    }
}
