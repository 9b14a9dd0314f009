//! Reading mechanisms (RON, URDF, MJCF, SDF) and simulations, with every model of the component
//! libraries.
use linkwork_assembly::{
    Failure, Loaded, Options, load_file, load_text, put_down, read_machine, tidy,
};
use linkwork_formats::{Description, ReadOptions, Root};
use linkwork_multibody::{Hinge, Multibody};
use linkwork_runtime::{Catalogue, Fault, Files, Plan, Sources, compile};
use std::path::{Path, PathBuf};

/// Every model and service of the component libraries.
pub fn catalogue() -> Catalogue {
    Catalogue::new(linkwork_assemblies::libraries())
}

fn options(catalogue: &Catalogue) -> Options<'_> {
    let mut options = Options::new(catalogue);
    options.embedded = linkwork_assemblies::embedded();
    options.search = vec![PathBuf::from("assemblies")];
    options
}

/// A mechanism as a file has it.
pub struct Machine {
    /// The bodies.
    pub mbs: Multibody,
    /// The configuration that the file shows.
    pub initial: Vec<f64>,
    /// What a URDF, MJCF or SDF file says besides.
    pub description: Option<Description>,
}

/// The mechanism of a file: RON, or what `linkwork_formats` reads.
pub fn machine(path: &Path, options: &ReadOptions) -> Result<Machine, String> {
    let ron = path.extension().is_none_or(|e| e == "ron");
    if ron { ron_machine(path, options.root) } else { foreign_machine(path, options) }
}

fn foreign_machine(path: &Path, options: &ReadOptions) -> Result<Machine, String> {
    let d = read_machine(path, options).map_err(|f| f.to_string())?;
    let mbs = d.builder.build().map_err(|e| e.to_string())?;
    let mut initial = mbs.neutral_q();
    for i in &d.initial {
        if let Some(place) = mbs.body(&i.body).and_then(|b| initial.get_mut(mbs.get(b).q()))
            && place.len() == i.q.len()
        {
            place.copy_from_slice(&i.q);
        }
    }
    Ok(Machine { mbs, initial, description: Some(d) })
}

fn ron_machine(path: &Path, root: Root) -> Result<Machine, String> {
    let catalogue = catalogue();
    let loaded = read(path, &options(&catalogue))?;
    let none = || format!("`{}` has no mechanism\n  help: give it bodies", path.display());
    let m = loaded.spec.mechanism().cloned().ok_or_else(none)?;
    let (mbs, initial) = match root {
        Root::AsWritten => ((*m.multibody).clone(), m.q),
        other => {
            let mbs = with_root(&m.multibody, other)?;
            let initial = mbs.neutral_q();
            (mbs, initial)
        }
    };
    Ok(Machine { mbs, initial, description: None })
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

fn read(path: &Path, options: &Options<'_>) -> Result<Loaded, String> {
    let file = if path.is_dir() { path.join("sim.ron") } else { path.to_path_buf() };
    load_file(file, options).map_err(|f| f.to_string())
}

/// A simulation, compiled and put down.
pub struct Ready {
    /// As loaded.
    pub loaded: Loaded,
    /// As compiled.
    pub plan: Plan,
}

/// Loads and compiles a simulation with `PATH=VALUE` overrides.
pub fn simulation(path: &Path, set: &[String], seed: Option<u64>) -> Result<Ready, String> {
    let catalogue = catalogue();
    let mut options = options(&catalogue);
    options.overrides = set.to_vec();
    options.seed = seed;
    finish(read(path, &options)?, &catalogue)
}

/// The same from a text that needs no other file: the configuration in a checkpoint.
pub fn simulation_text(name: &str, text: &str) -> Result<Ready, String> {
    let catalogue = catalogue();
    let loaded = load_text(name, text, &options(&catalogue)).map_err(|f| f.to_string())?;
    finish(loaded, &catalogue)
}

fn finish(loaded: Loaded, catalogue: &Catalogue) -> Result<Ready, String> {
    let files = Files { folders: vec![PathBuf::from("."), PathBuf::from("assemblies")] };
    let faulty = |faults: Vec<Fault>, sources: &Sources| {
        Failure { faults: tidy(faults), sources: sources.clone() }.to_string()
    };
    let mut plan = compile(&loaded.spec, catalogue, &files)
        .map_err(|faults| faulty(faults.0, &loaded.sources))?;
    if let Some(place) = &loaded.simulation.place {
        put_down(&mut plan, place).map_err(|fault| faulty(vec![fault], &loaded.sources))?;
    }
    Ok(Ready { loaded, plan })
}
