//! Recorders: what a slow, a frozen, a failing consumer costs the run, and what a flush promises.
use crate::common::*;
use linkwork_runtime::*;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// Rows, as far as a consumer has brought them to safety.
#[derive(Default)]
struct Store {
    rows: Vec<f64>,
    safe: usize,
}

struct Slow {
    store: Arc<Mutex<Store>>,
    /// A row is taken when something comes through here; `None`: at once.
    gate: Option<Receiver<()>>,
    /// Fails at this row.
    fails: Option<usize>,
}

impl Consumer for Slow {
    fn row(&mut self, row: &Sample) -> Result<(), String> {
        if let Some(gate) = &self.gate {
            let _ = gate.recv();
        }
        let mut store = self.store.lock().unwrap();
        store.rows.push(row.t);
        if self.fails == Some(store.rows.len()) { Err("no more".into()) } else { Ok(()) }
    }
    fn flush(&mut self) -> Result<(), String> {
        let mut store = self.store.lock().unwrap();
        store.safe = store.rows.len();
        Ok(())
    }
    fn finish(&mut self) -> Result<(), String> {
        self.flush()
    }
}

struct Lab {
    sim: Simulation,
    recorder: Recorder,
    store: Arc<Mutex<Store>>,
    gate: Sender<()>,
}

/// A recorder of four rows, one a step.
fn lab(overflow: Overflow, gated: bool, fails: Option<usize>) -> Lab {
    let spec = spec(vec![part("gain", "t.integrator", &[], None)], &[]);
    let sim = Simulation::new(plan(&spec));
    let group = Group { period: sim.plan().step, ..Group::default() };
    let (gate, wait) = channel();
    let store = Arc::new(Mutex::new(Store::default()));
    let gate_of = gated.then_some(wait);
    let consumer = Slow { store: store.clone(), gate: gate_of, fails };
    let recorder = Recorder::with(&sim, vec![group], 4, overflow, Box::new(consumer)).unwrap();
    Lab { sim, recorder, store, gate }
}

impl Lab {
    fn steps(&mut self, n: usize) -> Result<(), String> {
        for _ in 0..n {
            self.recorder.sample(&self.sim)?;
            self.sim.step().unwrap();
        }
        Ok(())
    }
}

#[test]
fn a_frozen_consumer_costs_rows_and_not_the_run() {
    let mut l = lab(Overflow::Drop, true, None);
    // The consumer accepts no row, so a recorder that waits would block forever.
    l.steps(500).unwrap();
    assert!(l.recorder.dropped() >= 500 - 6, "{} rows dropped", l.recorder.dropped());
    // The consumer continues: rows arrive again, and the number of dropped rows stays.
    for _ in 0..600 {
        l.gate.send(()).unwrap();
    }
    let lost = l.recorder.dropped();
    for _ in 0..50 {
        std::thread::sleep(Duration::from_millis(1));
        l.steps(1).unwrap();
    }
    let dropped = l.recorder.dropped();
    assert!(dropped < lost + 45, "it takes rows again, and {} more are dropped", dropped - lost);
    l.recorder.finish_within(Duration::from_secs(10)).unwrap();
    let store = l.store.lock().unwrap();
    assert_eq!(store.rows.len() as u64 + dropped, 550);
    assert!(store.rows.is_sorted_by(|a, b| a < b));
}

#[test]
fn the_end_of_a_frozen_consumer_is_not_waited_for() {
    let mut l = lab(Overflow::Drop, true, None);
    l.steps(10).unwrap();
    let e = l.recorder.finish_within(Duration::from_millis(50)).unwrap_err();
    assert!(e.contains("0.05 s"), "{e}");
}

#[test]
fn a_consumer_that_must_have_every_row_gets_it() {
    let mut l = lab(Overflow::Wait, true, None);
    let gate = l.gate.clone();
    let feeder = std::thread::spawn(move || {
        for _ in 0..200 {
            std::thread::sleep(Duration::from_micros(200));
            let _ = gate.send(());
        }
    });
    l.steps(200).unwrap();
    assert_eq!(l.recorder.dropped(), 0);
    l.recorder.finish().unwrap();
    feeder.join().unwrap();
    assert_eq!(l.store.lock().unwrap().rows.len(), 200);
}

#[test]
fn a_flush_waits_until_the_rows_are_safe() {
    let mut l = lab(Overflow::Wait, false, None);
    for n in 1..=20 {
        l.steps(7).unwrap();
        l.recorder.flush().unwrap();
        assert_eq!(l.store.lock().unwrap().safe, 7 * n);
    }
    l.recorder.finish().unwrap();
}

#[test]
fn a_failure_is_told_by_whatever_comes_next() {
    for n in [1, 5, 9] {
        let mut l = lab(Overflow::Wait, false, Some(n));
        let e = l.steps(100).unwrap_err();
        assert_eq!(e, "no more", "at row {n}");
        let mut l = lab(Overflow::Wait, false, Some(n));
        let told = l.steps(n).and_then(|()| l.recorder.flush());
        assert_eq!(told.unwrap_err(), "no more", "a flush after row {n}");
        assert_eq!(l.store.lock().unwrap().safe, n, "it finishes after a failure");
    }
}
