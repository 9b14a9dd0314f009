//! `<replicate count=".." offset=".." euler="..">`: copies of its content, each in a displaced frame.
//!
//! ```text
//! R_k = R(k euler)        p_k₊₁ = p_k + R_k offset        names get the suffix `sep` and k, with leading zeros
//! ```

use super::Settings;
use super::orientation::turn_of_euler;
use crate::error::FaultKind;
use crate::read::Cx;
use crate::xml::Element;
use linkwork_spatial::{Pose, Quat, Vec3};

/// Maximum number of copied elements in a file.
const COPIES: usize = 1_000_000;

/// Replaces every `<replicate>` by one `<frame>` for each copy.
pub(super) fn expand(cx: &mut Cx<'_>, root: &mut Element, settings: &Settings) {
    let mut left = COPIES;
    for world in root.children.iter_mut().filter(|c| c.name == "worldbody") {
        // Expand inner replications first, because their suffix is the first one in a name.
        world.for_each_inside_first(|e| {
            if !e.children.iter().any(|c| c.name == "replicate") {
                return;
            }
            for child in std::mem::take(&mut e.children) {
                match child.name.as_str() {
                    "replicate" => e.children.extend(copies(cx, &child, settings, &mut left)),
                    _ => e.children.push(child),
                }
            }
        });
    }
}

/// Returns the frames that replace one replication.
fn copies(cx: &mut Cx<'_>, e: &Element, settings: &Settings, left: &mut usize) -> Vec<Element> {
    let what = "<replicate>";
    if cx.required(e, "count", what).is_none() {
        return Vec::new();
    }
    let Some(count) = cx.number(e, "count", what) else { return Vec::new() };
    if !(count >= 1.0 && count.fract() == 0.0) {
        let text = count.to_string();
        cx.bad(
            e.place_of("count"),
            &format!("{what}: `count`"),
            &text,
            "a positive integer",
            "write count=\"2\"",
        );
        return Vec::new();
    }
    let size = e.walk().count();
    if count * size as f64 > *left as f64 {
        let fact = format!("{what} creates more than {COPIES} elements");
        let help = "use fewer copies, or write the bodies with a program".to_owned();
        cx.fault(e.place(), FaultKind::Unsupported { what: fact, help });
        return Vec::new();
    }
    let count = count as usize;
    *left -= count * size;
    let p = cx.numbers::<3>(e, "offset", what).unwrap_or_default();
    let angles = cx.numbers::<3>(e, "euler", what).unwrap_or_default();
    let offset = Vec3::from(p);
    let separator = e.attr("sep").unwrap_or_default();
    let width = count.to_string().len();
    let (mut out, mut X) = (Vec::new(), Pose::identity());
    for k in 0..count {
        let mut frame = e.clone();
        frame.name = "frame".into();
        frame.attributes.retain(|a| a.name == "childclass");
        frame.set("pos", numbers(X.position.as_slice()));
        let q: Quat = X.rotation;
        frame.set("quat", numbers(&[q.w, q.i, q.j, q.k]));
        let suffix = format!("{separator}{k:0width$}");
        frame.children.iter_mut().for_each(|c| c.for_each(|e, _| rename(e, &suffix)));
        out.push(frame);
        let next = X.position + X.rotation * offset;
        X = Pose::new(turn_of_euler(settings, angles.map(|a| a * (k + 1) as f64)), next);
    }
    out
}

/// Prints numbers with all digits.
fn numbers(list: &[f64]) -> String {
    list.iter().map(|x| format!("{x:?}")).collect::<Vec<_>>().join(" ")
}

fn rename(e: &mut Element, suffix: &str) {
    if let Some(a) = e.attributes.iter_mut().find(|a| a.name == "name")
        && !a.value.is_empty()
    {
        a.value += suffix;
    }
}
