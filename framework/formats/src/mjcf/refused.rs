//! Unsupported elements of MJCF that define bodies or joints: without them the mechanism would be different, so the file is rejected.

use crate::error::FaultKind;
use crate::read::Cx;
use crate::xml::Element;

/// Element, and the remedy.
const REFUSED: [(&str, &str); 5] = [
    ("attach", "write it inside <worldbody> or inside a body"),
    (
        "composite",
        "MuJoCo 4 does not have it either; write the bodies and joints (<replicate> copies them), or save the expanded model with MuJoCo 3 \
         and read the result",
    ),
    ("flexcomp", "deformable bodies are not supported; replace it by rigid bodies"),
    ("extension", "remove the plugins, or replace them by a part of the simulation"),
    ("deformable", "deformable bodies are not supported; replace it by rigid bodies"),
];

/// Reports every such element.
pub(super) fn report(cx: &mut Cx<'_>, root: &Element) {
    let mut todo = vec![root];
    while let Some(e) = todo.pop() {
        // Skins only change the appearance of a model.
        let found = REFUSED.iter().find(|(name, _)| *name == e.name);
        let found = found.filter(|_| e.name != "deformable" || holds(e, "flex"));
        let Some((name, help)) = found else {
            todo.extend(e.children.iter().rev());
            continue;
        };
        if *name == "extension" && e.children.is_empty() {
            continue;
        }
        let kind = FaultKind::Unsupported {
            what: format!("<{name}> is not supported"),
            help: (*help).to_owned(),
        };
        cx.fault(e.place(), kind);
    }
}

fn holds(e: &Element, name: &str) -> bool {
    e.children.iter().any(|c| c.name == name)
}
