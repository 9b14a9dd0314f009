//! Poses and vectors as written: position in m, rotation as rpy, quaternion or axis and angle.
use crate::schema::read::{fields, number, numbers};
use crate::text::report::Cx;
use crate::text::value;
use linkwork_runtime::{Located, Value};
use linkwork_spatial::nalgebra::{Quaternion, Unit};
use linkwork_spatial::{Pose, Quat, Vec3};

/// `(position: [x, y, z], rotation: ..)`; nothing is the identity.
pub(crate) fn pose(cx: &mut Cx, v: Option<&Located>, what: &str) -> Pose {
    let Some(v) = v else { return Pose::identity() };
    fields(cx, v, what, &["position", "rotation"]);
    pose_of(cx, v, what)
}

/// As [`pose`], but other fields beside these two are the caller's.
pub(crate) fn pose_of(cx: &mut Cx, v: &Located, what: &str) -> Pose {
    let position =
        v.get("position").and_then(|p| vector(cx, p, &format!("{what}: `position`"), "m"));
    let rotation = v.get("rotation").and_then(|r| rotation(cx, r, &format!("{what}: `rotation`")));
    Pose::new(rotation.unwrap_or_else(Quat::identity), position.unwrap_or_else(Vec3::zeros))
}

/// Three numbers in a unit.
pub(crate) fn vector(cx: &mut Cx, v: &Located, what: &str, unit: &str) -> Option<Vec3> {
    numbers::<3>(cx, v, what, unit).map(Vec3::from)
}

/// `(rpy: [..])`, `(quat: [x, y, z, w])` or `(axis: [..], angle: ..)`.
pub(crate) fn rotation(cx: &mut Cx, v: &Located, what: &str) -> Option<Quat> {
    let help = "write (rpy: [r, p, y]), (quat: [x, y, z, w]) or (axis: [x, y, z], angle: ..)";
    if !matches!(v.value, Value::Map(_)) {
        cx.fault(v.origin, format!("{what} is {}", v.value.what()), help);
        return None;
    }
    if !fields(cx, v, what, &["rpy", "quat", "axis", "angle"]) {
        return None;
    }
    match (v.get("rpy"), v.get("quat"), v.get("axis"), v.get("angle")) {
        (Some(rpy), None, None, None) => {
            let [r, p, y] = numbers::<3>(cx, rpy, &format!("{what}: `rpy`"), "rad")?;
            Some(Quat::from_euler_angles(r, p, y))
        }
        (None, Some(quat), None, None) => {
            let [x, y, z, w] = numbers::<4>(cx, quat, &format!("{what}: `quat`"), "")?;
            let raw = Quaternion::new(w, x, y, z);
            if (raw.norm() - 1.0).abs() > 1e-6 {
                let message = format!("{what}: `quat` has length {}, not 1", raw.norm());
                cx.fault(quat.origin, message, "the order is [x, y, z, w]; divide by the length");
                return None;
            }
            // A unit quaternion keeps its digits, so that what was written reads back the same.
            let unit = (raw.norm_squared() - 1.0).abs() <= 8.0 * f64::EPSILON;
            Some(if unit { Quat::new_unchecked(raw) } else { Quat::new_normalize(raw) })
        }
        (None, None, Some(axis), Some(angle)) => {
            let n = direction(cx, axis, &format!("{what}: `axis`"));
            let angle = number(cx, angle, &format!("{what}: `angle`"), "rad");
            Some(Quat::from_axis_angle(&Unit::new_normalize(n?), angle?))
        }
        _ => {
            cx.fault(v.origin, format!("{what} is written in no way or in two"), help);
            None
        }
    }
}

/// A vector that is not zero.
pub(crate) fn direction(cx: &mut Cx, v: &Located, what: &str) -> Option<Vec3> {
    let n = vector(cx, v, what, "")?;
    if n.norm() < 1e-100 {
        cx.fault(v.origin, format!("{what} has no direction"), "write for example [0, 0, 1]");
        return None;
    }
    Some(n)
}

/// `Null` for the identity.
pub(crate) fn pose_value(X: &Pose) -> Value {
    let mut out = Vec::new();
    if X.position != Vec3::zeros() {
        value::push(&mut out, "position", value::vector(&X.position));
    }
    if X.rotation != Pose::identity().rotation {
        let q = X.rotation.coords;
        let quat = vec![("quat".to_owned(), value::list([q.x, q.y, q.z, q.w]).into())];
        value::push(&mut out, "rotation", Value::Map(quat));
    }
    Value::Map(out)
}
