//! Analysis of constraints: rank, mobility, redundant and contradicting constraints by name.
use linkwork_assembly::{Options, load_text};
use linkwork_plant::{PlanExt, RankReport};
use linkwork_runtime::{Catalogue, Fault, Files, Seconds, Simulation};
use std::sync::Arc;

use crate::common;

/// A parallelogram of 1 m links, closed by a pin about z; `more`: other entries of the file.
fn four_bar(crank: &str, rocker: &str, more: &str) -> String {
    format!(
        r#"Simulation(
            bodies: {{
                "crank": (parent: "world", hinge: Pin(axis: [0, 0, 1]{crank}), mass: 1, inertia: [0.1, 0.1, 0.1], initial: (angle: 1.3)),
                "rod": (parent: "crank", at: (position: [1, 0, 0]), hinge: Pin([0, 0, 1]), mass: 1, inertia: [0.1, 0.1, 0.1], initial: (angle: -1.3)),
                "rocker": (parent: "world", at: (position: [1, 0, 0]), hinge: Pin(axis: [0, 0, 1]{rocker}), mass: 1, inertia: [0.1, 0.1, 0.1], initial: (angle: 1.3)),
            }},
            gravity: "none", {more}
        )"#
    )
}

const LOOP: &str = r#"loops: {
    "wrist": (a: "rod", at_a: (position: [1, 0, 0]), b: "rocker", at_b: (position: [1, 0, 0]), hinge: Pin([0, 0, 1])),
},"#;
const GIVEN: &str = ", prescribed: true";

fn rank(text: &str) -> RankReport {
    let sim = common::scene(text, &[]).unwrap();
    sim.plan().mechanism().unwrap().rank().unwrap()
}

fn fault(text: &str) -> (Fault, usize) {
    let catalogue = Catalogue::new(linkwork_assemblies::libraries());
    let l = load_text("test.ron", text, &Options::new(&catalogue)).unwrap();
    let Err(faults) = l.compile(&catalogue, &Files::default()) else { panic!("{text}") };
    let fault = faults.0[0].clone();
    let line = l.sources.place(fault.origin).unwrap().1;
    (fault, line)
}

#[test]
fn rank_and_mobility_are_those_of_the_linkage() {
    let r = rank(&four_bar("", "", LOOP));
    // The loop is planar in space: two of its five equations are independent.
    assert_eq!((r.free, r.prescribed, r.rows, r.rank, r.mobility()), (3, 0, 5, 2, 1));
    assert_eq!(r.redundant, [("loop `wrist`".to_string(), 3, 5)]);
    assert!(r.over_prescribed.is_empty());
    let r = rank(&four_bar(GIVEN, "", LOOP));
    assert_eq!((r.free, r.prescribed, r.rank, r.mobility()), (2, 1, 2, 0));
    assert!(r.over_prescribed.is_empty(), "one crank of one degree of freedom may be given");
    // One coupling already follows from the parallelogram, and one is independent.
    let with = |c: &str| four_bar("", "", &format!("{LOOP} couplings: {{ {c} }},"));
    let r = rank(&with(r#""gear": (mimic: "crank", of: "rocker")"#));
    assert_eq!((r.rows, r.rank, r.mobility()), (6, 2, 1));
    let repeated: usize = r.redundant.iter().map(|r| r.1).sum();
    assert_eq!(repeated, 4);
    let r = rank(&with(r#""gear": (mimic: "crank", of: "rocker", ratio: 2, offset: -1.3)"#));
    assert_eq!((r.rank, r.mobility()), (3, 0));
    // Rocky 8 has one coupling, and 22 − 6 free rates.
    let r = common::repository("rocky8/sim.ron", &[]).unwrap();
    let r = r.plan().mechanism().unwrap().rank().unwrap();
    assert_eq!((r.free, r.prescribed, r.rows, r.rank, r.mobility()), (16, 6, 1, 1, 15));
    assert!(r.redundant.is_empty());
    // A mechanism without constraints has no reports.
    let free = common::scene(&four_bar("", "", ""), &[]).unwrap();
    assert_eq!(free.plan().mechanism().unwrap().rank(), None);
}

#[test]
fn constraints_that_contradict_each_other_are_errors_by_name() {
    let both = r#"couplings: {
        "gear": (mimic: "crank", of: "rocker"),
        "other": (mimic: "crank", of: "rocker", offset: "10 deg"),
    },"#;
    let (told, line) = fault(&four_bar("", "", both));
    assert!(
        told.message.contains("coupling `other`: contradicts")
            || told.message.contains("coupling `gear`: contradicts"),
        "{told:?}"
    );
    assert!(told.help.unwrap().contains("remove a constraint"));
    assert!(line == 8 || line == 9, "{line}");
    // The strut makes the loop impossible to close.
    let strut =
        r#""strut": (a: "crank", b: "rocker", at_b: (position: [0, 0, 0.2]), hinge: Ball),"#;
    let (told, _) =
        fault(&four_bar("", "", &LOOP.replace("loops: {", &format!("loops: {{ {strut}"))));
    assert!(told.message.contains("strut"), "{told:?}");
    // The loop does not permit these rates of prescribed hinges.
    let spin = four_bar(GIVEN, GIVEN, LOOP).replacen(
        "initial: (angle: 1.3)",
        "initial: (angle: 1.3, rate: 0.5)",
        1,
    );
    let (told, line) = fault(&spin);
    assert!(told.message.contains("loop `wrist`: contradicts"), "{told:?}");
    assert!(told.help.unwrap().contains("compatible rates") && line == 8);
}

#[test]
fn prescribed_motions_against_a_loop_are_a_warning_and_end_a_run_by_name() {
    let motion = |part: &str, body: &str, end: f64| {
        format!(
            r#""{part}": (model: "basics.hinge_trajectory", params: {{ "profile": [[0.5, 1.3], [1.5, {end}]] }}, bind: {{ "hinge": "hinge:{body}" }}),"#
        )
    };
    let parts = |end: f64| {
        let (a, b) = (motion("A", "crank", 1.5), motion("B", "rocker", end));
        four_bar(GIVEN, GIVEN, &format!("{LOOP} parts: {{ {a} {b} }}, step: \"5 ms\","))
    };
    let go = |end: f64| {
        let mut sim = common::scene(&parts(end), &[]).unwrap();
        let told = sim.startup_warnings();
        assert_eq!(told.len(), 1, "{told:?}");
        assert!(told[0].message.contains("loop `wrist`: these constraints hold only as long as the prescribed motions are compatible"));
        sim.run_until(Seconds::from_decimal(2.0).unwrap())
    };
    // In a parallelogram equal motions of both cranks are consistent.
    go(1.5).unwrap();
    let e = go(1.4).unwrap_err();
    assert!(e.message.contains("loop `wrist` does not close"), "{e}");
    assert!(e.time >= 0.5 && e.time < 0.52, "{e}");
}

/// Every constraint method reports the contradiction.
#[test]
fn every_treatment_reports() {
    for solve in ["Embed", "Augment"] {
        let l = LOOP.replace("hinge: Pin", &format!("solve: {solve}, hinge: Pin"));
        let text = four_bar(GIVEN, GIVEN, &l).replacen("angle: 1.3)", "angle: 1.3, rate: 0.5)", 1);
        assert!(fault(&text).0.message.contains("loop `wrist`"));
        let r = rank(&four_bar("", "", &l));
        assert_eq!((r.rank, r.mobility()), (2, 1));
    }
    let plan = common::scene(&four_bar("", "", LOOP), &[]).unwrap().plan().clone();
    assert!(Simulation::new(Arc::clone(&plan)).startup_warnings().is_empty());
}

/// A parallelogram of two cranks and a coupler (m) with their masses (kg); its links are in line at half a turn and at a full turn.
struct Parallelogram {
    crank: f64,
    coupler: f64,
    masses: [f64; 3],
}

impl Parallelogram {
    fn text(&self, solve: &str, integrator: &str) -> String {
        let Parallelogram { crank: r, coupler: d, masses } = *self;
        let bar = |l: f64, m: f64| [m * l * l / 12.0, 0.001];
        let link = |x: f64, m: f64| {
            let [i, thin] = bar(r, m);
            format!(
                r#"(parent: "world", at: (position: [{x}, 0, 0]), hinge: Pin([0, 0, -1]), mass: {m}, com: [0, {}, 0], inertia: [{i}, {thin}, {i}], initial: (angle: 0, rate: 1), nodes: {{ "top": (position: [0, {r}, 0]) }})"#,
                0.5 * r
            )
        };
        let [i, thin] = bar(d, masses[2]);
        format!(
            r#"Simulation(bodies: {{ "v0": {}, "v1": {},
                "h0": (parent: "v0/top", hinge: Pin([0, 0, -1]), mass: {}, com: [{}, 0, 0], inertia: [{thin}, {i}, {i}], initial: (angle: 0, rate: -1)) }},
                loops: {{ "l0": (a: "h0", at_a: (position: [{d}, 0, 0]), b: "v1", at_b: (position: [0, {r}, 0]), hinge: Pin([0, 0, -1]), solve: {solve}) }},
                parts: {{ "G": (model: "environment.uniform_gravity", params: {{ "acceleration": [0, -9.81, 0] }}) }}, {integrator}, until: "10 s")"#,
            link(0.0, masses[0]),
            link(d, masses[1]),
            masses[2],
            0.5 * d,
        )
    }

    /// Returns the angle of a crank after some time. While the coupler keeps its direction this is one pendulum, I θ̈ = m g sin θ with I = r² ((m₁ +
    /// m₂)/3 + m₃) and m = r ((m₁ + m₂)/2 + m₃), integrated here by RK4 at 0.1 ms.
    fn angle(&self, time: f64) -> f64 {
        let ([a, b, c], r) = (self.masses, self.crank);
        let pull = 9.81 * ((a + b) / 2.0 + c) / (r * ((a + b) / 3.0 + c));
        let f = |[q, v]: [f64; 2]| [v, pull * q.sin()];
        let (mut x, h) = ([0.0, 1.0], 1e-4);
        for _ in 0..(time / h).round() as usize {
            let at = |k: [f64; 2], s: f64| [x[0] + s * k[0], x[1] + s * k[1]];
            let k1 = f(x);
            let k2 = f(at(k1, 0.5 * h));
            let k3 = f(at(k2, 0.5 * h));
            let k4 = f(at(k3, h));
            for i in 0..2 {
                x[i] += h / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]);
            }
        }
        x[0]
    }
}

/// A parallelogram that rotates ten times through the configurations in which its links are in line stays a parallelogram: the coupler keeps its
/// direction, and the cranks follow one pendulum. Every integrator, both constraint methods for the loop, several proportions.
#[test]
fn a_parallelogram_passes_the_positions_in_line() {
    let all = [
        Parallelogram { crank: 1.0, coupler: 1.0, masses: [1.0, 1.0, 1.0] },
        Parallelogram { crank: 1.0, coupler: 2.0, masses: [1.0, 1.0, 1.0] },
        Parallelogram { crank: 1.0, coupler: 0.5, masses: [1.0, 3.0, 2.0] },
        Parallelogram { crank: 0.7, coupler: 1.3, masses: [2.0, 1.0, 0.5] },
    ];
    let mut ways = Vec::new();
    // The samples are 1 ms apart; the adaptive methods step within them at their default accuracy.
    for method in ["rk4", "verner_87", "dormand_prince_54"] {
        ways.push((format!(r#"step: "1 ms", integrator: "{method}""#), 1e-5));
    }
    for method in ["bogacki_shampine_32", "dormand_prince_54", "verner_87", "rodas4p"] {
        for (accuracy, within) in [("1e-6", 0.01), ("1e-9", 3e-5), ("1e-12", 1e-5)] {
            if method == "bogacki_shampine_32" && accuracy == "1e-12" {
                continue;
            }
            ways.push((
                format!(
                    r#"step: "50 ms", integrator: "{method}", accuracy: (relative: {accuracy}, absolute: {accuracy})"#
                ),
                within,
            ));
        }
    }
    let (mut worst, mut wrong, mut ended) = (0.0_f64, Vec::new(), 0);
    for (k, p) in all.iter().enumerate() {
        let right = p.angle(10.0);
        for solve in ["Auto", "Augment"] {
            for (integrator, within) in &ways {
                let mut sim = common::scene(&p.text(solve, integrator), &[])
                    .unwrap_or_else(|e| panic!("{e}"));
                let done = sim.run_until(Seconds { num: 10, den: 1 });
                let [v, h] = ["v0.angle", "h0.angle"].map(|n| sim.get(n).unwrap());
                // It is a known limitation that the stiff method at this accuracy may end the run
                // with a message.
                if done.is_err() && integrator.contains("rodas4p") && integrator.contains("1e-12") {
                    ended += 1;
                    continue;
                }
                worst = worst.max((v + h).abs());
                if done.is_err() || !((v + h).abs() < 1e-6 && (v - right).abs() < *within) {
                    wrong.push(format!(
                        "{k} {solve} {integrator}: {done:?} {v} {right} {:.1e}",
                        v + h
                    ));
                }
            }
        }
    }
    println!("coupler within {worst:.1e} rad, {ended} ended with a message");
    assert!(ended <= 1 && worst < 1e-9, "{ended}");
    assert!(wrong.is_empty(), "{} wrong\n{}", wrong.len(), wrong.join("\n"));
}
