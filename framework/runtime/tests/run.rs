//! Time is exact, bits do not depend on chunks, order or checkpoints; mistakes are reported together.
use crate::common::*;
use linkwork_runtime::*;

/// Every container: sampled, continuous, hybrid rates, stores, noise, sums.
fn zoo() -> Spec {
    spec(
        vec![
            part("a.noise", "t.noise", &[("k", 0.3)], Some("50 Hz")),
            part("a.sum", "t.adder", &[("k", 0.7)], None),
            part("b.int", "t.integrator", &[("k", -0.9)], None),
            part("b.int2", "t.integrator", &[("k", 1.7)], None),
            part("c.hold", "t.hold", &[], Some("30 Hz")),
            part("c.memory", "t.recall", &[], Some("0.1 s")),
            part("d.gain", "t.gain", &[("k", 0.2)], None),
        ],
        &[
            "a.noise.y -> a.sum.u",
            "b.int.y -> a.sum.u",
            "b.int2.y -> d.gain.u",
            "d.gain.y -> a.sum.u",
            "a.sum.y -> b.int.u",
            "b.int.y -> b.int2.u",
            "b.int2.y -> c.hold.u",
            "c.hold.y -> c.memory.u",
            "c.memory.y -> a.sum.u",
        ],
    )
}

#[test]
fn holds_update_exactly_at_their_ticks() {
    let s = spec(
        vec![
            part("tenth", "t.hold", &[], Some("0.1 s")),
            part("third", "t.hold", &[], Some("0.3 s")),
        ],
        &[],
    );
    let mut sim = Simulation::new(plan(&s));
    sim.run_until(seconds(30.0)).unwrap();
    assert_eq!(sim.get("tenth.state.updates").unwrap(), 301.0);
    assert_eq!(sim.get("third.state.updates").unwrap(), 101.0);
    assert_eq!(sim.time(), 30.0);
}

#[test]
fn chunks_forks_and_checkpoints_leave_no_trace() {
    let plan = plan(&zoo());
    let mut whole = Simulation::new(plan.clone());
    whole.run_until(seconds(4.0)).unwrap();
    let mut chunks = Simulation::new(plan.clone());
    for k in 1..=400 {
        chunks.run_until(seconds(k as f64 * 0.01)).unwrap();
    }
    assert_eq!(whole.hash(), chunks.hash());

    let mut half = Simulation::new(plan.clone());
    half.run_until(seconds(1.7)).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("half.lwck");
    half.checkpoint("(here)").unwrap().write(&file).unwrap();
    let mut snapshot = Snapshot::default();
    half.save_into(&mut snapshot);
    let mut forked = half.fork();
    half.run_until(seconds(4.0)).unwrap();
    forked.run_until(seconds(4.0)).unwrap();
    let mut restored = Simulation::new(plan.clone());
    restored.restore(&Checkpoint::read(&file).unwrap()).unwrap();
    restored.run_until(seconds(4.0)).unwrap();
    let mut from_memory = Simulation::new(plan);
    from_memory.load_from(&snapshot).unwrap();
    from_memory.run_until(seconds(4.0)).unwrap();
    for (what, sim) in
        [("half", half), ("fork", forked), ("file", restored), ("memory", from_memory)]
    {
        assert_eq!(sim.hash(), whole.hash(), "{what}");
    }
}

#[test]
fn the_order_of_parts_and_wires_does_not_matter() {
    let mut a = zoo();
    let first = plan(&a);
    a.parts.reverse();
    a.wires.rotate_left(4);
    let second = plan(&a);
    assert_eq!(first.hash(), second.hash());
    let (mut x, mut y) = (Simulation::new(first), Simulation::new(second));
    x.run_until(seconds(2.0)).unwrap();
    y.run_until(seconds(2.0)).unwrap();
    assert_eq!(x.hash(), y.hash());
    let mut b = zoo();
    b.seed += 1;
    let mut z = Simulation::new(plan(&b));
    z.run_until(seconds(2.0)).unwrap();
    assert_ne!(x.hash(), z.hash(), "the seed matters");
}

#[test]
fn damaged_and_foreign_checkpoints_are_refused() {
    let sim = Simulation::new(plan(&zoo()));
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("c.lwck");
    sim.checkpoint("").unwrap().write(&file).unwrap();
    let mut bytes = std::fs::read(&file).unwrap();
    let n = bytes.len();
    bytes[n - 5] ^= 1;
    std::fs::write(&file, &bytes).unwrap();
    assert!(Checkpoint::read(&file).unwrap_err().to_string().contains("damaged"));
    std::fs::write(&file, "hello").unwrap();
    assert!(Checkpoint::read(&file).unwrap_err().to_string().contains("does not begin"));

    let mut other = zoo();
    other.parts[2].path = "b.other".into();
    other.wires.retain(|w| w.from.part != "b.int" && w.to.part != "b.int");
    let mut other = Simulation::new(plan(&other));
    let text = other.restore(&sim.checkpoint("").unwrap()).unwrap_err().to_string();
    assert!(text.contains("b.int.state.x") && text.contains("b.other.state.x"), "{text}");
}

/// A link stays, and its file is written; what is no file is left alone.
#[cfg(unix)]
#[test]
fn a_checkpoint_goes_through_a_link_and_takes_no_folders_place() {
    let checkpoint = Simulation::new(plan(&zoo())).checkpoint("").unwrap();
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    std::fs::write(at("real.lwck"), "before").unwrap();
    std::os::unix::fs::symlink(at("real.lwck"), at("link.lwck")).unwrap();
    checkpoint.write(&at("link.lwck")).unwrap();
    assert!(at("link.lwck").is_symlink());
    assert_eq!(Checkpoint::read(&at("real.lwck")).unwrap().lanes, checkpoint.lanes);
    std::os::unix::fs::symlink(at("nowhere"), at("lost.lwck")).unwrap();
    let told = checkpoint.write(&at("lost.lwck")).unwrap_err().to_string();
    assert!(
        told.contains("a link to a file that does not exist") && at("lost.lwck").is_symlink(),
        "{told}"
    );
    std::fs::create_dir(at("folder")).unwrap();
    for path in [at("folder"), "/dev/null".into()] {
        let told = checkpoint.write(&path).unwrap_err().to_string();
        assert!(told.contains("it is not a regular file"), "{told}");
    }
    assert!(!std::fs::metadata("/dev/null").unwrap().is_file());
}

#[test]
fn special_numbers_survive_a_checkpoint() {
    let mut sim = Simulation::new(plan(&zoo()));
    sim.set("b.int.state.x", -0.0).unwrap();
    let mut c = sim.checkpoint("").unwrap();
    c.lanes[..8].copy_from_slice(&f64::from_bits(0x7ff8_dead_beef_0001).to_le_bytes());
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("nan.lwck");
    c.write(&file).unwrap();
    let back = Checkpoint::read(&file).unwrap();
    assert_eq!(back.lanes, c.lanes);
}

#[test]
fn all_wiring_mistakes_in_one_report() {
    let mut s = spec(
        vec![
            part("gain", "t.gain", &[("kk", 2.0)], None),
            part("gain1", "t.gain", &[("k", f64::NAN)], None),
            part("one", "t.gain", &[], None),
            part("two", "t.gain", &[], None),
            part("volts", "t.volts", &[], None),
            part("lost", "t.bounce", &[], None),
            part("lonely", "t.bounce", &[], None),
            part("hold", "t.hold", &[], None),
            part("int", "t.integrator", &[], Some("5 Hz")),
            part("odd", "t.gian", &[], None),
            part("spring", "t.spring", &[], None),
            part("alone", "t.bounce", &[], None),
        ],
        &[
            "one.y -> two.u",
            "int.y -> two.u",
            "one.y -> volts.volts",
            "onne.y -> one.u",
            "one.yy -> one.u",
            "one.u -> lost.u",
        ],
    );
    s.binds.push(BindSpec {
        part: "gain".into(),
        bind: "shaft".into(),
        target: BindTarget::Node("hub".into()),
        origin: Origin::NONE,
    });
    let text = faults(&s);
    for message in [
        "`gain` has no parameter `kk`\n  help: did you mean `k`?",
        "`gain1.k` is not a number (NaN)",
        "input `two.u` is wired twice; the other wire is `int.y -> two.u`",
        "wire `one.y -> volts.volts`: one.y is in 1, but volts.volts is in V",
        "there is no part `onne`\n  help: did you mean `one`?",
        "`one` has no output `yy`",
        "`u` is an input; a wire runs from an output to an input",
        "required input `lonely.u` is not wired",
        "`hold` (t.hold) is sampled, but has no rate",
        "`int` (t.integrator) is continuous: a rate has no effect on it",
        "there is no model `t.gian`\n  help: did you mean `t.gain`?",
        "`spring`: binding `shaft` is missing",
    ] {
        assert!(text.contains(message), "missing: {message}\nin:\n{text}");
    }
    // A faulty wire is reported once: its end is not reported as unwired as well.
    assert!(!text.contains("`lost.u` is not wired"), "{text}");
}

#[test]
fn one_mistake_is_told_once() {
    let mut s = spec(
        vec![
            part("bad", "t.gain", &[("kk", 2.0)], None),
            part("reader", "t.bounce", &[], None),
            part("g", "t.gravity", &[], None),
        ],
        &["bad.y -> reader.u", "reader.y -> bad.u"],
    );
    s.parts[2].params = Value::Map(vec![("gg".into(), Value::Null.into())]).into();
    let Err(found) = compile(&s, &catalogue(), &Files::default()) else { panic!("compiled") };
    let told: Vec<&str> = found.0.iter().map(|f| f.message.as_str()).collect();
    assert_eq!(told.len(), 2, "{told:#?}");
    assert!(told.iter().all(|t| t.contains("`bad`") || t.contains("`g`")), "{told:#?}");

    let s = spec(vec![part("int", "t.integrator", &[], None)], &["int.y -> int.v"]);
    assert!(faults(&s).contains("`int` has no input `v`"));
}

#[test]
fn loops_are_named_wire_by_wire() {
    let s = spec(
        vec![
            part("a", "t.gain", &[], None),
            part("b", "t.gain", &[], None),
            part("c", "t.integrator", &[], None),
        ],
        &["a.y -> b.u", "b.y -> a.u", "b.y -> c.u"],
    );
    let text = faults(&s);
    assert!(
        text.contains(
            "algebraic loop of feedthrough outputs through a, b: `a.y -> b.u`, `b.y -> a.u`"
        ),
        "{text}"
    );
    assert!(text.contains("help: write `delay: 1`"), "{text}");
}

#[test]
fn a_runaway_names_the_first_bad_variable_and_the_time() {
    let s = spec(
        vec![part("bomb", "t.bounce", &[("k", 1.0)], None), part("g", "t.gain", &[], None)],
        &["bomb.y -> g.u", "g.y -> bomb.u"],
    );
    let mut sim = Simulation::new(plan(&s));
    let error = sim.run_until(seconds(3.0)).unwrap_err();
    assert_eq!(error.path, "bomb.state.x");
    assert!((error.time - 1.0).abs() < 0.01, "{error}");
    assert!(error.to_string().starts_with("t = 1.0"), "{error}");
}

#[test]
fn variables_are_found_set_and_refused() {
    let mut sim = Simulation::new(plan(&zoo()));
    assert!(sim.get("b.int.state.z").unwrap_err().help.contains("b.int.state.x"));
    assert!(sim.set("b.int.y", 1.0).unwrap_err().message.contains("is an output"));
    assert!(sim.set("b.int.u", 1.0).unwrap_err().message.contains("driven by a wire"));
    assert!(sim.set("b.int.state.x", f64::NAN).is_err());
    sim.set("b.int.state.x", 2.0).unwrap();
    assert_eq!(sim.get("b.int.y").unwrap(), 2.0);
}

#[test]
fn sampled_values_are_held_and_listed_as_holds() {
    let plan = plan(&zoo());
    let hold = |from: &str| plan.wires.iter().find(|w| w.from == from).unwrap().hold;
    assert!(hold("a.noise.y"));
    assert!(!hold("b.int.y"));
    // Noise, hold and memory are not evaluated in the stages of the integrator.
    let staged: Vec<Op> = plan.stage_ops.iter().map(|&k| plan.ops[k as usize]).collect();
    let sampled: Vec<u32> =
        (0..plan.parts.len() as u32).filter(|&k| plan.parts[k as usize].rate.is_some()).collect();
    assert_eq!(sampled.len(), 3);
    for op in staged {
        let (Op::Outputs(k) | Op::Feedthrough(k)) = op else { continue };
        assert!(!sampled.contains(&k), "{op:?} is sampled and staged");
    }
}
