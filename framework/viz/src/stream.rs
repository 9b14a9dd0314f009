//! Destinations of recordings: a file whose errors are reported, or a viewer that listens.
use re_sdk::external::re_log_encoding::{Encoder, EncodingOptions};
use re_sdk::log::{ChunkBatcherConfig, LogMsg};
use re_sdk::{RecordingStream, RecordingStreamBuilder};
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};

/// The stream cannot be opened or written.
#[derive(Debug, thiserror::Error)]
#[error("rerun: {0}")]
pub struct VizError(pub(crate) String);

/// Any error of the SDK, as text.
pub(crate) struct Wrap(pub(crate) String);

impl<E: std::error::Error> From<E> for Wrap {
    fn from(e: E) -> Wrap {
        Wrap(e.to_string())
    }
}

impl From<Wrap> for VizError {
    fn from(w: Wrap) -> VizError {
        VizError(w.0)
    }
}

/// Largest number of messages of a file with an index at its end. The index takes some 3 kB of memory per message until the file is complete, so it must not grow with a
/// long run. Viewers read files without it, too; `rerun rrd verify` reports its absence.
const INDEXED: u64 = 20_000;

/// The usual address of a viewer on this machine.
const LIVE: &str = "rerun+http://127.0.0.1:9876/proxy";

fn builder(title: &str) -> Result<RecordingStreamBuilder, Wrap> {
    let name = format!("linkwork {title}");
    let id = re_sdk::external::re_log_types::ApplicationId::try_from(name)?;
    // Linkwork makes the batches in the order of time, because the SDK's own timer would split them at
    // any point.
    Ok(RecordingStreamBuilder::new(id).batcher_config(ChunkBatcherConfig::NEVER))
}

/// An `.rrd` file, and the first error that occurred when writing it.
#[derive(Clone)]
pub(crate) struct RrdFile(Arc<Mutex<Inner>>);

struct Inner {
    encoder: Encoder<BufWriter<File>>,
    name: String,
    error: Option<String>,
    /// Number of messages.
    messages: u64,
}

impl RrdFile {
    /// Creates the file, and a stream into it.
    pub fn open(path: &Path, title: &str) -> Result<(RecordingStream, RrdFile), Wrap> {
        let name = path.display().to_string();
        let file = File::create(path).map_err(|e| Wrap(format!("`{name}`: {e}")))?;
        let options = EncodingOptions::PROTOBUF_COMPRESSED;
        let version = re_sdk::build_info().version;
        let encoder = Encoder::new_eager(version, options, BufWriter::new(file))?;
        let inner = Inner { encoder, name, error: None, messages: 0 };
        let file = RrdFile(Arc::new(Mutex::new(inner)));
        let sink = file.clone();
        let rec = builder(title)?.buffered()?;
        rec.set_sink(Box::new(re_sdk::sink::CallbackSink::new(move |m| sink.append(m))));
        Ok((rec, file))
    }

    fn with<R>(&self, f: impl FnOnce(&mut Inner) -> R) -> R {
        f(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }

    fn append(&self, messages: &[LogMsg]) {
        self.with(|i| {
            for message in messages {
                i.messages += 1;
                if i.messages > INDEXED {
                    i.encoder.do_not_emit_footer();
                }
                if i.error.is_none()
                    && let Err(e) = i.encoder.append(message)
                {
                    i.error = Some(format!("`{}`: {e}", i.name));
                }
            }
        });
    }

    /// Writes all data to the file. The stream must be flushed before.
    pub fn flush(&self) -> Result<(), Wrap> {
        self.with(|i| {
            if i.error.is_none()
                && let Err(e) = i.encoder.flush_blocking()
            {
                i.error = Some(format!("`{}`: {e}", i.name));
            }
            i.error.clone().map_or(Ok(()), |e| Err(Wrap(e)))
        })
    }

    /// Completes the file.
    pub fn finish(&self) -> Result<(), Wrap> {
        self.with(|i| {
            if i.error.is_none()
                && let Err(e) = i.encoder.finish()
            {
                i.error = Some(format!("`{}`: {e}", i.name));
            }
        });
        self.flush()
    }
}

/// Checks the address of a viewer.
pub(crate) fn address(url: Option<&str>) -> Result<re_sdk::external::re_uri::ProxyUri, Wrap> {
    let url = url.unwrap_or(LIVE);
    url.parse().map_err(|e| Wrap(format!("`{url}` is not the address of a viewer: {e}")))
}

/// A stream to a viewer that listens.
pub(crate) fn live(
    uri: re_sdk::external::re_uri::ProxyUri,
    title: &str,
) -> Result<RecordingStream, Wrap> {
    let rec = builder(title)?.buffered()?;
    rec.set_sink(Box::new(re_sdk::sink::GrpcSink::new(uri)));
    Ok(rec)
}
