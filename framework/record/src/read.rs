//! Reading a log back: every number as a series; comparing two logs with tolerances.
use crate::log::LogError;
use crate::schema::decode;
use mcap::records::Record;
use prost_types::FileDescriptorSet;
use std::collections::BTreeMap;
use std::path::Path;

/// The numbers of one field of one channel over time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Series {
    /// Times (s).
    pub t: Vec<f64>,
    /// Values.
    pub y: Vec<f64>,
    /// Unit, when the log tells.
    pub unit: String,
}

/// All series of a log, by `part.field`. A log without its end (a crash) is read as far as it goes.
///
/// # Errors
/// [`LogError::Read`] when it cannot be opened or is not MCAP.
pub fn read_log(path: &Path) -> Result<BTreeMap<String, Series>, LogError> {
    let name = path.display().to_string();
    let fail = |why: String| LogError::Read { path: name.clone(), why };
    let bytes = std::fs::read(path).map_err(|e| fail(e.to_string()))?;
    if !bytes.starts_with(mcap::MAGIC) {
        return Err(fail("it does not begin as an MCAP file".into()));
    }
    let options = mcap::read::Options::IgnoreEndMagic;
    let reader = mcap::read::ChunkFlattener::new_with_options(&bytes, options.into())
        .map_err(|e| fail(e.to_string()))?;
    let mut schemas: BTreeMap<u16, (String, FileDescriptorSet)> = BTreeMap::new();
    let mut channels: BTreeMap<u16, (String, u16, BTreeMap<String, String>)> = BTreeMap::new();
    let mut out: BTreeMap<String, Series> = BTreeMap::new();
    for record in reader {
        let Ok(record) = record else { break };
        match record {
            Record::Schema { header, data } if header.encoding == "protobuf" => {
                let set = prost::Message::decode(data.as_ref()).map_err(|e| fail(e.to_string()))?;
                schemas.insert(header.id, (header.name, set));
            }
            Record::Channel(c) => {
                let part = c.topic.trim_start_matches('/').replace('/', ".");
                channels.insert(c.id, (part, c.schema_id, c.metadata));
            }
            Record::Message { header, data } => {
                let Some((part, schema, units)) = channels.get(&header.channel_id) else {
                    continue;
                };
                let Some((name, set)) = schemas.get(schema) else { continue };
                if !name.starts_with("linkwork.") {
                    continue;
                }
                for (field, value) in decode(set, name, &data) {
                    let series = out.entry(format!("{part}.{field}")).or_insert_with(|| Series {
                        unit: units.get(&format!("unit.{field}")).cloned().unwrap_or_default(),
                        ..Series::default()
                    });
                    series.t.push(header.log_time as f64 * 1e-9);
                    series.y.push(value);
                }
            }
            _ => {}
        }
    }
    Ok(out)
}

/// How one series differs between two logs.
#[derive(Clone, Debug, PartialEq)]
pub struct Difference {
    /// `part.field`.
    pub name: String,
    /// What differs, in words.
    pub what: String,
    /// Largest difference; ∞ when they cannot be compared.
    pub largest: f64,
}

/// The series that differ by more than `absolute + relative · max(|a|, |b|)`.
pub fn compare(
    a: &BTreeMap<String, Series>,
    b: &BTreeMap<String, Series>,
    absolute: f64,
    relative: f64,
) -> Vec<Difference> {
    let mut out = Vec::new();
    let lone = |name: &str, which: &str| Difference {
        name: name.to_string(),
        what: format!("only in the {which}"),
        largest: f64::INFINITY,
    };
    for (name, x) in a {
        let Some(y) = b.get(name) else {
            out.push(lone(name, "first"));
            continue;
        };
        if x.t != y.t {
            let what = format!("{} rows against {}, or other times", x.t.len(), y.t.len());
            out.push(Difference { name: name.clone(), what, largest: f64::INFINITY });
            continue;
        }
        let mut worst: Option<(f64, usize)> = None;
        for (k, (p, q)) in x.y.iter().zip(&y.y).enumerate() {
            let limit = absolute + relative * p.abs().max(q.abs());
            let d = (p - q).abs();
            let same = p.to_bits() == q.to_bits() || (p.is_nan() && q.is_nan());
            if !same && !(d <= limit) && worst.is_none_or(|w| !(d <= w.0)) {
                worst = Some((d, k));
            }
        }
        if let Some((d, k)) = worst {
            let what = format!("{} against {} at t = {} s", x.y[k], y.y[k], x.t[k]);
            out.push(Difference { name: name.clone(), what, largest: d });
        }
    }
    out.extend(b.keys().filter(|n| !a.contains_key(*n)).map(|n| lone(n, "second")));
    out.sort_by(|p, q| q.largest.total_cmp(&p.largest).then(p.name.cmp(&q.name)));
    out
}
