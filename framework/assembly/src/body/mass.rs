//! Mass, centre of mass and inertia: reading and writing them.
use crate::body::solid::{inertia, shape};
use crate::schema::pose::vector;
use crate::schema::read::{number, numbers};
use crate::text::report::Cx;
use crate::text::value::{self, push, variant};
use linkwork_runtime::{Located, Origin, Value};
use linkwork_spatial::{InertiaCheck, MassProperties, Mat3, Vec3};

/// `mass`, `com`, `inertia`, `inertia_check`.
pub(crate) fn read_mass(cx: &mut Cx, v: &Located, what: &str, origin: Origin) -> MassProperties {
    let mass = v.get("mass").map(|m| number(cx, m, &format!("{what}: `mass`"), "kg"));
    let com = v.get("com").and_then(|c| vector(cx, c, &format!("{what}: `com`"), "m"));
    let matrix = match (v.get("inertia"), mass) {
        (Some(i), mass) => read_inertia(cx, i, what, mass.flatten().unwrap_or(0.0)),
        (None, Some(Some(m))) if m != 0.0 => {
            let help = "write `inertia: [ixx, iyy, izz]` about the centre of mass, \
                        or a solid such as `inertia: Sphere(0.1)`";
            cx.fault(origin, format!("{what} has mass but no `inertia`"), help);
            None
        }
        _ => Some(Mat3::zeros()),
    };
    // After a mistake the rest of the body is still checked, with a mass that can exist.
    let (Some(Some(mass)), Some(matrix)) = (mass.or(Some(Some(0.0))), matrix) else {
        return MassProperties::massless();
    };
    let check = match v.get("inertia_check").map(|c| &c.value) {
        None => InertiaCheck::Physical,
        Some(Value::Variant(w, _) | Value::Text(w)) if w == "Physical" => InertiaCheck::Physical,
        Some(Value::Variant(w, _) | Value::Text(w)) if w == "PositiveMoments" => {
            InertiaCheck::PositiveMoments
        }
        Some(_) => {
            let place = v.get("inertia_check").map_or(origin, |c| c.origin);
            let help = "one of: Physical, PositiveMoments";
            cx.fault(place, format!("{what}: `inertia_check` is one of two words"), help);
            InertiaCheck::Physical
        }
    };
    MassProperties::new(mass, com.unwrap_or_else(Vec3::zeros), matrix).with_check(check)
}

fn read_inertia(cx: &mut Cx, v: &Located, what: &str, mass: f64) -> Option<Mat3> {
    let what = format!("{what}: `inertia`");
    let unit = "kg m^2";
    match &v.value {
        Value::List(items) if items.len() == 6 => {
            let [xx, yy, zz, xy, xz, yz] = numbers::<6>(cx, v, &what, unit)?;
            Some(Mat3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz))
        }
        Value::List(items) if items.len() == 9 => {
            let rows = numbers::<9>(cx, v, &what, unit)?;
            Some(Mat3::from_row_slice(&rows))
        }
        Value::List(items) if items.len() == 3 => {
            let d = numbers::<3>(cx, v, &what, unit)?;
            Some(Mat3::from_diagonal(&Vec3::from(d)))
        }
        Value::Variant(..) => {
            let (solid, turn) = shape(cx, v, &what, None)?;
            inertia(mass, &solid, &turn)
        }
        other => {
            let help = "write [ixx, iyy, izz], [ixx, iyy, izz, ixy, ixz, iyz], nine numbers by \
                        rows, or a solid such as Cylinder(radius: .., length: ..)";
            let found = match other {
                Value::List(items) => format!("a list of {}", items.len()),
                other => other.what().into(),
            };
            cx.fault(v.origin, format!("{what} cannot be {found}"), help);
            None
        }
    }
}

/// `mass`, `com`, `inertia` and `inertia_check`, as far as they are not neutral.
pub(crate) fn mass(out: &mut Vec<(String, Located)>, m: &MassProperties) {
    let J = &m.inertia_com;
    if m.mass != 0.0 {
        push(out, "mass", Value::Number(m.mass));
    }
    if m.com != Vec3::zeros() {
        push(out, "com", value::vector(&m.com));
    }
    if m.mass != 0.0 || J.amax() != 0.0 {
        let off = J[(0, 1)] != 0.0 || J[(0, 2)] != 0.0 || J[(1, 2)] != 0.0;
        let inertia = match (*J == J.transpose(), off) {
            (false, _) => value::list(J.transpose().iter().copied()),
            (true, false) => value::vector(&J.diagonal()),
            (true, true) => {
                value::list([J[(0, 0)], J[(1, 1)], J[(2, 2)], J[(0, 1)], J[(0, 2)], J[(1, 2)]])
            }
        };
        push(out, "inertia", inertia);
    }
    if m.check == InertiaCheck::PositiveMoments {
        push(out, "inertia_check", variant("PositiveMoments", Value::Null));
    }
}
