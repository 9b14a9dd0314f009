//! Compares steps of mechanisms in contact with MuJoCo in one run: same mechanism, shapes, friction, state and step on both sides.
//!
//! `LINKWORK_MUJOCO_STEPS=path cargo bench -p linkwork-solvers --bench stepping [-- words]`
//!
//! The path is the program that `tests/benches/peers/install.sh --mujoco` builds. Words select scenes by part of their name. In addition to steps per
//! second, the table has contacts and largest penetration in the second half, the change of mechanical energy, the motion of a body in the last
//! tenth, and the error of the coupling. The last table has the size and time of one contact problem on chains with increasing numbers of links
//! (`problem`).
#![allow(non_snake_case)]

#[path = "../../dynamics/tests/support/mod.rs"]
mod support;

#[allow(dead_code)]
#[path = "../../dynamics/benches/mechanisms/mod.rs"]
mod mechanisms;
mod mjcf;
#[allow(dead_code)]
mod scenes;
mod steps;

use linkwork_dynamics::spatial::Vec3;
use linkwork_dynamics::units::{RowSet, Units, UnitsWork};
use linkwork_dynamics::{Tree, Workspace, kinematics};
use linkwork_solvers::contact::{Cone, Contact, Factor, Problem, Settings};
use linkwork_solvers::{ConstraintMethod, ContactSettings};
use std::path::PathBuf;
use steps::{Figures, ours, run_peer, together};

const RUNS: usize = 5;
const TARGET: f64 = 1.5;

fn main() {
    let peer = std::env::var_os("LINKWORK_MUJOCO_STEPS").map(PathBuf::from);
    if peer.is_none() {
        println!("LINKWORK_MUJOCO_STEPS is not set: no peer (tests/benches/peers/install.sh)");
    }
    let words: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with('-')).collect();
    println!(
        "{:<34} {:>10} {:>7} {:>9} {:>11} {:>10} {:>10} {:>10} {:>9}",
        "scene",
        "steps/s",
        "ratio",
        "contacts",
        "sinks m",
        "E start J",
        "E end J",
        "drift m",
        "coupling"
    );
    for variants in scenes::all() {
        let (name, steps, h) = (&variants[0].name, variants[0].steps, variants[0].h);
        if !words.is_empty() && !words.iter().any(|w| name.contains(w.as_str())) {
            continue;
        }
        println!("{name}, {} × {steps} steps of {h} s", variants.len());
        let theirs = peer.as_deref().map(|p| together(variants.iter().map(|s| run_peer(p, s))));
        if let Some(t) = &theirs {
            print_row("  MuJoCo", t, None);
        }
        for (name, settings) in settings() {
            let ours = together(variants.iter().map(|s| ours(s, &settings, RUNS)));
            let ratio = theirs.map(|t| ours.rate / t.rate);
            print_row(name, &ours, ratio);
            println!(
                "    {:.1} iterations a step; Newton in {} steps, {} short of the tolerance{}",
                ours.iterations as f64 / (steps * variants.len()) as f64,
                ours.newton,
                ours.short,
                if ratio.is_some_and(|r| r < TARGET) { "; below the target" } else { "" }
            );
        }
    }
    if words.is_empty() || words.iter().any(|w| w == "problem") {
        problems();
    }
}

/// Returns the default tolerance, a tenth and a thousandth of it.
fn settings() -> [(&'static str, ContactSettings); 3] {
    let with = |part: f64| {
        let mut s = ContactSettings::default();
        s.solver.tolerance *= part;
        s
    };
    [
        ("  default (1e-3)", with(1.0)),
        ("  tolerance 1e-4", with(0.1)),
        ("  tolerance 1e-6", with(1e-3)),
    ]
}

fn print_row(name: &str, f: &Figures, ratio: Option<f64>) {
    println!(
        "{name:<34} {:>10.0} {:>7} {:>9.2} {:>11.2e} {:>10.3} {:>10.3} {:>10.2e} {:>9.1e}",
        f.rate,
        ratio.map_or(String::new(), |r| format!("{r:.2}")),
        f.contacts,
        f.penetration,
        f.energy[0],
        f.energy[1],
        f.drift,
        f.off
    );
}

/// Number of contacts of the problems.
const TOUCHES: usize = 4;

/// Solves four contacts on chains with increasing numbers of links, at the base and at the tip. Prints the rows and the time of the complementarity
/// problem alone, then the time of the whole step without collision.
fn problems() {
    println!(
        "\n{TOUCHES} contacts on a chain {:>5} {:>6} {:>6} {:>12} {:>10} {:>12}",
        "links", "dof", "rows", "problem µs", "sweeps", "rows made µs"
    );
    for (place, name) in [(0, "at the base"), (1, "at the tip")] {
        for links in [4, 8, 16, 32, 64, 128] {
            let first = place * (links - TOUCHES);
            problem(name, links, first);
        }
    }
}

#[allow(clippy::disallowed_methods)] // A benchmark reads the clock.
fn problem(name: &str, links: usize, first: usize) {
    let mbs = scenes::chain(links);
    let tree = Tree::new(&mbs);
    let units = Units::new(&tree, |_| ConstraintMethod::Augment);
    let (mut ws, mut uw) = (Workspace::new(&tree), UnitsWork::new(&tree, &units));
    ws.apply_uniform_gravity(Vec3::new(0.0, 0.0, -9.81));
    let zero = vec![0.0; tree.nv()];
    let (mut rows, mut cones, mut b) = (RowSet::default(), Vec::new(), Vec::new());
    let q = mbs.neutral_q();
    let mut make = || {
        kinematics(&tree, &mut ws, &q, &zero);
        units.gather(&tree, &mut ws, &mut uw, &zero, &zero, &[]).expect("regular");
        rows.clear();
        for i in 0..TOUCHES {
            let link = mbs.body(&format!("link{:03}", first + i)).expect("link");
            let side = if i % 2 == 0 { 0.2 } else { -0.2 };
            let p = ws.body_pose(&tree, link).position + Vec3::new(0.15, side, -0.05);
            let frame = [Vec3::z(), Vec3::x(), Vec3::y()];
            rows.add_point(&tree, &units, &ws, &uw, (None, Some(link)), &p, &frame);
        }
    };
    let mut made = f64::INFINITY;
    for _ in 0..200 {
        let start = std::time::Instant::now();
        make();
        made = made.min(start.elapsed().as_secs_f64());
    }
    for row in rows.groups() {
        cones.push(Cone::Coulomb { friction: scenes::FRICTION });
        b.push(std::array::from_fn(|k| row.rate[k] + 2e-3 * row.free[k]));
    }
    let factor =
        Factor { start: rows.start(), dof: rows.dof(), e: rows.e(), dofs: rows.independent() };
    let problem = Problem::new(factor, &cones, &b, &[]).expect("sound");
    let mut contact = Contact::new(Settings::default());
    let (mut best, mut iterations) = (f64::INFINITY, 0);
    for _ in 0..200 {
        let mut lambda = [[0.0; 4]; TOUCHES];
        let start = std::time::Instant::now();
        let report = contact.solve(&problem, &mut lambda).expect("solved");
        best = best.min(start.elapsed().as_secs_f64());
        assert!(report.converged, "{report:?}");
        iterations = report.iterations;
    }
    println!(
        "{name:<21} {links:>7} {:>6} {:>6} {:>12.2} {iterations:>10} {:>12.2}",
        tree.nv(),
        rows.rows(),
        1e6 * best,
        1e6 * made
    );
}
