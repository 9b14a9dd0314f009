//! Poses as written in files: position in m, rotation as rpy, quaternion or axis and angle.
use crate::schema::describe::Schema;
use crate::schema::kind::{At, Kind, direction, number, numbers, vector};
use crate::schema::read::fields;
use crate::schema::record::{Presence, Record, record};
use crate::text::report::Cx;
use crate::text::value::{list, map};
use linkwork_runtime::{Located, Value};
use linkwork_spatial::nalgebra::{Quaternion, Unit};
use linkwork_spatial::{Pose, Quat, Vec3};

record! {
    /// A rotation, in one of three forms.
    struct RotationForm: "rotation" {
        /// Roll, pitch and yaw: about x, then y, then z of the fixed frame.
        rpy: Option<[f64; 3]> = numbers::<3>("rad").turn().maybe(),
        /// Quaternion x, y, z, w of length 1.
        quat: Option<[f64; 4]> = numbers::<4>("").maybe(),
        /// Axis of a rotation by `angle`.
        axis: Option<Vec3> = direction().maybe(),
        /// Angle about `axis`.
        angle: Option<f64> = number("rad").turn().maybe(),
    }
}

record! {
    for Pose: "pose" {
        /// Origin in the outer frame.
        position: vector("m").or(Vec3::zeros()),
        /// Rotation relative to the outer frame.
        rotation: rotation().or(Quat::identity()),
    }
}

/// A rotation: `(rpy: ..)`, `(quat: ..)` or `(axis: .., angle: ..)`.
pub(crate) struct Rotation;

pub(crate) fn rotation() -> Rotation {
    Rotation
}

impl Kind for Rotation {
    type Of = Quat;
    fn read(&self, cx: &mut Cx, v: &Located, at: &At<'_>) -> Option<Quat> {
        let what = &at.what;
        let help = "write (rpy: [r, p, y]), (quat: [x, y, z, w]) or (axis: [x, y, z], angle: ..)";
        if !matches!(v.value, Value::Map(_)) {
            cx.fault(v.origin, format!("{what} is {}", v.value.what()), help);
            return None;
        }
        if !fields(cx, v, what, &RotationForm::names()) {
            return None;
        }
        let written = ["rpy", "quat", "axis", "angle"].map(|f| v.get(f).is_some());
        if !matches!(
            written,
            [true, false, false, false] | [false, true, false, false] | [false, false, true, true]
        ) {
            cx.fault(v.origin, format!("{what} is missing or specified twice"), help);
            return None;
        }
        let form = RotationForm::read_fields(cx, v, at)?;
        if let Some([r, p, y]) = form.rpy {
            return Some(Quat::from_euler_angles(r, p, y));
        }
        if let (Some(axis), Some(angle)) = (form.axis, form.angle) {
            return Some(Quat::from_axis_angle(&Unit::new_normalize(axis), angle));
        }
        let [x, y, z, w] = form.quat?;
        let raw = Quaternion::new(w, x, y, z);
        if (raw.norm() - 1.0).abs() > 1e-6 {
            let message = format!("{what}: `quat` has length {}, not 1", raw.norm());
            let origin = v.get("quat").map_or(v.origin, |q| q.origin);
            cx.fault(origin, message, "the order is [x, y, z, w]; divide by the length");
            return None;
        }
        // A unit quaternion is not normalized again, so that it reads back identically.
        let unit = (raw.norm_squared() - 1.0).abs() <= 8.0 * f64::EPSILON;
        Some(if unit { Quat::new_unchecked(raw) } else { Quat::new_normalize(raw) })
    }
    fn write(&self, x: &Quat) -> Value {
        map(vec![("quat", list([x.i, x.j, x.k, x.w]).into())]).value
    }
    fn describe(&self) -> Schema {
        RotationForm::describe()
    }
}
