//! MJCF: a tree of nested bodies with defaults by class, and equality constraints.
//!
//! ```text
//! X_PB = X_frames · (pos, orientation)              at the reference configuration, in which q = ref
//! body  = X_PB · Π_j T(p_j) S_j(q_j − ref_j) T(−p_j)      its joints, in the order of the file
//! ```
//! Our coordinates of hinge, slide and free joints are MuJoCo's own numbers (quaternions in our order);
//! [`Description::initial`] holds the reference configuration.

mod body;
mod equality;
mod geom;
mod include;

use crate::error::{FaultKind, FilePlace};
use crate::read::{Cx, ReadOptions, report_massless};
use crate::xml::{Element, parse};
use crate::{Description, FormatError};
use linkwork_spatial::nalgebra::{Quaternion, Unit};
use linkwork_spatial::{Pose, Quat, Vec3};
use std::collections::BTreeMap;

/// Reads an MJCF text; includes are looked for beside `options.file`.
///
/// # Errors
/// Every mistake: malformed XML, includes that are not there or form a ring, names that are
/// doubled or lead nowhere, values that are not numbers, inertias that no body has.
pub fn read_mjcf(text: &str, options: &ReadOptions) -> Result<Description, FormatError> {
    let mut root = parse(text, &options.file_name())?;
    let mut cx = Cx::new(options);
    if root.name != "mujoco" {
        let help = "an MJCF file is <mujoco> .. </mujoco>".to_owned();
        let kind = FaultKind::WrongRoot { found: root.name.clone(), expected: "<mujoco>", help };
        cx.fault(root.place(), kind);
        return cx.finish(&root, Description::default());
    }
    include::expand(&mut cx, &mut root);
    let root = root;
    let name = root.attr("model").unwrap_or_default().to_owned();
    let mut d = Description { name, ..Description::default() };
    let mut mj = Mj::new(&mut cx, &root);
    mj.bodies(&mut cx, &root, &mut d);
    mj.scale_mass(&mut d);
    mj.equalities(&mut cx, &root, &mut d);
    let place = |body: &str| mj.elements.get(body).map(|e| (*e, format!("mujoco/{}", e.label())));
    report_massless(&mut cx, &d.builder, place);
    cx.finish(&root, d)
}

/// What holds for the whole file.
struct Mj<'e> {
    settings: Settings<'e>,
    classes: BTreeMap<&'e str, Class<'e>>,
    /// The class of elements that name none.
    main: &'e str,
    materials: BTreeMap<&'e str, &'e Element>,
    meshes: BTreeMap<String, &'e Element>,
    /// Bodies by name: element, and `X_WB` at the reference configuration.
    elements: BTreeMap<String, &'e Element>,
    poses: BTreeMap<String, Pose>,
    sites: BTreeMap<&'e str, body::Site<'e>>,
    joints: BTreeMap<String, body::JointRef>,
    /// Bodies without a name so far.
    unnamed: usize,
}

/// The `<compiler>` elements together.
struct Settings<'e> {
    /// Factor to rad.
    angle: f64,
    /// Axes, and whether each turn is about the moving axes.
    euler: [(Vec3, bool); 3],
    autolimits: bool,
    inertia: FromGeoms,
    groups: [f64; 2],
    mesh_folder: &'e str,
    /// All masses and inertias are scaled so that the sum is this, kg.
    total_mass: Option<f64>,
}

/// When the inertia of a body comes from its geoms.
#[derive(Clone, Copy, PartialEq)]
enum FromGeoms {
    Never,
    Always,
    WhenNotGiven,
}

struct Class<'e> {
    parent: Option<&'e str>,
    elements: &'e Element,
}

/// An element whose attributes may come from a class.
#[derive(Clone, Copy)]
struct Classed<'e> {
    e: &'e Element,
    class: &'e str,
}

impl<'e> Mj<'e> {
    fn new(cx: &mut Cx<'_>, root: &'e Element) -> Self {
        let mut mj = Mj {
            settings: settings(cx, root),
            classes: BTreeMap::new(),
            main: "main",
            materials: BTreeMap::new(),
            meshes: BTreeMap::new(),
            elements: BTreeMap::new(),
            poses: BTreeMap::from([("world".to_owned(), Pose::identity())]),
            sites: BTreeMap::new(),
            joints: BTreeMap::new(),
            unnamed: 0,
        };
        for (i, top) in root.all("default").enumerate() {
            let name = top.attr("class").unwrap_or("main");
            if i == 0 {
                mj.main = name;
            }
            mj.class(cx, top, name, None);
        }
        for asset in root.all("asset") {
            for m in asset.all("material") {
                if let Some(name) = m.attr("name") {
                    mj.materials.insert(name, m);
                }
            }
            for m in asset.all("mesh") {
                let file = m.attr("file").unwrap_or_default();
                let stem = file.rsplit('/').next().unwrap_or(file);
                let stem = stem.rsplit_once('.').map_or(stem, |(s, _)| s);
                mj.meshes.insert(m.attr("name").unwrap_or(stem).to_owned(), m);
            }
        }
        mj
    }

    fn class(&mut self, cx: &mut Cx<'_>, e: &'e Element, name: &'e str, parent: Option<&'e str>) {
        // The top class may be written in several parts; the first wins, the rest is listed.
        if parent.is_some()
            && let Some(first) = self.classes.get(name)
        {
            let (first, name) = (first.elements.place(), name.to_owned());
            cx.fault(e.place(), FaultKind::Duplicate { kind: "class", name, first });
            return;
        }
        self.classes.entry(name).or_insert(Class { parent, elements: e });
        for inner in e.all("default") {
            if let Some(own) = cx.required(inner, "class", "a nested <default>") {
                self.class(cx, inner, own, Some(name));
            }
        }
    }

    /// `settotalmass`.
    fn scale_mass(&self, d: &mut Description) {
        let sum: f64 = d.builder.bodies().iter().map(|b| b.mass.mass).sum();
        let Some(total) = self.settings.total_mass.filter(|t| *t > 0.0 && sum > 0.0) else {
            return;
        };
        for b in d.builder.bodies_mut() {
            b.mass.mass *= total / sum;
            b.mass.inertia_com *= total / sum;
        }
    }

    /// The class that an element names in `attribute`, else the inherited one.
    fn class_of(
        &self,
        cx: &mut Cx<'_>,
        e: &'e Element,
        attribute: &str,
        inherited: &'e str,
    ) -> &'e str {
        let Some(name) = e.attr(attribute) else { return inherited };
        if self.classes.contains_key(name) {
            return name;
        }
        let what = format!("<{}>", e.label());
        cx.unknown(e.place_of(attribute), &what, "class", name, self.classes.keys().copied());
        inherited
    }

    fn classed(&self, cx: &mut Cx<'_>, e: &'e Element, inherited: &'e str) -> Classed<'e> {
        Classed { e, class: self.class_of(cx, e, "class", inherited) }
    }

    /// An attribute of the element, else of its class, else of the classes around that.
    fn attr(&self, at: Classed<'e>, name: &str) -> Option<(&'e str, FilePlace)> {
        if let Some(own) = at.e.attr(name) {
            return Some((own, at.e.place_of(name)));
        }
        let mut class = self.classes.get(at.class);
        while let Some(c) = class {
            let found =
                c.elements.all(&at.e.name).find_map(|d| Some((d.attr(name)?, d.place_of(name))));
            if found.is_some() {
                return found;
            }
            class = self.classes.get(c.parent?);
        }
        None
    }

    fn numbers<const N: usize>(
        &self,
        cx: &mut Cx<'_>,
        at: Classed<'e>,
        name: &str,
        what: &str,
    ) -> Option<[f64; N]> {
        let (text, place) = self.attr(at, name)?;
        cx.parse(place, text, &format!("{what}: `{name}`"))
    }

    fn number(&self, cx: &mut Cx<'_>, at: Classed<'e>, name: &str, what: &str) -> Option<f64> {
        self.numbers::<1>(cx, at, name, what).map(|[x]| x)
    }

    /// A number that must not be negative; 0 when it is not there.
    fn size(&self, cx: &mut Cx<'_>, at: Classed<'e>, name: &str, what: &str) -> f64 {
        let Some(x) = self.number(cx, at, name, what) else { return 0.0 };
        let place = self.attr(at, name).map_or(at.e.place(), |(_, p)| p);
        cx.not_negative(place, x, &format!("{what}: `{name}`")).unwrap_or(0.0)
    }

    /// `pos` and the orientation in whichever way it is written.
    fn pose(&self, cx: &mut Cx<'_>, at: Classed<'e>, what: &str) -> Pose {
        let p = self.numbers::<3>(cx, at, "pos", what).unwrap_or_default();
        Pose::new(self.rotation(cx, at, what), Vec3::from(p))
    }

    fn rotation(&self, cx: &mut Cx<'_>, at: Classed<'e>, what: &str) -> Quat {
        let unit = |cx: &mut Cx<'_>, n: Vec3, name: &str| {
            let (text, place) = self.attr(at, name)?;
            cx.unit(place, n, text, &format!("{what}: `{name}`"))
        };
        let turned = if let Some([w, x, y, z]) = self.numbers::<4>(cx, at, "quat", what) {
            let raw = Quaternion::new(w, x, y, z);
            let n = raw.coords.amax();
            if (1e-100..=1e100).contains(&n) {
                // The digits of a unit quaternion are kept.
                let exact = raw.norm() == 1.0;
                Some(if exact { Unit::new_unchecked(raw) } else { Quat::new_normalize(raw / n) })
            } else {
                let (text, place) = self.attr(at, "quat").unwrap_or(("", at.e.place()));
                let help = "write w x y z, for example 1 0 0 0";
                cx.bad(
                    place,
                    &format!("{what}: `quat`"),
                    text,
                    "a quaternion with a direction",
                    help,
                );
                None
            }
        } else if let Some([x, y, z, a]) = self.numbers::<4>(cx, at, "axisangle", what) {
            unit(cx, Vec3::new(x, y, z), "axisangle")
                .map(|n| Quat::from_axis_angle(&Unit::new_unchecked(n), a * self.settings.angle))
        } else if let Some(e) = self.numbers::<3>(cx, at, "euler", what) {
            let mut q = Quat::identity();
            for ((axis, moving), angle) in self.settings.euler.iter().zip(e) {
                let turn = Quat::from_scaled_axis(axis * (angle * self.settings.angle));
                q = if *moving { q * turn } else { turn * q };
            }
            Some(q)
        } else if let Some([a, b, c, d, e, f]) = self.numbers::<6>(cx, at, "xyaxes", what) {
            unit(cx, Vec3::new(a, b, c), "xyaxes").and_then(|x| {
                let y = Vec3::new(d, e, f);
                let y = unit(cx, y - x * x.dot(&y), "xyaxes")?;
                Some(Quat::from_basis_unchecked(&[x, y, x.cross(&y)]))
            })
        } else if let Some(z) = self.numbers::<3>(cx, at, "zaxis", what) {
            unit(cx, Vec3::from(z), "zaxis").map(|z| {
                let half_turn = Quat::from_scaled_axis(Vec3::x() * std::f64::consts::PI);
                Quat::rotation_between(&Vec3::z(), &z).unwrap_or(half_turn)
            })
        } else {
            None
        };
        turned.unwrap_or_else(Quat::identity)
    }

    /// `true`, `false` or `auto` of an attribute; `None` for the last and when it is not there.
    fn flag(&self, cx: &mut Cx<'_>, at: Classed<'e>, name: &str, what: &str) -> Option<bool> {
        let (text, place) = self.attr(at, name)?;
        word(
            cx,
            place,
            text,
            &format!("{what}: `{name}`"),
            &[("true", Some(true)), ("false", Some(false)), ("auto", None)],
        )
        .flatten()
    }
}

/// The meaning of one of several words.
fn word<T: Copy>(
    cx: &mut Cx<'_>,
    place: FilePlace,
    text: &str,
    what: &str,
    words: &[(&str, T)],
) -> Option<T> {
    let found = words.iter().find(|(w, _)| *w == text).map(|(_, t)| *t);
    if found.is_none() {
        let all: Vec<&str> = words.iter().map(|(w, _)| *w).collect();
        cx.bad(place, what, text, "a word known here", &format!("one of: {}", all.join(", ")));
    }
    found
}

fn settings<'e>(cx: &mut Cx<'_>, root: &'e Element) -> Settings<'e> {
    let mut s = Settings {
        angle: std::f64::consts::PI / 180.0,
        euler: [(Vec3::x(), true), (Vec3::y(), true), (Vec3::z(), true)],
        autolimits: true,
        inertia: FromGeoms::WhenNotGiven,
        groups: [0.0, 5.0],
        mesh_folder: "",
        total_mass: None,
    };
    for e in root.all("compiler") {
        let mut choice = |name: &str, words: &[(&str, f64)]| {
            let text = e.attr(name)?;
            word(cx, e.place_of(name), text, &format!("<compiler>: `{name}`"), words)
        };
        s.angle = choice("angle", &[("radian", 1.0), ("degree", s.angle)]).unwrap_or(s.angle);
        if let Some(a) = choice("autolimits", &[("true", 1.0), ("false", 0.0)]) {
            s.autolimits = a > 0.0;
        }
        match choice("inertiafromgeom", &[("true", 1.0), ("false", 0.0), ("auto", 2.0)]) {
            Some(0.0) => s.inertia = FromGeoms::Never,
            Some(1.0) => s.inertia = FromGeoms::Always,
            Some(_) => s.inertia = FromGeoms::WhenNotGiven,
            None => {}
        }
        choice("coordinate", &[("local", 0.0)]);
        if let Some(seq) = e.attr("eulerseq") {
            match euler(seq) {
                Some(axes) => s.euler = axes,
                None => {
                    let (expected, help) = ("three of x y z X Y Z", "write for example xyz");
                    cx.bad(e.place_of("eulerseq"), "<compiler>: `eulerseq`", seq, expected, help);
                }
            }
        }
        s.groups = cx.numbers::<2>(e, "inertiagrouprange", "<compiler>").unwrap_or(s.groups);
        s.total_mass = cx.number(e, "settotalmass", "<compiler>").or(s.total_mass);
        s.mesh_folder = e.attr("meshdir").or(e.attr("assetdir")).unwrap_or(s.mesh_folder);
    }
    s
}

/// Lower case turns about moving axes, upper case about fixed ones.
fn euler(seq: &str) -> Option<[(Vec3, bool); 3]> {
    let axes: Option<Vec<(Vec3, bool)>> = seq
        .chars()
        .map(|c| match c.to_ascii_lowercase() {
            'x' => Some((Vec3::x(), c.is_ascii_lowercase())),
            'y' => Some((Vec3::y(), c.is_ascii_lowercase())),
            'z' => Some((Vec3::z(), c.is_ascii_lowercase())),
            _ => None,
        })
        .collect();
    axes?.try_into().ok()
}
