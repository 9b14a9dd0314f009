//! The recorders of a run: its log, its recording, a live viewer.
use crate::exit;
use crate::options::RunOptions;
use linkwork_record::{Log, LogSpec};
use linkwork_runner::{Need, Runner, Watch, recorder_entry};
use linkwork_runtime::{Checkpoint, Recorder, Seconds, Simulation};
use linkwork_viz::Scene;
use std::path::{Path, PathBuf};

/// Largest number of samples between the run and a consumer.
const DEPTH: usize = 256;

/// Name of a run's log among its recorders.
pub const LOG: &str = "log";

/// Opens the log. It continues the log of the run that wrote `begins`.
///
/// # Errors
/// The error of a file that could not be written.
pub fn log<W: Watch>(
    runner: &mut Runner<W>,
    path: &Path,
    spec: &LogSpec,
    begins: Option<&Checkpoint>,
) -> Result<(), String> {
    let (log, groups) =
        Log::create(path, runner.sim().program(), spec).map_err(|e| e.to_string())?;
    let mut recorder =
        Recorder::start(runner.sim(), groups, DEPTH, Box::new(log)).map_err(|e| e.to_string())?;
    if let Some(checkpoint) = begins
        && let Err(e) = resume(&mut recorder, checkpoint, runner.sim())
    {
        tell!(
            "warning: {e}\n  help: samples around an event whose `before` extends beyond the checkpoint begin at the \
             checkpoint; run the simulation again for all of them"
        );
    }
    runner.add_recorder(LOG, Need::Must, recorder);
    Ok(())
}

/// Continues the log of the run that wrote the checkpoint.
pub fn resume(
    recorder: &mut Recorder,
    checkpoint: &Checkpoint,
    sim: &Simulation,
) -> Result<(), String> {
    // If the entry is missing, the run did not have a log, or an older version wrote the
    // checkpoint.
    let nothing = rmp_serde::to_vec::<[u8; 0]>(&[]).map_err(|e| e.to_string())?;
    recorder.resume(checkpoint.extra.get(&recorder_entry(LOG)).unwrap_or(&nothing), sim)
}

/// Returns the path of the recording, if there is one. It must not be another file of the run.
///
/// # Errors
/// An exit code; the error has been printed.
pub fn recording(
    options: &RunOptions,
    out: &Path,
    others: &[PathBuf],
) -> Result<Option<PathBuf>, u8> {
    let viewer = cfg!(feature = "viewer");
    if !viewer && options.rerun.is_some() {
        return Err(without_viewer("--rerun"));
    }
    let path = match options.save_rrd.as_deref() {
        Some("off") => return Ok(None),
        Some(_) if !viewer => return Err(without_viewer("--save-rrd")),
        None if !viewer => return Ok(None),
        Some(path) => PathBuf::from(path),
        None => out.join("run.rrd"),
    };
    if let Some(taken) = others.iter().find(|o| same(o, &path)) {
        tell!(
            "error: --save-rrd `{}` is `{}`, which this run itself reads or writes\n  help: choose another file, \
             for example `{}`",
            path.display(),
            taken.display(),
            out.join("run.rrd").display()
        );
        return Err(exit::INPUT);
    }
    Ok(Some(path))
}

pub fn without_viewer(option: &str) -> u8 {
    tell!(
        "error: {option}: this program was built without the viewer\n  help: build it with the feature `viewer` (it \
         is on by default), or use the log"
    );
    exit::INPUT
}

/// Returns whether two paths refer to one file, which may not exist yet.
pub fn same(a: &Path, b: &Path) -> bool {
    let (a, b) = (whole(a), whole(b));
    a == b || one_inode(&a, &b)
}

/// Returns the absolute path: as the system resolves it if it exists; otherwise with `..` removed.
fn whole(path: &Path) -> PathBuf {
    if let Ok(found) = path.canonicalize() {
        return found;
    }
    let path = std::path::absolute(path).unwrap_or_else(|_| path.into());
    match (path.parent(), path.file_name()) {
        (Some(folder), Some(name)) => whole(folder).join(name),
        (Some(folder), None) => whole(folder).parent().map_or(path.clone(), Path::to_path_buf),
        _ => path,
    }
}

#[cfg(unix)]
fn one_inode(a: &Path, b: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let id = |p: &Path| p.metadata().ok().map(|m| (m.dev(), m.ino()));
    id(a).is_some_and(|x| id(b) == Some(x))
}

#[cfg(not(unix))]
fn one_inode(_: &Path, _: &Path) -> bool {
    false
}

/// Opens the recording and the stream to a viewer. The run waits for the recording, because a disk is either fast or full, but not for a viewer.
#[cfg(feature = "viewer")]
pub fn viewers<W: Watch>(
    runner: &mut Runner<W>,
    file: Option<&Path>,
    live: Option<&str>,
    scene: &Scene,
    period: Seconds,
) -> Result<(), String> {
    use linkwork_runtime::Overflow;
    use linkwork_viz::View;
    let program = runner.sim().program().clone();
    if let Some(path) = file {
        let (view, groups) = View::new(&program, scene, period).map_err(|e| e.to_string())?;
        let viewer = view.file(path).map_err(|e| e.to_string())?;
        let recorder = Recorder::start(runner.sim(), groups, DEPTH, Box::new(viewer))
            .map_err(|e| e.to_string())?;
        runner.add_recorder("recording", Need::Should, recorder);
    }
    if let Some(url) = live {
        let (view, groups) = View::new(&program, scene, period).map_err(|e| e.to_string())?;
        let url = (!url.is_empty()).then_some(url);
        let viewer = view.live(url).map_err(|e| e.to_string())?;
        let recorder =
            Recorder::with(runner.sim(), groups, DEPTH, Overflow::Drop, Box::new(viewer))
                .map_err(|e| e.to_string())?;
        runner.add_recorder("viewer", Need::May, recorder);
    }
    Ok(())
}

/// Without the feature, there is no viewer to open.
#[cfg(not(feature = "viewer"))]
pub fn viewers<W: Watch>(
    _: &mut Runner<W>,
    _: Option<&Path>,
    _: Option<&str>,
    _: &Scene,
    _: Seconds,
) -> Result<(), String> {
    Ok(())
}
