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
use std::collections::BTreeMap;

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
    copy_references(cx, root, &replaced, composer);
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

/// The names inside of all replications, each with the numbers of the replications in which it has copies, in increasing order.
type Places = BTreeMap<(Kind, String), Vec<usize>>;

/// A copy of an element of a section. `steps`: the replications that made it, the last one first, each with the number of the copy.
struct Made {
    steps: Vec<(usize, usize)>,
    e: Element,
}

/// Replaces elements of the sections that refer to replicated names by one copy for each suffix.
fn copy_references(
    cx: &mut Cx<'_>,
    root: &mut Element,
    replaced: &[Replaced],
    composer: &mut Composer,
) {
    let mut places = Places::new();
    for (k, one) in replaced.iter().enumerate() {
        for name in &one.names {
            places.entry(name.clone()).or_default().push(k);
        }
    }
    for section in SECTIONS {
        let mut made: Vec<Made> = Vec::new();
        let mut own: Vec<((Kind, String), usize)> = Vec::new();
        for list in root.children.iter_mut().filter(|c| c.name == section) {
            for e in std::mem::take(&mut list.children) {
                if first_place(&e, &places, 0).is_none() {
                    list.children.push(e);
                    continue;
                }
                let mut todo = vec![(Made { steps: Vec::new(), e }, 0)];
                while let Some((now, from)) = todo.pop() {
                    let Some(k) = first_place(&now.e, &places, from) else {
                        made.push(now);
                        continue;
                    };
                    let Made { steps, e } = now;
                    if omitted(cx, section, &e, &places, k) {
                        continue;
                    }
                    let suffixes = &replaced[k].suffixes;
                    if !composer.spend(cx, &e, e.walk().count().saturating_mul(suffixes.len())) {
                        return;
                    }
                    if let (Some(kind), Some(name)) = (kind_of_section(section), name_of(&e)) {
                        own.push(((kind, name.to_owned()), k));
                    }
                    let inside = |kind: Kind, name: &str| {
                        places.get(&(kind, name.to_owned())).is_some_and(|p| p.contains(&k))
                    };
                    for (n, suffix) in suffixes.iter().enumerate().rev() {
                        let mut copy = e.clone();
                        let with = |name: &str| format!("{name}{suffix}");
                        rename(
                            &mut copy,
                            |name| Some(with(name)),
                            |kind, name| inside(kind, name).then(|| with(name)),
                        );
                        let steps = [&[(k, n)], steps.as_slice()].concat();
                        todo.push((Made { steps, e: copy }, k + 1));
                    }
                }
            }
        }
        for (name, k) in own {
            let places = places.entry(name).or_default();
            if let Err(at) = places.binary_search(&k) {
                places.insert(at, k);
            }
        }
        if !made.is_empty() {
            // MuJoCo appends the copies of one replication after another.
            made.sort_by(|a, b| a.steps.cmp(&b.steps));
            let mut list = Element::like(root, section);
            list.children = made.into_iter().map(|m| m.e).collect();
            root.children.push(list);
        }
    }
}

/// Returns the first replication, from a number on, with a name to which an element refers.
fn first_place(e: &Element, places: &Places, from: usize) -> Option<usize> {
    let next = |name: &(Kind, String)| places.get(name)?.iter().copied().find(|k| *k >= from);
    references(e).iter().filter_map(next).min()
}

/// Returns whether MuJoCo omits an element because it refers to names inside and outside of a replication, and reports this.
fn omitted(cx: &mut Cx<'_>, section: &str, e: &Element, places: &Places, k: usize) -> bool {
    let inside = |name: &(Kind, String)| places.get(name).is_some_and(|p| p.contains(&k));
    let leaves = matches!(section, "actuator" | "equality") && !references(e).iter().all(inside);
    if leaves {
        let note = "it refers to names inside and outside of a <replicate>, and MuJoCo omits it";
        cx.ignored.push(e.ignored(format!("mujoco/{section}/{}", e.label()), note));
    }
    leaves
}
