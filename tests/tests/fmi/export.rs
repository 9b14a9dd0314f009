//! Simulations as FMUs: exported and imported again, they give the same results.
use super::support::{Bench, Model, compiler, run};
use linkwork_fmi::{Export, export, find_library};
use linkwork_runner::{Library, Ready};
use linkwork_runtime::Simulation;
use std::path::Path;
use std::sync::Arc;

fn library() -> Library {
    linkwork_assemblies::library().with(linkwork_fmi::catalogue())
}

fn load(path: &Path) -> Ready {
    library().file(path, &[], None).map_err(|f| f.render(false)).unwrap()
}

fn what(inputs: &[&str], outputs: &[&str]) -> Export {
    let list = |v: &[&str]| v.iter().map(|s| (*s).to_string()).collect();
    Export {
        name: "exported".into(),
        inputs: list(inputs),
        outputs: list(outputs),
        library: find_library("linkwork-unit").map_err(|f| f.message).unwrap(),
    }
}

/// The ball of the repository, exported and imported, gives bit-identical samples.
#[test]
fn an_exported_simulation_is_itself() {
    let bench = Bench::new();
    let path = linkwork_tests::root().join("sims/bouncing_ball");
    let done = export(load(&path), &what(&[], &[]), &bench.path("ball.fmu")).unwrap();
    assert_eq!(done.inputs, [""; 0]);
    assert!(done.outputs.contains(&"Ball.height".into()), "{done:?}");
    let text = r#"Simulation(
    parts: { "Unit": (model: "fmi.co_simulation", rate: "50 ms", params: { "file": "ball.fmu" }) },
    step: "50 ms", until: "5 s",
)"#;
    let mut unit = bench.sim(text).unwrap();
    let mut native = Simulation::of(Arc::new(load(&path).program));
    for k in 0..=60 {
        let t = f64::from(50 * k) / 1000.0;
        run(&mut unit, t);
        run(&mut native, t);
        for name in ["height", "speed", "impacts"] {
            let (a, b) =
                (unit.get(&format!("Unit.Ball_{name}")), native.get(&format!("Ball.{name}")));
            assert_eq!(a.unwrap(), b.unwrap(), "{name} at {t} s");
        }
    }
    assert_eq!(unit.variable("Unit.Ball_speed").unwrap().unit, "m s^-1");
    assert!(native.get("Ball.impacts").unwrap() > 5.0);
}

/// Inputs arrive, and the FMU's state is its checkpoint, so a run of the importer may be interrupted.
#[test]
fn inputs_arrive_and_state_is_saved() {
    let bench = Bench::new();
    // The inner simulation is a controller with its own samples, whose command is not connected.
    let inner = r#"Simulation(
    parts: {
        "Control": (model: "control.rate_controller", rate: "50 Hz", params: { "kp": 2, "ki": 5, "limit": 10 }),
        "Motor": (model: "basics.lag", params: { "time_constant": "0.3 s" }),
    },
    wires: ["Control.volts -> Motor.u", "Motor.y -> Control.rate"],
    step: "5 ms", integrator: "rk4", until: "1 s",
)"#;
    std::fs::write(bench.path("inner.ron"), inner).unwrap();
    let inner = || load(&bench.path("inner.ron"));
    let done = export(inner(), &what(&[], &["Motor.y"]), &bench.path("motor.fmu")).unwrap();
    assert_eq!(
        (done.inputs, done.outputs),
        (vec!["Control.target".into()], vec!["Motor.y".into()])
    );
    let text = r#"Simulation(
    parts: {
        "Wish": (model: "basics.sine", params: { "amplitude": 3.0, "frequency": "1 Hz", "offset": 1.0 }),
        "Unit": (model: "fmi.co_simulation", rate: "10 ms", params: { "file": "motor.fmu" }),
    },
    wires: ["Wish.y -> Unit.Control_target"], step: "10 ms", until: "2 s",
)"#;
    let mut outer = bench.sim(text).unwrap();
    let mut native = Simulation::of(Arc::new(inner().program));
    for k in 0..100 {
        native.set("Control.target", outer.get("Wish.y").unwrap()).unwrap();
        let t = f64::from(10 * (k + 1)) / 1000.0;
        run(&mut native, t);
        run(&mut outer, t);
        let (a, b) = (outer.get("Unit.Motor_y").unwrap(), native.get("Motor.y").unwrap());
        assert_eq!(a, b, "at {t} s");
    }
    assert!(outer.get("Unit.Motor_y").unwrap().abs() > 0.1);
    // The run is interrupted and resumed.
    let end = outer.hash();
    let mut first = bench.sim(text).unwrap();
    run(&mut first, 0.37);
    let saved = first.checkpoint("").unwrap();
    let mut second = bench.sim(text).unwrap();
    second.restore(&saved).unwrap();
    run(&mut second, 1.0);
    assert_eq!(second.get("Unit.Motor_y").unwrap(), outer.get("Unit.Motor_y").unwrap());
    assert_eq!(second.hash(), end);
    // The communication steps end between the samples of the inner simulation.
    let odd = text
        .replace("rate: \"10 ms\"", "rate: \"7 ms\"")
        .replace("step: \"10 ms\"", "step: \"7 ms\"");
    let told = bench.sim(&odd).err().unwrap();
    assert!(told.contains("not a multiple of the unit's own step 0.005 s"), "{told}");
}

/// `sims/fmu`: the arm and its FMU differ by the delay of a held command, half a communication step.
#[test]
fn the_example_does_what_its_readme_says() {
    let bench = Bench::new();
    let folder = linkwork_tests::root().join("sims/fmu");
    export(load(&folder.join("arm.ron")), &what(&[], &[]), &bench.path("arm.fmu")).unwrap();
    let text = std::fs::read_to_string(folder.join("side_by_side.ron")).unwrap();
    let worst = |rate: &str| {
        let mut sim =
            bench.sim(&text.replace("rate: \"5 ms\"", &format!("rate: \"{rate}\""))).unwrap();
        let mut worst = 0.0f64;
        for k in 1..=500 {
            run(&mut sim, f64::from(20 * k) / 1000.0);
            let apart = sim.get("arm.angle").unwrap() - sim.get("Unit.arm_angle").unwrap();
            worst = if apart.is_nan() { apart } else { worst.max(apart.abs()) };
        }
        worst.to_degrees()
    };
    let apart = ["20 ms", "10 ms", "5 ms"].map(worst);
    println!("{apart:?} deg");
    assert!(
        (apart[0] / apart[1] - 2.0).abs() < 0.05 && (apart[1] / apart[2] - 2.0).abs() < 0.05,
        "{apart:?}"
    );
    assert!((0.2..0.3).contains(&apart[2]), "{apart:?}");
}

#[test]
fn what_cannot_be_exported_is_refused() {
    let bench = Bench::new();
    let path = linkwork_tests::root().join("sims/bouncing_ball");
    let refused = |what: Export, phrases: &[&str]| {
        let told = export(load(&path), &what, &bench.path("x.fmu")).unwrap_err().render(false);
        for phrase in phrases {
            assert!(told.contains(phrase), "{phrase:?} is not in\n{told}");
        }
        assert!(!bench.path("x.fmu").exists() && !bench.path("x.fmu.part").exists());
    };
    refused(what(&["Ball.height"], &[]), &["`Ball.height` matches", "unconnected inputs"]);
    refused(what(&[], &["Ball.hight"]), &["`Ball.hight` matches", "Ball.height"]);
    let lost = Export { library: "nowhere.so".into(), ..what(&[], &[]) };
    refused(lost, &["`nowhere.so` cannot be read", "--library"]);
    let missing = find_library("no-such-package").unwrap_err();
    assert!(missing.help.unwrap().contains("cargo build --release -p no-such-package"));
    // An FMU cannot contain the files of its parts.
    if compiler() {
        bench.unit("spring.fmu", 3, Model::Spring, |t| t);
        let text = r#"Simulation(
    parts: { "Unit": (model: "fmi.model_exchange", params: { "file": "spring.fmu" }) },
    step: "5 ms", until: "1 s",
)"#;
        std::fs::write(bench.path("nested.ron"), text).unwrap();
        let nested = load(&bench.path("nested.ron"));
        let told = export(nested, &what(&[], &[]), &bench.path("x.fmu")).unwrap_err().render(false);
        assert!(told.contains("reads `spring.fmu`, which a unit cannot contain"), "{told}");
    }
}
