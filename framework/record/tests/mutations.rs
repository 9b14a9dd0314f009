//! Mutated logs, without the checksums that would detect the mutations, and the corpus of fuzzing: rows are read or the log is rejected, without a
//! panic.
#![allow(clippy::unwrap_used)]
#[path = "../../../tests/fuzz/mutate.rs"]
mod mutate;
use linkwork_record::{TableFormat, export_table, read_log_contents};
use mcap::records::{MessageHeader, Metadata};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::path::Path;

/// Returns the same records without checksums, so that mutations reach the reader.
fn bare(log: &[u8], compression: Option<mcap::Compression>) -> Vec<u8> {
    let mut out = std::io::Cursor::new(Vec::new());
    let mut writer = mcap::WriteOptions::new()
        .compression(compression)
        .calculate_chunk_crcs(false)
        .calculate_data_section_crc(false)
        .calculate_summary_section_crc(false)
        .calculate_attachment_crcs(false)
        .chunk_size(Some(512))
        .create(&mut out)
        .unwrap();
    let metadata = BTreeMap::from([("seed".to_string(), "7".to_string())]);
    writer.write_metadata(&Metadata { name: "linkwork".into(), metadata }).unwrap();
    let attachment = mcap::Attachment {
        log_time: 0,
        create_time: 0,
        name: "configuration.ron".into(),
        media_type: "text/plain".into(),
        data: Cow::Borrowed(b"Simulation()\n"),
    };
    writer.attach(&attachment).unwrap();
    for message in mcap::MessageStream::new(log).unwrap() {
        let m = message.unwrap();
        let schema = m.channel.schema.as_ref().unwrap();
        let schema = writer.add_schema(&schema.name, &schema.encoding, &schema.data).unwrap();
        let (topic, encoding) = (&m.channel.topic, &m.channel.message_encoding);
        let id = writer.add_channel(schema, topic, encoding, &m.channel.metadata).unwrap();
        let header = MessageHeader {
            channel_id: id,
            sequence: m.sequence,
            log_time: m.log_time,
            publish_time: m.publish_time,
        };
        writer.write_to_known_channel(&header, &m.data).unwrap();
    }
    writer.finish().unwrap();
    drop(writer);
    out.into_inner()
}

fn numbers(path: &Path) -> usize {
    read_log_contents(path).unwrap().series.values().map(|s| s.y.len()).sum()
}

#[test]
fn logs_are_read_or_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("x.mcap");
    let kept = mutate::kept("log");
    assert!(!kept.is_empty(), "the corpus is committed");
    let mut seeds = Vec::new();
    for log in kept {
        std::fs::write(&path, &log).unwrap();
        let Ok(all) = read_log_contents(&path) else { continue };
        let all: usize = all.series.values().map(|s| s.y.len()).sum();
        for compression in [None, Some(mcap::Compression::Lz4)] {
            let bare = bare(&log, compression);
            std::fs::write(&path, &bare).unwrap();
            assert_eq!(numbers(&path), all, "the same without checksums");
            seeds.push(bare);
        }
    }
    assert!(!seeds.is_empty(), "the corpus has a sound log");
    let table = folder.path().join("x.parquet");
    let mut n = 0_u32;
    mutate::survives(&seeds, 2000, |bytes| {
        std::fs::write(&path, bytes).unwrap();
        n += 1;
        if n.is_multiple_of(16) {
            let _ = export_table(&path, &table, TableFormat::Parquet);
        }
        read_log_contents(&path).is_ok()
    });
}
