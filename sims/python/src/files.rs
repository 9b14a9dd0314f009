//! Reading mechanisms (RON, URDF, MJCF, SDF) and simulations, with every model of the component
//! libraries.
use crate::package;
use linkwork_assembly::BodyShape;
use linkwork_assembly::machine::read_machine;
use linkwork_collision::Colliders;
use linkwork_formats::{Description, DeviceKind, ReadOptions, Root};
use linkwork_multibody::{Hinge, Multibody};
use linkwork_plant::SpecExt;
use linkwork_runner::Library;
pub use linkwork_runner::Ready;
use linkwork_runtime::Entry;
use linkwork_solvers::ContactSettings;
use std::path::Path;
use std::sync::Arc;

/// Returns all models, and the assemblies that are embedded in the package.
pub fn library() -> Library {
    linkwork_assemblies::library().with(linkwork_fmi::catalogue())
}

/// Returns the library with additional models.
pub fn library_with(more: Vec<Entry>) -> Result<Library, String> {
    let mut library = package::library();
    for entry in more {
        library.catalogue.add(entry).map_err(|name| {
            format!("there is already a model `{name}`\n  help: use another name")
        })?;
    }
    Ok(library)
}

/// The mechanism of a file, and further content of the file.
pub struct Machine {
    /// The bodies.
    pub mbs: Multibody,
    /// The initial configuration of the file.
    pub initial: Vec<f64>,
    /// Further content of a URDF, MJCF or SDF file.
    pub description: Option<Description>,
    /// The `contact` of a RON file.
    pub contact: Option<FileContact>,
    /// The visual shapes of a RON file.
    pub shapes: Vec<BodyShape>,
}

/// The `contact` of a RON file.
#[derive(Clone)]
pub struct FileContact {
    /// Collision shapes and collision rules.
    pub colliders: Arc<Colliders>,
    /// Settings of contact by impulses, including dry friction of hinges; `None` if the contact is compliant.
    pub settings: Option<ContactSettings>,
}

impl FileContact {
    /// Updates the indices of dry friction in β after the root got another hinge.
    fn on_root(&mut self, old: &Multibody, new: &Multibody) {
        let Some(settings) = &mut self.settings else { return };
        settings.dry.retain_mut(|(place, _)| {
            let body = old.bodies().iter().find(|b| b.v().contains(place));
            let there = body.and_then(|b| Some((b, new.get(new.body(b.name())?))));
            let Some((b, n)) = there.filter(|(b, n)| b.v().len() == n.v().len()) else {
                return false;
            };
            *place = n.v().start + *place - b.v().start;
            true
        });
    }
}

impl Machine {
    /// Returns a warning about damping, springs and friction of the file, which the dynamics of a `Mechanism` does not include; `None` if there are
    /// none.
    pub fn left_out(&self) -> Option<String> {
        let lossy = self.mbs.subhinges().filter(|(_, s)| {
            let s = &s.subhinge;
            s.damping > 0.0 || s.friction.force > 0.0 || s.spring.stiffness > 0.0
        });
        let mut bodies: Vec<&str> = lossy.map(|(b, _)| self.mbs.get(b).name()).collect();
        bodies.dedup();
        let list = some_of(&bodies)?;
        Some(format!(
            "damping, springs or friction of the hinges of {list} are not included in the dynamics of a Mechanism\n  help: use linkwork.Simulation"
        ))
    }

    /// Returns a warning about tendons and gravity compensation of the file; `None` if there are none.
    pub fn passive_devices(&self) -> Option<String> {
        let passive = |k: &DeviceKind| {
            matches!(k, DeviceKind::Tendon(_) | DeviceKind::GravityCompensation { .. })
        };
        let all = self.description.iter().flat_map(|d| &d.devices);
        let names: Vec<&str> = all.filter(|x| passive(&x.kind)).map(|x| x.name.as_str()).collect();
        let list = some_of(&names)?;
        Some(format!(
            "tendons and gravity compensation {list} are not included in the dynamics of a Mechanism\n  help: use linkwork.Simulation"
        ))
    }

    /// Returns a warning about inertias that no rigid body can have; `None` if there are none.
    pub fn doubtful(&self) -> Option<String> {
        let lines: Vec<String> =
            self.description.as_ref()?.doubtful.iter().map(ToString::to_string).collect();
        let help = "correct the file, or select a check: inertia_check=\"physical\" rejects it";
        (!lines.is_empty()).then(|| format!("{}\n  help: {help}", lines.join("\n")))
    }

    /// Returns a warning about loops and couplings; `None` if there are none.
    pub fn beyond_the_tree(&self) -> Option<String> {
        let names = self.mbs.constraints().map(|c| self.mbs.constraint_name(c));
        let names: Vec<&str> = names.collect();
        let list = some_of(&names)?;
        Some(format!(
            "loops and couplings {list}: constrained_dynamics, close and simulate satisfy them, the tree algorithms (forward_dynamics, mass_matrix and others) ignore them"
        ))
    }
}

/// Returns the first three names and the number of the others; `None` for no names.
fn some_of(names: &[&str]) -> Option<String> {
    match names {
        [] => None,
        [a, b, c, _, ..] => Some(format!("{a}, {b}, {c} and {} more", names.len() - 3)),
        few => Some(few.join(", ")),
    }
}

/// What happens to the mimic joints and couplings of a URDF, MJCF or SDF file.
#[derive(Clone, Copy, PartialEq)]
pub enum Couplings {
    /// The couplings become constraints of the mechanism.
    Kept,
    /// The couplings are ignored; their coordinates are free.
    LeftOut,
}

/// Reads the mechanism of a file: RON, or a format that `linkwork_formats` reads.
pub fn machine(
    path: &Path,
    options: &ReadOptions,
    couplings: Couplings,
) -> Result<Machine, String> {
    if path.extension().is_some_and(|e| e != "ron") {
        return foreign_machine(path, options, couplings);
    }
    if couplings == Couplings::LeftOut || options.keyframe.is_some() {
        return Err("`couplings` and `keyframe` are for URDF, MJCF and SDF files\n  help: omit them, or write the initial state and the couplings in the RON file".into());
    }
    ron_machine(path, options.root)
}

fn foreign_machine(
    path: &Path,
    options: &ReadOptions,
    couplings: Couplings,
) -> Result<Machine, String> {
    let mut d = read_machine(path, options).map_err(|f| f.to_string())?;
    if couplings == Couplings::LeftOut {
        d.couplings.clear();
    }
    let mut parts = d.builder.clone();
    for l in &d.loops {
        parts.loop_closure(l.clone());
    }
    for c in &d.couplings {
        parts.coupling(c.clone());
    }
    let mbs = parts.build().map_err(|e| e.to_string())?;
    let initial = d.configuration(&mbs);
    Ok(Machine { mbs, initial, description: Some(d), contact: None, shapes: Vec::new() })
}

fn ron_machine(path: &Path, root: Root) -> Result<Machine, String> {
    let loaded = package::library().loaded(path, &[], None).map_err(|f| f.to_string())?;
    let shapes = loaded.shapes;
    let none = || format!("`{}` has no mechanism\n  help: give it bodies", path.display());
    let m = loaded.spec.mechanism().cloned().ok_or_else(none)?;
    // The initial state is the start of a simulation of the file. If it cannot be closed, it is used as written, and
    // `constraint_errors` returns the closure errors.
    let start = m.closed_start().map_or_else(|_| m.q.clone(), |(q, _)| q);
    let compliant = m.compliant.map(|c| FileContact { colliders: c.0, settings: None });
    let contact =
        m.contact.map(|c| FileContact { colliders: c.colliders, settings: Some(c.settings) });
    let mut contact = contact.or(compliant);
    let (mbs, initial) = match root {
        Root::AsWritten => ((*m.multibody).clone(), start),
        other => {
            let mbs = with_root(&m.multibody, other)?;
            let initial = mbs.neutral_q();
            contact.iter_mut().for_each(|c| c.on_root(&m.multibody, &mbs));
            (mbs, initial)
        }
    };
    Ok(Machine { mbs, initial, description: None, contact, shapes })
}

/// Returns the mechanism with another hinge between the world and the only body on it.
fn with_root(mbs: &Multibody, root: Root) -> Result<Multibody, String> {
    let mut parts = linkwork_multibody::Builder::from(mbs);
    let roots: Vec<&str> =
        mbs.bodies().iter().filter(|b| b.parent().is_none()).map(|b| b.name()).collect();
    let [only] = roots[..] else {
        return Err(format!(
            "{} bodies are connected to the world: {}\n  help: `root` requires exactly one; omit it, and define \
             the hinges in the file",
            roots.len(),
            roots.join(", ")
        ));
    };
    for b in parts.bodies_mut().iter_mut().filter(|b| b.name == only) {
        b.hinge = match root {
            Root::Free => Hinge::free(),
            Root::Planar => Hinge::planar(),
            Root::Fixed | Root::AsWritten => Hinge::locked(),
        };
    }
    parts.build().map_err(|e| e.to_string())
}

/// Loads and compiles a simulation with `PATH=VALUE` overrides and additional models, and places its machines on the ground.
pub fn simulation(
    path: &Path,
    set: &[String],
    seed: Option<u64>,
    models: Vec<Entry>,
) -> Result<Ready, String> {
    library_with(models)?.file(path, set, seed).map_err(|f| f.to_string())
}

/// Like [`simulation`], but reads a self-contained text, such as the configuration in a checkpoint.
pub fn simulation_text(name: &str, text: &str, models: Vec<Entry>) -> Result<Ready, String> {
    library_with(models)?.text(name, text).map_err(|f| f.to_string())
}
