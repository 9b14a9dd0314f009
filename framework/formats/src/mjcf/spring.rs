//! `springdamper="T ζ"` of a joint: stiffness and damping from the inertia that the joint moves.
//!
//! ```text
//! I = n / Σ (M⁻¹)ᵢᵢ         over the n rates of the joint, M at the reference configuration with armature
//! k = I / (T ζ)²            d = 2 I / T
//! ```

use super::Mj;
use super::inside::Inside;
use crate::Description;
use crate::read::Cx;
use linkwork_multibody::{Multibody, SubhingeKind};
use linkwork_spatial::nalgebra::{Cholesky, DMatrix, Matrix6xX};
use linkwork_spatial::{Pose, Vec3};

/// Maximum number of rates for which the mass matrix is computed here.
const RATES: usize = 2000;

impl<'e> Mj<'e> {
    /// Stores the `springdamper` of a joint until all bodies are known.
    pub(super) fn spring_damper(&mut self, cx: &mut Cx<'_>, i: &Inside<'e>, name: &str) {
        if i.e.name != "joint" {
            return;
        }
        let at = self.classed(cx, i.e, i.class);
        let what = format!("joint `{name}`");
        let Some(both) = self.numbers::<2>(cx, at, "springdamper", &what) else { return };
        // MuJoCo ignores a pair unless both numbers are positive.
        if both.iter().all(|x| *x > 0.0) {
            let place = self.attr(at, "springdamper").map_or(i.e.place(), |(_, place)| place);
            self.spring_dampers.push((name.to_owned(), both, place));
        }
    }

    /// Replaces stiffness and damping of the joints that have a `springdamper`.
    pub(super) fn spring_dampers(&self, cx: &mut Cx<'_>, d: &mut Description) {
        if self.spring_dampers.is_empty() || !cx.faults.is_empty() {
            return;
        }
        let Ok(mbs) = d.builder.build() else { return }; // this error is reported at the end
        let M = moving(&mbs, &d.configuration(&mbs)).map(|m| m.M);
        let Some(inverse) = M.and_then(Cholesky::new).map(|c| c.inverse()) else {
            let (name, _, place) = &self.spring_dampers[0];
            let what = format!(
                "joint `{name}` has a `springdamper`, but the mass matrix of {} rates cannot be inverted",
                mbs.nv()
            );
            let help =
                "add a mass to every moving body, or write `stiffness` and `damping`".to_owned();
            cx.fault(place.clone(), crate::error::FaultKind::Unsupported { what, help });
            return;
        };
        for (name, [time, ratio], place) in &self.spring_dampers {
            let found = d.joints.iter_mut().find(|j| j.name == *name);
            let Some(joint) = found else { continue };
            let Some(body) = mbs.body(&joint.body) else { continue };
            let rates = mbs.get(body).subhinges()[joint.subhinge].v.clone();
            if joint.count != 1 || rates.len() == 6 {
                let note = "springdamper of a free joint";
                let ignored = crate::Ignored {
                    file: place.file.clone(),
                    line: place.line,
                    path: format!("joint `{name}`"),
                    what: note.into(),
                };
                cx.ignored.push(ignored);
                continue;
            }
            let n = rates.len() as f64;
            let inertia = n / rates.map(|i| inverse[(i, i)]).sum::<f64>();
            joint.stiffness = inertia / (time * ratio).powi(2);
            joint.damping = 2.0 * inertia / time;
            let spec = d.builder.bodies_mut().iter_mut().find(|b| b.name == joint.body);
            let Some(spec) = spec else { continue };
            let own = &mut spec.hinge.subhinges[joint.subhinge];
            own.spring.stiffness = joint.stiffness;
            own.spring.rest = joint.spring_reference;
            own.damping = joint.damping;
        }
    }
}

/// Motion of a mechanism at a configuration.
pub(super) struct Moving {
    /// The mass matrix, with armature.
    pub M: DMatrix<f64>,
    /// Each column is the velocity of the moved bodies for a unit rate: angular velocity, and velocity of the world's origin.
    pub columns: Matrix6xX<f64>,
    /// Poses of the bodies.
    pub poses: Vec<Pose>,
}

/// Returns the motion of the mechanism at q, or `None` for more than 2000 rates.
pub(super) fn moving(mbs: &Multibody, q: &[f64]) -> Option<Moving> {
    let n = mbs.nv();
    if n > RATES {
        return None;
    }
    let mut M = DMatrix::<f64>::zeros(n, n);
    let poses = mbs.body_poses(q);
    // Each column of the whole tree has the axis of rotation and the velocity of the world's
    // origin.
    let mut columns = Matrix6xX::<f64>::zeros(n);
    let bodies: Vec<_> = mbs.body_ids().collect();
    for &b in &bodies {
        let body = mbs.get(b);
        let parent = body.parent().map_or(Pose::identity(), |p| poses[p.index()]);
        let mut X = parent * body.hinge_in_parent();
        for s in body.subhinges() {
            let next = X * s.subhinge.kind.pose(&q[s.q.clone()]);
            let own = motions(&s.subhinge.kind, &X, &next);
            for (k, (w, v)) in s.v.clone().zip(own) {
                columns.fixed_view_mut::<3, 1>(0, k).copy_from(&w);
                columns.fixed_view_mut::<3, 1>(3, k).copy_from(&v);
                M[(k, k)] += s.subhinge.reflected_inertia();
            }
            X = next;
        }
    }
    for &b in &bodies {
        let (body, X) = (mbs.get(b), poses[b.index()]);
        let mass = body.mass_properties();
        let c = X.transform_point(&mass.com);
        let R = X.rotation.to_rotation_matrix().into_inner();
        let J = R * mass.inertia_com * R.transpose();
        let rates: Vec<usize> = mbs.ancestors(b).flat_map(|a| mbs.get(a).v()).collect();
        let moving: Vec<(Vec3, Vec3)> = (rates.iter())
            .map(|k| {
                let w: Vec3 = columns.fixed_view::<3, 1>(0, *k).into_owned();
                let v: Vec3 = columns.fixed_view::<3, 1>(3, *k).into_owned();
                (w, v + w.cross(&c))
            })
            .collect();
        for (i, (w, v)) in rates.iter().zip(&moving) {
            let (h, p) = (J * w, v * mass.mass);
            for (j, (w2, v2)) in rates.iter().zip(&moving) {
                M[(*i, *j)] += h.dot(w2) + p.dot(v2);
            }
        }
    }
    Some(Moving { M, columns, poses })
}

/// Returns the angular velocity and the velocity of the world's origin for a unit rate of each coordinate.
fn motions(kind: &SubhingeKind, X: &Pose, next: &Pose) -> Vec<(Vec3, Vec3)> {
    let turn = |pose: &Pose, axis: Vec3| {
        let w = pose.transform_vector(&axis);
        (w, pose.position.cross(&w))
    };
    let slide = |axis: &Vec3| (Vec3::zeros(), X.transform_vector(axis));
    let unit = [Vec3::x(), Vec3::y(), Vec3::z()];
    match kind {
        SubhingeKind::Pin { axis } => vec![turn(X, *axis)],
        SubhingeKind::Slider { axis } => vec![slide(axis)],
        SubhingeKind::Screw { axis, pitch } => {
            let (w, v) = turn(X, *axis);
            vec![(w, v + slide(axis).1 * *pitch)]
        }
        SubhingeKind::Ball => unit.map(|a| turn(next, a)).to_vec(),
        // Rates of a free hinge in Linkwork are the angular velocity and then the velocity, both in
        // body axes.
        SubhingeKind::Free => {
            let linear = unit.map(|a| (Vec3::zeros(), next.transform_vector(&a)));
            unit.map(|a| turn(next, a)).into_iter().chain(linear).collect()
        }
        SubhingeKind::Locked => Vec::new(),
    }
}
