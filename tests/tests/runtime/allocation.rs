//! Stepping does not allocate: the complete `zoo::system`, both integrators.
use allocation_counter::measure;
use linkwork_runtime::{Integrator, Simulation, Snapshot};
use linkwork_tests::zoo;

#[test]
fn the_counter_counts() {
    assert_eq!(measure(|| drop(std::hint::black_box(vec![1u8; 100]))).count_total, 1);
}

#[test]
fn stepping_allocates_nothing() {
    for integrator in [Integrator::Rk4, Integrator::SemiImplicitEuler] {
        let mut sim = Simulation::new(zoo::plan(&zoo::system(integrator, 3)));
        // Allocations are counted from the first step on, for a whole hyperperiod (1 s) and more.
        let counts = measure(|| {
            for _ in 0..700 {
                sim.step().unwrap();
            }
        });
        assert!(sim.time() > 1.0, "{}", sim.time());
        assert_eq!(counts.count_total, 0, "{integrator:?}: {counts:?}");
    }
}

#[test]
fn stepping_with_pins_allocates_nothing() {
    for integrator in [Integrator::Rk4, Integrator::SemiImplicitEuler] {
        let mut sim = Simulation::new(zoo::plan(&zoo::system(integrator, 3)));
        // The pins include every kind of variable that can be pinned.
        let names: Vec<String> = sim.plan().lanes.keys().cloned().collect();
        let pinned = names.iter().step_by(7).filter(|n| {
            let now = sim.get(n).unwrap();
            sim.pin(n, now).is_ok()
        });
        assert!(pinned.count() > 5);
        let counts = measure(|| {
            for _ in 0..700 {
                sim.step().unwrap();
            }
        });
        assert_eq!(counts.count_total, 0, "{integrator:?}: {counts:?}");
    }
}

#[test]
fn a_snapshot_without_stores_is_refilled_in_place() {
    let mut spec = zoo::system(Integrator::Rk4, 3);
    spec.parts.retain(|p| p.path != "c.mean");
    spec.wires.retain(|w| w.from.part != "c.mean" && w.to.part != "c.mean");
    let mut sim = Simulation::new(zoo::plan(&spec));
    let mut snapshot = Snapshot::default();
    sim.save_into(&mut snapshot);
    sim.step().unwrap();
    let counts = measure(|| sim.save_into(&mut snapshot));
    assert_eq!(counts.count_total, 0, "{counts:?}");
}
