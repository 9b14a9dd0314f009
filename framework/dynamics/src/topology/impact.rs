//! Momentum and energy of a scene, and the inelastic impact when a new hinge is connected.
//!
//! Bodies have velocities V⁻ that the new hinge may not permit. Of all velocities that it permits, the impact yields those that change least in the
//! metric of mass:
//! ```text
//! minimise ½ Σ_b (V_b − V_b⁻)* M_b (V_b − V_b⁻)   over V = J β       ⇔      M β = Jᵀ M V⁻
//! ```
//! This is the impulse law for a joint whose impulse acts only at the joint: because no other impulse acts, momentum is conserved and the energy ½ (V
//! − V⁻)* M (V − V⁻) is lost. From an initial guess β₀ = (kept rates, nearest rates of the new hinge) it is computed with one articulated-body sweep
//! with the impulses M_b (V_b⁻ − V_b⁰) on the bodies:
//! ```text
//! β = β₀ + M⁻¹ Jᵀ M (V⁻ − J β₀)
//! ```
//! Prescribed rates stay as in β₀. Rotors (armature) of kept hinges keep spinning and take part; the rotor of the new hinge spins as in β₀.

use super::scene::Scene;
use super::{Report, TopologyError};
use crate::forward::forward_dynamics;
use crate::momentum::kinetic_energy;
use crate::tree::Tree;
use crate::work::Workspace;
use linkwork_multibody::BodyId;
use linkwork_spatial::{Force, Motion, Vec3};

/// V − V⁻ relative to the largest velocity that counts as round-off, so that there is no impact.
const ROUNDING: f64 = 1e-14;

/// Returns M V of a body about its origin, world axes.
fn momentum_of(tree: &Tree, ws: &Workspace, body: BodyId, V: &Motion) -> Force {
    let R = ws.body_rotation(tree, body);
    tree.multibody().get(body).inertia().rotate_by(&R).apply(V)
}

/// Returns the momentum of bodies about a point of the world.
fn momentum_about(
    tree: &Tree,
    ws: &Workspace,
    bodies: impl Iterator<Item = BodyId>,
    point: &Vec3,
) -> Force {
    let mut total = Force::zero();
    for body in bodies {
        let p = momentum_of(tree, ws, body, &ws.body_velocity(tree, body));
        total += p.shift_to_parent(&(ws.body_pose(tree, body).position - point));
    }
    total
}

/// Reports the effect of an edit about a point of the world; `taken` is the body that now hangs on a new hinge.
pub(super) fn report(before: &Scene, after: &Scene, point: Vec3, taken: Option<&str>) -> Report {
    let ((tree0, ws0), (tree1, ws1)) = (before.moving(), after.moving());
    let total =
        |tree: &Tree, ws: &Workspace| momentum_about(tree, ws, tree.multibody().body_ids(), &point);
    let mut impulse = Force::zero();
    if let Some(body) = taken.and_then(|name| after.mbs.body(name)) {
        let names = after.mbs.subtree(body).map(|b| after.mbs.get(b).name());
        let old = names.filter_map(|name| before.mbs.body(name));
        let now = momentum_about(&tree1, &ws1, after.mbs.subtree(body), &point);
        impulse = now - momentum_about(&tree0, &ws0, old, &point);
    }
    Report {
        point,
        momentum_before: total(&tree0, &ws0),
        momentum_after: total(&tree1, &ws1),
        impulse,
        energy_before: kinetic_energy(&tree0, &ws0, &before.v),
        energy_after: kinetic_energy(&tree1, &ws1, &after.v),
    }
}

/// Sets the rates of `after` to those after the impact of the velocities in `before`; returns whether there was one. Loops and couplings are ignored.
pub(super) fn take_hold(before: &Scene, after: &mut Scene) -> Result<bool, TopologyError> {
    let ((tree0, ws0), (tree, mut ws)) = (before.moving(), after.moving());
    let (mut fastest, mut worst) = (0.0_f64, 0.0_f64);
    let mut impulses = Vec::with_capacity(after.mbs.bodies().len());
    for body in after.mbs.body_ids() {
        let guess = ws.body_velocity(&tree, body);
        let Some(old) = before.mbs.body(after.mbs.get(body).name()) else { continue };
        let V = ws0.body_velocity(&tree0, old);
        let missing = V - guess;
        fastest = fastest.max(V.angular.norm()).max(V.linear.norm());
        worst = worst.max(missing.angular.norm()).max(missing.linear.norm());
        impulses.push((body, momentum_of(&tree, &ws, body, &missing)));
    }
    if worst <= ROUNDING * fastest {
        return Ok(false);
    }
    let at_rest = vec![0.0; after.mbs.nv()];
    let (mut tau, mut change) = (at_rest.clone(), at_rest.clone());
    crate::kinematics::kinematics(&tree, &mut ws, &after.q, &at_rest);
    ws.clear_forces();
    for (body, impulse) in impulses {
        ws.add_wrench_at_body(&tree, body, impulse);
    }
    forward_dynamics(&tree, &mut ws, &after.q, &at_rest, &mut tau, &mut change)?;
    after.v.iter_mut().zip(&change).for_each(|(v, d)| *v += d);
    Ok(true)
}
