//! `linkwork check`: loads, compiles and places a simulation and resolves all names, which shows whether a run can begin.
use crate::{exit, load, run};
use linkwork_plant::{PlanExt, RankReport};
use linkwork_runtime::Simulation;
use std::path::Path;

/// Prints all mistakes, or a summary of the simulation.
pub fn check(sim: &Path, set: &[String]) -> u8 {
    let ready = match load::ready(sim, set, None) {
        Ok(ready) => ready,
        Err(code) => return code,
    };
    if let Err(code) = run::prepare(&ready) {
        return code;
    }
    let p = ready.plan();
    if let Err(e) = Simulation::new(ready.program.phases[0].plan.clone()).check() {
        load::warn(&ready);
        tell!("error: {e}");
        return exit::FAILED;
    }
    say!(
        "ok: {} models, {} services, {} wires, {} variables; tick {}, step {}, {} operations per stage",
        p.parts.len(),
        p.services.iter().count(),
        p.wires.len(),
        p.variables.len(),
        p.base,
        p.step,
        p.stage_len()
    );
    if let Some(m) = p.mechanism() {
        say!(
            "    mechanism: {} bodies, {} degrees of freedom, {:.3} kg",
            m.multibody.bodies().len(),
            m.multibody.nv(),
            m.tree.total_mass()
        );
        if let Some(rank) = m.rank() {
            constraints(&rank);
        }
    }
    if ready.program.phases.len() > 1 {
        let names: Vec<&str> = ready.program.phases.iter().map(|p| p.name.as_str()).collect();
        say!("    phases: {}", names.join(", "));
    }
    load::warn(&ready);
    exit::OK
}

/// Prints the mobility that remains with loops and couplings, and redundant constraints.
fn constraints(r: &RankReport) {
    say!(
        "    constraints: {} equations of rank {} on {} free rates: mobility {}; {} prescribed",
        r.rows,
        r.rank,
        r.free,
        r.mobility(),
        r.prescribed
    );
    let again: Vec<String> =
        r.redundant.iter().map(|(name, rows, of)| format!("{name} ({rows} of {of})")).collect();
    if !again.is_empty() {
        say!("    repeat others: {}", again.join(", "));
    }
}
