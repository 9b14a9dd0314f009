//! Recordings: the values of a run at their rows, the same in one call and in several, and refusals.
use linkwork_assembly::{Assembly, Body};
use linkwork_multibody::Hinge;
use linkwork_runner::Recording;
use linkwork_runtime::{RunError, Simulation};
use linkwork_spatial::Vec3;

/// A spring with a mass: x = cos(10 t).
fn oscillator() -> Simulation {
    let mut hinge = Hinge::slider(Vec3::x());
    hinge.subhinges[0].spring.stiffness = 200.0;
    let mass = Body::on("world").hinge(hinge).mass(2.0).inertia([1.0; 3]);
    let mut assembly = Assembly::new();
    assembly.body("mass", mass.initial("position", 1.0)).set("gravity", "none");
    assembly.simulation().unwrap()
}

#[test]
fn it_holds_the_values_at_each_multiple_of_its_period() {
    let mut sim = oscillator();
    let mut log = Recording::new(&sim, ["mass.*"], 0.02).unwrap();
    log.run_until(&mut sim, 1).unwrap();
    assert_eq!((log.t().len(), log.names().len(), sim.time()), (51, 3, 1.0));
    assert_eq!((log.unit("mass.displacement"), log.unit("mass.colour")), (Some("m"), None));
    let mut other = oscillator();
    for (k, (t, x)) in log.t().iter().zip(&log["mass.displacement"]).enumerate() {
        assert_eq!(*t, k as f64 / 50.0);
        assert!((x - (10.0 * t).cos()).abs() < 1e-8, "{t} {x}");
        // A run without recorders gives bit-identical results.
        other.run_until(*t).unwrap();
        assert_eq!(other.get("mass.displacement").unwrap(), *x);
        assert_eq!(other.get("mass.speed").unwrap(), log["mass.speed"][k]);
    }
}

#[test]
fn several_calls_give_the_rows_of_one() {
    let (mut whole, mut parts) = (oscillator(), oscillator());
    let mut one = Recording::new(&whole, ["mass.displacement"], "100 Hz").unwrap();
    let mut many = Recording::new(&parts, ["mass.displacement"], "100 Hz").unwrap();
    one.run_until(&mut whole, 0.5).unwrap();
    for t in [0.0, 0.013, 0.02, 0.02, 0.3, 0.5] {
        many.run_until(&mut parts, t).unwrap();
    }
    assert_eq!((one.t(), &one["mass.displacement"]), (many.t(), &many["mass.displacement"]));
    // A recorder that is added in the middle of a run starts at the next multiple of the period.
    let mut late = Recording::new(&parts, ["mass.displacement"], 0.2).unwrap();
    late.run_until(&mut parts, 1.0).unwrap();
    assert_eq!(late.t(), [0.6, 0.8, 1.0]);
}

#[test]
fn what_cannot_be_recorded_is_refused_with_its_place() {
    let sim = oscillator();
    let refused = |channel: &str, period: f64, expected: &str| {
        let line = line!() + 1;
        let text = Recording::new(&sim, [channel], period).err().unwrap().to_string();
        assert!(text.contains(expected) && text.contains("help: "), "{text}");
        assert!(text.contains(&format!("--> {}:{line}:", file!())), "{text}");
    };
    refused("mass.displacment", 0.1, "`mass.displacment` matches no");
    refused("mass.displacement", 0.0, "the period of a recording is zero");
    refused("mass.displacement", -0.1, "-0.1 s is not a time");
    refused("mass.displacement", f64::NAN, "NaN s is not a time");
}

#[test]
fn a_function_at_each_row_sees_all_rows_and_may_end_the_run() {
    let mut sim = oscillator();
    let mut times = Vec::new();
    sim.run_with(0.003, |sim| {
        times.push(sim.time());
        Ok(())
    })
    .unwrap();
    assert_eq!(times, [0.0, 0.001, 0.002, 0.003]);
    let end = |sim: &Simulation| RunError {
        time: sim.time(),
        path: "mass".into(),
        message: "far enough".into(),
        help: None,
    };
    let ended = sim.run_with(1.0, |sim| match sim.get("mass.displacement") {
        Ok(x) if x < 0.5 => Err(end(sim)),
        _ => Ok(()),
    });
    // cos(10 t) decreases below 1/2 at t = π/30 = 0.1047 s.
    assert_eq!(ended.unwrap_err().time, 0.105);
    for (t, expected) in [(-1.0, "-1 s is not a time"), (f64::INFINITY, "inf s is not a time")] {
        let error = sim.run_until(t).unwrap_err().to_string();
        assert!(error.contains(expected) && error.contains("help: "), "{error}");
    }
    assert!(sim.run_until("2 kg").unwrap_err().to_string().contains("2 kg"));
    assert_eq!(sim.time(), 0.105);
    sim.run_until("0.002 min").unwrap();
    assert_eq!(sim.time(), 0.12);
}
