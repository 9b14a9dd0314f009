//! Converts triangles to faces and edges, and checks whether they form a closed surface.

use super::{Edge, Face};
use crate::error::WorldError;
use linkwork_spatial::Vec3;
use std::collections::BTreeMap;

pub(super) fn wrong(place: String, fact: String, help: &'static str) -> WorldError {
    WorldError::Mesh { place, fact, help }
}

/// Returns triangles with their normals; `place` names one of them in messages.
pub(super) fn faces(
    vertices: &[Vec3],
    triangles: &[[u32; 3]],
    place: impl Fn(usize) -> String,
) -> Result<Vec<Face>, WorldError> {
    if let Some(k) = vertices.iter().position(|v| !v.iter().all(|x| x.is_finite())) {
        let fact = "has a NaN or an infinity".to_string();
        return Err(wrong(format!("vertex {k}"), fact, "give finite numbers"));
    }
    let mut out = Vec::with_capacity(triangles.len());
    for (k, corners) in triangles.iter().enumerate() {
        if let Some(i) = corners.iter().find(|i| **i as usize >= vertices.len()) {
            let fact = format!("names vertex {i} of {}", vertices.len());
            return Err(wrong(place(k), fact, "indices count from 0"));
        }
        let [a, b, c] = corners.map(|i| vertices[i as usize]);
        let (ab, ac) = (b - a, c - a);
        let normal = ab.cross(&ac);
        let scale = ab.norm() * ac.norm();
        if !(normal.norm() > 1e-12 * scale) {
            let help = "remove it, or give three corners that are not collinear";
            return Err(wrong(place(k), "has no area".to_string(), help));
        }
        out.push(Face { corners: *corners, normal: normal.normalize() });
    }
    Ok(out)
}

/// Map from a directed edge to its face. It is ordered, so that sums have a defined order.
pub(super) type Sides = BTreeMap<(u32, u32), usize>;

/// Returns the directed edges of faces that all face the same side: each occurs only once.
pub(super) fn sides(faces: &[Face]) -> Result<Sides, WorldError> {
    let mut sides = Sides::new();
    for (k, f) in faces.iter().enumerate() {
        let [a, b, c] = f.corners;
        for (from, to) in [(a, b), (b, c), (c, a)] {
            if let Some(other) = sides.insert((from, to), k) {
                let fact = format!("triangles {other} and {k} both run from {from} to {to}");
                let help = "reverse one of them: neighbours must traverse their edge in opposite directions";
                return Err(wrong(format!("edge {from}-{to}"), fact, help));
            }
        }
    }
    Ok(sides)
}

/// Returns each edge once, from its smaller to its larger vertex.
pub(super) fn edges(vertices: &[Vec3], faces: &[Face]) -> Result<Vec<Edge>, WorldError> {
    let sides = sides(faces)?;
    let mut out = Vec::with_capacity(sides.len() / 2);
    for (&(a, b), &A) in &sides {
        let Some(&B) = sides.get(&(b, a)) else {
            let fact = format!("it belongs to triangle {A} only");
            return Err(wrong(format!("edge {a}-{b}"), fact, "close the surface"));
        };
        if a > b {
            continue;
        }
        let along = vertices[b as usize] - vertices[a as usize];
        let length = along.norm();
        let along = along / length;
        // The vector points out of the face across its edge: it is along × normal, for the direction in which the face
        // traverses the edge.
        let (n_A, n_B) = (faces[A].normal, faces[B].normal);
        let (e_A, e_B) = (along.cross(&n_A), -along.cross(&n_B));
        let E = n_A * e_A.transpose() + n_B * e_B.transpose();
        // The matrix is symmetric up to round-off; make it exactly symmetric.
        out.push(Edge { ends: [a, b], length, E: (E + E.transpose()) * 0.5 });
    }
    Ok(out)
}

/// Returns volume and centroid, as a sum over tetrahedra with one corner at the first vertex.
pub(super) fn volume(vertices: &[Vec3], faces: &[Face]) -> Result<(f64, Vec3), WorldError> {
    let Some(origin) = vertices.first() else {
        let help = "give at least four vertices and four triangles";
        return Err(wrong("the mesh".to_string(), "has no vertices".to_string(), help));
    };
    let (mut volume, mut moment) = (0.0, Vec3::zeros());
    for f in faces {
        let [a, b, c] = f.corners.map(|k| vertices[k as usize] - origin);
        let v = a.dot(&b.cross(&c)) / 6.0;
        volume += v;
        moment += (a + b + c) * (v / 4.0);
    }
    if volume > 0.0 {
        Ok((volume, origin + moment / volume))
    } else {
        let fact = format!("has a volume of {volume} m³");
        let help = "give corners counter-clockwise as seen from outside";
        Err(wrong("the mesh".to_string(), fact, help))
    }
}
