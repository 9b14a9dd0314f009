//! Where a mesh file is: `package://` and `model://` names, and paths relative to the file; and the corners of what is in it.

use crate::{ReadOptions, stl, whole_file};
use linkwork_spatial::Vec3;
use std::path::{Component, Path, PathBuf};

/// Corners of the surface in a mesh file, as written: of an STL file, three for each triangle; of a Wavefront OBJ file, its vertices.
///
/// # Errors
/// Why it cannot be read, in words.
pub fn mesh_corners(path: &Path) -> Result<Vec<Vec3>, String> {
    let kind = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
    let bytes = whole_file(path)?;
    match kind.as_str() {
        "stl" => stl::read(&bytes),
        "obj" => {
            let text = std::str::from_utf8(&bytes).map_err(|_| "it is no text".to_string())?;
            let vertices = text.lines().enumerate().filter_map(|(k, line)| {
                let numbers: Vec<f64> = line
                    .strip_prefix("v ")?
                    .split_whitespace()
                    .map_while(|w| w.parse().ok())
                    .collect();
                Some(match numbers[..] {
                    [x, y, z, ..] => Ok(Vec3::new(x, y, z)),
                    _ => Err(format!("line {}: a vertex has three numbers", k + 1)),
                })
            });
            let corners: Vec<Vec3> = vertices.collect::<Result<_, _>>()?;
            if corners.is_empty() { Err("it has no vertices".into()) } else { Ok(corners) }
        }
        _ => Err("it is neither an STL nor an OBJ file".into()),
    }
}

/// The file that a mesh name means, if it exists.
///
/// `package://name/rest` is `folder/name/rest` for a folder of the options; else for the folders from the file
/// upwards, either as a package in them or, when their own name is the package's, from there.
pub(crate) fn find(name: &str, options: &ReadOptions) -> Option<PathBuf> {
    let home = options.file.as_deref().and_then(Path::parent);
    let exists = |p: PathBuf| p.is_file().then_some(p);
    if name.contains('\0') {
        return None;
    }
    if let Some(rest) = name.strip_prefix("package://").or(name.strip_prefix("model://")) {
        let rest = Path::new(rest);
        let package = match rest.components().next()? {
            Component::Normal(p) => p,
            _ => return None,
        };
        let inside = rest.strip_prefix(package).ok()?;
        let listed = options.package_paths.iter().find_map(|folder| {
            let own = folder.file_name() == Some(package);
            exists(folder.join(rest)).or_else(|| exists(folder.join(inside)).filter(|_| own))
        });
        let start = home.map(|h| std::path::absolute(h).unwrap_or_else(|_| h.into()));
        return listed.or_else(|| {
            start.as_deref()?.ancestors().find_map(|folder| {
                let own = folder.file_name() == Some(package);
                exists(folder.join(rest)).or_else(|| exists(folder.join(inside)).filter(|_| own))
            })
        });
    }
    let plain = Path::new(name.strip_prefix("file://").unwrap_or(name));
    exists(home.unwrap_or(Path::new("")).join(plain))
}
