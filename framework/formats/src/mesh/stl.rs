//! Triangles of an STL file, binary or text: collision geometry. Normals and attributes are not used.
use linkwork_spatial::Vec3;

/// Returns the corners of the triangles, three for each, as written.
///
/// # Errors
/// The fault of the file.
pub(super) fn read(bytes: &[u8]) -> Result<Vec<Vec3>, String> {
    let count = bytes.get(80..84).and_then(|b| b.try_into().ok()).map(u32::from_le_bytes);
    // A binary file contains its length; `solid` at the start is not reliable.
    let corners = match count {
        Some(n) if bytes.len() as u64 == 84 + 50 * u64::from(n) => binary(&bytes[84..]),
        _ => text(bytes)?,
    };
    if corners.is_empty() {
        return Err("it has no triangles".into());
    }
    Ok(corners)
}

fn binary(triangles: &[u8]) -> Vec<Vec3> {
    let number = |b: &[u8]| b.try_into().map_or(f64::NAN, |b| f64::from(f32::from_le_bytes(b)));
    let corner = |b: &[u8]| Vec3::new(number(&b[..4]), number(&b[4..8]), number(&b[8..12]));
    // Normal, three corners, two bytes of attributes.
    triangles.chunks_exact(50).flat_map(|t| t[12..48].chunks_exact(12).map(corner)).collect()
}

fn text(bytes: &[u8]) -> Result<Vec<Vec3>, String> {
    let wrong = || "it is neither a binary STL nor a text STL".to_string();
    let text = std::str::from_utf8(bytes).map_err(|_| wrong())?;
    if !text.trim_start().starts_with("solid") {
        return Err(wrong());
    }
    let mut out = Vec::new();
    for (k, line) in text.lines().enumerate() {
        let mut words = line.split_whitespace();
        if words.next() != Some("vertex") {
            continue;
        }
        let numbers: Vec<f64> = words.map_while(|w| w.parse().ok()).collect();
        let [x, y, z] = numbers[..] else {
            return Err(format!("line {}: a vertex must have three numbers", k + 1));
        };
        out.push(Vec3::new(x, y, z));
    }
    match out.len() % 3 {
        0 => Ok(out),
        _ => Err(format!("{} vertices are not a multiple of 3", out.len())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "solid s\n facet normal 0 0 1\n outer loop\n vertex 0 0 0.5\n vertex 1 0 0\n \
                        vertex 0 2 0\n endloop\n endfacet\nendsolid";

    #[test]
    fn both_kinds_give_the_same_corners() {
        let told = read(TEXT.as_bytes());
        let want = vec![Vec3::new(0.0, 0.0, 0.5), Vec3::x(), Vec3::new(0.0, 2.0, 0.0)];
        assert_eq!(told, Ok(want.clone()));
        let mut bytes = b"solid but binary".to_vec();
        bytes.resize(80, 0);
        bytes.extend(1u32.to_le_bytes());
        for v in std::iter::once(&Vec3::z()).chain(&want) {
            v.iter().for_each(|x| bytes.extend((*x as f32).to_le_bytes()));
        }
        bytes.extend([0, 0]);
        assert_eq!(read(&bytes), Ok(want));
        assert!(read(&bytes[..100]).is_err_and(|e| e.contains("neither")));
    }

    #[test]
    fn what_is_no_stl_is_told() {
        for (text, why) in [
            ("", "neither"),
            ("solid", "no triangles"),
            ("solid\nvertex 1 2", "line 2: a vertex must have three numbers"),
            ("solid\nvertex 1 2 3", "1 vertices are not a multiple"),
        ] {
            assert!(read(text.as_bytes()).is_err_and(|e| e.contains(why)), "{text}");
        }
    }
}
