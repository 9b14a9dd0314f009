//! The version of an SDF file: two integers; 1.10 is later than 1.9.

use crate::read::Cx;
use crate::xml::Element;

/// The supported versions.
const OLDEST: (u32, u32) = (1, 0);
const NEWEST: (u32, u32) = (1, 12);

/// Since this version, axes of joints are in the frame of the joint; before, they were in the frame of the model.
const AXES_IN_JOINTS: (u32, u32) = (1, 5);

/// Reads `1.10` as (1, 10); returns `None` for other texts.
pub(super) fn number(text: &str) -> Option<(u32, u32)> {
    let (major, minor) = text.trim().split_once('.')?;
    Some((major.parse().ok()?, minor.parse().ok()?))
}

/// Checks the version of a file and adapts its joints to the version.
pub(super) fn prepare(cx: &mut Cx<'_>, root: &mut Element) {
    let Some(text) = root.attr("version").map(str::to_owned) else {
        let note = format!("no `version`: read as {}.{}", NEWEST.0, NEWEST.1);
        cx.ignored.push(root.ignored("sdf", note));
        return;
    };
    match number(&text) {
        None => {
            let (expected, help) = ("a version", "write for example version=\"1.9\"");
            cx.bad(root.place_of("version"), "<sdf>: `version`", &text, expected, help);
        }
        Some(v) if !(OLDEST..=NEWEST).contains(&v) => {
            let note = format!(
                "version {text}: versions {}.{} to {}.{} are supported; read as the nearest of them",
                OLDEST.0, OLDEST.1, NEWEST.0, NEWEST.1
            );
            cx.ignored.push(root.ignored("sdf", note));
            if v < AXES_IN_JOINTS {
                axes_in_model(root);
            }
        }
        Some(v) if v < AXES_IN_JOINTS => axes_in_model(root),
        Some(_) => {}
    }
}

fn axes_in_model(root: &mut Element) {
    root.for_each(|e, _| {
        let axis = matches!(e.name.as_str(), "axis" | "axis2");
        if axis && e.children.iter().all(|c| c.name != "use_parent_model_frame") {
            let mut flag = Element::like(e, "use_parent_model_frame");
            flag.text = "true".into();
            e.children.push(flag);
        }
    });
}
