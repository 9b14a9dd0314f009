//! Guarantees of the drivers: cuts and rejections have no influence on later steps, failures leave x unchanged, errors state the remedy.
use crate::common::{Ode, control, coupled, coupled_solution, through};
use linkwork_integrate::{
    Control, Failure, Integrator, Limits, METHODS, Memory, Method, Norm, Setup, System, Tolerances,
};

fn adaptive() -> impl Iterator<Item = Method> {
    METHODS.into_iter().filter(|m| m.error_order() > 0)
}

fn named(name: &str) -> Method {
    Method::by_name(name).unwrap()
}

/// Samples every 0.01 s cut nearly every step; the proposal is the same as without them.
#[test]
fn a_cut_step_leaves_the_proposal_alone() {
    for method in adaptive() {
        let settings = control(method, 2, 1e-6, 1e-6);
        let mut integrator = Integrator::new(method, 2);
        let (mut x, mut memory) = (coupled_solution(0.0), Memory::START);
        let mut t = 0.0;
        // After free steps, one step is cut to a hundredth, a thousandth or a millionth of the
        // proposal.
        for _ in 0..3 {
            t += integrator
                .advance(&mut Ode(coupled), &settings, t, 1e3, &mut x, None, &mut memory)
                .unwrap()
                .h;
        }
        for part in [1e-2, 1e-3, 1e-6] {
            let before = memory;
            let h = part * memory.next;
            let step = integrator
                .advance(&mut Ode(coupled), &settings, t, h, &mut x, None, &mut memory)
                .unwrap();
            assert!(step.end && step.h.to_bits() == h.to_bits(), "{}", method.name());
            assert_eq!(memory, before, "{}", method.name());
            t += h;
        }
        // The next free step continues where the last free one stopped.
        let proposal = memory.next;
        let step = integrator
            .advance(&mut Ode(coupled), &settings, t, 1e3, &mut x, None, &mut memory)
            .unwrap();
        assert_eq!((step.h, step.rejections), (proposal, 0), "{}", method.name());
    }
}

/// The same samples in one run, and in two with everything except the state discarded in between: bit-identical.
#[test]
fn runs_in_pieces_have_the_bits_of_runs_in_one() {
    for method in adaptive() {
        let settings = control(method, 2, 1e-7, 1e-7);
        let rows: Vec<f64> = (0..=30).map(|k| f64::from(k) / 10.0).collect();
        let run = |pieces: &[&[f64]]| {
            let (mut x, mut memory) = (coupled_solution(0.0), Memory::START);
            for piece in pieces {
                let mut integrator = Integrator::new(method, 2);
                through(&mut integrator, &settings, &mut Ode(coupled), piece, &mut x, &mut memory)
                    .unwrap();
            }
            (x.map(f64::to_bits), memory)
        };
        let whole = run(&[&rows]);
        assert_eq!(whole, run(&[&rows[..12], &rows[11..]]), "{}", method.name());
        assert_eq!(whole, run(&[&rows]), "{}", method.name());
        let halves: Vec<&[f64]> = rows.windows(2).collect();
        assert_eq!(whole, run(&halves), "{}", method.name());
    }
}

/// A bump at t = 1.5 at which the first attempt fails: the result equals that of a run that requests the accepted step immediately.
#[test]
fn a_rejected_step_leaves_no_trace() {
    let bump = |t: f64, x: &[f64], d: &mut [f64]| {
        d[0] = x[0].cos() + 1e3 * (-1e4 * (t - 1.5) * (t - 1.5)).exp();
    };
    for method in adaptive() {
        let settings = control(method, 1, 1e-6, 1e-6);
        let start = Memory { next: 0.4, error: 0.3 };
        let (mut x, mut memory) = ([0.7], start);
        let step = Integrator::new(method, 1)
            .advance(&mut Ode(bump), &settings, 1.4, 10.0, &mut x, None, &mut memory)
            .unwrap();
        assert!(step.rejections > 0 && !step.end, "{}: {step:?}", method.name());
        let mut direct = [0.7];
        // Start with the accepted step size, by a proposal that is not stretched to the end.
        let mut asked = Memory { next: step.h, ..start };
        let again = Integrator::new(method, 1)
            .advance(&mut Ode(bump), &settings, 1.4, 10.0, &mut direct, None, &mut asked)
            .unwrap();
        assert_eq!((again.rejections, again.h), (0, step.h), "{}", method.name());
        if method.name() != "rodas-4p" {
            // The difference quotients of Rosenbrock methods use the size of the first attempt.
            assert_eq!(x[0].to_bits(), direct[0].to_bits(), "{}", method.name());
        }
        assert!((x[0] - direct[0]).abs() < 1e-9, "{}", method.name());
    }
}

/// f at the end of a step is bit-identical with an evaluation there; otherwise it is not returned.
#[test]
fn the_last_stage_is_the_next_first() {
    struct Pushed(bool);
    impl System for Pushed {
        type Error = std::convert::Infallible;
        fn derivatives(&mut self, t: f64, x: &[f64], d: &mut [f64]) -> Result<(), Self::Error> {
            coupled(t, x, d);
            Ok(())
        }
        fn project(&mut self, _: f64, x: &mut [f64]) -> Result<(), Self::Error> {
            if self.0 {
                x[0] += 1e-12;
            }
            Ok(())
        }
    }
    for method in METHODS {
        let Method::Explicit(table) = method else { continue };
        let mut integrator = Integrator::new(method, 2);
        let mut x = coupled_solution(0.5);
        assert!(integrator.end_derivatives().is_none());
        integrator.step_fixed(&mut Pushed(false), 0.5, 0.1, &mut x, None).unwrap();
        let mut exact = [0.0; 2];
        coupled(0.6, &x, &mut exact);
        match integrator.end_derivatives() {
            Some(k1) => assert_eq!(k1, exact, "{}", table.name),
            None => assert!(!table.first_same_as_last, "{}", table.name),
        }
        integrator.step_fixed(&mut Pushed(true), 0.6, 0.1, &mut x, None).unwrap();
        assert!(integrator.end_derivatives().is_none(), "{}: moved", table.name);
    }
}

/// k₁ passed in or computed: bit-identical, with one evaluation less.
#[test]
fn first_stages_from_the_caller_are_used() {
    for method in METHODS {
        let mut calls = [0, 0];
        let mut ends = [[0.0; 2]; 2];
        for given in 0..2 {
            let mut count = 0;
            let mut system = Ode(|t: f64, x: &[f64], d: &mut [f64]| {
                count += 1;
                coupled(t, x, d);
            });
            let mut x = coupled_solution(0.2);
            let mut k1 = [0.0; 2];
            coupled(0.2, &x, &mut k1);
            let k1 = (given == 1).then_some(&k1[..]);
            Integrator::new(method, 2).step_fixed(&mut system, 0.2, 0.05, &mut x, k1).unwrap();
            (calls[given], ends[given]) = (count, x);
        }
        assert_eq!(calls[0], calls[1] + 1, "{}", method.name());
        assert_eq!(ends[0].map(f64::to_bits), ends[1].map(f64::to_bits), "{}", method.name());
    }
}

/// Returns an error, or NaN, from the nth call on.
struct Brittle {
    left: u32,
    refuse: bool,
}

impl System for Brittle {
    type Error = &'static str;
    fn derivatives(&mut self, _: f64, x: &[f64], d: &mut [f64]) -> Result<(), Self::Error> {
        d.iter_mut().zip(x).for_each(|(d, x)| *d = -x);
        if self.left == 0 {
            if self.refuse {
                return Err("worn out");
            }
            d[1] = f64::NAN;
        }
        self.left = self.left.saturating_sub(1);
        Ok(())
    }
}

#[test]
fn faults_of_the_system_pass_through_and_leave_x_alone() {
    for method in METHODS {
        for left in 0..3 {
            let mut system = Brittle { left, refuse: true };
            let mut x = [1.0, 2.0, 3.0];
            let mut integrator = Integrator::new(method, 3);
            let mut failed = 0;
            for k in 0..3 {
                let before = x;
                let step = integrator.step_fixed(&mut system, f64::from(k), 0.1, &mut x, None);
                if let Err(fault) = step {
                    assert_eq!(fault, Failure::System("worn out"), "{}", method.name());
                    assert_eq!(x.map(f64::to_bits), before.map(f64::to_bits), "{}", method.name());
                    assert!(integrator.dense(&mut system).is_err(), "{}", method.name());
                    failed += 1;
                }
            }
            assert!(failed > 0, "{} {left}", method.name());
        }
    }
    for method in adaptive() {
        for left in 0..12 {
            let settings = control(method, 3, 1e-3, 1e-3);
            let mut integrator = Integrator::new(method, 3);
            let (mut x, mut memory) = ([1.0, 2.0, 3.0], Memory::START);
            let mut system = Brittle { left, refuse: true };
            let fault = loop {
                let before = (x, memory);
                let step = integrator.advance(
                    &mut system,
                    &settings,
                    0.0,
                    10.0,
                    &mut x,
                    None,
                    &mut memory,
                );
                if let Err(fault) = step {
                    assert_eq!((x, memory), before, "{}", method.name());
                    break fault;
                }
            };
            assert_eq!(fault, Failure::System("worn out"));
        }
    }
}

#[test]
fn what_is_not_finite_is_refused_with_its_lane() {
    for method in METHODS {
        // In this case k₁ is not finite.
        let mut x = [1.0, 2.0, 3.0];
        let mut integrator = Integrator::new(method, 3);
        let mut system = Brittle { left: 0, refuse: false };
        let fault = integrator.step_fixed(&mut system, 4.0, 0.1, &mut x, None).unwrap_err();
        assert_eq!(fault, Failure::Start { t: 4.0, lane: 1 }, "{}", method.name());
        assert_eq!(x, [1.0, 2.0, 3.0]);
        // In this case x is not finite.
        let mut x = [1.0, 2.0, f64::INFINITY];
        let fault = integrator.step_fixed(
            &mut Ode(|_: f64, _: &[f64], d: &mut [f64]| d.fill(0.0)),
            4.0,
            0.1,
            &mut x,
            None,
        );
        assert_eq!(fault.unwrap_err(), Failure::Start { t: 4.0, lane: 2 }, "{}", method.name());
    }
    // Test adaptive steps, both first and later ones.
    for method in adaptive() {
        for memory in [Memory::START, Memory { next: 0.1, error: 0.5 }] {
            let settings = control(method, 3, 1e-6, 1e-6);
            let mut integrator = Integrator::new(method, 3);
            let (mut x, mut m) = ([1.0, 2.0, 3.0], memory);
            let mut system = Brittle { left: 0, refuse: false };
            let fault = integrator
                .advance(&mut system, &settings, 4.0, 1.0, &mut x, None, &mut m)
                .unwrap_err();
            assert_eq!(fault, Failure::Start { t: 4.0, lane: 1 }, "{}", method.name());
            assert_eq!((x, m), ([1.0, 2.0, 3.0], memory), "{}", method.name());
        }
    }
    // In this case a later stage is not finite.
    for name in ["rk4", "bogacki-shampine-32", "dormand-prince-54", "verner-87", "rodas-4p"] {
        let mut x = [1.0, 2.0, 3.0];
        let mut system = Brittle { left: 1, refuse: false };
        let mut integrator = Integrator::new(named(name), 3);
        let fault = integrator.step_fixed(&mut system, 4.0, 0.1, &mut x, None).unwrap_err();
        assert_eq!(x, [1.0, 2.0, 3.0], "{name}");
        // The first stage is given, which selects the shorter code path.
        let mut system = Brittle { left: 0, refuse: false };
        let again = integrator.step_fixed(&mut system, 4.0, 0.1, &mut x, Some(&[-1.0, -2.0, -3.0]));
        assert!(matches!(again.unwrap_err(), Failure::NotFinite { .. }), "{name}");
        assert_eq!(x, [1.0, 2.0, 3.0], "{name}");
        assert!(matches!(fault, Failure::NotFinite { t: 4.0, h: 0.1, .. }), "{name}: {fault}");
    }
}

/// ẋ = 1/(1 − t), NaN beyond t = 1. Steps shrink towards 1 and stop with a typed error.
#[test]
fn a_wall_of_nan_is_approached_and_named() {
    let wall = |t: f64, x: &[f64], d: &mut [f64]| {
        assert!(x.iter().all(|v| v.is_finite()), "adaptive stages are finite");
        d[0] = 1.0;
        d[1] = if t > 1.0 { f64::NAN } else { 0.5 };
    };
    for (method, norm) in adaptive().flat_map(|m| [(m, Norm::Rms), (m, Norm::Max)]) {
        let tolerances = Tolerances::uniform(2, 1e-6, 1e-6).unwrap();
        let settings = Control::new(method, tolerances, norm, Limits::default()).unwrap();
        let mut integrator = Integrator::new(method, 2);
        let (mut x, mut t, mut memory) = ([0.0, 0.0], 0.0, Memory::START);
        let fault = loop {
            let step =
                integrator.advance(&mut Ode(wall), &settings, t, 100.0, &mut x, None, &mut memory);
            match step {
                Ok(step) => t += step.h,
                Err(fault) => break fault,
            }
        };
        assert!(t <= 1.0 && 1.0 - t < 1e-12, "{}: stopped at {t}", method.name());
        assert!((x[0] - t).abs() < 1e-12 && (x[1] - 0.5 * t).abs() < 1e-12);
        let Failure::StepTooSmall { lane, error, least, h, .. } = fault else {
            panic!("{}: {fault}", method.name())
        };
        assert!(lane == 1 && error.is_nan() && h <= least, "{}: {fault}", method.name());
    }
}

/// A pole at t = 1: the error names its lane and the remedy.
#[test]
fn the_smallest_step_names_the_worst_lane() {
    let limits = Limits { step_min: 1e-6, ..Limits::default() };
    let pole = |t: f64, x: &[f64], d: &mut [f64]| {
        d[0] = t.cos();
        d[1] = -x[1];
        d[2] = x[2] * x[2];
    };
    for method in adaptive() {
        let tolerances = Tolerances::uniform(3, 1e-9, 1e-9).unwrap();
        let settings = Control::new(method, tolerances, Norm::Max, limits).unwrap();
        let mut integrator = Integrator::new(method, 3);
        let (mut x, mut t, mut memory) = ([0.0, 1.0, 1.0], 0.0, Memory::START);
        let fault = loop {
            match integrator.advance(&mut Ode(pole), &settings, t, 9.0, &mut x, None, &mut memory) {
                Ok(step) => t += step.h,
                Err(fault) => break fault,
            }
        };
        let Failure::StepTooSmall { lane, least, .. } = fault else {
            panic!("{}: {fault}", method.name())
        };
        assert!((lane, least) == (2, 1e-6) && fault.to_string().contains("lane 2"), "{fault}");
    }
}

#[test]
fn rejections_have_a_limit() {
    let limits = Limits { rejections_max: 2, ..Limits::default() };
    let method = named("dormand-prince-54");
    let tolerances = Tolerances::uniform(1, 1e-9, 1e-9).unwrap();
    let settings = Control::new(method, tolerances, Norm::Rms, limits).unwrap();
    let (mut x, mut memory) = ([1.0], Memory { next: 100.0, error: 1.0 });
    let fast = |_: f64, x: &[f64], d: &mut [f64]| d[0] = (1e3 * x[0]).sin() * 1e3;
    let fault = Integrator::new(method, 1)
        .advance(&mut Ode(fast), &settings, 0.0, 1e3, &mut x, None, &mut memory)
        .unwrap_err();
    assert!(matches!(fault, Failure::Rejections { rejections: 3, lane: 0, .. }), "{fault}");
    assert_eq!((x, memory), ([1.0], Memory { next: 100.0, error: 1.0 }));
}

#[test]
fn bad_settings_are_refused_all_lanes_at_once() {
    let fault = Tolerances::new(vec![1e-3, 0.0, f64::NAN], vec![0.0; 3]).unwrap_err();
    assert_eq!(fault, Setup::Absolute { lanes: vec![1, 2] });
    let fault = Tolerances::new(vec![1.0; 3], vec![-1.0, 0.0, f64::INFINITY]).unwrap_err();
    assert_eq!(fault, Setup::Relative { lanes: vec![0, 2] });
    let fault = Tolerances::new(vec![1.0; 3], vec![0.0; 2]).unwrap_err();
    assert_eq!(fault, Setup::Lengths { abs: 3, rel: 2 });
    for name in ["rk4", "euler", "semi-implicit-euler"] {
        let tolerances = Tolerances::uniform(1, 1e-3, 1e-3).unwrap();
        let fault = Control::new(named(name), tolerances, Norm::Rms, Limits::default());
        let text = fault.unwrap_err().to_string();
        assert!(text.contains(name) && text.contains("dormand-prince-54"), "{text}");
    }
    for (step_min, step_max) in [(1.0, 0.5), (-1.0, 1.0), (f64::NAN, 1.0), (0.0, f64::NAN)] {
        let tolerances = Tolerances::uniform(1, 1e-3, 1e-3).unwrap();
        let limits = Limits { step_min, step_max, ..Limits::default() };
        let fault = Control::new(named("rodas-4p"), tolerances, Norm::Rms, limits).unwrap_err();
        assert!(matches!(fault, Setup::Steps { .. }), "{fault}");
    }
    let mut integrator = Integrator::new(named("rk4"), 2);
    let fault = integrator.dense(&mut Ode(coupled)).unwrap_err();
    assert_eq!(fault, Failure::NoStep);
}

/// A lane with infinite absolute tolerance does not count, also not in the mean.
#[test]
fn lanes_are_left_out_by_infinity() {
    let method = named("dormand-prince-54");
    let fast = |t: f64, x: &[f64], d: &mut [f64]| {
        coupled(t, &x[..2], &mut d[..2]);
        d[2..].fill(0.0);
        if x.len() > 2 {
            d[2] = (300.0 * t).cos() * 300.0;
        }
    };
    let run = |abs: Vec<f64>| {
        let n = abs.len();
        let rel = vec![1e-8; n];
        let tolerances = Tolerances::new(abs, rel).unwrap();
        let settings = Control::new(method, tolerances, Norm::Rms, Limits::default()).unwrap();
        let mut x = vec![0.0; n];
        x[..2].copy_from_slice(&coupled_solution(0.0));
        let mut memory = Memory { next: 0.01, ..Memory::START };
        let mut integrator = Integrator::new(method, n);
        let mut system = Ode(fast);
        let times = [0.0, 1.0];
        let count =
            through(&mut integrator, &settings, &mut system, &times, &mut x, &mut memory).unwrap();
        (count, [x[0].to_bits(), x[1].to_bits()])
    };
    let alone = run(vec![1e-8; 2]);
    let with_free = run(vec![1e-8, 1e-8, f64::INFINITY, f64::INFINITY]);
    assert_eq!(alone, with_free);
    let with_fast = run(vec![1e-8, 1e-8, 1e-8, f64::INFINITY]);
    assert!(with_fast.0.steps > 5 * alone.0.steps, "{with_fast:?} {alone:?}");
}
