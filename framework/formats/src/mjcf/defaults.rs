//! Default classes of an MJCF file.
//!
//! A class starts as a copy of the class that contains it; its own attributes then replace the copied ones. Later sections therefore change neither
//! earlier classes nor their children. An element with an orientation in one form replaces the orientation of its class in every form.

use crate::error::FaultKind;
use crate::read::Cx;
use crate::xml::Element;
use std::collections::BTreeMap;

/// The forms of an orientation.
pub(super) const ORIENTATIONS: [&str; 5] = ["quat", "axisangle", "euler", "xyaxes", "zaxis"];

/// The class of elements that do not name one.
pub(super) const MAIN: &str = "main";

/// Supported elements of actuators.
pub(super) const ACTUATORS: [&str; 7] =
    ["general", "motor", "position", "velocity", "damper", "intvelocity", "cylinder"];

/// Supported elements of a class, besides actuators.
const READ: [&str; 6] = ["joint", "geom", "site", "mesh", "equality", "tendon"];

/// Whether attributes of this element of a class are read.
fn is_read(kind: &str) -> bool {
    READ.contains(&kind) || ACTUATORS.contains(&kind)
}

/// Attributes by element name and attribute name, each with the element that contains it.
type Values<'e> = BTreeMap<(&'e str, &'e str), &'e Element>;

/// All default classes by name.
pub(super) struct Classes<'e> {
    all: BTreeMap<&'e str, Values<'e>>,
    /// The actuator elements of each class, after those of the classes that contain it, from the outermost.
    actuators: BTreeMap<&'e str, Vec<Vec<&'e Element>>>,
    /// The definition of each nested class.
    places: BTreeMap<&'e str, &'e Element>,
    /// Other names of the outermost class.
    aliases: Vec<&'e str>,
}

/// Returns the classes inside a class of this name, the last one first.
fn inner<'e>(e: &'e Element, name: &'e str) -> Vec<(&'e Element, &'e str)> {
    let mut all: Vec<_> = e.all("default").map(|inner| (inner, name)).collect();
    all.reverse();
    all
}

impl<'e> Classes<'e> {
    /// Reads all `<default>` sections in the order of the file.
    pub fn read(cx: &mut Cx<'_>, root: &'e Element) -> Self {
        let main = BTreeMap::from([(MAIN, Values::new())]);
        let actuators = BTreeMap::from([(MAIN, vec![Vec::new()])]);
        let mut out = Self { all: main, actuators, places: BTreeMap::new(), aliases: Vec::new() };
        for top in root.all("default") {
            // The outermost class of an attached model is independent of `main` of the main file.
            let outermost = match top.scope == root.scope {
                true => MAIN,
                false => top.attr("class").unwrap_or(MAIN),
            };
            if outermost == MAIN {
                out.aliases.extend(top.attr("class"));
            }
            out.actuators.entry(outermost).or_insert_with(|| vec![Vec::new()]);
            out.section(top, outermost);
            let mut todo: Vec<(&'e Element, &'e str)> = inner(top, outermost);
            while let Some((e, outer)) = todo.pop() {
                let Some(own) = out.nested(cx, e, outer) else { continue };
                out.section(e, own);
                todo.extend(inner(e, own));
            }
        }
        out
    }

    /// Creates a nested class as a copy of the class that contains it, and returns its name.
    fn nested(&mut self, cx: &mut Cx<'_>, e: &'e Element, outer: &str) -> Option<&'e str> {
        let own = cx.required(e, "class", "a nested <default>")?;
        if let Some(first) = self.places.get(own) {
            let (first, name) = (first.place(), own.to_owned());
            cx.fault(e.place(), FaultKind::Duplicate { kind: "class", name, first });
            return None;
        }
        self.places.insert(own, e);
        let copy = self.all[outer].clone();
        self.all.insert(own, copy);
        let mut copy = self.actuators.get(outer).cloned().unwrap_or_default();
        copy.push(Vec::new());
        self.actuators.insert(own, copy);
        Some(own)
    }

    /// Adds the attributes of a section to its class.
    fn section(&mut self, e: &'e Element, name: &'e str) {
        let values = self.all.entry(name).or_default();
        for kind in e.children.iter().filter(|c| c.name != "default") {
            // Elements whose attributes are not read are listed as a whole.
            if is_read(&kind.name) {
                kind.touch();
            }
            if ACTUATORS.contains(&kind.name.as_str()) {
                let levels = self.actuators.entry(name).or_default();
                levels.last_mut().into_iter().for_each(|own| own.push(kind));
            }
            if kind.attributes.iter().any(|a| ORIENTATIONS.contains(&a.name.as_str())) {
                let turned = |k: &(&str, &str)| k.0 == kind.name && ORIENTATIONS.contains(&k.1);
                values.retain(|k, _| !turned(k));
            }
            for a in &kind.attributes {
                let before = values.insert((&kind.name, &a.name), kind);
                // An attribute that a later section of the class replaces counts as read.
                if !self.places.contains_key(name)
                    && is_read(&kind.name)
                    && let Some(before) = before
                {
                    before.attr(&a.name);
                }
            }
        }
    }

    /// Returns the name under which a class is stored.
    pub fn find(&self, name: &str) -> Option<&'e str> {
        let known = self.all.get_key_value(name).map(|(k, _)| *k);
        known.or_else(|| self.aliases.contains(&name).then_some(MAIN))
    }

    /// Returns the elements with the initial values of an actuator of this class, by class from the outermost.
    pub fn actuators(&self, class: &str) -> Vec<Vec<&'e Element>> {
        let all: &BTreeMap<&str, Vec<Vec<&'e Element>>> = &self.actuators;
        all.get(class).cloned().unwrap_or_default()
    }

    /// All names.
    pub fn names(&self) -> impl Iterator<Item = &'e str> {
        self.all.keys().copied()
    }

    /// Returns the element of a class that contains an attribute of elements with this name.
    pub fn holder(&self, class: &str, element: &str, attribute: &str) -> Option<&'e Element> {
        // This annotation shortens the lifetime of the key, which permits a lookup with borrowed
        // texts.
        let values: &BTreeMap<(&str, &str), &'e Element> = self.all.get(class)?;
        values.get(&(element, attribute)).copied()
    }
}
