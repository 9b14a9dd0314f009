//! What a plan is, in one number: equal plans can exchange states.
use crate::noise;
use crate::plan::Plan;
use std::fmt::Write;
use std::sync::OnceLock;

/// What goes into the hash and does not stand in the plan otherwise, and the hash once somebody has asked for it.
#[derive(Debug, Default)]
pub(crate) struct Identity {
    /// Sizes, settings and timing.
    before: String,
    /// Services, files, fields, and the conditions on which the phase is left.
    after: String,
    hash: OnceLock<u64>,
}

impl Identity {
    pub fn new(before: String, after: String) -> Identity {
        Identity { before, after, hash: OnceLock::new() }
    }

    /// That of a plan which shares its hash with others.
    pub fn shared(hash: u64) -> Identity {
        Identity { hash: OnceLock::from(hash), ..Identity::default() }
    }
}

impl Plan {
    /// Hash of structure and layout: equal plans can exchange states. In a program with several phases it is that of all of
    /// them. O(size of the plan) when somebody asks first.
    pub fn hash(&self) -> u64 {
        *self.identity.hash.get_or_init(|| {
            let mut text = self.identity.before.clone();
            for part in &self.parts {
                let (path, model) = (&part.path, &part.model);
                let _ = writeln!(text, "{path} {model} {}", part.prototype.params());
                text += &part.prototype.fingerprint();
            }
            for (path, v) in &*self.lanes {
                let _ = writeln!(text, "{path} {:?}", v.place);
            }
            text += &self.identity.after;
            noise::hash(text.bytes())
        })
    }
}
