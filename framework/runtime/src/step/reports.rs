//! Reports of a run: moves between plans, and notices of parts and services.
use crate::author::value::Fault;
use std::collections::BTreeSet;

/// Report of a move between plans.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MoveReport {
    /// Paths of parts that kept their state.
    pub kept: Vec<String>,
    /// Paths of parts that started anew.
    pub new: Vec<String>,
    /// Paths of parts that no longer exist.
    pub dropped: Vec<String>,
    /// Removed pins: the path, and the reason for which the variable cannot be pinned now.
    pub unpinned: Vec<(String, String)>,
    /// Reports of parts, such as momentum and energy of a mechanism.
    pub notes: Vec<String>,
}

/// Maximum number of notices that are kept until they are queried.
pub(super) const KEPT: usize = 256;

/// A notice: simulated time (s), and the message with the place of the part in its file.
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
