//! Images of cameras in a log: `foxglove.CompressedImage`, PNG.
use crate::ballast::Ballast;
use foxglove::Encode;
use foxglove::messages::{CompressedImage, Timestamp};
use linkwork_render::Picture;
use linkwork_runtime::{FieldSample, Group, Program, Sample, Seconds, Shows};
use std::collections::BTreeMap;
use std::io::BufWriter;

/// Name of their schema.
pub(crate) const PICTURES: &str = "foxglove.CompressedImage";

/// The channel of a camera.
pub(crate) struct Camera {
    pub id: u16,
    pub sequence: u32,
    path: String,
    /// Number of the last image that was written.
    number: u64,
}

/// Returns the channels of all cameras in all phases, each with its own group.
pub(crate) fn open(
    writer: &mut mcap::Writer<BufWriter<Ballast>>,
    program: &Program,
) -> Result<Vec<(Group, Camera)>, mcap::McapError> {
    let mut all: BTreeMap<String, Seconds> = BTreeMap::new();
    for phase in &program.phases {
        for path in phase.plan.fields_of(Picture::KIND) {
            let rate = phase.plan.rate_of(path).unwrap_or(phase.plan.step);
            all.entry(path.into()).or_insert(rate);
        }
    }
    let open = |(path, period): (String, Seconds)| {
        let schema = CompressedImage::get_schema().ok_or(mcap::McapError::BadMagic)?;
        let id = writer.add_schema(&schema.name, &schema.encoding, &schema.data)?;
        let topic = format!("/{}/image", path.replace('.', "/"));
        let id = writer.add_channel(id, &topic, "protobuf", &BTreeMap::new())?;
        let group = Group { period, shown: vec![path.clone()], ..Group::default() };
        Ok((group, Camera { id, sequence: 0, path, number: 0 }))
    };
    all.into_iter().map(open).collect()
}

impl Camera {
    /// Writes the message of a sample with a new image.
    pub fn message(&mut self, row: &Sample, out: &mut Vec<u8>) -> Result<bool, String> {
        let shown = row.shown.iter().flatten().next();
        let seen = shown.and_then(|shown| shown.downcast_ref::<FieldSample<Picture>>());
        let Some(picture) = seen.map(|s| &s.data).filter(|p| p.number != self.number) else {
            return Ok(false);
        };
        self.number = picture.number;
        let mut data = Vec::new();
        picture.image.png(&mut data)?;
        let ns = (picture.time * 1e9).round() as u64;
        let timestamp = Timestamp::new((ns / 1_000_000_000) as u32, (ns % 1_000_000_000) as u32);
        let message = CompressedImage {
            timestamp: Some(timestamp),
            frame_id: self.path.clone(),
            data: data.into(),
            format: "png".into(),
        };
        Encode::encode(&message, out).map_err(|e| e.to_string())?;
        Ok(true)
    }
}

/// Returns camera and PNG of a message.
pub(crate) fn picture(data: &[u8]) -> Result<(String, Vec<u8>), prost::DecodeError> {
    let message: CompressedImage = prost::Message::decode(data)?;
    Ok((message.frame_id, message.data.to_vec()))
}
