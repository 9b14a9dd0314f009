//! Checks of names, numbers and hinges in the description of a mechanism.

use crate::error::MechanismFault;
use crate::{BallLimits, BodySpec, Friction, Hinge, Spring, Stop, Subhinge, SubhingeKind};
use std::collections::BTreeMap;

pub(crate) fn check_names<'a>(
    what: &'static str,
    names: impl Iterator<Item = &'a str>,
    faults: &mut Vec<MechanismFault>,
) {
    let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
    for name in names {
        *counts.entry(name).or_default() += 1;
    }
    for (name, count) in counts {
        if count > 1 {
            faults.push(MechanismFault::Duplicate { what, name: name.into(), count });
        }
        if name.is_empty() || name == "world" {
            faults.push(MechanismFault::BadName { what, name: name.into() });
        }
    }
}

pub(crate) fn check_numbers(b: &BodySpec, faults: &mut Vec<MechanismFault>) {
    for (pose, which) in [(&b.hinge_in_parent, "parent"), (&b.hinge_in_body, "body")] {
        if !pose.is_finite() {
            let place = format!("body `{}`, hinge frame in the {which}", b.name);
            faults.push(MechanismFault::NotFinite { place });
        }
    }
    check_hinge(&format!("body `{}`", b.name), &b.hinge, faults);
}

/// Checks a hinge. `what` names its owner in messages.
pub(crate) fn check_hinge(what: &str, hinge: &Hinge, faults: &mut Vec<MechanismFault>) {
    let body = || what.to_owned();
    for (i, s) in hinge.subhinges.iter().enumerate() {
        if s.kind.axis().is_some_and(|a| !(a.norm().is_finite() && a.norm() > 1e-100)) {
            faults.push(MechanismFault::BadAxis { body: body(), subhinge: i });
        }
        if matches!(s.kind, SubhingeKind::Screw { pitch, .. } if !pitch.is_finite()) {
            let place = format!("{what}, subhinge {i}, pitch");
            faults.push(MechanismFault::NotFinite { place });
        }
        let barred = matches!(s.kind, SubhingeKind::Free | SubhingeKind::Locked);
        let a = s.armature;
        if !(a.is_finite() && a >= 0.0) || (barred && a != 0.0) {
            let body = body();
            faults.push(MechanismFault::BadArmature { body, subhinge: i, armature: a });
        }
        if !(s.gear.is_finite() && s.gear != 0.0) {
            faults.push(MechanismFault::BadGear { body: body(), subhinge: i, gear: s.gear });
        }
        let limited = s.limits != crate::Limits::NONE;
        if !s.limits.is_valid() || (limited && s.kind.nv() != 1) {
            let body = body();
            faults.push(MechanismFault::BadLimits { body, subhinge: i, limits: s.limits });
        }
        check_forces(what, i, s, faults);
    }
}

/// Checks damping, friction and stop of a subhinge.
fn check_forces(what: &str, subhinge: usize, s: &Subhinge, faults: &mut Vec<MechanismFault>) {
    let body = || what.to_owned();
    let barred = matches!(s.kind, SubhingeKind::Free | SubhingeKind::Locked);
    let (damping, friction, stop) = (s.damping, s.friction, s.stop);
    let sound = |x: f64| x.is_finite() && x >= 0.0;
    if !sound(damping) || (barred && damping != 0.0) {
        faults.push(MechanismFault::BadDamping { body: body(), subhinge, damping });
    }
    let one = s.kind.nv() == 1;
    let rubs = friction != Friction::NONE;
    if !sound(friction.force) || !sound(friction.rate) || (rubs && !one) {
        faults.push(MechanismFault::BadFriction { body: body(), subhinge, friction });
    }
    let fits = match stop {
        Stop::Usual | Stop::Off => true,
        Stop::Soft { stiffness, damping } => {
            let limits = one || s.kind == SubhingeKind::Ball;
            sound(stiffness) && stiffness > 0.0 && sound(damping) && limits
        }
    };
    if !fits {
        faults.push(MechanismFault::BadStop { body: body(), subhinge, stop });
    }
    let mut bad = |what: &'static str, wanted: &'static str| {
        faults.push(MechanismFault::BadDrive { body: body(), subhinge, what, wanted });
    };
    let ball = s.kind == SubhingeKind::Ball;
    if !s.ball.is_valid() || (s.ball != BallLimits::NONE && !ball) {
        bad("a limit of `angle`, `cone` or `twist`", "they must be above 0 and belong on balls");
    }
    let sprung = s.spring != Spring::NONE;
    if !sound(s.spring.stiffness) || !s.spring.rest.is_finite() || (sprung && barred) {
        bad("the spring", "its stiffness must be finite and ≥ 0; not on free or locked subhinges");
    } else if ball && s.spring.rest != 0.0 {
        bad("`rest` of the spring", "a ball's spring has no force at its neutral rotation");
    }
    if let Some(e) = s.restitution {
        let limited =
            s.ball != BallLimits::NONE || s.limits.lower.is_finite() || s.limits.upper.is_finite();
        if !(0.0..=1.0).contains(&e) || !limited {
            bad("`restitution`", "it must be from 0 to 1, on a coordinate with a limit");
        } else if matches!(stop, Stop::Soft { damping, .. } if damping != 0.0) {
            bad(
                "`restitution`",
                "write either it or `damping` of `stop`: both define the loss of energy",
            );
        }
    }
}

/// Checks the hinge of a loop, on which no damping, friction, spring or stop may act.
pub(crate) fn check_loop_hinge(what: &str, hinge: &Hinge, faults: &mut Vec<MechanismFault>) {
    for (subhinge, s) in hinge.subhinges.iter().enumerate() {
        let soft = matches!(s.stop, Stop::Soft { .. });
        let other = s.spring != Spring::NONE || s.ball != BallLimits::NONE;
        if s.damping != 0.0 || s.friction != Friction::NONE || soft || other {
            faults.push(MechanismFault::NotOnLoop { body: what.to_owned(), subhinge });
        }
    }
}
