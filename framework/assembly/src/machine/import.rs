//! `import: (file: "leo.urdf", root: Free)`: the bodies of a URDF, MJCF or SDF file in an assembly.
//!
//! The file's bodies become bodies of the assembly as if they were written there: parts can bind to them by name, and they can be overridden and used
//! as parents. Its couplings and loops, and optionally its collision shapes, are imported, too. Its actuators, tendons and sensors become parts.
use crate::form::assembly::{AssemblyForm, ItemForm};
use crate::form::import::{ImportCheck, ImportForm, Optional};
use crate::machine::companion;
use crate::machine::convert::{self, Collide};
use crate::schema::kind::At;
use crate::schema::record::Record;
use crate::text::files::{Files, Home};
use crate::text::report::Cx;
use crate::text::show::Failure;
use crate::text::value::{Text, full_name, set};
use linkwork_formats::{Description, Device, DeviceKind, FormatError, Places, ReadOptions};
use linkwork_runtime::{Fault, Located, Origin, Value};
use linkwork_spatial::Pose;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// A file that an assembly imports, with the list of ignored elements.
#[derive(Clone, Debug, PartialEq)]
pub struct Import {
    /// Path of the assembly; empty at the top level.
    pub path: String,
    /// The file.
    pub file: String,
    /// Its description, including the companion file.
    pub description: Description,
    /// Elements that are not in the assembly, one line each.
    pub left_out: Vec<String>,
    /// Body in the file → full name in the mechanism.
    pub bodies: BTreeMap<String, String>,
    /// Position of the import in the file.
    pub origin: Origin,
}

impl Import {
    /// Returns warnings about elements of the file that were not used, and about inertias that no rigid body can have.
    pub fn warnings(&self) -> impl Iterator<Item = Fault> {
        [self.unused(), self.doubtful()].into_iter().flatten()
    }

    /// Returns a warning about mass properties that no rigid body can have.
    fn doubtful(&self) -> Option<Fault> {
        let lines = &self.description.doubtful;
        let first: Vec<String> = lines.iter().take(SHOWN).map(ToString::to_string).collect();
        let more = lines.len().saturating_sub(SHOWN);
        let more = if more > 0 { format!("\n    and {more} more") } else { String::new() };
        let text = format!(
            "`{}` has mass properties that no rigid body can have:\n    {}{more}",
            self.file,
            first.join("\n    ")
        );
        let help = "correct the file; `inertia_check: Physical` in the import rejects it, and `PositiveMoments` \
                    accepts it, for data with lumped rotors";
        (!lines.is_empty()).then(|| Fault::new(self.origin, text).help(help))
    }

    /// Returns a warning about elements of the file that are not in the assembly or that the reader ignored: a line per kind, with its first
    /// positions.
    fn unused(&self) -> Option<Fault> {
        let mut kinds: BTreeMap<String, Vec<String>> = BTreeMap::new();
        for line in &self.left_out {
            let (what, of) = line.split_once(" of ").unwrap_or((line, ""));
            kinds.entry(what.to_lowercase()).or_default().push(of.into());
        }
        for i in &self.description.ignored {
            let place = match i.file == self.file || i.file.is_empty() {
                true => format!("{} (line {})", i.path, i.line),
                false => format!("{} ({}:{})", i.path, i.file, i.line),
            };
            kinds.entry(i.what.clone()).or_default().push(place);
        }
        if kinds.is_empty() {
            return None;
        }
        let mut text = format!("elements of `{}` that are not used:", self.file);
        for (what, places) in kinds {
            let mut first: Vec<&str> = places.iter().map(String::as_str).collect();
            first.retain(|p| !p.is_empty());
            let more = first.len().saturating_sub(SHOWN);
            first.truncate(SHOWN);
            let colon = if first.is_empty() { "" } else { ": " };
            text += &format!("\n    {what}{colon}{}", first.join(", "));
            if more > 0 {
                text += &format!(" and {more} more");
            }
        }
        let help = "the simulation runs without them: write the important ones in the assembly or in the companion file, or \
                    remove them from the file";
        Some(Fault::new(self.origin, text).help(help))
    }
}

/// Number of positions in a warning.
const SHOWN: usize = 3;

/// Reads a URDF, MJCF or SDF file, and its companion file (`robot.linkwork.ron` for `robot.urdf`), if there is one.
///
/// # Errors
/// All mistakes in the file or in the companion file.
pub fn read_machine(path: impl AsRef<Path>, options: &ReadOptions) -> Result<Description, Failure> {
    let (path, mut cx) = (path.as_ref(), Cx::default());
    let read = linkwork_formats::read_file(path, options);
    if let Ok(mut d) = read.map_err(|e| faults(&mut cx, Origin::NONE, e)) {
        if let Some(beside) = beside(path).filter(|p| p.is_file()) {
            read_companion(&mut cx, Origin::NONE, &beside, &mut d);
        }
        if cx.faults.is_empty() {
            return Ok(d);
        }
    }
    Err(Failure { faults: cx.faults, sources: cx.sources })
}

/// `robot.linkwork.ron` for `robot.urdf`.
fn beside(path: &Path) -> Option<PathBuf> {
    let stem = path.file_stem()?.to_string_lossy().into_owned();
    Some(path.with_file_name(format!("{stem}.linkwork.ron")))
}

fn faults(cx: &mut Cx, origin: Origin, error: FormatError) {
    cx.explained(origin, "", error.faults);
}

fn read_companion(cx: &mut Cx, origin: Origin, path: &Path, d: &mut Description) {
    match linkwork_formats::whole_text(path) {
        Ok(text) => companion::read(cx, &path.display().to_string(), &text, d),
        Err(e) => cx.fault(
            origin,
            format!("`{}` cannot be read: {e}", path.display()),
            "it must be a readable UTF-8 text",
        ),
    }
}

/// Returns the assembly together with the bodies, loops, couplings and colliders of its imports.
pub(crate) fn with_imports(
    cx: &mut Cx,
    files: &Files<'_>,
    imports: &Located,
    place: (&str, &Home),
    own: &AssemblyForm,
    found: &mut Vec<Import>,
) -> AssemblyForm {
    let mut out = own.clone();
    let one = std::slice::from_ref(imports);
    let items = match &imports.value {
        Value::Null => &[],
        Value::List(items) => items.as_slice(),
        _ => one,
    };
    for item in items {
        let Some(import) = read(cx, files, item, place) else { continue };
        let more = import.1;
        let kinds = [
            ("body", more.bodies, &mut out.bodies),
            ("loop", more.loops, &mut out.loops),
            ("coupling", more.couplings, &mut out.couplings),
            ("collider", more.colliders, &mut out.colliders),
        ];
        for (kind, forms, all) in kinds {
            for (name, form) in forms {
                if all.insert(name.clone(), form).is_some() {
                    let message = format!("the import has a {kind} `{name}`, which already exists");
                    cx.fault(item.origin, message, "use a separate part for the import");
                }
            }
        }
        for (name, part) in more.parts {
            if out.parts.contains_key(&name) || out.exports.contains_key(&name) {
                let message = format!("the import has a part `{name}`, which already exists");
                let help = "put the import into a separate part, or exclude devices: `leave_out: [actuators, tendons, sensors]`";
                cx.fault(item.origin, message, help);
            }
            out.parts.insert(name, part);
        }
        out.exports.extend(more.exports);
        add_pairs(&mut out, more.ignore);
        found.push(import.0);
    }
    out
}

/// Adds pairs that do not meet to those that an assembly has.
fn add_pairs(to: &mut AssemblyForm, more: Option<Located>) {
    let Some(more) = more else { return };
    match (&mut to.ignore, more.value) {
        (Some(Located { value: Value::List(own), .. }), Value::List(pairs)) => own.extend(pairs),
        (Some(_), _) => {} // the reader reports this
        (none, value) => *none = Some(Located { value, origin: more.origin }),
    }
}

fn read(
    cx: &mut Cx,
    files: &Files<'_>,
    v: &Located,
    (path, home): (&str, &Home),
) -> Option<(Import, AssemblyForm)> {
    let form = ImportForm::read(cx, v, &At::new("`import`"))?;
    let file = &form.file;
    let (key, found) = match files.find(&file.text, home) {
        Ok(found) => found,
        Err(tried) => {
            let message = format!("`import`: there is no file `{}`", file.text);
            cx.fault(file.origin, message, format!("tried: {}", tried.join(", ")));
            return None;
        }
    };
    let options = options(&form, home);
    let read = match &found {
        Home::Folder(_) => linkwork_formats::read_file(&key, &options),
        Home::Embedded(_) => {
            let text = files.embedded.get(&key).map(String::as_str).unwrap_or_default();
            linkwork_formats::read_text(text, &options)
        }
    };
    let mut d = match read {
        Ok(d) => d,
        Err(error) => {
            faults(cx, file.origin, error);
            return None;
        }
    };
    let before = cx.faults.len();
    match (&form.companion, &found) {
        (Some(name), _) => read_named_companion(cx, files, name, home, &mut d),
        (None, Home::Folder(_)) => {
            if let Some(path) = beside(Path::new(&key)).filter(|p| p.is_file()) {
                read_companion(cx, file.origin, &path, &mut d);
            }
        }
        (None, Home::Embedded(_)) => {}
    }
    if cx.faults.len() > before {
        return None;
    }
    let mut left_out = leave_out(&form, &mut d);
    let name = path.rsplit('.').next().unwrap_or_default();
    let collide = if form.collide { Collide::On } else { Collide::Off };
    let converted = convert::convert(name, &d, collide);
    left_out.extend(converted.left_out);
    let (mut made, import) = (converted.assembly, &form);
    for form in made.bodies.values_mut() {
        hang(cx, import, (form, "parent"));
    }
    for form in made.colliders.values_mut() {
        hang(cx, import, (form, "on"));
    }
    let all = [&mut made.bodies, &mut made.loops, &mut made.couplings, &mut made.colliders];
    all.into_iter().flat_map(BTreeMap::values_mut).for_each(|form| form.origin = v.origin);
    let text_of = |file: &str| match &found {
        Home::Folder(_) => linkwork_formats::whole_text(Path::new(file)).ok(),
        Home::Embedded(_) => files.embedded.get(&key).cloned(),
    };
    point_into_files(cx, &d.places, &converted.bodies, text_of, &mut made.bodies);
    if let Some(pairs) = &mut made.ignore {
        pairs.origin = v.origin;
    }
    made.parts.values_mut().for_each(|part| part.origin = v.origin);
    let full = |b: String| full_name(path, &b);
    let bodies = converted.bodies.into_iter().map(|(k, b)| (k, full(b))).collect();
    let (path, file) = (path.to_owned(), key);
    let origin = v.origin;
    Some((Import { path, file, description: d, left_out, bodies, origin }, made))
}

fn read_named_companion(
    cx: &mut Cx,
    files: &Files<'_>,
    name: &Text,
    home: &Home,
    d: &mut Description,
) {
    match files.find(&name.text, home) {
        Ok((key, Home::Folder(_))) => read_companion(cx, name.origin, Path::new(&key), d),
        Ok((key, Home::Embedded(_))) => {
            let text = files.embedded.get(&key).cloned().unwrap_or_default();
            companion::read(cx, &key, &text, d);
        }
        Err(tried) => {
            let message = format!("`import`: there is no companion file `{}`", name.text);
            cx.fault(name.origin, message, format!("tried: {}", tried.join(", ")));
        }
    }
}

/// Sets the origins of imported bodies to their elements in the files, which may be included files, so that messages about a body name its line.
fn point_into_files(
    cx: &mut Cx,
    places: &Places,
    names: &BTreeMap<String, String>,
    text_of: impl Fn(&str) -> Option<String>,
    bodies: &mut BTreeMap<String, ItemForm>,
) {
    // The map contains the index of each file among the sources and the beginnings of its lines.
    let mut open: BTreeMap<&str, Option<(u32, Vec<usize>)>> = BTreeMap::new();
    for (body, place) in &places.0 {
        let Some(form) = names.get(body).and_then(|local| bodies.get_mut(local)) else { continue };
        let file = open.entry(place.file.as_str()).or_insert_with(|| {
            let text = text_of(&place.file)?;
            let ends = text.match_indices('\n').map(|(k, _)| k + 1);
            let lines = std::iter::once(0).chain(ends).collect();
            Some((cx.sources.add(place.file.as_str(), text), lines))
        });
        let Some((source, lines)) = file else { continue };
        let Some(&begin) = lines.get((place.line as usize).wrapping_sub(1)) else { continue };
        let text = &cx.sources.files[*source as usize].1;
        let column = (place.column as usize).saturating_sub(1);
        let offset = text[begin..].char_indices().nth(column).map_or(0, |(k, _)| k);
        let start = begin + offset;
        let end = text[start..].find('>').map_or(text.len(), |k| start + k + 1);
        form.origin = Origin::in_file(*source, start as u32, end as u32);
    }
}

/// Attaches an item on the world, according to `field`, to the import's `parent`, at its `at`.
fn hang(cx: &mut Cx, import: &ImportForm, (form, field): (&mut ItemForm, &str)) {
    let on_world = matches!(
        form.fields.get(field).map(|p| &p.value),
        Some(Value::Text(t)) if t == "world"
    );
    if !on_world {
        return;
    }
    if let Some(Text { text, origin }) = &import.parent {
        let parent = Located { value: Value::Text(text.clone()), origin: *origin };
        set(&mut form.fields, &[field.into()], &parent);
    }
    if import.at != Pose::identity() {
        let own = form.fields.get("at").and_then(|at| Pose::read(cx, at, &At::new("`import`")));
        let both = import.at * own.unwrap_or_else(Pose::identity);
        set(&mut form.fields, &["at".into()], &both.write().into());
    }
}

fn options(import: &ImportForm, home: &Home) -> ReadOptions {
    let ImportCheck { inertia, unphysical } = import.inertia_check;
    let mut out = ReadOptions { root: import.root, inertia, unphysical, ..ReadOptions::default() };
    out.keyframe = import.keyframe.as_ref().map(|k| k.text.clone());
    out.package_paths.extend(import.packages.iter().map(|t| match home {
        Home::Folder(home) => home.join(&t.text),
        Home::Embedded(_) => t.text.clone().into(),
    }));
    out
}

/// Removes the selected elements from the description: couplings, loops, wheels of the companion file.
fn leave_out(import: &ImportForm, d: &mut Description) -> Vec<String> {
    let mut out = Vec::new();
    for kept in &import.leave_out {
        match kept {
            Optional::Couplings => {
                out.extend(d.couplings.drain(..).map(|c| format!("coupling `{}`", c.name)));
            }
            // The assembly has its own parts for wheels, so do not report them as left out.
            Optional::Wheels => d.wheels.clear(),
            Optional::Loops => out.extend(d.loops.drain(..).map(|l| format!("loop `{}`", l.name))),
            Optional::Actuators | Optional::Tendons | Optional::Sensors => {
                let left = |x: &Device| match x.kind {
                    DeviceKind::Actuator(_) => *kept == Optional::Actuators,
                    DeviceKind::Tendon(_) => *kept == Optional::Tendons,
                    DeviceKind::Sensor(_) => *kept == Optional::Sensors,
                    DeviceKind::GravityCompensation { .. } => false,
                };
                let gone = d.devices.iter().filter(|x| left(x));
                out.extend(gone.map(|x| format!("device `{}`", x.name)));
                d.devices.retain(|x| !left(x));
            }
        }
    }
    out
}
