//! `linkwork fork`: contents of a checkpoint are transferred by path; the log of a fork is reproduced bit for bit; forks that would lose data are
//! rejected.
use crate::common;
use common::{BASE, Lab, edited, names};
use linkwork_record::{Series, read_log};

/// The base, with a checkpoint at 0.5 s.
fn lab() -> Lab {
    let lab = Lab::new();
    lab.write("sim.ron", BASE);
    lab.run("sim.ron", "whole", &["--checkpoint-every", "0.5s"]).code(0);
    lab
}

const FROM: &str = "whole/checkpoint_0.5.lwck";

fn fork(lab: &Lab, out: &str, more: &[&str]) -> common::Said {
    let head = ["fork", FROM, "--out", out, "--save-rrd", "off"];
    lab.linkwork(&[&head[..], more].concat())
}

fn series(lab: &Lab, out: &str, name: &str) -> Series {
    read_log(&lab.path(out).join("run.mcap")).unwrap().remove(name).unwrap()
}

#[test]
fn a_fork_that_changes_nothing_is_the_run() {
    let lab = lab();
    fork(&lab, "same", &["--set", "Friction.damping=0.05"]).code(0).tells(&["parts continue"]);
    assert_eq!(lab.hash("same"), lab.hash("whole"));
    lab.linkwork(&["diff", "whole/run.mcap", "same/run.mcap", "--common"]).code(0);
}

#[test]
fn a_changed_parameter_acts_from_the_checkpoint_on_as_in_a_phase() {
    let lab = lab();
    fork(&lab, "fork", &["--set", "Friction.damping=0.8"]).code(0);
    // The result equals a change of phase in one run.
    let phases = "phases: { \"a\": (to: { \"b\": \"time > 0.5 s\" }), \
                  \"b\": (parts: { \"Friction\": (params: { \"damping\": 0.8 }) }) },\n    start: \"a\", until: \"1 s\"";
    lab.write("phases.ron", &edited(&[("until: \"1 s\"", phases)]));
    lab.run("phases.ron", "phases", &[]).code(0);
    let (forked, wanted) = (series(&lab, "fork", "bob.angle"), series(&lab, "phases", "bob.angle"));
    let was = series(&lab, "whole", "bob.angle");
    let n = forked.t.len();
    assert!(n == 50 && forked.t[0] > 0.5 && forked.t[49] == 1.0, "{:?}", forked.t);
    for k in 0..n {
        assert_eq!(forked.t[k], wanted.t[51 + k]);
        let d = (forked.y[k] - wanted.y[51 + k]).abs();
        assert!(d < 1e-9, "{d:e} at {} s", forked.t[k]);
    }
    assert!((forked.y[n - 1] - was.y[100]).abs() > 1e-2, "the change does not act");
}

#[test]
fn the_log_of_a_fork_is_verified_and_its_checkpoints_go_on() {
    let lab = lab();
    let args = ["--set", "Friction.damping=0.8", "--checkpoint-every", "0.25s"];
    fork(&lab, "fork", &args).code(0);
    let said = lab.linkwork(&["replay", "fork/run.mcap", "--verify"]).code(0);
    assert!(said.out.starts_with("verified: "), "{}", said.out);
    lab.resume("fork/checkpoint_0.75.lwck", "rest", &[]).code(0);
    assert_eq!(lab.hash("rest"), lab.hash("fork"));
    lab.linkwork(&["diff", "rest/run.mcap", "fork/run.mcap", "--common"]).code(0);
}

#[test]
fn a_fork_goes_on_in_its_phase() {
    let lab = Lab::new();
    let staging = common::sim("staging");
    let args = ["--until", "12s", "--checkpoint-every", "8s"];
    lab.run(&staging, "whole", &args).code(0);
    let args = ["fork", "whole/checkpoint_8.lwck", "--save-rrd", "off", "--until", "12s", "--out"];
    lab.linkwork(&[&args[..], &["same", "--set", "until=13"]].concat()).code(0);
    assert_eq!(lab.hash("same"), lab.hash("whole"));
    lab.linkwork(&["replay", "same/run.mcap", "--verify"]).code(0);
}

#[test]
fn what_would_be_lost_is_refused_unless_it_is_allowed() {
    let lab = lab();
    let no_lag = edited(&[
        (
            "        \"Lag\": (model: \"basics.lag\", params: { \"time_constant\": \"1 s\" }),\n",
            "        \"Other\": (model: \"basics.gain\", params: { \"k\": 2 }),\n",
        ),
        ("\"Gain.y -> Lag.u\"", "\"Gain.y -> Other.u\""),
    ]);
    lab.write("no_lag.ron", &no_lag);
    fork(&lab, "fork", &["--sim", "no_lag.ron"]).code(2).tells(&[
        "new parts: Other",
        "parts gone: Lag",
        "would lose",
        "--allow",
    ]);
    assert!(!lab.path("fork").exists(), "something was written");
    fork(&lab, "fork", &["--sim", "no_lag.ron", "--allow"]).code(0).tells(&["parts gone: Lag"]);
    // The pendulum continues.
    assert_eq!(series(&lab, "fork", "bob.angle"), {
        let was = series(&lab, "whole", "bob.angle");
        Series { t: was.t[51..].to_vec(), y: was.y[51..].to_vec(), ..was }
    });
    // The simulation has a part of another kind at the same path, and then a body with another
    // name.
    let other = (
        "\"Lag\": (model: \"basics.lag\", params: { \"time_constant\": \"1 s\" })",
        "\"Lag\": (model: \"basics.gain\", params: { \"k\": 1 })",
    );
    lab.write("other.ron", &edited(&[other]));
    fork(&lab, "x", &["--sim", "other.ron"])
        .code(2)
        .tells(&["another kind, which start anew: Lag", "--allow"]);
    lab.write("body.ron", &BASE.replace("bob", "bib"));
    fork(&lab, "x", &["--sim", "body.ron"]).code(2).tells(&["bodies gone: bob", "--allow"]);
    assert!(!lab.path("x").exists());
}

#[test]
fn what_is_no_change_or_no_checkpoint_is_refused() {
    let lab = lab();
    fork(&lab, "x", &[]).code(2).tells(&["nothing changes", "--set"]);
    fork(&lab, "x", &["--set", "Friction.dumping=1"]).code(2).tells(&["damping"]);
    fork(&lab, "x", &["--set", "Friction.damping=1", "--until", "0.2s"])
        .code(2)
        .tells(&["after the end"]);
    // The checkpoint contains the result of a parameter, not the parameter itself: the error explains where to set it.
    let remark = ["this text is resolved", "`linkwork fork CHECKPOINT --sim SIM --set PATH=VALUE`"];
    fork(&lab, "x", &["--set", "speed=2"]).code(2).tells(&remark);
    fork(&lab, "x", &["--set", "Nested.speed=2"]).code(2).tells(&remark);
    let said = fork(&lab, "x", &["--set", "Friction.dumping=1"]);
    assert!(!said.err.contains(remark[0]), "a parameter of a model: {}", said.err);
    lab.write("no.lwck", "nothing");
    lab.linkwork(&["fork", "no.lwck", "--set", "a=1"]).code(2).tells(&["no.lwck", "help: "]);
    assert!(!names(&lab.path("")).contains(&"x".to_string()));
}
