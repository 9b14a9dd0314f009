//! `<attach model=".." body=".." prefix="..">`: a copy of a part of another file, or of this file, whose names begin with the prefix.
//!
//! ```text
//! body="b"     the body, with its own pose; frames and bodies around it in the other file have no effect
//! frame="f"    the contents of the frame, with its pose
//! neither      everything in <worldbody>
//! ```
//! The other file keeps its own `<compiler>` settings and defaults. Tendons, actuators, sensors, equalities and contact pairs are copied if all
//! elements to which they refer are. A keyframe is copied with the coordinates of the copied joints.

use super::defaults::{Classes, MAIN};
use super::names::{
    Kind, Names, SECTIONS, collect, kind_of_section, name_of, references, rename, value,
};
use super::{Composer, compose};
use crate::error::{FaultKind, FilePlace};
use crate::read::Cx;
use crate::xml::{CHAIN, Declarations, Element, parse_with};
use std::collections::BTreeMap;
use std::path::Path;

/// Maximum number of model files that attach each other in a row: each is a level of recursion.
const ROW: usize = 30;
/// Maximum number of model files that are read.
const MODELS: usize = 1000;

/// A model that can be attached.
struct Source {
    root: Element,
    /// Its settings; `None` for the file that contains the `<attach>`.
    scope: Option<usize>,
    place: FilePlace,
    /// Whether its elements without a name, such as `<option>`, were copied, so that unused ones are reported once.
    listed: bool,
}

/// Replaces every `<attach>`.
pub(super) fn expand(cx: &mut Cx<'_>, root: &mut Element, composer: &mut Composer) {
    let all = || root.walk().filter(|(e, _)| e.name == "attach");
    if all().count() == 0 {
        return;
    }
    let own = all().any(|(e, _)| value(e, "model").is_none());
    let place = root.place();
    let mut own = own.then(|| Source { root: root.clone(), scope: None, place, listed: true });
    let mut models = models(cx, root, composer);
    let mut sections = Vec::new();
    for world in root.children.iter_mut().filter(|c| c.name == "worldbody") {
        world.for_each(|e, _| {
            if !e.children.iter().any(|c| c.name == "attach") {
                return;
            }
            for child in std::mem::take(&mut e.children) {
                if child.name != "attach" {
                    e.children.push(child);
                    continue;
                }
                let source = match child.attr("model") {
                    None => own.as_mut(),
                    Some(name) => {
                        if !models.contains_key(name) {
                            let (names, at) =
                                (models.keys().map(String::as_str), child.place_of("model"));
                            cx.unknown(at, "<attach>", "model", name, names);
                        }
                        models.get_mut(name)
                    }
                };
                let copy = source.and_then(|s| attached(cx, &child, s, composer, &mut sections));
                e.children.extend(copy);
            }
        });
    }
    root.children.append(&mut sections);
}

/// Reads the models in `<asset>`, each with its own attachments and replications.
fn models(cx: &mut Cx<'_>, root: &Element, composer: &mut Composer) -> BTreeMap<String, Source> {
    let mut out: BTreeMap<String, Source> = BTreeMap::new();
    for m in root.all("asset").flat_map(|a| a.all("model")) {
        let Some(file) = cx.required(m, "file", "<model>") else { continue };
        let Some((root, scope)) = model(cx, m, file, composer) else { continue };
        let of_file = || value(&root, "model").unwrap_or_default().to_owned();
        let name = m.attr("name").map_or_else(of_file, str::to_owned);
        let (scope, place) = (Some(scope), m.place());
        let source = Source { root, scope, place: place.clone(), listed: false };
        if let Some(first) = out.insert(name.clone(), source) {
            cx.fault(place, FaultKind::Duplicate { kind: "model", name, first: first.place });
        }
    }
    out
}

/// Reads a model file, relative to the folder of the file that names it; returns its root and its settings.
fn model(
    cx: &mut Cx<'_>,
    m: &Element,
    file: &str,
    composer: &mut Composer,
) -> Option<(Element, usize)> {
    let place = m.place_of("file");
    let none = |reason: String, help: &str| FaultKind::NoFile {
        what: "<model>".into(),
        name: file.into(),
        reason,
        help: help.into(),
    };
    let Some(folder) = composer.open.last().and_then(|f| f.parent()) else {
        let reason = "the text does not have a file whose folder can be searched".to_owned();
        cx.fault(place, none(reason, "read the main file by its path"));
        return None;
    };
    let path = folder.join(file);
    let same = |p: &Path| std::fs::canonicalize(p).unwrap_or_else(|_| p.into());
    if let Some(first) = composer.open.iter().position(|p| same(p) == same(&path)) {
        let ring = composer.open[first..].iter().chain([&path]);
        let path = ring.map(|p| p.display().to_string()).collect();
        cx.fault(place, FaultKind::IncludeCycle { path });
        return None;
    }
    composer.models += 1;
    if composer.open.len() > ROW || composer.models > MODELS {
        let what = match composer.models > MODELS {
            true => format!("more than {MODELS} models are attached"),
            false => format!("more than {ROW} files attach each other in a row"),
        };
        let help = "attach the models from the main file".to_owned();
        cx.fault(place, FaultKind::Unsupported { what, help });
        return None;
    }
    let text = match crate::whole_text(&path) {
        Ok(text) => text,
        Err(reason) => {
            let help = "write the path relative to the file that contains the <model>";
            cx.fault(place, none(reason, help));
            return None;
        }
    };
    let shown = path.display().to_string();
    let mut root = match parse_with(&text, &shown, Declarations::Refused, CHAIN) {
        Ok(root) if root.name == "mujoco" => root,
        Ok(other) => {
            let (found, help) = (other.name.clone(), "attach MJCF files".into());
            cx.fault(other.place(), FaultKind::WrongRoot { found, expected: "<mujoco>", help });
            return None;
        }
        Err(error) => {
            cx.faults.extend(error.faults);
            return None;
        }
    };
    let relative = Path::new(file).parent().map(|p| p.display().to_string()).unwrap_or_default();
    let around = &composer.settings[m.scope].folder;
    let folder = match (around.is_empty(), relative.is_empty()) {
        (true, _) => relative,
        (_, true) => around.clone(),
        _ => format!("{around}/{relative}"),
    };
    composer.open.push(path);
    let scope = compose(cx, &mut root, composer, folder);
    composer.open.pop();
    Some((root, scope))
}

/// Returns the frame that replaces an attachment, and adds sections of the file.
fn attached(
    cx: &mut Cx<'_>,
    e: &Element,
    source: &mut Source,
    composer: &mut Composer,
    sections: &mut Vec<Element>,
) -> Option<Element> {
    e.touch();
    let what = "<attach>";
    let Some(prefix) = e.attr("prefix") else {
        let help = "write prefix=\"left_\": the names of the copy begin with it";
        cx.missing(e, what, "`prefix`", help);
        return None;
    };
    let wanted = match (e.attr("body"), e.attr("frame")) {
        (Some(_), Some(_)) => {
            let what = "<attach> has `body` and `frame`".to_owned();
            let help = "write one of the two".to_owned();
            cx.fault(e.place(), FaultKind::Unsupported { what, help });
            return None;
        }
        (Some(body), None) => Some(("body", body)),
        (None, Some(frame)) => Some(("frame", frame)),
        (None, None) if source.scope.is_none() => {
            let help = "write `model` for another file, or `body` for a copy of a body";
            cx.missing(e, what, "`model`, `body` or `frame`", help);
            return None;
        }
        (None, None) => None,
    };
    let parts = found(&source.root, wanted);
    if parts.is_empty() {
        let (kind, name) = wanted.unwrap_or(("body", "world"));
        let kind = if kind == "body" { "body" } else { "frame" };
        let all: Vec<&str> = (source.root.walk())
            .filter(|(e, _)| e.name == kind)
            .filter_map(|(e, _)| name_of(e))
            .collect();
        cx.unknown(e.place_of(kind), what, kind, name, all.into_iter());
        return None;
    }
    let (mut inside, mut outside) = (Names::new(), Names::new());
    parts.iter().for_each(|(part, _)| collect(part, &mut inside));
    (source.root.children.iter().filter(|c| c.name == "worldbody"))
        .for_each(|world| collect(world, &mut outside));
    outside.retain(|name| !inside.contains(name));
    let size: usize = parts.iter().map(|(part, _)| part.walk().count()).sum();
    let rest: usize = match source.scope {
        Some(_) => (source.root.children.iter().filter(|c| c.name != "worldbody"))
            .map(|c| c.walk().count())
            .sum(),
        None => 0,
    };
    if !composer.spend(cx, e, size + rest) {
        return None;
    }
    if source.scope.is_none()
        && parts.iter().any(|(p, _)| p.walk().any(|(e, _)| e.name == "attach"))
    {
        let what = "<attach> copies a part of this file that contains an <attach>".to_owned();
        let help = "write the part to a separate file, and attach this file as a model".to_owned();
        cx.fault(e.place(), FaultKind::Unsupported { what, help });
        return None;
    }
    composer.attached += 1;
    let top = |c: &&Element| c.name == "default" && Some(c.scope) == source.scope;
    let top = source.root.children.iter().filter(top);
    let aliases = top.filter_map(|c| value(c, "class")).collect();
    let copy = Copy { prefix, number: composer.attached, source, inside, outside, aliases };
    let mut out = Element::like(e, "frame");
    for (part, class) in &parts {
        let mut frame = Element::like(e, "frame");
        frame.set("childclass", copy.class(class));
        // The contents of the world, or the element itself.
        let contents = match part.name == "worldbody" {
            true => part.children.iter().collect(),
            false => vec![*part],
        };
        frame.children = contents.into_iter().map(|c| copy.renamed(c)).collect();
        out.children.push(frame);
    }
    if wanted == Some(("body", "world")) {
        let mut body = Element::like(e, "body");
        body.set("name", format!("{prefix}world"));
        body.children = std::mem::take(&mut out.children);
        out.children.push(body);
    }
    copy.sections(cx, sections);
    source.listed = true;
    Some(out)
}

/// Returns the elements to attach, each with the class of defaults that applies to it. `None`: the contents of every `<worldbody>`.
fn found<'e>(root: &'e Element, wanted: Option<(&str, &str)>) -> Vec<(&'e Element, &'e str)> {
    let worlds = root.children.iter().filter(|c| c.name == "worldbody");
    let inner = |e: &'e Element, class: &'e str| value(e, "childclass").unwrap_or(class);
    let mut todo: Vec<(&Element, &str)> = worlds.map(|w| (w, inner(w, MAIN))).collect();
    let Some((kind, name)) = wanted.filter(|w| *w != ("body", "world")) else { return todo };
    while let Some((e, class)) = todo.pop() {
        for c in &e.children {
            if c.name == kind && value(c, "name") == Some(name) {
                return vec![(c, class)];
            }
            if matches!(c.name.as_str(), "body" | "frame") {
                todo.push((c, inner(c, class)));
            }
        }
    }
    Vec::new()
}

/// The names of one attachment.
struct Copy<'s> {
    prefix: &'s str,
    number: usize,
    source: &'s Source,
    /// Names of the source that are copied, and the others.
    inside: Names,
    outside: Names,
    /// Other names of the outermost class of the source.
    aliases: Vec<&'s str>,
}

impl Copy<'_> {
    /// Returns the name of a class of the source. Classes of different attachments are independent even if their prefix is equal or empty.
    fn class(&self, name: &str) -> String {
        if self.source.scope.is_none() {
            return name.to_owned();
        }
        let name = if self.aliases.contains(&name) { MAIN } else { name };
        format!("{}{name} (attachment {})", self.prefix, self.number)
    }

    fn renamed(&self, e: &Element) -> Element {
        let mut copy = e.clone();
        let own = |name: &str| Some(format!("{}{name}", self.prefix));
        rename(&mut copy, own, |kind, name| match kind {
            Kind::Class => Some(self.class(name)),
            Kind::Body if name == "world" => None,
            // A copy within one file uses the same assets.
            Kind::Asset if self.source.scope.is_none() => None,
            _ => own(name),
        });
        copy
    }

    /// Returns a renamed element of a section, with the outermost class of the source if it has no class.
    fn with_class(&self, e: &Element) -> Element {
        let mut copy = self.renamed(e);
        if value(e, "class").is_none() && self.source.scope.is_some() {
            copy.set("class", self.class(MAIN));
        }
        copy
    }

    /// Adds the sections of the source that belong to the copy.
    fn sections(self, cx: &mut Cx<'_>, out: &mut Vec<Element>) {
        let all = &self.source.root.children;
        if let Some(scope) = self.source.scope {
            // The outermost class exists even if the source has no defaults.
            let mut outermost = Element::like(&self.source.root, "default");
            outermost.set("class", self.class(MAIN));
            out.push(outermost);
            for list in all {
                match list.name.as_str() {
                    "worldbody" | "keyframe" => {}
                    "default" => {
                        let mut copy = self.renamed(list);
                        if list.scope == scope {
                            copy.replace("class", self.class(MAIN));
                        }
                        out.push(copy);
                    }
                    "asset" => out.push(self.assets(list)),
                    name if SECTIONS.contains(&name) => {}
                    _ if self.source.listed => {}
                    _ => out.push(list.clone()),
                }
            }
            out.extend(self.keys(cx));
        }
        let (mut inside, mut outside) = (self.inside.clone(), self.outside.clone());
        for section in SECTIONS {
            for list in all.iter().filter(|c| c.name == section) {
                let mut copy = Element::like(list, section);
                for e in &list.children {
                    let all = references(e);
                    let leaves = all.iter().any(|r| outside.contains(r));
                    let enters = all.iter().any(|r| inside.contains(r));
                    let copied = !leaves && (enters || self.source.scope.is_some());
                    // Later sections may refer to tendons and actuators.
                    if let (Some(kind), Some(name)) = (kind_of_section(section), name_of(e)) {
                        let names = if copied { &mut inside } else { &mut outside };
                        names.insert((kind, name.to_owned()));
                    }
                    if copied {
                        let classed = section != "sensor" && e.name != "exclude";
                        copy.children.push(if classed {
                            self.with_class(e)
                        } else {
                            self.renamed(e)
                        });
                        continue;
                    }
                    if enters && self.source.scope.is_none() {
                        let note = "<attach> does not copy it, because it refers to elements inside and outside of the copied part";
                        cx.ignored.push(e.ignored(format!("mujoco/{section}/{}", e.label()), note));
                    }
                }
                if !copy.children.is_empty() {
                    out.push(copy);
                }
            }
        }
    }

    /// Returns the assets of the source, except models. A name that follows from a file is written, because it gets the prefix.
    fn assets(&self, list: &Element) -> Element {
        let mut copy = Element::like(list, "asset");
        for e in list.children.iter().filter(|e| e.name != "model") {
            let mut e = e.clone();
            let stem = value(&e, "file").map(|f| super::mesh::stem(f).to_owned());
            if let (None, Some(stem)) = (name_of(&e), stem) {
                e.replace("name", stem);
            }
            let classed = matches!(e.name.as_str(), "mesh" | "material");
            copy.children.push(if classed { self.with_class(&e) } else { self.renamed(&e) });
        }
        copy
    }

    /// Returns the keyframes of the source, with the coordinates of the copied joints and, in `joints`, the names of these joints.
    fn keys(&self, cx: &mut Cx<'_>) -> Option<Element> {
        let lists = || self.source.root.children.iter().filter(|c| c.name == "keyframe");
        let mut copy = Element::like(lists().next()?, "keyframe");
        let joints = joints(cx, &self.source.root);
        for e in lists().flat_map(|list| &list.children) {
            let Some(text) = value(e, "qpos") else { continue };
            // A keyframe that was attached to the source has its own list of joints.
            let nested = Some(e.scope) != self.source.scope;
            let own: Vec<(Option<&str>, usize)> = match value(e, "joints").filter(|_| nested) {
                Some(names) => {
                    let of = |n: &str| joints.iter().find(|(j, _)| *j == Some(n)).copied();
                    names.split('\n').filter_map(of).collect()
                }
                None => joints.clone(),
            };
            let words: Vec<&str> = text.split_whitespace().collect();
            let (mut at, mut kept, mut names, mut unnamed) = (0, Vec::new(), Vec::new(), false);
            for (name, n) in own {
                let values = words.get(at..at + n).unwrap_or_default();
                at += n;
                match name {
                    Some(name) if self.inside.contains(&(Kind::Joint, name.to_owned())) => {
                        kept.extend_from_slice(values);
                        names.push(format!("{}{name}", self.prefix));
                    }
                    Some(_) => {}
                    None => unnamed = true,
                }
            }
            let what = format!("mujoco/keyframe/{}", e.label());
            if unnamed || at != words.len() {
                let note = match unnamed {
                    true => {
                        "a keyframe of an attached model with a joint without a name is not read"
                            .to_owned()
                    }
                    false => format!(
                        "a keyframe of an attached model has {} coordinates instead of {at} and is not read",
                        words.len()
                    ),
                };
                cx.ignored.push(e.ignored(what, note));
                continue;
            }
            let mut key = self.renamed(e);
            key.replace("qpos", kept.join(" "));
            key.replace("joints", names.join("\n"));
            copy.children.push(key);
        }
        (!copy.children.is_empty()).then_some(copy)
    }
}

/// Returns the joints of a file with the number of their coordinates, in the order of the coordinates of a keyframe.
fn joints<'e>(cx: &Cx<'_>, root: &'e Element) -> Vec<(Option<&'e str>, usize)> {
    let classes = Classes::read(&mut Cx::new(cx.options), root);
    let mut out = Vec::new();
    let mut todo: Vec<(&'e Element, &'e str)> = Vec::new();
    let inner = |e: &'e Element, class: &'e str| value(e, "childclass").unwrap_or(class);
    let worlds = root.children.iter().filter(|c| c.name == "worldbody");
    todo.extend(worlds.rev().map(|w| (w, inner(w, MAIN))));
    while let Some((body, class)) = todo.pop() {
        // Joints of a body come before its bodies, also through frames.
        let (mut bodies, mut open) = (Vec::new(), vec![(body.children.iter(), class)]);
        while let Some((children, class)) = open.last_mut() {
            let class = *class;
            let Some(c) = children.next() else {
                open.pop();
                continue;
            };
            match c.name.as_str() {
                "frame" => open.push((c.children.iter(), inner(c, class))),
                "body" => bodies.push((c, inner(c, class))),
                "freejoint" => out.push((name_of(c), 7)),
                "joint" => {
                    let class = value(c, "class").and_then(|k| classes.find(k)).unwrap_or(class);
                    let of_class = || value(classes.holder(class, "joint", "type")?, "type");
                    let n = match value(c, "type").or_else(of_class) {
                        Some("free") => 7,
                        Some("ball") => 4,
                        _ => 1,
                    };
                    out.push((name_of(c), n));
                }
                _ => {}
            }
        }
        todo.extend(bodies.into_iter().rev());
    }
    out
}
