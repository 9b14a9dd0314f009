//! State of the mechanism in a transition between plans: poses and velocities are kept, and changes of momentum are recorded in the balance.
use crate::gaps::Gaps;
use crate::plan::MechanismPlan;
use linkwork_dynamics::topology::{self, Report};
use linkwork_dynamics::{Tree, Workspace};
use linkwork_multibody::Multibody;
use linkwork_runtime::doc::number;
use linkwork_runtime::host::OldState;
use linkwork_runtime::{Carried, Failure};
use linkwork_solvers::{ConstrainedSolver, ConstraintMethod, Projector};
use linkwork_spatial::Vec3;
use std::borrow::Cow;
use std::sync::Arc;

pub(crate) fn carry(
    new: &MechanismPlan,
    old: &MechanismPlan,
    old_state: OldState<'_>,
    (to, pairs): (&mut [f64], &mut [f64]),
) -> Result<Carried, Box<Failure>> {
    let from = old_state.x;
    if old.fingerprint() == new.fingerprint() {
        to.copy_from_slice(from);
        pairs.copy_from_slice(old_state.d);
        return Ok(Carried::Whole);
    }
    let before = old.present(old_state.sig)?;
    let after = inherit(&before, old, new);
    let (nq, nv) = (old.multibody.nq(), old.multibody.nv());
    let (mq, mv) = (new.multibody.nq(), new.multibody.nv());
    let carried = topology::carry(
        &before,
        (&from[..nq], &from[nq..nq + nv]),
        &after,
        (&to[..mq], &to[mq..mq + mv]),
    )
    .map_err(|e| Failure::of(&e))?;
    to[..mq].copy_from_slice(&carried.q);
    to[mq..mq + mv].copy_from_slice(&carried.v);
    loop_motions(new, old, &from[nq + nv..], &mut to[mq + mv..]);
    let bodies = matches!(after, Cow::Owned(_)).then_some(&*after);
    let fresh = gaps(new, old, &from[nq + nv..], &mut to[mq + mv..]);
    let closed = close(new, bodies, &fresh, to)?;
    let mut notes = Vec::new();
    let list = |what: &str, names: &[String]| {
        (!names.is_empty()).then(|| format!("{what}: {}", names.join(", ")))
    };
    notes.extend(list("on another hinge", &carried.changed));
    notes.extend(list("added", &carried.added));
    notes.extend(list("gone", &carried.gone));
    if closed {
        notes.push(
            "rates were made compatible with the loops and couplings by an inelastic impact".into(),
        );
    }
    if let Some(report) = carried.report.filter(|_| !notes.is_empty()) {
        notes.push(books(&report));
    }
    Ok(Carried::State(notes))
}

/// Returns the new bodies with the present inertias of the old bodies with the same names: the contribution of a new part is unknown before the
/// transition.
fn inherit<'a>(
    before: &Multibody,
    old: &MechanismPlan,
    new: &'a MechanismPlan,
) -> Cow<'a, Multibody> {
    let mut after = Cow::Borrowed(&*new.multibody);
    for varying in &old.varies {
        let body = before.get(varying.body);
        if let Some(id) = new.multibody.body(body.name()) {
            after.to_mut().set_inertia(id, *body.inertia());
        }
    }
    after
}

/// Prescribed motions of loops, by the loop's name.
fn loop_motions(new: &MechanismPlan, old: &MechanismPlan, from: &[f64], to: &mut [f64]) {
    for l in new.multibody.loops() {
        let was = old.multibody.loops().iter().find(|o| o.closure.name == l.closure.name);
        let Some(was) = was.filter(|o| o.motions.len() == l.motions.len()) else { continue };
        for (i, j) in l.motions.clone().zip(was.motions.clone()) {
            to[2 * i..2 * i + 2].copy_from_slice(&from[2 * j..2 * j + 2]);
        }
    }
}

/// Continues the gaps of loops that both mechanisms have; returns the other loops, whose gaps must be computed.
fn gaps<'a>(
    new: &'a MechanismPlan,
    old: &MechanismPlan,
    from: &[f64],
    to: &mut [f64],
) -> Vec<&'a Gaps> {
    let mut fresh = Vec::new();
    for gaps in &new.gaps {
        let closure = |m: &Multibody, g: &Gaps| m.loops()[g.which].closure.clone();
        let here = closure(&new.multibody, gaps);
        match old.gaps.iter().find(|g| closure(&old.multibody, g) == here) {
            None => fresh.push(gaps),
            Some(was) => {
                let (i, j) = (2 * gaps.motions.start, 2 * was.motions.start);
                let n = 2 * gaps.motions.len();
                to[i..i + n].copy_from_slice(&from[j..j + n]);
            }
        }
    }
    fresh
}

/// Projects the state onto the loops and couplings of the new mechanism; `bodies` have other masses than in the file, and the gaps of `fresh` loops
/// are computed. Returns whether rates changed.
fn close(
    new: &MechanismPlan,
    bodies: Option<&Multibody>,
    fresh: &[&Gaps],
    lanes: &mut [f64],
) -> Result<bool, Box<Failure>> {
    let Some(solver) = &new.solver else { return Ok(false) };
    let tree = match bodies {
        None => new.tree.clone(),
        Some(bodies) => Arc::new(Tree::new(bodies)),
    };
    let tree = &*tree;
    let mut solver = solver.clone();
    let (nq, nv) = (new.multibody.nq(), new.multibody.nv());
    let mut motions = new.loop_motions.clone();
    for (i, m) in motions.iter_mut().enumerate() {
        (m.position, m.rate) = (lanes[nq + nv + 2 * i], lanes[nq + nv + 2 * i + 1]);
    }
    let (q, rest) = lanes.split_at_mut(nq);
    let (v, held) = rest.split_at_mut(nv);
    let before = v.to_vec();
    let mut ws = Workspace::new(tree);
    for gaps in fresh {
        gaps.find(tree, &mut ws, &mut solver, (&*q, &*v), &mut motions);
        for i in gaps.motions.clone() {
            held[2 * i..2 * i + 2].copy_from_slice(&[motions[i].position, motions[i].rate]);
        }
    }
    let mut projector = Projector::new(tree);
    let mut close = |solver: &mut ConstrainedSolver, q: &mut [f64], v: &mut [f64]| {
        let placed = projector.positions(tree, &mut ws, solver, &motions, q);
        placed.and_then(|_| projector.rates(tree, &mut ws, solver, &motions, q, v))
    };
    // Masses determine how an impact distributes momentum, independently of `solve`. Without masses, the
    // loops alone determine it.
    let mut rows = ConstrainedSolver::new(tree, |_| ConstraintMethod::Augment);
    let (mut placed, mut shared) = (q.to_vec(), v.to_vec());
    match close(&mut rows, &mut placed, &mut shared) {
        Ok(_) => {
            q.copy_from_slice(&placed);
            v.copy_from_slice(&shared);
        }
        Err(_) => {
            close(&mut solver, q, v).map_err(|e| Failure::of(&e))?;
        }
    }
    let fastest = before.iter().fold(0.0f64, |m, b| m.max(b.abs()));
    Ok(before.iter().zip(&*v).any(|(a, b)| (a - b).abs() > 1e-9 * fastest))
}

/// Change of a quantity, relative to the quantity, below which a report says that it is unchanged.
const SAME: f64 = 1e-9;

/// Formats momentum and energy for a report.
fn books(r: &Report) -> String {
    let (before, after) = (&r.momentum_before, &r.momentum_after);
    let vector = |v: &Vec3| {
        // Components that are round-off of the others are printed as 0.
        let part = |x: f64| number(if x.abs() < SAME * v.norm() { 0.0 } else { x });
        format!("({}, {}, {})", part(v.x), part(v.y), part(v.z))
    };
    let change = |a: &Vec3, b: &Vec3, scale: f64, unit: &str| {
        let (from, to) = (vector(a), vector(b));
        match (b - a).norm() <= SAME * a.norm().max(b.norm()).max(scale) {
            true => format!("{from} {unit}, unchanged"),
            false => format!("{from} → {to} {unit}"),
        }
    };
    let linear = change(&before.force, &after.force, 0.0, "N s");
    let point = vector(&r.point);
    let about = format!("N m s about {point} m");
    let angular = change(&before.moment, &after.moment, before.force.norm(), &about);
    let (from, to) = (r.energy_before, r.energy_after);
    let energy = match (to - from).abs() <= SAME * from.abs().max(to.abs()) {
        true => format!("{} J, unchanged", number(from)),
        false => format!("{} → {} J", number(from), number(to)),
    };
    format!("momentum {linear}; angular momentum {angular}; energy {energy}")
}
