//! URDF export.
//!
//! ```text
//! world ─X_PJ─ subhinge 1 ─ link ─ subhinge 2 ─ … ─ X_BJ⁻¹ ─ body
//! ```
//! In URDF, the frame of a link is that of its joint, so a body whose hinge frame differs gets an additional fixed joint, and each subhinge except
//! the last gets a massless link. Positions, masses, inertias, axes and limits keep every digit; rotations are converted to roll, pitch and yaw
//! (1e-15). URDF does not support infinite limits: the greatest double is written, which [`read_urdf`](crate::read_urdf) reads as infinite.

use crate::markup::escaped;
use crate::{BodyShape, Coupling, Description, Geometry, HingeCoordinate, Joint, ShapeRole};
use linkwork_multibody::{
    BodySpec, Builder, Coordinate, Limits, Multibody, Stop, Subhinge, SubhingeKind,
};
use linkwork_spatial::{MassProperties, Mat3, Pose, Quat, Vec3};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;
use thiserror::Error;

/// A URDF text, and a list of what it does not contain.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UrdfText {
    /// The file's text.
    pub text: String,
    /// Properties of the mechanism that URDF does not support, one line each.
    pub left_out: Vec<String>,
}

/// The reason why a mechanism cannot be written as URDF.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum ExportFault {
    /// A ball.
    #[error(
        "body `{body}`: URDF has no ball joint, and a chain of three hinges is a different mechanism\n  \
         help: use a chain of three pins if it matches the machine, or write RON"
    )]
    Ball {
        /// The body.
        body: String,
    },
    /// A screw.
    #[error("body `{body}`: URDF has no screw joint\n  help: write RON")]
    Screw {
        /// The body.
        body: String,
    },
    /// A name that XML or URDF does not allow.
    #[error(
        "the name `{name}` cannot be written: it is empty, begins or ends with a space, has \
         control characters, or xacro's `${{` or `$(`\n  help: rename it"
    )]
    Name {
        /// The name.
        name: String,
    },
    /// The mechanism is not valid.
    #[error("{0}")]
    Build(linkwork_multibody::MechanismFault),
}

/// All reasons why a mechanism cannot be written as URDF.
#[derive(Clone, Debug, PartialEq, Error)]
#[error("{}", faults.iter().map(|f| f.to_string()).collect::<Vec<_>>().join("\n"))]
pub struct ExportError {
    /// The reasons, at least one.
    pub faults: Vec<ExportFault>,
}

impl From<&Multibody> for Description {
    /// Creates a description with only the bodies and nodes.
    fn from(mbs: &Multibody) -> Self {
        Description { name: "mechanism".into(), builder: Builder::from(mbs), ..Self::default() }
    }
}

/// Writes the description as URDF.
///
/// # Errors
/// Ball and screw joints, names that XML does not allow, and invalid mechanisms.
pub fn write_urdf(d: &Description) -> Result<UrdfText, ExportError> {
    let mut faults = Vec::new();
    let mbs = match d.builder.build() {
        Ok(mbs) => mbs,
        Err(e) => {
            let faults = e.faults.into_iter().map(ExportFault::Build).collect();
            return Err(ExportError { faults });
        }
    };
    let specs: Vec<BodySpec> = mbs.body_ids().map(|b| mbs.spec(b)).collect();
    let mut w = Writer::new(d, &specs);
    let root = specs.iter().filter(|b| b.parent == "world").count() == 1
        && specs.iter().any(|b| b.parent == "world" && is_base(b));
    if !root {
        w.link("world", None, &[]);
    }
    for b in &specs {
        for s in &b.hinge.subhinges {
            match s.kind {
                SubhingeKind::Ball => faults.push(ExportFault::Ball { body: b.name.clone() }),
                SubhingeKind::Screw { .. } => {
                    faults.push(ExportFault::Screw { body: b.name.clone() });
                }
                _ => {}
            }
        }
        w.body(b, root && b.parent == "world");
    }
    for n in mbs.nodes() {
        let body = mbs.get(n.body()).name().to_owned();
        if w.links.insert(n.name().to_owned()) {
            w.link(n.name(), None, &[]);
            let joint = w.fresh_joint(&format!("{}_frame", n.name()));
            w.fixed(&joint, &body, n.name(), &n.pose());
        } else {
            w.left_out.push(format!("node `{}`: a link already has this name", n.name()));
        }
    }
    w.leave_out(&specs);
    let names = w.links.iter().chain(w.joints.iter()).chain([&d.name]);
    let bad = |n: &&String| n.trim() != n.as_str() || !writable(n);
    faults.extend(names.filter(bad).map(|n| ExportFault::Name { name: n.clone() }));
    if !faults.is_empty() {
        return Err(ExportError { faults });
    }
    let text = format!(
        "<?xml version=\"1.0\"?>\n<robot name=\"{}\">\n{}</robot>\n",
        escaped(&d.name),
        w.out
    );
    Ok(UrdfText { text, left_out: w.left_out })
}

/// Whether a body can be the root link itself.
fn is_base(b: &BodySpec) -> bool {
    b.hinge.nv() == 0
        && b.hinge_in_parent == Pose::identity()
        && b.hinge_in_body == Pose::identity()
}

struct Writer<'d> {
    d: &'d Description,
    out: String,
    /// Names taken.
    links: BTreeSet<String>,
    joints: BTreeSet<String>,
    /// Names of the moving joints.
    names: BTreeMap<(String, usize), String>,
    mimics: BTreeMap<String, (String, f64, f64)>,
    left_out: Vec<String>,
}

impl<'d> Writer<'d> {
    fn new(d: &'d Description, specs: &[BodySpec]) -> Self {
        let links = specs.iter().map(|b| b.name.clone()).chain(["world".to_owned()]).collect();
        let mut w = Writer {
            d,
            out: String::new(),
            links,
            joints: d.joints.iter().map(|j| j.name.clone()).collect(),
            names: BTreeMap::new(),
            mimics: BTreeMap::new(),
            left_out: Vec::new(),
        };
        for b in specs {
            for i in 0..b.hinge.subhinges.len() {
                let own =
                    d.joints.iter().find(|j| j.body == b.name && j.subhinge == i && j.count == 1);
                let name = match own {
                    Some(j) => j.name.clone(),
                    None if b.hinge.subhinges.len() == 1 => {
                        w.fresh_joint(&format!("{}_joint", b.name))
                    }
                    None => w.fresh_joint(&format!("{}_joint{}", b.name, i + 1)),
                };
                w.names.insert((b.name.clone(), i), name);
            }
        }
        for c in &d.couplings {
            match w.mimic(c) {
                Some((follower, rest)) if !w.mimics.contains_key(&follower) => {
                    drop(w.mimics.insert(follower, rest));
                }
                _ => w.left_out.push(format!("coupling `{}` cannot be a mimic joint", c.name)),
            }
        }
        w
    }

    /// Returns q_a = ratio q_b + offset for a coupling with two terms.
    fn mimic(&self, c: &Coupling) -> Option<(String, (String, f64, f64))> {
        let ([a, b], []) = (&c.terms[..], &c.powers[..]) else { return None };
        let name = |h: &HingeCoordinate| self.names.get(&(h.body.clone(), h.subhinge)).cloned();
        let (ratio, offset) = (-b.factor / a.factor, c.constant / a.factor);
        let sound = ratio.is_finite() && offset.is_finite();
        sound.then_some((name(&a.coordinate)?, (name(&b.coordinate)?, ratio, offset)))
    }

    fn fresh_joint(&mut self, wish: &str) -> String {
        fresh(&mut self.joints, wish)
    }

    /// Writes the links and joints from the parent to a body.
    fn body(&mut self, b: &BodySpec, base: bool) {
        let shapes: Vec<&BodyShape> = self.d.shapes.iter().filter(|s| s.body == b.name).collect();
        self.link(&b.name, Some(&b.mass), &shapes);
        if base {
            return;
        }
        let (n, away) = (b.hinge.subhinges.len(), b.hinge_in_body != Pose::identity());
        let (mut parent, mut X) = (b.parent.clone(), b.hinge_in_parent);
        for (i, s) in b.hinge.subhinges.iter().enumerate() {
            let last = i + 1 == n && !away;
            let child = match last {
                true => b.name.clone(),
                false => {
                    let link = fresh(&mut self.links, &format!("{}_link{}", b.name, i + 1));
                    self.link(&link, None, &[]);
                    link
                }
            };
            let name = self.names[&(b.name.clone(), i)].clone();
            let data = self.d.joint(&name).cloned();
            self.joint(&name, s, &parent, &child, &X, data.as_ref());
            (parent, X) = (child, Pose::identity());
        }
        if n == 0 || away {
            let held = self.d.joints.iter().find(|j| j.body == b.name && j.count == 0);
            let name = match held {
                Some(j) if n == 0 => j.name.clone(),
                _ => self.fresh_joint(&format!("{}_fixed", b.name)),
            };
            self.fixed(&name, &parent, &b.name, &(X * b.hinge_in_body.inverse()));
        }
    }

    fn link(&mut self, name: &str, mass: Option<&MassProperties>, shapes: &[&BodyShape]) {
        let mut inside = String::new();
        if let Some(m) = mass.filter(|m| m.mass != 0.0) {
            let J = (m.inertia_com + m.inertia_com.transpose()) * 0.5;
            let J = if m.inertia_com == m.inertia_com.transpose() { m.inertia_com } else { J };
            let _ = write!(
                inside,
                "    <inertial>\n      <origin xyz=\"{}\"/>\n      <mass value=\"{:?}\"/>\n      {}\n    \
                 </inertial>\n",
                three(&m.com),
                m.mass,
                inertia(&J)
            );
        }
        for s in shapes {
            match shape(s) {
                Some(text) => inside.push_str(&text),
                None => {
                    self.left_out.push(format!("body `{}`: {:?} {:?}", s.body, s.role, s.geometry))
                }
            }
        }
        let name = escaped(name);
        let _ = match inside.is_empty() {
            true => writeln!(self.out, "  <link name=\"{name}\"/>"),
            false => writeln!(self.out, "  <link name=\"{name}\">\n{inside}  </link>"),
        };
    }

    fn fixed(&mut self, name: &str, parent: &str, child: &str, X: &Pose) {
        let locked = Subhinge::from(SubhingeKind::Locked);
        self.joint(name, &locked, parent, child, X, None);
    }

    fn joint(
        &mut self,
        name: &str,
        s: &Subhinge,
        parent: &str,
        child: &str,
        X: &Pose,
        data: Option<&Joint>,
    ) {
        let l = s.limits;
        let bounded = l.lower.is_finite() || l.upper.is_finite();
        let kind = match s.kind {
            SubhingeKind::Pin { .. } if bounded => "revolute",
            SubhingeKind::Pin { .. } => "continuous",
            SubhingeKind::Slider { .. } => "prismatic",
            SubhingeKind::Free => "floating",
            _ => "fixed",
        };
        let mut inside = origin(X, 4);
        let _ = write!(
            inside,
            "    <parent link=\"{}\"/>\n    <child link=\"{}\"/>\n",
            escaped(parent),
            escaped(child)
        );
        if let SubhingeKind::Pin { axis } | SubhingeKind::Slider { axis } = s.kind {
            let _ = writeln!(inside, "    <axis xyz=\"{}\"/>", three(&axis));
            inside.push_str(&limit(kind, &l));
        }
        // The damping and friction of the hinge have priority over the values of the joint in the
        // original file.
        let or = |own: f64, said: Option<f64>| if own != 0.0 { own } else { said.unwrap_or(0.0) };
        let damping = or(s.damping, data.map(|j| j.damping));
        let friction = or(s.friction.force, data.map(|j| j.friction));
        if damping != 0.0 || friction != 0.0 {
            let _ = writeln!(
                inside,
                "    <dynamics damping=\"{damping:?}\" friction=\"{friction:?}\"/>"
            );
        }
        if let Some((other, ratio, offset)) = self.mimics.get(name) {
            let other = escaped(other);
            let _ = writeln!(
                inside,
                "    <mimic joint=\"{other}\" multiplier=\"{ratio:?}\" offset=\"{offset:?}\"/>"
            );
        }
        let name = escaped(name);
        let _ = writeln!(self.out, "  <joint name=\"{name}\" type=\"{kind}\">\n{inside}  </joint>");
    }

    /// Lists properties that URDF does not support.
    fn leave_out(&mut self, specs: &[BodySpec]) {
        for b in specs {
            if b.modes.is_some() {
                self.left_out.push(format!("modes of body `{}`", b.name));
            }
            for (i, s) in b.hinge.subhinges.iter().enumerate() {
                let mut tell = |what: &str| {
                    self.left_out.push(format!("body `{}`, subhinge {i}: {what}", b.name));
                };
                if s.armature != 0.0 {
                    tell(&format!("armature {:?}", s.armature));
                }
                if s.gear != 1.0 {
                    tell(&format!("gear {:?}", s.gear));
                }
                if s.coordinate == Coordinate::Prescribed {
                    tell("prescribed");
                }
                if s.friction.rate != 0.0 {
                    tell(&format!("friction's rate {:?}", s.friction.rate));
                }
                if s.stop != Stop::Usual {
                    tell(&format!("stop {:?}", s.stop));
                }
                if s.damping != 0.0 && s.kind == SubhingeKind::Ball {
                    tell(&format!("damping {:?}", s.damping));
                }
            }
        }
        let d = self.d;
        self.left_out.extend(d.loops.iter().map(|l| format!("loop `{}`", l.name)));
        self.left_out.extend(d.devices.iter().map(|x| format!("device `{}`", x.name)));
        self.left_out.extend(d.wheels.iter().map(|w| format!("wheel `{}`", w.body)));
        self.left_out.extend(d.initial.iter().map(|i| format!("initial q of `{}`", i.body)));
        let springs = d.joints.iter().filter(|j| j.stiffness != 0.0);
        self.left_out.extend(springs.map(|j| format!("spring of joint `{}`", j.name)));
    }
}

/// Returns a free name and reserves it.
fn fresh(taken: &mut BTreeSet<String>, wish: &str) -> String {
    let mut name = wish.to_owned();
    while !taken.insert(name.clone()) {
        name.push('_');
    }
    name
}

/// Formats three numbers; `{:?}` of an f64 is the shortest text that reads back as the same number.
fn three(v: &Vec3) -> String {
    format!("{:?} {:?} {:?}", v.x, v.y, v.z)
}

fn inertia(J: &Mat3) -> String {
    format!(
        "<inertia ixx=\"{:?}\" ixy=\"{:?}\" ixz=\"{:?}\" iyy=\"{:?}\" iyz=\"{:?}\" izz=\"{:?}\"/>",
        J[(0, 0)],
        J[(0, 1)],
        J[(0, 2)],
        J[(1, 1)],
        J[(1, 2)],
        J[(2, 2)]
    )
}

fn origin(X: &Pose, indent: usize) -> String {
    if *X == Pose::identity() {
        return String::new();
    }
    let rpy = Vec3::from(roll_pitch_yaw(&X.rotation));
    format!("{:indent$}<origin xyz=\"{}\" rpy=\"{}\"/>\n", "", three(&X.position), three(&rpy))
}

/// Returns the angles of Rz(yaw) Ry(pitch) Rx(roll), also for a pitch of ±90°: pitch and roll are computed after the yaw is removed, so that they
/// compensate for its value.
fn roll_pitch_yaw(R: &Quat) -> [f64; 3] {
    let R = R.to_rotation_matrix().into_inner();
    let yaw = R[(1, 0)].atan2(R[(0, 0)]);
    let (s, c) = yaw.sin_cos();
    let turned = |j: usize| (c * R[(0, j)] + s * R[(1, j)], c * R[(1, j)] - s * R[(0, j)]);
    let pitch = (-R[(2, 0)]).atan2(turned(0).0);
    let roll = (-turned(2).1).atan2(turned(1).1);
    [roll, pitch, yaw]
}

fn limit(kind: &str, l: &Limits) -> String {
    if kind == "continuous" && l.rate.is_infinite() && l.effort.is_infinite() {
        return String::new();
    }
    let finite = |x: f64| x.clamp(-f64::MAX, f64::MAX);
    let range = match kind {
        "continuous" => String::new(),
        _ => format!(" lower=\"{:?}\" upper=\"{:?}\"", finite(l.lower), finite(l.upper)),
    };
    format!(
        "    <limit{range} velocity=\"{:?}\" effort=\"{:?}\"/>\n",
        finite(l.rate),
        finite(l.effort)
    )
}

/// Writes a shape, or returns `None` for a shape that URDF does not have.
fn shape(s: &BodyShape) -> Option<String> {
    let tag = match s.role {
        ShapeRole::Visual => "visual",
        ShapeRole::Collision => "collision",
        ShapeRole::Contact => return None,
    };
    let file = if let Geometry::Mesh { file, .. } = &s.geometry { file } else { "" };
    if !writable(file) || !writable(&s.name) {
        return None;
    }
    let geometry = match &s.geometry {
        Geometry::Box { size } => format!("<box size=\"{}\"/>", three(&Vec3::from(*size))),
        Geometry::Sphere { radius } => format!("<sphere radius=\"{radius:?}\"/>"),
        Geometry::Cylinder { radius, length } => {
            format!("<cylinder radius=\"{radius:?}\" length=\"{length:?}\"/>")
        }
        Geometry::Capsule { radius, length } => {
            format!("<capsule radius=\"{radius:?}\" length=\"{length:?}\"/>")
        }
        Geometry::Mesh { file, scale, .. } => {
            let scale = three(&Vec3::from(*scale));
            format!("<mesh filename=\"{}\" scale=\"{scale}\"/>", escaped(file))
        }
        Geometry::Ellipsoid { .. } | Geometry::Plane { .. } | Geometry::HeightField { .. } => {
            return None;
        }
    };
    let name = match s.name.is_empty() {
        true => String::new(),
        false => format!(" name=\"{}\"", escaped(&s.name)),
    };
    let color = s.color.filter(|_| tag == "visual").map(|[r, g, b, a]| {
        let rgba = format!("{r:?} {g:?} {b:?} {a:?}");
        format!("      <material name=\"rgba {rgba}\"><color rgba=\"{rgba}\"/></material>\n")
    });
    Some(format!(
        "    <{tag}{name}>\n{}      <geometry>{geometry}</geometry>\n{}    </{tag}>\n",
        origin(&s.pose, 6),
        color.unwrap_or_default()
    ))
}

/// XML has no control characters, and readers of URDF interpret `${` and `$(` as xacro.
fn writable(text: &str) -> bool {
    !text.chars().any(char::is_control) && !text.contains("${") && !text.contains("$(")
}
