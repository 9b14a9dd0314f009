//! A unit: its description and, after loading, its shared library with the unpacked resources.
use crate::Refusal;
use crate::abi::{Fmi2, Fmi3};
use crate::archive::Archive;
use crate::kind::Kind;
use libloading::Library;
use linkwork_formats::fmi::{FmiVersion, Interface, ModelDescription};
use linkwork_runtime::Failure;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use tempfile::TempDir;

/// Functions of the shared library.
pub(crate) enum Functions {
    V2(Box<Fmi2>),
    V3(Box<Fmi3>),
}

/// A loaded unit. The functions must be dropped before the library, and the library before its folder.
pub(crate) struct Unit {
    pub description: ModelDescription,
    pub interface: Interface,
    pub functions: Functions,
    _library: Library,
    folder: TempDir,
    /// Number of live instances.
    living: AtomicUsize,
}

/// Returns the interface of a kind.
pub(crate) fn interface(
    description: &ModelDescription,
    kind: Kind,
    name: &str,
) -> Result<Interface, Refusal> {
    let (wanted, other, what, help) = match kind {
        Kind::CoSimulation => (
            &description.co_simulation,
            &description.model_exchange,
            "co-simulation",
            "write model: \"fmi.model_exchange\" and no rate",
        ),
        Kind::ModelExchange => (
            &description.model_exchange,
            &description.co_simulation,
            "model exchange",
            "write model: \"fmi.co_simulation\" and a rate",
        ),
    };
    match (wanted, other) {
        (Some(found), _) => Ok(found.clone()),
        (None, Some(_)) => {
            Err(Refusal::new(format!("`{name}` is not a unit for {what}")).help(help))
        }
        (None, None) if description.scheduled_execution => Err(Refusal::new(format!(
            "`{name}` supports scheduled execution only, in which the importer activates its clocks"
        ))
        .help("export the unit for co-simulation or model exchange")),
        (None, None) => {
            Err(Refusal::new(format!("`{name}` supports neither co-simulation nor model exchange"))
                .help("export the unit for one of them"))
        }
    }
}

impl Unit {
    /// Unpacks an archive and loads its library.
    pub fn load(path: &Path, name: &str, kind: Kind) -> Result<Arc<Unit>, Refusal> {
        let mut archive = Archive::open(path, name)?;
        let description = archive.description()?;
        let interface = interface(&description, kind, name)?;
        let inside = archive.library(description.version, &interface)?;
        let folder = archive.unpack()?;
        // A unit may require this folder, even if it is empty.
        let resources = folder.path().join("resources");
        std::fs::create_dir_all(resources)
            .map_err(|e| Refusal::new(format!("`{name}` cannot be unpacked: {e}")))?;
        // SAFETY: the user requested the execution of the unit's code by naming the unit. It runs
        // with all rights of this process, as the documentation of the parameter says.
        let library = unsafe { Library::new(folder.path().join(&inside)) }.map_err(|e| {
            let tool = if interface.needs_tool { ": it needs another program" } else { "" };
            Refusal::new(format!("`{inside}` of `{name}` cannot be loaded{tool}: {e}"))
                .help("a library that it needs is missing, or it is for another system")
        })?;
        let functions = match description.version {
            FmiVersion::V2 => Functions::V2(Box::new(Fmi2::of(&library, name)?)),
            FmiVersion::V3 => Functions::V3(Box::new(Fmi3::of(&library, name)?)),
        };
        Ok(Arc::new(Unit {
            description,
            interface,
            functions,
            _library: library,
            folder,
            living: AtomicUsize::new(0),
        }))
    }

    /// Returns the folder of the resources in the form of FMI 3.0: absolute, with a separator at its end.
    pub fn resources_path(&self) -> String {
        let folder = self.folder.path().join("resources");
        format!("{}{}", folder.display(), std::path::MAIN_SEPARATOR)
    }

    /// Returns the resource folder as a URI, the form that FMI 2.0 requires.
    pub fn resources_uri(&self) -> String {
        let path = self.folder.path().join("resources").display().to_string().replace('\\', "/");
        let path = path.trim_start_matches('/');
        let mut uri = String::from("file:///");
        for b in path.bytes() {
            if b.is_ascii_alphanumeric() || b"/-._~:".contains(&b) {
                uri.push(char::from(b));
            } else {
                uri.push_str(&format!("%{b:02X}"));
            }
        }
        uri
    }

    /// Counts another instance, if another one is allowed.
    pub fn claim(&self, name: &str) -> Result<(), Box<Failure>> {
        let before = self.living.fetch_add(1, Ordering::SeqCst);
        if before > 0 && self.interface.only_once {
            self.release();
            return Err(Box::new(Failure {
                message: format!(
                    "a second instance `{name}` of the unit is needed (a fork, or a part in \
                     another phase), but it can be instantiated only once in a process"
                ),
                help: Some("run it without forks, in a separate process".into()),
            }));
        }
        Ok(())
    }

    /// Counts one instance less.
    pub fn release(&self) {
        self.living.fetch_sub(1, Ordering::SeqCst);
    }
}

/// Returns an error if the state of a unit cannot be saved.
pub(crate) fn savable(version: FmiVersion, interface: &Interface) -> Result<(), String> {
    let lacks = match (interface.state, interface.serialize) {
        (true, true) => return Ok(()),
        (true, false) => "canSerializeFMU",
        (false, _) => "canGetAndSetFMU",
    };
    let state = if version == FmiVersion::V2 { "state" } else { "State" };
    Err(format!(
        "the FMI unit `{}` cannot save its state (it lacks `{lacks}{state}`)",
        interface.identifier
    ))
}

/// Returns whether a co-simulation unit is run with event mode.
pub(crate) fn has_events(unit: &Unit) -> bool {
    let d = &unit.description;
    d.version == FmiVersion::V3 && d.co_simulation.as_ref().is_some_and(|i| i.event_mode)
}
