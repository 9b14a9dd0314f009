//! The catalogue: every model and service by name. Explicit; nothing registers itself.
use crate::author::block::{Built, Prototype};
use crate::author::error::BuildError;
use crate::author::field::{self, BuiltField, Field};
use crate::author::files::Files;
use crate::author::model::{Description, Functions, Model};
use crate::author::params::{Params, ParamsBuilder, ReadCx};
use crate::author::provider::Service;
use crate::author::services::{ServiceKind, ServiceObject};
use crate::author::sized::{self, BuiltSized, SizedModel};
use crate::author::value::{Fault, Located, remedy};
use std::any::TypeId;
use std::collections::BTreeMap;
use std::sync::Arc;

type MakeModel = fn(&Arc<Description>, &Located, &mut ReadCx<'_>) -> Option<Box<dyn Prototype>>;
type MakeService = fn(&Located, &Files, &mut ReadCx<'_>) -> Option<ServiceObject>;

type Describe = fn(&Located, &Files) -> Option<Description>;

/// A part that is created from a file and parameters: an FMI unit. The file defines its ports and states.
pub trait Foreign: 'static {
    /// Name in the catalogue.
    const NAME: &'static str;
    /// Documentation.
    const DOC: &'static str;
    /// Parameters.
    type Params: Params;
    /// Returns the description of the instance without starting it; `None` if the file cannot be read ([`Foreign::make`] reports the reason).
    fn describe(p: &Self::Params, files: &Files) -> Option<Description>;
    /// Creates the part; `None` with faults in `cx`, whose `files` resolve the named files.
    fn make(p: Self::Params, written: &Located, cx: &mut ReadCx<'_>) -> Option<Box<dyn Prototype>>;
}

/// Factory of parts without a Rust type: models in another language.
pub trait Making: Send + Sync {
    /// Returns the description of the instance with these parameters; `None` if they are invalid ([`Making::make`] reports the reason).
    fn describe(&self, params: &Located) -> Option<Description>;
    /// Creates the part; `None` with faults in `cx`.
    fn make(&self, params: &Located, cx: &mut ReadCx<'_>) -> Option<Box<dyn Prototype>>;
    /// Returns the text of the model's code if this can change while the program stays the same. Runs of one campaign need the same code.
    fn source(&self) -> String {
        String::new()
    }
}

#[derive(Clone)]
enum Maker {
    Model(MakeModel),
    Sized(MakeModel, Describe),
    Given(Arc<dyn Making>),
    Service(ServiceKind, MakeService),
}

/// A Rust type from which a part can be built: a model, a service or a field. The macros `#[model]`, `#[service]` and
/// `#[field]` implement it.
pub trait PartType: 'static {
    /// Sets its parameters.
    type Builder: ParamsBuilder;
    /// Returns it as an entry of a catalogue.
    fn entry() -> Entry;
}

/// One model or service.
#[derive(Clone)]
pub struct Entry {
    /// Description of the model or service.
    pub description: Arc<Description>,
    maker: Maker,
    /// The Rust type, if there is one.
    of: Option<TypeId>,
}

fn built<T>(result: Result<T, BuildError>, params: &Located, cx: &mut ReadCx<'_>) -> Option<T> {
    match result {
        Ok(t) => Some(t),
        Err(e) => {
            let place = e.param.as_deref().and_then(|p| params.get(p)).unwrap_or(params);
            let message = match &e.param {
                Some(p) => format!("`{}.{p}`: {}", cx.path, e.message),
                None => format!("`{}`: {}", cx.path, e.message),
            };
            cx.fault(place.origin, message, e.help);
            None
        }
    }
}

impl Entry {
    /// Creates the entry of a model type.
    pub fn model<M: Model>() -> Entry {
        Entry {
            of: Some(TypeId::of::<M>()),
            description: Arc::new(Description::of::<M>()),
            maker: Maker::Model(|description, params, cx| {
                let p = M::Params::read_map(params, cx)?;
                let shown = p.show_map();
                let model = built(M::build(p), params, cx)?;
                Some(Box::new(Built {
                    model: Arc::new(model),
                    params: shown,
                    description: match cx.slides {
                        true => Arc::new(description.on_slider()),
                        false => description.clone(),
                    },
                }))
            }),
        }
    }

    /// Creates the entry of a model type whose ports depend on its parameters.
    pub fn sized<M: SizedModel>() -> Entry {
        let description = Description {
            name: M::NAME.into(),
            doc: M::DOC.into(),
            params: M::Params::specs(),
            ..Description::default()
        };
        let make: MakeModel = |_, params, cx| {
            let p = M::Params::read_map(params, cx)?;
            let (shown, description) = (p.show_map(), sized::describe::<M>(&p));
            let model = built(M::build(p), params, cx)?;
            Some(Box::new(BuiltSized {
                model: Arc::new(model),
                params: shown,
                description: Arc::new(description),
            }))
        };
        let describe: Describe = |params, files| {
            let none = crate::author::services::Services::default();
            let p = M::Params::read_map(params, &mut ReadCx::looking(&none, files))?;
            Some(sized::describe::<M>(&p))
        };
        let (description, of) = (Arc::new(description), Some(TypeId::of::<M>()));
        Entry { description, maker: Maker::Sized(make, describe), of }
    }

    /// Creates the entry of a field type.
    pub fn field<F: Field>() -> Entry {
        Entry {
            of: Some(TypeId::of::<F>()),
            description: Arc::new(field::describe::<F>()),
            maker: Maker::Model(|_, params, cx| {
                let p = F::Params::read_map(params, cx)?;
                let shown = p.show_map();
                let field: Arc<F> = Arc::new(built(F::build(p), params, cx)?);
                let description =
                    Description { inputs: F::inputs(Some(&field)), ..field::describe::<F>() };
                Some(Box::new(BuiltField { field, params: shown, description }))
            }),
        }
    }

    /// Creates the entry of a part type whose ports are defined by a file.
    pub fn foreign<F: Foreign>() -> Entry {
        let description = Description {
            name: F::NAME.into(),
            doc: F::DOC.into(),
            params: F::Params::specs(),
            ..Description::default()
        };
        let make: MakeModel = |_, params, cx| {
            let p = F::Params::read_map(params, cx)?;
            F::make(p, params, cx)
        };
        let describe: Describe = |params, files| {
            let none = crate::author::services::Services::default();
            let p = F::Params::read_map(params, &mut ReadCx::looking(&none, files))?;
            F::describe(&p, files)
        };
        let (description, of) = (Arc::new(description), Some(TypeId::of::<F>()));
        Entry { description, maker: Maker::Sized(make, describe), of }
    }

    /// Creates the entry of parts from a factory; `description` applies before parameters are known.
    pub fn given(description: Description, making: Arc<dyn Making>) -> Entry {
        Entry { description: Arc::new(description), maker: Maker::Given(making), of: None }
    }

    /// Returns the text of the model's code ([`Making::source`]); empty for models of the program.
    pub fn source(&self) -> String {
        match &self.maker {
            Maker::Given(making) => making.source(),
            _ => String::new(),
        }
    }

    /// Returns the description of the instance with these parameters. The ports of a sized model, or of one that a file describes, are known only if
    /// its parameters can be read; otherwise returns `None`.
    pub fn describe(&self, params: &Located, files: &Files) -> Option<Arc<Description>> {
        match &self.maker {
            Maker::Sized(_, describe) => describe(params, files).map(Arc::new),
            Maker::Given(making) => making.describe(params).map(Arc::new),
            _ => Some(self.description.clone()),
        }
    }

    /// Creates the entry of a service type.
    pub fn service<S: Service>() -> Entry {
        Entry {
            of: Some(TypeId::of::<S>()),
            description: Arc::new(Description {
                name: S::NAME.into(),
                doc: S::DOC.into(),
                functions: Functions::default(),
                params: S::Params::specs(),
                ..Description::default()
            }),
            maker: Maker::Service(ServiceKind::of::<S::Provides>(), |params, files, cx| {
                let p = S::Params::read_map(params, cx)?;
                built(S::build(p, files), params, cx).map(S::object)
            }),
        }
    }

    /// Returns the kind of service, or `None` for a model.
    pub fn service_kind(&self) -> Option<ServiceKind> {
        match self.maker {
            Maker::Model(_) | Maker::Sized(..) | Maker::Given(_) => None,
            Maker::Service(kind, _) => Some(kind),
        }
    }

    /// Builds a model; `None` with faults in `cx` if the parameters are invalid or the entry is a service.
    pub fn make_model(&self, params: &Located, cx: &mut ReadCx<'_>) -> Option<Box<dyn Prototype>> {
        match &self.maker {
            Maker::Model(make) | Maker::Sized(make, _) => make(&self.description, params, cx),
            Maker::Given(making) => making.make(params, cx),
            Maker::Service(..) => None,
        }
    }

    /// Builds a service; `None` with faults in `cx` if the parameters are invalid or the entry is a model.
    pub fn make_service(
        &self,
        params: &Located,
        files: &Files,
        cx: &mut ReadCx<'_>,
    ) -> Option<ServiceObject> {
        match self.maker {
            Maker::Model(_) | Maker::Sized(..) | Maker::Given(_) => None,
            Maker::Service(_, make) => make(params, files, cx),
        }
    }
}

/// Removed models and their replacements.
const GONE: [(&str, &str); 1] = [(
    "environment.mars_sun",
    "use `environment.ephemeris_sun`, and write the date and the place in the simulation: world: (body: \"mars\", epoch: .., site: (latitude: .., longitude: ..))",
)];

/// All models and services that a simulation may name.
#[derive(Clone, Default)]
pub struct Catalogue {
    entries: BTreeMap<String, Entry>,
}

impl Catalogue {
    /// Creates a catalogue from the lists of libraries.
    ///
    /// # Panics
    /// Panics if two entries have the same name, which is a mistake in the program.
    pub fn new(libraries: impl IntoIterator<Item = Vec<Entry>>) -> Self {
        let mut entries = BTreeMap::new();
        for entry in libraries.into_iter().flatten() {
            let name = entry.description.name.to_string();
            assert!(!entries.contains_key(&name), "two models are named `{name}`");
            entries.insert(name, entry);
        }
        Catalogue { entries }
    }

    /// Adds one.
    ///
    /// # Errors
    /// Returns the name if an entry with that name exists.
    pub fn add(&mut self, entry: Entry) -> Result<(), String> {
        let name = entry.description.name.to_string();
        if self.entries.contains_key(&name) {
            return Err(name);
        }
        self.entries.insert(name, entry);
        Ok(())
    }

    /// Adds an entry, unless an entry with the same type exists.
    ///
    /// # Errors
    /// Returns the name if an entry with another type has it.
    pub fn include(&mut self, entry: Entry) -> Result<(), String> {
        match self.entries.get(&*entry.description.name) {
            Some(there) if there.of.is_some() && there.of == entry.of => Ok(()),
            _ => self.add(entry),
        }
    }

    /// Returns all entries by name.
    pub fn iter(&self) -> impl Iterator<Item = &Entry> {
        self.entries.values()
    }

    /// Returns an entry by name.
    pub fn get(&self, name: &str) -> Option<&Entry> {
        self.entries.get(name)
    }

    /// Returns an entry by name, or a fault with suggestions.
    pub fn find(&self, name: &str, origin: crate::Origin, user: &str) -> Result<&Entry, Fault> {
        self.entries.get(name).ok_or_else(|| {
            // A user's library is available only in the program that contains it.
            let library = |name: &str| name.split_once('.').map(|(library, _)| library.to_string());
            if let Some(own) = library(name)
                && !self.entries.keys().any(|known| library(known).as_deref() == Some(&own))
            {
                let all: std::collections::BTreeSet<String> =
                    self.entries.keys().filter_map(|known| library(known)).collect();
                let all: Vec<&str> = all.iter().map(String::as_str).collect();
                let fact = format!(
                    "`{user}`: there is no model `{name}`: this program has no library `{own}`"
                );
                let help = format!(
                    "run the file with the program that has that library (`linkwork new library` makes one); if the model is a Python \
                     class, with `python -m linkwork --models FILE.py` or `linkwork.Simulation(.., models=..)`; {}",
                    remedy(&own, "libraries here", &all)
                );
                return Fault::new(origin, fact).help(help);
            }
            let known: Vec<&str> = self.entries.keys().map(String::as_str).collect();
            let gone = GONE.iter().find(|(old, _)| *old == name).map(|(_, help)| (*help).to_string());
            let help = gone.or_else(|| self.meant(name)).unwrap_or_else(|| remedy(name, "models", &known));
            Fault::new(origin, format!("`{user}`: there is no model `{name}`")).help(help)
        })
    }

    /// Suggests full names for a name without its library (`dc_motor`), or models whose texts contain a word (`parachute`).
    fn meant(&self, name: &str) -> Option<String> {
        let short = |known: &&String| known.rsplit('.').next() == Some(name);
        let full: Vec<String> =
            self.entries.keys().filter(short).map(|k| format!("`{k}`")).collect();
        if !full.is_empty() {
            return Some(format!("did you mean {}?", full.join(" or ")));
        }
        let found = self.search(name);
        let shown: Vec<String> =
            found.iter().take(6).map(|e| format!("`{}`", e.description.name)).collect();
        let more = if found.len() > shown.len() { ", and others" } else { "" };
        (!shown.is_empty()).then(|| format!("models for that word: {}{more}", shown.join(", ")))
    }

    /// Returns the models whose name or description contains all words of a text; matches in the name come first.
    #[must_use]
    pub fn search(&self, text: &str) -> Vec<&Entry> {
        let words: Vec<String> = text.split_whitespace().map(str::to_lowercase).collect();
        let all = |text: &str| {
            let text = text.to_lowercase();
            !words.is_empty() && words.iter().all(|w| text.contains(w.as_str()))
        };
        let (named, others): (Vec<&Entry>, Vec<&Entry>) =
            self.entries.values().partition(|e| all(&e.description.name));
        let described = others.into_iter().filter(|e| all(&e.description.doc));
        named.into_iter().chain(described).collect()
    }
}
