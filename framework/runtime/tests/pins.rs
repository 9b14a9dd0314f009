//! Pins: every reader sees them at every stage, they are part of the state, and what cannot be pinned is refused.
use crate::common::*;
use linkwork_runtime::*;
use std::sync::Arc;

/// x″ = −x as two integrators, a reader of x, a sum, and sampled parts.
fn swing(method: Integrator) -> Spec {
    let mut s = spec(
        vec![
            part("x", "t.integrator", &[("k", 1.0)], None),
            part("v", "t.integrator", &[("k", -1.0)], None),
            part("reader", "t.integrator", &[("k", 2.0)], None),
            part("gain", "t.gain", &[("k", 3.0)], None),
            part("sum", "t.adder", &[("k", 1.0)], None),
            part("total", "t.integrator", &[("k", 1.0)], None),
            part("hold", "t.hold", &[], Some("0.1 s")),
            part("slow", "t.sampled", &[("k", 5.0)], Some("0.1 s")),
            part("noise", "t.noise", &[("k", 0.3)], Some("50 Hz")),
        ],
        &[
            "v.y -> x.u",
            "x.y -> v.u",
            "x.y -> reader.u",
            "x.y -> gain.u",
            "gain.y -> sum.u",
            "slow.y -> sum.u",
            "sum.y -> total.u",
            "v.y -> hold.u",
            "x.y -> slow.u",
        ],
    );
    s.integrator = method;
    s
}

fn begun(method: Integrator) -> Simulation {
    let mut sim = Simulation::new(plan(&swing(method)));
    sim.set("x.state.x", 1.0).unwrap();
    sim.run_until(seconds(0.5)).unwrap();
    sim
}

fn close(a: f64, b: f64) {
    assert!((a - b).abs() < 1e-12 * (1.0 + b.abs()), "{a} against {b}");
}

#[test]
fn a_pinned_state_stands_still_at_every_stage_of_every_method() {
    for (_, method) in Integrator::ALL {
        let mut sim = begun(method);
        let (v, reader) = (sim.get("v.state.x").unwrap(), sim.get("reader.state.x").unwrap());
        sim.pin("x.state.x", 0.25).unwrap();
        sim.run_until(seconds(1.5)).unwrap();
        assert_eq!(sim.get("x.state.x").unwrap().to_bits(), 0.25f64.to_bits(), "{method:?}");
        // While x is pinned, the states that it drives integrate a constant.
        close(sim.get("v.state.x").unwrap(), v - 0.25);
        close(sim.get("reader.state.x").unwrap(), reader + 2.0 * 0.25);
        // The variable continues from there after its release.
        let (x, v) = (0.25, sim.get("v.state.x").unwrap());
        sim.unpin("x.state.x").unwrap();
        sim.run_until(seconds(1.51)).unwrap();
        let moved = sim.get("x.state.x").unwrap() - x;
        assert!((moved - 0.01 * v).abs() < 1e-4, "{method:?}: {moved}");
    }
}

#[test]
fn a_pinned_output_and_sum_are_what_every_reader_sees() {
    for (_, method) in Integrator::ALL {
        let mut sim = begun(method);
        let v = sim.get("v.state.x").unwrap();
        sim.pin("x.y", -0.5).unwrap();
        assert_eq!(sim.get("gain.y").unwrap(), -1.5, "at once");
        sim.run_until(seconds(1.5)).unwrap();
        close(sim.get("v.state.x").unwrap(), v + 0.5);
        assert_ne!(sim.get("x.state.x").unwrap(), -0.5, "the state behind it goes on");
        // The inputs that are wired to the pinned output have its value.
        assert_eq!(sim.get("gain.u").unwrap(), -0.5);
        // A sampled reader sees it at its samples.
        assert_eq!(sim.get("slow.y").unwrap(), -2.5);
        sim.unpin("x.y").unwrap();
        assert_eq!(sim.get("x.y").unwrap(), sim.get("x.state.x").unwrap());
        let total = sim.get("total.state.x").unwrap();
        sim.pin("sum.u", 7.0).unwrap();
        sim.run_until(seconds(2.5)).unwrap();
        close(sim.get("total.state.x").unwrap(), total + 7.0);
    }
}

#[test]
fn what_is_sampled_stays_pinned_between_and_at_its_samples() {
    let mut sim = begun(Integrator::Rk4);
    let updates = sim.get("hold.state.updates").unwrap();
    sim.pin("hold.state.held", 9.0).unwrap();
    sim.pin("slow.y", 1.0).unwrap();
    sim.pin("noise.y", 0.0).unwrap();
    assert_ne!(
        sim.get("hold.y").unwrap(),
        9.0,
        "what a sampled part makes of it comes at its next sample"
    );
    sim.run_until(seconds(0.6)).unwrap();
    for k in 11..=110 {
        sim.run_until(seconds(0.5 + 0.01 * f64::from(k))).unwrap();
        let now = ["hold.state.held", "hold.y", "slow.y", "noise.y"].map(|p| sim.get(p).unwrap());
        assert_eq!(now, [9.0, 9.0, 1.0, 0.0], "step {k}");
    }
    assert_eq!(sim.get("hold.state.updates").unwrap(), updates + 11.0, "its other state goes on");
    // After its release, a sampled output keeps its value until its next sample.
    sim.unpin("slow.y").unwrap();
    assert_eq!(sim.get("slow.y").unwrap(), 1.0);
    sim.run_until(seconds(1.7)).unwrap();
    close(sim.get("slow.y").unwrap(), 5.0 * sim.get("x.y").unwrap());
}

#[test]
fn pins_are_state_and_cuts_leave_no_trace() {
    for method in [Integrator::Rk4, Integrator::DormandPrince, Integrator::Rodas] {
        let pinned = || {
            let mut sim = begun(method);
            for (path, value) in
                [("x.y", 0.1), ("v.state.x", 0.3), ("hold.state.held", 2.0), ("sum.u", 1.0 / 3.0)]
            {
                sim.pin(path, value).unwrap();
            }
            sim
        };
        let mut whole = pinned();
        whole.run_until(seconds(3.0)).unwrap();
        let mut half = pinned();
        for k in 51..=170 {
            half.run_until(seconds(0.01 * f64::from(k))).unwrap();
        }
        let saved = half.checkpoint("").unwrap();
        let saved = Checkpoint::from_bytes(&saved.to_bytes().unwrap()).unwrap();
        let mut snapshot = Snapshot::default();
        half.save_into(&mut snapshot);
        let mut restored = Simulation::new(half.plan().clone());
        restored.pin("gain.y", 1.0).unwrap(); // Restoring removes this pin.
        restored.restore(&saved).unwrap();
        assert_eq!(restored.pins().count(), 4);
        let mut loaded = Simulation::new(half.plan().clone());
        loaded.load_from(&snapshot).unwrap();
        let mut forked = half.fork();
        for sim in [&mut half, &mut restored, &mut loaded, &mut forked] {
            sim.run_until(seconds(3.0)).unwrap();
            assert_eq!(sim.hash(), whole.hash(), "{method:?}");
        }
        // The hash includes the pins, because runs with equal values and different pins continue
        // differently.
        let mut free = whole.fork();
        for path in ["x.y", "v.state.x", "hold.state.held", "sum.u"] {
            free.unpin(path).unwrap();
        }
        free.pin("sum.u", 1.0 / 3.0).unwrap();
        assert_ne!(free.hash(), whole.hash());
    }
}

#[test]
fn a_pin_that_is_taken_back_at_once_leaves_no_trace() {
    let (mut touched, mut never) = (begun(Integrator::Rk4), begun(Integrator::Rk4));
    touched.pin("x.y", 4.0).unwrap();
    touched.pin("x.y", 5.0).unwrap();
    touched.unpin("x.y").unwrap();
    assert_eq!(touched.pins().count(), 0);
    for sim in [&mut touched, &mut never] {
        sim.run_until(seconds(2.0)).unwrap();
    }
    assert_eq!(touched.hash(), never.hash());
}

#[test]
fn what_cannot_be_pinned_is_refused_and_changes_nothing() {
    let mut sim = begun(Integrator::Rk4);
    let before = sim.hash();
    let mut no = |path: &str, value: f64, fact: &str, help: &str| {
        let e = sim.pin(path, value).unwrap_err();
        assert!(e.message.contains(fact) && e.help.contains(help), "{e}");
        assert_eq!((sim.hash(), sim.pins().count()), (before, 0));
    };
    no("gain.u", 1.0, "it only reads `x.y`", "pin `x.y`");
    no("total.u", 1.0, "it only reads `sum.y`", "pin `sum.y`");
    no("x.z", 1.0, "no variable `x.z`", "x.y");
    no("x.y", f64::NAN, "NaN", "finite");
    no("x.y", f64::INFINITY, "inf", "finite");
    let e = sim.unpin("x.y").unwrap_err();
    assert!(e.message.contains("is not pinned") && e.help == "nothing is", "{e}");
    sim.pin("x.state.x", 1.0).unwrap();
    let e = sim.set("x.state.x", 2.0).unwrap_err();
    assert!(e.message.contains("pinned to 1") && e.help.contains("unpin"), "{e}");
    let e = sim.unpin("x.y").unwrap_err();
    assert!(e.help.contains("x.state.x"), "{e}");
    // Either all changes are applied or none.
    let hash = sim.hash();
    let all = [("v.state.x".to_string(), 3.0), ("gain.u".to_string(), 3.0)];
    for change in [Change::Pin, Change::Set] {
        sim.change_all(change, &all).unwrap_err();
        assert_eq!(sim.hash(), hash, "{change:?}");
    }
    // `gain.u` cannot be pinned, so a checkpoint with this pin is rejected.
    let mut saved = sim.checkpoint("").unwrap();
    saved.pins.insert("gain.u".into(), 1.0);
    let e = sim.restore(&saved).unwrap_err().to_string();
    assert!(e.contains("the pin of `gain.u`"), "{e}");
}

#[test]
fn a_number_inside_a_solved_loop_is_not_pinned() {
    let mut s = spec(
        vec![
            part("a", "t.gain", &[("k", 0.5)], None),
            part("b", "t.adder", &[("k", 1.0)], None),
            part("x", "t.integrator", &[("k", 1.0)], None),
        ],
        &["b.y -> a.u", "x.y -> b.u", "b.y -> x.u"],
    );
    s.wires.push(WireSpec { timing: WireTiming::Solved { tolerance: 1e-9 }, ..wire("a.y -> b.u") });
    let mut sim = Simulation::new(plan(&s));
    for path in ["a.y", "b.y"] {
        let e = sim.pin(path, 1.0).unwrap_err();
        assert!(e.message.contains("algebraic loop"), "{e}");
    }
    sim.pin("x.y", 1.0).unwrap();
    sim.run_until(seconds(1.0)).unwrap();
    // The loop has the solution b = x + b/2.
    assert!((sim.get("b.y").unwrap() - 2.0).abs() < 1e-6);
}

/// Two phases: the second has not `gain`, and drives `free.u` by a wire.
fn phases() -> Arc<Program> {
    let both = || {
        vec![
            part("x", "t.integrator", &[("k", 1.0)], None),
            part("free", "t.integrator", &[("k", 1.0)], None),
            part("slow", "t.sampled", &[("k", 5.0)], Some("0.1 s")),
        ]
    };
    let phase = |name: &str, spec: Spec, to: &[(&str, &str)]| PhaseSpec {
        name: name.into(),
        spec,
        transitions: to
            .iter()
            .map(|(to, when)| TransitionSpec {
                to: (*to).into(),
                when: (*when).into(),
                origin: Origin::NONE,
            })
            .collect(),
        watches: Vec::new(),
        origin: Origin::NONE,
    };
    let mut first = both();
    first.push(part("gain", "t.gain", &[("k", 3.0)], None));
    let first = spec(first, &["x.y -> gain.u", "x.y -> slow.u"]);
    let second = spec(both(), &["x.y -> free.u", "x.y -> slow.u"]);
    let phases = [phase("a", first, &[("b", "time > 1.005 s")]), phase("b", second, &[])];
    Arc::new(
        compile_program(&phases, &catalogue(), &Files::default()).unwrap_or_else(|e| panic!("{e}")),
    )
}

#[test]
fn pins_go_over_to_a_phase_that_has_the_variable_and_others_are_told() {
    let program = phases();
    let begin = || {
        let mut sim = Simulation::of(program.clone());
        for (path, value) in
            [("x.state.x", 2.0), ("gain.y", 1.0), ("free.u", 5.0), ("slow.y", -1.0)]
        {
            sim.pin(path, value).unwrap();
        }
        sim
    };
    let mut sim = begin();
    sim.run_until(seconds(1.0)).unwrap();
    assert_eq!(sim.get("free.state.x").unwrap().round(), 5.0);
    sim.run_until(seconds(2.0)).unwrap();
    assert_eq!(sim.phase(), "b");
    let left: Vec<(&str, f64)> = sim.pins().collect();
    assert_eq!(left, [("slow.y", -1.0), ("x.state.x", 2.0)]);
    assert_eq!([sim.get("slow.y").unwrap(), sim.get("x.y").unwrap()], [-1.0, 2.0]);
    let moves = sim.take_moves();
    let told = &moves[0].2.unpinned;
    assert!(told[0].0 == "free.u" && told[0].1.contains("it only reads `x.y`"), "{told:?}");
    assert!(told[1].0 == "gain.y" && told[1].1.contains("does not exist"), "{told:?}");
    assert_eq!(told.len(), 2);
    // Continue from a checkpoint that was saved in either phase.
    for cut in [0.5, 1.0, 1.01, 1.5] {
        let mut part = begin();
        part.run_until(seconds(cut)).unwrap();
        let saved = part.checkpoint("").unwrap();
        let mut rest = Simulation::of(program.clone());
        rest.restore(&saved).unwrap();
        rest.run_until(seconds(2.0)).unwrap();
        assert_eq!(rest.hash(), sim.hash(), "{cut}");
    }
    let e = sim.pin("gain.y", 1.0).unwrap_err();
    assert!(e.message.contains("does not exist in phase `b`"), "{e}");
}

/// A pattern is one build and one evaluation, and all or nothing.
#[test]
fn many_are_pinned_at_once_or_not_at_all() {
    let mut sim = begun(Integrator::Rk4);
    let all: Vec<(String, f64)> =
        [("gain.y", 4.0), ("slow.y", -1.0), ("x.state.x", 2.0)].map(|(p, y)| (p.into(), y)).into();
    sim.change_all(Change::Pin, &all).unwrap();
    let pinned: Vec<(String, f64)> = sim.pins().map(|(p, y)| (p.to_string(), y)).collect();
    assert_eq!(pinned, all);
    assert_eq!([sim.get("sum.y").unwrap(), sim.get("x.y").unwrap()], [3.0, 2.0]);
    let hash = sim.hash();
    for (change, bad) in [
        (Change::Pin, [("v.state.x", 1.0), ("gain.u", 1.0)]),
        (Change::Pin, [("v.state.x", 1.0), ("reader.state.x", f64::NAN)]),
        (Change::Unpin, [("gain.y", 0.0), ("v.state.x", 0.0)]),
        (Change::Set, [("v.state.x", 1.0), ("x.state.x", 1.0)]),
    ] {
        let bad: Vec<(String, f64)> = bad.map(|(p, y)| (p.into(), y)).into();
        assert!(sim.change_all(change, &bad).is_err(), "{bad:?}");
        assert_eq!(sim.hash(), hash, "{bad:?}");
    }
    sim.change_all(Change::Unpin, &all[..2]).unwrap();
    assert_eq!(sim.pins().collect::<Vec<_>>(), [("x.state.x", 2.0)]);
}
