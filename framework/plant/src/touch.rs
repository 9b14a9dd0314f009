//! Load of contact on each body: the sum of the forces on its colliders, and the point at which it acts.
use linkwork_collision::{ColliderId, Colliders, SurfaceVelocities};
use linkwork_multibody::BodyId;
use linkwork_solvers::{CompliantContact, ContactStepper, PairLoad};
use linkwork_spatial::Vec3;

/// Signal lanes of each body: force, point.
pub(crate) const LANES: usize = 6;

/// Returns the bodies with a collider, in their order. If the rules exclude all pairs of a body, nothing touches it: a phase in which a pair is
/// ignored reports zero force, so that logs and views do not keep the value of the phase before.
pub(crate) fn touched(colliders: Option<&Colliders>) -> Vec<BodyId> {
    let Some(all) = colliders else { return Vec::new() };
    let mut out: Vec<BodyId> = all.ids().filter_map(|c| all.body(c)).collect();
    out.sort_unstable();
    out.dedup();
    out
}

/// Returns the colliders of each body whose surface velocity comes from a part.
pub(crate) fn belts(bodies: &[BodyId], colliders: Option<&Colliders>) -> Vec<Vec<ColliderId>> {
    let of = |body: &BodyId| {
        let all = colliders.into_iter().flat_map(|c| c.ids().map(move |id| (c.body(id), id)));
        all.filter(|(of, _)| *of == Some(*body)).map(|(_, id)| id).collect()
    };
    bodies.iter().map(of).collect()
}

/// Sets the velocities of surfaces, for either kind of contact.
pub(crate) fn surfaces<'a>(
    stepper: &'a mut Option<ContactStepper>,
    compliant: &'a mut Option<CompliantContact>,
) -> Option<&'a mut SurfaceVelocities> {
    match stepper {
        Some(stepper) => Some(&mut stepper.surfaces),
        None => compliant.as_mut().map(|contact| &mut contact.surfaces),
    }
}

/// A pair of bodies: force on the first from the second, or from the world.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Pair {
    pub of: BodyId,
    pub from: Option<BodyId>,
}

/// Sums loads into the lanes of pairs of bodies.
pub(crate) fn put_pairs(
    pairs: &[Pair],
    loads: impl Iterator<Item = PairLoad> + Clone,
    origin: impl Fn(BodyId) -> Vec3,
    lanes: &mut [f64],
) {
    for (pair, lanes) in pairs.iter().zip(lanes.chunks_exact_mut(LANES)) {
        let (of, mut force, mut moment, mut weight) =
            (Some(pair.of), Vec3::zeros(), Vec3::zeros(), 0.0);
        for load in loads.clone() {
            let sign = match (load.body_a, load.body_b) {
                (a, b) if b == of && a == pair.from => 1.0,
                (a, b) if a == of && b == pair.from => -1.0,
                _ => continue,
            };
            force += sign * load.force;
            moment += load.pressure * load.point;
            weight += load.pressure;
        }
        let point = if weight > 0.0 { moment / weight } else { origin(pair.of) };
        for k in 0..3 {
            (lanes[k], lanes[3 + k]) = (force[k], point[k]);
        }
    }
}

/// Loads of compliant contact.
pub(crate) fn of_forces(contact: &CompliantContact) -> impl Iterator<Item = PairLoad> + Clone {
    contact.loads().iter().copied()
}

/// Computes the mean loads of a step of `h` s from impulses.
pub(crate) fn of_impulses(
    stepper: &ContactStepper,
    h: f64,
) -> impl Iterator<Item = PairLoad> + Clone {
    let impulses = stepper.warm().iter().zip(stepper.impacts());
    stepper.points().iter().zip(impulses).map(move |(p, (steady, impact))| {
        let force = (steady.impulse + impact) / h;
        let pressure = force.dot(&p.normal).max(0.0);
        PairLoad {
            body_a: p.body_a,
            body_b: p.body_b,
            force,
            point: p.point,
            pressure,
            surface_power: 0.0,
        }
    })
}

/// Sums loads into the lanes of the bodies; `weights` has a number for each.
pub(crate) fn put(
    touched: &[BodyId],
    loads: impl Iterator<Item = PairLoad>,
    origin: impl Fn(BodyId) -> Vec3,
    weights: &mut [f64],
    lanes: &mut [f64],
) {
    lanes.fill(0.0);
    weights.fill(0.0);
    for load in loads {
        for (body, sign) in [(load.body_a, -1.0), (load.body_b, 1.0)] {
            let Some(k) = body.and_then(|b| touched.binary_search(&b).ok()) else { continue };
            weights[k] += load.pressure;
            let lanes = &mut lanes[LANES * k..LANES * (k + 1)];
            for i in 0..3 {
                lanes[i] += sign * load.force[i];
                lanes[3 + i] += load.pressure * load.point[i];
            }
        }
    }
    for ((body, weight), lanes) in
        touched.iter().zip(weights.iter()).zip(lanes.chunks_exact_mut(LANES))
    {
        let origin = if *weight > 0.0 { Vec3::zeros() } else { origin(*body) };
        for i in 0..3 {
            lanes[3 + i] = if *weight > 0.0 { lanes[3 + i] / weight } else { origin[i] };
        }
    }
}
