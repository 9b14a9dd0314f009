//! A campaign: what each run is made from. A run is a pure function of the campaign's file and the run's number.
use crate::correlation::correlated;
use crate::distribution::{Distribution, deviate};
use crate::form::{Bound, Drawn, Form, Noise, Requirement, Template, in_unit};
use crate::histories::{MOST, Retained};
use crate::one::end;
use crate::sampling::Stream;
use linkwork_assembly::Failure;
use linkwork_assembly::patterns::match_patterns;
use linkwork_runner::{Library, Ready, Shared};
use linkwork_runtime::{Fault, Located, Origin, Seconds, Sources, Value, noise};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Everything that is the same for all runs.
#[derive(Clone, Debug)]
pub struct Campaign {
    form: Form,
    streams: Vec<Stream>,
    /// Variables whose histories are kept.
    retained: Option<Retained>,
    /// Names and units of the figures.
    figures: Vec<(String, String)>,
    /// Names of the phases; none for a simulation without.
    phases: Vec<String>,
    /// Requirements on the figures.
    aims: Vec<Aim>,
    /// Contents that every run must find: texts by name, fingerprints of data files by name.
    contents: Contents,
    /// What of the simulation is allowed and probably not meant, with every distribution at its middle.
    warnings: Vec<Fault>,
    sources: Sources,
    /// Seed of the simulation's file.
    file_seed: u64,
    identity: u64,
    /// What its runs have in common.
    shared: Shared,
}

/// A requirement as it is judged.
#[derive(Clone, Debug, PartialEq)]
pub struct Aim {
    /// What is wrong with a run that misses it.
    pub cause: String,
    /// Place of the figure.
    pub figure: usize,
    /// Least value that is good, in the figure's unit; −∞: no bound.
    pub least: f64,
    /// Greatest value that is good; ∞: no bound.
    pub most: f64,
}

impl Aim {
    /// Whether a run with these figures keeps it; `None` for one without the figure, since what it is of never came.
    pub fn is_kept(&self, figures: &[f64]) -> Option<bool> {
        let y = figures.get(self.figure).copied().filter(|y| !y.is_nan())?;
        Some(self.least <= y && y <= self.most)
    }
}

/// Contents of files, by name: their hashes.
pub(crate) type Contents = BTreeMap<String, u64>;

/// The form of what runs leave in a campaign's folder: what another one left is another campaign.
const FORM: u32 = 2;
/// What `--set` of the run is called among the sources.
const SET: &str = "--set";

/// Hashes of the texts and data files that a simulation was loaded from.
pub(crate) fn contents(ready: &Ready) -> Contents {
    let texts = ready.loaded.sources.files.iter().filter(|(name, _)| name != SET);
    let texts = texts.map(|(name, text)| (name.clone(), noise::hash(text.bytes())));
    texts.chain(ready.files.prints()).collect()
}

/// A template as text, a draw as its place.
fn shape(template: &Template) -> String {
    let join = |all: Vec<String>| all.join(", ");
    match template {
        Template::Constant(v) => v.to_string(),
        Template::Drawn(k) => format!("<{k}>"),
        Template::List(items) => format!("[{}]", join(items.iter().map(shape).collect())),
        Template::Map(entries) => {
            let one = |(k, t): &(String, Template)| format!("{k:?}: {}", shape(t));
            format!("{{{}}}", join(entries.iter().map(one).collect()))
        }
    }
}

impl Campaign {
    /// Reads the file, and loads its simulation with every distribution at its middle, so that a path or figure that
    /// is not there is found before the first run.
    ///
    /// # Errors
    /// Everything that is wrong, at once, in the campaign's file or the simulation's.
    pub fn read(path: &Path, library: &Library) -> Result<Campaign, Failure> {
        Campaign::new(Form::read(path)?, library)
    }

    /// The same of a file that is read already.
    ///
    /// # Errors
    /// Everything that is wrong, at once.
    pub fn new(form: Form, library: &Library) -> Result<Campaign, Failure> {
        let stream =
            |(k, d): (usize, &Drawn)| Stream::new(form.sampling, form.seed, &d.name, k, form.runs);
        let streams = form.drawn.iter().enumerate().map(stream).collect();
        let (figures, nothing) = (Vec::new(), Contents::new());
        let mut campaign = Campaign {
            form,
            streams,
            retained: None,
            figures,
            phases: Vec::new(),
            aims: Vec::new(),
            contents: nothing,
            warnings: Vec::new(),
            sources: Sources::default(),
            file_seed: 0,
            identity: 0,
            shared: Shared::default(),
        };
        let middle = campaign.middle();
        let set = campaign.set(&middle);
        let ready = library
            .file(&campaign.form.simulation, &set, None)
            .map_err(|failure| campaign.in_own_words(failure))?;
        campaign.look_up(&ready)?;
        campaign.contents = contents(&ready);
        campaign.warnings = ready.warnings();
        campaign.sources = ready.loaded.sources.clone();
        campaign.file_seed = ready.plan().seed;
        campaign.watch_choices(library);
        campaign.identity = campaign.identify(ready.plan().hash());
        Ok(campaign)
    }

    /// The simulation once more, with what other runs of it have made.
    fn again(
        &self,
        set: &[String],
        seed: Option<u64>,
        library: &Library,
    ) -> Result<Ready, Failure> {
        library.file_of_many(&self.form.simulation, set, seed, &self.shared)
    }

    /// Files that a choice may name, as they are now. What cannot be loaded is refused when a run draws it.
    fn watch_choices(&mut self, library: &Library) {
        for k in 0..self.form.drawn.len() {
            let Distribution::Choice { of, .. } = &self.form.drawn[k].of else { continue };
            for value in of.iter().filter(|v| matches!(v, Value::Text(_))) {
                let mut drawn = self.middle();
                drawn[k] = value.clone();
                let set = self.set(&drawn);
                if let Ok(ready) = self.again(&set, None, library) {
                    self.contents.extend(contents(&ready));
                }
            }
        }
    }

    /// What of the simulation is allowed and probably not meant, each once, and the texts that this points into.
    pub fn warnings(&self) -> (&[Fault], &Sources) {
        (&self.warnings, &self.sources)
    }

    /// Seed of a run's noise.
    pub fn seed_of(&self, run: u64) -> u64 {
        self.seed(run).unwrap_or(self.file_seed)
    }

    /// Figures, the end, the pairs of the report: what the simulation says of itself.
    fn look_up(&mut self, ready: &Ready) -> Result<(), Failure> {
        let file = &ready.loaded.simulation;
        let prepared = linkwork_runner::prepare(ready.plan(), file).map_err(|faults| {
            let sources = ready.loaded.sources.clone();
            Failure { faults, sources }
        })?;
        self.figures =
            prepared.figures.list.iter().map(|f| (f.name.clone(), f.unit.clone())).collect();
        let phases = ready.program.phases.iter().map(|p| p.name.clone());
        self.phases = phases.filter(|name| !name.is_empty()).collect();
        let mut faults = Vec::new();
        if self.form.until.is_none() && file.until.is_none() {
            let message = match file.stop_when {
                Some(_) => "the simulation ends by `stop_when` alone: a run might never end",
                None => "nothing says when a run ends",
            };
            let help = "write limits: (time: \"100 s\"), the latest simulated end of a run";
            faults.push(Fault::new(Origin::NONE, message).help(help));
        }
        if self.figures.is_empty() {
            let help = "write `figures` into the simulation: { \"miss\": (of: \"Part.output\", take: \"last\") }";
            let message = "the simulation has no figures: a campaign would have no results";
            faults.push(Fault::new(Origin::NONE, message).help(help));
        }
        let figures = self.figures.iter().map(|f| f.0.as_str());
        let numbers = self.form.drawn.iter().filter(|d| d.of.is_number());
        let known: Vec<&str> = figures.chain(numbers.map(|d| d.name.as_str())).collect();
        for (a, b, origin) in &self.form.scatter {
            for name in [a, b].into_iter().filter(|n| !known.contains(&n.as_str())) {
                let message = format!("`scatter`: `{name}` is neither a figure nor a drawn number");
                let help = linkwork_runtime::remedy(name, "figures and drawn numbers", &known);
                faults.push(Fault::new(*origin, message).help(help));
            }
        }
        let aims: Vec<Result<Aim, Fault>> =
            self.form.require.iter().map(|require| self.aim(require)).collect();
        for aim in aims {
            match aim {
                Ok(aim) => self.aims.push(aim),
                Err(fault) => faults.push(fault),
            }
        }
        faults.extend(self.retain(ready).err().unwrap_or_default());
        match faults.is_empty() {
            true => Ok(()),
            false => Err(Failure { faults, sources: self.form.sources.clone() }),
        }
    }

    /// A requirement in the unit of its figure.
    fn aim(&self, r: &Requirement) -> Result<Aim, Fault> {
        let at = |fact: String| Fault::new(r.origin, format!("`require`: `{}`: {fact}", r.cause));
        let Some(figure) = self.figures.iter().position(|(name, _)| *name == r.figure) else {
            let known: Vec<&str> = self.figures.iter().map(|f| f.0.as_str()).collect();
            let help = linkwork_runtime::remedy(&r.figure, "figures", &known);
            return Err(at(format!("there is no figure `{}`", r.figure)).help(help));
        };
        let unit = &self.figures[figure].1;
        let shown = |unit: &str| if unit.is_empty() { "no unit".into() } else { unit.to_string() };
        let bound = |bound: &Option<Bound>, open: f64| match bound {
            None => Ok(open),
            Some(b) if b.unit.is_empty() => Ok(b.number),
            Some(b) => in_unit(b.number, &b.unit, unit, false).ok_or_else(|| {
                let fact = format!("the figure has {}, the bound {}", shown(unit), b.unit);
                at(fact).help("write the bound in a unit of the figure's quantity, or without one")
            }),
        };
        let (least, most) = (bound(&r.least, f64::NEG_INFINITY)?, bound(&r.most, f64::INFINITY)?);
        if !(least <= most) {
            let fact = format!("nothing is from {least} to {most}");
            return Err(at(fact).help("write `least` below `most`"));
        }
        Ok(Aim { cause: r.cause.clone(), figure, least, most })
    }

    /// The variables that every run keeps.
    fn retain(&mut self, ready: &Ready) -> Result<(), Vec<Fault>> {
        let Some(retain) = &self.form.retain else { return Ok(()) };
        let drawn = |(path, t, _): &&(String, Template, Origin)| {
            path == "step" && !matches!(t, Template::Constant(_))
        };
        if let Some((_, _, origin)) = self.form.targets.iter().find(drawn) {
            let message = "`retain`: rows of runs whose `step` is drawn are at different times";
            let help = "leave `step` out of `vary`, or take `retain` out";
            return Err(vec![Fault::new(*origin, message).help(help)]);
        }
        let variables = &ready.plan().variables;
        let names: Vec<&String> = variables.keys().collect();
        let found = match_patterns(&retain.of, &names).map_err(|mut faults| {
            for fault in &mut faults {
                fault.message = format!("`retain`: {}", fault.message);
            }
            faults
        })?;
        let variable = |k: &usize| (names[*k].clone(), variables[names[*k]].unit.to_string());
        let variables: Vec<(String, String)> = found.iter().map(variable).collect();
        let end = end(ready.loaded.simulation.until, self.form.until).0;
        let rows = end.map_or(0.0, |end| {
            (end.seconds() / retain.every.seconds().max(ready.plan().step.seconds())).floor() + 1.0
        });
        let numbers = rows * (variables.len() as f64 + 1.0);
        if numbers > MOST as f64 {
            let message = format!(
                "`retain`: a run may have {rows:.0} rows of {} variables, more than {MOST} numbers",
                variables.len()
            );
            let help = "name fewer variables, or a longer period";
            return Err(vec![Fault::new(retain.origin, message).help(help)]);
        }
        self.retained = Some(Retained { variables, every: retain.every });
        Ok(())
    }

    /// What two campaigns must share so that the runs of one are runs of the other. Limits of wall time, what
    /// the report shows and what is required change no run.
    fn identify(&self, plan: u64) -> u64 {
        let f = &self.form;
        let mut text = format!(
            "{FORM} {} {} {:?} {:?} {:?} {plan:016x} {}",
            f.runs,
            f.seed,
            f.sampling,
            f.noise,
            f.until,
            env!("CARGO_PKG_VERSION")
        );
        for d in &f.drawn {
            // Values as they print: where they are written is no part of them.
            let of = match &d.of {
                Distribution::Choice { of, weights } => {
                    let of: Vec<String> = of.iter().map(Value::to_string).collect();
                    format!("Choice {of:?} {weights:?}")
                }
                other => format!("{other:?}"),
            };
            text.push_str(&format!("\n{} {of} {}", d.name, d.unit));
        }
        for t in &f.together {
            text.push_str(&format!("\n{:?} {:?}", t.of, t.factor));
        }
        for (path, template, _) in &f.targets {
            text.push_str(&format!("\n{path} {}", shape(template)));
        }
        // Runs that kept something else would belong together, their histories would not.
        text.push_str(&format!("\n{:?}", self.retained));
        // By contents alone: names are as the path to the campaign was typed.
        let mut prints: Vec<u64> = self.contents.values().copied().collect();
        prints.sort_unstable();
        prints.iter().for_each(|print| text.push_str(&format!("\n{print:016x}")));
        noise::hash(text.bytes())
    }

    /// Faults at `--set` happen where the campaign's file writes the value.
    fn in_own_words(&self, mut failure: Failure) -> Failure {
        let offset = failure.sources.files.len() as u32;
        for (name, text) in &self.form.sources.files {
            failure.sources.add(name.clone(), text.clone());
        }
        for fault in &mut failure.faults {
            let file = failure.sources.files.get(fault.origin.file as usize);
            let Some((_, text)) = file.filter(|(name, _)| name == SET) else { continue };
            let path = text.split('=').next().unwrap_or_default();
            let written = self.form.targets.iter().find(|t| t.0 == path);
            if let Some((_, _, origin)) = written {
                fault.origin = Origin { file: origin.file + offset, ..*origin };
            }
        }
        failure
    }

    /// The file as read.
    pub fn form(&self) -> &Form {
        &self.form
    }

    /// Names and units of the figures of a run.
    pub fn figures(&self) -> &[(String, String)] {
        &self.figures
    }

    /// Names of the phases of a run; none for a simulation without phases.
    pub fn phases(&self) -> &[String] {
        &self.phases
    }

    /// Requirements on the figures, in the order of the file.
    pub fn aims(&self) -> &[Aim] {
        &self.aims
    }

    /// What every run keeps.
    pub fn retained(&self) -> Option<&Retained> {
        self.retained.as_ref()
    }

    /// A hash of all that decides the runs: the file's values, the plan, the contents of the files.
    pub fn identity(&self) -> u64 {
        self.identity
    }

    /// The latest simulated end of a run.
    pub fn until(&self) -> Option<Seconds> {
        self.form.until
    }

    /// Every distribution at its middle.
    fn middle(&self) -> Vec<Value> {
        self.form.drawn.iter().map(|d| d.of.quantile(0.5)).collect()
    }

    /// The drawn values of a run, in the order of [`Form::drawn`], each in its unit. Cost: linear in their number.
    pub fn draws(&self, run: u64) -> Vec<Value> {
        let mut out: Vec<Value> = self
            .form
            .drawn
            .iter()
            .zip(&self.streams)
            .map(|(d, s)| d.of.quantile(s.at(run)))
            .collect();
        for together in &self.form.together {
            let z: Vec<f64> =
                together.of.iter().map(|k| deviate(self.streams[*k].at(run))).collect();
            for (k, z) in together.of.iter().zip(correlated(&together.factor, &z)) {
                out[*k] = self.form.drawn[*k].of.at_deviate(z);
            }
        }
        out
    }

    /// The seed of the noise of a run; `None`: that of the simulation's file.
    pub fn seed(&self, run: u64) -> Option<u64> {
        match self.form.noise {
            Noise::Own => Some(noise::key(self.form.seed, &format!("noise of run {run}"))),
            Noise::Same => None,
        }
    }

    /// `PATH=VALUE` of a run, as for `linkwork run --set`.
    pub fn overrides(&self, run: u64) -> Vec<String> {
        self.set(&self.draws(run))
    }

    fn set(&self, drawn: &[Value]) -> Vec<String> {
        let one = |(path, template, _): &(String, Template, Origin)| {
            format!("{path}={}", self.value(template, drawn))
        };
        self.form.targets.iter().map(one).collect()
    }

    fn value(&self, template: &Template, drawn: &[Value]) -> Value {
        let located = |t: &Template| Located::from(self.value(t, drawn));
        match template {
            Template::Constant(v) => v.clone(),
            Template::Drawn(k) => match (&drawn[*k], self.form.drawn[*k].unit.as_str()) {
                (Value::Number(x), unit) if !unit.is_empty() => {
                    Value::Text(format!("{x:?} {unit}"))
                }
                (v, _) => v.clone(),
            },
            Template::List(items) => Value::List(items.iter().map(located).collect()),
            Template::Map(entries) => {
                Value::Map(entries.iter().map(|(k, t)| (k.clone(), located(t))).collect())
            }
        }
    }

    /// Loads a run.
    ///
    /// # Errors
    /// What is wrong with the configuration that was drawn, or which file has changed since the campaign began.
    pub fn load(&self, run: u64, library: &Library) -> Result<Ready, LoadError> {
        let ready = self
            .again(&self.overrides(run), self.seed(run), library)
            .map_err(LoadError::Refused)?;
        let changed = contents(&ready)
            .into_iter()
            .find(|(name, print)| self.contents.get(name).is_some_and(|was| was != print));
        match changed {
            Some((name, _)) => Err(LoadError::Changed(name)),
            None => Ok(ready),
        }
    }

    /// Where the simulation's file is.
    pub fn simulation(&self) -> &PathBuf {
        &self.form.simulation
    }
}

/// Why a run has no configuration.
#[derive(Clone, Debug)]
pub enum LoadError {
    /// The values drawn are refused.
    Refused(Failure),
    /// A file is not what it was when the campaign began.
    Changed(String),
}
