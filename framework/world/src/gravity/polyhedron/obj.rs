//! Reads vertices and faces from the text of a Wavefront OBJ file: lines `v` and `f`. Other lines only affect appearance and are ignored.

use super::Polyhedron;
use crate::error::WorldError;
use linkwork_spatial::Vec3;

/// Reads a mesh. `file` is the name for messages; `scale` is metres per unit of the file (1000 for the usual shape models in km); `g_rho` is as in
/// [`Polyhedron::new`]. Faces with more than three corners become a fan of triangles.
///
/// # Errors
/// Lines that cannot be read, with their number, and all errors of [`Polyhedron::new`].
pub fn from_obj(file: &str, text: &str, scale: f64, g_rho: f64) -> Result<Polyhedron, WorldError> {
    let Triangles { vertices, corners, .. } = triangles(file, text, scale)?;
    Polyhedron::new(vertices, &corners, g_rho)
}

/// Content of a file, not yet checked as a surface.
pub(super) struct Triangles {
    /// m.
    pub(super) vertices: Vec<Vec3>,
    pub(super) corners: Vec<[u32; 3]>,
    /// Line of the face of each triangle, from 1.
    pub(super) lines: Vec<usize>,
}

/// Returns vertices and triangles of a text; arguments are as in [`from_obj`].
pub(super) fn triangles(file: &str, text: &str, scale: f64) -> Result<Triangles, WorldError> {
    crate::error::number("scale", scale, |x| x > 0.0, "metres for a unit of the file")?;
    let mut vertices: Vec<Vec3> = Vec::new();
    let (mut triangles, mut lines) = (Vec::new(), Vec::new());
    for (k, raw) in crate::error::plain(text).lines().enumerate() {
        let place = || format!("{file}:{}", k + 1);
        let mut words = raw.split('#').next().unwrap_or("").split_whitespace();
        match words.next() {
            Some("v") => {
                let numbers: Vec<f64> = words.filter_map(|w| w.parse().ok()).collect();
                let [x, y, z, ..] = numbers[..] else {
                    let fact = "a vertex without three numbers".to_string();
                    return Err(WorldError::Mesh { place: place(), fact, help: "`v x y z`" });
                };
                vertices.push(Vec3::new(x, y, z) * scale);
            }
            Some("f") => {
                let corners = words
                    .map(|w| corner(w, vertices.len()))
                    .collect::<Result<Vec<u32>, String>>()
                    .and_then(|c| {
                        if c.len() < 3 { Err("fewer than three corners".into()) } else { Ok(c) }
                    })
                    .map_err(|fact| WorldError::Mesh {
                        place: place(),
                        fact,
                        help: "`f 1 2 3`, counted from 1; negative from the end",
                    })?;
                triangles.extend(
                    (1..corners.len() - 1).map(|i| [corners[0], corners[i], corners[i + 1]]),
                );
                lines.resize(triangles.len(), k + 1);
            }
            _ => {}
        }
    }
    Ok(Triangles { vertices, corners: triangles, lines })
}

/// Returns the index, from 0, of the vertex `7`, `7/1/3` or `-1`.
fn corner(word: &str, count: usize) -> Result<u32, String> {
    let text = word.split('/').next().unwrap_or("");
    let k: i64 = text.parse().map_err(|_| format!("`{word}` is not a corner"))?;
    let k = if k < 0 { count as i64 + k } else { k - 1 };
    u32::try_from(k)
        .ok()
        .filter(|k| (*k as usize) < count)
        .ok_or_else(|| format!("`{word}` does not refer to one of the {count} vertices above"))
}
