//! Returns the settings of hinges, and whether they act in this phase.
//!
//! ```text
//! prescribed hinge         the motion is given, so spring, damping, friction and limits do not act
//! no `contact`             dry friction needs rows of contact, or a rate for its smooth form
//! contact by impulses      limits are rows of the contact problem, so `stop` does not act
//! machines by kinematics   rates are zero where forces balance, so damping and friction do not act
//! ```
use crate::spec::MechanismSpec;
use linkwork_multibody::{BallLimits, Coordinate, Friction, Spring, Stop, Subhinge, SubhingeKind};
use linkwork_runtime::Setting;
use linkwork_solvers::JointLimits;

/// Returns whether a subhinge has position limits.
pub(crate) fn limited(s: &Subhinge) -> bool {
    s.limits.lower.is_finite() || s.limits.upper.is_finite() || s.ball != BallLimits::NONE
}

/// Reason and remedy.
type Idle = (&'static str, &'static str);

const PRESCRIBED: Idle = (
    "the hinge is prescribed",
    "remove them, or remove `prescribed` if forces are to move the hinge",
);
const KINEMATIC: Idle = (
    "`place` moves the machine without inertia",
    "remove them, or write `motion: \"dynamics\"` in `place`",
);

impl MechanismSpec {
    /// Returns the settings of all hinges, and those that the reader of the file added.
    pub(crate) fn all_settings(&self) -> Vec<Setting> {
        let mut out = self.settings.clone();
        for (id, range) in self.multibody.subhinges() {
            let body = self.multibody.get(id);
            let name = body.name();
            let origin = self.bodies.get(name).copied().unwrap_or(self.origin);
            let mut owner = format!("body `{name}`");
            if body.subhinges().len() > 1 {
                let k = body.subhinges().iter().position(|s| s.v == range.v).unwrap_or_default();
                owner = format!("{owner}, hinge {} of its chain", k + 1);
            }
            for (name, idle) in self.of_subhinge(&range.subhinge) {
                let idle = idle.map(|(reason, remedy)| (reason.to_string(), remedy.to_string()));
                out.push(Setting { owner: owner.clone(), name, origin, idle });
            }
        }
        out
    }

    /// Returns each setting of a subhinge, with the reason if it does not act.
    fn of_subhinge(&self, s: &Subhinge) -> Vec<(&'static str, Option<Idle>)> {
        if matches!(s.kind, SubhingeKind::Locked) {
            return Vec::new();
        }
        let prescribed = (s.coordinate == Coordinate::Prescribed).then_some(PRESCRIBED);
        let by_rate = prescribed.or(self.kinematic.as_ref().map(|_| KINEMATIC));
        let mut out = Vec::new();
        if s.spring != Spring::NONE {
            out.push(("spring", prescribed));
        }
        if s.damping != 0.0 {
            out.push(("damping", by_rate));
        }
        if s.friction != Friction::NONE {
            out.push(("friction", by_rate.or_else(|| self.idle_friction(s.friction))));
        }
        if limited(s) {
            out.push(("limits", prescribed));
        }
        if s.stop != Stop::Usual {
            out.push(("stop", prescribed.or_else(|| self.idle_stop(s))));
        }
        if s.restitution.is_some() {
            let free = s.stop == Stop::Off && self.contact.is_none();
            let off = (
                "`stop: false` lets the coordinate pass its limits",
                "remove `restitution`, or remove `stop: false`",
            );
            out.push(("restitution", prescribed.or(free.then_some(off))));
        }
        if s.gear != 1.0 {
            let idle = (
                "it only scales `armature`, which is 0",
                "remove `gear`, or write the inertia of the rotor as `armature`; a motor has its own gear ratio",
            );
            out.push(("gear", (s.armature == 0.0).then_some(idle)));
        }
        out
    }

    fn idle_friction(&self, f: Friction) -> Option<Idle> {
        (self.contact.is_none() && f.rate == 0.0).then_some((
            "it is dry friction, which only contact by impulses supports",
            "write `friction: (force: .., rate: ..)` for smooth friction, add `contact`, or remove it",
        ))
    }

    fn idle_stop(&self, s: &Subhinge) -> Option<Idle> {
        if !limited(s) {
            let soft = matches!(s.stop, Stop::Soft { .. });
            return soft.then_some((
                "the hinge has no limits",
                "remove `stop`, or write `limits: (lower: .., upper: ..)`",
            ));
        }
        let contact = self.contact.as_ref()?;
        let enforced = contact.settings.limits == JointLimits::Stop;
        match s.stop {
            Stop::Off if !enforced => None,
            Stop::Off => Some((
                "`contact` enforces limits",
                "remove the limits, or write `limits: false` in `contact`",
            )),
            _ => Some((
                "with `contact`, limits are rigid",
                "remove `stop`, or write `compliant: true` in `contact`",
            )),
        }
    }
}
