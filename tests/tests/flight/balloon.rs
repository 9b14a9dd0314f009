//! `sims/balloon`: a super-pressure balloon on Mars floats, descends and rises again.

use crate::common::{repository, seconds};

/// Returns the height (m) at which the file's atmosphere has this density: p = 699 e^(−0.00009 h), R = 192.1, T in two linear pieces.
fn height_of(density: f64) -> f64 {
    let warm = |h: f64| if h < 7000.0 { 242.15 - 9.98e-4 * h } else { 249.75 - 2.22e-3 * h };
    let at = |h: f64| 699.0 * (-9e-5 * h).exp() / (192.1 * warm(h));
    let (mut low, mut high) = (0.0, 12_000.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if at(middle) > density { low = middle } else { high = middle }
    }
    low
}

#[test]
fn a_balloon_floats_where_it_displaces_its_mass_and_comes_down_and_rises() {
    let mut sim = repository("balloon/sim.ron", &[]).unwrap();
    let (mut told, mut phase, mut tight) = (Vec::new(), String::new(), 0.0_f64);
    let mut before = 0.0;
    while sim.before(seconds(4.0 * 3600.0)) {
        sim.step_event().unwrap();
        let height = sim.get("Ground.height").unwrap();
        if sim.phase() != phase {
            phase = sim.phase().to_string();
            println!(
                "{phase:<14} {:9.1} s {before:9.1} m {:6.2} m/s",
                sim.time(),
                sim.get("Ground.rise").unwrap()
            );
            told.push((phase.clone(), sim.time(), before));
        }
        before = height;
        tight = tight.max(sim.get("Balloon.over_pressure").unwrap());
    }
    let phases: Vec<&str> = told.iter().map(|t| t.0.as_str()).collect();
    assert_eq!(phases, ["ascent", "float", "venting", "descent", "dropping", "ascent_again"]);
    // The density is the total mass over the volume: envelope, gondola, ballast and gas.
    let gas = sim.get("Balloon.gas").unwrap();
    let (first, then) =
        (height_of((18.0 + 9.0 + 3.0 + 3.6) / 3700.0), height_of((27.0 + gas) / 3700.0));
    println!("floats at {} m, closed form {first} m; then at {before} m, {then} m", told[2].2);
    println!("{tight} Pa, {} kg of gas, east {} m", gas, sim.get("Ground.offset.x").unwrap());
    assert!((told[2].2 - first).abs() < 60.0, "{} {first}", told[2].2);
    assert!((before - then).abs() < 120.0 && then > first, "{before} {then}");
    assert!(sim.get("Ballast.propellant").unwrap() == 0.0);
    let east = sim.get("Ground.offset.x").unwrap();
    assert!((east / 1e3 - 259.0).abs() < 0.5, "{east}");
    // The README lists s and m of each phase.
    let want = [
        (0.0, 500.0),
        (1277.3, 5922.7),
        (5400.0, 5868.3),
        (5702.4, 5983.2),
        (7282.7, 2001.8),
        (7312.7, 1950.1),
    ];
    for ((phase, t, height), w) in told.iter().zip(want).skip(1) {
        assert!((t - w.0).abs() < 1.0 && (height - w.1).abs() < 3.0, "{phase} {t} {height}");
    }
    assert!((tight - 97.5).abs() < 0.5 && (before - 7329.7).abs() < 3.0, "{tight} {before}");
}
