//! Checks of flexible bodies at build: valid modes, and a station for every frame attached to them.

use super::Modes;
use crate::{Builder, MechanismFault};
use std::collections::BTreeMap;

impl Builder {
    /// Checks the modes, and that a station carries each frame attached to a flexible body.
    pub(crate) fn check_modes(
        &self,
        names: &BTreeMap<&str, usize>,
        faults: &mut Vec<MechanismFault>,
    ) {
        let mut sound = vec![false; self.bodies().len()];
        for (b, sound) in self.bodies().iter().zip(&mut sound) {
            match b.modes.as_ref().map(Modes::validate) {
                Some(Err(all)) => faults.extend(
                    all.into_iter()
                        .map(|error| MechanismFault::Modes { body: b.name.clone(), error }),
                ),
                found => *sound = found.is_some(),
            }
        }
        let hangs = (self.bodies().iter())
            .map(|b| (format!("body `{}`, hinge", b.name), &b.parent, &b.hinge_in_parent))
            .chain(self.nodes().iter().map(|n| (format!("node `{}`", n.name), &n.body, &n.pose)))
            .chain(self.loops().iter().flat_map(|l| {
                let place = |end| format!("loop `{}`, frame {end}", l.name);
                [(place('a'), &l.body_a, &l.frame_a), (place('b'), &l.body_b, &l.frame_b)]
            }));
        for (place, on, X) in hangs {
            let carrier = names.get(on.as_str()).filter(|i| sound[**i] && X.is_finite());
            let modes = carrier.and_then(|i| self.bodies()[*i].modes.as_ref());
            if let Some(Err(error)) = modes.map(|m| m.place(X)) {
                faults.push(MechanismFault::Attachment { place, body: on.clone(), error });
            }
        }
    }
}
