//! Services that several compilations share, for example the terrain of simulations that differ in some numbers only.
use crate::author::services::ServiceObject;
use std::collections::BTreeMap;
use std::sync::{Mutex, PoisonError};

/// The last built service for each path of a part.
#[derive(Default)]
pub struct ServiceCache(Mutex<BTreeMap<String, One>>);

#[derive(Clone)]
pub(crate) struct One {
    /// Model, parameters, folders of files, and the world.
    pub asked: String,
    /// The files that it read, and fingerprints of their contents.
    pub found: BTreeMap<String, u64>,
    pub object: ServiceObject,
}

impl ServiceCache {
    pub(crate) fn with<R>(&self, f: impl FnOnce(&mut BTreeMap<String, One>) -> R) -> R {
        f(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

impl std::fmt::Debug for ServiceCache {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.with(|all| f.debug_set().entries(all.keys()).finish())
    }
}
