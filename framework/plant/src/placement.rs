//! Placement of a machine on the ground: finds root height, attitude and suspension joints such that every wheel just touches.
//!
//! ```text
//! unknowns  z, roll, pitch, chosen joints        residuals minimum gap of the rim of each wheel
//! ```
//! Loops and couplings are closed at each iteration, so that chosen joints in a loop or coupling adapt together.
//! Damped least squares (Levenberg–Marquardt) with numerical derivatives. Afterwards the machine settles under its own forces until it is at rest
//! (`step::settle`), so that a run starts in static equilibrium. This is done once, before a run.
use crate::extension::PlanExt;
use linkwork_dynamics::{Workspace, kinematics};
use linkwork_multibody::{Body, BodyId, Multibody, SubhingeKind};
use linkwork_runtime::host::{SettleGroup, settle};
use linkwork_runtime::{Fault, Origin, Plan};
use linkwork_solvers::{Projector, footing};
use linkwork_spatial::nalgebra::{DMatrix, DVector};
use linkwork_spatial::{Quat, Vec3};
use linkwork_surroundings::Terrain;

/// Placement of a machine on the ground.
#[derive(Clone, Debug)]
pub struct Placement {
    /// The free root body.
    pub body: String,
    /// x, y of the root body's origin, W (m).
    pub at: [f64; 2],
    /// Heading about W's z (rad).
    pub heading: f64,
    /// Wheels: body name and radius (m); the body's origin is the hub.
    pub wheels: Vec<(String, f64)>,
    /// Bodies whose pin hinges adapt to the ground.
    pub joints: Vec<String>,
}

/// Error: a machine cannot be placed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("placing on terrain: {message}\n  help: {help}")]
pub struct PlaceError {
    /// Error message.
    pub message: String,
    /// Remedy.
    pub help: String,
}

fn error<T>(message: String, help: &str) -> Result<T, PlaceError> {
    Err(PlaceError { message, help: help.to_string() })
}

/// Pose of a machine whose wheels just touch the ground, before it settles.
#[derive(Clone, Debug)]
#[must_use = "give it to `settle_placed`"]
pub struct Placed {
    /// Largest gap of a wheel, m.
    pub gap: f64,
    body: String,
    joints: Vec<String>,
    /// Indices of the rates of the machine, and of its joints that always adapt, in the order of the mechanism.
    own: Vec<usize>,
    adapting: Vec<usize>,
}

/// Changes the plan's initial coordinates so that the wheels of a machine just touch. All machines of a plan are placed before they settle
/// ([`settle_placed`]), so that none penetrates the ground meanwhile.
///
/// # Errors
/// Returns an error for unknown bodies, a root that is not free, missing ground under a wheel, no convergence, or a failure of the terrain.
pub fn place_on_terrain(
    plan: &mut Plan,
    terrain: &dyn Terrain,
    p: &Placement,
) -> Result<Placed, PlaceError> {
    let placed = put_down(plan, terrain, p);
    match terrain.failure(0.0) {
        Some(told) => error(told.message, told.help.as_deref().unwrap_or_default()),
        None => placed,
    }
}

fn put_down(plan: &mut Plan, terrain: &dyn Terrain, p: &Placement) -> Result<Placed, PlaceError> {
    let Some(mechanism) = plan.mechanism_mut() else {
        return error(
            "there is no mechanism, or it is already running".into(),
            "place before the run",
        );
    };
    let mb = mechanism.multibody.clone();
    let find = |name: &str| match mb.body(name) {
        Some(id) => Ok(id),
        None => {
            let known: Vec<&str> = mb.bodies().iter().map(|b| b.name()).collect();
            error(
                format!("there is no body `{name}`"),
                &linkwork_runtime::remedy(name, "bodies", &known),
            )
        }
    };
    let root = find(&p.body)?;
    let free =
        mb.get(root).subhinges().iter().any(|s| matches!(s.subhinge.kind, SubhingeKind::Free));
    if !free {
        return error(
            format!("`{}` has no free hinge", p.body),
            "place the root body of the machine",
        );
    }
    let at = mb.get(root).q().start;
    // The machine consists of the root and its descendants.
    let mut own: Vec<usize> = mb.get(root).v().collect();
    for id in mb.body_ids() {
        let mut up = mb.get(id).parent();
        while up.is_some_and(|b| b != root) {
            up = up.and_then(|b| mb.get(b).parent());
        }
        if up.is_some() {
            own.extend(mb.get(id).v());
        }
    }
    let mut adapting: Vec<usize> = mb.get(root).v().collect();
    let mut joints = Vec::new();
    for name in &p.joints {
        let b = mb.get(find(name)?);
        match (b.q().len(), b.subhinges().first().map(|s| s.subhinge.kind)) {
            (1, Some(SubhingeKind::Pin { .. })) => {
                joints.push(b.q().start);
                adapting.extend(b.v());
            }
            _ => return error(format!("`{name}` is not on a pin hinge"), "list pins only"),
        }
    }
    let wheels: Vec<(BodyId, f64)> =
        p.wheels.iter().map(|(n, r)| Ok((find(n)?, *r))).collect::<Result<_, _>>()?;
    if wheels.is_empty() {
        return error("no wheels are given".into(), "list the wheel bodies");
    }
    let Some(ground) = terrain.ground(p.at[0], p.at[1]) else {
        return error(
            format!("there is no ground at ({}, {})", p.at[0], p.at[1]),
            &format!("the terrain covers {:?} (x_min, y_min, x_max, y_max)", terrain.bounds()),
        );
    };
    let mut ws = Workspace::new(&mechanism.tree);
    let tree = mechanism.tree.clone();
    let start = mechanism.q.clone();
    let zeros = vec![0.0; mb.nv()];
    let set = |u: &DVector<f64>, q: &mut Vec<f64>| {
        q.clone_from(&start);
        let rotation = Quat::from_axis_angle(&Vec3::z_axis(), p.heading)
            * Quat::from_euler_angles(u[1], u[2], 0.0);
        q[at..at + 3].copy_from_slice(&[p.at[0], p.at[1], u[0]]);
        q[at + 3..at + 7].copy_from_slice(rotation.coords.as_slice());
        for (k, j) in joints.iter().enumerate() {
            q[*j] = start[*j] + u[3 + k];
        }
    };
    let mut q = start.clone();
    let motions = mechanism.loop_motions.clone();
    let (mut solver, mut projector) = (mechanism.solver.clone(), Projector::new(&tree));
    let mut gaps = |u: &DVector<f64>, q: &mut Vec<f64>| -> Result<DVector<f64>, PlaceError> {
        set(u, q);
        // Joints in loops and couplings adapt together.
        if let Some(solver) = &mut solver
            && let Err(e) = projector.positions(&tree, &mut ws, solver, &motions, q)
        {
            let (fact, help) = linkwork_runtime::told(&e);
            return error(fact, &help.unwrap_or_default());
        }
        kinematics(&tree, &mut ws, q, &zeros);
        let mut e = DVector::zeros(wheels.len());
        for (k, (id, radius)) in wheels.iter().enumerate() {
            let pose = ws.body_pose(&tree, *id);
            let mut ground = |x: f64, y: f64| terrain.ground(x, y).map(|g| (g.height, g.normal));
            let Some(foot) = footing(&mut ground, &pose, *radius) else {
                let c = pose.position;
                return error(
                    format!(
                        "there is no ground under `{}` at ({:.3}, {:.3})",
                        p.wheels[k].0, c.x, c.y
                    ),
                    "start at a position at which the map has data",
                );
            };
            e[k] = foot.gap;
        }
        Ok(e)
    };
    let n = 3 + joints.len();
    let mut u = DVector::zeros(n);
    u[0] = ground.height + 1.0;
    let mut damping = 1e-4;
    let mut e = gaps(&u, &mut q)?;
    for _ in 0..100 {
        let mut jacobian = DMatrix::zeros(wheels.len(), n);
        for k in 0..n {
            let mut moved = u.clone();
            moved[k] += 1e-6;
            let column = (gaps(&moved, &mut q)? - &e) / 1e-6;
            jacobian.set_column(k, &column);
        }
        let mut normal = jacobian.transpose() * &jacobian;
        for k in 0..n {
            normal[(k, k)] += damping;
        }
        let Some(step) = normal.cholesky().map(|c| c.solve(&(-jacobian.transpose() * &e))) else {
            damping *= 10.0;
            continue;
        };
        let next = &u + &step;
        let better = gaps(&next, &mut q)?;
        if better.norm() < e.norm() {
            (u, e) = (next, better);
            damping = (damping * 0.2).max(1e-9);
            if step.norm() < 1e-10 {
                break;
            }
        } else {
            damping *= 10.0;
            if damping > 1e8 {
                break;
            }
        }
    }
    // Lift the machine so that no wheel starts inside the ground.
    u[0] -= e.min().min(0.0);
    e = gaps(&u, &mut q)?;
    mechanism.q = q;
    let (body, joints) = (p.body.clone(), p.joints.clone());
    Ok(Placed { gap: e.amax(), body, joints, own, adapting })
}

/// Brings all placed machines to static equilibrium in one run, and changes the plan's initial coordinates and initial states of parts accordingly. A
/// machine that does not come to rest starts where its wheels touch, with a warning at the given source position.
pub fn settle_placed(plan: &mut Plan, placed: &[(Origin, Placed)]) {
    let Some(mechanism) = plan.mechanism() else { return };
    let (mb, put, first) = (mechanism.multibody.clone(), mechanism.q.clone(), mechanism.x);
    let nq = mb.nq();
    let lanes = (first..first + nq, first + nq..first + nq + mb.nv());
    let at = |lanes: &[usize]| lanes.iter().map(|lane| lane + first + nq).collect();
    let machines: Vec<SettleGroup> = placed
        .iter()
        .map(|(_, p)| SettleGroup { own: at(&p.own), adapting: at(&p.adapting) })
        .collect();
    let rests = settle(plan, lanes.clone(), &machines);
    let q = plan.rest.as_ref().map(|rest| rest.x[lanes.0].to_vec());
    for ((origin, placed), rests) in placed.iter().zip(rests) {
        match (&q, rests) {
            (Some(q), true) => placed.warn_of_sagging(plan, *origin, &mb, (&put, q)),
            _ => placed.warn_of_moving(plan, *origin),
        }
    }
    if let (Some(mechanism), Some(q)) = (plan.mechanism_mut(), q) {
        mechanism.q = q;
    }
}

impl Placed {
    fn warn_of_moving(&self, plan: &mut Plan, origin: Origin) {
        let (what, help) = match plan.steps.is_empty() {
            true => (
                "does not rest there",
                "brake its wheels at the start, or place it where the ground can hold it",
            ),
            // A mechanism with contact by impulses has no derivative to integrate.
            false => (
                "is not brought to rest before the run, because contact by impulses does not support it",
                "let it settle in the first second of the run",
            ),
        };
        let fact = format!("`{}` was placed where its wheels touch and {what}", self.body);
        plan.warnings.push(Fault::new(origin, fact).help(help));
    }

    /// Warns of joints that moved although they were not listed to adapt, because the force that holds them during the run may be missing at the
    /// start.
    fn warn_of_sagging(
        &self,
        plan: &mut Plan,
        origin: Origin,
        mb: &Multibody,
        (from, to): (&[f64], &[f64]),
    ) {
        let meant = |name: &str| name == self.body || self.joints.iter().any(|j| j == name);
        let own = |body: &Body| body.v().all(|k| self.own.contains(&k));
        for body in mb.bodies().iter().filter(|b| own(b) && !meant(b.name())) {
            let most = body.q().map(|k| (to[k] - from[k]).abs()).fold(0.0, f64::max);
            if most > SAGS {
                let fact = format!(
                    "the hinge of `{}` moved by {most:.2} (rad or m) while `{}` came to rest before the run",
                    body.name(),
                    self.body
                );
                let help = "hold it with a brake, a spring or a prescribed motion; or list it in `joints` if this is intended";
                plan.warnings.push(Fault::new(origin, fact).help(help));
            }
        }
    }
}

/// Motion of a joint during settling (rad or m) above which a warning is reported.
const SAGS: f64 = 0.05;
