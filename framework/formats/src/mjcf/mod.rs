//! MJCF: a tree of nested bodies with defaults by class, equality constraints, tendons, actuators and sensors.
//!
//! ```text
//! X_PB = X_frames · (pos, orientation)              at the reference configuration, in which q = ref
//! body  = X_PB · Π_j T(p_j) S_j(q_j − ref_j) T(−p_j)      its joints, in the order of the file
//! ```
//! Our coordinates of hinge, slide and free joints have MuJoCo's values (quaternions in our order); [`Description::initial`] contains the reference
//! configuration.

mod actuator;
mod attach;
mod body;
mod collide;
mod defaults;
mod equality;
mod geom;
mod hfield;
mod include;
mod inside;
mod keyframe;
mod mesh;
mod names;
mod orientation;
mod refused;
mod replicate;
mod sensor;
mod spring;
mod tendon;

use crate::error::{FaultKind, FilePlace};
use crate::read::{Cx, ReadOptions, report_massless};
use crate::xml::{CHAIN, Declarations, Element, parse_with};
use crate::{CollisionMeshes, Description, FormatError};
use defaults::Classes;
pub(crate) use geom::solid;
use linkwork_spatial::{Pose, Vec3};
use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;

/// Reads an MJCF text; includes are searched in the folder of `options.file`.
///
/// # Errors
/// Every mistake: malformed XML, missing or circular includes, duplicate or unknown names, invalid numbers, inertias that no rigid body can have.
pub fn read_mjcf(text: &str, options: &ReadOptions) -> Result<Description, FormatError> {
    let mut root = parse_with(text, &options.file_name(), Declarations::Refused, CHAIN)?;
    let mut cx = Cx::new(options);
    if root.name != "mujoco" {
        let help = "an MJCF file is <mujoco> .. </mujoco>".to_owned();
        let kind = FaultKind::WrongRoot { found: root.name.clone(), expected: "<mujoco>", help };
        cx.fault(root.place(), kind);
        return cx.finish(&root, Description::default());
    }
    let mut composer = Composer::new(options.file.clone());
    compose(&mut cx, &mut root, &mut composer, String::new());
    if let Some((e, _)) = root.walk().find(|(_, depth)| *depth > CHAIN) {
        cx.fault(e.place(), FaultKind::TooDeep { limit: CHAIN });
        return cx.finish(&root, Description::default());
    }
    let (root, settings) = (root, composer.settings);
    refused::report(&mut cx, &root);
    let name = root.attr("model").unwrap_or_default().to_owned();
    let collision_meshes = CollisionMeshes::Hulls;
    let mut d = Description { name, collision_meshes, ..Description::default() };
    let mut mj = Mj::new(&mut cx, &root, settings);
    mj.bodies(&mut cx, &root, &mut d);
    mj.scale_mass(&mut d);
    mj.spring_dampers(&mut cx, &mut d);
    mj.contacts(&mut cx, &root, &mut d);
    mj.keyframes(&mut cx, &root, &mut d);
    let mut lengths = mj.tendons(&mut cx, &root, &mut d);
    mj.equalities(&mut cx, &root, &lengths, &mut d);
    mj.actuators(&mut cx, &root, &mut lengths, &mut d);
    mj.sensors(&mut cx, &root, &mut lengths, &mut d);
    mj.gravity_compensation(&mut cx, &mut d);
    let place = |body: &str| mj.elements.get(body).map(|e| (*e, format!("mujoco/{}", e.label())));
    report_massless(&mut cx, &d.builder, place);
    cx.finish(&root, d)
}

/// Maximum number of elements that attachments and replications of a file create.
const COPIES: usize = 1_000_000;

/// State while a file is composed of included files, attached models and replications.
struct Composer {
    /// The settings of the main file, then the settings of attached models.
    settings: Vec<Settings>,
    /// The main file, and the models that are being attached.
    open: Vec<PathBuf>,
    /// Number of elements that may still be created.
    left: usize,
    /// Numbers of models read and of attachments.
    models: usize,
    attached: usize,
}

impl Composer {
    fn new(file: Option<PathBuf>) -> Self {
        let open = file.into_iter().collect();
        Self { settings: Vec::new(), open, left: COPIES, models: 0, attached: 0 }
    }

    /// Reports a fault at an element that creates too many others.
    fn spend(&mut self, cx: &mut Cx<'_>, e: &Element, count: usize) -> bool {
        if count > self.left {
            let what = format!("<{}> creates more than {COPIES} elements", e.name);
            let help = "use fewer copies, or write the bodies with a program".to_owned();
            cx.fault(e.place(), FaultKind::Unsupported { what, help });
            return false;
        }
        self.left -= count;
        true
    }
}

/// Replaces includes, attachments and replications of a file; returns the index of its settings. `folder`: its folder, relative to the folder of
/// the main file.
fn compose(cx: &mut Cx<'_>, root: &mut Element, composer: &mut Composer, folder: String) -> usize {
    include::expand(cx, root, composer.open.last());
    let scope = composer.settings.len();
    root.for_each(|e, _| e.scope = scope);
    composer.settings.push(Settings { folder, ..settings(cx, root) });
    attach::expand(cx, root, composer);
    replicate::expand(cx, root, composer);
    scope
}

/// Data of the whole file.
struct Mj<'e> {
    /// The settings of the file and of attached models: [`Element::scope`] is an index.
    settings: Vec<Settings>,
    classes: Classes<'e>,
    materials: BTreeMap<&'e str, &'e Element>,
    meshes: BTreeMap<String, &'e Element>,
    height_fields: BTreeMap<String, &'e Element>,
    /// Bodies by name: element, and `X_WB` at the reference configuration.
    elements: BTreeMap<String, &'e Element>,
    poses: BTreeMap<String, Pose>,
    sites: BTreeMap<&'e str, body::Site<'e>>,
    joints: BTreeMap<String, body::JointRef>,
    /// Joints in the order of the file, which is the order of coordinates in a keyframe.
    joint_order: Vec<String>,
    /// Named geoms that collide or may collide, each with its body.
    geoms: BTreeMap<&'e str, String>,
    /// Names of geoms in `<pair>`: they collide regardless of their masks.
    paired: BTreeSet<&'e str>,
    /// Joints with a `springdamper`: time constant, damping ratio, position in the file.
    spring_dampers: Vec<(String, [f64; 2], FilePlace)>,
    /// Corners of meshes that were read.
    corners: RefCell<BTreeMap<String, mesh::Corners>>,
    /// Options, with folders of mesh files.
    options: ReadOptions,
    /// Number of unnamed bodies so far.
    unnamed: usize,
}

/// The `<compiler>` elements together.
struct Settings {
    /// Folder of the file, relative to the folder of the main file.
    folder: String,
    /// Factor to rad.
    angle: f64,
    /// Axes, and whether each rotation is about the moving axes.
    euler: [(Vec3, bool); 3],
    autolimits: bool,
    inertia: FromGeoms,
    groups: [f64; 2],
    mesh_folder: String,
    /// Whether only the last part of the name of a mesh file is used.
    strip_path: bool,
    /// Minimum mass of a body, kg, and minimum principal moment, kg m².
    least: [f64; 2],
    /// Whether moments that violate the triangle inequality are replaced by their mean.
    balance: bool,
    /// Sum to which all masses and inertias are scaled, kg.
    total_mass: Option<f64>,
}

/// Rule for the computation of the inertia of a body from its geoms.
#[derive(Clone, Copy, PartialEq)]
enum FromGeoms {
    Never,
    Always,
    WhenNotGiven,
}

/// An element whose attributes may come from a class.
#[derive(Clone, Copy)]
struct Classed<'e> {
    e: &'e Element,
    class: &'e str,
    /// The name of its element in a class.
    kind: &'e str,
}

impl<'e> Mj<'e> {
    fn new(cx: &mut Cx<'_>, root: &'e Element, settings: Vec<Settings>) -> Self {
        let mut mj = Mj {
            settings,
            classes: Classes::read(cx, root),
            materials: BTreeMap::new(),
            meshes: BTreeMap::new(),
            height_fields: BTreeMap::new(),
            elements: BTreeMap::new(),
            poses: BTreeMap::from([("world".to_owned(), Pose::identity())]),
            sites: BTreeMap::new(),
            joints: BTreeMap::new(),
            joint_order: Vec::new(),
            geoms: BTreeMap::new(),
            paired: collide::paired(root),
            spring_dampers: Vec::new(),
            corners: RefCell::default(),
            options: cx.options.clone(),
            unnamed: 0,
        };
        for asset in root.all("asset") {
            for m in asset.all("material") {
                if let Some(name) = m.attr("name") {
                    mj.materials.insert(name, m);
                }
            }
            mj.find_meshes(asset);
            mj.find_height_fields(asset);
        }
        mj
    }

    /// Returns the settings that apply to an element.
    fn of(&self, e: &Element) -> &Settings {
        &self.settings[e.scope]
    }

    /// `settotalmass` of the main file.
    fn scale_mass(&self, d: &mut Description) {
        let sum: f64 = d.builder.bodies().iter().map(|b| b.mass.mass).sum();
        let Some(total) = self.settings[0].total_mass.filter(|t| *t > 0.0 && sum > 0.0) else {
            return;
        };
        for b in d.builder.bodies_mut() {
            b.mass.mass *= total / sum;
            b.mass.inertia_com *= total / sum;
        }
    }

    /// Returns the class in `attribute` of an element, otherwise the inherited one.
    fn class_of(
        &self,
        cx: &mut Cx<'_>,
        e: &'e Element,
        attribute: &str,
        inherited: &'e str,
    ) -> &'e str {
        let Some(name) = e.attr(attribute) else { return inherited };
        if let Some(found) = self.classes.find(name) {
            return found;
        }
        let what = format!("<{}>", e.label());
        cx.unknown(e.place_of(attribute), &what, "class", name, self.classes.names());
        inherited
    }

    fn classed(&self, cx: &mut Cx<'_>, e: &'e Element, inherited: &'e str) -> Classed<'e> {
        Classed { e, class: self.class_of(cx, e, "class", inherited), kind: &e.name }
    }

    /// Returns an attribute of the element, otherwise that of its class.
    fn attr(&self, at: Classed<'e>, name: &str) -> Option<(&'e str, FilePlace)> {
        // An overridden attribute of the class counts as read.
        let holder = self.classes.holder(at.class, at.kind, name);
        let of_class = holder.and_then(|h| Some((h.attr(name)?, h)));
        let own = at.e.attr(name).map(|own| (own, at.e));
        own.or(of_class).map(|(text, e)| (text, e.place_of(name)))
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

    /// Reads a number that must not be negative; 0 if it is missing.
    fn size(&self, cx: &mut Cx<'_>, at: Classed<'e>, name: &str, what: &str) -> f64 {
        let Some(x) = self.number(cx, at, name, what) else { return 0.0 };
        let place = self.attr(at, name).map_or(at.e.place(), |(_, p)| p);
        cx.not_negative(place, x, &format!("{what}: `{name}`")).unwrap_or(0.0)
    }

    /// Reads `true`, `false` or `auto`; returns `None` for `auto` and for a missing attribute.
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

/// Returns the meaning of one of several words.
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
        cx.bad(place, what, text, "a valid word", &format!("one of: {}", all.join(", ")));
    }
    found
}

/// Reads the `<compiler>` elements; for each attribute, the last one is used.
fn settings(cx: &mut Cx<'_>, root: &Element) -> Settings {
    let mut s = Settings::default();
    for e in root.all("compiler") {
        let mut choice = |name: &str, words: &[(&str, f64)]| {
            let text = e.attr(name)?;
            word(cx, e.place_of(name), text, &format!("<compiler>: `{name}`"), words)
        };
        let degree = std::f64::consts::PI / 180.0;
        s.angle = choice("angle", &[("radian", 1.0), ("degree", degree)]).unwrap_or(s.angle);
        let mut yes = |name: &str, now: bool| {
            choice(name, &[("true", 1.0), ("false", 0.0)]).map_or(now, |x| x > 0.0)
        };
        s.autolimits = yes("autolimits", s.autolimits);
        s.balance = yes("balanceinertia", s.balance);
        s.strip_path = yes("strippath", s.strip_path);
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
        for (least, name) in s.least.iter_mut().zip(["boundmass", "boundinertia"]) {
            let Some(x) = cx.number(e, name, "<compiler>") else { continue };
            let what = format!("<compiler>: `{name}`");
            *least = cx.not_negative(e.place_of(name), x, &what).unwrap_or(*least);
        }
        let folder = e.attr("meshdir").or(e.attr("assetdir"));
        s.mesh_folder = folder.map_or(s.mesh_folder, str::to_owned);
    }
    s
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            folder: String::new(),
            angle: std::f64::consts::PI / 180.0,
            euler: [(Vec3::x(), true), (Vec3::y(), true), (Vec3::z(), true)],
            autolimits: true,
            inertia: FromGeoms::WhenNotGiven,
            groups: [0.0, 5.0],
            mesh_folder: String::new(),
            strip_path: false,
            least: [0.0; 2],
            balance: false,
            total_mass: None,
        }
    }
}

/// Reads axes: lower case means moving axes, upper case fixed ones.
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
