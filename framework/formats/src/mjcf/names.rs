//! Names in an MJCF file and the attributes that refer to them. Attachments and replications rename both.
//!
//! The functions of this file do not mark attributes as read, because they run before the file is read.

use crate::xml::Element;
use std::collections::BTreeSet;

/// The kind of a name. Names of different kinds are independent of each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Kind {
    Body,
    Joint,
    Geom,
    Site,
    Tendon,
    Actuator,
    /// A class of defaults.
    Class,
    /// A mesh, material, height field or texture.
    Asset,
    /// A camera, light or other element without an effect on the mechanism.
    Other,
}

/// Names with their kinds.
pub(super) type Names = BTreeSet<(Kind, String)>;

/// Sections with elements that refer to bodies and their contents. A section may refer to elements of those before it.
pub(super) const SECTIONS: [&str; 5] = ["tendon", "actuator", "contact", "equality", "sensor"];

/// Returns the kind of the names of a section, if other sections can refer to them.
pub(super) fn kind_of_section(section: &str) -> Option<Kind> {
    match section {
        "tendon" => Some(Kind::Tendon),
        "actuator" => Some(Kind::Actuator),
        _ => None,
    }
}

/// Returns the value of an attribute without marking it as read.
pub(super) fn value<'e>(e: &'e Element, name: &str) -> Option<&'e str> {
    e.attributes.iter().find(|a| a.name == name).map(|a| a.value.trim())
}

/// Returns the name of an element; an empty name is none.
pub(super) fn name_of(e: &Element) -> Option<&str> {
    value(e, "name").filter(|n| !n.is_empty())
}

/// Returns the kind of the element to which an attribute refers.
fn referred(e: &Element, attribute: &str) -> Option<Kind> {
    let object = |of: &str| match value(e, of) {
        Some("body" | "xbody") => Kind::Body,
        Some("geom") => Kind::Geom,
        Some("site") => Kind::Site,
        _ => Kind::Other,
    };
    Some(match attribute {
        "body" | "body1" | "body2" | "target" => Kind::Body,
        "joint" | "joint1" | "joint2" | "jointinparent" => Kind::Joint,
        "geom" | "geom1" | "geom2" => Kind::Geom,
        "site" | "site1" | "site2" | "refsite" | "cranksite" | "slidersite" | "sidesite" => {
            Kind::Site
        }
        "tendon" | "tendon1" | "tendon2" => Kind::Tendon,
        "actuator" => Kind::Actuator,
        "class" | "childclass" => Kind::Class,
        "mesh" | "material" | "hfield" | "texture" => Kind::Asset,
        "camera" => Kind::Other,
        "objname" => object("objtype"),
        "refname" => object("reftype"),
        _ => return None,
    })
}

/// Adds the names of bodies, joints, geoms and sites of a tree.
pub(super) fn collect(tree: &Element, names: &mut Names) {
    for (e, _) in tree.walk() {
        let kind = match e.name.as_str() {
            "body" => Kind::Body,
            "joint" | "freejoint" => Kind::Joint,
            "geom" => Kind::Geom,
            "site" => Kind::Site,
            _ => continue,
        };
        names.extend(name_of(e).map(|n| (kind, n.to_owned())));
    }
}

/// Returns the references of an element and its contents to bodies, their contents, tendons and actuators, except to the world.
pub(super) fn references(e: &Element) -> Vec<(Kind, String)> {
    let mut out = Vec::new();
    for (e, _) in e.walk() {
        for a in &e.attributes {
            let (name, Some(kind)) = (a.value.trim(), referred(e, &a.name)) else { continue };
            let moves = !matches!(kind, Kind::Class | Kind::Asset | Kind::Other);
            if moves && !name.is_empty() && !(kind == Kind::Body && name == "world") {
                out.push((kind, name.to_owned()));
            }
        }
    }
    out
}

/// Replaces names and references of an element and its contents. `own` returns the new name of an element, `other` the new text of a reference;
/// `None` keeps it.
pub(super) fn rename(
    e: &mut Element,
    own: impl Fn(&str) -> Option<String>,
    other: impl Fn(Kind, &str) -> Option<String>,
) {
    e.for_each(|e, _| {
        let kinds: Vec<Option<Kind>> = e.attributes.iter().map(|a| referred(e, &a.name)).collect();
        for (a, kind) in e.attributes.iter_mut().zip(kinds) {
            let name = a.value.trim();
            let new = match kind {
                _ if name.is_empty() => None,
                Some(kind) => other(kind, name),
                None if a.name == "name" => own(name),
                None => None,
            };
            if let Some(new) = new {
                a.value = new;
            }
        }
    });
}
