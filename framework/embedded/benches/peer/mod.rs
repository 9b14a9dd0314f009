//! The peer for collisions and grasped loads: `tests/benches/peers/robot_queries.cpp`, with Pinocchio and coal.
//!
//! In each round Linkwork runs first, then the peer's program. A row has the medians of both over the rounds, and the median of the
//! ratios of the rounds, because the speed of a machine varies from minute to minute.

use linkwork_embedded::multibody::SubhingeKind;
use linkwork_embedded::spatial::{Pose, RigidInertia};
use linkwork_embedded::{ColliderId, Robot, RobotModel, Shape};
use std::collections::BTreeMap;
use std::fmt::Write;
use std::hint::black_box;
use std::path::PathBuf;

/// Number of rounds of both programs.
pub const ROUNDS: usize = 5;

/// Returns the microseconds per call: the median over pieces of ten calls, so that interruptions by other programs have no effect.
/// All configurations are repeated until there are a hundred pieces; the peer does the same.
#[allow(clippy::disallowed_methods)]
pub fn us(qs: &[Vec<f64>], mut call: impl FnMut(&[f64])) -> f64 {
    let mut pieces = Vec::new();
    while pieces.len() < 100 {
        for piece in qs.chunks(10) {
            let from = std::time::Instant::now();
            piece.iter().for_each(|q| call(black_box(q)));
            pieces.push(from.elapsed().as_secs_f64() * 1e6 / piece.len() as f64);
        }
    }
    median(pieces)
}

pub fn median(mut x: Vec<f64>) -> f64 {
    x.sort_by(f64::total_cmp);
    x[x.len() / 2]
}

/// The peer, with its scene in a file.
pub struct Peer {
    program: PathBuf,
    scene: PathBuf,
}

/// Results of the peer: times by name, and whether each configuration collides.
pub struct Told {
    pub us: BTreeMap<String, f64>,
    pub hits: Vec<bool>,
}

impl Peer {
    /// Creates the peer with the robot, its shapes and pairs, the configurations, and a load on a body; `None` if
    /// `LINKWORK_ROBOT_QUERIES` does not name its program.
    pub fn new(robot: &Robot, qs: &[Vec<f64>], load: (&str, &RigidInertia)) -> Option<Self> {
        let Some(program) = std::env::var_os("LINKWORK_ROBOT_QUERIES") else {
            println!(
                "no peer: LINKWORK_ROBOT_QUERIES names no program (tests/benches/peers/install.sh --pinocchio)"
            );
            return None;
        };
        let scene = std::env::temp_dir().join(format!("linkwork_scene_{}.txt", std::process::id()));
        std::fs::write(&scene, text(robot, qs, load)).unwrap();
        Some(Self { program: program.into(), scene })
    }

    pub fn run(&self) -> Told {
        let out = std::process::Command::new(&self.program).arg(&self.scene).output().unwrap();
        let words = String::from_utf8(out.stdout).unwrap();
        let fault = String::from_utf8_lossy(&out.stderr);
        assert!(out.status.success(), "the peer failed: {fault}");
        let mut told = Told { us: BTreeMap::new(), hits: vec![] };
        let words: Vec<&str> = words.split_whitespace().collect();
        for pair in words.chunks_exact(2) {
            if pair[0] == "hits" {
                told.hits = pair[1].chars().map(|c| c == '1').collect();
            } else {
                told.us.insert(pair[0].to_owned(), pair[1].parse().unwrap());
            }
        }
        told
    }
}

impl Drop for Peer {
    fn drop(&mut self) {
        std::fs::remove_file(&self.scene).ok();
    }
}

/// Prints a row: the medians of both programs and of the ratios of the rounds, and the target.
pub fn row(name: &str, ours: &[f64], theirs: &[f64], target: &str) {
    let own = median(ours.to_vec());
    if theirs.is_empty() {
        println!("{name:44} {own:9.3} µs                                  {target}");
    } else {
        let ratio = median(ours.iter().zip(theirs).map(|(a, b)| a / b).collect());
        let peer = median(theirs.to_vec());
        println!("{name:44} {own:9.3} µs   peer {peer:9.3} µs   ratio {ratio:.3}   {target}");
    }
}

/// Returns the scene in the format of the peer.
fn text(robot: &Robot, qs: &[Vec<f64>], (hand, load): (&str, &RigidInertia)) -> String {
    let model: &RobotModel = robot.model();
    let mbs = model.multibody();
    let mut out = format!("bodies {}\n", mbs.bodies().len());
    for b in mbs.bodies() {
        assert_eq!(b.hinge_in_body(), Pose::identity(), "{}: joints are at origins", b.name());
        let subhinges = b.subhinges();
        let kind = subhinges.first().map_or(SubhingeKind::Locked, |s| s.subhinge.kind);
        assert!(subhinges.len() < 2 && kind.nv() < 2, "{}: one degree of freedom", b.name());
        let word = match kind {
            SubhingeKind::Pin { .. } => "pin",
            SubhingeKind::Slider { .. } => "slider",
            SubhingeKind::Locked => "weld",
            other => panic!("{}: the peer has no {other:?}", b.name()),
        };
        out += word;
        put(&mut out, kind.axis().unwrap_or_default().as_slice());
        put(&mut out, &[b.parent().map_or(0, |p| p.index() + 1) as f64]);
        put_pose(&mut out, &b.hinge_in_parent());
        put_inertia(&mut out, b.inertia());
    }
    let ids: Vec<ColliderId> = model.colliders().map(|c| c.0).collect();
    let _ = writeln!(out, "shapes {}", ids.len());
    for id in &ids {
        let spec = model.collider_spec(*id);
        let body = mbs.body(&spec.body).map_or(0, |b| b.index() + 1);
        let _ = write!(out, "{body}");
        match &spec.fine {
            Shape::Box { half } => numbers(&mut out, " box", half.as_slice()),
            Shape::Sphere { radius } => numbers(&mut out, " sphere", &[*radius]),
            Shape::Capsule { radius, half_length } => {
                numbers(&mut out, " capsule", &[*radius, *half_length]);
            }
            Shape::Cylinder { radius, half_length } => {
                numbers(&mut out, " cylinder", &[*radius, *half_length]);
            }
            Shape::ConvexHull { points } => {
                numbers(&mut out, " hull", &[points.len() as f64]);
                points.iter().for_each(|p| put(&mut out, p.as_slice()));
            }
            other => panic!("the peer has no {other:?}"),
        }
        put_pose(&mut out, &spec.pose);
    }
    let pairs: Vec<(usize, usize)> = (0..ids.len())
        .flat_map(|i| (i + 1..ids.len()).map(move |j| (i, j)))
        .filter(|(i, j)| robot.looks_at(ids[*i], ids[*j]).unwrap())
        .collect();
    let _ = writeln!(out, "pairs {}", pairs.len());
    for (i, j) in pairs {
        let _ = writeln!(out, "{i} {j}");
    }
    let _ = writeln!(out, "rows {}", qs.len());
    for q in qs {
        put(&mut out, q);
        out.push('\n');
    }
    let body = mbs.body(hand).unwrap().index() + 1;
    let _ = write!(out, "load {body}");
    put_inertia(&mut out, load);
    out
}

fn numbers(out: &mut String, word: &str, x: &[f64]) {
    *out += word;
    put(out, x);
}

fn put(out: &mut String, x: &[f64]) {
    for x in x {
        let _ = write!(out, " {x}");
    }
}

fn put_pose(out: &mut String, X: &Pose) {
    put(out, X.position.as_slice());
    put(out, X.rotation.coords.as_slice());
    out.push('\n');
}

fn put_inertia(out: &mut String, I: &RigidInertia) {
    put(out, &[I.mass()]);
    put(out, I.com().as_slice());
    put(out, I.inertia_com().as_slice());
    out.push('\n');
}
