//! Meshes of an MJCF file: their files, and the mass properties of mesh geoms.
//!
//! ```text
//! vertex of the geom = scale ∘ R(refquat)ᵀ (vertex of the file − refpos)
//! ```

use super::defaults::MAIN;
use super::{Classed, Mj, word};
use crate::mesh::hull::hull;
use crate::mesh::solid::{Filling, Properties, properties};
use crate::read::Cx;
use crate::xml::Element;
use crate::{Geometry, mesh_corners};
use linkwork_spatial::nalgebra::Quaternion;
use linkwork_spatial::{Pose, Quat, Vec3};
use std::rc::Rc;

/// The message about points that do not have a convex hull.
const FLAT: &str = "its vertices are in one plane, or too many for a convex hull";

/// Corners of a mesh, three for each triangle, as written; or the reason why there are none.
pub(super) type Corners = Rc<Result<Vec<Vec3>, String>>;

/// Returns the name of an asset that has only a file.
pub(super) fn stem(file: &str) -> &str {
    let name = file.rsplit(['/', '\\']).next().unwrap_or(file);
    name.rsplit_once('.').map_or(name, |(s, _)| s)
}

/// The mesh of a geom.
pub(super) struct MeshOf<'e> {
    name: String,
    asset: &'e Element,
    scale: [f64; 3],
    /// Frame of the file's vertices in the geom, before the scale.
    pose: Pose,
}

impl<'e> Mj<'e> {
    /// Collects meshes by name; the default is the name of the file without its extension.
    pub(super) fn find_meshes(&mut self, asset: &'e Element) {
        for m in asset.all("mesh") {
            let stem = stem(m.attr("file").unwrap_or_default());
            self.meshes.insert(m.attr("name").unwrap_or(stem).to_owned(), m);
        }
    }

    /// Returns the mesh of a geom; `None` after a fault.
    pub(super) fn mesh(&self, cx: &mut Cx<'_>, at: Classed<'e>, what: &str) -> Option<MeshOf<'e>> {
        let (name, place) = self.attr(at, "mesh").or_else(|| {
            cx.missing(at.e, what, "`mesh`", "write the name of a mesh in <asset>");
            None
        })?;
        let Some(&asset) = self.meshes.get(name) else {
            let names = self.meshes.keys().map(String::as_str);
            cx.unknown(place, what, "mesh", name, names);
            return None;
        };
        let own = self.classed(cx, asset, MAIN);
        let scale = self.numbers::<3>(cx, own, "scale", what).unwrap_or([1.0; 3]);
        let p = cx.numbers::<3>(asset, "refpos", what).unwrap_or_default();
        let turn = match cx.numbers::<4>(asset, "refquat", what) {
            Some([w, x, y, z]) => {
                let raw = Quaternion::new(w, x, y, z);
                if !(1e-100..=1e100).contains(&raw.norm()) {
                    let text = asset.attr("refquat").unwrap_or_default();
                    let (expected, help) = ("a nonzero quaternion", "write w x y z");
                    cx.bad(asset.place_of("refquat"), what, text, expected, help);
                    return None;
                }
                Quat::new_normalize(raw)
            }
            None => Quat::identity(),
        };
        let pose = Pose::new(turn, Vec3::from(p)).inverse();
        Some(MeshOf { name: name.to_owned(), asset, scale, pose })
    }

    /// Returns the file for display and collision, with the frame of its vertices in the geom; `None`, and a note, for a mesh without a file.
    pub(super) fn mesh_geometry(
        &self,
        cx: &mut Cx<'_>,
        m: &MeshOf<'e>,
        what: &str,
    ) -> Option<(Pose, Geometry)> {
        let Some(file) = self.mesh_file(m.asset) else {
            let note = "a mesh without a file is not shown and does not collide";
            cx.ignored.push(m.asset.ignored(what, note));
            return None;
        };
        let [x, y, z] = m.scale;
        if m.pose.rotation != Quat::identity() && !(x == y && y == z) {
            let note = "a mesh with `refquat` and different scales along its axes is not shown and does not collide";
            cx.ignored.push(m.asset.ignored(what, note));
            return None;
        }
        let pose = Pose::new(m.pose.rotation, m.pose.position.component_mul(&Vec3::from(m.scale)));
        let path = crate::mesh::find(&file, cx.options);
        Some((pose, Geometry::Mesh { file, path, scale: m.scale }))
    }

    /// Returns the name of the file of a mesh or height field, with the folder of meshes.
    pub(super) fn mesh_file(&self, asset: &Element) -> Option<String> {
        let mut file = asset.attr("file").filter(|f| !f.is_empty())?;
        let settings = self.of(asset);
        if settings.strip_path {
            file = file.rsplit(['/', '\\']).next().unwrap_or(file);
        }
        let mut file = file.to_owned();
        for folder in [&settings.mesh_folder, &settings.folder] {
            let folder = folder.trim_end_matches('/');
            if !(folder.is_empty() || file.starts_with('/') || file.contains("://")) {
                file = format!("{folder}/{file}");
            }
        }
        Some(file)
    }

    /// Returns volume and inertia of a mesh geom, in the frame of the geom; `None`, and a note, if they cannot be computed.
    pub(super) fn mesh_mass(
        &self,
        cx: &mut Cx<'_>,
        m: &MeshOf<'e>,
        e: &Element,
        what: &str,
    ) -> Option<Properties> {
        let own = self.classed(cx, m.asset, MAIN);
        let words = [
            ("legacy", Some(Filling::Legacy)),
            ("exact", Some(Filling::Exact)),
            ("shell", Some(Filling::Shell)),
            ("convex", None),
        ];
        let filling = match self.attr(own, "inertia") {
            Some((text, place)) => word(cx, place, text, "<mesh>: `inertia`", &words)?,
            None => Some(Filling::Legacy),
        };
        let mut note = |why: String| {
            cx.ignored.push(e.ignored(what, format!("this geom adds no mass: {why}")));
            None
        };
        let corners = self.corners(m);
        let corners = match &*corners {
            Ok(corners) => corners,
            Err(why) => return note(format!("its mesh cannot be used: {why}")),
        };
        let scale = Vec3::from(m.scale);
        let moved: Vec<Vec3> =
            corners.iter().map(|p| m.pose.transform_point(p).component_mul(&scale)).collect();
        // `None` means the convex hull.
        let solid = match filling {
            Some(_) => Some(moved.clone()),
            None => hull(&moved),
        };
        let Some(solid) = solid else { return note(FLAT.into()) };
        let filling = filling.unwrap_or(Filling::Exact);
        let mut out = properties(&solid, filling);
        // A mirroring scale turns the surface inside out.
        if out.is_none() && filling == Filling::Exact && m.scale.iter().product::<f64>() < 0.0 {
            let turned: Vec<Vec3> =
                moved.chunks_exact(3).flat_map(|f| [f[0], f[2], f[1]]).collect();
            out = properties(&turned, filling);
        }
        out.or_else(|| {
            note("its mesh does not have a volume, or its triangles point inwards".into())
        })
    }

    fn corners(&self, m: &MeshOf<'e>) -> Corners {
        if let Some(known) = self.corners.borrow().get(&m.name) {
            return known.clone();
        }
        let read = Rc::new(self.read_corners(m.asset));
        self.corners.borrow_mut().insert(m.name.clone(), read.clone());
        read
    }

    fn read_corners(&self, asset: &Element) -> Result<Vec<Vec3>, String> {
        if let Some(file) = self.mesh_file(asset) {
            let path = crate::mesh::find(&file, &self.options);
            return mesh_corners(&path.ok_or(format!("there is no file `{file}`"))?);
        }
        let numbers = |name: &str| -> Result<Vec<f64>, String> {
            let one =
                |w: &str| w.parse::<f64>().map_err(|_| format!("`{name}`: `{w}` is not a number"));
            asset.attr(name).unwrap_or_default().split_whitespace().map(one).collect()
        };
        let (vertices, faces) = (numbers("vertex")?, numbers("face")?);
        if faces.is_empty() {
            let corners = vertices.chunks_exact(3).map(Vec3::from_column_slice);
            return hull(&corners.collect::<Vec<_>>()).ok_or(FLAT.into());
        }
        let corner = |k: &f64| {
            let at = 3 * (*k as usize);
            let three = vertices.get(at..at + 3).filter(|_| *k >= 0.0 && k.fract() == 0.0);
            three
                .map(Vec3::from_column_slice)
                .ok_or(format!("a face refers to the vertex {k}, which does not exist"))
        };
        faces.iter().map(corner).collect()
    }
}
