//! A mesh as flat facets with area, normal and centre, over which surface forces are summed.

use super::mesh::{edges, faces, sides, volume, wrong};
use super::obj::{Triangles, triangles};
use crate::error::WorldError;
use linkwork_spatial::Vec3;

/// A flat triangle; axes and origin of the file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Facet {
    /// Area, m².
    pub area: f64,
    /// Unit vector to the side from which the corners are counter-clockwise: outwards.
    pub normal: Vec3,
    /// Centroid, m.
    pub centre: Vec3,
}

/// Required property of a mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Surface {
    /// The whole surface of a body: each edge belongs to two triangles, and the volume is above zero, so that all normals point outwards.
    Closed,
    /// A part of a surface: neighbours face the same side. Whether this is the outer side is not checked.
    Open,
}

/// Reads facets from a Wavefront OBJ text; `file` and `scale` are as in [`from_obj`](super::from_obj). O(n log n).
///
/// # Errors
/// Lines that cannot be read, a file without faces, triangles with zero area, or neighbours that face opposite sides; for a closed surface also gaps,
/// and a volume that is not above zero (inside out).
pub fn facets_from_obj(
    file: &str,
    text: &str,
    scale: f64,
    surface: Surface,
) -> Result<Vec<Facet>, WorldError> {
    let Triangles { vertices, corners, lines } = triangles(file, text, scale)?;
    if corners.is_empty() {
        let fact = "has no face".to_string();
        return Err(wrong(file.to_string(), fact, "give lines `v x y z` and `f 1 2 3`"));
    }
    let faces = faces(&vertices, &corners, |k| format!("{file}:{}", lines[k]))?;
    // Edges and the whole mesh do not belong to a line of the file.
    let in_file = |e: WorldError| match e {
        WorldError::Mesh { place, fact, help } => {
            WorldError::Mesh { place: format!("{file}: {place}"), fact, help }
        }
        other => other,
    };
    match surface {
        Surface::Open => drop(sides(&faces).map_err(in_file)?),
        Surface::Closed => {
            edges(&vertices, &faces).map_err(in_file)?;
            volume(&vertices, &faces).map_err(in_file)?;
        }
    }
    let facet = |f: &super::Face| {
        let [a, b, c] = f.corners.map(|k| vertices[k as usize]);
        let area = 0.5 * (b - a).cross(&(c - a)).norm();
        Facet { area, normal: f.normal, centre: (a + b + c) / 3.0 }
    };
    Ok(faces.iter().map(facet).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    const TETRAHEDRON: &str =
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";

    /// Σ A n = 0 (Gauss), and ⅓ Σ A n·c is the volume.
    #[test]
    fn facets_of_a_closed_mesh_enclose_its_volume() {
        let all = facets_from_obj("t.obj", TETRAHEDRON, 2.0, Surface::Closed).unwrap();
        let sum: Vec3 = all.iter().map(|f| f.normal * f.area).sum();
        assert!(all.len() == 4 && sum.norm() < 1e-15, "{sum}");
        let volume: f64 = all.iter().map(|f| f.area * f.normal.dot(&f.centre) / 3.0).sum();
        assert!((volume - 8.0 / 6.0).abs() < 1e-15, "{volume}");
        assert!((all[3].area - 2.0 * 3f64.sqrt()).abs() < 1e-15);
        assert!((all[3].centre - Vec3::repeat(2.0 / 3.0)).norm() < 1e-15);
    }

    #[test]
    fn what_is_no_surface_says_where() {
        let told = |text: &str, surface| {
            facets_from_obj("t.obj", text, 1.0, surface).unwrap_err().to_string()
        };
        let open = TETRAHEDRON.replace("f 2 3 4\n", "");
        assert!(facets_from_obj("t.obj", &open, 1.0, Surface::Open).is_ok_and(|f| f.len() == 3));
        assert!(told(&open, Surface::Closed).starts_with("t.obj: edge "));
        let turned = TETRAHEDRON.replace("f 2 3 4", "f 2 4 3");
        for surface in [Surface::Open, Surface::Closed] {
            assert!(told(&turned, surface).contains("opposite directions"));
            assert!(told("", surface).starts_with("t.obj: has no face"));
            let flat = TETRAHEDRON.replace("f 2 3 4", "f 2 2 4");
            assert!(told(&flat, surface).starts_with("t.obj:8: has no area"));
        }
        let inside_out = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 4 2\nf 1 3 4\nf 2 4 3\n";
        assert!(told(inside_out, Surface::Closed).contains("counter-clockwise"));
    }
}
