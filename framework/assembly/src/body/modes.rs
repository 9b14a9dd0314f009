//! Modes of flexible bodies: of a beam or plate, out of a file, or number by number.
//!
//! ```text
//! Beam(length: 1, young: "70 GPa", shear: "26 GPa", density: 2700, area: .., I_y: .., I_z: .., J: .., count: 3)
//! Beam(length: 1, diameter: "5 cm", inner: "4 cm", young: "70 GPa", poisson: 0.33, density: 2700, count: (bending_y: 2))
//! Plate(length: 1, width: 0.5, thickness: "2 mm", young: .., poisson: .., density: .., count: 5, attach: [[1, 0]])
//! File("boom.modes.ron")      as `multibody::modes` reads it
//! Modes(stiffness: [..], damping: [..], attachment: Beam, stations: [(position: .., mass: .., translation: [..])])
//! ```
use crate::body::mass::{self, read_mass};
use crate::schema::pose::{pose_of, pose_value};
use crate::schema::read::{choice, fields, list, number, numbers, text};
use crate::text::files::{Home, Near};
use crate::text::report::Cx;
use crate::text::value::{list as numbers_of, variant, vector};
use linkwork_multibody::Modes;
use linkwork_multibody::modes::{
    Attachment, Beam, BeamModes, Ends, GeneratorFault, Plate, Shortening, Station,
};
use linkwork_runtime::{Located, Origin, Value, remedy};
use linkwork_spatial::Vec3;

const KINDS: [&str; 4] = ["Beam", "Plate", "File", "Modes"];

/// The modes of a body; what cannot be read is recorded.
pub(crate) fn read(cx: &mut Cx, v: &Located, what: &str, files: Near<'_>) -> Option<Modes> {
    let what = format!("{what}: `modes`");
    let Value::Variant(kind, inner) = &v.value else {
        let message = format!("{what} cannot be {}", v.value.what());
        cx.fault(v.origin, message, format!("one of: {}", KINDS.join(", ")));
        return None;
    };
    let at = format!("{what}: `{kind}`");
    match kind.as_str() {
        "Beam" => beam(cx, v, inner, &at),
        "Plate" => plate(cx, v, inner, &at),
        "File" => file(cx, inner, &at, files),
        "Modes" => explicit(cx, v, inner, &at),
        other => {
            let origin = Origin { end: v.origin.start + other.len() as u32, ..v.origin };
            let message = format!("{what}: there are no modes `{other}`");
            cx.fault(origin, message, remedy(other, "kinds of modes", &KINDS));
            None
        }
    }
}

/// Numbers that must be there, one after another; `None` when one is not or cannot be read.
struct Needed<'v> {
    v: &'v Located,
    inner: &'v Located,
    what: &'v str,
}

impl Needed<'_> {
    fn of(&self, cx: &mut Cx, field: &str, unit: &str) -> Option<f64> {
        match self.inner.get(field) {
            Some(x) => number(cx, x, &format!("{}: `{field}`", self.what), unit),
            None => {
                let help = match unit {
                    "" => format!("write `{field}: ..`"),
                    _ => format!("write `{field}: ..` in {unit}"),
                };
                cx.fault(self.v.origin, format!("{} has no `{field}`", self.what), help);
                None
            }
        }
    }

    fn or(&self, cx: &mut Cx, field: &str, unit: &str, default: f64) -> Option<f64> {
        if self.inner.get(field).is_some() { self.of(cx, field, unit) } else { Some(default) }
    }
}

fn generated(
    cx: &mut Cx,
    origin: Origin,
    what: &str,
    modes: Result<Modes, Vec<GeneratorFault>>,
) -> Option<Modes> {
    match modes {
        Ok(modes) => Some(modes),
        Err(faults) => {
            for fault in faults {
                let text = fault.to_string();
                let (message, help) = text.split_once("\n  help: ").unwrap_or((&text, ""));
                cx.fault(origin, format!("{what}: {message}"), help);
            }
            None
        }
    }
}

/// A whole number of modes.
fn count(cx: &mut Cx, v: &Located, what: &str) -> Option<usize> {
    let n = number(cx, v, what, "")?;
    if n.fract() != 0.0 || !(0.0..=1000.0).contains(&n) {
        cx.fault(v.origin, format!("{what} is {n}"), "write a whole number");
        return None;
    }
    Some(n as usize)
}

fn beam(cx: &mut Cx, v: &Located, inner: &Located, what: &str) -> Option<Modes> {
    let known = [
        "length",
        "young",
        "shear",
        "poisson",
        "density",
        "area",
        "I_y",
        "I_z",
        "J",
        "diameter",
        "inner",
        "ends",
        "damping_ratio",
        "count",
    ];
    fields(cx, inner, what, &known);
    let n = Needed { v, inner, what };
    let (length, young) = (n.of(cx, "length", "m"), n.of(cx, "young", "Pa"));
    let density = n.of(cx, "density", "kg/m^3");
    let damping = n.or(cx, "damping_ratio", "", 0.0);
    let words = [
        ("ClampedFree", Ends::ClampedFree),
        ("ClampedClamped", Ends::ClampedClamped),
        ("ClampedPinned", Ends::ClampedPinned),
        ("PinnedPinned", Ends::PinnedPinned),
        ("FreeFree", Ends::FreeFree),
    ];
    let ends = choice(cx, inner, what, "ends", &words).unwrap_or_default();
    let count = beam_count(cx, v, inner, what);
    let shear = match (inner.get("poisson"), young) {
        (Some(_), Some(E)) => n.of(cx, "poisson", "").map(|nu| E / (2.0 * (1.0 + nu))),
        (Some(_), None) => None,
        (None, _) => n.of(cx, "shear", "Pa"),
    };
    let section = if inner.get("diameter").is_some() {
        let (outer, hole) = (n.of(cx, "diameter", "m")?, n.or(cx, "inner", "m", 0.0)?);
        let tube = Beam::tube(1.0, outer, hole, 1.0, 0.0, 1.0);
        [tube.area, tube.I_y, tube.I_z, tube.J].map(Some)
    } else {
        let units = [("area", "m^2"), ("I_y", "m^4"), ("I_z", "m^4"), ("J", "m^4")];
        units.map(|(field, unit)| n.of(cx, field, unit))
    };
    let [area, I_y, I_z, J] = section;
    let beam = Beam {
        length: length?,
        young: young?,
        shear: shear?,
        density: density?,
        area: area?,
        I_y: I_y?,
        I_z: I_z?,
        J: J?,
        ends,
        damping_ratio: damping?,
    };
    generated(cx, v.origin, what, beam.modes(count?))
}

/// `count: 3` is three of bending along y and three along z.
fn beam_count(cx: &mut Cx, v: &Located, inner: &Located, what: &str) -> Option<BeamModes> {
    let what_count = format!("{what}: `count`");
    let Some(written) = inner.get("count") else {
        let help = "write `count: (bending_y: 2, bending_z: 2, twist: 1, stretch: 1)`";
        cx.fault(v.origin, format!("{what} has no `count`"), help);
        return None;
    };
    if !matches!(written.value, Value::Map(_)) {
        let n = count(cx, written, &what_count)?;
        return Some(BeamModes { bending_y: n, bending_z: n, ..BeamModes::default() });
    }
    fields(cx, written, &what_count, &["bending_y", "bending_z", "twist", "stretch"]);
    let mut of = |field: &str| match written.get(field) {
        Some(n) => count(cx, n, &format!("{what_count}: `{field}`")),
        None => Some(0),
    };
    let (bending_y, bending_z) = (of("bending_y"), of("bending_z"));
    let (twist, stretch) = (of("twist")?, of("stretch")?);
    Some(BeamModes { bending_y: bending_y?, bending_z: bending_z?, twist, stretch })
}

fn plate(cx: &mut Cx, v: &Located, inner: &Located, what: &str) -> Option<Modes> {
    let known = [
        "length",
        "width",
        "thickness",
        "young",
        "poisson",
        "density",
        "damping_ratio",
        "attach",
        "count",
    ];
    fields(cx, inner, what, &known);
    let n = Needed { v, inner, what };
    let (length, width) = (n.of(cx, "length", "m"), n.of(cx, "width", "m"));
    let (thickness, young) = (n.of(cx, "thickness", "m"), n.of(cx, "young", "Pa"));
    let (poisson, density) = (n.of(cx, "poisson", ""), n.of(cx, "density", "kg/m^3"));
    let damping = n.or(cx, "damping_ratio", "", 0.0);
    let mut attach = Vec::new();
    if let Some(places) = inner.get("attach") {
        let at = format!("{what}: `attach`");
        for p in list(cx, places, &at) {
            attach.push(numbers::<2>(cx, p, &at, "m")?);
        }
    }
    let wanted = match inner.get("count") {
        Some(c) => count(cx, c, &format!("{what}: `count`")),
        None => {
            cx.fault(
                v.origin,
                format!("{what} has no `count`"),
                "write how many modes: `count: 4`",
            );
            None
        }
    };
    let plate = Plate {
        length: length?,
        width: width?,
        thickness: thickness?,
        young: young?,
        poisson: poisson?,
        density: density?,
        damping_ratio: damping?,
        attach,
    };
    generated(cx, v.origin, what, plate.modes(wanted?))
}

/// `File("boom.ron")`: modes as serde writes them.
fn file(cx: &mut Cx, inner: &Located, what: &str, (files, home): Near<'_>) -> Option<Modes> {
    let name = text(cx, inner, what)?;
    let read = match files.find(&name.text, home) {
        Ok((key, Home::Folder(_))) => std::fs::read_to_string(&key).map_err(|e| e.to_string()),
        Ok((key, Home::Embedded(_))) => {
            files.embedded.get(&key).cloned().ok_or_else(|| "it is not there".into())
        }
        Err(tried) => {
            let message = format!("{what}: there is no file `{}`", name.text);
            cx.fault(name.origin, message, format!("tried: {}", tried.join(", ")));
            return None;
        }
    };
    match read.and_then(|t| ron::from_str::<Modes>(&t).map_err(|e| e.to_string())) {
        Ok(modes) => Some(modes),
        Err(why) => {
            let message = format!("{what}: `{}` cannot be read: {why}", name.text);
            let help =
                "it holds `(stiffness: [..], stations: [(pose: .., mass: .., translation: [..])])`";
            cx.fault(name.origin, message, help);
            None
        }
    }
}

/// All numbers of a list.
fn flat(cx: &mut Cx, v: &Located, what: &str) -> Option<Vec<f64>> {
    list(cx, v, what).iter().map(|x| number(cx, x, what, "")).collect()
}

fn vectors(cx: &mut Cx, v: &Located, what: &str) -> Option<Vec<Vec3>> {
    let items = list(cx, v, what).iter();
    items.map(|x| numbers::<3>(cx, x, what, "").map(Vec3::from)).collect()
}

fn explicit(cx: &mut Cx, v: &Located, inner: &Located, what: &str) -> Option<Modes> {
    fields(cx, inner, what, &["stiffness", "damping", "attachment", "stations"]);
    let mut of = |field: &str| match inner.get(field) {
        Some(x) => flat(cx, x, &format!("{what}: `{field}`")),
        None => Some(Vec::new()),
    };
    let (stiffness, damping) = (of("stiffness"), of("damping"));
    let attachment = match inner.get("attachment").map(|a| (&a.value, a.origin)) {
        None => Attachment::default(),
        Some((Value::Variant(word, _), _)) if word == "Beam" => Attachment::Beam,
        Some((Value::Variant(word, inside), _)) if word == "Nearest" => {
            let Some(t) = inside.get("tolerance") else {
                let help = "write `Nearest(tolerance: \"1 mm\")`";
                cx.fault(inside.origin, format!("{what}: `Nearest` has no `tolerance`"), help);
                return None;
            };
            Attachment::Nearest { tolerance: number(cx, t, &format!("{what}: `tolerance`"), "m")? }
        }
        Some((_, origin)) => {
            let message = format!("{what}: `attachment` is one of two");
            cx.fault(origin, message, "write `Beam` or `Nearest(tolerance: \"1 mm\")`");
            return None;
        }
    };
    let Some(written) = inner.get("stations") else {
        let help = "write `stations: [(position: .., mass: .., inertia: .., translation: [..])]`";
        cx.fault(v.origin, format!("{what} has no `stations`"), help);
        return None;
    };
    let mut stations = Vec::new();
    for (k, s) in list(cx, written, what).to_vec().iter().enumerate() {
        stations.push(station(cx, s, &format!("{what}: station {}", k + 1)));
    }
    let stations = stations.into_iter().collect::<Option<Vec<_>>>()?;
    Some(Modes { stiffness: stiffness?, damping: damping?, stations, attachment })
}

fn station(cx: &mut Cx, v: &Located, what: &str) -> Option<Station> {
    let known = [
        "position",
        "rotation",
        "mass",
        "com",
        "inertia",
        "inertia_check",
        "translation",
        "turn",
        "shortening",
    ];
    fields(cx, v, what, &known);
    let pose = pose_of(cx, v, what);
    let mass = read_mass(cx, v, what, v.origin);
    let mut of = |field: &str| match v.get(field) {
        Some(x) => vectors(cx, x, &format!("{what}: `{field}`")),
        None => Some(Vec::new()),
    };
    let (translation, rotation) = (of("translation"), of("turn"));
    let shortening = match v.get("shortening") {
        Some(s) => {
            let at = format!("{what}: `shortening`");
            fields(cx, s, &at, &["axis", "matrix"]);
            let (Some(axis), Some(matrix)) = (s.get("axis"), s.get("matrix")) else {
                cx.fault(s.origin, format!("{at} has an `axis` and a `matrix`"), "");
                return None;
            };
            let axis = numbers::<3>(cx, axis, &at, "").map(Vec3::from);
            let matrix = flat(cx, matrix, &at);
            Some(Shortening { axis: axis?, matrix: matrix? })
        }
        None => None,
    };
    Some(Station { pose, mass, translation: translation?, rotation: rotation?, shortening })
}

/// Number by number, to every digit.
pub(crate) fn value(m: &Modes) -> Value {
    let of = |fields: Vec<(&str, Value)>| {
        let written = fields.into_iter().filter(|(_, v)| match v {
            Value::List(items) => !items.is_empty(),
            Value::Null => false,
            _ => true,
        });
        Value::Map(written.map(|(k, v)| (k.to_owned(), v.into())).collect())
    };
    let vectors = |all: &[Vec3]| Value::List(all.iter().map(|x| vector(x).into()).collect());
    let station = |s: &Station| -> Located {
        let mut out = Vec::new();
        if let Value::Map(pose) = pose_value(&s.pose) {
            out.extend(pose);
        }
        mass::mass(&mut out, &s.mass);
        let shortening = s.shortening.as_ref().map_or(Value::Null, |x| {
            let matrix = numbers_of(x.matrix.iter().copied());
            of(vec![("axis", vector(&x.axis)), ("matrix", matrix)])
        });
        let rest = of(vec![
            ("translation", vectors(&s.translation)),
            ("turn", vectors(&s.rotation)),
            ("shortening", shortening),
        ]);
        if let Value::Map(rest) = rest {
            out.extend(rest);
        }
        Value::Map(out).into()
    };
    let attachment = match m.attachment {
        Attachment::Beam => variant("Beam", Value::Null),
        Attachment::Nearest { tolerance } => {
            variant("Nearest", of(vec![("tolerance", Value::Number(tolerance))]))
        }
    };
    let stations = Value::List(m.stations.iter().map(station).collect());
    let all = of(vec![
        ("stiffness", numbers_of(m.stiffness.iter().copied())),
        ("damping", numbers_of(m.damping.iter().copied())),
        ("attachment", attachment),
        ("stations", stations),
    ]);
    variant("Modes", all)
}
