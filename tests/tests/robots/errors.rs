//! The task simulations with noise in measurements and errors in the controllers' models: small ones must not cause failure, and with too large ones
//! the run must report that the task failed.
//!
//! `noise`, `believed`, `mass_believed` are parameters with these names in all of them (`noise` of the work's position in m, of the attitude of fixed
//! objects in rad).

use crate::common;
use linkwork_assembly::{Options, load_file};

const TASKS: [&str; 8] = [
    "key_and_door",
    "tyre_change",
    "drill",
    "hang_up_phone",
    "cut_wire",
    "push_button",
    "dual_arm_carry",
    "legged_stand",
];

/// Success as reported, and all metrics.
fn run(task: &str, set: &[&str]) -> bool {
    let metrics = common::metrics(task, set).unwrap_or_else(|e| panic!("{task} {set:?}: {e}"));
    println!("{task} {set:?}: {metrics:#.3?}");
    metrics["success"] > 0.5
}

/// A condition counts as 1 while it holds: at the end, ever, always, or as a fraction of time. In a phase that lacks any of its variables it does not
/// hold.
#[test]
fn a_condition_is_a_metric() {
    let text = |when: &str| {
        let takes = ["last", "max", "min", "mean"];
        let metrics = takes.map(|t| format!(r#""{t}": (when: "{when}", take: "{t}")"#)).join(", ");
        format!(
            r#"Simulation(
                bodies: {{ "post": (parent: "world", hinge: Pin([0, 0, 1]), mass: 1, inertia: [1, 1, 1]), "disc": (parent: "world", hinge: Pin([0, 0, 1]), mass: 1, inertia: [1, 1, 1], initial: (rate: 1)) }},
                step: "1 ms", until: "1 s", start: "first", metrics: {{ {metrics} }},
                phases: {{ "first": (to: {{ "second": "disc.angle > 0.75 rad" }}),
                    "second": (remove: ["disc"]) }},
            )"#
        )
    };
    let of = |when: &str| {
        let f = common::metrics_of(&text(when)).unwrap_or_else(|e| panic!("{e}"));
        ["last", "max", "min", "mean"].map(|t| f[t])
    };
    let [last, max, min, mean] = of("time > 0.4 s");
    assert_eq!([last, max, min], [1.0, 1.0, 0.0]);
    assert!((mean - 0.6).abs() < 2e-3, "{mean}");
    let [last, max, min, mean] = of("disc.angle > 0.5 rad");
    assert_eq!([last, max, min], [0.0, 1.0, 0.0]);
    assert!((mean - 0.25).abs() < 3e-3, "{mean}");
    let lost = common::metrics_of(&text("disc.angel > 0.5 rad")).unwrap_err();
    assert!(lost.contains("metric `last`") && lost.contains("disc.angle"), "{lost}");
    let still = common::metrics_of(&text("2 > 1")).unwrap_err();
    assert!(still.contains("its value never changes"), "{still}");
}

#[test]
fn every_task_has_noise_and_model_error_as_parameters_and_tells_success() {
    let catalogue = common::catalogue();
    let mut options = Options::new(&catalogue);
    options.embedded = linkwork_assemblies::embedded();
    for task in TASKS {
        let folder = linkwork_tests::root().join("sims").join(task);
        let mut said = Vec::new();
        for set in ["noise=-1", "mass_believed=-1", "mass=-1"] {
            options.overrides = vec![set.into()];
            // The values are outside their ranges, so an error shows that the parameters exist.
            let refused = load_file(folder.join("sim.ron"), &options).err();
            said.push(refused.unwrap_or_else(|| panic!("{task} takes {set}")).render(false));
        }
        for (said, name) in said.iter().zip(["noise", "mass_believed", "mass"]) {
            assert!(said.contains(name) && !said.contains("there is no"), "{task}: {said}");
        }
        options.overrides.clear();
        let loaded = load_file(folder.join("sim.ron"), &options).map_err(|e| e.render(false));
        let metrics = loaded.unwrap().simulation.metrics;
        assert!(metrics.iter().any(|f| f.name == "success"), "{task} tells no success");
        let page = std::fs::read_to_string(folder.join("README.md")).unwrap();
        let words = ["`noise`", "`mass_believed`", "`success`"];
        assert!(words.iter().all(|w| page.contains(w)), "{task}: {words:?} are not in its page");
    }
}

#[test]
fn a_button_is_pressed_with_noise_and_not_where_none_is() {
    assert!(run("push_button", &["noise=2 mm", "mass_believed=0.12"]));
    assert!(!run("push_button", &["believed=[0.55, 0.22, 0.45]"]));
    assert!(!run("push_button", &["mass_believed=8"]));
}

#[test]
fn a_hole_is_drilled_with_noise_and_one_beside_is_told() {
    assert!(run("drill", &["noise=0.5 mm", "mass_believed=2.2"]));
    assert!(!run("drill", &["believed=[0.6, 0.105, 0.4]"]));
    assert!(!run("drill", &["mass_believed=12"]));
}

#[test]
fn a_handset_is_hung_up_with_noise_and_one_that_drops_is_told() {
    assert!(run("hang_up_phone", &["noise=1 mm", "mass_believed=0.3"]));
    assert!(!run("hang_up_phone", &["believed=[0.5, 0.45, 0.2]"]));
    assert!(!run("hang_up_phone", &["mass_believed=8"]));
}

#[test]
fn a_door_is_opened_with_noise_and_not_where_the_key_misses_the_lock() {
    assert!(run("key_and_door", &["noise=0.5 mm", "mass_believed=0.1"]));
    assert!(!run("key_and_door", &["believed=[0.6, 0.055, 0.4]"]));
    assert!(!run("key_and_door", &["mass_believed=8"]));
}

#[test]
fn a_wire_is_cut_with_noise_and_not_where_the_jaw_misses_it() {
    assert!(run("cut_wire", &["noise=1 mm", "mass_believed=0.95"]));
    assert!(!run("cut_wire", &["believed=[0.53, 0.1, 0.3]"]));
    assert!(!run("cut_wire", &["mass_believed=8"]));
}

#[test]
fn a_beam_is_carried_with_noise_and_not_by_palms_that_miss_it() {
    assert!(run("dual_arm_carry", &["noise=1 mm", "mass_believed=7.5"]));
    assert!(!run("dual_arm_carry", &["believed=[0.5, 0.03, 0.2]"]));
    assert!(!run("dual_arm_carry", &["mass_believed=1"]));
}

#[test]
fn a_wheel_is_changed_with_noise_and_nuts_beside_their_studs_are_told() {
    assert!(run("tyre_change", &["noise=0.5 mm", "mass_believed=6.8"]));
    assert!(!run("tyre_change", &["believed=[0.55, 0.006, 0.38]"]));
}

#[test]
fn a_quadruped_stands_with_noise_and_says_when_it_falls() {
    assert!(run("legged_stand", &["noise=4e-3", "mass_believed=1.0"]));
    assert!(!run("legged_stand", &["noise=0.3"]));
    assert!(!run("legged_stand", &["mass_believed=6"]));
}
