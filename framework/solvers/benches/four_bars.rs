//! Compares IFToMM's benchmark A02 with 40 four-bars in a row, 10 s at 1 ms, with Exudyn in the same run.
//!
//! `LINKWORK_EXUDYN_PYTHON=path cargo bench -p linkwork-solvers --bench four_bars`
//!
//! The path is the Python of `tests/benches/peers/install.sh --exudyn`. Bars have 1 m and 1 kg, cranks are upright at the start, and the first tip
//! moves at 1 m/s. Linkwork uses classical Runge–Kutta over the tree of cranks and couplers, two rows where a coupler meets the next crank, and
//! projection of positions and rates in each step. The mechanism is singular whenever all bars lie in one line; the energy shows the resulting error.
#![allow(non_snake_case)]

use linkwork_dynamics::multibody::{
    BodySpec, Builder, Hinge, LoopClosure, Multibody, SubhingeKind,
};
use linkwork_dynamics::spatial::{MassProperties, Mat3, Pose, Vec3};
use linkwork_dynamics::{Tree, Workspace, kinematics, kinetic_energy, potential_energy};
use linkwork_integrate::{Field, Integrator, Method};
use linkwork_solvers::{ConstrainedSolver, ConstraintMethod, Projector};

const LOOPS: usize = 40;
const END: f64 = 10.0;
const STEP: f64 = 1e-3;

/// Cranks and couplers rotate about −y: angles from x towards z.
fn mechanism() -> Multibody {
    let mut b = Builder::new();
    let rod = Mat3::from_diagonal(&Vec3::new(0.0, 1.0 / 12.0, 1.0 / 12.0));
    let mut bar = |name: String, parent: String, at: Vec3| {
        b.body(
            BodySpec::new(name, parent)
                .hinge_in_parent(Pose::translation(at.x, at.y, at.z))
                .hinge(Hinge::pin(-Vec3::y()))
                .mass(MassProperties::new(1.0, Vec3::new(0.5, 0.0, 0.0), rod)),
        );
    };
    for i in 0..=LOOPS {
        bar(format!("crank{i:02}"), "world".into(), Vec3::new(i as f64, 0.0, 0.0));
        if i < LOOPS {
            bar(format!("coupler{i:02}"), format!("crank{i:02}"), Vec3::x());
        }
    }
    for i in 0..LOOPS {
        b.loop_closure(LoopClosure {
            name: format!("loop{i:02}"),
            body_a: format!("crank{:02}", i + 1),
            frame_a: Pose::translation(1.0, 0.0, 0.0),
            body_b: format!("coupler{i:02}"),
            frame_b: Pose::translation(1.0, 0.0, 0.0),
            // Constrains only the motion in the plane, because the tree already constrains the rest.
            hinge: Hinge::chain([SubhingeKind::Slider { axis: Vec3::y() }, SubhingeKind::Ball]),
        });
    }
    b.build().expect("A02")
}

struct Run {
    seconds: f64,
    energy: [f64; 2],
    worst: f64,
    error: f64,
}

#[allow(clippy::disallowed_methods)] // A benchmark reads the clock.
fn ours(h: f64) -> Run {
    let mbs = mechanism();
    let tree = Tree::new(&mbs);
    let n = tree.nv();
    let mut ws = Workspace::new(&tree);
    ws.apply_uniform_gravity(Vec3::new(0.0, 0.0, -9.81));
    let mut solver = ConstrainedSolver::new(&tree, |_| ConstraintMethod::Augment);
    let mut close = Projector::new(&tree);
    close.tolerance = 1e-10;
    let mut x = vec![0.0; 2 * n];
    let right = std::f64::consts::FRAC_PI_2;
    for b in mbs.bodies() {
        // The cranks are at 90°, the couplers at −90° to them; both rotate at 1 rad/s in opposite
        // directions.
        let sign = if b.name().starts_with("crank") { 1.0 } else { -1.0 };
        (x[b.q().start], x[n + b.v().start]) = (sign * right, -sign);
    }
    let method = Method::by_name("rk4").expect("a method");
    let mut rk = Integrator::new(method, 2 * n);
    let mut tau = vec![0.0; n];
    let energy = |x: &[f64], ws: &mut Workspace| {
        kinematics(&tree, ws, &x[..n], &x[n..]);
        kinetic_energy(&tree, ws, &x[n..]) + potential_energy(&tree, ws)
    };
    let before = energy(&x, &mut ws);
    let (mut worst, mut error, mut spent) = (0.0_f64, 0.0_f64, 0.0);
    for step in 0..(END / h).round() as usize {
        let start = std::time::Instant::now();
        let f = |_: f64, x: &[f64], d: &mut [f64]| {
            d[..n].copy_from_slice(&x[n..]);
            let (q, v) = x.split_at(n);
            solver.forward(&tree, &mut ws, (q, v), &[], &mut tau, &mut d[n..]).expect("regular");
        };
        rk.step_fixed(&mut Field(f), 0.0, h, &mut x, None).expect("regular");
        let (q, v) = x.split_at_mut(n);
        let closed = close.positions(&tree, &mut ws, &mut solver, &[], q);
        let closed = closed.unwrap_or_else(|e| panic!("t = {}: {e}", step as f64 * h));
        close.rates(&tree, &mut ws, &mut solver, &[], q, v).expect("closes");
        spent += start.elapsed().as_secs_f64();
        error = error.max(closed.error);
        worst = worst.max((energy(&x, &mut ws) - before).abs());
    }
    Run { seconds: spent, energy: [before, energy(&x, &mut ws)], worst, error }
}

fn main() {
    println!("A02: {LOOPS} four-bars, {END} s");
    println!(
        "{:<24} {:>9} {:>12} {:>12} {:>12} {:>12}",
        "", "seconds", "E start J", "E end J", "worst ΔE J", "open m"
    );
    let (run, again) = (ours(STEP), ours(STEP));
    let best = run.seconds.min(again.seconds);
    let print = |name: &str, seconds: f64, r: &Run| {
        println!(
            "{name:<24} {seconds:>9.3} {:>12.6} {:>12.6} {:>12.1e} {:>12.1e}",
            r.energy[0], r.energy[1], r.worst, r.error
        );
    };
    print(&format!("Linkwork, RK4, {STEP} s"), best, &run);
    let coarse = ours(5.0 * STEP);
    print(&format!("Linkwork, RK4, {} s", 5.0 * STEP), coarse.seconds, &coarse);
    let Some(python) = std::env::var_os("LINKWORK_EXUDYN_PYTHON") else {
        println!("LINKWORK_EXUDYN_PYTHON is not set: no peer (tests/benches/peers/install.sh)");
        return;
    };
    let script =
        concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/benches/peers/exudyn_four_bars.py");
    let out = std::process::Command::new(python)
        .args(["-W", "ignore", script])
        .args([LOOPS.to_string(), END.to_string(), STEP.to_string()])
        .output()
        .expect("peer runs");
    assert!(out.status.success(), "peer failed: {}", String::from_utf8_lossy(&out.stderr));
    let text = String::from_utf8(out.stdout).expect("text");
    let last = text.lines().last().unwrap_or_default();
    let x: Vec<f64> = last.split(' ').filter_map(|x| x.parse().ok()).collect();
    let [seconds, before, after] = x[..] else { panic!("{text}") };
    println!("{:<24} {seconds:>9.3} {before:>12.6} {after:>12.6}", format!("Exudyn, {STEP} s"));
    println!("ratio {:.3} of Exudyn's time", best / seconds);
}
