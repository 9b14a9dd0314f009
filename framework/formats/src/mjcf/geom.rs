//! Geoms of an MJCF body: shapes, and the inertia that comes from them.
//!
//! ```text
//! m = density · volume, unless the mass is given       J = Σ over geoms, about the body's frame
//! ```

use super::body::Inside;
use super::{Classed, FromGeoms, Mj};
use crate::error::FaultKind;
use crate::read::Cx;
use crate::urdf::turned;
use crate::xml::Element;
use crate::{BodyShape, Description, Geometry, ShapeRole};
use linkwork_multibody::names::suggest;
use linkwork_spatial::{InertiaCheck, MassProperties, Mat3, Pose, Quat, RigidInertia, Vec3};
use std::f64::consts::PI;

impl<'e> Mj<'e> {
    /// Mass properties of a body: its `<inertial>`, or its geoms.
    pub fn mass(
        &self,
        cx: &mut Cx<'_>,
        body: &'e Element,
        inside: &[Inside<'e>],
        what: &str,
    ) -> MassProperties {
        let given = inside.iter().find(|i| i.e.name == "inertial");
        match (given, self.settings.inertia) {
            (Some(i), FromGeoms::Never | FromGeoms::WhenNotGiven) => self.inertial(cx, i, what),
            (None, FromGeoms::Never) => MassProperties::massless(),
            _ => self.mass_of_geoms(cx, body, inside, what),
        }
    }

    fn inertial(&self, cx: &mut Cx<'_>, i: &Inside<'e>, what: &str) -> MassProperties {
        let (e, what) = (i.e, format!("{what}: <inertial>"));
        e.touch();
        let at = Classed { e, class: i.class };
        let X_BC = i.pose * self.pose(cx, at, &what);
        cx.required(e, "mass", &what);
        let mass = cx.number(e, "mass", &what);
        let J = match (cx.numbers::<6>(e, "fullinertia", &what), e.attr("diaginertia")) {
            (Some([xx, yy, zz, xy, xz, yz]), _) => {
                Some(Mat3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz))
            }
            (None, Some(_)) => cx
                .numbers::<3>(e, "diaginertia", &what)
                .map(|d| Mat3::from_diagonal(&Vec3::from(d))),
            (None, None) => {
                if e.attr("fullinertia").is_none() {
                    let help = "write diaginertia=\"ixx iyy izz\" or fullinertia=\"..\"";
                    cx.missing(e, &what, "inertia", help);
                }
                None
            }
        };
        let (Some(mass), Some(J)) = (mass, J) else { return MassProperties::massless() };
        cx.checked(e, what, MassProperties::new(mass, X_BC.position, turned(&J, &X_BC)))
    }

    fn mass_of_geoms(
        &self,
        cx: &mut Cx<'_>,
        body: &'e Element,
        inside: &[Inside<'e>],
        what: &str,
    ) -> MassProperties {
        let mut sum = RigidInertia::zero();
        for i in inside.iter().filter(|i| i.e.name == "geom") {
            let at = self.classed(cx, i.e, i.class);
            let group = self.number(cx, at, "group", what).unwrap_or(0.0);
            let [low, high] = self.settings.groups;
            if !(low..=high).contains(&group) {
                continue;
            }
            let geom = format!("{what}: <geom>");
            let mass = self.number(cx, at, "mass", &geom);
            let density = self.number(cx, at, "density", &geom).unwrap_or(1000.0);
            if mass == Some(0.0) || (mass.is_none() && density == 0.0) {
                continue;
            }
            let Some((X_BG, geometry)) = self.solid(cx, i, &geom) else { continue };
            let Some((volume, unit_moments)) = solid(&geometry) else {
                if matches!(geometry, Geometry::Mesh { .. }) {
                    let note = "the inertia of a mesh is not computed: this geom adds no mass";
                    cx.ignored.push(i.e.ignored(geom, note));
                }
                continue;
            };
            let mass = mass.unwrap_or(density * volume);
            let J = Mat3::from_diagonal(&(unit_moments * mass));
            let own =
                MassProperties::new(mass, Vec3::zeros(), J).with_check(InertiaCheck::Physical);
            match own.validate() {
                Ok(m) => sum += m.rotate(&X_BG.rotation).shift_to_parent(&X_BG.position),
                Err(error) => {
                    let help = "give the geom a size and a mass or density above zero".into();
                    cx.fault(i.e.place(), FaultKind::Inertia { what: geom, error, help });
                }
            }
        }
        if sum.mass() == 0.0 {
            return MassProperties::massless();
        }
        let J = sum.inertia_com();
        let J = (J + J.transpose()) * 0.5;
        cx.checked(body, what.into(), MassProperties::new(sum.mass(), sum.com(), J))
    }

    /// The shapes that a geom is: what collides is also seen, unless its group is hidden.
    pub fn shape(&self, cx: &mut Cx<'_>, i: &Inside<'e>, body: &str, d: &mut Description) {
        let at = self.classed(cx, i.e, i.class);
        let name = i.e.attr("name").unwrap_or_default().to_owned();
        let what = format!("body `{body}`: <{}>", i.e.label());
        let before = cx.faults.len();
        let solid = self.solid(cx, i, &what);
        let of_mesh = matches!(solid, Some((_, Geometry::Mesh { .. })));
        let Some((pose, geometry)) = solid else {
            if cx.faults.len() == before {
                cx.ignored.push(i.e.ignored(what, "a geom of a type that is not read"));
            }
            return;
        };
        let mut color = self.numbers::<4>(cx, at, "rgba", &what);
        if color.is_none()
            && let Some((material, _)) = self.attr(at, "material")
            && let Some(m) = self.materials.get(material)
        {
            color = cx.numbers::<4>(m, "rgba", "a <material>");
        }
        let flag = |cx: &mut Cx<'_>, name: &str| self.number(cx, at, name, &what) != Some(0.0);
        let collides = flag(cx, "contype") | flag(cx, "conaffinity");
        let hidden = self.number(cx, at, "group", &what).unwrap_or(0.0) >= 3.0;
        if of_mesh && let Geometry::Mesh { path: None, file, .. } = &geometry {
            let note = format!("the mesh file `{}` was not found", crate::read::shortened(file));
            cx.ignored.push(i.e.ignored(&what, note));
        }
        let mut add = |role| {
            let (body, name, geometry) = (body.to_owned(), name.clone(), geometry.clone());
            d.shapes.push(BodyShape { body, name, role, pose, geometry, color });
        };
        if !(hidden && collides) {
            add(ShapeRole::Visual);
        }
        if collides {
            add(ShapeRole::Collision);
        }
    }

    /// Pose in the body and shape of a geom; `None` after a fault or for a type that is not read.
    fn solid(&self, cx: &mut Cx<'_>, i: &Inside<'e>, what: &str) -> Option<(Pose, Geometry)> {
        let at = self.classed(cx, i.e, i.class);
        let (kind, place) = self.attr(at, "type").unwrap_or_else(|| {
            (if i.e.attr("mesh").is_some() { "mesh" } else { "sphere" }, i.e.place())
        });
        if kind == "mesh" {
            let pose = i.pose * self.pose(cx, at, what);
            return Some((pose, self.mesh(cx, at, what)?));
        }
        let needed = match kind {
            "sphere" => 1,
            "capsule" | "cylinder" => 2,
            "box" | "ellipsoid" => 3,
            "plane" => 0,
            "hfield" | "sdf" => return None,
            other => {
                let types = [
                    "plane",
                    "hfield",
                    "sphere",
                    "capsule",
                    "ellipsoid",
                    "cylinder",
                    "box",
                    "mesh",
                    "sdf",
                ];
                let help = suggest(other, "type", types);
                cx.bad(place, &format!("{what}: `type`"), other, "a type of geom", &help);
                return None;
            }
        };
        if self.attr(at, "mesh").is_some() {
            return None; // a primitive fitted to a mesh
        }
        let between = self.numbers::<6>(cx, at, "fromto", what).filter(|_| needed >= 2);
        let needed = if between.is_some() { 1 } else { needed };
        let mut size = match self.attr(at, "size") {
            Some((text, place)) => {
                cx.parse_list(place, text, &format!("{what}: `size`"), needed.max(1)..=10)?
            }
            None if needed == 0 => vec![0.0; 2],
            None => {
                cx.missing(i.e, what, "`size`", format!("write {needed} numbers in m"));
                return None;
            }
        };
        let mut pose = i.pose * self.pose(cx, at, what);
        if let Some([ax, ay, az, bx, by, bz]) = between {
            let (a, b) = (Vec3::new(ax, ay, az), Vec3::new(bx, by, bz));
            let z = cx.unit(i.e.place_of("fromto"), a - b, "", &format!("{what}: `fromto`"))?;
            let half_turn = Quat::from_scaled_axis(Vec3::x() * PI);
            let turn = Quat::rotation_between(&Vec3::z(), &z).unwrap_or(half_turn);
            pose = i.pose * Pose::new(turn, (a + b) * 0.5);
            let half = (a - b).norm() * 0.5;
            size = match kind {
                "box" | "ellipsoid" => vec![size[0], size[0], half],
                _ => vec![size[0], half],
            };
        }
        let place = self.attr(at, "size").map_or(i.e.place(), |(_, p)| p);
        if kind != "plane" && size.iter().take(needed.max(1)).any(|s| !(*s > 0.0)) {
            let text = size.iter().map(f64::to_string).collect::<Vec<_>>().join(" ");
            let help = "write lengths above zero, in m";
            cx.bad(place, &format!("{what}: `size`"), &text, "positive lengths", help);
            return None;
        }
        Some((pose, of_size(kind, &size)))
    }

    fn mesh(&self, cx: &mut Cx<'_>, at: Classed<'e>, what: &str) -> Option<Geometry> {
        let (name, place) = self.attr(at, "mesh").or_else(|| {
            cx.missing(at.e, what, "`mesh`", "name a mesh of <asset>");
            None
        })?;
        let Some(asset) = self.meshes.get(name) else {
            let names = self.meshes.keys().map(String::as_str);
            cx.unknown(place, what, "mesh", name, names);
            return None;
        };
        let file = asset.attr("file").unwrap_or_default();
        let asset_at = self.classed(cx, asset, self.main);
        let scaled = self.numbers::<3>(cx, asset_at, "scale", what);
        let folder = self.settings.mesh_folder.trim_end_matches('/');
        let file = if folder.is_empty() { file.to_owned() } else { format!("{folder}/{file}") };
        let path = crate::mesh::find(&file, cx.options);
        Some(Geometry::Mesh { file, path, scale: scaled.unwrap_or([1.0; 3]) })
    }
}

/// MuJoCo's sizes are halves.
fn of_size(kind: &str, s: &[f64]) -> Geometry {
    match kind {
        "sphere" => Geometry::Sphere { radius: s[0] },
        "capsule" => Geometry::Capsule { radius: s[0], length: 2.0 * s[1] },
        "cylinder" => Geometry::Cylinder { radius: s[0], length: 2.0 * s[1] },
        "box" => Geometry::Box { size: [2.0 * s[0], 2.0 * s[1], 2.0 * s[2]] },
        "ellipsoid" => Geometry::Ellipsoid { radii: [s[0], s[1], s[2]] },
        _ => Geometry::Plane {
            size: [2.0 * s[0].max(0.0), 2.0 * s.get(1).copied().unwrap_or(0.0).max(0.0)],
        },
    }
}

/// Volume (m³) and moments of inertia for 1 kg about the centre (m²); `None` for what has none.
pub(crate) fn solid(geometry: &Geometry) -> Option<(f64, Vec3)> {
    Some(match *geometry {
        Geometry::Sphere { radius: r } => (4.0 / 3.0 * PI * r * r * r, Vec3::repeat(0.4 * r * r)),
        Geometry::Ellipsoid { radii: [a, b, c] } => {
            let (a2, b2, c2) = (a * a, b * b, c * c);
            (4.0 / 3.0 * PI * a * b * c, Vec3::new(b2 + c2, a2 + c2, a2 + b2) / 5.0)
        }
        Geometry::Box { size: [a, b, c] } => {
            let (a2, b2, c2) = (a * a, b * b, c * c);
            (a * b * c, Vec3::new(b2 + c2, a2 + c2, a2 + b2) / 12.0)
        }
        Geometry::Cylinder { radius: r, length: l } => {
            let x = (3.0 * r * r + l * l) / 12.0;
            (PI * r * r * l, Vec3::new(x, x, 0.5 * r * r))
        }
        Geometry::Capsule { radius: r, length: l } => {
            // A cylinder and two half spheres, whose own centres are 3r/8 beyond its ends.
            let (vc, vs) = (PI * r * r * l, 4.0 / 3.0 * PI * r * r * r);
            let (mc, ms) = (vc / (vc + vs), vs / (vc + vs));
            let x = mc * (3.0 * r * r + l * l) / 12.0
                + ms * (0.4 * r * r + 0.25 * l * l + 0.375 * r * l);
            (vc + vs, Vec3::new(x, x, mc * 0.5 * r * r + ms * 0.4 * r * r))
        }
        Geometry::Plane { .. } | Geometry::Mesh { .. } => return None,
    })
}
