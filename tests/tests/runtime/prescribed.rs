//! Hinges that follow a profile: exact positions, the order of the integrator, bit-identical continuation, errors and warnings.
use linkwork_assembly::{Loaded, Options, load_file, load_text};
use linkwork_plant::PlanExt;
use linkwork_runtime::{Catalogue, Fault, Files, Seconds, Simulation};
use std::sync::Arc;

fn seconds(x: f64) -> Seconds {
    Seconds::from_decimal(x).unwrap()
}

fn catalogue() -> Catalogue {
    Catalogue::new(linkwork_assemblies::libraries())
}

/// A turntable driven by a profile, with an arm that swings on it.
fn table(profile: &str, initial: &str, settings: &str) -> String {
    format!(
        r#"Simulation(
            bodies: {{
                "table": (parent: "world", hinge: Pin(axis: [0, 0, 1], prescribed: true), mass: 3, inertia: [0.1, 0.1, 0.2], initial: ({initial})),
                "arm": (parent: "table", at: (position: [0.5, 0, 0]), hinge: Pin([0, 1, 0]), mass: 1.3, com: [0.1, 0.02, -0.4], inertia: [0.02, 0.03, 0.01], initial: (angle: 0.4)),
            }},
            parts: {{
                "Gravity": (model: "environment.uniform_gravity", params: {{ "acceleration": [0, 0, -9.81] }}),
                "Motion": (model: "basics.hinge_trajectory", params: {{ {profile} }}, bind: {{ "hinge": "hinge:table" }}),
            }},
            until: "4 s", {settings}
        )"#
    )
}

fn loaded(text: &str) -> Loaded {
    let catalogue = catalogue();
    load_text("test.ron", text, &Options::new(&catalogue)).map_err(|f| f.to_string()).unwrap()
}

fn sim_of(l: &Loaded) -> Simulation {
    Simulation::of(Arc::new(l.compile(&catalogue(), &Files::default()).unwrap()))
}

fn sim(text: &str) -> Simulation {
    sim_of(&loaded(text))
}

/// Returns all errors of a text, with facts and remedies.
fn faults(text: &str) -> String {
    let catalogue = catalogue();
    let faults: Vec<Fault> = match load_text("test.ron", text, &Options::new(&catalogue)) {
        Err(failure) => failure.faults,
        Ok(l) => match l.compile(&catalogue, &Files::default()) {
            Err(faults) => faults.0,
            Ok(_) => panic!("nothing is wrong"),
        },
    };
    let all = faults.iter().map(|f| format!("{} / {}", f.message, f.help.as_deref().unwrap_or("")));
    all.collect::<Vec<_>>().join("\n")
}

const WAVE: &str = r#""profile": [["0.35 s", "10 deg"], ["1.1 s", "60 deg"], ["1.77 s", "-25 deg"], ["3.1 s", "40 deg"]]"#;
const START: &str = r#"angle: "10 deg""#;

#[test]
fn every_integrator_keeps_its_order_with_rows_inside_steps() {
    let end = |integrator: &str, h: f64, profile: &str, initial: &str| {
        let settings = format!(r#"step: "{h} s", integrator: "{integrator}", accuracy: "fixed""#);
        let mut sim = sim(&table(profile, initial, &settings));
        sim.run_until(seconds(4.0)).unwrap();
        assert!((sim.time() - 4.0).abs() < 1e-12);
        let m = sim.plan().mechanism().unwrap().clone();
        sim.state().x[m.x..m.x + 4].to_vec()
    };
    let hold = r#""profile": [[0, "1 rad/s^2"], [0.733, -2], [1.512, 0.3], [2.9, 0]], "gives": "acceleration", "between": "hold""#;
    let rates = r#""profile": [[0, 0], [0.733, "20 deg/s"], [1.512, "-1 deg/s"], [2.9, 0]], "gives": "rate""#;
    for (profile, initial) in [(WAVE, START), (hold, "angle: 0"), (rates, "angle: 0")] {
        let reference = end("verner_87", 0.002, profile, initial);
        for (integrator, steps, order) in [
            ("rk4", [0.04, 0.02], 4.0),
            ("semi_implicit_euler", [0.002, 0.001], 1.0),
            ("bogacki_shampine_32", [0.02, 0.01], 3.0),
            ("dormand_prince_54", [0.08, 0.04], 5.0),
        ] {
            let e = steps.map(|h| {
                let x = end(integrator, h, profile, initial);
                x.iter().zip(&reference).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
            });
            let found = (e[0] / e[1]).log2();
            println!("{integrator}: order {found:.2}, errors {e:?}");
            assert!(found > order - 0.6, "{integrator}: order {found}, errors {e:?}");
        }
    }
}

#[test]
fn positions_are_met_and_ends_are_held() {
    let mut sim = sim(&table(WAVE, START, r#"step: "5 ms""#));
    let deg = std::f64::consts::PI / 180.0;
    for (t, q) in [(0.2, 10.0), (1.1, 60.0), (1.77, -25.0), (3.1, 40.0), (4.0, 40.0)] {
        sim.run_until(seconds(t)).unwrap();
        let error = sim.get("table.angle").unwrap() - q * deg;
        // Measured with RK4 at 5 ms: below 2e-8.
        assert!(error.abs() < 1e-7, "{t} s: {error:e}");
    }
    assert!(sim.get("table.rate").unwrap().abs() < 1e-7);
}

/// From a start off the profile: critically damped, e (1 + ω t) e^(−ω t).
#[test]
fn what_lies_beside_the_profile_goes_away_as_stated() {
    let profile = r#""profile": [[5, 0], [6, 1]], "natural_frequency": "3 rad/s""#;
    let l = loaded(&table(profile, "angle: 0.2", r#"step: "1 ms""#));
    let mut off = sim_of(&l);
    let remarks = off.startup_warnings();
    let [told] = &remarks[..] else { panic!("{remarks:?}") };
    assert!(told.message.contains("`Motion`: the hinge starts at 0.200000 rad"), "{told:?}");
    assert_eq!(
        told.help.as_deref(),
        Some("write `initial: (angle: 0.0, rate: 0.0)` in the body of the hinge")
    );
    let (_, line, _) = l.sources.place(told.origin).unwrap();
    assert_eq!(line, 8);
    for t in [0.3, 1.0, 2.5] {
        off.run_until(seconds(t)).unwrap();
        let want = 0.2 * (1.0 + 3.0 * t) * (-3.0 * t).exp();
        assert!((off.get("Motion.error").unwrap() - want).abs() < 1e-10);
    }
    // The error stays without feedback.
    let free = profile.replace("3 rad/s", "0 rad/s");
    let mut off = sim(&table(&free, "angle: 0.2", r#"step: "1 ms""#));
    off.run_until(seconds(2.0)).unwrap();
    assert_eq!(off.get("table.angle").unwrap(), 0.2);
    // A start on the profile does not cause a warning.
    assert!(sim(&table(WAVE, START, "")).startup_warnings().is_empty());
}

#[test]
fn a_cut_anywhere_leaves_no_trace() {
    for settings in [
        r#"step: "10 ms""#,
        r#"step: "10 ms", integrator: "dormand_prince_54""#,
        r#"step: "10 ms", contact: ()"#,
    ] {
        let l = loaded(&table(WAVE, START, settings));
        let mut whole = sim_of(&l);
        whole.run_until(seconds(3.5)).unwrap();
        for cut in [0.34, 0.35, 1.1, 1.76, 1.77, 2.0] {
            let mut head = sim_of(&l);
            head.run_until(seconds(cut)).unwrap();
            let saved = head.checkpoint("").unwrap();
            let mut tail = sim_of(&l);
            tail.restore(&saved).unwrap();
            tail.run_until(seconds(3.5)).unwrap();
            assert_eq!(tail.hash(), whole.hash(), "{settings}, cut at {cut} s");
        }
        assert!(whole.get("Motion.error").unwrap().abs() < 1e-2);
    }
}

/// A part that is added by a phase joins the profile at the current time.
#[test]
fn a_profile_that_comes_late_goes_on_where_it_is() {
    let text = r#"Simulation(
        bodies: { "table": (parent: "world", hinge: Pin(axis: [0, 0, 1], prescribed: true), mass: 3, inertia: [0.1, 0.1, 0.2]) },
        step: "10 ms", start: "still",
        phases: {
            "still": (to: { "moves": "time > 2.2 s" }),
            "moves": (parts: {
                "Motion": (model: "basics.hinge_trajectory", params: { "profile": [[0, 0], [1, 5], [2, 0], [3, 1], [4, 0], [5, 2]] }, bind: { "hinge": "hinge:table" }),
            }),
        },
    )"#;
    let mut sim = sim(text);
    sim.run_until(seconds(2.5)).unwrap();
    assert_eq!(sim.phase(), "moves");
    sim.run_until(seconds(5.5)).unwrap();
    assert!((sim.get("Motion.position").unwrap() - 2.0).abs() < 1e-12);
    assert!(sim.get("Motion.error").unwrap().abs() < 1e-6, "{}", sim.get("Motion.error").unwrap());
}

#[test]
fn a_file_gives_the_same_bits_as_rows_and_its_mistakes_are_told() {
    let folder = tempfile::tempdir().unwrap();
    let csv = folder.path().join("motion.csv");
    let load = |profile: &str| {
        let file = folder.path().join("sim.ron");
        std::fs::write(&file, table(profile, START, r#"step: "5 ms""#)).unwrap();
        let catalogue = catalogue();
        load_file(&file, &Options::new(&catalogue)).map_err(|f| f.to_string()).unwrap()
    };
    std::fs::write(&csv, "# six joints, two shown\ntime [ms], left [deg], right [m]\n350, 10, 1\n1100, 60, 1\n1770, -25, 1\n3100, 40, 1\n").unwrap();
    let from_file = r#""profile": (file: "motion.csv", column: "left")"#;
    let mut a = sim_of(&load(from_file));
    let mut b = sim_of(&load(WAVE));
    for sim in [&mut a, &mut b] {
        sim.run_until(seconds(2.0)).unwrap();
    }
    let angle = |s: &Simulation| s.get("table.angle").unwrap();
    assert!((angle(&a) - angle(&b)).abs() < 1e-15, "{} {}", angle(&a), angle(&b));
    let refused = |profile: &str| {
        let l = load(profile);
        let Err(faults) = l.compile(&catalogue(), &Files::default()) else { panic!("{profile}") };
        let fault = &faults.0[0];
        assert!(l.sources.place(fault.origin).is_some());
        format!("{} / {}", fault.message, fault.help.as_deref().unwrap_or(""))
    };
    let told = refused(r#""profile": (file: "motion.csv")"#);
    assert!(
        told.contains("2 columns in addition to the time") && told.contains("left, right"),
        "{told}"
    );
    let told = refused(r#""profile": (file: "motion.csv", column: "lft")"#);
    assert!(told.contains("no column `lft`") && told.contains("did you mean `left`"), "{told}");
    let told = refused(r#""profile": (file: "motion.csv", column: "right")"#);
    assert!(told.contains("the values are in m, which is not compatible with rad"), "{told}");
    let told = refused(r#""profile": (file: "nothing.csv")"#);
    assert!(told.contains("there is no file `nothing.csv`"), "{told}");
    let told = refused(r#""profile": (file: "motion.csv", colum: "left")"#);
    assert!(told.contains("no field `colum`") && told.contains("`column`"), "{told}");
    for (text, what) in [
        ("t [s], q [deg]\n0, 1\n1, x\n", "motion.csv:3: `Motion.profile`: `x` is not a quantity"),
        ("t [s], q [deg]\n0, 1\n1, NaN\n", "motion.csv:3: `Motion.profile`: `NaN` is not"),
        ("t [s], q [deg]\n0, 1\n1\n", "motion.csv"),
        ("t [m], q [deg]\n0, 1\n1, 2\n", "is in m, but s is expected"),
        ("t [s], q [furlong]\n0, 1\n1, 2\n", "furlong"),
        ("t [s], q [deg]\n0, 1\n0, 2\n", "row 2 at 0 s does not come after row 1 at 0 s"),
        ("t [s], q [deg]\n0, 1\n", "1 row(s)"),
    ] {
        std::fs::write(&csv, text).unwrap();
        let told = refused(r#""profile": (file: "motion.csv")"#);
        assert!(told.contains(what), "{text:?}: {told}");
    }
}

#[test]
fn profiles_that_make_no_sense_are_refused_with_the_remedy() {
    for (profile, what, remedy) in [
        (r#""profile": [[0, 0]]"#, "1 row(s)", "at least two rows"),
        (r#""profile": []"#, "0 row(s)", "at least two rows"),
        (
            r#""profile": [[1, 0], [0.5, 1]]"#,
            "row 2 at 0.5 s does not come after row 1 at 1 s",
            "sort",
        ),
        (r#""profile": [[0, 0], [0, 1]]"#, "does not come after", "sort"),
        (r#""profile": [[0, 0], [inf, 1]]"#, "row 2 is (inf, 1)", "finite"),
        (r#""profile": [[0, 0], [1, NaN]]"#, "NaN", "write a number"),
        (
            r#""profile": [[0, 0, 0], [1, 1, 1]]"#,
            "a row must be (time, value), but this has 3 numbers",
            "",
        ),
        (r#""profile": [["0 m", 0], [1, 1]]"#, "but s is expected", ""),
        (
            r#""profile": [[0, "0 m"], [1, 1]]"#,
            "in m, which is not compatible with rad",
            "numbers in rad",
        ),
        (
            r#""profile": [[0, "0 deg"], [1, "1 m"]]"#,
            "one value is in deg, another in m",
            "one unit",
        ),
        (
            r#""profile": [[0, "0 deg"], [1, 1]], "gives": "rate""#,
            "in deg, which is not compatible with rad/s",
            "",
        ),
        (
            r#""profile": [[0, 0], [1, 1]], "start": 1"#,
            "positions already determine `start`",
            "remove `start`",
        ),
        (
            r#""profile": [[0, 0], [1, 1]], "gives": "rate", "start_rate": 1"#,
            "already determine",
            "remove `start_rate`",
        ),
        (
            r#""profile": [[0, 0], [1, 1]], "between": "hold""#,
            "a profile of positions does not support this",
            "smooth, stops",
        ),
        (
            r#""profile": [[0, 0], [1, 1]], "gives": "rate", "between": "hold""#,
            "a profile of rates does not support this",
            "straight, smooth",
        ),
        (r#""profile": 3"#, "rows (time, value) or a file, but it is a number", "motion.csv"),
    ] {
        let told = faults(&table(profile, START, ""));
        assert!(told.contains(what) && told.contains(remedy), "{profile}: {told}");
    }
    // Degrees would be taken as metres.
    let slider =
        table(WAVE, "position: 0", "").replace("Pin(axis: [0, 0, 1]", "Slider(axis: [0, 0, 1]");
    let told = faults(&slider);
    assert!(told.contains("for coordinates in rad, but this is a slider"), "{told}");
    let metres = slider.replace("hinge_trajectory", "slider_trajectory");
    assert!(faults(&metres).contains("the values are in deg, which is not compatible with m"));
    let right = metres.replace(" deg", " cm").replace("position: 0", r#"position: "10 cm""#);
    let mut slides = sim(&right);
    assert!(slides.startup_warnings().is_empty());
    slides.run_until(seconds(1.1)).unwrap();
    assert!((slides.get("table.displacement").unwrap() - 0.6).abs() < 1e-6);
    // A free hinge cannot be prescribed.
    let free = table(WAVE, START, "").replace(", prescribed: true", "");
    assert!(faults(&free).contains("prescribes the motion of `hinge table`, which is free"));
    // Two profiles on one coordinate would override each other.
    let other = format!(
        r#""Other": (model: "basics.hinge_trajectory", params: {{ {WAVE} }}, bind: {{ "hinge": "hinge:table" }}), "Motion": (model"#
    );
    let twice = table(WAVE, START, "").replace(r#""Motion": (model"#, &other);
    let told = faults(&twice);
    assert!(
        told.contains("already drives the same input") && told.contains("remove one of the two"),
        "{told}"
    );
    assert!(told.contains("Motion") && told.contains("Other"), "{told}");
}
