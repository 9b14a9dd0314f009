//! Loading: a file or text is compiled and placed, and all mistakes are reported at once.
use crate::load::unread::{unread, unseen};
use crate::load::{Loaded, Options, load_file, load_text, place_machines};
use crate::text::parsed::Parsed;
use crate::text::patterns::misspelt;
use crate::text::report::tidy;
use crate::text::show::Failure;
use linkwork_runtime::{
    Catalogue, Entry, Fault, Files, Origin, Plan, Program, ServiceCache, Simulation, Sources,
    nearest,
};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The models of a program, and the assemblies embedded in it.
#[derive(Clone, Default)]
pub struct Library {
    /// Models and services.
    pub catalogue: Catalogue,
    /// Embedded assemblies: path → text.
    pub embedded: Arc<BTreeMap<String, String>>,
}

/// Returns the file or folder with the most similar name in the same folder, if there is a similar one.
fn beside(path: &Path) -> Option<PathBuf> {
    if path.exists() {
        return None;
    }
    let folder = path.parent()?;
    let here = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let names =
        std::fs::read_dir(here).ok()?.filter_map(|e| e.ok()?.file_name().into_string().ok());
    let mut names: Vec<String> = names.collect();
    names.sort();
    let near = nearest(path.file_name()?.to_str()?, names.iter().map(String::as_str))?;
    Some(folder.join(near))
}

/// A compiled and placed simulation, with the settings of its file.
pub struct Ready {
    /// The loaded files.
    pub loaded: Loaded,
    /// The compiled program.
    pub program: Program,
    /// The data files that it read.
    pub files: Files,
}

impl Ready {
    /// Returns the plan of the phase in which the run begins; its variables are those of all phases.
    pub fn plan(&self) -> &Plan {
        &self.program.phases[0].plan
    }

    /// Makes a simulation at time zero.
    #[must_use]
    pub fn simulation(self) -> Simulation {
        Simulation::of(Arc::new(self.program))
    }

    /// Returns all warnings of the files, of every phase, and of the start, each once.
    pub fn warnings(&self) -> Vec<Fault> {
        let of_plans = self.program.phases.iter().flat_map(|p| p.plan.warnings.clone());
        let mut told = std::collections::BTreeSet::new();
        let all = self.loaded.warnings().into_iter().chain(of_plans);
        tidy(all.filter(|f| told.insert((f.origin, f.message.clone(), f.help.clone()))).collect())
    }
}

/// Cache for many loads of one simulation: parsed texts, and services (ground, gravity, atmosphere, Sun). An entry is reused only for identical
/// settings and unchanged files, so a load is bit-identical with and without the cache. Clones share the cache, also between threads.
#[derive(Clone, Debug, Default)]
pub struct Shared {
    parsed: Arc<Parsed>,
    made: Arc<ServiceCache>,
}

/// Returns the sim.ron of a folder, or the file itself.
pub fn sim_file(path: &Path) -> PathBuf {
    if path.is_dir() { path.join("sim.ron") } else { path.to_path_buf() }
}

/// Returns the simulations in a folder that has no sim.ron, in the order of their names.
fn simulations(folder: &Path) -> Vec<PathBuf> {
    let begins = |path: &PathBuf| {
        path.extension().is_some_and(|end| end == "ron")
            && std::fs::read_to_string(path).is_ok_and(|text| {
                let mut lines = text.lines().map(str::trim_start);
                let first = lines.find(|line| !line.is_empty() && !line.starts_with("//"));
                first.is_some_and(|line| line.starts_with("Simulation("))
            })
    };
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let mut found: Vec<PathBuf> = entries.map(|entry| entry.path()).filter(begins).collect();
    found.sort();
    found
}

/// Whether the state at the start is checked for warnings.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Start {
    LookedAt,
    Taken,
}

impl Library {
    /// Adds models and services.
    ///
    /// # Panics
    /// When one has the name of another: that is a mistake in the program.
    #[must_use]
    pub fn with(mut self, entries: Vec<Entry>) -> Library {
        for entry in entries {
            let added = self.catalogue.add(entry);
            added.unwrap_or_else(|name| panic!("two models are named `{name}`"));
        }
        self
    }

    /// Returns options with `PATH=VALUE` overrides and a seed that replaces that of the file.
    pub fn options(&self, set: &[String], seed: Option<u64>) -> Options<'_> {
        let mut options = Options::new(&self.catalogue);
        options.embedded = self.embedded.clone();
        options.search = vec![PathBuf::from("assemblies")];
        options.overrides = set.to_vec();
        options.seed = seed;
        options
    }

    /// Checks that a simulation with this name exists, embedded or as a file.
    ///
    /// # Errors
    /// A fault that names the file.
    pub fn find(&self, path: &Path) -> Result<(), Failure> {
        let file = sim_file(path);
        if file.exists() || self.embedded.contains_key(&file.display().to_string()) {
            return Ok(());
        }
        let message = format!("there is no simulation `{}`", file.display());
        let help =
            "give a sim.ron file or the folder that contains it, relative to the current folder";
        let help = match (simulations(path)[..].split_first(), beside(path)) {
            (Some((only, [])), _) => {
                format!("give the simulation in this folder: `{}`", only.display())
            }
            (Some((first, more)), _) => {
                let more: Vec<String> =
                    more.iter().map(|file| format!("`{}`", file.display())).collect();
                format!(
                    "give a simulation in this folder: `{}`, {}",
                    first.display(),
                    more.join(", ")
                )
            }
            (None, Some(near)) => format!("did you mean `{}`? {help}", near.display()),
            (None, None) => help.into(),
        };
        let fault = Fault::new(Origin::NONE, message).help(help);
        Err(Failure { faults: vec![fault], sources: Sources::default() })
    }

    /// Loads a file without compiling it: ground is not generated, and only text files are read.
    ///
    /// # Errors
    /// All mistakes.
    pub fn loaded(
        &self,
        path: &Path,
        set: &[String],
        seed: Option<u64>,
    ) -> Result<Loaded, Failure> {
        load_file(sim_file(path), &self.options(set, seed))
    }

    /// Loads, compiles and places a file.
    ///
    /// # Errors
    /// All mistakes.
    pub fn file(&self, path: &Path, set: &[String], seed: Option<u64>) -> Result<Ready, Failure> {
        self.find(path)?;
        self.ready(self.loaded(path, set, seed)?)
    }

    /// Loads one of many runs. Data that the runs have in common are reused, and the start is not checked for warnings (stiffness, unread parts),
    /// because the first run was checked. The program is the same.
    ///
    /// # Errors
    /// All mistakes.
    pub fn file_of_many(
        &self,
        path: &Path,
        set: &[String],
        seed: Option<u64>,
        shared: &Shared,
    ) -> Result<Ready, Failure> {
        self.find(path)?;
        let mut options = self.options(set, seed);
        options.parsed = Some(shared.parsed.clone());
        let loaded = load_file(sim_file(path), &options)?;
        self.finish(loaded, Start::Taken, Some(shared))
    }

    /// Loads a text that needs no other file: the configuration in a checkpoint.
    ///
    /// # Errors
    /// All mistakes.
    pub fn text(&self, name: &str, text: &str) -> Result<Ready, Failure> {
        self.text_with(name, text, &[])
    }

    /// Like [`Library::text`], with `PATH=VALUE` overrides.
    ///
    /// # Errors
    /// All mistakes.
    pub fn text_with(&self, name: &str, text: &str, set: &[String]) -> Result<Ready, Failure> {
        self.ready(load_text(name, text, &self.options(set, None))?)
    }

    /// Compiles and places what was loaded with this library.
    ///
    /// # Errors
    /// Everything that is wrong, at once.
    pub fn ready(&self, loaded: Loaded) -> Result<Ready, Failure> {
        self.finish(loaded, Start::LookedAt, None)
    }

    fn finish(
        &self,
        loaded: Loaded,
        start: Start,
        shared: Option<&Shared>,
    ) -> Result<Ready, Failure> {
        let mut files = Files::of(vec![PathBuf::from("."), PathBuf::from("assemblies")]);
        if let Some(shared) = shared {
            files = files.sharing(shared.made.clone());
        }
        let faulty =
            |faults: Vec<Fault>| Failure { faults: tidy(faults), sources: loaded.sources.clone() };
        let compiled = loaded.compile(&self.catalogue, &files);
        let mut program = compiled.map_err(|faults| {
            let mut faults = faults.0;
            let patterns = loaded.simulation.patterns();
            faults.extend(misspelt(&patterns, &loaded.spec, &self.catalogue, &files));
            faulty(faults)
        })?;
        if let Some(plan) = Arc::get_mut(&mut program.phases[0].plan) {
            place_machines(plan, &loaded.simulation.place).map_err(|fault| faulty(vec![fault]))?;
        }
        if start == Start::LookedAt {
            let mut sim = Simulation::new(program.phases[0].plan.clone());
            let mut warnings = sim.startup_warnings();
            warnings.extend(sim.stiffness());
            warnings.extend(sim.sampled_loops());
            drop(sim);
            warnings.extend(unread(&loaded, &program));
            warnings.extend(unseen(&loaded, &program));
            if let Some(plan) = Arc::get_mut(&mut program.phases[0].plan) {
                plan.warnings.extend(warnings);
            }
        }
        Ok(Ready { loaded, program, files })
    }
}
