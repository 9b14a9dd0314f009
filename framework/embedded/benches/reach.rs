//! Inverse kinematics: IK-1, IK-near and targets out of reach, as the reference data define them. If `LINKWORK_CLIK` names a peer's
//! program (built from `clik.cpp` of the reference data), both programs run alternately on the same blocks of targets, and the
//! printed ratio is the median over the blocks. Linkwork measures wall-clock time, the peer the time of its thread.
//!
//!     cargo bench -p linkwork-embedded --bench reach [-- rows]
#![allow(non_snake_case, clippy::unwrap_used)]

#[path = "../tests/support/mod.rs"]
mod support;

use linkwork_embedded::*;
use std::fmt::Write;
use support::*;

/// Returns the result and the wall-clock time in microseconds.
#[allow(clippy::disallowed_methods)]
fn timed<R>(f: impl FnOnce() -> R) -> (R, f64) {
    let from = std::time::Instant::now();
    let r = f();
    (r, from.elapsed().as_secs_f64() * 1e6)
}

/// Targets of a block; the two programs alternate after each block.
const BLOCK: usize = 1000;

#[derive(Default)]
struct Tally {
    us: Vec<f64>,
    kinematics: usize,
    most: usize,
    met: usize,
    starts: usize,
}

impl Tally {
    fn show(&mut self, what: &str) {
        self.us.sort_by(f64::total_cmp);
        let n = self.us.len();
        let mean = self.us.iter().sum::<f64>() / n as f64;
        println!(
            "{what:24} met {:.4}  kinematics {:.1} (most {})  starts {:.2}  µs: mean {mean:.2} median {:.2} p95 {:.2} p99 {:.2} max {:.1}",
            self.met as f64 / n as f64,
            self.kinematics as f64 / n as f64,
            self.most,
            1.0 + self.starts as f64 / n as f64,
            self.us[n / 2],
            self.us[n * 95 / 100],
            self.us[n * 99 / 100],
            self.us[n - 1]
        );
    }
}

/// Returns the median and the 99th percentile of the times, µs.
fn quantiles(us: &[f64]) -> [f64; 2] {
    let mut us = us.to_vec();
    us.sort_by(f64::total_cmp);
    [us[us.len() / 2], us[us.len() * 99 / 100]]
}

/// Results of the peer for a block.
struct Block {
    success: f64,
    kinematics: f64,
    quantiles: [f64; 2],
}

/// Runs the peer's program on rows of target, start and pose.
fn peer(set: &str, rows: &[String], effort: &Effort) -> Option<Block> {
    let program = std::env::var("LINKWORK_CLIK").ok()?;
    let folder = std::path::Path::new(&program).parent().unwrap();
    std::fs::write(folder.join(format!("{set}.txt")), rows.concat()).unwrap();
    let [tolerance, count, restarts] =
        [effort.tolerances[0].to_string(), rows.len().to_string(), effort.restarts.to_string()];
    let out = std::process::Command::new(&program)
        .args([set, "B", &tolerance, &count, &restarts])
        .current_dir(folder)
        .output()
        .unwrap();
    let told: serde_json::Value = serde_json::from_slice(&out.stdout).unwrap();
    let of = |k: &str| told[k].as_f64().unwrap();
    let quantiles = [of("median_us"), of("p99_us")];
    Some(Block { success: of("success"), kinematics: of("fk_per_target"), quantiles })
}

fn main() {
    let rows = std::env::args().skip(1).find_map(|a| a.parse().ok()).unwrap_or(10_000);
    for (name, seed, near) in
        [("ur5", 20_261_122_001, 20_261_122_401), ("iiwa7", 20_261_122_002, 20_261_122_402)]
    {
        let Some(json) = reference(&format!("robodarts/ik_{name}.json")) else { return };
        let [base, tip] = ["base", "tip"].map(|k| json[k].as_str().unwrap());
        let model =
            robot(&format!("robots/{name}.urdf"), &[PartSpec::chain("arm", base, tip)], vec![]);
        let (low, high) = (numbers(&json["lower"]), numbers(&json["upper"]));
        for (set, seed, effort) in [
            ("IK-1 1e-9", seed, Effort::default()),
            ("IK-1 1e-5", seed, Effort { tolerances: [1e-5; 2], ..Effort::default() }),
            ("IK-near 1e-9", near, Effort::one_start()),
        ] {
            let mut rng = Rng(seed);
            let mut draw = |at: Option<&[f64]>| -> Vec<f64> {
                (0..low.len())
                    .map(|i| match at {
                        None => rng.within(low[i], high[i]),
                        Some(q) => (q[i] + 0.1 * (2.0 * rng.unit() - 1.0)).clamp(low[i], high[i]),
                    })
                    .collect()
            };
            let cases: Vec<(Vec<f64>, Vec<f64>)> = (0..rows)
                .map(|_| {
                    let target = draw(None);
                    let start = if seed == near { draw(Some(&target)) } else { draw(None) };
                    (target, start)
                })
                .collect();
            run(&model, &cases, &effort, &format!("{name} {set}"));
            if seed != near && effort == Effort::default() {
                closed(&model, &cases, &format!("{name} closed form, all"));
            }
        }
        let targets = json["unreachable"].as_array().unwrap();
        let mut robot = Robot::new(&model);
        let arm = model.part("arm").unwrap();
        let mut tally = Tally::default();
        let mut rows = Vec::new();
        for X in targets.iter().map(numbers) {
            let mut q = vec![0.0; model.nq()];
            robot.clamp(&mut q).unwrap();
            let whole = [&q[..], &q[..], &X[..]].concat();
            rows.push(text(&whole));
            let goal = Goal::pose(pose(&X));
            one(&mut robot, arm, &goal, &Effort::default(), &mut q, &mut tally);
        }
        let theirs = peer(name, &rows, &Effort::default());
        let ours = quantiles(&tally.us);
        tally.show(&format!("{name} out of reach"));
        tell(&ours, theirs.as_slice(), &[ours]);
    }
}

fn text(numbers: &[f64]) -> String {
    let mut text = String::new();
    for x in numbers {
        let _ = write!(text, "{x:e} ");
    }
    text + "\n"
}

/// Prints the times of the peer and the ratios of the blocks.
fn tell(ours: &[f64; 2], peers: &[Block], blocks: &[[f64; 2]]) {
    if peers.is_empty() {
        return;
    }
    let middle = |mut x: Vec<f64>| {
        x.sort_by(f64::total_cmp);
        x[x.len() / 2]
    };
    let mean = |f: fn(&Block) -> f64| peers.iter().map(f).sum::<f64>() / peers.len() as f64;
    let of = |k: usize| middle(peers.iter().map(|p| p.quantiles[k]).collect());
    let ratio =
        |k: usize| middle(peers.iter().zip(blocks).map(|(p, b)| b[k] / p.quantiles[k]).collect());
    println!(
        "  peer: met {:.4}  kinematics {:.1}  µs: median {:.2} p99 {:.2} (ours {:.2} {:.2})  ratios: median {:.3} p99 {:.3}",
        mean(|p| p.success),
        mean(|p| p.kinematics),
        of(0),
        of(1),
        ours[0],
        ours[1],
        ratio(0),
        ratio(1)
    );
}

/// Measures the closed form, which returns all solutions of the same targets; the first is nearest to the start.
fn closed(model: &std::sync::Arc<RobotModel>, cases: &[(Vec<f64>, Vec<f64>)], what: &str) {
    let arm = model.part("arm").unwrap();
    let form = model.closed_form(arm, None).unwrap();
    let (mut robot, mut checker) = (Robot::new(model), Robot::new(model));
    let mut out = vec![0.0; ClosedForm::MOST * model.nq()];
    let (mut tally, mut found) = (Tally::default(), 0);
    for (target, _) in cases {
        checker.set_q(target).unwrap();
        let X = checker.base_pose(arm).unwrap().inverse() * checker.tip_pose(arm).unwrap();
        let goal = Goal::pose(X);
        let (count, us) = timed(|| {
            robot.inverse_kinematics_all(&form, &goal, Frame::Base, target, &mut out).unwrap()
        });
        let off = out.iter().zip(target).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        tally.us.push(us);
        tally.met += usize::from(count > 0 && off < 1e-6);
        found += count;
    }
    tally.show(what);
    println!("  {:.2} solutions a target", found as f64 / cases.len() as f64);
}

fn one(
    robot: &mut Robot,
    arm: Part,
    goal: &Goal,
    effort: &Effort,
    q: &mut [f64],
    tally: &mut Tally,
) {
    let (answer, us) =
        timed(|| robot.inverse_kinematics(arm, goal, Frame::Base, effort, q).unwrap());
    tally.us.push(us);
    tally.kinematics += answer.kinematics;
    tally.most = tally.most.max(answer.kinematics);
    tally.met += usize::from(answer.outcome == Outcome::Met);
    tally.starts += answer.restart;
}

fn run(
    model: &std::sync::Arc<RobotModel>,
    cases: &[(Vec<f64>, Vec<f64>)],
    effort: &Effort,
    what: &str,
) {
    let arm = model.part("arm").unwrap();
    let (mut robot, mut checker) = (Robot::new(model), Robot::new(model));
    let mut tally = Tally::default();
    let set = what.split(' ').next().unwrap();
    let (mut blocks, mut peers) = (Vec::new(), Vec::new());
    for cases in cases.chunks(BLOCK) {
        let from = tally.us.len();
        let mut rows = Vec::new();
        for (target, start) in cases {
            checker.set_q(target).unwrap();
            let X = checker.base_pose(arm).unwrap().inverse() * checker.tip_pose(arm).unwrap();
            let mut q = start.clone();
            one(&mut robot, arm, &Goal::pose(X), effort, &mut q, &mut tally);
            let x = [X.position.as_slice(), X.rotation.coords.as_slice()].concat();
            rows.push(text(&[&target[..], &start[..], &x[..]].concat()));
        }
        blocks.push(quantiles(&tally.us[from..]));
        peers.extend(peer(set, &rows, effort));
    }
    let ours = quantiles(&tally.us);
    tally.show(what);
    tell(&ours, &peers, &blocks);
}
