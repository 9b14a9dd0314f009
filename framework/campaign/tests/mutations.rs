//! Mutated campaign files and outcomes, and the corpus of fuzzing, are rejected without a panic.
#![allow(clippy::unwrap_used)]
#[path = "../../../tests/fuzz/mutate.rs"]
mod mutate;
use linkwork_campaign::{Cause, Form, Outcome};
use std::path::Path;

#[test]
fn campaign_files_are_read_or_refused() {
    let seeds = mutate::kept("campaign");
    assert!(seeds.len() > 2, "the corpus is committed");
    let sound =
        |bytes: &[u8]| Form::text("c.ron", std::str::from_utf8(bytes).unwrap(), Path::new(""));
    assert!(seeds.iter().filter(|s| sound(s).is_ok()).count() > 1, "the corpus has sound files");
    mutate::survives(&seeds, 4000, |bytes| {
        let text = String::from_utf8_lossy(bytes);
        match Form::text("c.ron", &text, Path::new("")) {
            Ok(_) => true,
            Err(failure) => {
                assert!(!failure.faults.is_empty(), "refused without a fault");
                // Printing must not fail, although the positions of faults may be anywhere in the
                // text.
                assert!(!failure.to_string().is_empty());
                false
            }
        }
    });
}

#[test]
fn outcomes_are_read_or_refused() {
    let outcome = |ended, y: f64| Outcome {
        run: 7,
        ended,
        why: "t = 1.5 s: `Body.x` became NaN\n".into(),
        time: 1.5,
        seed: u64::MAX,
        hash: 0x0123_4567_89ab_cdef,
        wall: 0.25,
        metrics: vec![y, f64::NAN, -0.0, 1e300],
        phases: vec![0.0, 2.5, f64::NAN],
        history: (y == 1.0).then_some(0x0123_4567),
    };
    let seeds: Vec<Vec<u8>> = [outcome(Cause::Failed, 1.0), outcome(Cause::Until, f64::INFINITY)]
        .map(|o| o.to_text().unwrap().into_bytes())
        .into();
    for seed in &seeds {
        let text = std::str::from_utf8(seed).unwrap();
        assert_eq!(Outcome::from_text(text).unwrap().to_text().unwrap(), text);
    }
    mutate::survives(&seeds, 20_000, |bytes| {
        Outcome::from_text(&String::from_utf8_lossy(bytes)).is_ok()
    });
}
