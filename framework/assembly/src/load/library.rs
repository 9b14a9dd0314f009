//! Libraries, and simulations that are ready to run: loaded, compiled and placed, with all mistakes at once.
use crate::load::unread::unread;
use crate::load::{Loaded, Options, load_file, load_text, put_down};
use crate::text::parsed::Parsed;
use crate::text::patterns::misspelt;
use crate::text::report::tidy;
use crate::text::show::Failure;
use linkwork_runtime::{
    Catalogue, Entry, Fault, Files, Made, Origin, Plan, Program, Simulation, Sources, nearest,
};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// What a program brings along: its models, and the assemblies inside it.
#[derive(Clone, Default)]
pub struct Library {
    /// Models and services.
    pub catalogue: Catalogue,
    /// Assemblies in the program: path → text.
    pub embedded: Arc<BTreeMap<String, String>>,
}

/// The file or folder beside a path whose name is nearest to it, when one is near.
fn beside(path: &Path) -> Option<PathBuf> {
    let folder = path.parent()?;
    let here = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let names =
        std::fs::read_dir(here).ok()?.filter_map(|e| e.ok()?.file_name().into_string().ok());
    let mut names: Vec<String> = names.collect();
    names.sort();
    let near = nearest(path.file_name()?.to_str()?, names.iter().map(String::as_str))?;
    Some(folder.join(near))
}

/// A simulation, compiled and placed, with what else its file says.
pub struct Ready {
    /// As loaded.
    pub loaded: Loaded,
    /// As compiled.
    pub program: Program,
    /// The files that it read besides its texts.
    pub files: Files,
}

impl Ready {
    /// The plan of the phase in which the run begins; its variables are those of all phases.
    pub fn plan(&self) -> &Plan {
        &self.program.phases[0].plan
    }

    /// Makes a simulation at time zero.
    #[must_use]
    pub fn simulation(self) -> Simulation {
        Simulation::of(Arc::new(self.program))
    }

    /// What is allowed and probably not meant, each once: of the files, of every phase, and of the start.
    pub fn warnings(&self) -> Vec<Fault> {
        let of_plans = self.program.phases.iter().flat_map(|p| p.plan.warnings.clone());
        let mut told = std::collections::BTreeSet::new();
        let all = self.loaded.warnings().into_iter().chain(of_plans);
        tidy(all.filter(|f| told.insert((f.origin, f.message.clone(), f.help.clone()))).collect())
    }
}

/// What many loads of one simulation have in common: texts as parsed, and services (ground, gravity, air, Sun) as
/// made. Only what is asked for in the same words, and whose files hold what they held, is taken again, so that a
/// load gives the same bits with it and without it. Clones share; threads may.
#[derive(Clone, Debug, Default)]
pub struct Shared {
    parsed: Arc<Parsed>,
    made: Arc<Made>,
}

/// The sim.ron of a folder, or the file itself.
pub fn sim_file(path: &Path) -> PathBuf {
    if path.is_dir() { path.join("sim.ron") } else { path.to_path_buf() }
}

/// Whether remarks about the state at the start are wanted.
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

    /// Options with `PATH=VALUE` overrides and a seed in place of the file's.
    pub fn options(&self, set: &[String], seed: Option<u64>) -> Options<'_> {
        let mut options = Options::new(&self.catalogue);
        options.embedded = self.embedded.clone();
        options.search = vec![PathBuf::from("assemblies")];
        options.overrides = set.to_vec();
        options.seed = seed;
        options
    }

    /// That there is a simulation of this name, in the program or as a file.
    ///
    /// # Errors
    /// A fault that names the file.
    pub fn find(&self, path: &Path) -> Result<(), Failure> {
        let file = sim_file(path);
        if file.exists() || self.embedded.contains_key(&file.display().to_string()) {
            return Ok(());
        }
        let message = format!("there is no simulation `{}`", file.display());
        let help = "name a sim.ron file or the folder that holds it, from the folder you are in";
        let help = match beside(path) {
            Some(near) => format!("did you mean `{}`? {help}", near.display()),
            None => help.into(),
        };
        let fault = Fault::new(Origin::NONE, message).help(help);
        Err(Failure { faults: vec![fault], sources: Sources::default() })
    }

    /// Loads a file without compiling it: no ground is made, no file but the texts is read.
    ///
    /// # Errors
    /// Everything that is wrong, at once.
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
    /// Everything that is wrong, at once.
    pub fn file(&self, path: &Path, set: &[String], seed: Option<u64>) -> Result<Ready, Failure> {
        self.find(path)?;
        self.ready(self.loaded(path, set, seed)?)
    }

    /// One of many runs: what it has in common with the others is taken from them, and there is no look at the start
    /// for remarks (stiffness, parts that nobody reads), since the first has been looked at. The program is the same.
    ///
    /// # Errors
    /// Everything that is wrong, at once.
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

    /// The same from a text that needs no other file: the configuration in a checkpoint.
    ///
    /// # Errors
    /// Everything that is wrong, at once.
    pub fn text(&self, name: &str, text: &str) -> Result<Ready, Failure> {
        self.text_with(name, text, &[])
    }

    /// The same with `PATH=VALUE` overrides.
    ///
    /// # Errors
    /// Everything that is wrong, at once.
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
            put_down(plan, &loaded.simulation.place).map_err(|fault| faulty(vec![fault]))?;
        }
        if start == Start::LookedAt {
            let mut sim = Simulation::new(program.phases[0].plan.clone());
            let mut warnings = sim.startup_warnings();
            warnings.extend(sim.stiffness());
            warnings.extend(sim.sampled_loops());
            drop(sim);
            warnings.extend(unread(&loaded, &program));
            if let Some(plan) = Arc::get_mut(&mut program.phases[0].plan) {
                plan.warnings.extend(warnings);
            }
        }
        Ok(Ready { loaded, program, files })
    }
}
