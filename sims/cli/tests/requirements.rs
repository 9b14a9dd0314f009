//! `require` of a campaign: runs that violate requirements, and by which causes.
use crate::campaign::{FILE, column, first_runs, lab, numbers};
use crate::common::{Lab, edited};

/// Requirements on metrics are evaluated for completed runs: which runs violate them, by which cause, alone or with others; no run changes.
#[test]
fn runs_that_miss_what_is_required_are_counted_by_their_causes() {
    let lab = lab();
    let sim = edited(&[(
        "metrics: {",
        "metrics: { \"late\": (of: \"bob.angle\", at: \"time > 0.5 s\"), \"early\": (of: \"bob.angle\", at: \"time > 0.1 s\"),",
    )]);
    lab.write("sim.ron", &sim);
    let plain = FILE.replace("runs: 60", "runs: 30");
    lab.write("plain.ron", &plain);
    lab.linkwork(&["campaign", "plain.ron", "--out", "plain"]).code(0);
    let angles = numbers(&lab, "plain", "early [rad]");
    let mut sorted = angles.clone();
    sorted.sort_by(f64::total_cmp);
    // The bounds leave five runs below and seven above; the upper bound has another unit.
    let (least, most) = (0.5 * (sorted[4] + sorted[5]), 0.5 * (sorted[22] + sorted[23]));
    let require = format!(
        r#"require: {{
        "it swings too far": (metric: "early", most: "{:?} deg"),
        "it hardly swings": (metric: "early", least: {least:?}),
        "it is never seen": (metric: "late", least: -1e9),
    }},
    scatter: ["#,
        most.to_degrees()
    );
    lab.write("c.ron", &plain.replace("scatter: [", &require));
    let said = lab.linkwork(&["campaign", "c.ron", "--out", "out", "--threads", "1"]).code(0);
    let far: Vec<usize> = (0..30).filter(|k| angles[*k] > most).collect();
    let slow: Vec<usize> = (0..30).filter(|k| angles[*k] < least).collect();
    assert_eq!((far.len(), slow.len()), (7, 5), "{angles:?}");
    // A metric of an event that never happened has no value.
    assert!(numbers(&lab, "out", "late [rad]").iter().all(|y| y.is_nan()));
    assert!(numbers(&lab, "out", "early [rad]").iter().all(|y| y.is_finite()));
    let table = std::fs::read_to_string(lab.path("out/requirements.csv")).unwrap();
    let rows: Vec<Vec<&str>> = table.lines().skip(1).map(|l| l.split(',').collect()).collect();
    let share = |n: usize| format!("{:?}", n as f64 / 30.0);
    assert_eq!(rows.len(), 4, "{table}");
    for (row, (cause, least, most, n)) in rows.iter().zip([
        ("it swings too far", f64::NEG_INFINITY, most, far.len()),
        ("it hardly swings", least, f64::INFINITY, slow.len()),
        ("it is never seen", -1e9, f64::INFINITY, 0),
    ]) {
        let bound = |k: usize, want: f64| {
            let found: f64 = row[k].parse().unwrap();
            assert!(found == want || (found / want - 1.0).abs() < 1e-12, "{table}");
        };
        assert_eq!(row[0], cause);
        bound(3, least);
        bound(4, most);
        assert_eq!((row[5], row[6], row[7]), (&*n.to_string(), &*share(n), "0"));
    }
    // A missing event is a separate cause, and the only one of 18 runs.
    let never = "a required metric does not have a value: its variable never existed in this run or its condition never held";
    assert_eq!(rows[3], [never, "", "", "NaN", "NaN", "30", "1.0", "18"], "{table}");
    for (k, missed) in column(&lab, "out", "missed").iter().enumerate() {
        let first = if far.contains(&k) { "it swings too far; " } else { "" };
        let second = if slow.contains(&k) { "it hardly swings; " } else { "" };
        assert_eq!(missed, &format!("{first}{second}{never}"), "run {k}");
    }
    let words =
        format!("{} ({:.1} %) violated: it swings too far", far.len(), far.len() as f64 / 0.3);
    assert!(
        said.out.contains("0 of 30 satisfied all requirements: 0.0 % (0.0 to 11.4 %"),
        "{}",
        said.out
    );
    assert!(said.out.contains(&words), "{words}: {}", said.out);
    let page = std::fs::read_to_string(lab.path("out/report.html")).unwrap();
    assert!(
        page.contains("0 of 30 runs satisfied all requirements")
            && page.contains("it hardly swings")
    );
    // The runs of the second folder have no requirements; the first folder gets other requirements without a run.
    assert_eq!(column(&lab, "plain", "state"), column(&lab, "out", "state"));
    assert!(!lab.path("plain/requirements.csv").exists());
    let half = FILE.replace("runs: 60", "runs: 30").replace(
        "scatter: [",
        &format!(
            "require: {{ \"it hardly swings\": (metric: \"early\", least: {least:?}) }}, scatter: ["
        ),
    );
    lab.write("c.ron", &half);
    let said = lab.linkwork(&["campaign", "c.ron", "--out", "out"]).code(0);
    let kept = format!("{} of 30 satisfied all requirements", 30 - slow.len());
    assert!(
        said.out.contains("30 runs have ended already") && said.out.contains(&kept),
        "{}",
        said.out
    );
    for (bad, words) in [
        (
            "\"a\": (metric: \"largest sped\", most: 1)",
            vec!["there is no metric `largest sped`", "did you mean `largest speed`", "bad.ron:"],
        ),
        (
            "\"a\": (metric: \"largest speed\", most: \"1 kg\")",
            vec!["the unit of the metric is rad/s, but the unit of the bound is kg"],
        ),
        ("\"a\": (metric: \"largest speed\")", vec!["`a` lacks a bound", "least, most or both"]),
        ("\"a\": (most: 1)", vec!["`a` lacks a `metric`"]),
        (
            "\"a\": (metric: \"largest speed\", least: 2, most: 1)",
            vec!["the range from 2 to 1 is empty"],
        ),
        (
            "\"a\": (metric: \"largest speed\", mots: 1)",
            vec!["no field `mots`", "did you mean `most`"],
        ),
    ] {
        let file = FILE.replace("scatter: [", &format!("require: {{ {bad} }}, scatter: ["));
        lab.write("bad.ron", &file);
        lab.linkwork(&["campaign", "bad.ron", "--out", "bad"]).code(2).tells(&words);
    }
}

/// The footprint of a landing with all its requirements: two sets of eight runs, with the realistic uncertainty of the path and with a much larger
/// one; the second violates requirements by named causes.
#[test]
fn runs_of_a_footprint_that_is_too_wide_miss_by_causes_with_names() {
    let lab = Lab::new();
    first_runs(&lab, "mars_edl", "footprint.ron", 8);
    let narrow = lab.linkwork(&["campaign", "footprint.ron", "--out", "narrow"]).code(0);
    println!("{}", narrow.out);
    // The runs of a Latin hypercube are not independent, so the share does not get a confidence
    // interval.
    assert!(narrow.out.contains("8 of 8 satisfied all requirements: 100.0 %\n"));
    let text = std::fs::read_to_string(lab.path("footprint.ron")).unwrap();
    let wide = text
        .replace("deviation: 0.35)", "deviation: 6)")
        .replace("deviation: 0.16)", "deviation: 3)");
    assert!(wide.matches("deviation: 6)").count() == 3 && wide.contains("deviation: 3)"));
    lab.write("footprint.ron", &wide);
    let said = lab.linkwork(&["campaign", "footprint.ron", "--out", "wide"]);
    println!("{}", said.out);
    let missed = column(&lab, "wide", "missed");
    let dense: Vec<usize> = {
        let q = numbers(&lab, "wide", "dynamic pressure at the parachute [Pa]");
        (0..8).filter(|k| q[*k] > 750.0).collect()
    };
    assert!(!dense.is_empty() && dense.len() < 8, "{missed:?}");
    for (k, causes) in missed.iter().enumerate() {
        let is = causes.contains("the parachute opens in denser air than it was qualified for");
        assert_eq!(is, dense.contains(&k), "run {k}: {causes}");
    }
    // The others satisfied this requirement, and at least one satisfied all.
    assert!(missed.iter().any(String::is_empty));
    let share = 100.0 * dense.len() as f64 / 8.0;
    let words = format!(
        "{} ({share:.1} %) violated: the parachute opens in denser air than it was qualified for (dynamic pressure at the parachute at most 750 Pa)",
        dense.len()
    );
    assert!(said.out.contains(&words), "{words}\n{}", said.out);
}
