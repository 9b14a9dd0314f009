//! Triangles of a MuJoCo `.msh` file: four counts, then vertices, normals, texture coordinates and faces, all numbers of 32 bits.

use linkwork_spatial::Vec3;

/// Returns the corners of the triangles, three for each; for a file without faces, its vertices.
pub(super) fn read(bytes: &[u8]) -> Result<Vec<Vec3>, String> {
    let four = |at: usize| -> Option<[u8; 4]> { bytes.get(at..at + 4)?.try_into().ok() };
    let whole = |at: usize| four(at).map(i32::from_le_bytes);
    let cut = || "the counts at its start do not match its length".to_string();
    let count = |k: usize| -> Result<usize, String> {
        whole(4 * k).and_then(|n| usize::try_from(n).ok()).ok_or_else(cut)
    };
    let (vertices, normals, texture, faces) = (count(0)?, count(1)?, count(2)?, count(3)?);
    let numbers = [3 * vertices, 3 * normals, 2 * texture, 3 * faces];
    if bytes.len() != 16 + 4 * numbers.iter().sum::<usize>() {
        return Err(cut());
    }
    let number = |at: usize| four(at).map_or(f64::NAN, |b| f64::from(f32::from_le_bytes(b)));
    let vertex = |k: usize| Vec3::from_fn(|i, _| number(16 + 4 * (3 * k + i)));
    if faces == 0 {
        return Ok((0..vertices).map(vertex).collect());
    }
    let start = 16 + 4 * (numbers[0] + numbers[1] + numbers[2]);
    let corner = |k: usize| {
        let index = whole(start + 4 * k).and_then(|i| usize::try_from(i).ok());
        let index =
            index.filter(|i| *i < vertices).ok_or("a face refers to a vertex that does not exist");
        Ok(vertex(index?))
    };
    (0..3 * faces).map(corner).collect()
}
