//! Finding assembly files: beside the file that names them, in the search folders, embedded.
use crate::context::{Cx, Text};
use crate::form::{self, Assembly};
use crate::read::fields;
use crate::ron_text::parse;
use linkwork_runtime::{Origin, Value};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::rc::Rc;

/// Where a text comes from, and so where its neighbours are.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Home {
    /// A folder on disk.
    Folder(PathBuf),
    /// A folder of the embedded texts: "" or "rovers/".
    Embedded(String),
}

/// Reads each file once.
pub(crate) struct Files<'o> {
    pub search: &'o [PathBuf],
    pub embedded: &'o BTreeMap<String, String>,
    pub read: BTreeMap<String, Option<Rc<Assembly>>>,
    /// The assembly of the text being loaded, by its name.
    pub own: Option<(String, Home, Rc<Assembly>)>,
    /// Data files need not exist (a resolved text is read without them).
    pub lenient: bool,
}

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

impl Files<'_> {
    /// The key of a file (its path) and its home, or the folders tried.
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

    /// The assembly of a file; `None` when it cannot be found or read (recorded).
    pub fn assembly(
        &mut self,
        cx: &mut Cx,
        name: &Text,
        home: &Home,
        user: &str,
    ) -> Option<(String, Home, Rc<Assembly>)> {
        if let Some((key, home, read)) = self.own.as_ref().filter(|own| own.0 == name.text) {
            return Some((key.clone(), home.clone(), read.clone()));
        }
        let (key, home) = match self.find(&name.text, home) {
            Ok(found) => found,
            Err(tried) => {
                let message = format!("`{user}`: there is no assembly file `{}`", name.text);
                let mut help = format!("tried: {}", tried.join(", "));
                let known: Vec<&str> = self.embedded.keys().map(String::as_str).collect();
                if let Some(guess) = linkwork_runtime::did_you_mean(&name.text, known) {
                    help = format!("{guess} {help}");
                }
                cx.fault(name.origin, message, help);
                return None;
            }
        };
        if let Some(read) = self.read.get(&key) {
            return read.clone().map(|a| (key, home, a));
        }
        let text = match &home {
            Home::Embedded(_) => self.embedded.get(&key).cloned(),
            Home::Folder(_) => match std::fs::read_to_string(&key) {
                Ok(text) => Some(text),
                Err(e) => {
                    let message = format!("`{user}`: `{key}` cannot be read: {e}");
                    cx.fault(name.origin, message, "it must be a readable UTF-8 text");
                    None
                }
            },
        };
        let assembly = text.and_then(|text| {
            let file = cx.sources.add(&key, text);
            read_file(cx, file, &key).map(Rc::new)
        });
        self.read.insert(key.clone(), assembly.clone());
        assembly.map(|a| (key, home, a))
    }

    /// A data file such as a mesh, or `None`.
    pub fn data(&self, name: &str, home: &Home) -> Option<String> {
        match self.find(name, home) {
            Ok((key, _)) => Some(key),
            Err(_) => self.lenient.then(|| name.to_string()),
        }
    }
}

fn embedded_home(key: &str) -> Home {
    Home::Embedded(key.rsplit_once('/').map_or(String::new(), |(head, _)| format!("{head}/")))
}

fn read_file(cx: &mut Cx, file: u32, key: &str) -> Option<Assembly> {
    let v = parse(cx, file)?;
    match &v.value {
        Value::Variant(name, inner) if name == "Assembly" => {
            let what = format!("assembly `{key}`");
            fields(cx, inner, &what, &form::FIELDS);
            Some(form::read_assembly(cx, inner, &what))
        }
        Value::Variant(name, _) => {
            let origin = Origin { end: v.origin.start + name.len() as u32, ..v.origin };
            let message = format!("`{key}` holds `{name}(..)`, an `Assembly(..)` is wanted");
            cx.fault(origin, message, "a simulation cannot be a part");
            None
        }
        other => {
            let message = format!("`{key}` holds {}, an `Assembly(..)` is wanted", other.what());
            cx.fault(v.origin, message, "begin the file with `Assembly(`");
            None
        }
    }
}
