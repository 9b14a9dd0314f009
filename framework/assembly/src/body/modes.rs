//! Modes of flexible bodies: of a beam or plate, from a file, or by explicit numbers.
//!
//! ```text
//! Beam(length: 1, young: "70 GPa", shear: "26 GPa", density: 2700, area: .., I_y: .., I_z: .., J: .., count: 3)
//! Beam(length: 1, diameter: "5 cm", inner: "4 cm", young: "70 GPa", poisson: 0.33, density: 2700, count: (bending_y: 2))
//! Plate(length: 1, width: 0.5, thickness: "2 mm", young: .., poisson: .., density: .., count: 5, attach: [[1, 0]])
//! File("boom.modes.ron")      as `multibody::modes` reads it
//! Modes(stiffness: [..], damping: [..], attachment: Beam, stations: [(position: .., mass: .., translation: [..])])
//! ```
use crate::schema::describe::Schema;
use crate::schema::kind::{
    At, Kind, list_of, mapped, number, numbers, short, text, vector, whole, word,
};
use crate::schema::record::{Presence, Record, argument, of, record, variant_name, variant_of};
use crate::text::files::Home;
use crate::text::report::Cx;
use crate::text::value::variant;
use linkwork_multibody::Modes;
use linkwork_multibody::modes::{
    Attachment, Beam, BeamModes, Ends, GeneratorFault, Plate, Shortening, Station,
};
use linkwork_runtime::{Located, Origin, Value};
use linkwork_spatial::{MassProperties, Pose, Vec3};
use std::fmt::Display;
use std::path::Path;

const KINDS: [&str; 4] = ["Beam", "Plate", "File", "Modes"];
const COUNT: &str = "write `count: (bending_y: 2, bending_z: 2, twist: 1, stretch: 1)`";
const SECTION: &str = "write `diameter: ..` of a tube, or `area`, `I_y`, `I_z`, `J`";

record! {
    struct BeamForm: "beam" {
        /// Length along x from the body's frame.
        length: f64 = number("m").need("write `length: ..` in m"),
        /// Young's modulus.
        young: f64 = number("Pa").need("write `young: ..` in Pa"),
        /// Shear modulus (alternative: `poisson`).
        shear: Option<f64> = number("Pa").maybe(),
        /// Poisson's ratio (alternative: `shear`).
        poisson: Option<f64> = number("").maybe(),
        /// Density.
        density: f64 = number("kg/m^3").need("write `density: ..` in kg/m^3"),
        /// Area of the section.
        area: Option<f64> = number("m^2").maybe(),
        /// Second moment of area for bending along z.
        I_y: Option<f64> = number("m^4").maybe(),
        /// Second moment of area for bending along y.
        I_z: Option<f64> = number("m^4").maybe(),
        /// Torsion constant.
        J: Option<f64> = number("m^4").maybe(),
        /// Outer diameter of a tube, instead of area and moments.
        diameter: Option<f64> = number("m").maybe(),
        /// Inner diameter of a tube.
        inner: f64 = number("m").or(0.0),
        /// Boundary conditions.
        ends: Ends = word(&[
            ("ClampedFree", Ends::ClampedFree),
            ("ClampedClamped", Ends::ClampedClamped),
            ("ClampedPinned", Ends::ClampedPinned),
            ("PinnedPinned", Ends::PinnedPinned),
            ("FreeFree", Ends::FreeFree),
        ]).or(Ends::default()),
        /// Damping ratio of every mode.
        damping_ratio: f64 = number("").or(0.0),
        /// Number of modes: equal numbers along y and along z, or a number for each kind.
        count: BeamModes = beam_count().need(COUNT),
    }
}
record! {
    for BeamModes: "modes of a beam" {
        /// Bending along y.
        bending_y: count().or(0),
        /// Bending along z.
        bending_z: count().or(0),
        /// Twist about x.
        twist: count().or(0),
        /// Stretch along x.
        stretch: count().or(0),
    }
}
record! {
    struct PlateForm: "plate" {
        /// Length along x, clamped at x = 0.
        length: f64 = number("m").need("write `length: ..` in m"),
        /// Width along y.
        width: f64 = number("m").need("write `width: ..` in m"),
        /// Thickness.
        thickness: f64 = number("m").need("write `thickness: ..` in m"),
        /// Young's modulus.
        young: f64 = number("Pa").need("write `young: ..` in Pa"),
        /// Poisson's ratio.
        poisson: f64 = number("").need("write `poisson: 0.33`"),
        /// Density.
        density: f64 = number("kg/m^3").need("write `density: ..` in kg/m^3"),
        /// Damping ratio of every mode.
        damping_ratio: f64 = number("").or(0.0),
        /// Attachment points in addition to the corners.
        attach: Vec<[f64; 2]> = list_of(numbers::<2>("m")).or(Vec::new()),
        /// Number of modes.
        count: usize = count().need("write how many modes: `count: 4`"),
    }
}
record! {
    for Modes: "modes" {
        /// Stiffness of each mode, or the matrix row by row.
        stiffness: list_of(number("")).or(Vec::new()),
        /// Damping likewise.
        damping: list_of(number("")).or(Vec::new()),
        /// Interpolation of attachment points: along the `Beam` between stations, or at the nearest station.
        attachment: attachment().or(Attachment::default()),
        /// Stations, each with mass and mode shapes.
        stations: list_of(StationKind).need(
            "write `stations: [(position: .., mass: .., inertia: .., translation: [..])]`"),
    }
}
record! {
    struct StationForm: "station" {
        /// Translation of each mode.
        translation: Vec<Vec3> = list_of(vector("")).or(Vec::new()),
        /// Rotation of each mode.
        turn: Vec<Vec3> = list_of(vector("")).or(Vec::new()),
        /// Shortening of second order.
        shortening: Option<Shortening> = of::<Shortening>().maybe(),
    }
}
record! {
    for Shortening: "shortening" {
        /// Direction.
        axis: vector("").need("write `axis: [1, 0, 0]`"),
        /// Matrix over the modes, row by row.
        matrix: list_of(number("")).need("write `matrix: [..]`"),
    }
}
record! {
    struct Nearest: "nearest station" {
        /// Largest distance to a station.
        tolerance: f64 = number("m").need("write `Nearest(tolerance: \"1 mm\")`"),
    }
}

/// Reads a number of modes.
fn count() -> impl Kind<Of = usize> {
    mapped(whole::<u32>(0, 1000), |n| n as usize, |n| u32::try_from(*n).ok())
}

/// Reads the numbers of modes: `count: 3` means three of bending along y and three along z.
fn beam_count() -> impl Kind<Of = BeamModes> {
    let both = |n| BeamModes { bending_y: n, bending_z: n, ..BeamModes::default() };
    short(mapped(count(), both, |_| None), of::<BeamModes>())
}

fn attachment() -> impl Kind<Of = Attachment> {
    struct Attach;
    impl Kind for Attach {
        type Of = Attachment;
        fn read(&self, cx: &mut Cx, v: &Located, at: &At<'_>) -> Option<Attachment> {
            let known = ("attachment", "attachments", &["Beam", "Nearest"][..]);
            match variant_name(cx, v, &at.what, known)? {
                ("Beam", _) => Some(Attachment::Beam),
                (_, inner) => {
                    let at = at.field("Nearest");
                    let Nearest { tolerance } = argument(cx, inner, &at, "")?;
                    Some(Attachment::Nearest { tolerance })
                }
            }
        }
        fn write(&self, x: &Attachment) -> Value {
            match *x {
                Attachment::Beam => variant("Beam", Value::Null),
                Attachment::Nearest { tolerance } => {
                    variant("Nearest", Nearest { tolerance }.write())
                }
            }
        }
        fn describe(&self) -> Schema {
            let nearest = variant_of::<Nearest>("Nearest", "");
            Schema::Any(vec![Schema::Words(vec!["Beam"]), nearest])
        }
    }
    Attach
}

/// A station: pose, mass and mode shapes in one map.
struct StationKind;
type StationFields = (Pose, (MassProperties, StationForm));

impl Kind for StationKind {
    type Of = Station;
    fn read(&self, cx: &mut Cx, v: &Located, at: &At<'_>) -> Option<Station> {
        let (pose, (mass, form)) = StationFields::read(cx, v, at)?;
        let StationForm { translation, turn, shortening } = form;
        Some(Station { pose, mass, translation, rotation: turn, shortening })
    }
    fn write(&self, s: &Station) -> Value {
        let form = StationForm {
            translation: s.translation.clone(),
            turn: s.rotation.clone(),
            shortening: s.shortening.clone(),
        };
        (s.pose, (s.mass, form)).write()
    }
    fn describe(&self) -> Schema {
        Schema::Record("station", StationFields::fields)
    }
}

/// The modes of a flexible body.
pub(crate) struct ModesKind;

pub(crate) fn modes() -> ModesKind {
    ModesKind
}

impl Kind for ModesKind {
    type Of = Modes;
    fn read(&self, cx: &mut Cx, v: &Located, at: &At<'_>) -> Option<Modes> {
        let (kind, inner) =
            variant_name(cx, v, &at.what, ("kind of modes", "kinds of modes", &KINDS))?;
        let at = At { origin: Some(v.origin), ..at.field(kind) };
        match kind {
            "Beam" => {
                let form = argument(cx, inner, &at, "")?;
                beam(cx, v, form, &at)
            }
            "Plate" => {
                let p: PlateForm = argument(cx, inner, &at, "")?;
                let plate = Plate {
                    length: p.length,
                    width: p.width,
                    thickness: p.thickness,
                    young: p.young,
                    poisson: p.poisson,
                    density: p.density,
                    damping_ratio: p.damping_ratio,
                    attach: p.attach,
                };
                generated(cx, v.origin, &at.what, plate.modes(p.count))
            }
            "File" => file(cx, inner, &at),
            _ => argument(cx, inner, &at, ""),
        }
    }
    /// Writes explicit numbers in full precision.
    fn write(&self, m: &Modes) -> Value {
        variant("Modes", Record::write(m))
    }
    fn describe(&self) -> Schema {
        Schema::Any(vec![
            variant_of::<BeamForm>("Beam", ""),
            variant_of::<PlateForm>("Plate", ""),
            Schema::Variant("File", Box::new(Schema::Text)),
            variant_of::<Modes>("Modes", ""),
        ])
    }
}

fn generated(
    cx: &mut Cx,
    origin: Origin,
    what: impl Display,
    modes: Result<Modes, Vec<GeneratorFault>>,
) -> Option<Modes> {
    modes.map_err(|faults| cx.explained(origin, &what.to_string(), faults)).ok()
}

fn beam(cx: &mut Cx, v: &Located, b: BeamForm, at: &At<'_>) -> Option<Modes> {
    let none = |cx: &mut Cx, field: &str, help: &str| {
        cx.fault(v.origin, format!("{} lacks `{field}`", at.what), help);
    };
    if b.shear.is_some() && b.poisson.is_some() {
        let message = format!("{} has both `shear` and `poisson`", at.what);
        cx.fault(v.origin, message, "write one of them; the other follows with `young`");
        return None;
    }
    let shear = b.shear.or(b.poisson.map(|nu| b.young / (2.0 * (1.0 + nu))));
    if shear.is_none() {
        none(cx, "shear", "write `shear: ..` in Pa, or `poisson: 0.33`");
    }
    let section = [("area", b.area), ("I_y", b.I_y), ("I_z", b.I_z), ("J", b.J)];
    let [area, I_y, I_z, J] = match b.diameter {
        Some(outer) => {
            if let Some((field, _)) = section.iter().find(|(_, x)| x.is_some()) {
                let message = format!("{} has both `diameter` and `{field}`", at.what);
                cx.fault(v.origin, message, SECTION);
                return None;
            }
            let tube = Beam::tube(1.0, outer, b.inner, 1.0, 0.0, 1.0);
            [tube.area, tube.I_y, tube.I_z, tube.J].map(Some)
        }
        None => section.map(|(field, x)| {
            if x.is_none() {
                none(cx, field, SECTION);
            }
            x
        }),
    };
    let beam = Beam {
        length: b.length,
        young: b.young,
        shear: shear?,
        density: b.density,
        area: area?,
        I_y: I_y?,
        I_z: I_z?,
        J: J?,
        ends: b.ends,
        damping_ratio: b.damping_ratio,
    };
    generated(cx, v.origin, &at.what, beam.modes(b.count))
}

/// Reads `File("boom.ron")`: modes in the format of serde.
fn file(cx: &mut Cx, inner: &Located, at: &At<'_>) -> Option<Modes> {
    let (what, (files, home)) = (&at.what, at.near?);
    let name = text().read(cx, inner, at)?;
    let read = match files.find(&name.text, home) {
        Ok((key, Home::Folder(_))) => linkwork_formats::whole_text(Path::new(&key)),
        Ok((key, Home::Embedded(_))) => {
            files.embedded.get(&key).cloned().ok_or_else(|| "it does not exist".into())
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
            let help = "it must contain `(stiffness: [..], stations: [(pose: .., mass: .., translation: [..])])`";
            cx.fault(name.origin, message, help);
            None
        }
    }
}
