//! Triangles of a Wavefront OBJ file: `v` and `f`; faces with more corners are fans. Normals, textures, groups and materials are not used.

use linkwork_spatial::Vec3;
use std::borrow::Cow;

/// Returns the corners of the triangles, three for each; for a file without faces, its vertices.
pub(super) fn read(bytes: &[u8]) -> Result<Vec<Vec3>, String> {
    if bytes.contains(&0) {
        return Err("it is not a text file".to_string());
    }
    // Comments and names of materials may have any encoding.
    let text = String::from_utf8_lossy(bytes);
    let text = text.trim_start_matches('\u{feff}');
    let (mut vertices, mut out) = (Vec::new(), Vec::new());
    for (k, line) in joined(text) {
        let line = line.split('#').next().unwrap_or_default();
        let mut words = line.split_whitespace();
        let wrong = |what: &str| format!("line {}: {what}", k + 1);
        match words.next() {
            Some("v") => {
                let numbers: Vec<f64> = words.map_while(|w| w.parse().ok()).collect();
                let [x, y, z, ..] = numbers[..] else {
                    return Err(wrong(
                        "a vertex must have three numbers with a decimal point, separated by blanks",
                    ));
                };
                vertices.push(Vec3::new(x, y, z));
            }
            Some("f") => {
                let corner = |w: &str| -> Option<Vec3> {
                    let index: i64 = w.split('/').next()?.parse().ok()?;
                    // A negative number counts backwards from the last vertex before this line.
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

/// Returns the lines of a text with their numbers from 0; a backslash at the end of a line joins the next one to it.
fn joined(text: &str) -> Vec<(usize, Cow<'_, str>)> {
    let mut all: Vec<(usize, Cow<str>)> = Vec::new();
    let mut open = false;
    for (k, line) in text.lines().enumerate() {
        let line = line.trim_end();
        let (content, goes_on) = match line.strip_suffix('\\') {
            Some(content) => (content, true),
            None => (line, false),
        };
        match all.last_mut().filter(|_| open) {
            Some((_, last)) => {
                let whole = last.to_mut();
                whole.push(' ');
                whole.push_str(content);
            }
            None => all.push((k, Cow::Borrowed(content))),
        }
        open = goes_on;
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Public reports: trimesh #1103 and assimp #1200 (lines that go on), tinyobjloader PR 394 (a byte order mark), MeshIO.jl #101 (encodings).
    #[test]
    fn notations_of_the_format_are_read() {
        let want = read(b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nf 1 2 3 4").unwrap();
        assert_eq!(want.len(), 6);
        let mut bytes = b"\xef\xbb\xbfv 0 0 0\n# Geh\xe4use\n".to_vec();
        bytes.extend(b"v 1 0 0 0.5 0.5 0.5\nv 0 1 0 1.0\nv 1 1 0\nf 1/1/1 2//2 \\\r\n 3 -1 # cap");
        assert_eq!(read(&bytes), Ok(want));
        assert!(read(b"v 0 0 0\n\nf 1 2 \\\n3").is_err_and(|e| e.starts_with("line 3:")));
        assert!(read(b"v 0 0 0\0").is_err_and(|e| e.contains("not a text file")));
    }
}
