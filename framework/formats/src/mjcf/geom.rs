//! Geoms of an MJCF body: shapes, and the inertia that they define.
//!
//! ```text
//! m = density · volume, unless the mass is given       J = Σ over geoms, about the body's frame
//! ```

use super::body::Site;
use super::collide::moving_surface;
use super::inside::Inside;
use super::orientation::turn_of_z;
use super::{Classed, FromGeoms, Mj};
use crate::error::{FaultKind, FilePlace};
use crate::mesh::solid::Properties;
use crate::read::Cx;
use crate::urdf::turned;
use crate::xml::Element;
use crate::{BodyShape, Description, Geometry, ShapeRole};
use linkwork_names::suggest;
use linkwork_spatial::{InertiaCheck, MassProperties, Mat3, Pose, RigidInertia, Vec3};
use std::f64::consts::PI;

impl<'e> Mj<'e> {
    /// Returns the mass properties of a body from its `<inertial>` or its geoms, increased to at least `boundmass` and `boundinertia`.
    pub fn mass(
        &self,
        cx: &mut Cx<'_>,
        body: &'e Element,
        inside: &[Inside<'e>],
        what: &str,
    ) -> MassProperties {
        let given = inside.iter().find(|i| i.e.name == "inertial");
        let (e, mut mass) = match (given, self.of(body).inertia) {
            (Some(i), FromGeoms::Never | FromGeoms::WhenNotGiven) => {
                (i.e, self.inertial(cx, i, what))
            }
            (None, FromGeoms::Never) => (body, MassProperties::massless()),
            (given, _) => match (given, self.mass_of_geoms(cx, body, inside, what)) {
                // In MuJoCo, `inertiafromgeom` does not replace the inertial of a body without geoms.
                (Some(i), none) if none == MassProperties::massless() => {
                    (i.e, self.inertial(cx, i, what))
                }
                (_, mass) => (body, mass),
            },
        };
        let balance = self.of(body).balance;
        let [least_mass, least_moment] = self.of(body).least;
        mass.mass = mass.mass.max(least_mass);
        if least_moment > 0.0 || balance {
            let mut axes = mass.inertia_com.symmetric_eigen();
            axes.eigenvalues.apply(|x| *x = x.max(least_moment));
            let I = axes.eigenvalues;
            // Allow for round-off, which can violate a triangle inequality that holds exactly.
            if balance && I.sum() < 2.0 * I.max() * (1.0 - 1e-12) {
                axes.eigenvalues = Vec3::repeat(I.sum() / 3.0);
            }
            mass.inertia_com = axes.recompose();
        }
        if mass == MassProperties::massless() {
            return mass;
        }
        let what = if given.is_some() { format!("{what}: <inertial>") } else { what.to_owned() };
        cx.checked(e, what, mass)
    }

    fn inertial(&self, cx: &mut Cx<'_>, i: &Inside<'e>, what: &str) -> MassProperties {
        let (e, what) = (i.e, format!("{what}: <inertial>"));
        e.touch();
        let at = Classed { e, class: i.class, kind: "inertial" };
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
        MassProperties::new(mass, X_BC.position, turned(&J, &X_BC))
    }

    fn mass_of_geoms(
        &self,
        cx: &mut Cx<'_>,
        body: &Element,
        inside: &[Inside<'e>],
        what: &str,
    ) -> MassProperties {
        let mut sum = RigidInertia::zero();
        for i in inside.iter().filter(|i| i.e.name == "geom") {
            let at = self.classed(cx, i.e, i.class);
            let group = self.number(cx, at, "group", what).unwrap_or(0.0);
            let [low, high] = self.of(body).groups;
            if !(low..=high).contains(&group) {
                continue;
            }
            let geom = format!("{what}: <geom>");
            let mass = self.number(cx, at, "mass", &geom);
            let density = self.number(cx, at, "density", &geom).unwrap_or(1000.0);
            if mass == Some(0.0) || (mass.is_none() && density == 0.0) {
                continue;
            }
            let Some((X_BG, solid)) = self.solid_mass(cx, i, at, &geom) else { continue };
            let mass = mass.unwrap_or(density * solid.volume);
            let J = solid.inertia * (mass / solid.volume);
            let own = MassProperties::new(mass, solid.centre, J)
                .with_check(InertiaCheck::PositiveMoments);
            match own.validate() {
                Ok(m) => sum += m.rotate(&X_BG.rotation).shift_to_parent(&X_BG.position),
                Err(error) => {
                    let help = "write a size and a positive mass or density for the geom".into();
                    cx.fault(i.e.place(), FaultKind::Inertia { what: geom, error, help });
                }
            }
        }
        if sum.mass() == 0.0 {
            return MassProperties::massless();
        }
        let J = sum.inertia_com();
        let J = (J + J.transpose()) * 0.5;
        MassProperties::new(sum.mass(), sum.com(), J)
    }

    /// Returns the pose of a geom in the body, and its volume and inertia for unit density.
    fn solid_mass(
        &self,
        cx: &mut Cx<'_>,
        i: &Inside<'e>,
        at: Classed<'e>,
        what: &str,
    ) -> Option<(Pose, Properties)> {
        if self.kind(i, at).0 == "mesh" {
            let mesh = self.mesh(cx, at, what)?;
            let pose = i.pose * self.pose(cx, at, what);
            return Some((pose, self.mesh_mass(cx, &mesh, i.e, what)?));
        }
        let (pose, geometry) = match self.kind(i, at).0 {
            "hfield" => (i.pose * self.pose(cx, at, what), self.height_field_box(cx, at, what)?),
            _ => self.solid(cx, i, what)?,
        };
        let shell = self.flag(cx, at, "shellinertia", what) == Some(true);
        let (volume, moments) = match shell {
            true => thin(&geometry),
            false => solid(&geometry),
        }?;
        let inertia = Mat3::from_diagonal(&(moments * volume));
        Some((pose, Properties { volume, centre: Vec3::zeros(), inertia }))
    }

    /// Returns the type of a geom, and its position in the file.
    fn kind(&self, i: &Inside<'e>, at: Classed<'e>) -> (&'e str, FilePlace) {
        self.attr(at, "type").unwrap_or_else(|| ("sphere", i.e.place()))
    }

    /// Adds the shapes of a geom: colliding geoms are also visible, unless their group is hidden.
    pub fn shape(&mut self, cx: &mut Cx<'_>, i: &Inside<'e>, body: &str, d: &mut Description) {
        let at = self.classed(cx, i.e, i.class);
        let name = i.e.attr("name").unwrap_or_default().to_owned();
        let what = format!("body `{body}`: <{}>", i.e.label());
        if !name.is_empty() {
            self.geoms.insert(i.e.attr("name").unwrap_or_default(), body.to_owned());
        }
        let before = (cx.faults.len(), cx.ignored.len());
        let solid = self.solid(cx, i, &what);
        let of_mesh = matches!(solid, Some((_, Geometry::Mesh { .. })));
        let Some((pose, geometry)) = solid else {
            // A fault or a note has been reported, except for unsupported types.
            if (cx.faults.len(), cx.ignored.len()) == before {
                cx.ignored.push(i.e.ignored(what, "a geom of an unsupported type"));
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
        let (filter, surface) = (self.filter(cx, at, &what), self.surface(cx, at, &what));
        let velocity = self.numbers::<3>(cx, at, "surfacevel", &what);
        moving_surface(cx, i.e, velocity, &what);
        let collides =
            filter.category != 0 || filter.meets != 0 || self.paired.contains(name.as_str());
        let hidden = self.number(cx, at, "group", &what).unwrap_or(0.0) >= 3.0;
        if of_mesh && let Geometry::Mesh { path: None, file, .. } = &geometry {
            let note = format!("the mesh file `{}` was not found", crate::read::shortened(file));
            cx.ignored.push(i.e.ignored(&what, note));
        }
        let mut add = |role| {
            let (body, name, geometry) = (body.to_owned(), name.clone(), geometry.clone());
            d.shapes.push(BodyShape { body, name, role, pose, geometry, color, surface, filter });
        };
        if !(hidden && collides) {
            add(ShapeRole::Visual);
        }
        if collides {
            add(ShapeRole::Collision);
        }
    }

    /// Returns the pose in the body and the shape of a geom; `None` after a fault or for an unsupported type.
    fn solid(&self, cx: &mut Cx<'_>, i: &Inside<'e>, what: &str) -> Option<(Pose, Geometry)> {
        let at = self.classed(cx, i.e, i.class);
        let (kind, place) = self.kind(i, at);
        if kind == "mesh" {
            let mesh = self.mesh(cx, at, what)?;
            let pose = i.pose * self.pose(cx, at, what);
            let (own, geometry) = self.mesh_geometry(cx, &mesh, what)?;
            return Some((pose * own, geometry));
        }
        if kind == "hfield" {
            let pose = i.pose * self.pose(cx, at, what);
            return Some((pose, self.height_field(cx, at, what)?));
        }
        let needed = match kind {
            "sphere" => 1,
            "capsule" | "cylinder" => 2,
            "box" | "ellipsoid" => 3,
            "plane" => 0,
            "sdf" => return None,
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
            let note = format!(
                "a {kind} that is fitted to a mesh; write type=\"mesh\" for the mesh itself"
            );
            cx.ignored.push(i.e.ignored(what, note));
            return None;
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
            pose = i.pose * Pose::new(turn_of_z(&z), (a + b) * 0.5);
            let half = (a - b).norm() * 0.5;
            size = match kind {
                "box" | "ellipsoid" => vec![size[0], size[0], half],
                _ => vec![size[0], half],
            };
        }
        let place = self.attr(at, "size").map_or(i.e.place(), |(_, p)| p);
        if kind != "plane" && size.iter().take(needed.max(1)).any(|s| !(*s > 0.0)) {
            let text = size.iter().map(f64::to_string).collect::<Vec<_>>().join(" ");
            let help = "write positive lengths in m";
            cx.bad(place, &format!("{what}: `size`"), &text, "positive lengths", help);
            return None;
        }
        Some((pose, of_size(kind, &size)))
    }
}

/// Half lengths (m) of a site that does not write them.
const SITE: [f64; 3] = [0.005; 3];

impl<'e> Mj<'e> {
    /// Returns the solid of a site; `None` after a fault, or if the solid follows from other attributes than its size.
    pub(super) fn zone(&self, cx: &mut Cx<'_>, site: &Site<'e>, what: &str) -> Option<Geometry> {
        let at = site.at;
        if self.attr(at, "fromto").is_some() || self.attr(at, "mesh").is_some() {
            return None;
        }
        let (kind, place) = match self.attr(at, "type") {
            Some((kind, place)) => (kind, place),
            None => ("sphere", site.e.place()),
        };
        let used = match kind {
            "sphere" => 1,
            "capsule" | "cylinder" => 2,
            "box" | "ellipsoid" => 3,
            other => {
                let types = ["sphere", "capsule", "ellipsoid", "cylinder", "box"];
                let help = suggest(other, "type", types);
                cx.bad(place, &format!("{what}: `type`"), other, "a type of site", &help);
                return None;
            }
        };
        let mut size = SITE;
        if let Some((text, place)) = self.attr(at, "size") {
            let own = cx.parse_list(place.clone(), text, &format!("{what}: `size`"), 1..=3)?;
            size.iter_mut().zip(&own).for_each(|(s, x)| *s = *x);
            if size.iter().take(used).any(|s| !(*s > 0.0)) {
                let help = "write positive lengths in m";
                cx.bad(place, &format!("{what}: `size`"), text, "positive lengths", help);
                return None;
            }
        }
        Some(of_size(kind, &size))
    }
}

/// Converts sizes: those of MuJoCo are half lengths.
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

/// Returns the volume (m³) and moments of inertia for 1 kg about the centre (m²); `None` for shapes without volume.
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
            // A capsule is a cylinder and two hemispheres, whose centres of mass are 3r/8 beyond
            // its ends.
            let (vc, vs) = (PI * r * r * l, 4.0 / 3.0 * PI * r * r * r);
            let (mc, ms) = (vc / (vc + vs), vs / (vc + vs));
            let x = mc * (3.0 * r * r + l * l) / 12.0
                + ms * (0.4 * r * r + 0.25 * l * l + 0.375 * r * l);
            (vc + vs, Vec3::new(x, x, mc * 0.5 * r * r + ms * 0.4 * r * r))
        }
        Geometry::Plane { .. } | Geometry::Mesh { .. } | Geometry::HeightField { .. } => {
            return None;
        }
    })
}

/// Returns the area (m²) and moments of inertia for 1 kg about the centre (m²) of a thin shell; `None` for surfaces.
fn thin(geometry: &Geometry) -> Option<(f64, Vec3)> {
    Some(match *geometry {
        Geometry::Sphere { radius: r } => (4.0 * PI * r * r, Vec3::repeat(r * r * 2.0 / 3.0)),
        Geometry::Box { size } => {
            let [a, b, c] = size;
            let faces = [b * c, a * c, a * b];
            let area = 2.0 * faces.iter().sum::<f64>();
            // Mean of x² over the surface: the two faces perpendicular to x are at a/2, and x on the other faces is
            // distributed as on a bar along x.
            let square = |k: usize| {
                let across = faces[k] * size[k] * size[k] / 4.0;
                let along: f64 = (0..3).filter(|j| *j != k).map(|j| faces[j]).sum();
                2.0 * (across + along * size[k] * size[k] / 12.0) / area
            };
            let [x, y, z] = [square(0), square(1), square(2)];
            (area, Vec3::new(y + z, x + z, x + y))
        }
        Geometry::Cylinder { radius: r, length: l } => {
            let (side, ends) = (2.0 * PI * r * l, 2.0 * PI * r * r);
            let area = side + ends;
            let x = side * (0.5 * r * r + l * l / 12.0) + ends * (0.25 * r * r + 0.25 * l * l);
            (area, Vec3::new(x, x, side * r * r + ends * 0.5 * r * r) / area)
        }
        Geometry::Capsule { radius: r, length: l } => {
            // The centre of a hemisphere's surface is r/2 beyond the end of the cylinder.
            let (side, ends) = (2.0 * PI * r * l, 4.0 * PI * r * r);
            let area = side + ends;
            let x = side * (0.5 * r * r + l * l / 12.0)
                + ends * (r * r * 2.0 / 3.0 + 0.25 * l * l + 0.5 * r * l);
            (area, Vec3::new(x, x, side * r * r + ends * r * r * 2.0 / 3.0) / area)
        }
        Geometry::Ellipsoid { radii: [a, b, c] } => {
            // Use Thomsen's formula for the area (within 1.1 %) and the difference of two
            // ellipsoids as the shell, as in MuJoCo.
            let p = 1.6075;
            let power = |x: f64, y: f64| (x * y).powf(p);
            let mean = (power(a, b) + power(a, c) + power(b, c)) / 3.0;
            let area = 4.0 * PI * mean.powf(1.0 / p);
            let faces = a * b + b * c + c * a;
            let moment =
                |x: f64, y: f64| (x * x + y * y) / 5.0 + 2.0 * a * b * c * (x + y) / (5.0 * faces);
            (area, Vec3::new(moment(b, c), moment(a, c), moment(a, b)))
        }
        Geometry::Plane { .. } | Geometry::Mesh { .. } | Geometry::HeightField { .. } => {
            return None;
        }
    })
}
