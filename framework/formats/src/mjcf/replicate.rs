//! `<replicate count=".." offset=".." euler="..">`: copies of its content, each in a displaced frame.
//!
//! ```text
//! R_k = R(k euler)        p_k₊₁ = p_k + R_k offset        names get the suffix `sep` and k, with leading zeros
//! ```
//! Tendons, actuators, sensors, equalities and contact pairs that refer to the content are copied for each k.

use super::Composer;
use super::names::{Kind, Names, SECTIONS, collect, kind_of_section, name_of, references, rename};
use super::orientation::turn_of_euler;
use crate::read::Cx;
use crate::xml::Element;
use linkwork_spatial::{Pose, Quat, Vec3};

/// Names inside a replication, and the suffixes of their copies.
struct Replaced {
    names: Names,
    suffixes: Vec<String>,
}

/// Replaces every `<replicate>` by one `<frame>` for each copy.
pub(super) fn expand(cx: &mut Cx<'_>, root: &mut Element, composer: &mut Composer) {
    let mut replaced = Vec::new();
    for world in root.children.iter_mut().filter(|c| c.name == "worldbody") {
        // Expand inner replications first, because their suffix is the first one in a name.
        world.for_each_inside_first(|e| {
            if !e.children.iter().any(|c| c.name == "replicate") {
                return;
            }
            for child in std::mem::take(&mut e.children) {
                match child.name.as_str() {
                    "replicate" => {
                        e.children.extend(copies(cx, &child, composer, &mut replaced));
                    }
                    _ => e.children.push(child),
                }
            }
        });
    }
    for replaced in replaced {
        copy_references(cx, root, replaced, composer);
    }
}

/// Returns the frames that replace one replication.
fn copies(
    cx: &mut Cx<'_>,
    e: &Element,
    composer: &mut Composer,
    replaced: &mut Vec<Replaced>,
) -> Vec<Element> {
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
    // The conversion saturates.
    if !composer.spend(cx, e, (count * e.walk().count() as f64) as usize) {
        return Vec::new();
    }
    let count = count as usize;
    let p = cx.numbers::<3>(e, "offset", what).unwrap_or_default();
    let angles = cx.numbers::<3>(e, "euler", what).unwrap_or_default();
    let offset = Vec3::from(p);
    let separator = e.attr("sep").unwrap_or_default();
    let width = count.to_string().len();
    let suffixes: Vec<String> = (0..count).map(|k| format!("{separator}{k:0width$}")).collect();
    let (mut out, mut X) = (Vec::new(), Pose::identity());
    for (k, suffix) in suffixes.iter().enumerate() {
        let mut frame = e.clone();
        frame.name = "frame".into();
        frame.attributes.retain(|a| a.name == "childclass");
        frame.set("pos", numbers(X.position.as_slice()));
        let q: Quat = X.rotation;
        frame.set("quat", numbers(&[q.w, q.i, q.j, q.k]));
        for c in &mut frame.children {
            rename(c, |name| Some(format!("{name}{suffix}")), |_, _| None);
        }
        out.push(frame);
        let next = X.position + X.rotation * offset;
        let turn = angles.map(|a| a * (k + 1) as f64);
        X = Pose::new(turn_of_euler(&composer.settings[e.scope], turn), next);
    }
    let mut names = Names::new();
    collect(e, &mut names);
    replaced.push(Replaced { names, suffixes });
    out
}

/// Prints numbers with all digits.
fn numbers(list: &[f64]) -> String {
    list.iter().map(|x| format!("{x:?}")).collect::<Vec<_>>().join(" ")
}

/// Replaces elements of the sections that refer to replicated names by one copy for each suffix.
fn copy_references(
    cx: &mut Cx<'_>,
    root: &mut Element,
    Replaced { mut names, suffixes }: Replaced,
    composer: &mut Composer,
) {
    for section in SECTIONS {
        let mut copied: Vec<Element> = Vec::new();
        for list in root.children.iter_mut().filter(|c| c.name == section) {
            let enters = |e: &Element| references(e).iter().any(|r| names.contains(r));
            let all = std::mem::take(&mut list.children);
            let (inside, outside) = all.into_iter().partition(enters);
            list.children = outside;
            copied.extend::<Vec<Element>>(inside);
        }
        // MuJoCo omits these elements if they also refer to names outside of the replication.
        if matches!(section, "actuator" | "equality") {
            copied.retain(|e| {
                let leaves = references(e).iter().any(|r| !names.contains(r));
                if leaves {
                    let note = "it refers to names inside and outside of a <replicate>, and MuJoCo omits it";
                    cx.ignored.push(e.ignored(format!("mujoco/{section}/{}", e.label()), note));
                }
                !leaves
            });
        }
        let Some(first) = copied.first() else { continue };
        let size: usize = copied.iter().map(|e| e.walk().count()).sum();
        if !composer.spend(cx, first, size.saturating_mul(suffixes.len())) {
            return;
        }
        if let Some(kind) = kind_of_section(section) {
            let own = copied.iter().filter_map(|e| Some((kind, name_of(e)?.to_owned())));
            names.extend(own.collect::<Vec<(Kind, String)>>());
        }
        let mut list = Element::like(root, section);
        for suffix in &suffixes {
            for e in &copied {
                let mut copy = e.clone();
                rename(
                    &mut copy,
                    |name| Some(format!("{name}{suffix}")),
                    |kind, name| {
                        names.contains(&(kind, name.to_owned())).then(|| format!("{name}{suffix}"))
                    },
                );
                list.children.push(copy);
            }
        }
        root.children.push(list);
    }
}
