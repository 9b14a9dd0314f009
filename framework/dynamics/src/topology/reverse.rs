//! Reversal of a hinge: the same motion, with parent and child exchanged.
//!
//! ```text
//! X_BP = X_BJ Sₙ⁻¹ … S₁⁻¹ X_PJ⁻¹                 the frames exchange places, the chain is reversed
//! pin, slider, screw   axis → −axis                       q and β unchanged
//! ball                 R → R⁻¹                            ω → −R ω
//! free                 X → X⁻¹                            ω → −R ω,  v → (R ω) × p − R v
//! ```

use super::scene::{Part, Parts};
use linkwork_multibody::{BodySpec, Hinge, Subhinge, SubhingeKind};
use linkwork_spatial::nalgebra::Quaternion;
use linkwork_spatial::{Quat, Vec3};

/// Returns the hinge of `child` as a hinge of its parent, `parent`, on the child.
pub(super) fn reversed(child: &Part, parent: &Part) -> Part {
    let (mut q_end, mut v_end) = (child.q.len(), child.v.len());
    let (mut q, mut v, mut chain) = (Vec::new(), Vec::new(), Vec::new());
    for s in child.spec.hinge.subhinges.iter().rev() {
        let (nq, nv) = (s.kind.nq(), s.kind.nv());
        let (own_q, own_v) = (&child.q[q_end - nq..q_end], &child.v[v_end - nv..v_end]);
        (q_end, v_end) = (q_end - nq, v_end - nv);
        chain.push(turned(s, own_q, own_v, &mut q, &mut v));
    }
    let spec = BodySpec {
        name: parent.spec.name.clone(),
        parent: child.spec.name.clone(),
        hinge_in_parent: child.spec.hinge_in_body,
        hinge_in_body: child.spec.hinge_in_parent,
        hinge: Hinge { subhinges: chain },
        mass: parent.spec.mass,
        modes: None,
    };
    Part { spec, q, v }
}

fn turned(
    s: &Subhinge,
    own_q: &[f64],
    own_v: &[f64],
    q: &mut Vec<f64>,
    v: &mut Vec<f64>,
) -> Subhinge {
    let kind = match s.kind {
        SubhingeKind::Pin { axis } => SubhingeKind::Pin { axis: -axis },
        SubhingeKind::Slider { axis } => SubhingeKind::Slider { axis: -axis },
        SubhingeKind::Screw { axis, pitch } => SubhingeKind::Screw { axis: -axis, pitch },
        other => other,
    };
    match s.kind {
        SubhingeKind::Ball => {
            let R = quat(own_q);
            push_quat(q, &R.inverse());
            v.extend_from_slice((-(R * vec3(own_v))).as_slice());
        }
        SubhingeKind::Free => {
            let (p, R) = (vec3(own_q), quat(&own_q[3..]));
            let w = R * vec3(own_v);
            q.extend_from_slice((-(R.inverse() * p)).as_slice());
            push_quat(q, &R.inverse());
            v.extend_from_slice((-w).as_slice());
            v.extend_from_slice((w.cross(&p) - R * vec3(&own_v[3..])).as_slice());
        }
        _ => {
            q.extend_from_slice(own_q);
            v.extend_from_slice(own_v);
        }
    }
    Subhinge { kind, ..*s }
}

/// Reverses the hinges on `path` (root first, new root last). The last body lacks a hinge afterwards; its part keeps the old one until it
/// gets another.
pub(super) fn turn_path(parts: &mut Parts, path: &[String]) {
    let old: Vec<Part> = (path.iter()).filter_map(|name| parts.find(name).cloned()).collect();
    for pair in old.windows(2) {
        let [parent, child] = pair else { continue };
        if let Some(part) = parts.find(&parent.spec.name) {
            *part = reversed(child, parent);
        }
    }
}

fn vec3(s: &[f64]) -> Vec3 {
    Vec3::new(s[0], s[1], s[2])
}

fn quat(s: &[f64]) -> Quat {
    let raw = Quaternion::new(s[3], s[0], s[1], s[2]);
    Quat::try_new(raw, 0.0).unwrap_or_else(Quat::identity)
}

fn push_quat(q: &mut Vec<f64>, R: &Quat) {
    q.extend_from_slice(&[R.i, R.j, R.k, R.w]);
}
