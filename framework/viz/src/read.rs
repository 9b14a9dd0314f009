//! Reads a recording back as numbers over time, to compare it with another recording.
use crate::batch::TIMELINE;
use crate::stream::{VizError, Wrap};
use re_sdk::external::re_log_encoding::DecoderApp;
use re_sdk::log::{Chunk, LogMsg};
use re_sdk::time::TimeInt;
use re_sdk_types::components::TransformFrameId;
use re_sdk_types::external::arrow::array::{
    Array, ArrayRef, AsArray, FixedSizeListArray, ListArray, StringArray, StructArray,
};
use re_sdk_types::external::arrow::compute::cast;
use re_sdk_types::external::arrow::datatypes::{DataType, Float64Type};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufReader;
use std::path::Path;

/// Times (s) and values of one number of a recording.
pub type RecordedSeries = (Vec<f64>, Vec<f64>);

/// Components with at most this number of values per time are separate series. Larger ones, such as a mesh or a trail, become one number that changes
/// when any of the values changes.
const LANES: usize = 8;

/// Reads all numbers of a recording, by entity, component and index, such as `/plots/Angle/bob Scalars:scalars[0]`. Poses are named by the frame that
/// they place, and are expressed in the parent frame, which is `view/eye` if a body is followed. Static data have the time 0. Colours and texts are
/// converted to numbers.
///
/// # Errors
/// The file cannot be read, is not a recording, or is truncated.
pub fn read_recording(path: &Path) -> Result<BTreeMap<String, RecordedSeries>, VizError> {
    let name = path.display();
    let fault = |e: String| VizError(format!("`{name}`: {e}"));
    // Check before opening, because opening a pipe blocks.
    if !path.metadata().map_err(|e| fault(e.to_string()))?.is_file() {
        return Err(fault("it is not a regular file".into()));
    }
    let file = BufReader::new(File::open(path).map_err(|e| fault(e.to_string()))?);
    let mut shown = BTreeMap::new();
    for message in DecoderApp::decode_eager(file).map_err(|e| fault(e.to_string()))? {
        match message.map_err(|e| fault(e.to_string()))? {
            LogMsg::ArrowMsg(store, arrow) if store.is_recording() => {
                let chunk = Chunk::from_arrow_msg(&arrow).map_err(|e| fault(e.to_string()))?;
                take(&chunk, &mut shown).map_err(|e| fault(e.0))?;
            }
            _ => {}
        }
    }
    if shown.is_empty() {
        return Err(fault("it is empty".into()));
    }
    Ok(shown)
}

fn take(chunk: &Chunk, shown: &mut BTreeMap<String, RecordedSeries>) -> Result<(), Wrap> {
    let times: Option<Vec<f64>> = (chunk.timelines().get(&TIMELINE.into()))
        .map(|column| column.times().map(|t: TimeInt| t.as_i64() as f64 / 1e9).collect());
    let entity = chunk.entity_path().to_string();
    // Reserved entities contain the date and the program of the recording.
    if chunk.entity_path().is_reserved() {
        return Ok(());
    }
    let child = re_sdk_types::archetypes::Transform3D::descriptor_child_frame().component;
    let frames: Vec<String> = (chunk.iter_component::<TransformFrameId>(child))
        .map(|f| f.first().map_or_else(|| entity.clone(), ToString::to_string))
        .collect();
    for column in chunk.components().values() {
        let component = column.descriptor.component;
        for row in 0..chunk.num_rows() {
            let mut numbers = Vec::new();
            if !column.list_array.is_null(row) {
                flatten(&column.list_array.value(row), &mut numbers)?;
            }
            if numbers.len() > LANES {
                numbers = vec![fingerprint(numbers.iter().flat_map(|x| x.to_bits().to_le_bytes()))];
            }
            let of = frames.get(row).unwrap_or(&entity);
            for (k, y) in numbers.into_iter().enumerate() {
                let series = shown.entry(format!("{of} {component}[{k}]")).or_default();
                series.0.push(times.as_ref().map_or(0.0, |t| t[row]));
                series.1.push(y);
            }
        }
    }
    Ok(())
}

/// Returns all numbers in an array, in order.
fn flatten(array: &ArrayRef, out: &mut Vec<f64>) -> Result<(), Wrap> {
    let any = array.as_any();
    if let Some(list) = any.downcast_ref::<ListArray>() {
        return (0..list.len()).try_for_each(|k| flatten(&list.value(k), out));
    }
    if let Some(list) = any.downcast_ref::<FixedSizeListArray>() {
        return (0..list.len()).try_for_each(|k| flatten(&list.value(k), out));
    }
    if let Some(record) = any.downcast_ref::<StructArray>() {
        return record.columns().iter().try_for_each(|column| flatten(column, out));
    }
    if let Some(texts) = any.downcast_ref::<StringArray>() {
        out.extend(texts.iter().flatten().map(|text| fingerprint(text.bytes())));
        return Ok(());
    }
    let numbers = cast(array, &DataType::Float64)?;
    out.extend(numbers.as_primitive::<Float64Type>().iter().flatten());
    Ok(())
}

/// FNV-1a hash; its upper 52 bits as an integer.
fn fingerprint(bytes: impl Iterator<Item = u8>) -> f64 {
    let step = |h: u64, b: u8| (h ^ u64::from(b)).wrapping_mul(0x0100_0000_01b3);
    (bytes.fold(0xcbf2_9ce4_8422_2325, step) >> 12) as f64
}
