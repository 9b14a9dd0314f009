//! Mass, centre of mass and inertia.
use crate::body::solid::{inertia, solid};
use crate::schema::describe::{Field, Schema};
use crate::schema::kind::{At, Kind, number, numbers, vector, word};
use crate::schema::record::{Presence, Record, record};
use crate::text::report::Cx;
use crate::text::value;
use linkwork_collision::Shape;
use linkwork_runtime::{Located, Value};
use linkwork_spatial::{InertiaCheck, MassProperties, Mat3, Quat, Vec3};

record! {
    struct MassForm: "mass" {
        /// Mass.
        mass: Option<f64> = number("kg").maybe(),
        /// Centre of mass in the body's frame.
        com: Vec3 = vector("m").or(Vec3::zeros()),
        /// Inertia about the centre of mass, body axes: `[xx, yy, zz]`, `[xx, yy, zz, xy, xz, yz]`, nine numbers by rows, or a solid with the body's
        /// mass.
        inertia: Option<Inertia> = InertiaKind.maybe(),
        /// `PositiveMoments` accepts published data with lumped rotors.
        inertia_check: InertiaCheck = inertia_check().or(InertiaCheck::Physical),
    }
}

/// Returns the reader for the inertia check.
pub(crate) fn inertia_check() -> impl Kind<Of = InertiaCheck> {
    word(&[
        ("Physical", InertiaCheck::Physical),
        ("PositiveMoments", InertiaCheck::PositiveMoments),
    ])
}

enum Inertia {
    Matrix(Mat3),
    Solid(Shape, Quat),
}

struct InertiaKind;

impl Kind for InertiaKind {
    type Of = Inertia;
    fn read(&self, cx: &mut Cx, v: &Located, at: &At<'_>) -> Option<Inertia> {
        const UNIT: &str = "kg m^2";
        let found = match &v.value {
            Value::List(items) => match items.len() {
                3 => {
                    let d = numbers::<3>(UNIT).read(cx, v, at)?;
                    return Some(Inertia::Matrix(Mat3::from_diagonal(&Vec3::from(d))));
                }
                6 => {
                    let [xx, yy, zz, xy, xz, yz] = numbers::<6>(UNIT).read(cx, v, at)?;
                    let J = Mat3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
                    return Some(Inertia::Matrix(J));
                }
                9 => {
                    let rows = numbers::<9>(UNIT).read(cx, v, at)?;
                    return Some(Inertia::Matrix(Mat3::from_row_slice(&rows)));
                }
                n => format!("a list of {n}"),
            },
            Value::Variant(..) => {
                let (shape, turn) = solid().read(cx, v, at)?;
                return Some(Inertia::Solid(shape, turn));
            }
            other => other.what().into(),
        };
        let help = "write [ixx, iyy, izz], [ixx, iyy, izz, ixy, ixz, iyz], nine numbers by \
                    rows, or a solid such as Cylinder(radius: .., length: ..)";
        cx.fault(v.origin, format!("{} cannot be {found}", at.what), help);
        None
    }
    fn write(&self, x: &Inertia) -> Value {
        let Inertia::Matrix(J) = x else { return Value::Null };
        if *J != J.transpose() {
            return value::list(J.transpose().iter().copied());
        }
        let (d, off) = (J.diagonal(), [J[(0, 1)], J[(0, 2)], J[(1, 2)]]);
        let off = off.iter().any(|x| *x != 0.0).then_some(off);
        value::list(d.iter().copied().chain(off.into_iter().flatten()))
    }
    fn describe(&self) -> Schema {
        let list = Schema::List(Box::new(number("kg m^2").describe()), None);
        Schema::Any(vec![list, solid().describe()])
    }
}

/// The fields are those of [`MassForm`], in addition to those of a body or station.
impl Record for MassProperties {
    const TITLE: &'static str = MassForm::TITLE;
    fn names() -> Vec<&'static str> {
        MassForm::names()
    }
    fn fields() -> Vec<Field> {
        MassForm::fields()
    }
    fn read_fields(cx: &mut Cx, v: &Located, at: &At<'_>) -> Option<Self> {
        let form = MassForm::read_fields(cx, v, at)?;
        // After a mistake, the rest of the body is checked with a valid mass.
        if form.mass.is_none() && v.get("mass").is_some() {
            return None;
        }
        let mass = form.mass.unwrap_or(0.0);
        let matrix = match form.inertia {
            Some(Inertia::Matrix(J)) => J,
            Some(Inertia::Solid(shape, turn)) => inertia(mass, &shape, &turn)?,
            None => {
                if mass != 0.0 && v.get("inertia").is_none() {
                    let help = "write `inertia: [ixx, iyy, izz]` about the centre of mass, \
                                or a solid such as `inertia: Sphere(0.1)`";
                    let origin = at.origin.unwrap_or(v.origin);
                    cx.fault(origin, format!("{} has mass but lacks `inertia`", at.what), help);
                }
                if mass != 0.0 {
                    return None;
                }
                Mat3::zeros()
            }
        };
        Some(MassProperties::new(mass, form.com, matrix).with_check(form.inertia_check))
    }
    fn write_fields(&self, out: &mut Vec<(String, Located)>) {
        let there = self.mass != 0.0 || self.inertia_com.amax() != 0.0;
        let form = MassForm {
            mass: Some(self.mass).filter(|m| *m != 0.0),
            com: self.com,
            inertia: there.then_some(Inertia::Matrix(self.inertia_com)),
            inertia_check: self.check,
        };
        form.write_fields(out);
    }
}
