//! Triangles of a Wavefront OBJ file: `v` and `f`; faces with more corners are fans. Normals, textures, groups and materials are not used.

use linkwork_spatial::Vec3;

/// Returns the corners of the triangles, three for each; for a file without faces, its vertices.
pub(super) fn read(bytes: &[u8]) -> Result<Vec<Vec3>, String> {
    let text = std::str::from_utf8(bytes).map_err(|_| "it is not a text file".to_string())?;
    let (mut vertices, mut out) = (Vec::new(), Vec::new());
    for (k, line) in text.lines().enumerate() {
        let mut words = line.split_whitespace();
        let wrong = |what: &str| format!("line {}: {what}", k + 1);
        match words.next() {
            Some("v") => {
                let numbers: Vec<f64> = words.map_while(|w| w.parse().ok()).collect();
                let [x, y, z, ..] = numbers[..] else {
                    return Err(wrong("a vertex must have three numbers"));
                };
                vertices.push(Vec3::new(x, y, z));
            }
            Some("f") => {
                let corner = |w: &str| -> Option<Vec3> {
                    let index: i64 = w.split('/').next()?.parse().ok()?;
                    // Negative numbers count backwards from the vertex before this line.
                    let at = if index < 0 { vertices.len() as i64 + index } else { index - 1 };
                    vertices.get(usize::try_from(at).ok()?).copied()
                };
                let all: Option<Vec<Vec3>> = words.map(corner).collect();
                let Some(all) = all.filter(|all| all.len() >= 3) else {
                    return Err(wrong("a face must refer to at least three existing vertices"));
                };
                out.extend(all[1..].windows(2).flat_map(|w| [all[0], w[0], w[1]]));
            }
            _ => {}
        }
    }
    let out = if out.is_empty() { vertices } else { out };
    if out.is_empty() { Err("it has no vertices".into()) } else { Ok(out) }
}
