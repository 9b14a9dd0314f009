//! The archive of a unit (a zip file), which is not trusted. Sizes are counted during reading. A name outside of the folder, or a link, rejects the
//! whole archive.
use crate::Refusal;
use linkwork_formats::fmi::{FmiVersion, Interface, ModelDescription, read_model_description};
use std::fs::File;
use std::io::{BufReader, Read, Write};
use std::path::{Path, PathBuf};
use tempfile::TempDir;
use zip::ZipArchive;

/// Largest size of `modelDescription.xml`, bytes.
const DESCRIPTION_MAX: u64 = 64 << 20;
/// Largest total size of the unpacked files, bytes.
const UNPACKED_MAX: u64 = 2 << 30;
/// Largest number of entries of an archive.
const ENTRIES_MAX: usize = 100_000;

/// An open archive.
pub(crate) struct Archive {
    zip: ZipArchive<BufReader<File>>,
    /// The name for messages, as the user gave it.
    name: String,
}

fn corrupt(name: &str, why: impl std::fmt::Display) -> Refusal {
    Refusal::new(format!("`{name}` is not a readable unit archive: {why}"))
        .help("copy or export the .fmu file again")
}

impl Archive {
    /// Opens a file and checks all names in it.
    pub fn open(path: &Path, name: &str) -> Result<Archive, Refusal> {
        let file = File::open(path).map_err(|e| corrupt(name, e))?;
        let zip = ZipArchive::new(BufReader::new(file)).map_err(|e| corrupt(name, e))?;
        if zip.len() > ENTRIES_MAX {
            let why = format!("it has {} entries, but the limit is {ENTRIES_MAX}", zip.len());
            return Err(corrupt(name, why));
        }
        let mut archive = Archive { zip, name: name.to_string() };
        for k in 0..archive.zip.len() {
            let entry = archive.zip.by_index_raw(k).map_err(|e| corrupt(name, e))?;
            let outside = entry.enclosed_name().is_none() || leads_out(entry.name());
            if outside || entry.is_symlink() {
                let why = format!("its entry `{}` leads outside of the archive", entry.name());
                return Err(Refusal::new(format!("`{name}` is rejected: {why}"))
                    .help("do not use this file: it is probably malicious"));
            }
        }
        Ok(archive)
    }

    /// Reads the model description.
    pub fn description(&mut self) -> Result<ModelDescription, Refusal> {
        let name = self.name.clone();
        let mut entry = self.zip.by_name("modelDescription.xml").map_err(|e| match e {
            zip::result::ZipError::FileNotFound => {
                Refusal::new(format!("`{name}` is not an FMI unit: it lacks modelDescription.xml"))
                    .help("give a .fmu file of FMI 2.0 or 3.0")
            }
            other => corrupt(&name, other),
        })?;
        let mut text = Vec::new();
        let read = (&mut entry).take(DESCRIPTION_MAX + 1).read_to_end(&mut text);
        read.map_err(|e| corrupt(&name, e))?;
        if text.len() as u64 > DESCRIPTION_MAX {
            return Err(corrupt(&name, "its model description is larger than 64 MiB"));
        }
        let text = String::from_utf8(text)
            .map_err(|_| corrupt(&name, "its model description is not UTF-8"))?;
        read_model_description(&text, &format!("{name}/modelDescription.xml"))
            .map_err(|e| Refusal::of(&e))
    }

    /// Returns the path of the shared library for this platform inside the archive.
    pub fn library(&self, version: FmiVersion, interface: &Interface) -> Result<String, Refusal> {
        let folder = platform(version);
        let ending = std::env::consts::DLL_SUFFIX;
        let path = format!("binaries/{folder}/{}{ending}", interface.identifier);
        if self.zip.index_for_name(&path).is_some() {
            return Ok(path);
        }
        let mut there: Vec<&str> = self
            .zip
            .file_names()
            .filter_map(|n| n.strip_prefix("binaries/")?.split_once('/'))
            .filter(|(_, file)| !file.is_empty())
            .map(|(platform, _)| platform)
            .collect();
        there.sort_unstable();
        there.dedup();
        let sources = self.zip.file_names().any(|n| n.starts_with("sources/"));
        let has = match (there.is_empty(), sources) {
            (false, _) => format!("it has binaries for {}", there.join(", ")),
            (true, true) => "it contains only sources".into(),
            (true, false) => "it does not contain binaries".into(),
        };
        Err(Refusal::new(format!(
            "`{}` is for another platform: this machine needs `{path}`, {has}",
            self.name
        ))
        .help(format!("export or compile the unit for {folder}")))
    }

    /// Unpacks binaries and resources into a temporary folder, which is removed when the result is dropped.
    pub fn unpack(&mut self) -> Result<TempDir, Refusal> {
        let name = self.name.clone();
        let io = |e: std::io::Error| {
            Refusal::new(format!("`{name}` cannot be unpacked: {e}"))
                .help("check space and permissions of the folder for temporary files (TMPDIR)")
        };
        let folder = tempfile::Builder::new().prefix("linkwork-fmu-").tempdir().map_err(io)?;
        let mut left = UNPACKED_MAX;
        for k in 0..self.zip.len() {
            let mut entry = self.zip.by_index(k).map_err(|e| corrupt(&name, e))?;
            let Some(inside) = entry.enclosed_name() else { continue };
            if !["binaries", "resources"].iter().any(|f| inside.starts_with(f)) {
                continue;
            }
            let target: PathBuf = folder.path().join(inside);
            if entry.is_dir() {
                std::fs::create_dir_all(&target).map_err(io)?;
                continue;
            }
            if let Some(parent) = target.parent() {
                std::fs::create_dir_all(parent).map_err(io)?;
            }
            let mut file = File::create_new(&target).map_err(io)?;
            let copied = copy(&mut entry, &mut file, left).map_err(|e| corrupt(&name, e))?;
            left -= copied;
        }
        Ok(folder)
    }
}

/// Returns whether a name is absolute, leaves the folder, or has a special meaning on another system.
fn leads_out(name: &str) -> bool {
    name.starts_with('/') || name.contains(['\\', ':', '\0']) || name.split('/').any(|p| p == "..")
}

/// Copies at most `limit` bytes; more bytes are an error.
fn copy(from: &mut impl Read, to: &mut impl Write, limit: u64) -> std::io::Result<u64> {
    let copied = std::io::copy(&mut from.take(limit + 1), to)?;
    if copied > limit {
        return Err(std::io::Error::other("it unpacks to more than 2 GiB"));
    }
    Ok(copied)
}

/// Returns the folder of the binaries for this platform.
pub(crate) fn platform(version: FmiVersion) -> String {
    let (arch, os) = (std::env::consts::ARCH, std::env::consts::OS);
    let os = if os == "macos" { "darwin" } else { os };
    match version {
        FmiVersion::V3 => format!("{arch}-{os}"),
        FmiVersion::V2 => match (arch, os) {
            ("x86_64", "windows") => "win64".into(),
            ("x86_64", os) => format!("{os}64"),
            // Names that the standard does not define follow the scheme of 3.0.
            (arch, os) => format!("{arch}-{os}"),
        },
    }
}

/// Writes an archive of named contents, in this order. Equal contents give equal bytes.
///
/// # Errors
/// The file cannot be written; a name occurs twice.
pub fn write_archive(path: &Path, entries: &[(&str, &[u8])]) -> std::io::Result<()> {
    let mut zip = zip::ZipWriter::new(std::io::BufWriter::new(File::create(path)?));
    // Modification times are omitted, so that the bytes depend only on the contents.
    let options = zip::write::SimpleFileOptions::default()
        .last_modified_time(zip::DateTime::default())
        .unix_permissions(0o644);
    for (name, bytes) in entries {
        zip.start_file(*name, options).map_err(std::io::Error::other)?;
        zip.write_all(bytes)?;
    }
    zip.finish().map_err(std::io::Error::other)?.flush()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn refused(make: impl FnOnce(&mut zip::ZipWriter<File>)) -> String {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("bad.fmu");
        let mut zip = zip::ZipWriter::new(File::create(&path).unwrap());
        make(&mut zip);
        zip.finish().unwrap();
        match Archive::open(&path, "bad.fmu").and_then(|mut a| a.unpack()) {
            Ok(_) => panic!("taken"),
            Err(refusal) => refusal.message,
        }
    }

    #[test]
    fn names_that_lead_out_and_links_are_refused() {
        let options = zip::write::SimpleFileOptions::default();
        for name in ["resources/../../evil", "resources/../evil", "/etc/evil", "C:evil", "..\\evil"]
        {
            let told = refused(|zip| {
                zip.start_file("resources/good", options).unwrap();
                zip.start_file(name, options).unwrap();
            });
            assert!(told.contains("leads outside of the archive"), "{told}");
        }
        let told = refused(|zip| zip.add_symlink("resources/link", "/etc", options).unwrap());
        assert!(told.contains("`resources/link` leads outside"), "{told}");
    }

    #[test]
    fn a_small_archive_with_a_huge_description_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("bomb.fmu");
        let zeros = vec![b' '; (DESCRIPTION_MAX + 1) as usize];
        write_archive(&path, &[("modelDescription.xml", &zeros)]).unwrap();
        assert!(std::fs::metadata(&path).unwrap().len() < 1 << 20);
        let refusal = Archive::open(&path, "bomb.fmu").unwrap().description().unwrap_err();
        assert!(refusal.message.contains("larger than 64 MiB"), "{}", refusal.message);
    }

    #[test]
    fn what_is_copied_is_counted() {
        let mut out = Vec::new();
        assert_eq!(copy(&mut &[1u8, 2, 3][..], &mut out, 3).ok(), Some(3));
        assert!(copy(&mut &[1u8, 2, 3][..], &mut Vec::new(), 2).is_err());
    }
}
