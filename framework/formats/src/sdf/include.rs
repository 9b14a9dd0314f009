//! `<include>`: the model of another file replaces it.
//!
//! ```text
//! include            the model of the file, with name, pose, placement_frame and static of the include
//! include, merged    the contents of that model; poses relative to the model become relative to a frame
//!                    `_merged__NAME__model__` at the pose of the model
//! ```

use super::version;
use crate::error::FaultKind;
use crate::read::{Cx, ReadOptions};
use crate::xml::{Element, parse};
use std::path::{Component, Path, PathBuf};

/// Maximum nesting of includes, and maximum number of includes.
const DEPTH: usize = 50;
const FILES: usize = 10_000;

/// Replaces every include.
pub(super) fn expand(cx: &mut Cx<'_>, root: &mut Element) {
    let open: Vec<PathBuf> = cx.options.file.iter().map(|p| same(p)).collect();
    let mut walk = Walk { open, files: 0 };
    walk.holder(cx, root);
}

struct Walk {
    /// The open files, each included by the one before.
    open: Vec<PathBuf>,
    files: usize,
}

impl Walk {
    /// Replaces the includes of `<sdf>`, worlds and models.
    fn holder(&mut self, cx: &mut Cx<'_>, e: &mut Element) {
        for mut child in std::mem::take(&mut e.children) {
            match child.name.as_str() {
                "world" | "model" => {
                    self.holder(cx, &mut child);
                    e.children.push(child);
                }
                "include" => match self.include(cx, &child) {
                    Some(model) if is(child.attr("merge")) && can_merge(&model, e) => {
                        e.children.extend(merged(model, &e.name));
                    }
                    Some(model) => {
                        if is(child.attr("merge")) {
                            let note = "merge=\"true\" of a model with links in a world: the model is included unchanged, because a world has no links";
                            cx.ignored.push(child.ignored("sdf/include", note));
                        }
                        e.children.push(model);
                    }
                    None => {}
                },
                _ => e.children.push(child),
            }
        }
    }

    /// Returns the model of an include; `None` after a fault.
    fn include(&mut self, cx: &mut Cx<'_>, e: &Element) -> Option<Element> {
        let Some((at, uri)) = e.child_text("uri").filter(|(_, text)| !text.is_empty()) else {
            cx.missing(e, "<include>", "<uri>", "write <uri>model://..</uri>");
            return None;
        };
        let from = self.open.last().cloned();
        let Some(path) = find(uri, from.as_deref(), cx.options) else {
            let note = format!(
                "the include of `{}` was not found: add its folder to the packages, or write a path relative to \
                 this file; online models must be downloaded first",
                crate::read::shortened(uri)
            );
            cx.ignored.push(at.ignored("sdf/include", note));
            return None;
        };
        let real = same(&path);
        if let Some(first) = self.open.iter().position(|p| *p == real) {
            let ring = self.open[first..].iter().chain([&real]).map(|p| p.display().to_string());
            cx.fault(at.place(), FaultKind::IncludeCycle { path: ring.collect() });
            return None;
        }
        self.files += 1;
        if self.open.len() > DEPTH || self.files > FILES {
            let what = format!("more than {FILES} includes, or includes more than {DEPTH} deep");
            let help = "include fewer files".to_owned();
            cx.fault(at.place(), FaultKind::Unsupported { what, help });
            return None;
        }
        let model = self.model_of(cx, at, &path)?;
        self.open.push(real);
        let mut holder = model;
        self.holder(cx, &mut holder);
        self.open.pop();
        Some(placed(holder, e))
    }

    /// Returns the only model of a file.
    fn model_of(&self, cx: &mut Cx<'_>, at: &Element, path: &Path) -> Option<Element> {
        let name = path.display().to_string();
        let text = match crate::whole_text(path) {
            Ok(text) => text,
            Err(reason) => {
                let help = "the file must be readable".to_owned();
                let kind = FaultKind::NoFile { what: "<include>".into(), name, reason, help };
                cx.fault(at.place(), kind);
                return None;
            }
        };
        let mut root = match parse(&text, &name) {
            Ok(root) => root,
            Err(error) => {
                cx.faults.extend(error.faults);
                return None;
            }
        };
        if root.name != "sdf" {
            let help = "only models in SDF can be included".to_owned();
            let kind = FaultKind::WrongRoot { found: root.name.clone(), expected: "<sdf>", help };
            cx.fault(root.place(), kind);
            return None;
        }
        version::prepare(cx, &mut root);
        let (models, rest): (Vec<Element>, Vec<Element>) =
            std::mem::take(&mut root.children).into_iter().partition(|c| c.name == "model");
        for other in rest {
            cx.ignored.push(other.ignored("sdf", format!("element <{}>", other.name)));
        }
        let count = models.len();
        let mut models = models.into_iter();
        match (models.next(), count) {
            (Some(model), 1) => Some(model),
            _ => {
                let what = format!("the included file has {count} models");
                let help = "an included file must contain one <model>".to_owned();
                cx.fault(root.place(), FaultKind::Unsupported { what, help });
                None
            }
        }
    }
}

fn is(text: Option<&str>) -> bool {
    matches!(text, Some("true" | "1"))
}

/// Returns the model with the properties of its include.
fn placed(mut model: Element, include: &Element) -> Element {
    for c in &include.children {
        match c.name.as_str() {
            "uri" => {}
            "name" => model.replace("name", c.text.clone()),
            "placement_frame" => {
                // A placement frame of the include replaces the model's pose, even if the include
                // does not have a pose.
                model.replace("placement_frame", c.text.clone());
                if include.child("pose").is_none() {
                    model.children.retain(|m| m.name != "pose");
                }
            }
            "pose" | "static" => {
                model.children.retain(|m| m.name != c.name);
                if c.name == "pose" && include.child("placement_frame").is_none() {
                    model.attributes.retain(|a| a.name != "placement_frame");
                }
                model.children.push(c.clone());
            }
            // All other elements are listed as not used.
            _ => model.children.push(c.clone()),
        }
    }
    model
}

/// Returns whether the contents of a model may be contents of the element around its include. A world contains models, frames and joints.
fn can_merge(model: &Element, around: &Element) -> bool {
    let has_links = model.children.iter().any(|c| c.name == "link");
    around.name == "model" || (around.name == "world" && !has_links)
}

/// Returns the contents of a merged model, with a frame in place of the model. `around`: name of the element that gets them.
fn merged(mut model: Element, around: &str) -> Vec<Element> {
    let outer = if around == "world" { "world" } else { "__model__" };
    let name = model.attr("name").unwrap_or_default().to_owned();
    let frame = format!("_merged__{name}__model__");
    let first = model.children.iter().find(|c| c.name == "link").and_then(|l| l.attr("name"));
    let canonical = model.attr("canonical_link").or(first).unwrap_or_default().to_owned();
    let mut proxy = Element::like(&model, "frame");
    proxy.set("name", frame.clone());
    proxy.set("attached_to", if around == "world" { outer.to_owned() } else { canonical });
    // The pose of an include is relative to the model around it, not to the link that the frame is attached to.
    let mut pose = Element::like(&model, "pose");
    if let Some(own) = model.child("pose") {
        pose = own.clone();
    }
    if pose.attr("relative_to").is_none() {
        pose.set("relative_to", outer.into());
    }
    proxy.children.push(pose);
    proxy.set("merged", "true".into());
    if let Some(placement) = model.attr("placement_frame") {
        proxy.set("placement_frame", placement.to_owned());
    }
    let mut out = vec![proxy];
    for mut c in std::mem::take(&mut model.children) {
        match c.name.as_str() {
            "pose" | "static" => continue,
            "link" | "frame" | "model" => relative_to(&mut c, &frame),
            "joint" => in_joint(&mut c, &frame),
            _ => {}
        }
        out.push(c);
    }
    out
}

/// Changes references to the merged model to its frame.
fn relative_to(e: &mut Element, frame: &str) {
    let named = |e: &Element, name: &str| e.attr(name).filter(|v| !v.is_empty()).map(str::to_owned);
    if e.name == "frame" {
        let attached = named(e, "attached_to");
        if attached.as_deref().is_none_or(|a| a == "__model__") {
            e.replace("attached_to", frame.into());
        }
    }
    let attached = e.name == "frame" && named(e, "attached_to").is_some();
    if e.child("pose").is_none() {
        if attached {
            return; // already relative to the frame to which it is attached
        }
        let pose = Element::like(e, "pose");
        e.children.push(pose);
    }
    for p in e.children.iter_mut().filter(|c| c.name == "pose") {
        match named(p, "relative_to").as_deref() {
            None if attached => {}
            None | Some("__model__") => p.replace("relative_to", frame.into()),
            Some(_) => {}
        }
    }
}

fn in_joint(e: &mut Element, frame: &str) {
    for c in &mut e.children {
        match c.name.as_str() {
            "parent" | "child" if c.text == "__model__" => c.text = frame.into(),
            "pose" if c.attr("relative_to") == Some("__model__") => {
                c.replace("relative_to", frame.into());
            }
            "axis" | "axis2" => {
                for xyz in c.children.iter_mut().filter(|x| x.name == "xyz") {
                    if xyz.attr("expressed_in") == Some("__model__") {
                        xyz.replace("expressed_in", frame.into());
                    }
                }
            }
            _ => {}
        }
    }
}

/// Returns the SDF file of a URI: a file, or a folder with a `model.config` or a `model.sdf`.
fn find(uri: &str, from: Option<&Path>, options: &ReadOptions) -> Option<PathBuf> {
    let home = from.and_then(Path::parent);
    let path = match uri.strip_prefix("model://").or(uri.strip_prefix("package://")) {
        Some(rest) => {
            let rest = Path::new(rest.trim_end_matches('/'));
            if !rest.components().all(|c| matches!(c, Component::Normal(_))) {
                return None;
            }
            let first = rest.components().next()?;
            let inside = rest.strip_prefix(first).ok()?;
            let start = home.map(|h| std::path::absolute(h).unwrap_or_else(|_| h.into()));
            let around = start.iter().flat_map(|s| s.ancestors()).map(Path::to_path_buf);
            let folders = options.package_paths.iter().cloned().chain(around);
            folders.into_iter().find_map(|folder| {
                let own = folder.file_name() == Some(first.as_os_str());
                let direct = folder.join(rest);
                let named = own.then(|| folder.join(inside));
                [Some(direct), named].into_iter().flatten().find(|p| p.exists())
            })?
        }
        None if uri.contains("://") && !uri.starts_with("file://") => return None,
        None => home.unwrap_or(Path::new("")).join(uri.strip_prefix("file://").unwrap_or(uri)),
    };
    let file = if path.is_dir() { of_folder(&path) } else { path };
    file.is_file().then_some(file)
}

/// Returns the newest file in a `model.config`, otherwise `model.sdf`.
fn of_folder(folder: &Path) -> PathBuf {
    let config = folder.join("model.config");
    let read = crate::whole_text(&config).ok().and_then(|t| parse(&t, "model.config").ok());
    let newest = read.and_then(|root| {
        let files = root.children.iter().filter(|c| c.name == "sdf" && !c.text.is_empty());
        let newest =
            files.max_by_key(|f| version::number(f.attr("version").unwrap_or_default()))?;
        let name = Path::new(&newest.text);
        let plain = name.components().all(|c| matches!(c, Component::Normal(_)));
        plain.then(|| folder.join(name))
    });
    newest.unwrap_or_else(|| folder.join("model.sdf"))
}

/// Returns the unique name of a file.
fn same(path: &Path) -> PathBuf {
    std::fs::canonicalize(path).unwrap_or_else(|_| path.into())
}
