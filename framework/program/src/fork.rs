//! `linkwork fork`: continues from a checkpoint with other parameters, or as another simulation.
//!
//! The state is transferred by path, as between phases: parts with the same path and kind keep it, new parts start at this instant, bodies keep pose
//! and velocity. Kept, new and lost parts are listed before any file is written. Metrics of variables and conditions that exist in both continue. The
//! log contains the state from which the fork begins, so that it can be replayed.
use crate::load::Ready;
use crate::options::RunOptions;
use crate::{exit, load, run};
use linkwork_plant::PlanExt;
use linkwork_runtime::{Checkpoint, Plan, Program, Simulation};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Options of a fork.
#[derive(clap::Args, Clone, Debug, Default)]
pub struct ForkOptions {
    /// Continue as this simulation instead of the one in the checkpoint: for changed files, and for parameters of assemblies, which the checkpoint
    /// contains only in resolved form.
    #[arg(long, value_name = "SIM")]
    pub sim: Option<PathBuf>,
    /// Set a parameter of a part (with --sim, of an assembly too; repeatable).
    #[arg(long = "set", value_name = "PATH=VALUE")]
    pub set: Vec<String>,
    /// Continue even if the states of some parts or bodies are lost.
    #[arg(long)]
    pub allow: bool,
}

/// A run that continues as another one.
pub(crate) struct Fork {
    old: Option<Box<Simulation>>,
    /// The other simulation; `None`: that of the checkpoint.
    sim: Option<PathBuf>,
    checkpoint: Checkpoint,
    allow: bool,
}

/// Paths of parts and names of bodies.
#[derive(Default)]
struct Names {
    parts: BTreeSet<String>,
    bodies: BTreeSet<String>,
}

impl Names {
    fn of(plan: &Plan) -> Names {
        let bodies = plan.mechanism().map_or(&[][..], |m| m.multibody.bodies());
        Names {
            parts: plan.parts.iter().map(|p| p.path.clone()).collect(),
            bodies: bodies.iter().map(|b| b.name().to_string()).collect(),
        }
    }
}

impl Fork {
    /// Returns the simulated time of the checkpoint (s).
    pub fn time(&self) -> f64 {
        self.checkpoint.time
    }

    /// Returns the checkpoint from which it begins.
    pub fn checkpoint(&self) -> &Checkpoint {
        &self.checkpoint
    }

    /// Returns the file or folder of the other simulation, if it is not that of the checkpoint.
    pub fn simulation(&self) -> Option<&Path> {
        self.sim.as_deref()
    }

    /// Transfers the run to its new program. Prints what was transferred, and rejects the loss of states unless it is allowed.
    pub fn take_over(&mut self, program: Arc<Program>) -> Result<Simulation, u8> {
        let Some(mut sim) = self.old.take() else {
            tell!("error: the fork has already been used");
            return Err(exit::FAILED);
        };
        let before = Names::of(sim.plan());
        let report = sim.move_to_program(program).map_err(|e| {
            tell!("error: {e}");
            exit::INPUT
        })?;
        let after = Names::of(sim.plan());
        // A part that existed before but was started anew has lost its state.
        let (anew, fresh): (Vec<&String>, Vec<&String>) =
            report.new.iter().partition(|part| before.parts.contains(*part));
        let bodies: Vec<&String> = before.bodies.difference(&after.bodies).collect();
        let gone: Vec<&String> = report.dropped.iter().collect();
        tell!("t = {} s: {} parts continue", self.time(), report.kept.len());
        let told = [
            ("new parts", &fresh),
            ("parts of another kind, which start anew", &anew),
            ("parts gone", &gone),
            ("bodies gone", &bodies),
        ];
        for (what, names) in told.iter().filter(|(_, names)| !names.is_empty()) {
            let names: Vec<&str> = names.iter().map(|n| n.as_str()).collect();
            tell!("    {what}: {}", names.join(", "));
        }
        for (path, why) in &report.unpinned {
            tell!("    no longer pinned: {path}: {why}");
        }
        report.notes.iter().for_each(|note| tell!("    {note}"));
        if !self.allow && told[1..].iter().any(|(_, names)| !names.is_empty()) {
            tell!(
                "error: the fork would lose states of the checkpoint\n  help: keep those parts and bodies as \
                 they were, or give --allow"
            );
            return Err(exit::INPUT);
        }
        Ok(*sim)
    }
}

/// `linkwork fork CHECKPOINT [--sim SIM] [--set PATH=VALUE].. [--allow]`.
pub fn fork(file: &Path, fork: &ForkOptions, options: &RunOptions) -> u8 {
    match prepared(file, fork) {
        Ok((ready, name, begin)) => run::run_fork(ready, &name, options, file, begin),
        Err(code) => code,
    }
}

fn prepared(file: &Path, options: &ForkOptions) -> Result<(Ready, String, Fork), u8> {
    if options.sim.is_none() && options.set.is_empty() {
        tell!(
            "error: nothing changes\n  help: give --set PATH=VALUE or --sim SIM; `linkwork resume` continues without changes"
        );
        return Err(exit::INPUT);
    }
    let (checkpoint, name) = run::read(file)?;
    let text = format!("{name}.ron");
    let was = load::ready_text(&text, &checkpoint.configuration)?;
    let mut old = Box::new(Simulation::of(Arc::new(was.program)));
    old.restore(&checkpoint).map_err(|e| {
        tell!("error: {e}");
        exit::INPUT
    })?;
    let ready = match &options.sim {
        // With the seed of the checkpoint, the noise sequences continue.
        Some(sim) => load::ready(sim, &options.set, Some(checkpoint.seed))?,
        None => load::ready_text_set(&text, &checkpoint.configuration, &options.set)?,
    };
    let sim = options.sim.clone();
    let name = sim.as_deref().map_or(name, run::title_of);
    Ok((ready, name, Fork { old: Some(old), sim, checkpoint, allow: options.allow }))
}
