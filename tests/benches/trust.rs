//! Cost of saving the rover of `sims/rover_traverse`: a checkpoint taken, written without waiting for the disk, read and restored; and the cost of a
//! sample for a live client on the socket, in the thread of the run.
//!
//! `cargo bench -p linkwork-tests --bench trust`; whole runs with a client: tests/benches/watcher.
#![allow(missing_docs, clippy::disallowed_methods, clippy::unwrap_used)]
use linkwork_live::{Client, Live, ReplyKind, RequestKind, Server, Ticket, VERSION};
use linkwork_runner::{Runner, Watch};
use linkwork_runtime::{Checkpoint, Seconds, Simulation};
use std::hint::black_box;
use std::time::{Duration, Instant};

#[path = "../common/mod.rs"]
mod common;

/// Milliseconds: median and maximum of 200 calls.
fn measure(what: &str, mut call: impl FnMut()) {
    let mut all: Vec<f64> = (0..200)
        .map(|_| {
            let start = Instant::now();
            call();
            start.elapsed().as_secs_f64() * 1e3
        })
        .collect();
    all.sort_by(f64::total_cmp);
    println!("{what:48} {:7.3} ms, at most {:7.3}", all[all.len() / 2], all[all.len() - 1]);
}

struct Nothing;

impl Watch for Nothing {
    fn tick(&mut self, _: &Simulation) {}
}

/// Measures the fraction of its time that the thread of a run spends on a client that requests all signals of the rover at 100 samples per second of
/// wall time.
fn watched(sim: Simulation) {
    let mut runner = Runner::new(sim, Nothing);
    let mut live = Live::new(Server::start("127.0.0.1:0", "traverse").unwrap());
    let server = live.server();
    let (address, token) = (server.address().to_string(), server.token().to_string());
    let ticket = Ticket { version: VERSION, address, token };
    let (tell, told) = std::sync::mpsc::channel();
    let client = std::thread::spawn(move || {
        let mut client = Client::connect(&ticket).unwrap();
        let said = client.ask(RequestKind::List { patterns: vec!["Rover.**".into()] }).unwrap();
        let ReplyKind::Names { names } = said else { panic!("{said:?}") };
        let paths: Vec<String> = names.into_iter().map(|(path, _)| path).collect();
        tell.send(paths.len()).unwrap();
        client.ask(RequestKind::Watch { paths, rate: 100.0 }).unwrap();
        let mut rows = 0;
        while let Ok(reply) = client.receive() {
            rows += usize::from(matches!(reply.said, ReplyKind::Values { .. }));
        }
        rows
    });
    // The bench works like a run: some milliseconds of steps, then pending requests are served.
    let (mut numbers, mut spent, mut began) = (0, Duration::ZERO, None);
    let begin = Instant::now();
    while begin.elapsed() < Duration::from_secs(8) {
        let steps = Instant::now();
        while steps.elapsed() < Duration::from_millis(3) {
            runner.sim_mut().step().unwrap();
        }
        let start = Instant::now();
        live.attend(&mut runner, 1);
        if let Ok(n) = told.try_recv() {
            numbers = n;
        }
        if began.is_some() {
            spent += start.elapsed();
        } else if begin.elapsed() > Duration::from_secs(2) {
            began = Some(Instant::now());
        }
    }
    let (spent, whole) = (spent.as_secs_f64(), began.unwrap().elapsed().as_secs_f64());
    drop(live);
    let rows = client.join().unwrap();
    assert!(numbers > 500 && rows > 300, "{rows} rows of {numbers} numbers");
    println!(
        "100 rows a second of {numbers} numbers for a watcher: {:.2} % of the thread of a run (goal 1 %)",
        spent / whole * 100.0
    );
}

fn main() -> Result<(), String> {
    let (mut sim, configuration) =
        common::traverse_resolved(&["Rover.contact=mobility.wheel_soil"])?;
    sim.run_until(Seconds { num: 10, den: 1 }).map_err(|e| e.to_string())?;
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("c.lwck");
    let take = |sim: &Simulation| sim.checkpoint(&configuration).unwrap();
    let bytes = take(&sim).to_bytes().unwrap();
    println!("a checkpoint of the rover on soil with ruts: {} kB", bytes.len() / 1000);
    measure("taken and written without sync (goal 1 ms)", || {
        std::fs::write(&file, take(&sim).to_bytes().unwrap()).unwrap();
    });
    measure("taken and written with sync, under its name", || take(&sim).write(&file).unwrap());
    let hash = sim.hash();
    measure("read and taken back (goal 1 ms)", || {
        sim.restore(black_box(&Checkpoint::read(&file).unwrap())).unwrap();
    });
    assert_eq!(sim.hash(), hash);
    watched(sim);
    Ok(())
}
