//! What a reader may be told, which reader a file needs, and the collector of mistakes.

use crate::error::{FaultKind, FileFault, FilePlace};
use crate::xml::Element;
use crate::{Description, FormatError, Ignored, Initial};
use linkwork_multibody::names::suggest;
use linkwork_multibody::{BodySpec, Builder, Hinge};
use linkwork_spatial::{InertiaCheck, InertiaFault, MassProperties, Pose, Vec3};
use std::path::{Path, PathBuf};

/// How bodies that no joint of the file moves are held by the world.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Root {
    /// As the format says: URDF and MJCF weld them, an SDF model floats unless it is static or
    /// a joint holds it.
    #[default]
    AsWritten,
    /// Welded.
    Fixed,
    /// On a free hinge.
    Free,
    /// On a planar hinge: motion in the xy plane of the world.
    Planar,
}

/// What becomes of mass properties that [`ReadOptions::inertia`] refuses: files of many robots have some.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Unphysical {
    /// They are faults.
    Refused,
    /// They are read, with a line in [`Description::doubtful`]: principal moments that break the triangle inequality as they are, those below
    /// zero as 0, those without a mass not at all; a mass for which the file has no moments is a point. Masses below zero, numbers that are not
    /// finite, and matrices of which no moment is above zero, beyond what rounding leaves (1e-12 m² of the mass), stay faults.
    /// Who reads a file tells whoever gave it those lines.
    #[default]
    Read,
}

/// What a reader may be told.
#[derive(Clone, Debug, Default)]
pub struct ReadOptions {
    /// How roots are held by the world.
    pub root: Root,
    /// Which inertias no body has.
    pub inertia: InertiaCheck,
    /// What becomes of those.
    pub unphysical: Unphysical,
    /// Folders that hold packages, for `package://name/..` and `model://name/..`.
    pub package_paths: Vec<PathBuf>,
    /// The keyframe of an MJCF file that is the start; `None`: the reference configuration.
    pub keyframe: Option<String>,
    /// Where a text came from: for messages, and for what is relative to it.
    pub file: Option<PathBuf>,
}

impl ReadOptions {
    /// The same for a file.
    #[must_use]
    pub fn at(&self, file: impl Into<PathBuf>) -> Self {
        Self { file: Some(file.into()), ..self.clone() }
    }

    pub(crate) fn file_name(&self) -> String {
        self.file.as_ref().map_or("<text>".into(), |f| f.display().to_string())
    }
}

/// The formats that are read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// `<robot>`.
    Urdf,
    /// `<mujoco>`.
    Mjcf,
    /// `<sdf>`.
    Sdf,
}

/// The format of a text, by its outermost element.
///
/// # Errors
/// Malformed XML, or another outermost element.
pub fn format_of(text: &str, options: &ReadOptions) -> Result<Format, FormatError> {
    let root = crate::xml::parse(text, &options.file_name())?;
    match root.name.as_str() {
        "robot" => Ok(Format::Urdf),
        "mujoco" | "mujocoinclude" => Ok(Format::Mjcf),
        "sdf" | "gazebo" => Ok(Format::Sdf),
        other => {
            let kind = FaultKind::WrongRoot {
                found: other.into(),
                expected: "<robot>, <mujoco> or <sdf>",
                help: "URDF, MJCF and SDF files are read here".into(),
            };
            Err(FormatError { faults: vec![FileFault { place: root.place(), kind }] })
        }
    }
}

/// Reads a URDF, MJCF or SDF text, whichever it is.
///
/// # Errors
/// Every mistake of the text.
pub fn read_text(text: &str, options: &ReadOptions) -> Result<Description, FormatError> {
    match format_of(text, options)? {
        Format::Urdf => crate::read_urdf(text, options),
        Format::Mjcf => crate::read_mjcf(text, options),
        Format::Sdf => crate::read_sdf(text, options),
    }
}

/// Reads a URDF, MJCF or SDF file (`.urdf`, `.xml`, `.mjcf`, `.sdf`, `.world`; the outermost element
/// decides). `options.file` is set to `path`.
///
/// # Errors
/// A file that cannot be read, a xacro file, or every mistake of its text.
pub fn read_file(
    path: impl AsRef<Path>,
    options: &ReadOptions,
) -> Result<Description, FormatError> {
    let path = path.as_ref();
    let place = FilePlace { file: path.display().to_string(), ..FilePlace::default() };
    let one = |kind| FormatError { faults: vec![FileFault { place: place.clone(), kind }] };
    if path.extension().is_some_and(|e| e == "xacro") {
        return Err(one(FaultKind::Xacro { text: place.file.clone() }));
    }
    match whole_text(path) {
        Ok(text) => read_text(&text, &options.at(path)),
        Err(reason) => Err(one(FaultKind::Unreadable { reason })),
    }
}

/// Bytes of the largest file that is read whole.
pub const LARGEST_FILE: u64 = 1 << 30;

/// The bytes of a file: of a regular one of at most [`LARGEST_FILE`], so that a device or a pipe does not hold up the
/// program and no file takes all memory.
///
/// # Errors
/// Why it cannot be read, in words.
pub fn whole_file(path: &Path) -> Result<Vec<u8>, String> {
    use std::io::Read;
    // Asked before it is opened: opening a pipe waits for who writes into it.
    if !path.metadata().map_err(|e| e.to_string())?.is_file() {
        return Err("it is no regular file".into());
    }
    let file = std::fs::File::open(path).map_err(|e| e.to_string())?;
    let length = file.metadata().map_err(|e| e.to_string())?.len();
    let large = || Err(format!("it is larger than {} MiB", LARGEST_FILE >> 20));
    if length > LARGEST_FILE {
        return large();
    }
    let mut bytes = Vec::new();
    // Some files are longer than they say.
    file.take(LARGEST_FILE + 1).read_to_end(&mut bytes).map_err(|e| e.to_string())?;
    if bytes.len() as u64 > LARGEST_FILE { large() } else { Ok(bytes) }
}

/// The same as UTF-8 text.
///
/// # Errors
/// Why it cannot be read, in words.
pub fn whole_text(path: &Path) -> Result<String, String> {
    whole_file(path).and_then(|b| String::from_utf8(b).map_err(|e| format!("it is no text: {e}")))
}

/// Collects mistakes and what was ignored while a file is read.
pub(crate) struct Cx<'a> {
    pub options: &'a ReadOptions,
    pub faults: Vec<FileFault>,
    pub ignored: Vec<Ignored>,
    pub doubtful: Vec<Ignored>,
}

impl<'a> Cx<'a> {
    pub fn new(options: &'a ReadOptions) -> Self {
        Self { options, faults: Vec::new(), ignored: Vec::new(), doubtful: Vec::new() }
    }

    pub fn fault(&mut self, place: FilePlace, kind: FaultKind) {
        self.faults.push(FileFault { place, kind });
    }

    pub fn missing(&mut self, at: &Element, what: &str, missing: &str, help: impl Into<String>) {
        let (what, missing) = (what.into(), missing.into());
        self.fault(at.place(), FaultKind::Missing { what, missing, help: help.into() });
    }

    pub fn bad(&mut self, place: FilePlace, what: &str, text: &str, expected: &str, help: &str) {
        let (what, text) = (what.into(), shortened(text));
        let (expected, help) = (expected.into(), help.into());
        self.fault(place, FaultKind::BadValue { what, text, expected, help });
    }

    /// A required attribute that is not empty.
    pub fn required<'e>(&mut self, e: &'e Element, name: &str, what: &str) -> Option<&'e str> {
        match e.attr(name) {
            Some(v) if !v.is_empty() => Some(v),
            _ => {
                self.missing(e, what, &format!("`{name}`"), format!("write {name}=\"..\""));
                None
            }
        }
    }

    /// Numbers of a text; `None` and a fault when they are not `N` finite numbers.
    pub fn parse<const N: usize>(
        &mut self,
        place: FilePlace,
        text: &str,
        what: &str,
    ) -> Option<[f64; N]> {
        let list = self.parse_list(place.clone(), text, what, N..=N)?;
        list.try_into().ok()
    }

    /// Numbers of a text, as many as `count` allows.
    pub fn parse_list(
        &mut self,
        place: FilePlace,
        text: &str,
        what: &str,
        count: std::ops::RangeInclusive<usize>,
    ) -> Option<Vec<f64>> {
        let words: Vec<&str> = text.split_whitespace().collect();
        let list: Vec<f64> =
            words.iter().filter_map(|w| w.parse::<f64>().ok()).filter(|x| x.is_finite()).collect();
        if list.len() == words.len() && count.contains(&list.len()) {
            return Some(list);
        }
        let (low, high) = (count.start(), count.end());
        let expected = match (low, high) {
            (1, 1) => "a finite number".into(),
            (a, b) if a == b => format!("{a} finite numbers"),
            (a, b) => format!("{a} to {b} finite numbers"),
        };
        self.bad(place, what, text, &expected, "write decimal numbers with spaces between");
        None
    }

    /// Numbers of an attribute, or `None` when it is not there.
    pub fn numbers<const N: usize>(
        &mut self,
        e: &Element,
        name: &str,
        what: &str,
    ) -> Option<[f64; N]> {
        let text = e.attr(name)?;
        self.parse(e.place_of(name), text, &format!("{what}: `{name}`"))
    }

    /// One number of an attribute, or `None` when it is not there.
    pub fn number(&mut self, e: &Element, name: &str, what: &str) -> Option<f64> {
        self.numbers::<1>(e, name, what).map(|[x]| x)
    }

    /// A vector of an attribute that has a direction, made unit length.
    pub fn direction(&mut self, e: &Element, name: &str, what: &str) -> Option<Vec3> {
        let n = Vec3::from(self.numbers::<3>(e, name, what)?);
        let text = e.attr(name).unwrap_or_default();
        self.unit(e.place_of(name), n, text, what)
    }

    /// The vector made unit length, or a fault.
    pub fn unit(&mut self, place: FilePlace, n: Vec3, text: &str, what: &str) -> Option<Vec3> {
        // Scaled first, so that the squares neither vanish nor overflow.
        let scale = n.amax();
        if !(1e-100..=1e100).contains(&scale) {
            let expected = "a vector with a direction";
            self.bad(place, what, text, expected, "write for example 0 0 1");
            return None;
        }
        let scaled = n / scale;
        // A unit vector as written keeps its digits.
        let unit = scale < 2.0 && (n.norm_squared() - 1.0).abs() <= 8.0 * f64::EPSILON;
        if unit { Some(n) } else { Some(scaled / scaled.norm()) }
    }

    /// A length, mass or size that must not be negative; `None` and a fault otherwise.
    pub fn not_negative(&mut self, place: FilePlace, x: f64, what: &str) -> Option<f64> {
        if x >= 0.0 {
            return Some(x);
        }
        let text = x.to_string();
        self.bad(place, what, &text, "a number that is not negative", "write 0 or more");
        None
    }

    /// The mass properties that an element gives, if a body can have them. With the lenient check, moments
    /// without a mass are left out and listed.
    pub fn checked(&mut self, e: &Element, what: String, mass: MassProperties) -> MassProperties {
        let mass = mass.with_check(self.options.inertia);
        let lenient = mass.check == InertiaCheck::PositiveMoments;
        match mass.validate() {
            Ok(_) => mass,
            Err(error)
                if lenient && matches!(error.faults[..], [InertiaFault::MasslessButInertia(_)]) =>
            {
                self.ignored.push(e.ignored(what, format!("{error}: left out")));
                MassProperties::massless()
            }
            Err(error)
                if self.options.unphysical == Unphysical::Read
                    && let Some((nearest, how)) = nearest(&mass, &error.faults) =>
            {
                self.doubtful.push(e.ignored(what, format!("{error}: {how}")));
                nearest
            }
            Err(error) => {
                let help = if lenient {
                    "correct the numbers"
                } else {
                    "correct the numbers, or read the file with the inertia check `Warn`, which takes what is nearest, or \
                     `PositiveMoments`, which accepts lumped rotors and leaves out moments without a mass"
                };
                self.fault(e.place(), FaultKind::Inertia { what, error, help: help.into() });
                MassProperties::massless()
            }
        }
    }

    /// A name that leads nowhere.
    pub fn unknown<'n>(
        &mut self,
        place: FilePlace,
        what: &str,
        kind: &'static str,
        name: &str,
        all: impl Iterator<Item = &'n str>,
    ) {
        let help = suggest(name, kind, all);
        let (what, name) = (what.into(), name.into());
        self.fault(place, FaultKind::UnknownName { what, kind, name, help });
    }

    /// Reports every value that only xacro understands.
    pub fn refuse_xacro(&mut self, e: &Element) {
        if e.name.starts_with("xacro:") {
            let text = format!("<{}>", e.name);
            self.fault(e.place(), FaultKind::Xacro { text });
        }
        for a in &e.attributes {
            if a.value.contains("${") || a.value.contains("$(") {
                let text = shortened(&a.value);
                self.fault(e.place_of(&a.name), FaultKind::Xacro { text });
            }
        }
        e.children.iter().for_each(|c| self.refuse_xacro(c));
    }

    /// The description, if nothing is wrong with it: builds the mechanism once to be sure.
    pub fn finish(
        mut self,
        root: &Element,
        mut d: Description,
    ) -> Result<Description, FormatError> {
        if self.faults.is_empty()
            && let Err(error) = d.builder.build()
        {
            let place = FilePlace { line: 0, ..root.place() };
            for fault in error.faults {
                self.fault(place.clone(), FaultKind::Build(fault));
            }
        }
        if !self.faults.is_empty() {
            // What is read twice, for its mass and its shape, is told once.
            self.faults.sort_by_cached_key(|f| (f.place.clone(), f.kind.to_string()));
            self.faults.dedup_by_key(|f| (f.place.clone(), f.kind.to_string()));
            return Err(FormatError { faults: self.faults });
        }
        let format = match root.name.as_str() {
            "robot" => Format::Urdf,
            "mujoco" | "mujocoinclude" => Format::Mjcf,
            _ => Format::Sdf,
        };
        self.ignored.extend(root.unread(Some(crate::tables::of(format))));
        self.ignored.sort();
        self.ignored.dedup();
        d.ignored = self.ignored;
        self.doubtful.sort();
        self.doubtful.dedup();
        d.doubtful = self.doubtful;
        Ok(d)
    }
}

/// Moments over the mass, m², below which a body is a point.
const POINT: f64 = 1e-12;

/// What [`Unphysical::Read`] makes of mass properties, in numbers and words; `None` when nothing can be made of them.
fn nearest(
    mass: &MassProperties,
    faults: &[InertiaFault],
) -> Option<(MassProperties, &'static str)> {
    use InertiaFault::{MasslessButInertia, NegativePrincipalMoment, Triangle};
    let mut other = faults.iter();
    if other
        .any(|f| !matches!(f, MasslessButInertia(_) | NegativePrincipalMoment(_) | Triangle { .. }))
    {
        return None;
    }
    if faults.iter().any(|f| matches!(f, MasslessButInertia(_))) {
        return Some((MassProperties::massless(), "left out"));
    }
    let mass = mass.with_check(InertiaCheck::PositiveMoments);
    if faults.iter().any(|f| matches!(f, Triangle { .. })) {
        return Some((mass, "taken as it is"));
    }
    let mut moments = mass.inertia_com.symmetric_eigen();
    // What rounding leaves of no inertia at all is a point's.
    let point = moments.eigenvalues.amax() < POINT * mass.mass;
    if !(moments.eigenvalues.max() > 0.0 || point) {
        return None;
    }
    moments.eigenvalues.apply(|x| *x = x.max(0.0));
    let raised = MassProperties { inertia_com: moments.recompose(), ..mass };
    raised.validate().is_ok().then_some((raised, "what is below zero is taken as 0"))
}

/// The hinge of a root; `as_written` is what the format does without an option.
pub(crate) fn root_hinge(root: Root, as_written: Hinge) -> Hinge {
    match root {
        Root::AsWritten => as_written,
        Root::Fixed => Hinge::locked(),
        Root::Free => Hinge::free(),
        Root::Planar => Hinge::planar(),
    }
}

/// A body on the world at `X_WB`. Coordinates of a free hinge are the pose in the world.
pub(crate) fn root_body(
    cx: &Cx<'_>,
    spec: BodySpec,
    X_WB: Pose,
    as_written: Hinge,
    d: &mut Description,
) {
    let hinge = root_hinge(cx.options.root, as_written);
    if hinge != Hinge::free() {
        d.builder.body(spec.hinge_in_parent(X_WB).hinge(hinge));
        return;
    }
    if X_WB != Pose::identity() {
        let (p, r) = (X_WB.position, X_WB.rotation.coords);
        let q = vec![p.x, p.y, p.z, r.x, r.y, r.z, r.w];
        d.initial.push(Initial { body: spec.name.clone(), q });
    }
    d.builder.body(spec.hinge(hinge));
}

/// Mass of everything welded to each moving body is zero: reports these bodies. `place` finds the
/// element of a body.
pub(crate) fn report_massless<'e>(
    cx: &mut Cx<'_>,
    builder: &Builder,
    place: impl Fn(&str) -> Option<(&'e Element, String)>,
) {
    let bodies = builder.bodies();
    let index: std::collections::BTreeMap<&str, usize> =
        bodies.iter().enumerate().map(|(i, b)| (b.name.as_str(), i)).collect();
    let moves = |b: &BodySpec| b.hinge.nv() > 0;
    let mut mass: Vec<f64> = vec![0.0; bodies.len()];
    for b in bodies {
        // Up to the body that carries this one rigidly; a ring has been reported already.
        let (mut at, mut steps) = (b, 0);
        while !moves(at)
            && steps <= bodies.len()
            && let Some(p) = index.get(at.parent.as_str())
        {
            at = &bodies[*p];
            steps += 1;
        }
        if let Some(i) = index.get(at.name.as_str()) {
            mass[*i] += b.mass.mass;
        }
    }
    for (b, m) in bodies.iter().zip(mass) {
        if moves(b)
            && m == 0.0
            && let Some((e, path)) = place(&b.name)
        {
            let what = format!("`{}` moves but has no mass (no inertial)", b.name);
            cx.ignored.push(e.ignored(path, what));
        }
    }
}

/// A text short enough for a message.
pub(crate) fn shortened(text: &str) -> String {
    match text.char_indices().nth(60) {
        Some((i, _)) => format!("{}…", &text[..i]),
        None => text.into(),
    }
}
