//! The output folder of a run: one run at a time, without interference from earlier runs.
//!
//! A lock prevents a second run. The system releases it when the process ends in any way. Checkpoints of another simulation or configuration are
//! moved to a subfolder, so that all checkpoints in the folder belong to this run. Checkpoints of the same configuration stay, because they are
//! bit-identical to those of this run.
use linkwork_runtime::{Checkpoint, Plan};
use std::fs::{File, TryLockError};
use std::io;
use std::path::{Path, PathBuf};

/// The folder cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum FolderError {
    /// The folder cannot be created or written.
    #[error("the folder `{}` {what}: {source}\n  help: choose another folder with --out", .path.display())]
    Io {
        /// The folder.
        path: PathBuf,
        /// The failed action.
        what: &'static str,
        /// The reason.
        source: io::Error,
    },
    /// Another run is using the folder.
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

/// A folder that only this run uses, until it is dropped.
pub struct Folder {
    path: PathBuf,
    /// Unlocked when it is closed.
    _lock: File,
    own: Option<PathBuf>,
    /// Folder to which checkpoints of another run were moved, and their number.
    pub moved: Option<(PathBuf, usize)>,
}

/// Files that a run writes again, and the live file of a killed run.
const STALE: [&str; 3] = ["summary.json", "plots.svg", "live.json"];

/// Prefixes of the names of a run's files other than its log; all other files in the folder are not touched.
const OURS: [&str; 4] = ["checkpoint_", "interrupted", "before_failure", "summary"];

impl Folder {
    /// Creates and locks the folder, and moves files of other plans and configurations away.
    ///
    /// # Errors
    /// [`FolderError`]: the folder cannot be written, or another run uses it.
    pub fn claim(path: &Path, plan: &Plan, configuration: &str) -> Result<Folder, FolderError> {
        let io = |what| {
            let path = path.to_path_buf();
            move |source| FolderError::Io { path, what, source }
        };
        std::fs::create_dir_all(path).map_err(io("cannot be created"))?;
        let (lock, own) = lock(path).map_err(|e| match e {
            TryLockError::WouldBlock => FolderError::Taken { path: path.to_path_buf() },
            TryLockError::Error(source) => io("cannot be locked")(source),
        })?;
        let mut folder = Folder { path: path.to_path_buf(), _lock: lock, own, moved: None };
        folder.tidy(plan, configuration).map_err(io("cannot be cleaned up"))?;
        Ok(folder)
    }

    /// Returns its path.
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
            // This is a temporary file of a killed run, or a result of an earlier run.
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

/// The folder itself is locked if the system supports it, so that no lock file remains. Otherwise a file in it is locked and removed at the end.
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
