//! `import: (file: "leo.urdf", root: Free)`: the bodies of a URDF, MJCF or SDF file in an assembly.
//!
//! The file's bodies become bodies of the assembly as if they had been written there: they can be bound,
//! overridden and hung upon by their names.
use crate::context::{Cx, Text, set};
use crate::files::{Files, Home};
use crate::form::{Assembly, BodyForm};
use crate::pose::pose;
use crate::read::{fields, list, text, text_field};
use crate::render::Failure;
use crate::{machine, sidecar};
use linkwork_formats::{Description, FormatError, ReadOptions, Root};
use linkwork_runtime::{Located, Origin, Value, remedy};
use linkwork_spatial::InertiaCheck;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// A file that an assembly imports, as it was read: with what the runtime does not simulate, and with the list of
/// what was ignored.
#[derive(Clone, Debug, PartialEq)]
pub struct Import {
    /// Path of the assembly; empty at the top.
    pub path: String,
    /// The file.
    pub file: String,
    /// What it says, side-car included.
    pub description: Description,
    /// What of it is not in the assembly, a line each.
    pub left_out: Vec<String>,
    /// Body in the file → full name in the mechanism.
    pub bodies: BTreeMap<String, String>,
}

const FIELDS: [&str; 8] =
    ["file", "root", "parent", "at", "inertia_check", "packages", "sidecar", "accept"];

/// Reads a URDF, MJCF or SDF file and the side-car beside it (`robot.linkwork.ron` for `robot.urdf`), if there is one.
///
/// # Errors
/// Everything that is wrong with the file, or with the side-car.
pub fn read_machine(path: impl AsRef<Path>, options: &ReadOptions) -> Result<Description, Failure> {
    let (path, mut cx) = (path.as_ref(), Cx::default());
    let read = linkwork_formats::read_file(path, options);
    if let Ok(mut d) = read.map_err(|e| faults(&mut cx, Origin::NONE, e)) {
        if let Some(beside) = beside(path).filter(|p| p.is_file()) {
            side_car(&mut cx, Origin::NONE, &beside, &mut d);
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
    for fault in error.faults {
        let text = fault.to_string();
        let (message, help) = text.split_once("\n  help: ").unwrap_or((&text, ""));
        cx.fault(origin, message, help);
    }
}

fn side_car(cx: &mut Cx, origin: Origin, path: &Path, d: &mut Description) {
    match std::fs::read_to_string(path) {
        Ok(text) => sidecar::read(cx, &path.display().to_string(), &text, d),
        Err(e) => cx.fault(origin, format!("`{}` cannot be read: {e}", path.display()), ""),
    }
}

/// The bodies of every import of an assembly, beside its own.
pub(crate) fn bodies(
    cx: &mut Cx,
    files: &Files<'_>,
    imports: &Located,
    place: (&str, &Home),
    own: &BTreeMap<String, BodyForm>,
    found: &mut Vec<Import>,
) -> BTreeMap<String, BodyForm> {
    let mut out = own.clone();
    let one = std::slice::from_ref(imports);
    let items = match &imports.value {
        Value::Null => &[],
        Value::List(items) => items.as_slice(),
        _ => one,
    };
    for item in items {
        let Some(import) = read(cx, files, item, place) else { continue };
        for (name, form) in import.1 {
            if out.insert(name.clone(), form).is_some() {
                let message = format!("the import has a body `{name}`, which is there already");
                cx.fault(item.origin, message, "put the import into a part of its own");
            }
        }
        found.push(import.0);
    }
    out
}

fn read(
    cx: &mut Cx,
    files: &Files<'_>,
    v: &Located,
    (path, home): (&str, &Home),
) -> Option<(Import, BTreeMap<String, BodyForm>)> {
    let what = "`import`";
    if !fields(cx, v, what, &FIELDS) {
        return None;
    }
    let Some(file) = text_field(cx, v, "file", what) else {
        cx.fault(v.origin, "`import` has no `file`", "write `import: (file: \"robot.urdf\")`");
        return None;
    };
    let (key, found) = match files.find(&file.text, home) {
        Ok(found) => found,
        Err(tried) => {
            let message = format!("`import`: there is no file `{}`", file.text);
            cx.fault(file.origin, message, format!("tried: {}", tried.join(", ")));
            return None;
        }
    };
    let options = options(cx, v, home);
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
    match (text_field(cx, v, "sidecar", what), &found) {
        (Some(name), _) => named_side_car(cx, files, &name, home, &mut d),
        (None, Home::Folder(_)) => {
            if let Some(path) = beside(Path::new(&key)).filter(|p| p.is_file()) {
                side_car(cx, file.origin, &path, &mut d);
            }
        }
        (None, Home::Embedded(_)) => {}
    }
    if cx.faults.len() > before {
        return None;
    }
    accept(cx, v, &file, &d);
    let name = path.rsplit('.').next().unwrap_or_default();
    let converted = Assembly::from_description(name, &d);
    let mut forms = converted.assembly.bodies;
    for form in forms.values_mut() {
        form.origin = v.origin;
        hang(cx, v, form, &what.replace('`', ""));
    }
    let full = |b: String| crate::reference::full_name(path, &b);
    let bodies = converted.bodies.into_iter().map(|(k, b)| (k, full(b))).collect();
    let (path, file, left_out) = (path.to_owned(), key, converted.left_out);
    Some((Import { path, file, description: d, left_out, bodies }, forms))
}

fn named_side_car(cx: &mut Cx, files: &Files<'_>, name: &Text, home: &Home, d: &mut Description) {
    match files.find(&name.text, home) {
        Ok((key, Home::Folder(_))) => side_car(cx, name.origin, Path::new(&key), d),
        Ok((key, Home::Embedded(_))) => {
            let text = files.embedded.get(&key).cloned().unwrap_or_default();
            sidecar::read(cx, &key, &text, d);
        }
        Err(tried) => {
            let message = format!("`import`: there is no side-car `{}`", name.text);
            cx.fault(name.origin, message, format!("tried: {}", tried.join(", ")));
        }
    }
}

/// A body on the world hangs on the import's `parent`, at its `at`.
fn hang(cx: &mut Cx, import: &Located, form: &mut BodyForm, what: &str) {
    let on_world = matches!(
        form.fields.get("parent").map(|p| &p.value),
        Some(Value::Text(t)) if t == "world"
    );
    if !on_world {
        return;
    }
    if let Some(parent) = import.get("parent") {
        set(&mut form.fields, &["parent".into()], parent);
    }
    if let Some(at) = import.get("at") {
        let X = pose(cx, Some(at), &format!("{what}: `at`"));
        let own = pose(cx, form.fields.get("at"), what);
        let both = machine::pose(&(X * own));
        set(&mut form.fields, &["at".into()], &both.into());
    }
}

fn options(cx: &mut Cx, v: &Located, home: &Home) -> ReadOptions {
    let root = word(
        cx,
        v,
        "root",
        &[
            ("AsWritten", Root::AsWritten),
            ("Fixed", Root::Fixed),
            ("Free", Root::Free),
            ("Planar", Root::Planar),
        ],
    )
    .unwrap_or_default();
    let inertia = word(
        cx,
        v,
        "inertia_check",
        &[("Physical", InertiaCheck::Physical), ("PositiveMoments", InertiaCheck::PositiveMoments)],
    )
    .unwrap_or_default();
    let mut out = ReadOptions { root, inertia, ..ReadOptions::default() };
    if let Some(folders) = v.get("packages") {
        for folder in list(cx, folders, "`import`: `packages`").to_vec() {
            let Some(t) = text(cx, &folder, "a folder of packages") else { continue };
            out.package_paths.push(match home {
                Home::Folder(home) => home.join(t.text),
                Home::Embedded(_) => t.text.into(),
            });
        }
    }
    out
}

/// The meaning of a field that is one of several words.
fn word<T: Copy>(cx: &mut Cx, v: &Located, field: &str, words: &[(&str, T)]) -> Option<T> {
    let written = v.get(field)?;
    let (Value::Variant(given, _) | Value::Text(given)) = &written.value else {
        let all: Vec<&str> = words.iter().map(|(w, _)| *w).collect();
        let help = format!("one of: {}", all.join(", "));
        cx.fault(written.origin, format!("`import`: `{field}` is a word"), help);
        return None;
    };
    let found = words.iter().find(|(w, _)| w == given).map(|(_, t)| *t);
    if found.is_none() {
        let all: Vec<&str> = words.iter().map(|(w, _)| *w).collect();
        let message = format!("`import`: there is no {field} `{given}`");
        cx.fault(written.origin, message, remedy(given, "words", &all));
    }
    found
}

/// Couplings and loops are not simulated: that must be said, or accepted.
fn accept(cx: &mut Cx, v: &Located, file: &Text, d: &Description) {
    let mut accepted = Vec::new();
    if let Some(written) = v.get("accept") {
        for item in list(cx, written, "`import`: `accept`").to_vec() {
            let Some(t) = text(cx, &item, "what is accepted") else { continue };
            if !["couplings", "loops"].contains(&t.text.as_str()) {
                let message = format!("`import`: `{}` need not be accepted", t.text);
                cx.fault(t.origin, message, "one of: couplings, loops");
            }
            accepted.push(t.text);
        }
    }
    let names = |all: Vec<&str>| all.join(", ");
    let couplings = names(d.couplings.iter().map(|c| c.name.as_str()).collect());
    let loops = names(d.loops.iter().map(|l| l.name.as_str()).collect());
    for (what, all) in [("couplings", couplings), ("loops", loops)] {
        if !all.is_empty() && !accepted.iter().any(|a| a == what) {
            let message = format!("`{}` has {what} ({all}), which are not simulated", file.text);
            let help = format!(
                "write `accept: [\"{what}\"]` in the import to run it without them, or take them \
                 out of the file"
            );
            cx.fault(file.origin, message, help);
        }
    }
}
