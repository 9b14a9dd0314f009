//! Compares accelerations of mechanisms with closed loops with Pinocchio, in one run.
//!
//! `LINKWORK_PINOCCHIO_CONSTRAINED=path cargo bench -p linkwork-solvers --bench constrained [-- words] [--way=CE] [--write]`
//!
//! The path is the program that `tests/benches/peers/install.sh` builds. Words select mechanisms by part of their name. `--way` times only one
//! constraint method (for profiles). `--variants` prints the result of each algorithm and parameter of Pinocchio. `--write` draws
//! `framework/solvers/benches/loops.svg`.
//!
//! Both sides start from (q, β, T), kinematics included, and cycle through the same closed states. Pinocchio's accelerations must agree with
//! Linkwork's to 1e-8, otherwise its time is rejected. The fastest of its algorithms and proximal parameters is used. The column `loose` compares
//! with the fastest that agrees to 1e-6.
#![allow(non_snake_case)]

#[path = "../../dynamics/tests/support/mod.rs"]
mod support;

#[allow(dead_code)]
#[path = "../../dynamics/benches/algorithms/mod.rs"]
mod algorithms;
mod loops;
#[allow(dead_code)]
#[path = "../../dynamics/benches/mechanisms/mod.rs"]
mod mechanisms;
#[path = "../../dynamics/benches/picture/mod.rs"]
mod picture;

use linkwork_dynamics::multibody::ConstraintId;
use linkwork_dynamics::spatial::Vec3;
use linkwork_dynamics::{Tree, Workspace};
use linkwork_solvers::{ConstrainedSolver, ConstraintMethod, FullyAugmentedSolver};
use loops::{Case, State};
use picture::{Curve, Panel};
use std::hint::black_box;
use std::path::{Path, PathBuf};

const REPEATS: usize = 9;
/// Duration of one repeat, s.
const SLICE: f64 = 0.005;
const TARGET: f64 = 0.75;
/// Relative difference of accelerations up to which Pinocchio's result is accepted, and accepted as loose.
const RIGHT: f64 = 1e-8;
const LOOSE: f64 = 1e-6;

type Choice = fn(ConstraintId) -> ConstraintMethod;

/// Constraint method of each loop; `None` is the fully augmented solver.
type MethodChoice = Option<Choice>;

/// Linkwork's methods: tree-augmented, embedded, every second loop embedded, automatic choice, fully augmented.
const WAYS: [(&str, MethodChoice); 5] = [
    ("TA", Some(|_| ConstraintMethod::Augment)),
    ("CE", Some(|_| ConstraintMethod::Embed)),
    (
        "TA+CE",
        Some(|c| match c {
            ConstraintId::Loop(i) if i % 2 == 0 => ConstraintMethod::Embed,
            _ => ConstraintMethod::Augment,
        }),
    ),
    ("Auto", Some(|_| ConstraintMethod::Auto)),
    ("FA", None),
];

/// The fastest accepted run of Pinocchio.
struct Peer {
    name: String,
    mu: String,
    off: f64,
    ns: f64,
    /// Time of the fastest run that agrees to [`LOOSE`].
    loose: f64,
}

fn main() {
    let peer = std::env::var_os("LINKWORK_PINOCCHIO_CONSTRAINED").map(PathBuf::from);
    if peer.is_none() {
        println!(
            "LINKWORK_PINOCCHIO_CONSTRAINED is not set: no peer (tests/benches/peers/install.sh)"
        );
    }
    let words: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with('-')).collect();
    println!(
        "{:<28} {:>4} {:>5} {:>4} {:>9} {:>9} {:>9} {:>9} {:>9} {:>9} {:>6} {:>6}  {:<24} {:>8} {:>8}",
        "mechanism, ns",
        "dof",
        "rows",
        "rank",
        "peer",
        "TA",
        "CE",
        "TA+CE",
        "Auto",
        "FA",
        "ratio",
        "loose",
        "peer's algorithm",
        "peer off",
        "own off"
    );
    let (mut missed, mut measured) = (Vec::new(), Vec::new());
    for case in loops::all() {
        if !words.is_empty() && !words.iter().any(|w| case.name.contains(w.as_str())) {
            continue;
        }
        let m = row(&case, peer.as_deref());
        if let Some(ratio) = m.ratio().filter(|r| *r > TARGET) {
            missed.push(format!("  {}: {ratio:.2}", case.name));
        }
        measured.push(m);
    }
    if peer.is_some() {
        println!("cells beyond {TARGET} of the peer: {}", missed.len());
        missed.iter().for_each(|m| println!("{m}"));
    }
    if std::env::args().any(|a| a == "--write") {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/benches/loops.svg");
        std::fs::write(path, picture::svg("loops or links", &panels(&measured))).expect("written");
        println!("written: framework/solvers/benches/loops.svg");
    }
}

/// Times of one mechanism, ns: Linkwork in the order of [`WAYS`], and Pinocchio.
struct Measured {
    name: String,
    ns: Vec<f64>,
    peer: Option<f64>,
}

impl Measured {
    /// Returns Linkwork's best time divided by Pinocchio's.
    fn ratio(&self) -> Option<f64> {
        let best = self.ns.iter().copied().fold(f64::INFINITY, f64::min);
        self.peer.map(|p| best / p)
    }
}

/// Returns plots of time over the number of loops and over their size, which show where the methods cross.
fn panels(all: &[Measured]) -> Vec<Panel> {
    let colors = ["#3066be", "#0b6e4f", "#e09f3e", "#7b2d8b", "#c1292e"];
    let names = ["TA", "CE", "TA+CE", "FA", "Pinocchio's fastest"];
    let panel = |title: &str, cells: &[(f64, String)], low: f64| {
        let curve = |k: usize| {
            let point = |(n, name): &(f64, String)| {
                let m = all.iter().find(|m| m.name == *name)?;
                // Auto is always one of the others, so it does not have its own curve.
                let ns = if k < 4 { Some(m.ns[[0, 1, 2, 4][k]]) } else { m.peer };
                ns.map(|ns| (*n, 1e-3 * ns))
            };
            let points: Vec<(f64, f64)> = cells.iter().filter_map(point).collect();
            Curve { name: names[k].into(), color: colors[k].into(), points }
        };
        let curves = (0..5).map(curve).filter(|c| !c.points.is_empty()).collect();
        Panel { title: title.into(), curves, low }
    };
    let grid = [(1, 1), (2, 1), (4, 1), (4, 2), (4, 4)];
    let bars: Vec<(f64, String)> =
        (grid.iter()).map(|(b, d)| (f64::from(b * d), format!("four-bars {b} × {d}"))).collect();
    let chain = |depth: usize| -> Vec<(f64, String)> {
        let sizes = [2, 5, 10, 20, 40].into_iter().filter(|s| *s <= depth);
        sizes.map(|s| (s as f64, format!("chains {depth}, loops of {s}"))).collect()
    };
    vec![
        panel("n four-bars on a free base (µs)", &bars, 0.3),
        panel("two chains of 20, n links a side of a loop (µs)", &chain(20), 1.0),
        panel("two chains of 40, n links a side of a loop (µs)", &chain(40), 2.0),
    ]
}

/// Measures and prints one mechanism.
fn row(case: &Case, peer: Option<&Path>) -> Measured {
    let tree = Tree::new(&case.mbs);
    let states = case.states(&tree);
    let answers: Vec<Vec<Vec<f64>>> =
        WAYS.iter().map(|(_, way)| accelerations(&tree, &states, *way)).collect();
    let own = answers[1..].iter().map(|a| difference(a, &answers[0])).fold(0.0, f64::max);
    // Alternate between Linkwork and Pinocchio, twice, because the clock rate of a busy machine drifts.
    let only = std::env::args().find_map(|a| a.strip_prefix("--way=").map(str::to_owned));
    let timed = |name: &str, way: MethodChoice| match &only {
        Some(only) if only != name => f64::INFINITY,
        _ => time(&tree, &states, way),
    };
    let mut ns: Vec<f64> = WAYS.iter().map(|(name, way)| timed(name, *way)).collect();
    let text = case.text(&states, &answers[0]);
    let first = peer.and_then(|p| run_peer(p, &text));
    for (ns, (name, way)) in ns.iter_mut().zip(WAYS) {
        *ns = ns.min(timed(name, way));
    }
    let best = ns.iter().copied().fold(f64::INFINITY, f64::min);
    let second = peer.and_then(|p| run_peer(p, &text));
    let loose =
        [&first, &second].into_iter().flatten().map(|p| p.loose).fold(f64::INFINITY, f64::min);
    let peer = [first, second].into_iter().flatten().min_by(|a, b| a.ns.total_cmp(&b.ns));
    let peer = peer.map(|p| Peer { loose, ..p });
    let rows: usize = case.mbs.constraints().map(|c| case.mbs.rows(c)).sum();
    let rank = rank(&tree, &states);
    print!("{:<28} {:>4} {rows:>5} {rank:>4} ", case.name, case.mbs.nv());
    match &peer {
        None => print!("{:>9}", "-"),
        Some(p) => print!("{:>9.0}", p.ns),
    }
    ns.iter().for_each(|x| print!(" {x:>9.0}"));
    match &peer {
        None => println!(" {:>6} {:>6}  {:<24} {:>8} {own:>8.1e}", "-", "-", "-", "-"),
        Some(p) => println!(
            " {:>6.2} {:>6.2}  {:<24} {:>8.1e} {own:>8.1e}",
            best / p.ns,
            best / p.loose,
            format!("{} μ {}", p.name, p.mu),
            p.off
        ),
    }
    Measured { name: case.name.clone(), ns, peer: peer.map(|p| p.ns) }
}

fn difference(a: &[Vec<f64>], b: &[Vec<f64>]) -> f64 {
    let one = |(a, b): (&Vec<f64>, &Vec<f64>)| {
        let size = b.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        a.iter().zip(b).fold(0.0_f64, |m, (x, y)| m.max((x - y).abs())) / size
    };
    a.iter().zip(b).map(one).fold(0.0, f64::max)
}

type Solve<'t> = Box<dyn FnMut(&State, &mut [f64], &mut [f64]) + 't>;

/// Returns a function from the forces of a state to its accelerations, kinematics included.
fn solver(tree: &Tree, way: MethodChoice) -> Solve<'_> {
    let mut ws = Workspace::new(tree);
    ws.apply_uniform_gravity(Vec3::new(0.0, 0.0, -9.81));
    match way {
        Some(choice) => {
            let mut solver = ConstrainedSolver::new(tree, choice);
            Box::new(move |s, tau, vdot| {
                let done = solver.forward(tree, &mut ws, (&s.q, &s.v), &[], tau, vdot);
                done.expect("regular");
            })
        }
        None => {
            let mut solver = FullyAugmentedSolver::new(tree).expect("rigid bodies with inertia");
            Box::new(move |s, tau, vdot| {
                let done = solver.forward(tree, &mut ws, (&s.q, &s.v), &[], tau, vdot);
                done.expect("regular");
            })
        }
    }
}

fn accelerations(tree: &Tree, states: &[State], way: MethodChoice) -> Vec<Vec<f64>> {
    let mut solve = solver(tree, way);
    let one = |s: &State| {
        let (mut tau, mut vdot) = (s.tau.clone(), vec![0.0; tree.nv()]);
        solve(s, &mut tau, &mut vdot);
        vdot
    };
    states.iter().map(one).collect()
}

/// Returns the smallest number of independent rows over all states.
fn rank(tree: &Tree, states: &[State]) -> usize {
    let mut ws = Workspace::new(tree);
    let mut solver = ConstrainedSolver::new(tree, |_| ConstraintMethod::Augment);
    let one = |s: &State| {
        let (mut tau, mut vdot) = (s.tau.clone(), vec![0.0; tree.nv()]);
        let done = solver.forward(tree, &mut ws, (&s.q, &s.v), &[], &mut tau, &mut vdot);
        done.expect("regular").rank
    };
    states.iter().map(one).min().unwrap_or(0)
}

/// Returns the time of a call in nanoseconds: the best of several repeats, each over all states as often as fits.
#[allow(clippy::disallowed_methods)] // A benchmark reads the clock.
fn time(tree: &Tree, states: &[State], way: MethodChoice) -> f64 {
    let mut solve = solver(tree, way);
    let mut taus: Vec<Vec<f64>> = states.iter().map(|s| s.tau.clone()).collect();
    let mut vdot = vec![0.0; tree.nv()];
    let mut pass = |loops: usize| {
        let start = std::time::Instant::now();
        for _ in 0..loops {
            for (s, tau) in states.iter().zip(&mut taus) {
                solve(s, tau, &mut vdot);
                black_box(&vdot);
            }
        }
        start.elapsed().as_secs_f64() / (loops * states.len()) as f64
    };
    let loops = (SLICE / (pass(1) * states.len() as f64)).max(1.0) as usize;
    1e9 * (0..REPEATS).map(|_| pass(loops)).fold(f64::INFINITY, f64::min)
}

/// Returns Pinocchio's fastest run that agrees. If none agrees, prints a line and returns `None`.
fn run_peer(program: &Path, text: &str) -> Option<Peer> {
    let path = std::env::temp_dir().join(format!("linkwork_loops_{}.txt", std::process::id()));
    std::fs::write(&path, text).expect("temporary file");
    let out = std::process::Command::new(program).arg(&path).output().expect("peer runs");
    std::fs::remove_file(&path).ok();
    assert!(out.status.success(), "peer failed: {}", String::from_utf8_lossy(&out.stderr));
    let text = String::from_utf8(out.stdout).expect("text");
    let (mut best, mut loose): (Option<Peer>, f64) = (None, f64::INFINITY);
    for line in text.lines().skip(1) {
        let words: Vec<&str> = line.split(' ').collect();
        let [name, mu, off, ns] = words[..] else { continue };
        let (Ok(ns), Ok(off)) = (ns.parse::<f64>(), off.parse::<f64>()) else { continue };
        if off <= LOOSE {
            loose = loose.min(ns);
        }
        if off <= RIGHT && best.as_ref().is_none_or(|b| ns < b.ns) {
            best = Some(Peer { name: name.into(), mu: mu.into(), off, ns, loose: ns });
        }
    }
    if let Some(best) = &mut best {
        best.loose = loose;
    }
    if best.is_none() {
        println!("no algorithm of the peer agrees");
    }
    if best.is_none() || std::env::args().any(|a| a == "--variants") {
        print!("{text}");
    }
    best
}
