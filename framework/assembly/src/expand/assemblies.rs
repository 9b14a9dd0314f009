//! Assembly files that parts use, and their variants.
use crate::expand::variant::{VariantForm, variant};
use crate::form::assembly::{self, AssemblyFields, AssemblyForm};
use crate::schema::read::{fields, text_field};
use crate::schema::record::Record;
use crate::text::files::{Files, Home};
use crate::text::parse::{parse, parse_once};
use crate::text::report::Cx;
use crate::text::value::Text;
use linkwork_runtime::{Located, Origin, Value};
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

/// An assembly, and the folder in which its files are searched first.
type Read = (Home, Arc<AssemblyForm>);

/// Assembly files, each read once.
pub(crate) struct Assemblies<'o> {
    pub files: Files<'o>,
    read: BTreeMap<String, Option<Read>>,
    /// The assembly of the text that is being loaded, by its name.
    pub own: Option<(String, Home, Arc<AssemblyForm>)>,
    /// Files whose variants are being read, the outermost first.
    open: Vec<String>,
}

impl<'o> Assemblies<'o> {
    pub fn new(files: Files<'o>) -> Self {
        Assemblies { files, read: BTreeMap::new(), own: None, open: Vec::new() }
    }

    /// Returns the assembly of a file; `None` if it cannot be found or read (a fault is added).
    pub fn assembly(
        &mut self,
        cx: &mut Cx,
        name: &Text,
        home: &Home,
        user: &str,
    ) -> Option<(String, Home, Arc<AssemblyForm>)> {
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
            return read.clone().map(|(home, a)| (key, home, a));
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
        let read = text.and_then(|text| {
            let file = cx.sources.add(&key, text);
            self.of_file(cx, file, &key, &home)
        });
        self.read.insert(key.clone(), read.clone());
        read.map(|(home, a)| (key, home, a))
    }

    /// Returns the assembly of a source text. An assembly that another load has read is reused, except variants, which depend on two texts.
    fn of_file(&mut self, cx: &mut Cx, file: u32, key: &str, home: &Home) -> Option<Read> {
        let once = parse_once(cx, file);
        let known = once.as_ref().and_then(|once| once.form.get()?.clone().downcast().ok());
        if let Some(known) = known {
            return Some((home.clone(), known));
        }
        let faults = cx.faults.len();
        let mut inner = assembly_fields(cx, file, key)?;
        let read = self.of_fields(cx, &mut inner, key, home)?;
        if let (Some(once), true) = (once, cx.faults.len() == faults && inner.get("like").is_none())
        {
            once.form.get_or_init(|| read.1.clone());
        }
        Some(read)
    }

    /// Returns the assembly that these fields of the file `key` define, directly or as a variant of another file.
    pub fn of_fields(
        &mut self,
        cx: &mut Cx,
        inner: &mut Located,
        key: &str,
        home: &Home,
    ) -> Option<Read> {
        let what = format!("assembly `{key}`");
        let is_variant = inner.get("like").is_some();
        let known = if is_variant { VariantForm::names() } else { AssemblyFields::names() };
        fields(cx, inner, &what, &known);
        let own = assembly::read_assembly(cx, inner, &what);
        if !is_variant {
            return Some((home.clone(), Arc::new(own)));
        }
        let like = text_field(cx, inner, "like", &what)?;
        if self.open.iter().any(|k| k == key) {
            let ring = format!("{} -> {key}", self.open.join(" -> "));
            cx.fault(
                like.origin,
                format!("{what}: `like` is circular: {ring}"),
                "remove one of them",
            );
            return None;
        }
        self.open.push(key.to_string());
        let base = self.assembly(cx, &like, home, key);
        self.open.pop();
        let (base_key, home, base) = base?;
        Some((home, Arc::new(variant(cx, own, &base, &base_key))))
    }
}

/// Returns the fields of the assembly in a file.
fn assembly_fields(cx: &mut Cx, file: u32, key: &str) -> Option<Located> {
    let v = parse(cx, file)?;
    match v.value {
        Value::Variant(name, inner) if name == "Assembly" => Some(*inner),
        Value::Variant(name, _) => {
            let origin = Origin { end: v.origin.start + name.len() as u32, ..v.origin };
            let message = format!("`{key}` contains `{name}(..)` instead of `Assembly(..)`");
            cx.fault(origin, message, "a simulation cannot be a part");
            None
        }
        other => {
            let message = format!("`{key}` contains {} instead of `Assembly(..)`", other.what());
            cx.fault(v.origin, message, "begin the file with `Assembly(`");
            None
        }
    }
}
