//! Inverse kinematics: IK-1, IK-near and targets out of reach, of the definitions beside the reference data; the
//! same rows go to a peer's program when `LINKWORK_CLIK` names it (built from the reference's `clik.cpp`).
//!
//!     cargo bench -p linkwork-embedded --bench reach [-- rows]
#![allow(non_snake_case, clippy::unwrap_used)]

#[path = "../tests/support/mod.rs"]
mod support;

use linkwork_embedded::spatial::Pose;
use linkwork_embedded::*;
use std::fmt::Write;
use support::*;

/// Microseconds of this thread, by the system's clock of the thread where there is one.
#[allow(clippy::disallowed_methods)]
fn timed<R>(f: impl FnOnce() -> R) -> (R, f64) {
    let from = std::time::Instant::now();
    let r = f();
    (r, from.elapsed().as_secs_f64() * 1e6)
}

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
        }
        let targets: Vec<Pose> =
            json["unreachable"].as_array().unwrap().iter().map(|x| pose(&numbers(x))).collect();
        let mut robot = Robot::new(&model);
        let arm = model.part("arm").unwrap();
        let mut tally = Tally { us: vec![], kinematics: 0, most: 0, met: 0, starts: 0 };
        for X in targets {
            let mut q = vec![0.0; model.nq()];
            one(&mut robot, arm, &Goal::pose(X).in_base(), &Effort::default(), &mut q, &mut tally);
        }
        tally.show(&format!("{name} out of reach"));
    }
}

fn one(
    robot: &mut Robot,
    arm: Part,
    goal: &Goal,
    effort: &Effort,
    q: &mut [f64],
    tally: &mut Tally,
) {
    let (answer, us) = timed(|| robot.reach(arm, goal, effort, q).unwrap());
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
    let mut tally = Tally { us: vec![], kinematics: 0, most: 0, met: 0, starts: 0 };
    let mut text = String::new();
    for (target, start) in cases {
        checker.set_q(target).unwrap();
        let X = checker.base_pose(arm).unwrap().inverse() * checker.tip_pose(arm).unwrap();
        let mut q = start.clone();
        one(&mut robot, arm, &Goal::pose(X).in_base(), effort, &mut q, &mut tally);
        let x = [X.position.as_slice(), X.rotation.coords.as_slice()].concat();
        for v in target.iter().chain(start).chain(&x) {
            let _ = write!(text, "{v:e} ");
        }
        text.push('\n');
    }
    tally.show(what);
    if let Ok(peer) = std::env::var("LINKWORK_CLIK") {
        let (set, rest) = what.split_once(' ').unwrap();
        let folder = std::path::Path::new(&peer).parent().unwrap().to_owned();
        std::fs::write(folder.join(format!("{set}.txt")), text).unwrap();
        let restarts = effort.restarts.to_string();
        let tolerance = effort.tolerances[0].to_string();
        let count = cases.len().to_string();
        let out = std::process::Command::new(&peer)
            .args([set, "B", &tolerance, &count, &restarts])
            .current_dir(folder)
            .output()
            .unwrap();
        println!("  peer {rest}: {}", String::from_utf8_lossy(&out.stdout).trim());
    }
}
