//! Checkpoints of a run: when they are written, their names, their additional content.
use linkwork_runtime::{Checkpoint, Place, Plan, Role, Schedule, Seconds, Simulation};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Additional content of a checkpoint, by name.
pub type Extra = BTreeMap<String, Vec<u8>>;

/// The policy and its results.
pub struct Saves {
    folder: PathBuf,
    name: String,
    configuration: String,
    every: Option<Schedule>,
    /// Largest number of periodic checkpoints that are kept.
    most: Option<usize>,
    /// The existing periodic checkpoints, in order.
    periodic: Vec<PathBuf>,
    /// A state about one simulated second old, for the case that a step fails.
    last: Option<(Simulation, Extra)>,
    next_last: f64,
    /// Reason for which there is no such state.
    unsaved: Option<String>,
    /// Files written, in order.
    pub written: Vec<PathBuf>,
    /// The first error messages of checkpoints that could not be written.
    pub(crate) failures: Vec<String>,
    /// Number of checkpoints that could not be written.
    pub failed: u64,
}

/// Largest number of kept messages, because a full disk would cause one per period.
const MESSAGES: u64 = 3;

/// Simulated time between two states that are kept in memory (s).
const KEEP: f64 = 1.0;

impl Saves {
    /// Creates a policy for a folder. `name` is that of the simulation, `configuration` rebuilds it, `every` is the period of checkpoints (`None`:
    /// only after a failure).
    pub fn new(
        sim: &Simulation,
        folder: PathBuf,
        name: &str,
        configuration: &str,
        every: Option<Seconds>,
    ) -> Saves {
        let (tick, base) = (sim.state().tick, sim.plan().base);
        Saves {
            folder,
            name: name.into(),
            configuration: configuration.into(),
            every: every.map(|e| Schedule::after(tick, base, e)),
            most: None,
            periodic: Vec::new(),
            last: None,
            next_last: sim.time(),
            unsaved: None,
            written: Vec::new(),
            failures: Vec::new(),
            failed: 0,
        }
    }

    /// Keeps only the last `most` periodic checkpoints, at least one. An old one is removed after a new one is on the disk. Others (interrupted,
    /// before a failure) and those of earlier runs are not counted.
    #[must_use]
    pub fn keep_last(mut self, most: usize) -> Saves {
        self.most = Some(most.max(1));
        self
    }

    #[inline]
    pub(crate) fn is_due(&mut self, tick: u64) -> bool {
        self.every.as_mut().is_some_and(|e| e.is_due(tick))
    }

    pub(crate) fn periodic(
        &mut self,
        sim: &Simulation,
        carried: impl FnOnce() -> Result<Extra, String>,
    ) {
        // If ticks are closer than a nanosecond, the file name needs all digits of the time.
        let fine = sim.plan().base.seconds() < 1e-9;
        let time = if fine { format!("{}", sim.time()) } else { time_name(sim.time()) };
        let name = format!("checkpoint_{time}.lwck");
        self.write(sim, carried(), &name);
        let path = self.folder.join(&name);
        // If the last checkpoint could not be written, do not remove an older one.
        if self.written.last() != Some(&path) {
            return;
        }
        self.periodic.retain(|p| *p != path);
        self.periodic.push(path);
        while self.most.is_some_and(|most| self.periodic.len() > most) {
            let old = self.periodic.remove(0);
            self.written.retain(|w| *w != old);
            // The user may have moved the file.
            if let Err(e) = std::fs::remove_file(&old)
                && e.kind() != std::io::ErrorKind::NotFound
            {
                self.lost(format!("`{}` cannot be removed: {e}", old.display()));
            }
        }
    }

    /// Keeps the present state in memory, about once per simulated second.
    #[inline]
    pub(crate) fn keep(
        &mut self,
        sim: &Simulation,
        carried: impl FnOnce() -> Result<Extra, String>,
    ) {
        let t = sim.time();
        if t >= self.next_last {
            self.next_last = t + KEEP;
            if let Err(e) = sim.can_save() {
                (self.last, self.unsaved) = (None, Some(e.to_string()));
                return;
            }
            self.unsaved = None;
            self.last = carried().ok().map(|extra| (sim.fork(), extra));
        }
    }

    /// Writes the last kept state after a failed step.
    pub(crate) fn before_failure(&mut self) {
        if let Some((sim, extra)) = self.last.take() {
            self.write(&sim, Ok(extra), "before_failure.lwck");
        } else if let Some(why) = self.unsaved.take() {
            self.lost(why);
        }
    }

    pub(crate) fn write(&mut self, sim: &Simulation, extra: Result<Extra, String>, name: &str) {
        let path = self.folder.join(name);
        let written = extra.and_then(|extra| {
            let mut c = sim.checkpoint(&self.configuration).map_err(|e| e.to_string())?;
            fill(&mut c, &self.name, sim.plan())?;
            c.extra.extend(extra);
            c.write(&path).map_err(|e| e.to_string())
        });
        match written {
            Ok(()) => {
                self.written.retain(|w| *w != path);
                self.written.push(path);
            }
            Err(e) => self.lost(e),
        }
    }

    fn lost(&mut self, why: String) {
        self.failed += 1;
        if self.failed <= MESSAGES {
            self.failures.push(why);
        }
    }
}

/// Name under which a checkpoint contains the build of the program that wrote it.
pub const BUILT: &str = "built";

/// Returns the content of every checkpoint of a run: the build of the program, the simulation's name, the names of the signals.
fn fill(c: &mut Checkpoint, name: &str, plan: &Plan) -> Result<(), String> {
    c.extra.insert("name".into(), name.as_bytes().to_vec());
    c.extra.insert(BUILT.into(), crate::built().into_bytes());
    let signals = rmp_serde::to_vec(&signal_names(plan)).map_err(|e| e.to_string())?;
    c.extra.insert("signals".into(), signals);
    Ok(())
}

/// Returns the names of the signal slots, for comparisons; slots that only carry an input are omitted.
pub fn signal_names(plan: &Plan) -> Vec<String> {
    let mut names = vec![String::new(); plan.sizes.sig];
    for (path, v) in &*plan.lanes {
        if let (Place::Signal(k), true) = (v.place, v.role != Role::Input) {
            names[k as usize].clone_from(path);
        }
    }
    names
}

/// Formats a time (s) for a file name: `10`, `2.5`, `0.333333333`. Instants that differ by a nanosecond have different names.
pub fn time_name(t: f64) -> String {
    let whole = format!("{t}");
    match whole.split_once('.') {
        Some((_, digits)) if digits.len() > 9 => {
            let short = format!("{t:.9}");
            short.trim_end_matches('0').trim_end_matches('.').to_string()
        }
        _ => whole,
    }
}

#[cfg(test)]
mod tests {
    use super::time_name;

    #[test]
    fn names_of_instants_are_short_and_different() {
        let names = [
            (0.0, "0"),
            (10.0, "10"),
            (0.1 + 0.2, "0.3"),
            (1.0 / 3.0, "0.333333333"),
            (2.0 / 3.0, "0.666666667"),
            (1e-7, "0.0000001"),
            (123_456.789_012_345, "123456.789012345"),
            (1e15, "1000000000000000"),
        ];
        for (t, name) in names {
            assert_eq!(time_name(t), name);
        }
        assert_ne!(time_name(0.333_333_333), time_name(0.333_333_334));
    }
}
