//! Bit-identical results for any chunks, order of the file, recorder, fork, or fresh process; different results for another seed. The system is
//! `zoo::system`: every container, and a mechanism.
use linkwork_runtime::*;
use linkwork_tests::zoo;
use std::sync::{Arc, Mutex};

const BOTH: [Integrator; 2] = [Integrator::Rk4, Integrator::SemiImplicitEuler];

fn end() -> Seconds {
    Seconds { num: 3, den: 1 }
}

fn whole(spec: &Spec) -> u64 {
    let mut sim = Simulation::new(zoo::plan(spec));
    sim.run_until(end()).unwrap();
    assert!(sim.state().x.iter().all(|x| x.is_finite()));
    sim.hash()
}

/// Golden values would tie the test to one processor, so runs are compared with each other instead.
#[test]
fn chunks_of_any_size_leave_no_trace() {
    for integrator in BOTH {
        let spec = zoo::system(integrator, 7);
        let expected = whole(&spec);
        // The chunks end on ticks, between ticks, and after the end.
        for (num, den) in [(1, 500), (1, 90), (7, 1000), (1, 3), (2, 1)] {
            let mut sim = Simulation::new(zoo::plan(&spec));
            let mut k = 0;
            while sim.before(end()) {
                k += 1;
                let chunk = Seconds::new(k * num, den).unwrap();
                let past = chunk.seconds() > end().seconds();
                sim.run_until(if past { end() } else { chunk }).unwrap();
            }
            assert_eq!(sim.time(), end().seconds());
            assert_eq!(sim.hash(), expected, "{integrator:?}, chunks of {num}/{den} s");
        }
    }
}

#[test]
fn any_order_of_the_file_gives_the_same_plan_and_bits() {
    let spec = zoo::system(Integrator::Rk4, 7);
    let (plan, expected) = (zoo::plan(&spec).hash(), whole(&spec));
    // The shuffles are from a fixed recurrence.
    let mut r = 12345u64;
    let mut next = |n: usize| {
        r = r.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (r >> 33) as usize % n
    };
    for round in 0..5 {
        let mut other = spec.clone();
        for k in (1..other.parts.len()).rev() {
            other.parts.swap(k, next(k + 1));
        }
        for k in (1..other.wires.len()).rev() {
            other.wires.swap(k, next(k + 1));
        }
        for k in (1..other.binds.len()).rev() {
            other.binds.swap(k, next(k + 1));
        }
        assert_eq!(zoo::plan(&other).hash(), plan, "round {round}");
        assert_eq!(whole(&other), expected, "round {round}");
    }
}

#[test]
fn the_seed_and_only_the_seed_changes_the_noise() {
    let spec = |seed| zoo::system(Integrator::Rk4, seed);
    assert_eq!(whole(&spec(7)), whole(&spec(7)));
    assert_ne!(whole(&spec(7)), whole(&spec(8)));
}

struct Rows(Arc<Mutex<Vec<f64>>>);
impl Consumer for Rows {
    fn row(&mut self, row: &Sample) -> Result<(), String> {
        self.0.lock().map_err(|e| e.to_string())?.extend(&row.values);
        Ok(())
    }
    fn finish(&mut self) -> Result<(), String> {
        Ok(())
    }
}

#[test]
fn a_recorder_changes_nothing() {
    let spec = zoo::system(Integrator::Rk4, 7);
    let rows = Arc::new(Mutex::new(Vec::new()));
    let mut sim = Simulation::new(zoo::plan(&spec));
    let places = sim.plan().variables.values().map(|v| v.place).collect();
    let group = Group { period: Seconds { num: 1, den: 100 }, places, ..Group::default() };
    let mut recorder = Recorder::start(&sim, vec![group], 4, Box::new(Rows(rows.clone()))).unwrap();
    recorder.sample(&sim).unwrap();
    while sim.before(end()) {
        sim.step().unwrap();
        recorder.sample(&sim).unwrap();
    }
    recorder.finish().unwrap();
    assert_eq!(rows.lock().unwrap().len(), 301 * sim.plan().variables.len());
    assert_eq!(sim.hash(), whole(&spec));
}

/// Set in the child process: the checkpoint to resume.
const RESUME: &str = "LINKWORK_TESTS_RESUME";

#[test]
fn a_fresh_process_resumes_bit_for_bit() {
    if let Ok(file) = std::env::var(RESUME) {
        let checkpoint = Checkpoint::read(file.as_ref()).unwrap();
        let integrator = BOTH[usize::from(checkpoint.configuration == "euler")];
        let mut sim = Simulation::new(zoo::plan(&zoo::system(integrator, 7)));
        sim.restore(&checkpoint).unwrap();
        sim.run_until(end()).unwrap();
        println!("hash={:016x}", sim.hash());
        return;
    }
    for (integrator, name) in BOTH.into_iter().zip(["rk4", "euler"]) {
        let spec = zoo::system(integrator, 7);
        let expected = format!("hash={:016x}", whole(&spec));
        // The instant is in the middle of the period of every rate.
        let mut sim = Simulation::new(zoo::plan(&spec));
        sim.run_until(Seconds { num: 1357, den: 1000 }).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("half.lwck");
        sim.checkpoint(name).unwrap().write(&file).unwrap();
        let child = std::process::Command::new(std::env::current_exe().unwrap())
            .args(["a_fresh_process_resumes_bit_for_bit", "--nocapture"])
            .env(RESUME, &file)
            .output()
            .unwrap();
        let text = String::from_utf8_lossy(&child.stdout);
        assert!(child.status.success(), "{text}");
        assert!(text.contains(&expected), "{name}: wanted {expected} in\n{text}");
    }
}
