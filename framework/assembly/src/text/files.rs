//! Search of files: relative to the text that uses them, in the search folders, and among the embedded texts.
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Origin of a text, which determines where its relative paths are resolved.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Home {
    /// A folder on disk.
    Folder(PathBuf),
    /// A folder of the embedded texts: "" or "rovers/".
    Embedded(String),
}

/// Locations in which files are searched.
pub(crate) struct Files<'o> {
    pub search: &'o [PathBuf],
    pub embedded: &'o BTreeMap<String, String>,
    /// Missing data files are accepted (a resolved text is read without them).
    pub lenient: bool,
}

/// The locations, and the origin of the text that uses a file.
pub(crate) type Near<'p> = (&'p Files<'p>, &'p Home);

/// `a/./b/../c` → `a/c`.
fn normal(path: &str) -> String {
    let mut out: Vec<&str> = Vec::new();
    for piece in path.split('/') {
        match piece {
            "" | "." => {}
            ".." if out.last().is_some_and(|p| *p != "..") => {
                out.pop();
            }
            piece => out.push(piece),
        }
    }
    let joined = out.join("/");
    if path.starts_with('/') { format!("/{joined}") } else { joined }
}

fn embedded_home(key: &str) -> Home {
    Home::Embedded(key.rsplit_once('/').map_or(String::new(), |(head, _)| format!("{head}/")))
}

impl Files<'_> {
    /// Returns the key of a file (its path) and its origin, or the folders that were tried.
    pub fn find(&self, name: &str, home: &Home) -> Result<(String, Home), Vec<String>> {
        let mut tried = Vec::new();
        let mut folders: Vec<&Path> = Vec::new();
        match home {
            Home::Folder(folder) => folders.push(folder),
            Home::Embedded(folder) => {
                let key = normal(&format!("{folder}{name}"));
                if self.embedded.contains_key(&key) {
                    return Ok((key.clone(), embedded_home(&key)));
                }
                tried.push(format!("embedded:{folder}"));
            }
        }
        folders.extend(self.search.iter().map(PathBuf::as_path));
        for folder in folders {
            let path = folder.join(name);
            if path.is_file() {
                let key = normal(&path.display().to_string());
                let home = path.parent().map_or_else(|| PathBuf::from("."), Path::to_path_buf);
                return Ok((key, Home::Folder(home)));
            }
            let shown = folder.display().to_string();
            tried.push(if shown.is_empty() { ".".into() } else { shown });
        }
        let key = normal(name);
        if self.embedded.contains_key(&key) {
            return Ok((key.clone(), embedded_home(&key)));
        }
        if !self.embedded.is_empty() {
            tried.push("the embedded assemblies".into());
        }
        Err(tried)
    }

    /// Returns the path of a data file such as a mesh, or `None`.
    pub fn data(&self, name: &str, home: &Home) -> Option<String> {
        match self.find(name, home) {
            Ok((key, _)) => Some(key),
            Err(_) => self.lenient.then(|| name.to_string()),
        }
    }
}
