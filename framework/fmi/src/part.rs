//! Common code of both kinds of parts: the loaded unit with its start values, an instance that is created on demand, and its state as bytes.
//!
//! The unit's own state is in the instance. A copy of a run (fork, snapshot, checkpoint) contains the instance's state as bytes; the copy creates its
//! own instance and restores the bytes. A part whose instance failed stays failed until a state is restored.
use crate::clocks::{Clocks, Ticks, earlier, is_served, possible};
use crate::instance::{Instance, Result};
use crate::kind::Kind;
use crate::ports::{Ports, ports, without_port};
use crate::slot::Slot;
use crate::start::{Start, UnitParams, apply, find};
use crate::unit::{Unit, savable};
use crate::{Refusal, archive::Archive};
use linkwork_formats::fmi::{Causality, FmiVariable, ModelDescription, VariableKind};
use linkwork_runtime::{Description, Failure, Files, Located, Origin, ReadCx, Value};
use serde::{Deserialize, Serialize};
use std::any::Any;
use std::sync::Arc;

/// A unit that is a part: its constant data.
pub(crate) struct Part {
    pub unit: Arc<Unit>,
    pub kind: Kind,
    /// Path of the part, which is the instance's name.
    pub path: String,
    pub starts: Vec<Start>,
    pub ports: Ports,
    pub clocks: Clocks,
    pub description: Description,
    pub params: Value,
}

/// Reads the description without loading the library.
pub(crate) fn describe(
    p: &UnitParams,
    files: &Files,
    kind: Kind,
    model: (&'static str, &'static str),
) -> std::result::Result<Description, Refusal> {
    let path = files.find(&p.file).map_err(Refusal::from)?;
    let description = Archive::open(&path, &p.file)?.description()?;
    crate::unit::interface(&description, kind, &p.file)?;
    let starts = p.start.permitted(&description);
    Ok(ports(&description, &starts, kind, model)?.0)
}

impl Part {
    /// Loads the unit and resolves its ports and start values; faults are added to `cx`.
    pub fn make(
        p: &UnitParams,
        written: &Located,
        cx: &mut ReadCx<'_>,
        kind: Kind,
        model: (&'static str, &'static str),
    ) -> Option<Arc<Part>> {
        let at = written.get("file").unwrap_or(written).origin;
        let loaded = cx.files.resolve(&p.file).map_err(Refusal::from).and_then(|path| {
            let unit = Unit::load(&path, &p.file, kind)?;
            let starts = p.start.permitted(&unit.description);
            let (description, ports) = ports(&unit.description, &starts, kind, model)?;
            Ok((unit, description, ports))
        });
        let (unit, description, ports) = match loaded {
            Ok(loaded) => loaded,
            Err(refusal) => {
                refusal.tell(at, cx);
                return None;
            }
        };
        let starts = find(&p.start, &unit.description, cx)?;
        warn_of_variables_without_port(p, (&unit.description, kind), at, cx);
        let clocks = Clocks::of(&unit.description, kind);
        let params = linkwork_runtime::Params::show_map(p);
        let path = cx.path.clone();
        Some(Arc::new(Part { unit, kind, path, starts, ports, clocks, description, params }))
    }

    /// Returns whether its state can be saved.
    pub fn can_save(&self) -> std::result::Result<(), String> {
        savable(self.unit.description.version, &self.unit.interface)
    }

    /// Returns an initialized instance at time `t` (s), in continuous-time mode or in step mode, the time of its first event (model exchange), and
    /// its clocks. Clocks that tick at the start do so at once in co-simulation; in model exchange the tick is an event of the run, with the inputs.
    pub fn begin(&self, t: f64) -> Result<(Instance, Option<f64>, Ticks)> {
        let mut instance = Instance::new(&self.unit, self.kind, &self.path)?;
        apply(&mut instance, &self.starts)?;
        instance.initialize(t, self.unit.description.tolerance)?;
        let mut ticks = self.clocks.start();
        let next = match self.kind {
            Kind::CoSimulation if instance.steps_with_events() => {
                self.clocks.activate(&mut instance, &mut ticks, (t, t))?;
                self.clocks.settle(&mut instance, &mut ticks, t)?;
                instance.enter_step()?;
                None
            }
            Kind::CoSimulation => None,
            Kind::ModelExchange => {
                let next = self.clocks.settle(&mut instance, &mut ticks, t)?;
                instance.enter_continuous()?;
                earlier(next, self.clocks.next(&ticks, t))
            }
        };
        Ok((instance, next, ticks))
    }

    /// Returns the number of values of all outputs from state, the counts of the clocks last.
    pub fn output_lanes(&self) -> usize {
        self.ports.outputs[0].iter().map(|s| s.size).sum::<usize>() + self.clocks.outputs()
    }
}

/// Largest number of variables that a warning names.
const NAMED_MAX: usize = 10;

/// Returns the first variables of a list in words, and the number of the others.
fn first_of(list: &[&FmiVariable], word: impl Fn(&&FmiVariable) -> String) -> String {
    let mut names: Vec<String> = list.iter().take(NAMED_MAX).map(word).collect();
    if list.len() > NAMED_MAX {
        names.push(format!("and {} more", list.len() - NAMED_MAX));
    }
    names.join(", ")
}

/// Warns of inputs and outputs that have no port, except inputs whose value is in `start`.
fn warn_of_variables_without_port(
    p: &UnitParams,
    (d, kind): (&ModelDescription, Kind),
    at: Origin,
    cx: &mut ReadCx<'_>,
) {
    let ticks = possible(d, kind);
    let (clocks, left): (Vec<_>, Vec<_>) = without_port(d)
        .filter(|v| !(p.start.sets(&v.name) || ticks && is_served(v)))
        .partition(|v| v.kind == VariableKind::Clock);
    if !clocks.is_empty() {
        let clock = |v: &&FmiVariable| match v.causality {
            Causality::Input => format!("input clock `{}`, which never ticks", v.name),
            _ => format!("output clock `{}`, which has no port", v.name),
        };
        let fact = format!(
            "`{}`: clocks of `{}` are not supported: {}",
            cx.path,
            p.file,
            first_of(&clocks, clock)
        );
        let help = match ticks {
            true => {
                "equations of these input clocks never run; export the unit with periodic clocks, countdown clocks or time events"
            }
            false => {
                "clocks of co-simulation need event mode, which the unit does not have: equations of input clocks never run; export the unit with event mode or with time events, or use `fmi.model_exchange`"
            }
        };
        cx.warn(at, fact, Some(help.into()));
    }
    if left.is_empty() {
        return;
    }
    let word = |v: &&FmiVariable| {
        let side = if v.causality == Causality::Input { "input" } else { "output" };
        format!("{side} `{}` ({:?})", v.name, v.kind)
    };
    let fact = format!(
        "`{}`: ports transfer numbers and booleans only, so these variables of `{}` have no port: {}",
        cx.path,
        p.file,
        first_of(&left, word)
    );
    let help = "the inputs keep their start values (`start` can set a String); \
                export the unit with numbers if the simulation needs the variables";
    cx.warn(at, fact, Some(help.into()));
}

/// Reads variables one after another.
pub(crate) fn get_all(instance: &mut Instance, slots: &[Slot], mut out: &mut [f64]) -> Result<()> {
    for slot in slots {
        let (own, rest) = out.split_at_mut(slot.size);
        instance.get(slot, own)?;
        out = rest;
    }
    Ok(())
}

/// Reads the outputs from state, and the counts of the output clocks.
pub(crate) fn outputs(
    instance: &mut Instance,
    part: &Part,
    ticks: &Ticks,
    out: &mut [f64],
) -> Result<()> {
    let (own, counts) = out.split_at_mut(out.len() - ticks.counts.len());
    get_all(instance, &part.ports.outputs[0], own)?;
    counts.copy_from_slice(&ticks.counts);
    Ok(())
}

/// The changing data of a part.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Saved {
    /// Start time of the instance, if there is one (s).
    pub began: Option<f64>,
    /// Outputs of the last communication step (co-simulation).
    pub outputs: Vec<f64>,
    /// Model exchange: time of the next event (s).
    pub next_event: Option<f64>,
    /// The unit requested an event that is not handled yet.
    pub asks: bool,
    /// Time of the last completed step that was reported to the unit (s).
    pub completed: Option<f64>,
    /// Inputs at the unit's last event.
    pub held: Vec<f64>,
    /// The clocks.
    #[serde(default)]
    pub ticks: Ticks,
    /// The unit's own state.
    pub state: Vec<u8>,
}

/// A part's instance with its data.
pub(crate) struct Live {
    pub part: Arc<Part>,
    instance: Option<Instance>,
    failed: Option<Box<Failure>>,
    /// A state that is restored when the instance is created.
    waiting: Option<Vec<u8>>,
    /// The data except the unit's own state.
    pub now: Saved,
}

/// The data of a part in a copy of a run.
type Copy = std::result::Result<Saved, Box<Failure>>;

impl Live {
    pub fn new(part: Arc<Part>) -> Live {
        Live { part, instance: None, failed: None, waiting: None, now: Saved::default() }
    }

    /// Calls `f` with the instance, which is created at time `t` if there is none. After the first failure it always returns that failure.
    pub fn with<T>(
        &mut self,
        t: f64,
        f: impl FnOnce(&mut Instance, &mut Saved, &Part) -> Result<T>,
    ) -> Result<T> {
        if let Some(failure) = &self.failed {
            return Err(failure.clone());
        }
        let part = self.part.clone();
        let done = self.ready(t).and_then(|()| match &mut self.instance {
            Some(instance) => f(instance, &mut self.now, &part),
            None => Err(Failure::of(&"the unit does not have an instance")),
        });
        if let Err(failure) = &done {
            self.failed = Some(failure.clone());
        }
        done
    }

    fn ready(&mut self, t: f64) -> Result<()> {
        if self.instance.is_none() {
            let began = self.now.began.unwrap_or(t);
            let (mut instance, next, ticks) = self.part.begin(began)?;
            if self.now.began.is_none() {
                self.now.next_event = next;
                self.now.ticks = ticks;
                self.now.outputs = vec![0.0; self.part.output_lanes()];
                if self.part.kind == Kind::CoSimulation {
                    outputs(&mut instance, &self.part, &self.now.ticks, &mut self.now.outputs)?;
                }
                self.now.held = held(&self.part.description);
            }
            self.now.began = Some(began);
            self.instance = Some(instance);
        }
        if let (Some(state), Some(instance)) = (self.waiting.take(), &mut self.instance) {
            instance.load(&state)?;
        }
        Ok(())
    }

    fn saved(&mut self) -> Copy {
        if let Some(failure) = &self.failed {
            return Err(failure.clone());
        }
        self.part.can_save().map_err(|why| Failure::of(&why))?;
        let state = match (&self.waiting, &mut self.instance) {
            (Some(waiting), _) => waiting.clone(),
            (None, Some(instance)) => instance.save()?,
            (None, None) => Vec::new(),
        };
        Ok(Saved { state, ..self.now.clone() })
    }

    fn take(&mut self, copy: Copy) {
        (self.failed, self.waiting) = (None, None);
        match copy {
            Err(failure) => self.failed = Some(failure),
            Ok(Saved { state, began, .. }) if began.is_none() => {
                debug_assert!(state.is_empty());
                (self.instance, self.now) = (None, Saved::default());
            }
            Ok(saved) => {
                // After an error, a new instance is needed.
                if self.instance.as_ref().is_some_and(Instance::is_over) {
                    self.instance = None;
                }
                self.now = Saved { state: Vec::new(), ..saved };
                self.waiting = Some(saved.state);
            }
        }
    }

    /// Returns the store as bytes.
    pub fn save(&mut self) -> std::result::Result<Vec<u8>, String> {
        let saved = self.saved().map_err(|f| f.message)?;
        rmp_serde::to_vec_named(&saved).map_err(|e| e.to_string())
    }

    /// Restores the store.
    pub fn load(&mut self, bytes: &[u8]) -> std::result::Result<(), String> {
        self.part.can_save()?;
        let saved: Saved = rmp_serde::from_slice(bytes).map_err(|e| e.to_string())?;
        let fits = saved.began.is_none()
            || (saved.outputs.len() == self.part.output_lanes()
                && saved.ticks.counts.len() == self.part.clocks.outputs()
                && saved.held.len() == self.part.ports.input_lanes());
        if !fits {
            return Err("its ports differ from the ports of this unit".into());
        }
        self.take(Ok(saved));
        if self.now.began.is_some() {
            self.ready(0.0).map_err(|f| f.message)?;
        }
        Ok(())
    }

    /// Copies the store into a slot.
    pub fn copy(&mut self, into: &mut Option<Box<dyn Any + Send>>) {
        *into = Some(Box::new(self.saved()));
    }

    /// Restores a copy.
    pub fn take_copy(&mut self, from: &dyn Any) {
        if let Some(copy) = from.downcast_ref::<Copy>() {
            self.take(copy.clone());
        }
    }

    /// Returns a copy with its own instance.
    pub fn fork(&mut self) -> Live {
        let mut live = Live::new(self.part.clone());
        live.take(self.saved());
        live
    }
}

/// Returns the start values of the inputs.
fn held(d: &Description) -> Vec<f64> {
    d.all_inputs().flat_map(|p| p.default.clone().unwrap_or_default()).collect()
}
