//! Checks before a run continues from a checkpoint: the log that it would replace, and the version that wrote the checkpoint.
use crate::exit;
use linkwork_record::log_begin;
use linkwork_runner::BUILT;
use linkwork_runtime::Checkpoint;
use std::path::Path;

/// Checks that a run that continues from a checkpoint does not replace a log with earlier samples, because it would lose them.
pub fn keeps_earlier(log: &Path, time: f64) -> Result<(), u8> {
    if log.symlink_metadata().is_err() {
        return Ok(());
    }
    let what = match log_begin(log) {
        Ok(Some(begin)) if begin < time => format!("has samples from t = {begin} s on"),
        Ok(_) => return Ok(()),
        Err(e) => format!("is not a readable log ({e})"),
    };
    tell!(
        "error: `{}` {what}, but this run begins at t = {time} s and would replace them\n  help: choose another folder with \
         --out, or omit it; --no-log keeps the existing log",
        log.display()
    );
    Err(exit::INPUT)
}

/// Warns of possible differences to the version that wrote the checkpoint. `restore` compares the structure, parameters and files of the simulation
/// and rejects others; differences in the computations of models are not detectable.
pub fn warn_of_version(c: &Checkpoint) {
    let own = env!("CARGO_PKG_VERSION");
    if c.version != own {
        tell!(
            "warning: the checkpoint was written by Linkwork {}, but this is {own}\n  help: states, parameters, files and \
             wires are compared, and a difference is an error; the equations of models may have changed, so that the run may \
             continue differently from one by {}: see the changes marked `break`, or run the simulation again",
            c.version,
            c.version
        );
        return;
    }
    let (was, now) = (c.extra.get(BUILT), linkwork_runner::built());
    if let Some(was) = was.filter(|was| ***was != *now.as_bytes()) {
        tell!(
            "note: the checkpoint was written by {}, but this is {now}: results differ at round-off level",
            String::from_utf8_lossy(was)
        );
    }
}
