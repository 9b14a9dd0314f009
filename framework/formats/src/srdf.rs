//! SRDF: names for groups of links, from files that motion planners use with a URDF.
//!
//! ```text
//! <group name="arm"><chain base_link="base" tip_link="tool"/></group>      links after the base, the tip included
//! <group name="hand"><link name="palm"/><joint name="finger"/></group>     links, and the child links of joints
//! <disable_collisions link1="base" link2="shoulder" reason="Adjacent"/>    a pair that is not looked at
//! ```
//! Everything else (states, end effectors, virtual and passive joints, groups of groups) is listed in
//! [`Srdf::ignored`].

use crate::error::{FaultKind, FileFault, FilePlace};
use crate::read::{Cx, ReadOptions};
use crate::xml::parse;
use crate::{FormatError, Ignored};
use std::path::Path;

/// A named group of links.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Group {
    /// Its name.
    pub name: String,
    /// Chains from a base link (not included) to a tip link.
    pub chains: Vec<[String; 2]>,
    /// Links by name.
    pub links: Vec<String>,
    /// Joints by name; each adds its child link.
    pub joints: Vec<String>,
}

/// Contents of an SRDF file.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Srdf {
    /// Name of the robot.
    pub name: String,
    /// Groups in the order of the file.
    pub groups: Vec<Group>,
    /// Pairs of links whose collisions are not checked.
    pub ignore: Vec<[String; 2]>,
    /// All unused contents.
    pub ignored: Vec<Ignored>,
}

/// Reads an SRDF text.
///
/// # Errors
/// Every mistake: malformed XML, another outermost element, missing names, a group defined twice.
pub fn read_srdf(text: &str, options: &ReadOptions) -> Result<Srdf, FormatError> {
    let root = parse(text, &options.file_name())?;
    let mut cx = Cx::new(options);
    let mut out = Srdf::default();
    if root.name == "robot" {
        out.name = root.attr("name").unwrap_or_default().to_owned();
        for e in root.all("group") {
            let Some(name) = cx.required(e, "name", "a <group>") else { continue };
            let same =
                root.children.iter().find(|o| o.name == "group" && o.attr("name") == Some(name));
            if let Some(first) = same.filter(|o| o.place() != e.place()) {
                let (kind, name, first) = ("group", name.to_owned(), first.place());
                cx.fault(e.place_of("name"), FaultKind::Duplicate { kind, name, first });
            }
            let mut group =
                Group { name: name.into(), chains: vec![], links: vec![], joints: vec![] };
            for c in e.all("chain") {
                let base = cx.required(c, "base_link", "a <chain>");
                let tip = cx.required(c, "tip_link", "a <chain>");
                group.chains.extend(base.zip(tip).map(|(b, t)| [b.to_owned(), t.to_owned()]));
            }
            for c in e.all("link") {
                group.links.extend(cx.required(c, "name", "a <link>").map(str::to_owned));
            }
            for c in e.all("joint") {
                group.joints.extend(cx.required(c, "name", "a <joint>").map(str::to_owned));
            }
            out.groups.push(group);
        }
        for e in root.all("disable_collisions") {
            let one = cx.required(e, "link1", "<disable_collisions>");
            let two = cx.required(e, "link2", "<disable_collisions>");
            e.attr("reason");
            out.ignore.extend(one.zip(two).map(|(a, b)| [a.to_owned(), b.to_owned()]));
        }
    } else {
        let help = "an SRDF file is <robot name=\"..\"> .. </robot>".to_owned();
        let kind = FaultKind::WrongRoot { found: root.name.clone(), expected: "<robot>", help };
        cx.fault(root.place(), kind);
    }
    if !cx.faults.is_empty() {
        return Err(FormatError { faults: cx.faults });
    }
    out.ignored = root.unread(None);
    Ok(out)
}

/// Reads an SRDF file.
///
/// # Errors
/// An unreadable file, or every mistake of its text.
pub fn read_srdf_file(path: impl AsRef<Path>) -> Result<Srdf, FormatError> {
    let options = ReadOptions::default().at(path.as_ref());
    match crate::whole_text(path.as_ref()) {
        Ok(text) => read_srdf(&text, &options),
        Err(reason) => {
            let place = FilePlace { file: options.file_name(), ..FilePlace::default() };
            let kind = FaultKind::Unreadable { reason };
            Err(FormatError { faults: vec![FileFault { place, kind }] })
        }
    }
}
