//! The folder of a run: one run at a time, and nothing of another run in the way.
//!
//! A lock that the system lets go when the process ends, however it ends, keeps a second run out.
//! Checkpoints that another simulation, or another configuration of it, left in the folder are
//! moved into a folder beside them: what lies in the folder of a run goes on to its own bits.
//! Those of the same configuration stay, since they hold the same bits as this run's own.
use linkwork_runtime::{Checkpoint, Plan};
use std::fs::{File, TryLockError};
use std::io;
use std::path::{Path, PathBuf};

/// A folder cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum FolderError {
    /// It cannot be made, or written into.
    #[error("the folder `{}` {what}: {source}\n  help: choose another folder with --out", .path.display())]
    Io {
        /// The folder.
        path: PathBuf,
        /// What failed.
        what: &'static str,
        /// Why.
        source: io::Error,
    },
    /// Another run writes into it.
    #[error(
        "another run is writing into the folder `{}`\n  help: wait for it to end, stop it, or choose another \
         folder with --out",
        .path.display()
    )]
    Taken {
        /// The folder.
        path: PathBuf,
    },
}

/// A folder that this run alone writes into, until it is dropped.
pub struct Folder {
    path: PathBuf,
    /// Unlocked when it is closed.
    _lock: File,
    own: Option<PathBuf>,
    /// Where checkpoints of another run went, and how many.
    pub moved: Option<(PathBuf, usize)>,
}

/// What a run writes anew, and where one that was killed listened.
const STALE: [&str; 3] = ["summary.json", "plots.svg", "live.json"];

/// How the names of what a run writes beside its log begin; other files in the folder are not ours.
const OURS: [&str; 4] = ["checkpoint_", "interrupted", "before_failure", "summary"];

impl Folder {
    /// Makes the folder, takes its lock, and puts aside what is not of this plan and
    /// configuration.
    ///
    /// # Errors
    /// [`FolderError`]: it cannot be written into, or another run does so.
    pub fn claim(path: &Path, plan: &Plan, configuration: &str) -> Result<Folder, FolderError> {
        let io = |what| {
            let path = path.to_path_buf();
            move |source| FolderError::Io { path, what, source }
        };
        std::fs::create_dir_all(path).map_err(io("cannot be made"))?;
        let (lock, own) = lock(path).map_err(|e| match e {
            TryLockError::WouldBlock => FolderError::Taken { path: path.to_path_buf() },
            TryLockError::Error(source) => io("cannot be locked")(source),
        })?;
        let mut folder = Folder { path: path.to_path_buf(), _lock: lock, own, moved: None };
        folder.tidy(plan, configuration).map_err(io("cannot be tidied"))?;
        Ok(folder)
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    fn tidy(&mut self, plan: &Plan, configuration: &str) -> io::Result<()> {
        let mut strange = Vec::new();
        for entry in std::fs::read_dir(&self.path)? {
            let path = entry?.path();
            let name = path.file_name().and_then(|n| n.to_str()).unwrap_or_default();
            let ours = OURS.iter().any(|o| name.starts_with(o));
            let ends = |e: &str| ours && path.extension().is_some_and(|x| x == e);
            // Half-written by an earlier run that was killed, or said of an earlier run.
            if ends("part") || STALE.contains(&name) {
                std::fs::remove_file(&path)?;
            } else if ends("lwck") && !is_of(&path, plan, configuration) {
                strange.push(path);
            }
        }
        if strange.is_empty() {
            return Ok(());
        }
        let aside = (1u32..)
            .map(|k| self.path.join(format!("earlier_{k}")))
            .find(|p| !p.exists())
            .unwrap_or_else(|| self.path.join("earlier"));
        std::fs::create_dir(&aside)?;
        for path in &strange {
            if let Some(name) = path.file_name() {
                std::fs::rename(path, aside.join(name))?;
            }
        }
        self.moved = Some((aside, strange.len()));
        Ok(())
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        if let Some(own) = &self.own {
            let _ = std::fs::remove_file(own);
        }
    }
}

fn is_of(path: &Path, plan: &Plan, configuration: &str) -> bool {
    Checkpoint::read(path).is_ok_and(|c| {
        c.plan == plan.hash() && c.seed == plan.seed && c.configuration == configuration
    })
}

/// The folder itself is locked where the system can, so that nothing is left behind; else a file
/// in it, which is removed at the end.
fn lock(path: &Path) -> Result<(File, Option<PathBuf>), TryLockError> {
    if let Ok(folder) = File::open(path) {
        match folder.try_lock() {
            Ok(()) => return Ok((folder, None)),
            Err(TryLockError::WouldBlock) => return Err(TryLockError::WouldBlock),
            Err(TryLockError::Error(_)) => {}
        }
    }
    let name = path.join(".lock");
    let file = File::options()
        .create(true)
        .truncate(false)
        .write(true)
        .open(&name)
        .map_err(TryLockError::Error)?;
    file.try_lock()?;
    Ok((file, Some(name)))
}
