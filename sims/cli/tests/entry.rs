//! The entry capsule through the command line: RK4 converges at its order. The landing ellipse of a campaign agrees with the covariance of its runs.
use crate::common::{Lab, sim};
use linkwork_record::read_log;

/// Returns the position at 300 s with a given step.
fn position(lab: &Lab, step: &str) -> [f64; 3] {
    let set = format!("step={step} s");
    lab.run(&sim("ballistic_entry"), step, &["--set", &set, "--until", "300s"]).code(0);
    let log = read_log(&lab.path(step).join("run.mcap")).unwrap();
    ["x", "y", "z"].map(|c| {
        let end = format!("capsule.position.{c}");
        let (name, s) =
            log.iter().find(|(n, _)| n.ends_with(&end)).expect("the position is logged");
        assert_eq!(*s.t.last().unwrap(), 300.0, "{name}");
        *s.y.last().unwrap()
    })
}

fn apart(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
}

#[test]
fn rk4_is_of_order_four_and_exact_to_a_millimetre() {
    let lab = Lab::new();
    let converged = position(&lab, "0.02");
    let errors = ["4", "2", "1"].map(|step| apart(position(&lab, step), converged));
    let order = |k: usize| (errors[k] / errors[k + 1]).log2();
    println!("errors at 4, 2, 1 s: {errors:?} m; orders {:.3}, {:.3}", order(0), order(1));
    assert!(errors[2] < 1e-3, "1 s: {} m", errors[2]);
    assert!(order(0) >= 3.9 && order(1) >= 3.9, "orders {:.3}, {:.3}", order(0), order(1));
    // Smaller steps still agree: the reference has converged.
    assert!(apart(position(&lab, "0.05"), converged) < 1e-5);
}

/// The product and the sum of squares of the half axes follow from determinant and trace of the covariance of the runs, which is computed here from
/// `results.csv`.
#[test]
fn the_ellipse_of_a_campaign_is_that_of_its_runs() {
    let lab = Lab::new();
    lab.write(
        "throw/sim.ron",
        r#"Simulation(
            bodies: { "stone": (parent: "world", hinge: Free, mass: "1 kg", inertia: Sphere(0.05), initial: (velocity: [10, 2, 20])) },
            parts: { "Gravity": (model: "environment.uniform_gravity", params: { "acceleration": [0, 0, -9.81] }) },
            step: "10 ms", until: "10 s", stop_when: "stone.position.z < 0 m",
            metrics: {
                "time": (of: "stone.position.z", take: "time_of_max"),
                "x": (of: "stone.position.x", take: "last", unit: "m"),
                "y": (of: "stone.position.y", take: "last", unit: "m"),
            },
        )"#,
    );
    lab.write(
        "throw/c.ron",
        r#"Campaign(
            simulation: "sim.ron", runs: 40, seed: 5,
            vary: { "stone.initial.velocity": [Normal(mean: 10, deviation: 1), Normal(mean: 2, deviation: 0.5), Normal(mean: 20, deviation: 2)] },
            scatter: [("x", "y"), ("time", "x")],
        )"#,
    );
    let said = lab.linkwork(&["campaign", "throw/c.ron", "--out", "out"]).code(0).out;
    let table = |name: &str| {
        let text = std::fs::read_to_string(lab.path(&format!("out/{name}.csv"))).unwrap();
        let mut rows = text.lines().map(|l| l.split(',').map(str::to_string).collect::<Vec<_>>());
        (rows.next().unwrap(), rows.collect::<Vec<_>>())
    };
    let (heads, runs) = table("results");
    let column = |title: &str| -> Vec<f64> {
        let k = heads.iter().position(|h| h == title).unwrap();
        runs.iter().map(|row| row[k].parse().unwrap()).collect()
    };
    let (x, y) = (column("x [m]"), column("y [m]"));
    let n = x.len() as f64;
    let mean = |v: &[f64]| v.iter().sum::<f64>() / n;
    let covariance = |u: &[f64], v: &[f64]| {
        let (a, b) = (mean(u), mean(v));
        u.iter().zip(v).map(|(u, v)| (u - a) * (v - b)).sum::<f64>() / (n - 1.0)
    };
    let (a, b, c) = (covariance(&x, &x), covariance(&x, &y), covariance(&y, &y));
    // Metrics of different units have no ellipse, because its axes depend on the units.
    let (heads, rows) = table("ellipses");
    assert_eq!((rows.len(), &rows[0][..4]), (1, &["x", "y", "m", "40"].map(String::from)[..]));
    let cell = |title: &str| -> f64 {
        rows[0][heads.iter().position(|h| h == title).unwrap()].parse().unwrap()
    };
    let near = |found: f64, want: f64| assert!((found / want - 1.0).abs() < 1e-9, "{found} {want}");
    let [long, short] = [cell("long half axis (1 sigma)"), cell("short half axis (1 sigma)")];
    near(long * long + short * short, a + c);
    near(long * short, (a * c - b * b).sqrt());
    // The χ² distribution with two degrees of freedom has 99 % below 9.2103.
    near((cell("long half axis (99 %)") / long).powi(2), 9.210_340_371_976_18);
    let angle = cell("angle of the long axis from x to y [deg]").to_radians();
    near((2.0 * angle).tan(), 2.0 * b / (a - c));
    near(cell("centre x"), mean(&x));
    assert!(cell("runs within 99 %") >= 37.0 && said.contains("99 % ellipse of x, y"), "{said}");
    let page = std::fs::read_to_string(lab.path("out/report.html")).unwrap();
    assert!(page.contains("<h2>Ellipses</h2>") && page.matches("x [m], y [m]").count() == 1);
}
