//! Mesh files: search, and reading of their triangles (STL, OBJ, COLLADA, glTF, MSH of MuJoCo).

mod dae;
mod gltf;
pub(crate) mod hull;
mod msh;
mod obj;
pub(crate) mod solid;
mod stl;

use crate::{ReadOptions, whole_file};
use linkwork_spatial::Vec3;
use std::path::{Component, Path, PathBuf};

/// File extensions of supported mesh files.
pub const MESH_FILES: [&str; 6] = ["stl", "obj", "dae", "gltf", "glb", "msh"];

/// Reads the corners of the triangles of a mesh file, three for each, in the file's unit of length (COLLADA: m). The extension of its name selects
/// the format. For an OBJ file without faces, returns its vertices.
///
/// # Errors
/// The reason why it cannot be read.
pub fn mesh_corners(path: &Path) -> Result<Vec<Vec3>, String> {
    let kind = ending(path);
    if !MESH_FILES.contains(&kind.as_str()) {
        return Err(format!(
            "`.{kind}` files are not supported; use one of {}",
            MESH_FILES.join(", ")
        ));
    }
    mesh_corners_of(&whole_file(path)?, path)
}

/// Reads the corners of a mesh from bytes; the extension of `path` selects the format.
///
/// # Errors
/// The reason why it cannot be read.
pub fn mesh_corners_of(bytes: &[u8], path: &Path) -> Result<Vec<Vec3>, String> {
    let corners = match ending(path).as_str() {
        "obj" => obj::read(bytes),
        "dae" => dae::read(bytes),
        "gltf" | "glb" => gltf::read(bytes, path),
        "msh" => msh::read(bytes),
        _ => stl::read(bytes),
    }?;
    match corners.iter().flatten().all(|x| x.is_finite()) {
        true => Ok(corners),
        false => Err("a corner is not a finite number".into()),
    }
}

/// Returns the extension of a file's name in lower case.
fn ending(path: &Path) -> String {
    path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase()
}

/// Returns the file of a mesh name, if it exists.
///
/// `package://name/rest` is `folder/name/rest` for a folder of the options; otherwise the folders from the file upwards are searched for the package,
/// and may be the package themselves.
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
