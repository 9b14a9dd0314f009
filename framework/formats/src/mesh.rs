//! Where a mesh file is: `package://` and `model://` names, and paths relative to the file.

use crate::ReadOptions;
use std::path::{Component, Path, PathBuf};

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
