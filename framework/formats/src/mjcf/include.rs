//! `<include file="..">`: the contents of the other file's outermost element replace it.

use crate::error::FaultKind;
use crate::read::Cx;
use crate::xml::{CHAIN, Declarations, Element, parse_with};
use std::path::{Path, PathBuf};

/// Replaces every include of a main file. Each file may be included once, as in MuJoCo, which limits the work.
pub(super) fn expand(cx: &mut Cx<'_>, root: &mut Element, main: Option<&PathBuf>) {
    let mut open: Vec<PathBuf> = main.cloned().into_iter().collect();
    let mut seen: Vec<PathBuf> = open.iter().map(|p| same(p)).collect();
    inside(cx, root, &mut open, &mut seen);
}

/// Files that include each other in a row: each is a level of recursion.
const ROW: usize = 50;

fn inside(cx: &mut Cx<'_>, e: &mut Element, open: &mut Vec<PathBuf>, seen: &mut Vec<PathBuf>) {
    e.for_each(|e, _| {
        if !e.children.iter().any(|c| c.name == "include") {
            return;
        }
        for child in std::mem::take(&mut e.children) {
            match child.name.as_str() {
                "include" => e.children.append(&mut included(cx, &child, open, seen)),
                _ => e.children.push(child),
            }
        }
    });
}

/// Returns the elements of an included file, with its own includes replaced.
fn included(
    cx: &mut Cx<'_>,
    e: &Element,
    open: &mut Vec<PathBuf>,
    seen: &mut Vec<PathBuf>,
) -> Vec<Element> {
    let Some(name) = cx.required(e, "file", "<include>") else { return Vec::new() };
    let place = e.place_of("file");
    // Like MuJoCo, search the file in the folder of the main file first; then in the folder of the including file.
    let folders = [open.first(), open.last()].into_iter().flatten().filter_map(|f| f.parent());
    let candidates: Vec<PathBuf> = folders.map(|f| f.join(name)).collect();
    let Some(path) = candidates.iter().find(|p| p.is_file()).or(candidates.first()).cloned() else {
        let reason = "the text does not have a file whose folder can be searched".to_owned();
        let help = "read the main file by its path".to_owned();
        let (what, name) = ("<include>".into(), name.into());
        cx.fault(place, FaultKind::NoFile { what, name, reason, help });
        return Vec::new();
    };
    if let Some(first) = open.iter().position(|p| same(p) == same(&path)) {
        let ring = open[first..].iter().chain([&path]).map(|p| p.display().to_string());
        let path = ring.collect();
        cx.fault(place, FaultKind::IncludeCycle { path });
        return Vec::new();
    }
    if seen.contains(&same(&path)) {
        let what = format!("the file `{name}` is included a second time");
        let help = "include each file once".to_owned();
        cx.fault(place, FaultKind::Unsupported { what, help });
        return Vec::new();
    }
    if open.len() > ROW {
        let what = format!("more than {ROW} files include each other in a row");
        let help = "include the files from the main file".to_owned();
        cx.fault(place, FaultKind::Unsupported { what, help });
        return Vec::new();
    }
    seen.push(same(&path));
    let text = match path.exists() {
        true => crate::whole_text(&path),
        false => Err("the file does not exist".to_owned()),
    };
    let text = match text {
        Ok(text) => text,
        Err(reason) => {
            let (what, name) = ("<include>".into(), name.into());
            let help = "write the path relative to the main file".into();
            cx.fault(place, FaultKind::NoFile { what, name, reason, help });
            return Vec::new();
        }
    };
    match parse_with(&text, &path.display().to_string(), Declarations::Refused, CHAIN) {
        Ok(mut other) if matches!(other.name.as_str(), "mujoco" | "mujocoinclude") => {
            open.push(path);
            inside(cx, &mut other, open, seen);
            open.pop();
            std::mem::take(&mut other.children)
        }
        Ok(other) => {
            let found = other.name.clone();
            let (expected, help) = ("<mujoco> or <mujocoinclude>", "include MJCF files".into());
            cx.fault(other.place(), FaultKind::WrongRoot { found, expected, help });
            Vec::new()
        }
        Err(error) => {
            cx.faults.extend(error.faults);
            Vec::new()
        }
    }
}

/// Returns the unique name of a file.
fn same(path: &Path) -> PathBuf {
    std::fs::canonicalize(path).unwrap_or_else(|_| path.into())
}
