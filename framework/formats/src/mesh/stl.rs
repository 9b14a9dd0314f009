//! Triangles of an STL file, binary or text: collision geometry. Normals and attributes are not used.
use crate::read::BYTE_ORDER_MARK;
use linkwork_spatial::Vec3;

/// Returns the corners of the triangles, three for each, as written.
///
/// # Errors
/// The fault of the file.
pub(super) fn read(bytes: &[u8]) -> Result<Vec<Vec3>, String> {
    let count = bytes.get(80..84).and_then(|b| b.try_into().ok()).map(u32::from_le_bytes);
    let length = count.map(|n| 84 + 50 * u64::from(n));
    let size = bytes.len() as u64;
    // A binary file contains its number of triangles. The word `solid` at the start does not distinguish a text file,
    // because many programs write it into binary files, too.
    let corners = match length {
        Some(length) if length == size => binary(&bytes[84..]),
        _ if has_facets(bytes) => text(bytes)?,
        Some(length) if length < size => with_attributes(&bytes[84..], (length - 84) as usize / 50),
        Some(length) if size > 84 && !bytes.starts_with(b"solid") => {
            let triangles = (length - 84) / 50;
            return Err(format!(
                "it ends after {} of {triangles} triangles, or it is not an STL file",
                (size - 84) / 50
            ));
        }
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
    // Each triangle has a normal, three corners and two bytes of attributes.
    triangles.chunks_exact(50).flat_map(|t| t[12..48].chunks_exact(12).map(corner)).collect()
}

/// Returns the corners of a file that is longer than its triangles. The two bytes behind a triangle are the number of bytes of its attributes, which
/// follow, if all lengths add up to the file; otherwise the other bytes follow the last triangle, as some programs write them.
fn with_attributes(bytes: &[u8], count: usize) -> Vec<Vec3> {
    let (mut at, mut places) = (0, Vec::new());
    while places.len() < count {
        let Some(&[low, high]) = bytes.get(at + 48..at + 50).and_then(|b| b.first_chunk()) else {
            return binary(&bytes[..50 * count]);
        };
        places.push(at);
        at += 50 + usize::from(u16::from_le_bytes([low, high]));
    }
    match at == bytes.len() {
        true => places.into_iter().flat_map(|at| binary(&bytes[at..at + 50])).collect(),
        false => binary(&bytes[..50 * count]),
    }
}

/// Returns whether a file is a text STL: the word `solid` at the start, and the word `facet` after it.
fn has_facets(bytes: &[u8]) -> bool {
    let start = bytes.strip_prefix(BYTE_ORDER_MARK).unwrap_or(bytes).trim_ascii_start();
    let solid = start.get(..5).is_some_and(|word| word.eq_ignore_ascii_case(b"solid"));
    // The name of a solid is short, so a text file has a facet here; a binary file has triangles.
    let head = &start[..start.len().min(1000)];
    solid && head.windows(5).any(|word| word.eq_ignore_ascii_case(b"facet"))
}

fn text(bytes: &[u8]) -> Result<Vec<Vec3>, String> {
    // The name of the solid may have any encoding.
    let bytes = bytes.strip_prefix(BYTE_ORDER_MARK).unwrap_or(bytes);
    let text = String::from_utf8_lossy(bytes);
    let solid = text.trim_start().get(..5).is_some_and(|w| w.eq_ignore_ascii_case("solid"));
    if !solid {
        return Err("it is neither a binary STL nor a text STL".to_string());
    }
    let mut out = Vec::new();
    for (k, line) in text.lines().enumerate() {
        let mut words = line.split_whitespace();
        if !words.next().is_some_and(|word| word.eq_ignore_ascii_case("vertex")) {
            continue;
        }
        let numbers: Vec<f64> = words.map_while(|w| w.parse().ok()).collect();
        let [x, y, z] = numbers[..] else {
            return Err(format!(
                "line {}: a vertex must have three numbers with a decimal point, separated by blanks",
                k + 1
            ));
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
        assert!(read(&bytes[..100]).is_err_and(|e| e.contains("no triangles")));
    }

    /// Public reports: OldMeshes.jl #56 (names), slic3r #2971 and numpy-stl #154 (capitals), simplnx PR 1696 (attributes and bytes behind triangles).
    #[test]
    fn names_capitals_and_bytes_behind_the_triangles_are_read() {
        let want = read(TEXT.as_bytes());
        assert_eq!(read(TEXT.to_uppercase().as_bytes()), want);
        let mut latin = b"solid Geh\xe4use".to_vec();
        latin.extend(&TEXT.as_bytes()[7..]);
        assert_eq!(read(&latin), want);
        assert_eq!(read(format!("\u{feff}{TEXT}").as_bytes()), want);
        let corner = |x: f32| [x, 0.0, 1.0].map(f32::to_le_bytes).concat();
        let mut bytes = vec![b'x'; 80];
        bytes.extend(1u32.to_le_bytes());
        bytes.extend([corner(9.0), corner(1.0), corner(2.0), corner(3.0)].concat());
        bytes.extend([0, 0]);
        let triangle = [1.0, 2.0, 3.0].map(|x| Vec3::new(x, 0.0, 1.0)).to_vec();
        assert_eq!(read(&bytes), Ok(triangle.clone()));
        bytes.extend(b"made by a scanner");
        assert_eq!(read(&bytes), Ok(triangle.clone()));
        bytes[80] = 7;
        assert!(read(&bytes).is_err_and(|e| e.contains("after 1 of 7 triangles")));
        // The file has two triangles; three bytes of attributes follow the first one.
        let mut bytes = vec![b'x'; 80];
        bytes.extend(2u32.to_le_bytes());
        for count in [3u16, 0] {
            bytes.extend([corner(9.0), corner(1.0), corner(2.0), corner(3.0)].concat());
            bytes.extend(count.to_le_bytes());
            bytes.extend(vec![7; count.into()]);
        }
        assert_eq!(read(&bytes), Ok([triangle.clone(), triangle].concat()));
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
