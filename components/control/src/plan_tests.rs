//! Tests of `control.plan`: a day as it is planned, what fails and what follows, refusals.
use super::*;
use linkwork_runtime::Value;

const DT: f64 = 10.0;

fn settings(all: &[(&str, Value)]) -> Settings {
    Settings(all.iter().map(|(name, v)| ((*name).to_string(), v.clone())).collect())
}

fn on(name: &str) -> Settings {
    settings(&[(name, Value::Bool(true))])
}

fn off(name: &str) -> Settings {
    settings(&[(name, Value::Bool(false))])
}

fn step(name: &str) -> Step {
    Step {
        name: name.into(),
        when: None,
        wait_max: None,
        set: Settings::default(),
        duration: None,
        until: None,
        time_out: None,
        then: Settings::default(),
        on_failure: "next".into(),
    }
}

/// Warm up from 9 h on, drive until it has arrived or for an hour at the most, talk for 15 minutes.
fn day() -> PlanParams {
    let signal = |name: &str, unit: Option<&str>| Signal {
        name: name.into(),
        unit: unit.map(String::from),
        unwired: None,
    };
    let command = |name: &str, unit: Option<&str>, start: f64| Command {
        name: name.into(),
        unit: unit.map(String::from),
        start,
    };
    PlanParams {
        signals: vec![
            signal("local_time", Some("s")),
            signal("arrived", None),
            signal("t", Some("K")),
        ],
        commands: vec![
            command("heater", None, 1.0),
            command("drive", None, 0.0),
            command("level", Some("1"), 0.1),
        ],
        steps: vec![
            Step {
                when: Some("local_time > 9 h".into()),
                set: settings(&[("level", Value::Text("40 %".into()))]),
                until: Some("t > 0 degC".into()),
                ..step("warm")
            },
            Step {
                set: on("drive"),
                until: Some("arrived > 0.5".into()),
                duration: Some(300.0),
                time_out: Some(3600.0),
                then: off("drive"),
                on_failure: "sleep".into(),
                ..step("drive")
            },
            Step { set: off("heater"), duration: Some(900.0), then: on("heater"), ..step("talk") },
            Step { set: settings(&[("level", Value::Number(0.05))]), ..step("sleep") },
        ],
    }
}

/// Signals at a time.
type At = fn(f64) -> [f64; 3];

/// Outputs by name at each sample.
struct Run {
    names: Vec<String>,
    rows: Vec<Vec<f64>>,
}

impl Run {
    fn of(p: &PlanParams, samples: usize, at: At) -> Run {
        let ports = Plan::ports(p);
        let names: Vec<String> = ports.outputs.iter().map(|p| p.name.to_string()).collect();
        let plan = Plan::build(p.clone()).unwrap();
        let mut d = vec![0.0; ports.discrete.len()];
        plan.initial(&mut [], &mut d);
        let mut rows = Vec::new();
        for k in 0..samples {
            let c = Clock::at(DT * k as f64, DT, k as u64);
            let mut y = vec![f64::NAN; names.len()];
            plan.outputs(&c, &d, &mut y);
            rows.push(y);
            plan.update(&c, &mut d, &at(c.t));
        }
        Run { names, rows }
    }

    /// The first sample from `from` on whose output is `value`; its time.
    fn when(&self, name: &str, value: f64, from: f64) -> Option<f64> {
        let lane = self.lane(name);
        let first = (from / DT) as usize;
        let k = self.rows[first..].iter().position(|row| row[lane] == value)?;
        Some(DT * (first + k) as f64)
    }

    fn lane(&self, name: &str) -> usize {
        self.names.iter().position(|n| n == name).unwrap_or_else(|| panic!("no {name}"))
    }

    fn last(&self, name: &str) -> f64 {
        self.rows[self.rows.len() - 1][self.lane(name)]
    }
}

/// 9 h is after 600 s; the temperature rises through 0 °C after 1200 s; it arrives after 2005 s.
fn usual(t: f64) -> [f64; 3] {
    [32_400.0 - 600.0 + t, f64::from(u8::from(t > 2005.0)), 273.15 + 0.01 * (t - 1200.0)]
}

#[test]
fn a_day_goes_as_it_is_planned() {
    let run = Run::of(&day(), 400, usual);
    // A condition that becomes true at 610 s is detected there, and acts one sample later.
    assert_eq!(run.when("level", 0.4, 0.0), Some(620.0));
    assert_eq!(run.when("drive", 1.0, 0.0), Some(1220.0));
    assert_eq!(run.when("running.drive", 1.0, 0.0), Some(1220.0));
    assert_eq!(run.when("drive", 0.0, 1220.0), Some(2020.0));
    assert_eq!(
        (run.when("heater", 0.0, 0.0), run.when("heater", 1.0, 2020.0)),
        (Some(2020.0), Some(2920.0))
    );
    // The last step has no duration.
    assert_eq!(run.when("done", 1.0, 0.0), Some(2920.0));
    assert_eq!(run.when("waiting", 0.0, 0.0), Some(620.0));
    assert_eq!((run.last("level"), run.last("step"), run.last("failures")), (0.05, 5.0, 0.0));
    let elapsed = run.lane("elapsed");
    assert_eq!((run.rows[50][elapsed], run.rows[150][elapsed]), (500.0, 1500.0 - 1210.0));
}

#[test]
fn a_step_lasts_its_duration_though_its_condition_holds_at_once() {
    let run = Run::of(&day(), 400, |t| [32_400.0 + 10.0 + t, 1.0, 280.0]);
    let begun = run.when("drive", 1.0, 0.0).unwrap();
    assert_eq!((begun, run.when("drive", 0.0, begun)), (10.0, Some(310.0)));
}

#[test]
fn what_takes_too_long_fails_and_goes_where_it_is_told() {
    let lost: At = |t| [40_000.0 + t, 0.0, 280.0];
    let run = Run::of(&day(), 400, lost);
    // The rover does not arrive, so the step `drive` fails after an hour. The rover then sleeps,
    // and the step `talk` is left out.
    assert_eq!(run.when("drive", 0.0, 100.0), Some(3610.0));
    assert_eq!((run.when("failures", 1.0, 0.0), run.last("failed_step")), (Some(3610.0), 2.0));
    assert_eq!(run.when("running.talk", 1.0, 0.0), None);
    assert_eq!((run.last("done"), run.last("aborted"), run.last("level")), (1.0, 0.0, 0.05));
    // With "next", the plan continues with the next step.
    let mut p = day();
    p.steps[1].on_failure = "next".into();
    assert_eq!(Run::of(&p, 500, lost).when("running.talk", 1.0, 0.0), Some(3610.0));
    // With "abort", the plan ends, with the commands of its start.
    p.steps[1].on_failure = "abort".into();
    let run = Run::of(&p, 500, lost);
    assert_eq!((run.last("aborted"), run.last("done"), run.last("level")), (1.0, 1.0, 0.1));
    assert_eq!((run.last("heater"), run.last("drive"), run.last("step")), (1.0, 0.0, 5.0));
    // With the name of a step, the plan repeats this step, which takes an hour each time.
    p.steps[1].on_failure = "drive".into();
    let run = Run::of(&p, 1100, lost);
    assert_eq!((run.last("failures"), run.last("running.drive")), (3.0, 1.0));
}

#[test]
fn a_wait_may_be_cut_short() {
    let mut p = day();
    p.steps[0].wait_max = Some(200.0);
    let run = Run::of(&p, 100, usual);
    assert_eq!(
        (run.when("failures", 1.0, 0.0), run.when("drive", 1.0, 0.0)),
        (Some(210.0), Some(210.0))
    );
    assert_eq!(run.last("level"), 0.1);
}

#[test]
fn a_circle_of_failures_ends_with_the_sample() {
    let mut p = day();
    p.steps = vec![Step {
        until: Some("arrived > 0.5".into()),
        time_out: Some(1e-9),
        on_failure: "a".into(),
        ..step("a")
    }];
    let run = Run::of(&p, 3, |_| [0.0; 3]);
    assert_eq!(run.last("failures"), 2.0);
}

#[test]
fn cut_anywhere_it_goes_on_with_the_same_bits() {
    let plan = Plan::build(day()).unwrap();
    let lanes = Plan::ports(&day()).discrete.len();
    let at = |k: usize| Clock::at(DT * k as f64, DT, k as u64);
    let mut d = vec![0.0; lanes];
    plan.initial(&mut [], &mut d);
    for k in 0..300 {
        plan.update(&at(k), &mut d, &usual(DT * k as f64));
        // Another instance continues from the state alone.
        let other = Plan::build(day()).unwrap();
        let (mut a, mut b) = (d.clone(), d.clone());
        plan.update(&at(k + 1), &mut a, &usual(DT * (k + 1) as f64));
        other.update(&at(k + 1), &mut b, &usual(DT * (k + 1) as f64));
        assert_eq!(a, b);
    }
}

#[test]
fn plans_that_cannot_be_are_refused_with_the_step() {
    let told = |change: fn(&mut PlanParams)| {
        let mut p = day();
        change(&mut p);
        let e = Plan::build(p).err().unwrap();
        assert!(e.help.is_some() && e.param.is_some(), "{e:?}");
        e.message
    };
    let all = [
        (told(|p| p.steps.clear()), "`steps` is empty"),
        (told(|p| p.steps[0].when = Some("locale_time > 9 h".into())), "step `warm`: condition"),
        (told(|p| p.steps[0].until = Some("t > 3 m".into())), "different quantities"),
        (told(|p| p.steps[0].when = Some("phase_time > 3 s".into())), "`phase_time` is the time"),
        (told(|p| p.steps[1].set = on("fly")), "step `drive`: there is no command `fly`"),
        (
            told(|p| p.steps[1].set = settings(&[("drive", Value::Number(1.0))])),
            "`drive` cannot be 1.0",
        ),
        (
            told(|p| p.steps[0].set = settings(&[("level", Value::Text("3 m".into()))])),
            "cannot be \"3 m\"",
        ),
        (told(|p| p.steps[1].on_failure = "home".into()), "names `home`, which is not a step"),
        (told(|p| p.steps[1].wait_max = Some(3.0)), "`wait_max` without `when`"),
        (told(|p| p.steps[2].time_out = Some(3.0)), "`time_out` without `until`"),
        (told(|p| p.steps[1].time_out = Some(300.0)), "always fails"),
        (told(|p| p.steps[1].name = "warm".into()), "`warm` is defined twice"),
        (told(|p| p.commands[0].name = "done".into()), "`done` is defined twice"),
        (told(|p| p.signals[0].name = "time".into()), "is reserved in conditions"),
        (told(|p| p.signals[0].name = "local time".into()), "`local time` is not a valid name"),
        (told(|p| p.signals[2].unit = Some("Q".into())), "`Q` is not a unit"),
        (told(|p| p.commands[1].start = 0.5), "cannot start at 0.5"),
    ];
    for (message, wanted) in all {
        assert!(message.contains(wanted), "{message}: {wanted}");
    }
}
