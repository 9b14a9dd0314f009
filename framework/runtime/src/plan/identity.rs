//! The hash of a plan: plans with equal hashes can exchange states.
use crate::author::noise;
use crate::plan::compiled::Plan;
use std::fmt::Write;

impl Plan {
    /// Hash of structure and layout: equal plans can exchange states. In a program with several phases it is the hash of all phases. The first call
    /// costs O(size of the plan).
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
