//! Reports of a run: moves between plans, and notices of parts and services.
use crate::author::value::Fault;
use std::collections::BTreeSet;

/// What a move did.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MoveReport {
    /// Paths of parts that kept their state.
    pub kept: Vec<String>,
    /// Paths of parts that started anew.
    pub new: Vec<String>,
    /// Paths of parts that are gone.
    pub dropped: Vec<String>,
    /// Pins that are gone: the path, and why the variable cannot be pinned now.
    pub unpinned: Vec<(String, String)>,
    /// What parts say of it: momentum and energy of a mechanism.
    pub notes: Vec<String>,
}

/// Notices that are kept until somebody asks.
pub(super) const KEPT: usize = 256;

/// A notice: simulated time (s), and what there is to be said, with the place of the part in its file.
pub type Notice = (f64, Fault);

/// Reports that were made, and those that were not taken yet.
#[derive(Default)]
pub(crate) struct Notices {
    pub(super) kept: Vec<Notice>,
    /// Guards by name, services by path.
    pub(super) told: BTreeSet<String>,
}

impl Notices {
    /// Once for each `name`.
    pub(super) fn add(&mut self, name: &str, time: f64, fault: Fault) {
        // A program may never read the reports, so at most `KEPT` of them are stored.
        if self.told.insert(name.to_string()) && self.kept.len() < KEPT {
            self.kept.push((time, fault));
        }
    }
}
