//! Files that a configuration names: where they are looked for, and fingerprints of what they hold.
use crate::made::Made;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Finds the files that a configuration names.
#[derive(Clone, Debug, Default)]
pub struct Files {
    /// Folders tried in turn.
    pub folders: Vec<PathBuf>,
    /// What was found: name and fingerprint of the content, shared by copies.
    pub(crate) found: Arc<std::sync::Mutex<BTreeMap<String, u64>>>,
    /// Services of earlier compilations, which this one may share.
    pub(crate) made: Option<Arc<Made>>,
    /// Texts that a program carries with it, by name: for what no folder has.
    embedded: Arc<BTreeMap<String, String>>,
}

impl Files {
    /// Looked for in these folders, in turn.
    pub fn of(folders: Vec<PathBuf>) -> Files {
        Files { folders, ..Files::default() }
    }

    /// With texts that the program carries with it, for names that no folder has.
    #[must_use]
    pub fn with(self, embedded: Arc<BTreeMap<String, String>>) -> Files {
        Files { embedded, ..self }
    }

    /// With services that compilations share which are given the same `made`.
    #[must_use]
    pub fn sharing(self, made: Arc<Made>) -> Files {
        Files { made: Some(made), ..self }
    }

    /// The same folders, with a list of its own of what was found.
    pub(crate) fn apart(&self) -> Files {
        Files { found: Arc::default(), ..self.clone() }
    }

    /// These were found, too.
    pub(crate) fn add(&self, prints: BTreeMap<String, u64>) {
        if let Ok(mut found) = self.found.lock() {
            found.extend(prints);
        }
    }

    /// Names of the files whose content is part of the plan's hash.
    pub fn names(&self) -> Vec<String> {
        self.found.lock().map(|found| found.keys().cloned().collect()).unwrap_or_default()
    }

    /// Fingerprints of the contents of those files, by name.
    pub fn prints(&self) -> BTreeMap<String, u64> {
        self.found.lock().map(|found| found.clone()).unwrap_or_default()
    }

    /// The same, with `folder` tried first.
    #[must_use]
    pub fn first(&self, folder: Option<&Path>) -> Files {
        let mut files = self.clone();
        files.folders.splice(0..0, folder.map(Path::to_path_buf));
        files
    }

    /// The first existing match, whose content becomes part of the plan's hash; the error lists the
    /// folders tried.
    pub fn resolve(&self, name: &str) -> Result<PathBuf, crate::BuildError> {
        let path = self.find(name)?;
        // A device or a pipe may never end.
        if path.metadata().is_ok_and(|m| !m.is_file() && !m.is_dir()) {
            let fact = format!("`{name}` is neither a file nor a folder");
            return Err(crate::BuildError::new(fact).help("name a regular file"));
        }
        if let (Ok(print), Ok(mut found)) = (fingerprint(&path), self.found.lock()) {
            found.insert(name.to_string(), print);
        }
        Ok(path)
    }

    /// The text of that name: of the first existing file, which then is part of the plan's hash, else one that the program
    /// carries with it.
    ///
    /// # Errors
    /// No such file (the folders that were tried), none that can be read as text.
    pub fn text(&self, name: &str) -> Result<String, crate::BuildError> {
        let path = match (self.resolve(name), self.embedded.get(name)) {
            (Ok(path), _) => path,
            (Err(_), Some(text)) => return Ok(text.clone()),
            (Err(e), None) => return Err(e),
        };
        // A device or a pipe may never end.
        if path.metadata().is_ok_and(|m| !m.is_file()) {
            return Err(crate::BuildError::new(format!("`{name}` is no file")));
        }
        let fault = |e| crate::BuildError::new(format!("the file `{name}` cannot be read: {e}"));
        std::fs::read_to_string(path).map_err(fault)
    }

    /// The first existing match, only to be looked at; the error lists the folders tried.
    pub fn find(&self, name: &str) -> Result<PathBuf, crate::BuildError> {
        let absolute = Path::new(name).is_absolute() && Path::new(name).exists();
        let path = match absolute {
            true => Some(PathBuf::from(name)),
            false => self.folders.iter().map(|f| f.join(name)).find(|p| p.exists()),
        };
        if let Some(path) = path {
            return Ok(path);
        }
        let tried: Vec<String> = self.folders.iter().map(|f| f.display().to_string()).collect();
        Err(crate::BuildError::new(format!("there is no file `{name}`"))
            .help(format!("folders tried: {}", tried.join(", "))))
    }
}

/// Bytes above which a file is known by samples of it.
const WHOLE: u64 = 64 << 20;

/// Bytes at the head of a large file that are known as a whole: formats that are read in pieces keep the checksums of their
/// pieces there.
const HEAD: u64 = 4 << 20;

/// Hash of a file's length and content; of large files the head, and 64 pieces, evenly spread.
fn fingerprint(path: &Path) -> std::io::Result<u64> {
    use std::io::{Read, Seek, SeekFrom};
    // Asked before it is opened: opening a pipe waits for who writes into it.
    if !path.metadata()?.is_file() {
        return Ok(0);
    }
    let mut file = std::fs::File::open(path)?;
    let length = file.metadata()?.len();
    let mut bytes = length.to_le_bytes().to_vec();
    if length <= WHOLE {
        file.read_to_end(&mut bytes)?;
    } else {
        (&mut file).take(HEAD).read_to_end(&mut bytes)?;
        let mut piece = vec![0; 1 << 16];
        for k in 0..64 {
            file.seek(SeekFrom::Start((length - piece.len() as u64) / 63 * k))?;
            file.read_exact(&mut piece)?;
            bytes.extend_from_slice(&piece);
        }
    }
    Ok(crate::noise::hash(bytes))
}
