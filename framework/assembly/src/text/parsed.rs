//! Cache of parsed texts: for several loads of one simulation, each text is parsed, and each assembly read, once.
use linkwork_runtime::{Located, Origin};
use std::any::Any;
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

/// Values of texts without mistakes, by name and index among the sources.
#[derive(Debug, Default)]
pub struct Parsed(Mutex<BTreeMap<(String, u32), Arc<Once>>>);

/// Content of a text.
#[derive(Debug)]
pub(crate) struct Once {
    pub text: String,
    pub value: Located,
    /// Origin of a value in a map → origin of its key.
    pub keys: BTreeMap<Origin, Origin>,
    /// The assembly in the text, if it was read without a mistake. Its type is defined above this layer.
    pub form: OnceLock<Arc<dyn Any + Send + Sync>>,
}

impl Parsed {
    fn with<R>(&self, f: impl FnOnce(&mut BTreeMap<(String, u32), Arc<Once>>) -> R) -> R {
        f(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// Returns the content of a text at this index among the sources, if it is cached.
    pub(crate) fn get(&self, name: &str, file: u32, text: &str) -> Option<Arc<Once>> {
        let was = self.with(|all| all.get(&(name.to_string(), file)).cloned());
        was.filter(|was| was.text == text)
    }

    pub(crate) fn keep(&self, name: String, file: u32, once: Arc<Once>) {
        self.with(|all| all.insert((name, file), once));
    }
}
