//! Transfers the state of one mechanism to another with bodies of the same names.
use super::joint::Joint;
use super::scene::{Scene, free_state};
use super::{Report, TopologyError, check_state, impact};
use crate::frames::{Frames, FramesError};
use linkwork_multibody::{BodyId, Coordinate, Multibody, SubhingeKind};
use linkwork_spatial::{Motion, Pose};

/// State of a mechanism after the transfer.
#[derive(Clone, Debug, PartialEq)]
pub struct Carried {
    /// Configuration (nq of the new mechanism).
    pub q: Vec<f64>,
    /// Rates (nv).
    pub v: Vec<f64>,
    /// Bodies whose hinge differs from before.
    pub changed: Vec<String>,
    /// Bodies that did not exist before.
    pub added: Vec<String>,
    /// Bodies that do not exist any more.
    pub gone: Vec<String>,
    /// Momentum and energy of all bodies before and after; `None` for flexible mechanisms.
    pub report: Option<Report>,
}

/// Transfers the state of `old` to `new`. Bodies are matched by name. A body on the same hinge keeps its coordinates exactly. A body on another hinge
/// keeps its pose and motion; the part of the motion that the new hinge does not permit is removed by an inelastic impact. A new body gets the state
/// given in `start`. Prescribed coordinates of a different hinge are computed from the pose of the body, and their rates are those of `start`; a
/// prescribed free hinge that starts at rest therefore grasps a body at any pose. Prescribed coordinates of the same hinge that were free before also
/// keep their values, so that a body that is now held at rest does not jump.
///
/// # Errors
/// [`TopologyError::Length`] and [`TopologyError::NotFinite`] for an invalid state; [`TopologyError::Unreachable`] when the new hinge cannot reach
/// the pose of a body; [`TopologyError::Unknown`] when an existing body hangs on a new one; [`TopologyError::Flexible`] when a flexible mechanism
/// would take part in an impact.
pub fn carry(
    old: &Multibody,
    state: (&[f64], &[f64]),
    new: &Multibody,
    start: (&[f64], &[f64]),
) -> Result<Carried, TopologyError> {
    check_state("the mechanism", (state.0, old.nq()), (state.1, old.nv()))?;
    check_state("the new mechanism", (start.0, new.nq()), (start.1, new.nv()))?;
    let (mut q, mut v) = (start.0.to_vec(), start.1.to_vec());
    let (mut changed, mut added) = (Vec::new(), Vec::new());
    let mut seen = PreviousState { old, state, frames: None };
    for id in new.body_ids() {
        let body = new.get(id);
        let Some(from) = old.body(body.name()) else {
            added.push(body.name().to_owned());
            continue;
        };
        let was = old.get(from);
        if (body.modes_q().len(), body.modes_v().len())
            == (was.modes_q().len(), was.modes_v().len())
        {
            q[body.modes_q()].copy_from_slice(&state.0[was.modes_q()]);
            v[body.modes_v()].copy_from_slice(&state.1[was.modes_v()]);
        }
        if same_hinge((old, from), (new, id)) {
            q[body.q()].copy_from_slice(&state.0[was.q()]);
            v[body.v()].copy_from_slice(&state.1[was.v()]);
            let mut held = false;
            for (s, was) in body.subhinges().iter().zip(was.subhinges()) {
                let prescribed = |c: Coordinate| c == Coordinate::Prescribed;
                if prescribed(s.subhinge.coordinate) && !prescribed(was.subhinge.coordinate) {
                    v[s.v.clone()].copy_from_slice(&start.1[s.v.clone()]);
                    held = true;
                }
            }
            if held {
                changed.push(body.name().to_owned());
            }
            continue;
        }
        changed.push(body.name().to_owned());
        let (hq, hv) = seen.hinge(new, id, from)?;
        q[body.q()].copy_from_slice(&hq);
        v[body.v()].copy_from_slice(&hv);
        // Prescribed coordinates have their prescribed rates from now on.
        for s in body.subhinges() {
            if s.subhinge.coordinate == Coordinate::Prescribed {
                v[s.v.clone()].copy_from_slice(&start.1[s.v.clone()]);
            }
        }
    }
    let gone = old.bodies().iter().filter(|b| new.body(b.name()).is_none());
    let gone: Vec<String> = gone.map(|b| b.name().to_owned()).collect();
    let before = Scene { mbs: old.clone(), q: state.0.to_vec(), v: state.1.to_vec() };
    let mut after = Scene { mbs: new.clone(), q, v };
    let holds = changed.iter().any(|name| new.body(name).is_some_and(|b| !new.get(b).is_free()));
    let flexible = [old, new].iter().find_map(|m| m.bodies().iter().find(|b| b.modes().is_some()));
    let mut report = None;
    match flexible {
        Some(body) if holds => {
            return Err(TopologyError::Flexible { body: body.name().to_owned() });
        }
        Some(_) => {}
        None => {
            if holds {
                impact::take_hold(&before, &mut after)?;
            }
            let about = changed.iter().chain(&gone).find_map(|name| old.body(name));
            let poses = old.body_poses(state.0);
            let about = about.or_else(|| old.body_ids().next());
            let point =
                about.map_or_else(linkwork_spatial::Vec3::zeros, |b| poses[b.index()].position);
            report = Some(impact::report(&before, &after, point, None));
        }
    }
    let Scene { q, v, .. } = after;
    Ok(Carried { q, v, changed, added, gone, report })
}

/// Returns true for the same parent, frames and subhinges; which subhinges are prescribed has no effect.
fn same_hinge((old, a): (&Multibody, BodyId), (new, b): (&Multibody, BodyId)) -> bool {
    let (a, b) = (old.spec(a), new.spec(b));
    let kinds = |h: &linkwork_multibody::Hinge| -> Vec<SubhingeKind> {
        h.subhinges.iter().map(|s| s.kind).collect()
    };
    a.parent == b.parent
        && a.hinge_in_parent == b.hinge_in_parent
        && a.hinge_in_body == b.hinge_in_body
        && kinds(&a.hinge) == kinds(&b.hinge)
}

/// The old mechanism, which is evaluated where a hinge has changed.
struct PreviousState<'a> {
    old: &'a Multibody,
    state: (&'a [f64], &'a [f64]),
    frames: Option<Scene>,
}

impl PreviousState<'_> {
    /// Returns coordinates and rates of the new hinge of a body that existed as `from`.
    fn hinge(
        &mut self,
        new: &Multibody,
        id: BodyId,
        from: BodyId,
    ) -> Result<(Vec<f64>, Vec<f64>), TopologyError> {
        let spec = new.spec(id);
        let parent = match spec.parent.as_str() {
            "world" => None,
            name => Some(self.old.body(name).ok_or_else(|| TopologyError::Unknown {
                action: "go over",
                name: name.to_owned(),
                help: "an existing body can be attached only to another existing body or to the world",
            })?),
        };
        let (X, V) = self.pair(parent, from)?;
        let plain = spec.hinge_in_parent == Pose::identity()
            && spec.hinge_in_body == Pose::identity()
            && spec.hinge.subhinges.len() == 1
            && spec.hinge.subhinges[0].kind == SubhingeKind::Free;
        if plain {
            return Ok(free_state(&X, &V));
        }
        let mut joint = Joint::new(&spec)?;
        let q = joint.solve(&X, &spec.name)?;
        let v = joint.rates(&q, &V);
        Ok((q, v))
    }

    /// Returns pose and velocity of a body relative to another, or the world, in the axes of the latter.
    fn pair(
        &mut self,
        parent: Option<BodyId>,
        body: BodyId,
    ) -> Result<(Pose, Motion), TopologyError> {
        let flexible = self.old.is_flexible();
        if flexible {
            return Ok(self.through_the_world(parent, body));
        }
        let answer = || {
            let mut frames = Frames::new();
            let world = frames.world();
            let m = frames.add_mechanism("", self.old, world)?;
            frames.set_q(m, self.state.0)?;
            frames.set_v(m, self.state.1)?;
            let a = match parent {
                None => world,
                Some(p) => frames.body_named(m, self.old.get(p).name())?,
            };
            let b = frames.body_named(m, self.old.get(body).name())?;
            let pair = frames.pair(a, b)?;
            Ok((frames.pose(pair), frames.velocity(pair)))
        };
        answer().map_err(|e: FramesError| TopologyError::NotFinite {
            place: format!("body `{}` ({e})", self.old.get(body).name()),
        })
    }

    /// Computes the same from world poses, which also exist for flexible bodies.
    fn through_the_world(&mut self, parent: Option<BodyId>, body: BodyId) -> (Pose, Motion) {
        let scene = self.frames.get_or_insert_with(|| Scene {
            mbs: self.old.clone(),
            q: self.state.0.to_vec(),
            v: self.state.1.to_vec(),
        });
        let (tree, ws) = scene.moving();
        let (X_WB, V_B) = (ws.body_pose(&tree, body), ws.body_velocity(&tree, body));
        let Some(parent) = parent else { return (X_WB, V_B) };
        let (X_WP, V_P) = (ws.body_pose(&tree, parent), ws.body_velocity(&tree, parent));
        let p_PB = X_WB.position - X_WP.position;
        let carried = V_P.linear + V_P.angular.cross(&p_PB);
        let relative = Motion::new(V_B.angular - V_P.angular, V_B.linear - carried);
        (X_WP.inverse() * X_WB, relative.rotate(&X_WP.rotation.inverse()))
    }
}
