//! The entry capsule through the command line: RK4 converges at its order.
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
