//! `linkwork check`: load, compile, place, and look up every pattern, without running.
use crate::{exit, load, run};
use std::path::Path;

/// Prints every mistake, or what there is.
pub fn check(sim: &Path, set: &[String]) -> u8 {
    let ready = match load::ready(sim, set, None) {
        Ok(ready) => ready,
        Err(code) => return code,
    };
    if let Err(code) = run::prepare(&ready) {
        return code;
    }
    let p = ready.plan();
    say!(
        "ok: {} models, {} services, {} wires, {} variables; tick {}, step {}, {} operations a stage",
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
    }
    if ready.program.phases.len() > 1 {
        let names: Vec<&str> = ready.program.phases.iter().map(|p| p.name.as_str()).collect();
        say!("    phases: {}", names.join(", "));
    }
    load::warn(&ready);
    exit::OK
}
