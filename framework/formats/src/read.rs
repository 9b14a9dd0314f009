//! Options of the readers, the choice of a reader for a file, and the collector of mistakes.

use crate::error::{FaultKind, FileFault, FilePlace};
use crate::xml::Element;
use crate::{Description, FormatError, Ignored, Initial};
use linkwork_multibody::{BodySpec, Builder, Hinge};
use linkwork_names::suggest;
use linkwork_spatial::{InertiaCheck, InertiaFault, MassProperties, Pose, Vec3};
use std::path::{Path, PathBuf};

/// Attachment of root bodies to the world.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Root {
    /// According to the format: URDF and MJCF weld them; an SDF model floats unless it is static or attached by a joint.
    #[default]
    AsWritten,
    /// Welded.
    Fixed,
    /// The root link has a free hinge.
    Free,
    /// With a planar hinge: motion in the xy plane of the world.
    Planar,
}

/// Handling of mass properties that [`ReadOptions::inertia`] rejects; files of many robots contain some.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Unphysical {
    /// Such mass properties are faults.
    Refused,
    /// They are accepted, with a line in [`Description::doubtful`] that the caller should report: principal moments that violate the triangle
    /// inequality are kept, negative moments become 0, moments without a mass are omitted, and a mass without moments becomes a point mass. Negative
    /// masses, numbers that are not finite, and matrices without a positive moment, except for rounding errors (1e-12 m² times the mass), remain
    /// faults.
    #[default]
    Read,
}

/// Options of the readers.
#[derive(Clone, Debug, Default)]
pub struct ReadOptions {
    /// Attachment of roots to the world.
    pub root: Root,
    /// Check for unphysical inertias.
    pub inertia: InertiaCheck,
    /// Handling of unphysical inertias.
    pub unphysical: Unphysical,
    /// Folders with packages, for `package://name/..` and `model://name/..`.
    pub package_paths: Vec<PathBuf>,
    /// Keyframe of an MJCF file for the start; `None`: the reference configuration.
    pub keyframe: Option<String>,
    /// File of the text, for messages and relative paths.
    pub file: Option<PathBuf>,
}

impl ReadOptions {
    /// Returns the same options for a file.
    #[must_use]
    pub fn at(&self, file: impl Into<PathBuf>) -> Self {
        Self { file: Some(file.into()), ..self.clone() }
    }

    pub(crate) fn file_name(&self) -> String {
        self.file.as_ref().map_or("<text>".into(), |f| f.display().to_string())
    }
}

/// The supported formats.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// `<robot>`.
    Urdf,
    /// `<mujoco>`.
    Mjcf,
    /// `<sdf>`.
    Sdf,
}

/// Returns the format of a text according to its outermost element.
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
                help: "the supported formats are URDF, MJCF and SDF".into(),
            };
            Err(FormatError { faults: vec![FileFault { place: root.place(), kind }] })
        }
    }
}

/// Reads a URDF, MJCF or SDF text.
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
/// An unreadable file, a xacro file, or every mistake of its text.
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

/// The mark with which some programs begin texts in UTF-8.
pub(crate) const BYTE_ORDER_MARK: &[u8] = "\u{feff}".as_bytes();

/// Returns whether a text begins with a byte order mark of UTF-16.
pub(crate) fn is_utf16(bytes: &[u8]) -> bool {
    bytes.starts_with(&[0xff, 0xfe]) || bytes.starts_with(&[0xfe, 0xff])
}

/// Size of the largest readable file, in bytes.
pub const LARGEST_FILE: u64 = 1 << 30;

/// Returns the bytes of a regular file of at most [`LARGEST_FILE`], so that a device or pipe cannot block the program and a file cannot fill the
/// memory.
///
/// # Errors
/// The reason why it cannot be read.
pub fn whole_file(path: &Path) -> Result<Vec<u8>, String> {
    use std::io::Read;
    // Check before opening, because opening a pipe blocks until it has a writer.
    if !path.metadata().map_err(|e| e.to_string())?.is_file() {
        return Err("it is not a regular file".into());
    }
    let file = std::fs::File::open(path).map_err(|e| e.to_string())?;
    let length = file.metadata().map_err(|e| e.to_string())?.len();
    let large = || Err(format!("it is larger than {} MiB", LARGEST_FILE >> 20));
    if length > LARGEST_FILE {
        return large();
    }
    let mut bytes = Vec::new();
    // Some files are longer than their metadata.
    file.take(LARGEST_FILE + 1).read_to_end(&mut bytes).map_err(|e| e.to_string())?;
    if bytes.len() as u64 > LARGEST_FILE { large() } else { Ok(bytes) }
}

/// Returns the contents of a file as UTF-8 text, without a byte order mark.
///
/// # Errors
/// The reason why it cannot be read.
pub fn whole_text(path: &Path) -> Result<String, String> {
    let mut bytes = whole_file(path)?;
    if is_utf16(&bytes) {
        return Err("it is a text in UTF-16; save it as UTF-8".into());
    }
    if bytes.starts_with(BYTE_ORDER_MARK) {
        bytes.drain(..BYTE_ORDER_MARK.len());
    }
    String::from_utf8(bytes).map_err(|e| format!("it is not a text: {e}"))
}

/// Collects mistakes and ignored elements while a file is read.
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

    /// Returns a required attribute that is not empty.
    pub fn required<'e>(&mut self, e: &'e Element, name: &str, what: &str) -> Option<&'e str> {
        match e.attr(name) {
            Some(v) if !v.is_empty() => Some(v),
            _ => {
                self.missing(e, what, &format!("`{name}`"), format!("write {name}=\"..\""));
                None
            }
        }
    }

    /// Reads numbers of a text; returns `None` and reports a fault if they are not `N` finite numbers.
    pub fn parse<const N: usize>(
        &mut self,
        place: FilePlace,
        text: &str,
        what: &str,
    ) -> Option<[f64; N]> {
        let list = self.parse_list(place.clone(), text, what, N..=N)?;
        list.try_into().ok()
    }

    /// Reads numbers of a text, as many as `count` allows.
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

    /// Reads numbers of an attribute, or returns `None` if it is missing.
    pub fn numbers<const N: usize>(
        &mut self,
        e: &Element,
        name: &str,
        what: &str,
    ) -> Option<[f64; N]> {
        let text = e.attr(name)?;
        self.parse(e.place_of(name), text, &format!("{what}: `{name}`"))
    }

    /// Reads one number of an attribute, or returns `None` if it is missing.
    pub fn number(&mut self, e: &Element, name: &str, what: &str) -> Option<f64> {
        self.numbers::<1>(e, name, what).map(|[x]| x)
    }

    /// Reads a direction from an attribute and normalizes it.
    pub fn direction(&mut self, e: &Element, name: &str, what: &str) -> Option<Vec3> {
        let n = Vec3::from(self.numbers::<3>(e, name, what)?);
        let text = e.attr(name).unwrap_or_default();
        self.unit(e.place_of(name), n, text, what)
    }

    /// Normalizes a vector, or reports a fault.
    pub fn unit(&mut self, place: FilePlace, n: Vec3, text: &str, what: &str) -> Option<Vec3> {
        // Scale first, so that the squares neither vanish nor overflow.
        let scale = n.amax();
        if !(1e-100..=1e100).contains(&scale) {
            let expected = "a nonzero vector";
            self.bad(place, what, text, expected, "write for example 0 0 1");
            return None;
        }
        let scaled = n / scale;
        // Do not change the digits of a unit vector.
        let unit = scale < 2.0 && (n.norm_squared() - 1.0).abs() <= 8.0 * f64::EPSILON;
        if unit { Some(n) } else { Some(scaled / scaled.norm()) }
    }

    /// Returns a length, mass or size that is not negative; otherwise reports a fault and returns `None`.
    pub fn not_negative(&mut self, place: FilePlace, x: f64, what: &str) -> Option<f64> {
        if x >= 0.0 {
            return Some(x);
        }
        let text = x.to_string();
        self.bad(place, what, &text, "a number that is not negative", "write 0 or more");
        None
    }

    /// Returns the mass properties of an element, if a body can have them. With the lenient check, moments without a mass are omitted and listed.
    pub fn checked(&mut self, e: &Element, what: String, mass: MassProperties) -> MassProperties {
        let mass = mass.with_check(self.options.inertia);
        let lenient = mass.check == InertiaCheck::PositiveMoments;
        match mass.validate() {
            Ok(_) => mass,
            Err(error)
                if lenient && matches!(error.faults[..], [InertiaFault::MasslessButInertia(_)]) =>
            {
                self.ignored.push(e.ignored(what, format!("{error}: ignored")));
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
                    "correct the numbers, or read the file with the inertia check `Warn`, which uses the nearest valid ones, or \
                     `PositiveMoments`, which accepts lumped rotors and ignores moments without a mass"
                };
                self.fault(e.place(), FaultKind::Inertia { what, error, help: help.into() });
                MassProperties::massless()
            }
        }
    }

    /// Reports an unknown name.
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

    /// Reports every value that requires xacro.
    pub fn refuse_xacro(&mut self, root: &Element) {
        for (e, _) in root.walk() {
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
        }
    }

    /// Returns the description if it is valid; builds the mechanism once to check it.
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
            // An element that is read twice, for its mass and its shape, is reported once.
            self.faults.sort_by_cached_key(|f| (f.place.clone(), f.kind.to_string()));
            self.faults.dedup_by_key(|f| (f.place.clone(), f.kind.to_string()));
            return Err(FormatError { faults: self.faults });
        }
        let format = match root.name.as_str() {
            "robot" => Format::Urdf,
            "mujoco" | "mujocoinclude" => Format::Mjcf,
            _ => Format::Sdf,
        };
        self.ignored.extend(root.unread(Some(crate::tables::of(format) as &dyn crate::xml::Names)));
        self.ignored.sort();
        self.ignored.dedup();
        d.ignored = self.ignored;
        self.doubtful.sort();
        self.doubtful.dedup();
        d.doubtful = self.doubtful;
        Ok(d)
    }
}

/// Ratio of moments to mass, m², below which a body is a point.
const POINT: f64 = 1e-12;

/// Returns mass properties according to [`Unphysical::Read`], with a description, or `None` if that is impossible.
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
        return Some((MassProperties::massless(), "ignored"));
    }
    let mass = mass.with_check(InertiaCheck::PositiveMoments);
    if faults.iter().any(|f| matches!(f, Triangle { .. })) {
        return Some((mass, "used unchanged"));
    }
    let mut moments = mass.inertia_com.symmetric_eigen();
    // Round-off of a zero inertia is treated as the zero inertia of a point.
    let point = moments.eigenvalues.amax() < POINT * mass.mass;
    if !(moments.eigenvalues.max() > 0.0 || point) {
        return None;
    }
    moments.eigenvalues.apply(|x| *x = x.max(0.0));
    let raised = MassProperties { inertia_com: moments.recompose(), ..mass };
    raised.validate().is_ok().then_some((raised, "negative values are replaced by 0"))
}

/// Returns the hinge of a root; `as_written` is that of the format.
pub(crate) fn root_hinge(root: Root, as_written: Hinge) -> Hinge {
    match root {
        Root::AsWritten => as_written,
        Root::Fixed => Hinge::locked(),
        Root::Free => Hinge::free(),
        Root::Planar => Hinge::planar(),
    }
}

/// Creates a body on the world at `X_WB`. Coordinates of a free hinge are the pose in the world.
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

/// Reports moving bodies that have no mass, including the bodies welded to them. `place` finds the element of a body.
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
        // Go inboard to the body that moves with this one rigidly. A circle has already been
        // reported.
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

/// Shortens a text for a message.
pub(crate) fn shortened(text: &str) -> String {
    match text.char_indices().nth(60) {
        Some((i, _)) => format!("{}…", &text[..i]),
        None => text.into(),
    }
}
