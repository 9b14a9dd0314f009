//! Services that several compilations share: they are built again only if their parameters or files differ.
use crate::author::catalogue::Entry;
use crate::author::files::Files;
use crate::author::made::One;
use crate::author::params::ReadCx;
use crate::author::services::ServiceObject;
use crate::plan::spec::PartSpec;
use std::collections::BTreeMap;

/// The files that a service read when it was built, with fingerprints of their contents; empty if services are not shared.
pub(super) fn read_by(part: &PartSpec, files: &Files) -> BTreeMap<String, u64> {
    let found = files
        .made
        .as_ref()
        .and_then(|made| made.with(|all| all.get(&part.path).map(|one| one.found.clone())));
    found.unwrap_or_default()
}

/// Returns the service of a part: that of an earlier compilation if its parameters, the `world` (parameters and contents of files) and the contents
/// of its own files are unchanged, or else a new one. The files are searched for in both cases, so that they are part of the plan's hash and changes
/// of them are detected.
pub(super) fn service(
    part: &PartSpec,
    entry: &Entry,
    (world, files): (&str, &Files),
    cx: &mut ReadCx<'_>,
) -> Option<ServiceObject> {
    let Some(made) = &files.made else { return entry.make_service(&part.params, files, cx) };
    let asked = format!("{} {} {:?} {world}", part.model, part.params.value, files.folders);
    let was = made.with(|all| all.get(&part.path).filter(|one| one.asked == asked).cloned());
    if let Some(One { found, object, .. }) = was {
        let again = files.apart();
        if found.keys().all(|name| again.resolve(name).is_ok()) && again.prints() == found {
            files.add(found);
            return Some(object);
        }
    }
    let apart = files.apart();
    let object = entry.make_service(&part.params, &apart, cx);
    let found = apart.prints();
    files.add(found.clone());
    if let Some(object) = object.clone() {
        made.with(|all| all.insert(part.path.clone(), One { asked, found, object }));
    }
    object
}
