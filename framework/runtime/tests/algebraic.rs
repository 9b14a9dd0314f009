//! Loops of direct outputs: broken by a delay on a wire, or solved.
use crate::common::*;
use linkwork_runtime::*;

fn solved(text: &str) -> WireSpec {
    WireSpec { timing: WireTiming::Solved { tolerance: 1e-12 }, ..wire(text) }
}

fn delayed(text: &str, samples: u32, initial: &[f64]) -> WireSpec {
    let timing = WireTiming::Delayed { samples, initial: initial.to_vec() };
    WireSpec { timing, ..wire(text) }
}

fn with(parts: Vec<PartSpec>, wires: &[&str], more: Vec<WireSpec>) -> Spec {
    let mut s = spec(parts, wires);
    s.wires.extend(more);
    s
}

/// a = ½ (t + b), b = 0.6 a: a = ½ t/0.7; c integrates a.
fn linear() -> Spec {
    with(
        vec![
            part("time", "t.integrator", &[], None),
            part("a", "t.adder", &[("k", 0.5)], None),
            part("b", "t.gain", &[("k", 0.6)], None),
            part("c", "t.integrator", &[], None),
        ],
        &["time.y -> a.u", "a.y -> b.u", "a.y -> c.u"],
        vec![solved("b.y -> a.u")],
    )
}

#[test]
fn a_linear_loop_takes_two_steps_at_most_and_keeps_the_order_of_the_integrator() {
    for integrator in Integrator::ALL.map(|(_, i)| i) {
        let mut s = linear();
        (s.integrator, s.step) = (integrator, seconds(0.01));
        let mut sim = Simulation::new(plan(&s));
        sim.run_until(seconds(1.0)).unwrap();
        let a = sim.get("a.y").unwrap();
        assert!((a - 0.5 / 0.7).abs() < 1e-10, "{integrator:?} {a}");
        assert!(sim.get("a.u.solve.iterations").unwrap() <= 2.0);
        assert!(sim.get("a.u.solve.residual").unwrap() <= 1.0);
        // The solution is ∫ a = t²/2.8. Euler has first order; the stiff method differentiates
        // through the loop.
        let bound = match integrator {
            Integrator::SemiImplicitEuler => 1e-2,
            Integrator::Rodas => 1e-7,
            _ => 1e-9,
        };
        let c = sim.get("c.y").unwrap();
        assert!((c - 1.0 / 2.8).abs() < bound, "{integrator:?} {c}");
    }
}

#[test]
fn a_nonlinear_loop_is_solved_and_cuts_leave_no_trace() {
    // The system has the loop y = cos(y + t/10), and two loops that meet.
    let s = with(
        vec![
            part("time", "t.integrator", &[("k", 0.1)], None),
            part("sum", "t.adder", &[], None),
            part("cos", "t.cosine", &[], None),
            part("p", "t.adder", &[("k", 0.3)], None),
            part("q", "t.cosine", &[], None),
        ],
        &["time.y -> sum.u", "sum.y -> cos.u", "p.y -> q.u", "q.y -> sum.u"],
        vec![solved("cos.y -> sum.u"), solved("q.y -> p.u"), solved("cos.y -> p.u")],
    );
    let plan = plan(&s);
    assert_eq!((plan.loops.len(), plan.loops[0].tears.len()), (1, 3));
    let mut straight = Simulation::new(plan.clone());
    straight.run_until(seconds(3.0)).unwrap();
    let get = |path: &str| straight.get(path).unwrap();
    let (y, q) = (get("cos.y"), get("q.y"));
    assert!((y - (y + q + 0.3).cos()).abs() < 1e-11, "{y}");
    assert!((q - (0.3 * (q + y)).cos()).abs() < 1e-11, "{q}");
    let mut sim = Simulation::new(plan.clone());
    for k in 1..=30 {
        sim.run_until(seconds(0.1 * f64::from(k))).unwrap();
        let bytes = sim.checkpoint("").unwrap();
        sim = Simulation::new(plan.clone());
        sim.restore(&bytes).unwrap();
        if k % 3 == 0 {
            sim = sim.fork();
        }
    }
    assert_eq!(sim.state(), straight.state());
}

#[test]
fn a_loop_without_a_solution_stops_the_run_with_its_wires() {
    let s = with(
        vec![part("sq", "t.square", &[], None), part("g", "t.gain", &[], None)],
        &["sq.y -> g.u"],
        vec![solved("g.y -> sq.u")],
    );
    let mut sim = Simulation::new(plan(&s));
    let error = sim.step().unwrap_err().to_string();
    for part in ["`g.y -> sq.u`", "no solution", "help:", "delay: 1"] {
        assert!(error.contains(part), "{error}");
    }
}

#[test]
fn what_cannot_be_solved_is_refused() {
    let parts = || vec![part("a", "t.gain", &[], None), part("b", "t.gain", &[], None)];
    let no_loop = with(parts(), &[], vec![solved("a.y -> b.u")]);
    let text = faults(&no_loop);
    assert!(text.contains("does not close a loop") && text.contains("remove `solve`"), "{text}");
    let mut bad = with(parts(), &["a.y -> b.u"], vec![solved("b.y -> a.u")]);
    bad.wires[1].timing = WireTiming::Solved { tolerance: 0.0 };
    assert!(faults(&bad).contains("the tolerance is 0"));
    // Only one of the two loops is solved, so the other one is reported.
    let mut parts3 = parts();
    parts3.push(part("c", "t.adder", &[], None));
    let left =
        with(parts3, &["a.y -> b.u", "b.y -> c.u", "c.y -> c.u"], vec![solved("b.y -> a.u")]);
    let text = faults(&left);
    assert!(text.contains("`c.y -> c.u`") && text.contains("delay: 1"), "{text}");
    let sampled = with(
        vec![
            part("a", "t.noise", &[], Some("10 Hz")),
            part("s", "t.adder", &[], None),
            part("b", "t.sampled", &[], Some("10 Hz")),
            part("t", "t.integrator", &[], None),
        ],
        &["t.y -> s.u", "s.y -> b.u"],
        vec![solved("b.y -> s.u")],
    );
    let text = faults(&sampled);
    assert!(text.contains("changes only at its samples") && text.contains("`delay: 1`"), "{text}");
}

#[test]
fn a_delay_counts_samples_of_the_reader_then_of_the_writer_then_steps() {
    let at = |s: &Spec, t: f64, path: &str| {
        let mut sim = Simulation::new(plan(s));
        sim.run_until(seconds(t)).unwrap();
        sim.get(path).unwrap()
    };
    // A sampled part of 10 Hz reads the time three samples late.
    let reader = with(
        vec![part("time", "t.integrator", &[], None), part("h", "t.sampled", &[], Some("10 Hz"))],
        &[],
        vec![delayed("time.y -> h.u", 3, &[7.0])],
    );
    for (t, want) in [(0.0, 7.0), (0.2, 7.0), (0.3, 0.0), (1.0, 0.7), (1.05, 0.7)] {
        let y = at(&reader, t, "h.y");
        assert!((y - want).abs() < 1e-12, "{t}: {y} {want}");
    }
    // The reader is continuous and the writer is sampled, so the delay counts samples of the
    // writer.
    let writer = with(
        vec![
            part("time", "t.integrator", &[], None),
            part("h", "t.sampled", &[], Some("5 Hz")),
            part("g", "t.gain", &[], None),
        ],
        &["time.y -> h.u"],
        vec![delayed("h.y -> g.u", 1, &[])],
    );
    assert!((at(&writer, 1.0, "g.y") - 0.8).abs() < 1e-12);
    // Neither part is sampled, so the delay counts steps of 10 ms. It also breaks a loop.
    let mut steps = with(
        vec![
            part("one", "t.integrator", &[], None),
            part("a", "t.adder", &[], None),
            part("b", "t.gain", &[("k", 0.5)], None),
        ],
        &["one.y -> a.u", "a.y -> b.u"],
        vec![delayed("b.y -> a.u", 1, &[])],
    );
    steps.step = seconds(0.01);
    // a_k = t_k + ½ a_(k−1) is the sum of a geometric series.
    let want: f64 = (0..=100).map(|j| (1.0 - 0.01 * f64::from(j)) * 0.5_f64.powi(j)).sum();
    let y = at(&steps, 1.0, "a.y");
    assert!((y - want).abs() < 1e-12, "{y} {want}");
}

#[test]
fn delays_carry_vectors_and_are_saved() {
    let mut s = linear();
    s.wires.pop();
    s.wires.push(delayed("b.y -> a.u", 4, &[0.25]));
    s.step = seconds(0.01);
    let plan = plan(&s);
    let mut straight = Simulation::new(plan.clone());
    straight.run_until(seconds(1.0)).unwrap();
    let mut sim = Simulation::new(plan.clone());
    for k in 1..=20 {
        sim.run_until(seconds(0.05 * f64::from(k))).unwrap();
        let bytes = sim.checkpoint("").unwrap();
        sim = Simulation::new(plan.clone());
        sim.restore(&bytes).unwrap();
    }
    assert_eq!(sim.state(), straight.state());
    assert!(sim.get("a.u.delay.state.held[3]").unwrap() > 0.0);
}

#[test]
fn mistakes_in_delays_are_told_with_the_wire() {
    let parts = || vec![part("a", "t.gain", &[], None), part("b", "t.gain", &[], None)];
    for (samples, initial, want) in [
        (0, vec![], "a delay of 0 samples"),
        (1_000_000, vec![], "a delay of 1000000 samples"),
        (1, vec![1.0, 2.0], "it carries 1 numbers, but `initial` has 2"),
    ] {
        let text = faults(&with(parts(), &[], vec![delayed("a.y -> b.u", samples, &initial)]));
        assert!(text.contains(want) && text.contains("`a.y -> b.u`"), "{text}");
    }
    let text = faults(&with(parts(), &[], vec![delayed("a.x -> b.u", 1, &[])]));
    assert!(text.contains("`a` has no output `x`") && text.matches("error").count() <= 1, "{text}");
}
