//! Files that a configuration names: search folders and fingerprints of contents.
use crate::author::made::ServiceCache;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Finds the files that a configuration names.
#[derive(Clone, Debug, Default)]
pub struct Files {
    /// Folders, searched in order.
    pub folders: Vec<PathBuf>,
    /// Files that were found: name and fingerprint of the content; shared by copies.
    pub(crate) found: Arc<std::sync::Mutex<BTreeMap<String, u64>>>,
    /// Services of earlier compilations, which this one may share.
    pub(crate) made: Option<Arc<ServiceCache>>,
    /// Texts embedded in the program, by name; used if no folder has the file.
    embedded: Arc<BTreeMap<String, String>>,
}

impl Files {
    /// Creates a finder that searches these folders in order.
    pub fn of(folders: Vec<PathBuf>) -> Files {
        Files { folders, ..Files::default() }
    }

    /// Adds texts embedded in the program, for names that no folder has.
    #[must_use]
    pub fn with(self, embedded: Arc<BTreeMap<String, String>>) -> Files {
        Files { embedded, ..self }
    }

    /// Shares services between compilations with the same `made`.
    #[must_use]
    pub fn sharing(self, made: Arc<ServiceCache>) -> Files {
        Files { made: Some(made), ..self }
    }

    /// Returns a copy with the same folders and a separate list of found files.
    pub(crate) fn apart(&self) -> Files {
        Files { found: Arc::default(), ..self.clone() }
    }

    /// Adds found files.
    pub(crate) fn add(&self, prints: BTreeMap<String, u64>) {
        if let Ok(mut found) = self.found.lock() {
            found.extend(prints);
        }
    }

    /// Returns the names of the files whose content is part of the plan's hash.
    pub fn names(&self) -> Vec<String> {
        self.found.lock().map(|found| found.keys().cloned().collect()).unwrap_or_default()
    }

    /// Returns the fingerprints of those files, by name.
    pub fn prints(&self) -> BTreeMap<String, u64> {
        self.found.lock().map(|found| found.clone()).unwrap_or_default()
    }

    /// Returns a copy that searches `folder` first.
    #[must_use]
    pub fn first(&self, folder: Option<&Path>) -> Files {
        let mut files = self.clone();
        files.folders.splice(0..0, folder.map(Path::to_path_buf));
        files
    }

    /// Returns the first existing match, whose content becomes part of the plan's hash. The error lists the searched folders.
    pub fn resolve(&self, name: &str) -> Result<PathBuf, crate::BuildError> {
        let path = self.find(name)?;
        // Reading a device or a pipe may never end.
        if path.metadata().is_ok_and(|m| !m.is_file() && !m.is_dir()) {
            let fact = format!("`{name}` is neither a file nor a folder");
            return Err(crate::BuildError::new(fact).help("name a regular file"));
        }
        if let (Ok(print), Ok(mut found)) = (fingerprint(&path), self.found.lock()) {
            found.insert(name.to_string(), print);
        }
        Ok(path)
    }

    /// Returns the text of the first existing file, which becomes part of the plan's hash, or else the embedded text of that name.
    ///
    /// # Errors
    /// Returns an error if there is no such file (with the searched folders) or it cannot be read as text.
    pub fn text(&self, name: &str) -> Result<String, crate::BuildError> {
        let path = match (self.resolve(name), self.embedded.get(name)) {
            (Ok(path), _) => path,
            (Err(_), Some(text)) => return Ok(text.clone()),
            (Err(e), None) => return Err(e),
        };
        // Reading a device or a pipe may never end.
        if path.metadata().is_ok_and(|m| !m.is_file()) {
            return Err(crate::BuildError::new(format!("`{name}` is not a file")));
        }
        let fault =
            |e: String| crate::BuildError::new(format!("the file `{name}` cannot be read: {e}"));
        let bytes = std::fs::read(path).map_err(|e| fault(e.to_string()))?;
        text_of_bytes(bytes).map_err(fault)
    }

    /// Returns the first existing match without adding it to the plan's hash. The error lists the searched folders.
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

/// Converts the bytes of a file to text, without the byte order mark that spreadsheet programs and some editors write.
///
/// # Errors
/// The bytes are not UTF-8; the error names UTF-16 and the remedy.
pub fn text_of_bytes(mut bytes: Vec<u8>) -> Result<String, String> {
    if bytes.starts_with(&[0xff, 0xfe]) || bytes.starts_with(&[0xfe, 0xff]) {
        return Err("it is a text in UTF-16; save it as UTF-8".into());
    }
    if bytes.starts_with("\u{feff}".as_bytes()) {
        bytes.drain(..3);
    }
    String::from_utf8(bytes).map_err(|e| format!("it is not a text in UTF-8: {}", e.utf8_error()))
}

/// File size in bytes above which the fingerprint uses samples of the content.
const WHOLE: u64 = 64 << 20;

/// Number of bytes at the head of a large file that are hashed completely, because tiled formats keep the checksums of their tiles there.
const HEAD: u64 = 4 << 20;

/// Returns the hash of a file's length and content; for large files, of the head and 64 evenly spaced pieces.
fn fingerprint(path: &Path) -> std::io::Result<u64> {
    use std::io::{Read, Seek, SeekFrom};
    // Check before opening, because opening a pipe blocks until it has a writer.
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
    Ok(crate::author::noise::hash(bytes))
}
