//! Assembly files as they are named by parts.
use crate::form::assembly::{self, Assembly, AssemblyForm};
use crate::schema::read::fields;
use crate::schema::record::Record;
use crate::text::files::{Files, Home};
use crate::text::parse::{parse, parse_once};
use crate::text::report::Cx;
use crate::text::value::Text;
use linkwork_runtime::{Origin, Value};
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

/// Assembly files, each read once.
pub(crate) struct Assemblies<'o> {
    pub files: Files<'o>,
    pub read: BTreeMap<String, Option<Arc<Assembly>>>,
    /// The assembly of the text being loaded, by its name.
    pub own: Option<(String, Home, Arc<Assembly>)>,
}

impl Assemblies<'_> {
    /// The assembly of a file; `None` when it cannot be found or read (recorded).
    pub fn assembly(
        &mut self,
        cx: &mut Cx,
        name: &Text,
        home: &Home,
        user: &str,
    ) -> Option<(String, Home, Arc<Assembly>)> {
        if let Some((key, home, read)) = self.own.as_ref().filter(|own| own.0 == name.text) {
            return Some((key.clone(), home.clone(), read.clone()));
        }
        let (key, home) = match self.files.find(&name.text, home) {
            Ok(found) => found,
            Err(tried) => {
                let message = format!("`{user}`: there is no assembly file `{}`", name.text);
                let mut help = format!("tried: {}", tried.join(", "));
                let known: Vec<&str> = self.files.embedded.keys().map(String::as_str).collect();
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
            Home::Embedded(_) => self.files.embedded.get(&key).cloned(),
            Home::Folder(_) => match linkwork_formats::whole_text(Path::new(&key)) {
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
            read_once(cx, file, &key)
        });
        self.read.insert(key.clone(), assembly.clone());
        assembly.map(|a| (key, home, a))
    }
}

/// An assembly that another load has read is not read again.
fn read_once(cx: &mut Cx, file: u32, key: &str) -> Option<Arc<Assembly>> {
    let once = parse_once(cx, file);
    if let Some(known) = once.as_ref().and_then(|once| once.assembly.get()) {
        return Some(known.clone());
    }
    let faults = cx.faults.len();
    let assembly = Arc::new(read_file(cx, file, key)?);
    if let (Some(once), true) = (once, cx.faults.len() == faults) {
        return Some(once.assembly.get_or_init(|| assembly).clone());
    }
    Some(assembly)
}

fn read_file(cx: &mut Cx, file: u32, key: &str) -> Option<Assembly> {
    let v = parse(cx, file)?;
    match &v.value {
        Value::Variant(name, inner) if name == "Assembly" => {
            let what = format!("assembly `{key}`");
            fields(cx, inner, &what, &AssemblyForm::names());
            Some(assembly::read_assembly(cx, inner, &what))
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
