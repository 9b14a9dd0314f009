//! State of a load: the texts, the faults so far, and the positions of keys.
use crate::text::parsed::{Once, Parsed};
use linkwork_runtime::{Fault, Located, Origin, Sources};
use std::collections::BTreeMap;
use std::sync::Arc;

/// Sources, faults and places of keys.
#[derive(Default)]
pub(crate) struct Cx {
    pub sources: Sources,
    pub faults: Vec<Fault>,
    /// Origin of a value in a map → origin of its key.
    pub keys: BTreeMap<Origin, Origin>,
    /// The cache of parsed texts.
    pub parsed: Option<Arc<Parsed>>,
    /// Texts that this load shares with others, with the positions of their keys.
    pub shared: Vec<(u32, Arc<Once>)>,
    /// Beginning of the file of an assembly that is simulated alone, not as a part of a simulation.
    pub alone: Option<Origin>,
}

impl Cx {
    /// Records a fault.
    pub fn fault(&mut self, origin: Origin, message: impl Into<String>, help: impl Into<String>) {
        let help: String = help.into();
        let fault = Fault::new(origin, message);
        self.faults.push(if help.is_empty() { fault } else { fault.help(help) });
    }

    /// Adds an error of another crate, at a position in a text.
    pub fn explained<E: std::fmt::Display>(
        &mut self,
        origin: Origin,
        what: &str,
        faults: impl IntoIterator<Item = E>,
    ) {
        for fault in faults {
            let mut fault = Fault::of(origin, &fault);
            if !what.is_empty() {
                fault.message = format!("{what}: {}", fault.message);
            }
            self.faults.push(fault);
        }
    }

    /// Returns the position of the key of a map entry; that of the value itself without a key.
    pub fn key(&self, v: &Located) -> Origin {
        let keys = match self.shared.iter().find(|(file, _)| *file == v.origin.file) {
            Some((_, once)) => &once.keys,
            None => &self.keys,
        };
        keys.get(&Origin { default: false, ..v.origin }).copied().unwrap_or(v.origin)
    }

    /// Returns `file:line:column`, or a word if there is no file.
    pub fn place(&self, origin: Origin) -> String {
        match self.sources.place(origin) {
            Some((name, line, column)) => format!("{name}:{line}:{column}"),
            None => "the program".into(),
        }
    }
}

/// Sorts faults by position and merges those of several instances of one text.
pub fn tidy(mut faults: Vec<Fault>) -> Vec<Fault> {
    // The same mistake in Wheel1 … Wheel6 is one mistake in wheel.ron, so compare messages without
    // digits.
    let plain = |m: &str| m.chars().filter(|c| !c.is_ascii_digit()).collect::<String>();
    faults.sort_by_key(|f| f.origin);
    let mut kept: Vec<(usize, Fault)> = Vec::new();
    let mut known: BTreeMap<(Origin, String), usize> = BTreeMap::new();
    for fault in faults {
        let key = (fault.origin, plain(&fault.message));
        match known.get(&key) {
            Some(&at) if fault.origin != Origin::NONE => kept[at].0 += 1,
            _ => {
                known.insert(key, kept.len());
                kept.push((1, fault));
            }
        }
    }
    let count_in = |(count, mut fault): (usize, Fault)| {
        if count > 1 {
            fault.message.push_str(&format!(" (and {} more like it)", count - 1));
        }
        fault
    };
    kept.into_iter().map(count_in).collect()
}
