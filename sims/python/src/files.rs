//! Reading mechanisms (RON, URDF, MJCF, SDF) and simulations, with every model of the component
//! libraries.
use crate::package;
use linkwork_assembly::BodyShape;
use linkwork_assembly::machine::read_machine;
use linkwork_collision::Colliders;
use linkwork_formats::{Description, DeviceKind, ReadOptions, Root};
use linkwork_multibody::{Hinge, Multibody};
use linkwork_runner::Library;
pub use linkwork_runner::Ready;
use linkwork_runtime::Entry;
use linkwork_solvers::ContactSettings;
use std::path::Path;
use std::sync::Arc;

/// All models, and the assemblies in the program.
pub fn library() -> Library {
    linkwork_assemblies::library().with(linkwork_fmi::catalogue())
}

/// The library with more models.
fn library_with(more: Vec<Entry>) -> Result<Library, String> {
    let mut library = package::library();
    for entry in more {
        library.catalogue.add(entry).map_err(|name| {
            format!("there is a model `{name}` already\n  help: give yours another name")
        })?;
    }
    Ok(library)
}

/// A mechanism as a file has it.
pub struct Machine {
    /// The bodies.
    pub mbs: Multibody,
    /// The configuration that the file shows.
    pub initial: Vec<f64>,
    /// What a URDF, MJCF or SDF file says besides.
    pub description: Option<Description>,
    /// What a file in RON says of contact.
    pub contact: Option<FileContact>,
    /// What a file in RON says is to be seen.
    pub shapes: Vec<BodyShape>,
}

/// What a file in RON says of contact.
#[derive(Clone)]
pub struct FileContact {
    /// Shapes that touch, and who meets whom.
    pub colliders: Arc<Colliders>,
    /// How contact by impulses is solved, dry friction of hinges among it; `None`: contact is compliant.
    pub settings: Option<ContactSettings>,
}

impl FileContact {
    /// After the root got another hinge: dry friction of the others has another place in β.
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
    /// What the file says that the dynamics of a `Mechanism` does not know, in words; `None` when there is nothing.
    pub fn left_out(&self) -> Option<String> {
        let lossy = self.mbs.subhinges().filter(|(_, s)| {
            let s = &s.subhinge;
            s.damping > 0.0 || s.friction.force > 0.0 || s.spring.stiffness > 0.0
        });
        let mut bodies: Vec<&str> = lossy.map(|(b, _)| self.mbs.get(b).name()).collect();
        bodies.dedup();
        let list = some_of(&bodies)?;
        Some(format!(
            "damping, springs or friction of the hinges of {list} are left out of the dynamics of a Mechanism\n  help: linkwork.Simulation simulates them"
        ))
    }

    /// Tendons and balancers of the file, in words; `None` when there are none.
    pub fn passive_devices(&self) -> Option<String> {
        let passive = |k: &DeviceKind| {
            matches!(k, DeviceKind::Tendon(_) | DeviceKind::GravityCompensation { .. })
        };
        let all = self.description.iter().flat_map(|d| &d.devices);
        let names: Vec<&str> = all.filter(|x| passive(&x.kind)).map(|x| x.name.as_str()).collect();
        let list = some_of(&names)?;
        Some(format!(
            "tendons and compensated weights {list} are left out of the dynamics of a Mechanism\n  help: linkwork.Simulation simulates them"
        ))
    }

    /// Mass properties that no body has, in words; `None` when there are none.
    pub fn doubtful(&self) -> Option<String> {
        let lines: Vec<String> =
            self.description.as_ref()?.doubtful.iter().map(ToString::to_string).collect();
        let help = "correct the file, or say what you want: inertia_check=\"physical\" refuses it";
        (!lines.is_empty()).then(|| format!("{}\n  help: {help}", lines.join("\n")))
    }

    /// Loops and couplings, in words; `None` when there are none.
    pub fn beyond_the_tree(&self) -> Option<String> {
        let names = self.mbs.constraints().map(|c| self.mbs.constraint_name(c));
        let names: Vec<&str> = names.collect();
        let list = some_of(&names)?;
        Some(format!(
            "loops and couplings {list}: constrained_dynamics, close and simulate obey them, the algorithms of the tree (forward_dynamics, mass_matrix and the others) do not"
        ))
    }
}

/// Three of the names, and how many there are besides; `None` of none.
fn some_of(names: &[&str]) -> Option<String> {
    match names {
        [] => None,
        [a, b, c, _, ..] => Some(format!("{a}, {b}, {c} and {} more", names.len() - 3)),
        few => Some(few.join(", ")),
    }
}

/// Whether mimic joints and couplings of a file of another program are kept.
#[derive(Clone, Copy, PartialEq)]
pub enum Couplings {
    /// They are constraints of the mechanism.
    Kept,
    /// Their coordinates are free.
    LeftOut,
}

/// The mechanism of a file: RON, or what `linkwork_formats` reads.
pub fn machine(
    path: &Path,
    options: &ReadOptions,
    couplings: Couplings,
) -> Result<Machine, String> {
    if path.extension().is_some_and(|e| e != "ron") {
        return foreign_machine(path, options, couplings);
    }
    if couplings == Couplings::LeftOut || options.keyframe.is_some() {
        return Err("`couplings` and `keyframe` are for URDF, MJCF and SDF files\n  help: leave them out, or write the start and the couplings in the RON file".into());
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
    // The start of a simulation of the file. A start that cannot be closed stays as it is written: `constraint_errors` returns by how much.
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

/// The one body that hangs on the world on another hinge.
fn with_root(mbs: &Multibody, root: Root) -> Result<Multibody, String> {
    let mut parts = linkwork_multibody::Builder::from(mbs);
    let roots: Vec<&str> =
        mbs.bodies().iter().filter(|b| b.parent().is_none()).map(|b| b.name()).collect();
    let [only] = roots[..] else {
        return Err(format!(
            "{} bodies hang on the world: {}\n  help: `root` needs exactly one; leave it out, and say in \
             the file how they hang",
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

/// Loads, compiles and puts down a simulation with `PATH=VALUE` overrides, and models of one's own.
pub fn simulation(
    path: &Path,
    set: &[String],
    seed: Option<u64>,
    models: Vec<Entry>,
) -> Result<Ready, String> {
    library_with(models)?.file(path, set, seed).map_err(|f| f.to_string())
}

/// The same from a text that needs no other file: the configuration in a checkpoint.
pub fn simulation_text(name: &str, text: &str, models: Vec<Entry>) -> Result<Ready, String> {
    library_with(models)?.text(name, text).map_err(|f| f.to_string())
}
