//! Checks before a run continues from a checkpoint: the log that it would replace, and the version that wrote the checkpoint.
use crate::exit;
use linkwork_record::log_begin;
use linkwork_runner::BUILT;
use linkwork_runtime::Checkpoint;
use std::path::Path;

/// A run that continues from a checkpoint writes no rows of before. It does not replace a log that has some: they would be lost.
pub fn keeps_earlier(log: &Path, time: f64) -> Result<(), u8> {
    if log.symlink_metadata().is_err() {
        return Ok(());
    }
    let what = match log_begin(log) {
        Ok(Some(begin)) if begin < time => format!("has rows from t = {begin} s on"),
        Ok(_) => return Ok(()),
        Err(e) => format!("is not a log that can be read ({e})"),
    };
    tell!(
        "error: `{}` {what}, and this run begins at t = {time} s: it would replace them\n  help: choose another folder with \
         --out, or leave it out; --no-log keeps the log as it is",
        log.display()
    );
    Err(exit::INPUT)
}

/// What another version of the program may have changed. The structure, parameters and files of the simulation are compared by
/// `restore`, which rejects other ones; what models compute may differ without a trace in them.
pub fn warn_of_version(c: &Checkpoint) {
    let own = env!("CARGO_PKG_VERSION");
    if c.version != own {
        tell!(
            "warning: the checkpoint was written by Linkwork {}, and this is {own}\n  help: states, parameters, files and \
             wires are compared, and a difference is an error; the equations of models may have changed, so that the run may \
             continue differently from one by {}: see the changes marked `break`, or run the simulation anew",
            c.version,
            c.version
        );
        return;
    }
    let (was, now) = (c.extra.get(BUILT), linkwork_runner::built());
    if let Some(was) = was.filter(|was| ***was != *now.as_bytes()) {
        tell!(
            "note: the checkpoint was written by {}, and this is {now}: the run continues with other last bits",
            String::from_utf8_lossy(was)
        );
    }
}
