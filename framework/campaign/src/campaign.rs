//! A campaign: the configuration of each run. A run is a pure function of the campaign's file and the run's number.
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

/// The data that all runs share.
#[derive(Clone, Debug)]
pub struct Campaign {
    form: Form,
    streams: Vec<Stream>,
    /// Variables whose histories are kept.
    retained: Option<Retained>,
    /// Names and units of the metrics.
    metrics: Vec<(String, String)>,
    /// Names of the phases; empty for a simulation without phases.
    phases: Vec<String>,
    /// Requirements on the metrics.
    aims: Vec<Aim>,
    /// Contents that every run must find unchanged: texts by name, fingerprints of data files by name.
    contents: Contents,
    /// Warnings of the simulation with the median of every distribution.
    warnings: Vec<Fault>,
    sources: Sources,
    /// Seed of the simulation's file.
    file_seed: u64,
    identity: u64,
    /// Data that its runs share.
    shared: Shared,
}

/// A requirement with resolved references.
#[derive(Clone, Debug, PartialEq)]
pub struct Aim {
    /// Description of the failure of a run that violates it.
    pub cause: String,
    /// Index of the metric.
    pub metric: usize,
    /// Smallest acceptable value, in the metric's unit; −∞: no bound.
    pub least: f64,
    /// Largest acceptable value; ∞: no bound.
    pub most: f64,
}

impl Aim {
    /// Returns whether a run with these metrics satisfies it; `None` if the metric does not have a value.
    pub fn is_kept(&self, metrics: &[f64]) -> Option<bool> {
        let y = metrics.get(self.metric).copied().filter(|y| !y.is_nan())?;
        Some(self.least <= y && y <= self.most)
    }
}

/// Hashes of the contents of files, by name.
pub(crate) type Contents = BTreeMap<String, u64>;

/// Version of the files in a campaign's folder. Folders of another version belong to another campaign.
const FORM: u32 = 2;
/// Name of the source for `--set` values of a run.
const SET: &str = "--set";

/// Returns the hashes of the texts and data files from which a simulation was loaded.
pub(crate) fn contents(ready: &Ready) -> Contents {
    let texts = ready.loaded.sources.files.iter().filter(|(name, _)| name != SET);
    let texts = texts.map(|(name, text)| (name.clone(), noise::hash(text.bytes())));
    texts.chain(ready.files.prints()).collect()
}

/// Returns a template as text, with the index of each drawn value.
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
    /// Reads the file, and loads its simulation with the median of every distribution, so that a wrong path or metric is reported before the first
    /// run.
    ///
    /// # Errors
    /// All mistakes in the campaign's file or the simulation's file.
    pub fn read(path: &Path, library: &Library) -> Result<Campaign, Failure> {
        Campaign::new(Form::read(path)?, library)
    }

    /// Like [`Campaign::read`], for a file that is already parsed.
    ///
    /// # Errors
    /// All mistakes.
    pub fn new(form: Form, library: &Library) -> Result<Campaign, Failure> {
        let stream =
            |(k, d): (usize, &Drawn)| Stream::new(form.sampling, form.seed, &d.name, k, form.runs);
        let streams = form.drawn.iter().enumerate().map(stream).collect();
        let (metrics, nothing) = (Vec::new(), Contents::new());
        let mut campaign = Campaign {
            form,
            streams,
            retained: None,
            metrics,
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
        campaign.identity = campaign.identify(ready.plan().hash(), library);
        Ok(campaign)
    }

    /// Loads the simulation again, with the cache of earlier loads.
    fn again(
        &self,
        set: &[String],
        seed: Option<u64>,
        library: &Library,
    ) -> Result<Ready, Failure> {
        library.file_of_many(&self.form.simulation, set, seed, &self.shared)
    }

    /// Adds the present contents of files that a choice may select. Files that cannot be loaded are rejected when a run draws them.
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

    /// Returns the warnings of the simulation, each once, and the texts to which they refer.
    pub fn warnings(&self) -> (&[Fault], &Sources) {
        (&self.warnings, &self.sources)
    }

    /// Returns the seed of a run's noise.
    pub fn seed_of(&self, run: u64) -> u64 {
        self.seed(run).unwrap_or(self.file_seed)
    }

    /// Reads the metrics, the end time, and the pairs of the report from the simulation.
    fn look_up(&mut self, ready: &Ready) -> Result<(), Failure> {
        let file = &ready.loaded.simulation;
        let prepared = linkwork_runner::prepare(ready.plan(), file).map_err(|faults| {
            let sources = ready.loaded.sources.clone();
            Failure { faults, sources }
        })?;
        self.metrics =
            prepared.metrics.list.iter().map(|f| (f.name.clone(), f.unit.clone())).collect();
        let phases = ready.program.phases.iter().map(|p| p.name.clone());
        self.phases = phases.filter(|name| !name.is_empty()).collect();
        let mut faults = Vec::new();
        if self.form.until.is_none() && file.until.is_none() {
            let message = match file.stop_when {
                Some(_) => {
                    "the simulation has only `stop_when` and no end time, so a run might never end"
                }
                None => "the simulation has neither an end time nor a stop condition",
            };
            let help = "write limits: (time: \"100 s\"), the largest simulated time of a run";
            faults.push(Fault::new(Origin::NONE, message).help(help));
        }
        if self.metrics.is_empty() {
            let help = "write `metrics` into the simulation: { \"miss\": (of: \"Part.output\", take: \"last\") }";
            let message =
                "the simulation does not define metrics, so a campaign would not have results";
            faults.push(Fault::new(Origin::NONE, message).help(help));
        }
        let metrics = self.metrics.iter().map(|f| f.0.as_str());
        let numbers = self.form.drawn.iter().filter(|d| d.of.is_number());
        let known: Vec<&str> = metrics.chain(numbers.map(|d| d.name.as_str())).collect();
        for (a, b, origin) in &self.form.scatter {
            for name in [a, b].into_iter().filter(|n| !known.contains(&n.as_str())) {
                let message =
                    format!("`scatter`: `{name}` is neither a metric nor a sampled parameter");
                let help = linkwork_runtime::remedy(name, "metrics and sampled parameters", &known);
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

    /// Converts a requirement to the unit of its metric.
    fn aim(&self, r: &Requirement) -> Result<Aim, Fault> {
        let at = |fact: String| Fault::new(r.origin, format!("`require`: `{}`: {fact}", r.cause));
        let Some(metric) = self.metrics.iter().position(|(name, _)| *name == r.metric) else {
            let known: Vec<&str> = self.metrics.iter().map(|f| f.0.as_str()).collect();
            let help = linkwork_runtime::remedy(&r.metric, "metrics", &known);
            return Err(at(format!("there is no metric `{}`", r.metric)).help(help));
        };
        let unit = &self.metrics[metric].1;
        let shown = |unit: &str| if unit.is_empty() { "no unit".into() } else { unit.to_string() };
        let bound = |bound: &Option<Bound>, open: f64| match bound {
            None => Ok(open),
            Some(b) if b.unit.is_empty() => Ok(b.number),
            Some(b) => in_unit(b.number, &b.unit, unit, false).ok_or_else(|| {
                let fact = format!(
                    "the unit of the metric is {}, but the unit of the bound is {}",
                    shown(unit),
                    b.unit
                );
                at(fact)
                    .help("write the bound in a unit of the metric's quantity, or without a unit")
            }),
        };
        let (least, most) = (bound(&r.least, f64::NEG_INFINITY)?, bound(&r.most, f64::INFINITY)?);
        if !(least <= most) {
            let fact = format!("the range from {least} to {most} is empty");
            return Err(at(fact).help("write `least` below `most`"));
        }
        Ok(Aim { cause: r.cause.clone(), metric, least, most })
    }

    /// Returns the variables that every run retains.
    fn retain(&mut self, ready: &Ready) -> Result<(), Vec<Fault>> {
        let Some(retain) = &self.form.retain else { return Ok(()) };
        let drawn = |(path, t, _): &&(String, Template, Origin)| {
            path == "step" && !matches!(t, Template::Constant(_))
        };
        if let Some((_, _, origin)) = self.form.targets.iter().find(drawn) {
            let message = "`retain`: `step` is sampled, so the runs have rows at different times";
            let help = "remove `step` from `vary`, or remove `retain`";
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
                "`retain`: a run can have {rows:.0} samples of {} variables, more than {MOST} numbers",
                variables.len()
            );
            let help = "use fewer variables, or a longer period";
            return Err(vec![Fault::new(retain.origin, message).help(help)]);
        }
        self.retained = Some(Retained { variables, every: retain.every });
        Ok(())
    }

    /// Hashes the data that two campaigns must share if the runs of one can be used in the other. Limits of wall time, the content of the report, and
    /// requirements do not affect runs.
    fn identify(&self, plan: u64, library: &Library) -> u64 {
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
            // Values are hashed as they print; their positions in the file are not part of the hash.
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
        // Runs with different retained variables would be equal, but their histories would not.
        text.push_str(&format!("\n{:?}", self.retained));
        // Only the contents are hashed, because names depend on how the path to the campaign was typed.
        let mut prints: Vec<u64> = self.contents.values().copied().collect();
        prints.sort_unstable();
        prints.iter().for_each(|print| text.push_str(&format!("\n{print:016x}")));
        library.catalogue.iter().for_each(|entry| text.push_str(&entry.source()));
        noise::hash(text.bytes())
    }

    /// Moves mistakes in `--set` to the position in the campaign's file where the value is defined.
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

    /// Returns the parsed file.
    pub fn form(&self) -> &Form {
        &self.form
    }

    /// Returns names and units of the metrics of a run.
    pub fn metrics(&self) -> &[(String, String)] {
        &self.metrics
    }

    /// Returns the names of the phases of a run; empty for a simulation without phases.
    pub fn phases(&self) -> &[String] {
        &self.phases
    }

    /// Returns the requirements on the metrics, in the order of the file.
    pub fn aims(&self) -> &[Aim] {
        &self.aims
    }

    /// Returns what every run retains.
    pub fn retained(&self) -> Option<&Retained> {
        self.retained.as_ref()
    }

    /// Returns a hash of everything that determines the runs: the file's values, the plan, the contents of the files.
    pub fn identity(&self) -> u64 {
        self.identity
    }

    /// Returns the largest simulated time of a run.
    pub fn until(&self) -> Option<Seconds> {
        self.form.until
    }

    /// Returns the medians of all distributions.
    fn middle(&self) -> Vec<Value> {
        self.form.drawn.iter().map(|d| d.of.quantile(0.5)).collect()
    }

    /// Returns the drawn values of a run, in the order of [`Form::drawn`], each in its unit. Cost: linear in their number.
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

    /// Returns the seed of the noise of a run; `None`: that of the simulation's file.
    pub fn seed(&self, run: u64) -> Option<u64> {
        match self.form.noise {
            Noise::Own => Some(noise::key(self.form.seed, &format!("noise of run {run}"))),
            Noise::Same => None,
        }
    }

    /// Returns the `PATH=VALUE` texts of a run, as for `linkwork run --set`.
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
    /// The mistakes in the drawn configuration, or the file that has changed since the campaign began.
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

    /// Returns the path of the simulation's file.
    pub fn simulation(&self) -> &PathBuf {
        &self.form.simulation
    }
}

/// A run cannot be loaded.
#[derive(Clone, Debug)]
pub enum LoadError {
    /// The drawn values are not valid.
    Refused(Failure),
    /// A file has changed since the campaign began.
    Changed(String),
}
