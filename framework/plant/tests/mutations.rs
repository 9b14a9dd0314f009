//! Checkpoints under mutations, their checksums made to fit, and what fuzzing kept: a state is taken or refused, and
//! nothing panics.
#![allow(clippy::unwrap_used)]
mod common;
#[path = "../../../tests/fuzz/mutate.rs"]
mod mutate;
use common::*;
use linkwork_plant::*;
use linkwork_runtime::*;

/// With the checksum of its contents, so that these are looked at.
fn sealed(mut bytes: Vec<u8>) -> Vec<u8> {
    if bytes.len() >= 16 {
        let sum = noise::hash(bytes[16..].iter().copied()).to_le_bytes();
        bytes[8..16].copy_from_slice(&sum);
    }
    bytes
}

/// An arm and a weight, with a sampled part and one that stores.
fn machine() -> Simulation {
    let (multibody, q, v) = swinging_arm();
    let mut s = spec(vec![], &[]);
    s.set_mechanism(MechanismSpec::new("Mechanism", multibody, q, v));
    Simulation::new(plan(&s))
}

#[test]
fn checkpoints_are_taken_or_refused() {
    let mut sim = machine();
    sim.run_until(seconds(0.02)).unwrap();
    sim.pin("arm.rate", 0.25).unwrap();
    let mut sound = sim.checkpoint("Simulation()\n").unwrap();
    sound.extra.insert("figures".into(), vec![1, 2, 3]);
    let mut seeds = vec![sound.to_bytes().unwrap()];
    assert!(Checkpoint::from_bytes(&seeds[0]).is_ok());
    seeds.extend(mutate::kept("checkpoint"));
    let (mut taken, mut stepped) = (0, 0);
    mutate::survives(&seeds, 6000, |bytes| {
        // The checksum detects the mutated checkpoint; an unchanged one is still valid.
        let plain = Checkpoint::from_bytes(bytes).is_ok();
        assert!(!plain || seeds.iter().any(|s| s == bytes), "a mutation is not noticed");
        let Ok(checkpoint) = Checkpoint::from_bytes(&sealed(bytes.to_vec())) else { return false };
        let mut run = machine();
        if run.restore(&checkpoint).is_ok() {
            taken += 1;
            // Steps end or report a fault, whatever the numbers are.
            stepped += u32::from((0..3).all(|_| run.step().is_ok()));
        }
        true
    });
    // Measured: 150 of 6000 mutated checkpoints are accepted.
    assert!(taken > 10 && stepped > 2, "{taken} taken, {stepped} go on");
}

#[test]
fn what_a_tap_remembers_is_taken_or_refused() {
    struct Nobody;
    impl Consumer for Nobody {
        fn row(&mut self, _: &Sample) -> Result<(), String> {
            Ok(())
        }
        fn finish(&mut self) -> Result<(), String> {
            Ok(())
        }
    }
    let groups = |sim: &Simulation| {
        let when = Condition::parse("arm.angle > 100 rad", &sim.plan().variables).unwrap();
        let around = Around { when, before: seconds(0.005), after: seconds(0.005) };
        let places = ["arm.angle", "arm.rate"].map(|p| sim.variable(p).unwrap().place).to_vec();
        let period = sim.plan().step;
        let around = Some(around);
        vec![
            Group { period, places: places.clone(), around, ..Group::default() },
            Group { period, places, on_change: true, ..Group::default() },
        ]
    };
    let recorder =
        |sim: &Simulation| Recorder::start(sim, groups(sim), 8, Box::new(Nobody)).unwrap();
    let mut sim = machine();
    let mut first = recorder(&sim);
    for _ in 0..12 {
        first.sample(&sim).unwrap();
        sim.step().unwrap();
    }
    first.sample(&sim).unwrap();
    let seeds = [first.carry().unwrap()];
    assert!(recorder(&sim).resume(&seeds[0], &sim).is_ok());
    mutate::survives(&seeds, 3000, |bytes| {
        let mut second = recorder(&sim);
        let taken = second.resume(bytes, &sim).is_ok();
        second.sample(&sim).unwrap();
        taken
    });
}
