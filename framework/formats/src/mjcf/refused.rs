//! Elements of MJCF that stand for bodies or joints and that are not read: reading a file without them would give
//! another mechanism, so it is rejected.

use crate::error::FaultKind;
use crate::read::Cx;
use crate::xml::Element;

/// Element, and what to do instead.
const REFUSED: [(&str, &str); 5] = [
    ("attach", "let MuJoCo write the composed model (`mj_saveLastXML`) and read that"),
    (
        "composite",
        "write its bodies and joints out, or let MuJoCo write the expanded model and read that",
    ),
    ("flexcomp", "deformable bodies are not supported; replace it by rigid bodies"),
    ("extension", "remove the plugins, or compute what they do in a part of the simulation"),
    ("deformable", "deformable bodies are not supported; replace it by rigid bodies"),
];

/// Reports every such element.
pub(super) fn report(cx: &mut Cx<'_>, e: &Element) {
    // Skins only change how a model looks.
    let found = REFUSED.iter().find(|(name, _)| *name == e.name);
    if let Some((name, help)) = found.filter(|_| e.name != "deformable" || holds(e, "flex")) {
        if *name == "extension" && e.children.is_empty() {
            return;
        }
        let kind = FaultKind::Unsupported {
            what: format!("<{name}> is not supported"),
            help: (*help).to_owned(),
        };
        cx.fault(e.place(), kind);
        return;
    }
    e.children.iter().for_each(|c| report(cx, c));
}

fn holds(e: &Element, name: &str) -> bool {
    e.children.iter().any(|c| c.name == name)
}
